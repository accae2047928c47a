"""The equations of motion (9) about a state, from the compiled residual itself: M, D, K and the eigenvalues.

    M du' + D du + K dxi = 0,    dxi' = du + W dxi

dxi (n_u,) are increments of the coordinates along the quasi-velocities, q -> q o exp(dxi); W turns them with the
quasi-velocities of balls. D holds damping and gyroscopic forces; K elastic, load, centrifugal and gravity stiffness.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from femflex.body import FlexibleBody, StrainTensors
from femflex.dynamics.equilibria.closed_motion import (
    independent_coordinates,
    least_multipliers,
    refuse_rolling,
    slack_of_loops,
)
from femflex.dynamics.equilibria.states import StateEquations, state_equations
from femflex.dynamics.lowering.layout import BALL_NONE, body_records
from femflex.dynamics.model import Model
from femflex.system import System

Array = NDArray[np.float64]

STEP = 1e-5  # of a coordinate's usual size: error of central differences h^2 ~ 1e-10, rounding eps / h ~ 1e-11
SHORT = 1e-6  # of a long step of a velocity: rounding 1e-10 of the forces
DIFFERS = 1e-8  # of the forces: difference of the derivatives of long and of short steps that is no rounding


@dataclass(frozen=True, eq=False)
class Linearised:
    """Linear equations about a state: M, D, K, W (n, n) of the freedoms that are not held; their names.

    states  the m states of effectors in addition (see femflex.dynamics.equilibria.states)


    With loops n counts the independent ones, which the others follow (see femflex.dynamics.equilibria.closed_motion).
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

    def eigenvalues(self) -> NDArray[np.complex128]:
        """Eigenvalues (2 n + m,) of the state matrix [1/s], by rising size."""
        found = np.asarray(np.linalg.eigvals(self.state_matrix()), complex)
        return found[np.argsort(np.abs(found), kind="stable")]


def linearised(model: Model, t: float, x: Array, udot: Array | None = None) -> Linearised:
    """The linear equations about the state x (n_x,) at t with accelerations udot (n_u,), zero when left out.

    M is exact, and D is exact but for effectors and laws of joints (see `derivative_by_velocities`). K is that of
    shapes, their nonlinear strain included, and of springs exactly, plus central differences of the rest. With loops K
    holds the stiffness that
    their forces add as they turn along, and the state must be at rest. Raises ValueError for nonholonomic constraints,
    and for loops in motion.
    """
    accelerations = np.zeros(model.n_u) if udot is None else np.asarray(udot, float)
    q, u, z = model.parts(x)
    refuse_rolling(model.system, "linear equations")
    if model.system.loops and (u.any() or accelerations.any()):
        raise ValueError(
            f"the loops {[loop.label for loop in model.system.loops]} are in motion, and linear equations of loops "
            "are those about rest; take a state of rest, or let the base frame spin ([attitude] frame = 'spinning')"
        )

    def residual(u: Array) -> Array:
        return model.residual(t, np.concatenate([q, u, z]), accelerations)

    D = derivative_by_velocities(residual, u)
    K = stiffness(model, t, x, accelerations, multipliers(model, t, x))
    own, Z = free_directions(model, t, x)
    states = state_equations(model, t, x, accelerations, steps(model, q)).along(Z)
    M, D, K = (Z.T @ A @ Z for A in (model.mass_matrix(t, x), D, K))
    names = [name for name, _ in model.system.velocity_names()]
    return Linearised(M, D, K, turning(model, u)[np.ix_(own, own)], tuple(names[k] for k in own), states)


def derivative_by_velocities(residual: Callable[[Array], Array], u: Array) -> Array:
    """D (n, n): derivative of a residual (n,) by velocities u (n,).

    Inertia is of second degree in u, whose derivative long steps give to rounding. Friction, dampers by table, cables
    and other effectors are not: where short steps give another derivative, it is theirs.
    """
    out = np.empty((len(u), len(u)))
    size = max(1.0, float(np.abs(u).max(initial=0.0)))
    for j, e in enumerate(np.eye(len(u)) * size):
        ahead, behind = residual(u + e), residual(u - e)
        far, near = ahead - behind, (residual(u + SHORT * e) - residual(u - SHORT * e)) / SHORT
        forces = max(np.abs(ahead).max(), np.abs(behind).max())
        out[:, j] = np.where(np.abs(near - far) > DIFFERS * forces, near, far) / (2 * size)
    return out


def free_directions(model: Model, t: float, x: Array) -> tuple[NDArray[np.int64], Array]:
    """Freedoms (m,) that are neither held nor follow others through loops, and how all move with them, (n_u, m)."""
    free = np.flatnonzero(~held_freedoms(model))
    Z = np.eye(model.n_u)[:, free]
    if model.constraints is None:
        return free, Z
    own, following = independent_coordinates(
        model.constraints.matrix(t, x)[:, free], usual_sizes(model)[free], slack_of_loops(model.system)
    )
    return free[own], Z @ following


def held_freedoms(model: Model) -> NDArray[np.bool_]:
    """(n_u,): which freedoms are locked or prescribed."""
    held = np.zeros(model.n_u, bool)
    for name, record in zip(model.system.order, body_records(model.table)[1:], strict=True):
        held[[int(record["u"]) + k for k in model.system.joint_of(name).held]] = True
    return held


