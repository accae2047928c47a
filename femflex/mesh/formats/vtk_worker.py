"""The process that calls VTK's readers: a damaged file may end it, but not the program that reads the mesh.

It runs as a separate script, which loads only numpy and VTK's readers. A request is (reader, path, bytes of
memory); the answer is a list of leaves, or a text that begins with "VTK".
"""

from __future__ import annotations

import os
import pickle
import sys
from pathlib import Path
from typing import Any

import numpy as np

Leaf = dict[str, Any]  # name, points, kinds, offsets, nodes, cell arrays, point arrays


def serve() -> None:
    """Answer requests on standard input until it ends; VTK's printed output is discarded."""
    requests, answers = sys.stdin.buffer, os.fdopen(os.dup(1), "wb")
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
    while True:
        try:
            kind, path, memory = pickle.load(requests)
        except EOFError:
            return
        _limit_memory(memory)
        try:
            answer: list[Leaf] | str = _read_data_sets(kind, path)
        except MemoryError:
            answer = "VTK: it takes more memory than is free"
        except Exception as error:
            answer = f"VTK: {error}"
        pickle.dump(answer, answers, protocol=5)
        answers.flush()


def _limit_memory(memory: float) -> None:
    """Limit the additional memory of this process in bytes, on systems that support it."""
    try:
        import resource

        used = int(Path("/proc/self/statm").read_text().split()[0]) * os.sysconf("SC_PAGE_SIZE")
        _, hard = resource.getrlimit(resource.RLIMIT_AS)
        limit = int(used + memory)
        resource.setrlimit(resource.RLIMIT_AS, (limit if hard == resource.RLIM_INFINITY else min(limit, hard), hard))
    except (ImportError, OSError, ValueError):
        pass


def _read_data_sets(kind: str, path: str) -> list[Leaf]:
    from vtkmodules.vtkCommonCore import vtkOutputWindow, vtkStringOutputWindow

    messages = vtkStringOutputWindow()
    vtkOutputWindow.SetInstance(messages)
    if kind == "ansys":
        return [_ansys_leaf(path)]
    reader = _vtk_reader(kind)
    reader.SetFileName(path)
    if kind.startswith("exodus"):
        _select_blocks(reader, sets=kind == "exodus")
    reader.Update()
    text = " ".join(messages.GetOutput().split())
    if "ERR|" in text or "ERROR:" in text.upper() or reader.GetErrorCode():
        raise ValueError(text[:1000] or f"error {reader.GetErrorCode()}")
    return [_leaf(name, grid) for name, grid in _leaves(reader.GetOutputDataObject(0), "")]


def _vtk_reader(kind: str) -> Any:
    if kind == "vtu":
        from vtkmodules.vtkIOXML import vtkXMLUnstructuredGridReader

        return vtkXMLUnstructuredGridReader()
    if kind == "vtk":
        from vtkmodules.vtkIOLegacy import vtkDataSetReader

        reader = vtkDataSetReader()
        for read_all in (reader.ReadAllScalarsOn, reader.ReadAllFieldsOn, reader.ReadAllVectorsOn):
            read_all()
        return reader
    if kind.startswith("exodus"):
        from vtkmodules.vtkIOExodus import vtkExodusIIReader

        return vtkExodusIIReader()
    from vtkmodules.vtkIOXdmf2 import vtkXdmfReader

    return vtkXdmfReader()


def _ansys_leaf(path: str) -> Leaf:
    """The elements of an archive of Ansys (CDWRITE), with its components as arrays."""
    from mapdl_archive import Archive

    archive = Archive(path, verbose=False)
    return _leaf("", archive.grid)


def _select_blocks(reader: Any, sets: bool) -> None:
    """Select the blocks of an Exodus file, and its sets if requested, with node numbers."""
    reader.UpdateInformation()
    reader.GenerateGlobalNodeIdArrayOn()
    reader.SetDisplayType(0)
    for kind in (reader.ELEM_BLOCK, reader.FACE_BLOCK, reader.EDGE_BLOCK, reader.SIDE_SET, reader.NODE_SET):
        for k in range(reader.GetNumberOfObjects(kind)):
            reader.SetObjectStatus(kind, k, int(sets or kind not in (reader.SIDE_SET, reader.NODE_SET)))


def _leaves(data: Any, name: str) -> list[tuple[str, Any]]:
    """Single data sets of a composite one, with their path of names, such as "Element Blocks/wing"."""
    if data is None:
        raise ValueError("there is no data set")
    if not data.IsA("vtkMultiBlockDataSet"):
        return [(name, data)]
    leaves = []
    for k in range(data.GetNumberOfBlocks()):
        block = data.GetBlock(k)
        if block is None:
            continue
        info = data.GetMetaData(k) if data.HasMetaData(k) else None
        key = type(data).NAME()
        block_name = info.Get(key) if info is not None and info.Has(key) else str(k + 1)
        leaves += _leaves(block, f"{name}/{block_name}" if name else block_name)
    return leaves


def _leaf(name: str, data: Any) -> Leaf:
    from vtkmodules.util.numpy_support import vtk_to_numpy

    grid = _unstructured_grid(data)
    leaf: Leaf = {"name": name, "points": np.zeros((0, 3)), "kinds": [], "offsets": [0], "nodes": []}
    if grid.GetPoints() is not None and grid.GetNumberOfPoints():
        leaf["points"] = np.array(vtk_to_numpy(grid.GetPoints().GetData()), float)
    if grid.GetNumberOfCells():
        cells = grid.GetCells()
        leaf["kinds"] = np.array([grid.GetCellType(k) for k in range(grid.GetNumberOfCells())], np.int64)
        leaf["offsets"] = np.array(vtk_to_numpy(cells.GetOffsetsArray()), np.int64)
        leaf["nodes"] = np.array(vtk_to_numpy(cells.GetConnectivityArray()), np.int64)
    for key, attributes in (
        ("cell", grid.GetCellData()),
        ("point", grid.GetPointData()),
        ("field", data.GetFieldData()),
    ):
        arrays = [attributes.GetArray(k) for k in range(attributes.GetNumberOfArrays())]
        leaf[key] = {a.GetName(): np.array(vtk_to_numpy(a)) for a in arrays if a is not None and a.GetName()}
    return leaf


def _unstructured_grid(data: Any) -> Any:
    """An unstructured grid of any single data set, with its arrays."""
    from vtkmodules.vtkFiltersCore import vtkAppendFilter

    if data.IsA("vtkUnstructuredGrid"):
        return data
    joined = vtkAppendFilter()
    joined.AddInputData(data)
    joined.Update()
    return joined.GetOutput()


if __name__ == "__main__":
    serve()
