"""Supports: skew directions, hinges, planes of symmetry and antisymmetry, released ends."""

from __future__ import annotations

from contextlib import nullcontext
from dataclasses import replace

import numpy as np
import pytest
from scipy import linalg
from support.plate_models import EDGES, METAL, frequencies, random_rotation

from femflex.fem import Material, Member, Support, antisymmetry, build_structure, symmetry
from femflex.fem.sections import Rectangle
from femflex.mesh import Mesh, box, line, rectangle
from femflex.mesh.cells import CELL_TYPES
from femflex.reduction import cantilever_modes
from femflex.warning import PhysicsWarning


@pytest.mark.parametrize(("family", "cell"), [("plate", "triangle"), ("plate_bfs", "quad")])
def test_edge_with_normal_support(family, cell):
    """Pressed by a thermal strain, a plate held in x between two edges and free in y: sigma_x = -E eps, sigma_y = 0."""
    strain, h = 1e-4, 0.01
    mesh = rectangle(1.0, 1.0, 3, 3, cell)
    structure = build_structure(mesh, [Member("surface", family, h, METAL, {"thermal_strain": strain})])
    fixed = [structure.clamped_dofs(edge, ("x",)) for edge in ("left", "right")]
    fixed += [structure.clamped_dofs("bottom", ("y",)), structure.clamped_dofs("surface", ("z", "rx", "ry", "rz"))]
    fixed = np.unique(np.concatenate(fixed))
    free = np.setdiff1d(np.arange(structure.n_dof), fixed)
    K = structure.K[free][:, free].toarray()
    x = np.zeros(structure.n_dof)
    x[free] = np.linalg.lstsq(K, -structure.f0[free], rcond=None)[0]
    u = (structure.translation @ x).reshape(-1, 3)
    np.testing.assert_allclose(u[:, 0], 0.0, atol=1e-10)
    np.testing.assert_allclose(u[:, 1], (1 + METAL.nu) * strain * mesh.points[:, 1], rtol=1e-3, atol=1e-10)


def rotated_supports(supports, C):
    """The supports of a structure that is rotated by C."""
    return {group: Support(tuple(components), tuple(map(tuple, C.T))) for group, components in supports.items()}


@pytest.mark.parametrize(
    ("family", "cell", "n", "error"), [("plate", "triangle", 16, 2e-2), ("plate_bfs", "quad", 8, 3e-3)]
)
def test_soft_simple_supports_match_navier(family, cell, n, error):
    """A square plate held in x, y, z along its edges, slopes and twists left to themselves: Navier's frequencies."""
    h = 0.01
    structure = build_structure(rectangle(1.0, 1.0, n, n, cell), [Member("surface", family, h, METAL)])
    fixed = np.unique(np.concatenate([structure.clamped_dofs(edge, ("x", "y", "z")) for edge in EDGES]))
    rigidity = METAL.E * h**3 / 12 / (1 - METAL.nu**2)
    exact = np.pi**2 * np.sqrt(rigidity / (METAL.density * h)) * np.array([2.0, 5.0, 5.0, 8.0])
    computed = frequencies(structure, fixed, 4, shift=float(exact[0] ** 2) / 2)
    assert computed == pytest.approx(exact, rel=error)


@pytest.mark.parametrize(("family", "cell"), [("plate", "triangle"), ("plate_bfs", "quad"), ("shell", "quad9")])
def test_motions_under_skew_supports(family, cell):
    """Against the null space of the same conditions on a structure that knows nothing of them."""
    C = random_rotation(21)
    mesh = rectangle(1.0, 0.7, 2, 2, cell).rotated(C)
    c, n = np.cos(0.6), np.sin(0.6)
    in_plane = np.array([[c, n, 0], [-n, c, 0], [0, 0, 1.0]]) @ C.T
    supports = {
        "bottom_left": Support(("x", "ry"), tuple(map(tuple, in_plane))),
        "bottom_right": Support(("y", "z"), tuple(map(tuple, random_rotation(23)))),
        "top_right": Support(("z", "x", "y"), tuple(map(tuple, random_rotation(24)))),
    }
    member = [Member("surface", family, 0.02, METAL)]
    s, plain = build_structure(mesh, member, supports=supports), build_structure(mesh, member)
    fixed = s.constrained_dofs(supports)
    free = np.setdiff1d(np.arange(s.n_dof), fixed)
    rows, moves = [], []
    for group, support in supports.items():
        node = mesh.group_points(group)[0]
        for name in support.components:
            way = np.array(support.axes)["xyz".index(name[-1])]
            for structure, into in ((s, rows), (plain, moves)):
                operator = structure.rotation if name[0] == "r" else structure.translation
                into.append(way @ operator.toarray()[3 * node : 3 * node + 3])
    assert np.abs(np.array(rows)[:, free]).max() < 1e-12
    kept = linalg.null_space(np.array(moves))
    assert len(free) == kept.shape[1]
    K = kept.T @ plain.K @ kept
    M = kept.T @ plain.M @ kept
    exact = np.sqrt(np.abs(linalg.eigh(K, M, eigvals_only=True)))
    own = np.sqrt(np.abs(linalg.eigh(s.K[free][:, free].toarray(), s.M[free][:, free].toarray(), eigvals_only=True)))
    assert own[1:] == pytest.approx(exact[1:], rel=1e-6)


