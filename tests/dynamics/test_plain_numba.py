"""Kernels compiled by plain Numba, as where its inner interfaces are not the expected ones: the same numbers."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from support.random_systems import random_tree

from femflex import numba_interfaces
from femflex.dynamics import compile_system

TOP = Path(__file__).resolve().parents[2]
SCRIPT = """
import sys
import numpy as np
sys.path.insert(0, sys.argv[1])
from femflex.numba_interfaces import plain
from test_plain_numba import rates
assert plain()
assert "femflex.kernel_linking" not in sys.modules and "femflex.kernel_cache" not in sys.modules
np.save(sys.argv[2], rates())
"""


def rates():
    """Rates of a flexible tree, which no other call compiles for."""
    system, _, (q, u) = random_tree(2)
    return compile_system(system).state_rate(0.3, np.concatenate([q, u]))


@pytest.mark.slow
def test_plain_numba_gives_the_same_rates(tmp_path):
    environment = {
        **os.environ,
        "FEMFLEX_PLAIN_NUMBA": "1",
        "PYTHONPATH": os.pathsep.join([str(TOP), str(TOP / "tests")]),
    }
    command = [sys.executable, "-c", SCRIPT, str(Path(__file__).parent), str(tmp_path / "rates.npy")]
    subprocess.run(command, env=environment, check=True, timeout=600)
    expected = rates()
    assert np.load(tmp_path / "rates.npy") == pytest.approx(expected, rel=1e-12, abs=1e-12 * np.abs(expected).max())


def test_what_is_missing_of_numba_is_told(monkeypatch):
    monkeypatch.delenv("FEMFLEX_PLAIN_NUMBA", raising=False)
    missing = numba_interfaces.missing.__wrapped__
    assert missing() == ""
    monkeypatch.setitem(numba_interfaces.NEEDED, "numba.core.caching", (("_Cache", ("remember",)),))
    assert missing() == "numba.core.caching._Cache.remember"
    monkeypatch.setitem(numba_interfaces.NEEDED, "numba.core.nowhere", ())
    assert missing() == "numba.core.caching._Cache.remember"
    monkeypatch.setenv("FEMFLEX_PLAIN_NUMBA", "1")
    assert missing() == "FEMFLEX_PLAIN_NUMBA"
