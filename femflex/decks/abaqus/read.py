"""Read an Abaqus deck into a Deck."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from femflex.decks.abaqus.axes import read_orientations, read_transforms
from femflex.decks.abaqus.connections import read_connections, read_ties
from femflex.decks.abaqus.loads import read_loads
from femflex.decks.abaqus.materials import Materials
from femflex.decks.abaqus.model import AbaqusModel
from femflex.decks.abaqus.nonstructural_mass import read_nonstructural_mass
from femflex.decks.abaqus.points import read_masses, read_springs
from femflex.decks.abaqus.sections import SectionInputs, read_elements
from femflex.decks.abaqus.supports import read_supports
from femflex.decks.abaqus.surfaces import read_surfaces
from femflex.decks.abaqus.unused import consequence_of_type, elements_by_kind, report_unused
from femflex.decks.autospc import with_autospc
from femflex.decks.deck import Deck
from femflex.decks.findings import Overrides
from femflex.decks.model import NODE_MEMBERS
from femflex.decks.register import Values
from femflex.decks.units import Units
from femflex.mesh.formats.abaqus_flat import read_flat

# families that give stiffness to all components of their nodes
FULL_RANK_FAMILIES = {
    "beam",
    "plate",
    "shell",
    "solid",
}
RIGID_TYPES = ("R3D", "RB3D", "R2D", "RB2D")


def read_abaqus_deck(path: Path, units: Units, overrides: Values) -> Deck:
    """The Deck of an Abaqus or CalculiX file. Raises DeckError with all its problems."""
    model = AbaqusModel(read_flat(path), units, Overrides(overrides))
    flat, findings = model.flat, model.findings
    # elements without a cell, such as fluid networks, may have nodes 0
    used = [element for element in flat.elements.values() if element.cell]
    missing = {n for element in used for n in (*element.nodes, *element.extra)} - flat.nodes.keys()
    for element in used if missing else ():
        missing_nodes = sorted(missing & {*element.nodes, *element.extra})
        if missing_nodes:
            findings.problem(
                f"{element.location}: element {flat.label(element.number)} uses node "
                f"{flat.label(missing_nodes[0], element.number)}, which no *NODE block defines; "
                f"{len(missing)} nodes are missing in all"
            )
            break
    if used and not any(k.name.endswith("SECTION") or k.name in ("MATERIAL", "RIGID BODY") for _, k in flat.keywords):
        findings.problem_no_properties(path, "sections and materials")
    findings.check(path)
    model.flat_rigid.update(e.number for e in flat.elements.values() if e.kind.startswith(RIGID_TYPES))
    systems = read_orientations(model)
    surfaces = read_surfaces(model)
    read_ties(model, surfaces)
    transforms = read_transforms(model)
    inputs = SectionInputs(Materials(model), systems, _nodal_thickness(model))
    read_elements(model, inputs)
    read_nonstructural_mass(model)
    read_connections(model, inputs, surfaces, transforms)
    read_masses(model, inputs)
    read_springs(model, inputs)
    model.add_lone_nodes()
    model.finish_masses()
    supports, default = read_supports(model, transforms)
    loads = read_loads(model, surfaces, transforms)
    _add_set_groups(model)
    report_unused(model)
    materials = inputs.materials.all_materials()
    model.override.report_unknown(findings, "material and no section of that name")
    if not model.build.cells and not model.moving and not findings.problems:
        kinds = elements_by_kind(list(flat.elements.values()))
        for kind, (count, location) in kinds.items():
            findings.problem(f"{count} elements of type {kind}: {consequence_of_type(kind)}", location)
        if not kinds:
            findings.problem(f"{path.name} has no elements; there is no structure to make")
    deck = model.deck(
        path, "Abaqus", units, supports, default, materials, model.area_masses, model.bare_sections, loads=loads,
    )  # fmt: skip
    lone = NODE_MEMBERS.keys() & model.build.point_groups.keys()
    stiff = model.build.families() <= FULL_RANK_FAMILIES and not model.connections and not lone
    return deck if stiff else with_autospc(deck)  # which assembles the structure


def _nodal_thickness(model: AbaqusModel) -> dict[int, float]:
    """Thickness at nodes, in the deck's units (*NODAL THICKNESS)."""
    thickness: dict[int, float] = {}
    for scope, keyword in model.keywords_named("NODAL THICKNESS"):
        for k, row in enumerate(keyword.data):
            value = keyword.real(row[1] if len(row) > 1 else "", k, "a thickness")
            thickness |= dict.fromkeys(model.nodes_of(row[0], scope, keyword, k), value)
    return thickness


def _add_set_groups(model: AbaqusModel) -> None:
    """Groups of the deck's sets: sets of elements that are cells, and of nodes that are points of the mesh."""
    build = model.build
    for name, numbers in model.flat.elsets.members().items():
        rows: dict[str, list[int]] = {}
        for number in numbers.among(build.cell_of):
            for cell, row in build.cell_of[number]:
                rows.setdefault(cell, []).append(row)
        if rows:
            build.cell_groups[name] = {cell: sorted(cell_rows) for cell, cell_rows in rows.items()}
    used = {node for node in model.flat.nodes if model.representative(node) in build.row_of}
    for name, numbers in model.flat.nsets.members().items():
        points = sorted({build.row_of[model.representative(node)] for node in numbers.among(used)})
        if points and name not in build.point_groups:
            build.point_groups[name] = np.array(points, np.int64).tolist()
