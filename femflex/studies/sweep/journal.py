"""The journal of a sweep: one line per member that is done, so that a sweep that was killed goes on."""

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
from femflex.writing import placed


def journal_of(output: Path) -> Path:
    """The journal that stands next to a sweep's result until it is complete."""
    return output.with_name(output.name + ".journal")


def digest(plan: Plan) -> str:
    """What makes two sweeps the same: table, case, contents of the files that the case names, version of femflex."""
    return sha256("\n".join([plan.sweep_text, plan.case_text, plan.files, __version__]).encode()).hexdigest()


def refuse_other(path: Path, found: str, plan: Plan) -> None:
    """Raise ValueError where a file, made by a sweep of the digest `found`, is of another sweep than the plan."""
    if found != digest(plan):
        raise ValueError(
            f"{path} is of another sweep: the file of the sweep, its case or a file that this names has changed since. "
            "Leave --resume out and give --force to begin anew"
        )


def read_journal(path: Path, plan: Plan) -> list[Outcome]:
    """The members that are done, none where there is no journal; a line cut short by a kill is left out.

    Raises ValueError for the journal of another sweep.
    """
    if not path.is_file():
        return []
    first, *lines = path.read_text(encoding="utf-8").split("\n")
    refuse_other(path, first, plan)
    found = {}
    for line in lines:
        try:
            one = Outcome(**json.loads(line))
        except (json.JSONDecodeError, TypeError):
            continue
        found[one.number] = one
    return [found[k] for k in sorted(found)]


def begin(path: Path, plan: Plan, done: list[Outcome]) -> FileIO:
    """The journal open for more, with what is done; one that was there is replaced when the new one is whole."""
    with placed(path, force=True) as part, FileIO(part, "w") as file:
        _put(file, digest(plan))
        for one in done:
            add(file, one)
    return FileIO(path, "a")


def add(file: FileIO, one: Outcome) -> None:
    """One more line, on the disk when this returns; none of it where it does not fit. Numbers keep every bit."""
    end = file.seek(0, os.SEEK_END)
    try:
        _put(file, json.dumps(asdict(one)))
        os.fsync(file.fileno())
    except OSError:
        file.truncate(end)
        raise


def _put(file: FileIO, line: str) -> None:
    """Write a line without a buffer, which would be tried again when the file is closed."""
    rest = f"{line}\n".encode()
    while rest:
        rest = rest[file.write(rest) :]


@contextmanager
def counted(journal: Path, done: list[Outcome]) -> Iterator[None]:
    """Errors of writing, as of a full disk, say how many members the journal keeps."""
    try:
        yield
    except OSError as error:
        text = f"{error.strerror or error}; the members that are done ({len(done)}) are kept in {journal.name}"
        text = f"{text}: make room, and --resume goes on"
        raise OSError(error.errno, text, error.filename or str(journal)) from error
