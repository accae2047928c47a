"""Supports, case control, systems, sets and older cards of Nastran decks, by the numbers of their grids."""

from __future__ import annotations

import numpy as np
import pytest
from support.nastran_decks import STEEL, read

from femflex.decks import DeckError, read_deck

WORDS = ("x", "y", "z", "rx", "ry", "rz")
SKEW = ["CORD2R,5,0,0.,0.,0.,.3,.2,.9", ",1.,.5,0.", "CORD2C,6,0,5.,-4.,0.,5.,-4.,1.", ",6.,-4.,0."]
CHAIN = [
    *(f"GRID,{n},,{n}.,0.,0." for n in range(1, 7)), "GRID,7,,7.,.5,0.,5", "GRID,8,,8.,1.,0.,6", "GRID,9,,9.,2.,0.,,46",
    *(f"CBAR,{n},3,{n},{n + 1},0.,1.,0." for n in range(1, 9)), "PBAR,3,1,1.,1.,1.,1.", STEEL, *SKEW,
    "PARAM,AUTOSPC,NO",
]  # fmt: skip


def held(deck, names=None) -> dict[int, str]:
    """Components 1 to 6 that are held at each grid, along whatever axes."""
    found: dict[int, set[int]] = {}
    number = {row: n for n, row in deck.points_of_ids.items()}
    for group, support in deck.held(names).items():
        for row in deck.mesh.group_points(group):
            found.setdefault(number[row], set()).update(WORDS.index(c) + 1 for c in support.components)
    return {n: "".join(map(str, sorted(own))) for n, own in sorted(found.items())}


CARDS = ["SPC,1,1,12,0.,2,3", "SPC1,1,46,3,THRU,5", "SPC1,2,5,2,4", "SPC1,3,123,6", "SPCADD,8,1,3", "SPC1,1,3,1"]


def test_sets_of_supports_hold_what_their_cards_say(tmp_path):
    deck = read(tmp_path, *CHAIN, *CARDS, control="SPC = 8")
    one, three = {1: "123", 2: "3", 3: "46", 4: "46", 5: "46"}, {6: "123"}
    assert deck.default_supports == ("ps", "spc_8")
    assert held(deck, ["spc_1"]) == one and held(deck, ["spc_2"]) == {2: "5", 4: "5"}
    assert held(deck, ["spc_8"]) == one | three and held(deck, ["ps"]) == {9: "46"}
    assert held(deck) == one | three | {9: "46"}
    assert sorted(deck.mesh.group_points("spc_1").tolist()) == [deck.points_of_ids[n] for n in (1, 2, 3, 4, 5)]


def test_components_lie_along_the_displacement_axes_unless_all_three_are_held(tmp_path):
    deck = read(tmp_path, *CHAIN, "SPC1,1,13,1,7,8", "SPC1,2,123,7,8", "SPC1,3,1234,8")
    z = np.array([0.3, 0.2, 0.9]) / np.linalg.norm([0.3, 0.2, 0.9])
    x = np.array([1.0, 0.5, 0.0]) - (np.array([1.0, 0.5, 0.0]) @ z) * z
    x = x / np.linalg.norm(x)
    radial = np.array([3.0, 5.0, 0.0]) / np.hypot(3, 5)
    axes = {
        1: np.eye(3),
        7: np.array([x, np.cross(z, x), z]),
        8: np.array([radial, [-radial[1], radial[0], 0], [0, 0, 1]]),
    }
    number = {row: n for n, row in deck.points_of_ids.items()}
    seen = {}
    for group, support in deck.held(["spc_1"]).items():
        for row in deck.mesh.group_points(group):
            seen[number[row]] = np.asarray(support.axes)
            assert support.components == ("x", "z")
    for n, wanted in axes.items():
        assert seen[n] == pytest.approx(wanted, abs=1e-8)
    for support in deck.held(["spc_2"]).values():
        assert np.asarray(support.axes) == pytest.approx(np.eye(3))
    (one,) = deck.held(["spc_3"]).values()
    assert np.asarray(one.axes) == pytest.approx(axes[8], abs=1e-8)


