"""Lines that few Abaqus decks have: defaults, blank words, sets and surfaces of other scopes, what is left out."""

from __future__ import annotations

import re

import numpy as np
import pytest
from test_abaqus_matrices import (
    AT,
    CHAIN,
    FIBRE,
    LINE,
    MASS,
    METAL,
    NODES,
    PATCH,
    SECOND,
    E,
    F,
    G,
    L,
    T,
    axes_of,
    deck,
    held,
    lumps,
    motions,
    part,
    rects,
    rigid,
    structure_of,
)

from femflex.decks import DeckError, read_deck
from femflex.decks.abaqus.sections import _default_axis
from femflex.mesh import read_mesh

INERTIA = "*ELEMENT, TYPE=MASS, ELSET=M\n11, 2\n*MASS, ELSET=M\n1.\n*ELEMENT, TYPE=ROTARYI, ELSET=J\n13, 2\n"
INERTIA += "*ROTARY INERTIA, ELSET=J, ORIENTATION=O\n5., 6., 7., .2, -.3, .4\n"
BEAM = "*BEAM SECTION, SECTION=RECT, ELSET=B, MATERIAL={}\n.8, 1.4\n.2, 1., .3\n"


def left_out(made) -> list[str]:
    return [str(one) for one in made.unused]


def test_the_default_of_a_distribution_of_orientations_is_used_and_said(tmp_path):
    text = NODES + "*ORIENTATION, NAME=O\nVARYING\n2., 1., .5, -1., 3., .2\n3, 20.\n" + INERTIA
    made = deck(tmp_path, text)
    plain = deck(tmp_path, text.replace("VARYING\n", ""))
    assert np.asarray(made.point_masses[0].inertia) == pytest.approx(np.asarray(plain.point_masses[0].inertia))
    assert "model.inp, line 7: a distribution of orientations is left out; its default is used" in made.notes
    assert not any("distribution" in note for note in plain.notes)
    wanted = "model.inp, line 7: *ORIENTATION by *DISTRIBUTION alone has no directions; give points."
    with pytest.raises(DeckError, match=re.escape(wanted)):
        deck(tmp_path, NODES + "*ORIENTATION, NAME=O\nVARYING\n" + INERTIA)


def test_an_orientation_by_nodes_is_not_moved_with_its_instance_again(tmp_path):
    """Nodes 1, 2 and 3 as points a, b and c, in an instance turned by 90 deg about z: (x, y, z) -> (-y, x, z)."""
    body = NODES + "*ORIENTATION, NAME=O, DEFINITION=NODES\n1, 2, 3\n3, 0.\n" + INERTIA
    text = f"*PART, NAME=A\n{body}*END PART\n*ASSEMBLY, NAME=S\n*INSTANCE, NAME=I, PART=A\n0., 0., 0.\n"
    text += "0., 0., 0., 0., 0., 1., 90.\n*END INSTANCE\n*END ASSEMBLY\n"
    x = np.array([[-AT[n][1], AT[n][0], AT[n][2]] for n in (1, 2, 3)])
    C = axes_of(x[0] - x[2], x[1] - x[2])
    J = np.array([[5.0, 0.2, -0.3], [0.2, 6.0, 0.4], [-0.3, 0.4, 7.0]])
    found = np.asarray(deck(tmp_path, text).point_masses[0].inertia)
    assert found == pytest.approx(C.T @ J @ C * MASS * L**2, rel=1e-9)


def test_a_general_section_with_a_shape_is_that_shape_of_its_moduli(tmp_path):
    """The moduli of the third line, not those of a material; mass by DENSITY; the centroid off the nodes."""
    text = LINE.format(kind="B31") + "*BEAM GENERAL SECTION, SECTION=T, ELSET=B, DENSITY=3.E-4\n"
    (member,) = deck(tmp_path, text + "1.2, 2., 0.6, 0.2, 0.1\n.2, 1., .3\n2.E7, 7.E6\n").members
    A, centre, I = rects((-0.05, 0.05, -0.6, 1.2), (-0.6, 0.6, 1.2, 1.4))
    s = member.section
    assert [s.EA, s.GAy, s.GAz] == pytest.approx([2e7 * A * F, 0.44 * 7e6 * A * F, 0.44 * 7e6 * A * F])
    assert [s.EIz, s.EIy] == pytest.approx([2e7 * I[1, 1] * F * L**2, 2e7 * I[0, 0] * F * L**2])
    assert s.mass_per_length == pytest.approx(3e-4 * A * MASS / L)
    y = np.asarray(member.options["orientation"])
    offset = np.asarray(member.options["offset"]) @ np.array([y, np.cross(T, y)])
    assert offset == pytest.approx(centre[1] * L * SECOND, abs=1e-12)


