"""The mesh and members of a deck while its elements are read: cells are collected by member."""

from __future__ import annotations

import math
from collections.abc import Callable, Hashable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from femflex.arrays import Array
from femflex.fem import Member
from femflex.mesh import Mesh

# Of a shell: its unit normal, its axis 1 (None: of no importance), and thicknesses at its corners (None: its section's)
Around = tuple[Array, Array | None, tuple[float, ...] | None]

EQUAL = 1e-9  # relative difference of values of cells that are treated as equal


@dataclass
class _MemberCells:
    """Cells of one member: rows by cell type, and the definition of the member."""

    name: str
    family: str
    section: Any
    material: Any
    options: Mapping[str, Any]
    rows: dict[str, list[int]] = field(default_factory=dict)
    fields: dict[str, list[Mapping[str, Any]]] = field(default_factory=dict)  # by cell type, one for each cell


@dataclass(frozen=True)
class BuiltCell:
    """A cell of the mesh: number of its element, type and row, and the definition of its member."""

    number: int | None
    kind: str
    row: int
    family: str
    section: Any
    material: Any
    fields: Mapping[str, Any]


class Builder:
    """Points by number of their node, cells by type, members and groups."""

    def __init__(self) -> None:
        self.points: list[Array] = []
        self.row_of: dict[int, int] = {}  # node of the deck -> row of points
        self.cells: dict[str, list[Sequence[int]]] = {}
        self.cell_of: dict[int, list[tuple[str, int]]] = {}  # element of the deck -> cell type and row of its cells
        self._number_of: dict[tuple[str, int], int] = {}  # cell type and row -> element of the deck
        self.cell_groups: dict[str, dict[str, list[int]]] = {}
        self.point_groups: dict[str, list[int]] = {}
        self._members: dict[Hashable, _MemberCells] = {}
        self._names: dict[str, int] = {}

    def point(self, position: ArrayLike) -> int:
        """Row of a new point (3,) [m]."""
        self.points.append(np.asarray(position, float))
        return len(self.points) - 1

    def node(self, number: int, position: ArrayLike) -> int:
        """Row of a node of the deck, which is added on first use; position (3,) [m]."""
        if number not in self.row_of:
            self.row_of[number] = self.point(position)
        return self.row_of[number]

    def point_group(self, row: int, name: str) -> str:
        """Add a group of one point; returns its name."""
        self.point_groups[name] = [row]
        return name

    def cell(
        self,
        kind: str,
        rows: Sequence[int],
        key: Hashable,
        name: str,
        family: str,
        section: Any = None,
        material: Any = None,
        options: Mapping[str, Any] | None = None,
        groups: Iterable[str] = (),
        number: int | None = None,
        fields: Mapping[str, Any] | None = None,
        around: Around | None = None,
    ) -> None:
        """Add a cell to the member with this key, which is created on first use; `name` is that of its property.

        options belong to the member; fields are values of this cell by option: a number, one number per corner, or a
        direction (axis). All cells of a member have fields for the same options. around: of shells and plates; the
        cells of a plate have one axis.
        """
        if around is not None:
            normal, axis, thickness = around
            if axis is None and abs(normal[0]) > 0.999:  # the default axis would be normal to the surface
                axis = np.array([0.0, 1.0, 0.0])
            if family == "plate" and axis is not None:
                options = {**(options or {}), "axis": tuple(float(c) for c in axis)}
            elif family == "shell":
                values = {"axis": axis, "thickness": thickness}
                fields = {**(fields or {}), **{name: value for name, value in values.items() if value is not None}}
            key = key, *(fields or ()), direction_key(axis, 6) if family == "plate" and axis is not None else ()
        cells = self.cells.setdefault(kind, [])
        row = len(cells)
        cells.append(rows)
        if key not in self._members:
            k = self._names[name] = self._names.get(name, 0) + 1
            self._members[key] = _MemberCells(f"{name}-part{k}", family, section, material, options or {})
        self._members[key].rows.setdefault(kind, []).append(row)
        self._members[key].fields.setdefault(kind, []).append(fields or {})
        for group in (name, *groups):
            self.cell_groups.setdefault(group, {}).setdefault(kind, []).append(row)
        if number is not None:
            self.cell_of.setdefault(number, []).append((kind, row))
            self._number_of[kind, row] = number

    def built_cells(self) -> Iterator[BuiltCell]:
        """Every cell with the definition of its member."""
        for member in self._members.values():
            for kind, rows in member.rows.items():
                for row, fields in zip(rows, member.fields[kind], strict=True):
                    number = self._number_of.get((kind, row))
                    yield BuiltCell(number, kind, row, member.family, member.section, member.material, fields)

    def change_sections(
        self, values: Mapping[int, Hashable], change: Callable[[Any, Any, Any], tuple[Any, Any]]
    ) -> None:
        """Replace section and material of elements, by number, by change(section, material, value).

        Elements of a member with different values, or without one, become separate members.
        """
        old_members, self._members = self._members, {}
        for key, member in old_members.items():
            for kind, rows in member.rows.items():
                for row, fields in zip(rows, member.fields[kind], strict=True):
                    value = values.get(self._number_of.get((kind, row), -1))
                    new_key = key if value is None else (key, value)
                    if new_key not in self._members:
                        section, material = (member.section, member.material)
                        if value is not None:
                            section, material = change(section, material, value)
                        self._members[new_key] = replace(member, section=section, material=material, rows={}, fields={})
                    self._members[new_key].rows.setdefault(kind, []).append(row)
                    self._members[new_key].fields.setdefault(kind, []).append(fields)
        self._names = {}
        for member in self._members.values():
            name = member.name.rpartition("-part")[0]
            self._names[name] = self._names.get(name, 0) + 1
            member.name = f"{name}-part{self._names[name]}"

    def mesh(self) -> Mesh:
        """The mesh with all groups: those of members and those of properties, sets and points."""
        groups = {**self.cell_groups}
        for member in self._members.values():
            groups[self._group(member)] = member.rows
        points = np.array(self.points).reshape(-1, 3)
        return Mesh(
            points,
            {kind: np.array(rows, np.int64) for kind, rows in self.cells.items()},
            {name: {kind: np.array(rows) for kind, rows in by.items()} for name, by in groups.items()},
            {name: np.array(rows, np.int64) for name, rows in self.point_groups.items()},
        )

    def members(self) -> list[Member]:
        """The members, in the order of their first cells."""
        return [
            Member(self._group(g), g.family, g.section, g.material, {**g.options, **_field_options(g.fields)})
            for g in self._members.values()
        ]

    def families(self) -> set[str]:
        """Names of the families that are used."""
        return {member.family for member in self._members.values()}

    def _group(self, member: _MemberCells) -> str:
        """The group of a member: that of its property if the property has only this member."""
        name, _, part = member.name.rpartition("-part")
        return name if part == "1" and self._names[name] == 1 else member.name


