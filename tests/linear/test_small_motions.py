"""Small motions of spinning craft, modes of whole craft, and joints that are released, against closed forms."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from support.hub_beam import exact_frequencies
from support.spinning_craft import principal_axes, random_craft

import femflex
from femflex.body import Marker, rigid_body
from femflex.linear.character import motion_character
from femflex.linear.equations import linearised
from femflex.linear.equilibrium import equilibrium
from femflex.linear.system_modes import system_modes
from femflex.reduction import BeamFunctions, UniformBeam, beam_body
from femflex.system import (
    Frame,
    Latch,
    Orbit,
    System,
    free,
    revolute,
    spherical,
    weld,
)

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
def test_wobble_or_growth_of_spinning_body_matches_euler(k):
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


def test_wobble_rate_of_axisymmetric_body():
    """Omega (1 - I3 / I1) in body axes; a flat disc's and a thin rod's come near the tilt of the spin axis at Omega."""
    for axial in (1e-6, 0.5, 0.999, 1.3, 1.999999, 2.0):
        system, C = top([1.0, 1.0, axial])
        found = equilibrium(spun(system, SPEED * C[:, 2]))
        assert np.abs(found.eigenvalues.imag) == pytest.approx(SPEED * abs(1 - axial), rel=1e-6)
        assert np.abs(found.eigenvalues.real).max() < found.growth_threshold / 30


@pytest.mark.sampled(2)
@pytest.mark.parametrize("seed", range(4))
def test_removing_known_motions_leaves_other_eigenvalues(seed):
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


@pytest.mark.slow
def test_internal_damping_destabilises_spin_about_least_inertia():
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


BEAM = UniformBeam(1.0, EA=1e4, EIy=10.0, EIz=1.0, GJ=10.0, mass_per_length=1.0, rotary_inertia=False)


def hub_and_beam(r: float, J: float, m: float, pinned: bool) -> System:
    hub = rigid_body(m, J * np.eye(3), markers={"rim": Marker.at_position([r, 0.0, 0.0])})
    beam = beam_body(BEAM, BeamFunctions(y=10, z=0, axial=0, torsion=0))
    root = revolute("hub") if pinned else free("hub")
    return System({"hub": hub, "beam": beam}, (root, weld("beam", "hub", parent_marker="rim", child_marker="root")))


@pytest.mark.sampled(2)
@pytest.mark.parametrize("pinned", [True, False], ids=["pinned", "free"])
@pytest.mark.parametrize(("r", "J", "m"), [(0.1, 0.1, 0.5), (0.5, 5.0, 10.0)])
def test_hub_with_beam_has_exact_frequencies(r, J, m, pinned):
    """The transcendental equation of hub and beam (VALIDATION E)."""
    found = femflex.system_modes(hub_and_beam(r, J, m, pinned))
    rigid = int(found.known.sum())
    assert rigid == (1 if pinned else 6) and not found.frequencies[:rigid].any() and found.stable
    assert found.names[rigid : rigid + 3] == ("bending 1", "bending 2", "bending 3")
    assert found.directions[rigid : rigid + 3] == ("y",) * 3 and found.label(rigid + 1) == "bending 1, y"
    assert 2 * np.pi * found.frequencies[rigid : rigid + 3] == pytest.approx(
        exact_frequencies(r, J, m, pinned), rel=2e-3
    )
    assert found.frequency("bending 2") == found.frequencies[rigid + 1] == found.frequency(rigid + 2)
    assert np.sum(list(found.energy.values()), axis=0) == pytest.approx(1.0, rel=1e-9)


def test_damping_ratio_of_joint():
    wheel = rigid_body(3.0, np.diag([1.0, 2.0, 2.5]))
    sprung = revolute("wheel", stiffness=np.array([40.0]), damping=np.array([2.0]))
    found = femflex.system_modes(System({"wheel": wheel}, (sprung,)))
    omega = np.sqrt(40.0 / 2.5)
    assert found.names == ("joint 1",)
    assert np.abs(found.eigenvalues) == pytest.approx(omega, rel=1e-9)
    assert found.damping_ratios == pytest.approx(2.0 / (2 * 2.5 * omega), rel=1e-9)


def test_libration_frequencies_by_axis():
    """VALIDATION row D: pitch 1.5801 n, roll and yaw 1.9266 and 0.5687 n."""
    axes = Marker.at_position(np.zeros(3), np.array([[0.0, 0, 1], [1, 0, 0], [0, 1, 0]]))
    body = rigid_body(79710.0, np.diag([8286760.0, 8646050.0, 1091430.0]), markers={"nominal": axes})
    joint = spherical("craft", child_marker="nominal")
    orbit = Orbit(perigee_altitude=331e3, true_anomaly=1.0, inclination=0.7)
    found = femflex.system_modes(System({"craft": body}, (joint,), orbit=orbit, frame=Frame("orbital")))
    ratios = {name: 2 * np.pi * f / orbit.mean_motion for name, f in zip(found.names, found.frequencies, strict=True)}
    assert ratios == pytest.approx(
        {"libration yaw": 0.5687, "libration pitch": 1.5801, "libration roll": 1.9266}, abs=5e-5
    )


AXIS = 0.3  # kg m^2, of each of the two bodies about the axis that both turn about
STIFFNESS, REST = (5.0, 7.0), (0.4, -0.2)


def craft(opens=0.5) -> System:
    """Two bodies, one on the other, that turn about one axis on springs; the first is locked at 0.1 rad until then."""
    body = rigid_body(2.0, np.diag([0.1, 0.2, AXIS]))
    return System(
        {"a": body, "b": body},
        (
            revolute("a", name="one", stiffness=5.0, rest=0.4, q0=[0.1], latches=(Latch(0, at=0.1, opens=opens),)),
            revolute("b", "a", name="two", stiffness=7.0, rest=-0.2),
        ),
    )


@pytest.mark.parametrize("at", [0.5, 0.7])
def test_released_joint_equilibrium_and_frequencies(at):
    found, modes = equilibrium(craft(), at), system_modes(craft(), at)
    assert found.q == pytest.approx(REST)
    M = AXIS * np.array([[2.0, 1.0], [1.0, 1.0]])
    squares = np.linalg.eigvals(np.linalg.solve(M, np.diag(STIFFNESS)))
    assert modes.frequencies == pytest.approx(np.sort(np.sqrt(squares)) / (2 * np.pi))
