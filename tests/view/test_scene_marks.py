"""Marks of a scene: length scale, undeformed bodies, mesh lines, one background, no clock for a single state."""

from __future__ import annotations

import numpy as np
import pytest
from support.made_runs import panel_skin, tube_skin, write_run
from test_pictures import SMALL, read, texts  # noqa: F401

from femflex.body import Skin
from femflex.results import open_run
from femflex.view import Look, render_movie, render_picture
from femflex.view.overlay import SCALE_PLACE
from femflex.view.plan import planned
from femflex.view.surface import surface_of, twist_of


def test_the_length_scale_is_as_long_as_it_says(tmp_path, run, texts):  # noqa: F811
    size = (640, 360)
    image = read(render_picture(run, tmp_path / "a.png", time=3.0, size=size, samples=1)).astype(int)
    label = next(text for text in texts() if text.endswith(" m") and text[0].isdigit())
    row = image[round((1 - SCALE_PLACE[1]) * size[1]) - 2 :][:4].sum(axis=2).min(axis=0)
    dark = np.flatnonzero(row[int(0.25 * size[0]) : int(0.45 * size[0])] < 300)
    drawn = np.ptp(dark) / planned(run, Look(size=size)).view.pixels(size[1])
    assert drawn == pytest.approx(float(label.split()[0]), abs=3.0 / planned(run, Look(size=size)).view.pixels(size[1]))


def test_the_undeformed_bodies_are_drawn_where_the_deformation_is_magnified(tmp_path, run, monkeypatch):
    ghosts = []
    real = femflex_scene().add_ghost
    monkeypatch.setattr(femflex_scene(), "add_ghost", lambda *args: ghosts.append(args) or real(*args))
    render_picture(run, tmp_path / "a.png", time=3.0, **SMALL)
    assert not ghosts
    render_picture(run, tmp_path / "b.png", time=3.0, scale=3.0, **SMALL)
    assert len(ghosts) == 2  # boom and panel; the box is rigid


def femflex_scene():
    """The module that draws scenes."""
    import femflex.view.scene

    return femflex.view.scene


def test_mesh_lines_are_drawn_where_they_are_apart():
    panel = panel_skin()
    apart, near = (surface_of(panel, "auto", apart=gap) for gap in (1e-3, 1e3))
    assert len(apart.mesh) > 1000 and not len(near.mesh)
    assert len(apart.edges) == len(surface_of(panel, "sharp").edges)
    assert len(apart.edges) + len(apart.mesh) == len(surface_of(panel, "mesh").edges)


def test_stills_and_movies_share_one_background(tmp_path, run):
    still = read(render_picture(run, tmp_path / "a.png", time=3.0, **SMALL))
    render_movie(run, tmp_path / "frames", fps=1.0, speed=10.0, **SMALL)
    frame = read(sorted((tmp_path / "frames").iterdir())[0])
    for image in (still, frame):
        assert np.all(image[0] == 255) and np.all(image[:, 0] == 255)


def test_a_single_state_has_no_clock(tmp_path, texts):  # noqa: F811
    path = write_run(tmp_path / "state.h5", np.zeros(1))
    with open_run(path) as state:
        render_picture(state, tmp_path / "a.png", **SMALL)
    assert not [text for text in texts() if text.startswith("t =")]


def test_the_twist_of_a_shape_is_that_of_its_sections():
    """A tube whose sections turn by up to 0.7 rad about its axis and move sideways; a bend has no twist."""
    tube = tube_skin()
    x, y, z = tube.points.T
    along = (x - x.min()) / np.ptp(x)
    turned = np.stack([0 * x, -0.7 * along * z, 0.7 * along * y + along**2], axis=1)
    bent = np.stack([-2 * along * z / np.ptp(x), 0 * x, along**2], axis=1)
    twist = twist_of(Skin(tube.points, tube.cells, np.stack([turned, bent])))
    assert twist[0] == pytest.approx(0.7, rel=1e-6) and twist[1] < 1e-9
