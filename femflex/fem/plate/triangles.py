"""Plate members on any triangles: thin (DKT) or of any thickness (DKMT), with a quadratic in-plane field."""

from __future__ import annotations

from dataclasses import replace
from functools import cache, partial
from typing import TYPE_CHECKING

import numpy as np
from skfem.quadrature import get_quadrature
from skfem.refdom import RefTri

from femflex.arrays import Array, IntArray
from femflex.fem.assembly.numbering import Numbering
from femflex.fem.family import Contribution, StrainPlaces, family, member_cells
from femflex.fem.mesh_warnings import warn_of_curved_sides
from femflex.fem.option import Option, member_options
from femflex.fem.plate.blocks import LocalDofs, PlateInertia, mass_points
from femflex.fem.plate.dof_map import flat_map, member_section
from femflex.fem.plate.elastic import OPTIONS, initial_stress, ply_stiffness, section_stiffness
from femflex.fem.plate.frames import plane_frames, plane_normals, shared_axes
from femflex.fem.plate.skin import plate_skin
from femflex.fem.plate.strain import PlateStrain, ThinPlates
from femflex.fem.plate.triangle_fields import Triangles, inplane_gradients, inplane_shapes, triangles
from femflex.fem.sections.laminates import PlateSection
from femflex.fem.tables import rows_of_elements

if TYPE_CHECKING:
    from femflex.fem.structure import Member
    from femflex.mesh import Mesh


CELLS = ("triangle", "triangle6")
ELEMENT = {"element": Option("dkmt", "'dkmt' (any thickness) or 'dkt' (thin: no transverse shear)")}
LINEAR, SQUARES = 2, 5  # degrees of the linear strains squared, and of squares of the slopes times linear stress


@family("plate", {**ELEMENT, **OPTIONS}, dimension=2, edges="bent", half_waves={"triangle": 2.8})
def plate(mesh: Mesh, member: Member, numbering: Numbering) -> Contribution:
    """Flat plate elements on the triangles of the member's group, in any position in space.

    section   PlateSection, or a thickness [m] with a material
    material  Material, with a thickness only
    options   element         "dkmt" (any thickness, default) or "dkt" (thin: no transverse shear)
              axis            (3,) direction in the mesh's axes of the section's x axis, projected onto the plates
              prestress       (Nx, Ny, Nxy) initial membrane forces in the section's axes [N/m]
              thermal_strain  free strain, a number or (xx, yy, xy) in the section's axes

    DKMT is the default because it is correct for any thickness: it needs no choice, it includes the shear of sandwich
    cores, and on thin plates it equals DKT to rounding. Choose "dkt" to compare with thin-plate theory on meshes as
    fine as the thickness, where DKMT resolves the boundary layer of free edges and thin theory has none.

    Mesh: the relative error of a frequency is about 0.33 (side / half wavelength)^2 on squares cut in two, so that 26
    sides to the shortest half wave wanted give 5e-4; the first three frequencies of a square cantilever are within
    4e-4 with 16 sides. Rectangles need far fewer elements by the plate_bfs family.

    Sides are straight: second-order triangles are used by their corners, and their middle nodes carry no dofs; where
    they lie off the straight sides, a warning says how far. Raises ValueError on other cells, sections or options, and
    on triangles without area.
    """
    options = member_options(member)
    element = options["element"]
    if element not in ("dkt", "dkmt"):
        raise ValueError(f"plate on group {member.group!r} names element {element!r}; it can be 'dkmt' or 'dkt'")
    section = member_section(member)
    cells = member_cells(mesh, member, CELLS)
    corners = np.concatenate([nodes[:, :3] for nodes in cells.values()])
    where = f"plate on group {member.group!r}"
    warn_of_curved_sides(mesh.points, cells, where)
    normals = plane_normals(mesh.points[corners], where)
    corners = _counterclockwise(mesh.points, corners, normals)
    axes = shared_axes(plane_frames(normals))
    stiffness = section_stiffness(section, options["axis"], axes)
    x = mesh.points[corners]
    plane = np.matmul(x - x[:, :1], axes[:, :2].swapaxes(1, 2))
    shears = element == "dkmt"
    fields = triangles(plane, stiffness.D, stiffness.S if shears else None)
    elastic = stiffness.matrix(shears)
    stress = initial_stress(section, options, axes, elastic.shape[2])
    dof_map = flat_map(mesh, corners, axes, numbering)
    strain = triangle_strain(elastic, stress, fields, dof_map, LINEAR)
    if not shears:
        kappa = partial(fields.strains, np.eye(3), False)
        remedy = "choose element = 'dkmt'"
        thin = ThinPlates(where, corners, axes, fields.area, fields.dL, kappa, stiffness.S, remedy)
        strain = replace(strain, thin=thin)
    return Contribution(
        inertia=(triangle_inertia(x, axes, section, fields, dof_map),),
        strain=(strain,),
        skin=partial(plate_skin, mesh.points, corners, axes, section.thickness, dof_map),
        places=(
            StrainPlaces(
                "plate",
                np.matmul(area_points(LINEAR)[0], x),
                lever=section.thickness / 2,
                plies=ply_stiffness(section, options["axis"], axes),
                axes=axes,
            ),
        ),
    )


