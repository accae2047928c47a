"""Boundary-element data of floating bodies: files of Capytaine and WAMIT, and radiation as a passive state space."""

from femflex.hydrodynamics.data import WaveData
from femflex.hydrodynamics.files import read_wave_data
from femflex.hydrodynamics.radiation import Radiation, fitted

__all__ = ["Radiation", "WaveData", "fitted", "read_wave_data"]
