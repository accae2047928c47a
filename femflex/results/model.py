"""Bodies in the result file: enough of each to draw it."""

from __future__ import annotations

from dataclasses import dataclass

import h5py
import numpy as np

from femflex.arrays import Array
from femflex.body import FlexibleBody, Skin
from femflex.body.strain_field import StrainPart, read_field, write_field
from femflex.noun.names import name_problems


@dataclass(frozen=True, eq=False)
class RunBody:
    """Data of a body that a result file contains.

    mass [kg], kinds (n,), omega (n,) [rad/s], markers name -> undeformed position (3,) [m, body frame],
    skin  None for a body that cannot be drawn;  strain_field  parts that recover its strain
    """

    mass: float
    kinds: tuple[str, ...]
    omega: Array
    markers: dict[str, Array]
    skin: Skin | None
    strain_field: tuple[StrainPart, ...] = ()

    @property
    def n_modes(self) -> int:
        """Number of shapes."""
        return len(self.omega)


def write_bodies(group: h5py.Group, bodies: dict[str, FlexibleBody]) -> None:
    """Write every body under its name."""
    for name, body in bodies.items():
        _check_name(name)
        body_group = group.create_group(name)
        body_group.attrs["mass"] = float(body.moments.mass)
        body_group.attrs["n_modes"] = body.n_shapes
        body_group["omega"] = np.asarray(body.omega, float) if len(body.omega) else np.full(body.n_shapes, np.nan)
        body_group.create_dataset("kinds", data=np.array(body.kinds, dtype=object), dtype=h5py.string_dtype())
        markers = body_group.create_group("markers")
        for marker, marker_data in body.markers.items():
            markers[marker] = marker_data.position
        if body.skin is not None:
            body_group["points"], body_group["shapes"] = body.skin.points, body.skin.shapes
            if body.skin.growth is not None:
                body_group["growth"] = body.skin.growth
            cells = body_group.create_group("cells")
            for kind, nodes in body.skin.cells.items():
                cells[kind] = nodes
        write_field(body_group, body.strain_field)


def read_body(group: h5py.Group) -> RunBody:
    """One body of /model."""
    skin = None
    if "points" in group:
        cells = {kind: np.asarray(nodes[()], np.int64) for kind, nodes in group["cells"].items()}
        growth = group["growth"][()] if "growth" in group else None
        skin = Skin(group["points"][()], cells, group["shapes"][()], growth)
        if not all(np.isfinite(values).all() for values in (skin.points, skin.shapes)):
            raise ValueError(f"the points or shapes of {group.name} have values that are not finite")
    return RunBody(
        float(group.attrs["mass"]),
        tuple(group["kinds"].asstr()[()]),
        group["omega"][()],
        {name: position[()] for name, position in group["markers"].items()},
        skin,
        read_field(group),
    )


def _check_name(name: str) -> None:
    for problem in name_problems("body", [name]):
        raise ValueError(problem)
