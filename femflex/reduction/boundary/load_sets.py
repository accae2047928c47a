"""Sets of static loads on the shapes of a body, each reduced to a few markers with the same work."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from femflex.arrays import Array
from femflex.body import LoadSet, Marker
from femflex.body.patches import patch_marker
from femflex.fem.static_loads import StaticLoads
from femflex.fem.structure import Structure

ROUNDING = 1e-12  # share of all forces, or torques, below which one is rounding


def add_load_sets(
    structure: Structure, phi: Array, sets: Mapping[str, StaticLoads]
) -> tuple[dict[str, LoadSet], dict[str, Marker]]:
    """The LoadSet of each set of static loads, and their markers on shapes phi (n_dof, n).

    The forces f_a along an axis a that have one sign act together at a marker, whose position and motion are their
    means with the weights |f_a|, and so do torques. Their resultant, moment and generalised force are exact:

        F = sum f,   M = sum (r + phi delta) x f + sum t,   Q = sum phi^T f + sum psi^T t

    Raises ValueError for forces at points that belong to no member.
    """
    load_sets: dict[str, LoadSet] = {}
    markers: dict[str, Marker] = {}
    for name, loads in sets.items():
        x = structure.mesh.points[loads.points]
        rows = (3 * loads.points[:, None] + np.arange(3)).ravel()
        u, theta = structure.translation[rows], structure.rotation[rows]
        still = np.diff(u.indptr).reshape(-1, 3).sum(axis=1) == 0
        if n_lost := np.count_nonzero(loads.forces[still].any(axis=1)):
            raise ValueError(
                f"{n_lost} forces of the set of loads {name!r} act on points that belong to no member; give their "
                "elements a family whose nodes move there"
            )
        phi_x, psi_x = (np.asarray(part @ phi).reshape(len(x), 3, phi.shape[1]) for part in (u, theta))
        zero = np.zeros((3, phi.shape[1]))
        at, vectors = [Marker(np.zeros(3), zero, zero)], [np.zeros((2, 3))]
        for axis, weight, total in _parts(loads.forces):
            at.append(Marker(weight @ x, np.tensordot(weight, phi_x, 1), zero))
            vectors.append(np.stack([total * np.eye(3)[axis], np.zeros(3)]))
        for axis, weight, total in _parts(loads.torques):
            at.append(Marker(weight @ x, zero, np.tensordot(weight, psi_x, 1)))
            vectors.append(np.stack([np.zeros(3), total * np.eye(3)[axis]]))
        names = tuple(patch_marker(name, k) for k in range(len(at)))
        forces, torques = np.stack(vectors, axis=1)
        load_sets[name] = LoadSet(names, forces, torques, loads.acceleration)
        markers |= dict(zip(names, at, strict=True))
    return load_sets, markers


def _parts(vectors: Array) -> list[tuple[int, Array, float]]:
    """Axis, weights (k,) whose sum is 1, and total of the components of vectors (k, 3) of either sign."""
    sizes = {(axis, sign): np.maximum(sign * vectors[:, axis], 0.0) for axis in range(3) for sign in (1.0, -1.0)}
    least = ROUNDING * np.abs(vectors).sum()
    return [
        (axis, size / size.sum(), sign * float(size.sum()))
        for (axis, sign), size in sizes.items()
        if size.sum() > least
    ]
