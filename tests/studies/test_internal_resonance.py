"""Backbone curves where three times the frequency meets another mode: two oscillators, integrated over a period."""

from __future__ import annotations

from itertools import permutations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from femflex.body import FlexibleBody, Marker, MassMoments, Skin, StrainTensors
from femflex.body.symmetric import packed
from femflex.studies import backbone


def oscillators(K, quartic):
    """Two coordinates of unit mass, each seen as metres along z at a point of its own; V = x.K x / 2 + the quartic.

    quartic: factor of x_i x_j x_k x_l by their numbers.
    """
    second, V3 = np.zeros((3, 3, 3, 3)), np.zeros((2, 2, 2, 2))
    second[1, 2, 1, 2] = second[2, 2, 2, 2] = 1.0
    for numbers, factor in quartic.items():
        alike = set(permutations(numbers))
        for place in alike:
            V3[place] = 2 * factor / len(alike)
    first = np.array([[0, 0, 0], [0, 0, 1.0], [0, 0, 1.0]])
    shapes = np.zeros((2, 2, 3))
    shapes[0, 0, 2] = shapes[1, 1, 2] = 1.0
    skin = Skin(np.array([[0.0, 0, 0], [1.0, 0, 0]]), {"vertex": np.array([[0], [1]])}, shapes)
    strain = StrainTensors(np.array(K, float), np.zeros(2), np.zeros(4), packed(V3))
    origin = {"origin": Marker.rigid(np.zeros(3), n_modes=2)}
    return FlexibleBody(MassMoments(1.0, first, second), strain, np.zeros((2, 2)), origin, skin)


def missed(force, vibration):
    """How far x'' = -force(x) is from where it began after a period, over how far it moved."""
    start = vibration.harmonics.sum(axis=0)

    def rate(_, y):
        return [y[2], y[3], *(-np.array(force(*y[:2])))]

    times = (0, 2 * np.pi / vibration.omega)
    end = solve_ivp(rate, times, [*start, 0, 0], rtol=1e-11, atol=1e-13).y[:, -1]
    return np.abs(end[:2] - start).max() / np.abs(start).max()


@pytest.mark.slow
@pytest.mark.parametrize("coupling", [0.1, 0.3])
def test_a_curve_goes_into_the_tongue_of_a_three_to_one_resonance_and_over_it(coupling):
    """x'' + x + x^3 + 3 c x^2 y = 0, y'' + 3.1^2 y + c x^3 = 0: each motion on the way repeats itself."""
    body = oscillators([[1, 0], [0, 3.1**2]], {(0, 0, 0, 0): 0.25, (0, 0, 0, 1): coupling})
    found = backbone(body, 1, np.linspace(0.1, 1.5, 15))
    assert len(found.gaps) == 1 and 0.3 < found.gaps[0, 0] < 0.4 and found.gaps[0, 1] < 0.41

    def force(x, y):
        return x + x**3 + 3 * coupling * x**2 * y, 3.1**2 * y + coupling * x**3

    assert max(missed(force, at) for at in found.path) < 1e-8
    third = np.array([at.harmonics[3, 1] for at in found.path])
    deepest = int(np.argmax(np.abs(third)))
    assert abs(third[deepest]) > 0.5 * found.path[deepest].amplitude  # well into the tongue
    assert 3 * found.path[deepest].omega == pytest.approx(3.1, rel=5e-3)  # where the other mode's frequency is met
    assert third[deepest] * found.harmonics[3, 3, 1] < 0  # beyond it, it answers in the other phase
    np.testing.assert_allclose(found.amplitudes, np.linspace(0.1, 1.5, 15))


@pytest.mark.slow
def test_a_spring_that_hardens_at_one_of_two_masses():
    """x'' + 2 x - y + x^3 / 2 = 0, y'' + 2 y - x = 0 (Kerschen, Peeters, Golinval, Vakakis 2009), in phase."""
    body = oscillators([[2, -1], [-1, 2]], {(0, 0, 0, 0): 0.125})
    found = backbone(body, 1, [0.5, 2.0, 4.0, 8.0])
    assert not found.gaps.size and (np.diff(found.omega) > 0).all()
    assert found.omega[-1] < np.sqrt(2.0)  # the other mass alone, where this one stands still

    def force(x, y):
        return 2 * x - y + x**3 / 2, 2 * y - x

    assert max(missed(force, at) for at in found.path) < 1e-5
