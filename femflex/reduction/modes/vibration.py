"""Sets of shapes, those by eigen-solution or of nodes, load vectors of known loads, and static responses."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from scipy import linalg, sparse

from femflex.arrays import Array, IntArray
from femflex.fem.eigen.shift_invert import canonical_modes, dense_modes, signs
from femflex.fem.structure import Structure
from femflex.fem.tables import DenseInertia, InertiaBlock
from femflex.reduction.boundary.markers import marker_rows
from femflex.reduction.boundary.rigid import (
    DIRECTIONS,
    Groups,
    free_dofs,
    held_dofs,
    independent_columns,
    names,
    refuse_mechanism,
    rigid_shapes,
)
from femflex.reduction.boundary.supported import lowest_modes_on, supported
from femflex.reduction.inertia.accelerations import loads_of_rigid_accelerations
from femflex.reduction.modes.buckling import refuse_buckled

UNHELD = np.zeros(0, np.int64)
DEPENDENT = 1e-13  # least eigenvalue of the mass matrix of unit-mass shapes below which they are dependent
TURN = 1e-3  # rotation times size below this part of the largest translation does not decide a shape's sign


def cantilever_modes(structure: Structure, clamp: Groups, n: int) -> ModeSet:
    """The n lowest vibration modes with the clamp groups fixed in the body frame (fixed-interface modes).

    clamp: group names, or name -> fixed components ("x", "y", "z", "rx", "ry", "rz"). Close modes at the end are not
    separated, so there may be a few more (see `note`). Raises ValueError if the clamp leaves a mechanism.
    """
    return fixed_modes(structure, held_dofs(structure, clamp), names(clamp), n)


def fixed_modes(structure: Structure, held: IntArray, groups: tuple[str, ...], n: int) -> ModeSet:
    """The n lowest vibration modes with the dofs of numbers `held` (k,) fixed; groups: their names in messages."""
    refuse_buckled(structure, held)
    free = supported(structure, held).free
    modes = lowest_modes_on(structure, held, n)
    if modes.null.shape[1]:
        loose = np.zeros((structure.n_dof, modes.null.shape[1]))
        loose[free] = modes.null
        refuse_mechanism(structure, held, groups, loose)
    phi = np.zeros((structure.n_dof, len(modes.omega)))
    phi[free] = modes.phi
    phi = signed(structure, phi)
    return ModeSet(phi, ("vibration",) * phi.shape[1], modes.omega, groups, held, modes.note)


def statically_condensed(structure: Structure, held: IntArray, boundary: IntArray, motions: Array) -> Array:
    """Static dof vectors (n_dof, k) [m, rad] for boundary motions (n_boundary, k), x_i = -K_ii^-1 K_ib x_b."""
    inside = supported(structure, np.union1d(held, boundary))
    interior = inside.free
    phi = np.zeros((structure.n_dof, motions.shape[1]))
    phi[boundary] = motions
    if interior.size and motions.shape[1]:
        load = np.zeros_like(phi)
        load[interior] = -structure.K[interior][:, boundary] @ motions
        phi += inside.answers(load)
    return phi


def free_free_modes(structure: Structure, n: int) -> ModeSet:
    """The n lowest elastic modes of the free structure, M-orthogonal to rigid motion.

    The body frame then follows the mean motion: no elastic coordinate moves the centre of mass or has angular momentum
    to first order. Dofs without stiffness (`Structure.unresisted`) and mass stay zero. A structure held by springs to
    ground has its modes in the frame of the ground. Raises ValueError if such springs hold it only partly, or if it is
    a mechanism.
    """
    free, modes = supported(structure, UNHELD).free, lowest_modes_on(structure, UNHELD, n)
    R = rigid_shapes(structure)
    R = R[:, independent_columns(R)]
    n_null, n_rigid = modes.null.shape[1], R.shape[1]
    phi, null = (np.zeros((structure.n_dof, shapes.shape[1])) for shapes in (modes.phi, modes.null))
    phi[free], null[free] = modes.phi, modes.null
    if not n_null:
        return ModeSet(signed(structure, phi), ("vibration",) * phi.shape[1], modes.omega, note=modes.note)
    if n_null != n_rigid:
        refuse_mechanism(structure, UNHELD, (), null)
    MR = structure.M @ R
    try:
        mass_factors = linalg.cho_factor(R.T @ MR)
    except linalg.LinAlgError:
        raise ValueError(
            f"{n_rigid} rigid motions are free, and some move no mass (masses on a line have no inertia about it); "
            "clamp the structure, or give the masses inertia."
        ) from None
    phi = signed(structure, phi - R @ linalg.cho_solve(mass_factors, MR.T @ phi))
    return ModeSet(phi, ("free-free",) * phi.shape[1], modes.omega, note=modes.note)


def ritz(structure: Structure, phi: Array) -> tuple[Array, Array]:
    """Frequencies (n,) [rad/s] and M-orthonormal shapes (n_dof, n) of the structure confined to the span of phi."""
    size = np.sqrt(np.einsum("in,in->n", phi, structure.M @ phi))
    phi = phi / np.where(size > 0, size, 1.0)
    K, M = phi.T @ (structure.K @ phi), phi.T @ (structure.M @ phi)
    if phi.shape[1] and np.linalg.eigvalsh(M)[0] < DEPENDENT:
        raise ValueError(
            f"the {phi.shape[1]} shapes are not independent in the mass they move; leave out shapes that repeat "
            "others, or that move dofs without mass."
        )
    eigenvalues, X = dense_modes(K, M)
    return np.sqrt(np.maximum(eigenvalues, 0.0)), signed(structure, canonical_modes(eigenvalues, phi @ X))


def signed(structure: Structure, phi: Array) -> Array:
    """The shapes phi (n_dof, n) [m, rad], signed so that the largest translation of a node is positive.

    Where nodes hardly translate, the largest rotation is positive.
    """
    size = float(np.linalg.norm(np.ptp(structure.mesh.points, axis=0)))
    motion = np.concatenate([structure.translation @ phi, TURN * size * (structure.rotation @ phi)])
    return phi * signs(motion)


def responses_to_clamp_accelerations(structure: Structure, modes: ModeSet) -> tuple[Array, Array]:
    """Loads (n_dof, 3) of unit accelerations of the clamps along x, y, z, and the linear responses to them."""
    loads = load_vectors(structure, "xyz", {})
    return loads, supported(structure, modes.held).answers(loads)


def load_vectors(structure: Structure, directions: Sequence[str], loads: Mapping[str, Sequence[str]]) -> Array:
    """Load vectors (n_dof, k): inertia of unit accelerations, then unit forces and moments at groups."""
    unknown = [
        d
        for d in [*directions, *(d for group_directions in loads.values() for d in group_directions)]
        if d not in DIRECTIONS
    ]
    if unknown:
        raise ValueError(f"directions {unknown} are not known; name some of {list(DIRECTIONS)}.")
    columns = [loads_of_rigid_accelerations(structure)[:, [DIRECTIONS.index(d) for d in directions]]]
    for group, group_directions in loads.items():
        rows = marker_rows(structure, group)
        translation_and_rotation = np.concatenate([rows.translation.toarray(), rows.rotation.toarray()])
        columns.append(translation_and_rotation[[DIRECTIONS.index(d) for d in group_directions]].T)
    return np.concatenate(columns, axis=1)


@dataclass(frozen=True, eq=False)
class ModeSet:
    """Shapes on the independent dofs of a Structure.

    phi    (n_dof, n)  one shape per column; M-orthonormal, except in nodal sets
    kinds  (n,)        vibration, free-free, attachment, craig-bampton, constraint, derivative, third derivative,
                       admissible, nodal
    omega  (n,)        natural frequency of each shape, nan if it has none [rad/s]
    groups             mesh groups the set is about (clamps, interfaces); they become markers of the body
    held   (k,)        dofs fixed by clamps in every shape
    reference          group that the body frame follows, for sets without clamps that are not free-free
    note               remark on the set (a close pair of modes that was kept), or empty
    """

    phi: Array
    kinds: tuple[str, ...]
    omega: Array
    groups: tuple[str, ...] = ()
    held: IntArray = field(default_factory=lambda: np.zeros(0, np.int64))
    note: str = ""
    reference: str = ""

    def __post_init__(self) -> None:
        n = self.phi.shape[1]
        if len(self.kinds) != n or self.omega.shape != (n,):
            raise ValueError(
                f"a set of {n} shapes needs as many kinds and frequencies; "
                f"found {len(self.kinds)} and {self.omega.shape[0]}."
            )

    @property
    def n_modes(self) -> int:
        """Number of shapes."""
        return self.phi.shape[1]

    def with_shapes(self, phi: Array, kinds: Iterable[str], omega: Array, note: str = "") -> ModeSet:
        """The set and shapes phi (n_dof, k) after its own, of these kinds and omega (k,) [rad/s], and a note."""
        return replace(
            self,
            phi=np.column_stack([self.phi, phi]),
            kinds=(*self.kinds, *kinds),
            omega=np.append(self.omega, omega),
            note="; ".join(part for part in (self.note, note) if part),
        )

    def picked(self, columns: list[int] | IntArray) -> ModeSet:
        """The set with only the columns (k,) of these numbers, in this order."""
        index = np.asarray(columns, np.int64)
        return replace(self, phi=self.phi[:, index], kinds=tuple(self.kinds[i] for i in index), omega=self.omega[index])


def rigid_set(n_dof: int) -> ModeSet:
    """The empty set: a Structure reduced by it is a rigid body."""
    return ModeSet(np.zeros((n_dof, 0)), (), np.zeros(0))


def static_response(structure: Structure, modes: ModeSet, load: Array) -> Array:
    """Displacements (n_dof, k) under loads (n_dof, k) with the set's supports, factorised once for all (`supported`).

    Without clamps the load is balanced by uniform and rotational acceleration (inertia relief), and the frame is placed
    as the set places it: on its reference group, or at the mean motion for free-free modes.
    """
    supports = supported(structure, modes.held)
    x = supports.answers(load)
    if modes.held.size or not modes.reference:
        return x
    rows = marker_rows(structure, modes.reference)
    mean_motion = np.concatenate([rows.translation.toarray(), rows.rotation.toarray()])
    return x - supports.R @ np.linalg.lstsq(mean_motion @ supports.R, mean_motion @ x, rcond=None)[0]


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
