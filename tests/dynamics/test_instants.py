"""What happens at one instant: latches on their way, calls of sampled controllers, power of loads; all by hand."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from support.random_systems import random_tree
from test_loads import load_power

from femflex.body import rigid_body
from femflex.dynamics import compile_system
from femflex.dynamics.reports import diagnosis
from femflex.system import (
    Controller,
    Frame,
    Friction,
    Joint,
    Latch,
    Load,
    Orbit,
    Stop,
    System,
    Threshold,
    free,
    prismatic,
    revolute,
    spherical,
    turns,
    universal,
)

BODY = rigid_body(2.0, [1.0, 2.0, 2.5])


def latched() -> System:
    """Six latches: reached from below and from above, opened by time and by two thresholds, and an elastic one."""
    above, below = Threshold("monitors/kinetic", above=9.0), Threshold("monitors/kinetic", below=4.0)
    joints = (
        Joint("a", translations=np.eye(3), q0=[0.1, 0.9, 0.0], name="slides",
              latches=(Latch(1, at=0.4), Latch(0, at=0.7), Latch(2, at=0.0, opens=3.0))),
        universal("b", "a", name="cross", q0=[0.2, -0.3],
                  latches=(Latch(0, at=0.2, opens=above), Latch(1, at=-0.9, stiffness=30.0))),
        revolute("c", name="hinge", q0=[0.5], latches=(Latch(0, at=0.5, opens=below),)),
    )  # fmt: skip
    return System({"c": BODY, "a": BODY, "b": BODY}, joints)


def named(model) -> list[str]:
    return [name for name, _ in model.system.all_state_names()]


def test_every_latch_says_how_far_and_how_fast_it_has_to_go():
    model = compile_system(latched())
    names, x = named(model), model.x0.copy()
    speeds = {"slides.slide1_rate": 0.3, "slides.slide2_rate": -0.6, "cross.angle2_rate": 0.25}
    for name, value in speeds.items():
        x[names.index(name)] = value
    x[names.index("slides.slide2")] = 0.65
    kinetic = float(model.observe(np.zeros(1), x[None])["monitors/kinetic"][0])
    places = [(place.latch.freedom, names[model.n_q + place.freedom]) for place in model.events.places]
    wanted = {  # how far, how fast
        "slides.slide2_rate": (0.65 - 0.4, -0.6),
        "slides.slide1_rate": (0.7 - 0.1, -0.3),
        "slides.slide3_rate": (3.0 - 1.25, -1.0),
        "cross.angle1_rate": (9.0 - kinetic, 0.0),
        "cross.angle2_rate": (-0.3 + 0.9, 0.25),
        "hinge.angle_rate": (kinetic - 4.0, 0.0),
    }
    assert sorted(name for _, name in places) == sorted(wanted)
    assert model.events.values(1.25, x) == pytest.approx([wanted[name][0] for _, name in places])
    assert model.events.rates(1.25, x) == pytest.approx([wanted[name][1] for _, name in places], abs=1e-6)


def test_the_rate_of_a_threshold_is_that_of_its_channel_along_the_motion():
    pull = Load("pull", "c", frame="inertial", force=[0.0, 0.0, 3.0])
    latch = Latch(0, at=0.5, opens=Threshold("monitors/kinetic", 8.0))
    joints = (prismatic("c", axis=(0, 0, 1), u0=[1.5]), revolute("b", q0=[0.5], latches=(latch,)))
    model = compile_system(System({"c": BODY, "b": BODY}, joints, loads=(pull,)))
    assert model.events.values(0.0, model.x0) == pytest.approx([8.0 - 1.5**2])
    assert model.events.rates(0.0, model.x0) == pytest.approx([-3.0 * 1.5], rel=1e-6)


def test_latches_that_are_done_have_nothing_to_go():
    model = compile_system(latched())
    names, x = named(model), model.x0.copy()
    closed = ("slides.slide2_rate", "cross.angle2_rate")
    opened = ("slides.slide3_rate", "cross.angle1_rate")
    of = {names[model.n_q + place.freedom]: (k, place) for k, place in enumerate(model.events.places)}
    x[model.n_q : model.n_q + model.n_u] = 0.1
    for name in closed:
        x[of[name][1].time] = 0.8
    model.events.happen([of[name][0] for name in opened], 2.0, x)
    for name in (*closed, *opened):
        assert model.events.values(1.0, x)[of[name][0]] == 1.0
        assert model.events.rates(1.0, x)[of[name][0]] == 0.0
    for name in opened:  # they go on free from then on
        assert x[of[name][1].time] < 0.0 and x[model.n_q + of[name][1].freedom] == 0.1
    y = x.copy()
    model.events.happen([of["slides.slide1_rate"][0]], 2.5, y)
    assert y[of["slides.slide1_rate"][1].time] == 2.5 and y[names.index("slides.slide1")] == 0.7
    # one body of 2 kg hangs on the slide with another on it; nothing but slide 1 moves along x
    lost = y[of["slides.slide1_rate"][1].time + 1]
    before, after = (float(model.observe(np.zeros(1), one[None])["monitors/kinetic"][0]) for one in (x, y))
    assert lost == pytest.approx(before - after) and lost > 0.0


def test_controllers_that_are_due_see_the_commands_of_those_before_them():
    """`late` reads the command of `early`; both are due at 1.2 s; `slow` is not."""
    calls = []

    def early(t, seen, memory):
        calls.append(("early", t, seen["q"].copy(), memory.copy()))
        return [10.0 + t, -3.0], [memory[0] + 1.0, memory[1] + 2.0]

    def late(t, seen, memory):
        calls.append(("late", t, float(seen["effectors/early/b"]), memory.copy()))
        return 7.0, [5.0], t + 0.125

    def slow(t, seen, memory):
        raise AssertionError("not due")

    controllers = (
        Controller("late", late, 0.5, ("effectors/early/b",), {"x": "N"}, memory=[4.0], held=[0.5], start=0.2),
        Controller("slow", slow, 0.7, (), {"y": "N", "z": "N"}, start=0.6),
        Controller("early", early, 0.4, ("q",), {"a": "N", "b": "N"}, memory=[0.25, 0.75], held=[1.0, 2.0]),
    )
    joint = revolute("body", name="axle", q0=[0.3])
    model = compile_system(System({"body": BODY}, (joint,), effectors=controllers))
    names, x = named(model), model.x0.copy()
    assert model.clock.next(x) == 0.0
    for name, value in (("late.next", 1.2), ("slow.next", 1.3), ("early.next", 1.2)):
        x[names.index(name)] = value
    assert model.clock.next(x) == 1.2
    before = dict(zip(names, x, strict=True))
    model.clock.strike(1.2, x)
    after = dict(zip(names, x, strict=True))
    changed = {name: after[name] for name in names if after[name] != before[name]}
    assert changed == pytest.approx({
        "early.a": 11.2, "early.b": -3.0, "early.memory1": 1.25, "early.memory2": 2.75, "early.next": 1.6,
        "late.x": 7.0, "late.memory1": 5.0, "late.next": 1.325,
    })  # fmt: skip
    assert [call[:2] for call in calls] == [("early", 1.2), ("late", 1.2)]
    assert calls[0][2].tolist() == [0.3] and calls[0][3].tolist() == [0.25, 0.75]
    assert calls[1][2] == -3.0 and calls[1][3].tolist() == [4.0]
    x[names.index("early.next")] = x[names.index("slow.next")] = 5.0
    model.clock.strike(1.325, x)  # the call between two samples; its next is between again, not the sample at 1.7
    assert x[names.index("late.next")] == 1.45


@pytest.mark.parametrize(
    ("answer", "text"),
    [
        (3.0, r"controller 'c' answered 3\.0 at t = 0 s; expected \(command, memory\)"),
        ((1.0,), r"controller 'c' answered \(1\.0,\) at t = 0 s; expected"),
        (([1.0, 2.0], [0.0]), r"the command of controller 'c' at t = 0 s has shape \(2,\); expected \(1,\)"),
        ((1.0, [0.0, 1.0]), r"the memory of controller 'c' at t = 0 s has shape \(2,\); expected \(1,\)"),
        ((1.0, None), r"the memory of controller 'c' at t = 0 s has shape \(0,\); expected \(1,\)"),
        ((np.inf, [0.0]), r"the command of controller 'c' at t = 0 s is not finite: \[inf\]"),
        ((1.0, [np.nan]), r"the memory of controller 'c' at t = 0 s is not finite: \[nan\]"),
        ((1.0, [0.0], 0.0), "requested its next call at 0 s; give a later time"),
    ],
)
def test_answers_that_a_controller_may_not_give_are_refused_with_them(answer, text):
    one = Controller("c", lambda t, seen, memory: answer, 0.5, (), {"x": "N"}, memory=[1.0])
    model = compile_system(System({"body": BODY}, (revolute("body"),), effectors=(one,)))
    with pytest.raises(ValueError, match=text):
        model.clock.strike(0.0, model.x0.copy())


@pytest.mark.parametrize("orbit", [None, Orbit(70.0, 0.3, mu=4e3), Orbit(70.0, 0.3, mu=4e3, free=True)])
@pytest.mark.parametrize("seed", [3, 11])
def test_the_power_of_each_load_is_its_force_and_torque_by_the_velocities_that_are_reported(seed, orbit):
    """On a specified orbit the craft's base moves so that its centre of mass stays at O: velocities are from O."""
    rng = np.random.default_rng(seed)
    root = {None: None}.get(orbit, free if orbit is not None and orbit.free else spherical)
    more = {} if orbit is None else {"orbit": orbit, "frame": Frame("inertial")}
    system, _, (q, u) = random_tree(seed, root=root, **more)
    names = list(system.bodies)
    frames = ("body", "marker", "inertial", "inertial")
    times = (None, None, None, np.array([-1.0, 3.0]))
    loads = []
    for k, (frame, knots) in enumerate(zip(frames, times, strict=True)):
        size = (3,) if knots is None else (2, 3)
        force, torque = rng.normal(size=size), rng.normal(size=size) * (k != 2)
        loads.append(Load(f"l{k}", names[k], "abca"[k], frame, force=force, torque=torque, times=knots))
    model = compile_system(replace(system, loads=tuple(loads)))
    x = np.concatenate([q, u])
    seen = model.observe(np.zeros(1), x[None])
    supplied = 0.0
    for load in loads:
        alone = replace(system, loads=(load,))
        mine = compile_system(alone)
        wanted = load_power(mine, x)
        assert seen[f"loads/{load.name}/power"][0] == pytest.approx(wanted, rel=1e-6, abs=1e-8)
        if orbit is not None or load.name != "l2":  # a constant force has a potential where there is no orbit
            supplied += wanted
    assert seen["monitors/supplied"][0] == pytest.approx(supplied, rel=1e-6, abs=1e-8)


