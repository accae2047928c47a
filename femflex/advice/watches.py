"""The three watches of a run: stretch that linear strain leaves out, bends beyond a strain form, and compression.

    stretch      the change of a body's first frequency by axial forces, which linear strain leaves out
    bend         the displacement of a body over its size, and the error of condensed strain in a spinning body
    compression  the axial force of a deploying member over its buckling load; of tethers and membranes, slackness

Each part records the worst instant of every body as the rows of a run pass. At the end a body has at most one line of
each watch, with both numbers and the remedy.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Protocol

import numpy as np

from femflex.advice.advice import Advice
from femflex.advice.bodies import BodyOrigins
from femflex.advice.deflections import DeflectionWatches, SpinningDeflectionWatch
from femflex.advice.deployed_bending import AxialForceWatch, SlackWatch
from femflex.advice.limits import ENERGY_CHANGE, NO_ENERGY
from femflex.advice.stiffening import StiffeningWatch
from femflex.advice.tension import TensionWatch
from femflex.arrays import Array
from femflex.dynamics import Model
from femflex.dynamics.effector_states import keeps_momentum
from femflex.dynamics.ledger.equation_terms import EQUATION_TERMS
from femflex.dynamics.observe.row import conservative_loads, is_damped
from femflex.system import Effector, System, VelocityRows
from femflex.warning import warn_of_physics

if TYPE_CHECKING:
    from femflex.dynamics import Model


class Watch(Protocol):
    """One part of a watch."""

    def watch(self, times: Array, states: Array, channels: Mapping[str, Array]) -> None:
        """Record the worst values over times (n_t,) [s], states (n_t, n_x) [SI] and channels (n_t, ...)."""

    def doubts(self) -> Iterator[Advice]:
        """A physics warning for each body beyond its limit: about "stretch", "bend" or "compression"."""


class Watches:
    """The watches of a run of a model, or of one state of rest; notes: earlier ones on its bodies, by name."""

    def __init__(
        self, model: Model, origins: BodyOrigins, notes: Mapping[str, str] | None = None, at_rest: bool = False
    ) -> None:
        self._parts: tuple[Watch, ...] = (
            StiffeningWatch(model, origins, "turns at" if at_rest else "turned at up to"),
            DeflectionWatches(model, origins, "is" if at_rest else "was", notes or {}),
            SpinningDeflectionWatch(model),
            AxialForceWatch(model),
            TensionWatch(model, origins),
            SlackWatch(model),
        )

    def watch(self, times: Array, states: Array, channels: Mapping[str, Array]) -> None:
        """Record the worst values over times (n_t,) [s], states (n_t, n_x) [SI] and channels (n_t, ...)."""
        for part in self._parts:
            part.watch(times, states, channels)

    def doubts(self) -> list[Advice]:
        """The physics warnings of all watches, the worst of each watch for each body."""
        worst: dict[tuple[str, str], Advice] = {}
        for entry in (entry for part in self._parts for entry in part.doubts()):
            key = entry.decision, entry.body
            if key not in worst or _excess(entry) > _excess(worst[key]):
                worst[key] = entry
        return list(worst.values())


def _excess(entry: Advice) -> float:
    """The value of a warning over its limit."""
    return abs(entry.value or 0.0) / (entry.limit or 1.0)


ENERGIES = ("kinetic", "elastic", "spring", "load")  # the change of the energy is relative to the largest of these


class EnergyWatch:
    """Largest change of the energy, or of the Jacobi integral, of a system that conserves it."""

    def __init__(self, model: Model) -> None:
        monitors = conserved_monitors(model.system, model.omitted)
        self._path = next((path for path in monitors if path != "monitors/angular_momentum"), "")
        if model.events is not None:  # latches and separations take energy
            self._path = ""
        self._first, self._change, self._size = np.nan, 0.0, 0.0

    def watch(self, channels: Mapping[str, Array]) -> None:
        """Record the change of the energy over the rows of a block."""
        if not self._path:
            return
        value = channels[self._path]
        self._first = float(value[0]) if np.isnan(self._first) else self._first
        self._change = max(self._change, float(np.abs(value - self._first).max()))
        shares = [channels[f"monitors/{kind}"] for kind in ENERGIES if f"monitors/{kind}" in channels]
        self._size = max(self._size, *(float(np.abs(share).max()) for share in shares))

    def warn(self) -> None:
        """Warn of a change by more than ENERGY_CHANGE of the largest energy, with both numbers."""
        if self._change > ENERGY_CHANGE * self._size > NO_ENERGY:
            quantity = self._path.split("/")[1]
            warn_of_physics(
                f"the {quantity} of the craft changed by {self._change:.3g} J, {self._change / self._size:.1%} of its "
                f"largest energy of {self._size:.3g} J, although nothing supplies or dissipates energy (limit "
                f"{ENERGY_CHANGE:.0%}): the integration loses accuracy. Give a smaller run.rtol and run.atol, no "
                "constant step, or integrator = 'dop853'"
            )


def conserved_monitors(system: System, without: Sequence[str] = ()) -> list[str]:
    """The monitors that should be constant: none under loads without potential, damping, or with bodies that vary.

    without: names of the terms that are switched off
    Without an orbit these are the energy, and the angular momentum of a free craft; on a free orbit the energy; on a
    specified circular orbit the Jacobi integral.
    """
    if system.varying:
        return []
    moves_joints = any(profile.moves for joint in system.joints for profile in joint.prescribed.values())
    does_work = any(spring.damping for spring in system.springs) or any(
        isinstance(c, VelocityRows) for c in system.constraints
    )
    conservative = conservative_loads(system)
    effectors = [effector for effector in system.effectors if isinstance(effector, Effector)]
    if any(effector.markers and not keeps_momentum(effector) for effector in effectors):
        return []
    passive = replace(system, effectors=())
    if len(conservative) < len(system.loads) or moves_joints or does_work or is_damped(passive):
        return []
    if any(term.switched and term.name in without for term in EQUATION_TERMS):
        return []
    if system.orbit is None:
        roots = [joint for joint in system.joints if joint.parent is None]
        parents = [tie.parent for ties in (system.loops, system.constraints, system.springs) for tie in ties]
        tied_to_base = None in parents
        is_free = len(roots) == 1 and roots[0].n_u - len(roots[0].prescribed) == 6 and not roots[0].stiffness.any()
        is_free = is_free and not (tied_to_base or conservative)
        is_conservative = system.frame.kind == "inertial"
        is_conservative = is_conservative and not effectors
        return ["monitors/energy"] * is_conservative + ["monitors/angular_momentum"] * is_free
    if effectors:
        return []
    if system.orbit.free:
        return [] if system.environment.third_bodies else ["monitors/energy"]
    return ["monitors/jacobi"] if system.orbit.is_steady else []