def test_rotations_of_grids_that_do_not_turn_and_grids_without_elements_are_not_held(tmp_path):
    rods = ["GRID,1,,0.,0.,0.", "GRID,2,,1.,0.,0.", "GRID,3,,0.,1.,0.", "GRID,4,,9.,9.,9.", "CROD,1,7,1,2",
     "CROD,2,7,2,3",
            "PROD,7,1,1.-4", STEEL]  # fmt: skip
    deck = read(tmp_path, *rods, "SPC1,1,123456,1", "SPC1,1,456,2", "SPC1,1,123,4")
    assert held(deck, ["spc_1"]) == {1: "123"}


@pytest.mark.parametrize(
    ("control", "default"),
    [
        ("SPC = 2", ("ps", "spc_2")),
        ("SUBCASE 1\nSPC = 2\nSUBCASE 2\nSPC = 3", ("ps", "spc_2")),
        ("SPC = 3\nSUBCASE 1\nLOAD = 4\nSUBCASE 2\nSPC = 2", ("ps", "spc_3")),
        ("SPC = 3\nSUBCASE 1\nSPC = 2", ("ps", "spc_2")),
        ("SPC=3\nSTEP 1\nSPC=1", ("ps", "spc_1")),
        ("ECHO = NONE", ("ps",)),
    ],
)
def test_case_control_chooses_by_its_first_subcase(tmp_path, control, default):
    deck = read(tmp_path, *CHAIN, *CARDS, control=control)
    assert deck.default_supports == default
    several = [note for note in deck.notes if "the subcases name several sets of SPC" in note]
    expected = {"SUBCASE 1\nSPC = 2\nSUBCASE 2\nSPC = 3": "(2 in the first, then 3)",
                "SPC = 3\nSUBCASE 1\nLOAD = 4\nSUBCASE 2\nSPC = 2": "(3 in the first, then 2)"}  # fmt: skip
    assert bool(several) is (control in expected) and all(expected[control] in note for note in several)


@pytest.mark.parametrize(
    ("cards", "control", "sentence"),
    [
        (CARDS, "SPC = 7", r"case control names SPC set 7, which the deck does not have; it has \[1, 2, 3, 8\]"),
        (
            ["RBE2,9,1,46,9"],
            "ECHO = NONE",
            r"GRID 9 fixes component 4, which is dependent in RBE2 9 \(deck.bdf:\d+\); fix the",
        ),
        (["SPC1,1,3,77"], "SPC = 1", r"SPC1 1 uses grid point 77, which no GRID card defines"),
        (["SPC1,1,37,5"], "SPC = 1", r"SPC1 1 has '37' in field 3, where components 1 to 6 are needed"),
        (["SPC1,1,3,THRU,5"], "SPC = 1", r"SPC1 1 has THRU without a number on both sides"),
        (["SPC1,1,3,5.5"], "SPC = 1", r"SPC1 1 has '5.5' in a list of whole numbers"),
    ],
)
def test_mistakes_in_supports_name_their_sets_and_grids(tmp_path, cards, control, sentence):
    with pytest.raises(DeckError, match=sentence):
        read(tmp_path, *CHAIN, *cards, control=control)


def test_supports_that_change_nothing_are_said(tmp_path):
    deck = read(tmp_path, *CHAIN, "SPC,1,1,1,.5", "SPCR,1,1,1,.5", "SPOINT,50", "SPC1,1,0,50")
    said = [str(one).split(" (first")[0] for one in deck.unused]
    assert "1 SPC D: prescribed displacement is left out; the component is held at zero" in said
    assert "1 SPCR: changes of constraints are left out" in said
    assert "1 SPC1 of scalar points: scalar points are left out" in said
    none = read(tmp_path, *CHAIN, control="SPC = 4")
    assert "case control names SPC set 4, and the deck has no SPC card; it fixes nothing" in none.notes


def test_a_dependent_component_in_a_set_that_is_not_chosen_is_no_problem(tmp_path):
    deck = read(tmp_path, *CHAIN, "RBE2,90,1,123,5", "SPC1,2,2,5", "SPC1,2,4,5", "SPC1,1,123,1", control="SPC = 1")
    assert held(deck, ["spc_2"]) == {5: "4"} or held(deck, ["spc_2"]) == {5: "24"}
    assert held(deck, ["spc_1"]) == {1: "123"}


def test_lists_by_thru_and_by_take_every_second_grid(tmp_path):
    deck = read(tmp_path, *CHAIN, "SPC1,1,1,2,THRU,8,BY,3", "SPC1,1,2,1")
    assert held(deck, ["spc_1"]) == {1: "2", 2: "1", 5: "1", 8: "1"}