def test_beams_and_trusses_of_fibres_have_their_first_modulus(tmp_path):
    """E1 and G12 of a lamina and of engineering constants; of a matrix those of its inverse."""
    words = "9.E6, 8.E6, 7.E6, .21, .22, .23, 3.E6, 2.E6,\n1.E6"
    S = np.zeros((6, 6))
    S[:3, :3] = [[1 / 9e6, -0.21 / 9e6, -0.22 / 9e6], [0, 1 / 8e6, -0.23 / 8e6], [0, 0, 1 / 7e6]]
    S = S + np.triu(S, 1).T
    S[3:, 3:] = np.diag([1 / 3e6, 1 / 2e6, 1 / 1e6])  # 12, 13, 23
    C = np.linalg.inv(S)
    nine = [f"{C[p]:.12g}" for p in ((0, 0), (0, 1), (1, 1), (0, 2), (1, 2), (2, 2), (3, 3), (4, 4), (5, 5))]
    given = {
        "TYPE=LAMINA\n2.E7, 1.5E6, .28, 7.E5, 6.E5, 4.E5": (2e7, 7e5),
        f"TYPE=ENGINEERING CONSTANTS\n{words}": (9e6, 3e6),
        f"TYPE=ORTHO\n{', '.join(nine[:8])}\n{nine[8]}": (9e6, 3e6),
    }
    for material, (e, g) in given.items():
        stuff = f"*MATERIAL, NAME=X\n*ELASTIC, {material}\n*DENSITY\n3.E-4\n"
        (member,) = deck(tmp_path, LINE.format(kind="B31") + stuff + BEAM.format("X")).members
        s = member.section
        assert [s.EA, s.GAy, s.mass_per_length] == pytest.approx(
            [e * 1.12 * F, 0.85 * g * 1.12 * F, 3e-4 * 1.12 * MASS / L], rel=1e-6
        )
        truss = LINE.format(kind="T3D2") + stuff + "*SOLID SECTION, ELSET=B, MATERIAL=X\n.5\n"
        assert deck(tmp_path, truss).members[0].section.EA == pytest.approx(0.5 * e * F, rel=1e-6)


def test_plies_of_a_matrix_and_of_engineering_constants_are_the_lamina_of_their_numbers(tmp_path):
    """G13 and G23 each keep their place in the transverse shear stiffness: 5/6 of G t for one ply."""
    S = np.diag([1 / 9e6, 1 / 8e6, 1 / 7e6, 1 / 3e6, 1 / 2e6, 1 / 1e6])
    S[0, 1] = S[1, 0] = -0.21 / 9e6
    C = np.linalg.inv(S)
    nine = [f"{C[p]:.12g}" for p in ((0, 0), (0, 1), (1, 1), (0, 2), (1, 2), (2, 2), (3, 3), (4, 4), (5, 5))]
    texts = [
        f"TYPE=ORTHO\n{', '.join(nine[:8])}\n{nine[8]}",
        "TYPE=ENGINEERING CONSTANTS\n9.E6, 8.E6, 7.E6, .21, 0., 0., 3.E6, 2.E6,\n1.E6",
        "TYPE=LAMINA\n9.E6, 8.E6, .21, 3.E6, 2.E6, 1.E6",
    ]
    d = 1 - 0.21**2 * 8 / 9
    Q = np.array([[9e6 / d, 0.21 * 8e6 / d, 0], [0.21 * 8e6 / d, 8e6 / d, 0], [0, 0, 3e6]])
    for text in texts:
        stuff = f"*MATERIAL, NAME=X\n*ELASTIC, {text}\n*DENSITY\n1.E-4\n"
        section = "*SHELL SECTION, ELSET=P, COMPOSITE\n, , , \n.05, 3, X, 0.\n"  # a line without a material is none
        s = deck(tmp_path, PATCH + stuff + section).members[0].section
        assert s.A == pytest.approx(Q * 0.05 * F / L, abs=1e-6 * Q.max() * 0.05 * F / L)
        assert s.S == pytest.approx(5 / 6 * np.diag([2e6, 1e6]) * 0.05 * F / L, rel=1e-6, abs=1e-3)


