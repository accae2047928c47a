"""Bodies of a case that are foreseen to be spun up so far that static shapes of spin pay beside their modes.

A motion, a torque or thrusters may turn a body faster than it swings, or wrench it round: what pulls at every place by
its distance then bends it in shapes that few modes lack. A beam in two modes is 0.8 % off in the lag of Kane's
spin-up, in four 0.5 %; with the static shapes of spin 0.15 %, which is what condensed strain leaves.
"""

from __future__ import annotations

from collections.abc import Collection

import numpy as np

from femflex.advice.motion_estimate import Carried, periods
from femflex.case.body import AnalyticTable, BodyTable, FlexibleTable
from femflex.case.case import Case
from femflex.case.reduction import CantileverTable
from femflex.dynamics import compile_system
from femflex.system import System

SPUN = 0.5  # rate, or root of the angular acceleration, over the body's first frequency: from there on they pay
FEW = 5  # modes, or functions along one direction, up to which they pay: six are as near to Kane's lag without them
ROWS = 2000  # over the time foreseen, between which the acceleration is taken


def spun_up(system: System, rigid: Carried) -> list[str]:
    """Names of the elastic bodies that turn so fast, or are turned so suddenly, as they move on as rigid ones."""
    elastic = {name: max(found) for name, body in system.bodies.items() if (found := periods(body))}
    if not elastic:
        return []
    seen = compile_system(rigid.system).observe(rigid.times, rigid.states)
    grid = np.linspace(rigid.times[0], rigid.times[-1], ROWS)
    names = []
    for name, period in elastic.items():
        first, rate = 2.0 * np.pi / period, np.asarray(seen[f"bodies/{name}/rate"])
        evenly = np.stack([np.interp(grid, rigid.times, along) for along in rate.T], axis=1)
        swept = np.linalg.norm(np.diff(evenly, axis=0), axis=1).max() * (ROWS - 1)
        duration, most = np.ptp(rigid.times), (SPUN * first) ** 2
        if (rate**2).sum(axis=1).max() > most or swept > most * duration > 0.0:
            names.append(name)
    return names


def with_spin_shapes(case: Case, names: Collection[str]) -> Case:
    """The case with the static shapes of spin asked for in the tables of these bodies, where they leave that open."""
    said = {name: table for name in names if (table := _asking(case.bodies.get(name))) is not None}
    return case.model_copy(update={"bodies": {**case.bodies, **said}}) if said else case


def _asking(table: BodyTable | None) -> BodyTable | None:
    """The table with the shapes of spin; None where it says its shapes itself, or has many."""
    if isinstance(table, FlexibleTable) and table.cut is None and isinstance(r := table.reduction, CantileverTable):
        slender = all(member.family == "beam" for member in table.members)  # sheets slew no better with them
        if slender and r.modes <= FEW and not r.model_fields_set & {"attachment", "spin"}:
            return table.model_copy(update={"reduction": r.model_copy(update={"spin": True})})
    if isinstance(table, AnalyticTable):
        f = table.functions
        if max(f.y, f.z) <= FEW and not f.model_fields_set & {"static", "spin"}:
            return table.model_copy(update={"functions": f.model_copy(update={"spin": True})})
    return None
