"""How near all that its bodies bear is to what buckles them, and what their strain does not know of that."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from femflex.advice.advice import Advice, doubt
from femflex.advice.bodies import KnownBodies, KnownBody
from femflex.advice.buckling.burden import Buckling, Burden
from femflex.advice.buckling.burdens import burdens
from femflex.advice.limits import ALONE, BOWED, LATE, NAMED, NEAR, SWUNG
from femflex.advice.motion_estimate import Carried
from femflex.system import System


@dataclass(frozen=True)
class Nearness:
    """What a body bears at the worst instant, and the part that it is of what buckles the body.

    sways: it is no more steady under forces that follow it; apart: the parts of what it bears together;
    under, row: all that it bears, and the instant.
    """

    borne: str
    part: float
    sways: bool = False
    apart: str = ""
    under: tuple[Burden, ...] = ()
    row: int = 0

    def __str__(self) -> str:
        what = "what sets the body swaying (flutter)" if self.sways else "what buckles the body"
        return f"{self.borne} is {self.part:.3g} of {what}" + (f" ({self.apart})" if self.apart else "")


def judged_bodies(system: System, known: KnownBodies) -> list[str]:
    """Names of the bodies of which it is known what buckles them."""
    return [name for name in system.bodies if name in known and known[name].bearing is not None]


def nearest(rigid: Carried | None, system: System, known: KnownBodies) -> dict[str, Nearness]:
    """Of those bodies that come as near to buckling as a NEAR-th, how near; as they move on as rigid ones.

    None where nothing is foreseen of them; see `unjudged`.
    """
    judged = judged_bodies(system, known)
    if not judged or rigid is None:
        return {}
    borne = burdens(replace(rigid.system, reactions=True), judged, rigid.times, rigid.states)
    found = {}
    for name in judged:
        bearing = known[name].bearing
        assert bearing is not None
        near = bearing.nearest(borne[name], 1.0 / NEAR)
        if near.part >= 1.0 / NEAR:
            blamed, apart = _blamed(borne[name], near, float(rigid.times[near.row]))
            found[name] = Nearness(blamed, near.part, near.sways, apart, tuple(borne[name]), near.row)
    return found


def unjudged(system: System, known: KnownBodies, rigid: Carried | None, why: str) -> list[Advice]:
    """A word, on each body that would be judged, of what of its motion is not; nothing where all is."""
    text = f"whether anything buckles it is not judged, for its motion is foreseen {why}"
    if rigid is not None:
        why, text = rigid.short, f"whether anything buckles it is judged {rigid.short}"
    return [Advice(name, "buckling", None, text) for name in judged_bodies(system, known)] if why else []


def beyond(near: Nearness, form: str) -> str:
    """What strain of that form lacks so near to buckling, or past it; nothing where it is far enough."""
    if near.sways:
        return "; past flutter its swings grow until something else stops them" if near.part >= 1.0 else ""
    if form == "condensed" and near.part >= BOWED:
        return (
            f": above {BOWED:g} of it condensed strain bends too little, for it shortens by no more than the second "
            "order; nonlinear strain is right up to it, and segments beyond"
        )
    if form == "nonlinear" and near.part >= 1.0:
        return (
            f"; past buckling a column bends by {SWUNG:.0%} of its length at 1.013 times an end load, which is "
            "the most that nonlinear strain in one piece represents: cut the member into segments"
        )
    return ""


def buckling_doubts(system: System, known: KnownBodies, near: Mapping[str, Nearness]) -> list[Advice]:
    """Of bodies whose strain does not know what all that they bear does to them."""
    out = []
    for name, found in near.items():
        form = system.bodies[name].strain_form
        if form == "nonlinear" and "response" in system.bodies[name].kinds:
            continue  # made of what it does past buckling
        text = "; linear strain does not know" if form == "linear" else beyond(found, form)
        for one in filter(None, (text, "" if form == "linear" else late(known[name], found))):
            out.append(doubt(name, "buckling", f"bodies.{name}: {found}{one}", found.part, 1.0 / NEAR))
    return out


def late(body: KnownBody, near: Nearness) -> str:
    """That the shapes kept buckle later than the body does; nothing where they do not, or where it flutters instead."""
    if body.bearing is None or near.sways:
        return ""
    kept = body.bearing.kept(near.under, near.row)
    if near.part <= (1.0 + LATE) * kept:
        return ""
    return (
        f", and {kept:.3g} of what buckles the shapes kept: they hold its stress, or the twist that goes with it, too "
        "badly. Add the load's own static shape to the reduction (`loads`), or more shapes, torsion among them"
    )


def _blamed(borne: list[Burden], near: Buckling, t: float) -> tuple[str, str]:
    """What is to blame, in words: the burden that is nearly all of it; or what it bears together, and the parts."""
    order = np.argsort(near.shares)[::-1]
    when = f" at t = {t:.4g} s" if near.row else ""
    first = borne[order[0]]
    if near.shares[order[0]] >= ALONE * near.part:
        return f"{first.name} ({first.size(near.row)}{when})", ""
    named = [k for k in order if abs(near.shares[k]) >= NAMED * near.part]
    parts = [f"{borne[k].name} ({borne[k].size(near.row)}) {near.shares[k]:.3g}" for k in named]
    return f"what it bears together{when}", ", ".join(parts)
