"""Abaqus decks as structures: closed forms, and every keyword against another way of saying the same."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from femflex.decks import Deck, DeckError, read_deck
from femflex.mesh import box
from femflex.reduction import cantilever_modes

STEEL = "*MATERIAL, NAME=STEEL\n*ELASTIC\n210000., 0.3\n*DENSITY\n7.85E-9\n"
E, NU, RHO = 210e9, 0.3, 7850.0


def deck(folder: Path, text: str, units: str = "mm-t-s", **overrides: dict) -> Deck:
    path = folder / "model.inp"
    path.write_text(text)
    return read_deck(path, units, overrides or None)


def frequencies(made: Deck, n: int = 4) -> np.ndarray:
    """Lowest natural frequencies [Hz] of a deck under its own supports."""
    structure = made.structure()
    held = structure.held_dofs(made.held())
    free = np.setdiff1d(np.arange(structure.n_dof), held)
    K, M = (matrix[free][:, free].toarray() for matrix in (structure.K, structure.M))
    values = np.linalg.eigvals(np.linalg.solve(K, M)).real  # massless dofs are zeros here
    return np.sort(1 / np.sqrt(np.sort(values)[::-1][:n])) / (2 * np.pi)


def beam(section: str, data: str, boundary: str = "1, ENCASTRE", kind: str = "B31", n: int = 10) -> str:
    """A cantilever 1000 mm long along x."""
    nodes = "".join(f"{k + 1}, {1000.0 * k / n}, 0., 0.\n" for k in range(n + 1))
    elements = "".join(f"{k + 1}, {k + 1}, {k + 2}\n" for k in range(n))
    return (
        f"*NODE\n{nodes}*ELEMENT, TYPE={kind}, ELSET=BOOM\n{elements}{STEEL}"
        f"*BEAM SECTION, SECTION={section}, ELSET=BOOM, MATERIAL=STEEL\n{data}\n*BOUNDARY\n{boundary}\n"
    )


def clamped(I: float, A: float, length: float = 1.0) -> float:
    """First frequency of a slender cantilever [Hz]."""
    return 1.875104069**2 / (2 * np.pi * length**2) * np.sqrt(E * I / (RHO * A))


def test_a_rectangular_beam_bends_about_its_two_axes(tmp_path: Path):
    """Width 10 mm along n1 = y, height 20 mm along n2 = z."""
    found = frequencies(deck(tmp_path, beam("RECT", "10., 20.\n0., 1., 0.", kind="B33")))
    A, low, high = 2e-4, 20e-3 * 10e-3**3 / 12, 10e-3 * 20e-3**3 / 12
    assert found[0] == pytest.approx(clamped(low, A), rel=1e-3)  # rotary inertia takes a little
    assert found[1] == pytest.approx(clamped(high, A), rel=2e-3)
    made = deck(
        tmp_path,
        beam("RECT", "10., 20.\n0., 1., 0.", "1, ENCASTRE\nALL, 2\n").replace(
            "*BEAM", "*NSET, NSET=ALL, GENERATE\n1, 11\n*BEAM"
        ),
    )
    assert frequencies(made)[0] == pytest.approx(clamped(high, A), rel=3e-3)  # y held: the bend along z is left


@pytest.mark.parametrize(
    ("section", "data", "A", "low"),
    [
        ("PIPE", "20., 2.", np.pi * (400 - 324), np.pi / 4 * (20**4 - 18**4)),
        ("CIRC", "15.", np.pi * 225, np.pi / 4 * 15**4),
        ("BOX", "40., 30., 2., 2., 2., 2.", 40 * 30 - 36 * 26, (40 * 30**3 - 36 * 26**3) / 12),
        ("I", "20., 40., 30., 30., 3., 3., 2.", 2 * 90 + 34 * 2, (2 * 3 * 30**3 + 34 * 2**3) / 12),
        ("RECTANGULAR", "12., 8.", 96, 12 * 8**3 / 12),
    ],
)
def test_shapes_of_sections_have_the_area_and_inertia_of_closed_forms(section, data, A, low, tmp_path: Path):
    found = frequencies(deck(tmp_path, beam(section, f"{data}\n0., 1., 0.", kind="B33")))
    assert found[0] == pytest.approx(clamped(low * 1e-12, A * 1e-6), rel=3e-3)


def test_an_angle_bends_first_about_its_weak_principal_axis(tmp_path: Path):
    """Equal legs: the weak axis lies along the bisector; I_min = I_y - |I_yz| of the legs' middle lines, thin walls."""
    made = deck(tmp_path, beam("L", "40., 40., 2., 2.\n0., 1., 0."))
    rects = [(1, 20, 2, 40), (21, 1, 38, 2)]  # y, z of the centre, height, width [mm]
    A = sum(h * w for *_, h, w in rects)
    y, z = (sum(r[k] * r[2] * r[3] for r in rects) / A for k in (0, 1))
    Iy = sum(w * h**3 / 12 + w * h * (r - y) ** 2 for r, _, h, w in rects)
    Iz = sum(h * w**3 / 12 + w * h * (r - z) ** 2 for _, r, h, w in rects)
    Iyz = sum(w * h * (a - y) * (b - z) for a, b, h, w in rects)
    least = (Iy + Iz) / 2 - np.hypot((Iy - Iz) / 2, Iyz)
    (member,) = made.members
    assert float(member.section.EIy) == pytest.approx(E * least * 1e-12, rel=1e-9)
    assert abs(np.linalg.norm(member.options["offset"])) == pytest.approx(1e-3 * np.hypot(y - 1, z - 1), rel=1e-9)


