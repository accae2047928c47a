"""Which static shapes stand beside vibration modes: those that are slow, however the mesh lies in its axes."""

from __future__ import annotations

import numpy as np
import pytest
from support.nonlinear_models import METAL, TURN

from femflex.fem import Member, build_structure
from femflex.fem.sections import Rectangle
from femflex.mesh import line
from femflex.reduction import cantilever_modes, slow_loads, with_attachment
from femflex.reduction.boundary.rigid import DIRECTIONS

ENDS = {"end": DIRECTIONS}


def boom(turn):
    """400 times as long as thick: its stretch is some hundred times as fast as its fourth mode."""
    mesh = line([[0, 0, 0], [8.0, 0, 0]], 8).rotated(turn)
    return build_structure(mesh, [Member("line", "beam", Rectangle(0.02, 0.02), METAL)])


def omega(turn, directions, loads):
    structure = boom(turn)
    modes = cantilever_modes(structure, "start", 4)
    slow = slow_loads(structure, modes, directions, loads)
    return slow.shape[1], with_attachment(structure, modes, (), {}, slow).omega


@pytest.mark.parametrize(("directions", "loads"), [((), {"end": "xyz"}), ((), ENDS), (DIRECTIONS, {})])
def test_they_do_not_depend_on_the_axes_of_the_mesh(directions, loads):
    loads = {group: tuple(given) for group, given in loads.items()}
    straight, skew = omega(np.eye(3), directions, loads), omega(TURN, directions, loads)
    assert straight[0] == skew[0] > 0
    np.testing.assert_allclose(skew[1], straight[1], rtol=1e-6)
    assert skew[1].max() < 20 * skew[1][3]  # no stretch among them, which is a hundred times as fast


def test_a_pull_along_a_boom_is_not_one_of_them_and_a_push_across_is():
    structure = boom(TURN)
    modes = cantilever_modes(structure, "start", 4)
    slow = slow_loads(structure, modes, (), {"end": DIRECTIONS[:3]})
    along = structure.translation.T @ np.tile(TURN[:, 0], len(structure.mesh.points))
    assert slow.shape[1] == 2
    np.testing.assert_allclose(slow.T @ along, 0.0, atol=1e-9 * np.abs(slow).max())
