"""Lengths that are coordinates: falling chains, brakes, and loads at the tip (THEORY section 6)."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from support.members import falling_chain, hub_with_arms, solved

from femflex.body import rigid_body
from femflex.deployment import DeployingLine, Reel, StringFunctions, deploying_line
from femflex.dynamics import compile_system
from femflex.dynamics.observe.diagnosis import length_limit_text
from femflex.integrate import IntegrationError, integrator
from femflex.reduction import BeamFunctions
from femflex.system import (
    Effector,
    Environment,
    Frame,
    Load,
    Orbit,
    Profile,
    Spring,
    System,
    free,
    revolute,
    spherical,
    universal,
    weld,
)

G = 9.81


def test_chain_falling_from_heap_accelerates_at_third_of_gravity():
    """m' L dU/dt + m' U^2 = m' L g: U^2 = 2 g L / 3 once the start is forgotten; without Q_L it would be g/2."""
    L0 = 0.5
    reel = Reel("reel", L0, np.sqrt(2 * G * L0 / 3))
    times = np.linspace(0, 2, 9)
    model, _, seen = solved(falling_chain(reel), times)
    L = (np.sqrt(L0) + np.sqrt(G / 6) * times) ** 2
    assert seen["bodies/chain/length"] == pytest.approx(L, rel=1e-9)
    assert seen["bodies/chain/length_acceleration"] == pytest.approx(G / 3, rel=1e-9)
    assert seen["bodies/chain/drum_force"] == pytest.approx(0.0, abs=1e-9)
    U = seen["bodies/chain/length_rate"]
    assert seen["monitors/pickup_loss"] == pytest.approx(2.0 * U**3 / 2)
    lost = 2.0 * G * L**2 / 2 - 2.0 * L * U**2 / 2  # weight's work from L = 0 less kinetic energy: a third of it
    assert lost == pytest.approx(2.0 * G * L**2 / 6)
    assert model.n_z == 2


def test_retracted_chain_force_has_no_momentum_flux():
    """Retracting: m' L dU/dt = F, and m' |U|^3 / 2 is lost."""
    reel = Reel("reel", 5.0, -1.0, tension=3.0)
    model = compile_system(falling_chain(reel, gravity=0.0))
    rate = model.state_rate(0.0, model.x0)
    assert rate == pytest.approx([-1.0, -3.0 / (2.0 * 5.0)])
    assert model.observe(np.zeros(1), model.x0[None])["monitors/pickup_loss"] == pytest.approx(2.0 / 2)


@pytest.mark.parametrize("speed", [0.7, -0.7])
def test_weight_drum_and_brake_enter_the_same_equation(speed):
    """(m' L + m_t + m_d) dU/dt + m' U^2 [U > 0] = (m' L + m_t) g - T - c U, the weight a body on the tip."""
    reel = Reel("reel", 4.0, speed, tension=20.0, damping=3.0, stiffness=1.0, rest=3.5, mass=1.3)
    times = np.linspace(0, 1.0, 5)
    seen = solved(falling_chain(reel, tip_mass=5.0), times)[2]

    def equation(t, x):
        L, U = x
        pull = 20.0 + 3.0 * U + (L - 3.5)
        return [U, ((2 * L + 5) * G - pull - 2 * U * U * (U > 0)) / (2 * L + 5 + 1.3)]

    exact = solve_ivp(equation, (0, 1.0), [4.0, speed], t_eval=times, rtol=1e-11, atol=1e-12, max_step=1e-3).y
    assert seen["bodies/chain/length"] == pytest.approx(exact[0], rel=1e-5)
    force = seen["bodies/chain/drum_force"] + 1.3 * seen["bodies/chain/length_acceleration"]
    assert force == pytest.approx(-seen["effectors/reel/tension"], abs=1e-9)


