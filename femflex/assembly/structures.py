"""A flexible body of a case: mesh, structure and mode set."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import partial

from femflex.arrays import Array
from femflex.assembly.acting_loads import ActingLoads
from femflex.assembly.decks import deck_members, deck_of, left_out_text, refined_members, with_deck
from femflex.assembly.shared import shared_parts
from femflex.case.body import FlexibleTable, MemberTable
from femflex.case.case import Case
from femflex.case.mesh_groups import file_mesh, mesh_problems, with_regions
from femflex.decks.report import doubts, without_mass
from femflex.fem import (
    FAMILIES,
    Bushing,
    Member,
    ScalarSpring,
    Structure,
    build_structure,
)
from femflex.fem.connections.connection import Connection, Referenced
from femflex.fem.family import OPTIONS as FAMILY_OPTIONS
from femflex.fem.sections.laminates import Lamina
from femflex.fem.sections.materials import Material, Orthotropic
from femflex.fem.sections.named import member_material, member_section, solid_material
from femflex.mesh import Mesh
from femflex.noun.problems import CaseError, Problem, suggestion_text
from femflex.reduction import ModeSet, relaxed
from femflex.reduction.induced_strain import loads_of_induced_strain
from femflex.reduction.large_deflection.slow_loads import slow_loads
from femflex.reduction.methods import clamp_of
from femflex.reduction.preload.equilibrium import static_equilibrium
from femflex.reduction.preload.loads import NO_RATE, Preload
from femflex.reduction.strain.initial_stress import warn_of_initial_stress
from femflex.warning import warn_of_physics

PLACE = "marker {}"  # point group of a marker given by its position


def build_mesh(case: Case, name: str, table: FlexibleTable, refine: int = 0) -> Mesh:
    """The mesh of a body in metres, refined as often as the case requests and `refine` times more.

    Raises CaseError with every group named by the body that is not in the mesh.
    """
    deck = deck_of(case, name, table)
    table = with_deck(case, name, table)
    mesh = file_mesh(case.path.parent, table) if deck is None else with_regions(deck.mesh, table)
    if problems := list(mesh_problems(name, table, mesh)):
        raise CaseError(case.path.name, problems)
    positions = {marker: entry.position for marker, entry in table.markers.items() if entry.position is not None}
    if positions:
        mesh = mesh.with_groups(
            points={PLACE.format(marker): [mesh.nearest_point(position)] for marker, position in positions.items()}
        )
    times = table.refine + refine
    return mesh.refined(times) if times else mesh


def structure_of(case: Case, name: str, table: FlexibleTable, refine: int = 0) -> Structure:
    """The Structure of a body on its own mesh, refined `refine` times more.

    Within `shared_structures` it is assembled once and shared.
    """
    table = with_deck(case, name, table)
    shared = shared_parts()
    if shared is None:
        return build_structure_of(case, name, table, build_mesh(case, name, table, refine))
    keys = {"mesh", "deck", "units", "overrides", "mesh_unit", "groups", "refine", "members", "markers"}
    keys_of_structure = keys | {"connections", "regions", "point_masses", "bushings"}
    supports = getattr(table.reduction, "clamp", {})
    tables = case.materials, case.sections, table.model_dump(include=keys_of_structure)
    inputs = case.path, refine, default_options(table), supports, tables
    is_new = all(known != inputs for known, *_ in shared.structures)
    structure = shared.structure(
        inputs, lambda: build_structure_of(case, name, table, build_mesh(case, name, table, refine))
    )
    if not is_new and (problems := list(mesh_problems(name, table, structure.mesh))):
        raise CaseError(case.path.name, problems)
    return structure


def build_structure_of(case: Case, name: str, table: FlexibleTable, mesh: Mesh) -> Structure:
    """The Structure of a body's members and point masses on its mesh, its dofs laid along the axes of its clamps."""
    deck, table = deck_of(case, name, table), with_deck(case, name, table)
    supports = getattr(table.reduction, "clamp", {})
    members, masses = members_of(case, name, table), table.point_masses
    springs: list[Bushing | ScalarSpring] = [*table.bushings]
    if deck is None:
        return build_structure(mesh, members, masses, supports, connections_of(table), springs)
    connections = [*deck.connections, *connections_of(table)]
    masses, springs = [*deck.point_masses, *masses], [*deck.bushings, *springs]
    all_members = refined_members(mesh, deck_members(deck, members))
    structure = build_structure(mesh, all_members, masses, supports, connections, springs)
    if without_mass(deck, structure):
        raise CaseError(case.path.name, [Problem(f"bodies.{name}.deck", f"{deck.name}: {deck.no_density}")])
    for text in doubts(deck, structure):
        warn_of_physics(f"bodies.{name}.deck: {text}")
    notes = (*structure.notes, *left_out_text(deck))
    return replace(structure, notes=notes, unresisted=deck.autospc_dofs(structure), point_names=deck.point_names())


