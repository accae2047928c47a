"""A commented case to start from: a hub with a boom from beam theory, or with a body of a mesh or a deck."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from femflex.arrays import Array, IntArray
from femflex.assembly.extents import LARGE
from femflex.mesh import Mesh
from femflex.mesh.cells import CELL_TYPES, EDGES, FACES
from femflex.mesh.regions import with_whole_groups
from femflex.starting.deck_text import DeckFacts, deck_tables, suitable_scale

CLAMPS = ("root", "base", "clamp", "fixed", "fix", "hinge", "start", "left")  # parts of names of clamped groups
TIPS = ("tip", "end", "corner", "free", "right")
GENTLE = "0.4"  # N m; torque that bends a thin panel by some per cent of its length
ASKEW = 1e-3  # of a quadrilateral's size or angle, up to which it is a rectangle

HEAD = """\
#:schema {schema}
# A femflex case. Numbers are in SI, or text with a unit: "33 m", "30 deg", "5 N m".
#   femflex check {name}     report mistakes, and what femflex chooses by itself
#   femflex modes {name}     natural frequencies of the whole craft
#   femflex run {name}       simulate; result and pictures are named after the case
# Every key: the page "Case keys" of the documentation, or `femflex schema`.

title = {title}

[run]
duration = "{duration}"          # or orbits = 2, with an [orbit]
output_step = "{step}"     # time between rows of output

[attitude]
frame = "inertial"         # "orbital" with an [orbit]; its angles are then pitch, roll and yaw

# [orbit]
# kind = "specified"       # "free": the orbit is solved for
# perigee_altitude = "500 km"

[bodies.hub]
kind = "rigid"
mass = "{mass}"
inertia = ["{inertia}", "{inertia}", "{inertia}"]    # about the hub's origin
shapes = [{{ kind = "box", size = ["{size}", "{size}", "{size}"] }}]    # only for pictures

[bodies.hub.markers.side]  # a point where something is attached; its axes are those of the hub
position = ["{half}", 0, 0]
"""

METAL = """
[materials.metal]
E = "70 GPa"
nu = 0.33
density = "2700 kg/m^3"
"""

SCALE = {
    "duration": "60 s", "step": "0.05 s", "mass": "200 kg", "inertia": "80 kg m^2", "size": "1 m", "half": "0.5 m",
    "torque": "4", "middle": "5 s", "end": "10 s",
}  # fmt: skip

BEAM = """
[bodies.boom]              # a uniform beam along x, without a mesh
kind = "analytic"
length = "10 m"
mass = "4 kg"
EA = "1e7 N"
EIy = "5e3 N m^2"          # bending about y: motion along z
EIz = "5e3 N m^2"
GJ = "3e3 N m^2"
direction = [1, 0, 0]
functions = { y = 3, z = 3 }    # bending functions along y and z
damping = { ratio = 0.005 }     # of critical damping

[[joints]]                 # the boom is welded to the hub; "revolute" is a hinge
kind = "weld"
parent = "hub"
parent_marker = "side"
child = "boom"
child_marker = "root"
"""

TAIL = """
[[loads]]                  # a torque pulse on the hub, there and back
name = "slew"
body = "hub"
times = ["0 s", "{middle}", "{middle}", "{end}"]
torque = [{there}, {there}, {back}, {back}]    # N m, axes of the hub

[pictures]
times = ["{middle}"]
plots = ["bodies/hub/rate", "attitude/angles"]
# movie = true
# modes = [{body}]

# [study]                  # femflex converge: how many modes are enough
# quantity = {{ of = "peak", channel = "{channel}" }}

