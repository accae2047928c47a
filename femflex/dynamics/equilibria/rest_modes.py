"""Natural frequencies and shapes of a craft about rest, undamped and unloaded; and what richer sets would change.

For judging sets of shapes: M and K are those of the initial configuration with no rates, linear strain, no loads, no
weight and no spin. By Rayleigh and Ritz every natural frequency of a set falls, or stays, as shapes are added, so that
the k-th of two sets of which one holds the other belong together.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike
from scipy.linalg import eigh

from femflex.arrays import Array, BoolArray, IntArray
from femflex.body import FlexibleBody, StrainTensors
from femflex.dynamics.equilibria.linearised import free_directions, multipliers, stiffness
from femflex.dynamics.lowering.layout import body_records
from femflex.dynamics.model import compile_system
from femflex.system import Environment, Frame, LengthTable, System

ELASTIC = 0.01  # share of a motion's potential energy in the shapes of bodies, from which on it is an elastic mode
CLOSE = 0.01  # relative distance within which two frequencies are a pair
STILL = 1e-6  # frequency over that of the softest shape below which a motion is rigid


@dataclass(frozen=True, eq=False)
class RestModes:
    """Natural motions of a craft about rest, ascending.

    omega   (n,)      [rad/s], 0 for rigid motions
    elastic (n,)      whether bodies deform in them
    shapes  body -> (n_modes, n) elastic coordinates, of motions of mass 1
    """

    omega: Array
    elastic: BoolArray
    shapes: Mapping[str, Array]

    def relevant(self, count: int, band: float = 0.0, excited: ArrayLike = ()) -> IntArray:
        """Numbers of the `count` lowest elastic modes, a close pair at the end whole, of all below a band [Hz], and of
        those within CLOSE of the excited frequencies (k,) [rad/s]."""
        numbers = np.flatnonzero(self.elastic)
        omega = self.omega[numbers]
        last = omega[:count].max(initial=0.0)
        near = (np.abs(omega[:, None] - np.asarray(excited, float)) <= CLOSE * omega[:, None]).any(axis=1)
        return numbers[(omega <= (1.0 + CLOSE) * last) | (omega < 2.0 * np.pi * band) | near]


def rest_modes(system: System, bodies: Mapping[str, FlexibleBody] | None = None) -> RestModes:
    """The natural motions of a system, some of its bodies in other sets if given."""
    system = _bare(system, bodies or {})
    model = compile_system(system)
    rest = model.at_rest(model.x0[: model.n_q])
    Z = free_directions(model, 0.0, rest)[1]
    K = stiffness(model, 0.0, rest, np.zeros(model.n_u), multipliers(model, 0.0, rest))
    M, K = (Z.T @ A @ Z for A in (model.mass_matrix(0.0, rest), K))
    squares, phi = eigh((K + K.T) / 2, (M + M.T) / 2)
    moved = Z @ phi
    records = dict(zip(system.order, body_records(model.table)[1:], strict=True))
    shapes = {name: moved[int(r["ue"]) + np.arange(int(r["n"]))] for name, r in records.items() if int(r["n"])}
    energy = sum(
        (np.einsum("ik,ij,jk->k", y, system.bodies[name].strain.V1, y) for name, y in shapes.items()),
        np.zeros(len(squares)),
    )
    softest = min((_softest(system.bodies[name]) for name in shapes), default=0.0)
    squares = np.where(squares > STILL**2 * softest, squares, 0.0)
    elastic = (squares > 0.0) & (energy > ELASTIC * squares)
    return RestModes(np.sqrt(squares), elastic, shapes)


def _softest(body: FlexibleBody) -> float:
    """Lowest stiffness over mass among the coordinates of a body [1/s^2]."""
    mass = np.diag(body.moments.elastic_mass())
    return float((np.diag(body.strain.V1) / mass).min())


def _bare(system: System, bodies: Mapping[str, FlexibleBody]) -> System:
    """The system with linear strain, undeformed, at rest, with nothing that pushes, pulls or spins it.

    Members that deploy have their first lengths.
    """
    linear = {name: bodies.get(name) or linear_body(body) for name, body in system.bodies.items()}
    varying = {name: one for name, one in system.varying.items() if not isinstance(one.write, LengthTable)}
    reels = {f"{one.write.length}" for one in system.varying.values() if isinstance(one.write, LengthTable)}
    effectors = tuple(one for one in system.effectors if f"{one.name}.length" not in reels)
    frame = system.frame if system.orbit is not None else Frame("inertial")
    return replace(
        system, bodies=linear, loads=(), frame=frame, environment=Environment(np.zeros(3)), delta0={}, ddelta0={},
        reactions=False, sights=(), constraints=(), varying=varying, effectors=effectors,
    )  # fmt: skip


def linear_body(body: FlexibleBody) -> FlexibleBody:
    """A body with linear strain, without the shapes that are slaved to others."""
    body = body.without_slaves()
    return replace(body, strain=StrainTensors.linear(body.strain.V1))


@dataclass(frozen=True, eq=False)
class Truncation:
    """Frequencies [Hz] (k,) of the lowest elastic modes of a craft with the shapes it keeps, and with richer sets."""

    kept: Array
    richer: Array

    @property
    def errors(self) -> Array:
        """(k,) by what part of the kept frequencies these are too high, below 1."""
        return np.asarray(1.0 - self.richer / self.kept)


def truncation(
    system: System, richer: RestModes, count: int = 3, band: float = 0.0, excited: ArrayLike = ()
) -> Truncation:
    """The frequencies of a craft's relevant modes (`RestModes.relevant`) with its own sets and with richer ones.

    richer: the `rest_modes` of the same system with its bodies in richer sets.
    """
    kept = rest_modes(system).omega
    numbers = richer.relevant(count, band, excited)
    numbers = numbers[numbers < len(kept)]
    return Truncation(kept[numbers] / (2.0 * np.pi), richer.omega[numbers] / (2.0 * np.pi))
