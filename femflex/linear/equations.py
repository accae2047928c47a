"""The equations of motion (9) about a state, from the compiled residual itself: M, D, K and the eigenvalues.

    M du' + D du + K dxi + R dz = 0,    dxi' = du + W dxi,    dz' = F_x dxi + F_u du + F_z dz

dxi (n_u,) are increments of the coordinates along the quasi-velocities, q -> q o exp(dxi); W turns them with the
quasi-velocities of balls. D holds damping and gyroscopic forces; K elastic, load, centrifugal and gravity stiffness.
The states z are those of effectors (`femflex.linear.states`).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from femflex.arrays import Array, ComplexArray, IntArray
from femflex.body import StrainTensors
from femflex.dynamics.joints.places import body_places
from femflex.dynamics.layout.records import BALL_NONE, body_records
from femflex.dynamics.motion.freedoms import (
    free_directions,
    is_prescribed,
    least_multipliers,
    refuse_rolling,
    slack_of_loops,
    usual_sizes,
)
from femflex.dynamics.motion.increments import displaced, jacobian
from femflex.dynamics.motion.linear_stiffness import linear_stiffness, rounding_forces
from femflex.linear.states import NARROW, STEP, StateEquations, state_equations

if TYPE_CHECKING:
    from femflex.dynamics.model import Model


@dataclass(frozen=True, eq=False)
class Linearised:
    """Linear equations about a state, over the n freedoms that are not prescribed and do not follow through loops.

    M, D, K, W  (n, n)
    names   of the rates of these freedoms;  free (n,) their places among all;  Z (n_u, n) the motion of all with them
    states  the m states of effectors
    """

    M: Array
    D: Array
    K: Array
    W: Array
    names: tuple[str, ...]
    free: IntArray
    Z: Array
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
    model = model.with_linear_effectors
    u = model.parts(x)[1]
    refuse_rolling(model.system, "linear equations")
    if model.system.loops and (u.any() or accelerations.any()):
        raise ValueError(
            f"the loops {[loop.label for loop in model.system.loops]} are in motion, and linear equations of loops "
            "are those about rest; take a state of rest, or let the base frame spin ([attitude] frame = 'spinning')"
        )

    def residual_at_rates(du: Array) -> Array:
        return model.residual(t, displaced(model, x, du=du), accelerations)

    M, K = model.mass_matrix(t, x), stiffness(model, t, x, accelerations)
    fastest = max(1.0, float(np.abs(u).max(initial=0.0)))  # inertia is of second degree in u: exact by long steps
    D = jacobian(residual_at_rates, np.full(model.n_u, fastest), rounding_forces(model, t, x, accelerations))
    free, Z = free_directions(model, t, x)
    names = [name for name, _ in model.system.velocity_names()]
    return Linearised(
        M=Z.T @ M @ Z,
        D=Z.T @ D @ Z,
        K=Z.T @ K @ Z,
        W=ball_rotation_rates(model, u)[np.ix_(free, free)],
        names=tuple(names[k] for k in free),
        free=free,
        Z=Z,
        states=state_equations(model, t, x, accelerations).in_directions(Z),
    )


def multipliers(model: Model, t: float, x: Array) -> Array:
    """Return the multipliers (n_rows,) [N, N m] of the loops of a system at rest at x; none for a tree."""
    if model.constraints is None:
        return np.zeros(0)
    ties, force = model.constraints.matrix(t, x), model.bias(t, x)
    prescribed = is_prescribed(model, x)
    return least_multipliers(
        np.where(prescribed, 0.0, ties), np.where(prescribed, 0.0, force), slack_of_loops(model.system)
    )


def stiffness(model: Model, t: float, x: Array, udot: Array, lambdas: Array | None = None) -> Array:
    """K (n_u, n_u) [SI]: derivative of the residual by increments of coordinates, at constant multipliers (n_rows,).

    lambdas: those at rest when left out
    """
    q, lambdas = model.parts(x)[0], multipliers(model, t, x) if lambdas is None else lambdas
    K, columns = linear_stiffness(model)
    has_column = columns >= 0
    stretched = [(strain, e, qe, strain.force(q[qe])) for strain, e, qe in nonlinear_bodies(model)]

    def nonlinear_residual(dxi: Array) -> Array:
        y = displaced(model, x, dxi)
        constraint_forces = lambdas @ model.constraints.matrix(t, y) if model.constraints is not None else 0.0
        change = np.where(has_column, y[columns] - q[columns], 0.0)
        residual = model.residual(t, y, udot) - constraint_forces - K @ change
        for strain, e, qe, force in stretched:
            unchanged = np.array_equal(y[qe], q[qe])  # most steps move other bodies
            residual[e] -= (force if unchanged else strain.force(y[qe])) - strain.V1 @ y[qe]
        return residual

    K = K + jacobian(nonlinear_residual, STEP * usual_sizes(model), rounding_forces(model, t, x, udot), NARROW)
    for strain, e, qe, _ in stretched:  # differences would be those of fast powers: EA against a string's tension
        K[np.ix_(e, e)] += strain.tangent(q[qe]) - (strain.V1 + strain.V1.T) / 2
    return K


def nonlinear_bodies(model: Model) -> list[tuple[StrainTensors, IntArray, IntArray]]:
    """Strain tensors of bodies whose strain is not linear, and places (n,) of their coordinates in u and in q.

    None of bodies whose stiffness varies.
    """
    return [
        (place.body.strain, place.shapes_u, place.shapes_q)
        for place in body_places(model.system)
        if not place.body.strain.is_linear and place.name not in model.system.varying
    ]


def ball_rotation_rates(model: Model, u: Array) -> Array:
    """W (n_u, n_u) [rad/s]: -skew(omega) for every ball that turns at omega, zero elsewhere."""
    W = np.zeros((model.n_u, model.n_u))
    for record in body_records(model.table)[1:]:
        if record["ball"] != BALL_NONE:
            first = int(record["u"]) + int(record["n_slide"])
            x, y, z = u[first : first + 3]
            W[first : first + 3, first : first + 3] = [[0, z, -y], [-z, 0, x], [y, -x, 0]]
    return W
