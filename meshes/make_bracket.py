"""Makes bracket.msh: a block of tetrahedra from a hub, and a panel of quadrilaterals beyond its head.

Block 0 <= x <= 0.3, |y|, |z| <= 0.04; panel 0.3 <= x <= 2.3, |y| <= 0.5, z = 0. Groups: bracket (tetrahedra), foot and
head (its faces x = 0 and x = 0.3), panel (quadrilaterals), root and tip (its edges). Metres.
"""

from pathlib import Path

import numpy as np

from femflex.mesh import Mesh, box, rectangle, write_mesh


def bracket() -> Mesh:
    """Block and panel, not joined."""
    solid = box(0.3, 0.08, 0.08, 5, 2, 2, "tetra").translated([0.0, -0.04, -0.04])
    names = {"volume": "bracket", "left": "foot", "right": "head"}
    kept = {names[g]: cells for g, cells in solid.cell_groups.items() if g in names}
    solid = Mesh(solid.points, solid.cells, kept)
    sheet = rectangle(2.0, 1.0, 8, 5, "quad").translated([0.3, -0.5, 0.0])
    names = {"surface": "panel", "left": "root", "right": "tip"}
    kept = {names[g]: cells for g, cells in sheet.cell_groups.items() if g in names}
    sheet = Mesh(sheet.points, sheet.cells, kept)
    return solid.merged(sheet)


if __name__ == "__main__":
    mesh = bracket()
    assert np.ptp(mesh.points[:, 0]) > 2.29
    write_mesh(Path(__file__).with_name("bracket.msh"), mesh, binary=False)
