"""Matrices in other units, forms and orders: every array against the model that it was written from."""

from __future__ import annotations

from dataclasses import replace

import h5py
import numpy as np
import pytest
from scipy import sparse
from support.matrix_examples import SOFT, boom

from femflex.body import MassMoments
from femflex.fem import Member, build_structure
from femflex.matrices import (
    MatrixModel,
    Recovery,
    Sources,
    StatedMass,
    check_model,
    craig_bampton_model,
    full_model,
    matrix_body,
    read_matrices,
    write_matrices,
)
from femflex.matrices.body import all_modes, without_rounding
from femflex.matrices.contents import read_contents
from femflex.matrices.coordinates import Contents
from femflex.matrices.describe import describe_matrices
from femflex.mesh.generators import rectangle
from femflex.reduction import cantilever_modes, craig_bampton, free_free_modes, reduce_structure

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
    second = rng.standard_normal((1 + n, 3, 1 + n, 3))
    return MatrixModel(
        "m", IDS, POINTS, DOFS, M, K, D, G, frames=frames,
        recovery=Recovery(rng.standard_normal((2, 3)), rows, np.array([0.3, 0.4])),
        moments=MassMoments(2.5, rng.standard_normal((1 + n, 3)), second + second.transpose(2, 3, 0, 1)), groups=GROUPS,
        cells={"line": np.array([[5, 12], [12, 40]])},
    )  # fmt: skip


def same(found: MatrixModel, wanted: MatrixModel, tol: float = 1e-12) -> None:
    """All of a model."""
    order = np.array([np.flatnonzero((found.dofs == pair).all(axis=1))[0] for pair in wanted.dofs])
    assert len(found.dofs) == len(wanted.dofs)
    for name in ("M", "K", "D", "geometric"):
        a, b = getattr(found, name), getattr(wanted, name)
        assert (a is None) == (b is None), name
        if b is not None:
            a, b = a.toarray()[np.ix_(order, order)], b.toarray()
            assert a == pytest.approx(b, abs=tol * np.abs(b).max()), name
    nodes = [found.ids.tolist().index(n) for n in wanted.ids]
    assert found.points[nodes] == pytest.approx(wanted.points)
    if wanted.frames is not None:
        assert found.frames[nodes] == pytest.approx(wanted.frames)
    assert {k: sorted(v) for k, v in found.groups.items()} == {k: sorted(v) for k, v in wanted.groups.items()}
    assert {k: v.tolist() for k, v in found.cells.items()} == {k: v.tolist() for k, v in wanted.cells.items()}
    if wanted.recovery is not None:
        one, other = found.recovery, wanted.recovery
        assert one.points == pytest.approx(other.points) and one.masses == pytest.approx(other.masses)
        assert one.rows.toarray()[:, order] == pytest.approx(other.rows.toarray())
        assert found.moments.mass == pytest.approx(wanted.moments.mass)
        assert found.moments.first == pytest.approx(wanted.moments.first)
        assert found.moments.second == pytest.approx(wanted.moments.second)


def test_a_model_in_millimetres_and_milliseconds_is_that_in_si(tmp_path):
    """Numbers as they are for u / mm, rad and modal coordinates of no unit, energies in kg mm^2 / ms^2."""
    length, mass, time = 1e-3, 1.0, 1e-3
    si = model()
    s = np.where((DOFS[:, 1] > 0) & (DOFS[:, 1] < 4), length, 1.0)  # what one unit of a coordinate is
    arrays = {"nodes": IDS, "points": POINTS / length, "dofs": DOFS, "frames": si.frames, "group_ends": GROUPS["ends"],
              "cells_line": si.cells["line"]}  # fmt: skip
    for name, power in (("M", 0), ("K", 2), ("D", 1), ("geometric", 2)):
        arrays[name] = getattr(si, name).toarray() * np.outer(s, s) / (mass * length**2 / time**power)
    arrays["recovery_points"], arrays["recovery_masses"] = si.recovery.points / length, si.recovery.masses / mass
    arrays["recovery"] = si.recovery.rows.toarray() * s / length
    z = np.concatenate([[1.0], s]) / length  # position; displacement per unit of a coordinate
    arrays["moments_mass"] = si.moments.mass / mass
    arrays["moments_first"] = si.moments.first * z[:, None] / mass
    arrays["moments_second"] = si.moments.second * z[:, None, None, None] * z[None, None, :, None] / mass
    np.savez(tmp_path / "a.npz", **arrays)
    same(read_matrices(tmp_path / "a.npz", units="mm-kg-ms"), si)


