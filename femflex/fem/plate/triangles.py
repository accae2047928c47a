"""Plate members on any triangles: thin (DKT) or of any thickness (DKMT), with a quadratic in-plane field."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache, partial
from typing import TYPE_CHECKING

import numpy as np
from skfem.quadrature import get_quadrature
from skfem.refdom import RefTri

from femflex.arrays import Array, IntArray
from femflex.fem.assembly.numbering import Numbering
from femflex.fem.family import Contribution, Option, StrainPlaces, family, member_cells, member_options
from femflex.fem.mesh_warnings import warn_of_curved_sides
from femflex.fem.plate.blocks import LocalDofs, PlateInertia, mass_points
from femflex.fem.plate.frames import (
    OPTIONS,
    initial_stress,
    plane_frames,
    plane_normals,
    ply_stiffness,
    section_stiffness,
    shared_axes,
)
from femflex.fem.plate.sides import flat_map, member_section
from femflex.fem.plate.skin import plate_skin
from femflex.fem.plate.strain import PlateStrain, ThinPlates
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


# Fields of the flat triangles DKT and DKMT with a quadratic in-plane field.
#
# Bending dofs (w, theta_x, theta_y) at each corner, in the element's axes; beta = (theta_y, -theta_x) is the rotation
# of the normal. On side k from corner i to j, of length L and direction t (Batoz, Bathe & Ho 1980; Katili 1993):
#
#     beta      linear between the corners, plus sum_k 4 L_i L_j Delta_k t_k
#     Delta_k   = -3/2 / (1 + f_k) [ (w_j - w_i) / L + (beta_i + beta_j).t / 2 ]
#     gamma_k   = -2/3 f_k Delta_k  along the side, constant on it;  f_k = 12 D_k / (S_k L^2)
#
# gamma between the sides is linear over the triangle. f = 0 is DKT: Kirchhoff's condition holds along the sides. With D
# and S of the section along the side, f is that of a beam in equilibrium and thick plates shear without locking.
#
# The deflection of the mass points is cubic with w,s = gamma_k - beta.t exactly along the sides, so that neighbours
# agree; inside it reproduces quadratics (the Bezier form of Zienkiewicz's triangle).


START, END = np.array([0, 1, 2]), np.array([1, 2, 0])  # corners of the sides
BEFORE = np.array([2, 0, 1])  # the side that ends at each corner
# Exponents of the cubic Bernstein polynomials: corners, then two per side, then the middle.
CUBIC = np.array([
    [3, 0, 0], [0, 3, 0], [0, 0, 3],
    [2, 1, 0], [1, 2, 0], [0, 2, 1], [0, 1, 2], [1, 0, 2], [2, 0, 1],
    [1, 1, 1],
])  # fmt: skip
FACTOR = np.array([1, 1, 1, 3, 3, 3, 3, 3, 3, 6])  # 3! / (i! j! k!)
# Bezier coefficients of w from the deflections (3) of the corners and the rises (6) of `side_rises`: the nearest
# corner's deflection, with the rise on the sides; in the middle (sum of the six on the sides) / 4 - (sum of the
# corners) / 6, which makes quadratics exact.
BY_DEFLECTION = np.vstack([np.eye(3), np.eye(3)[[0, 1, 1, 2, 2, 0]], np.full((1, 3), 1 / 3)])
BY_RISE = np.vstack([np.zeros((3, 6)), np.eye(6)[[0, 4, 1, 5, 2, 3]], np.full((1, 6), 1 / 4)])
# The deflections of the corners from the dofs.
DEFLECTION = np.eye(9)[[0, 3, 6]]
# beta (corner, component, bending dof) from the dofs.
BETA = np.zeros((3, 2, 9))
BETA[[0, 1, 2], 0, [2, 5, 8]] = 1.0
BETA[[0, 1, 2], 1, [1, 4, 7]] = -1.0


@dataclass(frozen=True, eq=False)
class Triangles:
    """Bending fields of triangles as rows over their 9 bending dofs.

    x        (e, 3, 2)     corners in the plane
    area     (e,)
    dL       (e, 2, 3)     derivatives of the area coordinates by x and y
    bubble   (e, 3, 2, 9)  Delta_k t_k of the sides
    shear    (e, 3, 2, 9)  gamma at the corners
    """

    x: Array
    area: Array
    dL: Array
    bubble: Array
    shear: Array

    def of_elements(self, elements: slice) -> Triangles:
        """The fields of these triangles."""
        parts = (self.x, self.area, self.dL, self.bubble, self.shear)
        return Triangles(*(part[elements] for part in parts))

    def deflection_and_rotation(self, L: Array, elements: slice) -> Array:
        """w [m], beta_x, beta_y [rad] (e, 3, q, 9), per dof, at area coordinates L (q, 3)."""
        bubble = self.bubble[elements].swapaxes(1, 2)
        N = np.empty((len(bubble), 3, len(L), 9))
        N[:, 0] = self._cubic(FACTOR * np.prod(L[:, None, :] ** CUBIC, axis=2), elements)
        np.matmul(4 * L[:, START] * L[:, END], bubble, out=N[:, 1:])
        N[:, 1:] += np.matmul(L, BETA.swapaxes(0, 1))
        return N

    def slopes(self, L: Array, elements: slice) -> Array:
        """w,x and w,y (e, q, 2, 9) [rad per dof] at area coordinates L (q, 3)."""
        polynomials = bernstein_derivatives(L).reshape(-1, 10)
        by_L = self._cubic(polynomials, elements).reshape(-1, len(L), 3, 9)
        return np.matmul(self.dL[elements, None], by_L)

    def strains(self, L: Array, shears: bool, elements: slice) -> Array:
        """kappa (3) [1/m] and, if it shears, gamma (2) [1]: (e, q, 3|5, 9) at area coordinates L (q, 3)."""
        bubble, shear = self.bubble[elements].reshape(-1, 3, 18), self.shear[elements].reshape(-1, 3, 18)
        e, q = len(bubble), len(L)
        by_L = np.matmul(bump_derivatives(L).reshape(3 * q, 3), bubble).reshape(e, q, 3, 2, 9) + BETA
        beta = np.matmul(self.dL[elements, None], by_L.reshape(e, q, 3, 18)).reshape(e, q, 2, 2, 9)  # (by, component)
        B = np.empty((e, q, 5 if shears else 3, 9))
        B[:, :, 0], B[:, :, 1] = beta[:, :, 0, 0], beta[:, :, 1, 1]
        np.add(beta[:, :, 0, 1], beta[:, :, 1, 0], out=B[:, :, 2])
        if shears:
            B[:, :, 3:] = np.matmul(L, shear).reshape(e, q, 2, 9)
        return B

    def _cubic(self, polynomials: Array, elements: slice) -> Array:
        """Rows (e, p, 9) of w in place of its Bezier coefficients in polynomials (p, 10)."""
        rises = side_rises(self.x[elements], self.shear[elements] - BETA)
        rows = np.matmul(polynomials @ BY_RISE, rises)
        rows += polynomials @ BY_DEFLECTION @ DEFLECTION
        return rows


def triangles(x: Array, D: Array, S: Array | None) -> Triangles:
    """Fields of triangles with corners x (e, 3, 2) [m] in their planes; D (1|e, 3, 3), S (1|e, 2, 2), or None for
    DKT."""
    span = x[:, END] - x[:, START]
    twice = span[:, 0, 0] * span[:, 1, 1] - span[:, 0, 1] * span[:, 1, 0]
    opposite = span[:, [1, 2, 0]]  # the side opposite to the corner
    dL = np.stack([-opposite[:, :, 1], opposite[:, :, 0]], axis=1) / twice[:, None, None]
    length = np.linalg.norm(span, axis=2)
    t = span / length[:, :, None]
    f = np.zeros_like(length) if S is None else side_shear_factor(t, length, D, S)
    delta = np.einsum("eka,kal->ekl", t, (BETA[START] + BETA[END]) / 2)
    k = np.arange(3)
    delta[:, k, 3 * END] += 1 / length
    delta[:, k, 3 * START] -= 1 / length
    delta *= (-1.5 / (1 + f))[:, :, None]
    shear = corner_vectors(t, -2 / 3 * f[:, :, None] * delta)
    bubble = t[..., None] * delta[:, :, None, :]
    return Triangles(x, np.abs(twice) / 2, dL, bubble, shear)


def side_shear_factor(t: Array, length: Array, D: Array, S: Array) -> Array:
    """f (e, 3) [1] = 12 D_k / (S_k L^2) with the section's stiffness along the sides t (e, 3, 2)."""
    bend = np.stack([t[..., 0] ** 2, t[..., 1] ** 2, 2 * t[..., 0] * t[..., 1]], axis=-1)
    D_side = np.sum(np.matmul(bend, D) * bend, axis=-1)
    flexibility = np.sum(np.matmul(t, np.linalg.inv(S)) * t, axis=-1)
    return 12 * D_side * flexibility / length**2