def test_surfaces_and_sets_are_found_from_other_scopes(tmp_path):
    """A coupling of the assembly names a surface of its only instance, a set of nodes, or INSTANCE.SURFACE."""
    body = NODES + lumps(1, 2, 3, 4, 5) + "*NSET, NSET=S\n1, 3\n*SURFACE, NAME=FACE, TYPE=NODE\n\nS,\n2\n"
    head = f"*PART, NAME=A\n{body}*END PART\n*ASSEMBLY, NAME=Z\n*INSTANCE, NAME=I, PART=A\n*END INSTANCE\n"
    for name, nodes in (("FACE", (1, 2, 3)), ("I.FACE", (1, 2, 3)), ("I.S", (1, 3))):
        text = f"{head}*COUPLING, CONSTRAINT NAME=C, REF NODE=I.4, SURFACE={name}\n*KINEMATIC\n*END ASSEMBLY\n"
        made = deck(tmp_path, text)
        (one,) = made.connections
        number = {row: n for n, row in made.points_of_ids.items()}
        assert {number[row] for row in made.mesh.group_points(one.group)} == set(nodes), name
        for node in nodes:
            assert part(made, node, "123456") == pytest.approx(rigid(node, 4) @ motions(structure_of(made), made, 4))
    wanted = "*COUPLING, CONSTRAINT NAME=C, REF NODE=I.4, SURFACE=BACK\n*KINEMATIC\n"
    with pytest.raises(DeckError, match=r"surface 'BACK' is not in the deck; it has \['FACE'\]"):
        deck(tmp_path, f"{head}{wanted}*END ASSEMBLY\n")


def test_a_surface_takes_whole_elements_that_are_no_cells(tmp_path):
    """Both nodes of a spring, and the nodes of a shell whichever face is named."""
    text = PATCH.replace("*ELEMENT", "9, 5., 5., 5.\n10, 6., 5., 5.\n*ELEMENT") + METAL
    text += "*SHELL SECTION, ELSET=P, MATERIAL=METAL\n.1\n*ELEMENT, TYPE=SPRINGA, ELSET=S\n7, 10, 3\n"
    text += "*SPRING, ELSET=S\n\n5.\n*SURFACE, NAME=A\nS, S1\n*SURFACE, NAME=B\nP, SPOS\n*SURFACE, NAME=D\nP, E2\n"
    text += "*COUPLING, CONSTRAINT NAME=C, REF NODE=9, SURFACE={}\n*KINEMATIC\n1, 3\n"
    for name, nodes in (("A", {3, 10}), ("B", {1, 2, 3, 4}), ("D", {2, 3})):
        made = deck(tmp_path, text.format(name))
        number = {row: n for n, row in made.points_of_ids.items()}
        assert {number[row] for row in made.mesh.group_points(made.connections[0].group)} == nodes
        assert made.connections[0].components == ("x", "y", "z")


def test_couplings_without_components_hold_all_six(tmp_path):
    text = NODES + lumps(1, 2, 4, 5) + "*KINEMATIC COUPLING, REF NODE=4\n1, ,\n2, 5\n"
    made = deck(tmp_path, text)
    found = {one.components for one in made.connections}
    assert found == {("x", "y", "z", "rx", "ry", "rz"), ("ry",)}
    assert part(made, 1, "123456") == pytest.approx(rigid(1, 4) @ motions(structure_of(made), made, 4))
    assert part(made, 2, "5") == pytest.approx((rigid(2, 4) @ motions(structure_of(made), made, 4))[4:5])


