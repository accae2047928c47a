"""Profiles of bars, the named shapes of Nastran and Abaqus: area, second moments, torsion and shear by dimensions.

Axes are those of sections: Iz = int y^2 dA bends in x-y, Iy = int z^2 dA in x-z. Most profiles are unions and
differences of rectangles, whose area and second moments are exact. J of open ones is sum b t^3 / 3 over their walls, of
closed ones Bredt's 4 A^2 / (sum s / t).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from femflex.fem.sections.library import rectangle_torsion

Rectangle = tuple[float, float, float, float, float]  # y and z of the centre, width along y and along z, +1 or -1
Place = tuple[float, float]  # y, z

SYMMETRIC = 1e-9  # product of inertia, relative to the moments, up to which the axes are principal


@dataclass(frozen=True)
class Profile:
    """Area, second moments about the centroid, torsion constant and shear factors of a profile, in any unit.

    shear_centre  y and z from the centroid
    centroid      y and z in the drawing of the profile
    """

    A: float
    Iz: float
    Iy: float
    J: float
    Iyz: float = 0.0
    ky: float = 5 / 6
    kz: float = 5 / 6
    shear_centre: Place = (0.0, 0.0)
    centroid: Place = (0.0, 0.0)


def profile(kind: str, dimensions: Sequence[float]) -> Profile:
    """The Profile of this kind. Raises ValueError for unknown kinds and impossible dimensions."""
    count = n_dimensions(kind)
    if len(dimensions) < count:
        raise ValueError(f"section type {kind} has {len(dimensions)} dimensions; it needs {count}")
    made = PROFILES[kind][1](*dimensions[:count])
    if not (made.A > 0 and made.Iz > 0 and made.Iy > 0 and made.J > 0):
        raise ValueError(
            f"section type {kind} with dimensions {[*dimensions[:count]]} has no area or no stiffness; correct them"
        )
    return made


def n_dimensions(kind: str) -> int:
    """Number of dimensions of this kind of profile. Raises ValueError for unknown kinds."""
    if kind not in PROFILES:
        raise ValueError(f"section type {kind!r} is not known; known are {', '.join(PROFILES)}")
    return PROFILES[kind][0]


def principal_moments(Iz: float, Iy: float, Iyz: float) -> tuple[float, float, float]:
    """Angle [rad] from the y axis to a principal axis, and int y^2 dA and int z^2 dA along the principal axes.

    With y = c y' - s z', int y' z' dA vanishes in axes turned by alpha, tan 2 alpha = 2 Iyz / (Iz - Iy).
    """
    if abs(Iyz) < SYMMETRIC * (Iz + Iy) or Iyz == 0:
        return 0.0, Iz, Iy
    mean, radius = (Iz + Iy) / 2, math.hypot((Iz - Iy) / 2, Iyz)
    return 0.5 * math.atan2(2 * Iyz, Iz - Iy), mean + radius, mean - radius


def _of_rectangles(
    parts: Sequence[Rectangle], J: float, upright: float, across: float, shear_centre: Place | None = None
) -> Profile:
    """A profile of rectangles.

    upright, across  area that carries shear along y and along z
    shear_centre     y and z in the drawing; None: at the centroid
    """
    y, z, b, c, sign = np.array(parts, float).T
    areas = sign * b * c
    A = float(areas.sum())
    y0, z0 = float(areas @ y) / A, float(areas @ z) / A
    Iz = float(sign @ (c * b**3) / 12 + areas @ (y - y0) ** 2)
    Iy = float(sign @ (b * c**3) / 12 + areas @ (z - z0) ** 2)
    Iyz = float(areas @ ((y - y0) * (z - z0)))
    ys, zs = shear_centre or (y0, z0)
    return Profile(A, Iz, Iy, J, Iyz, min(upright / A, 1.0), min(across / A, 1.0), (ys - y0, zs - z0), (y0, z0))


def _strips(*walls: tuple[float, float]) -> float:
    """J of open walls, each by its length and thickness."""
    return sum(length * t**3 for length, t in walls) / 3


def _tube(outer: float, inner: float = 0.0) -> Profile:
    I, k = math.pi / 4 * (outer**4 - inner**4), 0.5 if inner > 0 else 0.9
    return Profile(math.pi * (outer**2 - inner**2), I, I, 2 * I, ky=k, kz=k)


def _tube2(outer: float, t: float) -> Profile:
    return _tube(outer, outer - t)


def _bar(w: float, h: float) -> Profile:
    """Width along z, height along y."""
    return Profile(w * h, w * h**3 / 12, h * w**3 / 12, float(rectangle_torsion(np.array(w), np.array(h))))


def _box(w: float, h: float, t: float, t_sides: float) -> Profile:
    return _box1(w, h, t, t, t_sides, t_sides)


def _box1(w: float, h: float, top: float, bottom: float, left: float, right: float) -> Profile:
    """Width along z and height along y over all, drawn about its middle; `left` is the wall towards -z."""
    y, z = (bottom - top) / 2, (left - right) / 2
    a, b = w - (left + right) / 2, h - (top + bottom) / 2
    J = 4 * (a * b) ** 2 / (a / top + a / bottom + b / left + b / right)
    parts = [(0, 0, h, w, 1), (y, z, h - top - bottom, w - left - right, -1)]
    return _of_rectangles(parts, J, (left + right) * h, (top + bottom) * w)


def _i(h: float, bottom: float, top: float, web: float, t_bottom: float, t_top: float) -> Profile:
    """Flanges across, drawn about half the height; the shear centre is closer to the wider flange."""
    parts = [
        ((t_bottom - h) / 2, 0, t_bottom, bottom, 1), ((h - t_top) / 2, 0, t_top, top, 1),
        ((t_bottom - t_top) / 2, 0, h - t_bottom - t_top, web, 1),
    ]  # fmt: skip
    d, low, high = h - (t_bottom + t_top) / 2, t_bottom * bottom**3, t_top * top**3
    y = t_bottom / 2 - h / 2 + d * high / (low + high)
    J = _strips((bottom, t_bottom), (top, t_top), (d, web))
    return _of_rectangles(parts, J, web * h, 5 / 6 * (bottom * t_bottom + top * t_top), (y, 0))


def _i1(flanges: float, web: float, inner: float, h: float) -> Profile:
    t = (h - inner) / 2
    return _i(h, flanges + web, flanges + web, web, t, t)


def _h(inner: float, walls: float, h: float, t: float) -> Profile:
    """Two upright walls, together `walls` thick, `inner` apart, joined by a web across, t thick."""
    half = walls / 2
    z = (inner + half) / 2
    parts = [(0, -z, h, half, 1), (0, z, h, half, 1), (0, 0, t, inner, 1)]
    J = _strips((2 * h, half), (inner, t))
    return _of_rectangles(parts, J, walls * h * 5 / 6, t * (inner + walls))


def _t(flange: float, h: float, t: float, web: float) -> Profile:
    """Flange at the top along z, drawn about its middle, and web below it."""
    parts = [(0, 0, t, flange, 1), (-h / 2, 0, h - t, web, 1)]
    return _of_rectangles(parts, _strips((flange, t), (h - t / 2, web)), web * h, 5 / 6 * flange * t, (0, 0))


def _t1(h: float, length: float, web: float, flange: float) -> Profile:
    """T lying: flange upright (h along y, `flange` thick), web of this length along -z, `web` thick."""
    parts = [(0, 0, h, flange, 1), (0, -(length + flange) / 2, web, length, 1)]
    return _of_rectangles(parts, _strips((h, flange), (length, web)), 5 / 6 * h * flange, web * length, (0, 0))


def _t2(flange: float, h: float, t: float, web: float) -> Profile:
    """T upside down."""
    upright = _t(flange, h, t, web)
    return replace(upright, shear_centre=(-upright.shear_centre[0], 0.0), centroid=(-upright.centroid[0], 0.0))


def _channel(w: float, h: float, web: float, t: float) -> Profile:
    """Web upright at the left, flanges to the right (+z); the shear centre lies on the other side of the web."""
    z = (w + web) / 2
    parts = [(0, web / 2, h, web, 1), ((h - t) / 2, z, t, w - web, 1), ((t - h) / 2, z, t, w - web, 1)]
    a, d = w - web / 2, h - t
    e = 3 * a**2 * t / (d * web + 6 * a * t)  # from the middle of the web
    return _of_rectangles(parts, _strips((2 * a, t), (d, web)), web * h, 5 / 6 * 2 * w * t, (0, web / 2 - e))


def _channel1(flanges: float, web: float, inner: float, h: float) -> Profile:
    return _channel(flanges + web, h, web, (h - inner) / 2)


def _channel2(wall: float, bottom: float, h: float, w: float) -> Profile:
    """Two upright walls and a bottom: a channel turned by 90 deg."""
    p = _channel(h, w, bottom, wall)
    centre, centroid = (p.shear_centre[1], 0.0), (p.centroid[1], 0.0)
    return Profile(p.A, p.Iy, p.Iz, p.J, 0.0, p.kz, p.ky, centre, centroid)


def _z(flange: float, web: float, inner: float, h: float) -> Profile:
    """Upright web, upper flange to the right (+z), lower one to the left."""
    t, z = (h - inner) / 2, (web + flange) / 2
    parts = [(0, 0, h, web, 1), ((h - t) / 2, z, t, flange, 1), ((t - h) / 2, -z, t, flange, 1)]
    return _of_rectangles(parts, _strips((2 * flange + web, t), (h - t, web)), web * h, 5 / 6 * 2 * flange * t)


def _l(w: float, h: float, bottom: float, left: float) -> Profile:
    """Lower leg along z, upright leg at the left; drawn about the middle of the lower leg beside the upright one."""
    parts = [(0, 0, bottom, w - left, 1), ((h - bottom) / 2, -w / 2, h, left, 1)]
    J = _strips((w - left / 2, bottom), (h - bottom / 2, left))
    return _of_rectangles(parts, J, left * h * 5 / 6, bottom * w * 5 / 6, (0, -w / 2))


def _cross(arms: float, upright: float, h: float, t: float) -> Profile:
    parts = [(0, 0, h, upright, 1), (0, 0, t, arms + upright, 1), (0, 0, t, upright, -1)]
    J = _strips((h, upright), (arms, t))
    return _of_rectangles(parts, J, upright * h * 5 / 6, t * (arms + upright) * 5 / 6)


def _hat(h: float, t: float, top: float, brim: float) -> Profile:
    z = (top + brim - t) / 2
    parts: list[Rectangle] = [(h - t / 2, 0, t, top, 1)]
    parts += [(h / 2, side * (top - t) / 2, h - 2 * t, t, 1) for side in (1, -1)]
    parts += [(t / 2, side * z, t, brim + t, 1) for side in (1, -1)]
    return _of_rectangles(parts, _strips((top + 2 * (h - t) + 2 * brim, t)), 2 * h * t, (top + 2 * brim) * t * 5 / 6)


def _hexagon(corner: float, w: float, h: float) -> Profile:
    """Corners cut `corner` long along z; width along z and height along y over all."""
    A, flat, half = h * (w - corner), w - 2 * corner, h / 2
    Iz = flat * h**3 / 12 + 4 * corner * half**3 / 12
    Iy = h * flat**3 / 12 + 4 * (half * corner**3 / 36 + corner * half / 2 * (flat / 2 + corner / 3) ** 2)
    return Profile(A, Iz, Iy, A**4 / (4 * math.pi**2 * (Iz + Iy)))  # J by Saint-Venant's rule for compact sections


PROFILES: dict[str, tuple[int, Callable[..., Profile]]] = {  # kind -> number of dimensions, and the profile
    "ROD": (1, _tube), "TUBE": (2, _tube), "TUBE2": (2, _tube2), "BAR": (2, _bar), "BOX": (4, _box), "BOX1": (6, _box1),
    "I": (6, _i), "I1": (4, _i1), "H": (4, _h), "T": (4, _t), "T1": (4, _t1), "T2": (4, _t2), "CHAN": (4, _channel),
    "CHAN1": (4, _channel1), "CHAN2": (4, _channel2), "Z": (4, _z), "L": (4, _l), "CROSS": (4, _cross),
    "HAT": (4, _hat), "HEXA": (3, _hexagon),
}  # fmt: skip
