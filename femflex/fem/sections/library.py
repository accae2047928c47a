"""Library of beam sections: area, second moments, torsion constant, outline and extreme fibres along the member.

Axes: y and z of the section, x along the beam; I_y = int z^2 dA bends in the x-z plane, I_z = int y^2 dA in x-y. The
origin is the centroid, the axes are principal, and the shear centre is taken to lie at the centroid.
Every dimension is a number, a table (s, values) or a formula of the arc length (see `evaluate_variation`).
"""

from __future__ import annotations

from dataclasses import replace
from typing import ClassVar, Literal

import numpy as np

from femflex.arrays import Array
from femflex.fem.sections import profiles
from femflex.fem.sections.materials import Material
from femflex.fem.sections.profiles import SectionProperties, semi_axis
from femflex.fem.sections.section import (
    AreaAlong,
    Dimensioned,
    ForceAlong,
    LengthAlong,
    MassAlong,
    Outline,
    Resultants,
    RigidityAlong,
    SecondMomentAlong,
    ellipse,
    polygon,
)

# Contribution of one square corner of a wall of unit thickness in addition to the straight walls that end at its inner
# edge: the first is exact by conformal mapping, the others are from finite elements (converged to the digits shown).
CORNER_FLUX = 1 - 2 / np.pi * np.log(2)
CORNER_VOLUME = 0.144834
CORNER_TORSION = 0.405824


class Shape(Dimensioned):
    """A section of one material that has an outline; round ones also have the shear stress of a torque."""

    is_round: ClassVar[bool] = False

    def properties(self, s: Array, length: Array | float) -> SectionProperties:
        """Area, second moments, torsion constant and extreme fibres at arc lengths s (...) [m]."""
        raise NotImplementedError

    def resultants(self, material: Material | None, s: Array, length: Array) -> Resultants:
        """Stiffness and mass per length of the section in this material, units of `Resultants`, s (...) [m]."""
        if material is None:
            raise ValueError(
                f"{type(self).__name__} needs a material; found none. Name one, or give the section by its stiffnesses "
                "(in a case kind = 'stiffness')."
            )
        p = self.properties(s, length)
        ry2, rz2 = p.Iy / p.A, p.Iz / p.A
        E, G = material.E, material.G
        GAy, GAz = (factor * G * p.A for factor in self.shear_factors(s, length, material.nu))
        mass = material.density * p.A
        return Resultants(E * p.A, G * p.J, E * p.Iy, E * p.Iz, mass, ry2, rz2, ry2 + rz2, GAy, GAz)

    def fibres(self, s: Array, length: Array | float) -> Array:
        """Stress at the extreme fibres per axial force, moment_z, moment_y and torque (..., 4) [1/m^2, 1/m^3].

        1/A, y_max/Iz, z_max/Iy, and of round sections R/J; NaN for others, whose largest shear is not at a corner.
        """
        p = self.properties(s, length)
        twisted = p.y_max / p.J if self.is_round else np.full(np.shape(p.A), np.nan)
        return np.stack(np.broadcast_arrays(1 / p.A, p.y_max / p.Iz, p.z_max / p.Iy, twisted), axis=-1)

    def shear_factors(self, s: Array, length: Array | float, nu: float) -> tuple[Array, Array]:
        """Shear factors k (...) [1] along y and z, shear force = k G A gamma; those of the properties where the shape
        has no formula of Poisson's ratio."""
        p = self.properties(s, length)
        return p.ky + 0 * p.A, p.kz + 0 * p.A


class Rectangle(Shape):
    """Solid rectangle: width along the section's y, height along its z."""

    kind: Literal["rectangle"] = "rectangle"
    """Selects this section: a solid rectangle."""
    width: LengthAlong
    """Outer width along the section's y axis."""
    height: LengthAlong
    """Outer height along the section's z axis."""

    def properties(self, s: Array, length: Array | float) -> SectionProperties:
        """Properties of the section at s, with the shapes and units of `SectionProperties`."""
        b, h = self.dimensions(s, length).values()
        return profiles.bar(h, b)

    def outline(self, s: Array, length: Array | float) -> Outline:
        """Polygon of the section (..., k, 2) [m] at s."""
        b, h = self.dimensions(s, length, pointed=True).values()
        return polygon(b[..., None] / 2 * [-1, 1, 1, -1], h[..., None] / 2 * [-1, -1, 1, 1])

    def shear_factors(self, s: Array, length: Array | float, nu: float) -> tuple[Array, Array]:
        """k_y and k_z [1], 10 (1 + nu) / (12 + 11 nu) (G. R. Cowper, J. Appl. Mech. 33 (1966) 335)."""
        k = np.full(np.shape(s), 10 * (1 + nu) / (12 + 11 * nu))
        return k, k


