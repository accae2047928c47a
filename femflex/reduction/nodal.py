"""No reduction, and lumped masses: the nodal displacements themselves as elastic coordinates."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from femflex.fem.structure import Structure
from femflex.fem.tables import DenseInertia, InertiaBlock
from femflex.reduction.clamps import Groups, free_dofs, held_dofs, names
from femflex.reduction.modes import condensed
from femflex.reduction.modeset import ModeSet

Array = NDArray[np.float64]
Index = NDArray[np.int64]


def nodal(structure: Structure, clamp: Groups) -> ModeSet:
    """Every dof that is not clamped as a shape of its own: the Structure itself, not M-orthonormal."""
    held = held_dofs(structure, clamp)
    free = free_dofs(structure, held)
    phi = np.eye(structure.n_dof)[:, free]
    return ModeSet(phi, ("nodal",) * len(free), np.full(len(free), np.nan), names(clamp), held)


def nodal_translations(structure: Structure, clamp: Groups) -> ModeSet:
    """The free translations of all nodes as shapes; rotations and other dofs follow statically (Guyan).

    With `lumped` this is the lumped-mass model: exact in stiffness for loads at the nodes, mass at the nodes alone.
    R. J. Guyan, Reduction of stiffness and mass matrices, AIAA Journal 3 (1965) 380.
    """
    held = held_dofs(structure, clamp)
    kept = np.setdiff1d(_translation_dofs(structure)[0], held)
    phi = condensed(structure, held, kept, np.eye(len(kept)))
    return ModeSet(phi, ("nodal",) * len(kept), np.full(len(kept), np.nan), names(clamp), held)


def lumped(structure: Structure) -> Structure:
    """The structure with its mass lumped at the nodes: translations alone have mass, stiffness is unchanged.

    Each element's mass is shared among its nodes in proportion to the diagonal of its mass matrix (Hinton, Rock and
    Zienkiewicz, Earthquake Engng Struct. Dyn. 4 (1976) 245), so that masses are positive and the total is kept;
    rotary inertia, and a point mass's inertia and offset, are lost.
    """
    dofs, points = _translation_dofs(structure)
    share = np.zeros(len(structure.mesh.points))
    node_of_raw = _node_of_raw(structure, dofs, points)
    for block in structure.inertia:
        np.add.at(share, *_element_shares(block, node_of_raw))
    loaded = np.flatnonzero(share)
    raw = np.full((len(structure.mesh.points), 3), -1, np.int64)
    is_translation = np.flatnonzero(node_of_raw[:, 0] >= 0)
    raw[tuple(node_of_raw[is_translation].T)] = is_translation
    table = DenseInertia(
        raw[loaded], share[loaded, None], structure.mesh.points[loaded][:, None], np.eye(3)[None, None]
    )
    diagonal = np.zeros(structure.n_dof)
    diagonal[dofs] = share[points // 3]
    return replace(structure, M=sparse.diags_array(diagonal).tocsr(), inertia=(table,))


def _translation_dofs(structure: Structure) -> tuple[Index, Index]:
    """Independent dofs that are a node's translation, and the translation row (3 * point + axis) of each."""
    rows = structure.translation.tocoo()
    order = np.argsort(rows.coords[1])
    return rows.coords[1][order].astype(np.int64), rows.coords[0][order].astype(np.int64)


def _node_of_raw(structure: Structure, dofs: Index, points: Index) -> Index:
    """(n_raw, 2): node and axis of the raw dofs that are translations, -1 elsewhere."""
    row_of_dof = np.full(structure.n_dof, -1, np.int64)
    row_of_dof[dofs] = points
    T = structure.T.tocoo()
    found = np.full((structure.T.shape[0], 2), -1, np.int64)
    is_translation = row_of_dof[T.coords[1]] >= 0
    raw, row = T.coords[0][is_translation], row_of_dof[T.coords[1][is_translation]]
    found[raw] = np.stack([row // 3, row % 3], axis=1)
    return found


def _element_shares(block: InertiaBlock, node_of_raw: Index) -> tuple[Index, Array]:
    """Nodes and their parts of the mass of every element of a block."""
    diagonal = np.einsum("ell->el", block.mass())
    nodes = node_of_raw[block.dofs, 0]  # e, l
    weight = np.where(nodes >= 0, diagonal, 0.0)
    weight *= (block.dm.sum(axis=1) / weight.sum(axis=1))[:, None]
    return nodes[nodes >= 0], weight[nodes >= 0]
