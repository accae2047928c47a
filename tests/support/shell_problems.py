"""Linear problems of MacNeal and Harder's set and others: meshes, supports, loads and published answers."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse.linalg import spsolve

from femflex.fem import Material, Member, Structure, build_structure
from femflex.fem.support import Support, symmetry
from femflex.mesh import Mesh, rectangle
from femflex.mesh.cells import CELL_TYPES


@dataclass(frozen=True)
class Problem:
    """A mesh with supports and nodal forces (group or node -> total force, shared by consistent weights), and the
    displacement asked for: at `node`, or in the mean of a group's edge, along `direction`, `answer`."""

    mesh: Mesh
    thickness: float
    material: Material
    supports: dict
    forces: dict
    node: int | str
    direction: np.ndarray
    answer: float


def mapped(mesh: Mesh, places) -> Mesh:
    return Mesh(places(mesh.points), mesh.cells, mesh.cell_groups, mesh.point_groups)


def edge_weights(mesh: Mesh, group: str) -> dict[int, float]:
    """Consistent weights of the nodes of a group of line cells, their sum 1."""
    found: dict[int, float] = {}
    for name, cells in mesh.group_cells(group).items():
        share = {"line": [0.5, 0.5], "line3": [1 / 6, 1 / 6, 2 / 3]}[name]
        for one in cells:
            length = np.linalg.norm(mesh.points[one[1]] - mesh.points[one[0]])
            for node, part in zip(one, share, strict=True):
                found[int(node)] = found.get(int(node), 0.0) + part * length
    total = sum(found.values())
    return {node: value / total for node, value in found.items()}


def solved(problem: Problem, family: str = "shell", **options) -> tuple[Structure, np.ndarray]:
    """The structure and the displacements (n_points, 3)."""
    section = problem.thickness if family in ("shell", "plate") else None
    group = "volume" if family == "solid" else "surface"
    member = Member(group, family, section, problem.material, options)
    structure = build_structure(problem.mesh, [member], supports=problem.supports)
    held = structure.constrained_dofs(problem.supports)
    free = np.setdiff1d(np.arange(structure.n_dof), held)
    F, f = np.zeros((len(structure.mesh.points), 3)), np.zeros(structure.n_dof)
    for where, force in problem.forces.items():
        if where == "weight":
            f += weight(structure, np.asarray(force))
        elif isinstance(where, str):
            for node, part in edge_weights(structure.mesh, where).items():
                F[node] += part * np.asarray(force)
        else:
            F[where] += force
    f = f + structure.translation.T @ F.ravel()
    x = np.zeros(structure.n_dof)
    x[free] = spsolve(structure.K[free][:, free].tocsc(), f[free])
    return structure, (structure.translation @ x).reshape(-1, 3)


def weight(structure: Structure, force: np.ndarray) -> np.ndarray:
    """Loads (n_dof,) of a force per area, spread as the mass is."""
    total = np.zeros(structure.T.shape[0])
    for block in structure.inertia:
        move = np.tile(np.eye(3), (len(structure.mesh.points), 1))
        rigid = structure.T @ (structure.translation.T @ move)
        mass = block.mass()
        np.add.at(total, block.dofs, np.einsum("elm,em->el", mass, (rigid @ force)[block.dofs]))
    area = sum(block.dm.sum() for block in structure.inertia)
    return structure.T.T @ total / area * _area(structure)


def _area(structure: Structure) -> float:
    return sum(block.weight.sum() for block in structure.strain[:-1] or structure.strain)


def ratio(problem: Problem, family: str = "shell", **options) -> float:
    """Displacement over the published answer."""
    structure, u = solved(problem, family, **options)
    at = {problem.node: 1.0} if not isinstance(problem.node, str) else edge_weights(structure.mesh, problem.node)
    return float(sum(share * u[node] for node, share in at.items()) @ problem.direction / problem.answer)


Z, Y, X = np.eye(3)[::-1]


