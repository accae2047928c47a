"""Convergence of a case's [study] quantity: values, errors, order, limit, and a verdict."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from femflex.arrays import Array, IntArray
from femflex.case import Case, read_case
from femflex.studies.decay import mode_trend
from femflex.studies.law import Law, Trend
from femflex.studies.richardson import mesh_trend
from femflex.studies.study import Over, Point, Progress, Study, described, planned
from femflex.studies.verdict import law_text, verdict


@dataclass(frozen=True, eq=False)
class Convergence:
    """What a convergence study found; the arrays run over its levels, coarse to fine.

    title, unit   the quantity in words and its unit
    over          "modes": levels are modes a body, counts elastic coordinates; "mesh": refinements and dofs;
                  "derivatives", "segments": derivative shapes or segments a body, and elastic coordinates
    levels, counts (n,)
    values  (n,)  the quantity
    changes (n,)  from the level before, nan first
    errors  (n,)  estimated, absolute; nan where none can be estimated
    trend         law by which the errors fall, limit and its uncertainty
    tolerance     largest error relative to `scale` that counts as converged
    own           level at which the case itself stands, None where its bodies differ
    simulated     the quantity is that of a run, not of a body
    left_out      levels too coarse for the case, each with the reason
    complete      False when the study was broken off
    derivatives   (n,) how many of the counted coordinates are derivative shapes
    whole         the last level is all there is: errors are distances from it where no law shows
    followers     (n,) how many derivative shapes follow the coordinates of condensed bodies
    added         (n,) how many of the counted coordinates are static shapes in addition to modes
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
    own: int | None
    simulated: bool
    left_out: tuple[str, ...] = ()
    complete: bool = True
    derivatives: IntArray = field(default_factory=lambda: np.zeros(0, np.int64))
    followers: IntArray = field(default_factory=lambda: np.zeros(0, np.int64))
    added: IntArray = field(default_factory=lambda: np.zeros(0, np.int64))
    whole: bool = False

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
        """What errors are relative to: size of the limit, or of the largest value when the limit is next to nothing."""
        largest = float(np.abs(self.values).max())
        limit = abs(self.trend.limit)
        return limit if limit > 1e-9 * largest else largest or 1.0

    @property
    def recommended(self) -> int | None:
        """The coarsest level from which on all errors above rounding are within the tolerance, or None."""
        within = self.errors[: self.n_resolved] <= self.tolerance * self.scale
        bad = np.flatnonzero(~within)
        first = int(bad[-1]) + 1 if bad.size else 0
        return int(self.levels[first]) if first < self.n_resolved else None

    @property
    def n_resolved(self) -> int:
        """Number of levels that tell something: those before rounding is met."""
        return len(self.levels) if self.trend.rounded is None else self.trend.rounded

    @property
    def x(self) -> Array:
        """Resolution (n,) [1]: elastic coordinates, segments, or cells along an edge of the case's own."""
        return resolution(self.over, self.levels, self.counts)

    @property
    def law(self) -> Law | None:
        """The law by which errors fall in `x`, None without one."""
        return self.trend.law

    @property
    def law_text(self) -> str:
        """The law in words."""
        return law_text(self)

    @property
    def verdict(self) -> str:
        """What this means, in sentences."""
        return verdict(self)

    def to_dict(self) -> dict[str, Any]:
        """Everything in plain numbers, lists and text."""
        law = self.trend.law
        names = ("levels", "counts", "derivatives", "followers", "added", "values", "changes", "errors")
        arrays = {key: getattr(self, key).tolist() for key in names}
        return {
            "quantity": self.title,
            "unit": self.unit,
            "over": self.over,
            **arrays,
            "state": self.trend.state,
            "order": self.order,
            "scatter": self.trend.scatter,
            "law": None if law is None else law.kind,
            "estimate": self.estimate,
            "uncertainty": self.trend.spread,
            "tolerance": self.tolerance,
            "recommended": self.recommended,
            "own": self.own,
            "left_out": list(self.left_out),
            "complete": self.complete,
            "verdict": self.verdict,
        }


