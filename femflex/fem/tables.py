"""The two tables that describe any flexible body (THEORY section 3): inertia and strain over quadrature points.

A table is a tuple of blocks, one per member and element layout. Mass, stiffness, moments and strain tensors are
all sums over the same points, so phi^T M phi and the elastic mass of the moments agree to rounding.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, fields, replace
from typing import Protocol, Self

import numpy as np
from scipy import sparse

from femflex.arrays import Array, IntArray
from femflex.fem.assembly import Assembler, ElementMatrices

CACHED_VALUES = 250_000  # doubles that stay in the cache of a processor (2 MB)
CACHED_ELEMENTS = 50  # minimum of such a chunk, because each takes some calls
CHUNK_VALUES = 4_000_000  # doubles stored at once while a table is contracted with a basis (32 MB)


def rows_of_elements(table: Array, elements: slice) -> Array:
    """Rows of a table (e|1, ...), in its unit, for a slice of elements, or the single row of a table that all elements
    share."""
    return table if table.shape[0] == 1 else table[elements]


class InertiaBlock(Protocol):
    """Points with mass: dm (e, q) [kg] at rho (e, q, 3) [m], moved by the raw dofs (e, l) of their element."""

    @property
    def dofs(self) -> IntArray: ...
    @property
    def dm(self) -> Array: ...
    @property
    def rho(self) -> Array: ...

    def shapes(self, phi: Array, elements: slice) -> Array:
        """Displacement (e, q, 3, n) [m] of the points per column of phi (n_raw, n)."""

    def mass(self) -> Array:
        """Element mass matrices (e, l, l) [kg, kg m, kg m^2]."""

    def parts(self) -> tuple[ElementMatrices, ...]:
        """The same for assembly, as separate parts where dofs do not couple."""


class StrainBlock(Protocol):
    """Points with stiffness: weight (e, q) [m, m^2, m^3], elastic matrix (e|1, q|1, s, s), strains from generalised
    gradients g.

    The unit of elastic is that of energy over length, area or volume, by the strains' units: [N, N m, N m^2] of lines,
    [N/m, N, N m] of surfaces, [Pa] of solids.

    With g = gradients @ delta: eps = linear_map g + 1/2 g . quadratic_map g, so that B0 = linear_map gradients.
    stress (e|1, q|1, s) is the initial one, sigma0; the energy is the integral of sigma0.eps + 1/2 eps.C eps.
    """

    @property
    def dofs(self) -> IntArray: ...
    @property
    def weight(self) -> Array: ...
    @property
    def elastic(self) -> Array: ...
    @property
    def stress(self) -> Array: ...
    @property
    def linear_map(self) -> Array: ...  # (s, g)
    @property
    def quadratic_map(self) -> Array: ...  # (s, g, g)

    def gradients(self, phi: Array, elements: slice, most: int | None = None) -> Array:
        """Generalised gradients (e, q, g, n) per column of phi (n_raw, n), or the first `most` of them.

        Slopes and membrane strains [1], curvatures [1/m], for a column in m and rad.
        """

    def rows(self, elements: slice, most: int | None = None) -> Array:
        """Generalised gradients (e|1, q, g, l) of `gradients` per raw dof of the element, per m or per rad [1/m,
        1/m^2]."""

    def sampled(self, elements: slice) -> StrainBlock:
        """The strain of these elements alone, at the points where its quadratic part is taken."""

    def nonlinear(self, elements: slice, stress: StressAt | None = None) -> tuple[StrainBlock, ...]:
        """Blocks of these elements alone whose energies add up to that of the nonlinear strain.

        stress: the initial one at the points of a block, instead of the table's own.
        """

    def stiffness(self) -> Array:
        """Element stiffness matrices (e, l, l) [N/m, N, N m] of the linear strain."""

    def parts(self) -> tuple[ElementMatrices, ...]:
        """The same for assembly, as separate parts where dofs do not couple."""


StressAt = Callable[[StrainBlock], Array]  # initial stress (e|1, q|1, s) at the points of a block


@dataclass(frozen=True, eq=False)
class DenseInertia:
    """An inertia block with its shape functions stored, N (e|1, q, 3, l)."""

    dofs: IntArray
    dm: Array
    rho: Array
    N: Array

    def shapes(self, phi: Array, elements: slice) -> Array:
        """See InertiaBlock, with its shapes and units."""
        return np.matmul(rows_of_elements(self.N, elements), phi[self.dofs[elements]][:, None])

    def mass(self) -> Array:
        """See InertiaBlock, with its shapes and units."""
        e, q = self.dm.shape
        N = np.broadcast_to(self.N, (e, *self.N.shape[1:]))
        flat = N.reshape(e, q * 3, -1)
        weighted = flat * np.repeat(self.dm, 3, axis=1)[:, :, None]
        return np.matmul(flat.swapaxes(1, 2), weighted)

    def parts(self) -> tuple[ElementMatrices, ...]:
        """See InertiaBlock."""
        return (ElementMatrices(self.dofs, self.mass().__getitem__),)


@dataclass(frozen=True, eq=False)
class SectionInertia(DenseInertia):
    """Points of sections that rotate about points of a line, with the data for their second-order displacements.

    second (e, s, 3, 3)     int o o^T dm of the offsets o from the line at stations along the elements, global axes
    turn   (e, s, 3, l)     rows of the sections' rotation
    axis   (e, 3)           unit vector along the line
    """

    second: Array
    turn: Array
    axis: Array


@dataclass(frozen=True, eq=False)
class DenseStrain:
    """A strain block with its gradient rows stored, G (e|1, q, g, l)."""

    dofs: IntArray
    weight: Array
    elastic: Array
    linear_map: Array
    quadratic_map: Array
    G: Array
    stress: Array = field(default_factory=lambda: np.zeros((1, 1, 1)))  # broadcast over the strains

    def gradients(self, phi: Array, elements: slice, most: int | None = None) -> Array:
        """See StrainBlock, with its shapes and units."""
        return np.matmul(rows_of_elements(self.G, elements)[:, :, :most], phi[self.dofs[elements]][:, None])

    def rows(self, elements: slice, most: int | None = None) -> Array:
        """See StrainBlock, with its shapes and units."""
        return rows_of_elements(self.G, elements)[:, :, :most]

    def dense(self, elements: slice) -> DenseStrain:
        """The strains of these elements alone, without what a subclass adds to them."""
        elastic, G, stress = (rows_of_elements(table, elements) for table in (self.elastic, self.G, self.stress))
        dofs, weight = self.dofs[elements], self.weight[elements]
        return DenseStrain(dofs, weight, elastic, self.linear_map, self.quadratic_map, G, stress)

    def of_elements(self, elements: slice) -> Self:
        """The block of these elements alone."""
        part = self.dense(elements)
        return replace(self, **{entry.name: getattr(part, entry.name) for entry in fields(DenseStrain)})

    def sampled(self, elements: slice) -> DenseStrain:
        """See StrainBlock; the stored points are used."""
        return self.of_elements(elements)

    def nonlinear(self, elements: slice, stress: StressAt | None = None) -> tuple[StrainBlock, ...]:
        """See StrainBlock."""
        sampled = self.sampled(elements)
        return (sampled if stress is None else replace(sampled, stress=stress(sampled)),)

    def stiffness(self) -> Array:
        """See StrainBlock, with its shapes and units."""
        e, q = self.weight.shape
        B0 = np.broadcast_to(self.linear_map @ self.G, (e, q, self.linear_map.shape[0], self.G.shape[-1]))
        stress = np.matmul(self.elastic * self.weight[:, :, None, None], B0)
        return np.matmul(B0.reshape(e, -1, B0.shape[-1]).swapaxes(1, 2), stress.reshape(e, -1, B0.shape[-1]))

    def parts(self) -> tuple[ElementMatrices, ...]:
        """See StrainBlock."""
        return (ElementMatrices(self.dofs, self.stiffness().__getitem__),)


def mass_and_stiffness(
    inertia: Sequence[InertiaBlock], strain: Sequence[StrainBlock], T: sparse.csr_array
) -> tuple[sparse.csr_array, sparse.csr_array]:
    """M [kg, kg m^2] and K [N/m, N m] (n_dof, n_dof) of blocks on raw dofs, which T (n_raw, n_dof) gives from the
    independent ones."""
    assembler = Assembler(T)  # one for both, as it stores the connections of the dofs
    K = assembler.total([part for block in strain for part in block.parts()])
    return assembler.total([part for block in inertia for part in block.parts()]), K


def element_chunks(n_elements: int, values_per_element: int, most: int = CHUNK_VALUES) -> Iterator[slice]:
    """Slices of elements whose values fit in `most` doubles."""
    step = max(1, most // max(1, values_per_element))
    for start in range(0, n_elements, step):
        yield slice(start, min(start + step, n_elements))


def cached_chunks(n_elements: int, values_per_element: int) -> Iterator[slice]:
    """Slices of so few elements that their values stay in the cache, for values that are used several times and then
    summed."""
    most = max(CACHED_VALUES, CACHED_ELEMENTS * values_per_element)
    return element_chunks(n_elements, values_per_element, min(most, CHUNK_VALUES))
