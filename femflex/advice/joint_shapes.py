"""Static shapes for what joints transmit to the bodies of a case, chosen from its craft's modes; and what sets lack.

Vibration modes are those of a body that carries nothing, on a root that stands still. Where a joint or a loop pulls at
it, or a light parent lets its root move, a few of them are far off: two booms welded in line, four modes each, 3 % in
the first frequency. The static shapes of the joint's forces and moments, and of the accelerations of the root, make the
set exact there in statics. Which of them a craft needs its modes show: those in a richer set (`Enriched`), in which
every joint has all its static shapes and what inertia adds to these. A direction is kept where it stores more than
SHARE of the strain energy of one of the LOWEST elastic modes, or of one below the `band` of the run, that the body's
other shapes do not hold; dropping it would raise that frequency by half the share. A pull along a slender boom stores
nothing and would be the craft's one stiff coordinate: it is left out. A root that cannot move needs no static shapes.
"""

from __future__ import annotations

import logging
import warnings
from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from femflex.advice.enriched import Enriched, Place
from femflex.case.body import AnalyticTable, BodyTable, FileTable, FlexibleTable
from femflex.case.case import Case
from femflex.case.reduction import CantileverTable, Stretchable
from femflex.case.support import DIRECTIONS
from femflex.dynamics.equilibria.rest_modes import RestModes, rest_modes, truncation
from femflex.system import System
from femflex.system.ties import tie_places
from femflex.warning import TruncationWarning

Array = NDArray[np.float64]
log = logging.getLogger(__name__)

SHARE = 1e-3  # of a mode's strain energy: 0.05 % of its frequency
LOWEST = 3  # elastic modes of the craft that sets are to hold
DOUBTFUL = 0.01  # change of such a frequency with richer sets, from which on a case is warned of
ROUNDING = 1e-6  # part of a static shape outside the others below which they hold it
UNLOWEST = "whether richer sets would change the craft's frequencies is not judged for it"
MANY = 600  # coordinates of the richer craft up to which its modes are sought


@dataclass(frozen=True, eq=False)
class RicherCraft:
    """A craft in richer sets, or why there is none.

    bodies and markers (of joints) by name; still: names of bodies whose root cannot move
    """

    bodies: Mapping[str, Enriched]
    modes: RestModes | None = None
    markers: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    still: frozenset[str] = frozenset()
    lack: str = ""


def richer_craft(system: System) -> RicherCraft:
    """A system with those of its bodies in richer sets that know their structure."""
    markers = {name: tuple(sorted(found)) for name, found in joint_markers(system).items()}
    try:
        bodies = _enriched(system, markers)
        count = sum((bodies[name].body if name in bodies else body).n_modes for name, body in system.bodies.items())
        if not bodies or count > MANY:
            return RicherCraft({}, lack=f"{count} coordinates with richer sets, over {MANY}" if bodies else "")
        modes = rest_modes(system, {name: found.body for name, found in bodies.items()})
    except (ValueError, RuntimeError, np.linalg.LinAlgError) as error:
        return RicherCraft({}, lack=str(error).partition("\n")[0].rstrip("."))
    return RicherCraft(bodies, modes, markers, frozenset(name for name in bodies if _stands(system, name)))


def _enriched(system: System, markers: Mapping[str, tuple[str, ...]]) -> dict[str, Enriched]:
    """The bodies that know their structure in richer sets; bodies alike are enriched once."""
    bodies = dict[str, Enriched]()
    made: dict[tuple[int, tuple[str, ...]], Enriched] = {}
    for name, body in system.bodies.items():
        if body.enrichment is not None and body.n_modes:
            key = (id(body.enrichment), markers.get(name, ()))
            if key not in made:
                made[key] = body.enrichment(body, key[1])
            bodies[name] = made[key]
    return bodies


def _stands(system: System, name: str) -> bool:
    """Whether the root of a body cannot move: it, and all rigid bodies that it hangs on, stand in the base frame."""
    joint = system.joint_of(name)
    if joint.n_u > len(joint.held) or system.orbit is not None:
        return False
    return joint.parent is None or (not system.bodies[joint.parent].n_modes and _stands(system, joint.parent))


