"""Advice is a value: the same from Python and from every verb, kept in the result file and in a copy of the case."""

from __future__ import annotations

import json
import tomllib
import warnings
from dataclasses import replace

import numpy as np
import pytest

import femflex as api
from femflex.advice import Advice, advice_from, notes_of
from femflex.case import read_case
from femflex.fem import Member, build_structure
from femflex.fem.sections import Circle
from femflex.fem.sections.materials import Material
from femflex.mesh import line
from femflex.pipeline.advised_case import with_key
from femflex.pipeline.decisions import decided
from femflex.reduction import cantilever_modes, reduce_structure, with_derivatives
from femflex.reduction.origin import Meshed, Origin
from femflex.system import Frame, System, weld
from femflex.warning import PhysicsWarning

SECTION, METAL = Circle(0.02), Material(70e9, 0.33, 2700.0)
EI, LINE, LENGTH = 70e9 * np.pi * 0.02**4 / 4, 2700.0 * np.pi * 0.02**2, 10.0


def blade(strain="linear"):
    """A round rod of 10 m, its set and its structure."""
    structure = build_structure(line([[0, 0, 0], [LENGTH, 0, 0]], 8), [Member("line", "beam", SECTION, METAL)])
    modes = cantilever_modes(structure, "start", 4)
    modes = modes if strain == "linear" else with_derivatives(structure, modes)
    return reduce_structure(structure, modes, strain=strain), Meshed(structure, modes)


def spinning(body, rate):
    """The body welded at its clamp into a frame that spins about z."""
    joint = weld(child="blade", parent=None, child_marker="start", parent_marker="origin")
    return System({"blade": body}, (joint,), frame=Frame("spinning", np.array([0.0, 0.0, rate])))


def test_python_is_told_of_linear_strain_in_a_spin_of_6_rad_per_s():
    """Southwell's coefficient of the flapping of a cantilever is 1.193: omega^2 = omega_0^2 + 1.193 Omega^2."""
    body, _ = blade()
    with pytest.warns(PhysicsWarning, match=r"body 'blade' has linear strain: turning at 6 rad/s may raise the first"):
        found = api.advise(spinning(body, 6.0), 10.0)
    (strain,) = [one for one in found if one.decision == "strain"]
    first = 1.8751**4 * EI / (LINE * LENGTH**4)
    assert (strain.body, strain.choice, strain.doubt) == ("blade", "condensed", True)
    assert strain.value == pytest.approx(np.sqrt(1.0 + 1.193 * 36.0 / first) - 1.0, rel=0.02)
    assert strain.limit is not None and strain.value > strain.limit


def test_nothing_is_said_against_a_body_that_knows_the_spin():
    body, source = blade("condensed")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        found = api.advise(spinning(body, 6.0), 10.0, {"blade": Origin(source)})
    assert not [one for one in found if one.doubt]


def test_a_body_at_rest_is_told_why_linear_strain_does():
    (one,) = [one for one in api.advise(spinning(blade()[0], 0.0), 10.0) if one.decision == "strain"]
    assert one.choice == "linear" and not one.doubt and "does not turn" in one.reason


@pytest.mark.slow
def test_what_bodies_were_reduced_from_lets_buckling_be_judged():
    body, source = blade()
    system = spinning(body, 0.0)
    euler = np.pi**2 * EI / (4 * LENGTH**2)
    end = replace(body.markers["start"], position=np.array([LENGTH, 0, 0]))
    assert end is not None
    load = api.Load("push", "blade", "end", force=np.array([-0.6 * euler, 0.0, 0.0]))
    structure, modes = source.structure, source.modes
    body = reduce_structure(structure, modes, {"end": "end"})
    system = replace(system, bodies={"blade": body}, loads=(load,))
    origin = Origin(Meshed(structure, modes, {"end": "end"}))
    found = api.advise(system, 10.0, {"blade": origin}, warn=False)
    (near,) = [one for one in found if one.decision == "buckling" and one.doubt]
    assert near.value == pytest.approx(0.6, rel=2e-3)


SPUN = ('rates = ["2 deg/s", 0, 0.01]', 'rates = [0, 0, "20 rad/s"]')


