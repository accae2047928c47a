"""Structures whose matrices the tests write out and read back."""

from __future__ import annotations

import numpy as np

from femflex.fem import Material, Member, PointMass, build_structure
from femflex.fem.sections import Tube
from femflex.mesh import Mesh
from femflex.mesh.generators import box, line

SOFT = Material(7e7, 0.3, 270.0)


def brick(counts=(4, 1, 1)):
    """A solid bar of 2.0 x 0.3 x 0.2 m; faces "left" and "right"."""
    return build_structure(box(2.0, 0.3, 0.2, *counts), [Member("volume", "solid", None, SOFT)])


def boom(n=6, tip=True):
    """A cubic beam along an oblique line of 3 m, groups "root" and "tip", with a tip mass with inertia."""
    mesh = line([[0.1, 0.2, 0.0], [2.1, 1.2, 2.0]], n)
    mesh = Mesh(mesh.points, mesh.cells, mesh.cell_groups, {"root": [0], "tip": [len(mesh.points) - 1]})
    masses = [PointMass("tip", 2.0, np.diag([0.2, 0.1, 0.15]))] if tip else []
    return build_structure(mesh, [Member("line", "beam", Tube(0.06, 0.004), SOFT, {"order": 3})], masses)