@pytest.mark.parametrize("few", [False, True])
@pytest.mark.parametrize("suffix", [".npz", ".h5", ".hdf5", ".mat"])
def test_everything_of_a_model_is_written_and_read(tmp_path, suffix, few):
    one = model(few)
    same(read_matrices(write_matrices(one, tmp_path / f"a{suffix}")), one)


def test_a_model_in_output4_keeps_recovery_and_moments(tmp_path):
    pytest.importorskip("pyyeti")
    one = replace(model(), frames=None, groups={}, cells={})
    same(read_matrices(write_matrices(one, tmp_path / "a.op4")), one)


@pytest.mark.parametrize(("points", "nodes"), [("xyz", "ids"), ("coords", "node_ids"), ("coordinates", "nodes")])
def test_arrays_have_several_names_and_single_numbers_are_no_matrix(tmp_path, points, nodes):
    one = model()
    arrays = {points: POINTS, nodes: IDS, "dofs": DOFS, "MAAX": one.M.toarray(), "Stiff": one.K.toarray(), "g": 9.8,
              "one": [[1.0]], "row": np.ones((1, 7)), "names": np.array([["a", "b"], ["c", "d"]])}  # fmt: skip
    np.savez(tmp_path / "a.npz", **arrays)
    found = read_matrices(tmp_path / "a.npz")
    same(found, replace(one, D=None, geometric=None, frames=None, recovery=None, moments=None, groups={}, cells={}))
    assert found.names == {"mass": "MAAX", "stiffness": "Stiff"}
    assert sorted(read_contents(tmp_path / "a.npz").matrices) == ["MAAX", "Stiff"]


def test_matlab_files_of_version_7_3_are_transposed_and_may_be_sparse(tmp_path):
    """Written column by column; a sparse matrix by its columns with the number of rows as an attribute."""
    one = replace(model(), geometric=None, frames=None, recovery=None, moments=None, groups={}, cells={})
    path = tmp_path / "a.mat"
    with h5py.File(path, "w", userblock_size=512) as file:
        for name, value in (("points", POINTS), ("nodes", IDS[:, None]), ("dofs", DOFS), ("M", one.M.toarray())):
            file[name] = np.asarray(value).T
        upper = sparse.csc_array(np.triu(one.K.toarray()) + np.tril(one.K.toarray(), -1))
        group = file.create_group("K")
        group["data"], group["ir"], group["jc"] = upper.data, upper.indices, upper.indptr
        group.attrs["MATLAB_sparse"] = np.uint64(upper.shape[0])
        skew = sparse.csc_array(np.triu(one.D.toarray()))
        for name, columns in (("D", sparse.csc_array(one.D.toarray())), ("upper", skew)):
            group = file.create_group(name)
            group["data"], group["ir"], group["jc"] = columns.data, columns.indices, columns.indptr
            group.attrs["MATLAB_sparse"] = np.uint64(7)
        file.create_group("struct")["x"] = [1.0]
    with open(path, "r+b") as file:
        file.write(b"MATLAB 7.3 MAT-file".ljust(128))
    same(read_matrices(path), one)
    assert read_contents(path).matrices["upper"].matrix.toarray() == pytest.approx(np.triu(one.D.toarray()))


def test_a_file_of_another_kind_is_refused_by_its_name(tmp_path):
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file.attrs["format"] = "femflex body"
    with pytest.raises(ValueError, match="it is a femflex body file; give it to a body of kind 'file', not 'matrices'"):
        read_matrices(tmp_path / "a.h5")


# Bulk data


