"""The look of plots: width, dashes, marks, order, size of letters and colours of everything drawn, in both themes."""

from __future__ import annotations

import importlib
import inspect
from types import SimpleNamespace

import numpy as np
import pytest
from matplotlib.colors import to_hex, to_rgba
from matplotlib.figure import Figure
from support.made_runs import write_run
from test_campbell_picture import RPM, diagram
from test_stability_pictures import POLES, chart, locus
from test_study_pictures import functions_study, strain_study, study

from femflex.results import RunWriter, open_run
from femflex.system import Channel
from femflex.view import plot_energy, plot_histories, plot_spectra, plot_spectrograms
from femflex.view.bode import plot_bode, plot_nichols
from femflex.view.campbell import plot_campbell
from femflex.view.convergence import finish as finish_study
from femflex.view.convergence import plot_convergence
from femflex.view.plot import figure_of, finish
from femflex.view.second_run import fit_limits, mark_end
from femflex.view.side_by_side import plot_studies
from femflex.view.stability import plot_chart, plot_locus
from femflex.view.sweep_plots import plot_envelopes, plot_indices, plot_scatter
from femflex.view.terms import CoordinateTerms, plot_terms
from femflex.view.theme import THEMES

DARK = THEMES["dark"]
TEXT, FAINT, TRACE, LINES = DARK.text, DARK.faint, DARK.trace, DARK.lines
CENTRE, UPPER_LEFT, LOWER_LEFT, UPPER_CENTRE, BEST = 10, 2, 3, 9, 0  # matplotlib's numbers of legend places


def strokes(ax):
    """Colour, width, dashes, opacity and order of every line without marks."""
    return [
        (line.get_color(), line.get_linewidth(), line.is_dashed(), line.get_alpha(), line.get_zorder())
        for line in ax.lines
        if line.get_marker() in ("None", "") and line.get_linestyle() != "None"
    ]


def marks(ax):
    """Mark, colour, size, face and order of every line with marks."""
    return [
        (line.get_marker(), line.get_color(), line.get_markersize(), line.get_markerfacecolor(), line.get_zorder())
        for line in ax.lines
        if line.get_marker() not in ("None", "")
    ]


def fills(ax):
    """Colour with opacity, and width of the rim, of every filled band."""
    return [(tuple(one.get_facecolor()[0]), *one.get_linewidth()) for one in ax.collections]


def shade(colour, alpha):
    return pytest.approx(to_rgba(colour, alpha))


def letters(text):
    return text.get_fontsize(), to_hex(text.get_color()), text.get_ha()


def legend_of(ax):
    """Place, anchor in parts of the axes, frame, columns, and sizes and colours of a legend's words."""
    found = ax.get_legend()
    x, y = ax.transAxes.inverted().transform(found.get_bbox_to_anchor().bounds[:2])
    words = {(text.get_fontsize(), to_hex(text.get_color())) for text in found.get_texts()}
    return found._loc, (round(x, 3), round(y, 3)), found.get_frame_on(), found._ncols, words


def is_titled(figure, size=None):
    """Checks the heading, the background and, if given, the size of a figure."""
    title = figure._suptitle
    assert (title.get_fontsize(), title.get_fontweight(), to_hex(title.get_color())) == (12, "bold", TEXT)
    assert to_hex(figure.get_facecolor()) == DARK.background
    if size is not None:
        assert figure.get_size_inches() == pytest.approx(size)


def is_finished(ax, label_size=9):
    """Checks background, grid, ticks and spines of axes."""
    figure = ax.get_figure()
    figure.draw_without_rendering() if not ax.get_xgridlines() else None
    assert to_hex(ax.get_facecolor()) == DARK.background
    for axis in (ax.xaxis, ax.yaxis):
        for grid in axis.get_gridlines()[:1]:
            assert (grid.get_color(), grid.get_alpha(), grid.get_linewidth()) == (FAINT, 0.25, 0.6)
        for tick in axis.get_major_ticks()[:1]:
            assert (tick.label1.get_fontsize(), tick.label1.get_color()) == (label_size, TEXT)
            assert tick.tick1line.get_color() == TEXT
        assert axis.label.get_color() == TEXT
    seen = {side: spine.get_visible() for side, spine in ax.spines.items()}
    assert seen == {"left": True, "bottom": True, "right": False, "top": False}
    assert {to_hex(spine.get_edgecolor()) for spine in ax.spines.values()} == {FAINT}


