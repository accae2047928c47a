"""Library of beam sections: area, second moments, torsion constant, outline and extreme fibres along the member.

Axes: y and z of the section, x along the beam; I_y = int z^2 dA bends in the x-z plane, I_z = int y^2 dA in x-y. The
origin is the centroid, the axes are principal, and the shear centre is taken to lie at the centroid.
Every dimension is a number, a table (s, values) or a formula of the arc length (see `evaluate_variation`).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from femflex.arrays import Array
from femflex.fem.sections.materials import Material
from femflex.fem.sections.section import (
    Dimensioned,
    Outline,
    Resultants,
    SectionProperties,
    Shape,
    check_wall,
    ellipse,
    polygon,
)
from femflex.fem.variation import Variation

ZETA_5 = 1.0369277551433699  # sum of 1 / n^5
# Contribution of one square corner of a wall of unit thickness in addition to the straight walls that end at its inner
# edge: the first is exact by conformal mapping, the others are from finite elements (converged to the digits shown).
CORNER_FLUX = 1 - 2 / np.pi * np.log(2)
CORNER_VOLUME = 0.144834
CORNER_TORSION = 0.405824


@dataclass(frozen=True, eq=False)
class Rectangle(Shape):
    """Solid rectangle: width along y, height along z [m]. Torsion by the exact series."""

    width: Variation
    height: Variation

    def properties(self, s: Array, length: Array | float) -> SectionProperties:
        """Properties of the section at s, with the shapes and units of `SectionProperties`."""
        b, h = self.dimensions(s, length).values()
        return SectionProperties(b * h, b * h**3 / 12, h * b**3 / 12, rectangle_torsion(b, h), b / 2, h / 2)

    def outline(self, s: Array, length: Array | float) -> Outline:
        """Polygon of the section (..., k, 2) [m] at s."""
        b, h = self.dimensions(s, length, pointed=True).values()
        return polygon(b[..., None] / 2 * [-1, 1, 1, -1], h[..., None] / 2 * [-1, -1, 1, 1])

    def shear_factors(self, s: Array, length: Array | float, nu: float) -> tuple[Array, Array]:
        """k_y and k_z [1], 10 (1 + nu) / (12 + 11 nu) (G. R. Cowper, J. Appl. Mech. 33 (1966) 335)."""
        k = np.full(np.shape(s), 10 * (1 + nu) / (12 + 11 * nu))
        return k, k


@dataclass(frozen=True, eq=False)
class Box(Shape):
    """Hollow rectangle: outer width along y, outer height along z, wall thickness [m].

    Torsion by Prandtl's function phi in straight walls joined by square corners: J = 4 S^2 / C + J_0, with C the flux
    between the wall's faces per unit of phi, S the volume under phi = 1 in the hole, J_0 twice that under phi with both
    faces at zero. Four corners add 4 CORNER_* to the straight walls. Within 3e-4 of the exact value for walls up to a
    fifth of the side, 2 % for a hole that closes (Bredt's thin wall alone: 4 % for a tenth of the side).
    """

    width: Variation
    height: Variation
    thickness: Variation

    def properties(self, s: Array, length: Array | float) -> SectionProperties:
        """Properties of the section at s, with the shapes and units of `SectionProperties`."""
        b, h, t = self.dimensions(s, length).values()
        check_wall(self, t, np.minimum(b, h) / 2, s)
        bi, hi = b - 2 * t, h - 2 * t
        straight = 2 * (bi + hi)
        flux = straight / t + 4 * CORNER_FLUX
        volume = bi * hi + straight * t / 2 + 4 * CORNER_VOLUME * t**2
        J = 4 * volume**2 / flux + straight * t**3 / 3 + 4 * CORNER_TORSION * t**4
        return SectionProperties(
            b * h - bi * hi, (b * h**3 - bi * hi**3) / 12, (h * b**3 - hi * bi**3) / 12, J, b / 2, h / 2
        )

    def outline(self, s: Array, length: Array | float) -> Outline:
        """Polygon of the section (..., k, 2) [m] at s."""
        return Rectangle(self.width, self.height).outline(s, length)

    def shear_factors(self, s: Array, length: Array | float, nu: float) -> tuple[Array, Array]:
        """The walls along each direction over the whole section [1], shapes as in `Shape`."""
        b, h, t = self.dimensions(s, length).values()
        A = b * h - (b - 2 * t) * (h - 2 * t)
        return 2 * b * t / A, 2 * h * t / A


@dataclass(frozen=True, eq=False)
class Circle(Shape):
    """Solid circle of this radius [m]."""

    radius: Variation
    is_round = True

    def properties(self, s: Array, length: Array | float) -> SectionProperties:
        """Properties of the section at s, with the shapes and units of `SectionProperties`."""
        (r,) = self.dimensions(s, length).values()
        I = np.pi / 4 * r**4
        return SectionProperties(np.pi * r**2, I, I, 2 * I, r, r)

    def outline(self, s: Array, length: Array | float) -> Outline:
        """Polygon of the section (..., k, 2) [m] at s."""
        (r,) = self.dimensions(s, length, pointed=True).values()
        return ellipse(r, r)

    def shear_factors(self, s: Array, length: Array | float, nu: float) -> tuple[Array, Array]:
        """k_y and k_z [1], 6 (1 + nu) / (7 + 6 nu) (Cowper)."""
        k = np.full(np.shape(s), 6 * (1 + nu) / (7 + 6 * nu))
        return k, k


@dataclass(frozen=True, eq=False)
class Tube(Shape):
    """Round tube: outer radius and wall thickness [m]."""

    outer_radius: Variation
    thickness: Variation
    is_round = True

    def properties(self, s: Array, length: Array | float) -> SectionProperties:
        """Properties of the section at s, with the shapes and units of `SectionProperties`."""
        R, t = self.dimensions(s, length).values()
        check_wall(self, t, R, s)
        r = R - t
        I = np.pi / 4 * (R**2 + r**2) * (R + r) * t  # (R^4 - r^4), without cancellation for thin walls
        return SectionProperties(np.pi * (R + r) * t, I, I, 2 * I, R, R)

    def outline(self, s: Array, length: Array | float) -> Outline:
        """Polygon of the section (..., k, 2) [m] at s."""
        R = self.dimensions(s, length, pointed=True)["outer_radius"]
        return ellipse(R, R)

    def shear_factors(self, s: Array, length: Array | float, nu: float) -> tuple[Array, Array]:
        """6 (1 + nu) (1 + m^2)^2 / ((7 + 6 nu) (1 + m^2)^2 + (20 + 12 nu) m^2) (Cowper); m = inner over outer
        radius."""
        R, t = self.dimensions(s, length).values()
        m2 = ((R - t) / R) ** 2
        k = 6 * (1 + nu) * (1 + m2) ** 2 / ((7 + 6 * nu) * (1 + m2) ** 2 + (20 + 12 * nu) * m2)
        return k, k


@dataclass(frozen=True, eq=False)
class ISection(Shape):
    """Doubly symmetric I: flanges along y, `width` wide and `flange` thick; web along z; `height` over all [m].

    Torsion by Roark's Formulas for Stress and Strain (table of torsional constants, I section without fillets):
    two flanges and the web as strips, with a correction by the circle inscribed where they meet.
    """

    width: Variation
    height: Variation
    flange: Variation
    web: Variation

    def properties(self, s: Array, length: Array | float) -> SectionProperties:
        """Properties of the section at s, with the shapes and units of `SectionProperties`."""
        b, h, f, w = self.dimensions(s, length).values()
        check_wall(self, f, h / 2, s, "flange", "half the height")
        check_wall(self, w, b, s, "web", "the width")
        hi = h - 2 * f
        A = b * h - (b - w) * hi
        Iy = (b * h**3 - (b - w) * hi**3) / 12
        Iz = (2 * f * b**3 + hi * w**3) / 12
        D = f + w**2 / (4 * f)  # circle through both re-entrant corners that touches the flange's outer face
        strips = 2 * b * f**3 * (1 / 3 - 0.21 * f / b * (1 - (f / b) ** 4 / 12)) + hi * w**3 / 3
        J = strips + 2 * 0.15 * np.minimum(f, w) / np.maximum(f, w) * D**4
        return SectionProperties(A, Iy, Iz, J, b / 2, h / 2)

    def outline(self, s: Array, length: Array | float) -> Outline:
        """Polygon of the section (..., k, 2) [m] at s."""
        b, h, f, w = (v[..., None] / 2 for v in self.dimensions(s, length, pointed=True).values())
        inner = h - 2 * f
        y = np.concatenate([-b, b, b, w, w, b, b, -b, -b, -w, -w, -b], axis=-1)
        z = np.concatenate([-h, -h, -inner, -inner, inner, inner, h, h, inner, inner, -inner, -inner], axis=-1)
        strips = [(0, 1, 2, 11), (10, 3, 4, 9), (8, 5, 6, 7)]  # lower flange, web, upper flange
        triangles = [corner for a, b_, c, d in strips for corner in ((a, b_, c), (a, c, d))]
        return Outline(np.stack([y, z], axis=-1), np.array(triangles, np.int64))

    def shear_factors(self, s: Array, length: Array | float, nu: float) -> tuple[Array, Array]:
        """k_y and k_z (...) [1]: along y 5/6 of the flanges, along z the web over the height, over the whole
        section."""
        d = self.dimensions(s, length)
        A = self.properties(s, length).A
        return 5 / 3 * d["width"] * d["flange"] / A, d["height"] * d["web"] / A


@dataclass(frozen=True, eq=False)
class GivenSection(Shape):
    """A section by its numbers: A [m^2], Iy, Iz, J [m^4]; extreme fibres y_max, z_max [m] if known.

    Without extreme fibres those of the solid ellipse of the same radii of gyration are used, which is also drawn.
    """

    A: Variation
    Iy: Variation
    Iz: Variation
    J: Variation
    y_max: Variation | None = None
    z_max: Variation | None = None

    def properties(self, s: Array, length: Array | float) -> SectionProperties:
        """Properties of the section at s, with the shapes and units of `SectionProperties`."""
        d = self.dimensions(s, length)
        y_max, z_max = self._fibres(d)
        return SectionProperties(d["A"], d["Iy"], d["Iz"], d["J"], y_max, z_max)

    def outline(self, s: Array, length: Array | float) -> Outline:
        """Polygon of the section (..., k, 2) [m] at s."""
        return ellipse(*self._fibres(self.dimensions(s, length, pointed=True)))

    @staticmethod
    def _fibres(d: dict[str, Array]) -> tuple[Array, Array]:
        y_max = d["y_max"] if "y_max" in d else _semi_axis(d["Iz"], d["A"])
        return y_max, d["z_max"] if "z_max" in d else _semi_axis(d["Iy"], d["A"])


@dataclass(frozen=True, eq=False)
class StiffnessSection(Dimensioned):
    """A beam by its stiffness and mass: EA [N], EIy, EIz, GJ [N m^2], mass per length [kg/m]; no material is used.

    ry, rz  radii of gyration of the mass, sqrt(int z^2 dm), sqrt(int y^2 dm) per mass [m]; without them those of the
            stiffness, sqrt(EIy / EA) and sqrt(EIz / EA)
    area    of the round bar that is drawn [m^2]; without it a solid ellipse of the stiffness's radii of gyration
    GAy, GAz  shear stiffness along y and z, shear factors included [N]; needed where the beam shears
    """

    EA: Variation
    EIy: Variation
    EIz: Variation
    GJ: Variation
    mass_per_length: Variation
    ry: Variation | None = None
    rz: Variation | None = None
    area: Variation | None = None
    GAy: Variation | None = None
    GAz: Variation | None = None

    def resultants(self, material: Material | None, s: Array, length: Array) -> Resultants:
        """Stiffness and mass per length as `Resultants`; the material, if any, is not used."""
        d = self.dimensions(s, length)
        stiff_ry2, stiff_rz2 = d["EIy"] / d["EA"], d["EIz"] / d["EA"]
        ry2, rz2 = (d[n] ** 2 if n in d else r for n, r in (("ry", stiff_ry2), ("rz", stiff_rz2)))
        polar2 = stiff_ry2 + stiff_rz2
        shear = d.get("GAy"), d.get("GAz")
        return Resultants(d["EA"], d["GJ"], d["EIy"], d["EIz"], d["mass_per_length"], ry2, rz2, polar2, *shear)

    def outline(self, s: Array, length: Array | float) -> Outline:
        """Polygon of the section (..., k, 2) [m] at s."""
        d = self.dimensions(s, length, pointed=True)
        if "area" in d:
            radius = np.sqrt(d["area"] / np.pi)
            return ellipse(radius, radius)
        return ellipse(_semi_axis(d["EIz"], d["EA"]), _semi_axis(d["EIy"], d["EA"]))


@dataclass(frozen=True, eq=False)
class CableSection(Dimensioned):
    """A cable by its axial stiffness EA [N] and mass per length [kg/m]; for tethers alone, without a material."""

    EA: Variation
    mass_per_length: Variation

    def axial(self, s: Array, length: Array | float) -> tuple[Array, Array]:
        """EA (...) [N] and mass per length (...) [kg/m] at arc lengths s (...) [m]."""
        d = self.dimensions(s, length)
        return d["EA"], d["mass_per_length"]


def rectangle_torsion(width: Array, height: Array) -> Array:
    """Torsion constant of solid rectangles [m^4], exact to rounding.

    J = a b^3 [1/3 - (64 / pi^5)(b / a) sum_{n odd} tanh(n pi a / 2b) / n^5], b <= a (Timoshenko & Goodier, Theory of
    Elasticity, art. 109). With tanh = 1 - (1 - tanh) the first part sums to 31/32 zeta(5), the rest falls as e^(-n pi).
    """
    a, b = np.maximum(width, height), np.minimum(width, height)
    n = np.arange(1, 14, 2)
    rest = 2 / (np.exp(np.minimum(n * np.pi * (a / b)[..., None], 700.0)) + 1)  # 1 - tanh(x) = 2 / (e^2x + 1)
    total = 31 / 32 * ZETA_5 - (rest / n**5).sum(axis=-1)
    return np.asarray(a * b**3 * (1 / 3 - 64 / np.pi**5 * (b / a) * total))


def _semi_axis(I: Array, A: Array) -> Array:
    """Semi-axis of the solid ellipse with radius of gyration sqrt(I / A); zero at a pointed tip."""
    return 2 * np.sqrt(np.divide(I, A, out=np.zeros_like(I), where=A > 0))
