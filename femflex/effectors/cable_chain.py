"""Cables with mass: point masses along a line, with tension between neighbours and no compression.

    N_k = max(0, S_k + c L / l_k d_k') where d_k > l_k, else 0,    S_k = EA (d_k - l_k) / l_k

d_k is the distance of neighbours, l_k the natural length between them, L the sum of these.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from femflex.arrays import Array
from femflex.body.flexible import rigid_body
from femflex.effectors.cable import Cable
from femflex.kernels.entries import ACT, entry
from femflex.kernels.vectors import add, dot, load3, scale, store3, sub
from femflex.system.acting import ALONE, Context
from femflex.system.effector import Effector
from femflex.system.joint import Joint
from femflex.system.system import System

COUNT, STIFFNESS, DAMPING, TOTAL, LENGTHS = 0, 1, 2, 3, 4  # parameters


def with_heavy_cable(
    system: System, name: str, cable: Cable, places: ArrayLike, rates: ArrayLike | None = None, context: Context = ALONE
) -> System:
    """The system with a cable between two markers that has mass: taut, or slack without any compression.

    cable   its mass per length m' and its number n of masses are given, and its length L is constant: n point masses
            of L m'/n each, at the middles of n equal parts: bodies NAME_1 to NAME_n, on three slides at the marker of
            its parent. Errors fall as 1/n^2
    places  (n, 3) where they start, axes of that marker, from it [m];  rates  [m/s], zero unless given

    Channels of effector NAME: tension [N] and tension_end [N], at the first and at the second marker; slack, part of
    the length. Raises ValueError for a length that changes and for names that are taken.
    """
    if cable.length.profile is None or cable.length.table is not None or cable.mass_per_length is None:
        raise ValueError(
            "found a length that changes and mass_per_length; give a constant length, leave the mass out, or use a "
            "deploying member (family = 'tether')"
        )
    length, masses, ends = float(cable.profile(context)(0.0)[0]), cable.masses, cable.markers()
    r = np.asarray(places, float).reshape(masses, 3)
    v = np.zeros((masses, 3)) if rates is None else np.asarray(rates, float).reshape(masses, 3)
    names = [f"{name}_{k + 1}" for k in range(masses)]
    if clashes := [body for body in names if body in system.bodies]:
        raise ValueError(
            f"cable {name!r} adds a body {clashes[0]!r}, and there is one of that name; rename one of them"
        )
    spacing = length / masses
    point = rigid_body(cable.mass_per_length * spacing, np.zeros((3, 3)))
    (parent, marker), slides = ends[0], np.eye(3)
    joints = [
        Joint(body, parent, parent_marker=marker, translations=slides, q0=r[k], u0=v[k], kind="general")
        for k, body in enumerate(names)
    ]
    natural = np.array([spacing / 2.0, *[spacing] * (masses - 1), spacing / 2.0])
    chain = Effector(
        name,
        cable_chain,
        (ends[0], *((body, "origin") for body in names), ends[1]),
        channels={"tension": "N", "tension_end": "N", "slack": "1"},
        accounts=("energy", "dissipation"),
        exerts=("force",),
        parameters=np.concatenate([[float(masses + 1), cable.EA, cable.damping, length], natural]),
        kind="cable",
    )
    return replace(
        system,
        bodies={**system.bodies, **dict.fromkeys(names, point)},
        joints=(*system.joints, *joints),
        effectors=(*system.effectors, chain),
    )


@entry(ACT)
def cable_chain(t: float, seen: Array, z: Array, parameters: Array, out: Array) -> None:
    """Forces on the points. Channels: tension at the first and at the last end, slack part of the length."""
    p = parameters
    n = int(p[COUNT])
    m, slack = n + 1, 0.0
    velocities, channel = 12 * m, 6 * m
    for k in range(n):
        separation = sub(load3(seen, 3 * k + 3), load3(seen, 3 * k))
        d, length, tension = math.sqrt(dot(separation, separation)), p[LENGTHS + k], 0.0
        if d > length:
            e = scale(1.0 / d, separation)
            faster = dot(e, sub(load3(seen, velocities + 3 * k + 3), load3(seen, velocities + 3 * k)))
            elastic = p[STIFFNESS] * (d - length) / length
            tension = max(0.0, elastic + p[DAMPING] * p[TOTAL] / length * faster)
            store3(out, 3 * k, add(load3(out, 3 * k), scale(tension, e)))
            store3(out, 3 * k + 3, scale(-tension, e))
            out[channel + 3] += 0.5 * elastic * (d - length)
            out[channel + 4] += (tension - elastic) * faster
        else:
            slack += length / p[TOTAL]
        if k == 0:
            out[channel] = tension
        if k == n - 1:
            out[channel + 1] = tension
    out[channel + 2] = slack
