"""Nodes of an Abaqus deck (*NODE, *SYSTEM, *NGEN, *NFILL), and its named sets of nodes and elements."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from femflex.arrays import Array
from femflex.mesh.formats.abaqus_keywords import Keyword
from femflex.mesh.formats.guards import check_count
from femflex.mesh.formats.numbers import Numbers

Nodes = dict[int, Array]
Parts = list[int | range]
Key = tuple[str, str]  # instance and set, in capitals; "" is the deck or the assembly itself


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
                raise keyword.error(f"goes from node {first} to {last} in steps of {step}.", k)
            count = (last - first) // step
            check_count(count, keyword.location(k))
            if kind == "P":
                raise keyword.error("on a parabola (LINE=P) is not read; write the nodes out.", k)
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
            raise keyword.error("with BIAS or SINGULAR is not read; write the nodes out.")
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
            raise keyword.error(f"uses node {number}, which is not defined before.", row)
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


class Sets:
    """Numbers by instance and set name; Abaqus does not distinguish capitals from small letters.

    kind    NSET or ELSET
    shifts  offset added to the numbers of an instance, by its name in capitals
    """

    def __init__(self, kind: str, shifts: Mapping[str, int]) -> None:
        self.kind = kind
        self._shifts = shifts
        self._parts: dict[Key, Parts] = {}
        self._spelling: dict[Key, str] = {}

    def add(self, scope: str, name: str, numbers: Sequence[int | range]) -> None:
        """Add numbers and ranges to a set, which is created if needed; nothing is added if the name is ""."""
        if name:
            key = scope.upper(), name.upper()
            self._spelling.setdefault(key, name)
            self._parts.setdefault(key, []).extend(numbers)

    def is_known(self, word: str, scope: str) -> bool:
        """Whether a word is a number, or the name of a known set, when used in an instance."""
        return (
            word.lstrip("-").isdigit() or self._key(word, scope) is not None or self._instance_number(word) is not None
        )

    def numbers_in(self, word: str, scope: str, location: str = "") -> Parts:
        """Numbers and ranges of a set, or of one number: 12, SET, INSTANCE.12 or INSTANCE.SET.

        Raises ValueError on an unknown set, with the known ones.
        """
        if word.lstrip("-").isdigit():
            return [int(word) + self._shifts.get(scope.upper(), 0)]
        key = self._key(word, scope)
        if key is not None:
            return list(self._parts[key])
        number = self._instance_number(word)
        if number is not None:
            return [number]
        names = sorted({self._spelling[key] for key in self._parts})
        names_text = f"{names[:30]} and {len(names) - 30} more" if len(names) > 30 else str(names)
        raise ValueError(
            f"{location}{': ' if location else ''}{self.kind} {word!r} is used but not defined; known are "
            f"{names_text}. Correct the name, or add the set."
        )

    def members(self) -> dict[str, Numbers]:
        """Numbers of every set by the name of its group.

        The name is that of the set if only one instance has sets, otherwise INSTANCE.SET.
        """
        scopes = {scope for scope, _ in self._parts if scope}
        global_names = {name for scope, name in self._parts if not scope}
        groups: dict[str, Numbers] = {}
        for (scope, name), parts in self._parts.items():
            unambiguous = not scope or (len(scopes) == 1 and len(self._shifts) <= 2 and name not in global_names)
            spelling = self._spelling[scope, name]
            groups[spelling if unambiguous else f"{self._spelled(scope)}.{spelling}"] = Numbers(tuple(parts))
        return groups

    def spell_instance(self, name: str) -> None:
        """Store the spelling of the name of an instance."""
        self._spelling.setdefault((name.upper(), ""), name)

    def _spelled(self, scope: str) -> str:
        return self._spelling.get((scope, ""), scope)

    def _key(self, word: str, scope: str) -> Key | None:
        name = word.upper()
        scoped_key = scope.upper(), name
        if scoped_key in self._parts:
            return scoped_key
        if ("", name) in self._parts:
            return "", name
        instance, dot, set_name = name.partition(".")
        if dot and (instance, set_name) in self._parts:
            return instance, set_name
        if dot and ("", set_name) in self._parts and instance not in self._shifts:
            return "", set_name  # PART.SET in a flat deck
        holders = [key for key in self._parts if key[1] == name]
        return holders[0] if len(holders) == 1 else None

    def _instance_number(self, word: str) -> int | None:
        instance, _, number = word.upper().rpartition(".")
        return int(number) + self._shifts[instance] if number.isdigit() and instance in self._shifts else None
