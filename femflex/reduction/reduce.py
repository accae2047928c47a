"""Reduce a Structure with a ModeSet to a FlexibleBody, whole, in segments, or for small motions."""

from __future__ import annotations

from collections.abc import Callable, Container, Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Literal

import numpy as np

from femflex.arrays import Array, BoolArray, IntArray
from femflex.body import FlexibleBody, LoadSet, Marker, MassMoments, Patches, Skin, StrainTensors
from femflex.fem.deflected import tension_blocks
from femflex.fem.line.segments import ENDS, FAR, NEAR, Segment
from femflex.fem.static_loads import StaticLoads
from femflex.fem.structure import Member, Structure, build_structure
from femflex.fem.tables import SectionInertia, element_chunks
from femflex.mesh import Mesh, read_mesh
from femflex.mesh.regions import WHOLE_GROUPS
from femflex.reduction.beams.strain_points import strain_field
from femflex.reduction.boundary.markers import attachable_nodes, marker, marker_rows
from femflex.reduction.boundary.patches import add_load_sets, add_patches
from femflex.reduction.boundary.rigid import Groups, check_no_rigid_motion, is_held_by_springs, rigid_shapes
from femflex.reduction.induced_strain import with_induced_strains
from femflex.reduction.inertia.accelerations import loads_of_rigid_accelerations
from femflex.reduction.inertia.moments import linear_stiffness, mass_moments, mass_points
from femflex.reduction.inertia.orders import first_order_part, membrane_cubic
from femflex.reduction.large_deflection.derivatives import with_derivatives
from femflex.reduction.large_deflection.foreshortening import foreshortening
from femflex.reduction.mode_warnings import warn_of_folded_beams, warn_of_in_plane_turns, warn_of_omitted_shear
from femflex.reduction.modes.craig_bampton import craig_bampton
from femflex.reduction.modes.damping import UNANSWERED, Damping, bending_damping, is_added, is_unanswered
from femflex.reduction.modes.vibration import ModeSet, cantilever_modes, free_free_modes, is_lumped
from femflex.reduction.preload.equilibrium import is_preloaded
from femflex.reduction.strain.condense import condense, dependent_derivatives, with_static_stretch
from femflex.reduction.strain.initial_stress import relaxed, warn_if_slack
from femflex.reduction.strain.tensors import cubic_tensors, strain_tensors
from femflex.reduction.strain.turned_sections import sections_of, with_turned_sections

Strain = Literal["linear", "nonlinear", "condensed"]

MOST_COORDINATES = 1200  # coordinates of a set, up to which its lowest shape is computed
PARALLEL = 1e-9  # sine of the angle between the elements at a node that have one axis


