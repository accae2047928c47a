"""Tables, pictures and warnings of shells with generic numbers: thick, offset, tapered, warped."""

from __future__ import annotations

import re
import warnings

import numpy as np
import pytest
from support.plate_models import METAL, random_rotation

from femflex.fem import Member, build_structure
from femflex.fem.sections.laminates import Lamina, Ply, isotropic, layup
from femflex.fem.shell import fields
from femflex.fem.shell.coarse import warn_if_coarse, warn_of_trapezoids
from femflex.mesh import Mesh, rectangle
from femflex.mesh.quality import quadrature
from femflex.warning import PhysicsWarning

FIBRE = Lamina(140e9, 10e9, 5e9, 0.3, 1600.0, 5e9, 3.5e9)
FOAM = Lamina(2e9, 3e9, 4e8, 0.2, 300.0, 5e8, 2e8)
STACK = layup([Ply(FIBRE, 0.004, 0.3), Ply(FOAM, 0.02, -0.5), Ply(FOAM, 0.005, 1.2)], coupled=True).loaded(3.0)
CELLS = ("quad", "quad9", "triangle6", "triangle")
pytestmark = pytest.mark.filterwarnings(
    "ignore:.*three-node triangles:femflex.warning.PhysicsWarning",
    "ignore:.*elements are longer:femflex.warning.PhysicsWarning",
)


def shell(mesh, section=STACK, **options):
    material = METAL if isinstance(section, float) else None
    return build_structure(mesh, [Member("surface", "shell", section, material, options)])


@pytest.mark.parametrize("cell", CELLS)
@pytest.mark.parametrize(
    "fields", [{}, {"extra_mass": "2 + x"}, {"thickness": 0.05, "density": 700.0}, {"thickness": "0.02 + 0.01 * y"}]
)
def test_mass_about_the_nodes_is_that_of_the_layers(cell, fields):
    """Rigid motion of a flat shell off its nodes, by mass, first and second moment of the thickness, integrated."""
    mesh, offset = rectangle(1.0, 0.8, 2, 2, cell), 0.03
    s = shell(mesh, offset=offset, **fields)
    x, w = np.polynomial.legendre.leggauss(6)
    x, w = (x + 1) / 2, w / 2
    X, Y = (a.ravel() for a in np.meshgrid(x, 0.8 * x, indexing="ij"))
    area = 0.8 * np.outer(w, w).ravel()
    h = np.broadcast_to(eval(str(fields.get("thickness", 0.029)), {"x": X, "y": Y}), X.shape)
    more = np.broadcast_to(eval(str(fields.get("extra_mass", 0.0)), {"x": X, "y": Y}), X.shape)
    f = h / 0.029
    mean = (0.004 * 1600 + 0.025 * 300) / 0.029
    dense = np.full(X.shape, fields.get("density", mean) / mean)
    edges = np.cumsum([-0.0145, 0.004, 0.02, 0.005])
    rho = (1600, 300, 300)
    m0, m1, m2 = (
        sum(r * (b ** (p + 1) - a ** (p + 1)) / (p + 1) for r, a, b in zip(rho, edges, edges[1:], strict=False))
        for p in range(3)
    )
    centre, rotary = m1 / m0, m2 - m1**2 / m0
    mass = m0 * f * dense + 3.0 + more  # the mass that is no structure lies at the mass centre
    c = centre * f + offset
    second = rotary * f**3 * dense + mass * c**2
    sign = float(np.sign(s.inertia[0].V[0, 0, 2]))
    n = len(s.mesh.points)
    move, turn = np.random.default_rng(1).normal(size=(2, 3))
    turn[2] = 0.0
    v = s.translation.T @ (move + np.cross(turn, s.mesh.points)).ravel() + s.rotation.T @ np.tile(turn, n)
    flat = move + np.cross(turn, np.stack([X, Y, 0 * X], axis=1))
    lever = sign * np.cross(turn, [0, 0, 1.0])
    energy = mass * np.sum(flat**2, axis=1) + 2 * mass * c * (flat @ lever) + second * (lever @ lever)
    assert v @ s.M @ v == pytest.approx(area @ energy, rel=1e-9)
    rho_points = np.concatenate([b.rho.reshape(-1, 3) for b in s.inertia])
    dm = np.concatenate([b.dm.ravel() for b in s.inertia])
    assert dm @ rho_points[:, 2] == pytest.approx(sign * area @ (mass * c), rel=1e-9)
    assert dm @ rho_points[:, 2] ** 2 == pytest.approx(area @ second, rel=1e-9)


