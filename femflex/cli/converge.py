"""`femflex converge`: how many modes, how fine a mesh, and a verdict."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from textwrap import fill
from threading import Event, Lock, Thread
from typing import TYPE_CHECKING, Annotated

import typer

from femflex.cli.progress import Bar, Patience
from femflex.cli.tables import print_json, print_table
from femflex.cli.verb import complain, verb

if TYPE_CHECKING:
    from femflex.case import Case
    from femflex.studies import Convergence, Point, StrainStudy, Study

BEAT = 0.5  # seconds


@verb("femflex converge cases/orbiter_beam.toml --over modes --tolerance 1e-6 -o convergence.png")
def converge(
    case: Annotated[Path, typer.Argument(help="Case file (TOML) with a \\[study].", show_default=False)],
    over: Annotated[
        str,
        typer.Option(
            "--over",
            help="What is varied: modes, mesh, derivatives, segments, strain (linear, condensed, nonlinear); or "
            "several in turn, modes,derivatives,strain, each with what the ones before found enough.",
        ),
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
    """Vary modes, mesh, derivative shapes, segments or the form of strain, watch the quantity of \\[study], and judge.

    Prints a table, the observed order, the extrapolated limit, and a verdict with a recommended number. Modes: the
    case runs with more and more modes. Mesh: every cell is divided in two along each edge, again and again. Strain:
    the three forms against the one that holds furthest, with what each costs. Ctrl-C keeps what there is (exit code
    130).
    """
    wanted = Wanted(tolerance, as_json, output, theme, force)
    wanted.check()
    varied = list(dict.fromkeys(word.strip() for word in over.split(",") if word.strip()))
    numbers = checked_levels(levels, varied)
    with Patience("building the bodies"):
        from femflex.case import read_case
        from femflex.case.builders import with_own_strain
        from femflex.studies import check_studies, with_choice
        from femflex.warning import PhysicsWarning

        warnings.simplefilter("once", PhysicsWarning)  # not again at every level
        read = with_own_strain(read_case(case))
        check_studies(read, varied)
    findings: list[Convergence | StrainStudy] = []
    for word in varied or ["modes"]:
        found, names, stopped = studied(read, word, numbers, tolerance)
        if found is not None:
            findings.append(found)
            wanted.say(found)
        if stopped is not None:
            wanted.tell(findings, complete=False)
            if found is not None and wanted.picture is not None:
                complain("no picture is drawn")
            raise stopped
        assert found is not None
        read = with_choice(read, found, names)
    wanted.tell(findings, complete=True)


def checked_levels(levels: str | None, varied: list[str]) -> list[int] | None:
    """The numbers of --levels. Raises ValueError where they cannot belong to what is varied."""
    if levels is not None and (len(varied) > 1 or varied == ["strain"]):
        raise ValueError(
            f"--levels goes with one study over modes, mesh, derivatives or segments; found --over {','.join(varied)}. "
            "Leave it out, or name the numbers in the case's [study]"
        )
    return None if levels is None else read_levels(levels)


def studied(
    case: Case, over: str, levels: list[int] | None, tolerance: float | None
) -> tuple[Convergence | StrainStudy | None, tuple[str, ...], BaseException | None]:
    """What a study found, the bodies it varied, and what broke it off, if anything did."""
    from femflex.studies import assessed, planned, strain_forms

    if over == "strain":
        with Bar("comparing", 100.0, unit="%") as bar, kept_alive(bar) as told:
            compared = strain_forms(case, tolerance, lambda part: told(float(round(100.0 * part))))
        return compared, tuple(compared.own), None
    study = planned(case, over, levels)  # type: ignore[arg-type]  # another word is refused there
    points, stopped = climbed(study)
    valued = any(not point.problem for point in points)
    if stopped is not None and valued:
        complain(f"broken off after {len(points)} of {len(study.ladder.rungs)} levels")
    if not valued:
        return None, study.ladder.varied, stopped
    return assessed(study, points, tolerance, stopped is None), study.ladder.varied, stopped


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

    def say(self, found: Convergence | StrainStudy) -> None:
        """Print one study as it is done."""
        if not self.as_json:
            print_forms(found) if found.over == "strain" else print_study(found)  # type: ignore[arg-type]

    def tell(self, findings: list[Convergence | StrainStudy], complete: bool) -> None:
        """Print what they come to together, and draw them if asked for."""
        from femflex.studies import choice, choice_text

        if self.as_json and len(findings) == 1:
            print_json(findings[0].to_dict())
        elif self.as_json and findings:
            chosen = {found.over: choice(found) for found in findings}
            studies = [found.to_dict() for found in findings]
            print_json({"studies": studies, "choice": chosen, "verdict": choice_text(findings)})
        elif len(findings) > 1:
            print(fill(f"together    {choice_text(findings)}", 110, subsequent_indent=" " * 12))
        if self.picture is not None and complete:  # an interrupt does not wait for a picture
            from femflex.view.side_by_side import plot_studies

            plot_studies(findings, self.picture, choice_text(findings), self.theme, force=self.force)
            if not self.as_json:
                print(f"picture     {self.picture}")


def print_forms(found: StrainStudy) -> None:
    """Print the comparison of the three forms of strain."""
    from math import isfinite

    print(f"{found.title} [{found.unit}]" if found.unit not in ("", "1") else found.title)
    rows = []
    for form in found.forms:
        off = found.difference(form)
        counts = [str(n) for n in (form.coordinates, form.coordinates - form.derivatives, form.derivatives)]
        told = [f"{form.value:.12g}", f"{off:.2e}", f"{form.seconds:.3g}"] if isfinite(off) else ["", "", ""]
        rows.append(
            [form.strain, *counts, str(form.followers), *told, "<-" if form.strain == found.recommended else ""]
        )
    heads = ["strain", "coordinates", "vibration", "derivatives", "following", "value", "difference", "seconds", ""]
    print_table(heads, rows)
    print(fill(f"verdict     {found.verdict}", 110, subsequent_indent=" " * 12))


def print_study(found: Convergence) -> None:
    """Print table, order, limit and verdict."""
    from math import isfinite

    print(f"{found.title} [{found.unit}]" if found.unit not in ("", "1") else found.title)
    rows, apart, heads = [], *derivatives_apart(found)
    for k, level in enumerate(found.levels):
        change, error = found.changes[k], found.errors[k]
        told = [f"{change:.3e}" if isfinite(change) else "", f"{error:.2e}" if isfinite(error) else ""]
        mark = "<-" if level == found.recommended else ""
        rows.append([str(level), str(found.counts[k]), *apart[k], f"{found.values[k]:.12g}", *told, mark])
    print_table([*heads, "value", "change", "error", ""], rows)
    for text in found.left_out:
        print(fill(f"left out    {text}", 110, subsequent_indent=" " * 12))
    print(fill(f"verdict     {found.verdict}", 110, subsequent_indent=" " * 12))


def derivatives_apart(found: Convergence) -> tuple[list[list[str]], list[str]]:
    """Further cells of every row that count vibration and derivative shapes apart, and the heads before the value."""
    if found.over == "mesh":
        return [[] for _ in found.levels], ["refined", "dofs"]
    of = "shapes" if found.over == "derivatives" and found.followers.any() else "coordinates"
    parts, heads = [], [found.over, of]
    if found.derivatives.any() or found.followers.any():
        inside = found.derivatives + (found.followers if of == "shapes" else 0)
        parts, heads = [found.counts - inside, found.derivatives], [*heads, "vibration", "derivatives"]
    if found.followers.any():
        parts, heads = [*parts, found.followers], [*heads, "following"]
    return [[str(part[k]) for part in parts] for k in range(len(found.levels))], heads


def read_levels(text: str, option: str = "--levels") -> list[int]:
    """The whole numbers in a list such as "1,2,4".

    >>> read_levels("1, 2, 4")
    [1, 2, 4]
    """
    try:
        return [int(part) for part in text.replace(",", " ").split()]
    except ValueError:
        raise ValueError(f"{option} is {text!r}; give whole numbers with commas, such as 1,2,4,8") from None
