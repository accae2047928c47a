"""Rare cards of Nastran decks: grids that are missing, properties given twice, blank fields, lists, matrices."""

from __future__ import annotations

import re

import numpy as np
import pytest
from support.nastran_decks import STEEL, bar, read
from test_nastran_matrices import AT, CARDS, axes, on_grids

from femflex.decks import DeckError

IN_PLANE = ["GRID,1,,0.,0.,0.", "GRID,2,,2.,0.,0.", "GRID,3,,2.,1.,0.", "GRID,4,,0.,1.,0."]
ABOVE = ["GRID,5,,0.,0.,1.", "GRID,6,,2.,0.,1.", "GRID,7,,2.,1.,1.", "GRID,8,,0.,1.,1."]
PROPERTIES = ["PBAR,1,1,1.-3,1.-6,1.-6,1.-6", "PROD,2,1,1.-4", "PSHELL,3,1,.01,1", "PSOLID,4,1", STEEL,
              "PBUSH,5,K,5.", "PBUSH1D,6,5.", "PELAS,7,5.", "PBEAM3,8,1,1.-3,1.-6,1.-6,,1.-6"]  # fmt: skip
FIRST = 5 + len(IN_PLANE) + len(PROPERTIES)  # line of the card after these


def refused(tmp_path, cards: list[str], *sentences: str, control: str = "ECHO = NONE") -> None:
    """All problems of a deck, each written out."""
    with pytest.raises(DeckError) as found:
        read(tmp_path, *(line for card in cards for line in card.split("\n")), control=control)
    assert found.value.problems == sentences


@pytest.mark.parametrize(
    "card",
    [
        "CBAR,9,1,99,2,0.,1.,0.", "CBAR,9,1,1,99,0.,1.,0.", "CROD,9,2,1,99", "CONROD,9,99,2,1,1.-4",
        "CBEAM3,9,8,1,2,99,0.,1.,0.", "CBEAM3,9,8,99,2,3,0.,1.,0.", "CQUAD4,9,3,1,2,99,4", "CTRIA6,9,3,1,2,3,4,99",
        "CTETRA,9,4,1,2,3,99", "CPYRAM,9,4,1,2,3,4,99", "CONM2,9,99,,1.", "CONM1,9,99,,1.", "CELAS1,9,7,1,1,99,1",
        "CELAS2,9,5.,99,1", "CBUSH,9,5,1,99,,,,0", "CBUSH,9,5,1,2,99", "CBUSH1D,9,6,1,99", "RBE2,9,1,123,99",
        "RBE2,9,99,123,2", "RBAR,9,1,99,123456", "RROD,9,1,99,,1", "RBE1,9,1,123456\n,UM,99,123",
        "RBE3,9,,4,123,1.,123,1,2\n,99", "RBE3,9,,99,123,1.,123,1,2\n,3", "GENEL,9,,99,1\n,K,5.",
    ],
)  # fmt: skip
def test_an_element_at_a_grid_that_is_not_there_names_it_with_its_line(tmp_path, card):
    """One problem for each card, whichever of its grids is missing, and no other."""
    name = " ".join(card.split(",")[:2])
    refused(
        tmp_path,
        [*IN_PLANE, *PROPERTIES, card],
        f"deck.bdf:{FIRST}: {name} uses grid point 99, which no GRID card defines",
    )


def test_an_equation_at_a_grid_that_is_not_there_names_its_set(tmp_path):
    wanted = f"deck.bdf:{FIRST}: MPC 9 uses grid point 99, which no GRID card defines"
    refused(tmp_path, [*IN_PLANE, *PROPERTIES, "MPC,9,99,1,1.,2,1,-1."], wanted, control="MPC = 9")


TWICE = ["PBAR,3,1,1.E-3,2.E-7,8.E-7,1.E-6", STEEL, "GRID,1,,0.000000,0.,0.", "PROD,2,1,1.-4", "PSHELL,7,1,.01,1"]


