"""The register of mesh file formats, and the one door to meshio.

A new format is one new file: a function that reads Contents and one that writes a Mesh, registered under its suffixes.
meshio prints its complaints and may end the process; both are turned into sentences here.
"""

from __future__ import annotations

import contextlib
import io
import logging
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from femflex.mesh.contents import Contents
from femflex.mesh.mesh import Mesh
from femflex.reading import error_text

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
    """Name for messages, reader and writer of one format, and bytes of memory that reading a byte of it takes.

    write: None where the format is read only.
    """

    name: str
    read: Reader
    write: Writer | None
    memory: float = 10.0  # measured on 160,000 quads: 2 to 9


FORMATS: dict[str, Format] = {}  # by suffix


def register(
    name: str, suffixes: tuple[str, ...], read: Reader, write: Writer | None = None, memory: float = 10.0
) -> None:
    """Make a format known under its suffixes."""
    for suffix in suffixes:
        FORMATS[suffix] = Format(name, read, write, memory)


def format_of(path: Path) -> Format:
    """Format by the suffix of a path."""
    try:
        return FORMATS[path.suffix.lower()]
    except KeyError:
        known = ", ".join(f"{suffix} ({FORMATS[suffix].name})" for suffix in sorted(FORMATS))
        raise ValueError(
            f"{path.name}: {path.suffix or 'no suffix'} is not a known mesh format; known are {known}."
        ) from None


def load_meshio() -> Any:
    """The module meshio, loaded when first needed, with the cell types its tables lack."""
    import meshio

    meshio._mesh.topological_dimension.update(wedge15=3, pyramid13=3)
    for cell, code in (("quad9", "QU9"), ("hexahedron27", "H27"), ("wedge18", "P18")):
        meshio.med._med.meshio_to_med_type[cell] = code
        meshio.med._med.med_to_meshio_type[code] = cell
    meshio.abaqus._abaqus.abaqus_to_meshio_type["C3D5"] = "pyramid"
    meshio.abaqus._abaqus.meshio_to_abaqus_type["pyramid"] = "C3D5"
    return meshio


@contextlib.contextmanager
def meshio_speaking(path: Path, name: str, verb: str = "read", hint: str = "") -> Iterator[io.StringIO]:
    """Context in which meshio is called, giving what it printed: that is logged, what it raises becomes a sentence."""
    said = io.StringIO()
    try:
        with contextlib.redirect_stdout(said), contextlib.redirect_stderr(said):
            yield said
    except MemoryError:
        raise
    except (Exception, SystemExit) as error:
        if verb == "written" and isinstance(error, OSError) and error.errno:  # the disk is full
            raise
        log.info("meshio on %s: %s %s %s", path.name, type(error).__name__, error, " ".join(said.getvalue().split()))
        found = error_text(error) if verb == "read" else "the format cannot hold this mesh"
        advice = (
            hint
            or {
                "read": "The file may be cut short or of another format; write it again from its source.",
                "written": "Another format may hold it: .msh, .vtu.",
            }[verb]
        )
        raise ValueError(f"{path.name} could not be {verb} as {name}: {found}. {advice}") from error
    if said.getvalue().strip():
        log.info("meshio on %s: %s", path.name, " ".join(said.getvalue().split()))