DRAWING = (
    "bode.plot_bode", "bode.plot_nichols", "campbell.plot_campbell", "convergence.plot_convergence",
    "energy.plot_energy", "modes.craft_montage", "modes.craft_movie", "modes.mode_montage", "modes.mode_movie",
    "plot.plot_histories", "plot.plot_spectra", "render.render_movie", "render.render_picture",
    "side_by_side.plot_studies", "spectrogram.plot_spectrograms", "stability.plot_chart", "stability.plot_locus",
    "sweep_plots.plot_envelopes", "sweep_plots.plot_indices", "sweep_plots.plot_scatter", "terms.plot_terms",
)  # fmt: skip


@pytest.mark.parametrize("name", DRAWING)
def test_what_draws_is_light_and_overwrites_nothing_unless_it_is_said(name):
    module, _, function = name.partition(".")
    known = inspect.signature(getattr(importlib.import_module(f"femflex.view.{module}"), function)).parameters
    assert known["force"].default is False
    assert "theme" not in known or known["theme"].default == "light"
    assert "dpi" not in known or known["dpi"].default == 150


def test_axes_have_the_colours_of_the_theme_and_a_legend_beside_them():
    figure, axes = figure_of(3, "T", DARK, sharex=True)
    is_titled(figure, (9.0, 2.5 * 3 + 0.5))
    assert [ax.get_position().y0 for ax in axes] == sorted((ax.get_position().y0 for ax in axes), reverse=True)
    axes[0].set_xlim(3, 4)
    assert axes[2].get_xlim() == (3, 4)
    alone = figure_of(2, "T", DARK, sharex=False)[1]
    alone[0].set_xlim(3, 4)
    assert alone[1].get_xlim() != (3, 4)
    for count, columns in ((8, 1), (9, 2), (17, 3)):
        ax = Figure().subplots()
        for k in range(count):
            ax.plot([0, 1], [k, k], label=f"{k}")
        finish(ax, ["a"], DARK)
        is_finished(ax)
        assert legend_of(ax) == (UPPER_LEFT, (1.0, 1.0), False, columns, {(9, TEXT)})
    finish(axes[1], [], DARK)
    assert axes[1].get_legend() is None
    for inside, place in ((False, (UPPER_LEFT, (1.0, 1.0), False, 1, {(9, TEXT)})), (True, None)):
        ax = Figure().subplots()
        ax.plot([0, 1], [0, 1], label="a")
        finish_study(ax, DARK, inside=inside)
        is_finished(ax)
        assert to_hex(ax.yaxis.get_offset_text().get_color()) == TEXT
        if place:
            assert legend_of(ax) == place
        else:
            assert legend_of(ax)[0] == BEST and legend_of(ax)[2:] == (False, 1, {(7.5, TEXT)})


def test_a_chart_has_its_boundaries_over_its_regions_and_known_curves_on_top(tmp_path, drawn_figure):
    curve = np.array([[1.0, 12.0], [2.5, 22.0]])
    known = [("Hughes", curve), ("Likins", curve)]
    plot_chart(
        chart(((2, 0, curve),)), tmp_path / "a.png", "dark", second=chart(((1, 0, curve),) * 2), left_out=["x"],
        known=known,
    )  # fmt: skip
    figure = drawn_figure()
    (ax,) = figure.axes
    is_titled(figure, (8.6, 6.2))
    is_finished(ax)
    dashed, dotted = (LINES[0], 1.4, True, None, 4), (LINES[3], 1.6, True, None, 5)
    assert strokes(ax) == [(TEXT, 1.4, False, None, 3), dashed, dashed, dotted, dotted]
    (picture,) = ax.images
    assert (picture.get_zorder(), picture.get_interpolation(), ax.get_aspect()) == (0, "nearest", "auto")
    assert legend_of(ax) == (UPPER_CENTRE, (0.5, -0.11), False, 2, {(10, TEXT)})


