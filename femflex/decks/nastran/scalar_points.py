"""Masses of scalar points on one spring, which model absorbers and sloshing liquid, as points that move along the
spring.

A scalar point has no position. Its mass is placed at the grid point of the spring, moves relative to it along the
spring's component, and follows it in the others. Equal masses on springs of one grid point are a single mass.
"""

from __future__ import annotations

import numpy as np

from femflex.decks.nastran.card import Card
from femflex.decks.nastran.model import WORDS, NastranModel
from femflex.fem import MultiPointConstraint, PointMass, ScalarSpring

Spring = tuple[int, int, float, Card]  # grid point, component 1 to 3, stiffness [N/m], its card
EQUAL_MASSES = 1e-6  # relative difference of masses in several directions that are treated as one mass


def read_scalar_points(model: NastranModel) -> None:
    """Add the masses of scalar points, with their springs, to the model; others are reported as unused."""
    findings = model.bulk.findings
    by_grid: dict[int, list[tuple[float, Spring, Card]]] = {}
    used_points: set[int] = set()
    for point, (mass, card) in model.scalar_masses.items():
        springs_of_point = [
            (ends, k, spring) for ends, k, spring in model.scalar_springs if point in {g for g, _ in ends}
        ]
        others = [end for ends, _, _ in springs_of_point for end in ends if end[0] != point]
        on_grid = len(springs_of_point) == len(others) == 1 and others[0][0] in model.grids
        if mass > 0 and on_grid and len(others[0][1]) == 1 and others[0][1][0] <= 3:
            (grid, (component,)), (_, k, spring) = others[0], springs_of_point[0]
            by_grid.setdefault(grid, []).append((mass, (grid, component, k * model.bulk.units.spring, spring), card))
            used_points.add(point)
        else:
            text = "masses of scalar points that do not hang on one spring of a grid point are left out and missing"
            findings.unused(card.name, text, card.location)
    for ends, _, spring in model.scalar_springs:
        if not used_points & {g for g, _ in ends}:
            text = "springs of scalar points without mass are left out; their stiffness is missing"
            findings.unused(spring.name, text, spring.location)
    for grid, masses in by_grid.items():
        components = [spring[1] for _, spring, _ in masses]
        largest = max(mass for mass, _, _ in masses)
        is_single_mass = len(set(components)) == len(masses) and all(
            mass > largest * (1 - EQUAL_MASSES) for mass, _, _ in masses
        )
        for mass_group in [masses] if is_single_mass else [[single] for single in masses]:
            _add_sprung_mass(model, grid, mass_group)


def _add_sprung_mass(model: NastranModel, grid: int, masses: list[tuple[float, Spring, Card]]) -> None:
    """Add a mass at a grid point that moves along the components of its springs."""
    findings, mass = model.bulk.findings, masses[0][0] * model.bulk.units.mass * model.bulk.wtmass
    name = model.new_name(f"scalar_mass_{grid}")
    model.build.point_group(model.build.point(model.grids[grid].position), name)
    model.free_points.append(model.build.point_groups[name][0])
    axes = model.grids.axes(grid)
    for _, (_, component, k, spring), card in masses:
        direction = axes[component - 1]
        x, y, z = map(float, direction)
        terms = ((name, "translation", (x, y, z)), (model.group(grid), "translation", (-x, -y, -z)))
        model.bushings.append(ScalarSpring(terms, k))
        findings.use(spring.name)
        findings.use(card.name)
    dependent = tuple(WORDS[c - 1] for c in (1, 2, 3) if c not in {spring[1] for _, spring, _ in masses})
    if dependent:
        matrix = np.zeros((len(dependent), 6))
        matrix[:, :3] = [axes[WORDS.index(word)] for word in dependent]
        rows = tuple(map(tuple, np.asarray(axes).tolist()))
        leader, card = (model.group(grid),), masses[0][2]
        model.connections.append(MultiPointConstraint(name, dependent, leader, matrix, rows, str(card)))
        findings.note(
            f"the mass of {card}, of a scalar point, is one at grid {grid}: it follows that in {', '.join(dependent)}"
        )
    model.point_masses.append(PointMass(name, mass))
    model.required.add(grid)
