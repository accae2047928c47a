"""Structure and ModeSet -> FlexibleBody."""

from __future__ import annotations

from collections.abc import Container, Mapping, Sequence
from dataclasses import replace
from typing import Literal

import numpy as np

from femflex.arrays import Array, BoolArray, IntArray
from femflex.body import FlexibleBody, Skin, StrainTensors
from femflex.fem.deflected import tension_blocks
from femflex.fem.structure import Structure
from femflex.fem.tables import SectionInertia, element_chunks
from femflex.reduction.beams.strain_points import strain_field
from femflex.reduction.boundary.markers import attachable_nodes, marker, marker_rows
from femflex.reduction.boundary.rigid import check_no_rigid_motion, rigid_shapes, stands_by_springs
from femflex.reduction.inertia.mass_points import mass_points
from femflex.reduction.inertia.moments import linear_stiffness, mass_moments
from femflex.reduction.inertia.orders import first_order_part, membrane_cubic
from femflex.reduction.large_deflection.foreshortening import foreshortening
from femflex.reduction.modes.damping import UNANSWERED, Damping, ModalDamping, bending_damping, is_added, is_unanswered
from femflex.reduction.modes.modeset import ModeSet
from femflex.reduction.modes.nodal import is_lumped
from femflex.reduction.preload.equilibrium import is_preloaded
from femflex.reduction.strain.condense import condense
from femflex.reduction.strain.folded_beams import warn_of_folded_beams
from femflex.reduction.strain.following import able_to_follow
from femflex.reduction.strain.in_plane_turns import warn_of_in_plane_turns
from femflex.reduction.strain.initial_stress import warn_if_slack
from femflex.reduction.strain.omitted_shear import warn_of_omitted_shear
from femflex.reduction.strain.static_stretch import with_static_stretch
from femflex.reduction.strain.tensors import cubic_tensors, strain_tensors
from femflex.reduction.strain.turned_sections import sections_of, with_turned_sections

Strain = Literal["linear", "nonlinear", "condensed"]

MANY = 1200  # coordinates up to which the lowest shape of a set is sought
PARALLEL = 1e-9  # sine of the angle between the elements at a node that have one axis


def reduce_structure(
    structure: Structure,
    modes: ModeSet,
    markers: Mapping[str, str] | None = None,
    damping: Damping | None = None,
    strain: Strain = "linear",
    turning: Container[str] | None = None,
) -> FlexibleBody:
    """The FlexibleBody of a structure that moves in these shapes; the body frame is the mesh's coordinates.

    markers: name -> mesh group; the set's own groups (clamps, interfaces) are markers under their own names.
    damping: ModalDamping or RayleighDamping; none when left out.
    strain: "nonlinear" keeps the cubic and quartic tensors too; its set wants shapes that can stretch
    (`with_derivatives`, and `stretching` for a check); "condensed" lets the set's derivatives follow (`condense`),
    those that are slower than what drives them apart: they stay coordinates (`able_to_follow`).
    turning: markers whose rotation will be used; a warning tells of those that show none. Left out: all.
    A linear body knows how its lowest shape shortens (`foreshortening`), by which advice judges what it leaves out.
    Warns when linear strain meets an initial stress that the supports do not hold, when thin plates leave out shear
    that matters, and when plates whose strain is not linear turn in their own planes.
    Raises ValueError when a group is unknown, or the shapes depend on each other or contain a rigid motion.
    """
    if strain == "linear":
        warn_if_slack(structure, modes)
    else:
        warn_of_in_plane_turns(structure, modes)
    warn_of_omitted_shear(structure, modes)
    phi = modes.phi
    check_no_rigid_motion(_checked_rigid(structure), phi, dof_weight(structure))
    places = {**{group: group for group in modes.groups}, **(markers or {})}
    moments = mass_moments(structure.inertia, structure.T @ phi)
    V1 = linear_stiffness(structure.K, phi)
    damped = [strain == "linear" or kind != "derivative" for kind in modes.kinds]
    alone = _without_modes(structure, modes, strain)
    body = FlexibleBody(
        moments=moments,
        strain=_tensors(structure, phi, V1, strain),
        damping=bending_damping(
            damping or ModalDamping(0.0),
            moments.elastic_mass(),
            V1,
            damped,
            is_added(modes.kinds),
            alone,
        )
        + internal_damping(structure, phi, damped),
        markers={
            name: replace(
                marker(marker_rows(structure, group), phi, name, turning is None or name in turning),
                axis=np.zeros(3) if strain == "linear" else section_axis(structure, group),
            )
            for name, group in places.items()
        },
        skin=skin_of(structure, phi),
        kinds=tuple(
            "attachment" if kind == UNANSWERED and not own else kind
            for kind, own in zip(modes.kinds, alone, strict=True)
        ),
        omega=modes.omega,
        strain_field=strain_field(structure, phi, strain != "linear"),
        mass_points=mass_points(structure, phi),
    )
    if strain == "linear":
        known = 0 < modes.n_modes <= MANY and not is_lumped(structure) and not is_preloaded(structure, modes.held)
        return replace(body, foreshortening=foreshortening(structure, modes, markers) if known else None)
    return _followed(structure, modes, body, strain == "condensed", places)


