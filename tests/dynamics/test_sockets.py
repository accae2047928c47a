"""The sockets of forces and effectors, used from this file alone: nothing of femflex knows what is added here.

A force at a marker, an effector with states that spends mass, a law of a joint, an output, a sampled controller: each
stands in channels, ledger and balance of energies, can be switched off, and works with every integrator.
"""

import math
import os
from dataclasses import replace

import numba
import numpy as np
import pytest
from scipy.optimize import brentq
from support.mechanisms import four_bar
from support.random_systems import random_body
from support.scipy_integrators import integrator

from femflex import run as run_case
from femflex.body import Marker
from femflex.body.rigid import rigid_body
from femflex.dynamics import compile_system
from femflex.dynamics.equilibria.equilibrium import equilibrium
from femflex.dynamics.equilibria.linearised import linearised
from femflex.dynamics.motion.led_equations import led_rate
from femflex.integrate import Dop853, Esdirk4, GeneralizedAlpha, driver
from femflex.pipeline import rebuilt
from femflex.system import (
    Block,
    Controller,
    Effector,
    Frame,
    Orbit,
    StateEvent,
    System,
    Variation,
    free,
    revolute,
    spherical,
    weld,
)

METHODS = {
    "dop853": Dop853(rtol=1e-10, atol=1e-11),
    "esdirk4": Esdirk4(rtol=1e-8, atol=1e-9),
    "generalized_alpha": GeneralizedAlpha(rtol=1e-6, atol=1e-7),
    "scipy_radau": integrator("scipy_radau", rtol=1e-8, atol=1e-9),
}
ERRORS = {"dop853": 1e-8, "esdirk4": 3e-6, "generalized_alpha": 3e-3, "scipy_radau": 1e-5}  # three times what is seen
SLOW_LAG, EXIT = 0.5, 2000.0  # s; m/s


def drag(seen, out):
    """Force -c |v| v on a marker."""
    v = seen.velocity[0]
    speed = math.sqrt(v[0] ** 2 + v[1] ** 2 + v[2] ** 2)
    for k in range(3):
        out.force[0, k] = -seen.parameters[0] * speed * v[k]
    out.dissipation[0] = seen.parameters[0] * speed**3


def thruster(seen, out):
    """Thrust along a marker's x axis that follows its command with a lag, and spends propellant."""
    thrust, propellant = seen.z[0], seen.z[1]
    most, lag, exit_speed = seen.parameters[0], seen.parameters[1], seen.parameters[2]
    wanted = most * seen.input[0] if propellant > 0.0 else 0.0
    out.zdot[0], out.zdot[1] = (wanted - thrust) / lag, -thrust / exit_speed
    for k in range(3):
        out.force[0, k] = thrust * seen.attitude[0, k, 0]
        out.supplied[0] += out.force[0, k] * seen.velocity[0, k]
    out.mass_flow[0] = thrust / exit_speed
    out.channel[0] = wanted


def cubic_spring(seen, out):
    """Torque -k q^3 of a joint."""
    k, q = seen.parameters[0], seen.coordinate[0]
    out.effort[0], out.energy[0] = -k * q**3, 0.25 * k * q**4


def distance(seen, out):
    """Distance between two markers, as an output alone."""
    d = seen.position[1] - seen.position[0]
    out.channel[0] = math.sqrt(d[0] ** 2 + d[1] ** 2 + d[2] ** 2)


def bang(t, sensors, memory):
    """Command 1 while the hub is slower than 0.3 m/s along x, counting its calls."""
    slow = sensors["bodies/hub/position"][0] < 0.02 + 0.001 * memory[0]
    return float(slow), memory + 1.0


DRAG = Effector("drag", drag, (("boom", "a"),), parameters=np.array([0.3]), accounts=("dissipation",))
THRUSTER = Effector(
    "jet",
    thruster,
    (("hub", "nozzle"),),
    states={"thrust": "N", "propellant": "kg"},
    z0=np.array([0.0, 0.5]),
    inputs=("pilot.valve",),
    channels={"wanted": "N"},
    accounts=("supplied", "mass_flow"),
    parameters=np.array([4.0, 0.3, EXIT]),
)
SPRING = Effector("cubic", cubic_spring, freedoms=("hinge.angle",), parameters=np.array([20.0]), accounts=("energy",))
OUTPUT = Effector("span", distance, (("hub", "nozzle"), ("boom", "c")), channels={"distance": "m"})
PILOT = Controller("pilot", bang, 0.1, ("bodies/hub/position",), {"valve": "1"}, np.array([0.0]), np.array([0.0]))
ALL = (PILOT, DRAG, THRUSTER, SPRING, OUTPUT)


