"""Masses, springs and constraints of Abaqus decks in inches and skew axes: whole matrices against formulas."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
import pytest

from femflex.decks import Deck, read_deck

L, F = 0.0254, 0.45359237 * 9.80665  # m, N
MASS = F / L  # kg of one lbf s^2 / in
E, NU, RHO = 1.0e7, 0.25, 2.5e-4
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


def rotated_axes(C: np.ndarray, about: int, degrees: float) -> np.ndarray:
    """Axes rotated about one of them (1 to 3)."""
    e = C[about - 1]
    S = np.array([[0, -e[2], e[1]], [e[2], 0, -e[0]], [-e[1], e[0], 0]])
    a = np.radians(degrees)
    return C @ (np.eye(3) + np.sin(a) * S + (1 - np.cos(a)) * S @ S).T


def orientation(kind: str, about: int = 3, degrees: float = 0.0) -> str:
    name, values = SYSTEMS[kind]
    words = ", ".join(f"{v:.12g}" for v in values)
    return f"*ORIENTATION, NAME=O, SYSTEM={name}\n{words}\n{about}, {degrees}\n"


@lru_cache(maxsize=1)
def structure_of(imported: Deck):
    return imported.structure()


def motions(structure, imported, node: int) -> np.ndarray:
    row = 3 * imported.points_of_ids[node]
    return np.concatenate([p[row : row + 3].toarray() for p in (structure.translation, structure.rotation)])


def on_nodes(imported, name: str, nodes: tuple[int, ...]) -> np.ndarray:
    structure = structure_of(imported)
    T = np.concatenate([motions(structure, imported, n) for n in nodes])
    return np.asarray(T @ getattr(structure, name).toarray() @ T.T)


def lumps(*nodes: int) -> str:
    text = ""
    for kind, key, data in (("MASS", "MASS", "1."), ("ROTARYI", "ROTARY INERTIA", "1., 1., 1.")):
        rows = "".join(f"{100 * len(kind) + n}, {n}\n" for n in nodes)
        text += f"*ELEMENT, TYPE={kind}, ELSET=L{kind}\n{rows}*{key}, ELSET=L{kind}\n{data}\n"
    return text


TURNS = [("R", 3, 0.0), ("R", 1, 35.0), ("C", 2, 20.0), ("C", 3, -50.0), ("S", 1, 0.0)]


@pytest.mark.parametrize(("kind", "about", "degrees"), TURNS)
def test_inertias_lie_along_their_orientation(tmp_path, kind, about, degrees):
    """I11, I22, I33, I12, I13, I23 as a tensor; two cards of mass and one of inertia at node 2."""
    text = NODES + orientation(kind, about, degrees)
    text += "*ELEMENT, TYPE=MASS, ELSET=M\n11, 2\n12, 2\n*MASS, ELSET=M\n1.25\n*ELEMENT, TYPE=ROTARYI, ELSET=J\n13, 2\n"
    text += "*ROTARY INERTIA, ELSET=J, ORIENTATION=O\n5., 6., 7., .2, -.3, .4\n"
    C = rotated_axes(basic(kind, np.array(AT[2])), about, degrees)
    J = np.array([[5.0, 0.2, -0.3], [0.2, 6.0, 0.4], [-0.3, 0.4, 7.0]])
    expected = np.zeros((6, 6))
    expected[:3, :3], expected[3:, 3:] = 2.5 * MASS * np.eye(3), C.T @ J @ C * MASS * L**2
    computed = on_nodes(deck(tmp_path, text), "M", (2,))
    assert computed == pytest.approx(expected, abs=1e-9 * np.abs(expected).max())


PAIRS = [(2, 1), (5, 4), (1, 6), (6, 2), (3, 3)]


@pytest.mark.parametrize(
    ("kind", "about", "degrees", "pair"), [(*turn, pair) for turn, pair in zip(TURNS, PAIRS, strict=True)]
)
def test_springs_between_components(tmp_path, kind, about, degrees, pair):
    """Energy k (u_a - u_b)^2 / 2 in the units of the deck; a turn counts in radians."""
    text = NODES + lumps(1, 2) + orientation(kind, about, degrees)
    text += f"*ELEMENT, TYPE=SPRING2, ELSET=S\n9, 1, 2\n*SPRING, ELSET=S, ORIENTATION=O\n{pair[0]}, {pair[1]}\n70.\n"
    d = np.zeros((2, 2, 3))
    for k, (node, c) in enumerate(zip((1, 2), pair, strict=True)):
        C = rotated_axes(basic(kind, np.array(AT[node])), about, degrees)
        d[k, int(c > 3)] = (-1) ** k * C[(c - 1) % 3] / (L if c <= 3 else 1.0)
    expected = 70.0 * F * L * np.outer(d.ravel(), d.ravel())
    computed = on_nodes(deck(tmp_path, text), "K", (1, 2))
    assert computed == pytest.approx(expected, abs=1e-9 * np.abs(expected).max())


@pytest.mark.parametrize("c", [2, 6])
@pytest.mark.parametrize("kind", ["SPRING1", "JOINTC", "SPRINGA"])
def test_springs_to_ground_joints_and_lines(tmp_path, kind, c):
    text = NODES + lumps(1, 2) + orientation("C", 1, 25.0)
    C = rotated_axes(basic("C", np.array(AT[1])), 1, 25.0)
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
    expected = 70.0 * (F / L if c <= 3 else F * L) * np.outer(d.ravel(), d.ravel())
    computed = on_nodes(deck(tmp_path, text), "K", (1, 2))
    assert computed == pytest.approx(expected, abs=1e-9 * np.abs(expected).max())


def component_rows(imported, node: int, names: str, C: np.ndarray | None = None) -> np.ndarray:
    """Components (1 to 6) of a node along axes, over the dofs."""
    T, C = motions(structure_of(imported), imported, node), np.eye(3) if C is None else C
    return np.array([C[(int(c) - 1) % 3] @ T[3 * (int(c) > 3) : 3 * (int(c) > 3) + 3] for c in names])


def rigid(node: int, ref: int) -> np.ndarray:
    r = (np.array(AT[node]) - np.array(AT[ref])) * L
    S = np.array([[0, -r[2], r[1]], [r[2], 0, -r[0]], [-r[1], r[0], 0]])
    return np.block([[np.eye(3), -S], [np.zeros((3, 3)), np.eye(3)]])


@pytest.mark.parametrize(("kind", "about", "degrees"), TURNS[1:])
def test_couplings_move_their_nodes_rigidly(tmp_path, kind, about, degrees):
    text = NODES + lumps(1, 2, 3, 4, 5) + orientation(kind, about, degrees) + "*NSET, NSET=S\n1, 2, 3\n"
    older = "*KINEMATIC COUPLING, REF NODE=4, ORIENTATION=O\nS, 2, 3\n"
    newer = "*SURFACE, NAME=F, TYPE=NODE\nS, 1.\n*COUPLING, CONSTRAINT NAME=C, REF NODE=4, SURFACE=F, ORIENTATION=O\n"
    for connection, names in ((older, "23"), (newer + "*KINEMATIC\n2, 3\n6\n", "236")):
        imported = deck(tmp_path, text + connection)
        centre = motions(structure_of(imported), imported, 4)
        for n in (1, 2, 3):
            C = rotated_axes(basic(kind, np.array(AT[n])), about, degrees)
            T = np.kron(np.eye(2), C)
            moved = (T @ rigid(n, 4) @ centre)[[int(c) - 1 for c in names]]
            assert component_rows(imported, n, names, C) == pytest.approx(moved, abs=1e-9)
            assert np.linalg.matrix_rank(
                motions(structure_of(imported), imported, n) - rigid(n, 4) @ centre, 1e-9
            ) == 6 - len(names)


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
def test_mpc_beams_ties_and_pins(tmp_path, text, names):
    """b: rigid; r: its translations alone; t: all components alike; p: translations alike."""
    imported = deck(tmp_path, NODES + lumps(1, 2, 3, 4, 5) + text)
    centre = motions(structure_of(imported), imported, 4)
    for n, name in names.items():
        own = motions(structure_of(imported), imported, n)
        follows = {"b": rigid(n, 4), "r": rigid(n, 4)[:3], "t": np.eye(6), "p": np.eye(6)[:3]}[name]
        assert own[: len(follows)] == pytest.approx(follows @ centre, abs=1e-9)
        rest = own - np.vstack([follows, np.zeros((6 - len(follows), 6))]) @ centre
        assert np.linalg.matrix_rank(rest, 1e-9) == 6 - len(follows)


@pytest.mark.parametrize("kind", "RCS")
def test_equations_along_transformed_axes(tmp_path, kind):
    """Two lines of terms; and one equation for each node of two sets."""
    words = ", ".join(f"{v:.12g}" for v in SYSTEMS[kind][1])
    text = NODES + lumps(1, 2, 3, 4) + f"*NSET, NSET=T\n1, 2\n*TRANSFORM, NSET=T, TYPE={kind}\n{words}\n"
    text += "*EQUATION\n5\n1, 2, 4., 2, 4, 3., 3, 3, -2., 1, 6, 5.,\n4, 5, -6.\n"
    imported = deck(tmp_path, text)
    C = {n: basic(kind, np.array(AT[n])) if n < 3 else np.eye(3) for n in AT}
    u = lambda n, c: component_rows(imported, n, str(c), C[n])[0] / (L if c < 4 else 1.0)  # noqa: E731
    assert 4 * u(1, 2) + 3 * u(2, 4) - 2 * u(3, 3) + 5 * u(1, 6) - 6 * u(4, 5) == pytest.approx(0, abs=1e-9)
    sets = NODES + lumps(1, 2, 3, 4) + "*NSET, NSET=P\n1, 2\n*NSET, NSET=Q\n3, 4\n*EQUATION\n2\nP, 2, 2., Q, 3, -3.\n"
    imported = deck(tmp_path, sets)
    for p, q in ((1, 3), (2, 4)):
        assert 2 * component_rows(imported, p, "2") == pytest.approx(3 * component_rows(imported, q, "3"), abs=1e-12)
    single_equation = NODES + lumps(1, 2, 3, 4) + "*NSET, NSET=P\n1, 2\n*EQUATION\n2\nP, 2, 2., 4, 3, -3.\n"
    imported = deck(tmp_path, single_equation)
    assert 2 * component_rows(imported, 2, "2") == pytest.approx(3 * component_rows(imported, 4, "3"), abs=1e-12)


CLOUD = (
    "*ELEMENT, TYPE=MASS, ELSET=CLOUD\n91, 1\n92, 2\n93, 3\n*MASS, ELSET=CLOUD\n2.\n"  # nothing else moves these nodes
)
BEAMS = "*ELEMENT, TYPE=B31, ELSET=B\n81, 1, 2\n82, 2, 3\n*BEAM SECTION, SECTION=RECT, ELSET=B, MATERIAL=METAL\n"
BEAMS += ".8, 1.4\n1., 2., 3.\n"


@pytest.mark.parametrize("nodes", [BEAMS, CLOUD], ids=["beams", "masses"])
@pytest.mark.parametrize("weights", [{1: 2.0, 2: 0.5, 3: 1.0}, {3: 2.0, 1: 0.5, 2: 1.5}])
def test_distributing_coupling_by_weighted_least_squares(tmp_path, weights, nodes):
    text = NODES + METAL + nodes
    text += "*ELEMENT, TYPE=DCOUP3D, ELSET=D\n800, 4\n*DISTRIBUTING COUPLING, ELSET=D\n"
    text += "".join(f"{n}, {w}\n" for n, w in weights.items())
    imported = deck(tmp_path, text)
    rows = [np.sqrt(w) * rigid(n, 4)[:3] for n, w in weights.items()]
    moved = [np.sqrt(w) * component_rows(imported, n, "123") for n, w in weights.items()]
    best = np.linalg.lstsq(np.concatenate(rows), np.concatenate(moved), rcond=None)[0]
    computed = motions(structure_of(imported), imported, 4)
    assert computed == pytest.approx(best, abs=1e-8 * np.abs(best).max())


TIP = np.array([4.0, 3.0, 2.5]) - np.array([1.0, 2.0, 0.5])
T = TIP / np.linalg.norm(TIP)


def test_influence_radius(tmp_path):
    far = {n: np.linalg.norm(np.array(AT[n]) - np.array(AT[4])) for n in (1, 2, 3)}
    radius = sorted(far.values())[1] + 1e-3
    text = NODES + lumps(1, 2, 3, 4) + "*NSET, NSET=S\n1, 2, 3\n*SURFACE, NAME=F, TYPE=NODE\nS, 1.\n"
    text += f"*COUPLING, CONSTRAINT NAME=C, REF NODE=4, SURFACE=F, INFLUENCE RADIUS={radius}\n*KINEMATIC\n"
    imported = deck(tmp_path, text)
    (connection,) = imported.connections
    number = {row: n for n, row in imported.points_of_ids.items()}
    assert {number[r] for r in imported.mesh.group_points(connection.group)} == {
        n for n, d in far.items() if d < radius
    }


@pytest.mark.parametrize(("line", "about", "degrees"), [(", 35.", 1, 35.0), ("2", 2, 0.0), ("2, 25.", 2, 25.0)])
def test_orientation_turns_about_its_first_axis(tmp_path, line, about, degrees):
    text = NODES + orientation("R").rsplit("\n", 2)[0] + f"\n{line}\n"
    text += "*ELEMENT, TYPE=ROTARYI, ELSET=J\n13, 2\n*ROTARY INERTIA, ELSET=J, ORIENTATION=O\n5., 6., 7., .2, -.3, .4\n"
    text += "*ELEMENT, TYPE=MASS, ELSET=M\n11, 2\n*MASS, ELSET=M\n1.\n"
    C = rotated_axes(basic("R", np.array(AT[2])), about, degrees)
    expected = C.T @ np.array([[5.0, 0.2, -0.3], [0.2, 6.0, 0.4], [-0.3, 0.4, 7.0]]) @ C * MASS * L**2
    computed = on_nodes(deck(tmp_path, text), "M", (2,))[3:, 3:]
    assert computed == pytest.approx(expected, abs=1e-9 * np.abs(expected).max())
