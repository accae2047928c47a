"""What few decks use: facets that point down, orientations of springs, data lines in other files, and their like."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from support.nastran_decks import bar, frequencies, read, written

from femflex.decks import DeckError, read_deck
from femflex.decks.report import mass_and_centre

BAR = (
    "*NODE\n1, 0., 0., 0.\n2, 1., 0., 0.\n*ELEMENT, TYPE={kind}, ELSET=EA\n1, 1, 2\n"
    "*BEAM GENERAL SECTION, SECTION=GENERAL, ELSET=EA, DENSITY=0.\n1.E-3, 2.E-7, 0., 8.E-7, 1.E-6\n0., 0., -1.\n"
    "2.1E11, 8.E10\n{more}*BOUNDARY\n1, 1, 6\n*ELEMENT, TYPE=MASS, ELSET=M\n9, 2\n*MASS, ELSET=M\n10.\n"
)
KY, KZ, M = 3 * 2.1e11 * 8e-7, 3 * 2.1e11 * 2e-7, 10.0  # of the bar's tip [N/m], and the mass there


def by_abaqus(folder: Path, text: str, n: int = 2) -> np.ndarray:
    """Lowest natural frequencies [Hz] of an Abaqus deck."""
    path = folder / "model.inp"
    path.write_text(text)
    return frequencies(read_deck(path, "m-kg-s"), n)


def tip(more: str = "", kind: str = "B33", within: str = "") -> str:
    """A massless bar 1 m long with 10 kg at its tip."""
    return BAR.format(kind=kind, more=within) + more


def hertz(K: np.ndarray) -> np.ndarray:
    """Frequencies of the mass on a stiffness over y and z [Hz]."""
    return np.sqrt(np.linalg.eigvalsh(K) / M) / (2 * np.pi)


def facets(down: bool, properties: list[str]) -> list[str]:
    """A plate of 16 triangles, 1 m by 0.5 m, whose normals are +z, or -z; its ply axis lies at 30 deg."""
    axis = "CORD2R,9,,0.,0.,0.,0.,0.,1.\n,0.86602540,.5,0."
    nodes = [f"GRID,{1 + i + 5 * j},,{i / 4},{j / 4},0." for j in range(3) for i in range(5)]
    cells = []
    for j in range(2):
        for i in range(4):
            a = 1 + i + 5 * j
            for corners in ((a, a + 1, a + 6), (a, a + 6, a + 5)):
                own = corners[::-1] if down else corners
                cells.append(f"CTRIA3,{len(cells) + 1},3,{own[0]},{own[1]},{own[2]},9")
    return [*nodes, *cells, axis, *properties, "SPC1,1,123456,1,6,11"]


PLIES = {  # by sense of the normal: angles count about it
    False: ["PCOMP,3,,,,,,,SYM\n,8,1.-3,0.,,8,1.-3,45.", "MAT8,8,1.4+11,1.+10,.3,5.+9,5.+9,3.+9,1600."],
    True: ["PCOMP,3,,,,,,,SYM\n,8,1.-3,0.,,8,1.-3,-45.", "MAT8,8,1.4+11,1.+10,.3,5.+9,5.+9,3.+9,1600."],
}


def test_angles_of_plies_count_about_the_normal_of_each_triangle(tmp_path):
    up = read(tmp_path, *facets(False, PLIES[False]))
    assert {member.family for member in up.members} == {"plate"}
    turned = frequencies(read(tmp_path, *facets(True, PLIES[True])))  # seen from above both have +45 deg
    assert turned == pytest.approx(frequencies(up), rel=1e-9)
    mirrored = frequencies(read(tmp_path, *facets(True, PLIES[False])))
    assert abs(mirrored[0] / turned[0] - 1) > 0.05


def test_angles_of_plies_of_abaqus_triangles_count_about_their_normal(tmp_path):
    def deck(down: bool, angle: float) -> str:
        nodes = "".join(f"{1 + i + 5 * j}, {i / 4}, {j / 4}, 0.\n" for j in range(3) for i in range(5))
        cells = ""
        for k, (i, j) in enumerate((i, j) for j in range(2) for i in range(4)):
            a = 1 + i + 5 * j
            for n, corners in enumerate(((a, a + 1, a + 6), (a, a + 6, a + 5))):
                own = corners[::-1] if down else corners
                cells += f"{2 * k + n + 1}, {own[0]}, {own[1]}, {own[2]}\n"
        return (
            f"*NODE\n{nodes}*ELEMENT, TYPE=S3, ELSET=P\n{cells}*SHELL SECTION, ELSET=P, COMPOSITE, SYMMETRIC\n"
            f".001, 3, CF, 0.\n.001, 3, CF, {angle}\n*MATERIAL, NAME=CF\n*ELASTIC, TYPE=LAMINA\n"
            "1.4E11, 1.E10, .3, 5.E9, 5.E9, 3.E9\n*DENSITY\n1600.\n*BOUNDARY\n1, 1, 6\n6, 1, 6\n11, 1, 6\n"
        )

    assert by_abaqus(tmp_path, deck(True, -45.0), 4) == pytest.approx(
        by_abaqus(tmp_path, deck(False, 45.0), 4), rel=1e-9
    )


def test_relative_thickness_of_second_order_shells_is_a_factor(tmp_path):
    """TFLAG = 1: T1 to T4 times the property's thickness."""
    x = [(0, 0), (1, 0), (1, 0.5), (0, 0.5), (0.5, 0), (1, 0.25), (0.5, 0.5), (0, 0.25)]
    grids = [f"GRID,{k + 1},,{a},{b},0." for k, (a, b) in enumerate(x)]
    last = ["PSHELL,3,1,.02,1,,1", "MAT1,1,7.E10,,.3,2700.", "SPC1,1,123456,1,4,8"]
    quad = ["CQUAD8,1,3,1,2,3,4,5,6", ",7,8,2.,2.,2.,2.,,", ",1"]
    assert mass_and_centre(read(tmp_path, *grids, *quad, *last).structure())[0] == pytest.approx(2700 * 0.5 * 0.04)
    tria = ["CTRIA6,1,3,1,2,4,5,9,8", ",,,2.,2.,2.,1", "GRID,9,,.5,.25,0."]
    own = [card for card in grids if card.split(",")[1] in "12458"]
    made = read(tmp_path, *own, *tria, *last[:2], "SPC1,1,123456,1,4,8")
    assert mass_and_centre(made.structure())[0] == pytest.approx(2700 * 0.25 * 0.04)


