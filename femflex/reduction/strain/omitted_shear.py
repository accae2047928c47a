"""Error of frequencies of thin plate elements, which leave out transverse shear.

The shear forces of a mode follow from its moments, Q_a = M_ab,b, averaged at the nodes. Their strain energy
U_s = int Q.S^-1 Q / 2 makes its bending softer by U_b -> U_b / (1 + U_s / U_b): exact for the sines of a simply
supported plate, where U_s / U_b is D k^2 / S, w^2 = D k^4 / (rho h (1 + D k^2 / S)).

Where an edge may turn about its own normal n, the twisting moment M_nt goes to zero there over a layer of width
lambda = sqrt(D_66 / S), which thin plates replace by forces on the edge. That loses the energy lambda M_nt^2 / 2 D_66
per length: the torsion of a strip of width b is softer by 2 lambda / b, 0.63 h / b of a plain sheet (St. Venant).
"""

from __future__ import annotations

import math
import warnings
from typing import TYPE_CHECKING

import numpy as np

from femflex.arrays import Array, IntArray
from femflex.fem.assembly.conditions import edge_keys
from femflex.fem.plate.strain import PlateStrain, ThinPlates
from femflex.fem.relaxed import RelaxedStrain
from femflex.fem.structure import Structure
from femflex.mesh.cells import CELL_TYPES
from femflex.reduction.limits import JUDGED_MODES, OMITTED_SHEAR, SMOOTH_ANGLE
from femflex.reduction.modes.vibration import ModeSet
from femflex.warning import PhysicsWarning

if TYPE_CHECKING:
    from femflex.mesh import Mesh


VIBRATING = ("vibration", "free-free", "craig-bampton")  # mass-normalised shapes with a frequency
STILL = 1e-9  # of the largest rotation, below which a node does not turn


def warn_of_omitted_shear(structure: Structure, modes: ModeSet) -> None:
    """Warn where the shear that thin plates leave out lowers one of the first three frequencies by over 1.5 %."""
    thin = [block.thin for block in _thin_blocks(structure) if block.thin is not None]
    if not thin or not modes.n_modes:
        return
    errors, which = frequency_errors(structure, modes)
    if np.round(errors, 3).max(initial=0.0) <= OMITTED_SHEAR:
        return
    hertz = modes.omega[which] / (2 * math.pi)
    text = ", ".join(f"{f:.4g} Hz by {error:.1%}" for f, error in zip(hertz, errors, strict=True))
    where = ", ".join(dict.fromkeys(plates.where for plates in thin))
    remedy = " and ".join(dict.fromkeys(plates.remedy for plates in thin))
    warnings.warn(
        PhysicsWarning(
            "{body_or_joint}: the elements leave out transverse shear, which makes frequencies too high, by an "
            "estimate from the modes' own shear forces: {frequencies}; the limit is {limit:.1%}.",
            body_or_joint=where,
            value=float(errors.max()),
            limit=OMITTED_SHEAR,
            remedy=f"For thick and sandwich plates {remedy}",
            frequencies=text,
        ),
        stacklevel=3,
    )


def frequency_errors(structure: Structure, modes: ModeSet, first: int = JUDGED_MODES) -> tuple[Array, IntArray]:
    """Relative error (n,) [1] by which frequencies of the first vibration modes are too high without shear, and the
    numbers (n,) of these modes in the set."""
    vibrating = [k for k, kind in enumerate(modes.kinds) if kind in VIBRATING and modes.omega[k] > 0]
    which = np.array(sorted(vibrating, key=lambda k: modes.omega[k])[:first], np.int64)
    shapes = modes.phi[:, which]
    squared = modes.omega[which] ** 2
    true = squared.copy()
    for block in _thin_blocks(structure):
        bending, shear = _energies(structure, block, shapes)
        ratio = shear / np.where(bending > 0, bending, 1.0)
        true -= 2 * bending * ratio / (1 + ratio)
    return np.sqrt(squared / np.maximum(true, 1e-6 * squared)) - 1, which


def _thin_blocks(structure: Structure) -> list[PlateStrain]:
    """The structure's blocks of plates that leave out shear."""
    blocks = [block.block if isinstance(block, RelaxedStrain) else block for block in structure.strain]
    return [block for block in blocks if isinstance(block, PlateStrain) and block.thin is not None]


def _energies(structure: Structure, block: PlateStrain, shapes: Array) -> tuple[Array, Array]:
    """Bending energy (n,) of each shape (n_dof, n), and that of the shear left out."""
    plates = block.thin
    assert plates is not None
    phi = structure.T @ shapes
    kappa = block.gradients(phi, slice(None))[:, :, 6:9]
    bending = np.einsum("eq,eqin,eqin->n", block.weight, kappa, np.matmul(block.elastic[:, :, 3:6, 3:6], kappa)) / 2
    M = _node_averaged(plates, block.corner_moments(phi))
    Q = np.einsum("ebc,ecabn->ean", plates.dN, M)
    shear = np.einsum("e,ean,ean->n", plates.area, Q, np.matmul(np.linalg.inv(plates.S), Q)) / 2
    return bending, shear + _edge_energy(structure, block, shapes, M)


