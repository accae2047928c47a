"""Constrained motion against closed forms, published numbers and invariants."""

import numpy as np
import pytest
from support.mechanisms import ANDREWS, andrews, bar, floating_loop, four_bar, leaning_disc, planar, sleigh

from femflex.body import Marker, rigid_body
from femflex.dynamics import compile_system
from femflex.integrate import Dop853
from femflex.system import Load, System, free, revolute, spherical, velocity_rows, weld


def run(system, times, **settings):
    model = compile_system(system)
    states = Dop853(**settings).solve(model, times, model.x0).states
    return model, states, model.observe(times, states)


def test_andrews_squeezer_ends_where_the_test_set_says():
    model, states, out = run(andrews(), np.linspace(0, 0.03, 31), rtol=1e-11, atol=1e-12)
    found = dict(zip([b for b in model.system.order if b != "ground"], states[-1], strict=False))
    assert found == pytest.approx(ANDREWS, abs=1e-8)
    assert model.constraints.n_rows == 15
    assert model.constraints.redundant(0.0, model.x0) == 9  # per loop: one slide and two turns out of the plane
    work = 33e-3 * (states[:, 0] - states[0, 0])
    energy = out["monitors/energy"] - out["monitors/energy"][0]
    assert energy == pytest.approx(work, abs=1e-9 * np.abs(work).max())


@pytest.mark.slow
def test_four_bar_of_ordinary_joints_keeps_its_loop_and_its_energy_for_1000_seconds():
    model, _, out = run(four_bar(), np.linspace(0, 1000, 2001))
    assert model.constraints.redundant(0.0, model.x0) == 3
    assert out["monitors/constraint_position"].max() < 1e-11
    assert out["monitors/constraint_velocity"].max() < 1e-11
    energy = out["monitors/energy"]
    assert np.ptp(energy) < 1e-6 * energy[0]


def test_order_stays_eight_with_constraints():
    end, times = 2.0, np.array([0.0, 2.0])
    model = compile_system(four_bar(speed=3.0))
    exact = Dop853(rtol=1e-13, atol=1e-14).solve(model, times, model.x0).states[-1]
    counts, errors = np.array([10, 14, 20, 28]), []
    for n in counts:
        fixed = Dop853(rtol=1e6, atol=1e6, max_step=end / n)
        solution = fixed.solve(model, times, model.x0)
        errors.append(np.linalg.norm(solution.states[-1] - exact))
    slope = -np.polyfit(np.log(counts), np.log(errors), 1)[0]
    assert slope == pytest.approx(8, abs=0.7)


def test_chaplygin_sleigh_follows_tanh_and_sech():
    mass, inertia, ahead, turn = 2.0, 0.3, 0.4, 1.7
    J = inertia + mass * ahead**2
    V = turn * np.sqrt(J / mass)  # all energy ends in the run ahead
    k = V * mass * ahead / J
    times = np.linspace(0, 4, 81)
    model, states, _ = run(sleigh(turn, mass, inertia, ahead), times, rtol=1e-12, atol=1e-13)
    u = states[:, model.n_q :]
    ahead_speed = u[:, 0] * np.cos(states[:, 5]) + u[:, 1] * np.sin(states[:, 5])
    assert ahead_speed == pytest.approx(V * np.tanh(k * times), abs=1e-8)
    assert u[:, 5] == pytest.approx(turn / np.cosh(k * times), abs=1e-8)


def test_general_rows_written_in_python_do_what_the_knife_edge_does():
    def across(t, q):
        A = np.zeros((1, 6))
        A[0, :2] = -np.sin(q[5]), np.cos(q[5])
        return A, np.zeros(1)

    times = np.linspace(0, 1, 5)
    _, ours, _ = run(sleigh(1.7, constraint=velocity_rows("blade", 1, across)), times)
    _, theirs, _ = run(sleigh(1.7), times)
    assert ours == pytest.approx(theirs, abs=1e-8)


