"""Pretension, heat and buckling of reduced bodies: closed forms."""

from __future__ import annotations

import warnings

import numpy as np
import pytest
from scipy import sparse
from scipy.linalg import eigh
from support.full_solution import Reduced, static_path
from support.nonlinear_models import METAL

from femflex.fem import Member, build_structure
from femflex.fem.eigen.modes import factorised
from femflex.fem.sections import Rectangle
from femflex.fem.sections.laminates import Lamina, Ply, layup
from femflex.mesh import Mesh, line, rectangle
from femflex.reduction import (
    cantilever_modes,
    critical_factor,
    reduce_structure,
    relaxed,
    strain_tensors,
    with_attachment,
    with_derivatives,
)
from femflex.reduction.boundary.clamps import held_dofs
from femflex.reduction.modes import buckling
from femflex.reduction.strain.initial_stress import largest_strain, stress_energy, warn_of_initial_stress
from femflex.warning import PhysicsWarning

WIDTH, H = 0.05, 0.01
A, EI = WIDTH * H, METAL.E * WIDTH * H**3 / 12
EULER = np.pi**2 * EI  # of a pinned beam of unit length [N]
PINS = dict.fromkeys(("start", "end"), ("x", "y", "z", "rx"))

pytestmark = pytest.mark.filterwarnings("ignore:the initial stress is close to buckling")  # looked at in cases


def beam(n=4, order=6, **options):
    mesh = line([[0, 0, 0], [1.0, 0, 0]], n)
    own = {"order": order, "orientation": (0, 1, 0), "rotary_inertia": False, **options}
    return build_structure(mesh, [Member("line", "beam", Rectangle(WIDTH, H), METAL, own)])


def omega_1(pull):
    """First frequency of a pinned beam under an axial force [rad/s]."""
    return np.pi**2 * np.sqrt(EI / (METAL.density * A) * (1 + pull / EULER))


@pytest.mark.parametrize("pull", [0.0, 3.0, -0.5, -0.99])
def test_pretension_stiffens_a_beam_as_the_closed_form_says(pull):
    structure = beam(prestress=pull * EULER)
    found = cantilever_modes(structure, PINS, 1).omega[0]
    assert found == pytest.approx(omega_1(pull * EULER), rel=1e-6)


def test_a_clamped_panel_pulled_along_its_length_is_stiffened_by_its_own_strip():
    """A plate between two edges, nu = 0 by a narrow strip: omega^2 grows by N pi^2 / m for a pinned strip."""
    pull = 2e4  # N/m
    strip = rectangle(1.0, 0.05, 16, 1, "quad")
    ends = {"left": ("x", "y", "z"), "right": ("x", "y", "z")}
    found = []
    for prestress in (None, (pull, 0.0, 0.0)):
        member = Member("surface", "plate_bfs", H, METAL, {"prestress": prestress})
        found.append(cantilever_modes(build_structure(strip, [member]), ends, 1).omega[0])
    assert found[1] ** 2 - found[0] ** 2 == pytest.approx(pull * np.pi**2 / (METAL.density * H), rel=5e-3)


@pytest.mark.parametrize(("n", "order"), [(4, 6), (120, 3)])
def test_the_critical_factor_is_eulers(n, order):
    structure = beam(n, order, prestress=-0.4 * EULER)
    assert critical_factor(structure, held_dofs(structure, PINS)) == pytest.approx(2.5, rel=1e-6)
    pulled = beam(prestress=EULER)
    assert critical_factor(pulled, held_dofs(pulled, PINS)) == np.inf


@pytest.mark.parametrize("dense", [True, False])
@pytest.mark.parametrize("ends", [(-0.4, 7.0), (-3.0, 0.2), (0.1, 0.5), (-5.0, -2.0)])
def test_the_lowest_ratio_is_found_among_larger_ones_of_either_sign(dense, ends, monkeypatch):
    monkeypatch.setattr(buckling, "SMALL", 40 if dense else 0)
    n = 30
    ratios, S = np.linspace(*ends, n), np.eye(n) + 0.2 * np.random.default_rng(5).normal(size=(n, n))
    K0 = sparse.csr_array(S.T @ S)
    K_sigma = sparse.csr_array(S.T @ (ratios[:, None] * S))
    assert buckling.lowest_ratio(K_sigma, K0) == pytest.approx(ends[0], rel=1e-9)
    found, x = buckling.roughly_lowest(K_sigma, K0, factorised(K0))
    assert found == pytest.approx(ends[0], abs=buckling.ROUGHLY * abs(1 + ends[0]))
    assert x @ K_sigma @ x / (x @ K0 @ x) == pytest.approx(found, abs=1e-9)


