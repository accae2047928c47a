"""Where the motion ahead cannot be estimated with rigid bodies, what is not assessed is printed."""

import pytest

from femflex.advice import motion_estimate as foresight

BEAM = """
[run]
duration = 1
samples = 11

[bodies.boom]
kind = "analytic"
length = 2
EA = 1e6
EIy = 10
EIz = 10
GJ = 10
mass_per_length = 1
functions = {{ y = 3, z = 3, family = "polynomial" }}
{strain}
[bodies.boom.initial]
marker = "tip"
displacement = [0, 0.1, 0]

[bodies.post]
kind = "rigid"
mass = 1
inertia = [1, 1, 1]
markers.rail = {{ position = [2, 0.1, 0] }}

[bodies.weight]
kind = "rigid"
mass = 1
inertia = [1, 1, 1]

[[joints]]
kind = "weld"
child = "post"

[[joints]]
kind = "weld"
parent = "post"
child = "boom"
child_marker = "root"

[[joints]]
kind = "prismatic"
child = "weight"
axis = "x"
name = "slide"
parent = "post"
parent_marker = "rail"

[[loops]]
kind = "spherical"
name = "tie"
parent = "boom"
parent_marker = "tip"
child = "weight"
"""
WORDS = "buckling is not assessed: its motion is estimated for the initial state only ("


@pytest.mark.parametrize("strain", ["", 'strain = "condensed"', 'strain = "linear"'])
def test_a_craft_that_only_bends_into_place_is_said_not_to_be_judged(femflex, write_case, strain):
    """The boom's tip is tied beside its straight line: rigid bodies cannot close the loop."""
    code, out, err = femflex("check", write_case(BEAM.format(strain=strain)))
    assert code == 0, err
    assert " ".join(out.split()).count(WORDS) == 1


def test_a_motion_foreseen_in_part_is_said_to_be_judged_in_part(femflex, write_case, monkeypatch):
    monkeypatch.setattr(foresight, "MOST_RATES", 50)
    hinged = BEAM.split("[bodies.boom.initial]")[0].format(strain='strain = "condensed"') + (
        '[[joints]]\nkind = "revolute"\nchild = "boom"\nchild_marker = "root"\naxis = "z"\nstiffness = 4e4\n'
        "rate = 0.01\n"
    )
    code, out, err = femflex("check", write_case(hinged))
    assert code == 0, err
    assert "buckling is assessed up to t = " in " ".join(out.split())
