"""A sweep from its file to its results: values, outputs, histories and percentiles in one HDF5 file."""

from __future__ import annotations

import json
import os
from collections.abc import Callable
from dataclasses import dataclass, field
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np

from femflex.arrays import Array
from femflex.case import Case, CaseError, read_case, with_values
from femflex.case.changed import written_keys
from femflex.case.problems import Problem
from femflex.case.read import parse_case
from femflex.case.sweep import SweepTable, read_sweep, split_number
from femflex.case.units import UnitError
from femflex.hdf5 import placed_hdf5
from femflex.pipeline.file_digests import file_digests
from femflex.results import FileLock
from femflex.studies.sweep.design import designed, indices
from femflex.studies.sweep.journal import add, begin, counted, digest, journal_of, read_journal, refuse_other
from femflex.studies.sweep.member import Outcome, Plan, run_member
from femflex.studies.sweep.workers import Todo, outcomes
from femflex.writing import check_destination

Progress = Callable[[float], object]  # called with the number of members done


@dataclass(frozen=True, eq=False)
class Sweep:
    """The results of a sweep of n members.

    inputs       key path -> (n,) values in their units, NaN for words
    outputs      name -> (n,) NaN where a member failed
    units        key path, name or history -> unit
    time         (n_t,) [s];  histories  channel -> (n, n_t)
    percentiles  (n_p,);  problems (n,) what broke a member off, "" where nothing did
    sobol        name of an output -> (n_inputs, 2) first-order and total indices; empty for other designs
    """

    inputs: dict[str, Array]
    outputs: dict[str, Array]
    units: dict[str, str]
    time: Array
    histories: dict[str, Array]
    percentiles: Array
    problems: tuple[str, ...]
    sobol: dict[str, Array] = field(default_factory=dict)

    def of_outputs(self) -> dict[str, Array]:
        """Percentiles (n_p,) of every output, in its unit, over the members that did not fail."""
        return {name: _percentiles(values[:, None], self.percentiles)[:, 0] for name, values in self.outputs.items()}

    def statistics(self) -> dict[str, tuple[float, float, int, int]]:
        """Of every output: mean, standard deviation, and the members with the least and the largest value; over the
        members that did not fail."""
        out = {}
        for name, values in self.outputs.items():
            if good := np.isfinite(values).sum():
                sigma = float(np.nanstd(values, ddof=1)) if good > 1 else 0.0
                out[name] = float(np.nanmean(values)), sigma, int(np.nanargmin(values)), int(np.nanargmax(values))
        return out

    def of_histories(self) -> dict[str, Array]:
        """Percentiles (n_p, n_t) of every history, in its unit."""
        return {name: _percentiles(values, self.percentiles) for name, values in self.histories.items()}


def sweep(
    path: str | Path,
    output: str | Path,
    *,
    force: bool = False,
    resume: bool = False,
    workers: int | None = None,
    scheduler: str | None = None,
    progress: Progress | None = None,
) -> Sweep:
    """The finished sweep of a file, also written to an HDF5 file.

    workers    processes; left out, one per core. The numbers do not depend on it
    resume     go on with a sweep that was interrupted or killed; members that are done are not run again
    scheduler  address of a Dask scheduler, in place of processes
    progress   called with the number of members done

    Where no table of materials, sections or flexible bodies varies, bodies are built once, with the strain and the
    shapes that the unchanged case chooses; else every member is built as its own case says. A member that fails is kept
    with its problem. Raises CaseError for a sweep or a case with mistakes and for a key path that is not in the case,
    FileExistsError for an existing output unless `force`, OSError for a full disk, ValueError when every member fails.
    """
    output = Path(output)
    table, plan = planned(path)
    check_destination(output, force or resume)
    members = designed(table)
    _check_keys(parse_case(plan.case_text, Path(plan.case_path)), members[0])
    journal = journal_of(output)
    done = read_journal(journal, plan) if resume else []
    if resume and not journal.is_file() and output.is_file():
        finished = open_sweep(output)
        refuse_other(output, _digest_in(output), plan)
        return finished
    have = {one.number for one in done}
    todo = [(k, values) for k, values in enumerate(members) if k not in have]
    tried = _tried(plan, todo)
    left = [(k, values) for k, values in todo if k not in {one.number for one in tried}]
    with FileLock(output), begin(journal, plan, done) as file:
        for one in chain(tried, outcomes(plan, left, workers or usable_cores(), scheduler)):
            with counted(journal, done):
                add(file, one)
            done.append(one)
            if progress is not None:
                progress(float(len(done)))
    found = gathered(table, members, done)
    if all(found.problems):
        raise ValueError(f"every member of the sweep failed; the first: {found.problems[0]}")
    with counted(journal, done):
        written(found, output, plan)
    journal.unlink()
    return found


def _tried(plan: Plan, todo: Todo) -> list[Outcome]:
    """The outcome of the first member, or of the first and the last, so that a mistake in the sweep shows early.

    Raises ValueError where both fail for one reason.
    """
    tried: list[Outcome] = []
    for number, values in [todo[0], todo[-1]] if len(todo) > 2 else []:
        tried.append(run_member(plan, number, values))
        if not tried[-1].problem:
            return tried
    if tried and tried[0].problem == tried[1].problem:
        raise ValueError(
            f"the first and the last member of the sweep, tried before the others, fail: {tried[0].problem}"
        )
    return tried