def test_cards_that_stand_twice_alike_are_one_and_others_name_the_first(tmp_path):
    cards = [*bar(4), "PROD,2,1,1.-4", "PSHELL,7,1,.01,1", "CORD2R,8,,0.,0.,0.,0.,0.,1.", ",1.,0.,0."]
    once = read(tmp_path, *cards)
    assert once.moduli == read(tmp_path, *cards, *TWICE).moduli == pytest.approx((2.1e11,))
    at = {card: 5 + k for k, card in enumerate(cards)}
    section, shell = "PBAR,3,1,1.E-3,2.E-7,8.E-7,1.E-6", "PSHELL,7,1,.01,1"
    for other, name, where in (
        ("PBAR,3,1,1.E-3,2.E-7,8.E-7,3.E-6", "PBAR 3 gives property 3", at[section]),
        ("PBEAM,3,1,1.E-3,2.E-7,8.E-7,,1.E-6", "PBEAM 3 gives property 3", at[section]),
        ("MAT1,1,2.2E11,,0.3,7850.", "MAT1 1 gives material 1", at[STEEL]),
        ("PSHELL,7,1,.02,1", "PSHELL 7 gives property 7", at[shell]),
        ("CORD2R,8,,0.,0.,1.,0.,0.,2.\n,1.,0.,1.", "CORD2R 8 gives coordinate system 8", at[shell] + 1),
    ):
        wanted = f"deck.bdf:{5 + len(cards)}: {name} again, which stands at deck.bdf:{where} already"
        refused(tmp_path, [*cards, other], wanted, control="SPC = 1")


