"""The command line's verbs put together."""

from __future__ import annotations

from typing import Annotated

import typer

from femflex import __version__
from femflex.cli import (
    body,
    budget,
    campbell,
    check,
    converge,
    equilibrium,
    export,
    info,
    linearize,
    modes,
    new,
    plot,
    render,
    report,
    run,
    schema,
    stability,
    stress,
    sweep,
    terms,
)
from femflex.cli.verb import EXAMPLES

app = typer.Typer(
    name="femflex",
    help="From a mesh of a boom, panel or blanket to the motion of the whole spacecraft.",
    epilog="Example: femflex run cases/orbiter_beam.toml. Each verb explains itself with --help.",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)


def _version(requested: bool) -> None:
    if requested:
        typer.echo(f"femflex {__version__}")
        raise typer.Exit


@app.callback()
def _options(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Print the version.")
    ] = False,
) -> None:
    pass


for _verb in (
    new.new,
    run.run,
    modes.modes,
    body.body,
    render.render,
    plot.plot,
    stress.stress,
    terms.terms,
    budget.budget,
    converge.converge,
    equilibrium.equilibrium,
    campbell.campbell,
    linearize.linearize,
    stability.stability,
    sweep.sweep,
    report.report,
    export.export,
    check.check,
    info.info,
    schema.schema,
):
    app.command(epilog=EXAMPLES[_verb.__name__])(_verb)
