"""`femflex campbell`: frequencies over the speed of a steady spin, as a table, a file and a diagram."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from femflex.cli.options import (
    DIAGRAM_SUFFIXES,
    PAGE_SUFFIXES,
    PICTURE,
    REPORT,
    TABLE,
    At,
    CaseFile,
    Files,
    Force,
    Json,
    Theme,
    Verbose,
    outputs,
    read_seconds,
)
from femflex.cli.progress import Bar, Patience, until_interrupt
from femflex.cli.tables import (
    print_folded,
    print_line,
    print_reasons,
    print_table,
    print_title,
    printed,
    record,
    write_csv,
)
from femflex.cli.verb import print_error, verb

if TYPE_CHECKING:
    from femflex.case import Case
    from femflex.pipeline.decisions import ResolvedCase
    from femflex.studies.campbell import Campbell

PRINTED = 1e-6  # damping ratio below which none is printed


@verb('femflex campbell cases/helicopter_blade.toml --speeds "0:400 rpm:41" -o campbell.png -o campbell.csv')
def campbell(
    case: CaseFile,
    speeds: Annotated[
        str | None,
        typer.Option(
            help="Speeds: first, last and number, such as 0:400 rpm:17, or a list. Default: those of the case."
        ),
    ] = None,
    modes: Annotated[int | None, typer.Option(min=1, help="Lowest branches followed.")] = None,
    orders: Annotated[
        str | None, typer.Option(help="Multiples of the speed whose crossings are listed: 1,2,3.")
    ] = None,
    vary: Annotated[
        str | None,
        typer.Option(help="KEY=FIRST:LAST:NUMBER of another value than the speed: joints.0.stiffness=1:9:17."),
    ] = None,
    at: At = None,
    output: Files = None,
    theme: Theme = "light",
    force: Force = False,
    verbose: Verbose = False,
    as_json: Json = False,
) -> None:
    """Frequencies, damping and stability of a craft over its speed of spin, or another value: the Campbell diagram.

    At every speed the equilibrium is sought from the one before and the equations linearised about it; branches are
    followed by the likeness of their shapes, with speeds in between where shapes change fast. Frequencies are those
    seen in the spinning frame. Ctrl-C keeps what there is (exit code 130); so does a speed without equilibrium (3).
    With --vary, or where the case has a \\[stability] of one value and no \\[campbell], frequencies of its equilibrium
    are followed over that value.
    """
    kinds = {TABLE: (".csv",), PICTURE: DIAGRAM_SUFFIXES, REPORT: PAGE_SUFFIXES}
    report = DiagramReport(outputs(output, kinds, force, theme), theme, force)
    time = read_seconds(at, "--at")
    with Patience("reading the case"):
        from femflex.case import read_case

        parsed_case = read_case(case)
        if (axis_range := value_range(parsed_case, vary, speeds)) is not None:
            if orders is not None or at is not None:
                raise ValueError(
                    f"found {'--orders' if orders else '--at'}, which goes with speeds and not with {axis_range[0]}"
                )
            with printed(as_json):
                return print_value_diagram(parsed_case, axis_range, modes, report)
        parsed_case = with_options(parsed_case, speeds, modes, orders)
        from femflex.pipeline.case_equilibrium import resolve_at_rest
        from femflex.studies.campbell import axis_of

        axis_of(parsed_case)  # reported before the bodies are built
        resolved = resolve_at_rest(parsed_case)
    with printed(as_json):
        print_reasons(resolved, verbose)
        diagram, stopped = computed_diagram(parsed_case, time, resolved)
        if diagram is not None:
            report.print_of_case(parsed_case, diagram)
    if stopped is not None:
        raise stopped


KeyRange = tuple[str, dict[str, Any]]


def value_range(case: Case, vary: str | None, speeds: str | None) -> KeyRange | None:
    """Key path and range that a diagram is over; None for that over the speed."""
    from femflex.cli.stability import read_vary_option

    if vary is not None:
        if speeds is not None:
            raise ValueError("found --vary and --speeds; a diagram is over one of them")
        return read_vary_option(vary)
    table = case.stability
    if speeds is not None or case.campbell is not None or table is None or len(table.vary) != 1:
        return None
    key, axis = next(iter(table.vary.items()))
    return key, {"between": axis.between, "points": axis.points}


def print_value_diagram(case: Case, axis_range: KeyRange, modes: int | None, report: DiagramReport) -> None:
    """Print and write the diagram over a value of the case, or its computed part if it is broken off."""
    import numpy as np

    from femflex.case.campbell import stability_table
    from femflex.linear.equilibrium import EquilibriumError
    from femflex.studies.campbell import MODES, assembled_diagram, value_steps

    key, axis = axis_range
    table = stability_table({"vary": {key: axis}}, "--vary").vary[key]
    first, last, unit = table.numbers()
    values = np.linspace(first, last, table.points).tolist()
    with Bar("varying", last - first, unit=unit or "1") as bar:
        followed = value_steps(case, key, values, unit, modes or MODES, lambda value: bar(value - first))
        steps, stopped = until_interrupt(followed, "a diagram", EquilibriumError)
    if steps:
        diagram = assembled_diagram(steps, modes or MODES, (), case.title, stopped is None, key, unit)
        report.print(diagram, 1.0, unit)
    if stopped is not None:
        raise stopped


def with_options(case: Case, speeds: str | None, modes: int | None, orders: str | None) -> Case:
    """Return the case with the options of the command line instead of its [campbell]."""
    from femflex.case.campbell import CampbellTable, SpeedsValue
    from femflex.cli.converge import read_levels

    settings = {} if case.campbell is None else dict(case.campbell)
    if speeds is not None:
        try:
            settings["speeds"] = SpeedsValue().read_value(speeds)
        except ValueError as error:
            raise ValueError(f"--speeds: {error}") from None
    if modes is not None:
        settings["modes"] = modes
    if orders is not None:
        settings["orders"] = read_levels(orders, "--orders")
        if not settings["orders"] or min(settings["orders"]) < 1:
            raise ValueError(f"--orders is {orders!r}; give whole numbers from 1 on, such as 1,2,3,4")
    table = CampbellTable.model_validate(settings) if "speeds" in settings else case.campbell
    return case.model_copy(update={"campbell": table})


def computed_diagram(
    case: Case, at: float | None = None, resolved: ResolvedCase | None = None
) -> tuple[Campbell | None, BaseException | None]:
    """Compute the diagram of a case, or of its choices made already.

    Returns it as far as it came, and the error that ended it, if there was one.
    """
    from femflex.linear.equilibrium import EquilibriumError
    from femflex.studies.campbell import case_steps, diagram_of

    scale, unit = (case.campbell.speeds.scale, case.campbell.speeds.unit) if case.campbell else (1.0, "rad/s")
    last = case.campbell.speeds[-1] / scale if case.campbell else 1.0
    with Bar("spinning", last, unit=unit) as bar:
        followed = case_steps(case, at, lambda speed: bar(speed / scale), resolved)
        steps, stopped = until_interrupt(followed, "a diagram", EquilibriumError)
    return (diagram_of(case, steps, stopped is None) if steps else None), stopped


def diagram_paths(output: Path) -> dict[str, Path]:
    """Paths at which `femflex run` leaves the table and the picture of a case's diagram."""
    stem = output.with_suffix("").name
    return {kind: output.with_name(f"{stem}_campbell.{end}") for kind, end in ((TABLE, "csv"), (PICTURE, "png"))}