def test_bulk_data_hold_damping_scalar_points_and_twelve_digits(tmp_path):
    rng = np.random.default_rng(7)
    n = len(DOFS)
    M, K, D = (sparse.csr_array(symmetric(n, rng) * 10.0**p) for p in (-12, 11, 3))
    one = MatrixModel("m", IDS, POINTS, DOFS, M, K, D)
    path = write_matrices(one, tmp_path / "a.bdf")
    found = read_matrices(path)
    same(found, one, 1e-9)
    assert found.names == {"mass": "MAAX", "stiffness": "KAAX", "damping": "BAAX"} and found.n_modal == 2
    assert {len(line) for line in path.read_text().splitlines() if line.startswith("*")} <= {24, 56}
    with pytest.raises(ValueError, match="m has nodes with axes of their own, which are not written to bulk data"):
        write_matrices(model(), tmp_path / "b.bdf")
    assert not (tmp_path / "b.bdf").exists()
    with pytest.raises(FileExistsError):
        write_matrices(one, path)
    same(read_matrices(write_matrices(replace(one, D=None), path, force=True)), replace(one, D=None), 1e-9)


def test_maps_of_external_superelements_and_matrices_that_are_not_used(tmp_path):
    """EXTRN names the components of OP4 matrices; a rectangular DMIG is noted, an unsymmetric one not mirrored."""
    text = "GRID,5,,0.,0.,0.\nGRID,7,,1.,0.,0.\nSPOINT,90\nEXTRN,7,13,5,2,90,0\n"
    text += "DMIG,KAAX,0,1,2,0\nDMIG,KAAX,5,2,,7,1,3.\n,7,3,4.-1\nDMIG,PAX,0,9,1,0,,,1\nDMIG,PAX,1,0,,5,2,3.\n"
    (tmp_path / "a.pch").write_text(text)
    found = read_contents(tmp_path / "a.pch")
    assert found.dofs.tolist() == [[7, 1], [7, 3], [5, 2], [90, 0]] and found.scalars == {90}
    K = found.matrices["KAAX"]
    assert K.dofs.tolist() == [[5, 2], [7, 1], [7, 3]]
    assert K.matrix.toarray() == pytest.approx(np.array([[0, 0, 0], [3.0, 0, 0], [0.4, 0, 0]]))
    assert list(found.matrices) == ["KAAX"] and found.notes == ["DMIG PAX is rectangular (form 9), and is not used"]
    np.savez(tmp_path / "b.npz", M=np.eye(4), K=2 * np.eye(4))
    one = read_matrices(Sources("b.npz", nodes="a.pch", dofs="a.pch"), folder=tmp_path)
    assert one.dofs.tolist() == found.dofs.tolist() and one.ids.tolist() == [5, 7]


@pytest.mark.parametrize(("text",
 "value"), [("1.5-3", 1.5e-3), ("-1.5+3", -1.5e3), ("1.5D-3", 1.5e-3), ("-2.E+1", -20.0),
                                             ("1.5d2", 150.0), ("7.", 7.0)])  # fmt: skip
def test_entries_of_bulk_data_may_leave_out_the_letter_of_their_exponent(tmp_path, text, value):
    (tmp_path / "a.pch").write_text(f"DMIG,KAAX,0,6,2,0\nDMIG,KAAX,5,2,,5,2,{text}\n")
    assert read_contents(tmp_path / "a.pch").matrices["KAAX"].matrix.toarray() == pytest.approx(np.array([[value]]))


# Files of their own


def table(path, one: MatrixModel) -> None:
    path.write_text("# a comment\nnumber; x; y; z\n" + "".join(
        f"{n};\t{x[0]!r}; {x[1]!r}; {x[2]!r}\n" for n, x in zip(one.ids.tolist(), one.points.tolist(), strict=True)
    ))  # fmt: skip


