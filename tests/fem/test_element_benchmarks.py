"""Published problems of solids and shells: an exact thick plate, a curved fan blade, a cantilever bent far."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.sparse.linalg import eigsh, spsolve
from support.plate_models import frequencies
from support.shell_problems import edge_weights, mapped

from femflex.fem import Material, Member, build_structure
from femflex.mesh import box, rectangle
from femflex.mesh.merge import fused
from femflex.reduction.strain.tensors import strain_tensors


@pytest.mark.parametrize(
    ("cell", "n", "rel"), [("hexahedron", 6, 0.01), ("hexahedron27", 6, 0.01), ("tetra10", 8, 0.025)]
)
def test_a_thick_plate_of_solids_has_the_exact_frequencies(cell, n, rel):
    """Simply supported, h / a = 0.1, nu = 0.3: omega h sqrt(rho / G) = 0.0931, 0.2226, 0.3421 of bending (three-
    dimensional elasticity; Srinivas, Rao and Rao, J. Sound Vib. 12 (1970) 187), 0.1 pi of shear in its plane."""
    mesh = box(10.0, 10.0, 1.0, n, n, 2, cell)
    s = build_structure(mesh, [Member("volume", "solid", material=Material(200e9, 0.3, 8000.0))])
    across = {"left": ("y", "z"), "right": ("y", "z"), "front": ("x", "z"), "back": ("x", "z")}
    found = frequencies(s, s.held_dofs(across), 6) / np.sqrt(200e9 / 2.6 / 8000.0)
    np.testing.assert_allclose(found[[0, 1, 3, 5]], [0.0931, 0.2226, 0.1 * np.pi, 0.3421], rtol=rel)


def blade(cell: str, n: int):
    """The fan blade of Olson and Lindberg (1971)."""
    a = 0.3048 / 0.6096
    flat = rectangle(0.3048, a, n, n, cell)
    mesh = mapped(
        flat, lambda p: np.stack([p[:, 0], 0.6096 * np.sin(p[:, 1] - a / 2), 0.6096 * np.cos(p[:, 1] - a / 2)], axis=1)
    )
    family = "plate" if cell == "triangle" else "shell"
    s = build_structure(mesh, [Member("surface", family, 3.048e-3, Material(2.0685e11, 0.3, 7857.2))])
    return frequencies(s, s.clamped_dofs("left"), 5) / (2 * np.pi)


def test_a_curved_fan_blade_on_two_formulations_and_as_measured():
    """Measured 86.6, 135.5, 258.9, 350.6, 395.2 Hz; shells of nine and of four nodes, and flat facets, agree to 1 %."""
    nine, four, facets = blade("quad9", 8), blade("quad", 24), blade("triangle", 20)
    np.testing.assert_allclose(nine, facets, rtol=0.01)
    np.testing.assert_allclose(four, nine, rtol=0.01)
    np.testing.assert_allclose(nine, [86.6, 135.5, 258.9, 350.6, 395.2], rtol=0.05)


@pytest.mark.filterwarnings("ignore:.*four-node elements are longer:femflex.warning.PhysicsWarning")
@pytest.mark.parametrize("cell", ["quad", "quad9", "triangle6"])
def test_strain_tensors_of_a_curved_shell_are_its_full_internal_force(cell):
    """V1, V2, V3 over any shapes: the energy and force of the full elements, which are quartic, to rounding."""
    flat = rectangle(1.0, 0.6, 2, 2, cell)
    mesh = mapped(flat, lambda p: np.stack([p[:, 0], p[:, 1], 0.2 * p[:, 0] ** 2 - 0.1 * p[:, 0] * p[:, 1]], axis=1))
    s = build_structure(mesh, [Member("surface", "shell", 0.02, Material(70e9, 0.3, 2700.0))])
    phi = np.random.default_rng(0).normal(size=(s.n_dof, 3))
    tensors = strain_tensors(s, phi)
    d = np.array([1e-3, -2e-3, 1.5e-3])
    assert tensors.energy(d) == pytest.approx(s.internal_force.energy(phi @ d), rel=1e-9)
    np.testing.assert_allclose(tensors.force(d), phi.T @ s.internal_force.force(phi @ d), rtol=1e-8)


@pytest.mark.slow
def test_a_cantilever_under_an_end_shear_bends_as_sze_liu_and_lo_say():
    """L = 10, b = 1, h = 0.1, E = 1.2e6, nu = 0, F = 4: the elastica, u = 3.286, w = 6.698 (Sze, Liu and Lo 2004)."""
    s = build_structure(
        box(10.0, 1.0, 0.1, 32, 1, 1, "hexahedron27"), [Member("volume", "solid", material=Material(1.2e6, 0.0, 1.0))]
    )
    free = np.setdiff1d(np.arange(s.n_dof), s.clamped_dofs("left"))
    nodes = s.mesh.group_points("right")
    F = np.zeros((len(s.mesh.points), 3))
    F[nodes, 2] = 1.0 / len(nodes)
    unit = s.translation.T @ F.ravel()
    x = np.zeros(s.n_dof)
    for load in np.linspace(0, 4.0, 21)[1:]:
        for _ in range(30):
            residual = load * unit - s.internal_force.force(x)
            if np.abs(residual[free]).max() < 1e-8:
                break
            x[free] += spsolve(s.internal_force.tangent(x)[free][:, free].tocsc(), residual[free])
    tip = (s.translation @ x).reshape(-1, 3)[nodes].mean(axis=0)
    assert tip[2] == pytest.approx(6.698, rel=0.005) and -tip[0] == pytest.approx(3.286, rel=0.005)


def test_a_box_column_of_shells_buckles_at_eulers_load():
    """2 m, 100 mm square, 2 mm: pi^2 E I / 4 L^2, less 0.5 % by shear and by what the walls distort. Walls bend in
    their planes: plates, which lack the squares of these turns, find twice this."""
    b, h, L = 0.1, 0.002, 2.0
    flat = rectangle(L, 4 * b, 10, 4, "quad9")

    def folded(p):
        k = np.floor(p[:, 1] / b + 1e-9).astype(int) % 4
        t, o = p[:, 1] - np.floor(p[:, 1] / b + 1e-9) * b, 0 * p[:, 1]
        y, z = (np.choose(k, [t, b + o, b - t, o]), np.choose(k, [o, t, b + o, b - t]))
        return np.stack([p[:, 0], y, z], axis=1)

    mesh = fused(mapped(flat, folded), 1e-9)
    s = build_structure(mesh, [Member("surface", "shell", h, Material(70e9, 0.3, 1.0))])
    free = np.setdiff1d(np.arange(s.n_dof), s.clamped_dofs("left"))
    F = np.zeros((len(mesh.points), 3))
    for node, part in edge_weights(mesh, "right").items():
        F[node, 0] = -part
    x = np.zeros(s.n_dof)
    x[free] = spsolve(s.K[free][:, free].tocsc(), (s.translation.T @ F.ravel())[free])
    K, G = (A[free][:, free].tocsc() for A in (s.K, s.internal_force.geometric_stiffness(x)))
    load = 1 / eigsh(-G, 1, K, which="LA", v0=np.ones(len(free)), return_eigenvectors=False)[0]
    assert load == pytest.approx(np.pi**2 * 70e9 * (2 / 3 * b**3 * h) / 4 / L**2, rel=0.02)
