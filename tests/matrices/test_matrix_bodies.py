"""Bodies from matrices: the same as from the elements, in checks, in reductions and in Craig-Bampton models."""

from __future__ import annotations

import io
import warnings
from dataclasses import replace

import numpy as np
import pytest
from scipy import sparse
from scipy.linalg import eigh
from support.matrix_examples import SOFT, boom

from femflex.body import MassMoments
from femflex.fem import Member, build_structure
from femflex.matrices import (
    MatrixModel,
    Recovery,
    StatedMass,
    check_model,
    craig_bampton_model,
    full_model,
    matrix_body,
    read_matrices,
    write_matrices,
)
from femflex.mesh.generators import rectangle
from femflex.reduction import Damping, cantilever_modes, craig_bampton, free_free_modes, reduce_structure

IDS = np.array([12, 5, 40])
POINTS = np.array([[0.1, 0.2, 0.3], [1.1, -0.4, 0.5], [0.7, 2.0, -0.6]])
DOFS = np.array([[5, 2], [12, 1], [12, 6], [40, 3], [700, 0], [5, 4], [701, 0]])
GROUPS = {"ends": np.array([5, 40])}


def symmetric(n: int, rng: np.random.Generator) -> np.ndarray:
    X = rng.standard_normal((n, n))
    return X @ X.T + n * np.eye(n)


def model(sparse_ones: bool = False) -> MatrixModel:
    """A model in SI with something in every array; sparse_ones: matrices with few entries."""
    rng = np.random.default_rng(3)
    n = len(DOFS)
    M, K, D, G = (sparse.csr_array(symmetric(n, rng)) for _ in range(4))
    rows = sparse.csr_array(rng.standard_normal((6, n)))
    if sparse_ones:
        M, K, D = (sparse.csr_array(np.diag(A.diagonal())) for A in (M, K, D))
        rows = sparse.csr_array(np.eye(6, n))
    frames = np.array([np.linalg.qr(rng.standard_normal((3, 3)))[0] for _ in IDS])
    z, dm = rng.standard_normal((1 + n, 3, 40)), np.full(40, 2.5 / 40)  # points of mass
    return MatrixModel(
        "m", IDS, POINTS, DOFS, M, K, D, G, frames=frames,
        recovery=Recovery(rng.standard_normal((2, 3)), rows, np.array([0.3, 0.4])),
        moments=MassMoments(2.5, z @ dm, np.einsum("Aak,Bbk,k->AaBb", z, z, dm)), groups=GROUPS,
        cells={"line": np.array([[5, 12], [12, 40]])},
    )  # fmt: skip


def test_components_lie_along_the_axes_of_their_node():
    matrix_model = model()
    s = matrix_model.structure(["ends"])
    row = {n: k for k, n in enumerate(IDS.tolist())}
    for k, (node, c) in enumerate(DOFS):
        moved, turned = (np.zeros((3, 3)) for _ in range(2))
        if c:
            (moved if c < 4 else turned)[row[node]] = matrix_model.frames[row[node]][(c - 1) % 3]
        assert s.translation.toarray()[:, k].reshape(3, 3) == pytest.approx(moved)
        assert s.rotation.toarray()[:, k].reshape(3, 3) == pytest.approx(turned)
    assert sorted(s.mesh.group_points("ends").tolist()) == [1, 2]
    assert s.mesh.cells["line"].tolist() == [[1, 0], [0, 2]]


