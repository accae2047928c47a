"""Bodies of cases one by one, with the strain and the static shapes that they have in a run."""

from __future__ import annotations

import warnings
from collections.abc import Iterable

from femflex.advice.advice import Advice, notes_of, warn_of
from femflex.advice.bodies import KnownBodies
from femflex.advice.curved import shape_notes
from femflex.assembly.bodies import BuiltBody, built_body
from femflex.assembly.open_choices import open_joints, open_strains, with_strains
from femflex.assembly.shared import shared_structures
from femflex.body import FlexibleBody
from femflex.case.case import Case
from femflex.case.problems import CaseError, Problem
from femflex.pipeline.decisions import decided
from femflex.system import Segments
from femflex.warning import PhysicsWarning, TruncationWarning


def build_body(case: Case, name: str, modes: int | None = None) -> FlexibleBody:
    """The body of that name, in one piece, with the strain that it has in a run of the case.

    Raises CaseError with what is wrong with it.
    """
    return build_each(case, [name], modes)[name]


def build_each(case: Case, names: Iterable[str], modes: int | None = None) -> dict[str, FlexibleBody]:
    """The bodies of these names, as `advised_bodies`."""
    return advised_bodies(case, names, modes)[0]


def advised_bodies(
    case: Case, names: Iterable[str], modes: int | None = None
) -> tuple[dict[str, FlexibleBody], dict[str, str]]:
    """The bodies of these names, each in one piece, with the strain that they have in a run of the case; and notes.

    What a body says of its strain is taken; for what it does not say the whole system is built, and looked at. Where
    that cannot be built the body is linear, and its note says so. Raises CaseError with what is wrong with a body.
    """
    with shared_structures():
        names = list(names)
        silent = {*open_strains(case), *open_joints(case)} & set(names)
        silent_case, notes = _strain_notes(case, warning=True) if silent else (case, {})
        found = {}
        for name in names:
            built = built_body(silent_case, name, modes)
            if isinstance(built.part, Segments):
                text = (
                    f"found a body cut into {len(built.part.bodies)} segments, which has no one set of modes; leave "
                    "out segments, in a copy of the case, to see the whole"
                )
                raise CaseError(case.path.name, [Problem(f"bodies.{name}", text)])
            found[name] = built.part
            if name not in notes and (own := _own_notes(name, built)):
                notes[name] = own
        return found, {name: notes[name] for name in names if notes.get(name)}


def _own_notes(name: str, built: BuiltBody) -> str:
    """Note on a body alone."""
    if built.origin is None or not isinstance(built.part, FlexibleBody):
        return ""
    advice = [Advice(name, "shapes", None, text) for text in built.notes]
    more = shape_notes({name: built.part}, KnownBodies({name: built.origin}))
    return notes_of([*advice, *more]).get(name, "")


def with_own_strain(case: Case) -> Case:
    """The case with the strain written out that each body without a word of it gets in its system.

    Where that cannot be built all is left as it is: what it lacks is reported where it is needed.
    """
    return with_strain_notes(case)[0]


def with_strain_notes(case: Case) -> tuple[Case, dict[str, str]]:
    """The same, and why each of these bodies has that strain."""
    return _strain_notes(case) if open_strains(case) or open_joints(case) else (case, {})


def _strain_notes(case: Case, warning: bool = False) -> tuple[Case, dict[str, str]]:
    """The case with strains and static shapes written out, and the notes on its bodies.

    warning: warn of sets that are too small for the craft's frequencies.
    """
    names = open_strains(case)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", PhysicsWarning)  # reported where the bodies are built
            found = decided(case, loaded=False)
    except CaseError as error:
        first = error.problems[0]
        note = f"strain is linear: no load estimate, because the case has errors ({first.where}: {first.text})"
        return case, dict.fromkeys(names, note)
    if warning:
        warn_of((one for one in found.advice if one.category is TruncationWarning), stacklevel=4)
    forms = {name: found.system.bodies[name].strain_form for name in names}
    notes = found.notes
    silent = {*names, *open_joints(case)}
    return with_strains(found.case, forms), {name: notes.get(name, "") for name in silent}
