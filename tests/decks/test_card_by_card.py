"""Cards of Nastran, one by one, against closed forms or the cards that they are equal to."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from support.nastran_decks import STEEL, bar, frequencies, read

from femflex.decks import DeckError
from femflex.decks.report import describe, mass_and_centre

E, NU, RHO = 2.1e11, 0.3, 7850.0


def lines(*words: object) -> list[str]:
    """A card of any length in free fields, eight on a line."""
    name, *rest = words
    return [",".join(map(str, [name if k == 0 else "", *rest[k : k + 8]])) for k in range(0, len(rest), 8)]


def body(grid: int, mass: float, J: tuple[float, float, float]) -> list[str]:
    """CONM2 of a mass with principal inertias."""
    return lines("CONM2", 900 + grid, grid, "", mass, "", "", "", "", J[0], "", J[1], "", "", J[2])


def hertz(K: np.ndarray, M: np.ndarray) -> np.ndarray:
    return np.sqrt(np.sort(np.linalg.eigvals(np.linalg.solve(M, K)).real)) / (2 * np.pi)


def unused(folder: Path, *cards: str) -> str:
    """What is said of a deck whose cards are not all used."""
    return str(describe(read(folder, *cards)))


def plate(*properties: str, cards: str = "CQUAD4", pid: int = 3, n: int = 4) -> list[str]:
    """A cantilever plate of n by 2 quadrilaterals, 1 m by 0.5 m, held along x = 0."""
    grids = [f"GRID,{1 + i + (n + 1) * j},,{i / n},{j / 4},0." for j in range(3) for i in range(n + 1)]
    cells = []
    for j in range(2):
        for i in range(n):
            a = 1 + i + (n + 1) * j
            cells.append(f"{cards},{100 + len(cells)},{pid},{a},{a + 1},{a + n + 2},{a + n + 1}")
    held = ",".join(str(1 + (n + 1) * j) for j in range(3))
    return [*grids, *cells, *properties, f"SPC1,1,123456,{held}"]


SHELL = "PSHELL,3,1,0.01,1,,1"


# Springs


def test_two_springs_of_a_card_pelas(tmp_path):
    cards = ["GRID,1,,0.,0.,0.", "GRID,2,,1.,0.,0.", "CONM2,11,1,,2.", "CONM2,12,2,,3.", "SPC1,1,23456,1,2"]
    springs = ["PELAS,5,1000.,,,6,500.", "CELAS1,1,5,1,1", "CELAS1,2,6,1,1,2,1"]
    K, M = np.array([[1500.0, -500.0], [-500.0, 500.0]]), np.diag([2.0, 3.0])
    assert frequencies(read(tmp_path, *cards, *springs), 2) == pytest.approx(hertz(K, M), rel=1e-9)


@pytest.mark.parametrize("orientation", ["0.,0.6,0.8", "3,,"])
def test_a_bushing_between_two_grids_lies_along_its_line_and_its_vector(tmp_path, orientation):
    """K1 along x, K2 along (0, 0.6, 0.8), K3 across; by components or by a grid point."""
    cards = ["GRID,1,,0.,0.,0.", "GRID,2,,1.,0.,0.", "CONM2,11,2,,2.", "GRID,3,,0.,6.,8.,,123456"]
    cards += ["SPC1,1,123456,1", "SPC1,1,456,2"]
    bush = ["PBUSH,5,K,900.,400.,100.,,,", f"CBUSH,3,5,1,2,{orientation}"]
    found = frequencies(read(tmp_path, *cards, *bush), 3)
    deck = read(tmp_path, *cards, *bush)
    structure = deck.structure()
    place = [0.0, 0.6, 0.8]
    assert found == pytest.approx(np.sqrt(np.array([100.0, 400.0, 900.0]) / 2.0) / (2 * np.pi), rel=1e-6)
    free = np.setdiff1d(np.arange(structure.n_dof), structure.held_dofs(deck.held()))
    grid = int(np.argmin(np.linalg.norm(structure.mesh.points - [1.0, 0, 0], axis=1)))
    rows = structure.translation[3 * grid : 3 * grid + 3][:, free].toarray()
    K = rows @ structure.K[free][:, free].toarray() @ rows.T
    assert place @ K @ place == pytest.approx(400.0, rel=1e-6)


@pytest.mark.parametrize(("K", "turns"), [("900.,,", False), (",400.,", True), (",,100.", True)])
def test_a_bushing_across_a_distance_turns_its_grids(tmp_path, K, turns):
    """Forces across the line act on lever arms of half the distance; those along it on none."""
    cards = ["GRID,1,,0.,0.,0.", "GRID,2,,1.,0.,0.", "CONM2,11,2,,2.", "SPC1,1,123456,1", "PARAM,AUTOSPC,NO"]
    deck = read(tmp_path, *cards, f"PBUSH,5,K,{K}", "CBUSH,3,5,1,2,0.,1.,0.")
    assert bool(deck.structure().rotation.nnz) == turns


def test_a_bushing_against_rotation_turns_the_inertia_on_it(tmp_path):
    cards = ["GRID,1,,0.,0.,0.", "GRID,2,,0.,0.,0.", *body(2, 2.0, (0.5, 0.6, 0.7)), "SPC1,1,123456,1"]
    cards += ["PBUSH,5,K,1.+9,1.+9,1.+9,50.,60.,140.", "CBUSH,3,5,1,2,,,,0"]
    found = frequencies(read(tmp_path, *cards), 3)
    assert found == pytest.approx(np.sqrt([100.0, 100.0, 200.0]) / (2 * np.pi), rel=1e-6)


@pytest.mark.parametrize("K", ["RIGID", "1.+13"])
def test_a_bushing_that_stands_for_a_rigid_link_leaves_the_rest_to_move(tmp_path, K):
    """On the tip of a thin cantilever: as stiff as RBE2, though the beam is softer by eleven orders."""
    cards = [c.replace("2.E-7,8.E-7,1.E-6", "2.E-11,8.E-11,1.E-10") for c in bar()]
    cards += ["GRID,90,,2.,0.,0.", *body(90, 0.3, (0.01, 0.02, 0.03))]
    rigid = read(tmp_path, *cards, "RBE2,95,9,123456,90")
    bush = read(tmp_path, *cards, f"PBUSH,5,K,{K},{K},{K},{K},{K},{K}", "CBUSH,95,5,9,90,,,,0")
    assert frequencies(bush, 5) == pytest.approx(frequencies(rigid, 5), rel=1e-3)
    assert not any("autospc" in note for note in bush.notes)


@pytest.mark.parametrize(
    ("cards", "told"),
    [
        (["PBUSH,5,K,900.", ",,B,3.", "CBUSH,3,5,1,2,,,,0"], "PBUSH B: damping of bushings is left out"),
        (["PBUSH,5,K,900.", ",,GE,.01", "CBUSH,3,5,1,2,,,,0"], "PBUSH GE: structural damping of bushings is left out"),
        (["PBUSH,5,K,0.", "CBUSH,3,5,1,2,,,,0"], "CBUSH: its stiffness is zero"),
        (["CELAS2,3,0.,2,1"], "CELAS2: its stiffness is zero"),
        (["CELAS3,3,5,1,2", "PELAS,5,3."], "CELAS3: springs of scalar points are left out"),
        (["PBUSH1D,5,0.", "CBUSH1D,3,5,1,2"], "CBUSH1D: its stiffness is zero"),
    ],
)
def test_springs_that_do_nothing_are_counted(tmp_path, cards, told):
    assert f"1 {told}" in unused(tmp_path, *bar(2), *cards)


@pytest.mark.parametrize(
    ("cards", "sentence"),
    [
        (
            ["CELAS1,3,9,2,1", "PELAS,5,3."],
            r"CELAS1 3.*names property 9, which is not in the deck; of PELAS it has \[5\]",
        ),
        (["CELAS2,3,5.,2,12"], r"CELAS2 3.*has components .* at grid 2; a scalar spring has one"),
        (
            ["PBUSH,5,K,9.", "CBUSH,3,6,1,2,,,,0"],
            r"CBUSH 3.*names property 6, which is not in the deck; of PBUSH it has \[5\]",
        ),
        (["PBUSH,5,K,-9.", "CBUSH,3,5,1,2,,,,0"], r"CBUSH 3.*has a stiffness below zero"),
        (["PBUSH,5,K,1.,2.,3.", "CBUSH,3,5,1,2,1.,0.,0."], r"CBUSH 3.*has its orientation along its line"),
        (["PBUSH,5,K,1.,2.,3.", "CBUSH,3,5,1,2"], r"CBUSH 3.*has no orientation, and its K2 and K3 differ"),
        (["CONROD,9,1,2,1,0."], r"CONROD 9.*has neither area nor torsion constant"),
        (["PTUBE,7,1,.02,.02", "CTUBE,9,7,1,2"], r"PTUBE 7.*has a wall that is thicker than half its diameter"),
        (
            ["CROD,9,8,1,2", "PROD,7,1,1.-4"],
            r"CROD 9.*names property 8, which is not in the deck; of rods it has \[7\]",
        ),
        (["PROD,7,1,-1.-4", "CROD,9,7,1,2"], r"PROD 7.*has an area or a mass per length below zero"),
    ],
)
def test_mistakes_in_springs_and_rods_are_one_sentence(tmp_path, cards, sentence):
    with pytest.raises(DeckError, match=sentence):
        read(tmp_path, *bar(2), *cards)


# Masses


def test_a_mass_matrix_of_a_rigid_body_is_its_mass_offset_and_inertia(tmp_path):
    m, r, J = 5.0, np.array([0.1, -0.2, 0.3]), np.array([[0.5, 0.02, -0.03], [0.02, 0.6, 0.01], [-0.03, 0.01, 0.7]])
    S = np.array([[0, -r[2], r[1]], [r[2], 0, -r[0]], [-r[1], r[0], 0]])
    M = np.block([[m * np.eye(3), -m * S], [m * S, J - m * S @ S]])
    matrix = lines("CONM1", 11, 9, "", *(f"{M[i, j]:.9g}" for i in range(6) for j in range(i + 1)))
    # products of inertia on a card CONM2 enter the matrix with a minus
    products = [J[0, 0], -J[1, 0], J[1, 1], -J[2, 0], -J[2, 1], J[2, 2]]
    same = lines("CONM2", 11, 9, "", m, *r, "", *products)
    found, wanted = (frequencies(read(tmp_path, *bar(), *one), 6) for one in (matrix, same))
    assert found == pytest.approx(wanted, rel=1e-6)


def test_a_mass_matrix_that_is_of_no_rigid_body_is_left_out_with_a_word(tmp_path):
    assert "mass matrices that are not those of a rigid body" in unused(tmp_path, *bar(2), "CONM1,11,3,,5.,0.,6.")


def test_a_centre_of_mass_may_be_given_in_basic_coordinates(tmp_path):
    mass, centre = mass_and_centre(read(tmp_path, *bar(), "CONM2,11,9,-1,4.,2.5,0.3,-0.1").structure())
    own = RHO * 1e-3 * 2.0
    assert mass == pytest.approx(own + 4.0)
    assert centre == pytest.approx((own * np.array([1.0, 0, 0]) + 4.0 * np.array([2.5, 0.3, -0.1])) / mass, rel=1e-6)


def test_three_equal_scalar_masses_are_a_mass_and_one_alone_is_left_out(tmp_path):
    three = [f"CMASS2,{20 + c},4.,9,{c}" for c in (1, 2, 3)]
    found = frequencies(read(tmp_path, *bar(), *three), 3)
    assert found == pytest.approx(frequencies(read(tmp_path, *bar(), "CONM2,11,9,,4."), 3), rel=1e-9)
    assert "a mass in one direction alone is left out" in unused(tmp_path, *bar(2), three[0].replace(",9,", ",3,"))
    assert "between components or of scalar points" in unused(tmp_path, *bar(2), "CMASS2,20,4.,2,1,3,1")


def test_offsets_and_inertias_at_grids_without_rotation_are_left_out_with_a_word(tmp_path):
    truss = ["GRID,1,,0.,0.,0.,,123456", "GRID,2,,2.,0.,0.,,123456", "GRID,3,,1.,1.,0.", "CROD,1,7,1,3", "CROD,2,7,2,3"]
    truss += ["PROD,7,1,1.E-4", STEEL, *body(3, 10.0, (1.0, 1.0, 1.0)), "SPC1,1,3,3"]
    said = unused(tmp_path, *truss)
    assert "its grid has no rotation (solids, rods): its mass acts at the grid" in said


# Rods and bars


@pytest.mark.parametrize(
    "rods",
    [["CONROD,1,1,3,1,1.-4", "CONROD,2,2,3,1,1.-4"], ["PTUBE,7,1,.02,.0016754", "CTUBE,1,7,1,3", "CTUBE,2,7,2,3"]],
)
def test_other_rods_carry_as_crod_does(tmp_path, rods):
    """Tube: pi (D - t) t = 1e-4 m^2 of 20 mm diameter outside."""
    cards = [
        "GRID,1,,0.,0.,0.",
        "GRID,2,,2.,0.,0.",
        "GRID,3,,1.,1.,0.",
        "MAT1,1,2.1E11,,0.3",
        "CONM2,9,3,,10.",
        "SPC1,1,123,1,2",
    ]
    assert np.pi * (0.02 - 0.0016754) * 0.0016754 == pytest.approx(1e-4, rel=0.04)
    A = 1e-4 if "CONROD" in rods[0] else np.pi * (0.02 - 0.0016754) * 0.0016754
    found = frequencies(read(tmp_path, *cards, *rods), 2)
    assert found == pytest.approx([np.sqrt(E * A / (np.sqrt(2) * 10.0)) / (2 * np.pi)] * 2, rel=1e-6)


def test_torsion_of_rods_between_bars_turns_what_they_join(tmp_path):
    """A massless rod J = 2e-6 between a clamp and a body that is free to twist alone: G J / L against its inertia."""
    cards = ["GRID,1,,0.,0.,0.,,123456", "GRID,2,,2.,0.,0.,,12356", "GRID,3,,2.,1.,0.,,123456"]
    cards += ["CROD,5,7,1,2", "PROD,7,1,1.-4,2.-6", "MAT1,1,2.1E11,,0.3", "CROD,8,9,1,3", "PROD,9,1,1.-4"]
    weak = ["CBAR,6,8,2,3,1.,0.,0.,,,,456", "PBAR,8,1,1.-12,1.-18,1.-18,1.-18", "CBAR,4,8,1,3,0.,0.,1."]
    deck = read(tmp_path, *cards, *weak, *body(2, 1.0, (3.0, 3.0, 3.0)), "SPC1,1,123456,1,3")
    GJ = E / 2.6 * 2e-6
    assert frequencies(deck, 1) == pytest.approx([np.sqrt(GJ / 2.0 / 3.0) / (2 * np.pi)], rel=1e-4)


@pytest.mark.parametrize("line", ["G0", "default", "basic"])
def test_the_plane_of_a_bar_is_given_in_several_ways(tmp_path, line):
    """Plane 1 is x-z: by a grid point above, by BAROR, or by a vector in basic axes where CD is turned."""
    across = "SPC1,1,{},2,THRU,9"  # no motion along y: one plane is left
    wanted = frequencies(read(tmp_path, *[c.replace("0.,1.,0.", "0.,0.,1.") for c in bar()], across.format(2)), 2)
    turned = frequencies(read(tmp_path, *bar(), across.format(2)), 2)
    assert turned[0] > 1.9 * wanted[0]
    cards = bar()
    if line == "G0":
        cards = [c.replace(",0.,1.,0.", ",77") if c.startswith("CBAR") else c for c in cards]
        cards += ["GRID,77,,0.,0.,9.,,123456"]
    elif line == "default":
        cards = [c.replace(",0.,1.,0.", "") if c.startswith("CBAR") else c for c in cards]
        cards += ["BAROR,,,,,0.,0.,1."]
    else:
        cards = [c.replace("0.,1.,0.", "0.,0.,1.,BGG") if c.startswith("CBAR") else c for c in cards]
        cards = [c + ",6" if c.startswith("GRID") else c for c in cards]
        cards += ["CORD2R,6,0,0.,0.,0.,0.,1.,0.", ",0.,0.,1."]
    held = across.format(3 if line == "basic" else 2)
    assert frequencies(read(tmp_path, *cards, held), 2) == pytest.approx(wanted, rel=1e-9)


def test_offsets_along_the_bar_are_those_along_basic_axes(tmp_path):
    """Codes O: offsets in the axes of the element, which here lie along y, -x, z of the deck."""
    up = [f"GRID,{k + 1},,0.,{2.0 * k / 8:.6f},0." for k in range(9)]
    bars = [f"CBAR,{k + 1},3,{k + 1},{k + 2},-1.,0.,0." for k in range(8)]
    rest = bar()[-3:]
    by_g = [f"{c}\n,,,-0.2,0.,0.,-0.1,0.,0." for c in bars]
    by_o = [f"{c},GOO\n,,,0.,0.2,0.,0.,0.1,0." for c in bars]
    found, wanted = (
        frequencies(read(tmp_path, *up, *"\n".join(cells).split("\n"), *rest), 3) for cells in (by_o, by_g)
    )
    assert found == pytest.approx(wanted, rel=1e-8)
    assert abs(found[0] / frequencies(read(tmp_path, *up, *bars, *rest), 1)[0] - 1) > 1e-6


def test_a_tapered_beam_of_stations_has_the_mass_and_frequency_of_its_integrals(tmp_path):
    """PBEAML from 40 mm to 20 mm square over 2 m, held at the thick end: Rayleigh's quotient on 16 elements."""
    n = 16
    grids = [f"GRID,{k + 1},,{2.0 * k / n},0.,0." for k in range(n + 1)]
    sizes = [0.04 - 0.02 * k / n for k in range(n + 1)]
    beams, sections = [], []
    for k in range(n):
        a, b = sizes[k], sizes[k + 1]
        beams.append(f"CBEAM,{k + 1},{k + 1},{k + 1},{k + 2},0.,1.,0.")
        sections += [f"PBEAML,{k + 1},1,,BAR", f",{a},{a},,YES,1.,{b},{b}"]
    deck = read(tmp_path, *grids, *beams, *sections, STEEL, "SPC1,1,123456,1")
    mass, centre = mass_and_centre(deck.structure())
    A = np.poly1d([-0.01, 0.04]) ** 2
    first = np.polyint(A * np.poly1d([1.0, 0.0]))(2.0) / np.polyint(A)(2.0)
    assert mass == pytest.approx(RHO * np.polyint(A)(2.0), rel=1e-3) and centre[0] == pytest.approx(first, rel=1e-3)
    plain = frequencies(
        read(
            tmp_path, *[c.split(",YES")[0].rstrip(",") for c in [*grids, *beams, *sections, STEEL]], "SPC1,1,123456,1"
        ),
        1,
    )
    assert abs(frequencies(deck, 1)[0] / plain[0] - 1) < 0.05  # steps at the thick ends


