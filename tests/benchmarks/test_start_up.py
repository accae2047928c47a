"""Start-up times, the one thing asserted in seconds: help, and a second start of a run up to its first step."""

import subprocess
import sys
import time
from pathlib import Path

import pytest

CASE = Path(__file__).resolve().parents[2] / "cases" / "orbiter_beam.toml"
SECOND_START = """
import importlib, time
for name in ("pipeline", "pipeline.decisions", "dynamics", "integrate.dop853_kernel", "results"):
    importlib.import_module("femflex." + name)
from femflex import pipeline
begin = time.perf_counter()
ready = pipeline.prepare({case!r}, {output!r})
next(iter(ready.integrator.blocks(ready.model, ready.times[:2], ready.model.x0)))
print(time.perf_counter() - begin)
"""


def best_of(count, measure):
    return min(measure() for _ in range(count))


@pytest.mark.benchmark
def test_help_answers_within_half_a_second():
    def measure_seconds():
        begin = time.perf_counter()
        subprocess.run([sys.executable, "-m", "femflex", "--help"], check=True, stdout=subprocess.DEVNULL)
        return time.perf_counter() - begin

    spent = best_of(3, measure_seconds)
    print(f"\nfemflex --help: {spent:.2f} s")
    assert spent < 0.5


@pytest.mark.benchmark
def test_a_second_start_reaches_its_first_step_within_half_a_second_over_imports(tmp_path):
    code = SECOND_START.format(case=str(CASE), output=str(tmp_path / "run.h5"))

    def measure_seconds():
        return float(subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True).stdout)

    measure_seconds()  # compiles, should this be the first start
    spent = best_of(3, measure_seconds)
    print(f"\nsecond start to the first step, over imports: {spent:.2f} s")
    assert spent < 0.5
