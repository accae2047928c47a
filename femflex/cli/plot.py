"""`femflex plot`: time histories and spectra of a run."""

from __future__ import annotations

from contextlib import nullcontext
from pathlib import Path
from typing import Annotated

import typer

from femflex.cli.verb import verb


@verb("femflex plot run.h5 attitude/angles markers/beam.tip/deflection -o tip.svg")
def plot(
    file: Annotated[Path, typer.Argument(help="Result file of a run.", show_default=False)],
    channels: Annotated[
        list[str] | None,
        typer.Argument(
            help="Channels, such as attitude/angles. Default: a selection. `femflex info` lists them.",
            show_default=False,
        ),
    ] = None,
    output: Annotated[
        Path | None, typer.Option("-o", "--output", help="PNG or SVG file. Default: in the folder of the run.")
    ] = None,
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
    highest: Annotated[float | None, typer.Option("--highest", help="Last frequency of spectra in Hz.")] = None,
    radians: Annotated[bool, typer.Option("--radians", help="Angles in radians instead of degrees.")] = False,
    theme: Annotated[str, typer.Option("--theme", help="light or dark.")] = "light",
    title: Annotated[str | None, typer.Option("--title", help="Title. Default: that of the case.")] = None,
    force: Annotated[bool, typer.Option("--force", help="Overwrite an existing file.")] = False,
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
    with open_run(file) as run, nullcontext() if second_file is None else open_run(second_file) as second:
        if energy:
            plot_energy(run, target, theme, title, force=force)
        elif spectrogram:
            plot_spectrograms(run, target, channels or None, not radians, theme, title, highest=highest, force=force)
        elif spectrum:
            plot_spectra(
                run,
                target,
                channels or None,
                not radians,
                theme,
                title,
                highest=highest,
                force=force,
                second_run=second,
            )
        else:
            plot_histories(run, target, channels or None, not radians, theme, title, force=force, second_run=second)
    print(f"picture     {target}")