def test_a_buckled_structure_is_refused_with_the_factor_it_bears():
    structure = beam(thermal_strain=2 * EULER / (METAL.E * A))
    with pytest.raises(ValueError, match=r"buckles the structure: its linear buckling load factor is 0.5, and must"):
        cantilever_modes(structure, PINS, 2)
    with pytest.raises(ValueError, match=r"clamped at .'start'., has 1 rigid motion without"):
        cantilever_modes(beam(prestress=EULER), {"start": ("x", "y", "z")}, 2)


def test_linear_strain_warns_of_stress_that_no_support_holds():
    structure = beam(thermal_strain=-1e-4)
    modes = cantilever_modes(structure, "start", 3)
    with pytest.warns(PhysicsWarning, match=r"static motion would release 100% of its energy, over 1%, and linear"):
        reduce_structure(structure, modes)
    held = cantilever_modes(structure, PINS, 3)
    assert reduce_structure(structure, held).strain.f0 == pytest.approx(0.0, abs=1e-6)  # and no warning


def test_stress_that_no_support_holds_goes_and_what_is_held_stays():
    structure = beam(thermal_strain=1e-3)  # enough to buckle it, were it held
    for clamp in ("start", ()):
        loose = relaxed(structure, clamp)
        scale = np.abs(structure.f0).max()
        assert np.abs(loose.f0).max() < 1e-9 * scale
        assert abs(loose.K - beam().K).max() < 1e-9 * abs(loose.K).max()
    assert cantilever_modes(relaxed(structure, "start"), "start", 2).omega == pytest.approx(
        cantilever_modes(beam(), "start", 2).omega, rel=1e-9
    )
    held = beam(thermal_strain=-1e-3)
    np.testing.assert_allclose(relaxed(held, PINS).K.toarray(), held.K.toarray(), rtol=1e-9, atol=1e-3)
    assert relaxed(beam(), "start").stressed is False


@pytest.mark.parametrize(("family", "cell"), [("plate", "triangle"), ("plate_bfs", "quad")])
def test_a_pulled_plate_held_on_two_sides_keeps_a_stress_in_equilibrium(family, cell):
    """Cooled between two edges, free on the others: what is left varies, balances, and its energy has fallen."""
    mesh = rectangle(1.0, 0.6, 6, 4, cell)
    member = Member("surface", family, H, METAL, {"thermal_strain": -1e-3})
    structure = build_structure(mesh, [member])
    left = relaxed(structure, ["left", "right"])
    free = np.setdiff1d(np.arange(structure.n_dof), held_dofs(structure, ["left", "right"]))
    assert np.abs(left.f0[free]).max() < 1e-9 * np.abs(structure.f0[free]).max()
    assert 0.3 < stress_energy(left) / stress_energy(structure) < 0.9
    middle = left.strain[0].stress.reshape(-1, left.strain[0].linear_map.shape[0]).mean(axis=0)
    pull = METAL.E * H * 1e-3
    assert pull < middle[0] < pull / (1 - METAL.nu**2)  # between a strip free to narrow and one held
    stiff = cantilever_modes(left, ["left", "right"], 1)
    tensors = strain_tensors(left, stiff.phi)
    assert tensors.V1[0, 0] == pytest.approx(stiff.omega[0] ** 2, rel=1e-9)
    assert np.abs(tensors.f0).max() < 1e-9 * np.abs(stiff.phi.T @ structure.f0).max() + 1e-6