# [expect.turned]          # checked at the end of a run
# of = "mean"
# channel = "attitude/angles"
# component = "{axis}"
# start = "{end}"
# value = "1 rad"
# relative_tolerance = 1e-2
"""


DIMENSION = {"beam": 1, "plate": 2, "plate_bfs": 2, "shell": 2, "solid": 3}  # of the cells of families
SHEET = ', section = "sheet"'


def starting_case(
    name: str,
    mesh: Mesh | None = None,
    mesh_file: str = "",
    schema: str = "case.schema.json",
    deck: DeckFacts | None = None,
    choice: MeshChoice | None = None,
) -> tuple[str, list[str]]:
    """Text of a case called `name`, and notes on what the user should check first.

    mesh, mesh_file  a mesh for the flexible body, and its path from the case; choice: what is made of it, default the
                     first of `mesh_choices`
    schema           path or address of the JSON Schema, for editors
    deck             facts of a deck for the flexible body, in place of a mesh
    Raises ValueError for a mesh of points alone.
    """
    title = name.removesuffix(".toml").replace("_", " ").capitalize()
    scale = SCALE if deck is None else suitable_scale(deck)
    head = HEAD.format(name=name, title=json.dumps(title), schema=schema, **scale)
    if deck is not None:
        end = "tip" if deck.tip != deck.root else "root"
        tail = _load_and_picture_tables("flexible", end, 2, scale)
        return head + deck_tables(deck) + tail, list(deck.notes)
    head += METAL
    if mesh is None:
        return head + BEAM + _load_and_picture_tables("boom", "tip", 2, scale), []
    choice = choice or mesh_choices(mesh)[0]
    member_mesh = with_whole_groups(mesh, choice.members)
    text, marker = _mesh_body_tables(member_mesh, mesh_file, choice)
    notes = list(choice.notes)
    size = float(np.ptp(mesh.points, axis=0).max())
    if size > LARGE:
        notes.append(f"mesh_unit: the mesh spans {size:.4g}, read as millimetres")
    axis = _bending_axis(mesh)
    if axis is None:
        return head + text + _load_and_picture_tables("flexible", marker, 2, scale), notes
    return head + text + _load_and_picture_tables("flexible", marker, axis, scale | {"torque": GENTLE}), notes


def _load_and_picture_tables(body: str, marker: str, axis: int, scale: Mapping[str, str]) -> str:
    """Load, pictures, study and expectation: a torque about an axis of the hub, 0 to 2."""
    there, back = (
        f"[{', '.join(sign + scale['torque'] if k == axis else '0' for k in range(3))}]" for sign in ("", "-")
    )
    channel = f"markers/{body}.{marker}/deflection"
    return TAIL.format(body=f'"{body}"', channel=channel, there=there, back=back, axis="xyz"[axis], **scale)


def _bending_axis(mesh: Mesh) -> int | None:
    """The axis about which a torque on the hub bends a flat mesh: across its length, in its plane."""
    extent = np.ptp(mesh.points, axis=0)
    thin, across, along = np.argsort(extent, kind="stable")
    flat = extent[thin] < 0.1 * extent[across] and extent[across] > 1e-6 * extent[along]
    return int(across) if flat else None


@dataclass(frozen=True)
class MeshChoice:
    """Members, clamp and number of modes that a starting case chooses for a mesh.

    members  group -> families of its members
    clamp    group that is clamped, "" where the body is free
    tip      group of a marker, "" where there is none
    edges    groups of lines on the edges of the members, which may be stiffeners or borders
    modes    number of modes
    notes    sentences on what is to be looked at
    """

    members: Mapping[str, tuple[str, ...]]
    clamp: str = ""
    tip: str = ""
    edges: tuple[str, ...] = ()
    modes: int = 6
    notes: tuple[str, ...] = ()


def mesh_choices(mesh: Mesh) -> list[MeshChoice]:
    """The choices of a starting case for a mesh, the best first: with all members and a clamp, down to the cells of the
    highest dimension without one.

    Raises ValueError for a mesh of points alone.
    """
    if not mesh.dimension:
        raise ValueError("the mesh has no lines, surfaces or volumes; a body needs some")
    members, unused = _member_groups(mesh)
    free_groups = [group for group in mesh.groups if group not in members]
    clamp, tip = group_named_like(free_groups, CLAMPS) or "", group_named_like(free_groups, TIPS) or ""
    notes = [f"members: families, section and material of {', '.join(map(repr, members))} are guesses"]
    if unused:
        notes.append(f"members: {', '.join(map(repr, unused))} are not used; give members to those that carry load")
    edges = _edge_groups(mesh, members)
    if edges:
        notes.append(
            f"members: the lines of {', '.join(map(repr, edges))} lie on edges of the members and get no stiffness; "
            "where they are stiffeners, use the commented-out members"
        )
    free = "; these have groups: " + ", ".join(map(repr, free_groups)) if free_groups else ""
    unheld = f"reduction: no group of the mesh looks like a root; its modes are free-free{free}"
    top = {
        group: top_families
        for group, families in members.items()
        if (top_families := tuple(family for family in families if DIMENSION[family] == mesh.dimension))
    }
    choices = []
    for used in (members, top) if top != members else (members,):
        member_mesh = with_whole_groups(mesh, used)
        points = np.unique(np.concatenate([member_mesh.group_points(group) for group in used]))
        end = tip if tip and np.isin(mesh.group_points(tip), points).all() else ""
        left_out = [group for group in members if group not in used]
        choice_notes = [*notes, *([f"members: without {', '.join(map(repr, left_out))}"] if left_out else [])]
        if clamp:
            choices.append(MeshChoice(used, clamp, end if end != clamp else "", edges, notes=tuple(choice_notes)))
        loose = f"reduction: clamping {clamp!r} leaves motions, or misses the members; its modes are free-free"
        choices.append(MeshChoice(used, "", end, edges, notes=(*choice_notes, loose if clamp else unheld)))
    return choices


def _edge_groups(mesh: Mesh, members: Mapping[str, tuple[str, ...]]) -> tuple[str, ...]:
    """Groups of lines alone, without members, that are not named like a clamp or a tip."""
    return tuple(
        group
        for group, cells in mesh.cell_groups.items()
        if group not in members
        and {CELL_TYPES[kind].dimension for kind, rows in cells.items() if len(rows)} - {0} == {1}
        and not group_named_like([group], CLAMPS + TIPS)
    )


def _mesh_body_tables(mesh: Mesh, mesh_file: str, choice: MeshChoice) -> tuple[str, str]:
    """Tables of a body made of a mesh, and the name of a marker at its tip."""
    size = float(np.ptp(mesh.points, axis=0).max())
    unit = '\nmesh_unit = "mm"' if size > LARGE else ""
    metres = size * (1e-3 if unit else 1.0)
    families = {family for group_families in choice.members.values() for family in group_families}
    thin, wide = ("2 mm", "30 mm") if 0.1 <= metres <= LARGE else (f"{metres / 1000:.1g} m", f"{metres / 100:.1g} m")
    wall = "1 mm" if wide == "30 mm" else f"{metres / 3000:.1g} m"
    sections = ""
    if "beam" in families or choice.edges:
        sections += f'\n[sections.tube]\nkind = "tube"\nouter_radius = "{wide}"\nthickness = "{wall}"\n'
    if families & {"plate", "plate_bfs", "shell"}:
        sections += f'\n[sections.sheet]\nkind = "plate"\nthickness = "{thin}"\n'
    section_keys = {"beam": ', section = "tube"', "solid": ""}
    members = "".join(
        f'    {{ group = {json.dumps(group)}, family = "{family}"{section_keys.get(family, SHEET)}, '
        f'material = "metal" }},\n'
        for group, group_families in choice.members.items()
        for family in group_families
    )
    shells = '; its sheets are then family = "shell"' if families & {"plate", "plate_bfs"} else ""
    members += "".join(
        f'    # {{ group = {json.dumps(group)}, family = "beam", section = "tube", material = "metal" }},'
        f"    # a stiffener{shells}\n"
        for group in choice.edges
    )
    clamp = json.dumps(choice.clamp)
    reduction = f'method = "cantilever", clamp = {clamp}' if choice.clamp else 'method = "free_free"'
    end, markers = choice.clamp or "root", ""
    if not choice.clamp:
        points = mesh.points[np.unique(np.concatenate([mesh.group_points(group) for group in choice.members]))]
        middle = points[np.argmin(np.linalg.norm(points - points.mean(axis=0), axis=1))] * (1e-3 if unit else 1.0)
        position = ", ".join(f"{float(x):.9g}" for x in middle)
        markers += f"\n[bodies.flexible.markers.root]\nposition = [{position}]    # the node next to its middle\n"
    if choice.tip:
        markers, end = f"{markers}\n[bodies.flexible.markers.tip]\ngroup = {json.dumps(choice.tip)}\n", "tip"
    return (
        f"{sections}\n"
        f"[bodies.flexible]          # groups of the mesh: {', '.join(map(repr, mesh.groups)) or 'none'}\n"
        f'kind = "flexible"\nmesh = {json.dumps(mesh_file)}{unit}\nmembers = [\n{members}]\n'
        f"reduction = {{ {reduction}, modes = {choice.modes} }}\n"
        f"damping = {{ ratio = 0.005 }}     # of critical damping\n{markers}\n"
        f"[[joints]]                 # welded to the hub {'where it is clamped' if choice.clamp else 'at its middle'}\n"
        'kind = "weld"\nparent = "hub"\nparent_marker = "side"\nchild = "flexible"\n'
        f"child_marker = {json.dumps(choice.clamp or 'root')}\n",
        end,
    )


def _member_groups(mesh: Mesh) -> tuple[dict[str, tuple[str, ...]], list[str]]:
    """Families of the members of groups, and groups of cells beyond the members that get none.

    Groups of the highest dimension that share no cell, the largest first, then the groups of lower dimension whose
    cells are no edges or faces of theirs. A group of several dimensions has members of each of which it has more than
    the border of its surfaces or solids.
    """
    cells = {group: selected for group, selected in mesh.cell_groups.items() if selected}
    dimensions = {group: {CELL_TYPES[kind].dimension for kind in selected} - {0} for group, selected in cells.items()}
    if not any(mesh.dimension in selected for selected in dimensions.values()):
        cells, dimensions = {"all": with_whole_groups(mesh, ["all"]).cell_groups["all"]}, {"all": {mesh.dimension}}
    families: dict[str, list[int]] = {}
    unused: list[str] = []
    used_rows: dict[str, set[int]] = {}
    for dimension in range(mesh.dimension, 0, -1):
        lower = dimension < mesh.dimension and any(dimension in selected for selected in dimensions.values())
        sides = _count_sides(mesh, dimension) if lower else Counter()
        for group in sorted(cells, key=lambda name: -sum(map(len, cells[name].values()))):
            selected = {k: set(map(int, r)) for k, r in cells[group].items() if CELL_TYPES[k].dimension == dimension}
            if not selected or any(rows & used_rows.get(kind, set()) for kind, rows in selected.items()):
                continue
            if lower:
                corners = (
                    mesh.cells[kind][list(rows), : CELL_TYPES[kind].n_corners] for kind, rows in selected.items()
                )
                counts = {sides[frozenset(side)] for rows in corners for side in rows.tolist()}
                if not (0 in counts or (group in families and max(counts) > 1)):  # inner edges stiffen their own group
                    continue
            families.setdefault(group, []).append(dimension)
            for kind, rows in selected.items():
                used_rows.setdefault(kind, set()).update(rows)
    used = np.unique(np.concatenate([mesh.cells[k][list(rows)].ravel() for k, rows in used_rows.items()]))
    for group, group_dimensions in dimensions.items():
        if group_dimensions and group not in families and not np.isin(mesh.group_points(group), used).all():
            unused.append(group)
    several = len({dimension for selected in families.values() for dimension in selected}) > 1
    return {
        group: tuple(_family(mesh, cells[group], dimension, several) for dimension in selected)
        for group, selected in families.items()
    }, unused


def _count_sides(mesh: Mesh, dimension: int) -> Counter[frozenset[int]]:
    """Corners of the edges (dimension 1) or faces (2) of cells of higher dimension -> how many of these have it."""
    counts: Counter[frozenset[int]] = Counter()
    for kind, nodes in mesh.cells.items():
        cell = CELL_TYPES[kind]
        if cell.dimension > dimension:
            for side in EDGES[cell.shape] if dimension == 1 else FACES[cell.shape]:
                counts.update(map(frozenset, nodes[:, list(side)].tolist()))
    return counts


def _family(mesh: Mesh, cells: Mapping[str, IntArray], dimension: int, several: bool) -> str:
    """The family of members for cells; surfaces that are not of one plane, quadrilaterals that are no rectangles, and
    surfaces beside other members, are shells."""
    if dimension != 2:
        return {1: "beam", 3: "solid"}[dimension]
    surface_cells = {kind: mesh.cells[kind][rows] for kind, rows in cells.items() if CELL_TYPES[kind].dimension == 2}
    points = mesh.points[np.unique(np.concatenate([rows.ravel() for rows in surface_cells.values()]))]
    extent = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)
    if several or extent[2] > ASKEW * extent[0]:
        return "shell"
    if all(kind.startswith("triangle") for kind in surface_cells):
        return "plate"
    rectangles = all(
        kind.startswith("quad") and _rectangles(mesh.points[rows[:, :4]]) for kind, rows in surface_cells.items()
    )
    return "plate_bfs" if rectangles else "shell"


def _rectangles(corners: Array) -> bool:
    """Whether quadrilaterals (k, 4, 3) are rectangles of one plane."""
    a, b = corners[:, 1] - corners[:, 0], corners[:, 3] - corners[:, 0]
    size = np.sqrt(np.linalg.norm(a, axis=1) * np.linalg.norm(b, axis=1))
    closed = np.linalg.norm(corners[:, 2] - corners[:, 0] - a - b, axis=1)
    normal = np.cross(a, b)
    flat = np.linalg.norm(np.cross(normal, normal[0]), axis=1) / (size**2 * size[0] ** 2)
    askew = np.abs(np.einsum("ki,ki->k", a, b)) / size**2
    return bool(max((closed / size).max(), flat.max(), askew.max()) < ASKEW)


def group_named_like(groups: list[str], parts: tuple[str, ...]) -> str | None:
    """The shortest group name that contains one of these parts, in the order of the parts."""
    matches = ([group for group in groups if part in group.lower()] for part in parts)
    return next((min(groups_with_part, key=len) for groups_with_part in matches if groups_with_part), None)
