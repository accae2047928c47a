"""Backbone curve: frequency of a mode as a function of the amplitude of its free vibration."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from femflex.arrays import Array
from femflex.body import FlexibleBody
from femflex.fem.eigen.modes import dense_modes
from femflex.studies.branch import follow_branch
from femflex.studies.fixed_frame_motion import FixedFrameMotion
from femflex.studies.harmonic_balance import HarmonicBalance, Vibration

HARMONICS = 9


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
    _check(body, mode, amplitudes)
    assert body.skin is not None
    motion, n = FixedFrameMotion(body), body.n_modes
    eigenvalues, X = dense_modes(body.strain.tangent(np.zeros(n)), motion.mass[:n, :n])
    small = float(np.sqrt(eigenvalues[mode - 1]))
    shape = np.einsum("kpa,k->pa", body.skin.shapes[:n], X[:, mode - 1])
    point = int(np.argmax(np.linalg.norm(shape, axis=1)))
    direction = shape[point] / np.linalg.norm(shape[point])
    row = body.skin.shapes[:, point] @ direction
    shapes = np.zeros((harmonics + 1, n))
    shapes[1] = X[:, mode - 1] / (row[:n] @ X[:, mode - 1])  # per metre of amplitude
    branch = follow_branch(
        HarmonicBalance(motion, row), Vibration(0.0, small, np.zeros_like(shapes)), shapes, list(amplitudes)
    )
    curve = None
    if branch.requested:
        amplitude, omega, c = (
            np.array([getattr(vibration, name) for vibration in branch.requested])
            for name in ("amplitude", "omega", "harmonics")
        )
        path, gaps = tuple(branch.points), np.array(branch.gaps).reshape(-1, 2)
        curve = Backbone(mode, small, body.skin.points[point], direction, amplitude, omega, c, path, gaps)
    if branch.ended or curve is None:
        raise BackboneError(branch.ended or _gap_text(branch.gaps[-1]), curve)
    return curve


def _gap_text(gap: tuple[float, float]) -> str:
    return (
        f"between amplitudes of {gap[0]:.4g} and {gap[1]:.4g} m a higher harmonic is in internal "
        "resonance with another mode; request amplitudes below or above"
    )


def _check(body: FlexibleBody, mode: int, amplitudes: Sequence[float]) -> None:
    rising = np.asarray(amplitudes, float)
    if not rising.size or not np.isfinite(rising).all() or rising[0] <= 0 or (np.diff(rising) <= 0).any():
        raise ValueError(f"amplitudes are {rising.tolist()}; give rising lengths above zero")
    if not 1 <= mode <= body.n_modes:
        raise ValueError(f"mode {mode} was requested; the body has modes 1 to {body.n_modes}")
    if body.skin is None:
        raise ValueError("the body has no skin, so that no amplitude can be given in metres; reduce it from a mesh")
