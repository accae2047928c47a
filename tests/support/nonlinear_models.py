"""Small structures of every family for tests of nonlinear strain."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from femflex.fem import Material, Member, build_structure
from femflex.fem.sections import ISection, Rectangle
from femflex.fem.sections.laminates import Lamina, Ply, sandwich
from femflex.mesh import box, line, rectangle

METAL = Material(70e9, 0.3, 2700.0)
TURN = np.linalg.qr(np.random.default_rng(2).normal(size=(3, 3)))[0]
SANDWICH = sandwich(Ply(Lamina(120e9, 9e9, 4e9, 0.3, 1600.0), 0.001, 0.4), 0.02, Lamina.core(50.0, 1e8, 5e7))


def bent_beam(**options):
    """An I section along a line with a corner."""
    mesh = line([[0, 0, 0], [1.0, 0.4, 0.2], [1.2, 1.1, -0.3]], 3)
    return build_structure(mesh, [Member("line", "beam", ISection(0.05, 0.08, 0.004, 0.003), METAL, options)])


def tapered_beam():
    """Sixth degree of properties, order 5."""
    mesh = line([[0, 0, 0], [2.0, 0, 0]], 2)
    return build_structure(mesh, [Member("line", "beam", Rectangle("0.05*(1-s/L/2)", 0.03), METAL, {"order": 5})])


def plate(section=0.01, **options):
    """Triangles in an oblique plane."""
    material = METAL if isinstance(section, float) else None
    mesh = rectangle(1.2, 0.9, 2, 2, "triangle").rotated(TURN)
    return build_structure(mesh, [Member("surface", "plate", section, material, options)])


def folded_plate():
    """Two planes of triangles."""
    mesh = rectangle(1.2, 0.9, 4, 2, "triangle")
    points = mesh.points.copy()
    points[:, 2] = 0.4 * np.maximum(points[:, 0] - 0.6, 0.0)
    return build_structure(replace(mesh, points=points), [Member("surface", "plate", 0.01, METAL)])


def bfs(**options):
    """Rectangles in an oblique plane."""
    mesh = rectangle(1.2, 0.9, 2, 3, "quad").rotated(TURN)
    return build_structure(mesh, [Member("surface", "plate_bfs", 0.01, METAL, options)])


def solid(**options):
    """Two curved bricks of 27 nodes."""
    mesh = box(1.0, 0.4, 0.1, 2, 1, 1, "hexahedron27")
    points = mesh.points + 0.02 * np.sin(3 * mesh.points[:, ::-1])
    return build_structure(replace(mesh, points=points), [Member("volume", "solid", None, METAL, options)])


STRUCTURES = {
    "beam": bent_beam,
    "beam of order 6": lambda: bent_beam(order=6),
    "tapered beam": tapered_beam,
    "pretensioned beam": lambda: bent_beam(prestress=500.0, thermal_strain=-1e-4),
    "dkmt": plate,
    "dkt": lambda: plate(element="dkt"),
    "sandwich": lambda: plate(SANDWICH, axis=(1.0, 2.0, 0.0)),
    "folded plate": folded_plate,
    "prestressed plate": lambda: plate(prestress=(300.0, -100.0, 50.0), thermal_strain=1e-4),
    "bfs": bfs,
    "hot bfs": lambda: bfs(thermal_strain=(1e-4, 2e-4, 3e-5), axis=(1.0, 1.0, 0.0)),
    "solid": solid,
    "prestressed solid": lambda: solid(prestress=(1e6, 2e5, 0, 1e5, 0, -3e5), thermal_strain=1e-5),
}


def random_state(structure, size, seed=0):
    """Displacements (n_dof,) that mix all dofs, the largest node translation being `size` metres."""
    x = np.random.default_rng(seed).normal(size=structure.n_dof)
    return x * size / np.abs(structure.translation @ x).max()
