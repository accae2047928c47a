"""Buckling margins of the bodies of a system under all their loads, and warnings where their strain omits it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from femflex.advice.advice import Advice, doubt
from femflex.advice.bodies import BodyOrigin, BodyOrigins
from femflex.advice.buckling.applied_loads import applied_loads
from femflex.advice.limits import (
    BASIS_OVERESTIMATE,
    BUCKLING_FACTOR,
    CONDENSED_INVALID_ABOVE,
    LISTED_SHARE,
    SINGLE_LOAD_SHARE,
)
from femflex.advice.motion_estimate import RigidEstimate
from femflex.reduction.static_buckling.buckling_analysis import AppliedLoad, BucklingResult
from femflex.system import System

CONDENSED_NOTE = (
    f"; above {CONDENSED_INVALID_ABOVE:g} of it, condensed strain gives too small a deflection, because its "
    "foreshortening is of second order. Use strain = 'nonlinear' up to the buckling load, and segments beyond it"
)


@dataclass(frozen=True)
class BucklingMargin:
    """Load on a body at the worst instant, over its buckling load.

    load_text: the load, in words; contributions: of each load, in words; loads: all loads; row: number of the
    instant.
    """

    load_text: str
    ratio: float
    contributions: str = ""
    loads: tuple[AppliedLoad, ...] = ()
    row: int = 0

    def __str__(self) -> str:
        return f"{self.load_text} is {self.ratio:.3g} of the linear buckling load" + (
            f" ({self.contributions})" if self.contributions else ""
        )


def assessed_bodies(system: System, origins: BodyOrigins) -> list[str]:
    """Names of the bodies with a buckling analysis."""
    return [name for name in system.bodies if name in origins and origins[name].buckling_model is not None]


def buckling_margins(rigid: RigidEstimate | None, system: System, origins: BodyOrigins) -> dict[str, BucklingMargin]:
    """Margins of the bodies whose load reaches 1 / BUCKLING_FACTOR of the buckling load in the rigid-body simulation.

    Empty where there is no simulation; see `unassessed_bodies`.
    """
    names = assessed_bodies(system, origins)
    if not names or rigid is None:
        return {}
    loads = applied_loads(replace(rigid.system, reactions=True), names, rigid.times, rigid.states)
    margins = {}
    for name in names:
        model = origins[name].buckling_model
        assert model is not None
        worst = model.worst_instant(loads[name], 1.0 / BUCKLING_FACTOR)
        if worst.ratio >= 1.0 / BUCKLING_FACTOR:
            cause, contributions = _dominant_load(loads[name], worst, float(rigid.times[worst.row]))
            margins[name] = BucklingMargin(cause, worst.ratio, contributions, tuple(loads[name]), worst.row)
    return margins


def unassessed_bodies(
    system: System, origins: BodyOrigins, rigid: RigidEstimate | None, shortfall: str
) -> list[Advice]:
    """Notes on the bodies whose buckling is assessed for a part of the run only; none where it is for the whole run."""
    text = f"buckling is not assessed: its motion is estimated {shortfall}"
    if rigid is not None:
        shortfall, text = rigid.shortfall, f"buckling is assessed {rigid.shortfall}"
    return [Advice(name, "buckling", None, text) for name in assessed_bodies(system, origins)] if shortfall else []


def buckling_warnings(system: System, origins: BodyOrigins, margins: Mapping[str, BucklingMargin]) -> list[Advice]:
    """Warnings of bodies whose strain does not represent the effect of their loads near buckling."""
    out = []
    for name, margin in margins.items():
        form = system.bodies[name].strain_form
        if form == "nonlinear" and "response" in system.bodies[name].kinds:
            continue  # its shapes are static responses past buckling
        text = {
            "linear": "; linear strain leaves this out",
            "condensed": CONDENSED_NOTE * (margin.ratio >= CONDENSED_INVALID_ABOVE),
        }.get(form, "")
        for note in filter(None, (text, "" if form == "linear" else late_buckling_note(origins[name], margin))):
            out.append(doubt(name, "buckling", f"bodies.{name}: {margin}{note}", margin.ratio, 1.0 / BUCKLING_FACTOR))
    return out


def late_buckling_note(origin: BodyOrigin, margin: BucklingMargin) -> str:
    """Note that the reduced basis buckles at a higher load than the body; empty where it does not."""
    if origin.buckling_model is None:
        return ""
    reduced = origin.buckling_model.reduced_ratio(margin.loads, margin.row)
    if margin.ratio <= (1.0 + BASIS_OVERESTIMATE) * reduced:
        return ""
    return (
        f", but {reduced:.3g} of the buckling load of the reduced basis, which represents the prestress, or the "
        "coupled "
        "torsion, inaccurately. Add the static shape of the load to the reduction (`loads`), or more modes, "
        "torsion included"
    )


def _dominant_load(loads: list[AppliedLoad], result: BucklingResult, t: float) -> tuple[str, str]:
    """Text on the single load that causes the ratio, or on the total load, and on the contribution of each load."""
    order = np.argsort(result.shares)[::-1]
    time_text = f" at t = {t:.4g} s" if result.row else ""
    first = loads[order[0]]
    if result.shares[order[0]] >= SINGLE_LOAD_SHARE * result.ratio:
        return f"{first.name} ({first.size(result.row)}{time_text})", ""
    listed = [k for k in order if abs(result.shares[k]) >= LISTED_SHARE * result.ratio]
    parts = [f"{loads[k].name} ({loads[k].size(result.row)}) {result.shares[k]:.3g}" for k in listed]
    return f"its total load{time_text}", ", ".join(parts)
