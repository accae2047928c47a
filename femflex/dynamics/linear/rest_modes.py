"""Natural frequencies and shapes of a craft about rest, undamped and unloaded.

For judging sets of shapes: M and K are those of the initial configuration with no rates, linear strain, no loads, no
weight and no spin.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import eigh

from femflex.arrays import Array, BoolArray, IntArray
from femflex.body import FlexibleBody
from femflex.dynamics.linear.body_motions import BodyMotion, body_motions
from femflex.dynamics.linear.linearised import free_directions, multipliers, stiffness
from femflex.dynamics.lowering.layout import body_records
from femflex.dynamics.model import compile_system
from femflex.system import Environment, Frame, LengthTable, System

ELASTIC = 0.01  # share of a motion's potential energy in the shapes of bodies, from which on it is an elastic mode
CLOSE = 0.01  # relative distance within which two frequencies are a pair
RIGID_BELOW = 1e-6  # frequency over that of the softest shape below which a motion is rigid


@dataclass(frozen=True, eq=False)
class RestModes:
    """Natural motions of a craft about rest, ascending.

    omega   (n,)      [rad/s], 0 for rigid motions
    elastic (n,)      whether bodies deform in them
    shapes  body -> (n_modes, n) elastic coordinates, of motions of mass 1
    system  the craft that is at rest
    frames  body -> where its frame is, and how it moves in each motion
    """

    omega: Array
    elastic: BoolArray
    shapes: Mapping[str, Array]
    system: System
    frames: Mapping[str, BodyMotion]

    def relevant(self, count: int, band: float = 0.0) -> IntArray:
        """Numbers of the `count` lowest elastic modes, a close pair at the end whole, and of all below a band [Hz]."""
        numbers = np.flatnonzero(self.elastic)
        omega = self.omega[numbers]
        last = omega[:count].max(initial=0.0)
        return numbers[(omega <= (1.0 + CLOSE) * last) | (omega < 2.0 * np.pi * band)]


def rest_modes(system: System) -> RestModes:
    """The natural motions of a system."""
    system = _undeformed(system)
    model = compile_system(system)
    rest = model.at_rest(model.x0[: model.n_q])
    Z = free_directions(model, 0.0, rest)[1]
    K = stiffness(model, 0.0, rest, np.zeros(model.n_u), multipliers(model, 0.0, rest))
    M, K = (Z.T @ A @ Z for A in (model.mass_matrix(0.0, rest), K))
    squares, phi = eigh((K + K.T) / 2, (M + M.T) / 2)
    phi_u = Z @ phi
    records = dict(zip(system.order, body_records(model.table)[1:], strict=True))
    shapes = {name: phi_u[int(r["ue"]) + np.arange(int(r["n"]))] for name, r in records.items() if int(r["n"])}
    energy = sum(
        (np.einsum("ik,ij,jk->k", y, system.bodies[name].strain.V1, y) for name, y in shapes.items()),
        np.zeros(len(squares)),
    )
    softest = min((_softest(system.bodies[name]) for name in shapes), default=0.0)
    squares = np.where(squares > RIGID_BELOW**2 * softest, squares, 0.0)
    elastic = (squares > 0.0) & (energy > ELASTIC * squares)
    moving = body_motions(model, rest)
    frames = {name: body.in_motions(phi_u) for name, body in moving.items()}
    return RestModes(np.sqrt(squares), elastic, shapes, system, frames)


def _softest(body: FlexibleBody) -> float:
    """Lowest stiffness over mass among the coordinates of a body [1/s^2]."""
    mass = np.diag(body.moments.elastic_mass())
    return float((np.diag(body.strain.V1) / mass).min())


def _undeformed(system: System) -> System:
    """The system with linear strain, undeformed, at rest, with nothing that pushes, pulls or spins it.

    Members that deploy have their first lengths.
    """
    linear = {name: body.with_linear_strain() for name, body in system.bodies.items()}
    varying = {
        name: varying_body
        for name, varying_body in system.varying.items()
        if not isinstance(varying_body.write, LengthTable)
    }
    reels = {
        f"{varying_body.write.length}"
        for varying_body in system.varying.values()
        if isinstance(varying_body.write, LengthTable)
    }
    effectors = tuple(varying_body for varying_body in system.effectors if f"{varying_body.name}.length" not in reels)
    frame = system.frame if system.orbit is not None else Frame("inertial")
    return replace(
        system, bodies=linear, loads=(), frame=frame, environment=Environment(np.zeros(3)), delta0={}, ddelta0={},
        reactions=False, sights=(), constraints=(), varying=varying, effectors=effectors,
    )  # fmt: skip