def test_stations_of_pbeam_are_those_of_pbeaml(tmp_path):
    a, b = 0.04, 0.02
    ends = [f"{s**2:.6g},{s**4 / 12:.6g},{s**4 / 12:.6g},0.,{0.1406 * s**4:.6g}" for s in (a, b)]
    cards = [c.replace("CBAR", "CBEAM") for c in bar()[:-3]]
    given = read(
        tmp_path, *cards, f"PBEAM,3,1,{ends[0]},0.", ",,,,,,,,", f",YES,1.,{ends[1]},0.", STEEL, "SPC1,1,123456,1"
    )
    shape = read(tmp_path, *cards, "PBEAML,3,1,,BAR", f",{a},{a},,YES,1.,{b},{b}", STEEL, "SPC1,1,123456,1")
    assert mass_and_centre(given.structure())[0] == pytest.approx(mass_and_centre(shape.structure())[0], rel=1e-5)
    assert frequencies(given, 2) == pytest.approx(frequencies(shape, 2), rel=2e-3)


# Plates and materials


def test_an_orthotropic_material_of_plates_is_a_layer(tmp_path):
    material = "MAT8,1,1.4+11,1.+10,.3,5.+9,5.+9,3.+9,1600."
    layer = "PCOMP,3\n,1,0.01,0."
    found, wanted = (
        frequencies(read(tmp_path, *plate(*section.split("\n"), material)), 3) for section in (SHELL, layer)
    )
    assert found == pytest.approx(wanted, rel=2e-3)  # the layer knows G13 and G23, and so does MID3


