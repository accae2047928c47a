"""A case with other values: the same file with numbers, words or tables replaced by their key paths, checked anew."""

from __future__ import annotations

import json
import re
import tomllib
from collections.abc import Mapping
from difflib import get_close_matches
from functools import lru_cache
from typing import Any

import numpy as np

BARE = re.compile(r"[A-Za-z0-9_-]+")


@lru_cache(maxsize=4)
def _parsed(text: str) -> dict[str, Any]:
    return tomllib.loads(text)


def changed_text(text: str, values: Mapping[str, Any], name: str) -> str:
    """The TOML text of a case in which these values stand at their key paths (`changed_tables`)."""
    return toml_text(changed_tables(_parsed(text), values, name))


def changed_tables(tables: Mapping[str, Any], values: Mapping[str, Any], name: str) -> dict[str, Any]:
    """A copy of the tables of a case in which these values stand at their key paths, such as "bodies.hub.mass".

    Entries of lists go by their name, "joints.hinge.stiffness", or by their number, from 0: "loads.0.force". name: of
    the file, for errors.
    Raises ValueError for a path that leads nowhere; what stands at its end is not checked here.
    """
    raw: dict[str, Any] = _copied(dict(tables))
    for path, value in values.items():
        path = numbered_path(tables, path)
        *folders, last = path.split(".")
        table: Any = raw
        for depth, key in enumerate(folders):
            table = _entry(table, key, ".".join(folders[:depth]), path, name)
        if isinstance(table, list):
            _entry(table, last, ".".join(folders), path, name)
            table[int(last)] = _plain(value)
        elif isinstance(table, dict):
            table[last] = _plain(value)
        else:
            raise ValueError(_nowhere(path, name, f"{'.'.join(folders)} is {table!r}, which holds no keys"))
    return raw


def numbered_path(tables: Any, path: str) -> str:
    """The key path with the names of entries of lists replaced by their numbers, as far as it leads."""
    table, out = tables, []
    for key in path.split("."):
        if isinstance(table, list) and key in (named := _names(table)):
            key = str(named[key])
        out.append(key)
        if isinstance(table, list):
            table = table[int(key)] if key.isdigit() and int(key) < len(table) else None
        else:
            table = table.get(key) if isinstance(table, Mapping) else None
    return ".".join(out)


def _names(table: list[Any]) -> dict[str, int]:
    """Numbers of the entries of a list by their names."""
    return {str(part["name"]): k for k, part in enumerate(table) if isinstance(part, Mapping) and "name" in part}


def written_keys(tables: Any, folder: str = "") -> list[str]:
    """Key paths of everything that stands in the tables of a case, tables and lists included."""
    if isinstance(tables, Mapping):
        parts = [(str(key), part) for key, part in tables.items()]
    else:
        parts = [(str(k), part) for k, part in enumerate(tables)] if isinstance(tables, list) else []
    return [path for key, part in parts for path in (f"{folder}{key}", *written_keys(part, f"{folder}{key}."))]


def _copied(value: Any) -> Any:
    """Tables and lists anew; what stands in them cannot be changed."""
    if isinstance(value, dict):
        return {key: _copied(part) for key, part in value.items()}
    return [_copied(part) for part in value] if isinstance(value, list) else value


def _entry(table: Any, key: str, where: str, path: str, name: str) -> Any:
    """What stands at a key of a table, or at a number of a list."""
    here = where or "the file"
    if isinstance(table, list):
        if key.isdigit() and int(key) < len(table):
            return table[int(key)]
        named = _names(table)
        names = f" or one of the names {', '.join(named)}" if named else ""
        raise ValueError(_nowhere(path, name, f"{here} is a list of {len(table)}; give a number from 0{names}"))
    if not isinstance(table, dict):
        raise ValueError(_nowhere(path, name, f"{here} is {table!r}, which holds no keys"))
    if key not in table:
        near = get_close_matches(key, table, n=1)
        hint = f"; did you mean {near[0]!r}?" if near else "."
        raise ValueError(_nowhere(path, name, f"{here} has no {key!r}{hint} Known there are {', '.join(table)}"))
    return table[key]


def _nowhere(path: str, name: str, why: str) -> str:
    return f"{path!r} is no key of {name}: {why}"


def _plain(value: Any) -> Any:
    """The value as TOML has it: numbers and arrays of numpy become Python's."""
    if isinstance(value, np.ndarray | np.generic):
        value = value.tolist()
    if isinstance(value, Mapping):
        return {str(key): _plain(part) for key, part in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(part) for part in value]
    if isinstance(value, str | bool | int | float):
        return value
    raise ValueError(f"a case holds numbers, texts, lists and tables; found {value!r} of type {type(value).__name__}")


def toml_text(raw: Mapping[str, Any]) -> str:
    """The TOML text of nested tables: plain keys first, then [tables] and [[lists of tables]].

    >>> print(toml_text({"title": "a", "bodies": {"hub": {"mass": 4.0}}}))
    title = "a"
    <BLANKLINE>
    [bodies.hub]
    mass = 4.0
    <BLANKLINE>
    """
    return "\n".join(_lines(raw, ())) + "\n"


def _lines(table: Mapping[str, Any], path: tuple[str, ...]) -> list[str]:
    plain = {key: value for key, value in table.items() if not (_is_table(value) or _is_tables(value))}
    out = [f"{_key(key)} = {_value(value)}" for key, value in plain.items()]
    for key, value in table.items():
        own = (*path, key)
        head = ".".join(_key(part) for part in own)
        if _is_table(value):
            lines = _lines(value, own)
            bare = bool(value) and all(_is_table(part) or _is_tables(part) for part in value.values())
            out += lines if bare else ["", f"[{head}]", *lines]
        elif _is_tables(value):
            for part in value:
                out += ["", f"[[{head}]]", *_lines(part, own)]
    return out


def _is_table(value: Any) -> bool:
    return isinstance(value, Mapping)


def _is_tables(value: Any) -> bool:
    return isinstance(value, list) and bool(value) and all(isinstance(part, Mapping) for part in value)


def _key(key: str) -> str:
    return key if BARE.fullmatch(key) else json.dumps(key)


def _value(value: Any) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False)
    if isinstance(value, Mapping):
        return "{ " + ", ".join(f"{_key(key)} = {_value(part)}" for key, part in value.items()) + " }"
    if isinstance(value, list):
        return "[" + ", ".join(map(_value, value)) + "]"
    return repr(value)  # numbers, inf and nan; dates as TOML writes them
