"""Balanced wheels as gyrostats (THEORY section 6a).

State: the absolute axial momentum h = J_s (Om + a.omega) of the rotor, omega the rate of its marker, a its axis there.

    dh/dt = tau,    torque on the carrier  -tau a - omega x (h a),    tau = motor - friction

with J_s a a^T taken out of the carrier's inertia. This is the form of section 6a with the term J_s a (a.domega/dt)
moved into h, so that no acceleration is needed. h a turns with the marker and what the carrier receives is minus its
rate of change: the total angular momentum stays to rounding. The energy is h^2 / (2 J_s) beyond that of the carrier.
"""

from __future__ import annotations

import math

from femflex.arrays import Array
from femflex.dynamics.effectors.effector_functions import ACT
from femflex.kernels.compiled import inner
from femflex.kernels.entries import entry
from femflex.kernels.vectors import ZERO, cross, dot, load3, load9, scale, store3, sub, turn

# parameters, as femflex.system.wheel lays them
AXIS, INERTIA, GIVEN, COMMAND, SERVO, TORQUE, SPEED, TAPER, VISCOUS, COULOMB, CREEP = 0, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12
# what it sees of its one marker, and writes
ATTITUDE, RATE, INPUT = 3, 15, 18
ZDOT, CHANNEL = 6, 7
ENERGY, DISSIPATION, SUPPLIED, FLOW = 14, 15, 16, 17


@inner
def limited(value: float, limit: float) -> float:
    """The value between -most and most."""
    return min(limit, max(-limit, value))


@entry(ACT)
def wheel(t: float, seen: Array, z: Array, parameters: Array, out: Array) -> None:
    """A driven wheel. Channels: speed, motor, friction, saturated, momentum (3)."""
    p, J, h = parameters, parameters[INERTIA], z[0]
    axis, omega = turn(load9(seen, ATTITUDE), load3(p, AXIS)), load3(seen, RATE)
    absolute = h / J
    speed = absolute - dot(axis, omega)
    command = seen[INPUT] if p[GIVEN] > 0.0 else p[COMMAND]
    requested = p[SERVO] * J * (limited(command, p[SPEED]) - speed) if p[SERVO] > 0.0 else command
    motor = limited(requested, p[TORQUE])
    if motor * speed > 0.0:  # the limit of speed: the last part of it takes the torque to zero
        motor *= limited(max(0.0, (p[SPEED] - abs(speed)) / (p[TAPER] * p[SPEED])), 1.0)
    friction = p[VISCOUS] * speed
    if p[COULOMB] > 0.0:
        friction += p[COULOMB] * math.tanh(speed / p[CREEP])
    tau, momentum = motor - friction, scale(h, axis)
    store3(out, 0, ZERO)
    store3(out, 3, sub(cross(momentum, omega), scale(tau, axis)))
    out[ZDOT] = tau
    out[CHANNEL], out[CHANNEL + 1], out[CHANNEL + 2] = speed, motor, friction
    out[CHANNEL + 3] = 1.0 if abs(motor - requested) > 1e-12 * abs(requested) else 0.0
    store3(out, CHANNEL + 4, momentum)
    out[ENERGY], out[DISSIPATION] = 0.5 * h * absolute, friction * speed
    out[SUPPLIED], out[FLOW] = motor * speed, 0.0


@entry(ACT)
def rotor(t: float, seen: Array, z: Array, parameters: Array, out: Array) -> None:
    """A wheel that nothing drives or brakes: h is a constant. Channels: momentum (3)."""
    axis, omega = turn(load9(seen, ATTITUDE), load3(parameters, AXIS)), load3(seen, RATE)
    momentum = scale(parameters[INERTIA], axis)
    store3(out, 0, ZERO)
    store3(out, 3, cross(momentum, omega))
    store3(out, 6, momentum)
    for k in range(4):
        out[9 + k] = 0.0