def test_an_anisotropic_material_with_isotropic_numbers_is_isotropic(tmp_path):
    G = [E / (1 - NU**2), NU * E / (1 - NU**2), 0.0, E / (1 - NU**2), 0.0, E / (2 * (1 + NU))]
    mat2 = "MAT2,1," + ",".join(f"{g:.9g}" for g in G) + f",{RHO}"
    found = frequencies(read(tmp_path, *plate("PSHELL,3,1,0.01,1", mat2)), 3)
    assert found == pytest.approx(frequencies(read(tmp_path, *plate("PSHELL,3,1,0.01,1", STEEL)), 3), rel=2e-3)


def test_plies_with_numbers_of_their_own_are_those_of_pcomp(tmp_path):
    material = "MAT8,8,1.4+11,1.+10,.3,5.+9,5.+9,3.+9,1600."
    plain = ["PCOMP,3", ",8,1.-3,0.,,8,2.-3,45.", ",8,1.-3,0."]
    numbered = ["PCOMPG,3", ",101,8,1.-3,0.", ",102,8,2.-3,45.", ",103,8,1.-3,0."]
    found, wanted = (frequencies(read(tmp_path, *plate(*one, material)), 3) for one in (numbered, plain))
    assert found == pytest.approx(wanted, rel=1e-9)