def multipliers(model: Model, t: float, x: Array) -> Array:
    """Multipliers (n_rows,) of the loops that hold a system at rest at x; none for a tree."""
    if model.constraints is None:
        return np.zeros(0)
    ties, force = model.constraints.matrix(t, x), model.bias(t, x)
    held = held_freedoms(model)
    return least_multipliers(np.where(held, 0.0, ties), np.where(held, 0.0, force), slack_of_loops(model.system))


def stiffness(model: Model, t: float, x: Array, udot: Array, lambdas: Array) -> Array:
    """K (n_u, n_u): derivative of the residual by increments of the coordinates, at constant multipliers (n_rows,)."""
    q, u, z = model.parts(x)
    K, at = linear_stiffness(model)
    own = at >= 0
    stretched = [(strain, e, qe, strain.force(q[qe])) for strain, e, qe in nonlinear_bodies(model)]

    def other(moved: Array) -> Array:
        change, y = np.where(own, moved[at] - q[at], 0.0), np.concatenate([moved, u, z])
        tied = lambdas @ model.constraints.matrix(t, y) if model.constraints is not None else 0.0
        left = model.residual(t, y, udot) - tied - K @ change
        for strain, e, qe, force in stretched:
            same = np.array_equal(moved[qe], q[qe])  # most steps move other bodies
            left[e] -= (force if same else strain.force(moved[qe])) - strain.V1 @ moved[qe]
        return left

    columns = []
    for j, size in enumerate(usual_sizes(model)):
        step = np.zeros(model.n_u)
        step[j] = STEP * size
        columns.append((other(advanced(model, q, step)) - other(advanced(model, q, -step))) / (2 * step[j]))
    K = K + np.column_stack(columns)
    for strain, e, qe, _ in stretched:  # differences would be those of fast powers: EA against a string's tension
        K[np.ix_(e, e)] += strain.tangent(q[qe]) - (strain.V1 + strain.V1.T) / 2
    return K


def nonlinear_bodies(model: Model) -> list[tuple[StrainTensors, NDArray[np.int64], NDArray[np.int64]]]:
    """Strain tensors of bodies whose strain is not linear, and places (n,) of their coordinates in u and in q.

    None of bodies whose stiffness varies.
    """
    found = []
    for name, record in zip(model.system.order, body_records(model.table)[1:], strict=True):
        body = model.system.bodies[name]
        if not body.strain.is_linear and name not in model.system.varying:
            every = np.arange(body.n_modes)
            found.append((body.strain, int(record["ue"]) + every, int(record["qe"]) + every))
    return found


def steps(model: Model, q: Array) -> list[tuple[Array, float]]:
    """For every coordinate its places (2, n_q) after a step along it and after one back, and the step's size."""
    found = []
    for j, size in enumerate(usual_sizes(model)):
        step = np.zeros(model.n_u)
        step[j] = STEP * size
        found.append((np.array([advanced(model, q, step), advanced(model, q, -step)]), float(step[j])))
    return found


def linear_stiffness(model: Model) -> tuple[Array, NDArray[np.int64]]:
    """Stiffness (n_u, n_u) of shapes and of springs on slides and turns, and which coordinate each column multiplies.

    Columns of balls have no such coordinate (-1) and are zero.
    """
    system = model.system
    K, at = np.zeros((model.n_u, model.n_u)), np.full(model.n_u, -1, np.int64)
    for name, record in zip(system.order, body_records(model.table)[1:], strict=True):
        joint, body = system.joint_of(name), system.bodies[name]
        plain = len(joint.translations) + (len(joint.rotations) if record["ball"] == BALL_NONE else 0)
        u, q = int(record["u"]) + np.arange(plain), int(record["q"]) + np.arange(plain)
        K[u, u], at[u] = joint.stiffness[:plain], q
        e = int(record["ue"]) + np.arange(body.n_modes)
        K[np.ix_(e, e)] = (body.strain.V1 + body.strain.V1.T) / 2
        at[e] = int(record["qe"]) + np.arange(body.n_modes)
    return K, at


def advanced(model: Model, q: Array, increment: Array) -> Array:
    """q o exp(increment): the coordinates (n_q,) after an increment (n_u,) along the quasi-velocities."""
    out = np.array(q, float)
    model.tree.advance(
        np.ascontiguousarray(q), np.ascontiguousarray(increment), out, model.table, model.pool, model.work
    )
    return out


def turning(model: Model, u: Array) -> Array:
    """W (n_u, n_u): -skew(omega) for every ball that turns at omega, zero elsewhere."""
    W = np.zeros((model.n_u, model.n_u))
    for record in body_records(model.table)[1:]:
        if record["ball"] != BALL_NONE:
            at = int(record["u"]) + int(record["n_slide"])
            x, y, z = u[at : at + 3]
            W[at : at + 3, at : at + 3] = [[0, z, -y], [-z, 0, x], [y, -x, 0]]
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
                reach = max(reach, float(np.linalg.norm(body.skin.shapes[k], axis=1).max()) / spans[name])
            still = 1.0 / (spans[name] * np.sqrt(body.moments.mass))  # a shape that moves no marker, of a body undrawn
            sizes[int(record["ue"]) + k] = 1.0 / (max(reach, turn) or still)
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
