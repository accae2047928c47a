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
    doctor,
    equilibrium,
    export,
    info,
    jitter,
    linearize,
    modes,
    new,
    render,
    run,
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
    invoke_without_command=True,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)
FIRST_STEPS = """femflex tells how a spacecraft of rigid and flexible parts moves. To begin:

  femflex doctor                           whether everything works on this machine
  femflex examples                         the cases that come with it
  femflex new first.toml --template panels a case to start from; --mesh and --deck make one of your own file
  femflex check first.toml                 every problem of a case, without running it
  femflex run first.toml                   simulate it, with pictures
  femflex report first.h5                  the run as a page for your browser
  femflex --help                           all verbs; each explains itself with --help"""


def _version(requested: bool) -> None:
    if requested:
        typer.echo(f"femflex {__version__}")
        raise typer.Exit


@app.callback()
def _options(
    context: typer.Context,
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Print the version.")
    ] = False,
) -> None:
    if context.invoked_subcommand is None:
        typer.echo(FIRST_STEPS)


for _verb in (
    new.new,
    run.run,
    modes.modes,
    body.body,
    render.render,
    render.plot,
    stress.stress,
    terms.terms,
    budget.budget,
    converge.converge,
    equilibrium.equilibrium,
    campbell.campbell,
    jitter.jitter,
    linearize.linearize,
    stability.stability,
    sweep.sweep,
    export.report,
    export.export,
    check.check,
    new.examples,
    doctor.doctor,
    info.info,
    new.schema,
):
    app.command(epilog=EXAMPLES[_verb.__name__])(_verb)
