"""Initial stress: stiffening, buckling loads and equilibria in closed form."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import eigh
from support.full_solution import Reduced, static_path
from support.nonlinear_models import METAL

from femflex.fem import Material, Member, build_structure
from femflex.fem.sections import Rectangle
from femflex.mesh import line, rectangle
from femflex.reduction import (
    cantilever_modes,
    critical_factor,
    reduce_structure,
    relaxed,
    strain_tensors,
    with_attachment,
    with_derivatives,
)
from femflex.reduction.boundary.rigid import held_dofs, rigid_shapes
from femflex.reduction.boundary.supported import supported
from femflex.reduction.strain.initial_stress import stress_energy

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
def test_frequency_of_pretensioned_beam_matches_closed_form(pull):
    structure = beam(prestress=pull * EULER)
    found = cantilever_modes(structure, PINS, 1).omega[0]
    assert found == pytest.approx(omega_1(pull * EULER), rel=1e-6)


def test_stiffening_of_clamped_panel_under_axial_load():
    """A plate between two edges, nu = 0 by a narrow strip: omega^2 grows by N pi^2 / m for a pinned strip."""
    pull = 2e4  # N/m
    strip = rectangle(1.0, 0.05, 16, 1, "quad")
    ends = {"left": ("x", "y", "z"), "right": ("x", "y", "z")}
    found = []
    for prestress in (None, (pull, 0.0, 0.0)):
        member = Member("surface", "plate_bfs", H, METAL, {"prestress": prestress})
        found.append(cantilever_modes(build_structure(strip, [member]), ends, 1).omega[0])
    assert found[1] ** 2 - found[0] ** 2 == pytest.approx(pull * np.pi**2 / (METAL.density * H), rel=5e-3)


ALL, SIMPLE = ("x", "y", "z", "rx", "ry", "rz"), ("x", "y", "z", "rx")
FIXED = 2.045748  # (4.4934 / pi)^2, tan b = b: between a clamp and a pin


@pytest.mark.parametrize(
    ("n", "order", "ends", "times_euler"),
    [
        (4, 6, {"start": SIMPLE, "end": SIMPLE}, 1.0),
        (120, 3, {"start": SIMPLE, "end": SIMPLE}, 1.0),
        (4, 6, {"start": ALL}, 0.25),
        (4, 6, {"start": ALL, "end": SIMPLE}, FIXED),
        (4, 6, {"start": ALL, "end": ALL}, 4.0),
    ],
)
def test_the_critical_factor_is_eulers(n, order, ends, times_euler):
    structure = beam(n, order, prestress=-0.4 * EULER)
    found = critical_factor(structure, held_dofs(structure, ends))
    assert found == pytest.approx(2.5 * times_euler, rel=1e-6)
    pulled = beam(prestress=EULER)
    assert critical_factor(pulled, held_dofs(pulled, PINS)) == np.inf


@pytest.mark.parametrize(("family", "cell"), [("plate", "triangle"), ("plate_bfs", "quad")])
def test_stress_of_pulled_plate_clamped_on_two_sides_is_in_equilibrium(family, cell):
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


def test_heated_cantilever_expands_without_change_of_frequencies():
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


METAL, SIDE, H_SUPPORTED = Material(7e10, 0.3, 2700.0), 1.0, 5e-3
D = METAL.E * H_SUPPORTED**3 / 12 / (1 - METAL.nu**2)
EDGES = dict.fromkeys(("left", "right", "bottom", "top"), ("z",)) | {"bottom_left": ("x", "y", "z"), "top_left": ("x",)}
NOTHING = np.zeros(0, np.int64)


def sheet(prestress=(0.0, 0.0, 0.0), n=10):
    mesh = rectangle(SIDE, SIDE, n, n, "quad")
    return build_structure(mesh, [Member("surface", "plate_bfs", H_SUPPORTED, METAL, {"prestress": prestress})])


@pytest.mark.parametrize("factor", [0.6, 1.1, 2.5, 40.0])
def test_a_compressed_sheet_buckles_at_the_load_of_navier(factor):
    """Simply supported, square, pressed along x: N = 4 pi^2 D / b^2; borne, nearly borne, and past buckling."""
    structure = sheet((-4 * np.pi**2 * D / SIDE**2 / factor, 0.0, 0.0))
    assert critical_factor(structure, held_dofs(structure, EDGES)) == pytest.approx(factor, rel=1e-3)


def test_a_free_structure_answers_the_balanced_part_of_a_load():
    """K x is the load less the inertia of the rigid acceleration it gives; no rigid motion is in the answer."""
    structure = sheet()
    R, M = rigid_shapes(structure), structure.M
    load = structure.translation.T @ np.random.default_rng(0).standard_normal((structure.translation.shape[0], 2))
    x = supported(structure, NOTHING).answers(load)
    balanced = load - M @ R @ np.linalg.solve(R.T @ (M @ R), R.T @ load)
    assert np.abs(structure.K @ x - balanced).max() < 1e-8 * np.abs(load).max()
    assert np.abs(R.T @ (M @ x)).max() < 1e-9 * np.abs(R.T @ (M @ np.abs(x))).max()
