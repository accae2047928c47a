"""Read a Nastran deck into a Deck."""

from __future__ import annotations

import re
from pathlib import Path

from femflex.decks.autospc import with_autospc
from femflex.decks.deck import Deck
from femflex.decks.findings import Overrides
from femflex.decks.nastran.bar_properties import BarProperties
from femflex.decks.nastran.bulk import bulk_of
from femflex.decks.nastran.grids import Grids
from femflex.decks.nastran.line_elements import read_line_elements
from femflex.decks.nastran.loads import read_loads
from femflex.decks.nastran.masses import read_masses
from femflex.decks.nastran.materials import Materials
from femflex.decks.nastran.model import NastranModel
from femflex.decks.nastran.nonstructural_mass import NonstructuralMass
from femflex.decks.nastran.rigid_elements import read_rigid_elements
from femflex.decks.nastran.scalar_points import fix_absent_components, place_scalar_points
from femflex.decks.nastran.shell_elements import read_shell_elements
from femflex.decks.nastran.solid_elements import read_solid_elements
from femflex.decks.nastran.springs import finish_springs, read_springs
from femflex.decks.nastran.supports import read_supports
from femflex.decks.nastran.systems import Systems
from femflex.decks.nastran.unused import report_unused
from femflex.decks.register import Values
from femflex.decks.units import Units
from femflex.mesh.formats.nastran_cards import named_sets
from femflex.mesh.formats.nastran_cards import read_deck as read_cards


def read_nastran_deck(path: Path, units: Units, overrides: Values) -> Deck:
    """The Deck of a Nastran file. Raises DeckError with all its problems."""
    raw = read_cards(path)
    bulk = bulk_of(raw, units, Overrides(overrides))
    if not bulk.cards.get("GRID"):
        bulk.findings.problem(f"{path.name} has no GRID cards; it is no Nastran deck with a structure")
        bulk.findings.check(path)
    superelements = [cards[0] for name, cards in bulk.cards.items() if name.startswith("BEGIN")]
    for card in superelements:
        text = "".join([card.name, *card.fields[:2]]).strip()
        bulk.findings.problem(f"{text}: superelements in parts are not read; write the model as one", card.location)
    if superelements:
        bulk.findings.check(path)
    elements = [
        name for name in bulk.cards if re.match(r"C(QUAD|TRIA|BAR|BEAM|ROD|TUBE|SHEAR|HEXA|PENTA|TETRA|PYRA)", name)
    ]
    if elements and not any(
        re.match(r"MAT|P(SHE|COMP|BAR|BEAM|ROD|TUBE|L?SOLID|BUSH|ELAS)", name) for name in bulk.cards
    ):
        bulk.findings.problem_no_properties(path, "properties and materials")
        bulk.findings.check(path)
    scalars = place_scalar_points(bulk)
    systems = Systems(bulk)
    materials = Materials(bulk)
    grids = Grids(bulk, systems)
    model = NastranModel(
        bulk, systems, grids, materials, BarProperties(bulk, materials), NonstructuralMass(bulk), scalars,
        findings=bulk.findings,
    )  # fmt: skip
    read_line_elements(model)
    read_shell_elements(model)
    read_solid_elements(model)
    read_rigid_elements(model)
    read_masses(model)
    read_springs(model)
    fix_absent_components(model)
    model.add_lone_nodes()
    finish_springs(model)
    model.finish_masses()
    supports, default = read_supports(model)
    loads = read_loads(model)
    _add_sets(model)
    report_unused(bulk)
    text = "such property or material; they are named pid_3 and mat_1, or as the deck's comments name them"
    bulk.override.report_unknown(bulk.findings, text)
    if not model.build.cells and not model.moving and not bulk.findings.problems:
        bulk.findings.problem(f"{path.name} has no elements, masses or springs; there is no structure to make")
    deck = model.deck(path, "Nastran", units, supports, default, materials.all_materials(), loads=loads)
    autospc = bulk.parameters.get("AUTOSPC")
    return deck if autospc is not None and autospc.word(1) == "NO" else with_autospc(deck)


def _add_sets(model: NastranModel) -> None:
    """Add the sets of a deck as groups of points or of cells; the kind follows from a comment, SET3, or the numbers."""
    raw, build = model.bulk.raw, model.build
    sets, wrong = named_sets(raw)
    list(model.bulk.cards_named("SET1", "SET3"))  # counts them as used
    for raw_card, reason in wrong:
        text = f"{raw_card.file}:{raw_card.line}: {raw_card.name} {raw_card.fields[0]} is left out: {reason}"
        model.bulk.findings.note(text)
    for number, (members, kind) in sets.items():
        grids = members.among(build.row_of) if kind != "2" else []
        names = [f"set_{number}"] + ([raw.set_names[number][1]] if number in raw.set_names else [])
        if kind == "1" or (not kind and members.all_in(model.grids)):
            if grids:
                for name in names:
                    build.point_groups.setdefault(name, [build.row_of[g] for g in grids])
            continue
        for element in members.among(build.cell_of):
            for cell, row in build.cell_of[element]:
                for name in names:
                    build.cell_groups.setdefault(name, {}).setdefault(cell, []).append(row)