def test_a_laminate_off_the_plane_of_its_grids_has_the_steiner_part(tmp_path):
    """One steel layer 10 mm thick whose lower face is on the grids: D grows by A z^2."""
    cards = plate("PCOMP,3,0.", ",1,0.01,0.", STEEL)
    deck = read(tmp_path, *cards)
    mass, centre = mass_and_centre(deck.structure())
    assert mass == pytest.approx(RHO * 0.01 * 0.5) and centre[2] == pytest.approx(5e-3)


def test_mass_that_is_no_structure_and_layers_for_membranes_alone(tmp_path):
    mass = mass_and_centre(read(tmp_path, *plate("PCOMP,3,,7.", ",1,0.01,0.", STEEL)).structure())[0]
    assert mass == pytest.approx((RHO * 0.01 + 7.0) * 0.5)
    assert "PCOMP LAM=MEM" in unused(tmp_path, *plate("PCOMP,3,,,,,,,MEM", ",1,0.01,0.", STEEL))


def test_a_shear_panel_resists_shear_alone(tmp_path):
    """A square panel of 1 m whose upper corners move along x together, with 100 kg: k = G t."""
    G, t = E / (2 * (1 + NU)), 1e-3
    cards = ["GRID,1,,0.,0.,0.", "GRID,2,,1.,0.,0.", "GRID,3,,1.,1.,0.", "GRID,4,,0.,1.,0."]
    cards += ["CSHEAR,1,3,1,2,3,4", f"PSHEAR,3,1,{t}", "MAT1,1,2.1E11,,0.3", "CONM2,11,3,,50.", "CONM2,12,4,,50."]
    cards += ["MPC,6,4,1,1.,3,1,-1.", "SPC1,1,12345,1,2", "SPC1,1,2345,3,4"]
    found = frequencies(read(tmp_path, *cards, control="SPC = 1\nMPC = 6"), 1)[0]
    assert found == pytest.approx(np.sqrt(G * t / 100.0) / (2 * np.pi), rel=1e-3)