def test_general_sections_and_a_third_node_say_the_same_as_a_shape(tmp_path: Path):
    shape = frequencies(deck(tmp_path, beam("RECT", "10., 20.\n0., 1., 0.", kind="B33")))
    J = 10**3 * 20 * (1 / 3 - 0.21 * 0.5 * (1 - 0.5**4 / 12))
    text = beam("RECT", "X", kind="B33")
    general = re.sub(
        r"\*BEAM SECTION.*\nX\n",
        f"*BEAM GENERAL SECTION, SECTION=GENERAL, DENSITY=7.85E-9, ELSET=BOOM\n200., 6666.6667, 0., 1666.6667, {J}\n"
        "0., 1., 0.\n210000., 80769.23\n",
        text,
    )
    assert frequencies(deck(tmp_path, general)) == pytest.approx(shape, rel=2e-3)
    third = beam("RECT", "10., 20.", kind="B33")
    third = re.sub(r"(\n\d+, \d+, \d+)(?=\n)", r"\1", third).replace("*ELEMENT", "99, 0., 500., 0.\n*ELEMENT")
    for k in range(10):
        third = third.replace(f"\n{k + 1}, {k + 1}, {k + 2}\n", f"\n{k + 1}, {k + 1}, {k + 2}, 99\n")
    assert frequencies(deck(tmp_path, third)) == pytest.approx(shape, rel=1e-6)


def plate(section: str, more: str = "", cell: str = "S8R") -> str:
    """A square plate of 400 mm in 4 x 4 elements, simply supported."""
    n = 8
    nodes = {(i, j): 1 + i + 100 * j for i in range(n + 1) for j in range(n + 1)}
    lines = [
        "*NODE",
        *(f"{k}, {50.0 * i}, {50.0 * j}, 0." for (i, j), k in nodes.items()),
        f"*ELEMENT, TYPE={cell}, ELSET=SKIN",
    ]
    around = [(0, 0), (2, 0), (2, 2), (0, 2), (1, 0), (2, 1), (1, 2), (0, 1)]
    for e, (i, j) in enumerate((i, j) for j in range(0, n, 2) for i in range(0, n, 2)):
        lines.append(f"{e + 1}, " + ", ".join(str(nodes[i + a, j + b]) for a, b in around))
    rim = [k for (i, j), k in nodes.items() if i in (0, n) or j in (0, n)]
    rows = [", ".join(map(str, rim[k : k + 10])) for k in range(0, len(rim), 10)]
    return "\n".join([*lines, "*NSET, NSET=RIM", *rows, STEEL + more + section, "*BOUNDARY", "RIM, 1, 3", ""])


