"""Files of matrices: written and read back, in other units, and as other programs write them."""

from __future__ import annotations

import importlib
from dataclasses import replace

import h5py
import numpy as np
import pytest
from scipy import sparse
from scipy.io import mmwrite

from femflex.body import MassMoments
from femflex.matrices import MatrixModel, Recovery, Sources, read_matrices, write_matrices

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


def assert_equal_models(actual: MatrixModel, expected: MatrixModel, tol: float = 1e-12) -> None:
    """Compare all arrays of a model with the expected ones."""
    order = np.array([np.flatnonzero((actual.dofs == pair).all(axis=1))[0] for pair in expected.dofs])
    assert len(actual.dofs) == len(expected.dofs)
    for name in ("M", "K", "D", "geometric"):
        a, b = getattr(actual, name), getattr(expected, name)
        assert (a is None) == (b is None), name
        if b is not None:
            a, b = a.toarray()[np.ix_(order, order)], b.toarray()
            assert a == pytest.approx(b, abs=tol * np.abs(b).max()), name
    nodes = [actual.ids.tolist().index(n) for n in expected.ids]
    assert actual.points[nodes] == pytest.approx(expected.points)
    if expected.frames is not None:
        assert actual.frames[nodes] == pytest.approx(expected.frames)
    assert {k: sorted(v) for k, v in actual.groups.items()} == {k: sorted(v) for k, v in expected.groups.items()}
    assert {k: v.tolist() for k, v in actual.cells.items()} == {k: v.tolist() for k, v in expected.cells.items()}
    if expected.recovery is not None:
        recovery, expected_recovery = actual.recovery, expected.recovery
        assert recovery.points == pytest.approx(expected_recovery.points) and recovery.masses == pytest.approx(
            expected_recovery.masses
        )
        assert recovery.rows.toarray()[:, order] == pytest.approx(expected_recovery.rows.toarray())
        assert actual.moments.mass == pytest.approx(expected.moments.mass)
        assert actual.moments.first == pytest.approx(expected.moments.first)
        assert actual.moments.second == pytest.approx(expected.moments.second)


def test_units_of_every_array(tmp_path):
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
    assert_equal_models(read_matrices(tmp_path / "a.npz", units="mm-kg-ms"), si)


@pytest.mark.parametrize("few", [False, True])
@pytest.mark.parametrize("suffix", [".npz", ".h5", ".hdf5", ".mat"])
def test_every_array_of_a_model_survives_a_file(tmp_path, suffix, few):
    matrix_model = model(few)
    assert_equal_models(read_matrices(write_matrices(matrix_model, tmp_path / f"a{suffix}")), matrix_model)


MOMENTS = {"moments_mass": 2.0, "moments_first": np.zeros((7, 3)), "moments_second": np.eye(21).reshape(7, 3, 7, 3)}


