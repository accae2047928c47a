"""`femflex stability`: loci and charts of stability over values of a case."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from femflex.cli.names import listed_names
from femflex.cli.outputs import DIAGRAM_SUFFIXES, PICTURE, TABLE, outputs
from femflex.cli.progress import Bar
from femflex.cli.tables import print_json, print_table
from femflex.cli.times import read_seconds
from femflex.cli.verb import verb

if TYPE_CHECKING:
    from femflex.case import Case
    from femflex.studies.stability import Chart, Locus
    from femflex.studies.stability.of_case import CaseStability

ROWS = 24  # values printed of a locus; the table and --json have all


@verb('femflex stability cases/spinner.toml --vary "attitude.spin.2=0.1:1:31" -o locus.png')
def stability(
    case: Annotated[Path, typer.Argument(help="Case file (TOML).", show_default=False)],
    vary: Annotated[
        list[str] | None,
        typer.Option("--vary", help="KEY=FIRST:LAST:NUMBER, such as joints.0.damping=0:4:41; once or twice."),
    ] = None,
    floquet: Annotated[
        bool, typer.Option("--floquet", help="Stability of the periodic motion, by its multipliers.")
    ] = False,
    period: Annotated[
        str | None, typer.Option("--period", help="Period of the motion: seconds, or a text such as '2 min'.")
    ] = None,
    shooting: Annotated[
        bool, typer.Option("--shooting", help="Find the periodic motion near the initial state first.")
    ] = False,
    without: Annotated[
        list[str] | None,
        typer.Option("--without", help="Terms that a second, dashed one omits, such as flexibility; may be repeated."),
    ] = None,
    output: Annotated[
        list[Path] | None,
        typer.Option("-o", "--output", help="Table of all points (.csv) or picture (.png, .svg); may be repeated."),
    ] = None,
    theme: Annotated[str, typer.Option("--theme", help="light or dark.")] = "light",
    force: Annotated[bool, typer.Option("--force", help="Overwrite existing files.")] = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print for programs.")] = False,
) -> None:
    """Chart the stability of a craft over one or two values of its case.

    Over one value: poles of the equilibrium or multipliers of a periodic motion, and the values at which stability
    changes. Over two: regions and their traced boundaries. Values and settings are those of the case's \\[stability]
    where none are given.
    """
    from femflex.view.theme import theme_of
    from femflex.writing import check_destination

    files = outputs(output or (), {TABLE: (".csv",), PICTURE: DIAGRAM_SUFFIXES})
    theme_of(theme)
    for path in files.values():
        check_destination(path, force)
    from femflex.case import read_case
    from femflex.studies.stability import case_stability

    read = with_options(read_case(case), vary, floquet, period, shooting, without)
    with Bar("charting", 1.0, unit="of the points") as bar:
        found = case_stability(read, bar)
    if TABLE in files:
        write_table(found.found, files[TABLE], force)
    if PICTURE in files:
        draw(found, files[PICTURE], read.title or case.stem, theme, force)
    if as_json:
        print_json(stability_data(found))
        return
    print(read.title or case.name)
    print_stability_of(found)
    for kind, path in files.items():
        print(f"{kind:11} {path}")


def with_options(
    case: Case, vary: list[str] | None, floquet: bool, period: str | None, shooting: bool, without: list[str] | None
) -> Case:
    """The case with what the command line says in place of its [stability]."""
    from femflex.case.stability import stability_table

    given: dict[str, Any] = {} if case.stability is None else case.stability.model_dump(exclude_unset=True)
    if vary:
        given["vary"] = dict(one_axis(text) for text in vary)
        if not {"k_roll", "k_yaw"} & set(given["vary"]):
            given.pop("inertia", None)
    if floquet or period is not None or shooting:
        given["of"] = "motion"
    if period is not None:
        given["period"] = read_seconds(period, "--period")
    if shooting:
        given["shooting"] = True
    if without is not None:
        given["without"] = listed_names(without)
    if not given:
        return case
    return case.model_copy(update={"stability": stability_table(given, "the command line")})


def one_axis(text: str) -> tuple[str, dict[str, Any]]:
    """Key path and range of one --vary.

    >>> one_axis("joints.0.damping=0:4 N m s:41")
    ('joints.0.damping', {'between': ['0 N m s', '4 N m s'], 'points': 41})
    """
    from femflex.case.units import split_quantity

    key, _, rest = text.partition("=")
    parts = [part.strip() for part in rest.split(":")]
    if not key.strip() or len(parts) != 3 or not parts[2].isdigit():
        raise ValueError(f"--vary: found {text!r}; give KEY=FIRST:LAST:NUMBER, such as joints.0.damping=0:4:41")
    pairs = [split_quantity(part) for part in parts[:2]]
    unit = pairs[1][1] or pairs[0][1]
    ends = [f"{number:.17g} {own or unit}" if unit else number for number, own in pairs]
    return key.strip(), {"between": ends, "points": int(parts[2])}


def print_stability_of(found: CaseStability) -> None:
    """Print a locus as a table with the values at which stability changes, a chart as its regions."""
    from femflex.studies.stability.locus import Locus

    for one, left_out in ((found.found, ()), (found.second, found.left_out)):
        if one is None:
            continue
        if left_out:
            print(f"\nwithout {', '.join(left_out)}")
        if isinstance(one, Locus):
            print_locus(one)
        else:
            print_chart(one)


def print_locus(locus: Locus) -> None:
    """Print growth and stability over the value."""
    from femflex.studies.stability import KINDS

    every = max(1, -(-len(locus.values) // ROWS))
    rows = [
        [f"{locus.values[k]:.6g}", f"{locus.growth[k]:.6g}", KINDS[int(locus.kinds[k])]]
        for k in range(0, len(locus.values), every)
    ]
    print_table([f"{locus.name} {locus.unit}".strip(), "growth, 1/s", "stability"], rows)
    names = list(dict.fromkeys(name for name in locus.names if name))
    if names:
        print(f"branches    {', '.join(names)}, named at the first value")
    if locus.trivial:
        count = len(locus.trivial)
        print(f"trivial     {count} multipliers are 1: {', '.join(locus.trivial)}")
        print(f"split       multipliers 1 are found within {locus.split:.2g}: rounding separates double eigenvalues")
    if locus.lost is not None:
        print(
            f"lost        no equilibrium at {locus.lost:.6g} {locus.unit}".rstrip()
            + "; values beyond are not looked at"
        )
    changes = ", ".join(f"{value:.8g}" for value in locus.critical)
    print(f"changes     {changes} {locus.unit}".rstrip() if changes else "changes     nowhere")


def print_chart(chart: Chart) -> None:
    """Print the share of each region and the lines between them."""
    from femflex.studies.stability import KINDS

    total = chart.kinds.size
    rows = [[text, f"{100 * float((chart.kinds == kind).sum()) / total:.4g} %"] for kind, text in KINDS.items()]
    print_table(["region", "of the points"], rows)
    lines = [f"{KINDS[a]} | {KINDS[b]}: {len(points)} points" for a, b, points in chart.boundaries]
    for line in lines or ["none"]:
        print(f"boundary    {line}")
    error = " and ".join(f"{size:.2g} {unit}".strip() for size, unit in zip(chart.error, chart.units, strict=True))
    print(f"traced      to within {error}")


def stability_data(found: CaseStability) -> dict[str, Any]:
    """What --json prints."""
    return {
        "found": _plain(found.found),
        "without": list(found.left_out),
        "second": None if found.second is None else _plain(found.second),
    }


def _plain(one: Locus | Chart) -> dict[str, Any]:
    from femflex.studies.stability import KINDS
    from femflex.studies.stability.locus import Locus

    kinds = {
        "kinds": one.kinds.tolist(),
        "growth": one.growth.tolist(),
        "meaning": {str(k): v for k, v in KINDS.items()},
    }
    if isinstance(one, Locus):
        parts = [[[float(z.real), float(z.imag)] for z in row] for row in one.branches]
        return {"of": one.of, "name": one.name, "unit": one.unit, "values": one.values.tolist(), "branches": parts,
                "names": list(one.names),
                "trivial": list(one.trivial), "split": one.split,
                "critical": list(one.critical), "lost": one.lost, **kinds}  # fmt: skip
    lines = [{"between": [KINDS[a], KINDS[b]], "points": points.tolist()} for a, b, points in one.boundaries]
    return {"names": list(one.names), "units": list(one.units), "first": one.first.tolist(),
            "second": one.second.tolist(), "boundaries": lines, "error": list(one.error), **kinds}  # fmt: skip


def write_table(one: Locus | Chart, path: Path, force: bool) -> None:
    """Write every point as a row of a CSV file."""
    from femflex.studies.stability.locus import Locus
    from femflex.writing import placed

    if isinstance(one, Locus):
        n = one.branches.shape[1]
        own = [f"{k + 1} {name}".strip() for k, name in enumerate(one.names or ("",) * n)]
        head = [one.name, "kind", "growth", *(f"{part}_{label}" for label in own for part in ("real", "imag"))]
        rows = [
            [value, int(one.kinds[i]), one.growth[i], *(v for z in one.branches[i] for v in (z.real, z.imag))]
            for i, value in enumerate(one.values)
        ]
    else:
        head = [*one.names, "kind", "growth"]
        rows = [
            [a, b, int(one.kinds[i, j]), one.growth[i, j]]
            for i, a in enumerate(one.first)
            for j, b in enumerate(one.second)
        ]
    with placed(path, force) as part:
        lines = [",".join(head), *(",".join(f"{v:.12g}" for v in row) for row in rows)]
        part.write_text("\n".join(lines) + "\n", encoding="utf-8")


def draw(found: CaseStability, path: Path, title: str, theme: str, force: bool) -> None:
    """Draw the locus or chart, with the regions of the rigid craft where it is over the inertia ratios."""
    from femflex.studies.stability.gravity_gradient import known_curves
    from femflex.studies.stability.locus import Locus
    from femflex.view.stability import plot_chart, plot_locus

    if isinstance(found.found, Locus):
        second = found.second if isinstance(found.second, Locus) else None
        plot_locus(found.found, path, theme, title, force=force, second=second, left_out=found.left_out)
        return
    chart = found.second if not isinstance(found.second, Locus) else None
    known = known_curves(found.found.names) if found.ratios else ()
    plot_chart(found.found, path, theme, title, force=force, second=chart, left_out=found.left_out, known=known)