@pytest.mark.parametrize("triangle", ["lower", "upper", "both"])
def test_matrices_by_node_and_component_are_put_on_one_map(tmp_path, triangle):
    """The mass has entries at fewer degrees of freedom than the stiffness, and each file another order."""
    one = model()
    physical = np.flatnonzero(DOFS[:, 1] > 0)
    M, K = (A.toarray()[np.ix_(physical, physical)].copy() for A in (one.M, one.K))
    M[1, :], M[:, 1] = 0.0, 0.0
    rng = np.random.default_rng(1)
    for name, A in (("m", M), ("k", K)):
        keep = {"lower": np.tril(A), "upper": np.triu(A), "both": A}[triangle]
        # the map sorts nodes and components: a triangle is one of that order
        order = np.lexsort((DOFS[physical, 1], DOFS[physical, 0]))
        S = A[np.ix_(order, order)]
        keep = {"lower": np.tril(S), "upper": np.triu(S), "both": S}[triangle]
        pairs = list(zip(*np.nonzero(keep), strict=True))
        rng.shuffle(pairs)
        at = DOFS[physical][order]
        lines = [f"{at[i][0]},{at[i][1]}, {at[j][0]},{at[j][1]}, {keep[i, j]!r}".replace("np.float64(",
         "").replace(")", "")
                 for i, j in pairs]  # fmt: skip
        (tmp_path / f"{name}.mtx").write_text("\n".join(lines) + "\n")
    table(tmp_path / "nodes.csv", one)
    found = read_matrices(Sources(mass="m.mtx", stiffness="k.mtx", nodes="nodes.csv"), folder=tmp_path)
    wanted = MatrixModel("m", IDS, POINTS, DOFS[physical], sparse.csr_array(M), sparse.csr_array(K))
    same(found, wanted)


def test_a_matrix_whose_last_rows_are_empty_is_filled_up(tmp_path):
    (tmp_path / "k.mtx").write_text("".join(f"{k} {k} {k}.0\n" for k in range(1, 7)))
    (tmp_path / "m.mtx").write_text("1 1 2.0\n2 2 3.0\n4 2 0.5\n")
    (tmp_path / "nodes.csv").write_text("3 0 0 0\n9 1 0 0\n")
    found = read_matrices(Sources(mass="m.mtx", stiffness="k.mtx", nodes="nodes.csv"), folder=tmp_path)
    M = np.diag([2.0, 3, 0, 0, 0, 0])
    M[3, 1] = M[1, 3] = 0.5
    assert found.M.toarray() == pytest.approx(M) and found.K.toarray() == pytest.approx(np.diag([1.0, 2, 3, 4, 5, 6]))
    assert found.dofs.tolist() == [[3, 1], [3, 2], [3, 3], [9, 1], [9, 2], [9, 3]]
    six = read_matrices(
        Sources(mass="k.mtx", stiffness="k.mtx", nodes="one.csv", dofs="xyzrxryrz"), folder=_one(tmp_path)
    )
    assert six.dofs.tolist() == [[3, c] for c in range(1, 7)]


def _one(folder):
    (folder / "one.csv").write_text("3,0,0,0\n")
    return folder


def test_nodes_and_sets_of_an_abaqus_file(tmp_path):
    """Coordinates that are left out are zero; sets by lists, by ranges and of *NODE blocks."""
    text = "** a comment\n*NODE, NSET=A\n1, 0.5\n2, 1., 2.\n*NODE\n7, 1., 2., 3.\n*NSET, NSET=B, GENERATE\n1, 9, 2\n"
    text += "*NSET, NSET=C\n7, 2,\n1\n*NSET, NSET=B\n2\n*ELEMENT\n1, 1, 2\n*NSET, NSET=D, GENERATE\n3, 5\n"
    (tmp_path / "a.inp").write_text(text)
    found = read_contents(tmp_path / "a.inp")
    assert found.ids.tolist() == [1, 2, 7] and found.points.tolist() == [[0.5, 0, 0], [1, 2, 0], [1, 2, 3]]
    sets = {name: nodes.tolist() for name, nodes in found.groups.items()}
    assert sets == {"A": [1, 2], "B": [1, 2, 3, 5, 7, 9], "C": [1, 2, 7], "D": [3, 4, 5]}
    (tmp_path / "map.txt").write_text("node component\n7 1\n7,6\n2;3\n")
    assert read_contents(tmp_path / "map.txt").dofs.tolist() == [[7, 1], [7, 6], [2, 3]]
    assert isinstance(found, Contents)


