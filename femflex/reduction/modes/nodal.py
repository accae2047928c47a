"""Nodal displacements as elastic coordinates, without reduction or with lumped masses."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy import sparse

from femflex.arrays import Array, IntArray
from femflex.fem.structure import Structure
from femflex.fem.tables import DenseInertia, InertiaBlock
from femflex.reduction.boundary.clamps import Groups, free_dofs, held_dofs, names
from femflex.reduction.modes.vibration import ModeSet, statically_condensed


def nodal(structure: Structure, clamp: Groups) -> ModeSet:
    """The set with one shape per free dof: the Structure without reduction, not M-orthonormal."""
    clamped = held_dofs(structure, clamp)
    free = free_dofs(structure, clamped)
    phi = np.eye(structure.n_dof)[:, free]
    return ModeSet(phi, ("nodal",) * len(free), np.full(len(free), np.nan), names(clamp), clamped)


def nodal_translations(structure: Structure, clamp: Groups) -> ModeSet:
    """The set of the free translations of all nodes; rotations and other dofs are condensed statically (Guyan).

    With `lumped` this is the lumped-mass model: exact in stiffness for loads at the nodes, mass at the nodes alone. The
    rotation of a node to which others are tied rigidly moves their mass, so it is a shape as well.
    R. J. Guyan, Reduction of stiffness and mass matrices, AIAA Journal 3 (1965) 380.
    """
    clamped = held_dofs(structure, clamp)
    retained = np.setdiff1d(_moving_dofs(structure), clamped)
    phi = statically_condensed(structure, clamped, retained, np.eye(len(retained)))
    return ModeSet(phi, ("nodal",) * len(retained), np.full(len(retained), np.nan), names(clamp), clamped)


def lumped(structure: Structure) -> Structure:
    """The structure with its mass lumped at the nodes: translations alone have mass, stiffness is unchanged.

    Each element's mass is shared among its nodes in proportion to the diagonal of its mass matrix (Hinton, Rock and
    Zienkiewicz, Earthquake Engng Struct. Dyn. 4 (1976) 245), so that masses are positive and the total is kept;
    rotary inertia, and a point mass's inertia and offset, are lost. Nodes that depend on others (rigid links,
    multi-point constraints) keep their mass, which these others move: M = T' diag(m) T.
    """
    raw = structure.numbering.translation_of(np.arange(len(structure.mesh.points)))
    node_of_raw = np.full(structure.T.shape[0], -1, np.int64)
    has = np.flatnonzero(raw[:, 0] >= 0)
    node_of_raw[raw[has]] = has[:, None]
    share = np.zeros(len(structure.mesh.points))
    for block in structure.inertia:
        np.add.at(share, *_element_shares(block, node_of_raw))
    loaded = np.flatnonzero(share)
    table = DenseInertia(
        raw[loaded], share[loaded, None], structure.mesh.points[loaded][:, None], np.eye(3)[None, None]
    )
    masses = np.zeros(structure.T.shape[0])
    masses[raw[loaded]] = share[loaded, None]
    M = (structure.T.T @ sparse.diags_array(masses) @ structure.T).tocsr()
    return replace(structure, M=M, inertia=(table,))


def is_lumped(structure: Structure) -> bool:
    """Whether the mass of a structure is `lumped`: it moves with the translation of one node at a time."""
    return all(block.dofs.shape[1] == 3 for block in structure.inertia)


def _moving_dofs(structure: Structure) -> IntArray:
    """Independent dofs that move a node, in any axes: a rotation to which other nodes are tied does, too."""
    return np.unique(structure.translation.tocoo().coords[1]).astype(np.int64)


def _element_shares(block: InertiaBlock, node_of_raw: IntArray) -> tuple[IntArray, Array]:
    """The nodes of every element of a block, and their shares of its mass."""
    diagonal = np.einsum("ell->el", block.mass())
    nodes = node_of_raw[block.dofs]  # e, l
    weight = np.where(nodes >= 0, diagonal, 0.0)
    weight *= (block.dm.sum(axis=1) / weight.sum(axis=1))[:, None]
    return nodes[nodes >= 0], weight[nodes >= 0]
