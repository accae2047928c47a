"""What holds a deck: blocks of supports by step, AUTOSPC of free decks, springs to ground; and fields that repeat."""

from __future__ import annotations

import json

import numpy as np
import pytest
from support import abaqus_decks, nastran_decks

from femflex.decks import read_deck
from femflex.reduction import free_free_modes

FIRST = "11, 2, 2\n*STEP\n*STATIC\n*BOUNDARY\n6, 3, 3\n*END STEP\n*STEP\n*FREQUENCY\n4\n"


@pytest.mark.parametrize(
    ("blocks", "held"),
    [
        ("*BOUNDARY, OP=NEW\n1, 1, 3\n*BOUNDARY, OP=NEW\n1, 4, 6\n", {1: 6}),
        ("*BOUNDARY, OP=NEW\n", {}),
        ("*BOUNDARY\n1, ENCASTRE\n", {1: 6, 6: 1, 11: 1}),
    ],
)
def test_new_supports_of_step_replace_earlier_ones(tmp_path, blocks, held):
    text = abaqus_decks.beam("RECT", "20., 10.\n0., 1., 0.", FIRST + blocks + "*END STEP")
    imported = abaqus_decks.deck(tmp_path, text)
    number = {row: node for node, row in imported.points_of_ids.items()}
    computed: dict[int, int] = {}
    for group, support in imported.active_supports().items():
        for row in imported.mesh.group_points(group):
            computed[number[row]] = computed.get(number[row], 0) + len(support.components)
    assert computed == held
    if held == {1: 6}:  # the beam's first bending, by the closed form
        reference = abaqus_decks.clamped(0.02 * 0.01**3 / 12, 2e-4)
        assert abaqus_decks.frequencies(imported, 1)[0] == pytest.approx(reference, rel=2e-3)


def test_repeated_fields(tmp_path):
    full = nastran_decks.bar(3, 1.5)
    bare = [
        *(
            "GRID,1,,0.,0.,0.",
            "GRID,2,,*(.5),=,=",
            "GRID,*(1),,*(.5),==",
            "GRID,4,=,1.5,==",
            full[4],
            "CBAR,2,3,2,3,==",
        ),
        *("CBAR,3,=,3,4,==", *full[7:]),
    ]
    assert nastran_decks.frequencies(nastran_decks.read_deck_of_cards(tmp_path, *bare)) == pytest.approx(
        nastran_decks.frequencies(nastran_decks.read_deck_of_cards(tmp_path, *full)), rel=1e-12
    )


def free(imported, n: int) -> np.ndarray:
    return free_free_modes(imported.structure(), n).omega[:n] / (2 * np.pi)


def test_autospc_of_free_deck(tmp_path):
    bars = [*nastran_decks.bar(4, 2.0)[:-1], "GRID,6,,2.,1.,0.", "CBAR,6,3,5,6,0.,0.,1."]
    alone = free(nastran_decks.read_deck_of_cards(tmp_path, *bars, control="ECHO = NONE"), 4)
    cards = ["GRID,9,,1.,.5,.3", "RBE3,9,,9,1346,1.,123,1,3", ",5,6"]
    assert free(nastran_decks.read_deck_of_cards(tmp_path, *bars, *cards, control="ECHO = NONE"), 4) == pytest.approx(
        alone, rel=1e-8
    )


