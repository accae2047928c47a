"""Files of matrices: written and read back, and small ones written here as other programs write them."""

from __future__ import annotations

import builtins
import importlib

import numpy as np
import pytest
from scipy import sparse
from scipy.io import mmwrite
from support.matrix_examples import SOFT, boom, brick

from femflex.fem import Member, Rigid, build_structure
from femflex.fem.sections import Tube
from femflex.matrices import (
    MatrixModel,
    Sources,
    check_model,
    craig_bampton_model,
    full_model,
    matrix_body,
    read_matrices,
    write_matrices,
)
from femflex.mesh import line
from femflex.reduction import cantilever_modes, craig_bampton, reduce_structure


def close(A, B, digits=1e-13):
    assert abs(A - B).max() <= digits * abs(B).max()


def reduced():
    """A Craig-Bampton model of a boom with two interfaces, with damping."""
    from femflex.reduction import ModalDamping

    s = boom()
    body = reduce_structure(s, craig_bampton(s, ["root", "tip"], 3), damping=ModalDamping(0.01))
    return craig_bampton_model(body, ["root", "tip"])


@pytest.mark.parametrize("suffix", [".npz", ".h5", ".mat", ".op4"])
@pytest.mark.parametrize("make", [lambda: full_model(brick((2, 1, 1))), reduced], ids=["full", "reduced"])
def test_a_model_written_is_the_model_read(tmp_path, suffix, make):
    if suffix == ".op4":
        pytest.importorskip("pyyeti")
    model = make()
    found = read_matrices(write_matrices(model, tmp_path / f"model{suffix}"))
    close(found.M, model.M)
    close(found.K, model.K)
    assert np.array_equal(found.dofs, model.dofs) and np.allclose(found.points, model.points)
    if model.D is not None:
        close(found.D, model.D)
    if model.moments is not None:
        assert found.moments.second == pytest.approx(model.moments.second, rel=1e-12, abs=1e-12)
        close(found.recovery.rows, model.recovery.rows)


def test_bulk_data_are_read_to_their_digits(tmp_path):
    for model in (full_model(brick((2, 1, 1))), reduced()):
        found = read_matrices(write_matrices(model, tmp_path / "model.pch", force=True))
        assert found.n_modal == model.n_modal
        order = np.lexsort((model.dofs[:, 1], model.dofs[:, 0]))
        close(found.M, model.M[order][:, order], 1e-9)
        close(found.K, model.K[order][:, order], 1e-9)


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


def same(model: MatrixModel, M, K):
    assert model.M.toarray() == pytest.approx(M) and model.K.toarray() == pytest.approx(K)


def test_matrix_market(spring):
    folder, M, K = spring
    for name, A in (("m", M), ("k", K)):
        mmwrite(folder / f"{name}.mtx", sparse.coo_array(A), symmetry="symmetric")
    same(read_matrices(Sources(mass="m.mtx", stiffness="k.mtx", nodes="nodes.csv"), folder=folder), M, K)


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
    (folder / "job.inp").write_text("*HEADING\n*NODE, NSET=ENDS\n1, 0., 0., 0.\n2, 1., 0., 0.\n*ELEMENT\n")
    m = read_matrices(Sources(mass="job_MASS1.mtx", stiffness="job_STIF1.mtx", nodes="job.inp"), folder=folder)
    same(m, M, K)
    assert m.groups["ENDS"].tolist() == [1, 2]


def test_calculix_matrices_with_their_map(spring):
    folder, M, K = spring
    for name, A in (("job.mas", M), ("job.sti", K)):
        rows = [f"{i + 1} {j + 1} {A[i, j]:.9e}" for i, j in zip(*np.nonzero(np.triu(A)), strict=True)]
        (folder / name).write_text("\n".join(rows) + "\n")
    (folder / "job.dof").write_text("".join(f"{i // 3 + 1}.{i % 3 + 1}\n" for i in range(6)))
    same(
        read_matrices(Sources(mass="job.mas", stiffness="job.sti", nodes="nodes.csv", dofs="job.dof"), folder=folder),
        M,
        K,
    )


def test_plain_arrays_with_the_map_by_their_size(spring):
    folder, M, K = spring
    np.savez(folder / "two.npz", mass=M, stiffness=K, xyz=[[0, 0, 0], [1, 0, 0]])
    m = read_matrices(folder / "two.npz", groups={"end": [2]})
    same(m, M, K)
    assert m.dofs[3].tolist() == [2, 1] and m.nodes_of("end").tolist() == [2]
    write_matrices(m, folder / "named.npz")  # groups that are stated go before those of the same name in the file
    again = read_matrices(folder / "named.npz", groups={"end": [1], "both": [1, 2]})
    assert again.nodes_of("end").tolist() == [1] and again.nodes_of("both").tolist() == [1, 2]
    assert read_matrices(folder / "named.npz", groups={"both": [1, 2]}).nodes_of("end").tolist() == [2]
    with pytest.raises(ValueError, match=f"group 'end' has a node number above {2**63 - 1}; give numbers of its nodes"):
        read_matrices(folder / "two.npz", groups={"end": [10**30]})


