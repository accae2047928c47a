"""Craig-Bampton models out of bodies and back: the same body, and the frequencies of the whole structure."""

from __future__ import annotations

import io
import warnings

import numpy as np
import pytest
from scipy.linalg import eigh
from support.matrix_examples import boom

from femflex.matrices import check_model, craig_bampton_model, matrix_body, read_matrices, write_matrices
from femflex.reduction import ModalDamping, cantilever_modes, craig_bampton, free_free_modes, reduce_structure


@pytest.fixture(scope="module")
def body():
    s = boom()
    return reduce_structure(s, craig_bampton(s, ["root", "tip"], 4))


def test_a_model_written_and_read_is_the_same_body(body, tmp_path):
    model = craig_bampton_model(body, ["root", "tip"], "boom")
    back = matrix_body(read_matrices(write_matrices(model, tmp_path / "boom.npz")), markers={"tip": "tip"}).body
    assert back.omega == pytest.approx(body.omega, rel=1e-9)
    sign = np.sign(np.einsum("an,an->n", back.moments.first[1:].T, body.moments.first[1:].T))
    y = np.append(1.0, sign)
    second = back.moments.second * y[:, None, None, None] * y[None, None, :, None]
    assert second == pytest.approx(body.moments.second, abs=1e-7)
    assert back.moments.first * y[:, None] == pytest.approx(body.moments.first, abs=1e-8)
    assert back.markers["tip"].phi * sign == pytest.approx(body.markers["tip"].phi, abs=1e-8)
    assert back.markers["tip"].psi * sign == pytest.approx(body.markers["tip"].psi, abs=1e-8)
    assert back.skin is not None and not back.markers["root"].phi.any() if "root" in back.markers else True


def test_its_free_frequencies_are_those_of_the_structure():
    s = boom()
    exact = free_free_modes(s, 3).omega
    body = reduce_structure(s, craig_bampton(s, ["root", "tip"], 12))
    model = craig_bampton_model(body, ["root", "tip"])
    K, M = model.K.toarray(), model.M.toarray()
    omega = np.sqrt(np.maximum(eigh(K, M, eigvals_only=True), 0.0))
    assert omega[:6].max() < 1e-4 * exact[0]
    assert omega[6:9] == pytest.approx(exact, rel=1e-4)  # of twelve fixed-interface modes


def test_it_has_the_form_of_a_craig_bampton_model(body):
    model = craig_bampton_model(body, ["root", "tip"])
    report = check_model(model)
    assert not report.findings and report.rigid.max() < 1e-12
    assert report.mass == pytest.approx(body.moments.mass)
    q = np.flatnonzero(model.dofs[:, 1] == 0)
    b = np.flatnonzero(model.dofs[:, 1] > 0)
    K, M = model.K.toarray(), model.M.toarray()
    assert K[np.ix_(b, q)] == pytest.approx(0, abs=1e-6 * abs(K).max())
    assert M[np.ix_(q, q)] == pytest.approx(np.eye(len(q)), abs=1e-9)
    assert model.points == pytest.approx(np.array([[0.1, 0.2, 0.0], [2.1, 1.2, 2.0]]))


def test_a_cantilever_body_has_its_clamp_as_the_only_interface():
    s = boom()
    body = reduce_structure(s, cantilever_modes(s, "root", 4))
    model = craig_bampton_model(body, ["root"])
    assert np.sqrt(model.K.diagonal()[6:]) == pytest.approx(body.omega, rel=1e-9)
    assert model.K.toarray()[:6, :6] == pytest.approx(0, abs=1e-6)
    body = reduce_structure(s, cantilever_modes(s, "root", 4), {"tip": "tip"})
    with pytest.raises(ValueError, match="represent 10 of the 12 independent motions of its interfaces"):
        craig_bampton_model(body, ["root", "tip"])
    with pytest.raises(ValueError, match="name different ones of the markers"):
        craig_bampton_model(body, ["root", "top"])
    with pytest.raises(ValueError, match="needs an interface"):
        craig_bampton_model(body, [])


def test_writing_refuses_other_suffixes_and_existing_files(body, tmp_path):
    model = craig_bampton_model(body, ["root"])
    with pytest.raises(ValueError, match="models are written as"):
        write_matrices(model, tmp_path / "a.xlsx")
    write_matrices(model, tmp_path / "a.npz")
    with pytest.raises(FileExistsError, match="exists already"):
        write_matrices(model, tmp_path / "a.npz")
    with pytest.raises(FileNotFoundError, match="does not exist; make it"):
        write_matrices(model, tmp_path / "none" / "a.npz")
    assert sorted(p.name for p in tmp_path.iterdir()) == ["a.npz"]


def test_pyyeti_finds_no_fault_in_it(body):
    """cb.cbcheck of pyYeti: fixed-interface frequencies, and mass properties by three kinds of rigid-body motions."""
    with np.printoptions():  # which pyYeti changes for the whole process
        cb = pytest.importorskip("pyyeti.cb")
        n2p = pytest.importorskip("pyyeti.nastran.n2p")
    model = craig_bampton_model(body, ["root", "tip"])
    uset = n2p.addgrid(None, [1, 2], "b", 0, model.points, 0)
    text, b = io.StringIO(), np.arange(12)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        found = cb.cbcheck(text, model.M.toarray(), model.K.toarray(), b, b[:6], uset, uref=[0, 0, 0])
    assert found.cb_frq == pytest.approx(np.sqrt(model.K.diagonal()[12:]) / (2 * np.pi), rel=1e-6)
    assert "Mass matrix is symmetric" in text.getvalue() and "Stiffness matrix is symmetric" in text.getvalue()
    rows = text.getvalue().split("6x6 mass matrix from geometry-based rb modes:")[1].strip().splitlines()[:6]
    rigid = np.array([[float(x) for x in row.split()] for row in rows])
    moments = body.moments
    assert np.diag(rigid)[:3] == pytest.approx(moments.mass, abs=1e-4)
    assert rigid[3:, 3:] == pytest.approx(moments.inertia(), abs=1e-4)  # it prints four digits


def test_damping_is_written_and_read_with_the_body(tmp_path):
    s = boom()
    body = reduce_structure(s, craig_bampton(s, ["root", "tip"], 4), damping=ModalDamping(0.01))
    model = craig_bampton_model(body, ["root", "tip"])
    back = matrix_body(read_matrices(write_matrices(model, tmp_path / "boom.npz")), markers={"tip": "tip"}).body
    known = np.diag(body.damping) / (2 * body.omega)
    assert known == pytest.approx(np.full(len(known), 0.01), rel=1e-6)
    assert np.diag(back.damping) / (2 * back.omega) == pytest.approx(known, rel=1e-6)