def hub(mass=20.0):
    place = Marker.rigid(np.array([-0.2, 0.1, 0.0]))
    return rigid_body(mass, np.diag([3.0, 4.0, 5.0]), markers={"origin": Marker.rigid(np.zeros(3)), "nozzle": place})


def craft(effectors=ALL):
    """A free hub with a flexible boom on a hinge, under everything that this file adds."""
    boom, _ = random_body(np.random.default_rng(3), 2)
    joints = (
        free("hub", u0=np.array([0.1, 0.0, 0.05, 0.02, -0.03, 0.04])),
        revolute("boom", "hub", child_marker="b", name="hinge", q0=np.array([0.4]), u0=np.array([0.2])),
    )
    return System({"hub": hub(), "boom": boom}, joints, effectors=effectors)


def run(model, method, end=1.0, n=41):
    times = np.linspace(0.0, end, n)
    return times, method.solve(model, times, model.x0).states


@pytest.fixture(scope="module")
def model():
    return compile_system(craft())


@pytest.fixture(scope="module")
def fine(model):
    """A fine reference of the craft's motion."""
    return run(model, Dop853(rtol=1e-12, atol=1e-13))[1]


def test_states_follow_coordinates_and_velocities(model):
    names = [name for name, _ in model.system.state_names()]
    assert names == ["pilot.valve", "pilot.memory1", "pilot.next", "jet.thrust", "jet.propellant"]
    assert model.n_x == model.n_q + model.n_u + 5 == len(model.system.all_state_names())
    assert model.channels["z"].names == tuple(names)
    assert model.channels["effectors/pilot/valve"].description.endswith("sampled every 0.1 s (zero-order hold)")
    assert model.channels["effectors/jet/thrust"].description == "state thrust of jet"


@pytest.mark.parametrize("name", METHODS)
def test_every_integrator_gives_the_same_motion(model, fine, name):
    _, states = run(model, METHODS[name])
    assert np.abs(states - fine).max() < ERRORS[name]


def test_the_balance_of_energies_closes(model):
    """d(energy)/dt = supplied - dissipation at every instant, by a difference of the energy along the motion."""
    times = np.linspace(0.0, 0.95, 20) + 0.025  # between samples
    _, states = run(model, Dop853(rtol=1e-12, atol=1e-13), 1.0, 41)
    for t, x in zip(times, states[1::2], strict=True):
        h, dx = 1e-5, model.state_rate(t, x)
        near = model.observe(np.array([t - h, t, t + h]), np.array([x - h * dx, x, x + h * dx]))
        slope = (near["monitors/energy"][2] - near["monitors/energy"][0]) / (2 * h)
        gained = near["monitors/supplied"][1] - near["monitors/dissipation"][1]
        assert slope == pytest.approx(gained, abs=1e-6)  # h^2 of the difference
        for name in ("drag", "jet"):  # what each gives to the motion is what it says of itself
            told = near[f"effectors/{name}/supplied"] - near[f"effectors/{name}/dissipation"]
            assert near[f"effectors/{name}/power"] == pytest.approx(told, abs=1e-12)
        assert near["monitors/effector"] == pytest.approx(near["effectors/cubic/energy"])
    seen = model.observe(np.linspace(0, 1, 41), states)
    assert seen["effectors/jet/thrust"].max() > 1.0 and seen["effectors/drag/dissipation"].max() > 1e-3


