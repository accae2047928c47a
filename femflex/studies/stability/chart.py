"""Stability over two values: a grid, and the boundaries between its regions traced by bisection."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from femflex.arrays import Array, IntArray
from femflex.studies.stability.judgement import NONE, Judgement

Judge = Callable[[float, float], Judgement]
Progress = Callable[[float], object]

HALVINGS = 7  # of an edge of the grid that a boundary crosses: to 1 / 128 of it
Edge = tuple[int, int, int]  # first and second number of its first node, and 0 along the first value or 1


@dataclass(frozen=True, eq=False)
class Chart:
    """Stability over values first_values (n,) and second_values (m,).

    names       of the two values, and their units
    kinds       (n, m) see `femflex.studies.stability.judgement`;  growth (n, m) [1/s]
    boundaries  (kind on one side, kind on the other, points (k, 2)) of every line between two regions
    error       largest error of a point of a boundary, in the two values
    """

    names: tuple[str, str]
    units: tuple[str, str]
    first_values: Array
    second_values: Array
    kinds: IntArray
    growth: Array
    boundaries: tuple[tuple[int, int, Array], ...]
    error: tuple[float, float]


def stability_chart(
    judge: Judge,
    first_values: Sequence[float],
    second_values: Sequence[float],
    names: tuple[str, str] = ("first", "second"),
    units: tuple[str, str] = ("", ""),
    progress: Progress | None = None,
) -> Chart:
    """The chart of a judgement over two lists of rising values.

    Boundaries are computed on the edges of the grid by bisection, and joined through its cells: a region between nodes
    of the grid is not found. progress is called with the number of grid points done.
    """
    a, b = np.asarray(first_values, float), np.asarray(second_values, float)
    for name, values in zip(names, (a, b), strict=True):
        if len(values) < 2 or not (np.diff(values) > 0).all():
            raise ValueError(f"the values of {name} are to rise; found {values[:6].tolist()}")
    kinds, growth = np.empty((len(a), len(b)), np.int64), np.empty((len(a), len(b)))
    loads = np.empty((len(a), len(b)), np.int64)
    for i, x in enumerate(a):
        for j, y in enumerate(b):
            judgement = judge(float(x), float(y))
            kinds[i, j], growth[i, j], loads[i, j] = judgement.kind, judgement.growth, judgement.loads
            if progress is not None:
                progress(float(i * len(b) + j + 1))
    has_fewer_loads = loads < loads.max()  # no equilibrium under the loads that act elsewhere
    kinds[has_fewer_loads], growth[has_fewer_loads] = NONE, np.nan
    crossings = _crossings(judge, a, b, kinds)
    error = (float(np.diff(a).max()) / 2**HALVINGS, float(np.diff(b).max()) / 2**HALVINGS)
    return Chart(names, units, a, b, kinds, growth, tuple(_joined(kinds, crossings)), error)


def _crossings(judge: Judge, a: Array, b: Array, kinds: IntArray) -> dict[Edge, Array]:
    """Points (2,) on the edges of the grid at which the kind changes, except on edges to nodes without a judgement."""
    points = {}
    for direction in (0, 1):
        for i in range(len(a) - (direction == 0)):
            for j in range(len(b) - (direction == 1)):
                ends = kinds[i, j], kinds[i + (direction == 0), j + (direction == 1)]
                if ends[0] == ends[1] or NONE in ends:
                    continue
                low = np.array([a[i], b[j]])
                high = np.array([a[i + (direction == 0)], b[j + (direction == 1)]])
                for _ in range(HALVINGS):
                    middle = (low + high) / 2
                    kind = judge(*map(float, middle)).kind
                    low, high = (middle, high) if kind == ends[0] else (low, middle)
                points[i, j, direction] = (low + high) / 2
    return points


def _joined(kinds: IntArray, crossings: dict[Edge, Array]) -> list[tuple[int, int, Array]]:
    """The crossings joined through the cells to lines of maximum length."""
    links: dict[tuple[int, int], list[tuple[Edge, Edge]]] = {}
    for i in range(kinds.shape[0] - 1):
        for j in range(kinds.shape[1] - 1):
            around: list[Edge] = [(i, j, 0), (i + 1, j, 1), (i, j + 1, 0), (i, j, 1)]
            pairs: dict[tuple[int, int], list[Edge]] = {}
            for edge in around:
                if edge in crossings:
                    pairs.setdefault(_sides(kinds, edge), []).append(edge)
            for sides, edges in pairs.items():
                links.setdefault(sides, []).extend(zip(edges[::2], edges[1::2], strict=False))
    out = []
    for sides, segments in links.items():
        for line in _lines_of_segments(segments):
            out.append((*sides, np.array([crossings[edge] for edge in line])))
    return out


def _sides(kinds: IntArray, edge: Edge) -> tuple[int, int]:
    i, j, along = edge
    ends = int(kinds[i, j]), int(kinds[i + (along == 0), j + (along == 1)])
    return min(ends), max(ends)


def _lines_of_segments(segments: list[tuple[Edge, Edge]]) -> list[list[Edge]]:
    """Segments with common ends as lines."""
    remaining, lines = list(segments), []
    while remaining:
        line = list(remaining.pop())
        while link := next((pair for pair in remaining if {line[0], line[-1]} & set(pair)), None):
            remaining.remove(link)
            p, q = link
            if line[-1] in link:
                line.append(q if p == line[-1] else p)
            else:
                line.insert(0, q if p == line[0] else p)
        lines.append(line)
    return lines
