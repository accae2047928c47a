"""Matrices at their limits: bodies without modes or skin, masses at points, empty columns, files of odd content."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy import sparse
from scipy.io import savemat
from support.matrix_examples import boom
from test_matrix_numbers import DOFS, bodies, model, same

from femflex.matrices import (
    MatrixModel,
    Recovery,
    Sources,
    check_model,
    craig_bampton_model,
    full_model,
    matrix_body,
    read_matrices,
    write_matrices,
)
from femflex.matrices.contents import groups_from, read_contents
from femflex.matrices.describe import describe_matrices
from femflex.matrices.foreshortening import estimated_foreshortening
from femflex.matrices.spin import with_spin_stiffness
from femflex.reduction import cantilever_modes, craig_bampton, reduce_structure
from femflex.reduction.inertia.mass_matrix import KnownMoments, PointMasses


def test_a_craig_bampton_model_without_modes_is_the_static_condensation_on_its_interfaces():
    """K_bb - K_bi K_ii^-1 K_ib of the structure's own matrices; no skin, no recovery."""
    s = boom(3)
    body = reduce_structure(s, craig_bampton(s, ["root", "tip"], 0))
    one = craig_bampton_model(replace(body, skin=None), ["root", "tip"])
    assert one.n_modal == 0 and one.n_dof == 12 and one.recovery is None
    rows = np.concatenate([3 * s.mesh.group_points(g)[0] + np.arange(3) for g in ("root", "tip")])
    B = np.concatenate([part.toarray()[rows[k : k + 3]] for k in (0, 3) for part in (s.translation, s.rotation)])
    b = B.argmax(axis=1)
    i = np.setdiff1d(np.arange(s.n_dof), b)
    K, M = s.K.toarray(), s.M.toarray()
    follow = -np.linalg.solve(K[np.ix_(i, i)], K[np.ix_(i, b)])
    wanted = K[np.ix_(b, b)] + K[np.ix_(b, i)] @ follow
    assert one.K.toarray() == pytest.approx(wanted, abs=1e-7 * np.abs(wanted).max())
    T = np.zeros((s.n_dof, 12))
    T[b], T[i] = np.eye(12), follow
    assert one.M.toarray() == pytest.approx(T.T @ M @ T, abs=1e-7 * np.abs(M).max())
    assert craig_bampton_model(body, ["root", "tip"]).recovery is not None


def test_foreshortening_is_estimated_only_where_a_line_bends():
    """Not without shapes, without points, of one point, of points at one place, nor without stiffness."""
    s = boom(4, tip=False)
    body = matrix_body(full_model(s), lambda one: cantilever_modes(one, "root", 2), turning=()).body
    skin = body.skin
    assert estimated_foreshortening(body) is not None
    assert estimated_foreshortening(replace(body, skin=None)) is None
    one = replace(skin, points=skin.points[:1], shapes=skin.shapes[:, :1], cells={})
    assert estimated_foreshortening(replace(body, skin=one)) is None
    same_place = replace(skin, points=np.tile(skin.points[2], (len(skin.points), 1)))
    assert estimated_foreshortening(replace(body, skin=same_place)) is None
    soft = replace(body, strain=replace(body.strain, V1=0 * body.strain.V1))
    assert estimated_foreshortening(soft) is None


def test_a_model_brings_its_moments_or_the_masses_of_its_points_or_nothing():
    one = model()
    known = one.distribution
    assert isinstance(known, KnownMoments) and known.of_dofs is one.moments
    points = replace(one, moments=None).distribution
    assert isinstance(points, PointMasses)
    assert points.dm.tolist() == [0.3, 0.4] and points.rho is one.recovery.points
    assert points.rows is one.recovery.rows
    bare = Recovery(one.recovery.points, one.recovery.rows)
    assert replace(one, moments=None, recovery=bare).distribution is None
    assert replace(one, moments=None, recovery=None).distribution is None