def members_of(case: Case, name: str, table: FlexibleTable) -> list[Member]:
    """The members of a body, with the default options of its strain (`default_options`)."""
    return [_member(case, name, member, default_options(table)) for member in table.members]


def default_options(table: FlexibleTable) -> dict[str, bool]:
    """The default options of a body's members.

    Members of a body in one piece with nonlinear strain get `bounded_energy`, for large deflections.
    """
    return {"bounded_energy": True} if table.strain == "nonlinear" and table.segmented_member is None else {}


def connections_of(table: FlexibleTable) -> list[Connection]:
    """The connections of a body. Reference nodes given by positions are already points of its mesh."""
    return [
        c.model_copy(update={"position": None, "reference": c.reference_group}) if isinstance(c, Referenced) else c
        for c in table.connections
    ]


def preload_of(case: Case, name: str, table: FlexibleTable) -> Preload | None:
    """The steady loads of a body's own equilibrium; None where it has none.

    Raises CaseError where the preload refers to an orbit and the case has none.
    """
    if table.preload is None:
        return None
    preload = table.preload.with_mean_motion(None if case.orbit.kind == "none" else case.orbit.mean_motion)
    if preload.orbit is not None and preload.orbit.rate is None:
        raise CaseError(case.path.name, [Problem(f"bodies.{name}.preload.orbit", NO_RATE)])
    return preload


def build_modes(
    structure: Structure,
    table: FlexibleTable,
    modes: int | None = None,
    name: str = "",
    acting: ActingLoads | None = None,
    preload: Preload | None = None,
) -> tuple[Structure, ModeSet]:
    """The structure a body's reduction works on and its mode set, of `modes` modes instead of the case's if given.

    acting: its loads; those of their static shapes that are slow compared with a cantilever set are added to the set.
    preload: steady loads of its own equilibrium.
    Initial stress that the clamps do not react is relaxed first (`relaxed`); with a name, warnings about it are issued
    for the body of that name.
    """
    r = table.reduction
    clamp = clamp_of(getattr(r, "clamp", {}))
    if preload is not None:
        at_rest = partial(static_equilibrium, structure, clamp, preload)
        structure = structure.recalled(("preloaded", repr(table.preload), str(clamp)), at_rest)
    as_built, structure = structure, relaxed(structure, clamp)
    if name:
        is_prestressed = any(member.options.get("prestress") for member in table.members)
        warn_of_initial_stress(f"bodies.{name}", as_built, structure, is_prestressed)

    def slow(shapes: ModeSet) -> Array:
        a = acting or ActingLoads()
        others = [loads_of_induced_strain(structure, group) for group in a.induced]
        return slow_loads(structure, shapes, a.base, a.loads, least=a.least, linear=a.least > 0.0, others=others)

    assert r is not None
    bends_far = needs_large_deflection_shapes(table)
    return r.shapes(structure, modes, slow if acting else None, f"bodies.{name}", bends_far)


def needs_large_deflection_shapes(table: FlexibleTable) -> bool:
    """Whether a body has a strain for large deflections, and a set with the derivatives that these need."""
    keep = getattr(table.reduction, "derivatives", "none")
    return table.strain in ("nonlinear", "condensed") and keep not in ("none", 0)


def _member(case: Case, name: str, table: MemberTable, defaults: Mapping[str, object]) -> Member:
    """The Member of a table; of the default options those are used that its family has."""
    where = f"bodies.{name}.members[{table.group}]"
    if table.family not in FAMILIES:
        text = f"found {table.family!r}, which is no family of members; {suggestion_text(table.family, FAMILIES)}"
        raise CaseError(case.path.name, [Problem(f"{where}.family", text)])
    material: Material | Lamina | Orthotropic | None = None
    section = None
    if table.family == "solid" and table.material is not None:
        try:
            material = solid_material(case.materials[table.material])
        except ValueError as error:
            raise CaseError(case.path.name, [Problem(f"materials.{table.material}", str(error))]) from None
    elif table.material is not None:
        material = member_material(case.materials[table.material])
    if table.section is not None and not isinstance(material, Orthotropic):
        try:
            coupled = table.family == "shell"
            section, material = member_section(case.sections[table.section], material, case.materials, coupled)
        except ValueError as error:
            raise CaseError(case.path.name, [Problem(f"sections.{table.section}", str(error))]) from None
    if isinstance(material, Lamina):
        raise CaseError(
            case.path.name,
            [
                Problem(
                    f"{where}.material",
                    "found an orthotropic material without a section; plates take one of kind 'plate'",
                )
            ],
        )
    options = {key: value for key, value in defaults.items() if key in FAMILY_OPTIONS[table.family]} | table.options
    return Member(table.group, table.family, section, material, options)
