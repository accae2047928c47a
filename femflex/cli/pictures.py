"""The pictures of a case that `run` writes next to its result file."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from femflex.body import FlexibleBody
    from femflex.case.run import PicturesTable
    from femflex.results import Run


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
        include={"scale", "colour", "theme", "camera", "view", "triads", "edges", "size", "fit"}
    )
    look["traces"] = tuple(table.traces)
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
            plot_spectra(
                run, path, [subject], force=force, theme=table.theme, highest=table.highest, second_run=second_run
            )
        elif kind == "spectrogram":
            plot_spectrograms(run, path, [subject], force=force, theme=table.theme, highest=table.highest)
        else:
            plot_histories(run, path, [subject], force=force, theme=table.theme, second_run=second_run)
        yield path


def _is_available(run: Run, bodies: Mapping[str, FlexibleBody], kind: str, subject: Any) -> bool:
    """Whether the subject of a picture is left in a run with something switched off."""
    if kind in ("plot", "spectrum", "spectrogram"):
        return all(channel.partition(":")[0] in run for channel in subject.split(" over "))
    return kind != "modes" or bodies[subject].n_modes > 0


def _picture_list(table: PicturesTable, output: Path) -> list[tuple[Path, tuple[str, Any]]]:
    stem = output.with_suffix("")
    pictures: list[tuple[Path, tuple[str, Any]]] = []
    if table.picture:
        pictures.append((stem.with_name(f"{stem.name}.png"), ("picture", None)))
    pictures += [(stem.with_name(f"{stem.name}_{t:g}s.png"), ("picture", t)) for t in table.times]
    if table.movie:
        pictures.append((stem.with_name(f"{stem.name}.mp4"), ("movie", None)))
    pictures += [
        (stem.with_name(f"{stem.name}_modes_{portable_name(body)}.png"), ("modes", body)) for body in table.modes
    ]
    pictures += [(stem.with_name(f"{stem.name}_{portable_name(path)}.png"), ("plot", path)) for path in table.plots]
    pictures += [
        (stem.with_name(f"{stem.name}_{portable_name(path)}_spectrum.png"), ("spectrum", path))
        for path in table.spectra
    ]
    pictures += [
        (stem.with_name(f"{stem.name}_{portable_name(path)}_spectrogram.png"), ("spectrogram", path))
        for path in table.spectrograms
    ]
    return pictures
