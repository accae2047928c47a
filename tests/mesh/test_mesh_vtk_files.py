"""Files that VTK reads, written here as text: data sets of every kind as femflex takes them, and readers that end."""

from __future__ import annotations

import signal
from pathlib import Path

import numpy as np
import pytest
from test_mesh_other_numbers import GRID, leaf, xdmf_grid
from vtkmodules.vtkCommonDataModel import vtkMultiBlockDataSet, vtkUnstructuredGrid

from femflex.mesh import io_exodus, io_xdmf, vtk_process
from femflex.mesh.io_vtk import read_vtk
from femflex.mesh.vtk_process import VtkError, read_leaves
from femflex.mesh.vtk_worker import _leaves


def legacy(folder: Path, data: str, name: str = "a.vtk") -> Path:
    path = folder / name
    path.write_text(f"# vtk DataFile Version 3.0\na title\nASCII\n{data}")
    return path


def test_blocks_without_names_are_numbered_by_their_places():
    """An empty block, a data set, a block of two, one of which has a name, and another data set."""
    names = []
    inner, outer = vtkMultiBlockDataSet(), vtkMultiBlockDataSet()
    inner.SetBlock(0, vtkUnstructuredGrid())
    inner.SetBlock(1, vtkUnstructuredGrid())
    inner.GetMetaData(1).Set(vtkMultiBlockDataSet.NAME(), "wing")
    outer.SetNumberOfBlocks(4)
    outer.SetBlock(1, vtkUnstructuredGrid())
    outer.SetBlock(2, inner)
    outer.SetBlock(3, vtkUnstructuredGrid())
    names = [name for name, _ in _leaves(outer, "")]
    assert names == ["2", "3/1", "3/wing", "4"]
    assert [name for name, _ in _leaves(inner, "tail")] == ["tail/1", "tail/wing"]


def test_a_structured_grid_is_cells_with_all_of_its_arrays(tmp_path: Path):
    """Six points in two rows; two scalars, vectors and a field over cells, one over points, one of the whole."""
    text = """DATASET STRUCTURED_GRID
FIELD whole 1
origin 2 1 double
7.5 8.5
DIMENSIONS 3 2 1
POINTS 6 double
0 0 1  1 0 1  2.5 0 1  0 2 1  1 2 1  2.5 2 1
CELL_DATA 2
SCALARS first int 1
LOOKUP_TABLE default
4 5
SCALARS second int 1
LOOKUP_TABLE default
6 8
VECTORS push double
1 2 3  4 5 6
FIELD further 1
third 1 2 int
9 3
POINT_DATA 6
SCALARS hinge int 1
LOOKUP_TABLE default
1 0 0 1 0 1
"""
    (found,) = read_leaves("vtk", legacy(tmp_path, text))
    assert found["name"] == ""
    assert found["points"] == pytest.approx(np.array([[x, y, 1] for y in (0, 2) for x in (0, 1, 2.5)]))
    assert found["kinds"].tolist() == [9, 9] and found["offsets"].tolist() == [0, 4, 8]
    assert found["nodes"].tolist() == [0, 1, 4, 3, 1, 2, 5, 4]
    assert {k: v.tolist() for k, v in found["cell"].items()} == {
        "first": [4, 5], "second": [6, 8], "push": [[1, 2, 3], [4, 5, 6]], "third": [9, 3],
    }  # fmt: skip
    assert {k: v.tolist() for k, v in found["point"].items()} == {"hinge": [1, 0, 0, 1, 0, 1]}
    assert found["field"]["origin"].ravel().tolist() == [7.5, 8.5]


def test_an_unstructured_grid_keeps_the_order_of_its_cells(tmp_path: Path):
    """A tetrahedron, a line and two triangles between one another."""
    text = """DATASET UNSTRUCTURED_GRID
POINTS 5 double
0 0 0  1 0 0  0 1 0  0 0 1  3 0 0
CELLS 4 16
3 0 1 2
4 0 1 2 3
2 1 4
3 1 2 3
CELL_TYPES 4
5
10
3
5
"""
    (found,) = read_leaves("vtk", legacy(tmp_path, text))
    assert found["kinds"].tolist() == [5, 10, 3, 5] and found["offsets"].tolist() == [0, 3, 7, 9, 12]
    assert found["nodes"].tolist() == [0, 1, 2, 0, 1, 2, 3, 1, 4, 1, 2, 3]
    assert found["cell"] == {} and found["point"] == {}


