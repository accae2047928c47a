"""What is reported of joints, latches and events where there are several of each, behind bodies that bend."""

from dataclasses import replace

import numpy as np
import pytest
from support.mechanisms import four_bar, planar
from support.random_systems import random_body

from femflex.body import rigid_body
from femflex.dynamics import compile_system
from femflex.dynamics.constraints.moved_start import MovedValue, moved_start
from femflex.dynamics.constraints.reach import end_of_reach_text
from femflex.system import (
    Joint,
    Latch,
    Stop,
    Supply,
    System,
    TabulatedDamper,
    TabulatedSpring,
    Threshold,
    free,
    prismatic,
    revolute,
    spherical,
    tank,
    thruster,
    velocity_rows,
)

RNG = np.random.default_rng(7)
NAMES = ("hub", "wrist", "elbow", "finger", "door", "drawer")


def linear(k):
    """A spring law of that stiffness."""
    return TabulatedSpring(stretch=[-3.0, 0.0, 3.0], resisting=[-3.0 * k, 0.0, 3.0 * k])


def craft(**more):
    """Six bodies, most of which bend; two balls, three turns, a door and a drawer with laws and latches."""
    sizes = dict(zip(NAMES, (3, 2, 1, 0, 2, 1), strict=True))
    bodies = {name: random_body(RNG, sizes[name])[0] for name in reversed(NAMES)}
    drag = TabulatedDamper(rate=[-4.0, 0.0, 4.0], resisting=[-2.0, 0.0, 2.0])
    turns = {"translations": np.array([[0.0, 0, 1]]), "rotations": np.eye(3), "damping": np.array([0.1, 0.2, 0.3, 0.4])}
    joints = (
        prismatic("drawer", "hub", axis=(0, 1, 1), name="slide", laws=(linear(5.0), drag), latches=(Latch(0, 0.8),)),
        revolute("door", "wrist", axis=(1, 2, 0), name="hinge", laws=(linear(3.0),), damping=0.7,
                 latches=(Latch(0, -0.9, stiffness=20.0, damping=0.6),)),
        free("hub", name="root"),
        Joint("finger", "elbow", name="turns", kind="general", **turns),
        spherical("elbow", "wrist", name="second", rotation="zxz", q0=[0.0, 0.9, 0.0]),
        spherical("wrist", "hub", name="first", rotation="xyz"),
    )  # fmt: skip
    fuel = tuple(
        part
        for k, (flow, mass) in enumerate(((1.0, 3.0), (2.5, 7.0)), start=1)
        for part in (
            thruster(f"jet{k}", "hub", flow * 9.80665, profile=([0.0], [1.0]), specific_impulse=1.0,
                     supply=Supply(f"fuel{k}", "hub")),
            tank(f"fuel{k}", mass, [f"jet{k}"]),
        )
    )  # fmt: skip
    return System(bodies, joints, effectors=fuel, **more)


@pytest.fixture(scope="module")
def model():
    return compile_system(craft())


@pytest.fixture(scope="module")
def state(model):
    """Coordinates, velocities and states by name, and the state vector."""
    rng = np.random.default_rng(1)
    x = model.x0.copy()
    x[: model.n_q] += 0.3 * rng.uniform(-1, 1, model.n_q)
    x[model.n_q : model.n_q + model.n_u] = rng.normal(size=model.n_u)
    names = [name for name, _ in model.system.all_state_names()]
    x[names.index("slide.latch_time")], x[names.index("slide.latch_loss")] = 4.5, 11.0
    x[names.index("hinge.latch_time")], x[names.index("hinge.latch_loss")] = 2.5, 0.0
    x[names.index("slide.slide")] = 0.8  # where it is latched
    return dict(zip(names, x, strict=True)), x


def test_every_ball_and_every_row_of_turns_reports_its_own_singularity(model, state):
    of, x = state
    seen = model.observe(np.zeros(1), x[None])
    assert seen["joints/first/singularity"][0] == pytest.approx(np.pi / 2 - abs(of["first.y2"]))
    assert seen["joints/second/singularity"][0] == pytest.approx(abs(of["second.x2"]))
    assert seen["joints/turns/singularity"][0] == pytest.approx(np.pi / 2 - abs(of["turns.angle2"]))
    assert not {"joints/root/singularity", "joints/slide/singularity"} & seen.keys()


