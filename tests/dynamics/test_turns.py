"""Rotations of the compiled model against scipy's, tangents and rates against differences."""

import numpy as np
import pytest
from numba import njit
from scipy.spatial.transform import Rotation

from femflex.dynamics.arithmetic import turns as T
from femflex.rotations import ANGLE_SEQUENCES

RNG = np.random.default_rng(4)
SEQUENCES = sorted(ANGLE_SEQUENCES)
LENGTHS = (1e-9, 1e-3, 0.0499, 0.0501, 1.0, 3.1)
VECTORS = [length * v / np.linalg.norm(v) for length in LENGTHS for v in RNG.normal(size=(3, 3))]


@njit
def axis_turn(a, angle):
    return T.axis_turn(a, angle)


@njit
def quaternion_turn(e):
    return T.quaternion_turn(e)


@njit
def quaternion_of(C):
    return T.quaternion_of(C)


@njit
def moving_vector_turn(theta, dtheta):
    return T.moving_vector_turn(theta, dtheta)


@njit
def vector_turn_and_tangent(theta):
    return T.vector_turn(theta), T.vector_tangent(theta)


@njit
def vector_of(C):
    return T.vector_of(C)


@njit
def angles_turn(angles, numbers):
    return T.angles_turn(angles, numbers)


@njit
def angles_of(C, numbers):
    return T.angles_of(C, numbers)


@njit
def angle_rates(angles, numbers, omega):
    return T.angle_rates(angles, numbers, omega)


@njit
def quaternion_rates(e, omega):
    return T.quaternion_rates(e, omega)


@njit
def quaternion_advanced(e, theta):
    return T.quaternion_advanced(e, theta)


def flat(C):
    """A matrix as nine numbers row by row."""
    return tuple(np.asarray(C, float).ravel())


def square(C):
    return np.reshape(C, (3, 3))


def numbers(sequence):
    return tuple(float("xyz".index(letter)) for letter in sequence)


def scipy_quaternion(e):
    return Rotation.from_quat(np.roll(e, -1))


def test_turn_about_an_axis():
    axis = np.array([0.6, 0.0, -0.8])
    for angle in (-4.0, 0.0, 1e-8, 2.0):
        expected = Rotation.from_rotvec(angle * axis).as_matrix()
        assert square(axis_turn(tuple(axis), angle)) == pytest.approx(expected, abs=1e-15)


def test_euler_parameters_of_any_length_turn_alike():
    for e in RNG.normal(size=(20, 4)):
        assert square(quaternion_turn(tuple(e))) == pytest.approx(scipy_quaternion(e).as_matrix(), abs=1e-14)


@pytest.mark.parametrize("largest", range(4))
def test_euler_parameters_are_found_from_the_matrix_with_the_scalar_part_not_negative(largest):
    for e in RNG.normal(size=(10, 4)):
        e[largest] += np.copysign(5.0, e[largest])
        e /= np.linalg.norm(e)
        e = -e if e[0] < 0 else e
        assert quaternion_of(flat(scipy_quaternion(e).as_matrix())) == pytest.approx(tuple(e), abs=1e-14)


def test_half_turns_have_euler_parameters_too():
    for axis in np.eye(3):
        e = quaternion_of(flat(Rotation.from_rotvec(np.pi * axis).as_matrix()))
        assert np.abs(e) == pytest.approx([0.0, *axis], abs=1e-15)


@pytest.mark.parametrize("theta", VECTORS, ids=lambda v: f"{np.linalg.norm(v):g}")
def test_rotation_vector_there_and_back(theta):
    expected = Rotation.from_rotvec(theta).as_matrix()
    C, _, _, _ = moving_vector_turn(tuple(theta), (0.0, 0.0, 0.0))
    assert square(C) == pytest.approx(expected, abs=2e-15)
    assert square(vector_turn_and_tangent(tuple(theta))[0]) == pytest.approx(expected, abs=2e-15)
    assert vector_of(flat(expected)) == pytest.approx(tuple(theta), rel=1e-12, abs=1e-15)