# Grids and systems


def test_defaults_of_grids_are_those_of_grdset(tmp_path):
    """CP, CD and PS where a GRID leaves them blank; zero is a number."""
    cards = [
        "GRDSET,,6,,,,5,3",
        "GRID,21,,2.,30.,1.",
        "GRID,22,0,2.,30.,1.",
        "GRID,23,5,1.,2.,3.,0",
        "GRID,24,,1.,0.,0.,6,4",
    ]
    bars = [f"CBAR,{40 + k},3,{a},{b},0.1,.2,1." for k, (a, b) in enumerate(((21, 22), (22, 23), (23, 24)))]
    deck = read(tmp_path, *CHAIN[-7:], *cards, *bars, "SPC1,1,1,21,23")
    z = np.array([0.3, 0.2, 0.9]) / np.linalg.norm([0.3, 0.2, 0.9])
    x = np.array([1.0, 0.5, 0.0]) - (np.array([1.0, 0.5, 0.0]) @ z) * z
    C = np.array([x / np.linalg.norm(x), np.cross(z, x / np.linalg.norm(x)), z])
    at = {
        21: [5 + 2 * np.cos(np.pi / 6), -4 + 1.0, 1.0],
        22: [2.0, 30.0, 1.0],
        23: np.array([1.0, 2, 3]) @ C,
        24: [6, -4, 0.0],
    }
    for number, place in at.items():
        assert deck.mesh.points[deck.points_of_ids[number]] == pytest.approx(np.array(place))
    assert held(deck, ["ps"]) == {21: "3", 22: "3", 23: "3", 24: "4"}
    axes = {}
    for group, support in deck.held(["spc_1"]).items():
        axes |= {int(row): np.asarray(support.axes) for row in deck.mesh.group_points(group)}
    assert axes[deck.points_of_ids[21]] == pytest.approx(C, abs=1e-8)
    assert axes[deck.points_of_ids[23]] == pytest.approx(np.eye(3))


@pytest.mark.parametrize("kind", "RCS")
def test_grids_of_every_kind_of_system_stand_where_their_coordinates_say(tmp_path, kind):
    """In inches, by a system in another that is given by three grids, with a second one on the same card."""
    three = ["GRID,31,,1.,0.,0.", "GRID,32,,1.,.5,2.", "GRID,33,,2.,1.,0.", "CORD1R,2,31,32,33,3,33,31,32"]
    systems = [f"CORD2{kind},4,2,.1,.2,.3,.4,-.1,1.2", ",1.,.3,.2"]
    given = np.array([1.3, 35.0, 50.0] if kind == "S" else [1.3, 35.0, 0.8])
    cards = [*three, *systems, f"GRID,34,4,1.3,35.,{given[2]}", "GRID,35,3,.1,.2,.3", "CONM2,9,34,,1.",
             "CONM2,8,35,,1."]  # fmt: skip
    deck = read(tmp_path, *cards, control="ECHO = NONE", units="in-lbf-s")

    def frame(a, b, c):
        a, b, c = (np.array(v, float) for v in (a, b, c))
        z = (b - a) / np.linalg.norm(b - a)
        y = np.cross(z, c - a) / np.linalg.norm(np.cross(z, c - a))
        return a, np.array([np.cross(y, z), y, z])

    o2, C2 = frame([1, 0, 0], [1, 0.5, 2], [2, 1, 0])
    o3, C3 = frame([2, 1, 0], [1, 0, 0], [1, 0.5, 2])
    o4, C4 = frame(*(o2 + np.array(v) @ C2 for v in ([0.1, 0.2, 0.3], [0.4, -0.1, 1.2], [1.0, 0.3, 0.2])))
    r, t, p = given[0], np.radians(given[1]), np.radians(given[2])
    local = {"R": given, "C": [r * np.cos(t), r * np.sin(t), given[2]],
             "S": r * np.array([np.sin(t) * np.cos(p), np.sin(t) * np.sin(p), np.cos(t)])}[kind]  # fmt: skip
    assert deck.mesh.points[deck.points_of_ids[34]] == pytest.approx((o4 + np.array(local) @ C4) * 0.0254)
    assert deck.mesh.points[deck.points_of_ids[35]] == pytest.approx((o3 + np.array([0.1, 0.2, 0.3]) @ C3) * 0.0254)


