"""Where the craft of a case starts: its centre of mass at O, in equilibrium, or where another run ended."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np

from femflex.arrays import Array
from femflex.assembly import system as assembly
from femflex.case.case import Case
from femflex.case.initial import EQUILIBRIUM
from femflex.case.motion import Motion
from femflex.case.problems import CaseError, Problem
from femflex.dynamics import compile_system
from femflex.pipeline.compiled import compiled
from femflex.pipeline.recovered import recovered
from femflex.pipeline.references import channel_problems, motion_problems, size_problems
from femflex.rotations import dcm_from_quaternion
from femflex.system import Part, Sensor, System, started, with_heavy_cable


def system_of(case: Case, bodies: Mapping[str, Part] | None = None) -> System:
    """The System of a case with these bodies, or its own with linear strain where they do not say, where it starts.

    Raises CaseError with what does not fit together.
    """
    system = with_heavy_cables(case, assembly.system_of(case, bodies))
    _check_references(case, system)
    given = case.attitude.position is not None, case.attitude.velocity is not None
    loose = {*case.bodies} - {joint.child for joint in case.joints}  # one of them at most, held as [attitude] says
    if system.orbit is not None and system.orbit.free and loose and not all(given):
        system = centred(system, *given)
    return placed(case, system)


def with_heavy_cables(case: Case, system: System) -> System:
    """The system with the cables that have mass, straight between their ends and at the rates between theirs.

    Raises CaseError for a cable that cannot be.
    """
    given = {name: table for name, table in case.cables.items() if table.mass_per_length is not None}
    if not given:
        return system
    ends = {
        (name, kind): Sensor(
            f"{name}_span_{kind}", kind, table.body, table.marker, (table.parent, table.parent_marker)
        ).effectors
        for name, table in given.items()
        for kind in ("displacement", "velocity")
    }
    model = compile_system(replace(system, effectors=(*system.effectors, *(e for own in ends.values() for e in own))))
    seen = model.observe(np.zeros(1), model.x0[None])
    problems = []
    for name, table in given.items():
        span, rate = (
            np.array([seen[f"effectors/{name}_span_{kind}/{axis}"][0] for axis in "xyz"])
            for kind in ("displacement", "velocity")
        )
        share = (np.arange(table.masses)[:, None] + 0.5) / table.masses
        assert table.mass_per_length is not None
        try:
            length = constant_length(case, table.length)
            between = ((table.parent, table.parent_marker), (table.body, table.marker))
            system = with_heavy_cable(
                system,
                name,
                between,
                length,
                table.EA,
                table.mass_per_length,
                table.masses,
                share * span,
                rates=share * rate,
                damping=table.damping,
            )
        except ValueError as error:
            problems.append(Problem(f"cables.{name}", str(error.args[0])))
    if problems:
        raise CaseError(case.path.name, problems)
    return system


def constant_length(case: Case, length: Motion) -> float:
    """The length of a cable with mass [m]. Raises ValueError for one that changes."""
    if length.profile is None or length.table is not None:
        raise ValueError(
            "found a length that changes and mass_per_length; give a constant length, leave the mass out, or use a "
            "deploying member (family = 'tether')"
        )
    return float(length.profile(case.path.parent)(0.0)[0])


def _check_references(case: Case, system: System) -> None:
    try:
        channels = compiled(system).channels
    except ValueError as error:  # a loop that cannot close
        raise CaseError(case.path.name, [Problem("", str(error.args[0]))]) from error
    channels = channels | recovered(case, system).channels
    problems = [*channel_problems(case, channels), *motion_problems(case, system)]
    problems += size_problems(case, system, channels, Path.cwd())
    if problems:
        raise CaseError(case.path.name, problems)


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


def placed(case: Case, system: System) -> System:
    """The system where its case's [initial] starts it.

    Raises CaseError when the file is of another craft or there can be no equilibrium, EquilibriumError when none is
    found.
    """
    if case.initial is None or case.initial.source is None:
        return system
    if case.initial.source != EQUILIBRIUM:
        return started(system, _last_row(case, system))
    from femflex.dynamics.equilibria.equilibrium import equilibrium

    try:
        found = equilibrium(system, at=0.0)
    except ValueError as error:
        problems = [Problem("initial.from", line) for line in str(error).splitlines()]
        raise CaseError(case.path.name, problems) from error
    at_rest = started(system, np.concatenate([found.q, system.initial_state()[len(found.q) :]]))
    return replace(at_rest, z0=system.z0)  # states of effectors start as their tables say, such as a wheel's speed


def _last_row(case: Case, system: System) -> Array:
    """The state (n_x,) in the last row of the file."""
    from femflex.results import open_run

    assert case.initial is not None and case.initial.source is not None
    try:
        with open_run(case.file_path(case.initial.source)) as run:
            wanted = {"q": system.coordinate_names(), "u": system.velocity_names(), "z": system.state_names()}
            wanted = {path: names for path, names in wanted.items() if names or path in run}
            for path, names in wanted.items():
                _check_names(case, run.names(path), tuple(name for name, _ in names))
            if not len(run):
                raise ValueError(f"{run.path} holds no instants")
            return np.concatenate([run[path][-1] for path in wanted])
    except (ValueError, KeyError, OSError) as error:
        if isinstance(error, CaseError):
            raise
        raise CaseError(case.path.name, [Problem("initial.from", str(error.args[0]))]) from error


def _check_names(case: Case, found: tuple[str, ...], wanted: tuple[str, ...]) -> None:
    if found == wanted:
        return
    assert case.initial is not None
    missing = [name for name in wanted if name not in found] or ["the order"]
    other = [name for name in found if name not in wanted] or ["the order"]
    text = (
        f"found {case.initial.source!r}, which is of another craft: it has {len(found)} coordinates and this one "
        f"{len(wanted)}; {other[0]} is only there, {missing[0]} only here"
    )
    raise CaseError(case.path.name, [Problem("initial.from", text)])
