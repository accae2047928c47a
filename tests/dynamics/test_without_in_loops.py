"""Terms switched off in systems with loops and constraints: the constrained equations with what forces are left."""

from dataclasses import replace

import numpy as np
import pytest
from support.mechanisms import flexible_four_bar, floating_loop, four_bar, sleigh
from support.pointwise import Jet, Tree, equations, partial_velocities, skew
from support.random_loops import random_loops
from test_equations import elastic_forces, frozen, orbital_frame
from test_loops import dense, no_force, solved
from test_terms import KINDS, STRONG, one

from femflex.dynamics import compile_system
from femflex.dynamics.terms.by_source import SWITCHED
from femflex.integrate import integrator
from femflex.system import Frame, Profile, free
from femflex.warning import PhysicsWarning

RATE = KINDS["spinning"]["frame"].rate
TIGHT = {"dop853": {}, "esdirk4": {"rtol": 1e-9, "atol": 1e-10}, "generalized_alpha": {"rtol": 1e-8, "atol": 1e-9}}


def base_of(kind):
    """Jet of the base frame, what pulls at mass points, and whether the root's translation is eliminated."""
    if kind == "inertial":
        return frozen(np.eye(3)), no_force, False
    if kind == "spinning":
        W = skew(RATE)
        return (lambda moving: Jet(np.eye(3), W, W @ W) if moving else Jet(np.eye(3))), no_force, False
    C, omega, alpha, up, k = orbital_frame(STRONG)
    W = np.array([[0, 0, 0], [0, 0, -omega], [0, omega, 0]])

    def base(moving):
        return Jet(C, C @ W, C @ (W @ W + W * alpha / omega)) if moving else Jet(C)

    return base, lambda m, r: -k * m[:, None] * (r - 3 * np.outer(r @ up, up)), True


def split(system, clouds, q, u, kind):
    """The terms of h that can be switched off in the equations, each from inertia forces of points, and the rest."""
    base, force, hidden = base_of(kind)
    tree = Tree(system, clouds)
    partial = partial_velocities(tree, q, len(u), base)

    def inertia(u, force=no_force):
        return equations(tree, q, u, 0 * u, base, force, hidden, partial)

    forth, back, rest = inertia(u), inertia(-u), inertia(0 * u)
    parts = {
        "coriolis_centrifugal": (forth + back) / 2 - rest,
        "gyroscopic": (forth - back) / 2,
        "specified_motion": rest,
        "gravity_gradient": inertia(0 * u, force) - rest,
    }
    return parts, elastic_forces(system, q, u)


OF_KIND = {"inertial": 1, "spinning": 3, "specified orbit": 4}  # how many of the terms there are
CHOICES = [
    (kind, names)
    for kind, n in OF_KIND.items()
    for names in dict.fromkeys((*((name,) for name in SWITCHED[:n]), SWITCHED[:n]))
]


@pytest.mark.sampled(3)
@pytest.mark.parametrize("seed", [1, *(pytest.param(seed, marks=pytest.mark.slow) for seed in range(2, 6))])
@pytest.mark.parametrize(("kind", "names"), CHOICES, ids=lambda v: v if isinstance(v, str) else "+".join(v))
def test_flexible_loops_move_as_the_dense_equations_without_the_term(kind, names, seed):
    system, clouds, (q, u) = random_loops(seed, 2, **{"root": free} | KINDS[kind])
    base, force, hidden = base_of(kind)
    u, M, _, A, swept = dense(system, clouds, q, u, base, force, hidden)
    parts, rest = split(system, clouds, q, u, kind)
    expected, _ = solved(M, rest + sum(part for name, part in parts.items() if name not in names), A, swept)
    model, x = compile_system(system), np.concatenate([q, u])
    less = model.without(*names)
    udot = less.state_rate(0.0, x)[model.n_q :]
    scale = np.abs(expected).max()
    assert np.abs(model.state_rate(0.0, x)[model.n_q :] - udot).max() > 1e-3 * scale
    assert udot == pytest.approx(expected, abs=1e-9 * scale)
    assert np.abs(A @ udot + swept).max() < 1e-10 * np.abs(A).max() * max(scale, 1.0)
    check_balance(less, model, x, names)


def check_balance(less, model, x, names, t=0.0):
    """Eq. (9) without the terms closes at 1e-10, and what is left is what it was."""
    left, full = one(less, x, t), one(model, x, t)
    assert set(full) - set(left) == set(names)
    size = max(np.abs(row).max() for row in left.values())
    assert np.abs(sum(left.values())).max() <= 1e-10 * size
    for name in set(left) - {"inertia"}:
        if not name.startswith(("loops/", "constraints/", "drives/")):
            assert left[name] == pytest.approx(full[name], abs=1e-12 * size)


def led_four_bar():
    """A four-bar whose crank is driven: the loop and the drive leave no freedom."""
    system = four_bar(speed=3.0)
    drive = system.joint_of("crank")
    led = replace(drive, motion=(Profile.polynomial(0.3, 3.0, 0.4),), q0=[0.3], u0=[3.0])
    return replace(system, joints=tuple(led if joint is drive else joint for joint in system.joints))


