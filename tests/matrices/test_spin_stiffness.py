"""Geometric stiffness of a spin given as a matrix: flap and lag of a rotating cantilever (Wright et al. 1982)."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy import sparse
from scipy.linalg import eigh

from femflex.case import read_case
from femflex.matrices import MatrixModel, matrix_body, write_matrices
from femflex.pipeline.case_bodies import build_body
from femflex.reduction import cantilever_modes

ROOT = Path(__file__).resolve().parents[2]
CASES, MESHES = ROOT / "cases", ROOT / "meshes"

N, GAMMA, MU = 24, 2.0, 4.13732  # elements; rate, flap frequency over sqrt(EI / m' L^4)


def blade():
    """A unit beam along x with consistent bending mass, and the geometric stiffness of a spin of GAMMA about z."""
    h, n = 1.0 / N, 6 * (N + 1)
    K, M, G = (np.zeros((n, n)) for _ in range(3))
    s, w = np.polynomial.legendre.leggauss(5)
    s, w = (s + 1) / 2, w / 2
    shape = np.array([1 - 3 * s**2 + 2 * s**3, h * (s - 2 * s**2 + s**3), 3 * s**2 - 2 * s**3, h * (s**3 - s**2)])
    slope = np.array([-6 * s + 6 * s**2, h * (1 - 4 * s + 3 * s**2), 6 * s - 6 * s**2, h * (3 * s**2 - 2 * s)]) / h
    bend = np.array([-6 + 12 * s, h * (-4 + 6 * s), 6 - 12 * s, h * (6 * s - 2)]) / h**2
    for e in range(N):
        tension = GAMMA**2 * (1 - (h * (e + s)) ** 2) / 2
        k, m, g = ((a * w * f) @ a.T * h for a, f in ((bend, 1.0), (shape, 1.0), (slope, tension)))
        for dofs, sign in (([1, 5, 7, 11], 1), ([2, 4, 8, 10], -1)):
            at = np.ix_(6 * e + np.array(dofs), 6 * e + np.array(dofs))
            S = np.outer([1, sign, 1, sign], [1, sign, 1, sign])
            for A, a in ((K, k), (M, m), (G, g)):
                A[at] += S * a
        for first, stiffness, inertia in ((0, 1e6, 1.0), (3, 1e3, 1e-4)):
            at = np.ix_(6 * e + np.array([first, first + 6]), 6 * e + np.array([first, first + 6]))
            K[at] += stiffness / h * np.array([[1, -1], [-1, 1]])
            M[at] += inertia * h / 6 * np.array([[2, 1], [1, 2]])
    ids = np.arange(1, N + 2)
    dofs = np.stack([np.repeat(ids, 6), np.tile(np.arange(1, 7), N + 1)], axis=1)
    x = np.column_stack([np.linspace(0, 1, N + 1), np.zeros((N + 1, 2))])
    M, K, G = (sparse.csr_array(A) for A in (M, K, G))
    return MatrixModel("blade", ids, x, dofs, M, K, geometric=G, groups={"root": np.array([1])})


def stiffness_at(body, omega):
    """Linear stiffness of the coordinates in steady rotation, by the moments (THEORY section 3)."""
    W = np.outer(omega, omega) - omega @ omega * np.eye(3)
    n = body.n_modes
    P = body.moments.second
    K = body.strain.V1 + np.einsum("kalb,ab->kl", P[1 : n + 1, :, 1 : n + 1], W)
    if not len(body.slaves):
        return K
    return K + np.einsum("s,skl->kl", np.einsum("sab,ab->s", P[n + 1 :, :, 0], W), body.slaves)


def test_flap_and_lag_of_a_rotating_blade():
    made = matrix_body(blade().spinning(GAMMA, [0, 0, 1]), lambda s: cantilever_modes(s, "root", 6), turning=())
    Me = made.body.moments.elastic_mass()[:6, :6]
    for rate in (GAMMA, 4.0):
        mu = np.sqrt(eigh(stiffness_at(made.body, np.array([0, 0, rate])), Me, eigvals_only=True)[:2])
        flap = {GAMMA: MU, 4.0: 5.58500}[rate]  # Wright et al.: 4.1373, 5.5850
        assert mu == pytest.approx([np.sqrt(flap**2 - rate**2), flap], rel=1e-3)  # of three modes in each plane


def test_rate_about_another_axis_does_not_stiffen():
    made = matrix_body(blade().spinning(GAMMA, [0, 0, 1]), lambda s: cantilever_modes(s, "root", 4), turning=())
    plain = matrix_body(
        MatrixModel(**{**blade().__dict__, "geometric": None}), lambda s: cantilever_modes(s, "root", 4), turning=()
    )
    about_x = np.array([1.3, 0, 0])
    assert stiffness_at(made.body, about_x) == pytest.approx(stiffness_at(plain.body, about_x), abs=1e-9)


def test_constant_geometric_stiffness_adds_to_stiffness():
    body = matrix_body(blade(), lambda s: cantilever_modes(s, "root", 2), turning=()).body
    assert body.omega == pytest.approx(MU, rel=2e-4)  # both planes: nothing rotates, so lag is not softened


def test_spin_of_matrices_in_a_case(tmp_path):
    write_matrices(blade(), tmp_path / "blade.npz")
    head = '[run]\nduration = 1\nsamples = 11\n[bodies.blade]\nkind = "matrices"\nmatrices = "blade.npz"\n'
    tail = 'reduction = { method = "cantilever", clamp = "root", modes = 4 }\n'
    (tmp_path / "a.toml").write_text(head + "spin = { rate = 2, axis = [0, 0, 1] }\n" + tail)
    body = build_body(read_case(tmp_path / "a.toml"), "blade")
    assert np.sqrt(stiffness_at(body, np.array([0, 0, GAMMA]))[1, 1]) < MU + 0.01 and len(body.slaves) == 1


def test_southwell_estimate_without_geometric_stiffness():
    """Southwell: a uniform cantilever that spins about its root has omega^2 = omega_0^2 + 1.193 rate^2 in flap."""
    made = matrix_body(replace(blade(), geometric=None), lambda s: cantilever_modes(s, "root", 6), turning=())
    theta = made.body.foreshortening
    W = np.outer([0, 0, 1.0], [0, 0, 1.0]) - np.eye(3)
    assert np.sum(W * theta.mass[1:]) * 12.3624 == pytest.approx(1.193, rel=0.08)  # an estimate
    assert matrix_body(blade(), lambda s: cantilever_modes(s, "root", 6), turning=()).body.foreshortening is None
