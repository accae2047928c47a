"""Assembly of M and K against plain scikit-fem forms, as CPU-time ratios in one run on one thread.

Counted on both sides: everything from the mesh to sparse M and K (bases and forms there; element geometry, numbering
and reduction to independent dofs here). Ratios are medians of interleaved pairs.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
import skfem
from skfem.helpers import dd, ddot, dot, eye, grad, sym_grad, trace
from support.assembly_times import femflex_assembly, median_ratio

from femflex.fem import Material, Member
from femflex.mesh import Mesh, box, rectangle

pytestmark = pytest.mark.benchmark

E, NU, RHO, H = 2e9, 0.3, 100.0, 0.01
LAME, MU = E * NU / (1 + NU) / (1 - 2 * NU), E / 2 / (1 + NU)
Matrices = list


@skfem.BilinearForm
def solid_stiffness(u, v, _):
    return LAME * trace(sym_grad(u)) * trace(sym_grad(v)) + 2 * MU * ddot(sym_grad(u), sym_grad(v))


@skfem.BilinearForm
def solid_mass(u, v, _):
    return RHO * dot(u, v)


@skfem.BilinearForm
def membrane_stiffness(u, v, _):
    plane = NU * trace(sym_grad(u)) * trace(sym_grad(v)) + (1 - NU) * ddot(sym_grad(u), sym_grad(v))
    return E * H / (1 - NU**2) * plane


@skfem.BilinearForm
def membrane_mass(u, v, _):
    return RHO * H * dot(u, v)


@skfem.BilinearForm
def bending_stiffness(u, v, _):
    moment = (1 - NU) * dd(u) + NU * eye(trace(dd(u)), 2)
    return E * H**3 / 12 / (1 - NU**2) * ddot(moment, dd(v))


@skfem.BilinearForm
def bending_mass(u, v, _):
    return RHO * (H * u * v + H**3 / 12 * dot(grad(u), grad(v)))


def test_hexahedra_are_ten_times_faster_than_forms():
    """89 kdof of 27-node hexahedra; entries are compared by their norms, which no numbering changes."""
    counts, size = (27, 24, 5), (2.7, 2.0, 0.5)
    mesh = box(*size, *counts, "hexahedron27")
    lines = [np.linspace(0, a, n + 1) for a, n in zip(size, counts, strict=True)]

    def forms() -> Matrices:
        basis = skfem.Basis(skfem.MeshHex.init_tensor(*lines), skfem.ElementVector(skfem.ElementHex2()), intorder=4)
        return [solid_mass.assemble(basis), solid_stiffness.assemble(basis)]

    ours = femflex_assembly(mesh, Member("volume", "solid", material=Material(E, NU, RHO)))
    ratio, femflex_matrices, form_matrices = median_ratio(ours, forms, 3)
    print(f"hexahedra: {femflex_matrices[0].shape[0]} dofs, forms take {ratio:.1f} times as long")
    for mine, theirs in zip(femflex_matrices, form_matrices, strict=True):
        assert mine.shape == theirs.shape
        assert np.linalg.norm(mine.data) == pytest.approx(np.linalg.norm(theirs.data), rel=1e-12)
        assert mine.trace() == pytest.approx(theirs.trace(), rel=1e-12)
    assert ratio > 10


@skfem.BilinearForm
def mindlin_stiffness(u, v, _):
    """Five fields (u, v, w, beta_x, beta_y): membrane, bending and shear."""
    e, f = (0.5 * (g + g.swapaxes(0, 1)) for g in (grad(u)[:2], grad(v)[:2]))
    k, l = (0.5 * (g + g.swapaxes(0, 1)) for g in (grad(u)[3:], grad(v)[3:]))
    c, d = grad(u)[2] + u[3:], grad(v)[2] + v[3:]
    plane = E / (1 - NU**2)
    membrane = NU * trace(e) * trace(f) + (1 - NU) * ddot(e, f)
    bending = NU * trace(k) * trace(l) + (1 - NU) * ddot(k, l)
    return plane * H * membrane + plane * H**3 / 12 * bending + 5 / 6 * MU * H * dot(c, d)


@skfem.BilinearForm
def mindlin_mass(u, v, _):
    return RHO * (H * dot(u[:3], v[:3]) + H**3 / 12 * dot(u[3:], v[3:]))


def triangle_ratio(forms: Callable[[skfem.MeshTri], Matrices], pairs: int) -> tuple[float, Matrices, Matrices]:
    """Forms on 20000 triangles over DKMT with its quadratic in-plane field on the same."""
    line = np.linspace(0, 1, 101)
    ours = femflex_assembly(rectangle(1.0, 1.0, 100, 100), Member("surface", "plate", H, Material(E, NU, RHO)))
    return median_ratio(ours, lambda: forms(skfem.MeshTri.init_tensor(line, line)), pairs)


def test_plate_triangles_are_three_times_faster_than_forms_of_the_same_physics():
    """Plates that stretch, bend and shear, with quadratic in-plane and rotation fields, as one form."""

    def forms(mesh: skfem.MeshTri) -> Matrices:
        basis = skfem.Basis(mesh, skfem.ElementVector(skfem.ElementTriP2(), 5), intorder=4)
        return [mindlin_mass.assemble(basis), mindlin_stiffness.assemble(basis)]

    ratio, femflex_matrices, form_matrices = triangle_ratio(forms, 3)
    print(
        f"plate triangles: {femflex_matrices[0].shape[0]} dofs, forms of Mindlin plates take {ratio:.1f} times as long"
    )
    assert femflex_matrices[0].shape[0] <= form_matrices[0].shape[0]
    assert ratio > 3


def test_plate_triangles_are_faster_than_the_cheapest_forms():
    """Thin plates only: Morley's bending triangle with 6 dofs, the least a form can do, and a vector P2 membrane."""

    def forms(mesh: skfem.MeshTri) -> Matrices:
        bending = skfem.Basis(mesh, skfem.ElementTriMorley(), intorder=4)
        membrane = skfem.Basis(mesh, skfem.ElementVector(skfem.ElementTriP2()), intorder=4)
        return [
            bending_mass.assemble(bending), bending_stiffness.assemble(bending),
            membrane_mass.assemble(membrane), membrane_stiffness.assemble(membrane),
        ]  # fmt: skip

    ratio, femflex_matrices, form_matrices = triangle_ratio(forms, 7)
    n_dof = femflex_matrices[0].shape[0]
    print(f"plate triangles: {n_dof} dofs, Morley and membrane forms take {ratio:.1f} times as long")
    assert femflex_matrices[0].shape[0] <= form_matrices[0].shape[0] + form_matrices[2].shape[0]
    assert ratio > 2.2


