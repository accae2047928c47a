"""The explicit method for smooth problems: Dormand and Prince of order 8, adaptive, with dense output of order 7."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from femflex.arrays import Array
from femflex.integrate.dop853_kernel import N_SCRATCH, N_STAGES, fill
from femflex.integrate.driver import Adaptive, Fill
from femflex.integrate.first_step import first_step, switch_of
from femflex.integrate.intervals import Span
from femflex.integrate.protocol import Model
from femflex.integrate.register import INTEGRATORS
from femflex.integrate.vectors import projection_of


@dataclass(frozen=True, eq=False)
class Dop853(Adaptive):
    """Explicit Runge-Kutta method of order 8(5,3) of Dormand and Prince (Hairer, Norsett & Wanner 1993, II.10).

    Twelve rates a step, three more when an output time lies inside it. Euler parameters named by the model are
    brought to unit length at the end of each accepted step, and a model with constraints is brought back onto them,
    before the rate there is taken: changes of the size of the local error, so the order stays 8.

    The tolerances are tight because at order 8 they cost little: 1e-11 takes at most 1.7 times the steps of 1e-9, and
    a rigid craft keeps its angular momentum to 1e-10 over a hundred seconds of tumbling.
    """

    rtol: float = 1e-11

    name: ClassVar[str] = "dop853"
    order: ClassVar[int] = 8
    number: ClassVar[int] = 1
    n_vectors: ClassVar[int] = 11

    def restart(self, model: Model, vectors: Array, t: float, span: Span) -> tuple[float, int]:
        """First step of a smooth interval, after k1 = f(t, x) at its beginning is set."""
        x, k1 = vectors[0], vectors[1]
        return first_step(model, self.order, t, span, x, k1, self.rtol, vectors[-1]), 2

    def dense(self, theta: float, h: float, vectors: Array) -> Array:
        """The interpolant of order 7 (as in `dop853_kernel.interpolate`)."""
        rest, F = 1.0 - theta, vectors[3:]
        inner = F[3] + theta * (F[4] + rest * (F[5] + theta * F[6]))
        state: Array = vectors[2] + theta * (F[0] + rest * (F[1] + theta * (F[2] + rest * inner)))
        return state

    def filler(self, model: Model) -> Fill:
        """The compiled loop of `dop853_kernel` (compiled on first use in a fresh installation, else read from disk)."""
        calls, arrays = (projection_of(model), model.rate, switch_of(model)), (model.table, model.pool, model.work)
        renormalise = np.ascontiguousarray(model.renormalise, np.int64)
        k, scratch = np.zeros((N_STAGES, model.n_x)), np.zeros((N_SCRATCH, model.n_x))

        def fill_rows(
            state: Array, vectors: Array, times: Array, rows: Array, span: Span, budget: int
        ) -> tuple[int, int]:
            tolerances, storage = (self.rtol, vectors[-1], self.max_step), (state, vectors, k, scratch)
            return fill(calls, arrays, span, renormalise, tolerances, storage, times, rows, budget)

        return fill_rows


INTEGRATORS[Dop853.name] = Dop853