def test_a_simply_supported_plate_has_the_frequency_of_navier(tmp_path: Path):
    text = plate("*SHELL SECTION, ELSET=SKIN, MATERIAL=STEEL\n4., 5")
    D = E * 4e-3**3 / 12 / (1 - NU**2)
    exact = np.pi / 2 * 2 / 0.4**2 * np.sqrt(D / (RHO * 4e-3))
    assert frequencies(deck(tmp_path, text))[0] == pytest.approx(exact, rel=5e-3)
    doubled = deck(tmp_path, text, SKIN={"thickness": 8e-3})
    assert frequencies(doubled)[0] == pytest.approx(2 * exact, rel=1e-2)
    denser = deck(tmp_path, text, STEEL={"density": 4 * RHO})
    assert frequencies(denser)[0] == pytest.approx(exact / 2, rel=5e-3)
    with pytest.raises(DeckError, match="override of 'SKINN': the deck has no material and no section of that name"):
        deck(tmp_path, text, SKINN={"thickness": 8e-3})


LAMINA = "*MATERIAL, NAME=CARBON\n*ELASTIC, TYPE=LAMINA\n150000., 9000., 0.3, 5000., 5000., 3000.\n*DENSITY\n1.6E-9\n"


def test_plies_turned_by_angle_by_orientation_or_by_stiffness_are_the_same(tmp_path: Path):
    """Four plies +-30 deg: angles; orientations by name (CalculiX); ENGINEERING CONSTANTS; 21 stiffnesses."""
    plies = "".join(f"1., 3, CARBON, {a}.\n" for a in (30, -30, -30, 30))
    by_angle = deck(tmp_path, plate(f"*SHELL SECTION, ELSET=SKIN, COMPOSITE\n{plies}", LAMINA))
    c, s = np.cos(np.pi / 6), np.sin(np.pi / 6)
    turned = LAMINA + "".join(
        f"*ORIENTATION, NAME={name}\n{c}, {sign * s}, 0., {-sign * s}, {c}, 0.\n3, 0.\n"
        for name, sign in (("PLUS", 1), ("MINUS", -1))
    )
    half = "1., , CARBON, PLUS\n1., , CARBON, MINUS\n"
    by_name = deck(tmp_path, plate(f"*SHELL SECTION, ELSET=SKIN, COMPOSITE, SYMMETRIC\n{half}", turned))
    first = by_angle.members[0].section
    for other in (by_name.members[0].section,):
        assert other.A == pytest.approx(first.A, rel=1e-6, abs=1e-6 * np.abs(first.A).max())
        assert other.D == pytest.approx(first.D, rel=1e-6, abs=1e-6 * np.abs(first.D).max())
    constants = LAMINA.replace("LAMINA", "ENGINEERING CONSTANTS").replace(
        "150000., 9000., 0.3, 5000., 5000., 3000.", "150000., 9000., 9000., 0.3, 0.3, 0.4, 5000., 5000.,\n3000."
    )
    third = deck(tmp_path, plate(f"*SHELL SECTION, ELSET=SKIN, COMPOSITE\n{plies}", constants)).members[0].section
    assert third.D == pytest.approx(first.D, rel=1e-12) and third.S == pytest.approx(first.S, rel=1e-12)
    K = np.zeros((6, 6))
    K[:3, :3], K[3:, 3:] = first.A / 1e3, first.D * 1e3  # N/mm, N mm
    words = [f"{K[i, j]:.12g}" for j in range(6) for i in range(j + 1)]
    rows = "\n".join(", ".join(words[k : k + 8]) for k in (0, 8, 16))
    general = f"*SHELL GENERAL SECTION, ELSET=SKIN, DENSITY=6.4E-9\n{rows}\n*TRANSVERSE SHEAR STIFFNESS\n"
    general += ", ".join(f"{v / 1e3:.12g}" for v in (first.S[0, 0], first.S[1, 1], first.S[0, 1]))
    given = deck(tmp_path, plate(general))
    assert frequencies(given) == pytest.approx(frequencies(by_angle), rel=1e-4)


def test_an_offset_shell_lies_off_its_nodes(tmp_path: Path):
    text = plate("*SHELL SECTION, ELSET=SKIN, MATERIAL=STEEL, OFFSET=SPOS\n4.")
    assert deck(tmp_path, text).members[0].options["offset"] == pytest.approx(-2e-3)


