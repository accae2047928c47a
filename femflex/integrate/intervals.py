"""Smooth intervals of a run: between the breaks of its model, and up to the next instant at which a clock is due."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from femflex.arrays import Array
from femflex.integrate import resume as head

if TYPE_CHECKING:
    from femflex.integrate.protocol import Clock

Span = tuple[float, float, float]  # end of the interval, and the limits of the times at which the model may be called


def interval(t: float, end: float, breaks: Array) -> Span:
    """The smooth interval that begins at or holds t: its end, and the open limits set by the breaks around it."""
    after = int(np.searchsorted(breaks, t, side="right"))
    lo = np.nextafter(breaks[after - 1], math.inf) if after > 0 else -math.inf
    if after == breaks.size:
        return float(end), float(lo), math.inf
    return float(min(end, breaks[after])), float(lo), float(np.nextafter(breaks[after], -math.inf))


def interval_until_sample(clock: Clock | None, x: Array, t: float, end: float, breaks: Array) -> Span:
    """The smooth interval that contains t, up to the next instant at which a clock changes the state x (n_x,).

    It ends at t if that instant has come.
    """
    stop, lo, hi = interval(t, end, breaks)
    return stop if clock is None else max(t, min(stop, clock.next_instant(x))), lo, hi


def sample_due(clock: Clock | None, x: Array, resume: Array) -> bool:
    """Whether a clock changes the state x (n_x,) at the time reached; the method then restarts anyway."""
    return clock is not None and clock.next_instant(x) <= float(resume[head.T])