@pytest.mark.parametrize(
    ("arrays", "words"),
    [
        ({"cells_line": [[1, 99]]}, "cells 99"),
        ({"cells_line": [[1, 1.5]]}, "cells_line whole"),
        ({"frames": [2 * np.eye(3), np.eye(3)]}, "frames 1 rotation"),
        ({"frames": [np.eye(3), -np.eye(3)]}, "frames 2 right-handed"),
        ({"frames": [np.eye(3)]}, "frames shape"),
        ({"recovery_points": np.zeros((1, 3)), "recovery": np.eye(5)}, "recovery 5 3 6"),
        ({"recovery_points": np.zeros((1, 3)), "recovery": np.eye(3, 6), "recovery_masses": [-1.0]}, "negative"),
        ({"recovery_points": np.zeros((1, 3)), "recovery": np.full((3, 6), np.nan)}, "recovery finite"),
        (MOMENTS | {"moments_second": np.full((7, 3, 7, 3), np.nan)}, "moments finite"),
        (MOMENTS | {"moments_second": ["light"]}, "moments_second numbers"),
        ({"moments_mass": 2.0}, "moments_first missing"),
        ({"moments_mass": 2.0, "moments_first": np.zeros((7, 3))}, "moments_second missing 7"),
        ({"recovery": np.eye(3, 6)}, "recovery_points missing"),
        ({"recovery_points": np.zeros(3), "recovery": np.eye(3, 6)}, "recovery_points (3,) n 3"),
        ({"recovery_points": np.zeros((1, 3)), "recovery": np.zeros(18)}, "recovery (18,) n"),
        ({"cells_line": np.array([None])}, "cells_line numbers"),
        ({"D": np.ones(6)}, "'D' (6,) damping n"),
        ({"D": np.ones((6, 2))}, "'D' (6, 2) damping"),
        ({"D": np.eye(5)}, "damping 5 6 rows"),
        ({"D_row": [0, 7], "D_col": [0, 0], "D_data": [1.0, 1.0], "D_shape": [6, 6]}, "D_row 7 6"),
        (MOMENTS | {"moments_second": -MOMENTS["moments_second"]}, "moments distribution eigenvalue"),
    ],
)
def test_arrays_that_no_body_has_are_refused(arrays, words, tmp_path):
    points = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]]
    np.savez(tmp_path / "bar.npz", points=points, M=np.eye(6), K=np.eye(6), **arrays)
    with pytest.raises(ValueError) as caught:
        read_matrices(tmp_path / "bar.npz")
    assert all(word in str(caught.value) for word in ["bar.npz", *words.split()]), caught.value


def test_output4_keeps_recovery_and_moments(tmp_path):
    pytest.importorskip("pyyeti")
    matrix_model = replace(model(), frames=None, groups={}, cells={})
    assert_equal_models(read_matrices(write_matrices(matrix_model, tmp_path / "a.op4")), matrix_model)


def test_matlab_files_of_version_7_3(tmp_path):
    """Written column by column; a sparse matrix by its columns with the number of rows as an attribute."""
    matrix_model = replace(model(), geometric=None, frames=None, recovery=None, moments=None, groups={}, cells={})
    path = tmp_path / "a.mat"
    with h5py.File(path, "w", userblock_size=512) as file:
        for name, value in (
            ("points", POINTS),
            ("nodes", IDS[:, None]),
            ("dofs", DOFS),
            ("M", matrix_model.M.toarray()),
        ):
            file[name] = np.asarray(value).T
        upper = sparse.csc_array(matrix_model.K.toarray())
        group = file.create_group("K")
        group["data"], group["ir"], group["jc"] = upper.data, upper.indices, upper.indptr
        group.attrs["MATLAB_sparse"] = np.uint64(upper.shape[0])
        group = file.create_group("D")
        columns = sparse.csc_array(matrix_model.D.toarray())
        group["data"], group["ir"], group["jc"] = columns.data, columns.indices, columns.indptr
        group.attrs["MATLAB_sparse"] = np.uint64(7)
        file.create_group("struct")["x"] = [1.0]
    with open(path, "r+b") as file:
        file.write(b"MATLAB 7.3 MAT-file".ljust(128))
    assert_equal_models(read_matrices(path), matrix_model)


def test_bulk_data_survive_a_file(tmp_path):
    rng = np.random.default_rng(7)
    n = len(DOFS)
    M, K, D = (sparse.csr_array(symmetric(n, rng) * 10.0**p) for p in (-12, 11, 3))
    matrix_model = MatrixModel("m", IDS, POINTS, DOFS, M, K, D)
    path = write_matrices(matrix_model, tmp_path / "a.bdf")
    computed = read_matrices(path)
    assert_equal_models(computed, matrix_model, 1e-9)
    assert computed.n_modal == 2
    assert_equal_models(
        read_matrices(write_matrices(replace(matrix_model, D=None), path, force=True)),
        replace(matrix_model, D=None),
        1e-9,
    )


