"""`femflex render` and `femflex plot`: pictures, movies, histories and spectra of a run, or modes of a body."""

from __future__ import annotations

import tomllib
from contextlib import nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from femflex.cli.info import kind_of_hdf5
from femflex.cli.options import End, Force, Plot, RunFile, Start, Theme, Title, read_seconds
from femflex.cli.progress import Bar
from femflex.cli.verb import verb

if TYPE_CHECKING:
    from femflex.results import Run
    from femflex.view.plot import PlotOptions


@verb("femflex render run.h5 --movie --scale 10 -o run.mp4")
def render(
    file: Annotated[Path, typer.Argument(help="Result file of a run, or body file.", show_default=False)],
    output: Annotated[
        Path | None, typer.Option("-o", "--output", help="PNG picture, MP4 movie, or folder of PNG frames.")
    ] = None,
    at: Annotated[
        str | None,
        typer.Option(
            help="Time of the picture: seconds, or a text such as '2 min'. Default: that of the largest displacement."
        ),
    ] = None,
    movie: Annotated[bool, typer.Option("--movie", help="Draw a movie instead of a picture.")] = False,
    start: Start = None,
    end: End = None,
    speed: Annotated[float | None, typer.Option(help="Seconds of the run in one of the movie.")] = None,
    fps: Annotated[float, typer.Option(help="Frames a second.")] = 25.0,
    mode: Annotated[int | None, typer.Option(min=1, help="Of a body file: draw a looping movie of this mode.")] = None,
    scale: Annotated[str, typer.Option(help="Factor on deformations, 1 is true.")] = "auto",
    colour: Annotated[
        str,
        typer.Option(
            help="What colours bodies: displacement, energy, strain:NAME such as strain:axial, stress:NAME such as "
            "stress:von_mises, peak:NAME, the largest stress over the run, or light, the sunlight on surfaces."
        ),
    ] = "displacement",
    theme: Theme = "light",
    camera: Annotated[
        str | None, typer.Option(help="auto, fixed, follow, orbital, body or body:NAME. Default: that of the case.")
    ] = None,
    view: Annotated[
        str | None,
        typer.Option(help="Direction from the scene to the camera, such as 1,-2,0.5. Default: that of the case."),
    ] = None,
    size: Annotated[str, typer.Option(help="Width and height in pixels.")] = "1280x720",
    edges: Annotated[str, typer.Option(help="auto, sharp, mesh or none.")] = "auto",
    no_triads: Annotated[bool, typer.Option("--no-triads", help="Leave out the axes of bodies and frame.")] = False,
    no_names: Annotated[bool, typer.Option("--no-names", help="Leave out the names of bodies.")] = False,
    trace: Annotated[
        list[str] | None, typer.Option(help="Marker BODY.MARKER whose path is drawn; may be repeated.")
    ] = None,
    force: Force = False,
) -> None:
    """Draw a run off screen: one instant, or a movie; or the modes of a body file as a montage or a looping movie."""
    direction = None if view is None else read_numbers(view, 3, "--view")
    if kind_of_hdf5(file) == "femflex body":
        target = _draw_body(
            file, output, mode, {"theme": theme, "view": direction, "colour": colour, "force": force}, fps
        )
    else:
        if mode is not None:
            raise ValueError(f"--mode draws a mode of a body file, and {file} is a run; make one with `femflex body`")
        look: dict[str, Any] = {
            "scale": scale if scale == "auto" else read_numbers(scale, 1, "--scale")[0],
            "colour": colour,
            "theme": theme,
            "size": tuple(int(n) for n in read_numbers(size.replace("x", ","), 2, "--size")),
            "edges": edges,
            "triads": not no_triads,
            "names": not no_names,
            "traces": tuple(trace or ()),
        }
        span = (read_seconds(start, "--from"), read_seconds(end, "--to"))
        movie = movie or (output is not None and output.suffix.lower() != ".png")
        target = output or file.with_suffix(".mp4" if movie else ".png")
        from femflex.results import open_run

        with open_run(file) as run:
            look |= camera_options(run, camera, direction)
            if movie:
                draw_movie(run, target, span, {"speed": speed, "fps": fps, "force": force}, look)
            else:
                from femflex.view import render_picture

                render_picture(run, target, time=read_seconds(at, "--at"), force=force, **look)
    print(f"picture     {target}")


