"""Thrusters, tanks, wheels, gyros, cables and length tables as the equations get them: every number, of parts of which
no two are alike."""

from __future__ import annotations

from dataclasses import fields

import numpy as np
import pytest

from femflex.body import Marker, MassMoments, rigid_body
from femflex.deployment import Reel
from femflex.system import (
    Effector,
    Environment,
    Joint,
    LengthTable,
    Load,
    Orbit,
    Profile,
    Sight,
    Supply,
    System,
    Variation,
    cable,
    control_moment_gyro,
    free,
    pulse_train,
    reaction_wheel,
    tank,
    tank_variation,
    thruster,
    unbalanced_rotor,
    with_heavy_cable,
    without_axial_inertia,
)
from femflex.system.attraction import Reach, extent, free_members, is_integrated, longest, moving_points_of, reach
from femflex.system.gimbals import coasting_gyro
from femflex.system.moving_points import MovingPoints
from femflex.system.variation import Block
from femflex.system.wheel import coasting, with_wheel


def same(effector: Effector, act: str, **wanted: object) -> None:
    """Assert that an effector has these fields, and the defaults of an effector with its states else."""
    default = Effector(effector.name, act, states=effector.states)
    for key in (one.name for one in fields(effector)):
        found, value = getattr(effector, key), wanted.get(key, getattr(default, key))
        if isinstance(found, np.ndarray):
            assert found == pytest.approx(np.asarray(value, float), rel=1e-14, abs=1e-14), key
        else:
            assert found == value, key


def test_a_thruster_with_a_lag_that_draws_from_a_tank_elsewhere():
    made = thruster(
        "jet", "arm", 3.0, marker="nozzle", axis=(0, 0, 2.0), misalignment=(np.pi / 2, 0, 0), command="law.y",
        lag=0.2, specific_impulse=200.0, supply=Supply("fuel", "hub", "sump", 0.3),
    )  # fmt: skip
    same(
        made,
        "thruster",
        markers=(("arm", "nozzle"), ("hub", "sump")),
        states={"lagged": "N"},
        sizes=[3.0],
        inputs=("law.y", "fuel.feed"),
        channels={"thrust": "N", "flow": "kg/s"},
        accounts=("supplied", "mass_flow"),
        parameters=[0, -1, 0, 3.0, 200 * 9.80665, 0.2, 1.0, 1.0, 1.0, 0.09, 0.0],
    )


def test_a_misaligned_axis_turns_about_the_misalignment_by_its_length():
    turn = np.array([0.2, -0.1, 0.3])
    K = np.array([[0, -0.3, -0.1], [0.3, 0, -0.2], [0.1, 0.2, 0]])
    angle = np.linalg.norm(turn)
    R = np.eye(3) + np.sin(angle) / angle * K + (1 - np.cos(angle)) / angle**2 * K @ K
    made = thruster("jet", "hub", 1.0, axis=(2, -1, 2), misalignment=turn, pulses=[(0, 1)])
    assert made.parameters[:3] == pytest.approx(R @ [2 / 3, -1 / 3, 2 / 3], abs=1e-14)


def test_thrusters_by_pulses_and_by_profile_have_their_tables_behind_their_numbers():
    by_pulses = thruster("jet", "hub", 2.0, pulses=[(1.0, 0.5), (2.0, 0.25)], minimum_on=0.25)
    same(
        by_pulses,
        "thruster",
        markers=(("hub", "origin"),),
        channels={"thrust": "N", "flow": "kg/s"},
        accounts=("supplied", "mass_flow"),
        parameters=[1, 0, 0, 2, 0, 0, 0, 0, 0, 0, 4, 1, 1.5, 2, 2.25, 1, 0, 1, 0],
        breaks=[1, 1.5, 2, 2.25],
    )
    by_profile = thruster("jet", "hub", 2.0, profile=([0.5, 3.0, 4.0], [0.0, 1.0, 0.3]), specific_impulse=100.0)
    assert by_profile.parameters[4] == pytest.approx(980.665)
    assert by_profile.parameters[10:].tolist() == [3, 0.5, 3, 4, 0, 1, 0.3]
    assert by_profile.breaks.tolist() == [0.5, 3, 4]
    assert thruster("jet", "hub", 2.0, command="c", switched=True).parameters[6] == 2.0


