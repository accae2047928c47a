"""Damping, participation, files and notes of bodies with random matrices, against their definitions."""

from __future__ import annotations

import re
import stat

import h5py
import numpy as np
import pytest
from scipy import sparse
from scipy.linalg import eigh
from support.reduction_examples import bent_boom, slender_beam

from femflex.body import FlexibleBody, Foreshortening, Marker, Skin, StrainTensors
from femflex.body.mass_points import MassPoints
from femflex.fem import Material, Member, build_structure
from femflex.fem.matrix_structure import structure_from_matrices
from femflex.fem.sections import CableSection, Rectangle
from femflex.mesh import Mesh, line
from femflex.reduction import (
    BeamFunctions,
    ModalDamping,
    RayleighDamping,
    UniformBeam,
    cantilever_modes,
    condense,
    effective_mass,
    load_body,
    reduce_structure,
    rigid_set,
    save_body,
    with_attachment,
    with_derivatives,
)
from femflex.reduction.inertia.mass_matrix import PointMasses, nodal_mass
from femflex.reduction.inertia.moments import point_moments
from femflex.reduction.matrices import _exactness_text, _missed_text, reduce_matrices
from femflex.reduction.modes.damping import bending_damping
from femflex.reduction.origin import Analytic, Meshed
from femflex.reduction.reduce import internal_damping
from femflex.reduction.store import FIELDS
from femflex.warning import PhysicsWarning


def positive(n, seed):
    A = np.random.default_rng(seed).normal(size=(n, n + 2))
    return A @ A.T


# --- damping ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("ratio", [0.03, (0.01, 0.02, 0.05)])
def test_modal_damping_is_that_of_the_modes_and_what_is_left_has_the_rate_of_the_first(ratio):
    """Shapes 1 and 4 are added; modes are those of the others alone."""
    Me, V1, own = positive(5, 1), 40 * positive(5, 2), [0, 2, 3]
    added = np.isin(np.arange(5), [1, 4])
    D = ModalDamping(ratio).matrix(Me, V1, added)
    square, X = eigh(V1[np.ix_(own, own)], Me[np.ix_(own, own)])
    modes = np.zeros((5, 3))
    modes[own] = X
    rate = 2 * np.broadcast_to(ratio, (3,)) * np.sqrt(square)
    np.testing.assert_allclose(modes.T @ D @ modes, np.diag(rate), atol=1e-10 * rate.max())
    rest = np.linalg.svd(modes.T @ Me)[2][3:].T  # without mass in common with the modes
    np.testing.assert_allclose(rest.T @ D @ rest, rate[0] * rest.T @ Me @ rest, rtol=1e-9)
    np.testing.assert_allclose(rest.T @ D @ modes, 0.0, atol=1e-9)
    every = ModalDamping(np.linspace(0.01, 0.05, 5)).matrix(Me, V1, added)
    square, X = eigh(V1, Me)
    np.testing.assert_allclose(X.T @ every @ X, np.diag(2 * np.linspace(0.01, 0.05, 5) * np.sqrt(square)), atol=1e-9)
    np.testing.assert_allclose(ModalDamping(0.02).matrix(Me, V1, np.ones(5, bool)), ModalDamping(0.02).matrix(Me, V1))
    with pytest.raises(ValueError, match="2 damping ratios were given for 3 modes; give one, or one per mode"):
        ModalDamping((0.1, 0.2)).matrix(Me, V1, added)
    assert not ModalDamping(0.0).matrix(Me, V1, added).any()


def test_shapes_that_no_mode_answers_are_damped_at_their_own_frequency():
    Me, V1 = np.diag([1.0, 2.0, 1.5, 3.0]), np.diag([4.0, 18.0, 150.0, 120.0])
    D = ModalDamping(0.05).matrix(Me, V1, [False, False, True, True], [False, False, False, True])
    own = 0.1 * np.sqrt(np.diag(V1) * np.diag(Me))
    np.testing.assert_allclose(D, np.diag([own[0], own[1], 0.1 * 2.0 * 1.5, own[3]]), atol=1e-12)


