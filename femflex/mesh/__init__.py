"""Meshes: the container, its files, refinement, generators."""

from femflex.mesh.check import check
from femflex.mesh.generators import annulus, box, line, rectangle
from femflex.mesh.io import read_mesh, write_mesh
from femflex.mesh.mesh import Mesh, describe

__all__ = ["Mesh", "annulus", "box", "check", "describe", "line", "read_mesh", "rectangle", "write_mesh"]


def __dir__() -> list[str]:
    """Public names, for completion."""
    return __all__
