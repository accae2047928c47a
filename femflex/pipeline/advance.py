"""The time integration of a run: blocks from the integrator are written into the result file."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from femflex.advice.advice import advice_text, warn_of
from femflex.advice.limits import FULL_THRUST
from femflex.advice.watches import EnergyWatch, Watches
from femflex.arrays import Array
from femflex.pipeline.guard import MotionGuard, Singularities, first_fault, warn_of_passage
from femflex.system import Effector
from femflex.warning import PhysicsWarning

if TYPE_CHECKING:
    from femflex.dynamics import Model
    from femflex.integrate import Block, IntegrationError
    from femflex.pipeline.prepared import Prepared
    from femflex.pipeline.recovery_channels import RecoveryChannels
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
    """Integrate a prepared run to its end and write it block by block into the result file. See `femflex.run`.

    lock: of the output, when the caller has taken it already; it is released at the end
    """
    from femflex.integrate import IntegrationError
    from femflex.results.interrupts import without_interrupts

    model, resolved = prepared.model.for_run(), prepared.resolved
    watches = Watches(model, resolved.body_origins, resolved.notes)
    guard, singularities = MotionGuard(model), Singularities(model)
    energy, levels = EnergyWatch(model), ThrusterLevels(model)
    if model.constraints is not None:
        model.constraints.reset_passage_notes()
    stresses = prepared.recovery
    with _writer(prepared, Path(output), force, resume, lock) as (writer, state, written):
        last = None
        try:
            for last in prepared.integrator.blocks(model, prepared.times, model.x0, state):
                error = guard.divergence(last)
                times = last.times if error is None else last.times[last.times <= error.t]
                if len(times):
                    channels = model.observe(times, last.states[: len(times)])
                    overflow = first_fault(model, channels, last)
                    if overflow is not None:
                        error = error or overflow
                        count = int(np.searchsorted(times, overflow.t))
                        times, channels = times[:count], {path: value[:count] for path, value in channels.items()}
                if len(times):
                    after = last.resume if error is None else None  # a failed run cannot go on
                    writer.make_room(len(times), after)
                    with without_interrupts():
                        writer.write_block(times, channels | stresses.values(channels), after)
                    singularities.watch(times, channels)
                    watches.watch(times, last.states[: len(times)], channels)
                    energy.watch(channels)
                    levels.watch(times, channels)
                    written = float(times[-1])
                if error is not None:
                    raise error
                if progress is not None:
                    progress(last.t)
        except IntegrationError as failed:
            if channels := _last_channels(failed, model):
                singularities.watch(failed.times[-1:], channels)
                if all(np.isfinite(value).all() for value in channels.values()):
                    watches.watch(failed.times[-1:], failed.states[-1:], channels)
            singularities.warn()
            stretched = [entry for entry in watches.doubts() if entry.decision == "stretch"]
            warn_of(stretched)  # the stiffness that linear strain leaves out is the most frequent cause of divergence
            raise _failure_in_file(failed, writer, model, written, stresses) from failed.__cause__
        doubts = watches.doubts()
        writer.finish(True, "reached the end", _statistics(last), advice_text(doubts))
    warn_of(doubts)
    singularities.warn()
    warn_of_passage(model)
    levels.warn()
    energy.warn()


@contextmanager
def _writer(
    prepared: Prepared, output: Path, force: bool, resume: bool, lock: FileLock | None
) -> Iterator[tuple[RunWriter, Any, float]]:
    """The writer of a new or resumed file, the integrator's state at its end, and the time of its last row."""
    from femflex.results import FileLock, RunWriter, resume_point

    if resume:
        with lock or FileLock(output) as held_lock:
            point = resume_point(output)
            with RunWriter.resumed(output, rows=len(prepared.times), lock=held_lock) as writer:
                yield writer, point.state, point.time
        return
    rows, bodies = len(prepared.times), prepared.system.bodies
    channels = prepared.model.channels | prepared.recovery.channels
    with RunWriter(output, channels, bodies, _attributes(prepared), rows=rows, force=force, lock=lock) as writer:
        yield writer, None, -1.0


