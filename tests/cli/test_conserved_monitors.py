"""Which monitors of a run are printed as ones that ought to be constant."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from femflex.body import Marker, rigid_body
from femflex.cli.run_report import _attraction_lines, change_line, conserved_monitors, reach_lines
from femflex.system import (
    Environment,
    Frame,
    Load,
    Orbit,
    Profile,
    Spring,
    System,
    Variation,
    free,
    reaction_wheel,
    revolute,
    rolling_disc,
    spherical,
    thruster,
    velocity_rows,
)

ENERGY, SPIN = "monitors/energy", "monitors/angular_momentum"
JACOBI = "monitors/jacobi"
BODY = {"hub": rigid_body(1.0, np.diag([1.0, 2.0, 2.5]))}
TWO = BODY | {"arm": rigid_body(1.0, np.diag([1.0, 2.0, 2.5]))}
LOCKED = (Profile(np.zeros(1), np.array([[0.25, 0.0]])),)
BETWEEN = Spring("s", "arm", "hub", stiffness=2.0)
ROWS = velocity_rows("v", 1, lambda t, q: (np.ones((1, 6)), np.ones(1)))
TURNED = (Profile(np.zeros(1), np.array([[0.25, 1.0]])),)
DEAD = Load("pull", "hub", "origin", frame="inertial", force=np.array([1.0, 0.0, 0.0]))


class Empty(dict):
    """A run without an orbit, with all of its terms."""

    without: tuple[str, ...] = ()

    def unit(self, path: str) -> str:
        return "N m s"


@pytest.mark.parametrize(
    ("system", "kept"),
    [
        (System(BODY, (free("hub"),)), [ENERGY, SPIN]),
        (System(BODY, (free("hub"),), (DEAD,)), [ENERGY]),
        (System(BODY, (revolute("hub"),)), [ENERGY]),
        (System(BODY, (revolute("hub", damping=1.0),)), []),
        (System(BODY, (free("hub"),), frame=Frame("spinning", np.array([0.0, 0.0, 1.0]))), [SPIN]),
    ],
    ids=["free", "pulled", "hinged", "damped", "spinning frame"],
)
def test_what_the_forces_and_joints_leave_constant(system: System, kept: list[str]):
    run: Any = Empty()
    assert conserved_monitors(run, system) == kept


def jointed(**more: Any) -> System:
    """A free hub with an arm on a hinge."""
    return System(TWO, (free("hub"), revolute("arm", "hub", **more)))


@pytest.mark.parametrize(
    ("system", "kept"),
    [
        (jointed(), [ENERGY, SPIN]),
        (jointed(stiffness=2.0), [ENERGY, SPIN]),
        (jointed(motion=LOCKED), [ENERGY, SPIN]),
        (jointed(motion=TURNED), []),
        (System(BODY, (free("hub", stiffness=np.ones(6)),)), [ENERGY]),
        (System(BODY, (free("hub"),), springs=(Spring("s", "hub", stiffness=2.0),)), [ENERGY]),
        (System(BODY, (free("hub"),), springs=(Spring("s", "hub", damping=2.0),)), []),
        (System(TWO, (free("hub"), free("arm")), springs=(BETWEEN,)), [ENERGY]),
        (System(TWO, (free("hub"), free("arm", "hub")), springs=(BETWEEN,)), [ENERGY, SPIN]),
        (System(BODY, (free("hub"),), constraints=(rolling_disc("d", "hub", 0.5),)), [ENERGY]),
        (System(BODY, (free("hub"),), constraints=(ROWS,)), []),
        (System(BODY, (free("hub"),), effectors=(reaction_wheel("w", "hub", 0.1, torque=0.1),)), [SPIN]),
        (System(BODY, (free("hub"),), effectors=(thruster("t", "hub", 2.0, pulses=[(0.0, 1.0)]),)), []),
        (System(BODY, (free("hub"),), varying={"hub": Variation(lambda *words: None, ("mass",))}), []),
        (System(BODY, (free("hub"),), (Load("follower", "hub", "origin", force=np.array([1.0, 0.0, 0.0])),)), []),
    ],
    ids=[
        "jointed", "sprung", "locked", "prescribed", "sprung root", "sprung to the base", "damper", "two roots",
        "sprung parts", "rolling", "driven rows", "wheel", "thruster", "varying", "follower load",
    ],
)  # fmt: skip
def test_joints_springs_effectors_and_constraints_decide_what_is_constant(system: System, kept: list[str]):
    run: Any = Empty()
    assert conserved_monitors(run, system) == kept


@pytest.mark.parametrize(
    ("without", "kept"), [("gyroscopic", []), ("coriolis_centrifugal", []), ("K3", [ENERGY, SPIN])]
)
def test_without_a_term_that_does_no_work_of_its_own_nothing_is_constant(without: str, kept: list[str]):
    run: Any = Empty()
    run.without = (without,)
    assert conserved_monitors(run, System(BODY, (free("hub"),))) == kept


CIRCLE, ELLIPSE = np.full(3, 7e6), np.array([7e6, 7e6 + 0.01, 7e6])


@pytest.mark.parametrize(
    ("radius", "more", "kept"),
    [
        (CIRCLE, {}, [JACOBI]),
        (CIRCLE + np.array([0.0, 5e-3, 0.0]), {}, [JACOBI]),
        (ELLIPSE, {}, []),
        (ELLIPSE, {"free": True}, [ENERGY]),
        (CIRCLE, {"wheel": True}, []),
    ],
    ids=["circle", "circle but for rounding", "ellipse", "free", "wheel"],
)
def test_in_orbit_energy_or_the_integral_of_jacobi_is_constant(radius: Any, more: Any, kept: list[str]):
    root = free("hub") if more.get("free") else spherical("hub")
    wheels = (reaction_wheel("w", "hub", 0.1, torque=0.1),) if more.get("wheel") else ()
    orbit = Orbit(7e6, free=bool(more.get("free")))
    system = System(BODY, (root,), frame=Frame("orbital"), orbit=orbit, effectors=wheels)
    run: Any = Empty({"orbit/radius": radius})
    assert conserved_monitors(run, system) == kept


# the attraction over a large craft


def tether(length: float, **environment: Any) -> System:
    """A hub in a circular orbit of 7000 km, and a mast whose tip is that far [m] from it."""
    tip = {"tip": Marker(np.array([0.0, 0.6, 0.8]) * length, np.zeros((3, 0)), np.zeros((3, 0)))}
    bodies = {"mast": rigid_body(1.0, np.diag([1.0, 2.0, 2.5]), markers=tip)}
    return System(
        bodies, (spherical("mast"),), frame=Frame("orbital"), orbit=Orbit(7e6), environment=Environment(**environment)
    )


def test_a_large_craft_is_reported_how_its_attraction_is_taken():
    where = (
        "0.0004 of the distance from the centre (auto integrates from 0.0001 on); the gradient has an error of 0.06%"
    )
    assert _attraction_lines(tether(2800.0, attraction="gradient")) == [
        f"attraction  by its gradient: the craft reaches 2800 m, {where} there"
    ]
    assert _attraction_lines(tether(2800.0, attraction="exact", oblateness=1.0826e-3)) == [
        f"attraction  integrated over points of mass: the craft reaches 2800 m, {where} there",
        "oblateness  J2 = 0.0010826, pole along the inertial Z axis",
    ]
    small = "attraction  integrated over points of mass: the craft reaches 7 m, 1e-06 of the distance from the centre "
    small += "(auto integrates from 0.0001 on); the gradient has an error of 0.00% there"
    assert _attraction_lines(tether(7.0)) == [] and _attraction_lines(tether(7.0, attraction="exact")) == [small]
    assert _attraction_lines(System(BODY, (free("hub"),))) == []


def test_a_free_length_that_reached_far_is_reported_after_the_run(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr("femflex.system.attraction.free_members", lambda system: ["mast"])
    monkeypatch.setattr("femflex.system.attraction._stock", lambda system, name: 0.0)
    run: Any = Empty({"bodies/mast/length": np.array([10.0, 2800.0, 1400.0])})
    where = "0.0004 of the distance from the centre; the gradient has an error of 0.06% there"
    assert reach_lines(run, tether(5.0)) == [f"attraction  by its gradient: the craft reached 2800 m, {where}"]
    assert "the craft reaches 2800 m at the start, 0.0004" in _attraction_lines(tether(2800.0))[0]
    run["bodies/mast/length"] = np.array([10.0, 690.0, 20.0])
    assert reach_lines(run, tether(5.0)) == [] and reach_lines(run, tether(5.0, attraction="exact")) == []


def test_a_momentum_of_zero_has_no_part_of_its_size():
    """A craft whose momentum is zero changes it by rounding alone; that is no 100 %."""
    run: Any = Empty({SPIN: np.array([[0.0, 0.0, 0.0], [1e-14, 0.0, 0.0]])})
    assert change_line(run, SPIN) == "monitor     angular momentum changed by up to 1.000e-14 N m s"
    run[SPIN] = run[SPIN] + np.array([0.0, 0.0, 2.0])
    assert change_line(run, SPIN).endswith("1.000e-14 N m s, 5.00e-15 of its size")
