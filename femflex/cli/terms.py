"""`femflex terms`: what moves each coordinate of a run, term by term."""

from __future__ import annotations

from contextlib import nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from femflex.cli.options import End, Force, Json, MovedCase, Plot, RunFile, Start, Theme, Title, read_seconds
from femflex.cli.progress import Patience
from femflex.cli.tables import print_folded, print_line, print_table, print_title, printed, record
from femflex.cli.verb import verb

if TYPE_CHECKING:
    from femflex.results import FileLock
    from femflex.studies.explain import Explanation
    from femflex.view.plot import PlotOptions


@verb("femflex terms run.h5 --coordinate beam.delta1 -o terms.png")
def terms(
    file: RunFile,
    coordinate: Annotated[
        list[str] | None,
        typer.Option(
            help="Coordinate to explain, such as beam.delta1; may be repeated; `all`. Default: a selection.",
            show_default=False,
        ),
    ] = None,
    output: Plot = None,
    start: Start = None,
    end: End = None,
    case: MovedCase = None,
    theme: Theme = "light",
    title: Title = None,
    whole: Annotated[
        bool, typer.Option("--whole", help="Draw the inertia as one term, not split by accelerating coordinate.")
    ] = False,
    keep: Annotated[
        bool, typer.Option("--keep", help="Keep the terms in the run, as channels terms/elastic and so on.")
    ] = False,
    as_json: Json = False,
    force: Force = False,
) -> None:
    """Print and plot the terms of the equations of motion that drive each coordinate of a run.

    The model is built again from the case text in the run. Terms have their sign in M udot + h - Q = 0 and sum to zero.
    """
    if keep and (start is not None or end is not None):
        raise ValueError("--keep keeps the terms of the whole run; leave out --from and --to")
    span = read_seconds(start, "--from"), read_seconds(end, "--to")
    from femflex.pipeline import rebuilt
    from femflex.results import FileLock, open_run
    from femflex.studies.explain import explain, selected_coordinates
    from femflex.writing import check_destination

    if output is not None:
        check_destination(output, force)
    lock = FileLock(file) if keep and file.is_file() else None
    with lock or nullcontext(), open_run(file) as run:
        with Patience("building the model again from the case text") as say:
            model = rebuilt(run, case)
            say("evaluating the terms")
            start_time, end_time = (float(run.time[k]) if t is None else t for k, t in zip((0, -1), span, strict=True))
            explanation = explain(run, model, (start_time, end_time))
        coordinates = selected_coordinates(explanation, coordinate or [])
        with printed(as_json):
            print_term_tables(run.without, explanation, coordinates)
            if output is not None:
                from femflex.view.terms import CoordinateTerms, plot_terms

                visible, span_text = readable_part(explanation, coordinates, automatic=start is None and end is None)
                sources = ["inertia"] * len(explanation.names) if whole else explanation.own_sources
                coordinate_terms = [
                    CoordinateTerms(k, explanation.names[k], explanation.units[k], sources[k]) for k in coordinates
                ]
                style: PlotOptions = {"theme": theme, "title": title, "force": force}
                terms_of_picture = visible.terms if whole else visible.parts
                plot_terms(run, visible.time, terms_of_picture, coordinate_terms, output, **style)
                print_line("picture", f"{output}{span_text}", output)
            if lock is not None:
                keep_terms(file, explanation, lock)
                print_line("kept", f"{file}: {', '.join('terms/' + name for name in explanation.terms)}")


def readable_part(explanation: Explanation, coordinates: list[int], automatic: bool) -> tuple[Explanation, str]:
    """Return the part of the explanation that a picture can show, and a text that names that part of the run."""
    from femflex.studies.explain import readable_span

    start, end = readable_span(explanation, coordinates) if automatic else (explanation.time[0], explanation.time[-1])
    if end >= explanation.time[-1]:
        return explanation, ""
    return (
        explanation.up_to(end),
        f", {start:g} to {end:g} s of {explanation.time[-1]:g} s, which shows single oscillations (--from, --to)",
    )


def keep_terms(file: Path, explanation: Explanation, lock: FileLock) -> None:
    """Write the terms into the run."""
    from femflex.results import add_channels
    from femflex.system import Channel

    units, shape = ", ".join(explanation.units), (len(explanation.names),)
    add_channels(
        file,
        {
            f"terms/{name}": (
                Channel(units, f"{name.replace('_', ' ')} in M udot + h - Q = 0", shape, explanation.names),
                rows,
            )
            for name, rows in explanation.terms.items()
        },
        lock,
    )


def print_term_tables(without: tuple[str, ...], explanation: Explanation, coordinates: list[int]) -> None:
    """Print peak and root mean square of every term on the coordinates."""
    if without:
        print_title(f"without {', '.join(without)}")
    heads = ["term", ("peak", ".4g"), ("rms", ".4g"), ("of largest", ".1%")]
    for k in coordinates:
        name, unit = explanation.names[k], explanation.units[k]
        print_table(heads, term_rows(explanation, k), f"{name}, {unit}", name=name)
    text = f"{explanation.remainder:.1e} of the largest, over {len(explanation.time)} instants"
    if not record("remainder", explanation.remainder):
        print_folded(f"the terms sum to zero to {text}")


def term_rows(explanation: Explanation, k: int) -> list[tuple[str, float, float, float]]:
    """Rows of the table of coordinate k, largest first; the inertia is followed by its parts."""
    from femflex.studies.explain import ROUNDING

    sizes = explanation.sizes(k)
    scale = max(rms for _, rms in sizes.values())
    largest = max(sizes[name][1] for name in explanation.terms) or 1.0
    order = []
    for name in sorted(explanation.terms, key=lambda name: -sizes[name][1]):
        order += [name, *(sorted(explanation.inertia, key=lambda piece: -sizes[piece][1]) if name == "inertia" else ())]
    return [
        (f"  {name}" if name in explanation.inertia else name, peak, rms, rms / largest)
        for name in order
        for peak, rms in [sizes[name]]
        if rms > ROUNDING * scale
    ]
