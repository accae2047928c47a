"""Grids, coordinate systems, supports, sets and case control of Nastran decks, and automatic supports."""

from __future__ import annotations

import numpy as np
import pytest
from support.nastran_decks import STEEL, bar, frequencies, read_deck_of_cards

WORDS = ("x", "y", "z", "rx", "ry", "rz")
SKEW = ["CORD2R,5,0,0.,0.,0.,.3,.2,.9", ",1.,.5,0.", "CORD2C,6,0,5.,-4.,0.,5.,-4.,1.", ",6.,-4.,0."]
CHAIN = [
    *(f"GRID,{n},,{n}.,0.,0." for n in range(1, 7)), "GRID,7,,7.,.5,0.,5", "GRID,8,,8.,1.,0.,6", "GRID,9,,9.,2.,0.,,46",
    *(f"CBAR,{n},3,{n},{n + 1},0.,1.,0." for n in range(1, 9)), "PBAR,3,1,1.,1.,1.,1.", STEEL, *SKEW,
    "PARAM,AUTOSPC,NO",
]  # fmt: skip


def supported_components(deck, names=None) -> dict[int, str]:
    """Components 1 to 6 that are supported at each grid, along any axes."""
    components: dict[int, set[int]] = {}
    number = {row: n for n, row in deck.points_of_ids.items()}
    for group, support in deck.active_supports(names).items():
        for row in deck.mesh.group_points(group):
            components.setdefault(number[row], set()).update(WORDS.index(c) + 1 for c in support.components)
    return {n: "".join(map(str, sorted(numbers))) for n, numbers in sorted(components.items())}


CARDS = ["SPC,1,1,12,0.,2,3", "SPC1,1,46,3,THRU,5", "SPC1,2,5,2,4", "SPC1,3,123,6", "SPCADD,8,1,3", "SPC1,1,3,1"]


def test_support_sets(tmp_path):
    deck = read_deck_of_cards(tmp_path, *CHAIN, *CARDS, control="SPC = 8")
    first_set, third_set = {1: "123", 2: "3", 3: "46", 4: "46", 5: "46"}, {6: "123"}
    assert deck.default_supports == ("ps", "spc_8")
    assert supported_components(deck, ["spc_1"]) == first_set and supported_components(deck, ["spc_2"]) == {
        2: "5",
        4: "5",
    }
    assert supported_components(deck, ["spc_8"]) == first_set | third_set and supported_components(deck, ["ps"]) == {
        9: "46"
    }
    assert supported_components(deck) == first_set | third_set | {9: "46"}
    assert sorted(deck.mesh.group_points("spc_1").tolist()) == [deck.points_of_ids[n] for n in (1, 2, 3, 4, 5)]


def test_supports_lie_along_displacement_axes(tmp_path):
    deck = read_deck_of_cards(tmp_path, *CHAIN, "SPC1,1,13,1,7,8", "SPC1,2,123,7,8", "SPC1,3,1234,8")
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
    for group, support in deck.active_supports(["spc_1"]).items():
        for row in deck.mesh.group_points(group):
            seen[number[row]] = np.asarray(support.axes)
            assert support.components == ("x", "z")
    for n, expected in axes.items():
        assert seen[n] == pytest.approx(expected, abs=1e-8)
    for support in deck.active_supports(["spc_2"]).values():
        assert np.asarray(support.axes) == pytest.approx(np.eye(3))
    (support,) = deck.active_supports(["spc_3"]).values()
    assert np.asarray(support.axes) == pytest.approx(axes[8], abs=1e-8)


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
def test_case_control_of_the_first_subcase(tmp_path, control, default):
    deck = read_deck_of_cards(tmp_path, *CHAIN, *CARDS, control=control)
    assert deck.default_supports == default


def test_lists_with_thru_and_by(tmp_path):
    deck = read_deck_of_cards(tmp_path, *CHAIN, "SPC1,1,1,2,THRU,8,BY,3", "SPC1,1,2,1")
    assert supported_components(deck, ["spc_1"]) == {1: "2", 2: "1", 5: "1", 8: "1"}


def test_grdset_defaults(tmp_path):
    """CP, CD and PS where a GRID leaves them blank; zero is a number."""
    cards = [
        "GRDSET,,6,,,,5,3",
        "GRID,21,,2.,30.,1.",
        "GRID,22,0,2.,30.,1.",
        "GRID,23,5,1.,2.,3.,0",
        "GRID,24,,1.,0.,0.,6,4",
    ]
    bars = [f"CBAR,{40 + k},3,{a},{b},0.1,.2,1." for k, (a, b) in enumerate(((21, 22), (22, 23), (23, 24)))]
    deck = read_deck_of_cards(tmp_path, *CHAIN[-7:], *cards, *bars, "SPC1,1,1,21,23")
    z = np.array([0.3, 0.2, 0.9]) / np.linalg.norm([0.3, 0.2, 0.9])
    x = np.array([1.0, 0.5, 0.0]) - (np.array([1.0, 0.5, 0.0]) @ z) * z
    C = np.array([x / np.linalg.norm(x), np.cross(z, x / np.linalg.norm(x)), z])
    at = {
        21: [5 + 2 * np.cos(np.pi / 6), -4 + 1.0, 1.0],
        22: [2.0, 30.0, 1.0],
        23: np.array([1.0, 2, 3]) @ C,
        24: [6, -4, 0.0],
    }
    for number, location in at.items():
        assert deck.mesh.points[deck.points_of_ids[number]] == pytest.approx(np.array(location))
    assert supported_components(deck, ["ps"]) == {21: "3", 22: "3", 23: "3", 24: "4"}
    axes = {}
    for group, support in deck.active_supports(["spc_1"]).items():
        axes |= {int(row): np.asarray(support.axes) for row in deck.mesh.group_points(group)}
    assert axes[deck.points_of_ids[21]] == pytest.approx(C, abs=1e-8)
    assert axes[deck.points_of_ids[23]] == pytest.approx(np.eye(3))


