"""Inertia ratios of a craft in a circular orbit: moments of inertia from them, and stable regions of the rigid craft.

With 1 roll, 2 pitch, 3 yaw (Hughes, Spacecraft attitude dynamics, sec. 9.2):

    k_roll = (I_2 - I_3) / I_1,    k_yaw = (I_2 - I_1) / I_3

The rigid craft at rest in its orbit is stable where k_roll > k_yaw (pitch), k_roll k_yaw > 0 and
1 + 3 k_roll + k_roll k_yaw > 4 sqrt(k_roll k_yaw) (roll and yaw): Lagrange's region k_roll > k_yaw > 0, in which the
stiffness is positive definite, and the region of DeBra and Delp with both ratios negative.

M, D and K about one state are affine in the moments of inertia of a rigid body. Where the equilibrium does not depend
on the ratios, three linearisations, at the craft's own roll and yaw inertia and a step along either, hold for every
point of a chart (`AffineChart`, which takes a thirtieth of the time of single ones).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from femflex.arrays import Array
from femflex.body import MassMoments, rigid_body
from femflex.case.stability import RATIOS
from femflex.dynamics import compile_system
from femflex.dynamics.linear.equations import linearised
from femflex.dynamics.linear.equilibrium import EquilibriumError, rest_equilibrium
from femflex.dynamics.linear.freedoms import frame_rate, usual_sizes
from femflex.dynamics.linear.small_motions import growth_threshold, spectrum
from femflex.pipeline.linear_motion import nominal_state
from femflex.rotations import dcm_from_quaternion
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


def known_curves(names: tuple[str, str]) -> list[tuple[str, Array]]:
    """Names and points (k, 2) [1] of the boundaries of the rigid craft's regions, over the ratios in this order.

    On that of DeBra and Delp k_yaw = -s^2 and k_roll = -r^2, so that 1 - 3 r^2 + r^2 s^2 = 4 r s.
    """
    s, ends = np.linspace(0.0, 1.0, 200), np.linspace(0.0, 1.0, 2)
    r = (-4 * s + np.sqrt(16 * s**2 + 4 * (3 - s**2))) / (2 * (3 - s**2))
    delp = np.column_stack([-(r**2), -(s**2)])[r <= s]
    curves = [np.column_stack(columns) for columns in ((ends, ends), (ends, 0 * ends), (0 * ends, -ends))]
    text = "regions of Lagrange, and of DeBra and Delp, for a rigid craft"
    return [(text, curve if names == RATIOS else curve[:, ::-1]) for curve in (*curves, delp)]


def moments_from_ratios(k_roll: float, k_yaw: float, pitch: float) -> tuple[float, float, float]:
    """I_roll, I_pitch, I_yaw [kg m^2] of these ratios.

    Raises ValueError for ratios that no body has: beyond -1 and 1.
    """
    if not (abs(k_roll) < 1 and abs(k_yaw) < 1):
        raise ValueError(f"no body has k_roll = {k_roll:g} and k_yaw = {k_yaw:g}; both lie between -1 and 1")
    denominator = 1 - k_roll * k_yaw
    return pitch * (1 - k_yaw) / denominator, pitch, pitch * (1 - k_roll) / denominator


def craft_inertia(system: System) -> tuple[Array, dict[str, Array]]:
    """Inertia (3, 3) [kg m^2] of the undeformed craft along pitch, yaw and roll, and C_OB of every body.

    About the centre of mass, in the nominal attitude. Raises ValueError where the craft has no orbital frame.
    """
    if system.orbit is None or system.frame.kind != "orbital":
        raise ValueError(
            "inertia ratios are those of a craft in the orbital frame of a circular orbit; give an [orbit], and leave "
            "[attitude] frame out"
        )
    model = compile_system(system)
    channels = model.observe(np.zeros(1), nominal_state(model)[None])
    C_NO = dcm_from_quaternion(channels["orbit/attitude"][0])
    C_OB, total, mass, first_moment = {}, np.zeros((3, 3)), 0.0, np.zeros(3)
    for name, body in system.bodies.items():
        C = C_NO.T @ dcm_from_quaternion(channels[f"bodies/{name}/attitude"][0])
        r = C_NO.T @ channels[f"bodies/{name}/position"][0]
        m, s = body.moments.mass, C @ body.moments.first[0]
        steiner = 2 * (r @ s) * np.eye(3) - np.outer(r, s) - np.outer(s, r)
        total += C @ body.moments.inertia() @ C.T + steiner + m * (r @ r * np.eye(3) - np.outer(r, r))
        mass, first_moment, C_OB[name] = mass + m, first_moment + s + m * r, C
    return total - (first_moment @ first_moment * np.eye(3) - np.outer(first_moment, first_moment)) / mass, C_OB


def present_ratios(system: System) -> tuple[float, float]:
    """The ratios k_roll and k_yaw [1] that the undeformed craft has."""
    pitch, yaw, roll = np.diag(craft_inertia(system)[0])
    return float((pitch - yaw) / roll), float((pitch - roll) / yaw)


def with_ratios(system: System, body: str, k_roll: float, k_yaw: float) -> System:
    """The system whose undeformed craft has these ratios, by other moments of inertia of a rigid body.

    Raises ValueError where that body would have moments that no body has.
    """
    return _with_inertia(system, body, _ratio_inertia(system, body, craft_inertia(system), k_roll, k_yaw))


def _ratio_inertia(
    system: System, body: str, craft: tuple[Array, dict[str, Array]], k_roll: float, k_yaw: float
) -> Array:
    """Inertia (3, 3) [kg m^2] about its origin of the rigid body that gives the craft these ratios."""
    if body not in system.bodies or system.bodies[body].n_modes:
        rigid = [name for name, candidate in system.bodies.items() if not candidate.n_modes]
        raise ValueError(f"the craft has no rigid body {body!r}; its rigid bodies are {', '.join(rigid)}")
    (current, C_OB), moments = craft, system.bodies[body].moments
    roll, pitch, yaw = moments_from_ratios(k_roll, k_yaw, float(current[0, 0]))
    inertia = moments.inertia() + C_OB[body].T @ (np.diag([pitch, yaw, roll]) - current) @ C_OB[body]
    inertia, center = (inertia + inertia.T) / 2, moments.first[0] / moments.mass
    steiner = moments.mass * (center @ center * np.eye(3) - np.outer(center, center))
    try:
        rigid_body(moments.mass, inertia - steiner, center)
    except ValueError as error:
        raise ValueError(f"k_roll = {k_roll:g} and k_yaw = {k_yaw:g} cannot be had by {body!r}: {error}") from None
    return inertia


def _with_inertia(system: System, body: str, inertia: Array) -> System:
    """The system with another inertia (3, 3) [kg m^2] of a rigid body about its origin."""
    candidate = system.bodies[body]
    second = (np.trace(inertia) / 2 * np.eye(3) - inertia)[None, :, None, :]
    changed = replace(candidate, moments=MassMoments(candidate.moments.mass, candidate.moments.first, second))
    return replace(system, bodies={**system.bodies, body: changed})


@dataclass(frozen=True, eq=False)
class AffineChart:
    """Judgements over the ratios from M, D and K (3, n, n) at the craft's own inertia and a step along roll and yaw.

    craft  inertia along pitch, yaw and roll, and C_OB of every body;  sizes (n,) usual sizes of the coordinates
    rate   of the orbit [rad/s]
    """

    system: System
    body: str
    craft: tuple[Array, dict[str, Array]]
    matrices: tuple[Array, Array, Array]
    sizes: Array
    rate: float

    @classmethod
    def from_system(cls, system: System, body: str, omitted: tuple[str, ...] = ()) -> AffineChart | None:
        """The equations of a craft; None where its equilibrium depends on the ratios, or is neutral."""
        craft = craft_inertia(system)
        C, step = craft[1][body], STEP * float(craft[0][0, 0])
        base = _ratio_inertia(system, body, craft, *present_ratios(system))
        inertias = [base + C.T @ np.diag([0.0, *change]) @ C for change in ((0.0, 0.0), (0.0, step), (step, 0.0))]
        systems = [_with_inertia(system, body, inertia) for inertia in inertias]
        if omitted:
            systems = [compile_system(variant).without(*omitted).system for variant in systems]
        try:
            about = rest_equilibrium(systems[0])[0]
        except (EquilibriumError, ValueError):
            return None
        if about.neutral or about.motions.known or about.motions.driven or about.moving.loops or about.moving.varying:
            return None
        models = [compile_system(_with_inertia(about.moving, body, inertia)) for inertia in inertias]
        sizes, rate = usual_sizes(about.model), frame_rate(about.moving)
        inertia = float(np.abs(np.diag(models[0].mass_matrix(0.0, about.x)) * sizes**2).max(initial=0.0))
        residuals = [float(np.abs(model.bias(0.0, about.x) * sizes).max(initial=0.0)) for model in models]
        if max(residuals) > BALANCED * rate**2 * inertia:
            return None
        linear = [linearised(model, 0.0, about.x) for model in models]
        M, D, K = (np.array([getattr(each, key) for each in linear]) for key in "MDK")
        return cls(system, body, craft, (M, D, K), sizes[linear[0].free], rate)

    def __call__(self, k_roll: float, k_yaw: float) -> Judgement:
        """The judgement at these ratios, none where the body cannot have them."""
        pitch, own_yaw, own_roll = (float(moment) for moment in np.diag(self.craft[0]))
        try:
            _ratio_inertia(self.system, self.body, self.craft, k_roll, k_yaw)
        except ValueError as error:
            return no_judgement(" ".join(str(error).split()))
        roll, _, yaw = moments_from_ratios(k_roll, k_yaw, pitch)
        a, b = ((moment - own) / (STEP * pitch) for moment, own in ((roll, own_roll), (yaw, own_yaw)))
        M, D, K = (P[0] + a * (P[1] - P[0]) + b * (P[2] - P[0]) for P in self.matrices)
        values = spectrum(M, D, K)
        growth = float(values.real.max(initial=0.0))
        if (values.real > growth_threshold(values, self.rate)).any():
            return Judgement(UNSTABLE, growth, values)
        return Judgement(STATIC if is_positive_definite(M, K, self.sizes, self.rate) else GYROSCOPIC, growth, values)
