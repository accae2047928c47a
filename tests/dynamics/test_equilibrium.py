"""Equilibria against closed forms: elastica, buckling, gravity gradient, steady spin; and what has none."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import brentq
from support.elastica import EI, LENGTH, MATTIASSON, beam, cantilever, elastica

from femflex import build_system
from femflex.body import Marker, rigid_body
from femflex.case import parse_case
from femflex.dynamics.equilibria.equilibrium import EquilibriumError, equilibrium
from femflex.rotations import dcm_from_angles, quaternion_from_dcm
from femflex.system import (
    Environment,
    Frame,
    Load,
    Orbit,
    Profile,
    Spring,
    System,
    assembled,
    free,
    prismatic,
    revolute,
    spherical,
    universal,
    weld,
)


def tip(found) -> np.ndarray:
    """Deflection of the beam's tip [m]."""
    return found.model.observe(np.zeros(1), found.x[None])["markers/beam.tip/deflection"][0]


def bent(ratio: float, k: int) -> tuple[float, float]:
    """w/L and u/L under a tip load with that P L^2 / EI."""
    found = equilibrium(cantilever(k, [0, 0.6 * ratio * EI / LENGTH**2, 0.8 * ratio * EI / LENGTH**2]))
    assert found.residual < 1e-9 and found.stable and not found.neutral
    u, y, z = tip(found)
    assert y / z == pytest.approx(0.75, rel=1e-6)  # no direction is preferred
    return float(np.hypot(y, z) / LENGTH), float(-u / LENGTH)


@pytest.mark.sampled(1)
@pytest.mark.parametrize("ratio", MATTIASSON)
def test_sixteen_segments_give_the_elastica_to_half_a_per_cent(ratio):
    assert elastica(ratio) == pytest.approx(MATTIASSON[ratio], abs=6e-6)  # the quadrature is right
    assert bent(ratio, 16) == pytest.approx(MATTIASSON[ratio], rel=1e-3)


@pytest.mark.slow
@pytest.mark.sampled(1)
@pytest.mark.parametrize("ratio", [2, 10])
def test_the_error_falls_with_the_square_of_the_number_of_segments(ratio):
    numbers = np.array([4, 8, 16])
    errors = [np.abs(np.array(bent(ratio, k)) - elastica(ratio)).max() for k in numbers]
    slope = np.polyfit(np.log(numbers), np.log(errors), 1)[0]
    assert slope == pytest.approx(-2.0, abs=0.15)


def test_a_force_that_turns_along_bends_the_beam_back_over():
    found = equilibrium(cantilever(12, [0, 0, 12 * EI / LENGTH**2], frame="body"))
    u, _, w = tip(found)
    assert found.iterations > 0 and w > 0 and u < -0.9 * LENGTH  # beyond the dead load's w/L = 0.83, u/L = 0.58


@pytest.mark.parametrize(("share", "stable"), [(0.98, True), (1.02, False)])
def test_a_column_buckles_at_eulers_load(share, stable):
    critical = np.pi**2 * EI / (4 * LENGTH**2)
    found = equilibrium(cantilever(12, [-share * critical, 0, 0]))
    assert found.stable is stable
    assert ("stable" if stable else "unstable: a small motion grows monotonically") in found.verdict
    assert tip(found)[1:] == pytest.approx(0.0, abs=1e-9)


def craft(pitch: float) -> System:
    """The Orbiter of VALIDATION row D, pitched."""
    axes = Marker.rigid(np.zeros(3), np.array([[0.0, 0, 1], [1, 0, 0], [0, 1, 0]]))
    body = rigid_body(79710.0, np.diag([8286760.0, 8646050.0, 1091430.0]), markers={"nominal": axes})
    start = quaternion_from_dcm(dcm_from_angles([pitch, 0.1, -0.1], "xzy"))
    return System(
        {"craft": body},
        (spherical("craft", child_marker="nominal", q0=start),),
        orbit=Orbit.from_perigee(331e3),
        frame=Frame("orbital"),
    )


def test_a_craft_in_orbit_comes_to_rest_where_the_gravity_gradient_holds_it():
    found = equilibrium(craft(0.3))
    seen = found.model.observe(np.zeros(1), found.x[None])
    assert seen["attitude/angles"][0] == pytest.approx(0.0, abs=1e-8)
    n = found.model.system.orbit.mean_motion
    assert np.abs(found.eigenvalues.imag)[::2] / n == pytest.approx([0.5687, 1.5801, 1.9266], abs=5e-5)
    assert found.stable


