"""Coordinates of nodes: tables, Nastran GRID cards with coordinate systems, Abaqus *NODE, and meshes."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from femflex.matrices.contents import Contents, register

Array = NDArray[np.float64]
Index = NDArray[np.int64]

SYSTEMS = {"CORD2R": 0, "CORD2C": 1, "CORD2S": 2}  # rectangular, cylindrical, spherical


def nastran_number(text: str) -> float:
    """A real number as Nastran writes it: 1.5, 1.5E-3, 1.5D-3, 1.5-3; 0 for an empty field."""
    text = text.strip().upper().replace("D", "E")
    if not text:
        return 0.0
    try:
        return float(text)
    except ValueError:
        return float(re.sub(r"(?<=[\d.])([+-]\d+)$", r"E\1", text))


def grids_of(cards: list[tuple[str, list[str]]], contents: Contents) -> None:
    """Put the nodes of GRID cards, in basic coordinates with their displacement axes, into contents."""
    systems = _systems(cards)
    default_cp = default_cd = 0
    for name, f in cards:
        if name == "GRDSET":
            default_cp, default_cd = int(f[1] or 0), int(f[5] or 0)
    rows = [f + [""] * 6 for name, f in cards if name == "GRID"]
    for name, f in cards:
        if name == "SPOINT":
            contents.scalars |= set(_listed(f))
    if not rows:
        return
    points, frames = np.zeros((len(rows), 3)), np.tile(np.eye(3), (len(rows), 1, 1))
    for k, f in enumerate(rows):
        given = np.array([nastran_number(x) for x in f[2:5]])
        points[k] = _placed(given, int(f[1] or default_cp), systems, f[0])
    for k, f in enumerate(rows):
        cd = int(f[5] or default_cd)
        if cd == -1:
            raise ValueError(f"GRID {f[0]} is a fluid point (CD = -1), which has no displacements; leave fluids out")
        if cd:
            frames[k] = _axes_at(points[k], cd, systems, f[0])
    contents.ids = np.array([int(f[0]) for f in rows], np.int64)
    contents.points = points
    contents.frames = None if (frames == np.eye(3)).all() else frames


System = tuple[int, Array, Array]  # kind, origin, axes as rows; in basic coordinates


def _systems(cards: list[tuple[str, list[str]]]) -> dict[int, System]:
    """Coordinate systems by number."""
    other = sorted({name for name, _ in cards if re.match(r"CORD[13]", name)})
    if other:
        raise ValueError(f"found {', '.join(other)} cards, which place coordinate systems on grid points; write CORD2")
    waiting = {
        int(f[0]): (SYSTEMS[name], int(f[1] or 0), [nastran_number(x) for x in f[2:11]])
        for name, f in cards
        if name in SYSTEMS
    }
    done: dict[int, System] = {}
    while waiting:
        ready = [number for number, (_, rid, _) in waiting.items() if rid == 0 or rid in done]
        if not ready:
            missing = sorted({rid for _, rid, _ in waiting.values() if rid not in waiting})
            raise ValueError(f"coordinate systems {sorted(waiting)} refer to {missing or 'each other'}; define these")
        for number in ready:
            kind, rid, values = waiting.pop(number)
            A, B, C = (_placed(np.array(values[k : k + 3]), rid, done, f"system {number}") for k in (0, 3, 6))
            z = (B - A) / np.linalg.norm(B - A)
            x = (C - A) - z * (z @ (C - A))
            if not np.linalg.norm(x) > 1e-9 * np.linalg.norm(C - A):
                raise ValueError(f"the three points of coordinate system {number} lie on one line; move the third")
            x /= np.linalg.norm(x)
            done[number] = kind, A, np.array([x, np.cross(z, x), z])
    return done


def _placed(given: Array, system: int, systems: dict[int, System], of: str) -> Array:
    """A place in basic coordinates."""
    if system == 0:
        return given
    kind, origin, axes = _known(system, systems, of)
    if kind == 0:
        local = given
    elif kind == 1:
        r, angle = given[0], np.radians(given[1])
        local = np.array([r * np.cos(angle), r * np.sin(angle), given[2]])
    else:
        r, polar, angle = given[0], np.radians(given[1]), np.radians(given[2])
        local = r * np.array([np.sin(polar) * np.cos(angle), np.sin(polar) * np.sin(angle), np.cos(polar)])
    return np.asarray(origin + local @ axes)


def _axes_at(place: Array, system: int, systems: dict[int, System], of: str) -> Array:
    """Axes of displacement, as rows, of a node in a system."""
    kind, origin, axes = _known(system, systems, of)
    x, y, z = axes @ (place - origin)
    if kind == 0 or np.hypot(x, y) == 0.0:
        return axes
    angle = np.arctan2(y, x)
    radial = np.array([np.cos(angle), np.sin(angle), 0.0])
    around = np.array([-np.sin(angle), np.cos(angle), 0.0])
    if kind == 1:
        return np.asarray(np.array([radial, around, [0.0, 0.0, 1.0]]) @ axes)
    polar = np.arctan2(np.hypot(x, y), z)
    out = np.sin(polar) * radial + np.array([0.0, 0.0, np.cos(polar)])
    down = np.cos(polar) * radial - np.array([0.0, 0.0, np.sin(polar)])
    return np.asarray(np.array([out, down, around]) @ axes)


def _known(system: int, systems: dict[int, System], of: str) -> System:
    if system not in systems:
        raise ValueError(
            f"GRID {of} is in coordinate system {system}, which no card defines; known are {sorted(systems)}"
        )
    return systems[system]


def _listed(fields: list[str]) -> list[int]:
    words = [word.upper() for word in fields if word]
    if len(words) == 3 and words[1] == "THRU":
        return list(range(int(words[0]), int(words[2]) + 1))
    return [int(word) for word in words]


def _table(path: Path) -> Contents:
    """Rows id, x, y, z of text, separated by commas, semicolons or blanks; or rows node, component of a map."""
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
        elif keyword == "NSET" and all(re.fullmatch(r"\d+", word) for word in words):
            numbers = [int(word) for word in words]
            if "GENERATE" in options:
                numbers = list(range(numbers[0], numbers[1] + 1, numbers[2] if len(numbers) > 2 else 1))
            sets.setdefault(options.get("NSET", "set"), []).extend(numbers)
    if not ids:
        raise ValueError(f"{path.name} has no *NODE block; name the input file that has the coordinates")
    groups = {name: np.unique(numbers) for name, numbers in sets.items()}
    return Contents(ids=np.array(ids, np.int64), points=np.array(points), groups=groups)


def _calculix_map(path: Path) -> Contents:
    """Map of degrees of freedom that CalculiX writes: node.component per line."""
    rows = [line.strip().split(".") for line in path.read_text().splitlines() if line.strip()]
    return Contents(dofs=np.array([[int(node), int(component)] for node, component in rows], np.int64))


register("table of nodes or of degrees of freedom", (".csv", ".txt"), _table)
register("Abaqus input file", (".inp",), _abaqus)
register("CalculiX map of degrees of freedom", (".dof",), _calculix_map)
