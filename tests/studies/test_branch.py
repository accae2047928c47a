"""A shallow arch's backbone curve stays on its branch: energy's quadrature, a run over a period, where it ends."""

from __future__ import annotations

import numpy as np
import pytest
from support.shallow_arch import ShallowArch

from femflex.dynamics import compile_system
from femflex.fem import Material, Member, build_structure
from femflex.fem.sections import Rectangle
from femflex.integrate import integrator
from femflex.mesh import line
from femflex.reduction import cantilever_modes, reduce_structure, with_derivatives
from femflex.studies import BackboneError, backbone
from femflex.system import System, weld

LENGTH, H, WIDTH, E, RHO = 1.3, 0.008, 0.02, 2e11, 7800.0
PINNED = ("x", "y", "z", "rx", "rz")


def arch(rise, held, strain):
    """A parabola of this rise between immovable ends, four modes within its plane and all their derivatives."""
    mesh = line(lambda s: [s * LENGTH, 0, 4 * rise * s * (1 - s)], 16)
    options = {"order": 3, "orientation": (0, 1, 0), "rotary_inertia": False}
    structure = build_structure(mesh, [Member("line", "beam", Rectangle(WIDTH, H), Material(E, 0.3, RHO), options)])
    modes = cantilever_modes(structure, {"start": held, "end": held}, 8)
    moved = [np.abs((structure.translation @ column).reshape(-1, 3)).max(axis=0) for column in modes.phi.T]
    modes = modes.picked([k for k, (_, y, z) in enumerate(moved) if z > 10 * y][:4])
    return reduce_structure(structure, with_derivatives(structure, modes, "all"), strain=strain)


@pytest.fixture(scope="module")
def shallow():
    return arch(0.6 * H, PINNED, "condensed")


def by_energy(rise, amplitude):
    """omega of w = q sin(pi x / L) on a parabola, quasi-static stretch alike all along: T = 2 int dq / q' from rest to
    rest, with M q'^2 / 2 = V(amplitude) - V(q)."""
    slope = -16 * rise / (np.pi * LENGTH)  # int z0' w' dx at q = 1; upwards is stretching
    bend = E * WIDTH * H**3 / 12 * np.pi**4 / (2 * LENGTH**3)
    mass = RHO * WIDTH * H * LENGTH / 2
    per = np.pi**2 / (2 * LENGTH)
    stretch = np.polynomial.Polynomial([0.0, -slope, per / 2])
    energy = np.polynomial.Polynomial([0, 0, bend / 2]) + E * WIDTH * H / (2 * LENGTH) * stretch**2
    left = (energy(amplitude) - energy) // np.polynomial.Polynomial([amplitude, -1.0])  # V(a) - V(q) = (a - q) left
    roots = left.roots()
    other = roots[np.isreal(roots)].real
    other = other[other < amplitude].max()
    rest = left // np.polynomial.Polynomial([-other, 1.0])
    angle = (np.arange(400) + 0.5) * np.pi / 400  # Gauss and Chebyshev, with the two turning points as weights
    q = (amplitude + other) / 2 + (amplitude - other) / 2 * np.cos(angle)
    return np.pi / (np.pi / 400 * np.sum(np.sqrt(mass / (2 * rest(q)))))


@pytest.mark.slow
def test_a_shallow_arch_first_softens_and_then_hardens_as_its_energy_says(shallow):
    amplitudes = np.array([1.6, 3.2, 4.8, 6.4, 8.0]) * 1e-3
    found = backbone(shallow, 1, amplitudes)
    sign = np.sign(found.direction[2])
    exact = np.array([by_energy(sign * 0.6 * H, a) for a in amplitudes])
    np.testing.assert_allclose(found.omega, exact, rtol=1e-2)  # one sine, on an arch whose mode is nearly one


@pytest.mark.slow
def test_steps_of_amplitude_may_be_as_long_as_they_like(shallow):
    fine = backbone(shallow, 1, np.arange(0.8, 8.1, 0.8) * 1e-3)
    coarse = backbone(shallow, 1, [8e-3])
    assert coarse.omega[0] == pytest.approx(fine.omega[-1], rel=1e-6)


@pytest.mark.slow
def test_an_arch_comes_back_after_the_period_and_is_on_the_other_side_half_way(shallow):
    found = backbone(shallow, 1, [8e-3])
    delta, n = found.harmonics[0].sum(axis=0), shallow.n_modes
    model = compile_system(System({"arch": shallow}, (weld("arch"),), delta0={"arch": delta}))
    times = 2 * np.pi / found.omega[0] * np.array([0.0, 0.5, 1.0])
    states = integrator("dop853", rtol=1e-10, atol=1e-13).solve(model, times, model.x0).states
    np.testing.assert_allclose(states[2, :n], delta, atol=1e-3 * np.abs(delta).max())
    assert states[1, 0] * delta[0] < 0


