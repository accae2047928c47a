"""Pictures coloured by sunlight, against shadows of known area."""

from __future__ import annotations

import numpy as np
import pytest
from PIL import Image

import femflex
from femflex.case import parse_case
from femflex.view import render_picture
from femflex.view.theme import theme_of

CASE = """
[run]
duration = "600 s"
output_step = "300 s"
[orbit]
perigee_altitude = "500 km"
[attitude]
frame = "orbital"
held = true
[surroundings.sun]
kind = "sun"
direction = [0.6, 0, 0.8]
frame = "orbital"
[bodies.floor]
kind = "rigid"
mass = 1
inertia = [1, 1, 1]
shapes = [{ kind = "box", size = [6, 4, 0.1], position = [0, 0, -0.05] }]
markers.post = { position = [1.5, 0, 2] }
[bodies.roof]
kind = "rigid"
mass = 1
inertia = [1, 1, 1]
shapes = [{ kind = "box", size = [1, 2, 0.2] }]
[[joints]]
kind = "weld"
parent = "floor"
parent_marker = "post"
child = "roof"
"""


@pytest.fixture(scope="module")
def plates(tmp_path_factory):
    """A roof of 1 m x 2 m, 0.2 m thick, whose middle is 2 m above a floor of 6 m x 4 m."""
    return femflex.run(parse_case(CASE), tmp_path_factory.mktemp("plates") / "plates.h5")


@pytest.mark.sampled(1)
@pytest.mark.parametrize("theme", ["light", "dark"])
def test_shadow_has_the_area_of_the_roof_seen_from_the_sun(plates, tmp_path, theme):
    """Light slopes by 0.75: the shadow is 1 m + 0.75 x 0.2 m long. From above the roof does not cover it."""
    look = {"view": (0.0, 0.0, 1.0), "edges": "none", "triads": False, "theme": theme, "size": (320, 240), "title": ""}
    with Image.open(render_picture(plates, tmp_path / "a.png", colour="light", time=0.0, **look)) as image:
        pixels = np.asarray(image)[:, :270].astype(int)  # without the colour bar
    colours = 255 * theme_of(theme).light_map().colors[:, :3]
    rows, columns = np.nonzero(np.abs(pixels - colours[204]).max(axis=2) < 3)  # a light of 0.8
    floor = pixels[rows.min() : rows.max() + 1, columns.min() : columns.max() + 1]
    light = np.argmin(np.abs(floor[:, :, None] - colours).max(axis=3), axis=2) / 255
    assert np.median(light) == pytest.approx(0.8, abs=0.01)
    assert 1 - light.mean() / 0.8 == pytest.approx(1.15 * 2 / 24, rel=0.03)  # of pixels: 2 %


def test_light_needs_a_sun(run, tmp_path):
    with pytest.raises(ValueError, match=r"\[surroundings\.sun\] with kind = \"sun\""):
        render_picture(run, tmp_path / "a.png", colour="light")
