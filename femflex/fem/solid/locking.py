"""Warnings about solids that are too stiff: first-order cells, thin curved layers of second-order cells, and cells of
nearly incompressible materials."""

from __future__ import annotations

import warnings
from dataclasses import replace

import numpy as np

from femflex.arrays import Array, IntArray
from femflex.fem.limits import (
    ACROSS_THICKNESS,
    FEW_SOLIDS,
    LOCKING_ERROR,
    NEARLY_INCOMPRESSIBLE,
    TAPERED_SHELL,
    THIN_LAYER,
)
from femflex.fem.sections.materials import Anisotropic, Material, Orthotropic
from femflex.fem.shell.coarse import tapers
from femflex.fem.solid.blocks import Dilatation, SolidStrain
from femflex.fem.solid.rules import REDUCED
from femflex.mesh.cells import CELL_TYPES, EDGES, FACES
from femflex.mesh.quality import quadrature
from femflex.warning import PhysicsWarning

# Poisson's ratios; higher where the projection has few functions, which would make bending too soft
FULL = {
    "hexahedron": 0.35,
    "wedge": 0.45,
    "tetra": 0.45,
    "pyramid": 0.45,
}


def warn_of_first_order(name: str, x: Array, material: Material | Orthotropic | Anisotropic, group: str) -> None:
    """Warn of the bending stiffness of first-order cells with corners x (e, k, 3) [m].

    In pure bending of a brick of length a and height b the parasitic shear adds (1 - nu)/2 (a/b)^2 to 1.
    """
    edges = np.stack([np.linalg.norm(x[:, j] - x[:, i], axis=1) for i, j in EDGES[CELL_TYPES[name].shape]], axis=1)
    slenderness = float((edges.max(axis=1) / edges.min(axis=1)).max())
    nu = material.nu if isinstance(material, Material) else 0.3
    factor = 1 + (1 - nu) / 2 * slenderness**2
    warnings.warn(
        PhysicsWarning(
            "solid on group {body_or_joint!r} uses {count} {name} cells of first order, up to {slenderness:.3g} times "
            "as long as thick: one layer of them bends up to {value:.3g} times too stiffly ({limit:g} is right);",
            body_or_joint=group,
            value=factor,
            limit=1.0,
            remedy="leave out order = 1, so that they are raised to second order",
            count=len(x),
            name=name,
            slenderness=slenderness,
        ),
        stacklevel=2,
    )


def warn_of_tapered(x: Array, group: str) -> None:
    """Warn of bricks of eight nodes x (e, 8, 3) [m] with faces that taper so much that they lock in bending."""
    taper = np.max([tapers(x[:, face]) for face in FACES["hexahedron"]], axis=0)
    locked = taper > TAPERED_SHELL
    if locked.mean() <= FEW_SOLIDS:
        return
    warnings.warn(
        PhysicsWarning(
            "solid on group {body_or_joint!r}: {locked} of {count} hexahedra of eight nodes have faces that are "
            "trapezoids, and lock; one layer of the worst is up to {value:.3g} times as stiff in bending in the plane "
            "of such a face as it should be ({limit:g} is right);",
            body_or_joint=group,
            value=1 + taper.max() ** 2,
            limit=1.0,
            remedy="give order = 2, or mesh with parallelepipeds",
            locked=int(locked.sum()),
            count=len(x),
        ),
        stacklevel=3,
    )