def test_the_reference_of_a_coupling_is_none_of_its_own_nodes(tmp_path):
    """The set names the reference too; alone in it, it couples nothing."""
    text = NODES + lumps(1, 2, 3, 4) + "*SURFACE, NAME=F, TYPE=NODE\n1\n2\n3\n4\n*SURFACE, NAME=SELF, TYPE=NODE\n4\n"
    text += "*COUPLING, CONSTRAINT NAME=C, REF NODE=4, SURFACE={}\n*DISTRIBUTING\n"
    made = deck(tmp_path, text.format("F"))
    (one,) = made.connections
    number = {row: n for n, row in made.points_of_ids.items()}
    assert {number[row] for row in made.mesh.group_points(one.group)} == {1, 2, 3}
    assert deck(tmp_path, text.format("SELF")).connections == ()


SPRING = "*ELEMENT, TYPE=SPRINGA, ELSET=S\n71, 1, 2\n*SPRING, ELSET=S\n\n50.\n"
FACED = "*SURFACE, NAME=F, TYPE=NODE\n2\n*COUPLING, CONSTRAINT NAME=C, REF NODE=3, SURFACE=F\n"


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ("*TIE, NAME=T, CYCLIC SYMMETRY=YES\n1, 2\n",
         "1 *TIE, CYCLIC SYMMETRY: the structure is the sector that the deck holds, with free sides (first at {}:27)"),
        ("*MATERIAL, NAME=Y\n*ELASTIC\n1.E7, .3, 20.\n.9E7, .3, 90.\n",
         "1 *ELASTIC at further temperatures: the values of the first line are used (first at {}:28)"),
        ("*BOUNDARY\n1, 1, 6\n2, 11\n3, 8, 11\n",
         "2 *BOUNDARY of other components: temperatures and pressures are left out (first at {}:29)"),
        ("*BOUNDARY\n1, 1, 6\n2, 3, 3, .5\n",
         "1 *BOUNDARY that is not zero: the component is held at zero; prescribe motion in the case (first at {}:29)"),
        ("*BOUNDARY, TYPE=VELOCITY\n1, 1, 6\n",
         "1 *BOUNDARY, VELOCITY: prescribed motion is left out; prescribe it in the case (first at {}:27)"),
        ("*BOUNDARY, SUBMODEL\n1, 1\n",
         "1 *BOUNDARY, SUBMODEL: prescribed motion is left out; prescribe it in the case (first at {}:27)"),
        ("*EQUATION, REMOVE\n1\n", "1 *EQUATION, REMOVE: the equations stay (first at {}:27)"),
        ("*MPC\nSLIDER, 3, 4, 5\nBEAM, 3, 4, 5\n",
         "1 *MPC SLIDER: it is left out; parts may be unconnected (first at {}:28)"),
        ("*KINEMATIC\n1, 3\n",
         "1 *KINEMATIC: a *COUPLING and one *KINEMATIC or *DISTRIBUTING after it make a coupling; parts may be "
         "unconnected (first at {}:27)"),
        (FACED + "*KINEMATIC\n*DISTRIBUTING\n",
         "1 *DISTRIBUTING: a *COUPLING and one *KINEMATIC or *DISTRIBUTING after it make a coupling; parts may be "
         "unconnected (first at {}:31)"),
        (FACED + FACED + "*DISTRIBUTING\n" + FACED,
         "2 *COUPLING: a *COUPLING and one *KINEMATIC or *DISTRIBUTING after it make a coupling; parts may be "
         "unconnected (first at {}:29)"),
        ("*SPRING, ELSET=B, NONLINEAR\n\n1., 2.\n",
         "1 NONLINEAR of *SPRING: the spring is left out (first at {}:27)"),
        ("*CONTACT PAIR\nA, B\n",
         "1 *CONTACT PAIR: contact is left out; the parts are not joined there (first at {}:27)"),
        ("*CRACK LENGTH\n*CRACK LENGTH\n", "2 *CRACK LENGTH: it is not understood and left out (first at {}:27)"),
        ("*MATERIAL, NAME=Y\n*ELASTIC\n1.E7, .3\n*PLASTIC\n1., 0.\n",
         "1 *PLASTIC: the material stays linear (first at {}:30)"),
        ("*ELEMENT, TYPE=COH2D4, ELSET=X\n61, 1, 2, 3, 4\n62, 1, 2, 3, 5\n",
         "2 elements COH2D4: cohesive elements are left out: the parts are not connected there; join them by *TIE "
         "(first at {}:28)"),
        ("*ELEMENT, TYPE=U7, ELSET=X\n61, 1, 2\n",
         "1 elements U7: user elements are left out: their stiffness is in a subroutine; export it by *MATRIX GENERATE "
         "(first at {}:28)"),
        ("*ELEMENT, TYPE=CONN3D2, ELSET=X\n61, 1, 2\n",
         "1 elements CONN3D2: connectors are left out: the parts may be unconnected; join them by *COUPLING, *MPC or "
         "*SPRING (first at {}:28)"),
        ("*ELEMENT, TYPE=GAPUNI, ELSET=X\n61, 1, 2\n",
         "1 elements GAPUNI: elements of this type are left out; the parts that they join may be unconnected "
         "(first at {}:28)"),
        ("*ELEMENT, TYPE=CPE4, ELSET=X\n61, 1, 2, 3, 4\n",
         "1 elements CPE4: plane elements are left out: they do not move out of their plane; model the sheet by shells "
         "(S4R with a *SHELL SECTION of its thickness) (first at {}:28)"),
        ("*ELEMENT, TYPE=CAX4, ELSET=X\n61, 1, 2, 3, 4\n",
         "1 elements CAX4: axisymmetric elements are left out: a body has three dimensions; model the whole body of "
         "revolution (first at {}:28)"),
    ],
)  # fmt: skip
def test_what_a_structure_is_made_without_is_counted_with_its_first_line(tmp_path, text, line):
    """The text begins at line 27, and the beams before it stay."""
    assert CHAIN.count("\n") == 26
    made = deck(tmp_path, CHAIN + text)
    assert line.format("model.inp") in left_out(made)


