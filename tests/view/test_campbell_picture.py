"""The Campbell diagram as drawn: branches, multiples of the spin, crossings, names and damping, by their numbers."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from matplotlib.figure import Figure

from femflex.view.campbell import APART, _clearest, _names, plot_campbell
from femflex.view.theme import THEMES

LIGHT = THEMES["light"]
RPM = 2 * np.pi / 60
SPEEDS = np.array([10.0, 20.0, 40.0, 70.0]) * RPM
ASKED = np.array([True, False, True, True])


def branch(name, frequencies, damping, growing, becomes=""):
    return SimpleNamespace(
        name=name,
        frequencies=np.array(frequencies),
        damping_ratios=np.array(damping),
        growing=np.array(growing),
        becomes=becomes,
    )


def diagram(damping=1.0, value="", crossings=()):
    """Frequencies whose square is straight over that of the speed, a lost one, and one that grows."""
    flap = np.sqrt(2.0 + 1.5 * (SPEEDS / (2 * np.pi)) ** 2)
    d = damping
    branches = [
        branch("flap 1", flap, [0.01 * d, 0.02 * d, 0.03 * d, 0.04 * d], [False] * 4, "lag 2"),
        branch("lag 1", [1.0, 0.9, np.nan, np.nan], [0.005 * d, 0.004 * d, np.nan, np.nan], [False] * 4),
        branch("spin 3", [3.0, 3.1, 3.4, 3.2], [0.0, -0.001 * d, -0.002 * d, 0.0], [False, True, True, False]),
    ]
    return SimpleNamespace(
        title="Rotor",
        value=value,
        speeds=SPEEDS,
        asked=ASKED,
        branches=branches,
        orders=(1, 4),
        crossings=crossings,
    )


def curves(ax, color, width=1.5):
    lines = [line for line in ax.lines if line.get_marker() == "None"]
    return [line for line in lines if line.get_color() == color and line.get_linewidth() == width]


def test_branches_stand_over_the_speed_in_its_unit_with_orders_names_and_damping(tmp_path, drawn_figure):
    crossings = [
        SimpleNamespace(branch="lag 1", order=4, speed=14.0 * RPM, frequency=4 * 14.0 / 60),
        SimpleNamespace(branch="flap 1", order=4, speed=60.0 * RPM, frequency=2.5),
        SimpleNamespace(branch="flap 1", order=1, speed=60.5 * RPM, frequency=1.5),
    ]
    plot_campbell(diagram(crossings=crossings), tmp_path / "a.svg", scale=RPM, unit="rpm", dpi=33)
    figure = drawn_figure()
    above, below = figure.axes
    assert figure.keywords == {"format": "svg", "dpi": 33} and figure.get_suptitle() == "Rotor"
    assert tuple(figure.get_size_inches()) == (9.0, 7.8)
    assert (above.get_ylabel(), below.get_ylabel()) == (
        "frequency in the spinning frame [Hz]",
        "damping [% of critical]",
    )
    assert below.get_xlabel() == "speed of spin [rpm]" and above.get_xlim() == pytest.approx((10.0, 70.0))
    assert above.get_ylim() == pytest.approx((0.0, 1.06 * 3.4))
    (flap,) = curves(above, LIGHT.lines[0])
    x, y = flap.get_data()
    assert len(x) == 3 * 12 + 1 and x[0] == pytest.approx(10.0) and x[-1] == pytest.approx(70.0)
    np.testing.assert_allclose(y, np.sqrt(2.0 + 1.5 * (x / 60) ** 2))  # as the law between the points
    (lag,) = curves(above, LIGHT.lines[1])
    assert lag.get_ydata()[[0, 12]] == pytest.approx([1.0, 0.9]) and np.isnan(lag.get_ydata()[-1])
    assert curves(above, LIGHT.lines[5])
    dots = [line for line in above.lines if line.get_marker() == "." and line.get_color() == LIGHT.lines[0]]
    np.testing.assert_allclose(dots[0].get_xdata(), [10.0, 40.0, 70.0])
    np.testing.assert_allclose(dots[0].get_ydata(), np.sqrt(2.0 + 1.5 * (np.array([10, 40, 70]) / 60) ** 2))
    wide = [line for line in above.lines if line.get_color() == LIGHT.trace and line.get_linewidth() == 5]
    np.testing.assert_allclose(wide[-1].get_ydata(), [np.nan, 3.1, 3.4, np.nan])
    np.testing.assert_allclose(wide[-1].get_xdata(), [10, 20, 40, 70])
    assert np.isnan(wide[0].get_ydata()).all()
    faint = [line for line in above.lines if line.get_color() == LIGHT.faint]
    np.testing.assert_allclose(
        [line.get_data() for line in faint], [[[10, 70], [10 / 60, 70 / 60]], [[10, 70], [40 / 60, 280 / 60]]]
    )
    texts = {text.get_text(): text for text in above.texts}
    assert texts["1/rev"].xy == pytest.approx((0.97 * 70, 0.97 * 70 / 60))
    top = 1.06 * 3.4
    assert texts["4/rev"].xy == pytest.approx((0.97 * top * 15, 0.97 * top))
    assert {"flap 1 → lag 2", "spin 3"} <= set(texts) and "lag 1" not in texts  # lost before the end
    assert texts["spin 3"].get_position() == pytest.approx((1.012, 3.2 / top))
    assert texts["spin 3"].get_color() == LIGHT.lines[5] and texts["flap 1 → lag 2"].get_color() == LIGHT.lines[0]
    rings = [line for line in above.lines if line.get_marker() == "o"]
    np.testing.assert_allclose(
        [np.ravel(line.get_data()) for line in rings], [[14.0, 56 / 60], [60.0, 2.5], [60.5, 1.5]]
    )
    assert texts["14"].xy == pytest.approx((14.0, 56 / 60)) and texts["60"].xy == pytest.approx((60.0, 2.5))
    assert "60.5" in texts
    damping = [line.get_ydata() for line in below.lines if len(line.get_xdata()) == 4]
    np.testing.assert_allclose(damping[0], [1, 2, 3, 4])
    np.testing.assert_allclose(damping[2], [0, -0.1, -0.2, 0])


def test_over_a_value_branches_are_straight_between_its_steps_and_without_damping_nothing_stands_below(
    tmp_path, drawn_figure
):
    close = [SimpleNamespace(branch="b", order=1, speed=v * RPM, frequency=2.0) for v in (30.0, 30.5, 60.0)]
    plot_campbell(diagram(1e-6, "mass", close), tmp_path / "a.png", scale=1.0, unit="kg^2", title="Mine")
    figure = drawn_figure()
    (ax,) = figure.axes
    assert figure.get_suptitle() == "Mine" and tuple(figure.get_size_inches()) == (9.0, 6.0)
    assert ax.get_ylabel() == "frequency [Hz]" and ax.get_xlabel() == "mass [kg$^{2}$]"
    (flap,) = curves(ax, LIGHT.lines[0])
    np.testing.assert_allclose(flap.get_xdata(), SPEEDS)
    texts = [text.get_text() for text in ax.texts]
    assert f"{60 * RPM:.4g}" in texts and f"{30 * RPM:.4g}" not in texts  # two that are close keep their speeds
    plot_campbell(diagram(1e-6, "mass"), tmp_path / "b.png", unit="")
    assert drawn_figure().axes[0].get_xlabel() == "mass"


def test_names_at_the_ends_are_moved_apart_alike_and_not_below_the_axes():
    ax = Figure().subplots()
    _names(ax, [(0.1, "a", "#111111"), (5.0, "b", "#222222"), (5.1, "c", "#333333"), (9.0, "d", "#444444")], 10.0)
    places = {text.get_text(): text.get_position()[1] for text in ax.texts}
    assert places["c"] - places["b"] == pytest.approx(APART) and places["b"] + places["c"] == pytest.approx(1.01)
    assert places["a"] == pytest.approx(0.01) and places["d"] == pytest.approx(0.9)
    ax = Figure().subplots()
    _names(ax, [(0.0, "a", "#111111"), (0.05, "b", "#222222")], 10.0)
    low, high = (text.get_position()[1] for text in ax.texts)
    assert low >= 0 and high - low == pytest.approx(APART)


def test_a_label_goes_to_the_side_that_is_empty():
    """Points everywhere to the right of the ring and to the left below."""
    rng = np.random.default_rng(4)
    cloud = rng.uniform(-60, 60, (4000, 2))
    cloud = cloud[(cloud[:, 0] > -3) | (cloud[:, 1] < 0)]
    side, area = _clearest(np.array([100.0, 50.0]), "12.34", cloud + np.array([100.0, 50.0]))
    assert side in ((-6, 6), (-12, 12))
    assert (area[:, 0] < 100.0 - 5).all() and area[:, 1].mean() == pytest.approx(50.0 + side[1])
    assert np.ptp(area[:, 0]) == pytest.approx(2 * 0.31 * 7.5 * 5) and np.ptp(area[:, 1]) == pytest.approx(1.1 * 7.5)
