"""Abaqus decks in inches and skew axes: masses, springs, constraints, sections and supports, each number by itself."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
import pytest

from femflex.decks import Deck, DeckError, read_deck
from femflex.decks.abaqus.surfaces import face_nodes
from femflex.mesh.abaqus_flat import Element
from femflex.mesh.cells import CELL_TYPES

L, F = 0.0254, 0.45359237 * 9.80665  # m, N
MASS = F / L  # kg of one lbf s^2 / in
E, NU, RHO = 1.0e7, 0.25, 2.5e-4
G = E / 2.5
METAL = f"*MATERIAL, NAME=METAL\n*ELASTIC\n{E}, {NU}\n*DENSITY\n{RHO}\n"


def deck(folder, text: str, **overrides: dict):
    path = folder / "model.inp"
    path.write_text(text)
    return read_deck(path, "in-lbf-s", overrides or None)


def axes_of(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Axes as rows: the first along a, the second towards b."""
    x = a / np.linalg.norm(a)
    z = np.cross(a, b) / np.linalg.norm(np.cross(a, b))
    return np.array([x, np.cross(z, x), z])


AT = {1: [3.0, 4.0, 1.0], 2: [-1.0, 2.5, 0.7], 3: [2.0, -1.5, 3.0], 4: [0.4, 0.9, -2.0], 5: [1.0, 7.0, 0.0]}
NODES = "*NODE\n" + "".join(f"{n}, {x[0]}, {x[1]}, {x[2]}\n" for n, x in AT.items())
A, B, ORIGIN = np.array([1.0, 0.4, 0.3]), np.array([-0.2, 1.0, 0.5]), np.array([0.3, -0.2, 0.6])
FROM, TO = np.array([0.5, -1.0, 0.2]), np.array([0.9, 0.3, 2.0])  # of the axis of cylinders and spheres
SYSTEMS = {
    "R": ("RECTANGULAR", [*(A + ORIGIN), *(B + ORIGIN), *ORIGIN]),
    "C": ("CYLINDRICAL", [*FROM, *TO]),
    "S": ("SPHERICAL", [*FROM, *TO]),
}


def basic(kind: str, x: np.ndarray) -> np.ndarray:
    """Axes of a system at a place, as rows."""
    if kind == "R":
        return axes_of(A, B)
    axis = (TO - FROM) / np.linalg.norm(TO - FROM)
    r = x - FROM
    radial = r - (r @ axis) * axis
    radial = radial / np.linalg.norm(radial)
    if kind == "C":
        return np.array([radial, np.cross(axis, radial), axis])
    out = r / np.linalg.norm(r)
    around = np.cross(axis, radial)
    return np.array([out, around, np.cross(out, around)])


def turned(C: np.ndarray, about: int, degrees: float) -> np.ndarray:
    """Axes turned about one of them (1 to 3)."""
    e = C[about - 1]
    S = np.array([[0, -e[2], e[1]], [e[2], 0, -e[0]], [-e[1], e[0], 0]])
    a = np.radians(degrees)
    return C @ (np.eye(3) + np.sin(a) * S + (1 - np.cos(a)) * S @ S).T


def orientation(kind: str, about: int = 3, degrees: float = 0.0) -> str:
    name, values = SYSTEMS[kind]
    words = ", ".join(f"{v:.12g}" for v in values)
    return f"*ORIENTATION, NAME=O, SYSTEM={name}\n{words}\n{about}, {degrees}\n"


@lru_cache(maxsize=1)
def structure_of(made: Deck):
    return made.structure()


def motions(structure, made, node: int) -> np.ndarray:
    row = 3 * made.points_of_ids[node]
    return np.concatenate([p[row : row + 3].toarray() for p in (structure.translation, structure.rotation)])


def on_nodes(made, name: str, nodes: tuple[int, ...]) -> np.ndarray:
    structure = structure_of(made)
    T = np.concatenate([motions(structure, made, n) for n in nodes])
    return np.asarray(T @ getattr(structure, name).toarray() @ T.T)


def lumps(*nodes: int) -> str:
    text = ""
    for kind, key, data in (("MASS", "MASS", "1."), ("ROTARYI", "ROTARY INERTIA", "1., 1., 1.")):
        rows = "".join(f"{100 * len(kind) + n}, {n}\n" for n in nodes)
        text += f"*ELEMENT, TYPE={kind}, ELSET=L{kind}\n{rows}*{key}, ELSET=L{kind}\n{data}\n"
    return text


TURNS = [("R", 3, 0.0), ("R", 1, 35.0), ("C", 2, 20.0), ("C", 3, -50.0), ("S", 1, 0.0)]


@pytest.mark.parametrize(("kind", "about", "degrees"), TURNS)
def test_inertias_lie_along_their_orientation_and_add_up_at_a_node(tmp_path, kind, about, degrees):
    """I11, I22, I33, I12, I13, I23 as a tensor; two cards of mass and one of inertia at node 2."""
    text = NODES + orientation(kind, about, degrees)
    text += "*ELEMENT, TYPE=MASS, ELSET=M\n11, 2\n12, 2\n*MASS, ELSET=M\n1.25\n*ELEMENT, TYPE=ROTARYI, ELSET=J\n13, 2\n"
    text += "*ROTARY INERTIA, ELSET=J, ORIENTATION=O\n5., 6., 7., .2, -.3, .4\n"
    C = turned(basic(kind, np.array(AT[2])), about, degrees)
    J = np.array([[5.0, 0.2, -0.3], [0.2, 6.0, 0.4], [-0.3, 0.4, 7.0]])
    wanted = np.zeros((6, 6))
    wanted[:3, :3], wanted[3:, 3:] = 2.5 * MASS * np.eye(3), C.T @ J @ C * MASS * L**2
    found = on_nodes(deck(tmp_path, text), "M", (2,))
    assert found == pytest.approx(wanted, abs=1e-9 * np.abs(wanted).max())


PAIRS = [(2, 1), (5, 4), (1, 6), (6, 2), (3, 3)]


