"""Compilation of the equations: kernels that are kept on disk, and functions that only compiled code calls.

Division follows IEEE rules (no Python exceptions inside). The compiler may reorder and fuse sums, which it does the
same way every time: results repeat bit for bit.
"""

from __future__ import annotations

from typing import Any

import numba

from femflex.kernels import part_options, stored

njit: Any = numba.njit  # numba's own annotations do not cover all of it

FAST = {"contract", "arcp", "nsz", "reassoc"}  # everything that keeps NaN and infinity honest

inner = njit(fastmath=FAST, error_model="numpy", **part_options())  # a part


def kernel(signature: Any) -> Any:
    """Decorator of a kernel: compiled for this one signature and stored on disk; free of the interpreter's lock."""
    return stored(signature, error_model="numpy", nogil=True)
