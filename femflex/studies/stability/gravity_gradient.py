"""Inertia ratios of a craft in a circular orbit: moments of inertia from them, and stable regions of the rigid craft.

With 1 roll, 2 pitch, 3 yaw (Hughes, Spacecraft attitude dynamics, sec. 9.2):

    k_roll = (I_2 - I_3) / I_1,    k_yaw = (I_2 - I_1) / I_3

The rigid craft at rest in its orbit is stable where k_roll > k_yaw (pitch), k_roll k_yaw > 0 and
1 + 3 k_roll + k_roll k_yaw > 4 sqrt(k_roll k_yaw) (roll and yaw): Lagrange's region k_roll > k_yaw > 0, in which the
stiffness is positive definite, and the region of DeBra and Delp with both ratios negative.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from femflex.arrays import Array
from femflex.body import MassMoments, rigid_body
from femflex.case.stability import RATIOS
from femflex.dynamics import compile_system
from femflex.pipeline.linear_motion import nominal_state
from femflex.rotations import dcm_from_quaternion
from femflex.system import System


def delp_boundary(n: int = 200) -> Array:
    """Points (n, 2) of the ratios k_roll, k_yaw [1] on the curve 1 + 3 k_roll + k_roll k_yaw = 4 sqrt(k_roll k_yaw),
    both negative.

    With k_yaw = -s^2 and k_roll = -r^2: 1 - 3 r^2 + r^2 s^2 = 4 r s.
    """
    s = np.linspace(0.0, 1.0, n)
    r = (-4 * s + np.sqrt(16 * s**2 + 4 * (3 - s**2))) / (2 * (3 - s**2))
    return np.column_stack([-(r**2), -(s**2)])


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


def with_ratios(system: System, body: str, k_roll: float, k_yaw: float) -> System:
    """The system whose undeformed craft has these ratios, by other moments of inertia of a rigid body.

    Raises ValueError where that body would have moments that no body has.
    """
    return with_inertia(system, body, ratio_inertia(system, body, craft_inertia(system), k_roll, k_yaw))


def ratio_inertia(
    system: System, body: str, craft: tuple[Array, dict[str, Array]], k_roll: float, k_yaw: float
) -> Array:
    """Inertia (3, 3) [kg m^2] about its origin of the rigid body that gives the craft these ratios.

    craft: as `craft_inertia`. Raises ValueError where that body would have moments that no body has.
    """
    if body not in system.bodies or system.bodies[body].n_modes:
        rigid = [name for name, candidate in system.bodies.items() if not candidate.n_modes]
        raise ValueError(f"the craft has no rigid body {body!r}; its rigid bodies are {', '.join(rigid)}")
    current, C_OB = craft
    roll, pitch, yaw = moments_from_ratios(k_roll, k_yaw, float(current[0, 0]))
    C, candidate = C_OB[body], system.bodies[body]
    body_inertia = candidate.moments.inertia() + C.T @ (np.diag([pitch, yaw, roll]) - current) @ C
    body_inertia = (body_inertia + body_inertia.T) / 2
    mass, center = candidate.moments.mass, candidate.moments.first[0] / candidate.moments.mass
    try:
        rigid_body(mass, body_inertia - mass * (center @ center * np.eye(3) - np.outer(center, center)), center)
    except ValueError as error:
        raise ValueError(f"k_roll = {k_roll:g} and k_yaw = {k_yaw:g} cannot be had by {body!r}: {error}") from None
    return body_inertia


def with_inertia(system: System, body: str, inertia: Array) -> System:
    """The system with another inertia (3, 3) [kg m^2] of a rigid body about its origin."""
    candidate = system.bodies[body]
    second = (np.trace(inertia) / 2 * np.eye(3) - inertia)[None, :, None, :]
    changed = replace(candidate, moments=MassMoments(candidate.moments.mass, candidate.moments.first, second))
    return replace(system, bodies={**system.bodies, body: changed})


def known_curves(names: tuple[str, str]) -> list[tuple[str, Array]]:
    """Names and points (k, 2) [1] of the boundaries of the rigid craft's regions, over the inertia ratios in this
    order."""
    ends = np.linspace(0.0, 1.0, 2)
    delp = delp_boundary()
    curves = [np.column_stack([ends, ends]), np.column_stack([ends, 0 * ends]), np.column_stack([0 * ends, -ends])]
    curves.append(delp[delp[:, 0] >= delp[:, 1]])
    ordered = [curve if names == RATIOS else curve[:, ::-1] for curve in curves]
    return [("regions of Lagrange, and of DeBra and Delp, for a rigid craft", curve) for curve in ordered]
