"""A beam cut into segments, and the elastica by quadrature: what several tests of large deflections share."""

from __future__ import annotations

from functools import cache

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from femflex import fem, reduction, system
from femflex.mesh import line

EI, LENGTH = 1.4e4, 10.0  # N m^2, m
SECTION = fem.sections.StiffnessSection(2.8e9, EI, EI, 1.2e4, 1.2, ry=0.0224, rz=0.0224)
MATTIASSON = {1: (0.30172, 0.05643), 2: (0.49346, 0.16064), 5: (0.71379, 0.38763), 10: (0.81061, 0.55500)}


@cache
def beam(k: int, n: int = 0, section: fem.sections.StiffnessSection = SECTION) -> system.Segments:
    """A straight beam of 10 m along x as k segments, with markers root and tip."""
    mesh = line([[0, 0, 0], [LENGTH, 0, 0]], 8)
    pieces = fem.cut_into_segments(mesh, [fem.Member("line", "beam", section)], k, start="start")
    shapes = {"root": "start", "tip": "end"}
    return system.Segments(reduction.reduce_segments(pieces, shapes, lambda s: reduction.chord_modes(s, n)))


def cantilever(k: int, force, frame: str = "inertial") -> system.System:
    """The beam held at its root, with a force (3,) at its tip."""
    load = system.Load("pull", "beam", "tip", frame=frame, force=np.asarray(force, float))
    return system.assembled({"beam": beam(k)}, [system.weld("beam", child_marker="root")], [load])


def elastica(ratio: float) -> tuple[float, float]:
    """w/L and u/L of an inextensible cantilever under a dead tip load P L^2 / EI: theta'' = -ratio cos(theta)."""

    def shot(curvature: float):
        def slope(_, y):
            return [y[1], -ratio * np.cos(y[0]), np.sin(y[0]), np.cos(y[0])]

        return solve_ivp(slope, (0, 1), [0, curvature, 0, 0], rtol=1e-11, atol=1e-12).y[:, -1]

    end = shot(brentq(lambda c: shot(c)[1], 0.0, ratio + 1.0, xtol=1e-13))
    return float(end[2]), float(1.0 - end[3])
