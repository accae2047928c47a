"""Pictures of studies: responses, sweeps, Campbell diagrams, charts and loci of stability, convergence."""

from __future__ import annotations

import numpy as np
import pytest
from matplotlib.colors import to_rgba
from support.small_cases import clamped_rod

from femflex.body import rigid_body
from femflex.case import parse_case
from femflex.studies import convergence
from femflex.studies.campbell import campbell
from femflex.studies.stability import stability_chart, stability_locus
from femflex.studies.stability.judgement import STATIC, UNSTABLE, Judgement
from femflex.system import System, revolute, weld
from femflex.view.campbell import plot_campbell
from femflex.view.convergence import plot_envelopes, plot_indices, plot_scatter, plot_studies
from femflex.view.spectra import plot_bode, plot_nichols
from femflex.view.stability import plot_chart, plot_locus
from femflex.view.theme import THEMES

LIGHT = THEMES["light"]


def data(line):
    return np.column_stack(line.get_data())


# responses


def oscillator(omega, natural, damping, delay=0.0):
    return np.exp(-1j * omega * delay) / (natural**2 - omega**2 + 2j * damping * natural * omega)


@pytest.fixture
def responses():
    omega = np.geomspace(0.1, 100, 400)
    return omega, {"tip": oscillator(omega, 3.0, 0.05), "delayed": 0.1 * oscillator(omega, 5.0, 0.5, 0.3)}


def test_bode_picture_has_gain_and_phase(tmp_path, drawn_figure, responses):
    omega, every = responses
    plot_bode(omega, every, tmp_path / "a.svg", title="Mine", dpi=44)
    gain, angle = drawn_figure().axes
    assert drawn_figure().keywords == {"format": "svg", "dpi": 44}
    assert [line.get_label() for line in gain.lines] == list(every)
    for name, upper, lower in zip(every, gain.lines, angle.lines, strict=True):
        np.testing.assert_allclose(upper.get_data(), [omega / (2 * np.pi), np.abs(every[name])])
        turned = np.exp(1j * np.radians(lower.get_ydata())) * np.abs(every[name])
        np.testing.assert_allclose(turned, every[name], atol=1e-12)
        assert np.abs(np.diff(lower.get_ydata())).max() < 180
    delayed = 0.3 * np.degrees(omega[-1]) + 180  # far beyond half a turn
    assert angle.lines[1].get_ydata()[-1] == pytest.approx(-delayed, abs=10)


def test_nichols_picture_has_decibels_over_degrees(tmp_path, drawn_figure, responses):
    _, every = responses
    plot_nichols(every, tmp_path / "a.png")
    (ax,) = drawn_figure().axes
    *lines, ring = ax.lines
    for line in lines:
        angle, decibels = line.get_data()
        response = 10 ** (decibels / 20) * np.exp(1j * np.radians(angle))
        np.testing.assert_allclose(response, every[line.get_label()], atol=1e-12)
    assert np.ravel(ring.get_data()).tolist() == [-180.0, 0.0]


# sweeps


def test_scatter_has_every_output_over_every_input(tmp_path, drawn_figure):
    rng = np.random.default_rng(5)
    inputs = {f"in{k}": rng.uniform(k, k + 1, 40) for k in range(3)}
    outputs = {f"out{k}": rng.normal(3 * k, 1 + k, 40) for k in (0, 2)}
    outputs["out2"][4] = np.nan
    plot_scatter(inputs, outputs, {"in0": "kg^2", "out0": "m"}, tmp_path / "a.png", title="Mine", dpi=50)
    axes = np.array(drawn_figure().axes).reshape(2, 4)  # three inputs, and the distribution
    for i, values in enumerate(outputs.values()):
        for j in range(3):
            (line,) = axes[i, j].lines
            np.testing.assert_array_equal(line.get_data(), [inputs[f"in{j}"], values])
        bars, good = axes[i, 3].patches, values[np.isfinite(values)]
        assert sum(bar.get_width() for bar in bars) == len(good)
        assert min(bar.get_y() for bar in bars) == pytest.approx(good.min())
        assert max(bar.get_y() + bar.get_height() for bar in bars) == pytest.approx(good.max())


