"""Plate members on rectangles: the thin element of Bogner, Fox and Schmit, frequencies to the fourth order."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING

import numpy as np
from numpy.polynomial.polynomial import polyder, polyval

from femflex.arrays import Array, IntArray
from femflex.fem.assembly.numbering import Numbering
from femflex.fem.family import Contribution, StrainPlaces, family, member_cells, member_options
from femflex.fem.mesh_warnings import warn_of_curved_sides
from femflex.fem.plate.blocks import LocalDofs, PlateInertia, mass_points
from femflex.fem.plate.frames import (
    OPTIONS,
    ROUNDING,
    initial_stress,
    orient_normals,
    plane_normals,
    ply_stiffness,
    section_stiffness,
    shared_axes,
)
from femflex.fem.plate.sides import flat_map, member_section, side_table
from femflex.fem.plate.skin import plate_skin
from femflex.fem.plate.strain import PlateStrain, ThinPlates
from femflex.fem.tables import rows_of_elements

if TYPE_CHECKING:
    from femflex.fem.structure import Member
    from femflex.mesh import Mesh

CELLS = ("quad", "quad8", "quad9")
SQUARENESS = 1e-6  # tolerances of the cosine of a corner, and of the misfit of the fourth corner over the size
# The element's x axis is the side nearer to this direction, to which the sides of usual meshes have unequal angles.
REFERENCE = np.array([0.8137, 0.4519, 0.3658])
REMEDY = "choose family 'plate' on triangles, whose element 'dkmt' has transverse shear"
_POINTS, _WEIGHTS = np.polynomial.legendre.leggauss(4)  # exact for the square of the bicubic deflection
_SQUARES = np.polynomial.legendre.leggauss(5)  # exact for squares of its slopes times stress, degree 8 along an axis
_SAMPLING = np.polynomial.legendre.leggauss(2)  # along an axis the in-plane field has linear gradients


@family("plate_bfs", OPTIONS, dimension=2, edges="bent", half_waves={"quad": 2.0})
def plate_bfs(mesh: Mesh, member: Member, numbering: Numbering) -> Contribution:
    """Thin flat plate elements on the rectangles of the member's group, in any position in space.

    section   PlateSection, or a thickness [m] with a material; its transverse shear stiffness is not used
    material  Material, with a thickness only

    Mesh: frequencies converge with the fourth power of the size; four sides to the shortest half wave give 2e-4 for
    smooth modes, the corners of a clamp converge more slowly (a square cantilever: 4e-4 with 8 sides). At a fold the
    planes share one twist, unless there are triangles on its other side.

    Second-order quadrilaterals are used by their corners. Raises ValueError on other cells, sections or options, and
    on quadrilaterals that are not rectangles (the plate family on triangles takes any shape).
    """
    options = member_options(member)
    section = member_section(member)
    cells = member_cells(mesh, member, CELLS)
    corners = np.concatenate([nodes[:, :4] for nodes in cells.values()])
    where = f"plate_bfs on group {member.group!r}"
    warn_of_curved_sides(mesh.points, cells, where)
    corners, axes, a, b = rectangles(mesh.points, corners, where)
    stiffness = section_stiffness(section, options["axis"], axes)
    normals = np.broadcast_to(axes[:, 2], (len(corners), 3))
    table = side_table(mesh, numbering)
    twists = table.twists(corners.ravel(), np.repeat(normals, 4, axis=0), numbering)
    table.tie_folds(twists.reshape(-1, 4), corners, numbering)
    plane = np.broadcast_to(axes[:, :2], (len(corners), 2, 3))
    table.attach_twists(twists.reshape(-1, 4), corners, plane, numbering)
    bubbles = numbering.extra(2 * len(corners)).reshape(-1, 2)
    numbering.attach(bubbles, corners, plane)
    element_dofs = np.concatenate([twists.reshape(-1, 4), bubbles], axis=1)
    dof_map = flat_map(mesh, corners, axes, numbering, element_dofs)
    xi, eta = (grid.ravel() for grid in np.meshgrid(_POINTS, _POINTS, indexing="ij"))
    area = (a * b)[:, None] * np.outer(_WEIGHTS, _WEIGHTS).ravel()
    inplane = inplane_shapes(xi, eta)
    middle = _rule_points(mesh.points[corners], _POINTS)
    dm, rho, heights = mass_points(middle, area, axes, section)
    rows_needed = slice(0, 1) if _equal_lengths(a) and _equal_lengths(b) else slice(None)
    rows = deflection_and_rotation(xi, eta, a[rows_needed], b[rows_needed])
    elastic = stiffness.matrix(shears=False)
    stress = initial_stress(section, options, axes, elastic.shape[2])
    kappa = partial(
        rows_of_elements,
        curvatures(XI, ETA, a[rows_needed], b[rows_needed]),
    )
    dN = np.stack([XI / a[:, None], ETA / b[:, None]], axis=1) / 4
    thin = ThinPlates(where, corners, axes, 4 * a * b, dN, kappa, stiffness.S, REMEDY)
    strain = replace(rectangle_strain(a, b, elastic, stress, dof_map, (_POINTS, _WEIGHTS)), thin=thin)
    return Contribution(
        inertia=(
            PlateInertia(
                dm, rho, dof_map, axes, heights, inplane, partial(rows_of_elements, rows.swapaxes(1, 2).copy())
            ),
        ),
        strain=(strain,),
        skin=partial(plate_skin, mesh.points, corners, axes, section.thickness, dof_map),
        places=(
            StrainPlaces(
                "plate",
                middle,
                _rule_points(mesh.points[corners], _SAMPLING[0]),
                section.thickness / 2,
                plies=ply_stiffness(section, options["axis"], axes),
                axes=axes,
            ),
        ),
    )


def _rule_points(corners: Array, points: Array) -> Array:
    """Positions (e, q, 3) of a Gauss rule in both directions between corners (e, 4, 3)."""
    xi, eta = (grid.ravel() for grid in np.meshgrid(points, points, indexing="ij"))
    return np.asarray(np.matmul(inplane_shapes(xi, eta)[:, :4], corners))


def rectangle_strain(
    a: Array, b: Array, elastic: Array, stress: Array, dof_map: LocalDofs, rule: tuple[Array, Array]
) -> PlateStrain:
    """Return the strain of rectangles with half lengths a, b (e,) [m], by a Gauss rule (points, weights) in both
    directions."""

    def strain_by_rule(rule: tuple[Array, Array], elements: slice, sign: float = 1.0) -> PlateStrain:
        element_data = (
            sign * rows_of_elements(elastic, elements),
            rows_of_elements(stress, elements),
            dof_map.of_elements(elements),
        )
        return rectangle_strain(a[elements], b[elements], *element_data, rule)

    def tied(elements: slice) -> tuple[PlateStrain, ...]:
        corrections = (strain_by_rule((_POINTS, _WEIGHTS), elements), strain_by_rule(_SAMPLING, elements, -1.0))
        return (strain_by_rule(_SAMPLING, elements), *(replace(part, linear=True) for part in corrections))

    xi, eta = (grid.ravel() for grid in np.meshgrid(rule[0], rule[0], indexing="ij"))
    rows_needed = slice(0, 1) if _equal_lengths(a) and _equal_lengths(b) else slice(None)
    rows = deflection_and_rotation(xi, eta, a[rows_needed], b[rows_needed])
    return PlateStrain(
        weight=(a * b)[:, None] * np.outer(rule[1], rule[1]).ravel(),
        elastic=elastic,
        map=dof_map,
        dP=inplane_gradients(xi, eta, a[rows_needed], b[rows_needed]),
        slopes=partial(rows_of_elements, -rows[:, :, 1:]),
        bending=partial(rows_of_elements, curvatures(xi, eta, a[rows_needed], b[rows_needed])),
        fine=partial(strain_by_rule, _SQUARES),
        tied=tied,
        stress=stress,
    )


def rectangles(points: Array, corners: IntArray, where: str) -> tuple[IntArray, Array, Array, Array]:
    """Corners (e, 4) counterclockwise from the least local x and y, axes (1|e, 3, 3), half lengths a, b (e,) [m].

    The axes lie along the sides and are the same for all rectangles of one plane and direction, whatever the order of
    their nodes, so that neighbours share the twist w,xy. Raises ValueError for other quadrilaterals.
    """
    x = points[corners]
    normals = plane_normals(x, where)
    first, second = x[:, 1] - x[:, 0], x[:, 3] - x[:, 0]
    lengths = np.linalg.norm(first, axis=1), np.linalg.norm(second, axis=1)
    misfit = np.linalg.norm(x[:, 2] - x[:, 1] - second, axis=1) / (lengths[0] + lengths[1])
    cosine = np.abs(np.sum(first * second, axis=1)) / (lengths[0] * lengths[1])
    skewed = np.flatnonzero((misfit > SQUARENESS) | (cosine > SQUARENESS))
    if len(skewed):
        raise ValueError(
            f"{where}: {len(skewed)} of {len(x)} quadrilaterals are not rectangles; element {skewed[0]} has corners "
            f"{x[skewed[0]].tolist()}. Use the plate family on triangles there"
        )
    u, v = first / lengths[0][:, None], second / lengths[1][:, None]
    nearer_side = np.where((np.abs(u @ REFERENCE) > np.abs(v @ REFERENCE))[:, None], u, v)
    e1 = orient_normals(nearer_side)
    axes = shared_axes(np.stack([e1, np.cross(normals, e1), normals], axis=1))
    local = np.matmul(x - x.mean(axis=1, keepdims=True), axes[:, :2].swapaxes(1, 2))
    order = np.argsort(np.arctan2(local[:, :, 1], local[:, :, 0]), axis=1)  # from the third quadrant, counterclockwise
    half = np.abs(local).mean(axis=1)
    return np.take_along_axis(corners, order, axis=1), axes, half[:, 0], half[:, 1]


def _equal_lengths(lengths: Array) -> bool:
    return bool(np.abs(lengths - lengths[0]).max() < ROUNDING * lengths[0])


# Fields of the rectangle of Bogner, Fox and Schmit (1965) with a biquadratic in-plane field.
#
# Coordinates xi, eta in [-1, 1] from the middle, half lengths a, b along the element's axes. Bending dofs at each
# corner (w, theta_x, theta_y, twist) = (w, w,y, -w,x, w,xy); w is the bicubic Hermite interpolation, continuous with
# its slopes, and normals stay perpendicular: beta = -grad w, without transverse shear.


# Corners counterclockwise; sides from each corner to the next.
XI, ETA = np.array([-1.0, 1.0, 1.0, -1.0]), np.array([-1.0, -1.0, 1.0, 1.0])


# Coefficients [1] of cubics by power, end and kind: value 1, or slope 1, at s = -1 or 1, and zero of all others there.
HERMITE = np.array([[[2, -s], [3 * s, -1], [0, s], [-s, 1]] for s in (-1.0, 1.0)]).swapaxes(0, 1) / 4
# Coefficients of 1/2 - s / 2, 1/2 + s / 2 and 1 - s^2, and the products in xi and eta that are in-plane functions:
# corners, deviation from the straight line on sides, bubble.
INPLANE = np.array([[0.5, 0.5, 1.0], [-0.5, 0.5, 0.0], [0.0, 0.0, -1.0]])
BY_XI, BY_ETA = [0, 1, 1, 0, 2, 1, 2, 0, 2], [0, 0, 1, 1, 0, 2, 1, 2, 2]


def _derivatives(coefficients: Array, xi: Array, eta: Array, order: tuple[int, int]) -> list[Array]:
    """Derivatives, order times, of polynomials at xi and at eta (q,): by the coefficients' axes after the first, q."""
    return [np.asarray(polyval(x, polyder(coefficients, n)), float) for x, n in zip((xi, eta), order, strict=True)]


