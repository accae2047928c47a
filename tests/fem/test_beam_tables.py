"""Statics, patch tests and tables of beams: what must hold exactly, to rounding."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.sparse.linalg import spsolve

from femflex.fem import Material, Member, Structure, build_structure
from femflex.fem.sections import Circle, Rectangle, Tube
from femflex.mesh import Mesh, line

E, NU, RHO, L = 70e9, 0.3, 2700.0, 4.0
ALUMINIUM = Material(E, NU, RHO)
OBLIQUE = np.array([1.0, 2.0, -0.5]) / np.linalg.norm([1.0, 2.0, -0.5])
SECTION = Rectangle(0.06, 0.1)
PROPERTIES = SECTION.properties(np.zeros(1), 1.0)
A, IY, IZ, J = (float(getattr(PROPERTIES, name)[0]) for name in ("A", "Iy", "Iz", "J"))


def boom(n: int, direction=OBLIQUE, start=(3.0, -1.0, 2.0)) -> Mesh:
    return line([start, np.asarray(start) + L * np.asarray(direction)], n)


def beam(mesh: Mesh, section=SECTION, point_masses=(), **options) -> Structure:
    return build_structure(mesh, [Member("line", "beam", section, ALUMINIUM, options)], point_masses)


def rigid_motions(structure: Structure) -> np.ndarray:
    """Dofs (n_dof, 6) of three unit translations and three unit rotations about the origin; bubbles at rest."""
    points, eye = structure.mesh.points, np.eye(3)
    columns = []
    for k in range(6):
        turn = eye[k - 3] if k >= 3 else np.zeros(3)
        shift = np.cross(turn, points) + (eye[k] if k < 3 else 0.0)
        columns.append(structure.translation.T @ shift.ravel() + structure.rotation.T @ np.tile(turn, len(points)))
    return np.stack(columns, axis=1)


def deflection(structure: Structure, load: np.ndarray, group: str = "end") -> tuple[np.ndarray, np.ndarray]:
    """Displacement and rotation of the loaded node under a force (3,) and moment (3,) there, clamped at the start."""
    node = structure.mesh.group_points(group)[0]
    rows = [operator[3 * node : 3 * node + 3] for operator in (structure.translation, structure.rotation)]
    force = rows[0].T @ load[:3] + rows[1].T @ load[3:]
    free = np.setdiff1d(np.arange(structure.n_dof), structure.clamped_dofs("start"))
    u = np.zeros(structure.n_dof)
    u[free] = spsolve(structure.K.tocsc()[free][:, free], force[free])
    return rows[0] @ u, rows[1] @ u


def axes(y: np.ndarray, x: np.ndarray = OBLIQUE) -> np.ndarray:
    y = y - (y @ x) * x
    y = y / np.linalg.norm(y)
    return np.stack([x, y, np.cross(x, y)])


@pytest.mark.parametrize(("n", "order"), [(1, 3), (5, 3), (2, 6)])
def test_a_tip_load_gives_the_exact_deflection_in_the_section_axes(n, order):
    """F L^3 / 3EI and M L / EI, F L^2 / 2EI both ways, N L / EA, T L / GJ; the section's y along the orientation."""
    orientation = np.array([0.3, 0.1, 1.0])
    C = axes(orientation)
    structure = beam(boom(n), order=order, orientation=orientation.tolist())
    N, Fy, Fz, T, My, Mz = load = np.array([5e3, 70.0, -110.0, 40.0, 30.0, -20.0])
    u, theta = deflection(structure, np.concatenate([C.T @ load[:3], C.T @ load[3:]]))
    expected_u = [
        N * L / (E * A),
        Fy * L**3 / (3 * E * IZ) + Mz * L**2 / (2 * E * IZ),
        Fz * L**3 / (3 * E * IY) - My * L**2 / (2 * E * IY),
    ]
    expected_theta = [
        T * L / (ALUMINIUM.G * J),
        My * L / (E * IY) - Fz * L**2 / (2 * E * IY),
        Mz * L / (E * IZ) + Fy * L**2 / (2 * E * IZ),
    ]
    assert C @ u == pytest.approx(expected_u, rel=1e-8)
    assert C @ theta == pytest.approx(expected_theta, rel=1e-8)


