"""Nastran bulk data (.bdf, .nas, .dat): groups are property ids and SETs of nodes or elements.

Nastran numbers its groups. Their names come from the caller's mapping, or from comments in the form of HyperMesh and
Femap; such comments are also written here.
"""

from __future__ import annotations

import re
from collections import Counter
from pathlib import Path

import numpy as np

from femflex.arrays import Array, IntArray
from femflex.mesh.formats.contents import Block, Contents, group_classes
from femflex.mesh.formats.element_blocks import MISSING, NumberedElement, blocks_of, require_nodes
from femflex.mesh.formats.nastran_cards import NAME, ORDER, Deck, named_sets, read_deck, real
from femflex.mesh.formats.numbers import Numbers
from femflex.mesh.formats.register import WriteOptions, register
from femflex.mesh.mesh import Mesh

# Card -> possible numbers of nodes, and the cell for each.
ELEMENTS: dict[str, dict[int, str]] = {
    **{card: {2: "line"} for card in ("CBAR", "CBEAM", "CROD", "CTUBE", "CONROD")},
    **{card: {3: "triangle"} for card in ("CTRIA3", "CTRIAR")},
    **{card: {4: "quad"} for card in ("CQUAD4", "CQUADR", "CSHEAR")},
    "CTRIA6": {3: "triangle", 6: "triangle6"},
    "CQUAD8": {4: "quad", 8: "quad8"},
    "CTETRA": {4: "tetra", 10: "tetra10"},
    "CPENTA": {6: "wedge", 15: "wedge15"},
    **{card: {5: "pyramid", 13: "pyramid13"} for card in ("CPYRAM", "CPYRA")},
    "CHEXA": {8: "hexahedron", 20: "hexahedron20"},
}
OTHER_ELEMENTS = re.compile(
    r"(CAABSF|CBEND|CBEAM3|CBUSH|CDAMP|CELAS|CFAST|CGAP|CHACAB|CHBDY|CMASS|CONM|CPYRA|CQUAD|CRAC|CSEAM|CTRA?X|CTRIAX"
    r"|CVISC|CWELD|PLOTEL|RBAR|RBE|RJOINT|RROD|RSPLINE|RSSCON|RTRPLT)"
)
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


def read_nastran(path: Path) -> Contents:
    """Contents of a deck; groups without a name are called pid_3 and set_4."""
    deck = read_deck(path)
    grids = _grids(deck, path)
    row_of_grid = {number: k for k, number in enumerate(grids)}
    elements, properties, left_out = _elements(deck, path)
    require_nodes(elements, row_of_grid, path.name, "GRID card")
    members = {f"pid_{pid}": Numbers(tuple(numbers)) for pid, numbers in sorted(properties.items()) if pid}
    blocks = blocks_of(elements, row_of_grid, members)
    block_row: dict[int, tuple[int, int]] = {}
    for k, cell in enumerate(dict.fromkeys(element.cell for element in elements)):
        same_cell = (element for element in elements if element.cell == cell)
        block_row |= {element.number: (k, row) for row, element in enumerate(same_cell)}
    point_groups = _sets(deck, row_of_grid, block_row, blocks)
    titles = {f"set_{n}": name for n, (_, name) in deck.set_names.items() if n in deck.sets}
    titles |= {f"pid_{n}": name for n, name in deck.property_names.items() if name}
    for number in [n for n, name in deck.property_names.items() if not name]:  # written for cells in no group
        for block in blocks:
            block.groups.pop(f"pid_{number}", None)
    return Contents(np.array(list(grids.values())), blocks, point_groups, titles=titles, left_out=left_out)


