"""The membrane family: sheets with in-plane stiffness and mass, without stiffness against bending."""

from __future__ import annotations

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
from femflex.fem.plate.frames import initial_stress, plane_frames, plane_normals, section_stiffness
from femflex.fem.plate.sides import member_section
from femflex.fem.plate.triangles import area_points, inplane_gradients, inplane_shapes
from femflex.fem.tables import DenseInertia
from femflex.fem.tension.strain import TensionStrain, interpolated_skin, least_squares
from femflex.mesh.cells import CELL_TYPES

if TYPE_CHECKING:
    from femflex.fem.structure import Member
    from femflex.mesh import Mesh


OPTIONS: Options = {
    "axis": Option((1.0, 0.0, 0.0), "direction of the section's x axis, projected onto the membrane", "", (3,)),
    "prestress": Option(
        0.0, "initial stress resultant, one for all directions or xx, yy, xy in the section's axes", "N/m", (0, 3)
    ),
    "thermal_strain": Option(None, "free strain, a number or xx, yy, xy in the section's axes", "", (0, 3)),
    "viscosity": Option(0.0, "internal damping time: stress A times viscosity times strain rate", "s"),
}
CELLS = ("triangle", "triangle6")
SIDES = ((0, 1), (1, 2), (2, 0))
DEGREE = 4  # of the squares of the displacements and of the strains squared, on straight sides
CURVED = 4  # additional degree for curved sides


@family("membrane", OPTIONS, dimension=2, edges="interpolated")
def membrane(mesh: Mesh, member: Member, numbering: Numbering) -> Contribution:
    """Inertia, strain and skin of membranes on the triangles of a group, in any position in space.

    Cells triangle (straight sides) or triangle6 (sides curved through their middle nodes, as on a circular rim).
    Displacements are quadratic in all three components. The strain is that of Green and Lagrange in the tangent plane,
    with all three components of u in its squares, so that large rotations are exact (THEORY section 3).

    Without tension a membrane has no stiffness across itself. Give it `prestress`, or find its tension by static
    equilibrium with its supports and edge cables (`femflex.reduction.static_equilibrium`): tethers on the edges of
    the same triangles share all displacements of the edges.

    section   PlateSection, or a thickness [m] with a material; its bending stiffness has no part
    Mesh: the relative error of a frequency is about (h / half wavelength)^4 / 7 on squares of side h cut in two.
    """
    options = member_options(member)
    where = f"membrane on group {member.group!r}"
    options = _checked_options(options, where)
    section = member_section(member)
    inertia, strain, places, skins = [], [], [], []
    for kind, nodes in member_cells(mesh, member, CELLS).items():
        x = mesh.points[nodes]
        plane_normals(x, where)  # raises ValueError for triangles without area
        dofs = _dofs(numbering, nodes, kind)
        curved = CURVED * _is_curved(x, kind)
        e, m = dofs.shape[:2]
        L, weight = area_points(DEGREE + curved)
        N = np.einsum("qm,ab->qamb", shapes(kind, L), np.eye(3)).reshape(1, len(L), 3, 3 * m)
        area = weight * _tangents(x, kind, L)[1] / 2
        inertia.append(DenseInertia(dofs.reshape(e, -1), area * section.mass, geometry(kind, L) @ x, N))
        block = _strain(x, dofs, kind, DEGREE + curved, section, options, member.group)
        strain.append(block)
        places.append(StrainPlaces("plate", block.places))
        skins.append((x, dofs, kind))
    return Contribution(tuple(inertia), tuple(strain), partial(_skin, skins), tuple(places))


def shapes(kind: str, L: Array) -> Array:
    """Shape functions (q, 6) [1] at area coordinates L (q, 3): of three corners and 4 L_i L_j of the sides (triangle),
    or of the six nodes (triangle6)."""
    if kind == "triangle6":
        return CELL_TYPES[kind].interpolation(L[:, 1:])
    return inplane_shapes(L)


def gradients(kind: str, L: Array) -> Array:
    """Their derivatives (q, 6, 2) [1] along the second and the third area coordinate."""
    if kind == "triangle6":
        return CELL_TYPES[kind].gradients(L[:, 1:])
    dL = np.array([[-1.0, -1.0], [1.0, 0.0], [0.0, 1.0]])
    return inplane_gradients(L, dL.T[None])[0].swapaxes(1, 2)


def geometry(kind: str, L: Array) -> Array:
    """Shape functions (q, 3|6) [1] of the geometry, by the positions of the nodes."""
    return L if kind == "triangle" else shapes(kind, L)


def _tangents(x: Array, kind: str, L: Array) -> tuple[Array, Array]:
    """Derivatives (e, q, 2, 3) of positions along two area coordinates, and the length (e, q) of their cross
    product."""
    rows = gradients(kind, L)[:, : x.shape[1]]
    t = np.einsum("qmk,emc->eqkc", rows, x)
    return t, np.linalg.norm(np.cross(t[:, :, 0], t[:, :, 1]), axis=2)


