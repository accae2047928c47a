"""Small compiled models with known motions, for the tests of the integrators."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cache
from typing import Any

import numpy as np
from numba import njit

from femflex.arrays import Array, IntArray
from femflex.integrate.protocol import CORRECT, KINEMATIC, RATE


@dataclass(frozen=True, eq=False)
class Second:
    """Second-order calls by hand."""

    n_q: int
    n_u: int
    correct: Callable[..., Any]
    kinematic: Callable[..., Any]


@cache
def correcting(residual: Callable[..., Any], solve: Callable[..., Any]) -> Callable[..., Any]:
    """Newton's correction from a residual and the solution with c_mass M + c_damp D + c_stiff K."""

    @njit(CORRECT)
    def correct(t, q, u, udot, out, c_damp, c_stiff, table, pool, work):
        right = np.empty(u.size)
        residual(t, q, u, udot, right, table, pool, work)
        for i in range(u.size):
            right[i] = -right[i]
        solve(t, q, right, out, 1.0, c_damp, c_stiff, table, pool, work)

    return correct


@dataclass(frozen=True, eq=False)
class Compiled:
    """A model by hand: its rate, its numbers, and where it is not smooth."""

    n_x: int
    rate: Callable[..., Any]
    pool: Array = field(default_factory=lambda: np.zeros(1))
    table: IntArray = field(default_factory=lambda: np.zeros(1, np.int64))
    work: Array = field(default_factory=lambda: np.zeros(1))
    renormalise: IntArray = field(default_factory=lambda: np.zeros(0, np.int64))
    breaks: Array = field(default_factory=lambda: np.zeros(0))
    switch: Callable[..., Any] | None = None
    project: Callable[..., Any] | None = None
    second_order: Second | None = None


@njit(RATE, cache=True)
def oscillator_rate(t, x, dxdt, table, pool, work):
    """x0'' = -pool[0]^2 x0."""
    dxdt[0] = x[1]
    dxdt[1] = -pool[0] * pool[0] * x[0]


def oscillator(omega: float = 1.0) -> Compiled:
    """Harmonic oscillator, x = (position, velocity)."""
    return Compiled(2, oscillator_rate, np.array([omega]))


@njit(RATE, cache=True)
def kepler_rate(t, x, dxdt, table, pool, work):
    """Planar two-body motion with unit gravitational constant, x = (position, velocity)."""
    cube = (x[0] ** 2 + x[1] ** 2) ** 1.5
    dxdt[0], dxdt[1], dxdt[2], dxdt[3] = x[2], x[3], -x[0] / cube, -x[1] / cube


def kepler() -> Compiled:
    """Planar two-body motion; period 2 pi from perihelion (1 - e, 0) with speed sqrt((1 + e) / (1 - e))."""
    return Compiled(4, kepler_rate)


@njit(RATE, cache=True)
def duffing_rate(t, x, dxdt, table, pool, work):
    """x'' + x + pool[0] x^3 = 0."""
    dxdt[0] = x[1]
    dxdt[1] = -x[0] - pool[0] * x[0] ** 3


def duffing(cubic: float) -> Compiled:
    """Free Duffing oscillator; its motion is a Jacobi cn."""
    return Compiled(2, duffing_rate, np.array([cubic]))


@njit(RATE, cache=True)
def pulse_rate(t, x, dxdt, table, pool, work):
    """x'' = 1 between pool[0] and pool[1], and -3 x' after pool[1]: the rate jumps twice."""
    dxdt[0] = x[1]
    dxdt[1] = 1.0 if pool[0] <= t < pool[1] else (-3.0 * x[1] if t >= pool[1] else 0.0)


def pulse(on: float, off: float, known: bool = True) -> Compiled:
    """A mass pushed from `on` to `off` and braked after; it tells its breaks or keeps them to itself."""
    return Compiled(2, pulse_rate, np.array([on, off]), breaks=np.array([on, off] if known else []))


@njit(RATE, cache=True)
def failing_rate(t, x, dxdt, table, pool, work):
    """x' = 1 for all three; the middle one is not a number from pool[0] on."""
    dxdt[0] = 1.0
    dxdt[1] = 1.0 if t < pool[0] else np.nan
    dxdt[2] = x[1]


def failing(t: float) -> Compiled:
    """A model whose second coordinate fails at time t."""
    return Compiled(3, failing_rate, np.array([t]))


@njit(RATE, cache=True)
def explosion_rate(t, x, dxdt, table, pool, work):
    """x0' = 0, x1' = x1^2: x1 = 1 / (1 - t) from 1."""
    dxdt[0], dxdt[1] = 0.0, x[1] ** 2


