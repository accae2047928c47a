"""Elastic energy, force and stiffness summed in small pieces, and of stress that some elements have alone."""

from __future__ import annotations

import numpy as np
import pytest
from support.nonlinear_models import METAL, STRUCTURES, random_state

from femflex.fem import Member, build_structure
from femflex.fem.sections import CableSection, Rectangle
from femflex.fem.sections.laminates import isotropic
from femflex.mesh import Mesh, line, rectangle


def shell(cell):
    flat = rectangle(1.0, 0.8, 2, 2, cell)
    x, y, _ = flat.points.T
    bowl = Mesh(np.stack([x, y, 0.1 * x * x + 0.2 * x * y], axis=1), flat.cells, flat.cell_groups)
    member = Member("surface", "shell", isotropic(0.05, METAL).shifted(0.01), None, {"prestress": (3e4, -1e4, 2e4)})
    return build_structure(bowl, [member])


def rope():
    mesh = line([[0, 0, 0], [1.0, 0.4, 0.2], [1.2, 1.1, -0.3]], 5)
    return build_structure(mesh, [Member("line", "tether", CableSection(1e5, 0.3), None, {"prestress": 40.0})])


def shearing():
    mesh = line([[0, 0, 0], [1.0, 0.4, 0.2], [1.2, 1.1, -0.3]], 5)
    options = {"shear": True, "prestress": 400.0, "orientation": (0, 0, 1), "far_bends": True}
    return build_structure(mesh, [Member("line", "beam", Rectangle(0.05, 0.08), METAL, options)])


MADE = {**STRUCTURES, "rope": rope, "shell of 4 nodes": lambda: shell("quad"), "shell of 9": lambda: shell("quad9"),
        "beam that shears": shearing}  # fmt: skip
NAMES = ("tapered beam", "folded plate", "prestressed plate", "hot bfs", "prestressed solid", "rope",
         "shell of 4 nodes", "shell of 9", "beam that shears")  # fmt: skip


@pytest.mark.parametrize("name", NAMES)
def test_the_change_of_the_tangent_is_its_central_difference(name):
    """(dK/da) b at rest, of two motions of unlike size, where the energy is of degree four."""
    s = MADE[name]()
    a, b = random_state(s, 1.0, seed=2), random_state(s, 0.3, seed=3)
    V, h = s.internal_force, 1e-3
    slope = (V.tangent(h * a) @ b - V.tangent(-h * a) @ b) / (2 * h)
    found = V.second_derivative(np.column_stack([a, b]), np.array([0]), np.array([1]))[:, 0]
    np.testing.assert_allclose(found, slope, atol=1e-6 * np.abs(slope).max())
