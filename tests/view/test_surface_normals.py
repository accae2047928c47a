"""What is drawn of a skin: merged, closed, outward, smooth where it is smooth, and shaded right when deformed."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from support.made_runs import BOOM, PANEL, box_skin, clamped_free, panel_skin, tube_skin

from femflex.body import Skin
from femflex.view.surface import breadth, surface_of


def volume(surface):
    """Enclosed by the drawn faces, counted outward."""
    p = surface.skin.rest.astype(float)
    triangles = np.concatenate([surface.triangles, surface.quads[:, [0, 1, 2]], surface.quads[:, [0, 2, 3]]])
    a, b, c = (p[triangles[:, k]] for k in range(3))
    return np.einsum("ni,ni->", a, np.cross(b, c)) / 6


def test_a_box_has_twelve_edges_and_faces_outward():
    """Its quadrilaterals are given turned this way and that."""
    skin = box_skin(1.0, 2.0, 3.0)
    skin.cells["quad"][::2] = skin.cells["quad"][::2, ::-1]
    surface = surface_of(skin)
    assert surface.closed and len(surface.edges) == 12 and len(surface.skin.rest) == 24
    assert volume(surface) == pytest.approx(6.0, rel=1e-6)
    normals = surface.normals(surface.skin.rest)
    assert np.allclose(np.sort(np.abs(normals), axis=1), [0, 0, 1], atol=1e-6)


def test_triangles_and_quadrilaterals_of_one_box_look_outward():
    skin = box_skin(2.0, 2.0, 2.0)
    quads = skin.cells["quad"]
    split = np.concatenate([quads[:3][:, [0, 1, 2]], quads[:3][:, [0, 2, 3]]])
    surface = surface_of(replace(skin, cells={"triangle": split, "quad": quads[3:]}))
    assert surface.closed and volume(surface) == pytest.approx(8.0, rel=1e-6)
    middle = surface.skin.rest.mean(axis=0)
    normals = surface.normals(surface.skin.rest)
    assert np.einsum("pi,pi->p", normals, surface.skin.rest - middle) == pytest.approx(np.ones(24), rel=1e-5)


def test_elements_of_a_tube_are_joined_and_shaded_smoothly():
    sides = 16
    surface = surface_of(tube_skin(sides=sides))
    area = sides / 2 * 0.12**2 * np.sin(2 * np.pi / sides)
    assert surface.closed and volume(surface) == pytest.approx(area * BOOM, rel=1e-5)
    assert len(surface.edges) == 2 * sides  # the rims of the caps alone
    assert len(surface.skin.rest) == 61 * sides + 2 * sides  # no point twice but at the rims
    side = np.abs(surface.normals(surface.skin.rest)[:, 0]) < 0.5
    radial = surface.skin.rest[side] * [0, 1, 1] / 0.12
    assert np.allclose(surface.normals(surface.skin.rest)[side], radial, atol=1e-5)


def test_normals_follow_a_bent_plate():
    """w(y) = a phi(y / l): n = (0, -w', 1) / sqrt(1 + w'^2) on the upper face."""
    skin = panel_skin(n=(160, 4))
    surface = surface_of(skin)
    delta = np.array([0.8, 0.0, 0.0])
    points, length = surface.skin.moved(delta)
    rest = surface.skin.rest
    normals = surface.normals(points)
    upper = (normals[:, 2] > 0.5) & (rest[:, 1] > 0.1) & (rest[:, 1] < PANEL[0] - 0.1)
    slope = 0.8 * clamped_free(rest[upper, 1] / PANEL[0], 0)[1] / PANEL[0]
    expected = np.stack([0 * slope, -slope, 1 + 0 * slope], axis=1) / np.sqrt(1 + slope[:, None] ** 2)
    assert upper.sum() > 500 and np.allclose(normals[upper], expected, atol=2e-3)  # facets of 1/160
    assert np.allclose(length, 0.8 * np.abs(clamped_free(rest[:, 1] / PANEL[0], 0)[0]), atol=1e-5)


def test_magnification_moves_points_and_not_the_colour():
    surface = surface_of(panel_skin())
    delta = np.array([0.1, -0.2, 0.05])
    (true, length), (more, same) = surface.skin.moved(delta), surface.skin.moved(delta, 10.0)
    assert np.allclose(more - surface.skin.rest, 10 * (true - surface.skin.rest), atol=1e-5)
    assert np.array_equal(length, same)
    assert np.array_equal(surface.skin.moved(0 * delta, 10.0)[0], surface.skin.rest)


def test_an_open_sheet_is_not_closed_and_shows_its_rim():
    points = np.array([[x, y, 0.0] for x in range(4) for y in range(3)])
    number = np.arange(12).reshape(4, 3)
    quads = np.stack([number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]], axis=-1).reshape(-1, 4)
    skin = Skin(points, {"quad": quads}, np.zeros((0, 12, 3)))
    sharp, mesh, none = (surface_of(skin, which) for which in ("sharp", "mesh", "none"))
    assert not sharp.closed
    assert (len(sharp.edges), len(mesh.edges), len(none.edges)) == (10, 17, 0)


def test_points_at_one_place_that_move_apart_stay_two():
    points = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 0], [-1, 0, 0], [0, 1, 0]])
    shape = np.zeros((1, 6, 3))
    shape[0, 3:, 0] = -1.0  # the second triangle leaves the first
    cells = {"triangle": np.array([[0, 1, 2], [3, 5, 4]])}
    assert len(surface_of(Skin(points, cells, shape)).skin.rest) == 6
    assert len(surface_of(Skin(points, cells, 0 * shape)).skin.rest) == 4


def test_lines_and_dots_are_drawn_without_faces():
    points = np.arange(12.0).reshape(4, 3)
    skin = Skin(points, {"line": np.array([[0, 1], [1, 2]]), "vertex": np.array([[3]])}, np.zeros((0, 4, 3)))
    surface = surface_of(skin)
    assert len(surface.lines) == 2 and len(surface.dots) == 1 and not len(surface.quads) + len(surface.triangles)
    assert np.array_equal(np.sort(surface.wires.rest[surface.lines[0]], axis=0), points[:2])
    with pytest.raises(ValueError, match=r"cells \['hexahedron'\] of a skin cannot be drawn; known are"):
        surface_of(Skin(points, {"hexahedron": np.zeros((1, 8), int)}, np.zeros((0, 4, 3))))


def test_breadth_is_the_diameter_of_a_rod_and_large_for_a_plate():
    tube = tube_skin(radius=0.05, sides=64)
    assert breadth(tube) == pytest.approx(0.1, rel=0.01)
    assert breadth(panel_skin()) > 1.0
    thick = surface_of(tube, "thick")
    assert len(thick.lines) > 60 * 64 and not len(thick.edges)
