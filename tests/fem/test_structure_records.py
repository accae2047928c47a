"""Structures: what is known and forgotten, pictures joined, supports, warnings, given matrices, and settled stress."""

from __future__ import annotations

import warnings

import numpy as np
import pytest
from scipy import sparse
from support.nonlinear_models import STRUCTURES, random_state
from support.plate_models import METAL, random_rotation

from femflex.fem import Member, PointMass, Support, antisymmetry, build_structure, symmetry
from femflex.fem.deflected import deflected
from femflex.fem.family import PREPARERS, prepared
from femflex.fem.matrix_structure import SCALAR, structure_from_matrices
from femflex.fem.point_mass import equivalent_points
from femflex.fem.relaxed import RelaxedStrain, settled, settled_stress
from femflex.fem.sections import CableSection, Circle
from femflex.mesh import Mesh, line, rectangle
from femflex.warning import PhysicsWarning


def small():
    return build_structure(line([[0, 0, 0], [1.0, 0, 0]], 2), [Member("line", "beam", Circle(0.01), METAL)])


def test_what_was_computed_is_known_again_with_all_its_warnings():
    s, calls = small(), []

    def make():
        calls.append(1)
        warnings.warn("first", PhysicsWarning, stacklevel=1)
        warnings.warn("second", PhysicsWarning, stacklevel=1)
        return 7

    for _ in range(2):
        with pytest.warns(PhysicsWarning) as given:
            assert s.recalled(("a",), make) == 7
        assert [str(one.message) for one in given] == ["first", "second"]
    assert s.recalled(("b",), lambda: 8) == 8 and len(calls) == 1
    assert repr(s) == f"Structure of {s.n_dof} degrees of freedom on 3 points"


def test_to_forget_reaches_structures_made_of_it():
    s, other = small(), small()
    other.recalled(("x",), lambda: 1)
    s.recalled(("other",), lambda: other)
    s.recalled(("number",), lambda: 3)
    s.forget()
    assert not s.known and not other.known
    s.recalled(("y",), lambda: 1)
    assert not deflected(s, np.zeros(s.n_dof)).known


def test_pictures_of_three_members_are_joined_with_cells_of_every_kind():
    """Each alone is a part of all: its cells, counted on from the points before, and its motion."""
    mesh = rectangle(1.0, 1.0, 2, 1, "quad").merged(line([[1.0, 0, 0], [2.0, 0.5, 0.3]], 2), tolerance=1e-9)
    mesh = mesh.merged(line([[0, 1.0, 0], [-1.0, 1.0, 0.5]], 1).with_groups({"rod": {"line": [0]}}), tolerance=1e-9)
    rods = np.flatnonzero(mesh.points[mesh.cells["line"]].min(axis=1)[:, 0] < -0.5)
    beams = np.flatnonzero(mesh.points[mesh.cells["line"]].max(axis=1)[:, 0] > 1.01)
    mesh = mesh.with_groups({"rods": {"line": rods}, "beams": {"line": beams}})
    members = [
        Member("rods", "rod", CableSection(1e5, 0.1)),
        Member("surface", "plate_bfs", 0.01, METAL),
        Member("beams", "beam", Circle(0.02), METAL),
    ]
    whole, at = build_structure(mesh, members).skin, 0
    x = np.random.default_rng(0).normal(size=(len(mesh.points), 3))
    for member in members:
        s = build_structure(mesh, [member])
        n = len(s.skin.points)
        assert whole.points[at : at + n] == pytest.approx(s.skin.points)
        for kind, cells in s.skin.cells.items():
            own = whole.cells[kind][((whole.cells[kind] >= at) & (whole.cells[kind] < at + n)).all(axis=1)]
            assert np.array_equal(own - at, cells)
        at += n
    assert at == len(whole.points)
    s = build_structure(mesh, members)
    moved = (whole.operator @ (s.translation.T @ x.ravel())).reshape(-1, 3)
    ends = whole.cells["line"][0]
    assert moved[ends] == pytest.approx(x[mesh.cells["line"][rods[0]]])


