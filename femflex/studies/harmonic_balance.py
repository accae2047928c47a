"""Free vibration at finite amplitude: how the frequency of a mode changes with it, by harmonic balance.

A body whose frame is held moves by f(q) + Y^T Me (Y q'' + g) = 0 (`held_motion`; Y = 1 and g = 0 unless shapes follow).
A motion at rest at t = 0 is even in time, q = sum_k c_k cos(k omega t), and every harmonic must balance:

    (2 - [k = 0]) / T int (f + Y^T Me (Y q'' + g)) cos(k omega t) dt = 0,

with the displacement of one place at t = 0 given. Newton steps, amplitude after amplitude.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from femflex.body import FlexibleBody
from femflex.fem.eigen.modes import dense_modes
from femflex.studies.held_motion import HeldMotion

Array = NDArray[np.float64]

HARMONICS = 9
STEPS = 25
DEPTH = 5  # times that a step of amplitude is halved
SINGULAR = 1e-11  # of the largest singular value, rows and columns scaled alike
CONVERGED = 1e-9  # unbalanced forces over the forces, and error of the amplitude


@dataclass(frozen=True, eq=False)
class Backbone:
    """Frequencies of free vibration over amplitudes.

    mode        number of the body's own mode, from 1
    small       its frequency for small amplitudes [rad/s]
    place       (3,) point of the skin that moves most in it [m, body frame]
    direction   (3,) unit vector it moves along
    amplitudes  (k,) its displacement when all is at rest [m]
    omega       (k,) frequencies [rad/s]
    harmonics   (k, h, n) coefficients c of the motion
    """

    mode: int
    small: float
    place: Array
    direction: Array
    amplitudes: Array
    omega: Array
    harmonics: Array


class BackboneError(RuntimeError):
    """No free vibration of some amplitude was found; `found` is the Backbone of those before it, None without any."""

    def __init__(self, text: str, found: Backbone | None) -> None:
        super().__init__(text)
        self.found = found


def backbone(body: FlexibleBody, mode: int, amplitudes: Sequence[float], harmonics: int = HARMONICS) -> Backbone:
    """The Backbone of a body's mode (from 1) at rising amplitudes [m], its frame held and its damping left out.

    Raises ValueError when there is no such mode, amplitudes do not rise from above zero, or the body has no skin, and
    BackboneError, with those that were found, when there is no motion of an amplitude.
    """
    _check(body, mode, amplitudes)
    assert body.skin is not None
    motion, n = HeldMotion(body), body.n_modes
    eigenvalues, X = dense_modes(body.strain.tangent(np.zeros(n)), motion.mass[:n, :n])
    small = float(np.sqrt(eigenvalues[mode - 1]))
    shape = np.einsum("kpa,k->pa", body.skin.shapes[:n], X[:, mode - 1])
    point = int(np.argmax(np.linalg.norm(shape, axis=1)))
    direction = shape[point] / np.linalg.norm(shape[point])
    row = body.skin.shapes[:, point] @ direction
    c, omega = np.zeros((harmonics + 1, n)), small
    c[1] = X[:, mode - 1] / (row[:n] @ X[:, mode - 1])  # per metre of amplitude
    problem, last = _Balance(motion, row), amplitudes[0]
    found: list[tuple[float, Array]] = []
    c = c * last
    place = body.skin.points[point]

    def followed_so_far() -> Backbone:
        reached = np.asarray(amplitudes[: len(found)], np.float64)
        omegas, motions = (np.array(part, np.float64) for part in zip(*found, strict=True))
        return Backbone(mode, small, place, direction, reached, omegas, motions)

    for amplitude in amplitudes:
        try:
            c, omega = problem.followed(c, omega, float(last), float(amplitude))
        except ValueError as error:
            raise BackboneError(str(error), followed_so_far() if found else None) from None
        found.append((omega, c))
        last = amplitude
    return followed_so_far()


@dataclass(frozen=True, eq=False)
class _Balance:
    """The equations of a body's motion, and the row over all shapes that tells its amplitude."""

    motion: HeldMotion
    row: Array

    def followed(self, c: Array, omega: float, last: float, amplitude: float, depth: int = 0) -> tuple[Array, float]:
        """The motion of an amplitude from that of the last one, by way of others where it lies too far."""
        order = np.arange(len(c))
        growth = (amplitude / last) ** np.where(order == 1, 1, np.where(order % 2, 3, 2))
        found = self.balanced(c * growth[:, None], omega, amplitude)
        if found is not None:
            return found
        if depth == DEPTH or amplitude == last:
            raise ValueError(
                f"no free vibration with an amplitude of {amplitude:.4g} m was found near that of {last:.4g} m; take "
                "smaller steps, or smaller amplitudes"
            )
        middle = float(np.sqrt(last * amplitude))
        return self.followed(*self.followed(c, omega, last, middle, depth + 1), middle, amplitude, depth + 1)

    def balanced(self, c: Array, omega: float, amplitude: float) -> tuple[Array, float] | None:
        """Coefficients and frequency of the motion of this amplitude, from a start near it; None if none is found."""
        h, n = c.shape
        waves, back = _waves(h)
        K = self.motion.body.strain.tangent(np.zeros(n))
        for _ in range(STEPS):
            q, q1, q2 = (wave @ c for wave in waves)
            force, inertia = back @ self.motion.elastic(q), back @ self.motion.inertia(q, q1, q2)
            reached, held = self.reached(c.sum(axis=0))
            rest, miss = force + omega**2 * inertia, amplitude - reached
            if not np.isfinite(rest).all():
                return None
            if abs(miss) < CONVERGED * amplitude and _energy(K, rest) < CONVERGED**2 * _energy(K, force):
                return c, omega
            slopes = self.motion.slopes(q, q1, q2, omega**2)
            J = sum(
                np.einsum("kt,tij,tl->kilj", back, slope, wave, optimize=True)
                for slope, wave in zip(slopes, waves, strict=True)
            ).reshape(h * n, h * n)
            whole = np.concatenate(
                [np.column_stack([J, 2 * omega * inertia.reshape(-1, 1)]), np.append(np.tile(held, h), 0.0)[None]]
            )
            step = _least_change(whole, np.append(-rest.ravel(), miss))
            c, omega = c + step[:-1].reshape(h, n), omega + float(step[-1])
        return None

    def reached(self, q: Array) -> tuple[float, Array]:
        """The amplitude [m] at coordinates (n,), and its gradient (n,)."""
        return float(self.row @ self.motion.body.amplitudes(q)), self.row @ self.motion.ties(q[None])[0]


