"""One member of a sweep: a case with other values, run in memory, and its results."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from femflex.arrays import Array
from femflex.case import Case, CaseError, with_values
from femflex.case.evaluate import column_unit, measured_unit, measured_value
from femflex.case.measure import OF_SYSTEM, MeasureTable
from femflex.case.read import parse_case
from femflex.case.sweep import SweepTable, parse_sweep
from femflex.integrate import IntegrationError
from femflex.noun.problems import suggestion_text
from femflex.pipeline import prepare
from femflex.pipeline.case_equilibrium import case_modes
from femflex.pipeline.decisions import resolve_choices
from femflex.pipeline.guard import MotionGuard
from femflex.studies.varied_case import VariedCase
from femflex.system import Channel, Part
from femflex.warning import PhysicsWarning

if TYPE_CHECKING:
    from threadpoolctl import ThreadpoolController


@dataclass(frozen=True)
class Plan:
    """Data that a worker receives once: texts of sweep and case, path of the case, digests of the files of the case."""

    sweep_text: str
    case_text: str
    case_path: str
    files: str = ""


@dataclass(frozen=True)
class Outcome:
    """Results of a member: outputs, histories over time, units of both, or the problem that ended it."""

    number: int
    outputs: list[float]
    units: list[str]
    time: list[float]
    histories: list[list[float]]
    problem: str = ""


@dataclass(frozen=True, eq=False)
class RecordedRun:
    """Channels of a run in memory, as `measured_value` needs them."""

    time: Array
    values: Mapping[str, Array]
    channels: Mapping[str, Channel]
    bodies_by_name: Mapping[str, Any]

    def __getitem__(self, path: str) -> Array:
        return self.values[path]

    def names(self, path: str) -> tuple[str, ...]:
        """Names of the entries of a channel."""
        return self.channels[path].names

    def unit(self, path: str) -> str:
        """Unit of a channel."""
        return self.channels[path].unit

    def bodies(self) -> Mapping[str, Any]:
        """The bodies by name."""
        return self.bodies_by_name


@lru_cache(maxsize=4)
def shared_base(plan: Plan) -> tuple[VariedCase, SweepTable]:
    """Data that all members share, built once in every process."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", PhysicsWarning)
        table = parse_sweep(plan.sweep_text)
        return VariedCase.from_paths(parse_case(plan.case_text, Path(plan.case_path)), table.vary), table


@lru_cache(maxsize=1)
def _threads() -> ThreadpoolController:
    """The thread pools of this process, searched once."""
    from threadpoolctl import ThreadpoolController

    return ThreadpoolController()


def run_member(plan: Plan, number: int, values: Mapping[str, Any]) -> Outcome:
    """The outcome of a member; an error in it becomes its problem and is not raised."""
    with warnings.catch_warnings(), _threads().limit(limits=1):
        warnings.simplefilter("ignore", PhysicsWarning)
        try:
            return _outcome(*shared_base(plan), number, values)
        except (CaseError, ValueError, KeyError, IntegrationError, ArithmeticError, np.linalg.LinAlgError) as error:
            text = str(error.args[0]) if isinstance(error, KeyError) and error.args else str(error)
            return Outcome(number, [], [], [], [], " ".join(text.split()) or type(error).__name__)


def _outcome(base: VariedCase, table: SweepTable, number: int, values: Mapping[str, Any]) -> Outcome:
    case = with_values(base.case, values)
    bodies = base.bodies_of(case)
    paths = [table_entry.channel for table_entry in table.outputs.values() if table_entry.channel is not None]
    history_paths = [text.partition(":")[0] for text in table.histories]
    run, motion = _recorded_run(case, bodies, list(dict.fromkeys([*paths, *history_paths])))
    modes = (
        case_modes(case, bodies=bodies)
        if any(table_entry.of == OF_SYSTEM for table_entry in table.outputs.values())
        else None
    )
    outputs, units = [], []
    for table_entry in table.outputs.values():
        if table_entry.of == OF_SYSTEM and modes is not None:
            outputs.append(float(modes.frequency(table_entry.branch or table_entry.mode)))
            units.append("Hz")
        else:
            outputs.append(measured_value(table_entry, run, motion))
            units.append(measured_unit(table_entry, run))
    histories = [history(run, text) for text in table.histories]
    units += [column_unit(_column(text), run) for text in table.histories]
    return Outcome(number, outputs, units, run.time.tolist() if histories else [], [h.tolist() for h in histories])


def _recorded_run(case: Case, bodies: Mapping[str, Part] | None, paths: list[str]) -> tuple[RecordedRun, float | None]:
    """The channels of the run of a case, and its mean motion; nothing is run if no channel is requested."""
    if not paths:
        parts: Mapping[str, Any] = resolve_choices(case, bodies, loaded=False).system.bodies
        return RecordedRun(np.zeros(0), {}, {}, parts), None
    prepared = prepare(case, bodies=bodies)
    model, times = prepared.model, prepared.times
    for path in paths:
        if path not in model.channels:
            raise KeyError(f"the run has no channel {path!r}; {suggestion_text(path, model.channels)}")
    rows: dict[str, list[Array]] = {path: [] for path in paths}
    guard = MotionGuard(model)
    for block in prepared.integrator.blocks(model, times, model.x0):
        if (error := guard.divergence(block)) is not None:
            raise error
        if len(block.times):
            channels = model.observe(block.times, block.states)
            for path in paths:
                rows[path].append(channels[path])
    motion = None if prepared.system.orbit is None else prepared.system.orbit.mean_motion
    values = {path: np.concatenate(parts) for path, parts in rows.items()}
    return RecordedRun(times, values, model.channels, prepared.system.bodies), motion


def _column(text: str) -> MeasureTable:
    """Table of the channel of a history."""
    path, _, component = text.partition(":")
    return MeasureTable(channel=path, component=component) if component else MeasureTable(channel=path)


def history(run: RecordedRun, text: str) -> Array:
    """One component of a channel over time (n_t,), in its unit. Raises ValueError where it is not named."""
    path, _, component = text.partition(":")
    names = run.names(path)
    values = run[path]
    if not component and values.ndim > 1:
        raise ValueError(
            f"history {text!r} is that of a vector; name one of {', '.join(names)}, as in '{path}:{names[0]}'"
        )
    if not component:
        return values
    if component not in names:
        measured_value(_column(text), run)  # raises the error with the known names
    return np.asarray(values[:, names.index(component)])