def test_wtmass_of_case_control_scales_the_mass(tmp_path):
    plain = read(tmp_path, *bar())
    control = "PARAM,WTMASS,0.5\nSPC = 1"
    scaled = read(tmp_path, *bar(), "PARAM,WTMASS,0.25", control=control)
    assert mass_and_centre(scaled.structure())[0] == pytest.approx(mass_and_centre(plain.structure())[0] / 2)
    later = read(tmp_path, *bar(), control="SUBCASE 1\nSPC = 1\nSUBCASE 2\nPARAM,WTMASS,0.5\nSPC = 1")
    assert mass_and_centre(later.structure())[0] == pytest.approx(mass_and_centre(plain.structure())[0])


def test_one_dimensional_bushings_are_springs_along_their_line(tmp_path):
    around = [*bar(), "GRID,20,,2.,1.,0.", "SPC1,1,123456,20"]
    expected = frequencies(read(tmp_path, *around, "CELAS2,9,1.+4,9,2"))
    along = read(tmp_path, *around, "CBUSH1D,9,10,9,20", "PBUSH1D,10,1.+4,5.")
    assert frequencies(along) == pytest.approx(expected, rel=1e-12)
    assert [one.card for one in along.unused] == ["PBUSH1D C, M"]
    system = "CORD2R,7,,0.,0.,0.,0.,0.,1.\n,0.,1.,0."
    to_ground = read(tmp_path, *bar(), system, "CBUSH1D,9,10,9,,7", "PBUSH1D,10,1.+4")
    assert frequencies(to_ground) == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize(
    ("cards", "sentence"),
    [
        (["CBUSH1D,9,11,9,20", "PBUSH1D,10,1.+4"], r"names property 11, .* of PBUSH1D it has \[10\]"),
        (["CBUSH1D,9,10,9,20", "PBUSH1D,10,-1.+4"], "has a stiffness below zero"),
        (["CBUSH1D,9,10,9", "PBUSH1D,10,1.+4"], "no line between two grids, and no CID; give CID"),
    ],
)
def test_bushings_that_cannot_be_used_say_why(tmp_path, cards, sentence):
    with pytest.raises(DeckError, match=sentence):
        read(tmp_path, *bar(), "GRID,20,,2.,1.,0.", *cards)


