"""Membranes and tethers: drums and strings, tension and heat, edge cables, and states about a deflection."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.polynomial import legendre
from scipy.linalg import eigh, null_space
from scipy.special import jn_zeros
from support.plate_models import random_rotation

from femflex.fem import Material, Member, build_structure
from femflex.fem.deflected import deflected
from femflex.fem.sections import CableSection
from femflex.fem.sections.laminates import orthotropic
from femflex.mesh import Mesh, line, rectangle
from femflex.reduction import cantilever_modes, reduce_structure, strain_tensors
from femflex.reduction.preload.equilibrium import static_equilibrium
from femflex.reduction.preload.loads import Preload
from femflex.warning import PhysicsWarning

FILM = Material(3e9, 0.3, 1400.0)


SIDES = ("left", "right", "bottom", "top")


WAVE = np.sqrt(20.0 / (1400.0 * 1e-4))  # m/s under 20 N/m


def sheet(n=(12, 6), cell="triangle", prestress=20.0, turned=None, **options):
    """A membrane of 2 m by 1 m and 0.1 mm, in the x-y plane or turned."""
    mesh = rectangle(2.0, 1.0, *n, cell)
    if turned is not None:
        mesh = Mesh(mesh.points @ turned.T, mesh.cells, mesh.cell_groups, mesh.point_groups)
    return build_structure(mesh, [Member("surface", "membrane", 1e-4, FILM, {"prestress": prestress, **options})])


def disc(rings):
    """A round mesh of radius 1 m in six sectors, its rim the group "rim"; second-order nodes lie on the circle."""
    points, number = [np.zeros(2)], {}
    for r in range(1, 2 * rings + 1):
        for k in range(6 * r):
            sector, at = divmod(k, r)
            angle = np.pi / 3 * (sector + at / r)
            number[r, k] = len(points)
            points.append(r / (2 * rings) * np.array([np.cos(angle), np.sin(angle)]))

    def node(r, k):
        return number[r, k % (6 * r)] if r else 0

    triangles = []
    for r in range(0, 2 * rings, 2):  # of every second ring; nodes between are their middles
        for sector in range(6):
            for k in range(0, r + 2, 2):
                outer = [node(r + 2, sector * (r + 2) + k), node(r + 2, sector * (r + 2) + k + 2)]
                inner = node(r, sector * r + k) if k <= r else None
                triangles.append((r, sector, k, outer, inner))
    six = []
    for r, sector, k, (a, b), c in triangles:
        middle = [node(r + 2, sector * (r + 2) + k + 1), node(r + 1, sector * (r + 1) + k + 1)]
        six.append([a, b, c, middle[0], middle[1], node(r + 1, sector * (r + 1) + k)])
        if k + 2 <= r:
            d, other = node(r, sector * r + k + 2), node(r, sector * r + k + 1)
            six.append([c, b, d, middle[1], node(r + 1, sector * (r + 1) + k + 2), other])
    six = np.array(six)
    xyz = np.column_stack([points, np.zeros(len(points))])
    rim = np.array([node(2 * rings, k) for k in range(12 * rings)])
    return Mesh(xyz, {"triangle6": six}, {"surface": {"triangle6": np.arange(len(six))}}, {"rim": rim})


@pytest.mark.slow
@pytest.mark.parametrize("cell", ["triangle", "triangle6"])
def test_rectangular_membrane_frequencies_match_fourier(cell):
    exact = np.pi * WAVE * np.sqrt([1 / 4 + 1, 1 + 1, 9 / 4 + 1])
    assert cantilever_modes(sheet((40, 20), cell), SIDES, 3).omega == pytest.approx(exact, rel=1e-5)


@pytest.mark.slow
def test_drum_frequencies_match_bessel():
    drum = build_structure(disc(19), [Member("surface", "membrane", 1e-4, FILM, {"prestress": 20.0})])
    computed = cantilever_modes(drum, ["rim"], 6).omega
    first, second, third = (jn_zeros(k, 2) for k in range(3))
    exact = WAVE * np.array([first[0], second[0], second[0], third[0], third[0], first[1]])
    assert computed == pytest.approx(exact, rel=1e-5)


def test_direction_dependent_tension():
    computed = cantilever_modes(sheet((36, 18), prestress=(20.0, 6.0, 0.0)), SIDES, 2).omega
    squares = np.pi**2 / 0.14 * np.array([20 / 4 + 6, 20 + 6])
    assert computed**2 == pytest.approx(squares, rel=2e-5)


def arched_square(n, radius):
    """A square of half side 1 m with corners held, whose sides are arcs of that radius, drawn in."""
    flat = rectangle(2.0, 2.0, n, n, "triangle6")
    x, y = flat.points[:, 0] - 1.0, flat.points[:, 1] - 1.0

    def sag(s):
        return np.sqrt(radius**2 - s**2) - np.sqrt(radius**2 - 1.0)

    points = np.column_stack([x * (1 - sag(y)), y * (1 - sag(x)), np.zeros(len(x))])
    return Mesh(points, flat.cells, flat.cell_groups, flat.point_groups)


CORNERS = {f"{b}_{a}": ("x", "y", "z") for a in ("left", "right") for b in ("bottom", "top")}


def with_cables(mesh, tension, N=20.0, cable=1.0, EA=2e5):
    """A sheet under N and cables along its sides, of this part of the tension."""
    members = [Member("surface", "membrane", 1e-4, FILM, {"prestress": N})]
    cord = CableSection(EA, 1e-3)
    members += [Member(side, "tether", cord, None, {"prestress": cable * tension}) for side in SIDES]
    return build_structure(mesh, members)


def test_edge_cables_of_sheet_under_uniform_tension():
    """Equilibrium of the cable across itself: T / R = N."""
    R, N = 5.05, 20.0
    mesh = arched_square(6, R)
    computed = static_equilibrium(with_cables(mesh, N * R), CORNERS)
    sheet, *cables = computed.strain
    assert np.abs(computed.mesh.points - mesh.points).max() < 1e-6
    assert sheet.smoothed_stress() == pytest.approx(np.broadcast_to([N, N, 0], sheet.stress.shape), abs=0.02 * N)
    for block in cables:
        assert block.smoothed_stress() == pytest.approx(np.full(block.stress.shape, N * R), rel=1e-3)
    assert (cantilever_modes(computed, CORNERS, 3).omega > 0).all()


def test_corner_forces_tension_sheet_and_cables():
    """Made under half the tension, pulled by what the whole one needs: all of it is twice as large on arcs of the same
    radius, where cables stretch as the sheet does, T / EA = N (1 - nu) / E h."""
    R, N = 5.05, 20.0
    corners = {name: ("z",) for name in CORNERS} | {"bottom_left": ("x", "y", "z"), "bottom_right": ("y", "z")}
    half = with_cables(arched_square(6, R), N * R / 2, N / 2, EA=R * 3e9 * 1e-4 / 0.7)
    pull = -(half.translation @ half.f0).reshape(-1, 3)
    forces = {name: -2 * pull[half.mesh.group_points(name)[0]] for name in CORNERS}
    computed = static_equilibrium(half, corners, Preload(forces=forces))
    sheet, *cables = computed.strain
    assert sheet.smoothed_stress() == pytest.approx(np.broadcast_to([N, N, 0], sheet.stress.shape), abs=0.03 * N)
    for block in cables:
        assert block.smoothed_stress().mean() == pytest.approx(N * R, rel=5e-3)


def ritz(R, N, T, film, cord, degree=10, count=5):
    """Frequencies of the arched square by polynomials in x and y that are zero at its corners."""
    g, w = legendre.leggauss(40)
    rows = [legendre.legder(np.eye(degree + 1)[k]) for k in range(degree + 1)]
    D = np.array([np.pad(row, (0, degree + 1 - len(row))) for row in rows])

    def products(x, y):
        a, b = legendre.legvander(x, degree), legendre.legvander(y, degree)
        pairs = (a, b), (a @ D.T, b), (a, b @ D.T)
        return [(p[:, :, None] * q[:, None, :]).reshape(len(x), -1) for p, q in pairs]

    def sag(s):
        return np.sqrt(R**2 - s**2) - np.sqrt(R**2 - 1.0), -s / np.sqrt(R**2 - s**2)

    x, y = (a.ravel() for a in np.meshgrid(g, g))
    (sx, dx), (sy, dy) = sag(x), sag(y)
    area = np.outer(w, w).ravel() * ((1 - sy) * (1 - sx) - (x * dy) * (y * dx))
    V, Vx, Vy = products(x * (1 - sy), y * (1 - sx))
    K, M = N * ((Vx.T * area) @ Vx + (Vy.T * area) @ Vy), film * (V.T * area) @ V
    depth, slope = sag(g)
    ds = np.hypot(1.0, slope)
    for sign in (1.0, -1.0):
        V, Vx, Vy = products(sign * (1 - depth), g)
        both = [(V, (-sign * slope * Vx.T + Vy.T).T)]
        V, Vx, Vy = products(g, sign * (1 - depth))
        both.append((V, (Vx.T - sign * slope * Vy.T).T))
        for V, along in both:
            K, M = K + T * (along.T * (w / ds)) @ along, M + cord * (V.T * (w * ds)) @ V
    Z = null_space(products(np.array([1, 1, -1, -1.0]), np.array([1, -1, 1, -1.0]))[0])
    return np.sqrt(eigh(Z.T @ K @ Z, Z.T @ M @ Z, eigvals_only=True)[:count])


def test_membrane_with_edge_cables_matches_ritz():
    R, N = 5.05, 20.0
    computed = cantilever_modes(static_equilibrium(with_cables(arched_square(12, R), N * R), CORNERS), CORNERS, 5)
    assert computed.omega == pytest.approx(ritz(R, N, N * R, 1400 * 1e-4, 1e-3), rel=5e-4)


C = random_rotation(17)


CLOTH = orthotropic(2e-4, 3e9, 1e9, 4e8, 0.35, 1400.0)


def sheet_tension_tables(cell, section=CLOTH, mesh=None, **options):
    mesh = rectangle(2.0, 1.0, 3, 2, cell) if mesh is None else mesh
    return build_structure(mesh.rotated(C), [Member("surface", "membrane", section, None, options)])


def displacements(s, H) -> np.ndarray:
    """Dofs of displacements H (3, 3) times the place; what fades at the nodes is at rest."""
    return s.translation.T @ (s.mesh.points @ H.T).ravel()


@pytest.mark.parametrize("cell", ["triangle", "triangle6"])
@pytest.mark.parametrize("heat", [(3e-4, -1e-4, 2e-4), 2e-4, None])
def test_energy_of_sheet_under_homogeneous_gradient(cell, heat):
    """Fibres along a skew axis; E of the tangent plane from F^T F, stress of the axes of the fibres."""
    angle, force = 0.6, np.array([4e3, 1e3, 8e2])
    axis = C @ [np.cos(angle), np.sin(angle), 0.0]
    s = sheet_tension_tables(cell, axis=axis, prestress=force, thermal_strain=heat)
    H = 0.3 * np.random.default_rng(4).normal(size=(3, 3))
    rows = np.stack([axis, np.cross(C[:, 2], axis)])
    F = (np.eye(3) + H) @ rows.T  # images of the fibres' axes
    E = (F.T @ F - np.eye(2)) / 2
    eps = np.array([E[0, 0], E[1, 1], 2 * E[0, 1]])
    off, scale = 0.35 * 1e9, 1 - 0.35**2 / 3
    A = 2e-4 * np.array([[3e9 / scale, off / scale, 0], [off / scale, 1e9 / scale, 0], [0, 0, 4e8]])
    free = np.zeros(3) if heat is None else np.array(heat if np.ndim(heat) else [heat, heat, 0.0])
    N = force - A @ free
    energy = 2.0 * (N @ eps + eps @ A @ eps / 2)
    x = displacements(s, H)
    assert s.internal_force.energy(x) == pytest.approx(energy, rel=1e-9)
    assert s.f0 @ x == pytest.approx(2.0 * N @ [(rows @ H @ rows.T)[0, 0], (rows @ H @ rows.T)[1, 1],
                                                (rows @ H @ rows.T)[0, 1] + (rows @ H @ rows.T)[1, 0]])  # fmt: skip
    (block,) = s.strain
    assert block.lowest_tension() == pytest.approx(
        np.full(block.weight.shape, np.linalg.eigvalsh([[N[0], N[2]], [N[2], N[1]]])[0])
    )


def arched() -> Mesh:
    """Sides that are parabolas over chords of length 2 and 1."""
    flat = rectangle(2.0, 1.0, 2, 2, "triangle6")
    x, y, z = flat.points.T
    points = np.stack([x, y + 0.2 * x * (2 - x) * (2 * y - 1), z], axis=1)
    return Mesh(points, flat.cells, flat.cell_groups, flat.point_groups)


def test_sheet_with_curved_sides():
    """Area 2 + 2 * 0.2 * int x (2 - x) dx of quadratic sides, exact; energy of a homogeneous stretch; mass matrix."""
    s = sheet_tension_tables("triangle6", mesh=arched(), prestress=(30.0, 20.0, 5.0), axis=C[:, 0])
    (inertia,), (block,) = s.inertia, s.strain
    area = 2.0 + 0.4 * 4 / 3
    assert block.weight.sum() == pytest.approx(area, rel=1e-9)
    assert inertia.dm.sum() == pytest.approx(area * 2e-4 * 1400, rel=1e-9)
    H = C @ np.array([[0.1, 0.2, 0], [-0.3, 0.15, 0], [0.4, -0.1, 0]]) @ C.T
    F = (np.eye(3) + H) @ C[:, :2]
    E = (F.T @ F - np.eye(2)) / 2
    eps = np.array([E[0, 0], E[1, 1], 2 * E[0, 1]])
    density = np.array([30.0, 20.0, 5.0]) @ eps + eps @ CLOTH.A @ eps / 2
    assert s.internal_force.energy(displacements(s, H)) == pytest.approx(area * density, rel=1e-9)
    x = displacements(s, np.outer(C[:, 2], C[:, 0]))  # w = x
    X = (inertia.rho @ C)[..., 0]
    assert x @ s.M @ x == pytest.approx(np.sum(inertia.dm * X**2), rel=1e-9)
    assert x @ s.M @ x == pytest.approx(0.28 * (8 / 3 + 0.4 * (8 - 6.4)), rel=1e-9)  # int x^2 (1 + 0.4 x (2 - x)) dx
    bent = s.translation.T @ np.outer((s.mesh.points @ C)[:, 0] ** 2, C[:, 2]).ravel()
    assert bent @ s.M @ bent == pytest.approx(0.28 * (32 / 5 + 0.4 * (64 / 3 - 128 / 7)), rel=1e-9)


def rope(cell="line", section=None, material=None, **options):
    mesh = line([[0, 0, 0], [1.0, 0.4, 0.2], [1.2, 1.1, -0.3]], 5, cell)
    section = CableSection("1e5 * (1 + (s / L)**7)", "0.3 + 0.1 * s**6") if section is None else section
    return build_structure(mesh, [Member("line", "tether", section, material, {"start": "start", **options})])


@pytest.mark.parametrize(("cell", "order"), [("line", None), ("line", 1), ("line", 6), ("line3", 2), ("line3", 5)])
def test_energy_of_rope_under_homogeneous_gradient(cell, order):
    """eps = (|F t|^2 - 1) / 2 of every straight part; N = prestress - EA alpha; EA and mass vary along it."""
    s = rope(cell, order=order, prestress=40.0, thermal_strain=-1e-4)
    H = 0.3 * np.random.default_rng(8).normal(size=(3, 3))
    corners = np.array([[0, 0, 0], [1.0, 0.4, 0.2], [1.2, 1.1, -0.3]])
    spans = np.diff(corners, axis=0)
    lengths = np.linalg.norm(spans, axis=1)
    L, at, energy, work = lengths.sum(), 0.0, 0.0, 0.0
    for span, length in zip(spans, lengths, strict=True):
        t = span / length
        eps = (np.sum(((np.eye(3) + H) @ t) ** 2) - 1) / 2
        stiff = 1e5 * (length + ((at + length) ** 8 - at**8) / 8 / L**7)  # int EA ds
        energy += (40.0 * length + 1e-4 * stiff) * eps + stiff * eps**2 / 2
        work += (40.0 * length + 1e-4 * stiff) * (t @ H @ t)
        at += length
    x = displacements(s, H)
    assert s.internal_force.energy(x) == pytest.approx(energy, rel=1e-9)
    assert s.f0 @ x == pytest.approx(work, rel=1e-9)
    assert sum(block.dm.sum() for block in s.inertia) == pytest.approx(0.3 * L + 0.1 * L**7 / 7, rel=1e-9)
    for place, block in zip(s.places, s.strain, strict=True):
        assert place.kind == "line" and place.fibres is None
        assert np.einsum("eq,eqi->i", block.weight, place.x) == pytest.approx(
            lengths @ (corners[1:] + corners[:-1]) / 2, rel=1e-9
        )


MADE = {
    "rope": lambda: rope(prestress=40.0),
    "sheet": lambda: sheet_tension_tables("triangle", prestress=300.0, thermal_strain=1e-4),
}


@pytest.mark.parametrize("kind", MADE)
def test_deflected_structure(kind):
    """Energies, forces, places and pictures of both, at displacements that mix all dofs; and twice deflected."""
    s = MADE[kind]()
    rng = np.random.default_rng(5)
    x, y, d = 0.1 * rng.normal(size=(3, s.n_dof))
    once = deflected(s, x)
    twice = deflected(once, y)
    V, W, U = (original.internal_force for original in (s, once, twice))
    assert W.energy(d) == pytest.approx(V.energy(x + d) - V.energy(x), rel=1e-9)
    assert U.energy(d) == pytest.approx(V.energy(x + y + d) - V.energy(x + y), rel=1e-9)
    np.testing.assert_allclose(once.f0, V.force(x), atol=1e-9 * np.abs(V.force(x)).max())
    np.testing.assert_allclose(once.K.toarray(), V.tangent(x).toarray(), atol=1e-9 * abs(V.tangent(x)).max())
    assert twice.mesh.points == pytest.approx(s.mesh.points + (s.translation @ (x + y)).reshape(-1, 3))
    drawn = s.skin.points + (s.skin.operator @ (x + y)).reshape(-1, 3)
    assert twice.skin.points == pytest.approx(drawn)
    for original, other in zip(s.inertia, twice.inertia, strict=True):
        moved = original.shapes((s.T @ (x + y))[:, None], slice(None))[..., 0]
        assert other.rho == pytest.approx(original.rho + moved)
    for place, block in zip(twice.places, twice.strain, strict=True):
        assert place.x is block.places
    (block,), (far,) = s.strain, twice.strain
    force = np.einsum("eq,eqi->i", block.weight, far.places - block.places)
    moved = np.einsum("qm,emc->eqc", block.shape_functions, (s.T @ (x + y))[block.dofs].reshape(len(block.dofs), -1, 3))
    assert force == pytest.approx(np.einsum("eq,eqi->i", block.weight, moved))


@pytest.mark.parametrize("about_a_deflection", [False, True])
@pytest.mark.parametrize("kind", MADE)
def test_energy_of_strain_tensors(kind, about_a_deflection):
    """Energy and force of large displacements, about rest and about a deflection, by the full elements."""
    s, rng = MADE[kind](), np.random.default_rng(0)
    V, x = s.internal_force, 0.1 * about_a_deflection * rng.normal(size=s.n_dof)
    phi, d = rng.normal(size=(s.n_dof, 4)), 0.3 * rng.normal(size=4)
    tensors = strain_tensors(deflected(s, x) if about_a_deflection else s, phi)
    assert tensors.energy(d) == pytest.approx(V.energy(x + phi @ d) - V.energy(x), rel=1e-10)
    force = phi.T @ V.force(x + phi @ d)
    assert tensors.force(d) == pytest.approx(force, rel=1e-9, abs=1e-9 * np.abs(force).max())


CORD = CableSection(1e6, 0.3)


METAL = Material(7e10, 0.3, 2700.0)


EDGES = ("start", "end")


def string(tension=50.0, n=8, section=CORD, cell="line", **options):
    """A string of 2 m along x."""
    mesh = line([[0, 0, 0], [2, 0, 0]], n, cell)
    return build_structure(mesh, [Member("line", "tether", section, METAL, {"prestress": tension, **options})])


@pytest.mark.parametrize("cell", ["line", "line3"])
def test_string_frequencies(cell):
    computed = cantilever_modes(string(cell=cell), EDGES, 6).omega
    assert computed == pytest.approx(np.repeat([1, 2, 3], 2) * np.pi / 2 * np.sqrt(50 / 0.3), rel=1e-7)


def test_varying_section_of_tether():
    mesh = line([[0, 0, 0], [2, 0, 0]], 10)
    member = Member("line", "tether", CableSection("1e6 * (1 + s/L)", "0.3 * (1 + s/L)"), None, {"prestress": 50.0})
    structure = build_structure(mesh, [member])
    assert structure.inertia[0].dm.sum() == pytest.approx(0.3 * 2 * 1.5)
    x, weight = np.polynomial.legendre.leggauss(60)
    x, weight = x + 1, weight
    functions = np.array([np.sin(k * np.pi * x / 2) for k in range(1, 21)])  # Ritz, of the ends' sines
    M = np.einsum("kq,lq,q->kl", functions, functions, weight * 0.3 * (1 + x / 2))
    K = np.diag([50 * (k * np.pi / 2) ** 2 for k in range(1, 21)])
    exact = np.sqrt(np.sort(np.linalg.eigvals(np.linalg.solve(M, K)).real))
    assert cantilever_modes(structure, EDGES, 4).omega[::2] == pytest.approx(exact[:2], rel=1e-7)


def test_centre_of_mass_of_deflected_tether():
    """A rope drawn aside by half its length: nodes moved along y, ends kept, the centre by the trapezoidal rule."""
    structure = string(tension=0.0, n=16)
    aside = np.zeros(structure.mesh.points.shape)
    aside[:, 1] = np.sin(np.pi * structure.mesh.points[:, 0] / 2)
    x = structure.translation.T @ aside.ravel()
    moved = deflected(structure, x)
    np.testing.assert_allclose(moved.mesh.points, structure.mesh.points + aside, atol=1e-14)
    with pytest.warns(PhysicsWarning, match="leaves .* N unbalanced"):  # its shape is given, not found
        body = reduce_structure(moved, cantilever_modes(moved, EDGES, 1), turning=())
    y = aside[np.argsort(structure.mesh.points[:, 0]), 1]
    assert body.moments.mass == pytest.approx(0.6, rel=1e-12)
    assert body.moments.first[0, 1] == pytest.approx(0.6 * (y[:-1] + y[1:]).sum() / 32, rel=1e-12)