def test_maps_of_external_superelements(tmp_path):
    """EXTRN names the components of matrices that other files hold."""
    text = "GRID,5,,0.,0.,0.\nGRID,7,,1.,0.,0.\nSPOINT,90\nEXTRN,7,13,5,2,90,0\n"
    (tmp_path / "a.pch").write_text(text)
    np.savez(tmp_path / "b.npz", M=np.eye(4), K=2 * np.eye(4))
    matrix_model = read_matrices(Sources("b.npz", nodes="a.pch", dofs="a.pch"), folder=tmp_path)
    assert matrix_model.dofs.tolist() == [[7, 1], [7, 3], [5, 2], [90, 0]] and matrix_model.ids.tolist() == [5, 7]


@pytest.mark.parametrize("fault", ["", "beyond", "rows", "missing"])
def test_matrices_of_msc_hdf5_are_columns_of_one_table(tmp_path, fault):
    """The stiffness has both triangles, the mass its lower one; a rectangular matrix is between them."""
    matrix_model = model()
    K, M = (sparse.csc_array(A) for A in (matrix_model.K, sparse.tril(matrix_model.M)))
    names = ("FORM", "TYPE", "ROW", "COLUMN", "COLUMN_POS", "DATA_POS", "NON_ZERO", "DOMAIN_ID")
    identity, ends, entries = [], [], []
    for name, A in ((b"KGG", K), (b"GOA", K[:, :2]), (b"MGG", M)):
        identity.append((name, 6, 2, *A.shape, len(ends), len(entries), A.nnz, 1))
        ends += [(len(entries) + int(p),) for p in A.indptr]
        entries += list(zip(A.indices + 9 * (fault == "rows"), A.data, strict=True))
    with h5py.File(tmp_path / "msc.h5", "w") as file:
        group = file.create_group("NASTRAN/RESULT/MATRIX/GENERAL")
        group["IDENTITY"] = np.array(identity, [("NAME", "S8"), *((name, "i8") for name in names)])
        group["COLUMN"] = np.array(ends, [("POSITION", "i8")])
        if fault != "missing":
            entries = entries[:-1] if fault == "beyond" else entries
            group["DATA"] = np.array(entries, [("ROW", "i8"), ("VALUE", "f8")])
    table(tmp_path / "nodes.csv", matrix_model)
    np.savetxt(tmp_path / "map.csv", DOFS, fmt="%d", delimiter=",")
    sources = Sources("msc.h5", nodes="nodes.csv", dofs="map.csv")
    if fault:
        with pytest.raises(ValueError, match=r"has no ROW, VALUE|do not fit its|positions of columns"):
            read_matrices(sources, folder=tmp_path)
    else:
        computed = read_matrices(sources, folder=tmp_path)
        assert_equal_models(computed, MatrixModel("m", IDS, POINTS, DOFS, matrix_model.M, matrix_model.K))


def table(path, matrix_model: MatrixModel) -> None:
    rows = zip(matrix_model.ids.tolist(), matrix_model.points.tolist(), strict=True)
    lines = "".join(f"{n};\t{x[0]!r}; {x[1]!r}; {x[2]!r}\n" for n, x in rows)
    path.write_text(f"# a comment\nnumber; x; y; z\n{lines}")


@pytest.mark.parametrize("triangle", ["lower", "upper", "both"])
def test_matrices_by_node_and_component_share_one_map(tmp_path, triangle):
    """The mass has entries at fewer degrees of freedom than the stiffness, and each file another order."""
    matrix_model = model()
    physical = np.flatnonzero(DOFS[:, 1] > 0)
    M, K = (A.toarray()[np.ix_(physical, physical)].copy() for A in (matrix_model.M, matrix_model.K))
    M[1, :], M[:, 1] = 0.0, 0.0
    rng = np.random.default_rng(1)
    for name, A in (("m", M), ("k", K)):
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
    table(tmp_path / "nodes.csv", matrix_model)
    computed = read_matrices(Sources(mass="m.mtx", stiffness="k.mtx", nodes="nodes.csv"), folder=tmp_path)
    expected = MatrixModel("m", IDS, POINTS, DOFS[physical], sparse.csr_array(M), sparse.csr_array(K))
    assert_equal_models(computed, expected)


