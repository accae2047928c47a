"""The register of mesh file formats, and the only access to meshio.

A new format is one new module: a function that reads Contents and one that writes a Mesh, registered under its
suffixes. meshio, which reads VTU and writes VTU, legacy VTK and MED, prints warnings and may end the process; the
warnings are logged here, and an end of the process is an error of the file.
"""

from __future__ import annotations

import contextlib
import io
import logging
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from femflex.mesh.formats.contents import Contents
from femflex.mesh.mesh import Mesh

log = logging.getLogger(__name__)


@dataclass(frozen=True)
class WriteOptions:
    """Options of a writer: binary or text, and the version of the format (None: the newest)."""

    binary: bool = True
    version: str | None = None


Reader = Callable[[Path], Contents]
Writer = Callable[[Path, Mesh, WriteOptions], None]


@dataclass(frozen=True)
class Format:
    """Name for messages, reader and writer of one format, and the bytes of memory needed per byte of the file.

    write: None if the format is read only.
    """

    name: str
    read: Reader
    write: Writer | None
    memory: float = 10.0  # measured on 160,000 quads: 2 to 9


FORMATS: dict[str, Format] = {}  # by suffix


def register(
    name: str, suffixes: tuple[str, ...], read: Reader, write: Writer | None = None, memory: float = 10.0
) -> None:
    """Register a format under its suffixes."""
    for suffix in suffixes:
        FORMATS[suffix] = Format(name, read, write, memory)


def format_of(path: Path) -> Format:
    """Format by the suffix of a path."""
    try:
        return FORMATS[path.suffix.lower()]
    except KeyError:
        known_formats = ", ".join(f"{suffix} ({FORMATS[suffix].name})" for suffix in sorted(FORMATS))
        raise ValueError(
            f"{path.name}: {path.suffix or 'no suffix'} is not a known mesh format; known are {known_formats}."
        ) from None


def load_meshio() -> Any:
    """The module meshio, loaded on first use, with the cell types of MED and VTK that its tables lack."""
    import meshio

    meshio._mesh.topological_dimension.update(wedge15=3, pyramid13=3, voxel=3)
    meshio._common.num_nodes_per_cell["voxel"] = 8
    meshio._vtk_common.vtk_to_meshio_type[11] = "voxel"
    for cell, code in (("quad9", "QU9"), ("hexahedron27", "H27"), ("wedge18", "P18")):
        meshio.med._med.meshio_to_med_type[cell] = code
        meshio.med._med.med_to_meshio_type[code] = cell
    return meshio


@contextlib.contextmanager
def meshio_call(path: Path) -> Iterator[io.StringIO]:
    """Context for a call of meshio, which yields its printed output, is logged, and ends the process by no exit."""
    output = io.StringIO()
    try:
        with contextlib.redirect_stdout(output), contextlib.redirect_stderr(output):
            yield output
    except SystemExit as error:
        raise ValueError("its contents are not those of this format") from error
    finally:
        if text := " ".join(output.getvalue().split()):
            log.info("meshio on %s: %s", path.name, text)
