"""Surfaces of skins: merged, closed, outward, and with true normals and displacements."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from support.made_runs import BOOM, PANEL, box_skin, clamped_free, panel_skin, tube_skin

from femflex.body import Skin
from femflex.view.segments import extended_coordinates, extended_skin
from femflex.view.surface import Points, surface_of


def volume(surface):
    """Enclosed by the drawn faces, counted outward."""
    p = surface.skin.reference.astype(float)
    triangles = np.concatenate([surface.triangles, surface.quads[:, [0, 1, 2]], surface.quads[:, [0, 2, 3]]])
    a, b, c = (p[triangles[:, k]] for k in range(3))
    return np.einsum("ni,ni->", a, np.cross(b, c)) / 6


def test_box_has_twelve_edges_and_outward_faces():
    """Its quadrilaterals are given turned this way and that."""
    skin = box_skin(1.0, 2.0, 3.0)
    skin.cells["quad"][::2] = skin.cells["quad"][::2, ::-1]
    surface = surface_of(skin)
    assert surface.closed and len(surface.edges) == 12 and len(surface.skin.reference) == 24
    assert volume(surface) == pytest.approx(6.0, rel=1e-6)
    normals = surface.normals(surface.skin.reference)
    assert np.allclose(np.sort(np.abs(normals), axis=1), [0, 0, 1], atol=1e-6)


def test_tube_is_merged_and_smooth():
    sides = 16
    surface = surface_of(tube_skin(sides=sides))
    area = sides / 2 * 0.12**2 * np.sin(2 * np.pi / sides)
    assert surface.closed and volume(surface) == pytest.approx(area * BOOM, rel=1e-5)
    assert len(surface.edges) == 2 * sides  # the rims of the caps alone
    assert len(surface.skin.reference) == 61 * sides + 2 * sides  # no point twice but at the rims
    side = np.abs(surface.normals(surface.skin.reference)[:, 0]) < 0.5
    radial = surface.skin.reference[side] * [0, 1, 1] / 0.12
    assert np.allclose(surface.normals(surface.skin.reference)[side], radial, atol=1e-5)


def test_normals_of_a_bent_plate():
    """w(y) = a phi(y / l): n = (0, -w', 1) / sqrt(1 + w'^2) on the upper face."""
    skin = panel_skin(n=(160, 4))
    surface = surface_of(skin)
    delta = np.array([0.8, 0.0, 0.0])
    points, length = surface.skin.displaced(delta)
    reference = surface.skin.reference
    normals = surface.normals(points)
    upper = (normals[:, 2] > 0.5) & (reference[:, 1] > 0.1) & (reference[:, 1] < PANEL[0] - 0.1)
    slope = 0.8 * clamped_free(reference[upper, 1] / PANEL[0], 0)[1] / PANEL[0]
    expected = np.stack([0 * slope, -slope, 1 + 0 * slope], axis=1) / np.sqrt(1 + slope[:, None] ** 2)
    assert upper.sum() > 500 and np.allclose(normals[upper], expected, atol=2e-3)  # facets of 1/160
    assert np.allclose(length, 0.8 * np.abs(clamped_free(reference[:, 1] / PANEL[0], 0)[0]), atol=1e-5)


def test_coincident_points_that_move_apart_are_not_merged():
    points = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 0], [-1, 0, 0], [0, 1, 0]])
    shape = np.zeros((1, 6, 3))
    shape[0, 3:, 0] = -1.0  # the second triangle leaves the first
    cells = {"triangle": np.array([[0, 1, 2], [3, 5, 4]])}
    assert len(surface_of(Skin(points, cells, shape)).skin.reference) == 6
    assert len(surface_of(Skin(points, cells, 0 * shape)).skin.reference) == 4


def skin(seed=1, n=2):
    """A sheet of two quads, a triangle beside it, a line and a dot; random shapes."""
    points = np.array(
        [[0, 0, 0], [1, 0, 0], [2, 0, 0.9], [0, 1, 0], [1, 1, 0], [2, 1, 0.9], [4, 0, 0], [5, 0, 1], [4, 2, 0.0]]
    )
    cells = {"quad": [[0, 1, 4, 3], [1, 2, 5, 4]], "line": [[6, 7]], "vertex": [[8]]}
    shapes = np.random.default_rng(seed).normal(size=(n, 9, 3)) * 0.1
    return Skin(points, {kind: np.array(rows) for kind, rows in cells.items()}, shapes)


def test_displacement_excludes_growth():
    plain_skin = skin(n=3)
    growing_skin = Skin(plain_skin.points, plain_skin.cells, plain_skin.shapes, plain_skin.shapes[2])
    delta = np.array([0.5, -1.0, 2.0], np.float32)
    displaced, length = Points.from_skin(growing_skin, np.array([4, 2])).displaced(delta, 2.0)
    u = np.tensordot(delta, plain_skin.shapes, axes=1)[[4, 2]]
    bent = np.tensordot(delta[:2], plain_skin.shapes[:2], axes=1)[[4, 2]]
    assert displaced == pytest.approx(plain_skin.points[[4, 2]] + 2.0 * u, abs=1e-5)
    assert length == pytest.approx(np.linalg.norm(bent, axis=1), rel=1e-4)
    assert Points.from_skin(plain_skin, np.array([1])).displaced(delta)[1] == pytest.approx(
        [np.linalg.norm(np.tensordot(delta, plain_skin.shapes, axes=1)[1])], rel=1e-4
    )


def test_segments_drawn_as_one_body():
    rng = np.random.default_rng(1)
    points, shapes = rng.normal(size=(7, 3)), rng.normal(size=(2, 7, 3))
    skin = Skin(points, {}, shapes)
    r, R = rng.normal(size=(4, 3)), rng.normal(size=(4, 3))
    C, body_attitude = Rotation.random(4, random_state=2).as_matrix(), Rotation.random(4, random_state=3).as_matrix()
    delta = rng.normal(size=(4, 2))
    true = r[:, None] + np.einsum("tij,tpj->tpi", C, points + np.einsum("tk,kpj->tpj", delta, shapes))
    wide = extended_skin(skin)
    local = wide.points + np.einsum("tk,kpj->tpj", extended_coordinates(r, C, delta, (R, body_attitude)), wide.shapes)
    assert R[:, None] + np.einsum("tij,tpj->tpi", body_attitude, local) == pytest.approx(true, abs=1e-12)


def test_an_undeformed_body_has_no_displacement():
    eye, zero = np.broadcast_to(np.eye(3), (1, 3, 3)), np.zeros((1, 3))
    assert not extended_coordinates(zero, eye, np.zeros((1, 6)), (zero, eye)).any()
