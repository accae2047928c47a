"""Members of a sweep: their values, and the results of each, a case with these values run in memory."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from itertools import product
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from femflex.arrays import Array
from femflex.case import CaseError, with_values
from femflex.case.read import parse_case
from femflex.case.sweep import SweepTable, parse_sweep
from femflex.integrate import IntegrationError
from femflex.measures.evaluate import column_unit, measured_unit, measured_value
from femflex.measures.measure import OF_JITTER, OF_SYSTEM, MeasureTable
from femflex.pipeline.case_equilibrium import case_modes
from femflex.pipeline.decisions import resolve_choices
from femflex.studies.jitter import jitter
from femflex.studies.study import RecordedRun, recorded_run
from femflex.studies.varied_case import VariedCase
from femflex.warning import PhysicsWarning

if TYPE_CHECKING:
    from threadpoolctl import ThreadpoolController


EDGE = 1e-12  # a unit sample is kept this far from 0 and 1, where a normal scatter has no end


def member_values(table: SweepTable) -> list[dict[str, Any]]:
    """Key path -> value in the form of a case file, for every member.

    A Sobol sequence is scrambled by the seed, and best with a power of 2 members. For Sobol indices the members are two
    independent samples A and B, and A with one column after the other from B.
    """
    columns: list[list[Any]] = []
    if table.design in ("grid", "list"):
        columns = [entry.values or [] for entry in table.vary.values()]
        rows = product(*columns) if table.design == "grid" else zip(*columns, strict=True)
        return [dict(zip(table.vary, row, strict=True)) for row in rows]
    from scipy.special import ndtri

    for unit, table_entry in zip(unit_samples(table).T, table.vary.values(), strict=True):
        lower, upper, word = table_entry.numbers()
        values = lower + (upper - lower) * unit if table_entry.between else lower + upper * ndtri(unit)
        columns.append([f"{value!r} {word}" if word else value for value in values.tolist()])
    return [dict(zip(table.vary, row, strict=True)) for row in zip(*columns, strict=True)]


def unit_samples(table: SweepTable) -> Array:
    """Samples (runs, n) [1] between 0 and 1."""
    from scipy.stats import qmc

    n, k = table.members or 0, len(table.vary)
    if table.design == "random":
        samples = np.random.default_rng(table.seed).random((n, k))
    elif table.design == "latin_hypercube":
        samples = qmc.LatinHypercube(k, seed=np.random.default_rng(table.seed)).random(n)
    elif table.design == "sobol_indices":
        pairs = qmc.Sobol(2 * k, seed=np.random.default_rng(table.seed)).random_base2(n.bit_length() - 1)
        A, B = pairs[:, :k], pairs[:, k:]
        mixed = [np.where(np.arange(k) == j, B, A) for j in range(k)]
        samples = np.concatenate([A, B, *mixed])
    else:
        sequence = qmc.Sobol(k, seed=np.random.default_rng(table.seed))
        samples = sequence.random_base2(max(0, (n - 1).bit_length()))[:n]
    return np.clip(np.asarray(samples, float), EDGE, 1.0 - EDGE)


def sobol_indices_of(table: SweepTable, values: Array) -> Array:
    """First-order and total Sobol indices (n, 2) of an output (runs,) of a design for them; NaN where a run failed.

    Those of scipy.stats.sobol_indices, estimated by Saltelli's and Jansen's formulas.
    """
    from scipy.stats import sobol_indices

    n, k = table.members or 0, len(table.vary)
    if not np.isfinite(values).all() or np.ptp(values) == 0.0:
        return np.full((k, 2), np.nan)
    blocks = values.reshape(k + 2, n)
    evaluations: Any = {"f_A": blocks[0][None], "f_B": blocks[1][None], "f_AB": blocks[2:][:, None]}
    result = sobol_indices(func=evaluations, n=n)
    return np.column_stack([np.ravel(result.first_order), np.ravel(result.total_order)])


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
    paths = [entry.channel for entry in table.outputs.values() if entry.channel is not None]
    paths = list(dict.fromkeys([*paths, *(text.partition(":")[0] for text in table.histories)]))
    if paths:
        run = recorded_run(case, bodies, paths)
    else:
        run = RecordedRun(resolve_choices(case, bodies, loaded=False).system.bodies)
    kinds = {entry.of for entry in table.outputs.values()}
    modes = case_modes(case, bodies=bodies) if OF_SYSTEM in kinds else None
    budget = jitter(case, bodies) if OF_JITTER in kinds else None
    outputs, units = [], []
    for entry in table.outputs.values():
        if entry.of == OF_SYSTEM and modes is not None:
            outputs.append(float(modes.frequency(entry.branch or entry.mode)))
            units.append("Hz")
        elif entry.of == OF_JITTER and budget is not None:
            rms, unit = budget.rms_of(str(entry.output))
            outputs.append(rms)
            units.append(unit)
        else:
            outputs.append(measured_value(entry, run, run.mean_motion))
            units.append(measured_unit(entry, run))
    histories = [history(run, text) for text in table.histories]
    units += [column_unit(_column(text), run) for text in table.histories]
    return Outcome(number, outputs, units, run.time.tolist() if histories else [], [h.tolist() for h in histories])


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
