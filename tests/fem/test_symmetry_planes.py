"""Half a structure on a plane of symmetry has the symmetric modes of the whole, and by antisymmetry the others."""

from __future__ import annotations

import numpy as np
import pytest
from support.plate_models import METAL, frequencies, random_rotation

from femflex.fem import Member, build_structure
from femflex.fem.sections import Rectangle
from femflex.fem.sections.laminates import Lamina, Ply, sandwich
from femflex.fem.support import antisymmetry, symmetry
from femflex.mesh import Mesh, box, line, rectangle

SANDWICH = sandwich(Ply(Lamina.isotropic(METAL), 0.001), 0.02, Lamina.core(30.0, 20e6))
ROUNDING = 1e-7  # of K in the lowest frequency, times three


def mirrored(half: Mesh) -> Mesh:
    """The half and its image in the plane x = 0, joined."""
    image = Mesh(half.points * [-1, 1, 1], half.cells, half.cell_groups, half.point_groups)
    return half.merged(image, tolerance=1e-9)


def curved(cell: str, shape, n: int = 4) -> Mesh:
    """A sheet over 0 <= x <= 1 and 0 <= y <= 0.8, lifted to z = shape(x, y)."""
    flat = rectangle(1.0, 0.8, n, n, cell)
    x, y, _ = flat.points.T
    return Mesh(np.stack([x, y, shape(x, y)], axis=1), flat.cells, flat.cell_groups, flat.point_groups)


SHEETS = {
    "dome": lambda x, y: 0.3 - 0.3 * x**2 - 0.2 * (y - 0.5) ** 2,
    "roof, its ridge in the plane": lambda x, y: -0.5 * x + 0.1 * y,
    "steep roof": lambda x, y: -2.0 * x,
    "cylinder across the plane": lambda x, y: -0.35 * x**2,
    "cylinder along the plane": lambda x, y: -0.3 * (y - 0.3) ** 2,
    "flat": lambda x, y: 0.0 * x,
}


def whole_and_half_frequencies(
    half: Mesh, members: list[Member], clamp: str | None, C: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """The lowest frequencies of the whole and of both halves together, all rotated by C."""
    whole = build_structure(mirrored(half).rotated(C), members)
    fixed = whole.clamped_dofs(clamp)
    n = 12
    expected = frequencies(whole, fixed, n)
    half_frequencies = []
    for support in (symmetry(C[:, 0]), antisymmetry(C[:, 0])):
        supports = {clamp: ("x", "y", "z", "rx", "ry", "rz"), "left": support}
        structure = build_structure(half.rotated(C), members, supports=supports)
        half_frequencies.append(frequencies(structure, structure.constrained_dofs(supports), n))
    return expected, np.sort(np.concatenate(half_frequencies))[:n]


RECTANGLES = ("cylinder across the plane", "cylinder along the plane", "flat", "steep roof")
ROWS = [(element, sheet) for element in ("dkmt", "dkt") for sheet in SHEETS] + [
    ("rectangles", sheet) for sheet in RECTANGLES
]


@pytest.mark.sampled(6)
@pytest.mark.parametrize(("element", "sheet"), ROWS)
def test_symmetric_half_of_shell_on_skew_plane(element, sheet):
    member = {
        "dkmt": Member("surface", "plate", SANDWICH, None, {"element": "dkmt"}),
        "dkt": Member("surface", "plate", 0.02, METAL, {"element": "dkt"}),
        "rectangles": Member("surface", "plate_bfs", 0.02, METAL),
    }[element]
    half = curved("quad" if element == "rectangles" else "triangle", SHEETS[sheet], 3 if element == "rectangles" else 4)
    expected, computed = whole_and_half_frequencies(half, [member], "right", random_rotation(3))
    np.testing.assert_allclose(computed, expected, rtol=ROUNDING)


def test_symmetric_half_of_high_order_frame():
    """A portal whose beam the plane cuts, and a post in the plane: its own bubbles are held across it."""
    C = random_rotation(6)
    portal = line([[0, 0, 1.0], [0.7, 0, 1.0], [0.7, 0.2, 0]], 2)
    ends = {"left": [0], "right": [len(portal.points) - 1]}
    post = line([[0, 0, 1.0], [0, 0.6, 1.4]], 2)
    half = Mesh(portal.points, portal.cells, portal.cell_groups, ends).merged(
        Mesh(post.points, post.cells, {"post": post.cell_groups["line"]}, {"left": [0, 1, 2]}), tolerance=1e-9
    )
    members = [
        Member("line", "beam", Rectangle(0.02, 0.03), METAL, {"order": 6, "orientation": C[:, 1]}),
        Member("post", "beam", Rectangle(0.02, 0.01), METAL, {"order": 5, "orientation": C[:, 0]}),
    ]
    expected, computed = whole_and_half_frequencies(half, members, "right", C)
    np.testing.assert_allclose(computed, expected, rtol=ROUNDING)


def test_symmetric_half_of_block_on_skew_plane():
    C = random_rotation(5)
    member = [Member("volume", "solid", None, METAL)]
    half, twice = box(0.5, 0.2, 0.3, 2, 1, 1, "hexahedron27"), box(1.0, 0.2, 0.3, 4, 1, 1, "hexahedron27")
    whole = build_structure(twice.translated([-0.5, 0, 0]).rotated(C), member)
    ends = np.union1d(whole.clamped_dofs("left"), whole.clamped_dofs("right"))
    computed = []
    for support in (symmetry(C[:, 0]), antisymmetry(C[:, 0])):
        supports = {"right": ("x", "y", "z"), "left": support}
        structure = build_structure(half.rotated(C), member, supports=supports)
        computed.append(frequencies(structure, structure.constrained_dofs(supports), 8))
    np.testing.assert_allclose(np.sort(np.concatenate(computed))[:8], frequencies(whole, ends, 8), rtol=ROUNDING)
