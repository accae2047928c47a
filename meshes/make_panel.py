"""Makes panel.msh (triangles, text) and panel6.msh (six-node triangles, binary) with Gmsh, format 4.1.

A solar panel of 6 x 1.5 m, 0 <= x <= 6, |y| <= 0.75, z = 0. Groups: panel (surface), root (edge x = 0), hinge_1 and
hinge_2 (points of the root at y = -0.5 and 0.5), tip_corner (point at x = 6, y = 0.75).
"""

from pathlib import Path

import gmsh

LENGTH, WIDTH, HINGE = 6.0, 1.5, 0.5  # m


def make(path: Path, size: float, order: int) -> None:
    """Mesh the panel with triangles of about size [m] and write it."""
    gmsh.clear()
    geo = gmsh.model.geo
    root = [geo.addPoint(0, y, 0, size) for y in (WIDTH / 2, HINGE, -HINGE, -WIDTH / 2)]
    tip = [geo.addPoint(LENGTH, y, 0, size) for y in (-WIDTH / 2, WIDTH / 2)]
    corners = [*root, *tip]
    edges = [geo.addLine(a, b) for a, b in zip(corners, corners[1:] + corners[:1], strict=True)]
    surface = geo.addPlaneSurface([geo.addCurveLoop(edges)])
    geo.synchronize()
    gmsh.model.addPhysicalGroup(2, [surface], name="panel")
    gmsh.model.addPhysicalGroup(1, edges[:3], name="root")
    for name, point in (("hinge_1", root[2]), ("hinge_2", root[1]), ("tip_corner", tip[1])):
        gmsh.model.addPhysicalGroup(0, [point], name=name)
    gmsh.model.mesh.generate(2)
    gmsh.model.mesh.setOrder(order)
    gmsh.option.setNumber("Mesh.Binary", order == 2)
    gmsh.write(str(path))


if __name__ == "__main__":
    gmsh.initialize()
    gmsh.option.setNumber("General.Terminal", 0)
    gmsh.option.setNumber("Mesh.Algorithm", 6)  # frontal Delaunay
    make(Path(__file__).with_name("panel.msh"), 0.25, 1)
    make(Path(__file__).with_name("panel6.msh"), 0.4, 2)
    gmsh.finalize()