@pytest.mark.parametrize(
    ("kind", "about", "degrees", "pair"), [(*turn, pair) for turn, pair in zip(TURNS, PAIRS, strict=True)]
)
def test_springs_between_components_lie_along_their_orientation_at_each_node(tmp_path, kind, about, degrees, pair):
    """Energy k (u_a - u_b)^2 / 2 in the units of the deck; a turn counts in radians."""
    text = NODES + lumps(1, 2) + orientation(kind, about, degrees)
    text += f"*ELEMENT, TYPE=SPRING2, ELSET=S\n9, 1, 2\n*SPRING, ELSET=S, ORIENTATION=O\n{pair[0]}, {pair[1]}\n70.\n"
    d = np.zeros((2, 2, 3))
    for k, (node, c) in enumerate(zip((1, 2), pair, strict=True)):
        C = turned(basic(kind, np.array(AT[node])), about, degrees)
        d[k, int(c > 3)] = (-1) ** k * C[(c - 1) % 3] / (L if c <= 3 else 1.0)
    wanted = 70.0 * F * L * np.outer(d.ravel(), d.ravel())
    found = on_nodes(deck(tmp_path, text), "K", (1, 2))
    assert found == pytest.approx(wanted, abs=1e-9 * np.abs(wanted).max())


@pytest.mark.parametrize("c", [2, 6])
@pytest.mark.parametrize("kind", ["SPRING1", "JOINTC", "SPRINGA"])
def test_springs_to_the_ground_of_joints_and_along_lines(tmp_path, kind, c):
    text = NODES + lumps(1, 2) + orientation("C", 1, 25.0)
    C = turned(basic("C", np.array(AT[1])), 1, 25.0)
    d = np.zeros((2, 2, 3))
    d[0, int(c > 3)] = C[(c - 1) % 3]
    if kind == "SPRING1":
        text += f"*ELEMENT, TYPE=SPRING1, ELSET=S\n9, 1\n*SPRING, ELSET=S, ORIENTATION=O\n{c}\n70.\n"
    elif kind == "JOINTC":  # along the axes at its first node
        d[1, int(c > 3)] = -d[0, int(c > 3)]
        text += f"*ELEMENT, TYPE=JOINTC, ELSET=S\n9, 1, 2\n*JOINT, ELSET=S, ORIENTATION=O\n*SPRING\n{c}\n70.\n"
    else:
        line = (np.array(AT[2]) - np.array(AT[1])) / np.linalg.norm(np.array(AT[2]) - np.array(AT[1]))
        d = np.array([[line, np.zeros(3)], [-line, np.zeros(3)]])
        c = 1
        text += "*ELEMENT, TYPE=SPRINGA, ELSET=S\n9, 1, 2\n*SPRING, ELSET=S\n\n70.\n"
    wanted = 70.0 * (F / L if c <= 3 else F * L) * np.outer(d.ravel(), d.ravel())
    found = on_nodes(deck(tmp_path, text), "K", (1, 2))
    assert found == pytest.approx(wanted, abs=1e-9 * np.abs(wanted).max())


# Constraints


def part(made, node: int, names: str, C: np.ndarray | None = None) -> np.ndarray:
    """Components (1 to 6) of a node along axes, over the dofs."""
    T, C = motions(structure_of(made), made, node), np.eye(3) if C is None else C
    return np.array([C[(int(c) - 1) % 3] @ T[3 * (int(c) > 3) : 3 * (int(c) > 3) + 3] for c in names])


def rigid(node: int, ref: int) -> np.ndarray:
    r = (np.array(AT[node]) - np.array(AT[ref])) * L
    S = np.array([[0, -r[2], r[1]], [r[2], 0, -r[0]], [-r[1], r[0], 0]])
    return np.block([[np.eye(3), -S], [np.zeros((3, 3)), np.eye(3)]])


@pytest.mark.parametrize(("kind", "about", "degrees"), TURNS[1:])
def test_couplings_carry_their_nodes_rigidly_in_the_components_that_they_name(tmp_path, kind, about, degrees):
    text = NODES + lumps(1, 2, 3, 4, 5) + orientation(kind, about, degrees) + "*NSET, NSET=S\n1, 2, 3\n"
    older = "*KINEMATIC COUPLING, REF NODE=4, ORIENTATION=O\nS, 2, 3\n"
    newer = "*SURFACE, NAME=F, TYPE=NODE\nS, 1.\n*COUPLING, CONSTRAINT NAME=C, REF NODE=4, SURFACE=F, ORIENTATION=O\n"
    for connection, names in ((older, "23"), (newer + "*KINEMATIC\n2, 3\n6\n", "236")):
        made = deck(tmp_path, text + connection)
        centre = motions(structure_of(made), made, 4)
        for n in (1, 2, 3):
            C = turned(basic(kind, np.array(AT[n])), about, degrees)
            T = np.kron(np.eye(2), C)
            moved = (T @ rigid(n, 4) @ centre)[[int(c) - 1 for c in names]]
            assert part(made, n, names, C) == pytest.approx(moved, abs=1e-9)
            assert np.linalg.matrix_rank(motions(structure_of(made), made, n) - rigid(n, 4) @ centre, 1e-9) == 6 - len(
                names
            )


@pytest.mark.parametrize(
    ("text", "names"),
    [
        ("*MPC\nBEAM, 1, 4\nTIE, 2, 4\nPIN, 3, 4\n", {1: "b", 2: "t", 3: "p"}),
        ("*NSET, NSET=S\n1, 2\n*MPC\nBEAM, S, 4\n", {1: "b", 2: "b"}),
        ("*NSET, NSET=P\n3\n*NSET, NSET=T\n1\n*RIGID BODY, PIN NSET=P, TIE NSET=T, REF NODE=4\n", {1: "b", 3: "r"}),
        ("*ELEMENT, TYPE=MASS, ELSET=E\n71, 1\n72, 3\n*MASS, ELSET=E\n1.\n*RIGID BODY, ELSET=E, REF NODE=4\n",
         {1: "b", 3: "b"}),
    ],
)  # fmt: skip
def test_beams_ties_and_pins_between_nodes(tmp_path, text, names):
    """b: rigid; r: its translations alone; t: all components alike; p: translations alike."""
    made = deck(tmp_path, NODES + lumps(1, 2, 3, 4, 5) + text)
    centre = motions(structure_of(made), made, 4)
    for n, name in names.items():
        own = motions(structure_of(made), made, n)
        follows = {"b": rigid(n, 4), "r": rigid(n, 4)[:3], "t": np.eye(6), "p": np.eye(6)[:3]}[name]
        assert own[: len(follows)] == pytest.approx(follows @ centre, abs=1e-9)
        rest = own - np.vstack([follows, np.zeros((6 - len(follows), 6))]) @ centre
        assert np.linalg.matrix_rank(rest, 1e-9) == 6 - len(follows)