def brick(more: str = "", material: str = STEEL, extra: str = "") -> str:
    """A cantilever of solids along x, 100 x 10 x 10 mm, its face at x = 0 in the set ROOT, at the end in TIP."""
    mesh = box(100, 10, 10, 5, 1, 1, "hexahedron20")
    nodes = "\n".join(f"{k + 1}, {x}, {y}, {z}" for k, (x, y, z) in enumerate(mesh.points.tolist()))
    rows = []
    for e, cell in enumerate(mesh.cells["hexahedron20"]):
        words = [str(e + 1), *(str(n + 1) for n in cell)]
        rows += [", ".join(words[:12]) + ",", ", ".join(words[12:])]
    x = mesh.points[:, 0]
    root, tip = (", ".join(map(str, np.flatnonzero(abs(x - at) < 1e-9) + 1)) for at in (0, 100))
    root, tip = (re.sub(r"((?:\d+, ){8})", r"\1\n", one) for one in (root, tip))
    return (
        f"*NODE\n{nodes}\n*ELEMENT, TYPE=C3D20R, ELSET=ALL\n" + "\n".join(rows) + f"\n*NSET, NSET=ROOT\n{root}\n"
        f"*NSET, NSET=TIP\n{tip}\n{material}{extra}*SOLID SECTION, ELSET=ALL, MATERIAL=STEEL{more}\n*BOUNDARY\n"
        "ROOT, 1, 3\n"
    )


def test_steps_hold_what_they_say_and_the_frequency_step_is_in_force(tmp_path: Path):
    text = (
        brick()
        + "*STEP\n*STATIC\n*BOUNDARY\nTIP, 2\n*END STEP\n"
        + "*STEP\n*FREQUENCY\n5\n*BOUNDARY, OP=NEW\nROOT, 1, 3\n*END STEP\n"
    )
    made = deck(tmp_path, text)
    assert sorted(made.supports) == ["initial", "step 1", "step 2"] and made.default_supports == ("step 2",)
    found = frequencies(made)
    assert found[0] == pytest.approx(clamped(1e-8 / 12, 1e-4, 0.1), rel=0.02)
    assert len(made.held(["step 1"])) == 2 and len(made.held()) == 1


def test_orthotropic_solids_are_turned_by_their_orientation(tmp_path: Path):
    """Fibres along y by the material's axis 1: the same as a material stiff along y."""
    stiff = "*MATERIAL, NAME=STEEL\n*ELASTIC, TYPE=ENGINEERING CONSTANTS\n"
    stiff += "{}, 0., 0., 0., 5000., 5000.,\n5000.\n*DENSITY\n1.6E-9\n"
    system = "*ORIENTATION, NAME=TURNED\n0., 1., 0., -1., 0., 0.\n"
    along = brick("", stiff.format("9000., 150000., 9000."))
    turned = brick(", ORIENTATION=TURNED", stiff.format("150000., 9000., 9000."), system)
    assert frequencies(deck(tmp_path, turned)) == pytest.approx(frequencies(deck(tmp_path, along)), rel=1e-8)


NODE_SURFACE = "*SURFACE, NAME=F, TYPE=NODE\nTIP, 1.\n"
TIP_MASS = "*NODE\n9999, 100., 5., 5.\n*ELEMENT, TYPE=MASS, ELSET=LUMP\n9999, 9999\n*MASS, ELSET=LUMP\n1.E-3\n"


@pytest.mark.parametrize(
    "connection",
    [
        "*RIGID BODY, NSET=TIP, REF NODE=9999\n",
        "*RIGID BODY, TIE NSET=TIP, REF NODE=9999\n",
        NODE_SURFACE + "*COUPLING, CONSTRAINT NAME=C, REF NODE=9999, SURFACE=F\n*KINEMATIC\n1, 6\n",
        "*SURFACE, NAME=FACE\nALL, S4\n*COUPLING, CONSTRAINT NAME=C, REF NODE=9999, SURFACE=FACE\n*KINEMATIC\n",
        "*KINEMATIC COUPLING, REF NODE=9999\nTIP, 1, 6\n",
        "*MPC\nBEAM, TIP, 9999\n",
    ],
)
def test_every_rigid_connection_moves_a_mass_of_one_kilogram_likewise(connection: str, tmp_path: Path):
    """A mass on the end of a cantilever: f = sqrt(3 E I / (L^3 (m + 0.2427 m_beam))) / 2 pi."""
    text = brick() + TIP_MASS + connection
    if "ALL, S4" in connection:  # of the last brick the face at the end, as Abaqus numbers faces
        mesh = box(100, 10, 10, 5, 1, 1, "hexahedron20")
        last = int(np.argmax(mesh.points[mesh.cells["hexahedron20"]][:, :, 0].mean(axis=1)))
        x = mesh.points[mesh.cells["hexahedron20"][last], 0]
        faces = ["1234", "5876", "1562", "2673", "3784", "4851"]
        label = next(k for k, face in enumerate(faces, 1) if all(abs(x[int(c) - 1] - 100) < 1e-9 for c in face))
        text = text.replace("ALL, S4", f"{last + 1}, S{label}")
    found = frequencies(deck(tmp_path, text))[0]
    own = RHO * 1e-5
    exact = np.sqrt(3 * E * 1e-8 / 12 / (1e-3 * (1.0 + 0.2427 * own))) / (2 * np.pi)
    assert found == pytest.approx(exact, rel=0.02)


