"""Latches: momentum before and after, energy lost, closed forms, and runs that are cut and resumed."""

from dataclasses import replace

import numpy as np
import pytest
from support.mechanisms import four_bar
from support.random_systems import random_body

from femflex.body import Marker, rigid_body
from femflex.dynamics import compile_system
from femflex.integrate import integrator
from femflex.system import Latch, System, TabulatedSpring, free, prismatic, revolute

TIGHT = {"rtol": 1e-11, "atol": 1e-12}


def wing(latches=True, n=3, damping=0.0, **latch):
    """A free hub with a flexible panel and a second one on its tip, both unfolded by springs up to their latches."""
    rng = np.random.default_rng(8)
    panels = []
    for _ in range(2):
        body = random_body(rng, n)[0]
        tip = Marker(np.array([1.0, 0.2, 0.1]), 0.1 * rng.normal(size=(3, n)), 0.1 * rng.normal(size=(3, n)))
        panels.append(replace(body, damping=0.0 * body.damping, markers={**body.markers, "tip": tip}))
    hub = rigid_body(
        30.0, np.diag([20.0, 30.0, 25.0]), [0.1, 0.2, 0.0], {"side": Marker.at_position(np.array([0.5, 0.3, 0.0]))}
    )
    at = {"latches": (Latch(0, 0.4, **latch),)} if latches else {}
    second = {"latches": (Latch(0, -0.3),)} if latches else {}
    root = free("hub", u0=[0.01, -0.02, 0.03, 0.05, -0.04, 0.02])
    where = {"axis": (0, 1, 1), "parent_marker": "side", "name": "inner", "damping": damping, **at}
    inner = revolute("inner", "hub", stiffness=30.0, rest=1.0, **where)
    where = {"axis": (0, 1, 0), "parent_marker": "tip", "name": "outer", "damping": damping, **second}
    joints = (root, inner, revolute("outer", "inner", stiffness=40.0, rest=-1.2, **where))
    return compile_system(System({"hub": hub, "inner": panels[0], "outer": panels[1]}, joints))


def run(model, end=3.0, n=301, method="dop853", **settings):
    times = np.linspace(0.0, end, n)
    solution = integrator(method, **(settings or TIGHT)).solve(model, times, model.x0)
    return times, solution, model.observe(times, solution.states)


def test_impacts_conserve_momentum_and_lose_reported_energy():
    times, _, seen = run(wing())
    locked = [seen[f"latches/{name}.angle/time"][-1] for name in ("inner", "outer")]
    assert all(0 < t < 3 for t in locked)
    momentum, spin = seen["monitors/momentum"], seen["monitors/angular_momentum"]
    assert momentum == pytest.approx(np.tile(momentum[0], (len(times), 1)), abs=1e-10 * np.abs(momentum).max())
    assert spin == pytest.approx(np.tile(spin[0], (len(times), 1)), abs=1e-10 * np.abs(spin).max())
    loss = sum(seen[f"latches/{name}.angle/loss"] for name in ("inner", "outer"))
    energy = seen["monitors/energy"] + loss
    assert loss[-1] > 1.0
    assert energy == pytest.approx(np.full(len(times), energy[0]), abs=1e-9 * loss[-1])
    after = times > locked[0]
    assert seen["q"][after, 7] == pytest.approx(0.4, abs=1e-15) and np.all(seen["u"][after, 6] == 0.0)
    assert np.all(seen["latches/inner.angle/locked"] == after)


@pytest.mark.parametrize("method", ["dop853", "esdirk4"])
def test_latch_time_and_loss_of_falling_cart(method):
    pull = TabulatedSpring(at=[-1.0, 1.0], force=[-6.0, -6.0])  # a steady pull of 6 N on 2 kg
    joint = prismatic("cart", laws=(pull,), latches=(Latch(0, 0.5),))
    model = compile_system(System({"cart": rigid_body(2.0, np.eye(3))}, (joint,)))
    settings = {"dop853": TIGHT, "esdirk4": {"rtol": 1e-9, "atol": 1e-10}}.get(method, {"rtol": 1e-8, "atol": 1e-9})
    _, _, seen = run(model, 1.0, 101, method, **settings)
    error = {"dop853": 1e-12, "esdirk4": 1e-8}.get(method, 1e-6)
    assert seen["latches/base-cart.slide/time"][-1] == pytest.approx(np.sqrt(2 * 0.5 / 3.0), rel=error)
    assert seen["latches/base-cart.slide/loss"][-1] == pytest.approx(6.0 * 0.5, rel=2 * error)
    assert seen["q"][-1, 0] == 0.5 and seen["u"][-1, 0] == 0.0
    assert seen["joints/base-cart/drive"][-1, 0] == pytest.approx(-6.0, rel=1e-9)


@pytest.mark.parametrize("method", ["dop853", "esdirk4"])
def test_resumed_run_with_latches_is_exact(method):
    model = wing()
    times = np.linspace(0.0, 2.5, 5000)
    solver = integrator(method, rtol=1e-7, atol=1e-8)
    whole = solver.solve(model, times, model.x0)
    blocks = list(solver.blocks(model, times, model.x0))
    assert len(blocks) >= 4
    for k in range(len(blocks) - 1):
        rest = solver.solve(model, times, model.x0, state=blocks[k].resume)
        joined = np.concatenate([*(b.states for b in blocks[: k + 1]), rest.states])
        assert np.array_equal(joined, whole.states)


