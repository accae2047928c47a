"""Shapes of beam sections by their dimensions: area, second moments, torsion, shear and extreme fibres.

Cases, Nastran and Abaqus give their dimensions to the same shapes. Axes are those of sections: Iz = int y^2 dA bends in
x-y, Iy = int z^2 dA in x-z. Most shapes are unions and differences of rectangles, whose area and second moments are
exact. J of open ones is sum b t^3 / 3 over their walls, of closed ones Bredt's 4 A^2 / (sum s / t). A dimension is a
number or an array over stations, in any unit of length.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import chain
from typing import Any

import numpy as np

from femflex.arrays import Array

Size = Any  # a float, or an Array over stations
Place = tuple[float, float]  # y, z
Part = tuple[Size, Size, Size, Size, int]  # y and z of a rectangle's centre, width along y and along z, +1 or -1

SYMMETRIC = 1e-9  # product of inertia, relative to the moments, up to which the axes are principal
ZETA_5 = 1.0369277551433699  # sum of 1 / n^5


@dataclass(frozen=True, eq=False)
class SectionProperties:
    """Properties of a section about its centroid; every field is a number, or has the shape of the stations.

    A                area [m^2]
    Iz, Iy           int y^2 dA, int z^2 dA [m^4]
    J                torsion constant [m^4]
    y_max, z_max     extreme fibres: largest |y| and |z| of the section [m]
    Iyz              int y z dA [m^4]
    ky, kz           shear factors along y and z [1]
    centroid         y and z in the drawing of the shape [m]
    """

    A: Size
    Iz: Size
    Iy: Size
    J: Size
    y_max: Size
    z_max: Size
    Iyz: Size = 0.0
    ky: Size = 5 / 6
    kz: Size = 5 / 6
    centroid: tuple[Size, Size] = (0.0, 0.0)


def principal_moments(Iz: float, Iy: float, Iyz: float) -> tuple[float, float, float]:
    """Angle [rad] from the y axis to a principal axis, and int y^2 dA and int z^2 dA along the principal axes.

    With y = c y' - s z', int y' z' dA vanishes in axes turned by alpha, tan 2 alpha = 2 Iyz / (Iz - Iy).
    """
    if abs(Iyz) < SYMMETRIC * (Iz + Iy) or Iyz == 0:
        return 0.0, Iz, Iy
    mean, radius = (Iz + Iy) / 2, math.hypot((Iz - Iy) / 2, Iyz)
    return 0.5 * math.atan2(2 * Iyz, Iz - Iy), mean + radius, mean - radius


def _of_rectangles(parts: Sequence[Part], J: Size, upright: Size, across: Size) -> SectionProperties:
    """A shape of rectangles; `upright` and `across` are the areas that carry shear along y and along z."""
    numbers = np.array(np.broadcast_arrays(*chain(*parts)), float)
    y, z, b, c, sign = (numbers[k::5] for k in range(5))
    areas = sign * b * c
    A = areas.sum(axis=0)
    y0, z0 = (areas * y).sum(axis=0) / A, (areas * z).sum(axis=0) / A
    y, z = y - y0, z - z0
    Iz = (sign * c * b**3 / 12 + areas * y**2).sum(axis=0)
    Iy = (sign * b * c**3 / 12 + areas * z**2).sum(axis=0)
    y_max, z_max = np.max(np.abs(y) + b / 2, axis=0), np.max(np.abs(z) + c / 2, axis=0)
    ky, kz = np.minimum(upright / A, 1.0), np.minimum(across / A, 1.0)
    return SectionProperties(A, Iz, Iy, J, y_max, z_max, (areas * y * z).sum(axis=0), ky, kz, (y0, z0))


def _strips(*walls: tuple[Size, Size]) -> Size:
    """J of open walls, each by its length and thickness."""
    return sum(length * t**3 for length, t in walls) / 3


def ellipse(a: Size, b: Size) -> SectionProperties:
    """Solid ellipse with semi-axes a along y and b along z; the shear factor is that of a round bar."""
    A = math.pi * a * b
    return SectionProperties(A, A * a**2 / 4, A * b**2 / 4, A * (a * b) ** 2 / (a**2 + b**2), a, b, ky=0.9, kz=0.9)


def tube(outer: Size, thickness: Size) -> SectionProperties:
    """Round tube with this outer radius."""
    inner = outer - thickness
    I = math.pi / 4 * (outer**2 + inner**2) * (outer + inner) * thickness  # (R^4 - r^4), precise for thin walls
    return SectionProperties(math.pi * (outer + inner) * thickness, I, I, 2 * I, outer, outer, ky=0.5, kz=0.5)


def bar(w: Size, h: Size) -> SectionProperties:
    """Solid rectangle, w along z and h along y.

    J = a b^3 [1/3 - (64 / pi^5)(b / a) sum_{n odd} tanh(n pi a / 2b) / n^5], b <= a, exact to rounding (Timoshenko &
    Goodier, Theory of Elasticity, art. 109). With tanh = 1 - (1 - tanh) the first part sums to 31/32 zeta(5), the rest
    falls as e^(-n pi).
    """
    a, b = np.maximum(w, h), np.minimum(w, h)
    n = np.arange(1, 14, 2)
    rest = 2 / (np.exp(np.minimum(n * np.pi * np.asarray(a / b)[..., None], 700.0)) + 1)  # 1 - tanh x = 2 / (e^2x + 1)
    total = 31 / 32 * ZETA_5 - (rest / n**5).sum(axis=-1)
    J = a * b**3 * (1 / 3 - 64 / np.pi**5 * (b / a) * total)
    return SectionProperties(w * h, w * h**3 / 12, h * w**3 / 12, J, h / 2, w / 2)


def box(w: Size, h: Size, top: Size, bottom: Size, left: Size, right: Size) -> SectionProperties:
    """Box, w along z and h along y over all, drawn about its middle; `left` is the wall towards -z."""
    y, z = (bottom - top) / 2, (left - right) / 2
    a, b = w - (left + right) / 2, h - (top + bottom) / 2
    J = 4 * (a * b) ** 2 / (a / top + a / bottom + b / left + b / right)
    parts: list[Part] = [(0, 0, h, w, 1), (y, z, h - top - bottom, w - left - right, -1)]
    return _of_rectangles(parts, J, (left + right) * h, (top + bottom) * w)


def i_section(h: Size, bottom: Size, top: Size, web: Size, t_bottom: Size, t_top: Size) -> SectionProperties:
    """Flanges along z, and a web along y, drawn about half the height."""
    parts: list[Part] = [
        ((t_bottom - h) / 2, 0, t_bottom, bottom, 1), ((h - t_top) / 2, 0, t_top, top, 1),
        ((t_bottom - t_top) / 2, 0, h - t_bottom - t_top, web, 1),
    ]  # fmt: skip
    J = _strips((bottom, t_bottom), (top, t_top), (h - (t_bottom + t_top) / 2, web))
    return _of_rectangles(parts, J, web * h, 5 / 6 * (bottom * t_bottom + top * t_top))


def h_section(inner: Size, walls: Size, h: Size, t: Size) -> SectionProperties:
    """Two upright walls, together `walls` thick, `inner` apart, joined by a web across, t thick."""
    half = walls / 2
    z = (inner + half) / 2
    parts: list[Part] = [(0, -z, h, half, 1), (0, z, h, half, 1), (0, 0, t, inner, 1)]
    J = _strips((2 * h, half), (inner, t))
    return _of_rectangles(parts, J, walls * h * 5 / 6, t * (inner + walls))


def tee(flange: Size, h: Size, t: Size, web: Size) -> SectionProperties:
    """Flange at the top along z, drawn about its middle, and web below it."""
    parts: list[Part] = [(0, 0, t, flange, 1), (-h / 2, 0, h - t, web, 1)]
    return _of_rectangles(parts, _strips((flange, t), (h - t / 2, web)), web * h, 5 / 6 * flange * t)


def lying_tee(h: Size, length: Size, web: Size, flange: Size) -> SectionProperties:
    """Flange upright (h along y, `flange` thick), web of this length beside it along -z, `web` thick."""
    parts: list[Part] = [(0, 0, h, flange, 1), (0, -(length + flange) / 2, web, length, 1)]
    return _of_rectangles(parts, _strips((h, flange), (length, web)), 5 / 6 * h * flange, web * length)


def channel(w: Size, h: Size, web: Size, t: Size) -> SectionProperties:
    """Web upright at the left, flanges to the right (+z)."""
    z = (w + web) / 2
    parts: list[Part] = [(0, web / 2, h, web, 1), ((h - t) / 2, z, t, w - web, 1), ((t - h) / 2, z, t, w - web, 1)]
    return _of_rectangles(parts, _strips((2 * w - web, t), (h - t, web)), web * h, 5 / 6 * 2 * w * t)


def zee(flange: Size, web: Size, h: Size, t: Size) -> SectionProperties:
    """Upright web, upper flange to the right (+z), lower one to the left; each is `flange` wide beside the web."""
    z = (web + flange) / 2
    parts: list[Part] = [(0, 0, h, web, 1), ((h - t) / 2, z, t, flange, 1), ((t - h) / 2, -z, t, flange, 1)]
    return _of_rectangles(parts, _strips((2 * flange + web, t), (h - t, web)), web * h, 5 / 6 * 2 * flange * t)


def angle(w: Size, h: Size, bottom: Size, left: Size) -> SectionProperties:
    """Lower leg along z, upright leg at the left; drawn about the middle of the lower leg beside the upright one."""
    parts: list[Part] = [(0, 0, bottom, w - left, 1), ((h - bottom) / 2, -w / 2, h, left, 1)]
    J = _strips((w - left / 2, bottom), (h - bottom / 2, left))
    return _of_rectangles(parts, J, left * h * 5 / 6, bottom * w * 5 / 6)


def cross(arms: Size, upright: Size, h: Size, t: Size) -> SectionProperties:
    """Upright wall of height h, and arms along z that are together `arms` long and t thick."""
    parts: list[Part] = [(0, 0, h, upright, 1), (0, 0, t, arms + upright, 1), (0, 0, t, upright, -1)]
    J = _strips((h, upright), (arms, t))
    return _of_rectangles(parts, J, upright * h * 5 / 6, t * (arms + upright) * 5 / 6)


def hat(h: Size, t: Size, top: Size, brim: Size) -> SectionProperties:
    """Walls t thick: a top along z, two upright walls, and two brims at their foot."""
    z = (top + brim - t) / 2
    parts: list[Part] = [(h - t / 2, 0, t, top, 1)]
    parts += [(h / 2, side * (top - t) / 2, h - 2 * t, t, 1) for side in (1, -1)]
    parts += [(t / 2, side * z, t, brim + t, 1) for side in (1, -1)]
    return _of_rectangles(parts, _strips((top + 2 * (h - t) + 2 * brim, t)), 2 * h * t, (top + 2 * brim) * t * 5 / 6)


def hexagon(corner: Size, w: Size, h: Size) -> SectionProperties:
    """Corners cut `corner` long along z; width along z and height along y over all."""
    A, flat, half = h * (w - corner), w - 2 * corner, h / 2
    Iz = flat * h**3 / 12 + 4 * corner * half**3 / 12
    Iy = h * flat**3 / 12 + 4 * (half * corner**3 / 36 + corner * half / 2 * (flat / 2 + corner / 3) ** 2)
    J = A**4 / (4 * math.pi**2 * (Iz + Iy))  # by Saint-Venant's rule for compact sections
    return SectionProperties(A, Iz, Iy, J, h / 2, w / 2)


def by_numbers(A: Size, Iz: Size, Iy: Size, J: Size, Iyz: Size = 0.0) -> SectionProperties:
    """A section by its numbers; the extreme fibres are those of an ellipse of the same A, Iz and Iy."""
    return SectionProperties(A, Iz, Iy, J, semi_axis(Iz, A), semi_axis(Iy, A), Iyz)


def turned_section(shape: SectionProperties) -> SectionProperties:
    """The symmetric shape with its y and z exchanged."""
    p, (y, z) = shape, shape.centroid
    return SectionProperties(p.A, p.Iy, p.Iz, p.J, p.z_max, p.y_max, p.Iyz, p.kz, p.ky, (z, y))


def upside_down(shape: SectionProperties) -> SectionProperties:
    """The shape with its y reversed."""
    return replace(shape, Iyz=-shape.Iyz, centroid=(-shape.centroid[0], shape.centroid[1]))


def semi_axis(I: Size, A: Size) -> Array:
    """Semi-axis [m] of the solid ellipse with radius of gyration sqrt(I / A); zero at a pointed tip."""
    return np.asarray(2 * np.sqrt(np.divide(I, A, out=np.zeros(np.shape(I)), where=np.asarray(A) > 0)))