def write_diagram_files(case: Case, output: Path, force: bool) -> list[str]:
    """Write the diagram of a case next to its result file; return the names of the expectations that do not hold."""
    from femflex.extras import MissingExtra, require
    from femflex.measures.verdicts import diagram_verdicts

    files = diagram_paths(output)
    try:
        require("view", "pictures of diagrams")
    except MissingExtra as error:
        print_error(f"{error}; the table is kept in {files[TABLE]}")
        del files[PICTURE]
    theme = "light" if case.pictures is None else case.pictures.theme
    diagram, stopped = computed_diagram(case)
    if diagram is not None:
        print()
        DiagramReport(files, theme, force).print_of_case(case, diagram)
    if stopped is not None:
        raise stopped
    assert diagram is not None
    return [verdict.name for verdict in diagram_verdicts(case, diagram) if not verdict.holds]


@dataclass(frozen=True)
class DiagramReport:
    """Files and form in which a diagram is reported."""

    files: dict[str, Path] = field(default_factory=dict)
    theme: str = "light"
    force: bool = False

    def print_of_case(self, case: Case, diagram: Campbell) -> None:
        """Print the diagram of a case with what is expected of it."""
        from femflex.measures.verdicts import diagram_verdicts

        assert case.campbell is not None
        if not diagram.complete:
            print_error(f"broken off after {int(diagram.requested.sum())} of {len(case.campbell.speeds)} speeds")
        self.print(diagram, case.campbell.speeds.scale, case.campbell.speeds.unit)
        for verdict in diagram_verdicts(case, diagram) if diagram.complete else ():
            print_line("expected", verdict)

    def print(self, diagram: Campbell, scale: float, unit: str) -> None:
        """Print the diagram, and write the requested files."""
        print_campbell(diagram, scale, unit)
        for kind, path in self.files.items():
            if kind == TABLE:
                write_csv(path, *point_rows(diagram), self.force)
            elif kind == PICTURE:
                from femflex.view.campbell import plot_campbell

                plot_campbell(diagram, path, scale, unit, theme=self.theme, force=self.force)
            else:
                from femflex.report.studies import write_campbell_report

                write_campbell_report(diagram, path, scale, unit, self.force)
            print_line(kind, path)


