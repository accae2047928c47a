"""Montages and looping movies of a body's shapes."""

from __future__ import annotations

import os
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from PIL import Image
from support.made_runs import craft

from femflex.body import rigid_body
from femflex.view import mode_montage, mode_movie
from femflex.view.modes import caption

TILE = (200, 150)


def read(path):
    with Image.open(path) as image:
        return np.asarray(image).astype(int)


@pytest.fixture
def boom():
    return craft()["boom"]


@pytest.fixture
def panel():
    return craft()["panel"]


@pytest.mark.parametrize("theme", ["light", "dark"])
def test_a_montage_has_a_tile_for_every_shape_and_they_differ(tmp_path, boom, theme):
    image = read(mode_montage(boom, tmp_path / "a.png", theme=theme, tile=TILE))
    assert image.shape == (300, 400, 3)
    tiles = [image[r : r + 150, c : c + 200] for r in (0, 150) for c in (0, 200)]
    assert all(np.ptp(tile, axis=2).max() > 80 for tile in tiles)  # coloured by displacement
    drawn = [tile[:115] for tile in tiles]  # above the captions
    assert all(np.abs(a - b).max() > 100 for a, b in pairwise(drawn))
    rim = [np.concatenate([tile[0], tile[-1], tile[:, 0], tile[:, -1]]) for tile in tiles]
    assert all(np.ptp(edge, axis=0).max() == 0 for edge in rim)  # nothing clipped


def test_chosen_shapes_fill_rows_and_a_title_stands_above(tmp_path, panel):
    image = read(mode_montage(panel, tmp_path / "a.png", modes=[1, 3, 2], title="Panel", tile=TILE))
    assert image.shape == (36 + 300, 400, 3)
    assert np.all(image[36 + 150 :, 200:] == image[-1, -1]) and image[:36].min() < 100  # an empty tile, a title
    again = read(mode_montage(panel, tmp_path / "b.png", modes=[3], tile=TILE))
    assert np.array_equal(image[36:186, 200:], again)


def test_captions_tell_number_and_frequency_or_kind(panel):
    assert [caption(panel, k) for k in (1, 2)] == ["mode 1 · 0.8000 Hz", "mode 2 · 2.100 Hz"]
    mixed = replace(panel, omega=np.array([0.05, np.nan, 9e4]), kinds=("vibration", "constraint", "vibration"))
    assert [caption(mixed, k) for k in (1, 2, 3)] == [
        "mode 1 · 7.958 mHz",
        "shape 2 · constraint",
        "mode 3 · 14.32 kHz",
    ]


def test_a_mode_movie_loops(tmp_path, panel):
    folder = mode_movie(panel, tmp_path / "m", mode=1, seconds=1.0, cycles=2, fps=8, size=(240, 160))
    assert len(os.listdir(folder)) == 16
    frames = [read(folder / f"frame_{k:05d}.png") for k in range(1, 17)]
    assert all(np.array_equal(a, b) for a, b in zip(frames[:8], frames[8:], strict=True))
    assert np.array_equal(frames[0], frames[4])  # both ends of the swing pass through rest
    up, down = ((np.abs(f - f[0, 0]).sum(axis=2) > 100)[:120].nonzero()[0].mean() for f in (frames[2], frames[6]))
    assert up < down - 3  # pixels


def test_what_has_no_shapes_is_told(tmp_path, panel):
    with pytest.raises(ValueError, match="the body is rigid: it has no shapes to draw"):
        mode_montage(rigid_body(1.0, np.eye(3)), tmp_path / "a.png")
    with pytest.raises(ValueError, match="the body has no skin, so its shapes cannot be drawn"):
        mode_montage(replace(panel, skin=None), tmp_path / "a.png")
    with pytest.raises(ValueError, match="mode 4 is not on the body; its modes are 1 to 3"):
        mode_movie(panel, tmp_path / "a.mp4", mode=4)
    with pytest.raises(ValueError, match="the list of modes to draw is empty"):
        mode_montage(panel, tmp_path / "a.png", modes=[])
    with pytest.raises(ValueError, match="has no length; give at least one"):
        mode_movie(panel, tmp_path / "a.mp4", cycles=0)
    with pytest.raises(ValueError, match=r"a picture is written as \.png; a\.gif is not one"):
        mode_montage(panel, tmp_path / "a.gif")
    assert not list(tmp_path.iterdir())
