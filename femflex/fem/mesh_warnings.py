"""Warnings of meshes on which members are inaccurate: coarse, curved or tapered cells, and cells of first order.

On the pinched cylinder (docs/howto/elements.md) four-node shells of length s sqrt(R h) are 1 + 0.08 s^2 times as stiff
as the shell. The first four frequencies of a clamped cylindrical panel (R / h = 400) are within 1 % at s = 2 and 2 to
20 % too low at s = 4.

In its plane a trapezoid of aspect ratio a whose ends lean by an angle delta each is 1 + (a tan delta)^2 times as stiff
in bending as the strip: 26 for MacNeal and Harder's straight beam of trapezoids, where 19 is found
(R. H. MacNeal, Finite Elements in Analysis and Design 3 (1987) 175).
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from femflex.arrays import Array, IntArray
from femflex.fem.line.chain import arc_excess
from femflex.fem.sections.materials import Anisotropic, Material, Orthotropic
from femflex.fem.shell.surface import normals_at_nodes
from femflex.fem.solid.blocks import REDUCED
from femflex.mesh.cells import CELL_TYPES, EDGES, FACES
from femflex.mesh.mesh import Mesh
from femflex.warning import warn_of_physics

# Locking of solids
ACROSS_THICKNESS = 0.7  # cosine to the rise of other edges, above which an edge goes through the thickness
THIN_LAYER = 0.25  # thickness over the longest edge, below which an element belongs to a thin layer
FEW_SOLIDS = 0.2  # of the elements; fewer curved ones count as fillets
LOCKING_ERROR = 0.05  # estimated error above which a warning is given
# Poisson's ratio above which the volume constraint at all points of strain costs over 1 % of a deflection
NEARLY_INCOMPRESSIBLE = 0.49

# Solids
# Largest distance of a middle node from the mean of its corners, over the distance of these from it
MISPLACED_NODE = 0.5

# Beams
CURVED_CELL = 5e-3  # relative length that chords of curved cells may lack: an arc of 39 deg in two of them
SLENDER_BEAM = 20.0  # length over radius of gyration below which neglected shear shifts the first mode by over 1 %

# Axes of sections
UNLIKE_STIFFNESSES = 0.01  # relative difference of the two bending stiffnesses above which the axes of a section matter
# Sine of the angle to the mesh's z axis below which the selected axes depend strongly on the direction
UPRIGHT_AXIS = 0.2

# Shells
WARPED_SHELL = 15.0  # [deg] between the normals at two corners of a four-node element, above which a warning is given
FOLDED_SHELL = 120.0  # [deg] above which such an element is an error: its sides cross
# Of the area in three-node triangles (constant membrane strain), above which a warning is given
CONSTANT_STRAIN_SHARE = 0.2

# Coarse shells
# Of sqrt(R h): length of four-node elements above which they are 18 % too stiff at loads and edges
LONG_LINEAR_SHELL = 1.5
# Of sqrt(R h): length of second-order elements above which low modes of a thin dish are over 10 % too high
LONG_SHELL = 16.0
SHELL_STIFFNESS_ERROR = 0.08  # of s^2: coefficient of the relative error in stiffness, as above
TAPERED_SHELL = 1.0  # a tan(delta) above which trapezoids are over twice as stiff as they should be in their plane
FEW_SHELLS = 0.2  # share of the elements above which trapezoids cause a warning, because most meshes have some


STRAIGHT = 1e-4  # distance of a middle node from the straight side, over its length, that passes for rounding


def warn_if_coarse(x: Array, V: Array, thickness: Array, where: str) -> None:
    """Warn of elements with nodes x (e, k, 3) [m], directors V (e, k, 3) and thicknesses (e,) [m] that are long against
    sqrt(R h): k = 4 above LONG_LINEAR_SHELL, nine and six nodes above LONG_SHELL."""
    sides = 3 if x.shape[1] == 6 else 4
    corners, corner_directors = x[:, :sides], V[:, :sides]
    edge, director_change = (
        np.roll(corners, -1, axis=1) - corners,
        np.roll(corner_directors, -1, axis=1) - corner_directors,
    )
    square = np.sum(edge * edge, axis=2)
    curvature = np.abs(np.sum(edge * director_change, axis=2) / square).max(axis=1)
    length = np.sqrt(square.max(axis=1))
    ratio = length * np.sqrt(curvature / thickness)
    limit = LONG_LINEAR_SHELL if x.shape[1] == 4 else LONG_SHELL
    coarse = ratio > limit
    if not coarse.any():
        return
    worst = int(np.argmax(ratio))
    long = f"{element_text(worst, x)}, is {length[worst]:.3g} m long against {length[worst] / ratio[worst]:.3g} m"
    if limit == LONG_SHELL:
        warn_of_physics(
            "{body_or_joint}: {coarse} of {count} second-order elements are longer than {limit:g} sqrt(R h); the "
            "worst, {long}. Low modes of a thin dish are 5 % too high at 13 sqrt(R h) and 2.6 times too high at "
            "26.",
            body_or_joint=where,
            value=ratio[worst],
            limit=LONG_SHELL,
            remedy="Mesh finer, or give refine = 1",
            coarse=int(coarse.sum()),
            count=len(x),
            long=long,
        )
        return
    warn_of_physics(
        "{body_or_joint}: {coarse} of {count} four-node elements are longer than {limit:g} sqrt(R h), and a curved "
        "shell bends over a length sqrt(R h) at concentrated loads and edges; the worst, {long}. There the shell "
        "is up to {stiffer:.3g} times as stiff as it should be; low modes bend smoothly and are within 1 % up to 2 "
        "sqrt(R h) and 20 % off at 4 sqrt(R h).",
        body_or_joint=where,
        value=ratio[worst],
        limit=LONG_LINEAR_SHELL,
        remedy="Mesh finer there, or use eight- or nine-node elements",
        coarse=int(coarse.sum()),
        count=len(x),
        long=long,
        stiffer=1 + SHELL_STIFFNESS_ERROR * ratio[worst] ** 2,
    )


def tapers(x: Array) -> Array:
    """a tan(delta) (e,) [1] of quadrilaterals x (e, 4, 3) [m]: zero of parallelograms."""
    length = np.linalg.norm(np.roll(x, -1, axis=1) - x, axis=2)
    area = np.linalg.norm(np.cross(x[:, 2] - x[:, 0], x[:, 3] - x[:, 1]), axis=1) / 2
    taper = np.zeros(len(x))
    for k in (0, 1):  # sides k and k + 2 run along
        along = (length[:, k] + length[:, k + 2]) / 2
        height = area / along
        lean = np.abs(length[:, k] - length[:, k + 2]) / (2 * height)  # tan(delta)
        taper = np.maximum(taper, np.where(along > height, along / height * lean, 0.0))
    return taper


def warn_of_trapezoids(x: Array, where: str) -> None:
    """Warn of four-node elements x (e, 4, 3) [m] that taper so much that they lock in their plane."""
    taper = tapers(x)
    locked = taper > TAPERED_SHELL
    if locked.mean() <= FEW_SHELLS:
        return
    worst = int(np.argmax(taper))
    warn_of_physics(
        "{body_or_joint}: {locked} of {count} four-node elements are trapezoids that lock in their plane; one "
        "layer of the worst, {worst}, is up to {value:.3g} times as stiff in bending in its plane as it should be.",
        body_or_joint=where,
        value=1 + taper[worst] ** 2,
        limit=1.0,
        remedy="Use rectangles or parallelograms, or eight- or nine-node elements",
        locked=int(locked.sum()),
        count=len(x),
        worst=element_text(worst, x),
    )


def element_text(element: int | np.intp, x: Array) -> str:
    """Number and centre of an element, for a sentence."""
    return f"element {element} at ({', '.join(f'{c:.6g}' for c in x[element].mean(axis=0))}) m"


def warn_of_first_order(name: str, x: Array, material: Material | Orthotropic | Anisotropic, group: str) -> None:
    """Warn of the bending stiffness of first-order cells with corners x (e, k, 3) [m].

    In pure bending of a brick of length a and height b the parasitic shear adds (1 - nu)/2 (a/b)^2 to 1.
    """
    edges = np.stack([np.linalg.norm(x[:, j] - x[:, i], axis=1) for i, j in EDGES[CELL_TYPES[name].shape]], axis=1)
    slenderness = float((edges.max(axis=1) / edges.min(axis=1)).max())
    nu = material.nu if isinstance(material, Material) else 0.3
    factor = 1 + (1 - nu) / 2 * slenderness**2
    warn_of_physics(
        "solid on group {body_or_joint!r} uses {count} {name} cells of first order, up to {slenderness:.3g} times "
        "as long as thick: one layer of them bends up to {value:.3g} times too stiffly ({limit:g} is right);",
        body_or_joint=group,
        value=factor,
        limit=1.0,
        remedy="leave out order = 1, so that they are raised to second order",
        count=len(x),
        name=name,
        slenderness=slenderness,
    )


def warn_of_tapered(x: Array, group: str) -> None:
    """Warn of bricks of eight nodes x (e, 8, 3) [m] with faces that taper so much that they lock in bending."""
    taper = np.max([tapers(x[:, face]) for face in FACES["hexahedron"]], axis=0)
    locked = taper > TAPERED_SHELL
    if locked.mean() <= FEW_SOLIDS:
        return
    warn_of_physics(
        "solid on group {body_or_joint!r}: {locked} of {count} hexahedra of eight nodes have faces that are "
        "trapezoids, and lock; one layer of the worst is up to {value:.3g} times as stiff in bending in the plane "
        "of such a face as it should be ({limit:g} is right);",
        body_or_joint=group,
        value=1 + taper.max() ** 2,
        limit=1.0,
        remedy="give order = 2, or mesh with parallelepipeds",
        locked=int(locked.sum()),
        count=len(x),
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
    warn_of_physics(
        "solid on group {body_or_joint!r} is a thin curved layer of {name} cells: their edges rise by {rise:.2g} "
        "of the thickness over their chords, so deflections in bending are about {value:.0%} too small (limit "
        "{limit:.0%});",
        body_or_joint=group,
        value=min(typical, 0.9),
        limit=LOCKING_ERROR,
        remedy=f"{remedy} family shell, or shorten the elements (a half leaves a quarter)",
        name=name,
        rise=typical,
    )


def warn_of_incompressible(name: str, nodes: IntArray, C: Array, isotropic: bool, group: str) -> None:
    """Warn of cells with nodes (e, k) that are too stiff because their material is nearly incompressible.

    C (6, 6) [Pa]: its elastic matrix; the ratio is that of an isotropic material with the same bulk and mean shear
    modulus. Second-order cells of isotropic materials do not lock (`femflex.fem.solid.member`), but a single layer of
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
    warn_of_physics(
        "solid on group {body_or_joint!r} hardly changes its volume (Poisson's ratio {value:.4g}, limit {limit:g}) "
        f"and its {{name}} cells {effect};",
        body_or_joint=group,
        value=ratio,
        limit=NEARLY_INCOMPRESSIBLE,
        remedy=remedy,
        name=name,
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


def warn_of_constant_strain(points: Array, cells: dict[str, IntArray], where: str) -> None:
    """Warn of shells with points [m] and cells (e, k) that are triangles by over CONSTANT_STRAIN_SHARE of the area."""
    area = {
        name: np.linalg.norm(normals_at_nodes(name, points[nodes]), axis=2).mean(axis=1).sum()
        / (2 if "triangle" in name else 1)
        for name, nodes in cells.items()
    }
    share = area.get("triangle", 0.0) / sum(area.values())
    if share > CONSTANT_STRAIN_SHARE:
        warn_of_physics(
            "{body_or_joint}: {value:.0%} of its area is three-node triangles (limit {limit:.0%}), whose membrane "
            "strain is constant and converges slowly.",
            body_or_joint=where,
            value=share,
            limit=CONSTANT_STRAIN_SHARE,
            remedy="Use family = 'plate' for meshes of triangles, or six-node ones",
        )


def warn_of_curved_beam(mesh: Mesh, group: str, cells: dict[str, IntArray]) -> None:
    """Warn of line3 cells that are curved, since beams take them as two straight elements."""
    line3 = cells.get("line3")
    excess = 0.0 if line3 is None else arc_excess(mesh.points, line3)
    if excess > CURVED_CELL:
        warn_of_physics(
            "beam group {body_or_joint!r} has curved line3 cells, each taken as two straight elements: they are "
            "{value:.1%} shorter than the arcs through their nodes (limit {limit:.1%}), and their mass and "
            "flexibility are too small.",
            body_or_joint=group,
            value=excess,
            limit=CURVED_CELL,
            remedy="Mesh the curve with smaller cells",
        )


def warn_of_curved_sides(points: Array, cells: Mapping[str, IntArray], where: str) -> None:
    """Warn when middle nodes of cells (e, k) lie off the straight sides of the elements, with the largest distance.

    points (n_p, 3) [m].
    """
    distances = [_off_sides(points, nodes, name) for name, nodes in cells.items() if CELL_TYPES[name].order == 2]
    if not distances:
        return
    distance, length = (np.concatenate(part) for part in zip(*distances, strict=True))
    curved = distance > STRAIGHT * length
    if not curved.any():
        return
    worst = int(np.argmax(distance / length))
    warn_of_physics(
        "{body_or_joint}: {curved} of {count} sides of its second-order cells are curved, and the elements have "
        "straight ones between the corners: the worst middle node lies {distance:.3g} m off a side of {length:.3g} "
        "m ({value:.2%}; at most {limit:.2%} counts as straight).",
        body_or_joint=where,
        value=distance[worst] / length[worst],
        limit=STRAIGHT,
        remedy="Refine the mesh: refine = 1 makes corners of the middle nodes and divides the distance by 4",
        curved=int(curved.sum()),
        count=len(curved),
        distance=distance[worst],
        length=length[worst],
    )


def _off_sides(points: Array, nodes: IntArray, name: str) -> tuple[Array, Array]:
    """Distances (k,) of the middle nodes of cells (e, n) from the straight lines between corners, and their lengths."""
    cell = CELL_TYPES[name]
    first, last = (points[nodes[:, [edge[end] for edge in EDGES[cell.shape]]]] for end in (0, 1))
    middle = points[nodes[:, cell.n_corners : cell.n_corners + len(EDGES[cell.shape])]]
    chord, to_middle = last - first, middle - first
    length = np.linalg.norm(chord, axis=2)
    safe = np.where(length > 0, length, 1.0)
    return (np.linalg.norm(np.cross(chord, to_middle), axis=2) / safe).ravel(), safe.ravel()