@pytest.mark.parametrize("cell", CELLS)
def test_uniform_stretch_and_curvature_store_the_energy_of_the_coupled_section(cell):
    """eps_0 + z kappa through a skew, unsymmetric, offset stack, its x axis turned: [A B; B D] by its plies."""
    C, d, angle = random_rotation(4), -0.017, 0.35
    flat = rectangle(1.0, 0.8, 2, 2, cell)
    s = shell(flat.rotated(C), axis=C @ [1.0, 2.0, 0], angle=angle, offset=d)
    up = float(np.sign(s.inertia[0].V[0, 0] @ C[:, 2]))
    x, y, _ = flat.points.T
    e, k = np.array([1.0, -0.4, 0.7]), np.array([3.0, 2.0, -5.0])  # xx yy, engineering xy
    u = np.stack([e[0] * x + e[2] / 2 * y, e[1] * y + e[2] / 2 * x, -(k[0] * x * x + k[1] * y * y + k[2] * x * y) / 2])
    turn = np.stack([-(k[1] * y + k[2] * x / 2), k[0] * x + k[2] * y / 2, 0 * x])
    v = s.translation.T @ (C @ u).T.ravel() + s.rotation.T @ (C @ turn).T.ravel()
    turned = up * angle + np.arctan2(2, 1)
    z = np.cumsum([-0.0145, 0.004, 0.02, 0.005]) + d
    plies = [(FIBRE, 0.3), (FOAM, -0.5), (FOAM, 1.2)]
    energy = 0.0
    for (one, theta), a, b in zip(plies, z, z[1:], strict=False):
        Q = one.plane_stress(turned + up * theta)
        g, w = np.polynomial.legendre.leggauss(3)
        for at, weight in zip((a + b) / 2 + g * (b - a) / 2, w * (b - a) / 2, strict=True):
            eps = e + up * at * k
            energy += weight * eps @ Q @ eps * 0.8
    if cell not in ("quad", "triangle"):  # those of first order bend to a paraboloid by facets
        assert v @ s.K @ v == pytest.approx(energy, rel=1e-9)
    flat_only = s.translation.T @ (C @ np.stack([u[0], u[1], 0 * x])).T.ravel()
    A = sum(
        (b - a) * one.plane_stress(turned + up * theta) for (one, theta), a, b in zip(plies, z, z[1:], strict=False)
    )
    assert flat_only @ s.K @ flat_only == pytest.approx(0.8 * e @ A @ e, rel=1e-9)


@pytest.mark.parametrize("cell", CELLS)
def test_moderate_rotation_stretches_a_shell_by_the_squares_of_its_slopes_and_of_its_turn(cell):
    """Sanders: E = sym(H) + w,a w,b / 2 + delta omega^2 / 2, omega = (v,x - u,y) / 2, of a homogeneous state."""
    H, slope, sheet = np.array([[0.02, -0.3], [0.15, 0.05]]), np.array([0.2, -0.3]), isotropic(0.02, METAL)
    mesh = rectangle(1.0, 0.8, 2, 2, cell)
    s = shell(mesh, sheet)
    p = mesh.points[:, :2]
    u = np.column_stack([p @ H.T, p @ slope])
    turn = np.tile([slope[1], -slope[0], 0.0], (len(p), 1))
    x = s.translation.T @ u.ravel() + s.rotation.T @ turn.ravel()
    half = ((H[1, 0] - H[0, 1]) / 2) ** 2 / 2
    e = np.array([H[0, 0] + slope[0] ** 2 / 2 + half, H[1, 1] + slope[1] ** 2 / 2 + half])
    eps = np.append(e, H[0, 1] + H[1, 0] + slope[0] * slope[1])
    assert s.internal_force.energy(x) == pytest.approx(0.8 * eps @ sheet.A @ eps / 2, rel=1e-9)


