"""Loads of a case near what buckles a body whose shapes would have it buckle later: reported with both numbers."""

import warnings

import pytest
from support.advised_bodies import noted_system

from femflex.case import read_case
from femflex.warning import PhysicsWarning

RUN = '\n[run]\nduration = "1 s"\noutput_step = 0.05\n'
LOAD = """
[[loads]]
name = "weight"
body = "boom"
marker = "tip"
force = [0, 0, -1400]
"""  # Prandtl's load on 3 m is 1827 N
STRIP = f"""{RUN}
[sections.strip]
kind = "stiffness"
EA = 2.8e9
EIy = 5.6e6
EIz = 1.4e4
GJ = 1.2e3
mass_per_length = 1.2
ry = 0.005
rz = 0.005

[bodies.boom]
kind = "flexible"
mesh = "boom.inp"
members = [{{ group = "BOOM", family = "beam", section = "strip", options = {{ orientation = [0, 1, 0] }} }}]
reduction = {{ method = "cantilever", clamp = "ROOT", modes = 4 }}
markers.tip = {{ group = "TIP" }}
strain = "condensed"
{LOAD}"""
PRANDTL = 4.0126 * (1.4e4 * 1.2e3) ** 0.5 / 3**2
PART = 1400 / PRANDTL * (1 - 1.4e4 / 5.6e6)  # the bend before
HELD = '\n[[joints]]\nkind = "weld"\nchild = "boom"\n'
ALONE = "modes = 4", "modes = 4, loads = {}"  # without the load's own shape
BEAM = f"""{RUN}
[bodies.boom]
kind = "analytic"
length = 3
EA = 2.8e9
EIy = 5.6e6
EIz = 1.4e4
GJ = 1.2e3
mass_per_length = 1.2
ry = 0.005
rz = 0.005
orientation = [0, 1, 0]
functions = {{ y = 4, z = 4, family = "polynomial" }}
strain = "condensed"
{LOAD}"""


def held(text):
    """A joint that holds the boom where its clamp is."""
    return HELD + ('child_marker = "ROOT"\n' if "ROOT" in text else "")


def told(write_case, text, *changes):
    """What is warned of when the boom is built in its system."""
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    with warnings.catch_warnings(record=True) as found:
        warnings.simplefilter("always")
        noted_system(read_case(write_case(text + held(text))))
    return [str(w.message) for w in found if w.category is PhysicsWarning]


def test_a_load_near_what_tips_a_strip_over_is_told_with_both_numbers(write_case):
    (text,) = told(write_case, STRIP, ALONE)
    assert text.startswith("bodies.boom: load 'weight' (1400 N) is") and part_of(text) == pytest.approx(PART, rel=5e-3)
    assert "but 0.655 of the buckling load of the reduced basis" in text and "`loads`" in text  # at 1.53 times the load


def test_the_loads_own_shape_or_a_small_load_leaves_nothing_to_tell(write_case):
    assert not told(write_case, STRIP, ("modes = 4", 'modes = 4, loads = { TIP = ["z"] }'))
    assert not told(write_case, STRIP, ("-1400", "-300"))
    (text,) = told(write_case, STRIP, ('"condensed"', '"linear"'))
    assert "shapes kept" not in text


def test_a_load_in_other_axes_is_told_of_as_it_acts_on_the_body(write_case):
    for force, count in (("[0, 0, -1400]", 1), ("[0, 1400, 0]", 0), ("[1400, 0, 0]", 0)):
        texts = told(write_case, STRIP, ALONE, ("[0, 0, -1400]", f'{force}\nframe = "inertial"'))
        assert [part_of(text) for text in texts] == pytest.approx([PART] * count, rel=5e-3)


@pytest.mark.parametrize(("torsion", "count"), [("", 1), (", torsion = 4", 0)])
def test_beams_on_functions_are_told_of_when_they_cannot_twist(write_case, torsion, count):
    texts = told(write_case, BEAM, ("z = 4,", f"z = 4{torsion},"))
    assert len(texts) == count
    assert [part_of(text) for text in texts] == pytest.approx([PART] * count, rel=5e-3)
    assert all("but 0 of the buckling load of the reduced basis" in text for text in texts)
    assert all("torsion included" in t for t in texts)


