"""Case and bodies -> System."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from femflex.body import FlexibleBody
from femflex.case.builders.body import build_bodies
from femflex.case.builders.choice import choices, undecided, with_strains
from femflex.case.builders.closed import build_constraint, build_loops, build_spring
from femflex.case.builders.foresight import Carried, ahead, foreseen
from femflex.case.builders.initial import initial_shape
from femflex.case.builders.joint_shapes import (
    RicherCraft,
    has_joint_shapes,
    open_joints,
    richer_craft,
    warn_of_truncation,
    with_joint_shapes,
    with_lacks,
)
from femflex.case.builders.joints import build_joints, root_joint
from femflex.case.builders.loads import build_loads
from femflex.case.builders.near_buckling import is_judged, nearest, warn_of_buckling, with_doubts
from femflex.case.builders.references import channel_problems, duration_of, motion_problems, size_problems
from femflex.case.builders.shared import shared_structures
from femflex.case.builders.snapping import responding
from femflex.case.builders.spun import spun_up, with_spin_shapes
from femflex.case.builders.start import placed
from femflex.case.builders.stretching import stretching
from femflex.case.case import Case
from femflex.case.orbit import OrbitTable
from femflex.case.problems import CaseError, Problem
from femflex.system import Environment, Frame, Load, Orbit, Part, Sight, System, assembled
from femflex.warning import PhysicsWarning

Array = NDArray[np.float64]


def build_system(case: Case, bodies: Mapping[str, Part] | None = None) -> System:
    """The System a case describes, with these bodies or with its own.

    Its own bodies that do not say their strain get the one that their places in the system call for.
    Raises CaseError with everything that does not fit together.
    """
    return decided_system(case, bodies)[1]


def decided_system(
    case: Case, bodies: Mapping[str, Part] | None = None, *, warning: bool = True
) -> tuple[Case, System]:
    """The System of `build_system`, and the case with the strain and the responses of its bodies written out.

    warning: warn of bodies that come near to buckling, too; without it these are only sought where strain is chosen.
    """
    with shared_structures():
        return _decided_system(case, bodies, warning)


def _decided_system(case: Case, bodies: Mapping[str, Part] | None, warning: bool) -> tuple[Case, System]:
    if bodies is not None:
        return _said(case, _bodies_and_loads(case, bodies)[0], False, warning)
    case, parts, richer = _joined(case)
    names = undecided(case)
    if not names:
        case, system = _said(case, parts, True, warning)
    else:
        case, system = _chosen(case, parts, names)
    warn_of_truncation(case, system, richer)
    return case, _light(with_lacks(case, system, richer))


def with_own_joints(case: Case) -> Case:
    """The case with the static shapes of joints written out that its bodies get in its system.

    Raises CaseError where that cannot be built.
    """
    if not open_joints(case):
        return case
    with shared_structures():
        return _joined(case)[0]


def _joined(case: Case) -> tuple[Case, dict[str, Part], RicherCraft]:
    """The case with the static shapes of joints written out, its bodies, and its craft in richer sets.

    Bodies that do not say their strain are linear.
    """
    linear = with_strains(case, dict.fromkeys(undecided(case), "linear"))
    parts = _bodies_and_loads(linear, None)[0]
    richer = richer_craft(system_of(linear.model_copy(update={"initial": None}), parts))
    open_, case = open_joints(case), with_joint_shapes(case, richer)
    changed = {name: case.bodies[name] for name in open_ if has_joint_shapes(case.bodies[name])}
    if changed:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", PhysicsWarning)  # given when the bodies were built first
            asked = case.model_copy(update={"bodies": changed})
            parts |= build_bodies(with_strains(asked, dict.fromkeys(undecided(asked), "linear")))
    return case, parts, richer


def _chosen(case: Case, parts: dict[str, Part], names: list[str]) -> tuple[Case, System]:
    """The case with the strain of these bodies chosen, and its system."""
    system = system_of(with_strains(case, dict.fromkeys(names, "linear")), parts)
    view = foreseen(system, duration_of(case, system))
    near = nearest(view.rigid, system)
    case, spinning = _spun(case, system, view.rigid)
    chosen = choices(case, system, names, near, view)
    others: dict[str, Part] = {}
    if wanted := {name: one for name, one in chosen.items() if one[0] != "linear"}:
        open_ = [name for name, (_, why) in wanted.items() if "%s" in why]
        others, said, case = stretching(case, wanted, {name: responding(case, system, name) for name in open_})
        chosen |= said
    if others or spinning:
        system = system_of(case, parts | spinning | others)
    noted: dict[tuple[int, str], FlexibleBody] = {}  # bodies alike stay one
    found = dict(system.bodies)
    for name, (strain, why) in chosen.items():
        body = found[name]
        note = "; ".join(part for part in (f"strain is {strain}: {why}", body.note) if part)
        found[name] = noted.setdefault((id(body), note), replace(body, note=note))
    system = with_doubts(replace(system, bodies=found), view.rigid, view.short)
    warn_of_buckling(system, near)
    return case, system


def _said(case: Case, parts: dict[str, Part], own: bool, warning: bool) -> tuple[Case, System]:
    """The case and its system with these bodies, all of which say their strain; own: they are the case's.

    warning: warn of those that come near to buckling.
    """
    system = system_of(case, parts)
    rigid, why = ahead(system, duration_of(case, system)) if is_judged(system) else (None, "")
    if own:
        case, spinning = _spun(case, system, rigid)
        system = system_of(case, parts | spinning) if spinning else system
    if warning:
        warn_of_buckling(system, nearest(rigid, system))
    system = with_doubts(system, rigid, why)
    return case, system if own else _light(system)


def _spun(case: Case, system: System, rigid: Carried | None) -> tuple[Case, dict[str, Part]]:
    """The case with the shapes of spin of bodies that are spun up as foreseen, and of these those that say a strain."""
    asking = case if rigid is None else with_spin_shapes(case, spun_up(system, rigid))
    open_ = undecided(case)
    changed = {
        name: table
        for name, table in asking.bodies.items()
        if table is not case.bodies[name] and name not in open_ and getattr(table, "strain", None) != "linear"
    }
    return asking, build_bodies(asking.model_copy(update={"bodies": changed})) if changed else {}


def _light(system: System) -> System:
    """The system without the structures by which its bodies were judged."""
    light = {
        id(body): replace(body, buckling=None, softening=None, hardening=None, enrichment=None)
        for body in system.bodies.values()
    }
    return replace(system, bodies={name: light[id(body)] for name, body in system.bodies.items()})


def system_of(case: Case, bodies: Mapping[str, Part] | None) -> System:
    """The System of a case with these bodies, or its own with linear strain where they do not say; as `build_system`.

    Its bodies keep what they are judged by.
    """
    parts, loads = _bodies_and_loads(case, bodies)
    try:
        joint, parts = root_joint(case, parts)
        joints = (*(() if joint is None else (joint,)), *build_joints(case))
        orbit = build_orbit(case.orbit)
        system = assembled(
            parts,
            joints,
            loads,
            frame=build_frame(case),
            orbit=orbit,
            libration_sequence=case.attitude.sequence,
            loops=build_loops(case),
            constraints=tuple(build_constraint(table) for table in case.constraints),
            springs=tuple(build_spring(table) for table in case.springs),
            sights=tuple(Sight(**table.model_dump()) for table in case.sights),
            reactions=case.run.reactions,
            environment=Environment(np.array(case.environment.gravity)),
        )
    except CaseError:
        raise
    except (ValueError, KeyError) as error:
        problems = [Problem("", line) for line in str(error.args[0]).splitlines()]
        raise CaseError(case.path.name, problems) from error
    system = _kept(case, _with_initial(case, system))
    _check_references(case, system)
    given = case.attitude.position is not None, case.attitude.velocity is not None
    if orbit is not None and orbit.free and joint is not None and not all(given):
        system = centred(system, *given)
    return placed(case, system)


def _bodies_and_loads(case: Case, bodies: Mapping[str, Part] | None) -> tuple[dict[str, Part], tuple[Load, ...]]:
    """Bodies (built if not given) and loads, their problems told together."""
    problems: list[Problem] = []
    parts: dict[str, Part] = {}
    loads: tuple[Load, ...] = ()
    try:
        parts = dict(bodies) if bodies is not None else build_bodies(case)
    except CaseError as error:
        problems += error.problems
    try:
        loads = build_loads(case)
    except CaseError as error:
        problems += error.problems
    if problems:
        raise CaseError(case.path.name, problems)
    return parts, loads


def _check_references(case: Case, system: System) -> None:
    from femflex.dynamics import compile_system

    try:
        channels = compile_system(system).channels
    except ValueError as error:  # a loop that cannot close
        raise CaseError(case.path.name, [Problem("", str(error.args[0]))]) from error
    problems = [*channel_problems(case, channels), *motion_problems(case, system)]
    problems += size_problems(case, system, channels, Path.cwd())
    if problems:
        raise CaseError(case.path.name, problems)


def _kept(case: Case, system: System) -> System:
    """The system with the initial values that its case keeps where loops close."""
    if case.initial is None or case.initial.keep is None:
        return system
    try:
        return replace(system, keep=tuple(case.initial.keep))
    except ValueError as error:
        raise CaseError(case.path.name, [Problem("initial.keep", str(error.args[0]))]) from error


def build_orbit(table: OrbitTable) -> Orbit | None:
    """The orbit, or None."""
    if table.kind == "none":
        return None
    shape = {
        key: getattr(table, key) for key in ("eccentricity", "inclination", "node", "perigee", "true_anomaly", "mu")
    }
    return Orbit(table.perigee_radius / (1.0 - table.eccentricity), free=table.kind == "free", **shape)


def build_frame(case: Case) -> Frame:
    """The base frame: that of [attitude], or orbital with an orbit and inertial without."""
    kind = case.attitude.frame or ("inertial" if case.orbit.kind == "none" else "orbital")
    return Frame(kind, np.array(case.attitude.spin)) if case.attitude.spin is not None else Frame(kind)


def centred(system: System, position_given: bool = False, velocity_given: bool = False) -> System:
    """The system with its root body shifted so that the centre of mass starts at O, at rest in the orbital motion."""
    if not position_given:
        shift = _observed(system, "monitors/center_of_mass")
        system = _moved(system, q=-shift)
    if not velocity_given:
        mass = sum(body.moments.mass for body in system.bodies.values())
        system = _moved(system, u=-_observed(system, "monitors/momentum") / mass)
    return system


def _observed(system: System, path: str) -> Array:
    """A vector channel at t = 0 in axes of the base frame."""
    from femflex.dynamics import compile_system
    from femflex.rotations import dcm_from_quaternion

    model = compile_system(system)
    seen = model.observe(np.zeros(1), model.x0[None])
    vector = np.asarray(seen[path][0])
    return dcm_from_quaternion(seen["orbit/attitude"][0]).T @ vector if system.frame.kind == "orbital" else vector


def _moved(system: System, q: Array | float = 0.0, u: Array | float = 0.0) -> System:
    root = system.joint_of(system.root)
    q0, u0 = root.q0.copy(), root.u0.copy()
    q0[:3] += q
    u0[:3] += u
    joints = tuple(root.with_initial(q0, u0) if joint is root else joint for joint in system.joints)
    return replace(system, joints=joints)


def _with_initial(case: Case, system: System) -> System:
    delta, ddelta = {}, {}
    problems = []
    for name, table in case.bodies.items():
        if table.initial is None:
            continue
        body = system.bodies[name]
        held_at = body.marker(system.joint_of(name).child_marker).position
        try:
            delta[name], ddelta[name] = initial_shape(table.initial, body, held_at)
        except (ValueError, KeyError) as error:
            problems.append(Problem(f"bodies.{name}.initial", str(error.args[0])))
    if problems:
        raise CaseError(case.path.name, problems)
    return replace(system, delta0=delta, ddelta0=ddelta)
