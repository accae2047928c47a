"""Motion of every body along increments of a system's coordinates: its frame and its shapes."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from femflex.arrays import Array, ComplexArray
from femflex.body import FlexibleBody
from femflex.dynamics.linear.increments import advanced
from femflex.dynamics.linear.linearised import usual_sizes
from femflex.dynamics.model import Model
from femflex.dynamics.reports.marker_motion import base_attitude
from femflex.rotations import dcm_from_quaternion, vector_from_dcm

STEP = 1e-5  # of a coordinate's usual size: error of central differences h^2 ~ 1e-10, rounding eps / h ~ 1e-11


@dataclass(frozen=True, eq=False)
class BodyMotion:
    """A body in a state, and its motion along m increments; components in the base frame F.

    position (3,)       of its frame's origin [m];            slide (3, m) its displacement
    attitude (3, 3)     C_FB;                                 turn (3, m) its rotation vector
    delta    (n_shapes,) amplitudes of its shapes;            shape (n_shapes, m) their increments
    """

    position: Array
    attitude: Array
    delta: Array
    slide: Array
    turn: Array
    shape: Array

    def components(self, motion: ComplexArray) -> tuple[ComplexArray, ComplexArray, ComplexArray]:
        """slide, turn and shape (., k) of motions (m, k), which may be complex."""
        return self.slide @ motion, self.turn @ motion, self.shape @ motion

    def in_motions(self, motion: Array) -> BodyMotion:
        """The body along other increments, the columns of motion (m, k)."""
        return replace(self, slide=self.slide @ motion, turn=self.turn @ motion, shape=self.shape @ motion)

    def kinetic(self, body: FlexibleBody, motion: ComplexArray) -> Array:
        """Twice the kinetic energy (k,) of a body whose velocities are the motions (m, k), from its mass moments."""
        v, omega, rates = self.components(motion)
        v, omega = self.attitude.T @ v, self.attitude.T @ omega
        y = np.concatenate([[1.0], self.delta])
        W = np.zeros((v.shape[1], 3, 3), complex)  # omega x r = W r
        for a, b, c in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
            W[:, a, b], W[:, b, a] = -omega[c], omega[c]
        X = np.einsum("kab,A->kaAb", W, y)
        X[:, :, 1:, :] += np.einsum("ab,Ak->kaAb", np.eye(3), rates)
        moments = body.moments
        linear = np.einsum("ak,kaAb,Ab->k", v.conj(), X, moments.first, optimize=True)
        square = np.einsum("kaAb,AbBc,kaBc->k", X.conj(), moments.second, X, optimize=True)
        return np.asarray((moments.mass * np.sum(np.abs(v) ** 2, axis=0) + 2 * linear + square).real)


def body_motions(model: Model, x: Array) -> dict[str, BodyMotion]:
    """The motion of every body along each quasi-velocity (m = n_u) from the state of rest x (n_x,)."""
    q, sizes = x[: model.n_q], usual_sizes(model) * STEP
    steps = np.eye(model.n_u) * sizes
    rows = [q, *(advanced(model, q, s) for s in steps), *(advanced(model, q, -s) for s in steps)]
    states = np.array([model.at_rest(row) for row in rows])
    channels = model.observation(np.zeros(len(states)), states)
    C_FN, n = base_attitude(model.system, np.zeros(1), channels)[0].T, model.n_u
    out = {}
    for name in model.system.order:
        C = C_FN @ dcm_from_quaternion(channels[f"bodies/{name}/attitude"])
        position, delta = channels[f"bodies/{name}/position"] @ C_FN.T, channels[f"bodies/{name}/delta"]
        turn = vector_from_dcm(C[1 : n + 1] @ np.swapaxes(C[n + 1 :], 1, 2)) / (2 * sizes[:, None])
        slide, shape = ((part[1 : n + 1] - part[n + 1 :]) / (2 * sizes[:, None]) for part in (position, delta))
        out[name] = BodyMotion(position[0], C[0], delta[0], slide.T, turn.T, shape.T)
    return out