def test_an_inertia_about_one_axis_turns_about_that_axis_alone(tmp_path):
    """No body has it, and Nastran and Abaqus take it."""
    cards = ["PBAR,3,1,1.E-3,2.E-7,8.E-7,1.E-6", "MAT1,1,2.1E11,,0.3", "SPC1,1,123456,1"]
    ends = ["GRID,1,,0.,0.,0.", "GRID,2,,1.,0.,0.", "CBAR,1,3,1,2,0.,1.,0."]
    made = read(tmp_path, *ends, *cards, "CONM2,9,2,,10.,,,,,\n,.5")
    twist = np.sqrt(2.1e11 / 2.6 * 1e-6 / 0.5) / (2 * np.pi)
    assert np.abs(frequencies(made, 3) / twist - 1).min() < 1e-9
    both = tip("*ELEMENT, TYPE=ROTARYI, ELSET=R\n19, 2\n*ROTARY INERTIA, ELSET=R\n.5, 0., 0.\n")
    assert np.abs(by_abaqus(tmp_path, both, 3) / (np.sqrt(8e10 * 1e-6 / 0.5) / (2 * np.pi)) - 1).min() < 1e-9


def test_an_inertia_below_zero_is_refused_with_its_line(tmp_path):
    with pytest.raises(DeckError, match=r"CONM2 9 has an inertia with principal moments \[-0.5"):
        read(tmp_path, *bar(), "CONM2,9,2,,0.,,,,,\n,-.5")
    turned = tip("*ELEMENT, TYPE=ROTARYI, ELSET=R\n19, 2\n*ROTARY INERTIA, ELSET=R\n-.5, 0., 0.\n")
    with pytest.raises(DeckError, match=r"line \d+: \*ROTARY INERTIA has principal moments \[-0.5"):
        by_abaqus(tmp_path, turned)


def test_a_support_of_a_hundred_million_grids_takes_those_that_are_there(tmp_path):
    plain = frequencies(read(tmp_path, *bar()))
    cards = [card for card in bar() if not card.startswith("SPC1")]
    far = read(tmp_path, *cards, "SPC1,1,123456,1", "SPC1,1,6,100,THRU,99999999")
    assert frequencies(far) == pytest.approx(plain)


def test_a_deck_may_begin_with_the_mark_of_utf8(tmp_path):
    path = written(tmp_path, *bar())
    text = path.read_text().split("BEGIN BULK\n")[1]
    path.write_text(text, encoding="utf-8-sig")  # the first line is a GRID card
    assert len(read_deck(path, "m-kg-s").mesh.points) == 9


