"""The strain field of a body: gradients of its shapes at the points of the strain table, or at means of elements."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from femflex.body.strain_field import StrainPart
from femflex.fem.family import StrainPlaces
from femflex.fem.structure import Structure
from femflex.fem.tables import StrainBlock, element_chunks
from femflex.reduction.beam_strain import beam_strains
from femflex.reduction.uniform_beam import BeamFunctions, UniformBeam

Array = NDArray[np.float64]

NAMED = 4  # strains of a beam before those of fourth order
MOST_POINTS = 3000  # of a member that are kept one by one; with more, each element keeps its mean


def strain_field(structure: Structure, phi: Array, nonlinear: bool) -> tuple[StrainPart, ...]:
    """Parts over shapes phi (n_dof, n), one for every block of the strain table whose points have places.

    Bytes: 4 n g a point, g the strains (4 to 8) of a linear, unstressed body, else the gradients (6 to 11).
    """
    if not phi.shape[1]:
        return ()
    raw = structure.T @ phi
    found = zip(structure.strain, structure.places, strict=True)
    return tuple(_part(block, places, raw, nonlinear) for block, places in found if places is not None)


def _part(block: StrainBlock, places: StrainPlaces, raw: Array, nonlinear: bool) -> StrainPart:
    """One part; its points are those at which its energy is sampled: of nonlinear strain, other ones than of linear."""
    points = _Points.of(block, nonlinear)
    e, q = points.weight.shape
    whole = nonlinear or bool(points.stress.any())  # the quadratic part of strain has a meaning
    by_element = e * q > MOST_POINTS
    share = points.weight / points.weight.sum(axis=1, keepdims=True)
    seen = block.sampled(slice(0, 1)) if nonlinear else block
    s, g = seen.linear_map.shape
    rows = np.empty((e, 1 if by_element else q, g if whole else s, raw.shape[1]), np.float32)
    for chunk in element_chunks(e, q * (g + s) * max(1, raw.shape[1])):
        gradients = points.gradients(raw, chunk)
        own = gradients if whole else seen.linear_map @ gradients
        rows[chunk] = np.einsum("eq,eqgn->egn", share[chunk], own)[:, None] if by_element else own
    x, weight = places.x if not nonlinear or places.sampled is None else places.sampled, points.weight
    if by_element:
        x, weight = np.einsum("eq,eqa->ea", share, x), weight.sum(axis=1)
    return StrainPart(
        kind=places.kind,
        places=x.reshape(-1, 3),
        weight=weight.ravel(),
        rows=rows.reshape(-1, *rows.shape[2:]),
        linear=seen.linear_map if whole else np.eye(s),
        quadratic=seen.quadratic_map if whole else np.zeros((s, s, s)),
        elastic=_kept(points.elastic, share, by_element),
        stress=_kept(points.stress, share, by_element),
        leading=raw.shape[1],
        nonlinear=nonlinear,
    )


@dataclass(frozen=True, eq=False)
class _Points:
    """Weights (e, q), elastic matrices (e|1, q|1, s, s) and stresses (e|1, q|1, s) of the points of a block."""

    block: StrainBlock
    nonlinear: bool
    weight: Array
    elastic: Array
    stress: Array

    @classmethod
    def of(cls, block: StrainBlock, nonlinear: bool) -> _Points:
        """Those of its linear strain, or where the nonlinear one is sampled."""
        if not nonlinear:
            return cls(block, False, block.weight, block.elastic, block.stress)
        chunks = element_chunks(len(block.dofs), 100 * block.linear_map.shape[1])
        parts = [(part.weight, part.elastic, part.stress) for part in (block.sampled(chunk) for chunk in chunks)]
        weight, elastic, stress = (
            arrays[0] if arrays[0].shape[0] == 1 < len(block.dofs) else np.concatenate(arrays)
            for arrays in zip(*parts, strict=True)
        )
        return cls(block, True, weight, elastic, stress)

    def gradients(self, raw: Array, elements: slice) -> Array:
        """Gradients (e, q, g, n) of raw shapes at the points of these elements."""
        if self.nonlinear:
            return self.block.sampled(elements).gradients(raw, slice(None))
        return self.block.gradients(raw, elements)


def _kept(table: Array, share: Array, by_element: bool) -> Array:
    """Rows (1|p, ...) of a table (e|1, q|1, ...): one where all agree, else of every point or every element's mean."""
    if np.all(table == table[:1, :1]):
        return table[0, 0][None]
    every = np.broadcast_to(table, (*share.shape, *table.shape[2:]))
    if by_element:
        return np.asarray(np.einsum("eq,eq...->e...", share, every))
    return every.reshape(-1, *table.shape[2:])


def beam_field(beam: UniformBeam, functions: BeamFunctions, X: Array, nonlinear: bool, following: bool) -> StrainPart:
    """The part of a beam on admissible functions times X (count, n), with its `beam_strains`.

    What is of fourth order in the energy stands beside the four strains as others, which have no name.
    """
    found = beam_strains(beam, functions, X, following)
    s = len(found.linear) if nonlinear else NAMED
    return StrainPart(
        kind="line",
        places=np.asarray(beam.root, float) + beam.length * found.xi[:, None] * beam.frame[0],
        weight=found.dx,
        rows=(found.rows if nonlinear else found.linear[:NAMED] @ found.rows).astype(np.float32),
        linear=found.linear if nonlinear else np.eye(s),
        quadratic=found.quadratic if nonlinear else np.zeros((s, s, s)),
        elastic=found.stiffness[:, :s, None] * np.eye(s),
        stress=np.zeros((1, s)),
        leading=X.shape[1],
        nonlinear=nonlinear,
    )
