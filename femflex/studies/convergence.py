"""Convergence of a case's [study] quantity: values, errors, order, limit, and a verdict."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from femflex.arrays import Array, IntArray
from femflex.case import Case, read_case
from femflex.studies.levels import VARIED
from femflex.studies.study import Over, Point, Progress, Study, plan_study, quantity_text
from femflex.studies.trend import Law, Trend, mesh_trend, mode_trend


@dataclass(frozen=True, eq=False)
class Convergence:
    """Result of a convergence study; the arrays run over its levels, coarse to fine.

    title, unit   the quantity in words and its unit
    over          "modes": levels are modes a body, counts elastic coordinates; "mesh": refinements and dofs;
                  "derivatives", "segments": derivative shapes or segments a body, and elastic coordinates
    levels, counts (n,)
    values  (n,)  the quantity
    changes (n,)  from the level before, nan first
    errors  (n,)  estimated, absolute; nan where none can be estimated
    trend         law by which the errors fall, limit and its uncertainty
    tolerance     largest error relative to `scale` that counts as converged
    case_level    level of the case itself, None where its bodies differ
    simulated     the quantity is that of a run, not of a body
    left_out      levels too coarse for the case, each with the reason
    complete      False when the study was interrupted
    derivatives   (n,) number of the counted coordinates that are derivative shapes
    exhaustive    no level beyond the last one exists: errors are distances from it if they follow no law
    followers     (n,) number of derivative shapes that depend on the coordinates of condensed bodies
    added         (n,) number of the counted coordinates that are static shapes in addition to modes
    """

    title: str
    unit: str
    over: Over
    levels: IntArray
    counts: IntArray
    values: Array
    errors: Array
    trend: Trend
    tolerance: float
    case_level: int | None
    simulated: bool
    left_out: tuple[str, ...] = ()
    complete: bool = True
    derivatives: IntArray = field(default_factory=lambda: np.zeros(0, np.int64))
    followers: IntArray = field(default_factory=lambda: np.zeros(0, np.int64))
    added: IntArray = field(default_factory=lambda: np.zeros(0, np.int64))
    exhaustive: bool = False

    @property
    def changes(self) -> Array:
        """Change from the level before (n,), in the unit of the quantity, nan first."""
        return np.concatenate([[np.nan], np.diff(self.values)])

    @property
    def order(self) -> float:
        """Observed order in the cell size, or fitted rate in the number of modes; nan without a law."""
        return self.trend.order

    @property
    def estimate(self) -> float:
        """The limit: Richardson's extrapolation, or that of the fitted law; the last value where there is no law.

        nan when values do not settle, or are too few to tell.
        """
        return math.nan if self.trend.state in ("one", "few") else self.trend.limit

    @property
    def scale(self) -> float:
        """Reference of relative errors: size of the limit, or of the largest value if the limit is almost zero."""
        largest = float(np.abs(self.values).max())
        limit = abs(self.trend.limit)
        return limit if limit > 1e-9 * largest else largest or 1.0

    @property
    def recommended(self) -> int | None:
        """The coarsest level from which on all errors above rounding are within the tolerance, or None."""
        acceptable = self.errors[: self.n_resolved] <= self.tolerance * self.scale
        unacceptable = np.flatnonzero(~acceptable)
        start = int(unacceptable[-1]) + 1 if unacceptable.size else 0
        return int(self.levels[start]) if start < self.n_resolved else None

    @property
    def n_resolved(self) -> int:
        """Number of levels before rounding dominates."""
        return len(self.levels) if self.trend.rounded is None else self.trend.rounded

    @property
    def x(self) -> Array:
        """Resolution (n,) [1]: elastic coordinates, segments, or cells along an edge of the case's own."""
        return resolution(self.over, self.levels, self.counts)

    @property
    def law(self) -> Law | None:
        """The law by which errors decrease in `x`, None without one."""
        return self.trend.law

    @property
    def law_text(self) -> str:
        """The law in words, such as "with order 3.98 in the cell size, +- 0.02"; "" without one."""
        law, scatter = self.trend.law, self.trend.scatter
        if law is None:
            return ""
        sure = math.isfinite(scatter)
        if self.over in ("mesh", "segments"):
            text = f"with order {law.rate:.2f} in the {'cell size' if self.over == 'mesh' else 'length of a segment'}"
            return text + (f", +- {scatter:.2g} over the levels" if sure else ", seen once")
        text = f"like n^-{law.rate:.2f}"
        if law.kind == "geometric":
            text = f"by a factor {math.exp(-law.rate):.3g} with each mode"
        return text + (f", within a factor {math.exp(scatter):.3g}" if sure else ", by two differences alone")

    def level_text(self, k: int) -> str:
        """The k-th level in words, such as "8 modes per body (26 elastic coordinates)"."""
        level, count = int(self.levels[k]), int(self.counts[k])
        text = f"{level} {VARIED[self.over].noun}{'s' * (level != 1)}"
        if self.over == "mesh":
            return f"{text} ({count} dofs)"
        derivatives, dependent = (int(row[k]) if row.size else 0 for row in (self.derivatives, self.followers))
        if count == level and not derivatives:
            return text
        parts = [f"{count} elastic coordinates", *[f"{derivatives} of them derivative shapes"] * bool(derivatives)]
        parts += [f"{dependent} dependent derivative shapes"] * bool(dependent)
        return f"{text} per body ({', '.join(parts)})"

    @property
    def verdict(self) -> str:
        """The conclusions, in sentences: accuracy, law, recommendation, and doubts."""
        tolerance, best, state = f"{self.tolerance:g}", self.recommended, self.trend.state
        span = f"{int(self.levels[0])} to {int(self.levels[-1])} {VARIED[self.over].noun}s"
        largest = f"{np.abs(self.values - self.values[-1]).max() / self.scale:.2g}"
        errors = [f"{error / self.scale:.2g}" for error in self.errors]
        chosen = None if best is None else int(np.flatnonzero(self.levels == best)[0])
        enough = "" if chosen is None else f"{self.level_text(chosen)} suffice{'s' * (best == 1)}"
        own = np.flatnonzero(self.levels == (-1 if self.case_level is None else self.case_level))
        of_case = ""
        if len(own) and best is not None:
            word = "enough" if best <= int(self.levels[own[0]]) else "not enough"
            of_case = f"The level of the case, {int(self.levels[own[0]])}, is {word} (error {errors[own[0]]})."
        sentences = []
        if self.exhaustive:
            sentences = [f"{self.level_text(-1)}: no further shapes exist."]
            if chosen is not None and chosen < len(errors) - 1:
                sentences += [f"Of them {enough}: the value differs by {errors[chosen]}, relative.", of_case]
            return " ".join(filter(None, sentences))
        if state == "one":
            sentences = [f"There is a value at {self.level_text(0)} only; convergence needs at least three levels."]
        elif state == "few":
            sentences = [f"Two levels differ by {largest}, relative; an estimate of the error needs at least three."]
        elif state == "constant":
            than = "" if best is not None else f", which is more than the tolerance {tolerance}"
            sentences = [f"Values at {span} differ by {largest}, relative, without a trend{than}."]
        elif state == "unsettled":
            changes = ", ".join(f"{change:.2g}" for change in self.changes[-3:] if math.isfinite(change))
            sentences = [
                f"Does not converge over {span}: the last changes are {changes} {self.unit}, so that no limit is"
            ]
            sentences += ["estimated. Look at the quantity itself, or add levels."]
        else:
            k = self.n_resolved - 1
            text = f"Converged to {tolerance}: {enough}, with an estimated error of {errors[chosen or 0]}, relative."
            if chosen is None:
                missed = f"with {self.level_text(k)}, the estimated error is {errors[k]}, relative"
                text = f"Not converged to {tolerance}: {missed}."
            sentences = [text, self._trend_text(), of_case or (self._required_text() if chosen is None else "")]
        if self.trend.rounded is not None:
            cause = "rounding or the tolerance of the integration" if self.simulated else "rounding"
            sentences.append(f"From {self.level_text(self.trend.rounded)} on, {cause} dominates.")
        return " ".join(filter(None, sentences))

    def _trend_text(self) -> str:
        spread = self.trend.spread / self.scale
        return {
            "law": f"Errors fall {self.law_text}; the limit is about {self.estimate:.9g} {self.unit}, relative "
            f"uncertainty {spread:.2g}.",
            "rounded": "Only the first change is above rounding, too few for an order.",
            "swinging": "Values oscillate, so there is no extrapolation; errors are the last changes.",
        }.get(self.trend.state, "The changes follow no clear law; errors are the last changes.")

    def _required_text(self) -> str:
        """The level at which the law would reach the tolerance."""
        law = self.law
        if law is None or self.trend.rounded is not None:
            return "" if self.trend.rounded is not None else "Try more levels."
        if self.trend.spread > 1.5 * law.size:
            return "The limit itself is not known to this accuracy; try more levels, or a larger tolerance."
        x = law.reaches(self.tolerance * self.scale)
        needed = f"about {math.ceil(x)} elastic coordinates"
        if self.over in ("mesh", "segments"):
            needed = f"{math.ceil((math.log2(x) if self.over == 'mesh' else x) - 1e-9)} {VARIED[self.over].noun}s"
        return f"At this rate, {needed} would reach the tolerance."