@pytest.mark.parametrize(
    ("files", "sources", "sentence"),
    [
        ({}, {"file": "a.npz", "names": {"weight": "M"}}, r"names has \['weight'\]; the matrices are mass, stiffness"),
        ({"b.csv": "1,0,0,0\n"}, {"file": "a.npz",
         "dofs": "b.csv"}, r"b.csv has no map of degrees of freedom; give rows"),
        ({"b.mtx": "5,2, 5,2, 1.\n"}, {"file": "a.npz",
         "damping": "b.mtx"}, r"the mass matrix has no map of degrees of"),
        ({"b.csv": "1,2\n1,3\n"}, {"file": "a.npz", "dofs": "b.csv"},
         r"the mass matrix is 7 x 7, and the map of degrees of freedom has 2 rows \(3 nodes\); give a map"),
        ({"b.mtx": "0 1 2.\n"}, {"file": "a.npz",
         "mass": "b.mtx"}, r"row or column number below 1; rows and columns count"),
        ({"b.npz": None}, {"file": "a.npz",
         "mass": "b.npz"}, r"b.npz has the matrices \['A', 'B'\]; say which is the mass"),
        ({}, {"file": "c.npz"}, r"c.npz does not exist; .* holds \['a.npz'\]"),
    ],
)  # fmt: skip
def test_sources_that_do_not_fit_are_named(tmp_path, files, sources, sentence):
    write_matrices(replace(model(), recovery=None, moments=None), tmp_path / "a.npz")
    for name, text in files.items():
        if text is None:
            np.savez(tmp_path / name, A=np.eye(7), B=np.eye(7))
        else:
            (tmp_path / name).write_text(text)
    with pytest.raises(ValueError, match=sentence):
        read_matrices(Sources(**sources), folder=tmp_path)


def test_numbers_of_nodes_and_places_must_be_as_many(tmp_path):
    np.savez(tmp_path / "a.npz", M=np.eye(6), K=np.eye(6), points=np.eye(3)[:2], nodes=[1, 2, 3])
    with pytest.raises(ValueError, match=r"a\.npz has 3 node numbers and 2 places; give one of each"):
        read_matrices(tmp_path / "a.npz")


# The model


def test_groups_nodes_and_spins_of_a_model():
    one = model()
    assert one.loaded.tolist() == [5, 12, 40] and one.nodes_of("all").tolist() == [5, 12, 40]
    assert one.nodes_of("node_40").tolist() == [40] and one.n_modal == 2 and one.reduced and one.n_dof == 7
    with pytest.raises(
        ValueError, match=r"group 'node_77' of m names nodes without coordinates, such as \[77\]; the model"
    ):
        one.structure(["node_77"])
    spun = one.spinning(2.0, [0, 0, 3.0])
    assert spun.geometric.toarray() == pytest.approx(one.geometric.toarray() / 4)
    assert spun.spin_axis.tolist() == [0, 0, 3.0]
    still, turning = one.structure(), spun.structure()
    assert turning.K0.toarray() == pytest.approx(one.K.toarray())
    assert still.K0.toarray() == pytest.approx((one.K + one.geometric).toarray())
    with pytest.raises(ValueError, match=r"m has the rate 0 rad/s; a spin needs"):
        one.spinning(0.0, [0, 0, 1.0])


def test_components_of_nodes_move_along_their_own_axes():
    one = model()
    s = one.structure(["ends"])
    row = {n: k for k, n in enumerate(IDS.tolist())}
    for k, (node, c) in enumerate(DOFS):
        moved, turned = (np.zeros((3, 3)) for _ in range(2))
        if c:
            (moved if c < 4 else turned)[row[node]] = one.frames[row[node]][(c - 1) % 3]
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
    one = MatrixModel("three", ids, x, dofs, sparse.csr_array(M), sparse.csr_array(K))
    return one, m, at, np.array(J), x


