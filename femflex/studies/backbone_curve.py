"""Backbone curve: frequency of a mode as a function of the amplitude of its free vibration.

The equations of harmonic balance have many solutions of an amplitude: other modes, and every motion once more as its
own k-th harmonic at 1/k of the frequency. The branch that starts in the mode is therefore followed by arc length, past
folds of amplitude or frequency (pseudo-arclength continuation: Keller, in Applications of Bifurcation Theory (1977)
359), in steps that are halved until the solution continues it. Where a higher harmonic resonates with another mode the
branch leads into the vibrations of that mode, in a tongue that is often so thin that steps pass it unnoticed. A tongue
that is noticed is stepped over, from where the branch was still straight, and reported.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from femflex.arrays import Array
from femflex.body import FlexibleBody
from femflex.fem.eigen.modes import dense_modes
from femflex.studies.harmonic_balance import FixedFrameMotion, HarmonicBalance, Vibration

HARMONICS = 9
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
NOT_FOUND = "no periodic solution is found beyond it"


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
    motion, n = FixedFrameMotion(body), body.n_modes
    eigenvalues, X = dense_modes(body.strain.tangent(np.zeros(n)), motion.mass[:n, :n])
    small = float(np.sqrt(eigenvalues[mode - 1]))
    shape = np.einsum("kpa,k->pa", body.skin.shapes[:n], X[:, mode - 1])
    point = int(np.argmax(np.linalg.norm(shape, axis=1)))
    direction = shape[point] / np.linalg.norm(shape[point])
    row = body.skin.shapes[:, point] @ direction
    shapes = np.zeros((harmonics + 1, n))
    shapes[1] = X[:, mode - 1] / (row[:n] @ X[:, mode - 1])  # per metre of amplitude
    branch = _Branch(HarmonicBalance(motion, row), Vibration(0.0, small, shapes))
    reached, problem = branch.follow(rising.tolist())
    curve = None
    if reached:
        omega, c = (np.array([getattr(vibration, name) for vibration in reached]) for name in ("omega", "harmonics"))
        path, gaps = tuple(p.vibration for p in branch.points), np.array(branch.gaps).reshape(-1, 2)
        reached_amplitudes = np.array([vibration.amplitude for vibration in reached])
        curve = Backbone(mode, small, body.skin.points[point], direction, reached_amplitudes, omega, c, path, gaps)
    if problem or curve is None:
        raise BackboneError(problem or _gap_text(branch.gaps[-1]), curve)
    return curve


def _gap_text(gap: tuple[float, float]) -> str:
    return (
        f"between amplitudes of {gap[0]:.4g} and {gap[1]:.4g} m a higher harmonic is in internal "
        "resonance with another mode; request amplitudes below or above"
    )


@dataclass(frozen=True, eq=False)
class _Point:
    """A motion on a branch, the unit tangent (n_x,) there, and the row that measures lengths along it.

    rate   change of the amplitude [m] along the tangent
    share  of the first harmonic in the mean square of the motion about its mean, weighed by mass
    """

    vibration: Vibration
    tangent: Array
    row: Array
    rate: float
    share: float

    @property
    def amplitude(self) -> float:
        """Amplitude of the motion [m]."""
        return self.vibration.amplitude


class _Branch:
    """The branch of growing amplitude that starts in one mode, and its points in order as far as it was followed.

    mode  (h, n) [kg^1/2] harmonics at rest per metre of amplitude;  gaps  amplitudes of tongues stepped over [m]
    """

    def __init__(self, problem: HarmonicBalance, rest: Vibration) -> None:
        self.problem, self.rest = problem, rest
        self.points: list[_Point] = []
        self.gaps: list[tuple[float, float]] = []

    def follow(self, amplitudes: Sequence[float]) -> tuple[list[Vibration], str]:
        """The motions at rising amplitudes, as far as there are any, and why no more are found; empty for all."""
        if (start := self._first_point(amplitudes[0])) is None:
            return [], self._ending_text(amplitudes[0], NOT_FOUND)
        self.points, length, reached = [start], FIRST, list[Vibration]()
        for amplitude in amplitudes:
            reason, length = self._follow_to(amplitude, length)
            if reason:
                return reached, self._ending_text(amplitude, reason)
            if self.points[-1].amplitude == amplitude:
                reached.append(self.points[-1].vibration)
        return reached, ""

    @property
    def _peak(self) -> float:
        return max((point.amplitude for point in self.points), default=0.0)

    def _first_point(self, amplitude: float) -> _Point | None:
        """A point so close to rest that its motion is that of the mode, at the amplitude or below."""
        mode, omega = self.rest.harmonics, self.rest.omega
        for _ in range(60):
            vibration = self.problem.balanced(Vibration(amplitude, omega, amplitude * mode))
            if vibration is not None and vibration.omega > 0:
                c = vibration.harmonics
                change = float(np.linalg.norm(c - amplitude * mode) / np.linalg.norm(c))
                if max(change, abs(vibration.omega / omega - 1)) < FIRST:
                    return self._point(vibration, np.append(mode.ravel(), 0.0))
            amplitude /= 2
        return None

    def _follow_to(self, amplitude: float, length: float) -> tuple[str, float]:
        """Follow to an amplitude; return the reason for a failure (empty if none), and the next step length."""
        while self.points[-1].amplitude < amplitude:
            point = self._next_point(self.points[-1], length, amplitude)
            if point is None and length > SHORTEST:
                length /= 2
                continue
            if reason := self._reason_to_reject(point):
                peak = self._peak
                point, length = self._beyond_tongue(amplitude), FIRST
                if point is None:
                    return reason, length
                self.gaps.append((peak, point.amplitude))
            assert point is not None
            self.points.append(point)
            length = min(LONGEST, 1.5 * length)
        return "", length

    def _reason_to_reject(self, point: _Point | None) -> str:
        """Reason why a point does not belong to the branch; empty if it does."""
        if point is None:
            return f"{NOT_FOUND} (possibly an internal resonance with another mode)"
        hertz = point.vibration.omega / (2 * np.pi)
        if point.share < LEADING:
            return (
                f"the next solution, at {hertz:.4g} Hz, is another motion: its first harmonic has a share of "
                f"{point.share:.2g} (limit {LEADING:g})"
            )
        if point.amplitude < FALLEN * self._peak:
            return f"the branch turns back there, to {point.amplitude:.4g} m at {hertz:.4g} Hz"
        return f"it was followed over {POINTS} steps" if len(self.points) >= POINTS else ""

    def _ending_text(self, amplitude: float, reason: str) -> str:
        last = max((point.vibration for point in self.points), key=lambda v: v.amplitude, default=self.rest)
        last_text = f"{last.amplitude:.4g} m at {last.omega / (2 * np.pi):.4g} Hz" if last.amplitude else "rest"
        return (
            f"no free vibration with an amplitude of {amplitude:.4g} m was found; the branch was followed up to "
            f"{last_text}: {reason}. Request smaller amplitudes"
        )

    def _beyond_tongue(self, amplitude: float) -> _Point | None:
        """The point of least amplitude beyond a tongue, or that of a requested amplitude; None if none is found."""
        peak, turn = self._peak, int(np.argmax([point.amplitude for point in self.points]))
        before = self.points[: turn + 1]
        least = OUTSIDE_SHARE * max(point.share for point in before)
        outside = [point for point in before if point.share > least]
        for point in (outside[-back] for back in BACK if back <= len(outside)):
            length = max(SHORT, (peak - point.amplitude) / point.rate) if point.rate > 0 else np.inf
            while length < FARTHEST:
                far = self._next_point(point, length, np.inf)
                if far is not None and far.amplitude > (1 + CLEAR) * peak and far.share > least:
                    return self._far_side(peak, far, amplitude)
                length *= 1.5
        return None

    def _far_side(self, peak: float, point: _Point, amplitude: float) -> _Point:
        """The point at the far side of a tongue, or of a requested amplitude, reached downwards from a point beyond."""
        lowest = amplitude if peak < amplitude < point.amplitude else peak
        step = (point.amplitude - lowest) / 2
        while point.amplitude > lowest and step > LEAST * peak:
            lower = self._at_smaller_amplitude(point, max(lowest, point.amplitude - step))
            if lower is None:
                step /= 2
            else:
                point = lower
        return point

    # steps along the branch

    def _point(self, vibration: Vibration, row: Array) -> _Point:
        """The point of a motion, its tangent along a row."""
        tangent = self.problem.tangent(vibration, row)
        metric = self.problem.metric_row(vibration, tangent)
        length, squares = float(np.sqrt(metric @ tangent)), self.problem.weights(vibration.harmonics)[1:]
        rate = float(self.problem.amplitude_row(vibration.harmonics) @ tangent) / length
        return _Point(vibration, tangent / length, metric / length, rate, float(squares[0] / squares.sum()))

    def _next_point(self, point: _Point, length: float, largest: float) -> _Point | None:
        """The point one step ahead, or that of amplitude `largest` if it comes first; None where the branch ends."""
        if point.rate > 0 and point.amplitude + length * point.rate >= largest:
            return self._continued(point, (largest - point.amplitude) / point.rate, largest)
        ahead = self._continued(point, length, None)
        return self._at_smaller_amplitude(ahead, largest) if ahead is not None and ahead.amplitude > largest else ahead

    def _at_smaller_amplitude(self, point: _Point, amplitude: float) -> _Point | None:
        """The point of a smaller amplitude, back along the branch; None where the branch does not continue there."""
        if point.rate <= 0:
            return None
        return self._continued(point, (amplitude - point.amplitude) / point.rate, amplitude)

    def _continued(self, point: _Point, length: float, amplitude: float | None) -> _Point | None:
        """The point one step ahead, if it continues the branch: on the normal there, or with an amplitude."""
        x = point.vibration.x + length * point.tangent
        start = Vibration(amplitude or 0.0, float(x[-1]), x[:-1].reshape(point.vibration.harmonics.shape))
        solution = self.problem.balanced(start, point.row if amplitude is None else None) if start.omega > 0 else None
        if solution is None or solution.omega <= 0:
            return None
        ahead, miss = self._point(solution, point.row), solution.x - x
        size, off = (float(np.sqrt(d @ self.problem.metric_row(point.vibration, d))) for d in (ahead.tangent, miss))
        return ahead if off < OFF * abs(length) and point.row @ ahead.tangent > STRAIGHT * size else None