@pytest.mark.parametrize(
    ("card", "sentence"),
    [
        ("CBAR,9,1,,2,0.,1.,0.", "CBAR 9 has nothing in field 4, where a whole number is needed"),
        ("CBAR,9,1,1.,2,0.,1.,0.", "CBAR 9 has '1.' in field 4, where a whole number is needed"),
        ("PROD,12,1", "PROD 12 has nothing in field 4, where a number is needed"),
        ("PROD,12,1,1.-4-2", "PROD 12 has '1.-4-2' in field 4, where a number is needed"),
        ("SPC1,9,127,1", "SPC1 9 has '127' in field 3, where components 1 to 6 are needed"),
        ("SPC1,9,12,1,2.5", "SPC1 9 has '2.5' in a list of whole numbers"),
        ("SPC1,9,12,1,THRU", "SPC1 9 has THRU without a number on both sides"),
        ("SPC1,9,12,THRU,4", "SPC1 9 has THRU without a number on both sides"),
        ("CBAR,9,1,1,2,0.,0.,0.", "CBAR 9 has no orientation vector; give X1, X2, X3 or G0"),
        ("CBAR,9,1,1,2,77", "CBAR 9 is oriented by grid point 77, which no GRID card defines"),
        ("CBAR,9,1,1,2,0.,1.,0.,XGG", "CBAR 9 has offset codes 'XGG', which are not understood; use GGG or BGG"),
        ("CBAR,9,1,1,2,0.,1.,0.,GBG", "CBAR 9 has offset codes 'GBG', which are not understood; use GGG or BGG"),
        ("CBAR,9,1,1,1,0.,1.,0.", "CBAR 9 has no length"),
        ("CROD,9,2,3,3", "CROD 9 has no length"),
        ("CROD,9,33,3,4", "CROD 9: names property 33, which is not in the deck; of rods it has [2]"),
        ("CONROD,9,1,2,1", "CONROD 9 has neither area nor torsion constant; give one"),
        ("CBEAM3,9,8,1,1,,0.,1.,0.", "CBEAM3 9 has no length between two of its grid points"),
        ("PBEAM3,9,1,1.-3,1.-6,1.-6,,1.-6\n,,,,,,,,\n,1.",
         "PBEAM3 9 varies along its elements or has shear factors; give A, Iz, Iy, Iyz, J and NSM alone"),
        ("CQUAD4,9,3,1,2,2,4", "CQUAD4 9: names a grid point twice; its corners must differ"),
        ("CTETRA,9,44,1,2,3,4", "CTETRA 9: names property 44, which is not in the deck; of solids it has [4]"),
        ("CONM2,9,1,,2.,,,\n,1.,,-3.,,,1.",
         "CONM2 9 has an inertia with principal moments [-3.0, 1.0, 1.0] kg m^2; none "
         "is negative"),
        ("CELAS1,9,77,1,1", "CELAS1 9: names property 77, which is not in the deck; of PELAS it has [7]"),
        ("CELAS2,9,5.,1,12", "CELAS2 9 has components (1, 2) at grid 1; a scalar spring has one"),
        ("CBUSH,9,55,1,2,,,,0", "CBUSH 9: names property 55, which is not in the deck; of PBUSH it has [5]"),
        ("PBUSH,9,K,1.,2.,3.\nCBUSH,9,9,1,2",
         "CBUSH 9 has no orientation, and its K2 and K3 differ; give CID, G0 or X1, "
         "X2, X3"),
        ("PBUSH,9,K,-1.\nCBUSH,9,9,1,2,,,,0", "CBUSH 9 has a stiffness below zero"),
        ("CBUSH,9,5,1,2,3.,0.,0.", "CBUSH 9 has its orientation along its line"),
        ("PBUSH1D,9,-1.\nCBUSH1D,9,9,1,2", "CBUSH1D 9 has a stiffness below zero"),
        ("GENEL,9\n,K,5.", "GENEL 9: names no components UI"),
        ("GENEL,9,,1,1\n,K,5.,K,6.", "GENEL 9 has K twice"),
        ("GENEL,9,,1,1,2\n,K,5.", "GENEL 9 has 1 1 2 where pairs of a grid point and a component are needed"),
        ("GENEL,9,,1,7\n,K,5.", "GENEL 9 has component 7; components of grid points are 1 to 6"),
        ("GENEL,9,,1,1\n,K,5.,1.",
         "GENEL 9 has 2 values of K (the lower triangle by columns, 1 components UI); 1 are needed"),
        ("GENEL,9,,1,1,2,1\n,K,5.,9.,5.",
         "GENEL 9 has a stiffness matrix that is not positive semidefinite; correct its K "
         "or Z"),
        ("GENEL,9,,1,1\n,Z,-5.", "GENEL 9 has a flexibility matrix Z that is not positive definite; correct it"),
        ("GENEL,9,,1,1\n,S,5.", "GENEL 9 has neither K nor Z; give one of K and Z"),
        ("GENEL,9,,1,1\n,K,5.,Z,5.", "GENEL 9 has K and Z; give one of K and Z"),
        ("GENEL,9,,3,1\n,UD,1,1,1,2\n,K,5.",
         "GENEL 9 has no S, and its components UD do not determine the rigid motions of "
         "UI; give S"),
        ("RBE2,9,1,123,2.5,3", "RBE2 9 has '2.5' where a grid point is needed"),
        ("RROD,9,1,2,12", "RROD 9 must name one dependent component"),
        ("RROD,9,1,2,2",
         "RROD 9: component 2 of grid 1 is perpendicular to the rod, so it cannot be dependent; name a "
         "component along the rod"),
        ("CORD2R,9,,0.,0.,0.,0.,0.,0.\n,1.,0.,0.\nGRID,77,9,1.,0.,0.",
         "CORD2R 9 has its z axis between two equal points"),
        ("CORD2R,9,,5.,0.,0.,5.,0.,2.\n,5.,0.,7.\nGRID,77,9,1.,0.,0.",
         "CORD2R 9 has its third point on its z axis; it must lie in the x-z plane, off the axis"),
        ("PSHELL,9,1,.01,-1", "PSHELL 9 requests plane strain (MID2 = -1), which shells here do not have"),
        ("PSHELL,9,,.01", "PSHELL 9: names no material for membrane or bending"),
        ("PCOMP,9\n,1,.01,0.,,1,-.02", "PCOMP 9 has thickness -0.02 m in ply 2; it must be positive"),
        ("PCOMP,9", "PCOMP 9 has no plies"),
        ("MAT9,9\nPSHELL,9,9,.01", "MAT9 9 is a material of solids; plates take MAT1, MAT2 or MAT8"),
        ("MAT8,9,1.,1.\nPSOLID,9,9", "MAT8 9 is a material of plates; solids take MAT1 or MAT9"),
        ("MAT8,9,1.,1.\nPROD,9,9,1.-4", "MAT8 9 cannot be the material of bars; they take MAT1"),
        ("MAT1,9", "MAT1 9 has neither E nor G; give one of them"),
    ],
)  # fmt: skip
def test_a_mistake_in_a_field_names_the_field_and_what_belongs_there(tmp_path, card, sentence):
    with pytest.raises(DeckError) as found:
        read(tmp_path, *IN_PLANE, *PROPERTIES, *card.split("\n"), control="ECHO = NONE")
    (problem,) = found.value.problems
    place, _, text = problem.partition(": ")
    assert text.endswith(sentence), problem
    file, _, line = place.partition(":")
    assert file == "deck.bdf" and FIRST <= int(line) <= FIRST + card.count("\n")


