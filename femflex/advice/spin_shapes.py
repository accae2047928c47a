"""Bodies of a case that are spun up so fast, by estimate, that static shapes of spin improve their modes.

A motion, a torque or thrusters may turn a body faster than it swings, or wrench it round: what pulls at every place by
its distance then bends it in shapes that few modes lack. A beam in two modes is 0.8 % off in the lag of Kane's
spin-up, in four 0.5 %; with the static shapes of spin 0.15 %, which is what condensed strain leaves.
"""

from __future__ import annotations

import numpy as np

from femflex.advice.advice import Advice
from femflex.advice.bodies import KnownBodies
from femflex.advice.limits import FEW, SPUN
from femflex.advice.motion_estimate import RigidEstimate, shape_periods
from femflex.dynamics import compile_system
from femflex.system import System

ROWS = 2000  # over the estimated time, between which the acceleration is taken


def spin_advice(system: System, rigid: RigidEstimate, known: KnownBodies) -> list[Advice]:
    """Bodies that leave it open and turn so fast, or are turned so suddenly, as they move on as rigid ones."""
    elastic = {name: max(found) for name, body in system.bodies.items() if (found := shape_periods(body))}
    if not elastic:
        return []
    seen = compile_system(rigid.system).observe(rigid.times, rigid.states)
    grid = np.linspace(rigid.times[0], rigid.times[-1], ROWS)
    out = []
    for name, period in elastic.items():
        first, rate = 2.0 * np.pi / period, np.asarray(seen[f"bodies/{name}/rate"])
        evenly = np.stack([np.interp(grid, rigid.times, along) for along in rate.T], axis=1)
        swept = np.linalg.norm(np.diff(evenly, axis=0), axis=1).max() * (ROWS - 1)
        duration, most = np.ptp(rigid.times), (SPUN * first) ** 2
        fastest = float((rate**2).sum(axis=1).max())
        few = known.open(name).few
        if few is None or few > FEW:
            continue
        if fastest > most or swept > most * duration > 0.0:
            ratio = float(np.sqrt(max(fastest, swept / duration if duration > 0.0 else 0.0)) / first)
            out.append(Advice(name, "spin", True, "its spin is fast relative to its first frequency", ratio, SPUN))
    return out
