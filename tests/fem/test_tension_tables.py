"""Membranes and tethers in any position: initial stress, homogeneous strain, and states about a deflection."""

from __future__ import annotations

import numpy as np
import pytest
from support.plate_models import METAL, random_rotation

from femflex.fem import Material, Member, build_structure
from femflex.fem.deflected import deflected
from femflex.fem.sections import CableSection, Circle
from femflex.fem.sections.laminates import orthotropic
from femflex.fem.tension.strain import least_squares, lowest_principal
from femflex.mesh import Mesh, line, rectangle

C = random_rotation(17)
CLOTH = orthotropic(2e-4, 3e9, 1e9, 4e8, 0.35, 1400.0)


def sheet(cell, section=CLOTH, mesh=None, **options):
    mesh = rectangle(2.0, 1.0, 3, 2, cell) if mesh is None else mesh
    return build_structure(mesh.rotated(C), [Member("surface", "membrane", section, None, options)])


def moved(s, H) -> np.ndarray:
    """Dofs of displacements H (3, 3) times the place; what fades at the nodes is at rest."""
    return s.translation.T @ (s.mesh.points @ H.T).ravel()


@pytest.mark.parametrize("cell", ["triangle", "triangle6"])
@pytest.mark.parametrize("heat", [(3e-4, -1e-4, 2e-4), 2e-4, None])
def test_a_sheet_under_a_homogeneous_gradient_has_the_energy_of_green_and_lagrange(cell, heat):
    """Fibres along a skew axis; E of the tangent plane from F^T F, stress of the axes of the fibres."""
    angle, force = 0.6, np.array([4e3, 1e3, 8e2])
    axis = C @ [np.cos(angle), np.sin(angle), 0.0]
    s = sheet(cell, axis=axis, prestress=force, thermal_strain=heat)
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
    x = moved(s, H)
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


def test_a_sheet_with_curved_sides_has_its_area_mass_and_energy():
    """Area 2 + 2 * 0.2 * int x (2 - x) dx of quadratic sides, exact; energy of a homogeneous stretch; mass matrix."""
    s = sheet("triangle6", mesh=arched(), prestress=(30.0, 20.0, 5.0), axis=C[:, 0])
    (inertia,), (block,) = s.inertia, s.strain
    area = 2.0 + 0.4 * 4 / 3
    assert block.weight.sum() == pytest.approx(area, rel=1e-9)
    assert inertia.dm.sum() == pytest.approx(area * 2e-4 * 1400, rel=1e-9)
    H = C @ np.array([[0.1, 0.2, 0], [-0.3, 0.15, 0], [0.4, -0.1, 0]]) @ C.T
    F = (np.eye(3) + H) @ C[:, :2]
    E = (F.T @ F - np.eye(2)) / 2
    eps = np.array([E[0, 0], E[1, 1], 2 * E[0, 1]])
    density = np.array([30.0, 20.0, 5.0]) @ eps + eps @ CLOTH.A @ eps / 2
    assert s.internal_force.energy(moved(s, H)) == pytest.approx(area * density, rel=1e-9)
    x = moved(s, np.outer(C[:, 2], C[:, 0]))  # w = x
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
def test_a_rope_under_a_homogeneous_gradient_has_the_energy_of_its_lengths(cell, order):
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
    x = moved(s, H)
    assert s.internal_force.energy(x) == pytest.approx(energy, rel=1e-9)
    assert s.f0 @ x == pytest.approx(work, rel=1e-9)
    assert sum(block.dm.sum() for block in s.inertia) == pytest.approx(0.3 * L + 0.1 * L**7 / 7, rel=1e-9)
    for place, block in zip(s.places, s.strain, strict=True):
        assert place.kind == "line" and place.fibres is None
        assert np.einsum("eq,eqi->i", block.weight, place.x) == pytest.approx(
            lengths @ (corners[1:] + corners[:-1]) / 2, rel=1e-9
        )


def test_a_bar_as_a_rope_has_the_stress_of_its_section():
    s = rope(section=Circle("0.01 + 0.002 * s"), material=METAL)
    place = s.places[0]
    assert place.fibres.shape == (*s.strain[0].weight.shape, 4)
    r = np.sqrt(1 / (np.pi * place.fibres[..., 0]))
    assert s.strain[0].elastic[..., 0, 0] == pytest.approx(METAL.E * np.pi * r**2)
    assert place.fibres[..., 1] == pytest.approx(4 / (np.pi * r**3))


MADE = {"rope": lambda: rope(prestress=40.0), "sheet": lambda: sheet("triangle", prestress=300.0, thermal_strain=1e-4)}


