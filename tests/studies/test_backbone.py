"""Frequency against amplitude: Duffing's oscillator, a beam between pins, and the full finite elements."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.special import ellipk

from femflex.body import FlexibleBody, Marker, MassMoments, Skin, StrainTensors
from femflex.fem import Material, Member, build_structure
from femflex.fem.sections import Rectangle
from femflex.mesh import line
from femflex.reduction import cantilever_modes, reduce_structure, with_derivatives
from femflex.studies import backbone

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
    return FlexibleBody(moments, strain, np.zeros((1, 1)), {"origin": Marker.rigid(np.zeros(3), n_modes=1)}, skin)


def test_duffings_oscillator_has_the_frequency_of_its_elliptic_integral():
    amplitudes = np.array([0.1, 0.5, 1.0, 2.0, 4.0])
    found = backbone(oscillator(0.0, 1.0), 1, amplitudes)
    assert found.small == pytest.approx(1.0) and found.direction == pytest.approx([0, 0, 1])
    np.testing.assert_allclose(found.omega, duffing(amplitudes**2), rtol=1e-7)
    np.testing.assert_allclose(found.harmonics[:, 0::2], 0.0, atol=1e-12)  # odd harmonics alone


def test_a_quadratic_spring_softens_and_drifts():
    """Second-order perturbation of x'' + x + 3 c x^2: omega = 1 - 5 (3 c a)^2 / 12, mean -3 c a^2 / 2."""
    a, c = 0.02, 0.5
    found = backbone(oscillator(c, 0.0), 1, [a])
    assert found.omega[0] - 1 == pytest.approx(-5 / 12 * (3 * c * a) ** 2, rel=0.05)
    assert found.harmonics[0, 0, 0] == pytest.approx(-3 * c * a**2 / 2, rel=0.03)


@pytest.fixture(scope="module")
def beam():
    mesh = line([[0, 0, 0], [1.0, 0, 0]], 4)
    options = {"order": 6, "orientation": (0, 1, 0), "rotary_inertia": False}
    structure = build_structure(mesh, [Member("line", "beam", Rectangle(0.05, H), METAL, options)])
    pins = dict.fromkeys(("start", "end"), ("x", "y", "z", "rx"))
    modes = with_derivatives(structure, cantilever_modes(structure, pins, 2).picked([0, 1]), "all")
    return reduce_structure(structure, modes, strain="nonlinear")


def test_a_beam_between_immovable_pins_follows_woinowsky_krieger(beam):
    """w / w0 at a / r = 1, 2, 3: 1.0892, 1.3178, 1.6257 (1950), without axial inertia and bent curvature: 2e-5."""
    found = backbone(beam, 1, RADIUS * np.array([1.0, 2.0, 3.0]))
    assert found.place[0] == pytest.approx(0.5)
    np.testing.assert_allclose(found.omega / found.small, [1.0892, 1.3178, 1.6257], atol=6e-5)
    np.testing.assert_allclose(found.omega / found.small, duffing(np.array([1, 4, 9]) / 4), rtol=3e-5)


def test_a_motion_that_was_found_repeats_itself_when_it_is_run(beam):
    found = backbone(beam, 1, RADIUS * np.array([1.0, 2.0]))
    q, u = found.harmonics[1].sum(axis=0), np.zeros(beam.n_modes)
    Me, steps = beam.moments.elastic_mass(), 6000
    dt = 2 * np.pi / found.omega[1] / steps
    start = q.copy()
    a = -np.linalg.solve(Me, beam.strain.force(q))
    for _ in range(steps):  # velocity Verlet
        u = u + dt / 2 * a
        q = q + dt * u
        a = -np.linalg.solve(Me, beam.strain.force(q))
        u = u + dt / 2 * a
    np.testing.assert_allclose(q, start, atol=1e-3 * np.abs(start).max())


def test_what_cannot_be_followed_is_refused(beam):
    for amplitudes in ([], [0.0, 1.0], [2.0, 1.0], [np.nan]):
        with pytest.raises(ValueError, match="give rising lengths above zero"):
            backbone(beam, 1, amplitudes)
    with pytest.raises(ValueError, match="mode 99 was asked for; the body has modes 1 to"):
        backbone(beam, 99, [0.01])
    with pytest.raises(ValueError, match="the body has no skin"):
        backbone(replace(beam, skin=None), 1, [0.01])
    with pytest.raises(ValueError, match=r"no free vibration with an amplitude of .* m was found near that of"):
        backbone(oscillator(0.5, 0.0), 1, [0.1, 3.0])  # beyond the potential's ridge