def test_a_driven_loop_moves_as_it_must_whatever_is_left_out():
    model = compile_system(led_four_bar())
    names = ("coriolis_centrifugal", "specified_motion", "moving_mass")
    for chosen in (*((name,) for name in names), names):
        less = model.without(*chosen)
        assert less.state_rate(0.0, model.x0) == pytest.approx(model.state_rate(0.0, model.x0), abs=1e-10)
        check_balance(less, model, model.x0, chosen)
    force = "loops/closure"
    assert np.abs(one(less, model.x0)[force] - one(model, model.x0)[force]).max() > 1e-2  # but not held by the same


SPUN = {"frame": Frame("spinning", np.array([0.1, -0.2, 1.5]))}
FREE_TERMS = {
    "rigid": (replace(four_bar(speed=3.0), **SPUN), ("coriolis_centrifugal",)),
    "flexible": (replace(flexible_four_bar(), **SPUN), ("coriolis_centrifugal", "gyroscopic")),
    "sleigh": (sleigh(1.7), ("coriolis_centrifugal",)),
}


@pytest.mark.parametrize("which", ["rigid", "sleigh", pytest.param("flexible", marks=pytest.mark.slow)])
def test_runs_without_a_term_keep_their_loops_closed_with_every_method(which):
    system, names = FREE_TERMS[which]
    model = compile_system(system)
    less, times, ends = model.without(*names), np.linspace(0, 0.5, 11), []
    for method, settings in TIGHT.items():
        states = integrator(method, **settings).solve(less, times, less.x0).states
        seen = less.observe(times, states)
        assert seen["monitors/constraint_position"].max() < 1e-10
        assert seen["monitors/constraint_velocity"].max() < 1e-10
        ends.append(states[-1])
    assert ends[1] == pytest.approx(ends[0], abs=1e-5)
    assert ends[2] == pytest.approx(ends[0], abs=1e-4)
    whole = integrator("dop853").solve(model, times, model.x0).states[-1]
    assert np.abs(whole - ends[0]).max() > 1e-3
    check_balance(less, model, ends[0], names)


def test_a_spinning_loop_without_all_that_its_frame_does_is_one_at_rest():
    still = compile_system(flexible_four_bar())
    less = compile_system(replace(flexible_four_bar(), **SPUN)).without("gyroscopic", "specified_motion")
    times = np.linspace(0, 0.5, 6)
    runs = [integrator("dop853").solve(model, times, still.x0).states for model in (still, less)]
    assert runs[1] == pytest.approx(runs[0], abs=1e-8)


def test_a_loop_flying_in_orbit_without_gravity_and_frame_keeps_its_energy():
    orbit = replace(STRONG, eccentricity=0.0, mu=5e18, free=True)
    flying = replace(floating_loop(), orbit=orbit, frame=Frame("orbital"))
    less = compile_system(flying).without("gravity_gradient", "gyroscopic", "specified_motion")
    times = np.linspace(0, 1, 11)
    states = integrator("dop853").solve(less, times, less.x0).states
    seen = compile_system(floating_loop()).observe(times, states)
    energy = seen["monitors/energy"]
    assert energy == pytest.approx(np.full(11, energy[0]), abs=1e-9 * np.abs(energy).max())
    assert seen["monitors/constraint_position"].max() < 1e-10


def test_a_sleigh_without_centrifugal_force_turns_in_place():
    """Nothing pulls the mass ahead of the blade forward: m vdot = 0 and J omegadot = -m a v omega with v = 0."""
    model = compile_system(sleigh(1.7))
    less, times = model.without("coriolis_centrifugal"), np.linspace(0, 3, 13)
    u = integrator("dop853").solve(less, times, less.x0).states[:, model.n_q :]
    assert u == pytest.approx(np.tile([0, 0, 0, 0, 0, 1.7], (13, 1)), abs=1e-10)
    assert integrator("dop853").solve(model, times, model.x0).states[-1, -1] < 1.0


def test_what_joints_carry_is_left_out_with_a_sentence():
    model = compile_system(replace(flexible_four_bar(), reactions=True))
    with pytest.warns(PhysicsWarning, match="forces in joints are left out .* coriolis_centrifugal is switched off"):
        less = model.without("coriolis_centrifugal")
    gone = set(model.channels) - set(less.channels)
    joints = ("base-ground", "drive", "crank-coupler", "ground-rocker")
    assert gone == {f"joints/{name}/{what}" for name in joints for what in ("force", "torque")}
    seen = less.observe(np.zeros(1), less.x0[None])
    assert set(seen) == set(less.channels) and "loops/closure/force" in seen


def test_terms_and_the_loop_itself_may_go_together():
    model = compile_system(flexible_four_bar())
    open_ = model.without("closure", "coriolis_centrifugal")
    x = model.x0
    expected = model.without("coriolis_centrifugal").without("closure")
    assert open_.constraints is None and expected.omitted == ("coriolis_centrifugal", "loops/closure")
    found = open_.state_rate(0.0, x)
    assert np.array_equal(found, expected.state_rate(0.0, x))
    balance = one(open_, x)
    assert np.abs(sum(balance.values())).max() <= 1e-10 * max(np.abs(row).max() for row in balance.values())
