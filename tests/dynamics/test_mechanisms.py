"""Constrained motion against closed forms, published numbers and invariants; contradictions and tolerances."""

from dataclasses import replace

import numpy as np
import pytest
from support.mechanisms import ANDREWS, andrews, bar, flexible_four_bar, four_bar, leaning_disc, planar, sleigh

from femflex.body import Marker, rigid_body
from femflex.dynamics import compile_system
from femflex.dynamics.constraints.initial_corrections import absorbed_misfits
from femflex.integrate import Dop853, Esdirk4, IntegrationError, integrator
from femflex.system import Load, Profile, System, free, revolute, velocity_rows, weld


def run(system, times, **settings):
    model = compile_system(system)
    states = Dop853(**settings).solve(model, times, model.x0).states
    return model, states, model.observe(times, states)


def test_andrews_squeezer_matches_test_set():
    model, states, out = run(andrews(), np.linspace(0, 0.03, 31), rtol=1e-11, atol=1e-12)
    found = dict(zip([b for b in model.system.order if b != "ground"], states[-1], strict=False))
    assert found == pytest.approx(ANDREWS, abs=1e-8)
    assert model.constraints.n_rows == 15
    assert model.constraints.redundant(0.0, model.x0) == 9  # per loop: one slide and two turns out of the plane
    work = 33e-3 * (states[:, 0] - states[0, 0])
    energy = out["monitors/energy"] - out["monitors/energy"][0]
    assert energy == pytest.approx(work, abs=1e-9 * np.abs(work).max())


@pytest.mark.slow
def test_four_bar_conserves_energy_for_1000_seconds():
    model, _, out = run(four_bar(), np.linspace(0, 1000, 2001))
    assert model.constraints.redundant(0.0, model.x0) == 3
    assert out["monitors/constraint_position"].max() < 1e-11
    assert out["monitors/constraint_velocity"].max() < 1e-11
    energy = out["monitors/energy"]
    assert np.ptp(energy) < 1e-6 * energy[0]


def test_dop853_has_order_eight_with_constraints():
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


def test_chaplygin_sleigh_matches_closed_form():
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


def test_user_rows_equal_knife_edge():
    def sideways_row(t, q):
        A = np.zeros((1, 6))
        A[0, :2] = -np.sin(q[5]), np.cos(q[5])
        return A, np.zeros(1)

    times = np.linspace(0, 1, 5)
    _, ours, _ = run(sleigh(1.7, constraint=velocity_rows("blade", 1, sideways_row)), times)
    _, theirs, _ = run(sleigh(1.7), times)
    assert ours == pytest.approx(theirs, abs=1e-8)


def test_user_rows_with_time_dependent_right_side():
    body = planar(2.0, 0.3, (0.2, 0))
    driven = velocity_rows("motor", 1, lambda t, q: (np.ones((1, 1)), np.array([np.sin(3 * t)])))
    times = np.linspace(0, 2, 9)
    system = System({"arm": body}, (revolute("arm"),), constraints=(driven,))
    _, states, out = run(system, times, rtol=1e-12, atol=1e-13)
    assert states[:, 0] == pytest.approx((1 - np.cos(3 * times)) / 3, abs=1e-10)
    torque = (0.3 + 2 * 0.2**2) * 3 * np.cos(3 * times)
    assert out["constraints/motor/multipliers"][:, 0] == pytest.approx(torque, abs=1e-8)


@pytest.mark.parametrize("speed", [1.6, 3.0])  # v^2 > g R / 3 = 1.635 m^2/s^2
def test_rolling_disc_lean_frequency(speed):
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


def test_rolling_disc_conserves_energy():
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


def test_loop_reaction_of_pendulum():
    anchor = rigid_body(1.0, np.eye(3), markers={"nail": Marker.at_position([0, 0, 2.0])})
    weight = Load("weight", "rod", "middle", "inertial", force=[0, -9.81, 0])
    rod = bar(1.0)
    rod.markers["middle"] = Marker.at_position([0.5, 0, 0])
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


def test_start_is_nearest_closed_state_in_mass_norm():
    system = four_bar()
    model, given = compile_system(system), system.initial_state()
    A, M = model.constraints.matrix(0.0, model.x0), model.mass_matrix(0.0, model.x0)
    along = np.linalg.svd(A)[2][-1]  # the one direction in which the mechanism moves
    assert along @ M @ (model.x0 - given)[:3] == pytest.approx(0.0, abs=1e-10)
    assert along @ M @ (model.x0 - given)[3:] == pytest.approx(0.0, abs=1e-10)


