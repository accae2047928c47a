"""The drawn surface of beams: closed, outward, and moving with the sections."""

from __future__ import annotations

import numpy as np
import pytest

from femflex.fem import Material, Member, Structure, build_structure
from femflex.fem.sections import ISection, Rectangle
from femflex.mesh import line

MATERIAL = Material(70e9, 0.3, 2700.0)


def beam(path, n: int, section, **options) -> Structure:
    return build_structure(line(path, n), [Member("line", "beam", section, MATERIAL, options)])


def enclosed_volume(structure: Structure) -> float:
    """Volume by the divergence theorem; negative faces or open ends would show."""
    skin = structure.skin
    quads = skin.cells["quad"]
    faces = np.concatenate([skin.cells["triangle"], quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    a, b, c = skin.points[faces].swapaxes(0, 1)
    assert np.cross(b - a, c - a).sum(axis=0) == pytest.approx(np.zeros(3), abs=1e-12)  # closed
    return float(np.einsum("fi,fi->", a, np.cross(b, c)) / 6)


@pytest.mark.parametrize("section", [Rectangle(0.1, 0.2), ISection(0.2, 0.3, 0.03, 0.02)], ids=["rectangle", "I"])
def test_the_surface_encloses_the_section_times_the_length(section):
    structure = beam([[1, 2, 3], [3, 5, 9]], 3, section)
    area = section.properties(np.zeros(1), 1.0).A[0]
    assert enclosed_volume(structure) == pytest.approx(7 * area, rel=1e-12)


def test_a_pointed_taper_is_drawn_to_its_tip():
    structure = beam([[0, 0, 0], [6, 0, 0]], 3, Rectangle("0.2*(1 - s/L)", "0.1*(1 - s/L)"))
    assert enclosed_volume(structure) == pytest.approx(6 / 3 * 0.02, rel=1e-12)


def test_points_move_by_u_plus_theta_cross_offset():
    """Rigid motion is followed, and a cantilever bent to v = x^3 is drawn on it between its nodes too."""
    structure = beam([[0, 0, 0], [2, 0, 0]], 2, Rectangle(0.1, 0.2), orientation=[0, 1, 0], rotary_inertia=False)
    points, skin = structure.mesh.points, structure.skin
    shift, turn = np.array([1.0, -2.0, 0.5]), np.array([0.3, 0.2, -0.7])
    u = structure.translation.T @ (shift + np.cross(turn, points)).ravel() + structure.rotation.T @ np.tile(turn, 3)
    assert (skin.operator @ u).reshape(-1, 3) == pytest.approx(shift + np.cross(turn, skin.points), abs=1e-13)
    x, o = points[:, 0], np.zeros(3)
    v = structure.translation.T @ np.stack([o, x**3, o], axis=1).ravel()
    v = v + structure.rotation.T @ np.stack([o, o, 3 * x**2], axis=1).ravel()
    X, Y = skin.points[:, 0], skin.points[:, 1]
    expected = np.stack([-3 * X**2 * Y, X**3, 0 * X], axis=1)
    assert (skin.operator @ v).reshape(-1, 3) == pytest.approx(expected, abs=1e-13)
    assert len(np.unique(X.round(9))) == 2 * 4 + 1
