"""From a mesh to a body in one call."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from femflex.body import FlexibleBody
from femflex.fem.structure import Member, build_structure
from femflex.mesh import Mesh, read_mesh
from femflex.reduction.boundary.clamps import Groups
from femflex.reduction.large_deflection.derivatives import with_derivatives
from femflex.reduction.modes.damping import Damping, ModalDamping
from femflex.reduction.modes.vibration import cantilever_modes, free_free_modes
from femflex.reduction.reduce import Strain, reduce_structure


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
    damping  ratio of critical of every mode, or a ModalDamping or RayleighDamping
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
    how = ModalDamping(damping) if isinstance(damping, int | float) else damping
    return reduce_structure(structure, shapes, places, how, strain)
