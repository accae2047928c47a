"""A sweep from its file to its results: values, outputs, histories and percentiles in one HDF5 file.

A journal with one line per finished member lets a killed sweep continue.
"""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass, field
from hashlib import sha256
from io import FileIO
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np

from femflex import __version__
from femflex.arrays import Array
from femflex.case import Case, CaseError, read_case, with_values
from femflex.case.changed import written_keys
from femflex.case.read import parse_case
from femflex.case.sweep import SweepTable, read_sweep, split_number
from femflex.hdf5 import atomic_hdf5, open_hdf5
from femflex.noun.problems import Problem
from femflex.noun.units import UnitError
from femflex.pipeline.file_digests import file_digests
from femflex.results import FileLock
from femflex.studies.sweep.member import Outcome, Plan, member_values, run_member, sobol_indices_of
from femflex.studies.sweep.workers import Todo, outcomes
from femflex.worker_processes import usable_cores
from femflex.writing import atomic_file, check_destination


def journal_of(output: Path) -> Path:
    """Path of the journal next to a sweep's result; it exists until the sweep is complete."""
    return output.with_name(output.name + ".journal")


def digest(plan: Plan) -> str:
    """Digest of everything that identifies a sweep: table, case, contents of the files of the case, and version."""
    return sha256("\n".join([plan.sweep_text, plan.case_text, plan.files, __version__]).encode()).hexdigest()


def refuse_other_sweep(path: Path, found_digest: str, plan: Plan) -> None:
    """Raise ValueError where a file of a sweep with that digest belongs to another sweep than the plan."""
    if found_digest != digest(plan):
        raise ValueError(
            f"{path} is of another sweep: the file of the sweep, its case or a file that this names has changed since. "
            "Leave --resume out and give --force to begin anew"
        )


def read_journal(path: Path, plan: Plan) -> list[Outcome]:
    """The finished members, none without a journal; a line cut short by a kill is ignored.

    Raises ValueError for the journal of another sweep.
    """
    if not path.is_file():
        return []
    head, *lines = path.read_text(encoding="utf-8").split("\n")
    refuse_other_sweep(path, head, plan)
    outcomes = {}
    for line in lines:
        try:
            outcome = Outcome(**json.loads(line))
        except (json.JSONDecodeError, TypeError):
            continue
        outcomes[outcome.number] = outcome
    return [outcomes[k] for k in sorted(outcomes)]


def open_journal(path: Path, plan: Plan, done: list[Outcome]) -> FileIO:
    """The journal with the finished members, open for more; it replaces an existing one when it is complete."""
    with atomic_file(path, force=True) as draft, FileIO(draft, "w") as file:
        _write_line(file, digest(plan))
        for outcome in done:
            append_outcome(file, outcome)
    return FileIO(path, "a")


def append_outcome(file: FileIO, outcome: Outcome) -> None:
    """Append one line; it is on the disk on return, or not at all if it does not fit. Numbers keep every bit."""
    end = file.seek(0, os.SEEK_END)
    try:
        _write_line(file, json.dumps(asdict(outcome)))
        os.fsync(file.fileno())
    except OSError:
        file.truncate(end)
        raise


def _write_line(file: FileIO, line: str) -> None:
    """Write a line without a buffer, which would be tried again when the file is closed."""
    rest = f"{line}\n".encode()
    while rest:
        rest = rest[file.write(rest) :]


@contextmanager
def naming_kept_members(journal: Path, done: list[Outcome]) -> Iterator[None]:
    """Context in which errors of writing, as of a full disk, state how many members the journal keeps."""
    try:
        yield
    except OSError as error:
        text = f"{error.strerror or error}; the members that are done ({len(done)}) are kept in {journal.name}"
        text = f"{text}: make room, and --resume goes on"
        raise OSError(error.errno, text, error.filename or str(journal)) from error


Progress = Callable[[float], object]  # called with the number of members done


