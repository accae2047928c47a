"""Keywords of Abaqus and CalculiX, one by one, against closed forms or another way of saying the same."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from test_deck_abaqus import NU, RHO, STEEL, TIP_MASS, E, beam, brick, clamped, deck, frequencies, plate

from femflex.decks import DeckError
from femflex.decks.report import describe


@pytest.mark.parametrize("tip", [(1100.0, 20.0, 5.0), (1010.0, 90.0, -30.0), (1000.0, 0.0, 70.0)])
def test_a_link_keeps_the_distance_of_two_nodes_and_nothing_else(tip, tmp_path):
    """Of a mass that is linked to the tip of a beam: all motions but along their line are left."""
    mass = (
        f"*NODE\n20, {tip[0]}, {tip[1]}, {tip[2]}\n*ELEMENT, TYPE=MASS, ELSET=LUMP\n99, 20\n*MASS, ELSET=LUMP\n1E-3\n"
    )
    loose = deck(tmp_path, beam("RECT", "10., 20.\n0., 1., 0.") + mass).structure()
    for pair in ("20, 11", "11, 20"):
        made = deck(tmp_path, beam("RECT", "10., 20.\n0., 1., 0.") + mass + f"*MPC\nLINK, {pair}\n")
        structure = made.structure()
        rows = [made.points_of_ids[node] for node in (11, 20)]
        a, b = (structure.translation[3 * row : 3 * row + 3].toarray() for row in rows)
        line = structure.mesh.points[rows[1]] - structure.mesh.points[rows[0]]
        assert np.abs(line @ (b - a)).max() < 1e-12 and np.linalg.matrix_rank(np.vstack([a, b])) == 5
        assert structure.n_dof == loose.n_dof - 1
    at_tip = mass.replace(f"{tip[0]}, {tip[1]}, {tip[2]}", "1000., 0., 0.")
    with pytest.raises(DeckError, match=r"its two nodes are at one place; give TIE or PIN"):
        deck(tmp_path, beam("RECT", "10., 20.\n0., 1., 0.") + at_tip + "*MPC\nLINK, 20, 11\n")


def said(folder: Path, text: str) -> str:
    """What is told of a deck."""
    return " ".join(describe(deck(folder, text)).split())


def isotropic_matrix() -> np.ndarray:
    """Order 11, 22, 33, 12, 13, 23 [MPa]."""
    C = np.zeros((6, 6))
    C[:3, :3] = 210e3 * NU / ((1 + NU) * (1 - 2 * NU))
    C[range(3), range(3)] += 210e3 / (1 + NU)
    C[range(3, 6), range(3, 6)] = 210e3 / (2 * (1 + NU))
    return C


def elastic(kind: str, words: list[str]) -> str:
    rows = "\n".join(", ".join(words[k : k + 8]) for k in range(0, len(words), 8))
    return f"*MATERIAL, NAME=STEEL\n*ELASTIC, TYPE={kind}\n{rows}\n*DENSITY\n7.85E-9\n"


def ortho(C: np.ndarray) -> str:
    pairs = [(0, 0), (0, 1), (1, 1), (0, 2), (1, 2), (2, 2), (3, 3), (4, 4), (5, 5)]
    return elastic("ORTHOTROPIC", [f"{C[pair]:.9g}" for pair in pairs])


def aniso(C: np.ndarray) -> str:
    return elastic("ANISOTROPIC", [f"{C[i, j]:.9g}" for j in range(6) for i in range(j + 1)])


@pytest.mark.parametrize("material", [ortho, aniso])
def test_stiffnesses_of_an_isotropic_solid_make_it(tmp_path, material):
    found = frequencies(deck(tmp_path, brick(material=material(isotropic_matrix()))))
    assert found == pytest.approx(frequencies(deck(tmp_path, brick())), rel=1e-6)


def test_stiffnesses_keep_their_order(tmp_path):
    """Nine different numbers: the same by ORTHOTROPIC, by ANISOTROPIC, and turned with their axes by 90 deg."""
    C = isotropic_matrix()
    C[0, 0] *= 3.0
    C[0, 1] = C[1, 0] = 1.3 * C[0, 1]
    C[3, 3], C[4, 4], C[5, 5] = 5e4, 6e4, 9e4
    wanted = frequencies(deck(tmp_path, brick(material=ortho(C))))
    assert frequencies(deck(tmp_path, brick(material=aniso(C)))) == pytest.approx(wanted, rel=1e-9)
    order = [1, 0, 2, 3, 5, 4]  # axes 1 and 2 exchanged: what is along 1 lies along y
    swapped = C[np.ix_(order, order)]
    for system in ("3, 90.", "3, -90."):
        turn = f"*ORIENTATION, NAME=TURN\n1., 0., 0., 0., 1., 0.\n{system}\n"
        turned = brick(", ORIENTATION=TURN", material=ortho(swapped), extra=turn)
        assert frequencies(deck(tmp_path, turned)) == pytest.approx(wanted, rel=1e-9)
    around = "*ORIENTATION, NAME=TURN\n1., 0., 0., 0., 1., 0.\n1, 90.\n"  # 2 and 3 exchanged
    order = [0, 2, 1, 4, 3, 5]
    turned = brick(", ORIENTATION=TURN", material=ortho(C[np.ix_(order, order)]), extra=around)
    assert frequencies(deck(tmp_path, turned)) == pytest.approx(wanted, rel=1e-9)


@pytest.mark.parametrize(
    "system",
    [
        "*ORIENTATION, NAME=O, SYSTEM=SPHERICAL\n-1.E8, 5., 5., -1.E8, 5., 6.\n",
        "*ORIENTATION, NAME=O, SYSTEM=CYLINDRICAL\n-1.E8, 5., 5., -1.E8, 5., 6.\n",
        "*ORIENTATION, NAME=O, DEFINITION=NODES\n9001, 9002\n",
    ],
)
def test_systems_far_away_or_by_nodes_are_rectangular(tmp_path, system):
    """Radial from far along -x: direction 1 is x."""
    C = isotropic_matrix()
    C[0, 0] *= 3.0
    text = brick(", ORIENTATION=O", material=ortho(C), extra=system)
    text = text.replace("*NODE\n", "*NODE\n9001, 1., 0., 0.\n9002, 0., 1., 0.\n", 1)
    wanted = frequencies(deck(tmp_path, brick(material=ortho(C))))
    assert frequencies(deck(tmp_path, text)) == pytest.approx(wanted, rel=1e-5)


def test_plies_of_stiffnesses_are_those_of_their_constants(tmp_path):
    """A material by ORTHOTROPIC without couplings of its planes in a shell: E and nu from the inverse."""
    section = "*SHELL SECTION, ELSET=SKIN, COMPOSITE\n4., 3, STEEL, 0.\n"
    made = deck(tmp_path, plate(section, ortho(isotropic_matrix()))).members[0].section
    plain = deck(tmp_path, plate(section)).members[0].section
    assert made.A == pytest.approx(plain.A, rel=1e-6) and made.D == pytest.approx(plain.D, rel=1e-6)


def test_trusses_carry_a_mass_in_their_plane(tmp_path):
    """Two rods at 45 deg: omega^2 = E A / (L m) along both axes."""
    text = (
        "*NODE\n1, 0., 0., 0.\n2, 2000., 0., 0.\n3, 1000., 1000., 0.\n"
        "*ELEMENT, TYPE=T3D2, ELSET=RODS\n1, 1, 3\n2, 2, 3\n"
        "*MATERIAL, NAME=LIGHT\n*ELASTIC\n210000., 0.3\n*DENSITY\n1.E-15\n*SOLID SECTION, ELSET=RODS, MATERIAL=LIGHT\n"
        "{}\n*ELEMENT, TYPE=MASS, ELSET=M\n9, 3\n*MASS, ELSET=M\n0.01\n*BOUNDARY\n1, 1, 3\n2, 1, 3\n3, 3\n"
    )
    exact = np.sqrt(E * 1e-4 / (np.sqrt(2) * 10.0)) / (2 * np.pi)
    assert frequencies(deck(tmp_path, text.format("100.")), 2) == pytest.approx([exact] * 2, rel=1e-6)
    assert frequencies(deck(tmp_path, text.format("")), 2) == pytest.approx([exact / 10.0] * 2, rel=1e-6)  # 1 mm^2
    with pytest.raises(DeckError, match=r"the area of trusses is -0\.0001 m\^2; give a positive one"):
        deck(tmp_path, text.format("-100."))


def test_edges_of_shells_are_tied_by_their_labels(tmp_path):
    """Two strips of one element each, side E2 of the first on side E4 of the second: one strip of two elements."""
    ends = "*BOUNDARY\nROOT, ENCASTRE\n"
    section = STEEL + "*SHELL SECTION, ELSET=SKIN, MATERIAL=STEEL\n4.\n"
    nodes = "*NODE\n1, 0., 0., 0.\n2, 100., 0., 0.\n3, 100., 50., 0.\n4, 0., 50., 0.\n"
    whole = (
        f"{nodes}12, 200., 0., 0.\n13, 200., 50., 0.\n*ELEMENT, TYPE=S4, ELSET=SKIN\n1, 1, 2, 3, 4\n2, 2, 12, 13, 3\n"
    )
    parts = (
        f"{nodes}11, 100., 0., 0.\n12, 200., 0., 0.\n13, 200., 50., 0.\n14, 100., 50., 0.\n"
        "*ELEMENT, TYPE=S4, ELSET=SKIN\n1, 1, 2, 3, 4\n2, 11, 12, 13, 14\n"
        "*SURFACE, NAME=NEAR\n1, E2\n*SURFACE, NAME=FAR\n2, E4\n*TIE, NAME=T\nFAR, NEAR\n"
    )
    root = "*NSET, NSET=ROOT\n1, 4\n"
    wanted = frequencies(deck(tmp_path, whole + root + section + ends))
    assert frequencies(deck(tmp_path, parts + root + section + ends)) == pytest.approx(wanted, rel=1e-8)


@pytest.mark.filterwarnings("ignore::femflex.warning.PhysicsWarning")  # triangles of constant strain
def test_a_quadrilateral_that_names_a_node_twice_is_a_triangle(tmp_path):
    """At the end of a strip of quadrilaterals."""
    text = (
        "*NODE\n1, 0., 0., 0.\n2, 100., 0., 0.\n3, 100., 50., 0.\n4, 0., 50., 0.\n5, 150., 25., 0.\n"
        "*ELEMENT, TYPE=S4, ELSET=SKIN\n1, 1, 2, 3, 4\n{}"
        + STEEL
        + "*SHELL SECTION, ELSET=SKIN, MATERIAL=STEEL\n4.\n*BOUNDARY\n1, ENCASTRE\n4, ENCASTRE\n"
    )
    wanted = frequencies(deck(tmp_path, text.format("*ELEMENT, TYPE=S3, ELSET=SKIN\n2, 2, 5, 3\n")))
    assert frequencies(deck(tmp_path, text.format("2, 2, 5, 3, 3\n"))) == pytest.approx(wanted, rel=1e-9)


# Connections


def test_a_rigid_body_of_elements_and_one_of_pins_carry_a_mass(tmp_path):
    wanted = frequencies(deck(tmp_path, brick() + TIP_MASS + "*RIGID BODY, NSET=TIP, REF NODE=9999\n"))
    last = "*ELSET, ELSET=LAST\n5\n"
    by_elements = frequencies(deck(tmp_path, brick() + TIP_MASS + last + "*RIGID BODY, ELSET=LAST, REF NODE=9999\n"))
    pins = frequencies(deck(tmp_path, brick() + TIP_MASS + "*RIGID BODY, PIN NSET=TIP, REF NODE=9999\n"))
    assert pins[0] == pytest.approx(wanted[0], rel=1e-6)  # solids have no rotations to pin
    assert wanted[0] < by_elements[0] < 1.4 * wanted[0]  # a fifth of the beam is rigid


def test_a_coupling_within_a_radius_takes_the_nodes_there(tmp_path):
    face = "*SURFACE, NAME=FACE, TYPE=NODE\nTIP, 1.\n*COUPLING, CONSTRAINT NAME=C, REF NODE=9999, SURFACE=FACE{}\n"
    wide, world, tight = (
        frequencies(deck(tmp_path, brick() + TIP_MASS + face.format(f", INFLUENCE RADIUS={r}") + "*KINEMATIC\n1, 6\n"))[
            0
        ]
        for r in ("20.", "WORLD", "5.1")  # the corners lie at 7.07 mm, the middles of sides at 5 mm
    )
    assert wide == pytest.approx(world, rel=1e-12) and tight < world * (1 - 1e-5)


def test_a_distributing_coupling_by_its_element_is_one_by_its_surface(tmp_path):
    face = "*SURFACE, NAME=FACE, TYPE=NODE\nTIP, 1.\n*COUPLING, CONSTRAINT NAME=C, REF NODE=9999, SURFACE=FACE\n"
    element = "*ELEMENT, TYPE=DCOUP3D, ELSET=D\n800, 9999\n*DISTRIBUTING COUPLING, ELSET=D\nTIP, 1.\n"
    wanted = frequencies(deck(tmp_path, brick() + TIP_MASS + face + "*DISTRIBUTING\n"))
    assert frequencies(deck(tmp_path, brick() + TIP_MASS + element)) == pytest.approx(wanted, rel=1e-9)


@pytest.mark.parametrize(
    ("more", "words"),
    [
        ("*MPC\nSLIDER, 5, 4\n", "*MPC SLIDER"),
        ("*EQUATION, REMOVE\n", "*EQUATION, REMOVE"),
        ("*BOUNDARY, TYPE=VELOCITY\n5, 1, 1, 3.\n", "*BOUNDARY, VELOCITY"),
        ("*BOUNDARY\n5, 11, 11, 20.\n", "*BOUNDARY of other components"),
        ("*BOUNDARY\n5, 2, 2, 0.5\n", "*BOUNDARY that is not zero"),
        ("*ELEMENT, TYPE=SPRING1, ELSET=S\n90, 5\n*SPRING, ELSET=S, NONLINEAR\n1\n0., 0.\n1., 1.\n",
         "NONLINEAR of *SPRING"),
        ("*ELEMENT, TYPE=SPRING1, ELSET=S\n90, 5\n*SPRING, ELSET=S\n1\n0.\n", "springs of stiffness 0 are left out"),
    ],
)  # fmt: skip
def test_what_is_left_out_is_reported(tmp_path, more, words):
    assert words in said(tmp_path, beam("RECT", "10., 20.", n=4) + more)


@pytest.mark.parametrize(
    ("more", "sentence"),
    [
        ("*MPC\nBEAM, 5, 4, 3\n*TIE, NAME=T\nA, B\n", r"surface 'A' is not in the deck; it has \[\]"),
        ("*EQUATION\n3\n5, 1, 1., 4, 1, -1.\n", r"an equation of 3 terms has 2 of them"),
        (
            "*EQUATION\n2\n5, 1, 0., 4, 1, -1.\n",
            r"the first term of an equation is the dependent component; found factor 0",
        ),
        ("*EQUATION\n2\n5, 1, 1., 4, 9, -1.\n", r"component 9 of an equation is not one of 1 to 6"),
        ("*BOUNDARY\n5\n", r"\*BOUNDARY names no component of '5'; give 1 to 6"),
        ("*DISTRIBUTING COUPLING, ELSET=BOOMS\n5, 1.\n", r"BOOMS"),
        (
            "*ELEMENT, TYPE=MASS, ELSET=M\n90, 5\n*MASS, ELSET=M\n-1.\n",
            r"the mass is -1000 kg; a mass cannot be negative",
        ),
        ("*ELEMENT, TYPE=SPRINGA, ELSET=S\n90, 4, 5\n*SPRING, ELSET=S\n\n", r"\*SPRING has no stiffness; give one"),
    ],
)
def test_mistakes_are_one_sentence_with_their_line(tmp_path, more, sentence):
    with pytest.raises(DeckError, match=sentence):
        deck(tmp_path, beam("RECT", "10., 20.", n=4) + more)


# Sections


def test_a_square_needs_one_number_and_a_t_lies_on_its_nodes_with_an_offset(tmp_path):
    square = frequencies(deck(tmp_path, beam("RECT", "20.\n0., 1., 0.", kind="B33")))
    assert square[0] == pytest.approx(clamped(0.02**4 / 12, 4e-4), rel=2e-3)
    # b, h, l, tf, tw with the node at the centroid: bending across the web's plane as of the shape alone
    b, h, tf, tw = 20.0, 30.0, 4.0, 3.0
    parts = [((h - tf) / 2, tw * (h - tf)), (h - tf / 2, b * tf)]
    A = sum(area for _, area in parts)
    centroid = sum(y * area for y, area in parts) / A
    across = (tf * b**3 + (h - tf) * tw**3) / 12
    made = deck(tmp_path, beam("T", f"{b}, {h}, {centroid}, {tf}, {tw}\n0., 1., 0.", kind="B31"))
    assert frequencies(made)[0] == pytest.approx(clamped(across * 1e-12, A * 1e-6), rel=5e-3)
    upright = tw * (h - tf) ** 3 / 12 + b * tf**3 / 12 + sum(area * (y - centroid) ** 2 for y, area in parts)
    found = frequencies(made, 6)
    wanted = clamped(upright * 1e-12, A * 1e-6)
    assert np.abs(found / wanted - 1).min() < 1e-2


@pytest.mark.parametrize(
    ("section", "data", "sentence"),
    [
        ("RECT", "10., -20.", r"RECT"),
        (
            "GENERAL",
            "200., 6666., 0.\n0., 1., 0.\n210000., 80769.",
            r"SECTION=GENERAL has 3 values; give A, I11, I12, I22 and J",
        ),
        (
            "GENERAL",
            "200., 6666., 0., 1666., 4577.\n0., 1., 0.\n",
            r"\*BEAM GENERAL SECTION has 0 moduli on its third line; give E, G",
        ),
        (
            "GENERAL",
            "-200., 6666., 0., 1666., 4577.\n0., 1., 0.\n210000., 80769.",
            r"a beam section has A = -0.0002 m\^2",
        ),
        ("RECT", "10., 20.\n1., 0., 0.", r"beam 1 has its direction n1 along its axis; give another"),
    ],
)
def test_mistakes_in_beam_sections_are_one_sentence(tmp_path, section, data, sentence):
    text = beam(section, data, n=4)
    if section == "GENERAL":
        text = text.replace("*BEAM SECTION", "*BEAM GENERAL SECTION, DENSITY=7.85E-9").replace(", MATERIAL=STEEL", "")
    with pytest.raises(DeckError, match=sentence):
        deck(tmp_path, text)


@pytest.mark.parametrize(
    ("section", "more", "sentence"),
    [
        ("*SHELL SECTION, ELSET=SKIN, MATERIAL=STEEL, OFFSET=TOP\n4.", "",
         r"OFFSET=TOP is not read; give SPOS, SNEG or a number"),
        ("*SHELL SECTION, ELSET=SKIN, COMPOSITE\n0., 3, STEEL, 0.", "",
         r"COMPOSITE has no plies, or one without thickness"),
        ("*SHELL SECTION, ELSET=SKIN, MATERIAL=STEEL\n0.", "", r"the thickness of ELSET 'SKIN' is 0 m; give one"),
        ("*SHELL GENERAL SECTION, ELSET=SKIN\n1., 2., 3.", "", r"\*SHELL GENERAL SECTION has 3 stiffnesses; give 21"),
        ("*SHELL SECTION, ELSET=SKIN, MATERIAL=STEEL, ORIENTATION=X\n4.", "", r"orientation 'X' is not in the deck"),
        ("*SHELL SECTION, ELSET=SKIN, MATERIAL=STEEL, ORIENTATION=X\n4.",
         "*ORIENTATION, NAME=X\n1., 0., 0., 2., 0., 0.\n", r"which give no directions, as they lie on a line"),
        ("*SHELL SECTION, ELSET=SKIN, MATERIAL=GAS\n4.",
         "*MATERIAL, NAME=GAS\n*ELASTIC, TYPE=TRACTION\n1.\n", r"TYPE=TRACTION, which is not read"),
    ],
)  # fmt: skip
def test_mistakes_in_shell_sections_are_one_sentence(tmp_path, section, more, sentence):
    with pytest.raises(DeckError, match=sentence):
        deck(tmp_path, plate(section, more))


def test_solids_of_plies_and_materials_of_sheets_are_refused(tmp_path):
    with pytest.raises(DeckError, match=r"\*SOLID SECTION, COMPOSITE is not read; give a shell section"):
        deck(tmp_path, brick(", COMPOSITE"))
    sheet = "*MATERIAL, NAME=STEEL\n*ELASTIC, TYPE=LAMINA\n150000., 9000., 0.3, 5000., 5000., 3000.\n*DENSITY\n1.6E-9\n"
    with pytest.raises(DeckError, match=r"material 'STEEL' is a lamina; solids need ENGINEERING CONSTANTS"):
        deck(tmp_path, brick(material=sheet))


def test_densities_are_those_of_the_deck(tmp_path):
    """The whole mass of 100 x 10 x 10 mm of steel."""
    assert f"mass {RHO * 1e-5:.3g} kg" in said(tmp_path, brick())


@pytest.mark.parametrize(("angle", "axis"), [(30.0, "3"), (-30.0, "3"), (60.0, "1")])
def test_the_angle_of_an_orientation_turns_the_material_of_a_shell_about_its_normal(tmp_path, angle, axis):
    """Direction 1 on a plate z = 0: the axis after the one that is named, turned from it towards the normal x it."""
    lamina = (
        "*MATERIAL, NAME=CARBON\n*ELASTIC, TYPE=LAMINA\n150000., 9000., 0.3, 5000., 5000., 3000.\n*DENSITY\n1.6E-9\n"
    )
    system = f"*ORIENTATION, NAME=O\n{{}}\n{axis}, {angle}\n"
    axes = {"3": "1., 0., 0., 0., 1., 0.", "1": "0., 0., 1., 1., 0., 0."}[axis]  # the named axis is z in both
    shell = "*SHELL SECTION, ELSET=SKIN, COMPOSITE{}\n4., 3, CARBON, {}\n"
    turned = deck(tmp_path, plate(shell.format(", ORIENTATION=O", 0), lamina + system.format(axes)))
    plain = deck(tmp_path, plate(shell.format("", angle), lamina))
    found, wanted = (axes_and_bending(one) for one in (turned, plain))
    assert found == pytest.approx(wanted, rel=1e-6, abs=1e-6 * np.abs(wanted).max())


def axes_and_bending(made):
    """D of the plate's section in mesh axes x, y [N m]."""
    member = made.members[0]
    first = np.asarray(member.options.get("axis", (1.0, 0.0, 0.0)), float)
    c, s = first[0], first[1]
    T = np.array([[c * c, s * s, c * s], [s * s, c * c, -c * s], [-2 * c * s, 2 * c * s, c * c - s * s]])
    return T.T @ member.section.D @ T
