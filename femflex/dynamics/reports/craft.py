"""Attitude, energies, momenta and orbit of the craft as a whole, and the powers that it takes and gives."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from femflex.arrays import Array
from femflex.dynamics.effectors.states import momentum_channels
from femflex.dynamics.joints.places import joint_places
from femflex.dynamics.reports.report import Observation, RowReport
from femflex.dynamics.reports.row import FIXED, FIXED_WIDTH, ROW, origin_text, worded
from femflex.rotations import is_extrinsic, is_symmetric, letters_of
from femflex.system import Channel, System

ANGLE_WORDS = {"x": "pitch", "y": "yaw", "z": "roll"}  # about the axes of the orbital frame


class Craft(RowReport):
    """The fixed part of the row, with what linear dampers take and the angular momentum of effectors."""

    place = 0

    def channels(self, system: System) -> dict[str, Channel]:
        sequence = system.libration_sequence
        letters, kind = letters_of(sequence), "extrinsic" if is_extrinsic(sequence) else "intrinsic"
        axes = ANGLE_WORDS if system.frame.kind == "orbital" else {axis: axis for axis in "xyz"}
        words = {
            "root": system.root,
            "frame": system.frame.kind,
            "turns": f"{kind} {letters}",
            "where": origin_text(system),
            "relative": " relative to O" if system.orbit else "",
            "attraction": "gravity gradient" if system.orbit else "weight, -m g.c from the inertial origin",
        }
        for k, letter in enumerate(letters, start=1):
            words[f"angle{k}"] = f"{letter}{k}" if is_symmetric(sequence) else axes[letter]
        return {path: worded(channel, words, reported=has(system)) for path, (channel, has) in FIXED.items()}

    def observe(self, seen: Observation) -> Iterable[Array]:
        system, row = seen.system, seen.rows[:, :FIXED_WIDTH].copy()
        if is_extrinsic(system.libration_sequence):
            row[:, ROW.angles : ROW.angles + 3] = row[:, ROW.angles : ROW.angles + 3][:, ::-1].copy()
        for paths in momentum_channels(system):
            row[:, ROW.angular_momentum : ROW.angular_momentum + 3] += np.stack([seen[path] for path in paths], axis=-1)
        row[:, ROW.dissipation] += linear_dissipation(system, seen.u)
        return [row[:, seen.model.all_channels.columns[path]] for path in FIXED]


def linear_dissipation(system: System, u: Array) -> Array:
    """Power (n_t,) that linear dampers of joints and bodies take at quasi-velocities (n_t, n_u) [W]."""
    power = np.zeros(len(u))
    for joint, _, first in joint_places(system):
        body = system.bodies[joint.child]
        power += u[:, first : first + joint.n_u] ** 2 @ joint.damping
        ddelta = u[:, first + joint.n_u : first + joint.n_u + body.n_modes]
        power += np.einsum("ti,ij,tj->t", ddelta, body.damping, ddelta)
    return power
