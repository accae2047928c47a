"""Cases in which one value at a time is changed into a mistake, and what is said of each.

`python tests/retold/changed_once.py [CASE ...]` writes anew what is said: of every sentence the first of its form, and
some of the others. What then changes is to be read before it is kept.
"""

from __future__ import annotations

import copy
import json
import re
import sys
import tomllib
import warnings
import zlib
from collections.abc import Callable, Iterable, Iterator
from contextlib import chdir
from functools import cache
from pathlib import Path
from typing import Any

import pytest

from femflex.case import CaseError
from femflex.case.changed import toml_text
from femflex.case.read import _checked
from femflex.case.sweep import parse_sweep
from femflex.mesh import Mesh, read_mesh

MISTAKEN = Path(__file__).parent / "mistaken"
QUANTITY = re.compile(r"([-+]?[\d.]+(?:e[-+]?\d+)?) ([A-Za-z%].*)")
NAMES_AND_NUMBERS = re.compile(r"'[^']*'|-?[0-9][0-9.e+-]*")
Places = tuple[str | int, ...]
Change = Callable[[Any], Any]
GONE = object()


def names() -> list[str]:
    """The cases, and the sweeps."""
    return sorted(path.stem for path in MISTAKEN.iterdir() if path.suffix in (".toml", ".sweep"))


def mistakes(tables: dict[str, Any]) -> Iterator[tuple[Places, str]]:
    """Key path and kind of every change."""
    for place in places(tables):
        for kind in kinds_of(place, entry(tables, place)):
            yield place, kind


def places(value: Any, at: Places = ()) -> Iterator[Places]:
    """Key paths of all values; of lists of numbers that of the last alone."""
    if at:
        yield at
    if isinstance(value, dict):
        for key, part in value.items():
            yield from places(part, (*at, key))
    elif isinstance(value, list):
        plain = not any(isinstance(part, dict | list) for part in value)
        for k in range(len(value) - 1 if plain else 0, len(value)):
            yield from places(value[k], (*at, k))


def entry(tables: Any, place: Places) -> Any:
    """What stands at a key path."""
    for key in place:
        tables = tables[key]
    return tables


def kinds_of(place: Places, value: Any) -> dict[str, Change]:
    """What is done to a value of that kind."""
    found: dict[str, Change] = {}
    if isinstance(place[-1], str):
        key = misspelled(place[-1])
        found |= {"left out": lambda _: GONE, "key misspelled": lambda old: Renamed(key, old)}
    if isinstance(value, dict):
        found |= {"text": lambda _: "some", "unknown key": lambda old: {**old, "colours": 3}}
        if place[-1] in NAMES_ITS_PARTS:
            found["empty"] = lambda _: {}
    elif isinstance(value, list):
        found |= {"a number": lambda _: 7, "one shorter": lambda old: old[:-1]}
        found["its last twice"] = lambda old: [*old, old[-1]]
    elif isinstance(value, bool):
        found |= {"text": lambda _: "yes", "a number": lambda _: 1}
    elif isinstance(value, int | float):
        found |= {"text": lambda _: "few", "truth": lambda _: True, "with a unit": lambda old: f"{old} s"}
        found |= {"negative": lambda old: -old, "zero": lambda _: 0}
    elif parts := QUANTITY.fullmatch(value):
        number, unit = parts[1], parts[2]
        found |= {"negative": lambda _: f"-{number.lstrip('-')} {unit}", "zero": lambda _: f"0 {unit}"}
        found["another unit"] = lambda _: f"{number} {'kg' if unit != 'kg' else 's'}"
        found |= {"unit misspelled": lambda _: f"{number} {unit}q", "truth": lambda _: True}
    else:
        found |= {"a number": lambda _: 7, "empty": lambda _: "", "misspelled": misspelled}
    return found


NAMES_ITS_PARTS = ("bodies", "vary", "outputs", "joints", "clamp")


class Renamed:
    """A value under another key."""

    def __init__(self, key: str, value: Any) -> None:
        self.key, self.value = key, value


