"""What ten wheels and ten thrusters add to a right-hand side, in one process, per evaluation of the compiled loop."""

import time

import numpy as np
import pytest
from support.effector_builders import reaction_wheel, thruster
from support.hub_and_panels import femflex_model

from femflex.body import Marker
from femflex.dynamics import compile_system
from femflex.integrate import Dop853
from femflex.system import Controller

AT_MOST = 1.0  # of the right-hand side (1 us), what twenty effectors may add to it


def with_effectors(system, count):
    """The system with so many wheels and thrusters on its root body."""
    from dataclasses import replace

    root = system.root
    marker = Marker.at_position(np.array([0.3, 0.2, 0.1]), n_modes=system.bodies[root].n_shapes)
    body = replace(system.bodies[root], markers={**system.bodies[root].markers, "place": marker})
    axes = np.random.default_rng(1).normal(size=(2 * count, 3))
    wheels = [reaction_wheel(f"w{k}", root, 1e-6, marker="place", axis=axes[k], torque=1e-9) for k in range(count)]
    jets = [
        thruster(f"t{k}", root, 1e-9, marker="place", axis=axes[count + k], profile=([0.0], [1.0]))
        for k in range(count)
    ]
    return replace(system, bodies={**system.bodies, root: body}, effectors=(*wheels, *jets))


def per_evaluation(model):
    """CPU time of one evaluation [us]: the best of several runs."""
    best = np.inf
    ends = np.array([0.0, 5.0])
    method = Dop853(rtol=1e-9, atol=1e-9)
    for _ in range(5):
        begin = time.process_time()
        solution = method.solve(model, ends, model.x0)
        best = min(best, (time.process_time() - begin) / solution.steps.evaluations)
    return 1e6 * best


@pytest.mark.benchmark
def test_ten_wheels_and_ten_thrusters_add_at_most_a_microsecond():
    plain = femflex_model()
    with_all = compile_system(with_effectors(plain.system, 10))
    plain_time, full_time = per_evaluation(plain), per_evaluation(with_all)
    print(f"\nright-hand side {plain_time:.2f} us, with ten wheels and ten thrusters {full_time:.2f} us")
    assert full_time - plain_time < AT_MOST * plain_time


@pytest.mark.benchmark
def test_a_sampled_controller_adds_its_own_calls_alone():
    """Ten calls a second of a law that does nothing: measured against the same number of calls and restarts."""
    from dataclasses import replace

    plain = femflex_model()
    calls = []
    law = Controller("law", lambda t, s, m: (calls.append(t), (0.0, m))[1], 0.1, commands={"u": "1"})
    sampled = compile_system(replace(plain.system, effectors=(law,)))
    ends = np.array([0.0, 5.0])
    steps = Dop853(rtol=1e-6, atol=1e-6)
    spent = {}
    for name, model in (("plain", plain), ("sampled", sampled)):
        steps.solve(model, ends, model.x0)
        begin = time.process_time()
        spent[name] = steps.solve(model, ends, model.x0).steps.evaluations, time.process_time() - begin
    per_call = 1e6 * (spent["sampled"][1] - spent["plain"][1]) / 50
    print(f"\n{per_call:.0f} us per call, {spent['sampled'][0] - spent['plain'][0]} evaluations more")
    assert len(calls) == 100 and per_call < 1000