@pytest.mark.parametrize("kind", "RCS")
def test_equations_hold_along_transformed_axes_in_the_units_of_the_deck(tmp_path, kind):
    """Two lines of terms; and one equation for each node of two sets."""
    words = ", ".join(f"{v:.12g}" for v in SYSTEMS[kind][1])
    text = NODES + lumps(1, 2, 3, 4) + f"*NSET, NSET=T\n1, 2\n*TRANSFORM, NSET=T, TYPE={kind}\n{words}\n"
    text += "*EQUATION\n5\n1, 2, 4., 2, 4, 3., 3, 3, -2., 1, 6, 5.,\n4, 5, -6.\n"
    made = deck(tmp_path, text)
    C = {n: basic(kind, np.array(AT[n])) if n < 3 else np.eye(3) for n in AT}
    u = lambda n, c: part(made, n, str(c), C[n])[0] / (L if c < 4 else 1.0)  # noqa: E731
    assert 4 * u(1, 2) + 3 * u(2, 4) - 2 * u(3, 3) + 5 * u(1, 6) - 6 * u(4, 5) == pytest.approx(0, abs=1e-9)
    sets = NODES + lumps(1, 2, 3, 4) + "*NSET, NSET=P\n1, 2\n*NSET, NSET=Q\n3, 4\n*EQUATION\n2\nP, 2, 2., Q, 3, -3.\n"
    made = deck(tmp_path, sets)
    for p, q in ((1, 3), (2, 4)):
        assert 2 * part(made, p, "2") == pytest.approx(3 * part(made, q, "3"), abs=1e-12)
    one = NODES + lumps(1, 2, 3, 4) + "*NSET, NSET=P\n1, 2\n*EQUATION\n2\nP, 2, 2., 4, 3, -3.\n"
    made = deck(tmp_path, one)
    assert 2 * part(made, 2, "2") == pytest.approx(3 * part(made, 4, "3"), abs=1e-12)


CLOUD = (
    "*ELEMENT, TYPE=MASS, ELSET=CLOUD\n91, 1\n92, 2\n93, 3\n*MASS, ELSET=CLOUD\n2.\n"  # nothing else moves these nodes
)
BEAMS = "*ELEMENT, TYPE=B31, ELSET=B\n81, 1, 2\n82, 2, 3\n*BEAM SECTION, SECTION=RECT, ELSET=B, MATERIAL=METAL\n"
BEAMS += ".8, 1.4\n1., 2., 3.\n"


@pytest.mark.parametrize("nodes", [BEAMS, CLOUD], ids=["beams", "masses"])
@pytest.mark.parametrize("weights", [{1: 2.0, 2: 0.5, 3: 1.0}, {3: 2.0, 1: 0.5, 2: 1.5}])
def test_a_distributing_coupling_is_the_weighted_least_squares_of_its_nodes(tmp_path, weights, nodes):
    text = NODES + METAL + nodes
    text += "*ELEMENT, TYPE=DCOUP3D, ELSET=D\n800, 4\n*DISTRIBUTING COUPLING, ELSET=D\n"
    text += "".join(f"{n}, {w}\n" for n, w in weights.items())
    made = deck(tmp_path, text)
    rows = [np.sqrt(w) * rigid(n, 4)[:3] for n, w in weights.items()]
    moved = [np.sqrt(w) * part(made, n, "123") for n, w in weights.items()]
    best = np.linalg.lstsq(np.concatenate(rows), np.concatenate(moved), rcond=None)[0]
    found = motions(structure_of(made), made, 4)
    assert found == pytest.approx(best, abs=1e-8 * np.abs(best).max())


# Sections of beams


TIP = np.array([4.0, 3.0, 2.5]) - np.array([1.0, 2.0, 0.5])
T = TIP / np.linalg.norm(TIP)
N1 = np.array([0.2, 1.0, 0.3])
FIRST = (N1 - (N1 @ T) * T) / np.linalg.norm(N1 - (N1 @ T) * T)
SECOND = np.cross(T, FIRST)
LINE = "*NODE\n1, 1., 2., .5\n2, 4., 3., 2.5\n*ELEMENT, TYPE={kind}, ELSET=B\n1, 1, 2\n"


def rects(*boxes: tuple[float, float, float, float]) -> tuple[float, np.ndarray, np.ndarray]:
    """Area, centroid over (1, 2) and int r r^T dA about it, of boxes from low to high: 1, 1, 2, 2."""
    area = [(b - a) * (d - c) for a, b, c, d in boxes]
    at = np.array([[(a + b) / 2, (c + d) / 2] for a, b, c, d in boxes])
    centre = np.array(area) @ at / sum(area)
    I = np.zeros((2, 2))
    for (a, b, c, d), A, x in zip(boxes, area, at, strict=True):
        I += A * (np.diag([(b - a) ** 2, (d - c) ** 2]) / 12 + np.outer(x - centre, x - centre))
    return sum(area), centre, I


SHAPES = {
    "RECT": ("0.8, 1.4", rects((-0.4, 0.4, -0.7, 0.7)), 0.85),
    "I": ("0.5, 2., 1.2, 0.8, 0.2, 0.15, 0.1",
          rects((-0.6, 0.6, -0.5, -0.3), (-0.05, 0.05, -0.3, 1.35), (-0.4, 0.4, 1.35, 1.5)), 0.44),
    "T": ("1.2, 2., 0.6, 0.2, 0.1", rects((-0.05, 0.05, -0.6, 1.2), (-0.6, 0.6, 1.2, 1.4)), 0.44),
    "L": ("1.5, 1.1, 0.2, 0.1", rects((-0.05, 1.45, -0.1, 0.1), (-0.05, 0.05, 0.1, 1.0)), 1.0),
}  # fmt: skip


