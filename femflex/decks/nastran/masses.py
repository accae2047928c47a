"""Concentrated masses: CONM2, CONM1 and CMASS1 to 4."""

from __future__ import annotations

import numpy as np

from femflex.arrays import Array
from femflex.decks.nastran.card import Card
from femflex.decks.nastran.model import NastranModel
from femflex.fem import PointMass
from femflex.fem.point_mass import check_inertia

NO_MASS = 1e-6  # [kg] of the total mass: what an inertia without mass is given


def read_masses(model: NastranModel) -> None:
    """Add the concentrated masses of a deck to the model."""
    bulk = model.bulk
    bulk.trying(lambda card: _conm2(model, card), "CONM2")
    bulk.trying(lambda card: _conm1(model, card), "CONM1", use=False)
    _scalar(model)


def _conm2(model: NastranModel, card: Card) -> None:
    u, factor = model.bulk.units, model.bulk.wtmass
    grid, cid = card.integer(1), card.integer(2, 0)
    if not model.grids.require([grid], card):
        return
    mass = card.real(3, 0.0) * u.mass * factor
    given = np.array(card.reals(4, 3))
    x = model.grids[grid].position
    if cid == -1:  # the offset is the position of the centre in basic coordinates
        axes, offset = np.eye(3), given * u.length - x
    else:
        axes = model.systems(cid).axes_at(x)
        offset = given * u.length @ axes
    i11, i21, i22, i31, i32, i33 = (value * u.inertia * factor for value in card.reals(8, 6))
    own = np.array([[i11, -i21, -i31], [-i21, i22, -i32], [-i31, -i32, i33]])
    _add(model, card, grid, mass, axes.T @ own @ axes, offset)


def _add(model: NastranModel, card: Card, grid: int, mass: float, inertia: Array, offset: Array) -> None:
    if mass < 0:
        raise ValueError(f"{card} has mass {mass:.6g} kg; a mass cannot be negative")
    if not mass and not inertia.any():
        model.bulk.found.unused(card.name, "no mass and no inertia; nothing is left out", card.place)
        return
    check_inertia(inertia, f"the inertia of {card}")
    if not mass:
        model.inertias.append((grid, inertia, card))
        model.wanted.add(grid)
        model.wanted_turning.add(grid)
        return
    model.masses.append((grid, mass, inertia if inertia.any() else None, offset, card))
    model.wanted.add(grid)
    if inertia.any() or offset.any():
        model.wanted_turning.add(grid)


def _conm1(model: NastranModel, card: Card) -> None:
    """A 6 x 6 mass matrix, where it is that of a rigid body; else it cannot be used."""
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
        model.bulk.found.unused(
            "CONM1", "mass matrices that are not those of a rigid body are left out; their mass is missing", card.place
        )
        return
    model.bulk.found.use("CONM1")
    S = cross / mass  # skew of the offset: M = [m, -m skew(r); m skew(r), J]
    r = np.array([S[2, 1], S[0, 2], S[1, 0]])
    inertia = M[3:, 3:] - mass * (r @ r * np.eye(3) - np.outer(r, r))
    axes = model.systems(cid).axes_at(model.grids[grid].position)
    _add(model, card, grid, mass * u.mass * factor, axes.T @ inertia @ axes * u.inertia * factor, r * u.length @ axes)


def _scalar(model: NastranModel) -> None:
    """CMASS of one grid: the same mass in components 1 to 3 is a point mass, components 4 to 6 are inertias about the
    axes of its displacements; else left out."""
    bulk, by_grid = model.bulk, dict[int, dict[int, tuple[float, Card]]]()
    values = {
        card.integer(k): card.real(k + 1, 0.0) for card in bulk.each("PMASS") for k in (0, 2, 4, 6) if card.has(k)
    }
    for name in ("CMASS1", "CMASS2", "CMASS3", "CMASS4"):
        for card in bulk.each(name, use=False):
            at = card.integer(2, 0) if name in ("CMASS1", "CMASS2") else 0
            components = card.components(3) if at else ()
            m = values.get(card.integer(1, 0), 0.0) if name in ("CMASS1", "CMASS3") else card.real(1, 0.0)
            if at in model.grids and len(components) == 1 and not card.has(4):
                by_grid.setdefault(at, {})[components[0]] = (m, card)
            else:
                bulk.found.unused(name, "masses between components or of scalar points are left out", card.place)
    for grid, given in by_grid.items():
        masses = [given[c][0] for c in (1, 2, 3) if c in given]
        first = next(iter(given.values()))[1]
        if len(masses) == 3 and max(masses) - min(masses) <= 1e-9 * max(masses) and masses[0] > 0:
            for c in (1, 2, 3):
                bulk.found.use(given[c][1].name)
            u = bulk.units.mass * bulk.wtmass
            bulk.attempt(first, lambda grid=grid, m=masses[0] * u, card=first: _add(  # type: ignore[misc]
                model, card, grid, m, np.zeros((3, 3)), np.zeros(3)
            ))  # fmt: skip
            given = {c: one for c, one in given.items() if c > 3}
        turning = {c: given.pop(c) for c in (4, 5, 6) if c in given and given[c][0] > 0}
        if turning:
            for _, card in turning.values():
                bulk.found.use(card.name)
            own = np.array([turning[c][0] if c in turning else 0.0 for c in (4, 5, 6)])
            axes = model.systems(model.grids[grid].displacement).axes_at(model.grids[grid].position)
            J = axes.T @ np.diag(own) @ axes * bulk.units.inertia * bulk.wtmass
            card = next(iter(turning.values()))[1]
            bulk.attempt(card, lambda grid=grid, J=J, card=card: _add(  # type: ignore[misc]
                model, card, grid, 0.0, J, np.zeros(3)
            ))  # fmt: skip
        for _, card in given.values():
            bulk.found.unused(card.name, "a mass in one direction alone is left out; that mass is missing", card.place)


def finish_masses(model: NastranModel, total: float) -> None:
    """Make the point masses, now that it is known which grids turn; `total` is the mass of everything else [kg]."""
    found = model.bulk.found
    for grid, mass, inertia, offset, card in model.masses:
        if grid not in model.turning and (inertia is not None or offset.any()):
            what = "inertia" if inertia is not None else "offset"
            found.unused(
                f"{card.name} {what}" + (" and offset" if inertia is not None and offset.any() else ""),
                "its grid has no rotation (solids, rods): its mass acts at the grid", card.place,
            )  # fmt: skip
            inertia, offset = None, np.zeros(3)
        model.point_masses.append(
            PointMass(model.group(grid), mass, inertia, tuple(float(c) for c in offset), bodily=False)
        )
    for grid, inertia, card in model.inertias:
        if grid not in model.turning:
            found.unused(f"{card.name} inertia", "its grid has no rotation; the inertia is left out", card.place)
            continue
        light = NO_MASS * max(total, 1e-9)
        found.note(f"{card} has an inertia and no mass; it gets {light:.3g} kg")
        model.point_masses.append(PointMass(model.group(grid), light, inertia, bodily=False))