def test_a_spin_needs_a_direction():
    s = boom(3)
    body = reduce_structure(s, cantilever_modes(s, "root", 2))
    with pytest.raises(ValueError, match=r"^the axis of the spin is \[0\.0, 0\.0, 0\.0\]; give a direction$"):
        with_spin_stiffness(body, np.eye(2), [0, 0, 0])
    made = with_spin_stiffness(replace(body, skin=None), np.diag([3.0, 5.0]), [0, 0, 4.0])
    assert made.skin is None and made.kinds[-1] == "remainder" and len(made.kinds) == 3
    assert made.slaves[-1] == pytest.approx(np.diag([3.0, 5.0]))
    e = np.array([0, 0, 1.0])
    assert made.moments.second[0, :, -1] == pytest.approx(np.outer(e, e) - np.eye(3) / 2)


def test_columns_without_entries_are_left_out_of_bulk_data_and_come_back_as_zeros(tmp_path):
    one = replace(model(), frames=None, geometric=None, recovery=None, moments=None, groups={}, cells={})
    M, D = one.M.toarray(), np.zeros((7, 7))
    M[2, :], M[:, 2] = 0.0, 0.0
    D[1, 3] = D[3, 1] = 0.5
    light = replace(one, M=sparse.csr_array(M), D=sparse.csr_array(D))
    path = write_matrices(light, tmp_path / "a.bdf")
    same(read_matrices(path), light, 1e-9)
    heads = [line for line in path.read_text().splitlines() if line.startswith("DMIG*") and "MAAX" in line]
    named = {(int(line[24:40]), int(line[40:56])) for line in heads}
    assert named == {tuple(pair) for pair in DOFS.tolist()} - {tuple(DOFS[2].tolist())}


def test_one_file_may_bring_all_but_one_matrix_and_the_map_of_a_scalar_may_say_one(tmp_path):
    """The damping of a file of its own; SPOINT 700 with component 1 in a DMIG is the scalar 700."""
    one = replace(model(), geometric=None, frames=None, recovery=None, moments=None, groups={}, cells={})
    write_matrices(replace(one, D=None), tmp_path / "a.npz")
    other = 3.0 * one.D.toarray()
    np.savez(tmp_path / "d.npz", D=other, K=np.eye(7), M=np.eye(7))
    found = read_matrices(Sources(file="a.npz", damping="d.npz"), folder=tmp_path)
    same(found, replace(one, D=sparse.csr_array(other)))
    text = "GRID,5,,0.,0.,0.\nGRID,7,,1.,0.,0.\nSPOINT,700\n"
    for name, values in (("KAAX", (2.0, 3.0, 0.5)), ("MAAX", (4.0, 5.0, 0.25))):
        text += f"DMIG,{name},0,6,2,0\nDMIG,{name},5,1,,5,1,{values[0]}\n,700,1,{values[2]}\n"
        text += f"DMIG,{name},700,1,,700,1,{values[1]}\n"
    (tmp_path / "a.pch").write_text(text)
    found = read_matrices(tmp_path / "a.pch")
    assert found.dofs.tolist() == [[5, 1], [700, 0]] and found.n_modal == 1
    assert found.K.toarray() == pytest.approx(np.array([[2, 0.5], [0.5, 3]]))
    assert found.M.toarray() == pytest.approx(np.array([[4, 0.25], [0.25, 5]]))