def test_a_heated_cantilever_finds_its_new_length_and_keeps_its_frequencies():
    """Reduced as it was given, by shapes that can stretch: f0 drives it to where no stress is left."""
    strain = 1e-3
    structure, cold = beam(thermal_strain=strain), cantilever_modes(beam(), "start", 2)
    modes = with_derivatives(beam(), with_attachment(beam(), cold, [], {"end": ["x"]}))
    body = reduce_structure(structure, modes, {"tip": "end"}, strain="nonlinear")
    (d,) = static_path(Reduced(body.strain), np.full(modes.n_modes, 1e-30), [1.0])
    tip = body.markers["tip"].phi @ body.amplitudes(d)
    assert tip == pytest.approx([np.sqrt(1 + 2 * strain) - 1, 0, 0], abs=1e-9)
    hot = np.sqrt(eigh(body.strain.tangent(d), eigvals_only=True)[:2])
    np.testing.assert_allclose(hot, cold.omega, rtol=3e-3)  # stretched by a thousandth
    assert np.linalg.eigvalsh(body.strain.V1)[0] < 0  # with the stress held it would have buckled


def test_the_largest_strain_told_is_that_of_the_pull():
    """N / EA of a beam between two clamps, and sigma / E of a plate pulled one way."""
    pull = 0.031 * METAL.E * A
    given = beam(prestress=pull)
    assert largest_strain(given, given) == pytest.approx(0.031, rel=1e-9)
    fibre = Lamina(140e9, 10e9, 5e9, 0.3, 1600.0)
    section = layup([Ply(fibre, 1e-3, np.radians(way)) for way in (25, -25, -25, 25)])
    sheet = build_structure(
        rectangle(1.0, 0.5, 2, 1), [Member("surface", "plate", section, None, {"prestress": (1e4, 0.0, 0.0)})]
    )
    along, across, _ = np.linalg.solve(section.A, [1e4, 0.0, 0.0])
    assert -across > 1.2 * along  # such a laminate draws in by more than it is stretched
    assert largest_strain(sheet, sheet) == pytest.approx(along, rel=1e-6)
    with pytest.warns(PhysicsWarning, match="strains it by up to 3.1%, and strain is taken to be small, below"):
        warn_of_initial_stress("the beam", given, given)


@pytest.mark.parametrize(
    ("clamp", "strain", "moved"),
    [("start", 5e-3, 5e-3), ("start", 5e-4, None), (("start", "end"), 5e-3, None)],
)
def test_heat_that_moves_a_body_is_said_to_be_in_no_result(clamp, strain, moved):
    """A heated cantilever grows by strain x length; up to 1e-3 of its size, and between walls, nothing is said."""
    given = beam(thermal_strain=strain)
    left = relaxed(given, clamp)
    with warnings.catch_warnings(record=True) as seen:
        warnings.simplefilter("always")
        warn_of_initial_stress("the beam", given, left, meant=False)
    assert len(seen) == (moved is not None)
    if seen:
        assert f"moves it by up to {moved:.4g} m, 0.005 of its size (limit 0.001)" in str(seen[0].message)
        assert "this displacement is in no result" in str(seen[0].message)


def two_bars(prestress=3000.0):
    """A bar of 1.5 m between walls, and one of 3.5 m that ends free, on skew lines; both under the same tension."""
    way, other = np.array([0.6, 0.8, 0.0]), np.array([0.0, 0.6, 0.8])
    points = np.array(
        [0 * way, 0.75 * way, 1.5 * way, [0, 0, 1.0], [0, 0, 1.0] + 1.75 * other, [0, 0, 1.0] + 3.5 * other]
    )
    cells = np.array([[0, 1], [1, 2], [3, 4], [4, 5]])
    walls = {"walls": np.array([0, 2, 3])}
    mesh = Mesh(points, {"line": cells}, {"bars": {"line": np.arange(4)}}, walls)
    return build_structure(mesh, [Member("bars", "beam", Rectangle(0.02, 0.02), METAL, {"prestress": prestress})])


def test_the_part_of_a_stress_that_clamps_sustain_is_that_of_its_energy():
    given = two_bars()
    left = relaxed(given, "walls")
    with pytest.warns(
        PhysicsWarning, match=r"the bars: its clamps sustain 30% of the energy .* \(limit 50%\); the rest"
    ):
        warn_of_initial_stress("the bars", given, left)
    modes = cantilever_modes(given, "walls", 2)
    with pytest.warns(PhysicsWarning, match=r"static motion would release 70% of its energy, over 1%"):
        reduce_structure(given, modes)
    warn_of_initial_stress("the bars", given, left, meant=False)  # it moves by 1e-4 of its size
