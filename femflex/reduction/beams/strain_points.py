"""The strain field of a body: gradients of its shapes at the points of the strain table, or means over elements."""

from __future__ import annotations

import numpy as np

from femflex.arrays import Array
from femflex.body.strain_field import StrainPart
from femflex.fem.family import StrainPlaces
from femflex.fem.structure import Structure
from femflex.fem.tables import StrainBlock, cached_chunks, element_chunks
from femflex.reduction.beams.beam_strain import beam_strains
from femflex.reduction.beams.uniform_beam import BeamFunctions, UniformBeam

NAMED = 4  # strains of a beam before those of fourth order
MOST_POINTS = 3000  # points of a member that are kept individually; with more, each element keeps one or two means


def strain_field(structure: Structure, phi: Array, nonlinear: bool) -> tuple[StrainPart, ...]:
    """Parts over shapes phi (n_dof, n) [m, rad], one for every block of the strain table whose points have places.

    Memory is 4 n g bytes per point, where g is the number of strains (4 to 8) of a linear, unstressed body, and the
    number of gradients (6 to 11) of others.
    """
    if not phi.shape[1]:
        return ()
    raw = structure.T @ phi
    blocks = zip(structure.strain, structure.places, strict=True)
    return tuple(_strain_part(block, places, raw, nonlinear) for block, places in blocks if places is not None)


def _strain_part(block: StrainBlock, places: StrainPlaces, raw: Array, nonlinear: bool) -> StrainPart:
    """The strain part of a block at the points that sample its energy: linear and nonlinear strain differ in these."""
    weight, elastic, stress = _sampled_tables(block) if nonlinear else (block.weight, block.elastic, block.stress)
    e, q = weight.shape
    has_quadratic = nonlinear or bool(stress.any())  # the quadratic part of strain is used
    x = places.x if not nonlinear or places.sampled is None else places.sampled
    shares = _mean_weights(weight, x, places.kind) if e * q > MOST_POINTS else None
    n_kept = q if shares is None else shares.shape[1]
    first = block.sampled(slice(0, 1)) if nonlinear else block
    s, g = first.linear_map.shape
    rows = np.empty((e, n_kept, g if has_quadratic else s, raw.shape[1]), np.float32)
    for chunk in cached_chunks(e, q * (g + s) * max(1, raw.shape[1])):
        gradients = block.sampled(chunk).gradients(raw, slice(None)) if nonlinear else block.gradients(raw, chunk)
        values = gradients if has_quadratic else first.linear_map @ gradients
        rows[chunk] = values if shares is None else np.einsum("ekq,eqgn->ekgn", shares[chunk], values)
    levers = places.lever if not nonlinear or places.sampled_lever is None else places.sampled_lever
    lever = np.broadcast_to(levers, (e, q)) if np.ndim(levers) else np.full((1, 1), levers)
    if shares is not None and lever.size > 1:
        lever = np.einsum("ekq,eq->ek", shares, lever)
    fibres = np.zeros((0, 4)) if places.fibres is None else _table_rows(places.fibres, (e, q), shares)
    sections = places.plies if not nonlinear or places.sampled_plies is None else places.sampled_plies
    plies = np.zeros((0, 0, 2, 3, 6)) if sections is None else _table_rows(sections, (e, q), shares)
    if shares is not None:
        x, weight = shares @ x, np.repeat(weight.sum(axis=1, keepdims=True) / n_kept, n_kept, axis=1)
    return StrainPart(
        kind=places.kind,
        places=x.reshape(-1, 3),
        weight=weight.ravel(),
        rows=rows.reshape(-1, *rows.shape[2:]),
        linear=first.linear_map if has_quadratic else np.eye(s),
        quadratic=first.quadratic_map if has_quadratic else np.zeros((s, s, s)),
        elastic=_table_rows(elastic, (e, q), shares),
        stress=_table_rows(stress, (e, q), shares),
        first=np.eye(raw.shape[1]),
        nonlinear=nonlinear,
        per=n_kept,
        lever=lever.ravel(),
        fibres=fibres,
        plies=plies,
        group=places.group,
    )


def _mean_weights(weight: Array, x: Array, kind: str) -> Array:
    """Weights (e, 1|2, q) of the points of an element (e, q) at x (e, q, 3) in the one or two means that replace them.

    Plates have one mean. Solids and lines have two, of a linear distribution at half a thickness, or length, over
    sqrt(3) to either side, along their shortest direction or along the line. With a single mean, a layer of solids in
    bending would have no strain; with two it has, and the right energy, mean^2 + variance. Lines keep the slope of
    their moments.
    """
    share = weight / weight.sum(axis=1, keepdims=True)
    if kind == "plate" or x.shape[1] == 1:
        return share[:, None]
    d = x - np.einsum("eq,eqa->ea", share, x)[:, None]
    variance, axes = np.linalg.eigh(np.einsum("eq,eqa,eqb->eab", share, d, d))
    column = 0 if kind == "solid" else 2
    along = np.einsum("eqa,ea->eq", d, axes[:, :, column]) / np.sqrt(variance[:, column, None])
    along *= np.sign(along[:, -1:] - along[:, :1]) if kind == "line" else 1.0  # in the order of the line's points
    return np.stack([share * (1.0 - along), share * (1.0 + along)], axis=1)


def _sampled_tables(block: StrainBlock) -> list[Array]:
    """Weights (e, q), elastic matrices (e|1, q|1, s, s), stresses (e|1, q|1, s) where nonlinear strain is sampled."""
    chunks = element_chunks(len(block.dofs), 100 * block.linear_map.shape[1])
    parts = [(part.weight, part.elastic, part.stress) for part in (block.sampled(chunk) for chunk in chunks)]
    return [
        arrays[0] if arrays[0].shape[0] == 1 < len(block.dofs) else np.concatenate(arrays)
        for arrays in zip(*parts, strict=True)
    ]


def _table_rows(table: Array, shape: tuple[int, ...], shares: Array | None) -> Array:
    """Rows (1|p, ...) of a table (e|1, q|1, ...): a single one if all are equal, else one per point kept."""
    if np.all(table == table[:1, :1]):
        return table[0, 0][None]
    values = np.broadcast_to(table, (*shape, *table.shape[2:]))
    if shares is not None:
        values = np.einsum("ekq,eq...->ek...", shares, values)
    return np.asarray(values.reshape(-1, *table.shape[2:]))


def beam_field(beam: UniformBeam, functions: BeamFunctions, X: Array, nonlinear: bool, following: bool) -> StrainPart:
    """The part of a beam on admissible functions times X (count, n) [kg^-1/2], with its `beam_strains`.

    Terms of fourth order in the energy are added to the four strains as further strains without names.
    """
    strains = beam_strains(beam, functions, X, following)
    s = len(strains.linear) if nonlinear else NAMED
    return StrainPart(
        kind="line",
        places=np.asarray(beam.root, float) + beam.length * strains.xi[:, None] * beam.frame[0],
        weight=strains.dx,
        rows=(strains.rows if nonlinear else strains.linear[:NAMED] @ strains.rows).astype(np.float32),
        linear=strains.linear if nonlinear else np.eye(s),
        quadratic=strains.quadratic if nonlinear else np.zeros((s, s, s)),
        elastic=strains.stiffness[:, :s, None] * np.eye(s),
        stress=np.zeros((1, s)),
        first=np.eye(X.shape[1]),
        nonlinear=nonlinear,
        per=len(strains.xi),
        lever=np.array([strains.polar]),
    )
