"""What is doubtful of a craft whatever it is going to do: loose bodies, thrust on an orbit that is specified."""

from __future__ import annotations

import warnings

import numpy as np
import pytest

from femflex.advice.bodies import KnownBodies
from femflex.advice.model_warnings import model_warnings
from femflex.body import Marker, rigid_body
from femflex.case import parse_case
from femflex.pipeline.decisions import build_system
from femflex.pipeline.prepared import prepare
from femflex.system import Load, Orbit, System, free, spherical, universal, weld
from femflex.warning import PhysicsWarning

BLOCK = rigid_body(100.0, np.diag([10.0, 12.0, 14.0]))
RADIUS = 7.0e6


def texts(system, duration=100.0):
    return [one.reason for one in model_warnings(system, KnownBodies({}), duration)]


def test_a_body_that_nothing_joins_to_jointed_ones_is_told_of():
    joints = (weld(child="hub"), weld(child="arm", parent="hub"), free(child="tank"))
    (text,) = texts(System({"hub": BLOCK, "arm": BLOCK, "tank": BLOCK}, joints))
    assert text.startswith("bodies.tank: it has no joint and carries no body, while 2 of the other bodies have a joint")


def test_a_free_craft_is_not_taken_for_a_forgotten_joint():
    assert not texts(System({"hub": BLOCK, "arm": BLOCK}, (free(child="hub"), weld(child="arm", parent="hub"))))
    assert not texts(System({"hub": BLOCK}, (free(child="hub"),)))


CASE = """
[run]
duration = 10
output_step = 0.1
[bodies.wall]
kind = "rigid"
mass = 1
inertia = [1, 1, 1]
[bodies.panel]
kind = "rigid"
mass = 1
inertia = [1, 1, 1]
[[joints]]
kind = "revolute"
axis = "z"
child = "wall"
"""


def test_a_case_with_a_forgotten_joint_is_warned_of():
    with pytest.warns(PhysicsWarning, match=r"bodies.panel: it has no joint"):
        build_system(parse_case(CASE))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        build_system(parse_case(CASE + '[[joints]]\nkind = "weld"\nparent = "wall"\nchild = "panel"\n'))


def orbiting(*loads, kind="specified"):
    joint = free(child="hub") if kind == "free" else spherical(child="hub")
    return System({"hub": BLOCK}, (joint,), loads=loads, orbit=Orbit(RADIUS, free=kind == "free"))


def thrust(force, name="thrust"):
    return Load(name, "hub", "origin", force=np.array(force, float))


def test_thrust_on_a_specified_orbit_is_told_of_with_the_change_of_speed_that_it_leaves_out():
    """2 N on 100 kg for 100 s: 2 m/s."""
    (text,) = texts(orbiting(thrust([0, 0, 2])))
    assert "push the craft by up to 2 N, 2 m/s over 100 s, and its orbit is specified" in text
    assert not texts(orbiting(thrust([0, 0, 2]), kind="free"))


def test_thrusters_that_balance_or_hardly_push_are_not_told_of():
    assert not texts(orbiting(thrust([0, 0, 2]), thrust([0, 0, -2], "other")))
    assert not texts(orbiting(thrust([0, 0, 1e-3])))


def test_a_short_pulse_between_the_instants_looked_at_counts_whole():
    """2000 N for 0.1 s on 100 kg: 2 m/s; one that begins after the end of the run does not count."""
    rows = np.outer([0.0, 0.0, 2000.0, 2000.0, 0.0, 0.0], [0.0, 0.0, 1.0])
    edges = np.array([0.0, 40.05, 40.05, 40.15, 40.15, 200.0])
    (text,) = texts(orbiting(Load("pulse", "hub", "origin", force=rows, times=edges)))
    assert "push the craft by up to 2000 N, 2 m/s over 100 s" in text
    later = Load("pulse", "hub", "origin", force=rows, times=np.where(edges < 100.0, edges + 100.0, 300.0))
    assert not texts(orbiting(later))


ROOT = {"child": "cord", "parent": "hub", "child_marker": "root"}
TIP = {"child": "end", "parent": "cord", "parent_marker": "tip"}


@pytest.mark.parametrize(
    ("joints", "turns"),
    [
        ((spherical(**ROOT), spherical(**TIP)), True),
        ((spherical(**ROOT), weld(**TIP)), False),
        ((universal(axes=[[0, 0, 1], [0, 1, 0]], **ROOT), spherical(**TIP)), False),
        ((universal(axes=[[1, 0, 0], [0, 1, 0]], **ROOT), spherical(**TIP)), True),
        ((weld(**ROOT), spherical(**TIP)), False),
    ],
    ids=["two balls", "ball and weld", "axes across", "axis along", "weld and ball"],
)
def test_a_body_on_a_line_must_not_turn_about_it_without_inertia(joints, turns):
    """A cord of 2 m along (1, 0, 0) from a hub to an end body, each of inertia; its own is on its line."""
    places = {"root": Marker.rigid(np.zeros(3)), "tip": Marker.rigid([2.0, 0.0, 0.0])}
    cord = rigid_body(0.3, np.diag([0.0, 0.1, 0.1]), [1.0, 0.0, 0.0], markers=places)
    found = texts(System({"hub": BLOCK, "cord": cord, "end": BLOCK}, (free(child="hub"), *joints)))
    assert [text.partition(":")[0] for text in found] == ["bodies.cord"] * turns
    assert not turns or "Give it a universal joint with both axes across the line" in found[0]


def test_a_run_of_a_body_that_turns_without_inertia_is_refused():
    case = CASE + '[[joints]]\nkind = "spherical"\nparent = "wall"\nchild = "panel"\n'
    thin = case.replace("inertia = [1, 1, 1]\n[[joints]]", "inertia = [0, 1, 1]\n[[joints]]")
    prepare(parse_case(case))
    with pytest.raises(ValueError, match=r"bodies\.panel: its mass lies on a line, .* \(limit 1e-13\)"):
        prepare(parse_case(thin))