def tensor(member) -> np.ndarray:
    """Bending stiffness int E r r^T dA of a member over the basic axes [N m^2]."""
    y = np.asarray(member.options["orientation"])
    y = (y - (y @ T) * T) / np.linalg.norm(y - (y @ T) * T)
    z = np.cross(T, y)
    return float(member.section.EIz) * np.outer(y, y) + float(member.section.EIy) * np.outer(z, z)


@pytest.mark.parametrize("kind", SHAPES)
def test_a_beam_section_bends_about_the_axes_of_its_figure(tmp_path, kind):
    """Area, second moments and the centroid from the nodes, over directions 1 and 2 = t x 1."""
    data, (A, centre, I), factor = SHAPES[kind]
    text = LINE.format(kind="B31") + METAL
    text += f"*BEAM SECTION, SECTION={kind}, ELSET=B, MATERIAL=METAL\n{data}\n{N1[0]}, {N1[1]}, {N1[2]}\n"
    (member,) = deck(tmp_path, text).members
    s, P = member.section, np.array([FIRST, SECOND])
    wanted = P.T @ I @ P * E * F * L**2
    assert s.EA == pytest.approx(E * A * F) and tensor(member) == pytest.approx(wanted, abs=1e-9 * wanted.max())
    assert s.mass_per_length == pytest.approx(RHO * A * MASS / L)
    assert s.mass_per_length * (s.ry**2 + s.rz**2) == pytest.approx(RHO * np.trace(I) * MASS * L)
    assert s.EIy * s.rz**2 == pytest.approx(s.EIz * s.ry**2)
    assert [s.GAy, s.GAz] == pytest.approx([factor * G * A * F] * 2)
    y = np.asarray(member.options["orientation"])
    offset = np.asarray(member.options.get("offset", (0.0, 0.0)))
    assert offset @ np.array([y, np.cross(T, y)]) == pytest.approx(centre * L @ P, abs=1e-12)


def test_a_section_by_numbers_has_them_about_its_axes_and_shears_as_given(tmp_path):
    """A, I11 = int 2^2 dA, I12, I22, J; then n1; then E, G; DENSITY; K23 and K13 of equal size."""
    text = LINE.format(kind="B31")
    text += f"*BEAM GENERAL SECTION, SECTION=GENERAL, ELSET=B, DENSITY={RHO}\n.9, .3, .11, .5, .2\n"
    text += f"{N1[0]}, {N1[1]}, {N1[2]}\n{E}, {G}\n"
    (member,) = deck(tmp_path, text + "*TRANSVERSE SHEAR STIFFNESS\n3000., 3000.\n").members
    s, P = member.section, np.array([FIRST, SECOND])
    wanted = P.T @ np.array([[0.5, 0.11], [0.11, 0.3]]) @ P * E * F * L**2
    assert tensor(member) == pytest.approx(wanted, abs=1e-9 * wanted.max())
    assert [s.EA, s.GJ, s.GAy, s.GAz] == pytest.approx([E * 0.9 * F, G * 0.2 * F * L**2, 3000 * F, 3000 * F])
    assert s.mass_per_length == pytest.approx(RHO * 0.9 * MASS / L) and member.options["shear"] is True
    (other,) = deck(tmp_path, text.replace(".11", "0.") + "*TRANSVERSE SHEAR STIFFNESS\n3000., 500.\n").members
    y = np.asarray(other.options["orientation"])
    assert abs(y @ SECOND) == pytest.approx(1.0)
    assert [other.section.GAy, other.section.GAz] == pytest.approx([3000 * F, 500 * F])
    (plain,) = deck(tmp_path, text).members
    assert plain.section.GAy == pytest.approx(G * 0.9 * F)


@pytest.mark.parametrize(
    ("kind", "data", "A", "I2", "I1", "J"),
    [  # I2 = int 2^2 dA; I1 = int 1^2 dA
        ("CIRC", "0.7, 0.4", np.pi * 0.28, np.pi / 4 * 0.7 * 0.4**3, np.pi / 4 * 0.7**3 * 0.4,
         np.pi * 0.28**3 / (0.49 + 0.16)),
        ("PIPE", "0.7, 0.1", np.pi * 0.13, np.pi / 4 * (0.7**4 - 0.6**4), np.pi / 4 * (0.7**4 - 0.6**4),
         np.pi / 2 * (0.7**4 - 0.6**4)),
        ("RECT", "0.9", 0.81, 0.9**4 / 12, 0.9**4 / 12, 0.1406 * 0.9**4),
    ],
)  # fmt: skip
def test_round_and_square_sections(tmp_path, kind, data, A, I2, I1, J):
    text = LINE.format(kind="B31") + METAL
    text += f"*BEAM SECTION, SECTION={kind}, ELSET=B, MATERIAL=METAL\n{data}\n{N1[0]}, {N1[1]}, {N1[2]}\n"
    (member,) = deck(tmp_path, text).members
    wanted = (I1 * np.outer(FIRST, FIRST) + I2 * np.outer(SECOND, SECOND)) * E * F * L**2
    assert tensor(member) == pytest.approx(wanted, abs=1e-9 * wanted.max())
    assert member.section.EA == pytest.approx(E * A * F)
    assert member.section.GJ == pytest.approx(G * J * F * L**2, rel=1e-3)


def test_a_box_of_four_walls_bends_about_its_centroid(tmp_path):
    """Walls at +1, +2, -1, -2, each of its own thickness; Bredt's torsion of the middle lines and the walls'.

    The nodes are at the middle of the box, and the centroid is off them.
    """
    a, b, right, top, left, bottom = 1.6, 2.2, 0.1, 0.2, 0.3, 0.15
    text = LINE.format(kind="B31") + METAL + "*BEAM SECTION, SECTION=BOX, ELSET=B, MATERIAL=METAL\n"
    text += f"{a}, {b}, {right}, {top}, {left}, {bottom}\n{N1[0]}, {N1[1]}, {N1[2]}\n"
    (member,) = deck(tmp_path, text).members
    A, centre, I = rects(
        (-a / 2, a / 2, -b / 2, -b / 2 + bottom), (-a / 2, a / 2, b / 2 - top, b / 2),
        (-a / 2, -a / 2 + left, -b / 2 + bottom, b / 2 - top), (a / 2 - right, a / 2, -b / 2 + bottom, b / 2 - top),
    )  # fmt: skip
    P = np.array([FIRST, SECOND])
    wanted = P.T @ I @ P * E * F * L**2
    assert member.section.EA == pytest.approx(E * A * F)
    assert tensor(member) == pytest.approx(wanted, abs=1e-9 * wanted.max())
    w, h = a - (left + right) / 2, b - (top + bottom) / 2
    J = 4 * (w * h) ** 2 / (w / top + w / bottom + h / left + h / right)
    J += (a * (top**3 + bottom**3) + b * (left**3 + right**3)) / 3
    assert member.section.GJ == pytest.approx(G * J * F * L**2)
    y = np.asarray(member.options["orientation"])
    y = (y - (y @ T) * T) / np.linalg.norm(y - (y @ T) * T)
    off = np.asarray(member.options["offset"]) @ np.array([y, np.cross(T, y)])
    assert off == pytest.approx(centre * L @ P, abs=1e-12) and np.linalg.norm(off) > 0.1 * L