def warn_of_curved(name: str, x: Array, group: str) -> None:
    """Warn of thin curved layers of second-order cells with nodes x (e, k, 3) [m], which bend too stiffly.

    A curved element cannot bend without stretching; the stretch grows with the rise s of its edges over their chords.
    On MacNeal and Harder's curved beam, roof, hemisphere and cylinder the missing part of the displacement is s / h, h
    the thickness: 0.02 to 0.11 where s / h is 0.02 to 0.12, 0.15 at 0.19, 0.48 at 0.49, 0.74 at 0.77.
    """
    shape, corners = CELL_TYPES[name].shape, CELL_TYPES[name].n_corners
    ends = np.array(EDGES[shape])
    chords = x[:, ends[:, 1]] - x[:, ends[:, 0]]
    lengths = np.linalg.norm(chords, axis=2)
    rise = x[:, corners : corners + len(ends)] - (x[:, ends[:, 0]] + x[:, ends[:, 1]]) / 2
    largest_rise = np.take_along_axis(rise, np.linalg.norm(rise, axis=2).argmax(axis=1)[:, None, None], axis=1)[:, 0]
    size = np.linalg.norm(largest_rise, axis=1)
    across = np.abs(np.einsum("eka,ea->ek", chords, largest_rise)) > ACROSS_THICKNESS * lengths * size[:, None]
    thickness = np.where(across, lengths, np.inf).min(axis=1)
    missing = np.where(thickness < THIN_LAYER * lengths.max(axis=1), size / thickness, 0.0)
    if np.count_nonzero(missing > LOCKING_ERROR) < max(1.0, FEW_SOLIDS * len(x)):
        return
    typical = float(np.median(missing[missing > LOCKING_ERROR]))
    remedy = "give integration = 'reduced', take" if name in REDUCED else "take"
    warnings.warn(
        PhysicsWarning(
            "solid on group {body_or_joint!r} is a thin curved layer of {name} cells: their edges rise by {rise:.2g} "
            "of the thickness over their chords, so deflections in bending are about {value:.0%} too small (limit "
            "{limit:.0%});",
            body_or_joint=group,
            value=min(typical, 0.9),
            limit=LOCKING_ERROR,
            remedy=f"{remedy} family shell, or shorten the elements (a half leaves a quarter)",
            name=name,
            rise=typical,
        ),
        stacklevel=3,
    )


def warn_of_incompressible(name: str, nodes: IntArray, C: Array, isotropic: bool, group: str) -> None:
    """Warn of cells with nodes (e, k) that are too stiff because their material is nearly incompressible.

    C (6, 6) [Pa]: its elastic matrix; the ratio is that of an isotropic material with the same bulk and mean shear
    modulus. Second-order cells of isotropic materials do not lock (`femflex.fem.solid.locking`), but a single layer of
    bricks that is clamped cannot contract across near its clamp as it should.
    """
    sound = CELL_TYPES[name].order == 2 and isotropic
    if sound and not _is_single_layer(name, nodes):
        return
    bulk, shear = C[:3, :3].sum() / 9, np.diag(C)[3:].mean()
    ratio = float((3 * bulk - 2 * shear) / (6 * bulk + 2 * shear))
    if ratio < NEARLY_INCOMPRESSIBLE:
        return
    if sound:
        effect = "are a single layer: where it is clamped, its bending frequencies are up to 4 % too high"
        remedy = "take two layers (refine = 1)"
    else:
        effect = "are too stiff then: by 14 % at 0.4999 in a thick cylinder, more where they bend"
        remedy = "take an isotropic material" if CELL_TYPES[name].order == 2 else "leave out order = 1"
    warnings.warn(
        PhysicsWarning(
            "solid on group {body_or_joint!r} hardly changes its volume (Poisson's ratio {value:.4g}, limit {limit:g}) "
            f"and its {{name}} cells {effect};",
            body_or_joint=group,
            value=ratio,
            limit=NEARLY_INCOMPRESSIBLE,
            remedy=remedy,
            name=name,
        ),
        stacklevel=2,
    )


def _is_single_layer(name: str, nodes: IntArray) -> bool:
    """Whether most cells with nodes (e, k) are hexahedra of which two opposite faces have no neighbour."""
    if CELL_TYPES[name].shape != "hexahedron":
        return False
    faces = np.array(FACES["hexahedron"])
    corners = np.sort(nodes[:, faces], axis=2).reshape(-1, faces.shape[1])
    _, which, count = np.unique(corners, axis=0, return_inverse=True, return_counts=True)
    free = (count[which.ravel()] == 1).reshape(len(nodes), len(faces))
    opposite = [(i, j) for i in range(6) for j in range(i) if not set(faces[i]) & set(faces[j])]
    return float(np.mean([free[:, i] & free[:, j] for i, j in opposite], axis=1).max()) > 0.5


