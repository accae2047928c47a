"""Makes l_frame.inp: an L-shaped frame of beams in Abaqus' input format.

A mast of 4 m along z and an arm of 3 m along x at its top, cells of 0.5 m. ELSET: mast, arm. NSET: root, corner, tip.
"""

from pathlib import Path

import numpy as np

from femflex.mesh import Mesh, line, write_mesh

MAST, ARM = 4.0, 3.0  # m


def frame() -> Mesh:
    """The frame from the origin."""
    plain = line([[0, 0, 0], [0, 0, MAST], [ARM, 0, MAST]], 14)
    middle = plain.points[plain.cells["line"]].mean(axis=1)
    cells = {
        "mast": {"line": np.flatnonzero(middle[:, 0] == 0)},
        "arm": {"line": np.flatnonzero(middle[:, 0] > 0)},
    }
    corner = [plain.nearest_point([0, 0, MAST])]
    points = {"root": plain.point_groups["start"], "corner": np.array(corner), "tip": plain.point_groups["end"]}
    return Mesh(plain.points, plain.cells, cells, points)


if __name__ == "__main__":
    write_mesh(Path(__file__).with_name("l_frame.inp"), frame())