@pytest.mark.parametrize("turning", [False, True])
def test_springs_to_ground_support_deck(tmp_path, turning, femflex):
    inertia = ["CONM2,9,1,,2.", ",3.,,4.,,,5."] if turning else ["CONM2,9,1,,2."]
    springs = [f"CELAS2,{c},{1000.0 * c},1,{c}" for c in range(1, 7 if turning else 4)]
    imported = nastran_decks.read_deck_of_cards(tmp_path, "GRID,1,,0.,0.,0.", *inertia, *springs, control="ECHO = NONE")
    size = np.array([2.0, 2.0, 2.0, 3.0, 4.0, 5.0])[: len(springs)]
    reference = np.sort(np.sqrt(1000.0 * np.arange(1, len(springs) + 1) / size)) / (2 * np.pi)
    assert free(imported, len(springs)) == pytest.approx(reference, rel=1e-9)
    case = """
        run = { duration = 0.01, samples = 3 }
        joints = [{ kind = "weld", child = "b" }]
        [bodies.b]
        kind = "flexible"
        deck = "deck.bdf"
        units = "m-kg-s"
        reduction = { method = "free_free", modes = %d }
    """
    (tmp_path / "case.toml").write_text(case % len(springs))
    code, out, err = femflex("modes", "case.toml", "--json")
    assert code == 0, err
    assert [mode["Hz"] for mode in json.loads(out)["modes"]] == pytest.approx(reference, rel=1e-9)


def test_set_of_generated_elements_includes_master(tmp_path):
    text = abaqus_decks.beam("RECT", "20., 10.\n0., 1., 0.", n=4)
    head, _, tail = text.partition("*ELEMENT")
    text = f"{head}*ELEMENT, TYPE=B31\n1, 1, 2\n*ELGEN, ELSET=BOOM\n1, 4\n*MATERIAL{tail.partition('*MATERIAL')[2]}"
    path = tmp_path / "model.inp"
    path.write_text(text)
    assert len(read_deck(path, "mm-t-s").mesh.group_cells("BOOM")["line"]) == 4


@pytest.mark.parametrize(
    ("cards", "ways", "k", "ground"),
    [
        (["SPOINT,101", "CELAS2,20,{k},1,2,101", "CMASS4,30,{m},101"], 1, 500.0, 0.0),
        (["CELAS2,20,{k},1,2,101", "CMASS2,30,{m},101", "SPOINT,2", "SPC1,2,0,101,2"], 1, 500.0, 0.0),
        (["CELAS4,20,{k},101", "CELAS2,21,{k},1,3,101", "CMASS2,30,1.5,101", "CMASS2,31,.5,101"], 1, 500.0, 500.0),
        (["CELAS2,20,{k},1,2,101", "CELAS2,21,{k},1,3,102", "CMASS4,9,{m},101", "CMASS4,8,{m},102"], 2, 500.0, 0.0),
        (["MPC,5,9,0,1.,1,3,-1.", "CELAS1,2,7,9,,8", "PELAS,7,{k}", "CMASS3,3,8,8", "PMASS,8,{m}"], 1, 500.0, 0.0),
        (["SPOINT,101,THRU,103", "MPC,5,101,0,1.,1,3,-1.", "CMASS2,30,{m},101,0", "CELAS2,9,5.,103,0"], 1, np.inf, 0.0),
        (["CMASS2,30,{m},1,2"], 1, np.inf, 0.0),
    ],
    ids=["spring", "without SPOINT", "to ground", "two ways", "equation and spring", "equation", "at a grid"],
)  # fmt: skip
def test_scalar_points_move_along_one_component_alone(tmp_path, cards, ways, k, ground):
    """A mass m on a spring k, or rigidly, at a heavy sprung grid: two masses in series along it, one across it."""
    M, K, m = 8.0, 3000.0, 2.0
    heavy = ["GRID,1,,0.,0.,0.", f"CONM2,9,1,,{M}", *(f"CELAS2,{c},{K},1,{c}" for c in (1, 2, 3))]
    cards = [*heavy, *(card.format(k=k, m=m) for card in cards)]
    imported = nastran_decks.read_deck_of_cards(tmp_path, *cards, control="MPC = 5")
    along = [K / (M + m)]
    if np.isfinite(k):
        along = np.linalg.eigvals(np.linalg.solve(np.diag([M, m]), [[K + k, -k], [-k, k + ground]]))
    reference = np.sort([*np.tile(along, ways), *[K / M] * (3 - ways)])
    assert free(imported, len(reference)) == pytest.approx(np.sqrt(reference) / (2 * np.pi), rel=1e-9)