# Materials and shells


def solid(material: str) -> str:
    text = "*NODE\n1, 0., 0., 0.\n2, 1., 0., 0.\n3, 0., 1., 0.\n4, 0., 0., 1.\n"
    text += "*ELEMENT, TYPE=C3D4, ELSET=V\n1, 1, 2, 3, 4\n"
    return f"{text}*MATERIAL, NAME=M\n{material}*DENSITY\n{RHO}\n*SOLID SECTION, ELSET=V, MATERIAL=M\n"


def test_every_entry_of_an_elastic_matrix_keeps_its_place(tmp_path):
    rng = np.random.default_rng(5)
    X = rng.standard_normal((6, 6))
    C = (X @ X.T + 6 * np.eye(6)) * 1e6
    own, card = ["11", "22", "33", "23", "13", "12"], ["11", "22", "33", "12", "13", "23"]
    at = np.ix_([card.index(n) for n in own], [card.index(n) for n in own])
    words = [f"{C[i, j]:.10g}" for j in range(6) for i in range(j + 1)]
    rows = "\n".join(", ".join(words[k : k + 8]) for k in (0, 8, 16))
    (member,) = deck(tmp_path, solid(f"*ELASTIC, TYPE=ANISOTROPIC\n{rows}\n")).members
    assert np.asarray(member.material.C) == pytest.approx(C[at] * F / L**2, rel=1e-8)
    assert member.material.density == pytest.approx(RHO * MASS / L**3)
    D = np.diag(np.diag(C)).copy()
    D[:3, :3] = C[:3, :3]
    words = [f"{D[p]:.10g}" for p in ((0, 0), (0, 1), (1, 1), (0, 2), (1, 2), (2, 2), (3, 3), (4, 4), (5, 5))]
    text = solid(f"*ELASTIC, TYPE=ORTHOTROPIC\n{', '.join(words[:8])}\n{words[8]}\n")
    (member,) = deck(tmp_path, text).members
    assert np.asarray(member.material.C) == pytest.approx(D[at] * F / L**2, rel=1e-8)


def test_engineering_constants_are_read_by_their_names(tmp_path):
    words = "9.E6, 8.E6, 7.E6, .21, .22, .23, 3.E6, 2.E6,\n1.E6"
    (member,) = deck(tmp_path, solid(f"*ELASTIC, TYPE=ENGINEERING CONSTANTS\n{words}\n")).members
    m, p = member.material, F / L**2
    assert [m.E1, m.E2, m.E3, m.G12, m.G13, m.G23] == pytest.approx(
        [9e6 * p, 8e6 * p, 7e6 * p, 3e6 * p, 2e6 * p, 1e6 * p]
    )
    assert [m.nu12, m.nu13, m.nu23] == [0.21, 0.22, 0.23]


PATCH = (
    "*NODE\n1, 0., 0., 0.\n2, 2., .3, 0.\n3, 2.2, 1.5, 0.\n4, .1, 1.3, 0.\n*ELEMENT, TYPE=S4, ELSET=P\n1, 1, 2, 3, 4\n"
)
FIBRE = "*MATERIAL, NAME=CF\n*ELASTIC, TYPE=LAMINA\n2.E7, 1.5E6, .28, 7.E5, 6.E5, 4.E5\n*DENSITY\n1.4E-4\n"
QF = np.array([[2e7, 0.28 * 1.5e6, 0], [0.28 * 1.5e6, 1.5e6, 0], [0, 0, 7e5 * (1 - 0.28**2 * 0.075)]])
QF = QF / (1 - 0.28**2 * 0.075)
QM = E / (1 - NU**2) * np.array([[1, NU, 0], [NU, 1, 0], [0, 0, (1 - NU) / 2]])


