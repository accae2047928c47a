"""What the user composes: bodies, joints, loads, orbit and frame in one System."""

from femflex.system.ball import ball_coordinates
from femflex.system.channel import Channel
from femflex.system.joint import (
    JOINTS,
    Joint,
    cylindrical,
    free,
    prismatic,
    revolute,
    spherical,
    turns,
    universal,
    weld,
)
from femflex.system.law import Friction, Latch, Law, Stop, TabulatedDamper, TabulatedSpring
from femflex.system.load import Load
from femflex.system.orbit import EARTH_RADIUS, MU_EARTH, Frame, Orbit
from femflex.system.profile import Profile
from femflex.system.segments import Part, Segments
from femflex.system.system import System, assembled

__all__ = [
    "EARTH_RADIUS",
    "JOINTS",
    "MU_EARTH",
    "Channel",
    "Frame",
    "Friction",
    "Joint",
    "Latch",
    "Law",
    "Load",
    "Orbit",
    "Part",
    "Profile",
    "Segments",
    "Stop",
    "System",
    "TabulatedDamper",
    "TabulatedSpring",
    "assembled",
    "ball_coordinates",
    "cylindrical",
    "free",
    "prismatic",
    "revolute",
    "spherical",
    "turns",
    "universal",
    "weld",
]
