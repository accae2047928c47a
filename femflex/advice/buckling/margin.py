"""Margins to buckling of the bodies of a system under all their loads, and warnings where their strain misses it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from femflex.advice.advice import Advice, doubt
from femflex.advice.bodies import KnownBodies, KnownBody
from femflex.advice.buckling.applied_load import AppliedLoad, BucklingResult
from femflex.advice.buckling.applied_loads import applied_loads
from femflex.advice.limits import ALONE, BOWED, LATE, NAMED, NEAR
from femflex.advice.motion_estimate import RigidEstimate
from femflex.system import System

PAST = (
    f"; above {BOWED:g} of it, condensed strain gives too small a deflection, because its foreshortening is of second "
    "order. Use strain = 'nonlinear' up to the buckling load, and segments beyond it"
)


@dataclass(frozen=True)
class BucklingMargin:
    """Load on a body at the worst instant, over its buckling load.

    apart: contribution of each load; under, row: all loads, the instant.
    """

    total: str
    part: float
    apart: str = ""
    under: tuple[AppliedLoad, ...] = ()
    row: int = 0

    def __str__(self) -> str:
        return f"{self.total} is {self.part:.3g} of the linear buckling load" + (
            f" ({self.apart})" if self.apart else ""
        )


def assessed_bodies(system: System, known: KnownBodies) -> list[str]:
    """Names of the bodies with a buckling analysis."""
    return [name for name in system.bodies if name in known and known[name].buckling_model is not None]


def buckling_margins(rigid: RigidEstimate | None, system: System, known: KnownBodies) -> dict[str, BucklingMargin]:
    """Margins of the bodies whose load reaches 1 / NEAR of the buckling load in the rigid-body simulation.

    Empty where there is no simulation; see `unassessed_bodies`.
    """
    judged = assessed_bodies(system, known)
    if not judged or rigid is None:
        return {}
    total = applied_loads(replace(rigid.system, reactions=True), judged, rigid.times, rigid.states)
    found = {}
    for name in judged:
        model = known[name].buckling_model
        assert model is not None
        near = model.nearest(total[name], 1.0 / NEAR)
        if near.part >= 1.0 / NEAR:
            blamed, apart = _blamed(total[name], near, float(rigid.times[near.row]))
            found[name] = BucklingMargin(blamed, near.part, apart, tuple(total[name]), near.row)
    return found


def unassessed_bodies(system: System, known: KnownBodies, rigid: RigidEstimate | None, why: str) -> list[Advice]:
    """Notes on the bodies whose buckling is assessed for a part of the run only; none where it is for the whole run."""
    text = f"buckling is not assessed: its motion is estimated {why}"
    if rigid is not None:
        why, text = rigid.short, f"buckling is assessed {rigid.short}"
    return [Advice(name, "buckling", None, text) for name in assessed_bodies(system, known)] if why else []


def buckling_warnings(system: System, known: KnownBodies, near: Mapping[str, BucklingMargin]) -> list[Advice]:
    """Warnings of bodies whose strain does not represent the effect of their loads near buckling."""
    out = []
    for name, found in near.items():
        form = system.bodies[name].strain_form
        if form == "nonlinear" and "response" in system.bodies[name].kinds:
            continue  # made of what it does past buckling
        text = {"linear": "; linear strain leaves this out", "condensed": PAST * (found.part >= BOWED)}.get(form, "")
        for one in filter(None, (text, "" if form == "linear" else late_buckling_note(known[name], found))):
            out.append(doubt(name, "buckling", f"bodies.{name}: {found}{one}", found.part, 1.0 / NEAR))
    return out


def late_buckling_note(body: KnownBody, near: BucklingMargin) -> str:
    """Note that the reduced basis buckles at a higher load than the body; empty where it does not."""
    if body.buckling_model is None:
        return ""
    kept = body.buckling_model.kept(near.under, near.row)
    if near.part <= (1.0 + LATE) * kept:
        return ""
    return (
        f", but {kept:.3g} of the buckling load of the reduced basis, which represents the prestress, or the coupled "
        "torsion, inaccurately. Add the static shape of the load to the reduction (`loads`), or more modes, "
        "torsion included"
    )


def _blamed(total: list[AppliedLoad], near: BucklingResult, t: float) -> tuple[str, str]:
    """The load that causes it, or all loads together and the contribution of each."""
    order = np.argsort(near.shares)[::-1]
    when = f" at t = {t:.4g} s" if near.row else ""
    first = total[order[0]]
    if near.shares[order[0]] >= ALONE * near.part:
        return f"{first.name} ({first.size(near.row)}{when})", ""
    named = [k for k in order if abs(near.shares[k]) >= NAMED * near.part]
    parts = [f"{total[k].name} ({total[k].size(near.row)}) {near.shares[k]:.3g}" for k in named]
    return f"its total load{when}", ", ".join(parts)