class Box(Shape):
    """Hollow rectangle: width along the section's y, height along its z."""

    kind: Literal["box"] = "box"
    """Selects this section: a hollow rectangle."""
    width: LengthAlong
    """Outer width along the section's y axis."""
    height: LengthAlong
    """Outer height along the section's z axis."""
    thickness: LengthAlong
    """Thickness of the walls."""

    def properties(self, s: Array, length: Array | float) -> SectionProperties:
        """Properties of the section at s, with the shapes and units of `SectionProperties`."""
        # Torsion by Prandtl's function phi in straight walls joined by square corners: J = 4 S^2 / C + J_0, with C the
        # flux between the wall's faces per unit of phi, S the volume under phi = 1 in the hole, J_0 twice that under
        # phi with both faces at zero. Four corners add 4 CORNER_* to the straight walls. Within 3e-4 of the exact value
        # for walls up to a fifth of the side, 2 % for a hole that closes (Bredt's thin wall alone: 4 % for a tenth of
        # the side).
        b, h, t = self.dimensions(s, length).values()
        check_wall(self, t, np.minimum(b, h) / 2, s)
        bi, hi = b - 2 * t, h - 2 * t
        straight = 2 * (bi + hi)
        flux = straight / t + 4 * CORNER_FLUX
        volume = bi * hi + straight * t / 2 + 4 * CORNER_VOLUME * t**2
        J = 4 * volume**2 / flux + straight * t**3 / 3 + 4 * CORNER_TORSION * t**4
        return replace(profiles.box(h, b, t, t, t, t), J=J)

    def outline(self, s: Array, length: Array | float) -> Outline:
        """Polygon of the section (..., k, 2) [m] at s."""
        return Rectangle(width=self.width, height=self.height).outline(s, length)


class Circle(Shape):
    """Solid round bar."""

    kind: Literal["circle"] = "circle"
    """Selects this section: a solid round bar."""
    radius: LengthAlong
    """Outer radius."""

    is_round: ClassVar[bool] = True

    def properties(self, s: Array, length: Array | float) -> SectionProperties:
        """Properties of the section at s, with the shapes and units of `SectionProperties`."""
        (r,) = self.dimensions(s, length).values()
        return profiles.ellipse(r, r)

    def outline(self, s: Array, length: Array | float) -> Outline:
        """Polygon of the section (..., k, 2) [m] at s."""
        (r,) = self.dimensions(s, length, pointed=True).values()
        return ellipse(r, r)

    def shear_factors(self, s: Array, length: Array | float, nu: float) -> tuple[Array, Array]:
        """k_y and k_z [1], 6 (1 + nu) / (7 + 6 nu) (Cowper)."""
        k = np.full(np.shape(s), 6 * (1 + nu) / (7 + 6 * nu))
        return k, k


class Tube(Shape):
    """Round tube."""

    kind: Literal["tube"] = "tube"
    """Selects this section: a round tube."""
    outer_radius: LengthAlong
    """Outer radius."""
    thickness: LengthAlong
    """Thickness of the wall."""

    is_round: ClassVar[bool] = True

    def properties(self, s: Array, length: Array | float) -> SectionProperties:
        """Properties of the section at s, with the shapes and units of `SectionProperties`."""
        R, t = self.dimensions(s, length).values()
        check_wall(self, t, R, s)
        return profiles.tube(R, t)

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


class ISection(Shape):
    """Doubly symmetric I: flanges along y, web along z."""

    kind: Literal["I"] = "I"
    """Selects this section: a doubly symmetric I."""
    width: LengthAlong
    """Outer width along the section's y axis."""
    height: LengthAlong
    """Outer height along the section's z axis."""
    flange: LengthAlong
    """Thickness of the flanges."""
    web: LengthAlong
    """Thickness of the web."""

    def properties(self, s: Array, length: Array | float) -> SectionProperties:
        """Properties of the section at s, with the shapes and units of `SectionProperties`."""
        # Torsion by Roark's Formulas for Stress and Strain (table of torsional constants, I section without fillets):
        # two flanges and the web as strips, with a correction by the circle inscribed where they meet.
        b, h, f, w = self.dimensions(s, length).values()
        check_wall(self, f, h / 2, s, "flange", "half the height")
        check_wall(self, w, b, s, "web", "the width")
        D = f + w**2 / (4 * f)  # circle through both re-entrant corners that touches the flange's outer face
        strips = 2 * b * f**3 * (1 / 3 - 0.21 * f / b * (1 - (f / b) ** 4 / 12)) + (h - 2 * f) * w**3 / 3
        J = strips + 2 * 0.15 * np.minimum(f, w) / np.maximum(f, w) * D**4
        return replace(profiles.turned_section(profiles.i_section(h, b, b, w, f, f)), J=J)

    def outline(self, s: Array, length: Array | float) -> Outline:
        """Polygon of the section (..., k, 2) [m] at s."""
        b, h, f, w = (v[..., None] / 2 for v in self.dimensions(s, length, pointed=True).values())
        inner = h - 2 * f
        y = np.concatenate([-b, b, b, w, w, b, b, -b, -b, -w, -w, -b], axis=-1)
        z = np.concatenate([-h, -h, -inner, -inner, inner, inner, h, h, inner, inner, -inner, -inner], axis=-1)
        strips = [(0, 1, 2, 11), (10, 3, 4, 9), (8, 5, 6, 7)]  # lower flange, web, upper flange
        triangles = [corner for a, b_, c, d in strips for corner in ((a, b_, c), (a, c, d))]
        return Outline(np.stack([y, z], axis=-1), np.array(triangles, np.int64))