def test_each_latch_reports_its_own_time_and_loss_and_each_law_its_own_force(model, state):
    of, x = state
    seen = {path: v[0] for path, v in model.observe(np.zeros(1), x[None]).items()}
    for name, time, loss in (("slide.slide", 4.5, 11.0), ("hinge.angle", 2.5, 0.0)):
        found = [seen[f"latches/{name}/{key}"] for key in ("locked", "time", "loss")]
        assert found == [1.0, time, loss]
    elastic = 20.0 * (of["hinge.angle"] + 0.9)
    drag = 0.6 * of["hinge.angle_rate"]
    forces = {path: v for path, v in seen.items() if path.startswith("laws/")}
    assert sorted(model.channels[path].unit for path in forces) == ["N", "N", "N m", "N m"]
    expected = [5.0 * 0.8, 0.0, 3.0 * of["hinge.angle"], elastic + drag]  # a latched slide is at rest
    assert sorted(forces.values()) == pytest.approx(sorted(expected), abs=1e-12)
    assert seen["laws/hinge.angle.latch/force"] == pytest.approx(elastic + drag)
    lost = (0.7 + 0.6) * of["hinge.angle_rate"] ** 2
    rates = ("slide_rate", "angle1_rate", "angle2_rate", "angle3_rate")
    lost += sum(c * of[f"turns.{key}"] ** 2 for c, key in zip((0.1, 0.2, 0.3, 0.4), rates, strict=True))
    for name in model.system.order:
        body = model.system.bodies[name]
        rate = np.array([of[f"{name}.delta{k + 1}_rate"] for k in range(body.n_modes)])
        lost += rate @ body.damping @ rate
    assert seen["monitors/dissipation"] == pytest.approx(lost, rel=1e-10)


def test_events_of_latches_and_tanks_happen_each_by_itself(model):
    names = [name for name, _ in model.system.all_state_names()]
    x = model.x0.copy()
    for name, value in {"slide.slide": 0.3, "slide.slide_rate": 0.2, "hinge.angle": -0.4, "hinge.angle_rate": -0.6,
                        "fuel1.mass": 3.0, "fuel2.mass": 7.0}.items():  # fmt: skip
        x[names.index(name)] = value
    order = [name for name in model.system.order if name in ("door", "drawer")]
    to_go = {"door": 0.5, "drawer": 0.5}  # both start at zero: one goes up to 0.8, the other down to -0.9
    rates = {"door": -0.6, "drawer": -0.2}
    assert model.events.values(0.0, x) == pytest.approx([*(to_go[name] for name in order), 3.0, 7.0])
    assert model.events.rates(0.0, x) == pytest.approx([*(rates[name] for name in order), -1.0, -2.5], rel=1e-6)

    def changed(together, t):
        y = x.copy()
        model.events.happen(together, t, y)
        return {name: float(b) for name, a, b in zip(names, x, y, strict=True) if a != b}

    assert changed([3], 1.5) == {"fuel2.mass": 0.0, "fuel2.feed": 0.0, "fuel2.emptied": 1.5}
    elastic = order.index("door")
    assert changed([elastic], 1.5) == {"hinge.angle": -0.9, "hinge.latch_time": 1.5}
    both = changed([2, elastic], 0.5)
    assert both == {"fuel1.mass": 0.0, "fuel1.feed": 0.0, "fuel1.emptied": 0.5, "hinge.angle": -0.9,
                    "hinge.latch_time": 0.5}  # fmt: skip
    empty = x.copy()
    empty[names.index("fuel1.feed")] = 0.0
    assert model.events.values(0.0, empty)[2:] == pytest.approx([1.0, 7.0])


def test_an_event_that_gives_too_few_states_is_refused_with_both_numbers():
    one = craft()
    bad = replace(one.effectors[1].events[0], happen=lambda t, z: np.zeros(2))
    effectors = (one.effectors[0], replace(one.effectors[1], events=(bad,)), *one.effectors[2:])
    model = compile_system(replace(one, effectors=effectors))
    with pytest.raises(
        ValueError, match=r"event 'empty' of effector 'fuel1' gave states of shape \(2,\); expected \(3,\)"
    ):
        model.events.happen([2], 0.0, model.x0.copy())


def test_a_threshold_on_what_is_no_channel_or_has_several_numbers_is_refused():
    for path, said in (
        ("bodies/door/rates", r"'bodies/door/rates', at which joint 'bolt' opens, is no channel"),
        ("bodies/door/rate", r"channel 'bodies/door/rate', at which joint 'bolt' opens, has 3 entries"),
    ):
        joint = revolute("door", name="bolt", latches=(Latch(0, opens=Threshold(path, 1.0)),))
        with pytest.raises(ValueError, match=said):
            compile_system(System({"door": rigid_body(1.0, np.eye(3))}, (joint,)))


