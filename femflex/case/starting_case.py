"""A commented case to start from: a hub with a boom from beam theory, or with a body of a mesh or a deck."""

from __future__ import annotations

import json
from collections.abc import Mapping
from contextlib import suppress

import numpy as np

from femflex.arrays import Array
from femflex.case.starting_deck import DeckFacts, deck_tables, scale_of
from femflex.mesh import Mesh
from femflex.mesh.cells import CELL_TYPES

CLAMPS = ("root", "base", "clamp", "fixed", "fix", "hinge", "start", "left")  # parts of names of clamped groups
TIPS = ("tip", "end", "corner", "free", "right")
GENTLE = "0.4"  # N m; torque that bends a thin panel by some per cent of its length
ASKEW = 1e-3  # of a quadrilateral's size or angle, up to which it is a rectangle
LARGE = 200.0  # extent beyond which the unit of a mesh is probably the millimetre

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


SECTIONS = {
    1: '\n[sections.own]\nkind = "tube"\nouter_radius = "30 mm"\nthickness = "1 mm"\n',
    2: '\n[sections.own]\nkind = "plate"\nthickness = "2 mm"\n',
    3: "",
}


def starting_case(
    name: str,
    mesh: Mesh | None = None,
    mesh_file: str = "",
    schema: str = "case.schema.json",
    deck: DeckFacts | None = None,
) -> tuple[str, list[str]]:
    """Text of a case called `name`, and what in it is to be looked at first.

    mesh, mesh_file  a mesh for the flexible body, and its path from the case
    schema           path or address of the JSON Schema, for editors
    deck             facts of a deck for the flexible body, in place of a mesh
    Raises ValueError for a mesh without groups of cells.
    """
    title = name.removesuffix(".toml").replace("_", " ").capitalize()
    scale = SCALE if deck is None else scale_of(deck)
    head = HEAD.format(name=name, title=json.dumps(title), schema=schema, **scale)
    if deck is not None:
        end = "tip" if deck.tip != deck.root else "root"
        tail = _tail("flexible", end, 2, scale)
        return head + deck_tables(deck) + tail, list(deck.notes)
    head += METAL
    if mesh is None:
        return head + BEAM + _tail("boom", "tip", 2, scale), []
    text, marker, notes = _meshed(mesh, mesh_file)
    axis = _bending_axis(mesh)
    if axis is None:
        return head + text + _tail("flexible", marker, 2, scale), notes
    return head + text + _tail("flexible", marker, axis, scale | {"torque": GENTLE}), notes


def _tail(body: str, marker: str, axis: int, scale: Mapping[str, str]) -> str:
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


def _meshed(mesh: Mesh, mesh_file: str) -> tuple[str, str, list[str]]:
    """Tables of a body made of a mesh, the name of a marker at its tip, and what is to be looked at."""
    groups, dimension = _member_groups(mesh, mesh_file)
    others = [group for group in mesh.groups if group not in groups]
    clamp, tip = named_like(others, CLAMPS), named_like(others, TIPS)
    notes = [f"members: families, section and material of {', '.join(map(repr, groups))} are guesses"]
    if left := _left_out(mesh, groups):
        notes.append(f"members: {', '.join(map(repr, left))} are not used; give members to those that carry load")
    if clamp is None:
        notes.append("clamp: no group of the mesh looks like a root; name the group that is attached to the hub")
    size = float(np.ptp(mesh.points, axis=0).max())
    unit = '\nmesh_unit = "mm"' if size > LARGE else ""
    if unit:
        notes.append(f"mesh_unit: the mesh spans {size:.4g}, read as millimetres")
    section = ', section = "own"' if SECTIONS[dimension] else ""
    members = "".join(
        f'    {{ group = {json.dumps(group)}, family = "{_family(mesh, group, dimension)}"{section}, '
        'material = "metal" },\n'
        for group in groups
    )
    held = json.dumps(clamp or (others[0] if others else "ROOT"))
    marked = tip is not None and json.dumps(tip) != held
    marker = f"\n[bodies.flexible.markers.tip]\ngroup = {json.dumps(tip)}\n" if marked else ""
    return (
        f"{SECTIONS[dimension]}\n"
        f"[bodies.flexible]          # groups of the mesh: {', '.join(map(repr, mesh.groups))}\n"
        f'kind = "flexible"\nmesh = {json.dumps(mesh_file)}{unit}\nmembers = [\n{members}]\n'
        f'reduction = {{ method = "cantilever", clamp = {held}, modes = 6 }}\n'
        f"damping = {{ ratio = 0.005 }}     # of critical damping\n{marker}\n"
        "[[joints]]                 # welded to the hub where it is clamped\n"
        'kind = "weld"\nparent = "hub"\nparent_marker = "side"\nchild = "flexible"\n'
        f"child_marker = {held}\n",
        "tip" if marked else json.loads(held),
        notes,
    )


