"""Second-order curvature and twist of the beam family against sections that turn by finite rotations."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from skfem.quadrature import get_quadrature
from skfem.refdom import RefLine

from femflex.fem import Member, build_structure
from femflex.fem.beam.shapes import BeamOrder, field_rows
from femflex.fem.sections import StiffnessSection
from femflex.mesh import line

LENGTH, ORDER = 2.0, BeamOrder(3, 5, 2)
XI = get_quadrature(RefLine, 8)[0][0]


def block_of(EIy, EIz, GJ):
    """The strain of one element along x whose section lies along y and z."""
    section = StiffnessSection(1e6, EIy, EIz, GJ, 1.0, ry=0.02, rz=0.03)
    mesh = line([[0, 0, 0], [LENGTH, 0, 0]], 1)
    return build_structure(mesh, [Member("line", "beam", section, None, {"orientation": (0, 1, 0)})]).strain[0]


def bent(block, raw):
    """Energy of curvature and twist at raw displacements, by the table."""
    g = block.gradients(raw[:, None], slice(None))[0, ..., 0]
    eps = g @ block.linear_map.T + 0.5 * np.einsum("sgh,qg,qh->qs", block.quadratic_map, g, g)
    return np.einsum("q,qs,s->", block.weight[0], eps[:, 1:] ** 2, np.diag(block.elastic[0, 0])[1:]) / 2


def frames(local, xi):
    """Rotations of the sections (q,): the x axis goes to the tangent, the rotation vector's x component is theta."""
    h = np.array([LENGTH])
    theta = field_rows(ORDER, xi, h, 0)[0, :, 3] @ local
    slope = (field_rows(ORDER, xi, h, 1)[0, :, 1:3] @ local).T
    y, z = -slope[1], slope[0]
    for _ in range(60):
        tangent = Rotation.from_rotvec(np.stack([theta, y, z], axis=1)).as_matrix()[:, :, 0]
        y, z = y + tangent[:, 2] - slope[1], z - tangent[:, 1] + slope[0]
    return Rotation.from_rotvec(np.stack([theta, y, z], axis=1))


def exactly_bent(block, local, EIy, EIz, GJ):
    """The same energy from R^T R' of the frames, by differences along the beam."""
    d = 1e-4
    ahead, back = (frames(local, XI + step) for step in (d, -d))
    kappa = (back.inv() * ahead).as_rotvec() / (2 * d * LENGTH)
    return np.einsum("q,qs,s->", block.weight[0], kappa**2, [GJ, EIy, EIz]) / 2


@pytest.mark.parametrize("stiffness", [(700.0, 14.0, 12.0), (5.0, 90.0, 30.0), (40.0, 40.0, 25.0)])
def test_the_energy_is_that_of_turned_sections_to_third_order(stiffness):
    block = block_of(*stiffness)
    raw = np.zeros(block.dofs.max() + 1)
    local = np.random.default_rng(4).normal(size=block.dofs.shape[1])
    local[:12] *= 0.3
    apart = []
    for size in (0.04, 0.02, 0.01):
        raw[block.dofs[0]] = size * local
        both = bent(block, raw), exactly_bent(block, size * local, *stiffness)
        apart.append(both[0] - both[1])
    assert np.log2(np.abs(apart[1] / apart[2])) == pytest.approx(4, abs=0.15)
    assert np.abs(apart[2]) < 1e-3 * both[1]


def test_a_twisted_round_tube_bends_as_one_that_is_not_twisted():
    block = block_of(40.0, 40.0, 25.0)
    raw, local = np.zeros(block.dofs.max() + 1), np.zeros(block.dofs.shape[1])
    local[[7, 8, 10, 11]] = 0.2, -0.3, 0.4, 0.1
    raw[block.dofs[0]] = local
    straight = bent(block, raw)
    raw[block.dofs[0, [3, 9]]] = 0.5
    assert bent(block, raw) == pytest.approx(straight, rel=1e-12)
