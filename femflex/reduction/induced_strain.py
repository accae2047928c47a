"""Forces of induced strain on the coordinates of a meshed body: `InducedStrain` over the patches of groups.

The strain deforms the structure statically, with the supports of its set. What stress is left changes the stiffness of
a body of linear strain: bowing of a heated member that is held at both ends, tension of a blanket between warm booms.
Where strain is not linear, the coordinates that take part in the deformation change the stiffness by V2, so that only
the stress beside their part of the deformation counts.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np
from scipy.spatial import cKDTree

from femflex.arrays import Array, IntArray
from femflex.body import FlexibleBody, InducedStrain, Patches
from femflex.body.induced_strain import LINES, SURFACES, patch_axes, unit_strains
from femflex.body.strain_field import NAMES, StrainPart
from femflex.fem.family import StrainPlaces
from femflex.fem.structure import Structure
from femflex.fem.tables import StrainBlock
from femflex.mesh.cells import CELL_TYPES
from femflex.reduction.beams.strain_points import strain_field
from femflex.reduction.boundary.patches import add_patches
from femflex.reduction.modes.vibration import ModeSet, static_response

SAME = 1e-6  # of the extent: distance of the centre of an element from that of its cell, beyond that of other cells
RELAXED = 1e-6  # of the stress of a strain that is held: a smaller remainder is rounding
FREE = -1  # patch of elements that are not in the group


def with_induced_strains(
    structure: Structure, modes: ModeSet, body: FlexibleBody, groups: Sequence[str], coordinates: IntArray
) -> FlexibleBody:
    """The body with the forces of strain that is induced in these groups, of which it has patches.

    coordinates: numbers (n,) among the set of the body's elastic coordinates.
    Raises ValueError for a group without lines or plates whose strain is known.
    """
    return replace(body, induced={g: _induced_strain(structure, modes, body, g, coordinates) for g in groups})


def loads_of_induced_strain(structure: Structure, group: str) -> Array:
    """Loads (n_dof, c) of unit components of strain over a whole group (`InducedStrain`)."""
    patches = add_patches(structure, np.zeros((structure.n_dof, 0)), [group], False)[0][group]
    components = len(LINES if patches.dimension == 1 else SURFACES)
    loads = _loads(structure, patches, group)[0]
    return loads.reshape(len(loads), -1, components).sum(axis=1)


def _induced_strain(
    structure: Structure, modes: ModeSet, body: FlexibleBody, group: str, coordinates: IntArray
) -> InducedStrain:
    patches = body.patches[group]
    components = LINES if patches.dimension == 1 else SURFACES
    F, stiffness = _loads(structure, patches, group)
    response, phi, n = static_response(structure, modes, F), modes.phi[:, coordinates], body.n_modes
    linear = body.strain_form == "linear"
    if not linear and n:
        response = response - phi @ np.linalg.solve(phi.T @ (structure.K @ phi), phi.T @ F)
    parts = strain_field(structure, phi, True) if linear else body.strain_field
    V1 = np.zeros((F.shape[1], n, n))
    if n:
        strains = _field_strains(structure, patches)
        for part, of_response, strain in zip(parts, strain_field(structure, response, True), strains, strict=True):
            held = np.matmul(np.broadcast_to(part.elastic, (len(strain), *part.elastic.shape[1:])), strain)
            stress = _stress_of(part, of_response) - held
            unit = np.sqrt(np.abs(np.einsum("...ii->...i", part.elastic)))[..., None]  # stresses over it are comparable
            largest = np.abs(np.divide(held, unit, out=np.zeros_like(held), where=unit > 0.0)).max(axis=(0, 1))
            remaining = np.where(np.abs(stress) > RELAXED * unit * largest, stress, 0.0)
            V1 += stiffness_of_stress(part, remaining, n, body.slaves)
    k, c = len(patches.size), len(components)
    return InducedStrain(
        components,
        patch_axes(patches.dimension, patches.normal),
        f0=-(F.T @ phi).reshape(k, c, n),
        V1=V1.reshape(k, c, n, n),
        stiffness=stiffness.reshape(k, c) / patches.size[:, None],
    )


def stiffness_of_stress(part: StrainPart, stress: Array, n: int, slaves: Array) -> Array:
    """Stiffness (k, n, n) [N/m by its shapes] of stress states (p, s, k) in a part of a strain field.

    n: number of its first shapes, on which it acts; slaves: A_s of those behind them (`FlexibleBody`)
    """
    weighted = stress * part.weight[:, None, None]
    rows = part.rows.astype(float)
    first = rows @ part.first[:, :n]
    second = 2.0 * rows[:, :, :n] - first  # products of two amplitudes of second order are left out, as in the energy
    k = stress.shape[2]
    out = np.zeros((k, n * n))
    for s, i, j in zip(*np.nonzero(part.quadratic), strict=True):
        products = (first[:, i, :, None] * second[:, j, None, :]).reshape(len(rows), -1)
        out += part.quadratic[s, i, j] * (weighted[:, s].T @ products)
    V1 = out.reshape(k, n, n)
    if len(slaves) and rows.shape[2] > n:
        along = np.einsum("psk,sg,pgj->kj", weighted, part.linear, rows[:, :, n:], optimize=True)
        V1 = V1 + np.einsum("kj,jab->kab", along, slaves)
    return np.asarray((V1 + V1.swapaxes(1, 2)) / 2)


def _stress_of(part: StrainPart, response: StrainPart) -> Array:
    """Stress (p, s, k) of displacements k whose gradients are the rows of `response`, linear in them."""
    strain = part.linear @ response.rows.astype(float)
    return np.asarray(np.matmul(np.broadcast_to(part.elastic, (len(strain), *part.elastic.shape[1:])), strain))


def _loads(structure: Structure, patches: Patches, group: str) -> tuple[Array, Array]:
    """Loads (n_dof, k c) of unit strains over each patch, and the stiffness (k c,) against each, times the size."""
    c, k = len(LINES if patches.dimension == 1 else SURFACES), len(patches.size)
    kind = "line" if patches.dimension == 1 else "plate"
    raw, stiffness = np.zeros((structure.T.shape[0], k * c)), np.zeros(k * c)
    found = False
    for block, places in _blocks_with_places(structure):
        q = block.weight.shape[1]
        patch = _patch_of_elements(structure, places.x, patches) if places.kind == kind else np.array([FREE])
        chosen = np.flatnonzero(patch != FREE)
        found = found or len(chosen) > 0
        for element in chosen:
            e = slice(int(element), int(element) + 1)
            strain = _unit_strain(places, block, int(element), patches, int(patch[element]))  # c s
            C = np.broadcast_to(block.elastic, (len(block.dofs), q, *block.elastic.shape[2:]))[element]
            stress = np.einsum("q,qst,ct->qsc", block.weight[element], C, strain)
            force = np.einsum("qgl,sg,qsc->lc", block.rows(e)[0], block.linear_map, stress, optimize=True)
            columns = patch[element] * c + np.arange(c)
            np.add.at(raw, (block.dofs[element][:, None], columns[None]), force)
            stiffness[columns] += np.einsum("qsc,cs->c", stress, strain)
    if not found:
        raise ValueError(
            f"group {group!r} has no lines or plates whose strain is known; induced strain is that of beams, rods, "
            "tethers, membranes, plates and shells"
        )
    return np.asarray(structure.T.T @ raw), stiffness


def _field_strains(structure: Structure, patches: Patches) -> list[Array]:
    """For every part of the strain field the unit strains (p, s, k c) at its points."""
    c, k = len(LINES if patches.dimension == 1 else SURFACES), len(patches.size)
    kind = "line" if patches.dimension == 1 else "plate"
    out = []
    for (block, places), part in zip(
        _blocks_with_places(structure), strain_field(structure, np.zeros((structure.n_dof, 1)), True), strict=True
    ):
        strain = np.zeros((len(part.places), len(part.linear), k * c))
        if places.kind == kind:
            patch = _patch_of_elements(structure, places.x, patches)
            for element in np.flatnonzero(patch != FREE):
                unit = _unit_strain(places, block, int(element), patches, int(patch[element]))
                rows = slice(part.per * element, part.per * (element + 1))
                strain[rows, : unit.shape[1], patch[element] * c : (patch[element] + 1) * c] = unit.T
        out.append(strain)
    return out


def _blocks_with_places(structure: Structure) -> Iterable[tuple[StrainBlock, StrainPlaces]]:
    return [(b, p) for b, p in zip(structure.strain, structure.places, strict=True) if p is not None]


def _unit_strain(places: StrainPlaces, block: StrainBlock, element: int, patches: Patches, patch: int) -> Array:
    """Strains (c, s) of unit components in an element, uniform in it."""
    axes = np.eye(3)[None] if places.axes is None else places.axes[min(element, len(places.axes) - 1)][None]
    own = patch_axes(patches.dimension, patches.normal[patch : patch + 1])
    names = NAMES[places.kind][: len(block.linear_map)]
    return unit_strains(places.kind, names, own, axes)[0]


def _patch_of_elements(structure: Structure, x: Array, patches: Patches) -> IntArray:
    """Number (e,) of the patch of each element with points x (e, q, 3), FREE for those outside the group."""
    mesh = structure.mesh
    cells = [mesh.points[nodes[:, : CELL_TYPES[kind].n_corners]].mean(axis=1) for kind, nodes in mesh.cells.items()
             if CELL_TYPES[kind].dimension == patches.dimension]  # fmt: skip
    centres = [_centres(outlines, patches.dimension) for outlines in patches.outlines]
    number = np.repeat(np.arange(len(centres)), [len(rows) for rows in centres])
    middle = x.mean(axis=1)
    distance, nearest = cKDTree(np.concatenate(centres)).query(middle)
    least = cKDTree(np.concatenate(cells)).query(middle)[0]
    extent = float(np.ptp(mesh.points, axis=0).max())
    return np.where(distance <= least + SAME * extent, number[nearest], FREE)


def _centres(outlines: Array, dimension: int) -> Array:
    """Centres (c, 3) of cells with these corners (c, 4, 3)."""
    if dimension == 1:
        return np.asarray(outlines[:, :2].mean(axis=1))
    triangles = np.all(outlines[:, 3] == outlines[:, 2], axis=1)
    return np.where(triangles[:, None], outlines[:, :3].mean(axis=1), outlines.mean(axis=1))
