"""Beams that deploy: against the travelling beam's equation, closed forms and invariants (THEORY section 6)."""

from itertools import pairwise

import numpy as np
import pytest
from support.inextensible import swing
from support.members import TIP, UNIT, first_mode, hub_with_arms, solved, wall_beam
from support.pde import beam_from_a_wall

from femflex.deployment import (
    DeployingLine,
    DeployingStrip,
    ElementFunctions,
    StripFunctions,
    deploying_line,
    deploying_strip,
)
from femflex.dynamics import compile_system
from femflex.fem import Member, build_structure
from femflex.fem.sections import StiffnessSection
from femflex.integrate import integrator
from femflex.mesh import line
from femflex.reduction import (
    BeamFunctions,
    UniformBeam,
    beam_body,
    cantilever_modes,
    reduce_structure,
    with_derivatives,
)
from femflex.system import Profile, System, weld
from femflex.warning import PhysicsWarning

CLAMPED = 1.8751040687119611  # root of cos x cosh x = -1

MOTIONS = {  # length, number of functions (or the functions), tolerance relative to the initial deflection
    "slow": (Profile.polynomial(1.0, 0.02), 4, 1e-5),
    "medium": (Profile.polynomial(1.0, 0.3), 4, 4e-5),
    "fast": (Profile.polynomial(1.0, 1.0), 8, 1e-4),
    "retraction": (Profile.polynomial(2.5, -0.3), 4, 6e-5),
    "ramp": (Profile.smooth_step(0.5, 4.0, 1.0, 2.0), 6, 1e-4),
    "sine": (Profile.sine(0.3, 2.0, 0.0, 1.5), 6, 4e-5),
    "elements": (Profile.polynomial(1.0, 0.3), ElementFunctions(y=4, elements=10), 1e-4),
}
TIMES = np.linspace(0, 3, 16)
LATE = ("slow", "fast", "retraction", "ramp", "sine", "elements")  # the slow suite


@pytest.mark.parametrize("name", [pytest.param(n, marks=[pytest.mark.slow] * (n in LATE)) for n in MOTIONS])
def test_beam_from_wall_matches_differential_equation(name):
    length, n, tolerance = MOTIONS[name]
    exact = beam_from_a_wall(length, (first_mode, np.zeros_like), TIMES, count=9 if name == "sine" else 8)
    more = {"n": n} if isinstance(n, int) else {"functions": n}
    seen = solved(wall_beam(length, until=3.0, **more), TIMES)[2]
    found = seen["markers/beam.tip/position"][:, 1]
    assert np.abs(found - exact(1.0)).max() < tolerance * TIP
    assert seen["markers/beam.tip/position"][:, 0] == pytest.approx(length(TIMES)[0], abs=2e-5)


def bent(body, variation, tips):
    """A member from a wall, bent in its first shape in each plane."""
    delta, rows = np.zeros(body.n_modes), body.marker("tip").phi[1:, : len(tips)]
    planes = np.flatnonzero(np.abs(rows).max(axis=1) > 1e-6)
    delta[: len(tips)] = np.linalg.solve(rows[planes], tips)
    varying = {} if variation is None else {"beam": variation}
    return System({"beam": body}, (weld("beam", child_marker="root"),), varying=varying, delta0={"beam": delta}), planes


def forms(length, tips, until):
    """The beam as a deploying one; in one plane a sheet; at constant length without mesh and, in one plane, meshed."""
    functions = BeamFunctions(y=3, z=3 * (len(tips) > 1))
    yield deploying_line(UNIT, functions, length, until=until)[:2]
    if len(tips) == 1:
        strip = DeployingStrip(mass_per_length=1.0, width=0.25, bending_stiffness=4.0)
        yield deploying_strip(strip, StripFunctions(BeamFunctions(z=3)), length, until=until)[:2]
    if not length.moves:
        yield beam_body(UniformBeam(1.0, 1e6, 1.0, 1.0, 1.0, 1.0), functions, strain="condensed"), None
    if not length.moves and len(tips) == 1:
        section = StiffnessSection(EA=1e7, EIy=1.0, EIz=1.0, GJ=1.0, mass_per_length=1.0)
        member = Member("line", "beam", section, None, {"orientation": [0, 1, 0]})
        structure = build_structure(line([[0, 0, 0], [1, 0, 0]], 12), [member])
        modes = with_derivatives(structure, cantilever_modes(structure, "start", 6), "all")
        yield reduce_structure(structure, modes, {"root": "start", "tip": "end"}, strain="condensed"), None