def test_general_rows_with_a_time_dependent_right_side_drive_a_coordinate():
    body = planar(2.0, 0.3, (0.2, 0))
    driven = velocity_rows("motor", 1, lambda t, q: (np.ones((1, 1)), np.array([np.sin(3 * t)])))
    times = np.linspace(0, 2, 9)
    system = System({"arm": body}, (revolute("arm"),), constraints=(driven,))
    _, states, out = run(system, times, rtol=1e-12, atol=1e-13)
    assert states[:, 0] == pytest.approx((1 - np.cos(3 * times)) / 3, abs=1e-10)
    torque = (0.3 + 2 * 0.2**2) * 3 * np.cos(3 * times)
    assert out["constraints/motor/multipliers"][:, 0] == pytest.approx(torque, abs=1e-8)


@pytest.mark.parametrize("speed", [1.6, 3.0])  # v^2 > g R / 3 = 1.635 m^2/s^2
def test_rolling_disc_leans_at_its_linear_frequency(speed):
    radius, g, lean = 0.5, 9.81, 1e-5
    square = (3 * speed**2 - g * radius) / (1.25 * radius**2)
    middle = 3 * speed**2 / (3 * speed**2 - g * radius) * lean
    times = np.linspace(0, 6 / np.sqrt(square), 61)
    system = leaning_disc(lean, speed / radius, radius, gravity=g)
    _, _, out = run(system, times, rtol=1e-12, atol=1e-14)
    e = out["bodies/disc/attitude"]
    found = np.arcsin(1 - 2 * (e[:, 1] ** 2 + e[:, 2] ** 2))
    assert found == pytest.approx(middle + (lean - middle) * np.cos(np.sqrt(square) * times), abs=1e-5 * lean)
    height = out["bodies/disc/position"][:, 2]
    assert height == pytest.approx(radius * np.cos(found), abs=1e-12)


def test_rolling_disc_falls_below_its_critical_speed():
    radius, g, speed, lean = 0.5, 9.81, 1.2, 1e-6
    rate = np.sqrt((g * radius - 3 * speed**2) / (1.25 * radius**2))
    times = np.array([0.0, 3.0 / rate])
    _, _, out = run(leaning_disc(lean, speed / radius, radius, gravity=g), times, rtol=1e-12, atol=1e-16)
    e = out["bodies/disc/attitude"][-1]
    middle = 3 * speed**2 / (3 * speed**2 - g * radius) * lean
    assert np.arcsin(1 - 2 * (e[1] ** 2 + e[2] ** 2)) == pytest.approx(middle + (lean - middle) * np.cosh(3), rel=1e-5)


def test_fast_leaning_disc_keeps_its_energy():
    system = leaning_disc(0.6, 9.0)
    _, _, out = run(system, np.linspace(0, 20, 201))
    weighed = 2.0 * 9.81 * out["bodies/disc/position"][:, 2]
    assert out["monitors/load"] == pytest.approx(weighed, rel=1e-12)
    assert out["monitors/energy"] == pytest.approx(np.full(201, out["monitors/energy"][0]), rel=1e-9)
    assert out["monitors/constraint_velocity"].max() < 1e-11
    touches, center = out["constraints/contact/place"], out["bodies/disc/position"]
    assert np.abs(touches[:, 2]).max() < 1e-11  # on the plane, a radius from the centre, along the material's rest
    assert np.linalg.norm(touches - center, axis=1) == pytest.approx(np.full(201, 0.5), abs=1e-12)
    assert np.ptp(touches[:, :2], axis=0).min() > 0.1


