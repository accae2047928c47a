"""Structures and bodies that several parts of a case share: made once, and their warnings repeated each time."""

from __future__ import annotations

import warnings

import pytest

from femflex.assembly.shared import SharedParts, shared_parts, shared_structures
from femflex.fem import Material, Member, build_structure
from femflex.mesh import rectangle
from femflex.warning import PhysicsWarning


def structure():
    warnings.warn("curved sides lie 3 mm off", PhysicsWarning, stacklevel=2)
    return build_structure(rectangle(1.0, 1.0, 1, 1), [Member("surface", "plate", 0.01, Material(70e9, 0.3, 2700.0))])


def test_a_structure_is_made_once_and_its_warning_given_whenever_it_is_taken():
    kept, made = SharedParts(), []
    for _ in range(3):
        with pytest.warns(PhysicsWarning, match="curved sides lie 3 mm off") as given:
            made.append(kept.structure("plate", structure))
        assert len(given) == 1
    assert made[0] is made[1] is made[2]
    with pytest.warns(PhysicsWarning):
        assert kept.structure("another", structure) is not made[0]


def test_structures_are_shared_while_that_lasts_alone():
    assert shared_parts() is None
    with shared_structures():
        outer = shared_parts()
        with shared_structures():
            assert shared_parts() is outer is not None
        assert shared_parts() is outer
    assert shared_parts() is None
