"""Effectors: what acts on bodies by a function and has states of its own. Each is one file, with its table and kernel.

Wheels, gyros, thrusters and tanks, cables, separation springs, distributed loads, signals; sensors and controllers.
"""

from femflex.effectors.blocks import (
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
from femflex.effectors.cable import Cable
from femflex.effectors.cable_chain import with_heavy_cable
from femflex.effectors.controllers import (
    Allocation,
    AttitudeFeedback,
    Gain,
    LinearSystem,
    LowPass,
    MomentumManagement,
    Notch,
    Observer,
    Pd,
    Pid,
    Pulses,
)
from femflex.effectors.distributed_load import DistributedLoad
from femflex.effectors.gyro import Gyro
from femflex.effectors.noun import EffectorNoun, MarkerPair, Mounted
from femflex.effectors.sensor import Sampling, Sensor, strain_sensor
from femflex.effectors.separation import Separation
from femflex.effectors.signal import Signal
from femflex.effectors.tank import Tank
from femflex.effectors.thruster import LevelTable, PulseTrain, Thruster
from femflex.effectors.wheel import Wheel, unbalanced_rotor

__all__ = [
    "Allocation",
    "AttitudeFeedback",
    "Cable",
    "DistributedLoad",
    "EffectorNoun",
    "Gain",
    "Gyro",
    "LevelTable",
    "LinearSystem",
    "LowPass",
    "MarkerPair",
    "MomentumManagement",
    "Mounted",
    "Notch",
    "Observer",
    "Pd",
    "Pid",
    "PulseTrain",
    "Pulses",
    "Sampling",
    "Sensor",
    "Separation",
    "Signal",
    "StateSpace",
    "Tank",
    "Thruster",
    "Wheel",
    "allocation",
    "attitude_feedback",
    "block",
    "gain",
    "low_pass",
    "momentum_management",
    "notch",
    "observer",
    "pd",
    "pid",
    "pulses",
    "state_space",
    "strain_sensor",
    "unbalanced_rotor",
    "with_heavy_cable",
]