@pytest.mark.parametrize(
    ("cards", "sentence"),
    [
        (plate("PSHELL,3,1,0.01,-1", STEEL), r"PSHELL 3.*requests plane strain \(MID2 = -1\)"),
        (plate("PSHELL,3,1,-0.01,1", STEEL), r"PSHELL 3.*has thickness -0.01 m; it must be positive"),
        (plate("PSHELL,3,,0.01", STEEL), r"PSHELL 3.*names no material for membrane or bending"),
        (plate("PCOMP,3", ",1,-0.01,0.", STEEL), r"PCOMP 3.*has thickness -0.01 m in ply 1; it must be positive"),
        (plate(SHELL, "PSHELL,3,1,0.02,1", STEEL), r"PSHELL 3.*gives property 3 again, which stands at deck.bdf:"),
        (plate(SHELL, STEEL, "MAT1,1,7.+10,,.3"), r"MAT1 1.*gives material 1 again, which stands at deck.bdf:"),
        (plate(SHELL, "MAT1,1"), r"MAT1 1.*has neither E nor G; give one of them"),
        (
            plate(SHELL, "MAT9,1,1.,0.,0.,0.,0.,0.,1."),
            r"MAT9 1.*is a material of solids; plates take MAT1, MAT2 or MAT8",
        ),
        (
            plate("PSHEAR,3,1,-1.-3", STEEL, cards="CSHEAR"),
            r"PSHEAR 3.*has thickness -0.001 m and G .*; both must be positive",
        ),
    ],
)
def test_mistakes_in_plates_are_one_sentence(tmp_path, cards, sentence):
    with pytest.raises(DeckError, match=sentence):
        read(tmp_path, *cards)