GRIDS = """$ two nodes of a rod, the second with cylindrical displacement axes about basic z at 90 degrees
CORD2C,7,0,0.,0.,0.,0.,0.,1.,+
+,1.,0.,0.
GRID,11,,1000.,0.,0.
GRID    12             7   1000.     90.      0.       7
"""
DMIG = """DMIG    MAAX           0       6       2       0
DMIG*   MAAX                          11               1
*                     11               1 2.000000000D-03
DMIG*   MAAX                          12               2
*                     12               2 3.000000000-03
DMIG    KAAX           0       6       2       0
DMIG    KAAX          11       1              11       1     5.0
+             12       2     4.0
DMIG    KAAX          12       2              12       2    50.0
ENDDATA
"""


def test_small_and_large_fields_units_and_displacement_axes(tmp_path):
    path = tmp_path / "rod.pch"
    path.write_text(GRIDS + DMIG)
    m = read_matrices(path, units="mm-t-s")
    assert m.dofs.tolist() == [[11, 1], [12, 2]]
    assert m.points == pytest.approx(np.array([[1.0, 0, 0], [0, 1.0, 0]]), abs=1e-12)
    assert m.M.toarray() == pytest.approx(np.diag([2.0, 3.0]))  # kg
    assert m.K.toarray() == pytest.approx(np.array([[5e3, 4e3], [4e3, 50e3]]))  # N/mm to N/m
    assert m.frames[1] == pytest.approx(np.array([[0, 1, 0], [-1, 0, 0], [0, 0, 1]]), abs=1e-12)
    moved = m.structure().translation.toarray()
    assert moved[3:, 1] == pytest.approx([-1, 0, 0], abs=1e-12)  # around the axis, at 90 degrees: -x


@pytest.fixture
def spring(tmp_path):
    """Two nodes with three translations each: files of coordinates and the matrices."""
    (tmp_path / "nodes.csv").write_text("node, x, y, z\n1, 0, 0, 0\n2, 1, 0, 0\n")
    M, K = np.diag([1.0, 1, 1, 2, 2, 2]), np.zeros((6, 6))
    K[np.ix_([0, 3], [0, 3])] = 7 * np.array([[1, -1], [-1, 1]])
    return tmp_path, M, K


def same_matrices(model: MatrixModel, M, K):
    assert model.M.toarray() == pytest.approx(M) and model.K.toarray() == pytest.approx(K)


def test_matrix_market_files(spring):
    folder, M, K = spring
    for name, A in (("m", M), ("k", K)):
        mmwrite(folder / f"{name}.mtx", sparse.coo_array(A), symmetry="symmetric")
    same_matrices(read_matrices(Sources(mass="m.mtx", stiffness="k.mtx", nodes="nodes.csv"), folder=folder), M, K)


@pytest.mark.parametrize("form", ["input", "coordinate"])
@pytest.mark.parametrize("triangle", [True, False])
def test_abaqus_matrix_generate(spring, form, triangle):
    folder, M, K = spring
    for name, A in (("job_MASS1", M), ("job_STIF1", K)):
        rows = [(i, j) for i, j in zip(*np.nonzero(A), strict=True) if not triangle or j <= i]
        if form == "coordinate":
            lines = [f"{i + 1} {j + 1} {A[i, j]:.16e}" for i, j in rows]
        else:
            lines = [f"{i // 3 + 1},{i % 3 + 1}, {j // 3 + 1},{j % 3 + 1},  {A[i, j]:.16e}" for i, j in rows]
        (folder / f"{name}.mtx").write_text("\n".join(lines) + "\n")
    sets = "*NSET, NSET=BACK, GENERATE\n2, 1, -1\n*NSET, NSET=ALL\nback\n"
    (folder / "job.inp").write_text(f"*HEADING\n*NODE, NSET=ENDS\n1, 0., 0., 0.\n2, 1., 0., 0.\n{sets}*ELEMENT\n")
    m = read_matrices(Sources(mass="job_MASS1.mtx", stiffness="job_STIF1.mtx", nodes="job.inp"), folder=folder)
    same_matrices(m, M, K)
    assert [m.groups[name].tolist() for name in ("ENDS", "BACK", "ALL")] == [[1, 2]] * 3