def test_lines_that_name_nothing_are_passed_over(tmp_path):
    """A blank first word of *BOUNDARY; an element set without cells under a section; a mass of 0."""
    made = deck(
        tmp_path, CHAIN + "*BOUNDARY\n, 1, 6\n2, 3\n*ELSET, ELSET=VOID\n" + BEAM.format("METAL").replace("=B", "=VOID")
    )
    assert held(made) == {2: "3"}
    place = CHAIN.count("\n") + 5
    note = f"model.inp, line {place}: ELSET 'VOID' of *BEAM SECTION has no elements that are cells"
    assert note in made.notes
    text = (
        NODES + "*ELEMENT, TYPE=MASS, ELSET=M\n11, 1\n*ELEMENT, TYPE=MASS, ELSET=Z\n12, 2\n*MASS, ELSET=M\n1.\n"
        "*MASS, ELSET=Z\n0.\n"
    )
    assert [float(one.mass) for one in deck(tmp_path, text).point_masses] == pytest.approx([MASS])


@pytest.mark.parametrize(
    ("line", "second"),
    [  # n2 = t x n1, where n1 is (0, 0, -1) unless the beam lies along it, and (0, 1, 0) then
        ("2, 2., 0., 0.", (0.0, 1.0, 0.0)),
        ("2, 0., 0., 2.", (-1.0, 0.0, 0.0)),
        ("2, 0., 0., -2.", (1.0, 0.0, 0.0)),
        ("2, 0., 2., 0.", (-1.0, 0.0, 0.0)),
    ],
)
def test_the_default_direction_of_a_beam_is_against_z_or_along_y(tmp_path, line, second):
    text = f"*NODE\n1, 0., 0., 0.\n{line}\n*ELEMENT, TYPE=B31, ELSET=B\n1, 1, 2\n" + METAL
    text += "*BEAM SECTION, SECTION=RECT, ELSET=B, MATERIAL=METAL\n.8, 1.4\n"
    (member,) = deck(tmp_path, text).members
    assert np.asarray(member.options["orientation"]) == pytest.approx(second, abs=1e-12)
    assert member.section.EIz == pytest.approx(E * 0.8 * 1.4**3 / 12 * F * L**2)