def after_a_period(body, vibration):
    """Coordinates (n,) a period later, by the compiled equations; and those at the start."""
    delta, n = vibration.harmonics.sum(axis=0), body.n_modes
    model = compile_system(System({"arch": body}, (weld("arch"),), delta0={"arch": delta}))
    times = np.array([0.0, 2 * np.pi / vibration.omega])
    return integrator("dop853", rtol=1e-10, atol=1e-13).solve(model, times, model.x0).states[1, :n], delta


@pytest.mark.slow
@pytest.mark.parametrize(
    "amplitudes",
    [
        [1.6e-3, 4.8e-3, 9.6e-3, 12e-3],
        pytest.param(list(np.arange(1.6, 12.1, 0.8) * 1e-3), marks=pytest.mark.slow),
    ],
)
def test_the_tongue_of_another_mode_is_stepped_over_and_told(shallow, amplitudes):
    """Near 9.45 mm the fourth harmonic meets a higher mode, and the branch turns; beyond it goes on as its energy says.

    The tongue takes the frequency up before, and down beyond, by up to 2 %.
    """
    found = backbone(shallow, 1, amplitudes)
    (gap,) = found.gaps
    assert gap == pytest.approx([9.449e-3, 10.6e-3], rel=5e-3)
    assert list(found.amplitudes) == [a for a in amplitudes if not gap[0] < a < gap[1]]
    exact = [by_energy(np.sign(found.direction[2]) * 0.6 * H, a) for a in found.amplitudes]
    np.testing.assert_allclose(found.omega, exact, rtol=2e-2)
    assert found.omega[-1] / (2 * np.pi) == pytest.approx(32.365, rel=1e-4)  # steps of amplitude do not count
    size = np.linalg.norm(found.harmonics[:, 1:], axis=2)
    assert (size.argmax(axis=1) == 0).all()


def second_program(step=5e-3):
    """Amplitudes [m] and frequencies [Hz] by sines and a uniform tension, first 0.4 mm apart, then round the fold."""
    arch = ShallowArch(LENGTH, 0.6 * H, E * WIDTH * H, E * WIDTH * H**3 / 12, RHO * WIDTH * H, 16)
    return arch.branch(np.arange(0.4, 9.21, 0.4) * 1e-3, 12e-3, step)


@pytest.mark.slow
def test_the_branch_is_that_of_a_second_program(shallow):
    other = second_program()[:23]
    found = backbone(shallow, 1, other[:, 0])
    np.testing.assert_allclose(found.omega / (2 * np.pi), other[:, 1], rtol=1e-3)


@pytest.mark.slow
def test_a_fold_is_passed_and_what_lies_behind_it_are_motions_too(shallow):
    """The branch turns where that of a second program does, within 1e-3, and leads on to smaller amplitudes.

    There too the compiled equations repeat it. (Uniform tension in place of waves of stretch: 4e-4.)
    """
    points = backbone(shallow, 1, [9.2e-3, 9.4e-3, 12e-3]).path
    amplitudes = np.array([at.amplitude for at in points])
    turn = int(np.argmax(np.diff(amplitudes) < 0))
    assert amplitudes[turn] == pytest.approx(second_program()[:, 0].max(), rel=1e-3)
    assert amplitudes[turn + 1] < amplitudes[turn]
    for at in (points[turn + 1], points[-1]):
        end, start = after_a_period(shallow, at)
        np.testing.assert_allclose(end, start, atol=3e-3 * np.abs(start).max())


@pytest.mark.slow
def test_amplitudes_that_all_lie_in_the_tongue_are_refused_with_its_bounds(shallow):
    with pytest.raises(
        BackboneError, match=r"between amplitudes of 0\.0094.* and 0\.01.* m a higher harmonic is in internal resonance"
    ):
        backbone(shallow, 1, [9.7e-3])


@pytest.mark.slow
def test_an_arch_that_snaps_through_tells_no_negative_frequency():
    with pytest.raises(BackboneError, match=r"the branch was followed up to") as error:
        backbone(arch(2 * H, (*PINNED, "ry"), "nonlinear"), 1, H * np.array([0.2, 0.6, 1.2]))
    reached = error.value.found
    assert reached is not None and len(reached.omega) == 2 and (reached.omega > 0.5 * reached.small).all()