def deflection(xi: Array, eta: Array, order: tuple[int, int]) -> Array:
    """Derivative (q, 16) [m per dof], order times by xi and eta, of w over the dofs (w, w,eta, w,xi, w,xi eta) of
    each corner."""
    along, across = _derivatives(HERMITE, xi, eta, order)
    products = along[(XI > 0).astype(int)][:, :, None] * across[(ETA > 0).astype(int)][:, None]
    return np.ascontiguousarray(products.reshape(16, -1).T)


def deflection_and_rotation(xi: Array, eta: Array, a: Array, b: Array) -> Array:
    """w [m], beta_x, beta_y [rad] (e, q, 3, 16), per dof, of rectangles with half lengths a, b (e,)."""
    reference = [deflection(xi, eta, order) for order in ((0, 0), (1, 0), (0, 1))]
    return _scaled(reference, [np.ones_like(a), -1 / a, -1 / b], a, b)


def curvatures(xi: Array, eta: Array, a: Array, b: Array) -> Array:
    """kappa (3) [1/m] = -(w,xx  w,yy  2 w,xy) of rectangles with half lengths a, b (e,): (e, q, 3, 16)."""
    reference = [deflection(xi, eta, order) for order in ((2, 0), (0, 2), (1, 1))]
    return _scaled(reference, [-1 / a**2, -1 / b**2, -2 / (a * b)], a, b)


def inplane_shapes(xi: Array, eta: Array, order: tuple[int, int] = (0, 0)) -> Array:
    """In-plane shape functions (q, 9) [1], or their derivatives, order times by xi and eta."""
    along, across = _derivatives(INPLANE, xi, eta, order)
    return np.ascontiguousarray((along[BY_XI] * across[BY_ETA]).T)


def inplane_gradients(xi: Array, eta: Array, a: Array, b: Array) -> Array:
    """Their derivatives by x and y (e, q, 2, 9) [1/m] on rectangles with half lengths a, b (e,)."""
    dx, dy = inplane_shapes(xi, eta, (1, 0)), inplane_shapes(xi, eta, (0, 1))
    return np.stack([dx / a[:, None, None], dy / b[:, None, None]], axis=2)


def _scaled(reference: list[Array], rows: list[Array], a: Array, b: Array) -> Array:
    table = np.stack(reference, axis=1)  # (q, rows, 16)
    dofs = np.tile(np.stack([np.ones_like(a), b, -a, a * b], axis=1), 4)  # from w, theta_x, theta_y, twist
    return table * np.stack(rows, axis=1)[:, None, :, None] * dofs[:, None, None, :]
