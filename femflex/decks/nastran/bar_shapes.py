"""Shapes of PBARL and PBEAML: area, second moments, torsion constant and shear factors from their dimensions.

Axes are Nastran's: plane 1 is x-y (I1 = int y^2 dA), plane 2 is x-z (I2 = int z^2 dA). Most shapes are unions and
differences of rectangles, whose A and I are exact. J of open shapes is sum b t^3 / 3 (with the usual end correction);
J of closed shapes is Bredt's 4 A^2 / (sum s / t).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from femflex.fem.sections.library import rectangle_torsion

Box = tuple[float, float, float, float, float]  # y of the centre, z of the centre, width along y, along z, +1 or -1


@dataclass(frozen=True)
class Shape:
    """A, I1, I2, I12 about the centroid, J, shear factors K1, K2, and the shear centre (y, z) relative to the
    centroid."""

    A: float
    I1: float
    I2: float
    J: float
    I12: float = 0.0
    K1: float = 5 / 6
    K2: float = 5 / 6
    shear_centre: tuple[float, float] = (0.0, 0.0)


def shape_of(kind: str, dim: list[float]) -> Shape:
    """The Shape of this kind with these dimensions. Raises ValueError for unknown kinds and impossible dimensions."""
    if kind not in SHAPES:
        raise ValueError(f"section type {kind!r} is not known; known are {', '.join(SHAPES)}")
    count, make = SHAPES[kind]
    if len(dim) < count:
        raise ValueError(f"section type {kind} has {len(dim)} dimensions; it needs {count}")
    shape = make(*dim[:count])
    if not (shape.A > 0 and shape.I1 > 0 and shape.I2 > 0 and shape.J > 0):
        raise ValueError(f"section type {kind} with dimensions {dim[:count]} has no area or no stiffness; correct them")
    return shape


def strip(width: float, thickness: float) -> float:
    """Torsion constant of a rectangle [m^4]."""
    return float(rectangle_torsion(np.array(width), np.array(thickness)))


def _rod(r: float) -> Shape:
    I = math.pi / 4 * r**4
    return Shape(math.pi * r**2, I, I, 2 * I, K1=0.9, K2=0.9)


def _tube(outer: float, inner: float) -> Shape:
    I = math.pi / 4 * (outer**4 - inner**4)
    k = 0.5 if inner > 0 else 0.9
    return Shape(math.pi * (outer**2 - inner**2), I, I, 2 * I, K1=k, K2=k)


def _tube2(outer: float, thickness: float) -> Shape:
    return _tube(outer, outer - thickness)


def _bar(width: float, height: float) -> Shape:
    """DIM1 along z (width), DIM2 along y (height)."""
    return Shape(width * height, width * height**3 / 12, height * width**3 / 12, strip(width, height))


def _box(w: float, h: float, t_h: float, t_w: float) -> Shape:
    """Width w along z and height h along y over all; t_h: walls across y; t_w: walls across z."""
    shape = _rectangles([(0, 0, h, w, 1), (0, 0, h - 2 * t_h, w - 2 * t_w, -1)], 1.0)
    J = 2 * t_w * t_h * (w - t_w) ** 2 * (h - t_h) ** 2 / (w * t_w + h * t_h - t_w**2 - t_h**2)
    return _with_torsion_and_shear(shape, J, 2 * t_w * h / shape.A, 2 * t_h * w / shape.A)


def _box1(w: float, h: float, top: float, bottom: float, left: float, right: float) -> Shape:
    y, z = (bottom - top) / 2, (left - right) / 2
    shape = _rectangles([(0, 0, h, w, 1), (y, z, h - top - bottom, w - left - right, -1)], 1.0)
    a, b = w - (left + right) / 2, h - (top + bottom) / 2
    J = 4 * (a * b) ** 2 / (a / top + a / bottom + b / left + b / right)
    return _with_torsion_and_shear(shape, J, (left + right) * h / shape.A, (top + bottom) * w / shape.A)


def _i(h: float, bottom: float, top: float, web: float, t_bottom: float, t_top: float) -> Shape:
    inner = h - t_bottom - t_top
    parts = [
        ((t_bottom - h) / 2, 0.0, t_bottom, bottom, 1.0),
        ((h - t_top) / 2, 0.0, t_top, top, 1.0),
        ((t_bottom - t_top) / 2, 0.0, inner, web, 1.0),
    ]
    J = (bottom * t_bottom**3 + top * t_top**3 + (h - (t_bottom + t_top) / 2) * web**3) / 3
    shape = _rectangles(parts, 1.0)
    d, low, high = h - (t_bottom + t_top) / 2, t_bottom * bottom**3, t_top * top**3
    centroid = sum(p[0] * p[2] * p[3] for p in parts) / shape.A
    y = (t_bottom / 2 - h / 2) + d * high / (low + high) - centroid
    k2 = 5 / 6 * (bottom * t_bottom + top * t_top) / shape.A
    return _with_torsion_and_shear(shape, J, web * h / shape.A, k2, (y, 0.0))


def _i1(flanges: float, web: float, inner: float, h: float) -> Shape:
    t = (h - inner) / 2
    return _i(h, flanges + web, flanges + web, web, t, t)


def _h(inner: float, walls: float, h: float, t: float) -> Shape:
    """H: two upright walls, together `walls` thick, `inner` apart, joined by a web across, t thick."""
    half = walls / 2
    z = (inner + half) / 2
    shape = _rectangles([(0, -z, h, half, 1), (0, z, h, half, 1), (0, 0, t, inner, 1)], 1.0)
    J = (2 * h * half**3 + inner * t**3) / 3
    return _with_torsion_and_shear(shape, J, walls * h / shape.A * 5 / 6, t * (inner + walls) / shape.A)


def _t(flange: float, h: float, t_flange: float, web: float) -> Shape:
    """T: flange at the top along z; web below it."""
    parts = [(0.0, 0.0, t_flange, flange, 1.0), (-h / 2, 0.0, h - t_flange, web, 1.0)]
    shape = _rectangles(parts, 1.0)
    centroid = sum(p[0] * p[2] * p[3] for p in parts) / shape.A
    J = (flange * t_flange**3 + (h - t_flange / 2) * web**3) / 3
    return _with_torsion_and_shear(shape, J, web * h / shape.A, 5 / 6 * flange * t_flange / shape.A, (-centroid, 0.0))


def _t1(h: float, length: float, web: float, flange: float) -> Shape:
    """T lying: flange upright (h along y, `flange` thick), web of this length along -z, `web` thick."""
    parts = [(0.0, 0.0, h, flange, 1.0), (0.0, -(length + flange) / 2, web, length, 1.0)]
    shape = _rectangles(parts, 1.0)
    centroid = sum(p[1] * p[2] * p[3] for p in parts) / shape.A
    J = (h * flange**3 + length * web**3) / 3
    return _with_torsion_and_shear(shape, J, 5 / 6 * h * flange / shape.A, web * length / shape.A, (0.0, -centroid))


def _t2(flange: float, h: float, t_flange: float, web: float) -> Shape:
    """T upside down."""
    shape = _t(flange, h, t_flange, web)
    return _with_torsion_and_shear(shape, shape.J, shape.K1, shape.K2, (-shape.shear_centre[0], 0.0))


def _channel(width: float, h: float, web: float, flange: float) -> Shape:
    """CHAN: web upright at the left, flanges to the right (+z)."""
    parts = [
        (0.0, web / 2, h, web, 1.0),
        ((h - flange) / 2, (width + web) / 2, flange, width - web, 1.0),
        ((flange - h) / 2, (width + web) / 2, flange, width - web, 1.0),
    ]
    shape = _rectangles(parts, 1.0)
    centroid = sum(p[1] * p[2] * p[3] for p in parts) / shape.A
    a, d = width - web / 2, h - flange
    e = 3 * a**2 * flange / (d * web + 6 * a * flange)  # from the web's middle, away from the flanges
    J = (2 * a * flange**3 + d * web**3) / 3
    return _with_torsion_and_shear(
        shape, J, web * h / shape.A, 5 / 6 * 2 * width * flange / shape.A, (0.0, web / 2 - e - centroid)
    )


def _channel1(flanges: float, web: float, inner: float, h: float) -> Shape:
    t = (h - inner) / 2
    return _channel(flanges + web, h, web, t)


def _channel2(wall: float, bottom: float, h: float, width: float) -> Shape:
    """CHAN2: two upright walls and a bottom: a channel turned by 90 deg."""
    channel = _channel(h, width, bottom, wall)
    return Shape(
        channel.A, channel.I2, channel.I1, channel.J, 0.0, channel.K2, channel.K1, (channel.shear_centre[1], 0.0)
    )


def _z(flange: float, web: float, inner: float, h: float) -> Shape:
    """Z: upright web, upper flange to the right (+z), lower one to the left."""
    t = (h - inner) / 2
    z = (web + flange) / 2
    parts = [
        (0.0, 0.0, h, web, 1.0), ((h - t) / 2, z, t, flange, 1.0), ((t - h) / 2, -z, t, flange, 1.0)
    ]  # fmt: skip
    J = (2 * (flange + web / 2) * t**3 + (h - t) * web**3) / 3
    shape = _rectangles(parts, 1.0)
    return _with_torsion_and_shear(shape, J, web * h / shape.A, 5 / 6 * 2 * flange * t / shape.A)


def _l(width: float, h: float, bottom: float, left: float) -> Shape:
    """L: lower leg along z, `bottom` thick; upright leg at the left, `left` thick."""
    parts = [(0.0, 0.0, bottom, width - left, 1.0), ((h - bottom) / 2, -width / 2, h, left, 1.0)]
    shape = _rectangles(parts, 1.0)
    y, z = (sum(p[k] * p[2] * p[3] for p in parts) / shape.A for k in (0, 1))
    J = ((width - left / 2) * bottom**3 + (h - bottom / 2) * left**3) / 3
    return _with_torsion_and_shear(
        shape, J, left * h / shape.A * 5 / 6, bottom * width / shape.A * 5 / 6, (-y, -width / 2 - z)
    )


def _cross(arms: float, upright: float, h: float, t: float) -> Shape:
    shape = _rectangles([(0, 0, h, upright, 1), (0, 0, t, arms + upright, 1), (0, 0, t, upright, -1)], 1.0)
    J = (h * upright**3 + arms * t**3) / 3
    return _with_torsion_and_shear(shape, J, upright * h / shape.A * 5 / 6, t * (arms + upright) / shape.A * 5 / 6)


def _hat(h: float, t: float, top: float, brim: float) -> Shape:
    parts = [
        (h - t / 2, 0.0, t, top, 1.0),
        (h / 2, (top - t) / 2, h - 2 * t, t, 1.0),
        (h / 2, (t - top) / 2, h - 2 * t, t, 1.0),
        (t / 2, top / 2 + brim / 2 - t / 2, t, brim + t, 1.0),
        (t / 2, -(top / 2 + brim / 2 - t / 2), t, brim + t, 1.0),
    ]
    shape = _rectangles(parts, 1.0)
    J = (top + 2 * (h - t) + 2 * brim) * t**3 / 3
    return _with_torsion_and_shear(shape, J, 2 * h * t / shape.A, (top + 2 * brim) * t / shape.A * 5 / 6)


def _hexagon(corner: float, width: float, h: float) -> Shape:
    """HEXA: corners cut `corner` long along z; width along z and height along y over all."""
    A = h * (width - corner)
    flat = width - 2 * corner
    I1 = flat * h**3 / 12 + 4 * corner * (h / 2) ** 3 / 12
    half = h / 2
    arm = flat / 2 + corner / 3
    I2 = h * flat**3 / 12 + 4 * (half * corner**3 / 36 + corner * half / 2 * arm**2)
    J = A**4 / (4 * math.pi**2 * (I1 + I2))  # Saint-Venant's rule for compact sections
    return Shape(A, I1, I2, J)


def _with_torsion_and_shear(
    shape: Shape, J: float, k1: float, k2: float, shear_centre: tuple[float, float] = (0.0, 0.0)
) -> Shape:
    return Shape(shape.A, shape.I1, shape.I2, J, shape.I12, min(k1, 1.0), min(k2, 1.0), shear_centre)


def _rectangles(parts: list[Box], J: float) -> Shape:
    """A and second moments about the centroid of rectangles."""
    y, z, b, c, sign = np.array(parts, float).T
    A = sign * b * c
    total = A.sum()
    y0, z0 = A @ y / total, A @ z / total
    I1 = float(sign @ (c * b**3) / 12 + A @ (y - y0) ** 2)
    I2 = float(sign @ (b * c**3) / 12 + A @ (z - z0) ** 2)
    return Shape(float(total), I1, I2, J, float(A @ ((y - y0) * (z - z0))))


SHAPES: dict[str, tuple[int, Callable[..., Shape]]] = {
    "ROD": (1, _rod), "TUBE": (2, _tube), "TUBE2": (2, _tube2), "BAR": (2, _bar), "BOX": (4, _box), "BOX1": (6, _box1),
    "I": (6, _i), "I1": (4, _i1), "H": (4, _h), "T": (4, _t), "T1": (4, _t1), "T2": (4, _t2), "CHAN": (4, _channel),
    "CHAN1": (4, _channel1), "CHAN2": (4, _channel2), "Z": (4, _z), "L": (4, _l), "CROSS": (4, _cross),
    "HAT": (4, _hat), "HEXA": (3, _hexagon),
}  # fmt: skip
