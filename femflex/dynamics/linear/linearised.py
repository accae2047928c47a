"""The equations of motion (9) about a state, from the compiled residual itself: M, D, K and the eigenvalues.

    M du' + D du + K dxi = 0,    dxi' = du + W dxi

dxi (n_u,) are increments of the coordinates along the quasi-velocities, q -> q o exp(dxi); W turns them with the
quasi-velocities of balls. D holds damping and gyroscopic forces; K elastic, load, centrifugal and gravity stiffness.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from femflex.arrays import Array, BoolArray, ComplexArray, IntArray
from femflex.body import FlexibleBody, StrainTensors
from femflex.dynamics.joints.law_places import latch_places
from femflex.dynamics.linear.closed_motion import (
    independent_coordinates,
    least_multipliers,
    refuse_rolling,
    slack_of_loops,
)
from femflex.dynamics.linear.increments import advanced
from femflex.dynamics.linear.local_derivative import local_derivative, on_line
from femflex.dynamics.linear.states import StateEquations, state_equations
from femflex.dynamics.lowering.layout import BALL_NONE, body_records
from femflex.system import System

if TYPE_CHECKING:
    from femflex.dynamics.model import Model

STEP = 1e-5  # of a coordinate's usual size: error of central differences h^2 ~ 1e-10, rounding eps / h ~ 1e-11
NARROW = 5  # steps along coordinates, the last 1e-13 of that size: laws of 1e-9 of it have their own stiffness


@dataclass(frozen=True, eq=False)
class Linearised:
    """Linear equations about a state: M, D, K, W (n, n) of the freedoms that are not prescribed; their names.

    states  the m states of effectors in addition (see femflex.dynamics.linear.states)


    With loops n counts the independent ones, which the others follow (see femflex.dynamics.linear.closed_motion).
    """

    M: Array
    D: Array
    K: Array
    W: Array
    names: tuple[str, ...]
    states: StateEquations

    def state_matrix(self) -> Array:
        """A (2 n + m, 2 n + m) of d(dxi, du, dz)/dt = A (dxi, du, dz)."""
        n, z = len(self.M), self.states
        lower = -np.linalg.solve(self.M, np.hstack([self.K, self.D, z.R]))
        upper = np.hstack([self.W, np.eye(n), np.zeros_like(z.R)])
        return np.vstack([upper, lower, np.hstack([z.F_x, z.F_u, z.F_z])])

    def eigenvalues(self) -> ComplexArray:
        """Eigenvalues (2 n + m,) of the state matrix [1/s], by rising size."""
        values = np.asarray(np.linalg.eigvals(self.state_matrix()), complex)
        return values[np.argsort(np.abs(values), kind="stable")]


def linearised(model: Model, t: float, x: Array, udot: Array | None = None) -> Linearised:
    """The linear equations about the state x (n_x,) at t with accelerations udot (n_u,), zero when left out.

    M is exact, and D is exact but for effectors and laws of joints. K is that of shapes, their nonlinear strain
    included, and of springs exactly, plus derivatives of the rest (`local_derivative`). With loops K holds the
    stiffness that their forces add as they turn along, and the state must be at rest. Raises ValueError for
    nonholonomic constraints, and for loops in motion.
    """
    accelerations = np.zeros(model.n_u) if udot is None else np.asarray(udot, float)
    q, u, z = model.parts(x)
    refuse_rolling(model.system, "linear equations")
    if model.system.loops and (u.any() or accelerations.any()):
        raise ValueError(
            f"the loops {[loop.label for loop in model.system.loops]} are in motion, and linear equations of loops "
            "are those about rest; take a state of rest, or let the base frame spin ([attitude] frame = 'spinning')"
        )

    def residual_at_rates(du: Array) -> Array:
        return model.residual(t, np.concatenate([q, u + du, z]), accelerations)

    M, K = model.mass_matrix(t, x), stiffness(model, t, x, accelerations, multipliers(model, t, x))
    largest = rounding_forces(model, t, x, accelerations)
    first = max(1.0, float(np.abs(u).max(initial=0.0)))  # inertia is of second degree in u: long steps give it exactly
    D = np.zeros_like(M)
    for j, e in enumerate(np.eye(model.n_u)):
        D[:, j] = local_derivative(on_line(residual_at_rates, e), first, largest)
    independent, Z = free_directions(model, t, x)
    states = state_equations(model, t, x, accelerations, usual_sizes(model)).in_directions(Z)
    M, D, K = (Z.T @ A @ Z for A in (M, D, K))
    names = [name for name, _ in model.system.velocity_names()]
    return Linearised(
        M,
        D,
        K,
        ball_rotation_rates(model, u)[np.ix_(independent, independent)],
        tuple(names[k] for k in independent),
        states,
    )


def free_directions(model: Model, t: float, x: Array) -> tuple[IntArray, Array]:
    """Return the free freedoms (m,), neither prescribed nor following through loops, and the motion of all (n_u, m)."""
    free = np.flatnonzero(~is_prescribed(model, x))
    Z = np.eye(model.n_u)[:, free]
    if model.constraints is None:
        return free, Z
    independent, following = independent_coordinates(
        model.constraints.matrix(t, x)[:, free], usual_sizes(model)[free], slack_of_loops(model.system)
    )
    return free[independent], Z @ following


def is_prescribed(model: Model, x: Array | None = None) -> BoolArray:
    """Return (n_u,) whether each freedom is prescribed or locked, also by a rigid latch in the state x.

    x: (n_x,), the initial state when left out
    """
    prescribed = np.zeros(model.n_u, bool)
    for name, record in zip(model.system.order, body_records(model.table)[1:], strict=True):
        prescribed[[int(record["u"]) + k for k in model.system.joint_of(name).prescribed]] = True
    z = model.parts(model.x0 if x is None else x)[2]
    prescribed[[latch.u for latch in latch_places(model.system) if latch.latch.rigid and z[latch.time] >= 0.0]] = True
    return prescribed


def multipliers(model: Model, t: float, x: Array) -> Array:
    """Return the multipliers (n_rows,) of the loops of a system at rest at x; none for a tree."""
    if model.constraints is None:
        return np.zeros(0)
    ties, force = model.constraints.matrix(t, x), model.bias(t, x)
    prescribed = is_prescribed(model, x)
    return least_multipliers(
        np.where(prescribed, 0.0, ties), np.where(prescribed, 0.0, force), slack_of_loops(model.system)
    )


def stiffness(model: Model, t: float, x: Array, udot: Array, lambdas: Array) -> Array:
    """K (n_u, n_u): derivative of the residual by increments of the coordinates, at constant multipliers (n_rows,)."""
    q, u, z = model.parts(x)
    K, columns = linear_stiffness(model)
    has_column = columns >= 0
    stretched = [(strain, e, qe, strain.force(q[qe])) for strain, e, qe in nonlinear_bodies(model)]

    def nonlinear_residual(q_moved: Array) -> Array:
        change, y = np.where(has_column, q_moved[columns] - q[columns], 0.0), np.concatenate([q_moved, u, z])
        constraint_forces = lambdas @ model.constraints.matrix(t, y) if model.constraints is not None else 0.0
        residual = model.residual(t, y, udot) - constraint_forces - K @ change
        for strain, e, qe, force in stretched:
            unchanged = np.array_equal(q_moved[qe], q[qe])  # most steps move other bodies
            residual[e] -= (force if unchanged else strain.force(q_moved[qe])) - strain.V1 @ q_moved[qe]
        return residual

    def residual_along(xi: Array) -> Array:
        return nonlinear_residual(advanced(model, q, xi))

    largest = rounding_forces(model, t, x, udot)
    differences = np.zeros_like(K)
    for j, size in enumerate(usual_sizes(model)):
        differences[:, j] = local_derivative(
            on_line(residual_along, np.eye(model.n_u)[j]), STEP * size, largest, NARROW
        )
    K = K + differences
    for strain, e, qe, _ in stretched:  # differences would be those of fast powers: EA against a string's tension
        K[np.ix_(e, e)] += strain.tangent(q[qe]) - (strain.V1 + strain.V1.T) / 2
    return K


def nonlinear_bodies(model: Model) -> list[tuple[StrainTensors, IntArray, IntArray]]:
    """Strain tensors of bodies whose strain is not linear, and places (n,) of their coordinates in u and in q.

    None of bodies whose stiffness varies.
    """
    bodies = []
    for name, record in zip(model.system.order, body_records(model.table)[1:], strict=True):
        body = model.system.bodies[name]
        if not body.strain.is_linear and name not in model.system.varying:
            indices = np.arange(body.n_modes)
            bodies.append((body.strain, int(record["ue"]) + indices, int(record["qe"]) + indices))
    return bodies


def rounding_forces(model: Model, t: float, x: Array, udot: Array) -> Array:
    """Return forces (n_u,) whose rounding may remain in the residual about x (n_x,) with accelerations udot (n_u,).

    What is large in one coordinate is summed up in others: the largest energy counts for all.
    """
    K, columns = linear_stiffness(model)
    M, sizes = np.abs(model.mass_matrix(t, x)), usual_sizes(model)
    elastic = np.abs(K) @ np.abs(np.where(columns >= 0, x[columns], 0.0))
    static = (elastic + M @ np.abs(udot) + np.abs(model.bias(t, x))) * sizes
    turning = np.diag(M) * (frame_rate(model.system) * sizes) ** 2  # of a spin about a principal axis nothing is left
    return np.asarray((static + turning).max(initial=0.0) / sizes)


def linear_stiffness(model: Model) -> tuple[Array, IntArray]:
    """Stiffness (n_u, n_u) of shapes and of springs on joint coordinates, and which coordinate each column multiplies.

    Columns of balls have no such coordinate (-1) and are zero.
    """
    system = model.system
    K, columns = np.zeros((model.n_u, model.n_u)), np.full(model.n_u, -1, np.int64)
    for name, record in zip(system.order, body_records(model.table)[1:], strict=True):
        joint, body = system.joint_of(name), system.bodies[name]
        plain = len(joint.translations) + (len(joint.rotations) if record["ball"] == BALL_NONE else 0)
        u, q = int(record["u"]) + np.arange(plain), int(record["q"]) + np.arange(plain)
        K[u, u], columns[u] = joint.stiffness[:plain], q
        e = int(record["ue"]) + np.arange(body.n_modes)
        K[np.ix_(e, e)] = (body.strain.V1 + body.strain.V1.T) / 2
        columns[e] = int(record["qe"]) + np.arange(body.n_modes)
    return K, columns


def ball_rotation_rates(model: Model, u: Array) -> Array:
    """W (n_u, n_u): -skew(omega) for every ball that turns at omega, zero elsewhere."""
    W = np.zeros((model.n_u, model.n_u))
    for record in body_records(model.table)[1:]:
        if record["ball"] != BALL_NONE:
            first = int(record["u"]) + int(record["n_slide"])
            x, y, z = u[first : first + 3]
            W[first : first + 3, first : first + 3] = [[0, z, -y], [-z, 0, x], [y, -x, 0]]
    return W


def usual_sizes(model: Model) -> Array:
    """Size (n_u,) of a large motion of each coordinate: a radian, the craft's length, or shapes that bend as far."""
    system = model.system
    spans = {name: span_of(system.bodies[name]) for name in system.order}
    longest = max(spans.values())
    sizes = np.ones(model.n_u)
    for name, record in zip(system.order, body_records(model.table)[1:], strict=True):
        body = system.bodies[name]
        sizes[int(record["u"]) : int(record["u"]) + int(record["n_slide"])] = longest
        for k in range(body.n_modes):
            reach = max(float(np.linalg.norm(marker.phi[:, k])) for marker in body.markers.values()) / spans[name]
            turn = max(float(np.linalg.norm(marker.psi[:, k])) for marker in body.markers.values())
            if body.skin is not None and len(body.skin.points):
                reach = max(reach, float(body.skin.max_displacement[k]) / spans[name])
            fallback = 1.0 / (
                spans[name] * np.sqrt(body.moments.mass)
            )  # a shape that moves no marker, of a body undrawn
            sizes[int(record["ue"]) + k] = 1.0 / (max(reach, turn) or fallback)
    return sizes


def span_of(body: FlexibleBody) -> float:
    """Extent of a body [m], 1 where it has none."""
    points = np.stack([marker.position for marker in body.markers.values()])
    if body.skin is not None and len(body.skin.points):
        points = np.concatenate([points, body.skin.points])
    return float(np.linalg.norm(np.ptp(points, axis=0))) or 1.0


def frame_rate(system: System) -> float:
    """Rate of the base frame [rad/s]: of its spin, or of the orbit."""
    frame, orbit = system.frame, system.orbit
    if frame.kind == "spinning":
        return float(np.linalg.norm(frame.rate))
    return orbit.mean_motion if orbit is not None and frame.kind == "orbital" else 0.0
