"""Nonlinear strain of a straight beam on admissible functions, with the measure of a meshed beam (`fem.beam.strain`).

eps = u' + 1/2 (u'^2 + v'^2 + w'^2 + (I_p / A) theta'^2), I_p / A = ry^2 + rz^2, with stiffness EA; the curvatures of
large deflections; and, with torsion functions, the twist rate of a rotating section to third order in the energy, by
which a beam bent in its stiff plane buckles laterally. Without torsion functions the beam cannot twist, and bending in
two planes causes no twist.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from femflex.arrays import Array
from femflex.body import StrainTensors
from femflex.body.symmetric import packed
from femflex.fem.beam.strain import FOURTH, fourth_order_stiffnesses, product_maps, strain_maps
from femflex.reduction.beams.beam_functions import gauss
from femflex.reduction.beams.uniform_beam import BeamFunctions, UniformBeam
from femflex.reduction.strain.tensors import packed_quartic, require_room


@dataclass(frozen=True, eq=False)
class BeamStrains:
    """Strains (s,) of a beam at points along it: linear @ rows + 1/2 rows quadratic rows.

    xi, dx      (p,)          points over the length; their part of it [m]
    rows        (p, 9, n)     gradients of the columns, as listed by `fem.beam.strain.strain_maps`
    linear      (s, 9)
    quadratic   (s, 9, 9)
    stiffness   (p, s)        of (eps, kappa_z, kappa_y, r kappa_x), r^2 = I_p / A, and seven more
                              (`fourth_order_stiffnesses`)
    polar       ()            r [m], 1 where the beam has no I_p
    """

    xi: Array
    dx: Array
    rows: Array
    linear: Array
    quadratic: Array
    stiffness: Array
    polar: float


def beam_strains(beam: UniformBeam, functions: BeamFunctions, X: Array, following: bool) -> BeamStrains:
    """The strains of the functions times X (count, n) [kg^-1/2].

    following: whether stretch will be dependent on bending (reduction.condense). Then u' is as small as v'^2. Its
    square is left out, and all fourth-order terms of the curvature of an inextensible beam replace u'v'' and u'w'' in
    the curvatures, which is correct for any axial stiffness.
    """
    xi, weight = gauss(2 * functions.max_count + 24)
    value, slope, curvature = (functions.fields(xi, beam.length, derivative) @ X for derivative in range(3))
    polar = float(np.hypot(beam.ry, beam.rz)) or 1.0
    slope[:, 3] *= polar
    turned = np.stack([value[:, 3], polar * slope[:, 1], polar * slope[:, 2]], axis=1)
    linear, quadratic = strain_maps()
    if not functions.torsion:
        quadratic[3] = 0.0
    fourth, weights = (
        product_maps(FOURTH),
        fourth_order_stiffnesses(beam.EIy, beam.EIz, polar**2, bool(beam.bounded_energy)),
    )
    if following:
        quadratic[:, 0], quadratic[:, :, 0] = 0.0, 0.0
        fourth[:3], weights[:3] = inextensible(beam, polar**2)
        weights[5:] = 0.0
    bending, axial = beam.taper.bending(xi), beam.taper.axial(xi)
    stiffness = [beam.EA * axial, *np.outer([beam.EIz, beam.EIy, beam.GJ / polar**2, *weights], bending)]
    rows = np.concatenate([slope, curvature[:, 1:3], turned], axis=1)
    linear = np.concatenate([linear, np.zeros((len(fourth), linear.shape[1]))])
    quadratic = np.concatenate([quadratic, fourth])
    return BeamStrains(xi, weight * beam.length, rows, linear, quadratic, np.stack(stiffness, axis=1), polar)


def inextensible(beam: UniformBeam, polar2: float) -> tuple[Array, Array]:
    """Maps (3, 9, 9) and stiffnesses (3,) [N m^2] of strains in a = v'v'' and b = w'w'' of an inextensible beam.

    Their energy is that of its third-order curvature, (a + b) (EIz a + EIy b) / 2. With bounded_energy the product a b
    has the smaller of the two stiffnesses; with their mean, strips that bend about a skew axis would lose energy.
    """
    shared = min(beam.EIy, beam.EIz) if beam.bounded_energy else (beam.EIy + beam.EIz) / 2
    maps = product_maps((((7, 4), (8, 5)), ((7, 4),), ((8, 5),)))
    return maps, np.array([shared, beam.EIz - shared, beam.EIy - shared]) / polar2


def beam_strain(
    beam: UniformBeam, functions: BeamFunctions, X: Array, V1: Array, own: int
) -> tuple[StrainTensors, Array]:
    """Strain tensors over the functions times X (count, n) with the given V1 (n, n) [1/s^2], and packed V3 of the first
    `own` of them; see `beam_strains` for the terms.

    The functions after the first `own` are dependent: their products do not strain the beam. If there are any, the
    tensors leave V3 out. Raises ValueError where the tensors would take too much memory.
    """
    n, following = X.shape[1], own < X.shape[1]
    require_room(own)
    strains = beam_strains(beam, functions, X, following)
    i, j = np.triu_indices(own)
    cubic, quartic = np.zeros((n, len(i))), np.zeros((len(i), len(i)))
    for linear, quadratic, stiffness in zip(strains.linear, strains.quadratic, strains.stiffness.T, strict=True):
        if quadratic.any() and stiffness.any():
            rows, weight = strains.rows[:, :, :own], strains.dx * stiffness
            products = 0.5 * pairs(rows, quadratic @ rows)
            strained = np.flatnonzero(products.any(axis=0))
            products = products[:, strained]
            cubic[:, strained] += (linear @ strains.rows).T @ (weight[:, None] * products)
            quartic[np.ix_(strained, strained)] += weighted_square(products, weight)
    V2 = np.zeros((n, n, n))
    V2[:, i, j] = V2[:, j, i] = cubic
    V3 = packed_quartic(quartic, own)
    return StrainTensors(V1, np.zeros(n), packed(V2), np.zeros(0) if following else V3), V3


def pairs(a: Array, b: Array) -> Array:
    """Symmetric part of sum_r a_ri b_rj for i <= j, (p, n(n+1)/2), of rows (p, r, n)."""
    product = np.einsum("pri,prj->pij", a, b, optimize=True)
    i, j = np.triu_indices(a.shape[2])
    return np.asarray(0.5 * (product[:, i, j] + product[:, j, i]))


def weighted_square(columns: Array, weight: Array) -> Array:
    """columns^T diag(weight) columns (n, n), weight (p,) in any unit."""
    return np.asarray(columns.T @ (weight[:, None] * columns))
