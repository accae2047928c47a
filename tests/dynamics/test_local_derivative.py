"""Derivatives by falling steps: laws far narrower or wider than the first step, and what cancels in a function."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from femflex.body import Marker, rigid_body
from femflex.dynamics import compile_system
from femflex.dynamics.equilibria.linearised import linearised
from femflex.dynamics.equilibria.local_derivative import local_derivative
from femflex.system import Friction, Load, Stop, System, cable, prismatic, revolute, weld


@pytest.mark.parametrize("width", [1e-8, 1e-5, 1e-2, 1.0, 1e3])
def test_a_limit_of_any_width_has_its_slope(width):
    found = local_derivative(lambda h: np.array([3.0 * np.tanh(h / width), np.clip(h / width, -1, 1)]), 1.0)
    assert found == pytest.approx([3.0 / width, 1.0 / width], rel=1e-4)


def test_functions_of_second_degree_are_exact_beside_large_numbers_that_cancel():
    found = local_derivative(lambda h: np.array([(1e9 + 0.02 * h + 5 * h * h) - 1e9, 7.0]), 1.0, 1e9)
    assert found == pytest.approx([0.02, 0.0], abs=1e-6)


def test_a_step_is_found_between_a_narrow_law_and_a_smooth_one():
    found = local_derivative(lambda h: np.array([np.sin(h) + 1e-3 * np.tanh(h / 1e-6)]), 1.0)
    assert found == pytest.approx([1.0 + 1e3], rel=1e-6)


@pytest.mark.parametrize("span", [1.0, 1e3, 1e4])
def test_stops_and_cables_of_large_craft_have_their_own_stiffness(span):
    """A slide steps by a part of the craft's length, and a stop or a hair of stretch is millimetres wide."""
    hub = rigid_body(1e3, np.eye(3), markers={"far": Marker.rigid([span, 0, 0])})
    bodies = {"hub": hub, "box": rigid_body(1.0, np.eye(3))}
    stop = Stop(upper=0.0, stiffness=100.0, width=1e-3)
    slide = replace(prismatic("box", "hub", q0=[6e-4]), laws=(stop,))
    model = compile_system(System(bodies, (weld("hub"), slide)))
    assert linearised(model, 0.0, model.x0).K[0, 0] == pytest.approx(float(stop.potential(np.array(6e-4))[2]), rel=1e-6)
    line = cable("line", (("hub", "origin"), ("box", "origin")), 1.0, 1e4)
    taut = System(bodies, (weld("hub"), prismatic("box", "hub", axis=[1, 0, 0], q0=[1.0005])), effectors=(line,))
    model = compile_system(taut)
    assert linearised(model, 0.0, model.x0).K[0, 0] == pytest.approx(1e4, rel=1e-6)


@pytest.mark.parametrize("rate", [0.0, 1e3, 1e4])
def test_friction_beside_a_fast_rotor_has_its_own_damping(rate):
    bodies = {"arm": rigid_body(1.0, np.eye(3)), "rotor": rigid_body(1.0, np.eye(3))}
    hinge = replace(revolute("arm"), laws=(Friction(limit=0.5, velocity=1e-3),))
    model = compile_system(System(bodies, (hinge, revolute("rotor", u0=[rate]))))
    assert linearised(model, 0.0, model.x0).D[0, 0] == pytest.approx(500.0, rel=1e-6)


@pytest.mark.parametrize(
    ("J", "k", "c", "torque"), [(1e-2, 1e10, 0.02, 3.1e9), (1e3, 1e9, 0.1, 1e8), (1e6, 1e6, 1e-4, 1e5)]
)
def test_light_damping_is_not_lost_beside_large_loads_in_balance(J, k, c, torque):
    hinge = replace(revolute("arm", q0=[torque / k]), stiffness=np.array([k]), damping=np.array([c]))
    load = Load("hold", "arm", frame="inertial", torque=np.array([0.0, 0.0, torque]))
    model = compile_system(System({"arm": rigid_body(1.0, J * np.eye(3))}, (hinge,), loads=(load,)))
    assert linearised(model, 0.0, model.x0).D[0, 0] == pytest.approx(c, rel=1e-6)


def test_rounding_counts_by_its_size_on_both_sides_of_zero():
    """Steps of 1 leave 6e-11 of the slope beside 1e6, steps a hundred times shorter 6e-9."""
    found = local_derivative(lambda h: np.array([1e6 + 1e-3 * h, -1e6 + 1e-3 * h, -1e6 - 1e-3 * h]), 1.0)
    assert found == pytest.approx([1e-3, 1e-3, -1e-3], abs=3e-10)
