"""Power of changes inside one body: moving material, stiffness, arriving mass (see `variations`).

All vectors in body components. y = (1, delta) and its rates are those of the body's shapes.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from femflex.arrays import Array
from femflex.kernels.lanes import padded
from femflex.system.variation import RATES


@dataclass(frozen=True, eq=False)
class BodyMotion:
    """Motion of a body at an instant: that of its origin and of its shapes.

    v, a          (3,) velocity of its origin, and acceleration less gravity there
    omega, alpha  (3,) rate and angular acceleration
    gradient      (3, 3) F: gravity is less by F r at the place r from the origin
    y, dy, ddy    (1 + n,) amplitudes (1, delta) and their rates
    """

    v: Array
    a: Array
    omega: Array
    alpha: Array
    gradient: Array
    y: Array
    dy: Array
    ddy: Array


def flow_power(record: np.void, pool: Array, m: BodyMotion) -> float:
    """int w . (a - f) dm of moving material [W], with d/dt int w.w/2 dm as the rates of `speed` say."""
    return (
        moving_power(record, pool, m) + speed_form(record, pool, m.y, 2.0 * m.dy) + half_speed_rate(record, pool, m.y)
    )


def moving_power(record: np.void, pool: Array, m: BodyMotion) -> float:
    """int w . (a - f) dm with the part of a that is not the material's own, 2 dw/d(delta) ddelta + zddot_A y_A."""
    n, wide = int(record["n_shapes"]), int(record["wide"])

    def rows(key: str, *shape: int) -> Array:
        return _rows(pool, int(record[key]), n, wide, *shape)

    r = pool[int(record["rates"]) : int(record["rates"]) + RATES]
    drift = r[0:3] + rows("drifts", 3) @ m.y[1:]
    Z = np.einsum("Back,B->ack", rows("flow", 1 + n, 3, 3), m.y)  # int phi_k w^T dm
    flow = r[6:15].reshape(3, 3) + np.einsum("ack,k->ac", rows("flow0", 3, 3) + Z, m.y[1:])  # int r w^T dm
    W = np.outer(m.omega, m.omega) - m.omega @ m.omega * np.eye(3) + m.gradient
    power = drift @ m.a + m.alpha @ _twist(flow) + np.sum(W * flow.T)
    return float(power + 2.0 * m.omega @ _twist(Z @ m.dy[1:]) + np.einsum("aak,k->", Z, m.ddy[1:]))


def speed_form(record: np.void, pool: Array, left: Array, right: Array) -> float:
    """left . speed . right over A = (rho, shapes), (1 + n,) each."""
    zero = pool[int(record["rates"]) + RATES - 2]
    return shape_form(int(record["speeds"]), zero, int(record["n_shapes"]), pool, left, right)


def half_speed_rate(record: np.void, pool: Array, y: Array) -> float:
    """Half of y . (rate of speed) . y."""
    n, wide, zero = int(record["n_shapes"]), int(record["wide"]), pool[int(record["rates"]) + RATES - 1]
    start = int(record["speeds"]) + padded((1 + n) * wide)
    return 0.5 * shape_form(start, zero, n, pool, y, y)


def shape_form(start: int, zero: float, n: int, pool: Array, left: Array, right: Array) -> float:
    """left . S . right of a symmetric S over (rho, shapes) without its first column, and that with rho apart."""
    S = _rows(pool, start, n, padded(n), 1 + n)
    return float(left @ S @ right[1:] + left[1:] @ S[0] * right[0] + zero * left[0] * right[0])


def growth_power(start: int, n: int, pool: Array, m: BodyMotion) -> tuple[float, float, Array]:
    """Half of int v.v over the mass that arrives in a unit of time [W], and that mass and its first moment (3,)."""
    wide = padded(n)
    first, second = start + padded(13), start + padded(13) + padded(3 * wide)
    mass, s0, Q0 = pool[start], pool[start + 1 : start + 4], pool[start + 4 : start + 13].reshape(3, 3)
    s_k = _rows(pool, first, n, wide, 3)
    P = np.einsum("Aack,A->ack", _rows(pool, second, n, wide, 1 + n, 3, 3), m.y)  # int r_a phi_kc dm
    P0 = _rows(pool, second, n, wide, 1 + n, 3, 3)
    s = s0 + s_k @ m.y[1:]
    Q = Q0 + np.einsum("ack,k->ac", P + P0[0].swapaxes(0, 1), m.y[1:])
    ds = s_k @ m.dy[1:]
    Me = np.einsum("jaak->jk", P0[1:])
    J_omega = np.trace(Q) * m.omega - Q @ m.omega
    power = 0.5 * mass * m.v @ m.v + m.v @ (np.cross(m.omega, s) + ds) + 0.5 * m.omega @ J_omega
    power += m.omega @ _twist(P @ m.dy[1:]) + 0.5 * m.dy[1:] @ Me @ m.dy[1:]
    return float(power), float(mass), s


def stiffness_power(start: int, place_f0: int, n: int, pool: Array, delta: Array) -> float:
    """dV1/dt and df0/dt at a fixed shape: df0.delta + delta.dV1 delta / 2 [W]."""
    row = padded(n)
    return float(delta @ (pool[place_f0 : place_f0 + n] + 0.5 * _rows(pool, start, n, row, n) @ delta))


def strain_power(start: int, n: int, n_blocks: int, columns: int, pool: Array, delta: Array) -> float:
    """Energy of the table of the rates of V2 and V3 at a fixed shape [W]."""
    i, j = np.triu_indices(n)
    pairs = len(i)
    table = pool[start : start + n_blocks * (n + pairs) * columns].reshape(n_blocks, n + pairs, columns)
    packed = table.swapaxes(0, 1).reshape(n + pairs, -1)[:, :pairs]
    monomials = np.concatenate([2.0 * delta, delta[i] * delta[j]])
    weights = np.where(i == j, 0.5, 1.0) * delta[i] * delta[j]
    return float(monomials @ packed @ weights)


def _rows(pool: Array, start: int, n: int, wide: int, *shape: int) -> Array:
    """Return rows over n shapes, (*shape, n), that lie `wide` apart."""
    count = int(np.prod(shape)) * wide
    return pool[start : start + count].reshape(*shape, wide)[..., :n]


def _twist(m: Array) -> Any:
    return np.array([m[1, 2] - m[2, 1], m[2, 0] - m[0, 2], m[0, 1] - m[1, 0]])
