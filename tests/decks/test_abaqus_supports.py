"""Supports, steps and turned instances of Abaqus decks."""

from __future__ import annotations

import numpy as np
import pytest

from femflex.decks import read_deck

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


TIP = np.array([4.0, 3.0, 2.5]) - np.array([1.0, 2.0, 0.5])
T = TIP / np.linalg.norm(TIP)
N1 = np.array([0.2, 1.0, 0.3])
FIRST = (N1 - (N1 @ T) * T) / np.linalg.norm(N1 - (N1 @ T) * T)
SECOND = np.cross(T, FIRST)
LINE = "*NODE\n1, 1., 2., .5\n2, 4., 3., 2.5\n*ELEMENT, TYPE={kind}, ELSET=B\n1, 1, 2\n"


def test_turned_instance(tmp_path):
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
    imported = deck(tmp_path, text + METAL + "*BOUNDARY\nI.2, 1\n")
    points = imported.mesh.points[imported.mesh.cells["line"][0]]
    x = np.array([[1.0, 2.0, 0.5], [4.0, 3.0, 2.5]])
    assert points == pytest.approx(((x + shift - p) @ C.T + p) * L)
    y = np.asarray(imported.members[0].options["orientation"])
    assert np.cross(y, C @ SECOND) == pytest.approx(0.0, abs=1e-9)
    J = np.diag([5.0, 6.0, 7.0]) * MASS * L**2
    O = rotated_axes(axes_of(A, B), 1, 20.0)
    plain, skew = (np.asarray(mass.inertia) for mass in imported.point_masses)
    assert plain == pytest.approx(C @ J @ C.T, rel=1e-9) and skew == pytest.approx(C @ O.T @ J @ O @ C.T, rel=1e-9)
    (support,) = imported.active_supports(["initial"]).values()
    assert np.asarray(support.axes) == pytest.approx(basic("C", x[1]) @ C.T, abs=1e-8)


def supported_components(imported, names=None) -> dict[int, str]:
    """Components 1 to 6 that are supported at each node, along any axes."""
    components: dict[int, set[int]] = {}
    number = {row: n for n, row in imported.points_of_ids.items()}
    for group, support in imported.active_supports(names).items():
        for row in imported.mesh.group_points(group):
            numbers = components.setdefault(number[row], set())
            numbers |= {("x", "y", "z", "rx", "ry", "rz").index(c) + 1 for c in support.components}
    return {n: "".join(map(str, sorted(numbers))) for n, numbers in sorted(components.items())}


CHAIN = "*NODE\n" + "".join(f"{n}, {n}., 0., 0.\n" for n in range(1, 10)) + "*ELEMENT, TYPE=B31, ELSET=B\n"
CHAIN += "".join(f"{n}, {n}, {n + 1}\n" for n in range(1, 9)) + METAL
CHAIN += "*BEAM SECTION, SECTION=RECT, ELSET=B, MATERIAL=METAL\n.8, 1.4\n"


def test_named_and_numbered_supports(tmp_path):
    names = {1: "ENCASTRE", 2: "PINNED", 3: "XSYMM", 4: "YSYMM", 5: "ZSYMM", 6: "XASYMM", 7: "YASYMM", 8: "ZASYMM"}
    text = CHAIN + "*BOUNDARY\n" + "".join(f"{n}, {name}\n" for n, name in names.items()) + "9, 2, 3\n9, 5\n"
    expected = {1: "123456", 2: "123", 3: "156", 4: "246", 5: "345", 6: "234", 7: "135", 8: "126", 9: "235"}
    assert supported_components(deck(tmp_path, text)) == expected


def test_supports_of_steps(tmp_path):
    text = (
        CHAIN
        + "*BOUNDARY\n1, 1, 3\n*STEP\n*STATIC\n*BOUNDARY\n2, 2\n*END STEP\n*STEP\n*STATIC\n*BOUNDARY, OP=NEW\n3, 3\n"
    )
    text += "*END STEP\n*STEP\n*FREQUENCY\n*BOUNDARY\n4, 4\n*END STEP\n*STEP\n*FREQUENCY\n*BOUNDARY\n5, 5\n*END STEP\n"
    imported = deck(tmp_path, text)
    assert supported_components(imported, ["initial"]) == {1: "123"} and supported_components(imported, ["step 1"]) == {
        1: "123",
        2: "2",
    }
    assert (
        supported_components(imported, ["step 2"]) == {3: "3"}
        and supported_components(imported) == {3: "3", 4: "4"}
        and imported.default_supports == ("step 3",)
    )
    assert deck(tmp_path, CHAIN + "*BOUNDARY\n1, 1, 3\n").default_supports == ("initial",)


def test_rotations_of_a_calculix_rigid_body(tmp_path):
    """Components 1 to 3 of the ROT NODE are the rotations of the REF NODE."""
    text = CHAIN + "*NODE\n20, 9., 1., 0.\n21, 9., 1., 0.\n*NSET, NSET=S\n9\n"
    text += "*RIGID BODY, NSET=S, REF NODE=20, ROT NODE=21\n*BOUNDARY\n21, 1, 2\n20, 3\n1, 1, 6\n"
    assert supported_components(deck(tmp_path, text)) == {1: "123456", 20: "345"}