def _attributes(prepared: Prepared) -> dict[str, str]:
    """Attributes of the result file: what was run, and how."""
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
        "start_moved": ", ".join(map(str, prepared.corrections[:MOST_MOVED])),
        "start_taken_up": "; ".join(map(str, prepared.absorbed_misfits)),
        "integrator": prepared.integrator.name,
        "advice": advice_text(prepared.resolved.advice),
        "effectors": ", ".join(prepared.added_effectors),
        "sampled": " ".join(sampling(prepared.system)),
        "frame": f"N inertial; attitude from the {prepared.system.frame.kind} frame",
    }


def _failure_in_file(
    error: IntegrationError, writer: RunWriter, model: Model, written: float, stresses: RecoveryChannels
) -> IntegrationError:
    """Write the last finite state and the failure into the file; return the error with the coordinate that failed."""
    names = [name for name, _ in model.system.all_state_names()]
    where = f" in {names[error.coordinate]}" if error.coordinate >= 0 else ""
    text = f"the run stopped at t = {error.t:.9g} s{where}: {error.reason}"
    channels = _last_channels(error, model)
    if channels and error.t > written and all(np.isfinite(value).all() for value in channels.values()):
        writer.write_block(error.times[-1:], channels | stresses.values(channels))
    writer.finish(False, text, _statistics(error))
    kept_text = f"{writer.path} keeps what was computed and is marked incomplete."
    reason = f"{text} {kept_text if writer.rows else 'Nothing was computed before that could be kept.'}"
    return type(error)(reason, error.times, error.states, error.coordinate, error.steps, error.reason)


def _last_channels(error: IntegrationError, model: Model) -> dict[str, Any]:
    """The channels of the last finite state; empty where a user's function fails there."""
    try:
        return model.observe(error.times[-1:], error.states[-1:])
    except Exception:
        if error.__cause__ is None:
            raise
        return {}


def _statistics(outcome: Block | IntegrationError | None) -> dict[str, Any]:
    return {} if outcome is None else {key: value for key, value in vars(outcome.steps).items() if key != "ended"}


class ThrusterLevels:
    """Watches the signals that command thrusters, and warns of those above full thrust, and if none ever fired.

    Commands below zero are usual: of two opposite thrusters, one does not fire.
    """

    def __init__(self, model: Model) -> None:
        thrusters = [e for e in model.system.effectors if isinstance(e, Effector) and e.kind == "thruster"]
        signals = {e.name: e.inputs[0].split(".") for e in thrusters if e.inputs and not e.inputs[0].endswith(".feed")}
        self._paths = {name: f"effectors/{owner}/{output}" for name, (owner, output) in signals.items()}
        self._largest = {name: (-np.inf, 0.0) for name, path in self._paths.items() if path in model.channels}

    def watch(self, times: Array, channels: Mapping[str, Array]) -> None:
        """Record the largest level of each thruster over a block of times (n_t,) [s]."""
        for name, before in self._largest.items():
            levels = channels[self._paths[name]]
            k = int(np.argmax(levels))
            self._largest[name] = max(before, (float(levels[k]), float(times[k])))

    def warn(self) -> None:
        """Warn of thrusters whose level was cut off at full thrust, and of all thrusters if none of them fired."""
        silent = all(level <= 0.0 for level, _ in self._largest.values())
        for name, (level, t) in self._largest.items():
            signal = ".".join(self._paths[name].split("/")[1:])
            if level > FULL_THRUST:
                text = f"rose to {level:.4g} at t = {t:.4g} s, above 1, where it is cut off: full thrust is 1"
            elif silent:
                text = f"was never above 0 (at most {level:.4g}), so it never fired"
            else:
                continue
            warnings.warn(PhysicsWarning(f"thruster {name!r}: its command {signal} {text}"), stacklevel=2)