def test_directions_on_the_axis_of_a_system_are_those_that_define_it(tmp_path):
    spring = ["CELAS2,1,7.,41,1", "CELAS2,2,8.,41,2", "CELAS2,3,9.,41,3", "CONM2,9,41,,1."]
    for kind, order in (("C", [0, 1, 2]), ("S", [2, 0, 1])):  # spherical: radial is along z here
        cards = [f"CORD2{kind},6,0,5.,-4.,0.,5.,-4.,1.", ",5.,-3.,0.", "GRID,41,,5.,-4.,2.,6", "PARAM,AUTOSPC,NO"]
        s = read(tmp_path, *cards, *spring, control="ECHO = NONE").structure()
        K = (s.translation @ s.K @ s.translation.T).toarray()
        C = np.array([[0, 1, 0], [-1, 0, 0], [0, 0, 1.0]])  # x of the system is y of the deck
        directions = C[order]
        assert [d @ K @ d for d in directions] == pytest.approx([7.0, 8.0, 9.0])


@pytest.mark.parametrize(
    ("cards", "sentence"),
    [
        (["GRID,50,9,0.,0.,0."], r"GRID 50: coordinate system 9 is not in the deck, which has 5, 6"),
        (["GRID,50,,0.,0.,0.,9"], r"GRID 50: coordinate system 9 is not in the deck, which has 5, 6"),
        (["CORD1R,7,1,2,77", "GRID,50,7,0.,0.,0."], r"grid point 77 is not in the deck"),
        (["GRID,50,,1.+400,0.,0."], r"GRID 50 has coordinates that are not finite"),
        (["GRID,50,,0.,0.", ], ""),
    ],
)  # fmt: skip
def test_mistakes_in_grids_name_their_system(tmp_path, cards, sentence):
    if not sentence:
        assert read(tmp_path, *CHAIN, *cards)
        return
    with pytest.raises(DeckError, match=sentence):
        read(tmp_path, *CHAIN, *cards, control="ECHO = NONE")


def test_the_same_grid_twice_is_one_and_a_grid_of_a_fluid_is_said(tmp_path):
    deck = read(tmp_path, *CHAIN, "GRID,3,0,3.,0.,0.,0", "GRID,60,,1.,1.,1.,-1", control="ECHO = NONE")
    assert len(deck.mesh.points) == 9
    assert any(str(one).startswith("1 GRID: fluid points (CD = -1) are left out") for one in deck.unused)


# Sets, older cards and what is left out


def test_sets_are_groups_of_grids_or_of_elements(tmp_path):
    cards = ["SET3,31,GRID,2,THRU,4,9", "SET3,32,ELEM,2,THRU,4", "SET1,33,5,7", "SET3,34,PROP,3", "SET1,35,2,THRU"]
    deck = read(tmp_path, *CHAIN, *cards, control="SET 6 = 1, 3 THRU 5\nSPC = 1")
    rows = lambda name: sorted(deck.mesh.group_points(name).tolist())  # noqa: E731
    at = lambda *numbers: sorted(deck.points_of_ids[n] for n in numbers)  # noqa: E731
    assert rows("set_31") == at(2, 3, 4, 9) and rows("set_33") == at(5, 7) and rows("set_6") == at(1, 3, 4, 5)
    assert {k: v.tolist() for k, v in deck.mesh.group_cells("set_32").items()} == {"line": [[1, 2], [2, 3], [3, 4]]}
    assert "set_34" not in deck.mesh.groups
    assert any("SET1 35 is left out" in note for note in deck.notes)


PLATES = [f"GRID,{k + 1 + 10 * j},,{0.25 * k},{0.2 * j},0." for j in (0, 1) for k in range(3)]


