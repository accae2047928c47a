"""Assembly against the plain sum of triplets, for every way dofs may be numbered."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import sparse

from femflex.fem.assembly import Part, assembled

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
