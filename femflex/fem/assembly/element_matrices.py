"""Element matrices and the dofs that they are on."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from femflex.arrays import Array, IntArray


@dataclass(frozen=True, eq=False)
class ElementMatrices:
    """Element matrices values(elements) (k, l, l) on the dofs (e, l), or alike on every component of dofs (e, l, c)."""

    dofs: IntArray
    values: Callable[[slice], Array]
