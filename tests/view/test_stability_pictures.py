"""Stability charts and loci as pictures: every curve, region, label and mark against numbers made here."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from matplotlib.colors import to_hex, to_rgba
from matplotlib.figure import Figure

from femflex.view.stability import NEAR, _name_branches, _span_of, plot_chart, plot_locus
from femflex.view.theme import THEMES

LIGHT = THEMES["light"]
KINDS = np.array([[2, 1], [0, -1], [2, 0]])  # three first values, two second ones


def chart(boundaries):
    return SimpleNamespace(
        names=("spin", "stiffness"),
        units=("rad/s", "1"),
        first=np.array([1.0, 2.0, 3.0]),
        second=np.array([10.0, 30.0]),
        kinds=KINDS,
        boundaries=boundaries,
    )


def data(line):
    return np.column_stack(line.get_data())


def test_a_chart_paints_every_cell_by_its_kind_and_traces_every_boundary(tmp_path, drawn_figure):
    curves = [np.array([[1.0, 12.0], [1.5, 20.0], [2.5, 22.0]]), np.array([[2.0, 11.0], [2.2, 29.0]])]
    other = np.array([[1.2, 10.0], [1.3, 28.0]])
    known = [("Hughes", np.array([[1.0, 15.0], [3.0, 25.0]])), ("Likins", np.array([[1.0, 16.0], [3.0, 27.0]]))]
    path = plot_chart(
        chart(tuple((2, k, points) for k, points in enumerate(curves))),
        tmp_path / "a.svg",
        title="Spinning boom",
        dpi=77,
        second=chart(((2, 0, other), (1, 0, other + np.array([0.5, 0.0])))),
        left_out=["damping", "thrust"],
        known=known,
    )
    figure = drawn_figure()
    (ax,) = figure.axes
    assert path == tmp_path / "a.svg" and figure.keywords == {"format": "svg", "dpi": 77}
    assert figure.get_suptitle() == "Spinning boom"
    (picture,) = ax.images
    assert picture.get_extent() == [0.5, 3.5, 0.0, 40.0] and picture.origin == "lower"
    shades = {2: (LIGHT.lines[2], 0.30), 1: (LIGHT.lines[1], 0.30), 0: (LIGHT.trace, 0.16), -1: (LIGHT.faint, 0.45)}
    cells = np.asarray(picture.get_array())
    assert cells.shape == (2, 3, 4)
    for i in range(3):
        for j in range(2):
            assert cells[j, i] == pytest.approx(to_rgba(*shades[KINDS[i, j]]))
    solid = [line for line in ax.lines if line.get_linestyle() == "-"]
    assert [data(line).tolist() for line in solid] == [points.tolist() for points in curves]
    dashed, dotted = ax.lines[2:4], ax.lines[4:]
    assert [data(line).tolist() for line in dashed] == [other.tolist(), (other + np.array([0.5, 0.0])).tolist()]
    assert [data(line).tolist() for line in dotted] == [points.tolist() for _, points in known]
    assert {line.get_color() for line in dashed} == {LIGHT.lines[0]}
    assert {line.get_color() for line in dotted} == {LIGHT.lines[3]}
    assert [text.get_text() for text in ax.get_legend().get_texts()] == [
        "stable",
        "stable by gyroscopic forces alone",
        "unstable",
        "no equilibrium, or no such body",
        "dashed: without damping, thrust",
        "dotted: Hughes",
    ]
    faces = [to_hex(one.get_facecolor()) for one in ax.get_legend().get_patches()]
    assert faces == [to_hex(shades[kind][0]) for kind in (2, 1, 0, -1)]
    assert (ax.get_xlim(), ax.get_ylim()) == ((1.0, 3.0), (10.0, 30.0))
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("spin [rad/s]", "stiffness")


def test_a_chart_of_one_kind_names_that_kind_alone(tmp_path, drawn_figure):
    one = chart(())
    one.kinds = np.full((3, 2), 1)
    plot_chart(one, tmp_path / "a.png", second=chart(()), left_out=["damping"])
    (ax,) = drawn_figure().axes
    assert [text.get_text() for text in ax.get_legend().get_texts()] == ["stable by gyroscopic forces alone"]
    with pytest.raises(ValueError, match=r"written as \.png or \.svg; a\.pdf is neither"):
        plot_chart(one, tmp_path / "a.pdf")


VALUES = np.array([1.0, 2.0, 4.0])
POLES = np.array([[-0.1 + 6j, 0.2 - 6j, 0.5 + 1j], [-0.2 + 8j, -0.2 - 8j, 0.3 - 0.5j], [0.3 + 9j, 0.3 - 9j, 0.4 + 2j]])


def locus(of, branches, names=(), critical=(1.7, 3.25)):
    return SimpleNamespace(
        of=of,
        name="spin",
        unit="rad/s^2",
        values=VALUES,
        branches=branches,
        kinds=np.array([2, 1, 0]),
        names=names,
        critical=critical,
    )


def test_a_locus_of_poles_draws_the_upper_half_plane_and_frequency_and_growth_over_the_value(tmp_path, drawn_figure):
    second = locus("poles", POLES[:, :2] * 1.5, ("flap 1", ""))
    plot_locus(
        locus("poles", POLES, ("flap 1", "lag 1", "lag 2")),
        tmp_path / "a.png",
        second=second,
        left_out=("spin softening", "thrust"),
        title="Loci",
    )
    figure = drawn_figure()
    plane, above, below = figure.axes
    assert figure.get_suptitle() == "Loci"
    first, third, dashed = POLES[:, 0], POLES[:, 2], 1.5 * POLES[:, 0]
    upper = np.where(third.imag >= 0, third, np.nan)
    curves = [line for line in plane.lines if len(line.get_xdata()) == 3]
    for line, branch in zip(curves, (first, upper, dashed), strict=True):
        expected = np.stack([branch.real, branch.imag / (2 * np.pi)], axis=1)
        expected[np.isnan(branch)] = np.nan
        np.testing.assert_allclose(data(line), expected)
    assert [line.get_color() for line in curves] == [LIGHT.lines[0], LIGHT.lines[1], LIGHT.lines[0]]
    assert [line.get_linestyle() for line in curves] == ["-", "-", "--"]
    rings = [line for line in plane.lines if line.get_marker() == "o"]
    hollow = [data(line)[0].tolist() for line in rings if line.get_markerfacecolor() == "none"]
    full = [data(line)[0].tolist() for line in rings if line.get_markerfacecolor() != "none"]
    assert hollow == [[-0.1, 6 / (2 * np.pi)], [0.5, 1 / (2 * np.pi)]]
    assert full == [[0.3, 9 / (2 * np.pi)], [0.4, 2 / (2 * np.pi)]]
    assert {text.get_text(): text.xy for text in plane.texts} == {
        "flap 1": (-0.1, 6 / (2 * np.pi)),
        "lag 2": (0.5, 1 / (2 * np.pi)),
    }
    for ax, part in ((above, lambda z: z.imag / (2 * np.pi)), (below, lambda z: z.real)):
        over = [line for line in ax.lines if len(line.get_xdata()) == 3]
        for line, branch in zip(over, (first, upper, dashed), strict=True):
            np.testing.assert_allclose(line.get_xdata(), VALUES)
            expected = np.where(np.isnan(branch), np.nan, part(branch))
            np.testing.assert_allclose(line.get_ydata(), expected)
        marks = [line.get_xdata()[0] for line in ax.lines if line.get_color() == LIGHT.trace]
        assert marks == [1.7, 3.25]
    assert [(text.get_text(), text.xy[0]) for text in above.texts] == [("1.7", 1.7), ("3.25", 3.25)]
    assert (plane.get_xlabel(), plane.get_ylabel()) == ("growth [1/s]", "frequency [Hz]")
    assert (above.get_ylabel(), below.get_ylabel()) == ("frequency [Hz]", "growth [1/s]")
    assert below.get_xlabel() == "spin [rad/s$^{2}$]" and below.get_xlim() == (1.0, 4.0) == above.get_xlim()
    upright = [line for line in plane.lines if line.get_color() == LIGHT.faint]
    level = [line for line in below.lines if line.get_color() == LIGHT.faint]
    assert list(upright[0].get_xdata()) == [0, 0] and list(level[0].get_ydata()) == [0, 0]
    assert [text.get_text() for text in plane.get_legend().get_texts()] == ["dashed: without spin softening, thrust"]


def test_a_locus_of_multipliers_draws_the_unit_circle_and_size_and_angle(tmp_path, drawn_figure):
    multipliers = np.array([[0.6 + 0.8j, 0.6 - 0.8j], [0.9j, -0.9j], [-1.2 + 0.1j, -1.2 - 0.1j]])
    plot_locus(locus("multipliers", multipliers, ("flap 1", "flap 1")), tmp_path / "a.svg", theme="dark")
    dark = THEMES["dark"]
    plane, above, below = drawn_figure().axes
    circle = next(line for line in plane.lines if len(line.get_xdata()) == 200)
    np.testing.assert_allclose(np.hypot(*circle.get_data()), 1.0)
    assert np.ptp(circle.get_xdata()) == pytest.approx(2.0, abs=1e-3)
    curves = [line for line in plane.lines if len(line.get_xdata()) == 3]
    for k, line in enumerate(curves):
        np.testing.assert_allclose(data(line), np.stack([multipliers[:, k].real, multipliers[:, k].imag], axis=1))
        assert line.get_color() == dark.lines[k]
    sizes = [line.get_ydata() for line in above.lines if len(line.get_xdata()) == 3]
    angles = [line.get_ydata() for line in below.lines if len(line.get_xdata()) == 3]
    np.testing.assert_allclose(sizes, np.abs(multipliers).T)
    np.testing.assert_allclose(angles, np.degrees(np.arctan2(multipliers.imag, multipliers.real)).T)
    limit = [line for line in above.lines if line.get_color() == dark.faint]
    assert list(limit[0].get_ydata()) == [1, 1]
    assert (plane.get_xlabel(), plane.get_ylabel()) == ("real part", "imaginary part")
    assert (above.get_ylabel(), below.get_ylabel()) == ("size", "angle [deg]")
    assert not plane.texts and plane.get_legend() is None


def test_names_of_branches_that_begin_close_together_share_a_label():
    figure = Figure()
    ax = figure.subplots()
    ax.set_xlim(0, 10)
    ax.set_ylim(0, 100)
    step = 0.3 * NEAR * 100
    named = [
        ("lag 1", 2.0, 50.0, "#111111"),
        ("lag 2", 2.1, 50.0 + step, "#222222"),
        ("lag 3", 2.2, 50.0 + 2 * step, "#333333"),
        ("flap 1", 2.0 + 1.3 * NEAR * 10, 50.0, "#444444"),  # too far to the right
        ("torsion 1", 2.0, 50.0 - 2 * step, "#555555"),  # too far below
        ("chordwise 1", 9.0, 50.0, "#666666"),
    ]
    _name_branches(ax, named, LIGHT)
    labels = {text.get_text(): text for text in ax.texts}
    assert set(labels) == {"lag 1 to 3", "flap 1", "torsion 1", "chordwise 1"}
    assert labels["lag 1 to 3"].xy == (2.0, 50.0 + 2 * step) and labels["lag 1 to 3"].get_color() == LIGHT.text
    assert labels["flap 1"].get_color() == "#444444" and labels["torsion 1"].get_color() == "#555555"
    assert labels["chordwise 1"].get_ha() == "right" and labels["flap 1"].get_ha() == "left"


@pytest.mark.parametrize(
    ("names", "label"),
    [
        (["lag 1", "lag 2", "flap 3"], "lag 1 to 2, flap 3"),
        (["lag 1", "lag 3"], "lag 1, lag 3"),
        (["tip", "tip", "flap 2"], "tip, tip, flap 2"),
        (["lag 9", "lag 10", "lag 11", "lag 1"], "lag 9 to 11, lag 1"),
        (["2"], "2"),
    ],
)
def test_numbers_that_follow_each_other_become_a_range(names, label):
    assert _span_of(names) == label