def test_bending_alone_is_damped_where_strain_is_not_linear():
    Me, V1 = positive(4, 3), positive(4, 4)
    damped, added = [True, False, True, True], [False, False, False, True]
    D, keep = bending_damping(ModalDamping(0.1), Me, V1, damped, added), [0, 2, 3]
    own = np.ix_(keep, keep)
    np.testing.assert_allclose(D[own], ModalDamping(0.1).matrix(Me[own], V1[own], [False, False, True]))
    assert not D[1].any() and not D[:, 1].any()
    np.testing.assert_allclose(RayleighDamping(0.3, 0.02).matrix(Me, V1), 0.3 * Me + 0.02 * V1)
    for alpha, beta in ((-0.1, 0.0), (0.0, np.inf)):
        with pytest.raises(ValueError, match=rf"alpha = {alpha}, beta = {beta}; both must be zero or positive"):
            RayleighDamping(alpha, beta)
    with pytest.raises(ValueError, match=r"damping ratio is \[0\.1, -0\.2\]; it must be zero or positive"):
        ModalDamping((0.1, -0.2))


def test_internal_damping_is_on_the_damped_shapes_alone():
    members = [Member("line", "tether", CableSection(1e4, 0.1), None, {"viscosity": 0.02, "prestress": 10.0})]
    rope = build_structure(line([[0, 0, 0], [2.0, 0.5, 0]], 3), members)
    phi = np.random.default_rng(2).normal(size=(rope.n_dof, 3))
    whole, part = (internal_damping(rope, phi, damped) for damped in ([True] * 3, [True, False, True]))
    assert rope.stressed  # whose own stiffness is not viscous
    np.testing.assert_allclose(whole, 0.02 * phi.T @ (rope.K0 @ phi), rtol=1e-8)
    np.testing.assert_allclose(part[np.ix_([0, 2], [0, 2])], whole[np.ix_([0, 2], [0, 2])])
    assert not part[1].any()


# --- participation ----------------------------------------------------------------------------------------------------


def random_body(n=4, follow=2):
    rng = np.random.default_rng(8)
    dm, rho, phi = rng.uniform(1, 2, 7), rng.normal(size=(7, 3)), rng.normal(size=(7, 3, n + follow))
    A = rng.normal(size=(follow, n, n))
    return FlexibleBody(
        moments=point_moments(dm, rho, phi),
        strain=StrainTensors(50 * positive(n, 9), rng.normal(size=n)),
        damping=positive(n, 7),
        markers={name: Marker(rng.normal(size=3), *rng.normal(size=(2, 3, n + follow)), np.eye(3)[[1, 2, 0]],
                              np.array([0.6, 0.8, 0.0]), rng.normal(size=(3, 4, 3)))
                 for name in ("a%2Fb", "100%25", "x.y/z", "end")},
        skin=Skin(rho, {"triangle": np.array([[0, 1, 2], [3, 4, 5]]), "vertex": np.array([[6]])},
                  rng.normal(size=(6, 7, 3))),
        kinds=("alpha", "beta", "gamma", "delta", "derivative", "section"),
        omega=np.array([1.0, np.nan, 3.0, 4.0, np.nan, np.nan]),
        slaves=A + A.swapaxes(1, 2),
        foreshortening=Foreshortening(rng.normal(size=(4, 3)), {"a%2Fb": rng.normal(size=3), "end": np.arange(3.0)}),
        mass_points=MassPoints(dm, rho, phi),
    ), (dm, rho, phi)  # fmt: skip