def bodies(rng) -> tuple[MatrixModel, np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Three rigid bodies with offsets at nodes, joined by springs between nodes that move as one."""
    ids, n = np.array([3, 8, 5]), 18
    x = rng.standard_normal((3, 3))
    M, m, at, J = np.zeros((n, n)), rng.random(3) + 1, np.zeros((3, 3)), []
    for k in range(3):
        r, A = rng.standard_normal(3) * 0.3, rng.standard_normal((3, 3)) * 0.3
        own = A @ A.T
        own = np.trace(own) * np.eye(3) - own
        S = np.array([[0, -r[2], r[1]], [r[2], 0, -r[0]], [-r[1], r[0], 0]])
        M[6 * k : 6 * k + 6, 6 * k : 6 * k + 6] = np.block(
            [[m[k] * np.eye(3), -m[k] * S], [m[k] * S, own - m[k] * S @ S]]
        )
        at[k] = x[k] + r
        J.append(own)
    K = np.zeros((n, n))
    for a, b in ((0, 1), (1, 2)):  # six springs that compare b with a's rigid motion
        r = x[b] - x[a]
        S = np.array([[0, -r[2], r[1]], [r[2], 0, -r[0]], [-r[1], r[0], 0]])
        B = np.zeros((6, n))
        B[:, 6 * b : 6 * b + 6] = np.eye(6)
        B[:, 6 * a : 6 * a + 6] = -np.block([[np.eye(3), -S], [np.zeros((3, 3)), np.eye(3)]])
        K += B.T @ np.diag(rng.random(6) + 1) @ B * 1e4
    dofs = np.array([[k, c] for k in ids for c in range(1, 7)])
    matrix_model = MatrixModel("three", ids, x, dofs, sparse.csr_array(M), sparse.csr_array(K))
    return matrix_model, m, at, np.array(J), x


def test_mass_properties_of_three_rigid_bodies():
    matrix_model, m, at, J, _ = bodies(np.random.default_rng(11))
    report = check_model(matrix_model)
    centre = m @ at / m.sum()
    r = at - centre
    total = sum(J[k] + m[k] * (r[k] @ r[k] * np.eye(3) - np.outer(r[k], r[k])) for k in range(3))
    assert report.mass == pytest.approx(m.sum()) and report.center_of_mass == pytest.approx(centre)
    assert report.inertia == pytest.approx(total) and not report.findings and report.massless == 0
    assert report.rigid.max() < 1e-12
    radius = np.sqrt(np.trace(total) / (2 * m.sum()))
    stated = StatedMass(m.sum() * 1.02, centre + np.array([0.0, 0.0, 0.3]), total * 1.05)
    assert len(check_model(matrix_model, stated).warnings) == 3
    assert not check_model(matrix_model, StatedMass(m.sum() * 1.009, centre + 0.005 * radius, total * 1.009)).findings


def test_craig_bampton_model_under_rigid_motion():
    s = boom()
    body = reduce_structure(s, craig_bampton(s, ["root", "tip"], 3))
    matrix_model = craig_bampton_model(body, ["tip", "root"], "boom")
    assert matrix_model.groups["tip"].tolist() == [1] and matrix_model.groups["root"].tolist() == [2]
    assert matrix_model.points[1] == pytest.approx([0.1, 0.2, 0.0])
    t, w = np.array([0.3, -0.2, 0.5]), np.array([0.1, 0.4, -0.6])
    u = np.zeros(matrix_model.n_dof)
    for k, x in enumerate(matrix_model.points):
        u[6 * k : 6 * k + 3], u[6 * k + 3 : 6 * k + 6] = t + np.cross(w, x), w
    moved = (matrix_model.recovery.rows @ u).reshape(-1, 3)
    assert moved == pytest.approx(t + np.cross(w, matrix_model.recovery.points), abs=1e-9)
    assert matrix_model.K @ u == pytest.approx(0.0, abs=1e-6 * abs(matrix_model.K).max())
    n = len(matrix_model.dofs)
    q = np.concatenate([[0.0], u])
    second = np.einsum("k,kalb,l->ab", q, matrix_model.moments.second, q)
    # int (t + w x r)(t + w x r)^T dm by the body's own moments
    m, first, P = body.moments.mass, body.moments.first[0], body.moments.second[0, :, 0]
    W = np.array([[0, -w[2], w[1]], [w[2], 0, -w[0]], [-w[1], w[0], 0]])
    expected = m * np.outer(t, t) + np.outer(t, W @ first) + np.outer(W @ first, t) + W @ P @ W.T
    assert second == pytest.approx(expected, rel=1e-8) and len(q) == n + 1
    assert q @ matrix_model.moments.first == pytest.approx(m * t + W @ first, rel=1e-8)


def test_estimated_foreshortening_of_a_cantilever():
    """A skew cantilever: its tip draws in by int w'^2 ds along the axis over the stiffness of its lowest shape."""
    s = boom(16, tip=False)
    made = matrix_body(
        full_model(s), lambda structure: cantilever_modes(structure, "root", 3), markers={"tip": "tip"}, turning=()
    ).body
    theta = made.foreshortening
    e = np.array([2.0, 1.0, 2.0]) / 3.0
    L, beta = 3.0, 1.8751040687
    x = np.linspace(0, L, 4001)
    sigma = (np.sinh(beta) - np.sin(beta)) / (np.cosh(beta) + np.cos(beta))
    shape = lambda z: np.cosh(z) - np.cos(z) - sigma * (np.sinh(z) - np.sin(z))  # noqa: E731
    w = shape(beta * x / L)
    mass = made.moments.mass
    w = w / np.sqrt(np.trapezoid(w**2, x) / L * mass)
    drawn = np.trapezoid(np.gradient(w, x) ** 2, x) / made.omega[0] ** 2
    # the skin is of the nodes: chords of 3 m / 16, which take (beta h / L)^2 / 12 of it
    assert theta.at["tip"] == pytest.approx(-drawn * e, rel=0.03)
    along = np.interp(x, x, np.concatenate([[0], np.cumsum(np.diff(w) ** 2 / np.diff(x))])) / made.omega[0] ** 2
    mean = np.trapezoid(along, x) / L * mass
    assert theta.mass[0] == pytest.approx(-mean * e, rel=0.06)
    points = np.array([0.1, 0.2, 0.0]) + np.outer(x, e)
    moment = np.trapezoid(along[:, None] * points, x, axis=0) / L * mass
    assert theta.mass[1:] == pytest.approx(-np.outer(moment, e), rel=0.06)


def test_full_model_of_a_plate_keeps_its_frequencies():
    s = build_structure(rectangle(1.0, 0.5, 2, 1, "triangle"), [Member("surface", "plate", 0.02, SOFT)])
    matrix_model = full_model(s, "plate")
    assert (
        matrix_model.n_dof == s.n_dof
        and matrix_model.n_modal > 0
        and len(set(map(tuple, matrix_model.dofs.tolist()))) == matrix_model.n_dof
    )
    assert min(matrix_model.dofs[matrix_model.dofs[:, 1] == 0, 0]) > len(s.mesh.points)
    assert (matrix_model.cells["triangle"] - 1).tolist() == s.mesh.cells["triangle"].tolist()
    for k, (node, c) in enumerate(matrix_model.dofs):
        if c:
            part = s.translation if c < 4 else s.rotation
            assert part.toarray()[3 * (node - 1) + (c - 1) % 3, k] == pytest.approx(1.0)
    exact = free_free_modes(s, 2).omega
    assert free_free_modes(matrix_model.structure(), 2).omega == pytest.approx(exact, rel=1e-6)


@pytest.fixture(scope="module")
def reduced():
    s = boom()
    return reduce_structure(s, craig_bampton(s, ["root", "tip"], 4))


def test_body_of_craig_bampton_model(reduced, tmp_path):
    model = craig_bampton_model(reduced, ["root", "tip"], "boom")
    back = matrix_body(read_matrices(write_matrices(model, tmp_path / "boom.npz")), markers={"tip": "tip"}).body
    assert back.omega == pytest.approx(reduced.omega, rel=1e-9)
    sign = np.sign(np.einsum("an,an->n", back.moments.first[1:].T, reduced.moments.first[1:].T))
    y = np.append(1.0, sign)
    second = back.moments.second * y[:, None, None, None] * y[None, None, :, None]
    assert second == pytest.approx(reduced.moments.second, abs=1e-7)
    assert back.moments.first * y[:, None] == pytest.approx(reduced.moments.first, abs=1e-8)
    assert back.markers["tip"].phi * sign == pytest.approx(reduced.markers["tip"].phi, abs=1e-8)
    assert back.markers["tip"].psi * sign == pytest.approx(reduced.markers["tip"].psi, abs=1e-8)
    assert back.skin is not None and not back.markers["root"].phi.any() if "root" in back.markers else True


def test_craig_bampton_model_has_the_free_frequencies():
    s = boom()
    exact = free_free_modes(s, 3).omega
    reduced = reduce_structure(s, craig_bampton(s, ["root", "tip"], 12))
    model = craig_bampton_model(reduced, ["root", "tip"])
    K, M = model.K.toarray(), model.M.toarray()
    omega = np.sqrt(np.maximum(eigh(K, M, eigvals_only=True), 0.0))
    assert omega[:6].max() < 1e-4 * exact[0]
    assert omega[6:9] == pytest.approx(exact, rel=1e-4)  # of twelve fixed-interface modes


def test_pyyeti_accepts_the_craig_bampton_model(reduced):
    """cb.cbcheck of pyYeti: fixed-interface frequencies, and mass properties by rigid-body motions."""
    with np.printoptions():  # which pyYeti changes for the whole process
        cb = pytest.importorskip("pyyeti.cb")
        n2p = pytest.importorskip("pyyeti.nastran.n2p")
    model = craig_bampton_model(reduced, ["root", "tip"])
    uset = n2p.addgrid(None, [1, 2], "b", 0, model.points, 0)
    text, b = io.StringIO(), np.arange(12)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        computed = cb.cbcheck(text, model.M.toarray(), model.K.toarray(), b, b[:6], uset, uref=[0, 0, 0])
    assert computed.cb_frq == pytest.approx(np.sqrt(model.K.diagonal()[12:]) / (2 * np.pi), rel=1e-6)
    assert "Mass matrix is symmetric" in text.getvalue() and "Stiffness matrix is symmetric" in text.getvalue()
    rows = text.getvalue().split("6x6 mass matrix from geometry-based rb modes:")[1].strip().splitlines()[:6]
    rigid = np.array([[float(x) for x in row.split()] for row in rows])
    moments = reduced.moments
    assert np.diag(rigid)[:3] == pytest.approx(moments.mass, abs=1e-4)
    assert rigid[3:, 3:] == pytest.approx(moments.inertia(), abs=1e-4)  # it prints four digits


def test_damping_of_a_craig_bampton_model(tmp_path):
    s = boom()
    reduced = reduce_structure(s, craig_bampton(s, ["root", "tip"], 4), damping=Damping(0.01))
    model = craig_bampton_model(reduced, ["root", "tip"])
    back = matrix_body(read_matrices(write_matrices(model, tmp_path / "boom.npz")), markers={"tip": "tip"}).body
    reference = np.diag(reduced.damping) / (2 * reduced.omega)
    assert reference == pytest.approx(np.full(len(reference), 0.01), rel=1e-6)
    assert np.diag(back.damping) / (2 * back.omega) == pytest.approx(reference, rel=1e-6)


def test_craig_bampton_model_without_modes_is_static_condensation():
    """K_bb - K_bi K_ii^-1 K_ib of the structure's own matrices; no skin, no recovery."""
    s = boom(3)
    body = reduce_structure(s, craig_bampton(s, ["root", "tip"], 0))
    matrix_model = craig_bampton_model(replace(body, skin=None), ["root", "tip"])
    assert matrix_model.n_modal == 0 and matrix_model.n_dof == 12 and matrix_model.recovery is None
    rows = np.concatenate([3 * s.mesh.group_points(g)[0] + np.arange(3) for g in ("root", "tip")])
    B = np.concatenate([part.toarray()[rows[k : k + 3]] for k in (0, 3) for part in (s.translation, s.rotation)])
    b = B.argmax(axis=1)
    i = np.setdiff1d(np.arange(s.n_dof), b)
    K, M = s.K.toarray(), s.M.toarray()
    follow = -np.linalg.solve(K[np.ix_(i, i)], K[np.ix_(i, b)])
    expected = K[np.ix_(b, b)] + K[np.ix_(b, i)] @ follow
    assert matrix_model.K.toarray() == pytest.approx(expected, abs=1e-7 * np.abs(expected).max())
    T = np.zeros((s.n_dof, 12))
    T[b], T[i] = np.eye(12), follow
    assert matrix_model.M.toarray() == pytest.approx(T.T @ M @ T, abs=1e-7 * np.abs(M).max())
    assert craig_bampton_model(body, ["root", "tip"]).recovery is not None
