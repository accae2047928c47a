"""Types of arrays in annotations; shapes and units are given in docstrings."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
IntArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]
ComplexArray = NDArray[np.complex128]

Table = IntArray  # the records of a compiled model, and
Record = np.void  # one of them
