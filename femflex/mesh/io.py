"""Reading and writing mesh files; each format stores groups in its own way."""

from __future__ import annotations

import errno
import os
from collections.abc import Mapping
from pathlib import Path

from femflex.mesh.check import check, reorient_solids
from femflex.mesh.formats import WriteOptions, format_of
from femflex.mesh.formats.contents import to_mesh, with_middle_nodes, with_renamed_groups, without_vertices
from femflex.mesh.formats.guards import memory_guard
from femflex.mesh.mesh import Mesh
from femflex.reading import reading
from femflex.writing import atomic_file

ADVICE = "The file may be cut short, damaged or of another format; write it again from its source."


def read_mesh(path: str | Path, groups: Mapping[str, str] | None = None, strict: bool = True) -> Mesh:
    """Mesh of a file, by its suffix: .msh, .bdf/.nas/.dat, .inp, .med, .vtu, .vtk, .exo, .xdmf, .unv or .cdb.

    groups renames groups, {new name: name in the file}; names in Nastran files are "PID 1", "SET 4" and so on.
    Elements of unknown type and unused points are left out with a warning; the mesh is checked (see check.py).
    strict=False, for inspection of a file: folded cells and cells without size give a warning, and a file without cells
    gives a mesh of points.
    """
    path = Path(path)
    file_format = format_of(path)
    if not path.is_file():
        alternatives = sorted(p.name for p in path.parent.glob(f"*{path.suffix}")) if path.parent.is_dir() else []
        raise ValueError(f"mesh file {path} does not exist; {path.parent} holds {alternatives or 'no such files'}.")
    with reading(path, file_format.name, ADVICE), memory_guard(path, file_format.memory):
        contents = with_middle_nodes(file_format.read(path), path.name)
        mesh = to_mesh(contents, path.name, strict)
    mesh = with_renamed_groups(mesh, groups, contents.titles, path.name)
    mesh = reorient_solids(mesh, path.name)
    check(mesh, path.name, strict)
    return mesh


def write_mesh(path: str | Path, mesh: Mesh, *, binary: bool = True, version: str | None = None) -> None:
    """Write a mesh with its groups to a file, by its suffix; an existing file is replaced once the new one is complete.

    binary   False: text, for formats that have both (.msh, .vtk, .vtu)
    version  of the format: "4.1" or "2.2" for .msh; None: the newest
    """
    path = Path(path)
    file_format = format_of(path)
    if file_format.write is None:
        raise ValueError(f"{path.name}: {file_format.name} is read only; write {path.stem}.msh or .vtu instead.")
    if not mesh.cells:
        raise ValueError(f"a mesh without cells cannot be written to {path.name}.")
    with atomic_file(path, force=True) as part:
        try:
            file_format.write(part, without_vertices(mesh), WriteOptions(binary, version))
        except OSError as error:  # numpy's of an array that does not fit has no number
            if error.errno is None:
                raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), str(part)) from error
            raise
