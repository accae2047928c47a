"""Names of what a system is made of: ASCII letters, digits, - and _, points inside, and no name a part of another."""

from __future__ import annotations

import numpy as np
import pytest

from femflex.body import rigid_body
from femflex.body.marker import Marker
from femflex.system import Joint, Load, System
from femflex.system.names import name_problems, prefix_problems


def hub(*markers: str):
    return rigid_body(1.0, np.eye(3), markers={name: Marker.rigid(np.zeros(3)) for name in markers})


@pytest.mark.parametrize("name", ["a", "A-1", "_", "1", "a.b", "boom.1.tip", "-", "x_y-z"])
def test_names_of_letters_digits_and_inner_points_are_allowed(name: str):
    assert name_problems("body", [name]) == []


@pytest.mark.parametrize(
    "name", ["", ".", "..", "a.", ".a", "a..b", "a b", "a/b", "a\0", "a\n", "\u00e4", "\u0663", "a*", "\u2028"]
)
def test_other_names_are_refused(name: str):
    (problem,) = name_problems("body", [name])
    assert repr(name) in problem and "letters, digits" in problem


def test_a_name_that_continues_another_after_a_point_is_refused():
    assert prefix_problems("bodies", ["boom", "boomerang", "hub.1", "hub.2", "b"]) == []
    (problem,) = prefix_problems("bodies", ["boom.tip", "hub", "boom"])
    assert "'boom' and 'boom.tip'" in problem


@pytest.mark.parametrize(
    ("change", "text"),
    [
        ({"bodies": {"h b": hub()}, "joints": (Joint("h b"),)}, "the name 'h b' of a body"),
        ({"joints": (Joint("hub", name="."),)}, "the name '.' of a joint"),
        ({"bodies": {"hub": hub("a/b")}}, "the name 'a/b' of a marker"),
        ({"loads": (Load("p\0", "hub"),)}, "the name 'p\\x00' of a load"),
    ],
)
def test_a_system_made_in_python_is_held_to_the_same_names(change: dict, text: str):
    parts = {"bodies": {"hub": hub()}, "joints": (Joint("hub"),)} | change
    with pytest.raises(ValueError) as error:
        System(**parts)
    assert text in str(error.value)
