"""Canonical momenta and the Hamiltonian of a run.

    p = dT/du,    H = p . u - L = p . u - T + V

p (n_u,) belong to the free quasi-velocities u; those of prescribed ones are zero. H is constant where neither the base
frame nor a prescribed motion changes over time: the energy on a base at rest, the Jacobi integral in a circular orbit.
T is of second degree in u, so its central differences are exact.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from femflex.arrays import Array
from femflex.dynamics.joints.prescribed_coordinates import prescribed_places
from femflex.dynamics.reports.monitors import ROW_KINETIC
from femflex.dynamics.reports.observe import observe
from femflex.system import Channel, System

if TYPE_CHECKING:
    from femflex.dynamics.model import Model


UNITS = {"rad/s": "kg m^2/s", "m/s": "kg m/s", "kg^1/2 m/s": "kg^1/2 m/s"}


def momenta_channels(system: System) -> dict[str, Channel]:
    """Return the channels, if the system asks for them."""
    if not system.momenta:
        return {}
    names = system.velocity_names()
    units = ", ".join(UNITS.get(unit, f"J/({unit})") for _, unit in names)
    text = "canonical momenta dT/du of the free quasi-velocities, without what wheels store"
    return {
        "momenta": Channel(units, text, (len(names),), tuple(name for name, _ in names)),
        "monitors/hamiltonian": Channel("J", "Hamiltonian p.u - L over the free quasi-velocities"),
    }


def observe_momenta(model: Model, times: Array, states: Array, rows: Array, energy: Array) -> dict[str, Array]:
    """The channels at times (n_t,) and states (n_t, n_x), observed in rows (n_t, n_row); energy (n_t,) T + V."""
    n_q, n_u = model.n_q, model.n_u
    p, rows_around = np.empty((len(times), n_u)), np.empty((2 * n_u, rows.shape[1]))
    for j, (t, x) in enumerate(zip(times, states, strict=True)):
        step = max(1.0, float(np.abs(x[n_q : n_q + n_u]).max(initial=0.0)))
        varied = np.repeat(x[None], 2 * n_u, axis=0)
        varied[:n_u, n_q : n_q + n_u] += step * np.eye(n_u)
        varied[n_u:, n_q : n_q + n_u] -= step * np.eye(n_u)
        observe(np.full(2 * n_u, t), varied, rows_around, *model.workspace.arrays)
        p[j] = (rows_around[:n_u, ROW_KINETIC] - rows_around[n_u:, ROW_KINETIC]) / (2 * step)
    kinetic = rows[:, ROW_KINETIC]
    p[:, [u for joint, k, _, u in prescribed_places(model.system) if k in joint.prescribed]] = 0.0
    u = states[:, n_q : n_q + n_u]
    return {"momenta": p, "monitors/hamiltonian": (p * u).sum(axis=1) - 2 * kinetic + energy}