def _node_averaged(plates: ThinPlates, moments: Array) -> Array:
    """Moments (e, c, 2, 2, n) in the elements' axes, averaged at the nodes of a smooth surface, from those (e, c, 3, n)
    of the elements at their corners."""
    e, c, _, n = moments.shape
    axes = np.broadcast_to(plates.axes, (e, 3, 3))
    plane = moments[:, :, [0, 2, 2, 1]].reshape(e, c, 2, 2, n)
    space = np.einsum("eai,ecabn,ebj->ecijn", axes[:, :2], plane, axes[:, :2])
    places = _places(plates.corners, axes[:, 2])
    total = np.zeros((places.max() + 1, 3, 3, n))
    np.add.at(total, places, space * plates.area[:, None, None, None, None])
    weight = np.zeros(len(total))
    np.add.at(weight, places, np.broadcast_to(plates.area[:, None], places.shape))
    mean = total / weight[:, None, None, None]
    return np.einsum("eai,ecijn,ebj->ecabn", axes[:, :2], mean[places], axes[:, :2])


def _places(corners: IntArray, normals: Array) -> IntArray:
    """Numbers (e, c) of corners, equal for corners at one node on facets, of normals (e, 3), of one smooth surface."""
    nodes, normal = corners.ravel(), np.repeat(normals, corners.shape[1], axis=0)
    found = np.full(len(nodes), -1, np.int64)
    n = 0
    while (found < 0).any():  # as often as there are surfaces at a node
        rest = np.flatnonzero(found < 0)
        _, first, which = np.unique(nodes[rest], return_index=True, return_inverse=True)
        like = np.linalg.norm(np.cross(normal[rest], normal[rest][first][which]), axis=1) < SMOOTH_ANGLE
        found[rest[like]] = n + which[like]
        n += len(first)
    return found.reshape(corners.shape)


def _edge_energy(structure: Structure, block: PlateStrain, shapes: Array, M: Array) -> Array:
    """Energy (n,) lost in the layers along edges that may turn about their normals, M (e, c, 2, 2, n)."""
    plates = block.thin
    assert plates is not None
    c = plates.corners.shape[1]
    after = np.roll(plates.corners, -1, axis=1)
    keys = edge_keys(plates.corners, after, len(structure.mesh.points))
    element, side = np.nonzero(np.isin(keys, _outer_edges(structure.mesh)))
    ends = np.stack([plates.corners[element, side], after[element, side]], axis=1)
    span = structure.mesh.points[ends[:, 1]] - structure.mesh.points[ends[:, 0]]
    length = np.linalg.norm(span, axis=1)
    axes = np.broadcast_to(plates.axes, (len(plates.corners), 3, 3))[element]
    t = np.einsum("kai,ki->ka", axes[:, :2], span) / length[:, None]
    normal = np.stack([t[:, 1], -t[:, 0]], axis=1)
    mean = (M[element, side] + M[element, (side + 1) % c]) / 2
    twist = np.einsum("ka,kabn,kb->kn", normal, mean, t)
    D, S = (
        np.broadcast_to(part, (len(plates.corners), *part.shape[1:]))[element] for part in (block.elastic, plates.S)
    )
    D66, shear = D[:, 0, 5, 5], 1 / np.einsum("ka,kab,kb->k", normal, np.linalg.inv(S), normal)
    turned = (structure.rotation @ shapes).reshape(-1, 3, shapes.shape[1])
    about = np.abs(np.einsum("kmin,kbi,kb->kmn", turned[ends], axes[:, :2], normal)).max(axis=1)
    free = about > STILL * np.abs(turned).max(axis=(0, 1), initial=0.0)
    return np.einsum("k,kn->n", length * np.sqrt(D66 / shear) / D66, np.where(free, twist, 0.0) ** 2) / 2


def _outer_edges(mesh: Mesh) -> IntArray:
    """Keys of the edges on which one surface cell alone lies."""
    keys = [np.zeros(0, np.int64)]
    for name, cells in mesh.cells.items():
        if CELL_TYPES[name].dimension == 2:
            corners = cells[:, : CELL_TYPES[name].n_corners]
            keys.append(edge_keys(corners, np.roll(corners, -1, axis=1), len(mesh.points)).ravel())
    found, count = np.unique(np.concatenate(keys), return_counts=True)
    return np.asarray(found[count == 1])
