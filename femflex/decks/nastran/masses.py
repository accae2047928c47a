"""Concentrated masses: CONM2, CONM1 and CMASS1 to 4."""

from __future__ import annotations

from functools import partial

import numpy as np

from femflex.arrays import Array
from femflex.decks.nastran.card import Card
from femflex.decks.nastran.model import NastranModel
from femflex.fem import MultiPointConstraint
from femflex.fem.point_mass import DeckMass, check_inertia
from femflex.fem.support import COMPONENTS

EQUAL_MASSES = 1e-5  # relative difference of masses in several directions that are treated as one mass


def read_masses(model: NastranModel) -> None:
    """Add the concentrated masses of a deck to the model."""
    bulk = model.bulk
    bulk.for_each_card(lambda card: _conm2(model, card), "CONM2")
    bulk.for_each_card(lambda card: _conm1(model, card), "CONM1", use=False)
    _add_scalar_masses(model)


def _conm2(model: NastranModel, card: Card) -> None:
    u, factor = model.bulk.units, model.bulk.wtmass
    grid, cid = card.integer(1), card.integer(2, 0)
    if not model.grids.require([grid], card):
        return
    mass = card.real(3, 0.0) * u.mass * factor
    offset_fields = np.array(card.reals(4, 3))
    x = model.grids[grid].position
    if cid == -1:  # the offset is the position of the centre in basic coordinates
        axes, offset = np.eye(3), offset_fields * u.length - x
    else:
        axes = model.systems(cid).axes_at(x)
        offset = offset_fields * u.length @ axes
    i11, i21, i22, i31, i32, i33 = (value * u.inertia * factor for value in card.reals(8, 6))
    inertia = np.array([[i11, -i21, -i31], [-i21, i22, -i32], [-i31, -i32, i33]])
    _add(model, card, grid, mass, axes.T @ inertia @ axes, offset)


def _add(model: NastranModel, card: Card, grid: int, mass: float, inertia: Array, offset: Array) -> None:
    if mass < 0:
        raise ValueError(f"{card} has mass {mass:.6g} kg; a mass cannot be negative")
    if not mass and not inertia.any():
        model.bulk.findings.unused(card.name, "no mass and no inertia; nothing is left out", card.location)
        return
    check_inertia(inertia, f"the inertia of {card}")
    model.add_mass(grid, mass, inertia, offset if mass else np.zeros(3), str(card), card.location)


def _conm1(model: NastranModel, card: Card) -> None:
    """Add a 6 x 6 mass matrix if it is that of a rigid body; otherwise report it as unused."""
    u, factor = model.bulk.units, model.bulk.wtmass
    grid, cid = card.integer(1), card.integer(2, 0)
    if not model.grids.require([grid], card):
        return
    M = np.zeros((6, 6))
    M[np.tril_indices(6)] = card.reals(3, 21)
    M = M + np.tril(M, -1).T
    mass = M[0, 0]
    move, cross = M[:3, :3], M[3:, :3]
    scale = max(abs(mass), 1e-300)
    rigid = np.abs(move - mass * np.eye(3)).max() <= 1e-6 * scale and np.abs(cross + cross.T).max() <= 1e-6 * max(
        np.abs(cross).max(), 1e-300
    )
    if not rigid or not mass > 0:
        model.bulk.findings.unused(
            "CONM1",
            "mass matrices that are not those of a rigid body are left out; their mass is missing",
            card.location,
        )
        return
    model.bulk.findings.use("CONM1")
    S = cross / mass  # skew of the offset: M = [m, -m skew(r); m skew(r), J]
    r = np.array([S[2, 1], S[0, 2], S[1, 0]])
    inertia = M[3:, 3:] - mass * (r @ r * np.eye(3) - np.outer(r, r))
    axes = model.systems(cid).axes_at(model.grids[grid].position)
    _add(model, card, grid, mass * u.mass * factor, axes.T @ inertia @ axes * u.inertia * factor, r * u.length @ axes)