def test_doubled_cells_are_counted_for_members_of_one_family_alone():
    mesh = line([[0, 0, 0], [1.0, 0, 0]], 4).with_groups({"a": {"line": [0, 1, 2]}, "b": {"line": [1, 2, 3, 0]}})
    both = [Member(group, "rod", CableSection(1e5, 0.1)) for group in ("a", "b")]
    with pytest.warns(PhysicsWarning) as given:
        build_structure(mesh, both)
    assert str(given[0].message).startswith(
        "3 of the 4 cells of group 'b' already belong to the rod member on group 'a'; mass and stiffness of the two add"
    )
    more = [both[0], Member("b", "tether", CableSection(1e5, 0.1)), Member("b", "rod", CableSection(1e5, 0.1))]
    with pytest.warns(PhysicsWarning) as given:
        build_structure(mesh, more)
    assert [str(one.message)[:30] for one in given] == ["3 of the 4 cells of group 'b' "]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        build_structure(mesh, more[:2])
    three = mesh.with_groups({"c": {"line": [3, 2]}, "d": {"line": [1, 0]}})
    with pytest.warns(PhysicsWarning) as given:
        build_structure(three, [Member(group, "rod", CableSection(1e5, 0.1)) for group in ("d", "c", "b")])
    assert [str(one.message)[:76] for one in given] == [
        f"2 of the 4 cells of group 'b' already belong to the rod member on group '{a}';" for a in "dc"
    ]


def test_supports_that_hold_nothing_or_combinations_name_their_groups():
    mesh = rectangle(1.0, 1.0, 1, 1).rotated(random_rotation(1))
    film = build_structure(mesh, [Member("surface", "membrane", 1e-4, METAL, {"prestress": 20.0})])
    said = r"no member moves the 2 nodes of group 'left' in rx, rz; clamp a group that lies on a member"
    with pytest.raises(ValueError, match=said):
        film.held_dofs({"left": ("rx", "rz")})
    with pytest.raises(ValueError, match=r"the supports of \['left', 'top'\] set combinations of dofs to zero"):
        skew = Support(("x",), tuple(map(tuple, random_rotation(2))))
        film.held_dofs({"left": skew, "bottom": ("x", "y", "z", "rx", "ry", "rz"), "top": skew})


@pytest.mark.parametrize("normal", [(0.3, -1.0, 2.0), (0, 0, -3.0), (5.0, 0.1, 0)])
def test_planes_of_symmetry_and_antisymmetry_are_projectors_on_their_normal(normal):
    n = np.array(normal) / np.linalg.norm(normal)
    along, across = np.outer(n, n), np.eye(3) - np.outer(n, n)
    for support, moves, turns in ((symmetry(normal), along, across), (antisymmetry(normal), across, along)):
        found = support.projectors()
        assert found[0] == pytest.approx(moves, abs=1e-14) and found[1] == pytest.approx(turns, abs=1e-14)
        assert np.linalg.det(np.array(support.axes)) == pytest.approx(1.0)
    for wrong in ((1.0, 2.0), (0, 0, 0), (np.nan, 1, 0)):
        with pytest.raises(ValueError, match=r"the normal of a plane is .*; give three components, not all zero"):
            antisymmetry(wrong)


def test_every_family_prepares_the_mesh_once(monkeypatch):
    def twice(mesh, members):
        return mesh.moved([1.0, 0, 0]), (f"moved for {len(members)}",)

    monkeypatch.setitem(PREPARERS, "rod", twice)
    members = [Member("a", "rod"), Member("b", "tether"), Member("c", "rod")]
    mesh, notes = prepared(line([[0, 0, 0], [1.0, 0, 0]], 1), members)
    assert notes == ("moved for 3",) and mesh.points[:, 0].min() == 1.0


def matrices():
    """A modal coordinate, displacements of two points along skew axes, a rotation of one, in no order."""
    rng = np.random.default_rng(3)
    dofs = np.array([[2, 1], [SCALAR, 0], [0, 2], [2, 0], [0, 4], [2, 2], [0, 0]])
    A = rng.normal(size=(3, 7, 7))
    M, K, D = (sparse.csr_array(a @ a.T) for a in A)
    mesh = Mesh(rng.normal(size=(3, 3)), {"line": [[0, 2]]}, {"wire": {"line": [0]}}, {"far": [2]})
    frames = np.stack([random_rotation(k) for k in (41, 42, 43)])
    return mesh, dofs, M, K, D, frames