def slides(*laws, damping=(0.0, 0.0)) -> System:
    """Two boxes of 2 and 5 kg, the second on the first, along axes 60 degrees apart."""
    first = prismatic("a", axis=(1, 0, 0), name="first", damping=damping[0], q0=[0.1])
    axis = (0.5, np.sqrt(0.75), 0)
    second = prismatic("b", "a", axis=axis, name="second", damping=damping[1], laws=laws, q0=[0.2])
    return System({"a": BODY, "b": rigid_body(5.0, [1.0] * 3)}, (first, second))


M = np.array([[7.0, 2.5], [2.5, 5.0]])  # of both slides: 2 + 5, 5 cos 60 deg, 5


def test_the_highest_frequency_of_laws_is_that_of_the_stiffest_over_what_it_moves():
    stops = Stop(upper=1.0, stiffness=80.0), Stop(upper=2.0, stiffness=20.0)  # neither touches at the start
    found = compile_system(slides(*stops)).max_frequency
    assert found == pytest.approx(np.sqrt(80.0 * np.linalg.inv(M)[1, 1]), rel=1e-9)
    latch = Latch(0, at=0.9, stiffness=500.0)
    system = slides(*stops)
    system = replace(system, joints=(replace(system.joints[0], latches=(latch,)), system.joints[1]))
    assert compile_system(system).max_frequency == pytest.approx(np.sqrt(500.0 * np.linalg.inv(M)[0, 0]), rel=1e-9)


