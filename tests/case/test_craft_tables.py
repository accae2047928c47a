"""Wheels, thrusters, tanks, sensors and controllers of a case: what they make, and what is refused in a sentence."""

from __future__ import annotations

import numpy as np
import pytest

import femflex as package
from femflex.case import CaseError
from femflex.case.read import parse_case
from femflex.pipeline import prepare

WHEEL = '[wheels.w]\nbody = "hub"\ninertia = 0.2\ninertia_in_body = "contained"\n'
JET = '[thrusters.jet]\nbody = "hub"\nthrust = 2\n'
RIGID = """
[run]
duration = "10 s"
output_step = 0.05

[attitude]
rates = ["2 deg/s", 0, 0.01]

[bodies.hub]
kind = "rigid"
mass = 200
inertia = [120, 100, 140]
markers.left = { position = [0.5, 0, 0] }
"""
LAW = '[sensors.star]\nkind = "attitude"\nbody = "hub"\n[sensors.gyro]\nkind = "rate"\nbody = "hub"\n'


@pytest.mark.parametrize(
    ("more", "said"),
    [
        (WHEEL.replace("hub", "hull"), "wheels.w.body: found 'hull', which is not a body"),
        (WHEEL + 'marker = "lefft"\n', "wheels.w.marker: found 'lefft'.*did you mean 'left'"),
        (WHEEL.replace("contained", "added"), "without mass and transverse_inertia; give both"),
        (WHEEL + "mass = 3\n", "the body holds it already, so drop it"),
        (WHEEL + 'torque = 1\ncommand = "law.x"\n', "found torque and command together"),
        (WHEEL + "initial_speed = 9\nmax_speed = 5\n", "beyond max_speed 5 rad/s"),
        (JET, "found none of pulses, train, profile, command"),
        (JET + 'pulses = [[0, 1]]\ntank = "t"\n', "found tank 't' without specific_impulse"),
        (JET + "pulses = [[0, 1]]\nswitched = true\n", "pulses are on-off already"),
        ('[sensors.s]\nkind = "rate"\nbody = "hub"\nnoise = 0.1\n', "found noise without period"),
        ('[sensors.s]\nkind = "joint"\n', "found no coordinate for a sensor of kind 'joint'"),
        ('[sensors.s]\nkind = "rate"\nbody = "hub"\noffset = [0, 0, 1]\n', "it belongs to displacement"),
        ('[sensors.s]\nkind = "rate"\nbody = "hub"\nbias = [1]\n', "found 1 number in bias"),
        ('[signals.s]\ntimes = [1, 0]\nvalues = [1, 2]\n', "they must rise"),
        ('[controllers.p]\nkind = "pulses"\ninputs = ["a.b"]\noutputs = ["o"]\nfull = 1\n'
         'period = 0.1\nminimum_on = 0.2\n',
         "it must be shorter"),
        ('[controllers.p]\nkind = "pdd"\n', "pdd"),
        ('[controllers.p]\nkind = "allocation"\ninputs = ["a.b"]\neffect = [[1, 2], [3]]\n',
         "row 1 has 2 and row 2 has 1 numbers"),
        (WHEEL + "torque = nan\n", "must be finite"),
    ],
)  # fmt: skip
def test_mistakes_of_a_table_are_told_when_it_is_read(more, said):
    with pytest.raises(CaseError, match=said):
        parse_case(RIGID + more)


