"""Bodies lowered to flat arrays: moments, stiffness, strain and what follows."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from femflex.body import FlexibleBody, StrainTensors
from femflex.dynamics.arithmetic.lanes import padded
from femflex.dynamics.lowering import layout as at
from femflex.dynamics.lowering.pool import Pool, Scratch
from femflex.system.variation import COLUMNS, strain_table

Array = NDArray[np.float64]

ROUNDING = 1e-12  # relative; an elastic mass or stiffness closer than this to its diagonal counts as diagonal


def lower_body(record: np.void, body: FlexibleBody, pool: Pool, scratch: Scratch) -> None:
    """Moments, stiffness and damping of a body, and its work arrays."""
    n, moments, P = body.n_modes, body.moments, body.moments.second
    row, wide = padded(n), padded(body.n_shapes)
    record["n"], record["row"], record["stride"] = n, row, row + 8
    record["n_shapes"], record["wide"] = body.n_shapes, wide
    record["mass"] = pool.put([moments.mass, *moments.first[0], *P[0, :, 0, :].ravel()])
    record["first"] = pool.put_rows(moments.first[1:].T)
    record["momentum"] = pool.put(np.pad(moments.first[1:], ((0, wide - body.n_shapes), (0, 1))))
    record["second"] = pool.put_rows(P[:, :, 1:, :].swapaxes(2, 3))  # A a c k
    P = P[1:, :, 1:, :]  # j b k c
    gyro = np.stack([P[:, b, :, c] - P[:, c, :, b] for b, c in ((1, 2), (2, 0), (0, 1))])  # a j k
    record["gyro"] = pool.put_rows(gyro.swapaxes(0, 1))
    lower_elastic_mass(record, moments.elastic_mass(), n, pool)
    V1 = (body.strain.V1 + body.strain.V1.T) / 2
    record["stiffness"], record["damping"] = pool.put_rows(V1), pool.put_rows(body.damping.T)
    record["own_stiffness"], record["own_damping"] = pool.put_rows(np.diag(V1)), pool.put_rows(np.diag(body.damping))
    record["f0"] = pool.put_rows(body.strain.f0)
    record["diagonal"] = int(_is_diagonal(V1) and _is_diagonal(body.damping))
    lower_curved_strain(record, body.strain, pool, scratch)
    record["work"] = scratch.take(at.W_FIXED)
    for key, size in (("delta", wide), ("ddelta", wide), ("pn", wide), ("accel", row), ("pivot", row)):
        record[key] = scratch.take(size)
    for key, size in (("Z", 9 * wide), ("G", 6 * row), ("N", 8 * row), ("border", row * record["stride"])):
        record[key] = scratch.take(size)
    lower_slaves(record, body.slaves, pool, scratch)


def lower_curved_strain(record: np.void, strain: StrainTensors, pool: Pool, scratch: Scratch) -> None:
    """V2 and V3 of a body with nonlinear strain."""
    if not strain.is_linear and len(strain.f0):
        record["curved"] = pool.put(strain_table(strain.V2, strain.V3, len(strain.f0)))
        take_monomials(record, scratch)


def take_monomials(record: np.void, scratch: Scratch) -> None:
    """Places in the work array of what nonlinear strain is summed up from."""
    n = int(record["n"])
    pairs = n * (n + 1) // 2
    record["nonlinear"], record["n_blocks"] = 1, -(-pairs // COLUMNS)
    record["monomials"], record["varying"] = scratch.take(n + pairs), scratch.take(record["n_blocks"] * COLUMNS)


def lower_slaves(record: np.void, slaves: Array, pool: Pool, scratch: Scratch) -> None:
    """How the slaved shapes of a condensed body follow; its elastic block changes with the motion."""
    if not len(slaves):
        return
    row, wide = record["row"], record["wide"]
    record["n_slaves"], record["dense"] = len(slaves), 1
    record["slaves"] = pool.put_rows((slaves + slaves.swapaxes(1, 2)) / 2)
    sizes = {"drift": wide, "tie": len(slaves) * row, "pull": row, "columns": 6 * wide, "spread": 8 * wide}
    for key, size in sizes.items():
        record[key] = scratch.take(size)


def lower_elastic_mass(record: np.void, elastic_mass: Array, n: int, pool: Pool) -> None:
    """The elastic mass of all shapes, and the factors of that of the n coordinates."""
    record["elastic_mass"] = pool.put_rows(elastic_mass)
    elastic_mass = elastic_mass[:n, :n]
    C = np.linalg.cholesky(elastic_mass)
    pivots = np.diag(C) ** 2
    record["elastic_factor"] = pool.put_rows(np.diag(C)[:, None] * C.T)  # U of Gauss's elimination
    record["elastic_pivot"] = pool.put_rows(1.0 / pivots)
    record["orthonormal"] = int(np.abs(elastic_mass - np.eye(n)).max(initial=0.0) < ROUNDING)


def _is_diagonal(a: Array) -> bool:
    off = a - np.diag(np.diag(a))
    return bool(np.abs(off).max(initial=0.0) <= ROUNDING * np.abs(a).max(initial=0.0))
