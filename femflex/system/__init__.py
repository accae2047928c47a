"""What the user composes: bodies, joints, loads, orbit and frame in one System."""

from femflex.system.channel import Channel
from femflex.system.constraint import Nonholonomic, knife_edge, rolling_disc, velocity_rows
from femflex.system.joint import (
    JOINTS,
    Joint,
    ball_coordinates,
    cylindrical,
    free,
    prismatic,
    revolute,
    spherical,
    universal,
    weld,
)
from femflex.system.load import Load
from femflex.system.loop import Closure, closure
from femflex.system.orbit import EARTH_RADIUS, MU_EARTH, Frame, Orbit
from femflex.system.spring import Spring
from femflex.system.system import System

__all__ = [
    "EARTH_RADIUS",
    "JOINTS",
    "MU_EARTH",
    "Channel",
    "Closure",
    "Frame",
    "Joint",
    "Load",
    "Nonholonomic",
    "Orbit",
    "Spring",
    "System",
    "ball_coordinates",
    "closure",
    "cylindrical",
    "free",
    "knife_edge",
    "prismatic",
    "revolute",
    "rolling_disc",
    "spherical",
    "universal",
    "velocity_rows",
    "weld",
]
