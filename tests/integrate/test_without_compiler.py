"""The kernels as plain Python, and the compiled ones: the same numbers, one compilation for all models."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from support.integrate_models import chain, oscillator, rigid_body

from femflex.integrate import Dop853, Esdirk4, GeneralizedAlpha

SCRIPT = """
import sys
import numpy as np
sys.path.insert(0, sys.argv[1])
from test_without_compiler import runs
np.savez(sys.argv[2], **runs())
"""


def runs():
    """Short runs of every compiled method over rotations, damping, breaks of rows and steps."""
    chained = chain(np.linspace(1, 2, 3), np.linspace(3, 1, 4), np.full(4, 0.02), cubic=0.4, force=0.7, w=1.3)
    body, start = rigid_body(spring=2.0), np.array([1.0, 0, 0, 0, 0.3, 1.0, 0.2])
    out = {}
    for method in (Dop853(rtol=1e-6, atol=1e-10), Esdirk4(rtol=1e-4), GeneralizedAlpha(rtol=1e-3)):
        times = np.linspace(0, 1.5, 6)
        out[f"{method.name}_chain"] = method.solve(chained, times, np.sin(np.arange(6.0))).states
        out[f"{method.name}_body"] = method.solve(body, times, start).states
    return out


def test_plain_python_gives_the_numbers_of_the_compiled_kernels(tmp_path):
    environment = {**os.environ, "NUMBA_DISABLE_JIT": "1", "OPENBLAS_NUM_THREADS": "1"}
    root = Path(__file__).parents[2]
    environment["PYTHONPATH"] = os.pathsep.join([str(root), environment.get("PYTHONPATH", "")])
    command = [sys.executable, "-c", SCRIPT, str(Path(__file__).parent), str(tmp_path / "plain.npz")]
    subprocess.run(command, env=environment, check=True, timeout=120)
    plain, compiled = np.load(tmp_path / "plain.npz"), runs()
    assert set(plain.files) == set(compiled)
    for name in compiled:
        # fused multiply-add and the order of sums: rounding, grown by the motion
        assert plain[name] == pytest.approx(compiled[name], rel=1e-11, abs=1e-11), name


@pytest.mark.skipif(os.environ.get("NUMBA_DISABLE_JIT", "0") == "1", reason="the compiler is off")
def test_one_compilation_serves_every_model():
    from femflex.integrate.dop853_kernel import fill

    for model in (oscillator(), chain(np.ones(1), np.ones(2))):
        Dop853().solve(model, np.array([0.0, 1.0]), [1.0, 0.0])
    assert len(fill.signatures) == 1
    assert fill.stats.cache_path
