"""Springs, masses and constraints of Nastran decks: whole matrices in skew axes and inches, against formulas."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
import pytest
from support.nastran_decks import read_deck_of_cards

from femflex.decks import Deck
from femflex.fem import Structure

INCH, POUND_FORCE = 0.0254, 0.45359237 * 9.80665
MASS = POUND_FORCE / INCH  # kg of one lbf s^2 / in
WTMASS = 0.25


def turn(axis: tuple[float, float, float], degrees: float) -> np.ndarray:
    """Axes as rows, turned from the basic ones."""
    e = np.array(axis) / np.linalg.norm(axis)
    S = np.array([[0, -e[2], e[1]], [e[2], 0, -e[0]], [-e[1], e[0], 0]])
    a = np.radians(degrees)
    return (np.eye(3) + np.sin(a) * S + (1 - np.cos(a)) * S @ S).T


FIVE, SIX = turn((1, 2, 3), 40.0), turn((-2, 1, 1), 65.0)  # systems 5 (rectangular) and 6 (cylindrical)
ORIGIN = {5: np.array([0.5, -0.3, 0.2]), 6: np.array([1.0, 0.7, -0.4])}
AT = {1: [3.0, 4.0, 1.0], 2: [-1.0, 2.5, 0.7], 3: [2.0, -1.5, 3.0], 4: [0.4, 0.9, -2.0]}  # in deck units, basic
CD = {1: 6, 2: 5, 3: 0, 4: 6}


def system(name: str, number: int, C: np.ndarray) -> list[str]:
    a = ORIGIN[number]
    words = [*a, *(a + C[2]), *(a + 1.7 * C[0] + 0.3 * C[2])]
    text = [f"{w:.12g}" for w in words]
    return [f"{name},{number},0,{','.join(text[:6])}", f",{','.join(text[6:])}"]


CARDS = [
    *system("CORD2R", 5, FIVE), *system("CORD2C", 6, SIX), "PARAM,AUTOSPC,NO",
    *(f"GRID,{g},,{x[0]},{x[1]},{x[2]},{CD[g]}" for g, x in AT.items()),
]  # fmt: skip


def axes(grid: int, number: int | None = None) -> np.ndarray:
    """Axes of a system at a grid, as rows; its displacement system where none is named."""
    number = CD[grid] if number is None else number
    if number == 0:
        return np.eye(3)
    if number == 5:
        return FIVE
    away = np.array(AT[grid]) - ORIGIN[6]
    radial = away - (away @ SIX[2]) * SIX[2]
    radial = radial / np.linalg.norm(radial)
    return np.array([radial, np.cross(SIX[2], radial), SIX[2]])


@lru_cache(maxsize=1)
def structure_of(deck: Deck) -> Structure:
    return deck.structure()


def motions(structure: Structure, grid: int, points: dict[int, int]) -> np.ndarray:
    """Translation and rotation (6, n_dof) of a grid in basic axes."""
    row = 3 * points[grid]
    parts = [part[row : row + 3].toarray() for part in (structure.translation, structure.rotation)]
    return np.concatenate(parts)


def on_grids(deck, name: str, grids: tuple[int, ...] = (1, 2, 3)) -> np.ndarray:
    """K or M over translations and rotations of the grids in basic axes: all of their dofs are along axes of theirs."""
    structure = structure_of(deck)
    T = np.concatenate([motions(structure, g, deck.points_of_ids) for g in grids])
    return np.asarray(T @ getattr(structure, name).toarray() @ T.T)


def direction(grid: int, component: int, grids: tuple[int, ...] = (1, 2, 3)) -> np.ndarray:
    """A component of a grid over the motions of all grids, in basic axes."""
    computed = np.zeros((len(grids), 2, 3))
    computed[grids.index(grid), int(component > 3)] = axes(grid)[(component - 1) % 3]
    return computed.ravel()


def skew(r: np.ndarray) -> np.ndarray:
    return np.array([[0, -r[2], r[1]], [r[2], 0, -r[0]], [-r[1], r[0], 0]])


def rigid_mass(m: float, r: np.ndarray, J: np.ndarray) -> np.ndarray:
    """Mass matrix (6, 6) of a body with its centre at r, and inertia J about its centre."""
    S = skew(r)
    return np.block([[m * np.eye(3), -m * S], [m * S, J - m * S @ S]])


J0 = np.array([[5.0, -0.2, 0.3], [-0.2, 6.0, 0.4], [0.3, 0.4, 7.0]])
R0 = np.array([0.4, -0.7, 0.2])


@pytest.mark.parametrize(("grid", "cid"), [(1, 5), (2, 6), (3, 6), (1, 0)])
@pytest.mark.parametrize("card", ["CONM2", "CONM1"])
def test_conm1_and_conm2_have_the_matrix_of_their_body(tmp_path, grid, cid, card):
    if card == "CONM2":
        given = [J0[0, 0], -J0[1, 0], J0[1, 1], -J0[2, 0], -J0[2, 1], J0[2, 2]]
        cards = [f"CONM2,9,{grid},{cid},2.5,{R0[0]},{R0[1]},{R0[2]},", "," + ",".join(map(str, given))]
    else:
        words = [f"{v:.12g}" for i, row in enumerate(rigid_mass(2.5, R0, J0)) for v in row[: i + 1]]
        words = ["9", str(grid), str(cid), *words]
        cards = [",".join(["CONM1" if k == 0 else "", *words[k : k + 8]]) for k in range(0, len(words), 8)]
    deck = read_deck_of_cards(
        tmp_path, *CARDS, f"PARAM,WTMASS,{WTMASS}", *cards, control="ECHO = NONE", units="in-lbf-s"
    )
    C = axes(grid, cid)
    expected = rigid_mass(2.5 * MASS, C.T @ R0 * INCH, C.T @ J0 @ C * MASS * INCH**2) * WTMASS
    computed = on_grids(deck, "M", (grid,))
    assert computed == pytest.approx(expected, abs=1e-8 * np.abs(expected).max())


def test_scalar_masses_lie_along_the_axes_of_their_grid(tmp_path):
    """By CMASS2 and by the last of the masses on a card PMASS."""
    cards = ["PMASS,31,9.,32,8.,33,7.,34,6.", *(f"CMASS2,{20 + c},2.5,2,{c}" for c in (1, 2, 3))]
    cards += ["CMASS1,24,34,2,4", "CMASS2,26,4.,2,6", f"PARAM,WTMASS,{WTMASS}"]
    deck = read_deck_of_cards(tmp_path, *CARDS, *cards, control="ECHO = NONE", units="in-lbf-s")
    J = FIVE.T @ np.diag([6.0, 0.0, 4.0]) @ FIVE * MASS * INCH**2
    expected = rigid_mass(2.5 * MASS, np.zeros(3), J) * WTMASS
    assert on_grids(deck, "M", (2,)) == pytest.approx(expected, abs=1e-8 * np.abs(expected).max())


@pytest.mark.parametrize(
    ("cards", "terms", "k"),
    [
        (["CELAS2,9,70.,1,2"], [(1, 2, 1.0)], 70.0),
        (["CELAS2,9,70.,,,2,3"], [(2, 3, 1.0)], 70.0),
        (["CELAS2,9,70.,1,2,2,1"], [(1, 2, 1.0), (2, 1, -1.0)], 70.0),
        (["CELAS2,9,70.,1,6,2,5"], [(1, 6, 1.0), (2, 5, -1.0)], 70.0),
        (["CELAS1,9,8,1,4", "PELAS,7,50.,,,8,60."], [(1, 4, 1.0)], 60.0),
        (["CELAS1,7,,3,4,1,3", "PELAS,7,50.,,,8,60."], [(3, 4, 1.0), (1, 3, -1.0)], 50.0),
        (["CELAS2,9,70.,2,1,1,5"], [(2, 1, 1.0), (1, 5, -1.0)], 70.0),
    ],
)
def test_scalar_springs_act_along_the_axes_of_their_grids(tmp_path, cards, terms, k):
    """Energy k (u_a - u_b)^2 / 2 in the units of the deck, where a turn counts in radians."""
    deck = read_deck_of_cards(tmp_path, *CARDS, *(f"CONM2,{90 + g},{g},,1.\n,1.,,1.,,,1." for g in (1, 2, 3)), *cards,
                control="ECHO = NONE", units="in-lbf-s")  # fmt: skip
    d = sum(sign * direction(g, c) / (INCH if c <= 3 else 1.0) for g, c, sign in terms)
    expected = k * POUND_FORCE * INCH * np.outer(d, d)
    assert on_grids(deck, "K") == pytest.approx(expected, abs=1e-9 * np.abs(expected).max())


def bushing(a: int, b: int | None, C: np.ndarray, K: list[float], at: np.ndarray | None = None) -> np.ndarray:
    """A bushing in the middle between two grids, or at a place, which its arms reach rigidly; one grid: there, to the
    ground."""
    ends = [np.array(AT[g]) * INCH for g in (a, b or a)]
    location = (ends[0] + ends[1]) / 2 if at is None else at * INCH
    B = np.zeros((6, 3, 6))
    for g, sign in ((a, 1.0), *(((b, -1.0),) if b else ())):
        arm = location - np.array(AT[g]) * INCH
        B[:, g - 1] = sign * np.block([[C, -C @ skew(arm)], [np.zeros((3, 3)), C]])
    B = B.reshape(6, 18)
    return B.T @ np.diag(np.array(K) * POUND_FORCE * np.array([1 / INCH] * 3 + [INCH] * 3)) @ B


def axes_of_line(a: int, b: int, v: np.ndarray) -> np.ndarray:
    x = np.array(AT[b]) - np.array(AT[a])
    x = x / np.linalg.norm(x)
    z = np.cross(x, v)
    z = z / np.linalg.norm(z)
    return np.array([x, np.cross(z, x), z])


STIFF = [11.0, 22.0, 33.0, 44.0, 55.0, 66.0]


@pytest.mark.parametrize(
    ("card", "ends", "C"),
    [
        ("CBUSH,9,8,1,2,,,,6", (1, 2), axes(1, 6)),
        ("CBUSH,9,8,1,2,.3,.2,.9", (1, 2), axes_of_line(1, 2, np.array([0.3, 0.2, 0.9]) @ axes(1))),
        ("CBUSH,9,8,2,1,4", (2, 1), axes_of_line(2, 1, np.array(AT[4]) - np.array(AT[2]))),
        ("CBUSH,9,8,2,,,,,6", (2, None), axes(2, 6)),
        ("CBUSH,8,,1", (1, None), axes(1)),
        ("CBUSH,9,8,1,2,1.,2.,3.,5", (1, 2), FIVE),
    ],
)
def test_cbush_has_the_matrix_of_six_springs(tmp_path, card, ends, C):
    masses = [f"CONM2,{90 + g},{g},,1.\n,1.,,1.,,,1." for g in (1, 2, 3)]
    stiff = f"PBUSH,8,K,{','.join(map(str, STIFF))}"
    deck = read_deck_of_cards(tmp_path, *CARDS, *masses, stiff, card, control="ECHO = NONE", units="in-lbf-s")
    expected = bushing(*ends, C, STIFF)
    assert on_grids(deck, "K") == pytest.approx(expected, abs=1e-9 * np.abs(expected).max())
    changed = read_deck_of_cards(tmp_path, *CARDS, *masses, stiff, card, control="ECHO = NONE", units="in-lbf-s",
                   overrides={"pid_8": {"K2": 500.0, "K6": 600.0}})  # fmt: skip
    K = [11.0, 500.0 * INCH / POUND_FORCE, 33.0, 44.0, 55.0, 600.0 / (INCH * POUND_FORCE)]
    expected = bushing(*ends, C, K)
    assert on_grids(changed, "K") == pytest.approx(expected, abs=1e-9 * np.abs(expected).max())


TURNED = 1.5 * (np.cos(np.radians(40.0)) * SIX[0] + np.sin(np.radians(40.0)) * SIX[1]) - 0.2 * SIX[2]


@pytest.mark.parametrize(
    ("where", "at"),
    [
        (",.2", 0.8 * np.array(AT[1]) + 0.2 * np.array(AT[2])),
        (",0.,-1", np.array(AT[1])),
        (",.2,0,.7,.1,-.9", np.array([0.7, 0.1, -0.9])),
        (",,5,.3,-.4,1.1", ORIGIN[5] + np.array([0.3, -0.4, 1.1]) @ FIVE),
        (",,6,1.5,40.,-.2", ORIGIN[6] + TURNED),
    ],
)
def test_cbush_acts_at_its_location(tmp_path, where, at):
    masses = [f"CONM2,{90 + g},{g},,1.\n,1.,,1.,,,1." for g in (1, 2, 3)]
    card = f"PBUSH,8,K,{','.join(map(str, STIFF))}\nCBUSH,9,8,1,2,,,,5\n{where}"
    deck = read_deck_of_cards(tmp_path, *CARDS, *masses, card, control="ECHO = NONE", units="in-lbf-s")
    expected = bushing(1, 2, FIVE, STIFF, at)
    assert on_grids(deck, "K") == pytest.approx(expected, abs=1e-9 * np.abs(expected).max())


def components(deck, grid: int, names: str) -> np.ndarray:
    """Components of a grid along its own axes over the dofs."""
    T = motions(structure_of(deck), grid, deck.points_of_ids)
    return np.array([axes(grid)[(int(c) - 1) % 3] @ T[3 * (int(c) > 3) : 3 * (int(c) > 3) + 3] for c in names])


def rigid_rows(grid: int, names: str, origin: int) -> np.ndarray:
    """Components of a grid per translation and rotation (6,) of a rigid motion about another."""
    r = (np.array(AT[grid]) - np.array(AT[origin])) * INCH
    whole = np.block([[axes(grid), -axes(grid) @ skew(r)], [np.zeros((3, 3)), axes(grid)]])
    return whole[[int(c) - 1 for c in names]]


BARS = [  # a frame through the grids, so that all of them turn
    "CBAR,81,3,1,2,0.1,0.2,0.9", "CBAR,82,3,2,3,0.1,0.2,0.9", "CBAR,83,3,3,4,.1,.2,.9",
    "PBAR,3,1,1.,1.,1.,1.", "MAT1,1,1.+7,,.3,1.-3",
]  # fmt: skip


@pytest.mark.parametrize("names", ["123456", "123", "13", "25", "46"])
def test_rbe2_moves_its_grids_with_its_centre(tmp_path, names):
    """Along the axes of each dependent grid, two of which are listed by THRU."""
    deck = read_deck_of_cards(
        tmp_path, *CARDS, *BARS, f"RBE2,9,4,{names},1,THRU,3", control="ECHO = NONE", units="in-lbf-s"
    )
    centre = motions(structure_of(deck), 4, deck.points_of_ids)
    for g in (1, 2, 3):
        computed, expected = components(deck, g, names), rigid_rows(g, names, 4) @ centre
        assert computed == pytest.approx(expected, abs=1e-9 * max(1.0, np.abs(expected).max()))


@pytest.mark.parametrize(
    ("card", "leading", "dependent"),
    [
        ("RBAR,9,1,2,123456,,,123", [(1, "123456")], [(2, "123")]),
        ("RBAR,9,1,2,,123456", [(2, "123456")], [(1, "123456")]),
        ("RBAR,9,1,2,123,456", [(1, "123"), (2, "456")], [(1, "456"), (2, "123")]),
        ("RBE1,9,1,123,2,12,3,2\n,UM,3,136,4,123456", [(1, "123"), (2, "12"), (3, "2")], [(3, "136"), (4, "123456")]),
        ("RBE1,9,1,12,2,13,3,26\n,UM,4,1246", [(1, "12"), (2, "13"), (3, "26")], [(4, "1246")]),
    ],
)  # fmt: skip
def test_rbar_and_rbe1_move_with_their_six_leading_components(tmp_path, card, leading, dependent):
    deck = read_deck_of_cards(tmp_path, *CARDS, *BARS, *card.split("\n"), control="ECHO = NONE", units="in-lbf-s")
    origin = 3
    A = np.concatenate([rigid_rows(g, c, origin) for g, c in leading])
    rigid = np.linalg.solve(A, np.concatenate([components(deck, g, c) for g, c in leading]))
    for g, c in dependent:
        computed = components(deck, g, c)
        assert computed == pytest.approx(rigid_rows(g, c, origin) @ rigid, abs=1e-8 * max(1.0, np.abs(computed).max()))
    everything = np.concatenate([motions(structure_of(deck), g, deck.points_of_ids) for g in AT])
    assert np.linalg.matrix_rank(everything, 1e-8) == 24 - sum(len(c) for _, c in dependent)


@pytest.mark.parametrize("bars", [False, True])
@pytest.mark.parametrize(
    ("card", "groups", "names"),
    [
        ("RBE3,9,,4,123456,2.,123,1,3\n,.5,123,2", [(2.0, "123", (1, 3)), (0.5, "123", (2,))], "123456"),
        ("RBE3,9,,4,123456,2.,123,3,1\n,.5,123,2", [(2.0, "123", (3, 1)), (0.5, "123", (2,))], "123456"),
        ("RBE3,9,,4,1235,2.,123,1\n,.5,12345,2,3", [(2.0, "123", (1,)), (0.5, "12345", (2, 3))], "1235"),
        ("RBE3,9,,4,246,1.5,13,1,THRU\n,3,3.,1246,2", [(1.5, "13", (1, 2, 3)), (3.0, "1246", (2,))], "246"),
        ("RBE3,9,,4,123456,2.,123456,1,3\n,ALPHA,1.-5", [(2.0, "123456", (1, 3))], "123456"),
    ],
)
def test_rbe3_moves_by_weighted_least_squares(tmp_path, bars, card, groups, names):
    """Rotations weigh as displacements at the mean distance of the grids from the reference."""
    frame = BARS[:2] + BARS[3:] if bars else []
    deck = read_deck_of_cards(tmp_path, *CARDS, *frame, *card.split("\n"), control="ECHO = NONE", units="in-lbf-s")
    leaders = list(dict.fromkeys(g for _, _, own in groups for g in own))
    mean = np.mean([np.linalg.norm(np.array(AT[g]) - np.array(AT[4])) for g in leaders]) * INCH
    A, b = [], []
    for weight, own, grids in groups:
        scale = np.sqrt(weight) * np.where([int(c) > 3 for c in own], mean, 1.0)
        for g in grids:
            A.append(scale[:, None] * rigid_rows(g, own, 4))
            b.append(scale[:, None] * components(deck, g, own))
    best = np.linalg.lstsq(np.concatenate(A), np.concatenate(b), rcond=None)[0]
    computed = components(deck, 4, names)
    expected = rigid_rows(4, names, 4) @ best
    assert computed == pytest.approx(expected, abs=1e-8 * np.abs(expected).max())


def test_mpc_equations_hold_in_the_units_of_the_deck(tmp_path):
    """4 u_1y + 3 r_2x - 2 u_3z + 5 r_1z = 0, along the axes of the grids, chosen by MPCADD among three sets."""
    cards = ["MPCADD,7,66,6", "MPC,6,1,2,4.,2,4,3.", ",,3,3,-2.,1,6,5.", "MPC,66,2,1,2.,3,6,-1.", "MPC,5,3,1,1.,1,1,1."]
    deck = read_deck_of_cards(tmp_path, *CARDS, *cards, control="MPC = 7", units="in-lbf-s")
    value = {(g, c): components(deck, g, str(c))[0] / (INCH if c <= 3 else 1.0) for g in (1, 2, 3) for c in range(1, 7)}
    assert 4 * value[1, 2] + 3 * value[2, 4] - 2 * value[3, 3] + 5 * value[1, 6] == pytest.approx(0.0, abs=1e-9 / INCH)
    assert 2 * value[2, 1] - value[3, 6] == pytest.approx(0.0, abs=1e-9 / INCH)
    assert np.abs(value[3, 1] + value[1, 1]).max() > 0.1  # the third set is not chosen