def test_places_of_strain_lie_on_the_elements_with_half_the_local_thickness():
    for cell in CELLS:
        mesh = rectangle(1.0, 0.8, 2, 1, cell)
        place = shell(mesh, 0.03, thickness="0.02 + 0.01 * x + 0.005 * y").places[0]
        assert place.kind == "plate"
        x, y, _ = np.moveaxis(place.x, -1, 0)
        assert place.lever == pytest.approx((0.02 + 0.01 * x + 0.005 * y) / 2)
        second = cell in ("quad9", "triangle6")
        assert (place.sampled is not None) == second
        if second:
            assert place.sampled.shape[1] < place.x.shape[1]
            x, y, _ = np.moveaxis(place.sampled, -1, 0)
            assert place.sampled_lever == pytest.approx((0.02 + 0.01 * x + 0.005 * y) / 2)
        plain = shell(mesh, 0.03).places[0]
        assert plain.lever == pytest.approx(0.015)


def either_way(cell) -> Mesh:
    """A folded sheet, every second element numbered the other way round."""
    flat = rectangle(2.0, 1.0, 4, 2, cell)
    cells = flat.cells[cell].copy()
    back = {"quad": [0, 3, 2, 1], "quad9": [0, 3, 2, 1, 7, 6, 5, 4, 8], "triangle6": [0, 2, 1, 5, 4, 3]}[cell]
    cells[::2] = cells[::2][:, back]
    x, y, _ = flat.points.T
    points = np.stack([np.minimum(x, 1.0), y, np.maximum(x - 1.0, 0)], axis=1)
    return Mesh(points, {cell: cells}, {"surface": {cell: np.arange(len(cells))}})


@pytest.mark.parametrize("cell", ["quad", "quad9", "triangle6"])
def test_the_picture_of_a_shell_is_closed_and_as_thick_as_the_shell(cell):
    """Outward faces and rims of two plates at a right angle; points off the nodes move with the rotation there."""
    s, h = shell(either_way(cell), 0.06), 0.06
    skin = s.skin
    quads = skin.cells["quad"]
    faces = [quads[:, [0, 1, 2]], quads[:, [0, 2, 3]], *([skin.cells["triangle"]] if "triangle" in skin.cells else [])]
    faces = np.concatenate(faces)
    a, b, c = skin.points[faces].swapaxes(0, 1)
    assert np.cross(b - a, c - a).sum(axis=0) == pytest.approx(np.zeros(3), abs=1e-12)
    assert np.einsum("fi,fi->", a, np.cross(b, c)) / 6 == pytest.approx(2.0 * h, rel=1e-9)
    sides = np.sort(np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), axis=1)
    assert (np.unique(sides, axis=0, return_counts=True)[1] == 2).all()
    move, turn = np.array([0.3, -0.2, 0.5]), np.array([0.7, 0.4, -0.6])
    n = len(s.mesh.points)
    x = s.translation.T @ (move + np.cross(turn, s.mesh.points)).ravel()
    x = x + s.rotation.T @ np.tile(turn, n)
    assert (skin.operator @ x).reshape(-1, 3) == pytest.approx(move + np.cross(turn, skin.points), abs=1e-12)


def said(function, *args) -> str:
    with pytest.warns(PhysicsWarning) as given:
        function(*args)
    assert len(given) == 1
    return str(given[0].message)


def silent(function, *args):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        function(*args)