def reduce_structure(
    structure: Structure,
    modes: ModeSet,
    markers: Mapping[str, str] | None = None,
    damping: Damping | None = None,
    strain: Strain = "linear",
    turning: Container[str] | None = None,
    patches: Sequence[str] = (),
    loads: Mapping[str, StaticLoads] | None = None,
    induced: Sequence[str] = (),
) -> FlexibleBody:
    """The FlexibleBody of a structure that moves in these shapes; the body frame is the mesh's coordinates.

    markers: name -> mesh group; the set's own groups (clamps, interfaces) are markers under their own names.
    damping: a Damping; none when left out.
    strain: "nonlinear" keeps the cubic and quartic tensors too; its set needs shapes that can stretch
    (`with_derivatives`; `stretching` checks it); "condensed" makes the set's derivatives dependent (`condense`), but
    those that are slower than their excitation, which stay coordinates (`dependent_derivatives`).
    turning: markers whose rotation will be used (default: all); those without a rotation are warned of.
    patches: mesh groups of lines, surfaces or faces over which forces will be spread (`Patches`).
    loads: name -> static loads that will act on it (`LoadSet`).
    induced: those of the patches' groups in which strain will be induced (`InducedStrain`).
    A linear body contains the foreshortening of its lowest shape (`foreshortening`), by which the effect that linear
    strain leaves out is estimated.
    Warns if linear strain meets an initial stress that the supports do not react, if thin plates leave out significant
    shear, and if plates with another strain rotate in their own planes.
    Raises ValueError if a group is unknown, or the shapes are dependent or contain a rigid motion.
    """
    if strain == "linear":
        warn_if_slack(structure, modes)
    else:
        warn_of_in_plane_turns(structure, modes)
    warn_of_omitted_shear(structure, modes)
    phi = modes.phi
    check_no_rigid_motion(_excluded_rigid_motions(structure), phi, dof_weight(structure))
    all_markers = {**{group: group for group in modes.groups}, **(markers or {})}
    moments = mass_moments(structure.inertia, structure.T @ phi)
    V1 = linear_stiffness(structure.K, phi)
    damped = [strain == "linear" or kind != "derivative" for kind in modes.kinds]
    without_work = _shapes_without_modal_work(structure, modes, strain)
    body_markers, body_patches, load_sets = attachments(
        structure, phi, all_markers, turning, patches, loads, strain == "linear"
    )
    body = FlexibleBody(
        moments=moments,
        strain=_strain_tensors(structure, phi, V1, strain),
        damping=bending_damping(
            damping or Damping(ratio=0.0),
            moments.elastic_mass(),
            V1,
            damped,
            is_added(modes.kinds),
            without_work,
        )
        + internal_damping(structure, phi, damped),
        markers=body_markers,
        skin=skin_of(structure, phi),
        kinds=tuple(
            "attachment" if kind == UNANSWERED and not is_alone else kind
            for kind, is_alone in zip(modes.kinds, without_work, strict=True)
        ),
        omega=modes.omega,
        strain_field=strain_field(structure, phi, strain != "linear"),
        mass_points=mass_points(structure, phi),
        patches=body_patches,
        load_sets=load_sets,
    )
    if strain == "linear":
        has_lowest_shape = (
            0 < modes.n_modes <= MOST_COORDINATES
            and not is_lumped(structure)
            and not is_preloaded(structure, modes.held)
        )
        body = replace(body, foreshortening=foreshortening(structure, modes, markers) if has_lowest_shape else None)
        return with_induced_strains(structure, modes, body, induced, np.arange(body.n_modes))
    body, free = _with_dependent_shapes(structure, modes, body, strain == "condensed", all_markers)
    return with_induced_strains(structure, modes, body, induced, free)


def attachments(
    structure: Structure,
    phi: Array,
    groups: Mapping[str, str],
    turning: Container[str] | None,
    patches: Sequence[str],
    loads: Mapping[str, StaticLoads] | None,
    is_linear: bool,
) -> tuple[dict[str, Marker], dict[str, Patches], dict[str, LoadSet]]:
    """Markers (name -> group), patches and sets of loads on shapes phi (n_dof, n) [m, rad], and the markers of all.

    is_linear: of linear strain, whose markers have no axis along their member.
    """
    body_patches, patch_markers = add_patches(structure, phi, patches, not is_linear)
    load_sets, load_markers = add_load_sets(structure, phi, loads or {})
    markers = {
        name: replace(
            marker(marker_rows(structure, group), phi, name, turning is None or name in turning),
            axis=np.zeros(3) if is_linear else section_axis(structure, group),
        )
        for name, group in groups.items()
    }
    return markers | patch_markers | load_markers, body_patches, load_sets


def _excluded_rigid_motions(structure: Structure) -> Array:
    """The rigid motions (n_dof, k) that shapes must not contain.

    There are none if springs to ground resist them. Structures of tethers and membranes alone have the translations
    only: the rotations of a straight string about one end are modes of it.
    """
    R = rigid_shapes(structure)
    if is_held_by_springs(structure.K, structure.M, R):
        return R[:, :0]
    return R[:, :3] if len(tension_blocks(structure)) == len(structure.strain) else R


def _strain_tensors(structure: Structure, phi: Array, V1: Array, strain: Strain) -> StrainTensors:
    """The strain tensors of a body with that strain. A condensed body gets its V3, of fewer shapes, later."""
    if strain == "linear":
        return StrainTensors(V1, phi.T @ structure.f0)
    return strain_tensors(structure, phi) if strain == "nonlinear" else cubic_tensors(structure, phi)


def _shapes_without_modal_work(structure: Structure, modes: ModeSet, strain: Strain) -> BoolArray:
    """(n,): whether each shape is the static shape of loads that do no work on the modes.

    If strain is not linear, only those in twist and bending count: there the amplitude of a stretching shape goes with
    the square of the deflection (`bending_damping`).
    """
    without_work = is_unanswered(modes.kinds)
    if strain != "linear":
        for k in np.flatnonzero(without_work):
            without_work[k] = first_order_part(structure, modes.phi[:, [k]]).any()
    return without_work


