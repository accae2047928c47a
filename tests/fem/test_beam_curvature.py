"""Large rotations of beams: curvature against sections that turn, and lateral-torsional buckling loads of frames."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import linalg
from scipy.spatial.transform import Rotation
from skfem.quadrature import get_quadrature
from skfem.refdom import RefLine
from support.plate_models import random_rotation

from femflex.body import Marker
from femflex.fem import Material, Member, build_structure
from femflex.fem.beam.shapes import BeamOrder, field_rows
from femflex.fem.sections import Rectangle, StiffnessSection
from femflex.fem.support import Support
from femflex.mesh import line

LENGTH, ORDER = 2.0, BeamOrder(3, 5, 2)


XI = get_quadrature(RefLine, 8)[0][0]


def block_of(EIy, EIz, GJ):
    """The strain of one element along x whose section lies along y and z."""
    section = StiffnessSection(1e6, EIy, EIz, GJ, 1.0, ry=0.02, rz=0.03)
    mesh = line([[0, 0, 0], [LENGTH, 0, 0]], 1)
    return build_structure(mesh, [Member("line", "beam", section, None, {"orientation": (0, 1, 0)})]).strain[0]


def table_energy(block, raw):
    """Energy of curvature and twist at raw displacements, by the table."""
    total = 0.0
    for part in block.nonlinear(slice(None)):
        g = part.gradients(raw[:, None], slice(None))[0, ..., 0]
        eps = g @ part.linear_map.T + 0.5 * np.einsum("sgh,qg,qh->qs", part.quadratic_map, g, g)
        if part.linear_map.any():
            eps[:, 0] = 0.0  # stretch
        total += np.einsum("q,qs,s->", part.weight[0], eps**2, np.diag(part.elastic[0, 0])) / 2
    return total


def frames(local, xi):
    """Rotations of the sections (q,): by theta about x, then the shortest way that takes x to the tangent."""
    h = np.array([LENGTH])
    theta = field_rows(ORDER, xi, h, 0)[0, :, 3] @ local
    slope = (field_rows(ORDER, xi, h, 1)[0, :, 1:3] @ local).T
    sine = np.linalg.norm(slope, axis=0)
    shortest = np.arcsin(sine) / sine * np.stack([0 * sine, -slope[1], slope[0]])
    return Rotation.from_rotvec(shortest.T) * Rotation.from_rotvec(np.outer(theta, [1, 0, 0]))


def exact_energy(block, local, EIy, EIz, GJ):
    """The same energy from R^T R' of the frames, by differences along the beam."""
    d = 1e-4
    ahead, back = (frames(local, XI + step) for step in (d, -d))
    kappa = (back.inv() * ahead).as_rotvec() / (2 * d * LENGTH)
    return np.einsum("q,qs,s->", block.weight[0], kappa**2, [GJ, EIy, EIz]) / 2


def with_shortened_axis(local):
    """The dofs with those of u such that the axis keeps its length, u' = -(v'^2 + w'^2) / 2 at all points."""
    local, h = local.copy(), np.array([LENGTH])
    slopes = field_rows(ORDER, XI, h, 1)[0]
    axial = np.flatnonzero(np.abs(slopes[:, 0]).max(axis=0) > 0)
    short = -((slopes[:, 1:3] @ local) ** 2).sum(axis=1) / 2
    local[axial] = np.linalg.lstsq(slopes[:, 0, axial], short, rcond=None)[0]
    assert slopes[:, 0] @ local == pytest.approx(short, abs=1e-12)
    return local


def energy_errors(stiffness, local):
    """Relative errors of the table's energy against that of rotated sections, at three amplitudes."""
    block, errors = block_of(*stiffness), []
    raw = np.zeros(block.dofs.max() + 1)
    for size in (0.08, 0.04, 0.02):
        shortened = with_shortened_axis(size * local)
        raw[block.dofs[0]] = shortened
        exact = exact_energy(block, shortened, *stiffness)
        errors.append(table_energy(block, raw) / exact - 1)
    return np.abs(errors)


STIFFNESS = [(700.0, 14.0, 12.0), (5.0, 90.0, 30.0), (40.0, 40.0, 25.0)]


@pytest.mark.parametrize("stiffness", STIFFNESS)
def test_energy_of_rotated_sections_to_fourth_order(stiffness):
    """Bent about both axes and twisted at once; what is left falls as the cube of the size, or faster."""
    local = np.random.default_rng(4).normal(size=ORDER.n_local)
    local[:12] *= 0.3
    computed = energy_errors(stiffness, local)
    assert np.log2(computed[1] / computed[2]) > 2.8
    assert computed[2] < 2e-5


@pytest.mark.parametrize("stiffness", STIFFNESS)
def test_energy_of_plane_bending_to_fourth_order(stiffness):
    """Linear curvature would leave the square of the slope, 1e-3 of the energy at the second size."""
    slope = np.array([0.0, 0.4, -0.1, 0.6])
    local = np.zeros(ORDER.n_local)
    local[[1, 5, 7, 11]] = 0.6 * slope
    local[[2, 4, 8, 10]] = 0.8 * slope * [1, -1, 1, -1]
    computed = energy_errors(stiffness, local)
    assert np.log2(computed[:2] / computed[1:]) == pytest.approx([4, 4], abs=0.1)
    assert computed[1] < 2e-6


