"""Branches of backbone curves: a shallow arch, folds and internal resonances, against runs over a period."""

from __future__ import annotations

from dataclasses import replace
from itertools import permutations

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from support.shallow_arch import ShallowArch

from femflex.body import FlexibleBody, Marker, MassMoments, Skin, StrainTensors
from femflex.body.symmetric import packed
from femflex.dynamics import compile_system
from femflex.fem import Material, Member, build_structure
from femflex.fem.sections import Rectangle
from femflex.integrate import integrator
from femflex.mesh import line
from femflex.reduction import cantilever_modes, reduce_structure, with_derivatives
from femflex.studies import backbone
from femflex.system import System, weld

LENGTH, H, WIDTH, E, RHO = 1.3, 0.008, 0.02, 2e11, 7800.0
PINNED = ("x", "y", "z", "rx", "rz")


def arch(rise, clamped_directions, strain, sign=1):
    """A parabola of this rise between immovable ends, four modes within its plane and all their derivatives."""
    mesh = line(lambda s: [s * LENGTH, 0, 4 * rise * s * (1 - s)], 16)
    options = {"order": 3, "orientation": (0, 1, 0), "rotary_inertia": False}
    structure = build_structure(mesh, [Member("line", "beam", Rectangle(WIDTH, H), Material(E, 0.3, RHO), options)])
    modes = cantilever_modes(structure, {"start": clamped_directions, "end": clamped_directions}, 8)
    mode_displacements = [np.abs((structure.translation @ column).reshape(-1, 3)).max(axis=0) for column in modes.phi.T]
    modes = modes.picked([k for k, (_, y, z) in enumerate(mode_displacements) if z > 10 * y][:4])
    modes = replace(modes, phi=sign * modes.phi)
    return reduce_structure(structure, with_derivatives(structure, modes, "all"), strain=strain)


@pytest.fixture(scope="module")
def shallow():
    """Its amplitudes are counted upwards, whatever the sign of the eigenvectors."""
    body = arch(0.6 * H, PINNED, "condensed")
    upward = backbone(body, 1, [1e-4]).direction[2] > 0
    return body if upward else arch(0.6 * H, PINNED, "condensed", sign=-1)


def by_energy(rise, amplitude):
    """omega of w = q sin(pi x / L) on a parabola, quasi-static stretch alike all along: T = 2 int dq / q' from rest to
    rest, with M q'^2 / 2 = V(amplitude) - V(q)."""
    slope = -16 * rise / (np.pi * LENGTH)  # int z0' w' dx at q = 1; upwards is stretching
    bend = E * WIDTH * H**3 / 12 * np.pi**4 / (2 * LENGTH**3)
    mass = RHO * WIDTH * H * LENGTH / 2
    per = np.pi**2 / (2 * LENGTH)
    stretch = np.polynomial.Polynomial([0.0, -slope, per / 2])
    energy = np.polynomial.Polynomial([0, 0, bend / 2]) + E * WIDTH * H / (2 * LENGTH) * stretch**2
    remaining_energy = (energy(amplitude) - energy) // np.polynomial.Polynomial(
        [amplitude, -1.0]
    )  # V(a) - V(q) = (a - q) left
    roots = remaining_energy.roots()
    lowest_amplitude = roots[np.isreal(roots)].real
    lowest_amplitude = lowest_amplitude[lowest_amplitude < amplitude].max()
    factor = remaining_energy // np.polynomial.Polynomial([-lowest_amplitude, 1.0])
    angle = (np.arange(400) + 0.5) * np.pi / 400  # Gauss and Chebyshev, with the two turning points as weights
    q = (amplitude + lowest_amplitude) / 2 + (amplitude - lowest_amplitude) / 2 * np.cos(angle)
    return np.pi / (np.pi / 400 * np.sum(np.sqrt(mass / (2 * factor(q)))))


