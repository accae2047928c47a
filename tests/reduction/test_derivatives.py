"""Modal derivatives, third derivatives and sheets against full finite elements and closed forms."""

from __future__ import annotations

import numpy as np
import pytest
from support.full_solution import FullModel, Reduced, static_path
from support.nonlinear_models import METAL

from femflex.fem import Member, build_structure
from femflex.fem.sections import Rectangle
from femflex.mesh import box, line, rectangle
from femflex.reduction import (
    cantilever_modes,
    reduce_structure,
    strain_tensors,
    with_attachment,
    with_derivatives,
    with_third_derivatives,
)
from femflex.reduction.boundary.rigid import rigid_shapes
from femflex.reduction.large_deflection.derivatives import scaled_derivatives
from femflex.reduction.large_deflection.stretch import relaxed_energy
from femflex.reduction.large_deflection.third_derivatives import third_derivative

# a strip's bending in its own plane, which nothing excites here, is warned of
pytestmark = pytest.mark.filterwarnings("ignore:plates turn in their own planes")
LENGTH, THICKNESS = 1.0, 0.01


def beam(order=6, n=4):
    section = Rectangle(0.05, THICKNESS)
    mesh = line([[0, 0, 0], [LENGTH, 0, 0]], n)
    options = {"order": order, "orientation": (0, 1, 0), "rotary_inertia": False}
    return build_structure(mesh, [Member("line", "beam", section, METAL, options)])


def plate():
    mesh = rectangle(LENGTH, 0.05, 20, 1, "triangle")
    return build_structure(mesh, [Member("surface", "plate", THICKNESS, METAL)])


def solid():
    mesh = box(LENGTH, 0.05, THICKNESS, 20, 1, 1, "hexahedron27")
    return build_structure(mesh, [Member("volume", "solid", None, METAL)])


def ratios(structure, modes, deflection):
    """Energy over linear energy with the lowest shape alone, and with all others of the set relaxed."""
    tensors = strain_tensors(structure, modes.phi)
    amount = deflection / np.abs(structure.translation @ modes.phi[:, 0]).max()
    linear = tensors.V1[0, 0] * amount**2 / 2
    alone = tensors.energy(amount * np.eye(modes.n_modes)[0])
    return alone / linear, relaxed_energy(tensors, 0, amount) / linear


def test_derivatives_compensate_stretch_of_single_bending_mode():
    """eps = w'^2 / 2 is not relaxed: 1 + (a / h)^2 3 int w'^4 / int w''^2 with the clamped-free function w of unit tip.

    A strip of length 100 h: 2.75 at 1 % of its length and 175.7 at 10 %.
    """
    structure = beam()
    full = with_derivatives(structure, cantilever_modes(structure, "start", 1))
    assert full.kinds == ("vibration", "derivative")
    k, s = 1.8751040687119611, 0.7340955137589128  # beta L, and the ratio of the function's two parts
    x = np.linspace(0, 1, 20001)
    slope = k * (np.sinh(k * x) + np.sin(k * x) - s * (np.cosh(k * x) - np.cos(k * x))) / 2
    bend = k**2 * (np.cosh(k * x) + np.cos(k * x) - s * (np.sinh(k * x) + np.sin(k * x))) / 2
    factor = 3 * np.trapezoid(slope**4, x) / np.trapezoid(bend**2, x)
    assert factor == pytest.approx(1.747, abs=1e-3)
    curved = np.trapezoid((slope * bend) ** 2, x) / np.trapezoid(bend**2, x)  # kappa^2 = w''^2 (1 + w'^2)
    for deflection in (0.01, 0.1):
        alone, relaxed = ratios(structure, full, deflection)
        assert alone == pytest.approx(1 + factor * (deflection / THICKNESS) ** 2, rel=2e-5)
        assert relaxed == pytest.approx(1 + curved * deflection**2, abs=0.002 * deflection)


@pytest.mark.parametrize("make", [plate, solid])
def test_derivatives_relax_plates_and_solids_too(make):
    structure = make()
    full = with_derivatives(structure, cantilever_modes(structure, "left", 1))
    for deflection, bound in ((0.01, 5e-5), (0.1, 5e-3)):
        alone, relaxed = ratios(structure, full, deflection)
        assert alone > 2.7 * (deflection / 0.01) ** 2 / 2
        assert 0 < relaxed - 1 < bound