def test_loci_are_solid_those_with_something_left_out_dashed_and_thinner(tmp_path, drawn_figure):
    names = ("flap 1", "lag 1", "lag 2")
    plot_locus(
        locus("poles", POLES, names), tmp_path / "a.png", "dark", second=locus("poles", POLES[:, :2]), left_out=("x",)
    )
    figure = drawn_figure()
    plane, above, below = figure.axes
    is_titled(figure, (11.0, 6.0))
    for ax in (plane, above, below):
        is_finished(ax)
    first, third = ((LINES[k], 1.4, False, None, 2) for k in (0, 1))
    dashed, axis = (LINES[0], 1.0, True, None, 2), (FAINT, 0.9, False, None, 2)
    assert strokes(plane) == [first, third, dashed, axis, (TEXT, 1.5, True, None, 2)]
    critical = (TRACE, 1.0, True, None, 2)
    assert strokes(above) == [first, third, dashed, critical, critical]
    assert strokes(below) == [first, third, dashed, axis, critical, critical]
    assert marks(plane) == [("o", LINES[k], 5, face, 2) for k in (0, 1) for face in ("none", LINES[k])]
    assert {letters(text) for text in above.texts} == {(8, TRACE, "left")}
    assert {(text.xyann, text.anncoords, text.xycoords) for text in above.texts} == {
        ((3, -10), "offset points", ("data", "axes fraction"))
    }
    box = above.texts[0].get_bbox_patch()
    assert to_hex(box.get_facecolor()) == DARK.background and box.get_edgecolor()[3] == 0
    named = {text.get_text(): (letters(text), text.xyann) for text in plane.texts}
    assert {size for (size, _, _), _ in named.values()} == {7.5}
    assert all(xy == ((-14, 8) if ha == "right" else (6, 4)) for (_, _, ha), xy in named.values())
    assert legend_of(plane)[0] == LOWER_LEFT and legend_of(plane)[2:] == (False, 1, {(8, TEXT)})


def test_multipliers_have_dots_for_their_angles_and_a_round_circle(tmp_path, drawn_figure):
    multipliers = np.array([[0.6 + 0.8j, 0.6 - 0.8j], [0.9j, -0.9j], [-1.2 + 0.1j, -1.2 - 0.1j]])
    plot_locus(locus("multipliers", multipliers), tmp_path / "a.svg", "dark")
    plane, above, below = drawn_figure().axes
    assert plane.get_aspect() == 1 and plane.get_adjustable() == "datalim"
    solid, faint = [(LINES[k], 1.4, False, None, 2) for k in (0, 1)], (FAINT, 0.9, False, None, 2)
    assert strokes(plane) == [*solid, faint]
    assert strokes(above)[:3] == [*solid, faint]
    assert marks(below) == [(".", LINES[k], 3, LINES[k], 2) for k in (0, 1)]


def test_a_campbell_diagram_has_thin_orders_wide_growth_and_rings_above_the_branches(tmp_path, drawn_figure):
    crossings = [SimpleNamespace(branch="lag 1", order=4, speed=14.0 * RPM, frequency=4 * 14.0 / 60)]
    plot_campbell(diagram(crossings=crossings), tmp_path / "a.png", "dark", scale=RPM, unit="rpm")
    figure = drawn_figure()
    above, below = figure.axes
    is_titled(figure, (9.0, 7.8))
    is_finished(above)
    is_finished(below)
    order, grown = (FAINT, 0.9, True, None, 2), (TRACE, 5, False, 0.6, 2)
    branches = [(LINES[k], 1.5, False, None, 3) for k in (0, 1, 5)]
    assert strokes(above) == [order, order, *(one for branch in branches for one in (branch, grown))]
    dots = [(".", LINES[k], 3.5, LINES[k], 3) for k in (0, 1, 5)]
    assert marks(above) == [*dots, ("o", TEXT, 5.5, DARK.background, 4)]
    assert strokes(below) == [*((LINES[k], 1.5, False, None, 2) for k in (0, 1, 5)), (FAINT, 0.8, False, None, 2)]
    texts = {text.get_text(): text for text in above.texts}
    for name in ("1/rev", "4/rev"):
        assert (*letters(texts[name]), texts[name].get_va()) == (8, FAINT, "right", "center")
        box = texts[name].get_bbox_patch()
        assert box.get_alpha() == 0.85 and to_hex(box.get_facecolor()) == DARK.background
        assert texts[name].get_zorder() == 3.5
    assert letters(texts["spin 3"]) == (9, LINES[5], "left") and texts["spin 3"].get_va() == "center"
    speed = texts["14"]
    assert letters(speed)[:2] == (7.5, TEXT) and speed.get_va() == "center" and speed.get_zorder() == 5
    dx = speed.xyann[0]
    assert speed.get_ha() == ("left" if dx > 0 else "right" if dx < 0 else "center")
    assert above.get_position().height == pytest.approx(6.0 / 1.8 * below.get_position().height, rel=0.15)


