"""Makes boom.msh: a straight boom of 33 m, 20 line cells, along (1, 2, 2) / 3. Groups: boom, root, tip."""

from pathlib import Path

from femflex.mesh import Mesh, line, write_mesh

LENGTH = 33.0  # m
DIRECTION = (1 / 3, 2 / 3, 2 / 3)  # a unit vector along no axis


def boom() -> Mesh:
    """The boom from the origin."""
    plain = line([[0.0, 0.0, 0.0], [LENGTH * c for c in DIRECTION]], 20)
    points = {"root": plain.point_groups["start"], "tip": plain.point_groups["end"]}
    return Mesh(plain.points, plain.cells, {"boom": plain.cell_groups["line"]}, points)


if __name__ == "__main__":
    write_mesh(Path(__file__).with_name("boom.msh"), boom(), binary=False)
