"""Finite elements: members on a mesh become mass, stiffness and the two tables of a Structure.

Importing the package loads every module in this folder, and with it every family of members.
"""

from __future__ import annotations

from importlib import import_module
from pkgutil import iter_modules

from femflex.fem.cut import Segment, cut
from femflex.fem.family import FAMILIES
from femflex.fem.materials import Material
from femflex.fem.point_mass import PointMass
from femflex.fem.structure import Member, Structure, StructureSkin, build_structure

__all__ = [
    "FAMILIES",
    "Material",
    "Member",
    "PointMass",
    "Segment",
    "Structure",
    "StructureSkin",
    "build_structure",
    "cut",
]

for _module in iter_modules(__path__):
    import_module(f"{__name__}.{_module.name}")
