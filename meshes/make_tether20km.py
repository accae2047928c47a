"""Makes tether20km.msh: a tether of 20 km along x, 10 line cells. Groups: tether, root, tip."""

from pathlib import Path

from femflex.mesh import Mesh, line, write_mesh


def tether() -> Mesh:
    """The tether from the origin."""
    plain = line([[0.0, 0.0, 0.0], [20e3, 0.0, 0.0]], 10)
    points = {"root": plain.point_groups["start"], "tip": plain.point_groups["end"]}
    return Mesh(plain.points, plain.cells, {"tether": plain.cell_groups["line"]}, points)


if __name__ == "__main__":
    write_mesh(Path(__file__).with_name("tether20km.msh"), tether(), binary=False)
