"""Forces of a system at rest in its base frame, and whether anything keeps it from being at rest there."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from femflex.arrays import Array, BoolArray, IntArray
from femflex.dynamics.joints.places import joint_places
from femflex.dynamics.model import Model, compile_system
from femflex.dynamics.motion.freedoms import (
    closing_directions,
    elastic_places,
    frame_rate,
    is_prescribed,
    slack_of_loops,
    usual_sizes,
)
from femflex.dynamics.motion.increments import advanced
from femflex.dynamics.motion.linear_stiffness import linear_stiffness
from femflex.linear.equations import stiffness
from femflex.linear.states import settled_states, state_equations
from femflex.linear.still import controlled_rotors, frozen_system, with_coasting_rotors, without_damping
from femflex.system import Effector, Environment, Frame, System

SLACK = 1e-12  # of the largest: stiffness of a direction that neither shapes nor springs resist
TIMES = 0.0, 12345.678  # s, of no common period
CHANGED = 1e-9  # relative change of the forces over time that is still rounding


@dataclass(frozen=True, eq=False)
class Steady:
    """A system at rest in its base frame, its outer forces scaled by a share between 0 and 1.

    damped   the system at rest with its damping, and with the motors of wheels that a law commands
    full     the model under all its forces but damping: loads, weight, centrifugal, gravity gradient
    inner    the same bodies and joints without any: elastic and spring forces alone
    sizes    (n_u,) usual size of each coordinate; forces times sizes are energies [J]
    elastic  (n_u,) which coordinates have a stiffness of their own
    prescribed (n_u,) which are locked or prescribed, and so are not sought
    """

    damped: System
    full: Model
    inner: Model
    sizes: Array
    elastic: BoolArray
    prescribed: BoolArray

    def forces(self, q: Array) -> tuple[Array, Array]:
        """Inner and outer generalised forces h - Q (n_u,) at the coordinates q, times the sizes [J]."""
        x = self.at_rest(q)
        inner, full = (np.where(self.prescribed, 0.0, model.bias(0.0, x)) for model in (self.inner, self.full))
        return inner * self.sizes, (full - inner) * self.sizes

    def at_rest(self, q: Array) -> Array:
        """The state (n_x,) [SI] at rest at coordinates q (n_q,), states of effectors settled."""
        return settled_states(self.full, self.full.at_rest(q))

    def largest_force(self, q: Array, share: float) -> float:
        """Size of the forces [J]: the largest of inner, outer, and elastic ones of shapes alone, which may cancel."""
        inner, outer = self.forces(q)
        elastic = (self.own_stiffness[0] @ (self.shape(q) * self.sizes)) * self.sizes
        return float(max(np.abs(part).max(initial=0.0) for part in (inner, share * outer, elastic)))

    def shape(self, q: Array) -> Array:
        """Amplitudes of shapes, translations and rotations (n_u,) in usual sizes; 0 along balls."""
        columns = self.own_stiffness[1]
        return np.where(columns >= 0, q[columns], 0.0) / self.sizes if len(columns) else np.zeros(0)

    @cached_property
    def energy_of_spin(self) -> float:
        """Energy of the turning base frame [J], whose rounding is left over where forces cancel; 0 if it is still.

        In a spinning frame the kinetic one; in an orbital frame, without that of the orbit, inertia times the square of
        the rate.
        """
        q = self.full.x0[: self.full.n_q]
        if self.full.system.frame.kind == "orbital":
            return float(np.diag(self.inertia(q)).max(initial=0.0)) * frame_rate(self.full.system) ** 2
        if self.full.system.frame.kind != "spinning":
            return 0.0
        return float(self.full.observe(np.zeros(1), self.full.at_rest(q)[None])["monitors/kinetic"][0])

    @cached_property
    def slack(self) -> float:
        """The part of the largest below which a row of the loops follows from others."""
        return slack_of_loops(self.full.system)

    @cached_property
    def own_stiffness(self) -> tuple[Array, IntArray]:
        """Stiffness (n_u, n_u) [SI] of shapes and joint springs, and the coordinates (n_u,) that it multiplies."""
        return linear_stiffness(self.full)

    def stiffness(self, q: Array, share: float, lambdas: Array) -> Array:
        """Derivative (n_u, n_u) of the forces by increments of the coordinates in their sizes [J].

        Loops carry the multipliers (n_rows,) along.
        """
        x, no_acceleration = self.at_rest(q), np.zeros(self.full.n_u)
        K = share * stiffness(self.full, 0.0, x, no_acceleration, lambdas)
        states = state_equations(self.full, 0.0, x, no_acceleration)
        if states.names:
            K += share * states.settled_stiffness()
        if share < 1.0:
            K += (1.0 - share) * stiffness(self.inner, 0.0, x, no_acceleration, lambdas)
        return K * self.sizes * self.sizes[:, None]

    def inertia(self, q: Array) -> Array:
        """Mass matrix (n_u, n_u) by the sizes of the coordinates [kg m^2]."""
        return self.full.mass_matrix(0.0, self.at_rest(q)) * self.sizes * self.sizes[:, None]

    def constraint_matrix(self, q: Array) -> Array:
        """A (n_rows, n_u) of the loops at q, by increments in their sizes; no rows for a tree."""
        if self.full.constraints is None:
            return np.zeros((0, self.full.n_u))
        A = self.full.constraints.matrix(0.0, self.full.at_rest(q))
        return np.where(self.prescribed, 0.0, A * self.sizes)

    def directions(self, A: Array) -> tuple[Array, Array]:
        """Return directions (n_u, .) that keep loops closed: those that shapes and springs resist, and the others."""
        unit = np.eye(self.full.n_u)
        if not len(A):
            return unit[:, self.elastic & ~self.prescribed], unit[:, ~self.elastic & ~self.prescribed]
        Z = unit[:, ~self.prescribed] @ closing_directions(A[:, ~self.prescribed], self.slack)
        K = self.own_stiffness[0] * self.sizes * self.sizes[:, None]
        values, V = np.linalg.eigh(Z.T @ K @ Z)
        stiff = values > SLACK * values.max(initial=0.0)
        return Z @ V[:, stiff], Z @ V[:, ~stiff]

    def coordinates_after(self, q: Array, move: Array) -> Array:
        """Coordinates (n_q,) [m, rad] after a move (n_u,) in usual sizes, loops closed again by the shortest way."""
        q = advanced(self.full, q, move * self.sizes)
        if self.full.constraints is None:
            return q
        x = self.full.at_rest(q)
        self.full.project(0.0, x, self.full.table, self.full.pool, self.full.work)
        return x[: self.full.n_q]


def steady(system: System, at: float | None = None) -> Steady:
    """The system without damping, with loads as they are at a time [s], at rest in its base frame.

    Raises ValueError with what changes over time there: loads, an eccentric orbit, forces of a frame that turns
    relative to the base frame.
    """
    if system.controllers:
        raise ValueError(
            f"controller {system.controllers[0].name!r} is sampled, so there is no equilibrium with it; leave it out, "
            "and give its command to the effectors that take it"
        )
    frozen = frozen_system(with_coasting_rotors(system), at)
    driven = controlled_rotors(system)
    moving = frozen_system(with_coasting_rotors(system, driven), at) if driven else frozen
    undamped = without_damping(frozen)
    full = compile_system(undamped)
    # tanks keep their mass here
    filled = {name: variation for name, variation in undamped.varying.items() if not variation.states}
    inner = compile_system(
        replace(
            undamped, loads=(), orbit=None, frame=Frame(), environment=Environment(), effectors=(), z0={},
            varying=filled,
        )
    )  # fmt: skip
    problem = Steady(moving, full, inner, usual_sizes(full), elastic_freedoms(full), is_prescribed(full))
    _check_constant(problem)
    return problem


def elastic_freedoms(model: Model) -> BoolArray:
    """Return (n_u,) which freedoms have a stiffness of their own: shapes, and sprung joints."""
    elastic = np.zeros(model.n_u, bool)
    elastic[elastic_places(model)[1]] = True
    for joint, _, u in joint_places(model.system):
        elastic[u : u + joint.n_u] = joint.stiffness > 0
    return elastic


def _check_constant(problem: Steady) -> None:
    """Raise ValueError when the forces at rest depend on time for a reason not named before."""
    x = problem.at_rest(problem.full.x0[: problem.full.n_q])
    now, later = (np.where(problem.prescribed, 0.0, problem.full.bias(t, x)) * problem.sizes for t in TIMES)
    inertia = float((np.diag(problem.full.mass_matrix(0.0, x)) * problem.sizes**2).max(initial=0.0))
    turning = inertia * frame_rate(problem.full.system) ** 2  # whose rounding is left where forces cancel
    size = max(turning, *(np.abs(part).max(initial=0.0) for part in (*problem.forces(x[: problem.full.n_q]), now)))
    change = float(np.abs(later - now).max(initial=0.0))
    if change > CHANGED * size:
        raise ValueError(
            f"the forces on the system at rest change over time: their work over a typical displacement changes by "
            f"{change:.3g} J, and is {size:.3g} J. An equilibrium needs constant forces{_remedy(problem.full, x)}"
        )


def _remedy(model: Model, x: Array) -> str:
    """Return advice about the effectors that change over time by themselves, "" if there are none."""
    channels = model.observe(np.array(TIMES), np.stack([x, x]))
    changing = {
        path.split("/")[1]
        for path, (now, later) in channels.items()
        if path.startswith("effectors/") and not np.array_equal(now, later, equal_nan=True)
    }
    sources = [
        effector for effector in model.system.effectors if isinstance(effector, Effector) and not effector.inputs
    ]
    names = [f"{effector.kind} {effector.name!r}" for effector in sources if effector.name in changing]
    if not names:
        return ""
    return (
        f"; --at does not hold effectors, of which these change over time: {', '.join(names)}. Give them constant "
        "values in the case, those of the time that is meant"
    )
