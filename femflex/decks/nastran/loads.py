"""Sets of static loads: FORCE, MOMENT, PLOAD, PLOAD1, PLOAD2, PLOAD4 and GRAV, and LOAD, which combines them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial

import numpy as np

from femflex.arrays import Array
from femflex.decks.builder import Builder
from femflex.decks.cell_loads import Cell, cells_of, on_cell, on_face, on_line
from femflex.decks.nastran.card import Card, numbers_of
from femflex.decks.nastran.line_elements import bar_frame, bar_vector
from femflex.decks.nastran.model import NastranModel
from femflex.fem.static_loads import StaticLoads
from femflex.mesh.cells import CELL_TYPES, FACES

Parts = list[tuple[float, StaticLoads]]

WHOLE = 1e-6  # of the length of a bar by which a load that covers all of it may end elsewhere


def read_loads(model: NastranModel) -> dict[str, StaticLoads]:
    """Sets of loads by name, "load 2" for number 2. A card that is not understood is left out, and listed."""
    bulk = model.bulk
    parts: dict[int, Parts] = {}

    def add(name: str, read: Callable[[NastranModel, Card], StaticLoads]) -> None:
        for card in bulk.cards_named(name, use=False):
            try:
                number, loads = card.integer(0), read(model, card)
            except ValueError as error:
                bulk.findings.unused(name, f"left out of load {card.word(0)}: {error}", card.location)
                continue
            bulk.findings.use(name)
            parts.setdefault(number, []).append((1.0, loads))

    bars = {card.word(0): card for name in ("CBAR", "CBEAM") for card in bulk.cards.get(name, ())}
    readers = dict.fromkeys(("FORCE", "FORCE1", "MOMENT", "MOMENT1"), _at_grid)
    readers |= {"GRAV": _grav, "PLOAD": _pload, "PLOAD2": _pload2, "PLOAD4": _pload4}
    for name, read in (readers | {"PLOAD1": partial(_pload1, bars)}).items():
        add(name, read)
    sets = {number: StaticLoads.combined(some) for number, some in parts.items()}
    add("LOAD", lambda model, card: _combination(card, sets))
    return {f"load {number}": StaticLoads.combined(some) for number, some in sorted(parts.items())}


def _at_grid(model: NastranModel, card: Card) -> StaticLoads:
    """FORCE and MOMENT: SID, G, CID, F, N1 to N3; FORCE1 and MOMENT1: SID, G, F, G1, G2."""
    grid, position = card.integer(1), model.grids.position
    if card.name.endswith("1"):
        span = position(card.integer(4)) - position(card.integer(3))
        vector = card.real(2) * span / np.linalg.norm(span)
    else:
        axes = model.systems(card.integer(2, 0)).axes_at(position(grid))
        vector = card.real(3) * np.array(card.reals(4, 3)) @ axes
    return model.nodal_load(grid, vector, card.name.startswith("FORCE"), model.bulk.units)


def _grav(model: NastranModel, card: Card) -> StaticLoads:
    """SID, CID, A, N1 to N3."""
    system, units = model.systems(card.integer(1, 0)), model.bulk.units
    if system.kind != "R":
        raise ValueError("its coordinate system is not rectangular")
    return StaticLoads.weight(card.real(2) * np.array(card.reals(3, 3)) @ system.C * units.length / units.time**2)


def _pload(model: NastranModel, card: Card) -> StaticLoads:
    """SID, P, G1 to G4, the last blank for a triangle."""
    grids = [card.integer(k) for k in range(2, 6) if card.integer(k, 0)]
    if not set(grids) <= model.moving:
        raise ValueError("no element has displacements at its grid points")
    kind, p = CELL_TYPES["quad" if len(grids) == 4 else "triangle"], card.real(1) * model.bulk.units.pressure
    x = np.array([model.grids.position(grid) for grid in grids])
    return StaticLoads.on_cell(kind.name, [model.row(grid) for grid in grids], x, np.full(kind.n_corners, p))


def _pload2(model: NastranModel, card: Card) -> StaticLoads:
    """SID, P, numbers of shells; of a range those that are shells."""
    build, p = model.build, card.real(1) * model.bulk.units.pressure
    find = _shell if "THRU" in card.words_from(2) else partial(cells_of, dimension=2)
    shells = [cell for number in numbers_of(card, 2, build.cell_of) for cell in find(build, number)]
    return _sum([on_cell(build, cell, np.full(_n_corners(cell), p)) for cell in shells])


def _pload4(model: NastranModel, card: Card) -> StaticLoads:
    """SID, EID, P1 to P4, G1, G3 or G4 (or THRU and the last element), CID, N1 to N3, SORL."""
    if card.word(12, "SURF") != "SURF":
        raise ValueError("loads on edges are not understood")
    build, first, parts = model.build, card.integer(1), list[StaticLoads]()
    p = card.real(2)
    pressures = model.bulk.units.pressure * np.array([p, *(card.real(k, p) for k in (3, 4, 5))])
    if card.word(6) == "THRU":
        last = card.integer(7)
        cells = [cell for number in build.cell_of if first <= number <= last for cell in _shell(build, number)]
    else:
        cells = build.cell_of.get(first) or cells_of(build, first, 2)
    for cell in cells:
        is_shell = CELL_TYPES[cell[0]].dimension == 2
        corners = list(range(_n_corners(cell))) if is_shell else _face(model, card, cell)
        load = pressures[: len(corners)]
        if any(card.reals(9, 3)):
            centre = np.mean([build.points[build.cells[cell[0]][cell[1]][k]] for k in corners], axis=0)
            direction = np.array(card.reals(9, 3)) @ model.systems(card.integer(8, 0)).axes_at(centre)
            load = np.outer(load, direction / np.linalg.norm(direction))
        parts.append(on_cell(build, cell, load) if is_shell else on_face(build, cell, corners, load))
    return _sum(parts)


def _sum(parts: list[StaticLoads]) -> StaticLoads:
    if not parts:
        raise ValueError("there are no shells of these numbers")
    return StaticLoads.combined((1.0, loads) for loads in parts)


def _shell(build: Builder, number: int) -> list[Cell]:
    """The cells of an element that is a shell; none of others."""
    return [cell for cell in build.cell_of.get(number, ()) if CELL_TYPES[cell[0]].dimension == 2]


def _n_corners(cell: Cell) -> int:
    return CELL_TYPES[cell[0]].n_corners


def _face(model: NastranModel, card: Card, cell: Cell) -> list[int]:
    """Corners of the face of a solid that PLOAD4 loads, from G1 on, counterclockwise seen from outside.

    G3 is the opposite corner of a quadrilateral, and on a pyramid the other base corner of a triangle. G4 is the corner
    off the face of a tetrahedron.
    """
    shape, nodes = CELL_TYPES[cell[0]].shape, [*model.build.cells[cell[0]][cell[1]]]
    rows = [model.build.row_of.get(card.integer(k, 0)) for k in (6, 7)]
    first, other = (nodes.index(row) if row in nodes else -1 for row in rows)
    for face in FACES.get(shape, ()):
        k = face.index(first) if first in face else -1
        quadrilateral, others = len(face) == 4, {"tetra": other not in (*face, -1), "wedge": other < 0}
        if k >= 0 and (face[k - 2] == other if quadrilateral else others.get(shape, other in face)):
            return [*face[k:], *face[:k]]
    raise ValueError("G1, and G3 or G4, name no face of its element")


def _pload1(bars: Mapping[str, Card], model: NastranModel, card: Card) -> StaticLoads:
    """SID, EID, TYPE, SCALE, X1, P1, X2, P2: an even load over the whole length. bars: CBAR and CBEAM by number."""
    build, units, number, kind = model.build, model.bulk.units, card.integer(1), card.word(2)
    cells = cells_of(build, number, 1)
    ends = [build.points[build.cells[name][row][end]] for (name, row), end in ((cells[0], 0), (cells[-1], 1))]
    bar = bars.get(card.word(1))
    scale = {"FR": 1.0, "LE": float(np.linalg.norm(ends[1] - ends[0])) / units.length}.get(card.word(3))
    if kind not in ("FX", "FY", "FZ", "FXE", "FYE", "FZE") or scale is None:
        raise ValueError("moments and projected loads are not understood")
    covers = abs(card.real(4, 0.0)) < WHOLE * scale and abs(card.real(6, 0.0) - scale) < WHOLE * scale
    if not covers or card.real(7, 0.0) != card.real(5):
        raise ValueError("loads other than even ones over the whole length are not understood")
    axes: Array = np.eye(3)
    if kind.endswith("E"):
        if bar is None:
            raise ValueError("axes of elements are those of CBAR and CBEAM alone")
        axes = bar_frame(ends[1] - ends[0], bar_vector(model, bar), bar)
    force = card.real(5) * units.spring * axes["XYZ".index(kind[1])]
    bends = bar is None or not {5, 6} & {*bar.components(8), *bar.components(9)}
    return StaticLoads.combined((1.0, on_line(build, cell, force, bends)) for cell in cells)


def _combination(card: Card, sets: dict[int, StaticLoads]) -> StaticLoads:
    """LOAD: SID, S, then S1, L1, S2, L2, ...: S times the sum of Si times set Li."""
    factors = [(card.real(k), card.integer(k + 1)) for k in range(2, len(card.fields), 2) if card.has(k)]
    if unknown := [number for _, number in factors if number not in sets]:
        raise ValueError(f"there is no load {unknown[0]}")
    return StaticLoads.combined((card.real(1) * factor, sets[number]) for factor, number in factors)