# Strain of nearly incompressible solids: a part of the volumetric energy is integrated at fewer points, so that they
# do not lock.
#
# A second-order element whose volume is constrained at every point can hardly deform. The part of Lame's lambda above
# its value at a Poisson's ratio of FULL acts on the projection of the displacement gradient onto fewer functions
# (mean dilatation, T. J. R. Hughes, Int. J. Num. Meth. Engng 15 (1980) 1413): linear ones over bricks of 20 nodes,
# trilinear over those of 27, linear ones along wedges, one value elsewhere. Projecting all of lambda would make
# bending too soft: a displacement of second order, a conformal map, changes only the volume.


def with_reduced_volume_points(
    name: str, strain: SolidStrain, points: Array, material: Material | Orthotropic | Anisotropic
) -> SolidStrain:
    """Return the strain of second-order elements at points (q, 3) of the unit cell, with separate points for the volume
    if the material is isotropic and its Poisson's ratio is above FULL."""
    full = FULL[CELL_TYPES[name].shape]
    if CELL_TYPES[name].order == 1 or not isinstance(material, Material) or material.nu <= full:
        return strain
    volume_points = _volume_points(name)
    spread, basis = _trilinear(volume_points, points), _basis(name, points)
    weighted = strain.weight[:, :, None] * basis
    moments = np.matmul(weighted.swapaxes(1, 2), basis)
    project = np.matmul(_basis(name, volume_points), np.linalg.solve(moments, weighted.swapaxes(1, 2)))  # (e, m, q)
    e, q, _, k = strain.G.shape
    G = np.matmul(project, strain.G.reshape(e, q, 3 * k)).reshape(e, -1, 3, k)
    mu = material.E / 2 / (1 + material.nu)
    bulk = 2 * mu * (material.nu / (1 - 2 * material.nu) - full / (1 - 2 * full))
    linear, quadratic = np.zeros((6, 10)), np.zeros((6, 10, 10))
    linear[:, :9], quadratic[:, :9, :9] = strain.linear_map, strain.quadratic_map
    linear[:3, 9] = 3 * bulk / strain.elastic[0, 0, :3, :3].sum()  # the stress is the sum of both parts'
    dilatation = Dilatation(G, strain.weight @ spread, spread, bulk)
    return replace(strain, linear_map=linear, quadratic_map=quadratic, dilatation=dilatation)


def _volume_points(name: str) -> Array:
    """Points (m, 3) of the unit cell for the volume."""
    if CELL_TYPES[name].shape == "hexahedron":
        return quadrature("hexahedron", 2)[0]
    z = quadrature("line", 2)[0] if CELL_TYPES[name].shape == "wedge" else np.array([[0.5]])
    return np.column_stack([np.full((len(z), 2), 1 / 3), z])


def _trilinear(nodes: Array, points: Array) -> Array:
    """Values (q, m) at points (q, 3) of the functions, linear in each axis, that are 1 at one of the nodes (m, 3)."""
    axes = np.flatnonzero(np.ptp(nodes, axis=0) > 0)
    powers = np.array(list(np.ndindex(*(2,) * len(axes))))
    node_values, values = (np.prod(positions[:, None, axes] ** powers, axis=2) for positions in (nodes, points))
    return np.asarray(values @ np.linalg.inv(node_values))


def _basis(name: str, points: Array) -> Array:
    """Functions (q, p) at points (q, 3) onto which gradients are projected."""
    volume_points = _volume_points(name)
    if name == "hexahedron20":
        return np.column_stack([np.ones(len(points)), points])
    return _trilinear(volume_points, points)