@pytest.mark.parametrize(
    ("more", "said"),
    [
        (WHEEL.replace("0.2", "500"), "wheels.w: without the inertia removed at marker 'origin' the body has a"),
        (JET + 'pulses = [[0, 1]]\nspecific_impulse = 200\ntank = "tnk"\n[tanks.tank]\nbody = "hub"\npropellant = 1\n'
         'mass_in_body = "added"\n', "found tank 'tnk', which is not in .tanks.; did you mean 'tank'"),
        ('[tanks.tank]\nbody = "hub"\npropellant = 1\nmass_in_body = "added"\n', "no thruster draws from tank 'tank'"),
        (WHEEL + 'command = "law.x"\n', "wheels.w.command: found 'law.x', which is no signal; known are 'w.friction'"),
        (LAW + '[controllers.law]\nkind = "pd"\ninputs = ["star", "gyros"]\nstiffness = 1\ndamping = 1\n',
         "controllers.law: found 'gyros', which is no sensor, controller or signal; did you mean 'gyro'"),
        (LAW + '[controllers.law]\nkind = "pd"\ninputs = ["star", "gyro"]\nstiffness = [1, 2]\ndamping = 1\n',
         "found 2 numbers where 3 channels are"),
        (LAW + '[controllers.law]\nkind = "pd"\ninputs = ["star", "gyro.x", "gyro.y"]\nstiffness = 1\ndamping = 1\n',
         "kind 'pd' takes errors, then as many rates; found 5 inputs. Give an even number"),
        (LAW + '[controllers.law]\nkind = "pid"\ninputs = ["star.x"]\nstiffness = 1\nintegral = 1\ndamping = 1\n',
         "kind 'pid' takes errors, then as many rates; found 1 inputs. Give an even number"),
        (LAW + '[controllers.law]\nkind = "pd"\ninputs = ["star.w", "gyro.x"]\nstiffness = 1\ndamping = 1\n',
         "controllers.law.inputs: found 'star.w', which is no signal; did you mean 'star."),
        (LAW + '[controllers.law]\nkind = "pd"\ninputs = ["star.w", "gyro.x"]\nstiffness = 1\n'
         'damping = 1\nperiod = 0.1\n',
         "controllers.law.inputs: found 'star.w', which is no signal; did you mean 'star."),
        (LAW + '[sensors.seen]\nkind = "value"\nsignal = "gyro"\n', "sensors.seen.signal: found .gyro., which is"),
        (LAW + '[controllers.law]\nkind = "gain"\ninputs = ["gyro.x"]\nmatrix = [[1]]\nperiod = 1e-12\n',
         "would call it .* times; the most is 1e.07"),
        (LAW.replace('body = "hub"\n[sensors.gyro]', 'body = "hub"\nperiod = "1e-9 s"\n[sensors.gyro]'),
         "'star' has a period of 1e-09 s, so a run of 10 s would call it 1e.10 times"),
        (JET + 'train = { period = 1, width = 0.5, count = 100000000 }\n',
         "thrusters.jet: found 1e.08 pulses of one thruster; the most is 100000"),
        (JET + 'pulses = [[0, 1]]\nspecific_impulse = 200\ntank = "t"\n[tanks.t]\nbody = "hub"\npropellant = 150\n'
         'mass_in_body = "contained"\ngyration = 1\n',
         "tanks t leave a principal inertia of -50 kg m.2 when they are empty"),
        (LAW + '[controllers.law]\nkind = "gain"\ninputs = ["gyro.x", "gyro.y"]\nmatrix = [[1, 0], [0, 1]]\n'
         'outputs = ["a", "a"]\n', "outputs of 'law' hold 'a' twice"),
        (JET + 'pulses = [[0, 1], [0.5, 1]]\n', "thrusters.jet: pulse 2 of thruster 'jet' starts at 0.5 s"),
        ('[controllers.a]\nkind = "gain"\ninputs = ["b.y"]\nmatrix = [[1]]\n'
         '[controllers.b]\nkind = "gain"\ninputs = ["a.y"]\nmatrix = [[1]]\n', "algebraic loop: a -> b -> a"),
        (WHEEL + WHEEL.replace("wheels.w", "thrusters.w").replace("inertia = 0.2\ninertia_in_body = \"contained\"",
         "thrust = 1\npulses = [[0, 1]]"), "2 effectors have the name 'w'"),
    ],
)  # fmt: skip
def test_mistakes_between_tables_are_told_before_the_run(more, said):
    with pytest.raises(ValueError, match=said):
        prepare(parse_case(RIGID + more))


def test_events_of_a_model_are_made_once():
    jet = JET + 'profile = { times = [1], levels = [1] }\nspecific_impulse = 20\ntank = "tank"\n'
    tank = '[tanks.tank]\nbody = "hub"\npropellant = 0.03\nmass_in_body = "contained"\n'
    model = prepare(parse_case(RIGID + jet + tank)).model
    assert model.events is model.events and len(model.events.values(0.0, model.x0)) == 1


def test_an_empty_tank_is_an_event_that_the_run_reports(write_case, femflex, tmp_path):
    jet = JET + 'profile = { times = [1], levels = [1] }\nspecific_impulse = 20\ntank = "tank"\n'
    tank = '[tanks.tank]\nbody = "hub"\npropellant = "0.03 kg"\nmass_in_body = "contained"\n'
    code, out, _ = femflex("run", write_case(RIGID + jet + tank), "-o", tmp_path / "a.h5")
    empty = 1.0 + 0.03 * 20 * 9.80665 / 2.0
    assert code == 0 and f"tank        tank was empty at t = {empty:.7g}" in out
    assert "Propellant of tank tank, 0.03 kg, is contained in the mass of hub." in out


def test_a_run_with_wheels_and_samples_resumes_bit_for_bit_from_the_command_line(write_case, femflex, tmp_path):
    """Everything that acts is in the case, so no Python is needed to go on."""
    loop = LAW.replace(
        'kind = "rate"\nbody = "hub"\n', 'kind = "rate"\nbody = "hub"\nperiod = 0.2\nnoise = 0.01\ndelay = 0.3\n'
    )
    loop += '[controllers.law]\nkind = "pid"\ninputs = ["star.z", "gyro.z"]\nstiffness = 2\nperiod = 0.2\n'
    loop += "integral = 0.1\ndamping = 4\n"
    case = write_case(RIGID + loop + WHEEL + 'command = "law.y"\n')
    whole = package.run(case, tmp_path / "whole.h5")
    assert whole.attributes["effectors"] == "" and len(whole.names("z")) > 8

    def stop(t):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        package.run(case, tmp_path / "part.h5", progress=stop)
    code, _, said = femflex("run", case, "-o", tmp_path / "part.h5", "--resume")
    assert code == 0, said
    from femflex.results import open_run

    with open_run(tmp_path / "part.h5") as rest:
        for path in ("q", "u", "z", "monitors/energy", "effectors/gyro/z"):
            assert np.array_equal(rest[path], whole[path]), path


