"""The strain table of a beam member: stretch, and curvature and twist to second order in the rotation of sections.

A section rotates by the vector psi = (theta, -w' + theta v'/2, v' + theta w'/2), so that its x axis stays on the
tangent. Its curvature and twist are kappa = psi' - psi x psi' / 2 (Hodges and Dowell, NASA TN D-7818 (1974), to second
order):

    kappa_x = theta' + (w' v'' - v' w'') / 2      kappa_y = -w'' + theta v''      kappa_z = v'' + theta w''

This goes beyond THEORY section 3. The energy is correct to third order in displacements, that of kappa_x to fourth.

v' is the sine of the slope of an axis of constant length, and the curvature of plane bending is v'' / cos = v'' (1 -
u') to third order, u' = -v'^2 / 2: a deflection of 8 % of the length stores 0.4 % more energy than v''^2. The
curvatures therefore contain u' v'' and u' w''.

With a tangent t that is rotated from x by the shortest way, and by theta about itself (R = R_shortest(t) R_x(theta)),

    k_y = v'' + v' (v' v'' + w' w'') / 2      k_z = w'' + w' (v' v'' + w' w'') / 2      (third order)
    kappa_z = k_y cos theta + k_z sin theta      kappa_y = k_y sin theta - k_z cos theta

The terms of fourth order in its energy, in addition to the squares of the strains above, are a separate table of
unnamed strains with stiffnesses of either sign (`fourth_order_stiffnesses`), p = v' w'' and s = w' v'':

    V_4 = -1/2 [EIy p^2 - (EIy + EIz) p s + EIz s^2] - theta^2/2 [EIz v''^2 + EIy w''^2]

For an axis of constant length, (v'' / cos)^2 = v''^2 (1 + u')^-2, whose next term is
3 u'^2 v''^2; the square of v'' (1 - u') contains one of the three. The other two are

    V_6 = EIz (u' v'')^2 + EIy (u' w'')^2

of sixth order in the deflection. Without them a column 1.5 % above Euler's load deflects 13 % too much, and soon
collapses.

V_4 is zero for bending in one plane without twist; with it a round section bends and twists alike about all axes.

Large deflections (option bounded_energy). For a strip, EIy >> EIz, the negative terms of V_4 soon dominate. Bent
about its weak axis and twisted, it has w'' = theta v'', which stores no energy in the stiff plane. There -EIy theta^2
w''^2 / 2 equals -EIy theta^4 v''^2 / 2, of sixth order, and the terms that would balance it in the square (k_y sin
theta - k_z cos theta)^2 are of fifth and sixth order too, so that a series of fourth order cannot contain both: a
column with 400 times the stiffness in its stiff plane loses its torsional stiffness 1.3 % above Euler's load, and
then diverges. With `bounded_energy` V_4 is that of the inscribed round section, of stiffness min(EIy, EIz), and the
rest of the energy consists of squares. This neglects bending in the stiff plane in proportion to the square of the
twist: Prandtl's load becomes 1 / (2 ratio) too high.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from femflex.arrays import Array, BoolArray, IntArray
from femflex.fem.beam.elements import BeamElements, stations
from femflex.fem.beam.shapes import field_rows
from femflex.fem.line.chain import straight_elements
from femflex.fem.sections.section import Resultants
from femflex.fem.tables import DenseStrain, StrainBlock, StressAt, rows_of_elements

if TYPE_CHECKING:
    from femflex.fem.structure import Member
    from femflex.mesh import Mesh

PRODUCTS = (  # strain, two of its gradients (`strain_maps`), and their factor
    *((1, 6, 5, 1.0), (1, 0, 4, -1.0)),  # kappa_z: theta w'', u' v''
    *((2, 6, 4, 1.0), (2, 0, 5, 1.0)),  # kappa_y: theta v'', u' w''
    *((3, 8, 4, 0.5), (3, 7, 5, -0.5)),  # r kappa_x: r w' v'', r v' w''
)


FOURTH = (  # the strains of V_4, by two of those gradients each, and those of V_6 for a stretched axis
    ((7, 5), (8, 4)),  # r (p + s)
    ((7, 5),),  # r p
    ((8, 4),),  # r s
    ((6, 4),),  # theta v''
    ((6, 5),),  # theta w''
    ((0, 4),),  # u' v''
    ((0, 5),),  # u' w''
)
NAMED_ROWS = [
    0,
    5,
    4,
    3,
]  # of (eps, gamma_y, gamma_z, kappa_x, kappa_y, kappa_z), in the order of the strains with names
ADDED, SUBTRACTED = [0, 5, 6], [1, 2, 3, 4]  # those that add energy, and those that subtract it


@dataclass(frozen=True, eq=False)
class BeamStrain(DenseStrain):
    """A strain block with the fourth-order terms of its energy in addition to its strains.

    fourth (e, q, 7)   the stiffnesses of these terms (`fourth_order_stiffnesses`)
    polar2 (e, q)      polar radius squared r^2 [m^2] by which the twist is scaled
    """

    fourth: Array = field(default_factory=lambda: np.zeros((1, 1, len(FOURTH))))
    polar2: Array = field(default_factory=lambda: np.ones((1, 1)))

    def sampled(self, elements: slice) -> DenseStrain:
        """See StrainBlock; the strains of fourth order follow the named ones."""
        named_block = self.dense(elements)
        shape, n_named = named_block.elastic.shape[:2], named_block.elastic.shape[2]
        fourth = np.broadcast_to(rows_of_elements(self.fourth, elements), (*shape, len(FOURTH)))
        stress = np.concatenate([np.broadcast_to(named_block.stress, (*shape, n_named)), 0.0 * fourth], axis=2)
        elastic = np.zeros((*shape, n_named + len(FOURTH), n_named + len(FOURTH)))
        elastic[..., :n_named, :n_named] = named_block.elastic
        elastic[..., n_named:, n_named:] = fourth[..., None] * np.eye(len(FOURTH))
        linear = np.concatenate([named_block.linear_map, np.zeros((len(FOURTH), named_block.linear_map.shape[1]))])
        products = _pad_gradients(product_maps(FOURTH), named_block.quadratic_map.shape[1])
        quadratic = np.concatenate([named_block.quadratic_map, products])
        return replace(named_block, elastic=elastic, linear_map=linear, quadratic_map=quadratic, stress=stress)

    def nonlinear(self, elements: slice, stress: StressAt | None = None) -> tuple[StrainBlock, ...]:
        """See StrainBlock; positive and negative terms of fourth order are separate blocks."""
        named_block, fourth = self.dense(elements), rows_of_elements(self.fourth, elements)
        maps = _pad_gradients(product_maps(FOURTH), named_block.quadratic_map.shape[1])
        parts = (
            replace(
                named_block,
                elastic=fourth[..., k, None] * np.eye(len(maps[k])),
                linear_map=0.0 * maps[k, 0],
                quadratic_map=maps[k],
                stress=np.zeros((1, 1, 1)),
            )
            for k in (ADDED, SUBTRACTED)
        )
        return (named_block if stress is None else replace(named_block, stress=stress(named_block)), *parts)


@dataclass(frozen=True, eq=False)
class ShearStrain(DenseStrain):
    """The strains of a sheared beam, with the stiffness of the shears and of their coupling to the others.

    named (e, q, 6, 6)   the stiffness of the others among themselves, which is not part of this block
    """

    named: Array = field(default_factory=lambda: np.zeros((1, 1, 6, 6)))

    def sampled(self, elements: slice) -> DenseStrain:
        """See StrainBlock."""
        block = super().sampled(elements)
        assert isinstance(block, ShearStrain)
        return replace(block, named=rows_of_elements(self.named, elements))

    def nonlinear(self, elements: slice, stress: StressAt | None = None) -> tuple[StrainBlock, ...]:
        """See StrainBlock; if shear is coupled to other strains, a positive definite block and a negative one that
        corrects it."""
        block, named = self.sampled(elements), rows_of_elements(self.named, elements)
        stressed = block if stress is None else replace(block, stress=stress(block))
        if not self.quadratic_map.any():
            return (stressed,)
        excess = replace(block, elastic=-named, stress=np.zeros((1, 1, 1)))
        return replace(stressed, elastic=block.elastic + named), excess


def sectional_stiffness(r: Resultants, stiffness: Array | None) -> Array:
    """Elastic matrix (e, q, 4, 4) [N, N m, N m^2] over (eps, kappa_z, kappa_y, r kappa_x).

    That of the resultants, or of a full sectional stiffness (e, q, 6, 6) without its shears.
    """
    if stiffness is None:
        return np.stack([r.EA, r.EIz, r.EIy, r.GJ / r.polar2], axis=-1)[..., None] * np.eye(4)
    named = stiffness[..., NAMED_ROWS, :][..., NAMED_ROWS].copy()
    named[..., 3, :] /= np.sqrt(r.polar2)[..., None]
    named[..., :, 3] /= np.sqrt(r.polar2)[..., None]
    return np.asarray(named)


def shear_strain(
    strain: BeamStrain, elements: BeamElements, member: Member, degree: int, stiffness: Array
) -> DenseStrain:
    """Strains (eps, kappa_z, kappa_y, r kappa_x, gamma_y, gamma_z) [1, 1/m] with their full stiffness (e, q, 6, 6)
    [N, N m, N m^2], shear and its coupling included."""
    xi, _, r = stations(elements, member, degree)
    scale = np.ones((*strain.weight.shape, 6))
    scale[..., 3] = 1 / np.sqrt(r.polar2)
    order = [*NAMED_ROWS, 1, 2]
    elastic = stiffness[..., order, :][..., order] * scale[..., None, :] * scale[..., :, None]
    named = np.zeros_like(elastic)
    named[..., :4, :4] = elastic[..., :4, :4]
    n = strain.G.shape[2]
    linear, quadratic = np.zeros((6, n + 2)), np.zeros((6, n + 2, n + 2))
    linear[:4, :n] = strain.linear_map
    linear[4, n] = linear[5, n + 1] = 1.0
    if elastic[..., :4, 4:].any():
        quadratic[:4, :n, :n] = strain.quadratic_map  # which acts on shear only
    G = np.concatenate([strain.G, elements.shears(xi)], axis=2)
    return ShearStrain(strain.dofs, strain.weight, elastic - named, linear, quadratic, G, named=named)


def beam_strain(
    elements: BeamElements,
    member: Member,
    degree: int,
    options: dict[str, Any],
    corners: BoolArray,
    stiffness: Array | None = None,
) -> BeamStrain:
    """Strains (eps, kappa_z, kappa_y, r kappa_x) [1, 1/m], r^2 = I_p / A, of the gradients that `strain_maps` lists.

    The twist is carried as r theta' with stiffness GJ / r^2, so that its share of the axial strain is a constant too.
    corners (e, 2): ends where beams meet at an angle (`femflex.fem.beam.strain`). stiffness (e, q, 6, 6): full one of
    the section over (eps, gamma_y, gamma_z, kappa_x, kappa_y, kappa_z), where it is coupled.
    """
    xi, weight, r = stations(elements, member, degree)
    value, first = (elements.rows(xi, derivative) for derivative in range(2))
    slope, second = elements.slopes(xi), elements.slopes(xi, 1)
    polar = np.sqrt(r.polar2)[..., None]
    first[:, :, 3] *= polar
    elastic = sectional_stiffness(r, stiffness)
    rotations = np.stack([value[:, :, 3], polar * slope[:, :, 0], polar * slope[:, :, 1]], axis=2)
    G = np.concatenate([first, second, rotations], axis=2)
    stress = np.zeros((*weight.shape, 4))
    stress[:, :, 0] = options["prestress"] - r.EA * options["thermal_strain"]
    if options["offset"] is not None:  # the force acts at the centroid: eps + z kappa_y - y kappa_z
        y, z = options["offset"]
        stress[:, :, 1], stress[:, :, 2] = -y * stress[:, :, 0], z * stress[:, :, 0]
    stiffnesses = fourth_order_stiffnesses(r.EIy, r.EIz, r.polar2, bool(options["bounded_energy"]))
    fourth = np.broadcast_to(stiffnesses, (*weight.shape, len(FOURTH)))
    linear, quadratic = strain_maps()
    if corners.any():
        products = corner_products(G.shape[2])
        G = np.concatenate([G, corner_gradients(elements, xi, corners)], axis=2)
        linear, quadratic = (_pad_gradients(table, G.shape[2]) for table in (linear, quadratic))
        set_products(quadratic, products)
    return BeamStrain(elements.dofs, weight, elastic, linear, quadratic, G, stress, fourth, r.polar2)


def _pad_gradients(table: Array, n: int) -> Array:
    """Return the table (s, g[, g]) with zeros for gradients up to n."""
    return np.pad(table, [(0, 0), *([(0, n - table.shape[1])] * (table.ndim - 1))])


def set_products(quadratic: Array, products: Sequence[tuple[int, int, int, float]]) -> None:
    """Set in the quadratic map (s, g, g) [1, m] strains' products of two gradients, with their factors."""
    for strain, row, column, value in products:
        quadratic[strain, [row, column], [column, row]] = value