@pytest.mark.parametrize("kind", "RCS")
def test_places_of_grids_in_nested_systems(tmp_path, kind):
    """In inches, by a system in another that is given by three grids, with a second one on the same card."""
    three = ["GRID,31,,1.,0.,0.", "GRID,32,,1.,.5,2.", "GRID,33,,2.,1.,0.", "CORD1R,2,31,32,33,3,33,31,32"]
    systems = [f"CORD2{kind},4,2,.1,.2,.3,.4,-.1,1.2", ",1.,.3,.2"]
    given = np.array([1.3, 35.0, 50.0] if kind == "S" else [1.3, 35.0, 0.8])
    cards = [*three, *systems, f"GRID,34,4,1.3,35.,{given[2]}", "GRID,35,3,.1,.2,.3", "CONM2,9,34,,1.",
             "CONM2,8,35,,1."]  # fmt: skip
    deck = read_deck_of_cards(tmp_path, *cards, control="ECHO = NONE", units="in-lbf-s")

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


def test_directions_on_the_axis_of_a_system(tmp_path):
    spring = ["CELAS2,1,7.,41,1", "CELAS2,2,8.,41,2", "CELAS2,3,9.,41,3", "CONM2,9,41,,1."]
    for kind, order in (("C", [0, 1, 2]), ("S", [2, 0, 1])):  # spherical: radial is along z here
        cards = [f"CORD2{kind},6,0,5.,-4.,0.,5.,-4.,1.", ",5.,-3.,0.", "GRID,41,,5.,-4.,2.,6", "PARAM,AUTOSPC,NO"]
        s = read_deck_of_cards(tmp_path, *cards, *spring, control="ECHO = NONE").structure()
        K = (s.translation @ s.K @ s.translation.T).toarray()
        C = np.array([[0, 1, 0], [-1, 0, 0], [0, 0, 1.0]])  # x of the system is y of the deck
        directions = C[order]
        assert [d @ K @ d for d in directions] == pytest.approx([7.0, 8.0, 9.0])


def test_sets_become_groups(tmp_path):
    cards = ["SET3,31,GRID,2,THRU,4,9", "SET3,32,ELEM,2,THRU,4", "SET1,33,5,7", "SET3,34,PROP,3", "SET1,35,2,THRU"]
    deck = read_deck_of_cards(tmp_path, *CHAIN, *cards, control="SET 6 = 1, 3 THRU 5\nSPC = 1")
    rows = lambda name: sorted(deck.mesh.group_points(name).tolist())  # noqa: E731
    at = lambda *numbers: sorted(deck.points_of_ids[n] for n in numbers)  # noqa: E731
    assert rows("set_31") == at(2, 3, 4, 9) and rows("set_33") == at(5, 7) and rows("set_6") == at(1, 3, 4, 5)
    assert {k: v.tolist() for k, v in deck.mesh.group_cells("set_32").items()} == {"line": [[1, 2], [2, 3], [3, 4]]}
    assert "set_34" not in deck.mesh.groups


def test_autospc_completes_supports(tmp_path):
    """Of a rod along x, nothing resists y and z at its ends; the deck holds y of one of them."""
    rod = ["GRID,1,,0.,0.,0.", "GRID,2,,2.,0.,0.", "CONROD,1,1,2,1,0.5", STEEL, "SPC1,1,123456,1", "SPC1,1,2,2"]
    deck = read_deck_of_cards(tmp_path, *rod, control="SPC = 1")
    assert supported_components(deck) == {1: "123", 2: "23"} and supported_components(deck, ["autospc"]) == {2: "23"}


def test_autospc_with_a_dependent_component(tmp_path):
    """Grid 15 follows the tip of a beam along y, a rod holds it along z, and nothing along x."""
    cards = ["GRID,15,,2.5,.3,0.", "GRID,16,,2.5,.3,1."]
    cards += ["CROD,20,4,15,16", "PROD,4,1,1.E-3", "RBE2,21,9,2,15", "SPC1,1,123456,16"]
    deck = read_deck_of_cards(tmp_path, *bar(), *cards)
    ((group, support),) = deck.supports["autospc"].items()
    assert deck.mesh.group_points(group).tolist() == [deck.points_of_ids[15]]
    assert support.components == ("x",) and np.asarray(support.axes) == pytest.approx(np.eye(3))
    assert len(frequencies(deck)) == 4
