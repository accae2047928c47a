"""Steady loads on a structure in its own frame: weight, spin, gravity gradient, dead forces and attached masses."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy import sparse

from femflex.arrays import Array
from femflex.fem.assembly import ElementMatrices, assemble
from femflex.fem.structure import Structure
from femflex.fem.tables import InertiaBlock, element_chunks
from femflex.reduction.boundary.markers import marker_rows


@dataclass(frozen=True, eq=False)
class Preload:
    """Forces g + A (r - origin) per mass and dead forces, in the axes of the mesh; see its class methods.

    acceleration  (3,)    g [m/s^2], as gravity: the direction in which bodies fall
    gradient      (3, 3)  A [1/s^2]
    origin        (3,)    where the field of the gradient is zero [m]
    forces        group -> (3,) force at the mean place of its nodes, which keeps its direction [N]
    masses        group -> mass of bodies attached there, which the same field pulls [kg]
    """

    acceleration: ArrayLike = (0.0, 0.0, 0.0)
    gradient: ArrayLike = field(default_factory=lambda: np.zeros((3, 3)))
    origin: ArrayLike = (0.0, 0.0, 0.0)
    forces: Mapping[str, ArrayLike] = field(default_factory=dict)
    masses: Mapping[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for name, shape in (("acceleration", (3,)), ("gradient", (3, 3)), ("origin", (3,))):
            value = np.asarray(getattr(self, name), float)
            if value.shape != shape or not np.isfinite(value).all():
                raise ValueError(f"{name} of a preload is {value.tolist()}; give finite numbers of shape {shape}")
            object.__setattr__(self, name, value)

    @classmethod
    def weight(cls, acceleration: ArrayLike, **more: Any) -> Preload:
        """Uniform gravity g (3,) [m/s^2], and forces or masses."""
        return cls(acceleration=acceleration, **more)

    @classmethod
    def spin(cls, rate: ArrayLike, **more: Any) -> Preload:
        """Centrifugal field of a steady rate Om (3,) [rad/s] about an axis through the origin: |Om|^2 1 - Om Om^T."""
        w = np.asarray(rate, float)
        return cls(gradient=w @ w * np.eye(3) - np.outer(w, w), **more)

    @classmethod
    def orbit(cls, rate: float, vertical: ArrayLike, normal: ArrayLike, **more: Any) -> Preload:
        """Gravity gradient and centrifugal field at rest in the frame of a circular orbit: n^2 (3 v v^T - h h^T).

        rate n [rad/s]; vertical v and orbit normal h (3,), at right angles; the origin moves on the orbit.
        """
        v, h = (np.asarray(d, float) / np.linalg.norm(d) for d in (vertical, normal))
        if abs(v @ h) > 1e-6:
            raise ValueError(f"vertical {v.tolist()} and orbit normal {h.tolist()} are not at right angles")
        return cls(gradient=rate**2 * (3 * np.outer(v, v) - np.outer(h, h)), **more)


@dataclass(frozen=True, eq=False)
class Loads:
    """Loads on the dofs of a structure at displacements x: F + S x, with F (n_dof,) and symmetric S (n_dof, n_dof)."""

    F: Array
    S: sparse.csr_array

    def forces(self, x: Array) -> Array:
        """The loads (n_dof,) at displacements x (n_dof,) [m, rad]."""
        return np.asarray(self.F + self.S @ x)

    def work(self, x: Array) -> float:
        """Minus their potential [J] at x (n_dof,)."""
        return float(self.F @ x + x @ (self.S @ x) / 2)


def loads_of_preload(structure: Structure, preload: Preload) -> Loads:
    """The loads of a preload: F = int N^T (g + A rho) dm and S = int N^T A N dm, and those at groups."""
    A = np.asarray(preload.gradient)
    g = np.asarray(preload.acceleration) - A @ np.asarray(preload.origin)
    raw = np.zeros(structure.T.shape[0])
    parts = []
    for block in structure.inertia:
        l = block.dofs.shape[1]
        for chunk in element_chunks(len(block.dofs), 6 * block.dm.shape[1] * l):
            push = (block.rho[chunk] @ A.T + g) * block.dm[chunk][..., None]
            forces = np.einsum("eqal,eqa->el", shape_rows(block, chunk), push)
            raw += np.bincount(block.dofs[chunk].ravel(), forces.ravel(), len(raw))
        if A.any():
            parts.append(ElementMatrices(block.dofs, _FieldMatrices(block, A)))
    F, S = structure.T.T @ raw, assemble(parts, structure.T)
    for group, force in preload.forces.items():
        F = F + marker_rows(structure, group).translation.T @ np.asarray(force, float)
    for group, mass in preload.masses.items():
        rows = marker_rows(structure, group)
        F = F + rows.translation.T @ (mass * (g + A @ rows.position))
        S = S + rows.translation.T @ (sparse.csr_array(mass * A) @ rows.translation)
    return Loads(np.asarray(F), S.tocsr())


def shape_rows(block: InertiaBlock, elements: slice) -> Array:
    """Displacement of a block's points (e, q, 3, l) per raw dof of each element [m/m or m/rad]."""
    own: Any = block
    dofs = np.tile(np.arange(block.dofs.shape[1]), (len(block.dofs), 1))
    local = replace(own, map=replace(own.map, dofs=dofs)) if hasattr(own, "map") else replace(own, dofs=dofs)
    found = local.shapes(np.eye(dofs.shape[1]), elements)
    return np.broadcast_to(found, (len(dofs[elements]), *found.shape[1:]))


class _FieldMatrices:
    """Element matrices int N^T A N dm by slice of elements."""

    def __init__(self, block: InertiaBlock, A: Array) -> None:
        self._block, self._A = block, A

    def __call__(self, elements: slice) -> Array:
        block = self._block
        start, stop, _ = elements.indices(len(block.dofs))
        found = []
        for chunk in element_chunks(stop - start, 9 * block.dm.shape[1] * block.dofs.shape[1]):
            own = slice(start + chunk.start, start + chunk.stop)
            N = shape_rows(block, own)
            AN = np.matmul(self._A, N) * block.dm[own][..., None, None]
            e, l = len(N), N.shape[-1]
            found.append(np.matmul(N.reshape(e, -1, l).swapaxes(1, 2), AN.reshape(e, -1, l)))
        return np.concatenate(found)