@pytest.mark.parametrize(
    ("older", "newer"),
    [
        (["CQDMEM,1,3,1,2,12,11", "PQDMEM,3,1,.004,1.5"], ["CQUAD4,1,3,1,2,12,11", "PSHELL,3,1,.004,,,,,1.5"]),
        (["CTRMEM,1,3,1,2,12", "PTRMEM,3,1,.004,1.5"], ["CTRIA3,1,3,1,2,12", "PSHELL,3,1,.004,,,,,1.5"]),
        (["CTRIA1,1,3,1,2,12", "PTRIA1,3,1,.004,2,1.6-8,1,.002,,1.5"],
         ["CTRIA3,1,3,1,2,12", "PSHELL,3,1,.004,2,3.,1,.5"]),
        (["CQUAD1,1,3,1,2,12,11", "PQUAD1,3,1,.004,2,1.6-8,,.002,1.5"],
         ["CQUAD4,1,3,1,2,12,11", "PSHELL,3,1,.004,2,3.,,,1.5"]),
        (["CQUAD1,1,3,1,2,12,11", "PQUAD1,3,1,.004,,1.6-8,,.002,1.5"], ["CQUAD4,1,3,1,2,12,11",
         "PSHELL,3,1,.004,,,,,1.5"]),
        (["CQUAD2,1,3,1,2,12,11,30.", "PQUAD2,3,1,.004"], ["CQUAD4,1,3,1,2,12,11,30.", "PSHELL,3,1,.004,1"]),
    ],
)  # fmt: skip
def test_older_shells_have_the_sections_of_those_that_took_their_place(tmp_path, older, newer):
    mats = ["MAT1,1,7.E10,,.3,2700.", "MAT1,2,2.E11,,.25,7850."]
    (a,), (b,) = (read(tmp_path, *PLATES, *mats, *cards, control="ECHO = NONE").members for cards in (older, newer))
    for name in ("A", "D", "S", "B", "mass", "rotary", "thickness"):
        assert getattr(a.section, name) == pytest.approx(getattr(b.section, name)), name
    assert a.family == b.family


def test_older_solids_take_a_property_of_their_material_apart_from_others(tmp_path):
    """Material 3 has the number of a property of shells, and material 4 has not."""
    x = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [0, 1, 1], [2, 0, 0], [3, 0, 0], [2, 1, 0], [2, 0, 1]]
    grids = [f"GRID,{k + 1},,{p[0]}.,{p[1]}.,{p[2]}." for k, p in enumerate(x)]
    cards = ["CWEDGE,1,3,1,2,3,4,5,6", "CTETRA,2,4,7,8,9,10", "CQUAD4,5,3,1,2,5,4", "PSHELL,3,3,.1,3",
             "MAT1,3,7.E10,,.3,2700.", "MAT1,4,2.E11,,.25,7850."]  # fmt: skip
    deck = read(tmp_path, *grids, *cards, control="ECHO = NONE")
    solids = {m.group: m.material for m in deck.members if m.family == "solid"}
    assert {g: m.E for g, m in solids.items()} == {"pid_90000003": 7e10, "pid_4": 2e11}
    assert any("1 CWEDGE are read as CPENTA" in n for n in deck.notes)
    assert any("1 CTETRA are read as CTETRA on a PSOLID of its material" in n for n in deck.notes)


def test_older_rigid_elements_name_components_of_each_grid(tmp_path):
    deck = read(tmp_path, *CHAIN, "CRIGD2,90,1,5,12,6,12", ",7,4", "CRIGD2,91,2,8,3,,", control="ECHO = NONE")
    number = {row: n for n, row in deck.points_of_ids.items()}
    ties = {
        tuple(sorted(number[r] for r in deck.mesh.group_points(one.group))): one.components for one in deck.connections
    }
    assert ties == {(5, 6): ("x", "y"), (7,): ("rx",), (8,): ("z",)}


