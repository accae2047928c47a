"""Systems as they are at an instant: loads and motions frozen, rotors coasting; and sentences on what cannot rest."""

from __future__ import annotations

import numpy as np
import pytest
from support.random_systems import random_body

from femflex.body import Marker, rigid_body
from femflex.dynamics.equilibria.coasting import controlled_rotors, with_coasting_rotors
from femflex.dynamics.equilibria.frozen import frozen_system, without_damping
from femflex.dynamics.equilibria.steady import steady
from femflex.dynamics.equilibria.system_modes import without_variation
from femflex.dynamics.terms.by_source import force_units, sources
from femflex.dynamics.terms.without import changed, nearest, stiffened
from femflex.system import (
    Controller,
    Effector,
    Environment,
    Frame,
    Joint,
    Load,
    Orbit,
    Profile,
    Sensor,
    Spring,
    System,
    block,
    cable,
    control_moment_gyro,
    free,
    gain,
    knife_edge,
    reaction_wheel,
    revolute,
    signal,
    spherical,
    universal,
    weld,
)

TIMES = np.array([1.0, 2.0, 4.0])
FORCE = np.array([[1.0, -2.0, 0.5], [3.0, 0.0, 0.5], [-1.0, 4.0, 0.5]])


def hub():
    return rigid_body(2.0, [1.0, 1.2, 1.5], markers={"m": Marker.rigid(np.array([0.1, 0.2, 0.3]))})


def craft(**more) -> System:
    return System({"hub": hub(), "arm": hub()}, (free("hub"), universal("arm", "hub", name="u")), **more)


def test_loads_and_motions_stand_as_they_are_at_the_time():
    motion = (Profile.polynomial(0.1, 0.4, -0.05), None)
    loads = (Load("a", "arm", force=FORCE, torque=-2.0 * FORCE, times=TIMES), Load("b", "hub", force=FORCE[0]))
    system = System(
        {"hub": hub(), "arm": hub()}, (free("hub"), universal("arm", "hub", name="u", motion=motion)), loads=loads
    )
    at = frozen_system(system, 2.5)
    wanted = 0.75 * FORCE[1] + 0.25 * FORCE[2]
    np.testing.assert_allclose(at.loads[0].force, wanted)
    np.testing.assert_allclose(at.loads[0].torque, -2.0 * wanted)
    assert at.loads[0].times is None and at.loads[1] is loads[1]
    for time in (0.5, 4.5):  # zero before the first and after the last
        assert not frozen_system(system, time).loads[0].force.any()
    joint = at.joint_of("arm")
    value = 0.1 + 0.4 * 2.5 - 0.05 * 2.5**2
    assert joint.q0 == pytest.approx([value, 0.0]) and not joint.u0.any()
    assert joint.held[0](9.0)[0] == pytest.approx(value) and list(joint.held) == [0]


def test_what_changes_over_time_must_have_a_time():
    moving = System({"arm": hub()}, (revolute("arm", name="h", motion=(Profile.polynomial(0.1, 0.4),)),))
    with pytest.raises(ValueError, match=r"the motion of 'h.angle' changes over time, .* \(--at\)"):
        frozen_system(moving)
    for key in ("force", "torque"):
        with pytest.raises(ValueError, match="load 'push' changes over time, so there is no equilibrium under it"):
            frozen_system(craft(loads=(Load("push", "arm", times=TIMES, **{key: FORCE}),)))
    same = Load("push", "arm", times=TIMES, force=np.tile(FORCE[0], (3, 1)))
    assert frozen_system(craft(loads=(same,))).loads[0].times is None
    with pytest.raises(ValueError, match="'edge': nonholonomic constraints restrict velocities and not positions"):
        frozen_system(craft(constraints=(knife_edge("edge", "hub", [1, 0, 0]),)))
    law = Controller("law", lambda t, s, m: (np.zeros(1), m), 0.5, commands={"u": "N"})
    with pytest.raises(ValueError, match="controller 'law' is sampled, so there is no equilibrium with it"):
        steady(craft(effectors=(law,)))


def in_orbit(eccentricity=0.0, frame="orbital", **more) -> System:
    joints = (spherical("hub"), weld("arm", "hub"))
    return System({"hub": hub(), "arm": hub()}, joints, orbit=Orbit(7e6, eccentricity), frame=Frame(frame), **more)


def push(frame, **what) -> Load:
    return Load("push", "arm", frame=frame, **(what or {"force": FORCE[0]}))


