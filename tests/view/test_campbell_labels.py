"""Speeds at the crossings of a Campbell diagram: none on another, on a ring or across lines where there is room."""

from dataclasses import dataclass
from itertools import combinations
from types import SimpleNamespace

import numpy as np
import pytest
from matplotlib.figure import Figure

from femflex.view.campbell import HEIGHT, WIDTH, _frequencies
from femflex.view.theme import theme_of

SPEEDS = np.linspace(0.0, 400.0, 17) * 2 * np.pi / 60
RPM = 2 * np.pi / 60


@dataclass
class Branch:
    name: str
    frequencies: np.ndarray
    becomes: str = ""

    @property
    def growing(self):
        return np.zeros(len(SPEEDS), bool)


def diagram(levels, orders, fall):
    """Branches that fall by `fall` [Hz/rpm] from rest, and where multiples of the spin meet them."""
    branches = [Branch(f"lag {k + 1}", level - fall * SPEEDS / RPM) for k, level in enumerate(levels)]
    rpm = [(level / (n / 60 + fall), n) for level in levels for n in orders]
    crossings = [SimpleNamespace(speed=v * RPM, frequency=n * v / 60) for v, n in rpm if v <= 400.0]
    return SimpleNamespace(
        value="", speeds=SPEEDS, asked=np.ones(len(SPEEDS), bool), branches=branches, orders=orders, crossings=crossings
    )


@pytest.mark.parametrize(
    ("levels", "fall"), [((3.0, 4.0, 5.0), 0.0), ((4.0, 5.0, 7.0), 0.008), ((2.0, 6.0, 6.5, 12.0), 0.002)]
)
def test_speeds_at_crossings_keep_clear_of_each_other_of_rings_and_of_lines(levels, fall):
    figure = Figure(figsize=(WIDTH, HEIGHT), layout="constrained")
    ax = figure.subplots()
    drawn = diagram(levels, (1, 2, 3, 4), fall)
    ax.set_xlim(0.0, 400.0)
    _frequencies(ax, drawn, theme_of("light"), RPM)
    figure.draw_without_rendering()
    texts = [one for one in ax.texts if one.get_text().replace(".", "").isdigit()]
    boxes = [one.get_window_extent() for one in texts]
    rings = ax.transData.transform([(one.speed / RPM, one.frequency) for one in drawn.crossings])
    assert len(boxes) >= 4
    assert not any(a.overlaps(b) for a, b in combinations(boxes, 2))
    assert not any(box.contains(*ring) for box in boxes for ring in rings)
    assert sum(crossed(ax, box) for box in boxes) <= 5


def crossed(ax, box):
    """Whether a branch or a multiple of the spin runs through a box."""
    lines = [line for line in ax.lines if len(line.get_xdata()) > 1]
    x = np.linspace(0.0, 400.0, 2000)
    curves = [ax.transData.transform(np.stack([x, np.interp(x, *line.get_data())], axis=1)) for line in lines]
    return any(box.contains(*point) for curve in curves for point in curve)
