"""The journal of a sweep: one line per member that is done, so that a sweep that was killed goes on."""

from __future__ import annotations

import json
import os
from dataclasses import asdict
from hashlib import sha256
from pathlib import Path
from typing import TextIO

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


def begin(path: Path, plan: Plan, done: list[Outcome]) -> TextIO:
    """The journal open for more, with what is done; one that was there is replaced when the new one is whole."""
    with placed(path, force=True) as part, part.open("w", encoding="utf-8") as file:
        file.write(digest(plan) + "\n")
        for one in done:
            add(file, one)
    return path.open("a", encoding="utf-8")


def add(file: TextIO, one: Outcome) -> None:
    """One more line, on the disk when this returns. Numbers keep every bit."""
    file.write(json.dumps(asdict(one)) + "\n")
    file.flush()
    os.fsync(file.fileno())
