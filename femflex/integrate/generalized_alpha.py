"""The implicit method of structural dynamics: generalised alpha on a Lie group, adaptive, with numerical damping."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from femflex.arrays import Array
from femflex.integrate.driver import Fill
from femflex.integrate.generalized_alpha_kernel import N_SCRATCH, fill, parameters
from femflex.integrate.implicit import Implicit, slope
from femflex.integrate.intervals import Span
from femflex.integrate.projection import projection_of
from femflex.integrate.protocol import Model
from femflex.integrate.register import INTEGRATORS
from femflex.integrate.switching import switch_of


@dataclass(frozen=True, eq=False)
class GeneralizedAlpha(Implicit):
    """Generalised-alpha method (Chung & Hulbert 1993) in the Lie-group form of Arnold & Bruels (2007), order 2.

        (1 - alpha_m) a_1 + alpha_m a_0 = (1 - alpha_f) udot_1 + alpha_f udot_0
        q_1 = q_0 o exp(h u_0 + h^2 ((1/2 - beta) a_0 + beta a_1)),   u_1 = u_0 + h ((1 - gamma) a_0 + gamma a_1)
        M udot_1 + h - Q = 0 at (t_1, q_1, u_1)

    a runs ahead of udot by (alpha_m - alpha_f) h; when the step changes, its distance from udot is scaled with it,
    which keeps order 2 (Bruels & Arnold 2008).

    rho  spectral radius at infinite frequency, 0 to 1: modes far above 1/h shrink by this factor a step
    """

    rho: float = 0.8

    name: ClassVar[str] = "generalized_alpha"
    order: ClassVar[int] = 2
    number: ClassVar[int] = 2
    n_vectors: ClassVar[int] = 7

    def __post_init__(self) -> None:
        super().__post_init__()
        if not 0.0 <= self.rho <= 1.0:
            raise ValueError(f"the spectral radius rho = {self.rho} must lie between 0 (most damping) and 1 (none).")

    def set_slopes(self, model: Model, vectors: Array, t: float, h: float, span: Span) -> None:
        """Set the slopes (a - vdot) / h and d(vdot)/dt at the beginning of a smooth interval."""
        alpha_m, alpha_f, _, _ = parameters(self.rho)
        jerk = slope(model, vectors, t, h, span)[self.second_order_calls(model).n_q :]
        vectors[4, : jerk.size], vectors[5, : jerk.size] = (alpha_m - alpha_f) * jerk, jerk

    def filler(self, model: Model) -> Fill:
        """The compiled loop of `generalized_alpha_kernel`."""
        second_order, arrays = self.second_order_calls(model), (model.table, model.pool, model.work)
        implicit = (second_order.correct, second_order.kinematic, second_order.advance)
        calls = (model.rate, *implicit, switch_of(model), projection_of(model))
        renormalise = np.ascontiguousarray(model.renormalise, np.int64)
        scratch = np.zeros((N_SCRATCH, model.n_x))

        def fill_rows(
            state: Array, vectors: Array, times: Array, rows: Array, span: Span, budget: int
        ) -> tuple[int, int]:
            settings = (float(self.rho), float(self.step or 0.0), self.rtol, vectors[-1], self.max_step)
            storage = (state, vectors, scratch)
            return fill(*calls, arrays, span, renormalise, second_order.n_q, *settings, *storage, times, rows, budget)

        return fill_rows


INTEGRATORS[GeneralizedAlpha.name] = GeneralizedAlpha