@pytest.mark.parametrize("fall", [1.0, -1.0])
def test_the_speed_at_a_crossing_stands_beside_the_branch_that_runs_through_it(tmp_path, drawn_figure, fall):
    """The diagram begins at a speed of 10, and the branch rises or falls through the ring."""
    speeds = np.array([10.0, 20.0, 30.0])
    branch = SimpleNamespace(
        name="flap 1",
        frequencies=2.0 + fall * np.array([-1.0, 0.0, 1.0]),
        damping_ratios=np.zeros(3),
        growing=np.zeros(3, bool),
        becomes="",
    )
    level = SimpleNamespace(
        name="lag 1", frequencies=np.full(3, 3.0), damping_ratios=np.zeros(3), growing=np.zeros(3, bool), becomes=""
    )
    found = SimpleNamespace(
        title="T", value="mass", speeds=speeds, asked=np.ones(3, bool), branches=[branch, level], orders=(),
        crossings=[SimpleNamespace(branch="flap 1", order=1, speed=20.0, frequency=2.0)],
    )  # fmt: skip
    plot_campbell(found, tmp_path / "a.png")
    (ax,) = drawn_figure().axes
    assert ax.get_xlim() == (10.0, 30.0)
    (label,) = [text for text in ax.texts if text.get_text() == "20"]
    dx, dy = label.xyann
    assert dx * dy * fall <= 0  # on the other diagonal, or straight to a side


@pytest.mark.parametrize(("second", "limits"), [(9.1, (4.0, 6.0)), (0.9, (4.0, 6.0))])
def test_a_second_run_far_from_one_that_stands_still_leaves_one_unit_about_it(second, limits):
    ax = Figure().subplots()
    made = [SimpleNamespace(second=which, values=np.full(3, value)) for which, value in ((False, 5.0), (True, second))]
    fit_limits(ax, made)  # type: ignore[arg-type]
    assert ax.get_ylim() == limits
    near = Figure().subplots()
    before = near.get_ylim()
    made[1].values = np.array([5.0, 7.9, 2.1])
    fit_limits(near, made)  # type: ignore[arg-type]
    assert near.get_ylim() == before


def test_responses_have_legends_above_and_a_ring_at_the_critical_point(tmp_path, drawn_figure):
    omega = np.geomspace(0.1, 100, 50)
    every = {"a": 1 / (4 - omega**2 + 0.2j * omega), "b": 1 / (9 - omega**2 + 0.2j * omega)}
    plot_bode(omega, every, tmp_path / "a.png", "dark")
    figure = drawn_figure()
    is_titled(figure, (9.0, 6.5))
    lines = [(LINES[k], 1.3, False, None, 2) for k in (0, 1)]
    assert strokes(figure.axes[0]) == strokes(figure.axes[1]) == lines
    for ax in figure.axes:
        is_finished(ax)
    assert legend_of(figure.axes[0]) == (UPPER_LEFT, (0.0, 1.12), False, 2, {(8, TEXT)})
    assert figure.axes[1].get_legend() is None
    assert figure.axes[1].get_xlim() == pytest.approx((0.1 / (2 * np.pi), 100 / (2 * np.pi)))
    plot_nichols(every, tmp_path / "b.png", "dark")
    figure = drawn_figure()
    is_titled(figure, (8.0, 6.0))
    (ax,) = figure.axes
    assert strokes(ax) == lines and legend_of(ax) == (UPPER_LEFT, (0.0, 1.12), False, 2, {(8, TEXT)})
    (ring,) = [line for line in ax.lines if line.get_marker() == "o"]
    assert (ring.get_markersize(), ring.get_markerfacecolor(), ring.get_markeredgecolor()) == (9, "none", TRACE)