# Solids


def brick(*properties: str) -> list[str]:
    """Four bricks in a row along x, 0.1 m wide and 0.05 m high, held at x = 0."""
    places = [(x, y, z) for x in range(5) for y, z in ((0, 0), (0.1, 0), (0.1, 0.05), (0, 0.05))]
    grids = [f"GRID,{k + 1},,{x / 8},{y},{z}" for k, (x, y, z) in enumerate(places)]
    cells = []
    for k in range(4):
        a = 4 * k
        cells.append(f"CHEXA,{k + 1},3,{a + 1},{a + 5},{a + 6},{a + 2},{a + 4},{a + 8}\n,{a + 7},{a + 3}")
    return [*grids, *"\n".join(cells).split("\n"), *properties, "SPC1,1,123,1,2,3,4"]


def mat9(C: np.ndarray) -> list[str]:
    order = [0, 1, 2, 5, 3, 4]  # 11 22 33 12 23 31 of the card, from 11 22 33 23 31 12
    C = C[np.ix_(order, order)]
    return lines("MAT9", 1, *(f"{C[i, j]:.9g}" for i in range(6) for j in range(i, 6)), RHO)


def isotropic_matrix() -> np.ndarray:
    C = np.zeros((6, 6))
    C[:3, :3] = E * NU / ((1 + NU) * (1 - 2 * NU))
    C[range(3), range(3)] += E / (1 + NU)
    C[range(3, 6), range(3, 6)] = E / (2 * (1 + NU))
    return C


def test_an_anisotropic_solid_with_isotropic_numbers_is_isotropic(tmp_path):
    found = frequencies(read(tmp_path, *brick("PSOLID,3,1", *mat9(isotropic_matrix()))), 4)
    assert found == pytest.approx(frequencies(read(tmp_path, *brick("PSOLID,3,1", STEEL)), 4), rel=1e-6)


@pytest.mark.parametrize(("system", "turned"), [("-1", False), ("7", True)])
def test_axes_of_a_solid_material_are_the_elements_or_a_systems(tmp_path, system, turned):
    """Stiff along axis 1: along the bricks, or across them in a system that is turned by 90 deg about z."""
    C = isotropic_matrix()
    C[0, 0] *= 4.0
    cards = ["CORD2R,7,0,0.,0.,0.,0.,0.,1.", ",0.,1.,0."]
    found = frequencies(read(tmp_path, *brick(f"PSOLID,3,1,{system}", *mat9(C), *cards)), 1)[0]
    if turned:
        order = [1, 0, 2, 4, 3, 5]
        C = C[np.ix_(order, order)]
    wanted = frequencies(read(tmp_path, *brick("PSOLID,3,1,0", *mat9(C))), 1)[0]
    assert found == pytest.approx(wanted, rel=1e-6)


