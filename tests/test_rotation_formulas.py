"""Rotations against turns about single axes, series and angles written out, of vectors along no axis."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.linalg import expm

from femflex.rotations import (
    ANGLE_SEQUENCES,
    ROTATION_SETS,
    angles_from_dcm,
    checked_sequence,
    continued_angles,
    coordinates_from_dcm,
    dcm_from_angles,
    dcm_from_coordinates,
    dcm_from_quaternion,
    dcm_from_vector,
    is_extrinsic,
    is_symmetric,
    letters_of,
    quaternion_from_dcm,
    regular_coordinates,
    singularity_distance,
    vector_from_dcm,
)

THETA = np.array([0.3, -1.1, 0.7])
AXIS, ANGLE = THETA / np.linalg.norm(THETA), float(np.linalg.norm(THETA))


def skew(v: np.ndarray) -> np.ndarray:
    return np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])


C = expm(skew(THETA))


def about(letter: str, angle: float) -> np.ndarray:
    return expm(skew(angle * np.eye(3)["xyz".index(letter)]))


def test_a_vector_a_quaternion_and_rodrigues_parameters_are_of_one_rotation():
    half = ANGLE / 2
    e = np.concatenate([[math.cos(half)], math.sin(half) * AXIS])
    np.testing.assert_allclose(dcm_from_vector(THETA), C, atol=1e-14)
    np.testing.assert_allclose(vector_from_dcm(C), THETA, atol=1e-14)
    np.testing.assert_allclose(dcm_from_quaternion(e), C, atol=1e-14)
    np.testing.assert_allclose(quaternion_from_dcm(C), e, atol=1e-14)
    for name, q in (
        ("euler_parameters", e),
        ("rodrigues", math.tan(half) * AXIS),
        ("modified_rodrigues", math.tan(half / 2) * AXIS),
    ):
        np.testing.assert_allclose(dcm_from_coordinates(q, name), C, atol=1e-14)
        np.testing.assert_allclose(coordinates_from_dcm(C, name), q, atol=1e-14)


@pytest.mark.parametrize("sequence", [*ANGLE_SEQUENCES, "extrinsic yzx", "extrinsic zxz", "intrinsic zyx"])
def test_angles_are_turns_one_after_the_other(sequence: str):
    angles = np.array([0.4, 0.9, -1.2])
    p, q, r = sequence[-3:]
    turns = [about(letter, a) for letter, a in zip((p, q, r), angles, strict=True)]
    expected = turns[0] @ turns[1] @ turns[2]
    if sequence.startswith("extrinsic"):
        expected = turns[2] @ turns[1] @ turns[0]
    np.testing.assert_allclose(dcm_from_angles(angles, sequence), expected, atol=1e-14)
    np.testing.assert_allclose(angles_from_dcm(expected, sequence), angles, atol=1e-12)
    np.testing.assert_allclose(dcm_from_coordinates(angles, sequence), expected, atol=1e-14)
    assert (letters_of(sequence), is_extrinsic(sequence)) == (p + q + r, sequence.startswith("extrinsic"))
    assert is_symmetric(sequence) == (p == r)


def test_the_distance_to_a_singularity_is_an_angle():
    assert singularity_distance([0.2, 1.3, 0.1], "xyz") == pytest.approx(math.pi / 2 - 1.3)
    assert singularity_distance([0.2, -1.3, 0.1], "zyx") == pytest.approx(math.pi / 2 - 1.3)
    assert singularity_distance([0.2, 0.3, 0.1], "zxz") == pytest.approx(0.3)
    assert singularity_distance([0.2, math.pi - 0.3, 0.1], "yxy") == pytest.approx(0.3)
    assert singularity_distance([1.0, 0, 0, 0], "euler_parameters") == np.inf
    assert singularity_distance(math.tan(1.4) * AXIS, "rodrigues") == pytest.approx(math.pi - 2.8)
    assert singularity_distance(math.tan(1.4) * AXIS, "modified_rodrigues") == pytest.approx(2 * math.pi - 5.6)
    found = singularity_distance(np.array([[np.inf, 0, 0], [0.5, 0, 0]]), "rodrigues")
    np.testing.assert_allclose(found, [0.0, math.pi - 2 * math.atan(0.5)])


def test_regular_coordinates_lie_far_from_the_singularity():
    for rotation in ROTATION_SETS[1:]:
        assert singularity_distance(regular_coordinates(rotation), rotation) >= math.pi / 2 - 1e-12


@pytest.mark.parametrize("symmetric", [False, True])
def test_angles_go_on_through_their_singularity(symmetric: bool):
    """A turn that goes on in its second angle; the angles of each instant alone jump where they are not unique."""
    t = np.linspace(0, 1, 42)
    steady = np.column_stack([0.3 + 0.2 * t, -0.4 + 5.0 * t, 0.5 - 0.3 * t])
    sequence = "zxz" if symmetric else "xyz"
    alone = np.array([angles_from_dcm(dcm_from_angles(row, sequence), sequence) for row in steady])
    assert np.abs(np.diff(alone, axis=0)).max() > 1.0
    found = continued_angles(alone, symmetric)
    assert np.abs(np.diff(found, axis=0)).max() < 0.2
    for row, wanted in zip(found, steady, strict=True):
        np.testing.assert_allclose(dcm_from_angles(row, sequence), dcm_from_angles(wanted, sequence), atol=1e-10)


def test_angles_that_stay_at_their_singularity_are_left():
    given = np.array([[0.1, math.pi / 2, 0.3], [0.4, math.pi / 2, 0.5]])
    np.testing.assert_array_equal(continued_angles(given, False), given)


def test_a_row_at_the_singularity_lies_between_its_neighbours():
    given = np.array([[0.1, 1.4, 0.3], [0.9, math.pi / 2, -0.4], [0.2, 1.5, 0.5]])
    found = continued_angles(given, False)
    np.testing.assert_allclose(found[[0, 2]], given[[0, 2]])
    np.testing.assert_allclose(found[1], [0.15, math.pi / 2, 0.4])


def test_an_unknown_sequence_is_told_with_those_that_are_known():
    with pytest.raises(ValueError, match=r"angle sequence 'xxy' is not known; known are \['xyz', 'xzy'"):
        checked_sequence("xxy")
