"""`femflex campbell`: frequencies over the speed of a steady spin, as a table, a file and a diagram."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from femflex.cli.advice_lines import Verbose, print_reasons, strain_data
from femflex.cli.campbell_report import print_campbell, write_table
from femflex.cli.outputs import DIAGRAM_SUFFIXES, PAGE_SUFFIXES, PICTURE, REPORT, TABLE, outputs
from femflex.cli.progress import Bar, Patience
from femflex.cli.tables import print_folded, print_json
from femflex.cli.times import read_seconds
from femflex.cli.verb import print_error, verb

if TYPE_CHECKING:
    from femflex.case import Case
    from femflex.pipeline.decisions import ResolvedCase
    from femflex.studies.campbell import Campbell, Spin
    from femflex.studies.campbell.matching import Match


@verb('femflex campbell cases/helicopter_blade.toml --speeds "0:400 rpm:41" -o campbell.png -o campbell.csv')
def campbell(
    case: Annotated[Path, typer.Argument(help="Case file (TOML).", show_default=False)],
    speeds: Annotated[
        str | None,
        typer.Option(
            "--speeds",
            help="Speeds: first, last and number, such as 0:400 rpm:17, or a list. Default: those of the case.",
        ),
    ] = None,
    modes: Annotated[int | None, typer.Option("--modes", min=1, help="Lowest branches followed.")] = None,
    orders: Annotated[
        str | None, typer.Option("--orders", help="Multiples of the speed whose crossings are listed: 1,2,3.")
    ] = None,
    vary: Annotated[
        str | None,
        typer.Option(
            "--vary", help="KEY=FIRST:LAST:NUMBER of another value than the speed: joints.0.stiffness=1:9:17."
        ),
    ] = None,
    at: Annotated[
        str | None,
        typer.Option("--at", help="Time at which loads that vary are taken: seconds, or a text such as '2 min'."),
    ] = None,
    output: Annotated[
        list[Path] | None,
        typer.Option("-o", "--output", help="Table (.csv), diagram (.png, .svg) or page (.html); may be repeated."),
    ] = None,
    theme: Annotated[str, typer.Option("--theme", help="light or dark.")] = "light",
    force: Annotated[bool, typer.Option("--force", help="Overwrite existing files.")] = False,
    verbose: Verbose = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print for programs.")] = False,
) -> None:
    """Frequencies, damping and stability of a craft over its speed of spin, or another value: the Campbell diagram.

    At every speed the equilibrium is sought from the one before and the equations linearised about it; branches are
    followed by the likeness of their shapes, with speeds in between where shapes change fast. Frequencies are those
    seen in the spinning frame. Ctrl-C keeps what there is (exit code 130); so does a speed without equilibrium (3).
    With --vary, or where the case has a \\[stability] of one value and no \\[campbell], frequencies of its equilibrium
    are followed over that value.
    """
    files = outputs(output or (), {TABLE: (".csv",), PICTURE: DIAGRAM_SUFFIXES, REPORT: PAGE_SUFFIXES})
    diagram_outputs, time = (
        CampbellOutputs(files.get(TABLE), files.get(PICTURE), theme, force, files.get(REPORT)),
        read_seconds(at, "--at"),
    )
    diagram_outputs.check()
    with Patience("reading the case"):
        from femflex.case import read_case

        parsed_case = read_case(case)
        if (axis_range := value_range(parsed_case, vary, speeds)) is not None:
            if orders is not None or at is not None:
                raise ValueError(
                    f"found {'--orders' if orders else '--at'}, which goes with speeds and not with {axis_range[0]}"
                )
            print_value_diagram(parsed_case, axis_range, modes, diagram_outputs, as_json)
            return
        parsed_case = with_options(parsed_case, speeds, modes, orders)
        from femflex.studies.campbell import axis_of, resolve_campbell_case

        axis_of(parsed_case)  # reported before the bodies are built
        resolved = resolve_campbell_case(parsed_case)
    if not as_json:
        print_reasons(resolved, verbose)
    diagram, stopped = computed_diagram(parsed_case, time, resolved)
    if diagram is not None:
        diagram_outputs.report(parsed_case, diagram, {"bodies": strain_data(resolved)} if as_json else None)
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


def print_value_diagram(
    case: Case, axis_range: KeyRange, modes: int | None, diagram_outputs: CampbellOutputs, as_json: bool
) -> None:
    """Print and write the diagram over a value of the case, or its computed part if it is broken off."""
    import numpy as np

    from femflex.case.stability import stability_table
    from femflex.dynamics.linear.equilibrium import EquilibriumError
    from femflex.studies.campbell import assembled_diagram, value_motions, with_value_axis
    from femflex.studies.campbell.over_value import MODES

    key, axis = axis_range
    table = stability_table({"vary": {key: axis}}, "--vary").vary[key]
    first, last, unit = table.numbers()
    modes, steps, stopped = modes or MODES, [], None
    with Bar("varying", last - first, unit=unit or "1") as bar:
        try:
            for step in value_motions(
                case, key, np.linspace(first, last, table.points).tolist(), unit, modes, lambda v: bar(v - first)
            ):
                steps.append(step)
        except (KeyboardInterrupt, EquilibriumError) as error:
            stopped = error
    if steps:
        diagram = with_value_axis(assembled_diagram(steps, modes, (), case.title, stopped is None), key, unit)
        if as_json:
            print_json(diagram.to_dict())
        else:
            print_campbell(diagram, 1.0, unit)
        for name, path in diagram_outputs.files(diagram, 1.0, unit):
            if not as_json:
                print(f"{name:11} {path}")
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
    return (
        case.model_copy(update={"campbell": CampbellTable.model_validate(settings)}) if "speeds" in settings else case
    )


def computed_diagram(
    case: Case, at: float | None = None, resolved: ResolvedCase | None = None
) -> tuple[Campbell | None, BaseException | None]:
    """Compute the diagram of a case, or of its choices made already.

    Returns it as far as it came, and the error that ended it, if there was one.
    """
    from contextlib import ExitStack

    from femflex.dynamics.linear.equilibrium import EquilibriumError
    from femflex.results.interrupts import finished_on_interrupt
    from femflex.studies.campbell import case_spins, diagram_of

    spins: list[tuple[Spin, Match | None]] = []
    stopped: BaseException | None = None
    scale, unit = (case.campbell.speeds.scale, case.campbell.speeds.unit) if case.campbell else (1.0, "rad/s")
    last = case.campbell.speeds[-1] / scale if case.campbell else 1.0
    with Bar("spinning", last, unit=unit) as bar, ExitStack() as keeping:
        try:
            for step in case_spins(case, at, lambda speed: bar(speed / scale), resolved):
                if not spins:
                    keeping.enter_context(finished_on_interrupt("a diagram"))
                spins.append(step)
        except (KeyboardInterrupt, EquilibriumError) as error:
            stopped = error
    return (diagram_of(case, spins, stopped is None) if spins else None), stopped


def diagram_paths(output: Path) -> tuple[Path, Path]:
    """Paths at which `femflex run` leaves the table and the picture of a case's diagram."""
    stem = output.with_suffix("").name
    return output.with_name(f"{stem}_campbell.csv"), output.with_name(f"{stem}_campbell.png")


