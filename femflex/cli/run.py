"""`femflex run`: simulates a case and writes its result file, with a report on the way."""

from __future__ import annotations

import time
from contextlib import ExitStack, nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from femflex.cli.options import CaseFile, Force, Verbose, split_names
from femflex.cli.pictures import check_left_out, second_output, second_run
from femflex.cli.progress import Bar, Patience
from femflex.cli.run_report import print_modes_verdicts, print_run_heading, print_run_summary, print_verdicts
from femflex.cli.verb import print_error, verb

if TYPE_CHECKING:
    from femflex.case import Case
    from femflex.pipeline import Prepared
    from femflex.results import FileLock, Run

HELP_WITHOUT = (
    "Switch off by name: gravity_gradient,gyroscopic, a load, an effector or a kind such as solar_pressure, "
    "flexibility, nonlinear_strain; may be repeated."
)


@verb("femflex run cases/orbiter_beam.toml -o beam.h5")
def run(
    case: CaseFile,
    output: Annotated[
        Path | None, typer.Option("-o", "--output", help="Result file (HDF5). Default: CASE.h5 in this folder.")
    ] = None,
    resume: Annotated[bool, typer.Option("--resume", help="Go on with the unfinished run in the output file.")] = False,
    force: Force = False,
    without: Annotated[list[str] | None, typer.Option(help=HELP_WITHOUT)] = None,
    linearised: Annotated[
        bool,
        typer.Option("--linearised", help="Solve the linear equations about the equilibrium, or along a deployment."),
    ] = False,
    no_pictures: Annotated[bool, typer.Option("--no-pictures", help="Draw none of the pictures of the case.")] = False,
    verbose: Verbose = False,
) -> None:
    """Simulate a case: mesh to modes to motion to HDF5, with the pictures and the \\[campbell] of the case.

    Exit code 2: the case cannot be run; 3: the numerics failed, 130: interrupted, with what was computed kept.
    """
    from femflex import pipeline
    from femflex.advice.advice import warn_of
    from femflex.case import read_case
    from femflex.results import FileLock, open_run
    from femflex.studies.linear.closed_loop import growing_loops

    began, output, omitted = time.perf_counter(), output or Path(f"{case.stem}.h5"), split_names(without or ())
    with ExitStack() as stack:
        with Patience("reading the case") as say:
            parsed_case = read_case(case)
            if resume and pipeline.is_finished(parsed_case, output):
                print(f"done        {output} is complete already; there is nothing to resume (--force runs it anew)")
                return
            if not resume:
                pipeline.check_output(parsed_case, output, force=force, resume=False)
            if not no_pictures:
                check_pictures(parsed_case, output, force=force)
            lock = stack.enter_context(FileLock(output))
            say("building bodies and reading the compiled equations of motion")
            prepared = pipeline.prepare(
                parsed_case, output, force=force, resume=resume, without=omitted, linearised=linearised
            )
            if not no_pictures:
                check_left_out(prepared)
            prepared.load_kernels()
            if not resume:
                warn_of(growing_loops(prepared.system, float(prepared.times[-1])))
        print_run_heading(prepared, verbose)
        _integrate(prepared, output, force, resume, lock)
    with open_run(output) as done:
        print_run_summary(done, prepared.system, output)
        failed_names = [] if linearised else print_verdicts(parsed_case, done)
        if not no_pictures:
            draw_pictures(prepared, done, output, force)
    if parsed_case.campbell is not None and not (no_pictures or omitted or linearised):
        from femflex.cli.campbell import write_diagram_files

        failed_names += write_diagram_files(parsed_case, output, force)
    failed_names += [] if omitted or linearised else print_modes_verdicts(parsed_case)
    print(f"elapsed     {time.perf_counter() - began:.1f} s")
    if failed_names:
        print_error(
            f"warning: the run is complete, but these expected values of the case do not hold: "
            f"{', '.join(failed_names)}. Check the model, or correct [expect]"
        )


def _integrate(prepared: Prepared, output: Path, force: bool, resume: bool, lock: FileLock) -> None:
    """Integrate to the end with a progress bar; after Ctrl-C, the error says what the output keeps."""
    from femflex import pipeline

    earlier = None if resume else _file_identity(output)
    with Bar("integrating", float(prepared.times[-1])) as bar:
        try:
            pipeline.integrate(prepared, output, force=force, resume=resume, progress=bar, lock=lock)
        except KeyboardInterrupt:
            raise KeyboardInterrupt(_interrupt_text(output, earlier)) from None


def _file_identity(path: Path) -> tuple[int, int, int] | None:
    """Return numbers that tell a file from one that replaces it; None if there is no file."""
    if not path.exists():
        return None
    status = path.stat()
    return status.st_ino, status.st_size, status.st_mtime_ns


def _interrupt_text(output: Path, earlier: tuple[int, int, int] | None) -> str:
    """Describe what an interrupted run keeps, and how it goes on.

    earlier: the file of another run that was there before, if this one was to overwrite it.
    """
    from femflex.results import open_run

    if not output.exists():
        return "interrupted before the first row"
    if earlier is not None and _file_identity(output) == earlier:
        return f"interrupted before the first row; {output} is still that of an earlier run"
    with open_run(output) as run:
        return f"interrupted; {output} keeps {len(run)} rows, to {run.time[-1]:.6g} s, and --resume goes on from there"


def draw_pictures(prepared: Prepared, run: Run, output: Path, force: bool) -> None:
    """Draw the pictures of the case; if they cannot be drawn here, say so and keep the run."""
    from femflex.cli.pictures import draw_pictures
    from femflex.extras import MissingExtra, require
    from femflex.view import NoRenderer

    case = prepared.case
    if case.pictures is None:
        return
    try:
        require("view", "pictures")
        with second_run(case, output, force) if not (run.without or run.linearised) else nullcontext() as second:
            for path in draw_pictures(
                case.pictures, run, prepared.system.bodies, output, force=force, second_run=second
            ):
                print(f"picture     {path}")
    except (MissingExtra, NoRenderer) as error:
        print_error(f"{error}; the run is kept in {output}")


def check_pictures(case: Case, output: Path, force: bool) -> None:
    """Raise FileExistsError if a picture of the case exists already, unless force."""
    from femflex.cli.pictures import picture_paths

    if force:
        return
    picture_files = [] if case.pictures is None else picture_paths(case.pictures, output)
    if (second := second_output(case, output)) is not None:
        picture_files.append(second)
    if case.campbell is not None:
        from femflex.cli.campbell import diagram_paths

        picture_files += diagram_paths(output).values()
    existing = [str(path) for path in picture_files if path.exists()]
    if existing:
        raise FileExistsError(
            f"{', '.join(existing)} exist{'s' * (len(existing) == 1)}; choose another --output, --no-pictures, or "
            f"force to overwrite"
        )
