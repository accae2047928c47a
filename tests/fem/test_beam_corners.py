"""Frames of beams that meet at an angle, stressed in their plane, tip over sideways where theory says."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import linalg
from support.plate_models import random_rotation

from femflex.fem import Material, Member, build_structure
from femflex.fem.sections import Rectangle
from femflex.fem.support import Support
from femflex.mesh import line

STRIP = {"orientation": [0.0, 0.0, 1.0]}


def load_factors(structure, held, F) -> tuple[float, float]:
    """The smallest positive and negative factors of the load F (n_dof,) at which the structure buckles."""
    free = np.setdiff1d(np.arange(structure.n_dof), held)
    K = structure.K[free][:, free].toarray()
    x = np.zeros(structure.n_dof)
    x[free] = np.linalg.solve(K, F[free])
    Kg = structure.internal_force.geometric_stiffness(x)[free][:, free].toarray()
    found = 1 / linalg.eigvalsh(-Kg, K)[[0, -1]]
    return float(found.max()), float(found.min())


@pytest.mark.parametrize("turned", [False, True])
def test_right_angled_frame_under_an_end_load_in_its_plane(turned):
    """240 by 240, 30 by 0.6, E = 71240, nu = 0.31: 1.088 and -0.680 (Argyris and others 1979)."""
    C = random_rotation(2) if turned else np.eye(3)
    mesh = line([[0, 0, 0], [240.0, 0, 0], [240.0, -240.0, 0]], 8).rotated(C)
    strip = Member("line", "beam", Rectangle(0.6, 30.0), Material(71240.0, 0.31, 1.0), {"orientation": C[:, 2]})
    structure = build_structure(mesh, [strip])
    tip = mesh.group_points("end")[0]
    F = C[:, 0] @ structure.translation[3 * tip : 3 * tip + 3].toarray()
    found = load_factors(structure, structure.clamped_dofs("start"), F)
    assert found == pytest.approx((1.088, -0.680), rel=6e-3)  # 4e-3 by the torsion constant


@pytest.mark.parametrize("angle", [np.pi / 6, np.pi / 3, np.pi / 2])
def test_circular_arch_under_end_moments(angle):
    """(EI + GJ)/2R +- sqrt(((EI - GJ)/2R)^2 + EI GJ (pi / R angle)^2), ends held against twist (Timoshenko and Gere).

    The arch is of straight beams whose ends are held about their own axes: two meshes are extrapolated.
    """
    material, section = Material(70e9, 0.3, 2700.0), Rectangle(0.002, 0.04)
    r = section.resultants(material, np.zeros(1), np.ones(1))
    EI, GJ = (float(np.ravel(value)[0]) for value in (min(r.EIy, r.EIz), r.GJ))
    mean, root = (EI + GJ) / 2, np.hypot((EI - GJ) / 2, np.sqrt(EI * GJ) * np.pi / angle)
    found = np.array([arch_moments(angle, n, material, section) for n in (8, 16)])
    np.testing.assert_allclose(2 * found[1] - found[0], [mean + root, mean - root], rtol=0.015)


def arch_moments(angle, n, material, section) -> tuple[float, float]:
    """Buckling moments of an arch of radius 1 of n straight beams, along z at its start and back at its end."""
    mesh = line(lambda s: (np.sin(angle * (s - 0.5)), np.cos(angle * (s - 0.5)), 0.0), n)
    supports = {}
    for group, held, (i, j) in (("start", ("x", "y", "z", "rx"), (0, 1)), ("end", ("y", "z", "rx"), (-2, -1))):
        e = mesh.points[j] - mesh.points[i]
        supports[group] = Support(held, (tuple(e), tuple(np.cross([0, 0, 1.0], e)), (0, 0, 1.0)))
    structure = build_structure(mesh, [Member("line", "beam", section, material, STRIP)], supports=supports)
    ends = [3 * mesh.group_points(group)[0] + 2 for group in ("start", "end")]
    rows = structure.rotation[ends].toarray()
    return load_factors(structure, structure.held_dofs(supports), rows[0] - rows[1])
