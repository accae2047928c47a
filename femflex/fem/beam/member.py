"""The beam family: straight elements in space with axial force, torsion, bending in two planes and, if asked, shear."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from femflex.arrays import Array, IntArray
from femflex.fem.assembly.dependence import Dependence
from femflex.fem.assembly.numbering import Numbering
from femflex.fem.beam.elements import CENTRES, BeamElements, selected_axes, stations
from femflex.fem.beam.shapes import NODAL, BeamOrder
from femflex.fem.beam.strain import beam_strain, corner_nodes, shear_strain
from femflex.fem.family import (
    Contribution,
    Option,
    Options,
    SkinPart,
    StrainPlaces,
    family,
    member_cells,
    member_options,
)
from femflex.fem.line.chain import LINE_TYPES, ArcLength, arc_length, element_frames, section_points, straight_elements
from femflex.fem.mesh_warnings import SLENDER_BEAM, warn_of_curved_beam
from femflex.fem.sections.library import Shape
from femflex.fem.sections.section import Resultants, Section
from femflex.fem.support import COMPONENTS
from femflex.fem.tables import SectionInertia
from femflex.warning import warn_of_physics

if TYPE_CHECKING:
    from femflex.fem.beam.elements import BeamElements
    from femflex.fem.structure import Member
    from femflex.mesh import Mesh

OPTIONS: Options = {
    "order": Option(3, "order of the bending fields, 3 to 8"),
    "axial_order": Option(
        None, "order of the axial field. Default: 2 order - 1; a lower one locks with nonlinear strain"
    ),
    "torsion_order": Option(None, "order of the torsional field. Default: max(2, order - 1)"),
    "orientation": Option(None, "a direction near the section's y axis", "", (3,)),
    "rotary_inertia": Option(True, "false leaves out the rotary inertia of sections in bending (Euler-Bernoulli)"),
    "start": Option(None, "point group where the arc length of varying sections begins"),
    "extent": Option(
        None, "length of the whole line of which the group is a part. Shear matters in short, thick lines", "m"
    ),
    "bounded_energy": Option(
        None, "true: strain energy bounded below in large deflections of flat sections. Default: with nonlinear strain"
    ),
    "shear": Option(
        None,
        "true: shear deformation (Timoshenko). Default: where centroid or shear centre lies off the node line, or a "
        "full stiffness has shear terms",
    ),
    "offset": Option(None, "y and z of the centroid from the node line", "m", (2,)),
    "shear_centre": Option(None, "y and z of the shear centre from the centroid", "m", (2,)),
    "mass_centre": Option(None, "y and z of the mass centre from the centroid", "m", (2,)),
    "release": Option(None, "components of x, y, z, rx, ry, rz, section axes, released at the nodes of release_at"),
    "release_at": Option(None, "point group of the nodes at which the member's ends are released"),
    "prestress": Option(0.0, "initial axial force, tension positive", "N"),
    "thermal_strain": Option(0.0, "free axial strain", ""),
}
ORDERS = range(3, 9)
STRETCH_ORDERS = range(1, 2 * ORDERS.stop - 2)  # of the axial and torsional fields, up to 2 * 8 - 1
VARYING_DEGREE = 8  # polynomial degree added to the quadrature where properties vary along the element


@family("beam", OPTIONS, prepare=selected_axes, dimension=1)
def beam(mesh: Mesh, member: Member, numbering: Numbering) -> Contribution:
    """Inertia, strain and skin of 3-D Euler-Bernoulli or Timoshenko beams on a group of line cells.

    Cells line, or line3, which is two straight elements joined at its middle node. Section: any of
    `femflex.fem.sections`; a shape needs an isotropic Material. Fields: bending cubic Hermite with bubbles up
    to `order`, torsion of order max(2, order - 1), axial of order 2 order - 1: u' is then a polynomial of the degree
    of v'^2 and takes back, in every element, the stretch that bending would store (no membrane locking). Strains:
    eps = u' + (u'^2 + v'^2 + w'^2)/2 + (I_p/2A) theta'^2 (THEORY section 3), and curvature and twist that couple
    bending in two planes with torsion, to second order (`femflex.fem.beam.strain`).

    Without an orientation the axes of `chain.element_frames` are reported, and warned of where elements run along the
    mesh's z axis. Without rotary inertia in bending, rotations of the whole body have none either; that in torsion
    stays, the same about all transverse axes (no propeller moment).

    Mesh advice: the relative error of a bending frequency is (beta h)^4 / 1440 at order 3, h the element length and
    beta = (m' omega^2 / EI)^(1/4). The default order needs beta h < 0.19 for 1e-6: 10 elements for the first mode
    of a cantilever, 25 for the second, 75 for the fifth; more than a few hundred only add rounding. Order 6 needs
    beta h < 2.5: four elements give the first three modes of a cantilever to 1e-7, at a tenth of the dofs.
    Properties that vary are integrated with more points; a kink in a table needs a node.
    """
    options = _checked_options(member_options(member), member)
    elements = _elements(mesh, member, numbering, options)
    order, varying = elements.order, VARYING_DEGREE * member.section.varies
    highest = max(order.bending, order.axial, order.torsion)
    blocks = _inertia(elements, member, 2 * highest + varying, options)
    # u' is of the order of v'^2, so that its square is the highest power needed
    degree = max(4 * (order.bending - 1), 2 * (order.axial - 1), 4 * (order.torsion - 1)) + varying
    corners = np.isin(elements.nodes, corner_nodes(mesh, numbering.members))
    where, r = f"beam on group {member.group!r}", stations(elements, member, degree)[2]
    stiffness = full_stiffness(r, options, where) if order.shear else None
    strain = beam_strain(elements, member, degree, options, corners, stiffness)
    shear = () if stiffness is None else (shear_strain(strain, elements, member, degree, stiffness),)
    axis = elements.positions(stations(elements, member, degree)[0], np.zeros((*strain.weight.shape, 1, 3)))[:, :, 0]
    fibres = _fibres(elements, member, degree, options)
    places = StrainPlaces("line", axis, lever=np.sqrt(r.polar2), fibres=fibres, axes=elements.frame)
    centre = np.zeros(2) if options["offset"] is None else np.asarray(options["offset"], float)
    skin = partial(swept_outline, elements, member.section, centre)
    return Contribution((blocks,), (strain,), skin, (places,), late=lambda: shear)


def _fibres(elements: BeamElements, member: Member, degree: int, options: dict[str, Any]) -> Array | None:
    """Stress at the extreme fibres (e|1, q|1, 4) of `Shape.fibres`; None for sections without a shape, or with an
    offset, as their forces act along the line of the nodes."""
    section = member.section
    if not isinstance(section, Shape) or options["offset"] is not None or options["shear_centre"] is not None:
        return None
    if not section.varies:
        return section.fibres(np.zeros((1, 1)), 1.0)
    return section.fibres(elements.arc.arc_at(stations(elements, member, degree)[0]), elements.arc.whole[:, None])


def _elements(mesh: Mesh, member: Member, numbering: Numbering, options: dict[str, Any]) -> BeamElements:
    cells = member_cells(mesh, member, LINE_TYPES)
    nodes = straight_elements(cells)
    start, end = mesh.points[nodes[:, 0]], mesh.points[nodes[:, 1]]
    length, frame = element_frames(start, end, options["orientation"], member.group)
    warn_of_curved_beam(mesh, member.group, cells)
    if member.section.varies:
        arc = arc_length(mesh, nodes, member.group, options["start"])
    else:
        arc = ArcLength(np.zeros((len(nodes), 2)), np.ones(len(nodes)))
    shear = shears(member.section, options)
    order = BeamOrder(options["order"], options["axial_order"], options["torsion_order"], shear)
    nodal = np.concatenate([numbering.translation(nodes.ravel()), numbering.rotation(nodes.ravel())], axis=1)
    if options["release"] is not None:
        nodal = release_ends(mesh, member, options, numbering, nodes, frame, nodal)
    bubbles = _bubbles(numbering, nodes, frame, order)
    dofs = np.concatenate([nodal.reshape(-1, NODAL), bubbles], axis=1)
    return BeamElements(nodes, start, length, frame, dofs, arc, order)


def _bubbles(numbering: Numbering, nodes: IntArray, frame: Array, order: BeamOrder) -> IntArray:
    """Raw dofs (e, n) of the bubbles of elements between nodes (e, 2): of u, theta, v and w, in the order of
    `BeamOrder`."""
    dofs = numbering.extra(len(nodes) * (order.n_local - NODAL)).reshape(len(nodes), -1)
    u, theta = np.arange(order.axial - 1), order.axial - 1 + np.arange(order.torsion - 1)
    v = order.axial + order.torsion - 2 + np.arange(order.bending - 3)
    for k in u:
        numbering.attach(dofs[:, [k]], nodes, frame[:, :1])
    for k in theta:
        numbering.attach(dofs[:, [k]], nodes, frame[:, :1], kind="rotation")
    for k in v:
        numbering.attach(dofs[:, [k, k + len(v)]], nodes, frame[:, 1:])
    first = order.n_local - NODAL - 2 * order.n_shear
    for k in first + np.arange(order.n_shear):
        numbering.attach(dofs[:, [k, k + order.n_shear]], nodes, frame[:, 1:])
    return dofs


def _inertia(elements: BeamElements, member: Member, degree: int, options: dict[str, Any]) -> SectionInertia:
    """Return the points of mass of the sections at all stations, with their mass and second moments."""
    xi, weight, r = stations(elements, member, degree)
    offsets, share = section_points(r.rz2, r.ry2, options["rotary_inertia"], r.product)
    offsets[..., 1:] += np.broadcast_to(mass_centre(r, options), (*weight.shape, 2))[:, :, None]
    dm = ((weight * r.mass)[..., None] * share).reshape(len(weight), -1)
    rho = elements.positions(xi, offsets).reshape(*dm.shape, 3)
    N = elements.motion(xi, offsets).reshape(*dm.shape, 3, -1)
    if not elements.order.shear:
        _warn_if_stout(rho, np.sqrt(np.maximum(r.ry2, r.rz2)).max(), member)
    second_moments = (weight * r.mass)[..., None, None] * np.einsum("k,eqki,eqkj->eqij", share, offsets, offsets)
    frame = elements.frame[:, None]
    second = np.matmul(frame.swapaxes(2, 3), np.matmul(second_moments, frame))
    return SectionInertia(elements.dofs, dm, rho, N, second, elements.turn(xi), elements.frame[:, 0])


def _checked_options(options: dict[str, Any], member: Member) -> dict[str, Any]:
    """Return the options with defaults that depend on others filled in; ValueError for values that the family cannot
    use."""
    where = f"beam on group {member.group!r}"
    order = options["order"]
    if order not in ORDERS:
        raise ValueError(f"{where} has order {order!r}; it may be {ORDERS.start} to {ORDERS.stop - 1}")
    fields = {"order": int(order)}
    for name, default in (("axial_order", 2 * order - 1), ("torsion_order", max(2, order - 1))):
        value = default if options[name] is None else options[name]
        if value not in STRETCH_ORDERS:
            raise ValueError(f"{where} has {name} {value!r}; it may be 1 to {STRETCH_ORDERS.stop - 1}")
        fields[name] = int(value)
    if member.section is None:
        raise ValueError(
            f"{where} has no section; name one (in a case `section`, from the table [sections]), such as a tube, box, "
            "rectangle or I"
        )
    if not hasattr(member.section, "resultants"):
        raise ValueError(
            f"{where} has section {member.section!r}; give one of femflex.fem.sections (tube, box, rectangle, I, ...)"
        )
    if options["bounded_energy"] not in (None, True, False):
        raise ValueError(
            f"{where} has bounded_energy {options['bounded_energy']!r}; give true or false, or leave it out"
        )
    if options["shear"] not in (None, True, False):
        raise ValueError(f"{where} has shear {options['shear']!r}; give true or false, or leave it out")
    for name in CENTRES:
        centre = options[name]
        if centre is not None and (np.shape(centre) != (2,) or not np.isfinite(np.asarray(centre, float)).all()):
            raise ValueError(f"{where} has {name} {centre!r}; give y and z, two lengths")
    for name in ("prestress", "thermal_strain"):
        if not isinstance(options[name], int | float | np.floating) or not np.isfinite(options[name]):
            raise ValueError(f"{where} has {name} {options[name]!r}; give one finite number")
    orientation = options["orientation"]
    if orientation is not None:
        orientation = np.asarray(orientation, float)
        if orientation.shape != (3,) or not np.isfinite(orientation).all() or not orientation.any():
            raise ValueError(f"{where} has orientation {orientation.tolist()}; give three components, not all zero")
    return {**options, **fields, "orientation": orientation}


def _warn_if_stout(rho: Array, gyration: float, member: Member) -> None:
    extent = member.options.get("extent") or float(np.linalg.norm(np.ptp(rho.reshape(-1, 3), axis=0)))
    if extent < SLENDER_BEAM * gyration:
        warn_of_physics(
            "beam group {body_or_joint!r} extends over {value:.4g} m with a radius of gyration of {gyration:.4g} "
            "m; below {slender:g} radii ({limit:.4g} m) the shear left out here shifts frequencies by per cents.",
            body_or_joint=member.group,
            value=extent,
            limit=SLENDER_BEAM * gyration,
            remedy="Set the option shear = true",
            gyration=gyration,
            slender=SLENDER_BEAM,
        )


# Full sectional stiffness of beams about the node line, from resultants and the positions of centroid and shear
# centre.
#
# Strains at a point (y, z) of the section from those at the node line (x along the beam):
#
#     eps' = eps + z kappa_y - y kappa_z      gamma_y' = gamma_y - z kappa_x      gamma_z' = gamma_z + y kappa_x
#
# Axial force acts at the centroid, shear forces act at the shear centre.


def shears(section: Any, options: dict[str, Any]) -> bool:
    """Whether the beam has shear deformation: by its options, or because its section couples shear or has eccentric
    centres."""
    if options["shear"] is not None:
        return bool(options["shear"])
    eccentric = any(np.any(options[name]) for name in CENTRES[:2] if options[name] is not None)
    return bool(getattr(section, "couples_shear", False)) or eccentric


def full_stiffness(resultants: Resultants, options: dict[str, Any], where: str) -> Array:
    """Stiffness (e, q, 6, 6) [N, N m, N m^2] over (eps, gamma_y, gamma_z, kappa_x, kappa_y, kappa_z) about the node
    line.

    Raises ValueError when the section has no shear stiffness.
    """
    centroid = _position(options["offset"])
    centre = centroid + _position(options["shear_centre"])
    if resultants.coupled is not None:
        X = strain_transform(centroid, centroid)
        return np.asarray(X.T @ resultants.coupled @ X)
    if resultants.GAy is None or resultants.GAz is None:
        raise ValueError(
            f"{where} has shear deformation (option shear, or a centroid or shear centre off the node line), but its "
            "section has no shear stiffness; give GAy and GAz"
        )
    r = resultants
    assert r.GAy is not None and r.GAz is not None
    X = strain_transform(centroid, centre)
    diagonal = np.stack(np.broadcast_arrays(r.EA, r.GAy, r.GAz, r.GJ, r.EIy, r.EIz), axis=-1)
    return np.asarray(X.T @ (diagonal[..., None] * X))


def strain_transform(centroid: Array, shear_centre: Array) -> Array:
    """X (6, 6) [1]: strains at the centroid and the shear centre (2,) from those at the node line."""
    X = np.eye(6)
    X[0, 4], X[0, 5] = centroid[1], -centroid[0]
    X[1, 3], X[2, 3] = -shear_centre[1], shear_centre[0]
    return X


def mass_centre(resultants: Resultants, options: dict[str, Any]) -> Array:
    """Mass centre (e, q, 2) [m] or (2,) from the node line."""
    offset = _position(options["offset"]) + _position(options["mass_centre"])
    return offset if resultants.centre is None else offset + resultants.centre


def _position(value: Any) -> Array:
    return np.zeros(2) if value is None else np.asarray(value, float)


def release_ends(
    mesh: Mesh,
    member: Member,
    options: dict[str, Any],
    numbering: Numbering,
    nodes: IntArray,
    frame: Array,
    nodal: IntArray,
) -> IntArray:
    """Return the numbers (2 e, 6) of the dofs of the ends of elements with nodes (e, 2) and frames (e, 3, 3): those of
    their nodes, or separate ones at releases, which follow the nodes in all but the released components.

    Raises ValueError for unknown components, and when no end of the member is at a node of release_at.
    """
    where, components = f"beam on group {member.group!r}", options["release"]
    components = [components] if isinstance(components, str) else list(components)
    unknown = [c for c in components if c not in COMPONENTS]
    if unknown or not components:
        raise ValueError(f"{where} has release {components!r}; name some of {list(COMPONENTS)}")
    if options["release_at"] is None:
        raise ValueError(f"{where} has release without release_at; name the point group of the released ends")
    released_ends = np.flatnonzero(np.isin(nodes.ravel(), mesh.group_points(options["release_at"])))
    if not len(released_ends):
        raise ValueError(f"{where}: no element ends at a node of release_at = {options['release_at']!r}")
    nodal = nodal.copy()
    for end in released_ends:
        axes = frame[end // 2]
        for first in (0, 3):
            follows = np.array([c not in components for c in COMPONENTS[first : first + 3]])
            if follows.all():
                continue
            new_dofs, node_dofs = numbering.extra(3), nodal[end, first : first + 3].copy()
            if follows.any():
                numbering.connect(
                    [Dependence(new_dofs, axes[follows], node_dofs, np.eye(3), f"the release of {where}")]
                )
            nodal[end, first : first + 3] = new_dofs
    return nodal


def swept_outline(elements: BeamElements, section: Section, centre: Array) -> SkinPart:
    """Surface of a member's elements: quads between order + 2 stations per element, triangles over its ends.

    centre (2,) [m]: y and z of the outline's origin from the node line. Points move with their section, u + theta x
    offset; a bent element is drawn bent.
    """
    n_stations = elements.order.bending + 2
    xi = np.linspace(0.0, 1.0, n_stations)
    outline = section.outline(elements.arc.arc_at(xi), elements.arc.whole[:, None])
    n_elements, _, n_corners, _ = outline.points.shape
    number = np.arange(n_elements * n_stations * n_corners).reshape(n_elements, n_stations, n_corners)
    offsets = np.concatenate([np.zeros((*outline.points.shape[:3], 1)), outline.points + centre], axis=-1)
    motion = elements.motion(xi, offsets).reshape(number.size * 3, -1)
    rows, local = np.nonzero(motion)
    element = rows // (3 * n_stations * n_corners)
    return SkinPart(
        points=elements.positions(xi, offsets).reshape(-1, 3),
        cells={"quad": _sides(number), "triangle": _caps(number, outline.triangles, elements.dofs)},
        rows=rows,
        cols=elements.dofs[element, local],
        values=motion[rows, local],
    )


def _sides(number: IntArray) -> IntArray:
    """Quads (n, 4) between neighbouring stations, outward."""
    around = np.roll(number, -1, axis=2)
    return np.stack([number[:, :-1], around[:, :-1], around[:, 1:], number[:, 1:]], axis=-1).reshape(-1, 4)


def _caps(number: IntArray, triangles: IntArray, dofs: IntArray) -> IntArray:
    """Triangles (n, 3) over element ends that no other element of the member continues, outward."""
    ends = dofs[:, [0, 6]]  # one dof identifies the node
    _, node, count = np.unique(ends, return_inverse=True, return_counts=True)
    free = count[node.reshape(-1, 2)] == 1
    first, last = number[free[:, 0], 0], number[free[:, 1], -1]
    return np.concatenate([first[:, triangles[:, ::-1]].reshape(-1, 3), last[:, triangles].reshape(-1, 3)])
