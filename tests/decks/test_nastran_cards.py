"""Cards of Nastran, one row each: frequencies of a closed form, or of other cards that describe the same structure."""

from __future__ import annotations

import numpy as np
import pytest
from support.nastran_decks import STEEL, bar, frequencies, lines, plate, read_deck_of_cards, written

from femflex.decks import read_deck
from femflex.decks.report import mass_and_centre

E, NU, RHO = 2.1e11, 0.3, 7850.0
BETA = 1.8751040687119611  # first root of cos x cosh x = -1


def hertz(omega_squared) -> np.ndarray:
    return np.sqrt(np.sort(np.atleast_1d(omega_squared))) / (2 * np.pi)


def eigenvalues(K, M) -> np.ndarray:
    return np.linalg.eigvals(np.linalg.solve(M, K)).real


def euler(EI: float, m: float, L: float) -> float:
    """Squared first frequency of a uniform cantilever."""
    return BETA**4 * EI / (m * L**4)


# Closed forms

PAIR = ["GRID,1,,0.,0.,0.", "GRID,2,,1.,0.,0.", "CONM2,11,1,,2.", "CONM2,12,2,,3."]
TRUSS = [
    "GRID,1,,0.,0.,0.",
    "GRID,2,,2.,0.,0.",
    "GRID,3,,1.,1.,0.",
    "MAT1,1,2.1E11,,0.3",
    "CONM2,9,3,,10.",
    "SPC1,1,123,1,2",
]
PINNED = [c for c in bar() if not c.startswith(("CBAR,1,", "CBAR,8,", "SPC1"))]
PINNED += ["CBAR,1,3,1,2,0.,1.,0.", ",56,", "CBAR,8,3,8,9,0.,1.,0.", ",,56", "SPC1,1,123456,1,9"]
SHAFT = [f"GRID,{k + 1},,0.,{0.1 * k},0.,,126" for k in range(11)]
SHAFT += [f"CBAR,{k + 1},3,{k + 1},{k + 2},0.,0.,1." for k in range(10)]
SHAFT += ["PBAR,3,1,1.E-4,1.E-8,1.E-8,2.E-8", "MAT1,1,210.E9,80.E9,,1.E-6", "SPC1,1,345,1"]
SHAFT += [f"CMASS2,{k + 20},2.E-3,{k + 1},5" for k in range(1, 11)]
GIMBAL = [
    "GRID,1,,0.,0.,0.",
    "GRID,2,,0.,0.,0.",
    *lines("CONM2", 9, 2, "", 2.0, "", "", "", "", 0.5, "", 0.6, "", "", 0.7),
]
PANEL = ["GRID,1,,0.,0.,0.", "GRID,2,,1.,0.,0.", "GRID,3,,1.,1.,0.", "GRID,4,,0.,1.,0.", "CSHEAR,1,3,1,2,3,4"]
PANEL += ["PSHEAR,3,1,1.E-3", "MAT1,1,2.1E11,,0.3", "CONM2,11,3,,50.", "CONM2,12,4,,50.", "MPC,1,4,1,1.,3,1,-1."]
TWIST = ["GRID,1,,0.,0.,0.,,123456", "GRID,2,,2.,0.,0.,,12356", "GRID,3,,2.,1.,0.,,123456", "CROD,5,7,1,2"]
TWIST += ["PROD,7,1,1.-4,2.-6", "MAT1,1,2.1E11,,0.3", "CROD,8,9,1,3", "PROD,9,1,1.-4", "CBAR,4,8,1,3,0.,0.,1."]
TWIST += ["CBAR,6,8,2,3,1.,0.,0.,,,,456", "PBAR,8,1,1.-12,1.-18,1.-18,1.-18", "SPC1,1,123456,1,3"]
TWIST += lines("CONM2", 9, 2, "", 1.0, "", "", "", "", 3.0, "", 3.0, "", "", 3.0)
CHAIN = 4 * 80e9 * 2e-8 / 0.1 / 2e-3 * np.sin((2 * np.arange(1, 4) - 1) * np.pi / 42) ** 2
TUBE = np.pi * (0.02 - 0.0016754) * 0.0016754
CLOSED = {
    "bars bend in both planes": (bar(), [euler(E * I, RHO * 1e-3, 2.0) for I in (2e-7, 8e-7)], 4e-3),
    "pin flags make hinges": (PINNED, [np.pi**4 * E * 2e-7 / (RHO * 1e-3 * 16.0)], 1e-3),
    "rods carry a mass": ([*TRUSS, "CROD,1,7,1,3", "CROD,2,7,2,3", "PROD,7,1,1.E-4"],
                          [E * 1e-4 / (np.sqrt(2) * 10.0)] * 2, 1e-6),
    "CONROD": ([*TRUSS, "CONROD,1,1,3,1,1.-4", "CONROD,2,2,3,1,1.-4"], [E * 1e-4 / (np.sqrt(2) * 10.0)] * 2, 1e-6),
    "CTUBE": ([*TRUSS, "PTUBE,7,1,.02,.0016754", "CTUBE,1,7,1,3", "CTUBE,2,7,2,3"],
              [E * TUBE / (np.sqrt(2) * 10.0)] * 2, 1e-6),
    "torsion of rods": (TWIST, [E / 2.6 * 2e-6 / 2.0 / 3.0], 1e-4),
    "masses on springs": ([*PAIR, "CELAS2,1,1000.,1,1", "CELAS2,2,500.,1,1,2,1", "PBUSH,5,K,250.", "CBUSH,3,5,2,,,,,0",
                           "SPC1,1,23456,1,2"],
                          eigenvalues([[1500.0, -500.0], [-500.0, 750.0]], np.diag([2.0, 3.0])), 1e-9),
    "two springs of a PELAS": ([*PAIR, "PELAS,5,1000.,,,6,500.", "CELAS1,1,5,1,1", "CELAS1,2,6,1,1,2,1",
                                "SPC1,1,23456,1,2"],
                               eigenvalues([[1500.0, -500.0], [-500.0, 500.0]], np.diag([2.0, 3.0])), 1e-9),
    "rotation springs of a CBUSH": ([*GIMBAL, "PBUSH,5,K,1.+9,1.+9,1.+9,50.,60.,140.", "CBUSH,3,5,1,2,,,,0",
                                     "SPC1,1,123456,1"], [100.0, 100.0, 200.0], 1e-6),
    "MPC": ([*PAIR, "CELAS2,1,1000.,1,1", "MPC,1,2,1,1.,1,1,-3.", "SPC1,1,23456,1,2"], [1000.0 / 29.0], 1e-9),
    "RROD": ([*PAIR, "CELAS2,1,1000.,1,1", "CELAS2,2,250.,2,1", "RROD,9,1,2,,1", "SPC1,1,23456,1,2"],
             [1250.0 / 5.0], 1e-9),
    "RROD askew": (["GRID,1,,0.,0.,0.", "GRID,2,,3.,4.,0.", *PAIR[2:], "CELAS2,1,1000.,1,1", "RROD,9,1,2,,2",
                    "SPC1,1,23456,1", "SPC1,1,13456,2"], [1000.0 / (2.0 + 3.0 * 0.75**2)], 1e-9),
    "RBE3": (["GRID,1,,0.,0.,0.", "GRID,2,,2.,0.,0.", "GRID,3,,1.,0.,0.", "CONM2,11,1,,2.", "CONM2,12,2,,2.",
              "CELAS2,1,800.,3,3", "CELAS2,2,100.,1,3,2,3", "RBE3,9,,3,3,1.,123,1,2", "SPC1,1,12456,1,2"],
             [100.0, 200.0], 1e-8),
    "shear panel": ([*PANEL, "SPC1,1,12345,1,2", "SPC1,1,2345,3,4"], [E / 2.6 * 1e-3 / 100.0], 1e-3),
    "inertias of CMASS2": (SHAFT, CHAIN, 1e-4),
    "cylindrical displacement axes": (["CORD2C,2,0,0.,0.,0.,0.,0.,1.", ",1.,0.,0.", "GRID,1,,3.,4.,0.,2",
                                       "CONM2,11,1,,2.", "CELAS2,1,1000.,1,1", "CELAS2,2,250.,1,2",
                                       "CELAS2,3,9000.,1,3", "SPC1,1,456,1"], [125.0, 500.0, 4500.0], 1e-9),
}  # fmt: skip


