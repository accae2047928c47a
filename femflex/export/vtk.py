"""ParaView's files: one grid with the bodies' numbers, and over time displacement, elastic deformation and stress.

`.vtkhdf` is written by VTK itself: the grid stands once in the file. `.pvd` is a list of `.vtu` files, one an instant,
in a folder of the same name, for ParaView before 5.12.
"""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import TYPE_CHECKING, Any
from xml.sax.saxutils import quoteattr

import numpy as np
from numpy.typing import NDArray

from femflex.arrays import Array
from femflex.body.recovery import VON_MISES
from femflex.export.moving_bodies import MovingBody, MovingCraft, moving_craft
from femflex.extras import require
from femflex.results import Run
from femflex.view.paint import EVERY, BodyPaint, Quantity
from femflex.view.surface import CORNERS
from femflex.writing import atomic_file, check_destination

if TYPE_CHECKING:
    import pyvista as pv

VTK_CELLS = {1: 1, 2: 3, 3: 5, 4: 9}  # corners -> VTK's number of a vertex, line, triangle and quadrangle


def write_vtkhdf(run: Run, path: str | Path, camera: str = "auto", instants: int = 0, force: bool = False) -> list[str]:
    """Write the drawn points of a run over time as VTKHDF. Returns what is worth saying, as lines.

    camera, instants: see `femflex.export.export_run`. Raises ValueError where nothing can be drawn, and OSError.
    """
    require("view", "files of ParaView")
    from vtkmodules.util.vtkAlgorithm import VTKPythonAlgorithmBase
    from vtkmodules.vtkCommonDataModel import vtkUnstructuredGrid
    from vtkmodules.vtkCommonExecutionModel import vtkStreamingDemandDrivenPipeline as Pipeline
    from vtkmodules.vtkIOHDF import vtkHDFWriter

    grid = _Grid(run, moving_craft(run, camera, instants))
    times = [float(t) for t in grid.craft.times]

    class Instants(VTKPythonAlgorithmBase):
        """A source of VTK that gives the grid at any instant."""

        def __init__(self) -> None:
            super().__init__(nInputPorts=0, nOutputPorts=1, outputType="vtkUnstructuredGrid")  # type: ignore[no-untyped-call]

        def RequestInformation(self, _request: Any, _inputs: Any, outputs: Any) -> int:
            information = outputs.GetInformationObject(0)
            information.Set(Pipeline.TIME_STEPS(), times, len(times))
            information.Set(Pipeline.TIME_RANGE(), [times[0], times[-1]], 2)
            return 1

        def RequestData(self, _request: Any, _inputs: Any, outputs: Any) -> int:
            information = outputs.GetInformationObject(0)
            t = (
                information.Get(Pipeline.UPDATE_TIME_STEP())
                if information.Has(Pipeline.UPDATE_TIME_STEP())
                else times[0]
            )
            vtkUnstructuredGrid.GetData(outputs).ShallowCopy(grid.at_instant(int(np.searchsorted(times, t))))
            return 1

    source = Instants()
    with atomic_file(path, force) as part:
        writer = vtkHDFWriter()
        writer.SetInputConnection(source.GetOutputPort())
        writer.SetFileName(str(part))
        writer.SetWriteAllTimeSteps(True)
        writer.SetChunkSize(len(grid.rest))  # an instant is a chunk: chunks that two share are packed anew each time
        writer.SetCompressionLevel(4)
        if not writer.Write():
            raise OSError(f"{path} could not be written by VTK; see whether the disk is full")
    return grid.summary()


