"""Element matrices and the dofs that they are on."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Index = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Part:
    """Element matrices values(elements) (k, l, l) on the dofs (e, l), or alike on every component of dofs (e, l, c)."""

    dofs: Index
    values: Callable[[slice], Array]
