"""Effectors: what acts on bodies by a function and has states of its own. Each is one file, with its table and kernel.

Wheels, gyros, thrusters and tanks, cables, separation springs, distributed loads, signals; sensors and controllers.
"""

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
from femflex.effectors.heat.balance import HeatBalance
from femflex.effectors.heat.history import TemperatureHistory
from femflex.effectors.magnetic import EddyCurrents, MagneticDipole, TorqueRod
from femflex.effectors.noun import EffectorNoun, MarkerPair, Mounted
from femflex.effectors.sensor import Sampling, Sensor, strain_sensor
from femflex.effectors.separation import Separation
from femflex.effectors.signal import Signal
from femflex.effectors.surfaces.air_drag import AirDrag
from femflex.effectors.surfaces.earth_radiation import EarthRadiation
from femflex.effectors.surfaces.materials import Optical
from femflex.effectors.surfaces.solar_pressure import SolarPressure
from femflex.effectors.surfaces.surface import Surface
from femflex.effectors.surroundings.atmosphere import Atmosphere
from femflex.effectors.surroundings.magnetic_field import MagneticField
from femflex.effectors.surroundings.moon import Moon
from femflex.effectors.surroundings.nrlmsis import Nrlmsis
from femflex.effectors.surroundings.sun import Sun
from femflex.effectors.tank import Tank
from femflex.effectors.thruster import LevelTable, PulseTrain, Thruster
from femflex.effectors.water.water import Water
from femflex.effectors.water.wet_bodies import WetBody
from femflex.effectors.water.wet_members import WetMember
from femflex.effectors.wheel import Wheel, unbalanced_rotor

__all__ = [
    "AirDrag",
    "Allocation",
    "Atmosphere",
    "AttitudeFeedback",
    "Cable",
    "DistributedLoad",
    "EarthRadiation",
    "EddyCurrents",
    "EffectorNoun",
    "Gain",
    "Gyro",
    "HeatBalance",
    "LevelTable",
    "LinearSystem",
    "LowPass",
    "MagneticDipole",
    "MagneticField",
    "MarkerPair",
    "MomentumManagement",
    "Moon",
    "Mounted",
    "Notch",
    "Nrlmsis",
    "Observer",
    "Optical",
    "Pd",
    "Pid",
    "PulseTrain",
    "Pulses",
    "Sampling",
    "Sensor",
    "Separation",
    "Signal",
    "SolarPressure",
    "Sun",
    "Surface",
    "Tank",
    "TemperatureHistory",
    "Thruster",
    "TorqueRod",
    "Water",
    "WetBody",
    "WetMember",
    "Wheel",
    "strain_sensor",
    "unbalanced_rotor",
    "with_heavy_cable",
]


def __dir__() -> list[str]:
    """Public names, for completion."""
    return __all__
