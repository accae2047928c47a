"""Checks of matrices: mass properties by hand, and each fault found with its number and its limit."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy import sparse
from support.matrix_examples import boom, brick

from femflex.matrices import MatrixModel, Sources, StatedMass, check_model, full_model, matrix_body, read_matrices
from femflex.reduction import cantilever_modes, free_free_modes
from femflex.warning import PhysicsWarning


@pytest.fixture(scope="module")
def bar():
    return full_model(brick((2, 1, 1)), "bar")


def changed(model, M=None, K=None):
    """The model with entries (row, column) -> added."""
    out = []
    for A, entries in ((model.M, M), (model.K, K)):
        A = A.tolil(copy=True)
        for (i, j), value in (entries or {}).items():
            A[i, j] += value
        out.append(sparse.csr_array(A))
    return replace(model, M=out[0], K=out[1])


def test_mass_properties_are_those_of_the_solid_bar(bar):
    found = check_model(bar, StatedMass(32.4, np.array([1.0, 0.15, 0.1])))
    assert found.mass == pytest.approx(270 * 0.12)
    assert found.center_of_mass == pytest.approx([1.0, 0.15, 0.1])
    a, b, c = 2.0, 0.3, 0.2
    J = 32.4 / 12 * np.diag([b * b + c * c, a * a + c * c, a * a + b * b])
    assert found.inertia == pytest.approx(J, abs=1e-10)
    assert found.rigid.max() < 1e-14 and not found.findings


def test_asymmetry_has_number_and_limit(bar):
    found = check_model(changed(bar, K={(0, 5): 1e3}))
    assert found.asymmetry["stiffness"] == pytest.approx(1e3 / abs(changed(bar, K={(0, 5): 1e3}).K).max())
    assert "stiffness matrix is not symmetric" in found.errors[0] and "limit 1e-06" in found.errors[0]
    small = check_model(changed(bar, K={(0, 5): 1e-8 * abs(bar.K).max()}))
    assert not small.errors and "symmetric part is taken" in small.warnings[0]


def test_indefinite_matrices_are_errors(bar):
    m = bar.M.diagonal()[4]
    text = check_model(changed(bar, M={(4, 4): -2 * m})).errors[0]
    node, component = bar.dofs[4]
    assert f"negative entries on the diagonal, the least {-m:.4g} at node {node}, component {component}" in text
    off = 3 * m
    assert "mass matrix has 1 negative eigenvalues" in check_model(changed(bar, M={(4, 7): off, (7, 4): off})).errors[0]
    k = abs(bar.K).max()
    found = check_model(changed(bar, K={(4, 7): k, (7, 4): k}))
    assert any("stiffness matrix has" in text and "negative eigenvalue" in text for text in found.errors)


def test_grounding_is_reported_with_its_node(bar):
    row = int(np.flatnonzero((bar.dofs == [5, 3]).all(axis=1))[0])
    found = check_model(changed(bar, K={(row, row): 1e5}))
    text = next(text for text in found.warnings if "rigid motion z" in text)
    assert "with 1e+05 N/m" in text and "node 5, z" in text and "limit 1e-06" in text


def test_mass_properties_other_than_stated_are_warned_of(bar):
    found = check_model(bar, StatedMass(40.0, np.array([1.2, 0.15, 0.1]), np.diag([1.0, 2.0, 3.0])))
    assert [text.split(" is ")[0] for text in found.warnings[:2]] == ["its mass", "its centre of mass"]
    assert "inertia" in found.warnings[2]


def test_missing_degrees_of_freedom_show_in_the_mass_by_axis(bar):
    keep = np.flatnonzero(bar.dofs[:, 1] != 2)
    half = replace(bar, M=bar.M[keep][:, keep], K=bar.K[keep][:, keep], dofs=bar.dofs[keep])
    assert any("its mass is 32.4, " in text and "along x, y, z" in text for text in check_model(half).warnings)


def test_an_unusable_model_makes_no_body(bar):
    with pytest.raises(ValueError, match="bar cannot be used: its stiffness matrix is not symmetric"):
        matrix_body(changed(bar, K={(0, 5): 1e3}), lambda s: cantilever_modes(s, "left", 3))
    with pytest.raises(ValueError, match="has 1 entries that are not finite"):
        matrix_body(changed(bar, M={(0, 0): np.nan}), lambda s: cantilever_modes(s, "left", 3))
    with pytest.raises(ValueError, match="bar has no modal coordinates; give it a reduction"):
        matrix_body(bar)


def test_a_grounded_model_is_used_with_a_warning(bar):
    row = int(np.flatnonzero((bar.dofs == [5, 3]).all(axis=1))[0])
    with pytest.warns(PhysicsWarning) as given:
        matrix_body(changed(bar, K={(row, row): 1e5}), lambda s: cantilever_modes(s, "left", 3), turning=())
    assert "bar: its stiffness resists the rigid motion z" in str(given[0].message)


def test_files_with_few_digits_still_float_freely():
    """Eight digits leave stiffness against rigid motions; it is taken out where it is rounding."""
    from femflex.matrices.body import without_rounding

    model = full_model(boom(4), "boom")
    rounded = lambda A: sparse.csr_array((np.array([float(f"{x:.8g}") for x in A.data]), A.indices, A.indptr))  # noqa: E731
    coarse = replace(model, K=rounded(sparse.csr_array(model.K)))
    exact = free_free_modes(model.structure(), 4).omega
    found = free_free_modes(without_rounding(coarse.structure()), 4).omega
    assert found == pytest.approx(exact, rel=1e-5)


SMALL = dict(ids=np.array([1, 2]), points=np.eye(3)[:2], M=sparse.eye_array(3).tocsr(), K=sparse.eye_array(3).tocsr())


@pytest.mark.parametrize(
    ("change", "text"),
    [
        ({"dofs": [[1, 1], [1, 7], [2, 1]]}, "component 7; components are 1 to 6"),
        (
            {"dofs": [[1, 1], [3, 1], [2, 1]]},
            r"1 nodes of the map of degrees of freedom have no coordinates, such as \[3\]",
        ),
        ({"dofs": [[1, 1], [2, 1]]}, "the mass matrix is 3 x 3, and the map of degrees of freedom has 2 rows"),
        ({"ids": np.array([1, 1]), "dofs": [[1, 1], [1, 2], [1, 3]]}, "a node number is given twice, such as 1;"),
        ({"ids": np.array([9, 3, 3]), "dofs": [[9, 1], [3, 2], [3, 3]]}, "a node number is given twice, such as 3;"),
    ],
)
def test_models_that_do_not_fit_are_refused(change, text):
    values = {**SMALL, **change}
    with pytest.raises(ValueError, match=text):
        MatrixModel(name="m", **{**values, "dofs": np.array(values["dofs"])})


def test_repeated_components_and_unknown_groups_are_refused():
    model = MatrixModel(name="m", dofs=np.array([[1, 1], [1, 1], [2, 1]]), **SMALL)
    with pytest.raises(ValueError, match="names component 1 of point 0 2 times"):
        model.structure()
    with pytest.raises(ValueError, match=r"group 'root' is not in m; its groups are \[\], all and node_NUMBER"):
        model.structure(["root"])


BAD = {
    "nothing.npz": (None, "nothing.npz does not exist"),
    "a.xyz": ("", "is no known format of matrices; known are"),
    "a.npz": ("this is no archive", "a.npz could not be read as NumPy archive"),
    "a.mat": ("x" * 300, "a.mat could not be read as Matlab file"),
    "a.mtx": ("1 2 3 4\n5 6 7 8\n", r"a.mtx, line 1, has a row of 4 values; a row has 5 \(node, component, .* or 3"),
    "b.mtx": ("** K\n1 1 2.0\n2 1\n", r"b.mtx, line 3, has a row of 2 values; a row has 3 \(row, column, value\)"),
    "c.mtx": ("1 1 2.0\n2 1 2.o\n", "c.mtx, line 2: '2 1 2.o' is no row of numbers"),
    "d.mtx": ("** nothing\n", "d.mtx has no rows of numbers"),
    "e.mtx": ("%%MatrixMarket matrix coordinate real general\n2 2 1\n1 x 3\n", "e.mtx, line 3: .*; it is damaged"),
    "a.csv": ("1, 2, 3\n", "rows of .3. values; a table of nodes has four"),
    "a.inp": ("*ELEMENT\n1, 2, 3\n", r"no \*NODE block"),
    "a.pch": (
        "DMIG*   KAAX    " + f"{1:>16d}{1:>16d}\n*       {1:>16d}{1:>16d}{'1.0':>16}\n",
        "has columns and no header",
    ),
    "b.pch": ("GRID,1,9,0.,0.,0.\n", "coordinate system 9 is not in the deck"),
    "c.pch": ("DMIG,KAAX,0,6,4,0\n", "is complex"),
    "d.pch": ("GRID,1,,0.,0.,0.\n", "gives no mass matrix"),
    "e.pch": ("GRID,1,,x,0.,0.\n", "GRID 1 has .X. in field 4, where a number is needed"),
}


@pytest.mark.parametrize("name", BAD)
def test_damaged_files_give_a_sentence(tmp_path, name):
    text, expected = BAD[name]
    if text is not None:
        (tmp_path / name).write_text(text)
    with pytest.raises(ValueError, match=expected):
        read_matrices(tmp_path / name)


def test_what_is_missing_is_said(tmp_path):
    np.savez(tmp_path / "a.npz", A=np.eye(6), B=np.eye(6))
    with pytest.raises(ValueError, match=r"a.npz gives no mass matrix: it has the matrices \['A', 'B'\]"):
        read_matrices(tmp_path / "a.npz")
    names = {"mass": "A", "stiffness": "B"}
    with pytest.raises(ValueError, match="coordinates of nodes; give the file that has them"):
        read_matrices(Sources(tmp_path / "a.npz", names=names))
    (tmp_path / "nodes.csv").write_text("1,0,0,0\n2,1,0,0\n3,2,0,0\n")
    with pytest.raises(ValueError, match="its 6 rows are neither three nor six for each of its 3 nodes"):
        read_matrices(Sources("a.npz", nodes="nodes.csv", names=names), folder=tmp_path)
    with pytest.raises(ValueError, match="has no matrix 'C' for mass"):
        read_matrices(Sources("a.npz", nodes="nodes.csv", names={"mass": "C"}), folder=tmp_path)
    with pytest.raises(ValueError, match="units are 'mm'"):
        read_matrices(Sources("a.npz", nodes="nodes.csv", names=names, dofs="xyz"), "mm", folder=tmp_path)


def test_inertias_of_no_body_are_found():
    """Two nodes at one place on springs, with principal inertias 1, 1 and 3: the largest is over the others' sum."""
    dofs = np.array([[k, c] for k in (1, 2) for c in range(1, 7)])
    K = sparse.csr_array(np.kron([[1.0, -1.0], [-1.0, 1.0]], np.eye(6)))
    for inertia, sound in (([1.0, 1.0, 1.9], True), ([1.0, 1.0, 3.0], False)):
        M = sparse.csr_array(np.diag([1.0, 1.0, 1.0, *np.array(inertia) / 2] * 2))
        model = MatrixModel(name="m", ids=np.array([1, 2]), points=np.zeros((2, 3)), dofs=dofs, M=M, K=K)
        found = [text for text in check_model(model).warnings if "principal inertias" in text]
        assert bool(found) is not sound and all("cannot be those of a body" in text for text in found)


@pytest.mark.parametrize("name", ["M", "K"])
def test_of_several_negative_entries_the_least_is_reported(bar, name):
    """The second of three is the least, none of them first or last in the matrix."""
    d = getattr(bar, name).diagonal()
    added = {(k, k): -(1 + share) * d[k] for k, share in ((3, 0.1), (8, 5.0), (10, 0.2))}
    least = -5.0 * d[8]
    assert least < min(-0.1 * d[3], -0.2 * d[10])
    word = {"M": "mass", "K": "stiffness"}[name]
    node, component = bar.dofs[8]
    text = f"its {word} matrix has 3 negative entries on the diagonal, the least {least:.4g} at node {node}, component "
    assert any(f"{text}{component} (limit 0)" in error for error in check_model(changed(bar, **{name: added})).errors)