def _add_scalar_masses(model: NastranModel) -> None:
    """Add the CMASS of single grids: equal masses in components 1 to 3 form a point mass, others move along one
    component; components 4 to 6 are inertias about the displacement axes."""
    bulk, by_grid, values = model.bulk, dict[int, dict[int, tuple[float, Card]]](), dict[int, float]()
    components_of = model.scalars.components()
    bulk.for_each_card(lambda card: values.update(card.pairs(0, 2, 4, 6)), "PMASS")
    for name in ("CMASS1", "CMASS2"):
        for card in bulk.cards_named(name, use=False):
            if not (ends := model.ends(card)):
                continue
            m = values.get(card.integer(1, card.integer(0)), 0.0) if name == "CMASS1" else card.real(1, 0.0)
            if len(ends) == 1 and ends[0][0] in model.grids and len(ends[0][1]) == 1:
                by_component, component = by_grid.setdefault(ends[0][0], {}), ends[0][1][0]
                other, first = by_component.get(component, (0.0, card))
                by_component[component] = other + m, first
            elif {grid for grid, _ in ends} & components_of.keys():
                bulk.findings.problem(
                    f"{card} is a mass between two components, one of them of a scalar point, which is not read; give "
                    "each component a mass to ground", card.location,
                )  # fmt: skip
            else:
                bulk.findings.unused(name, "masses between two components are left out and missing", card.location)
    u, none = bulk.units, np.zeros(3)
    for grid, by_component in by_grid.items():
        ways = {c: m for c, (m, _) in by_component.items() if c <= 3}
        if ways.keys() == components_of.get(grid, {1, 2, 3}) & {1, 2, 3} and ways:
            smallest, largest = min(ways.values()), max(ways.values())
            if smallest > 0 and largest - smallest <= EQUAL_MASSES * largest:  # one mass in all its directions
                cards = [by_component.pop(c)[1] for c in ways]
                mass = smallest * u.mass * bulk.wtmass
                bulk.attempt(cards[0], partial(_add, model, cards[0], grid, mass, np.zeros((3, 3)), none))
                bulk.findings.used.update(card.name for card in cards)
        turning = {c: by_component.pop(c) for c in (4, 5, 6) if by_component.get(c, (0.0,))[0] > 0}
        if turning:
            axes, first = model.grids.axes(grid), next(iter(turning.values()))[1]
            J = np.sum([m * np.outer(axes[c - 4], axes[c - 4]) for c, (m, _) in turning.items()], axis=0)
            bulk.attempt(first, partial(_add, model, first, grid, 0.0, J * u.inertia * bulk.wtmass, none))
            bulk.findings.used.update(card.name for _, card in turning.values())
        for component, (mass, card) in by_component.items():
            if component <= 3 and mass > 0:
                bulk.findings.use(card.name)
                _add_along(model, grid, component, mass * u.mass * bulk.wtmass, card)
            elif mass:
                bulk.findings.unused(card.name, "masses below zero are left out and missing", card.location)


def _add_along(model: NastranModel, grid: int, component: int, mass: float, card: Card) -> None:
    """Add a mass [kg] on a point that follows a grid in one component, and does not move in the others."""
    name, axes = f"mass_{grid}_{component}", model.grids.axes(grid)
    model.build.point_group(model.build.point(model.grids[grid].position), name)
    model.free_points.append(model.build.point_groups[name][0])
    matrix = np.zeros((3, 6))
    matrix[component - 1, :3] = axes[component - 1]
    rows = tuple(map(tuple, np.asarray(axes).tolist()))
    model.connections.append(MultiPointConstraint(name, COMPONENTS[:3], (model.group(grid),), matrix, rows, str(card)))
    model.point_masses.append(DeckMass(group=name, mass=mass))
    model.required.add(grid)
    model.bulk.findings.note(
        f"the mass of {card} moves in component {component} of grid {grid}; in the other directions it is fixed "
        "to the body's frame"
    )
