"""Bodies against sums over their points of mass: moments, markers, fewer coordinates; a round trip through pickle."""

from __future__ import annotations

import pickle
from dataclasses import fields, is_dataclass, replace
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from femflex.body import FlexibleBody, Marker, Skin, StrainTensors, rigid_body
from femflex.body.moments import MassPoints
from femflex.body.strain_field import StrainPart
from femflex.body.symmetric import packed, unpacked
from femflex.fem import Member, build_structure
from femflex.fem.sections import Circle
from femflex.fem.sections.materials import Material
from femflex.mesh import line
from femflex.reduction import cantilever_modes, reduce_structure, with_derivatives
from femflex.reduction.inertia.moments import point_moments

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


def test_truncated_body_equals_the_body_with_zero_amplitudes():
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


def test_dependent_amplitudes_are_half_the_products():
    body = random_body()
    d = np.random.default_rng(3).normal(size=(2, 5, N))
    found = body.amplitudes(d)
    np.testing.assert_array_equal(found[..., :N], d)
    np.testing.assert_allclose(found[..., N:], np.einsum("skl,abk,abl->abs", body.slaves, d, d) / 2, rtol=1e-12)


def test_moments_of_a_deformed_body_are_those_of_its_points():
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


def test_settled_state_is_in_equilibrium():
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


@pytest.mark.parametrize("seed", range(3))
def test_rotation_of_a_section_is_bending_then_twist(seed: int):
    """exp(p) exp(twist e) with the tangent exp(p) e: psi delta holds the twist and the sines of the slopes.

    Right to second order in all and to third in the slopes: p to 1e-2 and twist to 1e-4 leave 1e-9.
    """
    rng = np.random.default_rng(seed)
    frame = Rotation.random(random_state=seed).as_matrix()
    e, across = frame[:, 0], frame[:, 1:]
    slopes, twist = 0.02 * rng.uniform(0.3, 1.0, 2), 2e-4 * rng.uniform(0.5, 1.0)
    bent = across @ slopes
    wanted = (Rotation.from_rotvec(bent) * Rotation.from_rotvec(twist * e)).as_rotvec()
    size = np.linalg.norm(bent)
    s = twist * e + bent * np.sin(size) / size
    delta = rng.normal(size=4)
    psi = rng.normal(size=(3, 4))
    psi += np.outer(s - psi @ delta, delta) / (delta @ delta)
    marker = Marker(np.zeros(3), np.zeros((3, 4)), psi, axis=e)
    np.testing.assert_allclose(marker.rotation_vector(delta), wanted, atol=2e-8)
    assert np.abs(np.cross(e, bent)).max() * twist / 2 > 1e-7  # what second order adds
    assert size**3 / 6 > 1e-7  # and third
    many = marker.rotation_vector(np.stack([delta, 0 * delta]))
    np.testing.assert_allclose(many, [marker.rotation_vector(delta), np.zeros(3)], atol=1e-15)
    free = replace(marker, axis=np.zeros(3))
    np.testing.assert_allclose(free.rotation_vector(delta), s, atol=1e-15)


@pytest.mark.parametrize("J", [np.eye(3), np.diag([0.0, 1.0, 1.0]), np.diag([1.0, 2.0, 3.0])])
def test_rigid_inertia_about_the_origin_by_steiner(J):
    """A ball, a rod, a flat plate; about the origin the mass at the centre adds m (c.c 1 - c c^T)."""
    c = np.array([0.3, -0.2, 0.5])
    body = rigid_body(2.0, J, c)
    np.testing.assert_allclose(body.moments.inertia(), J + 2.0 * (c @ c * np.eye(3) - np.outer(c, c)), atol=1e-12)
    np.testing.assert_allclose(body.moments.center_of_mass(), c)


def leaves(value: Any):
    """All that a body holds, down to arrays, numbers and words."""
    if is_dataclass(value):
        for field in fields(value):
            yield from leaves(getattr(value, field.name))
    elif isinstance(value, dict):
        for key, entry in value.items():
            yield from leaves(key)
            yield from leaves(entry)
    elif isinstance(value, list | tuple):
        for entry in value:
            yield from leaves(entry)
    else:
        yield value


@pytest.mark.parametrize("strain", ["linear", "condensed", "nonlinear"])
def test_reduced_body_survives_pickling(strain):
    member = Member("line", "beam", Circle(0.02), Material(70e9, 0.33, 2700.0))
    structure = build_structure(line([[0, 0, 0], [3, 0, 0]], 4), [member])
    modes = cantilever_modes(structure, "start", 4)
    modes = modes if strain == "linear" else with_derivatives(structure, modes)
    body = reduce_structure(structure, modes, {"tip": "end"}, strain=strain)
    pairs = list(zip(leaves(body), leaves(pickle.loads(pickle.dumps(body))), strict=True))
    assert len(pairs) > 30
    for one, other in pairs:
        assert np.array_equal(one, other, equal_nan=isinstance(one, np.ndarray) and one.dtype.kind == "f")


SIZE = 5


@pytest.fixture(scope="module")
def full_tensors():
    """Random tensors without any symmetry but that of their parts: V1, f0, V2, V3."""
    rng = np.random.default_rng(7)
    return (
        rng.normal(size=(SIZE, SIZE)),
        rng.normal(size=SIZE),
        rng.normal(size=(SIZE,) * 3),
        rng.normal(size=(SIZE,) * 4),
    )


@pytest.fixture(scope="module")
def tensors(full_tensors):
    V1, f0, V2, V3 = full_tensors
    return StrainTensors((V1 + V1.T) / 2, f0, packed(V2), packed(V3))


def test_packed_energy_force_and_tangent_equal_full_tensors(full_tensors, tensors):
    V1, f0, V2, V3 = full_tensors
    d = np.random.default_rng(1).normal(size=SIZE)
    energy = f0 @ d + 0.5 * (
        d @ V1 @ d + 2 * np.einsum("ijk,i,j,k", V2, d, d, d) + np.einsum("ijkl,i,j,k,l", V3, d, d, d, d)
    )
    assert tensors.energy(d) == pytest.approx(energy, rel=1e-13)
    V2s, V3s = unpacked(tensors.V2, SIZE, 3), unpacked(tensors.V3, SIZE, 4)
    force = f0 + (V1 + V1.T) @ d / 2 + 3 * np.einsum("ijk,j,k->i", V2s, d, d)
    force += 2 * np.einsum("ijkl,j,k,l->i", V3s, d, d, d)
    np.testing.assert_allclose(tensors.force(d), force, rtol=1e-12, atol=1e-12)
    tangent = (V1 + V1.T) / 2 + 6 * V2s @ d + 6 * np.einsum("ijkl,k,l->ij", V3s, d, d)
    np.testing.assert_allclose(tensors.tangent(d), tangent, rtol=1e-12, atol=1e-12)


def test_force_and_tangent_are_derivatives_of_the_energy(tensors):
    d, h = np.random.default_rng(2).normal(size=SIZE), 1e-5
    steps = h * np.eye(SIZE)
    force = [(tensors.energy(d + s) - tensors.energy(d - s)) / (2 * h) for s in steps]
    np.testing.assert_allclose(tensors.force(d), force, rtol=1e-8, atol=1e-8)
    tangent = [(tensors.force(d + s) - tensors.force(d - s)) / (2 * h) for s in steps]
    np.testing.assert_allclose(tensors.tangent(d), tangent, rtol=1e-8, atol=1e-8)