def test_a_shell_without_a_thickness_of_its_own_or_of_its_property_is_refused(tmp_path):
    """Relative thicknesses need that of the property; thicknesses at all corners do not."""
    cards = [*IN_PLANE, "PSHELL,3,1,,1", STEEL, "CQUAD4,9,3,1,2,3,4"]
    wanted = "deck.bdf:11: CQUAD4 9 has no thickness at a corner, and PSHELL 3 gives none; give one of them"
    refused(tmp_path, cards, wanted)
    for row in (",,,.02,.02,,.02", ",,1,2.,2.,2.,2."):
        refused(tmp_path, [*cards[:-1], f"{cards[-1]}\n{row}"], wanted)
    made = read(tmp_path, *cards, ",,,.02,.03,.04,.05", control="ECHO = NONE")
    (member,) = made.members
    assert member.options["thickness"]["quad"].tolist() == [[0.02, 0.03, 0.04, 0.05]]
    plain = read(tmp_path, *cards, control="ECHO = NONE", overrides={"pid_3": {"thickness": 0.07}})
    assert plain.members[0].section.thickness == pytest.approx(0.07)


def test_facets_of_one_thickness_each_have_the_section_of_their_own(tmp_path):
    """Triangles with thickness of their own: D = E t^3 / 12 / (1 - nu^2), and the mean where the corners differ."""
    cards = [
        *IN_PLANE,
        "PSHELL,3,1,.01,1",
        STEEL,
        "CTRIA3,8,3,1,2,3",
        ",,,.02,.02,.02",
        "CTRIA3,9,3,1,3,4",
        ",,,.03,.04,.05",
    ]
    made = read(tmp_path, *cards, control="ECHO = NONE")
    found = sorted((m.section.thickness, m.section.D[0, 0]) for m in made.members)
    wanted = [(t, 2.1e11 * t**3 / 12 / (1 - 0.3**2)) for t in (0.02, 0.04)]
    assert np.array(found) == pytest.approx(np.array(wanted))
    said = (
        "1 CTRIA3 T1 to T3 that differ: each such facet has the mean of its corners' thicknesses (first at deck.bdf:13)"
    )
    assert said in [str(one) for one in made.unused]


@pytest.mark.parametrize(("triangles", "others", "family"), [(1, 4, "shell"), (2, 7, "plate"), (2, 8, "shell")])
def test_triangles_are_facets_where_they_are_more_than_a_fifth_of_their_property(tmp_path, triangles, others, family):
    corners = [f"GRID,{2 * k + j},,{k}.,{j}.,0." for k in range(1, 12) for j in (0, 1)]
    cells = [f"CQUAD4,{k},3,{2 * k},{2 * k + 2},{2 * k + 3},{2 * k + 1}" for k in range(1, 1 + others)]
    first = 2 * (1 + others)
    cells += [f"CTRIA3,{20 + k},3,{first},{first + 2 - k},{first + 3 - k}" for k in range(triangles)]
    made = read(tmp_path, *corners, "PSHELL,3,1,.01,1", STEEL, *cells, control="ECHO = NONE")
    found = {member.family for member in made.members if "triangle" in made.mesh.cell_groups[member.group]}
    assert found == {family}