@pytest.mark.parametrize("size", [7, 9])
def test_a_count_of_numbers_that_the_cells_do_not_have_is_refused(size: int, tmp_path: Path):
    """Two triangles, of 3 nodes and a count each: 8 numbers. VTK reads beyond 7, and 9 as a third cell."""
    text = "DATASET UNSTRUCTURED_GRID\nPOINTS 4 double\n0 0 0  1 0 0  0 1 0  1 1 0\nCELLS 2 {}\n3 0 1 2\n3 1 3 2\n"
    path = legacy(tmp_path, text.format(size) + "CELL_TYPES 2\n5\n5\n")
    with pytest.raises(ValueError, match=rf"its line CELLS 2 {size} and its cells do not agree; the second number"):
        read_vtk(path)
    assert len(read_vtk(legacy(tmp_path, text.format(8) + "CELL_TYPES 2\n5\n5\n")).blocks[0].nodes) == 2


def test_collections_of_grids_are_listed_with_their_names_along_the_way(tmp_path: Path):
    inner = xdmf_grid("b", GRID[[2, 5, 1, 4]], [[2, 0, 1, 3]], [7], [0, 1, 0, 0])
    inner += xdmf_grid("d", GRID[[0, 1, 3]], [[0, 1, 2]], [3], [0, 0, 1], kind="Triangle")
    first = xdmf_grid("a", GRID[[4, 0, 1, 3]], [[1, 2, 0, 3]], [7], [1, 1, 0, 0])
    path = tmp_path / "two.xdmf"
    tree = '<Grid Name="{}" GridType="Tree">{}</Grid>'
    path.write_text(
        '<?xml version="1.0"?><Xdmf Version="2.0"><Domain>'
        + tree.format("whole", first + tree.format("c", inner))
        + "</Domain></Xdmf>"
    )
    found = read_leaves("xdmf", path)
    assert [one["name"] for one in found] == ["a", "c/b", "c/d"]
    assert [one["kinds"].tolist() for one in found] == [[9], [9], [5]]
    assert found[1]["points"] == pytest.approx(GRID[[2, 5, 1, 4]]) and found[2]["nodes"].tolist() == [0, 1, 2]
    assert found[2]["cell"]["mat"].tolist() == [3] and found[2]["point"]["hinge"].tolist() == [0, 0, 1]


def test_grids_of_xdmf_share_points_and_sum_what_is_left_out(monkeypatch: pytest.MonkeyPatch, tmp_path: Path):
    """Three grids; a polygon of each of two is left out, and a group of points is that of all."""
    parts = [
        leaf("a", GRID[[0, 1, 4, 3]], [1, 2, 3, 4], [9, 7], [[0, 1, 2, 3], [0, 1, 2]]),
        leaf("b", GRID[[1, 2, 5, 4]], [1, 2, 3, 4], [9], [[0, 1, 2, 3]]),
        leaf("c", GRID[[2, 6, 5]], [1, 2, 3], [5, 7, 7], [[0, 1, 2], [0, 1, 2], [2, 1, 0]]),
    ]
    for part, marks in zip(parts, ([1, 0, 0, 0], [0, 0, 1, 0], [0, 1, 0]), strict=True):
        part["point"] = {"hinge": np.array(marks)}
        part["cell"] = {"mat": np.full(len(part["kinds"]), 5)}
    monkeypatch.setattr(io_xdmf, "read_leaves", lambda kind, path: parts)
    found = io_xdmf.read(tmp_path / "x.xdmf")
    assert len(found.points) == 7 and found.left_out == {"VTK type 7": 3}
    places = [[found.points[n].tolist() for n in row] for block in found.blocks for row in block.nodes]
    assert places == [GRID[row].tolist() for row in ([0, 1, 4, 3], [1, 2, 5, 4], [2, 6, 5])]
    assert [block.groups["mat_5"].tolist() for block in found.blocks] == [[0], [0], [0]]
    assert sorted(found.points[found.point_groups["hinge"]].tolist()) == sorted(GRID[[0, 5, 6]].tolist())


