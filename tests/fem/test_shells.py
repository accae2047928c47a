"""Shell elements of all cells: patch tests, rigid motion, published problems, frequencies, nonlinear strain."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.sparse.linalg import spsolve
from support.closed_forms import static_solution
from support.elastica import elastica
from support.plate_models import frequencies
from support.shell_problems import (
    curved_beam,
    edge_weights,
    hemisphere,
    pinched_cylinder,
    raasch_hook,
    ratio,
    scordelis_lo,
    solved,
    straight_beam,
    twisted_beam,
)

from femflex.fem import Material, Member, build_structure
from femflex.fem.sections.laminates import Lamina, Ply, isotropic, layup
from femflex.mesh import Mesh, line, rectangle
from femflex.warning import PhysicsWarning

METAL = Material(70e9, 0.3, 2700.0)
pytestmark = pytest.mark.filterwarnings("ignore:shell on group .* three-node triangles")


def shell(mesh: Mesh, h=0.05, material=METAL, **options):
    return build_structure(mesh, [Member("surface", "shell", h, material, options)])


# ratio of femflex to the published answer on the finest standard mesh; what a second-order element may be off is 2 %
PROBLEMS = {
    "straight, in plane": (lambda c: straight_beam(c, "in plane"), {}),
    "straight, out of plane": (lambda c: straight_beam(c, "out of plane"), {}),
    "curved, in plane": (lambda c: curved_beam(c, "in plane", 12), {}),
    "curved, out of plane": (lambda c: curved_beam(c, "out of plane", 24, 4), {"quad": 0.03}),
    "twisted": (lambda c: twisted_beam(c, "in plane"), {}),
    "twisted, the other way": (lambda c: twisted_beam(c, "out of plane"), {}),
    "twisted, thin": (lambda c: twisted_beam(c, "in plane", 0.05), {}),
    "twisted, thin, the other way": (lambda c: twisted_beam(c, "out of plane", 0.05), {}),
    "Scordelis-Lo": (lambda c: scordelis_lo(c, 16 if c == "quad" else 8), {}),
    "hemisphere": (lambda c: hemisphere(c, 16 if c != "quad9" else 8), {}),
    "pinched cylinder": (lambda c: pinched_cylinder(c, 16 if c != "quad9" else 8), {"quad": 0.07}),
    "Raasch's hook": (lambda c: raasch_hook(c, 20 if c != "quad" else 40), {}),
}


@pytest.mark.filterwarnings("ignore:.*four-node elements are longer than 1.5 sqrt")  # on the coarse standard mesh
@pytest.mark.sampled(10)
@pytest.mark.parametrize("cell", ["quad", "quad9", "triangle6"])
@pytest.mark.parametrize("name", PROBLEMS)
@pytest.mark.filterwarnings("ignore:shell on group .* warped by more than")
def test_macneal_and_harders_problems(name, cell):
    problem, apart = PROBLEMS[name]
    assert ratio(problem(cell)) == pytest.approx(1.0, abs=apart.get(cell, 0.02))


@pytest.mark.slow
@pytest.mark.parametrize(("problem", "n", "within"), [(pinched_cylinder, 30, 0.015), (hemisphere, 36, 0.007)])
def test_curved_shells_of_flat_triangles_of_the_plate_family(problem, n, within):
    """Octant of the pinched cylinder, and hemisphere with a hole: 0.0924 to 0.0940 about 0.0930."""
    assert ratio(problem("triangle", n), "plate") == pytest.approx(1.0, abs=within)


def test_curved_beam_out_of_plane_matches_castigliano():
    """Quarter ring under a unit force at its end: deflection, and the twist there that makes the inner edge go less.

    w = R^3 [(pi / 4) / E I + (3 pi / 4 - 2) / G J], twist R^2 [(pi / 4) / E I - (1 - pi / 4) / G J], with the torsion
    constant J of a rectangle twice as wide as high, 0.2287 b h^3. Elements twist so only with two of them over the
    width: shear forces of plates leave their free edges over h / sqrt(10). The clamp holds the end's warping, 0.4 %.
    """
    R, EI, GJ = 4.22, 1e7 * 0.2 * 0.1**3 / 12, 4e6 * 0.2287 * 0.2 * 0.1**3
    w = R**3 * ((np.pi / 4) / EI + (3 * np.pi / 4 - 2) / GJ)
    twist = R**2 * ((np.pi / 4) / EI - (1 - np.pi / 4) / GJ)
    assert w == pytest.approx(0.5022, rel=4e-3)  # printed
    problem = curved_beam("quad9", "out of plane", 24, 4)
    s, u = solved(problem)
    inner, middle, outer = (u[s.mesh.nearest_point([r, 0, 0]), 2] for r in (4.12, 4.22, 4.32))
    assert middle == pytest.approx(w, rel=0.006)
    assert (outer - inner) / 0.2 == pytest.approx(twist, rel=0.01)
    coarse = ratio(curved_beam("quad9", "out of plane", 24, 1)) * 0.5022
    assert coarse == pytest.approx(0.97 * w, rel=0.015)  # one element over the width


@pytest.mark.filterwarnings("ignore:.*trapezoids:femflex.warning.PhysicsWarning")  # the ends of the parallelograms
def test_locking_of_trapezoids_matches_published_value():
    """MacNeal and Harder print 0.047 to 0.071 for four-node elements without nodal rotations about the normal."""
    with pytest.warns(PhysicsWarning, match=r"6 of 6 four-node elements are trapezoids .* up to 26 times as stiff"):
        assert ratio(straight_beam("quad", "in plane", "trapezoid")) == pytest.approx(0.05, abs=0.02)
    assert ratio(straight_beam("quad", "in plane", "parallelogram")) > 0.6


@pytest.mark.parametrize(("cell", "n", "rel"), [("quad", 12, 0.02), ("quad9", 6, 0.002), ("triangle6", 6, 0.01)])
def test_cantilever_plate_frequencies_match_plate_family(cell, n, rel):
    """Square, L/h = 100, against 24 x 24 x 2 DKMT triangles (4e-4)."""
    s = shell(rectangle(1.0, 1.0, n, n, cell), 0.01)
    reference = build_structure(rectangle(1.0, 1.0, 24, 24), [Member("surface", "plate", 0.01, METAL)])
    computed = [frequencies(a, a.clamped_dofs("left"), 4) for a in (s, reference)]
    np.testing.assert_allclose(computed[0], computed[1], rtol=rel)


def folded(cell: str) -> Mesh:
    """Two plates at a right angle, sharing an edge."""
    flat = rectangle(2.0, 1.0, 4, 2, cell)
    x, y, _ = flat.points.T
    return Mesh(np.stack([np.minimum(x, 1), y, np.maximum(x - 1, 0)], axis=1), flat.cells, flat.cell_groups)


@pytest.mark.parametrize(("cell", "rel"), [("quad", 0.03), ("quad9", 0.01)])
def test_frequencies_of_folded_shell_match_plates(cell, rel):
    s = shell(folded(cell).refined(), 0.02)
    reference = build_structure(folded("triangle").refined(2), [Member("surface", "plate", 0.02, METAL)])
    computed = [frequencies(a, a.clamped_dofs("left"), 4) for a in (s, reference)]
    np.testing.assert_allclose(computed[0], computed[1], rtol=rel)


def test_branching_sheets():
    """Three equal plates at 120 deg about a shared edge: the first mode of each alone clamped there, or higher."""
    sheets = []
    for angle in np.radians([0, 120, 240]):
        flat = rectangle(1.0, 1.0, 4, 4, "quad")
        x, y, _ = flat.points.T
        sheets.append(Mesh(np.stack([x * np.cos(angle), y, x * np.sin(angle)], axis=1), flat.cells, flat.cell_groups))
    mesh = sheets[0].merged(sheets[1]).merged(sheets[2], tolerance=1e-9)
    s = shell(mesh, 0.01)
    single = shell(rectangle(1.0, 1.0, 4, 4, "quad"), 0.01)
    first = frequencies(single, single.clamped_dofs("left"), 1)[0]
    computed = frequencies(s, s.clamped_dofs("left"), 3)
    np.testing.assert_allclose(computed, first, rtol=1e-6)


def test_twist_of_shell_by_mast():
    """A mast in the middle of a plate: its twist is held by the plate's own plane, not free."""
    plate = rectangle(1.0, 1.0, 4, 4, "quad")
    mast = line(np.array([[0.5, 0.5, 0.0], [0.5, 0.5, 1.0]]), 2)
    mesh = plate.merged(mast, tolerance=1e-9)
    from femflex.fem.sections import Circle

    s = build_structure(
        mesh, [Member("surface", "shell", 0.02, METAL), Member("line", "beam", Circle(0.02), METAL, {"order": 3})]
    )
    value = frequencies(s, s.clamped_dofs("left"), 6)
    assert value[0] > 1.0
    top = mesh.nearest_point([0.5, 0.5, 1.0])
    f = s.rotation.T @ np.eye(3 * len(s.mesh.points))[3 * top + 2]
    x = static_solution(s, f, s.clamped_dofs("left"))
    turn = (s.rotation @ x)[3 * top + 2]
    GJ = METAL.G * np.pi * 0.02**4 / 2
    assert 1 / GJ < turn < 1.2 / GJ  # the plate adds a little to the twist of the mast