def test_a_small_craft_on_a_long_tether_comes_to_rest_too():
    """Its torques are 1e-8 of the tether's; held at its centre of mass, it librates as if it were alone."""
    alone = craft(0.3)
    small = rigid_body(
        79710.0, 1e-4 * np.diag([8286760.0, 8646050.0, 1091430.0]), markers=alone.bodies["craft"].markers
    )
    tether = rigid_body(50.0, 1e-3 * np.eye(3), [0, 0, 2e4])
    joints = (*alone.joints, universal("tether", "craft", q0=[0.1, -0.1]))
    near = Environment(attraction="gradient")
    system = replace(alone, bodies={"craft": small, "tether": tether}, joints=joints, environment=near)
    found = equilibrium(system)
    seen = found.model.observe(np.zeros(1), found.x[None])
    assert seen["attitude/angles"][0] == pytest.approx(0.0, abs=1e-5)
    n = system.orbit.mean_motion
    rates = np.sort(np.abs(found.eigenvalues.imag)[::2]) / n
    assert rates == pytest.approx([0.5687, 1.5801, np.sqrt(3), 1.9266, 2.0], abs=3e-3)
    assert found.stable and len(found.neutral) == 0


@pytest.mark.parametrize("parts", [[np.eye(3)], [np.diag([1.3, 0.7, 1.1]), np.diag([0.4, 1.0, 0.6])]])
def test_every_attitude_of_a_craft_of_three_equal_moments_is_an_equilibrium(parts):
    """What is left of the gravity gradient is rounding, 1e-16 of the moments times the square of the orbit's rate."""
    bodies = {f"part{k}": rigid_body(1.0, inertia) for k, inertia in enumerate(parts)}
    start = quaternion_from_dcm(dcm_from_angles([0.4, 0.2, -0.7], "xzy"))
    joints = (spherical("part0", q0=start), *(weld(name, "part0") for name in list(bodies)[1:]))
    found = equilibrium(System(bodies, joints, orbit=Orbit.from_perigee(5e5), frame=Frame("orbital")))
    assert found.stable and found.iterations == 0 and len(found.neutral) == 3
    assert found.q == pytest.approx(start, abs=1e-12)


def test_a_craft_that_is_nearly_a_sphere_has_an_attitude_of_its_own():
    system = craft(0.3)
    body = rigid_body(9.0, np.eye(3) + 1e-7 * np.diag([8.2, 8.6, 1.1]), markers=system.bodies["craft"].markers)
    found = equilibrium(replace(system, bodies={"craft": body}))
    seen = found.model.observe(np.zeros(1), found.x[None])
    assert seen["attitude/angles"][0] == pytest.approx(0.0, abs=1e-6) and not found.neutral and found.stable


def test_the_attitude_on_its_side_is_an_unstable_equilibrium():
    found = equilibrium(craft(1.4))
    seen = found.model.observe(np.zeros(1), found.x[None])
    assert seen["attitude/angles"][0][0] == pytest.approx(np.pi / 2, abs=1e-8)
    assert not found.stable and found.growth > 1e-3 * 1.0


def test_a_sprung_rod_on_a_spinning_hub_lifts_to_the_angle_of_the_scalar_equation():
    m, J, arm, R, k, rest, rate = 2.0, np.diag([0.02, 0.5, 0.5]), 1.2, 0.7, 40.0, -0.6, 3.0
    rod = rigid_body(m, J, [arm, 0, 0])
    joints = (weld("hub"), revolute("rod", "hub", axis=[0, 1, 0], parent_marker="rim", stiffness=[k], rest=[rest]))
    hub = rigid_body(10.0, np.eye(3), markers={"rim": Marker.rigid([R, 0, 0])})
    found = equilibrium(System({"hub": hub, "rod": rod}, joints, frame=Frame("spinning", np.array([0, 0, rate]))))

    def moment(angle, step=1e-5):
        def energy(a):
            spin = m * (R + arm * np.cos(a)) ** 2 + 0.02 * np.sin(a) ** 2 + 0.5 * np.cos(a) ** 2
            return k * (a - rest) ** 2 / 2 - rate**2 * spin / 2

        return (energy(angle + step) - energy(angle - step)) / (2 * step)

    angle = brentq(moment, -1.0, 0.5)
    assert found.x[0] == pytest.approx(angle, abs=1e-8)
    stiffness = (moment(angle + 1e-4) - moment(angle - 1e-4)) / 2e-4
    assert np.abs(found.eigenvalues.imag).max() == pytest.approx(np.sqrt(stiffness / (0.5 + m * arm**2)), rel=1e-5)


