"""Convergence studies as drawn: values, limits, errors, laws and names by their numbers; several side by side."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from femflex.view.convergence import plot_convergence
from femflex.view.side_by_side import plot_studies
from femflex.view.theme import THEMES

LIGHT = THEMES["light"]


def study(**changes):
    """Six levels: an error of 4 / x^2, rounding at the last, x the square root of the counts."""
    counts = np.array([10, 30, 60, 110, 200, 400])
    x = np.sqrt(counts)
    errors = 4.0 / x**2
    errors[4:] = [1e-6, np.nan]
    made = {
        "title": "peak of the tip",
        "unit": "m",
        "over": "mesh",
        "levels": np.arange(6),
        "counts": counts,
        "followers": np.zeros(6, int),
        "values": 3.0 + np.array([0.5, 0.2, -0.1, 0.05, 0.02, 0.01]),
        "errors": errors,
        "tolerance": 0.02,
        "x": x,
        "n_resolved": 4,
        "law": SimpleNamespace(error=lambda x: 4.0 / x**2),
        "law_text": "as the square of the size of elements",
        "estimate": 3.004,
        "scale": 2.5,
        "recommended": 3,
        "verdict": "It converges. " * 15,
    }
    return SimpleNamespace(**(made | changes))


def line_of(ax, label):
    (line,) = [line for line in ax.lines if line.get_label() == label]
    return np.column_stack(line.get_data())


def test_values_limit_tolerance_and_errors_stand_where_the_study_has_them(tmp_path, drawn_figure):
    one = study()
    plot_convergence(one, tmp_path / "a.svg", dpi=90)
    figure = drawn_figure()
    above, below = figure.axes
    assert figure.get_suptitle() == "Peak of the tip over finer meshes" and figure.keywords == {
        "format": "svg",
        "dpi": 90,
    }
    assert figure.get_supxlabel().replace("\n", " ") == one.verdict.strip()
    assert max(map(len, figure.get_supxlabel().split("\n"))) in range(110, 127)
    np.testing.assert_allclose(line_of(above, "value"), np.column_stack([one.counts, one.values]))
    assert line_of(above, "limit")[:, 1] == pytest.approx([3.004, 3.004])
    band = above.patches[0]
    assert (band.get_y(), band.get_height()) == pytest.approx((3.004 - 0.05, 0.1))
    assert line_of(above, "to choose").tolist() == [[110, 3.05]] and line_of(below, "to choose") == pytest.approx(
        np.array([[110, 4 / 110 / 2.5]])
    )
    np.testing.assert_allclose(
        line_of(below, "estimated error"), np.column_stack([one.counts[:5], one.errors[:5] / 2.5])
    )
    (law,) = [line for line in below.lines if line.get_label().startswith("errors fall")]
    assert law.get_label() == "errors fall\nas the square of the\nsize of elements"
    assert law.get_xdata()[[0, -1]] == pytest.approx([10, 110])  # what is resolved
    assert law.get_ydata()[[0, -1]] == pytest.approx([0.4 / 2.5, 4 / 110 / 2.5])
    inside = np.interp(np.log(30), np.log(law.get_xdata()), np.log(law.get_ydata()))
    assert np.exp(inside) == pytest.approx(4 / 30 / 2.5, rel=1e-3)
    assert line_of(below, "tolerance 0.02")[:, 1].tolist() == [0.02, 0.02]
    assert [(t.get_text(), t.xy[0]) for t in below.texts] == [(str(k), one.counts[k]) for k in range(5)]
    assert [t.xy[1] for t in below.texts] == pytest.approx(list(one.errors[:5] / 2.5))
    assert (above.get_xscale(), below.get_xscale(), below.get_yscale()) == ("log", "log", "log")
    assert (above.get_ylabel(), below.get_ylabel()) == ("value [m]", "estimated relative error")
    assert below.get_xlabel() == "degrees of freedom   (at a point: refinements of the mesh)"
    assert [t.get_text() for t in below.get_xticklabels()] == [str(n) for n in one.counts]
    low, high = above.get_ylim()  # the tolerance is not much wider than the values: it is shown too
    assert (low, high) == pytest.approx((2.9 - 0.08 * 0.6, 3.5 + 0.08 * 0.6))


@pytest.mark.parametrize(
    ("changes", "limits"),
    [
        ({"values": np.linspace(2.0, 2.01, 6), "estimate": 2.02, "tolerance": 0.001}, (2.0, 2.0225)),
        ({"values": np.linspace(2.0, 2.01, 6), "estimate": 2.02, "tolerance": 0.02}, (1.97, 2.07)),
        ({"values": np.linspace(2.0, 2.01, 6), "estimate": 1.999, "tolerance": 1.0}, (1.999, 2.01)),
        ({"values": np.full(6, 2.0), "estimate": 2.0, "tolerance": 0.1}, (1.75, 2.25)),
    ],
)
def test_the_limits_hold_values_and_limit_and_the_tolerance_where_it_is_not_much_wider(
    tmp_path, drawn_figure, changes, limits
):
    plot_convergence(study(**changes), tmp_path / "a.png")
    low, high = limits
    margin = 0.08 * (high - low)
    assert drawn_figure().axes[0].get_ylim() == pytest.approx((low - margin, high + margin))


def test_what_is_not_known_is_left_out(tmp_path, drawn_figure):
    nothing = {"errors": np.full(6, np.nan), "law": None, "estimate": np.nan, "recommended": None, "unit": "1"}
    plot_convergence(study(**nothing), tmp_path / "a.png", title="Mine")
    figure = drawn_figure()
    above, below = figure.axes
    assert figure.get_suptitle() == "Mine" and above.get_ylabel() == "value"
    assert [line.get_label() for line in above.lines] == ["value"]
    assert [t.get_text() for t in below.texts] == ["no error can be estimated"]
    assert [line.get_label() for line in below.lines] == ["tolerance 0.02"]


@pytest.mark.parametrize(
    ("changes", "label", "marks"),
    [
        ({"over": "modes"}, "elastic coordinates   (at a point: modes per body)", 5),
        ({"over": "modes", "levels": study().counts}, "elastic coordinates", 0),
        ({"over": "derivatives"}, "elastic coordinates   (at a point: derivative shapes per body)", 5),
        ({"over": "derivatives", "followers": np.arange(6)}, "shapes   (at a point: derivative shapes per body)", 5),
        ({"over": "mesh", "counts": np.full(6, 7), "law": None}, "refinements of the mesh", 0),
        ({"over": "modes", "counts": np.full(6, 7), "levels": np.arange(1, 7)}, "modes per body", 0),
    ],
)
def test_the_abscissa_says_what_is_counted(tmp_path, drawn_figure, changes, label, marks):
    plot_convergence(study(**changes), tmp_path / "a.png")
    below = drawn_figure().axes[1]
    assert below.get_xlabel() == label and len(below.texts) == marks
    levels_from_zero = changes.get("counts") is not None and changes["over"] == "mesh"
    assert below.get_xscale() == ("linear" if levels_from_zero else "log")


def form(strain, coordinates, derivatives, followers, value, seconds, problem=""):
    return SimpleNamespace(
        strain=strain,
        coordinates=coordinates,
        derivatives=derivatives,
        followers=followers,
        value=value,
        seconds=seconds,
        problem=problem,
    )


FORMS = (
    form("linear", 4, 0, 0, -1.3, 0.1234),
    form("condensed", 4, 0, 3, -1.05, 0.25),
    form("away", 5, 1, 0, np.nan, np.nan, "it diverges at t = 3 s of the run"),
    form("nonlinear", 7, 3, 0, -1.0, 4.0),
)


def strain_study():
    return SimpleNamespace(
        title="peak of tip",
        over="strain",
        unit="m",
        tolerance=0.01,
        forms=FORMS,
        reference=FORMS[3],
        difference=lambda one: abs(one.value + 1.0),
        verdict="Choose condensed.",
    )


def functions_study():
    kinds = {"beam": ([2, 4, 6], [1.1, 1.01, 1.0]), "plate": ([3, 5, 8], [0.9, 0.99, 1.002])}
    found = [
        (kind, SimpleNamespace(counts=np.array(counts), values=np.array(values)))
        for kind, (counts, values) in kinds.items()
    ]
    return SimpleNamespace(
        title="tip",
        over="functions",
        unit="1",
        tolerance=0.003,
        reference=1.0,
        with_values=found,
        differences=lambda one: np.abs(one.values - 1.0),
        verdict="Choose beam.",
    )


def test_forms_of_strain_stand_side_by_side_with_differences_and_times(tmp_path, drawn_figure):
    plot_studies([strain_study()], tmp_path / "a.png", "said elsewhere")
    figure = drawn_figure()
    above, below = figure.axes
    assert figure.get_suptitle() == "Peak of tip" and figure.get_supxlabel() == "Choose condensed."
    np.testing.assert_array_equal(line_of(above, "value"), [[0, -1.3], [1, -1.05], [2, np.nan], [3, -1.0]])
    assert line_of(above, "nonlinear, +- 0.01")[:, 1].tolist() == [-1.0, -1.0]
    assert (above.patches[0].get_y(), above.patches[0].get_height()) == pytest.approx((-1.01, 0.02))
    said = {t.get_text(): t.xy for t in above.texts}
    assert set(said) == {"0.3 off", "0.05 off", "it diverges at t = 3 s\nof the run"}
    assert said["0.3 off"] == (0, -1.3) and said["0.05 off"] == (1, -1.05)
    assert said["it diverges at t = 3 s\nof the run"][0] == 2
    bars = [(bar.get_x() + bar.get_width() / 2, bar.get_height()) for bar in below.patches]
    np.testing.assert_allclose(bars, [[0, 0.1234], [1, 0.25], [2, np.nan], [3, 4.0]])
    assert [t.get_text() for t in below.texts] == ["0.123 s", "0.25 s", "4 s"]
    assert [t.xy for t in below.texts] == [(0, 0.1234), (1, 0.25), (3, 4.0)]
    assert [t.get_text() for t in below.get_xticklabels()] == [
        "linear\n4 coordinates",
        "condensed\n4 coordinates,\n3 dependent derivatives",
        "away\n5 coordinates,\n1 derivatives",
        "nonlinear\n7 coordinates,\n3 derivatives",
    ]
    assert (above.get_ylabel(), below.get_ylabel()) == ("value [m]", "time of the run [s]")


def test_several_studies_share_a_picture_a_column_each(tmp_path, drawn_figure):
    studies = [study(), functions_study(), strain_study()]
    plot_studies(studies, tmp_path / "a.svg", "All converge. " * 30, dpi=60)
    figure = drawn_figure()
    assert figure.get_size_inches() == pytest.approx([3 * 5.2, 7.2]) and figure.keywords == {"format": "svg", "dpi": 60}
    above, below = figure.axes[:3], figure.axes[3:]
    assert [ax.get_title() for ax in above] == ["over finer meshes", "over functions", "over strain"]
    assert figure.get_supxlabel().startswith("All converge.") and "\n" in figure.get_supxlabel()
    assert 3 * 76 - 15 < len(figure.get_supxlabel().split("\n")[0]) <= 3 * 76
    assert line_of(above[0], "value")[:, 0].tolist() == study().counts.tolist()
    np.testing.assert_allclose(line_of(above[1], "beam"), [[2, 1.1], [4, 1.01], [6, 1.0]])
    np.testing.assert_allclose(line_of(below[1], "beam"), [[2, 0.1], [4, 0.01]])  # no difference is not drawn
    np.testing.assert_allclose(line_of(below[1], "plate"), [[3, 0.1], [5, 0.01], [8, 0.002]])
    assert line_of(below[1], "tolerance 0.003")[:, 1].tolist() == [0.003, 0.003]
    assert below[1].get_yscale() == "log" and above[1].get_ylabel() == "value"
    assert (below[1].get_xlabel(), below[1].get_ylabel()) == ("elastic coordinates", "relative difference")
    colours = [line.get_color() for line in above[1].lines]
    assert colours == list(LIGHT.lines[:2])
    plot_studies([study()], tmp_path / "b.svg", "", dpi=60)
    assert drawn_figure().get_suptitle() == "Peak of the tip over finer meshes"  # one over numbers, as by itself
    plot_studies([functions_study()], tmp_path / "c.svg", "")
    assert drawn_figure().get_size_inches() == pytest.approx([7.0, 7.2])
    assert drawn_figure().get_supxlabel() == "Choose beam."
