"""Cards of Nastran that few decks have: GENEL, PBCOMP, CBEAM3, and cards that repeat others."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from support.nastran_decks import STEEL, bar, frequencies, read

from femflex.decks import DeckError

AROUND = [*bar(4), "GRID,6,,2.5,0.,0.,,1345", "CONM2,7,6,,3.0", "SPC1,1,1345,2,3,4,5"]  # in the plane x-y
SECTION = "PBEAM,3,1,1.E-3,2.E-7,8.E-7,,1.E-6"


def beams(section: str = SECTION, n: int = 4) -> list[str]:
    """A cantilever of CBEAM along x."""
    return [card.replace("CBAR", "CBEAM") for card in bar(n, section=section)]


def bending(L: float = 0.5, EI: float = 2.1e11 * 2e-7) -> tuple[np.ndarray, np.ndarray]:
    """Stiffness [N/m, N, N m] of a slender bar over (v1, r1, v2, r2), and the rigid motion of its end 2 by end 1."""
    K = EI / L**3 * np.array(
        [[12, 6 * L, -12, 6 * L], [6 * L, 4 * L**2, -6 * L, 2 * L**2],
         [-12, -6 * L, 12, -6 * L], [6 * L, 2 * L**2, -6 * L, 4 * L**2]]
    )  # fmt: skip
    return K, np.array([[1, L], [0, 1]])


def low(A: np.ndarray) -> str:
    """The lower triangle by columns."""
    return ",".join(f"{A[i, j]:.12g}" for j in range(len(A)) for i in range(j, len(A)))


def general(kind: str) -> list[str]:
    """GENEL between grids 5 and 6 that bends as a bar of 0.5 m in the plane x-y, and rods and masses around it."""
    K, S = bending()
    end = K[2:, 2:]
    if kind == "K":
        words = f"GENEL,9,,5,2,5,6,6,2,,6,6,K,{low(K)}"
    else:
        words = f"GENEL,9,,6,2,6,6,UD,,5,2,5,6,{kind[0]},{low(end if kind[0] == 'K' else np.linalg.inv(end))}"
        words += ",S," + ",".join(f"{v:.12g}" for v in S.ravel()) if kind.endswith("S") else ""
    return [*AROUND, *_free([words])]


@pytest.mark.parametrize("kind", ["K", "K by UD S", "Z by UD S", "Z by rigid motion"])
def test_a_matrix_bends_as_the_bar_that_it_is_of(tmp_path: Path, kind):
    """A massless bar from grid 5 to grid 6, which carries 3 kg, is the same by its matrix."""
    whole = [*AROUND, "CBAR,9,8,5,6,0.,1.,0.",
             "PBAR,8,2,1.E-3,2.E-7,8.E-7,1.E-6", "MAT1,2,2.1E11,,0.3,0."]  # fmt: skip
    expected = frequencies(read(tmp_path, *whole))
    assert frequencies(read(tmp_path, *general(kind))) == pytest.approx(expected, rel=1e-6)


def test_a_matrix_in_millimetres_is_the_same(tmp_path: Path):
    K, _ = bending()
    spring = [
        "GRID,1,,0.,0.,0.",
        "GRID,2,,{x},0.,0.,,1345",
        "CONM2,7,2,,{m},,,,",
        ",{J},,{J},,,{J}",
        "SPC1,1,123456,1",
    ]
    metres = [c.format(x="0.5", m="3.0", J="0.1") for c in spring]
    metres += [f"GENEL,9,,2,2,2,6,,,K,{K[2, 2]:.12g},{K[3, 2]:.12g},{K[3, 3]:.12g}"]
    milli = [c.format(x="500.0", m="3.0-3", J="100.") for c in spring]
    milli += [f"GENEL,9,,2,2,2,6,,,K,{K[2, 2] * 1e-3:.12g},{K[3, 2]:.12g},{K[3, 3] * 1e3:.12g}"]
    expected = frequencies(read(tmp_path, *_free(metres)), 2)
    assert frequencies(read(tmp_path, *_free(milli), units="mm-t-s"), 2) == pytest.approx(expected, rel=1e-9)
    M = np.diag([3.0, 0.1])
    exact = np.sqrt(np.sort(np.linalg.eigvals(np.linalg.solve(M, K[2:, 2:])).real)) / (2 * np.pi)
    assert expected == pytest.approx(exact, rel=1e-9)


def _free(cards: list[str]) -> list[str]:
    """Free lines of at most nine fields."""
    lines = []
    for card in cards:
        fields = card.split(",")
        lines += [",".join(fields[:9])] + ["," + ",".join(fields[k : k + 8]) for k in range(9, len(fields), 8)]
    return lines


@pytest.mark.parametrize(
    ("card", "sentence"),
    [
        ("GENEL,9,,5,2,5,6,,,K,1.,0.,1.,5.", "4 values of K"),
        ("GENEL,9,,5,2,5,6", "neither K nor Z"),
        ("GENEL,9,,5,2,5,9,,,K,1.,0.,1.", "components of grid points are 1 to 6"),
        ("GENEL,9,,5,2,5,6,,,K,1.,2.,1.", "not positive semidefinite"),
        ("GENEL,9,,5,2,5,6,,,Z,1.,2.,1.", "not positive definite"),
        ("GENEL,9,,5,2,77,2,,,K,1.,0.,1.", "uses grid point 77"),
        ("GENEL,9,,5,2,5,6,UD,,4,2,K,1.,0.,1.", "do not determine the rigid motions of UI"),
    ],
)
def test_a_matrix_that_cannot_be_is_named_with_its_line(tmp_path: Path, card, sentence):
    with pytest.raises(DeckError, match=sentence) as error:
        read(tmp_path, *bar(4), *_free([card]))
    assert "deck.bdf:" in str(error.value) and "GENEL 9" in str(error.value)


def test_lumped_areas_bend_as_their_moments(tmp_path: Path):
    """Four corners of a box of 60 by 30 mm, with both symmetries, and the areas of a ring by point symmetry."""
    plain = f"PBEAM,3,1,1.E-3,{1e-3 * 0.03**2:.6g},{1e-3 * 0.015**2:.6g},,1.E-6"
    expected = frequencies(read(tmp_path, *beams(plain)))
    head = "PBCOMP,3,1,1.E-3,,,,1.E-6"
    four = [head, ",1.,1.,,,,,1", ",0.03,0.015,0.25"]
    assert frequencies(read(tmp_path, *beams()[:-3], *four, STEEL, "SPC1,1,123456,1")) == pytest.approx(expected, 1e-9)
    two = [head, ",1.,1.,,,,,2", ",0.03,0.015,0.25", ",-0.03,0.015,0.25"]
    assert frequencies(read(tmp_path, *beams()[:-3], *two, STEEL, "SPC1,1,123456,1")) == pytest.approx(expected, 1e-9)
    none = ["PBCOMP,3,1,1.E-3,9.E-7,2.25E-7,,1.E-6"]
    assert frequencies(read(tmp_path, *beams()[:-3], *none, STEEL, "SPC1,1,123456,1")) == pytest.approx(expected, 1e-9)


def test_lumped_areas_of_two_materials_bend_and_weigh_as_their_sum(tmp_path: Path):
    """Faces of twice the modulus and half the density: EI, EA and mass are the sums over the areas."""
    mixed = ["PBCOMP,3,1,1.E-3,,,,1.E-6", ",1.,1.,,,,,1", ",0.03,0.015,0.15,2", ",0.01,0.01,0.1,1",
             STEEL, "MAT1,2,4.2E11,,0.3,3925.", "SPC1,1,123456,1"]  # fmt: skip
    deck = read(tmp_path, *beams()[:-3], *mixed)
    mass = sum(float(block.dm.sum()) for block in deck.structure().inertia)
    assert mass == pytest.approx(2.0 * 1e-3 * (0.6 * 3925 + 0.4 * 7850), rel=1e-9)
    I2 = 1e-3 * (2 * 0.6 * 0.015**2 + 0.4 * 0.01**2)  # over steel's modulus
    A = 1e-3 * (2 * 0.6 + 0.4)
    rho = (0.6 * 3925 + 0.4 * 7850) * 1e-3 / A
    same = f"PBEAM,3,3,{A:.9g},{1e-3 * (1.2 * 0.03**2 + 0.4 * 0.01**2):.9g},{I2:.9g},,1.E-6"
    factors = [",,,,,,,,", f",{1e-3 / A:.9g},{1e-3 / A:.9g}"]
    plain = read(tmp_path, *beams()[:-3], same, *factors, f"MAT1,3,2.1E11,,0.3,{rho:.9g}", "SPC1,1,123456,1")
    assert frequencies(deck) == pytest.approx(frequencies(plain), rel=1e-6)


@pytest.mark.parametrize(
    ("lines", "sentence"),
    [
        ([",1.,1.,,,,,1", ",0.03,0.015,0.5"], "whose fractions C add up to 2"),
        ([",1.,1.,,,,,7", ",0.03,0.015,0.5"], "has SECTION 7"),
    ],
)
def test_lumped_areas_that_are_not_the_whole_are_refused(tmp_path: Path, lines, sentence):
    with pytest.raises(DeckError, match=sentence):
        read(tmp_path, *beams()[:-3], "PBCOMP,3,1,1.E-3,,,,1.E-6", *lines, STEEL, "SPC1,1,123456,1")


def arc(n: int, card: str) -> list[str]:
    """A quarter of a circle of 1 m in x-y, of n elements, clamped at its start and with 1 kg at its end."""
    k = n if card == "CBEAM" else 2 * n
    angles = np.linspace(0, np.pi / 2, k + 1)
    grids = [f"GRID,{i + 1},,{np.cos(a):.9f},{np.sin(a):.9f},0." for i, a in enumerate(angles)]
    if card == "CBEAM":
        cells = [f"CBEAM,{i + 1},3,{i + 1},{i + 2},0.,0.,1." for i in range(n)]
        section = "PBEAM,3,1,1.E-3,2.E-7,8.E-7,,1.E-6"
    else:
        cells = [f"CBEAM3,{i + 1},3,{2 * i + 1},{2 * i + 3},{2 * i + 2},0.,0.,1." for i in range(n)]
        section = "PBEAM3,3,1,1.E-3,2.E-7,8.E-7,,1.E-6"
    return [*grids, *cells, section, STEEL, f"CONM2,99,{k + 1},,1.0", "SPC1,1,123456,1"]


def test_beams_of_three_grids_follow_the_arc(tmp_path: Path):
    expected = frequencies(read(tmp_path, *arc(64, "CBEAM")))
    assert frequencies(read(tmp_path, *arc(2, "CBEAM3"))) == pytest.approx(expected, rel=3e-3)
    straight = [c.replace("CBEAM3,1,3,1,3,2", "CBEAM3,1,3,1,3,0") for c in arc(1, "CBEAM3")]
    assert frequencies(read(tmp_path, *straight), 1)[0] > 1.02 * expected[0]  # a chord is shorter


def test_beams_of_three_grids_with_more_than_is_read_are_refused(tmp_path: Path):
    cards = arc(1, "CBEAM3")
    k = next(k for k, card in enumerate(cards) if card.startswith("CBEAM3"))
    with pytest.raises(DeckError, match="CBEAM3 1 has an offset or a twist in field 10"):
        read(tmp_path, *cards[: k + 1], ",0.01", *cards[k + 1 :])
    tilted = "PBEAM3,3,1,1.E-3,2.E-7,8.E-7,1.E-8,1.E-6"
    with pytest.raises(DeckError, match="PBEAM3 3 has Iyz"):
        read(tmp_path, *(tilted if card.startswith("PBEAM3") else card for card in cards))


def test_cards_that_repeat_others_are_those_cards(tmp_path: Path):
    """Fields =, *(x), == and =(n), and free lines whose fields stand apart by blanks, make the mast of single cards."""
    repeated = ["GRID,1,,0.,0.,0.", "=,*1,=,*0.25,==", "=7", "CBAR,1,3,1,2,0.,1.,0.", "=(7),*(1),=,*(1),*(1),==",
                "PBAR, 3 1 1.E-3, 2.-7 8.E-7 1.E-6", STEEL, "SPC1,1,123456,1"]  # fmt: skip
    deck = read(tmp_path, *repeated)
    assert deck.used["GRID"] == 9 and deck.used["CBAR"] == 8
    assert frequencies(deck) == pytest.approx(frequencies(read(tmp_path, *bar())), rel=1e-9)


def test_a_repetition_that_adds_to_no_number_is_named_with_its_line(tmp_path: Path):
    with pytest.raises(ValueError, match=r"deck.bdf:6: the line repeats GRID .* where a number is added"):
        read(tmp_path, "GRID,1,X,0.,0.,0.", "=,*1,*4,==", "=7")


def test_what_is_not_elastic_of_a_material_is_left_out_and_not_counted_as_used(tmp_path: Path):
    deck = read(tmp_path, *bar(), "MATS1,1,,PLASTIC", "MATT1,1,4", "MATT1,2,4", "MAT4,9,1.", "MATHP,8,1.")
    assert deck.used == {"CBAR": 8, "GRID": 9, "MAT1": 1, "PBAR": 1, "SPC1": 1}
    assert [str(one).partition(" (first at ")[0] for one in deck.unused] == [
        "1 MAT4: heat conduction is left out",
        "1 MATHP: hyperelasticity is left out",
        "1 MATS1: plasticity is left out; the material stays linear",
        "2 MATT1: dependence on temperature is left out; the values of MAT1 are used",
    ]


def test_pshell_with_mid4_is_the_laminate_that_it_was_made_of(tmp_path: Path):
    """The stiffness of two plies of unlike material, off the grids, by PCOMP and by PSHELL with MID1, MID2 and MID4."""
    grids = [f"GRID,{5 * i + j + 1},,{0.2 * i:.3f},{0.1 * j:.3f},0." for i in range(7) for j in range(5)]
    cells = [
        f"CQUAD4,{4 * i + j + 1},3,{5 * i + j + 1},{5 * i + j + 6},{5 * i + j + 7},{5 * i + j + 2},0.,{{}}"
        for i in range(6) for j in range(4)
    ]  # fmt: skip
    held = "SPC1,1,123456,1,2,3,4,5"
    t, h = 0.004, 0.01  # plies, and offset of the middle surface
    Q = [E / (1 - 0.09) * np.array([[1, 0.3, 0], [0.3, 1, 0], [0, 0, 0.35]]) for E in (70e9, 10e9)]
    A, B, D = (sum(q * (b**k - a**k) / k for q, a, b in zip(Q, (-t, 0), (0, t), strict=True)) for k in (1, 2, 3))
    T = 2 * t

    def mat2(number: int, G: np.ndarray, density: str) -> str:
        values = ",".join(f"{v:.9e}" for v in (G[0, 0], G[0, 1], G[0, 2], G[1, 1], G[1, 2], G[2, 2]))
        return f"MAT2,{number},{values},{density}"

    shells = [c.format(f"{h:.3f}") for c in cells]
    laminate = ["PCOMP,3", f",11,{t},0.,,12,{t},0.", "MAT8,11,70.E9,70.E9,0.3,26.923077E9,1.E13,1.E13,2000.",
                "MAT8,12,10.E9,10.E9,0.3,3.8461538E9,1.E13,1.E13,2000."]  # fmt: skip
    by_pcomp = frequencies(read(tmp_path, *grids, *shells, *laminate, held))
    smeared = [f"PSHELL,3,21,{T},22,,,,,", ",,,24", mat2(21, A / T, "2000."), mat2(22, 12 * D / T**3, "2000."),
               mat2(24, -B / T**2, "0.")]  # fmt: skip
    by_pshell = frequencies(read(tmp_path, *grids, *shells, *smeared, held))
    assert by_pshell == pytest.approx(by_pcomp, rel=1e-4)
    without = [c for c in smeared if not c.startswith((",,,24", "MAT2,24"))]
    other = frequencies(read(tmp_path, *grids, *shells, *without, held))
    assert abs(other[0] / by_pcomp[0] - 1) > 0.05


def test_components_that_are_fixed_are_listed_by_node(tmp_path: Path):
    """Two rods along x resist neither y nor z at grids 2 and 3."""
    grids = [f"GRID,{k + 1},,{k}.,0.,0." for k in range(3)]
    rods = ["CROD,1,3,1,2", "CROD,2,3,2,3", "PROD,3,1,1.E-4"]
    deck = read(tmp_path, *grids, *rods, STEEL, "SPC1,1,123,1")
    assert any("4 components" in note and "y, z at nodes 2, 3; if they shall move" in note for note in deck.notes)


def test_scalar_masses_about_an_axis_are_inertias(tmp_path: Path):
    """A fixed shaft of ten bars without mass, with equal discs: exact torsion of the chain; the bending has none."""
    grids = [f"GRID,{k + 1},,0.,{0.1 * k},0.,,126" for k in range(11)]
    bars = [f"CBAR,{k + 1},3,{k + 1},{k + 2},0.,0.,1." for k in range(10)]
    pbar = "PBAR,3,1,1.E-4,1.E-8,1.E-8,2.E-8"
    discs = [f"CMASS2,{k + 20},2.E-3,{k + 1},5" for k in range(1, 11)]
    steel = "MAT1,1,210.E9,80.E9,,1.E-6"
    found = frequencies(read(tmp_path, *grids, *bars, pbar, steel, *discs, "SPC1,1,345,1"), 3)
    k, J = 80e9 * 2e-8 / 0.1, 2e-3
    exact = 2 * np.sqrt(k / J) * np.sin((2 * np.arange(1, 4) - 1) * np.pi / 42) / (2 * np.pi)
    assert found == pytest.approx(exact, rel=1e-4)
