"""Systems and bodies of cases with all that their tables leave open decided: strain, and shapes beside their modes."""

from __future__ import annotations

import warnings
from collections.abc import Iterable, Mapping
from dataclasses import replace

from femflex.advice.choice import choices, undecided, with_strains
from femflex.advice.joint_shapes import (
    RicherCraft,
    has_joint_shapes,
    open_joints,
    richer_craft,
    warn_of_truncation,
    with_joint_shapes,
    with_lacks,
)
from femflex.advice.motion_estimate import Carried, ahead, foreseen
from femflex.advice.near_buckling import is_judged, nearest, warn_of_buckling, with_doubts
from femflex.advice.snapping import responding
from femflex.advice.spun import spun_up, with_spin_shapes
from femflex.assembly.bodies import build_bodies, build_part
from femflex.assembly.shared import shared_structures
from femflex.assembly.system import bodies_and_loads
from femflex.body import FlexibleBody
from femflex.case.case import Case
from femflex.case.problems import CaseError, Problem
from femflex.pipeline.references import duration_of
from femflex.pipeline.start import system_of
from femflex.pipeline.stretching import stretching
from femflex.system import Part, Segments, System
from femflex.warning import PhysicsWarning, TruncationWarning


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
        return _said(case, bodies_and_loads(case, bodies)[0], False, warning)
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
    parts = bodies_and_loads(linear, None)[0]
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


def build_body(case: Case, name: str, modes: int | None = None) -> FlexibleBody:
    """The body of that name, in one piece, with the strain that it has in a run of the case.

    Raises CaseError with what is wrong with it.
    """
    return build_each(case, [name], modes)[name]


def build_each(case: Case, names: Iterable[str], modes: int | None = None) -> dict[str, FlexibleBody]:
    """The bodies of these names, each in one piece, with the strain that they have in a run of the case.

    What a body says of its strain is taken; for what it does not say the whole system is built, and looked at. Where
    that cannot be built the body is linear, and its note says so. Raises CaseError with what is wrong with a body.
    """
    with shared_structures():
        return _each(case, list(names), modes)


def _each(case: Case, names: list[str], modes: int | None) -> dict[str, FlexibleBody]:
    silent = {*undecided(case), *open_joints(case)} & set(names)
    decided, notes = _decided(case, warning=True) if silent else (case, {})
    found = {}
    for name in names:
        part = build_part(decided, name, modes)
        if isinstance(part, Segments):
            text = (
                f"found a body cut into {len(part.bodies)} segments, which has no one set of modes; leave out "
                "segments, in a copy of the case, to see the whole"
            )
            raise CaseError(case.path.name, [Problem(f"bodies.{name}", text)])
        found[name] = replace(part, note=notes[name]) if name in notes else part
    return found


def with_own_strain(case: Case) -> Case:
    """The case with the strain written out that each body without a word of it gets in its system.

    Where that cannot be built all is left as it is: what it lacks is told where it is needed.
    """
    return with_strain_notes(case)[0]


def with_strain_notes(case: Case) -> tuple[Case, dict[str, str]]:
    """The same, and why each of these bodies has that strain."""
    return _decided(case) if undecided(case) or open_joints(case) else (case, {})


def _decided(case: Case, warning: bool = False) -> tuple[Case, dict[str, str]]:
    """The case with strains and static shapes written out, and the notes on its bodies.

    warning: warn of sets that are too small for the craft's frequencies.
    """
    names = undecided(case)
    try:
        with warnings.catch_warnings(record=True) as given:
            warnings.simplefilter("ignore", PhysicsWarning)  # told where the bodies are built
            warnings.simplefilter("always", TruncationWarning)
            decided, system = decided_system(case, warning=False)
    except CaseError as error:
        first = error.problems[0]
        note = f"strain is linear: its system cannot be built to see what it calls for ({first.where}: {first.text})"
        return case, dict.fromkeys(names, note)
    for one in given:
        if warning and one.category is TruncationWarning:
            warnings.warn(str(one.message), TruncationWarning, stacklevel=4)
    forms = {name: system.bodies[name].strain_form for name in names}
    silent = {*names, *open_joints(case)}
    return with_strains(decided, forms), {name: system.bodies[name].note for name in silent}