def test_mass_properties_are_those_of_three_rigid_bodies():
    one, m, at, J, _ = bodies(np.random.default_rng(11))
    report = check_model(one)
    centre = m @ at / m.sum()
    r = at - centre
    total = sum(J[k] + m[k] * (r[k] @ r[k] * np.eye(3) - np.outer(r[k], r[k])) for k in range(3))
    assert report.mass == pytest.approx(m.sum()) and report.center_of_mass == pytest.approx(centre)
    assert report.inertia == pytest.approx(total) and not report.findings and report.massless == 0
    assert report.rigid.max() < 1e-12
    stated = StatedMass(m.sum() * 1.02, centre + np.array([0.0, 0.0, 0.3]), total * 1.05)
    texts = check_model(one, stated).warnings
    assert f"its mass is {m.sum():.6g} kg, and {m.sum() * 1.02:.6g} kg is stated (limit 1% apart)" in texts[0]
    radius = np.sqrt(np.trace(total) / (2 * m.sum()))
    assert f"m, 0.3 m from that stated (limit {0.01 * radius:.4g} m)" in texts[1]
    worst = 0.05 * np.abs(total).max()
    assert f"by up to {worst:.6g} kg m^2 (limit {0.01 * 1.05 * np.abs(total).max():.4g})" in texts[2]
    assert not check_model(one, StatedMass(m.sum() * 1.009, centre + 0.005 * radius, total * 1.009)).findings


@pytest.mark.parametrize(("motion", "unit"), [(1, "N/m"), (4, "N m/rad")])
def test_a_spring_to_the_ground_is_reported_with_its_stiffness_and_its_node(motion, unit):
    """At the node 8, along y or about y; rotations count about the centre of mass."""
    one, m, at, _, x = bodies(np.random.default_rng(11))
    row = 6 + motion
    K = one.K.tolil()
    K[row, row] += 777.0
    texts = check_model(replace(one, K=sparse.csr_array(K))).warnings
    name = ("x", "y", "z", "rx", "ry", "rz")[motion]
    text = next(t for t in texts if f"resists the rigid motion {name} " in t)
    assert f"with 777 {unit}" in text and f"most at node 8, {name}" in text
    if motion == 1:  # a turn about x through the centre moves the spring
        arm = (x[1] - m @ at / m.sum())[2]
        about = next(t for t in texts if "rigid motion rx " in t)
        assert f"with {777 * arm**2:.4g} N m/rad" in about


def test_coupling_of_modal_coordinates_and_massless_rows_are_counted():
    one, *_ = bodies(np.random.default_rng(11))
    n = one.n_dof
    M, K = np.zeros((n + 2, n + 2)), np.zeros((n + 2, n + 2))
    M[:n, :n], K[:n, :n] = one.M.toarray(), one.K.toarray()
    M[n, n], K[n, n], K[n + 1, n + 1] = 1.0, 400.0, 900.0
    K[4, n + 1] = K[n + 1, 4] = 0.01 * np.sqrt(K[4, 4] * 900.0)
    K[5, n] = K[n, 5] = 0.002 * np.sqrt(K[5, 5] * 400.0)
    dofs = np.vstack([one.dofs, [[901, 0], [902, 0]]])
    report = check_model(replace(one, M=sparse.csr_array(M), K=sparse.csr_array(K), dofs=dofs))
    assert report.massless == 1
    assert any(
        "couples boundary and modal coordinates by 1.0e-02 of their own (limit 1e-06)" in t for t in report.warnings
    )


def test_zero_and_weightless_matrices_are_errors():
    one, *_ = bodies(np.random.default_rng(11))
    zero = sparse.csr_array(one.M.shape)
    assert check_model(replace(one, M=zero)).errors == ("its mass matrix is zero; was another matrix meant?",)
    assert check_model(replace(one, K=zero)).errors == ("its stiffness matrix is zero; was another matrix meant?",)
    A = one.K.tolil()
    A[2, 7] = np.inf
    A[3, 7] = np.nan
    assert check_model(replace(one, D=sparse.csr_array(A))).errors == (
        "its damping matrix has 2 entries that are not finite",
    )
    M = one.M.tolil()
    for k in (0, 1, 2, 6, 7, 8, 12, 13, 14):
        M[k, :], M[:, k] = 0.0, 0.0
    (text,) = (t for t in check_model(replace(one, M=sparse.csr_array(M))).errors if "translation" in t)
    assert text.startswith("its mass in rigid translation is 0 kg (limit 0)")
    D = one.K.tolil()
    D[3, 10] += 5.0
    texts = check_model(replace(one, D=sparse.csr_array(D))).errors
    assert f"its damping matrix is not symmetric: |A - A^T| is {5.0 / abs(sparse.csr_array(D)).max():.2g}" in texts[0]


