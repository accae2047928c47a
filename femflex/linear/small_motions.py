"""Small motions about an equilibrium: eigenvalues, shapes, which of them grow, and which certainly do not.

One linearisation for equilibria, Campbell diagrams and system modes:

    M dxi'' + D dxi' + K dxi + R dz = 0,    dz' = F_x dxi + F_u dxi' + F_z dz

about a state at rest in the base frame (inertial, spinning, or orbital), D with damping and gyroscopic forces, z the
states of effectors, if any. Known motions (`femflex.linear.rigid_motions`) span an invariant space of the
states (dxi, dxi', dz): with S orthogonal to it the matrix of the equations over both is block triangular, and its block
over S has exactly the eigenvalues of all other motions. What is left has no double zeros of drift. Of a craft whose
effectors have states, known motions are those that these leave alone, and rests of states that drive nothing.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from femflex.arrays import Array, BoolArray, ComplexArray, IntArray
from femflex.dynamics.model import Model
from femflex.dynamics.motion.freedoms import frame_rate
from femflex.linear.equations import linearised
from femflex.linear.rigid_motions import BodyMotion, KnownMotion, KnownMotions, body_motions, known_motions
from femflex.linear.states import StateEquations, effector_states

ROUNDING = 1e-11  # of the stiffness that differences of forces lose: eps over their step
GROWING = 1e-8  # real part over the larger of |eigenvalue| and the frame's rate; differences of forces leave 1e-10
SLOWEST = 1e-12  # of the fastest natural frequency squared: the unit of time of coordinates without stiffness
DEPENDENT = 1e-9  # of the largest, below which a known motion is one of the others
STILL = 1e-12  # of the largest singular value of the equations, below which a state stays wherever it is put
SAME_DIRECTION = 0.9  # cosine between a rest and a rigid motion whose name it bears
DECISIVE_SHARE = 0.5  # participation of the states of effectors from which on a motion is theirs
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
    driven      whether effectors have states, which may resist rigid motion
    owners      (n,) names of states of effectors: of a motion that is mostly theirs the first of them, else ""
    thresholds  (n,) real part [1/s] above which a motion grows; spectrum_thresholds (m,) likewise
    """

    eigenvalues: ComplexArray
    shapes: ComplexArray
    spectrum: ComplexArray
    known: tuple[KnownMotion, ...]
    M: Array
    rate: float
    bodies: dict[str, BodyMotion]
    driven: bool
    owners: tuple[str, ...]
    thresholds: Array
    spectrum_thresholds: Array

    def of_craft(self) -> SmallMotions:
        """Return the motions without those that are mostly of states of effectors."""
        of_bodies = np.array([not owner for owner in self.owners], bool)
        owners = ("",) * int(of_bodies.sum())
        return replace(
            self, eigenvalues=self.eigenvalues[of_bodies], shapes=self.shapes[:, of_bodies], owners=owners,
            thresholds=self.thresholds[of_bodies],
        )  # fmt: skip

    @property
    def frequencies(self) -> Array:
        """(n,) [Hz], 0 for a motion that does not oscillate."""
        return np.asarray(self.eigenvalues.imag) / (2 * np.pi)

    @property
    def growing(self) -> BoolArray:
        """(n,) which motions grow."""
        return np.asarray(self.eigenvalues.real > self.thresholds)


def growth_threshold(eigenvalues: ComplexArray, rate: float) -> Array:
    """Real part [1/s] above which each of the eigenvalues (n,) grows; below it may be rounding."""
    return np.asarray(GROWING * np.maximum(np.abs(eigenvalues), rate))


def _rounding_growth(values: ComplexArray, shapes: ComplexArray, K: Array) -> Array:
    """Real part [1/s] that each of the eigenvalues (n,) may owe to rounding of the stiffness K (n_u, n_u).

    Of a motion of unit mass that rounding is ROUNDING times the energies of its coordinates, each alone: much for a
    small craft that turns about the end of a long tether, whose torques nearly cancel. shapes: (n_u, n).
    """
    weights = np.sqrt(np.abs(np.diag(K))) @ np.abs(shapes)
    return np.asarray(ROUNDING * weights**2 / (2.0 * np.maximum(np.abs(values), 1e-300)))


def growth_rule() -> str:
    """Rule for growth rates that count as unstable, in words."""
    return f"stability limit {GROWING:g} of |eigenvalue| or of the rate of the frame"