def test_a_distributing_coupling_does_not_stiffen(tmp_path: Path):
    face = "*SURFACE, NAME=FACE, TYPE=NODE\nTIP, 1.\n*COUPLING, CONSTRAINT NAME=C, REF NODE=9999, SURFACE=FACE\n"
    rigid = frequencies(deck(tmp_path, brick() + TIP_MASS + face + "*KINEMATIC\n1, 6\n"))[0]
    spread = frequencies(deck(tmp_path, brick() + TIP_MASS + face + "*DISTRIBUTING\n"))[0]
    assert 0.99 * rigid < spread < rigid


def test_tied_parts_are_one_and_untied_ones_are_not(tmp_path: Path):
    """Two instances of a beam end to end are a beam of twice the length."""
    text = (
        "*PART, NAME=BOOM\n*NODE\n1, 0.\n2, 250.\n3, 500.\n*ELEMENT, TYPE=B33, ELSET=ALL\n1, 1, 2\n2, 2, 3\n"
        "*BEAM SECTION, ELSET=ALL, SECTION=RECT, MATERIAL=STEEL\n10., 20.\n0., 1., 0.\n*END PART\n*ASSEMBLY, NAME=A\n"
        "*INSTANCE, NAME=B1, PART=BOOM\n*END INSTANCE\n*INSTANCE, NAME=B2, PART=BOOM\n500., 0., 0.\n*END INSTANCE\n"
        "*SURFACE, NAME=LEFT, TYPE=NODE\nB2.1\n*SURFACE, NAME=RIGHT, TYPE=NODE\nB1.3\n*TIE, NAME=T\nLEFT, RIGHT\n"
        f"*END ASSEMBLY\n{STEEL}*BOUNDARY\nB1.1, ENCASTRE\n"
    )
    whole = frequencies(deck(tmp_path, beam("RECT", "10., 20.\n0., 1., 0.", kind="B33", n=4)))
    made = deck(tmp_path, text)
    assert frequencies(made) == pytest.approx(whole, rel=1e-8)
    assert len(made.mesh.points) == 5
    with pytest.raises(DeckError, match=r"\*TIE of 'LEFT' to 'RIGHT': 1 of 1 nodes, the first is 11, have no node of"):
        deck(tmp_path, text.replace("500., 0., 0.\n*END", "501., 0., 0.\n*END"))


def test_an_equation_joins_two_beams_as_their_common_node_would(tmp_path: Path):
    text = beam("RECT", "10., 20.\n0., 1., 0.", kind="B33", n=4)
    split = text.replace("*ELEMENT", "9, 500., 0., 0.\n*ELEMENT").replace("\n3, 3, 4\n", "\n3, 9, 4\n")
    equations = "".join(f"2\n9, {c}, 1., 3, {c}, -1.\n" for c in range(1, 7))
    found = frequencies(deck(tmp_path, split + "*EQUATION\n" + equations))
    assert found == pytest.approx(frequencies(deck(tmp_path, text)), rel=1e-9)
    assert frequencies(deck(tmp_path, split + "*MPC\nTIE, 9, 3\n")) == pytest.approx(found, rel=1e-9)


