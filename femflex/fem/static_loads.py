"""Static loads on the points of a mesh, and those that are equivalent to loads spread over cells."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from functools import cache

import numpy as np
from numpy.typing import ArrayLike

from femflex.arrays import Array, IntArray
from femflex.mesh.cells import CELL_TYPES
from femflex.mesh.quality import quadrature

POINTS = 3  # Gauss points of a cell per direction: exact for a linear load on flat cells of second order


@dataclass(frozen=True, eq=False)
class StaticLoads:
    """Loads that keep their direction: forces and torques at points of a mesh, and a force per mass of all of it.

    points        (k,)    numbers of points, which may repeat
    forces        (k, 3)  [N]
    torques       (k, 3)  [N m]
    acceleration  (3,)    force per mass [m/s^2]
    """

    points: IntArray
    forces: Array
    torques: Array
    acceleration: Array = field(default_factory=lambda: np.zeros(3))

    @classmethod
    def at_points(
        cls, points: Sequence[int] | IntArray, forces: ArrayLike = 0.0, torques: ArrayLike = 0.0
    ) -> StaticLoads:
        """Forces [N] and torques [N m], each (k, 3) or (3,) for all, at points."""
        vectors = [np.broadcast_to(np.asarray(value, float), (len(points), 3)) for value in (forces, torques)]
        return cls(np.array(points, np.int64), *vectors)

    @classmethod
    def weight(cls, acceleration: ArrayLike) -> StaticLoads:
        """A force per mass (3,) [m/s^2]."""
        return cls(np.zeros(0, np.int64), np.zeros((0, 3)), np.zeros((0, 3)), np.asarray(acceleration, float))

    @classmethod
    def on_cell(cls, kind: str, nodes: Sequence[int], x: Array, load: ArrayLike) -> StaticLoads:
        """The forces at the nodes of a cell, at x (n, 3) [m], that do the work of a load between them.

        load: at the corners, between which it is linear. (c,): pressures along the normal of a surface [Pa]; (c, 3):
        forces per length, area or volume.
        """
        N, corner_N, dN, weight = _at_gauss_points(kind)
        tangents = dN @ x
        f = corner_N @ np.asarray(load, float)
        if f.ndim == 1:
            a, b = tangents[:, 0], tangents[:, 1]  # np.cross of a few pairs takes five times as long
            dF = f[:, None] * (a[:, [1, 2, 0]] * b[:, [2, 0, 1]] - a[:, [2, 0, 1]] * b[:, [1, 2, 0]])
        else:
            dF = f * np.sqrt(np.linalg.det(tangents @ tangents.swapaxes(1, 2)))[:, None]
        forces = N.T @ (weight[:, None] * dF)
        return cls(np.array(nodes, np.int64), forces, np.zeros_like(forces))

    @classmethod
    def on_beam(cls, ends: Sequence[int], x: Array, force_per_length: Array) -> StaticLoads:
        """The forces and moments at the ends of a beam, at x (2, 3) [m], that do the work of an even load (3,) [N/m].

        With q across the length L these are q L / 2 and q L^2 / 12.
        """
        span = x[1] - x[0]
        length = float(np.linalg.norm(span))
        moment = np.cross(span, force_per_length) * length / 12
        return cls.at_points(ends, force_per_length * length / 2, np.stack([moment, -moment]))

    @classmethod
    def combined(cls, parts: Iterable[tuple[float, StaticLoads]]) -> StaticLoads:
        """The sum of loads, each times its factor."""
        used = list(parts)
        if len(used) == 1 and used[0][0] == 1.0:
            return used[0][1]
        return cls(
            np.concatenate([loads.points for _, loads in used]),
            np.concatenate([factor * loads.forces for factor, loads in used]),
            np.concatenate([factor * loads.torques for factor, loads in used]),
            np.sum([factor * loads.acceleration for factor, loads in used], axis=0),
        )

    def resultant(self, points: Array) -> tuple[Array, Array]:
        """Force (3,) [N] and moment about the origin (3,) [N m], without the force per mass; points (n, 3) [m]."""
        moments = np.cross(points[self.points], self.forces) + self.torques
        return self.forces.sum(axis=0), moments.sum(axis=0)


@cache
def _at_gauss_points(kind: str) -> tuple[Array, Array, Array, Array]:
    """Shape functions (q, n) of the cell and of its corners, derivatives (q, d, n), and weights at the Gauss points."""
    cell = CELL_TYPES[kind]
    at, weight = quadrature(cell.shape, POINTS)
    dN = np.ascontiguousarray(cell.gradients(at).swapaxes(1, 2))
    return cell.interpolation(at), CELL_TYPES[cell.corner].interpolation(at), dN, weight
