"""Makes scole_mast.msh: a straight mast of 130 ft along -z, 10 line cells. Groups: mast, root, tip."""

from pathlib import Path

from femflex.mesh import Mesh, line, write_mesh

LENGTH = 130 * 0.3048  # m


def mast() -> Mesh:
    """The mast from the origin."""
    plain = line([[0.0, 0.0, 0.0], [0.0, 0.0, -LENGTH]], 10)
    points = {"root": plain.point_groups["start"], "tip": plain.point_groups["end"]}
    return Mesh(plain.points, plain.cells, {"mast": plain.cell_groups["line"]}, points)


if __name__ == "__main__":
    write_mesh(Path(__file__).with_name("scole_mast.msh"), mast(), binary=False)