@pytest.mark.parametrize("kind", MADE)
def test_a_state_about_a_deflection_is_the_same_structure_seen_from_there(kind):
    """Energies, forces, places and pictures of both, at displacements that mix all dofs; and twice deflected."""
    s = MADE[kind]()
    rng = np.random.default_rng(5)
    x, y, d = 0.1 * rng.normal(size=(3, s.n_dof))
    once = deflected(s, x)
    twice = deflected(once, y)
    V, W, U = (one.internal_force for one in (s, once, twice))
    assert W.energy(d) == pytest.approx(V.energy(x + d) - V.energy(x), rel=1e-9)
    assert U.energy(d) == pytest.approx(V.energy(x + y + d) - V.energy(x + y), rel=1e-9)
    np.testing.assert_allclose(once.f0, V.force(x), atol=1e-9 * np.abs(V.force(x)).max())
    np.testing.assert_allclose(once.K.toarray(), V.tangent(x).toarray(), atol=1e-9 * abs(V.tangent(x)).max())
    assert twice.mesh.points == pytest.approx(s.mesh.points + (s.translation @ (x + y)).reshape(-1, 3))
    drawn = s.skin.points + (s.skin.operator @ (x + y)).reshape(-1, 3)
    assert twice.skin.points == pytest.approx(drawn)
    for one, other in zip(s.inertia, twice.inertia, strict=True):
        moved = one.shapes((s.T @ (x + y))[:, None], slice(None))[..., 0]
        assert other.rho == pytest.approx(one.rho + moved)
    for place, block in zip(twice.places, twice.strain, strict=True):
        assert place.x is block.places
    (block,), (far,) = s.strain, twice.strain
    force = np.einsum("eq,eqi->i", block.weight, far.places - block.places)
    moved = np.einsum("qm,emc->eqc", block.moved, (s.T @ (x + y))[block.dofs].reshape(len(block.dofs), -1, 3))
    assert force == pytest.approx(np.einsum("eq,eqi->i", block.weight, moved))


def test_stress_is_smoothed_in_the_weighted_mean():
    """Projection onto polynomials: it leaves them alone, and what is left over is orthogonal to them."""
    x, w = np.polynomial.legendre.leggauss(7)
    w = w * (1 + 0.3 * x)
    values = np.stack([np.ones(7), x, x**2], axis=1)
    P = least_squares(values, w)
    assert P @ values == pytest.approx(values, abs=1e-12) and P @ P == pytest.approx(P, abs=1e-12)
    rest = np.sin(5 * x) - P @ np.sin(5 * x)
    assert values.T @ (w * rest) == pytest.approx(np.zeros(3), abs=1e-12)


def test_the_lowest_principal_stress_is_the_lower_eigenvalue():
    xx, yy, xy = stress = np.random.default_rng(1).normal(size=(3, 50))
    expected = np.linalg.eigvalsh(np.array([[xx, xy], [xy, yy]]).transpose(2, 0, 1))[:, 0]
    assert lowest_principal(stress.T) == pytest.approx(expected)
    assert lowest_principal(stress[:1].T) == pytest.approx(xx)


def test_a_tether_with_one_end_on_a_membrane_keeps_its_own_order():
    """Along the edge it shares the side's displacements; one that leaves the sheet has more of its own."""
    mesh = rectangle(1.0, 1.0, 2, 2)
    corner = mesh.nearest_point([1.0, 1.0, 0])
    points = np.concatenate([mesh.points, [[2.0, 1.5, 0.3]]])
    n = len(mesh.points)
    cells = {**mesh.cells, "line": np.concatenate([mesh.cells["line"], [[corner, n]]])}
    stay = {"line": [len(mesh.cells["line"])]}
    mesh = Mesh(points, cells, {**mesh.cell_groups, "stay": stay}, mesh.point_groups)
    film = Member("surface", "membrane", 1e-4, Material(3e9, 0.3, 1400.0), {"prestress": 20.0})
    cord = CableSection(1e5, 1e-3)
    alone, stayed, edged = (
        build_structure(mesh, [film, *more])
        for more in ([], [Member("stay", "tether", cord)], [Member("right", "tether", cord)])
    )
    assert stayed.n_dof == alone.n_dof + 3 + 3 * 3  # its end, its side, and two more functions of order 3 and 4
    assert edged.n_dof == alone.n_dof


def words(make) -> str:
    with pytest.raises(ValueError) as refusal:
        make()
    return str(refusal.value)


def test_what_tension_members_cannot_use_is_named():
    name = "membrane on group 'surface' has "
    assert words(lambda: sheet("triangle", prestress=(3.0, 1.0, 2.0))).startswith(
        f"{name}prestress [3.0, 1.0, 2.0] N/m, of which the lowest principal value is {2 - np.sqrt(5):.4g} N/m"
    )
    sheet("triangle", prestress=(3.0, 1.5, 2.0))
    assert words(lambda: sheet("triangle", viscosity=np.inf)) == (
        name + "viscosity inf; give one number of seconds, not negative"
    )
    name = "tether on group 'line' has "
    assert words(lambda: rope(prestress=-5.5)) == (
        name + "prestress -5.5 N; a tether carries no compression, so give a tension"
    )
    assert words(lambda: rope(viscosity=-0.5)) == name + "viscosity -0.5 s; a damping time cannot be negative"
    assert words(lambda: rope(thermal_strain="hot")) == name + "thermal_strain 'hot'; give one finite number"
    assert words(lambda: rope(order=0)).startswith(name + "order 0; it may be 1 to 8")


