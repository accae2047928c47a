"""Sentences about a file of matrices, for `femflex info`."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from femflex.matrices.checks import SYMMETRIC, asymmetry, check_model
from femflex.matrices.contents import Contents, read_contents
from femflex.matrices.read import read_matrices
from femflex.reduction.boundary.rigid import DIRECTIONS


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