def test_two_free_lengths_on_a_tumbling_hub_balance():
    """Energy falls by brakes and exits alone; angular momentum stays; the bending tethers take part."""
    arms, effectors = {}, []
    for name, root, direction in (("a", (0.5, 0, 0), (1, 0.2, 0)), ("b", (-0.5, 0, 0.1), (-1, 0.1, 0.3))):
        EI = 0.1 if name == "b" else 0.0  # a beam, bent by 8 % of its length
        line = DeployingLine(mass_per_length=0.2, root=root, direction=direction, EIy=EI, EIz=EI)
        reel = Reel(f"reel_{name}", 2.0, 0.1, tension=0.02, damping=0.05, mass=0.3)
        effectors.append(reel.effector())
        arms[name] = (line, BeamFunctions(y=1, z=1) if EI else StringFunctions(y=2, z=2), reel, {"stock": 20.0})
    system = hub_with_arms(arms, (0.1, 0.2, 0.9), effectors=tuple(effectors))
    times = np.linspace(0, 4, 9)
    model, states, seen = solved(system, times, 1e-12)
    H = seen["monitors/angular_momentum"]
    assert np.abs(H - H[0]).max() < 1e-10 * np.linalg.norm(H[0])
    assert np.ptp(seen["bodies/a/length"]) > 0.2
    for name in "ab":
        force = seen[f"bodies/{name}/drum_force"] + 0.3 * seen[f"bodies/{name}/length_acceleration"]
        assert force == pytest.approx(-seen[f"effectors/reel_{name}/tension"], abs=1e-9)
    terms = model.terms(times, states)
    assert np.abs(sum(terms.values())).max() < 1e-12 * max(np.abs(rows).max() for rows in terms.values())
    h = 1e-5
    for t, x in zip(times, states, strict=True):
        rate = model.state_rate(t, x)
        both = model.observe(np.array([t - h, t + h]), np.stack([x - h * rate, x + h * rate]))
        here = model.observe(np.array([t]), x[None])
        change = np.diff(both["monitors/energy"])[0] / (2 * h)
        given = sum(here[f"bodies/{n}/drum_power"][0] for n in "ab") - here["monitors/pickup_loss"][0]
        assert change == pytest.approx(given, abs=1e-7)


@pytest.mark.parametrize("orbit", [None, Orbit(60.0, 0.2, mu=2e4), Orbit(60.0, 0.2, mu=2e4, free=True)])
def test_drums_of_loaded_bending_members_have_the_force_that_the_reels_give_at_any_instant(orbit):
    """At a random state, with bodies, a load and a spring at the tips: the report against the equations."""
    rng = np.random.default_rng(8)
    bodies = {"hub": rigid_body(20.0, np.diag([3.0, 4.0, 5.0]), [0.1, -0.1, 0.2])}
    joints, varying, reels, delta = [(spherical if orbit and not orbit.free else free)("hub")], {}, [], {}
    for name, root, direction, mass in (
        ("a", (0.5, 0, 0), (1, 0.2, 0), 0.3),
        ("b", (-0.5, 0, 0.1), (-1, 0.1, 0.3), 0.7),
    ):
        line = DeployingLine(mass_per_length=0.2, root=root, direction=direction)
        reels.append(
            (name, Reel(f"reel_{name}", 2.0, 0.4 if name == "a" else -0.3, tension=0.02, damping=0.05, mass=mass))
        )
        made = deploying_line(line, StringFunctions(y=2, z=1), reels[-1][1], stock=20.0)
        bodies[name], varying[name] = made.body, made.variation
        bodies[f"tip_{name}"] = rigid_body(0.5, np.diag([0.1, 0.2, 0.25]), [0.2, 0.1, -0.1])
        joints += [weld(name, "hub"), revolute(f"tip_{name}", name, axis=(1, 2, 3), parent_marker="tip")]
        delta[name] = 0.1 * rng.normal(size=3)
    acting = {"loads": (Load("jet", "a", "tip", "body", [0.3, -0.2, 0.5]),)}
    acting["springs"] = (
        (Spring("line", "a", "b", "tip", "tip", stiffness=0.4, damping=0.1, length=1.0),) if not orbit else ()
    )
    where = (
        {"environment": Environment(np.array([0.1, -0.3, 0.2]))}
        if orbit is None
        else {"orbit": orbit, "frame": Frame("inertial")}
    )
    system = System(bodies, tuple(joints), varying=varying, delta0=delta,
                    effectors=tuple(reel.effector() for _, reel in reels), **acting, **where)  # fmt: skip
    model = compile_system(system)
    x = model.x0.copy()
    x[model.n_q : model.n_q + model.n_u] = 0.3 * rng.normal(size=model.n_u)
    seen = {path: value[0] for path, value in model.observe(np.zeros(1), x[None]).items()}
    rates = dict(zip([n for n, _ in system.all_state_names()], model.state_rate(0.0, x), strict=True))
    for name, reel in reels:
        acceleration = seen[f"bodies/{name}/length_acceleration"]
        assert acceleration == pytest.approx(rates[f"reel_{name}.speed"]) and abs(acceleration) > 1e-3
        given = seen[f"bodies/{name}/drum_force"] + reel.inertia * acceleration
        assert given == pytest.approx(-seen[f"effectors/reel_{name}/tension"], abs=1e-10)
        assert seen[f"effectors/reel_{name}/tension"] == pytest.approx(0.02 + 0.05 * reel.speed)


