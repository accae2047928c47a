"""Lowering loops and nonholonomic constraints to records, pool and scratch."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from femflex.body import FlexibleBody
from femflex.dynamics.layout import constraint_records as layout
from femflex.dynamics.layout.pool import Pool, Scratch, add_marker
from femflex.system import Joint, Nonholonomic, RollingDisc, System, VelocityRows, closure

Ends = tuple[tuple[str | None, str], tuple[str | None, str]]  # body and marker of P, of Q

POSITION_TOLERANCE = 1e-13  # position residual to which every step is brought back, relative to the size of the bodies

DEPENDENT = 1e-8  # what remains of a row below this part of the longest row: it depends on those before

MISALIGNMENT_FACTOR = (
    10.0  # how much larger the part of a row that does not follow may be than its play over the bodies' size
)

KINDS = {
    "rolling_disc": layout.CONSTRAINT_DISC,
    "knife_edge": layout.CONSTRAINT_EDGE,
    "rows": layout.CONSTRAINT_GENERAL,
}


def lower_constraints(
    head: np.void, bodies: NDArray[np.void], system: System, pool: Pool, scratch: Scratch
) -> list[NDArray[np.void]]:
    """The CLOSING record, and the CONSTRAINT records of all loops, then all nonholonomic constraints."""
    constraints: list[Joint | Nonholonomic] = [*system.loops, *system.constraints]
    closing, records = np.zeros(1, layout.CLOSING), np.zeros(len(constraints), layout.CONSTRAINT)
    n_rows, n_u = 0, int(head["n_u"])
    for record, constraint in zip(records, constraints, strict=True):
        record["first"] = n_rows
        record["play"] = pool.add([constraint.play if isinstance(constraint, Joint) else 0.0])
        if isinstance(constraint, Joint):
            lower_loop(record, constraint, system, pool)
        else:
            lower_nonholonomic(record, constraint, system, pool)
        if record["kind"] == layout.CONSTRAINT_GENERAL:
            record["general"] = scratch.take(int(record["n_rows"]) * (n_u + 2))
        else:
            take_motions(record, bodies, scratch)
        n_rows += int(record["n_rows"])
    if constraints:
        lower_closing(closing[0], system, pool, n_rows, len(constraints))
        hidden = 3 * int(any(b["hidden"] for b in bodies[1:]))
        closing[0]["n_hidden"], closing[0]["width"] = hidden, n_u + hidden
        take_scratch(closing[0], head, scratch)
    return [closing, records]


def lower_closing(closing: np.void, system: System, pool: Pool, n_rows: int, n_constraints: int) -> None:
    """Counts and the tolerance of positions."""
    size = characteristic_length(system)
    closing["n_constraints"], closing["n_rows"] = n_constraints, n_rows
    closing["tolerance"] = pool.add_unshared([POSITION_TOLERANCE * size, size, dependence_limit(system)])


def dependence_limit(system: System, least: float = DEPENDENT) -> float:
    """Return the part of the longest row below which the rest of a row counts as dependent on those before; it is
    larger where loops have play.

    An axis that is askew by an angle leaves a row that part of which does not follow from the others, and a loop open
    by the angle times its size as it moves.
    """
    play = max((loop.play for loop in system.loops), default=0.0)
    return max(least, MISALIGNMENT_FACTOR * play / characteristic_length(system))


def take_scratch(closing: np.void, head: np.void, scratch: Scratch) -> None:
    """Places in the work array."""
    m, width = int(closing["n_rows"]), int(closing["width"])
    sizes = {"rows": layout.ROW_SIZE * m, "white": m * width, "roots": width, "small": 3 * m * m + 5 * m}
    sizes |= {
        "step": int(head["n_u"]),
        "free": int(head["n_u"]),
        "moved": int(head["n_q"]),
        "basis": m * width,
        "moved_by": width,
        "note": layout.NOTE_SIZE,
        "marks": int(head["n_bodies"]),
        "task": 1,
    }
    for key, count in sizes.items():
        closing[key] = scratch.take(count)


def take_motions(record: np.void, bodies: NDArray[np.void], scratch: Scratch) -> None:
    """Places of the motions of markers P and Q in the work array."""
    for side, role in zip("PQ", ("parent", "child"), strict=True):
        record[f"motion_{side}"] = scratch.take(layout.M_COLUMNS + 6 * int(bodies[record[role]]["row"]))


def lower_loop(record: np.void, joint: Joint, system: System, pool: Pool) -> None:
    """A cut joint's markers and rows."""
    ends = ((joint.parent, joint.parent_marker), (joint.child, joint.child_marker))
    lower_ends(record, ends, system, pool)
    slide, turn = free_scales(ends, system)
    rows = closure(joint)
    record["kind"] = layout.CONSTRAINT_LOOP
    record["n_slides"], record["slides"] = len(rows.slides), pool.add_unshared(rows.slides)
    record["n_pairs"], record["pairs"] = len(rows.pairs), pool.add_unshared(rows.pairs)
    record["n_rows"] = rows.n_rows
    record["scales"] = pool.add([slide] * len(rows.slides) + [turn] * len(rows.pairs))


