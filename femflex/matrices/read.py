"""Files -> MatrixModel: choice of the mass and stiffness matrices, map of degrees of freedom, coordinates of nodes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from pydantic import Field, model_validator
from scipy import sparse

from femflex.arrays import Array, IntArray
from femflex.decks.units import Units, units_of
from femflex.matrices.checks import SYMMETRIC, asymmetry, check_model, symmetric_part
from femflex.matrices.contents import Contents, Entries, groups_from, read_contents
from femflex.matrices.model import MatrixModel
from femflex.noun.table import Table, refuse
from femflex.reduction.boundary.rigid import DIRECTIONS

# names of matrices in files, in order of preference; compared in upper case
COMMON_NAMES = {
    "mass": ("M", "MASS", "MAAX", "MAA", "MXX", "MGG", "MHH", "MCB"),
    "stiffness": ("K", "STIFFNESS", "STIFF", "KAAX", "KAA", "KXX", "KGG", "KHH", "KCB"),
    "damping": ("D", "DAMPING", "BAAX", "BAA", "BXX", "BGG", "BHH", "C"),
    "geometric": ("GEOMETRIC", "KDGG", "KDAA", "KG"),
}
ROLES = tuple(COMMON_NAMES)
COMPONENTS_PER_NODE = {"xyz": 3, "xyzrxryrz": 6}  # orders of components, equal at every node -> components per node


class MatrixNames(Table):
    """Names of the matrices in their files. Default: those that the formats use, such as MAAX, MAA, M."""

    mass: str | None = None
    """Name of the mass matrix."""
    stiffness: str | None = None
    """Name of the stiffness matrix."""
    damping: str | None = None
    """Name of the damping matrix."""
    geometric: str | None = None
    """Name of the geometric stiffness matrix."""


class Sources(Table):
    """Files of the matrices, the coordinates of nodes and the map of degrees of freedom, relative to the case file."""

    file: str | None = None
    """File that has all matrices: .npz, .h5, .mat, .op4, .op2, .pch, .bdf."""
    mass: str | None = None
    """File of the mass matrix alone, such as an .mtx."""
    stiffness: str | None = None
    """File of the stiffness matrix alone."""
    damping: str | None = None
    """File of the damping matrix alone. Default: none."""
    geometric: str | None = None
    """File of a geometric stiffness matrix of a steady stress, which is added to the stiffness. Default: none."""
    nodes: str | None = None
    """File with the coordinates of the nodes: .csv (number, x, y, z), Nastran GRID cards, an Abaqus input file, or
    arrays. Default: those of `file`."""
    dofs: str | None = None
    """Map of degrees of freedom: a file with node and component 1 to 6 per row, or "xyz" or "xyzrxryrz", the same
    components at every node in their order. Default: that of the files, or three or six a node by the size."""
    names: MatrixNames = Field(default_factory=MatrixNames)
    """Names of the matrices in their files."""

    @classmethod
    def from_python(cls, keys: dict[str, Any]) -> dict[str, Any]:
        """The keys, paths as texts."""
        return {key: str(value) if isinstance(value, Path) else value for key, value in keys.items()}

    @model_validator(mode="after")
    def _has_mass_and_stiffness(self) -> Sources:
        if self.file is None and (self.mass is None or self.stiffness is None):
            refuse("found neither file nor both of mass and stiffness; name the files that hold the matrices")
        return self

    @property
    def files(self) -> tuple[tuple[str, str], ...]:
        """(key, file) of every file that is named."""
        keys = ("file", *ROLES, "nodes", "dofs")
        files = [(key, getattr(self, key)) for key in keys]
        return tuple(
            (key, str(value)) for key, value in files if value is not None and str(value) not in COMPONENTS_PER_NODE
        )


def read_matrices(
    source: str | Path | Sources,
    units: str | Units = "m-kg-s",
    groups: Mapping[str, ArrayLike] | None = None,
    folder: str | Path = ".",
) -> MatrixModel:
    """The MatrixModel of a file, or of several, in SI.

    source  a file with all data (npz, HDF5, Matlab; Nastran punch or bulk data with DMIG and GRID cards), or
            Sources if matrices, coordinates and map are in separate files (OP4, OP2, MatrixMarket, Abaqus)
    units   of the files: length-mass-time or length-force-time, such as "mm-t-s"
    groups  name -> numbers of nodes
    folder  folder to which file names are relative

    Raises ValueError if a file is missing, damaged, of unknown format or incomplete.
    """
    sources = source if isinstance(source, Sources) else Sources(file=str(source))
    folder = Path(folder)
    read = {name: read_contents(folder / name) for _, name in sources.files}
    main = read[str(sources.file)] if sources.file is not None else None
    label = Path(str(sources.file or sources.mass or sources.stiffness or "matrices")).name
    entries, names = _matrices_by_role(sources, read, main, label)
    nodes = read[str(sources.nodes)] if sources.nodes is not None else main
    contents = [*([main] if main else []), *(part for part in read.values() if part is not main)]
    ids, points, frames = _node_coordinates(nodes, contents, label)
    scalars = set[int]().union(*(part.scalars for part in contents))
    dofs, matrices = _with_common_map(entries, sources, read, contents, (ids, scalars), label)
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


def _matrices_by_role(
    sources: Sources, read: Mapping[str, Contents], main: Contents | None, label: str
) -> tuple[dict[str, Entries], dict[str, str]]:
    """Role -> entries, and role -> name in the file. Raises ValueError if mass or stiffness is missing, or a matrix is
    complex."""
    entries, names = dict[str, Entries](), dict[str, str]()
    for role in ROLES:
        own_file = getattr(sources, role)
        file = read[str(own_file)] if own_file is not None else main or Contents()
        name = _matrix_name(role, file, getattr(sources.names, role), own_file is not None, str(own_file or label))
        if name is not None:
            entries[role], names[role] = _real(file.matrices[name], role, name, str(own_file or label)), name
    for role in ("mass", "stiffness"):
        if role not in entries:
            available = sorted({other for part in read.values() for other in part.matrices})
            raise ValueError(
                f"{label} gives no {role} matrix: it has the matrices {available or 'none'}, and looked for were "
                f'{", ".join(COMMON_NAMES[role])}; say which it is, names = {{ {role} = "NAME" }}, or give {role} = '
                '"FILE"'
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


def _matrix_name(role: str, contents: Contents, requested: str | None, has_own_file: bool, label: str) -> str | None:
    matrices, others = ({name.upper(): name for name in names} for names in (contents.matrices, contents.others))
    candidates = COMMON_NAMES[role] if requested is None else (requested.upper(),)
    name = next((candidate for candidate in candidates if candidate in matrices or candidate in others), None)
    if name in matrices:
        return matrices[name]
    available = sorted(contents.matrices) or "none"
    if name is not None:
        raise ValueError(
            f"{label}: array {others[name]!r} {contents.others[others[name]]}; a {role} matrix is n x n real numbers. "
            "Correct it, or rename it if it is something else"
        )
    if requested is not None:
        raise ValueError(f"{label} has no matrix {requested!r} for {role}; it has {available}")
    if has_own_file:
        if len(contents.matrices) == 1:
            return next(iter(contents.matrices))
        raise ValueError(
            f'{label} has the matrices {available}; say which is the {role}, names = {{ {role} = "NAME" }}'
        )
    return None


def _node_coordinates(
    nodes: Contents | None, contents: Sequence[Contents], label: str
) -> tuple[IntArray, Array, Array | None]:
    """Numbers, positions and displacement axes of the nodes."""
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


def _with_common_map(
    entries: Mapping[str, Entries],
    sources: Sources,
    read: Mapping[str, Contents],
    contents: Sequence[Contents],
    nodes: tuple[IntArray, set[int]],
    label: str,
) -> tuple[IntArray, dict[str, sparse.csr_array]]:
    """A common map of degrees of freedom (n_dof, 2), and the matrices in its order."""
    ids, scalars = nodes
    maps = [role_entries.dofs for role_entries in entries.values() if role_entries.dofs is not None]
    if maps:
        pairs, number = np.unique(np.concatenate(maps), axis=0, return_inverse=True)
        pairs = _with_scalars(pairs, scalars)
        out, start = dict[str, sparse.csr_array](), 0
        for role, role_entries in entries.items():
            if role_entries.dofs is None:
                raise ValueError(
                    f"{label}: the {role} matrix has no map of degrees of freedom of its own and the others have; "
                    "write all in one form"
                )
            indices = np.ravel(number)[start : start + len(role_entries.dofs)]
            start += len(role_entries.dofs)
            n = len(pairs)
            select = sparse.csr_array(
                sparse.coo_array((np.ones(len(indices)), (indices, np.arange(len(indices)))), shape=(n, len(indices)))
            )
            out[role] = sparse.csr_array(select @ role_entries.matrix @ select.T)
        return pairs, out
    n = max(role_entries.matrix.shape[0] for role_entries in entries.values())
    dofs = _dof_map(sources, read, contents, ids, n, label)
    out = {}
    for role, role_entries in entries.items():
        matrix = _padded(role_entries.matrix, len(dofs)) if role_entries.open_ended else role_entries.matrix
        out[role] = matrix
        if matrix.shape != (len(dofs), len(dofs)):
            n_rows, n_columns = role_entries.matrix.shape
            raise ValueError(
                f"{label}: the {role} matrix is {n_rows} x {n_columns}, and the map of degrees of freedom has "
                f'{len(dofs)} rows ({len(ids)} nodes); give matrices and map of one size, dofs = "map.csv"'
            )
    return dofs, out


def _padded(matrix: sparse.csr_array, n: int) -> sparse.csr_array:
    """The matrix extended to n rows with zeros; a coordinate form may end in rows without entries."""
    if max(matrix.shape) >= n:
        return matrix
    entries = matrix.tocoo()
    return sparse.csr_array(sparse.coo_array((entries.data, entries.coords), shape=(n, n)))


def _with_scalars(pairs: IntArray, scalars: set[int]) -> IntArray:
    """The map with component 0 for scalar points, which some programs give component 1."""
    pairs = pairs.copy()
    is_scalar = np.isin(pairs[:, 0], np.array(sorted(scalars), np.int64)) if scalars else np.zeros(len(pairs), bool)
    pairs[is_scalar & (pairs[:, 1] <= 1), 1] = 0
    return pairs


def _dof_map(
    sources: Sources, read: Mapping[str, Contents], contents: Sequence[Contents], ids: IntArray, n: int, label: str
) -> IntArray:
    """The map of degrees of freedom for matrices that do not include one."""
    dofs_source = str(sources.dofs) if sources.dofs is not None else ""
    if dofs_source in COMPONENTS_PER_NODE:
        return _repeated(ids, COMPONENTS_PER_NODE[dofs_source])
    if sources.dofs is not None:
        dofs = read[str(sources.dofs)].dofs
        if dofs is None:
            raise ValueError(f"{sources.dofs} has no map of degrees of freedom; give rows of node and component 1 to 6")
        return dofs
    dofs_in_file = next((part.dofs for part in contents if part.dofs is not None), None)
    if dofs_in_file is not None:
        return dofs_in_file
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


def describe_matrices(path: Path) -> str:
    """Lines about the matrices, nodes and degrees of freedom of a file, and about the checks of a complete model."""
    contents = read_contents(path)
    lines = [f"{path.name}: matrices"]
    for name, entries in contents.matrices.items():
        A = entries.matrix
        size = f"{A.shape[0]} x {A.shape[1]}, {A.nnz} entries"
        symmetric = "symmetric" if asymmetry(A) <= SYMMETRIC else f"not symmetric by {asymmetry(A):.1e}"
        nodes = "" if entries.dofs is None else f", {len(np.unique(entries.dofs[:, 0]))} nodes"
        lines.append(f"matrix  {name}: {size}, {symmetric}{nodes}")
    lines += _nodes(contents)
    if not lines[1:]:
        raise ValueError(f"{path.name} holds neither matrices nor nodes; give a file that does")
    lines += [f"note    {text}" for text in contents.notes]
    try:
        model = read_matrices(path)
    except ValueError as error:
        return "\n".join([*lines, f"alone   {str(error).removeprefix(path.name + ' ')}"])
    report = check_model(model)
    centre, J = (", ".join(f"{x:.6g}" for x in values) for values in (report.center_of_mass, np.diag(report.inertia)))
    energy = ", ".join(f"{name} {value:.1e}" for name, value in zip(DIRECTIONS, report.rigid, strict=True))
    lines += [
        f"checked in units of the file: mass {report.mass:.6g}, centre of mass ({centre}), inertia about it {J}",
        f"strain energy of rigid motions, relative: {energy}",
        f"degrees of freedom: {model.n_dof - model.n_modal} of {len(model.loaded)} nodes, {model.n_modal} modal, "
        f"{report.massless} without mass",
    ]
    lines += [f"error   {text}" for text in report.errors]
    return "\n".join([*lines, *(f"doubt   {text}" for text in report.warnings)])


def _nodes(contents: Contents) -> list[str]:
    lines = []
    if contents.points is not None:
        low, high = (
            ", ".join(f"{x:.6g}" for x in p) for p in (contents.points.min(axis=0), contents.points.max(axis=0))
        )
        lines.append(f"nodes   {len(contents.points)}, from ({low}) to ({high})")
    if contents.dofs is not None:
        lines.append(f"dofs    {len(contents.dofs)} in its map")
    if contents.scalars:
        lines.append(f"scalar  {len(contents.scalars)} points (modal coordinates)")
    lines += [f"group   {name}: {len(nodes)} nodes" for name, nodes in contents.groups.items()]
    return lines
