"""Makes slab.msh with femflex's own generator: a solar panel as a solid of 27-node hexahedra, Gmsh 4.1 binary.

A slab of 6 x 1.5 x 0.03 m in 16 x 4 x 1 elements, 0 <= x <= 6, |y| <= 0.75, |z| <= 0.015. Groups: panel (volume), root
(face x = 0), tip_corner (point at x = 6, y = 0.75, z = 0.015).
"""

from pathlib import Path

import numpy as np

from femflex.mesh import Mesh, box, write_mesh

LENGTH, WIDTH, THICKNESS = 6.0, 1.5, 0.03  # m


def make() -> Mesh:
    """The slab with its three groups."""
    mesh = box(LENGTH, WIDTH, THICKNESS, 16, 4, 1, cell="hexahedron27")
    points = mesh.points - [0.0, WIDTH / 2, THICKNESS / 2]
    corner = int(np.linalg.norm(points - [LENGTH, WIDTH / 2, THICKNESS / 2], axis=1).argmin())
    root = mesh.cells["quad9"][mesh.cell_groups["left"]["quad9"]]
    cells = {"hexahedron27": mesh.cells["hexahedron27"], "quad9": root}
    groups = {"panel": {"hexahedron27": np.arange(len(cells["hexahedron27"]))}, "root": {"quad9": np.arange(len(root))}}
    return Mesh(points, cells, groups, {"tip_corner": np.array([corner])})


if __name__ == "__main__":
    write_mesh(Path(__file__).with_name("slab.msh"), make())
