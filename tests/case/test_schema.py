"""The JSON Schema accepts the shipped cases, refuses what the reader refuses, and lists the options of every family."""

from __future__ import annotations

import tomllib
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any

import jsonschema
import pytest

from femflex.case.schema import json_schema, schema_text
from femflex.fem import FAMILIES
from femflex.fem.family import OPTIONS

ROOT = Path(__file__).resolve().parents[2]
CASES = sorted((ROOT / "cases").glob("*.toml"))
MEMBERS = ROOT / "docs" / "howto" / "members.md"
MATERIAL = 'material = "aluminium" }'


@cache
def schema() -> dict[str, Any]:
    return json_schema()


@cache
def validator() -> jsonschema.Draft202012Validator:
    jsonschema.Draft202012Validator.check_schema(schema())
    return jsonschema.Draft202012Validator(schema())


@pytest.mark.parametrize("path", CASES, ids=[path.stem for path in CASES])
def test_shipped_case_fits_the_schema(path: Path):
    tables = tomllib.loads(path.read_text(encoding="utf-8"))
    problems = [f"{list(error.absolute_path)}: {error.message[:200]}" for error in validator().iter_errors(tables)]
    assert not problems, problems


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("duration =", "durtion ="),
        ("mass = 200", "mass = [200]"),
        ('kind = "rigid"', 'kind = "ridgid"'),
        (MATERIAL, 'material = "aluminium", options = { ordr = 6 } }'),
        (MATERIAL, 'material = "aluminium", options = { prestress = [1, 2, 3] } }'),
    ],
    ids=["unknown key", "wrong type of value", "unknown kind", "unknown option", "wrong type of option"],
)
def test_mistake_does_not_fit_the_schema(old: str, new: str, craft: str):
    assert validator().is_valid(tomllib.loads(craft)) and not validator().is_valid(
        tomllib.loads(craft.replace(old, new))
    )
    sound = craft.replace(MATERIAL, 'material = "aluminium", options = { prestress = "500 N", order = 6 } }')
    assert validator().is_valid(tomllib.loads(sound))


def keys_of(node: Any, path: str = "") -> Iterator[tuple[str, Any]]:
    """Path and schema of every key that the schema names, `if` branches left out."""
    if isinstance(node, list):
        for k, entry in enumerate(node):
            yield from keys_of(entry, f"{path}[{k}]")
    elif isinstance(node, dict):
        for name, entry in node.get("properties", {}).items() if isinstance(node.get("properties"), dict) else ():
            yield f"{path}.{name}", entry
        for name, entry in node.items():
            if name != "if":
                yield from keys_of(entry, f"{path}.{name}")


def test_every_key_has_a_description():
    keys = [(path, about) for path, about in keys_of(schema()) if not path.endswith(".options")]
    assert len(keys) > 500
    assert not [path for path, about in keys if len(about.get("description", "").split()) < 2]


def test_shipped_schema_is_the_one_of_the_package():
    """Made by `femflex.case.schema.schema_text`; an editor completes and checks the keys of a case by it."""
    shipped = (ROOT / "cases" / "case.schema.json").read_text(encoding="utf-8")
    assert shipped == schema_text(), "run python cases/make_schema.py"
    for path in CASES:
        assert path.read_text(encoding="utf-8").startswith("#:schema case.schema.json\n"), path.name


@pytest.mark.parametrize("family", sorted(FAMILIES))
def test_options_of_a_family_are_in_the_schema_and_in_the_page_of_members(family: str):
    branches = {
        entry["if"]["properties"]["family"]["const"]: entry for entry in schema()["$defs"]["MemberTable"]["allOf"]
    }
    options = branches[family]["then"]["properties"]["options"]["properties"]
    assert set(options) == set(OPTIONS[family])
    assert all(entry["description"] for entry in options.values())
    row = next(line for line in MEMBERS.read_text(encoding="utf-8").splitlines() if line.startswith(f"| `{family}`"))
    assert {name for name in OPTIONS[family] if f"`{name}`" in row} == set(OPTIONS[family])