def convergence(
    case: Case | str | Path,
    over: Over = "modes",
    levels: Sequence[int] | None = None,
    tolerance: float | None = None,
    progress: Progress | None = None,
) -> Convergence:
    """Convergence of the quantity of a case's [study] with the number of modes or with finer meshes.

    levels: numbers of modes, or of refinements; by default those of the case, or usual ones. tolerance: relative; by
    default that of the case (1e-3 if it has none). progress is called with the fraction of the work done.
    Raises ValueError (also CaseError) for a case that cannot be studied so, IntegrationError when the numerics fail.
    """
    study = plan_study(case if isinstance(case, Case) else read_case(case), over, levels)
    return assess_convergence(study, list(study.points(progress)), tolerance)


def assess_convergence(
    study: Study, points: Sequence[Point], tolerance: float | None = None, complete: bool = True
) -> Convergence:
    """Convergence from the points of a study: all of them, or those before an interruption (at least one value)."""
    assert study.case.study is not None
    valued = [point for point in points if not point.problem]
    if not valued:
        raise ValueError("there is no value yet to judge convergence by")
    tolerance = study.case.study.tolerance if tolerance is None else tolerance
    if not tolerance > 0:
        raise ValueError(f"tolerance is {tolerance}; it must be above 0")
    levels, counts = (np.array([getattr(point, key) for point in valued], np.int64) for key in ("level", "count"))
    values, noise = (np.array([getattr(point, key) for point in valued]) for key in ("value", "noise"))
    fit_trend = mesh_trend if study.over in ("mesh", "segments") else mode_trend
    trend = fit_trend(resolution(study.over, levels, counts), values, noise)
    exhaustive = (
        complete and valued[-1].level == study.level_set.exhaustive and trend.state in ("unsettled", "few", "one")
    )
    if trend.state == "unsettled" and not exhaustive:
        trend = within_tolerance(trend, values, tolerance)
    return Convergence(
        title=quantity_text(study.quantity),
        unit=valued[-1].unit,
        over=study.over,
        levels=levels,
        counts=counts,
        values=values,
        errors=np.maximum(np.abs(values - values[-1]), noise) if exhaustive else estimated_errors(trend, values, noise),
        trend=trend,
        tolerance=tolerance,
        case_level=study.level_set.case_level,
        simulated=study.quantity.channel is not None,
        left_out=tuple(f"{point.level}: {point.problem}" for point in points if point.problem),
        complete=complete,
        derivatives=np.array([point.derivatives for point in valued], np.int64),
        followers=np.array([point.followers for point in valued], np.int64),
        added=np.array([point.added for point in valued], np.int64),
        exhaustive=exhaustive,
    )


