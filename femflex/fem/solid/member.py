"""Solid members: isoparametric tetrahedra, pyramids, wedges and hexahedra on the translations of their nodes.

Those of second order bend without locking, hexahedra of eight nodes by incompatible modes. Other cells of first order
lock: they are raised to second order before dofs are numbered (`raise_solids`), or used with a warning.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from femflex.arrays import Array, IntArray
from femflex.fem.assembly.numbering import Numbering
from femflex.fem.family import (
    Contribution,
    Option,
    Options,
    SkinPart,
    StrainPlaces,
    family,
    member_cells,
    member_options,
)
from femflex.fem.mesh_warnings import (
    MISPLACED_NODE,
    warn_of_curved,
    warn_of_first_order,
    warn_of_incompressible,
    warn_of_tapered,
)
from femflex.fem.sections.materials import Anisotropic, Material, Orthotropic, elasticity, material_axes
from femflex.fem.solid.blocks import (
    CELLS,
    REDUCED,
    Dilatation,
    Enhanced,
    SolidInertia,
    SolidStrain,
    cell_rule,
    enhanced_strains,
    strain_maps,
)
from femflex.mesh.cells import CELL_TYPES, FACES
from femflex.mesh.quality import quadrature
from femflex.mesh.second_order import SECOND_ORDER, raise_order

if TYPE_CHECKING:
    from femflex.fem.structure import Member
    from femflex.mesh import Mesh

# A cantilever block of 2541 nodes takes 2.4 s and 0.3 GB for six modes with order = 1, 40 s and 0.8 GB with order = 2;
# their frequencies differ by 0.1 to 0.5 %, those of a plate of one layer of 40 x 20 bricks by as much.
LARGE = 4000  # nodes of hexahedra up to which they are raised to second order by default
MAINLY = 0.9  # share above which a mesh counts as one of hexahedra, to whose edges raised neighbours are tied
FIRST_ORDER = tuple(name for name in CELLS if CELL_TYPES[name].order == 1)
OPTIONS: Options = {
    "order": Option(
        None,
        "2: cells of first order get nodes in the middle of their edges; 1: they are used as they are, hexahedra with "
        "incompatible modes, others lock. Left out: 2, but 1 for hexahedra of more than 4000 nodes",
    ),
    "integration": Option(
        "full",
        "full: 27 points of strain in hexahedra; reduced: eight in those of 20 nodes, which do not lock in thin "
        "shells, and need neighbours in two directions",
    ),
    "axes": Option(None, "directions of the material's axes 1 and 2, six numbers; mesh axes when left out", "", (6,)),
    "prestress": Option(None, "initial stress xx, yy, zz, yz, xz, xy, mesh axes", "Pa", (6,)),
    "thermal_strain": Option(None, "free strain in all directions", ""),
}


def raise_solids(mesh: Mesh, members: Sequence[Member]) -> tuple[Mesh, tuple[str, ...]]:
    """Return the mesh with the first-order cells of these solid members raised to second order, and notes about it.

    Their boundary cells are raised too, except those of members of other families.
    """
    rows: dict[str, list[IntArray]] = {}
    keep_hexahedra, notes = _first_order_hexahedra(mesh, members)
    for member in members:
        if member.family == "solid" and _order(member) != 1:
            for kind, numbers in mesh.cell_groups.get(member.group, {}).items():
                unchanged = kind == "hexahedron" and keep_hexahedra and _order(member) is None
                if kind in FIRST_ORDER and len(numbers) and not unchanged:
                    rows.setdefault(kind, []).append(numbers)
    if not rows:
        return mesh, notes
    cells_to_keep: dict[str, IntArray] = {}
    for member in members:
        if member.family != "solid":
            for kind, numbers in mesh.cell_groups.get(member.group, {}).items():
                cells_to_keep[kind] = np.union1d(cells_to_keep.get(kind, numbers), numbers)
    raised = {kind: np.unique(np.concatenate(numbers)) for kind, numbers in rows.items()}
    new_mesh = raise_order(mesh, raised, cells_to_keep)
    count = ", ".join(f"{len(numbers)} {kind} to {SECOND_ORDER[kind]}" for kind, numbers in sorted(raised.items()))
    n_new = len(new_mesh.points) - len(mesh.points)
    text = (
        f"solid cells of first order are raised to second order ({count}; {n_new} nodes are new); order = 1 keeps them"
    )
    return new_mesh, (*notes, text)


def _first_order_hexahedra(mesh: Mesh, members: Sequence[Member]) -> tuple[bool, tuple[str, ...]]:
    """Return whether hexahedra of members without the option order stay first order, and a note about it."""
    count, cells = 0, [np.zeros((0, 8), np.int64)]
    for member in members:
        if member.family == "solid" and _order(member) is None:
            for kind, numbers in mesh.cell_groups.get(member.group, {}).items():
                count += len(numbers) if kind in FIRST_ORDER else 0
                cells += [mesh.cells[kind][numbers]] if kind == "hexahedron" else []
    bricks = np.concatenate(cells)
    n = len(np.unique(bricks))
    if n <= LARGE or len(bricks) < MAINLY * count:
        return False, ()
    text = (
        f"{len(bricks)} hexahedra of first order keep their eight nodes, with incompatible modes, since they have {n} "
        f"nodes (limit {LARGE}); order = 2 raises them to second order"
    )
    return True, (text,)


@family("solid", OPTIONS, raise_solids, dimension=3, edges="interpolated", half_waves={"hexahedron": 6.5})
def solid(mesh: Mesh, member: Member, numbering: Numbering) -> Contribution:
    """Solid elements on the cells of the member's group: tetrahedra, pyramids, wedges and hexahedra, also mixed.

    section   none
    material  Material, Orthotropic or Anisotropic

    Mesh: cells of second order with one layer through the thickness bend without locking; see the table of MacNeal
    and Harder's problems in docs/howto/elements.md. Raises ValueError without a material, with a section, or when an
    element is turned inside out.
    """
    options, where = member_options(member), f"solid on group {member.group!r}"
    material = member.material
    if not isinstance(material, Material | Orthotropic | Anisotropic):
        raise ValueError(f"{where} has {'no material' if material is None else repr(material)}; give one for solids")
    if member.section is not None:
        raise ValueError(f"{where} has a section; a solid has none, its mesh is the shape")
    _order(member)
    reduced = _reduced(member)
    axes = None if options["axes"] is None else material_axes(options["axes"], where)
    C = elasticity(material, axes)
    stress = _initial_stress(options, C)[None, None]
    linear, quadratic = strain_maps()
    cells = member_cells(mesh, member, CELLS)
    inertia, strain, places = [], [], []
    for name, nodes in cells.items():
        x = mesh.points[nodes]
        if name == "hexahedron":
            warn_of_tapered(x, member.group)
        elif CELL_TYPES[name].order == 1:
            warn_of_first_order(name, x, material, member.group)
        elif not (reduced and name in REDUCED):
            warn_of_curved(name, x, member.group)
        warn_of_incompressible(name, nodes, C, isinstance(material, Material), member.group)
        _check_order(name, x, member.group)
        dofs = numbering.translation(nodes.ravel()).reshape(len(nodes), -1)
        rule = cell_rule(name, 0, reduced)
        G, volume = gradients_at(name, x, rule, member.group)
        positions = np.matmul(CELL_TYPES[name].interpolation(rule[0]), x)
        N, dV, rho = _mass_points(name, x, member.group)
        inertia.append(SolidInertia(dofs, dV * material.density, rho, N))
        block = SolidStrain(dofs, volume, C[None, None], linear, quadratic, G, stress)
        if name == "hexahedron":
            block = with_incompatible_modes(block, x, rule[0])
        elif not (reduced and name in REDUCED):
            block = with_reduced_volume_points(name, block, rule[0], material)
        strain.append(block)
        places.append(StrainPlaces("solid", positions))
    return Contribution(
        tuple(inertia), tuple(strain), partial(solid_skin, mesh.points, cells, numbering), tuple(places)
    )


def _order(member: Member) -> int | None:
    order = member.options.get("order")
    if order not in (None, 1, 2):
        raise ValueError(
            f"solid on group {member.group!r} has order {order!r}; give 2 (cells of first order are raised) or 1"
        )
    return order


def _reduced(member: Member) -> bool:
    integration = member.options.get("integration", "full")
    if integration not in ("reduced", "full"):
        raise ValueError(
            f"solid on group {member.group!r} has integration {integration!r}; give 'reduced' (hexahedra of 20 nodes "
            "have eight points of strain) or 'full'"
        )
    return bool(integration == "reduced")


def _initial_stress(options: dict[str, Any], elastic: Array) -> Array:
    """Initial stress (6,): the prestress minus that which the thermal strain would need."""
    stress = np.zeros(6) if options["prestress"] is None else np.asarray(options["prestress"], float)
    strain = 0.0 if options["thermal_strain"] is None else float(options["thermal_strain"])
    if stress.shape != (6,) or not np.isfinite(stress).all() or not np.isfinite(strain):
        raise ValueError(
            f"prestress of a solid is {options['prestress']!r} and thermal_strain {options['thermal_strain']!r}; give "
            "six finite stresses xx, yy, zz, yz, xz, xy, and one number"
        )
    return stress - elastic[:, :3].sum(axis=1) * strain


def _mass_points(name: str, x: Array, group: str) -> tuple[Array, Array, Array]:
    """Shape functions (q, k), volumes (e, q) and positions (e, q, 3) of the points of mass of elements x (e, k, 3)."""
    points, weight = cell_rule(name, 1)
    N = CELL_TYPES[name].interpolation(points)
    _, volume = _inverse(_jacobians(name, x, points))
    return N, volume * weight, np.matmul(N, x)


def gradients_at(name: str, x: Array, rule: tuple[Array, Array], group: str) -> tuple[Array, Array]:
    """Gradients (e, q, 3, k) of shape functions of elements with nodes x (e, k, 3), and volumes (e, q), at a rule's
    points.

    Raises ValueError when an element is inside out, with its number and position.
    """
    points, weight = rule
    inverse, volume = _inverse(_jacobians(name, x, points))
    inside_out = np.flatnonzero((volume <= 0).any(axis=1))
    if len(inside_out):
        first = inside_out[0]
        centre = ", ".join(f"{c:.6g}" for c in x[first].mean(axis=0))
        raise ValueError(
            f"solid on group {group!r}: {len(inside_out)} of {len(x)} {name} elements are turned inside out or "
            f"folded (element {first} at ({centre}) m has a Jacobian determinant of {volume[first].min():.3g} m^3); "
            "repair the mesh"
        )
    dN = CELL_TYPES[name].gradients(points)  # (q, k, 3)
    return np.matmul(inverse, dN.swapaxes(1, 2)), volume * weight


def _jacobians(name: str, x: Array, points: Array) -> Array:
    """Jacobians (e, q, 3, 3) at points (q, 3); row: axis of the unit cell, column: x, y, z."""
    dN = CELL_TYPES[name].gradients(points)
    q, k, _ = dN.shape
    centred = x - x[:, :1]  # far from the origin, rounding errors of coordinates would be larger
    return np.matmul(dN.swapaxes(1, 2).reshape(3 * q, k), centred).reshape(-1, q, 3, 3)


def _check_order(name: str, x: Array, group: str) -> None:
    """Raise ValueError when middle nodes of cells (e, k, 3) do not lie near the mean of their corners, as their order
    requires."""
    cell = CELL_TYPES[name]
    for node, parents in enumerate(cell.parents, cell.n_corners):
        mean = x[:, parents].mean(axis=1)
        radius = np.linalg.norm(x[:, parents] - mean[:, None], axis=2).min(axis=1)
        misplaced = np.flatnonzero(np.linalg.norm(x[:, node] - mean, axis=1) > MISPLACED_NODE * radius)
        if len(misplaced):
            raise ValueError(
                f"solid on group {group!r}: node {node} of {len(misplaced)} of {len(x)} {name} elements (first element "
                f"{misplaced[0]}) lies far from the middle of its corners; the nodes must be in VTK's order"
            )


def _inverse(J: Array) -> tuple[Array, Array]:
    """Inverses (e, q, 3, 3) and determinants (e, q) of matrices, by cross products of their rows."""
    a, b, c = J[..., 0, :], J[..., 1, :], J[..., 2, :]
    columns = np.stack([np.cross(b, c), np.cross(c, a), np.cross(a, b)], axis=-1)
    determinant = np.sum(a * columns[..., 0], axis=-1)
    safe = np.where(determinant == 0, 1.0, determinant)
    return columns / safe[..., None, None], determinant


def with_incompatible_modes(strain: SolidStrain, x: Array, points: Array) -> SolidStrain:
    """The strain of bricks with nodes x (e, 8, 3) [m] at points (q, 3) of the unit cell, with `Enhanced` strains."""
    J0, centre = _jacobians("hexahedron", x, np.full((1, 3), 0.5))[:, 0], 2 * points - 1
    ratio = np.linalg.det(J0)[:, None] / np.linalg.det(_jacobians("hexahedron", x, points))
    slope = ratio[:, :, None, None] * (-2 * centre)[None, :, :, None] * np.linalg.inv(J0).swapaxes(1, 2)[:, None]
    B, G = enhanced_strains(slope), strain.rows(slice(None))
    stress = np.matmul(strain.elastic, B) * strain.weight[:, :, None, None]
    mode_stiffness = np.matmul(B.swapaxes(2, 3), stress).sum(axis=1)
    coupling = np.matmul(stress.swapaxes(2, 3), np.matmul(strain.linear_map, G)).sum(axis=1)
    linear, quadratic = np.zeros((6, 15)), np.zeros((6, 15, 15))
    linear[:, :9], linear[:, 9:] = strain.linear_map, np.eye(6)
    quadratic[:, :9, :9] = strain.quadratic_map
    enhanced = Enhanced(slope, -np.linalg.solve(mode_stiffness, coupling))
    return replace(strain, linear_map=linear, quadratic_map=quadratic, enhanced=enhanced)


def solid_skin(points: Array, cells: dict[str, IntArray], numbering: Numbering) -> SkinPart:
    """Outer faces of solids on points (n_p, 3) [m], moved by their nodes; second-order faces are cut at their middle
    nodes."""
    pieces = outer_pieces(cells)
    nodes, corners = np.unique(np.concatenate([part.ravel() for part in pieces.values()]), return_inverse=True)
    numbers = np.split(corners, np.cumsum([part.size for part in pieces.values()])[:-1])
    cols = numbering.translation_of(nodes)
    return SkinPart(
        points=points[nodes],
        cells={
            kind: numbers_of_kind.reshape(part.shape)
            for (kind, part), numbers_of_kind in zip(pieces.items(), numbers, strict=True)
        },
        rows=np.arange(3 * len(nodes)),
        cols=cols.ravel(),
        values=np.ones(3 * len(nodes)),
    )


def outer_pieces(cells: dict[str, IntArray]) -> dict[str, IntArray]:
    """Triangles (k, 3) and quads (k, 4), numbers of mesh nodes, that make up the faces which occur once,
    counterclockwise from outside."""
    keys, owner = [], []
    for name, nodes in cells.items():
        for number, face in enumerate(FACES[CELL_TYPES[name].shape]):
            sorted_nodes = np.sort(nodes[:, face], axis=1)
            keys.append(np.column_stack([sorted_nodes, np.full((len(sorted_nodes), 4 - len(face)), -1)]))
            owner.append((name, number, len(nodes)))
    _, which, count = np.unique(np.concatenate(keys), axis=0, return_inverse=True, return_counts=True)
    once = np.split(count[which.ravel()] == 1, np.cumsum([n for *_, n in owner])[:-1])
    pieces: dict[str, list[IntArray]] = {}
    for (name, number, _), outer in zip(owner, once, strict=True):
        for piece in _pieces(name, FACES[CELL_TYPES[name].shape][number]):
            kind = "quad" if len(piece) == 4 else "triangle"
            pieces.setdefault(kind, []).append(cells[name][outer][:, piece])
    return {kind: np.concatenate(parts) for kind, parts in pieces.items()}


def _pieces(name: str, face: list[int]) -> list[list[int]]:
    """A face as flat pieces of the element's own node numbers."""
    cell = CELL_TYPES[name]
    if cell.order == 1:
        return [list(face)]
    between = {tuple(parents): cell.n_corners + k for k, parents in enumerate(cell.parents)}
    n = len(face)
    middle = [between[tuple(sorted((face[i], face[(i + 1) % n])))] for i in range(n)]
    if (centre := between.get(tuple(sorted(face)))) is not None and n == 4:
        return [[face[i], middle[i], centre, middle[i - 1]] for i in range(n)]
    return [middle, *([face[i], middle[i], middle[i - 1]] for i in range(n))]


