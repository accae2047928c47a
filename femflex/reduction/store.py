"""A reduced body in an HDF5 file: written under another name and moved into place, read back bit for bit.

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
from femflex.body.mass_points import MassPoints
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
    """The path of the HDF5 file the body was written to; the file appears whole or not at all.

    Raises FileExistsError when there is one already, unless force is given.
    """
    with atomic_hdf5(Path(path), force) as file:
        _write(file, body)
    return Path(path)


def load_body(path: str | os.PathLike[str]) -> FlexibleBody:
    """The FlexibleBody of a file that save_body wrote.

    Raises FileNotFoundError when there is none, ValueError when it is not a femflex body or is of a later format.
    """
    source = Path(path)
    with reading(source, "femflex body file", "Make one with `femflex body`."):
        file = open_hdf5(source, "body file")
    with file, reading(source, "femflex body file", "Make it again with `femflex body`."):
        found = file.attrs.get("format")
        if found != FORMAT:
            raise ValueError(
                f"{source} is not a femflex body file: its format is {found!r}. Make one with `femflex body`."
            )
        number = int(file.attrs["format_version"])
        if number > FORMAT_VERSION:
            raise ValueError(
                f"{source} has body format {number}, and this femflex reads up to {FORMAT_VERSION}; "
                "use a newer femflex, or make the body again."
            )
        try:
            return _read(file)
        except KeyError as error:
            raise ValueError(
                f"{source} is a femflex body file with parts missing: {error.args[0]}. Make it again."
            ) from error


def _write(file: h5py.File, body: FlexibleBody) -> None:
    file.attrs.update(format=FORMAT, format_version=FORMAT_VERSION, femflex_version=_version())
    file.attrs["frame"] = "body frame: the coordinates of the mesh the body was made from"
    file.attrs["kinds"] = list(body.kinds) if body.kinds else np.zeros(0, "S1")
    _put(file, "damping", body.damping)
    _put(file, "omega", body.omega)
    if len(body.slaves):
        _put(file, "slaves", body.slaves)
    _put_all(file.create_group("moments"), body.moments, "mass", "first", "second")
    _put_all(file.create_group("strain"), body.strain, "V1", "f0", "V2", "V3")
    markers = file.create_group("markers", track_order=True)
    for name, marker in body.markers.items():
        _put_all(markers.create_group(_escaped(name)), marker, *MARKER)
    if body.skin is not None:
        skin = file.create_group("skin")
        _put_all(skin, body.skin, "points", "shapes")
        cells = skin.create_group("cells", track_order=True)
        for kind, rows in body.skin.cells.items():
            cells.create_dataset(kind, data=rows)
    if body.foreshortening is not None:
        ignored = file.create_group("ignored")
        ignored.attrs["description"] = "foreshortening of the lowest shape over its stiffness, see body.Foreshortening"
        mass = ignored.create_dataset("mass", data=body.foreshortening.mass)
        mass.attrs["units"], mass.attrs["description"] = "s^2/m | s^2", "int z theta^T dm, z = (1, rho)"
        at = ignored.create_group("at", track_order=True)
        for name, theta in body.foreshortening.at.items():
            place = at.create_dataset(_escaped(name), data=theta)
            place.attrs["units"], place.attrs["description"] = "1/N", "theta at this marker"
    if body.mass_points is not None:
        points = file.create_group("mass_points")
        _put(points, "dm", body.mass_points.dm)
        _put(points, "rho", body.mass_points.rho)
        _put(points, "moved", body.mass_points.phi)
    write_field(file, body.strain_field)


def _read(file: h5py.File) -> FlexibleBody:
    moments, strain = file["moments"], file["strain"]
    skin = None
    if "skin" in file:
        part = file["skin"]
        cells = {kind: np.asarray(rows, np.int64) for kind, rows in part["cells"].items()}
        skin = Skin(_get(part, "points"), cells, _get(part, "shapes"))
    return FlexibleBody(
        moments=MassMoments(float(moments["mass"][()]), _get(moments, "first"), _get(moments, "second")),
        strain=StrainTensors(*(_get(strain, name) for name in ("V1", "f0", "V2", "V3") if name in strain)),
        damping=_get(file, "damping"),
        markers={
            _unescaped(name): Marker(**{key: _get(rows, key) for key in MARKER if key in rows})
            for name, rows in file["markers"].items()
        },
        skin=skin,
        kinds=tuple(str(kind) for kind in file.attrs["kinds"]),
        omega=_get(file, "omega"),
        slaves=_get(file, "slaves") if "slaves" in file else np.zeros((0, 0, 0)),
        foreshortening=_foreshortening(file["ignored"]) if "ignored" in file else None,
        strain_field=read_field(file),
        mass_points=_mass_points(file["mass_points"]) if "mass_points" in file else None,
    )


def _mass_points(group: h5py.Group) -> MassPoints:
    return MassPoints(_get(group, "dm"), _get(group, "rho"), _get(group, "moved"))


def _foreshortening(group: h5py.Group) -> Foreshortening:
    return Foreshortening(_get(group, "mass"), {_unescaped(name): _get(group["at"], name) for name in group["at"]})


def _put_all(group: h5py.Group, owner: Any, *names: str) -> None:
    for name in names:
        _put(group, name, getattr(owner, name))


def _put(group: h5py.Group, name: str, value: Array | float) -> None:
    dataset = group.create_dataset(name, data=np.asarray(value, float))
    dataset.attrs["description"], dataset.attrs["units"] = FIELDS[name]


def _get(group: h5py.Group, name: str) -> Array:
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