def test_an_isotropic_shell_across_x_has_its_axis_along_y(tmp_path):
    cards = ["GRID,1,,0.,0.,0.", "GRID,2,,0.,2.,0.", "GRID,3,,0.,2.,1.", "GRID,4,,0.,0.,1.", "CQUAD4,9,3,1,2,3,4"]
    (member,) = read(tmp_path, *cards, "PSHELL,3,1,.01,1", STEEL, control="ECHO = NONE").members
    assert member.options["axis"] == pytest.approx((0.0, 1.0, 0.0))


def test_a_shear_modulus_of_mid3_by_mat2_is_that_of_transverse_shear(tmp_path):
    cards = [*IN_PLANE, "CQUAD4,9,3,1,2,3,4", "PSHELL,3,1,.01,1,,2,.9", "MAT2,2,7.E9,1.E9,,5.E9", STEEL]
    (member,) = read(tmp_path, *cards, control="ECHO = NONE").members
    wanted = 0.9 * 0.01 * np.array([[7e9, 1e9], [1e9, 5e9]])
    assert member.section.S == pytest.approx(wanted)
    refused(
        tmp_path,
        [*cards[:-2], "MAT9,2,7.E9", STEEL],
        "deck.bdf:10: PSHELL 3: MAT9 2 is a material of solids; plates take MAT1, MAT2 or MAT8",
    )


def test_a_curved_beam_is_oriented_from_its_first_grid(tmp_path):
    """GC and the arc lie off the line; G0 is seen from GA, and its direction is that of every part."""
    cards = ["GRID,1,,0.,0.,0.", "GRID,2,,2.,0.,0.", "GRID,3,,1.,.4,0.", "GRID,4,,.3,.5,1.4", "CBEAM3,9,8,1,2,3,4"]
    made = read(tmp_path, *cards, "PBEAM3,8,1,1.-3,1.-6,2.-6,,1.-6", STEEL, control="ECHO = NONE")
    (member,) = made.members
    v = np.array([0.3, 0.5, 1.4])
    assert np.asarray(member.options["orientation"]) == pytest.approx(v / np.linalg.norm(v))
    x = made.mesh.points[made.mesh.cells["line"]]
    assert len(x) == 8
    s = np.linspace(0, 2, 9)
    arc = np.column_stack([s, 0.4 * s * (2 - s), 0 * s])
    assert x[:, 0] == pytest.approx(arc[:-1]) and x[:, 1] == pytest.approx(arc[1:])


def test_parameters_of_case_control_are_those_of_the_first_subcase(tmp_path):
    """PARAM,WTMASS above and in the first subcase counts; a PARAM elsewhere in a line, or in the second, does not."""
    cards = [*bar(2), "PARAM,WTMASS,3."]
    plain = read(tmp_path, *bar(2)).members[0].section.mass_per_length
    for control, factor in (
        ("SPC = 1", 3.0),
        ("PARAM,WTMASS,2.", 2.0),
        ("SUBCASE 1\nPARAM WTMASS = 4.\nSUBCASE 2\nPARAM,WTMASS,5.", 4.0),
        ("TITLE = WTMASS 7. PARAM", 3.0),
    ):
        made = read(tmp_path, *cards, control=control)
        assert made.members[0].section.mass_per_length == pytest.approx(factor * plain), control


def test_of_subcases_with_several_sets_the_first_counts_and_is_named(tmp_path):
    control = "SUBCASE 1\nSPC = 1\nSUBCASE 2\nSPC = 5\nSUBCASE 3\nSPC = 4\nSUBCASE 4\nSPC = 1"
    made = read(tmp_path, *bar(2), "SPC1,4,3,2", "SPC1,5,3,3", control=control)
    assert made.default_supports == ("spc_1",)
    wanted = "the subcases name several sets of SPC (1 in the first, then 4, 5); that of the first is used"
    assert wanted in made.notes


