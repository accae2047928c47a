"""Makes beam10.msh: a straight beam of 10 m along x, 8 line cells. Groups: beam, root, tip."""

from pathlib import Path

from femflex.mesh import Mesh, line, write_mesh


def beam() -> Mesh:
    """The beam from the origin."""
    plain = line([[0.0, 0.0, 0.0], [10.0, 0.0, 0.0]], 8)
    points = {"root": plain.point_groups["start"], "tip": plain.point_groups["end"]}
    return Mesh(plain.points, plain.cells, {"beam": plain.cell_groups["line"]}, points)


if __name__ == "__main__":
    write_mesh(Path(__file__).with_name("beam10.msh"), beam(), binary=False)