def _with_dependent_shapes(
    structure: Structure, modes: ModeSet, body: FlexibleBody, condensed: bool, places: dict[str, str]
) -> tuple[FlexibleBody, IntArray]:
    """The body with rotating sections and, if condensed, with dependent derivatives; its V3 is not needed before.

    The second value holds the numbers (n,) of its elastic coordinates among the set.
    """
    dependent = dependent_derivatives(body, _derivative_numbers(modes)) if condensed else np.zeros(0, np.int64)
    sections = sections_of(structure, modes.phi)
    if sections is not None:
        first_order = [
            k for k, kind in enumerate(modes.kinds) if kind != "derivative"
        ]  # derivatives are of second order
        body = with_turned_sections(body, sections, first_order)
    free = np.setdiff1d(np.arange(body.n_modes), dependent)
    if not condensed:
        return body, free
    if not len(dependent):
        return replace(body, strain=strain_tensors(structure, modes.phi)), free
    warn_of_folded_beams(structure, len(free))
    first = first_order_part(structure, modes.phi[:, free])
    membrane = membrane_cubic(structure, modes.phi[:, free])
    preloaded = is_preloaded(structure, modes.held)
    quartic = lambda free: strain_tensors(structure, modes.phi[:, free]).V3  # noqa: E731
    body = condense(body, dependent, quartic, first, membrane, balanced=preloaded)
    return (body if preloaded else with_static_stretch(structure, modes, body, free, places)), free


def _derivative_numbers(modes: ModeSet) -> IntArray:
    """The numbers (k,) of the derivatives among the shapes. Raises ValueError if there are none."""
    numbers = np.flatnonzero([kind == "derivative" for kind in modes.kinds])
    if not len(numbers):
        kinds = ", ".join(dict.fromkeys(modes.kinds)) or "none"
        if "nodal" in modes.kinds:
            raise ValueError(
                "the condensed form needs static derivatives as dependent shapes, which nodal displacements do not "
                "have. Give it strain = 'nonlinear', or a reduction to modes, such as "
                "'cantilever'."
            )
        raise ValueError(
            f"the condensed form needs static derivatives as dependent shapes, and this set has none ({kinds}); add "
            "them (derivatives = 'auto')."
        )
    return numbers


def dof_weight(structure: Structure) -> Array:
    """The root of the stiffness diagonal (n_dof,) [SI], by which lengths, angles and other dofs are compared."""
    diagonal = structure.K.diagonal()
    return np.sqrt(np.maximum(diagonal, 1e-12 * diagonal.max(initial=0.0)))


def skin_of(structure: Structure, phi: Array) -> Skin | None:
    """The surface for drawing, with the displacements (n, n_p, 3) [m] of its points per column of phi (n_dof, n)."""
    if structure.skin is None:
        return None
    shapes = (structure.skin.operator @ phi).T.reshape(phi.shape[1], len(structure.skin.points), 3)
    return Skin(structure.skin.points, dict(structure.skin.cells), np.ascontiguousarray(shapes))


def section_axis(structure: Structure, group: str) -> Array:
    """The unit vector (3,) [1] along the beams at a group of one node.

    It is zero if the beams meet at an angle, or if other elements join them.
    """
    nodes = attachable_nodes(structure, group)
    turns = structure.numbering.rotation_of(nodes).ravel()
    rotation_dofs = turns[turns >= 0]
    beams = [block for block in structure.inertia if isinstance(block, SectionInertia)]
    if len(nodes) != 1 or not rotation_dofs.size or not beams:
        return np.zeros(3)
    axes = np.concatenate([block.axis[np.isin(block.dofs, rotation_dofs).any(axis=1)] for block in beams])
    n_elements = sum(np.isin(block.dofs, rotation_dofs).any(axis=1).sum() for block in structure.strain)
    only_parallel_beams = len(axes) == n_elements and np.linalg.norm(np.cross(axes, axes[0]), axis=1).max() < PARALLEL
    return np.asarray(axes[0] if only_parallel_beams else np.zeros(3))