def triangle_inertia(
    x: Array, axes: Array, section: PlateSection, fields: Triangles, dof_map: LocalDofs
) -> PlateInertia:
    """Inertia of triangles with corners x (e, 3, 3) [m]: 12 points, exact for the cubic deflection."""
    L, weight = area_points(6)
    dm, rho, heights = mass_points(np.matmul(L, x), fields.area[:, None] * weight, axes, section)
    return PlateInertia(dm, rho, dof_map, axes, heights, inplane_shapes(L), partial(fields.deflection_and_rotation, L))


def triangle_strain(elastic: Array, stress: Array, fields: Triangles, dof_map: LocalDofs, degree: int) -> PlateStrain:
    """Return the strain of triangles by a quadrature exact to the degree: 3 points for their linear strains.

    elastic (1|e, 1, s, s) and stress (1|e, 1, s), units as in `StrainBlock`. Their in-plane field has linear gradients
    too, so stretch is sampled at the same points.
    """

    def exact(degree: int, elements: slice) -> PlateStrain:
        element_data = (
            rows_of_elements(elastic, elements),
            rows_of_elements(stress, elements),
            fields.of_elements(elements),
            dof_map.of_elements(elements),
        )
        return triangle_strain(*element_data, degree)

    L, weight = area_points(degree)
    return PlateStrain(
        weight=fields.area[:, None] * weight,
        elastic=elastic,
        map=dof_map,
        dP=inplane_gradients(L, fields.dL),
        slopes=partial(fields.slopes, L),
        bending=partial(fields.strains, L, elastic.shape[2] == 8),
        fine=partial(exact, SQUARES),
        tied=lambda elements: (exact(LINEAR, elements),),
        stress=stress,
    )


@cache
def area_points(degree: int) -> tuple[Array, Array]:
    """Area coordinates (q, 3) and weights (q,) [1], summing to 1, of a quadrature exact to the degree; read only."""
    points, weight = get_quadrature(RefTri, degree)
    L, share = np.stack([1 - points[0] - points[1], points[0], points[1]], axis=1), 2 * weight
    for array in (L, share):
        array.setflags(write=False)
    return L, share


def _counterclockwise(points: Array, corners: IntArray, normals: Array) -> IntArray:
    """Return the corners (e, 3) in counterclockwise order about the normals."""
    x = points[corners]
    sense = np.sum(np.cross(x[:, 1] - x[:, 0], x[:, 2] - x[:, 0]) * normals, axis=1)
    return np.where(sense[:, None] < 0, corners[:, ::-1], corners)
