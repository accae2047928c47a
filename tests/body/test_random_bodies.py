"""Bodies with random arrays: fewer shapes, amplitudes, moments, markers and sentences, against sums over points."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from femflex.body import FlexibleBody, Marker, MassMoments, Skin, StrainTensors, rigid_body
from femflex.body.mass_points import MassPoints, points_of_moments
from femflex.body.strain_field import StrainPart
from femflex.body.symmetric import packed, packed_indices, picked, unpacked
from femflex.reduction.inertia.moments import point_moments
from femflex.rotations import dcm_from_vector, vector_from_dcm

N, FOLLOW = 4, 2  # coordinates, and shapes that follow


def random_points(n_points=9, n_shapes=N + FOLLOW, seed=1):
    rng = np.random.default_rng(seed)
    return rng.uniform(0.2, 2.0, n_points), rng.normal(size=(n_points, 3)), rng.normal(size=(n_points, 3, n_shapes))


def random_body(follow=FOLLOW, kinds=None):
    rng = np.random.default_rng(7)
    n_shapes = N + follow
    dm, rho, phi = random_points(n_shapes=n_shapes)
    V1, D = rng.normal(size=(2, N, N))
    V2, V3 = rng.normal(size=(N,) * 3), rng.normal(size=(N,) * 4)
    A = rng.normal(size=(follow, N, N))
    part = StrainPart("solid", rho, dm, rng.normal(size=(9, 6, n_shapes)).astype(np.float32), np.eye(6),
                      np.zeros((6, 6, 6)), np.eye(6)[None], np.zeros((1, 6)), rng.normal(size=(n_shapes, n_shapes)),
                      False)  # fmt: skip
    return FlexibleBody(
        moments=point_moments(dm, rho, phi),
        strain=StrainTensors(V1 @ V1.T, rng.normal(size=N), packed(V2), packed(V3)),
        damping=D @ D.T,
        markers={"tip": Marker(rho[0], phi[0], rng.normal(size=(3, n_shapes)))},
        skin=Skin(rho, {"vertex": np.arange(9)[:, None]}, phi.transpose(2, 0, 1)),
        kinds=kinds or ("vibration", "vibration", "attachment", "vibration", "derivative", "section")[:n_shapes],
        omega=np.array([11.0, 23.0, np.nan, 31.0, np.nan, 57.0])[:n_shapes],
        slaves=A + A.swapaxes(1, 2),
        strain_field=(part,),
        mass_points=MassPoints(dm, rho, phi),
    )


def test_fewer_coordinates_keep_their_own_rows_of_everything_and_what_follows_them():
    body = random_body()
    less, keep = body.truncated(2), np.array([0, 1, 4, 5])
    d = np.array([0.7, -1.3])
    whole = np.array([0.7, -1.3, 0.0, 0.0])
    y, Y = less.amplitudes(d), body.amplitudes(whole)
    assert less.n_modes == 2 and less.n_shapes == 4
    np.testing.assert_allclose(y, Y[keep], rtol=1e-12)
    np.testing.assert_allclose(less.moments.inertia(y), body.moments.inertia(Y), rtol=1e-10)
    np.testing.assert_allclose(less.moments.center_of_mass(y), body.moments.center_of_mass(Y), rtol=1e-10)
    assert less.strain.energy(d) == pytest.approx(body.strain.energy(whole), rel=1e-12)
    np.testing.assert_allclose(less.strain.force(d), body.strain.force(whole)[:2], rtol=1e-12)
    np.testing.assert_array_equal(less.damping, body.damping[:2, :2])
    np.testing.assert_allclose(less.marker("tip").phi @ y, body.marker("tip").phi @ Y, rtol=1e-12)
    np.testing.assert_allclose(less.marker("tip").psi @ y, body.marker("tip").psi @ Y, rtol=1e-12)
    np.testing.assert_array_equal(less.skin.shapes, body.skin.shapes[keep])
    np.testing.assert_array_equal(less.omega, body.omega[keep])
    assert less.kinds == ("vibration", "vibration", "derivative", "section")
    np.testing.assert_array_equal(less.strain_field[0].rows, body.strain_field[0].rows[:, :, keep])
    np.testing.assert_array_equal(less.strain_field[0].first, body.strain_field[0].first[np.ix_(keep, keep)])
    np.testing.assert_array_equal(less.mass_points.phi, body.mass_points.phi[:, :, keep])
    assert body.n_modes == N and body.markers["tip"].phi.shape == (3, N + FOLLOW)


def test_a_body_to_first_order_has_the_first_shapes_alone():
    body = random_body()
    first = body.without_slaves()
    assert (first.n_modes, first.n_shapes, len(first.slaves)) == (N, N, 0)
    assert first.kinds == body.kinds[:N] and first.strain_form == "nonlinear"
    np.testing.assert_array_equal(first.damping, body.damping)
    np.testing.assert_array_equal(first.marker("tip").psi, body.marker("tip").psi[:, :N])
    alone = random_body(follow=0)
    assert alone.without_slaves() is alone
    np.testing.assert_array_equal(alone.amplitudes([1.0, 2.0, 3.0, 4.0]), [1.0, 2.0, 3.0, 4.0])


def test_amplitudes_of_many_states_follow_by_half_the_products():
    body = random_body()
    d = np.random.default_rng(3).normal(size=(2, 5, N))
    found = body.amplitudes(d)
    np.testing.assert_array_equal(found[..., :N], d)
    np.testing.assert_allclose(found[..., N:], np.einsum("skl,abk,abl->abs", body.slaves, d, d) / 2, rtol=1e-12)


@pytest.mark.parametrize(
    ("kinds", "form"),
    [
        (("section", "section"), "nonlinear"),
        (("remainder", "section"), "nonlinear"),
        (("section", "derivative"), "condensed"),
        (("carried", "section"), "condensed"),
    ],
)
def test_sections_that_turn_and_remainders_of_stretch_leave_strain_as_it_is(kinds, form):
    own = ("vibration",) * N
    assert random_body(kinds=own + kinds).strain_form == form
    linear = replace(random_body(kinds=own + kinds), strain=StrainTensors.linear(np.eye(N)))
    assert linear.strain_form == ("linear" if form == "nonlinear" else form)
    assert replace(linear, kinds=()).strain_form == "condensed"  # of kinds that nobody told


def test_the_summary_counts_shapes_and_gives_frequencies_in_hertz():
    body = random_body()
    title, rows = body.summary()
    c = body.moments.first[0] / body.moments.mass
    assert title == "Flexible body"
    assert dict(rows) == {
        "mass": f"{body.moments.mass:.6g} kg",
        "centre of mass": f"({c[0]:.4g}, {c[1]:.4g}, {c[2]:.4g}) m",
        "coordinates": "4",
        "shapes": "3 vibration, 1 attachment, 1 derivative, 1 section",
        "strain": "condensed",
        "frequencies": "1.751, 3.661, 4.934, 9.072 Hz",
        "markers": "origin, tip",
    }
    bare = replace(body, kinds=(), omega=np.zeros(0))
    assert dict(bare.summary()[1])["shapes"] == "6" and "frequencies" not in dict(bare.summary()[1])
    title, rows = rigid_body(2.0, [3.0, 4.0, 5.0], [1.0, 2.0, 3.0]).summary()
    assert title == "Rigid body" and [name for name, _ in rows] == ["mass", "centre of mass", "markers"]


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        ({"damping": np.eye(3)}, r"4 elastic coordinates needs .* of shape \(4, 4\); found \(4, 4\) and \(3, 3\)"),
        ({"strain": StrainTensors.linear(np.eye(5))}, r"shape \(4, 4\); found \(5, 5\) and \(4, 4\)"),
        ({"slaves": np.zeros((2, 4, 3))}, r"6 shapes of which 2 are dependent .* \(2, 4, 4\); found \(2, 4, 3\)"),
        ({"slaves": np.zeros((2, 3, 4))}, r"6 shapes of which 2 are dependent .* \(2, 4, 4\); found \(2, 3, 4\)"),
        ({"markers": {"eye": Marker(np.zeros(3), np.zeros((3, 6)), np.zeros((3, 4)))}}, r"marker 'eye' .* \(3, 6\)"),
        ({"markers": {"eye": Marker(np.zeros(3), np.zeros((3, 5)), np.zeros((3, 6)))}},
         r"marker 'eye' has rows of shape \(3, 5\); a body with 6 shapes needs \(3, 6\)"),
    ],
)  # fmt: skip
def test_arrays_that_do_not_fit_are_refused_with_both_shapes(change, sentence):
    with pytest.raises(ValueError, match=sentence):
        replace(random_body(), **change)


def test_every_body_has_an_origin_that_stays_and_an_unknown_marker_is_named():
    body = random_body()
    origin = body.marker("origin")
    assert not origin.position.any() and not origin.phi.any() and origin.psi.shape == (3, N + FOLLOW)
    with pytest.raises(KeyError, match=r"marker 'nose' is not on the body; its markers are \['origin', 'tip'\]"):
        body.marker("nose")
    own = replace(body, markers={"origin": Marker(np.ones(3), origin.phi, origin.psi)})
    np.testing.assert_array_equal(own.marker("origin").position, np.ones(3))


def test_moments_of_a_deformed_body_are_those_of_its_moved_points():
    dm, rho, phi = random_points()
    moments = point_moments(dm, rho, phi)
    delta = np.random.default_rng(2).normal(size=N + FOLLOW)
    for d in (None, delta):
        r = rho if d is None else rho + phi @ d
        J = sum(m * ((x @ x) * np.eye(3) - np.outer(x, x)) for m, x in zip(dm, r, strict=True))
        np.testing.assert_allclose(moments.center_of_mass(d), dm @ r / dm.sum(), rtol=1e-12)
        np.testing.assert_allclose(moments.inertia(d), J, rtol=1e-11, atol=1e-11)
    np.testing.assert_allclose(moments.elastic_mass(), np.einsum("p,pak,pal->kl", dm, phi, phi), rtol=1e-12)
    assert moments.mass == pytest.approx(dm.sum()) and moments.n_modes == N + FOLLOW


def test_six_points_have_the_mass_first_moments_and_inertia_of_a_body():
    dm, rho, phi = random_points()
    given = point_moments(dm, rho, phi)
    points = points_of_moments(given)
    again = point_moments(points.dm, points.rho, points.phi)
    assert len(points.dm) == 6 and again.mass == pytest.approx(given.mass)
    np.testing.assert_allclose(again.first, given.first, rtol=1e-11, atol=1e-11)
    np.testing.assert_allclose(again.inertia(), given.inertia(), rtol=1e-11)
    flat = points_of_moments(point_moments(dm, rho * [1.0, 1.0, 0.0], phi))  # rounding below zero out of the plane
    assert np.isfinite(flat.rho).all()
    X = np.random.default_rng(5).normal(size=(6, 2))
    np.testing.assert_allclose(points.mixed(X).phi, np.einsum("pak,kl->pal", points.phi, X), rtol=1e-12)


def frame_of_section(tangent, twist, axis):
    """Rotation of a section whose axis lies along a tangent, twisted about it: no turn about the axis but twist."""
    across = np.cross(axis, tangent)
    sine = np.linalg.norm(across)
    swing = dcm_from_vector(across / sine * np.arctan2(sine, axis @ tangent))
    return swing @ dcm_from_vector(twist * axis)


def test_the_rotation_vector_of_a_section_is_that_of_its_axis_on_the_tangent():
    """Slopes are sines: tangent = e sqrt(1 - |p|^2) + p x e; right to second order, to third in the slopes alone."""
    axis = np.array([2.0, -1.0, 2.0]) / 3.0
    u = np.cross(axis, [0.3, 0.8, -0.5])
    u /= np.linalg.norm(u)
    marker = Marker(np.zeros(3), np.zeros((3, 2)), np.stack([u, axis], axis=1), axis=axis)
    errors = []
    for size in (0.1, 0.05):
        for twist in (0.0, 0.6 * size):
            p = size * u
            tangent = axis * np.sqrt(1 - size**2) + np.cross(p, axis)
            exact = vector_from_dcm(frame_of_section(tangent, twist, axis))
            errors.append(np.abs(marker.rotation_vector([[size, twist]])[0] - exact).max())
    assert errors[0] < 2e-6 and errors[2] < errors[0] / 20  # fifth order
    assert errors[1] < 1e-4 and errors[3] < errors[1] / 6  # third order
    still = replace(marker, axis=np.zeros(3))
    np.testing.assert_allclose(still.rotation_vector([0.3, -0.2]), 0.3 * u - 0.2 * axis)
    np.testing.assert_allclose(still.turned(np.diag([1.0, -1.0, -1.0])).orientation, np.diag([1.0, -1.0, -1.0]))


@pytest.mark.parametrize("degree", [2, 3, 4])
def test_values_picked_in_another_order_are_those_of_the_tensor_in_that_order(degree):
    rng = np.random.default_rng(degree)
    chosen = np.array([4, 0, 3])
    values = rng.normal(size=len(packed_indices(5, degree)))
    whole = unpacked(values, 5, degree)
    np.testing.assert_allclose(picked(values, 5, chosen, degree), packed(whole[np.ix_(*[chosen] * degree)]))


def test_the_settled_state_has_no_force_on_the_free_coordinates_and_keeps_the_others():
    """Where full Newton steps overshoot a double well, they are halved until the energy falls."""
    rng = np.random.default_rng(4)
    A = rng.normal(size=(4, 10))
    V3 = np.einsum("ip,jp,kp,lp->ijkl", A, A, A, A)
    strain = StrainTensors(
        -np.diag([1.0, 2.0, 0.5, 0.3]), rng.normal(size=4), packed(rng.normal(size=(4,) * 3)), packed(V3)
    )
    free = np.array([3, 0])
    for start in rng.normal(size=(5, 4)):
        found = strain.settled(start, free)
        np.testing.assert_array_equal(found[[1, 2]], start[[1, 2]])
        assert strain.energy(found) <= strain.energy(start)
        assert np.abs(strain.force(found)[free]).max() < 1e-6 * np.abs(strain.force(start)).max()
        assert np.linalg.eigvalsh(strain.tangent(found)[np.ix_(free, free)])[0] > 0
    np.testing.assert_array_equal(strain.settled(start, np.zeros(0, np.int64)), start)


def test_tensors_that_hold_zeros_or_one_of_two_are_linear_or_not():
    zero, n = np.zeros(4), np.zeros(5)
    assert StrainTensors(np.eye(2), np.zeros(2), zero, n).is_linear
    assert not StrainTensors(np.eye(2), np.zeros(2), np.array([0, 1.0, 0, 0]), n).is_linear
    assert not StrainTensors(np.eye(2), np.zeros(2), zero, n + 1).is_linear
    with pytest.raises(ValueError, match=r"V2 of 2 coordinates has 4 packed values.*found shape \(5,\)"):
        StrainTensors(np.eye(2), np.zeros(2), n, n)


def test_rows_of_moments_stay_with_their_shapes():
    moments = MassMoments(2.0, np.arange(6.0).reshape(2, 3), np.zeros((2, 3, 2, 3)))
    np.testing.assert_array_equal(moments.center_of_mass([2.0]), [3.0, 4.5, 6.0])