def arcs(lengths, R, k=4):
    """Strips of a cylinder of radius R along y, straight chords of these lengths by 0.1 m, at different places."""
    half = np.arcsin(np.asarray(lengths) / 2 / R)
    shift = np.arange(len(half)) * 10.0
    x, V = np.zeros((2, len(half), k, 3))
    for node, (side, y) in enumerate(((-1, 0.0), (1, 0.0), (1, 0.1), (-1, 0.1))[:k]):
        x[:, node] = np.stack([R * np.sin(side * half), y + shift, R * np.cos(half)], axis=1)
        V[:, node] = np.stack([np.sin(side * half), 0 * half, np.cos(half)], axis=1)
    return x, V


def test_long_elements_on_a_curved_shell_are_counted_measured_and_placed():
    """sqrt(R h) = 0.2 m: two of four elements are longer than 1.5 of it; 0.5 m is 2.5, 1.5 times too stiff."""
    R, h = 4.0, 0.01
    x, V = arcs([0.1, 0.5, 0.28, 0.35], R)
    text = said(warn_if_coarse, x, V, np.full(4, h), "shell on group 'g'")
    z = R * np.cos(np.arcsin(0.25 / R))
    assert text.startswith(
        "shell on group 'g': 2 of 4 four-node elements are longer than 1.5 sqrt(R h), and a curved shell bends over a "
        f"length sqrt(R h) at concentrated loads and edges; the worst, element 1 at (0, 10.05, {z:.6g}) m, is 0.5 m "
        "long against 0.2 m."
    )
    stiffer = float(re.search(r"up to ([\d.]+) times as stiff", text)[1])
    assert stiffer == pytest.approx(1 + 0.08 * 2.5**2, rel=5e-3)
    silent(warn_if_coarse, *arcs([0.1, 0.29], R), np.full(2, h), "g")
    assert "1 of 2 four-node" in said(warn_if_coarse, *arcs([0.29, 0.29], R), np.array([h, h / 2]), "g")


@pytest.mark.parametrize("k", [6, 9])
def test_second_order_elements_are_long_from_sixteen_lengths(k):
    """R = 40 m, h = 0.1 mm, sqrt(R h) = 63 mm: 1.2 m is 19 of it, 0.9 m is 14."""
    x, V = arcs([0.9, 1.2, 0.3], 40.0)
    if k == 6:
        x, V = x[:, [0, 1, 2]], V[:, [0, 1, 2]]
    far, up = np.full((3, k - x.shape[1], 3), 50.0), np.tile([0, 1.0, 0], (3, k - x.shape[1], 1))
    nodes, directors = np.concatenate([x, far], axis=1), np.concatenate([V, up], axis=1)
    text = said(warn_if_coarse, nodes, directors, np.full(3, 1e-4), "shell on group 'g'")
    assert text.startswith("shell on group 'g': 1 of 3 second-order elements are longer than 16 sqrt(R h); the worst, ")
    diagonal = 1.2 if k == 9 else np.hypot(1.2, 0.1)
    assert f"is {diagonal:.3g} m long against 0.0632 m" in text and "element 1 at" in text
    silent(warn_if_coarse, nodes[[0, 2]], directors[[0, 2]], np.full(2, 1e-4), "g")


def trapezoid(length, bottom_to_top, lean, at=0.0, along=0):
    """Parallel sides `length` -+ lean * height apart from each other, ends that lean by that tangent."""
    h, d = bottom_to_top, lean * bottom_to_top
    x = np.array([[0, 0, 0], [length + d, 0, 0], [length, h, 0], [d, h, 0]]) + np.array([at, 0, 0])
    return np.roll(x, along, axis=0)