def test_marker_rotation_equals_section_rotation():
    """Its x axis on the tangent, its rotation vector's x component the twist: to second order, in slopes to third."""
    e, differences = np.array([1.0, 0, 0]), []
    marker = Marker(np.zeros(3), np.zeros((3, 3)), np.eye(3), axis=e)
    for twist, order in ((0.5, 3), (0.0, 5)):
        for size in (0.2, 0.1):
            s = size * np.array([twist, -0.7, 1.0])
            y, z = s[1:]
            for _ in range(60):
                tangent = Rotation.from_rotvec([s[0], y, z]).as_matrix()[:, 0]
                y, z = y + tangent[2] + s[1], z - tangent[1] + s[2]
            differences.append(np.linalg.norm(marker.rotation_vector(s) - [s[0], y, z]))
        assert np.log2(differences[-2] / differences[-1]) == pytest.approx(order, abs=0.2)
    assert differences[-1] < 1e-5


STRIP = {"orientation": [0.0, 0.0, 1.0]}


def load_factors(structure, held, F) -> tuple[float, float]:
    """The smallest positive and negative factors of the load F (n_dof,) at which the structure buckles."""
    free = np.setdiff1d(np.arange(structure.n_dof), held)
    K = structure.K[free][:, free].toarray()
    x = np.zeros(structure.n_dof)
    x[free] = np.linalg.solve(K, F[free])
    Kg = structure.internal_force.geometric_stiffness(x)[free][:, free].toarray()
    computed = 1 / linalg.eigvalsh(-Kg, K)[[0, -1]]
    return float(computed.max()), float(computed.min())


@pytest.mark.parametrize("turned", [False, True])
def test_right_angled_frame_under_an_end_load_in_its_plane(turned):
    """240 by 240, 30 by 0.6, E = 71240, nu = 0.31: 1.088 and -0.680 (Argyris and others 1979)."""
    C = random_rotation(2) if turned else np.eye(3)
    mesh = line([[0, 0, 0], [240.0, 0, 0], [240.0, -240.0, 0]], 8).rotated(C)
    strip = Member("line", "beam", Rectangle(0.6, 30.0), Material(71240.0, 0.31, 1.0), {"orientation": C[:, 2]})
    structure = build_structure(mesh, [strip])
    tip = mesh.group_points("end")[0]
    F = C[:, 0] @ structure.translation[3 * tip : 3 * tip + 3].toarray()
    computed = load_factors(structure, structure.clamped_dofs("start"), F)
    assert computed == pytest.approx((1.088, -0.680), rel=6e-3)  # 4e-3 by the torsion constant


@pytest.mark.parametrize("angle", [np.pi / 6, np.pi / 3, np.pi / 2])
def test_circular_arch_under_end_moments(angle):
    """(EI + GJ)/2R +- sqrt(((EI - GJ)/2R)^2 + EI GJ (pi / R angle)^2), ends held against twist (Timoshenko and Gere).

    The arch is of straight beams whose ends are held about their own axes: two meshes are extrapolated.
    """
    material, section = Material(70e9, 0.3, 2700.0), Rectangle(0.002, 0.04)
    r = section.resultants(material, np.zeros(1), np.ones(1))
    EI, GJ = (float(np.ravel(value)[0]) for value in (min(r.EIy, r.EIz), r.GJ))
    mean, root = (EI + GJ) / 2, np.hypot((EI - GJ) / 2, np.sqrt(EI * GJ) * np.pi / angle)
    computed = np.array([arch_moments(angle, n, material, section) for n in (8, 16)])
    np.testing.assert_allclose(2 * computed[1] - computed[0], [mean + root, mean - root], rtol=0.015)


def arch_moments(angle, n, material, section) -> tuple[float, float]:
    """Buckling moments of an arch of radius 1 of n straight beams, along z at its start and back at its end."""
    mesh = line(lambda s: (np.sin(angle * (s - 0.5)), np.cos(angle * (s - 0.5)), 0.0), n)
    supports = {}
    for group, fixed, (i, j) in (("start", ("x", "y", "z", "rx"), (0, 1)), ("end", ("y", "z", "rx"), (-2, -1))):
        e = mesh.points[j] - mesh.points[i]
        supports[group] = Support(fixed, (tuple(e), tuple(np.cross([0, 0, 1.0], e)), (0, 0, 1.0)))
    structure = build_structure(mesh, [Member("line", "beam", section, material, STRIP)], supports=supports)
    ends = [3 * mesh.group_points(group)[0] + 2 for group in ("start", "end")]
    rows = structure.rotation[ends].toarray()
    return load_factors(structure, structure.constrained_dofs(supports), rows[0] - rows[1])