def joint_markers(system: System) -> dict[str, set[str]]:
    """Names of the markers of each body at which joints, loops, constraints and springs pull."""
    found: dict[str, set[str]] = {}
    for joint in system.joints:
        found.setdefault(joint.child, set()).add(joint.child_marker)
        if joint.parent is not None:
            found.setdefault(joint.parent, set()).add(joint.parent_marker)
    for _, body, marker in tie_places(system.loops, system.constraints, system.springs):
        found.setdefault(body, set()).add(marker)
    return found


def with_joint_shapes(case: Case, richer: RicherCraft) -> Case:
    """The case with the static shapes of joints written out in the tables of its bodies that leave them open.

    Bodies whose tables and joints are alike keep the same ones.
    """
    open_ = open_joints(case)
    alike = {name: f"{_said(case.bodies[name])} {richer.markers.get(name)}" for name in open_}
    chosen: dict[str, set[Place]] = {}
    band = case.run.band or 0.0
    for name in open_:
        if richer.modes is not None and name in richer.bodies:
            found, served, still = richer.bodies[name], richer.modes.lowest_elastic(LOWEST, band), name in richer.still
            allowed = {place: x for place, x in found.choices.items() if _is_open(case.bodies[name], place, still)}
            motions = richer.modes.shapes[name][:, served] / richer.modes.omega[served]
            chosen.setdefault(alike[name], set()).update(needed(found, allowed, motions))
    tables = {name: _with_joints(case.bodies[name], chosen.get(alike[name], set())) for name in open_}
    return case.model_copy(update={"bodies": {**case.bodies, **tables}})


def needed(found: Enriched, choices: Mapping[Place, Array], motions: Array) -> list[Place]:
    """The places of those choices (n, m) that motions (n, k) of strain energy 1 / 2 of the whole craft want, in turn.

    That first which holds most of the energy that is left in one of them, as long as it holds SHARE.
    """
    V1 = found.body.strain.V1
    energy, ways = np.linalg.eigh((V1 + V1.T) / 2)
    root = np.sqrt(np.maximum(energy, 0.0))[:, None] * ways.T
    Q = np.linalg.qr(root @ found.kept)[0]
    left = root @ motions
    places: list[Place] = []
    while True:
        left = left - Q @ (Q.T @ left)
        gains = {}
        for place, x in choices.items():
            if place not in places and (direction := _outside(Q, root @ x)).size:
                gains[place] = float(((direction.T @ left) ** 2).sum(axis=0).max(initial=0.0)), direction
        best = max(gains, key=lambda place: gains[place][0], default=None)
        if best is None or gains[best][0] < SHARE:
            return places
        places.append(best)
        Q = np.column_stack([Q, gains[best][1]])


def _outside(Q: Array, x: Array) -> Array:
    """Orthonormal basis (n, m) of what columns x have outside the orthonormal Q; none where that is rounding."""
    size = np.linalg.norm(x, axis=0)
    for _ in range(2):
        x = x - Q @ (Q.T @ x)
    x = x[:, np.linalg.norm(x, axis=0) > ROUNDING * size]
    return np.linalg.qr(x)[0] if x.size else x[:, :0]


def open_joints(case: Case) -> list[str]:
    """Names of the bodies whose tables leave it open which static shapes of joints they keep."""
    return [name for name, table in case.bodies.items() if _leaves_open(table)]


def _leaves_open(table: BodyTable) -> bool:
    if isinstance(table, AnalyticTable):
        return table.functions.joints is None and "static" not in table.functions.model_fields_set
    if not isinstance(table, FlexibleTable) or table.cut is not None:
        return False
    r = table.reduction
    if not isinstance(r, Stretchable) or r.joints is not None:
        return False
    return not (r.responses or r.deflection or r.third_derivatives or isinstance(r.derivatives, int))