@dataclass(frozen=True, eq=False)
class Sweep:
    """The results of a sweep of n members.

    inputs       key path -> (n,) values in their units, NaN for words
    outputs      name -> (n,) NaN where a member failed
    units        key path, name or history -> unit
    time         (n_t,) [s];  histories  channel -> (n, n_t)
    percentiles  (n_p,);  problems (n,) why a member ended early, "" where it did not
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

    def output_percentiles(self) -> dict[str, Array]:
        """Percentiles (n_p,) of every output, in its unit, over the members that did not fail."""
        return {name: _percentiles(values[:, None], self.percentiles)[:, 0] for name, values in self.outputs.items()}

    def statistics(self) -> dict[str, tuple[float, float, int, int]]:
        """Mean, standard deviation, and the members with the least and the largest value, of every output.

        Members that failed are left out.
        """
        out = {}
        for name, values in self.outputs.items():
            if good := np.isfinite(values).sum():
                sigma = float(np.nanstd(values, ddof=1)) if good > 1 else 0.0
                out[name] = float(np.nanmean(values)), sigma, int(np.nanargmin(values)), int(np.nanargmax(values))
        return out

    def history_percentiles(self) -> dict[str, Array]:
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

    workers    number of processes, by default one per core. The results do not depend on it
    resume     continue a sweep that was interrupted or killed; finished members are not run again
    scheduler  address of a Dask scheduler, in place of processes
    progress   called with the number of members done

    Where no table of materials, sections or flexible bodies varies, bodies are built once, with the strain and the
    shapes that the unchanged case chooses; else every member is built as its own case says. A member that fails is kept
    with its problem. Raises CaseError for a sweep or a case with mistakes and for a key path that is not in the case,
    FileExistsError for an existing output unless `force`, OSError for a full disk, ValueError when every member fails.
    """
    output = Path(output)
    table, plan = plan_sweep(path)
    check_destination(output, force or resume)
    members = member_values(table)
    _check_keys(parse_case(plan.case_text, Path(plan.case_path)), members[0])
    journal = journal_of(output)
    done = read_journal(journal, plan) if resume else []
    if resume and not journal.is_file() and output.is_file():
        finished = open_sweep(output)
        with open_hdf5(output) as results_file:
            refuse_other_sweep(output, str(results_file.attrs.get("digest", "")), plan)
        return finished
    finished_numbers = {outcome.number for outcome in done}
    todo = [(k, values) for k, values in enumerate(members) if k not in finished_numbers]
    probes = _probe_members(plan, todo)
    remaining = [(k, values) for k, values in todo if k not in {outcome.number for outcome in probes}]
    with FileLock(output), open_journal(journal, plan, done) as file:
        for outcome in chain(probes, outcomes(plan, remaining, workers or usable_cores(), scheduler)):
            with naming_kept_members(journal, done):
                append_outcome(file, outcome)
            done.append(outcome)
            if progress is not None:
                progress(float(len(done)))
    results = collect_results(table, members, done)
    if all(results.problems):
        raise ValueError(f"every member of the sweep failed; the first: {results.problems[0]}")
    with naming_kept_members(journal, done):
        write_sweep(results, output, plan)
    journal.unlink()
    return results


def _probe_members(plan: Plan, todo: Todo) -> list[Outcome]:
    """The outcome of the first member, or of the first and the last, so that a mistake in the sweep shows early.

    Raises ValueError where both fail for one reason.
    """
    probes: list[Outcome] = []
    for number, values in [todo[0], todo[-1]] if len(todo) > 2 else []:
        probes.append(run_member(plan, number, values))
        if not probes[-1].problem:
            return probes
    if probes and probes[0].problem == probes[1].problem:
        raise ValueError(
            f"the first and the last member of the sweep, tried before the others, fail: {probes[0].problem}"
        )
    return probes


def plan_sweep(path: str | Path) -> tuple[SweepTable, Plan]:
    """The table of a sweep, and the Plan for its workers."""
    table, text = read_sweep(path)
    case = read_case(Path(path).parent / table.case)
    files = json.dumps(file_digests(case), sort_keys=True)
    return table, Plan(text, case.text, str(case.path.resolve()), files)


