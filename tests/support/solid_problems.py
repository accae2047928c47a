"""MacNeal and Harder's problems on solids of every cell: boxes mapped onto thin structures, one element thick."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.sparse.linalg import spsolve

from femflex.fem import Material, Member, build_structure
from femflex.fem.support import Support, symmetry
from femflex.mesh import Mesh
from femflex.mesh.cells import CELL_TYPES, FACES
from femflex.warning import PhysicsWarning
from support.element_meshes import brick

X, Y, Z = np.eye(3)
FIXED = Support(("x", "y", "z"))
WEIGHTS = {  # of nodes of a face under a uniform traction
    3: np.full(3, 1 / 3), 4: np.full(4, 1 / 4), 6: np.array([0, 0, 0, 1, 1, 1]) / 3,
    8: np.array([-1, -1, -1, -1, 4, 4, 4, 4]) / 12, 9: np.array([1, 1, 1, 1, 4, 4, 4, 4, 16]) / 36,
}  # fmt: skip


@dataclass(frozen=True)
class SolidProblem:
    """A map of the unit box (a, b, c), c over the thickness, with supports and a load on parts of its boundary.

    counts    elements along a and b
    supports  part -> support; parts are words of a, b, c at an end: "a0", "a1b0" (an edge)
    load      part (or "weight") and total force; the answer is the mean displacement of `at` along `way`
    """

    place: Callable[[np.ndarray], np.ndarray]
    counts: tuple[int, int]
    material: Material
    supports: dict
    loads: tuple[tuple[str, np.ndarray], ...]
    at: str
    way: np.ndarray
    answer: float


def nodes_of_boundary(unit: np.ndarray, name: str) -> np.ndarray:
    """Nodes of a part of the box's boundary."""
    on = np.ones(len(unit), bool)
    for axis, end in zip(name[::2], name[1::2], strict=True):
        on &= np.abs(unit[:, "abc".index(axis)] - float(end)) < 1e-9
    return np.flatnonzero(on)


def faces(kind: str) -> list[list[int]]:
    """Nodes of the faces of a cell: corners, middles of the edges in turn, centre."""
    cell = CELL_TYPES[kind]
    node = {frozenset(parents): k for k, parents in enumerate(cell.parents, cell.n_corners)}
    found = []
    for corners in FACES[cell.shape]:
        edges = [frozenset(pair) for pair in zip(corners, corners[1:] + corners[:1], strict=True)]
        more = [*edges, frozenset(corners)] if cell.order == 2 else []
        found.append([*corners, *(node[one] for one in more if one in node)])
    return found


def shares(mesh: Mesh, unit: np.ndarray, name: str) -> dict[int, float]:
    """Nodes of a part of the boundary with their shares of a uniform load."""
    nodes = nodes_of_boundary(unit, name)
    found: dict[int, float] = {}
    if len(name) == 2:  # a face
        inside = set(nodes.tolist())
        for kind, cells in mesh.cells.items():
            for face in faces(kind):
                for own in cells[:, face]:
                    if inside.issuperset(own.tolist()):
                        corners = mesh.points[own[: 3 if len(own) in (3, 6) else 4]]
                        diagonals = corners[2] - corners[0], corners[-1] - corners[1]
                        area = np.linalg.norm(np.cross(*diagonals)) / 2 if len(corners) == 4 else (
                            np.linalg.norm(np.cross(corners[1] - corners[0], corners[2] - corners[0])) / 2
                        )  # fmt: skip
                        for node, share in zip(own.tolist(), WEIGHTS[len(own)], strict=True):
                            found[node] = found.get(node, 0.0) + share * area
    else:  # the line through the thickness at an edge
        c = unit[nodes, 2]
        share = np.where(np.abs(c - 0.5) < 1e-9, 2 / 3, 1 / 6) if len(nodes) == 3 else np.full(len(nodes), 0.5)
        found = dict(zip(nodes.tolist(), share.tolist(), strict=True))
    total = sum(found.values())
    return {node: value / total for node, value in found.items()}


