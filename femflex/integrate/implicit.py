"""Base class of the implicit methods: the model calls that they need, and the start of a smooth interval."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from femflex.arrays import Array
from femflex.integrate.driver import Adaptive
from femflex.integrate.first_step import first_step, set_rate
from femflex.integrate.hermite import X_OLD, XDOT, XDOT_OLD, X
from femflex.integrate.intervals import Span
from femflex.integrate.protocol import Model, SecondOrder


@dataclass(frozen=True, eq=False)
class Implicit(Adaptive):
    """An adaptive method for M udot = Q - h, with dense output by cubic Hermite polynomials of x.

    step  constant step [s] instead of error control; rtol and atol then only say when Newton's method is done
    """

    rtol: float = 1e-6
    step: float | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.step is not None and not self.step > 0.0:
            raise ValueError(f"step = {self.step} must be positive.")

    def second_order_calls(self, model: Model) -> SecondOrder:
        """The second-order calls of the model, or a ValueError if it has none that fit."""
        calls = model.second_order
        if calls is None:
            raise ValueError(
                f"the integrator {self.name!r} needs a model with second-order calls (correct, kinematic, "
                "advance), and this one has only its rate. Choose 'dop853'."
            )
        n_z = getattr(calls, "n_z", 0)
        if calls.n_q + calls.n_u + n_z != model.n_x or calls.n_u > calls.n_q:
            raise ValueError(
                f"the integrator {self.name!r} needs x = (q, u, z) with n_u <= n_q, but n_q = {calls.n_q}, "
                f"n_u = {calls.n_u}, n_z = {n_z} and n_x = {model.n_x}."
            )
        return calls

    def restart(self, model: Model, vectors: Array, t: float, span: Span) -> tuple[float, int]:
        """First step of a smooth interval, after dx/dt at its beginning and the slope of udot there are set."""
        self.second_order_calls(model)
        x, xdot = vectors[0], vectors[1]
        h = first_step(model, self.order, t, span, x, xdot, self.rtol, vectors[-1])
        h = min(h if self.step is None else self.step, self.max_step)
        self.set_slopes(model, vectors, t, h, span)
        return h, 3

    def dense(self, theta: float, h: float, vectors: Array) -> Array:
        """The cubic through both ends of the step and their rates (as in `hermite.interpolate`)."""
        x1, v1, x0, v0 = vectors[X], vectors[XDOT], vectors[X_OLD], vectors[XDOT_OLD]
        rest, rise = 1.0 - theta, x1 - x0
        state: Array = rest * x0 + theta * x1 + theta * rest * (rest * (h * v0 - rise) - theta * (h * v1 - rise))
        return state

    def set_slopes(self, model: Model, vectors: Array, t: float, h: float, span: Span) -> None:
        """Set the vectors that the method keeps in addition to dx/dt; none by default."""


def slope(model: Model, vectors: Array, t: float, h: float, span: Span) -> Array:
    """Second derivative of x along the motion at (t, x), (n_x,), by a difference over a small part of the step h."""
    x, xdot, later = vectors[0], vectors[1], np.empty_like(vectors[1])
    dt = 1e-4 * min(h, span[0] - t)
    if dt <= 0.0:
        return np.zeros_like(x)
    set_rate(model, t + dt, x + dt * xdot, later, span)
    later -= xdot
    later /= dt
    return later