# Bodies


def test_all_modes_count_the_coordinates_with_mass_beside_the_reference():
    one, *_ = bodies(np.random.default_rng(11))
    M = one.M.tolil()
    for k in (9, 10, 11):
        M[k, :], M[:, k] = 0.0, 0.0
    M[6:9, 6:9] = 2.0 * np.eye(3)
    light = replace(one, M=sparse.csr_array(M), groups={"root": np.array([3])})
    modes = all_modes(light.structure(), "root")
    assert len(modes.omega) == 9
    K, M = light.K.toarray()[6:, 6:], light.M.toarray()[6:, 6:]
    values = np.linalg.eigvals(np.linalg.solve(K, M)).real
    assert np.sort(modes.omega) == pytest.approx(np.sort(1 / np.sqrt(np.sort(values)[-9:])), rel=1e-6)


def test_rounding_is_taken_out_and_a_spring_to_the_ground_is_not():
    s = full_model(boom(3)).structure()
    rough = s.K.toarray()
    rng = np.random.default_rng(2)
    E = rng.standard_normal(rough.shape)
    d = np.sqrt(np.diag(rough))
    rough = rough + 1e-9 * (E + E.T) * np.outer(d, d)
    given = replace(s, K0=sparse.csr_array(rough))
    made = without_rounding(given)
    from femflex.reduction.boundary.rigid import rigid_shapes

    R = rigid_shapes(given)
    assert np.abs(made.K @ R).max() < 1e-3 * np.abs(given.K @ R).max()
    assert made.K.toarray() == pytest.approx(s.K.toarray(), abs=1e-6 * rough.max())
    held = s.K.toarray()
    held[7, 7] *= 1.1
    grounded = replace(s, K0=sparse.csr_array(held))
    assert without_rounding(grounded) is grounded


def test_drawn_points_of_a_craig_bampton_model_follow_rigid_motions_of_its_interfaces():
    s = boom()
    body = reduce_structure(s, craig_bampton(s, ["root", "tip"], 3))
    one = craig_bampton_model(body, ["tip", "root"], "boom")
    assert one.groups["tip"].tolist() == [1] and one.groups["root"].tolist() == [2]
    assert one.points[1] == pytest.approx([0.1, 0.2, 0.0])
    t, w = np.array([0.3, -0.2, 0.5]), np.array([0.1, 0.4, -0.6])
    u = np.zeros(one.n_dof)
    for k, x in enumerate(one.points):
        u[6 * k : 6 * k + 3], u[6 * k + 3 : 6 * k + 6] = t + np.cross(w, x), w
    moved = (one.recovery.rows @ u).reshape(-1, 3)
    assert moved == pytest.approx(t + np.cross(w, one.recovery.points), abs=1e-9)
    assert one.K @ u == pytest.approx(0.0, abs=1e-6 * abs(one.K).max())
    n = len(one.dofs)
    q = np.concatenate([[0.0], u])
    second = np.einsum("k,kalb,l->ab", q, one.moments.second, q)
    # int (t + w x r)(t + w x r)^T dm by the body's own moments
    m, first, P = body.moments.mass, body.moments.first[0], body.moments.second[0, :, 0]
    W = np.array([[0, -w[2], w[1]], [w[2], 0, -w[0]], [-w[1], w[0], 0]])
    wanted = m * np.outer(t, t) + np.outer(t, W @ first) + np.outer(W @ first, t) + W @ P @ W.T
    assert second == pytest.approx(wanted, rel=1e-8) and len(q) == n + 1
    assert q @ one.moments.first == pytest.approx(m * t + W @ first, rel=1e-8)


