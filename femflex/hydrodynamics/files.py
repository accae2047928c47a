"""Files of wave data, by their suffix."""

from __future__ import annotations

from pathlib import Path

from femflex.hydrodynamics import capytaine, wamit
from femflex.hydrodynamics.data import WaveData


def read_wave_data(path: Path, density: float, gravity: float) -> WaveData:
    """The data of a file: Capytaine's NetCDF (.nc), or WAMIT's NAME.1 with NAME.3 and, if it is there, NAME.hst.

    density, gravity: those of the water, with which WAMIT's data get their units. Raises ValueError and OSError.
    """
    reader = capytaine.read if path.suffix == ".nc" else wamit.read
    data = reader(path, density, gravity).rising()
    if len(data.omega) < 2:
        raise ValueError(f"{path.name} has {len(data.omega)} frequencies; radiation needs several")
    return data
