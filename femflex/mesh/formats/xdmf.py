"""XDMF (.xdmf, .xmf, of FEniCS and others): an array of few integers over cells or points is one group per value.

Several grids are joined; their points at identical positions are merged.
"""

from __future__ import annotations

from collections import Counter
from pathlib import Path

import numpy as np

from femflex.arrays import IntArray
from femflex.mesh.formats.contents import Block, Contents
from femflex.mesh.formats.register import register
from femflex.mesh.formats.vtk_data import leaf_contents
from femflex.mesh.formats.vtk_process import read_leaves

NAME = "XDMF"


def read_xdmf(path: Path) -> Contents:
    """Contents of a file; paths of its heavy data are relative to its folder."""
    parts = [leaf_contents(leaf) for leaf in read_leaves("xdmf", path)]
    if len(parts) == 1:
        return parts[0]
    starts = np.cumsum([0, *(len(part.points) for part in parts)])
    points, point_index = np.unique(np.concatenate([part.points for part in parts]), axis=0, return_inverse=True)
    point_index = point_index.ravel()
    blocks = [
        Block(block.cell, point_index[block.nodes + start], block.groups)
        for part, start in zip(parts, starts, strict=False)
        for block in part.blocks
    ]
    point_groups: dict[str, IntArray] = {}
    for part, start in zip(parts, starts, strict=False):
        for name, rows in part.point_groups.items():
            point_groups[name] = np.union1d(point_groups.get(name, rows[:0]), point_index[rows + start])
    left_out: Counter[str] = Counter()
    for part in parts:
        left_out.update(part.left_out)
    return Contents(points, blocks, point_groups, left_out=left_out)


register(NAME, (".xdmf", ".xmf"), read_xdmf)