def test_the_picture_of_a_rope_runs_from_node_to_node_through_what_its_functions_say():
    """Straight and curved cells in one member: five points along each, moved by the shape functions of order 3."""
    points = np.array([[0, 0, 0], [1.0, 0.3, 0], [1.9, 0.2, 0.4], [3.0, 0.5, 0.1], [2.5, 0.6, 0.3]])
    cells = {"line": np.array([[0, 1], [2, 1]]), "line3": np.array([[2, 3, 4]])}
    mesh = Mesh(points, cells, {"line": {"line": [0, 1], "line3": [0]}})
    s = build_structure(mesh, [Member("line", "tether", CableSection(1e5, 0.1), None, {"order": 3})])
    assert list(s.skin.cells) == ["line"] and s.skin.points.shape == (15, 3)
    assert np.array_equal(s.skin.cells["line"], [[5 * e + k, 5 * e + k + 1] for e in range(3) for k in range(4)])
    t = np.linspace(0, 1, 5)[:, None]
    quadratic = (1 - t) * (1 - 2 * t), t * (2 * t - 1), 4 * t * (1 - t)
    curve = sum(f * points[node] for f, node in zip(quadratic, (2, 3, 4), strict=True))
    wanted = [*((1 - t) * points[a] + t * points[b] for a, b in cells["line"]), curve]
    assert s.skin.points == pytest.approx(np.concatenate(wanted), abs=1e-13)
    H, x = np.random.default_rng(2).normal(size=(3, 3)), np.zeros(s.n_dof)
    x += moved(s, H)
    assert (s.skin.operator @ x).reshape(-1, 3) == pytest.approx(s.skin.points @ H.T, abs=1e-12)
    inner = np.setdiff1d(np.arange(s.n_dof), s.translation.indices)
    block, straight = s.strain[0], np.zeros(s.n_dof)
    straight[np.intersect1d(block.dofs, inner)] = np.random.default_rng(3).normal(size=2 * 6)
    drawn = (s.skin.operator @ straight).reshape(3, 5, 3)
    own = (s.T @ straight)[block.dofs].reshape(2, 4, 3)
    cubic = np.sqrt(5) * t * (1 - t) * (1 - 2 * t)  # the integral of sqrt(5) P_2
    for e in range(2):
        assert drawn[e] == pytest.approx(4 * t * (1 - t) * own[e, 2] + cubic * own[e, 3], abs=1e-12)
    assert not drawn[2].any()


def test_the_picture_of_a_sheet_is_four_triangles_of_each_cell_over_its_corners_and_sides():
    """Cells of three nodes and of six with a curved side in one member; area, nodes and motion."""
    points = np.array(
        [[0, 0, 0], [1.0, 0, 0], [0.2, 0.9, 0], [1.1, 1.2, 0], [0.65, 0.4, 0], [1.3, 0.6, 0], [0.7, 1.1, 0]]
    )
    cells = {"triangle": np.array([[0, 1, 2]]), "triangle6": np.array([[1, 3, 2, 5, 6, 4]])}
    mesh = Mesh(points @ C.T, cells, {"surface": {"triangle": [0], "triangle6": [0]}})
    s = build_structure(mesh, [Member("surface", "membrane", CLOTH)])
    x, four = s.skin.points @ C, s.skin.cells["triangle"]
    assert list(s.skin.cells) == ["triangle"] and four.shape == (8, 3)
    sides = [(points[a] + points[b]) / 2 for a, b in ((0, 1), (1, 2), (2, 0))]
    assert x == pytest.approx(np.concatenate([points[:3], sides, points[[1, 3, 2, 5, 6, 4]]]), abs=1e-13)
    a, b, c = x[four].swapaxes(0, 1)
    area = np.cross(b - a, c - a)[:, 2] / 2
    polygon = points[[1, 5, 3, 6, 2, 4]]
    whole = np.sum(np.cross(polygon, np.roll(polygon, -1, axis=0))[:, 2]) / 2
    assert (
        (area > 0).all() and area[:4] == pytest.approx(np.full(4, 0.45 / 4)) and area[4:].sum() == pytest.approx(whole)
    )
    H = np.random.default_rng(2).normal(size=(3, 3))
    assert (s.skin.operator @ moved(s, H)).reshape(-1, 3) == pytest.approx(s.skin.points @ H.T, abs=1e-12)


def test_sides_count_as_curved_from_a_billionth_of_the_sheet():
    """The rule has more points where a middle node lies off its side, be it by a thousandth."""
    flat = rectangle(2.0, 1.0, 1, 1, "triangle6")
    few = sheet("triangle6", mesh=flat).strain[0].weight.shape[1]
    for off, more in ((1e-3, True), (1e-12, False)):
        points = flat.points.copy()
        points[flat.nearest_point([1.0, 0.0, 0])] += [0, off, 0]
        bent = Mesh(points, flat.cells, flat.cell_groups)
        assert (sheet("triangle6", mesh=bent).strain[0].weight.shape[1] > few) == more
