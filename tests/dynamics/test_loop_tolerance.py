"""Loops with play: linkages given to a few digits, against the same given exactly."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from support.mechanisms import bar, four_bar

from femflex.body import Marker, rigid_body
from femflex.dynamics import compile_system
from femflex.dynamics.constraints.clearance import taken_up
from femflex.dynamics.equilibria.equilibrium import equilibrium
from femflex.integrate import IntegrationError, integrator
from femflex.system import Environment, System, revolute, spherical, weld

TIMES = np.linspace(0.0, 10.0, 201)
THIRD = 1.0 / 3.0


def three_cranks(length=THIRD, play=0.0, start=0.4, speed=2.0, **more):
    """A parallelogram with a third crank in between, of that length: exactly a third, it moves as one of two does."""
    base, crank = [0.0, 0.25, 1.0], [THIRD, length, THIRD]
    marks = {f"p{k}": Marker.rigid([x, 0, 0]) for k, x in enumerate(base)}
    coupler = rigid_body(1.0, np.diag([1e-3, 0.1, 0.1]), [0.5, 0, 0], marks)
    bodies = {"ground": rigid_body(1.0, np.eye(3), markers=marks), "coupler": coupler}
    bodies |= {f"crank{k}": bar(crank[k], 0.5) for k in range(3)}
    joints = [weld("ground"), revolute("coupler", "crank0", parent_marker="end", q0=[-start], u0=[-speed])]
    joints += [revolute(f"crank{k}", "ground", parent_marker=f"p{k}", q0=[start], u0=[speed]) for k in range(3)]
    loops = [
        revolute(f"crank{k}", "coupler", parent_marker=f"p{k}", child_marker="end", name=f"pin{k}") for k in (1, 2)
    ]
    loops = tuple(replace(loop, play=play) for loop in loops)
    return System(bodies, tuple(joints), loops=loops, **more)


def moved(system, times=TIMES):
    model = compile_system(system)
    solution = integrator("dop853", rtol=1e-10).solve(model, times, model.x0)
    return model, model.observe(solution.times, solution.states)


@pytest.mark.parametrize(("length", "play"), [(0.333333, 3e-6), (0.33333333, 1e-7)])
def test_a_third_crank_typed_with_few_digits_is_refused_without_play_and_moves_with_it(length, play):
    with pytest.raises(ValueError, match=r"loop 'pin\d' cannot .* (or give the loop|to its) `play`"):
        compile_system(three_cranks(length))
    _, exact = moved(three_cranks())
    model, near = moved(three_cranks(length, play=play))
    assert np.abs(exact["q"]).max() > 20.0  # rad: over three turns, through six flat configurations
    misfit = THIRD - length
    # near a flat configuration the state moves by the misfit over the pivot, left out below some 10 sqrt(play)
    assert near["q"] == pytest.approx(exact["q"], abs=misfit / (3 * play**0.5))
    assert np.ptp(near["monitors/energy"]) < (0.1 * misfit + 1e-9) * near["monitors/energy"][0]
    gap = near["monitors/constraint_position"]
    assert 0.1 * misfit < gap.max() < play and gap[0] < 1e-12
    assert set(near["monitors/constraint_rank"][[0, -1]]) == set(exact["monitors/constraint_rank"][[0, -1]])
    told = taken_up(model.constraints)
    assert 0.1 * misfit < max(one.moved for one in told) <= misfit


def test_parts_that_stand_apart_along_parallel_axes_fit_for_good():
    """An offset along the axes, and the same linkage turned in space by rounded numbers: misfits that do not change."""
    system = four_bar()
    rocker = system.bodies["rocker"]
    shifted = replace(rocker, markers=rocker.markers | {"end": Marker.rigid([1.2, 0, 3e-7])})
    loose = replace(system, bodies=system.bodies | {"rocker": shifted})
    with pytest.raises(ValueError, match=r"loop 'closure' cannot close.*or give the loop `play` of 1e-06 m"):
        compile_system(loose)
    loose = replace(loose, loops=(replace(loose.loops[0], play=1e-6),))
    model, near = moved(loose)
    (told,) = taken_up(model.constraints)
    assert told.moved == pytest.approx(3e-7, rel=1e-6) and told.turned < 1e-12
    assert "joints reach is 3e-07 m" in str(told) and "`play` of 1e-06 m" in str(told)
    _, exact = moved(system)
    assert near["q"] == pytest.approx(exact["q"], abs=1e-9)
    assert near["monitors/constraint_position"].max() < 1e-11
    assert np.ptp(near["monitors/energy"]) < 1e-9 * near["monitors/energy"][0]


@pytest.mark.parametrize("tilt", [3e-8, 1e-6])
def test_axes_that_are_not_quite_parallel_turn_within_the_play(tilt):
    system = four_bar()
    turned = Rotation.from_euler("x", tilt).as_matrix()
    crank = system.bodies["crank"]
    crank = replace(crank, markers=crank.markers | {"end": Marker.rigid([0.5, 0, 0], turned)})
    loose = replace(system, bodies=system.bodies | {"crank": crank})
    loose = replace(loose, loops=(replace(loose.loops[0], play=5e-6),))
    _, exact = moved(system)
    _, near = moved(loose)
    assert near["q"] == pytest.approx(exact["q"], abs=200 * tilt)
    assert 0.01 * tilt < near["monitors/constraint_position"].max() < 5e-6
    assert np.ptp(near["monitors/energy"]) < 20 * tilt * near["monitors/energy"][0]
    assert set(near["monitors/constraint_rank"]) == {2.0}


def test_a_linkage_that_opens_beyond_its_play_stops_with_both_numbers():
    model = compile_system(three_cranks(0.33333, play=4e-6))
    with pytest.raises(
        IntegrationError, match=r"loop 'pin\d' cannot be satisfied.*of 4e-06 m, above the limit of 4e-06"
    ):
        integrator("dop853", rtol=1e-10).solve(model, TIMES, model.x0)


def test_a_loop_that_its_joints_can_close_is_closed_exactly_in_spite_of_its_play():
    system = four_bar()
    (pin,) = system.loops
    ball = spherical("rocker", "coupler", parent_marker="end", child_marker="end", name=pin.name)
    ball = replace(ball, play=1e-4)
    start = [replace(j, q0=j.q0 + 1e-5) if len(j.q0) else j for j in system.joints]
    model, near = moved(replace(system, joints=tuple(start), loops=(ball,)))
    assert near["monitors/constraint_position"].max() < 1e-12 and taken_up(model.constraints) == []


def test_an_equilibrium_within_the_play_is_that_of_the_exact_linkage():
    springs = {"environment": Environment(np.array([0.0, -9.81, 0.0]))}

    def sprung(system):
        joints = [replace(j, stiffness=np.full(j.n_u, 3.0), u0=0 * j.u0) for j in system.joints]
        return equilibrium(replace(system, joints=tuple(joints)))

    exact, near = sprung(three_cranks(**springs)), sprung(three_cranks(0.333333, play=1e-6, **springs))
    n = exact.model.n_q
    assert near.x[:n] == pytest.approx(exact.x[:n], abs=1e-5)
    assert len(near.eigenvalues) == len(exact.eigenvalues) == 2
    assert near.eigenvalues.imag == pytest.approx(exact.eigenvalues.imag, rel=1e-4)


def test_play_that_is_a_clearance_or_stands_on_the_tree_is_refused():
    with pytest.raises(ValueError, match=r"play of loop 'pin1' is 0.02 m, 2.00% of the bodies' size of 1 m"):
        compile_system(three_cranks(play=0.02))
    with pytest.raises(ValueError, match="play of joint 'pin' is -1 m; expected a length"):
        replace(revolute("a", name="pin"), play=-1)
    with pytest.raises(ValueError, match="joint 'base-a' has play, but its coordinates keep it together exactly"):
        System({"a": rigid_body(1.0, np.eye(3))}, (replace(revolute("a"), play=1e-6),))