def convergence(
    case: Case | str | Path,
    over: Over = "modes",
    levels: Sequence[int] | None = None,
    tolerance: float | None = None,
    progress: Progress | None = None,
) -> Convergence:
    """How the quantity of a case's [study] converges with the number of modes or with finer meshes.

    levels: numbers of modes, or of refinements; left out, those of the case or a usual ladder. tolerance is relative;
    left out, that of the case (1e-3 unless it says otherwise). progress is called with the part of the work done.
    Raises ValueError (also CaseError) for a case that cannot be studied so, IntegrationError when the numerics fail.
    """
    study = planned(case if isinstance(case, Case) else read_case(case), over, levels)
    return assessed(study, list(study.points(progress)), tolerance)


def assessed(
    study: Study, points: Sequence[Point], tolerance: float | None = None, complete: bool = True
) -> Convergence:
    """What the points of a study say, all of them or those there were when it was broken off (at least one value)."""
    assert study.case.study is not None
    kept = [point for point in points if not point.problem]
    if not kept:
        raise ValueError("there is no value yet to judge convergence by")
    tolerance = study.case.study.tolerance if tolerance is None else tolerance
    if not tolerance > 0:
        raise ValueError(f"tolerance is {tolerance}; it must be above 0")
    levels, counts = (np.array([getattr(point, key) for point in kept], np.int64) for key in ("level", "count"))
    values, noise = (np.array([getattr(point, key) for point in kept]) for key in ("value", "noise"))
    follow = mesh_trend if study.over in ("mesh", "segments") else mode_trend
    trend = follow(resolution(study.over, levels, counts), values, noise)
    whole = complete and kept[-1].level == study.ladder.whole and trend.state in ("unsettled", "few", "one")
    if trend.state == "unsettled" and not whole:
        trend = within_tolerance(trend, values, tolerance)
    return Convergence(
        title=described(study.quantity),
        unit=kept[-1].unit,
        over=study.over,
        levels=levels,
        counts=counts,
        values=values,
        errors=np.maximum(np.abs(values - values[-1]), noise) if whole else errors(trend, values, noise),
        trend=trend,
        tolerance=tolerance,
        own=study.ladder.own,
        simulated=study.quantity.channel is not None,
        left_out=tuple(f"{point.level}: {point.problem}" for point in points if point.problem),
        complete=complete,
        derivatives=np.array([point.derivatives for point in kept], np.int64),
        followers=np.array([point.followers for point in kept], np.int64),
        added=np.array([point.added for point in kept], np.int64),
        whole=whole,
    )


def within_tolerance(trend: Trend, values: Array, tolerance: float) -> Trend:
    """The trend of values (n,) whose last change is below the relative tolerance: converged, whatever came before.

    An earlier change that is next to nothing, as of a mode that takes no part, hides a fall from a law.
    """
    changes, scale = np.abs(np.diff(values)), float(np.abs(values).max()) or 1.0
    if changes.max() <= tolerance * scale:
        return Trend("constant", float(values[-1]), float(np.abs(values - values[-1]).max()), rounded=trend.rounded)
    if changes[-1] <= tolerance * scale:
        return Trend("settling", float(values[-1]), float(changes[-1]), rounded=trend.rounded)
    return trend


def errors(trend: Trend, values: Array, noise: Array) -> Array:
    """Estimated errors (n,), in the unit of the quantity: distance from the limit, but no less than the limit's
    uncertainty and than rounding."""
    off: Array = np.abs(values - trend.limit)
    if trend.state in ("one", "few"):
        off[-1] = np.nan  # nothing is known of the last value
        return off
    floor = np.maximum(trend.spread, noise)
    return np.where(off > floor, off, floor)


def resolution(over: Over, levels: IntArray, counts: IntArray) -> Array:
    """Resolution (n,) [1]: elastic coordinates, segments, or cells along an edge of the case's own.

    Modes where static shapes of joints, of which more modes need fewer, keep the coordinates from growing.
    """
    if over == "segments" or (over == "modes" and np.any(np.diff(counts) <= 0)):
        return levels.astype(float)
    return np.exp2(levels.astype(float)) if over == "mesh" else counts.astype(float)
