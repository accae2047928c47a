"""Makes strip.bdf: a plate strip of 2 x 0.4 m, 10 x 2 four-node plates, with two properties, as Nastran bulk data.

Properties: inner (x < 1) and outer. SETs: 1 root (points at x = 0), 2 tip (points at x = 2), 3 strip (all plates).
Read by name, or by number: read_mesh("strip.bdf", groups={"clamp": "SET 1", "skin": "PID 1"}).
"""

from pathlib import Path

import numpy as np

from femflex.mesh import Mesh, rectangle, write_mesh

LENGTH, WIDTH = 2.0, 0.4  # m


def strip() -> Mesh:
    """The strip from the origin."""
    plain = rectangle(LENGTH, WIDTH, 10, 2, "quad")
    middle = plain.points[plain.cells["quad"]].mean(axis=1)
    cells = {
        "inner": {"quad": np.flatnonzero(middle[:, 0] < LENGTH / 2)},
        "outer": {"quad": np.flatnonzero(middle[:, 0] > LENGTH / 2)},
        "strip": {"quad": np.arange(len(middle))},
    }
    points = {"root": plain.group_points("left"), "tip": plain.group_points("right")}
    return Mesh(plain.points, {"quad": plain.cells["quad"]}, cells, points)


if __name__ == "__main__":
    write_mesh(Path(__file__).with_name("strip.bdf"), strip())