def test_rows_of_a_wrong_shape_are_refused_with_all_shapes():
    rows = velocity_rows("motor", 2, lambda t, q: (np.ones((1, 1)), np.zeros(1)))
    system = System({"arm": planar(2.0, 0.3, (0.2, 0))}, (revolute("arm"),), constraints=(rows,))
    text = r"constraint 'motor' gave A of shape \(1, 1\) and b of shape \(1,\); expected \(2, 1\) and \(2,\)"
    with pytest.raises(ValueError, match=text):
        compile_system(system)


def test_a_four_bar_counts_its_rows_and_says_which_are_redundant():
    model = compile_system(four_bar())
    assert model.constraints.redundant(0.0, model.x0) == 3  # of five rows two close a plane triangle
    assert model.constraints.text(0.0, model.x0) == (
        "5 constraint rows, of which 3 are redundant; of all possible reactions the smallest are given."
    )
    rows = velocity_rows("motor", 1, lambda t, q: (np.ones((1, 1)), np.zeros(1)))
    one = compile_system(System({"arm": planar(2.0, 0.3, (0.2, 0))}, (revolute("arm"),), constraints=(rows,)))
    assert one.constraints.text(0.0, one.x0) == "1 constraint row, none redundant."


def test_what_the_start_moved_is_listed_from_the_farthest_on_in_degrees():
    model = compile_system(four_bar())
    names = [name for name, _ in (*model.system.coordinate_names(), *model.system.velocity_names())]
    given = model.system.initial_state()
    moved = moved_start(model)
    angles = [one for one in moved if one.unit == "rad"]
    assert len(moved) == len(names)
    for one in moved:
        k = names.index(one.name)
        assert (one.given, one.started) == (given[k], model.x0[k])
    far = [abs(one.given - one.started) for one in angles]
    assert far == sorted(far, reverse=True) and len(angles) == 3
    closed = replace(
        model.system,
        joints=tuple(
            joint.with_initial(
                q0=[model.x0[names.index(f"{joint.label}.angle")]],
                u0=[model.x0[names.index(f"{joint.label}.angle_rate")]],
            )
            if joint.n_u
            else joint
            for joint in model.system.joints
        ),
    )
    assert moved_start(compile_system(closed)) == []


@pytest.mark.parametrize(("given", "started"), [(0.3, 0.31), (1.0, 1.0 + 3e-9), (0.0, 2.5), (-2.0, 5.0)])
def test_a_moved_value_is_written_with_the_digits_it_takes_to_see_it(given, started):
    for unit, factor, written in (("rad", 180 / np.pi, "deg"), ("m", 1.0, "m")):
        name, before, arrow, after, said = str(MovedValue("hinge.angle", unit, given, started)).split()
        assert (name, arrow, said) == ("hinge.angle", "->", written)
        change = factor * (started - given)
        assert float(after) - float(before) == pytest.approx(change, rel=0.1)
        assert float(before) == pytest.approx(factor * given, rel=1e-3)


def test_a_flat_parallelogram_is_said_to_be_singular_and_an_upright_one_is_not():
    system = four_bar(crank=1.0, coupler=2.0, rocker=1.0, base=2.0, speed=0.0, start=(1.0, -1.0, 1.0))
    model = compile_system(system)
    flat = model.x0.copy()
    flat[:3] = 0.0
    text = end_of_reach_text(model, 0.0, flat, 1e-3)
    assert text.startswith("loop 'closure' is in a singular configuration, where its joints' motion is not determined")
    assert end_of_reach_text(model, 0.0, model.x0, 1e-3) == ""
    slightly = model.x0.copy()
    slightly[:3] = 0.5, -0.5, 0.5
    assert end_of_reach_text(model, 0.0, slightly, 1e-3) == ""


def test_stops_stand_on_both_sides_of_a_drawer():
    stop = Stop(lower=-0.2, upper=0.5, stiffness=100.0, damping=0.0, width=1e-6)
    joint = prismatic("drawer", laws=(replace(stop, freedom=0),))
    model = compile_system(System({"drawer": rigid_body(2.0, np.eye(3))}, (joint,)))
    x = np.zeros((4, 2))
    x[:, 0] = -0.3, -0.1, 0.4, 0.7
    force = next(v for path, v in model.observe(np.zeros(4), x).items() if path.startswith("laws/"))
    assert force == pytest.approx([-10.0, 0.0, 0.0, 20.0], abs=1e-4)
