"""The run itself: block after block from the integrator into the result file."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from femflex.advice.deployed import SlackWatch
from femflex.advice.deployed_bending import AxialForceWatch
from femflex.advice.energy_watch import EnergyWatch
from femflex.advice.spun_bends import SpunBends
from femflex.advice.stiffening import StiffeningWatch
from femflex.advice.tension import TensionWatch
from femflex.pipeline.guard import MotionGuard, Singularities, first_overflow, warn_of_passage

if TYPE_CHECKING:
    from femflex.dynamics import Model
    from femflex.integrate import Block, IntegrationError
    from femflex.pipeline.prepared import Prepared
    from femflex.pipeline.recovered import Recovered
    from femflex.results import FileLock, RunWriter

MOST_MOVED = 200  # initial values that a file's attributes have room for

Progress = Callable[[float], object]  # called with the time reached [s]


def integrate(
    prepared: Prepared,
    output: str | Path,
    *,
    force: bool = False,
    resume: bool = False,
    progress: Progress | None = None,
    lock: FileLock | None = None,
) -> None:
    """Run to the end, block by block into the file. See `femflex.run`.

    lock: of the output, when the caller has taken it already; it is released at the end
    """
    from femflex.integrate import IntegrationError
    from femflex.results.interrupts import without_interrupts

    model, known = prepared.model.for_run(), prepared.decided.known
    guard, singularities = MotionGuard(model, known, prepared.decided.notes), Singularities(model)
    stiffening, tension = StiffeningWatch(model, known), TensionWatch(model, known)
    slack, axial, bends = SlackWatch(model), AxialForceWatch(model), SpunBends(model)
    energy = EnergyWatch(model)
    if model.constraints is not None:
        model.constraints.reset_passage_notes()
    stresses = prepared.recovered
    with _writer(prepared, Path(output), force, resume, lock) as (writer, state, written):
        last = None
        try:
            for last in prepared.integrator.blocks(model, prepared.times, model.x0, state):
                error = guard.divergence(last)
                times = last.times if error is None else last.times[last.times <= error.t]
                if len(times):
                    seen = model.observe(times, last.states[: len(times)])
                    overflow = first_overflow(seen, last)
                    if overflow is not None:
                        error = error or overflow
                        count = int(np.searchsorted(times, overflow.t))
                        times, seen = times[:count], {path: value[:count] for path, value in seen.items()}
                if len(times):
                    after = last.resume if error is None else None  # a failed run cannot go on
                    writer.make_room(len(times), after)
                    with without_interrupts():
                        writer.write_block(times, seen | stresses.values(seen), after)
                    singularities.watch(times, seen)
                    stiffening.watch(seen)
                    tension.watch(times, seen)
                    slack.watch(times, seen)
                    axial.watch(times, seen)
                    bends.watch(last.states[: len(times)], seen)
                    energy.watch(seen)
                    written = float(times[-1])
                if error is not None:
                    raise error
                if progress is not None:
                    progress(last.t)
        except IntegrationError as failed:
            if seen := _seen(failed, model):
                singularities.watch(failed.times[-1:], seen)
                if all(np.isfinite(value).all() for value in seen.values()):
                    stiffening.watch(seen)
            singularities.warn()
            stiffening.warn()  # what linear strain leaves out is the first cause of a motion that runs away
            raise _kept(failed, writer, model, written, stresses) from failed.__cause__
        writer.finish(True, "reached the end", _statistics(last))
    guard.warn()
    singularities.warn()
    warn_of_passage(model)
    stiffening.warn()
    tension.warn()
    slack.warn()
    axial.warn()
    bends.warn()
    energy.warn()


@contextmanager
def _writer(
    prepared: Prepared, output: Path, force: bool, resume: bool, lock: FileLock | None
) -> Iterator[tuple[RunWriter, Any, float]]:
    """The writer of a new file or of one to go on with, the integrator's state there, and the time of the last row."""
    from femflex.results import FileLock, RunWriter, resume_point

    if resume:
        with lock or FileLock(output) as own:
            point = resume_point(output)
            with RunWriter.resumed(output, rows=len(prepared.times), lock=own) as writer:
                yield writer, point.state, point.time
        return
    rows, bodies = len(prepared.times), prepared.system.bodies
    channels = prepared.model.channels | prepared.recovered.channels
    with RunWriter(output, channels, bodies, _attributes(prepared), rows=rows, force=force, lock=lock) as writer:
        yield writer, None, -1.0


def _attributes(prepared: Prepared) -> dict[str, str]:
    """Attributes of the result file: what was run, and how."""
    from femflex.advice.advice import advice_text
    from femflex.pipeline.inputs import inputs_text
    from femflex.pipeline.prepared import sampling

    case, model = prepared.case, prepared.model
    return {
        "title": case.title,
        "case_text": case.text,
        "case_path": str(case.path),
        "inputs": inputs_text(case),
        "without": ", ".join(model.omitted),
        "varying": ", ".join(sorted(prepared.system.varying)),
        "start_moved": ", ".join(map(str, prepared.moved[:MOST_MOVED])),
        "start_taken_up": "; ".join(map(str, prepared.taken_up)),
        "integrator": prepared.integrator.name,
        "advice": advice_text(prepared.decided.advice),
        "effectors": ", ".join(prepared.given),
        "sampled": " ".join(sampling(prepared.system)),
        "frame": f"N inertial; attitude from the {prepared.system.frame.kind} frame",
    }


def _kept(
    error: IntegrationError, writer: RunWriter, model: Model, written: float, stresses: Recovered
) -> IntegrationError:
    """The error with the body and coordinate that failed in its text; the last finite state goes into the file."""
    names = [name for name, _ in model.system.all_state_names()]
    where = f" in {names[error.coordinate]}" if error.coordinate >= 0 else ""
    text = f"the run stopped at t = {error.t:.9g} s{where}: {error.reason}"
    seen = _seen(error, model)
    if seen and error.t > written and all(np.isfinite(value).all() for value in seen.values()):
        writer.write_block(error.times[-1:], seen | stresses.values(seen))
    writer.finish(False, text, _statistics(error))
    kept = f"{writer.path} keeps what was computed and is marked incomplete."
    found_text = f"{text} {kept if writer.rows else 'Nothing was computed before that could be kept.'}"
    return type(error)(found_text, error.times, error.states, error.coordinate, error.steps, error.reason)


def _seen(error: IntegrationError, model: Model) -> dict[str, Any]:
    """The channels of the last finite state; nothing where a function of the user fails there."""
    try:
        return model.observe(error.times[-1:], error.states[-1:])
    except Exception:
        if error.__cause__ is None:
            raise
        return {}


def _statistics(of: Block | IntegrationError | None) -> dict[str, Any]:
    return {} if of is None else {key: value for key, value in vars(of.steps).items() if key != "ended"}
