"""A cut body is drawn as one: points of its segments as deformations of the undeformed whole."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from femflex.body import Skin
from femflex.view.segments import whole_of, widened, widened_coordinates


def test_widened_shapes_put_every_point_where_the_segment_has_it():
    rng = np.random.default_rng(1)
    points, shapes = rng.normal(size=(7, 3)), rng.normal(size=(2, 7, 3))
    skin = Skin(points, {}, shapes)
    r, R = rng.normal(size=(4, 3)), rng.normal(size=(4, 3))
    C, whole = Rotation.random(4, random_state=2).as_matrix(), Rotation.random(4, random_state=3).as_matrix()
    delta = rng.normal(size=(4, 2))
    true = r[:, None] + np.einsum("tij,tpj->tpi", C, points + np.einsum("tk,kpj->tpj", delta, shapes))
    wide = widened(skin)
    local = wide.points + np.einsum("tk,kpj->tpj", widened_coordinates(r, C, delta, (R, whole)), wide.shapes)
    assert R[:, None] + np.einsum("tij,tpj->tpi", whole, local) == pytest.approx(true, abs=1e-12)


def test_an_undeformed_body_has_no_displacement():
    eye, zero = np.broadcast_to(np.eye(3), (1, 3, 3)), np.zeros((1, 3))
    assert not widened_coordinates(zero, eye, np.zeros((1, 6)), (zero, eye)).any()


def test_segments_are_told_by_their_names():
    names = {"boom", "boom.1", "boom.12", "hub"}
    assert [whole_of(name, names) for name in sorted(names)] == [None, "boom", "boom", None]
    assert whole_of("mast.1", names) is None
