"""Nodes of an Abaqus deck: *NODE in its coordinate systems, *SYSTEM, and those made by *NGEN and *NFILL."""

from __future__ import annotations

import numpy as np

from femflex.arrays import Array
from femflex.mesh.formats.abaqus_keywords import Keyword
from femflex.mesh.formats.guards import check_count

Nodes = dict[int, Array]


class NodeReader:
    """Reads the keywords that define nodes, in order; positions are those of the part or the flat deck."""

    def __init__(self) -> None:
        self.nodes: Nodes = {}
        self.sets: dict[str, list[int]] = {}  # sets named on the keywords, in capitals
        self._origin, self._axes = np.zeros(3), np.eye(3)

    def read_keyword(self, keyword: Keyword) -> list[int]:
        """Numbers of the nodes that a keyword defines: *NODE, *SYSTEM, *NGEN or *NFILL."""
        numbers = {"NODE": self._node, "SYSTEM": self._system, "NGEN": self._ngen, "NFILL": self._nfill}[keyword.name](
            keyword
        )
        if name := keyword.parameter("nset").upper():
            self.sets.setdefault(name, []).extend(numbers)
        return numbers

    def _node(self, keyword: Keyword) -> list[int]:
        system = (keyword.parameter("system") or "R").upper()[0]
        numbers = []
        for k, row in enumerate(keyword.data):
            number = keyword.integer(row[0], k, "the number of a node")
            x, y, z = (keyword.real(word, k, "a coordinate") for word in [*row[1:4], "", "", ""][:3])
            if system == "C":
                x, y = x * np.cos(np.radians(y)), x * np.sin(np.radians(y))
            elif system == "S":  # radius, angle round z, angle above the equator
                a, b = np.radians([y, z])
                x, y, z = x * np.cos(a) * np.cos(b), x * np.sin(a) * np.cos(b), x * np.sin(b)
            self.nodes[number] = self._origin + np.array([x, y, z]) @ self._axes
            numbers.append(number)
        return numbers

    def _system(self, keyword: Keyword) -> list[int]:
        """Origin a, b on the local x axis and c near the local y axis; without data the global system."""
        words = [(k, word) for k, row in enumerate(keyword.data) for word in row[: 3 if k else 6]]
        values = np.array([keyword.real(word, k, "a coordinate") for k, word in words])
        self._origin, self._axes = np.zeros(3), np.eye(3)
        if not len(values):
            return []
        a, b, c = (np.pad(values, (0, 9))[3 * k : 3 * k + 3] for k in range(3))
        self._origin = a
        if len(values) > 3:
            x = (b - a) / np.linalg.norm(b - a)
            if len(values) > 6:
                y = c - a - ((c - a) @ x) * x
                y /= np.linalg.norm(y)
            else:
                y = np.cross([0.0, 0.0, 1.0], x)
            self._axes = np.stack([x, y, np.cross(x, y)])
        return []

    def _ngen(self, keyword: Keyword) -> list[int]:
        """Nodes between two ends, on a straight line or (LINE=C) on a circle round a third node."""
        kind = keyword.parameter("line").upper()
        numbers = []
        for k, row in enumerate(keyword.data):
            words = [*row, "", "", ""]
            first, last = (keyword.integer(word, k, "the number of a node") for word in words[:2])
            step = keyword.integer(words[2] or "1", k, "an increment")
            a, b = (self._position(number, keyword, k) for number in (first, last))
            if step == 0 or (last - first) % step or (last - first) // step < 1:
                raise ValueError(f"{keyword.location(k)}: *NGEN goes from node {first} to {last} in steps of {step}.")
            count = (last - first) // step
            check_count(count, keyword.location(k))
            if kind == "P":
                raise ValueError(
                    f"{keyword.location(k)}: *NGEN on a parabola (LINE=P) is not read; write the nodes out."
                )
            if kind == "C":
                number = words[3]
                centre = (
                    self._position(keyword.integer(number, k, "the number of a node"), keyword, k)
                    if number
                    else np.array([keyword.real(word, k, "a coordinate") for word in [*words[4:7], "", "", ""][:3]])
                )
                normal = [keyword.real(word, k, "a component") for word in words[7:10] if word]
                points = _arc(a, b, centre, np.array(normal) if len(normal) == 3 else None, count)
            else:
                points = a + np.linspace(0, 1, count + 1)[:, None] * (b - a)
            for j in range(count + 1):
                self.nodes[first + j * step] = points[j]
                numbers.append(first + j * step)
        return numbers

    def _nfill(self, keyword: Keyword) -> list[int]:
        """Nodes on straight lines from each node of one set to that of another."""
        if float(keyword.parameter("bias") or 1) != 1 or keyword.parameter("singular"):
            raise ValueError(f"{keyword.location()}: *NFILL with BIAS or SINGULAR is not read; write the nodes out.")
        numbers = []
        for k, row in enumerate(keyword.data):
            words = [*row, "", "", "", ""]
            sets = [self.sets.get(word.upper()) or [keyword.integer(word, k, "a set or node")] for word in words[:2]]
            count = keyword.integer(words[2] or "1", k, "the number of intervals")
            step = keyword.integer(words[3] or "1", k, "an increment")
            check_count(count * min(map(len, sets)), keyword.location(k))
            for first, last in zip(*(sorted(numbers) for numbers in sets), strict=False):
                a, b = self._position(first, keyword, k), self._position(last, keyword, k)
                for j in range(count + 1):
                    number = last if j == count else first + j * step
                    self.nodes[number] = a + (b - a) * (j / count)
                    numbers.append(number)
        return numbers

    def _position(self, number: int, keyword: Keyword, row: int) -> Array:
        if number not in self.nodes:
            raise ValueError(
                f"{keyword.location(row)}: *{keyword.name} uses node {number}, which is not defined before."
            )
        return self.nodes[number]


def _arc(a: Array, b: Array, centre: Array, normal: Array | None, count: int) -> Array:
    """Points (count + 1, 3) from a to b on the circle round the centre, by equal angles, the shorter way."""
    r, s = a - centre, b - centre
    n = np.cross(r, s) if normal is None else normal
    if not np.linalg.norm(n):
        n = np.array([0.0, 0.0, 1.0])
    n = n / np.linalg.norm(n)
    angle = np.arctan2(n @ np.cross(r, s), r @ s)
    if normal is not None and angle <= 0:
        angle += 2 * np.pi
    turns = np.linspace(0, angle, count + 1)[:, None]
    points = centre + np.cos(turns) * r + np.sin(turns) * np.cross(n, r) + (1 - np.cos(turns)) * (n @ r) * n
    points[-1] = b
    return points
