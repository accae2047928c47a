"""Whether the functions of a deploying member are enough is looked at with its first and its last length."""

from __future__ import annotations

from femflex.advice.advice import Advice
from femflex.case import parse_case
from femflex.pipeline.decisions import decided
from femflex.warning import TruncationWarning

CRAFT = """
[run]
duration = 200
[bodies.hub]
kind = "rigid"
mass = 30
inertia = [6, 9, 7]
markers.side = { position = [0.5, 0.2, 0] }
[bodies.boom]
kind = "deploying"
family = "beam"
length = LENGTH
stock = 20
mass_per_length = 0.8
EIy = 900
EIz = 500
functions = { y = 1, z = 1, joints = [] }
[[joints]]
kind = "free"
child = "hub"
[[joints]]
kind = "weld"
parent = "hub"
parent_marker = "side"
child = "boom"
child_marker = "root"
"""


def doubts(length: str) -> list[Advice]:
    found = decided(parse_case(CRAFT.replace("LENGTH", length)), loaded=False)
    return [one for one in found.advice if one.category is TruncationWarning]


def moved(start: float, end: float) -> list[Advice]:
    return doubts(f'{{ kind = "smooth_step", from = {start}, to = {end}, start = 0, end = 150 }}')


def test_the_worse_of_the_first_and_the_last_length_is_reported_with_its_time():
    """The same numbers as of members that have these lengths throughout; both lack functions."""
    (short,), (long,) = doubts("9.0"), doubts("16.0")
    assert short.value is not None and long.value is not None and 0.01 < 1.2 * short.value < long.value
    (out,), (back,) = moved(9.0, 16.0), moved(16.0, 9.0)
    assert out.value == back.value == long.value and back.text == long.text
    assert out.text == long.text.replace("(the first 3, at rest", "(the first 3, lengths of t = 200 s, at rest")