@pytest.mark.parametrize("along", [0, 1, 2, 3])
def test_trapezoids_are_judged_by_aspect_and_lean_whichever_side_comes_first(along):
    """Mean length a times the height, ends that lean by tan(delta): 1 + (a tan delta)^2."""
    x = np.array([trapezoid(3.0, 1.0, 0.0), trapezoid(3.0, 1.0, 0.5, 5.0, along), trapezoid(3.0, 1.0, 0.4, 9.0, along)])
    text = said(warn_of_trapezoids, x, "shell on group 'g'")
    middle = x[1].mean(axis=0)
    assert text.startswith(
        "shell on group 'g': 2 of 3 four-node elements are trapezoids that lock in their plane; one layer of the "
        f"worst, element 1 at ({middle[0]:.6g}, 0.5, 0) m, is up to {1 + (3.0 * 0.5) ** 2:.3g} times as stiff"
    )
    silent(warn_of_trapezoids, np.concatenate([x[:2], np.repeat(x[:1], 4, axis=0)]), "g")  # one of six
    silent(warn_of_trapezoids, trapezoid(3.0, 1.0, 0.3)[None], "g")
    silent(warn_of_trapezoids, trapezoid(0.8, 1.0, 0.7)[None], "g")  # its parallel sides are the short ones


def test_warped_and_flat_elements_are_counted_and_placed():
    flat = rectangle(3.0, 1.0, 3, 1, "quad")

    def lifted(*heights):
        points = flat.points.copy()
        for (x, y), z in heights:
            points[flat.nearest_point([x, y, 0]), 2] = z
        return Mesh(points, flat.cells, flat.cell_groups)

    with pytest.warns(PhysicsWarning) as given:
        shell(lifted(((0.0, 0.0), 0.3), ((3.0, 1.0), 0.2), ((2.0, 0.0), 0.05)), 0.01)
    angle = np.degrees(np.arccos(1 / 1.09))  # of the normals (0.3, 0, 1) and (0, 0.3, 1) at the corners beside
    assert np.degrees(np.arccos(1 / 1.04)) > 15  # of the other warped one
    (text,) = (str(one.message) for one in given if "warped" in str(one.message))
    worst = int(np.flatnonzero((flat.cells["quad"] == flat.nearest_point([0, 0, 0])).any(axis=1))[0])
    assert text == (
        f"shell on group 'surface': 2 of 3 quadrilaterals are warped by more than 15 deg between corner normals; "
        f"the worst, by {angle:.3g} deg, is element {worst} at (0.5, 0.5, 0.075) m. Their stiffness is "
        "some per cents off; mesh finer there, or use eight-node elements"
    )
    points = flat.points.copy()
    points[flat.nearest_point([3.0, 1.0, 0])] = points[flat.nearest_point([3.0, 0, 0])]
    with pytest.raises(ValueError) as refusal:
        shell(Mesh(points, flat.cells, flat.cell_groups), 0.01)
    last = int(np.flatnonzero((flat.cells["quad"] == flat.nearest_point([3.0, 0, 0])).any(axis=1))[0])
    assert str(refusal.value) == (
        "shell on group 'surface': 1 of 3 quad elements have a corner without area, the first is "
        f"element {last} at (2.5, 0.25, 0) m; repair the mesh"
    )


@pytest.mark.parametrize("cell", CELLS)
def test_stiffness_of_an_isotropic_shell_does_not_depend_on_where_its_axis_points(cell):
    """Given by formulas at the nodes of a curved mesh, off its surface, and as one direction."""
    flat = rectangle(1.0, 0.8, 2, 2, cell)
    x, y, _ = flat.points.T
    bowl = Mesh(np.stack([x, y, 0.4 * x * x + 0.3 * x * y], axis=1), flat.cells, flat.cell_groups)
    plain = shell(bowl, 0.03)
    for axis in (("1 + x", "y - 0.3", "0.5"), ("0.2", "1", "x")):
        found = shell(bowl, 0.03, axis=axis)
        np.testing.assert_allclose(found.K.toarray(), plain.K.toarray(), atol=1e-10 * abs(plain.K).max())