def stacked(plies: list[tuple[np.ndarray, float, float]]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A, B, D about the middle of plies (Q, thickness, degrees), bottom first."""
    z = -sum(t for _, t, _ in plies) / 2
    out = np.zeros((3, 3, 3))
    for Q, t, degrees in plies:
        c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
        R = np.array([[c * c, s * s, c * s], [s * s, c * c, -c * s], [-2 * c * s, 2 * c * s, c * c - s * s]])
        out += [R.T @ Q @ R * ((z + t) ** k - z**k) / k for k in (1, 2, 3)]
        z += t
    return tuple(out)


@pytest.mark.parametrize("symmetric", [False, True])
@pytest.mark.parametrize("offset", ["", "SPOS", "SNEG", "0.3"])
def test_plies_are_stacked_from_the_bottom_with_their_angles_or_orientations(tmp_path, symmetric, offset):
    """The orientation of the second ply turns by -40 deg about z from x, and the section's axis 1 is x."""
    text = PATCH + METAL + FIBRE + "*ORIENTATION, NAME=W\n1., 0., 0., 0., 1., 0.\n3, -40.\n"
    flags = (", SYMMETRIC" if symmetric else "") + (f", OFFSET={offset}" if offset else "")
    text += f"*SHELL SECTION, ELSET=P, COMPOSITE{flags}\n.05, 3, CF, 30.\n.08, 3, CF, W\n.03, 3, METAL, 0.\n"
    (member,) = deck(tmp_path, text).members
    plies = [(QF, 0.05, 30.0), (QF, 0.08, -40.0), (QM, 0.03, 0.0)]
    plies = plies + plies[::-1] if symmetric else plies
    A, B, D = stacked(plies)
    s, total = member.section, sum(t for _, t, _ in plies)
    assert s.A == pytest.approx(A * F / L, abs=1e-6 * A.max() * F / L)
    assert s.B == pytest.approx(B * F, abs=1e-7 * A.max() * F * total)
    assert s.D == pytest.approx(D * F * L, abs=1e-6 * D.max() * F * L)
    assert np.asarray(member.options["axis"]) == pytest.approx([1.0, 0, 0], abs=1e-9)
    share = {"": 0.0, "SPOS": 0.5, "SNEG": -0.5, "0.3": 0.3}[offset]
    assert member.options.get("offset", 0.0) == pytest.approx(-share * total * L)
    scaled = deck(tmp_path, text, P={"thickness": 2 * total * L}).members[0].section
    assert scaled.D == pytest.approx(8 * s.D, rel=1e-6)


@pytest.mark.parametrize("shear", ["", "900., 700., 50.", "900."])
def test_a_shell_by_its_stiffness_has_all_21_of_them(tmp_path, shear):
    rng = np.random.default_rng(8)
    X = rng.standard_normal((6, 6))
    K = (X @ X.T + 6 * np.eye(6)) * 100.0
    K[:3, 3:] = K[3:, :3] = (K[:3, 3:] + K[3:, :3]) / 2
    words = [f"{K[i, j]:.10g}" for j in range(6) for i in range(j + 1)]
    rows = "\n".join(", ".join(words[k : k + 8]) for k in (0, 8, 16))
    text = PATCH + f"*SHELL GENERAL SECTION, ELSET=P, DENSITY=3.E-4\n{rows}\n"
    text += f"*TRANSVERSE SHEAR STIFFNESS\n{shear}\n" if shear else ""
    s = deck(tmp_path, text).members[0].section
    assert s.A == pytest.approx(K[:3, :3] * F / L) and s.B == pytest.approx(K[:3, 3:] * F)
    assert s.D == pytest.approx(K[3:, 3:] * F * L) and s.mass == pytest.approx(3e-4 * MASS / L**2)
    default = (K[0, 0] + K[1, 1]) / 6 + K[2, 2] / 3
    S = {"": np.diag([default] * 2), "900.": np.diag([900.0] * 2)}.get(shear, np.array([[900.0, 50.0], [50.0, 700.0]]))
    assert s.S == pytest.approx(S * F / L)
    h2 = 12 * np.trace(K[3:, 3:]) / np.trace(K[:3, :3])
    assert s.thickness == pytest.approx(np.sqrt(h2) * L) and s.rotary == pytest.approx(3e-4 * h2 / 12 * MASS)


def test_a_membrane_stretches_alone_and_weighs_as_a_sheet(tmp_path):
    s = deck(tmp_path, PATCH + METAL + "*MEMBRANE SECTION, ELSET=P, MATERIAL=METAL\n.2\n").members[0].section
    assert s.A == pytest.approx(QM * 0.2 * F / L, abs=1e-9 * E * F) and s.mass == pytest.approx(RHO * 0.2 * MASS / L**2)
    assert np.abs(s.D).max() < 1e-8 * np.abs(s.A).max() * (0.2 * L) ** 2 and s.rotary == 0.0


@pytest.mark.parametrize(
    ("kind", "about", "degrees"), [("R", 3, 25.0), ("C", 1, -30.0), ("C", 3, 15.0), ("S", 2, 40.0)]
)
def test_the_axis_of_a_shell_is_that_after_the_named_one_laid_into_it_and_turned(tmp_path, kind, about, degrees):
    text = PATCH + FIBRE + orientation(kind, about, degrees)
    text += "*SHELL SECTION, ELSET=P, COMPOSITE, ORIENTATION=O\n.05, 3, CF, 0.\n"
    found = np.asarray(deck(tmp_path, text).members[0].options["axis"])
    centre = np.array([[0, 0, 0], [2, 0.3, 0], [2.2, 1.5, 0], [0.1, 1.3, 0]]).mean(axis=0)
    axis = basic(kind, centre)[about % 3]
    axis = np.array([axis[0], axis[1], 0.0]) / np.linalg.norm(axis[:2])
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    assert found == pytest.approx([c * axis[0] - s * axis[1], s * axis[0] + c * axis[1], 0.0], abs=1e-7)


# Instances, supports and surfaces


def test_what_stands_in_a_turned_instance_turns_with_it(tmp_path):
    """Shift and then a turn by 70 deg about a line: nodes, n1, inertias, orientations and transforms."""
    shift, p, q, degrees = np.array([1.0, 2.0, -0.5]), np.array([0.3, 0.1, 0.2]), np.array([1.0, 0.9, 0.4]), 70.0
    e = (q - p) / np.linalg.norm(q - p)
    S = np.array([[0, -e[2], e[1]], [e[2], 0, -e[0]], [-e[1], e[0], 0]])
    a = np.radians(degrees)
    C = np.eye(3) + np.sin(a) * S + (1 - np.cos(a)) * S @ S
    text = "*PART, NAME=A\n" + LINE.format(kind="B31") + "*NODE\n3, 2., 1., 3.\n*NSET, NSET=END\n2\n"
    text += f"*BEAM SECTION, SECTION=RECT, ELSET=B, MATERIAL=METAL\n.8, 1.4\n{N1[0]}, {N1[1]}, {N1[2]}\n"
    text += orientation("R", 1, 20.0) + "*ELEMENT, TYPE=ROTARYI, ELSET=J\n13, 2\n14, 3\n*ELSET, ELSET=J1\n13\n"
    text += "*ELSET, ELSET=J2\n14\n*ROTARY INERTIA, ELSET=J1\n5., 6., 7.\n*ROTARY INERTIA, ELSET=J2, ORIENTATION=O\n"
    words = ", ".join(f"{v:.12g}" for v in SYSTEMS["C"][1])
    text += f"5., 6., 7.\n*TRANSFORM, NSET=END, TYPE=C\n{words}\n*END PART\n*ASSEMBLY, NAME=S\n"
    text += f"*INSTANCE, NAME=I, PART=A\n{shift[0]}, {shift[1]}, {shift[2]}\n"
    text += ", ".join(f"{v}" for v in [*p, *q, degrees]) + "\n*END INSTANCE\n*END ASSEMBLY\n"
    made = deck(tmp_path, text + METAL + "*BOUNDARY\nI.2, 1\n")
    points = made.mesh.points[made.mesh.cells["line"][0]]
    x = np.array([[1.0, 2.0, 0.5], [4.0, 3.0, 2.5]])
    assert points == pytest.approx(((x + shift - p) @ C.T + p) * L)
    y = np.asarray(made.members[0].options["orientation"])
    assert np.cross(y, C @ SECOND) == pytest.approx(0.0, abs=1e-9)
    J = np.diag([5.0, 6.0, 7.0]) * MASS * L**2
    O = turned(axes_of(A, B), 1, 20.0)
    plain, skew = (np.asarray(one.inertia) for one in made.point_masses)
    assert plain == pytest.approx(C @ J @ C.T, rel=1e-9) and skew == pytest.approx(C @ O.T @ J @ O @ C.T, rel=1e-9)
    (support,) = made.held(["initial"]).values()
    assert np.asarray(support.axes) == pytest.approx(basic("C", x[1]) @ C.T, abs=1e-8)


def held(made, names=None) -> dict[int, str]:
    """Components 1 to 6 that are held at each node, along whatever axes."""
    found: dict[int, set[int]] = {}
    number = {row: n for n, row in made.points_of_ids.items()}
    for group, support in made.held(names).items():
        for row in made.mesh.group_points(group):
            own = found.setdefault(number[row], set())
            own |= {("x", "y", "z", "rx", "ry", "rz").index(c) + 1 for c in support.components}
    return {n: "".join(map(str, sorted(own))) for n, own in sorted(found.items())}


CHAIN = "*NODE\n" + "".join(f"{n}, {n}., 0., 0.\n" for n in range(1, 10)) + "*ELEMENT, TYPE=B31, ELSET=B\n"
CHAIN += "".join(f"{n}, {n}, {n + 1}\n" for n in range(1, 9)) + METAL
CHAIN += "*BEAM SECTION, SECTION=RECT, ELSET=B, MATERIAL=METAL\n.8, 1.4\n"


def test_named_and_numbered_supports_hold_their_components(tmp_path):
    names = {1: "ENCASTRE", 2: "PINNED", 3: "XSYMM", 4: "YSYMM", 5: "ZSYMM", 6: "XASYMM", 7: "YASYMM", 8: "ZASYMM"}
    text = CHAIN + "*BOUNDARY\n" + "".join(f"{n}, {name}\n" for n, name in names.items()) + "9, 2, 3\n9, 5\n"
    wanted = {1: "123456", 2: "123", 3: "156", 4: "246", 5: "345", 6: "234", 7: "135", 8: "126", 9: "235"}
    assert held(deck(tmp_path, text)) == wanted


def test_steps_add_to_and_replace_the_supports_before_them(tmp_path):
    text = (
        CHAIN
        + "*BOUNDARY\n1, 1, 3\n*STEP\n*STATIC\n*BOUNDARY\n2, 2\n*END STEP\n*STEP\n*STATIC\n*BOUNDARY, OP=NEW\n3, 3\n"
    )
    text += "*END STEP\n*STEP\n*FREQUENCY\n*BOUNDARY\n4, 4\n*END STEP\n*STEP\n*FREQUENCY\n*BOUNDARY\n5, 5\n*END STEP\n"
    made = deck(tmp_path, text)
    assert held(made, ["initial"]) == {1: "123"} and held(made, ["step 1"]) == {1: "123", 2: "2"}
    assert (
        held(made, ["step 2"]) == {3: "3"} and held(made) == {3: "3", 4: "4"} and made.default_supports == ("step 3",)
    )
    assert deck(tmp_path, CHAIN + "*BOUNDARY\n1, 1, 3\n").default_supports == ("initial",)


def test_steps_that_no_line_ends_are_kept_like_others(tmp_path):
    text = CHAIN + "*BOUNDARY\n1, 1, 3\n*STEP\n*STATIC\n*BOUNDARY\n2, 2\n*STEP\n*FREQUENCY\n*BOUNDARY\n3, 3\n\n"
    text += "*STEP\n*STATIC\n*BOUNDARY, OP=NEW\n4, 4\n"
    made = deck(tmp_path, text)
    wanted = {"initial": {1: "123"}, "step 1": {1: "123", 2: "2"}, "step 2": {1: "123", 2: "2", 3: "3"}}
    wanted["step 3"] = {4: "4"}
    assert {name: held(made, [name]) for name in made.supports} == wanted
    assert made.default_supports == ("step 2",)


def test_supports_of_dependent_components_are_left_out_with_both_named(tmp_path):
    made = deck(tmp_path, CHAIN + "*NODE\n20, 9., 1., 0.\n*MPC\nBEAM, 20, 9\n*BOUNDARY\n20, 2, 3\n1, 1, 6\n")
    assert held(made) == {1: "123456"}
    assert any("components [2, 3] of node 20 are supported, but depend on" in n and "*MPC BEAM of node 20" in n
               for n in made.notes)  # fmt: skip


def test_rotations_of_a_rigid_body_of_calculix_are_those_of_its_node(tmp_path):
    """Components 1 to 3 of the ROT NODE are the rotations of the REF NODE."""
    text = CHAIN + "*NODE\n20, 9., 1., 0.\n21, 9., 1., 0.\n*NSET, NSET=S\n9\n"
    text += "*RIGID BODY, NSET=S, REF NODE=20, ROT NODE=21\n*BOUNDARY\n21, 1, 2\n20, 3\n1, 1, 6\n"
    assert held(deck(tmp_path, text)) == {1: "123456", 20: "345"}


FACES = {  # of the manual, corners from 1
    "C3D4": "123 142 243 341", "C3D6": "123 465 1452 2563 3641", "C3D8": "1234 5876 1562 2673 3784 4851",
    "C3D5": "1234 152 253 354 451",
}  # fmt: skip


@pytest.mark.parametrize(
    ("kind", "cell"),
    [("C3D4", "tetra10"), ("C3D6", "wedge15"), ("C3D8", "hexahedron20"), ("C3D4", "tetra"), ("C3D8", "hexahedron"),
     ("C3D5", "pyramid")],
)  # fmt: skip
def test_a_face_has_its_corners_and_the_middles_of_its_edges(kind, cell):
    made = CELL_TYPES[cell]
    nodes = tuple(100 + k for k in range(len(made.nodes)))
    element = Element(kind=kind, cell=cell, nodes=nodes, extra=(), number=1, place="a.inp, line 1")
    for k, corners in enumerate(FACES[kind].split(), 1):
        own = {int(c) - 1 for c in corners}
        wanted = set(own)
        for j, parents in enumerate(made.parents, made.n_corners):
            wanted |= {j} if set(parents.tolist()) <= own else set()
        assert {n - 100 for n in face_nodes(element, f"S{k}")} == wanted
        if cell in ("tetra10", "wedge15", "hexahedron20"):
            assert len(wanted) == 2 * len(own)
    assert face_nodes(element, "S9") == list(nodes)


def test_an_influence_radius_counts_from_the_reference_in_the_units_of_the_deck(tmp_path):
    far = {n: np.linalg.norm(np.array(AT[n]) - np.array(AT[4])) for n in (1, 2, 3)}
    radius = sorted(far.values())[1] + 1e-3
    text = NODES + lumps(1, 2, 3, 4) + "*NSET, NSET=S\n1, 2, 3\n*SURFACE, NAME=F, TYPE=NODE\nS, 1.\n"
    text += f"*COUPLING, CONSTRAINT NAME=C, REF NODE=4, SURFACE=F, INFLUENCE RADIUS={radius}\n*KINEMATIC\n"
    made = deck(tmp_path, text)
    (one,) = made.connections
    number = {row: n for n, row in made.points_of_ids.items()}
    assert {number[r] for r in made.mesh.group_points(one.group)} == {n for n, d in far.items() if d < radius}


def test_of_two_sections_of_an_element_the_last_counts_and_overrides_name_their_set(tmp_path):
    text = CHAIN.split("*BEAM SECTION")[0].replace("B31", "T3D2") + "*ELSET, ELSET=C\n2, 3\n"
    text += "*SOLID SECTION, ELSET=B, MATERIAL=METAL\n.5\n*SOLID SECTION, ELSET=C, MATERIAL=METAL\n.7\n"
    made = deck(tmp_path, text, c={"area": 3e-4}, Metal={"E": 5e10})
    areas = {member.group: float(member.section.EA) / 5e10 for member in made.members}
    assert sorted(areas.values()) == pytest.approx(sorted([0.5 * L**2, 3e-4]))
    assert made.moduli == pytest.approx((5e10,)) and made.materials == ("METAL",)


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        (
            "*ORIENTATION, NAME=O, DEFINITION=OFFSET TO NODES\n1, 2\n",
            r"DEFINITION=OFFSET TO NODES, SYSTEM=R is not read",
        ),
        ("*JOINT, ELSET=B\n*SPRING\n7\n1.\n", r"\*SPRING has component 7; components are 1 to 6"),
        ("*JOINT, ELSET=B\n*SPRING\n1\n", r"\*SPRING of \*JOINT needs a component, and a stiffness in the next line"),
        ("*NSET, NSET=P\n1, 2\n*RIGID BODY, NSET=P, REF NODE=P\n", r"needs one node; 'P' has 2"),
        ("*NSET, NSET=P\n1, 2\n*NSET, NSET=Q\n3, 4, 5\n*MPC\nTIE, P, Q\n", r"\*MPC TIE of 2 nodes to 3; give as many"),
        ("*EQUATION\n2\n5, 7, 1., 4, 1, -1.\n", r"found factor 1 and component 7"),
    ],
)
def test_mistakes_name_their_numbers(tmp_path, text, sentence):
    with pytest.raises(DeckError, match=sentence):
        deck(tmp_path, CHAIN + text)


