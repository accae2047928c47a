"""What the user composes: bodies, joints, loads, orbit and frame in one System."""

from femflex.system.attached import attached_moments, with_attached
from femflex.system.ball import ball_coordinates
from femflex.system.blocks import (
    StateSpace,
    allocation,
    attitude_feedback,
    block,
    gain,
    low_pass,
    momentum_management,
    notch,
    observer,
    pd,
    pid,
    pulses,
    state_space,
)
from femflex.system.cable import cable
from femflex.system.cable_chain import with_heavy_cable
from femflex.system.channel import Channel
from femflex.system.constraint import Nonholonomic, knife_edge, rolling_disc, velocity_rows
from femflex.system.controller import Controller
from femflex.system.effector import Effector, StateEvent
from femflex.system.environment import EARTH_J2, STANDARD_GRAVITY, Environment
from femflex.system.gimbals import coasting_gyro, control_moment_gyro
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
from femflex.system.law import Friction, Law
from femflex.system.length_table import LengthTable
from femflex.system.load import Load
from femflex.system.loop import Closure, closure
from femflex.system.moving_points import MovingPoints
from femflex.system.orbit import EARTH_RADIUS, MU_EARTH, Frame, Orbit
from femflex.system.profile import Profile
from femflex.system.segments import Part, Segments
from femflex.system.sensor import Sampling, Sensor, strain_sensor
from femflex.system.separation import separation_spring
from femflex.system.sight import Sight
from femflex.system.signal import signal
from femflex.system.spring import Spring
from femflex.system.stop import Stop
from femflex.system.system import System, assembled, started
from femflex.system.tabulated import TabulatedDamper, TabulatedSpring
from femflex.system.thruster import Supply, pulse_train, tank, tank_variation, thruster
from femflex.system.variation import Block, Variation
from femflex.system.wheel import coasting, reaction_wheel, unbalanced_rotor, with_wheel, without_axial_inertia

__all__ = [
    "EARTH_J2",
    "EARTH_RADIUS",
    "JOINTS",
    "MU_EARTH",
    "STANDARD_GRAVITY",
    "Block",
    "Channel",
    "Closure",
    "Controller",
    "Effector",
    "Environment",
    "Frame",
    "Friction",
    "Joint",
    "Latch",
    "Law",
    "LengthTable",
    "Load",
    "MovingPoints",
    "Nonholonomic",
    "Orbit",
    "Part",
    "Profile",
    "Sampling",
    "Segments",
    "Sensor",
    "Sight",
    "Spring",
    "StateEvent",
    "StateSpace",
    "Stop",
    "Supply",
    "System",
    "TabulatedDamper",
    "TabulatedSpring",
    "Threshold",
    "Variation",
    "allocation",
    "assembled",
    "attached_moments",
    "attitude_feedback",
    "ball_coordinates",
    "block",
    "cable",
    "closure",
    "coasting",
    "coasting_gyro",
    "control_moment_gyro",
    "cylindrical",
    "free",
    "gain",
    "knife_edge",
    "low_pass",
    "momentum_management",
    "notch",
    "observer",
    "pd",
    "pid",
    "prismatic",
    "pulse_train",
    "pulses",
    "reaction_wheel",
    "revolute",
    "rolling_disc",
    "separation_spring",
    "signal",
    "spherical",
    "started",
    "state_space",
    "strain_sensor",
    "tank",
    "tank_variation",
    "thruster",
    "turns",
    "unbalanced_rotor",
    "universal",
    "velocity_rows",
    "weld",
    "with_attached",
    "with_heavy_cable",
    "with_wheel",
    "without_axial_inertia",
]
