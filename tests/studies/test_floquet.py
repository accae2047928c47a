"""Floquet multipliers against Mathieu's equation, librations in orbit, carts on a rail and a flexible spinner."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import expm
from scipy.special import mathieu_a, mathieu_b

from femflex.body import FlexibleBody, Marker, MassMoments, StrainTensors, rigid_body
from femflex.case import read_case, with_values
from femflex.dynamics import compile_system
from femflex.integrate import Dop853
from femflex.linear.equilibrium import equilibrium
from femflex.pipeline.decisions import build_system
from femflex.studies.floquet import floquet, periodic_state
from femflex.studies.stability import equilibrium_stability
from femflex.system import (
    Environment,
    Frame,
    Joint,
    Orbit,
    Profile,
    System,
    free,
    prismatic,
    revolute,
    spherical,
    weld,
)


def pendulum(a: float, q: float) -> System:
    """A pendulum whose pivot is shaken up and down, x'' + (a - 2 q cos 2 t) x = 0 for small angles."""
    bob = rigid_body(2.0, np.diag([0.1, 0.3, 0.3]), [0.7, 0, 0])
    length = (0.3 + 2.0 * 0.7**2) / (2.0 * 0.7)
    shaken = Profile(np.zeros(1), np.zeros((1, 1)), np.array([[q * length / 2, 2.0, np.pi / 2]]))
    return System(
        {"pivot": rigid_body(1.0, np.eye(3)), "bob": bob},
        (
            prismatic("pivot", axis=[0, 1, 0], motion=(shaken,), name="shake"),
            revolute("bob", "pivot", name="pin", q0=[-np.pi / 2]),
        ),
        environment=Environment(gravity=np.array([0.0, -a * length, 0.0])),
    )


def mathieu_trace(a: float, q: float) -> float:
    """Trace of the monodromy matrix over pi."""
    ends = [
        solve_ivp(lambda t, y: [y[1], -(a - 2 * q * np.cos(2 * t)) * y[0]], (0, np.pi), y, rtol=1e-12, atol=1e-14)
        for y in ([1.0, 0.0], [0.0, 1.0])
    ]
    return float(ends[0].y[0, -1] + ends[1].y[1, -1])


@pytest.mark.parametrize(("a", "q"), [(0.7, 0.2), (1.0, 0.4), (2.5, 0.8)])
def test_shaken_pendulum_has_multipliers_of_mathieu(a, q):
    result = floquet(pendulum(a, q), np.pi)
    assert result.names == ("pin.angle", "pin.angle_rate") and result.gap < 1e-9
    assert np.trace(result.monodromy) == pytest.approx(mathieu_trace(a, q), abs=1e-6)
    assert np.prod(result.multipliers).real == pytest.approx(1.0, abs=1e-6)
    assert result.stable == (abs(mathieu_trace(a, q)) < 2)


def test_first_tongue_lies_between_the_characteristic_values():
    q, slack = 0.4, 1e-3
    low, high = float(mathieu_b(1, q)), float(mathieu_a(1, q))
    stable = [floquet(pendulum(a, q), np.pi).stable for a in (low - slack, low + slack, high - slack, high + slack)]
    assert stable == [True, False, False, True]


def test_librations_in_a_circular_orbit():
    """Of quaternions: multipliers exp(i omega T) of the three librations."""
    orbit = Orbit(perigee_altitude=620e3, eccentricity=0.0)
    craft = System(
        {"craft": rigid_body(100.0, np.diag([90.0, 30.0, 100.0]))},
        (spherical("craft"),),
        frame=Frame("orbital"),
        orbit=orbit,
    )
    modes = equilibrium(craft).eigenvalues
    result = floquet(craft, orbit.period)
    expected = np.exp(modes * orbit.period)
    for multiplier in expected:
        assert np.abs(result.multipliers - multiplier).min() < 1e-5 * max(1.0, abs(multiplier))


def test_shooting_finds_the_periodic_pitch_in_an_eccentric_orbit():
    """VALIDATION J: the amplitude of the case eccentric_pitch, begun without the rate that makes it periodic."""
    case = with_values(
        read_case(Path(__file__).parents[2] / "cases" / "eccentric_pitch.toml"), {"attitude.rates": [0, 0, 0]}
    )
    system = build_system(case)
    assert system.orbit is not None
    period = system.orbit.period
    x = periodic_state(system, period)
    model = compile_system(system)
    times = np.linspace(0, period, 201)
    motion = Dop853(rtol=1e-11).solve(model, times, x)
    pitch = model.observe(times, motion.states)["attitude/angles"][:, 0]
    assert np.abs(pitch).max() == pytest.approx(case.expect.answers["pitch_amplitude"].value, rel=3e-4)
    assert floquet(system, period, x).stable


SPAN = {"far": Marker.at_position([0.0, 0.0, 2.0])}


def carts(damping: float = 0.0) -> System:
    """Two carts on a rail, 3 kg and 2 kg, joined by a spring of 5 N/m."""
    slides = {"axis": [1, 0, 0]}
    return System(
        {"first": rigid_body(3.0, np.eye(3), markers=SPAN), "second": rigid_body(2.0, np.eye(3))},
        (
            prismatic("first", name="rail", **slides),
            prismatic("second", "first", name="gap", stiffness=[5.0], damping=[damping], **slides),
        ),
    )


def flow_of_carts(damping: float, period: float) -> np.ndarray:
    """exp(A T) of (rail, gap) and their rates."""
    M, K, D = np.array([[5.0, 2.0], [2.0, 2.0]]), np.diag([0.0, 5.0]), np.diag([0.0, damping])
    A = np.block([[np.zeros((2, 2)), np.eye(2)], [-np.linalg.solve(M, K), -np.linalg.solve(M, D)]])
    return expm(A * period)


@pytest.mark.parametrize("damping", [0.0, 0.8])
def test_monodromy_matrix_of_two_carts(damping):
    period, state = 0.7, np.array([0.6, 0.0, 0.0, 0.0])
    result = floquet(carts(damping), period, state)
    assert result.names == ("rail.slide", "gap.slide", "rail.slide_rate", "gap.slide_rate")
    assert result.monodromy == pytest.approx(flow_of_carts(damping, period), abs=1e-6)
    assert result.trivial == ("translation x", "drift") and result.x.tolist() == state.tolist()
    assert result.period == period and result.gap < 1e-9 and result.stable and 0 <= result.split < 1e-3
    s = np.roots([1.0, damping * 5 / 6, 25 / 6])  # of the gap: m = 3 2 / 5
    assert np.sort_complex(result.multipliers) == pytest.approx(
        np.sort_complex(np.append(np.exp(s * period), [1, 1])), abs=1e-6
    )
    assert (np.diff(np.abs(result.multipliers)) <= 0).all() and (result.multipliers == 1.0).sum() == 2


def test_monodromy_matrix_in_a_spinning_frame():
    """After a turn the frame is where it was: departures come back, and rates have moved it as in inertial axes."""
    w = 0.8
    system = System(
        {"stone": rigid_body(2.0, np.eye(3))},
        (Joint("stone", name="plane", translations=np.eye(3)[:2], kind="general"),),
        frame=Frame("spinning", np.array([0, 0, w])),
    )
    q, T = np.array([0.5, 0.2]), 2 * np.pi / w
    cross = np.array([[0.0, -w], [w, 0.0]])
    result = floquet(system, T, np.concatenate([q, -cross @ q]))
    expected = np.block([[np.eye(2) + T * cross, T * np.eye(2)], [-T * cross @ cross, np.eye(2) - T * cross]])
    assert result.monodromy == pytest.approx(expected, abs=1e-5)
    assert result.trivial == ("translation x", "translation y", "drift", "drift")


W, M, ARM, K, D = 0.8, 2.0, 1.5, 3.0, 0.2
PERIOD = 2 * np.pi / W


def sprung_mass(damping: float) -> FlexibleBody:
    """The mass on its spring as a body of one shape, along z."""
    second_moments = np.zeros((2, 3, 2, 3))
    second_moments[0, 0, 0, 0], second_moments[1, 2, 1, 2] = M * ARM**2, 1.0
    second_moments[0, 0, 1, 2] = second_moments[1, 2, 0, 0] = np.sqrt(M) * ARM
    first_moments = np.array([[M * ARM, 0.0, 0.0], [0.0, 0.0, np.sqrt(M)]])
    tip = Marker(np.array([ARM, 0.0, 0.0]), np.array([[0.0], [0.0], [1 / np.sqrt(M)]]), np.zeros((3, 1)))
    strain = StrainTensors.linear(np.array([[K / M]]))
    return FlexibleBody(MassMoments(M, first_moments, second_moments), strain, np.array([[damping / M]]), {"tip": tip})


def spinner(inertia: tuple[float, float, float], damping: float, joint=spherical, frame: Frame | None = None) -> System:
    """The craft, at rest in a spinning frame, or turning in an inertial one."""
    n = 3 if joint is spherical else 6
    rates = np.zeros(n)
    if frame is None:
        rates[-1] = W
    hub = joint("hub", u0=rates)
    bodies = {"hub": rigid_body(30.0, np.diag(inertia)), "mass": sprung_mass(damping)}
    return System(bodies, (hub, weld("mass", "hub")), frame=frame or Frame())


def craft_matrix(inertia: tuple[float, float, float], damping: float) -> np.ndarray:
    """Matrix (4, 4) of d(x, y, w, w')/dt."""
    A, B, C = inertia
    mass_matrix = np.array([[A, 0, 0, 0], [0, B + M * ARM**2, 0, -M * ARM], [0, 0, 1, 0], [0, -M * ARM, 0, M]], float)
    rate_matrix = np.array([
        [0, -(C - B) * W, 0, 0],
        [W * (C + M * ARM**2 - A), 0, M * ARM * W**2, 0],
        [0, 0, 0, 1],
        [-M * ARM * W, 0, -K, -damping],
    ])  # fmt: skip
    return np.linalg.solve(mass_matrix, rate_matrix)


@pytest.mark.parametrize(("inertia", "stable"), [((10.0, 14.0, 20.0), True), ((10.0, 20.0, 14.0), False)])
def test_multipliers_of_a_flexible_spinner(inertia, stable):
    result = floquet(spinner(inertia, D), PERIOD)
    expected = np.linalg.eigvals(expm(craft_matrix(inertia, D) * PERIOD))
    assert sorted(result.trivial) == ["drift", "rotation x", "rotation y", "rotation z"]
    nontrivial = result.multipliers[result.multipliers != 1.0]
    assert len(nontrivial) == 4 and len(result.multipliers) == 8
    for multiplier in expected:
        assert np.abs(nontrivial - multiplier).min() < 3e-6 * max(1.0, abs(multiplier))
    assert result.stable == stable == bool((np.abs(expected) < 1).all())
    assert result.split < 1e-2  # the root of an error of 1e-8 is 1e-4; a defective pair keeps no more


def test_multipliers_of_a_free_spinner_match_its_poles():
    """Two formulations: motions in inertial axes over a turn, and the equations linearised in axes that spin."""
    spun = spinner((10.0, 14.0, 20.0), D, free, Frame("spinning", np.array([0.0, 0.0, W])))
    steady_state = equilibrium_stability(spun)
    assert steady_state.about is not None
    result = floquet(spun, PERIOD, steady_state.about.x)
    for pole in steady_state.values:
        assert np.abs(result.multipliers - np.exp(pole * PERIOD)).min() < 3e-6
    assert result.stable and result.trivial.count("drift") >= 3 and "neutral" not in result.trivial
