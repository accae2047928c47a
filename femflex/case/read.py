"""Reader of case files: TOML -> Case, with all problems of the file reported together."""

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
from femflex.case.case import Case, case_class
from femflex.case.changed import changed_tables, numbered_path
from femflex.case.control import warn_of_doubtful_control
from femflex.case.crosscheck import cross_problems
from femflex.case.named_files import EphemerisError, with_ephemerides
from femflex.case.outline import Outline, outline_of_tables
from femflex.case.suspicion import warn_of_doubtful_magnitudes, warn_of_doubtful_numbers
from femflex.noun.problems import CaseError, Problem, suggestion_text
from femflex.noun.sentences import schema_problems

FEW = 8  # names of other case files that a message lists
DEEPEST = 20  # levels of tables and lists; schema and motions (sums of tables) need ten
DEPTH_ALLOWED = f"a case has at most {DEEPEST} levels, so write it flatter"


def read_case(path: str | Path) -> Case:
    """The case in a TOML file, checked as far as it can be without reading meshes.

    Raises CaseError with all problems of the file; warns (PhysicsWarning) of numbers that look like another unit.
    """
    path = Path(path)
    return parse_case(_file_text(path), path)


def parse_case(text: str, path: Path = Path("case.toml")) -> Case:
    """The case in a text; files it names are relative to the folder of `path`.

    Raises CaseError with all problems of the text.
    """
    return _checked_case(_toml_tables(text, path), path, text)


def _checked_case(
    raw: dict[str, Any], path: Path, text: str | None = None, partly_checked: Mapping[str, Any] | None = None
) -> Case:
    """The case of these tables, and of the text that contains them, if any. Raises CaseError with all problems.

    partly_checked: the same tables, in which unchanged parts are replaced by their checked tables.
    """
    if deep := depth_problem(raw):
        raise CaseError(path.name, [deep])
    problems: list[Problem] = []
    case = None
    try:
        case = _validated_case(with_ephemerides(raw, path.parent) or raw, with_ephemerides(partly_checked, path.parent))
    except EphemerisError as error:
        raise CaseError(path.name, [error.problem]) from None
    except ValidationError as error:
        problems += schema_problems(case_class(), raw, error)
    valid_parts = outline_of_tables(raw, case)
    problems += cross_problems(valid_parts, path.parent)
    if problems or case is None:
        problems += _mesh_problems(valid_parts, path.parent)
        raise CaseError(path.name, problems)
    case._path, case._text, case._raw = path, text, raw
    case._parts = {key: getattr(case, key) for key in raw if hasattr(case, key)}
    warn_of_doubtful_numbers(raw, case)
    warn_of_doubtful_magnitudes(case)
    warn_of_doubtful_control(case)
    return case


def _validated_case(raw: dict[str, Any], partly_checked: Mapping[str, Any] | None) -> Case:
    if partly_checked is not None:
        with suppress(ValidationError):  # the tables as written then give the errors their key paths
            return case_class().model_validate(partly_checked)
    return case_class().model_validate(raw)


def with_values(case: Case, values: Mapping[str, Any]) -> Case:
    """A case with these values at their key paths: `with_values(case, {"bodies.hub.mass": 410.0})`.

    Values are those of a case file: SI numbers, or texts with a unit. Entries of lists are addressed by their name
    ("joints.hinge.stiffness"), or by their number from 0 ("loads.0.force"). The whole case is checked again.
    Raises CaseError for a path that does not exist, and for every problem of the changed case.
    """
    if not case.tables:
        raise ValueError("this case was not read from a file or a text, so it has no keys to change by their path")
    values = {numbered_path(case.tables, path): value for path, value in values.items()}
    try:
        raw = changed_tables(case.tables, values, case.path.name)
    except ValueError as error:
        raise CaseError(case.path.name, [Problem("", str(error))]) from None
    return _checked_case(raw, case.path, partly_checked=_tables_with_unchanged_parts(case, raw, values))