def write_diagram_files(case: Case, output: Path, force: bool) -> list[str]:
    """Write the diagram of a case next to its result file; return the names of the expectations that do not hold."""
    from femflex.case.verdicts import diagram_verdicts
    from femflex.extras import MissingExtra, require

    table, picture = diagram_paths(output)
    drawn: Path | None = picture
    try:
        require("view", "pictures of diagrams")
    except MissingExtra as error:
        print_error(f"{error}; the table is kept in {table}")
        drawn = None
    theme = "light" if case.pictures is None else case.pictures.theme
    diagram, stopped = computed_diagram(case)
    if diagram is not None:
        print()
        CampbellOutputs(table, drawn, theme, force).report(case, diagram)
    if stopped is not None:
        raise stopped
    assert diagram is not None
    return [verdict.name for verdict in diagram_verdicts(case, diagram) if not verdict.holds]


@dataclass(frozen=True)
class CampbellOutputs:
    """Files and form in which a diagram is written."""

    table: Path | None
    picture: Path | None
    theme: str
    force: bool
    page: Path | None = None

    def check(self) -> None:
        """Raise an error before the work starts if a file could not be written after it."""
        from femflex.view.theme import theme_of
        from femflex.writing import check_destination

        theme_of(self.theme)
        for path in (self.table, self.picture, self.page):
            if path is not None:
                check_destination(path, self.force)

    def report(self, case: Case, diagram: Campbell, extra: dict[str, Any] | None = None) -> None:
        """Print the diagram, as JSON if `extra` is merged into it, and write the requested files."""
        from femflex.case.verdicts import diagram_verdicts

        assert case.campbell is not None
        scale, unit = case.campbell.speeds.scale, case.campbell.speeds.unit
        as_json = extra is not None
        if extra is not None:
            print_json(diagram.to_dict() | extra)
        else:
            print_campbell(diagram, scale, unit)
        if not diagram.complete:
            print_error(f"broken off after {int(diagram.requested.sum())} of {len(case.campbell.speeds)} speeds")
        for name, path in self.files(diagram, scale, unit):
            if not as_json:
                print(f"{name:11} {path}")
        if diagram.complete and not as_json:
            for verdict in diagram_verdicts(case, diagram):
                print_folded(f"expected    {verdict}")

    def files(self, diagram: Campbell, scale: float, unit: str) -> list[tuple[str, Path]]:
        """Write the requested files; return the kind and the path of each."""
        written = []
        if self.table is not None:
            write_table(diagram, self.table, self.force)
            written.append(("table", self.table))
        if self.picture is not None:
            from femflex.view.campbell import plot_campbell

            plot_campbell(diagram, self.picture, self.theme, scale, unit, force=self.force)
            written.append(("picture", self.picture))
        if self.page is not None:
            from femflex.report.studies import write_campbell_report

            write_campbell_report(diagram, self.page, scale, unit, self.force)
            written.append(("report", self.page))
        return written
