"""`femflex stability`: loci and charts of stability over values of a case."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from femflex.cli.options import (
    DIAGRAM_SUFFIXES,
    PAGE_SUFFIXES,
    PICTURE,
    REPORT,
    TABLE,
    CaseFile,
    Files,
    Force,
    Json,
    Theme,
    outputs,
    read_seconds,
    split_names,
)
from femflex.cli.progress import Bar
from femflex.cli.tables import (
    CellValue,
    print_folded,
    print_line,
    print_table,
    print_title,
    printed,
    record,
    section,
    write_csv,
)
from femflex.cli.verb import verb

if TYPE_CHECKING:
    from femflex.case import Case
    from femflex.studies.stability import Chart, Locus
    from femflex.studies.stability.of_case import CaseStability

ROWS = 24  # values of a locus printed as text


@verb('femflex stability cases/spinner.toml --vary "attitude.spin.2=0.1:1:31" -o locus.png')
def stability(
    case: CaseFile,
    vary: Annotated[
        list[str] | None, typer.Option(help="KEY=FIRST:LAST:NUMBER, such as joints.0.damping=0:4:41; once or twice.")
    ] = None,
    floquet: Annotated[
        bool, typer.Option("--floquet", help="Stability of the periodic motion, by its multipliers.")
    ] = False,
    period: Annotated[
        str | None, typer.Option(help="Period of the motion: seconds, or a text such as '2 min'.")
    ] = None,
    shooting: Annotated[
        bool, typer.Option("--shooting", help="Find the periodic motion near the initial state first.")
    ] = False,
    without: Annotated[
        list[str] | None,
        typer.Option(help="Terms that a second, dashed one omits, such as flexibility; may be repeated."),
    ] = None,
    output: Files = None,
    theme: Theme = "light",
    force: Force = False,
    as_json: Json = False,
) -> None:
    """Chart the stability of a craft over one or two values of its case.

    Over one value: poles of the equilibrium or multipliers of a periodic motion, and the values at which stability
    changes. Over two: regions and their traced boundaries. Values and settings are those of the case's \\[stability]
    where none are given.
    """
    files = outputs(output, {TABLE: (".csv",), PICTURE: DIAGRAM_SUFFIXES, REPORT: PAGE_SUFFIXES}, force, theme)
    from femflex.case import read_case
    from femflex.studies.stability import case_stability

    parsed_case = with_options(read_case(case), vary, floquet, period, shooting, without)
    with Bar("charting", 1.0, unit="of the points") as bar:
        case_result = case_stability(parsed_case, bar)
    if TABLE in files:
        write_csv(files[TABLE], *point_rows(case_result.result), force)
    if PICTURE in files:
        draw_stability(case_result, files[PICTURE], parsed_case.title or case.stem, theme, force)
    if REPORT in files:
        from femflex.report.studies import write_stability_report

        write_stability_report(case_result, parsed_case.title or case.stem, files[REPORT], force)
    with printed(as_json):
        print_title(parsed_case.title or case.name)
        print_result(case_result.result)
        if case_result.second is not None:
            print_folded("")
            with section("second"):
                print_title(f"without {', '.join(case_result.left_out)}")
                print_result(case_result.second)
        for kind, path in files.items():
            print_line(kind, path)


def with_options(
    case: Case, vary: list[str] | None, floquet: bool, period: str | None, shooting: bool, without: list[str] | None
) -> Case:
    """Return the case with the options of the command line in place of its [stability]."""
    from femflex.case.campbell import stability_table

    settings: dict[str, Any] = {} if case.stability is None else case.stability.model_dump(exclude_unset=True)
    if vary:
        settings["vary"] = dict(read_vary_option(text) for text in vary)
        if not {"k_roll", "k_yaw"} & set(settings["vary"]):
            settings.pop("inertia", None)
    if floquet or period is not None or shooting:
        settings["of"] = "motion"
    if period is not None:
        settings["period"] = read_seconds(period, "--period")
    if shooting:
        settings["shooting"] = True
    if without is not None:
        settings["without"] = split_names(without)
    if not settings:
        return case
    return case.model_copy(update={"stability": stability_table(settings, "the command line")})


def read_vary_option(text: str) -> tuple[str, dict[str, Any]]:
    """Key path and range of one --vary.

    >>> read_vary_option("joints.0.damping=0:4 N m s:41")
    ('joints.0.damping', {'between': ['0 N m s', '4 N m s'], 'points': 41})
    """
    from femflex.noun.units import split_quantity

    key, _, range_text = text.partition("=")
    fields = [field.strip() for field in range_text.split(":")]
    if not key.strip() or len(fields) != 3 or not fields[2].isdigit():
        raise ValueError(f"--vary: found {text!r}; give KEY=FIRST:LAST:NUMBER, such as joints.0.damping=0:4:41")
    pairs = [split_quantity(field) for field in fields[:2]]
    unit = pairs[1][1] or pairs[0][1]
    ends = [f"{number:.17g} {own_unit or unit}" if unit else number for number, own_unit in pairs]
    return key.strip(), {"between": ends, "points": int(fields[2])}


def print_result(result: Locus | Chart) -> None:
    """Print a locus as a table with the values at which stability changes, a chart as its regions."""
    from femflex.studies.stability import Locus

    heads, rows = point_rows(result)
    has_rows = record("points", [dict(zip(heads, row, strict=True)) for row in rows])
    if isinstance(result, Locus):
        print_locus(result, not has_rows)
    else:
        print_chart(result)


def print_locus(locus: Locus, with_table: bool) -> None:
    """Print growth and stability over the value, and where it changes."""
    from femflex.studies.stability import KINDS

    if with_table:
        kinds = [KINDS[int(kind)] for kind in locus.kinds]
        rows = list(zip(locus.values.tolist(), locus.growth, kinds, strict=True))
        print_table([f"{locus.name} {locus.unit}".strip(), "growth, 1/s", "stability"], rows[:: -(-len(rows) // ROWS)])
    names = list(dict.fromkeys(name for name in locus.names if name))
    if names:
        print_line("branches", f"{', '.join(names)}, named at the first value", list(locus.names))
    if locus.trivial:
        text = f"{len(locus.trivial)} multipliers are 1: {', '.join(locus.trivial)}"
        print_line("trivial", text, list(locus.trivial))
        print_line(
            "split",
            f"multipliers 1 are found within {locus.split:.2g}: rounding separates double eigenvalues",
            locus.split,
        )
    if locus.lost is not None:
        place = f"{locus.lost:.6g} {locus.unit}".rstrip()
        print_line("lost", f"no equilibrium at {place}; values beyond are not looked at", locus.lost)
    changes = ", ".join(f"{value:.8g}" for value in locus.critical)
    print_line("changes", f"{changes} {locus.unit}".rstrip() if changes else "nowhere", list(locus.critical))


def print_chart(chart: Chart) -> None:
    """Print the share of each region and the lines between them."""
    from femflex.studies.stability import KINDS

    shares = {text: float((chart.kinds == kind).mean()) for kind, text in KINDS.items()}
    rows = [[text, CellValue(share, f"{100 * share:.4g} %")] for text, share in shares.items()]
    print_table(["region", "of the points"], rows)
    for a, b, points in chart.boundaries:
        text = f"{KINDS[a]} | {KINDS[b]}: {len(points)} points"
        print_line("boundary", text, [{"between": [KINDS[a], KINDS[b]], "points": points}])
    if not chart.boundaries:
        print_line("boundary", "none", [])
    error = " and ".join(f"{size:.2g} {unit}".strip() for size, unit in zip(chart.error, chart.units, strict=True))
    print_line("traced", f"to within {error}", list(chart.error))


def point_rows(result: Locus | Chart) -> tuple[list[str], list[list[Any]]]:
    """Heads, and a row for every point of a locus or chart."""
    from femflex.studies.stability import Locus

    if isinstance(result, Locus):
        names = result.names or ("",) * result.branches.shape[1]
        labels = [f"{k + 1} {name}".strip() for k, name in enumerate(names)]
        heads = [result.name, "kind", "growth", *(f"{part}_{label}" for label in labels for part in ("real", "imag"))]
        columns = zip(result.values, result.kinds, result.growth, result.branches, strict=True)
        return heads, [
            [value, kind, growth, *(v for z in row for v in (z.real, z.imag))] for value, kind, growth, row in columns
        ]
    return [*result.names, "kind", "growth"], [
        [a, b, result.kinds[i, j], result.growth[i, j]]
        for i, a in enumerate(result.first_values)
        for j, b in enumerate(result.second_values)
    ]


def draw_stability(case_result: CaseStability, path: Path, title: str, theme: str, force: bool) -> None:
    """Draw the locus or chart; a chart over the inertia ratios has the regions of the rigid craft."""
    from femflex.studies.stability import Locus
    from femflex.studies.stability.inertia_ratios import known_curves
    from femflex.view.stability import plot_chart, plot_locus

    second: Any = case_result.second
    more: dict[str, Any] = {"theme": theme, "title": title, "force": force}
    more |= {"second": second, "left_out": case_result.left_out}
    if isinstance(case_result.result, Locus):
        plot_locus(case_result.result, path, **more)
    else:
        curves = known_curves(case_result.result.names) if case_result.ratios else ()
        plot_chart(case_result.result, path, reference_curves=curves, **more)