def write_pvd(run: Run, path: str | Path, camera: str = "auto", instants: int = 0, force: bool = False) -> list[str]:
    """Write the drawn points of a run as a `.pvd` file, with a `.vtu` file for each instant in a folder beside it.

    camera, instants: see `femflex.export.export_run`. Returns what is worth saying. Raises ValueError where nothing can
    be drawn, and OSError.
    """
    require("view", "files of ParaView")
    path = Path(path)
    check_destination(path, force)
    folder = path.with_suffix("")
    if folder.exists() and not force:
        raise FileExistsError(f"folder {folder}, which the files of the instants need, exists; choose another name")
    grid = _Grid(run, moving_craft(run, camera, instants))
    digits = len(str(len(grid.craft.times)))
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir()
    rows = []
    for k, t in enumerate(grid.craft.times):
        name = f"{folder.name}/{k:0{digits}d}.vtu"
        grid.at_instant(k).save(str(path.parent / name))
        rows.append(
            f'    <DataSet timestep="{t!r}" file={quoteattr(name)}/>\n'.replace("np.float64(", "").replace(")", "")
        )
    with atomic_file(path, force) as part:
        part.write_text(
            '<?xml version="1.0"?>\n<VTKFile type="Collection" version="0.1">\n  <Collection>\n'
            + "".join(rows)
            + "  </Collection>\n</VTKFile>\n",
            encoding="utf-8",
        )
    return [*grid.summary(), f"instants in {folder}"]


class _Grid:
    """The bodies of a run as one unstructured grid, which stays, and its arrays at any instant."""

    def __init__(self, run: Run, craft: MovingCraft) -> None:
        import pyvista as pv

        self.craft = craft
        stored = run.bodies()
        quantity = Quantity(EVERY, None, stress=VON_MISES)
        self.paints = {
            body.name: BodyPaint.from_field(quantity, stored[body.name].strain_field, body.skin)
            for body in craft.bodies
            if any(quantity.is_in(part) for part in stored[body.name].strain_field)
        }
        self.rest = np.concatenate([body.points(0) for body in craft.bodies])
        numbers = [np.full(len(body.skin.points), k, np.int16) for k, body in enumerate(craft.bodies)]
        self.mesh: pv.UnstructuredGrid = pv.UnstructuredGrid(*self._cells(), self.rest)
        self.mesh.point_data["body"] = np.concatenate(numbers)

    def at_instant(self, k: int) -> pv.UnstructuredGrid:
        """The grid with the arrays of instant k."""
        craft, mesh = self.craft, self.mesh
        points = np.concatenate([body.points(k) for body in craft.bodies])
        mesh.point_data["displacement"] = (points - self.rest).astype(np.float32)
        deformations = np.concatenate([_deformation(body, k) for body in craft.bodies])
        mesh.point_data["deformation"] = deformations.astype(np.float32)
        if self.paints:
            mesh.point_data["von_mises_stress"] = np.concatenate([self._stress(body, k) for body in craft.bodies])
        return mesh

    def summary(self) -> list[str]:
        """Return lines that say which instants, arrays and bodies the file has."""
        arrays = ["displacement", "deformation", *(["von_mises_stress"] if self.paints else [])]
        names = ", ".join(f"{k} {body.name}" for k, body in enumerate(self.craft.bodies))
        return [
            f"{len(self.craft.times)} instants of {len(self.rest)} points: {', '.join(arrays)} in SI",
            f"bodies {names}",
        ]

    def _cells(self) -> tuple[Array, Array]:
        """Cells as VTK lists them, and their types."""
        cells, types, first = [], [], 0
        for body in self.craft.bodies:
            for kind, nodes in body.skin.cells.items():
                corners = nodes[:, : CORNERS[kind]] + first
                cells.append(np.column_stack([np.full(len(corners), CORNERS[kind]), corners]).ravel())
                types.append(np.full(len(corners), VTK_CELLS[CORNERS[kind]], np.uint8))
            first += len(body.skin.points)
        return np.concatenate(cells), np.concatenate(types)

    def _stress(self, body: MovingBody, k: int) -> NDArray[np.float32]:
        """Von Mises stress (n_p,) [Pa]; nan where there is none."""
        if body.name not in self.paints:
            return np.full(len(body.skin.points), np.nan, np.float32)
        grows = body.skin.growth is not None
        return np.asarray(self.paints[body.name].values(body.amplitudes[k, : -1 if grows else None]))


def _deformation(body: MovingBody, k: int) -> Array:
    """Elastic displacement (n_p, 3) in the axes of the body [m]; growth is none."""
    elastic = [i for i in body.kept if body.skin.growth is None or i < len(body.skin.shapes) - 1]
    return np.tensordot(body.amplitudes[k, elastic], body.skin.shapes[elastic], 1)
