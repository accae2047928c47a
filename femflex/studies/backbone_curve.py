"""Backbone curve: frequency of a mode as a function of the amplitude of its free vibration, with a fixed body frame.

With the amplitudes eta = (q, y) of all shapes, y_s = q.A_s q / 2 (condensed form, THEORY section 3), and Me their mass,
a free vibration makes the mean of V(q) - eta'.Me eta' / 2 stationary. A motion at rest at t = 0 is even in time,
q = sum_k c_k cos(k omega t), and harmonic balance asks this of every c_k, with a prescribed displacement of one point.

These equations have many solutions: other modes, and every motion once more as its own k-th harmonic at 1/k of the
frequency. The branch that starts in the mode is therefore followed by arc length, past folds of amplitude or frequency
(Keller, in Applications of Bifurcation Theory (1977) 359), in steps that are halved until the solution continues it.
Where a higher harmonic resonates with another mode the branch leads into the vibrations of that mode, in a tongue that
is often so thin that steps pass it unnoticed. A tongue that is noticed is stepped over, from where the branch was still
straight, and reported.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from femflex.arrays import Array
from femflex.body import FlexibleBody
from femflex.fem.eigen.shift_invert import dense_modes

HARMONICS = 9
NEWTON_STEPS, CONVERGED = 12, 1e-9  # unbalanced forces over the forces, and error of the amplitude
SINGULAR = 1e-11  # of the largest singular value, rows and columns scaled alike
FIRST, LONGEST, SHORTEST = 0.1, 0.3, 1e-4  # steps along the arc
POINTS = 400  # of one branch
FALLEN = 0.5  # amplitude over the largest one at which the branch is taken to turn back
OFF = 0.3  # distance from the prediction over the step above which the solution may be on another branch
STRAIGHT = 0.9  # cosine between the tangents of two neighbours
LEADING = 0.5  # share that the first harmonic has in a motion of the branch
OUTSIDE_SHARE = 0.95  # of the largest share before: points below it are in the tongue already
SHORT, FARTHEST = 0.02, 2.0  # steps over a tongue along the arc
BACK = (1, 2, 3, 4, 6, 9, 13)  # which of the last points outside the tongue the steps start from
CLEAR = 2e-3  # relative increase of amplitude from which on a point counts as beyond the tongue
LEAST = 5e-3  # of an amplitude: smallest step of the search for the far side


@dataclass(frozen=True, eq=False)
class Vibration:
    """A free vibration: amplitude () [m], omega () [rad/s], and its harmonics c (h, n); x (n_x,) is c and omega.

    tangent  (n_x,) unit vector along the branch, and the row that measures lengths along it
    rate     change of the amplitude [m] along the tangent
    share    of the first harmonic in the mean square of the motion about its mean, weighed by mass
    """

    amplitude: float
    omega: float
    harmonics: Array
    x: Array
    tangent: Array
    row: Array
    rate: float
    share: float


@dataclass(frozen=True, eq=False)
class Backbone:
    """Frequencies of free vibration over amplitudes.

    mode        number of the body's own mode, from 1
    small       its frequency for small amplitudes [rad/s]
    place       (3,) point of the skin that moves most in it [m, body frame]
    direction   (3,) unit vector it moves along
    amplitudes  (k,) displacement of the point when the body is instantaneously at rest [m]
    omega       (k,) frequencies [rad/s]
    harmonics   (k, h, n) coefficients c of the motion
    path        all motions in order along the branch, around its folds
    gaps        (g, 2) amplitudes between which a tongue of another mode's vibrations was stepped over [m]
    """

    mode: int
    small: float
    place: Array
    direction: Array
    amplitudes: Array
    omega: Array
    harmonics: Array
    path: tuple[Vibration, ...]
    gaps: Array


class BackboneError(RuntimeError):
    """No free vibration of some amplitude was found; `backbone` has those of smaller amplitude, None without any."""

    def __init__(self, text: str, backbone: Backbone | None) -> None:
        super().__init__(text)
        self.backbone = backbone


def backbone(body: FlexibleBody, mode: int, amplitudes: Sequence[float], harmonics: int = HARMONICS) -> Backbone:
    """The Backbone of a body's mode (from 1) at rising amplitudes [m], with a fixed body frame and without damping.

    Amplitudes at which the branch is in the vibrations of another mode are left out; `gaps` lists them.

    Raises ValueError when there is no such mode, amplitudes do not rise from above zero, or the body has no skin, and
    BackboneError, with the motions found so far, when there is no motion of an amplitude.
    """
    rising = np.asarray(amplitudes, float)
    if not rising.size or not np.isfinite(rising).all() or rising[0] <= 0 or (np.diff(rising) <= 0).any():
        raise ValueError(f"amplitudes are {rising.tolist()}; give rising lengths above zero")
    if not 1 <= mode <= body.n_modes:
        raise ValueError(f"mode {mode} was requested; the body has modes 1 to {body.n_modes}")
    if body.skin is None:
        raise ValueError("the body has no skin, so that no amplitude can be given in metres; reduce it from a mesh")
    n = body.n_modes
    eigenvalues, X = dense_modes(body.strain.tangent(np.zeros(n)), body.moments.elastic_mass()[:n, :n])
    small = float(np.sqrt(eigenvalues[mode - 1]))
    shape = np.einsum("kpa,k->pa", body.skin.shapes[:n], X[:, mode - 1])
    point = int(np.argmax(np.linalg.norm(shape, axis=1)))
    direction = shape[point] / np.linalg.norm(shape[point])
    row = body.skin.shapes[:, point] @ direction
    rest = np.zeros((harmonics + 1, n))
    rest[1] = X[:, mode - 1] / (row[:n] @ X[:, mode - 1])  # per metre of amplitude
    points, gaps, reached, problem = _followed(HarmonicBalance(body, row, len(rest)), rest, small, rising.tolist())
    curve = None
    if reached:
        omega, c = (np.array([getattr(vibration, key) for vibration in reached]) for key in ("omega", "harmonics"))
        sizes, place = np.array([vibration.amplitude for vibration in reached]), body.skin.points[point]
        tongues = np.array(gaps).reshape(-1, 2)
        curve = Backbone(mode, small, place, direction, sizes, omega, c, tuple(points), tongues)
    if problem or curve is None:
        gap_text = "between amplitudes of {:.4g} and {:.4g} m a higher harmonic is in internal resonance with another"
        raise BackboneError(problem or gap_text.format(*gaps[-1]) + " mode; request amplitudes below or above", curve)
    return curve


@dataclass(frozen=True, eq=False)
class HarmonicBalance:
    """Equations of the h harmonics of a body's free motion, x = (c (h, n), omega), and steps from one to the next.

    row: over all shapes, gives the amplitude
    """

    body: FlexibleBody
    row: Array
    h: int

    @cached_property
    def mass(self) -> Array:
        """Elastic mass Me (n + n_s, n + n_s) [1] of all shapes."""
        return self.body.moments.elastic_mass()

    @cached_property
    def waves(self) -> Array:
        """Cosines of the harmonics and their derivative by phase (2, t, h)."""
        phase = 2 * np.pi * np.arange(4 * self.h) / (4 * self.h)  # products of four harmonics are distinguished
        order = np.arange(self.h)
        return np.stack([np.cos(np.outer(phase, order)), -order * np.sin(np.outer(phase, order))])

    def forces(self, x: Array) -> tuple[Array, Array, Array]:
        """Mean elastic and inertia forces (h, n) [SI] of the harmonics, and the derivatives of their sum (h n, n_x)."""
        n, omega, strain = self.body.n_modes, float(x[-1]), self.body.strain
        q, q1 = self.waves @ x[:-1].reshape(self.h, n)
        A = self.body.slaves.reshape(-1, n, n)
        Y = np.concatenate([np.broadcast_to(np.eye(n), (len(q), n, n)), np.einsum("sij,tj->tsi", A, q)], axis=1)
        Z = np.concatenate([np.zeros((len(q), n, n)), np.einsum("sij,tj->tsi", A, q1)], axis=1)  # of Y q' by q
        momentum = np.einsum("tai,ti->ta", Y, q1) @ self.mass
        by_both = np.stack([Z, Y])
        elastic = np.stack([strain.force(row) for row in q])
        inertia = -np.einsum("btai,ta->bti", by_both, momentum)
        H = -np.einsum("btai,ac,dtcj->bdtij", by_both, self.mass, by_both, optimize=True)
        mixed = np.einsum("ts,sij->tij", momentum[:, n:], A)
        H[0, 1] -= mixed
        H[1, 0] -= mixed
        H *= omega**2
        H[0, 0] += np.stack([strain.tangent(row) for row in q])
        mean_inertia = np.einsum("btk,bti->ki", self.waves, inertia) / len(q)
        J = np.einsum("btk,bdtij,dtl->kilj", self.waves, H, self.waves, optimize=True).reshape(2 * (self.h * n,))
        by_omega = 2 * omega * mean_inertia.ravel()
        return self.waves[0].T @ elastic / len(q), omega**2 * mean_inertia, np.column_stack([J / len(q), by_omega])

    def amplitude_and_row(self, x: Array) -> tuple[float, Array]:
        """The amplitude [m] of a motion x (n_x,), and its derivative (n_x,)."""
        n = self.body.n_modes
        q = x[:-1].reshape(self.h, n).sum(axis=0)
        gradient = self.row[:n] + np.einsum("s,sij,j->i", self.row[n:], self.body.slaves.reshape(-1, n, n), q)
        return float(self.row @ self.body.amplitudes(q)), np.append(np.tile(gradient, self.h), 0.0)

    def balanced(self, start: Array, target: float | Array) -> Array | None:
        """The motion near a start (n_x,) that has this amplitude [m]; None if none is found.

        target: or a row (n_x,) to which the change from the start is orthogonal
        """
        x, K = start, self.body.strain.tangent(np.zeros(self.body.n_modes))

        def energy(forces: Array) -> float:  # gives soft and stiff coordinates the same weight
            return float(np.sum(forces * np.linalg.solve(K, forces.T).T))

        for _ in range(NEWTON_STEPS):
            elastic, inertia, J = self.forces(x)
            if not np.isfinite(inertia).all():
                return None
            if isinstance(target, float):
                amplitude, row = self.amplitude_and_row(x)
                error, size = target - amplitude, target
            else:
                error, row, size = float(target @ (start - x)), target, 1.0
            if abs(error) < CONVERGED * size and energy(elastic + inertia) < CONVERGED**2 * energy(elastic):
                return x if x[-1] > 0 else None
            x = x + _least_change(np.vstack([J, row]), np.append(-(elastic + inertia).ravel(), error))
        return None

    def length(self, x: Array, change: Array) -> tuple[float, Array]:
        """Length of a change (n_x,) at x, and the row (n_x,) whose product with a change is the inner product with it.

        |dx|^2 = sum_k dc_k.Me dc_k / sum_k c_k.Me c_k + (d omega / omega)^2: a length of 0.1 changes by a tenth.
        """
        n = self.body.n_modes
        weighed = change[:-1].reshape(self.h, n) @ self.mass[:n, :n]
        row = np.append(weighed.ravel() / self._squares(x).sum(), change[-1] / x[-1] ** 2)
        return float(np.sqrt(row @ change)), row

    def _squares(self, x: Array) -> Array:
        """Twice the mean square (h,) [kg m^2] of each harmonic, weighed by mass."""
        n = self.body.n_modes
        c = x[:-1].reshape(self.h, n)
        return np.einsum("ki,ij,kj->k", c, self.mass[:n, :n], c)

    def vibration(self, x: Array, row: Array, amplitude: float | None = None) -> Vibration:
        """The motion x with its tangent along a row."""
        tangent = _least_change(np.vstack([self.forces(x)[2], row]), np.append(np.zeros(len(x) - 1), 1.0))
        length, metric = self.length(x, tangent)
        (present, slope), squares = self.amplitude_and_row(x), self._squares(x)[1:]
        c, rate, share = x[:-1].reshape(self.h, -1), float(slope @ tangent) / length, float(squares[0] / squares.sum())
        size = present if amplitude is None else amplitude
        return Vibration(size, float(x[-1]), c, x, tangent / length, metric / length, rate, share)

    def stepped(self, point: Vibration, length: float, largest: float = np.inf) -> Vibration | None:
        """The point one step ahead, or that of amplitude `largest` if it comes first; None where the branch ends."""
        if point.rate > 0 and point.amplitude + length * point.rate >= largest:
            return self.at_amplitude(point, largest)
        ahead = self._continued(point, length, point.row)
        return self.at_amplitude(ahead, largest) if ahead is not None and ahead.amplitude > largest else ahead

    def at_amplitude(self, point: Vibration, amplitude: float) -> Vibration | None:
        """The point of an amplitude near by; None where the branch does not continue there."""
        return self._continued(point, (amplitude - point.amplitude) / point.rate, amplitude) if point.rate > 0 else None

    def _continued(self, point: Vibration, length: float, target: float | Array) -> Vibration | None:
        x = point.x + length * point.tangent
        solution = self.balanced(x, target) if x[-1] > 0 else None
        if solution is None:
            return None
        ahead = self.vibration(solution, point.row, target if isinstance(target, float) else None)
        size, off = (self.length(point.x, change)[0] for change in (ahead.tangent, solution - x))
        return ahead if off < OFF * abs(length) and point.row @ ahead.tangent > STRAIGHT * size else None


def _least_change(A: Array, b: Array) -> Array:
    """Minimum-norm solution of A x = b, rows and columns scaled: equal modes leave the plane of motion free."""
    row_scale, column_scale = np.ones(len(A)), np.ones(len(A))
    for _ in range(3):
        size = np.abs(A * row_scale[:, None] * column_scale)
        row_scale /= np.sqrt(size.max(axis=1))
        column_scale /= np.sqrt(size.max(axis=0))
    scaled = A * row_scale[:, None] * column_scale
    return np.asarray(column_scale * np.linalg.lstsq(scaled, row_scale * b, rcond=SINGULAR)[0])


def _followed(
    problem: HarmonicBalance, mode: Array, small: float, amplitudes: Sequence[float]
) -> tuple[list[Vibration], list[tuple[float, float]], list[Vibration], str]:
    """The points of a branch, the tongues stepped over, those of these amplitudes, and why no more are found.

    mode: (h, n) harmonics near rest per metre of amplitude;  small: its frequency [rad/s]
    """
    points, gaps, reached, length = list[Vibration](), list[tuple[float, float]](), list[Vibration](), FIRST
    first = amplitudes[0]
    for _ in range(60):  # to where the motion is that of the mode
        start = np.append(first * mode.ravel(), small)
        x = problem.balanced(start, first)
        if x is not None:
            off = np.linalg.norm((x - start)[:-1]) / np.linalg.norm(x[:-1])
            if max(off, abs(x[-1] / small - 1)) < FIRST:
                points = [problem.vibration(x, np.append(mode.ravel(), 0.0), first)]
                break
        first /= 2
    reason = "" if points else "no periodic solution is found beyond it"
    for amplitude in amplitudes:
        while not reason and points[-1].amplitude < amplitude:
            point = problem.stepped(points[-1], length, amplitude)
            if point is None and length > SHORTEST:
                length /= 2
                continue
            peak = max(each.amplitude for each in points)
            if refusal := _refusal(point, peak, len(points)):
                point, length = _beyond_tongue(problem, points, amplitude), FIRST
                if point is None:
                    reason = refusal
                    break
                gaps.append((peak, point.amplitude))
            assert point is not None
            points.append(point)
            length = min(LONGEST, 1.5 * length)
        if reason:
            last = max(points, key=lambda each: each.amplitude, default=None)
            last_text = f"{last.amplitude:.4g} m at {last.omega / (2 * np.pi):.4g} Hz" if last else "rest"
            reason = (
                f"no free vibration with an amplitude of {amplitude:.4g} m was found; the branch was followed up to "
                f"{last_text}: {reason}. Request smaller amplitudes"
            )
            break
        if points[-1].amplitude == amplitude:
            reached.append(points[-1])
    return points, gaps, reached, reason


def _refusal(point: Vibration | None, peak: float, count: int) -> str:
    """Reason why a point does not belong to the branch; empty if it does."""
    if point is None:
        return "no periodic solution is found beyond it (possibly an internal resonance with another mode)"
    text = f"{point.amplitude:.4g} m at {point.omega / (2 * np.pi):.4g} Hz"
    if point.share < LEADING:
        return f"the next solution, {text}, is another motion: its first harmonic has a share of {point.share:.2g}"
    if point.amplitude < FALLEN * peak:
        return f"the branch turns back there, to {text}"
    return f"it was followed over {POINTS} steps" if count >= POINTS else ""


def _beyond_tongue(problem: HarmonicBalance, points: list[Vibration], amplitude: float) -> Vibration | None:
    """The point of least amplitude beyond a tongue, or that of a requested amplitude; None if none is found."""
    turn = int(np.argmax([point.amplitude for point in points]))
    peak, before = points[turn].amplitude, points[: turn + 1]
    least = OUTSIDE_SHARE * max(point.share for point in before)
    outside = [point for point in before if point.share > least]
    for point in (outside[-back] for back in BACK if back <= len(outside)):
        length = max(SHORT, (peak - point.amplitude) / point.rate) if point.rate > 0 else np.inf
        while length < FARTHEST:
            far = problem.stepped(point, length)
            if far is None or far.amplitude <= (1 + CLEAR) * peak or far.share <= least:
                length *= 1.5
                continue
            lowest = amplitude if peak < amplitude < far.amplitude else peak  # down to the tongue's far side
            step = (far.amplitude - lowest) / 2
            while far.amplitude > lowest and step > LEAST * peak:
                lower = problem.at_amplitude(far, max(lowest, far.amplitude - step))
                far, step = (far, step / 2) if lower is None else (lower, step)
            return far
    return None
