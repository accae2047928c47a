"""Makes sail.msh: a membrane of 2 m by 2 m whose sides are arcs of 5.05 m, drawn in, in a square frame.

Second-order triangles "membrane", second-order lines "cables" along its sides, lines "frame" between its corners.
Groups of points: root (middle of the frame's lower side), centre, corners.
"""

from itertools import pairwise
from pathlib import Path

import numpy as np

from femflex.mesh import Mesh, rectangle, write_mesh

RADIUS, CELLS = 5.05, 6  # m; cells along a side, even


def sag(s: np.ndarray) -> np.ndarray:
    """How far the arcs are drawn in at s from the middle of a side [m]."""
    return np.sqrt(RADIUS**2 - s**2) - np.sqrt(RADIUS**2 - 1.0)


def sail() -> Mesh:
    """The membrane, its cables and its frame in the plane z = 0 about the origin."""
    flat = rectangle(2.0, 2.0, CELLS, CELLS, "triangle6")
    x, y = flat.points[:, 0] - 1.0, flat.points[:, 1] - 1.0
    points = np.column_stack([x * (1 - sag(y)), y * (1 - sag(x)), np.zeros(len(x))])
    names = [f"{b}_{a}" for b, a in (("bottom", "left"), ("bottom", "right"), ("top", "right"), ("top", "left"))]
    corners = [int(flat.point_groups[name][0]) for name in names]
    lines, more, root = [], [], -1
    for i, a in enumerate(corners):
        b = corners[(i + 1) % 4]
        inner = [len(points) + len(more) + k for k in range(3)]
        more += [points[a] + (points[b] - points[a]) * s for s in (0.25, 0.5, 0.75)]
        chain = [a, *inner, b]
        lines += list(pairwise(chain))
        root = inner[1] if i == 0 else root
    cells = {**flat.cells, "line": np.array(lines)}
    cables = np.concatenate([flat.cell_groups[side]["line3"] for side in ("left", "right", "bottom", "top")])
    groups = {
        "membrane": flat.cell_groups["surface"],
        "cables": {"line3": cables},
        "frame": {"line": np.arange(len(lines))},
    }
    centre = int(np.argmin(x**2 + y**2))
    return Mesh(np.concatenate([points, more]), cells, groups, {"root": [root], "centre": [centre], "corners": corners})


if __name__ == "__main__":
    write_mesh(Path(__file__).with_name("sail.msh"), sail(), binary=False)
