"""Control-moment gyros: a rotor of constant axial momentum h in one or two gimbals.

The rotor's axis s turns with its gimbals at omega_s = omega + sum g_k dgamma_k. The rotor receives h omega_s x s, and
gives it back. Gimbals without inertia follow their rates exactly; the motor of gimbal k then gives
g_k . (omega_s x h s), less its reaction. A single gimbal with inertia J_g about its axis has the momentum
p = J_g (dgamma + g.omega) as a state, and a motor that follows the commanded rate:

    dp/dt = motor - g.(omega x h s),    torque on the carrier  -motor g - [omega_s x h s] across g - omega x (p g)
"""

from __future__ import annotations

import math

from femflex.arrays import Array
from femflex.dynamics.effectors.built_in.wheel import ATTITUDE, INPUT, RATE, limited
from femflex.dynamics.effectors.effector_functions import ACT
from femflex.kernels.compiled import inner
from femflex.kernels.entries import entry
from femflex.kernels.vectors import Vector, add, cross, dot, load3, load9, scale, store3, sub, turn

# parameters, as femflex.system.gimbals lays them
COUNT, MOMENTUM, GIMBAL_INERTIA, BANDWIDTH, OUTER, INNER, SPIN, OWN = 0, 1, 2, 3, 4, 7, 10, 13
# of each gimbal, from OWN: whether its command is an input, the constant command, gain of angles (0: rates), limits
N_OWN = 5
FROM_INPUT, CONSTANT, GAIN, MAX_RATE, MAX_TORQUE = 0, 1, 2, 3, 4


@inner
def rotated(v: Vector, axis: Vector, angle: float) -> Vector:
    """v turned about a unit vector."""
    c, s = math.cos(angle), math.sin(angle)
    return add(add(scale(c, v), scale(s, cross(axis, v))), scale((1.0 - c) * dot(axis, v), axis))


@inner
def commanded_rate(k: int, angle: float, input_index: int, seen: Array, p: Array) -> float:
    """Commanded rate of gimbal k within its limit."""
    offset = OWN + N_OWN * k
    command = seen[INPUT + input_index] if p[offset + FROM_INPUT] > 0.0 else p[offset + CONSTANT]
    if p[offset + GAIN] > 0.0:
        command = p[offset + GAIN] * (command - angle)
    return limited(command, p[offset + MAX_RATE])


@entry(ACT)
def gimbals(t: float, seen: Array, z: Array, parameters: Array, out: Array) -> None:
    """Channels: momentum (3), then rate and motor torque of each gimbal. States: angles, then p where it has one."""
    p, h = parameters, parameters[MOMENTUM]
    n, heavy = int(p[COUNT]), p[GIMBAL_INERTIA] > 0.0
    C, omega = load9(seen, ATTITUDE), load3(seen, RATE)
    outer = turn(C, load3(p, OUTER))
    inner_axis, spin = turn(C, load3(p, INNER)), turn(C, load3(p, SPIN))
    first = commanded_rate(0, z[0], 0, seen, p)
    second, spin = 0.0, rotated(spin, outer, z[0])
    if n == 2:
        inner_axis = rotated(inner_axis, outer, z[0])
        spin = rotated(spin, inner_axis, z[1])
        second = commanded_rate(1, z[1], int(p[OWN + FROM_INPUT]), seen, p)
    n_z = n + 1 if heavy else n
    channel = 6 + n_z
    energy = 0.0
    if heavy:
        inertia, axial_momentum = p[GIMBAL_INERTIA], z[n]
        rate = axial_momentum / inertia - dot(outer, omega)
        reaction_torque = h * dot(outer, cross(omega, spin))
        motor = limited(inertia * p[BANDWIDTH] * (first - rate) + reaction_torque, p[OWN + MAX_TORQUE])
        reaction = scale(h, cross(add(omega, scale(rate, outer)), spin))
        transverse = sub(reaction, scale(dot(outer, reaction), outer))
        push = add(add(scale(motor, outer), transverse), scale(axial_momentum, cross(omega, outer)))
        out[6 + n] = motor - reaction_torque
        first, first_motor, second_motor = rate, motor, 0.0
        momentum = add(scale(h, spin), scale(axial_momentum, outer))
        energy = 0.5 * axial_momentum * axial_momentum / inertia
    else:
        turning = add(omega, add(scale(first, outer), scale(second, inner_axis)))
        push = scale(h, cross(turning, spin))
        first_motor, second_motor = dot(outer, push), dot(inner_axis, push) if n == 2 else 0.0
        momentum = scale(h, spin)
    store3(out, 3, scale(-1.0, push))
    out[6] = first
    store3(out, channel, momentum)
    out[channel + 3], out[channel + 4] = first, first_motor
    accounts = channel + 5
    if n == 2:
        out[7] = second
        out[channel + 5], out[channel + 6] = second, second_motor
        accounts = channel + 7
    out[accounts] = energy
    out[accounts + 2] = first * first_motor + second * second_motor
