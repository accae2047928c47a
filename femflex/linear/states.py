"""States z of effectors about rest: the values at which they settle, and their coupling with the motion.

    M du' + D du + K dxi + R dz = 0,    dz' = F_x dxi + F_u du + F_z dz

Flags of latches, and commands and memory of sampled controllers, stay as they are.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from femflex.arrays import Array, IntArray
from femflex.dynamics.motion.freedoms import usual_sizes
from femflex.dynamics.motion.increments import displaced, jacobian
from femflex.system import Effector

if TYPE_CHECKING:
    from femflex.dynamics.model import Model

STEP = 1e-5  # of a coordinate's usual size: error of central differences h^2 ~ 1e-10, rounding eps / h ~ 1e-11
STATE_STEP = 1e-4  # of a state's size: error of central differences 1e-8 at first
NARROW = 5  # steps, the last 1e-8 of the first: laws of 1e-9 of a coordinate's size have their own stiffness
MAX_STEPS = 30  # of Newton's method
SETTLED = 1e-11  # last step over the states' sizes
AT_REST = 1e-6  # of a state's size in the time that it takes to settle: what it may still change by
SINGULAR = 1e-10  # part of the largest singular value of F_z below which a state has no rest of its own


@dataclass(frozen=True, eq=False)
class StateEquations:
    """R (n, m), F_x (m, n), F_u (m, n), F_z (m, m) of m states and n coordinates, and the names of the states."""

    R: Array
    F_x: Array
    F_u: Array
    F_z: Array
    names: tuple[str, ...]

    @classmethod
    def empty(cls, n: int) -> StateEquations:
        """Return the coupling of n coordinates that have no states."""
        return cls(np.zeros((n, 0)), np.zeros((0, n)), np.zeros((0, n)), np.zeros((0, 0)), ())

    def in_directions(self, Z: Array) -> StateEquations:
        """The same over directions Z (n, k) of the coordinates."""
        return StateEquations(Z.T @ self.R, self.F_x @ Z, self.F_u @ Z, self.F_z, self.names)

    def settled_stiffness(self) -> Array:
        """Return the addend to K (n, n) [SI] of states that follow the coordinates at once: -R F_z^-1 F_x."""
        if not self.names:
            return np.zeros((len(self.R), len(self.R)))
        return np.asarray(-self.R @ np.linalg.lstsq(self.F_z, self.F_x, rcond=SINGULAR)[0])


def effector_states(model: Model) -> tuple[IntArray, Array]:
    """Places in x (m,) of the states of effectors, and their sizes (m,)."""
    system = model.system
    names = [name for name, _ in system.state_names()]
    of_effectors = (effector for effector in system.effectors if isinstance(effector, Effector))
    places = [names.index(name) for effector in of_effectors for name, _ in effector.state_names()]
    return model.n_q + model.n_u + np.array(places, int), system.state_sizes()[places]


def settled_states(model: Model, x: Array) -> Array:
    """The state x (n_x,) [SI] with the states of effectors where they do not change any more, coordinates as given.

    Raises ValueError for a state that goes on changing.
    """
    places, sizes = effector_states(model)
    if not places.size:
        return x
    x = x.copy()
    for _ in range(MAX_STEPS):
        rates = model.state_rate(0.0, x)[places] / sizes
        F = state_jacobian(model, 0.0, x) * sizes / sizes[:, None]
        scale = np.where(F.any(axis=1), np.abs(F).max(axis=1), 1.0)  # 1/s: a slow state settles as well as a fast one
        step = np.linalg.lstsq(F / scale[:, None], -rates / scale, rcond=SINGULAR)[0]
        x[places] += step * sizes
        if np.abs(step).max() <= SETTLED * max(1.0, np.abs(x[places] / sizes).max()):
            break
    drift = np.abs(model.state_rate(0.0, x)[places]) / sizes
    if not (drift / scale).max() < AT_REST:
        worst = int(np.argmax(drift / scale))
        raise ValueError(
            f"the state {model.system.all_state_names()[places[worst]][0]!r} keeps changing at rest, by "
            f"{drift[worst]:.3g} of its size per second; an equilibrium needs states that settle. Remove its effector, "
            "or start at its zero"
        )
    return x


def with_states(x: Array, places: IntArray, dz: Array) -> Array:
    """The state x (n_x,) with dz (m,) added at these places."""
    y = x.copy()
    y[places] += dz
    return y


def state_jacobian(model: Model, t: float, x: Array) -> Array:
    """F_z (m, m): derivative of the rates of the states of effectors by the states themselves at a time [s]."""
    places, sizes = effector_states(model)

    def rates(dz: Array) -> Array:
        return np.asarray(model.state_rate(t, with_states(x, places, dz))[places])

    return jacobian(rates, STATE_STEP * sizes, steps=NARROW)


def state_equations(model: Model, t: float, x: Array, udot: Array) -> StateEquations:
    """The equations of the states of effectors about x (n_x,) at t [s] with accelerations udot (n_u,) [SI]."""
    places, sizes = effector_states(model)
    if not places.size:
        return StateEquations.empty(model.n_u)
    names = model.system.all_state_names()
    fastest = max(1.0, float(np.abs(model.parts(x)[1]).max(initial=0.0)))
    F_z = state_jacobian(model, t, x)
    forces, rates = np.abs(model.residual(t, x, udot)), np.abs(F_z) @ np.abs(x[places])

    def force(dz: Array) -> Array:
        return model.residual(t, with_states(x, places, dz), udot)

    def rates_at_coordinates(dxi: Array) -> Array:
        return np.asarray(model.state_rate(t, displaced(model, x, dxi))[places])

    def rates_at_velocities(du: Array) -> Array:
        return np.asarray(model.state_rate(t, displaced(model, x, du=du))[places])

    return StateEquations(
        R=jacobian(force, STATE_STEP * sizes, forces, NARROW),
        F_x=jacobian(rates_at_coordinates, STEP * usual_sizes(model), rates, NARROW),
        F_u=jacobian(rates_at_velocities, np.full(model.n_u, STEP * fastest), rates),
        F_z=F_z,
        names=tuple(names[k][0] for k in places),
    )