def _strain(
    x: Array, dofs: IntArray, kind: str, degree: int, section: Any, options: dict[str, Any], group: str
) -> TensionStrain:
    """Strains (xx, yy, gamma_xy) of gradients u_a,1 and u_a,2, a = 1, 2, 3, in axes 1, 2 of the tangent plane."""
    L, weight = area_points(degree)
    t, double_area = _tangents(x, kind, L)
    (e, q), m = double_area.shape, dofs.shape[1]
    normals = (np.cross(t[:, :, 0], t[:, :, 1]) / double_area[..., None]).reshape(-1, 3)
    axes = plane_frames(_without_rounding(normals))
    plane_tangents = np.einsum("eqkc,eqac->eqka", t, axes[:, :2].reshape(e, q, 2, 3))  # tangents in the axes 1, 2
    # d/d1, d/d2 of the shape functions
    slope = np.einsum("qmk,eqak->eqam", gradients(kind, L), np.linalg.inv(plane_tangents))
    frame = axes.reshape(e, q, 3, 3)
    G = np.einsum("eqam,eqbc->eqabmc", slope, frame).reshape(e, q, 6, 3 * m)
    A = section_stiffness(section, options["axis"], axes).A
    stress = initial_stress(section, options, axes, 3)[:, 0]
    linear, quadratic = np.zeros((3, 6)), np.zeros((3, 6, 6))
    linear[[0, 1, 2, 2], [0, 4, 3, 1]] = 1.0
    quadratic[0, range(3), range(3)] = quadratic[1, range(3, 6), range(3, 6)] = 1.0
    quadratic[2, range(3), range(3, 6)] = quadratic[2, range(3, 6), range(3)] = 1.0

    def by_point(table: Array) -> Array:
        return table.reshape(e, q, *table.shape[1:]) if len(table) > 1 else table[None]

    return TensionStrain(
        dofs=dofs.reshape(e, 3 * m),
        weight=weight * double_area / 2,
        elastic=by_point(A),
        linear_map=linear,
        quadratic_map=quadratic,
        G=G,
        stress=by_point(stress),
        group=group,
        family="membrane",
        places=geometry(kind, L) @ x,
        shape_functions=shapes(kind, L),
        smoothing=least_squares(L, weight),
        viscosity=options["viscosity"],
    )


def _without_rounding(normals: Array) -> Array:
    """Replace normals that differ by rounding only by one, so that the elements of a flat sheet share their axes."""
    return np.broadcast_to(normals[0], normals.shape) if np.abs(normals - normals[0]).max() < 1e-12 else normals


def _dofs(numbering: Numbering, nodes: IntArray, kind: str) -> IntArray:
    """Raw dofs (e, 6, 3) of the shape functions of triangles with nodes (e, 3|6)."""
    e = len(nodes)
    nodal = numbering.translation(nodes.ravel()).reshape(e, -1, 3)
    if kind == "triangle6":
        return nodal
    ends = np.stack([nodes[:, list(side)] for side in SIDES], axis=1).reshape(-1, 2)
    return np.concatenate([nodal, numbering.sides(ends).reshape(e, 3, 3)], axis=1)


def _is_curved(x: Array, kind: str) -> bool:
    """Whether the middle nodes of any side lie off the middle of its ends."""
    if kind == "triangle":
        return False
    off = np.stack([x[:, 3 + k] - (x[:, i] + x[:, j]) / 2 for k, (i, j) in enumerate(SIDES)])
    return bool(np.abs(off).max() > 1e-9 * np.abs(np.ptp(x, axis=1)).max())


def _skin(parts: list[tuple[Array, IntArray, str]]) -> SkinPart:
    """Draw every triangle as four, with the middles of its sides."""
    L = np.array([(1, 0, 0), (0, 1, 0), (0, 0, 1), (0.5, 0.5, 0), (0, 0.5, 0.5), (0.5, 0, 0.5)], float)
    four = np.array([(0, 3, 5), (3, 1, 4), (5, 4, 2), (3, 4, 5)])
    return interpolated_skin(
        "triangle", four, [(geometry(kind, L) @ x, dofs, shapes(kind, L)) for x, dofs, kind in parts]
    )


def _checked_options(options: dict[str, Any], where: str) -> dict[str, Any]:
    """Return the options, with prestress as three numbers; ValueError for values that the family cannot use."""
    prestress = np.asarray(options["prestress"], float)
    force = np.array([prestress, prestress, 0.0]) if prestress.ndim == 0 else prestress
    if force.shape != (3,) or not np.isfinite(force).all():
        raise ValueError(f"{where} has prestress {options['prestress']!r}; give one number or three (xx, yy, xy) [N/m]")
    lowest = (force[0] + force[1]) / 2 - np.hypot((force[0] - force[1]) / 2, force[2])
    if lowest < 0:
        raise ValueError(
            f"{where} has prestress {force.tolist()} N/m, of which the lowest principal value is {lowest:.4g} N/m; a "
            "membrane carries no compression, so give tension in all directions"
        )
    viscosity = options["viscosity"]
    if not (isinstance(viscosity, int | float | np.floating) and np.isfinite(viscosity) and viscosity >= 0):
        raise ValueError(f"{where} has viscosity {viscosity!r}; give one number of seconds, not negative")
    return {**options, "prestress": force}
