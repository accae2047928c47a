"""Bodies of a case, one by one, with the strain that they get in its system."""

from __future__ import annotations

import warnings
from collections.abc import Iterable
from dataclasses import replace

from femflex.body import FlexibleBody
from femflex.case.builders.body import build_part
from femflex.case.builders.choice import undecided, with_strains
from femflex.case.builders.joint_shapes import open_joints
from femflex.case.builders.shared import shared_structures
from femflex.case.builders.system import decided_system
from femflex.case.case import Case
from femflex.case.problems import CaseError, Problem
from femflex.system import Segments
from femflex.warning import PhysicsWarning, TruncationWarning


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