def test_the_ledger_has_a_row_for_each_and_sums_to_zero(model, fine):
    times = np.linspace(0.0, 1.0, 41)
    rows = model.terms(times, fine)
    assert {"effectors/drag", "effectors/jet", "effectors/cubic", "effectors/span"} <= rows.keys()
    total = sum(rows.values())
    assert np.abs(total).max() < 1e-11 * max(np.abs(row).max() for row in rows.values())
    hinge = [name for name, _ in model.system.velocity_names()].index("hinge.angle_rate")
    angle = fine[:, [name for name, _ in model.system.coordinate_names()].index("hinge.angle")]
    expected = np.zeros((41, model.n_u))
    expected[:, hinge] = 20.0 * angle**3
    assert rows["effectors/cubic"] == pytest.approx(expected, abs=1e-12)
    assert not rows["effectors/span"].any()
    u = model.parts(fine)[1]
    seen = model.observe(times, fine)
    for name in ("drag", "jet"):  # -Q . u is minus the power of force and torque at the marker
        assert np.sum(rows[f"effectors/{name}"] * u, axis=1) == pytest.approx(
            -seen[f"effectors/{name}/power"], abs=1e-12
        )


def test_each_can_be_switched_off(model):
    for name in ("drag", "effectors/cubic", "span", "pilot"):
        less = model.without(name)
        assert less.omitted == (f"effectors/{name.removeprefix('effectors/')}",)
        _, states = run(less, METHODS["dop853"], 0.3, 4)
        assert np.isfinite(states).all()
    less = model.without("pilot")  # never called: the valve stays as it was at the start
    assert not run(less, METHODS["dop853"], 0.3, 4)[1][:, -5].any()
    less = model.without("drag", "jet", "cubic", "span")
    alone = compile_system(craft(()))
    x = less.x0[: alone.n_x]
    assert less.state_rate(0.0, less.x0)[: alone.n_x] == pytest.approx(alone.state_rate(0.0, x), abs=1e-13)


def test_terms_of_the_equations_can_be_switched_off_beside_effectors(model):
    less = model.without("coriolis_centrifugal")
    rates = [m.state_rate(0.0, m.x0) for m in (less, model)]
    assert rates[0][-2:] == pytest.approx(rates[1][-2:], abs=1e-15)
    assert np.abs(rates[0] - rates[1]).max() > 1e-4
    for name in ("dop853", "esdirk4"):
        assert run(less, METHODS[name], 0.3, 4)[1] == pytest.approx(
            run(less, METHODS["dop853"], 0.3, 4)[1], abs=ERRORS[name]
        )


@pytest.mark.parametrize("name", ["dop853", "esdirk4", "generalized_alpha"])
def test_a_run_resumes_bit_for_bit(model, name, monkeypatch):
    """From blocks that end between two samples, and at one, with a model compiled anew."""
    times, method = np.linspace(0.0, 1.0, 41), METHODS[name]
    whole = method.solve(model, times, model.x0).states
    monkeypatch.setattr(driver, "ROWS", 5)
    blocks = list(method.blocks(model, times, model.x0))
    assert np.array_equal(np.vstack([block.states for block in blocks]), whole)
    monkeypatch.undo()
    again = compile_system(craft())
    for done in range(1, len(blocks)):
        rest = method.solve(again, times, again.x0, state=blocks[done - 1].resume)
        count = sum(len(block.times) for block in blocks[:done])
        assert np.array_equal(rest.states, whole[count:])


def test_drag_slows_a_body_by_the_closed_form():
    system = System(
        {"hub": hub(2.0)},
        (free("hub", u0=np.array([3.0, 0.0, 0.0, 0.0, 0.0, 0.0])),),
        effectors=(Effector("drag", drag, (("hub", "origin"),), parameters=np.array([0.5])),),
    )
    model = compile_system(system)
    times, states = run(model, METHODS["dop853"], 4.0)
    speed = model.observe(times, states)["monitors/momentum"][:, 0] / 2.0
    assert speed == pytest.approx(3.0 / (1.0 + 0.5 * 3.0 * times / 2.0), rel=1e-9)


def valve(t, sensors, memory):
    """Open."""
    return 1.0, memory