def test_brake_deploys_tether_in_orbit():
    """Tension-controlled deployment of a heavy tether with a subsatellite, against its two equations of motion."""
    orbit = Orbit(6.8e6)
    n = orbit.mean_motion
    line, m, m_tip = DeployingLine(mass_per_length=0.01, direction=(0, 1, 0)), 0.01, 50.0
    reel = Reel("reel", 200.0, 2.0, tension=0.1)
    made = deploying_line(line, None, reel, stock=20e3)
    craft = rigid_body(1e9, 1e12 * np.eye(3))
    bodies = {"craft": craft, "tether": made.body, "subsatellite": rigid_body(m_tip, np.eye(3))}
    joints = (
        weld("craft"),
        universal("tether", "craft"),
        weld("subsatellite", "tether", parent_marker="tip"),
    )
    system = System(bodies, joints, varying={"tether": made.variation}, effectors=(reel.effector(),), orbit=orbit,
                    frame=Frame("orbital"), environment=Environment(attraction="gradient"))  # fmt: skip
    times = np.linspace(0, 600, 7)
    seen = solved(system, times)[2]

    def equation(t, x):
        """Heavy tether from a fixed point of a circular orbit, in plane: length and pitch angle from the vertical."""
        L, U, a, w = x
        M, S, J = m * L + m_tip, m * L**2 / 2 + m_tip * L, m * L**3 / 3 + m_tip * L**2
        spin = w + n
        A = (S * (spin**2 + n**2 * (3 * np.cos(a) ** 2 - 1)) - 0.1 - m * U * U * (U > 0)) / M
        alpha = -2 * S * U * spin / J - 3 * n**2 * np.sin(a) * np.cos(a)
        return [U, A, w, alpha]

    exact = solve_ivp(equation, (0, 600), [200.0, 2.0, 0.0, 0.0], t_eval=times, rtol=1e-11, atol=1e-12).y
    assert seen["bodies/tether/length"] == pytest.approx(exact[0], rel=1e-6)
    assert exact[0][-1] > 500


@pytest.mark.parametrize(
    ("method", "options", "error"),
    [("esdirk4", {"rtol": 1e-8, "atol": 1e-10}, 1e-6)],
)
def test_implicit_integrators_take_free_lengths(method, options, error):
    """Two bending tethers with brakes, of which one is stiff to the step, on a tumbling hub: as the explicit method."""
    arms, effectors = {}, []
    for name, root, direction in (("a", (0.5, 0, 0), (1, 0.2, 0)), ("b", (-0.5, 0, 0.1), (-1, 0.1, 0.3))):
        line = DeployingLine(mass_per_length=0.2, root=root, direction=direction)
        reel = Reel(f"reel_{name}", 2.0, 0.1, tension=0.02, damping=0.05 if name == "a" else 30.0, mass=0.3)
        effectors.append(reel.effector())
        arms[name] = (line, StringFunctions(y=1), reel, {"stock": 20.0})
    model = compile_system(hub_with_arms(arms, (0.1, 0.2, 0.9), effectors=tuple(effectors)))
    times = np.linspace(0, 1, 3)
    exact = integrator("dop853", rtol=1e-11, atol=1e-13).solve(model, times, model.x0).states
    found = integrator(method, **options).solve(model, times, model.x0).states
    assert np.abs(found - exact).max() < error


@pytest.mark.parametrize(
    ("reel", "sentence"),
    [
        (Reel("reel", 4.0, 2.0), r"the free length of body 'chain' has reached .*, stock = 5 m, at \d"),
        (Reel("reel", 1.0, -2.0, tension=5.0), r"the free length of body 'chain' has reached zero at -\d"),
    ],
)
def test_message_names_limit_of_free_length(reel, sentence):
    line = DeployingLine(mass_per_length=2.0, direction=(0, 0, -1))
    made = deploying_line(line, None, reel, stock=5.0)
    system = System({"chain": made.body}, (weld("chain"),), varying={"chain": made.variation},
                    effectors=(reel.effector(5.0),))  # fmt: skip
    model = compile_system(system)
    assert length_limit_text(model, 0.0, model.x0) == ""
    with pytest.raises(IntegrationError, match=sentence) as stopped:
        integrator("dop853").solve(model, np.linspace(0, 5, 51), model.x0)
    assert len(stopped.value.times) > 1
    assert not 0.01 < model.parts(stopped.value.states[-1])[2][0] < 4.99


def test_resumed_free_length_run_is_identical():
    model, times = compile_system(falling_chain(Reel("reel", 1.0, 0.5), tip_mass=3.0)), np.linspace(0, 1, 2500)
    method = integrator("dop853")
    whole = method.solve(model, times, model.x0)
    first = method.solve(model, times, model.x0, progress=lambda t: True)  # stops after one block of rows
    assert 0 < len(first.times) < len(times)
    rest = method.solve(model, times, model.x0, state=first.resume)
    assert np.array_equal(np.concatenate([first.states, rest.states]), whole.states)


