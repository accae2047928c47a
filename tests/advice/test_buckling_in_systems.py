"""Total load of bodies in a system over their buckling load: weight, thrust, spin and attached bodies together.

A clamped column buckles under a load at its tip at P L^2 = pi^2 / 4 EI (Euler), under its own weight q per length at
q L^3 = 7.837 EI (Greenhill, 1881), and flutters under a load that follows its tip at P L^2 = 20.05 EI (Beck, 1952).
"""

from __future__ import annotations

import re
import warnings

import numpy as np
import pytest
from support.advised_bodies import noted_system

from femflex.advice.bodies import KnownBodies
from femflex.advice.buckling.margin import buckling_margins
from femflex.advice.motion_estimate import estimate_rigid_motion
from femflex.assembly.bodies import built_bodies
from femflex.assembly.system import system_of
from femflex.case import read_case
from femflex.pipeline.decisions import decided
from femflex.warning import PhysicsWarning

L, EI, LINE = 3.0, 1.0e4, 1.0
EULER, WEIGHT, BECK = np.pi**2 / 4 * EI / L**2, 7.837 * EI / L**2, 20.051 * EI / L**2  # N, all of them
RUN = "[run]\nduration = 1\nsamples = 11\n"
TABLE = f"""kind = "analytic"
length = {L}
mass_per_length = {LINE}
EA = 1e8
EIy = {{EIy}}
EIz = {EI}
GJ = 1.2e3
ry = 0.01
rz = 0.01
functions = {{{{ y = 4, z = 4 }}}}
strain = "linear"
"""
BOOM = "[bodies.boom]\n" + TABLE.format(EIy=2 * EI)
SAID = 'strain = "linear"\n'
HELD = '[[joints]]\nkind = "weld"\nchild = "boom"\n'


def rigid(name, mass, joint, at=0.0, **where):
    told = "".join(f'{key} = "{value}"\n' for key, value in where.items())
    return (
        f'[bodies.{name}]\nkind = "rigid"\nmass = {mass}\ninertia = [500, 500, 500]\ncenter_of_mass = [{at}, 0, 0]\n'
        f'[[joints]]\nkind = "{joint}"\nchild = "{name}"\n{told}'
    )


HUB = rigid("hub", 1000.0, "free") + HELD + 'parent = "hub"\n'
TIP = rigid("tip", 500.0, "weld", parent="boom", parent_marker="tip")


def load(force, body="boom", marker="tip", frame="body", name="push", more=""):
    where = f'[[loads]]\nname = "{name}"\nbody = "{body}"\nmarker = "{marker}"\nframe = "{frame}"\n'
    return where + (more or f"force = {[float(f) for f in force]}\n")


def gravity(g):
    return f"[environment]\ngravity = [{g}, 0, 0]\n"


@pytest.fixture
def near(write_case):
    """What is reported of the boom of a case, where it bears a quarter of what buckles it or more."""

    def found(text):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", PhysicsWarning)
            case = read_case(write_case(RUN + text))
            built = built_bodies(case)
            system = system_of(case, {name: one.part for name, one in built.items()})
            known = KnownBodies({name: one.origin for name, one in built.items() if one.origin is not None})
            return buckling_margins(estimate_rigid_motion(system, 1.0)[0], system, known).get("boom")

    return found


def test_the_weight_of_a_standing_column_counts_and_that_of_a_hanging_one_does_not(near):
    g = 0.5 * WEIGHT / L / LINE
    standing = near(gravity(-g) + BOOM + HELD)
    assert standing.part == pytest.approx(0.5, rel=2e-3)
    assert str(standing).startswith("its own inertia and weight (4354 N) is 0.5 of the linear buckling load")
    assert near(gravity(g) + BOOM + HELD) is None


def test_thrust_on_the_hub_presses_a_boom_by_its_own_inertia(near):
    thrust = 0.5 * WEIGHT / (L * LINE) * (1000 + L * LINE)
    assert near(HUB + BOOM + load([thrust, 0, 0], "hub", "origin")).part == pytest.approx(0.5, rel=2e-3)
    assert near(HUB + BOOM + load([-thrust, 0, 0], "hub", "origin")) is None


