"""Stability of a rigid craft at rest in a circular orbit (Hughes, Spacecraft attitude dynamics, sec. 9.2)."""

from __future__ import annotations

import numpy as np

from femflex.studies.stability.judgement import GYROSCOPIC, STATIC, UNSTABLE


def rigid_kind(k_roll: float, k_yaw: float) -> int:
    """The kind of stability of a rigid craft (see `femflex.studies.stability.judgement`)."""
    both = k_roll * k_yaw
    if not (k_roll > k_yaw and both > 0 and 1 + 3 * k_roll + both > 4 * np.sqrt(both)):
        return UNSTABLE
    return STATIC if k_yaw > 0 else GYROSCOPIC
