"""Frequency against amplitude: Duffing's oscillator, a beam between pins, cantilevers and full finite elements."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import cumulative_trapezoid
from scipy.special import ellipk

from femflex.body import FlexibleBody, Marker, MassMoments, Skin, StrainTensors
from femflex.dynamics import compile_system
from femflex.fem import Material, Member, build_structure
from femflex.fem.sections import Rectangle
from femflex.integrate import integrator
from femflex.mesh import line, rectangle
from femflex.reduction import (
    BeamFunctions,
    UniformBeam,
    beam_body,
    cantilever_modes,
    reduce_structure,
    with_derivatives,
)
from femflex.studies import backbone
from femflex.studies.backbone_curve import HarmonicBalance
from femflex.system import System, weld

H = 0.004
RADIUS = H / np.sqrt(12)  # of gyration
METAL = Material(70e9, 0.3, 2700.0)


def duffing(c):
    """omega / omega_0 of x'' + x + c x^3 from rest at x = 1, by the complete elliptic integral."""
    return np.pi / 2 * np.sqrt(1 + c) / ellipk(c / (2 * (1 + c)))


def oscillator(c2, c3):
    """One coordinate of unit mass, V = d^2 / 2 + c2 d^3 + c3 d^4 / 4, seen as metres along z."""
    moments = MassMoments(1.0, np.array([[0, 0, 0], [0, 0, 1.0]]), np.zeros((2, 3, 2, 3)))
    moments.second[1, 2, 1, 2] = 1.0
    strain = StrainTensors(np.eye(1), np.zeros(1), np.array([c2]), np.array([c3 / 2]))
    skin = Skin(np.zeros((1, 3)), {"vertex": np.array([[0]])}, np.array([[[0.0, 0.0, 1.0]]]))
    return FlexibleBody(moments, strain, np.zeros((1, 1)), {"origin": Marker.at_position(np.zeros(3), n_modes=1)}, skin)


def test_duffing_oscillator_matches_elliptic_integral():
    amplitudes = np.array([0.1, 0.5, 1.0, 2.0, 4.0])
    curve = backbone(oscillator(0.0, 1.0), 1, amplitudes)
    assert curve.small == pytest.approx(1.0) and curve.direction == pytest.approx([0, 0, 1])
    np.testing.assert_allclose(curve.omega, duffing(amplitudes**2), rtol=1e-7)
    np.testing.assert_allclose(curve.harmonics[:, 0::2], 0.0, atol=1e-12)  # odd harmonics alone


def test_quadratic_spring_softens_and_drifts():
    """Second-order perturbation of x'' + x + 3 c x^2: omega = 1 - 5 (3 c a)^2 / 12, mean -3 c a^2 / 2."""
    a, c = 0.02, 0.5
    curve = backbone(oscillator(c, 0.0), 1, [a])
    assert curve.omega[0] - 1 == pytest.approx(-5 / 12 * (3 * c * a) ** 2, rel=0.05)
    assert curve.harmonics[0, 0, 0] == pytest.approx(-3 * c * a**2 / 2, rel=0.03)


@pytest.fixture(scope="module")
def pinned():
    mesh = line([[0, 0, 0], [1.0, 0, 0]], 4)
    options = {"order": 6, "orientation": (0, 1, 0), "rotary_inertia": False}
    structure = build_structure(mesh, [Member("line", "beam", Rectangle(0.05, H), METAL, options)])
    pins = dict.fromkeys(("start", "end"), ("x", "y", "z", "rx"))
    modes = with_derivatives(structure, cantilever_modes(structure, pins, 2).picked([0, 1]), "all")
    return {strain: reduce_structure(structure, modes, strain=strain) for strain in ("condensed", "nonlinear")}


@pytest.fixture
def beam(pinned):
    return pinned["nonlinear"]


@pytest.mark.sampled(1)
@pytest.mark.parametrize("strain", ["condensed", "nonlinear"])
def test_beam_between_immovable_pins_matches_woinowsky_krieger(pinned, strain):
    """w / w0 at a / r = 1, 2, 3: 1.0892, 1.3178, 1.6257 (1950), by quasi-static stretch along the axis.

    The axial inertia and bent curvature that this leaves out count (a / L)^2 and r^2: 3e-6 here, L / r = 866.
    """
    curve = backbone(pinned[strain], 1, RADIUS * np.array([1.0, 2.0, 3.0]))
    assert curve.place[0] == pytest.approx(0.5)
    assert curve.harmonics.shape[2] == {"condensed": 2, "nonlinear": 5}[strain]
    np.testing.assert_allclose(curve.omega / curve.small, [1.0892, 1.3178, 1.6257], atol=6e-5)
    np.testing.assert_allclose(curve.omega / curve.small, duffing(np.array([1, 4, 9]) / 4), rtol=3e-5)


def inextensible(mode):
    """(omega / omega_0 - 1) / a^2 of a cantilever's mode, a its tip over the length: geometric and inertial part.

    q'' + omega_0^2 q + g q^3 + i (q q'^2 + q^2 q'') = 0 with g = 2 int (f'f'')^2, i = int (int_0^x f'^2)^2, int f^2 = 1
    (Crespo da Silva and Glynn 1978; Nayfeh and Pai 2004: 40.44 and 4.597, 13418 and 144.7), by Lindstedt's series.
    """
    beta = (1.8751040687119611, 4.694091132974175)[mode - 1]
    x = np.linspace(0.0, 1.0, 20001)
    ratio = (np.cosh(beta) + np.cos(beta)) / (np.sinh(beta) + np.sin(beta))
    cosh, sinh, cos, sin = (wave(beta * x) for wave in (np.cosh, np.sinh, np.cos, np.sin))
    shape = cosh - cos - ratio * (sinh - sin)
    slope = beta * (sinh + sin - ratio * (cosh - cos))
    bend = beta**2 * (cosh + cos - ratio * (sinh + sin))
    assert np.trapezoid(shape**2, x) == pytest.approx(1.0, rel=1e-6)
    geometric = 2 * np.trapezoid((slope * bend) ** 2, x)
    inertial = np.trapezoid(cumulative_trapezoid(slope**2, x, initial=0.0) ** 2, x)
    return np.array([3 * geometric / (8 * beta**4), -inertial / 4]) / shape[-1] ** 2


def cantilever(r=1e-4, **functions):
    """Without rotary inertia, of length 1, EI / m' = 1."""
    return beam_body(UniformBeam(1.0, r**-2, 1.0, 1.0, 1.0, 1.0), BeamFunctions(**functions), strain="condensed")


@pytest.mark.parametrize(("mode", "published"), [(1, (40.44, 4.597)), (2, (13418.0, 144.7))])
def test_cantilever_hardens_in_mode_1_and_softens_in_mode_2(mode, published):
    """By curvature and by the inertia of the tip drawn in, which all but cancel in the first mode."""
    geometric, inertial = inextensible(mode)
    square = (3.5160152685, 22.0344915647)[mode - 1] ** 2
    assert 4 * geometric * 8 * square / 3 == pytest.approx(published[0], rel=1e-3)
    assert -4 * inertial * 4 == pytest.approx(published[1], rel=1e-3)
    curve = backbone(cantilever(z=6), mode, [0.01, 0.02])
    assert curve.place[0] == 1.0
    exact = geometric + inertial
    assert (exact > 0) == (mode == 1)
    rise = (curve.omega / curve.small - 1) / curve.amplitudes**2
    assert (4 * rise[0] - rise[1]) / 3 == pytest.approx(exact, rel=2e-4)  # the next term goes with a^4


def test_meshed_cantilever_hardens_in_mode_1():
    member = Member("line", "beam", Rectangle(0.004, 0.002), METAL, {"orientation": (0, 1, 0)})
    structure = build_structure(line([[0, 0, 0], [1.0, 0, 0]], 8), [member])
    modes = with_derivatives(structure, cantilever_modes(structure, "start", 4))
    curve = backbone(reduce_structure(structure, modes, strain="condensed"), 1, [0.02])
    assert curve.omega[0] / curve.small - 1 == pytest.approx(inextensible(1).sum() * 0.02**2, rel=2e-3)


@pytest.mark.parametrize("mode", [1, 2])
def test_strip_of_plates_hardens_and_softens(mode):
    """Ten rectangles along, without Poisson's ratio; linear curvature would leave -0.287 and -9.05, inertia's alone."""
    strip = Member("surface", "plate_bfs", 0.002, Material(70e9, 0.0, 2700.0))
    structure = build_structure(rectangle(1.0, 0.1, 10, 1, "quad"), [strip])
    modes = with_derivatives(structure, cantilever_modes(structure, ["left"], 4), "all")
    curve = backbone(reduce_structure(structure, modes, strain="condensed"), mode, [0.01, 0.02])
    rise = (curve.omega / curve.small - 1) / curve.amplitudes**2
    assert (4 * rise[0] - rise[1]) / 3 == pytest.approx(inextensible(mode).sum(), rel=2e-3)


@pytest.mark.slow
def test_forces_of_harmonic_balance_are_derivatives_of_the_mean_lagrangian():
    """Rates of all shapes by Fourier series of their amplitudes, derivatives by differences."""
    body, h, t = cantilever(y=3), 4, 64
    balance, cosine = HarmonicBalance(body, np.zeros(6), h), np.cos(np.outer(2 * np.pi * np.arange(t) / t, range(h)))

    def lagrangian(x):
        q = cosine @ x[:-1].reshape(h, -1)
        eta = np.stack([body.amplitudes(row) for row in q])
        rate = np.fft.irfft(1j * np.arange(t // 2 + 1)[:, None] * np.fft.rfft(eta, axis=0), t, axis=0)
        kinetic = x[-1] ** 2 * np.einsum("ta,ab,tb->t", rate, body.moments.elastic_mass(), rate) / 2
        return np.mean([body.strain.energy(row) for row in q] - kinetic)

    x = np.append(0.1 * np.random.default_rng(3).normal(size=3 * h), 3.0)
    elastic, inertia, jacobian = balance.forces(x)
    steps = 1e-5 * np.eye(len(x))
    expected = [(lagrangian(x + step) - lagrangian(x - step)) / 2e-5 for step in steps[:-1]]
    assert (elastic + inertia).ravel() == pytest.approx(expected, abs=1e-6 * np.abs(expected).max())
    forces = [[sum(balance.forces(x + sign * step)[:2]).ravel() for sign in (1, -1)] for step in steps]
    expected = np.stack([(up - down) / 2e-5 for up, down in forces], axis=1)
    assert jacobian == pytest.approx(expected, abs=1e-6 * np.abs(expected).max())


def test_condensed_motion_is_periodic_in_the_compiled_equations():
    body = cantilever(z=3)
    curve = backbone(body, 2, [0.03, 0.1])
    assert curve.omega[1] < 0.95 * curve.small
    delta = curve.harmonics[1].sum(axis=0)
    model = compile_system(System({"beam": body}, (weld("beam"),), delta0={"beam": delta}))
    times = 2 * np.pi / curve.omega[1] * np.array([0.0, 0.5, 1.0])
    states = integrator("dop853", rtol=1e-11, atol=1e-14).solve(model, times, model.x0).states
    np.testing.assert_allclose(states[2, :3], delta, atol=1e-4 * np.abs(delta).max())
    assert np.abs(states[2, 3:]).max() < 1e-3 * curve.omega[1] * np.abs(delta).max()
    turned = body.markers["tip"].phi @ body.amplitudes(states[1, :3])
    assert np.linalg.norm(turned) > 0.1  # half a period later it is on the other side
    assert turned[2] * (body.markers["tip"].phi @ body.amplitudes(delta))[2] < 0