def _is_open(table: BodyTable, place: Place, still: bool) -> bool:
    """Whether a body may have the static shapes of a place: `attachment` and `loads` are its word.

    still: its root cannot move.
    """
    if isinstance(table, AnalyticTable):
        return not (still and place[0] == "root")
    r = getattr(table, "reduction", None)
    at_root = place[0] in getattr(r, "clamp", ())
    said = isinstance(r, CantileverTable) and ("attachment" if at_root else "loads") in r.model_fields_set
    return not said and not (still and at_root)


def _said(table: BodyTable) -> str:
    """What a table says but for its initial state."""
    return f"{type(table).__name__} {table.model_dump_json(exclude={'initial'})}"


def _with_joints(table: BodyTable, chosen: set[Place]) -> BodyTable:
    """The table with the static shapes of these places said."""
    groups = sorted({group for group, _ in chosen})
    if isinstance(table, AnalyticTable):
        return table.model_copy(update={"functions": table.functions.model_copy(update={"joints": groups})})
    assert isinstance(table, FlexibleTable) and isinstance(table.reduction, Stretchable)
    joints = {group: [way for way in DIRECTIONS if (group, way) in chosen] for group in groups}
    return table.model_copy(update={"reduction": table.reduction.model_copy(update={"joints": joints})})


def has_joint_shapes(table: BodyTable) -> bool:
    """Whether a table says static shapes of joints."""
    said = table.functions.joints if isinstance(table, AnalyticTable) else getattr(_reduction(table), "joints", None)
    return bool(said)


def _reduction(table: BodyTable) -> object:
    return table.reduction if isinstance(table, FlexibleTable) else None


def warn_of_truncation(case: Case, system: System, richer: RicherCraft) -> None:
    """Warn where richer sets would lower one of the craft's lowest elastic frequencies by more than DOUBTFUL."""
    if richer.modes is None:
        return
    band = case.run.band or 0.0
    try:
        found = truncation(system, richer.modes, LOWEST, band)
    except (ValueError, np.linalg.LinAlgError) as error:
        log.info(f"the craft's frequencies are not judged: {error}")
        return
    high = np.flatnonzero(found.errors > DOUBTFUL)
    if not high.size:
        return
    each = ", ".join(
        f"{k + 1} at {found.kept[k]:.4g} Hz would be at {found.richer[k]:.4g} Hz ({-found.errors[k]:.1%})" for k in high
    )
    judged = f"the first {LOWEST}" + (f" and those below {band:g} Hz" if band else "")
    warnings.warn(
        f"the craft's elastic frequencies ({judged}, at rest, with linear strain) change by more than {DOUBTFUL:.0%} "
        f"with richer sets of shapes: {each}. Raise the number of modes of {_named(system, richer)}, or give the body "
        "more static shapes (`joints`). The richer sets hold all static shapes of the joints and what inertia adds to "
        "them",
        TruncationWarning,
        stacklevel=3,
    )


def _named(system: System, richer: RicherCraft) -> str:
    """The bodies that lack most: those without which the change would be less than half as large."""
    assert richer.modes is not None
    whole = truncation(system, richer.modes, LOWEST).errors.max()
    blamed = []
    for name in richer.bodies:
        others = {key: found.body for key, found in richer.bodies.items() if key != name}
        if truncation(system, rest_modes(system, others), LOWEST).errors.max(initial=0.0) < whole / 2:
            blamed.append(name)
    return ", ".join(map(repr, blamed or richer.bodies))


def with_lacks(case: Case, system: System, richer: RicherCraft) -> System:
    """The system with a word on each body whose set is not judged."""
    said = {}
    for name, body in system.bodies.items():
        if not body.n_modes or name not in case.bodies:
            continue
        why = richer.lack
        if isinstance(case.bodies[name], FileTable):
            why = "the file of a body has no mesh"
        if why:
            said[name] = replace(body, note="; ".join(filter(None, (body.note, f"{UNLOWEST} ({why})"))))
    return replace(system, bodies={**system.bodies, **said}) if said else system
