"""Meshes of every family taken as rigid bodies: sets without a shape have the mass and the centre of the mesh."""

from __future__ import annotations

import numpy as np
import pytest
from support.reduction_examples import ALUMINIUM

from femflex.fem import Member, build_structure
from femflex.fem.sections import Rectangle
from femflex.mesh.generators import box, line, rectangle
from femflex.reduction import reduce_structure, rigid_set

SHEET = 2700.0 * 2.0 * 0.8 * 0.01
MESHES = {
    "solid": (lambda: box(2.0, 0.8, 0.4, 2, 1, 1), Member("volume", "solid", None, ALUMINIUM), 2700 * 0.64),
    "shell": (lambda: rectangle(2.0, 0.8, 3, 1, "quad"), Member("surface", "shell", 0.01, ALUMINIUM), SHEET),
    "plate": (lambda: rectangle(2.0, 0.8, 3, 1, "triangle"), Member("surface", "plate", 0.01, ALUMINIUM), SHEET),
    "plate_bfs": (lambda: rectangle(2.0, 0.8, 3, 1, "quad"), Member("surface", "plate_bfs", 0.01, ALUMINIUM), SHEET),
    "beam": (
        lambda: line([[0, 0.4, 0], [2, 0.4, 0]], 3),
        Member("line", "beam", Rectangle(0.02, 0.03), ALUMINIUM, {"orientation": (0, 1, 0)}),
        2700 * 2 * 6e-4,
    ),
}


@pytest.mark.parametrize("family", MESHES)
def test_a_mesh_taken_as_rigid_has_its_mass_and_its_centre(family: str):
    mesh, member, mass = MESHES[family]
    structure = build_structure(mesh(), [member])
    body = reduce_structure(structure, rigid_set(structure.n_dof))
    assert body.n_modes == body.n_shapes == 0 and body.moments.mass == pytest.approx(mass)
    assert body.moments.center_of_mass()[:2] == pytest.approx([1.0, 0.4])
    across = body.moments.inertia()[1, 1] - mass * np.sum(body.moments.center_of_mass()[[0, 2]] ** 2)
    assert across == pytest.approx(mass * (4.0 + (0.16 if family == "solid" else 0.0)) / 12, rel=1e-3)
