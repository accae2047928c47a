"""What is said where the eigen-solver gives up."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import sparse
from scipy.sparse.linalg import ArpackError

from femflex.fem.eigen import shift_invert
from femflex.fem.eigen.shift_invert import ShiftInverted


def test_masses_many_orders_apart_are_named(monkeypatch):
    def gives_up(*_, **__):
        raise ArpackError(3)

    monkeypatch.setattr(shift_invert, "eigsh", gives_up)
    K, M = sparse.diags_array([2.0] * 30).tocsr(), sparse.diags_array(np.geomspace(1e-3, 1e26, 30)).tocsr()
    with pytest.raises(RuntimeError, match=r"no 3 lowest modes in 30 degrees .* from 0\.001 to 1e\+26 .* orders apart"):
        ShiftInverted(K, M, 0.0, lambda f: f / 2.0)._eigsh(3, lambda f: f / 2.0, seed=0, tolerance=0.0)
