"""Blocks of controllers that run continuously."""

from __future__ import annotations

from femflex.arrays import Array
from femflex.effectors.wheel import limited
from femflex.kernels.entries import ACT, entry
from femflex.kernels.vectors import add, cross, load3, load9, scale, store3, sub, turn

INPUTS, STATES, OUTPUTS, SCALED, MATRICES = 0, 1, 2, 3, 4  # of a state-space block: sizes, then A, B, C, D, limits


@entry(ACT)
def state_space(t: float, seen: Array, z: Array, parameters: Array, out: Array) -> None:
    """dx/dt = A x + B u, y = C x + D u; each output stays within its limit, or all are scaled down together."""
    p = parameters
    n_u, n_x, n_y = int(p[INPUTS]), int(p[STATES]), int(p[OUTPUTS])
    A = MATRICES
    B = A + n_x * n_x
    C = B + n_x * n_u
    D = C + n_y * n_x
    limits = D + n_y * n_u
    for i in range(n_x):
        rate = 0.0
        for j in range(n_x):
            rate += p[A + n_x * i + j] * z[j]
        for j in range(n_u):
            rate += p[B + n_u * i + j] * seen[j]
        out[i] = rate
    share = 1.0
    for i in range(n_y):
        value = 0.0
        for j in range(n_x):
            value += p[C + n_x * i + j] * z[j]
        for j in range(n_u):
            value += p[D + n_u * i + j] * seen[j]
        out[n_x + i] = value
        if abs(value) > p[limits + i]:
            share = min(share, p[limits + i] / abs(value))
    for i in range(n_y):
        if p[SCALED] > 0.0:
            out[n_x + i] *= share
        else:
            out[n_x + i] = limited(out[n_x + i], p[limits + i])


@entry(ACT)
def attitude_feedback(t: float, seen: Array, z: Array, parameters: Array, out: Array) -> None:
    """Torque -P e - D omega + omega x (J omega + H) for the error e, rate omega and wheel momentum H, its inputs."""
    p = parameters
    e, omega = load3(seen, 0), load3(seen, 3)
    torque = sub(scale(-1.0, turn(load9(p, 1), e)), turn(load9(p, 10), omega))
    momentum = turn(load9(p, 19), omega)
    if p[0] > 0.0:
        momentum = add(momentum, load3(seen, 6))
    torque = add(torque, cross(omega, momentum))
    store3(out, 0, (limited(torque[0], p[28]), limited(torque[1], p[28]), limited(torque[2], p[28])))
