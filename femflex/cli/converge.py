"""`femflex converge`: how many modes, how fine a mesh, and a verdict."""

from __future__ import annotations

import warnings
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from femflex.cli.converge_report import StudyOutputs
from femflex.cli.keep_alive import keep_alive
from femflex.cli.progress import Bar, Patience
from femflex.cli.verb import print_error, verb

if TYPE_CHECKING:
    from femflex.case import Case
    from femflex.studies import Convergence, FunctionStudy, Point, StrainStudy, Study


@verb("femflex converge cases/orbiter_beam.toml --over modes --tolerance 1e-6 -o convergence.png")
def converge(
    case: Annotated[Path, typer.Argument(help="Case file (TOML) with a \\[study].", show_default=False)],
    over: Annotated[
        str,
        typer.Option(
            "--over",
            help="What is varied: modes, mesh, derivatives, segments, functions (type and number of admissible "
            "functions), strain (linear, condensed, nonlinear); or several in turn, modes,derivatives,strain, each "
            "with the levels that the ones before found sufficient.",
        ),
    ] = "modes",
    levels: Annotated[
        str | None,
        typer.Option(
            "--levels",
            help="Numbers of modes or segments (1,2,4), mesh refinements or derivative shapes (0,1,2). Default: those "
            "of the case.",
        ),
    ] = None,
    tolerance: Annotated[
        float | None, typer.Option("--tolerance", help="Largest relative error. Default: that of the case, or 1e-3.")
    ] = None,
    output: Annotated[
        Path | None, typer.Option("-o", "--output", help="Draw the study (.png, .svg), or write it as a page (.html).")
    ] = None,
    theme: Annotated[str, typer.Option("--theme", help="light or dark.")] = "light",
    force: Annotated[bool, typer.Option("--force", help="Overwrite an existing picture.")] = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print for programs.")] = False,
) -> None:
    """Vary modes, mesh, derivative shapes, segments, functions or strain, and judge the quantity of \\[study].

    Prints a table, the observed order, the extrapolated limit, and a verdict with a recommended number. Modes: the
    case runs with more and more modes. Mesh: every cell is divided in two along each edge, again and again. Functions:
    every type of admissible functions over their number, against the best value of all. Strain: the three forms against
    the one that holds furthest, with what each costs. Ctrl-C keeps what
    there is (exit code 130).
    """
    study_outputs = StudyOutputs(tolerance, as_json, output, theme, force)
    study_outputs.check()
    varied = list(dict.fromkeys(word.strip() for word in over.split(",") if word.strip()))
    numbers = checked_levels(levels, varied)
    with Patience("building the bodies"):
        from femflex.case import read_case
        from femflex.pipeline.case_bodies import with_strain_notes
        from femflex.studies import check_studies, with_recommended_level
        from femflex.warning import PhysicsWarning

        warnings.simplefilter("once", PhysicsWarning)  # not again at every level
        parsed_case = read_case(case)
        case_with_strain, notes = with_strain_notes(parsed_case)
        check_studies(case_with_strain, varied)
    findings: list[Convergence | StrainStudy | FunctionStudy] = []
    for word in varied or ["modes"]:
        study, names, stopped = run_study(parsed_case, word, numbers, tolerance)
        if study is not None:
            findings.append(study)
            study_outputs.print_finding(study)
        if stopped is not None:
            study_outputs.report(findings, notes, complete=False)
            if study is not None and study_outputs.picture is not None:
                print_error("no picture is drawn")
            raise stopped
        assert study is not None
        parsed_case = with_recommended_level(parsed_case, study, names)
    study_outputs.report(findings, notes, complete=True)


def checked_levels(levels: str | None, varied: list[str]) -> list[int] | None:
    """Return the numbers of --levels."""
    if levels is not None and (len(varied) > 1 or varied == ["strain"]):
        raise ValueError(
            "--levels goes with one study over modes, mesh, derivatives, segments or functions; found --over "
            f"{','.join(varied)}. Leave it out, or name the numbers in the case's [study]"
        )
    return None if levels is None else read_levels(levels)


def run_study(
    case: Case, over: str, levels: list[int] | None, tolerance: float | None
) -> tuple[Convergence | StrainStudy | FunctionStudy | None, tuple[str, ...], BaseException | None]:
    """Run one study; return its result, the bodies that it varied, and the error that broke it off, if any."""
    from femflex.studies import assess_convergence, function_kinds, plan_study, strain_forms

    if over == "strain":
        with Bar("comparing", 100.0, unit="%") as bar, keep_alive(bar) as report:
            compared = strain_forms(case, tolerance, lambda fraction: report(float(round(100.0 * fraction))))
        return compared, tuple(compared.own), None
    if over == "functions":
        with Bar("comparing", 100.0, unit="%") as bar, keep_alive(bar) as report:
            types = function_kinds(case, levels, tolerance, lambda fraction: report(float(round(100.0 * fraction))))
        return types, tuple(types.case_kinds), None
    study = plan_study(case, over, levels)  # type: ignore[arg-type]  # another word is refused there
    points, stopped = computed_points(study)
    valued = any(not point.problem for point in points)
    if stopped is not None and valued:
        print_error(f"broken off after {len(points)} of {len(study.level_set.levels)} levels")
    if not valued:
        return None, study.level_set.varied, stopped
    return assess_convergence(study, points, tolerance, stopped is None), study.level_set.varied, stopped


def computed_points(study: Study) -> tuple[list[Point], BaseException | None]:
    """Compute the points of a study; return them, and the error that broke it off, if there was one."""
    from femflex.integrate import IntegrationError
    from femflex.results.interrupts import finished_on_interrupt

    points: list[Point] = []
    with Bar("converging", 100.0, unit="%") as bar, keep_alive(bar) as report, ExitStack() as keeping:
        try:
            for point in study.points(lambda fraction: report(float(round(100.0 * fraction)))):
                if not points:
                    keeping.enter_context(finished_on_interrupt("a study"))
                points.append(point)
        except (KeyboardInterrupt, IntegrationError) as stop:
            return points, stop
    return points, None


def read_levels(text: str, option: str = "--levels") -> list[int]:
    """The whole numbers in a list such as "1,2,4".

    >>> read_levels("1, 2, 4")
    [1, 2, 4]
    """
    try:
        return [int(number) for number in text.replace(",", " ").split()]
    except ValueError:
        raise ValueError(f"{option} is {text!r}; give whole numbers with commas, such as 1,2,4,8") from None