def test_pulses_may_not_touch_and_the_first_that_does_is_named():
    with pytest.raises(ValueError, match=r"pulse 3 of thruster 'jet' starts at 3 s, before the previous .* \(3 s\)"):
        thruster("jet", "hub", 1.0, pulses=[(0.0, 0.5), (2.0, 1.0), (3.0, 0.5), (3.2, 1.0)])
    assert pulse_train(0.5, 2.0, 0.3, 3) == [(0.5, 0.3), (2.5, 0.3), (4.5, 0.3)]
    assert len(pulse_train(0.0, 1.0, 0.5, 100_000)) == 100_000
    with pytest.raises(ValueError, match="found 100001 pulses of one thruster; the most is 100000"):
        pulse_train(0.0, 1.0, 0.5, 100_001)


def test_a_tank_that_two_thrusters_draw_from():
    made = tank("fuel", 4.0, ["jet", "vent"])
    same(
        made,
        "tank",
        states={"mass": "kg", "feed": "1", "emptied": "s"},
        z0=[4, 1, -1],
        sizes=[4, 1, 1],
        inputs=("jet.flow", "vent.flow"),
        parameters=[2.0],
        events=made.events,
    )
    (empty,) = made.events
    assert empty.name == "empty"
    assert empty.value(7.0, np.array([0.3, 1.0, -1.0])) == 0.3
    assert empty.value(7.0, np.array([0.0, 0.0, 5.0])) == 1.0
    assert empty.happen(7.0, np.array([0.1, 1.0, -1.0])).tolist() == [0.0, 0.0, 7.0]


def test_two_tanks_of_a_body_stand_by_what_they_hold_and_the_rest_is_dry():
    """Point masses at the tanks' markers: moments by hand."""
    markers = {"bow": Marker.rigid([2.0, 0, 0]), "aft": Marker.rigid([0, -1.0, 0.5])}
    body = rigid_body(50.0, np.diag([60.0, 70.0, 80.0]), [0.1, 0.2, -0.1], markers)
    made = tank_variation(body, {"fuel": ("bow", 3.0, 0.4), "air": ("aft", 2.0, 0.0)})
    assert (made.write, made.varies, made.states) == ("tanks", ("mass",), ("fuel.mass", "air.mass"))
    block = Block(body, ("mass",))
    assert made.numbers[:2].tolist() == [-1.0, block.size]
    rows = made.numbers[2:].reshape(3, block.size)
    units = []
    for r, gyration in (([2.0, 0, 0], 0.4), ([0, -1.0, 0.5], 0.0)):
        r = np.array(r)
        second = np.outer(r, r) + gyration**2 / 2 * np.eye(3)  # a third of the trace is half of an inertia
        units.append((1.0, r, second))
    m = body.moments
    dry = (
        m.mass - 3.0 - 2.0,
        m.first[0] - 3.0 * units[0][1] - 2.0 * units[1][1],
        m.second[0, :, 0] - 3.0 * units[0][2] - 2.0 * units[1][2],
    )
    for row, (mass, first, second) in zip(rows, (dry, *units), strict=True):
        wanted = np.zeros(block.size)
        block.put_moments(wanted, MassMoments(mass, first[None], second[None, :, None]))
        assert row == pytest.approx(wanted, abs=1e-12)


