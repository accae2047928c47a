"""Markers given by a place: how far it may lie from the mesh, by the diagonal of the mesh's extent."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from femflex.case.mesh_groups import NEAR, mesh_problems
from femflex.mesh import Mesh

EXTENT = np.array([8.0, 3.0, 0.5])
PLACE = np.array([70.0, -20.0, 40.0])  # of the mesh, away from the origin


def sheet(n: int) -> Mesh:
    """Points of a grid of n x n x 2 with that extent, without cells."""
    grid = np.meshgrid(np.linspace(0, 1, n), np.linspace(0, 1, n), [0.0, 1.0], indexing="ij")
    return Mesh(np.stack(grid, axis=-1).reshape(-1, 3) * EXTENT + PLACE, {})


def problems(mesh: Mesh, position: np.ndarray) -> list[Any]:
    table: Any = SimpleNamespace(
        markers={"tip": SimpleNamespace(position=tuple(position), group=None)},
        members=(), point_masses=(), connections=(), bushings=(), preload=None, reduction=None, source="sheet.inp",
    )  # fmt: skip
    return list(mesh_problems("panel", table, mesh))


@pytest.mark.parametrize("n", [2, 5, 30])
@pytest.mark.parametrize("way", [(1.0, 0.0, 0.0), (0.6, 0.0, 0.8), (2 / 7, 3 / 7, 6 / 7)])
def test_a_marker_is_refused_beyond_a_twentieth_of_the_diagonal_however_fine_the_mesh(n: int, way: Any):
    limit, corner = NEAR * np.sqrt(EXTENT @ EXTENT), EXTENT + PLACE
    assert problems(sheet(n), corner + 0.98 * limit * np.array(way)) == []
    position = corner + 1.02 * limit * np.array(way)
    (found,) = problems(sheet(n), position)
    assert found.where == "bodies.panel.markers.tip.position"
    assert found.text == (
        f"found {position.tolist()} m, {1.02 * limit:.4g} m from the nearest point of the mesh {corner.tolist()}; "
        "name a place on the mesh"
    )
