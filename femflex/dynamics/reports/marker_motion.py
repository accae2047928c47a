"""Positions and orientations of markers, from the channels of their bodies."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from femflex.arrays import Array
from femflex.rotations import dcm_from_quaternion, dcm_from_vector
from femflex.system import System


def marker_motion(
    system: System, times: Array, channels: Mapping[str, Array], body: str | None, marker: str
) -> tuple[Array, Array]:
    """Place r_M (n_t, 3) and C_NM (n_t, 3, 3) of a marker, inertial components, turned on its body as its shapes say.

    Without a body those of the base frame.
    """
    if body is None:
        return np.zeros((len(times), 3)), base_attitude(system, times, channels)
    m = system.bodies[body].marker(marker)
    C_NB = dcm_from_quaternion(channels[f"bodies/{body}/attitude"])
    delta = channels[f"bodies/{body}/delta"] if m.phi.size else np.zeros((len(times), 0))
    position = channels[f"bodies/{body}/position"] + np.einsum("tij,tj->ti", C_NB, m.position + delta @ m.phi.T)
    return position, C_NB @ dcm_from_vector(m.rotation_vector(delta)) @ m.orientation


def base_attitude(system: System, times: Array, channels: Mapping[str, Array]) -> Array:
    """C_NF (n_t, 3, 3) of the base frame."""
    if system.frame.kind == "orbital":
        return dcm_from_quaternion(channels["orbit/attitude"])
    rate = system.frame.rate if system.frame.kind == "spinning" else np.zeros(3)
    return dcm_from_vector(np.asarray(times)[:, None] * rate)