def test_springs_lie_along_their_orientation(tmp_path):
    """The y axis of the orientation is (0, 1, 1) / sqrt 2."""
    axes = "*ORIENTATION, NAME=O\n1., 0., 0., 0., 1., 1.\n1, 0.\n"
    ground = "*ELEMENT, TYPE=SPRING1, ELSET=S\n5, 2\n*SPRING, ELSET=S, ORIENTATION=O\n2\n5.E5\n"
    n = np.array([1.0, 1.0]) / np.sqrt(2)
    expected = hertz(np.diag([KY, KZ]) + 5e5 * np.outer(n, n))
    assert by_abaqus(tmp_path, tip(axes + ground)) == pytest.approx(expected, rel=1e-8)
    pair = "*NODE\n3, 1., 0., 0.\n*BOUNDARY\n3, 1, 3\n*ELEMENT, TYPE=SPRING2, ELSET=S\n5, 2, 3\n"
    pair += "*SPRING, ELSET=S, ORIENTATION=O\n2, 2\n5.E5\n"
    assert by_abaqus(tmp_path, tip(axes + pair)) == pytest.approx(expected, rel=1e-8)


def test_equations_count_along_the_axes_of_transformed_nodes(tmp_path):
    """u2 = 0 along (0, 1, 1): y and z move oppositely."""
    turned = "*NSET, NSET=T\n2\n*TRANSFORM, NSET=T\n1., 0., 0., 0., 1., 1.\n*EQUATION\n1\n2, 2, 1.\n"
    found = by_abaqus(tmp_path, tip(turned), 1)
    assert found == pytest.approx(np.sqrt((KY + KZ) / 2 / M) / (2 * np.pi), rel=1e-8)
    other = "*NODE\n3, 1., 0., 0.\n*NSET, NSET=T\n3\n*TRANSFORM, NSET=T\n1., 0., 0., 0., 1., 1.\n*EQUATION\n"
    leader = (
        "2\n2, 2, 1., 3, 2, -1.\n*BOUNDARY\n3, 1, 1\n3, 3, 3\n*ELEMENT, TYPE=MASS, ELSET=N\n8, 3\n*MASS, ELSET=N\n1.\n"
    )
    free = by_abaqus(tmp_path, tip(other + leader), 2)  # u_y of 2 is u along (0, 1, 1) of 3, which moves 1 kg
    assert np.sort(free) == pytest.approx(np.sort(np.sqrt([KZ / (M + 1), KY / M])) / (2 * np.pi), rel=1e-8)


def test_couplings_hold_components_along_their_orientation(tmp_path):
    """The tip is held along (0, 1, 1) alone."""
    axes = "*ORIENTATION, NAME=O\n1., 0., 0., 0., 1., 1.\n1, 0.\n*NODE\n3, 1., 0., 0.\n*BOUNDARY\n3, 1, 6\n"
    newer = "*SURFACE, TYPE=NODE, NAME=S\n2\n*COUPLING, REF NODE=3, SURFACE=S, ORIENTATION=O, CONSTRAINT NAME=C\n"
    expected = np.sqrt((KY + KZ) / 2 / M) / (2 * np.pi)
    assert by_abaqus(tmp_path, tip(axes + newer + "*KINEMATIC\n2, 2\n"), 1) == pytest.approx(expected, rel=1e-8)
    older = "*KINEMATIC COUPLING, REF NODE=3, ORIENTATION=O\n2, 2, 2\n"
    assert by_abaqus(tmp_path, tip(axes + older), 1) == pytest.approx(expected, rel=1e-8)


def test_data_lines_may_stand_in_another_file(tmp_path):
    whole = tip()
    (tmp_path / "nodes.inc").write_text("1, 0., 0., 0.\n\n** a comment\n2, 1., 0., 0.\n")
    (tmp_path / "elements.inc").write_text("1, 1, 2\n")
    parts = whole.replace("*NODE\n1, 0., 0., 0.\n2, 1., 0., 0.\n", "*NODE, INPUT=nodes.inc\n")
    parts = parts.replace("ELSET=EA\n1, 1, 2\n", "ELSET=EA, INPUT=elements.inc\n")
    assert "1, 1, 2" not in parts
    assert by_abaqus(tmp_path, parts) == pytest.approx(by_abaqus(tmp_path, whole), rel=1e-12)