@pytest.mark.slow
def test_shallow_arch_matches_its_energy(shallow):
    amplitudes = np.array([1.6, 3.2, 4.8, 6.4, 8.0]) * 1e-3
    curve = backbone(shallow, 1, amplitudes)
    sign = np.sign(curve.direction[2])
    exact = np.array([by_energy(sign * 0.6 * H, a) for a in amplitudes])
    np.testing.assert_allclose(curve.omega, exact, rtol=1e-2)  # one sine, on an arch whose mode is nearly one


def after_a_period(body, vibration):
    """Coordinates (n,) a period later, by the compiled equations; and those at the start."""
    delta, n = vibration.harmonics.sum(axis=0), body.n_modes
    model = compile_system(System({"arch": body}, (weld("arch"),), delta0={"arch": delta}))
    times = np.array([0.0, 2 * np.pi / vibration.omega])
    return integrator("dop853", rtol=1e-10, atol=1e-13).solve(model, times, model.x0).states[1, :n], delta


@pytest.mark.slow
def test_internal_resonance_is_stepped_over(shallow):
    """Near 9.45 mm the fourth harmonic meets a higher mode, and the branch turns; beyond it goes on as its energy says.

    The tongue takes the frequency up before, and down beyond, by up to 2 %.
    """
    amplitudes = [1.6e-3, 4.8e-3, 9.6e-3, 12e-3]
    curve = backbone(shallow, 1, amplitudes)
    (gap,) = curve.gaps
    assert gap == pytest.approx([9.449e-3, 10.6e-3], rel=5e-3)
    assert list(curve.amplitudes) == [a for a in amplitudes if not gap[0] < a < gap[1]]
    exact = [by_energy(np.sign(curve.direction[2]) * 0.6 * H, a) for a in curve.amplitudes]
    np.testing.assert_allclose(curve.omega, exact, rtol=2e-2)
    assert curve.omega[-1] / (2 * np.pi) == pytest.approx(32.365, rel=1e-4)  # steps of amplitude do not count
    size = np.linalg.norm(curve.harmonics[:, 1:], axis=2)
    assert (size.argmax(axis=1) == 0).all()


def second_program(step=5e-3):
    """Amplitudes [m] and frequencies [Hz] by sines and a uniform tension, first 0.4 mm apart, then round the fold."""
    arch = ShallowArch(LENGTH, 0.6 * H, E * WIDTH * H, E * WIDTH * H**3 / 12, RHO * WIDTH * H, 16)
    return arch.branch(np.arange(0.4, 9.21, 0.4) * 1e-3, 12e-3, step)


@pytest.mark.slow
def test_branch_matches_a_second_program(shallow):
    reference = second_program()[:23]
    curve = backbone(shallow, 1, reference[:, 0])
    np.testing.assert_allclose(curve.omega / (2 * np.pi), reference[:, 1], rtol=1e-3)


@pytest.mark.slow
def test_branch_continues_behind_a_fold(shallow):
    """The branch turns where that of a second program does, within 1e-3, and leads on to smaller amplitudes.

    There too the compiled equations repeat it. (Uniform tension in place of waves of stretch: 4e-4.)
    """
    points = backbone(shallow, 1, [9.2e-3, 9.4e-3, 12e-3]).path
    amplitudes = np.array([point.amplitude for point in points])
    turn = int(np.argmax(np.diff(amplitudes) < 0))
    assert amplitudes[turn] == pytest.approx(second_program()[:, 0].max(), rel=1e-3)
    assert amplitudes[turn + 1] < amplitudes[turn]
    for point in (points[turn + 1], points[-1]):
        end, start = after_a_period(shallow, point)
        np.testing.assert_allclose(end, start, atol=3e-3 * np.abs(start).max())


