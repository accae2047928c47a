"""States z of effectors about rest: the values at which they settle, and their coupling with the motion.

    M du' + D du + K dxi + R dz = 0,    dz' = F_x dxi + F_u du + F_z dz

Flags of latches, and commands and memory of sampled controllers, stay as they are.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from femflex.arrays import Array
from femflex.dynamics.linear.increments import advanced
from femflex.dynamics.linear.local_derivative import local_derivative, on_line
from femflex.system import Effector, System

if TYPE_CHECKING:
    from femflex.dynamics.model import Model

STEP = 1e-4  # of a state's size, and the first of some that fall: error of central differences 1e-8 at first
PLACE = 1e-5  # of a coordinate's size or of the fastest rate, likewise
NARROW = 5  # steps, the last 1e-8 of the first
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
        """Return the addend to K (n, n) of states that follow the coordinates at once: -R F_z^-1 F_x."""
        if not self.names:
            return np.zeros((len(self.R), len(self.R)))
        return np.asarray(-self.R @ np.linalg.lstsq(self.F_z, self.F_x, rcond=SINGULAR)[0])


def effector_states(system: System) -> list[int]:
    """Places in z of the states of effectors."""
    names = [name for name, _ in system.state_names()]
    return [
        names.index(name)
        for effector in system.effectors
        if isinstance(effector, Effector)
        for name, _ in effector.state_names()
    ]


def settled_states(model: Model, x: Array) -> Array:
    """The state x (n_x,) with the states of effectors where they do not change any more, coordinates at rest as given.

    Raises ValueError for a state that goes on changing.
    """
    states = effector_states(model.system)
    if not states:
        return x
    x, positions = x.copy(), model.n_q + model.n_u + np.array(states)
    sizes = model.system.state_sizes()[states]
    for _ in range(MAX_STEPS):
        rates = model.state_rate(0.0, x)[positions] / sizes
        F = state_jacobian(model, 0.0, x, states, sizes) * sizes / sizes[:, None]
        rates_scale = np.where(
            F.any(axis=1), np.abs(F).max(axis=1), 1.0
        )  # 1/s: a slow state settles as well as a fast one
        step = np.linalg.lstsq(F / rates_scale[:, None], -rates / rates_scale, rcond=SINGULAR)[0]
        x[positions] += step * sizes
        if np.abs(step).max() <= SETTLED * max(1.0, np.abs(x[positions] / sizes).max()):
            break
    drift = np.abs(model.state_rate(0.0, x)[positions]) / sizes
    if not (drift / rates_scale).max() < AT_REST:
        worst = int(np.argmax(drift / rates_scale))
        name = model.system.state_names()[states[worst]][0]
        raise ValueError(
            f"the state {name!r} keeps changing at rest, by {drift[worst]:.3g} of its size per second; an equilibrium "
            "needs states that settle. Remove its effector, or start at its zero"
        )
    return x


def resting_state(model: Model, x: Array, target: Model) -> Array:
    """Return the state (n_x,) [SI] of a model at rest as another one is in x; states missing there start as given.

    The two are of one craft, with other effectors.
    """
    values = dict(zip([name for name, _ in model.system.state_names()], model.parts(x)[2], strict=True))
    out = target.at_rest(x[: model.n_q])
    for k, (name, _) in enumerate(target.system.state_names()):
        out[target.n_q + target.n_u + k] = values.get(name, out[target.n_q + target.n_u + k])
    return out


def state_jacobian(model: Model, t: float, x: Array, states: list[int], sizes: Array) -> Array:
    """F_z (m, m): derivative of the rates of states by the states themselves at a time [s]."""
    positions = model.n_q + model.n_u + np.array(states, int)

    def rates(dx: Array) -> Array:
        return np.asarray(model.state_rate(t, x + dx)[positions])

    units = np.eye(model.n_x)[positions]
    columns = [
        local_derivative(on_line(rates, e), STEP * size, steps=NARROW) for e, size in zip(units, sizes, strict=True)
    ]
    return np.column_stack(columns) if columns else np.zeros((0, 0))


def state_equations(model: Model, t: float, x: Array, udot: Array, motion_sizes: Array) -> StateEquations:
    """The equations of the states of effectors about x (n_x,) at t with accelerations udot (n_u,).

    far: size (n_u,) of a large motion of each coordinate
    """
    states, n = effector_states(model.system), model.n_u
    names = tuple(model.system.state_names()[k][0] for k in states)
    if not states:
        return StateEquations.empty(n)
    q, u, z = model.parts(x)
    sizes, positions = model.system.state_sizes()[states], model.n_q + n + np.array(states, int)
    fastest = max(1.0, float(np.abs(u).max(initial=0.0)))
    F_z = state_jacobian(model, t, x, states, sizes)
    forces, rates = np.abs(model.residual(t, x, udot)), np.abs(F_z) @ np.abs(x[positions])

    def force(dx: Array) -> Array:
        return model.residual(t, x + dx, udot)

    def rates_at_coordinates(xi: Array) -> Array:
        return np.asarray(model.state_rate(t, np.concatenate([advanced(model, q, xi), u, z]))[positions])

    def rates_at_velocities(du: Array) -> Array:
        return np.asarray(model.state_rate(t, np.concatenate([q, u + du, z]))[positions])

    R, F_x, F_u = np.empty((n, len(states))), np.empty((len(states), n)), np.empty((len(states), n))
    for j, (position, size) in enumerate(zip(positions, sizes, strict=True)):
        R[:, j] = local_derivative(on_line(force, np.eye(model.n_x)[position]), STEP * size, forces, NARROW)
    for k, e in enumerate(np.eye(n)):
        F_x[:, k] = local_derivative(on_line(rates_at_coordinates, e), PLACE * motion_sizes[k], rates, NARROW)
        F_u[:, k] = local_derivative(on_line(rates_at_velocities, e), PLACE * fastest, rates)
    return StateEquations(R, F_x, F_u, F_z, names)