def _grids(deck: Deck, path: Path) -> dict[int, list[float]]:
    """Coordinates by grid number; only the basic coordinate system is supported."""
    default = next((f[1] for name, f in deck.cards if name == "GRDSET"), "")
    grids, in_local_systems = {}, []
    for name, fields in deck.cards:
        if name == "GRID":
            if (fields[1] or default) not in ("", "0"):
                in_local_systems.append(fields[0])
            grids[int(fields[0])] = [_number(word, f"GRID {fields[0]}", path) for word in fields[2:5]]
    if in_local_systems:
        raise ValueError(
            f"{path.name}: {len(in_local_systems)} GRID cards, the first is {in_local_systems[0]}, are given in a "
            "local coordinate system (field CP); meshes are read in the basic system alone. In a case, give the file "
            "as `deck`, which reads local systems; or write it in basic coordinates."
        )
    if not grids:
        raise ValueError(f"{path.name} has no GRID cards; it is no Nastran bulk data with a mesh.")
    return grids


def _number(word: str, card: str, path: Path) -> float:
    """A Nastran real, blank as zero."""
    try:
        return real(word or "0.0")
    except ValueError:
        raise ValueError(
            f"{path.name}: {card} has {word!r} where a number belongs; correct the field, or the columns of the card."
        ) from None


def _elements(deck: Deck, path: Path) -> tuple[list[NumberedElement], dict[int, list[int]], Counter[str]]:
    """Elements, numbers of the elements of each property, and the count of unsupported elements by card."""
    elements, properties, left_out = list[tuple[str, NumberedElement]](), dict[int, list[int]](), Counter[str]()
    for name, fields in deck.cards:
        if name not in ELEMENTS:
            if OTHER_ELEMENTS.match(name):
                left_out[name] += 1
            continue
        cells = ELEMENTS[name]
        start, pid = (1, 0) if name == "CONROD" else (2, int(fields[1] or fields[0]))
        words = [*fields[start : start + max(cells)], *[""] * max(cells)][: max(cells)]
        corners, node_numbers = min(cells), [int(word) for word in words if word]
        if "" in words[:corners] or len([word for word in words if word]) < corners:
            raise ValueError(
                f"{path.name}: {name} {fields[0]} has {len([w for w in words[:corners] if w])} nodes; it needs "
                f"{corners} corners."
            )
        if len(node_numbers) > corners:
            node_numbers = [int(word) if word else MISSING for word in words]
        cell = cells[len(node_numbers)]
        if deck.by_gmsh and name == "CBAR" and fields[4].isdigit():
            cell, node_numbers = "line3", [*node_numbers, int(fields[4])]
        nodes = [node_numbers[k] for k in ORDER[cell]] if cell in ORDER else node_numbers
        number = int(fields[0])
        elements.append((name, NumberedElement(cell, number, nodes)))
        properties.setdefault(pid, []).append(number)
    elements.sort(key=lambda e: (e[0], len(e[1].nodes)))  # one run of each type
    return [element for _, element in elements], properties, left_out


def _sets(
    deck: Deck, row_of_grid: dict[int, int], block_row: dict[int, tuple[int, int]], blocks: list[Block]
) -> dict[str, IntArray]:
    """Point groups of the deck's SETs; SETs of elements are added to the groups of the blocks.

    A comment or a SET3 card gives the kind. Otherwise a SET is one of points if all its numbers are grid points.
    """
    sets, wrong = named_sets(deck)
    if wrong:
        raise ValueError(wrong[0][1])
    point_groups: dict[str, IntArray] = {}
    for number, (members, known_kind) in sets.items():
        kind = known_kind or ("1" if members.all_in(row_of_grid) else "2")
        existing = members.among(row_of_grid if kind == "1" else block_row)
        if kind == "1":
            point_groups[f"set_{number}"] = np.array([row_of_grid[m] for m in existing], np.int64)
            continue
        rows: dict[int, list[int]] = {}
        for member in existing:
            rows.setdefault(block_row[member][0], []).append(block_row[member][1])
        for k, block_rows in rows.items():
            blocks[k].groups[f"set_{number}"] = np.array(block_rows)
    return point_groups


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


register(NAME, (".bdf", ".nas", ".dat"), read_nastran, write_nastran, memory=25.0)  # measured: 16
