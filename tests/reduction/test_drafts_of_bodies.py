"""Bodies drafted for small motions about rest: they vibrate with their craft as the bodies themselves do."""

from __future__ import annotations

import numpy as np
import pytest

from femflex.body import FlexibleBody, Marker, rigid_body
from femflex.dynamics.equilibria.rest_modes import rest_modes
from femflex.fem import Material, Member, PointMass, build_structure
from femflex.mesh import rectangle
from femflex.reduction import cantilever_modes, free_free_modes, reduce_structure
from femflex.reduction.small_motions import small_motion_body
from femflex.rotations import dcm_from_vector
from femflex.system import System, free, revolute


def panel():
    flat = rectangle(1.2, 0.5, 4, 2).rotated(dcm_from_vector([0.3, 0.6, -0.3]))
    mesh = flat.moved([0.3, -0.2, 0.1])
    member = Member("surface", "plate", 0.004, Material(70e9, 0.3, 2700.0))
    return build_structure(mesh, [member], [PointMass("right", 0.8, offset=(0.0, 0.1, 0.3))])


def craft(body: FlexibleBody, root: str) -> System:
    hub = rigid_body(5.0, [1.0, 2.0, 2.5], [0.1, 0.2, 0.3], {"m": Marker.rigid(np.array([0.3, -0.2, 0.5]))})
    joint = revolute("panel", "hub", axis=(1.0, 2.0, 2.0), parent_marker="m", child_marker=root, stiffness=30.0)
    return System({"hub": hub, "panel": body}, (free("hub"), joint))


@pytest.mark.parametrize(("modes", "root"), [(cantilever_modes, "left"), (free_free_modes, "corner")])
def test_a_drafted_body_vibrates_with_its_craft_as_the_body_itself(modes, root):
    structure = panel()
    set_ = modes(structure, "left", 5) if modes is cantilever_modes else modes(structure, 5)
    markers = {"tip": "right", "corner": "left"}
    own, draft = reduce_structure(structure, set_, markers), small_motion_body(structure, set_, markers)
    assert draft.moments.mass == pytest.approx(own.moments.mass, rel=1e-12)
    np.testing.assert_allclose(draft.moments.second[0, :, 0], own.moments.second[0, :, 0], rtol=1e-12)
    np.testing.assert_allclose(draft.moments.first, own.moments.first, atol=1e-9)
    assert set(draft.markers) == set(own.markers) and draft.kinds == own.kinds
    for name, marker in own.markers.items():
        for key in ("position", "phi", "psi"):
            np.testing.assert_array_equal(getattr(draft.markers[name], key), getattr(marker, key))
    np.testing.assert_array_equal(draft.skin.shapes, own.skin.shapes)
    expected, found = rest_modes(craft(own, root)), rest_modes(craft(draft, root))
    np.testing.assert_array_equal(found.elastic, expected.elastic)
    assert found.elastic.sum() >= 5
    np.testing.assert_allclose(found.omega, expected.omega, rtol=1e-7, atol=1e-6)


def test_a_draft_is_undamped_and_has_no_strain_to_recover():
    structure = panel()
    draft = small_motion_body(structure, cantilever_modes(structure, "left", 2))
    assert not draft.damping.any() and not draft.strain_field and draft.strain.is_linear