@pytest.mark.filterwarnings("default:.*three-node triangles:femflex.warning.PhysicsWarning")
def test_the_share_of_triangles_is_that_of_their_area():
    """One quadrilateral of 2 m^2 and triangles of 0.5 and 0.1 m^2."""
    points = [[0, 0, 0], [2, 0, 0], [2, 1, 0], [0, 1, 0], [3, 0, 0], [2.2, 1, 0]]
    quad, three = np.array([[0, 1, 2, 3]]), np.array([[1, 4, 2], [2, 4, 5]])

    def made(rows):
        mesh = Mesh(points, {"quad": quad, "triangle": three}, {"surface": {"quad": [0], "triangle": rows}})
        return shell(mesh, 0.01)

    with pytest.warns(PhysicsWarning, match=r"23% of its area is three-node triangles \(limit 20%\)"):
        made([0, 1])
    silent(made, [0])


def test_values_that_fields_cannot_have_are_named_with_their_element():
    mesh = rectangle(1.0, 1.0, 2, 1, "quad")
    left, right = (int(np.argmin(mesh.points[mesh.cells["quad"]].mean(axis=1)[:, 0] * s)) for s in (1, -1))
    for options, text in (
        ({"thickness": "0.02 - 0.03 * x"}, "thickness is -0.00"),
        ({"thickness": {"quad": np.where(np.arange(2) == right, -0.5, 0.1)}},
         f"thickness is -0.5 m in element {right} at (0.75, 0.5, 0) m; it must be positive everywhere"),
        ({"density": {"quad": np.where(np.arange(2) == left, 0.0, 5.0)}},
         f"density is 0 kg/m^3 in element {left} at (0.25, 0.5, 0) m; it must be positive everywhere"),
        ({"extra_mass": {"quad": np.where(np.arange(2) == right, -2.5, 5.0)}},
         f"extra_mass is -2.5 kg/m^2 in element {right} at (0.75, 0.5, 0) m; it is not negative"),
        ({"extra_mass": {"quad": [-2.0, -2.5]}}, "extra_mass is -2.5 kg/m^2 in element 0 at ("),
        ({"thickness": {"quad": [-2.0, -2.5]}}, "thickness is -2.5 m in element 0 at ("),
        ({"density": {"quad": [np.nan, np.nan]}}, "density is not finite in element 0 at ("),
        ({"thickness": np.ones(7)}, "thickness is [1. 1. 1. 1. 1. 1. 1.]; give a number, a formula"),
        ({"thickness": np.ones(5)}, "thickness is [1. 1. 1. 1. 1.]; give a number, a formula"),
        ({"thickness": {"quad": np.where(np.arange(2) == right, np.nan, 0.1)}},
         f"thickness is not finite in element {right} at (0.75, 0.5, 0) m; correct it there"),
        ({"thickness": {"quad": [0.1, 0.1, 0.1]}}, "thickness of quad elements is given as (3,); give one value"),
        ({"thickness": {"triangle": [0.1]}}, "thickness of quad elements is given as ['triangle']; give"),
        ({"thickness": np.ones(3)}, "thickness is [1. 1. 1.]; give a number, a formula of x, y and z, one value for"),
        ({"thickness": "0.02 / x + R"}, "thickness: formula '0.02 / x + R' holds 'R'"),
        ({"angle": "log(x)"}, "angle: formula 'log(x)': 'log(x)' is -inf at x = 0 m"),
        ({"axis": ("x", "1")}, "has axis ('x', '1'); give three numbers or three formulas"),
        ({"axis": "x"}, "has axis 'x'; give three numbers or three formulas"),
        ({"axis": (0.0, 0.0, 1.0), "angle": 0.1}, "axis is normal to the surface, or zero, in element 0 at ("),
        ({"thermal_strain": (1.0, 2.0)}, "has thermal_strain (1.0, 2.0); give three finite numbers, xx, yy and xy"),
        ({"fold_angle": 0.0}, "has fold_angle 0.0; give an angle between 0 and pi/2 (90 deg)"),
    ):  # fmt: skip
        with pytest.raises(ValueError) as refusal:
            shell(mesh, 0.01, **options)
        assert text in str(refusal.value) and str(refusal.value).startswith("shell on group 'surface'"), text
    light = isotropic(0.01, METAL.__class__(70e9, 0.3, 0.0))
    with pytest.raises(ValueError, match="has a density and a section without mass; give its material a density"):
        shell(mesh, light, density=100.0)