def test_plate_rectangles_are_three_times_faster_than_forms():
    """10000 rectangles: the same elements, Bogner, Fox and Schmit with a vector biquadratic membrane, both ways."""
    n = 100
    mesh = rectangle(1.0, 1.0, n, n, "quad")
    line = np.linspace(0, 1, n + 1)

    def forms() -> Matrices:
        form_mesh = skfem.MeshQuad.init_tensor(line, line)
        bending = skfem.Basis(form_mesh, skfem.ElementQuadBFS(), intorder=6)
        membrane = skfem.Basis(form_mesh, skfem.ElementVector(skfem.ElementQuad2()), intorder=4)
        return [
            bending_mass.assemble(bending), bending_stiffness.assemble(bending),
            membrane_mass.assemble(membrane), membrane_stiffness.assemble(membrane),
        ]  # fmt: skip

    ours = femflex_assembly(mesh, Member("surface", "plate_bfs", H, Material(E, NU, RHO)))
    ratio, femflex_matrices, form_matrices = median_ratio(ours, forms, 5)
    print(f"plate rectangles: {femflex_matrices[0].shape[0]} dofs, forms take {ratio:.1f} times as long")
    assert femflex_matrices[0].shape[0] == form_matrices[0].shape[0] + form_matrices[2].shape[0]
    bent = [np.linalg.norm(matrix.data) for matrix in form_matrices[:2]]
    assert bent[1] < np.linalg.norm(femflex_matrices[1].data)
    assert ratio > 3


@pytest.mark.parametrize(("cell", "n"), [("quad9", 60), ("quad", 120)])
def test_shells_take_at_most_twice_the_time_per_dof_of_hexahedra(cell, n):
    """A curved shell of 73 kdof against 89 kdof of 27-node hexahedra."""
    flat = rectangle(1.0, 1.0, n, n, cell)
    x, y = flat.points.T[:2]
    points = np.column_stack([x, y, 0.2 * x**2 + 0.1 * np.sin(3 * y)])
    mesh = Mesh(points, dict(flat.cells), dict(flat.cell_groups))
    shells = femflex_assembly(mesh, Member("surface", "shell", H, Material(E, NU, RHO)))
    solids = femflex_assembly(
        box(2.7, 2.0, 0.5, 27, 24, 5, "hexahedron27"), Member("volume", "solid", material=Material(E, NU, RHO))
    )
    ratio, bricks, curved = median_ratio(solids, shells, 5)  # time of the shells over that of the solids
    per_dof = ratio * bricks[0].shape[0] / curved[0].shape[0]
    print(f"{cell} shells: {per_dof:.2f} times the time per dof of hexahedra")
    assert per_dof < 2