class GivenSection(Shape):
    """A beam section by area and second moments; Iy bends in x-z, Iz in x-y."""

    kind: Literal["numbers"] = "numbers"
    """Selects this section: by its numbers."""
    A: AreaAlong
    """Area of the section."""
    Iy: SecondMomentAlong
    """Second moment of area about y; it bends in the x-z plane."""
    Iz: SecondMomentAlong
    """Second moment of area about z; it bends in the x-y plane."""
    J: SecondMomentAlong
    """Torsion constant."""
    y_max: LengthAlong | None = None
    """Largest distance of a fibre along y, for stresses and pictures. Default: that of an ellipse of the same A and
    Iz."""
    z_max: LengthAlong | None = None
    """Largest distance of a fibre along z, for stresses and pictures. Default: that of an ellipse of the same A and
    Iy."""

    def properties(self, s: Array, length: Array | float) -> SectionProperties:
        """Properties of the section at s, with the shapes and units of `SectionProperties`."""
        return self._by_numbers(self.dimensions(s, length))

    def outline(self, s: Array, length: Array | float) -> Outline:
        """Polygon of the section (..., k, 2) [m] at s."""
        p = self._by_numbers(self.dimensions(s, length, pointed=True))
        return ellipse(p.y_max, p.z_max)

    @staticmethod
    def _by_numbers(d: dict[str, Array]) -> SectionProperties:
        p = profiles.by_numbers(d["A"], d["Iz"], d["Iy"], d["J"])
        return replace(p, y_max=d.get("y_max", p.y_max), z_max=d.get("z_max", p.z_max))


class StiffnessSection(Dimensioned):
    """A beam by its stiffness and mass per length; needs no material."""

    kind: Literal["stiffness"] = "stiffness"
    """Selects this section: by its stiffnesses."""
    EA: ForceAlong
    """Axial stiffness."""
    EIy: RigidityAlong
    """Bending stiffness in the x-z plane."""
    EIz: RigidityAlong
    """Bending stiffness in the x-y plane."""
    GJ: RigidityAlong
    """Torsional stiffness."""
    mass_per_length: MassAlong
    """Mass per length."""
    ry: LengthAlong | None = None
    """Radius of gyration of the mass about y: root of int z^2 dm over the mass."""
    rz: LengthAlong | None = None
    """Radius of gyration of the mass about z: root of int y^2 dm over the mass."""
    area: AreaAlong | None = None
    """Area of the round bar that is drawn. Default: an ellipse with the stiffnesses' radii of gyration."""
    GAy: ForceAlong | None = None
    """Shear stiffness along y, shear factor included. Needed where the beam shears."""
    GAz: ForceAlong | None = None
    """Shear stiffness along z, shear factor included. Needed where the beam shears."""

    def resultants(self, material: Material | None, s: Array, length: Array) -> Resultants:
        """Stiffness and mass per length as `Resultants`, in SI; the material, if any, is not used."""
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
        return ellipse(semi_axis(d["EIz"], d["EA"]), semi_axis(d["EIy"], d["EA"]))


class CableSection(Dimensioned):
    """A cable, string or tether: axial stiffness and mass alone; the member needs no material."""

    kind: Literal["cable"] = "cable"
    """Selects this section: axial stiffness and mass per length, for tethers."""
    EA: ForceAlong
    """Axial stiffness."""
    mass_per_length: MassAlong
    """Mass per length."""

    def axial(self, s: Array, length: Array | float) -> tuple[Array, Array]:
        """EA (...) [N] and mass per length (...) [kg/m] at arc lengths s (...) [m]."""
        d = self.dimensions(s, length)
        return d["EA"], d["mass_per_length"]


def check_wall(
    section: Shape, wall: Array, limit: Array, s: Array, name: str = "thickness", what: str = "the half width"
) -> None:
    """Raise ValueError where a wall (...) [m] at arc length s (...) [m] is thicker than its limit (...) [m]."""
    over = wall > limit * (1 + 1e-12)
    if over.any():
        raise ValueError(
            f"{name} of {type(section).__name__} is {wall[over].flat[0]:.6g} m at s = {s[over].flat[0]:.6g} m, more "
            f"than {what} {limit[over].flat[0]:.6g} m; make the wall thinner or the section larger"
        )
