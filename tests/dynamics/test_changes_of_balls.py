"""When balls change their coordinates, to what, and how far finite steps lead them: each set at its own limit."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from femflex.body import rigid_body
from femflex.dynamics import compile_system
from femflex.rotations import dcm_from_coordinates, singularity_distance
from femflex.system import System, spherical
from femflex.system.ball import NEAR

BODY = rigid_body(1.0, [1.0, 2.0, 2.5])
REFERENCE = Rotation.from_rotvec([0.4, -0.9, 0.2])


def near(rotation: str, left: float) -> np.ndarray:
    """Coordinates at that angle from the singularity of their set."""
    if rotation == "rodrigues":
        return np.tan((np.pi - left) / 2) * np.array([2.0, -1.0, 2.0]) / 3
    symmetric = rotation[-1] == rotation[-3]
    return np.array([0.7, left - np.pi if symmetric else left - np.pi / 2, -2.1])


def reference_of(q: np.ndarray) -> np.ndarray:
    return Rotation.from_quat(np.roll(q, -1)).as_matrix()


@pytest.mark.parametrize("rotation", ["rodrigues", "xyz", "extrinsic zyx", "zxz", "extrinsic yzy"])
def test_a_rebased_ball_begins_anew_where_it_is_farthest_from_its_singularity(rotation):
    """Two balls, of which the second is near; its reference stands behind its three coordinates."""
    joints = tuple(
        spherical(child, parent, rotation=rotation, rebase=True) for child, parent in (("a", None), ("b", "a"))
    )
    model = compile_system(System({"a": BODY, "b": BODY}, joints))
    for side, changes in ((1 + 1e-9, 0), (1 - 1e-9, 1)):
        x = model.x0.copy()
        x[:3], x[7:10] = near(rotation, 1.3 * NEAR), near(rotation, side * NEAR)
        x[3:7] = x[10:14] = np.roll(REFERENCE.as_quat(), 1)
        before = x.copy()
        assert model.switch(0.0, x, model.table, model.pool, model.work) == changes
        kept = slice(0, None) if changes == 0 else slice(0, 7)
        np.testing.assert_array_equal(x[kept], before[kept])
        np.testing.assert_array_equal(x[14:], before[14:])
        was, now = (reference_of(v[10:14]) @ dcm_from_coordinates(v[7:10], rotation) for v in (before, x))
        np.testing.assert_allclose(now, was, atol=1e-12)
        if changes:
            left = np.pi if rotation == "rodrigues" else np.pi / 2
            assert singularity_distance(x[7:10], rotation) == pytest.approx(left)
            assert x[7] == 0.0 and x[9] == 0.0
    x[:3] = near(rotation, 0.5 * NEAR)
    x[7:10] = near(rotation, 0.5 * NEAR)
    assert model.switch(0.0, x, model.table, model.pool, model.work) == 2


def test_modified_parameters_go_to_their_shadow_beyond_half_a_turn():
    model = compile_system(System({"a": BODY}, (spherical("a", rotation="modified_rodrigues"),)))
    for size, changes in ((1.0 - 1e-9, 0), (1.25, 1)):
        x = np.concatenate([size * np.array([2.0, -1.0, 2.0]) / 3, [0.1, 0.2, 0.3]])
        before = x.copy()
        assert model.switch(0.0, x, model.table, model.pool, model.work) == changes
        assert np.linalg.norm(x[:3]) == pytest.approx(1 / size if changes else size)
        turned = [dcm_from_coordinates(v[:3], "modified_rodrigues") for v in (before, x)]
        np.testing.assert_allclose(turned[1], turned[0], atol=1e-12)
        np.testing.assert_array_equal(x[3:], before[3:])


@pytest.mark.parametrize("rotation", ["xyz", "extrinsic xyz", "zxz", "extrinsic zyz"])
def test_angles_after_a_step_lie_next_to_those_before_in_whole_turns_and_in_the_mirrored_set(rotation):
    """Each turn has two sets of angles: the second angle beyond its usual range keeps the set that it came from."""
    start = [0.0, 1.0, 0.0] if rotation[-1] == rotation[-3] else [0.0, 0.0, 0.0]
    model = compile_system(System({"a": BODY}, (spherical("a", rotation=rotation, q0=start),)))
    step = np.array([0.02, -0.03, 0.04])
    for q in ([0.3, 0.8, -0.2], [9.7, 0.8, -13.1], [0.3, 2.4, -0.2], [-20.0, -2.3, 7.0], [3.0, -0.9, 6.5]):
        q, out = np.array(q), np.empty(3)
        model.second_order.advance(q, step, out, model.table, model.pool, model.work)
        assert np.abs(out - q).max() < 0.15
        turned = Rotation.from_matrix(dcm_from_coordinates(q, rotation)) * Rotation.from_rotvec(step)
        np.testing.assert_allclose(dcm_from_coordinates(out, rotation), turned.as_matrix(), atol=1e-12)