@pytest.mark.slow
def test_rolling_disc_stability_at_critical_speed():
    radius, g, lean = 0.5, 9.81, 1e-6
    critical = np.sqrt(g * radius / 3)
    for factor, stays in ((1.02, True), (0.98, False)):
        system = leaning_disc(lean, factor * critical / radius, radius, gravity=g)
        _, _, out = run(system, np.linspace(0, 10, 201), rtol=1e-12, atol=1e-16)
        e = out["bodies/disc/attitude"]
        largest = np.abs(np.arcsin(1 - 2 * (e[:, 1] ** 2 + e[:, 2] ** 2))).max()
        assert (largest < 100 * lean) == stays


METHODS = [(Esdirk4, 4)]


@pytest.mark.parametrize(("method", "order"), METHODS)
@pytest.mark.parametrize("system", [four_bar(speed=3.0), sleigh(1.7)], ids=["four_bar", "sleigh"])
def test_implicit_order_with_constraints(method, order, system):
    end, times = 1.0, np.array([0.0, 1.0])
    model = compile_system(system)
    exact = Dop853(rtol=1e-13, atol=1e-14).solve(model, times, model.x0).states[-1]
    counts, errors = np.array([40, 80, 160]) * (4 // order) ** 2, []
    for n in counts:
        states = method(step=end / n, rtol=1e-12, atol=1e-13).solve(model, times, model.x0).states
        errors.append(np.linalg.norm(states[-1] - exact))
    assert -np.polyfit(np.log(counts), np.log(errors), 1)[0] == pytest.approx(order, abs=0.2)


@pytest.mark.sampled(1)
@pytest.mark.parametrize(("method", "order"), METHODS)
def test_implicit_methods_agree_on_flexible_four_bar(method, order):
    model = compile_system(flexible_four_bar())
    times = np.linspace(0, 0.5, 26)
    exact = Dop853().solve(model, times, model.x0).states
    solution = method(rtol=1e-7, atol=1e-8).solve(model, times, model.x0)
    out = model.observe(times, solution.states)
    assert out["monitors/constraint_position"].max() < 1e-11
    assert out["monitors/constraint_velocity"].max() < 1e-11
    assert solution.states[:, :3] == pytest.approx(exact[:, :3], abs=1e-4)


METHODS_OF_CONTRADICTIONS = [Dop853(), Esdirk4()]
TIMES = np.linspace(0.0, 1.0, 101)
CRANK, ROCKER = 0.4, 1.4041275600910723  # of a closed configuration
COUPLER = 0.11706522114482643


def driven(crank=None, rocker=None, start=(CRANK, COUPLER, ROCKER)):
    """A four-bar whose crank and rocker may follow motions."""
    system = four_bar(speed=0.0, start=start)
    motions = {"drive": crank, "rocker": rocker}
    joints = [
        replace(joint, motion=(motion,), q0=np.zeros(0), u0=np.zeros(0))
        if (motion := motions.get(joint.name or joint.child)) is not None
        else joint
        for joint in system.joints
    ]
    return replace(system, joints=tuple(joints))


def stopped(system, method, times=TIMES):
    """The model, and the error with which a run of it ends."""
    model = compile_system(system)
    with pytest.raises(IntegrationError) as caught:
        method.solve(model, times, model.x0)
    return model, caught.value


@pytest.mark.parametrize("method", METHODS_OF_CONTRADICTIONS, ids=lambda method: method.name)
def test_contradicting_motions_stop_the_run_at_their_instant(method):
    system = driven(Profile.smooth_step(0.5, 1.0, CRANK, 1.4), Profile.constant(ROCKER))
    model, error = stopped(system, method)
    for said in ("loop 'closure' cannot be satisfied", "'drive.angle', 'ground-rocker.angle'", "above the limit of"):
        assert said in str(error)
    assert 0.5 <= error.t < 0.51
    seen = model.observe(error.times, error.states)
    assert len(error.times) >= 51  # everything before is kept
    assert seen["monitors/constraint_position"].max() < 2e-10
    assert seen["monitors/constraint_velocity"].max() < 2e-10


@pytest.mark.sampled(2)
@pytest.mark.parametrize(
    "masses", [(1e4, 1.0, 1e-6), (1e6, 1e-6, 1.0), (1e-12, 1.0, 1.0), (1e-3, 1.0, 1e6), (1e4, 1.0, 1e-9)]
)
def test_four_bar_with_extreme_mass_ratios(masses):
    bodies = {"ground": rigid_body(1.0, np.eye(3), markers={"pivot": Marker.at_position([2, 0, 0])})}
    for name, a, m in zip(("crank", "coupler", "rocker"), (0.5, 2, 1.2), masses, strict=True):
        bodies[name] = planar(m, m * a**2 / 12, (a / 2, 0), end=(a, 0))
    joints = (
        weld("ground"),
        revolute("crank", "ground", q0=[CRANK], u0=[3.0]),
        revolute("coupler", "crank", parent_marker="end", q0=[0.2]),  # open: 0.12 off
        revolute("rocker", "ground", parent_marker="pivot", q0=[1.4]),
    )
    loop = revolute("rocker", "coupler", parent_marker="end", child_marker="end", name="closure")
    model = compile_system(System(bodies, joints, loops=(loop,)))
    seen = model.observe(TIMES, Dop853().solve(model, TIMES, model.x0).states)
    energy = seen["monitors/energy"]
    assert seen["monitors/constraint_position"].max() < 1e-10
    assert set(seen["monitors/constraint_rank"]) == {2.0}
    assert np.ptp(energy) < 1e-9 * energy[0]


TIMES_OF_LOOP_TOLERANCE = np.linspace(0.0, 10.0, 201)
THIRD = 1.0 / 3.0


def three_cranks(length=THIRD, play=0.0, start=0.4, speed=2.0, **more):
    """A parallelogram with a third crank in between, of that length: exactly a third, it moves as one of two does."""
    base, crank = [0.0, 0.25, 1.0], [THIRD, length, THIRD]
    marks = {f"p{k}": Marker.at_position([x, 0, 0]) for k, x in enumerate(base)}
    coupler = rigid_body(1.0, np.diag([1e-3, 0.1, 0.1]), [0.5, 0, 0], marks)
    bodies = {"ground": rigid_body(1.0, np.eye(3), markers=marks), "coupler": coupler}
    bodies |= {f"crank{k}": bar(crank[k], 0.5) for k in range(3)}
    joints = [weld("ground"), revolute("coupler", "crank0", parent_marker="end", q0=[-start], u0=[-speed])]
    joints += [revolute(f"crank{k}", "ground", parent_marker=f"p{k}", q0=[start], u0=[speed]) for k in range(3)]
    loops = [
        revolute(f"crank{k}", "coupler", parent_marker=f"p{k}", child_marker="end", name=f"pin{k}") for k in (1, 2)
    ]
    loops = tuple(replace(loop, play=play) for loop in loops)
    return System(bodies, tuple(joints), loops=loops, **more)


def simulated(system, times=TIMES_OF_LOOP_TOLERANCE):
    model = compile_system(system)
    solution = integrator("dop853", rtol=1e-10).solve(model, times, model.x0)
    return model, model.observe(solution.times, solution.states)


@pytest.mark.parametrize(("length", "play"), [(0.333333, 3e-6), (0.33333333, 1e-7)])
def test_overconstrained_linkage_with_tolerance(length, play):
    with pytest.raises(ValueError, match=r"loop 'pin\d' cannot .* (or give the loop|to its) `play`"):
        compile_system(three_cranks(length))
    _, exact = simulated(three_cranks())
    model, near = simulated(three_cranks(length, play=play))
    assert np.abs(exact["q"]).max() > 20.0  # rad: over three turns, through six flat configurations
    misfit = THIRD - length
    # near a flat configuration the state moves by the misfit over the pivot, left out below some 10 sqrt(play)
    assert near["q"] == pytest.approx(exact["q"], abs=misfit / (3 * play**0.5))
    assert np.ptp(near["monitors/energy"]) < (0.1 * misfit + 1e-9) * near["monitors/energy"][0]
    gap = near["monitors/constraint_position"]
    assert 0.1 * misfit < gap.max() < play and gap[0] < 1e-12
    assert set(near["monitors/constraint_rank"][[0, -1]]) == set(exact["monitors/constraint_rank"][[0, -1]])
    misfits = absorbed_misfits(model.constraints)
    assert 0.1 * misfit < max(absorbed.displacement for absorbed in misfits) <= misfit


RATE = 3.0


def parallelogram(start=1.0):
    """Two bars of 0.5 m turning alike under a coupler as long as their base."""
    system = four_bar(crank=0.5, coupler=2.0, rocker=0.5, base=2.0, start=(start, -start, start))
    rates = {"crank": RATE, "coupler": -RATE, "rocker": RATE}
    return replace(
        system,
        joints=tuple(j if j.child == "ground" else j.with_initial(u0=[rates[j.child]]) for j in system.joints),
    )


@pytest.mark.parametrize("start", [1.0, 0.0], ids=["before", "in it"])
@pytest.mark.parametrize("method", [Dop853(), Esdirk4()], ids=lambda method: method.name)
def test_parallelogram_passes_singular_configurations(method, start):
    model = compile_system(parallelogram(start))
    times = np.linspace(0.0, 20.0, 401)
    solution = method.solve(model, times, model.x0)
    seen = model.observe(times, solution.states)
    q = seen["q"]
    assert q[:, 0] == pytest.approx(start + RATE * times, abs=1e-6)
    assert np.abs(q[:, 0] - q[:, 1]).max() < 1e-9  # the same branch throughout
    assert np.ptp(seen["monitors/energy"]) < 1e-8 * seen["monitors/energy"][0]
    assert seen["monitors/constraint_position"].max() < 1e-10
    assert solution.steps.accepted < 10_000