@pytest.mark.parametrize(("line", "about", "degrees"), [(", 35.", 1, 35.0), ("2", 2, 0.0), ("2, 25.", 2, 25.0)])
def test_an_orientation_turns_about_its_first_axis_where_the_line_names_none(tmp_path, line, about, degrees):
    text = NODES + orientation("R").rsplit("\n", 2)[0] + f"\n{line}\n"
    text += "*ELEMENT, TYPE=ROTARYI, ELSET=J\n13, 2\n*ROTARY INERTIA, ELSET=J, ORIENTATION=O\n5., 6., 7., .2, -.3, .4\n"
    text += "*ELEMENT, TYPE=MASS, ELSET=M\n11, 2\n*MASS, ELSET=M\n1.\n"
    C = turned(basic("R", np.array(AT[2])), about, degrees)
    wanted = C.T @ np.array([[5.0, 0.2, -0.3], [0.2, 6.0, 0.4], [-0.3, 0.4, 7.0]]) @ C * MASS * L**2
    found = on_nodes(deck(tmp_path, text), "M", (2,))[3:, 3:]
    assert found == pytest.approx(wanted, abs=1e-9 * np.abs(wanted).max())


def test_corners_without_a_nodal_thickness_have_that_of_their_section(tmp_path):
    """Mass and its centre of a rectangle of 2 x 1.2 in whose thickness is bilinear, 0.08 in at node 2 alone."""
    nodes = "*NODE\n1, 0., 0., 0.\n2, 2., 0., 0.\n3, 2., 1.2, 0.\n4, 0., 1.2, 0.\n"
    text = nodes + "*ELEMENT, TYPE=S4, ELSET=P\n1, 1, 2, 3, 4\n" + METAL
    text += "*SHELL SECTION, ELSET=P, MATERIAL=METAL, NODAL THICKNESS\n.05\n*NODAL THICKNESS\n2, .08\n"
    structure = deck(tmp_path, text).structure()
    T, M = structure.translation.toarray(), structure.M.toarray()
    move = np.linalg.pinv(T) @ np.kron(np.ones((T.shape[0] // 3, 1)), np.eye(3))
    mass = np.diag(move.T @ M @ move)
    assert mass == pytest.approx(RHO * 2.0 * 1.2 * (0.05 * 3 + 0.08) / 4 * MASS, rel=1e-9)
    wanted = "shell 1 has a thickness of -0.00203 m at a corner; give a positive one in \\*NODAL THICKNESS"
    with pytest.raises(DeckError, match=wanted.replace("0.00203", "0.002032")):
        deck(tmp_path, text.replace("2, .08", "2, -.08"))
