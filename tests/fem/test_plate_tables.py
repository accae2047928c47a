"""Plates in several planes with orthotropic sections and unequal cells: energy, mass, places, and what they refuse."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.sparse.linalg import spsolve
from support.plate_models import displaced, random_rotation

from femflex.fem import Member, build_structure
from femflex.fem.sections.laminates import orthotropic
from femflex.mesh import Mesh, rectangle

SHEET = orthotropic(0.01, 140e9, 10e9, 5e9, 0.3, 1600.0, G13=4e9, G23=3e9)
FAMILIES = (("plate", "triangle"), ("plate_bfs", "quad"))


def graded(cell: str, x=(0, 0.3, 1.0, 1.2), y=(0, 0.5, 0.7)) -> Mesh:
    """Cells of unequal width and height."""
    mesh = rectangle(len(x) - 1.0, len(y) - 1.0, len(x) - 1, len(y) - 1, cell)
    p = mesh.points
    points = np.stack([np.interp(p[:, 0], np.arange(len(x)), x), np.interp(p[:, 1], np.arange(len(y)), y), 0 * p[:, 0]])
    return Mesh(points.T, mesh.cells, mesh.cell_groups, mesh.point_groups)


GRADES = {"both": ((0, 0.3, 1.0, 1.2), (0, 0.5, 0.7)), "along": ((0, 0.3, 1.2), (0, 0.35, 0.7)),
          "across": ((0, 0.6, 1.2), (0, 0.5, 0.7)), "none": ((0, 0.6, 1.2), (0, 0.35, 0.7))}  # fmt: skip


UPRIGHT = np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])
PLACED = [(grade, random_rotation(51)) for grade in GRADES] + [("both", UPRIGHT), ("none", UPRIGHT[[1, 2, 0]])]


@pytest.mark.parametrize(("grade", "C"), PLACED)
@pytest.mark.parametrize(("family", "cell"), FAMILIES)
def test_constant_curvature_and_rigid_motion_on_unequal_cells_have_their_energy_and_mass(family, cell, grade, C):
    """w of second degree: kappa.D kappa over the area, fibres askew; M of w = 1, x, y with rotary inertia."""
    k = np.array([0.6, -0.4, 0.9])  # w,xx w,yy w,xy
    mesh = graded(cell, *GRADES[grade]).rotated(C)
    axis = C @ [1.0, 0.7, 0]
    s = build_structure(mesh, [Member("surface", family, SHEET, None, {"axis": axis})])

    def w(p):
        x, y, _ = (p @ C).T
        return (k[0] * x * x / 2 + k[1] * y * y / 2 + k[2] * x * y)[:, None] * C[:, 2]

    def turn(p):
        x, y, _ = (p @ C).T
        return np.stack([k[1] * y + k[2] * x, -(k[0] * x + k[2] * y), 0 * x], axis=1) @ C.T

    v = displaced(s, w, turn)
    both = [v]
    if family == "plate_bfs":  # with the twist w,xy of the nodes, whose sign goes with the axes of the elements
        raw = np.zeros(s.T.shape[0])
        raw[s.strain[0].dofs[:, 32:36]] = k[2]
        both = [v + sign * (s.T.T @ raw) for sign in (1, -1)]
    angle = np.arctan2(0.7, 1.0)
    D = 0.01**3 / 12 * plane_stress(angle)
    kappa = -np.array([k[0], k[1], 2 * k[2]])
    energy = 1.2 * 0.7 * kappa @ D @ kappa
    assert min(v @ s.K @ v for v in both) == pytest.approx(energy, rel=1e-8)
    for move, about in ((np.zeros(3), [1.0, 0, 0]), (np.array([0.2, 0.5, -1.0]), [0.3, -0.8, 0])):
        omega = C @ about
        r = displaced(s, lambda p, m=move, o=omega: m + np.cross(o, p), lambda p, o=omega: np.broadcast_to(o, p.shape))
        m, c = 16.0 * 1.2 * 0.7, np.array([0.6, 0.35, 0.0])
        J = m / 12 * np.diag([0.7**2 + 0.01**2, 1.2**2 + 0.01**2, 1.2**2 + 0.7**2]) + m * (
            c @ c * np.eye(3) - np.outer(c, c)
        )
        own, at = C.T @ move, np.array(about)
        energy = m * own @ own + 2 * m * own @ np.cross(at, c) + at @ J @ at
        assert r @ s.M @ r == pytest.approx(energy, rel=1e-9)
    H = np.array([[0.7, -0.2, 0], [0.5, 0.4, 0], [0, 0, 0]])
    stretch = displaced(s, lambda p: p @ (C @ H @ C.T).T, lambda p: 0.15 * C[:, 2] + 0 * p)
    e = np.array([0.7, 0.4, 0.3])
    assert stretch @ s.K @ stretch == pytest.approx(0.84 * e @ (0.01 * plane_stress(angle)) @ e, rel=1e-8)
    g = s.strain[0].gradients((s.T @ stretch)[:, None], slice(None))[..., 0]
    assert g[..., 0] + g[..., 3] == pytest.approx(np.full(g.shape[:2], 1.1))  # trace and determinant of the gradient
    assert g[..., 0] * g[..., 3] - g[..., 1] * g[..., 2] == pytest.approx(np.full(g.shape[:2], 0.38))
    z = s.inertia[0].shapes((s.T @ stretch)[:, None], slice(None))[..., 0]
    assert z == pytest.approx(s.inertia[0].rho @ (C @ H @ C.T).T, abs=1e-12)
    (place,) = s.places
    assert place.kind == "plate" and place.lever == pytest.approx(0.005)
    weight = s.strain[0].weight
    assert np.einsum("eq,eqi->i", weight, place.x) == pytest.approx(0.84 * C @ [0.6, 0.35, 0])
    if place.sampled is not None:
        assert place.sampled.mean(axis=1) == pytest.approx(place.x.mean(axis=1))
        assert place.sampled.shape[1] == s.strain[0].sampled(slice(None)).weight.shape[1]


def plane_stress(angle: float) -> np.ndarray:
    """Plane stress of the sheet's fibres at an angle, turned as a tensor of fourth order."""
    q = 1 - 0.3**2 * 10 / 140
    own = np.array([[140e9 / q, 3e9 / q, 0], [3e9 / q, 10e9 / q, 0], [0, 0, 5e9]])
    c = np.zeros((2, 2, 2, 2))
    pairs = ((0, 0), (1, 1), (0, 1))
    for I, (i, j) in enumerate(pairs):
        for J, (k, l) in enumerate(pairs):
            for a, b in {(i, j), (j, i)}:
                for d, e in {(k, l), (l, k)}:
                    c[a, b, d, e] = own[I, J]
    R = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
    turned = np.einsum("ia,jb,kc,ld,ijkl->abcd", R, R, R, R, c)
    return np.array([[turned[i, j, k, l] for k, l in pairs] for i, j in pairs])