def test_values_at_the_points_of_a_mesh_hold_where_the_shell_adds_nodes_of_its_own():
    """Of eight-node quadrilaterals, which get a ninth: linear between the corners, by points or by corners."""
    mesh = rectangle(1.0, 0.8, 2, 1, "quad8")
    x, y, _ = mesh.points.T
    corners = mesh.points[mesh.cells["quad8"][:, :4]]
    by_point = 0.02 + 0.01 * x + 0.005 * y
    by_corner = 0.02 + 0.01 * corners[..., 0] + 0.005 * corners[..., 1]
    exact = shell(mesh, 0.03, thickness="0.02 + 0.01 * x + 0.005 * y")
    for given in (by_point, {"quad8": by_corner}, {"quad9": by_corner}):
        found = shell(mesh, 0.03, thickness=given)
        assert len(found.mesh.points) == len(mesh.points) + 2
        np.testing.assert_allclose(found.K.toarray(), exact.K.toarray(), atol=1e-9 * abs(exact.K).max())
    with pytest.raises(ValueError, match="give a number, a formula of x, y and z, one value for each point of the"):
        shell(mesh, 0.03, thickness=np.ones(len(mesh.points) + 3))


@pytest.mark.parametrize("cell", CELLS)
def test_tension_and_heat_of_a_coupled_shell_pull_as_forces_and_moments_of_its_plies(cell):
    """Virtual work of f0 on a uniform stretch and on a uniform bend: N.e and M.k, in skew axes."""
    C = random_rotation(9)
    flat = rectangle(1.0, 0.8, 2, 2, cell)
    force, heat = np.array([300.0, -120.0, 80.0]), np.array([2e-4, 1e-4, -3e-4])
    s = shell(flat.rotated(C), axis=C[:, 0], prestress=force, thermal_strain=heat)
    up = float(np.sign(s.inertia[0].V[0, 0] @ C[:, 2]))
    x, y, _ = flat.points.T
    N, M = force * [1, 1, up] - STACK.A @ heat, -STACK.B @ heat
    mirror = np.array([1, 1, up])  # the section's angles count about the director
    if up < 0:
        N = force - STACK.A @ heat
    for e in np.eye(3):
        u = np.stack([e[0] * x + e[2] / 2 * y, e[1] * y + e[2] / 2 * x, 0 * x])
        v = s.translation.T @ (C @ u).T.ravel()
        assert s.f0 @ v == pytest.approx(0.8 * N @ (mirror * e), rel=1e-8)
    for k in np.eye(3):
        u = -np.stack([0 * x, 0 * x, k[0] * x * x + k[1] * y * y + k[2] * x * y]) / 2
        turn = np.stack([-(k[1] * y + k[2] * x / 2), k[0] * x + k[2] * y / 2, 0 * x])
        v = s.translation.T @ (C @ u).T.ravel() + s.rotation.T @ (C @ turn).T.ravel()
        assert s.f0 @ v == pytest.approx(0.8 * up * M @ (mirror * k), rel=1e-8)


@pytest.mark.parametrize(("cell", "count"), [("quad", 2), ("quad9", 3), ("triangle6", 1)])
def test_base_vectors_are_found_once_at_every_set_of_points(cell, count, monkeypatch):
    """Those of the rows, those in the middle of four-sided elements, and those over which nine-node ones take means."""
    seen, plain = [], fields._base
    monkeypatch.setattr(fields, "_base", lambda geometry, points: seen.append(len(points)) or plain(geometry, points))
    mesh = rectangle(1.0, 0.8, 1, 1, cell)
    x = mesh.points[mesh.cells[cell]]
    geometry = fields.ShellGeometry(cell, x, np.broadcast_to([0, 0, 1.0], x.shape), np.array([1.0, 0, 0]), np.eye(3))
    fields.gradient_rows(geometry, quadrature(cell.rstrip("69"), 2)[0])
    assert len(seen) == count