def test_sweeps_have_points_bands_and_bars_of_their_outputs_colours(tmp_path, drawn_figure):
    outputs = {"a": np.array([1.0, 2.0, 4.0]), "b": np.array([0.0, 2.0, 1.0])}
    plot_scatter({"x": np.arange(3.0)}, outputs, {}, tmp_path / "a.png", "dark")
    figure = drawn_figure()
    is_titled(figure, (2.2 * 2 + 1.0, 2.2 * 2 + 0.8))
    axes = np.array(figure.axes).reshape(2, 2)
    for i in range(2):
        assert marks(axes[i, 0]) == [(".", LINES[i], 4, LINES[i], 2)]
        assert {to_hex(bar.get_facecolor()) for bar in axes[i, 1].patches} == {LINES[i]}
        is_finished(axes[i, 0])
        is_finished(axes[i, 1])
    assert axes[1, 0].xaxis.label.get_fontsize() == 8 and axes[1, 1].xaxis.label.get_color() == TEXT
    axes[0, 0].set_xlim(-1, 7)
    assert axes[1, 0].get_xlim() == (-1, 7)
    time, runs = np.arange(4.0), {"m/a": np.arange(12.0).reshape(3, 4), "m/b": np.ones((3, 4))}
    bands = {name: np.arange(12.0).reshape(3, 4) for name in runs}
    plot_envelopes(time, runs, bands, np.array([5.0, 50.0, 95.0]), tmp_path / "b.png", "dark")
    figure = drawn_figure()
    for k, ax in enumerate(figure.axes):
        assert [colour for colour, *_ in fills(ax)] == [shade(LINES[k], 0.15), shade(LINES[k], 0.35)]
        assert strokes(ax) == [(LINES[k], 1.2, False, None, 2)] and ax.get_xlim() == (0.0, 3.0)
        assert ax.get_ylabel() == "ab"[k]
        title = ax._left_title
        assert (title.get_text(), title.get_fontsize(), title.get_color()) == (list(runs)[k], 9, TEXT)
        assert [text.get_text() for text in ax.get_legend().get_texts()] == ["all runs", "5 to 95 %", "50 %"]
        is_finished(ax)
    plot_indices(["x", "y"], {"a": np.array([[0.25, 0.5], [np.nan, 0.75]])}, tmp_path / "c.png", "dark")
    figure = drawn_figure()
    (ax,) = figure.axes
    bars = [(to_hex(one.get_facecolor()), one.get_bbox()) for one in ax.patches]
    middles = [(colour, round((box.y0 + box.y1) / 2, 9), box.width) for colour, box in bars]
    assert middles == [
        (LINES[0], 0.2, 0.25), (LINES[0], 1.2, 0.0), (LINES[1], -0.2, 0.5), (LINES[1], 0.8, 0.75),
    ]  # fmt: skip
    assert {round(box.height, 9) for _, box in bars} == {0.36} and ax.yaxis_inverted()
    assert ax._left_title.get_fontsize() == 9 and ax._left_title.get_color() == TEXT
    assert [text.get_text() for text in ax.get_yticklabels()] == ["x", "y"]


