"""Orders of convergence of all elements: solids, shells and beams, against exact energies and frequencies."""

from __future__ import annotations

import numpy as np
import pytest
from support.element_meshes import SOLIDS, brick
from test_dynamic_standards import bending, mindlin
from test_solids import nodal, structure_of

from femflex.fem import Material, Member, build_structure
from femflex.fem.sections import StiffnessSection
from femflex.mesh import line, rectangle
from femflex.mesh.cells import CELL_TYPES
from femflex.reduction import cantilever_modes

# Six-node triangles sample transverse shear so that thin plates do not lock; it costs two orders, from the soft side.
ORDERS = {"triangle6": 2.0}
SHELLS = ("triangle", "triangle6", "quad", "quad8", "quad9")
BEAMS = {"beam of order 3": 3, "beam of order 4": 4, "beam of order 5": 5}
SHORT = 0.35  # by which a measured order may fall short: coarse meshes are not at their limit


def solid_error(cell: str, n: int) -> float:
    """Of the energy of a smooth displacement, interpolated."""

    def energy(kind: str, n: int) -> float:
        s = structure_of(brick(kind, (n, n, n)))
        x = nodal(s, lambda p: np.stack(
            [np.sin(2 * p[:, 0]) * p[:, 1], np.cos(p[:, 0] + p[:, 2]), np.exp(p[:, 1]) * p[:, 2]], axis=1
        )[..., None])  # fmt: skip
        return float((x.T @ s.K @ x).item()) / 2

    return abs(energy(cell, n) - energy("hexahedron27", 6))


def shell_error(cell: str, n: int) -> float:
    """Of the first frequency of a thick plate on simple supports, by Mindlin's exact solution."""
    mesh = rectangle(10.0, 10.0, n, n, cell)
    s = build_structure(mesh, [Member("surface", "shell", 1.0, Material(200e9, 0.3, 8000.0))])
    return abs(bending(s, 1)[0] / mindlin(1, 1) - 1)


def beam_error(order: int, n: int) -> float:
    """Of the second frequency of a cantilever, 4.694091^2 sqrt(EI / m L^4) in bending."""
    section = StiffnessSection(1e4, 1.0, 2.0, 1.0, 1.0, ry=1e-6, rz=1e-6)
    options = {"order": order, "rotary_inertia": False, "extent": 1e3, "orientation": (0.0, 1.0, 0.0)}
    s = build_structure(line([[0, 0, 0], [1, 0, 0]], n), [Member("line", "beam", section, None, options)])
    omega = cantilever_modes(s, "start", 6).omega
    exact = 4.694091132974175**2
    return float(np.abs(omega / exact - 1).min())


CASES = (
    *((cell, solid_error, (2, 4) if cell in ("pyramid13", "hexahedron27") else (2, 4, 6)) for cell in SOLIDS),
    *((cell, shell_error, (4, 8, 16) if cell in ("triangle", "triangle6", "quad") else (2, 4, 8)) for cell in SHELLS),
    *((name, beam_error, (4, 8, 16) if order == 3 else (order - 2, order - 1, order)) for name, order in BEAMS.items()),
)


@pytest.mark.sampled(9)
@pytest.mark.filterwarnings("ignore:solid on group .* of first order")
@pytest.mark.filterwarnings("ignore:shell on group .* three-node triangles")
@pytest.mark.parametrize(("cell", "error", "counts"), CASES, ids=[one[0] for one in CASES])
def test_errors_fall_at_the_order_of_the_element(cell, error, counts):
    """h^2 of first order, h^4 of second; beams of order p have frequencies to h^(2 (p - 1))."""
    order = BEAMS.get(cell, cell)
    if isinstance(order, int):
        expected = 2.0 * (order - 1)
    else:
        expected = ORDERS.get(cell, {1: 2.0, 2: 4.0}[CELL_TYPES[cell].order])
    errors = [error(order, n) for n in counts]
    rate = -np.polyfit(np.log(counts), np.log(errors), 1)[0]
    assert rate > expected - SHORT, errors
