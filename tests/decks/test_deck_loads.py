"""Static loads of decks: resultants by hand, Archimedes, closed forms, and static solves of the whole structure."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.sparse.linalg import spsolve
from support.nastran_decks import STEEL, bar, lines, plate, read_deck_of_cards, written

from femflex import System, build_system, equilibrium, read_case
from femflex.decks import Deck, read_deck
from femflex.effectors import DistributedLoad
from femflex.reduction import cantilever_modes, reduce_structure
from femflex.system import weld, with_effectors

X, Y, Z = np.eye(3)
L, G, SMALL = 2.0, 9.81, 1e-3
PLATE = ["PSHELL,3,1,0.01,1", "MAT1,1,2.1E11,,0.,7850."]
BENT = 2.1e11 * 0.5 * 0.01**3 / 12  # EI of `plate` with them
BEAM = 2.1e11 * 0.1 * 0.02**3 / 12, 7850.0 * 0.002  # EI and mass per length of the beams of `abaqus`


def abaqus(folder: Path, elements: str, steps: str, units: str = "m-kg-s", more: str = "") -> Deck:
    """Cantilevers along x: 8 beams (nodes 1 to 9), and 16 shells (nodes 101 to 134), of steel with nu = 0."""
    nodes = [f"{k + 1}, {L * k / 8}, 0, 0" for k in range(9)]
    nodes += [f"{101 + k + 17 * j}, {k / 16}, {0.5 * j}, 0" for j in range(2) for k in range(17)]
    beams = [f"{k}, {k}, {k + 1}" for k in range(1, 9)] if "beams" in elements else []
    shells = [f"{100 + k}, {100 + k}, {101 + k}, {118 + k}, {117 + k}" for k in range(1, 17)]
    text = ["*NODE", *nodes, "*NSET, NSET=ROOT", "1, 101, 118", "*MATERIAL, NAME=STEEL", "*ELASTIC", "2.1E11, 0."]
    text += ["*DENSITY", "7850.", more]
    if beams:
        text += ["*ELEMENT, TYPE=B33, ELSET=BEAMS", *beams, "*BEAM SECTION, ELSET=BEAMS, SECTION=RECT, MATERIAL=STEEL"]
        text += ["0.02, 0.1", "0, 0, -1"]
    if "shells" in elements:
        text += ["*ELEMENT, TYPE=S4, ELSET=SHELLS", *shells, "*SHELL SECTION, ELSET=SHELLS, MATERIAL=STEEL", "0.01"]
        text += ["*SURFACE, NAME=UP", "SHELLS, SPOS", "*SURFACE, NAME=DOWN", "SHELLS, SNEG"]
    path = folder / "model.inp"
    path.write_text("\n".join([*text, "*BOUNDARY", "ROOT, 1, 6", steps, ""]))
    return read_deck(path, units)


def step(*text: str, head: str = "*STEP", kind: str = "*STATIC") -> str:
    return "\n".join([head, kind, *text, "*END STEP"])


def at_rest(deck: Deck, load: str, tip: str, modes: int = 12) -> np.ndarray:
    """Deflection (3,) at a node of the reduced body in equilibrium with a set of loads, as for small ones."""
    deck = deck.with_node_groups([tip])
    structure, supports = deck.structure(), deck.active_supports()
    places = {"tip": tip, "root": next(iter(supports))}
    body = reduce_structure(structure, cantilever_modes(structure, supports, modes), places, loads=deck.loads)
    craft = System({"b": body}, [weld("b", child_marker="root")])
    found = equilibrium(with_effectors(craft, {"q": DistributedLoad(body="b", load_set=load, level=SMALL)}))
    return body.markers["tip"].phi @ found.x[: body.n_modes] / SMALL


OF_BARS = {
    "FORCE,4,9,,25.,0.,0.,4.": (100.0 * L**3 / 3, 8e-7, Z),
    "MOMENT,4,9,,10.,0.,0.,1.": (10.0 * L**2 / 2, 2e-7, Y),
    "PLOAD1,4,{},FY,FR,0.,50.,1.,50.": (50.0 * L**4 / 8, 2e-7, Y),
    "PLOAD1,4,{},FZE,LE,0.,50.,.25,50.": (50.0 * L**4 / 8, 8e-7, Z),
    "GRAV,4,,9.81,0.,0.,-1.": (-7850e-3 * G * L**4 / 8, 8e-7, Z),
    "FORCE,2,9,,100.,0.,1.,0.\nGRAV,3,,9.81,0.,1.,0.\nLOAD,4,2.,.5,2,-1.5,3": (
        100.0 * L**3 / 3 - 3 * 7850e-3 * G * L**4 / 8, 2e-7, Y),
}  # fmt: skip


@pytest.mark.parametrize("card", OF_BARS)
def test_loads_bend_bars_by_the_closed_form(card, tmp_path):
    cards = [card.format(k) for k in range(1, 9)] if "{}" in card else card.split("\n")
    deck = read_deck_of_cards(tmp_path, *bar(), *cards)
    assert not deck.unused
    work, second_moment, axis = OF_BARS[card]
    np.testing.assert_allclose(at_rest(deck, "load 4", "node_9"), work / (2.1e11 * second_moment) * axis, atol=2e-5)


PLATES = ["PLOAD4,2,100,7.,,,,THRU,131", "PLOAD4,2,100,7.,,,,THRU,131\n,,0.,0.,1.", "PLOAD2,2,7.,100,THRU,131"]


@pytest.mark.parametrize("card", PLATES)
def test_pressure_bends_a_plate_by_the_closed_form(card, tmp_path):
    deck = read_deck_of_cards(tmp_path, *plate(*PLATE, n=16), *card.split("\n"))
    np.testing.assert_allclose(at_rest(deck, "load 2", "node_34"), 7.0 * 0.5 / 8 / BENT * Z, rtol=2e-3, atol=1e-9)


OF_ABAQUS = {
    "*CLOAD\n9, 3, 100.": ("beams", 100.0 * L**3 / 3 / BEAM[0]),
    "*CLOAD\n9, 5, -10.": ("beams", 10.0 * L**2 / 2 / BEAM[0]),
    "*DLOAD\nBEAMS, PZ, 50.": ("beams", 50.0 * L**4 / 8 / BEAM[0]),
    "*DLOAD\nBEAMS, GRAV, 9.81, 0, 0, -2": ("beams", -BEAM[1] * G * L**4 / 8 / BEAM[0]),
    "*DLOAD\nSHELLS, P, 7.": ("shells", 7.0 * 0.5 / 8 / BENT),
    "*DSLOAD\nUP, P, -3.\nDOWN, P, 4.": ("shells", 7.0 * 0.5 / 8 / BENT),
}


@pytest.mark.parametrize("load", OF_ABAQUS)
def test_loads_of_abaqus_bend_cantilevers_by_the_closed_form(load, tmp_path):
    elements, deflection = OF_ABAQUS[load]
    deck = abaqus(tmp_path, elements, step(load))
    tip = at_rest(deck, "step 1", "node_9" if elements == "beams" else "node_134")
    np.testing.assert_allclose(tip, deflection * Z, rtol=3e-3, atol=1e-9)


def test_body_with_all_its_modes_rests_as_the_whole_structure_does(tmp_path):
    """Forces, moments, loads on bars with offsets and pins, and at nodes that others carry, against K u = f."""
    loads = [
        "FORCE,2,20,,40.,1.,2.,3.",
        "MOMENT,2,6,,10.,3.,-2.,1.",
        "PLOAD1,2,3,FZ,FR,0.,30.,1.,30.",
        "FORCE,2,1,,9.,1.",
    ]
    cards = [*bar(), "GRID,20,,2.,.3,.1", "RBE2,50,9,123456,20", "CBAR,30,3,5,9,0.,0.,1.,,,56",
             ",,.0,.1,.05,0.,0.,.02", "PLOAD1,2,30,FX,FR,0.,30.,1.,30.", *loads]  # fmt: skip
    deck = read_deck_of_cards(tmp_path, *cards)
    structure, supports, loads = deck.structure(), deck.active_supports(), deck.loads["load 2"]
    f = np.zeros((2, len(deck.mesh.points), 3))
    np.add.at(f, (0, loads.points), loads.forces)
    np.add.at(f, (1, loads.points), loads.torques)
    Q = structure.translation.T @ f[0].ravel() + structure.rotation.T @ f[1].ravel()
    free = np.setdiff1d(np.arange(structure.n_dof), structure.constrained_dofs(supports))
    u = np.zeros(structure.n_dof)
    u[free] = spsolve(structure.K.tocsc()[free][:, free], Q[free])
    expected = (structure.translation @ u).reshape(-1, 3)[deck.points_of_ids[20]]
    np.testing.assert_allclose(at_rest(deck, "load 2", "node_20", len(free)), expected, rtol=1e-6)


CASE = """
[run]
duration = "1 s"
output_step = "0.1 s"
[bodies.mast]
kind = "flexible"
deck = "deck.bdf"
refine = {refine}
reduction = {{ method = "cantilever", clamp = "supports", modes = 12 }}
[bodies.mast.markers]
root = {{ group = "node_1" }}
tip = {{ group = "node_9" }}
[[joints]]
kind = "weld"
child = "mast"
child_marker = "root"
[distributed_loads.wind]
body = "mast"
load_set = "load 2"
level = 0.01
"""


@pytest.mark.parametrize("refine", [0, 1])
def test_case_uses_a_set_of_loads_at_a_level(refine, tmp_path):
    written(tmp_path, *bar(), *(f"PLOAD1,2,{k},FY,FR,0.,50.,1.,50." for k in range(1, 9)), "GRAV,2,,9.81,0.,0.,-1.")
    path = tmp_path / "case.toml"
    path.write_text(CASE.format(refine=refine))
    found = equilibrium(build_system(read_case(path)))
    tip = found.model.observe(np.zeros(1), found.x[None])["markers/mast.tip/deflection"][0]
    y, z = 50.0 / 2.1e11 / 2e-7, -7850e-3 * G / 2.1e11 / 8e-7
    np.testing.assert_allclose(tip[1:], 0.01 * L**4 / 8 * np.array([y, z]), rtol=2e-3)


# Resultants, in mm-t-s

SQUARE = [f"GRID,{k + 1},,{x}.,{y}.,0." for k, (x, y) in enumerate([(0, 0), (1000, 0), (1000, 500), (0, 500)])]
SQUARE += ["CQUAD4,10,3,1,2,3,4", *PLATE, "CBAR,30,5,1,2,0.,0.,1.", "PBAR,5,1,100.,1.+4,1.+4,1.+4", "SPC1,1,123456,1"]
SQUARE += ["CORD2R,5,,0.,0.,0.,0.,1.,0.", ",0.,0.,1.", "CORD2C,6,,0.,0.,0.,0.,0.,1.", ",1.,0.,0."]  # 5: z, x, y
OUT = (2 * X + Y) / np.sqrt(5)
RESULTANTS = {  # force [N], moment about the origin [N m], force per mass [m/s^2]
    "FORCE,2,2,5,10.,1.,0.,2.": (10 * Z + 20 * Y, 20 * Z - 10 * Y, 0 * X),
    "FORCE,2,3,6,5.,1.,0.,0.": (5 * OUT, 0 * X, 0 * X),
    "FORCE1,2,2,5.,1,3": (5 * OUT, np.sqrt(5) * Z, 0 * X),
    "MOMENT,2,2,5,1000.,0.,1.,0.": (0 * X, X, 0 * X),
    "MOMENT1,2,2,1000.,1,4": (0 * X, Y, 0 * X),
    "PLOAD,2,.002,1,2,3": (500 * Z, 250 / 3 * X - 1000 / 3 * Y, 0 * X),
    "PLOAD,2,.002,1,4,3,2": (-1000 * Z, -250 * X + 500 * Y, 0 * X),
    "PLOAD2,2,.002,10": (1000 * Z, 250 * X - 500 * Y, 0 * X),
    "PLOAD4,2,10,.002,.004,.004,.002": (1500 * Z, 375 * X - 2500 / 3 * Y, 0 * X),
    "PLOAD4,2,10,.002\n,5,0.,0.,3.": (1000 * Y, 500 * Z, 0 * X),
    "PLOAD1,2,30,FYE,LE,0.,3.,1000.,3.": (3000 * Z, -1500 * Y, 0 * X),
    "PLOAD1,2,30,FZE,FR,0.,3.,1.,3.": (-3000 * Y, -1500 * Z, 0 * X),
    "GRAV,2,5,9810.,0.,0.,-1.": (0 * X, 0 * X, -9.81 * Y),
    "FORCE,1,2,,10.,1.\nGRAV,3,,1000.,0.,0.,1.\nLOAD,2,2.,3.,1,.5,3": (60 * X, 0 * X, Z),
}


@pytest.mark.parametrize("cards", RESULTANTS)
def test_loads_of_nastran_have_the_resultant_by_hand(cards, tmp_path):
    deck = read_deck_of_cards(tmp_path, *SQUARE, *cards.split("\n"), units="mm-t-s")
    loads = deck.loads["load 2"]
    for value, expected in zip(
        (*loads.resultant(deck.mesh.points), loads.acceleration), RESULTANTS[cards], strict=True
    ):
        np.testing.assert_allclose(value, expected, atol=1e-9)


LEFT_OUT = {
    "PLOAD1,2,30,FX,FR,.2,3.,1.,3.": "even ones over the whole length",
    "PLOAD1,2,30,MX,FR,0.,3.,1.,3.": "moments and projected loads",
    "PLOAD4,2,30,1.": "name no face",
    "PLOAD2,2,1.,11": "no surface of the structure",
    "PLOAD2,2,1.,11,THRU,19": "no shells",
    "FORCE,2,7,,1.,1.": "grid point 7 is not in the deck",
    "FORCE,2,5,,1.,1.\nGRID,5,,0.,0.,9.": "no element has displacements",
    "GRAV,2,6,9.,1.": "not rectangular",
    "LOAD,2,1.,1.,8": "no load 8",
    "FORCE,2,1,,x,1.": "number is needed",
    "RFORCE,2,1,,1.,1.": "give them in the case",
}


@pytest.mark.parametrize("cards", LEFT_OUT)
def test_loads_that_are_not_understood_are_listed(cards, tmp_path):
    deck = read_deck_of_cards(tmp_path, *SQUARE, *cards.split("\n"), "GRAV,4,,9810.,1.", units="mm-t-s")
    assert [*deck.loads] == ["load 4"]
    assert [LEFT_OUT[cards] in card.consequence for card in deck.unused if card.card == cards.split(",")[0]] == [True]


TURNED = "*NSET, NSET=T\n5\n*TRANSFORM, NSET=T\n0, 1, 0, -1, 0, 0"
STEPS = [
    (step("*CLOAD", "9, 3, 10.", "9, 3, 5.", "*DLOAD", "BEAMS, PZ, 2."), 19 * Z),
    (step("*CLOAD", "9, 3, 7."), 11 * Z),
    (step("*CLOAD", "9, 2, 3.", head="*STEP, PERTURBATION"), 3 * Y),
    (step("*CLOAD", "9, 1, 3.", kind="*FREQUENCY"), 3 * X),
    (step("*DLOAD, OP=NEW"), 7 * Z),
    (step("*CLOAD, OP=NEW, AMPLITUDE=A", "5, 1, 4.", "2, 11, 5."), 4 * Y),
    (step("*DLOAD", "BEAMS, GRAV, 9., 1, 0, 0", "BEAMS, P1, 4.", "*CLOAD, LOAD CASE=2", "9, 1, 8."), 4 * Y),
    (step("*DLOAD", "SHELLS, GRAV, 9., 1, 0, 0"), 4 * Y),
]


def test_loads_of_abaqus_last_as_their_steps_say(tmp_path):
    deck = abaqus(tmp_path, "beams shells", "\n".join(text for text, _ in STEPS), more=TURNED)
    for k, (_, force) in enumerate(STEPS):
        loads = deck.loads[f"step {k + 1}"]
        np.testing.assert_allclose(loads.resultant(deck.mesh.points)[0], force, atol=1e-9)
        np.testing.assert_allclose(loads.acceleration, 9.0 * X * (k == 7))
    texts = " ".join(map(str, deck.unused))
    for words in (
        "amplitudes",
        "components other than",
        "LOADCASE",
        "step 7: it does not act alike",
        "no solid of the",
    ):
        assert words in texts


BLOCK = {  # a solid of each kind: its corners [mm], in the order of the card
    "CHEXA": [[0, 0, 0], [9, 1, 0], [8, 7, 1], [0, 6, 0], [1, 0, 5], [9, 0, 6], [9, 8, 7], [0, 7, 5]],
    "CPENTA": [[0, 0, 0], [9, 1, 0], [1, 7, 1], [1, 0, 5], [9, 0, 6], [0, 7, 8]],
    "CTETRA": [[0, 0, 0], [9, 1, 0], [1, 7, 1], [1, 2, 5]],
    "CPYRAM": [[0, 0, 0], [9, 1, 0], [8, 7, 1], [0, 6, 0], [3, 4, 7]],
}
FACES = {  # corners as on the card, whose order is that of the card's figure
    "CHEXA": ["1432", "5678", "1265", "2376", "3487", "4158"],
    "CPENTA": ["132", "456", "1254", "2365", "3146"],
    "CTETRA": ["132", "124", "234", "314"],
    "CPYRAM": ["1432", "125", "235", "345", "415"],
}
TYPES = {"CHEXA": "C3D8", "CPENTA": "C3D6", "CTETRA": "C3D4", "CPYRAM": "C3D5"}


def volume(kind: str) -> float:
    """Volume [m^3] by the divergence theorem, x . n / 3 over triangles that meet at the middles of the faces."""
    x, total = np.array(BLOCK[kind], float) * 1e-3, 0.0
    for face in FACES[kind]:
        corners = x[[int(c) - 1 for c in face]]
        t, w = np.polynomial.legendre.leggauss(3)
        if len(face) == 3:
            total += corners[0] @ np.cross(corners[1], corners[2]) / 6
            continue
        for a, wa in zip((t + 1) / 2, w / 2, strict=True):
            for b, wb in zip((t + 1) / 2, w / 2, strict=True):
                N = np.array([(1 - a) * (1 - b), a * (1 - b), a * b, (1 - a) * b])
                da, db = np.array([b - 1, 1 - b, b, -b]), np.array([a - 1, -a, a, 1 - a])
                total += wa * wb * (N @ corners) @ np.cross(da @ corners, db @ corners) / 3
    return total


@pytest.mark.filterwarnings("ignore:the support at .* lists corners")  # three points support it
@pytest.mark.parametrize("middles", [(), (99,)])
@pytest.mark.parametrize("kind", BLOCK)
def test_water_pressure_on_a_solid_matches_archimedes(kind, middles, tmp_path):
    """PLOAD4 on all faces, the pressure falling with height by 2 N/mm^2 per mm: the lift is that times the volume."""
    grids = [f"GRID,{k + 1},," + ",".join(f"{v:.1f}" for v in x) for k, x in enumerate(BLOCK[kind])]
    cards = [*grids, *lines(kind, 1, 3, *range(1, len(grids) + 1), *middles), "PSOLID,3,1", STEEL, "SPC1,1,123,1,2,3"]
    cards += ["GRID,99,,4.5,.5,0."] * len(middles)  # between the first two corners; the others are filled in
    for face in FACES[kind]:
        p = [f"{50.0 - 2.0 * BLOCK[kind][int(c) - 1][2]:.1f}" for c in face] + [""] * (4 - len(face))
        of_triangle = {"CTETRA": ({*"1234"} - {*face}).pop() if len(face) == 3 else "", "CPYRAM": face[1], "CPENTA": ""}
        off = face[2] if len(face) == 4 else of_triangle[kind]
        cards.append(f"PLOAD4,2,1,{','.join(p)},{face[0]},{off}")
    deck = read_deck_of_cards(tmp_path, *cards, units="mm-t-s")
    force, _ = deck.loads["load 2"].resultant(deck.mesh.points)
    np.testing.assert_allclose(force, 2e9 * volume(kind) * Z, atol=1e-9 * 2e9 * volume(kind))


@pytest.mark.parametrize("kind", BLOCK)
def test_pressure_and_body_force_of_abaqus_on_solids(kind, tmp_path):
    """Even pressure on all faces has no resultant; the body force is that times the volume; P1 pushes into face 1."""
    n = len(BLOCK[kind])
    more = ["*NODE", *(f"{900 + k}, " + ", ".join(map(str, x)) for k, x in enumerate(BLOCK[kind]))]
    more += [f"*ELEMENT, TYPE={TYPES[kind]}, ELSET=S", ", ".join(map(str, [900, *range(900, 900 + n)]))]
    more += [
        "*SOLID SECTION, ELSET=S, MATERIAL=STEEL",
        "*SURFACE, NAME=F",
        *(f"S, S{k + 1}" for k in range(len(FACES[kind]))),
    ]
    faces = [f"S, P{k + 1}, 3." for k in range(len(FACES[kind]))]
    steps = [step("*DLOAD, OP=NEW", *faces), step("*DLOAD, OP=NEW", "S, BY, 2."), step("*DLOAD, OP=NEW", "S, P1, 3.")]
    steps += [step("*DLOAD, OP=NEW", "*DSLOAD", "F, P, 3.")]
    deck = abaqus(tmp_path, "", "\n".join(steps), "mm-t-s", "\n".join(more))
    whole, body, one, hull = (deck.loads[f"step {k}"].resultant(deck.mesh.points) for k in range(1, 5))
    for part in (*whole, *hull):
        np.testing.assert_allclose(part, 0.0, atol=1e-9)
    np.testing.assert_allclose(body[0], 2e9 * volume(kind) * Y, atol=1e-9)
    x = np.array(BLOCK[kind], float)[[int(c) - 1 for c in FACES[kind][0]]] * 1e-3
    area = sum(np.cross(x[k] - x[0], x[k + 1] - x[0]) / 2 for k in range(1, len(x) - 1))
    np.testing.assert_allclose(one[0], -3e6 * area, atol=1e-9)