def test_a_shell_that_stands_on_x_has_its_axis_along_z(tmp_path):
    """Normal within 0.1 deg of x: direction 1 is z laid into the shell; farther off it is x."""
    for degrees, axis in ((0.05, (0, 0, 1.0)), (2.0, None)):
        c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
        nodes = (
            f"*NODE\n1, 0., 0., 0.\n2, {-2 * s:.9f}, {2 * c:.9f}, 0.\n3, {-2 * s:.9f}, {2 * c:.9f}, 1.\n4, 0., 0., 1.\n"
        )
        text = nodes + "*ELEMENT, TYPE=S4, ELSET=P\n1, 1, 2, 3, 4\n" + FIBRE
        (member,) = deck(tmp_path, text + "*SHELL SECTION, ELSET=P, COMPOSITE\n.05, 3, CF, 0.\n").members
        wanted = axis if axis is not None else (s, -c, 0.0)
        assert np.asarray(member.options["axis"]) == pytest.approx(wanted, abs=1e-6)


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("*NSET, NSET=P\n*BOUNDARY\nP, 1\n", "*BOUNDARY names 'P', which holds no node of the deck; correct it."),
        ("*ELSET, ELSET=D\n*DISTRIBUTING COUPLING, ELSET=D\n1\n",
         "*DISTRIBUTING COUPLING names no DCOUP3D element; give one."),
        ("*ELEMENT, TYPE=MASS, ELSET=M\n91, 77\n*MASS, ELSET=M\n1.\n",
         "element 91 uses node 77, which no *NODE block defines"),
        ("*BOUNDARY\n1\n", "*BOUNDARY names no component of '1'; give 1 to 6."),
        ("*EQUATION\n3\n1, 1, 1., 2, 1, -1.\n", "an equation of 3 terms has 2 of them."),
        ("*EQUATION\n2\n1, 1, 1., 2, 7, -1.\n", "component 7 of an equation is not one of 1 to 6."),
        ("*MPC\nBEAM, 3, 4\n*MPC\nPIN, 3, 5\n",
         "*MPC PIN of node 3 makes component 1 of node 3 dependent, which *MPC BEAM of node 3 does already; make it "
         "dependent once"),
        ("*NODE\n30, 4., 0., .1\n*NODE\n31, 5., 0., .1\n*TIE, NAME=T\nA, C\n*SURFACE, NAME=A, TYPE=NODE\n30\n31\n4\n"
         "*SURFACE, NAME=C, TYPE=NODE\n4\n5\n",
         "*TIE of 'A' to 'C': 2 of 3 nodes, the first is 30, have no node of the other surface at their place"),
        ("*ELEMENT, TYPE=MASS, ELSET=M\n91, 7\n*MASS, ELSET=M\n-2.\n",
         f"the mass is {-2 * MASS:.6g} kg; a mass cannot be negative."),
    ],
)  # fmt: skip
def test_mistakes_that_name_nodes_and_sets_say_which(tmp_path, text, sentence):
    with pytest.raises(DeckError, match=re.escape(sentence)):
        deck(tmp_path, CHAIN + text)


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        (LINE.format(kind="B33") + METAL + "*BEAM SECTION, SECTION=L, ELSET=B, MATERIAL=METAL\n1.5, 1.1, .2, .1\n",
         "model.inp, line 5: a beam off its nodes needs shear; give elements B31 or B32."),
        (LINE.format(kind="B31") + METAL + "*BEAM SECTION, SECTION=RECT, ELSET=B, MATERIAL=METAL\n",
         "model.inp, line 11: SECTION=RECT has dimensions [] m; give 2, none negative."),
        (LINE.format(kind="B31") + METAL + "*BEAM SECTION, SECTION=PIPE, ELSET=B, MATERIAL=METAL\n.5\n",
         "model.inp, line 11: SECTION=PIPE has dimensions [0.0127] m; give 2, none negative."),
        (LINE.format(kind="B31") + METAL + "*BEAM SECTION, SECTION=HEX, ELSET=B, MATERIAL=METAL\n1., 2.\n",
         "SECTION=HEX is not read; known are RECT, CIRC, PIPE, THICK PIPE, BOX, I, T, L and, in *BEAM GENERAL SECTION, "
         "GENERAL with A, I11, I12, I22 and J."),
        (PATCH + "*SHELL GENERAL SECTION, ELSET=P, USER\n1.\n",
         "model.inp, line 8: *SHELL GENERAL SECTION, USER has its stiffness in a subroutine; give 21 stiffnesses, "
         "MATERIAL or COMPOSITE."),
        (PATCH.replace("3, 2.2, 1.5, 0.", "3, 4., .6, 0.").replace("S4", "S3").replace("1, 1, 2, 3, 4", "1, 1, 2, 3")
         + METAL + "*SHELL SECTION, ELSET=P, MATERIAL=METAL\n.1\n",
         "model.inp, line 7: shell 1 has no area; correct its nodes."),
        (NODES, "model.inp has no elements; there is no structure to make"),
        (LINE.format(kind="B31") + METAL + "*MATERIAL, NAME=GAS\n*HYPERELASTIC\n1., 2.\n" + BEAM.format("GAS"),
         "material 'GAS' (model.inp, line 11) has *HYPERELASTIC and no *ELASTIC, which alone is read; give one."),
        (LINE.format(kind="B31") + METAL + BEAM.format("IRON"),
         "material 'IRON' is not in the deck; it has ['METAL']."),
        (LINE.format(kind="B31") + METAL.replace(f"{E}, ", "-5., ") + BEAM.format("METAL"),
         "moduli must be positive and the density not negative."),
        (LINE.format(kind="B31") + METAL,
         "1 elements of type B31, the first is 1, have no section; give one for an ELSET with "
         "them (*BEAM SECTION) [model.inp, line 5]"),
        (PATCH + METAL, "1 elements of type S4, the first is 1, have no section; give one for an ELSET with them "
         "(*SHELL SECTION) [model.inp, line 7]"),
        (PATCH + METAL + BEAM.format("METAL").replace("=B", "=P"),
         "model.inp, line 13: *BEAM SECTION is for other elements than those of ELSET 'P' (S4); give the section of "
         "their kind."),
        (PATCH + METAL + "*SOLID SECTION, ELSET=P, MATERIAL=METAL\n.1\n",
         "model.inp, line 13: *SOLID SECTION is for other elements than those of ELSET 'P' (S4); give the section of "
         "their kind."),
    ],
)  # fmt: skip
def test_mistakes_in_sections_say_what_is_wrong_and_where(tmp_path, text, sentence):
    with pytest.raises(DeckError, match=re.escape(sentence)):
        deck(tmp_path, text)