def test_a_lagging_thruster_spends_mass_and_stops_when_it_is_empty():
    """m dv = F (1 - e^(-t / T)) dt, and what is spent is the impulse over the exit speed; then thrust dies away."""
    most, lag, exit_speed = 4.0, 0.3, 50.0
    empty = StateEvent("empty", lambda t, z: z[1] if z[1] > 0.0 else 1.0, lambda t, z: np.array([z[0], -1.0]))
    jet = replace(THRUSTER, parameters=np.array([most, lag, exit_speed]), z0=np.array([0.0, 0.1]), events=(empty,))
    open_ = Controller("pilot", valve, 10.0, commands={"valve": "1"})
    centred = rigid_body(20.0, np.diag([3.0, 4.0, 5.0]), markers={"nozzle": Marker.rigid(np.zeros(3))})
    model = compile_system(System({"hub": centred}, (free("hub"),), effectors=(open_, jet)))

    def impulse(t):
        return most * (t - lag * (1.0 - np.exp(-t / lag)))

    for name in ("dop853", "esdirk4"):
        times, states = run(model, METHODS[name], 3.0, 61)
        seen = model.observe(times, states)
        burning = states[:, -1] > 0.0
        assert 0 < burning.sum() < len(times)
        spent, t = impulse(times[burning]), times[burning]
        assert states[burning, -1] == pytest.approx(0.1 - spent / exit_speed, abs=ERRORS[name])
        assert seen["monitors/momentum"][burning, 0] == pytest.approx(spent, abs=20 * ERRORS[name])
        assert seen["effectors/jet/mass_flow"][burning] == pytest.approx(
            most * (1.0 - np.exp(-t / lag)) / exit_speed, abs=ERRORS[name]
        )
        end = brentq(lambda t: impulse(t) - 0.1 * exit_speed, 0.1, 3.0)
        after = times[~burning]
        thrust = most * (1.0 - np.exp(-end / lag)) * np.exp(-(after - end) / lag)
        assert states[~burning, -2] == pytest.approx(thrust, abs=10 * ERRORS[name])


def test_the_rate_of_an_event_counts_time_and_states():
    """By the difference of a wave in time and the square of a jet's thrust."""
    due = StateEvent("due", lambda t, z: 2.0 + np.sin(3.0 * t) - 5.0 * z[0] ** 2, lambda t, z: z)
    jet = replace(THRUSTER, parameters=np.array([4.0, 0.3, 50.0]), z0=np.array([0.6, 0.1]), events=(due,))
    open_ = Controller("pilot", valve, 10.0, commands={"valve": "1"})
    centred = rigid_body(20.0, np.diag([3.0, 4.0, 5.0]), markers={"nozzle": Marker.rigid(np.zeros(3))})
    model = compile_system(System({"hub": centred}, (free("hub"),), effectors=(open_, jet)))
    x, t = model.x0.copy(), 0.2
    first = [name for name, _ in model.system.all_state_names()].index(jet.state_names()[0][0])
    z, rate = x[first], model.state_rate(t, x)[first]
    assert rate != 0.0 and z == 0.6
    assert model.events.values(t, x) == pytest.approx([2.0 + np.sin(0.6) - 5.0 * z**2])
    assert model.events.rates(t, x) == pytest.approx([3.0 * np.cos(0.6) - 10.0 * z * rate], rel=1e-6)


def tank(t, z, numbers, block):
    """A body whose moments are those of a unit mass times the dry mass and the propellant."""
    for i in range(len(block)):
        block[i] = (numbers[0] + z[2]) * numbers[1 + i]


@pytest.mark.parametrize("name", ["dop853", "esdirk4"])
def test_a_body_that_is_as_heavy_as_its_tank_is_full_obeys_tsiolkovsky(name):
    """dv = v_e ln(m_0 / m) of a craft whose mass is a state of its thruster."""
    dry, full, exit_speed = 3.0, 2.0, 25.0
    marker = {"origin": Marker.rigid(np.zeros(3)), "nozzle": Marker.rigid(np.zeros(3))}
    craft = rigid_body(dry + full, np.eye(3) * (dry + full), markers=marker)
    block = Block(craft, ("mass",))
    unit = np.zeros(block.size)
    block.put_moments(unit, rigid_body(1.0, np.eye(3)).moments)
    jet = replace(
        THRUSTER, parameters=np.array([20.0, 0.2, exit_speed]), z0=np.array([0.0, full]), inputs=("tap.open",)
    )
    tap = Effector("tap", nothing, states={"open": "1"}, z0=np.array([1.0]))
    varying = {"hub": Variation(tank, ("mass",), np.concatenate([[dry], unit]))}
    model = compile_system(System({"hub": craft}, (free("hub"),), effectors=(tap, jet), varying=varying))
    times, states = run(model, METHODS[name], 2.0, 9)
    mass = dry + states[:, -1]
    seen = model.observe(times, states)
    assert seen["bodies/hub/mass"] == pytest.approx(mass, rel=1e-14) and mass[-1] < 4.0
    speed = seen["monitors/momentum"][:, 0] / mass
    assert speed == pytest.approx(exit_speed * np.log((dry + full) / mass), abs=10 * ERRORS[name])