@pytest.mark.parametrize("name", CLOSED)
def test_frequencies_of_closed_forms(tmp_path, name):
    cards, squares, rel = CLOSED[name]
    computed = frequencies(read_deck_of_cards(tmp_path, *cards, control="SPC = 1\nMPC = 1"), len(squares))
    assert computed == pytest.approx(hertz(squares), rel=rel)


# The same structure by other cards


def brick(*properties: str) -> list[str]:
    """Four bricks in a row along x, 0.1 m wide and 0.05 m high, held at x = 0."""
    places = [(x, y, z) for x in range(5) for y, z in ((0, 0), (0.1, 0), (0.1, 0.05), (0, 0.05))]
    grids = [f"GRID,{k + 1},,{x / 8},{y},{z}" for k, (x, y, z) in enumerate(places)]
    corners = [(a + 1, a + 5, a + 6, a + 2, a + 4, a + 8, a + 7, a + 3) for a in range(0, 16, 4)]
    cells = [line for k, nodes in enumerate(corners) for line in lines("CHEXA", k + 1, 3, *nodes)]
    return [*grids, *cells, *properties, "SPC1,1,123,1,2,3,4"]


def mat9(C: np.ndarray) -> list[str]:
    order = [0, 1, 2, 5, 3, 4]  # 11 22 33 12 23 31 of the card, from 11 22 33 23 31 12
    C = C[np.ix_(order, order)]
    return lines("MAT9", 1, *(f"{C[i, j]:.9g}" for i in range(6) for j in range(i, 6)), RHO)


