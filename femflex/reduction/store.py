"""Write a reduced body to an HDF5 file, under a temporary name until it is complete, and read it back bit for bit.

Layout: attributes `format` "femflex body", `format_version`, `femflex_version`, `kinds`; datasets with a `description`
and `units` each:

    moments/{mass, first, second}     strain/{V1, f0, V2, V3}     damping     omega     slaves (if any)
    markers/<name>/{position, phi, psi, orientation, axis, stretch}
    skin/{points, shapes}, skin/cells/<meshio cell name>         absent for a body that cannot be drawn
    ignored/{mass, at/<marker>}                                  where linear strain leaves it out
    mass_points/{dm, rho, moved}                                 of bodies that gravity is integrated over
    strain_field/<k>/{places, weight, rows, linear, quadratic, elastic, stress, first}   see femflex.body.strain_field
"""

from __future__ import annotations

import os
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from femflex.arrays import Array
from femflex.body import FlexibleBody, Foreshortening, Marker, MassMoments, Skin, StrainTensors
from femflex.body.moments import MassPoints
from femflex.body.strain_field import read_field, write_field
from femflex.hdf5 import atomic_hdf5, open_hdf5
from femflex.reading import reading

if TYPE_CHECKING:
    import h5py

FORMAT = "femflex body"
FORMAT_VERSION = 2  # 1: without V2 and V3

# name -> (description, units); units hold for mass-normalised shapes
FIELDS = {
    "mass": ("int dm", "kg"),
    "first": ("int z dm over z = (position, shapes), body frame", "kg m | kg^1/2"),
    "second": ("int z z^T dm, indices shape, axis, shape, axis", "kg m^2 | kg^1/2 m | 1"),
    "V1": ("stiffness of the elastic coordinates", "1/s^2"),
    "f0": ("elastic force at rest, int sigma0 B0", "kg^1/2 m/s^2"),
    "V2": ("cubic strain tensor, symmetric, packed over i <= j <= k; empty for linear strain", "kg^-1/2 m^-1/s^2"),
    "V3": ("quartic strain tensor, symmetric, packed over i <= j <= k <= l; empty likewise", "kg^-1 m^-2/s^2"),
    "slaves": ("A of the last, dependent shapes: their coordinates are y = 1/2 delta.A delta", "kg^-1/2 m^-1"),
    "damping": ("damping matrix of the elastic coordinates", "1/s"),
    "omega": ("natural frequency of each shape, nan where it has none", "rad/s"),
    "position": ("undeformed position, body frame", "m"),
    "phi": ("translation per elastic coordinate", "kg^-1/2"),
    "psi": ("small rotation per elastic coordinate", "kg^-1/2 m^-1"),
    "orientation": ("turns marker components into body components", "1"),
    "axis": ("of the beam whose section the marker is: psi then holds twist and sines of slopes; 0: no section", "1"),
    "stretch": (
        "static displacement by stretch in addition to the shapes, per field z_a e_b of force per mass",
        "s^2 | s^2 m",
    ),
    "points": ("undeformed points of the skin, body frame", "m"),
    "dm": ("masses of points of mass", "kg"),
    "rho": ("their undeformed places, body frame", "m"),
    "moved": ("their displacement per shape: point, axis, shape", "kg^-1/2"),
    "shapes": ("displacement of the skin's points per elastic coordinate: shape, point, axis", "kg^-1/2"),
}
MARKER = ("position", "phi", "psi", "orientation", "axis", "stretch")


def save_body(path: str | os.PathLike[str], body: FlexibleBody, force: bool = False) -> Path:
    """Write the body to an HDF5 file and return its path; an interrupted write leaves no file.

    Raises FileExistsError if the file exists already, unless force is given.
    """
    with atomic_hdf5(Path(path), force) as file:
        _write_body(file, body)
    return Path(path)


def load_body(path: str | os.PathLike[str]) -> FlexibleBody:
    """The FlexibleBody of a file that save_body wrote.

    Raises FileNotFoundError if there is no such file, ValueError if it is no femflex body or has a later format.
    """
    source = Path(path)
    with reading(source, "femflex body file", "Make one with `femflex body`."):
        file = open_hdf5(source, "body file")
    with file, reading(source, "femflex body file", "Make it again with `femflex body`."):
        file_format = file.attrs.get("format")
        if file_format != FORMAT:
            raise ValueError(
                f"{source} is not a femflex body file: its format is {file_format!r}. Make one with `femflex body`."
            )
        number = int(file.attrs["format_version"])
        if number > FORMAT_VERSION:
            raise ValueError(
                f"{source} has body format {number}, and this femflex reads up to {FORMAT_VERSION}; "
                "use a newer femflex, or make the body again."
            )
        try:
            return _read_body(file)
        except KeyError as error:
            raise ValueError(
                f"{source} is a femflex body file with parts missing: {error.args[0]}. Make it again."
            ) from error