# Poisson's ratios; higher where the projection has few functions, which would make bending too soft
FULL = {
    "hexahedron": 0.35,
    "wedge": 0.45,
    "tetra": 0.45,
    "pyramid": 0.45,
}


def with_reduced_volume_points(
    name: str, strain: SolidStrain, points: Array, material: Material | Orthotropic | Anisotropic
) -> SolidStrain:
    """Return the strain of second-order elements at points (q, 3) of the unit cell, with separate points for the volume
    if the material is isotropic and its Poisson's ratio is above FULL."""
    full = FULL[CELL_TYPES[name].shape]
    if CELL_TYPES[name].order == 1 or not isinstance(material, Material) or material.nu <= full:
        return strain
    volume_points = _volume_points(name)
    spread, basis = _trilinear(volume_points, points), _basis(name, points)
    weighted = strain.weight[:, :, None] * basis
    moments = np.matmul(weighted.swapaxes(1, 2), basis)
    project = np.matmul(_basis(name, volume_points), np.linalg.solve(moments, weighted.swapaxes(1, 2)))  # (e, m, q)
    e, q, _, k = strain.G.shape
    G = np.matmul(project, strain.G.reshape(e, q, 3 * k)).reshape(e, -1, 3, k)
    mu = material.E / 2 / (1 + material.nu)
    bulk = 2 * mu * (material.nu / (1 - 2 * material.nu) - full / (1 - 2 * full))
    linear, quadratic = np.zeros((6, 10)), np.zeros((6, 10, 10))
    linear[:, :9], quadratic[:, :9, :9] = strain.linear_map, strain.quadratic_map
    linear[:3, 9] = 3 * bulk / strain.elastic[0, 0, :3, :3].sum()  # the stress is the sum of both parts'
    dilatation = Dilatation(G, strain.weight @ spread, spread, bulk)
    return replace(strain, linear_map=linear, quadratic_map=quadratic, dilatation=dilatation)


def _volume_points(name: str) -> Array:
    """Points (m, 3) of the unit cell for the volume."""
    if CELL_TYPES[name].shape == "hexahedron":
        return quadrature("hexahedron", 2)[0]
    z = quadrature("line", 2)[0] if CELL_TYPES[name].shape == "wedge" else np.array([[0.5]])
    return np.column_stack([np.full((len(z), 2), 1 / 3), z])


def _trilinear(nodes: Array, points: Array) -> Array:
    """Values (q, m) at points (q, 3) of the functions, linear in each axis, that are 1 at one of the nodes (m, 3)."""
    axes = np.flatnonzero(np.ptp(nodes, axis=0) > 0)
    powers = np.array(list(np.ndindex(*(2,) * len(axes))))
    node_values, values = (np.prod(positions[:, None, axes] ** powers, axis=2) for positions in (nodes, points))
    return np.asarray(values @ np.linalg.inv(node_values))


def _basis(name: str, points: Array) -> Array:
    """Functions (q, p) at points (q, 3) onto which gradients are projected."""
    volume_points = _volume_points(name)
    if name == "hexahedron20":
        return np.column_stack([np.ones(len(points)), points])
    return _trilinear(volume_points, points)
