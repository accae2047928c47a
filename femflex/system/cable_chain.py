"""Cables with mass: point masses along a line, with tension between neighbours and no compression."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from femflex.body.rigid import rigid_body
from femflex.system.effector import Effector
from femflex.system.joint import Joint
from femflex.system.system import System

MAX_MASSES = 500


def with_heavy_cable(
    system: System,
    name: str,
    ends: tuple[tuple[str, str], tuple[str, str]],
    length: float,
    stiffness: float,
    mass_per_length: float,
    masses: int,
    places: ArrayLike,
    *,
    rates: ArrayLike | None = None,
    damping: float = 0.0,
) -> System:
    """The system with a cable between two markers that has mass: taut, or slack without any compression.

    ends       (body, marker) of both
    length     natural length L [m];  stiffness  EA [N];  mass_per_length  [kg/m];  damping  of the whole [N s/m]
    masses     number n of point masses of L m'/n each, at the middles of n equal parts of the cable: bodies NAME_1 to
               NAME_n, on three slides at the first marker. Errors fall as 1/n^2
    places     (n, 3) where they start, axes of the first marker, from it [m];  rates  [m/s], zero unless given

    Channels of effector NAME: tension [N] and tension_end [N], at the first and at the second marker; slack, part of
    the length. Raises ValueError for numbers that are not positive and for names that are taken.
    """
    for what, value, unit in (
        ("length", length, "m"),
        ("stiffness", stiffness, "N"),
        ("mass per length", mass_per_length, "kg/m"),
    ):
        if not (np.isfinite(value) and value > 0.0):
            raise ValueError(f"{what} of cable {name!r} is {value:g} {unit}; it must be positive")
    if not damping >= 0.0:
        raise ValueError(f"damping of cable {name!r} is {damping:g}; it must not be negative")
    if not 1 <= masses <= MAX_MASSES:
        raise ValueError(f"cable {name!r} has {masses} masses; give 1 to {MAX_MASSES}")
    r = np.asarray(places, float).reshape(masses, 3)
    v = np.zeros((masses, 3)) if rates is None else np.asarray(rates, float).reshape(masses, 3)
    names = [f"{name}_{k + 1}" for k in range(masses)]
    if clashes := [body for body in names if body in system.bodies]:
        raise ValueError(
            f"cable {name!r} adds a body {clashes[0]!r}, and there is one of that name; rename one of them"
        )
    spacing = length / masses
    point = rigid_body(mass_per_length * spacing, np.zeros((3, 3)))
    (parent, marker), slides = ends[0], np.eye(3)
    joints = [
        Joint(body, parent, parent_marker=marker, translations=slides, q0=r[k], u0=v[k], kind="general")
        for k, body in enumerate(names)
    ]
    natural = np.array([spacing / 2.0, *[spacing] * (masses - 1), spacing / 2.0])
    chain = Effector(
        name,
        "cable_chain",
        (ends[0], *((body, "origin") for body in names), ends[1]),
        channels={"tension": "N", "tension_end": "N", "slack": "1"},
        accounts=("energy", "dissipation"),
        exerts=("force",),
        parameters=np.concatenate([[float(masses + 1), stiffness, damping, length], natural]),
    )
    return replace(
        system,
        bodies={**system.bodies, **dict.fromkeys(names, point)},
        joints=(*system.joints, *joints),
        effectors=(*system.effectors, chain),
    )
