"""Solids: CTETRA, CPYRAM, CPENTA, CHEXA on PSOLID, with the material's coordinate system."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from femflex.arrays import Array
from femflex.decks.builder import direction_key
from femflex.decks.nastran.bulk import ByNumber
from femflex.decks.nastran.card import Card
from femflex.decks.nastran.model import NastranModel, with_middles
from femflex.fem.sections.materials import Anisotropic, Material, Orthotropic
from femflex.mesh.cells import CELL_TYPES
from femflex.mesh.formats.nastran import ELEMENTS
from femflex.mesh.formats.nastran_cards import ORDER

KINDS = {card: cells for card, cells in ELEMENTS.items() if CELL_TYPES[cells[min(cells)]].dimension == 3}


@dataclass(frozen=True, eq=False)
class Solid:
    """A property of solids: its material, None of fluids, and the number of the material's coordinate system."""

    material: Material | Orthotropic | Anisotropic | None
    system: int


def read_solid_elements(model: NastranModel) -> None:
    """Add the solids of a deck to the model."""
    bulk = model.bulk
    fluids = {card.integer(0) for card in bulk.cards.get("MAT10", ()) if card.is_integer(0)}
    unread = ("PCOMPS", "PCOMPLS", "PLSOLID")
    properties: ByNumber[Solid] = ByNumber(bulk, "property", "of solids it has", unread, "PSOLID")
    properties.read_cards("PSOLID", lambda card: Solid(_material(model, card, fluids), card.integer(2, 0)))
    for name in KINDS:
        bulk.for_each_card(lambda card: _solid(model, card, properties), name)


def _material(model: NastranModel, card: Card, fluids: set[int]) -> Material | Orthotropic | Anisotropic | None:
    """The material of a PSOLID; None of a fluid."""
    if card.word(6) == "PFLUID" or card.integer(1) in fluids:
        return None
    return model.materials(card.integer(1)).solid()


def _solid(model: NastranModel, card: Card, properties: ByNumber[Solid]) -> None:
    number, pid, cells = card.integer(0), card.integer(1, card.integer(0)), KINDS[card.name]
    n_corners, n_nodes = sorted(cells)
    corners = [card.integer(2 + k) for k in range(n_corners)]
    grids = [*corners, *(card.integer(2 + k, 0) for k in range(n_corners, n_nodes))]
    middles = [grids[k] for k in ORDER.get(cells[n_nodes], range(n_nodes))][n_corners:]
    if not model.grids.require(corners + [g for g in middles if g], card):
        return
    if (solid := properties(pid)) is None:
        return
    if (material := solid.material) is None:
        text = "the fluid is left out; its mass is missing"
        model.bulk.findings.unused(f"{card.name} of fluids", text, card.location)
        return
    rows, cell = [model.row(g) for g in corners], cells[n_nodes if any(middles) else n_corners]
    x = np.array([model.grids[g].position for g in corners])
    if any(middles):
        rows += with_middles(model, cell, corners, middles, card)
    options: dict[str, object] = {}
    if not isinstance(material, Material) and solid.system:
        options["axes"] = tuple(float(c) for c in _axes(model, solid, x).ravel()[:6])
    key = ("solid", pid, direction_key(options["axes"], 6) if options else None)  # type: ignore[arg-type]
    model.build.cell(
        cell, rows, key, f"pid_{pid}", "solid", None, material, options,
        model.bulk.names_of(pid), number,
    )  # fmt: skip
    model.moving.update(corners + [g for g in middles if g])


def _axes(model: NastranModel, solid: Solid, x: Array) -> Array:
    """Axes 1, 2, 3 of the material at an element with corners x (k, 3), as rows."""
    if solid.system > 0:
        return model.systems(solid.system).axes_at(x.mean(axis=0))
    if len(x) == 8:  # -1: element axes, lines through the middles of opposite faces
        R = x[[1, 2, 5, 6]].mean(axis=0) - x[[0, 3, 4, 7]].mean(axis=0)
        S = x[[2, 3, 6, 7]].mean(axis=0) - x[[0, 1, 4, 5]].mean(axis=0)
    else:
        R, S = x[1] - x[0], x[2] - x[0]
    first = R / np.linalg.norm(R)
    third = np.cross(first, S)
    third /= np.linalg.norm(third)
    return np.stack([first, np.cross(third, first), third])
