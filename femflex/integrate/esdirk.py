"""The implicit method of order 4: singly diagonally implicit Runge-Kutta, L-stable, adaptive."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from femflex.arrays import Array
from femflex.integrate.driver import Fill
from femflex.integrate.esdirk_kernel import N_SCRATCH, N_STAGES, fill
from femflex.integrate.implicit import Implicit
from femflex.integrate.intervals import Span
from femflex.integrate.projection import projection_of
from femflex.integrate.protocol import Model
from femflex.integrate.register import INTEGRATORS
from femflex.integrate.switching import switch_of


@dataclass(frozen=True, eq=False)
class Esdirk4(Implicit):
    """Stiffly accurate, L-stable Runge-Kutta method of order 4(3), five implicit stages (Kennedy & Carpenter 2003).

    The better of the two implicit methods where accuracy is wanted with stiff modes: a step costs about five of
    generalised alpha's, and order 4 repays it. Modes far above 1/h die within a step or two. Needs no `advance`:
    q is integrated by qdot = N(q) u within the stages and Euler parameters are brought to unit length after each step.
    """

    rtol: float = 1e-9

    name: ClassVar[str] = "esdirk4"
    order: ClassVar[int] = 4
    number: ClassVar[int] = 3
    n_vectors: ClassVar[int] = 5

    def filler(self, model: Model) -> Fill:
        """The compiled loop of `esdirk_kernel`."""
        second_order, arrays = self.second_order_calls(model), (model.table, model.pool, model.work)
        calls = (model.rate, second_order.correct, second_order.kinematic, switch_of(model), projection_of(model))
        renormalise = np.ascontiguousarray(model.renormalise, np.int64)
        k, scratch = np.zeros((N_STAGES, model.n_x)), np.zeros((N_SCRATCH, model.n_x))

        def fill_rows(
            state: Array, vectors: Array, times: Array, rows: Array, span: Span, budget: int
        ) -> tuple[int, int]:
            settings = (float(self.step or 0.0), self.rtol, vectors[-1], self.max_step)
            storage = (state, vectors, k, scratch)
            return fill(*calls, arrays, span, renormalise, second_order.n_q, *settings, *storage, times, rows, budget)

        return fill_rows


INTEGRATORS[Esdirk4.name] = Esdirk4
