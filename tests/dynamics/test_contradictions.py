"""Constraints that contradict each other end a run, at the instant, with the sentence that names them."""

from dataclasses import replace

import numpy as np
import pytest
from support.mechanisms import four_bar, planar

from femflex.body import Marker, rigid_body
from femflex.dynamics import compile_system
from femflex.integrate import Dop853, Esdirk4, GeneralizedAlpha, IntegrationError
from femflex.system import Joint, Profile, System, knife_edge, revolute, rolling_disc, spherical, velocity_rows, weld

METHODS = [Dop853(), Esdirk4(), pytest.param(GeneralizedAlpha(), marks=pytest.mark.slow)]
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


@pytest.mark.parametrize("method", METHODS, ids=lambda method: method.name)
def test_a_crank_that_sets_off_against_a_held_rocker_stops_the_run_there(method):
    system = driven(Profile.smooth_step(0.5, 1.0, CRANK, 1.4), Profile.constant(ROCKER))
    model, error = stopped(system, method)
    for said in ("loop 'closure' cannot be satisfied", "'drive.angle', 'ground-rocker.angle'", "above the limit of"):
        assert said in str(error)
    assert 0.5 <= error.t < 0.51
    seen = model.observe(error.times, error.states)
    assert len(error.times) >= 51  # everything before is kept
    assert seen["monitors/constraint_position"].max() < 2e-10
    assert seen["monitors/constraint_velocity"].max() < 2e-10


def sliding(*more):
    """A body that slides along x and turns as told, with a blade along x."""
    motion = (Profile.sine(1.0, 1.2), 0.0, Profile.smooth_step(0.5, 1.0, 0.0, 1.0))
    joint = Joint("b", translations=np.eye(3)[:2], rotations=np.eye(3)[2:], motion=motion, name="slide")
    return System({"b": rigid_body(1.0, np.eye(3))}, (joint,), constraints=(knife_edge("blade", "b", [0, 1, 0]), *more))


def test_a_knife_edge_turned_across_a_specified_slide_stops_the_run_there():
    model, error = stopped(sliding(), Dop853())
    assert "constraint 'blade' cannot be satisfied" in str(error) and "'slide.slide2'" in str(error)
    assert 0.5 <= error.t < 0.51
    assert model.observe(error.times, error.states)["monitors/constraint_velocity"].max() < 2e-10


def plane(*functions):
    """A body that slides in a plane under general rows, one per function."""
    rows = tuple(velocity_rows(f"c{k}", 1, function) for k, function in enumerate(functions))
    joint = Joint("b", translations=np.eye(3)[:2], name="J")
    return System({"b": rigid_body(2.0, np.eye(3))}, (joint,), constraints=rows)


def ask(speed):
    """A row u1 = speed(t)."""
    return lambda t, q: (np.array([[1.0, 0.0]]), np.array([speed(t)]))


def test_general_rows_that_part_later_stop_the_run():
    _, error = stopped(plane(ask(lambda t: 0.0), ask(lambda t: max(t - 0.3, 0.0) ** 4)), Dop853())
    assert "cannot be satisfied any further together with constraint" in str(error)
    assert 0.3 < error.t < 0.32  # (t - 0.3)^4 passes 2e-10 at 0.3038


def test_rows_whose_accelerations_contradict_each_other_are_refused_at_the_start():
    with pytest.raises(ValueError, match=r"'c1' cannot be satisfied together with constraint 'c0' at the start.*0.5"):
        compile_system(plane(ask(lambda t: 0.0), ask(lambda t: t)))


def test_a_crank_that_accelerates_at_once_against_a_held_rocker_is_refused():
    with pytest.raises(
        ValueError, match=r"'closure' cannot be satisfied together with the prescribed motions of 'drive.angle'"
    ):
        compile_system(driven(Profile.polynomial(CRANK, 0.0, 1.0), Profile.constant(ROCKER)))