def oscillators(K, quartic):
    """Two coordinates of unit mass, each seen as metres along z at a point of its own; V = x.K x / 2 + the quartic.

    quartic: factor of x_i x_j x_k x_l by their numbers.
    """
    second_moments, V3 = np.zeros((3, 3, 3, 3)), np.zeros((2, 2, 2, 2))
    second_moments[1, 2, 1, 2] = second_moments[2, 2, 2, 2] = 1.0
    for numbers, factor in quartic.items():
        permuted = set(permutations(numbers))
        for index in permuted:
            V3[index] = 2 * factor / len(permuted)
    first_moments = np.array([[0, 0, 0], [0, 0, 1.0], [0, 0, 1.0]])
    shapes = np.zeros((2, 2, 3))
    shapes[0, 0, 2] = shapes[1, 1, 2] = 1.0
    skin = Skin(np.array([[0.0, 0, 0], [1.0, 0, 0]]), {"vertex": np.array([[0], [1]])}, shapes)
    strain = StrainTensors(np.array(K, float), np.zeros(2), np.zeros(4), packed(V3))
    origin = {"origin": Marker.at_position(np.zeros(3), n_modes=2)}
    return FlexibleBody(MassMoments(1.0, first_moments, second_moments), strain, np.zeros((2, 2)), origin, skin)


def period_error(force, vibration):
    """Distance of x'' = -force(x) from its start after one period, over the size of the motion."""
    start = vibration.harmonics.sum(axis=0)

    def rate(_, y):
        return [y[2], y[3], *(-np.array(force(*y[:2])))]

    times = (0, 2 * np.pi / vibration.omega)
    end = solve_ivp(rate, times, [*start, 0, 0], rtol=1e-11, atol=1e-13).y[:, -1]
    return np.abs(end[:2] - start).max() / np.abs(start).max()


@pytest.mark.slow
@pytest.mark.parametrize("coupling", [0.1, 0.3])
def test_three_to_one_resonance(coupling):
    """x'' + x + x^3 + 3 c x^2 y = 0, y'' + 3.1^2 y + c x^3 = 0: each motion on the way repeats itself."""
    body = oscillators([[1, 0], [0, 3.1**2]], {(0, 0, 0, 0): 0.25, (0, 0, 0, 1): coupling})
    curve = backbone(body, 1, np.linspace(0.1, 1.5, 15))
    assert len(curve.gaps) == 1 and 0.3 < curve.gaps[0, 0] < 0.4 and curve.gaps[0, 1] < 0.41

    def force(x, y):
        return x + x**3 + 3 * coupling * x**2 * y, 3.1**2 * y + coupling * x**3

    assert max(period_error(force, point) for point in curve.path) < 1e-8
    third = np.array([point.harmonics[3, 1] for point in curve.path])
    deepest = int(np.argmax(np.abs(third)))
    assert abs(third[deepest]) > 0.5 * curve.path[deepest].amplitude  # well into the tongue
    assert 3 * curve.path[deepest].omega == pytest.approx(3.1, rel=5e-3)  # where the other mode's frequency is met
    assert third[deepest] * curve.harmonics[3, 3, 1] < 0  # beyond it, it answers in the other phase
    np.testing.assert_allclose(curve.amplitudes, np.linspace(0.1, 1.5, 15))


@pytest.mark.slow
def test_hardening_spring_at_one_of_two_masses():
    """x'' + 2 x - y + x^3 / 2 = 0, y'' + 2 y - x = 0 (Kerschen, Peeters, Golinval, Vakakis 2009), in phase."""
    body = oscillators([[2, -1], [-1, 2]], {(0, 0, 0, 0): 0.125})
    curve = backbone(body, 1, [0.5, 2.0, 4.0, 8.0])
    assert not curve.gaps.size and (np.diff(curve.omega) > 0).all()
    assert curve.omega[-1] < np.sqrt(2.0)  # the other mass alone, where this one stands still

    def force(x, y):
        return 2 * x - y + x**3 / 2, 2 * y - x

    assert max(period_error(force, point) for point in curve.path) < 1e-5
