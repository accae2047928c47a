"""Canonical momenta and the Hamiltonian of a run.

    p = dT/du,    H = p . u - L = p . u - T + V

p (n_u,) belong to the free quasi-velocities u; those of prescribed ones are zero. H is constant where neither the base
frame nor a prescribed motion changes over time: the energy on a base at rest, the Jacobi integral in a circular orbit.
T is of second degree in u, so its central differences are exact.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from femflex.arrays import Array
from femflex.dynamics.joints.places import prescribed_places
from femflex.dynamics.reports.observe import observe
from femflex.dynamics.reports.report import Observation, Report
from femflex.dynamics.reports.row import ROW
from femflex.system import Channel, System

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
