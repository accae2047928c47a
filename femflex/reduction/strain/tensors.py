"""Strain tensors of shapes from the strain table: quadrature points contracted by one matrix product per chunk.

The energy is quadratic in the strains of single shapes and of pairs of shapes. With C = R R^T over the strains that
have a quadratic part, columns R^-1 C B0_i and R^T B_ij of all points make a matrix X whose product X^T X holds
V2_i(jk) = int B0_i C B_jk and V3_(ij)(kl) = int B_ij C B_kl; their fully symmetric parts are kept.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from math import prod
from threading import Event

import numpy as np
from scipy.linalg.blas import dgemm, dsyrk
from threadpoolctl import ThreadpoolController

from femflex.arrays import Array, IntArray
from femflex.body import StrainTensors
from femflex.body.symmetric import packed_indices, packed_size
from femflex.fem.structure import Structure
from femflex.fem.tables import StrainBlock, element_chunks
from femflex.memory import require_memory
from femflex.reduction.inertia.moments import linear_stiffness
from femflex.reduction.strain import strain_kernel

ROOM = 1_000_000  # doubles of a chunk's columns: large enough for fast products, small enough for the cache
MOST_BYTES = 2e9  # of the products of pairs; some 170 shapes
INDICES = 96  # bytes for each packed value, of indices and places while it is collected


def strain_tensors(structure: Structure, phi: Array) -> StrainTensors:
    """V1, f0, V2 and V3 of shapes phi (n_dof, n), initial stress included; units as in `StrainTensors`.

    Memory: the table is cut into chunks of `ROOM` doubles (8 MB); each thread holds one, and the product of
    pairs, 8 (n + n(n+1)/2)^2 bytes (0.4 MB for 20 shapes, 6 MB for 40), all of them together MOST_BYTES at most.
    Raises ValueError when that would be more than MOST_BYTES.
    """
    n = phi.shape[1]
    total = products(structure, phi, n + n * (n + 1) // 2)
    V1 = linear_stiffness(structure.K, phi)
    return StrainTensors(V1, phi.T @ structure.f0, packed_cubic(total, n), packed_quartic(total[n:, n:], n))


def cubic_tensors(structure: Structure, phi: Array) -> StrainTensors:
    """V1, f0 and V2 of shapes phi (n_dof, n) [m, rad] without V3, which costs (n + 1)/2 times as much.

    Chunks, and 8 n (n + n(n+1)/2) bytes (0.7 MB for 40 shapes, 50 MB for 230). Raises as `strain_tensors`.
    """
    total = products(structure, phi, phi.shape[1])
    V1 = linear_stiffness(structure.K, phi)
    return StrainTensors(V1, phi.T @ structure.f0, packed_cubic(total, phi.shape[1]))


def require_room(n: int, rows: int | None = None) -> None:
    """Raise ValueError where the strain tensors of n coordinates, or so many rows of X^T X, take too much memory."""
    pairs = n * (n + 1) // 2
    whole = rows is None or rows > n
    size = packed_size(n, 4 if whole else 3)
    way = 8 * (n + pairs) * (n + pairs if rows is None else rows) + INDICES * size
    kinds = "'linear' (or 'condensed', which has fewer coordinates, in place of 'nonlinear')" if whole else "'linear'"
    if 8 * (n + pairs) * (rows or pairs) > MOST_BYTES:
        raise ValueError(
            f"the strain tensors of {n} coordinates would take {8 * size / 1e9:.3g} GB, and {way / 1e9:.3g} GB on the "
            f"way, where a body may take {MOST_BYTES / 1e9:g} GB of products; keep fewer shapes (functions of an "
            f"analytic body), or give this body strain = {kinds}"
        )
    require_memory(
        way, f"the strain tensors of {n} coordinates: making them", f"keep fewer, or give the body strain = {kinds}"
    )


def products(structure: Structure, phi: Array, rows: int) -> Array:
    """The first rows of X^T X, (rows, m) with m = n + n(n+1)/2, over all points of the strain table."""
    n = phi.shape[1]
    m = n + n * (n + 1) // 2
    require_room(n, rows)
    raw = structure.T @ phi
    total = np.zeros((rows, m))
    for block in structure.strain:
        add_products(total, block, raw)
    return total


def add_products(total: Array, block: StrainBlock, raw: Array) -> None:
    """Add the first rows of X^T X of a block to total (rows, m), for shapes raw (n_raw, n)."""
    rows, m = total.shape

    def contracted(chunks: Iterator[slice]) -> Array:
        room, own = np.empty(ROOM), np.zeros((rows, m), order="F")  # fresh memory costs as much as its filling
        for chunk in chunks:
            for part in block.nonlinear(chunk):
                if part.elastic.any() and part.quadratic_map.any():
                    sign = 1.0 if part.elastic[0, 0, 0, 0] > 0 else -1.0  # the same at all points of a part
                    own = with_products(own, strain_columns(part, raw, small, room).reshape(m, -1), sign)
        return own

    chunks = list(element_chunks(len(block.dofs), values_per_element(block, raw.shape[1]), ROOM))
    small = len(chunks) == 1
    found = side_by_side(contracted, chunks, max(1, int(MOST_BYTES // total.nbytes)))
    total += found if rows < m else np.triu(found) + np.triu(found, 1).T


def with_products(own: Array, X: Array, sign: float = 1.0) -> Array:
    """Add the first rows of sign X^T X, X (k, m), to own (n_rows, m) in place; where these are all rows, only on and
    above the diagonal."""
    rows, m = own.shape
    if rows < m:
        return np.asarray(dgemm(sign, X[:rows].T, X.T, 1.0, own, trans_a=1, overwrite_c=1))
    return np.asarray(dsyrk(sign, X.T, 1.0, own, trans=1, overwrite_c=1))


def strain_columns(block: StrainBlock, raw: Array, small: bool, room: Array | None = None) -> Array:
    """X (n + n(n+1)/2, s, p) [J^1/2 per coordinate] of all points of a block, single shapes before pairs i <= j; in
    the room if that fits.

    For a part with a negative elastic matrix, the columns are those of the opposite matrix. small: whether numpy is
    used, which is faster for small bodies.
    """
    n = raw.shape[1]
    strains, Q = quadratic_strains(block)
    C = block.elastic[..., strains, :]  # (e|1, q|1, s, all strains)
    C = C if C[0, 0, 0, strains[0]] > 0 else -C
    root = np.linalg.cholesky(C[..., strains])
    linear = np.linalg.solve(root, C @ block.linear_map)
    needed = 1 + np.flatnonzero(linear.any(axis=(0, 1, 2)) | Q.any(axis=(0, 1)))[-1]
    g = block.gradients(raw, slice(None), needed)
    e, q = g.shape[:2]
    by_row: Array = np.ascontiguousarray(g.reshape(e * q, needed, n).transpose(1, 2, 0))
    shape = (n + n * (n + 1) // 2, len(strains), e * q)
    X = np.empty(shape) if room is None or room.size < prod(shape) else room[: prod(shape)].reshape(shape)
    uniform = linear.shape[:2] == (1, 1)
    if uniform:  # one product is faster than many small ones
        X[:n] = np.tensordot(linear[0, 0, :, :needed], by_row, axes=1).swapaxes(0, 1)
    else:
        X[:n] = np.matmul(linear[..., :needed], g).reshape(e * q, -1, n).transpose(2, 1, 0)
    X[:n] *= np.sqrt(block.weight).ravel()
    by_row *= block.weight.ravel() ** 0.25
    fill, mix = (_fill_few_pairs, _mix_few_strains) if small else (strain_kernel.fill_pairs, strain_kernel.mix_strains)
    fill(X[n:], by_row, *nonzero_entries(np.tensordot(root[0, 0].T, Q, axes=1) if uniform else Q))
    if not uniform:
        root = np.broadcast_to(root, (e, q, *root.shape[2:])).reshape(e * q, *root.shape[2:])
        mix(X[n:], np.ascontiguousarray(root.transpose(1, 2, 0), float))
    return X


def quadratic_strains(block: StrainBlock) -> tuple[IntArray, Array]:
    """Numbers (n_s,) of the strains that have a quadratic part, and Q (s, g, g) with B_ij = g_i.Q g_j, symmetric."""
    Q = (block.quadratic_map + block.quadratic_map.swapaxes(1, 2)) / 4  # eps takes half of the map
    strains = np.flatnonzero(Q.any(axis=(1, 2)))
    return strains, Q[strains]


def nonzero_entries(Q: Array) -> tuple[IntArray, IntArray, IntArray, Array]:
    """Strain, row, column (k,), as numbers, and value (k,) of the entries of Q (s, g, g) that are not zero."""
    strain, row, column = (np.ascontiguousarray(place, np.int64) for place in np.nonzero(Q))
    return strain, row, column, Q[strain, row, column]


def values_per_element(block: StrainBlock, n: int) -> int:
    """Doubles that the columns of one element take."""
    one = block.sampled(slice(0, 1))
    s, g = len(quadratic_strains(one)[0]), one.linear_map.shape[1]
    return one.weight.shape[1] * (s * (n + n * (n + 1) // 2) + s * s + 2 * g * n)


def pair_number(i: IntArray, j: IntArray, n: int) -> IntArray:
    """Index (...) of pair i <= j among all pairs in lexicographic order."""
    low, high = np.minimum(i, j), np.maximum(i, j)
    return low * n - low * (low - 1) // 2 + high - low


def packed_cubic(total: Array, n: int) -> Array:
    """Packed symmetric part of V2 from total (m, m): mean over which index is the linear one."""
    i, j, k = packed_indices(n, 3).T
    parts = ((i, j, k), (j, i, k), (k, i, j))
    return sum((total[a, n + pair_number(b, c, n)] for a, b, c in parts), np.zeros(len(i))) / 3


def packed_quartic(pairs: Array, n: int) -> Array:
    """Packed symmetric part (k,) [SI] of V3 from the products of pairs: mean over the three ways to pair four
    indices."""
    i, j, k, l = packed_indices(n, 4).T
    parts = ((i, j, k, l), (i, k, j, l), (i, l, j, k))
    return sum((pairs[pair_number(a, b, n), pair_number(c, d, n)] for a, b, c, d in parts), np.zeros(len(i))) / 3


def side_by_side(work: Callable[[Iterator[slice]], Array], chunks: Sequence[slice], most: int) -> Array:
    """The sum of work over all chunks (numbers of rows), of any shape, computed in threads.

    There are as many threads as BLAS has, at most `most`; each then uses BLAS with a single thread. After an
    interruption every thread ends with its present chunk.
    """
    if len(chunks) < 2:
        return work(iter(chunks))
    blas = ThreadpoolController().select(user_api="blas")
    threads = min(len(chunks), most, max((library["num_threads"] for library in blas.info()), default=1))
    stop = Event()

    def chunks_of_thread(first: int) -> Iterator[slice]:
        for chunk in chunks[first::threads]:
            if stop.is_set():
                return
            yield chunk

    with blas.limit(limits=1), ThreadPoolExecutor(threads) as pool:
        try:
            parts = [pool.submit(work, chunks_of_thread(first)) for first in range(threads)]
            return np.sum([part.result() for part in parts], axis=0)
        finally:
            stop.set()


def _fill_few_pairs(out: Array, g: Array, strain: IntArray, row: IntArray, column: IntArray, value: Array) -> None:
    """Fill out (n(n+1)/2, s, p) as `strain_kernel.fill_pairs` does, by numpy: faster for small bodies."""
    first, n = 0, g.shape[1]
    for i in range(n):
        left = value[:, None] * g[row, i]
        for q in range(out.shape[1]):
            entries = strain == q
            out[first : first + n - i, q] = np.einsum("kp,kjp->jp", left[entries], g[column[entries], i:])
        first += n - i


def _mix_few_strains(out: Array, root: Array) -> None:
    """Replace strains out (n_pairs, s, p) by root^T times them, root (s, s, p), as `strain_kernel.mix_strains` does."""
    out[:] = np.einsum("qrp,nqp->nrp", root, out)