def nothing(seen, out):
    """Nothing: a state that stays."""


@pytest.mark.slow
def test_a_sampled_controller_of_a_double_integrator_follows_its_recursion():
    """Torque held between samples: theta and omega at the samples follow the exact discrete equations."""
    J, period, kp, kd = 5.0, 0.25, 3.0, 4.0
    calls = []

    def torque(seen, out):
        out.effort[0] = seen.input[0]

    def law(t, sensors, memory):
        calls.append(t)
        angle, rate = sensors["q"][0], sensors["u"][0]
        return -kp * angle - kd * rate, np.array([angle])

    wheel = rigid_body(1.0, np.diag([4.0, 4.0, J]))
    system = System(
        {"wheel": wheel},
        (revolute("wheel", name="axle", q0=np.array([0.3]), u0=np.array([0.1])),),
        effectors=(
            Controller("pd", law, period, ("q", "u"), {"torque": "N m"}, memory=np.array([7.0])),
            Effector("motor", torque, freedoms=("axle.angle",), inputs=("pd.torque",)),
        ),
    )
    model = compile_system(system)
    for name, method in METHODS.items():
        calls.clear()
        _, states = run(model, method, 2.0, 9)
        theta, omega = 0.3, 0.1
        for k in range(9):
            assert states[k, :2] == pytest.approx([theta, omega], abs=ERRORS[name])
            held = -kp * theta - kd * omega
            theta, omega = theta + omega * period + held / J * period**2 / 2, omega + held / J * period
        assert calls == [k * period for k in range(8)]  # exact instants
        assert states[-1, 3] == pytest.approx(states[-2, 0], abs=ERRORS[name])  # the memory


def lag_of_speed(seen, out):
    """A filter of a joint's speed whose output, through a nonlinear gain, brakes the joint."""
    out.zdot[0] = (seen.speed[0] - seen.z[0]) / seen.parameters[0]
    out.zdot[1] = seen.z[0] * seen.z[0] - 0.3 * seen.z[1]
    out.effort[0] = -2.0 * seen.z[0] - 0.5 * seen.coordinate[0] - 0.1 * seen.z[1] * seen.coordinate[0]


def exact_jacobian(seen, J):
    """Of lag_of_speed."""
    J[0, 0] = -1.0 / seen.parameters[0]
    J[1, 0], J[1, 1] = 2.0 * seen.z[0], -0.3


def filtered(lag=SLOW_LAG, jacobian=None):
    """A turning body and a sliding one, braked by filtered speeds."""
    filter_ = Effector(
        "filter", lag_of_speed, freedoms=("axle.angle",), states={"a": "rad/s", "b": "1"},
        z0=np.array([0.2, 0.1]), parameters=np.array([lag]), jacobian=jacobian,
    )  # fmt: skip
    turning = revolute("wheel", name="axle", q0=np.array([1.0]), u0=np.array([0.5]))
    return compile_system(
        System({"wheel": rigid_body(1.0, np.diag([4.0, 4.0, 1.0]))}, (turning,), effectors=(filter_,))
    )


