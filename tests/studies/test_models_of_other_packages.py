"""A linear model as that of the package python-control: its matrices and names, all of them."""

from __future__ import annotations

import sys
from types import SimpleNamespace

import numpy as np
import pytest

from femflex.studies.linear.space import StateSpace


def test_a_model_is_handed_over_with_all_its_matrices_and_names(monkeypatch: pytest.MonkeyPatch):
    package = SimpleNamespace(ss=lambda *matrices, **names: {"m": matrices, **names})
    monkeypatch.setitem(sys.modules, "control", package)
    A, B, C, D = np.array([[1.0, 2], [3, 4]]), np.array([[5.0], [6]]), np.array([[7.0, 8]]), np.array([[9.0]])
    names = ((("a.x", "m"), ("b", "1")), (("in.f", "N"),), (("out.d", "m"),))
    made = StateSpace(A, B, C, D, *names).to_control()
    assert all(one is other for one, other in zip(made["m"], (A, B, C, D), strict=True))
    assert (made["states"], made["inputs"], made["outputs"]) == (["a_x", "b"], ["in_f"], ["out_d"])
