"""Estimated size of the motion by kind of coordinate, which sets the absolute tolerances of a run.

A coordinate cannot move farther than with the whole energy E of the motion: its rate reaches sqrt(2 E / m), its
displacement sqrt(2 E / k), with the diagonal entries m and k of mass and stiffness; without stiffness the rate times
the duration T. E is the kinetic energy of initial and prescribed rates, and what the start, loads and prescribed
motions put into the linear motion x'' + A x = a(t): a^T M R a / 2 with R = (A + 2 / T^2)^-1. A turns displacements into
accelerations that oppose them (see `frequency`); a(t) is the acceleration of the initial state under the loads of time
t. A mode of A of frequency omega moves by a / omega^2, one without stiffness by a T^2 / 2.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from femflex.arrays import Array, IntArray
from femflex.dynamics.joints.prescribed_coordinates import prescribed_states
from femflex.dynamics.linear.frequency import restoring_accelerations, stiff_indices
from femflex.dynamics.linear.linearised import frame_rate, is_prescribed, rounding_forces, usual_sizes
from femflex.dynamics.linear.singular_mass import refuse_singular_mass
from femflex.dynamics.lowering.layout import body_records

if TYPE_CHECKING:
    from femflex.dynamics.model import Model

KINDS = ("translation", "rotation", "elastic")
TRANSLATION, ROTATION, ELASTIC = range(3)
MAX_COORDINATES = 1000  # coordinates up to which the motion is estimated: a second of work
INSTANTS, MAX_BREAKS = 33, 200  # times at which loads and prescribed motions are looked at
FRACTION = 100.0  # times the possible motion: from there on the usual size is too coarse a measure
START_SHARE = 1e-4  # of the deflection at the start: motion about it counts from there on
ROUNDING = 1e3 * float(np.finfo(float).eps)  # of the forces that cancel each other: accelerations below are none


def motion_scales(model: Model, x0: Array, begin: float, end: float) -> Array:
    """Sizes (n_x,) of the states of a run from x0 (n_x,) between two times [s], for its absolute tolerances.

    The usual size is 1 in SI units, of joint rates a typical rate. It is FRACTION times what the energy of the motion
    allows a kind (translation, rotation, elastic; coordinates and rates) where that is less, so that nanometres are
    computed to as many digits. Kinds that rest, and models of more than MANY coordinates, keep the usual size. The
    commands of sampled controllers are not foreseen.
    """
    of_q, of_u = coordinate_kinds(model)
    sizes = usual_state_sizes(model, x0, end - begin)
    q, u, _ = model.parts(sizes)  # views
    if 0 < model.n_u <= MAX_COORDINATES:
        displacement, rate = estimated_motion(model, x0, begin, end)
        for kind in range(len(KINDS)):
            for size, kinds, estimate in ((q, of_q, displacement), (u, of_u, rate)):
                if 0.0 < (largest := float(estimate[of_u == kind].max(initial=0.0))) < np.inf:
                    size[kinds == kind] = np.minimum(size[kinds == kind], FRACTION * largest)
    return sizes


def usual_state_sizes(model: Model, x0: Array, duration: float) -> Array:
    """Usual sizes of the states (n_x,): 1 for coordinates and elastic rates, a typical rate for rates of joints.

    Rates of a craft in orbit are of the size of the mean motion, 1e-3 rad/s; measured against 1 they would hardly be
    followed.
    """
    elastic = coordinate_kinds(model)[1] == ELASTIC
    motion = 0.0 if model.system.orbit is None else model.system.orbit.mean_motion
    u0 = np.abs(model.parts(x0)[1][~elastic]).max(initial=0.0)
    rate = min(1.0, max(motion, 2.0 * np.pi / max(duration, 1e-300), float(u0)))
    return np.concatenate([np.ones(model.n_q), np.where(elastic, 1.0, rate), model.system.state_sizes()])


def coordinate_kinds(model: Model) -> tuple[IntArray, IntArray]:
    """Kinds, numbered as in KINDS, of the coordinates (n_q,) and quasi-velocities (n_u,)."""
    names = model.system.coordinate_names(), model.system.velocity_names()
    of_q, of_u = (
        np.array([TRANSLATION if unit in ("m", "m/s") else ROTATION for _, unit in pairs], np.int64) for pairs in names
    )
    for record in body_records(model.table)[1:]:
        n = int(record["n"])
        of_q[int(record["qe"]) : int(record["qe"]) + n] = of_u[int(record["ue"]) : int(record["ue"]) + n] = ELASTIC
    return of_q, of_u


def estimated_motion(model: Model, x0: Array, begin: float, end: float) -> tuple[Array, Array]:
    """Largest displacements and rates (n_u,) that the energy of the motion allows; zero where only rounding moves."""
    n, free, duration = model.n_u, ~is_prescribed(model, x0), max(end - begin, 1e-300)
    columns, A = stiff_indices(model), np.zeros((n, n))
    A[:, columns[1]] = restoring_accelerations(model, columns, np.eye(len(columns[1]))).T
    times = np.unique(np.concatenate([np.linspace(begin, end, INSTANTS), _times_near_breaks(model, begin, end)]))
    states = np.tile(x0, (len(times), 1))
    rates = np.empty_like(states)
    for t, x, dx in zip(times, states, rates, strict=True):
        model.rate(float(t), x, dx, *model.workspace.arrays)
    a, u = (model.parts(part)[1] for part in (rates, prescribed_states(model, times, states)))
    M, sizes = model.mass_matrix(begin, x0), usual_sizes(model)
    refuse_singular_mass(model, M)
    m = np.abs(np.diag(M))
    with np.errstate(all="ignore"):
        gravity = 0.0 if model.system.orbit is None else model.system.orbit.mean_motion  # its gradient is 3 n^2
        spun = (m * ((frame_rate(model.system) + gravity + np.abs(u).max(initial=0.0)) * sizes) ** 2).max()
        rounding = ROUNDING * (rounding_forces(model, begin, x0, a[0]) + spun / sizes) / m
        a = np.where((np.abs(a) > rounding) & free, a, 0.0)
        k = np.maximum(np.diag(M @ A), 2.0 * m / duration**2)
        try:
            displacement = np.linalg.solve(A + 2.0 / duration**2 * np.eye(n), a.T)
        except np.linalg.LinAlgError:
            return np.zeros(n), np.zeros(n)
        energies = np.abs(a.T * (M @ displacement)).sum(axis=0) + np.abs(u * (u @ M.T)).sum(axis=1)
        deflection = np.zeros(n)
        for record in body_records(model.table)[1:]:
            first, size = int(record["qe"]), int(record["n"])
            deflection[int(record["ue"]) : int(record["ue"]) + size] = x0[first : first + size]
        start_energy = START_SHARE**2 * abs(
            deflection @ M @ (A @ deflection)
        )  # of a start in equilibrium, about which only rounding moves
        energy = energies.max() + start_energy + (m * (frame_rate(model.system) * sizes) ** 2).max()  # twice
        return np.sqrt(energy / k), np.sqrt(energy / m)


def _times_near_breaks(model: Model, begin: float, end: float) -> Array:
    """Times (n,) [s] on both sides of the jumps of loads and prescribed motions, of a part of them if they are many."""
    breaks = model.breaks[(model.breaks > begin) & (model.breaks < end)]
    breaks = breaks[:: 1 + len(breaks) // MAX_BREAKS]
    aside = 1e-9 * (end - begin)
    return np.concatenate([breaks - aside, breaks + aside])
