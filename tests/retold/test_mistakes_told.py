"""What is said of a case in which one value is a mistake: where it is, what was found, what is known, what to do.

Every value of these cases was left out, given another type, sign or unit, or misspelled; the sentences are recorded in
tests/retold/mistaken, as they were last read.
"""

from __future__ import annotations

import pytest
from changed_once import change_of, names, recorded, told


@pytest.mark.parametrize("name", names())
def test_of_every_mistake_is_said_what_was_recorded(name: str):
    lines = recorded(name)
    assert list(told(name, map(change_of, lines))) == lines