def fourth_order_stiffnesses(
    EIy: Array | float, EIz: Array | float, polar2: Array | float, bounded_energy: bool = False
) -> Array:
    """Stiffnesses (..., 7): EIy p^2 - 2 m p s + EIz s^2 of V_4 from squares of one sign each, twist, and V_6."""
    added = np.stack(np.broadcast_arrays(2.0 * np.asarray(EIz), 2.0 * np.asarray(EIy), polar2)[:2], axis=-1)
    y, z = (np.minimum(EIy, EIz),) * 2 if bounded_energy else (np.asarray(EIy), np.asarray(EIz))
    mean = (y + z) / 2
    bends = mean / polar2, -(y + mean) / polar2, -(z + mean) / polar2
    return np.concatenate([np.stack(np.broadcast_arrays(*bends, -z, -y), axis=-1), added], axis=-1)


def product_maps(strains: Sequence[Sequence[tuple[int, int]]]) -> Array:
    """Quadratic map (n_strains, 9, 9) [1] of strains that are sums of products of two gradients."""
    maps = np.zeros((len(strains), 9, 9))
    for strain_map, products in zip(maps, strains, strict=True):
        for row, column in products:
            strain_map[[row, column], [column, row]] = 1.0
    return maps


def strain_maps() -> tuple[Array, Array]:
    """Linear (4, 9) and quadratic map (4, 9, 9) [1] from (u', v', w', r theta', v'', w'', theta, r v', r w')."""
    linear, quadratic = np.zeros((4, 9)), np.zeros((4, 9, 9))
    linear[[0, 1, 2, 3], [0, 4, 5, 3]] = 1.0, 1.0, -1.0, 1.0
    quadratic[0, range(4), range(4)] = 1.0
    set_products(quadratic, PRODUCTS)
    return linear, quadratic


