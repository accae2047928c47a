"""Which strain a body gets by what loads, torques and prescribed motions will do to it, estimated before the run."""

from __future__ import annotations

import warnings

import numpy as np
import pytest
from support.advised_bodies import noted_body, noted_system

import femflex
from femflex.advice.deflections import deflection_watches
from femflex.advice.motion_estimate import estimate_motion
from femflex.case import read_case
from femflex.pipeline.case_bodies import with_own_strain
from femflex.warning import PhysicsWarning

LENGTH, EI, LINE = 10.0, 1.4e4, 1.2
BEAM = f"""
[run]
duration = 20
output_step = 0.05
[bodies.boom]
kind = "analytic"
length = {LENGTH}
mass_per_length = {LINE}
EA = 2.8e7
EIy = {EI}
EIz = {EI}
GJ = 1e4
functions = {{ y = 4, z = 4 }}
"""
WELD = '[[joints]]\nkind = "weld"\nchild = "boom"\n'
HUB = """
[bodies.hub]
kind = "rigid"
mass = 1000
inertia = [500, 500, 500]
[[joints]]
kind = "{}"
child = "hub"
[[joints]]
kind = "{}"
parent = "hub"
child = "boom"
"""
FIRST = 3.5160 * np.sqrt(EI / (LINE * LENGTH**4))  # rad/s


def load(value, times=None, key="force", body="boom", marker="tip"):
    """A load along y, or a torque about z, by its values at these times."""
    place = (0, 1, 0) if key == "force" else (0, 0, 1)
    rows = [[value * one for one in place]] if times is None else [[v * one for one in place] for v in value]
    told = f"{key} = {rows[0]}" if times is None else f"{key} = {rows}\ntimes = {list(times)}"
    return f'[[loads]]\nname = "push"\nbody = "{body}"\nmarker = "{marker}"\n{told}\n'


def boom(write_case, text):
    return noted_system(read_case(write_case(text))).bodies["boom"]


def bend(write_case, text):
    """The largest bend of the boom that is estimated, linear, over its length."""
    said = text.replace("functions =", 'strain = "linear"\nfunctions =')
    case = read_case(write_case(said))
    view = estimate_motion(noted_system(case), case.run.duration)
    (found,) = deflection_watches(view.model)
    found.moved(view.bent)
    return found.reached


def warned(write_case, text, tmp_path):
    """What a run says of bends."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", PhysicsWarning)
        femflex.run(write_case(text), tmp_path / "run.h5", force=True).close()
    return [str(w.message) for w in caught if "displaced by" in str(w.message)]


@pytest.mark.slow
def test_a_force_counts_twice_that_comes_suddenly_and_once_that_comes_slowly(write_case):
    """F L^3 / 3 EI; four modes bend by a little less."""
    static = 10.0 * LENGTH**2 / (3 * EI)
    assert bend(write_case, BEAM + WELD + load(10.0)) == pytest.approx(2 * static, rel=0.03)
    slow = load([0, 10, 10], [0, 18, 20])
    assert bend(write_case, BEAM + WELD + slow) == pytest.approx(static, rel=0.03)


def test_a_force_in_time_with_the_first_mode_counts_for_more_than_twice(write_case):
    """y'' + w^2 y = f sin(w t) grows as f t / 2 w: after n periods to pi n times its static answer."""
    times = np.linspace(0, 8 * np.pi / FIRST, 65)
    text = BEAM + WELD + load((1.0 * np.sin(FIRST * times)).tolist(), times.tolist())
    static = LENGTH**2 / (3 * EI) * 0.9707  # of the first mode
    assert bend(write_case, text) == pytest.approx(4 * np.pi * static, rel=0.05)


def test_a_short_pulse_late_in_a_long_run_is_foreseen(write_case):
    """An impulse J at the tip gives the first mode, of mass m L / 4, the amplitude J / (m L / 4) w; higher ones add."""
    long = BEAM.replace("duration = 20", "duration = 2000")
    pulse = long + WELD + load([0, 100, 100, 0], [1500, 1500, 1500.1, 1500.1])
    expected = 10.0 / (LINE * LENGTH / 4) / FIRST / LENGTH
    assert expected < bend(write_case, pulse) < 1.5 * expected


@pytest.mark.slow
@pytest.mark.parametrize(
    ("loads", "strain"),
    [
        (load(2.0), "linear"),
        (load(25.0), "condensed"),
        (load([0, 12, 12], [0, 18, 20]), "linear"),
        (load([0, 50, 50], [0, 18, 20]), "condensed"),
    ],
)
def test_a_body_that_loads_bend_far_is_condensed_and_its_run_does_not_warn(loads, strain, write_case, tmp_path):
    text = BEAM + WELD + loads
    body = boom(write_case, text)
    assert body.strain_form == strain and ("may bend it by" in body.note) == (strain == "condensed")
    assert not warned(write_case, text, tmp_path)
    if strain == "condensed":
        (said,) = warned(write_case, text.replace("functions =", 'strain = "linear"\nfunctions ='), tmp_path)
        found = float(said.split(" m, ")[1].split("%")[0]) / 100
        assert found == pytest.approx(bend(write_case, text), abs=0.006)


@pytest.mark.slow
def test_a_torque_pulse_counts_by_the_bend_and_by_the_spin_it_leaves(write_case):
    def craft(torque):
        pulse = load([0, 0, torque, torque, 0], [0, 1, 1, 3, 3], "torque", "hub", "origin")
        return BEAM + HUB.format("free", "weld") + pulse

    weak, strong = boom(write_case, craft(20.0)), boom(write_case, craft(1500.0))
    assert weak.strain_form == "linear" and strong.strain_form == "condensed"
    c = LENGTH / 2 * LINE * LENGTH / (1000 + LINE * LENGTH)  # about the centre of mass of the whole
    J = 500 + LINE * LENGTH**3 / 3 - (1000 + LINE * LENGTH) * c**2
    told = float(strong.note.split("turning at ")[1].split(" rad/s")[0])
    assert told == pytest.approx(2 * 1500 / J, rel=2e-3)


@pytest.mark.parametrize(("end", "strain"), [(15, "linear"), (3, "condensed")])
def test_a_slew_is_linear_where_it_is_slow_and_condensed_where_it_is_hard(end, strain, write_case):
    motion = f'motion.angle = {{ kind = "smooth_step", from = 0, to = "20 deg", start = 0, end = {end} }}\n'
    assert boom(write_case, BEAM + HUB.format("weld", "revolute") + 'axis = "z"\n' + motion).strain_form == strain


def test_a_shaken_base_bends_what_hangs_on_it(write_case):
    """At a third of the first frequency the tip goes by the base's acceleration over w^2 - w_b^2, times 1.566."""
    rate = FIRST / 3
    shaken = (
        BEAM + '[[joints]]\nkind = "prismatic"\naxis = "y"\nchild = "boom"\nmotion.position = '
        f'{{ kind = "sine", amplitude = 0.3, frequency = "{rate / (2 * np.pi)} Hz" }}\n'
    )
    steady = 1.566 * 0.3 * rate**2 / (FIRST**2 - rate**2) / LENGTH
    assert steady < bend(write_case, shaken) < 3 * steady  # what the start sets going adds to it