TEN = np.linspace(0.0, 20 * np.pi / CLAMPED**2, 101)  # periods of small motions
SWINGS = {  # length, deflection of the tip over that at the start, times
    "a tenth": (Profile.constant(1.0), (0.1,), TEN),
    "a twentieth": (Profile.constant(1.0), (0.05,), TEN),
    "in two planes": (Profile.constant(1.0), (0.1, 0.06), TEN),
    "deploying": (Profile.smooth_step(0.0, 8.0, 1.0, 1.8), (0.1,), np.linspace(0, 15, 76)),
    "retracting in two planes": (Profile.smooth_step(0.0, 4.0, 1.0, 0.7), (0.1, 0.06), np.linspace(0, 6, 61)),
}


@pytest.mark.parametrize("name", [pytest.param(n, marks=[pytest.mark.slow] * (n != "deploying")) for n in SWINGS])
def test_large_swings_are_those_of_an_inextensible_beam(name):
    """The curvature energy EI (w' w'')^2 / 2 all but cancels the inertia of foreshortening."""
    length, tips, times = SWINGS[name]
    shapes = [lambda xi, tip=tip: tip / TIP * first_mode(xi) for tip in tips]
    exact = swing(lambda t: length(np.array(t)), shapes, times)
    for body, variation in forms(length, tips, times[-1]):
        system, planes = bent(body, variation, tips)
        found = solved(system, times)[2]["markers/beam.tip/position"][:, 1 + planes]
        assert np.abs(found - exact).max() < 2e-4 * np.abs(exact).max()


def test_terms_of_large_bends_are_switched_off_by_degree():
    """Without K3 or the whole of nonlinear strain: as a member of linear strain, by K3 with its foreshortening."""
    length = Profile.smooth_step(0.0, 8.0, 1.0, 1.8)
    model = compile_system(wall_beam(length, 3, 8.0, tip=0.1))
    with pytest.warns(PhysicsWarning, match="linear strain"):
        linear = compile_system(wall_beam(length, 3, 8.0, tip=0.1, strain="linear"))
    x = model.x0
    assert model.without("nonlinear_strain").state_rate(3.0, x) == pytest.approx(linear.state_rate(3.0, x), abs=1e-12)
    row = model.terms(np.array([3.0]), x[None])["elastic_K3"][0]
    lost = model.mass_matrix(3.0, x) @ (model.without("K3").state_rate(3.0, x) - model.state_rate(3.0, x))[3:]
    assert np.abs(row).max() > 1e-3
    assert lost == pytest.approx(row, abs=1e-12)


@pytest.mark.slow
def test_error_falls_with_the_number_of_functions():
    """Convergence at the fast rate: two, three and six functions."""
    length, times = Profile.polynomial(1.0, 1.0), np.linspace(0, 3, 16)
    exact = beam_from_a_wall(length, (first_mode, np.zeros_like), times, count=8)(1.0)
    errors = []
    for n in (1, 2, 4, 6):
        found = solved(wall_beam(length, n), times)[2]["markers/beam.tip/position"][:, 1]
        errors.append(np.abs(found - exact).max() / TIP)
    assert all(finer < coarser / 2.5 for coarser, finer in pairwise(errors)), errors
    assert errors[-1] < 1e-4


@pytest.mark.slow
def test_energy_of_transverse_motion_falls_by_what_the_root_takes():
    """dE/dt = -U EI w''(0)^2 / 2 at constant U, E = int [m' (w_t + U w_x)^2 + EI w_xx^2] / 2 dx."""
    U, times = 0.3, np.linspace(0, 5, 401)
    system = wall_beam(Profile.polynomial(1.0, U), 8)
    _model, states, _ = solved(system, times, 1e-11)
    shapes = deploying_line(UNIT, BeamFunctions(y=8), Profile.constant(1.0)).shapes
    xi, w = (np.polynomial.legendre.leggauss(60)[0] + 1) / 2, np.polynomial.legendre.leggauss(60)[1] / 2
    f0, f1, f2 = (shapes.fields(xi, d)[:, 1] for d in range(3))
    root = shapes.fields(np.zeros(1), 2)[0, 1]
    L, q, u = 1.0 + U * times, states[:, :8], states[:, 8:16]
    velocity = u @ f0.T + (U / L)[:, None] * (1 - xi) * (q @ f1.T)
    E = (velocity**2 @ w * L + (q @ f2.T) ** 2 @ w / L**3) / 2
    taken = U / 2 * (q @ root / L**2) ** 2
    lost = np.concatenate([[0], np.cumsum((taken[1:] + taken[:-1]) / 2 * np.diff(times))])
    assert E[0] - E[-1] > 0.3 * E[0]
    assert E == pytest.approx(E[0] - lost, abs=2e-3 * E[0])