def test_rates_along_no_branch_of_a_singular_start_are_refused():
    # a parallelogram lying flat, where crank and rocker may go on to turn alike or against each other
    flat = four_bar(crank=0.5, coupler=2.0, rocker=0.5, base=2.0, speed=3.0, start=(0.0, 0.0, 0.0))
    with pytest.raises(ValueError, match=r"loop 'closure' cannot be satisfied at the start.* singular configuration"):
        compile_system(flat)
    along = [replace(j, u0=np.full(j.n_u, r)) for j, r in zip(flat.joints, (0, 3.0, -3.0, 3.0), strict=True)]
    assert compile_system(replace(flat, joints=tuple(along))).x0[-3:] == pytest.approx([3.0, 3.0, -3.0])


def test_specified_motions_that_cannot_close_at_the_start_are_named():
    with pytest.raises(
        ValueError, match=r"cannot close together with the prescribed motions of 'drive.angle', 'ground-rocker"
    ):
        compile_system(driven(Profile.constant(0.4), Profile.constant(2.5)))


def test_a_loop_driven_beyond_its_reach_is_named_with_its_drive():
    _, error = stopped(driven(rocker=Profile.smooth_step(0.1, 0.9, ROCKER, 4.5)), Dop853())
    assert "loop 'closure' cannot follow the prescribed motion of 'ground-rocker.angle' any further" in str(error)
    # crank and coupler in one line: the rocker's end is 2.5 m or 1.5 m from the crank's pivot
    end = model_distance(error)
    assert min(abs(end - 2.5), abs(end - 1.5)) < 1e-4


def model_distance(error):
    """How far the rocker's end is from the crank's pivot at the last state [m]."""
    angle = error.states[-1][1]
    return float(np.hypot(2.0 + 1.2 * np.cos(angle), 1.2 * np.sin(angle)))


def test_an_exception_of_a_users_row_surfaces_with_its_cause():
    def later(t, q):
        if t > 0.5:
            raise ZeroDivisionError("no speed is known")
        return np.array([[1.0, 0.0]]), np.zeros(1)

    _, error = stopped(plane(later), Dop853())
    assert "function of constraint 'c0' raised ZeroDivisionError: no speed is known" in str(error)
    assert isinstance(error.__cause__, ZeroDivisionError) and 0.4 < error.t <= 0.5


def test_a_row_that_is_not_a_number_is_named():
    with pytest.raises(ValueError, match="constraint 'c0' gave numbers that are not finite in row 0 at t = 0 s"):
        compile_system(plane(ask(lambda t: np.nan)))
    _, error = stopped(plane(ask(lambda t: np.nan if t > 0.5 else 0.0)), Dop853())
    assert "not finite in row 0" in str(error)


def test_a_disc_that_lies_flat_is_refused_by_name():
    disc = rolling_disc("coin", "b", 0.5, axis=[0, 0, 1])
    system = System({"b": rigid_body(1.0, np.eye(3))}, (spherical("b"),), constraints=(disc,))
    with pytest.raises(ValueError, match=r"disc 'coin' lies flat on its plane: its axis is within 0 rad"):
        compile_system(system)


@pytest.mark.sampled(2)
@pytest.mark.parametrize(
    "masses", [(1e4, 1.0, 1e-6), (1e6, 1e-6, 1.0), (1e-12, 1.0, 1.0), (1e-3, 1.0, 1e6), (1e4, 1.0, 1e-9)]
)
def test_bodies_of_very_different_mass_close_and_keep_their_energy(masses):
    bodies = {"ground": rigid_body(1.0, np.eye(3), markers={"pivot": Marker.rigid([2, 0, 0])})}
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


@pytest.mark.parametrize("tilt", [1e-9, 1e-6])
def test_a_linkage_whose_axes_are_not_parallel_to_the_last_digits_is_refused_with_the_number(tilt):
    system = four_bar()
    turned = np.array([[1.0, 0.0, 0.0], [0.0, np.cos(tilt), -np.sin(tilt)], [0.0, np.sin(tilt), np.cos(tilt)]])
    crank = replace(
        system.bodies["crank"], markers=system.bodies["crank"].markers | {"end": Marker.rigid([0.5, 0, 0], turned)}
    )
    with pytest.raises(ValueError, match=r"loop 'closure' cannot .*(gap|velocity) of \d.*e-\d"):
        compile_system(replace(system, bodies=system.bodies | {"crank": crank}))