ISOTROPIC = np.diag([E / (1 + NU)] * 3 + [E / (2 * (1 + NU))] * 3)
ISOTROPIC[:3, :3] += E * NU / ((1 + NU) * (1 - 2 * NU))
SOFT = ISOTROPIC * np.where(np.arange(6) < 3, 1.0, 0.1)
STIFF = ISOTROPIC + np.diag([3 * ISOTROPIC[0, 0], 0, 0, 0, 0, 0])
ACROSS = STIFF[np.ix_([1, 0, 2, 4, 3, 5], [1, 0, 2, 4, 3, 5])]
SHEET = [E / (1 - NU**2), NU * E / (1 - NU**2), 0.0, E / (1 - NU**2), 0.0, E / (2 * (1 + NU)), RHO]
MAT8 = "MAT8,8,1.4+11,1.+10,.3,5.+9,5.+9,3.+9,1600."


def boxed(*lumps: str) -> list[str]:
    beams = [card.replace("CBAR", "CBEAM") for card in bar(4)][:-3]
    return [*beams, *lumps, STEEL, "SPC1,1,123456,1"]


UP = [c.replace("0.,1.,0.", "0.,0.,1.") for c in bar()]  # plane 1 is x-z
BLANK = [c.replace(",0.,1.,0.", "") for c in bar()]
POINT = ["GRID,77,,0.,0.,9.,,123456"]
NESTED = ["CORD2R,1,0,1.,2.,3.,1.,2.6,3.8", ",2.,2.,3.", "CORD2C,2,1,0.,0.,0.,1.,0.,0.", ",0.,0.,1."]
MAST = [f"GRID,{k + 1},2,0.,0.,{2.0 * k / 8:.6f},1" for k in range(9)]
POINTS = ["GRID,91,,0.,0.,0.,,123456", "GRID,92,,1.,0.,0.,,123456", "GRID,93,,0.,0.,1.,,123456"]  # z along x
RADIAL = [f"GRID,{k + 1},2,{2.0 * k / 8:.6f},0.,0." for k in range(9)]
LOAD, INSTRUMENT = ["CONM2,60,9,,5.,0.,0.,0.3"], ["GRID,100,,2.,0.,0.3", "CONM2,60,100,,5."]
OUTRIGGERS = [*bar(), "GRID,20,,1.,1.,0.", "RBE2,70,5,123456,20", "GRID,21,,1.,0.,1.", "RBE2,71,5,123456,21",
              "GRID,30,,1.2,0.4,0.3", "CONM2,61,30,,40.,,,,", ",1.,,1.,,,1."]  # fmt: skip
