"""Makes wing_panel.msh: a panel of 2 x 1.5 m in triangles, 0 <= x <= 2, |y| <= 0.75, z = 0.

Groups: panel (surface), root (edge x = 0), tip (edge x = 2).
"""

from pathlib import Path

import numpy as np

from femflex.mesh import Mesh, rectangle, write_mesh


def panel() -> Mesh:
    """The panel, its edges named."""
    plain = rectangle(2.0, 1.5, 8, 6)
    groups = {
        "panel": plain.cell_groups["surface"],
        "root": plain.cell_groups["left"],
        "tip": plain.cell_groups["right"],
    }
    return Mesh(plain.points - np.array([0.0, 0.75, 0.0]), plain.cells, groups, {})


if __name__ == "__main__":
    write_mesh(Path(__file__).with_name("wing_panel.msh"), panel(), binary=False)