def misspelled(word: str) -> str:
    """The word with its last letter but one replaced by another."""
    at = max(len(word) - 2, 0)
    return f"{word[:at]}{'q' if word[at] != 'q' else 'w'}{word[at + 1 :]}"


def changed(tables: dict[str, Any], place: Places, change: Change) -> dict[str, Any]:
    """A copy with the value at a key path changed; keys keep their order."""
    out = copy.deepcopy(tables)
    holder, key = entry(out, place[:-1]), place[-1]
    new = change(holder[key])
    if new is GONE:
        del holder[key]
    elif isinstance(new, Renamed):
        parts = [(new.key if one == key else one, part) for one, part in holder.items()]
        holder.clear()
        holder.update(parts)
    else:
        holder[key] = new
    return out


def told(name: str, wanted: Iterable[tuple[Places, str]] | None = None) -> Iterator[str]:
    """A line for each change, all of them or those wanted: key path, kind of change, and what is said of it."""
    path = next(one for end in ("toml", "sweep") if (one := MISTAKEN / f"{name}.{end}").exists())
    read = sweep_of if path.suffix == ".sweep" else case_of
    tables = tomllib.loads(path.read_text(encoding="utf-8"))
    with chdir(MISTAKEN), pytest.MonkeyPatch.context() as patch:
        patch.setattr("femflex.mesh.read_mesh", read_once)
        for place, kind in wanted or mistakes(tables):
            other = changed(tables, place, kinds_of(place, entry(tables, place))[kind])
            yield f"{json.dumps(place)} | {kind} | {said(read, other)}"


def read_once(path: Path, groups: dict[str, str] | None = None) -> Mesh:
    """A mesh of these groups, read at the first time."""
    return _mesh_of(path, tuple((groups or {}).items()))


@cache
def _mesh_of(path: Path, groups: tuple[tuple[str, str], ...]) -> Mesh:
    return read_mesh(path, dict(groups) or None)


def case_of(tables: dict[str, Any]) -> None:
    """Reads tables as a case."""
    _checked(tables, Path("case.toml"), "")


def sweep_of(tables: dict[str, Any]) -> None:
    """Reads tables as those of a sweep."""
    parse_sweep(toml_text(tables))


def said(read: Callable[[dict[str, Any]], None], tables: dict[str, Any]) -> str:
    """What is said of a case: its problems, its warnings, or that it is accepted."""
    with warnings.catch_warnings(record=True) as warned:
        warnings.simplefilter("always")
        try:
            read(tables)
        except CaseError as error:
            return " // ".join(map(str, error.problems))
    return " // ".join(f"warning: {one.message}" for one in warned) or "accepted"


def recorded(name: str) -> list[str]:
    """The lines that were recorded."""
    return (MISTAKEN / f"{name}.txt").read_text(encoding="utf-8").splitlines()


def change_of(line: str) -> tuple[Places, str]:
    """Key path and kind of change of a line."""
    place, kind, _ = line.split(" | ", 2)
    return tuple(json.loads(place)), kind


def form_of(line: str) -> str:
    """The sentence of a line without its names and numbers."""
    _, kind, sentence = line.split(" | ", 2)
    texts = (re.sub(r"^\S+: ", "", part) for part in sentence.split(" // "))
    text = " // ".join(sorted({re.sub(r"known are .*", "", part) for part in texts}))
    return f"{kind if text == 'accepted' else ''} {NAMES_AND_NUMBERS.sub('#', text)}"


def chosen(lines: Iterable[str], seen: set[str]) -> Iterator[str]:
    """The first line of every form that was not seen, and one in fifteen of the others."""
    for line in lines:
        form = form_of(line)
        if form not in seen or zlib.crc32(line.encode()) % 15 == 0:
            yield line
        seen.add(form)


if __name__ == "__main__":
    forms: set[str] = set()
    for case in sys.argv[1:] or names():
        (MISTAKEN / f"{case}.txt").write_text("\n".join(chosen(told(case), forms)) + "\n", encoding="utf-8")
