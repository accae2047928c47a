"""A Python function that writes the rows of a general constraint, as compiled code calls it: by its address."""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from typing import Any

import numba
import numpy as np

from femflex.arrays import Array
from femflex.kernels.entries import plain_address

Function = Callable[[float, Array], tuple[Array, Array]]

STEP = 2e-3  # part of the time scale |q| / |qdot| over which the rates of A and b are taken
STENCIL = ((1, 45.0), (2, -9.0), (3, 1.0))  # central difference of sixth order, over 60 h
_numba: Any = numba  # its annotations do not cover what is used here
_REAL = ctypes.POINTER(ctypes.c_double)
_PROTOTYPE = ctypes.CFUNCTYPE(None, ctypes.c_double, _REAL, _REAL, _REAL)


class Rows:
    """A user's function (t, q) -> A, b as compiled code calls it; keep it alive as long as its address is used."""

    def __init__(
        self, name: str, function: Function, n_rows: int, n_q: int, n_u: int, rates: Callable[[Array, Array], Array]
    ) -> None:
        self.name, self.function, self.rates = name, function, rates
        self.n_rows, self.n_q, self.n_u = n_rows, n_q, n_u
        self.error: Exception | None = None  # what the last call with a finite state raised
        self._callback = _PROTOTYPE(self._called)
        self.address = ctypes.cast(self._callback, ctypes.c_void_p).value or 0
        if _numba.config.DISABLE_JIT:
            self.address = plain_address(self.write)

    def checked(self, t: float, q: Array) -> tuple[Array, Array]:
        """Return A (n_rows, n_u) and b (n_rows,) at t and q; raise ValueError that names the fault in them."""
        A, b = (np.asarray(part, float) for part in self.function(t, q))
        if A.shape != (self.n_rows, self.n_u) or b.shape != (self.n_rows,):
            raise ValueError(
                f"the function of constraint {self.name!r} gave A of shape {A.shape} and b of shape {b.shape}; "
                f"expected ({self.n_rows}, {self.n_u}) and ({self.n_rows},)"
            )
        if not (np.isfinite(A).all() and np.isfinite(b).all()):
            row = int(np.argmin(np.isfinite(A).all(axis=1) & np.isfinite(b)))
            raise ValueError(
                f"the function of constraint {self.name!r} gave numbers that are not finite in row {row} at t = {t:.9g}"
                f" s: A = {A[row].tolist()}, b = {b[row]:g}"
            )
        return A, b

    def write(self, t: float, q: Array, u: Array, out: Array) -> None:
        """A, b, Adot u - bdot into out: rates along the motion by differences of sixth order."""
        q, u, n = q[: self.n_q].copy(), u[: self.n_u].copy(), self.n_rows * self.n_u
        A, b = self.checked(t, q)
        dq = self.rates(q, u)
        h = STEP * max(1.0, float(np.abs(q).max(initial=0.0))) / max(1.0, float(np.abs(dq).max(initial=0.0)))
        total = np.zeros(self.n_rows)
        for k, weight in STENCIL:
            for sign in (1.0, -1.0):
                A_k, b_k = self.checked(t + sign * k * h, q + sign * k * h * dq)
                total += sign * weight / (60.0 * h) * (A_k @ u - b_k)
        out[:n], out[n : n + self.n_rows], out[n + self.n_rows : n + 2 * self.n_rows] = A.ravel(), b, total

    def _called(self, t: float, q: Any, u: Any, out: Any) -> None:
        shape = np.ctypeslib.as_array
        values = shape(out, (self.n_rows * (self.n_u + 2),))
        q, u = shape(q, (self.n_q,)), shape(u, (self.n_u,))
        if not (np.isfinite(q).all() and np.isfinite(u).all()):  # of a trial that has failed already
            values[:] = np.nan
            return
        try:
            self.write(t, q, u, values)
            self.error = None
        except Exception as error:
            self.error = error
            values[:] = np.nan
