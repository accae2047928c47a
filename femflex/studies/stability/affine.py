"""Stability over the inertia ratios of a craft whose equilibrium does not depend on them.

M, D and K about one state are affine in the moments of inertia of a rigid body: three linearisations, at the craft's
own roll and yaw inertia and a step along either, hold for every point of a chart. The state is an equilibrium at all of
them if the three systems are in equilibrium there, as a craft along its orbital frame is.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from femflex.arrays import Array
from femflex.dynamics import compile_system
from femflex.dynamics.linear.equations import linearised
from femflex.dynamics.linear.equilibrium import EquilibriumError, rest_equilibrium
from femflex.dynamics.linear.freedoms import frame_rate, usual_sizes
from femflex.dynamics.linear.small_motions import growth_threshold, spectrum
from femflex.studies.stability.gravity_gradient import craft_inertia, moments_from_ratios, ratio_inertia, with_inertia
from femflex.studies.stability.judgement import (
    GYROSCOPIC,
    STATIC,
    UNSTABLE,
    Judgement,
    is_positive_definite,
    no_judgement,
)
from femflex.system import System

STEP = 0.5  # of the pitch inertia: that of the roll and yaw inertia between the linearisations
BALANCED = 1e-9  # forces left at the common state, over the inertia times the square of the orbit's rate


@dataclass(frozen=True, eq=False)
class AffineChart:
    """Judgements over the ratios from M, D and K (3, n, n) at the craft's own inertia and a step along roll and yaw.

    roll_yaw  inertia [kg m^2] of the first, pitch that of all, step between them
    sizes     (n,) usual sizes of the coordinates;  rate  of the orbit [rad/s]
    """

    system: System
    body: str
    craft: tuple[Array, dict[str, Array]]
    roll_yaw: tuple[float, float]
    pitch: float
    M: Array
    D: Array
    K: Array
    sizes: Array
    rate: float

    @classmethod
    def from_system(cls, system: System, body: str, omitted: tuple[str, ...] = ()) -> AffineChart | None:
        """The equations of a craft; None where its equilibrium depends on the ratios, or is neutral."""
        craft = craft_inertia(system)
        pitch, yaw, roll = (float(v) for v in np.diag(craft[0]))
        C, step = craft[1][body], STEP * pitch
        base = ratio_inertia(system, body, craft, (pitch - yaw) / roll, (pitch - roll) / yaw)
        changes = [np.zeros((3, 3)), C.T @ np.diag([0, 0, step]) @ C, C.T @ np.diag([0, step, 0]) @ C]
        systems = [with_inertia(system, body, base + change) for change in changes]
        if omitted:
            systems = [compile_system(variant).without(*omitted).system for variant in systems]
        try:
            about = rest_equilibrium(systems[0])[0]
        except (EquilibriumError, ValueError):
            return None
        if about.neutral or about.motions.known or about.motions.driven or about.moving.loops or about.moving.varying:
            return None
        balanced = [with_inertia(about.moving, body, base + change) for change in changes]
        models = [compile_system(variant) for variant in balanced]
        sizes, rate = usual_sizes(about.model), frame_rate(about.moving)
        inertia = float(np.abs(np.diag(models[0].mass_matrix(0.0, about.x)) * sizes**2).max(initial=0.0))
        residuals = [float(np.abs(model.bias(0.0, about.x) * sizes).max(initial=0.0)) for model in models]
        if max(residuals) > BALANCED * rate**2 * inertia:
            return None
        linearisations = [linearised(model, 0.0, about.x) for model in models]
        M, D, K = (np.array([getattr(linearisation, key) for linearisation in linearisations]) for key in "MDK")
        return cls(system, body, craft, (roll, yaw), pitch, M, D, K, sizes[linearisations[0].free], rate)

    def __call__(self, k_roll: float, k_yaw: float) -> Judgement:
        """The judgement at these ratios, none where the body cannot have them."""
        try:
            ratio_inertia(self.system, self.body, self.craft, k_roll, k_yaw)
            roll, _, yaw = moments_from_ratios(k_roll, k_yaw, self.pitch)
        except ValueError as error:
            return no_judgement(" ".join(str(error).split()))
        step = STEP * self.pitch
        a, b = (roll - self.roll_yaw[0]) / step, (yaw - self.roll_yaw[1]) / step
        M, D, K = (P[0] + a * (P[1] - P[0]) + b * (P[2] - P[0]) for P in (self.M, self.D, self.K))
        values = spectrum(M, D, K)
        growth = float(values.real.max(initial=0.0))
        if (values.real > growth_threshold(values, self.rate)).any():
            return Judgement(UNSTABLE, growth, values)
        return Judgement(STATIC if is_positive_definite(M, K, self.sizes, self.rate) else GYROSCOPIC, growth, values)