def _checked_rigid(structure: Structure) -> Array:
    """Rigid motions that no shape may hold: none where springs to ground resist them, and rotations of straight
    strings held at one end are modes of theirs."""
    R = rigid_shapes(structure)
    if stands_by_springs(structure.K, structure.M, R):
        return R[:, :0]
    return R[:, :3] if len(tension_blocks(structure)) == len(structure.strain) else R


def _tensors(structure: Structure, phi: Array, V1: Array, strain: Strain) -> StrainTensors:
    """What a body of that strain holds; a condensed one, V3 over fewer shapes when it is known which."""
    if strain == "linear":
        return StrainTensors(V1, phi.T @ structure.f0)
    return strain_tensors(structure, phi) if strain == "nonlinear" else cubic_tensors(structure, phi)


def _without_modes(structure: Structure, modes: ModeSet, strain: Strain) -> BoolArray:
    """(n,): which shapes answer loads that move no mode; where strain is not linear, twist and bending alone.

    Stretch moves there in step with the square of the deflection (`bending_damping`).
    """
    alone = is_unanswered(modes.kinds)
    if strain != "linear":
        for k in np.flatnonzero(alone):
            alone[k] = first_order_part(structure, modes.phi[:, [k]]).any()
    return alone


def _followed(
    structure: Structure, modes: ModeSet, body: FlexibleBody, condensed: bool, places: dict[str, str]
) -> FlexibleBody:
    """The body with sections that turn; condensed, without V3 yet: with those derivatives slaved that can follow."""
    slaved = able_to_follow(body, _derivatives(modes)) if condensed else np.zeros(0, np.int64)
    sections = sections_of(structure, modes.phi)
    if sections is not None:
        first_order = [k for k, kind in enumerate(modes.kinds) if kind != "derivative"]  # the others are of second
        body = with_turned_sections(body, sections, first_order)
    if not condensed:
        return body
    if not len(slaved):
        return replace(body, strain=strain_tensors(structure, modes.phi))
    free = np.setdiff1d(np.arange(body.n_modes), slaved)
    warn_of_folded_beams(structure, len(free))
    first = first_order_part(structure, modes.phi[:, free])
    carried = membrane_cubic(structure, modes.phi[:, free])
    preloaded = is_preloaded(structure, modes.held)
    quartic = lambda free: strain_tensors(structure, modes.phi[:, free]).V3  # noqa: E731
    body = condense(body, slaved, quartic, first, carried, balanced=preloaded)
    return body if preloaded else with_static_stretch(structure, modes, body, free, places)


def _derivatives(modes: ModeSet) -> IntArray:
    """Numbers of the derivatives among the shapes."""
    found = np.flatnonzero([kind == "derivative" for kind in modes.kinds])
    if not len(found):
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
    return found


def dof_weight(structure: Structure) -> Array:
    """Root of the stiffness diagonal (n_dof,) [SI]: makes lengths, angles and other dofs comparable."""
    diagonal = structure.K.diagonal()
    return np.sqrt(np.maximum(diagonal, 1e-12 * diagonal.max(initial=0.0)))


def skin_of(structure: Structure, phi: Array) -> Skin | None:
    """Drawable surface with the displacements (n, n_p, 3) of its points per column of phi (n_dof, n), or None [m]."""
    if structure.skin is None:
        return None
    shapes = (structure.skin.operator @ phi).T.reshape(phi.shape[1], len(structure.skin.points), 3)
    return Skin(structure.skin.points, dict(structure.skin.cells), np.ascontiguousarray(shapes))


def section_axis(structure: Structure, group: str) -> Array:
    """Unit vector (3,) [1] along the beams of a group of one node; zero where they meet at an angle or others join
    them."""
    nodes = attachable_nodes(structure, group)
    turns = structure.numbering.rotation_of(nodes).ravel()
    held = turns[turns >= 0]
    beams = [block for block in structure.inertia if isinstance(block, SectionInertia)]
    if len(nodes) != 1 or not held.size or not beams:
        return np.zeros(3)
    axes = np.concatenate([block.axis[np.isin(block.dofs, held).any(axis=1)] for block in beams])
    joined = sum(np.isin(block.dofs, held).any(axis=1).sum() for block in structure.strain)
    alone = len(axes) == joined and np.linalg.norm(np.cross(axes, axes[0]), axis=1).max() < PARALLEL
    return np.asarray(axes[0] if alone else np.zeros(3))


def internal_damping(structure: Structure, phi: Array, damped: Sequence[bool]) -> Array:
    """D = int B0^T C tau B0 (n, n) of shapes phi (n_dof, n) [m, rad], over tethers and membranes with a viscosity tau.

    Of the strain's linear part, on the shapes `damped` alone: with nonlinear strain the others take back the stretch of
    bending (`femflex.reduction.modes.damping.bending_damping`).
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
