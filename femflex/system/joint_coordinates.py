"""Single freedoms of a joint, checked: prescribed motions, laws, latches."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from femflex.arrays import Array

if TYPE_CHECKING:
    from femflex.system.joint import Joint


OPEN = (-1.0, 0.0)  # states of a latch: the time at which it locked (-1: it has not), and the energy that was lost
SHUT = (0.0, 0.0)  # of one that is locked from the start
RELEASED = -2.0  # minus the time at which it opened, in place of the time, of one that has opened


def started_motion(joint: Joint) -> tuple[Array, Array]:
    """Return q0 and u0 of the joint with prescribed freedoms at the start of their motion; ValueError for conflicts."""
    if joint.motion and len(joint.motion) != joint.n_u:
        raise ValueError(
            f"motion of joint {joint.label!r} has {len(joint.motion)} entries; the joint needs {joint.n_u}"
        )
    q0, u0 = joint.q0.copy(), joint.u0.copy()
    for k, profile in joint.prescribed.items():
        name = joint.freedom_names()[k]
        _refuse_ball(joint, k, "be prescribed by itself")
        for key in ("stiffness", "damping"):
            if getattr(joint, key)[k]:
                raise ValueError(
                    f"{name!r} has a {key} of {getattr(joint, key)[k]:g} and a prescribed motion; a spring or damper "
                    "has no effect on a prescribed motion. Remove one of them"
                )
        s, rate, _ = (float(value) for value in profile(0.0))
        if not np.isfinite(s):
            raise ValueError(
                f"the motion of {name!r} is known from {profile.first:g} s to {profile.last:g} s; it must begin at or "
                "before 0 s"
            )
        for key, values, begins in (("q0", q0, s), ("u0", u0, rate)):
            if values[k] and not np.isclose(values[k], begins, rtol=1e-9, atol=1e-12):
                raise ValueError(
                    f"{key} of {name!r} is {values[k]:g}, but its motion is prescribed and begins with {begins:g}; "
                    "leave the initial value out"
                )
        q0[k], u0[k] = s, rate
    return q0, u0


def check_laws(joint: Joint) -> None:
    """Raise ValueError for a law or a latch on no freedom of the joint, on a ball or on a prescribed freedom."""
    latched = [latch.freedom for latch in joint.latches]
    for what, k in ((f"a {law.kind}", law.freedom) for law in (*joint.laws, *joint.latches)):
        if not 0 <= k < joint.n_u:
            raise ValueError(
                f"{what} of joint {joint.label!r} acts on degree of freedom {k}; the joint has {joint.n_u}, from 0"
            )
        _refuse_ball(joint, k, f"have {what}")
        if k in joint.prescribed:
            name = joint.freedom_names()[k]
            raise ValueError(
                f"{name!r} has {what} and a prescribed motion, on which it has no effect. Remove one of them"
            )
    for latch in joint.latches:
        name = joint.freedom_names()[latch.freedom]
        if latched.count(latch.freedom) > 1:
            raise ValueError(f"{name!r} has {latched.count(latch.freedom)} latches; give it one")


def latch_start_problems(joint: Joint, z0: Mapping[str, float] | None = None) -> list[str]:
    """Sentences on latches that do not fit the joint's initial coordinates, with states that z0 gives by name.

    A latch that has locked already is where it locks, and one that has opened may be anywhere.
    """
    out = []
    names, starts = joint.state_names()[:: len(OPEN)], joint.initial_states()[:: len(OPEN)]
    for latch, (state, _), start in zip(joint.latches, names, starts, strict=True):
        k, since = latch.freedom, (z0 or {}).get(state, float(start))
        name, moves = joint.freedom_names()[k], bool(joint.u0[k])
        if latch.opens is not None and since >= 0.0 and (joint.q0[k] != latch.at or moves):
            out.append(
                f"{name!r} starts at {joint.q0[k]:g} at a rate of {joint.u0[k]:g}, and is locked at {latch.at:g} until "
                f"it opens ({latch.opens}); let it start there, at rest"
            )
        if latch.opens is None and since < 0.0 and joint.q0[k] == latch.at:
            out.append(f"{name!r} starts at {latch.at:g}, where it latches; lock it, or start elsewhere")
    return out


def _refuse_ball(joint: Joint, k: int, what: str) -> None:
    if joint.ball is not None and k >= len(joint.translations):
        raise ValueError(
            f"rotation {joint.freedom_names()[k]!r} of a ball cannot {what}; give joint {joint.label!r} turns about "
            "the axes of an angle sequence instead"
        )
