"""Markers of a body in segments."""

from __future__ import annotations

import numpy as np
import pytest

from femflex.body import Marker, rigid_body
from femflex.system import Segments
from femflex.system.segments import FAR, NEAR


def test_a_marker_is_added_to_the_segment_of_another_and_takes_none_away():
    place = {name: Marker.rigid(np.array([x, 0.0, 0.0])) for name, x in (("root", 0.0), ("middle", 1.0), ("tip", 2.0))}
    ends = {NEAR: place["root"], FAR: place["tip"]}
    first = rigid_body(1.0, np.eye(3), markers={**ends, "root": place["root"]})
    second = rigid_body(1.0, np.eye(3), markers={**ends, "middle": place["middle"], "tip": place["tip"]})
    cut = Segments((first, second)).with_marker("camera", Marker.rigid(np.array([2.0, 0.1, 0.0])), "tip")
    assert set(cut.bodies[0].markers) == set(first.markers)
    assert set(cut.bodies[1].markers) == {*second.markers, "camera"}
    assert cut.holder("camera") == 1 and cut.marker("camera").position == pytest.approx([2.0, 0.1, 0.0])
    assert cut.marker("middle") is place["middle"]
