"""Small motions of craft that spin: closed forms, known motions taken out exactly, growth and its threshold."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from support.spinning_craft import principal_axes, random_craft

from femflex.body import rigid_body
from femflex.dynamics.equilibria.character import motion_character
from femflex.dynamics.equilibria.equilibrium import equilibrium
from femflex.dynamics.equilibria.linearised import linearised
from femflex.system import Frame, System, cylindrical, free, revolute, spherical, turns, weld

INERTIA = np.array([2.0, 3.0, 4.5])
SPEED = 0.7
FREE = ("translation along the spin axis", "spin", *["translation across the spin axis"] * 2, "tilt of the spin axis")


def spun(system: System, rate) -> System:
    return replace(system, frame=Frame("spinning", np.asarray(rate, float)))


def top(inertia, seed=4) -> tuple[System, np.ndarray]:
    """A free rigid body whose principal axes (3, 3) are turned at random."""
    C = Rotation.random(random_state=seed).as_matrix()
    return System({"top": rigid_body(5.0, C @ np.diag(inertia) @ C.T)}, (free("top"),)), C


@pytest.mark.parametrize("k", [0, 1, 2])
def test_a_free_body_wobbles_or_grows_as_euler_says(k):
    """lambda^2 = -Omega^2 (I3 - I1)(I3 - I2) / (I1 I2) about the axis of I3; all else is drift and tilt."""
    system, C = top(INERTIA)
    found = equilibrium(spun(system, SPEED * C[:, k]))
    i, j = (other for other in range(3) if other != k)
    square = -(SPEED**2) * (INERTIA[k] - INERTIA[i]) * (INERTIA[k] - INERTIA[j]) / (INERTIA[i] * INERTIA[j])
    assert found.eigenvalues**2 == pytest.approx(square, rel=1e-8)
    assert tuple(motion.name for motion in found.motions.known) == FREE
    assert found.stable is (k != 1)
    assert motion_character(found.model, found.motions, C[:, k]).words == ("wobble",)
    if k == 1:
        assert found.growth == pytest.approx(np.sqrt(square), rel=1e-8)
        assert f"by a factor e in {1 / np.sqrt(square):.4g} s" in found.verdict


def test_an_axisymmetric_body_wobbles_at_its_textbook_rate():
    """Omega (1 - I3 / I1) in body axes; a flat disc's and a thin rod's come near the tilt of the spin axis at Omega."""
    for axial in (1e-6, 0.5, 0.999, 1.3, 1.999999, 2.0):
        system, C = top([1.0, 1.0, axial])
        found = equilibrium(spun(system, SPEED * C[:, 2]))
        assert np.abs(found.eigenvalues.imag) == pytest.approx(SPEED * abs(1 - axial), rel=1e-6)
        assert np.abs(found.eigenvalues.real).max() < found.growth_threshold / 30


def test_a_sphere_has_no_motion_left_that_could_grow():
    system, C = top([1.0, 1.0, 1.0])
    found = equilibrium(spun(system, SPEED * C[:, 0]))
    assert found.stable and np.abs(found.eigenvalues).max(initial=0.0) < 1e-3 * SPEED


@pytest.mark.sampled(2)
@pytest.mark.parametrize("seed", range(4))
def test_taking_known_motions_out_leaves_all_other_eigenvalues(seed):
    """Against the whole state matrix: what is left of it are the known ones, whose double zeros split by rounding."""
    system, axis = random_craft(seed)
    found = equilibrium(spun(system, 0.4 * axis))
    whole = linearised(found.model, 0.0, found.x).eigenvalues()
    for value in found.eigenvalues:
        nearest = int(np.argmin(np.abs(whole - value)))
        assert abs(whole[nearest] - value) < 1e-7 * max(1.0, abs(value))
        whole = np.delete(whole, nearest)
    known = np.sort(whole.imag)
    assert known == pytest.approx(0.4 * np.repeat([-1, 0, 1], [3, 4, 3]), abs=1e-3)
    assert np.abs(whole.real).max() < 1e-3  # far above the rounding of all others
    assert not found.stable or np.abs(found.eigenvalues.real).max() < found.growth_threshold / 30


def test_at_rest_a_free_craft_has_six_rigid_modes_and_a_frame_that_spins_changes_no_elastic_one():
    system, axis = random_craft(1)
    rest, slow = equilibrium(system), equilibrium(spun(system, 1e-5 * axis))
    names = [f"{kind} {axis}" for kind in ("translation", "rotation") for axis in "xyz"]
    assert [motion.name for motion in rest.motions.known] == names
    elastic = slow.motions.frequencies[1:]  # after the wobble
    assert elastic == pytest.approx(rest.motions.frequencies, rel=1e-6)
    assert slow.motions.frequencies[0] < 1e-5


@pytest.mark.slow
def test_internal_damping_makes_a_spin_about_the_least_inertia_grow():
    """Explorer 1: dissipation turns a spin about the least inertia away, about the largest it does not."""
    for seed in range(3):
        system, _ = random_craft(seed)
        damped, _ = random_craft(seed, damping=0.02)
        axes = principal_axes(system)
        for k, stable in ((0, False), (2, True)):
            found = equilibrium(spun(damped, 1.0 * axes[:, k]))
            assert found.stable is stable
            assert motion_character(found.model, found.motions, axes[:, k]).words[0] == "wobble"
            undamped = equilibrium(spun(system, 1.0 * axes[:, k]))
            assert undamped.stable and found.motions.frequencies[0] == pytest.approx(
                undamped.motions.frequencies[0], rel=1e-4
            )


def test_joints_that_nothing_turns_back_are_known_with_dampers_only_where_they_stay():
    wheel = rigid_body(3.0, np.diag([1.0, 2.0, 2.5]))
    axle = equilibrium(System({"wheel": wheel}, (revolute("wheel"),)))
    assert [motion.name for motion in axle.motions.known] == ["rotation z"] and not len(axle.eigenvalues)
    slowed = equilibrium(System({"wheel": wheel}, (revolute("wheel", damping=np.array([5.0])),)))
    assert slowed.eigenvalues == pytest.approx([-5.0 / 2.5], rel=1e-9) and slowed.stable
    pair = System({"hub": wheel, "rotor": wheel}, (free("hub"), revolute("rotor", "hub")))
    known = [motion.name for motion in equilibrium(pair).motions.known]
    assert known[-1] == "hub-rotor.angle" and len(known) == 7


def test_a_craft_held_on_a_plane_or_an_axis_has_the_known_motions_of_what_is_free():
    body = rigid_body(3.0, np.diag([1.0, 2.0, 2.5]))
    about = Frame("spinning", np.array([0.0, 0.0, SPEED]))
    plane = turns("body", sequence="zxy", slides=[[1, 0, 0], [0, 1, 0]], motion=(None, None, None, 0.0, 0.0))
    found = equilibrium(System({"body": body}, (plane,), frame=about))
    assert [motion.name for motion in found.motions.known] == ["spin", *["translation across the spin axis"] * 2]
    assert not len(found.eigenvalues)
    sleeve = equilibrium(System({"body": body}, (cylindrical("body"),), frame=about))
    assert [motion.name for motion in sleeve.motions.known] == ["translation along the spin axis", "spin"]
    pivot = equilibrium(System({"body": body}, (spherical("body"),), frame=about))
    assert [motion.name for motion in pivot.motions.known] == ["spin", "tilt of the spin axis"]
    square = SPEED**2 * (2.5 - 1.0) * (2.5 - 2.0) / (1.0 * 2.0)
    assert np.abs(pivot.eigenvalues.imag) == pytest.approx(np.sqrt(square), rel=1e-8)


def test_a_driven_craft_has_no_known_motions():
    system, axis = random_craft(2, driven=True)
    found = equilibrium(spun(system, 0.5 * axis))
    assert not found.motions.known and found.stable
    assert len(found.eigenvalues) == 2 * found.model.n_u
    whole = linearised(found.model, 0.0, found.x).eigenvalues()
    assert np.sort(np.abs(found.eigenvalues)) == pytest.approx(np.sort(np.abs(whole)), rel=1e-7)


def test_the_hub_of_a_rotor_is_not_a_free_craft():
    """A blade on a hinge about the spin axis itself: the angle is neutral, the lag of a blade on the rim is not."""
    hub = rigid_body(10.0, np.eye(3))
    rod = rigid_body(2.0, np.diag([0.02, 0.5, 0.5]), [1.2, 0, 0])
    joints = (weld("hub"), revolute("rod", "hub", axis=[0, 0, 1]))
    found = equilibrium(System({"hub": hub, "rod": rod}, joints, frame=Frame("spinning", np.array([0, 0, 2.0]))))
    assert [motion.name for motion in found.motions.known] == ["hub-rod.angle"] and found.stable
