"""Runs and models as files of other programs: scenes, tables, linear models. A writer is one function in one file."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path

from femflex.results import Run

__all__ = ["WRITERS", "Writer", "export_run"]


@dataclass(frozen=True)
class Writer:
    """A kind of file.

    text   what it is, in a few words
    scene  whether it shows the moving bodies; else it has channels
    module, function  where it is written, loaded when it is used
    """

    text: str
    scene: bool
    module: str
    function: str

    def load(self) -> Callable[..., list[str]]:
        """The function that writes: (run, path, ..., force=...) -> lines to print."""
        function: Callable[..., list[str]] = getattr(import_module(f"femflex.export.{self.module}"), self.function)
        return function


WRITERS = {
    ".glb": Writer("glTF scene that moves", True, "gltf", "write_glb"),
    ".vtkhdf": Writer("ParaView, one file", True, "vtk", "write_vtkhdf"),
    ".pvd": Writer("ParaView, a file for each instant", True, "vtk", "write_pvd"),
    ".csv": Writer("table", False, "tables", "write_csv"),
    ".parquet": Writer("table", False, "tables", "write_parquet"),
    ".mat": Writer("MATLAB", False, "tables", "write_mat"),
    ".oem": Writer("CCSDS orbit", False, "tables", "write_oem"),
    ".aem": Writer("CCSDS attitude", False, "tables", "write_aem"),
    ".nc": Writer("netCDF", False, "tables", "write_netcdf"),
}


def export_run(
    run: Run,
    path: str | Path,
    channels: Sequence[str] = (),
    camera: str = "auto",
    instants: int = 0,
    force: bool = False,
) -> list[str]:
    """Write a run as the file that the end of its name says. Returns what is worth saying, as lines.

    channels  of tables; none for all
    camera    axes of scenes: "auto", "fixed", "follow", "orbital", "body:NAME"
    instants  of scenes, equally spaced among the rows; 0: all
    Raises ValueError for another end, or options that do not belong to it, KeyError, MissingExtra and OSError.
    """
    path = Path(path)
    writer = WRITERS.get(path.suffix.lower())
    if writer is None:
        known = ", ".join(f"{end} ({each.text})" for end, each in WRITERS.items())
        raise ValueError(f"{path.name} has no known end; a run is exported as {known}")
    if not len(run):
        raise ValueError(f"{run.path} holds no instants, so there is nothing to export")
    if writer.scene:
        if channels:
            raise ValueError(f"{path.suffix} shows bodies and has no channels; leave {', '.join(channels)} out")
        return writer.load()(run, path, camera, instants, force=force)
    if camera != "auto" or instants:
        raise ValueError(f"{path.suffix} has channels at all instants; --camera and --instants are of scenes")
    return writer.load()(run, path, channels, force=force)