def test_a_wheel_of_commanded_speed_and_one_of_constant_torque():
    servo = reaction_wheel(
        "z", "hub", 0.2, marker="seat", axis=(0, 3, 4), speed="law.z", bandwidth=7.0, initial_speed=-5.0,
        max_torque=0.6, max_speed=40.0, viscous=0.01, coulomb=0.02, coulomb_speed=0.3,
    )  # fmt: skip
    channels = {"speed": "rad/s", "motor": "N m", "friction": "N m", "saturated": "1"}
    momenta = {"momentum_x": "N m s", "momentum_y": "N m s", "momentum_z": "N m s"}
    same(
        servo,
        "wheel",
        markers=(("hub", "seat"),),
        states={"momentum": "N m s"},
        sizes=[1.0],
        inputs=("law.z",),
        channels={**channels, **momenta},
        accounts=("energy", "dissipation", "supplied"),
        parameters=[0, 0.6, 0.8, 0.2, 1, 0, 7, 0.6, 40, 0.01, 0.01, 0.02, 0.3],
        starts={"speed": ("momentum", -5.0)},
    )
    plain = reaction_wheel("z", "hub", 0.2, torque=0.3, initial_speed=0.5)
    assert plain.parameters.tolist() == [0, 0, 1, 0.2, 0, 0.3, 0, 1e300, 1e300, 0.01, 0, 0, 0.1]
    assert (plain.inputs, plain.sizes.tolist()) == ((), [0.2])
    assert reaction_wheel("z", "hub", 0.2, speed=9.0).parameters[4:7].tolist() == [0, 9.0, 10.0]
    same(coasting(servo, 1.5), "rotor", markers=(("hub", "seat"),), channels=momenta, parameters=[0, 0.6, 0.8, 1.5])


def test_a_wheel_may_start_at_its_largest_speed_and_turns_either_way():
    assert reaction_wheel("z", "hub", 0.2, initial_speed=-40.0, max_speed=40.0).starts["speed"][1] == -40.0
    with pytest.raises(ValueError, match=r"starts at -40.5 rad/s, and its largest speed is 40 rad/s"):
        reaction_wheel("z", "hub", 0.2, initial_speed=-40.5, max_speed=40.0)


def test_wheels_out_of_the_axis_change_the_inertia_about_their_marker():
    body = rigid_body(10.0, np.diag([3.0, 4.0, 5.0]), markers={"seat": Marker.rigid([0, 0, 2.0])})
    wheel = reaction_wheel("w", "body", 0.5, marker="seat", axis=(0, 3, 4))
    a = np.array([0, 0.6, 0.8])
    less = without_axial_inertia(body, wheel)
    assert less.moments.mass == 10.0
    assert less.moments.inertia() == pytest.approx(np.diag([3.0, 4.0, 5.0]) - 0.5 * np.outer(a, a), abs=1e-12)
    more = with_wheel(body, wheel, 1.5, 0.3)
    assert more.moments.mass == 11.5
    shifted = 1.5 * 4.0 * np.diag([1.0, 1.0, 0.0])
    assert more.moments.inertia() == pytest.approx(
        np.diag([3.0, 4.0, 5.0]) + shifted + 0.3 * (np.eye(3) - np.outer(a, a)), abs=1e-12
    )


def test_an_unbalanced_rotor_has_its_imbalances_about_the_middle_of_its_bearing():
    rotor = unbalanced_rotor(2.0, 0.08, 0.05, static_imbalance=0.006, dynamic_imbalance=0.001)
    assert rotor.moments.first[0] == pytest.approx([0.006, 0, 0], abs=1e-15)
    assert rotor.moments.inertia() == pytest.approx(
        np.array([[0.05, 0, -0.001], [0, 0.05, 0], [-0.001, 0, 0.08]]), abs=1e-14
    )


