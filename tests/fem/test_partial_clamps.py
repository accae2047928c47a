"""A clamp of single components holds whole straight edges of plates, between their nodes too."""

from __future__ import annotations

import numpy as np
import pytest
from nonlinear_models import METAL

from femflex.fem import Member, build_structure
from femflex.mesh import rectangle


@pytest.mark.parametrize(("family", "cell"), [("plate", "triangle"), ("plate_bfs", "quad")])
def test_an_edge_held_across_stays_straight_and_slides_along_itself(family, cell):
    """Pressed by a thermal strain, a plate held in x between two edges and free in y: sigma_x = -E eps, sigma_y = 0."""
    strain, h = 1e-4, 0.01
    mesh = rectangle(1.0, 1.0, 3, 3, cell)
    structure = build_structure(mesh, [Member("surface", family, h, METAL, {"thermal_strain": strain})])
    held = [structure.clamped_dofs(edge, ("x",)) for edge in ("left", "right")]
    held += [structure.clamped_dofs("bottom", ("y",)), structure.clamped_dofs("surface", ("z", "rx", "ry", "rz"))]
    held = np.unique(np.concatenate(held))
    free = np.setdiff1d(np.arange(structure.n_dof), held)
    K = structure.K[free][:, free].toarray()
    x = np.zeros(structure.n_dof)
    x[free] = np.linalg.lstsq(K, -structure.f0[free], rcond=None)[0]
    u = (structure.translation @ x).reshape(-1, 3)
    np.testing.assert_allclose(u[:, 0], 0.0, atol=1e-10)
    np.testing.assert_allclose(u[:, 1], (1 + METAL.nu) * strain * mesh.points[:, 1], rtol=1e-3, atol=1e-10)