SIDE = [*bar(), "GRID,20,,2.,1.,0.", "SPC1,1,123456,20"]
LIMP = [c.replace("2.E-7,8.E-7,1.E-6", "2.E-11,8.E-11,1.E-10") for c in bar()]
LIMP += ["GRID,90,,2.,0.,0.", *lines("CONM2", 91, 90, "", 0.3, "", "", "", "", 0.01, "", 0.02, "", "", 0.03)]
LUMPED = f"PBEAM,3,1,1.E-3,{1e-3 * 0.03**2:.6g},{1e-3 * 0.015**2:.6g},,1.E-6"
TAIL = bar()[9:]
SAME = {
    "G0": ([*(c.replace(",0.,1.,0.", ",77") if c.startswith("CBAR") else c for c in bar()), *POINT], UP, 1e-9),
    "BAROR": ([*BLANK, "BAROR,,3,,,0.,0.,1."], UP, 1e-9),
    "blank before an exponent": ([c.replace(STEEL, "MAT1    1       2.1 E+11        .3      7850.") for c in bar()],
                                 bar(), 1e-12),
    "repeated fields": (["GRID,1,,0.,0.,0.", "=,*1,=,*0.25,==", "=7", "CBAR,1,3,1,2,0.,1.,0.",
                         "=(7),*(1),=,*(1),*(1),==", "PBAR, 3 1 1.E-3, 2.-7 8.E-7 1.E-6", STEEL,
                         "SPC1,1,123456,1"], bar(), 1e-9),
    "nested systems": ([*NESTED, *MAST, *TAIL], bar(), 1e-9),
    "CORD1R": ([*POINTS, "CORD1R,2,91,92,93", *(c.rsplit(",", 1)[0] for c in MAST), *UP[9:]], UP, 1e-6),
    "CORD1C": ([*POINTS, "CORD1C,2,91,92,93", *(c.rsplit(",", 1)[0] for c in MAST), *UP[9:]], UP, 1e-6),
    "CORD1S": ([*POINTS, "CORD1S,2,91,92,93", *RADIAL, *UP[9:]], UP, 1e-6),
    "CORD2S": (["CORD2S,2,0,0.,0.,0.,1.,0.,0.", ",0.,0.,1.", *RADIAL, *UP[9:]], UP, 1e-6),
    "SPC of two grids": ([*bar()[:-1], "SPC,1,1,123456,0.,9,123456"], [*bar(), "SPC1,1,123456,9"], 1e-12),
    "SPC1 of a hundred million grids": ([*bar(), "SPC1,1,6,100,THRU,99999999"], bar(), 1e-12),
    "RBE2": ([*bar(), *INSTRUMENT, "RBE2,50,9,123456,100"], [*bar(), *LOAD], 1e-8),
    "RBAR": ([*bar(), *INSTRUMENT, "RBAR,50,9,100,123456"], [*bar(), *LOAD], 1e-8),
    "RBE1": ([*bar(), *INSTRUMENT, "RBE1,50,9,123456", ",UM,100,123456"], [*bar(), *LOAD], 1e-8),
    "RBE3 of one grid": ([*bar(), *INSTRUMENT, "RBE3,50,,100,123456,1.,123456,9"], [*bar(), *LOAD], 1e-8),
    "RBE3 adds weights": ([*OUTRIGGERS, "RBE3,50,,30,123456,1.,123,5,20", ",21,2.,123,21"],
                          [*OUTRIGGERS, "RBE3,50,,30,123456,1.,123,5,20", ",3.,123,21"], 1e-9),
    "CBUSH1D": ([*SIDE, "CBUSH1D,9,10,9,20", "PBUSH1D,10,1.+4"], [*SIDE, "CELAS2,9,1.+4,9,2"], 1e-12),
    "rigid CBUSH": ([*LIMP, "PBUSH,5,K,RIGID,RIGID,RIGID,RIGID,RIGID,RIGID", "CBUSH,95,5,9,90,,,,0"],
                    [*LIMP, "RBE2,95,9,123456,90"], 1e-3),
    "PBCOMP without lumps": (boxed("PBCOMP,3,1,1.E-3,9.E-7,2.25E-7,,1.E-6"), boxed(LUMPED), 1e-9),
    "MAT2 of isotropic numbers": (plate("PSHELL,3,1,0.01,1", ",".join(["MAT2,1", *(f"{g:.9g}" for g in SHEET)])),
                                  plate("PSHELL,3,1,0.01,1", STEEL), 2e-3),
    "MAT8 in a PSHELL": (plate("PSHELL,3,8,0.01,8,,8", MAT8), plate("PCOMP,3", ",8,0.01,0.", MAT8), 2e-3),
    "PCOMPG": (plate("PCOMPG,3", ",101,8,1.-3,0.", ",102,8,2.-3,45.", ",103,8,1.-3,0.", MAT8),
               plate("PCOMP,3", ",8,1.-3,0.,,8,2.-3,45.", ",8,1.-3,0.", MAT8), 1e-9),
    "MAT9 of isotropic numbers": (brick("PSOLID,3,1", *mat9(ISOTROPIC)), brick("PSOLID,3,1", STEEL), 1e-6),
    "G of a MAT1 in solids": (brick("PSOLID,3,1", f"MAT1,1,{E},{E / 26:.9g},{NU},{RHO}"),
                              brick("PSOLID,3,1", *mat9(SOFT)), 1e-6),
    "element axes of solids": (brick("PSOLID,3,1,-1", *mat9(STIFF)), brick("PSOLID,3,1,0", *mat9(STIFF)), 1e-6),
    "system of solids": (brick("PSOLID,3,1,7", *mat9(STIFF), "CORD2R,7,0,0.,0.,0.,0.,0.,1.", ",0.,1.,0."),
                         brick("PSOLID,3,1,0", *mat9(ACROSS)), 1e-6),
}  # fmt: skip


