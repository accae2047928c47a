"""Wave data as files of WAMIT and Capytaine."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from femflex.hydrodynamics import WaveData

NAMES = ["Surge", "Sway", "Heave", "Roll", "Pitch", "Yaw"]


def write_wamit(path: Path, data: WaveData) -> None:
    """Write NAME.1, NAME.3 and, where there is stiffness, NAME.hst, in the units of WAMIT with a length of 1 m."""
    rho, g, m = data.density, data.gravity, data.added_mass.shape[1]
    pairs = [(i, j) for i in range(m) for j in range(m)]
    one, three = [f"0.0 {i + 1} {j + 1} {data.infinite[i, j] / rho:.12e}" for i, j in pairs], []
    for k, w in enumerate(data.omega):
        period, A, B = f"{2 * np.pi / w:.14e}", data.added_mass[k] / rho, data.damping[k] / rho / w
        one += [f"{period} {i + 1} {j + 1} {A[i, j]:.12e} {B[i, j]:.12e}" for i, j in pairs]
        for h, heading in enumerate(np.degrees(data.headings)):
            for i in range(m):
                x = np.conj(data.excitation[k, h, i]) / (rho * g)  # by exp(+i omega t)
                numbers = f"{abs(x):.12e} {np.degrees(np.angle(x)):.12e} {x.real:.12e} {x.imag:.12e}"
                three.append(f"{period} {heading} {i + 1} {numbers}")
    path.with_suffix(".1").write_text("\n".join(one))
    path.with_suffix(".3").write_text("\n".join(three))
    if data.stiffness is not None:
        rows = [f"{i + 1} {j + 1} {data.stiffness[i, j] / rho / g:.12e}" for i, j in pairs]
        path.with_suffix(".hst").write_text("\n".join(rows))


def write_capytaine(path: Path, data: WaveData) -> None:
    """Write a dataset as Capytaine does, its motions not in the usual order; needs xarray and h5netcdf."""
    import xarray

    order = [2, 0, 1, 5, 4, 3, *range(6, data.added_mass.shape[1])[::-1]]
    names = [*NAMES, *data.shapes]
    omega = np.append(data.omega, np.inf)
    A = np.concatenate([data.added_mass, data.infinite[None]])[:, order][:, :, order]
    B = np.concatenate([data.damping, np.zeros_like(data.damping[:1])])[:, order][:, :, order]
    X = np.concatenate([data.excitation, np.zeros_like(data.excitation[:1])])[:, :, order]
    parts, axes = np.stack([X.real, X.imag]), ("omega", "radiating_dof", "influenced_dof")
    forces = ("complex", "omega", "wave_direction", "influenced_dof")
    variables = {
        "added_mass": (axes, A), "radiation_damping": (axes, B), "Froude_Krylov_force": (forces, 0.25 * parts),
        "diffraction_force": (forces, 0.75 * parts), "rho": ((), data.density), "g": ((), data.gravity),
    }  # fmt: skip
    if data.stiffness is not None:
        variables["hydrostatic_stiffness"] = (axes[2:] + axes[1:2], data.stiffness[order][:, order])
    coordinates = {
        "omega": omega, "wave_direction": data.headings, "radiating_dof": [names[k] for k in order],
        "influenced_dof": [names[k] for k in order], "complex": ["re", "im"],
    }  # fmt: skip
    xarray.Dataset(variables, coordinates).to_netcdf(path, engine="h5netcdf")
