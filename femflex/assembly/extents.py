"""Warn of meshes and thicknesses whose sizes suggest a wrong unit."""

from __future__ import annotations

import warnings
from collections.abc import Iterator

import numpy as np

from femflex.case.body import FlexibleTable
from femflex.case.case import Case
from femflex.fem.sections.named import LayupTable, PlateTable, SandwichTable
from femflex.mesh import Mesh
from femflex.warning import PhysicsWarning

LARGE = 200.0  # extent beyond which the unit of a mesh is probably the millimetre
SMALL = 0.05  # m; smaller meshes are more often in another unit than of that size
THICK = 0.25  # of the mesh's largest extent, above which a section is too thick for a plate
PER_METRE = {"m": 1.0, "cm": 100.0, "mm": 1000.0, "inch": 1 / 0.0254}


def warn_of_doubtful_extents(case: Case, name: str, table: object, mesh: Mesh, mass: float) -> None:
    """Warn of a mesh that is probably in another unit, and of sections too thick for it.

    mesh: [m]; mass: of the body [kg]
    """
    if (
        not isinstance(table, FlexibleTable) or table.deck is not None
    ):  # decks have their own checks (`femflex.decks.report`)
        return
    size = float(np.ptp(mesh.points, axis=0).max())
    longest = 1e3 * LARGE if any(member.family == "tether" for member in table.members) else LARGE
    for warning in list(_mesh_warnings(name, table, size, longest, mass)) or list(
        _thickness_warnings(case, table, size)
    ):
        warnings.warn(warning, stacklevel=5)


def _mesh_warnings(
    name: str, table: FlexibleTable, size: float, longest: float, mass: float
) -> Iterator[PhysicsWarning]:
    if size > longest and "mesh_unit" not in table.model_fields_set:
        yield PhysicsWarning(
            "{body_or_joint}: the mesh spans {value:.4g} m, over {limit:g} m, and its mass is {mass:.4g} kg;",
            body_or_joint=f"bodies.{name}",
            value=size,
            limit=longest,
            remedy="if its unit is millimetres, set mesh_unit = 'mm', and if it is metres, mesh_unit = 'm'",
            mass=mass,
        )
    if 0 < size < SMALL and table.mesh_unit != "m":
        written = size * PER_METRE[table.mesh_unit]
        yield PhysicsWarning(
            "{body_or_joint}: the mesh spans {value:.4g} m, read in {unit};",
            body_or_joint=f"bodies.{name}",
            value=size,
            limit=SMALL,
            remedy="if its unit is metres, it spans {written:.4g} m: leave out mesh_unit",
            unit=table.mesh_unit,
            written=written,
        )


def _thickness_warnings(case: Case, table: FlexibleTable, size: float) -> Iterator[PhysicsWarning]:
    for member in table.members:
        section = case.sections.get(member.section or "")
        for key, value in _thicknesses(section):
            if value > THICK * size:
                yield PhysicsWarning(
                    "{body_or_joint}: found {value:g} m in a mesh that spans {size:.4g} m, too thick for a plate;",
                    body_or_joint=f"sections.{member.section}.{key}",
                    value=value,
                    limit=THICK * size,
                    remedy='if millimetres were meant, write "{value:g} mm" ({metres:g} m)',
                    size=size,
                    metres=value / 1e3,
                )


def _thicknesses(section: object) -> Iterator[tuple[str, float]]:
    if isinstance(section, PlateTable):
        yield "thickness", section.thickness
    if isinstance(section, SandwichTable):
        yield "face.thickness", section.face.thickness
        yield "core.thickness", section.core.thickness
    if isinstance(section, LayupTable):
        yield "plies", sum(ply.thickness for ply in section.plies)
