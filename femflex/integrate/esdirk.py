"""The implicit method of order 4: singly diagonally implicit Runge-Kutta, L-stable, adaptive."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from femflex.arrays import Array
from femflex.integrate.driver import Adaptive, Fill
from femflex.integrate.esdirk_kernel import N_SCRATCH, N_STAGES, fill
from femflex.integrate.first_step import first_step, switch_of
from femflex.integrate.hermite import X_OLD, XDOT, XDOT_OLD, X
from femflex.integrate.intervals import Span
from femflex.integrate.protocol import Model, SecondOrder
from femflex.integrate.register import INTEGRATORS
from femflex.integrate.vectors import projection_of


@dataclass(frozen=True, eq=False)
class Esdirk4(Adaptive):
    """Stiffly accurate, L-stable Runge-Kutta method of order 4(3), five implicit stages (Kennedy & Carpenter 2003).

    For M udot = Q - h with stiff modes, of which those far above 1/h die within a step or two. q is integrated by
    qdot = N(q) u within the stages, and Euler parameters are brought to unit length after each step. Dense output is by
    cubic Hermite polynomials of x.

    step  constant step [s] instead of error control; rtol and atol then only say when Newton's method is done
    """

    rtol: float = 1e-9
    step: float | None = None

    name: ClassVar[str] = "esdirk4"
    order: ClassVar[int] = 4
    number: ClassVar[int] = 3
    n_vectors: ClassVar[int] = 5

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.step is not None and not self.step > 0.0:
            raise ValueError(f"step = {self.step} must be positive.")

    def second_order_calls(self, model: Model) -> SecondOrder:
        """The second-order calls of the model, or a ValueError if it has none that fit."""
        calls = model.second_order
        if calls is None:
            raise ValueError(
                f"the integrator {self.name!r} needs a model with second-order calls (correct, kinematic), "
                "and this one has only its rate. Choose 'dop853'."
            )
        n_z = getattr(calls, "n_z", 0)
        if calls.n_q + calls.n_u + n_z != model.n_x or calls.n_u > calls.n_q:
            raise ValueError(
                f"the integrator {self.name!r} needs x = (q, u, z) with n_u <= n_q, but n_q = {calls.n_q}, "
                f"n_u = {calls.n_u}, n_z = {n_z} and n_x = {model.n_x}."
            )
        return calls

    def restart(self, model: Model, vectors: Array, t: float, span: Span) -> tuple[float, int]:
        """First step of a smooth interval, after dx/dt at its beginning is set."""
        self.second_order_calls(model)
        x, xdot = vectors[0], vectors[1]
        h = first_step(model, self.order, t, span, x, xdot, self.rtol, vectors[-1])
        h = min(h if self.step is None else self.step, self.max_step)
        return h, 3

    def dense(self, theta: float, h: float, vectors: Array) -> Array:
        """The cubic through both ends of the step and their rates (as in `hermite.interpolate`)."""
        x1, v1, x0, v0 = vectors[X], vectors[XDOT], vectors[X_OLD], vectors[XDOT_OLD]
        rest, rise = 1.0 - theta, x1 - x0
        state: Array = rest * x0 + theta * x1 + theta * rest * (rest * (h * v0 - rise) - theta * (h * v1 - rise))
        return state

    def filler(self, model: Model) -> Fill:
        """The compiled loop of `esdirk_kernel`."""
        second_order, arrays = self.second_order_calls(model), (model.table, model.pool, model.work)
        calls = (projection_of(model), model.rate, second_order.correct, second_order.kinematic, switch_of(model))
        renormalise = np.ascontiguousarray(model.renormalise, np.int64)
        k, scratch = np.zeros((N_STAGES, model.n_x)), np.zeros((N_SCRATCH, model.n_x))

        def fill_rows(
            state: Array, vectors: Array, times: Array, rows: Array, span: Span, budget: int
        ) -> tuple[int, int]:
            settings = (float(self.step or 0.0), self.rtol, vectors[-1], self.max_step)
            storage = (state, vectors, k, scratch)
            return fill(calls, arrays, span, renormalise, second_order.n_q, settings, storage, times, rows, budget)

        return fill_rows


INTEGRATORS[Esdirk4.name] = Esdirk4