def test_a_thick_skew_orthotropic_cantilever_bends_and_shears_as_shells_of_nine_nodes():
    """Two formulations of transverse shear, with shear moduli one to twenty, under a line load at the end."""
    thick = orthotropic(0.2, 30e9, 10e9, 5e9, 0.3, 1600.0, 0.6, G13=4e9, G23=2e8)
    found = []
    for family, mesh in (("plate", rectangle(1.0, 0.8, 10, 8)), ("shell", rectangle(1.0, 0.8, 5, 4, "quad9"))):
        s = build_structure(mesh, [Member("surface", family, thick)])
        free = np.setdiff1d(np.arange(s.n_dof), s.clamped_dofs("left"))
        points = s.mesh.points
        edge = s.mesh.group_points("right")
        edge = edge[np.argsort(points[edge, 1])]
        w = np.full(len(edge), 1.0) if family == "plate" else np.resize([2.0, 4.0], len(edge))
        w[[0, -1]] /= 2
        F = np.zeros((len(points), 3))
        F[edge, 2] = w / w.sum()
        x = np.zeros(s.n_dof)
        x[free] = spsolve(s.K[free][:, free].tocsc(), (s.translation.T @ F.ravel())[free])
        u = (s.translation @ x).reshape(-1, 3)[:, 2]
        found.append([u[s.mesh.nearest_point([1.0, y, 0])] for y in (0, 0.4, 0.8)])
    assert found[0] == pytest.approx(found[1], rel=0.02)


def roof(cell: str) -> Mesh:
    """Three planes of different slope."""
    flat = rectangle(3.0, 1.0, 3, 2, cell)
    x, y, _ = flat.points.T
    return Mesh(np.stack([x, y, np.interp(x, [0, 1, 2, 3], [0, 0.3, 1.5, 0.9])], axis=1), flat.cells, flat.cell_groups)


@pytest.mark.parametrize(("family", "cell"), [*FAMILIES, ("membrane", "triangle")])
def test_fibres_lie_along_the_axis_laid_into_every_plane(family, cell):
    """A homogeneous gradient stretches each plane by its own part, at the angle of the axis in that plane."""
    axis = np.array([0.8, 0.5, 0.1])
    options = {"axis": axis} | ({"prestress": 1e-9} if family == "membrane" else {})
    s = build_structure(roof(cell), [Member("surface", family, SHEET, None, options)])
    H = np.random.default_rng(3).normal(size=(3, 3))
    x = s.translation.T @ (s.mesh.points @ H.T).ravel()
    if family != "membrane":  # what fades at the nodes, and rotations, take what costs least: bending is left out
        raw = s.T @ x
    energy = 0.0
    for rise in (0.3, 1.2, -0.6):
        t = np.array([1.0, 0, rise]) / np.hypot(1.0, rise)
        n = np.cross(t, [0, 1.0, 0])
        along = axis - (axis @ n) * n
        along /= np.linalg.norm(along)
        rows = np.stack([along, np.cross(n, along)])
        e = rows @ (H + H.T) / 2 @ rows.T
        eps = np.array([e[0, 0], e[1, 1], 2 * e[0, 1]])
        energy += np.hypot(1.0, rise) * eps @ SHEET.A @ eps
    if family == "membrane":
        assert x @ s.K0 @ x == pytest.approx(energy, rel=1e-9)
        return
    total = 0.0
    for block in s.strain:
        g = block.gradients(raw[:, None], slice(None))[..., 0]
        eps = np.einsum("sg,eqg->eqs", block.linear_map, g)[..., :3]
        elastic = np.broadcast_to(block.elastic, (*eps.shape[:2], *block.elastic.shape[2:]))[..., :3, :3]
        total += np.einsum("eq,eqs,eqst,eqt->", block.weight, eps, elastic, eps)
    assert total == pytest.approx(energy, rel=1e-9)
