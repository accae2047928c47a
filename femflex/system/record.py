"""Motions of supports from records of their acceleration, such as of earthquakes, roads and shakers.

Between its samples the acceleration is straight, so that rate and position follow exactly, as pieces of third order.
Errors of a record grow in them with the time and its square. They are removed with a polynomial that is taken from the
acceleration (N. M. Newmark's parabolic baseline is that of `least`; see G. V. Berg and G. W. Housner, Bulletin of the
Seismological Society of America 51, 1961).
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from femflex.arrays import Array
from femflex.noun.units import to_si
from femflex.noun.values import counted_noun
from femflex.system.columns import column_of, finite
from femflex.system.profile import Profile

BASELINES = ("rest", "least", "none")
PEER = ".at2"  # suffix of records of the Pacific Earthquake Engineering Research Center, in g
HEADER = re.compile(r"NPTS\s*=\s*(\d+)\s*,?\s*DT\s*=\s*([-+.\deE]+)", re.IGNORECASE)


def record(times: Array, acceleration: Array, baseline: str = "rest", factor: float = 1.0) -> Profile:
    """The motion from rest at zero with a record (n,) of its acceleration [m/s^2 or rad/s^2] at times (n,) [s].

    baseline  "rest": a constant and a slope are taken from the acceleration so that the motion ends at rest where it
              began, and stays there; "least": a parabola, with which the mean square of the rate is least; "none"
    factor    by which the acceleration is multiplied

    The motion is known from the first time on, without "rest" up to the last. Raises ValueError for times that do not
    ascend, and for fewer than three of them.
    """
    times, a = np.asarray(times, float), factor * np.asarray(acceleration, float)
    if baseline not in BASELINES:
        raise ValueError(f"found baseline {baseline!r}; known are {', '.join(BASELINES)}")
    if times.ndim != 1 or times.shape != a.shape or len(times) < 3:
        raise ValueError(
            f"a record has {times.size} times and {a.size} accelerations; give at least 3, as many of both"
        )
    falls = np.flatnonzero(np.diff(times) <= 0)
    if len(falls):
        k = int(falls[0])
        raise ValueError(f"time {times[k + 1]:g} s of a record follows {times[k]:g} s; times must ascend")
    t, h = times - times[0], np.diff(times)
    straight = np.zeros((len(h), 6))  # powers of the time since the sample, of the position
    straight[:, 2], straight[:, 3] = a[:-1] / 2.0, np.diff(a) / h / 6.0
    powers = {"rest": 2, "least": 3, "none": 0}[baseline]
    unit = [_polynomial_pieces(t, h, k) for k in range(powers)]
    position, rate = _ends(straight, h)
    if powers:
        T = t[-1]
        ends = [_ends(pieces, h) for pieces in unit]
        if baseline == "rest":
            matrix = np.array([[v[-1] for _, v in ends], [x[-1] / T for x, _ in ends]])
            share = np.linalg.solve(matrix, [rate[-1], position[-1] / T])
        else:
            columns = np.column_stack([v for _, v in ends])
            share = np.linalg.lstsq(columns, rate, rcond=None)[0]
        straight = straight - sum(c * pieces for c, pieces in zip(share, unit, strict=True))
        position, rate = _ends(straight, h)
    straight[:, 0], straight[:, 1] = position[:-1], rate[:-1]
    order = 4 + (2 if baseline == "least" else 0)
    if baseline != "rest":
        return Profile(times[:-1], straight[:, :order], first=times[0], last=times[-1])
    before, after = np.zeros((1, order)), np.zeros((1, order))
    after[0, 0] = position[-1]
    knots = np.concatenate([[times[0] - h[0]], times])
    return Profile(knots, np.concatenate([before, straight[:, :order], after]))


def _polynomial_pieces(t: Array, h: Array, power: int) -> Array:
    """Pieces (n - 1, 6) of the position, without start, whose acceleration is (t / T)^power."""
    out, T, start = np.zeros((len(h), 6)), t[-1], t[:-1]
    for k in range(power + 1):
        binomial = {0: 1, 1: power, 2: 1}[k]
        out[:, 2 + k] = binomial * start ** (power - k) / T**power / ((k + 1) * (k + 2))
    return out


def _ends(pieces: Array, h: Array) -> tuple[Array, Array]:
    """Position and rate (n,) at the samples of pieces (n - 1, 6) that start at rest at zero."""
    powers = h[:, None] ** np.arange(6)
    rate, position = np.zeros(len(h) + 1), np.zeros(len(h) + 1)
    rate[1:] = np.cumsum((pieces[:, 2:] * np.arange(2, 6) * powers[:, 1:5]).sum(axis=1))
    position[1:] = np.cumsum((pieces[:, 2:] * powers[:, 2:]).sum(axis=1) + rate[:-1] * h)
    return position, rate


def read_record(path: Path, column: str | None, unit: str) -> tuple[Array, Array]:
    """Times (n,) [s] and accelerations (n,), in `unit`, of a column of a CSV file, or of a record of PEER (.AT2).

    Raises ValueError with the line of an entry that cannot be read.
    """
    if path.suffix.lower() != PEER:
        if column is None:
            raise ValueError(f"{path.name} needs the name of its column of accelerations; give column")
        times, accelerations = column_of(path, column, unit)
        return np.array(times), np.array(accelerations)
    if not path.is_file():
        raise ValueError(f"found file {path.name!r}, which does not exist; names are relative to the case file")
    try:
        lines = path.read_text(encoding="utf-8", errors="strict").splitlines()
    except UnicodeDecodeError:
        raise ValueError(f"{path.name} is no text; a record of PEER has a line NPTS= n, DT= s SEC") from None
    heads = [(k, match) for k, line in enumerate(lines[:20]) if (match := HEADER.search(line))]
    if not heads:
        raise ValueError(f"{path.name} has no line NPTS= n, DT= s SEC in its head; write it as CSV with times instead")
    line, match = heads[0]
    count, step = int(match[1]), float(match[2])
    cells = [(k, cell) for k, row in enumerate(lines[line + 1 :], line + 2) for cell in row.split()]
    values = np.array([finite(cell, "acceleration", k, path.name) for k, cell in cells])
    if len(values) != count:
        found = counted_noun(len(values), "value", "values")
        raise ValueError(f"{path.name} has {found}; its head says NPTS = {count}")
    return np.linspace(0.0, step * (count - 1), count), values * to_si("1 g0", "m/s^2")
