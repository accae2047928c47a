"""Springs and dampers of joints: forces on the joint's quasi-coordinates, and the energy they store."""

from __future__ import annotations

from femflex.arrays import Array, Record
from femflex.dynamics.lowering.layout import BALL_NONE, W_CPQ, W_TAU
from femflex.kernels.compiled import inner
from femflex.kernels.turns import vector_of, vector_tangent
from femflex.kernels.vectors import load9, solve3


@inner
def write_spring_forces(b: Record, q: Array, u: Array, pool: Array, work: Array) -> None:
    """Write the forces of joint springs and dampers on the joint's quasi-coordinates (n_u)."""
    tau = b["work"] + W_TAU
    free = b["n_slide"] + b["n_turn"]
    for k in range(free):
        stretch = q[b["q"] + k] - pool[b["rest"] + k]
        work[tau + k] = -pool[b["spring"] + k] * stretch - pool[b["damper"] + k] * u[b["u"] + k]
    if b["ball"] == BALL_NONE:
        return
    theta = vector_of(load9(work, b["work"] + W_CPQ))
    k, rest, c, v = b["spring"] + free, b["rest"] + free, b["damper"] + free, b["u"] + free
    pull = (
        -pool[k] * (theta[0] - pool[rest]),
        -pool[k + 1] * (theta[1] - pool[rest + 1]),
        -pool[k + 2] * (theta[2] - pool[rest + 2]),
    )
    torque = solve3(vector_tangent(theta), pull)  # V_theta dtheta/dt with dtheta/dt = T^-T omega
    for j in range(3):
        work[tau + free + j] = torque[j] - pool[c + j] * u[v + j]


@inner
def spring_energy(b: Record, q: Array, pool: Array, work: Array) -> float:
    """Energy stored in the joint's springs."""
    if not b["sprung"]:
        return 0.0
    free = b["n_slide"] + b["n_turn"]
    total = 0.0
    for k in range(free):
        total += 0.5 * pool[b["spring"] + k] * (q[b["q"] + k] - pool[b["rest"] + k]) ** 2
    if b["ball"] != BALL_NONE:
        theta = vector_of(load9(work, b["work"] + W_CPQ))
        for k in range(3):
            total += 0.5 * pool[b["spring"] + free + k] * (theta[k] - pool[b["rest"] + free + k]) ** 2
    return total