def _tables_with_unchanged_parts(case: Case, raw: Mapping[str, Any], paths: Iterable[str]) -> dict[str, Any]:
    """The tables of a case after a change at these key paths, with the checked tables of all unchanged parts."""
    prefixes = {tuple(path.split(".")[:2]) for path in paths}
    changed = {head[0] for head in prefixes}
    out = {key: value if key in changed else case.parts.get(key, value) for key, value in raw.items()}
    for key in changed & case.parts.keys():
        new = {head[1] for head in prefixes if head[0] == key and len(head) > 1}
        value, former = raw[key], case.parts[key]
        if (key,) in prefixes or not new:
            continue  # the whole table is replaced
        if key == "bodies":
            out[key] = {name: table if name in new else former.get(name, table) for name, table in value.items()}
        elif isinstance(value, list):
            out[key] = [table if str(k) in new else former[k] for k, table in enumerate(value)]
    return out


def _mesh_problems(valid_parts: Outline, folder: Path) -> list[Problem]:
    """Problems of references to meshes by valid bodies, to be reported with the other problems."""
    from femflex.case.mesh_groups import group_problems

    bodies = {name: body for name, body in valid_parts.bodies.items() if isinstance(body, FlexibleTable)}
    return [
        p
        for name, body in bodies.items()
        if body.mesh is not None and os.path.isfile(folder / body.mesh)
        for p in group_problems(name, body, folder)
    ]


def _missing_file_text(path: Path) -> str:
    case_files = sorted(p.name for p in path.parent.glob("*.toml")) if path.parent.is_dir() else []
    text = suggestion_text(path.name, case_files)
    if not suggestion_text(path.stem, [Path(name).stem for name in case_files]).startswith("did you"):
        text = suggestion_text("", case_files)  # only the suffix is similar
    if path.suffix != ".toml" and not text.startswith("did you"):
        return "there is no such file; give the name of one that is there"
    list_all = len(case_files) <= FEW or text.startswith("did you")
    return (
        f"there is no such case file; "
        f"{text if list_all else f'{len(case_files)} others are there, such as {case_files[0]!r}'}"
    )


def _file_text(path: Path) -> str:
    if path.is_dir():
        raise CaseError(str(path), [Problem("", "found a folder; name a case file (TOML) in it")])
    try:
        return path.read_text(encoding="utf-8-sig")  # editors on Windows begin files with a mark
    except FileNotFoundError:
        raise CaseError(str(path), [Problem("", _missing_file_text(path))]) from None
    except UnicodeDecodeError:
        raise CaseError(str(path), [Problem("", "this file is not text; a case is a TOML file in UTF-8")]) from None
    except OSError as error:
        raise CaseError(str(path), [Problem("", f"this file cannot be read ({error.strerror})")]) from None


def _toml_tables(text: str, path: Path) -> dict[str, Any]:
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
        line_text = f"line {line}"
        hint = (
            '; text goes in quotes, such as "33 m"'
            if "Invalid value" in found_text or "Expected newline" in found_text
            else ""
        )
        if path.suffix.lower() not in ("", ".toml"):
            hint = f"; to make a case of a deck or a mesh: femflex new my_craft.toml --deck {path.name}, or --mesh"
        raise CaseError(
            path.name,
            [Problem(line_text, f"this is not TOML, {found_text[0].lower()}{found_text[1:]}: {content!r}{hint}")],
        ) from None
    except ValueError:  # a whole number of more digits than Python reads
        raise CaseError(path.name, [Problem("", "this file holds a whole number of thousands of digits")]) from None


def depth_problem(raw: dict[str, Any]) -> Problem | None:
    """The problem of tables and lists inside one another beyond DEEPEST, found without recursion."""
    level: list[tuple[str, Any]] = [("", raw)]
    for _ in range(DEEPEST):
        level = [
            (key_path or str(key), entry)
            for key_path, value in level
            for key, entry in (value.items() if isinstance(value, dict) else enumerate(value))
            if isinstance(entry, dict | list)
        ]
    return (
        Problem(level[0][0], f"found tables or lists nested deeper than {DEEPEST}; {DEPTH_ALLOWED}") if level else None
    )