def _field_options(fields: Mapping[str, Sequence[Mapping[str, Any]]]) -> dict[str, Any]:
    """Options from values of cells: one value if all are equal, otherwise values by cell type; an axis by
    components."""
    options: dict[str, Any] = {}
    for name in next(iter(fields.values()))[0]:
        values = {kind: np.array([cell[name] for cell in cells], float) for kind, cells in fields.items()}
        if name == "axis":
            axes = np.concatenate(list(values.values()))
            all_equal = np.abs(axes - axes[0]).max() <= EQUAL
            components = tuple({kind: cell_values[:, c] for kind, cell_values in values.items()} for c in range(3))
            options[name] = tuple(float(c) for c in axes[0]) if all_equal else components
            continue
        all_values = np.concatenate([cell_values.ravel() for cell_values in values.values()])
        options[name] = float(all_values[0]) if np.ptp(all_values) <= EQUAL * np.abs(all_values).max() else values
    return options


def direction_key(v: ArrayLike, digits: int = 9) -> tuple[float, ...]:
    """A key of rounded components for a unit vector (3,): directions that differ by rounding have the same key."""
    return tuple(float(value) + 0.0 for value in np.round(np.asarray(v, float), digits))


def shell_normal(x: Array, label: str) -> Array:
    """Unit normal (3,) of a shell with corners x (3 or 4, 3). Raises ValueError, which begins with `label`, without
    area."""
    a, b = (x[2] - x[0], x[-1] - x[1]) if len(x) == 4 else (x[1] - x[0], x[2] - x[0])
    (ax, ay, az), (bx, by, bz) = a.tolist(), b.tolist()  # np.cross of one pair takes 50 times as long
    normal, extent = np.array([ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx]), x.max(axis=0) - x.min(axis=0)
    size = math.sqrt(normal @ normal)
    if not size > 1e-12 * float(extent @ extent):
        raise ValueError(f"{label} has no area; correct its nodes")
    return np.asarray(normal / size)