def test_check_run_and_python_say_the_same(craft, write_case, femflex):
    path = write_case(craft.replace(*SPUN).replace('duration = "10 s"', 'duration = "0.2 s"'))
    found = decided(read_case(path))
    note = found.notes["boom"]
    assert "strain is condensed: turning at 20" in note
    assert femflex("check", path)[1].count(note) == 1
    code, said, _ = femflex("run", path, "-o", "run.h5", "--no-pictures")
    assert code == 0 and note in said
    with api.open_run("run.h5") as run:
        kept = advice_from(run.attributes["advice"])
    assert [one.data() for one in kept] == [one.data() for one in found.advice]
    later = json.dumps([{**one.data(), "mood": "of a later version"} for one in kept])
    assert [one.data() for one in advice_from(later)] == [one.data() for one in kept]
    data = json.loads(femflex("check", path, "--json")[1])["bodies"]["boom"]
    assert data["advice"] == [one.data() for one in found.advice if one.body == "boom"]
    assert note in femflex("terms", "run.h5")[1]


def test_check_tells_of_a_strain_that_was_asked_for_and_does_not_do(craft, write_case, femflex):
    text = craft.replace(*SPUN).replace('kind = "flexible"', 'kind = "flexible"\nstrain = "linear"')
    code, _, wrong = femflex("check", write_case(text))
    assert code == 0 and "body 'boom' has linear strain: turning at 20" in wrong


@pytest.mark.slow
def test_the_advice_goes_into_a_copy_of_the_case_that_then_leaves_nothing_open(craft, write_case, femflex):
    path = write_case(craft.replace(*SPUN))
    assert femflex("check", path, "--write-advice")[0] == 0
    copy = path.with_name("craft_advised.toml")
    text = copy.read_text()
    assert 'strain = "condensed" # turning at 20' in text and "joints = " in text
    own, again = decided(read_case(path)), decided(read_case(copy))
    assert again.system.bodies["boom"].kinds == own.system.bodies["boom"].kinds
    assert not [one for one in again.advice if one.decision == "strain"]
    assert femflex("check", path, "--write-advice")[0] == 2  # it is there already
    assert femflex("check", path, "--write-advice", "--force")[0] == 0


def test_a_text_without_tables_of_bodies_is_left_to_the_hand(craft, write_case, femflex):
    start, end = craft.index("[bodies.boom]"), craft.index("[[joints]]")
    lines = [line for line in craft[start:end].splitlines()[1:] if line.strip()]
    dotted = "\n".join(f"bodies.boom.{line}" for line in lines)
    path = write_case(f"{dotted}\n{craft[:start]}{craft[end:]}")
    code, _, wrong = femflex("check", path, "--write-advice")
    assert code == 2 and "Add by hand: bodies.boom.strain = " in wrong


def test_notes_on_a_body_hold_what_was_chosen_and_neither_warnings_nor_what_its_shapes_tell_of():
    said = [
        Advice("boom", "strain", "linear", "it hardly bends"),
        Advice("boom", "shapes", None, "2 shapes more"),
        Advice("boom", "bend", None, "it bends by 30 %", doubt=True),
        Advice("boom", "joints", {}, "none"),
        Advice("", "craft", None, "of the craft"),
    ]
    assert notes_of(said) == {"boom": "strain is linear: it hardly bends; 2 shapes more"}


TEXT = """title = "x"
[bodies.boom]
kind = "flexible"
{more}
[bodies.hub]
mass = 1
"""


@pytest.mark.parametrize(
    ("more", "table", "key", "line"),
    [
        ("", "", "strain", 'strain = "condensed" # it spins'),
        ("", "reduction", "joints", "reduction.joints = { tip = ['x'] } # it spins"),
        ("reduction.modes = 3", "reduction", "joints", "reduction.joints = { tip = ['x'] } # it spins"),
        ("reduction = { modes = 3 }", "reduction", "joints", "reduction = { modes = 3, joints = { tip = ['x'] } }"),
        (
            'reduction = { at = { name = "a}b" }, modes = 3 } # so',
            "reduction",
            "joints",
            "reduction = { at = { name = \"a}b\" }, modes = 3, joints = { tip = ['x'] } } # so",
        ),
        ("[bodies.boom.reduction]\nmodes = 3", "reduction", "joints", "joints = { tip = ['x'] } # it spins\nmodes = 3"),
    ],
)
def test_a_key_goes_where_its_body_says_the_rest(more, table, key, line):
    value = "condensed" if key == "strain" else {"tip": ["x"]}
    text = with_key(TEXT.format(more=more), "boom", table, key, value, "it spins")
    assert line.replace("'", '"') in text
    found = tomllib.loads(text)["bodies"]["boom"]
    assert (found[table] if table else found)[key] == value
    assert tomllib.loads(text)["bodies"]["hub"] == {"mass": 1}


def test_a_body_without_a_table_is_left_as_it_is():
    text = "title = 'x'\nbodies.boom.mass = 1\n"
    assert with_key(text, "boom", "", "strain", "linear") == text
