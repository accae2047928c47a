"""Writing Nastran bulk data: GRIDs, elements with property ids, SETs, and their names in comments."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from femflex.arrays import Array, IntArray
from femflex.mesh.formats.contents import group_classes
from femflex.mesh.formats.nastran_cards import ORDER
from femflex.mesh.formats.register import WriteOptions
from femflex.mesh.mesh import Mesh

CARD_NAMES = {
    "line": "CBAR",
    "triangle": "CTRIA3",
    "quad": "CQUAD4",
    "triangle6": "CTRIA6",
    "quad8": "CQUAD8",
    "tetra": "CTETRA",
    "tetra10": "CTETRA",
    "pyramid": "CPYRAM",
    "pyramid13": "CPYRAM",
    "wedge": "CPENTA",
    "wedge15": "CPENTA",
    "hexahedron": "CHEXA",
    "hexahedron20": "CHEXA",
}
SET_LINE = 60  # columns of a SET line; case control allows 72


def write_nastran(path: Path, mesh: Mesh, options: WriteOptions) -> None:
    """Write a deck of GRIDs, elements and SETs, with names in comments; no properties or materials."""
    unknown = sorted(set(mesh.cells) - set(CARD_NAMES))
    if unknown:
        raise ValueError(f"Nastran has no element for cells of type {unknown}; write {path.stem}.msh or .vtu instead.")
    invalid = [name for name in mesh.groups if '"' in name or "\n" in name or not name]
    if invalid:
        raise ValueError(f"group names {invalid} cannot stand in a Nastran comment; rename them.")
    pids, names, by_set = _property_ids(mesh)
    comments = [f'$HMNAME PROP {pid:15d}"{name}"' for pid, name in names.items()]
    number, sets = 0, list[str]()
    first = dict(zip(mesh.cells, np.cumsum([1, *map(len, mesh.cells.values())]), strict=False))
    members = [("1", g, rows + 1) for g, rows in mesh.point_groups.items()]
    for group in by_set:
        by_type = mesh.cell_groups[group]
        members.append(("2", group, np.concatenate([rows + first[cell] for cell, rows in by_type.items()])))
    for kind, group, numbers in members:
        number += 1
        comments.append(f'$HMSET {number:8d} {kind:>8} "{group}"')
        sets += _set_lines(number, numbers)
    bulk = [*_grid_lines(mesh.points), *_element_lines(mesh, pids)]
    path.write_text("\n".join(["CEND", *comments, *sets, "BEGIN BULK", *bulk, "ENDDATA", ""]), encoding="utf-8")


def _property_ids(mesh: Mesh) -> tuple[dict[str, IntArray], dict[int, str], list[str]]:
    """Property id of every cell by type, name of every id ("" for cells in no group), and groups that need a SET.

    Cells with the same groups share an id. A group whose cells all have one id becomes the name of this id. Groups with
    several ids, and further groups of the same cells, are written as SETs.
    """
    pids = {cell: np.zeros(len(nodes), np.int64) for cell, nodes in mesh.cells.items()}
    kinds: dict[tuple[str, ...], int] = {}
    for cell, nodes in mesh.cells.items():
        groups = {group: by_type[cell] for group, by_type in mesh.cell_groups.items() if cell in by_type}
        for kind, rows in group_classes(groups, len(nodes)):
            pids[cell][rows] = kinds.setdefault(kind, len(kinds) + 1)
    names, by_set = dict.fromkeys(kinds.values(), ""), list[str]()
    for group, by_type in mesh.cell_groups.items():
        ids = [pid for kind, pid in kinds.items() if group in kind]
        if len(ids) == 1 and not names[ids[0]]:
            names[ids[0]] = group
        elif by_type:
            by_set.append(group)
    return pids, names, by_set


def _set_lines(number: int, members: IntArray) -> list[str]:
    """Lines of SET number = ..., with consecutive numbers shortened by THRU."""
    ordered = np.unique(members)
    words = []
    for run in np.split(ordered, np.flatnonzero(np.diff(ordered) != 1) + 1):
        words += [f"{run[0]} THRU {run[-1]}"] if len(run) > 2 else [str(n) for n in run]
    lines, line = [], f"SET {number} = "
    for k, word in enumerate(words):
        if len(line) + len(word) > SET_LINE:
            lines.append(line.rstrip())
            line = " "
        line += word + (", " if k + 1 < len(words) else "")
    return [*lines, line.rstrip()]


def _grid_lines(points: Array) -> list[str]:
    lines = []
    for k, (x, y, z) in enumerate(points):
        lines.append(f"GRID*   {k + 1:16d}{'':16}{_field(x):>16}{_field(y):>16}*")
        lines.append(f"*       {_field(z):>16}")
    return lines


def _field(value: float) -> str:
    """The value in at most 16 columns, with as many digits as fit and always with a decimal point."""
    for digits in range(17, 8, -1):
        text = f"{value:.{digits}g}"
        if "e" in text:
            mantissa, exponent = text.split("e")
            text = f"{mantissa}{'' if '.' in mantissa else '.'}E{int(exponent):+d}"
        elif "." not in text:
            text += "."
        if len(text) <= 16:
            return text
    raise AssertionError(value)  # 9 digits always fit


def _element_lines(mesh: Mesh, pids: dict[str, IntArray]) -> list[str]:
    """Element cards in fields of eight columns, numbered from 1 through all types; a card is continued by +."""
    lines, number = list[str](), 0
    for cell, nodes in mesh.cells.items():
        rows = (nodes[:, ORDER[cell]] if cell in ORDER else nodes) + 1
        for pid, row in zip(pids[cell].tolist(), rows.tolist(), strict=True):
            number += 1
            words = [f"{word:<8}" for word in (number, pid, *row)]
            heads = [CARD_NAMES[cell], *["+"] * (len(words) // 8)]
            lines += [f"{head:<8}{''.join(words[8 * k : 8 * k + 8])}" for k, head in enumerate(heads) if words[8 * k :]]
    return lines
