"""The pictures of a case that `run` writes next to its result file."""

from __future__ import annotations

import re
import warnings
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from femflex.cli.progress import Bar
from femflex.cli.tables import print_folded

if TYPE_CHECKING:
    from femflex.body import FlexibleBody
    from femflex.case import Case
    from femflex.case.run import PicturesTable
    from femflex.pipeline import Prepared
    from femflex.results import Run
    from femflex.view.plot import PlotOptions


def picture_paths(table: PicturesTable, output: Path) -> list[Path]:
    """Paths of all pictures of the table, next to the result file."""
    return [path for path, _ in _picture_list(table, output)]


def portable_name(name: str) -> str:
    """A channel or body as part of a file name that every system can store.

    >>> portable_name("q:gimbal.angle1"), portable_name("latches/hinge.angle/loss")
    ('q_gimbal.angle1', 'latches_hinge.angle_loss')
    """
    return re.sub(r"[^\w.-]", "_", name, flags=re.ASCII)


def draw_pictures(
    table: PicturesTable,
    run: Run,
    bodies: Mapping[str, FlexibleBody],
    output: Path,
    force: bool = False,
    second_run: Run | None = None,
) -> Iterator[Path]:
    """Draw the pictures one after the other; yield the path of each as soon as it is written.

    second_run: drawn dashed in the plots
    """
    from femflex.cli.progress import Bar
    from femflex.view import mode_montage, plot_histories, plot_spectra, plot_spectrograms, render_movie, render_picture

    look: dict[str, Any] = table.model_dump(
        include={"scale", "colour", "theme", "camera", "view", "triads", "names", "edges", "size", "fit"}
    )
    look["traces"] = tuple(table.traces)
    style: PlotOptions = {"theme": table.theme, "force": force}
    for path, (kind, subject) in _picture_list(table, output):
        if run.without and not _is_available(run, bodies, kind, subject):
            continue
        if kind == "picture":
            render_picture(run, path, time=subject, force=force, **look)
        elif kind == "movie":
            span = (table.start, table.end)
            with Bar("drawing", 1.0, unit="of the frames") as bar:
                report = lambda done, count, bar=bar: bar(done / count)  # noqa: E731
                render_movie(
                    run, path, fps=table.fps, speed=table.speed, span=span, force=force, progress=report, **look
                )
        elif kind == "modes":
            mode_montage(bodies[subject], path, title=f"modes of {subject}", force=force, theme=table.theme)
        elif kind == "spectrum":
            plot_spectra(run, path, [subject], highest=table.highest, second_run=second_run, **style)
        elif kind == "spectrogram":
            plot_spectrograms(run, path, [subject], highest=table.highest, **style)
        else:
            plot_histories(run, path, [subject], second_run=second_run, **style)
        yield path


def _is_available(run: Run, bodies: Mapping[str, FlexibleBody], kind: str, subject: Any) -> bool:
    """Whether the subject of a picture is left in a run with something switched off."""
    if kind in ("plot", "spectrum", "spectrogram"):
        return all(channel.partition(":")[0] in run for channel in subject.split(" over "))
    return kind != "modes" or bodies[subject].n_modes > 0


def _picture_list(table: PicturesTable, output: Path) -> list[tuple[Path, tuple[str, Any]]]:
    pictures: list[tuple[str, tuple[str, Any]]] = [(".png", ("picture", None))] * table.picture
    pictures += [(f"_{t:g}s.png", ("picture", t)) for t in table.times]
    pictures += [(".mp4", ("movie", None))] * table.movie
    pictures += [(f"_modes_{portable_name(body)}.png", ("modes", body)) for body in table.modes]
    pictures += [(f"_{portable_name(path)}.png", ("plot", path)) for path in table.plots]
    for kind, paths in (("spectrum", table.spectra), ("spectrogram", table.spectrograms)):
        pictures += [(f"_{portable_name(path)}_{kind}.png", (kind, path)) for path in paths]
    return [(output.with_name(output.with_suffix("").name + end), subject) for end, subject in pictures]


def second_output(case: Case, output: Path) -> Path | None:
    """Path of the second run's result file; None without a second run."""
    if case.pictures is None or not (case.pictures.without or case.pictures.linearised):
        return None
    word = "linearised" if case.pictures.linearised else "without"
    return output.with_name(f"{output.stem}_{word}{output.suffix}")


def check_left_out(prepared: Prepared) -> None:
    """Raise ValueError if a term that the second run leaves out does not exist, or the craft has no linear motion."""
    if prepared.case.pictures is not None and prepared.case.pictures.linearised:
        from femflex.pipeline.linear_motion import check

        check(prepared.system)
    if prepared.case.pictures is not None and not prepared.model.omitted:
        from femflex.dynamics.ledger.without import resolve_name

        for name in prepared.case.pictures.without:
            resolve_name(prepared.model, name)


@contextmanager
def second_run(case: Case, output: Path, force: bool) -> Iterator[Run | None]:
    """Yield the second run, open for reading; one that diverges is kept up to that time, with a report."""
    path = second_output(case, output)
    if path is None or case.pictures is None:
        yield None
        return
    from femflex import pipeline
    from femflex.integrate import IntegrationError
    from femflex.results import open_run
    from femflex.warning import PhysicsWarning

    linear = case.pictures.linearised
    difference = "linearised" if linear else f"without {', '.join(case.pictures.without)}"
    prepared = pipeline.prepare(case, path, force=force, without=case.pictures.without, linearised=linear)
    text = "reached the end"
    with warnings.catch_warnings(), Bar(f"again {difference}", float(prepared.times[-1])) as bar:
        warnings.simplefilter("ignore", PhysicsWarning)  # what it leaves out is left out on purpose
        try:
            pipeline.integrate(prepared, path, force=force, progress=bar)
        except IntegrationError as error:
            text = f"stopped at t = {error.t:.6g} s, where it diverges"
    print_folded(f"compared    {difference}: {path} {text}")
    with open_run(path) as run:
        yield run
