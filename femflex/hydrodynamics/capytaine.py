"""NetCDF files of Capytaine (version 2 and later), which are HDF5 files."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from femflex.arrays import Array
from femflex.hdf5 import open_hdf5
from femflex.hydrodynamics.data import DOFS, WaveData
from femflex.reading import reading

ADVICE = "Write it by capytaine.io.xarray.export_dataset or by to_netcdf, in the NetCDF-4 format"


def read(path: Path, density: float, gravity: float) -> WaveData:
    """The data of a file. Raises ValueError for one that is not of one body with the six motions of a rigid one."""
    with open_hdf5(path, "NetCDF-4 file") as file, reading(path, "a dataset of Capytaine", ADVICE):
        missing = [name for name in ("omega", "added_mass", "radiation_damping", "radiating_dof") if name not in file]
        if missing:
            raise ValueError(f"it has no {missing[0]}")
        (rows, shapes), (columns, others) = _dofs(file, "influenced_dof"), _dofs(file, "radiating_dof")
        if shapes != others:
            columns = [*columns[:6], *(columns[6 + others.index(key)] for key in shapes if key in others)]
            if len(columns) != len(rows) or len(others) != len(shapes):
                raise ValueError(f"its influenced_dof are {shapes} beyond the six, and its radiating_dof {others}")
        omega = _numbers(file["omega"])
        finite = np.isfinite(omega) & (omega > 0.0)
        A = _over(file["added_mass"], ("omega", "influenced_dof", "radiating_dof"))[:, rows][:, :, columns]
        B = _over(file["radiation_damping"], ("omega", "influenced_dof", "radiating_dof"))[:, rows][:, :, columns]
        X, headings = np.zeros((finite.sum(), 0, len(rows)), complex), np.zeros(0)
        if "wave_direction" in file:
            headings = _numbers(file["wave_direction"])
            X = _excitation(file, rows)[finite]
        infinite = A[np.isinf(omega)]
        return WaveData(
            omega[finite],
            A[finite],
            B[finite],
            infinite[0] if len(infinite) else None,
            headings,
            X,
            _scalar(file, "rho", density),
            _scalar(file, "g", gravity),
            _stiffness(file, rows, columns),
            _optional(file, "disp_volume", "displaced_volume"),
            _optional(file, "center_of_buoyancy"),
            _optional(file, "center_of_mass"),
            tuple(shapes),
        )


def _dofs(file: Any, dimension: str) -> tuple[list[int], list[str]]:
    """Places of the six motions of a rigid body and of the others, and the names of the latter."""
    texts = [name.decode() if isinstance(name, bytes) else str(name) for name in file[dimension][()]]
    plain = [text.split("__")[-1].strip() for text in texts]
    names = [text.lower() for text in plain]
    if missing := [dof for dof in DOFS if names.count(dof) != 1]:
        raise ValueError(f"its {dimension} are {texts}, of which {names.count(missing[0])} are {missing[0].title()}")
    shapes = [k for k, name in enumerate(names) if name not in DOFS]
    return [*(names.index(dof) for dof in DOFS), *shapes], [plain[k] for k in shapes]


def _numbers(variable: Any) -> Array:
    return np.atleast_1d(np.asarray(variable[()], float))


def _scalar(file: Any, name: str, otherwise: float) -> float:
    return float(np.ravel(file[name][()])[0]) if name in file else otherwise


def _optional(file: Any, *names: str) -> Any:
    for name in names:
        if name in file:
            values = np.ravel(np.asarray(file[name][()], float))
            return float(values[0]) if values.size == 1 else values
    return None


def _dimensions(variable: Any) -> list[str]:
    """Names of the axes of a variable, by its dimension scales."""
    file = variable.file
    return [str(file[references[0]].name).rsplit("/", 1)[-1] for references in variable.attrs["DIMENSION_LIST"]]


def _over(variable: Any, axes: tuple[str, ...]) -> Any:
    """Values of a variable over these axes; others have one entry."""
    names, values = _dimensions(variable), variable[()]
    extra = [k for k, name in enumerate(names) if name not in axes]
    if any(values.shape[k] != 1 for k in extra) or not set(axes) <= set(names):
        raise ValueError(f"{variable.name.strip('/')} is over {names}; expected {list(axes)}")
    order = [names.index(name) for name in axes] + extra
    return np.transpose(values, order).reshape([values.shape[names.index(name)] for name in axes])


def _excitation(file: Any, rows: list[int]) -> Any:
    """X (n, h, m): Froude-Krylov and diffraction forces together, stored as real and imaginary parts."""
    parts = []
    for name in ("Froude_Krylov_force", "diffraction_force"):
        if name not in file:
            raise ValueError(f"it has wave directions and no {name}")
        variable = file[name]
        if variable.dtype.names:  # compound numbers
            plain = variable[()]
            values = plain[plain.dtype.names[0]] + 1j * plain[plain.dtype.names[1]]
            names = _dimensions(variable)
        else:
            names = _dimensions(variable)
            values = np.moveaxis(np.asarray(variable[()], float), names.index("complex"), 0)
            names = [key for key in names if key != "complex"]
            values = values[0] + 1j * values[1]
        order = [names.index(key) for key in ("omega", "wave_direction", "influenced_dof")]
        extra = [k for k in range(len(names)) if k not in order]
        shape = [values.shape[k] for k in order]
        parts.append(np.transpose(values, order + extra).reshape(shape)[:, :, rows])
    return parts[0] + parts[1]


def _stiffness(file: Any, rows: list[int], columns: list[int]) -> Any:
    if "hydrostatic_stiffness" not in file:
        return None
    return _over(file["hydrostatic_stiffness"], ("influenced_dof", "radiating_dof"))[rows][:, columns]