def test_what_nothing_resists_is_held_and_named():
    tumbler = rigid_body(3.0, np.diag([1.0, 2.0, 2.5]))
    found = equilibrium(System({"tumbler": tumbler}, (free("tumbler", q0=[1, 2, 3, 1, 0, 0, 0]),)))
    assert len(found.neutral) == 6 and found.x[:3] == pytest.approx([1, 2, 3]) and found.stable
    axle = equilibrium(System({"wheel": tumbler}, (revolute("wheel", q0=[0.4]),)))
    assert axle.neutral == ("base-wheel.angle",) and axle.x[0] == 0.4
    assert "neutral along base-wheel.angle" in axle.verdict


def test_cables_at_rest_without_tension_have_no_equilibrium():
    text = """
        title = "wire"
        run = { duration = 1 }
        joints = [{ kind = "free", child = "craft" }, { kind = "weld", child = "wire", parent = "craft" }]
        bodies.craft = { kind = "rigid", mass = 10, inertia = [1, 1, 1] }
        [bodies.wire]
        kind = "deploying"
        family = "tether"
        length = 1
        mass_per_length = 0.02
        functions = { y = 1, z = 1 }
    """
    system = build_system(parse_case(text, Path("wire.toml")))
    with pytest.raises(EquilibriumError, match="stiffness is singular, as of a cable without tension"):
        equilibrium(system, at=0.0)


def test_a_force_that_nothing_resists_has_no_equilibrium():
    slider = System(
        {"slider": rigid_body(1.0, np.eye(3))},
        (prismatic("slider"),),
        (Load("push", "slider", force=np.array([1.0, 0, 0])),),
    )
    with pytest.raises(EquilibriumError, match=r"beyond 0 of the loads.*base-slider.slide.*nothing resists") as told:
        equilibrium(slider)
    last = told.value.last
    assert last.x == pytest.approx(0.0) and last.share == 0.0
    assert len(last.eigenvalues) == 0


def refusal(system: System) -> str:
    with pytest.raises(ValueError) as told:
        equilibrium(system)
    return str(told.value)


def test_forces_that_change_over_time_are_told():
    joints = [weld("beam", child_marker="root")]
    ramp = Load("ramp", "beam", "tip", force=np.array([[0, 0, 0], [0, 0, 9.0]]), times=np.array([0.0, 2.0]))
    ramped = assembled({"beam": beam(4)}, joints, [ramp])
    assert "load 'ramp' changes over time" in refusal(ramped)
    late, steady = equilibrium(ramped, at=1.0), equilibrium(cantilever(4, [0, 0, 4.5], frame="body"))
    assert tip(late) == pytest.approx(tip(steady), rel=1e-9, abs=1e-12)
    dead = Load("dead", "beam", "tip", frame="inertial", force=np.array([0, 0, 1.0]))
    spun = assembled({"beam": beam(4)}, joints, [dead], frame=Frame("spinning", np.array([0, 0, 1.0])))
    assert "load 'dead' keeps its direction in the inertial frame" in refusal(spun)
    body = {"craft": rigid_body(1.0, np.diag([1.0, 1.2, 1.4]))}
    round_ = Orbit.from_perigee(400e3)
    assert "which the direction of gravity turns once per orbit" in refusal(
        System(body, (spherical("craft"),), orbit=round_)
    )
    oval = Orbit.from_perigee(400e3, 0.1)
    assert "eccentricity is 0.1" in refusal(System(body, (spherical("craft"),), orbit=oval, frame=Frame("orbital")))


def test_held_freedoms_are_not_sought():
    arm = rigid_body(1.0, np.eye(3), [1.0, 0, 0])
    joints = (
        revolute("first", motion=(0.3,)),
        revolute("second", "first", stiffness=[5.0], rest=[0.2]),
        revolute("third", "second", motion=(Profile.polynomial(0.1, 0.5),)),
    )
    system = System({"first": arm, "second": arm, "third": arm}, joints)
    assert "'second-third.angle' changes over time" in refusal(system)
    found = equilibrium(system, at=2.0)
    assert found.x[:3] == pytest.approx([0.3, 0.2, 1.1]) and not found.neutral and found.stable
    assert len(found.eigenvalues) == 2


def test_springs_between_markers_pull_like_loads():
    stay = Spring("stay", "beam", marker="tip", stiffness=200.0, length=8.0)  # 400 N, below pi^2 EI / L^2
    found = equilibrium(assembled({"beam": beam(4)}, [weld("beam", child_marker="root")], springs=[stay]))
    assert found.model.system.springs[0].body == "beam.4" and found.stable
    bent = -tip(found)[0]
    assert bent == pytest.approx(200.0 * (2.0 - bent) * LENGTH / 2.8e9, rel=1e-6)  # EA = 2.8e9 N
