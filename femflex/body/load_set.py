"""Sets of loads of a body that keep their direction in it."""

from __future__ import annotations

from dataclasses import dataclass

from femflex.arrays import Array


@dataclass(frozen=True, eq=False)
class LoadSet:
    """Forces and torques at markers of a body, and a force per mass of it, all along axes of the body frame.

    markers       k names; the first marker stays with the body frame
    forces        (k, 3)  [N]
    torques       (k, 3)  [N m]
    acceleration  (3,)    force per mass [m/s^2]
    """

    markers: tuple[str, ...]
    forces: Array
    torques: Array
    acceleration: Array