@pytest.mark.slow
def test_slow_deployment_keeps_energy_over_frequency():
    """So the tip's amplitude grows as sqrt(L) in metres and falls as 1 / sqrt(L) relative to the length."""
    U, times = 0.01, np.linspace(0, 60, 1501)
    found = solved(wall_beam(Profile.polynomial(1.0, U), 2, 60.0), times, 1e-9)[2]
    tip = np.abs(found["markers/beam.tip/position"][:, 1])
    early, late = tip[times < 4].max(), tip[times > 54].max()
    lengths = [1 + U * times[np.argmax(tip * mask)] for mask in (times < 4, times > 54)]
    assert late / early == pytest.approx(np.sqrt(lengths[1] / lengths[0]), rel=0.01)


@pytest.mark.parametrize(("rate", "acceleration"), [(0.4, 0.0), (0.4, 0.3), (-0.4, 0.0), (-0.4, 0.3), (0.0, 0.5)])
def test_force_of_the_drum_is_that_of_momentum(rate, acceleration):
    """Deploying m' L dU/dt + m' U^2, retracting m' L dU/dt; the parent feels the whole momentum's rate."""
    line = DeployingLine(mass_per_length=2.0)
    length = Profile.polynomial(3.0, rate, acceleration / 2)
    model = compile_system(wall_beam_rigid(line, length))
    seen = model.observe(np.zeros(1), model.x0[None])
    L, U, A = (v[0] for v in length(np.zeros(1)))
    flux = 2.0 * U * U
    assert seen["bodies/beam/drum_force"][0] == pytest.approx(2.0 * L * A + flux * (U > 0), abs=1e-12)
    assert seen["bodies/beam/pickup_loss"][0] == pytest.approx(2.0 * abs(U) ** 3 / 2, abs=1e-14)
    assert seen["bodies/beam/exit_flux"][0] == pytest.approx(flux)
    assert seen["bodies/beam/drum_power"][0] == pytest.approx(seen["bodies/beam/drum_force"][0] * U, abs=1e-12)
    force = next(v for k, v in seen.items() if k.startswith("joints/") and k.endswith("/force"))
    assert np.abs(force[0]).max() == pytest.approx(abs(2.0 * L * A + flux), abs=1e-12)  # m' U^2 is in it, once


def wall_beam_rigid(line, length):
    """A member that stays straight, from a wall."""
    body, variation, *_ = deploying_line(line, None, length, until=1.0)
    return System({"beam": body}, (weld("beam", child_marker="root"),), varying={"beam": variation}, reactions=True)


def test_spin_of_a_hub_falls_as_rigid_arms_come_out():
    """I omega = H with I of the hub, two arms and what is still stowed."""
    r, m, stock = 0.5, 0.8, 6.0
    arms = {}
    for name, sign in (("left", 1.0), ("right", -1.0)):
        line = DeployingLine(mass_per_length=m, root=(sign * r, 0, 0), direction=(sign, 0, 0))
        arms[name] = (line, None, Profile.smooth_step(0.0, 4.0, 0.5, 5.0), {"stock": stock})
    times = np.linspace(0, 6, 13)
    _model, _states, seen = solved(hub_with_arms(arms), times)
    L = Profile.smooth_step(0.0, 4.0, 0.5, 5.0)(times)[0]
    inertia = 5.0 + 2 * m * (((r + L) ** 3 - r**3) / 3 + (stock - L) * r**2)
    assert seen["bodies/hub/rate"][:, 2] == pytest.approx(0.5 * inertia[0] / inertia, rel=1e-9)


def two_arms(strain="condensed"):
    """A tumbling free hub with two bending, twisting arms in skew directions, each at its own rate."""
    beam = {"EIy": 2.0, "EIz": 3.0, "GJ": 1.0, "ry": 0.02, "rz": 0.03, "rotary_inertia": True}
    first = DeployingLine(mass_per_length=0.3, root=(0.5, 0.1, 0), direction=(1, 0.3, 0.2), **beam)
    second = DeployingLine(mass_per_length=0.2, root=(-0.2, 0.4, 0.1), direction=(-0.3, 1, 0.5), **beam)
    functions = BeamFunctions(y=2, z=2, torsion=1)
    return hub_with_arms(
        {
            "a": (first, functions, Profile.smooth_step(0.0, 3.0, 1.0, 3.0), {"stock": 4.0, "strain": strain}),
            "b": (second, functions, Profile.sine(0.4, 1.5, 0.0, 2.0), {"stock": 4.0, "strain": strain}),
        },
        (0.1, -0.2, 0.3),
    )


