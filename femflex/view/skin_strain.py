"""Strain at the points of a skin, interpolated from the strain points inside the elements of a body."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy import sparse
from scipy.spatial import cKDTree

from femflex.arrays import Array, IntArray
from femflex.body.strain_field import StrainPart

NEAREST = {"line": 2, "plate": 4, "solid": 6}  # number of points that colour a point of the skin
SHARPNESS = 0.02  # a smaller value gives nearer points a larger weight
FLAT = 1e-9  # relative spread of an element's points along an axis below which there is no gradient along it
BEYOND = 1.5  # distances of two points on a line, up to which the line through them is extrapolated


def part_on_skin(field_part: StrainPart, points: Array) -> StrainPart:
    """The part at points (n, 3) [m] of a skin: its gradients there, from which strain and energy follow.

    Gradients are interpolated and not strains or energies, because the latter vary as the square of the height through
    a single layer of solids. Along lines the gradients are those on the line through the two nearest points. In plates
    and solids they are those of the plane that fits the points of the element best, and their mean at a point between
    several elements.
    """
    weights = skin_weights(field_part, points)
    p = len(field_part.places)
    shape = field_part.rows.shape[1:]
    return replace(
        field_part,
        places=points,
        weight=np.zeros(len(points)),
        rows=(weights @ field_part.rows.reshape(p, -1)).reshape(-1, *shape).astype(np.float32),
        elastic=_interpolated(weights, field_part.elastic),
        stress=_interpolated(weights, field_part.stress),
        lever=_interpolated(weights, field_part.lever),
        fibres=_interpolated(weights, field_part.fibres),
        plies=_interpolated(weights, field_part.plies),
        per=1,
    )


def skin_weights(field_part: StrainPart, points: Array) -> sparse.csr_array:
    """Interpolation weights (n, p) [1] from the points of a part to points on its skin."""
    return (
        line_weights(field_part, points)
        if field_part.kind == "line" and len(field_part.places) > 1
        else element_weights(field_part, points)
    )


def line_weights(field_part: StrainPart, points: Array) -> sparse.csr_array:
    """Weights (n, p) [1] of linear interpolation from a line's points to points off the line."""
    _, nearest = cKDTree(field_part.places).query(points, k=[1, 2])
    nearest = np.asarray(nearest, np.int64)
    a, b = field_part.places[nearest[:, 0]], field_part.places[nearest[:, 1]]
    t = np.einsum("na,na->n", points - a, b - a) / np.einsum("na,na->n", b - a, b - a)
    t = np.clip(t, -BEYOND, 1.0)
    return _sparse_rows(nearest, np.stack([1.0 - t, t], axis=1), len(field_part.places))


def element_weights(field_part: StrainPart, points: Array) -> sparse.csr_array:
    """Weights (n, p) [1] of linear interpolation from the points of elements to points on them."""
    k = min(NEAREST[field_part.kind], len(field_part.places))
    distances_and_indices = cKDTree(field_part.places).query(points, k=np.arange(1, k + 1))
    distance, nearest = np.asarray(distances_and_indices[0], float), np.asarray(distances_and_indices[1], np.int64)
    excess = distance**2 - distance[:, :1] ** 2
    weight = 1.0 / (excess + SHARPNESS * excess[:, -1:] + 1e-300)
    weight /= weight.sum(axis=1, keepdims=True)
    if field_part.per == 1:
        return _sparse_rows(nearest, weight, len(field_part.places))
    x = field_part.places.reshape(-1, field_part.per, 3)
    share = field_part.weight.reshape(-1, field_part.per)
    share = share / share.sum(axis=1, keepdims=True)
    middle = np.einsum("eq,eqa->ea", share, x)
    d = x - middle[:, None]
    slopes = np.einsum("eab,eqb,eq->eqa", np.linalg.pinv(_second_moments(share, d), FLAT, hermitian=True), d, share)
    total = sparse.csr_array((len(points), len(field_part.places)))
    for j in range(k):
        e = nearest[:, j] // field_part.per
        point_weights = share[e] + np.einsum("eqa,ea->eq", slopes[e], points - middle[e])
        columns = e[:, None] * field_part.per + np.arange(field_part.per)
        total = total + _sparse_rows(columns, weight[:, j : j + 1] * point_weights, len(field_part.places))
    return total


def _second_moments(share: Array, d: Array) -> Array:
    return np.asarray(np.einsum("eq,eqa,eqb->eab", share, d, d))


def _sparse_rows(columns: IntArray, values: Array, width: int) -> sparse.csr_array:
    n, k = columns.shape
    rows = np.repeat(np.arange(n), k)
    return sparse.csr_array((values.ravel(), (rows, columns.ravel())), shape=(n, width))


def _interpolated(weights: sparse.csr_array, table: Array) -> Array:
    """A table of every point (p, ...), interpolated; one common row (1, ...), or an empty table, is unchanged."""
    if len(table) <= 1:
        return table
    return np.asarray((weights @ table.reshape(len(table), -1)).reshape(-1, *table.shape[1:]))
