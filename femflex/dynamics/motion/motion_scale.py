"""Highest natural frequency of a model, and the estimated size of its motion by kind of coordinate.

The frequency limits the step of an explicit method, the size sets the absolute tolerances of a run. A coordinate cannot
move farther than with the whole energy E of the motion: its rate reaches sqrt(2 E / m), its displacement
sqrt(2 E / k), with the diagonal entries m and k of mass and stiffness; without stiffness the rate times the duration T.
E is the kinetic energy of initial and prescribed rates, and what the start, loads and prescribed motions put into the
linear motion x'' + A x = a(t): a^T M R a / 2 with R = (A + 2 / T^2)^-1. A turns displacements into accelerations that
oppose them (`restoring_accelerations`); a(t) is the acceleration of the initial state under the loads of time t. A mode
of A of frequency omega moves by a / omega^2, one without stiffness by a T^2 / 2. Temperatures, which induce strain, go
on at their first rate, by their usual size at most.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from femflex.arrays import Array, IntArray
from femflex.dynamics.joints.places import law_places, prescribed_states
from femflex.dynamics.layout.records import body_records
from femflex.dynamics.motion.freedoms import (
    elastic_places,
    frame_rate,
    is_prescribed,
    refuse_singular_mass,
    usual_sizes,
)
from femflex.dynamics.motion.increments import advanced
from femflex.dynamics.motion.linear_stiffness import rounding_forces
from femflex.system import Effector, System

if TYPE_CHECKING:
    from femflex.dynamics.model import Model

DENSE_LIMIT = 100  # coordinates; beyond, the largest eigenvalue is found by Arnoldi's method, without the matrix
STEP = 1e-6  # of the difference quotient, times a unit of the coordinate
KINDS = ("translation", "rotation", "elastic")
TRANSLATION, ROTATION, ELASTIC = range(3)
MAX_COORDINATES = 1000  # coordinates up to which the motion is estimated: a second of work
INSTANTS, MAX_BREAKS = 33, 200  # times at which loads and prescribed motions are looked at
FRACTION = 100.0  # times the possible motion: from there on the usual size is too coarse a measure
START_SHARE = 1e-4  # of the deflection at the start: motion about it counts from there on
ROUNDING = 1e3 * float(np.finfo(float).eps)  # of the forces that cancel each other: accelerations below are none


def highest_frequency(model: Model) -> float:
    """Highest natural frequency of shapes and springs at the initial configuration, at rest [rad/s].

    That of the whole system, bodies and joints coupled and loops closed: the largest eigenvalue of M^-1 K, which turns
    displacements of the elastic, sliding and turning coordinates that have stiffness into the accelerations that they
    call up. Where dampers let motion die faster than anything vibrates, their rate.
    """
    return max(linear_frequency(model), law_frequency(model), damping_rate(model), state_frequency(model))


def state_frequency(model: Model) -> float:
    """Fastest rate of states z among themselves at rest, the largest eigenvalue of dzdot/dz [1/s]; 0 without any."""
    if not model.system.effectors:
        return 0.0
    x, first, columns = model.at_rest(model.x0[: model.n_q]), model.n_q + model.n_u, []
    base = model.state_rate(0.0, x)[first:]
    changing = np.flatnonzero(np.isfinite(model.system.state_sizes()))  # not what only samples change
    for k in changing:
        displaced, step = x.copy(), STEP * max(1.0, abs(x[first + k]))
        displaced[first + k] += step
        columns.append(((model.state_rate(0.0, displaced)[first:] - base) / step)[changing])
    return float(np.abs(np.linalg.eigvals(np.column_stack(columns))).max(initial=0.0)) if columns else 0.0


def damping_rate(model: Model) -> float:
    """Fastest rate at which motion dies by dampers, shapes' damping and friction at rest [1/s]; 0 without any.

    The largest real part among the eigenvalues of M^-1 D, which turns velocities into decelerations; gyroscopic forces
    have none.
    """
    if not damped(model.system):
        return 0.0
    rest = model.at_rest(model.x0[: model.n_q])

    def decelerations(velocities: Array) -> Array:
        ahead, behind = (_with_velocities(model, rest, sign * STEP * velocities) for sign in (1.0, -1.0))
        return (_accelerations(model, behind) - _accelerations(model, ahead)) / (2.0 * STEP)

    return max(0.0, largest_eigenvalue(decelerations, model.n_u))


def _with_velocities(model: Model, x: Array, velocities: Array) -> Array:
    """The state x (n_x,) with each of the quasi-velocities (m, n_u): (m, n_x)."""
    states = np.tile(x, (len(velocities), 1))
    model.parts(states)[1][:] = velocities
    return states


def _accelerations(model: Model, states: Array) -> Array:
    """du/dt (m, n_u) at t = 0 at states (m, n_x)."""
    rates, arrays = np.empty_like(states), model.workspace.arrays
    for x, dx in zip(states, rates, strict=True):
        model.rate(0.0, x, dx, *arrays)
    return model.parts(rates)[1]


def damped(system: System) -> bool:
    """Whether anything in a system resists velocities linearly."""
    return (
        any(joint.damping.any() or joint.laws for joint in system.joints)
        or any(body.damping.any() for body in system.bodies.values())
        or any(spring.damping for spring in system.springs)
        or bool(system.effectors)
    )


def largest_eigenvalue(operator: Callable[[Array], Array], n: int) -> float:
    """Largest real part of the eigenvalues of a linear map, 0 of none; of many coordinates by Arnoldi's method.

    operator: takes vectors (m, n) to their images (m, n).
    """
    if n == 0:
        return 0.0
    if n <= DENSE_LIMIT:
        values = np.linalg.eigvals(operator(np.eye(n)))
    else:
        from scipy.sparse.linalg import ArpackNoConvergence, LinearOperator, eigs

        start = np.random.default_rng(0).normal(size=n)
        image = LinearOperator((n, n), matvec=lambda one: operator(one.reshape(1, n))[0], dtype=float)
        try:
            values = eigs(image, 1, which="LR", v0=start, tol=1e-6, return_eigenvectors=False)
        except ArpackNoConvergence:  # no eigenvalue stands out, as of a slack cable
            values = np.linalg.eigvals(operator(np.eye(n)))
    return float(values.real.max())


def law_frequency(model: Model) -> float:
    """Highest frequency that stops, tabulated springs and latches can reach where they are stiffest [rad/s]."""
    squares = [0.0]
    for law_place in law_places(model.system):
        unit, out = np.zeros(model.n_u), np.empty(model.n_u)
        unit[law_place.u] = 1.0
        stiffest = law_place.law.stiffest
        if stiffest > 0:
            q = np.ascontiguousarray(model.x0[: model.n_q])
            rhs = np.concatenate([unit, model.parts(model.x0)[2]])
            model.second_order.solve(0.0, q, rhs, out, 1.0, 0.0, 0.0, model.table, model.pool, model.work)
            squares.append(stiffest * out[law_place.u])
    return float(np.sqrt(max(squares)))


def linear_frequency(model: Model) -> float:
    """Highest natural frequency of shapes and springs at the initial configuration, at rest [rad/s].

    M^-1 K column by column: the accelerations that a unit of each elastic, sliding or turning coordinate calls up.
    """
    indices = stiff_indices(model)

    def accelerations(displacements: Array) -> Array:
        return restoring_accelerations(model, indices, displacements)[:, indices[1]]

    return float(np.sqrt(max(largest_eigenvalue(accelerations, len(indices[1])), 0.0)))


def stiff_indices(model: Model) -> tuple[IntArray, IntArray]:
    """Return places in q and in u (m,) of coordinates with stiffness; all of u if there are springs or effectors."""
    if model.system.springs or model.system.effectors:  # these may act on any coordinate
        return np.full(model.n_u, -1), np.arange(model.n_u)
    pairs = []
    for r in body_records(model.table)[1:]:
        pairs += [(r["q"] + k, r["u"] + k) for k in range(r["n_slide"] + r["n_turn"] if r["sprung"] else 0)]
        pairs += [(r["qe"] + k, r["ue"] + k) for k in range(r["n"])]
    q, u = np.array(pairs, np.int64).reshape(-1, 2).T
    return q, u


def restoring_accelerations(model: Model, indices: tuple[IntArray, IntArray], displacements: Array) -> Array:
    """Accelerations (k, n_u) that oppose displacements (k, m) of these places from the initial state, at rest."""
    rest = model.at_rest(model.x0[: model.n_q])
    displaced = np.tile(rest, (len(displacements), 1))
    if model.system.springs or model.system.effectors:
        start = rest[: model.n_q].copy()
        for x, displacement in zip(displaced, displacements, strict=True):
            x[: model.n_q] = advanced(model, start, STEP * displacement)
    else:
        displaced[:, indices[0]] += STEP * displacements
    return np.asarray((_accelerations(model, rest[None]) - _accelerations(model, displaced)) / STEP)


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
    qe, ue = elastic_places(model)
    of_q[qe] = of_u[ue] = ELASTIC
    return of_q, of_u


def estimated_motion(model: Model, x0: Array, begin: float, end: float) -> tuple[Array, Array]:
    """Largest displacements and rates (n_u,) that the energy of the motion allows; zero where only rounding moves."""
    n, free, duration = model.n_u, ~is_prescribed(model, x0), max(end - begin, 1e-300)
    columns, A = stiff_indices(model), np.zeros((n, n))
    A[:, columns[1]] = restoring_accelerations(model, columns, np.eye(len(columns[1]))).T
    times = np.unique(np.concatenate([np.linspace(begin, end, INSTANTS), _times_near_breaks(model, begin, end)]))
    states = _with_induced_strain(model, x0, times)
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
        qe, ue = elastic_places(model)
        deflection[ue] = x0[qe]
        # of a start in equilibrium, about which only rounding moves
        start_energy = START_SHARE**2 * abs(deflection @ M @ (A @ deflection))
        energy = energies.max() + start_energy + (m * (frame_rate(model.system) * sizes) ** 2).max()  # twice
        return np.sqrt(energy / k), np.sqrt(energy / m)


def _with_induced_strain(model: Model, x0: Array, times: Array) -> Array:
    """The state x0 at each time (n_t, n_x), with those states of effectors moved on that induce strain."""
    states, names = np.tile(x0, (len(times), 1)), [name for name, _ in model.system.state_names()]
    strained = [e for e in model.system.effectors if isinstance(e, Effector) and e.strained is not None]
    moving = [names.index(name) for effector in strained for name, _ in effector.state_names()]
    if moving:
        places = model.n_q + model.n_u + np.array(moving)
        moved, size = np.outer(times - times[0], model.state_rate(times[0], x0)[places]), model.system.state_sizes()
        states[:, places] += np.clip(moved, -size[moving], size[moving])
    return states


def _times_near_breaks(model: Model, begin: float, end: float) -> Array:
    """Times (n,) [s] on both sides of the jumps of loads and prescribed motions, of a part of them if they are many."""
    breaks = model.breaks[(model.breaks > begin) & (model.breaks < end)]
    breaks = breaks[:: 1 + len(breaks) // MAX_BREAKS]
    aside = 1e-9 * (end - begin)
    return np.concatenate([breaks - aside, breaks + aside])
