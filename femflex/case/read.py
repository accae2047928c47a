"""TOML -> Case, with every problem of the file reported together."""

from __future__ import annotations

import os
import re
import tomllib
from collections.abc import Iterable, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from femflex.case.body import FlexibleTable
from femflex.case.case import Case
from femflex.case.changed import changed_tables, numbered_path
from femflex.case.control import warn_of_doubtful_control
from femflex.case.crosscheck import cross_problems
from femflex.case.magnitudes import warn_of_doubtful_magnitudes
from femflex.case.outline import Outline, outline, outline_of
from femflex.case.problems import CaseError, Problem, near
from femflex.case.sentences import schema_problems
from femflex.case.suspicion import warn_of_doubtful_numbers

FEW = 8  # names of other case files that a message lists
DEEPEST = 20  # levels of tables and lists; schema and motions (sums of tables) need ten
DEPTH_ALLOWED = f"a case has at most {DEEPEST} levels, so write it flatter"


def read_case(path: str | Path) -> Case:
    """The case in a TOML file, checked as far as it can be without reading meshes.

    Raises CaseError with all problems of the file; warns (PhysicsWarning) of numbers that look like another unit.
    """
    path = Path(path)
    return parse_case(_text(path), path)


def parse_case(text: str, path: Path = Path("case.toml")) -> Case:
    """The case in a text; files it names are relative to the folder of `path`.

    Raises CaseError with all problems of the text.
    """
    return _checked(_toml(text, path), path, text)


def _checked(raw: dict[str, Any], path: Path, text: str | None = None, known: Mapping[str, Any] | None = None) -> Case:
    """The case of tables, and the text in which they stand, if any. Raises CaseError with all their problems.

    known: the same tables, with those that were read before as they are.
    """
    if deep := too_deep(raw):
        raise CaseError(path.name, [deep])
    problems: list[Problem] = []
    case = None
    try:
        case = _validated(raw, known)
    except ValidationError as error:
        problems += schema_problems(Case, raw, error)
    parts = outline(raw) if case is None else outline_of(case, raw)
    problems += cross_problems(parts, path.parent)
    if problems or case is None:
        problems += _mesh_problems(parts, path.parent)
        raise CaseError(path.name, problems)
    case._path, case._text, case._raw = path, text, raw
    case._parts = {key: getattr(case, key) for key in raw if hasattr(case, key)}
    warn_of_doubtful_numbers(raw, case)
    warn_of_doubtful_magnitudes(case)
    warn_of_doubtful_control(case)
    return case


def _validated(raw: dict[str, Any], known: Mapping[str, Any] | None) -> Case:
    if known is not None:
        with suppress(ValidationError):  # with its places, from the tables as they are written
            return Case.model_validate(known)
    return Case.model_validate(raw)


def with_values(case: Case, values: Mapping[str, Any]) -> Case:
    """A case in which these values stand at their key paths: `with_values(case, {"bodies.hub.mass": 410.0})`.

    Values are those of a case file: SI numbers, or texts with a unit. Entries of lists go by their name
    ("joints.hinge.stiffness"), or by their number from 0 ("loads.0.force"). The whole case is checked anew.
    Raises CaseError for a path that leads nowhere, and for every problem of the changed case.
    """
    if not case.tables:
        raise ValueError("this case was not read from a file or a text, so it has no keys to change by their path")
    values = {numbered_path(case.tables, path): value for path, value in values.items()}
    try:
        raw = changed_tables(case.tables, values, case.path.name)
    except ValueError as error:
        raise CaseError(case.path.name, [Problem("", str(error))]) from None
    return _checked(raw, case.path, known=_unchanged(case, raw, values))


def _unchanged(case: Case, raw: Mapping[str, Any], paths: Iterable[str]) -> dict[str, Any]:
    """The tables of a case in which these key paths are changed, those that hold none of them as they were read."""
    heads = {tuple(path.split(".")[:2]) for path in paths}
    changed = {head[0] for head in heads}
    out = {key: value if key in changed else case.parts.get(key, value) for key, value in raw.items()}
    for key in changed & case.parts.keys():
        new = {head[1] for head in heads if head[0] == key and len(head) > 1}
        value, read = raw[key], case.parts[key]
        if (key,) in heads or not new:
            continue  # the whole table is another
        if key == "bodies":
            out[key] = {name: table if name in new else read.get(name, table) for name, table in value.items()}
        elif isinstance(value, list):
            out[key] = [table if str(k) in new else read[k] for k, table in enumerate(value)]
    return out


