"""Examples of the tables of a case: the shortest one of the shipped cases, in its own words."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

from femflex.case.changed import toml_text

Schema = dict[str, Any]
TOP = Path(__file__).resolve().parents[2]
BLOCK = re.compile(r"^```toml\n(.*?)^```", re.DOTALL | re.MULTILINE)
LONGEST = 1200  # letters of an example


@dataclass(frozen=True)
class Use:
    """A table as a case has it.

    source  file of which it is, from the top of the repository
    path  keys that lead to it; "[]" for an entry of a list
    """

    source: str
    path: tuple[str, ...]
    table: dict[str, Any]

    def text(self) -> str:
        """The table as TOML, with the names that lead to it."""
        whole: Any = self.table
        for key in reversed(self.path):
            whole = [whole] if key == "[]" else {key: whole}
        return toml_text(whole).strip()


@cache
def sources() -> tuple[Use, ...]:
    """All shipped cases, the fragments of the how-to pages, and those of the files beside this one."""
    files = [*sorted((TOP / "cases").glob("*.toml")), *sorted(Path(__file__).parent.glob("*.toml"))]
    texts = [(path, path.read_text(encoding="utf-8")) for path in files]
    for page in sorted((TOP / "docs" / "howto").glob("*.md")):
        texts += [(page, text) for text in BLOCK.findall(page.read_text(encoding="utf-8"))]
    return tuple(Use(path.relative_to(TOP).as_posix(), (), tomllib.loads(text)) for path, text in texts)


def uses_of(parents: Sequence[Use], key: str, definition: Schema) -> list[Use]:
    """The tables of one kind that tables hold under a key: one, a list of them, or some by name."""
    return [
        use
        for parent in parents
        for use in _found(parent.table.get(key), parent.source, (*parent.path, key), definition)
    ]


def _found(value: Any, source: str, path: tuple[str, ...], definition: Schema) -> Iterator[Use]:
    if isinstance(value, list):
        for entry in value:
            yield from _found(entry, source, (*path, "[]"), definition)
    elif isinstance(value, dict):
        keys = definition.get("properties", {}) if _is_of(value, definition) else {}
        if keys:
            yield Use(source, path, value)
        for name, entry in value.items():
            if name not in keys and isinstance(entry, dict) and _is_of(entry, definition):
                yield Use(source, (*path, name), entry)


def _is_of(table: dict[str, Any], definition: Schema) -> bool:
    """Whether a table has the keys of a kind, and selects it where there are several."""
    properties = definition.get("properties", {})
    for key in ("kind", "method"):
        const = properties.get(key, {}).get("const")
        if const is not None and table.get(key, properties[key].get("default")) != const:
            return False
    return bool(table) and (set(table) <= set(properties) or isinstance(definition.get("additionalProperties"), dict))


def named_uses(parents: Sequence[Use], definition: Schema) -> list[Use]:
    """The tables of one kind that tables hold under names of the user, such as those of [expect]."""
    return [use for parent in parents for name in parent.table for use in uses_of([parent], name, definition)]


def law_uses() -> list[Use]:
    """The laws of joints."""
    joints = [Use(case.source, ("joints", "[]"), joint) for case in sources() for joint in case.table.get("joints", [])]
    return [
        Use(joint.source, (*joint.path, "laws", "[]"), law) for joint in joints for law in joint.table.get("laws", [])
    ]


def motion_uses() -> list[Use]:
    """The motions of revolute joints as tables."""
    joints = [Use(case.source, ("joints", "[]"), joint) for case in sources() for joint in case.table.get("joints", [])]
    motions = [(joint, joint.table["motion"]["angle"]) for joint in joints if "angle" in joint.table.get("motion", {})]
    return [
        Use(joint.source, (*joint.path, "motion", "angle"), motion)
        for joint, motion in motions
        if isinstance(motion, dict)
    ]


def example(uses: Sequence[Use]) -> str:
    """The shortest example of at least two keys, in a block of TOML; "" where there is none."""
    texts = {use.text(): use.source for use in uses if len(use.table) > 1} or {use.text(): use.source for use in uses}
    texts = {text: source for text, source in texts.items() if len(text) <= LONGEST}
    for folder in ("cases/", "docs/howto/", ""):
        if found := {text: source for text, source in texts.items() if source.startswith(folder)}:
            text = min(found, key=len)
            path = Path(found[text])
            origin = f"From [{path.name}](../{'../cases' if folder == 'cases/' else 'howto'}/{path.name}):\n\n"
            return f"\n{origin if folder else ''}```toml\n{text}\n```\n"
    return ""