@pytest.mark.parametrize(("cell", "n"), [("quad", 20), ("quad9", 8)])
def test_strip_under_tip_force_matches_elastica(cell, n):
    """A clamped strip under an end force, 10 % of its length: the elastica's deflection."""
    L, b, h = 1.0, 0.1, 0.002
    material = Material(70e9, 0.0, 2700.0)
    s = shell(rectangle(L, b, n, 1, cell), h, material)
    EI = 70e9 * b * h**3 / 12
    P = 0.35 * EI / L**2
    free = np.setdiff1d(np.arange(s.n_dof), s.clamped_dofs("left"))

    F = np.zeros((len(s.mesh.points), 3))
    for node, part in edge_weights(s.mesh, "right").items():
        F[node, 2] = part * P
    f = s.translation.T @ F.ravel()
    x = np.zeros(s.n_dof)
    for _ in range(25):
        residual = f - s.internal_force.force(x)
        step = spsolve(s.internal_force.tangent(x)[free][:, free].tocsc(), residual[free])
        x[free] += step
        if np.abs(step).max() < 1e-12:
            break
    tip = (s.translation @ x).reshape(-1, 3)[s.mesh.group_points("right")].mean(axis=0)
    w, u = elastica(P * L**2 / EI)
    assert tip[2] == pytest.approx(w * L, rel=0.003)
    assert -tip[0] == pytest.approx(u * L, rel=0.04)


