"""What the user composes: bodies, joints, loads, orbit and frame in one System."""

from femflex.system.acting import Context, with_effectors
from femflex.system.attached import attached_moments, with_attached
from femflex.system.ball import ball_coordinates
from femflex.system.channel import Channel
from femflex.system.constraint import (
    KnifeEdge,
    Nonholonomic,
    RollingDisc,
    VelocityRows,
    knife_edge,
    rolling_disc,
    velocity_rows,
)
from femflex.system.controller import Controller
from femflex.system.effector import Effector, StateEvent
from femflex.system.environment import EARTH_J2, EARTH_ZONALS, STANDARD_GRAVITY, Environment
from femflex.system.joint import Joint
from femflex.system.kinds import (
    JOINTS,
    cylindrical,
    free,
    prismatic,
    revolute,
    spherical,
    turns,
    universal,
    weld,
)
from femflex.system.latch import Latch, Threshold
from femflex.system.law import Friction, JointLaw, Law
from femflex.system.length_table import LengthTable, MovingPoints
from femflex.system.load import Load
from femflex.system.loop import Closure, closure
from femflex.system.orbit import EARTH_RADIUS, MU_EARTH, Frame, Orbit
from femflex.system.profile import Profile
from femflex.system.segments import Part, Segments
from femflex.system.sight import Sight
from femflex.system.spring import Spring
from femflex.system.stop import Stop
from femflex.system.system import System, assembled, started
from femflex.system.tabulated import TabulatedDamper, TabulatedSpring
from femflex.system.variation import Block, Variation

__all__ = [
    "EARTH_J2",
    "EARTH_RADIUS",
    "EARTH_ZONALS",
    "JOINTS",
    "MU_EARTH",
    "STANDARD_GRAVITY",
    "Block",
    "Channel",
    "Closure",
    "Context",
    "Controller",
    "Effector",
    "Environment",
    "Frame",
    "Friction",
    "Joint",
    "JointLaw",
    "KnifeEdge",
    "Latch",
    "Law",
    "LengthTable",
    "Load",
    "MovingPoints",
    "Nonholonomic",
    "Orbit",
    "Part",
    "Profile",
    "RollingDisc",
    "Segments",
    "Sight",
    "Spring",
    "StateEvent",
    "Stop",
    "System",
    "TabulatedDamper",
    "TabulatedSpring",
    "Threshold",
    "Variation",
    "VelocityRows",
    "assembled",
    "attached_moments",
    "ball_coordinates",
    "closure",
    "cylindrical",
    "free",
    "knife_edge",
    "prismatic",
    "revolute",
    "rolling_disc",
    "spherical",
    "started",
    "turns",
    "universal",
    "velocity_rows",
    "weld",
    "with_attached",
    "with_effectors",
]


def __dir__() -> list[str]:
    """Public names, for completion."""
    return __all__
