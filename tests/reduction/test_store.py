"""A body through a file and back, bit for bit; files that are none."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from support.reduction_examples import bent_boom

from femflex.body import Marker, StrainTensors, rigid_body
from femflex.reduction import Damping, cantilever_modes, load_body, reduce_structure, save_body


@pytest.fixture(scope="module")
def body():
    structure = bent_boom()
    made = reduce_structure(structure, cantilever_modes(structure, "start", 4), {"b/c %2F.x": "end"}, Damping(0.01))
    turned = Marker(np.ones(3), np.ones((3, 4)), np.zeros((3, 4)), np.eye(3)[[1, 2, 0]])
    omega = made.omega.copy()
    omega[2] = np.nan
    kinds = ("vibration", "vibration", "constraint", "vibration")
    rng = np.random.default_rng(5)
    strain = StrainTensors(made.strain.V1, rng.normal(size=4), rng.normal(size=20), rng.normal(size=35))
    return replace(made, strain=strain, markers={"zeta": turned, **made.markers}, omega=omega, kinds=kinds)


def identical_bytes(a, b):
    return a.dtype == b.dtype and a.shape == b.shape and a.tobytes() == b.tobytes()


def test_saved_body_is_loaded_bit_for_bit(body, tmp_path):
    found = load_body(save_body(tmp_path / "boom.h5", body))
    assert found.moments.mass == body.moments.mass
    pairs = [
        (found.moments.first, body.moments.first),
        (found.moments.second, body.moments.second),
        (found.strain.V1, body.strain.V1),
        (found.strain.f0, body.strain.f0),
        (found.strain.V2, body.strain.V2),
        (found.strain.V3, body.strain.V3),
        (found.damping, body.damping),
        (found.omega, body.omega),
        (found.skin.points, body.skin.points),
        (found.skin.shapes, body.skin.shapes),
    ]
    assert all(identical_bytes(a, np.ascontiguousarray(b)) for a, b in pairs)
    assert found.kinds == body.kinds
    assert list(found.markers) == list(body.markers)
    for name, marker in body.markers.items():
        for part in ("position", "phi", "psi", "orientation"):
            assert identical_bytes(getattr(found.markers[name], part), np.ascontiguousarray(getattr(marker, part)))
    assert list(found.skin.cells) == list(body.skin.cells)
    assert all(np.array_equal(found.skin.cells[kind], rows) for kind, rows in body.skin.cells.items())


def test_saved_rigid_body_without_skin_is_loaded(tmp_path):
    found = load_body(save_body(tmp_path / "hub.h5", rigid_body(3.0, np.diag([1.0, 2, 2.5]))))
    assert found.n_modes == 0 and found.skin is None and found.kinds == () and found.omega.shape == (0,)
    assert np.array_equal(found.moments.inertia(), np.diag([1.0, 2, 2.5]))
    assert list(found.markers) == ["origin"]
