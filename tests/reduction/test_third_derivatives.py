"""Third derivatives: the static path of the full elements to third order, and plates bent by many thicknesses."""

from __future__ import annotations

import numpy as np
import pytest
from support.full_solution import Full, Reduced, static_path
from support.nonlinear_models import METAL

from femflex.fem import Member, build_structure
from femflex.fem.sections import Rectangle
from femflex.mesh import box, line, rectangle
from femflex.reduction import (
    cantilever_modes,
    reduce_structure,
    with_attachment,
    with_derivatives,
    with_third_derivatives,
)
from femflex.reduction.boundary.rigid import rigid_shapes
from femflex.reduction.large_deflection.derivatives import scaled_derivatives
from femflex.reduction.large_deflection.third_derivatives import third_derivative

H = 0.01


def plate(along=4, across=3):
    mesh = rectangle(1.0, 0.6, along, across, "quad")
    return build_structure(mesh, [Member("surface", "plate_bfs", H, METAL)])


def solid():
    mesh = box(1.0, 0.3, 0.05, 4, 2, 1, "hexahedron27")
    return build_structure(mesh, [Member("volume", "solid", None, METAL)])


@pytest.mark.parametrize(("make", "order"), [(plate, 5.0), (solid, 4.0)])
def test_the_static_path_of_the_full_elements_is_theirs_to_third_order(make, order):
    structure = make()
    one = cantilever_modes(structure, "left", 1).picked([0])
    full = Full(structure, one.held)
    phi = one.phi[:, 0] / one.omega[0]
    theta, psi = scaled_derivatives(structure, one)[:, 0], third_derivative(structure, one)
    size = 0.3 * H / np.abs(structure.translation @ phi).max()
    factors = size * np.array([0.25, 0.5, 1.0])
    exact = static_path(full, (structure.K @ phi)[full.free], factors)
    lacking = []
    for q, x in zip(factors, exact, strict=True):
        left = full.whole(x) - phi * q - theta * q**2 / 2
        lacking.append([np.abs(structure.translation @ d).max() for d in (left, left - psi * q**3)])
    lacking = np.array(lacking)
    assert np.log2(lacking[1:, 0] / lacking[:-1, 0]) == pytest.approx([3, 3], abs=0.1)
    assert np.all(np.log2(lacking[1:, 1] / lacking[:-1, 1]) > order - 1.1)
    assert lacking[-1, 1] < 0.1 * lacking[-1, 0]


def test_one_of_them_does_for_a_plate_bent_by_eight_thicknesses_what_four_more_modes_do_not():
    """Such a plate stops curving crosswise."""
    structure = plate(8, 5)
    load = structure.M @ rigid_shapes(structure)[:, 2]
    tip = structure.translation[[3 * structure.mesh.group_points("top_right")[0] + 2]].toarray()[0]
    full = Full(structure, cantilever_modes(structure, "left", 1).held)
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


def test_the_set_stays_orthonormal_and_says_what_was_added():
    structure = plate()
    shapes = with_third_derivatives(structure, cantilever_modes(structure, "left", 3), 2)
    assert shapes.kinds == ("vibration",) * 3 + ("third derivative",) * 2
    np.testing.assert_allclose(shapes.phi.T @ (structure.M @ shapes.phi), np.eye(5), atol=1e-9)
    assert np.all(shapes.omega[3:] > shapes.omega[0])
    with pytest.raises(ValueError, match="third derivatives of 4 shapes were requested; the set has 3"):
        with_third_derivatives(structure, cantilever_modes(structure, "left", 3), 4)


def test_a_twist_has_none_where_the_beam_draws_in_freely():
    member = Member("line", "beam", Rectangle(0.03, H), METAL, {"order": 6})
    structure = build_structure(line([[0, 0, 0], [1, 0, 0]], 4), [member])
    modes = cantilever_modes(structure, "start", 12)
    turns = structure.rotation[[3 * structure.mesh.group_points("end")[0]]] @ modes.phi
    with pytest.raises(ValueError, match=r"rad/s is zero: large bending does not change it"):
        with_third_derivatives(structure, modes.picked([int(np.abs(turns).argmax())]), 1)
