"""Plates for tests: supports, frequencies, and fields laid on the dofs."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.sparse.linalg import eigsh

from femflex.arrays import Array, IntArray
from femflex.fem import Material, Member, Structure, build_structure
from femflex.fem.sections.laminates import PlateSection
from femflex.mesh import Mesh, rectangle

CELL = {"plate": "triangle", "plate_bfs": "quad"}
EDGES = {"left": "x", "right": "x", "bottom": "y", "top": "y"}  # edge and the axis across it
METAL = Material(70e9, 0.3, 2700.0)


def random_rotation(seed: int) -> Array:
    """A rotation matrix (3, 3) that favours no axis."""
    q = np.random.default_rng(seed).normal(size=4)
    w, x, y, z = q / np.linalg.norm(q)
    K = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + 2 * w * K + 2 * K @ K


def plate_structure(mesh: Mesh, section: PlateSection | float, family: str = "plate", **options: object) -> Structure:
    """A structure of the group "surface"; a number is the thickness of a sheet of METAL."""
    material = None if isinstance(section, PlateSection) else METAL
    return build_structure(mesh, [Member("surface", family, section, material, options)])


def flexural_rigidity(h: float) -> float:
    """D of a sheet of METAL [N m]."""
    return METAL.E * h**3 / 12 / (1 - METAL.nu**2)


def dofs_of_components(structure: Structure, group: str, components: str) -> IntArray:
    """Independent dofs that carry components ("xyz" translations, "abc" rotations about them) of a group's nodes."""
    nodes = structure.mesh.group_points(group)
    found = []
    for name in components:
        operator = structure.translation if name in "xyz" else structure.rotation
        rows = operator[3 * nodes + "xyzabc".index(name) % 3].tocoo()
        found.append(rows.coords[1][np.abs(rows.data) > 1e-9])
    return np.unique(np.concatenate(found))


def simply_supported(structure: Structure) -> IntArray:
    """Dofs held by hard supports on the four edges of a rectangle in the x, y plane: nothing moves along an edge."""
    turning = {"x": "a", "y": "b"}  # the rotation that tilts the edge itself
    return np.unique(
        np.concatenate([dofs_of_components(structure, edge, "xyz" + turning[n]) for edge, n in EDGES.items()])
    )


def frequencies(structure: Structure, fixed: IntArray, n: int, shift: float = 0.0) -> Array:
    """The n lowest natural frequencies [rad/s] with the fixed dofs held."""
    free = np.setdiff1d(np.arange(structure.n_dof), fixed)
    K, M = structure.K[free][:, free].tocsc(), structure.M[free][:, free].tocsc()
    value = eigsh(K, n, M, sigma=shift, v0=np.ones(len(free)), return_eigenvectors=False)
    return np.sqrt(np.maximum(np.sort(value), 0.0))


def supported_square(family: str, h: float, n: int, **options: object) -> Array:
    """omega a^2 sqrt(rho h / D) of the lowest four modes of a simply supported square with n cells a side."""
    structure = plate_structure(rectangle(1.0, 1.0, n, n, CELL[family]), h, family, **options)
    scale = np.sqrt(METAL.density * h / flexural_rigidity(h))
    return frequencies(structure, simply_supported(structure), 4) * scale


def displaced(structure: Structure, u: Callable[[Array], Array], theta: Callable[[Array], Array]) -> Array:
    """Dofs (n_dof,) with the nodes at displacements u(x) and rotations theta(x), (n, 3) each; extra dofs are zero."""
    x = structure.mesh.points
    return np.asarray(structure.translation.T @ u(x).ravel() + structure.rotation.T @ theta(x).ravel())
