"""Case -> bodies and System: what the tables of a case file stand for."""

from __future__ import annotations

from femflex.case.builders.body import build_bodies, build_part
from femflex.case.builders.single import build_body, build_each, with_own_strain, with_strain_notes
from femflex.case.builders.structure import build_mesh, build_modes, build_structure_of
from femflex.case.builders.system import build_system, with_own_joints

__all__ = [
    "build_bodies",
    "build_body",
    "build_each",
    "build_mesh",
    "build_modes",
    "build_part",
    "build_structure_of",
    "build_system",
    "with_own_joints",
    "with_own_strain",
    "with_strain_notes",
]
