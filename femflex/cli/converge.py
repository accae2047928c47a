"""`femflex converge`: how many modes, how fine a mesh, and a verdict."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from threading import Event, Lock, Thread
from typing import TYPE_CHECKING, Annotated

import typer

from femflex.cli.progress import Bar, Patience
from femflex.cli.tables import print_json, print_table
from femflex.cli.verb import complain, verb

if TYPE_CHECKING:
    from femflex.studies import Convergence, Point, Study

BEAT = 0.5  # seconds


@verb("femflex converge cases/orbiter_beam.toml --over modes --tolerance 1e-6 -o convergence.png")
def converge(
    case: Annotated[Path, typer.Argument(help="Case file (TOML) with a [study].", show_default=False)],
    over: Annotated[
        str, typer.Option("--over", help="What is varied: modes, mesh, derivatives or segments.")
    ] = "modes",
    levels: Annotated[
        str | None,
        typer.Option(
            "--levels",
            help="Numbers of modes or segments (1,2,4), mesh refinements or derivative shapes (0,1,2), not the case's.",
        ),
    ] = None,
    tolerance: Annotated[
        float | None, typer.Option("--tolerance", help="Largest relative error; left out, the case's, or 1e-3.")
    ] = None,
    output: Annotated[Path | None, typer.Option("-o", "--output", help="Draw the study (PNG or SVG).")] = None,
    theme: Annotated[str, typer.Option("--theme", help="light or dark.")] = "light",
    force: Annotated[bool, typer.Option("--force", help="Overwrite an existing picture.")] = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print for programs.")] = False,
) -> None:
    """Vary modes, mesh, derivative shapes or segments of a case, watch the quantity its [study] names, and judge.

    Prints a table, the observed order, the extrapolated limit, and a verdict with a recommended number. Modes: the
    case runs with more and more modes. Mesh: every cell is divided in two along each edge, again and again. Ctrl-C
    keeps what there is (exit code 130).
    """
    wanted = Wanted(tolerance, as_json, output, theme, force)
    wanted.check()
    numbers = None if levels is None else read_levels(levels)
    with Patience("building the bodies"):
        from femflex.case import read_case
        from femflex.studies import planned
        from femflex.warning import PhysicsWarning

        warnings.simplefilter("once", PhysicsWarning)  # not again at every level
        study = planned(read_case(case), over, numbers)  # type: ignore[arg-type]  # another word is refused there
    points, stopped = climbed(study)
    if any(not point.problem for point in points):
        wanted.tell(study, points, stopped is None)
    if stopped is not None:
        raise stopped


def climbed(study: Study) -> tuple[list[Point], BaseException | None]:
    """The points of a study, and what broke it off, if anything did."""
    from femflex.integrate import IntegrationError
    from femflex.results.keeping import held

    points: list[Point] = []
    with Bar("converging", 100.0, unit="%") as bar, kept_alive(bar) as told, ExitStack() as keeping:
        try:
            for point in study.points(lambda part: told(float(round(100.0 * part)))):
                if not points:
                    keeping.enter_context(held("a study"))
                points.append(point)
        except (KeyboardInterrupt, IntegrationError) as stop:
            return points, stop
    return points, None


@contextmanager
def kept_alive(bar: Callable[[float], None]) -> Iterator[Callable[[float], None]]:
    """What tells the bar, and tells it again at every beat: while a large mesh is built, nothing else would."""
    reached, lock, over = [0.0], Lock(), Event()

    def tell(now: float) -> None:
        with lock:
            reached[0] = now
            bar(now)

    def beat() -> None:
        while not over.wait(BEAT):
            with lock:
                bar(reached[0])

    thread = Thread(target=beat, daemon=True)
    thread.start()
    try:
        yield tell
    finally:
        over.set()
        thread.join()


@dataclass(frozen=True)
class Wanted:
    """What is to be made of a study."""

    tolerance: float | None
    as_json: bool
    picture: Path | None
    theme: str
    force: bool

    def check(self) -> None:
        """Raise before any work what would be found wrong after it."""
        if self.tolerance is not None and not 0.0 < self.tolerance < 1.0:
            raise ValueError(f"--tolerance is {self.tolerance:g}; give a relative error between 0 and 1, such as 1e-3")
        if self.picture is not None:
            from femflex.results.place import check_place
            from femflex.view.convergence import check_kind
            from femflex.view.theme import theme_of

            theme_of(self.theme)
            check_kind(self.picture)
            check_place(self.picture, self.force)

    def tell(self, study: Study, points: list[Point], complete: bool) -> None:
        """Print the study, and draw it if asked for."""
        from femflex.studies import assessed

        found = assessed(study, points, self.tolerance, complete)
        if self.as_json:
            print_json(found.to_dict())
        else:
            print_study(found)
        if self.picture is not None and complete:  # an interrupt does not wait for a picture
            from femflex.view.convergence import plot_convergence

            plot_convergence(found, self.picture, self.theme, force=self.force)
            if not self.as_json:
                print(f"picture     {self.picture}")
        if not complete:
            without = "; no picture is drawn" if self.picture is not None else ""
            complain(f"broken off after {len(points)} of {len(study.ladder.rungs)} levels{without}")


def print_study(found: Convergence) -> None:
    """Print table, order, limit and verdict."""
    from math import isfinite
    from textwrap import fill

    print(f"{found.title} [{found.unit}]" if found.unit not in ("", "1") else found.title)
    rows, split = [], found.over == "modes" and bool(found.derivatives.any())
    for k, level in enumerate(found.levels):
        change, error = found.changes[k], found.errors[k]
        told = [f"{change:.3e}" if isfinite(change) else "", f"{error:.2e}" if isfinite(error) else ""]
        mark = "<-" if level == found.recommended else ""
        apart = [str(found.derivatives[k])] if split else []
        rows.append([str(level), str(found.counts[k]), *apart, f"{found.values[k]:.12g}", *told, mark])
    heads = ["refined", "dofs"] if found.over == "mesh" else [found.over, "coordinates"]
    heads += ["of them derivatives"] if split else []
    print_table([*heads, "value", "change", "error", ""], rows)
    for text in found.left_out:
        print(fill(f"left out    {text}", 110, subsequent_indent=" " * 12))
    print(fill(f"verdict     {found.verdict}", 110, subsequent_indent=" " * 12))


def read_levels(text: str, option: str = "--levels") -> list[int]:
    """The whole numbers in a list such as "1,2,4".

    >>> read_levels("1, 2, 4")
    [1, 2, 4]
    """
    try:
        return [int(part) for part in text.replace(",", " ").split()]
    except ValueError:
        raise ValueError(f"{option} is {text!r}; give whole numbers with commas, such as 1,2,4,8") from None