def test_calculix_matrices_with_their_map(spring):
    folder, M, K = spring
    for name, A in (("job.mas", M), ("job.sti", K)):
        rows = [f"{i + 1} {j + 1} {A[i, j]:.9e}" for i, j in zip(*np.nonzero(np.triu(A)), strict=True)]
        (folder / name).write_text("\n".join(rows) + "\n")
    (folder / "job.dof").write_text("".join(f"{i // 3 + 1}.{i % 3 + 1}\n" for i in range(6)))
    sources = Sources(mass="job.mas", stiffness="job.sti", nodes="nodes.csv", dofs="job.dof")
    same_matrices(read_matrices(sources, folder=folder), M, K)


def test_plain_arrays(spring):
    folder, M, K = spring
    np.savez(folder / "two.npz", mass=M, stiffness=K, xyz=[[0, 0, 0], [1, 0, 0]])
    m = read_matrices(folder / "two.npz", groups={"end": [2]})
    same_matrices(m, M, K)
    assert m.dofs[3].tolist() == [2, 1] and m.nodes_of("end").tolist() == [2]
    write_matrices(m, folder / "named.npz")  # stated groups replace those of the file
    again = read_matrices(folder / "named.npz", groups={"end": [1], "both": [1, 2]})
    assert again.nodes_of("end").tolist() == [1] and again.nodes_of("both").tolist() == [1, 2]
    assert read_matrices(folder / "named.npz", groups={"both": [1, 2]}).nodes_of("end").tolist() == [2]


def test_output4_of_another_program(spring):
    with np.printoptions():  # which pyYeti changes for the whole process
        op4 = importlib.import_module("pyyeti.nastran.op4") if importlib.util.find_spec("pyyeti") else None
    if op4 is None:
        pytest.skip("pyyeti is not installed")
    folder, M, K = spring
    op4.write(str(folder / "a.op4"), {"MAA": M, "KAA": K, "PHG": np.ones((6, 2))})
    same_matrices(read_matrices(Sources(file="a.op4", nodes="nodes.csv", dofs="xyz"), folder=folder), M, K)
    op4.write(str(folder / "b.op4"), {"MAA": M, "KAA": K}, binary=False)
    same_matrices(read_matrices(Sources(file="b.op4", nodes="nodes.csv"), folder=folder), M, K)


def test_internal_degrees_of_freedom_of_abaqus_are_scalars(spring):
    folder, M, K = spring
    for name, A in (("job_MASS1", M), ("job_STIF1", K)):
        pairs = zip(*np.nonzero(A), strict=True)
        rows = [f"{i // 3 + 1},{i % 3 + 1}, {j // 3 + 1},{j % 3 + 1}, {A[i, j]:.16e}" for i, j in pairs]
        rows += ["-1,2, -1,2, 5.", "1,1, -1,2, .5", "-1,2, 1,1, .5"]
        (folder / f"{name}.mtx").write_text("\n".join(rows) + "\n")
    m = read_matrices(Sources(mass="job_MASS1.mtx", stiffness="job_STIF1.mtx", nodes="nodes.csv"), folder=folder)
    assert m.M.shape == (7, 7) and m.dofs[-1, 1] == 0 and m.dofs[-1, 0] not in (1, 2)
    assert m.K.toarray()[6, 6] == 5.0 and m.K.toarray()[0, 6] == m.K.toarray()[6, 0] == 0.5
