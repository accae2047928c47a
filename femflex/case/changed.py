"""A case with other values: numbers, words or tables are replaced by their key paths, and the case is checked again."""

from __future__ import annotations

import json
import re
import tomllib
from collections.abc import Mapping
from datetime import date, time
from difflib import get_close_matches
from functools import lru_cache
from typing import Any

import numpy as np

BARE = re.compile(r"[A-Za-z0-9_-]+")


@lru_cache(maxsize=4)
def _parsed(text: str) -> dict[str, Any]:
    return tomllib.loads(text)


def changed_text(text: str, values: Mapping[str, Any], name: str) -> str:
    """The TOML text of a case with these values at their key paths (`changed_tables`)."""
    return toml_text(changed_tables(_parsed(text), values, name))


def changed_tables(tables: Mapping[str, Any], values: Mapping[str, Any], name: str) -> dict[str, Any]:
    """A copy of the tables of a case with these values at their key paths, such as "bodies.hub.mass".

    Entries of lists are addressed by their name, "joints.hinge.stiffness", or by their number from 0: "loads.0.force".
    name: of the file, for errors.
    Raises ValueError for a path that does not exist; the values are not checked here.
    """
    raw: dict[str, Any] = _deep_copy(dict(tables))
    for path, value in values.items():
        path = numbered_path(tables, path)
        *folders, last_key = path.split(".")
        table: Any = raw
        for depth, key in enumerate(folders):
            table = _entry(table, key, ".".join(folders[:depth]), path, name)
        if isinstance(table, list):
            _entry(table, last_key, ".".join(folders), path, name)
            table[int(last_key)] = _plain(value)
        elif isinstance(table, dict):
            table[last_key] = _plain(value)
        else:
            raise ValueError(_path_error_text(path, name, f"{'.'.join(folders)} is {table!r}, which holds no keys"))
    return raw


def numbered_path(tables: Any, path: str) -> str:
    """The key path with the names of list entries replaced by their numbers, as far as the path exists."""
    table, out = tables, []
    for key in path.split("."):
        if isinstance(table, list) and key in (numbers := _numbers_by_name(table)):
            key = str(numbers[key])
        out.append(key)
        if isinstance(table, list):
            table = table[int(key)] if key.isdigit() and int(key) < len(table) else None
        else:
            table = table.get(key) if isinstance(table, Mapping) else None
    return ".".join(out)


def _numbers_by_name(table: list[Any]) -> dict[str, int]:
    """Numbers of the entries of a list by their names."""
    return {str(entry["name"]): k for k, entry in enumerate(table) if isinstance(entry, Mapping) and "name" in entry}


def written_keys(tables: Any, folder: str = "") -> list[str]:
    """Key paths of everything in the tables of a case, tables and lists included."""
    if isinstance(tables, Mapping):
        entries = [(str(key), entry) for key, entry in tables.items()]
    else:
        entries = [(str(k), entry) for k, entry in enumerate(tables)] if isinstance(tables, list) else []
    return [path for key, entry in entries for path in (f"{folder}{key}", *written_keys(entry, f"{folder}{key}."))]


def _deep_copy(value: Any) -> Any:
    """A copy of nested tables and lists; their other entries are immutable."""
    if isinstance(value, dict):
        return {key: _deep_copy(entry) for key, entry in value.items()}
    return [_deep_copy(entry) for entry in value] if isinstance(value, list) else value


def _entry(table: Any, key: str, table_path: str, path: str, name: str) -> Any:
    """The entry at a key of a table, or at a number of a list."""
    table_name = table_path or "the file"
    if isinstance(table, list):
        if key.isdigit() and int(key) < len(table):
            return table[int(key)]
        numbers = _numbers_by_name(table)
        names = f" or one of the names {', '.join(numbers)}" if numbers else ""
        raise ValueError(
            _path_error_text(path, name, f"{table_name} is a list of {len(table)}; give a number from 0{names}")
        )
    if not isinstance(table, dict):
        raise ValueError(_path_error_text(path, name, f"{table_name} is {table!r}, which holds no keys"))
    if key not in table:
        matches = get_close_matches(key, table, n=1)
        hint = f"; did you mean {matches[0]!r}?" if matches else "."
        raise ValueError(
            _path_error_text(path, name, f"{table_name} has no {key!r}{hint} Known there are {', '.join(table)}")
        )
    return table[key]


def _path_error_text(path: str, name: str, reason: str) -> str:
    return f"{path!r} is no key of {name}: {reason}"


def _plain(value: Any) -> Any:
    """The value in types of TOML: numbers and arrays of numpy become Python's."""
    if isinstance(value, np.ndarray | np.generic):
        value = value.tolist()
    if isinstance(value, Mapping):
        return {str(key): _plain(entry) for key, entry in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(entry) for entry in value]
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
    return "\n".join(_table_lines(raw, ())) + "\n"


def _table_lines(table: Mapping[str, Any], path: tuple[str, ...]) -> list[str]:
    plain = {key: value for key, value in table.items() if not (_is_table(value) or _is_tables(value))}
    out = [f"{_key(key)} = {_value(value)}" for key, value in plain.items()]
    for key, value in table.items():
        own_path = (*path, key)
        head = ".".join(_key(entry) for entry in own_path)
        if _is_table(value):
            lines = _table_lines(value, own_path)
            only_tables = bool(value) and all(_is_table(entry) or _is_tables(entry) for entry in value.values())
            out += lines if only_tables else ["", f"[{head}]", *lines]
        elif _is_tables(value):
            for entry in value:
                out += ["", f"[[{head}]]", *_table_lines(entry, own_path)]
    return out


def _is_table(value: Any) -> bool:
    return isinstance(value, Mapping)


def _is_tables(value: Any) -> bool:
    return isinstance(value, list) and bool(value) and all(isinstance(entry, Mapping) for entry in value)


def _key(key: str) -> str:
    return key if BARE.fullmatch(key) else json.dumps(key)


def _value(value: Any) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False)
    if isinstance(value, Mapping):
        return "{ " + ", ".join(f"{_key(key)} = {_value(entry)}" for key, entry in value.items()) + " }"
    if isinstance(value, list):
        return "[" + ", ".join(map(_value, value)) + "]"
    return value.isoformat() if isinstance(value, date | time) else repr(value)  # numbers, inf and nan as Python's