def test_each_mode_has_the_kind_of_the_shape_with_most_of_its_mass_and_the_participation_of_its_points():
    body, (dm, rho, phi) = random_body()
    point = np.array([0.7, -0.4, 1.1])
    found = effective_mass(body, about=point)
    Me = np.einsum("p,pak,pal->kl", dm, phi[..., :4], phi[..., :4])
    square, X = eigh(body.strain.V1, Me)
    np.testing.assert_allclose(found.omega, np.sqrt(square), rtol=1e-9)
    moved = phi[..., :4] @ X
    spin = np.cross((rho - point)[:, None], moved.swapaxes(1, 2))
    rows = np.concatenate([np.einsum("p,pak->ka", dm, moved), np.einsum("p,pka->ka", dm, spin)], axis=1)
    np.testing.assert_allclose(np.abs(found.participation), np.abs(rows), rtol=1e-8, atol=1e-10)
    r = rho - point
    total = [dm.sum()] * 3 + [dm @ ((r**2).sum(axis=1) - r[:, k] ** 2) for k in range(3)]
    np.testing.assert_allclose(found.total, total, rtol=1e-10)
    np.testing.assert_allclose(found.running[2], (rows[:3] ** 2).sum(axis=0) / total, rtol=1e-8)
    np.testing.assert_allclose(found.carried, (rows**2).sum(axis=0) / total, rtol=1e-8)
    share = X * (Me @ X)
    assert found.kinds == tuple(("alpha", "beta", "gamma", "delta")[share[:, m].argmax()] for m in range(4))
    assert len(set(found.kinds)) > 1


# --- files ------------------------------------------------------------------------------------------------------------


def test_everything_of_a_body_comes_back_from_its_file_with_its_units(tmp_path):
    body, _ = random_body()
    path = save_body(tmp_path / "body.h5", body)
    again = load_body(path)
    for part in ("slaves", "damping", "omega"):
        np.testing.assert_array_equal(getattr(again, part), getattr(body, part))
    assert list(again.markers) == list(body.markers) and set(again.markers) >= {"a%2Fb", "100%25", "x.y/z", "origin"}
    for name, marker in body.markers.items():
        for part in ("position", "phi", "psi", "orientation", "axis", "stretch"):
            np.testing.assert_array_equal(getattr(again.markers[name], part), getattr(marker, part))
    np.testing.assert_array_equal(again.foreshortening.mass, body.foreshortening.mass)
    assert set(again.foreshortening.at) == {"a%2Fb", "end"}
    for name, theta in body.foreshortening.at.items():
        np.testing.assert_array_equal(again.foreshortening.at[name], theta)
    for part in ("dm", "rho", "phi"):
        np.testing.assert_array_equal(getattr(again.mass_points, part), getattr(body.mass_points, part))
    assert set(again.skin.cells) == {"triangle", "vertex"} and again.kinds == body.kinds
    assert stat.S_IMODE(path.stat().st_mode) & 0o600 == 0o600 and list(tmp_path.iterdir()) == [path]
    fresh = tmp_path / "fresh"
    fresh.touch()
    assert path.stat().st_mode == fresh.stat().st_mode
    with h5py.File(path) as file:
        seen = {}
        file.visititems(lambda name, item: seen.update({name: item.attrs.get("units")})
                        if isinstance(item, h5py.Dataset) and "cells" not in name else None)  # fmt: skip
        for name, unit in seen.items():
            last = name.split("/")[-1]
            if not name.startswith(("ignored", "strain_field")):
                assert unit == FIELDS[last][1], name
        assert (seen["ignored/mass"], seen["ignored/at/end"]) == ("s^2/m | s^2", "1/N")
        assert (seen["moments/first"], seen["damping"], seen["mass_points/moved"]) == (
            "kg m | kg^1/2",
            "1/s",
            "kg^-1/2",
        )


# --- bodies of matrices -----------------------------------------------------------------------------------------------


def test_masses_at_points_and_unit_dofs_have_the_moments_of_their_points():
    rng = np.random.default_rng(4)
    dm, rho, rows = rng.uniform(1, 2, 4), rng.normal(size=(4, 3)), rng.normal(size=(12, 5))
    phi = rng.normal(size=(5, 2))
    found = PointMasses(dm, rho, rows).moments(phi)
    u = (rows @ phi).reshape(4, 3, 2)
    np.testing.assert_allclose(found.first[1:], np.einsum("p,pak->ka", dm, u), rtol=1e-12)
    z = np.concatenate([rho[..., None], u], axis=2)
    np.testing.assert_allclose(found.second, np.einsum("p,paA,pbB->AaBb", dm, z, z), rtol=1e-12)


