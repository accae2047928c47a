"""The extras of the package, and what is said where one is missing."""

from __future__ import annotations

from collections.abc import Mapping
from importlib.util import find_spec

PACKAGES: Mapping[str, tuple[str, ...]] = {  # extra -> what it brings, by the names of import
    "view": ("pyvista", "vtkmodules", "matplotlib", "PIL", "av"),
    "report": ("plotly",),
    "tables": ("pyarrow", "xarray", "h5netcdf"),
    "xarray": ("xarray",),
    "control": ("control",),
    "matrices": ("pyyeti",),
    "air": ("pymsis",),
    "sweep": ("distributed",),
    "fmi": ("pythonfmu3",),
    "orbits": ("sgp4",),
    "bsk": ("Basilisk",),
}


class MissingExtra(ImportError, ValueError):
    """A request needs packages that are not installed."""


def install_command(extra: str) -> str:
    """The command that installs an extra.

    >>> print(install_command("view"))
    pip install "femflex[view]"
    """
    return f'pip install "femflex[{extra}]"'


def require(extra: str, what: str, *packages: str) -> None:
    """Raise MissingExtra unless packages of an extra, by default all of them, are installed.

    what: what needs them, a plural such as "movies"
    """
    if any(find_spec(package) is None for package in packages or PACKAGES[extra]):
        raise MissingExtra(f"{what} need packages that are not installed: {install_command(extra)}")
