"""Journal of a sweep: one line per finished member, so that a killed sweep can continue."""

from __future__ import annotations

import json
import os
from dataclasses import asdict
from hashlib import sha256
from pathlib import Path
from typing import TextIO

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


def open_journal(path: Path, plan: Plan, done: list[Outcome]) -> TextIO:
    """The journal opened for appending, with the finished members; an old one is replaced when this one is written."""
    with atomic_file(path, force=True) as draft, draft.open("w", encoding="utf-8") as file:
        file.write(digest(plan) + "\n")
        for outcome in done:
            append_outcome(file, outcome)
    return path.open("a", encoding="utf-8")


def append_outcome(file: TextIO, outcome: Outcome) -> None:
    """Append a line, which is on the disk when this returns. Numbers keep every bit."""
    file.write(json.dumps(asdict(outcome)) + "\n")
    file.flush()
    os.fsync(file.fileno())
