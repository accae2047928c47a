"""Cables of one tension and cables with mass, against their equations and published motion."""

import numpy as np
import pytest
from scipy.integrate import quad, solve_ivp
from support.effector_builders import cable, with_heavy_cable

from femflex.body import rigid_body
from femflex.dynamics import compile_system
from femflex.integrate import Dop853
from femflex.linear.equations import linearised
from femflex.system import Environment, Joint, Profile, System, free, weld

A, B, EA = 3.0, 2.0, 40.0
REDUCED = A * B / (A + B)


def pair(length, damping=0.0, speed=0.5, turning=0.0):
    """Two bodies 1 m apart on the x axis that fly apart."""
    bodies = {"a": rigid_body(A, np.eye(3)), "b": rigid_body(B, np.eye(3))}
    joints = (
        free("a", q0=[0, 0, 0, 1, 0, 0, 0], u0=np.zeros(6)),
        free("b", q0=[1, 0, 0, 1, 0, 0, 0], u0=[speed, turning, 0, 0, 0, 0]),
    )
    line = cable("line", (("a", "origin"), ("b", "origin")), length, EA, damping)
    return compile_system(System(bodies, joints, effectors=(line,)))


def simulated(model, times):
    states = Dop853(rtol=1e-11, atol=1e-12).solve(model, times, model.x0).states
    return model.observe(times, states)


def test_cable_catches_and_rebounds_bodies():
    """Slack until d = L, then half a period of sqrt(EA / L / m), then apart at minus their speed, slack again."""
    length, speed = 1.4, 0.5
    caught, omega = (length - 1.0) / speed, np.sqrt(EA / length / REDUCED)
    away = caught + np.pi / omega
    times = np.concatenate([np.linspace(0, caught, 4), np.linspace(caught, away, 7)[1:], [away + 0.3]])
    seen = simulated(pair(length), times)
    stretch = np.where((times > caught) & (times < away), speed / omega * np.sin(omega * (times - caught)), 0.0)
    d = np.where(times < away, np.minimum(1.0 + speed * times, length) + stretch, length - speed * (times - away))
    assert seen["effectors/line/distance"] == pytest.approx(d, abs=1e-7)
    assert seen["effectors/line/tension"] == pytest.approx(EA / length * stretch, abs=1e-5)
    assert seen["effectors/line/tension"][-1] == 0.0 and seen["effectors/line/tension"].max() > 1.0
    p = seen["monitors/momentum"]
    assert np.abs(p - p[0]).max() < 1e-12


def test_cable_let_out_matches_equation_and_energy():
    """m d'' = -N(d, d', L, L') + H^2 / (m d^3) for the distance, with the damping that never pushes."""
    length, damping, turning = Profile.smooth_step(0.0, 3.0, 1.1, 2.0), 1.5, 0.3
    times = np.linspace(0.0, 4.0, 8001)
    seen = simulated(pair(length, damping, turning=turning), times)
    H = REDUCED * 1.0 * turning

    def equation(t, x):
        d, v = x
        L, U, _ = (float(value) for value in length(t))
        N = max(0.0, EA * (d - L) / L + damping * (v - U)) if d > L else 0.0
        return [v, (H**2 / (REDUCED * d**3) - N) / REDUCED]

    exact = solve_ivp(equation, (0, 4), [1.0, 0.5], t_eval=times, rtol=1e-9, atol=1e-11, max_step=1e-2).y[0]
    assert seen["effectors/line/distance"] == pytest.approx(exact, abs=1e-6)
    slack = seen["effectors/line/tension"] == 0.0
    assert slack[0] and 0.1 < slack.mean() < 0.9
    power = seen["effectors/line/supplied"] - seen["effectors/line/dissipation"]
    work = np.concatenate([[0.0], np.cumsum((power[1:] + power[:-1]) / 2 * np.diff(times))])
    stored = seen["monitors/energy"] - work
    assert np.abs(stored - stored[0]).max() < 2e-3 * np.abs(work).max()


POINT = np.zeros((3, 3))
ENDS = (("base", "origin"), ("tip", "origin"))


