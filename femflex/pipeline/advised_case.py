"""A copy of a case's text with the advice written into the tables of its bodies."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Mapping
from typing import Any

from femflex.case.case import Case
from femflex.case.read import parse_case
from femflex.noun.problems import CaseError
from femflex.pipeline.decisions import ResolvedCase

INNER = {"flexible": "reduction", "analytic": "functions"}  # table with the shapes of a body, by its kind


def advised_text(case: Case, resolved: ResolvedCase) -> str:
    """The text of a case with the choices for its bodies as keys of their tables, each with its reason as a comment.

    The new text leaves no such choice open, and gives the same run. Raises ValueError, with the keys to write by hand,
    where a body has no table of its own in the text, or where the table has the key already.
    """
    text, changes = case.text, list(changed_keys(case, resolved.case))
    for body, table, key, value in changes:
        reason = next(
            (advice.reason for advice in resolved.advice if advice.body == body and advice.decision == key), ""
        )
        text = with_key(text, body, table, key, value, reason)
    if not changes or _has_resolved_bodies(text, case, resolved.case):
        return text
    lines = [
        f"bodies.{body}.{f'{table}.' if table else ''}{key} = {toml(value)}" for body, table, key, value in changes
    ]
    raise ValueError(
        f"{case.path.name}: the advice cannot be written into this case, because a body has no table of its own or has "
        f"the key already. Add by hand: {'; '.join(lines)}"
    )


def changed_keys(case: Case, resolved: Case) -> Iterator[tuple[str, str, str, Any]]:
    """Body, inner table (empty for the body's own), key and value of every choice that was filled in."""
    for name, new in resolved.bodies.items():
        old, inner = case.bodies[name], INNER.get(getattr(new, "kind", ""))
        if getattr(old, "strain", None) != getattr(new, "strain", None):
            yield name, "", "strain", getattr(new, "strain", None)
        if inner is None or getattr(new, inner) is None:
            continue
        old_values, new_values = (getattr(table, inner).model_dump() for table in (old, new))
        yield from ((name, inner, key, value) for key, value in new_values.items() if value != old_values[key])


def with_key(text: str, body: str, table: str, key: str, value: Any, reason: str = "") -> str:
    """The text with another key in [bodies.<body>], or in an inner table of it; unchanged where there is none."""
    entry = f"{key} = {toml(value)}"
    comment = f" # {reason}" if reason else ""
    if table and (header := _header(text, f"bodies.{body}.{table}")):
        return f"{text[:header]}{entry}{comment}\n{text[header:]}"
    body_header = _header(text, f"bodies.{body}")
    if not body_header:
        return text
    if not table:
        return f"{text[:body_header]}{entry}{comment}\n{text[body_header:]}"
    rest = re.compile(r"^\s*\[", re.MULTILINE).search(text, body_header)
    end = len(text) if rest is None else rest.start()
    inline = re.compile(rf"^\s*{table}\s*=\s*\{{", re.MULTILINE).search(text, body_header, end)
    if inline is None:
        return f"{text[:body_header]}{table}.{entry}{comment}\n{text[body_header:]}"
    close = _closing(text, inline.end())
    return f"{text[:close].rstrip()}, {entry} {text[close:]}"


def _header(text: str, name: str) -> int:
    """Index in the text after the line of a table's header; 0 where there is none."""
    pattern = r"\s*\.\s*".join(rf"[\"']?{re.escape(part)}[\"']?" for part in name.split("."))
    match = re.search(rf"^[ \t]*\[\s*{pattern}\s*\][^\n]*\n", text, re.MULTILINE)
    return 0 if match is None else match.end()


def _closing(text: str, start: int) -> int:
    """Index of the brace that closes the inline table whose content begins at `start`."""
    depth, quote = 1, ""
    for k in range(start, len(text)):
        letter = text[k]
        if quote:
            quote = "" if letter == quote else quote
        elif letter in "\"'":
            quote = letter
        elif letter in "{}":
            depth += 1 if letter == "{" else -1
            if not depth:
                return k
    return len(text)


def toml(value: Any) -> str:
    """A value as TOML.

    >>> toml({"TIP": ["z", "ry"], "2 b": True})
    '{ TIP = ["z", "ry"], "2 b" = true }'
    """
    if isinstance(value, Mapping):
        keys = {key: key if re.fullmatch(r"[\w-]+", key, re.ASCII) else json.dumps(key) for key in value}
        return f"{{ {', '.join(f'{keys[key]} = {toml(entry)}' for key, entry in value.items())} }}" if value else "{}"
    if isinstance(value, list | tuple):
        return f"[{', '.join(map(toml, value))}]"
    return repr(float(value)) if isinstance(value, float) else json.dumps(value)


def _has_resolved_bodies(text: str, case: Case, resolved: Case) -> bool:
    """Whether the text parses to a case with the same bodies as the resolved case."""
    try:
        parsed = parse_case(text, case.path)
    except CaseError:
        return False
    return all(parsed.bodies[name].model_dump() == table.model_dump() for name, table in resolved.bodies.items())