def _mesh_problems(parts: Outline, folder: Path) -> list[Problem]:
    """What bodies without mistakes of their own ask of their meshes in vain, to be reported with the other problems."""
    from femflex.case.mesh_groups import group_problems

    bodies = {name: body for name, body in parts.bodies.items() if isinstance(body, FlexibleTable)}
    return [
        p
        for name, body in bodies.items()
        if body.mesh is not None and os.path.isfile(folder / body.mesh)
        for p in group_problems(name, body, folder)
    ]


def _not_there(path: Path) -> str:
    known = sorted(p.name for p in path.parent.glob("*.toml")) if path.parent.is_dir() else []
    text = near(path.name, known)
    if not near(path.stem, [Path(name).stem for name in known]).startswith("did you"):
        text = near("", known)  # alike in the suffix alone
    if path.suffix != ".toml" and not text.startswith("did you"):
        return "there is no such file; give the name of one that is there"
    few = len(known) <= FEW or text.startswith("did you")
    return f"there is no such case file; {text if few else f'{len(known)} others are there, such as {known[0]!r}'}"


def _text(path: Path) -> str:
    if path.is_dir():
        raise CaseError(str(path), [Problem("", "found a folder; name a case file (TOML) in it")])
    try:
        return path.read_text(encoding="utf-8-sig")  # editors on Windows begin files with a mark
    except FileNotFoundError:
        raise CaseError(str(path), [Problem("", _not_there(path))]) from None
    except UnicodeDecodeError:
        raise CaseError(str(path), [Problem("", "this file is not text; a case is a TOML file in UTF-8")]) from None
    except OSError as error:
        raise CaseError(str(path), [Problem("", f"this file cannot be read ({error.strerror})")]) from None


def _toml(text: str, path: Path) -> dict[str, Any]:
    try:
        return tomllib.loads(text)
    except RecursionError:
        raise CaseError(
            path.name, [Problem("", f"this file nests tables or lists too deeply; {DEPTH_ALLOWED}")]
        ) from None
    except tomllib.TOMLDecodeError as error:
        match = re.fullmatch(r"(.*) \(at (?:line (\d+), column (\d+)|end of document)\)", str(error))
        found_text = match[1] if match else str(error)
        line = int(match[2]) if match and match[2] else text.count("\n") + 1
        content = text.splitlines()[line - 1].strip() if 0 < line <= len(text.splitlines()) else ""
        where = f"line {line}"
        hint = (
            '; text goes in quotes, such as "33 m"'
            if "Invalid value" in found_text or "Expected newline" in found_text
            else ""
        )
        if path.suffix.lower() not in ("", ".toml"):
            hint = f"; to make a case of a deck or a mesh: femflex new my_craft.toml --deck {path.name}, or --mesh"
        raise CaseError(
            path.name, [Problem(where, f"this is not TOML, {found_text[0].lower()}{found_text[1:]}: {content!r}{hint}")]
        ) from None
    except ValueError:  # a whole number of more digits than Python reads
        raise CaseError(path.name, [Problem("", "this file holds a whole number of thousands of digits")]) from None


def too_deep(raw: dict[str, Any]) -> Problem | None:
    """The problem of tables and lists inside one another beyond DEEPEST, found without recursion."""
    level: list[tuple[str, Any]] = [("", raw)]
    for _ in range(DEEPEST):
        level = [
            (where or str(key), entry)
            for where, value in level
            for key, entry in (value.items() if isinstance(value, dict) else enumerate(value))
            if isinstance(entry, dict | list)
        ]
    return (
        Problem(level[0][0], f"found tables or lists nested deeper than {DEEPEST}; {DEPTH_ALLOWED}") if level else None
    )
