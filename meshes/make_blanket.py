"""Makes blanket.msh: a solar blanket stretched between a root and a spreader bar at the tip of a boom.

Blanket 0 <= x <= 10, |y| <= 0.5, z = 0, nine-node quadrilaterals; boom along the x axis from the middle of the root to
that of the bar, with which it shares its ends; bar along x = 10. Groups: blanket, boom, bar, root (points x = 0), tip
(the bar's middle), middle (a point of the blanket, half way).
"""

from pathlib import Path

import numpy as np

from femflex.mesh import Mesh, line, rectangle, write_mesh


def blanket() -> Mesh:
    """Blanket, bar on its outer edge, and boom."""
    plain = rectangle(10.0, 1.0, 10, 6, "quad9").translated([0.0, -0.5, 0.0])
    sheet = Mesh(
        plain.points, plain.cells, {"blanket": plain.cell_groups["surface"], "bar": plain.cell_groups["right"]}
    )
    axis = line(np.array([[0.0, 0.0, 0.0], [10.0, 0.0, 0.0]]), 3)
    axis = Mesh(axis.points, axis.cells, {"boom": axis.cell_groups["line"]})
    mesh = sheet.merged(axis, tolerance=1e-6)  # only the ends of the boom are points of the blanket
    tip = mesh.nearest_point([10.0, 0.0, 0.0])
    root = np.flatnonzero(np.abs(mesh.points[:, 0]) < 1e-9)
    return mesh.with_groups(points={"root": root, "tip": [tip], "middle": [mesh.nearest_point([5.0, 0.0, 0.0])]})


if __name__ == "__main__":
    write_mesh(Path(__file__).with_name("blanket.msh"), blanket(), binary=False)
