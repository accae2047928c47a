"""Attitude, energies, momenta and orbit of the craft as a whole, and the powers that it takes and gives.

    p = dT/du,    H = p . u - L = p . u - T + V

The canonical momenta p (n_u,) belong to the free quasi-velocities u; those of prescribed ones are zero. The Hamiltonian
H is constant where neither the base frame nor a prescribed motion changes over time: the energy on a base at rest, the
Jacobi integral in a circular orbit. T is of second degree in u, so its central differences are exact.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from femflex.arrays import Array
from femflex.dynamics.effector_states import momentum_channels
from femflex.dynamics.joints.places import joint_places, prescribed_places
from femflex.dynamics.observe.observe import observe
from femflex.dynamics.observe.row import FIXED, FIXED_WIDTH, ROW, origin_text, worded
from femflex.dynamics.report import Observation, Report, RowReport
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


UNITS = {"rad/s": "kg m^2/s", "m/s": "kg m/s", "kg^1/2 m/s": "kg^1/2 m/s"}


class Momenta(Report):
    """Momenta and Hamiltonian, if the system asks for them."""

    def channels(self, system: System) -> dict[str, Channel]:
        if not system.momenta:
            return {}
        names = system.velocity_names()
        units = ", ".join(UNITS.get(unit, f"J/({unit})") for _, unit in names)
        text = "canonical momenta dT/du of the free quasi-velocities, without what wheels store"
        return {
            "momenta": Channel(units, text, (len(names),), tuple(name for name, _ in names)),
            "monitors/hamiltonian": Channel("J", "Hamiltonian p.u - L over the free quasi-velocities"),
        }

    def observe(self, seen: Observation) -> Iterable[Array]:
        model, n_q, n_u = seen.model, seen.model.n_q, seen.model.n_u
        p, rows_around = np.empty(seen.u.shape), np.empty((2 * n_u, seen.rows.shape[1]))
        for j, (t, x) in enumerate(zip(seen.times, seen.states, strict=True)):
            step = max(1.0, float(np.abs(seen.u[j]).max(initial=0.0)))
            varied = np.repeat(x[None], 2 * n_u, axis=0)
            varied[:n_u, n_q : n_q + n_u] += step * np.eye(n_u)
            varied[n_u:, n_q : n_q + n_u] -= step * np.eye(n_u)
            observe(np.full(2 * n_u, t), varied, rows_around, *model.workspace.arrays)
            p[j] = (rows_around[:n_u, ROW.kinetic] - rows_around[n_u:, ROW.kinetic]) / (2 * step)
        p[:, [u for joint, k, _, u in prescribed_places(model.system) if k in joint.prescribed]] = 0.0
        hamiltonian = (p * seen.u).sum(axis=1) - 2 * seen.rows[:, ROW.kinetic] + seen.rows[:, ROW.energy]
        return [p, hamiltonian]
