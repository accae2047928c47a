"""Coordinates of nodes and maps of degrees of freedom: tables, Abaqus *NODE, and the map of CalculiX."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from femflex.matrices.contents import Contents, register
from femflex.mesh.formats.guards import check_count
from femflex.mesh.formats.numbers import inclusive_range


def _table(path: Path) -> Contents:
    """Contents of a text table, with columns separated by commas, semicolons or blanks: rows id, x, y, z, or rows node,
    component of a map."""
    rows = []
    for line in path.read_text(encoding="utf-8", errors="replace").splitlines():
        words = re.split(r"[,;\s]+", line.split("#")[0].strip())
        if not words[0] or not re.match(r"[-+]?\d", words[0]):
            continue  # a heading
        rows.append(words)
    widths = {len([w for w in row if w]) for row in rows}
    if widths == {4}:
        values = np.array([[float(x) for x in row[:4]] for row in rows])
        return Contents(ids=values[:, 0].astype(np.int64), points=values[:, 1:])
    if widths == {2}:
        return Contents(dofs=np.array([[int(x) for x in row[:2]] for row in rows], np.int64))
    raise ValueError(
        f"{path.name} has rows of {sorted(widths)} values; a table of nodes has four (number, x, y, z), a map of "
        "degrees of freedom two (node, component 1 to 6)"
    )


def _abaqus(path: Path) -> Contents:
    """Nodes of *NODE blocks, and groups of *NSET."""
    ids, points, sets = list[int](), list[list[float]](), dict[str, list[int]]()
    keyword, options = "", dict[str, str]()
    for line in path.read_text(encoding="utf-8", errors="replace").splitlines():
        if line.startswith("**") or not line.strip():
            continue
        if line.startswith("*"):
            head, *rest = (word.strip() for word in line[1:].split(","))
            keyword = head.upper()
            options = {k.strip().upper(): v.strip() for k, _, v in (word.partition("=") for word in rest)}
            continue
        words = [word.strip() for word in line.split(",") if word.strip()]
        if keyword == "NODE":
            ids.append(int(words[0]))
            points.append([float(x) for x in words[1:4]] + [0.0] * (4 - len(words[:4])))
            if "NSET" in options:
                sets.setdefault(options["NSET"], []).append(ids[-1])
        elif keyword == "NSET" and "ELSET" not in options:
            numbers = sets.setdefault(options.get("NSET", "set"), [])
            if "GENERATE" in options:
                span = inclusive_range(*(int(word) for word in words[:3]))
                check_count(len(span), f"{path.name}: *NSET, GENERATE {line.strip()}")
                numbers += span
                continue
            for word in words:
                numbers += [int(word)] if word.isdigit() else list(_set_members(sets, word))
    if not ids:
        raise ValueError(f"{path.name} has no *NODE block; name the input file that has the coordinates")
    groups = {name: np.unique(numbers) for name, numbers in sets.items()}
    return Contents(ids=np.array(ids, np.int64), points=np.array(points), groups=groups)


def _set_members(sets: Mapping[str, list[int]], name: str) -> list[int]:
    """The numbers in a set; capitals do not matter. Raises ValueError for an unknown set."""
    members = next((numbers for set_name, numbers in sets.items() if set_name.upper() == name.upper()), None)
    if members is None:
        raise ValueError(f"*NSET names {name!r}, which is no set before it; define it above, or list its numbers")
    return members


def _calculix_map(path: Path) -> Contents:
    """Map of degrees of freedom written by CalculiX: node.component per line."""
    rows = [line.strip().split(".") for line in path.read_text().splitlines() if line.strip()]
    return Contents(dofs=np.array([[int(node), int(component)] for node, component in rows], np.int64))


register("table of nodes or of degrees of freedom", (".csv", ".txt"), _table)
register("Abaqus input file", (".inp",), _abaqus)
register("CalculiX map of degrees of freedom", (".dof",), _calculix_map)