def _write_body(file: h5py.File, body: FlexibleBody) -> None:
    file.attrs.update(format=FORMAT, format_version=FORMAT_VERSION, femflex_version=_version())
    file.attrs["frame"] = "body frame: the coordinates of the mesh the body was made from"
    file.attrs["kinds"] = list(body.kinds) if body.kinds else np.zeros(0, "S1")
    _write_dataset(file, "damping", body.damping)
    _write_dataset(file, "omega", body.omega)
    if len(body.slaves):
        _write_dataset(file, "slaves", body.slaves)
    _write_fields(file.create_group("moments"), body.moments, "mass", "first", "second")
    _write_fields(file.create_group("strain"), body.strain, "V1", "f0", "V2", "V3")
    markers = file.create_group("markers", track_order=True)
    for name, marker in body.markers.items():
        _write_fields(markers.create_group(_escaped(name)), marker, *MARKER)
    if body.skin is not None:
        skin = file.create_group("skin")
        _write_fields(skin, body.skin, "points", "shapes")
        cells = skin.create_group("cells", track_order=True)
        for kind, rows in body.skin.cells.items():
            cells.create_dataset(kind, data=rows)
    if body.foreshortening is not None:
        ignored = file.create_group("ignored")
        ignored.attrs["description"] = "foreshortening of the lowest shape over its stiffness, see body.Foreshortening"
        mass = ignored.create_dataset("mass", data=body.foreshortening.mass)
        mass.attrs["units"], mass.attrs["description"] = "s^2/m | s^2", "int z theta^T dm, z = (1, rho)"
        theta_group = ignored.create_group("at", track_order=True)
        for name, theta in body.foreshortening.at.items():
            dataset = theta_group.create_dataset(_escaped(name), data=theta)
            dataset.attrs["units"], dataset.attrs["description"] = "1/N", "theta at this marker"
    if body.mass_points is not None:
        points = file.create_group("mass_points")
        _write_dataset(points, "dm", body.mass_points.dm)
        _write_dataset(points, "rho", body.mass_points.rho)
        _write_dataset(points, "moved", body.mass_points.phi)
    write_field(file, body.strain_field)


def _read_body(file: h5py.File) -> FlexibleBody:
    moments, strain = file["moments"], file["strain"]
    skin, points = None, None
    if "mass_points" in file:
        points = MassPoints(*(_read_array(file["mass_points"], name) for name in ("dm", "rho", "moved")))
    if "skin" in file:
        group = file["skin"]
        cells = {kind: np.asarray(rows, np.int64) for kind, rows in group["cells"].items()}
        skin = Skin(_read_array(group, "points"), cells, _read_array(group, "shapes"))
    return FlexibleBody(
        moments=MassMoments(float(moments["mass"][()]), _read_array(moments, "first"), _read_array(moments, "second")),
        strain=StrainTensors(*(_read_array(strain, name) for name in ("V1", "f0", "V2", "V3") if name in strain)),
        damping=_read_array(file, "damping"),
        markers={
            _unescaped(name): Marker(**{key: _read_array(rows, key) for key in MARKER if key in rows})
            for name, rows in file["markers"].items()
        },
        skin=skin,
        kinds=tuple(str(kind) for kind in file.attrs["kinds"]),
        omega=_read_array(file, "omega"),
        slaves=_read_array(file, "slaves") if "slaves" in file else np.zeros((0, 0, 0)),
        foreshortening=_read_foreshortening(file["ignored"]) if "ignored" in file else None,
        strain_field=read_field(file),
        mass_points=points,
    )


def _read_foreshortening(group: h5py.Group) -> Foreshortening:
    return Foreshortening(
        _read_array(group, "mass"), {_unescaped(name): _read_array(group["at"], name) for name in group["at"]}
    )


def _write_fields(group: h5py.Group, owner: Any, *names: str) -> None:
    for name in names:
        _write_dataset(group, name, getattr(owner, name))


def _write_dataset(group: h5py.Group, name: str, value: Array | float) -> None:
    dataset = group.create_dataset(name, data=np.asarray(value, float))
    dataset.attrs["description"], dataset.attrs["units"] = FIELDS[name]


def _read_array(group: h5py.Group, name: str) -> Array:
    return np.asarray(group[name][()], np.float64)


def _escaped(name: str) -> str:
    """A marker name as one HDF5 link: slashes and lone dots would be read as paths."""
    return name.replace("%", "%25").replace("/", "%2F").replace(".", "%2E")


def _unescaped(name: str) -> str:
    return name.replace("%2E", ".").replace("%2F", "/").replace("%25", "%")


def _version() -> str:
    try:
        return version("femflex")
    except PackageNotFoundError:
        return "unknown"
