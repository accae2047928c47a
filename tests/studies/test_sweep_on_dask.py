"""A sweep on a local Dask cluster of two workers, one of which is killed on the way."""

from __future__ import annotations

import os
import signal

import numpy as np
import pytest

from femflex.studies.sweep import sweep

distributed = pytest.importorskip("distributed")

CASE = """
[run]
duration = "2 s"
samples = 11
[bodies.wheel]
kind = "rigid"
mass = "3 kg"
inertia = [2, 2, 2]
[[joints]]
kind = "revolute"
child = "wheel"
name = "axle"
[[loads]]
name = "motor"
body = "wheel"
torque = [0, 0, "4 N m"]
"""
STUDY = """
case = "spun.toml"
design = "random"
members = 24
seed = 4
[vary."bodies.wheel.inertia.2"]
between = ["1 kg m^2", "3 kg m^2"]
[outputs.speed]
channel = "bodies/wheel/rate"
component = "z"
"""


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore")
def test_killed_worker_loses_no_member(tmp_path):
    (tmp_path / "spun.toml").write_text(CASE)
    (tmp_path / "study.toml").write_text(STUDY)
    single_results = sweep(tmp_path / "study.toml", tmp_path / "alone.h5", workers=1)
    with distributed.LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster:
        first_worker = next(iter(cluster.workers.values()))
        killed: list[int] = []

        def watch(done: float) -> None:
            if done == 3.0:
                os.kill(first_worker.pid, signal.SIGKILL)
                killed.append(first_worker.pid)

        dask_results = sweep(
            tmp_path / "study.toml", tmp_path / "dask.h5", scheduler=cluster.scheduler_address, progress=watch
        )
    assert killed and not any(dask_results.problems)
    assert np.array_equal(dask_results.outputs["speed"], single_results.outputs["speed"])
