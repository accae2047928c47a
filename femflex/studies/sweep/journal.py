"""Journal of a sweep: one line per finished member, so that a killed sweep can continue."""

from __future__ import annotations

import json
import os
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict
from hashlib import sha256
from io import FileIO
from pathlib import Path

from femflex import __version__
from femflex.studies.sweep.member import Outcome, Plan
from femflex.writing import atomic_file


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