def test_an_angle_frame_bends_and_twists_by_the_closed_form():
    """Load F out of the plane at the end of arms a, b: F (a^3 + b^3) / 3EI + F a b^2 / GJ, and in the plane across b:
    F b^3 / 3EI + F a b^2 / EI from the first arm's end rotation, F a / EA from its stretch."""
    a, b, F = 3.0, 2.0, 50.0
    structure = beam(line([[0, 0, 0], [a, 0, 0], [a, b, 0]], 5), Tube(0.05, 0.005))
    p = Tube(0.05, 0.005).properties(np.zeros(1), 1.0)
    EI, GJ, EA = E * p.Iy[0], ALUMINIUM.G * p.J[0], E * p.A[0]
    out = deflection(structure, np.array([0, 0, F, 0, 0, 0]))[0][2]
    assert out == pytest.approx(F * (a**3 + b**3) / (3 * EI) + F * a * b**2 / GJ, rel=1e-8)
    across = deflection(structure, np.array([F, 0, 0, 0, 0, 0]))[0][0]
    assert across == pytest.approx(F * b**3 / (3 * EI) + F * a * b**2 / EI + F * a / EA, rel=1e-8)


def test_uniform_strains_are_exact():
    """Stretch, bending to a parabola and uniform twist have their constant strains at every point."""
    structure = beam(boom(3), order=4, orientation=[0, 0, 1.0])
    (block,) = structure.strain
    C, x = axes(np.array([0, 0, 1.0])), (structure.mesh.points - structure.mesh.points[0]) @ OBLIQUE
    columns = []
    for u, theta in (
        (x[:, None] * C[0], 0 * x[:, None] * C[0]),  # u = x
        (x[:, None] ** 2 / 2 * C[1], x[:, None] * C[2]),  # v = x^2 / 2, theta_z = v'
        (x[:, None] ** 2 / 2 * C[2], -x[:, None] * C[1]),  # w = x^2 / 2, theta_y = -w'
        (0 * x[:, None] * C[0], x[:, None] * C[0]),  # theta = x
    ):
        columns.append(structure.translation.T @ u.ravel() + structure.rotation.T @ theta.ravel())
    phi = np.stack(columns, axis=1)
    strain = np.einsum("sg,eqgn->eqsn", block.linear_map, block.gradients(structure.T @ phi, slice(None)))
    radius = np.sqrt((IY + IZ) / A)
    expected = np.array([[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, -1, 0], [0, 0, 0, radius]], float)
    assert strain == pytest.approx(np.broadcast_to(expected, strain.shape), abs=1e-11)
    energy = np.array([E * A, E * IZ, E * IY, ALUMINIUM.G * J]) * L
    assert phi.T @ structure.K @ phi == pytest.approx(np.diag(energy), rel=1e-10, abs=1e-7 * energy.min())


def bar_inertia(mass: float, size: np.ndarray) -> np.ndarray:
    """Inertia of a homogeneous box about its centre, principal axes along its sides."""
    return mass / 12 * np.diag((size**2).sum() - size**2)


@pytest.mark.parametrize("n", [1, 4])
def test_rigid_body_inertia_is_that_of_the_solid_bar(n):
    """From M by rigid motions and from the table's points alone, about the mesh origin."""
    structure = beam(boom(n), orientation=[0, 0, 1.0])
    C, mass = axes(np.array([0, 0, 1.0])), RHO * A * L
    c = np.array([3.0, -1.0, 2.0]) + L / 2 * OBLIQUE
    J_O = C.T @ bar_inertia(mass, np.array([L, 0.06, 0.1])) @ C + mass * (c @ c * np.eye(3) - np.outer(c, c))
    cross = mass * np.cross(np.eye(3), c)  # rows: axis x c
    expected = np.block([[mass * np.eye(3), cross.T], [cross, J_O]])
    R = rigid_motions(structure)
    assert R.T @ structure.M @ R == pytest.approx(expected, rel=1e-11, abs=1e-11 * np.abs(expected).max())
    (block,) = structure.inertia
    Q = np.einsum("eqa,eqb,eq->ab", block.rho, block.rho, block.dm)
    assert np.trace(Q) * np.eye(3) - Q == pytest.approx(J_O, rel=1e-12)
    assert np.einsum("eqa,eq->a", block.rho, block.dm) == pytest.approx(mass * c, rel=1e-12)


def test_varying_mass_is_the_integral():
    """A frustum's mass and centre: radius r0 to r1."""
    r0, r1 = 0.1, 0.04
    structure = beam(boom(2, [1, 0, 0], (0, 0, 0)), Circle(f"{r0} + ({r1} - {r0})*s/L"))
    (block,) = structure.inertia
    volume = np.pi * L / 3 * (r0**2 + r0 * r1 + r1**2)
    assert block.dm.sum() == pytest.approx(RHO * volume, rel=1e-13)
    centre = L / 4 * (r0**2 + 2 * r0 * r1 + 3 * r1**2) / (r0**2 + r0 * r1 + r1**2)
    assert np.einsum("eqa,eq->a", block.rho, block.dm) / block.dm.sum() == pytest.approx([centre, 0, 0], abs=1e-13)
