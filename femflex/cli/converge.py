"""`femflex converge`: how many modes, how fine a mesh, and a verdict."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from femflex.cli.options import DIAGRAM_SUFFIXES, PAGE_SUFFIXES, PICTURE, REPORT, Files, Force, Json, Theme, outputs
from femflex.cli.progress import Bar, Patience, keep_alive, until_interrupt
from femflex.cli.tables import print_line, print_table, print_title, printed, record, section
from femflex.cli.verb import print_error, verb

if TYPE_CHECKING:
    from femflex.case import Case
    from femflex.studies import Comparison, Convergence, Finding

LEVEL = (
    "modes per body; coordinates are those of all bodies, with the static shapes that femflex adds for the loads and "
    "joints. Fewer modes may need more static shapes."
)


@verb("femflex converge cases/orbiter_beam.toml --over modes --tolerance 1e-6 -o convergence.png")
def converge(
    case: Annotated[Path, typer.Argument(help="Case file (TOML) with a \\[study].", show_default=False)],
    over: Annotated[
        str,
        typer.Option(
            help="What is varied: modes, mesh, derivatives, segments, functions (type and number of admissible "
            "functions), strain (linear, condensed, nonlinear); or several in turn, modes,derivatives,strain, each "
            "with the levels that the ones before found sufficient."
        ),
    ] = "modes",
    levels: Annotated[
        str | None,
        typer.Option(
            help="Numbers of modes or segments (1,2,4), mesh refinements or derivative shapes (0,1,2). Default: those "
            "of the case."
        ),
    ] = None,
    tolerance: Annotated[
        float | None, typer.Option(help="Largest relative error. Default: that of the case, or 1e-3.")
    ] = None,
    output: Files = None,
    theme: Theme = "light",
    force: Force = False,
    as_json: Json = False,
) -> None:
    """Vary modes, mesh, derivative shapes, segments, functions or strain, and judge the quantity of \\[study].

    Prints a table, the observed order, the extrapolated limit, and a verdict with a recommended number. Modes: the
    case runs with more and more modes. Mesh: every cell is divided in two along each edge, again and again. Functions:
    every type of admissible functions over their number, against the best value of all. Strain: the three forms against
    the one that holds furthest, with what each costs. Ctrl-C keeps what
    there is (exit code 130).
    """
    if tolerance is not None and not 0.0 < tolerance < 1.0:
        raise ValueError(f"--tolerance is {tolerance:g}; give a relative error between 0 and 1, such as 1e-3")
    files = outputs(output, {PICTURE: DIAGRAM_SUFFIXES, REPORT: PAGE_SUFFIXES}, force, theme)
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
    findings: list[Finding] = []
    with printed(as_json):
        for word in varied or ["modes"]:
            study, names, stopped = run_study(parsed_case, word, numbers, tolerance)
            if study is not None:
                findings.append(study)
                with section(word):
                    print_finding(study)
            if stopped is not None:
                print_together(findings, notes)
                if study is not None and files:  # an interrupt does not wait for a picture
                    print_error("no picture is drawn")
                raise stopped
            assert study is not None
            parsed_case = with_recommended_level(parsed_case, study, names)
        print_together(findings, notes)
        for kind, path in files.items():
            draw_findings(findings, kind, path, theme, force)
            print_line(kind, path)


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
) -> tuple[Finding | None, tuple[str, ...], BaseException | None]:
    """Run one study; return its result, the bodies that it varied, and the error that broke it off, if any."""
    from femflex.integrate import IntegrationError
    from femflex.studies import assess_convergence, function_kinds, plan_study, strain_forms

    compares = over in ("strain", "functions")
    with Bar("comparing" if compares else "converging", 100.0, unit="%") as bar, keep_alive(bar) as report:

        def progress(fraction: float) -> None:
            report(float(round(100.0 * fraction)))

        if compares:
            compared = (
                strain_forms(case, tolerance, progress)
                if over == "strain"
                else function_kinds(case, levels, tolerance, progress)
            )
            return compared, tuple(compared.own), None
        study = plan_study(case, over, levels)  # type: ignore[arg-type]  # another word is refused there
        points, stopped = until_interrupt(study.points(progress), "a study", IntegrationError)
    if all(point.problem for point in points):
        return None, study.level_set.varied, stopped
    if stopped is not None:
        print_error(f"broken off after {len(points)} of {len(study.level_set.levels)} levels")
    return assess_convergence(study, points, tolerance, stopped is None), study.level_set.varied, stopped


def read_levels(text: str, option: str = "--levels") -> list[int]:
    """The whole numbers in a list such as "1,2,4".

    >>> read_levels("1, 2, 4")
    [1, 2, 4]
    """
    try:
        return [int(number) for number in text.replace(",", " ").split()]
    except ValueError:
        raise ValueError(f"{option} is {text!r}; give whole numbers with commas, such as 1,2,4,8") from None


def print_together(findings: list[Finding], notes: Mapping[str, str]) -> None:
    """Print the common result of several studies; the choices and the notes on bodies in JSON."""
    from femflex.studies import recommendation_text, recommended_level

    record("notes", dict(notes))
    record("choice", {finding.over: recommended_level(finding) for finding in findings})
    if len(findings) > 1:
        print_line("together", recommendation_text(findings))


def draw_findings(findings: list[Finding], kind: str, path: Path, theme: str, force: bool) -> None:
    """Draw studies side by side, or write them as a page."""
    from femflex.report.studies import write_convergence_report
    from femflex.studies import recommendation_text
    from femflex.view.convergence import plot_studies

    if kind == REPORT:
        write_convergence_report(findings, recommendation_text(findings), path, force)
    else:
        plot_studies(findings, path, recommendation_text(findings), theme=theme, force=force)


def print_finding(study: Finding) -> None:
    """Print the table of one study, and its verdict."""
    from femflex.studies import Comparison

    print_title(f"{study.title} [{study.unit}]" if study.unit not in ("", "1") else study.title)
    if isinstance(study, Comparison):
        print_options(study)
    else:
        print_levels(study)
    print_line("verdict", study.verdict)


def print_options(study: Comparison) -> None:
    """Print the values of forms of strain, or of types of functions over their number."""
    of_functions, rows = study.over == "functions", list[list[Any]]()
    for option in study.with_values:
        for point, difference in zip(option.points, study.differences(option), strict=True):
            mark = "<-" if study.choice == (option.name, point.level) else ""
            numbers: list[Any] = [point.level, point.count]
            if not of_functions:
                numbers = [point.count, point.count - point.derivatives, point.derivatives, point.followers]
            rows.append([
                option.name, *numbers, point.value, difference, *[option.seconds] * (not of_functions), mark
            ])  # fmt: skip
    heads = ["functions", "a field", "coordinates"]
    if not of_functions:
        heads = ["strain", "coordinates", "vibration", "derivatives", "dependent"]
    results = [("value", ".12g"), ("difference", ".2e"), *[("seconds", ".3g")] * (not of_functions)]
    print_table([*heads, *results, ""], rows, name="rows")


def print_levels(study: Convergence) -> None:
    """Print values, changes and errors over the levels."""
    counts = shape_counts(study)
    marks = ["<-" if level == study.recommended else "" for level in study.levels]
    columns = [study.levels, *counts.values(), study.values, study.changes, study.errors, marks]
    level = "refined" if study.over == "mesh" else study.over
    heads = [level, *counts, ("value", ".12g"), ("change", ".3e"), ("error", ".2e"), ""]
    print_table(heads, zip(*columns, strict=True), name="rows")
    if study.over == "modes" and study.added.any():
        print_line("level", LEVEL)
    for text in study.left_out:
        print_line("left out", text)


def shape_counts(study: Convergence) -> dict[str, Any]:
    """Return the columns that count coordinates, and among them static, vibration and derivative shapes, by head."""
    if study.over == "mesh":
        return {"dofs": study.counts}
    followed = study.over == "derivatives" and study.followers.any()
    columns: dict[str, Any] = {"shapes" if followed else "coordinates": study.counts}
    if study.over == "modes" and study.added.any():
        columns["static shapes"] = study.added
    if study.derivatives.any() or study.followers.any():
        columns["vibration"] = study.counts - study.derivatives - (study.followers if followed else 0)
        columns["derivatives"] = study.derivatives
    return columns | ({"dependent": study.followers} if study.followers.any() else {})
