"""Small deploying systems that several tests take."""

import numpy as np

from femflex.body import rigid_body
from femflex.deployment import DeployingLine, deploying_line
from femflex.dynamics import compile_system
from femflex.integrate import integrator
from femflex.reduction.beams.beam_functions import bending_characteristic
from femflex.reduction.beams.uniform_beam import BeamFunctions
from femflex.system import Environment, System, free, weld

UNIT = DeployingLine(mass_per_length=1.0, EIy=1.0, EIz=1.0)
TIP = 1e-3  # initial deflection of the tip, of the first length

_first = bending_characteristic("clamped-free", 1)
_size = _first(np.ones(1))[0, 0]


def first_mode(xi):
    """The first clamped-free shape with a deflection TIP."""
    return TIP / _size * _first(xi)[:, 0]


def wall_beam(length, n=4, until=5.0, line=UNIT, tip=TIP, functions=None, **more):
    """A beam in x-y from a wall, bent in its first shape, coordinates at rest; characteristic functions."""
    functions = functions or BeamFunctions(y=n)
    body, variation, *_ = deploying_line(line, functions, length, until=until, **more)
    delta = np.zeros(body.n_modes)
    delta[0] = tip / body.marker("tip").phi[1, 0]
    return System({"beam": body}, (weld("beam", child_marker="root"),), varying={"beam": variation},
                  delta0={"beam": delta}, reactions=True)  # fmt: skip


def solved(system, times, rtol=1e-10, method="dop853"):
    """Model, states and channels of a system at times."""
    model = compile_system(system)
    states = integrator(method, rtol=rtol, atol=1e-14).solve(model, times, model.x0).states
    return model, states, model.observe(times, states)


def hub_with_arms(arms, rate=(0.0, 0.0, 0.5), until=6.0, mass=20.0, inertia=(3.0, 4.0, 5.0), **more):
    """A free hub with deploying members: name -> (line, functions, length, keywords); each at its own root."""
    bodies, joints, varying, delta = {"hub": rigid_body(mass, np.diag(inertia))}, [], {}, {}
    joints.append(free("hub", u0=np.concatenate([np.zeros(3), rate])))
    for name, (line, functions, length, options) in arms.items():
        bodies[name], varying[name], *_ = deploying_line(line, functions, length, until=until, **options)
        joints.append(weld(name, "hub"))
        n = bodies[name].n_modes
        delta[name] = 0.05 / (1 + np.arange(n)) ** 2
    return System(bodies, tuple(joints), varying=varying, delta0=delta, **more)


def falling_chain(reel, gravity=9.81, tip_mass=0.0, **more):
    """A chain along -z out of a heap that lies on a ledge."""
    line = DeployingLine(mass_per_length=2.0, direction=(0, 0, -1))
    made = deploying_line(line, None, reel, stock=100.0, **more)
    bodies, joints = {"chain": made.body}, [weld("chain")]
    if tip_mass:
        bodies["weight"] = rigid_body(tip_mass, 1e-6 * np.eye(3))
        joints.append(weld("weight", "chain", parent_marker="tip"))
    return System(bodies, tuple(joints), varying={"chain": made.variation}, effectors=(reel.effector(),),
                  environment=Environment(np.array([0, 0, -gravity])))  # fmt: skip
