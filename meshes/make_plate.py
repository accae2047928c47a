"""Makes plate.msh: a plate of 1 x 0.6 m in 10 x 6 rectangles, 0.2 <= x <= 1.2, |y| <= 0.3, z = 0, beside a hub at 0.

Groups: plate (surface), root (edge x = 0.2), corner and other_corner (points at x = 1.2, y = 0.3 and y = -0.3).
"""

from pathlib import Path

import numpy as np

from femflex.mesh import Mesh, rectangle, write_mesh

LENGTH, WIDTH, HUB = 1.0, 0.6, 0.2  # m


def make() -> Mesh:
    """The plate with its groups."""
    plain = rectangle(LENGTH, WIDTH, 10, 6, "quad")
    cells = {"plate": plain.cell_groups["surface"], "root": plain.cell_groups["left"]}
    points = {"corner": plain.group_points("top_right"), "other_corner": plain.group_points("bottom_right")}
    return Mesh(plain.points + np.array([HUB, -WIDTH / 2, 0.0]), plain.cells, cells, points)


if __name__ == "__main__":
    write_mesh(Path(__file__).with_name("plate.msh"), make(), binary=False)
