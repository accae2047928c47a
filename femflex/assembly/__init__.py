"""Case data -> Structures, bodies and System: pure functions, one per table of a case."""

from __future__ import annotations

from femflex.assembly.bodies import build_bodies, build_part
from femflex.assembly.structures import build_mesh, build_modes, build_structure_of

__all__ = ["build_bodies", "build_mesh", "build_modes", "build_part", "build_structure_of"]
