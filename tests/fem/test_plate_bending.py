"""Strains of plates bent far without stretch: cylinders about any axis, and a cone, whose bend twists as it goes."""

from __future__ import annotations

import numpy as np
import pytest
from support.plate_models import plate_structure

from femflex.mesh import rectangle

FAMILIES = [("plate_bfs", "quad", {}), ("plate", "triangle", {"element": "dkt"}), ("plate", "triangle", {})]
PLACE = np.array([0.5, 0.3])  # in the plane, which is tangent to the bent surface at (0, 0), the cone's apex at (-1, 0)


def cylinder(axis):
    """Places (3,) of the plane's points on a cylinder whose axis has this angle to x, bent by size at unit distance."""
    along, across = (np.array([np.cos(axis + turn), np.sin(axis + turn)]) for turn in (0.0, np.pi / 2))

    def position(x, size):
        s = across @ x
        flat = (along @ x) * along + np.sin(size * s) / size * across
        return np.append(flat, (1 - np.cos(size * s)) / size)

    return position


def cone(x, size):
    """Places (3,) of the plane's points on a cone of half angle asin(sqrt(1 - size^2)) that touches it along y = 0."""
    radius, angle = np.hypot(1 + x[0], x[1]), np.arctan2(x[1], 1 + x[0])
    sine = np.sqrt(1 - size**2)
    side, out = np.sin(angle / sine), np.cos(angle / sine)
    own = radius * np.array([sine * out, sine * side, size])  # the axis of the cone along z
    toward, up = np.array([sine, 0.0, size]), np.array([-size, 0.0, sine])
    return np.array([toward @ own - 1, own[1], up @ own])


def derivatives(position, size, step=0.01):
    """r,x r,y (3, 2) and r,xx r,yy r,xy (3, 3) by differences whose error goes with the fourth power of the step."""
    steps = step * np.arange(-2, 3)
    r = np.array([[position(PLACE + np.array([a, b]), size) for b in steps] for a in steps])
    first, second = np.array([1, -8, 0, 8, -1]) / (12 * step), np.array([-1, 16, -30, 16, -1]) / (12 * step**2)
    slopes = np.stack([first @ r[:, 2], first @ r[2]], axis=1)
    twist = np.einsum("a,b,abi->i", first, first, r)
    return slopes, np.stack([second @ r[:, 2], second @ r[2], twist], axis=1)


def strains(block, slopes, bends):
    """Membrane strains and curvatures (6,) by the table of a plate whose points are displaced so."""
    moved = slopes - np.eye(3, 2)
    g = np.zeros(block.linear_map.shape[1])
    g[:9] = [*moved.ravel(), -bends[2, 0], -bends[2, 1], -2 * bends[2, 2]]
    return (block.linear_map @ g + np.einsum("sgh,g,h->s", block.quadratic_map, g, g) / 2)[:6]


@pytest.mark.parametrize("place", [cylinder(0.0), cylinder(0.7), cylinder(np.pi / 2), cone])
@pytest.mark.parametrize(("family", "cell", "options"), FAMILIES)
def test_curvature_to_third_order(family, cell, options, place):
    """Against n.r,ab; by w,ab alone it would be off by the square of the bend."""
    block = plate_structure(rectangle(1.0, 1.0, 1, 1, cell), 0.01, family, **options).strain[0]
    off, linear, stretch = [], [], []
    for size in (0.2, 0.1, 0.05):
        slopes, bends = derivatives(place, size)
        assert slopes.T @ slopes == pytest.approx(np.eye(2), abs=1e-8)  # no stretch
        exact = -np.cross(*slopes.T) @ bends * [1, 1, 2]
        computed = strains(block, slopes, bends)
        scale = np.abs(exact).max()
        off.append(np.abs(computed[3:] - exact).max() / scale)
        linear.append(np.abs(-bends[2] * [1, 1, 2] - exact).max() / scale)
        stretch.append(np.abs(computed[:3]).max())
    falls = [np.log2(np.array(row[:-1]) / row[1:]) for row in (off, linear, stretch)]
    assert falls[0] == pytest.approx([4, 4], abs=0.25)
    assert falls[1] == pytest.approx([2, 2], abs=0.25)
    assert falls[2] == pytest.approx([4, 4], abs=0.25)  # von Karman's strains lack (u,x^2 + v,x^2) / 2
