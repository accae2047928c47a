"""Options of members take units, are held to them, and are all listed where a reader looks."""

from __future__ import annotations

import tomllib
from pathlib import Path

import jsonschema
import pytest

from femflex.case import CaseError, read_case
from femflex.case.options import read_options
from femflex.case.schema import json_schema
from femflex.fem import FAMILIES
from femflex.fem.option import OPTIONS
from femflex.pipeline.case_bodies import build_body

MEMBERS = Path(__file__).resolve().parents[2] / "docs" / "howto" / "members.md"
PLAIN = 'material = "aluminium" }'
HELD = ('clamp = "ROOT"', 'clamp = ["ROOT", "TIP"]')
BENT = 'initial = { marker = "tip", displacement = [0, "10 mm", 0] }'


def boom(craft: str, options: str) -> str:
    """The craft with options of its boom, held at both ends so that a prestress stays."""
    return (
        craft.replace(PLAIN, f'material = "aluminium", options = {{ {options} }} }}').replace(*HELD).replace(BENT, "")
    )


def member(path: Path):
    return read_case(path).bodies["boom"].members[0]  # type: ignore[union-attr]


def test_a_prestress_with_a_unit_is_that_in_newtons(craft: str, write_case):
    with_unit = member(write_case(boom(craft, 'prestress = "0.5 kN", thermal_strain = "0.01 %", extent = "300 cm"')))
    assert with_unit.options == {"prestress": 500.0, "thermal_strain": 1e-4, "extent": 3.0}
    first = [
        build_body(read_case(write_case(boom(craft, f"prestress = {text}"))), "boom").omega[0]
        for text in ("0.0", "500", '"500 N"')
    ]
    assert first[1] == first[2] > first[0]


@pytest.mark.parametrize(
    ("options", "told"),
    [
        ('prestress = "500 Pa"', r"prestress: found '500 Pa', which is .*; expected a force"),
        ('prestress = "500"', r"prestress: found '500' without a unit"),
        ("prestress = [1, 2, 3]", r"prestress: found .*; expected a force, a number"),
        ("orientation = [0, 1]", r"orientation: found 2 entries; expected a list of 3"),
        ("ordr = 4", r"beam on group 'BOOM' has no option 'ordr'; .* Did you mean 'order'"),
    ],
)
def test_options_that_do_not_fit_are_told_of(craft: str, write_case, options: str, told: str):
    with pytest.raises(CaseError, match=told):
        build_body(read_case(write_case(boom(craft, options))), "boom")


def test_the_schema_lists_the_options_of_every_family():
    schema = json_schema()
    given = {entry["if"]["properties"]["family"]["const"]: entry for entry in schema["$defs"]["MemberTable"]["allOf"]}
    for family in FAMILIES:
        listed = given[family]["then"]["properties"]["options"]["properties"]
        assert set(listed) == set(OPTIONS[family])
        assert all(entry["description"] for entry in listed.values())


def test_options_that_are_refused_do_not_fit_the_schema_either(craft: str):
    check = jsonschema.Draft202012Validator(json_schema())
    assert check.is_valid(tomllib.loads(boom(craft, 'prestress = "500 N", order = 6')))
    assert not check.is_valid(tomllib.loads(boom(craft, "ordr = 6")))
    assert not check.is_valid(tomllib.loads(boom(craft, "prestress = [1, 2, 3]")))


@pytest.mark.parametrize("family", sorted(FAMILIES))
def test_the_page_of_members_lists_the_options_of_every_family(family: str):
    row = next(line for line in MEMBERS.read_text(encoding="utf-8").splitlines() if line.startswith(f"| `{family}`"))
    assert {name for name in OPTIONS[family] if f"`{name}`" in row} == set(OPTIONS[family])


def test_fields_of_shells_are_formulas_of_place():
    given = {
        "thickness": {"formula": "0.002 * (1 + x)"},
        "axis": {"formula": ["-y", "x", "0"]},
        "density": "2.7 g/cm^3",
    }
    found = read_options("shell", given)
    assert found["thickness"] == "0.002 * (1 + x)" and found["axis"] == ("-y", "x", "0")
    assert found["density"] == pytest.approx(2700.0)


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"thickness": {"formulas": "x"}}, "thickness: found .* a field is a number, or { formula"),
        ({"thickness": {"formula": ["x", "y", "z"]}}, "thickness: found 3 formulas; it takes 1"),
        ({"axis": {"formula": "x"}}, "axis: found 1 formulas; it takes 3"),
        ({"extra_mass": "2 kg"}, "extra_mass: found '2 kg'"),
    ],
)
def test_fields_that_are_no_formulas_are_refused(given, words):
    with pytest.raises(ValueError, match=words):
        read_options("shell", given)