def test_an_override_of_a_value_that_a_section_has_not_is_refused(tmp_path):
    text = LINE.format(kind="T3D2") + METAL + "*SOLID SECTION, ELSET=B, MATERIAL=METAL\n.5\n"
    with pytest.raises(DeckError, match=r"override of 'B' names 'width'; it has \['area'\]"):
        deck(tmp_path, text, B={"width": 1.0})
    with pytest.raises(DeckError, match=r"override of 'METAL' names 'G'; it has \['E', 'density', 'nu'\]"):
        deck(tmp_path, text, METAL={"G": 1.0})


def test_units_of_a_spring_and_of_a_mass_without_rotation_are_those_of_the_deck(tmp_path):
    """Two nodes 3 in apart, joined by 50 lbf/in: k = 50 F / L along their line; each node weighs 1.5."""
    path = tmp_path / "model.inp"
    path.write_text(
        "*NODE\n1, 0., 0., 0.\n2, 3., 0., 0.\n*ELEMENT, TYPE=MASS, ELSET=M\n11, 1\n12, 2\n*MASS, ELSET=M\n1.5\n"
        + SPRING
    )
    structure = read_deck(path, "in-lbf-s").structure()
    assert structure.M.toarray() == pytest.approx(1.5 * MASS * np.eye(6))
    K = structure.K.toarray()
    x = np.abs(structure.translation.toarray()[[0, 3]]).argmax(axis=1)
    assert K[np.ix_(x, x)] == pytest.approx(50 * F / L * np.array([[1, -1], [-1, 1]]))
    assert np.abs(K).sum() == pytest.approx(4 * 50 * F / L)
    assert G == E / 2.5  # of the steel of the other tests