@pytest.mark.parametrize(
    ("inertia", "sound"),
    [
        ((-0.005, 50.0, 50.0), True),  # of the trace 100, 1e-4 counts
        ((-0.02, 50.0, 50.0), False),
        ((-5e-7, 5e-3, 5e-3), True),
        ((-2e-6, 5e-3, 5e-3), False),
        ((20.0, 30.0, 50.008), True),
        ((20.0, 30.0, 50.02), False),
    ],
)
def test_principal_inertias_may_be_off_by_rounding_of_their_sum(inertia, sound):
    """One body at the origin, of inertias about its axes, and a spring to another without inertia at the same place."""
    dofs = np.array([[k, c] for k in (1, 2) for c in range(1, 7)])
    K = sparse.csr_array(np.kron([[1.0, -1.0], [-1.0, 1.0]], np.eye(6)))
    M = sparse.csr_array(np.diag([2.0, 2.0, 2.0, *inertia, 1.0, 1.0, 1.0, 0, 0, 0]))
    one = MatrixModel("m", np.array([1, 2]), np.zeros((2, 3)), dofs, M, K)
    report = check_model(one)
    text = ", ".join(f"{value:.6g}" for value in sorted(inertia))
    said = [t for t in report.warnings if "cannot be those of a body" in t]
    assert len(said) == (0 if sound else 1)
    assert sound or f"its principal inertias {text} kg m^2 about the centre of mass" in said[0]


def test_files_without_a_suffix_and_missing_ones_list_what_there_is(tmp_path):
    for k in range(9):
        (tmp_path / f"m{k}.npz").write_text("")
    names = [f"m{k}.npz" for k in range(8)]
    with pytest.raises(ValueError) as found:
        read_contents(tmp_path / "other.npz")
    assert str(found.value) == f"{tmp_path / 'other.npz'} does not exist; {tmp_path} holds {names}"
    with pytest.raises(ValueError) as found:
        read_contents(tmp_path / "other.mat")
    assert str(found.value) == f"{tmp_path / 'other.mat'} does not exist; {tmp_path} holds no such files"
    (tmp_path / "matrices").write_text("")
    with pytest.raises(
        ValueError, match=r"^matrices: no suffix is no known format of matrices; known are \.asm \(Nastra"
    ):
        read_contents(tmp_path / "matrices")
    with pytest.raises(
        ValueError, match=r"group 'far' has a node number above 9223372036854775807; give numbers of its"
    ):
        groups_from({"near": [3, 1, 3], "far": [2**64]})
    assert groups_from({"near": [3, 1, 3]})["near"].tolist() == [1, 3]


def test_nodes_of_abaqus_are_read_whatever_their_capitals_and_blanks(tmp_path):
    """Names of sets in a set are left out; a set without a name is called so; further values of a node are none."""
    text = "*Heading\n 5, 6\n*Node , Nset = Aft\n 9, 1., 2., 3., 7., 8.\n\n 4, .5,\n*nset,  NSET=mix\n 4, Aft\n 9\n"
    text += "*NSET\n4\n*Nset, nset=run, Generate\n 2, 8, 3\n*ELSET, ELSET=e\n1, 2\n"
    (tmp_path / "a.inp").write_bytes("** Träger\n".encode("latin-1") + text.encode())
    found = read_contents(tmp_path / "a.inp")
    assert found.ids.tolist() == [9, 4] and found.points.tolist() == [[1, 2, 3], [0.5, 0, 0]]
    sets = {name: nodes.tolist() for name, nodes in found.groups.items()}
    assert sets == {"Aft": [4, 9], "mix": [9], "set": [4], "run": [2, 5, 8]}


@pytest.mark.parametrize(
    ("text", "widths"),
    [("1,0,0,0\n2,0,0\n", [3, 4]), ("1 2 3 4 5\n", [5]), ("node, x\n# 1,2\n", [])],
)
def test_tables_of_other_widths_say_which(tmp_path, text, widths):
    (tmp_path / "a.csv").write_text(text)
    wanted = (
        f"a.csv has rows of {widths} values; a table of nodes has four (number, x, y, z), a map of degrees of freedom"
    )
    with pytest.raises(ValueError) as found:
        read_contents(tmp_path / "a.csv")
    assert wanted in str(found.value)


