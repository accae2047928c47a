"""Kernels are the same code in the process that compiles them and in all that load them."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

TOP = Path(__file__).resolve().parents[1]

TWO_KERNELS = """
import numpy as np
from numba import types
from femflex.kernels.compiled import inner, kernel

VECTOR = types.float64[::1]

@inner
def summed(x):
    total = 0.0
    for k in range(x.size):
        total += x[k] * x[k] / (1.0 + k)
    return total

@kernel(types.float64(VECTOR))
def first(x):
    return summed(x) + 1.0

@kernel(types.float64(VECTOR))
def second(x):
    return summed(x[1:]) * summed(x)

x = np.sin(np.arange(1000.0))
if __name__ == "__main__":
    hits = sum(first.stats.cache_hits.values()) + sum(second.stats.cache_hits.values())
    emitted = [
        part.library.codegen._engine.is_symbol_defined(part.fndesc.llvm_func_name) for part in summed.overloads.values()
    ]
    print(first(x).hex(), second(x).hex(), hits, sum(emitted), len(emitted))
"""

RUN_DIGEST = """
import hashlib
import numpy as np
from femflex.case import read_case
from femflex.pipeline.decisions import build_system
from femflex.dynamics import compile_system
from femflex.integrate import Dop853, Esdirk4
model = compile_system(build_system(read_case("cases/panel_slew.toml")))
times, digest = np.linspace(0, 4, 41), hashlib.sha256()
for method in (Dop853(), Esdirk4(rtol=1e-5)):
    states = method.solve(model, times, model.x0).states
    for array in (states, *model.observe(times, states).values()):
        digest.update(np.ascontiguousarray(array).tobytes())
print(digest.hexdigest())
"""


def run_python(folder: Path, *words: str) -> list[str]:
    """Words printed by a new process that stores its kernels in that folder."""
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(folder), "PYTHONPATH": str(TOP)}
    process = subprocess.run(
        [sys.executable, *words], env=environment, cwd=TOP, capture_output=True, text=True, check=True
    )
    return process.stdout.split()


@pytest.mark.slow
@pytest.mark.skipif(os.environ.get("NUMBA_DISABLE_JIT", "0") == "1", reason="the compiler is off")
def test_parts_shared_by_two_kernels_round_the_same_when_loaded(tmp_path):
    script = tmp_path / "shared_part.py"
    script.write_text(TWO_KERNELS)
    compiled, loaded = run_python(tmp_path, str(script)), run_python(tmp_path, str(script))
    assert compiled[:2] == loaded[:2]
    assert compiled[2:] == ["0", "0", "1"]  # nothing loaded; the part was translated and is no machine code of its own
    assert loaded[2:] == ["2", "0", "0"]


@pytest.mark.slow
def test_compiled_and_loaded_kernels_give_identical_runs(tmp_path):
    assert run_python(tmp_path, "-c", RUN_DIGEST) == run_python(tmp_path, "-c", RUN_DIGEST)
