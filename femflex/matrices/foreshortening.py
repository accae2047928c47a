"""Estimated foreshortening of a body read from matrices, used to warn of geometric stiffness that it lacks."""

from __future__ import annotations

import numpy as np
from scipy import linalg

from femflex.arrays import Array
from femflex.body import FlexibleBody, Foreshortening

STATIONS = 60  # along the longest extent at most, over which the shape is averaged before its slope is taken


def estimated_foreshortening(body: FlexibleBody) -> Foreshortening | None:
    """Foreshortening of the lowest shape of a body, treated as a line along its longest extent; None if it has no skin.

    w(s) is the mean displacement [m] of the shape across the line e. theta(s) = -e int_0^s w'^2 ds divided by the
    shape's stiffness, with s from the origin of the body, where it is clamped. All points of the skin have equal mass.
    """
    n, skin = body.n_modes, body.skin
    if not n or skin is None or len(skin.points) < 2:
        return None
    V1, Me = (body.strain.V1 + body.strain.V1.T) / 2, body.moments.elastic_mass()[:n, :n]
    value, vectors = linalg.eigh(V1, Me, subset_by_index=[0, 0])
    if not value[0] > 0:
        return None
    x = np.asarray(skin.points, float)
    u = np.einsum("n,npa->pa", vectors[:, 0], np.asarray(skin.shapes)[:n])
    e = np.linalg.svd(x - x.mean(axis=0), full_matrices=False)[2][0]
    s = x @ e
    if not np.ptp(s) > 0:
        return None
    position = np.round((s - s.min()) / np.ptp(s) * STATIONS, 6)  # points of one section stay together
    station = np.unique(np.round(position).astype(int), return_inverse=True)[1]
    count = np.bincount(station)
    station_s = np.bincount(station, s) / count
    across = np.stack([np.bincount(station, u[:, a]) / count for a in range(3)], axis=1)
    across = across - np.outer(across @ e, e)
    # int w'^2 ds between stations
    slope_squared = np.linalg.norm(np.diff(across, axis=0), axis=1) ** 2 / np.diff(station_s)
    shortening = np.concatenate([[0.0], np.cumsum(slope_squared)]) / value[0]

    def theta(points: Array) -> Array:
        """theta (k, 3) [1/N] at points (k,) [m] along the line."""
        return np.asarray(
            -np.outer(np.interp(points, station_s, shortening) - np.interp(0.0, station_s, shortening), e)
        )

    share = body.moments.mass / len(x)
    z = np.column_stack([np.ones(len(x)), x])
    markers = {name: theta(np.array([marker.position @ e]))[0] for name, marker in body.markers.items()}
    return Foreshortening(share * z.T @ theta(s), markers)
