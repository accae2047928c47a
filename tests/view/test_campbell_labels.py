"""Speeds at the crossings of a Campbell diagram: each near its ring, none on another."""

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


def diagram(levels, orders):
    """Branches of constant frequency [Hz], and where the multiples of the spin meet them."""
    branches = [Branch(f"flap {k + 1}", np.full(len(SPEEDS), level)) for k, level in enumerate(levels)]
    meet = [SimpleNamespace(speed=2 * np.pi * f / n, frequency=f) for f in levels for n in orders]
    crossings = [one for one in meet if one.speed <= SPEEDS[-1]]
    return SimpleNamespace(
        value="", speeds=SPEEDS, asked=np.ones(len(SPEEDS), bool), branches=branches, orders=orders, crossings=crossings
    )


@pytest.mark.parametrize("levels", [(3.0, 4.0, 5.0), (4.0, 4.3, 4.6), (2.0, 6.0, 6.5, 12.0)])
def test_speeds_at_crossings_overlap_neither_each_other_nor_foreign_rings(levels):
    figure = Figure(figsize=(WIDTH, HEIGHT), layout="constrained")
    ax = figure.subplots()
    drawn = diagram(levels, (1, 2, 3, 4))
    ax.set_xlim(0.0, 400.0)
    _frequencies(ax, drawn, theme_of("light"), RPM)
    figure.draw_without_rendering()
    texts = [one for one in ax.texts if one.get_text().replace(".", "").isdigit()]
    boxes = [one.get_window_extent() for one in texts]
    rings = ax.transData.transform([(one.speed / RPM, one.frequency) for one in drawn.crossings])
    assert len(boxes) >= 4
    assert not any(a.overlaps(b) for a, b in combinations(boxes, 2))
    assert not any(box.contains(*ring) for box in boxes for ring in rings)