def test_springs_that_cannot_act_are_left_out_one_by_one(tmp_path):
    """Grids 1 and 2 of a rod do not turn; the spring that follows is kept."""
    cards = ["GRID,1,,0.,0.,0.", "GRID,2,,1.,0.,0.", "GRID,3,,2.,0.,0.", "CROD,1,7,1,2", "CROD,2,7,2,3", 
             "PROD,7,1,1.-4", STEEL, "PBUSH,8,K,,,,5.", "CBUSH,21,8,2,,,,,0", "CELAS2,22,30.,2,2", "CELAS2,23,0.,2,1",
             "PBUSH,9",
             "CBUSH,24,9,1,2,,,,0", "PBUSH1D,10,", "CBUSH1D,25,10,1,2", "PBUSH,11,K,40.",
             "CBUSH,26,11,3,,,,,0"]  # fmt: skip
    made = read(tmp_path, *cards, control="ECHO = NONE")
    scalar, bush = made.bushings
    assert scalar.stiffness == pytest.approx(30.0) and bush.translation == pytest.approx((40.0, 0.0, 0.0))
    said = [str(one) for one in made.unused]
    zero = "its stiffness is zero; nothing is left out"
    for line in (
        "1 CBUSH at grids without rotation: springs against rotation of solids and rods are left out (first at "
        "deck.bdf:13)",
        f"1 CELAS2: {zero} (first at deck.bdf:15)", f"1 CBUSH: {zero} (first at deck.bdf:17)",
        f"1 CBUSH1D: {zero} (first at deck.bdf:19)",
    ):  # fmt: skip
        assert line in said, said


def test_a_bushing_without_mass_and_damping_says_nothing_of_them(tmp_path):
    """M, B and C of zero or blank; each of the two of PBUSH1D alone is named with its line."""
    base = [*CARDS, "CONM2,90,3,,1."]
    quiet = read(
        tmp_path, *base, "PBUSH,8,K,5.,5.,5.", ",,M,,", "CBUSH,9,8,1,2,,,,0", "PBUSH1D,7,5.,0.,0.", "CBUSH1D,6,7,1,2"
    )
    assert not [one for one in quiet.unused if "BUSH" in one.card]
    for fields in ("5.,2.", "5.,,2."):
        made = read(tmp_path, *base, f"PBUSH1D,7,{fields}", "CBUSH1D,6,7,1,2")
        wanted = "1 PBUSH1D C, M: damping and mass of bushings are left out; give them in the case (first at deck.bdf:"
        assert f"{wanted}{5 + len(base)})" in [str(one) for one in made.unused]
    loud = read(tmp_path, *base, "PBUSH,8,K,5.,5.,5.", ",,B,2.", ",,GE,.1", "CBUSH,9,8,1,2,,,,0")
    said = [str(one) for one in loud.unused]
    where = f"(first at deck.bdf:{5 + len(base)})"
    assert f"1 PBUSH B: damping of bushings is left out; give damping in the case {where}" in said
    assert f"1 PBUSH GE: structural damping of bushings is left out; give damping in the case {where}" in said


def test_a_bushing_without_orientation_between_two_grids_at_one_place_has_their_axes(tmp_path):
    """Stiffness along the displacement axes of its first grid; of one grid alone too."""
    x = ",".join(map(str, AT[1]))
    cards = [*CARDS, f"GRID,7,,{x},0", "PBUSH,8,K,500.,300.,200.,7.,8.,9.", "CONM2,90,7,,1.", "CBUSH,9,8,1,7"]
    made = read(tmp_path, *cards)
    C, k = axes(1), np.array([500.0, 300.0, 200.0])
    K = C.T @ np.diag(k) @ C
    found = on_grids(made, "K", (1, 7))
    assert found[:3, :3] == pytest.approx(K, abs=1e-6) and found[:3, 6:9] == pytest.approx(-K, abs=1e-6)
    turn = C.T @ np.diag([7.0, 8.0, 9.0]) @ C
    assert found[3:6, 3:6] == pytest.approx(turn, abs=1e-6)


