"""Files -> MatrixModel: which matrix is the mass, the map of degrees of freedom, and the coordinates of nodes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike
from scipy import sparse

from femflex.arrays import Array, IntArray
from femflex.decks.units import Units, units_of
from femflex.matrices.checks import symmetric_part
from femflex.matrices.contents import Contents, Entries, groups_from, read_contents
from femflex.matrices.model import MatrixModel

# names of matrices in files, in the order in which they are looked for; compared in upper case
KNOWN = {
    "mass": ("M", "MASS", "MAAX", "MAA", "MXX", "MGG", "MHH", "MCB"),
    "stiffness": ("K", "STIFFNESS", "STIFF", "KAAX", "KAA", "KXX", "KGG", "KHH", "KCB"),
    "damping": ("D", "DAMPING", "BAAX", "BAA", "BXX", "BGG", "BHH", "C"),
    "geometric": ("GEOMETRIC", "KDGG", "KDAA", "KG"),
}
ROLES = tuple(KNOWN)
WORDS = {"xyz": 3, "xyzrxryrz": 6}  # orders of components, the same at every node


@dataclass(frozen=True)
class Sources:
    """Files that a model is read from; paths or names of files in one folder.

    file       the file with all matrices, or None when each has its own
    mass, stiffness, damping, geometric   files of single matrices
    nodes      file with the coordinates of the nodes; None: those of `file`
    dofs       file with the map of degrees of freedom, or "xyz" or "xyzrxryrz": the same components at every node, in
               the order of the nodes; None: as the files have it, or by the size of the matrices
    names      role (mass, stiffness, damping, geometric) -> name of the matrix in its file
    """

    file: str | Path | None = None
    mass: str | Path | None = None
    stiffness: str | Path | None = None
    damping: str | Path | None = None
    geometric: str | Path | None = None
    nodes: str | Path | None = None
    dofs: str | Path | None = None
    names: Mapping[str, str] = field(default_factory=dict)

    @property
    def files(self) -> tuple[tuple[str, str], ...]:
        """(key, file) of all that are given."""
        keys = ("file", *ROLES, "nodes", "dofs")
        given = [(key, getattr(self, key)) for key in keys]
        return tuple((key, str(value)) for key, value in given if value is not None and str(value) not in WORDS)


def read_matrices(
    source: str | Path | Sources,
    units: str | Units = "m-kg-s",
    groups: Mapping[str, ArrayLike] | None = None,
    folder: str | Path = ".",
) -> MatrixModel:
    """The MatrixModel of a file, or of several, in SI.

    source  a file that has everything (npz, HDF5, Matlab; Nastran punch or bulk data with DMIG and GRID cards), or
            Sources where matrices, coordinates and map are in files of their own (OP4, OP2, MatrixMarket, Abaqus)
    units   of the files: length-mass-time or length-force-time, such as "mm-t-s"
    groups  name -> numbers of nodes
    folder  to which the names of files are relative

    Raises ValueError where a file is missing, damaged or of unknown format, or does not have what is needed.
    """
    sources = source if isinstance(source, Sources) else Sources(file=source)
    folder = Path(folder)
    unknown = sorted(set(sources.names) - set(ROLES))
    if unknown:
        raise ValueError(f"names has {unknown}; the matrices are {', '.join(ROLES)}")
    read = {name: read_contents(folder / name) for _, name in sources.files}
    main = read[str(sources.file)] if sources.file is not None else None
    label = Path(str(sources.file or sources.mass or sources.stiffness or "matrices")).name
    entries, names = _roles(sources, read, main, label)
    nodes = read[str(sources.nodes)] if sources.nodes is not None else main
    contents = [*([main] if main else []), *(part for part in read.values() if part is not main)]
    ids, points, frames = _nodes(nodes, contents, label)
    scalars = set[int]().union(*(part.scalars for part in contents))
    dofs, matrices = _on_one_map(entries, sources, read, contents, (ids, scalars), label)
    model = MatrixModel(
        name=label,
        ids=ids,
        points=points,
        dofs=dofs,
        M=matrices["mass"],
        K=matrices["stiffness"],
        D=matrices.get("damping"),
        geometric=matrices.get("geometric"),
        frames=frames,
        recovery=next((part.recovery for part in contents if part.recovery is not None), None),
        moments=next((part.moments for part in contents if part.moments is not None), None),
        groups={**{k: v for part in contents for k, v in part.groups.items()}, **groups_from(groups or {})},
        cells={k: v for part in contents for k, v in part.cells.items()},
        names=names,
    )
    return model.in_si(units_of(units))


def symmetric(model: MatrixModel) -> MatrixModel:
    """The model with the symmetric parts of its matrices."""

    def half(A: sparse.csr_array | None) -> sparse.csr_array | None:
        return None if A is None else symmetric_part(A)

    M, K = symmetric_part(model.M), symmetric_part(model.K)
    return replace(model, M=M, K=K, D=half(model.D), geometric=half(model.geometric))


def _roles(
    sources: Sources, read: Mapping[str, Contents], main: Contents | None, label: str
) -> tuple[dict[str, Entries], dict[str, str]]:
    """Role -> entries, and role -> name in the file. Raises ValueError where mass or stiffness is not found, or one is
    complex."""
    entries, names = dict[str, Entries](), dict[str, str]()
    for role in ROLES:
        own = getattr(sources, role)
        held = read[str(own)].matrices if own is not None else main.matrices if main is not None else {}
        chosen = _chosen(role, held, sources.names.get(role), own is not None, str(own or label))
        if chosen is not None:
            entries[role], names[role] = _real(held[chosen], role, chosen, str(own or label)), chosen
    for role in ("mass", "stiffness"):
        if role not in entries:
            known = sorted({name for part in read.values() for name in part.matrices})
            raise ValueError(
                f"{label} gives no {role} matrix: it has the matrices {known or 'none'}, and looked for were "
                f'{", ".join(KNOWN[role])}; say which it is, names = {{ {role} = "NAME" }}, or give {role} = "FILE"'
            )
    return entries, names


def _real(entries: Entries, role: str, name: str, label: str) -> Entries:
    """The entries as real numbers. Raises ValueError where they have imaginary parts."""
    A = entries.matrix
    if not np.iscomplexobj(A.data):
        return entries
    size = float(abs(A.imag).max()) if A.nnz else 0.0
    if size:
        raise ValueError(
            f"{label}: the {role} matrix {name} is complex (imaginary parts up to {size:.4g}); femflex takes real "
            "matrices. Write its real part, and give structural damping as damping in the case"
        )
    return replace(entries, matrix=sparse.csr_array(A.real))


def _chosen(role: str, held: Mapping[str, Entries], wanted: str | None, own: bool, label: str) -> str | None:
    upper = {name.upper(): name for name in held}
    if wanted is not None:
        if wanted.upper() not in upper:
            raise ValueError(f"{label} has no matrix {wanted!r} for {role}; it has {sorted(held) or 'none'}")
        return upper[wanted.upper()]
    found = next((upper[name] for name in KNOWN[role] if name in upper), None)
    if found is None and own:
        if len(held) == 1:
            return next(iter(held))
        raise ValueError(
            f'{label} has the matrices {sorted(held) or "none"}; say which is the {role}, names = {{ {role} = "NAME" }}'
        )
    return found


def _nodes(nodes: Contents | None, contents: Sequence[Contents], label: str) -> tuple[IntArray, Array, Array | None]:
    """Numbers, places and displacement axes of the nodes."""
    if nodes is None or nodes.points is None:
        nodes = next((part for part in contents if part.points is not None), None)
    if nodes is None or nodes.points is None or nodes.ids is None:
        raise ValueError(
            f'{label} has no coordinates of nodes; give the file that has them: nodes = "nodes.csv" (number, x, y, z '
            "per row), a Nastran file with GRID cards, or an Abaqus input file"
        )
    if len(nodes.ids) != len(nodes.points):
        raise ValueError(f"{label} has {len(nodes.ids)} node numbers and {len(nodes.points)} places; give one of each")
    return nodes.ids, nodes.points, nodes.frames


def _on_one_map(
    entries: Mapping[str, Entries],
    sources: Sources,
    read: Mapping[str, Contents],
    contents: Sequence[Contents],
    nodes: tuple[IntArray, set[int]],
    label: str,
) -> tuple[IntArray, dict[str, sparse.csr_array]]:
    """One map of degrees of freedom (n_dof, 2), and the matrices on it."""
    ids, scalars = nodes
    own = [part.dofs for part in entries.values() if part.dofs is not None]
    if own:
        pairs, number = np.unique(np.concatenate(own), axis=0, return_inverse=True)
        pairs = _with_scalars(pairs, scalars)
        out, start = dict[str, sparse.csr_array](), 0
        for role, part in entries.items():
            if part.dofs is None:
                raise ValueError(
                    f"{label}: the {role} matrix has no map of degrees of freedom of its own and the others have; "
                    "write all in one form"
                )
            at = np.ravel(number)[start : start + len(part.dofs)]
            start += len(part.dofs)
            n = len(pairs)
            select = sparse.csr_array(
                sparse.coo_array((np.ones(len(at)), (at, np.arange(len(at)))), shape=(n, len(at)))
            )
            out[role] = sparse.csr_array(select @ part.matrix @ select.T)
        return pairs, out
    n = max(part.matrix.shape[0] for part in entries.values())
    dofs = _map(sources, read, contents, ids, n, label)
    out = {}
    for role, part in entries.items():
        matrix = _padded(part.matrix, len(dofs))
        out[role] = matrix
        if matrix.shape != (len(dofs), len(dofs)):
            raise ValueError(
                f"{label}: the {role} matrix is {part.matrix.shape[0]} x {part.matrix.shape[1]}, and the map of "
                f'degrees of freedom has {len(dofs)} rows ({len(ids)} nodes); give a map of that size, dofs = "map.csv"'
            )
    return dofs, out


def _padded(matrix: sparse.csr_array, n: int) -> sparse.csr_array:
    """A matrix of n rows from one with fewer: a coordinate form may end in rows without entries."""
    if max(matrix.shape) >= n:
        return matrix
    entries = matrix.tocoo()
    return sparse.csr_array(sparse.coo_array((entries.data, entries.coords), shape=(n, n)))


def _with_scalars(pairs: IntArray, scalars: set[int]) -> IntArray:
    """The map with component 0 for scalar points, which some programs give component 1."""
    pairs = pairs.copy()
    known = np.isin(pairs[:, 0], np.array(sorted(scalars), np.int64)) if scalars else np.zeros(len(pairs), bool)
    pairs[known & (pairs[:, 1] <= 1), 1] = 0
    return pairs


def _map(
    sources: Sources, read: Mapping[str, Contents], contents: Sequence[Contents], ids: IntArray, n: int, label: str
) -> IntArray:
    """The map of degrees of freedom of matrices without one of their own."""
    word = str(sources.dofs) if sources.dofs is not None else ""
    if word in WORDS:
        return _repeated(ids, WORDS[word])
    if sources.dofs is not None:
        found = read[str(sources.dofs)].dofs
        if found is None:
            raise ValueError(f"{sources.dofs} has no map of degrees of freedom; give rows of node and component 1 to 6")
        return found
    known = next((part.dofs for part in contents if part.dofs is not None), None)
    if known is not None:
        return known
    modal = np.array([(number, 0) for number in sorted(set().union(*(c.scalars for c in contents)))], np.int64)
    for width in (3, 6):
        if n == width * len(ids) + len(modal):
            return np.concatenate([_repeated(ids, width), modal.reshape(-1, 2)])
    raise ValueError(
        f"{label} has no map of degrees of freedom, and its {n} rows are neither three nor six for each of its "
        f'{len(ids)} nodes; give a map of node and component 1 to 6 per row, dofs = "map.csv"'
    )


def _repeated(ids: IntArray, width: int) -> IntArray:
    return np.stack([np.repeat(ids, width), np.tile(np.arange(1, width + 1), len(ids))], axis=1)