def band(collection):
    """Lower and upper bounds of a filled band at its abscissae."""
    (path,) = collection.get_paths()
    x, y = path.vertices.T
    abscissae = np.unique(x)
    return (
        abscissae,
        np.array([y[x == abscissa].min() for abscissa in abscissae]),
        np.array([y[x == abscissa].max() for abscissa in abscissae]),
    )


def test_envelopes_hold_all_complete_runs_and_the_outer_percentiles(tmp_path, drawn_figure):
    rng = np.random.default_rng(6)
    time, levels = 7200.0 * np.array([1.0, 1.1, 1.4, 1.5]), np.array([95.0, 40.0, 5.0, 60.5])
    runs = {name: rng.normal(size=(9, 4)) for name in ("markers/a.tip/deflection", "energy")}
    runs["energy"][2, :2] = 99.0, np.nan  # a run that stopped early is not part of the envelope
    bands = {name: rng.normal(size=(4, 4)) for name in runs}
    plot_envelopes(time, runs, bands, levels, tmp_path / "a.svg", units={"energy": "J/m^3"})
    for ax, name in zip(drawn_figure().axes, runs, strict=True):
        good = np.delete(runs[name], 2, axis=0) if name == "energy" else runs[name]
        limits = ([good.min(axis=0), good.max(axis=0)], np.sort([bands[name][2], bands[name][0]], axis=0))
        for collection, expected in zip(ax.collections, limits, strict=True):
            abscissae, low, high = band(collection)
            np.testing.assert_allclose(abscissae, time / 60)
            np.testing.assert_allclose([low, high], expected)
        (line,) = ax.lines
        np.testing.assert_allclose(line.get_data(), [time / 60, bands[name][1]])  # 40 is nearest to 50


def test_sobol_indices_are_bars(tmp_path, drawn_figure):
    indices = {"tip": np.array([[0.1, 0.4], [np.nan, 0.7], [0.3, 0.35]]), "mass": np.arange(6.0).reshape(3, 2) / 10}
    plot_indices(["span", "width", "density"], indices, tmp_path / "a.png")
    for ax, values in zip(drawn_figure().axes, indices.values(), strict=True):
        np.testing.assert_allclose([bar.get_width() for bar in ax.patches], np.nan_to_num(values).T.ravel())


# Campbell diagrams


def test_campbell_picture_has_frequencies_orders_and_crossings(tmp_path, drawn_figure):
    """A rod hinged at the centre of a driven hub, on a spring: (2 pi f)^2 = a + b Omega^2."""
    rod = rigid_body(2.0, np.diag([0.02, 0.5, 0.5]), np.array([1.2, 0.0, 0.0]))
    hinge = revolute("rod", "hub", (0, 1, 0), stiffness=np.array([40.0]))
    system = System({"hub": rigid_body(10.0, np.eye(3)), "rod": rod}, (weld("hub"), hinge))
    diagram = campbell(system, [0.0, 2.0, 5.0], modes=1, orders=(1, 2))
    plot_campbell(diagram, tmp_path / "a.svg", scale=0.5, unit="half rad/s")
    above = drawn_figure().axes[0]
    a, b = 40.0 / (0.5 + 2.0 * 1.2**2), (0.5 + 2.0 * 1.2**2 - 0.02) / (0.5 + 2.0 * 1.2**2)
    (curve,) = [line for line in above.lines if len(line.get_xdata()) > 10]
    x, y = curve.get_data()
    np.testing.assert_allclose(y, np.sqrt(a + b * (0.5 * x) ** 2) / (2 * np.pi), rtol=1e-6)
    rays = [data(line) for line in above.lines if line.get_color() == LIGHT.faint and len(line.get_xdata()) == 2]
    np.testing.assert_allclose([ray[-1] for ray in rays], [[10.0, n * 5.0 / (2 * np.pi)] for n in (1, 2)])
    rings = [data(line)[0] for line in above.lines if line.get_marker() == "o"]
    np.testing.assert_allclose(rings, [[c.speed / 0.5, c.frequency] for c in diagram.crossings])
    assert len(rings) == 1