def string(n, damping=0.0):
    """A string of 2 m stretched between two fixed points that are 2.02 m apart."""
    bodies = {"base": rigid_body(1.0, np.eye(3)), "tip": rigid_body(1.0, np.eye(3))}
    away = Joint("tip", translations=np.eye(3)[:1], q0=np.array([2.02]), motion=(2.02,), kind="general")
    share = (np.arange(n)[:, None] + 0.5) / n
    places = share * np.array([2.02, 0, 0])
    return with_heavy_cable(
        System(bodies, (weld("base"), away)), "line", ENDS, 2.0, 500.0, 0.1, n, places, damping=damping
    )


def test_taut_string_frequencies_converge():
    tension, density = 500.0 * 0.01, 0.1 * 2.0 / 2.02
    exact = np.pi / 2.02 * np.sqrt(tension / density) * np.array([1.0, 1.0, 2.0, 2.0])  # in both planes
    errors = []
    for n in (8, 16):
        model = compile_system(string(n))
        poles = linearised(model, 0.0, model.x0).eigenvalues()
        found = np.sort(np.abs(poles.imag[poles.imag > 1e-3]))[:4]
        errors.append(np.abs(found / exact - 1.0))
    assert errors[1].max() < 0.01
    assert np.log2(errors[0] / errors[1]) == pytest.approx(2.0, abs=0.2)


def folded(n, width=0.05, length=2.0, density=0.5):
    """A chain that hangs in a narrow U from two points at one height, one end of it free to fall."""
    half = (length - width) / 2.0
    s = (np.arange(n) + 0.5) * length / n
    x = np.clip(s - half, 0.0, width)
    z = -np.minimum(np.minimum(s, half), length - s)
    places = np.stack([x, 0 * s, z], axis=1)
    bodies = {"base": rigid_body(1.0, np.eye(3)), "tip": rigid_body(0.01 * density * length / n, POINT)}
    end = Joint("tip", "base", translations=np.eye(3), q0=np.array([width, 0.0, 0.0]), kind="general")
    system = System(bodies, (weld("base"), end), environment=Environment(np.array([0.0, 0.0, -9.81])))
    return with_heavy_cable(system, "line", ENDS, length, 2e3, density, n, places)


@pytest.mark.slow
def test_folded_chain_falls_as_published():
    """Calkin & March, American Journal of Physics 57 (1989) 154: v^2 = g (2 y - y^2 / L) / (1 - y / L), energy kept."""
    g, length = 9.81, 2.0
    model = compile_system(folded(80))
    t = np.linspace(0.0, 0.6, 601)
    seen = model.observe(t, Dop853(rtol=1e-6, atol=1e-8).solve(model, t, model.x0).states)
    fallen = -seen["bodies/tip/position"][:, 2]
    for part in (0.5, 0.7, 0.9):
        y = part * length
        k = int(np.argmax(fallen > y))
        at = np.interp(y, fallen[k - 1 : k + 1], t[k - 1 : k + 1])
        exact = quad(lambda y: np.sqrt((1 - y / length) / (g * (2 * y - y * y / length))), 0.0, y)[0]
        assert at == pytest.approx(exact, rel=0.02)
        assert np.sqrt(2 * y / g) > 1.05 * exact
    energy = seen["monitors/energy"]
    assert np.abs(energy - energy[0]).max() < 1e-3 * abs(energy[0])
    assert min(seen["effectors/line/tension"].min(), seen["effectors/line/tension_end"].min()) == 0.0


def test_cable_damping_is_independent_of_masses():
    """Along a taut cable the dampers are c L / EA times the springs, so poles decay at c L / EA omega^2 / 2."""
    c = 0.1  # N s/m
    for n in (1, 6):
        model = compile_system(string(n, damping=c))
        poles = linearised(model, 0.0, model.x0).eigenvalues()
        along = poles[np.abs(poles.real) > 1e-6]
        assert len(along) == 2 * n
        assert -2 * along.real == pytest.approx(c * 2.0 / 500.0 * np.abs(along) ** 2, rel=1e-6)