def corner_vectors(t: Array, along: Array) -> Array:
    """Vectors (e, corner, 2, 9) [1] whose components along the two sides of each corner are along (e, side, 9)."""
    s, g = t[:, BEFORE], along[:, BEFORE]
    sine = (t[..., 0] * s[..., 1] - t[..., 1] * s[..., 0])[..., None]
    x = (s[..., 1, None] * along - t[..., 1, None] * g) / sine
    y = (t[..., 0, None] * g - s[..., 0, None] * along) / sine
    return np.stack([x, y], axis=2)


def side_rises(x: Array, slope: Array) -> Array:
    """Rises of w (e, 6, 9) [m per dof] over a third of a side from corners x (e, 3, 2) with their slopes (e, 3, 2, 9):
    from each corner along the side that begins there, then from each along the side that ends there."""
    third = (x[:, END] - x[:, START])[..., None] / 3
    rises = np.empty((len(x), 6, slope.shape[3]))
    for out, by in ((rises[:, :3], third), (rises[:, 3:], -third[:, BEFORE])):
        np.multiply(by[:, :, 0], slope[:, :, 0], out=out)
        out += by[:, :, 1] * slope[:, :, 1]
    return rises


def bernstein_derivatives(L: Array) -> Array:
    """Derivatives (q, 3, 10) [1] of the cubic Bernstein polynomials by the area coordinates."""
    rows = []
    for axis in range(3):
        lowered = CUBIC.copy()
        lowered[:, axis] = np.maximum(CUBIC[:, axis] - 1, 0)
        rows.append(FACTOR * CUBIC[:, axis] * np.prod(L[:, None, :] ** lowered, axis=2))
    return np.stack(rows, axis=1)


def inplane_shapes(L: Array) -> Array:
    """In-plane shape functions (q, 6) [1] at area coordinates L (q, 3): corners, then 4 L_i L_j of the sides."""
    return np.concatenate([L, 4 * L[:, START] * L[:, END]], axis=1)


def inplane_gradients(L: Array, dL: Array) -> Array:
    """Their derivatives by x and y (e, q, 2, 6) [1/m], dL (e, 2, 3) [1/m]."""
    by_L = np.concatenate([np.broadcast_to(np.eye(3), (len(L), 3, 3)), bump_derivatives(L)], axis=2)
    return np.matmul(dL[:, None], by_L)


def bump_derivatives(L: Array) -> Array:
    """Derivatives (q, 3, 3) [1], by side, of 4 L_i L_j by the area coordinates."""
    by_L = L[:, START, None] * np.eye(3)[END] + L[:, END, None] * np.eye(3)[START]
    return 4 * by_L.swapaxes(1, 2)
