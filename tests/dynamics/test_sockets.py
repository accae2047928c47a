"""The sockets of forces and effectors, used from this file alone: nothing of femflex knows what is added here.

A force at a marker, an effector with states that spends mass, a law of a joint, an output, a sampled controller: each
stands in channels, ledger and balance of energies, can be switched off, and works with every integrator.
"""

import math
from dataclasses import replace

import numpy as np
import pytest
from support.random_systems import random_body
from support.scipy_integrators import integrator

from femflex import run as run_case
from femflex.body import Marker
from femflex.body.flexible import rigid_body
from femflex.dynamics import compile_system
from femflex.integrate import Dop853, Esdirk4, IntegrationError
from femflex.linear.equations import linearised
from femflex.linear.equilibrium import equilibrium
from femflex.pipeline import rebuilt
from femflex.system import (
    Block,
    Controller,
    Effector,
    System,
    Variation,
    free,
    revolute,
)

METHODS = {
    "dop853": Dop853(rtol=1e-10, atol=1e-11),
    "esdirk4": Esdirk4(rtol=1e-8, atol=1e-9),
    "scipy_radau": integrator("scipy_radau", rtol=1e-8, atol=1e-9),
}
ERRORS = {"dop853": 1e-8, "esdirk4": 3e-6, "scipy_radau": 1e-5}  # three times what is seen
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
    place = Marker.at_position(np.array([-0.2, 0.1, 0.0]))
    return rigid_body(
        mass, np.diag([3.0, 4.0, 5.0]), markers={"origin": Marker.at_position(np.zeros(3)), "nozzle": place}
    )


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


@pytest.mark.parametrize("name", METHODS)
def test_every_integrator_gives_the_same_motion(model, fine, name):
    _, states = run(model, METHODS[name])
    assert np.abs(states - fine).max() < ERRORS[name]


def test_energy_balance_with_effectors(model):
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
            told = near.get(f"effectors/{name}/supplied", 0.0) - near.get(f"effectors/{name}/dissipation", np.zeros(3))
            assert near[f"effectors/{name}/power"] == pytest.approx(told, abs=1e-12)
        assert near["monitors/effector"] == pytest.approx(near["effectors/cubic/energy"])
    seen = model.observe(np.linspace(0, 1, 41), states)
    assert seen["effectors/jet/thrust"].max() > 1.0 and seen["effectors/drag/dissipation"].max() > 1e-3


def test_ledger_rows_of_effectors_sum_to_zero(model, fine):
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


@pytest.mark.parametrize("name", ["dop853", "esdirk4"])
def test_resumed_run_with_effectors_is_exact(model, name):
    """From blocks that end between two samples, and at one, with a model compiled anew."""
    times, method = np.linspace(0.0, 1.0, 3500), METHODS[name]
    whole = method.solve(model, times, model.x0).states
    blocks = list(method.blocks(model, times, model.x0))
    assert np.array_equal(np.vstack([block.states for block in blocks]), whole)
    again = compile_system(craft())
    for done in range(1, len(blocks)):
        rest = method.solve(again, times, again.x0, state=blocks[done - 1].resume)
        count = sum(len(block.times) for block in blocks[:done])
        assert np.array_equal(rest.states, whole[count:])


def test_drag_matches_closed_form():
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


def tank(t, z, numbers, block):
    """A body whose moments are those of a unit mass times the dry mass and the propellant."""
    for i in range(len(block)):
        block[i] = (numbers[0] + z[2]) * numbers[1 + i]


