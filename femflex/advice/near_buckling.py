"""How near all that its bodies bear is to what buckles them, and what their strain does not know of that."""

from __future__ import annotations

import warnings
from dataclasses import dataclass, replace

import numpy as np

from femflex.advice.bends import SWUNG
from femflex.advice.burden import Buckling, Burden
from femflex.advice.burdens import burdens
from femflex.advice.motion_estimate import Carried
from femflex.body import FlexibleBody
from femflex.system import System
from femflex.warning import PhysicsWarning

NEAR = 4.0  # times what it bears: a body that buckles beyond it has lost at most a sixteenth of its stiffness to bends
LATE = 0.03  # of what buckles a body: a set that buckles later by more is told of
BOWING = 0.8  # of what buckles a body, foreseen: from there on strain that is left to choice is nonlinear
BOWED = (
    0.9  # of it: condensed strain, which shortens to second order, bends 1.5 % too little at 0.95, and none beyond 1
)
ALONE = 0.95  # of it, from which on a single load is to blame
NAMED = 0.05  # of it, from which on a load is named


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


def is_judged(system: System) -> bool:
    """Whether there are bodies of which it is known what buckles them."""
    return any(body.buckling is not None for body in system.bodies.values())


def nearest(rigid: Carried | None, system: System) -> dict[str, Nearness]:
    """Of those bodies that come as near to buckling as a NEAR-th, how near; as they move on as rigid ones.

    None where nothing is foreseen of them; see `with_doubts`.
    """
    judged = [name for name, body in system.bodies.items() if body.buckling is not None]
    if not judged or rigid is None:
        return {}
    borne = burdens(replace(rigid.system, reactions=True), judged, rigid.times, rigid.states)
    found = {}
    for name in judged:
        bearing = system.bodies[name].buckling
        assert bearing is not None
        near = bearing.nearest(borne[name], 1.0 / NEAR)
        if near.part >= 1.0 / NEAR:
            blamed, apart = _blamed(borne[name], near, float(rigid.times[near.row]))
            found[name] = Nearness(blamed, near.part, near.sways, apart, tuple(borne[name]), near.row)
    return found


def with_doubts(system: System, rigid: Carried | None, why: str) -> System:
    """The system with a word, on each body that would be judged, of what of its motion is not; nothing where all is."""
    if rigid is None:
        text = f"whether anything buckles it is not judged, for its motion is foreseen {why}"
    else:
        text = f"whether anything buckles it is judged {rigid.short}"
    if not (why if rigid is None else rigid.short):
        return system
    told = {
        id(body): replace(body, note="; ".join(filter(None, (body.note, text))))
        for body in system.bodies.values()
        if body.buckling is not None
    }
    return replace(system, bodies={name: told.get(id(body), body) for name, body in system.bodies.items()})


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


def warn_of_buckling(system: System, near: dict[str, Nearness]) -> None:
    """Warn of bodies whose strain does not know what all that they bear does to them."""
    for name, found in near.items():
        form = system.bodies[name].strain_form
        if form == "nonlinear" and "response" in system.bodies[name].kinds:
            continue  # made of what it does past buckling
        text = "; linear strain does not know" if form == "linear" else beyond(found, form)
        for one in filter(None, (text, "" if form == "linear" else late(system.bodies[name], found))):
            warnings.warn(f"bodies.{name}: {found}{one}", PhysicsWarning, stacklevel=3)


def late(body: FlexibleBody, near: Nearness) -> str:
    """That the shapes kept buckle later than the body does; nothing where they do not, or where it sways instead."""
    if body.buckling is None or near.sways:
        return ""
    kept = body.buckling.kept(near.under, near.row)
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