def count_of(path: str | Path) -> int:
    """Number of members of a sweep's file."""
    return len(member_values(read_sweep(path)[0]))


def _check_keys(case: Case, values: dict[str, Any]) -> None:
    """Raise CaseError before anything runs for key paths that are not in the case; invalid values concern members.

    A key that is missing in the file but valid is accepted; the check of the case reports an invalid one.
    """
    name, existing = case.path.name, set(written_keys(case.tables))
    try:
        with_values(case, values)
    except CaseError as error:
        new = {path.rpartition(".")[2] for path in values if path not in existing}
        wrong = [problem for problem in error.problems if not problem.where or problem.where.rpartition(".")[2] in new]
        if wrong:
            raise CaseError(
                name, [Problem("vary", f"{problem.where}: {problem.text}".removeprefix(": ")) for problem in wrong]
            ) from None


def collect_results(table: SweepTable, members: list[dict[str, Any]], done: list[Outcome]) -> Sweep:
    """The results of all members in their order."""
    by_number = {outcome.number: outcome for outcome in done}
    rows = [by_number[k] for k in range(len(members))]
    good = next((outcome for outcome in rows if not outcome.problem), None)
    time = np.array(good.time if good else [])
    names = [*table.outputs, *table.histories]
    units = dict(zip(names, good.units if good else [""] * len(names), strict=True))
    inputs = {}
    for key in table.vary:
        numbers = [_number(values[key]) for values in members]
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
    percentiles, with_indices = np.array(table.percentiles), table.design == "sobol_indices"
    sobol = {name: sobol_indices_of(table, values) for name, values in outputs.items()} if with_indices else {}
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


def write_sweep(results: Sweep, path: Path, plan: Plan) -> None:
    """Write the results to an HDF5 file, which appears when it is complete."""
    import h5py

    with atomic_hdf5(path, force=True) as file:
        file.attrs["sweep"], file.attrs["case_text"] = plan.sweep_text, plan.case_text
        file.attrs["digest"] = digest(plan)
        for group in ("inputs", "outputs", "histories"):
            for name, values in getattr(results, group).items():
                dataset = file.create_dataset(f"{group}/{name.replace('/', '|')}", data=values)
                dataset.attrs["unit"] = results.units.get(name, "")
        file["time"], file["percentiles"] = results.time, results.percentiles
        for group, columns in (("outputs", results.output_percentiles()), ("histories", results.history_percentiles())):
            for name, values in columns.items():
                file[f"percentiles_of_{group}/{name.replace('/', '|')}"] = values
        for name, values in results.sobol.items():
            file[f"sobol_indices/{name}"] = values
        file.create_dataset("problems", data=np.array(results.problems, object), dtype=h5py.string_dtype())


def open_sweep(path: str | Path) -> Sweep:
    """The results of a sweep in its file. Raises ValueError for a file that is none."""
    with open_hdf5(Path(path)) as file:
        if "problems" not in file or "percentiles" not in file:
            raise ValueError(f"{path} does not hold a sweep; `femflex sweep` writes one")
        groups = [file.get(group, {}) for group in ("inputs", "outputs", "histories")]
        inputs, outputs, histories = ({_channel(n): np.asarray(v) for n, v in group.items()} for group in groups)
        units = {_channel(name): str(data.attrs["unit"]) for group in groups for name, data in group.items()}
        time, percentiles = (np.asarray(file[name]) for name in ("time", "percentiles"))
        problems = tuple(text.decode() for text in file["problems"][:])
        sobol = {name: np.asarray(data) for name, data in file.get("sobol_indices", {}).items()}
        return Sweep(inputs, outputs, units, time, histories, percentiles, problems, sobol)


def _channel(name: str) -> str:
    """The path of a channel from its name in a file."""
    return name.replace("|", "/")