def test_a_mass_at_the_tip_presses_by_its_weight_and_by_the_thrust_on_the_hub(near):
    acceleration = 0.4 * EULER / 500
    for text in (
        gravity(-acceleration) + BOOM + HELD + TIP,
        HUB + BOOM + TIP + load([acceleration * (1500 + L * LINE), 0, 0], "hub", "origin"),
    ):
        found = near(text)
        assert str(found).startswith(f"inertia and weight of the bodies attached at 'tip' ({0.4 * EULER:.4g} N) is 0.4")
        assert found.part == pytest.approx(0.4, rel=3e-3)


def test_a_mass_high_above_the_tip_tips_the_column_over_before(near):
    """k h tan(k L) = 1 at the height h = L (as in tests/reduction/test_bearing.py): k L = 0.8603."""
    g = 0.5 * 0.8603**2 * EI / L**2 / 500
    high = rigid("tip", 500.0, "weld", at=L, parent="boom", parent_marker="tip")
    assert near(gravity(-g) + BOOM + HELD + high).part == pytest.approx(0.5, rel=6e-3)


def test_spin_pulls_an_outward_boom_and_presses_an_inward_one(near):
    spinning = '[attitude]\nframe = "spinning"\nspin = [{}, 0, {}]\n'
    assert near(spinning.format(0, 20) + BOOM + HELD) is None
    assert near(spinning.format(50, 0) + BOOM + HELD) is None
    inward = rigid("hub", 1000.0, "weld") + HELD + 'parent = "hub"\nparent_marker = "rim"\n'
    inward = inward.replace("center_of_mass", "markers.rim = { position = [-3000, 0, 0] }\ncenter_of_mass")
    found = near(spinning.format(0, np.sqrt(0.5 * WEIGHT / L / LINE / 3000)) + BOOM + inward)
    assert found.part == pytest.approx(0.5, rel=2e-3)  # nearly uniform so far out


@pytest.mark.slow
def test_loads_that_do_nothing_alone_are_told_of_together_with_their_shares(near):
    pushes = [load([-part * EULER, 0, 0], name=name) for part, name in ((0.2, "a"), (0.15, "b"))]
    assert near(BOOM + HELD + pushes[0]) is None and near(BOOM + HELD + pushes[1]) is None
    found = near(BOOM + HELD + pushes[0] + pushes[1])
    assert str(found).startswith("its total load is 0.35 of the linear buckling load (load 'a' (")
    assert [float(share) for share in re.findall(r"N\) ([-\d.]+)", found.apart)] == pytest.approx([0.2, 0.15], rel=0.01)
    assert near(BOOM + HELD + load([-0.8 * EULER, 0, 0]) + load([0.8 * EULER, 0, 0], name="pull")) is None


def test_weight_and_a_load_buckle_a_column_together_before_the_sum_of_both_parts_does(near):
    """Dunkerley's bound: the part is no more than the sum; and the shapes are so alike that it is nearly that."""
    found = near(gravity(-0.3 * WEIGHT / L / LINE) + BOOM + HELD + load([-0.3 * EULER, 0, 0]))
    assert 0.59 < found.part < 0.6
    assert "load 'push'" in found.apart and "its own inertia and weight" in found.apart


def test_a_load_is_told_at_the_time_of_its_peak(near):
    peak = f"times = [0, 0.6, 1]\nforce = [[0, 0, 0], [{-0.5 * EULER}, 0, 0], [0, 0, 0]]\n"
    found = near(BOOM + HELD + load(None, more=peak))
    assert "at t = 0.6 s" in found.total and found.part == pytest.approx(0.5, rel=3e-3)


@pytest.mark.parametrize("body", ["boom", "tip"])
def test_a_push_that_follows_the_tip_is_told_of_by_its_flutter(body, near):
    text = BOOM + HELD
    if body == "tip":
        text += rigid("tip", 1e-3, "weld", parent="boom", parent_marker="tip").replace(
            "500, 500, 500", "1e-6, 1e-6, 1e-6"
        )
    for part, seen in ((0.5, True), (0.1, False)):
        push = [-part * BECK, 0, 0]
        found = near(text + (load(push, frame="marker") if body == "boom" else load(push, "tip", "origin")))
        assert (found is not None) == seen
        assert not seen or (found.flutters and found.part == pytest.approx(0.5, rel=0.02))
        assert not seen or "of the flutter load" in str(found)