def test_the_estimate_of_foreshortening_is_that_of_the_lowest_shape():
    """A skew cantilever: its tip draws in by int w'^2 ds along the axis over the stiffness of its lowest shape."""
    s = boom(16, tip=False)
    made = matrix_body(
        full_model(s), lambda one: cantilever_modes(one, "root", 3), markers={"tip": "tip"}, turning=()
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


def test_full_models_of_plates_have_scalars_for_what_no_node_has():
    s = build_structure(rectangle(1.0, 0.5, 2, 1, "triangle"), [Member("surface", "plate", 0.02, SOFT)])
    one = full_model(s, "plate")
    assert one.n_dof == s.n_dof and one.n_modal > 0 and len(set(map(tuple, one.dofs.tolist()))) == one.n_dof
    assert min(one.dofs[one.dofs[:, 1] == 0, 0]) > len(s.mesh.points)
    assert (one.cells["triangle"] - 1).tolist() == s.mesh.cells["triangle"].tolist()
    for name in s.mesh.groups:
        assert (np.sort(one.groups[name]) - 1).tolist() == np.sort(s.mesh.group_points(name)).tolist()
    for k, (node, c) in enumerate(one.dofs):
        if c:
            part = s.translation if c < 4 else s.rotation
            assert part.toarray()[3 * (node - 1) + (c - 1) % 3, k] == pytest.approx(1.0)
    exact = free_free_modes(s, 2).omega
    assert free_free_modes(one.structure(), 2).omega == pytest.approx(exact, rel=1e-6)


def test_what_a_file_holds_is_described_with_its_numbers(tmp_path):
    one, m, at, _, x = bodies(np.random.default_rng(11))
    path = write_matrices(replace(one, groups={"ends": np.array([3, 5])}), tmp_path / "a.npz")
    text = describe_matrices(path)
    low, high = (", ".join(f"{v:.6g}" for v in row) for row in (x.min(axis=0), x.max(axis=0)))
    centre = ", ".join(f"{v:.6g}" for v in m @ at / m.sum())
    for line in (
        "a.npz: matrices", f"matrix  M: 18 x 18, {one.M.nnz} entries, symmetric",
        f"nodes   3, from ({low}) to ({high})",
        "dofs    18 in its map", "group   ends: 2 nodes", f"mass {m.sum():.6g}, centre of mass ({centre})",
        "degrees of freedom: 18 of 3 nodes, 0 modal, 0 without mass",
    ):  # fmt: skip
        assert line in text, line
    (tmp_path / "b.pch").write_text("GRID,1,,0.,0.,0.\nSPOINT,7,8\nDMIG,KAAX,0,1,2,0\nDMIG,KAAX,1,1,,7,0,3.\n,8,0,1.\n")
    text = describe_matrices(tmp_path / "b.pch")
    assert "matrix  KAAX: 3 x 3, 2 entries, not symmetric by 1.0e+00, 3 nodes" in text
    assert "scalar  2 points (modal coordinates)" in text and "alone   gives no mass matrix" in text


@pytest.mark.parametrize("nodes", [None, "map.npz"])
def test_coordinates_are_those_of_any_file_where_the_file_of_nodes_has_none(tmp_path, nodes):
    np.savez(tmp_path / "mass.npz", M=2.0 * np.eye(6))
    np.savez(tmp_path / "stiffness.npz", K=np.eye(6), points=POINTS[:2], nodes=IDS[:2])
    np.savez(tmp_path / "map.npz", dofs=[[node, k] for node in IDS[:2] for k in (1, 2, 3)])
    found = read_matrices(Sources(mass="mass.npz", stiffness="stiffness.npz", nodes=nodes), folder=tmp_path)
    assert found.ids.tolist() == IDS[:2].tolist() and found.points.tolist() == POINTS[:2].tolist()
    with pytest.raises(
        ValueError, match=r"^mass\.npz has no coordinates of nodes; give the file that has them: nodes = "
    ):
        read_matrices(Sources(mass="mass.npz", stiffness="mass.npz", names={"stiffness": "M"}), folder=tmp_path)
