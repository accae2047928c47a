"""The mesh and members of a deck while its elements are read: cells gathered by what a Member needs."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from femflex.arrays import Array
from femflex.fem import Member
from femflex.mesh import Mesh

ALIKE = 1e-9  # part by which values of cells differ that count as one


@dataclass
class _Gathered:
    """Cells of one member: rows by cell type, and what the member is made of."""

    name: str
    family: str
    section: Any
    material: Any
    options: Mapping[str, Any]
    rows: dict[str, list[int]] = field(default_factory=dict)
    fields: dict[str, list[Mapping[str, Any]]] = field(default_factory=dict)  # by cell type, one for each cell


@dataclass(frozen=True)
class Built:
    """A cell that stands in the mesh: number of its element, type and row, and what its member is made of."""

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
        self._number_of: dict[tuple[str, int], int] = {}  # and the way back
        self.cell_groups: dict[str, dict[str, list[int]]] = {}
        self.point_groups: dict[str, list[int]] = {}
        self._members: dict[Hashable, _Gathered] = {}
        self._names: dict[str, int] = {}

    def point(self, position: ArrayLike) -> int:
        """Row of a new point (3,) [m]."""
        self.points.append(np.asarray(position, float))
        return len(self.points) - 1

    def node(self, number: int, position: ArrayLike) -> int:
        """Row of a node of the deck, new where it is used for the first time; place (3,) [m]."""
        if number not in self.row_of:
            self.row_of[number] = self.point(position)
        return self.row_of[number]

    def point_group(self, row: int, name: str) -> str:
        """The group of that name, of one point."""
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
    ) -> None:
        """Add a cell to the member of a key, which is made when it is first named; `name` is that of its property.

        options belong to the member; fields are values of this cell, by option: a number, one for each corner, or a
        direction (axis). All cells of a member have the same ones.
        """
        cells = self.cells.setdefault(kind, [])
        row = len(cells)
        cells.append(rows)
        if key not in self._members:
            k = self._names[name] = self._names.get(name, 0) + 1
            self._members[key] = _Gathered(f"{name}-part{k}", family, section, material, options or {})
        self._members[key].rows.setdefault(kind, []).append(row)
        self._members[key].fields.setdefault(kind, []).append(fields or {})
        for group in (name, *groups):
            self.cell_groups.setdefault(group, {}).setdefault(kind, []).append(row)
        if number is not None:
            self.cell_of.setdefault(number, []).append((kind, row))
            self._number_of[kind, row] = number

    def built(self) -> Iterator[Built]:
        """Every cell with what it is made of."""
        for one in self._members.values():
            for kind, rows in one.rows.items():
                for row, fields in zip(rows, one.fields[kind], strict=True):
                    number = self._number_of.get((kind, row))
                    yield Built(number, kind, row, one.family, one.section, one.material, fields)

    def remake(self, values: Mapping[int, Hashable], made: Callable[[Any, Any, Any], tuple[Any, Any]]) -> None:
        """Give elements, by their numbers, another section and material: what `made` makes of both and of a value.

        Elements of a member with unlike values, or some without, become members of their own.
        """
        before, self._members = self._members, {}
        for key, one in before.items():
            for kind, rows in one.rows.items():
                for row, fields in zip(rows, one.fields[kind], strict=True):
                    value = values.get(self._number_of.get((kind, row), -1))
                    own = key if value is None else (key, value)
                    if own not in self._members:
                        section, material = (one.section, one.material)
                        if value is not None:
                            section, material = made(section, material, value)
                        self._members[own] = replace(one, section=section, material=material, rows={}, fields={})
                    self._members[own].rows.setdefault(kind, []).append(row)
                    self._members[own].fields.setdefault(kind, []).append(fields)
        self._names = {}
        for one in self._members.values():
            name = one.name.rpartition("-part")[0]
            self._names[name] = self._names.get(name, 0) + 1
            one.name = f"{name}-part{self._names[name]}"

    def mesh(self) -> Mesh:
        """The mesh with all groups: those of members and those of properties, sets and points."""
        groups = {**self.cell_groups}
        for one in self._members.values():
            groups[self._group(one)] = one.rows
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
        return {one.family for one in self._members.values()}

    def _group(self, one: _Gathered) -> str:
        """The group of a member: that of its property where it is the only part of it."""
        name, _, part = one.name.rpartition("-part")
        return name if part == "1" and self._names[name] == 1 else one.name


def _field_options(fields: Mapping[str, Sequence[Mapping[str, Any]]]) -> dict[str, Any]:
    """Options of values by cell: one value where all are alike, else values by cell type; an axis by its components."""
    found: dict[str, Any] = {}
    for name in next(iter(fields.values()))[0]:
        values = {kind: np.array([cell[name] for cell in cells], float) for kind, cells in fields.items()}
        if name == "axis":
            axes = np.concatenate(list(values.values()))
            alike = np.abs(axes - axes[0]).max() <= ALIKE
            parts = tuple({kind: own[:, c] for kind, own in values.items()} for c in range(3))
            found[name] = tuple(float(c) for c in axes[0]) if alike else parts
            continue
        every = np.concatenate([own.ravel() for own in values.values()])
        found[name] = float(every[0]) if np.ptp(every) <= ALIKE * np.abs(every).max() else values
    return found


def direction_key(v: ArrayLike, digits: int = 9) -> tuple[float, ...]:
    """A unit vector (3,) as a key of as many numbers: directions that differ by rounding have the same."""
    return tuple(float(value) + 0.0 for value in np.round(np.asarray(v, float), digits))
