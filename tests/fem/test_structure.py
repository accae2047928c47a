"""Building a Structure: dofs, clamps, operators, elimination of drilling rotations, and the sentences on bad input."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import sparse

from femflex.fem import FAMILIES, Material, Member, PointMass, build_structure
from femflex.fem.assembly import Part, assembled
from femflex.fem.assembly.conditions import conditions
from femflex.fem.assembly.numbering import Numbering
from femflex.fem.family import Contribution, SkinPart, family
from femflex.fem.sections import Circle, Rectangle
from femflex.fem.tables import DenseInertia, DenseStrain, element_chunks
from femflex.mesh import Mesh, line, rectangle
from femflex.warning import PhysicsWarning

MATERIAL = Material(70e9, 0.3, 2700.0)
BEAM = Member("line", "beam", Circle(0.05), MATERIAL)


def cross_mesh() -> Mesh:
    """Two booms that share the node (1, 0, 0), and a point that belongs to neither."""
    points = [[0, 0, 0], [1, 0, 0], [2, 0, 0], [1, 3, 0], [5, 5, 5]]
    lines = [[0, 1], [1, 2], [1, 3]]
    groups = {"long": {"line": [0, 1]}, "side": {"line": [2]}, "all": {"line": [0, 1, 2]}}
    return Mesh(np.array(points, float), {"line": np.array(lines)}, groups, {"root": [0], "away": [4], "joint": [1]})


def test_members_share_the_dofs_of_shared_nodes_and_loose_nodes_have_none():
    mesh = cross_mesh()
    one = build_structure(mesh, [Member("all", "beam", Circle(0.02), MATERIAL)])
    two = build_structure(mesh, [Member(g, "beam", Circle(0.02), MATERIAL) for g in ("long", "side")])
    assert one.n_dof == two.n_dof == 4 * 6 + 3 * 5
    assert np.linalg.eigvalsh(one.M.toarray()) == pytest.approx(np.linalg.eigvalsh(two.M.toarray()), rel=1e-9)
    for operator in (one.translation, one.rotation):
        rows = operator.toarray()
        assert np.abs(rows[12:]).max() == 0.0
        assert rows[:12] @ rows[:12].T == pytest.approx(np.eye(12))
    assert abs(one.translation @ one.rotation.T).max() == 0.0


def test_matrices_are_symmetric():
    structure = build_structure(cross_mesh(), [Member("all", "beam", Rectangle(0.02, 0.05), MATERIAL, {"order": 5})])
    for matrix in (structure.M, structure.K):
        assert abs(matrix - matrix.T).max() <= 1e-15 * abs(matrix).max()
        assert matrix.shape == (structure.n_dof, structure.n_dof)


def test_a_clamp_fixes_nodes_and_the_bubbles_between_them():
    structure = build_structure(cross_mesh(), [Member("all", "beam", Circle(0.02), MATERIAL)])
    assert len(structure.clamped_dofs("root")) == 6
    assert len(structure.clamped_dofs("side")) == 2 * 6 + 5
    assert len(structure.clamped_dofs("all")) == structure.n_dof
    ball = structure.clamped_dofs("side", ["x", "y", "z"])
    assert len(ball) == 2 * 3 + 4  # its bubble of torsion is a turn
    assert len(structure.clamped_dofs("root", ["rx"])) == 1
    moved = np.abs(structure.translation.toarray()[:, structure.clamped_dofs("root", ["y"])]).sum(axis=1)
    assert np.flatnonzero(moved).tolist() == [1]


def test_clamps_that_hold_nothing_are_refused():
    structure = build_structure(cross_mesh(), [Member("all", "beam", Circle(0.02), MATERIAL)])
    with pytest.raises(ValueError, match="no member moves the 1 nodes of group 'away' in x, y, z, rx, ry, rz"):
        structure.clamped_dofs("away")
    with pytest.raises(ValueError, match=r"components \['w'\] are not of a node; name some of \['x', 'y', 'z', 'rx'"):
        structure.clamped_dofs("root", ["w"])
    with pytest.raises(ValueError, match="'rot' is not in the mesh"):
        structure.clamped_dofs("rot")


@pytest.mark.parametrize(
    ("members", "sentence"),
    [
        ([], "at least one member; found none"),
        (
            [Member("line", "beem", Circle(1.0), MATERIAL)],
            r"names family 'beem'; the families are .*Did you mean 'beam'\?",
        ),
        (
            [Member("boom", "beam", Circle(1.0), MATERIAL)],
            r"group 'boom' is not in the mesh; it has \['end', 'line', 'start'\]",
        ),
        ([Member("end", "beam", Circle(1.0), MATERIAL)], "'end' is a group of points; cells are needed here"),
        ([Member("line", "beam", Circle(0.1))], "Circle needs a material; found none"),
    ],
)
def test_bad_members_are_refused(members, sentence):
    with pytest.raises(ValueError, match=sentence):
        build_structure(line([[0, 0, 0], [9, 0, 0]], 3), members)


def test_cells_that_a_family_cannot_use_are_refused():
    sentence = "group 'surface' holds quad cells; the beam family is made of line, line3. Choose another family"
    with pytest.raises(ValueError, match=sentence):
        build_structure(rectangle(1, 1, 2, 2, "quad"), [Member("surface", "beam", Circle(0.01), MATERIAL)])


def test_two_members_on_the_same_cells_add_and_are_warned_of():
    mesh = cross_mesh()
    single = build_structure(mesh, [Member("all", "beam", Circle(0.02), MATERIAL)])
    with pytest.warns(
        PhysicsWarning, match="1 of the 1 cells of group 'side' already belong to the beam member on group 'all'"
    ):
        double = build_structure(mesh, [Member(g, "beam", Circle(0.02), MATERIAL) for g in ("all", "side")])
    extra = sum(block.dm.sum() for block in double.inertia) - sum(block.dm.sum() for block in single.inertia)
    assert extra == pytest.approx(3 * np.pi * 0.02**2 * 2700)


def spinning_plate(normals: np.ndarray):
    """A toy family: each point has translation and rotation, no stiffness about its normal, unit inertia otherwise."""

    def contribution(mesh, member, numbering):
        nodes = np.arange(len(mesh.points))
        dofs = np.concatenate([numbering.translation(nodes), numbering.rotation(nodes, normals)], axis=1)
        N = np.tile(np.concatenate([np.eye(3), np.eye(3)], axis=1), (1, 1, 1, 1))
        shape = (len(nodes), 1)
        inertia = DenseInertia(dofs, np.ones(shape), mesh.points[:, None], N)
        strain = DenseStrain(dofs, np.ones(shape), np.eye(3)[None, None], np.eye(3), np.zeros((3, 3, 3)), N)
        rows = np.arange(3 * len(nodes))
        skin = SkinPart(mesh.points, {"vertex": nodes[:, None]}, rows, dofs[:, :3].ravel(), np.ones(len(rows)))
        return Contribution((inertia,), (strain,), lambda: skin)

    return contribution


def test_rotation_about_the_normal_of_flat_nodes_is_eliminated(monkeypatch):
    """Node by node: the rotation rows span the plane of the plate; a beam at a node brings the third rotation back."""
    rng = np.random.default_rng(4)
    mesh = line([[0, 0, 0], [1.0, 0, 0]], 3)
    mesh = mesh.with_groups(cells={"last": {"line": [2]}})
    normals = rng.normal(size=(4, 3))
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    monkeypatch.setitem(FAMILIES, "toy", spinning_plate(normals))
    structure = build_structure(mesh, [Member("line", "toy"), Member("last", "beam", Circle(0.001), MATERIAL)])
    assert structure.n_dof == 4 * 6 - 2 + 5
    for node in range(4):
        rows = structure.rotation.toarray()[3 * node : 3 * node + 3]
        if node < 2:
            assert np.abs(normals[node] @ rows).max() < 1e-12
            assert rows @ rows.T == pytest.approx(np.eye(3) - np.outer(normals[node], normals[node]), abs=1e-12)
        else:
            assert rows @ rows.T == pytest.approx(np.eye(3), abs=1e-12)
    whole = mesh.with_groups(points={"first": [0]})
    structure = build_structure(whole, [Member("line", "toy")])
    assert len(structure.clamped_dofs("first")) == 5
    phi = rng.normal(size=(structure.n_dof, 2))
    z = structure.inertia[0].shapes(structure.T @ phi, slice(None))
    assert phi.T @ structure.M @ phi == pytest.approx(np.einsum("eqak,eqal->kl", z, z), rel=1e-13)


def test_skins_of_members_are_merged_with_their_motion(monkeypatch):
    monkeypatch.setitem(FAMILIES, "toy", spinning_plate(np.tile([0.0, 0, 1], (4, 1))))
    mesh = line([[0, 0, 0], [3.0, 0, 0]], 3)
    structure = build_structure(mesh, [BEAM, Member("line", "toy")])
    skin, n_beam = structure.skin, len(build_structure(mesh, [BEAM]).skin.points)
    assert skin.cells["vertex"].ravel().tolist() == list(range(n_beam, n_beam + 4))
    assert skin.points[n_beam:] == pytest.approx(mesh.points)
    assert abs(skin.operator[3 * n_beam :] - structure.translation).max() == 0.0
    assert skin.operator.shape == (skin.points.size, structure.n_dof)


def test_a_structure_may_have_nothing_to_draw(monkeypatch):
    monkeypatch.setitem(FAMILIES, "bare", lambda mesh, member, numbering: Contribution((), (), None))
    mesh = line([[0, 0, 0], [1.0, 0, 0]], 2)
    monkeypatch.setitem(
        FAMILIES, "points", lambda mesh, m, numbering: (numbering.translation(np.arange(3)), Contribution((), ()))[1]
    )
    structure = build_structure(mesh, [Member("line", "points")], [PointMass("end", 3.0)])
    assert structure.skin is None
    assert structure.K.nnz == 0
    assert structure.M.diagonal().sum() == 9.0


def test_a_family_registers_under_its_name():
    @family("a family of this test")
    def made(mesh, member, numbering):
        return Contribution((), ())

    assert FAMILIES.pop("a family of this test") is made
    assert "beam" in FAMILIES


def test_extra_dofs_are_held_when_all_their_nodes_are():
    numbering = Numbering(4)
    numbering.translation(np.arange(4))
    numbering.rotation(np.arange(2))
    free, edge, twist = numbering.extra(2), numbering.extra(2), numbering.extra(1)
    numbering.attach(edge[:, None], np.array([[0, 1], [1, 2]]))
    numbering.attach(twist[:, None], np.array([[0]]), kind="rotation")
    mesh = line([[0, 0, 0], [3.0, 0, 0]], 3).with_groups(points={"two": [0, 1], "all": [0, 1, 2, 3]})

    def held(group, components="x y z rx ry rz"):
        supports = conditions(mesh, {group: components.split()})
        return set(np.flatnonzero(numbering.layout(supports).held))

    assert held("two") >= {edge[0], twist[0]}
    assert edge[1] not in held("two")
    assert not set(free) & held("all")
    assert edge[0] in held("two", "x y z")
    assert twist[0] not in held("two", "x y z")
    assert numbering.n_raw == 12 + 6 + 5
    assert numbering.rotation_of(np.array([1, 3])).tolist()[1] == [-1, -1, -1]


def test_blocks_are_contracted_in_chunks_that_cover_all_elements():
    pieces = list(element_chunks(10, 1_000_000))
    assert [(p.start, p.stop) for p in pieces] == [(0, 4), (4, 8), (8, 10)]


def test_assembly_adds_every_element_entry_where_its_dofs_say():
    rng = np.random.default_rng(7)
    dofs = [rng.integers(0, 12, (5, 4)), rng.integers(0, 12, (3, 6))]  # repeated dofs within an element too
    matrices = [rng.normal(size=(5, 4, 4)), rng.normal(size=(3, 6, 6))]
    expected = np.zeros((12, 12))
    for block, values in zip(dofs, matrices, strict=True):
        for rows, matrix in zip(block, values, strict=True):
            np.add.at(expected, np.ix_(rows, rows), matrix)
    parts = [Part(block, values.__getitem__) for block, values in zip(dofs, matrices, strict=True)]
    assert assembled(parts, sparse.eye_array(12, format="csr")).toarray() == pytest.approx(
        expected, rel=1e-13, abs=1e-14
    )