@pytest.mark.parametrize("theta", VECTORS, ids=lambda v: f"{np.linalg.norm(v):g}")
def test_tangent_and_bias_are_derivatives_along_a_motion(theta):
    # theta(t) = theta + t d; rate from (dC/dt) C^T, bias from the rate's change, by central differences
    d, h = np.array([0.7, -0.4, 0.9]), 1e-5
    _, tangent, rate, bias = moving_vector_turn(tuple(theta), tuple(d))
    ahead, behind = (Rotation.from_rotvec(theta + s * h * d) for s in (1, -1))
    assert rate == pytest.approx((ahead * behind.inv()).as_rotvec() / (2 * h), abs=1e-9)
    assert rate == pytest.approx(square(tangent) @ d, abs=1e-14)
    assert square(tangent) == pytest.approx(square(vector_turn_and_tangent(tuple(theta))[1]), abs=1e-15)
    rates = [np.array(moving_vector_turn(tuple(theta + s * h * d), tuple(d))[2]) for s in (1, -1)]
    assert bias == pytest.approx((rates[0] - rates[1]) / (2 * h), abs=1e-9)


@pytest.mark.parametrize("sequence", SEQUENCES)
def test_angle_sequences_there_and_back(sequence):
    for angles in RNG.uniform(0.1, 1.4, size=(5, 3)) * [1, 1, -1]:
        expected = Rotation.from_euler(sequence.upper(), angles).as_matrix()
        assert square(angles_turn(tuple(angles), numbers(sequence))) == pytest.approx(expected, abs=1e-14)
        assert angles_of(flat(expected), numbers(sequence)) == pytest.approx(tuple(angles), abs=1e-13)


@pytest.mark.parametrize("sequence", SEQUENCES)
def test_angles_at_the_singularity_give_the_same_turn_with_the_third_zero(sequence):
    middle = 0.0 if sequence[0] == sequence[2] else np.pi / 2
    C = Rotation.from_euler(sequence.upper(), [0.4, middle, 0.3]).as_matrix()
    angles = angles_of(flat(C), numbers(sequence))
    assert angles[2] == 0.0
    assert square(angles_turn(angles, numbers(sequence))) == pytest.approx(C, abs=1e-12)


@pytest.mark.parametrize("sequence", SEQUENCES)
def test_rates_of_angles_turn_the_frame_at_the_given_rate(sequence):
    angles, omega, h = np.array([0.4, 0.7, -0.9]), np.array([0.3, -1.1, 0.6]), 1e-6
    rates = np.array(angle_rates(tuple(angles), numbers(sequence), tuple(omega)))
    behind, ahead = (Rotation.from_euler(sequence.upper(), angles + s * h * rates) for s in (-1, 1))
    assert (behind.inv() * ahead).as_rotvec() / (2 * h) == pytest.approx(omega, abs=1e-9)


def test_rates_of_euler_parameters_keep_their_length_and_turn_at_the_given_rate():
    e, omega, h = RNG.normal(size=4), RNG.normal(size=3), 1e-6
    e /= np.linalg.norm(e)
    rates = np.array(quaternion_rates(tuple(e), tuple(omega)))
    assert rates @ e == pytest.approx(0.0, abs=1e-16)
    turned = scipy_quaternion(e - h * rates).inv() * scipy_quaternion(e + h * rates)
    assert turned.as_rotvec() / (2 * h) == pytest.approx(omega, abs=1e-9)


@pytest.mark.parametrize("length", [0.0, 1e-9, 1e-3, 2.0])
def test_euler_parameters_advance_by_a_rotation_vector(length):
    e, theta = np.array([0.5, -0.5, 0.1, 0.7]), length * np.array([0.6, -0.64, 0.48])
    advanced = np.array(quaternion_advanced(tuple(e), tuple(theta)))
    assert np.linalg.norm(advanced) == pytest.approx(np.linalg.norm(e), rel=1e-15)
    expected = scipy_quaternion(e) * Rotation.from_rotvec(theta)
    assert scipy_quaternion(advanced).as_matrix() == pytest.approx(expected.as_matrix(), abs=1e-15)
