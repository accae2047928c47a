"""Hanging nodes: patch tests over mixes of elements, and a strip of alternating four- and eight-node elements."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import sparse
from scipy.sparse.linalg import spsolve
from support.element_meshes import straight_sided
from support.plate_models import frequencies

from femflex.fem import Material, Member, build_structure
from femflex.fem.sections.laminates import isotropic
from femflex.mesh import Mesh, box, rectangle
from femflex.mesh.second_order import raise_order

pytestmark = [pytest.mark.filterwarnings("ignore:(solid|shell) on group")]
METAL, H = Material(70e9, 0.3, 2700.0), 0.02
CUTS = {
    "hexahedron": [[*range(8)]],
    "wedge": [[0, 5, 1, 3, 6, 2], [0, 4, 5, 3, 7, 6]],
    "tetra": [[0, 1, 2, 6], [0, 2, 3, 6], [0, 3, 7, 6], [0, 7, 4, 6], [0, 4, 5, 6], [0, 5, 1, 6]],
}


def sheet(kind: str, second, n: int = 4, size=(1.0, 0.8)) -> Mesh:
    """A rectangle whose cells of which second(centre) holds have middle nodes."""
    mesh = rectangle(*size, n, 4 if size[1] == 0.8 else 1, kind)
    rows = np.flatnonzero(second(mesh.points[mesh.cells[kind]].mean(axis=1)))
    rest = np.setdiff1d(np.arange(len(mesh.cells[kind])), rows)
    groups = {"second": {kind: rows}, "first": {kind: rest}, "surface": {kind: np.arange(len(mesh.cells[kind]))}}
    return raise_order(Mesh(mesh.points, mesh.cells, groups, {"left": mesh.group_points("left")}), {kind: rows})


def two_sizes(coarse_second: bool, fine_second: bool) -> Mesh:
    """Two columns of quadrilaterals beside four of half their size."""
    parts = [rectangle(0.5, 0.8, n, n, "quad") for n in (2, 4)]
    points = np.concatenate([parts[0].points, parts[1].translated([0.5, 0, 0]).points])
    cells = np.concatenate([parts[0].cells["quad"], parts[1].cells["quad"] + len(parts[0].points)])
    points, which = np.unique(np.round(points, 9), axis=0, return_inverse=True)
    mesh = Mesh(points, {"quad": which.ravel()[cells]}, {"surface": {"quad": np.arange(20)}})
    return raise_order(mesh, {"quad": np.flatnonzero(np.where(np.arange(20) < 4, coarse_second, fine_second))})


def solids(first: str, second: str) -> Mesh:
    """A box whose halves are cut into these cells; a kind of second order ends in "2"."""
    whole = box(1.0, 0.8, 0.6, 2, 2, 2, "hexahedron")
    hexes = whole.cells["hexahedron"]
    at, cells, rows, up = whole.points[hexes].mean(axis=1)[:, 0], {}, {}, {}
    for kind, side in ((first, at < 0.5), (second, at > 0.5)):
        shape = kind.rstrip("2")
        own = np.concatenate([hexes[side][:, part] for part in CUTS[shape]])
        start = len(cells.get(shape, ()))
        cells[shape] = np.concatenate([cells[shape], own]) if start else own
        rows[shape] = np.arange(len(cells[shape]))
        if kind.endswith("2"):
            up[shape] = start + np.arange(len(own))
    return straight_sided(raise_order(Mesh(whole.points, cells, {"volume": rows}), up))


def plane(p):
    return np.stack([p[:, 0] + 2 * p[:, 1] - p[:, 2], 0.5 * p[:, 0] - p[:, 1], 0 * p[:, 0]], axis=1)


def skew(p):
    return plane(p) + np.stack([0.2 * p[:, 2], 0.3 * p[:, 2], p[:, 0] - 0.4 * p[:, 1] + 0.7 * p[:, 2]], axis=1)


def bending_displacement(p):
    x, y, z = p.T
    return np.stack([z, z, 0.5 * x * x + 0.3 * x * y - 0.2 * y * y], axis=1)


def bending_rotation(p):
    x, y, z = p.T
    return np.stack([0.3 * x - 0.4 * y, -(x + 0.3 * y), z], axis=1)


def zero_rotation(p):
    return 0 * p


def error(mesh: Mesh, members, u, theta) -> float:
    """Largest error of inner nodes of a body whose boundary moves by u(x) and turns by theta(x)."""
    s = build_structure(mesh, members)
    assert any("they follow these" in note for note in s.notes)
    x, size = s.mesh.points, np.array([1.0, 0.8, 0.6])
    solid = np.ptp(x[:, 2]) > 0
    edge = (np.minimum(np.abs(x), np.abs(x - size))[:, : 3 if solid else 2] < 1e-9).any(axis=1)
    rows = np.flatnonzero(np.repeat(edge, 3))
    A = sparse.vstack([s.translation[rows], s.rotation[rows]]).tocsc()
    fixed = np.flatnonzero(np.diff(A.indptr))
    want = np.concatenate([u(x).ravel()[rows], theta(x).ravel()[rows]])
    q, free = np.zeros(s.n_dof), np.setdiff1d(np.arange(s.n_dof), fixed)
    q[fixed] = np.linalg.lstsq(A[:, fixed].toarray(), want, rcond=None)[0]
    q[free] = spsolve(s.K[free][:, free].tocsc(), -s.K[free][:, fixed] @ q[fixed])
    return float(np.abs((s.translation @ q).reshape(-1, 3) - u(x)).max() / np.abs(u(x)).max())


SHELL = [Member("surface", "shell", isotropic(H, METAL))]
BESIDE = [Member("first", "plate", isotropic(H, METAL)), Member("second", "shell", isotropic(H, METAL))]
SOLID = [Member("volume", "solid", None, METAL, {"order": 1})]
CHECKED, HALF = lambda c: np.floor(4 * c[:, 0] + 5 * c[:, 1]) % 2 == 0, lambda c: c[:, 0] < 0.5
SURFACES = {
    "checkered quads": (sheet("quad", CHECKED), SHELL),
    "checkered triangles": (sheet("triangle", CHECKED), SHELL),
    **{f"two sizes {a:d}{b:d}": (two_sizes(a, b), SHELL) for a in (False, True) for b in (False, True)},
}
VOLUMES = (
    ("hexahedron", "hexahedron2"), ("hexahedron2", "tetra2"), ("hexahedron", "tetra2"), ("hexahedron", "wedge2"),
)  # fmt: skip


@pytest.mark.parametrize("name", SURFACES)
def test_constant_strain_and_curvature_of_mixed_surfaces(name):
    assert error(*SURFACES[name], plane, zero_rotation) < 1e-10
    assert error(*SURFACES[name], bending_displacement, bending_rotation) < 1e-10


def test_constant_curvature_of_plates_and_shells():
    # shear of the plates is not zero
    assert error(sheet("triangle", HALF), BESIDE, bending_displacement, bending_rotation) < 1e-4


@pytest.mark.parametrize("first, second", VOLUMES)
def test_constant_strain_of_mixed_solids(first, second):
    assert error(solids(first, second), SOLID, skew, zero_rotation) < 1e-10


def test_strip_of_alternating_orders_matches_beam():
    """E = 70 GPa, nu = 0, 1 x 0.1 x 0.005 m: 4.1126 Hz of Euler and Bernoulli's cantilever."""
    mesh = sheet("quad", lambda c: np.floor(10 * c[:, 0]) % 2 == 0, 10, (1.0, 0.1))
    s = build_structure(mesh, [Member("surface", "shell", isotropic(0.005, Material(70e9, 0.0, 2700.0)))])
    computed = frequencies(s, s.clamped_dofs("left"), 1)[0] / (2 * np.pi)
    assert computed == pytest.approx(4.1126, rel=2e-3)


def test_four_node_skins_on_second_order_bricks():
    """A sandwich cantilever: as with skins of eight-node elements; middle nodes left free are 5 % softer."""
    core, computed = Material(1e9, 0.3, 500.0), []
    for kind in ("hexahedron", "hexahedron20"):
        skins = [Member(side, "shell", isotropic(0.002, METAL)) for side in ("top", "bottom")]
        solid = Member("volume", "solid", None, core)
        s = build_structure(box(1.0, 0.2, 0.04, 10, 2, 1, kind), [solid, *skins])
        computed.append(frequencies(s, s.clamped_dofs("left"), 2))
    assert computed[0] == pytest.approx(computed[1], rel=0.015)
