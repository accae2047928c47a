"""Elastic motion of a craft about rest without integrating it: natural modes, and the answer to a motion of the bodies.

For judging sets of shapes. `rest_modes` are those of the initial configuration with no rates, linear strain, no loads,
no weight and no spin. With the bodies taken along as rigid (elastic coordinates zero) eq. (9) leaves the force
f(t) = Q - h - M du/dt over along the elastic coordinates, that of loops included. About the state at rest their answer
y follows

    M y'' + D y' + K y = Z^T f(t)

in directions Z that keep loops closed; joints answer along, so that M is that of the free craft. Mode by mode the
answer to a force that is linear between two instants is exact: loads count twice that come suddenly, once that come
slowly, and more where they come in time with a mode.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import eigh

from femflex.arrays import Array, BoolArray, IntArray
from femflex.dynamics.joints.places import body_places, prescribed_places
from femflex.dynamics.model import Model, compile_system
from femflex.dynamics.motion.freedoms import (
    elastic_places,
    free_directions,
    is_prescribed,
    least_multipliers,
    slack_of_loops,
)
from femflex.linear.equations import linearised, stiffness
from femflex.linear.rigid_motions import BodyMotion, body_motions
from femflex.system import Environment, Frame, LengthTable, System

ELASTIC = 0.01  # share of a motion's potential energy in the shapes of bodies, from which on it is an elastic mode
CLOSE = 0.01  # relative distance within which two frequencies are a pair
RIGID_BELOW = 1e-6  # frequency over that of the softest shape below which a motion is rigid
JUMP = 1e-6  # of the time: an interval so short stands for a jump of the force
JUMPED = 1e-3  # of the largest range of velocities of its unit: a jump; less is an error between two rows
NOISE = 1e-3  # of the amplitude of a mode: less vibration is an error of the accelerations
SMALLEST = 1e-7  # displacement of a body over its radius of gyration, and rate of a joint over the largest: rounding
DAMPED = 0.99  # of critical: modes damped more than that are taken to be so, for their answer hardly swings either


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
    K = stiffness(model, 0.0, rest, np.zeros(model.n_u))
    M, K = (Z.T @ A @ Z for A in (model.mass_matrix(0.0, rest), K))
    squares, phi = eigh((K + K.T) / 2, (M + M.T) / 2)
    phi_u = Z @ phi
    shapes = {place.name: phi_u[place.shapes_u] for place in body_places(system) if place.body.n_modes}
    energy = sum(
        (np.einsum("ik,ij,jk->k", y, system.bodies[name].strain.V1, y) for name, y in shapes.items()),
        np.zeros(len(squares)),
    )
    bodies = [system.bodies[name] for name in shapes]
    softest = min(((np.diag(b.strain.V1) / np.diag(b.moments.elastic_mass())).min() for b in bodies), default=0.0)
    squares = np.where(squares > RIGID_BELOW**2 * softest, squares, 0.0)
    elastic = (squares > 0.0) & (energy > ELASTIC * squares)
    moving = body_motions(model, rest)
    frames = {name: body.in_motions(phi_u) for name, body in moving.items()}
    return RestModes(np.sqrt(squares), elastic, shapes, system, frames)


def _undeformed(system: System) -> System:
    """The system with linear strain, undeformed, at rest, with nothing that pushes, pulls or spins it.

    Members that deploy have their first lengths.
    """
    linear = {name: body.with_linear_strain() for name, body in system.bodies.items()}
    reels = {f"{body.write.length}" for body in system.varying.values() if isinstance(body.write, LengthTable)}
    varying = {name: body for name, body in system.varying.items() if not isinstance(body.write, LengthTable)}
    effectors = tuple(effector for effector in system.effectors if f"{effector.name}.length" not in reels)
    frame = system.frame if system.orbit is not None else Frame("inertial")
    return replace(
        system, bodies=linear, loads=(), frame=frame, environment=Environment(), delta0={}, ddelta0={},
        reactions=False, sights=(), constraints=(), varying=varying, effectors=effectors,
    )  # fmt: skip


@dataclass(frozen=True, eq=False)
class ElasticResponse:
    """Elastic response of a system to a motion of its bodies, mode by mode.

    states   (n_t, n_x)  with the elastic coordinates and rates of the response
    omega    (m,)        natural frequencies of the modes [rad/s]
    peak     (m,)        largest amplitude of each mode, of mass 1 [kg^1/2 m]
    ringing  (m,)        time for which each mode vibrates, by its damping [s]
    shapes   body -> (n_modes, m) elastic coordinates of the modes
    shares   body -> (m,) largest vibration of each mode over the largest elastic displacement of the body [1]
    recoil   (m,)        largest angular rate that each mode gives a joint, over the largest one of the joint [1]

    The vibration that the initial state alone excites is in the states and peaks, but not in shares and recoil.
    """

    states: Array
    omega: Array
    peak: Array
    ringing: Array
    shapes: Mapping[str, Array]
    shares: Mapping[str, Array]
    recoil: Array


def elastic_response(model: Model, times: Array, states: Array, accelerations: Array) -> ElasticResponse:
    """The response that a motion excites, from the elastic coordinates and rates of model.x0.

    states (n_t, n_x) and accelerations (n_t, n_u): the motion of the bodies, elastic coordinates zero. Velocities may
    jump between two rows: the part that the accelerations do not explain acts as an impulse.

    Raises ValueError and LinAlgError where there are no linear equations about rest (see `linearised`).
    """
    t, rest = float(times[0]), model.at_rest(states[0, : model.n_q])
    linear = linearised(model, t, rest)
    # a latch that will lock counts as locked
    moving = ~np.isin(linear.free, [index for *_, index in prescribed_places(model.system)])
    M, D, K = (A[np.ix_(moving, moving)] for A in (linear.M, linear.D, linear.K))
    free, Z = linear.free[moving], linear.Z[:, moving]
    squares, phi = eigh((K + K.T) / 2, (M + M.T) / 2)
    omega, phi = np.sqrt(squares[squares > 0.0]), phi[:, squares > 0.0]
    damping = np.einsum("ik,ij,jk->k", phi, D, phi)
    u, steps = model.parts(states)[1], np.diff(times)[:, None]
    jumps = np.diff(u, axis=0) - steps * (accelerations[1:] + accelerations[:-1]) / 2
    jumps[np.abs(jumps) < JUMPED * _ranges(model, u)] = 0.0
    force, impulse = unmodelled_response(model, times, states, accelerations, np.vstack([jumps, np.zeros(model.n_u)]))
    qe, ue = elastic_places(model)
    start = np.zeros((2, model.n_u))
    start[:, ue] = model.x0[qe], model.x0[model.n_q + ue]
    modal = start[:, free] @ M @ phi
    excitation = omega, damping, times, force @ Z @ phi, impulse @ Z @ phi
    y, rate, swing = modal_response(*excitation, modal)
    if modal.any():
        swing = modal_response(*excitation, np.zeros_like(modal))[2]
    swing[damping > omega] = 0.0  # more than half the critical damping: it follows the force
    swing[swing < NOISE * np.abs(y).max(axis=0, initial=0.0)] = 0.0
    moved, out = Z @ phi, states.copy()
    out[:, qe], out[:, model.n_q + ue] = y @ moved[ue].T, rate @ moved[ue].T
    shapes, shares = dict[str, Array](), dict[str, Array]()
    for place in body_places(model.system):
        if n := place.body.n_modes:
            name, moments = place.name, place.body.moments
            shapes[name] = moved[place.shapes_u]
            Me = moments.elastic_mass()[:n, :n]
            size = np.sqrt(_squares(out[:, place.shapes_q].T, Me).max(initial=0.0))
            least = SMALLEST * np.sqrt(np.trace(moments.inertia()) / 2.0)
            share = swing * np.sqrt(_squares(shapes[name], Me)) / max(size, np.finfo(float).tiny)
            shares[name] = np.minimum(share, 1.0) if size > least else np.zeros_like(share)
    recoil = _recoil(model, u + rate @ moved.T, moved * (omega * swing))
    ringing = np.minimum(times[-1] - times[0], 2.0 / np.maximum(damping, np.finfo(float).tiny))
    return ElasticResponse(out, omega, np.abs(y).max(axis=0, initial=0.0), ringing, shapes, shares, recoil)


def _squares(x: Array, M: Array) -> Array:
    """x_k.M x_k (k,) of columns x (n, k), at least 0."""
    return np.maximum((x * (M @ x)).sum(axis=0), 0.0)


def _ranges(model: Model, u: Array) -> Array:
    """Largest range (n_u,) of the velocities u (n_t, n_u) that have the same unit as each one."""
    units = np.array([unit for _, unit in model.system.velocity_names()])
    ranges = np.ptp(u, axis=0)
    return np.array([ranges[units == unit].max(initial=0.0) for unit in units])


def _recoil(model: Model, u: Array, rates: Array) -> Array:
    """Largest share (m,) that the angular rates (n_u, m) of modes have in those of joints, u (n_t, n_u).

    The axes of a joint are taken together; joints that do not turn are left out.
    """
    share = np.zeros(rates.shape[1])
    joints: dict[str, list[int]] = {}
    for k, (name, unit) in enumerate(model.system.velocity_names()):
        if unit == "rad/s":
            joints.setdefault(name.rpartition(".")[0], []).append(k)
    sizes = {name: np.linalg.norm(u[:, rows], axis=1).max(initial=0.0) for name, rows in joints.items()}
    for name, rows in joints.items():
        if sizes[name] > SMALLEST * max(sizes.values()):
            share = np.maximum(share, np.linalg.norm(rates[rows], axis=0) / sizes[name])
    return np.minimum(share, 1.0)


def unmodelled_response(model: Model, times: Array, states: Array, rates: Array, jumps: Array) -> tuple[Array, Array]:
    """Forces, and impulses of jumps of velocities, on the elastic coordinates; each (n_t, n_u) [SI], 0 for joints."""
    force, impulse = np.zeros((2, len(times), model.n_u))
    ue, slack = elastic_places(model)[1], slack_of_loops(model.system)
    carrying = ~is_prescribed(model)
    carrying[ue] = False
    for row, impulse_row, t, x, rate, jump in zip(force, impulse, times, states, rates, jumps, strict=True):
        residuals = [model.residual(float(t), x, rate)]
        if jump.any():
            residuals.append(model.residual(float(t), x, rate + jump))
        if model.constraints is not None:  # what loops carry as the bodies move on stands in the rows of joints
            A = model.constraints.matrix(float(t), x)
            residuals = [
                residual - least_multipliers(A[:, carrying], residual[carrying], slack) @ A for residual in residuals
            ]
        row[ue], impulse_row[ue] = -residuals[0][ue], (residuals[0] - residuals[-1])[ue]
    return force, impulse


def modal_response(
    omega: Array, damping: Array, times: Array, force: Array, impulse: Array, start: Array
) -> tuple[Array, Array, Array]:
    """y and y' (n_t, m) of y'' + damping y' + omega^2 y = force, m modes, force (n_t, m) linear between the times.

    Third is the largest amplitude (m,) of the oscillation about the part of y that follows the force.
    impulse (n_t, m): of the interval that begins at each time, as it were at its end; start (2, m): both at times[0].
    """
    a = np.minimum(damping / 2.0, DAMPED * omega)
    b = np.sqrt(omega**2 - a**2)
    y, rate = np.empty_like(force), np.empty_like(force)
    y[0], rate[0] = start
    steps = np.diff(times)[:, None]
    slope = np.diff(force, axis=0) / np.maximum(steps, 1e-300) / omega**2
    before = force[:-1] / omega**2 - 2.0 * a * slope / omega**2  # the answer that grows with the force, at the ends
    after = before + slope * steps
    swing = np.zeros(len(omega))
    fading, cos, sin = np.exp(-a * steps), np.cos(b * steps), np.sin(b * steps)
    for k in range(len(steps)):
        z, w = y[k] - before[k], rate[k] - slope[k]
        v = (w + a * z) / b
        if steps[k, 0] > JUMP * (times[-1] - times[0]):
            swing = np.maximum(swing, np.hypot(z, v * b / omega))
        y[k + 1] = after[k] + fading[k] * (z * cos[k] + v * sin[k])
        rate[k + 1] = slope[k] + fading[k] * (w * cos[k] - (b * z + a * v) * sin[k]) + impulse[k]
    return y, rate, swing
