"""Strain blocks whose initial stress has relaxed by a small displacement, where the supports do not balance it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import Any

import numpy as np

from femflex.arrays import Array, IntArray
from femflex.fem.assembly import ElementMatrices
from femflex.fem.structure import Structure
from femflex.fem.tables import StrainBlock, StressAt

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
