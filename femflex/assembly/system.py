"""Build the System of a case from its bodies."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from femflex.assembly.bodies import build_bodies
from femflex.assembly.craft import build_craft
from femflex.assembly.deploying import with_deployment
from femflex.assembly.initial import initial_shape
from femflex.assembly.joints import build_joints, build_loops, root_joint
from femflex.case.case import Case
from femflex.noun.problems import CaseError, Problem
from femflex.system import Frame, Load, Part, System, assembled


def system_of(case: Case, bodies: Mapping[str, Part] | None) -> System:
    """The System of a case with these bodies, or with its own (linear strain by default).

    The initial centre of mass, and a start from an equilibrium or from another run, are set later (`pipeline.start`).
    Raises CaseError with the inconsistencies of its tables.
    """
    parts, loads = bodies_and_loads(case, bodies)
    try:
        craft = build_craft(case, parts)
        joint, parts = root_joint(case, craft.parts)
        joints = (*(() if joint is None else (joint,)), *build_joints(case))
        orbit = case.orbit_with_rates()
        system = assembled(
            parts,
            joints,
            loads,
            frame=build_frame(case),
            orbit=orbit,
            libration_sequence=case.attitude.sequence,
            loops=build_loops(case),
            constraints=tuple(case.constraints),
            springs=tuple(case.springs),
            sights=tuple(case.sights),
            reactions=case.run.reactions,
            momenta=case.run.momenta,
            environment=case.environment_with_radius(),
            effectors=craft.effectors,
            varying=craft.varying,
        )
    except CaseError:
        raise
    except (ValueError, KeyError) as error:
        problems = [Problem("", line) for line in str(error.args[0]).splitlines()]
        raise CaseError(case.path.name, problems) from error
    return _with_kept_values(case, with_deployment(case, _with_initial(case, system)))


def problems_of_loads(case: Case) -> list[Problem]:
    """The problems of the CSV files of the loads of a case."""
    problems = []
    for load in case.loads:
        try:
            load.read_from(case.path.parent)
        except (ValueError, OSError) as error:
            problems.append(Problem(f"loads[{load.name}]", str(error)))
    return problems


def bodies_and_loads(case: Case, bodies: Mapping[str, Part] | None) -> tuple[dict[str, Part], tuple[Load, ...]]:
    """The bodies of a case (built if not given) and its loads. Raises CaseError with the problems of both together."""
    problems: list[Problem] = []
    parts: dict[str, Part] = {}
    try:
        parts = dict(bodies) if bodies is not None else build_bodies(case)
    except CaseError as error:
        problems += error.problems
    if problems := [*problems, *problems_of_loads(case)]:
        raise CaseError(case.path.name, problems)
    return parts, tuple(load.read_from(case.path.parent) for load in case.loads)


def _with_kept_values(case: Case, system: System) -> System:
    """The system with the list of initial values that closing the loops must not change (`initial.keep`)."""
    if case.initial is None or case.initial.keep is None:
        return system
    try:
        return replace(system, keep=tuple(case.initial.keep))
    except ValueError as error:
        raise CaseError(case.path.name, [Problem("initial.keep", str(error.args[0]))]) from error


def build_frame(case: Case) -> Frame:
    """The base frame: that of [attitude], or orbital with an orbit and inertial without."""
    kind = case.attitude.frame or ("inertial" if case.orbit.kind == "none" else "orbital")
    return Frame(kind, np.array(case.attitude.spin)) if case.attitude.spin is not None else Frame(kind)


def _with_initial(case: Case, system: System) -> System:
    delta, ddelta = {}, {}
    problems = []
    for name, table in case.bodies.items():
        if table.initial is None:
            continue
        body = system.bodies[name]
        joint_position = body.marker(system.joint_of(name).child_marker).position
        try:
            delta[name], ddelta[name] = initial_shape(table.initial, body, joint_position)
        except (ValueError, KeyError) as error:
            problems.append(Problem(f"bodies.{name}.initial", str(error.args[0])))
    if problems:
        raise CaseError(case.path.name, problems)
    return replace(system, delta0=delta, ddelta0=ddelta) if delta else system
