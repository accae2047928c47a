"""A set of shapes on a Structure's dofs, in which a body can deform."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from femflex.arrays import Array, IntArray


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

    def picked(self, columns: list[int] | IntArray) -> ModeSet:
        """The set with only the columns (k,) of these numbers, in this order."""
        index = np.asarray(columns, np.int64)
        return replace(self, phi=self.phi[:, index], kinds=tuple(self.kinds[i] for i in index), omega=self.omega[index])


def rigid_set(n_dof: int) -> ModeSet:
    """The empty set: a Structure reduced by it is a rigid body."""
    return ModeSet(np.zeros((n_dof, 0)), (), np.zeros(0))
