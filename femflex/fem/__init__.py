"""Finite elements: members on a mesh become mass, stiffness and the two tables of a Structure.

Importing the package loads every module below this folder, and with it every family of members.
"""

from __future__ import annotations

from importlib import import_module
from pkgutil import walk_packages

from femflex.fem.bushing import Bushing, ScalarSpring, spring
from femflex.fem.connections import Distributing, Equation, MultiPointConstraint, Rigid, Term
from femflex.fem.family import FAMILIES
from femflex.fem.line.segments import Segment, cut_into_segments
from femflex.fem.point_mass import PointMass
from femflex.fem.sections.materials import Anisotropic, Material, Orthotropic
from femflex.fem.static_loads import StaticLoads
from femflex.fem.structure import Member, Structure, StructureSkin, build_structure
from femflex.fem.support import Support, antisymmetry, symmetry

__all__ = [
    "FAMILIES",
    "Anisotropic",
    "Bushing",
    "Distributing",
    "Equation",
    "Material",
    "Member",
    "MultiPointConstraint",
    "Orthotropic",
    "PointMass",
    "Rigid",
    "ScalarSpring",
    "Segment",
    "StaticLoads",
    "Structure",
    "StructureSkin",
    "Support",
    "Term",
    "antisymmetry",
    "build_structure",
    "cut_into_segments",
    "spring",
    "symmetry",
]

for _module in walk_packages(__path__, f"{__name__}."):
    import_module(_module.name)


def __dir__() -> list[str]:
    """Public names, for completion."""
    return __all__