def small_motions(model: Model, x: Array, neutral: Array) -> SmallMotions:
    """Small motions about the equilibrium x (n_x,) [SI] of a model; neutral (n_u, k): directions nothing resists there.

    Raises ValueError for nonholonomic constraints.
    """
    linear, bodies = linearised(model, 0.0, x), body_motions(model, x)
    free, Z = linear.free, linear.Z
    M, D, K = (_expanded(A, free, model.n_u) for A in (linear.M, linear.D, linear.K))
    known = known_motions(model, bodies, (M, D, K), Z @ neutral[free])
    modal = _Modal.from_matrices(linear.M, linear.D, linear.K, linear.states, effector_states(model)[1])
    R, motions = modal.known_states(known, free), known.motions
    if linear.states.names:
        R, motions = known_with_states(modal, R, motions, free, Z)
    values, columns, owners = _eigen(modal, R)
    order = np.argsort(np.abs(values), kind="stable")
    chosen = distinct_motions(values, bool(linear.states.names))
    full, shapes = model.mass_matrix(0.0, x), Z @ modal.shapes(columns)
    mass = np.einsum("ik,ij,jk->k", shapes.conj(), full, shapes).real
    shapes = shapes / np.sqrt(np.maximum(mass, 1e-300))
    thresholds = np.maximum(growth_threshold(values, frame_rate(model.system)), _rounding_growth(values, shapes, K))
    return SmallMotions(
        eigenvalues=values[chosen],
        shapes=shapes[:, chosen],
        spectrum=values[order],
        thresholds=thresholds[chosen],
        spectrum_thresholds=thresholds[order],
        known=motions,
        M=full,
        rate=frame_rate(model.system),
        bodies=bodies,
        driven=bool(linear.states.names),
        owners=tuple(owners[k] for k in chosen),
    )


def spectrum(M: Array, D: Array, K: Array) -> ComplexArray:
    """Eigenvalues (2 n,) [1/s] of M dxi'' + D dxi' + K dxi = 0 by rising size, known motions and all."""
    modal = _Modal.from_matrices(M, D, K, StateEquations.empty(len(M)), np.zeros(0))
    values = np.asarray(np.linalg.eigvals(modal.A), complex)
    return values[np.argsort(np.abs(values), kind="stable")]