FIBRE = Lamina(140e9, 10e9, 5e9, 0.3, 1600.0, 5e9, 3.5e9)


def cylindrical(section, n=16, width=0.05) -> tuple[np.ndarray, np.ndarray]:
    """Tip displacement (3,) of a strip of length 1 under a force per width at its end, per newton per metre; and D."""
    s = build_structure(rectangle(1.0, width, n, 1, "quad9"), [Member("surface", "shell", section)])
    everything = {"surface": ("y", "rx", "rz"), "left": ("x", "y", "z", "rx", "ry", "rz")}
    fixed = s.constrained_dofs(everything)
    F = np.zeros((len(s.mesh.points), 3))
    for node, part in edge_weights(s.mesh, "right").items():
        F[node, 2] = part * width
    x = static_solution(s, s.translation.T @ F.ravel(), fixed)
    return (s.translation @ x).reshape(-1, 3)[s.mesh.group_points("right")].mean(axis=0)


def test_unsymmetric_laminate_deflection():
    """0/90 in cylindrical bending: D_eff = D11 - B11^2 / A11; u = -B11 / A11 times the end slope."""
    section = layup([Ply(FIBRE, 0.002, 0.0), Ply(FIBRE, 0.002, np.pi / 2)], coupled=True)
    assert abs(section.B[0, 0]) > 0 and section.coupled
    A, B, D = section.A[0, 0], section.B[0, 0], section.D[0, 0]
    effective = D - B * B / A
    u = cylindrical(section)
    assert u[2] == pytest.approx(1 / 3 / effective + 1 / section.S[0, 0], rel=1e-3)
    assert u[0] == pytest.approx(B / A * 0.5 / effective, rel=1e-3)  # e = -B/A kappa, kappa = -w''


