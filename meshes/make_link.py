"""Makes link.msh with femflex's own generator: a slender bar as a solid of 27-node hexahedra, Gmsh 4.1 binary.

A bar of 1 x 0.06 x 0.006 m in 16 x 1 x 1 elements, 0 <= x <= 1, |y| <= 0.03, |z| <= 0.003. Groups: bar (volume), root
(face x = 0), tip (face x = 1).
"""

from pathlib import Path

import numpy as np

from femflex.mesh import Mesh, box, write_mesh

LENGTH, WIDTH, THICKNESS = 1.0, 0.06, 0.006  # m


def make() -> Mesh:
    """The bar with its three groups."""
    mesh = box(LENGTH, WIDTH, THICKNESS, 16, 1, 1, cell="hexahedron27").translated([0.0, -WIDTH / 2, -THICKNESS / 2])
    faces = {"root": "left", "tip": "right"}
    quads = [mesh.cells["quad9"][mesh.cell_groups[side]["quad9"]] for side in faces.values()]
    cells = {"hexahedron27": mesh.cells["hexahedron27"], "quad9": np.concatenate(quads)}
    counts = np.cumsum([0, *map(len, quads)])
    groups = {"bar": {"hexahedron27": np.arange(len(cells["hexahedron27"]))}}
    groups |= {name: {"quad9": np.arange(*counts[k : k + 2])} for k, name in enumerate(faces)}
    return Mesh(mesh.points, cells, groups, {})


if __name__ == "__main__":
    write_mesh(Path(__file__).with_name("link.msh"), make())
