"""Rotations for people and files: sequences by elementary turns, what is near a singularity, angles that continue."""

from __future__ import annotations

import numpy as np
import pytest

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


def turn(axis, angle):
    """Rodrigues' formula."""
    e = np.asarray(axis, float) / np.linalg.norm(axis)
    K = np.array([[0, -e[2], e[1]], [e[2], 0, -e[0]], [-e[1], e[0], 0]])
    return np.eye(3) + np.sin(angle) * K + (1 - np.cos(angle)) * K @ K


@pytest.mark.parametrize("letters", ANGLE_SEQUENCES)
def test_sequence_is_product_of_turns(letters):
    angles = np.array([0.4, -0.7, 1.1])
    A, B, C = (turn(np.eye(3)["xyz".index(x)], a) for x, a in zip(letters, angles, strict=True))
    for name, expected in (
        (letters, A @ B @ C),
        (f"intrinsic {letters}", A @ B @ C),
        (f"extrinsic {letters}", C @ B @ A),
    ):
        np.testing.assert_allclose(dcm_from_angles(angles, name), expected, atol=1e-12)
        np.testing.assert_allclose(dcm_from_coordinates(angles, name), expected, atol=1e-12)
        np.testing.assert_allclose(dcm_from_angles(angles_from_dcm(expected, name), name), expected, atol=1e-12)
        assert letters_of(name) == letters and is_extrinsic(name) == name.startswith("extrinsic")
        assert is_symmetric(name) == (letters[0] == letters[2])
        assert checked_sequence(name) == name


@pytest.mark.parametrize("angle", [0.9, 2.5, -1.4])
def test_parameters_are_functions_of_axis_and_angle(angle):
    axis = np.array([2.0, -3.0, 6.0]) / 7.0
    C = turn(axis, angle)
    e = np.array([np.cos(angle / 2), *np.sin(angle / 2) * axis])
    np.testing.assert_allclose(quaternion_from_dcm(C), e, atol=1e-12)
    np.testing.assert_allclose(dcm_from_quaternion(3.0 * e), C, atol=1e-12)
    np.testing.assert_allclose(dcm_from_vector(angle * axis), C, atol=1e-12)
    np.testing.assert_allclose(vector_from_dcm(C), angle * axis, atol=1e-12)
    expected = {
        "euler_parameters": e,
        "rodrigues": np.tan(angle / 2) * axis,
        "modified_rodrigues": np.tan(angle / 4) * axis,
    }
    for name, values in expected.items():
        np.testing.assert_allclose(coordinates_from_dcm(np.stack([C, C.T]), name)[0], values, atol=1e-12)
        np.testing.assert_allclose(dcm_from_coordinates(np.stack([values, 0.5 * values]), name)[0], C, atol=1e-12)


@pytest.mark.parametrize("rotation", ROTATION_SETS)
def test_distance_to_singularity_is_an_angle(rotation):
    if rotation == "euler_parameters":
        found = singularity_distance(np.ones((5, 4)), rotation)
        assert found.shape == (5,) and np.isinf(found).all()
        return
    angle = np.array([0.3, 1.0, 2.9])
    if rotation in ("rodrigues", "modified_rodrigues"):
        part, whole = (2, np.pi) if rotation == "rodrigues" else (4, 2 * np.pi)
        axis = np.array([2.0, -3.0, 6.0]) / 7.0
        np.testing.assert_allclose(singularity_distance(np.tan(angle / part)[:, None] * axis, rotation), whole - angle)
        assert singularity_distance([np.inf, 0.0, np.inf], rotation) == 0.0
        assert singularity_distance([np.inf, np.nan, 0.0], rotation) == 0.0
        assert singularity_distance(np.zeros(3), rotation) == pytest.approx(whole)
        return
    places = np.arange(-3, 4) * np.pi / 2
    singular = places[1::2] if is_symmetric(rotation) else places[::2]
    q = np.stack([angle + 5, angle, angle - 2], axis=1)
    np.testing.assert_allclose(
        singularity_distance(q, rotation), np.abs(angle[:, None] - singular).min(axis=1), atol=1e-12
    )
    best = singularity_distance(regular_coordinates(rotation), rotation)
    assert best == pytest.approx(np.pi / 2)


def test_coordinates_farthest_from_the_singularity_are_no_turn_where_that_is_regular():
    for rotation in ("xyz", "extrinsic zyx", "rodrigues", "modified_rodrigues"):
        np.testing.assert_array_equal(regular_coordinates(rotation), np.zeros(3))
    np.testing.assert_array_equal(regular_coordinates("extrinsic zxz"), [0.0, np.pi / 2, 0.0])


@pytest.mark.parametrize("sequence", ["xzy", "zxz"])
def test_angles_continue_smooth_motions_through_their_singularity(sequence):
    """Three laws in time, far over whole turns; the second goes through singularities many times."""
    t = np.linspace(0.0, 7.0, 400)[:, None]
    laws = np.hstack([0.3 + 2.1 * t, 0.05 + 1.7 * t, -0.2 - 1.3 * t + 0.4 * np.sin(t)])
    given = angles_from_dcm(dcm_from_angles(laws, sequence), sequence)
    np.testing.assert_allclose(continued_angles(given, is_symmetric(sequence)), laws, atol=1e-9)


@pytest.mark.parametrize(("symmetric", "singular"), [(False, np.pi / 2), (True, 0.0)])
def test_rows_at_the_singularity_lie_between_their_neighbours_and_keep_their_second_angle(symmetric, singular):
    off = -0.01
    given = np.array([[0.1, singular + off, 0.5], [9.0, singular - 1e-8, 7.0], [-4.0, singular, 3.0],
                      [0.7, singular + off / 5, 0.2]])  # fmt: skip
    found = continued_angles(given, symmetric)
    np.testing.assert_allclose(found[[0, 3]], given[[0, 3]], atol=1e-12)
    np.testing.assert_allclose(found[1:3, 0], [0.3, 0.5], atol=1e-12)
    np.testing.assert_allclose(found[1:3, 2], [0.4, 0.3], atol=1e-12)
    np.testing.assert_allclose(found[1:3, 1], given[1:3, 1], atol=1e-12)


def test_one_regular_row_gives_the_others_their_first_and_third_angle():
    given = np.array([[2.0, np.pi / 2, 1.0], [0.4, 1.3, -0.6], [0.0, np.pi / 2, 5.0]])
    found = continued_angles(given, False)
    np.testing.assert_allclose(found, [[0.4, np.pi / 2, -0.6], given[1], [0.4, np.pi / 2, -0.6]], atol=1e-12)
    np.testing.assert_array_equal(continued_angles(given[[0, 2]], False), given[[0, 2]])
