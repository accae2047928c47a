"""Small motions about an equilibrium: eigenvalues, shapes, which of them grow, and what is known to do neither.

One linearisation for equilibria, Campbell diagrams and system modes:

    M dxi'' + D dxi' + K dxi = 0

about a state at rest in the base frame (inertial, spinning, or orbital), D with damping and gyroscopic forces. Known
motions (`femflex.dynamics.equilibria.rigid_motions`) span an invariant space R of the states (dxi, dxi'): with S
orthogonal to it the matrix of the equations over (R, S) is block triangular, and its block over S has exactly the
eigenvalues of all other motions. What is left has no double zeros of drift.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from femflex.dynamics.equilibria.body_motions import BodyMotion, body_motions
from femflex.dynamics.equilibria.linearised import frame_rate, free_directions, linearised, usual_sizes
from femflex.dynamics.equilibria.rigid_motions import KnownMotion, KnownMotions, known_motions
from femflex.dynamics.equilibria.states import moving_states
from femflex.dynamics.model import Model

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

GROWING = 1e-8  # real part over the larger of |eigenvalue| and the frame's rate; differences of forces leave 1e-10
SLOWEST = 1e-12  # of the fastest natural frequency squared: the unit of time of coordinates without stiffness
DEPENDENT = 1e-9  # of the largest, below which a known motion is one of the others
SINGULAR = 1e-8  # relative distance of an eigenvalue to a known one at which shapes are not resolved against it


@dataclass(frozen=True, eq=False)
class SmallMotions:
    """Motions shape exp(eigenvalue t) about an equilibrium, by rising frequency; known ones apart.

    eigenvalues (n,)     [1/s]: of a conjugate pair the one above the real axis; of two real ones that belong together
                         (both directions of a buckling, both rates of an overdamped motion) the larger
    shapes      (n_u, n) increments of the coordinates, of mass 1: conj(shape) . M shape
    spectrum    (m,)     every eigenvalue but those of known motions, by rising size
    known       motions that neither grow nor decay: drift of a free craft, tilt of its spin axis, free joints
    M           (n_u, n_u) mass matrix
    rate        of the base frame [rad/s]: spin, or mean motion of the orbit
    bodies      name -> motion along each coordinate
    """

    eigenvalues: Complex
    shapes: Complex
    spectrum: Complex
    known: tuple[KnownMotion, ...]
    M: Array
    rate: float
    bodies: dict[str, BodyMotion]

    @property
    def frequencies(self) -> Array:
        """(n,) [Hz], 0 for a motion that does not oscillate."""
        return np.asarray(self.eigenvalues.imag) / (2 * np.pi)

    @property
    def damping_ratios(self) -> Array:
        """(n,) -Re / |eigenvalue|: below 0 grows, 1 and -1 do not oscillate."""
        size = np.abs(self.eigenvalues)
        return np.asarray(-self.eigenvalues.real / np.where(size > 0, size, 1.0))

    @property
    def growing(self) -> NDArray[np.bool_]:
        """(n,) which motions grow."""
        return np.asarray(self.eigenvalues.real > growth_threshold(self.eigenvalues, self.rate))

    @property
    def growth(self) -> float:
        """Largest real part [1/s] of all motions but the known ones; 0 where none is above 0."""
        return float(self.spectrum.real.max(initial=0.0))


def growth_threshold(eigenvalues: Complex, rate: float) -> Array:
    """Real part [1/s] above which each of the eigenvalues (n,) grows; below it may be rounding."""
    return np.asarray(GROWING * np.maximum(np.abs(eigenvalues), rate))


def growth_rule() -> str:
    """Rule for growth rates that count as unstable, in words."""
    return f"unstable above {GROWING:g} of the larger of |eigenvalue| and the rate of the frame"


def small_motions(model: Model, x: Array, neutral: Array) -> SmallMotions:
    """The small motions about the equilibrium x (n_x,) of a model; neutral (n_u, k): directions nothing resists there.

    Raises ValueError for nonholonomic constraints, and for effectors with states.
    """
    if states := moving_states(model.system):
        names = ", ".join(sorted({model.system.state_names()[k][0].rpartition(".")[0] for k in states}))
        raise ValueError(
            f"the states of {names} make the small motions more than vibrations; `femflex linearize` prints the poles "
            "of the whole craft (in Python: the eigenvalues of `linearised`)"
        )
    linear, (own, Z) = linearised(model, 0.0, x), free_directions(model, 0.0, x)
    bodies, sizes = body_motions(model, x), usual_sizes(model)
    M, D, K = (_spread(A, own, model.n_u) for A in (linear.M, linear.D, linear.K))
    known = known_motions(model, bodies, (M, D, K), Z @ neutral[own], sizes)
    modal = _Modal.of(linear.M, linear.D, linear.K)
    R = modal.known_states(known, own)
    values, columns = _eigen(modal, R)
    order = np.argsort(np.abs(values), kind="stable")
    chosen = _one_of_each(values)
    shapes = Z @ modal.shapes(columns[:, chosen])
    full = model.mass_matrix(0.0, x)
    mass = np.einsum("ik,ij,jk->k", shapes.conj(), full, shapes).real
    return SmallMotions(
        eigenvalues=values[chosen],
        shapes=shapes / np.sqrt(np.maximum(mass, 1e-300)),
        spectrum=values[order],
        known=known.motions,
        M=full,
        rate=frame_rate(model.system),
        bodies=bodies,
    )


@dataclass(frozen=True, eq=False)
class _Modal:
    """The equations in coordinates y of unit mass, dxi = phi y; states (y, y' / s), s (n,) about their frequencies.

    phi is the inverse of a Cholesky factor of the mass, soft coordinates first: the stiffness of stiff ones does not
    enter the rows of soft ones, and slow librations keep their digits next to fast vibrations (modes of K and M would
    lose them: their squares have errors of eps times the largest).
    """

    phi: Array
    inverse: Array
    s: Array
    A: Array
    K: Array
    D: Array

    @classmethod
    def of(cls, M: Array, D: Array, K: Array) -> _Modal:
        from scipy.linalg import solve_triangular

        n, mass = len(M), (M + M.T) / 2
        if not n:
            return cls(*(np.zeros((0, 0)),) * 2, np.zeros(0), *(np.zeros((0, 0)),) * 3)
        order = np.argsort(np.abs(np.diag(K)) / np.diag(mass), kind="stable")
        lower = np.linalg.cholesky(mass[np.ix_(order, order)])
        phi = np.zeros((n, n))
        phi[order] = solve_triangular(lower, np.eye(n), lower=True).T
        inverse, K, D = phi.T @ mass, phi.T @ K @ phi, phi.T @ D @ phi
        size = np.abs(np.diag(K))
        s = np.sqrt(size + (SLOWEST * size.max() or 1.0))
        A = np.block([[np.zeros((n, n)), np.diag(s)], [-K / s[:, None], -D * (s / s[:, None])]])
        return cls(phi, inverse, s, A, K, D)

    def state(self, position: Array, velocity: Array) -> Array:
        """States (2 n, k) of fields and their velocities (n, k)."""
        return np.vstack([self.inverse @ position, (self.inverse @ velocity) / self.s[:, None]])

    def shapes(self, states: Complex) -> Complex:
        """Increments (n, k) of the coordinates in states (2 n, k)."""
        return np.asarray(self.phi @ states[: len(self.s)])

    def known_states(self, known: KnownMotions, own: NDArray[np.int64]) -> Array:
        """Orthonormal states (2 n, k) that span the known motions."""
        n = len(self.s)
        if not known.motions:
            return np.zeros((2 * n, 0))
        moving, turning, rate, neutral = (
            field[own] for field in (known.moving, known.turning, known.turning_rate, known.neutral)
        )
        columns = [
            self.state(moving, 0 * moving), self.state(0 * moving, moving), self.state(turning, rate),
            self.state(neutral, 0 * neutral), self._drifting(self.inverse @ neutral),
        ]  # fmt: skip
        states = np.hstack(columns)
        states = states / np.linalg.norm(states, axis=0)
        U, sigma, _ = np.linalg.svd(states, full_matrices=False)
        return np.asarray(U[:, sigma > DEPENDENT * sigma.max(initial=0.0)])

    def _drifting(self, neutral: Array) -> Array:
        """States (2 n, m) of constant rate c along neutral directions (n, k): y' = N c, K y + D N c = 0 for some y.

        With dampers, or gyroscopic forces between such directions, there is no y for some c.
        """
        k = neutral.shape[1]
        scale = self.s
        U, sigma, Vt = np.linalg.svd(self.K / scale[:, None] / scale)
        left, push = U[:, len(scale) - k :], (self.D @ neutral) / scale[:, None]
        _, hindered, Wt = np.linalg.svd(left.T @ push)
        free = hindered <= DEPENDENT * max(1.0, float(np.abs(self.D / scale[:, None] / scale).max(initial=0.0)))
        c = Wt[free].T
        kept = len(scale) - k
        y = -(Vt[:kept].T @ ((U[:, :kept].T @ (push @ c)) / sigma[:kept, None])) / scale[:, None]
        return np.vstack([y, (neutral @ c) / scale[:, None]])


def _eigen(modal: _Modal, R: Array) -> tuple[Complex, Complex]:
    """Eigenvalues (m,) and states (2 n, m) of all motions but those of the invariant space R (2 n, k)."""
    A, k = modal.A, R.shape[1]
    if k == len(A):
        return np.zeros(0, complex), np.zeros((len(A), 0), complex)
    S = np.linalg.qr(R, mode="complete")[0][:, k:] if k else np.eye(len(A))
    values, inner = (np.asarray(part, complex) for part in np.linalg.eig(S.T @ A @ S))
    states = S @ inner
    within, pushed = R.T @ A @ R, R.T @ A @ states
    for j, value in enumerate(values) if k else ():
        part = np.linalg.lstsq(within - value * np.eye(k), -pushed[:, j], rcond=SINGULAR)[0]
        states[:, j] += R @ part
    return values, states


def _one_of_each(values: Complex) -> NDArray[np.int64]:
    """Places of the eigenvalues that stand for a motion each, by rising frequency, those that grow first."""
    oscillating, real = np.flatnonzero(values.imag > 0), np.flatnonzero(values.imag == 0)
    real = real[np.argsort(-values[real].real, kind="stable")][: (len(real) + 1) // 2]
    chosen = np.concatenate([oscillating, real])
    return np.asarray(chosen[np.lexsort((-values[chosen].real, values[chosen].imag))])


def _spread(A: Array, own: NDArray[np.int64], n: int) -> Array:
    """A matrix over the independent coordinates as one over all (n, n), zero for the others."""
    out = np.zeros((n, n))
    out[np.ix_(own, own)] = A
    return out
