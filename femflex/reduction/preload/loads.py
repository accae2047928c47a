"""Steady loads on a structure in its own frame: weight, spin, gravity gradient, dead forces and attached masses."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Annotated, Any

import numpy as np
from pydantic import Field, model_validator
from scipy import sparse

from femflex.arrays import Array
from femflex.fem.assembly import ElementMatrices, assemble
from femflex.fem.structure import Structure
from femflex.fem.tables import InertiaBlock, element_chunks
from femflex.noun.table import Table, refuse
from femflex.noun.values import Axis, Mass, Position, Quantity, Rate, Rates, Vector
from femflex.reduction.boundary.markers import marker_rows

NO_RATE = "found no rate, and the case has no [orbit]; give one"


class OrbitField(Table):
    """Gravity gradient and centrifugal field at rest in the frame of a circular orbit."""

    vertical: Axis
    """Outward local vertical in the body frame."""
    normal: Axis
    """Orbit normal in the body frame, at right angles to the vertical."""
    rate: Rate | None = None
    """Orbital rate. Default: the mean motion of the case's orbit."""

    @model_validator(mode="after")
    def _at_right_angles(self) -> OrbitField:
        if abs(np.dot(self.vertical, self.normal)) > 1e-6:
            refuse(f"found vertical {self.vertical} and orbit normal {self.normal}, which are not at right angles")
        return self

    @property
    def gradient(self) -> Array:
        """n^2 (3 v v^T - h h^T) (3, 3) [1/s^2]. Raises ValueError without a rate."""
        if self.rate is None:
            raise ValueError(NO_RATE)
        return self.rate**2 * (3 * np.outer(self.vertical, self.vertical) - np.outer(self.normal, self.normal))


class Preload(Table):
    """Steady loads of the body's own static equilibrium, in the body frame."""

    acceleration: Annotated[Vector, Quantity("m/s^2", (3,))] = (0.0, 0.0, 0.0)
    """Gravity: the acceleration with which bodies fall."""
    spin: Rates | None = None
    """Steady angular rate, whose centrifugal field loads the body. Default: none."""
    orbit: OrbitField | None = None
    """Gravity gradient and centrifugal field of a circular orbit. Default: none."""
    origin: Position = (0.0, 0.0, 0.0)
    """Point on the axis of the spin, or moving along the orbit."""
    forces: dict[str, Annotated[Vector, Quantity("N", (3,))]] = Field(default_factory=dict)
    """Group -> force at the mean position of its nodes; it keeps its direction."""
    masses: dict[str, Mass] = Field(default_factory=dict)
    """Group -> mass of bodies attached there by joints, on which gravity, spin and orbit act too."""

    @model_validator(mode="after")
    def _has_one_field_and_a_load(self) -> Preload:
        if self.spin is not None and self.orbit is not None:
            refuse("found spin and orbit together; the field of the orbit holds its rate already, so give one of them")
        if not (any(self.acceleration) or self.spin or self.orbit or self.forces):
            refuse("found no load; give acceleration, spin, orbit or forces")
        return self

    @property
    def gradient(self) -> Array:
        """A (3, 3) [1/s^2] of the force g + A (r - origin) per mass: |Om|^2 1 - Om Om^T of a spin Om, or an orbit's."""
        if self.orbit is not None:
            return self.orbit.gradient
        w = np.zeros(3) if self.spin is None else np.asarray(self.spin)
        return w @ w * np.eye(3) - np.outer(w, w)

    def with_mean_motion(self, rate: float | None) -> Preload:
        """The preload whose orbit has that rate [rad/s] if it states none."""
        if self.orbit is None or self.orbit.rate is not None:
            return self
        return self.model_copy(update={"orbit": self.orbit.model_copy(update={"rate": rate})})


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


def loads_of_preload(structure: Structure, preload: Preload | None) -> Loads:
    """The loads of a preload: F = int N^T (g + A rho) dm and S = int N^T A N dm, and those at groups; none of None."""
    if preload is None:
        return Loads(np.zeros(structure.n_dof), sparse.csr_array((structure.n_dof, structure.n_dof)))
    A = preload.gradient
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