def test_how_far_a_motion_is_foreseen_is_told_where_it_costs_too_much(write_case, monkeypatch):
    monkeypatch.setattr("femflex.advice.motion_estimate.MOST_RATES", 500)
    stiff = '[[joints]]\nkind = "revolute"\nchild = "boom"\naxis = "z"\nrate = 0.001\nstiffness = "4e7 N m/rad"\n'
    note = boom(write_case, BEAM + stiff).note
    assert note.startswith("strain is linear") and "(estimated up to t = " in note and "the run checks it" in note


@pytest.mark.slow
def test_a_body_that_is_bound_to_be_linear_is_told_why(write_case, craft):
    pushed = craft.replace('damping = { ratio = "0.5 %" }\n', "").replace("[0, 0, 1]", "[0, 0, 2000]")
    modes = '{ method = "cantilever", clamp = "ROOT", modes = 4 }'
    assert boom(write_case, pushed).strain_form == "condensed"
    nodal = boom(write_case, pushed.replace(modes, '{ method = "nodal", clamp = "ROOT" }'))
    assert nodal.strain_form == "linear" and "its reduction method 'nodal' has no other form" in nodal.note
    bare = boom(write_case, pushed.replace(modes, modes.replace("4 }", '4, derivatives = "none" }')))
    assert (
        bare.strain_form == "linear"
        and "with derivatives = 'none' its shapes cannot bend without stretching" in bare.note
    )


@pytest.mark.slow
def test_a_body_alone_has_the_strain_that_it_has_in_its_system(write_case):
    text = BEAM + WELD + load(25.0)
    case = read_case(write_case(text))
    alone, placed = noted_body(case, "boom"), noted_system(case).bodies["boom"]
    assert alone.strain_form == placed.strain_form == "condensed" and alone.note == placed.note
    assert with_own_strain(case).bodies["boom"].strain == "condensed"
    assert noted_body(case, "boom", modes=2).strain_form == "condensed"


def test_a_body_of_a_system_that_cannot_be_built_is_linear_and_says_so(write_case):
    other = """
[bodies.other]
kind = "flexible"
mesh = "boom.inp"
members = [{ group = "NOPE", family = "lumped" }]
reduction = { method = "cantilever", clamp = "ROOT", modes = 1 }
[[joints]]
kind = "weld"
child = "other"
"""
    broken = BEAM + other + WELD + load(25.0)
    body = noted_body(read_case(write_case(broken)), "boom")
    assert body.strain_form == "linear" and "its system cannot be built for a motion estimate (" in body.note


@pytest.mark.slow
def test_verbs_on_a_body_say_the_strain_and_why(femflex, write_case):
    path = write_case(BEAM + WELD + load(25.0))
    for words in (("modes", path), ("body", path, "boom", "-o", "boom.h5")):
        code, out, _ = femflex(*words)
        assert code == 0 and "condensed" in out and "may bend it by" in " ".join(out.split())
