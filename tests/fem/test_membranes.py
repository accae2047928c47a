"""The membrane family: drums, strain energy to fourth order, edge cables, and what it refuses."""

import numpy as np
import pytest
from numpy.polynomial import legendre
from scipy.linalg import eigh, null_space
from scipy.special import jn_zeros

from femflex.fem import Material, Member, build_structure
from femflex.fem.deflected import deflected
from femflex.fem.sections import CableSection
from femflex.mesh import Mesh, rectangle
from femflex.reduction import cantilever_modes, strain_tensors
from femflex.reduction.preload.equilibrium import static_equilibrium
from femflex.reduction.preload.loads import Preload

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
def test_a_rectangular_membrane_has_the_frequencies_of_fourier(cell):
    exact = np.pi * WAVE * np.sqrt([1 / 4 + 1, 1 + 1, 9 / 4 + 1])
    coarse = cantilever_modes(sheet((12, 6), cell), SIDES, 3).omega
    found = cantilever_modes(sheet((40, 20), cell), SIDES, 3).omega
    assert found == pytest.approx(exact, rel=1e-5)
    assert np.log(coarse / exact - 1) - np.log(found / exact - 1) == pytest.approx(4 * np.log(40 / 12), abs=0.15)


@pytest.mark.slow
def test_a_drum_with_a_curved_rim_has_the_frequencies_of_bessel_functions():
    drum = build_structure(disc(19), [Member("surface", "membrane", 1e-4, FILM, {"prestress": 20.0})])
    found = cantilever_modes(drum, ["rim"], 6).omega
    first, second, third = (jn_zeros(k, 2) for k in range(3))
    exact = WAVE * np.array([first[0], second[0], second[0], third[0], third[0], first[1]])
    assert found == pytest.approx(exact, rel=1e-5)


def test_tension_may_differ_with_the_direction():
    found = cantilever_modes(sheet((36, 18), prestress=(20.0, 6.0, 0.0)), SIDES, 2).omega
    squares = np.pi**2 / 0.14 * np.array([20 / 4 + 6, 20 + 6])
    assert found**2 == pytest.approx(squares, rel=2e-5)


@pytest.mark.parametrize("about_a_deflection", [False, True])
def test_strain_tensors_hold_the_whole_energy(about_a_deflection):
    rng = np.random.default_rng(0)
    structure = sheet((2, 1), prestress=(2e5, 1e5, 3e4))
    elastic, x = structure.internal_force, np.zeros(structure.n_dof)
    if about_a_deflection:
        x = 0.1 * rng.standard_normal(structure.n_dof)
        structure = deflected(structure, x)
    phi, d = rng.standard_normal((structure.n_dof, 4)), 0.3 * rng.standard_normal(4)
    energy = elastic.energy(x + phi @ d) - elastic.energy(x)
    assert strain_tensors(structure, phi).energy(d) == pytest.approx(energy, rel=1e-11)


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


@pytest.mark.parametrize("cell", ["triangle", "triangle6"])
def test_edge_cables_add_no_degrees_of_freedom_and_fit_refined_meshes(cell):
    mesh = rectangle(2.0, 1.0, 4, 2, cell).refined()
    film = Member("surface", "membrane", 1e-4, FILM, {"prestress": 20.0})
    cables = [Member(side, "tether", CableSection(1e5, 1e-3), None, {"prestress": 5.0}) for side in SIDES]
    alone, with_them = (build_structure(mesh, members) for members in ([film], [film, *cables]))
    assert with_them.n_dof == alone.n_dof
    assert sum(block.dm.sum() for block in with_them.inertia) == pytest.approx(0.14 * 2 + 6 * 1e-3)
    fixed = [cantilever_modes(one, SIDES, 2).omega for one in (alone, with_them)]
    assert fixed[1] == pytest.approx(fixed[0], rel=1e-12)  # its edges do not move


def test_edge_cables_bear_a_sheet_under_uniform_tension_on_arcs():
    """Equilibrium of the cable across itself: T / R = N."""
    R, N = 5.05, 20.0
    mesh = arched_square(6, R)
    found = static_equilibrium(with_cables(mesh, N * R), CORNERS)
    sheet, *cables = found.strain
    assert np.abs(found.mesh.points - mesh.points).max() < 1e-6
    assert sheet.smoothed_stress() == pytest.approx(np.broadcast_to([N, N, 0], sheet.stress.shape), abs=0.02 * N)
    for block in cables:
        assert block.smoothed_stress() == pytest.approx(np.full(block.stress.shape, N * R), rel=1e-3)
    assert (cantilever_modes(found, CORNERS, 3).omega > 0).all()


def test_slacker_cables_and_a_tighter_sheet_share_what_they_have():
    """Drawn in, the cables regain some of the 2 % that they lack."""
    R, N = 5.05, 20.0
    loose = with_cables(arched_square(6, R), N * R, cable=0.98)
    found = static_equilibrium(loose, CORNERS)
    lost = [N * R - float(block.smoothed_stress().mean()) for block in found.strain[1:]]
    assert lost == pytest.approx([lost[0]] * 4, rel=1e-2)  # the diagonals of the mesh alternate
    assert 0.0 < lost[0] < 0.02 * N * R
    free = np.setdiff1d(np.arange(found.n_dof), found.held_dofs(CORNERS))
    assert np.abs(found.f0[free]).max() < 1e-9 * np.abs(found.f0).max()


def test_forces_at_the_corners_tighten_the_sheet_and_its_cables():
    """Made under half the tension, pulled by what the whole one needs: all of it is twice as large on arcs of the same
    radius, where cables stretch as the sheet does, T / EA = N (1 - nu) / E h."""
    R, N = 5.05, 20.0
    corners = {name: ("z",) for name in CORNERS} | {"bottom_left": ("x", "y", "z"), "bottom_right": ("y", "z")}
    half = with_cables(arched_square(6, R), N * R / 2, N / 2, EA=R * 3e9 * 1e-4 / 0.7)
    pull = -(half.translation @ half.f0).reshape(-1, 3)
    forces = {name: -2 * pull[half.mesh.group_points(name)[0]] for name in CORNERS}
    found = static_equilibrium(half, corners, Preload(forces=forces))
    sheet, *cables = found.strain
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


def test_a_membrane_with_edge_cables_vibrates_as_by_ritz():
    R, N = 5.05, 20.0
    found = cantilever_modes(static_equilibrium(with_cables(arched_square(12, R), N * R), CORNERS), CORNERS, 5)
    assert found.omega == pytest.approx(ritz(R, N, N * R, 1400 * 1e-4, 1e-3), rel=5e-4)
