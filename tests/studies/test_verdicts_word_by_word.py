"""What studies say, word by word and number by number, of results made by hand."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from femflex.studies.chosen import choice, choice_text
from femflex.studies.convergence import Convergence, errors, resolution
from femflex.studies.function_kinds import FunctionKind, FunctionStudy
from femflex.studies.law import Law, Trend
from femflex.studies.strain_forms import StrainForm, StrainStudy
from femflex.studies.verdict import law_text, level_text, verdict

NONE = np.zeros(0, np.int64)


def study(
    over: str, levels: list[int], values: list[float], off: list[float], trend: Trend, **more: Any
) -> Convergence:
    """A study whose counts are ten times its levels and one, where nothing else is said."""
    counts = more.pop("counts", [10 * level + 1 for level in levels])
    return Convergence(
        more.pop("title", "peak of x"),
        more.pop("unit", "m"),
        over,
        np.array(levels),
        np.array(counts),  # type: ignore[arg-type]
        np.array(values),
        np.array(off),
        trend,
        more.pop("tolerance", 1e-3),
        more.pop("own", None),
        more.pop("simulated", True),
        **more,
    )


LAW = Trend("law", 4.0, 2e-4, Law("algebraic", 2.0, 0.04, 8.0), 0.05)


@pytest.mark.parametrize(
    ("over", "counts", "derivatives", "followers", "level", "words"),
    [
        ("modes", [1, 3], [0, 0], [0, 0], 3, "3 modes"),
        ("modes", [1, 3], [0, 0], [0, 0], 1, "1 mode"),
        ("modes", [1, 3], [0, 0], [0, 0], 5, "5 modes"),
        ("modes", [2, 7], [0, 0], [0, 0], 3, "3 modes per body (7 elastic coordinates)"),
        ("modes", [2, 7], [0, 4], [0, 0], 3, "3 modes per body (7 elastic coordinates, 4 of them derivative shapes)"),
        ("modes", [1, 3], [0, 2], [0, 0], 3, "3 modes per body (3 elastic coordinates, 2 of them derivative shapes)"),
        (
            "modes",
            [2, 7],
            [0, 0],
            [0, 5],
            3,
            "3 modes per body (7 elastic coordinates, and 5 dependent derivative shapes)",
        ),
        (
            "derivatives",
            [4, 8],
            [1, 3],
            [0, 0],
            3,
            "3 derivative shapes per body (8 elastic coordinates, 3 of them derivative shapes)",
        ),
        (
            "derivatives",
            [4, 8],
            [0, 0],
            [1, 3],
            1,
            "1 derivative shape per body (4 shapes, 1 of them dependent derivative shapes)",
        ),
        ("segments", [6, 18], [0, 0], [0, 0], 3, "3 segments per body (18 elastic coordinates)"),
        ("mesh", [60, 241], [0, 0], [0, 0], 3, "3 refinements (241 dofs)"),
        ("mesh", [60, 241], [0, 0], [0, 0], 1, "1 refinement (60 dofs)"),
        ("mesh", [60, 241], [0, 0], [0, 0], 0, "the mesh as it is"),
        ("mesh", [60, 241], [0, 0], [0, 0], 2, "2 refinements"),
    ],
)
def test_a_level_is_said_with_what_it_counts(over, counts, derivatives, followers, level, words):
    found = study(
        over,
        [1, 3],
        [1.0, 2.0],
        [1.0, 1.0],
        LAW,
        counts=counts,
        derivatives=np.array(derivatives),
        followers=np.array(followers),
    )
    assert level_text(found, level) == words


@pytest.mark.parametrize(
    ("over", "law", "scatter", "words"),
    [
        (
            "mesh",
            Law("algebraic", 3.982, 1.0, 1.0),
            0.0213,
            "with order 3.98 in the cell size, +- 0.021 over the levels",
        ),
        (
            "segments",
            Law("algebraic", 1.5, 1.0, 1.0),
            math.nan,
            "with order 1.50 in the length of a segment, seen once",
        ),
        ("modes", Law("algebraic", 4.1, 1.0, 1.0), math.log(1.5), "like n^-4.10, within a factor 1.5"),
        (
            "modes",
            Law("geometric", math.log(4.0), 1.0, 1.0),
            math.nan,
            "by a factor 0.25 with each mode, by two differences alone",
        ),
        ("modes", None, 0.1, ""),
    ],
)
def test_a_law_is_said_with_its_rate_and_scatter(over, law, scatter, words):
    assert law_text(study(over, [1], [1.0], [1.0], Trend("law", 1.0, 0.1, law, scatter))) == words


CASES = {
    "law, converged, own level enough": (
        study("modes", [1, 2, 4], [5.0, 4.2, 4.001], [1.0, 0.2, 0.001], LAW, own=4),
        "Converged to 0.001: 4 modes per body (41 elastic coordinates) suffice, with an estimated relative error "
        "of 0.00025. "
        "Errors fall like n^-2.00, within a factor 1.05; the limit is about 4 m, relative uncertainty 5e-05. "
        "The case keeps 4, which is enough (0.00025).",
    ),
    "law, converged, own level too low": (
        study("modes", [1, 2, 4], [5.0, 4.2, 4.001], [1.0, 0.2, 0.001], LAW, own=2, counts=[1, 2, 4]),
        "Converged to 0.001: 4 modes suffice, with an estimated relative error of 0.00025. "
        "Errors fall like n^-2.00, within a factor 1.05; the limit is about 4 m, relative uncertainty 5e-05. "
        "The case keeps 2, which is not enough (0.05).",
    ),
    "one mode is enough": (
        study("modes", [1, 2, 4], [4.0, 4.0, 4.0], [1e-4, 1e-5, 1e-6], LAW, counts=[1, 2, 4]),
        "Converged to 0.001: 1 mode suffices, with an estimated relative error of 2.5e-05. "
        "Errors fall like n^-2.00, within a factor 1.05; the limit is about 4 m, relative uncertainty 5e-05.",
    ),
    "mesh, own mesh too coarse": (
        study("mesh", [0, 1, 2], [5.0, 4.2, 4.001], [1.0, 0.2, 0.001], LAW, own=0, counts=[9, 30, 99]),
        "Converged to 0.001: 2 refinements (99 dofs) suffice, with an estimated relative error of 0.00025. "
        "Errors fall with order 2.00 in the cell size, +- 0.05 over the levels; the limit is about 4 m, relative "
        "uncertainty 5e-05. The case's own mesh has an estimated relative error of 0.25.",
    ),
    "mesh as it is enough": (
        study("mesh", [0, 1], [4.0, 4.0], [1e-3, 1e-4], Trend("swinging", 4.0, 1e-4), own=0, counts=[9, 30]),
        "Converged to 0.001: the mesh as it is (9 dofs) suffices, with an estimated relative error of 0.00025. "
        "Values oscillate, so there is no extrapolation and no order; errors are the last changes.",
    ),
    "mesh not reached": (
        study(
            "mesh",
            [0, 1, 2],
            [5.0, 4.2, 4.04],
            [1.0, 0.2, 0.04],
            Trend("law", 4.0, 0.02, Law("algebraic", 2.0, 0.04, 4.0)),
            counts=[9, 30, 99],
        ),
        "Not converged to 0.001: with 2 refinements (99 dofs), the estimated relative error is 0.01. Errors fall with "
        "order 2.00 in the cell size, seen once; the limit is about 4 m, relative uncertainty 0.005. At this rate, 4 "
        "refinements would reach the tolerance.",  # 0.04 (x/4)^-2 = 0.004 at x = 12.65 = 2^3.66
    ),
    "segments not reached": (
        study(
            "segments",
            [1, 2, 4],
            [5.0, 4.2, 4.04],
            [1.0, 0.2, 0.04],
            Trend("law", 4.0, 0.02, Law("algebraic", 2.0, 0.04, 4.0)),
        ),
        "Not converged to 0.001: with 4 segments per body (41 elastic coordinates), the estimated relative error "
        "is 0.01. "
        "Errors fall with order 2.00 in the length of a segment, seen once; the limit is about 4 m, relative "
        "uncertainty "
        "0.005. At this rate, 13 segments would reach the tolerance.",
    ),
    "modes not reached": (
        study(
            "modes",
            [1, 2, 4],
            [5.0, 4.2, 4.04],
            [1.0, 0.2, 0.04],
            Trend("law", 4.0, 0.06, Law("geometric", 0.5, 0.04, 4.0)),
        ),
        "Not converged to 0.001: with 4 modes per body (41 elastic coordinates), the estimated relative error is 0.01. "
        "Errors fall by a factor 0.607 with each mode, by two differences alone; the limit is about 4 m, relative "
        "uncertainty 0.015. At this rate, about 9 elastic coordinates would reach the tolerance.",  # 4 + 2 ln 10 = 8.6
    ),
    "limit too uncertain": (
        study(
            "modes",
            [1, 2, 4],
            [5.0, 4.2, 4.04],
            [1.0, 0.2, 0.068],
            Trend("law", 4.0, 0.07, Law("geometric", 0.5, 0.04, 4.0)),
        ),
        "Not converged to 0.001: with 4 modes per body (41 elastic coordinates), the estimated relative error is "
        "0.017. "
        "Errors fall by a factor 0.607 with each mode, by two differences alone; the limit is about 4 m, relative "
        "uncertainty 0.018. The limit itself is not known to this accuracy; try more levels, or a larger tolerance.",
    ),
    "settling, not reached": (
        study("derivatives", [1, 2], [5.0, 4.0], [1.0, 0.2], Trend("settling", 4.0, 0.2)),
        "Not converged to 0.001: with 2 derivative shapes per body (21 elastic coordinates), the estimated "
        "relative error "
        "is 0.05. The changes fall without a clear law, so there is no extrapolation; errors are the last changes. Try "
        "more levels.",
    ),
    "rounding of a body": (
        study(
            "mesh",
            [0, 1, 2],
            [5.0, 4.0, 4.0],
            [1.0, 0.1, 0.1],
            Trend("rounded", 4.0, 0.1, rounded=2),
            simulated=False,
            counts=[9, 30, 99],
        ),
        "Not converged to 0.001: with 1 refinement (30 dofs), the estimated relative error is 0.025. Only the first "
        "change is above rounding, too few for an order. From 2 refinements (99 dofs) on, rounding dominates: a finer "
        "mesh loses digits. Use elements of higher order.",
    ),
    "rounding of a run": (
        study(
            "mesh",
            [0, 1, 2],
            [5.0, 4.0, 4.0],
            [1.0, 1e-3, 0.1],
            Trend("rounded", 4.0, 0.1, rounded=2),
            counts=[9, 30, 99],
        ),
        "Converged to 0.001: 1 refinement (30 dofs) suffice, with an estimated relative error of 0.00025. Only "
        "the first "
        "change is above rounding, too few for an order. From 2 refinements (99 dofs) on, rounding or the tolerance of "
        "the integration dominates: finer meshes show no more.",
    ),
    "one level": (
        study("modes", [3], [5.0], [math.nan], Trend("one", 5.0, math.nan), counts=[3]),
        "There is a value at 3 modes only; convergence needs at least three levels.",
    ),
    "two levels": (
        study("modes", [3, 5], [5.0, 4.0], [1.0, math.nan], Trend("few", 4.0, 1.0)),
        "Two levels differ by 0.25, relative; an order of convergence and an error estimate need at least three.",
    ),
    "constant": (
        study("segments", [2, 5], [4.0, 4.0001], [1e-4, 1e-4], Trend("constant", 4.0001, 1e-4)),
        "No dependence on the number of segments is seen: values at 2 to 5 segments differ by 2.5e-05, relative, "
        "without "
        "a trend.",
    ),
    "constant over meshes": (
        study("mesh", [0, 3], [4.0, 4.0001], [1e-4, 1e-4], Trend("constant", 4.0001, 1e-4)),
        "No dependence on the fineness of the mesh is seen: values at 0 to 3 refinements differ by 2.5e-05, relative, "
        "without a trend.",
    ),
    "constant but for noise": (
        study("modes", [2, 4, 5], [5.0, 3.0, 4.0], [2.0, 2.0, 2.0], Trend("constant", 4.0, 2.0)),
        "Values differ by 0.25, relative: without a trend, but by more than the tolerance 0.001.",
    ),
    "all shapes there are, fewer do": (
        study(
            "modes",
            [1, 2, 4],
            [5.0, 4.002, 4.0],
            [1.0, 0.002, 1e-12],
            Trend("unsettled", math.nan, math.nan),
            whole=True,
            own=2,
            tolerance=1e-2,
            counts=[1, 2, 4],
        ),
        "4 modes: no further shapes exist. Of them 2 modes suffice: the value differs by 0.0004, relative. The "
        "case keeps "
        "2, which is enough (0.0004).",  # of the largest value, 5
    ),
    "all shapes there are, none fewer do": (
        study(
            "derivatives",
            [1, 2, 4],
            [5.0, 4.5, 4.0],
            [1.0, 0.5, 1e-12],
            Trend("unsettled", math.nan, math.nan),
            whole=True,
            counts=[1, 2, 4],
        ),
        "4 derivative shapes: no further shapes exist. With fewer the value differs by 0.1 or more, relative.",
    ),
}


@pytest.mark.parametrize("name", CASES)
def test_a_verdict_says_what_was_reached_by_what_law_and_what_to_choose(name: str):
    found, words = CASES[name]
    assert verdict(found) == words
    assert found.verdict == found.to_dict()["verdict"] == verdict(found)


def test_a_study_in_plain_numbers_has_each_of_its_own():
    found = study(
        "mesh",
        [0, 1, 2],
        [5.0, 4.2, 4.04],
        [1.0, 0.2, 0.04],
        LAW,
        own=0,
        left_out=("0: coarse",),
        complete=False,
        derivatives=np.array([1, 2, 3]),
        followers=np.array([4, 5, 6]),
    )
    told = found.to_dict()
    assert np.isnan(told["changes"][0]) and told["changes"][1:] == pytest.approx([-0.8, -0.16])
    assert (told["derivatives"], told["followers"], told["counts"]) == ([1, 2, 3], [4, 5, 6], [1, 11, 21])
    assert (told["levels"], told["values"], told["errors"]) == ([0, 1, 2], [5.0, 4.2, 4.04], [1.0, 0.2, 0.04])
    assert (told["quantity"], told["unit"], told["over"], told["state"]) == ("peak of x", "m", "mesh", "law")
    assert (told["order"], told["scatter"], told["law"], told["estimate"]) == (2.0, 0.05, "algebraic", 4.0)
    assert (told["uncertainty"], told["tolerance"], told["recommended"], told["own"]) == (2e-4, 1e-3, None, 0)
    assert told["left_out"] == ["0: coarse"] and told["complete"] is False
    assert found.x.tolist() == [1.0, 2.0, 4.0]


def test_the_recommended_level_is_the_first_from_which_all_errors_above_rounding_are_small():
    bounced = study(
        "modes", [1, 2, 4, 6, 8], [4.0] * 5, [1e-3, 1.0, 4e-3, 1e-3, 1.0], Trend("law", 4.0, 0.0, LAW.law, rounded=4)
    )
    assert bounced.recommended == 4 and bounced.n_resolved == 4  # within the limit too, and 8 is rounding
    late = study("modes", [1, 2, 4], [4.0] * 3, [1e-3, 1.0, 1.0], Trend("law", 4.0, 0.0, LAW.law, rounded=1))
    assert late.recommended == 1
    assert study("modes", [1, 2], [4.0, 4.0], [1e-3, 4.1e-3], LAW).recommended is None


@pytest.mark.parametrize(
    ("limit", "values", "scale"),
    [(-4.0, [5.0, 6.0], 4.0), (1e-12, [-5.0, 2.0], 5.0), (math.nan, [1.0, -7.0], 7.0), (0.0, [0.0, 0.0], 1.0)],
)
def test_errors_are_relative_to_the_limit_or_to_the_largest_value(limit, values, scale):
    assert study("modes", [1, 2], values, [0.0, 0.0], Trend("law", limit, 0.1, LAW.law)).scale == scale


def test_errors_are_no_less_than_the_uncertainty_of_the_limit_and_than_rounding():
    values, noise = np.array([7.0, 5.0, 4.1, 4.05]), np.array([0.01, 0.01, 0.2, 0.02])
    assert errors(Trend("law", 4.0, 0.06, LAW.law), values, noise) == pytest.approx([3.0, 1.0, 0.2, 0.06])
    few = errors(Trend("few", 4.1, 1.0), np.array([5.0, 4.1]), np.zeros(2))
    assert few[0] == pytest.approx(0.9) and np.isnan(few[1])
    assert np.isnan(study("modes", [1, 2], [1.0, 2.0], [0.0, 0.0], Trend("few", 2.0, 1.0)).estimate)


@pytest.mark.parametrize(
    ("over", "counts", "wanted"),
    [
        ("modes", [3, 8, 11], [3, 8, 11]),
        ("modes", [3, 8, 8], [0, 1, 4]),
        ("derivatives", [5, 5, 4], [5, 5, 4]),
        ("mesh", [9, 30, 99], [1, 2, 16]),
        ("segments", [9, 30, 99], [0, 1, 4]),
    ],
)
def test_the_resolution_is_what_errors_fall_by(over, counts, wanted):
    assert resolution(over, np.array([0, 1, 4]), np.array(counts)).tolist() == wanted


def functions(name: str, levels: list[int], counts: list[int], values: list[float]) -> FunctionKind:
    return FunctionKind(name, study("modes", levels, values, [0.0] * len(levels), LAW, counts=counts), 1.5)


def test_types_of_functions_are_judged_from_the_value_that_moved_least_at_last():
    found = FunctionStudy(
        "peak of x",
        1e-2,
        (
            functions("characteristic", [1, 2, 4], [2, 4, 8], [-5.0, -4.3, -4.1]),
            functions("polynomial", [1, 2, 4], [3, 6, 12], [-4.01, -4.2, -4.03]),
            FunctionKind("elements", None, problem="it diverges"),
            functions("characteristic, tip", [2, 4, 6], [5, 7, 11], [-4.1, -4.001, -4.0]),
            functions("single", [9], [1], [-4.0]),
        ),
        {"boom": "polynomial, 3"},
    )
    assert found.reference is not None and found.reference[0] == "characteristic, tip" and found.scale == 4.0
    kinds = dict(found.with_values)
    assert list(kinds) == ["characteristic", "polynomial", "characteristic, tip", "single"] and found.unit == "m"
    assert found.differences(kinds["polynomial"]) == pytest.approx([0.0025, 0.05, 0.0075])
    assert [found.enough(one) for one in kinds.values()] == [None, 4, 4, 9]
    assert found.settled and found.chosen == ("single", 9) and found.recommended == "single, 9"
    assert found.verdict == (
        "Elements functions have no value: it diverges. Characteristic: 4 per field are too few (0.025 off). "
        "Polynomial: 4 per field suffice (0.0075 off). Characteristic, tip: 4 per field suffice (0.00025 off). "
        "Single: 9 per field suffice (0 off). Differences are from characteristic, tip with 6 per field, relative. "
        "Choose single, 9 per field."
    )
    told = found.to_dict()
    assert [one.get("enough") for one in told["kinds"]] == [None, 4, None, 4, 9]
    assert [(one["kind"], one["problem"], one["seconds"]) for one in told["kinds"][1:3]] == [
        ("polynomial", "", 1.5),
        ("elements", "it diverges", pytest.approx(math.nan, nan_ok=True)),
    ]
    assert (told["quantity"], told["over"], told["own"], told["tolerance"]) == (
        "peak of x",
        "functions",
        {"boom": "polynomial, 3"},
        1e-2,
    )
    assert "study" not in told["kinds"][2] and told["kinds"][0]["study"]["values"] == [-5.0, -4.3, -4.1]
    assert choice(found) == "single, 9"


def test_types_that_settle_nowhere_are_told_and_two_that_agree_settle_each_other():
    apart = FunctionStudy(
        "x", 1e-3, (functions("a", [1, 2], [2, 4], [5.0, 4.0]), functions("b", [1, 2], [2, 4], [6.0, 4.5])), {}
    )
    assert not apart.settled and apart.chosen is None and apart.recommended is None
    assert apart.verdict.endswith(
        "from a with 2 per field, relative. No type settles within the tolerance 0.001; try more functions."
    )
    agreed = FunctionStudy(
        "x", 1e-3, (functions("a", [1, 2], [2, 6], [5.0, 4.0]), functions("b", [1, 2], [2, 4], [6.0, 4.004])), {}
    )
    assert agreed.settled and agreed.chosen == ("b", 2)
    alike = FunctionStudy(
        "x", 1e-3, (functions("a", [1, 2], [2, 4], [5.0, 4.0]), functions("b", [1, 2], [2, 4], [6.0, 4.004])), {}
    )
    assert alike.chosen == ("a", 2)
    lone = FunctionStudy("x", 1e-3, (functions("a", [2], [4], [4.0]), FunctionKind("b", None, problem="no")), {})
    assert lone.reference is None and not lone.settled and lone.scale == 1.0
    assert (
        lone.verdict == "B functions have no value: no. Nothing can be compared."
        and lone.to_dict()["kinds"][0]["enough"] is None
    )
    zero = FunctionStudy("x", 1e-3, (functions("a", [1, 2], [2, 4], [1e-4, 0.0]),), {})
    assert zero.scale == 1.0 and zero.settled


def forms(*values: float, tolerance: float = 1e-2) -> StrainStudy:
    made = tuple(
        StrainForm(strain, 3, 2, 1, value, seconds, "" if math.isfinite(value) else "it diverges at t = 2 s", "mm")  # type: ignore[arg-type]
        for strain, value, seconds in zip(("linear", "condensed", "nonlinear"), values, (1.0, 2.0, 8.0), strict=True)
    )
    return StrainStudy("peak of x", tolerance, made, {"boom": "condensed"})


def test_forms_of_strain_are_compared_with_the_one_that_holds_furthest():
    found = forms(-4.4, -3.98, -4.0)
    assert found.reference is found.forms[2] and found.unit == "mm"
    assert [found.difference(one) for one in found.forms] == pytest.approx([0.1, 0.005, 0.0])
    assert found.recommended == "condensed" and found.verdict == (
        "Linear strain is not enough: 0.1 off nonlinear strain (tolerance 0.01), in 0.12 of its time. "
        "Condensed strain is enough: 0.005 off nonlinear strain (tolerance 0.01), in 0.25 of its time. "
        "Choose strain = 'condensed'."
    )
    told = found.to_dict()
    assert [one["difference"] for one in told["forms"]] == pytest.approx([0.1, 0.005, 0.0])
    assert told["recommended"] == "condensed" and told["own"] == {"boom": "condensed"} and told["over"] == "strain"


def test_forms_without_a_value_are_told_and_not_compared():
    broken = forms(-4.4, -4.0, math.nan)
    assert broken.reference is broken.forms[1] and broken.recommended == "condensed"
    assert broken.verdict.startswith(
        "Linear strain is not enough: 0.1 off condensed strain (tolerance 0.01), in 0.5 of"
    )
    middle = forms(-4.0, math.nan, -4.0)
    assert "Condensed strain has no value: it diverges at t = 2 s. Choose strain = 'linear'." in middle.verdict
    assert math.isnan(middle.difference(middle.forms[1]))
    lone = forms(math.nan, 3.0, math.nan)
    assert lone.recommended is None and lone.unit == "mm"
    assert lone.verdict == "Nothing can be compared: only strain = 'condensed' has a value."
    assert forms(*[math.nan] * 3).verdict == "Nothing can be compared: no form has a value."
    assert forms(1e-3, 2e-3, 0.0).difference(forms(1e-3, 2e-3, 0.0).forms[1]) == 2e-3  # of 1 where there is nothing


def test_all_choices_are_said_in_one_sentence():
    reached = study("modes", [1, 2, 4], [4.0] * 3, [1.0, 1e-3, 1e-3], LAW)
    short = study("mesh", [0, 1, 2], [4.0] * 3, [1.0, 1.0, 1.0], Trend("law", 4.0, 0.1, LAW.law, rounded=2))
    assert choice(reached) == 2 and choice(short) == 1
    none = forms(*[math.nan] * 3)
    assert choice_text([reached, short, none]) == (
        "Choose modes = 2, mesh = 1: each study used the results of the ones before it. Over mesh, strain the "
        "tolerance "
        "is not reached."
    )
    assert choice_text([reached]) == "Choose modes = 2: each study used the results of the ones before it."
    assert choice_text([none]) == "No study gave a result to choose by."