SPIN = Frame("spinning", np.array([0.0, 0.3, 0.4]))
TURNS = {
    "ellipse": (in_orbit(0.25), "the orbit's eccentricity is 0.25, and gravity and its frame's rate change along it"),
    "inertial in orbit": (
        in_orbit(frame="inertial"),
        "the attitude is measured from the inertial frame, in which the direction of gravity turns once per orbit",
    ),
    "gravity across": (
        craft(frame=SPIN, environment=Environment([0.0, 0.0, -2.0])),
        "gravity [0.0, 0.0, -2.0] m/s^2 changes its direction in the frame that spins at [0.0, 0.3, 0.4] rad/s",
    ),
    "inertial load in orbit": (
        in_orbit(loads=(push("inertial"),)),
        "load 'push' keeps its direction in the inertial frame, relative to which the orbital frame turns",
    ),
    "inertial torque in spin": (
        craft(frame=SPIN, loads=(push("inertial", torque=FORCE[0]),)),
        "load 'push' keeps its direction in the inertial frame, relative to which the spinning frame turns",
    ),
}


@pytest.mark.parametrize("what", TURNS)
def test_what_turns_in_the_base_frame_keeps_it_from_rest(what):
    system, text = TURNS[what]
    with pytest.raises(ValueError) as error:
        frozen_system(system)
    assert text in str(error.value)


def test_what_turns_along_may_rest():
    for system in (
        craft(frame=SPIN, environment=Environment([0.0, -3.0, -4.0])),
        craft(environment=Environment([0.0, 0.0, -2.0]), loads=(push("inertial"),)),
        craft(frame=SPIN, loads=(push("body"), push("marker"))),
        craft(frame=SPIN, loads=(push("inertial", force=np.zeros(3)),)),
        in_orbit(1e-10, loads=(push("orbital"),)),
    ):
        assert frozen_system(system).loads == system.loads


def test_without_damping_nothing_is_damped_and_all_else_stays():
    arm, _ = random_body(np.random.default_rng(2), 3)
    joints = (free("hub", damping=0.3), revolute("arm", "hub", stiffness=5.0, damping=0.2))
    springs = (Spring("s", "hub", "arm", stiffness=4.0, damping=0.7, length=0.3),)
    found = without_damping(System({"hub": hub(), "arm": arm}, joints, springs=springs))
    assert not any(joint.damping.any() for joint in found.joints) and found.joint_of("arm").stiffness == [5.0]
    assert found.springs[0] == Spring("s", "hub", "arm", stiffness=4.0, length=0.3)
    assert not found.bodies["arm"].damping.any() and found.bodies["arm"].strain is arm.strain


def test_what_varies_is_left_out_by_name_and_motions_stay_where_they_begin():
    motion = (0.3, Profile.polynomial(0.1, 0.4))
    joints = (free("hub"), universal("arm", "hub", name="u", motion=motion), revolute("leg", "hub", motion=(0.5,)))
    loads = (push("body"), Load("ramp", "hub", force=FORCE, times=TIMES))
    still, names = without_variation(System({"hub": hub(), "arm": hub(), "leg": hub()}, joints, loads=loads))
    assert names == ("load 'ramp'", "motion of 'u'") and still.loads == loads[:1]
    joint = still.joint_of("arm")
    assert [float(joint.held[k](7.0)[0]) for k in (0, 1)] == pytest.approx([0.3, 0.1]) and not joint.u0.any()
    assert still.joint_of("leg") is joints[2]


def test_rotors_coast_with_their_momentum_of_the_start_unless_something_takes_their_signals():
    spin = {"axis": (0.0, 0.6, 0.8), "marker": "m"}
    wheels = (
        reaction_wheel("w", "hub", 0.5, initial_speed=20.0, **spin),
        reaction_wheel("seen", "hub", 0.5, initial_speed=10.0),
        control_moment_gyro("g", "arm", 3.0, rates=[0.1], initial_angles=[0.7]),
        reaction_wheel("kept", "arm", 0.2, initial_speed=5.0),
    )
    tach = Sensor("tach", "value", signal="seen.speed").effectors
    rate = np.array([0.1, -0.2, 0.4])
    system = System(
        {"hub": hub(), "arm": hub()}, (free("hub", u0=[0.0, 0.0, 0.0, *rate]), weld("arm", "hub")),
        effectors=(*wheels, *tach), z0={"g.angle": 0.9},
    )  # fmt: skip
    found = with_coasting_rotors(system, ("kept",))
    assert [(e.name, e.act) for e in found.effectors] == [
        ("w", "rotor"), ("seen", "wheel"), ("g", "rotor"), ("kept", "wheel"), ("tach", "measure")
    ]  # fmt: skip
    axis = np.array([0.0, 0.6, 0.8])
    np.testing.assert_allclose(found.effectors[0].parameters, [*axis, 0.5 * (20.0 + axis @ rate)])
    np.testing.assert_allclose(found.effectors[2].parameters, [np.cos(0.9), np.sin(0.9), 0.0, 3.0], atol=1e-12)
    assert "g.angle" not in found.z0
    plain = craft()
    assert with_coasting_rotors(plain) is plain


