"""Shell members: quadrilaterals of 4, 8 and 9 nodes and triangles of 3 and 6, warped, curved and folded."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
from skfem.quadrature import get_quadrature
from skfem.refdom import RefTri

from femflex.arrays import Array, BoolArray, IntArray
from femflex.fem.assembly.numbering import Numbering
from femflex.fem.family import Contribution, Option, Options, StrainPlaces, family, member_cells, member_options
from femflex.fem.mesh_warnings import (
    FOLDED_SHELL,
    WARPED_SHELL,
    element_text,
    warn_if_coarse,
    warn_of_constant_strain,
    warn_of_trapezoids,
)
from femflex.fem.plate.frames import OPTIONS as PLATE_OPTIONS
from femflex.fem.plate.frames import force_and_free_strain, plane_frames
from femflex.fem.plate.sides import member_section
from femflex.fem.sections.laminates import PlateSection
from femflex.fem.shell.blocks import ALL_ELEMENTS, ShellInertia, ShellStrain, strain_maps
from femflex.fem.shell.fields import ShellGeometry, areas, gradient_rows
from femflex.fem.shell.surface import directors, move_onto_surfaces, normals, normals_at_nodes, shell_skin
from femflex.fem.shell.variable import Patch, VariableSection, axes_at_nodes
from femflex.fem.tables import DenseStrain, StrainBlock, rows_of_elements
from femflex.mesh.cells import CELL_TYPES
from femflex.mesh.quality import quadrature
from femflex.mesh.second_order import raise_order
from femflex.warning import warn_of_physics

if TYPE_CHECKING:
    from femflex.fem.structure import Member
    from femflex.mesh import Mesh

CELLS = ("triangle", "triangle6", "quad", "quad9")
FLAT_AREA = 1e-10  # of the longest side squared: area below which an element has none
FOLD_ANGLE = 20.0  # [deg]
OPTIONS: Options = {
    **PLATE_OPTIONS,
    "surface": Option(
        None, "formula of x, y and z that is zero on the surface; its normals are used, and nodes are moved onto it"
    ),
    "axis": replace(PLATE_OPTIONS["axis"], field=True),
    "angle": Option(0.0, "angle from axis to the section's x axis, about the normal", "rad", field=True),
    "thickness": Option(None, "thickness in place of the section's; its plies stretch alike", "m", field=True),
    "density": Option(None, "mean density in place of the section's", "kg/m^3", field=True),
    "extra_mass": Option(0.0, "non-structural mass per area in addition to the section's", "kg/m^2", field=True),
    "offset": Option(0.0, "height of the section's middle above the nodes, along the elements' normals", "m"),
    "fold_angle": Option(
        float(np.radians(FOLD_ANGLE)), "angle between neighbouring elements above which their edge is a fold", "rad"
    ),
}
DRILLING = 0.1  # of the shear stiffness in the plane


def add_centre_nodes(mesh: Mesh, members: Sequence[Member]) -> tuple[Mesh, tuple[str, ...]]:
    """Return the mesh with a node in the centre of the eight-node quadrilaterals of shell members, and notes about
    it."""
    quads = [mesh.cell_groups.get(m.group, {}).get("quad8") for m in members if m.family == "shell"]
    rows = [part for part in quads if part is not None and len(part)]
    if not rows:
        return mesh, ()
    rows_of_quads = np.unique(np.concatenate(rows))
    text = f"{len(rows_of_quads)} eight-node quadrilaterals of shells get a node in their centre (nine nodes)"
    return raise_order(mesh, {"quad8": rows_of_quads}), (text,)


def prepare_shell_mesh(mesh: Mesh, members: Sequence[Member]) -> tuple[Mesh, tuple[str, ...]]:
    """Return the mesh with centre nodes (`add_centre_nodes`) and nodes on known surfaces (`move_onto_surfaces`)."""
    mesh, centre_notes = add_centre_nodes(mesh, members)
    mesh, moved_notes = move_onto_surfaces(mesh, members)
    return mesh, centre_notes + moved_notes


@family(
    "shell", OPTIONS, prepare_shell_mesh, dimension=2, edges="interpolated",
    half_waves={"quad": 7.0, "quad9": 2.2, "triangle": 16.0, "triangle6": 4.8},
)  # fmt: skip
def shell(mesh: Mesh, member: Member, numbering: Numbering) -> Contribution:
    """Shell elements of any thickness on the quadrilaterals and triangles of the member's group, also mixed.

    section   PlateSection, or a thickness [m] with a material
    material  Material, with a thickness only

    angle, thickness, density and extra_mass may be fields, axis three formulas (`femflex.fem.shell.variable`).

    Nodes have three translations and the rotations across their director; rotation about it too at folds, branches and
    where other members turn them. Curved edges of six-, eight- and nine-node elements are used; four-node elements may
    be warped. Eight-node elements get a node in their centre.

    Mesh: six-, eight- and nine-node elements come within 2 % of MacNeal and Harder's results on their finest standard
    meshes; four-node elements on most (docs/howto/elements.md). Three-node triangles have constant membrane strain: a
    few among quadrilaterals suffice, but for a mesh of them use the `plate` family.
    """
    options, where = member_options(member), f"shell on group {member.group!r}"
    plain = member_section(member, coupled=True)
    section = _shifted_section(plain, options["offset"], where)
    fields = (options[name] for name in ("thickness", "density", "extra_mass"))
    variable = VariableSection(plain, float(options["offset"]), *fields)
    cells = member_cells(mesh, member, CELLS)
    for name, nodes in cells.items():
        _check_shapes(name, mesh.points[nodes], where)
    warn_of_constant_strain(mesh.points, cells, where)
    angle = options["fold_angle"]
    if not isinstance(angle, int | float | np.floating) or not 0 < angle < np.pi / 2:
        raise ValueError(f"{where} has fold_angle {angle!r}; give an angle between 0 and pi/2 (90 deg)")
    surface_normals = None if options["surface"] is None else partial(normals, options["surface"], where=where)
    surface = directors(mesh.points, cells, float(angle), surface_normals)
    initial = force_and_free_strain(options, where)
    linear, quadratic = strain_maps()
    inertia, strain, places = [], [], []
    late: list[Callable[[], tuple[DenseStrain, ...]]] = []
    dofs_of = {}
    for name, nodes in cells.items():
        x, V = mesh.points[nodes], surface.V[name]
        patch = Patch(name, nodes, x, len(mesh.points), where)
        if name == "quad":
            warn_of_trapezoids(x, where)
        if name in ("quad", "quad9", "triangle6"):
            h = variable.heights(patch, np.full((1, 2), 0.5 if name != "triangle6" else 1 / 3))[:, 0]
            warn_if_coarse(x, V, np.broadcast_to(h, len(x)), where)
        geometry = ShellGeometry(name, x, V, axes_at_nodes(options["axis"], options["angle"], patch, V), plain.A)
        numbers = [numbering.translation(nodes.ravel()), numbering.rotation(nodes.ravel(), V.reshape(-1, 3))]
        dofs = np.concatenate([numbers_of_kind.reshape(len(nodes), -1) for numbers_of_kind in numbers], axis=1)
        dofs_of[name] = dofs

        def block(
            rule: tuple[Array, Array],
            elements: slice,
            geometry: ShellGeometry = geometry,
            dofs: IntArray = dofs,
            patch: Patch = patch,
        ) -> ShellStrain:
            part, elastic = geometry.of_elements(elements), rows_of_elements(variable.elastic(patch, rule[0]), elements)
            weight = areas(part, rule[0])[0] * rule[1]
            stress = initial_stress(elastic, *initial)
            return ShellStrain(dofs[elements], weight, elastic, linear, quadratic, gradient_rows(part, rule[0]), stress)

        def coarse(elements: slice, name: str = name, block: Callable[..., ShellStrain] = block) -> DenseStrain:
            return block(_stretch_rule(name), elements)

        strain_block = block(_strain_rule(name), ALL_ELEMENTS)
        strain.append(replace(strain_block, coarse=coarse) if CELL_TYPES[name].order == 2 else strain_block)
        inertia.append(_inertia(geometry, section, variable, patch, dofs))
        cell = CELL_TYPES[name]
        positions, coarse_positions = (
            np.matmul(cell.interpolation(rule[0]), x) for rule in (_strain_rule(name), _stretch_rule(name))
        )
        half = [variable.heights(patch, rule[0]) / 2 for rule in (_strain_rule(name), _stretch_rule(name))]
        levers: list[Any] = [float(h[0, 0]) if h.size == 1 else np.broadcast_to(h, (len(x), h.shape[1])) for h in half]
        second = cell.order == 2
        directions = V.reshape(len(x), -1, 3).mean(axis=1)
        plies = [variable.plies(patch, rule[0]) for rule in (_strain_rule(name), _stretch_rule(name))]
        sampled = (coarse_positions, levers[1], plies[1]) if second else (None, None, None)
        places.append(
            StrainPlaces(
                "plate",
                positions,
                sampled[0],
                levers[0],
                sampled[1],
                plies=plies[0],
                sampled_plies=sampled[2],
                axes=plane_frames(directions / np.linalg.norm(directions, axis=1)[:, None]),
            )
        )
        late.append(partial(_drilling, geometry, dofs, numbering, float(section.A[2, 2])))

    def drilled() -> tuple[StrainBlock, ...]:
        return tuple(drilling_block for make_blocks in late for drilling_block in make_blocks())

    return Contribution(
        tuple(inertia),
        tuple(strain),
        partial(shell_skin, mesh.points, cells, surface, section.thickness, dofs_of),
        tuple(places),
        late=drilled,
    )


def _shifted_section(section: PlateSection, offset: float, where: str) -> PlateSection:
    if isinstance(offset, bool) or not isinstance(offset, int | float | np.floating) or not np.isfinite(offset):
        raise ValueError(f"{where} has offset {offset!r}; give one length in metres")
    return section.shifted(float(offset)) if offset else section


def _strain_rule(name: str) -> tuple[Array, Array]:
    """Points (q, 2) and weights (q,) of the linear strains."""
    return _triangle(4 if name == "triangle6" else 2) if "triangle" in name else quadrature("quad", 2 + ("9" in name))


def _stretch_rule(name: str) -> tuple[Array, Array]:
    """Points (q, 2) and weights (q,) at which stretch is sampled."""
    return _triangle(2) if "triangle" in name else quadrature("quad", 2)


def _triangle(degree: int) -> tuple[Array, Array]:
    points, weight = get_quadrature(RefTri, degree)
    return points.T, weight


def _inertia(
    geometry: ShellGeometry, section: PlateSection, variable: VariableSection, patch: Patch, dofs: IntArray
) -> ShellInertia:
    """Mass on the surface, or two halves of it at +- the radius of gyration along the director.

    A section that varies has three layers at the same heights everywhere, whose masses have its first and second
    moment.
    """
    points, weight = _triangle(4) if "triangle" in geometry.cell else quadrature("quad", 3)
    N = CELL_TYPES[geometry.cell].interpolation(points)
    area = areas(geometry, points)[0] * weight
    if variable.varies:
        mass, first, second = variable.masses(patch, points)
        central_moments = (
            first - variable.offset * mass,
            second - 2 * variable.offset * first + variable.offset**2 * mass,
        )
        lever = np.sqrt(max(float((central_moments[1] / np.maximum(mass, 1e-300)).max()), 0.0)) or section.thickness
        outer_shares = [(central_moments[1] / lever**2 + sign * central_moments[0] / lever) / 2 for sign in (1.0, -1.0)]
        shares = [outer_shares[0], mass - outer_shares[0] - outer_shares[1], outer_shares[1]]
        heights = variable.offset + lever * np.array([1.0, 0.0, -1.0])
    else:
        radius = np.sqrt(section.rotary / section.mass) if section.mass > 0 else 0.0
        heights = section.centre + (np.array([radius, -radius]) if radius > 0 else np.zeros(1))
        shares = [np.full((1, 1), section.mass / len(heights))] * len(heights)
    middle = np.matmul(N, geometry.x)
    rho = np.concatenate([middle + z * np.matmul(N, geometry.V) for z in heights], axis=1)
    dm = np.concatenate([area * share for share in shares], axis=1)
    return ShellInertia(dofs, dm, rho, N, geometry.V, heights)


def _drilling(geometry: ShellGeometry, dofs: IntArray, numbering: Numbering, shear: float) -> tuple[DenseStrain, ...]:
    k = geometry.x.shape[1]
    return drilling(geometry, dofs, numbering.turns_about_all_axes(dofs[:, 3 * k :: 3]), shear)


def initial_stress(elastic: Array, force: Array, strain: Array) -> Array:
    """Initial stress resultants (e|1, q|1, 8) [N/m, N]: membrane forces (..., 3) [N/m] minus elastic (..., 8, 8) times
    the free strain (3,) [1] of the membrane."""
    stress = -(elastic[..., :3] @ strain)
    stress[..., 6:] = 0.0
    stress[..., :3] += force
    return np.asarray(stress)


def _check_shapes(name: str, x: Array, where: str) -> None:
    """Raise ValueError for elements (e, k, 3) without area and folded ones, and warn of warped ones; messages give
    their numbers and positions."""
    normals = normals_at_nodes(name, x)
    size = np.linalg.norm(normals, axis=2)
    longest = np.linalg.norm(x - x[:, :1], axis=2).max(axis=1)
    flat = size.min(axis=1) <= FLAT_AREA * longest**2
    if flat.any():
        raise ValueError(
            f"{where}: {int(flat.sum())} of {len(x)} {name} elements have a corner without area, the first is "
            f"{element_text(np.argmax(flat), x)}; repair the mesh"
        )
    if name != "quad":
        return
    unit = normals / size[..., None]
    cosine = np.einsum("eki,eli->ekl", unit, unit).min(axis=(1, 2))
    angle = np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0)))
    worst = int(np.argmax(angle))
    if angle[worst] > FOLDED_SHELL:
        raise ValueError(
            f"{where}: {int((angle > FOLDED_SHELL).sum())} of {len(x)} quadrilaterals are warped by over "
            f"{FOLDED_SHELL:g} deg, or their sides cross; the worst, by {angle[worst]:.3g} deg, is "
            f"{element_text(worst, x)}; correct the order of nodes, or cut them into triangles"
        )
    if angle[worst] > WARPED_SHELL:
        warn_of_physics(
            "{body_or_joint}: {warped} of {count} quadrilaterals are warped by more than {limit:g} deg between "
            "corner normals; the worst, by {value:.3g} deg, is {worst}. Their stiffness is some per cents off;",
            body_or_joint=where,
            value=angle[worst],
            limit=WARPED_SHELL,
            remedy="mesh finer there, or use eight-node elements",
            warped=int((angle > WARPED_SHELL).sum()),
            count=len(x),
            worst=element_text(worst, x),
        )


# Rotations about the normal of a shell, at nodes that have them: folds, branches, and nodes shared with beams.
#
# Shells resist no rotation of a node about their director. Where only smooth shells share a node, it has no such dof.
# At other nodes it follows the rotation of the surface in itself, omega = (t_2.u,1 - t_1.u,2) / 2, by the energy
#
#     DRILLING G h / 2 sum (theta.n - omega)^2 (area of the corner)
#
# which is zero where the two agree, as they do in the exact solution (T. J. R. Hughes and F. Brezzi, Comp. Meth. Appl.
# Mech. Engng 72 (1989) 105).


def drilling(geometry: ShellGeometry, dofs: IntArray, drilled: BoolArray, shear: float) -> tuple[DenseStrain, ...]:
    """Strain theta.n - omega at the nodes (e, k) that have a rotation about the director; none where none has.

    shear: stiffness G h [N/m]
    """
    elements = np.flatnonzero(drilled.any(axis=1))
    if not len(elements):
        return ()
    drilled_geometry = geometry.of_elements(elements)
    cell = CELL_TYPES[geometry.cell]
    k = len(cell.nodes)
    G, (_, normal) = gradient_rows(drilled_geometry, cell.nodes), areas(drilled_geometry, cell.nodes)
    rows = (G[:, :, 1] - G[:, :, 2])[:, :, None] / 2  # -omega
    for node in range(k):
        rows[:, node, 0, 3 * (k + node) : 3 * (k + node) + 3] += normal[:, node]
    points, weight = quadrature(cell.shape, cell.order + 1)
    total = areas(drilled_geometry, points)[0] @ weight
    share = np.where(drilled[elements], total[:, None] / k, 0.0)
    elastic = np.full((1, 1, 1, 1), DRILLING * shear)
    return (DenseStrain(dofs[elements], share, elastic, np.ones((1, 1)), np.zeros((1, 1, 1)), rows),)