def test_springs_and_masses_alone_are_an_oscillator(tmp_path: Path):
    """SPRINGA of 2 N/mm and a mass of 0.5 kg; SPRING1 across; SPRING2 as the first."""
    text = (
        "*NODE\n1, 0.\n2, 10.\n*ELEMENT, TYPE=MASS, ELSET=M\n1, 2\n*MASS, ELSET=M\n5.E-4\n*ELEMENT, TYPE={}, ELSET=S\n"
        "2, 1, 2\n*SPRING, ELSET=S\n{}\n2.\n*BOUNDARY\n1, 1, 3\n2, 2, 3\n"
    )
    exact = np.sqrt(2000 / 0.5) / (2 * np.pi)
    assert frequencies(deck(tmp_path, text.format("SPRINGA", "")), 1) == pytest.approx([exact])
    assert frequencies(deck(tmp_path, text.format("SPRING2", "1, 1")), 1) == pytest.approx([exact])
    one = text.format("SPRING1", "1").replace("2, 1, 2\n", "2, 2\n").replace("1, 1, 3\n", "")
    assert frequencies(deck(tmp_path, one), 1) == pytest.approx([exact])


def test_a_rotary_inertia_turns_a_mass_on_a_beam(tmp_path: Path):
    more = "*ELEMENT, TYPE=MASS, ELSET=M\n50, 11\n*MASS, ELSET=M\n1.E-3\n*ELEMENT, TYPE=ROTARYI, ELSET=R\n51, 11\n"
    plain = deck(tmp_path, beam("CIRC", "10.") + more + "*ROTARY INERTIA, ELSET=R\n2.E1, 3.E1, 3.E1\n")
    (mass,) = plain.point_masses
    assert mass.mass == pytest.approx(1.0)
    assert np.asarray(mass.inertia) == pytest.approx(np.diag([2e-2, 3e-2, 3e-2]))


def test_supports_lie_along_the_axes_of_a_transform(tmp_path: Path):
    """Nodes held radially from the line y = z = 0: direction 1 is (0, y, z) / |(y, z)| at each of them."""
    text = brick().replace("*BOUNDARY\n", "*TRANSFORM, NSET=TIP, TYPE=C\n0., 0., 0., 1., 0., 0.\n*BOUNDARY\nTIP, 1\n")
    made = deck(tmp_path, text)
    found = {group: one for group, one in made.held().items() if one.components == ("x",)}
    seen = 0
    for group, one in found.items():
        for x in made.mesh.points[made.mesh.group_points(group)]:
            if np.linalg.norm(x[1:]) > 1e-9:
                radial = np.array([0, *x[1:]]) / np.linalg.norm(x[1:])
                along = np.array([1.0, 0.0, 0.0])
                assert np.asarray(one.axes) == pytest.approx(
                    np.array([radial, np.cross(along, radial), along]), abs=1e-9
                )
                seen += 1
    assert seen == 7  # of the eight nodes of the face one lies on the line


@pytest.mark.parametrize(("n", "tolerance"), [(1, 0.02), (2, 0.003)])  # a parabola is no circle
def test_beams_of_three_nodes_follow_the_arc(n: int, tolerance: float, tmp_path: Path):
    """A quarter of a circle of 1 m; two chords of one element lack 2.5 % of its mass."""

    def arc(n: int, kind: str) -> Deck:
        k = n if kind == "B31" else 2 * n
        angles = np.linspace(0, np.pi / 2, k + 1)
        nodes = "".join(f"{i + 1}, {1e3 * np.cos(a):.9f}, {1e3 * np.sin(a):.9f}\n" for i, a in enumerate(angles))
        step = k // n
        cells = "".join(f"{i + 1}, {', '.join(str(step * i + j + 1) for j in range(step + 1))}\n" for i in range(n))
        text = f"*NODE\n{nodes}*ELEMENT, TYPE={kind}, ELSET=BOOM\n{cells}{STEEL}"
        section = "*BEAM SECTION, SECTION=RECT, ELSET=BOOM, MATERIAL=STEEL\n10., 20.\n0., 0., -1.\n"
        return deck(tmp_path, text + section + "*BOUNDARY\n1, ENCASTRE\n")

    curved = arc(n, "B32")
    mass = sum(float(block.dm.sum()) for block in curved.structure().inertia)
    assert mass == pytest.approx(RHO * 2e-4 * np.pi / 2, rel=tolerance / 2)
    assert frequencies(curved) == pytest.approx(frequencies(arc(24, "B31")), rel=tolerance)
    assert len(curved.mesh.group_cells("BOOM")["line"]) == 8 * n


