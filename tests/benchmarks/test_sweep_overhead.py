"""What a member of a sweep costs beyond the steps of its run, and how much two workers save."""

import re
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from femflex.studies.sweep.member import Plan, member_values, run_member
from femflex.studies.sweep.sweep import plan_sweep
from femflex.worker_processes import usable_cores

DISPERSION = Path(__file__).parents[2] / "cases" / "studies" / "panel_dispersion.toml"
AT_MOST = 5.0  # ms of processor time of a member whose run is two rows
MEMBERS = 60


@pytest.mark.benchmark
def test_a_member_that_differs_in_numbers_costs_less_than_five_milliseconds():
    """The shipped dispersion with a run of 0.1 s: reading its values, checks, model, integrator, outputs."""
    table, plan = plan_sweep(DISPERSION)
    text = re.sub(r'duration = "60 s"', 'duration = "0.1 s"', plan.case_text)
    text = re.sub(r"(?ms)^\[(pictures|expect[^\]]*|study)\].*?(?=^\[|\Z)", "", text)
    short_plan = Plan(plan.sweep_text.replace('start = "10 s"', ""), text, plan.case_path)
    spent = []
    for k, values in enumerate(member_values(table)[:MEMBERS]):
        begin = time.thread_time()
        assert not run_member(short_plan, k, values).problem
        spent.append(1e3 * (time.thread_time() - begin))
    print(f"\n{np.median(spent[5:]):.2f} ms per member (least {min(spent):.2f}), the first {spent[0]:.0f}")
    assert np.median(spent[5:]) < AT_MOST


@pytest.mark.benchmark
@pytest.mark.skipif(usable_cores() < 2, reason="needs two cores")
def test_two_workers_are_at_least_1_8_times_as_fast_as_one(tmp_path):
    """The shipped dispersion of 500 runs by its command, start of the workers included."""
    spent = {}
    for workers in (1, 2):
        begin = time.perf_counter()
        command = [sys.executable, "-m", "femflex", "sweep", DISPERSION, "--workers", str(workers)]
        subprocess.run([*command, "-o", tmp_path / f"{workers}.h5"], check=True, stdout=subprocess.DEVNULL)
        spent[workers] = time.perf_counter() - begin
    print(f"\none worker {spent[1]:.1f} s, two {spent[2]:.1f} s: {spent[1] / spent[2]:.2f} times as fast")
    assert spent[1] / spent[2] >= 1.8
