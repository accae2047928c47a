"""The cost of a right-hand side grows no faster than the number of bodies."""

import time
from itertools import pairwise

import numpy as np
import pytest
from support.random_systems import random_body

from femflex.dynamics import compile_system
from femflex.system import System, revolute


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
def test_thirty_two_links_cost_at_most_four_and_a_half_times_eight():
    short, long = chain(8), chain(32)
    ratios = [cost(long) / cost(short) for _ in range(3)]
    print(f"\n32 links / 8 links = {np.median(ratios):.2f}")
    assert np.median(ratios) <= 4.5