def test_of_two_strips_alike_the_loaded_one_is_told_of(write_case):
    strip = STRIP.replace(*ALONE)
    table = strip[strip.index("[bodies.boom]") : strip.index("[[loads]]")]
    spare = '[bodies.hub]\nkind = "rigid"\nmass = 1e3\ninertia = [1, 1, 1]\n' + table.replace("boom]", "spare]")
    for child in ("hub", "boom", "spare"):
        held = "" if child == "hub" else 'parent = "hub"\nchild_marker = "ROOT"\n'
        spare += f'[[joints]]\nkind = "weld"\nchild = "{child}"\n{held}'
    with warnings.catch_warnings(record=True) as found:
        warnings.simplefilter("always")
        noted_system(read_case(write_case(strip + spare)))
    assert ["bodies.boom: load 'weight'" in str(w.message) for w in found] == [True]


SILENT = ('strain = "condensed"\n', "")


def part_of(text):
    return float(text.split("N) is ")[1].split(" of the linear buckling load")[0])


def run_of(write_case, *changes):
    """The boom in its system, and what is warned of."""
    text = STRIP + '\n[[joints]]\nkind = "weld"\nchild = "boom"\nchild_marker = "ROOT"\n'
    for old, new in (("modes = 4", 'modes = 4, loads = { TIP = ["z"] }'), *changes):
        assert old in text
        text = text.replace(old, new)
    with warnings.catch_warnings(record=True) as found:
        warnings.simplefilter("always")
        body = noted_system(read_case(write_case(text))).bodies["boom"]
    return body, [str(w.message) for w in found if w.category is PhysicsWarning]


@pytest.mark.parametrize(("load", "form"), [(1400, "condensed"), (300, "linear")])
def test_a_body_that_does_not_say_is_condensed_from_a_quarter_of_what_tips_it_over(write_case, load, form):
    body, texts = run_of(write_case, SILENT, ("-1400", f"-{load}"))
    assert body.strain_form == form and not texts
    assert (form == "condensed") == ("load 'weight' (1400 N) is" in body.note)
    assert form == "linear" or part_of(body.note) == pytest.approx(1400 / PRANDTL, rel=0.01)


def test_a_linear_body_is_warned_of_a_load_that_may_tip_it_over(write_case):
    _, (text,) = run_of(write_case, ('"condensed"', '"linear"'))
    assert "load 'weight' (1400 N) is" in text and "of the linear buckling load; linear strain leaves this out" in text
    assert part_of(text) == pytest.approx(1400 / PRANDTL, rel=0.01)
    assert not run_of(write_case, ('"condensed"', '"linear"'), ("-1400", "-300"))[1]


@pytest.mark.slow
@pytest.mark.parametrize("frame", ["body", "inertial"])
def test_a_condensed_column_near_eulers_load_is_told_to_be_too_stiff(write_case, frame):
    """Euler's load of the clamped column of 3 m is 3838 N."""
    framed = f'\nframe = "{frame}"'
    for load, part in ((-3914.8, "1.02"), (-3262, ""), (3914.8, "")):
        _, texts = run_of(write_case, ("[0, 0, -1400]", f"[{load}, 0, 0]{framed}"))
        assert len([t for t in texts if "condensed strain gives too small a deflection" in t]) == bool(part)
        assert not part or any(f"is {part} of the linear buckling load" in t for t in texts)
    body, _ = run_of(write_case, SILENT, ("[0, 0, -1400]", f"[-3914.8, 0, 0]{framed}"))
    assert body.strain_form == "nonlinear" and "is 1.02 of the linear buckling load" in body.note
    body, texts = run_of(write_case, SILENT, ("[0, 0, -1400]", f"[-3262, 0, 0]{framed}"))
    assert body.strain_form == "nonlinear" and "is 0.85 of the linear buckling load" in body.note and not texts