def straight_beam(cell: str, load: str, shape: str = "rectangular") -> Problem:
    """6 x 0.2 x 0.1, E = 1e7, nu = 0.3, clamped; unit forces at the tip: in plane 0.1081, out of plane 0.4321."""
    m = rectangle(6.0, 0.2, 6, 1, cell)

    def skewed(p):
        x, y, _ = p.T
        k = np.round(x, 9)
        shift = {"rectangular": 0 * x, "parallelogram": (y - 0.1) * np.where((k > 1e-9) & (k < 6 - 1e-9), 1.0, 0.0)}
        shift["trapezoid"] = shift["parallelogram"] * np.where(np.floor(k + 0.5) % 2 < 0.5, 1.0, -1.0)
        return np.stack([x + shift[shape], y, 0 * x], axis=1)

    if CELL_TYPES[cell].order == 1:
        m = mapped(m, skewed)
    tip = m.nearest_point([6, 0, 0])
    way = {"in plane": Y, "out of plane": Z, "axial": X}[load]
    answer = {"in plane": 0.1081, "out of plane": 0.4321, "axial": 3e-5}[load]
    return Problem(
        m,
        0.1,
        Material(1e7, 0.3, 1.0),
        {"left": Support(("x", "y", "z", "rx", "ry", "rz"))},
        {"right": way},
        tip,
        way,
        answer,
    )


def curved_beam(cell: str, load: str, n: int = 6, across: int = 1) -> Problem:
    """Quarter ring, radii 4.12 to 4.32, thickness 0.1, E = 1e7, nu = 0.25; mean displacement of the end.

    In plane 0.08734, pi R^3 / 4 E I_z = 0.08853 of the thin ring. Out of plane 0.5022, Castigliano's theorem with the
    torsion constant J of a rectangle 0.2 x 0.1: R^3 [(pi / 4) / E I_y + (3 pi / 4 - 2) / G J] = 0.5005.
    """
    flat = rectangle(np.pi / 2, 0.2, n, across, cell)
    m = mapped(
        flat,
        lambda p: np.stack([(4.32 - p[:, 1]) * np.sin(p[:, 0]), (4.32 - p[:, 1]) * np.cos(p[:, 0]), 0 * p[:, 0]], 1),
    )
    way, answer = {"in plane": (X, 0.08734), "out of plane": (Z, 0.5022)}[load]
    return Problem(
        m,
        0.1,
        Material(1e7, 0.25, 1.0),
        {"left": Support(("x", "y", "z", "rx", "ry", "rz"))},
        {"right": way},
        "right",
        way,
        answer,
    )


def twisted_beam(cell: str, load: str, thickness: float = 0.32, n: int = 12) -> Problem:
    """12 x 1.1, twisted by 90 deg, E = 29e6, nu = 0.22, unit forces: h = 0.32: 0.005424 and 0.001754; h = 0.05 (per
    1e-6 of force): 1.390 and 0.3431 (MacNeal & Harder; Simo, Fox and Rifai)."""
    flat = rectangle(12.0, 1.1, n, 2 if CELL_TYPES[cell].order == 1 else 1, cell)

    def twisted_point(p):
        a = p[:, 0] / 12 * np.pi / 2
        y = p[:, 1] - 0.55
        return np.stack([p[:, 0], y * np.cos(a), y * np.sin(a)], axis=1)

    m = mapped(flat, twisted_point)
    m = m.with_groups(points={"middle": [m.nearest_point([12, 0, 0])]})
    # in plane of the tip: along z (its width); out of plane: along y
    way = {"in plane": Z, "out of plane": Y}[load]
    answer = {(0.32, "in plane"): 0.005424, (0.32, "out of plane"): 0.001754}
    answer |= {(0.05, "in plane"): 1.390, (0.05, "out of plane"): 0.3431}
    return Problem(
        m,
        thickness,
        Material(29e6, 0.22, 1.0),
        {"left": Support(("x", "y", "z", "rx", "ry", "rz"))},
        {"right": way * 1.0},
        m.nearest_point([12, 0, 0]),
        way,
        answer[thickness, load],
    )


def scordelis_lo(cell: str, n: int) -> Problem:
    """Roof of R = 25, L = 50, 80 deg, h = 0.25, E = 4.32e8, nu = 0, weight 90 per area: 0.3024 at the free edge."""
    flat = rectangle(25.0, np.radians(40), n, n, cell)
    m = mapped(flat, lambda p: np.stack([p[:, 0], 25 * np.sin(p[:, 1]), 25 * np.cos(p[:, 1])], axis=1))
    supports = {"left": Support(("y", "z", "rx")), "right": symmetry([1.0, 0, 0]), "bottom": symmetry([0, 1.0, 0])}
    node = m.nearest_point([25, 25 * np.sin(np.radians(40)), 25 * np.cos(np.radians(40))])
    return Problem(m, 0.25, Material(4.32e8, 0.0, 360.0), supports, {"weight": -Z * 90}, node, -Z, 0.3024)