def test_a_rigid_body_of_matrices_has_no_notes_and_others_say_what_is_exact():
    points = np.random.default_rng(1).normal(size=(4, 3))
    from scipy import sparse

    from femflex.mesh import Mesh

    m = sparse.csr_array(np.kron(np.diag([1.0, 2.0, 0.5, 1.5]), np.eye(3)))
    K = sparse.csr_array(positive(12, 5))
    dofs = np.stack(np.divmod(np.arange(12), 3), axis=1)
    given = structure_from_matrices(Mesh(points, {}, point_groups={"a": np.array([0])}), dofs, m, K)
    assert nodal_mass(given).exact
    rigid = reduce_matrices(given, rigid_set(12))
    assert rigid.notes == () and rigid.body.moments.mass == pytest.approx(5.0)
    assert "all of" not in _exactness_text(True, 0.0) and _exactness_text(True, 0.3).startswith(
        "its mass moments are exact: "
    )
    assert "those that change with the deformation are approximate" in _exactness_text(False, np.nan)
    assert "misses at most 3.2 % of a shape's elastic mass" in _exactness_text(False, 0.0321)
    assert "distribution of mass of the reduced model between its interfaces is unknown" in _missed_text(np.nan)
    assert "misses 12 % of the elastic mass of a shape (limit 2 %)" in _missed_text(0.123)


def test_nodes_that_move_in_a_plane_have_their_whole_mass():
    """Node 1 has no z, node 2 only y and z: its mass is the mean over the translations that it has."""
    dofs = np.array([[0, 0], [0, 1], [0, 2], [1, 0], [1, 1], [2, 1], [2, 2]])
    m = np.array([1.0, 1.0, 1.0, 2.0, 2.0, 0.7, 0.7])
    points = np.array([[0, 0, 0], [1.0, 0.2, 0], [0.3, 1.0, 0.5]])
    given = structure_from_matrices(Mesh(points, {}), dofs, sparse.csr_array(np.diag(m)), sparse.csr_array(np.eye(7)))
    found = nodal_mass(given)
    assert found.exact
    np.testing.assert_allclose(found.scalar.toarray(), np.diag([1.0, 2.0, 0.7]), atol=1e-12)


# --- places and notes -------------------------------------------------------------------------------------------------


def test_places_of_markers_are_groups_of_the_set_and_given_names_over_them():
    structure = bent_boom(n=2, order=3)
    modes = with_attachment(structure, cantilever_modes(structure, "start", 1), (), {"end": ["x"]})
    found = Meshed(structure, modes, {"tip": "end", "start": "line"}).places
    assert found == {"start": "line", "end": "end", "tip": "end"}
    beam = UniformBeam(1.0, 1.0, 1.0, 1.0, 1.0, 1.0)
    assert Analytic(beam, BeamFunctions(y=1), {"camera": "tip", "tip": "root"}).places == {
        "camera": "tip", "tip": "tip", "root": "root"}  # fmt: skip


def test_a_stress_close_to_buckling_is_reported_with_what_is_left_of_the_stiffness():
    metal, a, L = Material(70e9, 0.3, 2700.0), 0.02, 2.0
    euler = np.pi**2 * metal.E * a**4 / 12 / L**2
    pins = {"start": ("x", "y", "z", "rx"), "end": ("x", "y", "z")}
    for part, warned in ((1 / 1.1, True), (1 / 1.3, False)):
        member = Member("line", "beam", Rectangle(a, a), metal, {"order": 5, "prestress": -part * euler})
        structure = build_structure(line([[0, 0, 0], [L, 0, 0]], 4), [member])
        if not warned:
            cantilever_modes(structure, pins, 1)
            continue
        with pytest.warns(
            PhysicsWarning, match=r"load factor is 1\.1 \(limit 1\.25\), which leaves 9% of the stiffness"
        ):
            cantilever_modes(structure, pins, 1)


def test_condensing_what_was_condensed_or_numbers_that_are_not_there_is_refused_with_them():
    structure = slender_beam(n=2, order=3)
    modes = with_derivatives(structure, cantilever_modes(structure, "start", 2))
    body = reduce_structure(structure, modes, strain="nonlinear")
    n = body.n_modes
    for slaved in ([], [n], list(range(n))):
        with pytest.raises(ValueError, match=rf"{len(slaved)} of {n} shapes were requested as dependent, numbers "
                           + re.escape(str(slaved))):  # fmt: skip
            condense(body, slaved)
