"""Makes reflector.msh: a paraboloid z = r^2 / 4 F of focal length F = 2 m, 0.3 <= r <= 2 m, on six radial ribs.

Nine-node quadrilaterals; the ribs are lines between their nodes. Groups: dish, ribs, root (inner edge), rim (outer
edge), edge (the point of the rim on the x axis).
"""

from pathlib import Path

import numpy as np

from femflex.mesh import Mesh, annulus, write_mesh

FOCAL, INNER, OUTER = 2.0, 0.3, 2.0  # m


def reflector() -> Mesh:
    """Dish and ribs, which share nodes."""
    flat = annulus(INNER, OUTER, 4, 12, "quad9")
    radius = np.hypot(flat.points[:, 0], flat.points[:, 1])
    points = np.column_stack([flat.points[:, :2], radius**2 / (4 * FOCAL)])
    angle = np.arctan2(flat.points[:, 1], flat.points[:, 0])
    ribs = []
    for k in range(6):
        off = np.abs(np.angle(np.exp(1j * (angle - k * np.pi / 3))))
        nodes = np.flatnonzero(off < 1e-9)
        nodes = nodes[np.argsort(radius[nodes])]
        ribs.append(np.stack([nodes[:-1], nodes[1:]], axis=1))
    names = {"surface": "dish", "inner": "root", "outer": "rim"}
    groups = {names[name]: cells for name, cells in flat.cell_groups.items()}
    lines = np.concatenate(ribs)
    groups["ribs"] = {"line": np.arange(len(lines))}
    mesh = Mesh(points, {**flat.cells, "line": lines}, groups)
    return mesh.with_groups(points={"edge": [mesh.nearest_point([OUTER, 0.0, OUTER**2 / 4 / FOCAL])]})


if __name__ == "__main__":
    write_mesh(Path(__file__).with_name("reflector.msh"), reflector(), binary=False)