def internal_damping(structure: Structure, phi: Array, damped: Sequence[bool]) -> Array:
    """D = int B0^T C tau B0 (n, n) of shapes phi (n_dof, n) [m, rad], over tethers and membranes with a viscosity tau.

    It uses the linear part of strain, and acts only on the shapes `damped`: with nonlinear strain the others compensate
    the stretch by bending (`femflex.reduction.modes.damping.bending_damping`).
    """
    n = phi.shape[1]
    D = np.zeros((n, n))
    raw = structure.T @ np.where(damped, phi, 0.0)
    for block in tension_blocks(structure):
        if block.viscosity:
            q, s = block.weight.shape[1], len(block.linear_map)
            for chunk in element_chunks(len(block.dofs), q * n * (block.linear_map.shape[1] + 2 * s)):
                part = block.sampled(chunk)
                B0 = part.linear_map @ part.gradients(raw, slice(None))
                stress = np.matmul(part.elastic * block.viscosity, B0) * part.weight[..., None, None]
                D += np.einsum("eqsi,eqsj->ij", B0, stress, optimize=True)
    return (D + D.T) / 2


def flexible_body(
    mesh: Mesh | str,
    members: Member | Iterable[Member],
    *,
    clamp: Groups = (),
    modes: int,
    markers: Mapping[str, str] | Iterable[str] = (),
    damping: Damping | float = 0.0,
    strain: Strain = "condensed",
) -> FlexibleBody:
    """The body of a mesh that moves in its lowest vibration modes; the body frame is the mesh's coordinates.

    mesh     a Mesh, or the path of its file [m]
    members  what the groups of the mesh are made of (`fem.Member`)
    clamp    groups of the mesh that are clamped where modes are computed, which become markers, or group -> components
             fixed ("x", "y", "z", "rx", "ry", "rz"); none: free-free modes
    modes    number of vibration modes
    markers  places for joints, loads and sensors: names of groups of the mesh, or marker -> group
    damping  ratio of critical of every mode, or a Damping
    strain   "linear", "condensed" (with the foreshortening and stiffening of bending), or "nonlinear" (stretch in
             coordinates of its own)

    The steps are `fem.build_structure`, `cantilever_modes` or `free_free_modes`, `with_derivatives` where strain is
    not linear, and `reduce_structure`; call these for anything else. Raises ValueError as they do.
    """
    mesh = mesh if isinstance(mesh, Mesh) else read_mesh(mesh)
    structure = build_structure(mesh, [members] if isinstance(members, Member) else list(members))
    shapes = cantilever_modes(structure, clamp, modes) if clamp else free_free_modes(structure, modes)
    if strain != "linear":
        shapes = with_derivatives(structure, shapes)
    places = dict(markers) if isinstance(markers, Mapping) else {group: group for group in markers}
    how = Damping(ratio=damping) if isinstance(damping, int | float) else damping
    return reduce_structure(structure, shapes, places, how, strain)


# Reduce a Structure to a FlexibleBody that is valid only for small motions about rest.
#
# The static shapes of a body are selected with such bodies; the body itself is built once its shapes are known.


LEVI_CIVITA = np.array([[np.cross(a, b) for b in np.eye(3)] for a in np.eye(3)]).transpose(2, 0, 1)


def small_motion_body(
    structure: Structure,
    modes: ModeSet,
    markers: Mapping[str, str] | None = None,
    turning: Container[str] | None = None,
    patches: Sequence[str] = (),
    loads: Mapping[str, StaticLoads] | None = None,
    induced: Sequence[str] = (),
) -> FlexibleBody:
    """The undamped FlexibleBody of a structure for small motions about rest; arguments as of `reduce_structure`."""
    groups = {**{group: group for group in modes.groups}, **(markers or {})}
    rigid = mass_moments(structure.inertia, np.zeros((structure.T.shape[0], 0)))
    body_markers, body_patches, load_sets = attachments(structure, modes.phi, groups, turning, patches, loads, True)
    draft = replace(
        body_of_shapes(structure, modes.phi, rigid, body_markers),
        skin=skin_of(structure, modes.phi),
        kinds=modes.kinds,
        omega=modes.omega,
        mass_points=mass_points(structure, modes.phi),
        patches=body_patches,
        load_sets=load_sets,
    )
    return with_induced_strains(structure, modes, draft, induced, np.arange(draft.n_modes))


