"""Changed copies of case files: every value replaced in turn by one that it should not have."""

from __future__ import annotations

import copy
import json
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

CASES = Path(__file__).parents[2] / "cases"
MESHES = CASES.parent / "meshes"

NUMBERS = [0, -1, 1, 3, 0.5, -0.0, 1e-300, 1e300, -1e300, 1e30, 1e18, 1e-18, 1e9, 1e-9, float("nan"), float("inf")]
NUMBERS += [-float("inf"), 10**18, -(10**18), 10**400, "1e300 m", "1e400 kg", "-0 deg", "nan", "inf s", "1e-320 m"]
OTHERS = [True, False, "", " ", "x", "∞", "é", "a.b", "a/b", ".", "..", "a\x00b", "\x1b[0m", "\n", "x" * 5000]
OTHERS += [
    [],
    [[]],
    {},
    [{}],
    {"kind": []},
    {"kind": {}},
    {"formula": "s*" * 9 + "s"},
    {"formula": []},
    [1, 2],
    [[1, 2]],
]
OTHERS += [[0, 0, 0], [1e300] * 3, [True] * 3, [None], ["x"] * 3, {"s": [0, 1], "values": [1, -1]}, {"x": 1}]
OTHERS += ["formula", "free", "locked", "auto", "none", "root", "hub", "origin", list(range(2000))]
VALUES: list[Any] = [*NUMBERS, *(value for value in OTHERS if value != [None])]


def raw_case(name: str) -> dict[str, Any]:
    """A shipped case as TOML gives it."""
    return tomllib.loads((CASES / name).read_text(encoding="utf-8"))


def places(raw: Any, at: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    """Key paths of all values of a case: of tables and lists, and of what is in them."""
    if at:
        yield at
    if isinstance(raw, dict):
        for key, value in raw.items():
            yield from places(value, (*at, key))
    elif isinstance(raw, list):
        for k, value in enumerate(raw[:4]):
            yield from places(value, (*at, k))


def mutated(raw: dict[str, Any], at: tuple[Any, ...], value: Any) -> dict[str, Any]:
    """A copy with the value at a key path replaced."""
    out = copy.deepcopy(raw)
    into: Any = out
    for key in at[:-1]:
        into = into[key]
    into[at[-1]] = value
    return out


def renamed(raw: dict[str, Any], at: tuple[Any, ...], key: str) -> dict[str, Any]:
    """A copy with the last key of a path replaced."""
    out = copy.deepcopy(raw)
    into: Any = out
    for step in at[:-1]:
        into = into[step]
    into[key] = into.pop(at[-1])
    return out


def toml(value: Any) -> str:
    """The case as TOML text."""
    return "".join(f"{json.dumps(key)} = {_inline(entry)}\n" for key, entry in value.items())


def _inline(value: Any) -> str:
    if isinstance(value, dict):
        return "{" + ", ".join(f"{json.dumps(key)} = {_inline(entry)}" for key, entry in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(map(_inline, value)) + "]"
    if isinstance(value, str):
        return json.dumps(value).replace("\x7f", "\\u007f")
    if isinstance(value, float):
        text = repr(value)
        return text if any(mark in text for mark in ".naif") or "e" not in text else text.replace("e", ".0e")
    return str(value).lower() if isinstance(value, bool) else str(value)


def mutation_folder(folder: Path) -> Path:
    """A folder for changed copies, with the files that the shipped cases name."""
    cases = folder / "cases"
    cases.mkdir()
    (folder / "meshes").symlink_to(MESHES)
    for path in CASES.glob("*.csv"):
        (cases / path.name).symlink_to(path)
    return cases
