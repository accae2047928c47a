"""Structures and bodies the reduction tests share."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from femflex.fem import Material, Member, build_structure
from femflex.fem.sections import Rectangle, StiffnessSection, Tube
from femflex.mesh import Mesh
from femflex.mesh.generators import line

LENGTH, MASS, EI_Y, EI_Z = 5.0, 1.3, 200.0, 300.0  # m, kg/m, N m^2
CLAMPED_FREE = np.array([1.87510406871196, 4.69409113297417, 7.85475743823761, 10.9955407348755])
FREE_FREE = np.array([4.73004074486270, 7.85320462409584, 10.9956078380017])
ALUMINIUM = Material(7e10, 0.3, 2700.0)


def slender_beam(n=8, direction=(1.0, 0.0, 0.0), length=LENGTH, order=6, radius=1e-3):
    """A straight uniform beam along a direction, order 6 by default: frequencies to about 1e-9."""
    section = StiffnessSection(EA=1e6, EIy=EI_Y, EIz=EI_Z, GJ=100.0, mass_per_length=MASS, ry=radius, rz=radius)
    end = length * np.asarray(direction) / np.linalg.norm(direction)
    mesh = line([[0, 0, 0], end.tolist()], n)
    return build_structure(mesh, [Member("line", "beam", section, options={"order": order, "rotary_inertia": False})])


def bent_boom(n=10, order=4):
    """A boom with a corner, no plane of symmetry."""
    mesh = line([[0.2, 0, 0], [3, 1, 0.5], [3, 4, 2]], n)
    return build_structure(mesh, [Member("line", "beam", Rectangle(0.05, 0.03), ALUMINIUM, {"order": order})])


def frame(n=4):
    """A portal: two legs, a beam, a diagonal; groups "left", "right", "top" (points) and "feet"."""
    corners = np.array([[0, 0, 0], [0, 0, 2.0], [3, 0.3, 2.0], [3, 0.3, 0.1]])
    legs = [(0, 1), (1, 2), (2, 3), (0, 2)]
    points, cells = list(corners), []
    for a, b in legs:
        inner = [corners[a] + (corners[b] - corners[a]) * k / n for k in range(1, n)]
        chain = [a, *range(len(points), len(points) + n - 1), b]
        points += inner
        cells += list(pairwise(chain))
    mesh = Mesh(
        np.array(points),
        {"line": np.array(cells)},
        {"bars": {"line": np.arange(len(cells))}},
        {
            name: np.array(at)
            for name, at in {"left": [0], "right": [3], "top": [2], "feet": [0, 3], "edge": [0, 1, 3]}.items()
        },
    )
    return build_structure(mesh, [Member("bars", "beam", Tube(0.06, 0.004), ALUMINIUM)])


def dense_frequencies(structure, held, n):
    """The lowest frequencies with dofs held, by a dense solution of the full matrices."""
    from scipy.linalg import eigh

    free = np.setdiff1d(np.arange(structure.n_dof), held)
    K, M = structure.K[free][:, free].toarray(), structure.M[free][:, free].toarray()
    theta = eigh(M, K, eigvals_only=True)[::-1][:n]
    return 1 / np.sqrt(theta)