@pytest.mark.sampled(18)
@pytest.mark.parametrize("name", SAME)
def test_frequencies_of_equal_structures_by_card(tmp_path, name):
    cards, others, rel = SAME[name]
    computed, expected = (frequencies(read_deck_of_cards(tmp_path, *given), 4) for given in (cards, others))
    assert computed == pytest.approx(expected, rel=rel)


@pytest.mark.parametrize("units, length, mass", [("mm-t-s", 1e-3, 1e3), ("in-lbf-s", 0.0254, 175.12683524647636)])
def test_deck_in_other_units(tmp_path, units, length, mass):
    A, I1, I2, J = (v / length**p for v, p in ((1e-3, 2), (2e-7, 4), (8e-7, 4), (1e-6, 4)))
    cards = bar(8, 2.0 / length, f"PBAR,3,1,{A:.12E},{I1:.12E},{I2:.12E},{J:.12E}")
    steel = f"MAT1,1,{E * length / mass:.12E},,0.3,{RHO * length**3 / mass:.12E}"
    deck = read_deck_of_cards(tmp_path, *(steel if card == STEEL else card for card in cards), units=units)
    assert frequencies(deck, 2) == pytest.approx(frequencies(read_deck_of_cards(tmp_path, *bar()), 2), rel=1e-6)
    assert mass_and_centre(deck.structure())[0] == pytest.approx(RHO * 1e-3 * 2.0, rel=1e-6)


