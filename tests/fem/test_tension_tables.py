"""Membranes and tethers in any position: initial stress, homogeneous strain, and states about a deflection."""

from __future__ import annotations

import numpy as np
import pytest
from support.plate_models import random_rotation

from femflex.fem import Member, build_structure
from femflex.fem.deflected import deflected
from femflex.fem.sections import CableSection
from femflex.fem.sections.laminates import orthotropic
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
