"""Harmonic motion of a craft whose commands are sampled.

A disturbance of frequency w gives the continuous state a line at w and others at w plus multiples of the rate of the
samples. At the samples all of these are one sequence z^k, z = exp(i w T), which the discrete model gives exactly:

    s = (1 - S_s / z - S_x (z - E_x)^-1 E_s)^-1 S_x (i w - A)^-1 B f

for the commands and memory s that act from a sample to the next. The line at w is that of the craft under f and the
staircase of the commands, x = (i w - A)^-1 (B f + B_s s (1 - 1/z) / (i w T)).
"""

from __future__ import annotations

import warnings
from dataclasses import dataclass

import numpy as np
from scipy.linalg import expm

from femflex.arrays import Array, ComplexArray
from femflex.effectors.constant_commands import with_held_commands
from femflex.studies.linear import LinearModel, sampled_model
from femflex.studies.linear.space import resolvent, resolvent_response
from femflex.system import System
from femflex.warning import PhysicsWarning

UNSTABLE = "the loop of the sampled controllers has a multiplier on the unit circle at the response of {s:.6g}"


@dataclass(frozen=True, eq=False)
class SampledLoop:
    """Sampled controllers about the states x (n,) of a linear model.

    B (n, m)  of commands and memory s;  samples_x (m, n), samples_s (m, m): s after a sample from x and s before it
    period [s];  poles (k,) [1/s] of the closed loop below half the rate of the samples
    """

    B: Array
    samples_x: Array
    samples_s: Array
    period: float
    poles: ComplexArray

    def closed(self, A: ComplexArray, B: Array, C: Array, omega: Array) -> ComplexArray:
        """C x (n_omega, n_out, n_c) per component of a disturbance with columns B (n, n_c), at omega [rad/s]."""
        z = np.exp(1j * omega * self.period)
        n, m, n_c = len(A), self.B.shape[1], B.shape[1]
        wide = np.zeros((n + m, n + m), complex)
        wide[:n, :n], wide[:n, n:] = A, self.B
        flow = expm(wide * self.period)
        G = resolvent_response(A, np.hstack([B, self.B]), np.vstack([C, self.samples_x]), omega)
        to_outputs, to_samples = G[:, : len(C)], G[:, len(C) :, :n_c]
        sampled = resolvent(flow[:n, :n], flow[:n, n:], self.samples_x, z, lambda s: UNSTABLE.format(s=s))
        loop = np.eye(m) - self.samples_s / z[:, None, None] - sampled
        commands = np.linalg.solve(loop, to_samples)
        staircase = (1.0 - 1.0 / z) / (1j * omega * self.period)
        return np.asarray(to_outputs[..., :n_c] + staircase[:, None, None] * (to_outputs[..., n_c:] @ commands))


def sampled_loop(system: System, model: LinearModel) -> SampledLoop | None:
    """The sampled controllers of a system about its linear model, None without; warns of those that are held instead.

    Those of several periods or with delays have no discrete model.
    """
    if not with_held_commands(system, loops=False).controllers:
        return None
    try:
        discrete = sampled_model(system)
    except ValueError as error:
        warnings.warn(
            PhysicsWarning(f"commands of sampled controllers are held, so their loops are open: {error}"), stacklevel=3
        )
        return None
    names, n = [name for name, _ in discrete.states], len(model.A)
    place = np.array([names.index(name) for name, _ in model.states], int)
    others = np.setdiff1d(np.arange(len(names)), place)
    multipliers = discrete.multipliers()
    poles = np.log(multipliers[np.abs(multipliers) > 1e-12].astype(complex)) / discrete.period
    assert len(place) == n
    return SampledLoop(
        discrete.generator[np.ix_(place, others)],
        discrete.sample[np.ix_(others, place)],
        discrete.sample[np.ix_(others, others)],
        discrete.period,
        poles,
    )
