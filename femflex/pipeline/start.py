"""Initial state of the craft of a case: with its centre of mass at O, in equilibrium, or the end of another run."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from femflex.arrays import Array
from femflex.assembly import system as assembly
from femflex.case.case import Case
from femflex.case.initial import COMPUTED, EQUILIBRIUM, SETTLED
from femflex.dynamics import compile_system
from femflex.effectors import Cable, Sensor, WetMember, with_heavy_cable
from femflex.effectors.catenary import hanging_places
from femflex.effectors.water.motion import DENSITY, DEPTH, FLOOR_STIFFNESS, LEVEL
from femflex.effectors.water.water import water_of
from femflex.noun.problems import CaseError, Problem
from femflex.pipeline.compiled import compiled
from femflex.pipeline.recovery_channels import recovery_channels
from femflex.pipeline.references import channel_problems, motion_problems, size_problems
from femflex.rotations import dcm_from_quaternion
from femflex.system import Context, Effector, Part, System, started

SETTLE = '. from = "settled" starts with shapes and temperatures at rest in the surroundings of the first instant'
ON_FLOOR = 1e-3  # m: height of an end above the floor at which it lies on it


def system_of(case: Case, bodies: Mapping[str, Part] | None = None) -> System:
    """The System of a case in its initial state, with these bodies, or with its own (linear where strain is open).

    Raises CaseError with all errors of the case.
    """
    system = with_heavy_cables(case, assembly.system_of(case, bodies))
    _check_references(case, system)
    position_and_velocity = case.attitude.position is not None, case.attitude.velocity is not None
    unattached = {*case.bodies} - {joint.child for joint in case.joints}  # at most one, with the motion of [attitude]
    if system.orbit is not None and system.orbit.free and unattached and not all(position_and_velocity):
        system = with_mass_centre_at_origin(system, *position_and_velocity)
    return with_initial_state(case, system)


def with_heavy_cables(case: Case, system: System) -> System:
    """The system with its cables of non-zero mass, straight between their ends, with rates interpolated between these.

    Raises CaseError for a cable that cannot be built.
    """
    cables = {name: noun for name, noun in case.effectors["cables"].items() if isinstance(noun, Cable)}
    heavy = {name: cable for name, cable in cables.items() if cable.mass_per_length is not None}
    if not heavy:
        return system
    ends = {
        (name, kind): Sensor(
            kind=kind,
            body=table.body,
            marker=table.marker,
            other_body=table.parent,
            other_marker=table.parent_marker,
        ).effectors(f"{name}_span_{kind}")
        for name, table in heavy.items()
        for kind in ("displacement", "velocity")
    }
    model = compile_system(
        replace(system, effectors=(*system.effectors, *(e for effectors in ends.values() for e in effectors)))
    )
    channels = model.observe(np.zeros(1), model.x0[None])
    problems = []
    for name, table in heavy.items():
        span, rate = (
            np.array([channels[f"effectors/{name}_span_{kind}/{axis}"][0] for axis in "xyz"])
            for kind in ("displacement", "velocity")
        )
        share = (np.arange(table.masses)[:, None] + 0.5) / table.masses
        context, places = Context(folder=case.path.parent), share * span
        try:
            if table.start == "hanging":
                attitude = dcm_from_quaternion(channels[f"bodies/{table.parent}/attitude"][0])
                marker = system.bodies[table.parent].marker(table.parent_marker)
                first = channels[f"bodies/{table.parent}/position"][0] + attitude @ marker.position
                places = _hanging(case, name, table, first, attitude @ marker.orientation, span)
            system = with_heavy_cable(system, name, table, places, share * rate, context)
            system = replace(system, effectors=(*system.effectors, *_water_on_cable(case, name)))
        except ValueError as error:
            problems.append(Problem(f"cables.{name}", str(error.args[0])))
    if problems:
        raise CaseError(case.path.name, problems)
    return system


def _hanging(case: Case, name: str, cable: Cable, first: Array, axes: Array, span: Array) -> Array:
    """Places (n, 3) of the masses of a cable that hangs, axes of the parent's marker. Raises ValueError.

    first: place of its first end; axes: C_NM of its marker; span: to the other end, axes of the marker
    """
    gravity = case.environment.gravity
    g = float(np.linalg.norm(gravity))
    if not g > 0.0:
        raise ValueError('found start = "hanging" without gravity; give environment.gravity, or start it straight')
    assert cable.mass_per_length is not None and cable.length.profile is not None
    weight, floor = cable.mass_per_length * g, False
    for noun, sea in _water_of_cable(case, name):
        weight -= sea[DENSITY] * g * noun.displaced
        lowest = min(float(first @ -gravity), float((first + axes @ span) @ -gravity)) / g
        floor = sea[FLOOR_STIFFNESS] > 0.0 and lowest <= sea[LEVEL] - sea[DEPTH] + ON_FLOOR
    shares = (np.arange(cable.masses) + 0.5) / cable.masses
    length = float(cable.profile(Context(folder=case.path.parent))(0.0)[0])
    return hanging_places(span, length, cable.EA, weight, axes.T @ -gravity / g, shares, floor)


def _water_of_cable(case: Case, name: str) -> list[tuple[WetMember, Array]]:
    """Wet members on a cable, and the numbers of their waters."""
    nouns = {key: noun for named in case.effectors.values() for key, noun in named.items()}
    context = Context(nouns, case.path.parent, gravity=case.environment.gravity)
    wet = [noun for noun in nouns.values() if isinstance(noun, WetMember) and noun.cable == name]
    return [(noun, water_of(context, noun.water).sea(context)) for noun in wet]


def _water_on_cable(case: Case, name: str) -> list[Effector]:
    """Effectors of the water on a cable with mass, whose masses are bodies of the system by now. Raises ValueError."""
    nouns = {key: noun for named in case.effectors.values() for key, noun in named.items()}
    wet = {key: noun for key, noun in nouns.items() if isinstance(noun, WetMember) and noun.cable == name}
    environment = case.environment_with_radius()
    context = Context(nouns, case.path.parent, gravity=environment.gravity)
    return [noun.on_cable(key, context) for key, noun in wet.items()]


def _check_references(case: Case, system: System) -> None:
    try:
        channels = compiled(system).channels
    except ValueError as error:  # a loop that cannot close
        raise CaseError(case.path.name, [Problem("", str(error.args[0]))]) from error
    channels = channels | recovery_channels(case, system).channels
    problems = [*channel_problems(case, channels), *motion_problems(case, system)]
    problems += size_problems(case, system)
    if problems:
        raise CaseError(case.path.name, problems)


def with_mass_centre_at_origin(system: System, position_given: bool = False, velocity_given: bool = False) -> System:
    """The system with its centre of mass at rest at O at the start; a given position or velocity is not changed."""
    if not position_given:
        shift = _observed(system, "monitors/center_of_mass")
        system = _with_shifted_root(system, q=-shift)
    if not velocity_given:
        mass = sum(body.moments.mass for body in system.bodies.values())
        system = _with_shifted_root(system, u=-_observed(system, "monitors/momentum") / mass)
    return system


def _observed(system: System, path: str) -> Array:
    """A vector channel (3,) at t = 0, components in the base frame, in the channel's unit."""
    model = compile_system(system)
    channels = model.observe(np.zeros(1), model.x0[None])
    vector = np.asarray(channels[path][0])
    return dcm_from_quaternion(channels["orbit/attitude"][0]).T @ vector if system.frame.kind == "orbital" else vector


