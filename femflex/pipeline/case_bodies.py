"""Single bodies of cases, with the strain and the static shapes that they have in a run."""

from __future__ import annotations

import warnings
from collections.abc import Iterable

from femflex.advice.advice import Advice, notes_of, warn_of
from femflex.advice.bodies import BodyOrigins
from femflex.advice.curved import shape_notes
from femflex.assembly.bodies import BuiltBody, built_body
from femflex.assembly.open_choices import open_joints, open_strains, with_strains
from femflex.assembly.shared import shared_structures
from femflex.body import FlexibleBody
from femflex.case.case import Case
from femflex.noun.problems import CaseError, Problem
from femflex.pipeline.decisions import resolve_choices
from femflex.system import Segments
from femflex.warning import PhysicsWarning, TruncationWarning


def build_body(case: Case, name: str, modes: int | None = None) -> FlexibleBody:
    """The body of that name, in one piece, with the strain that it has in a run of the case.

    Raises CaseError with the errors of the body.
    """
    return build_each(case, [name], modes)[name]


def build_each(case: Case, names: Iterable[str], modes: int | None = None) -> dict[str, FlexibleBody]:
    """The bodies of these names, as from `advised_bodies`."""
    return advised_bodies(case, names, modes)[0]


def advised_bodies(
    case: Case, names: Iterable[str], modes: int | None = None
) -> tuple[dict[str, FlexibleBody], dict[str, str]]:
    """The bodies of these names, each in one piece, with the strain that they have in a run of the case; and notes.

    A requested strain is used. Where a body leaves it open, it is selected from the motion of the whole system; if that
    cannot be built, the strain is linear, and the note says so. Raises CaseError with the errors of a body.
    """
    with shared_structures():
        names = list(names)
        open_names = {*open_strains(case), *open_joints(case)} & set(names)
        written_case, notes = _strain_notes(case, warning=True) if open_names else (case, {})
        bodies = {}
        for name in names:
            built = built_body(written_case, name, modes)
            if isinstance(built.part, Segments):
                text = (
                    f"found a body cut into {len(built.part.bodies)} segments, which has no one set of modes; leave "
                    "out segments, in a copy of the case, to see the whole"
                )
                raise CaseError(case.path.name, [Problem(f"bodies.{name}", text)])
            bodies[name] = built.part
            if name not in notes and (note := _own_notes(name, built)):
                notes[name] = note
        return bodies, {name: notes[name] for name in names if notes.get(name)}


def _own_notes(name: str, built: BuiltBody) -> str:
    """Note on a body that depends on no other body; empty for segments and bodies without origin."""
    if built.origin is None or not isinstance(built.part, FlexibleBody):
        return ""
    advice = [Advice(name, subject, None, text) for subject, text in built.notes]
    shape_advice = shape_notes({name: built.part}, BodyOrigins({name: built.origin}))
    return notes_of([*advice, *shape_advice]).get(name, "")


def with_own_strain(case: Case) -> Case:
    """The case with the strain that each body of open strain gets in its system.

    Returns the case itself where the system cannot be built; the errors are reported where the system is needed.
    """
    return with_strain_notes(case)[0]


def with_strain_notes(case: Case) -> tuple[Case, dict[str, str]]:
    """The same as `with_own_strain`, and a note with the reason for each of these bodies."""
    return _strain_notes(case) if open_strains(case) or open_joints(case) else (case, {})


def _strain_notes(case: Case, warning: bool = False) -> tuple[Case, dict[str, str]]:
    """The case with strains and static shapes filled in, and the notes on its bodies.

    warning: warn of sets that are too small for the craft's frequencies.
    """
    names = open_strains(case)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", PhysicsWarning)  # reported where the bodies are built
            resolved = resolve_choices(case, loaded=False)
    except CaseError as error:
        first = error.problems[0]
        note = f"strain is linear: no load estimate, because the case has errors ({first.where}: {first.text})"
        return case, dict.fromkeys(names, note)
    if warning:
        warn_of((entry for entry in resolved.advice if entry.category is TruncationWarning), stacklevel=4)
    forms = {name: resolved.system.bodies[name].strain_form for name in names}
    notes = resolved.notes
    open_names = {*names, *open_joints(case)}
    return with_strains(resolved.case, forms), {name: notes.get(name, "") for name in open_names}
