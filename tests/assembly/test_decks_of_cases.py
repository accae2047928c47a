"""Bodies of cases from decks: groups and supports by name, replaced values and members, and mistakes."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from femflex.assembly import build_part
from femflex.case import CaseError
from femflex.case.read import parse_case
from femflex.warning import PhysicsWarning

MESHES = Path(__file__).resolve().parents[2] / "meshes"
CASE = """
title = "deck"
[run]
duration = "1 s"
[attitude]
frame = "inertial"
[bodies.mast]
kind = "flexible"
deck = "mast.bdf"
units = "mm-t-s"
{more}
reduction = {{ method = "cantilever", clamp = {clamp}, modes = 3 }}
strain = "linear"
markers = {{ instrument = {{ group = "node_100" }} }}
[[joints]]
kind = "weld"
child = "mast"
child_marker = "instrument"
"""


def body(more: str = "", clamp: str = '"supports"', units: str = "mm-t-s"):
    text = CASE.format(more=more, clamp=clamp).replace("mm-t-s", units)
    return build_part(parse_case(text, MESHES / "case.toml"), "mast")


def test_supports_of_case_control_hold_as_the_named_set_and_as_the_node_do():
    one, two, three = body(), body(clamp='"spc_1"'), body(clamp='"node_1"')
    assert one.omega == pytest.approx(two.omega, rel=1e-12)
    assert one.omega == pytest.approx(three.omega, rel=1e-12)
    assert one.markers["instrument"].position == pytest.approx([3.0, 0, 0])


def test_values_of_the_deck_are_replaced():
    """Four times the stiffness of both planes doubles the frequencies of bending."""
    found = body('overrides = { mat_1 = { E = "280 GPa" } }').omega
    assert found[:2] == pytest.approx(2 * body().omega[:2], rel=1e-3)


def test_a_member_of_the_case_replaces_the_elements_of_its_property():
    more = 'members = [{ group = "pid_3", family = "beam", section = "rod", material = "steel" }]'
    text = CASE.format(more=more, clamp='"supports"')
    text += (
        '[materials.steel]\nE = "210 GPa"\nnu = 0.3\ndensity = 0\n[sections.rod]\nkind = "circle"\nradius = "20 mm"\n'
    )
    found = build_part(parse_case(text, MESHES / "case.toml"), "mast").omega[0]
    EI = 210e9 * np.pi / 4 * 0.02**4
    assert found == pytest.approx(np.sqrt(3 * EI / (4.0 * 3.0**3)), rel=3e-3)  # a mass of 4 kg on a massless cantilever


def test_units_that_make_no_sense_are_warned_of():
    with pytest.warns(PhysicsWarning, match=r"bodies.mast.deck: read in m-kg-s it has .*In mm-t-s its materials"):
        body(units="m-kg-s")


@pytest.mark.parametrize(
    ("more", "clamp", "sentence"),
    [
        ("", '"spc_2"', r"bodies.mast.reduction.clamp: found 'spc_2'; did you mean 'spc_1'"),
        ("", '"node_99"', r"bodies.mast.deck: mast.bdf has no node 99 .*near it are"),
        ('mesh = "panel.msh"', '"spc_1"', r"found mesh and deck; give one of them"),
        ('mesh_unit = "mm"', '"spc_1"', r"found mesh_unit or groups with a deck; give units"),
        ("overrides = { pid_9 = { A = 1 } }", '"spc_1"', r"bodies.mast.deck: .*override of 'pid_9': the deck has no"),
        ('overrides = { pid_3 = { A = "2 kg" } }', '"spc_1"', r"pid_3.A: "),
    ],
)  # fmt: skip
def test_mistakes_are_named_by_key(more, clamp, sentence):
    with pytest.raises(CaseError) as found:
        body(more, clamp)
    assert re.search(sentence, str(found.value), re.S), str(found.value)


def test_supports_of_case_control_are_asked_for_where_it_names_none(tmp_path: Path):
    deck = (MESHES / "mast.bdf").read_text(encoding="utf-8")
    (tmp_path / "mast.bdf").write_text(deck.replace("SPC = 1\n", ""), encoding="utf-8")
    text = "reduction.clamp: found 'supports', and case control of mast.bdf names no set of supports; its sets are "
    with pytest.raises(CaseError, match=re.escape(f"bodies.mast.{text}['spc_1']")):
        build_part(parse_case(CASE.format(more="", clamp='"supports"'), tmp_path / "case.toml"), "mast")


def test_a_body_needs_a_mesh_or_a_deck_and_a_mesh_needs_members():
    text = CASE.format(more="", clamp='"spc_1"').replace('deck = "mast.bdf"\nunits = "mm-t-s"\n', "")
    with pytest.raises(CaseError, match="found neither mesh nor deck; give the file of one"):
        parse_case(text, MESHES / "case.toml")
    text = CASE.format(more="", clamp='"spc_1"').replace(
        'deck = "mast.bdf"\nunits = "mm-t-s"\n', 'mesh = "strip.bdf"\n'
    )
    with pytest.raises(CaseError, match="found no members; name the groups of the mesh that become structure"):
        parse_case(text, MESHES / "case.toml")
