"""Thrusters, and the tanks that they draw from.

A thruster pushes with F along d, fixed in its marker. Mass leaves at |mdot| = F / c (c the exit velocity). Where it
comes from a tank at another marker, it flows along a straight line from there to the nozzle:

    at the nozzle  F d - |mdot| w,      at the tank  - |mdot| w,  torque |mdot| k^2 omega_t,      w = v_e - v_t

where v_e and v_t are the velocities of nozzle and tank, and k^2 is the inertia of the propellant about its own centre
per mass. This is the balance of momentum and of angular momentum of craft, flow and exhaust together, with the momentum
|mdot| (e - t) of the flow: its Coriolis force -2 |mdot| omega x (e - t), and jet damping. Nothing of it depends on a
uniform translation. (In THEORY section 4, mdot (v_e + c) at the exit beside M_t u, mass leaves where it was stored; w
is zero then.) The momentum that the flow has is left out when it begins and ends.

The kinetic energy that the mass had in its tank leaves the model: it is taken off `supplied`.
"""

from __future__ import annotations

from femflex.arrays import Array
from femflex.dynamics.effectors.built_in.signals import step_of
from femflex.dynamics.effectors.effector_functions import ACT
from femflex.kernels.entries import entry
from femflex.kernels.vectors import ZERO, add, dot, load3, load9, scale, store3, sub, turn

# parameters of a thruster, as femflex.system.thruster lays them
DIRECTION, THRUST, EXIT, LAG, KIND, FEED, TANKED, GYRATION, COUNT, TABLE = 0, 3, 4, 5, 6, 7, 8, 9, 10, 11
BY_TABLE, CONTINUOUS, SWITCHED = 0.0, 1.0, 2.0  # kinds of command
SWITCH = 0.5  # a switched thruster is on above it


@entry(ACT)
def thruster(t: float, seen: Array, z: Array, parameters: Array, out: Array) -> None:
    """Markers: nozzle, then tank. Inputs: command, then feed. State: thrust, where it lags. Channels: thrust, flow."""
    p = parameters
    tanked = p[TANKED] > 0.0
    m = 2 if tanked else 1
    input_index = 18 * m
    level = 0.0
    if p[KIND] == BY_TABLE:
        n = int(p[COUNT])
        k = step_of(t, p, TABLE, n)
        level = p[TABLE + n + k] if k >= 0 else 0.0
    else:
        level = min(1.0, max(0.0, seen[input_index]))
        if p[KIND] == SWITCHED:
            level = 1.0 if level > SWITCH else 0.0
        input_index += 1
    feed = seen[input_index] if p[FEED] > 0.0 else 1.0
    thrust = p[THRUST] * level
    n_z = 0
    if p[LAG] > 0.0:
        out[6 * m] = (feed * thrust - z[0]) / p[LAG]
        thrust, n_z = z[0], 1
    thrust *= feed
    flow = thrust / p[EXIT] if p[EXIT] > 0.0 else 0.0
    force = scale(thrust, turn(load9(seen, 3 * m), load3(p, DIRECTION)))
    velocity = load3(seen, 12 * m)
    accounts, supplied = 6 * m + n_z + 2, 0.0
    if tanked:
        tank_velocity, rate = load3(seen, 12 * m + 3), load3(seen, 15 * m + 3)
        flowing = scale(-flow, sub(velocity, tank_velocity))
        force = add(force, flowing)
        store3(out, 3, flowing)
        store3(out, 6, ZERO)
        store3(out, 9, scale(flow * p[GYRATION], rate))
        energy_per_mass = dot(tank_velocity, tank_velocity) - p[GYRATION] * dot(rate, rate)
        supplied = dot(flowing, tank_velocity) - 0.5 * flow * energy_per_mass
    else:
        store3(out, 3, ZERO)
    store3(out, 0, force)
    out[accounts - 2], out[accounts - 1] = thrust, flow
    out[accounts], out[accounts + 1], out[accounts + 2] = 0.0, 0.0, supplied + dot(force, velocity)
    out[accounts + 3] = flow


@entry(ACT)
def tank(t: float, seen: Array, z: Array, parameters: Array, out: Array) -> None:
    """Inputs: the flows of its thrusters. States: mass, feed (1 while there is propellant), time of its end."""
    flow = 0.0
    for k in range(int(parameters[0])):
        flow += seen[k]
    out[0] = -flow * z[1]
