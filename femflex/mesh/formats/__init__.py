"""Formats of mesh files, one file each, and what they share. A new format is one new file, and one line here."""

from femflex.mesh.formats import abaqus as abaqus
from femflex.mesh.formats import ansys as ansys
from femflex.mesh.formats import exodus as exodus
from femflex.mesh.formats import gmsh as gmsh
from femflex.mesh.formats import med as med
from femflex.mesh.formats import nastran as nastran
from femflex.mesh.formats import unv as unv
from femflex.mesh.formats import vtk as vtk
from femflex.mesh.formats import xdmf as xdmf
from femflex.mesh.formats.register import FORMATS, Format, WriteOptions, format_of, register

__all__ = ["FORMATS", "Format", "WriteOptions", "format_of", "register"]
