"""Components that follow linear combinations of others: equations, and the general multi-point constraint."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Literal

import numpy as np
from numpy.typing import ArrayLike
from pydantic import Field, model_validator

from femflex.fem.assembly.dependence import Dependence
from femflex.fem.assembly.numbering import Numbering
from femflex.fem.connections.connection import Component, only_node
from femflex.fem.support import COMPONENTS, GLOBAL, Rows, Support
from femflex.mesh import Mesh
from femflex.noun.table import Table, refuse
from femflex.noun.values import Plain

if TYPE_CHECKING:
    from femflex.mesh import Mesh


@dataclass(frozen=True, eq=False)
class MultiPointConstraint:
    """Components of one node follow those of others: u_c = sum over leaders of matrix_c @ (u, theta of the leader).

    group       of the one node that follows
    components  (k,) of "x", "y", "z", "rx", "ry", "rz" that follow, along the rows of `axes`
    leaders     (n,) groups of one node each; the node that follows may be one of them, by its other components
    matrix      (k, 6 n) factors of the leaders' translations and rotations, mesh axes
    axes        (3, 3) rows: directions of x, y, z in mesh axes
    name        for messages
    """

    group: str
    components: tuple[str, ...]
    leaders: tuple[str, ...]
    matrix: ArrayLike
    axes: Rows = GLOBAL
    name: str = ""

    def __post_init__(self) -> None:
        Support(self.components, self.axes)  # checks both
        matrix = np.asarray(self.matrix, float)
        if matrix.shape != (len(self.components), 6 * len(self.leaders)) or not np.isfinite(matrix).all():
            raise ValueError(
                f"{self._label()} has a matrix of shape {matrix.shape}; {len(self.components)} components and "
                f"{len(self.leaders)} leaders need {(len(self.components), 6 * len(self.leaders))} finite numbers"
            )

    def with_reference_node(self, mesh: Mesh) -> Mesh:
        """See Connection."""
        return mesh

    def dependences(self, mesh: Mesh, numbering: Numbering) -> Sequence[Dependence]:
        """See Connection. Rotations of leaders that no member gives them count as zero."""
        matrix = np.asarray(self.matrix, float).reshape(len(self.components), -1, 2, 3)
        sources, factors = [np.zeros(0, np.int64)], [np.zeros((len(self.components), 0))]
        for k, leader in enumerate(self.leaders):
            leader_node = np.array([only_node(mesh, leader, self._label())])
            for kind in (0, 1):
                if not matrix[:, k, kind].any():
                    continue
                dofs = (numbering.translation_of, numbering.rotation_of)[kind](leader_node)[0]
                if dofs[0] < 0 and kind == 0:
                    dofs = numbering.translation(leader_node)[0]
                if dofs[0] >= 0:
                    sources.append(dofs)
                    factors.append(matrix[:, k, kind])
        source, F = np.concatenate(sources), np.concatenate(factors, axis=1)
        follower, dependences = np.array([only_node(mesh, self.group, self._label())]), []
        rows = np.asarray(Support(self.components, self.axes).axes)
        without_rotation = numbering.translation_of(follower)[0, 0] >= 0 and numbering.rotation_of(follower)[0, 0] < 0
        for kind in (0, 1):
            rows_of_kind = [k for k, c in enumerate(self.components) if COMPONENTS.index(c) // 3 == kind]
            if not rows_of_kind:
                continue
            directions = rows[[COMPONENTS.index(self.components[k]) % 3 for k in rows_of_kind]]
            target = (numbering.translation_of, numbering.rotation_of)[kind](follower)[0]
            if kind == 1 and without_rotation:
                continue  # there is no rotation to follow
            if target[0] < 0:
                target = (numbering.translation, numbering.rotation)[kind](follower)[0]
            dependences.append(Dependence(target, directions, source, directions.T @ F[rows_of_kind], self._label()))
        return dependences

    def _label(self) -> str:
        return self.name or f"the linear connection of group {self.group!r}"


class Term(Table):
    """A component of the one node of a group, times a factor."""

    group: str
    """Mesh group of one node."""
    component: Component
    """Displacement x, y, z or rotation rx, ry, rz, in axes of the body."""
    factor: Plain
    """Factor of the component: a pure number, or metres per radian in SI where the equation mixes them."""

    @model_validator(mode="after")
    def _acts(self) -> Term:
        if self.factor == 0.0:
            refuse(f"factor of group {self.group!r} in an equation is {self.factor}; give a number, not 0")
        return self


class Equation(Table):
    """A sum of components of nodes that is zero (MPC)."""

    kind: Literal["equation"] = "equation"
    """Selects this connection: an equation of components."""
    terms: Annotated[tuple[Term, ...], Field(min_length=1)]
    """Terms that add up to zero. The first one's component follows the others."""

    def with_reference_node(self, mesh: Mesh) -> Mesh:
        """See Connection."""
        return mesh

    def dependences(self, mesh: Mesh, numbering: Numbering) -> Sequence[Dependence]:
        """See Connection."""
        where = f"the equation of {', '.join(f'{t.group}.{t.component}' for t in self.terms)}"
        vectors = [_vector(mesh, numbering, term, where) for term in self.terms]
        axis = [COMPONENTS.index(term.component) % 3 for term in self.terms]
        first_factor = self.terms[0].factor
        M = np.zeros((3, 3 * (len(self.terms) - 1)))
        for k, (term, a) in enumerate(zip(self.terms[1:], axis[1:], strict=True)):
            M[axis[0], 3 * k + a] = -term.factor / first_factor
        source = np.concatenate([np.zeros(0, np.int64), *vectors[1:]])
        return [Dependence(vectors[0], np.eye(3)[[axis[0]]], source, M, where)]


def _vector(mesh: Mesh, numbering: Numbering, term: Term, where: str) -> np.ndarray:
    """Raw dofs (3,) of the translation or rotation that the component is of."""
    nodes = np.array([only_node(mesh, term.group, where)])
    turns = COMPONENTS.index(term.component) >= 3
    dofs = (numbering.rotation_of if turns else numbering.translation_of)(nodes)[0]
    if dofs[0] < 0:
        kind = "rotation" if turns else "translation"
        raise ValueError(f"{where}: no member gives the node of group {term.group!r} a {kind}; name another")
    return np.asarray(dofs)
