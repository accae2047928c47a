"""Markers on nodes without rotation: axes about which they show none, and when that is warned of."""

from __future__ import annotations

import warnings

import numpy as np
import pytest

from femflex.fem import Material, Member, build_structure
from femflex.fem.sections import Rectangle
from femflex.mesh import box, line
from femflex.reduction import cantilever_modes, reduce_structure
from femflex.reduction.boundary.markers import marker, marker_rows
from femflex.warning import PhysicsWarning

METAL = Material(70e9, 0.3, 2700.0)


def block():
    """A block clamped at x = 0, with groups of nodes at its other end: a corner, an edge along y, the face."""
    mesh = box(1.0, 0.2, 0.3, 2, 1, 1, "hexahedron20")
    far = np.isclose(mesh.points[:, 0], 1.0)
    edge = far & np.isclose(mesh.points[:, 2], 0.0)
    points = {"corner": np.flatnonzero(edge)[:1], "edge": np.flatnonzero(edge), "face": np.flatnonzero(far)}
    return build_structure(mesh.with_groups(points=points), [Member("volume", "solid", material=METAL)])


def texts(structure, group, phi, **options):
    """What is warned of a marker "m" on a group."""
    with warnings.catch_warnings(record=True) as found:
        warnings.simplefilter("always")
        marker(marker_rows(structure, group), phi, "m", **options)
    assert all(one.category is PhysicsWarning for one in found)
    return [str(one.message) for one in found]


def test_a_corner_shows_no_rotation_an_edge_that_about_itself_is_missing_and_a_face_has_all():
    s = block()
    phi = cantilever_modes(s, "left", 4).phi
    told = (
        "marker 'm' shows no rotation about {} of 3 axes: its nodes have no rotation and lie on one point or line. A "
        "joint at this marker does not turn about those axes, and a torque about them does not bend the body; name a "
        "group of nodes around the place."
    )
    assert texts(s, "corner", phi) == [told.format(3)]
    assert texts(s, "edge", phi) == [told.format(1)]
    assert texts(s, "face", phi) == []
    assert np.abs(marker_rows(s, "edge").blind.T) == pytest.approx(np.array([[0.0, 1.0, 0.0]]))
    assert marker_rows(s, "corner").blind.shape == (3, 3) and marker_rows(s, "face").blind.shape == (3, 0)


def test_markers_that_rest_or_carry_no_torque_or_have_nodes_that_turn_are_not_warned_of():
    s = block()
    phi = cantilever_modes(s, "left", 4).phi
    assert texts(s, "left", phi) == texts(s, "edge", 0.0 * phi) == texts(s, "edge", phi, turning=False) == []
    beam = build_structure(line([[0, 0, 0], [1.0, 0, 0]], 2), [Member("line", "beam", Rectangle(0.02, 0.03), METAL)])
    assert texts(beam, "end", cantilever_modes(beam, "start", 2).phi) == []


def test_of_the_markers_of_a_body_those_that_turn_alone_are_warned_of():
    s = block()
    modes = cantilever_modes(s, "left", 3)
    groups = {"edge": "edge", "other edge": "edge"}
    with pytest.warns(PhysicsWarning, match="marker 'other edge' shows no rotation about 1 of 3") as found:
        reduce_structure(s, modes, groups, turning=("other edge",))
    assert len(found) == 1


def test_the_rotation_of_a_face_is_that_of_its_nodes_in_the_mean():
    """A rigid rotation t of all nodes about the origin moves the middle of the face by t x r and turns it by t."""
    s, t = block(), np.array([0.3, -0.2, 0.5])
    u = np.cross(t, s.mesh.points)
    rows = marker_rows(s, "face")
    assert rows.rotation @ (s.translation.T @ u.ravel()) == pytest.approx(t)
    assert rows.translation @ (s.translation.T @ u.ravel()) == pytest.approx(np.cross(t, rows.position))
    edge = marker_rows(s, "edge")
    assert edge.rotation @ (s.translation.T @ u.ravel()) == pytest.approx([0.3, 0.0, 0.5], abs=1e-14)