def test_a_gyro_of_two_gimbals_and_one_with_inertia():
    momenta = {"momentum_x": "N m s", "momentum_y": "N m s", "momentum_z": "N m s"}
    two = control_moment_gyro(
        "g", "hub", 5.0, marker="seat", gimbal_axis=(0, 0, 2), spin_axis=(3, 0, 0), inner_axis=(0, 4, 0),
        angles=["law.x", 0.3], gain=2.0, initial_angles=[0.1, -0.2], max_rate=0.7,
    )  # fmt: skip
    same(
        two,
        "gimbals",
        markers=(("hub", "seat"),),
        states={"angle1": "rad", "angle2": "rad"},
        z0=[0.1, -0.2],
        sizes=[1, 1],
        inputs=("law.x",),
        channels={**momenta, "rate1": "rad/s", "motor1": "N m", "rate2": "rad/s", "motor2": "N m"},
        accounts=("energy", "supplied"),
        parameters=[2, 5, 0, 10, 0, 0, 1, 0, 1, 0, 1, 0, 0, 1, 0, 2, 0.7, 1e300, 0, 0.3, 2, 0.7, 1e300],
    )
    one = control_moment_gyro(
        "g", "hub", -5.0, rates=[0.2], gimbal_inertia=0.4, bandwidth=6.0, max_torque=0.9, max_rate=0.8
    )
    same(
        one,
        "gimbals",
        markers=(("hub", "origin"),),
        states={"angle": "rad", "momentum": "N m s"},
        z0=[0, 0],
        sizes=[1, 0.4],
        channels={**momenta, "rate1": "rad/s", "motor1": "N m"},
        accounts=("energy", "supplied"),
        parameters=[1, -5, 0.4, 6, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 0.2, 0, 0.8, 0.9],
        starts={"rate1": ("momentum", 0.0)},
    )


def test_a_coasting_gyro_stays_at_its_angles_the_inner_axis_carried_by_the_outer():
    two = control_moment_gyro("g", "hub", 5.0, inner_axis=(0, 1, 0), rates=[0.0, 0.0])
    a, b = 0.4, -0.9
    spin = [np.cos(a) * np.cos(b), np.sin(a) * np.cos(b), -np.sin(b)]
    stays = coasting_gyro(two, np.array([a, b]))
    assert stays.parameters == pytest.approx([*spin, 5.0], abs=1e-14)
    assert (stays.act, stays.markers) == ("rotor", (("hub", "origin"),))
    one = control_moment_gyro("g", "hub", -2.0, rates=[0.0])
    assert coasting_gyro(one, np.array([a, 9.0])).parameters == pytest.approx([np.cos(a), np.sin(a), 0, -2.0])


def test_axes_of_a_gyro_are_perpendicular_where_they_have_to_be():
    control_moment_gyro("g", "hub", 1.0, gimbal_axis=(1, 0, 1), inner_axis=(0, 1, 0), rates=[0.0, 0.0])
    for axes, product in (
        ({"inner_axis": (1, 2, 0)}, "inner_axis and spin_axis of 'g' are not perpendicular: their product is 0.447"),
        ({"inner_axis": (-1, 2, 0)}, "inner_axis and spin_axis of 'g' are not perpendicular: their product is -0.447"),
        ({"inner_axis": (0, 1, 2)}, "inner_axis and gimbal_axis of 'g' are not perpendicular: their product is 0.894"),
        ({"gimbal_axis": (1, 0, 2)}, "gimbal_axis and spin_axis of 'g' are not perpendicular: their product is 0.447"),
    ):
        with pytest.raises(ValueError, match=product):
            control_moment_gyro("g", "hub", 1.0, **axes, rates=[0.0] * (1 + ("inner_axis" in axes)))


