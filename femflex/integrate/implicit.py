"""What the implicit methods share outside their kernels: which models they take, and the start of a smooth interval."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from femflex.arrays import Array
from femflex.integrate.driver import Adaptive
from femflex.integrate.hermite import X_OLD, XDOT, XDOT_OLD, X
from femflex.integrate.intervals import Span
from femflex.integrate.protocol import Model, SecondOrder
from femflex.integrate.starting import asked, first_step


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

    def calls(self, model: Model) -> SecondOrder:
        """The second-order calls of the model, or a ValueError if it has none that fit."""
        offered = model.second_order
        if offered is None:
            raise ValueError(
                f"the integrator {self.name!r} needs a model with second-order calls (correct, kinematic, "
                "advance), and this one has only its rate. Choose 'dop853'."
            )
        n_z = getattr(offered, "n_z", 0)
        if offered.n_q + offered.n_u + n_z != model.n_x or offered.n_u > offered.n_q:
            raise ValueError(
                f"the integrator {self.name!r} needs x = (q, u, z) with n_u <= n_q, but n_q = {offered.n_q}, "
                f"n_u = {offered.n_u}, n_z = {n_z} and n_x = {model.n_x}."
            )
        return offered

    def restart(self, model: Model, vectors: Array, t: float, span: Span) -> tuple[float, int]:
        """First step of a smooth interval, after dx/dt at its beginning and the slope of udot there are set."""
        self.calls(model)
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
        """Set what the method keeps of the past in addition to dx/dt; nothing by default."""


def slope(model: Model, vectors: Array, t: float, h: float, span: Span) -> Array:
    """Second derivative of x along the motion at (t, x), (n_x,), by a difference over a small part of the step h."""
    x, xdot, later = vectors[0], vectors[1], np.empty_like(vectors[1])
    small = 1e-4 * min(h, span[0] - t)
    if small <= 0.0:
        return np.zeros_like(x)
    asked(model, t + small, x + small * xdot, later, span)
    later -= xdot
    later /= small
    return later