def closing_bars(spin=0.4):
    """A free four-bar that a spring unfolds until its crank latches; the loop is closed by an ordinary revolute."""
    system = four_bar(speed=0.0)
    _, crank, coupler, rocker = system.joints
    root = free("ground", u0=[0.1, -0.2, 0.05, 0.1, -0.05, spin])
    crank = replace(crank, stiffness=np.array([20.0]), rest=np.array([1.2]), latches=(Latch(0, 0.8),), q0=crank.q0)
    return compile_system(replace(system, joints=(root, crank, coupler, rocker)))


def test_impact_with_loop_matches_dense_equations():
    model = closing_bars()
    x, k = model.x0.copy(), [name for name, _ in model.system.velocity_names()].index("drive.angle_rate")
    x[model.n_q : model.n_q + model.n_u] += np.random.default_rng(4).normal(size=model.n_u)
    model.project(0.0, x, model.table, model.pool, model.work)
    u, M, A = model.parts(x)[1].copy(), model.mass_matrix(0.0, x), model.constraints.matrix(0.0, x)
    B = np.vstack([A, np.eye(model.n_u)[k]])  # loops and the latch
    change = -np.linalg.solve(M, B.T) @ np.linalg.pinv(B @ np.linalg.solve(M, B.T), rcond=1e-10) @ (B @ u)
    crank = next(i for i, (name, _) in enumerate(model.system.coordinate_names()) if name == "drive.angle")
    latch = model.system.joints[1].latches[0].model_copy(update={"at": x[crank]})  # where it is, so no loop opens
    moved = replace(model.system.joints[1], latches=(latch,), q0=np.zeros(1))
    joints = (model.system.joints[0], moved, *model.system.joints[2:])
    replace(model, system=replace(model.system, joints=joints)).events.apply([0], 1.5, x)
    assert model.parts(x)[1] == pytest.approx(u + change, abs=1e-11)
    names = [name for name, _ in model.system.all_state_names()]
    lost = 0.5 * (u @ M @ u - (u + change) @ M @ (u + change))
    assert lost > 0.01 and x[names.index("drive.latch_loss")] == pytest.approx(lost, rel=1e-10)


@pytest.mark.parametrize("method", ["dop853", "esdirk4"])
def test_impact_with_loop_conserves_momentum(method):
    model = closing_bars()
    settings = {"rtol": 1e-8, "atol": 1e-9} if method == "esdirk4" else TIGHT
    error = 1e-6 if method == "esdirk4" else 1e-9
    times, _, seen = run(model, 2.0, 201, method, **settings)
    locked = seen["latches/drive.angle/time"][-1]
    assert 0 < locked < 2
    for name in ("monitors/momentum", "monitors/angular_momentum"):
        assert seen[name] == pytest.approx(
            np.tile(seen[name][0], (len(times), 1)), abs=error * np.abs(seen[name]).max()
        )
    loss = seen["latches/drive.angle/loss"]
    assert loss[-1] > 0.05
    assert seen["monitors/energy"] + loss == pytest.approx(np.full(len(times), seen["monitors/energy"][0]), abs=error)
    assert seen["monitors/constraint_position"].max() < 1e-11
    assert seen["monitors/constraint_velocity"].max() < 1e-10
    after = times > locked
    still = [i for i, (name, _) in enumerate(model.system.velocity_names()) if "angle" in name]
    assert np.abs(seen["u"][after][:, still]).max() < 1e-11  # one freedom: the linkage is rigid from then on


@pytest.mark.sampled(2)
@pytest.mark.parametrize("depth", [1e-3, 1e-5, 1e-7])
@pytest.mark.parametrize("method", ["dop853", "esdirk4"])
def test_grazing_latch_within_a_step_is_detected(method, depth):
    """A swing of amplitude 1 comes to a latch `depth` short of its turning point, at arccos(1 - depth) before it."""
    cart = prismatic("cart", stiffness=2.0, q0=[-1.0], latches=(Latch(0, 1.0 - depth),))
    model = compile_system(System({"cart": rigid_body(2.0, np.eye(3))}, (cart,)))
    tight = TIGHT if method == "dop853" else {"rtol": 1e-11, "atol": 1e-12}
    _, _, seen = run(model, 7.0, 8, method, **tight)
    before = np.arccos(1.0 - depth)
    error = {"dop853": 1e-10, "esdirk4": 1e-8}[method] / before  # of q, through its slope there
    assert seen["latches/base-cart.slide/time"][-1] == pytest.approx(np.pi - before, abs=error)
    missed = replace(cart, latches=(Latch(0, 1.0 + depth),))
    model = compile_system(System({"cart": rigid_body(2.0, np.eye(3))}, (missed,)))
    _, _, seen = run(model, 7.0, 8, method, **tight)
    assert seen["latches/base-cart.slide/locked"][-1] == 0.0