def test_offset_sheet():
    sheet = isotropic(0.01, Material(70e9, 0.3, 2700.0))
    moved = sheet.shifted(0.02)
    np.testing.assert_allclose(cylindrical(moved)[2], cylindrical(sheet)[2], rtol=1e-9)  # about its own middle still
    assert cylindrical(moved)[0] == pytest.approx(0.02 * 0.5 / sheet.D[0, 0], rel=1e-3)
    same = shell(rectangle(1.0, 1.0, 2, 2, "quad"), 0.01, METAL, offset=0.02)
    other = build_structure(rectangle(1.0, 1.0, 2, 2, "quad"), [Member("surface", "shell", moved)])
    np.testing.assert_allclose(same.K.toarray(), other.K.toarray(), rtol=1e-12, atol=1e-6)
    rho = np.concatenate([block.rho.reshape(-1, 3) for block in same.inertia])
    dm = np.concatenate([block.dm.ravel() for block in same.inertia])
    assert dm.sum() == pytest.approx(27.0) and dm @ rho[:, 2] / dm.sum() == pytest.approx(0.02)
    turn = same.translation.T @ np.cross([1.0, 0, 0], same.mesh.points).ravel()
    turn = turn + same.rotation.T @ np.tile([1.0, 0, 0], len(same.mesh.points))
    assert turn @ same.M @ turn == pytest.approx(dm @ (rho[:, 1] ** 2 + rho[:, 2] ** 2), rel=1e-9)


def navier(a, h, lamina, plies, q=1.0) -> float:
    """Centre deflection under q sin sin of a simply supported square cross-ply plate, first-order shear theory."""
    section = layup(plies)
    p = np.pi / a
    D, S = section.D, section.S
    # w, psi_x, psi_y amplitudes
    K = np.array([
        [S[0, 0] * p**2 + S[1, 1] * p**2, S[0, 0] * p, S[1, 1] * p],
        [S[0, 0] * p, D[0, 0] * p**2 + D[2, 2] * p**2 + S[0, 0], (D[0, 1] + D[2, 2]) * p**2],
        [S[1, 1] * p, (D[0, 1] + D[2, 2]) * p**2, D[1, 1] * p**2 + D[2, 2] * p**2 + S[1, 1]],
    ])  # fmt: skip
    return float(np.linalg.solve(K, [q, 0, 0])[0])


@pytest.mark.parametrize("slenderness", [10, 100])
def test_cross_ply_plate_matches_navier(slenderness):
    a, h = 1.0, 1.0 / slenderness
    plies = [Ply(FIBRE, h / 3, angle) for angle in (0.0, np.pi / 2, 0.0)]
    s = build_structure(rectangle(a, a, 8, 8, "quad9"), [Member("surface", "shell", layup(plies))])
    supports = {
        "left": ("y", "z", "rx"),
        "right": ("y", "z", "rx"),
        "bottom": ("x", "z", "ry"),
        "top": ("x", "z", "ry"),
    }
    fixed = s.constrained_dofs(supports)
    x, y, _ = s.mesh.points.T
    load = np.zeros((len(x), 3))
    load[:, 2] = np.sin(np.pi * x) * np.sin(np.pi * y)
    mass = sum(block.dm.sum() for block in s.inertia)
    f = s.M @ (s.translation.T @ load.ravel()) / mass  # the load, spread as the shape functions are
    u = static_solution(s, f, fixed)
    w = (s.translation @ u).reshape(-1, 3)[s.mesh.nearest_point([0.5, 0.5, 0]), 2]
    assert w == pytest.approx(navier(a, h, FIBRE, plies), rel=3e-3)
