"""The way from an Abaqus deck to the neutral Deck."""

from __future__ import annotations

import warnings
from pathlib import Path

import numpy as np

from femflex.decks.abaqus.axes import read_orientations, read_transforms
from femflex.decks.abaqus.connections import read_connections, read_ties
from femflex.decks.abaqus.materials import Materials
from femflex.decks.abaqus.model import AbaqusModel
from femflex.decks.abaqus.nonstructural_mass import read_nonstructural_mass
from femflex.decks.abaqus.points import finish_masses, read_masses, read_springs
from femflex.decks.abaqus.sections import Reading, read_elements
from femflex.decks.abaqus.supports import read_supports
from femflex.decks.abaqus.surfaces import read_surfaces
from femflex.decks.abaqus.unused import elements_by_kind, report_unused, unread
from femflex.decks.deck import Deck
from femflex.decks.register import Overrides
from femflex.decks.units import Units
from femflex.fem import Member
from femflex.mesh.abaqus_flat import read_flat
from femflex.mesh.upright import upright

STIFF = {"beam", "plate", "shell", "solid"}  # families that resist all that their nodes can do
RIGID = ("R3D", "RB3D", "R2D", "RB2D")


def read(path: Path, units: Units, overrides: Overrides) -> Deck:
    """The Deck of an Abaqus or CalculiX file. Raises DeckError with all its problems."""
    model = AbaqusModel(read_flat(path), units, overrides)
    flat, found = model.flat, model.found
    used = [element for element in flat.elements.values() if element.cell]  # fluid networks have nodes 0
    missing = {n for element in used for n in (*element.nodes, *element.extra)} - flat.nodes.keys()
    for element in used if missing else ():
        bad = sorted(missing & {*element.nodes, *element.extra})
        if bad:
            found.problem(
                f"{element.place}: element {flat.label(element.number)} uses node "
                f"{flat.label(bad[0], element.number)}, which no *NODE block defines; "
                f"{len(missing)} nodes are missing in all"
            )
            break
    if used and not any(k.name.endswith("SECTION") or k.name in ("MATERIAL", "RIGID BODY") for _, k in flat.keywords):
        found.problem_no_properties(path, "sections and materials")
    found.check(path)
    model.flat_rigid.update(e.number for e in flat.elements.values() if e.kind.startswith(RIGID))
    systems = read_orientations(model)
    surfaces = read_surfaces(model)
    read_ties(model, surfaces)
    transforms = read_transforms(model)
    reading = Reading(Materials(model), systems, _thickness(model))
    read_elements(model, reading)
    read_nonstructural_mass(model)
    read_connections(model, reading, surfaces, transforms)
    read_masses(model, reading)
    read_springs(model, reading)
    _lone_nodes(model)
    finish_masses(model)
    supports, default = read_supports(model, transforms)
    _sets(model)
    report_unused(model)
    known = reading.materials.all()
    no_density = found.note_no_mass(
        [*(m.density for m in known), *model.area_masses.values()], [m.name for m in known],
        known[0].keyword.place() if known else "", model.bare_sections,
    )  # fmt: skip
    for name in overrides:
        if name not in model.taken:
            found.problem(f"override of {name!r}: the deck has no material and no section of that name")
    if not model.build.cells and not model.moving and not found.problems:
        kinds = elements_by_kind(model, list(flat.elements.values()))
        for kind, (count, place) in kinds.items():
            found.problem(f"{count} elements of type {kind}: {unread(kind)}", place)
        if not kinds:
            found.problem(f"{path.name} has no elements; there is no structure to make")
    found.check(path)
    mesh = model.build.mesh()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        mesh = upright(mesh, path.name) if mesh.cells else mesh
    deck = Deck(
        path.name, "Abaqus", mesh, (*model.build.members(), *_node_members(model)), tuple(model.point_masses),
        tuple(model.connections), tuple(model.bushings), supports, default, dict(model.build.row_of), units,
        tuple(one.values.get("E", one.values.get("E1", 0.0)) for one in reading.materials.all()),
        tuple(one.density for one in reading.materials.all()), tuple(one.name for one in reading.materials.all()),
        dict(sorted(found.used.items())), found.left_out, found.notes, no_density,
        (*((one.name, "density") for one in known), *((name, "nonstructural_mass") for name in model.bare_sections)),
    )  # fmt: skip
    stiff = model.build.families() <= STIFF and not model.connections and not _node_members(model)
    return deck if stiff else deck.with_unresisted_held()  # which assembles the structure


def _thickness(model: AbaqusModel) -> dict[int, float]:
    """Thickness at nodes, in the deck's units (*NODAL THICKNESS)."""
    known: dict[int, float] = {}
    for scope, keyword in model.each("NODAL THICKNESS"):
        for k, row in enumerate(keyword.data):
            value = keyword.real(row[1] if len(row) > 1 else "", k, "a thickness")
            known |= dict.fromkeys(model.nodes_of(row[0], scope, keyword, k), value)
    return known


def _lone_nodes(model: AbaqusModel) -> None:
    """Give dofs to nodes that masses, springs and equations alone act on."""
    lone = sorted(model.wanted - model.moving)
    if not model.build.cells and model.connections:  # couplings that join masses and springs alone
        lone = sorted(model.wanted | model.moving)
        model.wanted_turning |= model.turning
    for turns in (False, True):
        own = [node for node in lone if (node in model.wanted_turning) == turns]
        if own:
            model.build.point_groups["lone_nodes" + ("_turning" if turns else "")] = [model.row(n) for n in own]
            model.turning.update(own if turns else [])
    model.moving.update(lone)


def _node_members(model: AbaqusModel) -> list[Member]:
    names = {"lone_nodes": False, "lone_nodes_turning": True}
    return [
        Member(name, "nodes", options={"rotations": turns})
        for name, turns in names.items()
        if name in model.build.point_groups
    ]


def _sets(model: AbaqusModel) -> None:
    """Groups of the deck's sets: those of elements that are cells, and of nodes that something moves."""
    build = model.build
    for name, numbers in model.flat.elsets.members().items():
        rows: dict[str, list[int]] = {}
        for number in numbers.among(build.cell_of):
            for cell, row in build.cell_of[number]:
                rows.setdefault(cell, []).append(row)
        if rows:
            build.cell_groups[name] = {cell: sorted(own) for cell, own in rows.items()}
    used = {node for node in model.flat.nodes if model.same(node) in build.row_of}
    for name, numbers in model.flat.nsets.members().items():
        points = sorted({build.row_of[model.same(node)] for node in numbers.among(used)})
        if points and name not in build.point_groups:
            build.point_groups[name] = np.array(points, np.int64).tolist()
