"""The way from a Nastran deck to the neutral Deck."""

from __future__ import annotations

import re
import warnings
from pathlib import Path

from femflex.decks.deck import Deck
from femflex.decks.nastran.bar_properties import BarProperties
from femflex.decks.nastran.bulk import bulk_of
from femflex.decks.nastran.general_elements import read_general_elements
from femflex.decks.nastran.grids import Grids
from femflex.decks.nastran.line_elements import read_line_elements
from femflex.decks.nastran.masses import finish_masses, read_masses
from femflex.decks.nastran.materials import Materials
from femflex.decks.nastran.model import NastranModel
from femflex.decks.nastran.nonstructural_mass import NonstructuralMass
from femflex.decks.nastran.older import renew
from femflex.decks.nastran.rigid_elements import read_rigid_elements
from femflex.decks.nastran.scalar_points import read_scalar_points
from femflex.decks.nastran.sets import read_sets
from femflex.decks.nastran.shell_elements import read_shell_elements
from femflex.decks.nastran.solid_elements import read_solid_elements
from femflex.decks.nastran.springs import finish_springs, read_springs
from femflex.decks.nastran.supports import read_supports
from femflex.decks.nastran.systems import Systems
from femflex.decks.nastran.three_node_beams import read_three_node_beams
from femflex.decks.nastran.unused import report_unused
from femflex.decks.register import Overrides
from femflex.decks.units import Units
from femflex.fem import Member
from femflex.mesh.nastran_cards import read_deck as read_cards
from femflex.mesh.upright import upright


def read(path: Path, units: Units, overrides: Overrides) -> Deck:
    """The Deck of a Nastran file. Raises DeckError with all its problems."""
    raw = read_cards(path)
    bulk = bulk_of(raw, units, overrides)
    renew(bulk)
    if not bulk.cards.get("GRID"):
        bulk.found.problem(f"{path.name} has no GRID cards; it is no Nastran deck with a structure")
        bulk.found.check(path)
    parts = [cards[0] for name, cards in bulk.cards.items() if name.startswith("BEGIN")]
    for card in parts:
        text = "".join([card.name, *card.fields[:2]]).strip()
        bulk.found.problem(f"{text}: superelements in parts are not read; write the model as one", card.place)
    if parts:
        bulk.found.check(path)
    elements = [
        name for name in bulk.cards if re.match(r"C(QUAD|TRIA|BAR|BEAM|ROD|TUBE|SHEAR|HEXA|PENTA|TETRA|PYRA)", name)
    ]
    if elements and not any(
        re.match(r"MAT|P(SHE|COMP|BAR|BEAM|ROD|TUBE|L?SOLID|BUSH|ELAS)", name) for name in bulk.cards
    ):
        bulk.found.problem_no_properties(path, "properties and materials")
        bulk.found.check(path)
    systems = Systems(bulk)
    materials = Materials(bulk)
    grids = Grids(bulk, systems)
    model = NastranModel(
        bulk, systems, grids, materials, BarProperties(bulk, materials), NonstructuralMass(bulk, grids)
    )
    read_line_elements(model)
    read_three_node_beams(model)
    read_shell_elements(model)
    read_solid_elements(model)
    read_rigid_elements(model)
    read_masses(model)
    read_springs(model)
    read_general_elements(model)
    read_scalar_points(model)
    _lone_grids(model)
    finish_springs(model)
    finish_masses(model, 0.0)
    supports, default = read_supports(model)
    read_sets(model)
    report_unused(bulk)
    known = materials.all()
    no_density = bulk.found.note_no_mass(
        [m.density for m in known], [f"mat_{m.number}" for m in known], known[0].card.place if known else ""
    )
    _unknown_overrides(model)
    if not model.build.cells and not model.moving and not bulk.found.problems:
        bulk.found.problem(f"{path.name} has no elements, masses or springs; there is no structure to make")
    bulk.found.check(path)
    mesh = model.build.mesh()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        mesh = upright(mesh, path.name) if mesh.cells else mesh
    deck = Deck(
        path.name, "Nastran", mesh, (*model.build.members(), *_node_members(model)), tuple(model.point_masses),
        tuple(model.connections), tuple(model.bushings), supports, default, dict(model.build.row_of), units,
        *_judged(materials), tuple(f"mat_{one.number}" for one in materials.all()),
        dict(sorted(bulk.found.used.items())), bulk.found.left_out, bulk.found.notes, no_density,
        tuple((f"mat_{one.number}", "density") for one in known),
    )  # fmt: skip
    asked = bulk.parameters.get("AUTOSPC")
    return deck if asked is not None and asked.word(1) == "NO" else deck.with_unresisted_held()


def _judged(materials: Materials) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Young's moduli and densities of all materials."""
    values = [one.values for one in materials.all()]
    moduli = tuple(v[key] for v in values for key in ("E", "E1") if v.get(key, 0.0) > 0)
    return moduli, tuple(v["density"] for v in values if v["density"] > 0)


def _lone_grids(model: NastranModel) -> None:
    """Give dofs to grids that masses, springs and constraints alone act on."""
    lone = sorted(model.wanted - model.moving)
    if not model.build.cells and model.connections:  # rigid elements that join masses and springs alone
        lone = sorted(model.wanted | model.moving)
        model.wanted_turning |= model.turning
    for turns in (False, True):
        own = [g for g in lone if (g in model.wanted_turning) == turns]
        rows = [*map(model.row, own), *([] if turns else model.free_points)]
        if rows:
            model.build.point_groups["lone_nodes" + ("_turning" if turns else "")] = rows
            model.turning.update(own if turns else [])
    model.moving.update(lone)


def _node_members(model: NastranModel) -> list[Member]:
    names = {"lone_nodes": False, "lone_nodes_turning": True}
    return [
        Member(name, "nodes", options={"rotations": turns})
        for name, turns in names.items()
        if name in model.build.point_groups
    ]


def _unknown_overrides(model: NastranModel) -> None:
    for name in model.bulk.overrides:
        if name not in model.bulk.taken:
            model.bulk.found.problem(
                f"override of {name!r}: the deck has no such property or material; they are named pid_3 and mat_1, or "
                "as the deck's comments name them"
            )