def camera_options(run: Run, camera: str | None, view: tuple[float, ...] | None) -> dict[str, Any]:
    """Return camera, view and fit of the options, or else those of the pictures of the run's case."""
    if camera is not None or view is not None:
        return {"camera": camera or "auto", "view": view}
    from femflex.case.run import PicturesTable

    try:
        table = PicturesTable.model_validate(tomllib.loads(run.case_text).get("pictures", {}))
    except ValueError:  # a run made in Python has no case, one of another version may have other keys
        table = PicturesTable()
    return table.model_dump(include={"camera", "view", "fit"})


def draw_movie(
    run: Run, target: Path, span: tuple[float | None, float | None], timing: dict[str, Any], look: dict[str, Any]
) -> None:
    """Draw a movie with a progress bar; times that are None are chosen as `render_movie` does."""
    from femflex.view import render_movie

    with Bar("drawing", unit="frames") as bar:
        render_movie(run, target, span=span, progress=bar, **timing, **look)


def _draw_body(file: Path, output: Path | None, mode: int | None, look: dict[str, Any], fps: float) -> Path:
    from femflex.reduction import load_body
    from femflex.view import mode_montage, mode_movie

    body = load_body(file)
    if mode is None:
        return mode_montage(body, output or file.with_suffix(".png"), title=f"modes of {file.stem}", **look)
    target = output or file.with_name(f"{file.stem}_mode{mode}.mp4")
    with Bar("drawing", unit="frames") as bar:
        return mode_movie(body, target, mode, fps=fps, progress=bar, **look)


def read_numbers(text: str, n: int, option: str) -> tuple[float, ...]:
    """Read n numbers separated by commas. Raises ValueError naming the option."""
    try:
        numbers = tuple(float(entry) for entry in text.split(","))
    except ValueError:
        numbers = ()
    if len(numbers) != n:
        raise ValueError(f"{option}: found {text!r}; expected {n} numbers, such as {','.join('1' * n)}")
    return numbers


@verb("femflex plot run.h5 attitude/angles markers/beam.tip/deflection -o tip.svg")
def plot(
    file: RunFile,
    channels: Annotated[
        list[str] | None,
        typer.Argument(
            help="Channels, such as attitude/angles. Default: a selection. `femflex info` lists them.",
            show_default=False,
        ),
    ] = None,
    output: Plot = None,
    second_file: Annotated[
        Path | None, typer.Option("--with", help="Result file of another run, laid over this one in dashed lines.")
    ] = None,
    spectrum: Annotated[
        bool, typer.Option("--spectrum", help="Amplitude spectra with named peaks instead of histories.")
    ] = False,
    spectrogram: Annotated[
        bool, typer.Option("--spectrogram", help="Amplitude over time and frequency instead of histories.")
    ] = False,
    energy: Annotated[
        bool, typer.Option("--energy", help="Stacked account of stored and dissipated energy and work, by contributor.")
    ] = False,
    highest: Annotated[float | None, typer.Option(help="Last frequency of spectra in Hz.")] = None,
    radians: Annotated[bool, typer.Option("--radians", help="Angles in radians instead of degrees.")] = False,
    theme: Theme = "light",
    title: Title = None,
    force: Force = False,
) -> None:
    """Plot channels of a run over time, or their spectra, as PNG or SVG."""
    from femflex.results import open_run
    from femflex.view import plot_energy, plot_histories, plot_spectra, plot_spectrograms

    if energy and (channels or second_file is not None or spectrum or spectrogram):
        raise ValueError("--energy plots the energy account of one run; leave channels, --with and --spectrum out")
    if spectrogram and (spectrum or second_file is not None):
        raise ValueError("--spectrogram plots one run; leave --spectrum and --with out")
    kind = "energy" if energy else "spectrogram" if spectrogram else "spectrum" if spectrum else "plot"
    target = output or file.with_name(f"{file.stem}_{kind}.png")
    style: PlotOptions = {"theme": theme, "title": title, "force": force}
    chosen = (channels or None, not radians)
    with open_run(file) as run, nullcontext() if second_file is None else open_run(second_file) as second:
        if energy:
            plot_energy(run, target, **style)
        elif spectrogram:
            plot_spectrograms(run, target, *chosen, highest=highest, **style)
        elif spectrum:
            plot_spectra(run, target, *chosen, highest=highest, second_run=second, **style)
        else:
            plot_histories(run, target, *chosen, second_run=second, **style)
    print(f"picture     {target}")
