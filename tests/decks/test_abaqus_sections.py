"""Beam sections, materials and shells of Abaqus decks in inches: every number against its formula."""

from __future__ import annotations

import numpy as np
import pytest

from femflex.decks import read_deck

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
def test_beam_sections_of_plates(tmp_path, kind):
    """Area, second moments and the centroid from the nodes, over directions 1 and 2 = t x 1."""
    data, (A, centre, I), factor = SHAPES[kind]
    text = LINE.format(kind="B31") + METAL
    text += f"*BEAM SECTION, SECTION={kind}, ELSET=B, MATERIAL=METAL\n{data}\n{N1[0]}, {N1[1]}, {N1[2]}\n"
    (member,) = deck(tmp_path, text).members
    s, P = member.section, np.array([FIRST, SECOND])
    expected = P.T @ I @ P * E * F * L**2
    assert s.EA == pytest.approx(E * A * F) and tensor(member) == pytest.approx(expected, abs=1e-9 * expected.max())
    assert s.mass_per_length == pytest.approx(RHO * A * MASS / L)
    assert s.mass_per_length * (s.ry**2 + s.rz**2) == pytest.approx(RHO * np.trace(I) * MASS * L)
    assert s.EIy * s.rz**2 == pytest.approx(s.EIz * s.ry**2)
    assert [s.GAy, s.GAz] == pytest.approx([factor * G * A * F] * 2)
    y = np.asarray(member.options["orientation"])
    offset = np.asarray(member.options.get("offset", (0.0, 0.0)))
    assert offset @ np.array([y, np.cross(T, y)]) == pytest.approx(centre * L @ P, abs=1e-12)


def test_general_beam_section(tmp_path):
    """A, I11 = int 2^2 dA, I12, I22, J; then n1; then E, G; DENSITY; K23 and K13 of equal size."""
    text = LINE.format(kind="B31")
    text += f"*BEAM GENERAL SECTION, SECTION=GENERAL, ELSET=B, DENSITY={RHO}\n.9, .3, .11, .5, .2\n"
    text += f"{N1[0]}, {N1[1]}, {N1[2]}\n{E}, {G}\n"
    (member,) = deck(tmp_path, text + "*TRANSVERSE SHEAR STIFFNESS\n3000., 3000.\n").members
    s, P = member.section, np.array([FIRST, SECOND])
    expected = P.T @ np.array([[0.5, 0.11], [0.11, 0.3]]) @ P * E * F * L**2
    assert tensor(member) == pytest.approx(expected, abs=1e-9 * expected.max())
    assert [s.EA, s.GJ, s.GAy, s.GAz] == pytest.approx([E * 0.9 * F, G * 0.2 * F * L**2, 3000 * F, 3000 * F])
    assert s.mass_per_length == pytest.approx(RHO * 0.9 * MASS / L) and member.options["shear"] is True
    (other,) = deck(tmp_path, text.replace(".11", "0.") + "*TRANSVERSE SHEAR STIFFNESS\n3000., 500.\n").members
    y = np.asarray(other.options["orientation"])
    assert abs(y @ SECOND) == pytest.approx(1.0)
    assert [other.section.GAy, other.section.GAz] == pytest.approx([3000 * F, 500 * F])
    (plain,) = deck(tmp_path, text).members
    assert plain.section.GAy == pytest.approx(G * 0.9 * F)


def test_box_of_four_walls(tmp_path):
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
    expected = P.T @ I @ P * E * F * L**2
    assert member.section.EA == pytest.approx(E * A * F)
    assert tensor(member) == pytest.approx(expected, abs=1e-9 * expected.max())
    w, h = a - (left + right) / 2, b - (top + bottom) / 2
    J = 4 * (w * h) ** 2 / (w / top + w / bottom + h / left + h / right)
    J += (a * (top**3 + bottom**3) + b * (left**3 + right**3)) / 3
    assert member.section.GJ == pytest.approx(G * J * F * L**2)
    y = np.asarray(member.options["orientation"])
    y = (y - (y @ T) * T) / np.linalg.norm(y - (y @ T) * T)
    off = np.asarray(member.options["offset"]) @ np.array([y, np.cross(T, y)])
    assert off == pytest.approx(centre * L @ P, abs=1e-12) and np.linalg.norm(off) > 0.1 * L


def solid(material: str) -> str:
    text = "*NODE\n1, 0., 0., 0.\n2, 1., 0., 0.\n3, 0., 1., 0.\n4, 0., 0., 1.\n"
    text += "*ELEMENT, TYPE=C3D4, ELSET=V\n1, 1, 2, 3, 4\n"
    return f"{text}*MATERIAL, NAME=M\n{material}*DENSITY\n{RHO}\n*SOLID SECTION, ELSET=V, MATERIAL=M\n"


def test_entries_of_elastic_matrices(tmp_path):
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
def test_composite_shells_by_ply_sums(tmp_path, symmetric, offset):
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
def test_general_shell_stiffness(tmp_path, shear):
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


@pytest.mark.parametrize(
    ("kind", "about", "degrees"), [("R", 3, 25.0), ("C", 1, -30.0), ("C", 3, 15.0), ("S", 2, 40.0)]
)
def test_shell_axis_of_an_orientation(tmp_path, kind, about, degrees):
    text = PATCH + FIBRE + orientation(kind, about, degrees)
    text += "*SHELL SECTION, ELSET=P, COMPOSITE, ORIENTATION=O\n.05, 3, CF, 0.\n"
    computed = np.asarray(deck(tmp_path, text).members[0].options["axis"])
    centre = np.array([[0, 0, 0], [2, 0.3, 0], [2.2, 1.5, 0], [0.1, 1.3, 0]]).mean(axis=0)
    axis = basic(kind, centre)[about % 3]
    axis = np.array([axis[0], axis[1], 0.0]) / np.linalg.norm(axis[:2])
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    assert computed == pytest.approx([c * axis[0] - s * axis[1], s * axis[0] + c * axis[1], 0.0], abs=1e-7)
