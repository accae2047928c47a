"""Material of a member that is drawn out of its parent: its shapes over the scaled length, and all of its inertia.

A material point at the distance x = xi L from the exit sits at z_A y_A with y = (1, delta), and z_A(xi, L) is a sum of
terms Z_A(xi) lambda^p, lambda = L / L_0. Its velocity at constant y is lambdadot chi_A y_A with

    chi = sum [ (1 - xi) dZ/dxi + p Z ] lambda^(p - 1)      drum at the root: the point keeps its distance from the tip
    chi = sum [     -xi  dZ/dxi + p Z ] lambda^(p - 1)      drum at the tip: the point keeps its distance from the root

(THEORY section 6: phi' U (1 - x/L) / L). Stowed material is mass at the drum, so the mass of the whole is constant; at
the root it is at rest, at the tip it moves with the tip. All integrals over the mass are series in lambda. Of

    X = int chi dm        Y = int z chi^T dm        C = int chi chi^T dm

the material flow of `femflex.system.variation` is

    drift = lambdadot X        kick = lambdaddot X + lambdadot^2 dX/dlambda
    flow  = lambdadot Y        turn = lambdaddot Y + lambdadot^2 (dY/dlambda - C)
    speed = lambdadot^2 tr C   its rate = 2 lambdadot lambdaddot tr C + lambdadot^3 d(tr C)/dlambda

because the rate of int f dm over all points is int df/dt dm plus the jump of f where points are picked up: dX/dlambda
contains the momentum flux at the exit.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from femflex.arrays import Array
from femflex.deployment.series import Series, added, derivative, mapped, product, scaled


@dataclass(frozen=True, eq=False)
class MaterialPoints:
    """Positions of the material points of sections at xi (k,): z = sum_p values_p lambda^p.

    xi      (k,)                 distance from the exit over the length
    share   (k,)                 part of the mass; of the member's mass per lambda for the deployed material, of the
                                 stowed mass for that at the drum
    values  p -> (k, 3, 1 + n)   position and shapes, body frame
    slopes  p -> (k, 3, 1 + n)   their derivatives by xi
    """

    xi: Array
    share: Array
    values: Series
    slopes: Series

    def velocities(self, at_tip: bool) -> Series:
        """chi, the velocities per rate of lambda."""
        xi_rate = (-self.xi if at_tip else 1.0 - self.xi)[:, None, None]
        return {p - 1: xi_rate * self.slopes[p] + p * value for p, value in self.values.items()}

    def section_velocities(self) -> Series:
        """Velocities per rate of lambda of places that keep their xi."""
        return derivative(self.values)


@dataclass(frozen=True, eq=False)
class Inertia:
    """Moments and material flow over (rho, shapes) as series in lambda.

    mass        total mass [kg]
    first       (1+n, 3)            int z dm
    second      (1+n, 3, 1+n, 3)    int z z^T dm
    drift       (1+n, 3)            X, see this module
    flow        (1+n, 3, 1+n, 3)    Y
    speed       (1+n, 3, 1+n, 3)    C
    pickup      (1+n, 1+n)          mass picked up per lambda, times chi . chi of its jump in velocity
    """

    mass: float
    first: Series
    second: Series
    drift: Series
    flow: Series
    speed: Series
    pickup: Series


def inertia_of(deployed: MaterialPoints, stowed: MaterialPoints, member: float, total: float, at_tip: bool) -> Inertia:
    """Return the inertia of deployed material, `member` lambda of mass [kg], and of the stowed rest of the total.

    deployed, stowed: all points of the member, and those of one section at the drum; shares sum to one.
    """
    w, v = member * deployed.share, stowed.share
    z, chi = deployed.values, deployed.velocities(at_tip)
    z0, chi0 = stowed.values, stowed.section_velocities() if at_tip else {}

    def stowed_part(series: Series) -> Series:
        return added(scaled(series, total), scaled(series, -member, 1))

    def combined(moving: Series, still: Series) -> Series:
        return added(scaled(moving, 1.0, 1), stowed_part(still))

    def first_of(a: Series, share: Array) -> Series:
        return mapped(a, lambda value: np.einsum("k,kaA->Aa", share, value))

    def second_of(a: Series, b: Series, share: Array) -> Series:
        return product(a, b, lambda x, y: np.einsum("k,kaA,kbB->AaBb", share, x, y, optimize=True))

    jump = added(stowed.velocities(at_tip), scaled(chi0, -1.0))
    return Inertia(
        mass=total,
        first=combined(first_of(z, w), first_of(z0, v)),
        second=combined(second_of(z, z, w), second_of(z0, z0, v)),
        drift=combined(first_of(chi, w), first_of(chi0, v)),
        flow=combined(second_of(z, chi, w), second_of(z0, chi0, v)),
        speed=combined(second_of(chi, chi, w), second_of(chi0, chi0, v)),
        pickup=product(jump, jump, lambda x, y: member * np.einsum("k,kaA,kaB->AB", v, x, y)),
    )
