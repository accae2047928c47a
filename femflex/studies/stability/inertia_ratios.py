"""Inertia ratios of a craft in a circular orbit: moments of inertia from them, and stable regions of the rigid craft.

With 1 roll, 2 pitch, 3 yaw (Hughes, Spacecraft attitude dynamics, sec. 9.2):

    k_roll = (I_2 - I_3) / I_1,    k_yaw = (I_2 - I_1) / I_3

The rigid craft at rest in its orbit is stable where k_roll > k_yaw (pitch), k_roll k_yaw > 0 and
1 + 3 k_roll + k_roll k_yaw > 4 sqrt(k_roll k_yaw) (roll and yaw): Lagrange's region k_roll > k_yaw > 0, in which the
stiffness is positive definite, and the region of DeBra and Delp with both ratios negative.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from femflex.arrays import Array
from femflex.body import MassMoments, rigid_body
from femflex.case.campbell import RATIOS
from femflex.dynamics import compile_system
from femflex.dynamics.motion.freedoms import frame_rate, usual_sizes
from femflex.linear.equations import linearised
from femflex.linear.equilibrium import EquilibriumError, rest_equilibrium
from femflex.linear.small_motions import growth_threshold, spectrum
from femflex.pipeline.linear_motion import nominal_state
from femflex.rotations import dcm_from_quaternion
from femflex.studies.stability.judgement import Judgement, judgement_of_matrices, no_judgement
from femflex.system import System

STEP = 0.5  # of the pitch inertia: that of the roll and yaw inertia between the linearisations
AFFINE = 1e-7  # of the largest entries: deviation of a fourth linearisation from what the three give


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
    """I_roll, I_pitch, I_yaw [kg m^2] of these ratios. Raises ValueError for ratios beyond -1 and 1."""
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
        C_OB[name] = C = C_NO.T @ dcm_from_quaternion(channels[f"bodies/{name}/attitude"][0])
        r, m, s = C_NO.T @ channels[f"bodies/{name}/position"][0], body.moments.mass, C @ body.moments.first[0]
        total += C @ body.moments.inertia() @ C.T + _inertia(r, 2 * s + m * r)
        mass, first_moment = mass + m, first_moment + s + m * r
    return total - _inertia(first_moment, first_moment / mass), C_OB


def _inertia(r: Array, s: Array) -> Array:
    """Inertia (3, 3) [kg m^2] of first moments s (3,) [kg m] at r (3,) [m]."""
    return r @ s * np.eye(3) - (np.outer(r, s) + np.outer(s, r)) / 2


def present_ratios(system: System) -> tuple[float, float]:
    """The ratios k_roll and k_yaw [1] that the undeformed craft has."""
    pitch, yaw, roll = np.diag(craft_inertia(system)[0])
    return float((pitch - yaw) / roll), float((pitch - roll) / yaw)


def with_ratios(system: System, body: str, k_roll: float, k_yaw: float) -> System:
    """The system whose undeformed craft has these ratios, by other moments of inertia of a rigid body.

    Raises ValueError where that body would have moments that no body has.
    """
    return _with_ratios(system, body, craft_inertia(system), k_roll, k_yaw)


def _with_ratios(
    system: System, body: str, craft: tuple[Array, dict[str, Array]], k_roll: float, k_yaw: float
) -> System:
    current = craft[0]
    roll, pitch, yaw = moments_from_ratios(k_roll, k_yaw, float(current[0, 0]))
    changed = _with_inertia(system, body, craft, np.diag([pitch, yaw, roll]) - current)
    moments = changed.bodies[body].moments
    center = moments.center_of_mass()
    try:
        rigid_body(moments.mass, moments.inertia() - moments.mass * _inertia(center, center), center)
    except ValueError as error:
        raise ValueError(f"k_roll = {k_roll:g} and k_yaw = {k_yaw:g} cannot be had by {body!r}: {error}") from None
    return changed


def _with_inertia(system: System, body: str, craft: tuple[Array, dict[str, Array]], more: Array) -> System:
    """The system with more inertia (3, 3) [kg m^2] of the craft, by that of a rigid body."""
    if body not in system.bodies or system.bodies[body].n_modes:
        rigid = [name for name, candidate in system.bodies.items() if not candidate.n_modes]
        raise ValueError(f"the craft has no rigid body {body!r}; its rigid bodies are {', '.join(rigid)}")
    candidate, C = system.bodies[body], craft[1][body]
    inertia = candidate.moments.inertia() + C.T @ more @ C
    second = (np.trace(inertia) / 2 * np.eye(3) - (inertia + inertia.T) / 2)[None, :, None, :]
    moments = MassMoments(candidate.moments.mass, candidate.moments.first, second)
    return replace(system, bodies={**system.bodies, body: replace(candidate, moments=moments)})


def affine_judge(
    system: System, body: str, omitted: tuple[str, ...] = ()
) -> Callable[[float, float], Judgement] | None:
    """The judgement over the ratios; None where M, D and K are not affine in the moments of inertia, or is neutral.

    Three linearisations, at the craft's own roll and yaw inertia and a step along either, then hold for every point of
    a chart, in a thirtieth of the time of single ones; a fourth confirms it.
    """
    craft = craft_inertia(system)
    pitch, own_yaw, own_roll = np.diag(craft[0]).tolist()
    blocks = []
    for a, b in ((0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)):
        moments = np.diag([pitch, own_yaw + b * STEP * pitch, own_roll + a * STEP * pitch])
        variant = _with_inertia(system, body, craft, moments - craft[0])
        try:
            about = rest_equilibrium(compile_system(variant).without(*omitted).system if omitted else variant)[0]
        except (EquilibriumError, ValueError):
            return None
        if about.neutral or about.motions.known or about.motions.driven or about.moving.loops or about.moving.varying:
            return None
        linear = linearised(compile_system(about.moving), 0.0, about.x)
        sizes, rate = usual_sizes(about.model)[linear.free], frame_rate(about.moving)
        blocks.append(np.array([linear.M, linear.D, linear.K]))
    base, of_roll, of_yaw = blocks[0], blocks[1] - blocks[0], blocks[2] - blocks[0]
    scales = np.outer(sizes, sizes) * np.array([1.0, 1.0 / rate, 1.0 / rate**2])[:, None, None]
    misfit = np.abs((blocks[3] - base - of_roll - of_yaw) * scales)
    if misfit.max() > AFFINE * np.abs(base * scales).max():
        return None

    def judge(k_roll: float, k_yaw: float) -> Judgement:
        try:
            _with_ratios(system, body, craft, k_roll, k_yaw)
        except ValueError as error:
            return no_judgement(" ".join(str(error).split()))
        roll, _, yaw = moments_from_ratios(k_roll, k_yaw, pitch)
        M, D, K = base + ((roll - own_roll) * of_roll + (yaw - own_yaw) * of_yaw) / (STEP * pitch)
        values = spectrum(M, D, K)
        stable = not (values.real > growth_threshold(values, rate)).any()
        return judgement_of_matrices(values, stable, M * scales[0], K * scales[2])

    return judge
