"""Elastic damping of a reduced body."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated, Any

import numpy as np
from numpy.typing import ArrayLike
from pydantic import model_validator

from femflex.arrays import Array, BoolArray
from femflex.fem.eigen.shift_invert import dense_modes
from femflex.noun.table import Table, refuse
from femflex.noun.values import Quantity, _Readable

UNANSWERED = "unanswered attachment"  # static shape of loads that do no work on the modes
ADDED = ("attachment", UNANSWERED, "response", "third derivative")  # kinds of shapes that are added to vibration modes


def is_added(kinds: Sequence[str]) -> BoolArray:
    """(n,): whether each of the shapes is added to the vibration modes of a set."""
    return np.array([kind in ADDED for kind in kinds], bool)


def is_unanswered(kinds: Sequence[str]) -> BoolArray:
    """(n,): whether each of the shapes is the static shape of loads that do no work on the modes."""
    return np.array([kind == UNANSWERED for kind in kinds], bool)


def bending_damping(
    damping: Damping,
    Me: Array,
    V1: Array,
    damped: ArrayLike,
    added: ArrayLike | None = None,
    unanswered: ArrayLike | None = None,
) -> Array:
    """The damping matrix (n, n) [1/s], which acts only on the shapes `damped` (n,); those `added` (n,) define no modes.

    unanswered (n,): see Damping; no stretching shapes if strain is not linear.

    With nonlinear strain the other shapes compensate the stretch by bending: their amplitudes go with the square of the
    deflection, without strain. A fraction of the critical damping of so stiff a shape would then damp bending itself,
    far more than the same fraction of critical damping in bending (14 times for a panel of 0.6 Hz deflected by a tenth
    of its length).
    """
    at = np.flatnonzero(damped)
    extra, alone = (np.zeros(len(at), bool) if x is None else np.asarray(x, bool)[at] for x in (added, unanswered))
    D = np.zeros_like(V1)
    D[np.ix_(at, at)] = damping.matrix(Me[np.ix_(at, at)], V1[np.ix_(at, at)], extra, alone)
    return D


class Ratio(_Readable):
    """One damping ratio, or one per mode."""

    scalar, vector = Quantity("", least=0.0, below=1.0), Quantity("", (None,), least=0.0, below=1.0)

    def read_value(self, value: Any) -> Any:
        """A float or a tuple of them."""
        return (self.vector if isinstance(value, list | tuple) else self.scalar).read_value(value)

    def json_schema(self) -> dict[str, Any]:
        """JSON Schema of both forms."""
        return {"anyOf": [self.scalar.json_schema(), self.vector.json_schema()]}


class Damping(Table):
    """Elastic damping: a fraction of critical damping, or Rayleigh's two numbers."""

    ratio: Annotated[float | tuple[float, ...] | None, Ratio()] = None
    """Fraction of critical damping of the vibration modes at rest: one number, or one per mode; 0.005 is 0.5 %."""
    mass: Annotated[float, Quantity("1/s", least=0.0)] | None = None
    """Mass-proportional coefficient alpha of Rayleigh damping, D = alpha M + beta K."""
    stiffness: Annotated[float, Quantity("s", least=0.0)] | None = None
    """Stiffness-proportional coefficient beta of Rayleigh damping, D = alpha M + beta K."""

    @model_validator(mode="after")
    def _ratio_or_rayleigh(self) -> Damping:
        rayleigh = self.mass is not None or self.stiffness is not None
        if (self.ratio is not None) == rayleigh:
            refuse(
                "found "
                + ("ratio together with mass or stiffness" if rayleigh else "no damping")
                + "; give ratio, or mass and stiffness"
            )
        return self

    def matrix(
        self, Me: Array, V1: Array, added: ArrayLike | None = None, unanswered: ArrayLike | None = None
    ) -> Array:
        """The damping matrix (n, n) [1/s] from elastic mass and stiffness (n, n).

        added (n,): whether each shape is added to the vibration modes (default: none)
        unanswered (n,): whether each of these is the static shape of loads that do no work on the modes

        Modes with a ratio are those of the body confined to its vibration shapes, V1 X = Me X diag(omega^2): without
        the static shapes added to them and, with nonlinear strain, without derivatives (`bending_damping`). With P = Me
        X,

            D = P diag(2 zeta omega) P^T + 2 zeta_1 omega_1 (Me - P P^T)

        The part of added shapes outside the modes is damped at the rate of the first mode. These shapes stand for modes
        that are not in the set, are stiffer than these, and respond quasi-statically: the ratio at their own frequency
        would damp slow motions (a wire boom at 20 rpm by 3.8 % instead of 0.6 %), and without damping they would
        vibrate for ever. Static shapes of loads that do no work on the modes (twist by a payload, in a set of bending
        modes) are damped at their own frequency instead: no mode damps the response to these loads, and many modes
        approach this limit. With as many ratios as shapes, added ones among them, each of the modes of all shapes has
        its own.

        Raises ValueError without one ratio, or one per mode.
        """
        if self.ratio is None:
            return (self.mass or 0.0) * Me + (self.stiffness or 0.0) * V1
        n = len(Me)
        ratio: Array = np.asarray(self.ratio, float)
        extra = np.zeros(n, bool) if added is None else np.asarray(added, bool)
        if ratio.shape == (n,) or extra.all():
            extra = np.zeros(n, bool)
        own = np.flatnonzero(~extra)
        if ratio.ndim and ratio.shape != (len(own),):
            raise ValueError(f"{ratio.size} damping ratios were given for {len(own)} modes; give one, or one per mode.")
        if not n or not np.any(ratio):
            return np.zeros((n, n))
        eigenvalues, X = dense_modes(V1[np.ix_(own, own)], Me[np.ix_(own, own)])
        P, rate = Me[:, own] @ X, 2 * ratio * np.sqrt(np.maximum(eigenvalues, 0.0))
        D = (P * rate) @ P.T
        if len(own) < n:
            D += rate[0] * (Me - P @ P.T)
        if len(own) < n and unanswered is not None:  # M- and K-orthogonal to each other and to the modes
            k = np.flatnonzero(np.asarray(unanswered, bool))
            mass = np.diag(Me)[k]
            D[k, k] += 2 * np.ravel(ratio)[0] * np.sqrt(mass * np.diag(V1)[k]) - rate[0] * mass
        return (D + D.T) / 2