def ratio(problem: SolidProblem, cell: str, quiet: bool = True, **options: object) -> float:
    """Displacement over the published answer; quiet: without warnings of locking."""
    box = brick(cell, (*problem.counts, 1), (1.0, 1.0, 1.0))
    unit = box.points
    groups = {name: nodes_of_boundary(unit, name) for name in problem.supports}
    mesh = Mesh(problem.place(unit), box.cells, box.cell_groups, groups)
    member = Member("volume", "solid", None, problem.material, options)
    with warnings.catch_warnings():
        if quiet:
            warnings.simplefilter("ignore", PhysicsWarning)
        s = build_structure(mesh, [member], supports=problem.supports)
    free = np.setdiff1d(np.arange(s.n_dof), s.constrained_dofs(problem.supports))
    f = np.zeros(s.n_dof)
    for name, force in problem.loads:
        if name == "weight":  # a force per volume
            move = s.translation.T @ np.tile(force, len(mesh.points))
            f += s.M @ move / problem.material.density
            continue
        F = np.zeros((len(mesh.points), 3))
        for node, share in shares(mesh, unit, name).items():
            F[node] += share * force
        f += s.translation.T @ F.ravel()
    x = np.zeros(s.n_dof)
    x[free] = spsolve(s.K[free][:, free].tocsc(), f[free])
    u = (s.translation @ x).reshape(-1, 3)
    seen = sum(share * u[node] for node, share in shares(mesh, unit, problem.at).items())
    return float(seen @ problem.way / problem.answer)


def straight(way: str, n: int = 6) -> SolidProblem:
    """6 x 0.2 x 0.1, E = 1e7, nu = 0.3: unit forces at the tip."""
    answer, force = {"along": (3e-5, X), "in plane": (0.1081, Y), "out of plane": (0.4321, Z)}[way]
    size = np.array([6.0, 0.2, 0.1])
    return SolidProblem(
        lambda p: p * size, (n, 1), Material(1e7, 0.3, 1.0), {"a0": FIXED}, (("a1", force),), "a1", force, answer
    )


def curved(way: str, n: int = 6, across: int = 1) -> SolidProblem:
    """Quarter ring of radii 4.12 and 4.32, thickness 0.1, E = 1e7, nu = 0.25."""
    answer, force = {"in plane": (0.08734, X), "out of plane": (0.5022, Z)}[way]

    def position(p: np.ndarray) -> np.ndarray:
        r, angle = 4.32 - 0.2 * p[:, 1], np.pi / 2 * p[:, 0]
        return np.stack([r * np.sin(angle), r * np.cos(angle), -0.1 * p[:, 2]], axis=1)

    return SolidProblem(
        position, (n, across), Material(1e7, 0.25, 1.0), {"a0": FIXED}, (("a1", force),), "a1", force, answer
    )


def twisted(way: str, thickness: float = 0.32, n: int = 12) -> SolidProblem:
    """12 x 1.1, twisted by 90 deg, E = 29e6, nu = 0.22."""
    answer = {(0.32, "in plane"): 0.005424, (0.32, "out of plane"): 0.001754}
    answer |= {(0.05, "in plane"): 1.390, (0.05, "out of plane"): 0.3431}
    force = {"in plane": Z, "out of plane": Y}[way]

    def position(p: np.ndarray) -> np.ndarray:
        angle, y, z = np.pi / 2 * p[:, 0], 1.1 * (p[:, 1] - 0.5), thickness * (p[:, 2] - 0.5)
        c, s = np.cos(angle), np.sin(angle)
        return np.stack([12 * p[:, 0], y * c - z * s, y * s + z * c], axis=1)

    return SolidProblem(
        position, (n, 2), Material(29e6, 0.22, 1.0), {"a0": FIXED}, (("a1", force),), "a1", force,
        answer[thickness, way],
    )  # fmt: skip


def scordelis_lo(n: int) -> SolidProblem:
    """Roof of R = 25, L = 50, 80 deg, h = 0.25, E = 4.32e8, nu = 0, weight 90 per area."""

    def position(p: np.ndarray) -> np.ndarray:
        r, angle = 25 + 0.25 * (p[:, 2] - 0.5), np.radians(40) * p[:, 1]
        return np.stack([25 * p[:, 0], r * np.sin(angle), r * np.cos(angle)], axis=1)

    held = {"a0": Support(("y", "z")), "a1": symmetry(X), "b0": symmetry(Y)}
    return SolidProblem(
        position, (n, n), Material(4.32e8, 0.0, 360.0), held, (("weight", -360 * Z),), "a1b1", -Z, 0.3024
    )


