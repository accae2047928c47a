"""The JSON Schema that is printed accepts the shipped cases and refuses what the reader refuses."""

from __future__ import annotations

import tomllib
from pathlib import Path

import jsonschema
import pytest

from femflex.case import CaseError, read_case
from femflex.case.schema import json_schema, schema_text

CASES = sorted((Path(__file__).resolve().parents[2] / "cases").glob("*.toml"))


@pytest.fixture(scope="module")
def validator():
    schema = json_schema()
    jsonschema.Draft202012Validator.check_schema(schema)
    return jsonschema.Draft202012Validator(schema)


@pytest.mark.parametrize("path", CASES, ids=[path.stem for path in CASES])
def test_shipped_cases_fit_the_schema(path, validator):
    problems = [
        f"{list(error.absolute_path)}: {error.message[:200]}"
        for error in validator.iter_errors(tomllib.loads(path.read_text()))
    ]
    assert not problems, problems


@pytest.mark.parametrize(
    ("old", "new"),
    [("duration =", "durtion ="), ("mass = 200", "mass = [200]"), ('kind = "rigid"', 'kind = "ridgid"')],
    ids=["unknown key", "wrong kind of value", "unknown kind"],
)
def test_mistakes_do_not_fit_it(old, new, craft, validator):
    assert validator.is_valid(tomllib.loads(craft)) and not validator.is_valid(tomllib.loads(craft.replace(old, new)))


def keys_of(node, path=""):
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
    schema = json_schema()
    found = [(path, about) for path, about in keys_of(schema) if not path.endswith(".options")]
    assert len(found) > 500
    bare = [path for path, about in found if len(about.get("description", "").split()) < 2]
    assert not bare


def test_descriptions_are_short_sentences():
    long = [
        (path, sentence)
        for path, about in keys_of(json_schema())
        for sentence in about.get("description", "").split(". ")
        if len(sentence.split()) > 40
    ]
    assert not long


def test_a_missing_key_is_told_with_its_meaning(write_case, craft):
    path = write_case(craft.replace("mass = 200\n", ""))
    with pytest.raises(CaseError, match=r"mass: this key is missing \(total mass\)"):
        read_case(path)


def test_shipped_cases_begin_with_the_schema_that_stands_next_to_them():
    """Made by `femflex.case.schema.schema_text`; an editor completes and checks the keys of a case by it."""
    folder = Path(__file__).resolve().parents[2] / "cases"
    assert (folder / "case.schema.json").read_text(encoding="utf-8") == schema_text(), "run python cases/make_schema.py"
    for path in folder.glob("*.toml"):
        assert path.read_text(encoding="utf-8").startswith("#:schema case.schema.json\n"), path.name
