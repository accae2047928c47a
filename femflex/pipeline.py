"""From a case to its result file: case, bodies, system, compiled model, integrator and writer joined."""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from femflex.body import FlexibleBody
    from femflex.case import Case
    from femflex.dynamics import Model
    from femflex.integrate import Block, IntegrationError, Integrator
    from femflex.results import Run, RunWriter
    from femflex.system import System

Progress = Callable[[float], object]  # called with the time reached [s]


@dataclass(frozen=True, eq=False)
class Prepared:
    """Everything of a run before its first step."""

    case: Case
    system: System
    model: Model
    integrator: Integrator
    reason: str
    times: NDArray[Any]


def run(
    case: Case | str | Path,
    output: str | Path = "run.h5",
    *,
    force: bool = False,
    resume: bool = False,
    progress: Progress | None = None,
) -> Run:
    """The finished run of a case, written to an HDF5 file as it goes and open for reading.

    resume: go on with the unfinished run in `output`; the answer is that of an uninterrupted one, bit for bit.
    Raises CaseError for a case that cannot be run, FileExistsError for an existing output unless `force`, and
    IntegrationError when the numerics fail; the file then keeps what was computed and says so.
    """
    from femflex.results import open_run

    prepared = prepare(case, output, force=force, resume=resume)
    integrate(prepared, output, force=force, resume=resume, progress=progress)
    return open_run(output)


def prepare(
    case: Case | str | Path,
    output: str | Path = "run.h5",
    *,
    force: bool = False,
    resume: bool = False,
    bodies: Mapping[str, FlexibleBody] | None = None,
) -> Prepared:
    """System, compiled model and integrator of a case, with these bodies or with its own; nothing is written.

    Raises as `run` does for what can be told before the first step.
    """
    from femflex.case import Case, read_case
    from femflex.case.build import build_system
    from femflex.case.build.integrator import chosen_integrator
    from femflex.case.build.references import duration_of
    from femflex.dynamics import compile_system

    case = case if isinstance(case, Case) else read_case(case)
    check_output(case, Path(output), force, resume)
    system = build_system(case, bodies)
    model = compile_system(system)
    times = case.run.times(duration_of(case, system))
    choice = chosen_integrator(case, model, times)
    return Prepared(case, system, model, choice.integrator, choice.reason, times)


def integrate(
    prepared: Prepared, output: str | Path, *, force: bool = False, resume: bool = False, progress: Progress | None = None
) -> None:
    """Run to the end, block by block into the file. See `run`."""
    from femflex.integrate import IntegrationError

    model = prepared.model
    with _writer(prepared, Path(output), force, resume) as (writer, state):
        last, written = None, -1.0
        try:
            for last in prepared.integrator.blocks(model, prepared.times, model.x0, state):
                if len(last.times):
                    _write(writer, model, last)
                    written = float(last.times[-1])
                if progress is not None:
                    progress(last.t)
        except IntegrationError as error:
            raise _kept(error, writer, model, written) from None
        writer.finish(True, "reached the end", _statistics(last))


@contextmanager
def undisturbed() -> Iterator[None]:
    """Hold Ctrl-C back until what is inside is done."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    pending: list[int] = []
    before = signal.signal(signal.SIGINT, lambda number, _: pending.append(number))
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)
    if pending:
        raise KeyboardInterrupt


def _write(writer: RunWriter, model: Model, block: Block) -> None:
    with undisturbed():
        writer.write_block(block.times, model.observe(block.times, block.states), block.resume)


@contextmanager
def _writer(prepared: Prepared, output: Path, force: bool, resume: bool) -> Iterator[tuple[RunWriter, Any]]:
    """The writer of a new file, or of one to go on with, and the integrator's state there."""
    from femflex.results import RunWriter, resume_point

    if resume:
        state = resume_point(output).state
        with RunWriter.resumed(output) as writer:
            yield writer, state
        return
    case, model = prepared.case, prepared.model
    attributes = {
        "title": case.title,
        "case_text": case.text,
        "case_path": str(case.path),
        "integrator": prepared.integrator.name,
        "frame": f"N inertial; attitude from the {prepared.system.frame.kind} frame",
    }
    rows = len(prepared.times)
    with RunWriter(output, model.channels, prepared.system.bodies, attributes, rows=rows, force=force) as writer:
        yield writer, None


def check_output(case: Case, output: Path, force: bool, resume: bool) -> None:
    from femflex.results import open_run
    from femflex.results.place import check_place

    if not resume:
        check_place(output, force)
        return
    with open_run(output) as unfinished:
        if unfinished.complete:
            raise ValueError(f"{output} is complete; there is nothing to resume")
        if unfinished.case_text != case.text:
            raise ValueError(f"{output} was begun with another text of the case; resume it with that one, or start anew")


def _kept(error: IntegrationError, writer: RunWriter, model: Model, written: float) -> IntegrationError:
    """The error with the body and coordinate that failed in its text; the last finite state goes into the file."""
    names = [name for name, _ in (*model.system.coordinate_names(), *model.system.velocity_names())]
    text = f"the run stopped at t = {error.t:.9g} s in {names[error.coordinate]}: {error}"
    if error.t > written:
        writer.write_block(error.times[-1:], model.observe(error.times[-1:], error.states[-1:]))
    writer.finish(False, text, _statistics(error))
    told = f"{text} {writer.path} keeps what was computed and is marked incomplete."
    return type(error)(told, error.times, error.states, error.coordinate, error.steps)


def _statistics(of: Block | IntegrationError | None) -> dict[str, Any]:
    return {} if of is None else {key: value for key, value in vars(of.steps).items() if key != "ended"}