def test_an_output4_of_another_program_with_map_and_nodes(spring):
    with np.printoptions():  # which pyYeti changes for the whole process
        op4 = importlib.import_module("pyyeti.nastran.op4") if importlib.util.find_spec("pyyeti") else None
    if op4 is None:
        pytest.skip("pyyeti is not installed")
    folder, M, K = spring
    op4.write(str(folder / "a.op4"), {"MAA": M, "KAA": K, "PHG": np.ones((6, 2))})
    same(read_matrices(Sources(file="a.op4", nodes="nodes.csv", dofs="xyz"), folder=folder), M, K)
    op4.write(str(folder / "b.op4"), {"MAA": M, "KAA": K}, binary=False)
    same(read_matrices(Sources(file="b.op4", nodes="nodes.csv"), folder=folder), M, K)


def test_info_describes_matrices_of_bulk_data(tmp_path):
    from typer.testing import CliRunner

    from femflex.cli.app import app

    path = write_matrices(full_model(brick((2, 1, 1))), tmp_path / "bar.bdf")
    found = CliRunner().invoke(app, ["info", str(path)]).stdout
    assert "matrix  MAAX: 96 x 96" in found and "mass 32.4, centre of mass (1, 0.15, 0.1)" in found
    (tmp_path / "k.mtx").write_text("1 1 2.0\n2 1 -1.0\n2 2 1.0\n")
    found = CliRunner().invoke(app, ["info", str(tmp_path / "k.mtx")]).stdout
    assert "matrix  k: 2 x 2, 4 entries, symmetric" in found and "alone   gives no mass matrix" in found


def test_without_pyyeti_one_sentence_says_how_to_install_it(tmp_path, monkeypatch):
    (tmp_path / "a.op4").write_bytes(b"\x00" * 64)
    whole = builtins.__import__

    def missing(name, *args):
        if name.startswith("pyyeti"):
            raise ImportError(name)
        return whole(name, *args)

    monkeypatch.setattr(importlib, "import_module", lambda name, *a: missing(name))
    with pytest.raises(ValueError, match=r"pip install 'femflex\[matrices\]'"):
        read_matrices(tmp_path / "a.op4")


def test_a_body_is_the_same_from_every_format(tmp_path):
    s = brick((2, 1, 1))
    model = full_model(s)
    known = reduce_structure(s, cantilever_modes(s, "left", 3), turning=())
    for suffix in (".npz", ".mat", ".h5"):
        found = read_matrices(write_matrices(model, tmp_path / f"brick{suffix}"))
        assert not check_model(found).findings
        body = matrix_body(found, lambda s: cantilever_modes(s, "left", 3), turning=()).body
        assert body.omega == pytest.approx(known.omega, rel=1e-9)


def test_abaqus_degrees_of_freedom_within_elements_are_scalars(spring):
    folder, M, K = spring
    for name, A in (("job_MASS1", M), ("job_STIF1", K)):
        rows = [
            f"{i // 3 + 1},{i % 3 + 1}, {j // 3 + 1},{j % 3 + 1}, {A[i, j]:.16e}"
            for i, j in zip(*np.nonzero(A), strict=True)
        ]
        rows += ["-1,2, -1,2, 5.", "1,1, -1,2, .5", "-1,2, 1,1, .5"]
        (folder / f"{name}.mtx").write_text("\n".join(rows) + "\n")
    m = read_matrices(Sources(mass="job_MASS1.mtx", stiffness="job_STIF1.mtx", nodes="nodes.csv"), folder=folder)
    assert m.M.shape == (7, 7) and m.dofs[-1, 1] == 0 and m.dofs[-1, 0] not in (1, 2)
    assert m.K.toarray()[6, 6] == 5.0 and m.K.toarray()[0, 6] == m.K.toarray()[6, 0] == 0.5


def test_counts_of_matrix_market_without_its_banner_are_no_entry(spring):
    folder, M, K = spring
    for name, A in (("m", M), ("k", K)):
        rows = [(i, j) for i, j in zip(*np.nonzero(A), strict=True) if j <= i]
        lines = [f"6 6 {len(rows)}", *(f"{i + 1} {j + 1} {A[i, j]:.16e}" for i, j in rows)]
        (folder / f"{name}.mtx").write_text("\n".join(lines) + "\n")
    K_read = read_matrices(Sources(mass="m.mtx", stiffness="k.mtx", nodes="nodes.csv"), folder=folder)
    assert K_read.M.toarray() == pytest.approx(M)  # not with 6 in its last entry


def test_a_stiffness_alone_lacks_its_mass(spring):
    folder, _, K = spring
    mmwrite(folder / "bcsstk.mtx", sparse.coo_array(K), symmetry="symmetric")
    with pytest.raises(ValueError, match=r"bcsstk.mtx gives no mass matrix: it has the matrices \['bcsstk'\]"):
        read_matrices(Sources(stiffness="bcsstk.mtx", nodes="nodes.csv"), folder=folder)


def test_nodes_that_move_by_the_same_dof_cannot_be_written_node_by_node():
    """A mass tied rigidly to a node at the same place moves by unit factors of that node's dofs."""
    mesh = line([[0, 0, 0], [1.0, 0, 0]], 2).merged(line([[1.0, 0, 0], [2.0, 0, 0]], 1))
    a, b = np.flatnonzero(np.abs(mesh.points[:, 0] - 1.0) < 1e-12)
    tied = mesh.with_groups(points={"a": [int(a)], "b": [int(b)]})
    structure = build_structure(tied, [Member("line", "beam", Tube(0.06, 0.004), SOFT)], connections=[Rigid("b", "a")])
    with pytest.raises(ValueError, match="6 degrees of freedom of the structure are no single components of nodes"):
        full_model(structure)
