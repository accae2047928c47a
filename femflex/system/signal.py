"""Signals: numbers over time that effectors and controllers take as inputs."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal, get_args

import numpy as np

from femflex.system.effector import Effector

Kind = Literal["steps", "linear", "smooth"]


def signal(
    name: str, times: Sequence[float], values: Sequence[float], kind: Kind = "linear", unit: str = "1"
) -> Effector:
    """A number over time: channels "value" and "rate".

    Between two times it stays (steps), is linear, or goes from rest to rest as s^3 (10 - 15 s + 6 s^2) (smooth). Before
    the first time and after the last it stays. Raises ValueError for times that do not rise.
    """
    t, v = np.atleast_1d(np.asarray(times, float)), np.atleast_1d(np.asarray(values, float))
    if kind not in get_args(Kind):
        raise ValueError(f"signal {name!r} has the kind {kind!r}; known are {', '.join(get_args(Kind))}")
    if t.shape != v.shape or not t.size:
        raise ValueError(f"signal {name!r} has {t.size} times and {v.size} values; give as many of both")
    if not (np.all(np.isfinite(t)) and np.all(np.isfinite(v)) and np.all(np.diff(t) > 0.0)):
        raise ValueError(f"times of signal {name!r} must rise, and all numbers be finite: {t.tolist()}")
    return Effector(
        name,
        "signal",
        channels={"value": unit, "rate": f"{unit}/s" if unit != "1" else "1/s"},
        parameters=np.concatenate([[float(get_args(Kind).index(kind)), float(t.size)], t, v]),
        breaks=t,
    )