def test_a_shear_modulus_of_its_own_softens_a_solid(tmp_path):
    """G a tenth of E / 2 (1 + nu): K is that of MAT9 with these numbers."""
    C = isotropic_matrix()
    C[range(3, 6), range(3, 6)] /= 10
    found = frequencies(read(tmp_path, *brick("PSOLID,3,1", f"MAT1,1,{E},{E / 26:.9g},{NU},{RHO}")), 3)
    wanted = frequencies(read(tmp_path, *brick("PSOLID,3,1", *mat9(C))), 3)
    assert found == pytest.approx(wanted, rel=1e-6)


# Systems and supports


@pytest.mark.parametrize("kind", ["CORD1R", "CORD1C", "CORD2S", "CORD1S"])
def test_grids_in_systems_by_points_and_in_spherical_ones(tmp_path, kind):
    """A mast along the third direction of each system, its bars oriented in basic axes: the frequencies of the mast."""
    wanted = frequencies(read(tmp_path, *[c.replace("0.,1.,0.", "0.,0.,1.") for c in bar()]), 2)
    points = ["GRID,91,,0.,0.,0.,,123456", "GRID,92,,1.,0.,0.,,123456", "GRID,93,,0.,0.,1.,,123456"]  # z along x
    if kind == "CORD2S":
        system = ["CORD2S,2,0,0.,0.,0.,1.,0.,0.", ",0.,0.,1."]
    else:
        system = [f"{kind},2,91,92,93"]
    place = "{r},0.,0." if kind.endswith("S") else "0.,0.,{r}"
    cards = [f"GRID,{k + 1},2,{place.format(r=2.0 * k / 8)}" for k in range(9)]
    rest = [c.replace("0.,1.,0.", "0.,0.,1.") for c in bar()[9:]]
    deck = read(tmp_path, *points, *system, *cards, *rest)
    ends = deck.mesh.points
    assert np.abs(ends - [2.0, 0, 0]).sum(axis=1).min() < 1e-9
    assert frequencies(deck, 2) == pytest.approx(wanted, rel=1e-6)


@pytest.mark.parametrize("cd", ["CORD2C,2,0,0.,0.,0.,0.,0.,1.", "CORD2S,2,0,0.,0.,0.,0.,0.,1."])
def test_components_of_a_grid_lie_along_its_curved_axes(tmp_path, cd):
    """A mass on two springs: radial 1000 N/m and tangential 250 N/m, off the axes of the deck."""
    tangent = 2 if "2C" in cd else 3
    cards = [
        cd,
        ",1.,0.,0.",
        "GRID,1,,3.,4.,0.,2",
        "CONM2,11,1,,2.",
        "CELAS2,1,1000.,1,1",
        f"CELAS2,2,250.,1,{tangent}",
    ]
    deck = read(tmp_path, *cards, f"CELAS2,3,9000.,1,{5 - tangent}", "SPC1,1,456,1")
    assert frequencies(deck, 3) == pytest.approx(
        np.sqrt(np.array([250.0, 1000.0, 9000.0]) / 2.0) / (2 * np.pi), rel=1e-9
    )
    structure = deck.structure()
    K = (structure.translation @ structure.K0 @ structure.translation.T).toarray()[:3, :3]
    radial, around = np.array([0.6, 0.8, 0]), np.array([-0.8, 0.6, 0])
    assert [radial @ K @ radial, around @ K @ around] == pytest.approx([1000.0, 250.0])


@pytest.mark.parametrize(
    ("cards", "sentence"),
    [
        (["CORD2R,7,0,0.,0.,0.,0.,0.,0.", ",1.,0.,0."], r"CORD2R 7.*has its z axis between two equal points"),
        (["CORD2R,7,0,0.,0.,0.,0.,0.,1.", ",0.,0.,2."], r"CORD2R 7.*has its third point on its z axis"),
        (["CORD2R,7,0,0.,0.,0.,0.,0.,1.", ",1.,0.,0.", "CORD2R,7,0,0.,0.,0.,0.,0.,1.", ",0.,1.,0."],
         r"CORD2R 7.*gives coordinate system 7 again, which stands at deck.bdf:"),
    ],
)  # fmt: skip
def test_mistakes_in_systems_are_one_sentence(tmp_path, cards, sentence):
    with pytest.raises(DeckError, match=sentence):
        read(tmp_path, *bar(2), "GRID,50,7,0.,0.,0.,,123456", *cards)


def test_supports_of_two_grids_on_a_card_spc(tmp_path):
    cards = [c for c in bar() if not c.startswith("SPC1")]
    found = frequencies(read(tmp_path, *cards, "SPC,1,1,123456,0.,9,123456"), 2)
    assert found == pytest.approx(frequencies(read(tmp_path, *cards, "SPC1,1,123456,1,9"), 2), rel=1e-12)
    assert "SPC D" in unused(tmp_path, *cards, "SPC,1,1,123456,0.1")