def test_matrices_on_own_axes_move_the_points_along_them():
    mesh, dofs, M, K, D, frames = matrices()
    recovery = (np.array([[9.0, 8, 7], [6, 5, 4]]), sparse.csr_array(np.random.default_rng(1).normal(size=(6, 7))))
    s = structure_from_matrices(mesh, dofs, M, K, D, frames, recovery)
    x = np.random.default_rng(2).normal(size=7)
    u, turn = np.zeros((3, 3)), np.zeros((3, 3))
    for value, (point, component) in zip(x, dofs, strict=True):
        if point >= 0:
            (u if component < 3 else turn)[point] += value * frames[point][component % 3]
    assert (s.translation @ x).reshape(3, 3) == pytest.approx(u)
    assert (s.rotation @ x).reshape(3, 3) == pytest.approx(turn)
    assert s.scalars.tolist() == [1] and np.array_equal(s.places_of_dofs, dofs)
    for found, given in ((s.M, M), (s.K0, K), (s.D, D)):
        assert found.toarray() == pytest.approx(given.toarray())
    assert s.skin.points == pytest.approx(np.concatenate([mesh.points, recovery[0]]))
    assert s.skin.cells["line"].tolist() == [[0, 2]] and s.skin.cells["vertex"].tolist() == [[3], [4]]
    moved = (s.skin.operator @ x).reshape(-1, 3)
    assert moved[[0, 2]] == pytest.approx(u[[0, 2]]) and moved[3:].ravel() == pytest.approx(recovery[1] @ x)
    plain = structure_from_matrices(Mesh(mesh.points, {}), dofs, M, K)
    assert plain.D is None and plain.skin.cells["vertex"].ravel().tolist() == [0, 1, 2]
    assert (plain.translation @ x).reshape(3, 3)[2] == pytest.approx(x[[3, 0, 5]])


def test_matrices_that_do_not_fit_their_map_are_refused():
    mesh, dofs, M, K, D, _ = matrices()
    for given, said in (
        ((M[:6][:, :6], K), "M is 6 x 6, and the map of degrees of freedom has 7 rows; give matrices and map of one"),
        ((M, K[:5]), "K is 5 x 7, and the map"),
        ((M, K, D[:, :3]), "D is 7 x 3, and the map"),
    ):
        with pytest.raises(ValueError) as refusal:
            structure_from_matrices(mesh, dofs, *given)
        assert str(refusal.value).startswith(said)
    dofs[6] = [0, 4]
    with pytest.raises(ValueError, match="names component 5 of point 0 2 times; each row and column of the matrices"):
        structure_from_matrices(mesh, dofs, M, K)


@pytest.mark.parametrize("name", ["prestressed plate", "hot bfs", "prestressed solid", "pretensioned beam", "bfs"])
def test_settled_stress_is_the_initial_one_and_that_of_the_linear_strain(name):
    """f0 gains K0 x, whatever the elements' own points; the energy gains the work of that stress."""
    s = STRUCTURES[name]()
    x, d = random_state(s, 1e-4), random_state(s, 1e-3, seed=1)
    found = settled(s, x)
    assert found.f0 == pytest.approx(s.f0 + s.K0 @ x, abs=1e-7 * np.abs(s.K0 @ x).max())
    V, W = s.internal_force, found.internal_force
    gained = W.energy(d) - V.energy(d)
    linear = (W.energy(1e-3 * d) - W.energy(-1e-3 * d)) / 2e-3
    assert linear == pytest.approx(found.f0 @ d, rel=1e-5)
    assert np.isfinite(gained)
    for block, own in zip(found.strain, s.strain, strict=True):
        assert isinstance(block, RelaxedStrain)
        np.testing.assert_array_equal(block.stiffness(), own.stiffness())
        eps = np.einsum("sg,eqg->eqs", own.linear_map, own.gradients((s.T @ x)[:, None], slice(None))[..., 0])
        stress = np.broadcast_to(own.stress, eps.shape) + np.matmul(own.elastic, eps[..., None])[..., 0]
        size = np.abs(stress).max(axis=(0, 1))
        assert np.abs(block.stress - stress).max(axis=(0, 1)) == pytest.approx(0 * size, abs=1e-6 * size.max())
        part = block.sampled(slice(1, 2))
        assert part.stress == pytest.approx(settled_stress(own.sampled(slice(1, 2)), s.T @ x), abs=1e-6 * size.max())