def test_terms_and_modes_of_a_case_with_wheels(write_case, femflex, tmp_path):
    case = write_case(RIGID + WHEEL + "initial_speed = 50\n")
    package.run(case, tmp_path / "a.h5")
    code, out, said = femflex("terms", tmp_path / "a.h5", "--json")
    assert code == 0 and "effectors/w" in out, said
    code, out, said = femflex("modes", case)
    assert code == 0, said


def test_a_wheel_keeps_its_speed_in_a_craft_that_starts_in_equilibrium(write_case, craft, tmp_path):
    text = craft[: craft.index("[[loads]]")].replace('rates = ["2 deg/s", 0, 0.01]', "")
    text = text.replace('initial = { marker = "tip", displacement = [0, "10 mm", 0] }', "")
    case = write_case(text + '[initial]\nfrom = "equilibrium"\n' + WHEEL + "initial_speed = 50\n")
    with package.run(case, tmp_path / "run.h5") as run:
        assert run["effectors/w/speed"] == pytest.approx(50.0, rel=1e-9)


def test_a_joint_that_is_released_by_a_spring(tmp_path):
    """Locked until 2 s, then pushed off: what the run says, and momentum."""
    text = (
        RIGID.replace('rates = ["2 deg/s", 0, 0.01]', "")
        + """
[bodies.ball]
kind = "rigid"
mass = 1
inertia = [0.1, 0.1, 0.1]

[[joints]]
name = "latch"
kind = "general"
parent = "hub"
parent_marker = "left"
child = "ball"
slides = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]
turns = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]
position = [0.1, 0, 0]
release = "2 s"

[separations.spring]
body = "ball"
parent = "hub"
parent_marker = "left"
stiffness = 200
length = 0.2
"""
    )
    with package.run(parse_case(text), tmp_path / "run.h5") as run:
        distance, t = run["effectors/spring/distance"], run.time
        assert distance[t <= 2.0] == pytest.approx(0.1) and distance[-1] > 5.0
        assert np.abs(run["monitors/momentum"]).max() < 1e-12
        speed = np.diff(distance)[-1] / np.diff(t)[-1]
        assert speed == pytest.approx(0.1 * np.sqrt(200 * (1 / 1 + 1 / 200)), rel=1e-6)  # l sqrt(k / mu)
    at_speed = (
        text.replace('release = "2 s"', 'release_at = { signal = "clock.value", above = 1.5 }')
        + """
[signals.clock]
kind = "linear"
times = [0, 10]
values = [0, 5]
"""
    )
    with package.run(parse_case(at_speed), tmp_path / "at.h5") as run:
        distance, t = run["effectors/spring/distance"], run.time
        assert distance[t <= 3.0] == pytest.approx(0.1) and distance[t > 3.0].min() > 0.1
        assert np.abs(run["monitors/momentum"]).max() < 1e-12
    with pytest.raises(
        ValueError, match=r"joints\[latch\].release_at.signal: found 'clok.value', which is no signal; did you"
    ):
        prepare(parse_case(at_speed.replace("clock.value", "clok.value")))
    with pytest.raises(ValueError, match="found release and release_at together; give one of them"):
        prepare(parse_case(at_speed.replace("release_at", "release = 2\nrelease_at")))
    with pytest.raises(ValueError, match="found none of above, below; give one of them"):
        prepare(parse_case(at_speed.replace(", above = 1.5", "")))
    with pytest.raises(ValueError, match="a release needs a joint of slides and single turns"):
        prepare(parse_case(text.replace("general", "free").replace("slides =", "#").replace("turns =", "#")))


def test_an_imbalance_is_that_of_the_rotor_in_python():
    from femflex.assembly import build_bodies
    from femflex.system import unbalanced_rotor

    text = """
[run]
duration = 1
output_step = 0.1
[bodies.rotor]
kind = "rigid"
mass = 2
inertia = [0.01, 0.01, 0.018]
imbalance = { static = "4e-4 kg m", dynamic = "1e-6 kg m^2" }
"""
    found = build_bodies(parse_case(text))["rotor"].moments
    wanted = unbalanced_rotor(2.0, 0.018, 0.01, 4e-4, 1e-6).moments
    assert found.first == pytest.approx(wanted.first) and found.second == pytest.approx(wanted.second, abs=1e-15)