def _with_shifted_root(system: System, q: Array | float = 0.0, u: Array | float = 0.0) -> System:
    root = system.joint_of(system.root)
    q0, u0 = root.q0.copy(), root.u0.copy()
    q0[:3] += q
    u0[:3] += u
    joints = tuple(root.with_initial(q0, u0) if joint is root else joint for joint in system.joints)
    return replace(system, joints=joints)


def with_initial_state(case: Case, system: System) -> System:
    """The system in the initial state of its case's [initial].

    Raises CaseError when the file is of another craft or there can be no equilibrium, EquilibriumError when none is
    found.
    """
    if case.initial is None or case.initial.source is None:
        return system
    if case.initial.source not in COMPUTED:
        return started(system, _last_row(case, system))
    from femflex.linear.equilibrium import equilibrium
    from femflex.linear.settled import settled

    try:
        if case.initial.source == SETTLED:
            return settled(system)
        state = equilibrium(system, at=0.0)
    except ValueError as error:
        advice = SETTLE if system.orbit is not None and case.initial.source == EQUILIBRIUM else ""
        problems = [Problem("initial.from", line + advice) for line in str(error).splitlines()]
        raise CaseError(case.path.name, problems) from error
    at_rest = started(system, np.concatenate([state.q, system.initial_state()[len(state.q) :]]))
    return replace(at_rest, z0=system.z0)  # states of effectors start as their tables say, such as a wheel's speed


def _last_row(case: Case, system: System) -> Array:
    """The state (n_x,) in the last row of the file."""
    from femflex.results import open_run

    assert case.initial is not None and case.initial.source is not None
    try:
        with open_run(case.file_path(case.initial.source)) as run:
            names_by_path = {"q": system.coordinate_names(), "u": system.velocity_names(), "z": system.state_names()}
            names_by_path = {path: names for path, names in names_by_path.items() if names or path in run}
            for path, names in names_by_path.items():
                _check_names(case, run.names(path), tuple(name for name, _ in names))
            if not len(run):
                raise ValueError(f"{run.path} holds no instants")
            return np.concatenate([run[path][-1] for path in names_by_path])
    except (ValueError, KeyError, OSError) as error:
        if isinstance(error, CaseError):
            raise
        raise CaseError(case.path.name, [Problem("initial.from", str(error.args[0]))]) from error


def _check_names(case: Case, file_names: tuple[str, ...], craft_names: tuple[str, ...]) -> None:
    if file_names == craft_names:
        return
    assert case.initial is not None
    missing = [name for name in craft_names if name not in file_names] or ["the order"]
    extra = [name for name in file_names if name not in craft_names] or ["the order"]
    text = (
        f"found {case.initial.source!r}, which is of another craft: it has {len(file_names)} coordinates and this one "
        f"{len(craft_names)}; {extra[0]} is only there, {missing[0]} only here"
    )
    raise CaseError(case.path.name, [Problem("initial.from", text)])