def _member_groups(mesh: Mesh, mesh_file: str) -> tuple[list[str], int]:
    """Groups of cells of the highest dimension that share no cell, the largest first, and that dimension."""
    cells = {}
    for group in mesh.groups:
        with suppress(ValueError):  # a group of points
            cells[group] = mesh.group_cells(group)
    found = {group: max(CELL_TYPES[cell].dimension for cell in of) for group, of in cells.items()}
    dimension = max(found.values(), default=0)
    if dimension == 0:
        raise ValueError(f"{mesh_file} has no group of lines, surfaces or volumes; name its parts in the mesher")
    members: list[str] = []
    taken: set[tuple[int, ...]] = set()
    for group in sorted(found, key=lambda name: -sum(map(len, cells[name].values()))):
        own = {tuple(row) for rows in cells[group].values() for row in rows.tolist()}
        if found[group] == dimension and not own & taken:
            members.append(group)
            taken |= own
    return members, dimension


def _left_out(mesh: Mesh, members: list[str]) -> list[str]:
    """Groups of cells that lie beyond the members: no edges or faces of these."""
    used = np.unique(np.concatenate([mesh.group_points(group) for group in members]))
    cells = [group for group in mesh.groups if group not in members and _has_cells(mesh, group)]
    return [group for group in cells if not np.isin(mesh.group_points(group), used).all()]


def _has_cells(mesh: Mesh, group: str) -> bool:
    try:
        return any(CELL_TYPES[cell].dimension for cell in mesh.group_cells(group))
    except ValueError:  # a group of points
        return False


def _family(mesh: Mesh, group: str, dimension: int) -> str:
    """The family of members for a group of cells; quadrilaterals that are no rectangles of one plane are shells."""
    if dimension != 2:
        return {1: "beam", 3: "solid"}[dimension]
    cells = mesh.group_cells(group)
    if any("triangle" in cell for cell in cells):
        return "plate"
    return "plate_bfs" if all(_rectangles(mesh.points[corners[:, :4]]) for corners in cells.values()) else "shell"


def _rectangles(corners: Array) -> bool:
    """Whether quadrilaterals (k, 4, 3) are rectangles of one plane."""
    a, b = corners[:, 1] - corners[:, 0], corners[:, 3] - corners[:, 0]
    size = np.sqrt(np.linalg.norm(a, axis=1) * np.linalg.norm(b, axis=1))
    closed = np.linalg.norm(corners[:, 2] - corners[:, 0] - a - b, axis=1)
    normal = np.cross(a, b)
    flat = np.linalg.norm(np.cross(normal, normal[0]), axis=1) / (size**2 * size[0] ** 2)
    askew = np.abs(np.einsum("ki,ki->k", a, b)) / size**2
    return bool(max((closed / size).max(), flat.max(), askew.max()) < ASKEW)


def named_like(groups: list[str], parts: tuple[str, ...]) -> str | None:
    """The group whose name contains one of these parts and least beside it, in the order of the parts."""
    found = ([group for group in groups if part in group.lower()] for part in parts)
    return next((min(one, key=len) for one in found if one), None)
