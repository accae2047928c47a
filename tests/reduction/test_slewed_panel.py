"""The panel of cases/panel_slew_hard.toml bent by a tenth of its length, against full nonlinear finite elements."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from support.full_solution import Full, Reduced, static_path

from femflex.assembly import build_mesh, build_modes, build_structure_of
from femflex.case import read_case
from femflex.reduction import reduce_structure, with_derivatives
from femflex.reduction.boundary.rigid import rigid_shapes

CASE = Path(__file__).parents[2] / "cases" / "panel_slew_hard.toml"


@pytest.mark.slow
def test_both_nonlinear_forms_bend_the_slewed_panel_as_full_finite_elements_do():
    """Under the inertia of an angular acceleration, to 0.66 m of 6 m; what the set leaves out grows with the bend."""
    case = read_case(CASE)
    table = case.bodies["panel_east"]
    structure, modes = build_modes(
        build_structure_of(case, "panel_east", table, build_mesh(case, "panel_east", table)), table
    )
    full, load = Full(structure, modes.held), -structure.M @ rigid_shapes(structure)[:, 4]
    corner = structure.mesh.group_points("tip_corner")[0]
    row = structure.translation[[3 * corner + 2]].toarray()[0]
    soft = row[full.free] @ static_path(full, load[full.free], [1e-6])[0] / 1e-6
    factors = np.array([0.22, 0.44, 0.66]) / soft
    exact = static_path(full, load[full.free], factors) @ row[full.free]
    assert exact[-1] > 0.1 * 6.0
    shapes = with_derivatives(structure, modes)
    body = reduce_structure(structure, shapes, strain="nonlinear")
    d = static_path(Reduced(body.strain), shapes.phi.T @ load, factors)
    np.testing.assert_allclose(d @ (shapes.phi.T @ row), exact, rtol=2e-3)
    body = reduce_structure(structure, shapes, strain="condensed")
    n = body.n_modes
    d = static_path(Reduced(body.strain), shapes.phi[:, :n].T @ load, factors)  # the load does not move the followers
    np.testing.assert_allclose(d @ (shapes.phi[:, :n].T @ row), exact, rtol=2e-3)
