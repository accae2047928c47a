"""Build structures, bodies and the System from the data of a case: pure functions, one per table."""

from __future__ import annotations

from femflex.assembly.bodies import build_bodies, build_part
from femflex.assembly.structures import build_mesh, build_modes, build_structure_of

__all__ = ["build_bodies", "build_mesh", "build_modes", "build_part", "build_structure_of"]
