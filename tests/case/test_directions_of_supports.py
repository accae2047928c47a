"""Directions of skew supports of a case."""

from __future__ import annotations

import pytest

from femflex.case.support import read_support
from femflex.case.values import ValueProblem


@pytest.mark.parametrize("normal", [[1, -1, 0], [0, 0, -2], [-1, -1, 2]])
def test_a_direction_may_have_components_that_cancel(normal):
    assert read_support("rim", {"symmetry": normal}).vectors == (tuple(normal),)


def test_a_direction_of_zeros_is_refused():
    with pytest.raises(ValueProblem, match="for symmetry at group 'rim'; a direction is not all zero"):
        read_support("rim", {"symmetry": [0, 0, 0]})