def test_studies_have_dashed_laws_bands_of_tolerance_and_a_ring_to_choose(tmp_path, drawn_figure):
    plot_convergence(study(levels=np.array([1, 2, 4, 8, 9, 10])), tmp_path / "a.png", "dark")
    figure = drawn_figure()
    above, below = figure.axes
    is_titled(figure, (9.0, 7.2))
    verdict = figure._supxlabel
    assert (verdict.get_fontsize(), verdict.get_color(), verdict.get_ha(), verdict.get_position()[0]) == (
        8.5, TEXT, "left", 0.02,
    )  # fmt: skip
    limit, value = (LINES[2], 1.2, False, None, 2), ("o", LINES[0], 5, LINES[0], 2)
    assert strokes(above) == [limit] and marks(above)[0] == value
    (line,) = [one for one in above.lines if one.get_label() == "value"]
    assert (line.get_linewidth(), line.get_linestyle()) == (1.2, "-")
    assert above.patches[0].get_facecolor() == shade(LINES[2], 0.15) and above.patches[0].get_linewidth() == 0
    (band,) = above.collections
    assert band.get_label() == "tolerance 0.02" and band.get_facecolor()[0] == shade(LINES[2], 0.15)
    assert strokes(below) == [(LINES[1], 1.2, True, None, 2), limit] and marks(below)[0] == value
    plot_convergence(study(levels=np.array([1, 2, 4, 8, 9, 10]), recommended=2), tmp_path / "b.png", "dark")
    for ax in drawn_figure().axes:
        is_finished(ax)
        (ring,) = [line for line in ax.lines if line.get_label() == "to choose"]
        assert (ring.get_color(), ring.get_markersize(), ring.get_markerfacecolor()) == (LINES[6], 12, "none")
        assert ring.get_markeredgewidth() == 1.5
    below = drawn_figure().axes[1]
    assert {(letters(text), text.xyann) for text in below.texts} == {((8, TEXT, "center"), (0, 8))}
    assert above.get_position().height == pytest.approx(2 / 3 * below.get_position().height, rel=0.15)
    none = study(errors=np.full(6, np.nan), law=None, recommended=None)
    plot_convergence(none, tmp_path / "c.png", "dark")
    (text,) = drawn_figure().axes[1].texts
    assert letters(text) == (10, FAINT, "center") and text.get_text() == "no error can be estimated"


def test_comparisons_have_their_letters_and_bars(tmp_path, drawn_figure):
    plot_studies([strain_study(), functions_study()], tmp_path / "a.png", "words", "dark")
    figure = drawn_figure()
    is_titled(figure, (10.4, 7.2))
    (above, other), (below, lower) = np.array(figure.axes).reshape(2, 2)
    assert strokes(above) == [(LINES[2], 1.2, False, None, 2)]
    assert marks(above) == [("o", LINES[0], 6, LINES[0], 2)]
    assert above.patches[0].get_facecolor() == shade(LINES[2], 0.25)
    assert {to_hex(bar.get_facecolor()) for bar in below.patches} == {LINES[0]}
    assert {bar.get_width() for bar in below.patches} == {0.5}
    assert {(letters(text), text.xyann) for text in above.texts} == {((8, TEXT, "center"), (0, 7))}
    assert {(letters(text), text.xyann) for text in below.texts} == {((8, TEXT, "center"), (0, 3))}
    assert {tick.label1.get_fontsize() for tick in below.xaxis.get_major_ticks()} == {8}
    kinds = [("o", LINES[k], 4, LINES[k], 2) for k in range(len(other.lines))]
    assert marks(other) == kinds and {line.get_linewidth() for line in other.lines} == {1.2}
    assert (TEXT, 1.0, True, None, 2) in strokes(lower)
    for ax, word in ((above, "over strain"), (other, "over functions")):
        assert (ax.get_title(), ax.title.get_fontsize(), ax.title.get_color()) == (word, 10, TEXT)


@pytest.fixture(scope="module")
def pair(tmp_path_factory):
    """A run, and one of the same title that stopped earlier."""
    folder = tmp_path_factory.mktemp("pair")
    paths = [write_run(folder / f"{k}.h5", np.linspace(0, 20, n)) for k, n in (("1", 201), ("2", 101))]
    with open_run(paths[0]) as first, open_run(paths[1]) as second:
        yield first, second


def test_histories_are_solid_and_a_second_runs_dashed_thinner_and_paler(tmp_path, drawn_figure, pair):
    run, other = pair
    names = ["attitude/angles:pitch", "attitude/angles:yaw"]
    plot_histories(run, tmp_path / "a.png", names, theme="dark", other=other)
    figure = drawn_figure()
    (ax,) = figure.axes
    is_titled(figure, (9.0, 3.0))
    is_finished(ax)
    solid, dashed = ([(LINES[k], w, d, a, 2) for k in (0, 1)] for w, d, a in ((1.2, False, None), (1.0, True, 0.85)))
    assert strokes(ax) == [*solid, *dashed, (TEXT, 1.0, True, 0.85, 2)] and ax.get_xlim() == (0.0, 20.0)
    plot_spectra(run, tmp_path / "b.png", ["markers/boom.tip/deflection:y"], theme="dark", other=other)
    (ax,) = drawn_figure().axes
    assert strokes(ax) == [solid[0], dashed[0], (TEXT, 1.0, True, 0.85, 2)]
    assert ax.texts and {letters(text)[:2] for text in ax.texts} == {(8, TEXT)}
    assert {text.xyann for text in ax.texts} == {(0, 4)}
    width = ax.get_xlim()[1]
    assert all(text.get_ha() == ("left" if text.xy[0] < 0.05 * width else "center") for text in ax.texts)


