"""`femflex plot`: time histories and spectra of a run."""

from __future__ import annotations

from contextlib import nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from femflex.cli.options import Force, Plot, RunFile, Theme, Title
from femflex.cli.verb import verb

if TYPE_CHECKING:
    from femflex.view.plot import PlotOptions


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