def hemisphere(n: int) -> SolidProblem:
    """R = 10, hole of 18 deg, h = 0.04, E = 6.825e7, nu = 0.3, pulls of 2 (1 on a quarter)."""

    def position(p: np.ndarray) -> np.ndarray:
        r, a, b = 10 + 0.04 * (p[:, 2] - 0.5), np.pi / 2 * p[:, 0], np.radians(72) * p[:, 1]
        return r[:, None] * np.stack([np.cos(a) * np.cos(b), np.sin(a) * np.cos(b), np.sin(b)], axis=1)

    held = {"a0": symmetry(Y), "a1": symmetry(X), "a0b0c0": Support(("z",))}
    return SolidProblem(
        position, (n, n), Material(6.825e7, 0.3, 1.0), held, (("a0b0", X), ("a1b0", -Y)), "a0b0", X, 0.0930
    )


def pinched_cylinder(n: int) -> SolidProblem:
    """R = 300, L = 600, h = 3, E = 3e6, nu = 0.3, diaphragms, unit forces. An octant."""

    def position(p: np.ndarray) -> np.ndarray:
        r, angle = 300 - 3 * (p[:, 2] - 0.5), np.pi / 2 * p[:, 1]
        return np.stack([300 * p[:, 0], r * np.cos(angle), r * np.sin(angle)], axis=1)

    held = {"a0": symmetry(X), "a1": Support(("y", "z")), "b0": symmetry(Z), "b1": symmetry(Y)}
    return SolidProblem(position, (n, n), Material(3e6, 0.3, 1.0), held, (("a0b0", -Y / 4),), "a0b0", -Y, 1.8248e-5)


def raasch_hook(n: int) -> SolidProblem:
    """Arcs of R = 14, 60 deg, and R = 46, 150 deg, that turn opposite ways, 20 wide and 2 thick, E = 3300, nu = 0.35.

    A force along the width at the end: 4.9352 (Knight, AIAA J. 35 (1997) 1, with transverse shear).
    """
    first, second, radii = np.radians(60), np.radians(150), (14.0, 46.0)
    share = max(1, round(n * 1.4 * radii[0] * first / (radii[0] * first + radii[1] * second))) / n
    turn = np.array([np.sin(first), -np.cos(first)])  # from where the arcs meet to the middle of the second
    middle = radii[0] * np.array([np.sin(first), 1 - np.cos(first)]) + radii[1] * turn

    def position(p: np.ndarray) -> np.ndarray:
        along, out = p[:, 0], 2.0 * (p[:, 2] - 0.5)
        near, far = first * along / share, first + np.pi / 2 - second * (along - share) / (1 - share)
        r = radii[0] + out, radii[1] - out
        x = np.where(along <= share, r[0] * np.sin(near), middle[0] + r[1] * np.cos(far))
        y = np.where(along <= share, radii[0] - r[0] * np.cos(near), middle[1] + r[1] * np.sin(far))
        return np.stack([x, y, 20 * p[:, 1]], axis=1)

    return SolidProblem(
        position, (n, max(1, n // 4)), Material(3300.0, 0.35, 1.0), {"a0": FIXED}, (("a1", Z),), "a1", Z, 4.9352
    )


def thick_cylinder(nu: float) -> SolidProblem:
    """Radii 3 to 9, sector of 10 deg, plane strain, E = 1000, pressure 1 inside (Timoshenko's closed form)."""
    angle, radii = np.radians(10), np.array([3, 3.5, 4.2, 5.2, 6.75, 9])

    def position(p: np.ndarray) -> np.ndarray:
        r, turn = np.interp(5 * p[:, 0], range(6), radii), angle * (p[:, 1] - 0.5)
        return np.stack([r * np.cos(turn), r * np.sin(turn), p[:, 2]], axis=1)

    s, c = np.sin(angle / 2), np.cos(angle / 2)
    answer = (1 + nu) / 1000 * 9 / 72 * ((1 - 2 * nu) * 3 + 81 / 3)
    held = {"b0": symmetry(np.array([s, c, 0])), "b1": symmetry(np.array([-s, c, 0])), "c0": symmetry(Z)}
    return SolidProblem(
        position, (5, 1), Material(1000.0, nu, 1.0), held | {"c1": symmetry(Z)}, (("a0", 6 * s * X),), "a0", X, answer
    )
