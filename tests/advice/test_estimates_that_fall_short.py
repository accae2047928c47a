"""Motion estimates that cover less than the whole: what they cover, and what is said of the rest."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import femflex.advice.motion_estimate as module
from femflex.advice.motion_estimate import estimate_motion, estimate_rigid_motion
from femflex.body import FlexibleBody, Marker, MassMoments, StrainTensors, rigid_body
from femflex.system import Frame, System, free, prismatic, spherical, weld

RATE = np.array([0.3, -0.2, 0.4])
INERTIA = np.array([1.0, 2.0, 2.5])


def springy(stiffness: float) -> FlexibleBody:
    """Seven points of mass on two shapes."""
    rng = np.random.default_rng(5)
    mass, rho, phi = rng.uniform(0.5, 2, 7), rng.normal(size=(7, 3)), 0.3 * rng.normal(size=(7, 3, 2))
    z = np.concatenate([rho[:, None, :], phi.swapaxes(1, 2)], axis=1)
    moments = MassMoments(mass.sum(), np.einsum("p,pAa->Aa", mass, z), np.einsum("p,pAa,pBb->AaBb", mass, z, z))
    tip = Marker(np.array([0.5, 0.2, 0.1]), rng.normal(size=(3, 2)), rng.normal(size=(3, 2)))
    return FlexibleBody(moments, StrainTensors.linear(stiffness * np.eye(2)), np.zeros((2, 2)), {"tip": tip})


def spun(rate) -> System:
    return System({"b": rigid_body(1.0, np.diag(INERTIA))}, (free("b", u0=np.array([0, 0, 0, *rate])),))


def apart() -> System:
    """A springy arm on a post, its tip tied to a slide that passes beside it."""
    rail = {"rail": Marker.rigid(np.array([0.1, 0.19, 0.105]))}  # the tip is at y = 0.2 m and z = 0.1 m
    bodies = {
        "post": rigid_body(1.0, np.eye(3), markers=rail),
        "arm": springy(30.0),
        "slide": rigid_body(1.0, np.eye(3)),
    }
    joints = (weld("post"), weld("arm", "post"), prismatic("slide", "post", parent_marker="rail", axis=[1, 0, 0]))
    tie = spherical("slide", "arm", parent_marker="tip", name="tie")
    return System(bodies, joints, loops=(tie,))


def rates(found) -> np.ndarray:
    return found.states[:, 7 + 3 : 7 + 6]


def test_the_whole_motion_of_a_spinning_body_keeps_its_energy_and_is_not_short():
    found, why = estimate_rigid_motion(spun(RATE), 30.0)
    assert found is not None and (why, found.short) == ("", "")
    assert found.times[0] == 0.0 and found.times[-1] == 30.0 and found.states.shape == (len(found.times), 13)
    assert rates(found) ** 2 @ INERTIA == pytest.approx(np.full(len(found.times), RATE**2 @ INERTIA), rel=1e-4)
    assert np.ptp(rates(found), axis=0).min() > 0.05


def test_a_motion_that_costs_too_much_ends_at_a_part_or_at_its_start(monkeypatch):
    whole, _ = estimate_rigid_motion(spun(3 * RATE), 64.0)
    monkeypatch.setattr(module, "MOST_RATES", 300)
    found, _ = estimate_rigid_motion(spun(3 * RATE), 64.0)
    last = found.times[-1]
    assert 2.0 < last < 60.0 and found.short == f"up to t = {last:.4g} s only, to limit its cost"
    n = len(found.times)
    assert found.times == pytest.approx(whole.times[:n]) and found.states == pytest.approx(whole.states[:n], abs=1e-9)
    monkeypatch.setattr(module, "MOST_RATES", 5)
    found, _ = estimate_rigid_motion(spun(1e4 * RATE), 64.0)
    assert found.times.tolist() == [0.0] and rates(found) == pytest.approx(1e4 * RATE[None])
    assert found.short == "up to t = 0 s only, to limit its cost"


def test_a_motion_that_diverges_is_kept_up_to_where_it_fails():
    """A slide on a base that turns at 200 rad/s: x = x0 cosh(200 t), beyond all numbers."""
    turning = Frame("spinning", np.array([0.0, 0.0, 200.0]))
    joint = prismatic("b", axis=[1, 0, 0], q0=np.array([1e-3]))
    system = System({"b": rigid_body(2.0, np.eye(3))}, (joint,), frame=turning)
    found, why = estimate_rigid_motion(system, 64.0)
    assert (
        why == ""
        and found.short.startswith("up to t = ")
        and found.short.endswith(" s only, where the rigid-body simulation fails")
    )
    reached = float(found.short.removeprefix("up to t = ").split()[0])
    assert 0.05 < found.times[-1] <= reached * 1.001 < 60.0 and (np.diff(found.times) > 0).all()
    assert reached - found.times[-1] < 0.2  # the last part is kept up to there
    early = found.times < 0.1
    assert early.sum() > 2
    assert found.states[early, 0] == pytest.approx(1e-3 * np.cosh(200.0 * found.times[early]), rel=1e-3)
    whole = estimate_motion(system, 64.0)
    assert whole.short == found.short and whole.rigid is not None


def test_rigid_bodies_that_close_no_loop_have_no_motion_and_their_start_stands_for_it():
    found, why = estimate_rigid_motion(apart(), 4.0)
    assert found is None and why.startswith("for the initial state only (") and why.endswith(")") and "\n" not in why
    assert not why.endswith(".)") and "cannot close" in why
    view = estimate_motion(replace(apart(), reactions=True), 4.0)
    assert view.short == why and view.rigid is None and not view.model.system.reactions
    assert view.times.tolist() == [0.0] and np.array_equal(view.carried, view.model.x0[None])
    assert np.array_equal(view.bent, view.carried)


def test_bodies_of_too_many_coordinates_or_without_an_answer_are_moved_without_bending(monkeypatch):
    firm = System({"b": springy(30.0)}, (free("b", u0=np.array([0, 0, 0, *RATE])),))

    def fails(*given):
        raise np.linalg.LinAlgError("singular.\nvery")

    with monkeypatch.context() as patch:
        patch.setattr(module, "elastic_response", fails)
        view = estimate_motion(firm, 4.0)
    assert view.short == "without elastic deflection (singular)" and view.rigid is not None
    assert np.array_equal(view.bent, view.carried) and len(view.times) > 1000
    monkeypatch.setattr(module, "MANY", 8)
    view = estimate_motion(firm, 4.0)
    assert view.short == "" and np.abs(view.bent[:, 7:9]).max() > 1e-3 and not view.carried[:, 7:9].any()
    monkeypatch.setattr(module, "MANY", 7)
    few = estimate_motion(firm, 4.0)
    assert few.short == "without elastic deflection (8 coordinates, over 7)"
    assert np.array_equal(few.bent, view.carried) and np.array_equal(few.carried, view.carried)