def energy_rate(model, t, x, h=1e-5):
    """dE/dt along the motion at a state, by a central difference."""
    rate = model.state_rate(t, x)
    seen = model.observe(np.array([t - h, t + h]), np.stack([x - h * rate, x + h * rate]))
    return np.diff(seen["monitors/energy"])[0] / (2 * h)


def test_invariants_of_a_free_hub_with_two_arms():
    """Momentum, angular momentum and mass stay; the energy gains what the drums give less what the exits take."""
    times = np.linspace(0, 6, 13)
    model, states, seen = solved(two_arms(), times, 1e-12)
    H, p = seen["monitors/angular_momentum"], seen["monitors/momentum"]
    assert np.abs(H - H[0]).max() < 1e-10 * np.linalg.norm(H[0])
    assert np.abs(p - p[0]).max() < 1e-10
    assert np.ptp(seen["bodies/a/mass"]) < 1e-14
    total = sum(body.moments.mass for body in model.system.bodies.values())
    assert total == pytest.approx(20.0 + 0.3 * 4 + 0.2 * 4, rel=1e-14)
    balance_of_drums(model, times, states, seen, "ab")


def balance_of_drums(model, times, states, seen, names):
    """The energy changes by the drums' power less the loss at the exits, and that power is force times rate."""
    drums = sum(seen[f"bodies/{name}/drum_power"] for name in names) - seen["monitors/pickup_loss"]
    assert drums == pytest.approx(seen["monitors/variation_power"], abs=1e-12)
    rates = [energy_rate(model, t, x) for t, x in zip(times, states, strict=True)]
    assert np.abs(drums).max() > 1e-3
    assert drums == pytest.approx(rates, abs=1e-7 * np.abs(rates).max())
    for name in names:  # the force of the drum, from momentum alone, works on the rate of the length
        power = seen[f"bodies/{name}/drum_force"] * seen[f"bodies/{name}/length_rate"]
        assert power == pytest.approx(seen[f"bodies/{name}/drum_power"], abs=1e-11)


def test_terms_of_a_deployment_are_rows_of_their_own_and_sum_to_zero():
    model = compile_system(two_arms())
    x = model.x0 + 0.01 * np.sin(np.arange(model.n_x))
    rows = model.terms(np.array([1.3]), x[None])
    assert {"moving_mass", "gyroscopic", "specified_motion"} <= set(rows)
    largest = max(np.abs(row).max() for row in rows.values())
    assert np.abs(sum(rows.values())).max() < 1e-11 * largest
    for name in ("moving_mass", "gyroscopic", "specified_motion"):
        assert np.abs(model.without(name).state_rate(1.3, x) - model.state_rate(1.3, x)).max() > 1e-4
    units = np.array([np.concatenate([model.parts(x)[0], u, model.parts(x)[2]]) for u in np.eye(model.n_u)])
    linear = model.terms(np.full(model.n_u, 1.3), units)
    linear = (linear["moving_mass"] + linear["gyroscopic"]).T
    symmetric = (linear + linear.T) / 2
    step = 1e-5
    slope = (model.mass_matrix(1.3 + step, x) - model.mass_matrix(1.3 - step, x)) / (2 * step)
    assert symmetric == pytest.approx(slope, abs=1e-7 * np.abs(slope).max())  # M_t


def test_stopped_deployment_matches_constant_length():
    """At rest again from t = 4 s on: restarted there with a fixed length."""
    length, times = Profile.smooth_step(0.0, 4.0, 1.0, 2.0), np.linspace(0, 6, 13)
    _model, states, _seen = solved(wall_beam(length, 4, 6.0, reference=1.0), times, 1e-12)
    fixed = compile_system(wall_beam(Profile.constant(2.0), 4, 6.0, reference=1.0))
    after = integrator("dop853", rtol=1e-12, atol=1e-14).solve(fixed, times[8:] - 4.0, states[8])
    assert after.states == pytest.approx(states[8:], abs=1e-9 * np.abs(states[8]).max())


@pytest.mark.parametrize("drum", ["root", "tip"])
def test_drum_at_tip_keeps_momentum_and_energy(drum):
    line = DeployingLine(mass_per_length=0.3, EIy=2.0, EIz=2.0, root=(0.5, 0, 0.2), direction=(1, 0.5, 0))
    arms = {"a": (line, BeamFunctions(y=2, z=2), Profile.sine(0.4, 1.5, 0.0, 2.0), {"stock": 4.0, "drum": drum})}
    times = np.linspace(0, 4, 9)
    model, states, seen = solved(hub_with_arms(arms, (0.1, 0.2, 0.3), 4.0), times, 1e-12)
    H = seen["monitors/angular_momentum"]
    assert np.abs(H - H[0]).max() < 1e-10 * np.linalg.norm(H[0])
    balance_of_drums(model, times, states, seen, "a")
