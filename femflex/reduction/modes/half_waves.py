"""Number of elements in a half-wave of each mode, and a warning if it is too small for 2 % of the frequency.

A wave of number k has n = pi / (k h) elements of length h in its half. In surfaces that bend, k^4 = mean kappa^2 / mean
|u|^2 of the curvature kappa along the edges; n^-4 is the sum over both directions. Where a family has cells of several
types, kappa is that of one type, and u that of all. In solids the ends u_1, u_2 of edges
have mean |u_2 - u_1|^2 = 4 sin^2(k h / 2) mean |u|^2; n is that of the direction with fewest.

Frequencies of four-node shells are 0.8 / n^2 to 1.1 / n^2 too high. Bricks of eight nodes and thickness t resist twist
and double curvature besides, by a factor of 1 + (h / 5 t)^2. The numbers for other elements were found on cantilever
plates. Three-node shells need 10 in bending, and 12 to 16 in twist, most where all squares are cut along one diagonal.
"""

from __future__ import annotations

import warnings

import numpy as np

from femflex.arrays import Array, IntArray
from femflex.fem.family import HALF_WAVES
from femflex.fem.structure import Structure
from femflex.mesh.cells import CELL_TYPES, EDGES
from femflex.reduction.limits import FEW_OF_A_KIND, SLENDER_BRICK
from femflex.reduction.modes.vibration import ModeSet
from femflex.warning import PhysicsWarning

# Pairs of edges of a cell that run alike, for directions; of cells without such pairs all edges count as one.
DIRECTIONS = {
    "quad": [[0, 2], [1, 3]],
    "hexahedron": [[0, 2, 4, 6], [1, 3, 5, 7], [8, 9, 10, 11]],
    "wedge": [[0, 1, 2, 3, 4, 5], [6, 7, 8]],
}
FEW = 8  # modes that a line lists
MANY = 99  # elements in a half-wave above which the number has no meaning: a surface that hardly bends
VIBRATING = ("vibration", "free-free", "craig-bampton")


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
    warnings.warn(
        PhysicsWarning(
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
        ),
        stacklevel=3,
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