def explosion() -> Compiled:
    """A motion that leaves all bounds at t = 1."""
    return Compiled(2, explosion_rate)


# A chain of n masses between walls, x = (q, u): springs k, dampers c, a cubic spring and a force on the last mass.
# table = (n,), pool = (cubic, force, frequency, masses n, springs n + 1, dampers n + 1), work = (2 n,) for elimination


@njit(inline="always")
def chain_stress(i, q, u, table, pool):
    """Tension of spring and damper i, between masses i - 1 and i."""
    n = table[0]
    stretch = (q[i] if i < n else 0.0) - (q[i - 1] if i > 0 else 0.0)
    speed = (u[i] if i < n else 0.0) - (u[i - 1] if i > 0 else 0.0)
    return pool[3 + n + i] * stretch + pool[4 + 2 * n + i] * speed


@njit
def chain_force(t, q, u, i, table, pool):
    """All force on mass i."""
    n = table[0]
    force = chain_stress(i + 1, q, u, table, pool) - chain_stress(i, q, u, table, pool)
    if i == n - 1:
        force += pool[1] * np.sin(pool[2] * t) - pool[0] * q[i] ** 3
    return force


@njit(RATE, cache=True)
def chain_rate(t, x, dxdt, table, pool, work):
    """First-order form of the chain."""
    n = table[0]
    for i in range(n):
        dxdt[i] = x[n + i]
        dxdt[n + i] = chain_force(t, x[:n], x[n:], i, table, pool) / pool[3 + i]


@njit
def chain_residual(t, q, u, udot, out, table, pool, work):
    """M udot - forces."""
    for i in range(table[0]):
        out[i] = pool[3 + i] * udot[i] - chain_force(t, q, u, i, table, pool)


@njit
def chain_solve(t, q, rhs, out, c_mass, c_damp, c_stiff, table, pool, work):
    """Elimination in the tridiagonal c_mass M + c_damp D + c_stiff K."""
    n = table[0]
    upper, pivot, above, before = work[:n], 0.0, 0.0, 0.0
    for i in range(n):
        left = c_stiff * pool[3 + n + i] + c_damp * pool[4 + 2 * n + i]
        right = c_stiff * pool[4 + n + i] + c_damp * pool[5 + 2 * n + i]
        pivot = c_mass * pool[3 + i] + left + right + (left * above if i > 0 else 0.0)
        upper[i] = -right / pivot
        out[i] = (rhs[i] + (left * before if i > 0 else 0.0)) / pivot
        above, before = upper[i], out[i]
    for i in range(n - 2, -1, -1):
        out[i] -= upper[i] * out[i + 1]


@njit(KINEMATIC, cache=True)
def plain_kinematic(t, q, u, qdot, table, pool, work):
    """qdot = u."""
    for i in range(q.size):
        qdot[i] = u[i]


def chain(
    masses: Array, springs: Array, dampers: Array | None = None, cubic: float = 0.0, force: float = 0.0, w: float = 1.0
) -> Compiled:
    """The chain of masses (n,), springs (n + 1,) and dampers (n + 1,), with force * sin(w t) on the last mass."""
    n = len(masses)
    dampers = np.zeros(n + 1) if dampers is None else dampers
    second = Second(n, n, correcting(chain_residual, chain_solve), plain_kinematic)
    pool = np.concatenate([[cubic, force, w], masses, springs, dampers])
    return Compiled(2 * n, chain_rate, pool, np.array([n]), np.zeros(2 * n), second_order=second)


def chain_matrices(model: Compiled) -> tuple[Array, Array, Array]:
    """Dense M, D, K of a chain, assembled spring by spring."""
    n = int(model.table[0])
    springs, dampers = model.pool[3 + n : 4 + 2 * n], model.pool[4 + 2 * n : 5 + 3 * n]
    difference = np.eye(n + 1, n) - np.eye(n + 1, n, -1)
    return np.diag(model.pool[3 : 3 + n]), *(difference.T @ np.diag(v) @ difference for v in (dampers, springs))


# A rigid body turning about its centre of mass, x = (Euler parameters, body rates); pool = (inertias 3, spring)
# The spring pulls the third body axis towards the third inertial axis with energy -spring * cosine.


@njit
def body_torque(q, u, i, pool):
    """Torque component i: of the spring, and -omega x J omega."""
    j, k = (i + 1) % 3, (i + 2) % 3
    length = q[0] ** 2 + q[1] ** 2 + q[2] ** 2 + q[3] ** 2
    up = (
        2.0 * (q[1] * q[3] - q[0] * q[2]) / length,
        2.0 * (q[2] * q[3] + q[0] * q[1]) / length,
        0.0,
    )  # third inertial axis in the body, first two components
    spring = pool[3] * (-up[1] if i == 0 else (up[0] if i == 1 else 0.0))
    return (pool[j] - pool[k]) * u[j] * u[k] + spring