@pytest.mark.parametrize(
    ("content", "sentence"),
    [
        (None, r"model.inp, line 1: .*nodes.inc is named by \*NODE in an Abaqus deck but does not exist"),
        (
            "1, 0., 0., 0.\n*NSET, NSET=A\n1\n",
            r"nodes.inc, line 2: \*NSET stands in a file of data lines, which \*NODE, INPUT",
        ),
        ("1, 0., 0., 0.\n2, a, 0., 0.\n", "nodes.inc, line 2: .*'a' where a coordinate belongs"),
    ],
)
def test_a_file_of_data_lines_that_cannot_be_read_is_named(tmp_path, content, sentence):
    if content is not None:
        (tmp_path / "nodes.inc").write_text(content)
    text = tip().replace("*NODE\n1, 0., 0., 0.\n2, 1., 0., 0.\n", "*NODE, INPUT=nodes.inc\n")
    with pytest.raises(ValueError, match=sentence):
        by_abaqus(tmp_path, text)


def test_beams_shear_with_the_stiffness_that_is_given(tmp_path):
    """K23 along 2, K13 along 1; one that is missing is as the other."""
    own = "*TRANSVERSE SHEAR STIFFNESS\n{}\n"
    k = [1 / (1 / bend + 1 / 1e5) for bend in (KZ, KY)]
    found = by_abaqus(tmp_path, tip(kind="B31", within=own.format("1.E5")))
    assert found == pytest.approx(hertz(np.diag(k)), rel=1e-8)
    k = [1 / (1 / KY + 1 / 1e5), 1 / (1 / KZ + 1 / 3e5)]  # n1 = -z: the 2-axis is y or -y, along which I11 counts
    found = by_abaqus(tmp_path, tip(kind="B31", within=own.format("3.E5, 1.E5")))
    assert found == pytest.approx(hertz(np.diag(k)), rel=1e-8)


@pytest.mark.parametrize(
    ("values", "section", "sentence"),
    [
        ("0., 0.", "0., 8.E-7", "K23, K13 = .* give positive ones"),
        ("1.E5, 2.E5", "1.E-7, 8.E-7", "principal axes are turned by .* differs from K13"),
    ],
)
def test_shear_stiffness_that_cannot_be_used_says_why(tmp_path, values, section, sentence):
    text = tip(kind="B31", within=f"*TRANSVERSE SHEAR STIFFNESS\n{values}\n").replace("0., 8.E-7", section)
    with pytest.raises(DeckError, match=sentence):
        by_abaqus(tmp_path, text)


def test_a_blank_line_of_a_beam_section_is_its_default_direction(tmp_path):
    assert by_abaqus(tmp_path, tip().replace("0., 0., -1.", "")) == pytest.approx(by_abaqus(tmp_path, tip()), rel=1e-12)


def test_a_mass_that_differs_by_direction_is_refused(tmp_path):
    alike = tip().replace("*MASS, ELSET=M\n10.", "*MASS, ELSET=M, TYPE=ANISOTROPIC\n10., 0., 10., 0., 0., 10.")
    assert by_abaqus(tmp_path, alike) == pytest.approx(by_abaqus(tmp_path, tip()), rel=1e-12)
    with pytest.raises(DeckError, match=r"TYPE=ANISOTROPIC has \[10.0, 0.0, 5.0, .* differ by direction"):
        by_abaqus(tmp_path, alike.replace("0., 10., 0.", "0., 5., 0."))


def test_density_of_a_shell_section_is_added_to_that_of_its_material(tmp_path):
    text = (
        "*NODE\n1, 0., 0., 0.\n2, 1., 0., 0.\n3, 1., 1., 0.\n4, 0., 1., 0.\n*ELEMENT, TYPE=S4, ELSET=P\n1, 1, 2, 3, 4\n"
        "*SHELL SECTION, ELSET=P, MATERIAL=A, DENSITY=5.\n.01\n"
        "*MATERIAL, NAME=A\n*ELASTIC\n7.E10, .3\n*DENSITY\n2700.\n"
    )
    path = tmp_path / "plate.inp"
    path.write_text(text)
    assert mass_and_centre(read_deck(path, "m-kg-s").structure())[0] == pytest.approx(27.0 + 5.0)