def test_a_run_that_stopped_has_a_bold_cross_over_its_curves():
    ax = Figure().subplots()
    ax.set_ylim(0, 5)
    second = SimpleNamespace(second=True, time=np.array([0.0, 90.0]), values=np.array([1.0, 2.0]))
    mark_end(ax, [second], SimpleNamespace(complete=False), (60.0, "min"), DARK)  # type: ignore[arg-type]
    (cross,) = ax.lines
    assert (cross.get_marker(), cross.get_markersize(), cross.get_markeredgewidth()) == ("x", 8, 2)
    assert (cross.get_color(), cross.get_zorder(), cross.get_clip_on()) == (TEXT, 5, False)
    assert cross.get_label() == "stopped at 1.5 min" and cross.get_linestyle() == "None"


def test_two_runs_of_other_titles_are_both_named(tmp_path, drawn_figure, pair):
    run, _ = pair
    path = write_run(tmp_path / "3.h5", np.linspace(0, 20, 101), title="Another craft")
    with open_run(path) as other:
        plot_histories(run, tmp_path / "a.png", ["attitude/angles:pitch"], other=other)
    assert drawn_figure().get_suptitle() == f"{run.title}\ndashed: Another craft"


def test_spectrograms_have_the_themes_colours_down_to_a_fiftieth(tmp_path, drawn_figure):
    times = np.linspace(0, 10, 400)
    channels = {"a": Channel("m^2", "a", (), ())}
    with RunWriter(tmp_path / "run.h5", channels, {}, {"title": "T"}) as writer:
        writer.write_block(times, {"a": 3 * np.sin(2 * np.pi * 2.5 * times)})
    with open_run(tmp_path / "run.h5") as run:
        plot_spectrograms(run, tmp_path / "a.png", ["a"], theme="dark")
    figure = drawn_figure()
    ax, bar = figure.axes
    is_titled(figure)
    (painted,) = ax.collections
    norm = painted.norm
    assert norm.vmax == pytest.approx(3.0, rel=1e-2) and norm.vmin == pytest.approx(norm.vmax / 50)
    assert painted.get_array().min() >= norm.vmin * (1 - 1e-9) and painted.get_rasterized()
    np.testing.assert_allclose(painted.cmap(0.0), DARK.colour_map()(0.0))
    assert bar.get_ylabel() == "amplitude [m$^{2}$]" and to_hex(bar.yaxis.label.get_color()) == TEXT
    assert not ax.xaxis.get_gridlines()[0].get_visible()
    assert 1.6 * 2.5 < ax.get_ylim()[1] < 1.6 * 2.5 * 1.6


def test_an_energy_account_has_a_colour_for_each_contributor(tmp_path, drawn_figure):
    times = np.linspace(0, 10, 40)
    names = ("kinetic", "elastic", "spring", "gravity")
    arrays = {f"monitors/{name}": (k + 1) * np.sin(times + k) for k, name in enumerate(names)}
    arrays["monitors/energy"] = sum(arrays.values())
    channels = {name: Channel("J", name, (), ()) for name in arrays}
    with RunWriter(tmp_path / "run.h5", channels, {}, {"title": "T"}) as writer:
        writer.write_block(times, arrays)
    with open_run(tmp_path / "run.h5") as run:
        plot_energy(run, tmp_path / "a.png", "dark", "Mine")
    figure = drawn_figure()
    ax, below = figure.axes
    is_titled(figure, (9.0, 5.5))
    assert figure.get_suptitle() == "Mine"
    assert fills(ax) == [(shade(LINES[k], 0.75), 0) for k in range(4) for _ in range(2)]
    assert [one.get_label() for one in ax.collections][::2] == [
        "stored: kinetic", "stored: strain", "stored: springs", "stored: gravity",
    ]  # fmt: skip
    line = (TEXT, 1.0, False, None, 2)
    assert strokes(ax) == strokes(below) == [line] and ax.get_xlim() == below.get_xlim() == (0.0, 10.0)
    assert below.get_legend() is None and legend_of(ax)[4] == {(9, TEXT)}
    is_finished(ax)
    is_finished(below)