# stability


def test_chart_colours_every_cell_and_draws_every_boundary(tmp_path, drawn_figure):
    grid = np.linspace(-2, 2, 9).tolist()
    chart = stability_chart(
        lambda x, y: Judgement(STATIC if x * x + y * y < 1 else UNSTABLE, 0.0, np.zeros(0, complex)), grid, grid
    )
    plot_chart(chart, tmp_path / "a.png")
    (ax,) = drawn_figure().axes
    cells = np.asarray(ax.images[0].get_array())
    assert cells.shape == (9, 9, 4) and ax.images[0].get_extent() == [-2.25, 2.25, -2.25, 2.25]
    inside = np.add.outer(np.square(grid), np.square(grid)).T < 1
    for is_stable, colour in ((True, to_rgba(LIGHT.lines[2], 0.30)), (False, to_rgba(LIGHT.trace, 0.16))):
        assert np.allclose(cells[inside == is_stable], colour)
    np.testing.assert_array_equal(data(ax.lines[0]), chart.boundaries[0][2])


@pytest.mark.parametrize("quantity", ["poles", "multipliers"])
def test_locus_has_the_branches_of_its_poles_or_multipliers(tmp_path, drawn_figure, quantity):
    """s^2 + d s + 4 = 0, or its roots over a half."""

    def judge(d):
        roots = np.roots([1.0, d, 4.0]).astype(complex) * (1.0 if quantity == "poles" else 0.5)
        return Judgement(STATIC if d >= 0.3 else UNSTABLE, float(roots.real.max()), roots)

    locus = stability_locus(judge, [-1.0, 0.0, 1.0, 2.0], "damping", quantity=quantity)
    plot_locus(locus, tmp_path / "a.png")
    plane, above, below = drawn_figure().axes
    curves = [data(line) for line in plane.lines if len(line.get_xdata()) == 4]
    branches = locus.branches.T if quantity == "multipliers" else [b for b in locus.branches.T if b[0].imag > 0]
    height = 1.0 if quantity == "multipliers" else 2 * np.pi
    np.testing.assert_allclose(curves, [np.column_stack([b.real, b.imag / height]) for b in branches])
    curves_over_value = [[line.get_ydata() for line in ax.lines if len(line.get_xdata()) == 4] for ax in (above, below)]
    components = (np.abs, lambda z: np.degrees(np.angle(z)))
    if quantity == "poles":
        components = (lambda z: z.imag / (2 * np.pi), np.real)
    for lines, component in zip(curves_over_value, components, strict=True):
        np.testing.assert_allclose(lines, [component(b) for b in branches])
    marks = [line.get_xdata()[0] for line in above.lines if line.get_color() == LIGHT.trace]
    assert marks == pytest.approx([0.3], abs=1e-6)


# convergence


def test_convergence_picture_has_values_errors_and_limit(tmp_path, drawn_figure):
    study = '[study]\nquantity = { of = "mode_frequency", body = "rod" }\ntolerance = 1e-3\n'
    run = 'title = "rod"\n[run]\nduration = 1\nsamples = 5\n'
    study_result = convergence(
        parse_case(run + clamped_rod('{ y = 2, family = "polynomial" }') + study), "modes", [1, 2, 3, 4]
    )
    plot_studies([study_result], tmp_path / "a.svg")
    above, below = drawn_figure().axes
    lines = {line.get_label(): data(line) for ax in (above, below) for line in ax.lines}
    np.testing.assert_allclose(lines["value"], np.column_stack([study_result.counts, study_result.values]))
    assert lines["limit"][:, 1] == pytest.approx(study_result.estimate)
    error_line = lines["estimated error"]
    np.testing.assert_allclose(error_line[:, 0], study_result.counts[: len(error_line)])
    np.testing.assert_allclose(error_line[:, 1], study_result.errors[: len(error_line)] / study_result.scale)
    assert lines["tolerance 0.001"][:, 1] == pytest.approx(1e-3)
