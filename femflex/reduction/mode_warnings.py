"""Warnings of modes that elements represent badly: omitted shear, folds, turns in a plane, few elements in a wave.

Thin plate elements leave out transverse shear. The shear forces of a mode follow from its moments, Q_a = M_ab,b,
averaged at the nodes. Their strain energy U_s = int Q.S^-1 Q / 2 makes its bending softer by U_b -> U_b / (1 + U_s /
U_b): exact for the sines of a simply supported plate, where U_s / U_b is D k^2 / S, w^2 = D k^4 / (rho h (1 + D k^2 /
S)).

Where an edge may turn about its own normal n, the twisting moment M_nt goes to zero there over a layer of width
lambda = sqrt(D_66 / S), which thin plates replace by forces on the edge. That loses the energy lambda M_nt^2 / 2 D_66
per length: the torsion of a strip of width b is softer by 2 lambda / b, 0.63 h / b of a plain sheet (St. Venant).
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from femflex.arrays import Array, IntArray
from femflex.fem.assembly.conditions import edge_keys
from femflex.fem.beam.strain import corner_nodes
from femflex.fem.deflected import RelaxedStrain
from femflex.fem.family import HALF_WAVES
from femflex.fem.plate.strain import PlateStrain, ThinPlates
from femflex.fem.structure import Structure
from femflex.fem.tables import element_chunks
from femflex.fem.tension.strain import TensionStrain
from femflex.mesh.cells import CELL_TYPES, EDGES
from femflex.reduction.limits import (
    FEW_OF_A_KIND,
    FOLD_ANGLE,
    IN_PLANE_TURN,
    JUDGED_MODES,
    OMITTED_SHEAR,
    SLENDER_BRICK,
    SLENDER_FRAME,
    SMOOTH_ANGLE,
)
from femflex.reduction.modes.vibration import ModeSet
from femflex.warning import warn_of_physics

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
    warn_of_physics(
        "{body_or_joint}: the elements leave out transverse shear, which makes frequencies too high, by an "
        "estimate from the modes' own shear forces: {frequencies}; the limit is {limit:.1%}.",
        body_or_joint=where,
        value=float(errors.max()),
        limit=OMITTED_SHEAR,
        remedy=f"For thick and sandwich plates {remedy}",
        frequencies=text,
    )


def frequency_errors(structure: Structure, modes: ModeSet) -> tuple[Array, IntArray]:
    """Relative error (n,) [1] by which frequencies of the first vibration modes are too high without shear, and the
    numbers (n,) of these modes in the set."""
    vibrating = [k for k, kind in enumerate(modes.kinds) if kind in VIBRATING and modes.omega[k] > 0]
    which = np.array(sorted(vibrating, key=lambda k: modes.omega[k])[:JUDGED_MODES], np.int64)
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


# Warning where slender beams that meet at an angle keep so many coordinates that condensed strain may lock.
#
# A leg that bends pulls the next one in by its foreshortening. If many coordinates are kept, some of them take part in
# this by bending of fast modes, which the dependent shapes compensate to second order only (`condense.carried_along`).
# The remainder grows with the square of the slenderness. At a slenderness of 1000 an L-frame bent in its plane by 7 %
# of its size is within 0.4 % of the full finite-element model with 4 modes, and in error by 7 % and more with 12 to 18;
# at 100 it is within 0.2 % with any number.


COORDINATES = 8  # kept in addition to the dependent ones


def warn_of_folded_beams(structure: Structure, coordinates: int) -> None:
    """Warn of a condensed body whose slender beams meet at an angle and that keeps more than COORDINATES of them."""
    if coordinates <= COORDINATES or not len(corner_nodes(structure.mesh, structure.numbering.members, FOLD_ANGLE)):
        return
    slenderness = beam_slenderness(structure)
    if slenderness <= SLENDER_FRAME:
        return
    warn_of_physics(
        "slender beams that meet at an angle, length over radius of gyration "
        f"{slenderness:.4g} (limit {SLENDER_FRAME:g}), with condensed strain and {coordinates} coordinates (limit "
        f"{COORDINATES}): the body may be too stiff where it bends in the plane of the angle. Keep fewer modes, or use "
        "strain = 'nonlinear' or segments"
    )


def beam_slenderness(structure: Structure) -> float:
    """Length of all beams over the least radius of gyration in bending, sqrt(EI / EA)."""
    length, least = 0.0, math.inf
    for block, places in zip(structure.strain, structure.places, strict=True):
        bends = len(block.linear_map) > 1 and not isinstance(block, TensionStrain)  # no rod, no tether
        if places is not None and places.kind == "line" and bends:
            part = block.sampled(slice(None))
            length += float(part.weight.sum())
            EA, EI = part.elastic[..., 0, 0], (part.elastic[..., 1, 1], part.elastic[..., 2, 2])
            least = min(least, *(float((one / EA).min()) for one in EI))
    return length / math.sqrt(least) if 0 < least < math.inf else 0.0


# Folded and tubular plates whose facets turn in their own planes, which plates' second-order strain leaves out.
#
# Von Karman's membrane strains have the squares of w,x and w,y alone. A web that sways in its own plane turns about its
# normal by r = (v,x - u,y) / 2; the work of its membrane forces on r^2 / 2 is missing, and with it that part of what
# loads and spin stiffen or soften. For a square box column this is half: its Euler load would be twice too high.


def warn_of_in_plane_turns(structure: Structure, modes: ModeSet) -> None:
    """Warn where plates of a body with nonlinear or condensed strain turn in their own planes in its first modes."""
    vibrating = [k for k, kind in enumerate(modes.kinds) if kind in VIBRATING and modes.omega[k] > 0]
    which = sorted(vibrating, key=lambda k: modes.omega[k])[:JUDGED_MODES]
    parts = in_plane_parts(structure, modes.phi[:, which])
    if parts.max(initial=0.0) <= IN_PLANE_TURN:
        return
    hertz = modes.omega[which] / (2 * math.pi)
    text = ", ".join(f"{part:.0%} at {f:.4g} Hz" for f, part in zip(hertz, parts, strict=True))
    warn_of_physics(
        "plates turn in their own planes (webs of boxes, walls of tubes), and their nonlinear strain omits the "
        f"squares of these rotations. Missing parts of the geometric stiffness: {text} (limit "
        f"{IN_PLANE_TURN:.0%}; a box column buckles at twice its load). Use shells, beams or solids, or segments with "
        "linear strain"
    )


def in_plane_parts(structure: Structure, shapes: Array) -> Array:
    """Part (n,) of the squared slopes of plates in each shape (n_dof, n) that is rotation about their normals."""
    phi = structure.T @ shapes
    turning, slopes = np.zeros(phi.shape[1]), np.zeros(phi.shape[1])
    for given in structure.strain:
        block = given.block if isinstance(given, RelaxedStrain) else given
        if not isinstance(block, PlateStrain):
            continue
        for elements in element_chunks(len(block.weight), block.weight.shape[1] * 12 * max(1, phi.shape[1])):
            g, weight = block.gradients(phi, elements, 6), block.weight[elements]
            turning += np.einsum("eq,eqn->n", weight, ((g[:, :, 2] - g[:, :, 1]) / 2) ** 2)
            slopes += np.einsum("eq,eqin->n", weight, g[:, :, 4:6] ** 2)
    total = turning + slopes
    return np.asarray(turning / np.where(total > 0, total, 1.0))


# Number of elements in a half-wave of each mode, and a warning if it is too small for 2 % of the frequency.
#
# A wave of number k has n = pi / (k h) elements of length h in its half. In surfaces that bend, k^4 = mean kappa^2 /
# mean |u|^2 of the curvature kappa along the edges; n^-4 is the sum over both directions. Where a family has cells of
# several types, kappa is that of one type, and u that of all. In solids the ends u_1, u_2 of edges have mean |u_2 -
# u_1|^2 = 4 sin^2(k h / 2) mean |u|^2; n is that of the direction with fewest.
#
# Frequencies of four-node shells are 0.8 / n^2 to 1.1 / n^2 too high. Bricks of eight nodes and thickness t resist
# twist and double curvature besides, by a factor of 1 + (h / 5 t)^2. The numbers for other elements were found on
# cantilever plates. Three-node shells need 10 in bending, and 12 to 16 in twist, most where all squares are cut along
# one diagonal.


# Pairs of edges of a cell that run alike, for directions; of cells without such pairs all edges count as one.
DIRECTIONS = {
    "quad": [[0, 2], [1, 3]],
    "hexahedron": [[0, 2, 4, 6], [1, 3, 5, 7], [8, 9, 10, 11]],
    "wedge": [[0, 1, 2, 3, 4, 5], [6, 7, 8]],
}
FEW = 8  # modes that a line lists
MANY = 99  # elements in a half-wave above which the number has no meaning: a surface that hardly bends


def half_wave_text(structure: Structure, modes: ModeSet) -> str:
    """A line on the elements in a half-wave of each vibration mode; empty where no family has a known need."""
    found = _fewest(structure, modes)
    if found is None:
        return ""
    name, needed, fewest, _ = found
    listed = ", ".join(f"{n:.2g}" if n < MANY else f">{MANY}" for n in fewest[:FEW]) + ", ..." * (len(fewest) > FEW)
    return f"elements in a half-wave of each mode: {listed}; {name} need {needed:.2g} for 2 % of a frequency"


def warn_of_few_elements(structure: Structure, modes: ModeSet) -> None:
    """Warn of vibration modes whose half-waves have fewer elements than their family needs for 2 % of the frequency."""
    found = _fewest(structure, modes)
    if found is None:
        return
    name, needed, fewest, which = found
    coarse = np.flatnonzero(fewest < needed)
    if not len(coarse):
        return
    worst = int(coarse[np.argmin(fewest[coarse])])
    hertz = modes.omega[which] / (2 * np.pi)
    warn_of_physics(
        "{body_or_joint}: {count} of {all} modes have fewer elements in a half-wave than {limit:.2g}, which these "
        "need for 2 % of a frequency: the first is mode {first} at {hertz:.4g} Hz with {own:.2g}, the fewest are "
        "{value:.2g}, and frequencies are too high by about {error:.0%} there.",
        body_or_joint=name,
        value=float(fewest[worst]),
        limit=needed,
        remedy="Mesh finer (refine = 1 halves the elements), take elements of second order, or keep fewer modes",
        count=len(coarse),
        all=len(fewest),
        first=int(which[coarse[0]]) + 1,
        hertz=float(hertz[coarse[0]]),
        own=float(fewest[coarse[0]]),
        error=float(min(0.02 * (needed / fewest[worst]) ** 2, 1.0)),
    )


def _fewest(structure: Structure, modes: ModeSet) -> tuple[str, float, Array, IntArray] | None:
    """Name of the elements that resolve the modes worst, the number that they need, those (n,) in a half-wave of each
    vibration mode, and which modes of the set these are."""
    which = np.array([k for k, kind in enumerate(modes.kinds) if kind in VIBRATING and modes.omega[k] > 0], np.int64)
    if not which.size:
        return None
    cells: dict[tuple[str, str], list[IntArray]] = {}
    for member in structure.numbering.members:
        if member.group not in structure.mesh.cell_groups:  # nodes of a deck that only springs and masses join
            continue
        for kind, nodes in structure.mesh.group_cells(member.group).items():
            cells.setdefault((member.family, kind), []).append(nodes)
    count = sum(len(nodes) for several in cells.values() for nodes in several)
    phi, x = modes.phi[:, which], structure.mesh.points
    u, theta = ((rows @ phi).reshape(-1, 3, len(which)) for rows in (structure.translation, structure.rotation))
    found: list[tuple[str, float, Array]] = []
    for (family, kind), several in cells.items():
        nodes = np.concatenate(several)
        if (family, kind) in HALF_WAVES and len(nodes) >= FEW_OF_A_KIND * count:
            turns = None if family == "solid" else theta
            needed = HALF_WAVES[family, kind] * (_slenderness(structure, nodes) if kind == "hexahedron" else 1.0)
            corners = [
                part[:, : CELL_TYPES[other].n_corners].ravel()
                for (of, other), parts in cells.items()
                for part in parts
                if of == family
            ]
            size = (u[np.concatenate(corners)] ** 2).mean(axis=0).sum(axis=0)
            found.append(
                (f"{family} elements of type {kind}", needed, elements_per_half_wave(kind, nodes, x, u, turns, size))
            )
    if not found:
        return None
    return *min(found, key=lambda one: (one[2] / one[1]).min()), which


def elements_per_half_wave(kind: str, nodes: IntArray, x: Array, u: Array, theta: Array | None, size: Array) -> Array:
    """Elements (n,) [1] with nodes (e, k) at x (n_p, 3) in a half-wave of displacements u (n_p, 3, n) [m].

    theta: rotations (n_p, 3, n) of surfaces, or None. size: mean (n,) of |u|^2 [m^2].
    """
    edges = np.array(EDGES[CELL_TYPES[kind].shape])
    size = np.where(size > 0, size, 1.0)
    waves = []  # k h / pi of each direction
    for which in DIRECTIONS.get(CELL_TYPES[kind].shape, [list(range(len(edges)))]):
        first, last = nodes[:, edges[which, 0]], nodes[:, edges[which, 1]]
        span = (x[last] - x[first])[..., None]
        if theta is None:
            step = ((u[last] - u[first]) ** 2).mean(axis=(0, 1)).sum(axis=0)
            waves.append(2 / np.pi * np.arcsin(np.sqrt(np.clip(step / size / 4, 0.0, 1.0))))
        else:
            bent = np.cross(theta[last] - theta[first], span, axis=2)  # kappa h^2
            waves.append(((bent**2).mean(axis=(0, 1)).sum(axis=0) / size) ** 0.25 / np.pi)
    each = np.array(waves)
    most = each.max(axis=0) if theta is None else (each**4).sum(axis=0) ** 0.25
    return np.asarray(1 / np.maximum(most, 1e-9))


def _slenderness(structure: Structure, nodes: IntArray) -> float:
    """Factor on the number of bricks (e, 8) that a half-wave needs, from the middle one of their slendernesses."""
    ends = structure.mesh.points[nodes[:, np.array(EDGES["hexahedron"])]]
    length = np.linalg.norm(ends[:, :, 1] - ends[:, :, 0], axis=2)
    return float(np.sqrt(1 + (np.median(length.max(axis=1) / length.min(axis=1)) / SLENDER_BRICK) ** 2))