@njit(KINEMATIC, cache=True)
def body_kinematic(t, q, u, qdot, table, pool, work):
    """Rates of the Euler parameters (scalar first) at body rates u."""
    qdot[0] = -0.5 * (q[1] * u[0] + q[2] * u[1] + q[3] * u[2])
    qdot[1] = 0.5 * (q[0] * u[0] - q[3] * u[1] + q[2] * u[2])
    qdot[2] = 0.5 * (q[3] * u[0] + q[0] * u[1] - q[1] * u[2])
    qdot[3] = 0.5 * (-q[2] * u[0] + q[1] * u[1] + q[0] * u[2])


@njit(RATE, cache=True)
def body_rate(t, x, dxdt, table, pool, work):
    """Kinematic equation and Euler's equations."""
    q, u = x[:4], x[4:]
    dxdt[0] = -0.5 * (q[1] * u[0] + q[2] * u[1] + q[3] * u[2])
    dxdt[1] = 0.5 * (q[0] * u[0] - q[3] * u[1] + q[2] * u[2])
    dxdt[2] = 0.5 * (q[3] * u[0] + q[0] * u[1] - q[1] * u[2])
    dxdt[3] = 0.5 * (-q[2] * u[0] + q[1] * u[1] + q[0] * u[2])
    for i in range(3):
        dxdt[4 + i] = body_torque(q, u, i, pool) / pool[i]


@njit
def body_residual(t, q, u, udot, out, table, pool, work):
    """J udot - torques."""
    for i in range(3):
        out[i] = pool[i] * udot[i] - body_torque(q, u, i, pool)


@njit
def body_solve(t, q, rhs, out, c_mass, c_damp, c_stiff, table, pool, work):
    """(c_mass J) out = rhs: the spring is left to Newton's iteration."""
    for i in range(3):
        out[i] = rhs[i] / (c_mass * pool[i])


def rigid_body(inertia: tuple[float, float, float] = (1.0, 2.0, 2.5), spring: float = 0.0) -> Compiled:
    """A rigid body that turns freely or under the spring; its Euler parameters are kept at unit length."""
    second = Second(4, 3, correcting(body_residual, body_solve), body_kinematic)
    return Compiled(7, body_rate, np.array([*inertia, spring]), renormalise=np.array([0]), second_order=second)


def quaternion_product(p: Array, q: Array) -> Array:
    """p q for scalar-first quaternions."""
    scalar = p[0] * q[0] - p[1:] @ q[1:]
    return np.concatenate([[scalar], p[0] * q[1:] + q[0] * p[1:] + np.cross(p[1:], q[1:])])


def quaternion_of_rotation(vector: Array) -> Array:
    """Quaternion of a rotation vector."""
    angle = np.linalg.norm(vector)
    return np.concatenate([[np.cos(angle / 2)], np.sin(angle / 2) * vector / angle])


def spun(model: Compiled, x0: Array, t: float) -> Array:
    """Exact state at t of a free rigid body with two equal inertias, from q0 = (1, 0, 0, 0).

    It turns about its angular momentum at |H| / I, and about its own axis of symmetry at the rest of its rate.
    """
    across, axial = model.pool[0], model.pool[2]
    spin = np.array([0, 0, x0[6] * (1 - axial / across)]) * t
    q = quaternion_product(quaternion_of_rotation(model.pool[:3] * x0[4:] / across * t), quaternion_of_rotation(spin))
    c, s = np.cos(spin[2]), np.sin(spin[2])
    return np.concatenate([q, [c * x0[4] + s * x0[5], c * x0[5] - s * x0[4], x0[6]]])


@njit
def free_residual(t, q, u, udot, out, table, pool, work):
    """udot - 1 from pool[0] on."""
    out[0] = udot[0] - (1.0 if t >= pool[0] else 0.0)


@njit
def free_solve(t, q, rhs, out, c_mass, c_damp, c_stiff, table, pool, work):
    """A unit mass."""
    out[0] = rhs[0] / c_mass


@njit(KINEMATIC, cache=True)
def free_kinematic(t, q, u, qdot, table, pool, work):
    """qdot = u."""
    qdot[0] = u[0]


@njit
def contrary_solve(t, q, rhs, out, c_mass, c_damp, c_stiff, table, pool, work):
    """A solve with the wrong sign."""
    for i in range(out.size):
        out[i] = -rhs[i] / c_mass