def _waves(h: int) -> tuple[tuple[Array, Array, Array], Array]:
    """Cosines of h harmonics with their first two derivatives by phase (t, h), and what picks harmonics out (h, t)."""
    phase = 2 * np.pi * np.arange(4 * h) / (4 * h)  # products of four harmonics below h are told apart
    order = np.arange(h)
    cosine, sine = np.cos(np.outer(phase, order)), np.sin(np.outer(phase, order))
    back = cosine.T * np.where(order == 0, 1.0, 2.0)[:, None] / len(phase)
    return (cosine, -order * sine, -(order**2) * cosine), back


def _energy(K: Array, forces: Array) -> float:
    """Sum of f.K^-1 f over rows of forces (h, n): weighs soft and stiff coordinates alike."""
    return float(np.sum(forces * np.linalg.solve(K, forces.T).T))


def _least_change(A: Array, b: Array) -> Array:
    """Least solution of A x = b, rows and columns scaled: modes alike leave the plane of their motion open."""
    left, right = np.ones(len(A)), np.ones(len(A))
    for _ in range(3):
        size = np.abs(A * left[:, None] * right)
        left /= np.sqrt(size.max(axis=1))
        right /= np.sqrt(size.max(axis=0))
    scaled = A * left[:, None] * right
    return np.asarray(right * np.linalg.lstsq(scaled, left * b, rcond=SINGULAR)[0])


def _check(body: FlexibleBody, mode: int, amplitudes: Sequence[float]) -> None:
    rising = np.asarray(amplitudes, float)
    if not rising.size or not np.isfinite(rising).all() or rising[0] <= 0 or (np.diff(rising) <= 0).any():
        raise ValueError(f"amplitudes are {rising.tolist()}; give rising lengths above zero")
    if not 1 <= mode <= body.n_modes:
        raise ValueError(f"mode {mode} was asked for; the body has modes 1 to {body.n_modes}")
    if body.skin is None:
        raise ValueError("the body has no skin, so that no amplitude can be told in metres; reduce it from a mesh")