def test_scalar_masses_come_from_their_property_and_are_scaled(tmp_path):
    """PMASS names four masses in a card; WTMASS scales masses and inertias alike."""
    cards = [*CARDS, "PMASS,1,3.,2,5.,3,7.,4,9.", "PARAM,WTMASS,.5"]
    cards += [f"CMASS1,{10 + c},2,1,{c}" for c in (1, 2, 3)] + [
        "CMASS1,20,1,1,5",
        "CMASS1,21,4,1,6",
        "CELAS2,30,1.,2,6",
    ]
    found = on_grids(read(tmp_path, *cards), "M", (1,))
    C = axes(1)
    assert found[:3, :3] == pytest.approx(2.5 * np.eye(3))
    assert found[3:, 3:] == pytest.approx(C.T @ np.diag([0, 1.5, 4.5]) @ C, abs=1e-9)


def test_fluids_and_solids_of_other_properties_are_distinguished(tmp_path):
    tetra = [*IN_PLANE[:3], ABOVE[0], "PSOLID,4,1", STEEL, "CTETRA,1,4,1,2,3,5"]
    for fluid in (["PSOLID,5,1,,,,,PFLUID"], ["PSOLID,5,2", "MAT10,2,1.E9,1000."]):
        made = read(tmp_path, *tetra, *fluid, "CTETRA,2,5,1,2,3,5", control="ECHO = NONE")
        assert len(made.mesh.cells["tetra"]) == 1
        line = 5 + len(tetra) + len(fluid)
        assert f"1 CTETRA of fluids: the fluid is left out (first at deck.bdf:{line})" in [str(o) for o in made.unused]
    refused(
        tmp_path,
        [*tetra, "PLSOLID,5,1", "CTETRA,2,5,1,2,3,5"],
        "deck.bdf:13: CTETRA 2: names PLSOLID 5, which is not understood; give PSOLID instead",
    )


def test_a_small_system_far_away_is_one(tmp_path):
    """A third point 1 um off the z axis, 1 km from the origin; grids and forces count along its axes."""
    cards = ["CORD2R,9,,1000.,0.,0.,1000.,0.,1.", ",1000.,1.E-6,0.", "GRID,2,9,3.,4.,0.", "GRID,1,,0.,0.,0."]
    made = read(tmp_path, *cards, "CBAR,1,1,1,2,0.,0.,1.", PROPERTIES[0], STEEL, control="ECHO = NONE")
    assert made.mesh.points[made.points_of_ids[2]] == pytest.approx([996.0, 3.0, 0.0])  # x along y, y against x


def test_matrices_to_scalar_points_are_left_out(tmp_path):
    cards = [*CARDS, "CONM2,90,3,,1.", "SPOINT,77", "GENEL,9,,77,1", ",K,5."]
    made = read(tmp_path, *cards)
    line = 5 + len(CARDS) + 2
    assert not made.bushings
    assert f"1 GENEL: matrices to scalar points are left out (first at deck.bdf:{line})" in [
        str(o) for o in made.unused
    ]


def test_equations_of_other_sets_are_left_out_and_a_set_without_cards_is_noted(tmp_path):
    cards = [*CARDS, "CONM2,90,1,,1.", "CONM2,91,2,,1.", "MPC,5,1,1,1.,2,1,-1.", "MPC,6,1,2,1.,2,2,-1."]
    made = read(tmp_path, *cards, control="MPC = 6")
    (one,) = made.connections
    assert one.components == ("y",)
    none = read(tmp_path, *cards, control="MPC = 8")
    assert not none.connections
    assert "case control names MPC set 8, of which the deck has no card; no equation is used" in none.notes
    (left,) = (str(one) for one in made.unused if one.card == "MPC")
    assert re.fullmatch(
        rf"1 MPC: of set 5, which case control does not choose \(first at deck.bdf:{7 + len(CARDS)}\)", left
    )