def test_a_stress_that_settles_away_is_none():
    """Free to stretch, a hot bar keeps rounding alone, which counts as nothing."""
    mesh = line([[0, 0, 0], [2.0, 0, 0]], 3)
    s = build_structure(mesh, [Member("line", "beam", Circle(0.02), METAL, {"thermal_strain": 1e-4})])
    x = s.translation.T @ (mesh.points * [1e-4, 0, 0]).ravel()
    assert s.stressed and not settled(s, x).stressed
    assert settled(s, 0.999 * x).stressed


def test_rounding_in_members_without_stress_is_judged_by_the_stress_of_others():
    """A hot bar that stretches pushes a cold one, which moves as a whole, in a direction that rounds."""
    mesh = line([[0, 0, 0], [1.0, 2.0, 0.7]], 5)
    mesh = mesh.with_groups({"hot": {"line": [0, 1]}, "cold": {"line": [2, 3, 4]}})
    hot = Member("hot", "beam", Circle(0.02), METAL, {"thermal_strain": 1e-3, "extent": 3.0})
    cold = Member("cold", "beam", Circle(0.02), METAL, {"extent": 3.0})
    s = build_structure(mesh, [cold, hot])
    u = mesh.points * 1e-3
    u[3:] = u[2]
    x = s.translation.T @ u.ravel()
    assert s.stressed and not settled(s, x).stressed


def test_a_little_stress_beside_a_large_one_is_kept():
    """What counts as rounding is judged member by member: 1e-9 of the heat of its neighbour is not."""
    mesh = line([[0, 0, 0], [2.0, 0, 0]], 4).with_groups({"hot": {"line": [0, 1]}, "mild": {"line": [2, 3]}})
    heats = {"hot": 1e-2, "mild": 1e-11}
    members = [Member(g, "beam", Circle(0.02), METAL, {"thermal_strain": h, "extent": 2.0}) for g, h in heats.items()]
    s = build_structure(mesh, members)
    for block, h in zip(settled(s, np.zeros(s.n_dof)).strain, heats.values(), strict=True):
        N = -h * METAL.E * np.pi * 4e-4
        assert block.stress[..., 0] == pytest.approx(np.full(block.weight.shape, N)) and not block.stress[..., 1:].any()


@pytest.mark.parametrize("seed", range(3))
def test_inertias_that_no_body_has_are_points_of_either_sign(seed):
    J = np.diag([1.0, 0.1, 0.2]) if seed == 0 else np.random.default_rng(seed).normal(size=(3, 3))
    J = J if seed == 0 else J @ J.T
    masses, places = equivalent_points(2.5, J)
    second = np.einsum("p,pa,pb->ab", masses, places, places)
    assert masses.sum() == pytest.approx(2.5) and masses @ places == pytest.approx(np.zeros(3), abs=1e-13)
    assert np.trace(second) * np.eye(3) - second == pytest.approx(J, abs=1e-12)


def test_inertias_of_decks_may_be_those_of_no_body_within_their_digits():
    lean = np.diag([1.0, 0.1, 0.2])
    PointMass("end", 1.0, lean, bodily=False)
    PointMass("end", 1.0, np.diag([1.0, 1.0, -1e-7]), bodily=False)
    for values, said in (
        ((lean,), "breaks the triangle inequality: of its principal moments [0.1, 0.2, 1.0] kg m^2 the two smaller"),
        ((np.diag([1.0, 1.0, -1e-7]),), "is not positive: its principal moments are [-1e-07, 1.0, 1.0] kg m^2"),
    ):
        with pytest.raises(ValueError) as refusal:
            PointMass("end", 1.0, *values)
        assert str(refusal.value).startswith(f"inertia of the point mass at group 'end' {said}")
    with pytest.raises(ValueError, match="is not positive"):
        PointMass("end", 1.0, np.diag([1.0, 1.0, -1e-5]), bodily=False)
    with pytest.raises(ValueError, match=r"is not symmetric: \[\[1.0, 0.1, 0.0\]"):
        PointMass("end", 1.0, np.eye(3) + 0.1 * np.eye(3, k=1), bodily=False)