def print_campbell(diagram: Campbell, scale: float, unit: str) -> None:
    """Print frequencies, damping if there is any, crossings, and the motions that grow."""
    import numpy as np

    from femflex.linear.small_motions import growth_rule

    if diagram.title:
        print_title(diagram.title)
    record("complete", diagram.complete)
    requested, speeds = np.flatnonzero(diagram.requested), diagram.speeds / scale
    heads = [f"{diagram.value} {unit}".strip(), *(branch.name for branch in diagram.branches)]

    def table(title: str, columns: Iterable[Any]) -> None:
        marks = [np.where(branch.growing, "*", "") for branch in diagram.branches]
        cells = [
            [f"{v:.6g}{star}" if v == v else "" for v, star in zip(values, stars, strict=True)]
            for values, stars in zip(columns, marks, strict=True)
        ]
        print_table(heads, [[f"{speeds[k]:.6g}", *(column[k] for column in cells)] for k in requested], title)

    point_heads, points = point_rows(diagram)
    if not record("points", [dict(zip(point_heads, row, strict=True)) for row in points]):
        frame = "" if diagram.value else " in the spinning frame"
        table(f"frequency{frame}, Hz (* unstable)", (branch.frequencies for branch in diagram.branches))
        ratios = [branch.damping_ratios for branch in diagram.branches]
        if np.nanmax(np.abs([ratio[requested] for ratio in ratios]), initial=0.0) > PRINTED:
            table("damping ratio of oscillating modes (* unstable)", ratios)
    noun = "values" if diagram.value else "speeds"
    if between := int((~diagram.requested).sum()):
        print_line("followed", f"through {between} additional {noun}, where mode shapes change fast", between)
    for branch in diagram.branches:
        if branch.final_character:
            print_line("branch", f"{branch.name} ends as {branch.final_character}")
    if diagram.critical:
        text = (
            f"{', '.join(f'{speed / scale:.6g}' for speed in diagram.critical)} {unit}: the stiffness is singular "
            "there, and no unique equilibrium exists; a row of the tables holds the limit from below"
        )
        print_line("critical", text, list(diagram.critical))
    if diagram.orders:
        print_crossings(diagram, scale, unit)
    growing = [branch for branch in diagram.branches if branch.growing.any()]
    for branch in growing:
        k, time = branch.fastest
        fastest = f"fastest at {speeds[k]:.6g} {unit}, by a factor e in {time:.4g} s"
        start = f"{speeds[np.flatnonzero(branch.growing)[0]]:.6g} {unit}"
        print_line("unstable", f"{branch.name} grows from {start} on, {fastest}")
    if not growing:
        print_line("stability", f"stable: no motion grows at any of these {noun}")
    print_line("growth", growth_rule())
    if diagram.rigid:
        print_line(
            "rigid", f"{', '.join(diagram.rigid)}: neither grow nor decay, and are no branches", list(diagram.rigid)
        )


def print_crossings(diagram: Campbell, scale: float, unit: str) -> None:
    """Print at which speeds each branch meets each multiple of the spin."""
    if record("crossings", [vars(crossing) for crossing in diagram.crossings]):
        return
    met: dict[tuple[str, int], list[str]] = {}
    for crossing in diagram.crossings:
        met.setdefault((crossing.branch, crossing.order), []).append(f"{crossing.speed / scale:.6g}")
    orders = [f"{order}/rev" for order in diagram.orders]
    if not met:
        print_folded(f"crossing    none with {', '.join(orders)} at these speeds\n")
        return
    rows = [
        [branch.name, *(", ".join(met.get((branch.name, order), ())) for order in diagram.orders)]
        for branch in diagram.branches
    ]
    print_table([unit, *orders], rows, "speed at which it meets")


def point_rows(diagram: Campbell) -> tuple[list[str], list[list[Any]]]:
    """Heads, and a row for every point of every branch."""
    abscissa = f"{diagram.value} [{diagram.unit}]" if diagram.unit else diagram.value
    heads = [abscissa if diagram.value else "speed [rad/s]", "asked", "branch", "frequency [Hz]", "damping ratio"]
    rows = [
        [
            speed, int(diagram.requested[k]), branch.name, branch.frequencies[k],
            None if (damping := branch.damping_ratios[k]) != damping else damping,
            branch.eigenvalues[k].real, int(not branch.growing[k]), branch.characters[k],
        ]
        for branch in diagram.branches
        for k, speed in enumerate(diagram.speeds)
        if branch.eigenvalues[k] == branch.eigenvalues[k]
    ]  # fmt: skip
    return [*heads, "growth [1/s]", "stable", "character"], rows
