"""Torque budgets against closed forms: gravity gradient, sunlight on free and held craft, and a bent panel."""

from __future__ import annotations

import numpy as np
import pytest

import femflex
from femflex import Orbit, System, rigid_body, simulate
from femflex.body import Marker, Skin
from femflex.effectors import SolarPressure, Sun, Surface
from femflex.rotations import dcm_from_quaternion
from femflex.studies.torque_budget import torque_budget
from femflex.system import Environment, free, spherical, weld, with_effectors

INERTIA = np.diag([30.0, 45.0, 60.0])


def budget_of(run):
    return torque_budget(run.model, run.times, run.motion.states, run)


def test_gravity_gradient_of_a_tilted_craft():
    """3 n^2 l x J l with l the vertical in body axes, at every instant."""
    orbit = Orbit(7.0e6)
    craft = System({"hub": rigid_body(100.0, INERTIA)}, [spherical("hub", q0=[0.9, 0.1, -0.2, 0.3])], orbit=orbit)
    run = simulate(craft, orbit.period)
    budget = budget_of(run)
    (source,) = budget.sources
    attitude = dcm_from_quaternion(run["bodies/hub/attitude"])
    vertical = np.einsum("tji,tj->ti", attitude, dcm_from_quaternion(run["orbit/attitude"])[:, :, 1])
    exact = 3 * orbit.mean_motion**2 * np.cross(vertical, vertical @ INERTIA)
    assert (source.name, budget.orbits, budget.whole) == ("gravity_gradient", 1.0, True)
    np.testing.assert_allclose(source.torque, exact, atol=1e-9 * np.abs(exact).max())


def test_oblateness_on_a_tilted_craft():
    """The moment of the second differences of the potential of J2, about axes that roll, over the second moments."""
    orbit, J2, mu, R = Orbit(7.0e6, inclination=1.1, node=0.4), 1.0826e-3, 3.986004418e14, 6378137.0
    craft = System(
        {"hub": rigid_body(100.0, INERTIA)},
        [spherical("hub", q0=[0.9, 0.1, -0.2, 0.3])],
        orbit=orbit,
        environment=Environment(oblateness=J2),
    )
    run = simulate(craft, orbit.period / 4)
    budget = budget_of(run)
    assert [each.name for each in budget.sources] == ["gravity_gradient", "attraction/oblateness", "sum"]

    def potential(r):
        d = np.linalg.norm(r, axis=-1)
        return mu * J2 * R**2 / d**3 * (1.5 * (r[..., 2] / d) ** 2 - 0.5)

    place = 7.0e6 * dcm_from_quaternion(run["orbit/attitude"])[:, :, 1]
    steps, h = 2e3 * np.eye(3), 2e3
    H = (
        np.array(
            [
                [
                    sum(
                        a * b * potential(place + a * steps[i] / 2 + b * steps[j] / 2) for a in (1, -1) for b in (1, -1)
                    )
                    for j in range(3)
                ]
                for i in range(3)
            ]
        ).transpose(2, 0, 1)
        / h**2
    )
    attitude = dcm_from_quaternion(run["bodies/hub/attitude"])
    along = attitude.transpose(0, 2, 1) @ -H @ attitude @ (np.trace(INERTIA) / 2 * np.eye(3) - INERTIA)
    exact = np.stack([along[:, k, j] - along[:, j, k] for j, k in ((1, 2), (2, 0), (0, 1))], axis=1)
    np.testing.assert_allclose(budget.sources[1].torque, exact, atol=1e-5 * np.abs(exact).max())


def test_light_on_a_free_craft_about_its_centre_of_mass():
    """A plate off the centre of two welded bodies: (r - r_cm) x F and F, while the craft tumbles."""
    plate = Skin(
        np.array([[0, 0, 0], [1, 0, 0], [1, 2, 0], [0, 2, 0.0]]),
        {"quad": np.array([[0, 1, 2, 3]])},
        np.zeros((0, 4, 3)),
    )
    hub = rigid_body(10.0, INERTIA, markers={"side": Marker.at_position(np.array([0.0, 1.0, 0.5]))})
    sheet = rigid_body(2.0, np.diag([0.7, 0.2, 0.9]), np.array([0.5, 1.0, 0.0]), skin=plate)
    nouns = {"sun": Sun(kind="sun", direction=(0.6, 0, 0.8)), "skin": Surface(body="sheet"), "light": SolarPressure()}
    joints = [free("hub", u0=[0, 0.1, 0, 0.2, -0.1, 0.15]), weld("sheet", "hub", parent_marker="side")]
    run = simulate(with_effectors(System({"hub": hub, "sheet": sheet}, joints), nouns), 4.0)
    source = budget_of(run).sources[-1]
    C = dcm_from_quaternion(run["bodies/hub/attitude"])
    n, s, area = C[:, :, 2], np.array([0.6, 0, 0.8]), 2.0
    c = np.maximum(n @ s, 0.0)
    force = -1361 / 299792458 * area * c[:, None] * s
    arm = (
        np.einsum("tij,j->ti", C, np.array([0.5, 2.0, 0.5]))
        + run["bodies/hub/position"]
        - run["monitors/center_of_mass"]
    )
    torque = np.einsum("tji,tj->ti", C, np.cross(arm, force))
    assert (c == 0.0).any() or c.min() < 0.99 * c.max()
    np.testing.assert_allclose(source.torque, torque, atol=1e-9 * np.abs(torque).max())
    np.testing.assert_allclose(source.force, force, atol=1e-9 * np.abs(force).max())


def test_momentum_of_a_geostationary_day():
    """The closed form in the head of the shipped case: F d T about a fixed axis, nothing cyclic."""
    case = femflex.read_case("cases/geostationary_momentum.toml")
    system = femflex.build_system(case)
    run = simulate(system, system.orbit.period)
    budget = budget_of(run)
    total = budget.sources[-1]
    F = 1361 / 299792458 * 10.0 * (1 + 0.1 + 0.2 / 3)
    np.testing.assert_allclose(budget.secular(total), [0, -F * 4.0 * system.orbit.period, 0], rtol=1e-4, atol=1e-4)
    assert budget.cyclic(total) < 1e-4
    assert total.largest == pytest.approx(4 * F, rel=1e-6)
    assert total.mean_force == pytest.approx(F, rel=1e-6)