def lower_nonholonomic(record: np.void, constraint: Nonholonomic, system: System, pool: Pool) -> None:
    """A velocity constraint's markers, axes and rows; the address of a user's function is filled in by the model."""
    record["kind"], record["n_rows"] = KINDS[constraint.kind], constraint.n_rows
    if isinstance(constraint, VelocityRows):
        record["scales"] = pool.add(np.zeros(constraint.n_rows))
        return
    ends = ((constraint.parent, constraint.parent_marker), (constraint.body, constraint.marker))
    lower_ends(record, ends, system, pool)
    if isinstance(constraint, RollingDisc):
        record["axis"] = pool.add([*constraint.axis, *constraint.normal, constraint.radius])
    else:
        record["axis"] = pool.add(constraint.across)
    record["scales"] = pool.add([free_scales(ends, system)[0]] * constraint.n_rows)


def lower_ends(record: np.void, ends: Ends, system: System, pool: Pool) -> None:
    """Bodies and markers P and Q into the record."""
    for side, role, (name, marker_name) in zip("PQ", ("parent", "child"), ends, strict=True):
        if name is not None:
            record[role] = 1 + system.order.index(name)
        entries = add_marker(name, marker_name, system, pool)
        for key, entry in zip(("place", "shape", "spin", "bends"), entries, strict=True):
            record[f"{key}_{side}"] = entry


def free_scales(ends: Ends, system: System) -> tuple[float, float]:
    """The scales of a force row and of a torque row between two bodies.

    A row's scale is the inverse square root of the acceleration that its unit multiplier gives the two bodies were
    they free and rigid: against it a row that cannot move anything shows as zero, whatever the units.
    """
    slide = turn = 0.0
    for name, marker_name in ends:
        if name is not None:
            body = system.bodies[name]
            inertia = mean_inertia(body)
            arm = body.marker(marker_name).position - body.moments.center_of_mass()
            slide += 1.0 / body.moments.mass + float(arm @ arm) / inertia
            turn += 1.0 / inertia
    return 1.0 / np.sqrt(slide), 1.0 / np.sqrt(turn)


def mean_inertia(body: FlexibleBody) -> float:
    """Mean moment of inertia about the centre of mass; of a mass point, that of its mass at one metre [kg m^2]."""
    m, c = body.moments.mass, body.moments.center_of_mass()
    inertia = (np.trace(body.moments.inertia()) - 2.0 * m * c @ c) / 3.0
    return float(inertia) if inertia > 1e-14 * m else float(m)


def characteristic_length(system: System) -> float:
    """Largest distance of a marker from its body's origin, or radius of a disc; 1 m if there is none [m]."""
    lengths = [float(np.linalg.norm(m.position)) for b in system.bodies.values() for m in b.markers.values()]
    radii = [c.radius for c in system.constraints if isinstance(c, RollingDisc)]
    return max([*lengths, *radii], default=0.0) or 1.0