def test_bars_off_their_grids_by_parallel_axes(tmp_path):
    """Two bars on one line of grids, one shifted by 0.1 m on each side: EI = 2 (I + A d^2).

    Between grids the two bend as a frame, which shears by h^2 / 24 EI: 1 / f^2 = 1 / f_EI^2 + (4 L)^2 m h^2 / 24 EI.
    """
    n, d, h = 16, 0.1, 2.0 / 16
    grids = [f"GRID,{k + 1},,{2.0 * k / n:.6f},0.,0." for k in range(n + 1)]
    bars = [line for k in range(n) for side, first in ((d, 1), (-d, 101))
            for line in (f"CBAR,{first + k},3,{k + 1},{k + 2},0.,1.,0.", f",,,0.,{side},0.,0.,{side},0.")]  # fmt: skip
    deck = read_deck_of_cards(tmp_path, *grids, *bars, "PBAR,3,1,1.E-3,2.E-7,8.E-7,1.E-6", STEEL, "SPC1,1,123456,1")
    line, soft = (hertz(euler(2 * E * I, 2 * RHO * 1e-3, 2.0))[0] for I in (2e-7 + 1e-3 * d**2, 8e-7))
    computed = frequencies(deck, 4)
    assert np.abs(computed - soft).min() < 0.01 * soft
    expected = (line**-2 + 64.0 * 2 * RHO * 1e-3 * h**2 / (24 * E * 2e-7)) ** -0.5
    assert np.abs(computed - expected).min() < 0.02 * line  # rotary inertia of the two lines, 2 (beta d / L)^2 at most


def test_tapered_beam_has_the_mass_of_its_integrals(tmp_path):
    """PBEAML from 40 mm to 20 mm square over 2 m, in 16 elements."""
    n, cards = 16, [STEEL, "SPC1,1,123456,1", "GRID,1,,0.,0.,0."]
    for k in range(n):
        a, b = 0.04 - 0.02 * k / n, 0.04 - 0.02 * (k + 1) / n
        cards += [f"GRID,{k + 2},,{2.0 * (k + 1) / n},0.,0.", f"CBEAM,{k + 1},{k + 1},{k + 1},{k + 2},0.,1.,0."]
        cards += [f"PBEAML,{k + 1},1,,BAR", f",{a},{a},,YES,1.,{b},{b}"]
    mass, centre = mass_and_centre(read_deck_of_cards(tmp_path, *cards).structure())
    A = np.poly1d([-0.01, 0.04]) ** 2
    first = np.polyint(A * np.poly1d([1.0, 0.0]))(2.0) / np.polyint(A)(2.0)
    assert mass == pytest.approx(RHO * np.polyint(A)(2.0), rel=1e-3) and centre[0] == pytest.approx(first, rel=1e-3)


def test_includes_of_files_in_folders(tmp_path):
    (tmp_path / "parts" / "deep").mkdir(parents=True)
    cards = bar()
    (tmp_path / "parts" / "mesh.bdf").write_text("\n".join([*cards[:9], "INCLUDE 'deep/bars.bdf'"]))
    (tmp_path / "parts" / "deep" / "bars.bdf").write_text("\n".join([*cards[9:17], "include 'parts/steel.bdf'"]))
    (tmp_path / "parts" / "steel.bdf").write_text("\n".join(cards[17:]))
    path = written(tmp_path, "INCLUDE 'parts/mesh.bdf'", name="main.bdf")
    assert frequencies(read_deck(path), 1) == pytest.approx(
        frequencies(read_deck_of_cards(tmp_path, *cards), 1), rel=1e-12
    )


def test_wtmass_and_overrides_change_the_mass(tmp_path):
    mass, centre = mass_and_centre(
        read_deck_of_cards(tmp_path, *bar(), "CONM2,50,9,,3.", "PARAM,WTMASS,0.5").structure()
    )
    assert mass == pytest.approx((RHO * 2e-3 + 3.0) / 2)
    assert centre[0] == pytest.approx((RHO * 2e-3 + 6.0) / (RHO * 2e-3 + 3.0))
    given = read_deck_of_cards(tmp_path, *bar(), overrides={"pid_3": {"I1": 4e-7}, "mat_1": {"density": 15700.0}})
    assert frequencies(given, 1) == pytest.approx(frequencies(read_deck_of_cards(tmp_path, *bar()), 1), rel=5e-3)
    assert mass_and_centre(given.structure())[0] == pytest.approx(31.4)