def test_derivative_is_static_response_to_change_of_tangent():
    structure = solid()
    modes = cantilever_modes(structure, "left", 2)
    theta = scaled_derivatives(structure, modes)
    phi = modes.phi / modes.omega
    elastic, h = structure.internal_force, 1e-2
    change = (elastic.tangent(h * phi[:, 1]) - elastic.tangent(-h * phi[:, 1])) / (2 * h)
    for column, i in ((1, 0), (2, 1)):  # pairs 00, 01, 11
        residual = structure.K @ theta[:, column] + change @ phi[:, i]
        residual[modes.held] = 0.0
        assert np.abs(residual).max() < 1e-7 * np.abs(change @ phi[:, i]).max()
    assert not theta[modes.held].any()


H = 0.01


def plate_derivatives(along=4, across=3):
    mesh = rectangle(1.0, 0.6, along, across, "quad")
    return build_structure(mesh, [Member("surface", "plate_bfs", H, METAL)])


def solid_derivatives():
    mesh = box(1.0, 0.3, 0.05, 4, 2, 1, "hexahedron27")
    return build_structure(mesh, [Member("volume", "solid", None, METAL)])


@pytest.mark.parametrize(("make", "order"), [(plate_derivatives, 5.0), (solid_derivatives, 4.0)])
def test_derivatives_match_static_path_of_full_elements_to_third_order(make, order):
    structure = make()
    one = cantilever_modes(structure, "left", 1).picked([0])
    full = FullModel(structure, one.held)
    phi = one.phi[:, 0] / one.omega[0]
    theta, psi = scaled_derivatives(structure, one)[:, 0], third_derivative(structure, one)
    size = 0.3 * H / np.abs(structure.translation @ phi).max()
    factors = size * np.array([0.25, 0.5, 1.0])
    exact = static_path(full, (structure.K @ phi)[full.free], factors)
    lacking = []
    for q, x in zip(factors, exact, strict=True):
        left = full.on_all_dofs(x) - phi * q - theta * q**2 / 2
        lacking.append([np.abs(structure.translation @ d).max() for d in (left, left - psi * q**3)])
    lacking = np.array(lacking)
    assert np.log2(lacking[1:, 0] / lacking[:-1, 0]) == pytest.approx([3, 3], abs=0.1)
    assert np.all(np.log2(lacking[1:, 1] / lacking[:-1, 1]) > order - 1.1)
    assert lacking[-1, 1] < 0.1 * lacking[-1, 0]


def test_one_third_derivative_suffices_for_plate_bent_by_eight_thicknesses():
    """Such a plate_derivatives stops curving crosswise."""
    structure = plate_derivatives(8, 5)
    load = structure.M @ rigid_shapes(structure)[:, 2]
    tip = structure.translation[[3 * structure.mesh.group_points("top_right")[0] + 2]].toarray()[0]
    full = FullModel(structure, cantilever_modes(structure, "left", 1).held)
    unit = 8 * H / (tip[full.free] @ static_path(full, load[full.free], [1.0])[0])
    factors = unit * np.array([0.25, 0.5, 1.0])
    exact = static_path(full, load[full.free], factors) @ tip[full.free]
    assert exact[-1] == pytest.approx(8 * H, rel=0.1)
    off = []
    for modes, third in ((5, 1), (9, 0)):
        shapes = with_attachment(structure, cantilever_modes(structure, "left", modes), ["z"])
        shapes = with_derivatives(structure, with_third_derivatives(structure, shapes, third))
        body = reduce_structure(structure, shapes, strain="condensed")
        assert body.n_modes == modes + 1 + third
        phi = shapes.phi[:, : body.n_modes]
        found = static_path(Reduced(body.strain), phi.T @ load, factors) @ (phi.T @ tip)
        off.append(np.abs(found / exact - 1).max())
    assert off[0] < 1e-4
    assert off[1] > 10 * off[0]


WIDTH, H_BENDS = 0.6, 1.5e-3
START, REACH = 0.02, 0.23  # bends of the first and the last state
