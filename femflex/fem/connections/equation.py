"""Linear equations between components of nodes (multi-point constraints, Nastran's MPC)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from femflex.fem.assembly.dependence import Dependence
from femflex.fem.assembly.numbering import Numbering
from femflex.fem.support import COMPONENTS

if TYPE_CHECKING:
    from femflex.mesh import Mesh


@dataclass(frozen=True)
class Term:
    """factor times a component ("x" ... "rz", mesh axes) of the one node of a group."""

    group: str
    component: str
    factor: float


@dataclass(frozen=True)
class Equation:
    """sum of the terms = 0; the component of the first term follows the others."""

    terms: tuple[Term, ...]

    def __post_init__(self) -> None:
        if not self.terms:
            raise ValueError("an equation of dofs has no terms; give at least one")
        for term in self.terms:
            if term.component not in COMPONENTS:
                raise ValueError(
                    f"component {term.component!r} of an equation is not of a node; name one of {list(COMPONENTS)}"
                )
            if not np.isfinite(term.factor) or term.factor == 0:
                raise ValueError(
                    f"factor of group {term.group!r} in an equation is {term.factor}; give a number, not 0"
                )

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
    nodes = mesh.group_points(term.group)
    if len(nodes) != 1:
        raise ValueError(f"{where}: group {term.group!r} has {len(nodes)} nodes; name groups of one node")
    turns = COMPONENTS.index(term.component) >= 3
    dofs = (numbering.rotation_of if turns else numbering.translation_of)(nodes)[0]
    if dofs[0] < 0:
        kind = "rotation" if turns else "translation"
        raise ValueError(f"{where}: no member gives the node of group {term.group!r} a {kind}; name another")
    return np.asarray(dofs)