def hemisphere(cell: str, n: int) -> Problem:
    """R = 10, hole of 18 deg, h = 0.04, E = 6.825e7, nu = 0.3, pulls of 2: 0.0940 (0.0930 converged)."""
    flat = rectangle(np.pi / 2, np.radians(72), n, n, cell)
    m = mapped(
        flat,
        lambda p: (
            10
            * np.stack([np.cos(p[:, 0]) * np.cos(p[:, 1]), np.sin(p[:, 0]) * np.cos(p[:, 1]), np.sin(p[:, 1])], axis=1)
        ),
    )
    m = m.with_groups(points={"held": [m.nearest_point([10, 0, 0])]})
    supports = {"left": symmetry([0, 1.0, 0]), "right": symmetry([1.0, 0, 0]), "held": Support(("z",))}
    one, other = (m.nearest_point(at) for at in ([10, 0, 0], [0, 10, 0]))
    return Problem(m, 0.04, Material(6.825e7, 0.3, 1.0), supports, {one: X, other: -Y}, one, X, 0.0930)


def pinched_cylinder(cell: str, n: int) -> Problem:
    """R = 300, L = 600, h = 3, E = 3e6, nu = 0.3, diaphragms, unit forces: 1.8248e-5. An octant."""
    flat = rectangle(300.0, np.pi / 2, n, n, cell)
    m = mapped(flat, lambda p: np.stack([p[:, 0], 300 * np.cos(p[:, 1]), 300 * np.sin(p[:, 1])], axis=1))
    supports = {
        "left": symmetry([1.0, 0, 0]),
        "right": Support(("y", "z", "rx")),
        "bottom": symmetry([0, 0, 1.0]),
        "top": symmetry([0, 1.0, 0]),
    }
    node = m.nearest_point([0, 300, 0])
    return Problem(m, 3.0, Material(3e6, 0.3, 1.0), supports, {node: -Y / 4}, node, -Y, 1.8248e-5)


def raasch_hook(cell: str, n: int) -> Problem:
    """Arcs of 60 deg, R = 14, and 150 deg, R = 46, width 20, h = 2, E = 3300, nu = 0.35, tip load 1 along the width:
    4.9352 with transverse shear (Knight 1997), in hundreds of an inch/lb: 0.049352."""
    share = 14 * np.radians(60) / (14 * np.radians(60) + 46 * np.radians(150))
    bend = max(1, round(n * share * 1.4))
    a = np.concatenate(
        [
            np.linspace(0, share, bend * CELL_TYPES[cell].order + 1),
            np.linspace(share, 1, (n - bend) * CELL_TYPES[cell].order + 1)[1:],
        ]
    )
    flat = rectangle(1.0, 20.0, n, max(1, n // 4), cell)
    steps = np.linspace(0, 1, n * CELL_TYPES[cell].order + 1)

    def position(p):
        t = np.interp(p[:, 0], steps, a)
        first = np.minimum(t / share, 1) * np.radians(60)
        second = np.maximum((t - share) / (1 - share), 0) * np.radians(150)
        x = 14 * np.sin(first)
        y = 14 * (1 - np.cos(first))
        # the second arc turns the other way round, tangent to the first
        c = np.array([14 * np.sin(np.radians(60)), 14 * (1 - np.cos(np.radians(60)))])
        n1 = np.array([np.sin(np.radians(60)), -np.cos(np.radians(60))])
        centre = c + 46 * n1
        ang = np.arctan2(-n1[1], -n1[0]) - second
        far = t > share
        x = np.where(far, centre[0] + 46 * np.cos(ang), x)
        y = np.where(far, centre[1] + 46 * np.sin(ang), y)
        return np.stack([x, y, p[:, 1]], axis=1)

    m = mapped(flat, position)
    end = m.points[m.group_points("right")].mean(axis=0)
    tip = m.nearest_point(end)
    return Problem(
        m,
        2.0,
        Material(3300.0, 0.35, 1.0),
        {"left": Support(("x", "y", "z", "rx", "ry", "rz"))},
        {"right": Z},
        tip,
        Z,
        4.9352,
    )