def test_a_cable_is_refused_for_its_least_length_and_has_its_numbers_in_order():
    ends = (("a", "x"), ("b", "y"))
    length = Profile.trapezoid(1.0, 5.0, 3.0, 2.0, 1.0)
    made = cable("line", ends, length, 900.0, 4.0)
    same(
        made,
        "cable",
        markers=ends,
        channels={"tension": "N", "distance": "m", "length": "m"},
        accounts=("energy", "dissipation", "supplied"),
        parameters=[900.0, 4.0, *np.clip(length.numbers, -1e300, 1e300)],
        breaks=length.breaks,
    )
    with pytest.raises(ValueError, match=r"the length of cable 'line' comes to -0\.5 m; it must stay positive"):
        cable("line", ends, Profile.trapezoid(1.0, 5.0, 3.0, -0.5, 1.0), 900.0)
    with pytest.raises(ValueError, match="comes to -1 m"):
        cable("line", ends, Profile.trapezoid(1.0, 5.0, -1.0, 2.0, 1.0), 900.0)


def test_a_heavy_cable_is_half_a_part_apart_from_both_its_ends():
    bodies = {name: rigid_body(5.0, np.eye(3)) for name in ("a", "b")}
    system = System(bodies, (free("a"), free("b")))
    places, rates = np.arange(9.0).reshape(3, 3), 0.1 * np.arange(9.0).reshape(3, 3)
    made = with_heavy_cable(
        system, "line", (("a", "origin"), ("b", "origin")), 6.0, 900.0, 0.4, 3, places, rates=rates, damping=0.7
    )
    names = ["line_1", "line_2", "line_3"]
    assert list(made.bodies) == ["a", "b", *names]
    assert [made.bodies[name].moments.mass for name in names] == pytest.approx([0.8] * 3)
    assert [joint.child for joint in made.joints] == ["a", "b", *names]
    for k, joint in enumerate(made.joints[2:]):
        assert (joint.parent, joint.parent_marker, joint.kind) == ("a", "origin", "general")
        assert (joint.q0.tolist(), joint.u0.tolist()) == (places[k].tolist(), rates[k].tolist())
        assert joint.translations.tolist() == np.eye(3).tolist()
    same(
        made.effectors[-1],
        "cable_chain",
        markers=(("a", "origin"), *((name, "origin") for name in names), ("b", "origin")),
        channels={"tension": "N", "tension_end": "N", "slack": "1"},
        accounts=("energy", "dissipation"),
        parameters=[4, 900, 0.7, 6, 1, 2, 2, 1],
    )
    for masses in (0, 501):
        with pytest.raises(ValueError, match=f"cable 'line' has {masses} masses; give 1 to 500"):
            with_heavy_cable(system, "line", (("a", "origin"), ("b", "origin")), 6.0, 9.0, 0.4, masses, np.zeros(0))
    with pytest.raises(ValueError, match="adds a body 'line_2', and there is one of that name"):
        with_heavy_cable(
            System({**bodies, "line_2": bodies["a"]}, (free("a"), free("b"), free("line_2"))),
            "line", (("a", "origin"), ("b", "origin")), 6.0, 9.0, 0.4, 2, np.zeros((2, 3)),
        )  # fmt: skip


def test_stations_turn_with_the_earth_from_their_own_longitudes():
    north = Sight("north", "hub", axis=(0, 3, 4), latitude=np.pi / 6, longitude=0.5, radius=10.0, rate=0.2)
    south = Sight("south", "hub", latitude=-np.pi / 6, longitude=-0.3, radius=4.0)
    c = np.sqrt(3) / 2
    assert north.axis.tolist() == [0, 0.6, 0.8]
    assert north.station(np.array([0.0, 2.0])) == pytest.approx(
        10 * np.array([[c * np.cos(0.5), c * np.sin(0.5), 0.5], [c * np.cos(0.9), c * np.sin(0.9), 0.5]])
    )
    angle = -0.3 + 7.292115e-5 * 3600.0
    assert south.station(np.array([3600.0]))[0] == pytest.approx(
        [4 * c * np.cos(angle), 4 * c * np.sin(angle), -2.0], rel=1e-14
    )


