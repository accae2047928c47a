"""Plates and solids through the same reduction: rigid motions, markers on edges and faces, lumped masses."""

from __future__ import annotations

import numpy as np
import pytest

from femflex.fem import Material, Member, build_structure
from femflex.fem.eigen.modes import stiffness_ratio
from femflex.mesh.generators import box, rectangle
from femflex.reduction import (
    cantilever_modes,
    craig_bampton,
    free_free_modes,
    lumped,
    reduce_structure,
)
from femflex.reduction.boundary.markers import marker_rows
from femflex.reduction.boundary.rigid import rigid_shapes
from femflex.reduction.inertia.moments import strain_stiffness

SHEET = Material(7e10, 0.3, 2700.0)
PANEL = Material(2e9, 0.3, 100.0)


@pytest.fixture(scope="module", params=["plate", "solid"])
def structure(request):
    turn = [0.3, 0.4, 0.2]
    if request.param == "plate":
        mesh = rectangle(1.0, 1.0, 6, 6).rotated(turn).moved([2.0, -1.0, 0.5])
        return build_structure(mesh, [Member("surface", "plate", 0.01, SHEET)])
    mesh = box(3.0, 0.8, 0.1, 6, 2, 1, "hexahedron27").rotated(turn)
    return build_structure(mesh, [Member("volume", "solid", None, PANEL)])


def test_six_rigid_motions_cost_nothing(structure):
    R = rigid_shapes(structure)
    assert np.abs(stiffness_ratio(structure.K, R)).max() < 1e-16
    assert free_free_modes(structure, 3).n_modes >= 3
    total = sum(block.dm.sum() for block in structure.inertia)
    assert np.diag(R.T @ (structure.M @ R))[:3] == pytest.approx(total, rel=1e-12)


@pytest.mark.parametrize("make", [lambda s: cantilever_modes(s, "left", 5), lambda s: free_free_modes(s, 5)])
def test_moments_and_stiffness_are_those_of_the_modes(structure, make):
    modes = make(structure)
    body = reduce_structure(structure, modes)
    n = modes.n_modes
    assert np.abs(body.moments.elastic_mass() - np.eye(n)).max() < 1e-12
    for V1 in (body.strain.V1, strain_stiffness(structure.strain, structure.T @ modes.phi)):
        assert np.abs(V1 / np.outer(modes.omega, modes.omega) - np.eye(n)).max() < 1e-7


def test_markers_on_an_edge_or_face_follow_a_rigid_motion(structure):
    rows = marker_rows(structure, "right")
    R = rigid_shapes(structure, about=rows.position)
    assert rows.translation @ R == pytest.approx(np.eye(3, 6), abs=1e-12)
    assert rows.rotation @ R == pytest.approx(np.eye(3, 6, 3), abs=1e-12)


def test_a_craig_bampton_set_rests_on_its_first_edge_or_face(structure):
    for interface in ("rigid", "nodal"):
        body = reduce_structure(structure, craig_bampton(structure, ["left", "right"], 4, interface=interface))
        assert np.abs(body.marker("left").phi).max() < 1e-11 and np.abs(body.marker("left").psi).max() < 1e-10
        assert np.abs(body.marker("right").phi).max() > 1e-2


def test_lumped_masses_are_positive_and_keep_the_total(structure):
    lumps = lumped(structure)
    masses = lumps.inertia[0].dm
    assert masses.min() > 0
    assert masses.sum() == pytest.approx(sum(block.dm.sum() for block in structure.inertia), rel=1e-12)
    close = cantilever_modes(lumps, "left", 1).omega[0] / cantilever_modes(structure, "left", 1).omega[0]
    assert close == pytest.approx(1.0, abs=0.02)


def test_the_two_torsion_like_modes_of_a_free_square_plate_stay_together():
    mesh = rectangle(1.0, 1.0, 8, 8)
    modes = free_free_modes(build_structure(mesh, [Member("surface", "plate", 0.01, SHEET)]), 4)
    assert modes.n_modes == 5  # the 4th and 5th of a free square plate are one pair
    assert modes.omega[3] == pytest.approx(modes.omega[4], rel=1e-3)