@pytest.mark.parametrize(
    ("text", "entries"),
    [
        ("2 2 2\n1 1 5.\n2 2 6.\n", [[5, 0], [0, 6]]),  # counts of rows, columns and entries first
        ("2 2 3\n1 1 5.\n2 2 6.\n", [[5, 0], [0, 9]]),  # one more is no count
        ("1 1 1\n1 1 5.\n", [[5]]),
        ("2 2 2\n1 1 5.\n3 3 6.\n", [[5, 0, 0], [0, 2, 0], [0, 0, 6]]),  # row 3 is beyond them
        ("1 2 2\n1 1 5.\n2 2 6.\n", [[5, 2], [2, 6]]),  # of a square matrix they are alike
        ("3 2 2\n1 1 5.\n2 2 6.\n", [[5, 0, 0], [0, 6, 2], [0, 2, 0]]),
    ],
)
def test_counts_are_reported_from_entries(tmp_path, text, entries):
    (tmp_path / "a.mtx").write_text(text)
    assert read_contents(tmp_path / "a.mtx").matrices["a"].matrix.toarray() == pytest.approx(np.array(entries, float))


def test_a_description_lists_errors_and_doubts_of_the_checks(tmp_path):
    one, *_ = bodies(np.random.default_rng(11))
    K = one.K.tolil()
    K[7, 7] += 777.0
    M = one.M.tolil()
    M[0, 3] += 2.0 * abs(one.M).max()
    path = write_matrices(replace(one, K=sparse.csr_array(K), M=sparse.csr_array(M)), tmp_path / "a.npz")
    lines = describe_matrices(path).splitlines()
    report = check_model(replace(one, K=sparse.csr_array(K), M=sparse.csr_array(M)))
    apart = 2.0 * abs(one.M).max() / abs(sparse.csr_array(M)).max()
    assert f"matrix  M: 18 x 18, {sparse.csr_array(M).nnz} entries, not symmetric by {apart:.1e}" in lines
    assert [line[8:] for line in lines if line.startswith("error   ")] == list(report.errors)
    assert [line[8:] for line in lines if line.startswith("doubt   ")] == list(report.warnings)
    assert any(f"|A - A^T| is {apart:.2g} of its largest entry (limit 1e-06)" in text for text in report.errors)
    assert any("resists the rigid motion y with 777 N/m" in text for text in report.warnings)


@pytest.mark.parametrize("form", ["npz", "triplets", "mat", "op4"])
def test_complex_matrices_are_refused_unless_their_imaginary_parts_are_zero(tmp_path, form):
    """Structural damping as K (1 + 0.02 i)."""
    K = np.kron([[3.0, -3.0], [-3.0, 3.0]], np.eye(3)).astype(complex)
    points = np.array([[0, 0, 0], [2.0, 0, 0]])

    def written(K: np.ndarray) -> Sources:
        arrays = {"M": np.eye(6), "points": points, "K": K}
        if form == "op4":
            pytest.importorskip("pyyeti.nastran.op4").write(str(tmp_path / "a.op4"), {"kgg": K, "mgg": np.eye(6)})
            (tmp_path / "nodes.csv").write_text("1,0,0,0\n2,2,0,0\n")
            return Sources("a.op4", nodes="nodes.csv")
        if form == "mat":
            savemat(tmp_path / "a.mat", arrays)
            return Sources("a.mat")
        if form == "triplets":
            i, j = np.nonzero(K)
            arrays |= {"K_row": i, "K_col": j, "K_data": arrays.pop("K")[i, j], "K_shape": [6, 6]}
        np.savez(tmp_path / "a.npz", **arrays)
        return Sources("a.npz")

    found = read_matrices(written(K), folder=tmp_path)
    assert found.K.toarray() == pytest.approx(K.real) and found.K.dtype == float
    name, suffix = ("KGG", "op4") if form == "op4" else ("K", "mat" if form == "mat" else "npz")
    with pytest.raises(ValueError) as error:
        read_matrices(written(K * (1 + 0.02j)), folder=tmp_path)
    assert str(error.value) == (
        f"a.{suffix}: the stiffness matrix {name} is complex (imaginary parts up to 0.06); femflex takes real matri"
        "ces. Write its real part, and give structural damping as damping in the case"
    )