def test_a_load_is_conservative_where_it_is_a_constant_force_in_inertial_axes():
    assert Load("w", "hub", frame="inertial", force=np.array([0, 0, 1.0])).conservative
    assert not Load("w", "hub", force=np.array([0, 0, 1.0])).conservative
    assert not Load("w", "hub", frame="orbital", force=np.array([0, 0, 1.0])).conservative
    assert not Load("w", "hub", frame="inertial", torque=np.array([0, 0, 1.0])).conservative
    table = Load("w", "hub", frame="inertial", force=np.ones((2, 3)), times=np.array([0.0, 1.0]))
    assert not table.conservative
    assert table.torque.tolist() == np.zeros((2, 3)).tolist()


def test_orbits_have_their_size_period_and_axes():
    orbit = Orbit.from_perigee(500.0, 0.2, radius=7500.0, inclination=0.3, mu=1e9, true_anomaly=0.4)
    assert orbit.semi_major_axis == pytest.approx(10_000.0)
    assert (orbit.mean_motion, orbit.period) == pytest.approx((np.sqrt(1e-3), 2 * np.pi / np.sqrt(1e-3)))
    assert (orbit.inclination, orbit.true_anomaly, orbit.free) == (0.3, 0.4, False)
    assert Orbit(8e6, 0.1, 0.0, np.pi / 2).C_NP() @ [1, 0, 0] == pytest.approx([0, 1, 0], abs=1e-15)
    assert Orbit(8e6, 0.1, np.pi / 2, 0.0, 0.0).C_NP() @ [0, 0, 1] == pytest.approx([0, -1, 0], abs=1e-15)
    assert Orbit(8e6, 0.1, np.pi / 2, 0.0, np.pi / 2).C_NP() @ [1, 0, 0] == pytest.approx([0, 0, 1], abs=1e-15)


REEL = Reel("reel", 1.0).effector()


def points(n: int) -> MovingPoints:
    """Moving points of no mass, of n coordinates."""
    rows = np.zeros((1, 3, n))
    one = np.zeros(1)
    return MovingPoints(np.array([1.0, 0, 0]), one, one, np.zeros((1, 3)), one, one, rows, rows, rows, rows)


def lengthening(length: Profile | str, known: bool = True, **more: object) -> Variation:
    """A variation of a rigid body's mass by a length."""
    body = rigid_body(1.0, np.eye(3))
    size = Block(body, ("mass",)).size
    table = LengthTable(length, [{(0, 0, 0): np.ones(size)}], points=points(0) if known else None, **more)
    return Variation(table, ("mass",))


def craft(varying: dict[str, Variation], **more: object) -> System:
    """A hub with a chain of two bodies and one on its other side, in a low orbit."""
    hub = rigid_body(50.0, np.eye(3), markers={"far": Marker.rigid([0, 0, 5.0])})
    part = rigid_body(1.0, 1e-3 * np.eye(3), markers={"end": Marker.rigid([3.0, 4.0, 0])})
    joints = (
        free("hub"),
        *(Joint(child, parent, kind="weld") for child, parent in (("one", "hub"), ("two", "one"), ("three", "hub"))),
    )
    more = {"orbit": Orbit(7e6, 0.01, free=True), "varying": varying, "effectors": (REEL,), **more}
    return System({"hub": hub, "one": part, "two": part, "three": part}, joints, **more)


def test_a_craft_reaches_as_far_as_its_longest_chain_of_bodies():
    assert reach(craft({}, orbit=None)) is None
    found = reach(craft({}))
    assert (found.size, found.radius) == pytest.approx((15.0, 6.93e6))
    assert (Reach(50.0, 2000.0).ratio, Reach(50.0, 2000.0).error) == pytest.approx((0.025, 0.0375))
    by_profile = lengthening(Profile.constant(20.0), bounds=(20.0, 30.0))
    by_reel = lengthening("reel.length", bounds=(0.0, 40.0), stock=90.0)
    system = craft({"three": by_reel, "two": by_profile})
    assert [longest(system, name) for name in system.bodies] == [0.0, 0.0, 30.0, 40.0]
    assert free_members(system) == ["three"]
    assert reach(system).size == pytest.approx(45.0)
    assert reach(system, {"three": 41.0, "two": 7.0}).size == pytest.approx(46.0)
    assert extent(system.bodies["one"]) == pytest.approx(5.0)