# Rotations to second order where beams meet at an angle.
#
# The fields of a beam along e take s = (theta, -w', v') at its ends, and its sections turn by the vector psi = s -
# (e.s) e x s / 2. Beams in line share s and psi alike. Beams that meet at an angle, each with its own e, share psi
# only: their fields take s = psi + (e.psi) e x psi / 2 there, to second order. Otherwise the moments at the corner
# would do work on different rotations, and the lateral buckling load of an L-frame that bends in its plane would be
# some per cents too low (J. H. Argyris and others, Comp. Meth. Appl. Mech. Engng 20 (1979) 105).
#
# The fields at an end then have more of v' by theta psi_y / 2 and of -w' by -theta psi_z / 2, and the curvatures
#
#     kappa_z   + H'' theta psi_y / 2      kappa_y   - H'' theta psi_z / 2
#
# with H the shape function of the slope at that end. They are products of three gradients per end.


IN_LINE = 1e-6  # sine of the angle up to which beams at a node count as one straight line
SLOPES = (5, 11)  # local dofs theta_z of the two ends: the slopes v'
FAMILY = "beam"


def corner_nodes(mesh: Mesh, members: Iterable[Member], least: float = IN_LINE) -> IntArray:
    """Numbers (k,) of the nodes, ascending, where elements of beam members meet at an angle of a sine above least."""
    first = np.zeros((len(mesh.points), 3))
    angled = np.zeros(len(mesh.points), bool)
    for member in members:
        if member.family != FAMILY or member.group not in mesh.cell_groups:
            continue
        nodes = straight_elements(mesh.group_cells(member.group))
        axes = mesh.points[nodes[:, 1]] - mesh.points[nodes[:, 0]]
        axes = np.repeat(axes / np.linalg.norm(axes, axis=1, keepdims=True), 2, axis=0)
        ends = nodes.ravel()
        new_nodes, row = np.unique(ends, return_index=True)
        without_axis = ~first[new_nodes].any(axis=1)
        first[new_nodes[without_axis]] = axes[row[without_axis]]
        angled[ends[np.linalg.norm(np.cross(first[ends], axes), axis=1) > least]] = True
    return np.flatnonzero(angled)


def corner_gradients(elements: BeamElements, xi: Array, corners: BoolArray) -> Array:
    """Rows (e, q, 6, n_local) [rad per dof] of H'' theta, psi_y and psi_z of either end at xi (q,); zero at ends (e, 2)
    that are not corners."""
    slope = field_rows(elements.order, xi, elements.length, 2)[:, :, 1]
    rows = np.zeros((*slope.shape[:2], 6, slope.shape[2]))
    for end, dof in enumerate(SLOPES):
        turn = slice(dof - 2, dof + 1)
        rows[:, :, 3 * end, turn] = slope[:, :, dof, None] * elements.frame[:, None, 0]
        rows[:, :, 3 * end + 1 : 3 * end + 3, turn] = elements.frame[:, None, 1:]
        rows[:, :, 3 * end : 3 * end + 3] *= corners[:, end, None, None, None]
    return rows


def corner_products(first: int) -> tuple[tuple[int, int, int, float], ...]:
    """Return the strain, the two gradients and the factor of each product; `corner_gradients` are those from `first`
    on."""
    return tuple(
        product
        for end in (first, first + 3)
        for product in ((1, end, end + 1, 0.5), (2, end, end + 2, -0.5))  # kappa_z, kappa_y
    )
