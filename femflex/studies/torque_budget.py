"""Torque budget of a craft along a motion: torque, force and momentum of every outer source.

Torques are about the craft's centre of mass, in the axes of its root body. They are the generalised forces on the
rotation of the root, which turns the whole craft, less the moment of the resultant about the centre of mass. The
momentum of a source is the integral of its torque in inertial axes. Over a whole number of orbits it splits into a
secular part, which grows from orbit to orbit, and a cyclic part, which a wheel must store.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from scipy.integrate import cumulative_trapezoid, trapezoid
from scipy.spatial.transform import Rotation

from femflex.arrays import Array, IntArray
from femflex.dynamics.forces.attraction import Attraction
from femflex.dynamics.ledger.by_source import terms, velocity_slices
from femflex.rotations import dcm_from_quaternion
from femflex.system import Effector, System

if TYPE_CHECKING:
    from femflex.dynamics import Model

GRAVITY = "gravity_gradient"
INTERNAL = ("wheel", "gyro", "cable", "separation", "sensor")  # kinds that act between parts of the craft
LEAST = 8  # instants of a budget


@dataclass(frozen=True, eq=False)
class SourceBudget:
    """One source along the motion, at n_t instants.

    time         (n_t,) [s]
    torque       (n_t, 3) about the centre of mass, axes of the root body [N m]
    force        (n_t, 3) resultant, axes of the base frame [N]; of loads on a specified orbit zero
    momentum     (n_t, 3) integral of the torque, inertial axes [N m s]
    deformation  largest change of the torque by the elastic coordinates [N m]
    """

    name: str
    time: Array
    torque: Array
    force: Array
    momentum: Array
    deformation: float

    @property
    def mean(self) -> Array:
        """Mean torque (3,) over time [N m]."""
        return np.asarray(trapezoid(self.torque, self.time, axis=0) / (self.time[-1] - self.time[0]))

    @property
    def largest(self) -> float:
        """Largest magnitude of the torque [N m]."""
        return float(np.linalg.norm(self.torque, axis=1).max())

    @property
    def mean_force(self) -> float:
        """Mean magnitude of the force [N]."""
        size = np.linalg.norm(self.force, axis=1)
        return float(trapezoid(size, self.time) / (self.time[-1] - self.time[0]))


@dataclass(frozen=True, eq=False)
class TorqueBudget:
    """The sources of a motion and their sum.

    time    (n_t,) [s]
    orbits  number of orbits that it covers; 1 where there is no orbit
    whole   whether that number is whole, so that means are those of orbits
    in_orbit  whether there is an orbit
    """

    time: Array
    orbits: float
    whole: bool
    sources: tuple[SourceBudget, ...]
    in_orbit: bool

    def secular(self, source: SourceBudget) -> Array:
        """Momentum (3,) per orbit that stays, inertial axes [N m s]."""
        return np.asarray(source.momentum[-1] / self.orbits)

    def cyclic(self, source: SourceBudget) -> float:
        """Half the largest range, over the inertial axes, of the momentum without its secular part [N m s]."""
        share = (self.time - self.time[0]) / (self.time[-1] - self.time[0])
        rest = source.momentum - share[:, None] * source.momentum[-1]
        return float(np.ptp(rest, axis=0).max() / 2)


def torque_budget(model: Model, times: Array, states: Array, channels: Mapping[str, Array]) -> TorqueBudget:
    """The torque budget of a motion: times (n_t,) [s], states (n_t, n_x), and the channels observed there.

    Of a motion of more than one orbit, the last whole number of orbits counts. Raises ValueError for a craft whose root
    body does not turn about three axes, and for fewer than 8 instants.
    """
    system = model.system
    times, states, orbits, whole, rows = _whole_orbits(system, np.asarray(times, float), np.asarray(states, float))
    if len(times) < LEAST:
        raise ValueError(f"a budget needs at least {LEAST} instants; the motion has {len(times)}")
    names = source_names(system)
    root = _Root.from_motion(system, times, states)
    attitude = dcm_from_quaternion(np.asarray(channels[f"bodies/{system.root}/attitude"])[rows])
    arm = np.asarray(channels["monitors/center_of_mass"])[rows] - channels[f"bodies/{system.root}/position"][rows]
    elastic = [k for k, (name, _) in enumerate(system.coordinate_names()) if ".delta" in name]
    straight = states.copy()
    straight[:, elastic] = 0.0
    deformed = terms(model, times, states)
    rigid = terms(model, times, straight) if elastic else deformed

    def source(name: str, parts: Sequence[str]) -> SourceBudget:
        bent, flat = (np.sum([rows_of[part] for part in parts], axis=0, dtype=float) for rows_of in (deformed, rigid))
        force = root.force(bent)
        arms = (np.cross(arm, along) for along in (force, root.force(flat)))
        moment, flat_moment = (np.einsum("tji,tj->ti", attitude, each) for each in arms)
        if root.moving is None:  # a specified orbit takes the force, which the run reports
            at_markers = [channels[f"{part}/force"][rows] for part in parts if f"{part}/force" in channels]
            force = sum((each.reshape(len(times), -1, 3).sum(axis=1) for each in at_markers), force)
        torque = root.torque(bent) - moment
        change = torque - (root.torque(flat) - flat_moment)
        inertial = np.einsum("tij,tj->ti", attitude, torque)
        momentum = np.asarray(cumulative_trapezoid(inertial, times, axis=0, initial=0))
        return SourceBudget(name, times, torque, force, momentum, float(np.linalg.norm(change, axis=1).max()))

    sources = [source(name, [name]) for name in names]
    sources += [source(f"sum of {kind}", parts) for kind, parts in _of_one_kind(system, names).items()]
    if len(names) > 1:
        sources.append(source("sum", names))
    return TorqueBudget(times, orbits, whole, tuple(sources), system.orbit is not None)


def source_names(system: System) -> list[str]:
    """Names of the outer sources of torque in the ledger: gravity, loads and effectors that act from outside.

    Raises ValueError where there is none.
    """
    names = [GRAVITY] if system.orbit is not None else []
    names += [f"{Attraction.folder}/{item}" for item in Attraction().items(system)]
    names += [f"loads/{load.name}" for load in system.loads]
    names += [
        f"effectors/{effector.name}"
        for effector in system.effectors
        if isinstance(effector, Effector) and effector.markers and effector.acts and effector.kind not in INTERNAL
    ]
    if not names:
        raise ValueError("nothing acts on the craft from outside: it has no orbit, no loads, and no such effectors")
    return names


def _of_one_kind(system: System, names: Sequence[str]) -> dict[str, list[str]]:
    """Kind -> names of its effectors among those names, where it has several, as light has on each body."""
    kinds: dict[str, list[str]] = {}
    for effector in system.effectors:
        if isinstance(effector, Effector) and f"effectors/{effector.name}" in names:
            kinds.setdefault(effector.kind, []).append(f"effectors/{effector.name}")
    return {kind: parts for kind, parts in kinds.items() if 1 < len(parts) < len(names)}


def _whole_orbits(system: System, times: Array, states: Array) -> tuple[Array, Array, float, bool, IntArray]:
    """The instants of the last whole number of orbits, and their rows."""
    rows: IntArray = np.arange(len(times))
    if system.orbit is None:
        return times, states, 1.0, True, rows
    covered = float(times[-1] - times[0]) / system.orbit.period
    whole = int(covered + 1e-6)
    if whole < 1:
        return times, states, covered, False, rows
    rows = rows[times >= times[-1] - whole * system.orbit.period * (1.0 + 1e-9)]
    return times[rows], states[rows], float(whole), True, rows


@dataclass(frozen=True, eq=False)
class _Root:
    """Places in u of the rates of the root body and, where it is free, of its velocity; and the map to body axes.

    axes (n_t, 3, 3): body components of the unit rates, one in each column
    """

    turning: slice
    moving: slice | None
    axes: Array

    @classmethod
    def from_motion(cls, system: System, times: Array, states: Array) -> _Root:
        """The root of a motion. Raises ValueError where it does not turn about three axes."""
        joint = system.joint_of(system.root)
        n = len(joint.translations)
        if joint.n_u != n + 3 or n not in (0, 3):
            raise ValueError(
                "a torque budget needs a root body that turns about three axes, freely or as prescribed; the joint of "
                f"{system.root!r} is {joint.kind}"
            )
        first = velocity_slices(system)[joint.label].start
        axes = np.broadcast_to(np.eye(3), (len(times), 3, 3))
        if joint.ball is None:
            q = states[:, n : n + 3].copy()  # the root comes first in the states
            for k, profile in joint.prescribed.items():
                q[:, k - n] = profile(times)[0]
            turned = Rotation.identity(len(times))
            columns: list[Array] = []
            for k in (2, 1, 0):
                columns.insert(0, turned.inv().apply(joint.rotations[k]))
                turned = Rotation.from_rotvec(q[:, [k]] * joint.rotations[k]) * turned
            axes = np.stack(columns, axis=2)
        marker = system.bodies[system.root].markers[joint.child_marker]
        turning = slice(first + n, first + n + 3)
        return cls(turning, slice(first, first + 3) if n else None, marker.orientation @ axes)

    def torque(self, rows: Array) -> Array:
        """Torque (n_t, 3) about the root's origin, body axes, of a term (n_t, n_u) with its sign in -Q."""
        along = -rows[:, self.turning]  # axes^T torque
        return np.asarray(np.linalg.solve(np.swapaxes(self.axes, 1, 2), along[:, :, None])[:, :, 0])

    def force(self, rows: Array) -> Array:
        """Force (n_t, 3) along the translations of the root, axes of the base frame."""
        return np.zeros((len(rows), 3)) if self.moving is None else -rows[:, self.moving]