def test_reaction_of_a_loop_is_mass_times_acceleration_less_weight():
    anchor = rigid_body(1.0, np.eye(3), markers={"nail": Marker.rigid([0, 0, 2.0])})
    weight = Load("weight", "rod", "middle", "inertial", force=[0, -9.81, 0])
    rod = bar(1.0)
    rod.markers["middle"] = Marker.rigid([0.5, 0, 0])
    start = free("rod", q0=[0, 0, 2.0, np.cos(0.3), 0, 0, np.sin(0.3)], u0=[0, 0, 0, 0, 0, 2.0])
    system = System(
        {"anchor": anchor, "rod": rod},
        (weld("anchor"), start),
        loads=(weight,),
        loops=(revolute("rod", "anchor", parent_marker="nail", name="pin"),),
    )
    model = compile_system(system)
    out = model.observe(np.zeros(1), model.x0[None])
    alpha = -9.81 * 0.5 * np.cos(0.6) / (1 / 3)
    along, across = np.array([np.cos(0.6), np.sin(0.6), 0]), np.array([-np.sin(0.6), np.cos(0.6), 0])
    expected = 0.5 * alpha * across - 0.5 * 4.0 * along + np.array([0, 9.81, 0])
    assert out["loops/pin/force"][0] == pytest.approx(expected, abs=1e-10)
    assert out["loops/pin/torque"][0] == pytest.approx(np.zeros(3), abs=1e-10)


def test_start_is_the_nearest_closed_state_by_mass():
    system = four_bar()
    model, given = compile_system(system), system.initial_state()
    A, M = model.constraints.matrix(0.0, model.x0), model.mass_matrix(0.0, model.x0)
    along = np.linalg.svd(A)[2][-1]  # the one direction in which the mechanism moves
    assert along @ M @ (model.x0 - given)[:3] == pytest.approx(0.0, abs=1e-10)
    assert along @ M @ (model.x0 - given)[3:] == pytest.approx(0.0, abs=1e-10)


def test_a_loop_that_cannot_close_says_so():
    with pytest.raises(ValueError, match=r"loop 'closure' cannot close: .* gap of \d\.\d+ \(m or rad\)"):
        compile_system(four_bar(base=5.0))


@pytest.mark.parametrize(
    ("loop", "sentence"),
    [
        (revolute("a", "a", name="x"), "loop 'x' joins body 'a' to itself"),
        (revolute("a", "b", name="x", stiffness=[1.0]), "loop 'x' has a spring or a damper"),
        (free("a", "b", name="x"), "loop 'x' is free in all six motions"),
        (spherical("a", "c", name="x"), "body 'c' of loop 'x' does not exist"),
        (spherical("a", "b", name="x", child_marker="no"), "marker 'no' of loop 'x' is not on body 'a'"),
    ],
)
def test_bad_loops_are_refused_in_a_sentence(loop, sentence):
    with pytest.raises(ValueError, match=sentence):
        System({"a": bar(1.0), "b": bar(1.0)}, (revolute("a"), revolute("b", "a")), loops=(loop,))


def cancelled(values, scale):
    return np.abs(values).max() <= 1e-9 * scale


def test_power_and_momentum_balance_in_a_free_flying_closed_loop():
    """A loop of three bodies in free space with a spring between markers: energy, momentum and spin stay."""
    system = floating_loop()
    model = compile_system(system)
    times = np.linspace(0, 2, 41)
    out = model.observe(times, Dop853().solve(model, times, model.x0).states)
    for path in ("monitors/energy", "monitors/momentum", "monitors/angular_momentum"):
        values = out[path]
        assert cancelled(values - values[0], max(1.0, np.abs(values).max())), path
    assert np.ptp(out["monitors/spring"]) > 0.01 * out["monitors/energy"][0]


@pytest.mark.slow
def test_disc_just_above_and_below_its_critical_speed_stays_up_or_falls():
    radius, g, lean = 0.5, 9.81, 1e-6
    critical = np.sqrt(g * radius / 3)
    for factor, stays in ((1.02, True), (0.98, False)):
        system = leaning_disc(lean, factor * critical / radius, radius, gravity=g)
        _, _, out = run(system, np.linspace(0, 10, 201), rtol=1e-12, atol=1e-16)
        e = out["bodies/disc/attitude"]
        largest = np.abs(np.arcsin(1 - 2 * (e[:, 1] ** 2 + e[:, 2] ** 2))).max()
        assert (largest < 100 * lean) == stays