def test_dampers_count_where_motion_dies_faster_than_anything_vibrates():
    model = compile_system(slides(damping=(300.0, 40.0)))
    rates = np.linalg.eigvals(np.linalg.solve(M, np.diag([300.0, 40.0])))
    assert model.max_frequency == pytest.approx(rates.max(), rel=1e-7)
    rubbed = compile_system(slides(Friction(limit=2.0, velocity=0.01)))
    assert rubbed.max_frequency == pytest.approx(2.0 / 0.01 * np.linalg.inv(M)[1, 1], rel=1e-3)
    assert compile_system(slides()).max_frequency == 0.0


@pytest.mark.parametrize("cause", range(4))
def test_every_cause_of_an_end_is_looked_for_and_the_first_is_reported(monkeypatch, cause):
    names = ("end_of_length", "gimbal_lock", "flat_disc", "end_of_reach")
    for k, name in enumerate(names):
        monkeypatch.setattr(diagnosis, name, lambda model, t, x, k=k: f"cause {k} at {t:g} s" if k >= cause else "")
    assert diagnosis.diagnosis(SimpleNamespace(constraints=None), 2.5, np.zeros(1), False) == (
        f"cause {cause} at 2.5 s",
        None,
    )


def test_the_joint_that_has_locked_is_named_though_others_come_before_it():
    bodies = {name: rigid_body(1.0, np.diag([1.0, 2.0, 2.5])) for name in "abc"}
    joints = tuple(
        turns(child, parent, "xyz", name=f"j{child}") for child, parent in (("a", None), ("b", "a"), ("c", "b"))
    )
    model = compile_system(System(bodies, joints))
    x = model.x0.copy()
    assert model.diagnosis(0.0, x) == ("", None)
    x[4] = np.pi / 2 - 5e-3
    text, error = model.diagnosis(0.0, x)
    assert text.startswith("joint 'jb' has reached gimbal lock: the axes of its free turns") and error is None
    assert text.endswith("Choose a sequence of turns that stays clear of it, or lock other turns")
