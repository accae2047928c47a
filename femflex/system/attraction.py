"""The central attraction of a system in orbit: by its gradient, or integrated over points of mass."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from femflex.body import FlexibleBody
from femflex.body.moments import points_of_moments
from femflex.system.length_table import LengthTable, MovingPoints
from femflex.system.system import System

LARGE_RATIO = (
    1e-4  # size over distance from the centre from which on the gradient of gravity is not enough: 680 m in low orbit
)


@dataclass(frozen=True)
class SystemSize:
    """Size of a system [m], its least distance from the centre of attraction [m], and the error of the gradient.

    error: the next term of the expansion over the gradient's, 3/2 size / radius for a line along the vertical.
    """

    size: float
    radius: float

    @property
    def ratio(self) -> float:
        """Size over radius."""
        return self.size / self.radius

    @property
    def error(self) -> float:
        """Part of the gravity gradient by which its linear form is wrong at the far end."""
        return 1.5 * self.ratio


def system_size(system: System, lengths: Mapping[str, float] | None = None) -> SystemSize | None:
    """The size of a system as it may stretch out, against its orbit; None without an orbit.

    lengths: of bodies whose length is free [m]; left out, those at the start
    """
    if system.orbit is None:
        return None
    sizes: dict[str, float] = {}
    for name in system.order:
        parent = system.joint_of(name).parent
        length = max(extent(system.bodies[name]), largest_length(system, name), (lengths or {}).get(name, 0.0))
        sizes[name] = (0.0 if parent is None else sizes[parent]) + length
    radius = system.orbit.semi_major_axis * (1.0 - system.orbit.eccentricity)
    return SystemSize(max(sizes.values()), radius)


def extent(body: FlexibleBody) -> float:
    """Largest distance from a body's origin of its markers, skin and points of mass [m]."""
    points = [marker.position for marker in body.markers.values()]
    if body.skin is not None:
        points.extend(body.skin.points)
    mass_points = points_of_moments(body.moments) if body.mass_points is None else body.mass_points
    points.extend(mass_points.rho)
    return float(np.linalg.norm(np.array(points), axis=1).max(initial=0.0))


def largest_length(system: System, name: str) -> float:
    """Largest length of a body that deploys [m], the upper bound of its table where it is free; 0 of others."""
    table = system.varying[name].write if name in system.varying else None
    return table.bounds[1] if isinstance(table, LengthTable) else 0.0


def free_members(system: System) -> list[str]:
    """Names of the bodies whose length is free."""
    tables = {name: variation.write for name, variation in system.varying.items()}
    return [name for name, table in tables.items() if isinstance(table, LengthTable) and isinstance(table.length, str)]


def is_integrated(system: System) -> bool:
    """Whether a system's central attraction is integrated over points of mass.

    Automatically it is for craft beyond LARGE whose flexible bodies have points of mass, as those of meshes do, and
    uniform members that deploy; free lengths count up to their stock. With "exact" bodies without points have six from
    their moments, which do not follow their shapes: energy is then kept to the second order alone. Other bodies whose
    mass varies with time have no points that move with it: with them it is not.
    """
    size = system_size(system, {name: _stock(system, name) for name in free_members(system)})
    if size is None or system.environment.attraction == "gradient":
        return False
    acting = {name: variation for name, variation in system.varying.items() if "mass" in variation.acting}
    if any(moving_points_of(system, name) is None for name in acting):  # refused before where "exact" is asked for
        return False
    if system.environment.attraction == "exact":
        return True
    # six points stand for the moments of a body without points of mass; they do not follow its shapes
    have_points = all(
        body.mass_points is not None or moving_points_of(system, name) is not None
        for name, body in system.bodies.items()
        if body.n_modes
    )
    return have_points and size.ratio > LARGE_RATIO


def moving_points_of(system: System, name: str) -> MovingPoints | None:
    """The points of mass that follow the length of a body; None of one that has no length, or none that are known."""
    variation = system.varying.get(name)
    if variation is None or "mass" not in variation.acting:
        return None
    return variation.write.points if isinstance(variation.write, LengthTable) else None


def _stock(system: System, name: str) -> float:
    table = system.varying[name].write
    return (table.stock or table.bounds[1]) if isinstance(table, LengthTable) else 0.0
