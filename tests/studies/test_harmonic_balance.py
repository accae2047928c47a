"""Harmonic balance of bodies made at random, against derivatives of their energies and integrals over a period."""

from __future__ import annotations

import re

import numpy as np
import pytest
from scipy.special import ellipk

from femflex.body import FlexibleBody, Marker, MassMoments, Skin, StrainTensors
from femflex.studies import BackboneError, backbone
from femflex.studies.arc import Place, measured
from femflex.studies.harmonic_balance import HarmonicBalance, Vibration
from femflex.studies.held_motion import HeldMotion
from femflex.studies.internal_resonance import first_share


def cloud_body(n: int, followers: int, seed: int = 1, stiff: float = 30.0) -> FlexibleBody:
    """Nine points of mass in n shapes and some that follow them; strain of all orders."""
    rng = np.random.default_rng(seed)
    mass, phi = rng.uniform(0.5, 2.0, 9), rng.normal(size=(9, 3, n + followers))
    z = np.concatenate([rng.normal(size=(9, 1, 3)), phi.swapaxes(1, 2)], axis=1)
    moments = MassMoments(mass.sum(), np.einsum("p,pAa->Aa", mass, z), np.einsum("p,pAa,pBb->AaBb", mass, z, z))
    A, K = rng.normal(size=(followers, n, n)), rng.normal(size=(n, n))
    strain = StrainTensors(
        stiff * (K @ K.T + n * np.eye(n)),
        np.zeros(n),
        rng.normal(size=n * (n + 1) * (n + 2) // 6),
        rng.uniform(0.1, 1.0, n * (n + 1) * (n + 2) * (n + 3) // 24),
    )
    skin = Skin(rng.normal(size=(4, 3)), {"vertex": np.arange(4)[:, None]}, rng.normal(size=(n + followers, 4, 3)))
    marker = Marker.rigid(np.zeros(3), n_modes=n + followers)
    return FlexibleBody(
        moments,
        strain,
        np.zeros((n, n)),
        {"origin": marker},
        skin,
        slaves=A + A.swapaxes(1, 2) if followers else np.zeros((0, 0, 0)),
    )


BODIES = [(2, 0), (2, 3), (3, 1)]


@pytest.mark.parametrize(("n", "followers"), BODIES)
def test_inertia_is_lagranges_of_the_kinetic_energy_of_all_shapes(n: int, followers: int):
    """d/dt dT/dq' - dT/dq with T = eta'.Me eta' / 2, from eta(q) of the body alone, by differences."""
    body = cloud_body(n, followers)
    motion, rng = HeldMotion(body), np.random.default_rng(2)
    Me = body.moments.elastic_mass()

    def energy(q: np.ndarray, rate: np.ndarray) -> float:
        h = 1e-5
        eta = (body.amplitudes(q + h * rate) - body.amplitudes(q - h * rate)) / (2 * h)
        return eta @ Me @ eta / 2

    q, q1, q2 = 0.3 * rng.normal(size=(3, 4, n))
    found, h = motion.inertia(q, q1, q2), 1e-3
    for row in range(4):
        at, rate, more = q[row], q1[row], q2[row]
        for k, e in enumerate(np.eye(n)):

            def momentum(t: float, e: np.ndarray = e) -> float:
                there, speed = at + t * rate + t**2 / 2 * more, rate + t * more  # noqa: B023
                return (energy(there, speed + h * e) - energy(there, speed - h * e)) / (2 * h)

            by_rate = (momentum(h) - momentum(-h)) / (2 * h)
            by_place = (energy(at + h * e, rate) - energy(at - h * e, rate)) / (2 * h)
            assert found[row, k] == pytest.approx(by_rate - by_place, rel=1e-4, abs=1e-4)
    assert motion.elastic(q)[2] == pytest.approx(body.strain.force(q[2]))


@pytest.mark.parametrize(("n", "followers"), BODIES)
def test_slopes_and_the_jacobian_are_differences_of_the_forces(n: int, followers: int):
    body = cloud_body(n, followers)
    motion, rng = HeldMotion(body), np.random.default_rng(3)
    parts, square, h = 0.3 * rng.normal(size=(3, 5, n)), 2.7, 1e-6
    slopes = motion.slopes(*parts, square)
    for place in range(3):
        for j in range(n):
            step = np.zeros((3, 5, n))
            step[place, :, j] = h
            ends = [motion.elastic(p[0]) + square * motion.inertia(*p) for p in (parts + step, parts - step)]
            assert slopes[place][:, :, j] == pytest.approx((ends[0] - ends[1]) / (2 * h), rel=1e-5, abs=1e-5)
    row = body.skin.shapes[:, 2] @ np.array([0.6, 0.0, 0.8])
    problem, c, omega = HarmonicBalance(motion, row), 0.2 * rng.normal(size=(4, n)), 1.7

    def unbalanced(x: np.ndarray) -> np.ndarray:
        """Integrals over a period with 30 instants, and the amplitude, from their definitions."""
        c, omega = x[:-1].reshape(4, n), x[-1]
        phase, k = np.arange(30) * 2 * np.pi / 30, np.arange(4)
        cos, sin = np.cos(np.outer(phase, k)), np.sin(np.outer(phase, k))
        force = motion.elastic(cos @ c) + omega**2 * motion.inertia(cos @ c, -(k * sin) @ c, -(k**2 * cos) @ c)
        rest = np.where(k == 0, 1, 2)[:, None] / 30 * (cos.T @ force)
        return np.append(rest.ravel(), row @ body.amplitudes(c.sum(axis=0)))

    x, J = np.append(c.ravel(), omega), problem.jacobian(c, omega)
    for j, e in enumerate(np.eye(len(x))):
        assert J[:, j] == pytest.approx((unbalanced(x + h * e) - unbalanced(x - h * e)) / (2 * h), rel=1e-5, abs=1e-5)
    other = rng.normal(size=len(x))
    assert problem.jacobian(c, omega, other)[-1] == pytest.approx(other) and problem.jacobian(c, omega, other)[
        :-1
    ] == pytest.approx(J[:-1])
    along = rng.normal(size=len(x))
    assert problem.rate(Vibration(0.1, omega, c), along) == pytest.approx(J[-1] @ along)


@pytest.mark.parametrize("followers", [0, 2])
def test_what_is_found_balances_over_a_fine_period_and_moves_its_place_by_the_amplitude(followers: int):
    body = cloud_body(2, followers, seed=5, stiff=3.0)
    found = backbone(body, 2, [0.05, 0.12], harmonics=5)
    Me = body.moments.elastic_mass()[:2, :2]
    squares, X = np.linalg.eig(np.linalg.solve(Me, body.strain.V1))
    high = int(np.argmax(squares))
    assert found.small == pytest.approx(np.sqrt(squares[high])) and found.mode == 2
    moved = np.einsum("kpa,k->pa", body.skin.shapes[:2], X[:, high])
    farthest = int(np.argmax(np.linalg.norm(moved, axis=1)))
    assert found.place == pytest.approx(body.skin.points[farthest])
    assert abs(found.direction @ moved[farthest]) == pytest.approx(np.linalg.norm(moved[farthest]))
    motion, k, phase = HeldMotion(body), np.arange(6), np.arange(300) * 2 * np.pi / 300
    assert found.amplitudes.tolist() == [0.05, 0.12] and found.harmonics.shape == (2, 6, 2)
    for amplitude, omega, c in zip(found.amplitudes, found.omega, found.harmonics, strict=True):
        cos, sin = np.cos(np.outer(phase, k)), np.sin(np.outer(phase, k))
        elastic = motion.elastic(cos @ c)
        force = elastic + omega**2 * motion.inertia(cos @ c, -(k * sin) @ c, -(k**2 * cos) @ c)
        assert np.abs(cos.T @ force).max() < 1e-7 * np.abs(cos.T @ elastic).max()
        eta = body.amplitudes(c.sum(axis=0))
        assert np.einsum("kpa,k->pa", body.skin.shapes, eta)[farthest] @ found.direction == pytest.approx(amplitude)


def test_few_harmonics_of_a_strong_spring_are_those_of_its_integrals():
    """x'' + x + 4 x^3 with the first harmonics alone: each balances by a fine rule, though x^3 has more."""
    found = backbone(oscillator(0.0, 4.0), 1, [1.0], harmonics=3)
    phase = np.arange(400) * 2 * np.pi / 400
    for omega, c in zip(found.omega, found.harmonics[:, :, 0], strict=True):
        x = np.cos(np.outer(phase, np.arange(4))) @ c
        acceleration = -(omega**2) * np.cos(np.outer(phase, np.arange(4))) @ (np.arange(4) ** 2 * c)
        left = np.cos(np.outer(np.arange(4), phase)) @ (acceleration + x + 4 * x**3) / 400
        assert np.abs(left).max() < 1e-7


def test_lengths_along_a_branch_are_those_of_the_mean_square_and_of_the_frequency():
    body = cloud_body(2, 1)
    problem, rng = HarmonicBalance(HeldMotion(body), np.ones(3)), np.random.default_rng(4)
    at, Me = Vibration(0.3, 2.0, rng.normal(size=(3, 2))), body.moments.elastic_mass()[:2, :2]
    one, other = rng.normal(size=(2, 7))

    def product(a: np.ndarray, b: np.ndarray) -> float:
        size = np.trace(at.harmonics @ Me @ at.harmonics.T)
        return np.trace(a[:-1].reshape(3, 2) @ Me @ b[:-1].reshape(3, 2).T) / size + a[-1] * b[-1] / 2.0**2

    assert measured(problem, at, one) @ other == pytest.approx(product(one, other))
    place = Place.of(problem, at, one)
    assert product(place.tangent, place.tangent) == pytest.approx(1.0) and place.row @ other == pytest.approx(
        product(place.tangent, other)
    )
    shares = [c @ Me @ c for c in at.harmonics]
    assert first_share(problem, place) == pytest.approx(shares[1] / (shares[1] + shares[2]))


def oscillator(c2: float, c3: float) -> FlexibleBody:
    """One coordinate of unit mass, V = d^2 / 2 + c2 d^3 + c3 d^4 / 4, seen as metres along z."""
    moments = MassMoments(1.0, np.array([[0, 0, 0], [0, 0, 1.0]]), np.zeros((2, 3, 2, 3)))
    moments.second[1, 2, 1, 2] = 1.0
    strain = StrainTensors(np.eye(1), np.zeros(1), np.array([c2]), np.array([c3 / 2]))
    skin = Skin(np.zeros((1, 3)), {"vertex": np.array([[0]])}, np.array([[[0.0, 0.0, 1.0]]]))
    return FlexibleBody(moments, strain, np.zeros((1, 1)), {"origin": Marker.rigid(np.zeros(3), n_modes=1)}, skin)


@pytest.mark.parametrize(
    ("mode", "amplitudes", "words"),
    [
        (1, [], r"amplitudes are \[\]; give rising lengths above zero"),
        (1, [0.0, 1.0], r"amplitudes are \[0.0, 1.0\]; give"),
        (1, [1.0, 1.0], "give rising"),
        (1, [2.0, 1.0], "give rising"),
        (1, [1.0, np.inf], "give rising"),
        (0, [1.0], "mode 0 was requested; the body has modes 1 to 1"),
        (2, [1.0], "mode 2 was requested; the body has modes 1 to 1"),
    ],
)
def test_a_backbone_that_cannot_be_is_refused(mode, amplitudes, words):
    with pytest.raises(ValueError, match=words):
        backbone(oscillator(0.0, 1.0), mode, amplitudes)


def test_a_softening_spring_ends_where_it_gives_way_and_keeps_what_was_found(monkeypatch):
    """x'' + x - x^3 has no vibration beyond x = 1; omega = pi sqrt(1 - a^2 / 2) / (2 K(m)), m = a^2 / (2 - a^2)."""
    monkeypatch.setattr("femflex.studies.branch.POINTS", 7)
    monkeypatch.setattr("femflex.studies.branch.beyond_resonance", lambda *_: None)  # nothing lies beyond
    with pytest.raises(BackboneError, match=r"no free vibration with an amplitude of 1\.3 m was found") as told:
        backbone(oscillator(0.0, -1.0), 1, [0.3, 1.3], harmonics=3)
    found = told.value.found
    assert found is not None and found.amplitudes.tolist() == [0.3]
    assert found.omega == pytest.approx([np.pi * np.sqrt(1 - 0.045) / (2 * ellipk(0.09 / 1.91))], rel=1e-5)
    last, hertz = map(float, re.search(r"was followed up to (\S+) m at (\S+) Hz: ", str(told.value)).groups())
    top = max(found.path, key=lambda one: one.amplitude)
    assert (last, hertz) == pytest.approx((top.amplitude, top.omega / (2 * np.pi)), rel=1e-3)
    assert (
        len(found.path) == 7
        and not len(found.gaps)
        and str(told.value).endswith("Hz: it was followed over 7 steps. Request smaller amplitudes")
    )


def test_a_tongue_of_internal_resonance_is_stepped_over_and_reported():
    """As x'' + x + x^3 + 0.9 x^2 y = 0 hardens, its third harmonic meets y at omega = 3.3 / 3; it goes on beyond."""
    moments = MassMoments(1.0, np.zeros((3, 3)), np.zeros((3, 3, 3, 3)))
    moments.second[1:, 2, 1:, 2] = np.eye(2)
    V3 = np.array([0.5, 0.15, 0.0, 0.0, 0.0])  # x^4 / 4, and 4 (0.15) x^3 y / 2
    strain = StrainTensors(np.diag([1.0, 3.3**2]), np.zeros(2), np.zeros(4), V3)
    skin = Skin(np.zeros((1, 3)), {"vertex": np.array([[0]])}, np.array([[[0.0, 0.0, 1.0]], [[0.0, 0.0, 0.0]]]))
    body = FlexibleBody(moments, strain, np.zeros((2, 2)), {"origin": Marker.rigid(np.zeros(3), n_modes=2)}, skin)
    found = backbone(body, 1, [0.2, 0.7], harmonics=5)
    ((low, high),) = found.gaps
    assert 0.2 < low < high < 0.7 and not [one for one in found.path if low < one.amplitude < high]
    before = max((one for one in found.path if one.amplitude <= low), key=lambda one: one.amplitude)
    after = min((one for one in found.path if one.amplitude >= high), key=lambda one: one.amplitude)
    assert (before.amplitude, after.amplitude) == pytest.approx((low, high))
    assert before.omega == pytest.approx(1.1, rel=1e-2) and before.omega < after.omega < 1.15
    assert found.amplitudes.tolist() == [0.2, 0.7]
