"""A copy of a case's text with the advice written into the tables of its bodies."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Mapping
from typing import Any

from femflex.case.case import Case
from femflex.case.problems import CaseError
from femflex.case.read import parse_case
from femflex.pipeline.decisions import Decided

INNER = {"flexible": "reduction", "analytic": "functions"}  # the table in which a body says its shapes, by its kind


def advised_text(case: Case, decided: Decided) -> str:
    """The text of a case with what was chosen for its bodies as keys of their tables, each with its reason.

    It says what the case came to without them: what is read of it has nothing left open that advice decides. Raises
    ValueError, with the keys to write by hand, where the text is laid out otherwise than in tables of bodies.
    """
    text, asked = case.text, list(changed_keys(case, decided.case))
    for body, table, key, value in asked:
        reason = next((one.reason for one in decided.advice if one.body == body and one.decision == key), "")
        text = with_key(text, body, table, key, value, reason)
    if not asked or _same(text, case, decided.case):
        return text
    lines = [f"bodies.{body}.{f'{table}.' if table else ''}{key} = {toml(value)}" for body, table, key, value in asked]
    raise ValueError(
        f"{case.path.name}: the advice cannot be written into this case, because a body has no table of its own or has "
        f"the key already. Add by hand: {'; '.join(lines)}"
    )


def changed_keys(case: Case, decided: Case) -> Iterator[tuple[str, str, str, Any]]:
    """Body, inner table (or none), key and value of all that was written out."""
    for name, new in decided.bodies.items():
        old, inner = case.bodies[name], INNER.get(getattr(new, "kind", ""))
        if getattr(old, "strain", None) != getattr(new, "strain", None):
            yield name, "", "strain", getattr(new, "strain", None)
        if inner is None or getattr(new, inner) is None:
            continue
        was, now = (getattr(table, inner).model_dump() for table in (old, new))
        yield from ((name, inner, key, value) for key, value in now.items() if value != was[key])


def with_key(text: str, body: str, table: str, key: str, value: Any, reason: str = "") -> str:
    """The text with a key more in [bodies.<body>], or in an inner table of it; unchanged where there is none."""
    entry = f"{key} = {toml(value)}"
    comment = f" # {reason}" if reason else ""
    if table and (found := _header(text, f"bodies.{body}.{table}")):
        return f"{text[:found]}{entry}{comment}\n{text[found:]}"
    start = _header(text, f"bodies.{body}")
    if not start:
        return text
    if not table:
        return f"{text[:start]}{entry}{comment}\n{text[start:]}"
    rest = re.compile(r"^\s*\[", re.MULTILINE).search(text, start)
    end = len(text) if rest is None else rest.start()
    inline = re.compile(rf"^\s*{table}\s*=\s*\{{", re.MULTILINE).search(text, start, end)
    if inline is None:
        return f"{text[:start]}{table}.{entry}{comment}\n{text[start:]}"
    close = _closing(text, inline.end())
    return f"{text[:close].rstrip()}, {entry} {text[close:]}"


def _header(text: str, name: str) -> int:
    """Place after the line of a table's header; 0 where there is none."""
    pattern = r"\s*\.\s*".join(rf"[\"']?{re.escape(part)}[\"']?" for part in name.split("."))
    found = re.search(rf"^[ \t]*\[\s*{pattern}\s*\][^\n]*\n", text, re.MULTILINE)
    return 0 if found is None else found.end()


def _closing(text: str, start: int) -> int:
    """Place of the brace that closes the inline table whose content starts there."""
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


def _same(text: str, case: Case, decided: Case) -> bool:
    """Whether a text says of its bodies what was decided."""
    try:
        found = parse_case(text, case.path)
    except CaseError:
        return False
    return all(found.bodies[name].model_dump() == table.model_dump() for name, table in decided.bodies.items())