def terms_run(tmp_path, t, parts, unit="N m", theme="dark"):
    """Draws the terms of a hub's angle, and gives the strip and the stack."""
    n = len(next(iter(parts.values())))
    channels = {"q": Channel("rad", "q", (1,), ("hub.angle",)), "u": Channel("rad/s", "u", (1,), ("hub.angle_rate",))}
    path = tmp_path / "terms.h5"
    with RunWriter(path, channels, {}, {"title": "T"}, force=True) as writer:
        writer.write_block(t, {"q": np.zeros((n, 1)) + 0.25, "u": np.zeros((n, 1))})
    one = CoordinateTerms(0, "hub.angle_rate", unit, "inertia")
    with open_run(path) as run:
        plot_terms(
            run, t, {name: rows[:, None] for name, rows in parts.items()}, [one], tmp_path / "t.png", theme, force=True
        )


def test_terms_have_pale_bands_and_a_line_with_a_rim(tmp_path, drawn_figure):
    t = np.linspace(0, 10, 200)
    spring, load = 3 * np.cos(t), 0.15 + 0 * t
    terms_run(tmp_path, t, {"inertia": -spring - load, "joint_springs": spring, "loads/push": load})
    figure = drawn_figure()
    strip, stack = figure.axes
    is_titled(figure, (10.0, 1.85 * 2.5 + 0.5))
    is_finished(strip)
    is_finished(stack)
    assert strokes(strip) == [(TEXT, 1.1, False, None, 2)] and strip.get_ylabel() == "[deg]"
    title = strip._left_title
    assert (title.get_text(), title.get_fontsize(), title.get_fontweight(), title.get_color()) == (
        "hub.angle", 10, "bold", TEXT,
    )  # fmt: skip
    assert fills(stack) == [(shade(LINES[k], 0.75), 0.0) for k in (0, 0, 1, 1)]
    rim, line = (DARK.background, 3.0, False, None, 2), (TEXT, 1.3, False, None, 2)
    assert strokes(stack) == [(FAINT, 0.6, False, None, 2), rim, line]
    size = np.abs(spring).mean()
    big, small = size / (size + 0.15), 0.15 / (size + 0.15)
    assert [text.get_text() for text in stack.get_legend().get_texts()] == [
        f"joint springs  {100 * big:.0f} %", f"load push  {100 * small:.1f} %", "sum: inertia",
    ]  # fmt: skip
    assert stack.get_ylabel() == "moment [N m]" and strip.get_xlim() == stack.get_xlim() == (0.0, 10.0)
    assert strip.get_position().height == pytest.approx(0.5 / 1.35 * stack.get_position().height, rel=0.2)


def test_terms_that_are_zero_or_have_spikes_have_sensible_limits(tmp_path, drawn_figure):
    t = np.linspace(0, 10, 200)
    terms_run(tmp_path, t, {"inertia": 0 * t, "joint_springs": 0 * t}, unit="N")
    stack = drawn_figure().axes[1]
    low, high = stack.get_ylim()
    assert low < 0 < high and stack.get_ylabel() == "force [N]" and not stack.texts
    spiked = np.where(np.arange(200) == 150, 100.0, 2.0 + np.sin(3 * t))
    terms_run(tmp_path, t, {"inertia": -spiked, "joint_springs": spiked}, unit="kg^1/2 m/s^2")
    stack = drawn_figure().axes[1]
    (note,) = stack.texts
    at = f"{t[150]:.3g}"
    text = f"cut off: up to 0, down to -100 kg$^{{1/2}}$ m/s$^{{2}}$, the farthest at {at}"
    assert note.get_text() == text and (*letters(note), note.get_va()) == (8, TEXT, "right", "bottom")
    assert note.xy == (1.0, 1.01) and note.xycoords == "axes fraction"
    bottom = np.percentile(-spiked, 2.0)
    assert stack.get_ylim() == pytest.approx((1.3 * bottom, -0.3 * bottom))
    assert stack.get_ylabel() == "generalised force [kg$^{1/2}$ m/s$^{2}$]"
