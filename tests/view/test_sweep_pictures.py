"""Scatter, envelopes and Sobol indices of a sweep as drawn, by their numbers."""

from __future__ import annotations

import numpy as np
import pytest

from femflex.view.sweep_plots import plot_envelopes, plot_indices, plot_scatter
from femflex.view.theme import THEMES

LIGHT = THEMES["light"]


def test_every_output_is_drawn_over_every_input_and_counted(tmp_path, drawn_figure):
    rng = np.random.default_rng(5)
    inputs = {f"in{k}": rng.uniform(k, k + 1, 40) for k in range(7)} | {"word": np.full(40, np.nan)}
    inputs = {"word": inputs["word"], **inputs}
    outputs = {f"out{k}": rng.normal(3 * k, 1 + k, 40) for k in (0, 2)}
    outputs["out2"][4] = np.nan
    units = {"in0": "kg^2", "in1": "1", "out0": "m", "out2": ""}
    plot_scatter(inputs, outputs, units, tmp_path / "a.png", title="Mine", dpi=50)
    figure = drawn_figure()
    assert figure.get_suptitle() == "Mine" and figure.keywords == {"format": "png", "dpi": 50}
    axes = np.array(figure.axes).reshape(2, 7)  # six inputs at most, and the distribution
    assert figure.get_size_inches() == pytest.approx([2.2 * 7 + 1, 2.2 * 2 + 0.8])
    for i, (name, values) in enumerate(outputs.items()):
        for j in range(6):
            (line,) = axes[i, j].lines
            np.testing.assert_array_equal(line.get_data(), [inputs[f"in{j}"], values])
            assert line.get_color() == LIGHT.lines[i]
        bars = axes[i, 6].patches
        good = values[np.isfinite(values)]
        assert sum(bar.get_width() for bar in bars) == len(good)
        assert min(bar.get_y() for bar in bars) == pytest.approx(good.min())
        assert max(bar.get_y() + bar.get_height() for bar in bars) == pytest.approx(good.max())
        assert axes[i, 0].get_ylabel() == {"out0": "out0 [m]"}.get(name, name)
    assert [ax.get_xlabel() for ax in axes[1]] == ["in0 [kg$^{2}$]", "in1", "in2", "in3", "in4", "in5", "runs"]
    assert not any(ax.get_xlabel() for ax in axes[:1].ravel())
    for some, more in (({"word": np.full(3, np.nan)}, outputs), (inputs, {})):
        with pytest.raises(ValueError, match="no inputs that are numbers, or no outputs"):
            plot_scatter(some, more, {}, tmp_path / "b.png")


def band(collection):
    """Lower and upper bounds of a filled band at its abscissae."""
    (path,) = collection.get_paths()
    x, y = path.vertices.T
    at = np.unique(x)
    return at, np.array([y[x == one].min() for one in at]), np.array([y[x == one].max() for one in at])


def test_envelopes_hold_all_whole_runs_and_the_outer_percentiles(tmp_path, drawn_figure):
    rng = np.random.default_rng(6)
    time = 7200.0 * np.array([1.0, 1.1, 1.4, 1.5])
    runs = {name: rng.normal(size=(9, 4)) for name in ("markers/a.tip/deflection", "energy")}
    runs["energy"][2, 1] = np.nan  # broke off: not of the envelope
    runs["energy"][2, 0] = 99.0
    levels = np.array([95.0, 40.0, 5.0, 60.5])
    bands = {name: rng.normal(size=(4, 4)) for name in runs}
    plot_envelopes(time, runs, bands, levels, tmp_path / "a.svg", units={"energy": "J/m^3"})
    figure = drawn_figure()
    assert figure.get_suptitle() == "Sweep"
    for k, (ax, name) in enumerate(zip(figure.axes, runs, strict=True)):
        every, outer = ax.collections
        good = np.delete(runs[name], 2, axis=0) if name == "energy" else runs[name]
        for collection, expected in ((every, (good.min(axis=0), good.max(axis=0))), (outer, None)):
            at, low, high = band(collection)
            np.testing.assert_allclose(at, time / 60)
            if expected is None:
                expected = np.sort([bands[name][2], bands[name][0]], axis=0)  # of 5 and 95 %
            np.testing.assert_allclose([low, high], expected)
        (line,) = ax.lines
        np.testing.assert_allclose(line.get_data(), [time / 60, bands[name][1]])  # 40 is nearest to 50
        assert line.get_color() == LIGHT.lines[k] and ax.get_title(loc="left") == name
        assert [t.get_text() for t in ax.get_legend().get_texts()] == ["all runs", "5 to 95 %", "40 %"]
    assert [ax.get_ylabel() for ax in figure.axes] == ["deflection", "energy [J/m$^{3}$]"]
    assert figure.axes[-1].get_xlabel() == "time [min]"
    plot_envelopes(time, runs, {n: b[:1] for n, b in bands.items()}, levels[:1], tmp_path / "b.svg")
    ax = drawn_figure().axes[0]
    assert len(ax.collections) == 1 and [t.get_text() for t in ax.get_legend().get_texts()] == ["all runs", "95 %"]
    with pytest.raises(ValueError, match="kept no histories"):
        plot_envelopes(time, {}, {}, levels, tmp_path / "c.svg")


def test_sobol_indices_are_bars_first_order_above_total(tmp_path, drawn_figure):
    indices = {"tip": np.array([[0.1, 0.4], [np.nan, 0.7], [0.3, 0.35]]), "mass": np.arange(6.0).reshape(3, 2) / 10}
    plot_indices(["span", "width", "density"], indices, tmp_path / "a.png")
    figure = drawn_figure()
    for ax, (name, values) in zip(figure.axes, indices.items(), strict=True):
        bars = ax.patches
        np.testing.assert_allclose([bar.get_width() for bar in bars], np.nan_to_num(values).T.ravel())
        middles = [bar.get_y() + bar.get_height() / 2 for bar in bars]
        np.testing.assert_allclose(middles, [0.2, 1.2, 2.2, -0.2, 0.8, 1.8])
        assert [t.get_text() for t in ax.get_yticklabels()] == ["span", "width", "density"]
        assert [t.get_text() for t in ax.get_legend().get_texts()] == ["first order", "total"]
        assert ax.yaxis_inverted() and ax.get_title(loc="left") == name
    assert figure.axes[-1].get_xlabel() == "share in the variance"
    with pytest.raises(ValueError, match="has no Sobol indices; take design = 'sobol_indices'"):
        plot_indices(["span"], {}, tmp_path / "b.png")