@pytest.mark.sampled(2)
@pytest.mark.parametrize(("kind", "order"), [(Esdirk4, 4), (GeneralizedAlpha, 2)])
@pytest.mark.parametrize("jacobian", [None, exact_jacobian])
def test_implicit_methods_keep_their_order_with_states(kind, order, jacobian):
    model = filtered(jacobian=jacobian)
    exact = run(model, Dop853(rtol=1e-13, atol=1e-14), 2.0, 2)[1][-1]
    steps, errors = 0.1 / 2.0 ** np.arange(4), []
    for step in steps:
        x = run(model, kind(step=float(step), rtol=1e-10, atol=1e-11), 2.0, 2)[1][-1]
        errors.append(np.abs(x - exact)[model.n_q + model.n_u :].max())
    assert np.polyfit(np.log(steps), np.log(errors), 1)[0] == pytest.approx(order, abs=0.3)


@pytest.mark.parametrize("kind", [Esdirk4, GeneralizedAlpha])
def test_implicit_methods_step_over_fast_states(kind):
    """A lag of a microsecond takes an implicit method hardly more steps than one of a tenth of the run."""
    steps, ends = [], []
    for lag in (1e-6, 0.2):
        model = filtered(lag)
        x0 = model.x0.copy()
        x0[2] = x0[1]  # on the slow motion
        solution = kind(rtol=1e-6, atol=1e-7).solve(model, np.array([0.0, 2.0]), x0)
        steps.append(solution.steps.accepted + solution.steps.rejected)
        ends.append(solution.states[-1])
    assert steps[0] < 5 * steps[1]
    assert ends[0][2] == pytest.approx(ends[0][1], abs=1e-5)  # the filter follows


def test_an_effector_beside_a_loop_acts_as_on_the_freedom_that_is_left():
    """A bar on a hinge whose end a loop pins to the ground a second time moves as without the loop."""
    far = Marker.rigid(np.array([0.0, 0.0, 1.0]))
    bar = rigid_body(1.0, np.diag([0.1, 0.1, 0.2]), markers={"origin": Marker.rigid(np.zeros(3)), "far": far})
    hinge = revolute("bar", name="axle", q0=np.array([1.0]), u0=np.array([0.5]))
    post = weld("post", None)
    ground = rigid_body(1.0, np.diag([1.0, 1.0, 1.0]), markers={"origin": Marker.rigid(np.zeros(3)), "far": far})
    loop = spherical("bar", "post", child_marker="far", parent_marker="far", name="pin")
    filter_ = filtered().system.effectors[0]
    tree = System({"bar": bar, "post": ground}, (hinge, post), effectors=(filter_,))
    open_, tied = compile_system(tree), compile_system(replace(tree, loops=(loop,)))
    for name in ("dop853", "esdirk4", "generalized_alpha"):
        states = [run(model, METHODS[name], 0.5, 3)[1] for model in (open_, tied)]
        assert states[1] == pytest.approx(states[0], abs=ERRORS[name])


def test_loops_close_alike_with_and_without_states_of_effectors():
    """The search for a closed start moves (q, u) and hands z on; a state without its z is refused, not read past."""
    bars = four_bar()
    filter_ = replace(filtered().system.effectors[0], freedoms=("drive.angle",))
    alone, model = compile_system(bars), compile_system(replace(bars, effectors=(filter_,)))
    assert model.x0[: alone.n_x] == pytest.approx(alone.x0, abs=1e-12)
    assert np.array_equal(model.x0[alone.n_x :], [0.2, 0.1])
    for call in (model.constraints.residuals, model.state_rate, model.bias):
        with pytest.raises(ValueError, match=r"has \d+ numbers \(q, u, z\); found \d+"):
            call(0.0, model.x0[:-2])


def test_a_linear_law_through_the_socket_is_the_spring_of_the_joint():
    linear = compile_system(craft((replace(SPRING, act=linear_spring),)))
    system = craft(())
    hinge = replace(system.joints[1], stiffness=np.array([20.0]))
    other = compile_system(replace(system, joints=(system.joints[0], hinge)))
    x = other.x0
    assert linear.state_rate(0.0, x) == pytest.approx(other.state_rate(0.0, x), abs=1e-12)
    energies = [m.observe(np.zeros(1), x[None])["monitors/energy"][0] for m in (linear, other)]
    assert energies[0] == pytest.approx(energies[1], rel=1e-13)


