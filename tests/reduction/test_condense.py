"""Condensed bodies: slaved shapes stand where the strain energy is least, to second order."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import minimize

from femflex.body import FlexibleBody, Marker, MassMoments, StrainTensors
from femflex.body.symmetric import packed_size
from femflex.reduction import BeamFunctions, UniformBeam, beam_body, condense, load_body, save_body


def random_body(seed, n=5):
    rng = np.random.default_rng(seed)
    mass, rho, phi = rng.uniform(0.5, 2, 9), rng.normal(size=(9, 3)), rng.normal(size=(9, 3, n))
    z = np.concatenate([rho[:, None], phi.swapaxes(1, 2)], axis=1)
    moments = MassMoments(mass.sum(), np.einsum("p,pAa->Aa", mass, z), np.einsum("p,pAa,pBb->AaBb", mass, z, z))
    K = rng.normal(size=(n, n))
    strain = StrainTensors(
        K @ K.T + np.eye(n), np.zeros(n), rng.normal(size=packed_size(n, 3)), rng.normal(size=packed_size(n, 4))
    )
    tip = Marker(rng.normal(size=3), rng.normal(size=(3, n)), rng.normal(size=(3, n)))
    return FlexibleBody(moments, strain, np.eye(n), {"tip": tip})


def parted(body, free, slaved):
    """Combinations of the shapes: the free ones as they are, the slaved ones without stiffness in common with them."""
    V1 = body.strain.V1
    X = np.eye(body.n_modes)[:, free + slaved]
    X[free, len(free) :] = -np.linalg.solve(V1[np.ix_(free, free)], V1[np.ix_(free, slaved)])
    return X


def relaxed(body, free, slaved, delta):
    """Least energy over the slaved amplitudes near zero, and all amplitudes there."""
    X = parted(body, free, slaved)
    S = X[:, len(free) :]

    def whole(y):
        return X @ np.concatenate([delta, y])

    found = minimize(
        lambda y: body.strain.energy(whole(y)),
        np.zeros(len(slaved)),
        jac=lambda y: S.T @ body.strain.force(whole(y)),
        hess=lambda y: S.T @ body.strain.tangent(whole(y)) @ S,
        method="trust-exact",
        options={"gtol": 1e-15},
    )
    return found.fun, whole(found.x)


@pytest.mark.parametrize("seed", range(3))
def test_energy_is_that_of_the_relaxed_body_to_fourth_order_and_places_to_second(seed):
    body, free, slaved = random_body(seed), [0, 2, 4], [1, 3]
    small = condense(body, slaved)
    assert small.n_modes == 3 and small.n_shapes == 5 and len(small.slaves) == 2
    direction = np.random.default_rng(seed).normal(size=3)
    energy, place = [], []
    for size in (0.04, 0.02):
        least, amplitudes = relaxed(body, free, slaved, size * direction)
        energy.append(abs(small.strain.energy(size * direction) - least))
        shown = small.marker("tip").phi @ small.amplitudes(size * direction)
        place.append(np.linalg.norm(shown - body.marker("tip").phi @ amplitudes))
    assert np.log2(energy[0] / energy[1]) > 4.5  # what is left out is of fifth order
    assert np.log2(place[0] / place[1]) > 2.6  # of third order


def test_the_coordinates_keep_the_stiffness_and_mass_they_had():
    body, free = random_body(3), [0, 2, 4]
    small = condense(body, [1, 3])
    np.testing.assert_array_equal(small.strain.V1, body.strain.V1[np.ix_(free, free)])
    mass = body.moments.elastic_mass()[np.ix_(free, free)]
    np.testing.assert_allclose(small.moments.elastic_mass()[:3, :3], mass, rtol=1e-13)


def test_moments_of_the_condensed_body_are_those_of_its_shapes():
    body = random_body(4)
    small = condense(body, [1, 3])
    delta = np.array([0.3, -0.2, 0.5])
    amplitudes = parted(body, [0, 2, 4], [1, 3]) @ small.amplitudes(delta)
    assert small.moments.center_of_mass(small.amplitudes(delta)) == pytest.approx(
        body.moments.center_of_mass(amplitudes)
    )
    assert small.moments.inertia(small.amplitudes(delta)) == pytest.approx(body.moments.inertia(amplitudes))


def test_a_cantilever_keeps_curvature_alone_and_held_ends_their_stretch():
    functions = BeamFunctions(y=3, family="polynomial")
    beam = UniformBeam(2.0, 7e6, 40.0, 40.0, 10.0, 1.3)
    free = beam_body(beam, functions, strain="condensed", orthonormal=False)
    whole = beam_body(beam, replace(functions, axial=12), strain="nonlinear", orthonormal=False)
    d = np.array([0.02, -0.01, 0.005])
    held = whole.strain.energy(np.concatenate([d, np.zeros(12)]))
    linear = d @ free.strain.V1 @ d / 2
    assert held > 2 * linear  # bending alone stretches
    x, weight = np.polynomial.legendre.leggauss(40)
    slope, curvature = (functions.fields((x + 1) / 2, 2.0, k)[:, 1] @ d / np.sqrt(2.0 * 1.3) for k in (1, 2))
    bent = 40.0 / 2 * (weight @ (curvature * slope) ** 2)  # kappa^2 = v''^2 (1 + v'^2) of an inextensible beam
    assert free.strain.energy(d) - linear == pytest.approx(bent, rel=1e-5)
    held_ends = beam_body(
        beam, replace(functions, y=1, ends="pinned-pinned", family="characteristic"), strain="condensed"
    )
    a = 0.05 * np.sqrt(2.0 * 1.3 / 2)  # amplitude of 0.05 sin(pi x / L)
    stretch = (np.pi * 0.05 / 2.0) ** 2 / 4
    wanted = 0.5 * 7e6 * stretch**2 * 2.0 + 0.5 * held_ends.omega[0] ** 2 * a**2
    bent = 40.0 / 2 * 0.05**4 * (np.pi / 2) ** 6 * 2.0 / 8
    assert held_ends.strain.energy(np.array([a])) == pytest.approx(wanted + bent, rel=1e-10)


def test_a_condensed_body_survives_its_file(tmp_path):
    body = condense(random_body(2), [1, 3])
    back = load_body(save_body(tmp_path / "small.h5", body))
    assert np.array_equal(back.slaves, body.slaves) and back.n_modes == 3
    assert np.array_equal(back.strain.V3, body.strain.V3)


def test_fewer_coordinates_keep_what_follows_them():
    body = condense(random_body(2), [1, 3])
    less = body.truncated(2)
    d = np.array([0.4, -0.7])
    assert less.amplitudes(d) == pytest.approx(body.amplitudes(np.append(d, 0.0))[[0, 1, 3, 4]])
    assert less.strain.energy(d) == pytest.approx(body.strain.energy(np.append(d, 0.0)))
    assert body.without_slaves().n_shapes == 3


@pytest.mark.parametrize(
    "change, slaved, words",
    [
        (lambda b: replace(b, strain=StrainTensors.linear(b.strain.V1)), [1], "linear strain has nothing that couples"),
        (lambda b: b, [], "0 of 5 shapes were requested as dependent"),
        (lambda b: b, [0, 1, 2, 3, 4], "leave at least one coordinate"),
        (lambda b: condense(b, [1]), [1], "condensed already"),
        (
            lambda b: replace(b, strain=replace(b.strain, f0=np.ones(5))),
            [1],
            "initial stress loads the dependent",
        ),
        (lambda b: replace(b, strain=replace(b.strain, V1=np.ones((5, 5)))), [1, 2], "shapes are linearly dependent"),
    ],
)
def test_what_cannot_be_condensed_is_refused(change, slaved, words):
    with pytest.raises(ValueError, match=words):
        condense(change(random_body(1)), slaved)


def test_nonlinear_beams_want_axial_functions():
    with pytest.raises(ValueError, match="nonlinear strain without axial functions"):
        beam_body(UniformBeam(1.0, 1e4, 1.0, 1.0, 1.0, 1.0), BeamFunctions(y=2), strain="nonlinear")
