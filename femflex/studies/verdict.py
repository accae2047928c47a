"""Sentences on a convergence study: accuracy reached, law of convergence, recommendation, and doubts."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from femflex.studies.levels import VARIED

if TYPE_CHECKING:
    from femflex.studies.convergence import Convergence


def verdict(study: Convergence) -> str:
    """The sentences on a study."""
    if study.exhaustive:
        sentences = [_exhaustive_text(study), _case_level_text(study)]
    else:
        sentences = [*_sentences_of_state(study), _rounding_text(study)]
    return " ".join(sentence for sentence in sentences if sentence)


def level_text(study: Convergence, level: int) -> str:
    """A level as words: "8 modes", "2 refinements (241 dofs)"."""
    index = np.flatnonzero(study.levels == level)
    count = int(study.counts[index[0]]) if index.size else None
    if study.over == "mesh":
        text = "the mesh as it is" if level == 0 else f"{level} refinement{'s' * (level != 1)}"
        return text if count is None else f"{text} ({count} dofs)"
    text = f"{level} {VARIED[study.over].noun}{'s' * (level != 1)}"
    n_derivatives = int(study.derivatives[index[0]]) if index.size and study.derivatives.size else 0
    if count is None or (count == level and not n_derivatives):
        return text
    n_dependent = int(study.followers[index[0]]) if index.size and study.followers.size else 0
    if n_dependent and study.over == "derivatives":
        return f"{text} per body ({count} shapes, {n_dependent} of them dependent derivative shapes)"
    of_them = f", {n_derivatives} of them derivative shapes" if n_derivatives else ""
    of_them += f", and {n_dependent} dependent derivative shapes" if n_dependent else ""
    return f"{text} per body ({count} elastic coordinates{of_them})"


def law_text(study: Convergence) -> str:
    """The law in words: "with order 3.98 in the cell size, +- 0.02", "like n^-4.1", or "" without one."""
    law, scatter = study.trend.law, study.trend.scatter
    if law is None:
        return ""
    sure = math.isfinite(scatter)
    if study.over in ("mesh", "segments"):
        text = f"with order {law.rate:.2f} in the {'cell size' if study.over == 'mesh' else 'length of a segment'}"
        return text + (f", +- {scatter:.2g} over the levels" if sure else ", seen once")
    text = f"like n^-{law.rate:.2f}"
    if law.kind == "geometric":
        text = f"by a factor {math.exp(-law.rate):.3g} with each mode"
    return text + (f", within a factor {math.exp(scatter):.3g}" if sure else ", by two differences alone")


def _exhaustive_text(study: Convergence) -> str:
    """Sentences for levels up to all existing shapes: the smallest sufficient number."""
    finest, fewest = int(study.levels[-1]), study.recommended
    text = f"{level_text(study, finest)}: no further shapes exist."
    if len(study.levels) == 1 or fewest is None:
        return text
    if fewest == finest:
        return f"{text} With fewer the value differs by {_relative(study, study.errors[-2])} or more, relative."
    off = _error_at(study, fewest)
    return f"{text} Of them {level_text(study, fewest)} suffice: the value differs by {off}, relative."


def _sentences_of_state(study: Convergence) -> list[str]:
    """Sentences for the trend of the values."""
    noun = VARIED[study.over].noun
    span = f"{int(study.levels[0])} to {int(study.levels[-1])} {noun}s"
    match study.trend.state:
        case "one":
            only = level_text(study, int(study.levels[0]))
            return [f"There is a value at {only} only; convergence needs at least three levels."]
        case "few":
            change = _relative(study, abs(study.values[-1] - study.values[0]))
            needed = "an order of convergence and an error estimate need at least three"
            return [f"Two levels differ by {change}, relative; {needed}."]
        case "constant":
            largest = _relative(study, np.abs(study.values - study.values[-1]).max())
            if study.recommended is None:
                tolerance = f"by more than the tolerance {study.tolerance:g}"
                return [f"Values differ by {largest}, relative: without a trend, but {tolerance}."]
            unseen = f"No dependence on the {VARIED[study.over].meaning} is seen"
            return [f"{unseen}: values at {span} differ by {largest}, relative, without a trend."]
        case "unsettled":
            return [_unsettled_text(study, span)]
    last = _required_level_text(study) if study.recommended is None else _case_level_text(study)
    return [_accuracy_text(study), _trend_text(study), last]


def _unsettled_text(study: Convergence, span: str) -> str:
    changes = ", ".join(f"{change:.2g}" for change in study.changes[-3:] if math.isfinite(change))
    last_changes = np.abs(study.changes[-2:])
    if len(last_changes) == 2 and last_changes[1] < last_changes[0] and len(study.levels) == 3:
        return (
            f"Three levels are too few here: the changes over {span} ({changes} {study.unit}) "
            "follow no law, so no error is estimated. Add levels."
        )
    return (
        f"Does not converge over {span}: the changes do not fall (the last are {changes} {study.unit}). "
        "No limit is estimated; look at the quantity itself, or add levels."
    )


def _accuracy_text(study: Convergence) -> str:
    level = study.recommended
    if level is None:
        last = level_text(study, int(study.levels[study.n_resolved - 1]))
        error = _relative(study, study.errors[study.n_resolved - 1])
        return f"Not converged to {study.tolerance:g}: with {last}, the estimated relative error is {error}."
    enough = "suffices" if level == (0 if study.over == "mesh" else 1) else "suffice"
    text = f"{level_text(study, level)} {enough}, with an estimated relative error of {_error_at(study, level)}"
    return f"Converged to {study.tolerance:g}: {text}."


def _trend_text(study: Convergence) -> str:
    match study.trend.state:
        case "law":
            spread = _relative(study, study.trend.spread)
            limit = f"{study.estimate:.9g} {study.unit}, relative uncertainty {spread}"
            return f"Errors fall {law_text(study)}; the limit is about {limit}."
        case "rounded":
            return "Only the first change is above rounding, too few for an order."
        case "swinging":
            return "Values oscillate, so there is no extrapolation and no order; errors are the last changes."
    return "The changes follow no clear law, so there is no extrapolation; errors are the last changes."


def _required_level_text(study: Convergence) -> str:
    """The level at which the law would reach the tolerance."""
    law = study.trend.law
    if study.trend.rounded is not None:
        return ""
    if law is None:
        return "Try more levels."
    if study.trend.spread > 1.5 * law.size:
        return "The limit itself is not known to this accuracy; try more levels, or a larger tolerance."
    x = law.reaches(study.tolerance * study.scale)
    needed = f"about {math.ceil(x)} elastic coordinates"
    if study.over in ("mesh", "segments"):
        count = math.ceil((math.log2(x) if study.over == "mesh" else x) - 1e-9)
        needed = f"{count} {VARIED[study.over].noun}s"
    return f"At this rate, {needed} would reach the tolerance."


def _case_level_text(study: Convergence) -> str:
    """Accuracy of the case's own level."""
    if study.case_level is None or study.case_level not in study.levels or study.recommended is None:
        return ""
    error = _error_at(study, study.case_level)
    if study.over == "mesh":
        return "" if study.recommended == 0 else f"The case's own mesh has an estimated relative error of {error}."
    enough = "enough" if study.recommended <= study.case_level else "not enough"
    return f"The case keeps {study.case_level}, which is {enough} ({error})."


def _rounding_text(study: Convergence) -> str:
    if study.trend.rounded is None:
        return ""
    start = f"From {level_text(study, int(study.levels[study.trend.rounded]))} on, rounding"
    if study.simulated:
        return f"{start} or the tolerance of the integration dominates: finer meshes show no more."
    return f"{start} dominates: a finer mesh loses digits. Use elements of higher order."


def _error_at(study: Convergence, level: int) -> str:
    return _relative(study, study.errors[study.levels == level][0])


def _relative(study: Convergence, error: float) -> str:
    return f"{error / study.scale:.2g}"