@pytest.mark.parametrize("name", ["dop853", "esdirk4"])
def test_varying_mass_by_state_matches_tsiolkovsky(name):
    """dv = v_e ln(m_0 / m) of a craft whose mass is a state of its thruster."""
    dry, full, exit_speed = 3.0, 2.0, 25.0
    marker = {"origin": Marker.at_position(np.zeros(3)), "nozzle": Marker.at_position(np.zeros(3))}
    craft = rigid_body(dry + full, np.eye(3) * (dry + full), markers=marker)
    block = Block(craft, ("mass",))
    unit = np.zeros(block.size)
    block.put_moments(unit, rigid_body(1.0, np.eye(3)).moments)
    jet = replace(
        THRUSTER, parameters=np.array([20.0, 0.2, exit_speed]), z0=np.array([0.0, full]), inputs=("tap.open",)
    )
    tap = Effector("tap", write_nothing, states={"open": "1"}, z0=np.array([1.0]))
    varying = {"hub": Variation(tank, ("mass",), np.concatenate([[dry], unit]))}
    model = compile_system(System({"hub": craft}, (free("hub"),), effectors=(tap, jet), varying=varying))
    times, states = run(model, METHODS[name], 2.0, 9)
    mass = dry + states[:, -1]
    seen = model.observe(times, states)
    assert seen["bodies/hub/mass"] == pytest.approx(mass, rel=1e-14) and mass[-1] < 4.0
    speed = seen["monitors/momentum"][:, 0] / mass
    assert speed == pytest.approx(exit_speed * np.log((dry + full) / mass), abs=10 * ERRORS[name])


def write_nothing(seen, out):
    """Nothing: a state that stays."""


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
@pytest.mark.parametrize(("kind", "order"), [(Esdirk4, 4)])
@pytest.mark.parametrize("jacobian", [None, exact_jacobian])
def test_implicit_order_with_effector_states(kind, order, jacobian):
    model = filtered(jacobian=jacobian)
    exact = run(model, Dop853(rtol=1e-13, atol=1e-14), 2.0, 2)[1][-1]
    steps, errors = 0.1 / 2.0 ** np.arange(4), []
    for step in steps:
        x = run(model, kind(step=float(step), rtol=1e-10, atol=1e-11), 2.0, 2)[1][-1]
        errors.append(np.abs(x - exact)[model.n_q + model.n_u :].max())
    assert np.polyfit(np.log(steps), np.log(errors), 1)[0] == pytest.approx(order, abs=0.3)


@pytest.mark.parametrize("kind", [Esdirk4])
def test_implicit_steps_over_fast_states(kind):
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


def test_linear_equations_with_effector_states():
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


def test_equilibrium_with_effector_states():
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


def of_the_case():
    """Effectors for the craft of a case file, made anew."""
    return (
        PILOT,
        replace(DRAG, markers=(("boom", "tip"),)),
        replace(THRUSTER, markers=(("hub", "left"),)),
        replace(OUTPUT, markers=(("hub", "left"), ("boom", "tip"))),
    )


def raises(seen, out):
    if seen.time > 0.5:
        raise ValueError("mine")


def not_a_number(seen, out):
    out.zdot[0] = math.nan if seen.position[0, 0] > 1.5 else 0.0


def outside(seen, out):
    out.force[1, 0] = 1.0  # the second of one marker


@pytest.mark.parametrize("method", [Dop853(), Esdirk4()])
@pytest.mark.parametrize(("act", "words"), [(raises, "raised ValueError: mine"), (not_a_number, "not finite")])
def test_function_that_fails_stops_the_run_at_its_time(method, act, words):
    """At 3 m/s both fail at 0.5 s."""
    faulty = Effector("b", act, (("hub", "origin"),), states={"z": "1"})
    start = free("hub", u0=[3.0, 0, 0, 0, 0, 0])
    model = compile_system(System({"hub": hub()}, (start,), effectors=(faulty,)))
    with pytest.raises(IntegrationError, match=f"effector 'b' .*{words}") as failed:
        run(model, method)
    assert failed.value.t == pytest.approx(0.5, abs=1e-5)


def test_index_outside_the_arrays_is_refused_before_a_run():
    body, start = rigid_body(1.0, np.eye(3)), (free("hub"),)
    with pytest.raises(ValueError, match=r"effector 'b' .*index 1 .*markers"):
        compile_system(System({"hub": body}, start, effectors=(Effector("b", outside, (("hub", "origin"),)),)))
    size = Block(body, ("mass",)).size

    def write(t, z, numbers, block):
        block[size] = 1.0

    with pytest.raises(ValueError, match=r"body 'hub' .*index"):
        compile_system(System({"hub": body}, start, varying={"hub": Variation(write, ("mass",))}))


@pytest.mark.slow
def test_run_of_case_with_effectors_resumes_exactly(write_case, femflex, tmp_path):
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