def test_what_is_not_used_is_counted_with_its_consequence(tmp_path: Path):
    text = (
        beam("RECT", "10., 20.")
        + "*DASHPOT, ELSET=D\n\n1.\n*STEP\n*STATIC\n*CLOAD\n1, 2, 5.\n*CLOAD\n2, 2, 5.\n*END STEP\n"
    )
    said = [str(one) for one in deck(tmp_path, text).unused]
    assert any("2 *CLOAD: loads are left out; give them in the case (first at model.inp:" in one for one in said)
    assert any("1 *DASHPOT: damping is left out" in one for one in said)


@pytest.mark.parametrize("last", [False, True])
@pytest.mark.parametrize("before", ["*ELASTIC", "*DENSITY", "*BEAM SECTION", "*BOUNDARY", "*STATIC", "*END STEP", ""])
def test_a_keyword_that_is_not_understood_is_reported_wherever_it_stands(tmp_path: Path, before: str, last: bool):
    """The material stands before its section, or as the last of the model, where only the step ends it."""
    text = beam("RECT", "10., 20.")
    if last:
        text = text.replace(STEEL, "") + STEEL
    text += "*STEP\n*STATIC\n*END STEP\n"
    if not before:
        text += "*STRANGE\n"
    place = text.index(before) if before else len(text)
    said = [str(one) for one in deck(tmp_path, text[:place] + "*STRANGE\n" + text[place:]).unused]
    count = 1 if before else 2
    about = f"{count} *STRANGE: it is not understood and left out"
    assert (about in said[0], len(said)) == (True, 1)


@pytest.mark.parametrize(
    ("old", "new", "sentence"),
    [
        ("MATERIAL=STEEL", "MATERIAL=IRON", r"material 'IRON' is not in the deck; it has \['STEEL'\]"),
        ("*ELASTIC\n210000., 0.3\n", "", r"material 'STEEL' \(model.inp, line 24\) has no \*ELASTIC; give one"),
        ("210000., 0.3", "-210000., 0.3", "moduli must be positive and the density not negative"),
        ("210000., 0.3", "21OOOO., 0.3", r"model.inp, line 26: \*ELASTIC has '21OOOO.' where an elastic constant bel"),
        ("10, 10, 11", "10, 10, 12", "element 10 uses node 12, which no .NODE block defines"),
        ("SECTION=RECT", "SECTION=HAT", "SECTION=HAT is not read; known are RECT, CIRC, PIPE"),
        ("10., 20.", "10., -20.", "give 2, none negative"),
        (
            "ELSET=BOOM, MATERIAL",
            "ELSET=BOOMS, MATERIAL",
            r"ELSET 'BOOMS' is used but not defined; known are \['BOOM'\]",
        ),
        ("*BEAM SECTION, SECTION=RECT", "*SHELL SECTION", r"\*SHELL SECTION is for other elements than those of ELSET"),
        ("*BEAM SECTION", "*HEADING", r"10 elements of type B31, the first is 1, have no section; give one"),
        ("1, ENCASTRE", "1, BUILTIN", r"\*BOUNDARY has 'BUILTIN' where a component belongs; it is no whole number"),
        ("1, ENCASTRE", "WALL, ENCASTRE", "NSET 'WALL' is used but not defined"),
    ],
)
def test_a_deck_that_cannot_be_used_says_where_and_why(old: str, new: str, sentence: str, tmp_path: Path):
    text = beam("RECT", "10., 20.")
    assert old in text
    with pytest.raises(ValueError, match=sentence) as caught:
        deck(tmp_path, text.replace(old, new))
    assert not re.search(r"model.inp:\d+: model.inp", str(caught.value))  # a place stands once


def test_two_dependences_of_one_node_are_a_problem(tmp_path: Path):
    text = beam("RECT", "10., 20.", n=4) + "*MPC\nTIE, 5, 4\n*EQUATION\n2\n5, 1, 1., 3, 1, -1.\n"
    with pytest.raises(DeckError, match=r"component 1 of node 5 dependent, which \*MPC TIE of node 5 does already"):
        deck(tmp_path, text)