@pytest.mark.parametrize("slope", [0.4, -2.0])
def test_order_of_supports_does_not_matter(slope):
    """A plate that meets a plane of symmetry at a flat or at a steep angle, whose corner slides on another support."""
    flat = rectangle(1.0, 0.8, 2, 2)
    x, y, _ = flat.points.T
    mesh = Mesh(np.stack([x, y, slope * x], axis=1), flat.cells, flat.cell_groups, flat.point_groups)
    both = {"left": symmetry((1, 0, 0)), "bottom": ("y",), "top": antisymmetry((0, 1, 0))}
    computed = []
    for names in (list(both), list(both)[::-1], ["bottom", "top", "left"]):
        supports = {name: both[name] for name in names}
        s = build_structure(mesh, [Member("surface", "plate", 0.02, METAL)], supports=supports)
        free = np.setdiff1d(np.arange(s.n_dof), s.constrained_dofs(supports))
        K, M = (A[free][:, free].toarray() for A in (s.K, s.M))
        computed.append(linalg.eigh(K, M, eigvals_only=True))
    np.testing.assert_allclose(computed[1], computed[0], rtol=1e-6)
    np.testing.assert_allclose(computed[2], computed[0], rtol=1e-6)


def released_end(C, components):
    mesh = line([[0, 0, 0], [1.0, 0, 0], [1.6, 0.8, 0.3]], 3).rotated(C)
    inner = mesh.nearest_point(C @ np.array([1.0, 0, 0]))
    far = np.flatnonzero((mesh.cells["line"] == inner).any(axis=1))
    mesh = mesh.with_groups({"rest": {"line": np.setdiff1d(np.arange(len(mesh.cells["line"])), far[-1:])},
                             "last": {"line": far[-1:]}}, {"inner": [inner]})  # fmt: skip
    up = {"orientation": C @ [0.1, 0.2, 1.0], "extent": 2.0}
    members = [
        Member("rest", "beam", Rectangle(0.02, 0.03), METAL, up),
        Member("last", "beam", Rectangle(0.02, 0.03), METAL, {**up, "release": components, "release_at": "inner"}),
    ]
    return build_structure(mesh, members)


@pytest.mark.parametrize("components", ["ry", ["y", "rx", "rz"], ["x", "z"]])
def test_released_end(components):
    """One more motion per component, and no more stiffness: frequencies do not depend on the axes."""
    n = 1 if isinstance(components, str) else len(components)
    s, rotated = released_end(np.eye(3), components), released_end(random_rotation(31), components)
    plain = released_end(np.eye(3), ["x"]).n_dof - 1
    assert s.n_dof == plain + n
    value, other = (
        linalg.eigh(structure.K.toarray(), structure.M.toarray(), eigvals_only=True) for structure in (s, rotated)
    )
    np.testing.assert_allclose(value, other, rtol=1e-6, atol=1e-10 * value[-1])
    assert (np.abs(value[: 6 + n]) < 1e-4 * value[6 + n]).all()


@pytest.mark.parametrize(
    ("brick", "face", "low"),
    [("hexahedron20", "quad8", "quad"), ("hexahedron27", "quad9", "quad"), ("tetra10", "triangle6", "triangle")],
)
def test_group_of_corner_faces_clamps_the_middle_nodes(brick, face, low):
    """A strip of bricks: faces of first order clamp what those of second order do; a list of corners warns."""
    whole = box(1.0, 0.1, 0.1, 8, 1, 1, brick)
    rows = whole.cell_groups["left"][face]
    corners = whole.cells[face][rows][:, : CELL_TYPES[face].n_corners]
    few = replace(whole, cells={**whole.cells, low: corners})
    few = few.with_groups(cells={"left": {low: np.arange(len(corners))}})
    n_middles = len(np.unique(whole.cells[face][rows])) - 4
    listed = whole.with_groups(points={"corners": corners.ravel()})
    steel, omega = Material(70e9, 0.3, 2700.0), []
    for mesh, group in ((whole, "left"), (few, "left"), (listed, "corners")):
        s = build_structure(mesh, [Member("volume", "solid", material=steel)])
        assert any("'left' take the" in note for note in s.notes) == (mesh is few)
        warning = pytest.warns(PhysicsWarning, match=f"'corners'.* {n_middles} middle nodes")
        with warning if mesh is listed else nullcontext():
            omega.append(cantilever_modes(s, group, 2).omega)
    assert omega[1] == pytest.approx(omega[0], rel=1e-6)
    assert omega[0][0] / (2 * np.pi) == pytest.approx(82.3, rel=0.02)  # Euler-Bernoulli
    assert omega[2][0] < 0.95 * omega[0][0]