def planned(path: str | Path) -> tuple[SweepTable, Plan]:
    """The table of a sweep, and what its workers need."""
    table, text = read_sweep(path)
    case = read_case(Path(path).parent / table.case)
    files = json.dumps(file_digests(case), sort_keys=True)
    return table, Plan(text, case.text, str(case.path.resolve()), files)


def count_of(path: str | Path) -> int:
    """Number of members of a sweep's file."""
    return len(designed(read_sweep(path)[0]))


def usable_cores() -> int:
    """Cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def _check_keys(case: Case, values: dict[str, Any]) -> None:
    """Report key paths that are not in the case before anything runs; what a value does to it is the member's.

    A key that the case does not write, but knows, is there; one that it does not know is named by the case's own check.
    """
    name, known = case.path.name, set(written_keys(case.tables))
    try:
        with_values(case, values)
    except CaseError as error:
        new = {path.rpartition(".")[2] for path in values if path not in known}
        wrong = [one for one in error.problems if not one.where or one.where.rpartition(".")[2] in new]
        if wrong:
            raise CaseError(
                name, [Problem("vary", f"{one.where}: {one.text}".removeprefix(": ")) for one in wrong]
            ) from None


def gathered(table: SweepTable, members: list[dict[str, Any]], done: list[Outcome]) -> Sweep:
    """The results of all members in their order."""
    by_number = {one.number: one for one in done}
    rows = [by_number[k] for k in range(len(members))]
    good = next((one for one in rows if not one.problem), None)
    time = np.array(good.time if good else [])
    named = [*table.outputs, *table.histories]
    units = dict(zip(named, good.units if good else [""] * len(named), strict=True))
    inputs = {}
    for key in table.vary:
        numbers = [_number(one[key]) for one in members]
        inputs[key] = np.array([number for number, _ in numbers])
        units[key] = numbers[0][1]
    outputs = {
        name: np.array([row.outputs[k] if row.outputs else np.nan for row in rows])
        for k, name in enumerate(table.outputs)
    }
    histories = {
        name: np.array([row.histories[k] if row.histories else [np.nan] * len(time) for row in rows])
        for k, name in enumerate(table.histories)
    }
    percentiles, wanted = np.array(table.percentiles), table.design == "sobol_indices"
    sobol = {name: indices(table, values) for name, values in outputs.items()} if wanted else {}
    return Sweep(inputs, outputs, units, time, histories, percentiles, tuple(row.problem for row in rows), sobol)


def _number(value: Any) -> tuple[float, str]:
    """A value's number and unit, NaN for words and lists."""
    try:
        return split_number(value)
    except (UnitError, TypeError, ValueError):
        return float("nan"), ""


def _percentiles(values: Array, which: Array) -> Array:
    good = values[~np.isnan(values).any(axis=1)]
    return np.percentile(good, which, axis=0) if len(good) else np.full((len(which), values.shape[1]), np.nan)


def written(found: Sweep, path: Path, plan: Plan) -> None:
    """Write the results into an HDF5 file, which appears whole."""
    import h5py

    with placed_hdf5(path, force=True) as file:
        file.attrs["sweep"], file.attrs["case_text"] = plan.sweep_text, plan.case_text
        file.attrs["digest"] = digest(plan)
        for group, columns in (("inputs", found.inputs), ("outputs", found.outputs), ("histories", found.histories)):
            for name, values in columns.items():
                data = file.create_group(group) if group not in file else file[group]
                one = data.create_dataset(name.replace("/", "|"), data=values)
                one.attrs["unit"] = found.units.get(name, "")
        file["time"], file["percentiles"] = found.time, found.percentiles
        for group, columns in (("outputs", found.of_outputs()), ("histories", found.of_histories())):
            for name, values in columns.items():
                file[f"percentiles_of_{group}/{name.replace('/', '|')}"] = values
        for name, values in found.sobol.items():
            file[f"sobol_indices/{name}"] = values
        file.create_dataset("problems", data=np.array(found.problems, object), dtype=h5py.string_dtype())


def _digest_in(path: Path) -> str:
    """The digest of the sweep that a file of results is of."""
    from femflex.hdf5 import open_hdf5

    with open_hdf5(path) as file:
        return str(file.attrs.get("digest", ""))


def open_sweep(path: str | Path) -> Sweep:
    """The results of a sweep in its file. Raises ValueError for a file that is none."""
    from femflex.hdf5 import open_hdf5

    with open_hdf5(Path(path)) as file:
        if "problems" not in file or "percentiles" not in file:
            raise ValueError(f"{path} does not hold a sweep; `femflex sweep` writes one")
        columns = {
            group: {name.replace("|", "/"): np.asarray(data) for name, data in file[group].items()}
            if group in file
            else {}
            for group in ("inputs", "outputs", "histories")
        }
        units = {
            name.replace("|", "/"): str(data.attrs["unit"])
            for group in ("inputs", "outputs", "histories")
            if group in file
            for name, data in file[group].items()
        }
        problems = tuple(text.decode() for text in file["problems"][:])
        return Sweep(
            columns["inputs"], columns["outputs"], units, np.asarray(file["time"]), columns["histories"],
            np.asarray(file["percentiles"]), problems,
            {name: np.asarray(data) for name, data in file.get("sobol_indices", {}).items()},
        )  # fmt: skip