def test_linear_equations_hold_the_states_of_effectors():
    """(s^2 + 1/2)(1 + s T) + 2 s = 0 of the filtered brake, and -0.3 of the state beside it."""
    model = filtered()
    x = np.zeros(model.n_x)
    found = linearised(model, 0.0, x)
    assert found.states.names == ("filter.a", "filter.b")
    expected = np.append(np.roots([SLOW_LAG, 1.0, 0.5 * SLOW_LAG + 2.0, 0.5]), -0.3)
    assert np.sort_complex(found.eigenvalues()) == pytest.approx(np.sort_complex(expected), abs=1e-8)


def integral_push(seen, out):
    """Torque 1 - 2 z with z that follows the angle."""
    out.effort[0], out.zdot[0] = 1.0 - 2.0 * seen.z[0], (seen.coordinate[0] - seen.z[0]) / 0.2


def test_an_equilibrium_takes_states_along():
    """k q = 1 - 2 z with z = q; one whose state never rests, and a controller, are refused."""
    push = Effector("push", integral_push, freedoms=("axle.angle",), states={"a": "rad"})
    hinge = revolute("wheel", name="axle", stiffness=np.array([3.0]), damping=np.array([0.4]))
    system = System({"wheel": rigid_body(1.0, np.diag([4.0, 4.0, 1.0]))}, (hinge,), effectors=(push,))
    found = equilibrium(system)
    assert found.x == pytest.approx([0.2, 0.0, 0.2], abs=1e-9)
    assert found.stable
    expected = np.roots([0.2, 1.0 + 0.2 * 0.4, 0.4 + 0.2 * 3.0, 3.0 + 2.0])  # (s^2 + 0.4 s + 3)(1 + 0.2 s) + 2
    assert np.sort_complex(found.eigenvalues) == pytest.approx(np.sort_complex(expected), abs=1e-7)
    with pytest.raises(ValueError, match=r"the state 'push.a' keeps changing at rest"):
        equilibrium(replace(system, effectors=(replace(push, act=ramp),)))
    with pytest.raises(ValueError, match="controller 'pilot' is sampled"):
        equilibrium(replace(system, effectors=(push, replace(PILOT, sensors=()))))


def ramp(seen, out):
    """A state that grows for ever."""
    out.zdot[0] = 1.0


def linear_spring(seen, out):
    """Torque -k q."""
    out.effort[0] = -seen.parameters[0] * seen.coordinate[0]
    out.energy[0] = 0.5 * seen.parameters[0] * seen.coordinate[0] ** 2


@pytest.mark.slow
def test_in_orbit_places_and_velocities_count_from_the_centre_of_mass():
    boom, _ = random_body(np.random.default_rng(3), 2)
    system = System(
        {"hub": hub(), "boom": boom},
        (spherical("hub", u0=np.array([0.1, 0.02, 0.03])), revolute("boom", "hub", child_marker="b", name="hinge")),
        orbit=Orbit(7e6), frame=Frame("orbital"), effectors=(OUTPUT, replace(DRAG, name="air", act=places)),
    )  # fmt: skip
    model = compile_system(system)
    seen = model.observe(np.zeros(1), model.x0[None])
    assert seen["effectors/air/torque"] == pytest.approx(seen["markers/boom.a/position"], abs=1e-12)
    assert seen["effectors/air/force"] == pytest.approx(seen["markers/boom.a/velocity"], abs=1e-12)
    assert seen["orbit/force"] == pytest.approx(-seen["effectors/air/force"], abs=1e-12)


def places(seen, out):
    """What a marker's motion is seen as, reported as force and torque."""
    out.force[0, :] = seen.velocity[0]
    out.torque[0, :] = seen.position[0]


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"markers": (("hub", "nose"),)}, "marker 'nose' of effector 'jet' is not on body 'hub'"),
        ({"markers": (("hull", "origin"),)}, "body 'hull' of effector 'jet' does not exist"),
        (
            {"inputs": ("pilot.valv",)},
            "input 'pilot.valv' of effector 'jet' is neither a state nor a channel; did you mean 'pilot.valve'",
        ),
        (
            {"freedoms": ("hinge.angel",)},
            "'hinge.angel' of effector 'jet' is not a slide or turn of a joint; did you mean 'hinge.angle'",
        ),
        ({"z0": np.ones(3)}, "z0 of effector 'jet'.*expected 2 finite numbers"),
        ({"accounts": ("heat",)}, "accounts for 'heat'; known are"),
        ({"channels": {"thrust": "N"}}, "effector 'jet' has two outputs named 'thrust'"),
    ],
)
def test_bad_effectors_are_refused(change, said):
    with pytest.raises(ValueError, match=said):
        craft((PILOT, replace(THRUSTER, **change)))