@pytest.mark.parametrize(
    ("card", "said"),
    [
        ("CVISC,90,9,1,2", "damping is left out; give damping in the case"),
        ("CWELD,90,9", "fasteners are left out; the parts that they join stay apart"),
        ("DMIG,K,0,6,1,0", "matrices are left out; their stiffness and mass are missing"),
        ("SUPORT,1,123", "free bodies are reduced by the case (method = 'free_free')"),
        ("EIGRL,1,,,10", "choice of modes is left out; the case says how many"),
        ("FORCE,1,1,,1.,1.", "loads and temperatures are left out; the case has them"),
        ("ASET1,1,2", "reductions are left out; choose the reduction in the case"),
        ("CAERO1,1,2", "aerodynamics is left out"),
        ("DESVAR,1,A", "optimisation is left out; the values of the deck are used"),
        ("PVISC,9,1.", "damping is left out; give damping in the case"),
        ("PSTRANGE,9,1.", "no element of the structure uses it"),
        ("QWERTY,9,1.", "is not a known card and is left out"),
        ("BOLT,1", "bolt preload is left out"),
        ("RSPINR,1", "rotor dynamics is left out; the case has spins"),
        ("CHBDYG,1", "heat transfer is left out"),
        ("FREQ1,1", "choices of an analysis are left out; the case has its own"),
    ],
)
def test_cards_that_are_left_out_say_what_that_changes(tmp_path, card, said):
    deck = read(tmp_path, *CHAIN, card, card.replace("90", "91"), control="ECHO = NONE")
    name = card.split(",")[0]
    (one,) = (one for one in deck.unused if one.card == name)
    assert one.consequence == said and one.count == 2 and one.file == "deck.bdf"
    assert one.line == 5 + len(CHAIN)


def test_old_elements_without_a_family_are_said_to_be_old(tmp_path):
    with pytest.raises(
        DeckError, match=r"2 CTRPLT, the first CTRPLT 90: there is no such .* \(an element of the 1970s: CQUAD4"
    ):
        read(tmp_path, *CHAIN, "CTRPLT,90,3,1,2,3", "CTRPLT,91,3,1,2,3", control="ECHO = NONE")
    with pytest.raises(DeckError, match=r"1 CBEND, the first CBEND 90: there is no such element here, and the model"):
        read(tmp_path, *CHAIN, "CBEND,90,3,1,2", control="ECHO = NONE")


def test_grids_that_are_held_in_one_loose_component_are_held_in_the_others_too(tmp_path):
    """Of a rod along x, nothing resists y and z at its ends; the deck holds y of one of them."""
    rod = ["GRID,1,,0.,0.,0.", "GRID,2,,2.,0.,0.", "CONROD,1,1,2,1,0.5", STEEL, "SPC1,1,123456,1", "SPC1,1,2,2"]
    deck = read(tmp_path, *rod, control="SPC = 1")
    assert held(deck) == {1: "123", 2: "23"} and held(deck, ["autospc"]) == {2: "23"}


def test_parameters_switch_off_autospc_and_scale_masses(tmp_path):
    rods = ["GRID,1,,0.,0.,0.", "GRID,2,,1.,0.,0.", "CROD,1,7,1,2", "PROD,7,1,1.-4", STEEL]
    assert "autospc" in read(tmp_path, *rods, control="ECHO = NONE").supports
    assert "autospc" not in read(tmp_path, *rods, "PARAM,AUTOSPC,NO", control="ECHO = NONE").supports
    assert "autospc" in read(tmp_path, *rods, "PARAM,AUTOSPC,YES", control="ECHO = NONE").supports
    assert "autospc" not in read(tmp_path, *rods, control="PARAM,AUTOSPC,NO").supports
    assert "autospc" not in read(tmp_path, *rods, "PARAM,AUTOSPC,YES", control="PARAM,AUTOSPC,NO").supports


def test_a_deck_without_grids_or_without_elements_says_so(tmp_path):
    with pytest.raises(DeckError, match=r"deck.bdf has no GRID cards; it is no Nastran deck with a structure"):
        read(tmp_path, STEEL)
    with pytest.raises(DeckError, match=r"deck.bdf has no elements, masses or springs; there is no structure to make"):
        read(tmp_path, "GRID,1,,0.,0.,0.", STEEL)


def test_names_of_overrides_are_the_comments_of_the_deck_or_the_numbers(tmp_path):
    path = tmp_path / "deck.bdf"
    path.write_text("\n".join(["SOL 103", "CEND", "BEGIN BULK", '$HMNAME PROP        3"boom" 4', *CHAIN, "ENDDATA"]))
    deck = read_deck(path, overrides={"boom": {"A": 2.0}})
    assert float(deck.members[0].section.EA) == pytest.approx(4.2e11)
    with pytest.raises(DeckError, match=r"override of 'beam': the deck has no such property or material"):
        read_deck(path, overrides={"beam": {"A": 2.0}})
    with pytest.raises(DeckError, match=r"MAT1 1: override of mat_1 names 'rho'; it has \['E', 'G', 'density', 'nu'\]"):
        read_deck(path, overrides={"mat_1": {"rho": 2.0}})
