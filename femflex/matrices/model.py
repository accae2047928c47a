"""Mass and stiffness of a body with node coordinates and a map of degrees of freedom: the neutral model, in SI."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import ArrayLike
from scipy import sparse

from femflex.arrays import Array, BoolArray, IntArray
from femflex.body import MassMoments
from femflex.decks.units import Units
from femflex.fem.matrix_structure import SCALAR, MatrixStructure, structure_from_matrices
from femflex.mesh import Mesh
from femflex.reduction.inertia.mass_matrix import Distribution, KnownMoments, PointMasses

NODE = re.compile(r"node_(\d+)")
ORTHONORMAL = 1e-6  # largest entry of C C^T - 1 of axes of displacement
MOMENTS = 1e-6  # relative asymmetry of moments that is accepted as rounding
NEGATIVE = 1e-3  # negative eigenvalue that is accepted: moments of lumped masses are rescaled to the elastic mass
SMALL = 1e-4  # fraction of the largest column of moments below which a column contains only its rounding


@dataclass(frozen=True, eq=False)
class Recovery:
    """Displacement of points between the interfaces of a reduced model.

    points  (p, 3)          positions [m]
    rows    (3 p, n_dof)    their displacement per dof, row 3 * point + axis
    masses  (p,)            mass lumped at each point [kg]; None if unknown
    """

    points: Array
    rows: sparse.csr_array
    masses: Array | None = None


@dataclass(frozen=True, eq=False)
class MatrixModel:
    """A body as matrices, in SI: a full finite element model, or a reduced one with modal coordinates.

    name                        for messages
    ids     (n,)                numbers of the nodes, all different
    points  (n, 3)              their positions [m]
    dofs    (n_dof, 2)          number of the node and component 1..6 (x, y, z, rx, ry, rz) of every row; component 0
                                for a scalar (modal) coordinate
    M, K    (n_dof, n_dof)      mass and stiffness
    D       (n_dof, n_dof)      damping, or None
    geometric (n_dof, n_dof)    geometric stiffness of a steady stress, added to K; if `spin_axis` is set, that of a
                                spin of 1 rad/s, which grows with the square of the rate; or None
    spin_axis (3,)              axis of that spin, or None
    frames  (n, 3, 3)           rows are the axes of the displacement components of each node; None: global axes
    recovery                    points between the interfaces of a reduced model, or None
    moments                     mass moments over (position, displacement of every unit dof), or None
    groups                      name -> numbers of nodes (k,)
    cells                       meshio cell name -> numbers of nodes (c, m), for pictures
    names                       names of the matrices in their files: "M" -> "MAAX"
    """

    name: str
    ids: IntArray
    points: Array
    dofs: IntArray
    M: sparse.csr_array
    K: sparse.csr_array
    D: sparse.csr_array | None = None
    geometric: sparse.csr_array | None = None
    spin_axis: Array | None = None
    frames: Array | None = None
    recovery: Recovery | None = None
    moments: MassMoments | None = None
    groups: Mapping[str, IntArray] = field(default_factory=dict)
    cells: Mapping[str, IntArray] = field(default_factory=dict)
    names: Mapping[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        n = len(self.dofs)
        numbers, counts = np.unique(self.ids, return_counts=True)
        if len(repeated := numbers[counts > 1]):
            raise ValueError(
                f"{self.name}: a node number is given twice, such as {repeated[0]}; number nodes differently"
            )
        for name, matrix in (
            ("mass", self.M),
            ("stiffness", self.K),
            ("damping", self.D),
            ("geometric", self.geometric),
        ):
            if matrix is not None and matrix.shape != (n, n):
                raise ValueError(
                    f"{self.name}: the {name} matrix is {matrix.shape[0]} x {matrix.shape[1]}, and the map of degrees "
                    f"of freedom has {n} rows; give matrices and map of one size"
                )
        invalid_rows = np.flatnonzero((self.dofs[:, 1] < 0) | (self.dofs[:, 1] > 6))
        if invalid_rows.size:
            raise ValueError(
                f"{self.name}: row {invalid_rows[0] + 1} of the map of degrees of freedom has component "
                f"{self.dofs[invalid_rows[0], 1]}; components are 1 to 6 (x, y, z, rx, ry, rz), and 0 for a modal "
                "coordinate"
            )
        unknown = np.setdiff1d(self.dofs[self.dofs[:, 1] > 0, 0], self.ids)
        if unknown.size:
            raise ValueError(
                f"{self.name}: {unknown.size} nodes of the map of degrees of freedom have no coordinates, such as "
                f"{unknown[:5].tolist()}; give the file that has them as `nodes`"
            )
        for name, nodes in self.cells.items():
            if (unknown := np.setdiff1d(nodes, self.ids)).size:
                raise ValueError(
                    f"{self.name}: cells of type {name!r} name nodes without coordinates, such as "
                    f"{unknown[:5].tolist()}; correct the cells, or leave them out: they are for pictures alone"
                )
        self._check_frames()
        self._check_recovery()
        self._check_moments()

    def _check_frames(self) -> None:
        """Raise ValueError unless the axes of every node are perpendicular unit vectors, right-handed."""
        if self.frames is None:
            return
        if self.frames.shape != (len(self.ids), 3, 3):
            raise ValueError(
                f"{self.name}: frames has shape {self.frames.shape}; {len(self.ids)} nodes need "
                f"{(len(self.ids), 3, 3)}, the three axes of each as rows"
            )
        difference = np.abs(self.frames @ self.frames.swapaxes(1, 2) - np.eye(3)).max(axis=(1, 2), initial=0.0)
        invalid = np.flatnonzero(~((difference < ORTHONORMAL) & (np.linalg.det(self.frames) > 0)))
        if invalid.size:
            k = invalid[0]
            raise ValueError(
                f"{self.name}: the axes of node {self.ids[k]} in frames are not a rotation (C C^T differs from 1 by "
                f"{difference[k]:.1e}, limit {ORTHONORMAL:g}; determinant {np.linalg.det(self.frames[k]):.4g}); give "
                "perpendicular unit vectors, right-handed, as rows"
            )

    def _check_recovery(self) -> None:
        """Raise ValueError for recovery of another size, or with entries that are not finite."""
        if self.recovery is None:
            return
        p, masses = len(self.recovery.points), self.recovery.masses
        if self.recovery.rows.shape != (3 * p, self.n_dof):
            raise ValueError(
                f"{self.name}: recovery has {self.recovery.rows.shape[0]} rows and {self.recovery.rows.shape[1]} "
                f"columns; {p} points and {self.n_dof} degrees of freedom need {3 * p} and {self.n_dof}"
            )
        if not (np.isfinite(self.recovery.points).all() and np.isfinite(self.recovery.rows.data).all()):
            raise ValueError(f"{self.name}: recovery holds entries that are not finite; give numbers")
        if masses is not None and (masses.shape != (p,) or not (masses >= 0).all() or not np.isfinite(masses).all()):
            raise ValueError(
                f"{self.name}: recovery_masses are {masses.size} numbers from {masses.min():.4g} to "
                f"{masses.max():.4g} kg; give one for each of the {p} points, none negative"
            )

    def _check_moments(self) -> None:
        """Raise ValueError for moments of another size, or that no mass distribution can have."""
        if self.moments is None:
            return
        mass, first, second = self.moments.mass, self.moments.first, self.moments.second
        n = 1 + self.n_dof
        if first.shape != (n, 3) or second.shape != (n, 3, n, 3):
            raise ValueError(
                f"{self.name}: moments_first and moments_second have shapes {first.shape} and {second.shape}; "
                f"{self.n_dof} degrees of freedom need {(n, 3)} and {(n, 3, n, 3)}"
            )
        if not (np.isfinite(mass) and np.isfinite(first).all() and np.isfinite(second).all() and mass > 0):
            raise ValueError(
                f"{self.name}: moments hold numbers that are not finite, or a mass of {mass:g} kg; write them again, "
                "or leave them out"
            )
        gram = np.block([[np.array([[mass]]), first.reshape(1, -1)], [first.reshape(-1, 1), second.reshape(3 * n, -1)]])
        size = np.sqrt(np.abs(np.diag(gram)))
        size = np.maximum(size, SMALL * size.max())
        scaled = gram / size / size[:, None]
        lowest, asymmetry = float(np.linalg.eigvalsh(scaled)[0]), float(np.abs(scaled - scaled.T).max())
        if lowest < -NEGATIVE or asymmetry > MOMENTS:
            raise ValueError(
                f"{self.name}: no distribution of mass has its moments: integrals int z z^T dm are symmetric and have "
                f"no negative eigenvalue, and these, scaled to a diagonal of 1, differ by {asymmetry:.2g} from their "
                f"mirror image (limit {MOMENTS:g}) and have the eigenvalue {lowest:.3g} (limit {-NEGATIVE:g}). "
                "Write them again, or leave them out"
            )

    @property
    def n_dof(self) -> int:
        """Number of rows of the matrices."""
        return len(self.dofs)

    @property
    def n_modal(self) -> int:
        """Number of scalar (modal) coordinates."""
        return int((self.dofs[:, 1] == 0).sum())

    @property
    def reduced(self) -> bool:
        """Whether it has modal coordinates."""
        return self.n_modal > 0

    @property
    def loaded(self) -> IntArray:
        """Numbers (k,) of the nodes that have degrees of freedom, in the order of the map."""
        numbers = self.dofs[self.dofs[:, 1] > 0, 0]
        return np.asarray(numbers[np.sort(np.unique(numbers, return_index=True)[1])])

    def nodes_of(self, group: str) -> IntArray:
        """Numbers (k,) of the nodes of a group: one of `groups`, "all", or node_17. Raises ValueError otherwise."""
        if group in self.groups:
            return np.asarray(self.groups[group], np.int64)
        if group == "all":
            return self.loaded
        if match := NODE.fullmatch(group):
            return np.array([int(match[1])], np.int64)
        raise ValueError(
            f"group {group!r} is not in {self.name}; its groups are {sorted(self.groups)}, all "
            f"and node_NUMBER; name one in `groups`, such as groups = {{ {group} = [1, 2, 3] }}"
        )

    def structure(self, groups: Sequence[str] = ()) -> MatrixStructure:
        """The structure of the matrices, with the groups of the model and these; its K includes a constant `geometric`.

        Raises ValueError for unknown groups, and for groups that name nodes without coordinates.
        """
        row_of = {int(number): k for k, number in enumerate(self.ids)}
        group_nodes = {name: self.nodes_of(name) for name in dict.fromkeys([*self.groups, *groups])}
        for name, nodes in group_nodes.items():
            missing = [int(number) for number in nodes if int(number) not in row_of]
            if missing:
                raise ValueError(
                    f"group {name!r} of {self.name} names nodes without coordinates, such as {missing[:5]}; the model "
                    f"has {len(self.ids)} nodes, {self.ids[:5].tolist()} and on"
                )
        point_groups = {
            name: np.unique([row_of[int(number)] for number in nodes]) for name, nodes in group_nodes.items()
        }

        def rows(numbers: IntArray) -> IntArray:
            return np.array([row_of[int(number)] for number in numbers.ravel()], np.int64).reshape(numbers.shape)

        mesh = Mesh(
            self.points, {kind: rows(np.asarray(c)) for kind, c in self.cells.items()}, point_groups=point_groups
        )
        physical = self.dofs[:, 1] > 0
        node_components = np.full((self.n_dof, 2), SCALAR, np.int64)
        node_components[physical, 0] = rows(self.dofs[physical, 0])
        node_components[physical, 1] = self.dofs[physical, 1] - 1
        K = self.K
        if self.geometric is not None and self.spin_axis is None:
            K = sparse.csr_array(K + self.geometric)
        recovery = None if self.recovery is None else (self.recovery.points, self.recovery.rows)
        return structure_from_matrices(mesh, node_components, self.M, K, self.D, self.frames, recovery)

    @property
    def distribution(self) -> Distribution | None:
        """Mass distribution that the model includes; None: its mass is at its nodes."""
        if self.moments is not None:
            return KnownMoments(self.moments)
        if self.recovery is not None and self.recovery.masses is not None:
            return PointMasses(self.recovery.masses, self.recovery.points, self.recovery.rows)
        return None

    def spinning(self, rate: float, axis: ArrayLike) -> MatrixModel:
        """A copy in which `geometric` belongs to a steady spin of this rate [rad/s] about the axis (3,).

        It then grows with the square of the body's rate. Raises ValueError without a geometric stiffness.
        """
        if self.geometric is None or not rate > 0:
            problem = "no geometric stiffness" if self.geometric is None else f"the rate {rate:g} rad/s"
            raise ValueError(
                f"{self.name} has {problem}; a spin needs the stiffness that it gives, and a positive rate"
            )
        G = sparse.csr_array(self.geometric / rate**2)
        return replace(self, geometric=G, spin_axis=np.asarray(axis, float))

    def in_si(self, units: Units) -> MatrixModel:
        """A copy in SI of a model in other units; modal coordinates have no unit.

        A displacement of one unit is `units.length` metres, so that with S = diag(length for translations, 1 else)
        M becomes mass length^2 S^-1 M S^-1, K the same over time^2, D over time.
        """
        if units.length == units.mass == units.time == 1.0:
            return self
        translations = (self.dofs[:, 1] > 0) & (self.dofs[:, 1] < 4)
        inverse = sparse.diags_array(np.where(translations, 1.0 / units.length, 1.0))

        def scaled(A: sparse.csr_array, power: int) -> sparse.csr_array:
            return sparse.csr_array(inverse @ A @ inverse * (units.inertia / units.time**power))

        recovery = self.recovery
        if recovery is not None:
            rows = sparse.csr_array(recovery.rows @ inverse * units.length)
            masses = None if recovery.masses is None else recovery.masses * units.mass
            recovery = Recovery(recovery.points * units.length, rows, masses)
        return replace(
            self,
            points=self.points * units.length,
            M=scaled(self.M, 0),
            K=scaled(self.K, 2),
            D=None if self.D is None else scaled(self.D, 1),
            geometric=None if self.geometric is None else scaled(self.geometric, 2),
            recovery=recovery,
            moments=None if self.moments is None else _moments_in_si(self.moments, translations, units),
        )


def _moments_in_si(moments: MassMoments, translations: BoolArray, units: Units) -> MassMoments:
    """Moments whose columns are (position, displacement per unit dof): a length, or a length per unit of the dof."""
    scale = np.concatenate([[units.length], np.where(translations, 1.0, units.length)])
    second = moments.second * scale[:, None, None, None] * scale[None, None, :, None] * units.mass
    return MassMoments(moments.mass * units.mass, moments.first * scale[:, None] * units.mass, second)
