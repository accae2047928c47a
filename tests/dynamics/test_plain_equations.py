"""The equations as plain Python, without the compiler, and the compiled ones: the same numbers."""

import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from support.prescribed_systems import held_tree
from support.random_systems import random_body, random_tree

from femflex.body.symmetric import packed_size
from femflex.dynamics import compile_system
from femflex.system import Frame, Friction, Load, Orbit, Stop, TabulatedDamper, TabulatedSpring, spherical

SCRIPT = """
import sys
import numpy as np
sys.path.insert(0, sys.argv[1])
from test_plain_equations import answers
np.savez(sys.argv[2], **answers())
"""


def systems():
    """A free tree with springs and loads, and one on an orbit; some bodies have more shapes than a lane holds."""
    rng = np.random.default_rng(6)
    for seed, more in ((1, {}), (4, {"root": spherical, "orbit": Orbit(7e6, 0.3, mu=5e20), "frame": Frame("orbital")})):
        system, _, (q, u) = random_tree(seed, n_bodies=4, **more)
        joints = tuple(replace(j, stiffness=rng.uniform(1, 2, j.n_u), damping=np.ones(j.n_u)) for j in system.joints)
        last = system.order[-1]
        bodies = {**system.bodies, last: random_body(rng, 6)[0]}
        bodies[last] = curved(bodies[last], rng)
        grown = 6 - system.bodies[last].n_modes
        loads = (Load("push", last, "a", "marker", force=rng.normal(size=3), torque=rng.normal(size=3)),)
        system = replace(system, joints=joints, bodies=bodies, loads=loads)
        yield system, np.r_[q, 0.1 * rng.normal(size=grown)], np.r_[u, 0.1 * rng.normal(size=grown)]

    yield led()


def led():
    """A tree with held freedoms and laws."""
    system, _, (q, u) = held_tree(5, n_bodies=4)
    laws = (
        TabulatedSpring(stretch=[-1, 0, 2], resisting=[-1, 0, 5]),
        TabulatedDamper(rate=[-1, 0, 2], resisting=[-1, 0, 5]),
        Stop(lower=-0.1, upper=0.1, stiffness=20.0, damping=1.0, width=0.05),
        Friction(limit=0.5, velocity=0.1),
    )
    k = next(k for k, j in enumerate(system.joints) if j.ball is None and j.n_u > len(j.held))
    joint = system.joints[k]
    freedom = next(i for i in range(joint.n_u) if i not in joint.held)
    joints = list(system.joints)
    joints[k] = replace(joint, laws=tuple(replace(law, freedom=freedom) for law in laws))
    return replace(system, joints=tuple(joints)), q, u


def curved(body, rng):
    """The body with nonlinear strain."""
    V2, V3 = (rng.normal(size=packed_size(body.n_modes, degree)) for degree in (3, 4))
    return replace(body, strain=replace(body.strain, V2=V2, V3=V3))


def answers():
    """Everything a model computes, at one state of each system."""
    out = {}
    for i, (system, q, u) in enumerate(systems()):
        model, x = compile_system(system), np.concatenate([q, u])
        own = (model.table, model.pool, model.work)
        solved, moved = np.empty(model.n_u), np.empty(model.n_q)
        model.second_order.solve(0.2, q, u, solved, 2.0, 0.3, 0.7, *own)
        model.second_order.advance(q, u, moved, *own)
        out |= {f"{i}/rate": model.state_rate(0.2, x), f"{i}/residual": model.residual(0.2, x, np.cos(u))}
        out |= {f"{i}/solve": solved, f"{i}/advance": moved}
        out |= {f"{i}/{path}": v for path, v in model.observe(np.array([0.2]), x[None]).items()}
    return out


def test_plain_python_gives_the_numbers_of_the_compiled_equations(tmp_path):
    environment = {**os.environ, "NUMBA_DISABLE_JIT": "1", "OPENBLAS_NUM_THREADS": "1"}
    root = Path(__file__).parents[2]
    environment["PYTHONPATH"] = os.pathsep.join([str(root), str(root / "tests"), environment.get("PYTHONPATH", "")])
    command = [sys.executable, "-c", SCRIPT, str(Path(__file__).parent), str(tmp_path / "plain.npz")]
    subprocess.run(command, env=environment, check=True, timeout=120)
    plain, compiled = np.load(tmp_path / "plain.npz"), answers()
    assert set(plain.files) == set(compiled)
    for name, values in compiled.items():
        size = 1.0 + np.abs(values).max(initial=0.0)
        assert plain[name] == pytest.approx(values, rel=1e-12, abs=1e-12 * size), name