def test_a_sensor_that_is_no_channel_and_an_answer_that_is_none_are_refused():
    with pytest.raises(ValueError, match=r"sensor 'bodies/hub/rates' .* did you mean 'bodies/hub/rate'"):
        compile_system(craft((replace(PILOT, sensors=("bodies/hub/rates",)), THRUSTER)))
    for answer, said in ((1.0, "expected .command, memory."), ((np.nan, [0.0]), "is not finite"), ((1.0, []), "shape")):
        model = compile_system(craft((replace(PILOT, law=lambda t, s, m, a=answer: a), THRUSTER)))
        with pytest.raises(ValueError, match=said):
            run(model, METHODS["dop853"], 0.1, 2)


@pytest.mark.skipif(bool(numba.config.DISABLE_JIT), reason="the compiler is off")
def test_a_function_that_cannot_be_compiled_is_refused():
    def act(seen, out):
        out.force[0] = open("file").read()

    with pytest.raises(ValueError, match="the function of effector 'drag' cannot be compiled"):
        compile_system(craft((replace(DRAG, act=act),)))


@pytest.mark.skipif(bool(numba.config.DISABLE_JIT), reason="the compiler is off")
def test_an_effector_compiles_nothing_anew():
    """Kernels are those of every other model: only the effector's own function is compiled."""
    assert len(led_rate.signatures) == 1 and os.path.isabs(led_rate.stats.cache_path)


def of_the_case():
    """Effectors for the craft of a case file, made anew."""
    return (
        PILOT,
        replace(DRAG, markers=(("boom", "tip"),)),
        replace(THRUSTER, markers=(("hub", "left"),)),
        replace(OUTPUT, markers=(("hub", "left"), ("boom", "tip"))),
    )


@pytest.mark.slow
def test_a_run_of_a_case_is_written_and_resumed_bit_for_bit(write_case, femflex, tmp_path):
    """The file holds states, channels and the period; the same effectors resume it, the command line does not."""
    case = write_case()
    whole = run_case(case, tmp_path / "whole.h5", effectors=of_the_case())
    assert whole.names("z") == ("pilot.valve", "pilot.memory1", "pilot.next", "jet.thrust", "jet.propellant")
    assert whole["z"].shape == (201, 5)
    assert np.array_equal(whole["effectors/jet/thrust"], whole["z"][:, 3])
    assert whole["effectors/span/distance"] == pytest.approx(3.0, abs=0.1)
    assert whole["effectors/drag/force"].shape == (201, 3) and whole["effectors/drag/dissipation"].max() > 0.0
    assert whole.attributes["effectors"] == "pilot, drag, jet, span"
    assert whole.attributes["sampled"] == "Controller pilot is called every 0.1 s, its command constant between."
    assert (
        whole["effectors/pilot/memory1"][-1] == 100.0
    )  # calls at 0, 0.1, ..., 9.9 s; that at 10 s comes after the row

    def stop(t):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run_case(case, tmp_path / "part.h5", effectors=of_the_case(), progress=stop)
    code, _, said = femflex("run", case, "-o", tmp_path / "part.h5", "--resume")
    assert code == 2
    assert "was begun with the effectors pilot, drag, jet, span from Python, and now there are none" in said.replace(
        "\n", " "
    )
    rest = run_case(case, tmp_path / "part.h5", effectors=of_the_case(), resume=True)
    for path in ("q", "u", "z", "monitors/energy", "effectors/jet/power"):
        assert np.array_equal(rest[path], whole[path]), path
    with pytest.raises(ValueError, match="was made with effectors from Python"):
        rebuilt(whole)
    less = run_case(case, tmp_path / "less.h5", effectors=of_the_case(), without=["drag"])
    assert "effectors/drag/force" not in less and less.without == ("effectors/drag",)
