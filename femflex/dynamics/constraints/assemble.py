"""Consistent initial conditions: coordinates and velocities nearest to the given ones that close every loop."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from femflex.arrays import Array
from femflex.dynamics.constraints import projection as calls
from femflex.dynamics.constraints.conflicts import competing_motions_text, flat_disc_text, violated_text
from femflex.dynamics.constraints.constrained import Constraints
from femflex.dynamics.constraints.constraint_violation import OPENING_RATE
from femflex.dynamics.constraints.initial_corrections import absorb_misfit, refuse_clearance
from femflex.dynamics.constraints.singular_passage import start_pivots
from femflex.dynamics.joints.coordinates import advance
from femflex.dynamics.joints.places import body_places
from femflex.dynamics.layout import constraint_records as layout
from femflex.dynamics.layout.constraints import characteristic_length
from femflex.system import System
from femflex.system.system import kept_coordinates

MassMatrix = Callable[[float, Array], Array]
SmallestChange = Callable[[float, Array, Array], tuple[Array, int]]  # as Constraints.nearest

STEPS = 400  # of the search for a closed configuration
MAX_STEP = 0.5  # rad or m of the largest coordinate in one step of the search, before it is close
CLOSURE_TOLERANCE = 1e-9  # gap that counts as not closed, relative to the bodies' size
LEAST_REDUCTION, SMALLEST_FACTOR = 0.9, 1 / 16
DIGITS = 1e-4  # gap, relative to the bodies' size, that digits left out may make
CLOSED = 1e-13  # gap that needs no search, relative to the bodies' size
MAX_BENDING = 0.05  # displacement by bending, relative to the bodies' size, up to which a loop may be forced together
REFINEMENTS = 3  # times that velocities are brought to the nearest: masses far apart leave rounding
INDEPENDENT = 1e-10  # singular value of the rows, relative to the largest, that counts
SETTLED = 1e-13  # change of coordinates at which the nearest configuration is found
ACCELERATION_TOLERANCE = 1e-6  # acceleration that may be missing, relative to the largest that a row asks for


def assembled(constraints: Constraints, x0: Array, size: float, mass_matrix: MassMatrix) -> Array:
    """Return x0 moved onto the constraints: q nearest to the given q and u nearest to the given u, by the mass matrix.

    What the system's `keep` names stays exactly as given, and shapes too unless the joints alone cannot close the
    loops. Every step goes to the point nearest to the
    given one on the constraints linearised at the present one:
    d <- M^-1 A^T (A M^-1 A^T)^-1 (A d - g), q = q0 o exp(d). Raises ValueError naming the loop that stays open.
    """
    if text := flat_disc_text(constraints, 0.0, x0):
        raise ValueError(text)
    refuse_clearance(constraints, size)
    x, tolerance = np.array(x0, float), CLOSURE_TOLERANCE * max(1.0, size)
    limits = np.maximum(tolerance, constraints.row_plays)
    stiff = smallest_joint_change(constraints, mass_matrix, shapes=False)
    bending = smallest_joint_change(constraints, mass_matrix, shapes=True)
    if not np.abs(constraints.residuals(0.0, x)[0]).max(initial=0.0) <= CLOSED * max(1.0, size):
        # at the end of reach the nearest point may not settle: then any closed one will do
        plain = smallest_change_of(
            constraints, lambda t, x: np.eye(constraints.n_u), movable(constraints.system, shapes=False)
        )
        for nearest, near_x0 in ((stiff, True), (stiff, False), (plain, False), (bending, True), (bending, False)):
            x = search_closed(constraints, x0, nearest, near_x0)
            if np.all(np.abs(constraints.residuals(0.0, x)[0]) < limits):
                break
    refuse_open(constraints, x, limits)
    refuse_bent(constraints, x0, x, size)
    absorb_misfit(constraints, x)
    for nearest in (stiff, bending):
        moving = x.copy()
        for _ in range(REFINEMENTS):
            moving[constraints.n_q : constraints.n_q + constraints.n_u] += nearest(
                0.0, x, -constraints.residuals(0.0, moving)[1]
            )[0]
        if np.abs(constraints.residuals(0.0, moving)[1]).max() < tolerance:
            break
    refuse_moving(constraints, moving, tolerance)
    if calls.project(0.0, moving, *constraints.arrays) > 1.0:  # what is left is rounding, where rows do not contradict
        raise ValueError(
            f"{violated_text(constraints, 0.0, moving)}, or give lengths and axes to more digits: an overconstrained "
            "loop closes only to the accuracy of its markers, or to its `play` where it has one."
        )
    refuse_accelerations(constraints, moving, size)
    start_pivots(constraints)
    return moving


def smallest_joint_change(constraints: Constraints, mass_matrix: MassMatrix, shapes: bool) -> SmallestChange:
    """Return the smallest change by mass of the movable freedoms; of the joints alone unless `shapes`."""
    free = movable(constraints.system, shapes)
    n_prescribed = sum(len(joint.prescribed) for joint in constraints.system.joints)
    if len(free) + n_prescribed == constraints.n_u:
        return constraints.smallest_change
    return smallest_change_of(constraints, mass_matrix, free)


def movable(system: System, shapes: bool) -> list[int]:
    """Return the freedoms that are neither prescribed nor kept at initial values; elastic ones only with `shapes`."""
    free: list[int] = []
    for place in body_places(system):
        fixed = {*place.joint.prescribed, *kept_coordinates(system.keep, place.joint)}
        free += [place.u + k for k in range(place.joint.n_u) if k not in fixed]
        free += place.shapes_u.tolist() if shapes else ()
    return free


def smallest_change_of(constraints: Constraints, mass_matrix: MassMatrix, free: list[int]) -> SmallestChange:
    """As Constraints.nearest, of the freedoms `free` alone; by dense matrices."""

    def change(t: float, x: Array, targets: Array) -> tuple[Array, int]:
        A = np.take(constraints.matrix(t, x), free, axis=1)
        M = mass_matrix(t, x)[np.ix_(free, free)]
        root = np.linalg.cholesky(M)
        B = np.linalg.solve(root, A.T).T  # v = root^-T w, of least length
        w, _, rank, _ = np.linalg.lstsq(B, targets, rcond=max(INDEPENDENT, constraints.dependence_limit))
        out = np.zeros(constraints.n_u)
        out[free] = np.linalg.solve(root.T, w)
        return out, int(rank)

    return change


def search_closed(constraints: Constraints, x0: Array, nearest: SmallestChange, nearest_to_x0: bool) -> Array:
    """Search a closed state from x0 with steps of limited length; nearest_to_x0: the closed state nearest to x0."""
    n_q, d, x = constraints.n_q, np.zeros(constraints.n_u), np.array(x0, float)
    z = x[n_q + len(d) :]  # states of effectors, which stay: masses of tanks count
    part, before = 1.0, np.inf  # of a step that is taken; the size of the one before
    for _ in range(STEPS):
        gap, resting = constraints.residuals(0.0, x)[0], np.concatenate([x[:n_q], 0.0 * d, z])
        if nearest_to_x0:
            speeds = (constraints.residuals(0.0, np.concatenate([x[:n_q], v, z]))[1] for v in (d, 0.0 * d))
            change = nearest(0.0, resting, next(speeds) - next(speeds) - gap)[0] - d
        else:
            change = nearest(0.0, resting, -gap)[0]
        largest = np.abs(change).max(initial=0.0)
        part = (
            part if largest < LEAST_REDUCTION * before else max(part / 2, SMALLEST_FACTOR)
        )  # it swings about the nearest point
        before = largest
        d = d + change * min(part, MAX_STEP / max(largest, MAX_STEP))
        advanced_q = np.empty(n_q)
        advance(np.ascontiguousarray(x0[:n_q]), d, advanced_q, *constraints.arrays)
        x[:n_q] = advanced_q
        if largest < SETTLED:
            break
    return x


def worst_of(constraints: Constraints, x: Array, violations: Array, limits: Array) -> tuple[str, str, float]:
    """Name, what competes with it in words, and largest violation of the constraint that exceeds its limits most.

    x (n_x,); violations, limits (n_rows,)
    """
    worst = max(constraints.names, key=lambda name: (violations / limits)[constraints.rows_of(name)].max())
    competing = competing_motions_text(constraints, 0.0, x, worst)
    return constraints.kind_of(worst), competing, float(violations[constraints.rows_of(worst)].max())


def refuse_open(constraints: Constraints, x: Array, limits: Array) -> None:
    """Raise ValueError for a loop that x leaves open by more than the limits (n_rows,)."""
    gaps = np.abs(constraints.residuals(0.0, x)[0])
    if np.all(gaps <= limits):
        return
    worst, competing, gap = worst_of(constraints, x, gaps, limits)
    raise ValueError(
        f"{worst} cannot close{competing}: the best configuration found leaves a gap of {gap:.3g} (m or "
        f"rad){kept_values_text(constraints)}. Check the lengths and the markers' axes, or start nearer to a closed "
        f"configuration{clearance_text(constraints, gaps)}."
    )


def refuse_bent(constraints: Constraints, x0: Array, x: Array, size: float) -> None:
    """Raise ValueError when a body had to be bent far to close the loops."""
    for place in body_places(constraints.system):
        name, body, shapes = place.name, place.body, place.shapes_q
        change = body.amplitudes(x[shapes]) - body.amplitudes(x0[shapes])
        distance = max(float(np.linalg.norm(marker.phi @ change)) for marker in body.markers.values())
        if distance > MAX_BENDING * size:
            raise ValueError(
                f"the loops of body {name!r} cannot close: the joints alone do not reach, and bending would move it by "
                f"{distance:.3g} m, {100 * distance / size:.3g} % of its size. Check the lengths and the markers' "
                "axes, or start nearer to a closed configuration."
            )


def refuse_moving(constraints: Constraints, x: Array, tolerance: float) -> None:
    """Raise ValueError for a constraint whose velocities x cannot satisfy, to within the play of its rows."""
    speeds = np.abs(constraints.residuals(0.0, x)[1])
    limits = np.maximum(tolerance, OPENING_RATE * constraints.row_plays) * max(
        1.0, np.abs(x[constraints.n_q : constraints.n_q + constraints.n_u]).max(initial=0.0)
    )
    if np.all(speeds <= limits):
        return
    worst, competing, speed = worst_of(constraints, x, speeds, limits)
    raise ValueError(
        f"{worst} cannot be satisfied{competing}: the nearest velocities violate it by {speed:.3g} (m/s or "
        f"rad/s){kept_values_text(constraints)}. Remove one of them."
    )


def clearance_text(constraints: Constraints, gaps: Array) -> str:
    """Return advice for loops whose misfit is no more than rounded digits; "" for all others."""
    gap = float((gaps * constraints.row_lengths).max())
    if gap > DIGITS * characteristic_length(constraints.system) or not constraints.system.loops:
        return ""
    return f", or give the loop `play` of {10.0 ** np.ceil(np.log10(gap)):.0e} m: the loop is overconstrained"


def kept_values_text(constraints: Constraints) -> str:
    """Return the names of the initial values that must not move, in words."""
    names = constraints.system.keep
    return f", with {', '.join(repr(name) for name in names)} kept as given" if names else ""


def refuse_accelerations(constraints: Constraints, x: Array, size: float) -> None:
    """Raise ValueError for a constraint whose accelerations cannot be met by any multipliers at the start x (n_x,).

    In a singular configuration the rows lose rank. The velocities have to lie along one of the branches that meet
    there: n . (bdot - Adot u) = 0 for every n with n A = 0, a condition of second order in u.
    """
    udot, rows, rank, _ = constraints.solved(np.zeros(1), x[None])
    closing, m = constraints.closing, constraints.n_rows
    if rank[0] == m:
        return
    first, width = int(closing["white"]), int(closing["width"])
    white = constraints.arrays[2][first : first + m * width].reshape(m, width)
    targets = rows[0, :, layout.R_TARGET]
    missing = np.abs(white @ (white.T @ rows[0, :, layout.R_LAMBDA]) - targets)
    speed, rate = (
        np.abs(x[constraints.n_q : constraints.n_q + constraints.n_u]).max(initial=0.0),
        np.abs(udot).max(initial=0.0),
    )
    limits = ACCELERATION_TOLERANCE * max(1.0, size, np.abs(targets).max()) + OPENING_RATE * constraints.row_plays * (
        speed**2 + rate
    )
    if np.all(missing <= limits):
        return
    worst, competing, acceleration = worst_of(constraints, x, missing, limits)
    raise ValueError(
        f"{worst} cannot be satisfied{competing} at the start: the nearest accelerations violate it by "
        f"{acceleration:.3g} (m/s^2 or rad/s^2). Another constraint contradicts it, or "
        "the loop starts in a singular configuration, where branches meet, with rates along none of them. Give "
        "the rates of all its joints, or start slightly off the singular configuration."
    )
