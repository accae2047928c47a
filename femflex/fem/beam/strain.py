"""The strain table of a beam member: stretch, and curvature and twist to second order in the rotation of sections.

A section that turns by the vector psi = (theta, -w' + theta v'/2, v' + theta w'/2), whose x axis stays on the tangent,
is bent and twisted by kappa = psi' - psi x psi' / 2 (Hodges and Dowell, NASA TN D-7818 (1974), to second order):

    kappa_x = theta' + (w' v'' - v' w'') / 2      kappa_y = -w'' + theta v''      kappa_z = v'' + theta w''

which goes beyond THEORY section 3: right to third order of the energy in displacements. kappa_x is so to fourth.

v' is the sine of the slope where the axis keeps its length, and the curvature of a plane bend v'' / cos = v'' (1 - u')
to third order, u' = -v'^2 / 2: a bend of 8 % of the length stores 0.4 % more than v''^2 says. Hence u' v'' and u' w''
in the curvatures.

A tangent t turned from x the shortest way, and by theta about itself, bends by (R = R_shortest(t) R_x(theta))

    k_y = v'' + v' (v' v'' + w' w'') / 2      k_z = w'' + w' (v' v'' + w' w'') / 2      (third order)
    kappa_z = k_y cos theta + k_z sin theta      kappa_y = k_y sin theta - k_z cos theta

What its energy has at fourth order in addition to the squares of the strains above is a table of its own, of strains
without names and stiffnesses of either sign (`fourth_order`), p = v' w'' and s = w' v'':

    V_4 = -1/2 [EIy p^2 - (EIy + EIz) p s + EIz s^2] - theta^2/2 [EIz v''^2 + EIy w''^2]

Where the axis keeps its length, (v'' / cos)^2 = v''^2 (1 + u')^-2, whose next term is
3 u'^2 v''^2; the square of v'' (1 - u') has one of the three. The other two are

    V_6 = EIz (u' v'')^2 + EIy (u' w'')^2

of sixth order in bends: without, a column 1.5 % beyond Euler's load bends 13 % too far, and soon collapses.

V_4 is nothing to bends in one plane without twist; a round section bends and twists alike about all axes with it.

Far bends. Of a strip, EIy >> EIz, what V_4 takes away soon outweighs all else. Bent about its weak axis and twisted it
lies where w'' = theta v'', which costs its stiff plane nothing; there -EIy theta^2 w''^2 / 2 is -EIy theta^4 v''^2 / 2,
of sixth order, and what would make it good, (k_y sin theta - k_z cos theta)^2 being a square, is of fifth and sixth
order too. No series of fourth order holds both: a column of 400 times the stiffness in its stiff plane loses its
stiffness against twist 1.3 % beyond Euler's load, and then runs away. With `far_bends` V_4 is that of the round section
within, of stiffness min(EIy, EIz); the rest of the energy is then squares alone. What is left out is the part of a bend
in the stiff plane that goes with the square of a twist: Prandtl's load comes 1 / (2 ratio) too high.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from femflex.arrays import Array, BoolArray
from femflex.fem.beam.corners import corner_gradients, corner_products
from femflex.fem.beam.elements import BeamElements, stations
from femflex.fem.sections.section import Resultants
from femflex.fem.tables import DenseStrain, StrainBlock, StressAt, of

if TYPE_CHECKING:
    from femflex.fem.structure import Member


PRODUCTS = (  # strain, two of its gradients (`strain_maps`), and their factor
    *((1, 6, 5, 1.0), (1, 0, 4, -1.0)),  # kappa_z: theta w'', u' v''
    *((2, 6, 4, 1.0), (2, 0, 5, 1.0)),  # kappa_y: theta v'', u' w''
    *((3, 8, 4, 0.5), (3, 7, 5, -0.5)),  # r kappa_x: r w' v'', r v' w''
)


FOURTH = (  # the strains of V_4, by two of those gradients each, and those that a stretched axis wants of V_6
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
ADDED, TAKEN = [0, 5, 6], [1, 2, 3, 4]  # which of them add energy, and which take it away


@dataclass(frozen=True, eq=False)
class BeamStrain(DenseStrain):
    """A strain block with the parts of fourth order that its energy has in addition to its strains.

    fourth (e, q, 7)   their stiffnesses (`fourth_order`)
    """

    fourth: Array = field(default_factory=lambda: np.zeros((1, 1, len(FOURTH))))

    def sampled(self, elements: slice) -> DenseStrain:
        """See StrainBlock: all strains in one, those of fourth order after those with names."""
        own = self._named(elements)
        shape, named = own.elastic.shape[:2], own.elastic.shape[2]
        fourth = np.broadcast_to(of(self.fourth, elements), (*shape, len(FOURTH)))
        stress = np.concatenate([np.broadcast_to(own.stress, (*shape, named)), 0.0 * fourth], axis=2)
        elastic = np.zeros((*shape, named + len(FOURTH), named + len(FOURTH)))
        elastic[..., :named, :named] = own.elastic
        elastic[..., named:, named:] = fourth[..., None] * np.eye(len(FOURTH))
        linear = np.concatenate([own.linear_map, np.zeros((len(FOURTH), own.linear_map.shape[1]))])
        products = _widened(product_maps(FOURTH), own.quadratic_map.shape[1])
        quadratic = np.concatenate([own.quadratic_map, products])
        return replace(own, elastic=elastic, linear_map=linear, quadratic_map=quadratic, stress=stress)

    def nonlinear(self, elements: slice, stress: StressAt | None = None) -> tuple[StrainBlock, ...]:
        """See StrainBlock; what adds energy at fourth order and what takes it away stand apart."""
        own, fourth = self._named(elements), of(self.fourth, elements)
        maps = _widened(product_maps(FOURTH), own.quadratic_map.shape[1])
        parts = (
            replace(
                own,
                elastic=fourth[..., k, None] * np.eye(len(maps[k])),
                linear_map=0.0 * maps[k, 0],
                quadratic_map=maps[k],
                stress=np.zeros((1, 1, 1)),
            )
            for k in (ADDED, TAKEN)
        )
        return (own if stress is None else replace(own, stress=stress(own)), *parts)

    def _named(self, elements: slice) -> DenseStrain:
        """The strains with names alone, of these elements."""
        elastic, G, stress = of(self.elastic, elements), of(self.G, elements), of(self.stress, elements)
        return DenseStrain(
            self.dofs[elements], self.weight[elements], elastic, self.linear_map, self.quadratic_map, G, stress
        )


@dataclass(frozen=True, eq=False)
class ShearStrain(DenseStrain):
    """The strains of a beam with its shears, and the stiffness of the shears and of their coupling to the others.

    named (e, q, 6, 6)   the stiffness of the others among themselves, which is not part of this block
    """

    named: Array = field(default_factory=lambda: np.zeros((1, 1, 6, 6)))

    def sampled(self, elements: slice) -> DenseStrain:
        """See StrainBlock."""
        own = super().sampled(elements)
        assert isinstance(own, ShearStrain)
        return replace(own, named=of(self.named, elements))

    def nonlinear(self, elements: slice, stress: StressAt | None = None) -> tuple[StrainBlock, ...]:
        """See StrainBlock; of strains that shear is coupled to, all that is positive and what is too much of it."""
        own, named = self.sampled(elements), of(self.named, elements)
        stressed = own if stress is None else replace(own, stress=stress(own))
        if not self.quadratic_map.any():
            return (stressed,)
        excess = replace(own, elastic=-named, stress=np.zeros((1, 1, 1)))
        return replace(stressed, elastic=own.elastic + named), excess


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
        quadratic[:4, :n, :n] = strain.quadratic_map  # which works on shear alone
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
    corners (e, 2): ends where beams meet at an angle (`femflex.fem.beam.corners`). stiffness (e, q, 6, 6): full one of
    the section over (eps, gamma_y, gamma_z, kappa_x, kappa_y, kappa_z), where it is coupled.
    """
    xi, weight, r = stations(elements, member, degree)
    value, first = (elements.rows(xi, derivative) for derivative in range(2))
    slope, second = elements.slopes(xi), elements.slopes(xi, 1)
    polar = np.sqrt(r.polar2)[..., None]
    first[:, :, 3] *= polar
    elastic = sectional_stiffness(r, stiffness)
    turned = np.stack([value[:, :, 3], polar * slope[:, :, 0], polar * slope[:, :, 1]], axis=2)
    G = np.concatenate([first, second, turned], axis=2)
    stress = np.zeros((*weight.shape, 4))
    stress[:, :, 0] = options["prestress"] - r.EA * options["thermal_strain"]
    if options["offset"] is not None:  # it acts at the centroid: eps + z kappa_y - y kappa_z
        y, z = options["offset"]
        stress[:, :, 1], stress[:, :, 2] = -y * stress[:, :, 0], z * stress[:, :, 0]
    found = fourth_order(r.EIy, r.EIz, r.polar2, bool(options["far_bends"]))
    fourth = np.broadcast_to(found, (*weight.shape, len(FOURTH)))
    linear, quadratic = strain_maps()
    if corners.any():
        products = corner_products(G.shape[2])
        G = np.concatenate([G, corner_gradients(elements, xi, corners)], axis=2)
        linear, quadratic = (_widened(table, G.shape[2]) for table in (linear, quadratic))
        set_products(quadratic, products)
    return BeamStrain(elements.dofs, weight, elastic, linear, quadratic, G, stress, fourth)