def test_what_is_left_out_of_the_blocks_of_exodus_is_summed_and_that_of_sets_is_not(monkeypatch: pytest.MonkeyPatch):
    one = leaf("Element Blocks/a ID: 1", GRID[[0, 1, 4]], [1, 2, 5], [7, 5], [[0, 1, 2], [0, 1, 2]])
    two = leaf("Element Blocks/b ID: 2", GRID[[1, 2, 5]], [2, 3, 6], [7, 7, 5], [[0, 1, 2], [2, 1, 0], [2, 0, 1]])
    side = leaf("Side Sets/c ID: 3", GRID[[1, 2, 5]], [2, 3, 6], [7, 3], [[0, 1, 2], [0, 1]])
    monkeypatch.setattr(io_exodus, "read_leaves", lambda kind, path: [one, two, side])
    found = io_exodus.read(Path("x.exo"))
    assert found.left_out == {"VTK type 7": 3}
    groups = {(b.cell, name): rows.tolist() for b in found.blocks for name, rows in b.groups.items()}
    assert groups == {("triangle", "a"): [0], ("triangle", "b"): [1], ("line", "c"): [0]}
    empty = leaf("Element Blocks/a ID: 1", np.zeros((0, 3)), [], [], [])
    monkeypatch.setattr(io_exodus, "read_leaves", lambda kind, path: [empty])
    assert len(io_exodus.read(Path("x.exo")).points) == 0


def test_files_that_vtk_cannot_read_end_in_its_own_words_and_the_next_one_is_read(tmp_path: Path):
    bad = legacy(tmp_path, "DATASET UNSTRUCTURED_GRID\nPOINTS 2 double\n0 0 0 1 0\n", "bad.vtk")
    with pytest.raises(VtkError, match=r"^VTK: .*ERR"):
        read_leaves("vtk", bad)
    good = legacy(tmp_path, "DATASET POLYDATA\nPOINTS 3 double\n0 0 0 1 0 0 0 1 0\nPOLYGONS 1 4\n3 2 0 1\n")
    (found,) = read_leaves("vtk", good)
    assert found["kinds"].tolist() == [5] and found["nodes"].tolist() == [2, 0, 1]


def test_a_reader_that_has_ended_is_started_again(tmp_path: Path):
    good = legacy(tmp_path, "DATASET POLYDATA\nPOINTS 2 double\n0 0 0 1 0 0\nLINES 1 3\n2 1 0\n")
    read_leaves("vtk", good)
    (process,) = vtk_process._running
    process.send_signal(signal.SIGKILL)
    process.wait()
    (found,) = read_leaves("vtk", good)
    assert found["kinds"].tolist() == [3] and found["nodes"].tolist() == [1, 0]
    (other,) = vtk_process._running
    assert other.pid != process.pid


class Pipe:
    """A pipe of a process that answers nothing."""

    def __init__(self, read: bytes = b"") -> None:
        self.answer, self.closed = read, False

    def write(self, data: bytes) -> int:
        return len(data)

    def read(self, n: int = -1) -> bytes:
        return b""

    def readline(self) -> bytes:
        return b""

    def readinto(self, buffer: bytearray) -> int:
        return 0

    def flush(self) -> None:
        pass

    def close(self) -> None:
        self.closed = True
        raise OSError


class Stubborn:
    """A process that neither answers nor ends by itself."""

    def __init__(self) -> None:
        self.stdin, self.stdout, self.killed, self.waited = Pipe(), Pipe(), 0, list[float | None]()

    def poll(self) -> None:
        return None

    def wait(self, timeout: float | None = None) -> int:
        self.waited.append(timeout)
        if not self.killed:
            raise vtk_process.subprocess.TimeoutExpired("reader", timeout or 0.0)
        return -9

    def kill(self) -> None:
        self.killed += 1


def test_a_reader_that_answers_nothing_is_ended_and_forgotten(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    process = Stubborn()
    monkeypatch.setattr(vtk_process, "_running", [process])
    path = legacy(tmp_path, "DATASET POLYDATA\n")
    with pytest.raises(VtkError, match=r"^the reader of VTK ended on it$"):
        read_leaves("vtk", path)
    assert vtk_process._running == [] and process.killed == 1 and process.waited == [5.0, None]
    assert process.stdin.closed and process.stdout.closed


def test_element_types_that_vtk_does_not_read_are_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    import io
    import pickle

    process = Stubborn()
    text = "VTK: ERR| reader: Unsupported element type: HEX64 in block 3"
    process.stdout = io.BytesIO(pickle.dumps(text))
    monkeypatch.setattr(vtk_process, "_running", [process])
    path = legacy(tmp_path, "DATASET POLYDATA\n", "wing.exo")
    with pytest.raises(
        ValueError, match=r"^wing\.exo has elements of type HEX64, which VTK does not read; write it wit"
    ):
        read_leaves("exodus", path)
    assert vtk_process._running == [process]
