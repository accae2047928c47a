"""Plates in several planes with orthotropic sections and unequal cells: energy, mass, places, and what they refuse."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.sparse.linalg import spsolve
from support.plate_models import METAL, displaced, random_rotation

from femflex.fem import Member, build_structure
from femflex.fem.plate.frames import in_plane, oriented, plane_frames, plane_normals, same_side, section_angles
from femflex.fem.sections.laminates import isotropic, orthotropic
from femflex.mesh import Mesh, rectangle
from femflex.warning import PhysicsWarning

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


def test_normals_point_up_or_along_y_or_along_x():
    given = np.array(
        [[0.3, 0.2, -0.5], [0.4, -0.6, 0.0], [-1.0, 0, 0], [0.1, -0.9, 1e-9], [0, 0, 2.0], [-3.0, 0, 1e-14]]
    )
    unit = given / np.linalg.norm(given, axis=1, keepdims=True)
    signs = np.array([-1, -1, -1, -1, 1, -1.0])
    assert oriented(unit) == pytest.approx(signs[:, None] * unit, abs=1e-12)
    assert [same_side(n) for n in given] == (signs > 0).tolist()


def test_upright_directions_are_laid_in_with_components_shifted():
    """x on a plane across x becomes y, y becomes z, z becomes x; all others their own shadow."""
    e = np.eye(3)
    for k in range(3):
        assert in_plane(e[k], e[[k]])[0] == pytest.approx(e[(k + 1) % 3])
        frames = plane_frames(e[[k]])
        assert np.linalg.det(frames[0]) == pytest.approx(1.0) and frames[0, 2] == pytest.approx(e[k])
    n = np.array([[0.6, 0.0, 0.8]])
    assert in_plane([5.0, 0, 0], n)[0] == pytest.approx([0.8, 0, -0.6])
    angles = section_angles([0.3, 0.9, 0.0], plane_frames(n))
    assert angles == pytest.approx(np.arctan2(0.9, 0.3 * 0.8))


def test_elements_without_area_are_counted_and_the_first_is_shown():
    x = np.array(
        [[[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 0, 0], [1, 1, 0], [2, 2, 0]], [[5, 0, 0], [5, 0, 0], [6, 1, 1]]], float
    )
    with pytest.raises(ValueError) as refusal:
        plane_normals(x, "plate on group 'g'")
    assert str(refusal.value) == (
        f"plate on group 'g': 2 of 3 elements have no area, the first is element 1 with corners {x[1].tolist()}; "
        "repair the mesh"
    )


def words(mesh, family, section=SHEET, material=None, **options) -> str:
    with pytest.raises(ValueError) as refusal:
        build_structure(mesh, [Member("surface", family, section, material, options)])
    return str(refusal.value)


def test_refused_plates_name_what_is_wrong():
    mesh = rectangle(1.0, 1.0, 2, 2)
    at = "plate on group 'surface' "
    assert words(mesh, "plate", element="acm") == f"{at}names element 'acm'; it can be 'dkmt' or 'dkt'"
    assert (
        words(mesh, "plate", SHEET, METAL) == f"{at}has a material and a section with its own material; leave one out"
    )
    assert (
        words(mesh, "plate", 0.01) == f"{at}has a thickness but no isotropic material; give one, or a section of plies"
    )
    assert words(mesh, "plate", True, METAL).startswith(f"{at}has the section True; give a plate section of femflex")
    assert words(mesh, "plate", isotropic(0.01, METAL).shifted(0.1)).startswith(f"{at}has a section that couples mem")
    for axis in ((0, 0, 0), (1.0, 2.0), (np.nan, 1, 0)):
        said = f"axis of a plate is {axis!r}; give a direction of three numbers, not all zero"
        assert words(mesh, "plate", axis=axis) == said
    points = rectangle(2.0, 1.0, 2, 1, "quad").points.copy()
    cells = rectangle(2.0, 1.0, 2, 1, "quad").cells["quad"]
    skew = points + np.outer(points[:, 1], [0.3, 0, 0])
    group = {"surface": {"quad": [0, 1]}}
    said = words(Mesh(skew, {"quad": cells}, group), "plate_bfs")
    assert said.startswith("plate_bfs on group 'surface': 2 of 2 quadrilaterals are not rectangles; element 0 has cor")
    corner = int(np.argmax(points.sum(axis=1)))
    points[corner] += [0.1, 0, 0]
    second = int(np.flatnonzero((cells == corner).any(axis=1))[0])
    said = words(Mesh(points, {"quad": cells}, group), "plate_bfs")
    assert said == (
        f"plate_bfs on group 'surface': 1 of 2 quadrilaterals are not rectangles; element {second} has corners "
        f"{points[cells[second]].tolist()}. Use the plate family on triangles there"
    )


@pytest.mark.parametrize("size", [1.0, 0.01, 1e4])
def test_curved_sides_are_counted_and_the_worst_is_that_of_the_largest_share(size):
    """Sides of 2 m bulge by 8 mm, sides of 0.5 m by 5 mm; one is straight but for rounding, and its node off its
    middle; in any unit."""
    mesh = rectangle(2.0, 0.5, 1, 1, "quad8")
    points = mesh.points.copy()
    for place, off in (((1.0, 0), [0, -0.008, 0]), ((1.0, 0.5), [0.05, 0, 0.0001]), ((0, 0.25), [0.005, 0, 0])):
        points[mesh.nearest_point([*place, 0])] += off
    with pytest.warns(PhysicsWarning) as given:
        build_structure(
            Mesh(size * points, mesh.cells, mesh.cell_groups), [Member("surface", "plate_bfs", 0.01 * size, METAL)]
        )
    text = str(given[0].message)
    assert "plate_bfs on group 'surface': 2 of 4 sides of its second-order cells are curved" in text
    assert f"the worst middle node lies {0.005 * size:.3g} m off a side of {0.5 * size:.3g} m (1.00%; at most" in text
    assert "0.01% counts as straight)" in text