def test_attraction_is_integrated_over_large_craft_whose_moving_points_are_known():
    """The least distance from the centre is 6930 km: 693 m is large."""
    exact, gradient = Environment(attraction="exact"), Environment(attraction="gradient")
    assert not is_integrated(craft({}))
    assert is_integrated(craft({}, environment=exact))
    assert not is_integrated(craft({}, environment=exact, orbit=None))
    short, long = (lengthening("reel.length", bounds=(0.0, 40.0), stock=stock) for stock in (687.9, 688.1))
    assert not is_integrated(craft({"three": short}))
    assert is_integrated(craft({"three": long}))
    assert not is_integrated(craft({"three": long}, environment=gradient))
    unknown = lengthening(Profile.constant(1.0), known=False, bounds=(0.0, 2000.0))
    both = craft({"two": long, "three": unknown})
    assert moving_points_of(both, "two") is long.write.points
    assert [moving_points_of(both, name) for name in ("hub", "three")] == [None, None]
    assert not is_integrated(both)
    frozen = craft({"two": long, "three": unknown.without("mass")})
    assert is_integrated(frozen)


def test_a_length_table_sums_its_terms_in_the_piece_of_the_length():
    first, second = np.arange(1.0, 9.0), np.arange(8.0, 0.0, -1.0)
    pieces = [{(0, 0, 0): first, (2, 1, 0): second}, {(1, 0, 1): first}]
    table = LengthTable(Profile.constant(3.0), pieces, np.array([1.0, 4.0]), np.array([2.0, 0.5]))
    assert table.at(3.0, 5.0) == pytest.approx(first + 5.0 * second)
    assert table.at(0.0, 5.0) == pytest.approx(first + 0.25 * 5.0 * second)
    assert table.at(4.0, 5.0, 7.0) == pytest.approx(0.0 * first)
    assert table.at(5.0, 5.0, 7.0) == pytest.approx(2.0 * 7.0 * first)
    assert (table.size, table.terms) == (8, [(0, 0, 0), (1, 0, 1), (2, 1, 0)])


def test_the_numbers_of_a_length_table_are_read_run_by_run():
    """Groups of four: of three groups the first term has the outer two, the second the first two, one of them anew."""
    one, two = np.zeros(12), np.zeros(12)
    one[[0, 9]], two[[2, 5]] = [1.0, 2.0], [3.0, 4.0]
    profile = Profile.constant(3.0)
    table = LengthTable(profile, [{(-1, 0, 0): one, (2, 1, 0): two}], drum_mass=6.0)
    runs, values = table.runs
    assert runs.tolist() == [[0, 1, 0, 0], [8, 1, 0, 0], [0, 1, 1, 1], [4, 1, 1, 0]]
    assert values.tolist() == [[1, 0, 0, 0, 0, 2, 0, 0, 0, 0, 3, 0, 0, 4, 0, 0]]
    n = len(profile.numbers)
    found = table.numbers()
    assert found[:12].tolist() == [1, 2, 4, 16, -1, 2, n, 0, 0, 0, -1, 6]
    assert found[12 : 12 + n].tolist() == profile.numbers.tolist()
    assert found[12 + n :].tolist() == [0, 1, -1, 0, 0, 2, 1, 0, *runs.ravel(), *values.ravel()]
    free_length = LengthTable("reel.length", [{(0, 0, 0): one}]).numbers()
    assert free_length[:12].tolist() == [1, 1, 2, 8, 0, 0, 0, 0, 0, 0, -1, 0]
