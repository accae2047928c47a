"""Orders of convergence of all elements: solids, shells, plates, membranes, beams, tethers, against exact solutions."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

import numpy as np
import pytest
from support.closed_forms import mindlin
from support.element_families import SHELLS
from support.element_meshes import SOLIDS, brick
from support.plate_models import frequencies, supported_square

from femflex.fem import Material, Member, build_structure
from femflex.fem.sections import CableSection, StiffnessSection
from femflex.mesh import line, rectangle
from femflex.mesh.cells import CELL_TYPES
from femflex.reduction import cantilever_modes

SHORT = 0.35  # by which a measured order may fall short: coarse meshes are not at their limit
METAL = Material(70e9, 0.3, 2700.0)


@cache
def solid_energy(cell: str, n: int) -> float:
    """Energy of a smooth displacement, interpolated."""
    s = build_structure(brick(cell, (n, n, n)), [Member("volume", "solid", None, METAL, {"order": 1})])
    x, y, z = s.mesh.points.T
    u = np.stack([np.sin(2 * x) * y, np.cos(x + z), np.exp(y) * z], axis=1)
    v = s.translation.T @ u.ravel()
    return float(v @ s.K @ v) / 2


def solid(cell: str) -> Callable[[int], float]:
    return lambda n: abs(solid_energy(cell, n) - solid_energy("hexahedron27", 6))


def shell(cell: str) -> Callable[[int], float]:
    """First frequency of a thick plate on hard simple supports, by Mindlin's exact solution."""

    def error(n: int) -> float:
        mesh = rectangle(10.0, 10.0, n, n, cell)
        s = build_structure(mesh, [Member("surface", "shell", 1.0, Material(200e9, 0.3, 8000.0))])
        across, along = ("x", "y", "z", "rx"), ("x", "y", "z", "ry")
        fixed = s.constrained_dofs({"left": across, "right": across, "bottom": along, "top": along})
        return abs(frequencies(s, fixed, 1)[0] / (2 * np.pi) / mindlin(1, 1) - 1)

    return error


def plate(family: str, **options: object) -> Callable[[int], float]:
    """First frequency of a thin simply supported square, 2 pi^2."""
    return lambda n: abs(supported_square(family, 1e-5, n, **options)[0] / (2 * np.pi**2) - 1)


def membrane(cell: str) -> Callable[[int], float]:
    """First frequency of a square drum, pi sqrt(2 N / m)."""

    def error(n: int) -> float:
        mesh = rectangle(1.0, 1.0, n, n, cell)
        s = build_structure(mesh, [Member("surface", "membrane", 1e-4, METAL, {"prestress": 20.0})])
        omega = cantilever_modes(s, ("left", "right", "bottom", "top"), 1).omega[0]
        return float(abs(omega / (np.pi * np.sqrt(2 * 20.0 / 0.27)) - 1))

    return error


def beam(order: int) -> Callable[[int], float]:
    """Second frequency of a cantilever, 4.694091^2 sqrt(EI / m L^4) in bending."""

    def error(n: int) -> float:
        section = StiffnessSection(1e4, 1.0, 2.0, 1.0, 1.0, ry=1e-6, rz=1e-6)
        options = {"order": order, "rotary_inertia": False, "extent": 1e3, "orientation": (0.0, 1.0, 0.0)}
        s = build_structure(line([[0, 0, 0], [1, 0, 0]], n), [Member("line", "beam", section, None, options)])
        omega = cantilever_modes(s, "start", 6).omega
        return float(np.abs(omega / 4.694091132974175**2 - 1).min())

    return error


def tether(order: int) -> Callable[[int], float]:
    """Third frequency of a string, 3 pi sqrt(T / m)."""

    def error(n: int) -> float:
        options = {"order": order, "prestress": 50.0}
        s = build_structure(
            line([[0, 0, 0], [1, 0, 0]], n), [Member("line", "tether", CableSection(1e9, 0.3), None, options)]
        )
        omega = cantilever_modes(s, ("start", "end"), 6).omega
        return float(np.abs(omega / (3 * np.pi * np.sqrt(50 / 0.3)) - 1).min())

    return error


ORDER = {1: 2.0, 2: 4.0}  # of the square of the size in cells of first and second order
# Six-node triangles sample transverse shear so that thin plates do not lock; it costs two orders, from the soft side.
ROWS: dict[str, tuple[Callable[[int], float], tuple[int, ...], float]] = {
    **{
        f"solid {c}": (
            solid(c), (2, 4) if c in ("pyramid13", "hexahedron27") else (2, 4, 6), ORDER[CELL_TYPES[c].order]
        ) for c in SOLIDS
    },
    **{
        f"shell {c}": (
            shell(c), (4, 8, 16) if c in ("triangle", "triangle6", "quad") else (2, 4, 8),
            2.0 if c == "triangle6" else ORDER[CELL_TYPES[c].order],
        ) for c in SHELLS
    },
    "plate dkt": (plate("plate", element="dkt"), (5, 10, 20), 2.0),
    "plate dkmt": (plate("plate", element="dkmt"), (5, 10, 20), 2.0),
    "plate of rectangles": (plate("plate_bfs"), (2, 4, 8), 4.0),
    "membrane": (membrane("triangle"), (4, 8, 12), 4.0),
    "membrane of second order": (membrane("triangle6"), (4, 8, 12), 4.0),
    **{f"beam of order {p}": (beam(p), (4, 8, 16) if p == 3 else (p - 2, p - 1, p), 2.0 * (p - 1)) for p in (3, 4, 5)},
    **{f"tether of order {p}": (tether(p), (4, 6, 8), 2.0 * p) for p in (1, 2, 3)},
}  # fmt: skip


@pytest.mark.sampled(9)
@pytest.mark.filterwarnings("ignore:solid on group .* of first order", "ignore:shell on group .* three-node triangles")
@pytest.mark.parametrize("name", ROWS)
def test_convergence_order_of_elements(name):
    """h^2 of first order, h^4 of second; frequencies of beams and tethers of order p by their exact order."""
    error, counts, expected = ROWS[name]
    errors = [error(n) for n in counts]
    rate = -np.polyfit(np.log(counts), np.log(errors), 1)[0]
    assert rate > expected - SHORT, errors
