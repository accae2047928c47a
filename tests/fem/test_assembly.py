"""Assembly against the plain sum of triplets, for every way dofs may be numbered."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import sparse

from femflex.fem.assembly import Assembler, Part, assembled
from femflex.fem.assembly.connections import connections, layered_connections
from femflex.fem.assembly.runs import find_runs

RNG = np.random.default_rng(0)
NODES = np.array([RNG.permutation(12)[:4] for _ in range(7)])
N = 51


def layouts() -> dict[str, np.ndarray]:
    triples = (3 * NODES[:, :, None] + np.arange(3)).reshape(7, 12)
    wide = 4 * NODES[:, :, None] + np.arange(3)
    return {
        "triples": triples,
        "triples and singles": np.concatenate([wide.reshape(7, 12), 4 * NODES[:, :1] + 3], axis=1),
        "no runs": RNG.permuted(np.tile(np.arange(48), (7, 1)), axis=1)[:, :5],
        "runs that overlap": np.array([[0, 1, 2, 5], [1, 2, 3, 7], [4, 5, 6, 0]]),
        "runs of two lengths from one dof": np.array([[0, 1, 2, 9, 10], [3, 4, 5, 0, 1]]),
        "a dof twice in an element": np.array([[3, 3, 8], [8, 1, 3]]),
    }


def triplet_sum(dofs: np.ndarray, values: np.ndarray) -> np.ndarray:
    total = np.zeros((N, N))
    for rows, matrix in zip(dofs, values, strict=True):
        np.add.at(total, np.ix_(rows, rows), matrix)
    return total


@pytest.mark.parametrize("name", list(layouts()))
def test_sums_are_those_of_triplets(name):
    dofs = layouts()[name]
    values = RNG.normal(size=(*dofs.shape, dofs.shape[1]))
    found = assembled([Part(dofs, values.__getitem__)], sparse.eye_array(N, format="csr"))
    assert found.toarray() == pytest.approx(triplet_sum(dofs, values), abs=1e-13)
    assert found.has_canonical_format


@pytest.mark.parametrize("spacing", [1, 17])
def test_alike_components_are_summed_one_by_one(spacing):
    dofs = (3 * NODES if spacing == 1 else NODES)[:, :, None] + spacing * np.arange(3)
    values = RNG.normal(size=(7, 4, 4))
    found = assembled([Part(dofs, values.__getitem__)], sparse.eye_array(N, format="csr")).toarray()
    assert found == pytest.approx(sum(triplet_sum(dofs[:, :, c], values) for c in range(3)), abs=1e-13)


@pytest.mark.parametrize("first", [False, True])
def test_components_numbered_at_random_are_summed_too(first: bool):
    """All of them, or those of nodes that the first element does not have."""
    dofs = RNG.permutation(36)[3 * NODES[:, :, None] + np.arange(3)]
    if first:
        own = np.isin(NODES, NODES[0])
        dofs = np.where(own[:, :, None], 3 * NODES[:, :, None] + np.arange(3), 3 * NODES[:, :, None] + [1, 0, 2])
    values = RNG.normal(size=(7, 4, 4))
    found = assembled([Part(dofs, values.__getitem__)], sparse.eye_array(N, format="csr")).toarray()
    assert found == pytest.approx(sum(triplet_sum(dofs[:, :, c], values) for c in range(3)), abs=1e-13)


def test_dependent_dofs_are_reduced_and_plain_ones_renumbered():
    dofs = layouts()["triples"]
    values = RNG.normal(size=(7, 12, 12))
    plain = RNG.permutation(N)[:40]
    T = sparse.lil_array((N, 40))
    T[plain, np.arange(40)] = 1.0
    expected_T = T.toarray()
    found = assembled([Part(dofs, values.__getitem__)], T.tocsr()).toarray()
    assert found == pytest.approx(expected_T.T @ triplet_sum(dofs, values) @ expected_T, abs=1e-13)
    T[dofs[0, 0], :3] = 0.6, -0.8, 0.3
    other = [Part(dofs[3:], values[3:].__getitem__), Part(dofs[:3], values[:3].__getitem__)]
    found = assembled(other, T.tocsr()).toarray()
    assert found == pytest.approx(T.toarray().T @ triplet_sum(dofs, values) @ T.toarray(), abs=1e-13)


def test_entries_that_are_zero_are_not_kept():
    values = np.zeros((7, 12, 12))
    values[:, 0, 0] = 1.0
    found = assembled([Part(layouts()["triples"], values.__getitem__)], sparse.eye_array(N, format="csr"))
    assert found.nnz == len(np.unique(NODES[:, 0]))


def test_one_assembler_serves_several_matrices():
    assembler = Assembler(sparse.eye_array(N, format="csr"))
    dofs = layouts()["triples"]
    for _ in range(2):
        values = RNG.normal(size=(7, 12, 12))
        assert assembler.total([Part(dofs, values.__getitem__)]).toarray() == pytest.approx(triplet_sum(dofs, values))
    scalar = RNG.normal(size=(7, 4, 4))
    found = assembler.total([Part(dofs.reshape(7, 4, 3), scalar.__getitem__)]).toarray()
    assert found == pytest.approx(triplet_sum(dofs, np.kron(scalar, np.eye(3))), abs=1e-13)
    assert assembler.total([]).nnz == 0


def test_zeros_left_out_of_one_matrix_are_not_missed_in_the_next():
    assembler = Assembler(sparse.eye_array(N, format="csr"))
    dofs = layouts()["triples"]
    few, full = np.zeros((7, 12, 12)), RNG.normal(size=(7, 12, 12))
    few[:, 2, 5] = 1.0
    first = assembler.total([Part(dofs, few.__getitem__)])
    second = assembler.total([Part(dofs, full.__getitem__)])
    assert first.toarray() == pytest.approx(triplet_sum(dofs, few))
    assert second.toarray() == pytest.approx(triplet_sum(dofs, full))


@pytest.mark.parametrize("layers", [2, 3])
def test_connections_of_runs_in_layers_are_those_found_at_once(layers):
    used, node = np.unique(NODES, return_inverse=True)
    number = (node.reshape(7, 4, 1) + len(used) * np.arange(layers)).reshape(7, -1)
    found, whole = layered_connections(number), connections(number)
    assert found.row.tolist() == whole.row.tolist() and found.col.tolist() == whole.col.tolist()
    assert found.pair.ravel().tolist() == whole.pair.ravel().tolist()


def test_runs_are_the_translations_of_nodes():
    runs = find_runs(layouts()["triples"], N)
    assert runs.size.tolist() == [3] * 12
    assert runs.number.tolist() == NODES.tolist()
    mixed = find_runs(layouts()["triples and singles"], N)
    assert set(mixed.size.tolist()) == {1, 3}