def test_a_rotor_is_controlled_where_what_sensors_measure_comes_to_it_by_any_way():
    gyro = Sensor("gyro", "rate", "hub").effectors
    aim = signal("aim", [0.0, 1.0], [0.0, 2.0])
    law = block("law", gain([[2.0, -1.0]]), ("aim.value", "gyro.x"), ("u",))
    other = block("other", gain([[2.0]]), ("law.u",), ("u",))
    apart = block("apart", gain([[1.0]]), ("w3.momentum",), ("u",))
    wheels = tuple(
        reaction_wheel(name, "hub", 0.5, torque=torque)
        for name, torque in (("w1", "other.u"), ("w2", 0.3), ("w3", "apart.u"), ("w4", "gyro.y"))
    )
    system = craft(effectors=(*gyro, aim, law, other, apart, *wheels))
    assert controlled_rotors(system) == ["w1", "w4"]


def test_a_part_is_switched_off_by_its_own_name_alone():
    loops, edges = (
        (revolute("arm", "hub", name="c1"), weld("leg", "hub", name="c2")),
        (knife_edge("e", "hub", [1, 0, 0]),),
    )
    soft, _ = random_body(np.random.default_rng(4), 2)
    bodies = {"hub": hub(), "arm": soft, "leg": soft, "far": soft}
    system = System(
        bodies, (free("hub"), *(revolute(b, "hub") for b in ("arm", "leg", "far"))), loops=loops, constraints=edges,
        loads=(push("body"), Load("pull", "hub")), springs=(Spring("s", "hub", "arm"), Spring("t", "hub", "leg")),
        delta0={"arm": np.ones(2), "leg": 2.0 * np.ones(2)}, ddelta0={"leg": np.ones(2)},
        segments={"boom": ("arm", "far")},
    )  # fmt: skip
    assert [loop.label for loop in changed(system, "loops/c1").loops] == ["c2"]
    assert changed(system, "constraints/e").constraints == ()
    assert [load.name for load in changed(system, "loads/push").loads] == ["pull"]
    assert [spring.name for spring in changed(system, "springs/t").springs] == ["s"]

    def shapes(found):
        return {name: body.n_modes for name, body in found.bodies.items()}

    assert shapes(changed(system, "flexibility")) == dict.fromkeys(bodies, 0)
    one = changed(system, "flexibility/leg")
    assert shapes(one) == {"hub": 0, "arm": 2, "leg": 0, "far": 2}
    assert list(one.delta0) == ["arm"] and not one.ddelta0
    assert shapes(changed(system, "flexibility/boom")) == {"hub": 0, "arm": 0, "leg": 2, "far": 0}
    rigid = stiffened(system, {"arm"}).bodies["arm"]
    assert rigid.moments.mass == soft.moments.mass and rigid.damping.shape == (0, 0)
    np.testing.assert_allclose(rigid.moments.inertia(), soft.moments.inertia())


def test_the_nearest_name_is_told_in_full():
    known = ["gyroscopic", "loads/push", "flexibility/boom"]
    assert nearest("gyroscopc", known) == "gyroscopic" and nearest("loads/pusch", known) == "loads/push"
    assert nearest("pusch", known) == "loads/push" and nearest("zzz", known) == ""


def test_sources_and_units_go_with_the_quasi_velocities():
    soft, _ = random_body(np.random.default_rng(4), 2)
    slide = Joint("arm", "hub", name="j", translations=[[1.0, 0.0, 0.0]], rotations=[[0.0, 0.0, 1.0]])
    system = System({"arm": soft, "hub": hub(), "top": soft}, (slide, weld("top", "arm"), spherical("hub")))
    assert sources(system) == {"base-hub": slice(0, 3), "j": slice(3, 5), "arm": slice(5, 7), "top": slice(7, 9)}
    assert force_units(system) == ["N m"] * 3 + ["N", "N m"] + ["kg^1/2 m/s^2"] * 4


def test_an_effector_without_a_word_of_a_rotor_is_left_as_it_is():
    plain = Effector("e", lambda seen, out: None)
    system = craft(effectors=(plain,))
    assert with_coasting_rotors(system) is system and controlled_rotors(system) == []


@pytest.mark.parametrize(
    ("lengths", "told"),
    [
        (
            (Profile.smooth_step(0, 10, 0.6, 0.4), 0.5),
            r"needs constant forces; --at .*change over time: cable 'a'\. Give",
        ),
        (
            (Profile.sine(0.1, 2.0, mean=0.5), Profile.sine(0.1, 3.0, mean=0.5)),
            r"over time: cable 'a', cable 'b'\. Give",
        ),
    ],
)
def test_cables_whose_length_changes_are_named_with_what_to_do(lengths, told):
    held = revolute("arm", "hub", axis=[0, 0, 1], stiffness=3.0)
    ends = (("hub", "m"), ("arm", "far"))
    far = rigid_body(1.0, [0.1, 0.1, 0.1], markers={"far": Marker.rigid(np.array([0.1, 1.2, 0.3]))})
    cables = tuple(cable(name, ends, length, 100.0) for name, length in zip("ab", lengths, strict=True))
    system = System({"hub": hub(), "arm": far}, (weld("hub"), held), effectors=cables)
    for at in (None, 3.0):
        with pytest.raises(ValueError, match=told):
            steady(system, at)