@dataclass(frozen=True, eq=False)
class _Modal:
    """The equations in coordinates y of unit mass, dxi = phi y; states (y, y' / s, z), s (n,) about their frequencies.

    phi is the inverse of a Cholesky factor of the mass, soft coordinates first: the stiffness of stiff ones does not
    enter the rows of soft ones, and slow librations keep their digits next to fast vibrations (modes of K and M would
    lose them: their squares have errors of eps times the largest). States z of effectors in their usual sizes.
    """

    phi: Array
    inverse: Array
    s: Array
    A: Array
    K: Array
    D: Array
    names: tuple[str, ...]

    @classmethod
    def from_matrices(cls, M: Array, D: Array, K: Array, z: StateEquations, sizes: Array) -> _Modal:
        from scipy.linalg import solve_triangular

        n, mass = len(M), (M + M.T) / 2
        F_z = z.F_z * sizes / sizes[:, None]
        if not n:
            return cls(*(np.zeros((0, 0)),) * 2, np.zeros(0), F_z, *(np.zeros((0, 0)),) * 2, z.names)
        order = np.argsort(np.abs(np.diag(K)) / np.diag(mass), kind="stable")
        lower = np.linalg.cholesky(mass[np.ix_(order, order)])
        phi = np.zeros((n, n))
        phi[order] = solve_triangular(lower, np.eye(n), lower=True).T
        inverse, K, D = phi.T @ mass, phi.T @ K @ phi, phi.T @ D @ phi
        size = np.abs(np.diag(K))
        s = np.sqrt(size + (SLOWEST * size.max() or 1.0))
        A = np.block([
            [np.zeros((n, n)), np.diag(s), np.zeros((n, len(sizes)))],
            [-K / s[:, None], -D * (s / s[:, None]), -(phi.T @ z.R) * sizes / s[:, None]],
            [z.F_x @ phi / sizes[:, None], z.F_u @ phi * s / sizes[:, None], F_z],
        ])  # fmt: skip
        return cls(phi, inverse, s, A, K, D, z.names)

    def state(self, position: Array, velocity: Array) -> Array:
        """Return states (2 n + m, k) of fields and their velocities (n, k), with the states of effectors unchanged."""
        return self._with_zero_states(self.inverse @ position, (self.inverse @ velocity) / self.s[:, None])

    def _with_zero_states(self, y: Array, rate: Array) -> Array:
        return np.vstack([y, rate, np.zeros((len(self.names), y.shape[1]))])

    def shapes(self, states: ComplexArray) -> ComplexArray:
        """Increments (n, k) of the coordinates in states (2 n + m, k)."""
        return np.asarray(self.phi @ states[: len(self.s)])

    def known_states(self, known: KnownMotions, free: IntArray) -> Array:
        """Orthonormal states (2 n + m, k) that span the known motions."""
        if not known.motions:
            return np.zeros((len(self.A), 0))
        moving, turning, rate, neutral = (
            field[free] for field in (known.moving, known.turning, known.turning_rate, known.neutral)
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
        null_left, push = U[:, len(scale) - k :], (self.D @ neutral) / scale[:, None]
        _, hindered, Wt = np.linalg.svd(null_left.T @ push)
        free = hindered <= DEPENDENT * max(1.0, float(np.abs(self.D / scale[:, None] / scale).max(initial=0.0)))
        c = Wt[free].T
        rank = len(scale) - k
        y = -(Vt[:rank].T @ ((U[:, :rank].T @ (push @ c)) / sigma[:rank, None])) / scale[:, None]
        return self._with_zero_states(y, (neutral @ c) / scale[:, None])

    def invariant_subspace(self, R: Array) -> Array:
        """The largest invariant space within the span of R (2 n + m, k)."""
        scale = float(np.linalg.norm(self.A, 2)) or 1.0
        while R.shape[1]:
            image = self.A @ R
            _, sigma, Vt = np.linalg.svd(image - R @ (R.T @ image))
            invariant = Vt[int((sigma > DEPENDENT * scale).sum()) :].T
            if invariant.shape[1] == R.shape[1]:
                break
            R = R @ invariant
        return R

    def rest_states(self, R: Array) -> list[Array]:
        """Return states (2 n + m, k) that remain constant, then those with a constant rate, and so on.

        Each step beyond the invariant space R and those before.
        """
        groups: list[Array] = []
        while R.shape[1] < len(self.A):
            S = np.linalg.qr(R, mode="complete")[0][:, R.shape[1] :]
            _, sigma, Vt = np.linalg.svd(S.T @ self.A @ S)
            more = S @ Vt[int((sigma > STILL * sigma.max(initial=0.0)).sum()) :].T
            if not more.shape[1]:
                break
            groups.append(more)
            R = np.hstack([R, more])
        return groups

    def motion_name(self, state: Array, motions: tuple[KnownMotion, ...], free: IntArray) -> str:
        """The motion that the coordinates of a state (2 n + m,) make, or the effector state that is most of it."""
        n, y = len(self.s), state[: len(self.s)]
        for motion in motions:
            field = self.inverse @ motion.shape[free].real
            if (
                abs(y @ field) > SAME_DIRECTION * np.linalg.norm(y) * np.linalg.norm(field) > 0
                and np.linalg.norm(y) > SINGULAR
            ):
                return motion.name
        return self.names[int(np.argmax(np.abs(state[2 * n :])))]


def known_with_states(
    modal: _Modal, R: Array, motions: tuple[KnownMotion, ...], free: IntArray, Z: Array
) -> tuple[Array, tuple[KnownMotion, ...]]:
    """The states (2 n + m, k) of known motions of a craft whose effectors have states, and these motions.

    R (2 n + m, k): those of the craft alone.
    """
    R = modal.invariant_subspace(R)
    fields = [modal.inverse @ motion.shape[free].real for motion in motions]
    states = [np.concatenate([y, np.zeros(len(modal.A) - len(y))]) for y in fields]
    known = [
        motion
        for motion, y in zip(motions, states, strict=True)
        if np.linalg.norm(y - R @ (R.T @ y)) <= SINGULAR * np.linalg.norm(y)
    ]
    others = tuple(motion for motion in motions if motion not in known)
    steps = modal.rest_states(R)
    for state in steps[0].T if steps else ():
        shape = Z @ modal.shapes(state.astype(complex))
        known.append(KnownMotion(modal.motion_name(state, others, free), 0j, len(steps) > 1, shape))
    return np.hstack([R, *steps]), tuple(known)


def _eigen(modal: _Modal, R: Array) -> tuple[ComplexArray, ComplexArray, list[str]]:
    """Return eigenvalues (k,) and states (2 n + m, k) of the motions outside the invariant space R, and their owners.

    A motion is that of states of effectors where these take more than half of the participation: |left right|.
    """
    A, k = modal.A, R.shape[1]
    if k == len(A):
        return np.zeros(0, complex), np.zeros((len(A), 0), complex), []
    S = np.linalg.qr(R, mode="complete")[0][:, k:] if k else np.eye(len(A))
    values, inner = (np.asarray(correction, complex) for correction in np.linalg.eig(S.T @ A @ S))
    states = S @ inner
    owners = [""] * len(values)
    if modal.names:
        participation = np.abs((np.linalg.pinv(inner) @ S.T).T * states)
        of_states = participation[2 * len(modal.s) :]
        dominated = of_states.sum(axis=0) > DECISIVE_SHARE * participation.sum(axis=0)
        owners = [modal.names[int(np.argmax(of_states[:, j]))] if dominated[j] else "" for j in range(len(values))]
    within, image = R.T @ A @ R, R.T @ A @ states
    for j, value in enumerate(values) if k else ():
        correction = np.linalg.lstsq(within - value * np.eye(k), -image[:, j], rcond=SINGULAR)[0]
        states[:, j] += R @ correction
    return values, states, owners


def distinct_motions(values: ComplexArray, all_real: bool) -> IntArray:
    """Return the place of one eigenvalue of each motion, growing ones first, then by rising frequency.

    every: real ones stand for a motion each, as those of filters and lags do.
    """
    oscillating, real = np.flatnonzero(values.imag > 0), np.flatnonzero(values.imag == 0)
    real = real[np.argsort(-values[real].real, kind="stable")][: len(real) if all_real else (len(real) + 1) // 2]
    selected = np.concatenate([oscillating, real])
    return np.asarray(selected[np.lexsort((-values[selected].real, values[selected].imag))])


def _expanded(A: Array, free: IntArray, n: int) -> Array:
    """A matrix over the independent coordinates as one over all (n, n), zero for the others."""
    out = np.zeros((n, n))
    out[np.ix_(free, free)] = A
    return out