def test_a_load_on_an_outer_boom_counts_for_the_inner_one_that_it_turns(near):
    """Two booms end to end are a column of 2 L; the outer one taken as stiff, k L tan(k L) = 1, a fifth later."""
    outer = BOOM.replace("bodies.boom", "bodies.outer") + (
        '[[joints]]\nkind = "weld"\nchild = "outer"\nparent = "boom"\nparent_marker = "tip"\n'
    )
    found = near(BOOM + HELD + outer + load([-0.5 * EULER / 4, 0, 0], "outer", "tip", "inertial"))
    assert found.part == pytest.approx(0.5 * EULER / 4 / (0.8603**2 * EI / L**2), rel=3e-3)
    assert found.total.startswith("load 'push' on 'outer' (")


@pytest.mark.slow
def test_a_linear_body_is_warned_of_its_weight_in_a_run_and_one_left_to_choice_is_condensed_or_nonlinear(write_case):
    def built(part, strain):
        text = RUN + gravity(-part * WEIGHT / L / LINE) + BOOM.replace(SAID, strain) + HELD
        with warnings.catch_warnings(record=True) as found:
            warnings.simplefilter("always")
            body = noted_system(read_case(write_case(text))).bodies["boom"]
        return body, [str(w.message) for w in found if w.category is PhysicsWarning]

    (said,) = built(0.5, SAID)[1]
    assert "bodies.boom: its own inertia and weight (4354 N) is 0.5 of the linear buckling load; linear strain" in said
    assert not built(0.1, SAID)[1]
    for part, form in ((0.1, "condensed"), (0.5, "condensed"), (0.85, "nonlinear"), (1.05, "nonlinear")):
        body, texts = built(part, "")
        assert body.strain_form == form
        assert ("cut the member into segments" in body.note) == (part > 1) == bool(texts)
    assert "is 0.85 of the linear buckling load" in built(0.85, "")[0].note


def test_a_round_boom_that_hangs_sideways_is_not_said_to_buckle(near):
    """It never tips over, for EIy = EIz; linear buckling would say so at a bend of half its length."""
    square = ("[bodies.boom]\n" + TABLE.format(EIy=EI)).replace("GJ = 1.2e3", f"GJ = {EI / 1.3}")
    found = near(square + HELD + load([0, 0, 4 * EI / L**2], "boom", "tip", "inertial"))
    assert found is None


def test_a_stretched_spring_presses_by_what_it_is_longer_than_at_rest(near):
    stiffness = EULER / L  # half of Euler's load at twice its length at rest
    rope = f'[[springs]]\nname = "rope"\nbody = "boom"\nmarker = "tip"\nstiffness = {stiffness}\nlength = {L / 2}\n'
    assert near(BOOM + HELD + rope).total == f"spring 'rope' ({EULER / 2:.4g} N)"


@pytest.mark.parametrize("across", [0.0, 250.0])
def test_what_follows_the_tip_decides_on_the_strain_of_a_body_that_bends_far_too(across, write_case):
    """Estimates of bends know no forces that turn with the body; flutter is reported in any case."""
    push = load([-0.5 * BECK, 0, 0], frame="marker")
    weight = f"[environment]\ngravity = [0, {-across}, 0]\n"
    case = read_case(write_case(RUN + weight + BOOM.replace(SAID, "") + HELD + push))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", PhysicsWarning)
        (strain,) = [one for one in decided(case).advice if one.decision == "strain"]
        plain = read_case(write_case(RUN + weight + BOOM.replace(SAID, "") + HELD))
        (alone,) = [one for one in decided(plain).advice if one.decision == "strain"]
    assert alone.choice == ("condensed" if across else "linear")
    assert strain.choice == "condensed" and "is 0.5 of the flutter load" in strain.reason