def _widened(table: Array, n: int) -> Array:
    """The table (s, g[, g]) with zeros for gradients up to n."""
    return np.pad(table, [(0, 0), *([(0, n - table.shape[1])] * (table.ndim - 1))])


def set_products(quadratic: Array, products: Sequence[tuple[int, int, int, float]]) -> None:
    """Set in the quadratic map (s, g, g) [1, m] strains' products of two gradients, with their factors."""
    for strain, row, column, value in products:
        quadratic[strain, [row, column], [column, row]] = value


def fourth_order(EIy: Array | float, EIz: Array | float, polar2: Array | float, far_bends: bool = False) -> Array:
    """Stiffnesses (..., 7): EIy p^2 - 2 m p s + EIz s^2 of V_4 from squares of one sign each, twist, and V_6."""
    added = np.stack(np.broadcast_arrays(2.0 * np.asarray(EIz), 2.0 * np.asarray(EIy), polar2)[:2], axis=-1)
    y, z = (np.minimum(EIy, EIz),) * 2 if far_bends else (np.asarray(EIy), np.asarray(EIz))
    mean = (y + z) / 2
    bends = mean / polar2, -(y + mean) / polar2, -(z + mean) / polar2
    return np.concatenate([np.stack(np.broadcast_arrays(*bends, -z, -y), axis=-1), added], axis=-1)


def product_maps(strains: Sequence[Sequence[tuple[int, int]]]) -> Array:
    """Quadratic map (n_strains, 9, 9) [1] of strains that are sums of products of two gradients."""
    found = np.zeros((len(strains), 9, 9))
    for own, products in zip(found, strains, strict=True):
        for row, column in products:
            own[[row, column], [column, row]] = 1.0
    return found


def strain_maps() -> tuple[Array, Array]:
    """Linear (4, 9) and quadratic map (4, 9, 9) [1] from (u', v', w', r theta', v'', w'', theta, r v', r w')."""
    linear, quadratic = np.zeros((4, 9)), np.zeros((4, 9, 9))
    linear[[0, 1, 2, 3], [0, 4, 5, 3]] = 1.0, 1.0, -1.0, 1.0
    quadratic[0, range(4), range(4)] = 1.0
    set_products(quadratic, PRODUCTS)
    return linear, quadratic
