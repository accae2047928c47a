"""Options of beams, each against another way to say the same or a closed form: offsets, orders, corners, notes."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import linalg
from support.plate_models import METAL, random_rotation

from femflex.fem import Member, build_structure
from femflex.fem.sections import Box, FullSection, Rectangle, Tube
from femflex.mesh import line

BENT = line([[0, 0, 0], [1.0, 0.4, 0.2], [1.2, 1.1, -0.3]], 3)


def beam(section, mesh=BENT, **options):
    given = {"orientation": (0.1, 0.3, 1.0), "extent": 10.0, **options}
    return build_structure(mesh, [Member("line", "beam", section, METAL, given)])


def moved_strains(y: float, z: float) -> np.ndarray:
    """(6, 6): strains at (0, y, z) of a section from those at its origin, gamma + kappa x r."""
    X = np.eye(6)
    for k, kappa in enumerate(np.eye(3)):
        X[:3, 3 + k] = np.cross(kappa, [0, y, z])
    return X


def mass_about(M: np.ndarray, y: float, z: float) -> np.ndarray:
    """The mass matrix (6, 6) of a section moved by (0, y, z), from its velocities there."""
    X = np.eye(6)
    for k, omega in enumerate(np.eye(3)):
        X[:3, 3 + k] = np.cross(omega, [0, y, z])
    return X.T @ M @ X


def same(a, b):
    """Matrices, and the energy of a large motion."""
    assert a.n_dof == b.n_dof
    np.testing.assert_allclose(a.K.toarray(), b.K.toarray(), atol=1e-11 * abs(b.K).max())
    np.testing.assert_allclose(a.M.toarray(), b.M.toarray(), atol=1e-11 * abs(b.M).max())


MASSES = np.array([[0.3, 0.02, 0.01], [0.8, -0.03, 0.02], [0.5, 0.01, -0.04]])  # kg/m at y, z


def section_mass() -> np.ndarray:
    return sum(m * mass_about(np.diag([1.0, 1, 1, 0, 0, 0]), y, z) for m, y, z in MASSES)


def section_stiffness() -> np.ndarray:
    rows = np.random.default_rng(9).normal(size=(9, 6)) * [1e3, 800.0, 700.0, 30.0, 20.0, 40.0]
    return rows.T @ rows


def test_a_full_section_off_the_nodes_is_one_with_stiffness_and_mass_about_them():
    K, M = section_stiffness(), section_mass()
    offset, centre = (0.05, -0.08), (-0.02, 0.03)
    X = moved_strains(*offset)
    known = FullSection(X.T @ K @ X, mass_about(M, offset[0] + centre[0], offset[1] + centre[1]))
    same(beam(FullSection(K, M), offset=offset, mass_centre=centre), beam(known))
    same(beam(FullSection(K, M), shear_centre=(0.3, 0.2)), beam(FullSection(K, M)))  # its matrix has it already


def test_centroid_shear_centre_and_mass_centre_of_a_shape_lie_apart():
    """EA, EI at the centroid, GJ and k G A at the shear centre, the mass at its own centre: as one 6 x 6 matrix."""
    section, offset, shear, mass = Box(0.04, 0.06, 0.005), (0.05, -0.08), (0.013, 0.021), (-0.02, 0.03)
    r = section.resultants(METAL, np.zeros(1), np.ones(1))
    axial, across = np.diag([r.EA[0], 0, 0, 0, r.EIy[0], r.EIz[0]]), np.diag([0, r.GAy[0], r.GAz[0], r.GJ[0], 0, 0])
    at, where = moved_strains(*offset), moved_strains(offset[0] + shear[0], offset[1] + shear[1])
    Iy, Iz = (0.04 * 0.06**3 - 0.03 * 0.05**3) / 12, (0.06 * 0.04**3 - 0.05 * 0.03**3) / 12
    own = METAL.density * np.diag([9e-4, 9e-4, 9e-4, Iy + Iz, Iy, Iz])
    known = FullSection(at.T @ axial @ at + where.T @ across @ where, mass_about(own, *np.add(offset, mass)))
    found = beam(section, offset=offset, shear_centre=shear, mass_centre=mass)
    same(found, beam(known))


def test_heat_and_tension_of_an_offset_beam_act_at_its_centroid():
    """Virtual work of N (eps + z kappa_y - y kappa_z): the end feels N along the beam and e x N about the node."""
    C, e = random_rotation(5), np.array([0.0, 0.04, -0.07])
    mesh = line([[0, 0, 0], [1.5, 0, 0]], 2).rotated(C)
    section = Rectangle(0.03, 0.05)
    s = beam(section, mesh, orientation=C[:, 1], offset=e[1:], prestress=700.0, thermal_strain=2e-5)
    N = C @ [700.0 - METAL.E * 0.0015 * 2e-5, 0, 0]
    end = 3 * mesh.group_points("end")[0]
    assert (s.translation @ s.f0)[end : end + 3] == pytest.approx(N, abs=1e-9)
    assert (s.rotation @ s.f0)[end : end + 3] == pytest.approx(np.cross(C @ e, N), abs=1e-9)


@pytest.mark.parametrize(
    ("orders", "component", "speed"),
    [
        ({"torsion_order": 9, "axial_order": 2}, "rx", np.sqrt(METAL.G / METAL.density)),
        ({"torsion_order": 2, "axial_order": 9}, "x", np.sqrt(METAL.E / METAL.density)),
    ],
)
def test_one_element_of_high_order_twists_and_stretches_as_waves_do(orders, component, speed):
    """A round bar between fixed ends, L = 2: k pi c / L, four of them on an element whose bends are cubic."""
    mesh = line([[0, 0, 0], [2.0, 0, 0]], 1)
    s = beam(Tube(0.02, 0.005), mesh, orientation=(0, 1, 0), order=3, **orders)
    others = [c for c in ("x", "y", "z", "rx", "ry", "rz") if c != component]
    held = np.union1d(s.held_dofs({"start": (component,), "end": (component,)}), s.held_dofs({"line": others}))
    free = np.setdiff1d(np.arange(s.n_dof), held)
    assert len(free) == 8  # the bubbles of one field
    value = linalg.eigh(s.K[free][:, free].toarray(), s.M[free][:, free].toarray(), eigvals_only=True)
    assert np.sqrt(value[:3]) == pytest.approx(np.arange(1, 4) * np.pi / 2 * speed, rel=1e-4)


def notes(section, mesh, **options) -> list[str]:
    given = {"extent": 10.0, **options}
    return list(build_structure(mesh, [Member("line", "beam", section, METAL, given)]).notes)
