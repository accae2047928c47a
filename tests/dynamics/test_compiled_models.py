"""Compiled equations: the numbers of plain Python and of plain Numba, one model in many threads, cost per body."""

import os
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from support.random_systems import random_body
from support.random_table import SYSTEMS, answers

from femflex.dynamics import compile_system
from femflex.integrate import integrator
from femflex.system import System, revolute

TOP = Path(__file__).resolve().parents[2]
SCRIPT = """
import sys
import numpy as np
from support.random_table import answers
np.savez(sys.argv[1], **answers(sys.argv[2:]))
"""
WAYS = {"python": {"NUMBA_DISABLE_JIT": "1"}, "numba": {"FEMFLEX_PLAIN_NUMBA": "1"}}


@pytest.mark.parametrize(
    ("way", "names"),
    [
        ("python", ["specified orbit", "many shapes", "condensed", "prescribed"]),
        pytest.param("numba", ["tree 1"], marks=pytest.mark.slow),
    ],
)
def test_plain_python_and_numba_give_the_numbers_of_compiled_equations(way, names, tmp_path):
    environment = {**os.environ, "OPENBLAS_NUM_THREADS": "1", **WAYS[way]}
    environment["PYTHONPATH"] = os.pathsep.join([str(TOP), str(TOP / "tests"), environment.get("PYTHONPATH", "")])
    command = [sys.executable, "-c", SCRIPT, str(tmp_path / "plain.npz"), *names]
    subprocess.run(command, env=environment, check=True, timeout=600)
    plain, compiled = np.load(tmp_path / "plain.npz"), answers(names)
    assert set(plain.files) == set(compiled)
    for name, values in compiled.items():
        size = 1.0 + np.abs(values).max(initial=0.0)
        assert plain[name] == pytest.approx(values, rel=1e-12, abs=1e-12 * size), name


@pytest.mark.parametrize("name", ["tree 1", "two loops", "effectors"])
def test_threads_share_a_model_and_get_the_bits_of_one(name):
    p, times = SYSTEMS[name](), np.linspace(0, 0.5, 400)

    def trajectory(method):
        states = integrator(method).solve(p.model, times, p.x).states
        return states, p.model.observe(times[::40], states[::40])

    methods = ("dop853", "esdirk4")
    alone = [trajectory(method) for method in methods]
    with ThreadPoolExecutor(4) as threads:
        together = list(threads.map(trajectory, methods * 3))
    for k, (states, seen) in enumerate(together):
        assert np.array_equal(states, alone[k % 2][0])
        assert all(np.array_equal(seen[path], alone[k % 2][1][path]) for path in seen)


def chain(n):
    """Links with ten shapes, each turning on the moving tip of the one before."""
    link, _ = random_body(np.random.default_rng(0), 10)
    names = [f"link{k}" for k in range(n)]
    joints = [revolute(names[0])]
    joints += [revolute(name, before, parent_marker="a") for before, name in pairwise(names)]
    return compile_system(System(dict.fromkeys(names, link), tuple(joints)))


def cost(model):
    """Least time of a hundred rates [s]."""
    x, dx, own = model.x0.copy(), np.empty(model.n_x), (model.table, model.pool, model.work)
    best = np.inf
    for _ in range(40):
        begin = time.perf_counter()
        for _ in range(100):
            model.rate(0.0, x, dx, *own)
        best = min(best, time.perf_counter() - begin)
    return best


@pytest.mark.benchmark
def test_cost_of_rate_grows_with_the_number_of_bodies():
    short, long = chain(8), chain(32)
    ratios = [cost(long) / cost(short) for _ in range(3)]
    print(f"\n32 links / 8 links = {np.median(ratios):.2f}")
    assert np.median(ratios) <= 4.5