def test_keywords_of_every_kind_that_is_left_out_say_what_that_changes(tmp_path):
    """One of each kind, of each behaviour of a material, and what else stands under *MATERIAL."""
    said = {
        "DLOAD": "loads are left out; give them in the case",
        "CONTACT DAMPING": "contact is left out; the parts are not joined there",
        "CONNECTOR SECTION": "connectors are left out; the parts may be unconnected",
        "EMBEDDED ELEMENT": "the parts that it joins are not connected",
        "MODAL DAMPING": "damping is left out; give it in the case",
        "CYCLIC SYMMETRY MODEL": "the structure is taken as the deck gives it, not as a sector of one",
        "USER ELEMENT": "the elements have the stiffness of their sections",
        "REBAR LAYER": "rebars are left out",
        "MODEL CHANGE": "elements stay in the model",
        "DISTRIBUTION": "a distribution of values is left out; the default is used",
        "IMPERFECTION": "imperfections are left out; the mesh is perfect",
        "TORQUE PRINT": "it is not understood and left out",
    }
    behaviour = {
        "HYPERFOAM": "the material needs *ELASTIC here",
        "CREEP": "the material stays linear",
        "VISCOELASTIC": "the material stays elastic",
        "EXPANSION": "thermal strains are left out",
        "CONDUCTIVITY": "heat conduction is left out",
        "DAMPING": "give damping in the case",
        "USER MATERIAL": "user materials are left out",
        "FAIL STRAIN": "strength is left out",
    }
    text = CHAIN + "".join(f"*{name}\n" for name in said)
    text += "*MATERIAL, NAME=Y\n*ELASTIC\n1.E7, .3\n" + "".join(f"*{name}\n1.\n" for name in behaviour)
    made = deck(tmp_path, text + "*LATENT HEAT\n1., 2., 3.\n")
    first = {name: 27 + k for k, name in enumerate(said)}
    first |= {name: 30 + len(said) + 2 * k for k, name in enumerate(behaviour)}
    first["LATENT HEAT"] = 30 + len(said) + 2 * len(behaviour)
    strange = {"LATENT HEAT": "it is not understood and left out"}
    wanted = {f"1 *{n}: {text} (first at model.inp:{first[n]})" for n, text in (said | behaviour | strange).items()}
    assert set(left_out(made)) == wanted and len(left_out(made)) == len(wanted)


TWINS = """*PART, NAME=BAR
*NODE
1, 0., 0., 0.
2, 1., 0., 0.
3, 2., 0., 0.
*ELEMENT, TYPE=B31, ELSET=E
1, 1, 2
2, 2, 3
*BEAM SECTION, SECTION=RECT, ELSET=E, MATERIAL=AL
.1, .1
0., 0., -1.
*END PART
*INSTANCE, NAME=Left-1, PART=BAR
*END INSTANCE
*INSTANCE, NAME=Right-1, PART=BAR
0., 5., 0.
*END INSTANCE
*MPC
TIE, Right-1.1, Left-1.3
TIE, Right-1.1, Left-1.1
*MATERIAL, NAME=AL
*ELASTIC
70e9, .3
*DENSITY
2700.
"""


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        (
            "",
            "",
            "*MPC TIE of node 1 of instance 'Right-1' makes component 1 of node 1 of instance 'Right-1' dependent",
        ),
        ("2, 2, 3", "2, 2, 99", "element 2 of instance 'Left-1' uses node 99 of instance 'Left-1', which no *NODE"),
    ],
)
def test_nodes_and_elements_are_named_with_their_instance_as_in_the_file(old, new, said, tmp_path):
    """In the whole model node 1 of the second of two instances has the number 11."""
    path = tmp_path / "twins.inp"
    path.write_text(TWINS.replace(old, new))
    with pytest.raises(DeckError, match=re.escape(said)):
        read_deck(path, "m-kg-s")
    if new:
        with pytest.raises(
            ValueError, match=r"nodes \[99 of instance 'Left-1', 99 of instance 'Right-1'\] that no \*N"
        ):
            read_mesh(path)


@pytest.mark.parametrize(
    ("normal", "axis"),
    [
        ([0, 0, 1], [1, 0, 0]),
        ([0, -1, 0], [1, 0, 0]),
        ([0.6, 0, 0.8], [0.8, 0, -0.6]),
        ([1, 0, 0], [0, 0, 1]),
        ([-1, 0, 0], [0, 0, 1]),
    ],
)
def test_direction_1_of_a_surface_is_x_laid_into_it_or_z_where_x_stands_on_it(normal, axis):
    assert _default_axis(np.array(normal, float)) == pytest.approx(np.array(axis, float), abs=1e-12)
