"""Linear equations between components of nodes (multi-point constraints, Nastran's MPC)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Annotated, Literal

import numpy as np
from pydantic import Field, model_validator

from femflex.fem.assembly.dependence import Dependence
from femflex.fem.assembly.numbering import Numbering
from femflex.fem.connections.connection import Component, only_node
from femflex.fem.support import COMPONENTS
from femflex.noun.table import Table, refuse
from femflex.noun.values import Plain

if TYPE_CHECKING:
    from femflex.mesh import Mesh


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