def within_tolerance(trend: Trend, values: Array, tolerance: float) -> Trend:
    """The trend of values (n,), in any unit, converged if their last change is below the relative tolerance.

    It is so whatever came before. An earlier change of almost zero, as of a mode that takes no part, can hide the
    decrease from a fitted law.
    """
    changes, scale = np.abs(np.diff(values)), float(np.abs(values).max()) or 1.0
    if changes.max() <= tolerance * scale:
        return Trend("constant", float(values[-1]), float(np.abs(values - values[-1]).max()), rounded=trend.rounded)
    if changes[-1] <= tolerance * scale:
        return Trend("settling", float(values[-1]), float(changes[-1]), rounded=trend.rounded)
    return trend


def estimated_errors(trend: Trend, values: Array, noise: Array) -> Array:
    """Estimated errors (n,), in the unit of the quantity: distance from the limit, but no less than the limit's
    uncertainty and than rounding."""
    off: Array = np.abs(values - trend.limit)
    if trend.state in ("one", "few"):
        off[-1] = np.nan  # the error of the last value is unknown
        return off
    floor = np.maximum(trend.spread, noise)
    return np.where(off > floor, off, floor)


def resolution(over: Over, levels: IntArray, counts: IntArray) -> Array:
    """Resolution (n,) [1]: elastic coordinates, segments, or cells along an edge of the case's own.

    The number of modes where more modes need fewer static shapes of joints, so that the number of coordinates may not
    grow.
    """
    if over == "segments" or (over == "modes" and np.any(np.diff(counts) <= 0)):
        return levels.astype(float)
    return np.exp2(levels.astype(float)) if over == "mesh" else counts.astype(float)