BRICK = """*HEADING
*NODE
1,0,0,0
2,1,0,0
3,1,1,0
4,0,1,0
5,0,0,1
6,1,0,1
7,1,1,1
8,0,1,1
*ELEMENT, TYPE=C3D8, ELSET=E
1,1,2,3,4,5,6,7,8
*MATERIAL, NAME=M
*ELASTIC
2.E11,.3
*DENSITY
7850.
*SOLID SECTION, ELSET=E, MATERIAL=M
*BOUNDARY
1,1,3
"""


@pytest.mark.parametrize(
    ("old", "new", "sentence"),
    [
        ("2.E11,.3\n", "", r"brick.inp, line 14: \*ELASTIC, TYPE=ISOTROPIC has 0 constants; material 'M' needs 2"),
        ("*ELASTIC\n2.E11,.3\n", "*USER MATERIAL\n1.,2.\n", r"'M' .* has \*USER MATERIAL and no \*ELASTIC"),
        ("1,1,2,3,4,5,6,7,8", "1,1,2,3,4,5,6,7,inf", r"line 12: \*ELEMENT has 'inf' where the number"),
        ("C3D8", "C3D8T", ""),
        ("TYPE=C3D8, ELSET=E\n1,1,2,3,4,5,6,7,8", "TYPE=CPS4R, ELSET=E\n1,1,2,3,4", r"brick.inp:12: 1 elements of type "
         r"CPS4R: plane elements .* model the sheet by shells"),
        ("TYPE=C3D8, ELSET=E\n1,1,2,3,4,5,6,7,8", "TYPE=CAX4, ELSET=E\n1,1,2,3,4",
         "model the whole body of revolution"),
    ],
)  # fmt: skip
def test_what_single_bricks_lack_is_said_once_with_its_line(tmp_path, old, new, sentence):
    (tmp_path / "brick.inp").write_text(BRICK.replace(old, new))
    if not sentence:
        assert len(read_deck(tmp_path / "brick.inp").members) == 1
        return
    with pytest.raises(ValueError, match=sentence) as found:
        read_deck(tmp_path / "brick.inp")
    assert "have no section" not in str(found.value)


def test_the_numbers_of_one_part_without_instances_are_those_of_the_deck(tmp_path):
    text = BRICK.replace("*NODE\n", "*PART, NAME=A\n*NODE\n").replace("*MATERIAL", "*END PART\n*MATERIAL", 1)
    (tmp_path / "brick.inp").write_text(text)
    deck = read_deck(tmp_path / "brick.inp")
    assert list(deck.held()) and 1 in deck.points_of_ids


def test_a_pointer_of_git_is_no_deck(tmp_path):
    (tmp_path / "brick.inp").write_text("version https://git-lfs.github.com/spec/v1\noid sha256:00\nsize 5\n")
    with pytest.raises(ValueError, match=r"brick\.inp is a pointer of Git LFS"):
        read_deck(tmp_path / "brick.inp")


def test_springs_of_a_joint_lie_along_its_axes(tmp_path):
    """Two masses of 2 kg on springs of a joint turned by 90 degrees: its 1 lies along y."""
    (tmp_path / "joint.inp").write_text(
        "*HEADING\n*NODE\n1,0,0,0\n2,1,0,0\n*ELEMENT, TYPE=JOINTC, ELSET=J\n1,1,2\n*ELEMENT, TYPE=MASS, ELSET=W\n2,2\n"
        "*ORIENTATION, NAME=O\n0.,1.,0.,-1.,0.,0.\n*JOINT, ELSET=J, ORIENTATION=O\n*SPRING\n1,1\n800.\n*SPRING\n2,2\n"
        "200.\n*MASS, ELSET=W\n2.\n*BOUNDARY\n1,1,3\n2,3\n"
    )
    deck = read_deck(tmp_path / "joint.inp")
    modes = cantilever_modes(deck.structure(), deck.held(), 2)
    assert modes.omega == pytest.approx([10.0, 20.0])  # sqrt(200 / 2), sqrt(800 / 2)
    row = deck.points_of_ids[2]
    assert abs(modes.phi[:, 1] @ deck.structure().translation.toarray()[3 * row + 1]) > 0.1  # the stiff one along y
