"""One table of element families: small meshes, members and closed-form energies, for tests of all families alike.

A new family is a new row of FAMILIES: its meshes, its member, and the uniform states of strain that it represents.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache

import numpy as np

from femflex.arrays import Array
from femflex.fem import Material, Member, Structure, build_structure
from femflex.fem.sections import CableSection, FullSection, Rectangle
from femflex.fem.sections.laminates import isotropic
from femflex.mesh import Mesh, line, rectangle
from femflex.mesh.quality import sizes
from femflex.mesh.second_order import raise_order
from support.element_meshes import SOLIDS, brick, mixed_bricks, mixed_sheet, straight_sided
from support.plate_models import random_rotation

METAL = Material(70e9, 0.3, 2700.0)
PLACE = random_rotation(5)  # the position in which the patches lie
THICKNESS = 0.05
BAR = Rectangle(0.1, 0.06)
TENSION = 2e5  # of sheets [N/m] and ropes [N]
COUPLED = (
    np.diag([3e6, 1e6, 1.2e6, 400.0, 900.0, 700.0])
    + np.diag([0, 0, 0, 90.0, 60.0], 1)
    + np.diag([0, 0, 0, 90.0, 60.0], -1)
)
MASS = np.diag([2.0, 2.0, 2.0, 0.02, 0.01, 0.01])


@dataclass(frozen=True)
class State:
    """A state of uniform strain: displacements and rotations (n, 3) at places (n, 3), and twice its energy [J]."""

    u: Callable[[Array], Array]
    theta: Callable[[Array], Array]
    energy: float


@dataclass(frozen=True)
class Family:
    """A row of the table.

    patch    a flat or straight mesh of unequal cells, 1 m by 0.8 m by 0.6 m; rough   one that is curved or bent
    member   of a rotation C of the mesh; measure   volume, area or length of the patch; mass   of the patch [kg]
    volume   enclosed by the drawn surface of the patch, if it is closed; states   uniform strains of the patch
    second   int x x^T dm about the corner or end of the patch, if it is known
    stress   von Mises stress, of a line its axial stress, under the first of these states, if it is known
    """

    patch: Mesh
    rough: Mesh
    member: Callable[[Array], Member]
    mass: float
    states: tuple[State, ...]
    volume: float | None = None
    stress: float | None = None
    second: Array | None = None


def zero(x: Array) -> Array:
    return np.zeros_like(x)


def von_mises(s: Array) -> float:
    """Of stresses xx, yy, zz, yz, xz, xy."""
    normal = (s[0] - s[1]) ** 2 + (s[1] - s[2]) ** 2 + (s[2] - s[0]) ** 2
    return float(np.sqrt(normal / 2 + 3 * (s[3] ** 2 + s[4] ** 2 + s[5] ** 2)))


def measure(mesh: Mesh, group: str) -> float:
    return float(sum(sizes(mesh.points, name, nodes).sum() for name, nodes in mesh.group_cells(group).items()))


def solid(patch: Mesh, rough: Mesh) -> Family:
    H = np.random.default_rng(1).normal(size=(3, 3))
    e = (H + H.T) / 2
    lam, mu = METAL.E * METAL.nu / (1 + METAL.nu) / (1 - 2 * METAL.nu), METAL.G
    sigma = lam * np.trace(e) * np.eye(3) + 2 * mu * e
    volume = measure(patch, "volume")
    state = State(lambda x: x @ H.T, zero, volume * float(np.sum(sigma * e)))
    stress = von_mises(np.array([*np.diag(sigma), sigma[1, 2], sigma[0, 2], sigma[0, 1]]))
    member = lambda C: Member("volume", "solid", None, METAL, {"order": 1})  # noqa: E731
    return Family(patch, rough, member, METAL.density * volume, (state,), volume, stress)


def sheet(family: str, patch: Mesh, rough: Mesh, twist: float = 0.9, h: float = THICKNESS, **options: object) -> Family:
    """A plate, shell or membrane; the twist w,xy of its state of bending; a membrane has no bending, but tension."""
    section = isotropic(h, METAL)
    H = np.array([[1.0, 0.3], [0.5, -0.7]])
    e, k = np.array([H[0, 0], H[1, 1], H[0, 1] + H[1, 0]]), np.array([0.6, -0.4, twist])  # w,xx w,yy w,xy
    kappa = k * [1, 1, 2]
    tension = 0.8 * TENSION * np.sum(H * H) if family == "membrane" else 0.0

    def flat(x: Array) -> Array:
        return np.column_stack([x[:, :2] @ H.T, 0 * x[:, 0]])

    def bend(p: Array) -> Array:
        x, y, _ = p.T
        return np.stack([0 * x, 0 * x, k[0] * x * x / 2 + k[1] * y * y / 2 + k[2] * x * y], axis=1)

    def turn(p: Array) -> Array:
        x, y, _ = p.T
        return np.stack([k[1] * y + k[2] * x, -(k[0] * x + k[2] * y), 0 * x], axis=1)

    states = [State(flat, zero, 0.8 * float(e @ section.A @ e) + tension)]
    if family != "membrane":
        states.append(State(bend, turn, 0.8 * float(kappa @ section.D @ kappa)))
    xx, yy, xy = section.A @ e / h
    given = {"prestress": (TENSION, TENSION, 0.0)} if family == "membrane" else {}
    member = lambda C: Member("surface", family, section, None, {"axis": C[:, 0], **given, **options})  # noqa: E731
    volume = None if family == "membrane" else 0.8 * h
    stress = None if family == "membrane" else von_mises(np.array([xx, yy, 0, 0, 0, xy]))
    m, layer = METAL.density * h * 0.8, 0.0 if family == "membrane" else h * h / 12
    second = m * np.array([[1 / 3, 0.2, 0], [0.2, 0.64 / 3, 0], [0, 0, layer]])
    return Family(patch, rough, member, m, tuple(states), volume, stress, second)


STRAIGHT = Mesh(
    np.array([[0, 0, 0], [0.3, 0, 0], [0.45, 0, 0], [1.0, 0, 0]]),
    {"line": [[0, 1], [2, 1], [2, 3]]}, {"line": {"line": [0, 1, 2]}},
)  # fmt: skip
BENT = line([[0, 0, 0], [0.7, 0.2, 0.1], [1.0, 0.9, -0.3]], 3)


def beam(section: object = BAR, **options: object) -> Family:
    """Its section's y axis lies along the patch's y axis; stretch, both bends and twist."""
    if isinstance(section, FullSection):
        stiffness, mass, volume, stress = COUPLED, MASS[0, 0], None, None
    else:
        r = BAR.resultants(METAL, np.zeros(1), np.ones(1))
        EA, EIz, EIy, GJ = (float(np.ravel(value)[0]) for value in (r.EA, r.EIz, r.EIy, r.GJ))
        stiffness, mass, volume, stress = np.diag([EA, 0, 0, GJ, EIy, EIz]), METAL.density * 0.006, 0.006, METAL.E
    unit = np.eye(3)

    def field(k: int) -> tuple[Callable[[Array], Array], Callable[[Array], Array]]:
        """Unit stretch, twist, curvature about y and about z."""
        x = lambda p: p[:, :1]  # noqa: E731
        return {
            0: (lambda p: x(p) * unit[0], zero),
            3: (zero, lambda p: x(p) * unit[0]),
            4: (lambda p: -(x(p) ** 2) / 2 * unit[2], lambda p: x(p) * unit[1]),
            5: (lambda p: x(p) ** 2 / 2 * unit[1], lambda p: x(p) * unit[2]),
        }[k]

    states = tuple(State(*field(k), float(stiffness[k, k])) for k in (0, 3, 4, 5))

    def member(C: Array) -> Member:
        given = {"orientation": tuple(C[:, 1]), "extent": 9.0, **options}
        return Member("line", "beam", section, None if isinstance(section, FullSection) else METAL, given)

    patch = STRAIGHT if volume else Mesh(STRAIGHT.points, {"line": [[0, 1], [1, 2], [2, 3]]}, STRAIGHT.cell_groups)
    second = mass * np.diag([1 / 3, 0.01 / 12, 0.0036 / 12]) if volume else None
    return Family(patch, BENT, member, float(mass), states, volume, stress, second)


def rope(family: str, **options: object) -> Family:
    section = CableSection(1e6, 0.3)
    tension = TENSION if family == "tether" else 0.0
    given = {"prestress": TENSION, **options} if family == "tether" else options
    state = State(lambda p: p * [1, 0, 0], zero, 1e6 + tension)
    return Family(STRAIGHT, BENT, lambda C: Member("line", family, section, None, given), 0.3, (state,))


def shaken(cell: str, n: int = 3) -> Mesh:
    """A rectangle with shaken corners and straight sides."""
    corner = "triangle" if "triangle" in cell else "quad"
    mesh = rectangle(1.0, 0.8, n, n, corner)
    inner = (np.abs(mesh.points[:, 0] - 0.5) < 0.49) & (np.abs(mesh.points[:, 1] - 0.4) < 0.39)
    shift = np.random.default_rng(0).uniform(-0.07, 0.07, mesh.points.shape) * [1, 1, 0]
    return second_order(Mesh(mesh.points + inner[:, None] * shift, mesh.cells, mesh.cell_groups), cell)


def second_order(mesh: Mesh, cell: str) -> Mesh:
    """The mesh with middle nodes, and nodes in the centres of its quadrilaterals, as the cell has them."""
    if cell[-1] in "689":
        mesh = raise_order(mesh, {kind: np.arange(len(rows)) for kind, rows in mesh.cells.items() if kind != "line"})
    return raise_order(mesh, {"quad8": np.arange(len(mesh.cells["quad8"]))}) if cell == "quad9" else mesh


def graded() -> Mesh:
    """Rectangles of unequal sides."""
    mesh = rectangle(1.0, 0.8, 3, 2, "quad")
    x, y, z = mesh.points.T
    x, y = np.interp(x, [0, 1 / 3, 2 / 3, 1], [0, 0.2, 0.7, 1]), np.interp(y, [0, 0.4, 0.8], [0, 0.5, 0.8])
    return Mesh(np.stack([x, y, z], axis=1), mesh.cells, mesh.cell_groups)


def bowl(cell: str, n: int = 2) -> Mesh:
    """A rectangle on a paraboloid that twists: all four-node elements are warped."""
    flat = rectangle(1.0, 0.8, n, n, cell)
    x, y, _ = flat.points.T
    return Mesh(np.stack([x, y, 0.3 * x * x + 0.1 * y * y + 0.2 * x * y], axis=1), flat.cells, flat.cell_groups)


SHELLS = ("triangle", "triangle6", "quad", "quad8", "quad9")
FLAT = shaken("triangle")
FAMILIES: dict[str, Family] = {
    **{f"solid {c}": solid(straight_sided(brick(c, warp=0.1)), brick(c, (1, 1, 1), warp=0.1)) for c in SOLIDS},
    "solid of mixed cells": solid(mixed_bricks(seed=0), mixed_bricks((2, 2, 2), seed=1)),
    **{f"shell {cell}": sheet("shell", shaken(cell), bowl(cell)) for cell in SHELLS},
    "shell of mixed cells": sheet("shell", mixed_sheet(seed=0), mixed_sheet(2, seed=1)),
    "shell of mixed cells of second order": sheet(
        "shell", second_order(mixed_sheet(seed=2), "triangle6"), second_order(mixed_sheet(2, seed=1), "triangle6")
    ),
    "plate dkt": sheet("plate", FLAT, FLAT, element="dkt"),
    "plate dkmt": sheet("plate", FLAT, FLAT, element="dkmt"),
    "plate of rectangles": sheet("plate_bfs", graded(), graded(), twist=0.0),
    "membrane": sheet("membrane", FLAT, FLAT, h=1e-3),
    "membrane of second order": sheet("membrane", shaken("triangle6"), rectangle(1.0, 0.8, 2, 2, "triangle6"), h=1e-3),
    "beam of order 3": beam(),
    "beam of order 5 that shears": beam(order=5, shear=True),
    "beam of coupled stiffness": beam(FullSection(COUPLED, MASS)),
    "rod": rope("rod"),
    "tether": rope("tether", order=3),
}


@cache
def patch_of(name: str) -> Structure:
    """The patch of a family, turned by PLACE."""
    row = FAMILIES[name]
    return build_structure(row.patch.rotated(PLACE), [row.member(PLACE)])


@cache
def rough_of(name: str, turned: bool = False) -> Structure:
    """The curved or bent mesh of a family; if `turned`, in another position."""
    row, C = FAMILIES[name], random_rotation(3) if turned else np.eye(3)
    mesh = row.rough.rotated(C).translated([30.0, -20.0, 10.0]) if turned else row.rough
    return build_structure(mesh, [row.member(C)])
