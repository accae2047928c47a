"""A Structure about a deflected state, with the mesh, masses and strains of that state, and relaxed stress."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import Any

import numpy as np

from femflex.arrays import Array, IntArray
from femflex.fem.assembly import ElementMatrices
from femflex.fem.family import SkinPart
from femflex.fem.structure import Structure
from femflex.fem.tables import StrainBlock, StressAt, mass_and_stiffness
from femflex.fem.tension.strain import TensionStrain

ROUNDING = 1e-8  # of the initial stress; a smaller remainder is rounding


@dataclass(frozen=True, eq=False)
class RelaxedStrain:
    """A strain block with the stress C L G x of a displacement x (n_raw,) added to its initial one."""

    block: Any  # a StrainBlock that is a dataclass with the field stress
    x: Array
    least: float = 0.0  # see `settled_stress`

    @property
    def dofs(self) -> IntArray:
        """See StrainBlock, with its shapes and units."""
        return self.block.dofs

    @property
    def weight(self) -> Array:
        """See StrainBlock, with its shapes and units."""
        return self.block.weight

    @property
    def elastic(self) -> Array:
        """See StrainBlock, with its shapes and units."""
        return self.block.elastic

    @cached_property
    def stress(self) -> Array:
        """See StrainBlock, with its shapes and units."""
        return settled_stress(self.block, self.x, self.least)

    @property
    def linear_map(self) -> Array:
        """See StrainBlock, with its shapes and units."""
        return self.block.linear_map

    @property
    def quadratic_map(self) -> Array:
        """See StrainBlock, with its shapes and units."""
        return self.block.quadratic_map

    def gradients(self, phi: Array, elements: slice, most: int | None = None) -> Array:
        """See StrainBlock, with its shapes and units."""
        return self.block.gradients(phi, elements, most)

    def rows(self, elements: slice, most: int | None = None) -> Array:
        """See StrainBlock, with its shapes and units."""
        return self.block.rows(elements, most)

    def sampled(self, elements: slice) -> StrainBlock:
        """See StrainBlock."""
        part = self.block.sampled(elements)
        return replace(part, stress=settled_stress(part, self.x, self.least))

    def nonlinear(self, elements: slice, stress: StressAt | None = None) -> tuple[StrainBlock, ...]:
        """See StrainBlock."""
        return tuple(self.block.nonlinear(elements, stress or partial(settled_stress, x=self.x, least=self.least)))

    def stiffness(self) -> Array:
        """See StrainBlock, with its shapes and units."""
        return self.block.stiffness()

    def parts(self) -> tuple[ElementMatrices, ...]:
        """See StrainBlock."""
        return self.block.parts()


def settled_stress(block: StrainBlock, x: Array, least: float = 0.0) -> Array:
    """Initial stress plus that of the linear strain of x (n_raw,), (e, q, s) [SI]; remainders of the size of rounding
    are set to zero.

    least: `magnitude` of the structure's initial stress, for blocks that have none of their own.
    """
    strain = block.linear_map @ block.gradients(x[:, None], slice(None))
    stress = block.stress + np.matmul(block.elastic, strain)[..., 0]
    return np.where(np.abs(stress) > ROUNDING * _unit(block) * (magnitude(block) or least), stress, 0.0)


def magnitude(block: StrainBlock) -> float:
    """The largest initial stress of a block, divided by the root of its stiffness."""
    unit, stress = np.broadcast_arrays(_unit(block), block.stress)
    return float(np.divide(np.abs(stress), unit, out=np.zeros(stress.shape), where=unit > 0).max(initial=0.0))


def _unit(block: StrainBlock) -> Array:
    """Square roots of the stiffnesses (e|1, q|1, s); stresses divided by them are comparable by energy."""
    return np.sqrt(np.abs(np.diagonal(block.elastic, axis1=2, axis2=3)))


def with_settled_stress(structure: Structure, x: Array) -> Structure:
    """Return the structure with the stress of a small displacement x (n_dof,) [m, rad] added to its initial one; the
    mesh does not change."""
    raw = structure.T @ x
    least = max(magnitude(block) for block in structure.strain)
    strain = tuple(RelaxedStrain(block, raw, least) for block in structure.strain)
    return replace(structure, strain=strain)


def deflected(structure: Structure, x: Array) -> Structure:
    """Return the structure about displacements x (n_dof,) [m, rad] of its own dofs, with the positions, stress and
    strain energy of that state.

    It is exact for tethers and membranes at any displacement: the energy of d is V(x + d) - V(x). For beams, plates and
    solids the stress of the linear strain of x is taken, so that x must be small compared with their size. f0 is the
    elastic force at x, which the loads of an equilibrium balance.
    """
    raw = structure.T @ x
    strain = tuple(_strain(block, raw) for block in structure.strain)
    masses: Any = structure.inertia
    moved = (block.rho + block.shapes(raw[:, None], slice(None))[..., 0] for block in masses)
    inertia = tuple(replace(block, rho=rho) for block, rho in zip(masses, moved, strict=True))
    points = structure.mesh.points + (structure.translation @ x).reshape(-1, 3)
    M, K0 = mass_and_stiffness(inertia, strain, structure.T)
    return replace(
        structure,
        mesh=replace(structure.mesh, points=points),
        M=M,
        K0=K0,
        inertia=inertia,
        strain=strain,
        skin_parts=tuple(partial(_skin, part, raw) for part in structure.skin_parts),
        places=tuple(
            replace(strain_places, x=block.places)
            if isinstance(block, TensionStrain) and strain_places is not None
            else strain_places
            for block, strain_places in zip(strain, structure.places, strict=True)
        ),
    )


def tension_blocks(structure: Structure) -> tuple[TensionStrain, ...]:
    """Return the strain blocks of a structure that carry tension only."""
    return tuple(block for block in structure.strain if isinstance(block, TensionStrain))


def _strain(block: StrainBlock, raw: Array) -> Any:
    return block.deflected(raw) if isinstance(block, TensionStrain) else RelaxedStrain(block, raw)


def _skin(part: Callable[[], SkinPart], raw: Array) -> SkinPart:
    skin_part = part()
    displacements = np.bincount(skin_part.rows, skin_part.values * raw[skin_part.cols], skin_part.points.size)
    return replace(skin_part, points=skin_part.points + displacements.reshape(-1, 3))
