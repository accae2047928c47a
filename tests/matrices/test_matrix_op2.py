"""OP2 files as Nastran writes them, block by block: DMIG tables and plain matrices."""

from __future__ import annotations

import struct

import numpy as np
import pytest

from femflex.matrices import Sources, read_matrices


def record(data: bytes) -> bytes:
    """A record of Fortran: its length before and after."""
    return struct.pack("i", len(data)) + data + struct.pack("i", len(data))


def keys(*numbers: int) -> bytes:
    return b"".join(record(struct.pack("i", n)) for n in numbers)


def head(name: str, trailer: list[int], kind: int) -> bytes:
    """Name and trailer of a block; kind 0: a table, 1: a matrix."""
    label = record(name.ljust(8).encode())
    return (
        keys(2) + label + keys(-1, 7) + record(struct.pack("7i", *trailer)) + keys(-2, 1, 0, 2) + label
        + keys(-3, 1, kind)
    )  # fmt: skip


def table(name: str, numbers: list[int]) -> bytes:
    data = struct.pack(f"{len(numbers)}i", *numbers)
    return head(name, [101, 0, 0, 0, 0, 0, 0], 0) + keys(len(numbers)) + record(data) + keys(-4, 1, 0, 0)


def dmig(name: str, A: np.ndarray, rows: list[tuple[int, int]], columns: list[tuple[int, int]], form: int) -> bytes:
    """The entries of a DMIG in double precision, column by column; of a symmetric one (6) the lower triangle."""
    label = struct.unpack("2i", name.ljust(8).encode())
    numbers = [114, 1, 120, *label, 0, form, 2, 2, 0, 0, len(columns)]
    for j, (node, component) in enumerate(columns):
        numbers += [node, component]
        for i in range(j if form == 6 else 0, len(rows)):
            if A[i, j]:
                numbers += [*rows[i], *struct.unpack("2i", struct.pack("d", A[i, j]))]
        numbers += [-1, -1]
    return table(name, [*numbers, -1, -1])


def matrix(name: str, A: np.ndarray) -> bytes:
    """A plain matrix in double precision; each column from its first row that is not zero."""
    out = head(name, [101, A.shape[1], A.shape[0], 2, 2, 0, 0], 1)
    for j, column in enumerate(A.T):
        first = int(np.flatnonzero(column)[0])
        values = column[first:]
        data = struct.pack("i", first + 1) + struct.pack(f"{len(values)}d", *values)
        out += keys(1 + 2 * len(values)) + record(data) + keys(0, -4 - j, int(j < A.shape[1] - 1))
    return out + keys(0)


def op2(path, *blocks: bytes):
    begin = keys(3) + record(struct.pack("3i", 3, 14, 26)) + keys(7) + record(b"NASTRAN FORT TAPE ID CODE - ")
    begin += keys(2) + record(b"LABEL   ") + keys(-1, 0)
    path.write_bytes(begin + b"".join(blocks) + keys(0))
    return path


DOFS = [(5, 1), (5, 3), (12, 2), (700, 0)]


def spd(seed: int, n: int = 4) -> np.ndarray:
    X = np.random.default_rng(seed).standard_normal((n, n))
    return X @ X.T + n * np.eye(n)


def test_dmig_tables_of_an_op2(tmp_path):
    """A symmetric, a general and a rectangular matrix; node and component of every row and column."""
    K, M, P = spd(1), spd(2), np.arange(1.0, 13.0).reshape(4, 3)
    path = op2(
        tmp_path / "a.op2",
        table("CASECC", [1, 2, 3, 4, 5]),
        dmig("KAAX", K, DOFS, DOFS, 6),
        dmig("MAAX", M, DOFS, DOFS, 1),
        dmig("PAX", P, DOFS, [(1, 0), (2, 0), (3, 0)], 9),
    )
    (tmp_path / "nodes.csv").write_text("5, 0., 0., 0.\n12, 1., 0., 0.\n")
    model = read_matrices(Sources(path.name, nodes="nodes.csv"), folder=tmp_path)
    assert model.dofs.tolist() == [list(pair) for pair in DOFS] and model.n_modal == 1
    assert model.K.toarray() == pytest.approx(K) and model.M.toarray() == pytest.approx(M)


def test_plain_matrices_of_an_op2(tmp_path):
    K, M, P = spd(3, 6), spd(4, 6), np.arange(1.0, 13.0).reshape(6, 2)
    K[0, 1] = K[1, 0] = 0.0  # a column that begins further down
    path = op2(tmp_path / "A.OP2", matrix("KGG", K), matrix("PGG", P), matrix("MGG", M))
    (tmp_path / "nodes.csv").write_text("9, 0., 0., 0.\n4, 1., 0., 0.\n")
    model = read_matrices(Sources(path.name, nodes="nodes.csv"), folder=tmp_path)
    assert model.dofs.tolist() == [[9, 1], [9, 2], [9, 3], [4, 1], [4, 2], [4, 3]]
    assert model.K.toarray() == pytest.approx(K) and model.M.toarray() == pytest.approx(M)
    assert model.names == {"mass": "MGG", "stiffness": "KGG"}
