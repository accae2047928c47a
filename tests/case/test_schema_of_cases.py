"""The JSON Schema that is printed accepts the shipped cases and refuses what the reader refuses."""

from __future__ import annotations

import tomllib
from pathlib import Path

import jsonschema
import pytest

from femflex.case.schema import json_schema

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