def test_a_rigid_rod_keeps_the_distance_of_two_grids(tmp_path):
    """Two masses on springs along x, tied by a rod: they move as one, on both springs."""
    cards = [
        "GRID,1,,0.,0.,0.",
        "GRID,2,,1.,0.,0.",
        "CONM2,11,1,,2.",
        "CONM2,12,2,,3.",
        "CELAS2,1,1000.,1,1",
        "CELAS2,2,250.,2,1",
    ]
    deck = read(tmp_path, *cards, "RROD,9,1,2,,1", "SPC1,1,23456,1,2")
    assert frequencies(deck, 1) == pytest.approx([np.sqrt(1250.0 / 5.0) / (2 * np.pi)], rel=1e-9)


def test_a_rigid_rod_askew_moves_its_follower_across(tmp_path):
    """From (0, 0) to (3, 4): u2 . t = u1 . t with t = (0.6, 0.8), u2y = 0.75 u1x where u2 may move along y alone."""
    cards = ["GRID,1,,0.,0.,0.", "GRID,2,,3.,4.,0.", "CONM2,11,1,,2.", "CONM2,12,2,,3.", "CELAS2,1,1000.,1,1"]
    deck = read(tmp_path, *cards, "RROD,9,1,2,,2", "SPC1,1,23456,1", "SPC1,1,13456,2")
    assert frequencies(deck, 1) == pytest.approx([np.sqrt(1000.0 / (2.0 + 3.0 * 0.75**2)) / (2 * np.pi)], rel=1e-9)


@pytest.mark.parametrize(
    ("card", "sentence"),
    [
        ("RROD,9,1,2,,2", r"RROD 9.*component 2 of grid 2 is perpendicular to the rod"),
        ("RROD,9,1,2,1,1", r"RROD 9.*must name one dependent component"),
    ],
)
def test_mistakes_in_rigid_rods_are_one_sentence(tmp_path, card, sentence):
    with pytest.raises(DeckError, match=sentence):
        read(tmp_path, *bar(2), card)


def two_beams() -> list[str]:
    """Cantilevers of bars along x, 0.5 m apart along y, unlike in length: their ends are grids 5 and 15."""
    cards = ["PBAR,3,1,1.E-3,2.E-7,8.E-7,1.E-6", STEEL, "SPC1,1,123456,1,11"]
    for first, y, length in ((1, 0.0, 1.0), (11, 0.5, 1.2)):
        cards += [f"GRID,{first + k},,{length * k / 4},{y},0." for k in range(5)]
        cards += [f"CBAR,{first + k},3,{first + k},{first + k + 1},0.,1.,0." for k in range(4)]
    return cards


def turned_by(grid: int, component: int, r: np.ndarray, sign: float) -> list[tuple[int, int, float]]:
    """Terms of sign (theta x r) along a translation, theta that of a grid."""
    e = np.eye(3)[component - 1]
    across = np.cross(r, e) * sign  # e . (theta x r) = theta . (r x e)
    return [(grid, 4 + k, across[k]) for k in range(3) if across[k]]


@pytest.mark.parametrize(
    ("card", "dependent"),
    [
        ("RBAR,90,5,15,123456,,,123", [(15, c) for c in (1, 2, 3)]),
        ("RBAR,90,5,15,,123456,123", [(5, c) for c in (1, 2, 3)]),
        ("RBAR,90,5,15,123456,,,46", [(15, c) for c in (4, 6)]),
        ("RBAR,90,5,15,123,456,456,123", [(5, c) for c in (4, 5, 6)] + [(15, c) for c in (1, 2, 3)]),
    ],
)
def test_a_rigid_bar_ties_the_components_that_it_names_at_either_end(tmp_path, card, dependent):
    """u15 = u5 + theta x r and theta15 = theta5, equation by equation."""
    r = np.array([0.2, 0.5, 0.0])
    equations = []
    for grid, c in dependent:
        other = 20 - grid
        terms = [(grid, c, 1.0), (other, c, -1.0)]
        if c <= 3:  # the rotation is that of the end whose rotation leads, here grid 15 where both lead in part
            leads = 15 if (5, 4) in dependent else other
            terms += turned_by(leads, c, r, -1.0 if grid == 15 else 1.0)
        words = [word for term in terms for word in term]
        equations += [",".join(["MPC,6", *map(str, words[:6])])]
        for k in range(6, len(words), 6):
            equations.append(",".join(["", "", *map(str, words[k : k + 6])]))
    wanted = frequencies(read(tmp_path, *two_beams(), *equations, control="SPC = 1\nMPC = 6"), 6)
    assert frequencies(read(tmp_path, *two_beams(), card), 6) == pytest.approx(wanted, rel=1e-8)