MASS = 2.0  # kg/m


def push_along(seen, out):
    """A force of the first parameter along the marker's x axis."""
    axis = seen.attitude[0]
    for i in range(3):
        out.force[0, i] = seen.parameters[0] * axis[0, i]


def member(length, joint=None, **more):
    made = deploying_line(DeployingLine(mass_per_length=MASS), None, length, stock=20.0, until=4.0)
    return System({"arm": made.body}, (joint or weld("arm"),), varying={"arm": made.variation}, **more)


def three():
    """A load, a spring to a fixed point and an effector at the tip, and their force along a member on the x axis."""
    jet = Effector("jet", push_along, markers=(("arm", "tip"),), parameters=np.array([0.7]))
    load = Load("push", "arm", "tip", force=np.array([-1.5, 0.0, 0.0]), frame="body")
    spring = Spring("spring", "arm", marker="tip", stiffness=3.0, length=1.0)
    acting = {"loads": (load,), "springs": (spring,), "effectors": (jet,)}
    return acting, lambda L: 0.7 - 1.5 - 3.0 * (L - 1.0)


@pytest.mark.slow
def test_drum_power_balances_tip_loads():
    """F = m' L A + m' U^2 - force at the tip, for a straight member that is pushed out of a wall."""
    acting, force = three()
    times = np.linspace(0.0, 4.0, 9)
    seen = solved(member(Profile.polynomial(2.0, 0.3, 0.1), **acting), times)[2]
    L, U, A = (seen[f"bodies/arm/{key}"] for key in ("length", "length_rate", "length_acceleration"))
    assert seen["bodies/arm/drum_force"] == pytest.approx(MASS * L * A + MASS * U**2 - force(L), rel=1e-12)
    h = 1e-4
    near = np.array([2.0 - h, 2.0, 2.0 + h])
    seen = solved(member(Profile.polynomial(2.0, 0.3, 0.1), **acting), near)[2]
    change = (seen["monitors/energy"][2] - seen["monitors/energy"][0]) / (2 * h)
    own = (seen["bodies/arm/drum_power"] - seen["bodies/arm/pickup_loss"] - 0.8 * seen["bodies/arm/length_rate"])[1]
    assert change == pytest.approx(own, rel=1e-6)


def test_free_length_responds_to_tip_loads():
    """m' L dU/dt + m' U^2 [U > 0] = force at the tip - tension."""
    reel = Reel("reel", 2.0, 0.4, tension=0.2, damping=0.5)
    acting, force = three()
    acting["effectors"] = (*acting["effectors"], reel.effector(20.0))
    times = np.linspace(0.0, 1.0, 5)
    seen = solved(member(reel, **acting), times)[2]

    def equation(t, x):
        L, U = x
        return [U, (force(L) - 0.2 - 0.5 * U - MASS * U * U * (U > 0)) / (MASS * L)]

    exact = solve_ivp(equation, (0, 1), [2.0, 0.4], t_eval=times, rtol=1e-11, atol=1e-12, max_step=1e-2).y
    assert seen["bodies/arm/length"] == pytest.approx(exact[0], rel=1e-6)
    assert seen["bodies/arm/drum_force"] == pytest.approx(-seen["effectors/reel/tension"], abs=1e-9)


def test_free_length_of_turning_member_with_transverse_spring():
    """A member on a pin, its tip on a spring from a point at its side, against Lagrange's equations of (angle, L)."""
    reel = Reel("reel", 2.0, -0.1, tension=0.1)
    spring = Spring("spring", "arm", marker="tip", stiffness=4.0, length=0.5)
    system = member(reel, revolute("arm"), springs=(spring,), effectors=(reel.effector(20.0),),
                    loads=(Load("side", "arm", "tip", force=np.array([0.3, 0.2, 0.0]), frame="inertial"),))  # fmt: skip
    times = np.linspace(0.0, 1.0, 5)
    seen = solved(system, times)[2]

    def equation(t, x):
        a, w, L, U = x
        force = 0.3 * np.cos(a) + 0.2 * np.sin(a) - 4.0 * (L - 0.5)
        across = -0.3 * np.sin(a) + 0.2 * np.cos(a)
        A = (MASS * L**2 / 2 * w**2 - MASS * U * U * (U > 0) + force - 0.1) / (MASS * L)
        return [w, (across * L - MASS * L**2 * U * w) / (MASS * L**3 / 3), U, A]

    exact = solve_ivp(equation, (0, 1), [0.0, 0.0, 2.0, -0.1], t_eval=times, rtol=1e-11, atol=1e-12, max_step=1e-2).y
    assert seen["bodies/arm/length"] == pytest.approx(exact[2], rel=1e-6)