def body_of_shapes(structure: Structure, phi: Array, rigid: MassMoments, markers: Mapping[str, Marker]) -> FlexibleBody:
    """A body of shapes phi (n_dof, n) [m, rad] with these markers, and the moments that small motions about rest need.

    rigid: moments of the undeformed body; moments of shapes in it are ignored.
    """
    n = phi.shape[1]
    momenta = loads_of_rigid_accelerations(structure).T @ phi  # momentum (3, n) and angular momentum (3, n) per shape
    second = np.zeros((1 + n, 3, 1 + n, 3))
    second[0, :, 0, :] = rigid.second[0, :, 0, :]
    half_moments = np.einsum("abc,ak->bkc", LEVI_CIVITA, momenta[3:]) / 2
    second[0, :, 1:, :] = half_moments
    second[1:, :, 0, :] = half_moments.transpose(1, 2, 0)
    Me = phi.T @ (structure.M @ phi)
    second[1:, :, 1:, :] = np.einsum("kl,ab->kalb", Me, np.eye(3)) / 3
    return FlexibleBody(
        moments=MassMoments(rigid.mass, np.vstack([rigid.first[:1], momenta[:3].T]), second),
        strain=StrainTensors.linear(linear_stiffness(structure.K, phi)),
        damping=np.zeros((n, n)),
        markers=dict(markers),
    )


def chord_modes(structure: Structure, n: int = 0) -> ModeSet:
    """The set of a segment between its ends: six static shapes and the n lowest modes with both ends fixed.

    The body frame follows the chord, the line between the ends, so that a segment bent by an angle theta errs by
    theta^2/24 of its length, a quarter of what it would in a frame that follows one end; with k segments the error of
    large deflections falls as 1/k^2.
    """
    return craig_bampton(structure, (NEAR, FAR), n, reference=ENDS)


def reduce_segments(
    segments: Sequence[Segment],
    markers: Mapping[str, str] | None = None,
    modes: Callable[[Structure], ModeSet] = chord_modes,
    damping: Damping | None = None,
    strain: Literal["linear", "nonlinear", "condensed"] = "linear",
    patches: Sequence[str] = (),
) -> tuple[FlexibleBody, ...]:
    """One FlexibleBody per segment, in the frame of the whole mesh, with markers NEAR and FAR at its ends.

    markers  name -> group of the whole mesh; each belongs to the first segment that contains the whole group
    modes    shapes of a segment's Structure (see chord_modes, which is the default)
    strain, patches  see `reduce_structure`; a segment has the patches of the groups that it is part of
    The first segment's "origin" is rigidly connected to its near end.
    Raises ValueError for a group that no segment contains.
    """
    groups = dict(markers or {})
    segment_markers = [{NEAR: NEAR, FAR: FAR} for _ in segments]
    for name, group in groups.items():
        candidates = [j for j, segment in enumerate(segments) if group in segment.groups]
        if not candidates:
            raise ValueError(
                f"marker {name!r} needs group {group!r}, whose points are on several of the {len(segments)} segments, "
                "or off the member; name a group of points of one segment"
            )
        segment_markers[candidates[0]][name] = group
    bodies = []
    for segment, of_segment in zip(segments, segment_markers, strict=True):
        structure = build_structure(segment.mesh, segment.members, segment.point_masses)
        structure = relaxed(structure)  # welded end to end, it has no supports
        shapes = modes(structure)
        own = [group for group in patches if group in WHOLE_GROUPS or group in segment.mesh.cell_groups]
        bodies.append(reduce_structure(structure, shapes, of_segment, damping, strain, patches=own))
    first = bodies[0]
    bodies[0] = replace(first, markers={**first.markers, "origin": rigidly_offset(first.markers[NEAR], np.zeros(3))})
    return tuple(bodies)


def rigidly_offset(marker: Marker, position: Array) -> Marker:
    """A marker at another undeformed position (3,) [m], rigidly connected to the given marker."""
    arm = position - marker.position
    phi = marker.phi + np.cross(marker.psi, arm, axisa=0, axisb=0, axisc=0)
    return Marker(position, phi, marker.psi, axis=marker.axis)
