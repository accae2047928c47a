"""Reading and writing mesh files; every format keeps groups by its own means."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from femflex.memory import limited_memory, require_memory
from femflex.mesh import io_abaqus, io_ansys, io_exodus, io_gmsh, io_med, io_nastran, io_unv, io_vtk, io_xdmf
from femflex.mesh.check import check
from femflex.mesh.contents import renamed, to_mesh, without_vertices
from femflex.mesh.formats import WriteOptions, format_of
from femflex.mesh.mesh import Mesh
from femflex.mesh.midside import with_middle_nodes
from femflex.mesh.upright import upright
from femflex.reading import reading
from femflex.writing import atomic_file

__all__ = [
    "io_abaqus",
    "io_ansys",
    "io_exodus",
    "io_gmsh",
    "io_med",
    "io_nastran",
    "io_unv",
    "io_vtk",
    "io_xdmf",
    "read_mesh",
    "write_mesh",
]

COMPRESSED = 20  # a compressed .vtu or .med may hold as much more than its size says
ADVICE = "The file may be cut short, damaged or of another format; write it again from its source."


def read_mesh(path: str | Path, groups: Mapping[str, str] | None = None, strict: bool = True) -> Mesh:
    """Mesh of a file, by its suffix: .msh, .bdf/.nas/.dat, .inp, .med, .vtu, .vtk, .exo, .xdmf, .unv or .cdb.

    groups renames, {wanted name: name in the file}; for Nastran the file's names are "PID 1", "SET 4" and the like.
    Elements and points without meaning are left out and reported; the mesh is checked (see check.py). With
    strict=False, to look at a file, cells without size or folded are warned of, and a file without cells gives points.
    """
    path = Path(path)
    kind = format_of(path)
    if not path.is_file():
        near = sorted(p.name for p in path.parent.glob(f"*{path.suffix}")) if path.parent.is_dir() else []
        raise ValueError(f"mesh file {path} does not exist; {path.parent} holds {near or 'no such files'}.")
    need = kind.memory * path.stat().st_size
    require_memory(need, f"{path.name}: reading it", "take a coarser mesh, or free some memory.")
    with reading(path, kind.name, ADVICE), limited_memory(COMPRESSED * need):
        contents = with_middle_nodes(kind.read(path), path.name)
        mesh = to_mesh(contents, path.name, strict)
    mesh = renamed(mesh, groups, contents.titles, path.name)
    mesh = upright(mesh, path.name)
    check(mesh, path.name, strict)
    return mesh


def write_mesh(path: str | Path, mesh: Mesh, *, binary: bool = True, version: str | None = None) -> None:
    """Write a mesh with its groups to a file, by its suffix; an existing file is replaced when all is written.

    binary   False: text, where the format has both (.msh, .vtk, .vtu)
    version  of the format: "4.1" or "2.2" for .msh; None: the newest
    """
    path = Path(path)
    kind = format_of(path)
    if kind.write is None:
        raise ValueError(f"{path.name}: {kind.name} is read only; write {path.stem}.msh or .vtu instead.")
    if not mesh.cells:
        raise ValueError(f"a mesh without cells cannot be written to {path.name}.")
    with atomic_file(path, force=True) as part:
        kind.write(part, without_vertices(mesh), WriteOptions(binary, version))
