"""Bodies lowered to flat arrays: moments, stiffness, strain and followers."""

from __future__ import annotations

from dataclasses import dataclass
from weakref import WeakKeyDictionary

import numpy as np

from femflex.arrays import Array
from femflex.body import FlexibleBody
from femflex.dynamics.layout import records as at
from femflex.dynamics.layout.pool import Piece, Pool, Scratch
from femflex.kernels.lanes import padded
from femflex.system.variation import COLUMNS, strain_table

ROUNDING = 1e-12  # relative; an elastic mass or stiffness closer than this to its diagonal counts as diagonal


@dataclass(frozen=True)
class BodyNumbers:
    """Numbers of a body alone for its record and the pool, by the names of the record's fields."""

    pieces: dict[str, Piece]
    counts: dict[str, int]


LOWERED: WeakKeyDictionary[FlexibleBody, BodyNumbers] = WeakKeyDictionary()  # of bodies lowered before


def body_numbers(body: FlexibleBody) -> BodyNumbers:
    """The numbers of a body; of one and the same body, as in the members of a sweep, only once."""
    if body not in LOWERED:
        LOWERED[body] = _numbers(body)
    return LOWERED[body]


def lower_body(record: np.void, body: FlexibleBody, pool: Pool, scratch: Scratch) -> None:
    """Moments, stiffness and damping of a body, and its work arrays."""
    numbers = body_numbers(body)
    for key, count in numbers.counts.items():
        record[key] = count
    for key, piece in numbers.pieces.items():
        record[key] = pool.add(piece)
    row, wide = padded(body.n_modes), padded(body.n_shapes)
    if "curved" in numbers.pieces:
        take_monomials(record, scratch)
    record["work"] = scratch.take(at.W_FIXED)
    for key, size in (("delta", wide), ("ddelta", wide), ("pn", wide), ("accel", row), ("pivot", row)):
        record[key] = scratch.take(size)
    for key, size in (("Z", 9 * wide), ("G", 6 * row), ("N", 8 * row), ("border", row * record["stride"])):
        record[key] = scratch.take(size)
    take_slaves(record, scratch)


def _numbers(body: FlexibleBody) -> BodyNumbers:
    n, moments, P = body.n_modes, body.moments, body.moments.second
    row, wide = padded(n), padded(body.n_shapes)
    V1, damping = (body.strain.V1 + body.strain.V1.T) / 2, body.damping
    pieces = {
        "mass": Piece.from_values([moments.mass, *moments.first[0], *P[0, :, 0, :].ravel()]),
        "first": Piece.from_rows(moments.first[1:].T),
        "momentum": Piece.from_values(np.pad(moments.first[1:], ((0, wide - body.n_shapes), (0, 1)))),
        "second": Piece.from_rows(P[:, :, 1:, :].swapaxes(2, 3)),  # A a c k
    }
    P = P[1:, :, 1:, :]  # j b k c
    gyro = np.stack([P[:, b, :, c] - P[:, c, :, b] for b, c in ((1, 2), (2, 0), (0, 1))])  # a j k
    pieces["gyro"] = Piece.from_rows(gyro.swapaxes(0, 1))
    elastic_mass = moments.elastic_mass()
    pieces |= elastic_mass_pieces(elastic_mass, n)
    pieces |= {
        "stiffness": Piece.from_rows(V1),
        "damping": Piece.from_rows(damping.T),
        "own_stiffness": Piece.from_rows(np.diag(V1)),
        "own_damping": Piece.from_rows(np.diag(damping)),
        "f0": Piece.from_rows(body.strain.f0),
    }
    counts = {"n": n, "row": row, "stride": row + 8, "n_shapes": body.n_shapes, "wide": wide}
    counts["orthonormal"] = int(np.abs(elastic_mass[:n, :n] - np.eye(n)).max(initial=0.0) < ROUNDING)
    counts["diagonal"] = int(_is_diagonal(V1) and _is_diagonal(damping))
    strain, slaves = body.strain, body.slaves
    if not strain.is_linear and len(strain.f0):
        pieces["curved"] = Piece.from_values(strain_table(strain.V2, strain.V3, len(strain.f0)))
    if len(slaves):
        counts |= {"n_slaves": len(slaves), "dense": 1}
        pieces["slaves"] = Piece.from_rows((slaves + slaves.swapaxes(1, 2)) / 2)
    return BodyNumbers(pieces, counts)


def take_monomials(record: np.void, scratch: Scratch) -> None:
    """Reserve places in the work array for the monomials of nonlinear strain."""
    n = int(record["n"])
    pairs = n * (n + 1) // 2
    record["nonlinear"], record["n_blocks"] = 1, -(-pairs // COLUMNS)
    record["monomials"], record["varying"] = scratch.take(n + pairs), scratch.take(record["n_blocks"] * COLUMNS)


def take_slaves(record: np.void, scratch: Scratch) -> None:
    """Places in the work array of the slaved shapes of a condensed body; its elastic block changes with the motion."""
    if not record["n_slaves"]:
        return
    row, wide = record["row"], record["wide"]
    sizes = {"drift": wide, "tie": record["n_slaves"] * row, "pull": row, "columns": 6 * wide, "spread": 8 * wide}
    for key, size in sizes.items():
        record[key] = scratch.take(size)


def elastic_mass_pieces(elastic_mass: Array, n: int) -> dict[str, Piece]:
    """The elastic mass of all shapes, and the factors of that of the n coordinates."""
    C = np.linalg.cholesky(elastic_mass[:n, :n])
    return {
        "elastic_mass": Piece.from_rows(elastic_mass),
        "elastic_factor": Piece.from_rows(np.diag(C)[:, None] * C.T),  # U of Gauss's elimination
        "elastic_pivot": Piece.from_rows(1.0 / np.diag(C) ** 2),
    }


def _is_diagonal(a: Array) -> bool:
    remainder = a - np.diag(np.diag(a))
    return bool(np.abs(remainder).max(initial=0.0) <= ROUNDING * np.abs(a).max(initial=0.0))
