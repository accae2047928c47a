"""Strain at the points of a skin, from the points inside the elements at which the field of a body is known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy import sparse
from scipy.spatial import cKDTree

from femflex.arrays import Array, IntArray
from femflex.body.strain_field import StrainPart

NEAREST = {"line": 2, "plate": 4, "solid": 6}  # points that a place of the skin is coloured by
SHARPNESS = 0.02  # the nearer points weigh the more, the smaller this is
FLAT = 1e-9  # relative spread of an element's points along an axis below which they tell of no change along it
BEYOND = 1.5  # distances of two points on a line, up to which the line through them is carried on


def on_skin(part: StrainPart, points: Array) -> StrainPart:
    """The part at points (n, 3) [m] of a skin: its gradients there, from which strain and energy follow.

    Gradients, not strains or energies: through a single layer of solids these go as the square of the height. Along
    lines they are those on the line through the two nearest points; in plates and solids, of the plane that fits the
    points of the element best, at a point between several elements their mean.
    """
    means = carried(part, points)
    p = len(part.places)
    shape = part.rows.shape[1:]
    return replace(
        part,
        places=points,
        weight=np.zeros(len(points)),
        rows=(means @ part.rows.reshape(p, -1)).reshape(-1, *shape).astype(np.float32),
        elastic=_carried(means, part.elastic),
        stress=_carried(means, part.stress),
        lever=_carried(means, part.lever),
        fibres=_carried(means, part.fibres),
        plies=_carried(means, part.plies),
        per=1,
    )


def carried(part: StrainPart, points: Array) -> sparse.csr_array:
    """Weights (n, p) [1] that carry values at the points of a part to places on its skin."""
    return along_lines(part, points) if part.kind == "line" and len(part.places) > 1 else in_elements(part, points)


def along_lines(part: StrainPart, points: Array) -> sparse.csr_array:
    """Weights (n, p) [1] that carry values at a line's points linearly to points off the line."""
    _, near = cKDTree(part.places).query(points, k=[1, 2])
    near = np.asarray(near, np.int64)
    a, b = part.places[near[:, 0]], part.places[near[:, 1]]
    t = np.einsum("na,na->n", points - a, b - a) / np.einsum("na,na->n", b - a, b - a)
    t = np.clip(t, -BEYOND, 1.0)
    return _sparse(near, np.stack([1.0 - t, t], axis=1), len(part.places))


def in_elements(part: StrainPart, points: Array) -> sparse.csr_array:
    """Weights (n, p) [1] that carry values at the points of elements linearly to places on them."""
    k = min(NEAREST[part.kind], len(part.places))
    found = cKDTree(part.places).query(points, k=np.arange(1, k + 1))
    distance, near = np.asarray(found[0], float), np.asarray(found[1], np.int64)
    beyond = distance**2 - distance[:, :1] ** 2
    weight = 1.0 / (beyond + SHARPNESS * beyond[:, -1:] + 1e-300)
    weight /= weight.sum(axis=1, keepdims=True)
    if part.per == 1:
        return _sparse(near, weight, len(part.places))
    x = part.places.reshape(-1, part.per, 3)
    share = part.weight.reshape(-1, part.per)
    share = share / share.sum(axis=1, keepdims=True)
    middle = np.einsum("eq,eqa->ea", share, x)
    d = x - middle[:, None]
    slopes = np.einsum("eab,eqb,eq->eqa", np.linalg.pinv(_spread(share, d), FLAT, hermitian=True), d, share)
    total = sparse.csr_array((len(points), len(part.places)))
    for j in range(k):
        e = near[:, j] // part.per
        carried = share[e] + np.einsum("eqa,ea->eq", slopes[e], points - middle[e])
        at = e[:, None] * part.per + np.arange(part.per)
        total = total + _sparse(at, weight[:, j : j + 1] * carried, len(part.places))
    return total


def _spread(share: Array, d: Array) -> Array:
    return np.asarray(np.einsum("eq,eqa,eqb->eab", share, d, d))


def _sparse(columns: IntArray, values: Array, width: int) -> sparse.csr_array:
    n, k = columns.shape
    rows = np.repeat(np.arange(n), k)
    return sparse.csr_array((values.ravel(), (rows, columns.ravel())), shape=(n, width))


def _carried(means: sparse.csr_array, table: Array) -> Array:
    """A table of every point (p, ...), or of all (1, ...), or of none, at the places carried to."""
    if len(table) <= 1:
        return table
    return np.asarray((means @ table.reshape(len(table), -1)).reshape(-1, *table.shape[1:]))
