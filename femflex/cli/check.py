"""`femflex check`: everything wrong with a case, without running it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from femflex.cli.options import CaseFile, Force, Json, Verbose
from femflex.cli.progress import Patience
from femflex.cli.tables import print_line, print_reasons, printed, record
from femflex.cli.verb import BAD_INPUT, print_warnings, verb, warnings_so_far

if TYPE_CHECKING:
    from femflex.pipeline.decisions import ResolvedCase


@verb("femflex check cases/orbiter_beam.toml")
def check(
    case: CaseFile,
    as_json: Json = False,
    write_advice: Annotated[
        bool,
        typer.Option(
            "--write-advice",
            help="Write CASE_advised.toml: the case with the automatic choices for its bodies written as keys.",
        ),
    ] = False,
    force: Force = False,
    verbose: Verbose = False,
) -> None:
    """Report every problem of a case: keys, units, names, meshes, structure, modes. Writes no result."""
    from femflex.noun.problems import CaseError
    from femflex.noun.values import counted_noun

    try:
        resolved, description = examine_case(case)
        copy = advice_copy(case, resolved, force) if write_advice else None
    except CaseError as error:
        if not as_json:
            raise
        with printed(as_json):
            record("problems", [{"where": problem.where, "text": problem.text} for problem in error.problems])
        raise typer.Exit(BAD_INPUT) from None
    with printed(as_json):
        record("problems", [])
        if not record("warnings", warnings_so_far()):
            print_warnings()
        warned = len(warnings_so_far())
        verdict = f"no errors, {counted_noun(warned, 'warning', 'warnings')}" if warned else "no problems"
        if not record("verdict", f"{verdict}; {description}"):
            print(f"{case.name}: {verdict}; {description}")
        print_reasons(resolved, verbose)
        if copy is not None:
            print_line("advice", copy)


def advice_copy(case: Path, resolved: ResolvedCase, force: bool) -> Path:
    """Write the copy of a case with the advice in it, in the folder of the case; return its path."""
    from femflex.case import read_case
    from femflex.pipeline.advised_case import advised_text
    from femflex.writing import atomic_file

    copy = case.with_name(f"{case.stem}_advised.toml")
    with atomic_file(copy, force) as draft:
        draft.write_text(advised_text(read_case(case), resolved), encoding="utf-8")
    return copy


def examine_case(case: Path) -> tuple[ResolvedCase, str]:
    """Build the bodies of a case and make all choices; return them, and a description of them.

    Raises CaseError with the problems of the case.
    """
    with Patience("building the bodies"):
        from femflex.advice.advice import warn_of
        from femflex.advice.model_warnings import output_notes
        from femflex.case import read_case
        from femflex.noun.values import counted_noun
        from femflex.pipeline.decisions import refuse_rotation_without_inertia, resolve_choices
        from femflex.pipeline.references import duration_of
        from femflex.studies.linear.closed_loop import growing_loops

        parsed_case = read_case(case)
        resolved_case = resolve_choices(parsed_case, thorough=True)
        refuse_rotation_without_inertia(resolved_case)
        system = resolved_case.system
        times = parsed_case.run.times(duration_of(parsed_case, system))
        loops = growing_loops(system, float(times[-1]))
        warn_of((*resolved_case.advice, *loops))
        notes = output_notes(system, float(times[1] - times[0]))
        resolved_case = replace(resolved_case, advice=(*resolved_case.advice, *notes))
    elastic = sum(body.n_modes for body in system.bodies.values())
    mass = sum(body.moments.mass for body in system.bodies.values())
    bodies = counted_noun(len(system.bodies), "body", "bodies")
    text = f"{bodies}, {mass:.6g} kg, {len(system.velocity_names())} degrees of freedom, {elastic} of them elastic"
    return resolved_case, text
