"""Parts of universal files, a small sheet, and ways to damage a file, for tests of mesh formats."""

from __future__ import annotations

import random
import re
from pathlib import Path

import numpy as np
import pytest

from femflex.mesh import Mesh

WRONG = [b"1000000000", b"400000000", b"99999999999999999999", b"-1", b"0", b"1e300", b"nan", b"4294967295", b"x"]


def dataset(number: int, *lines: str) -> str:
    return "\n".join(["    -1", f"{number:6d}", *lines, "    -1", ""])


def unv_elements(cells: list[tuple[int, int, int, list[int]]]) -> list[str]:
    """Dataset 2412 of (number, descriptor, property, nodes)."""
    lines = []
    for number, kind, prop, nodes in cells:
        lines.append("".join(f"{value:10d}" for value in (number, kind, prop, 1, 7, len(nodes))))
        lines += ["         0         1         1"] if kind in (11, 21, 22, 24) else []
        lines += ["".join(f"{n:10d}" for n in nodes[k : k + 8]) for k in range(0, len(nodes), 8)]
    return lines


def unv_nodes(points: np.ndarray) -> list[str]:
    """Dataset 2411, numbered from 11."""
    lines = []
    for k, row in enumerate(points):
        lines += [f"{k + 11:10d}{1:10d}{1:10d}{11:10d}", "".join(f"{x:25.16E}" for x in row).replace("E", "D")]
    return lines


def sheet() -> Mesh:
    """Twelve quads in a group, with an edge."""
    x, y = (a.ravel() for a in np.meshgrid(np.arange(5.0), np.arange(4.0), indexing="ij"))
    first = np.array([4 * i + j for i in range(4) for j in range(3)])
    quads = np.column_stack([first, first + 4, first + 5, first + 1])
    return Mesh(np.column_stack([x, y, 0 * x]), {"quad": quads}, {"sheet": {"quad": np.arange(12)}}, {"edge": range(4)})


def damaged(data: bytes, generator: random.Random) -> bytes:
    """The bytes cut short, with bits turned over, with a piece taken out, or with a number replaced."""
    kind, changed, at = generator.randrange(5), bytearray(data), generator.randrange(len(data))
    if kind == 0:
        return data[:at]
    if kind == 1:
        changed[at] ^= 1 << generator.randrange(8)
    elif kind == 2:
        del changed[at : at + generator.randrange(1, 64)]
    elif kind == 3:
        changed[at : at + 8] = generator.choice([b"\xff" * 8, (10**9).to_bytes(8, "little"), bytes(8)])
    else:
        numbers = list(re.finditer(rb"(?<![\w.])\d+(?![\w.])", data))
        found = generator.choice(numbers) if numbers else None
        return data if found is None else data[: found.start()] + generator.choice(WRONG) + data[found.end() :]
    return bytes(changed)


def written_exodus(mesh: Mesh, path: Path) -> None:
    """Write a file of Exodus by VTK's own writer."""
    pyvista = pytest.importorskip("pyvista")
    writer = pytest.importorskip("vtkmodules.vtkIOExodus").vtkExodusIIWriter()
    kinds = {"line": 3, "triangle": 5, "quad": 9, "hexahedron": 12, "tetra10": 24, "hexahedron20": 25}
    writer.SetInputData(pyvista.UnstructuredGrid({kinds[cell]: rows for cell, rows in mesh.cells.items()}, mesh.points))
    writer.SetFileName(str(path))
    writer.Write()
