"""The kernels as plain Python, and the compiled ones: the same numbers."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from support.short_runs import short_runs

TESTS = Path(__file__).parents[1]
SCRIPT = "import sys, numpy; from support.short_runs import short_runs; numpy.savez(sys.argv[1], **short_runs())"


def test_plain_python_gives_the_numbers_of_the_compiled_kernels(tmp_path):
    environment = {**os.environ, "NUMBA_DISABLE_JIT": "1", "OPENBLAS_NUM_THREADS": "1"}
    paths = [str(TESTS), str(TESTS.parent), environment.get("PYTHONPATH", "")]
    environment["PYTHONPATH"] = os.pathsep.join(paths)
    command = [sys.executable, "-c", SCRIPT, str(tmp_path / "plain.npz")]
    subprocess.run(command, env=environment, check=True, timeout=120)
    plain, compiled = np.load(tmp_path / "plain.npz"), short_runs()
    assert set(plain.files) == set(compiled)
    for name in compiled:
        # fused multiply-add and the order of sums: rounding, grown by the motion
        assert plain[name] == pytest.approx(compiled[name], rel=1e-11, abs=1e-11), name
