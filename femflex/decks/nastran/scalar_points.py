"""Masses of scalar points on one spring, as absorbers and sloshing liquid are modelled: points that move along it.

A scalar point has no place. Its mass is put at the grid point that the spring holds on to, moves along the spring's
component against that grid point, and follows it in the others. Masses alike on springs of one grid point are one mass.
"""

from __future__ import annotations

import numpy as np

from femflex.decks.nastran.card import Card
from femflex.decks.nastran.model import WORDS, NastranModel
from femflex.fem import MultiPointConstraint, PointMass, ScalarSpring

Spring = tuple[int, int, float, Card]  # grid point, component 1 to 3, stiffness [N/m], its card
ALIKE = 1e-6  # part by which masses of one mass in several directions differ


def read_scalar_points(model: NastranModel) -> None:
    """Add the masses of scalar points, with their springs, to the model; others are left out."""
    found = model.bulk.found
    by_grid: dict[int, list[tuple[float, Spring, Card]]] = {}
    placed: set[int] = set()
    for point, (mass, card) in model.scalar_masses.items():
        mine = [(ends, k, spring) for ends, k, spring in model.scalar_springs if point in {g for g, _ in ends}]
        others = [end for ends, _, _ in mine for end in ends if end[0] != point]
        on_grid = len(mine) == len(others) == 1 and others[0][0] in model.grids
        if mass > 0 and on_grid and len(others[0][1]) == 1 and others[0][1][0] <= 3:
            (grid, (component,)), (_, k, spring) = others[0], mine[0]
            by_grid.setdefault(grid, []).append((mass, (grid, component, k * model.bulk.units.spring, spring), card))
            placed.add(point)
        else:
            text = "masses of scalar points that do not hang on one spring of a grid point are left out and missing"
            found.unused(card.name, text, card.place)
    for ends, _, spring in model.scalar_springs:
        if not placed & {g for g, _ in ends}:
            text = "springs of scalar points without mass are left out; their stiffness is missing"
            found.unused(spring.name, text, spring.place)
    for grid, hung in by_grid.items():
        components = [spring[1] for _, spring, _ in hung]
        largest = max(mass for mass, _, _ in hung)
        one = len(set(components)) == len(hung) and all(mass > largest * (1 - ALIKE) for mass, _, _ in hung)
        for own in [hung] if one else [[single] for single in hung]:
            _hang(model, grid, own)


def _hang(model: NastranModel, grid: int, hung: list[tuple[float, Spring, Card]]) -> None:
    """One mass at a grid point that moves along the components of its springs."""
    found, mass = model.bulk.found, hung[0][0] * model.bulk.units.mass * model.bulk.wtmass
    name = model.new_name(f"scalar_mass_{grid}")
    model.build.point_group(model.build.point(model.grids[grid].position), name)
    model.free_points.append(model.build.point_groups[name][0])
    axes = model.grids.axes(grid)
    for _, (_, component, k, spring), card in hung:
        direction = axes[component - 1]
        x, y, z = map(float, direction)
        terms = ((name, "translation", (x, y, z)), (model.group(grid), "translation", (-x, -y, -z)))
        model.bushings.append(ScalarSpring(terms, k))
        found.use(spring.name)
        found.use(card.name)
    follows = tuple(WORDS[c - 1] for c in (1, 2, 3) if c not in {spring[1] for _, spring, _ in hung})
    if follows:
        matrix = np.zeros((len(follows), 6))
        matrix[:, :3] = [axes[WORDS.index(word)] for word in follows]
        rows = tuple(map(tuple, np.asarray(axes).tolist()))
        leader, card = (model.group(grid),), hung[0][2]
        model.connections.append(MultiPointConstraint(name, follows, leader, matrix, rows, str(card)))
        found.note(
            f"the mass of {card}, of a scalar point, is one at grid {grid}: it follows that in {', '.join(follows)}"
        )
    model.point_masses.append(PointMass(name, mass))
    model.wanted.add(grid)
