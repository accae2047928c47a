"""Solid members: isoparametric hexahedra on the translations of their nodes.

The 27-node hexahedron bends without locking; the 8-node one does not and is offered with a warning.
"""

from __future__ import annotations

import warnings
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from skfem.quadrature import get_quadrature
from skfem.refdom import RefHex

from femflex.fem.assembly.numbering import Numbering
from femflex.fem.family import Contribution, StrainPlaces, family, member_cells
from femflex.fem.option import Option, Options, member_options
from femflex.fem.sections.materials import Material
from femflex.fem.solid.blocks import SolidInertia, SolidStrain, isotropic_elasticity, strain_maps
from femflex.fem.solid.skin import solid_skin
from femflex.mesh.cells import CELL_TYPES
from femflex.warning import PhysicsWarning

if TYPE_CHECKING:
    from femflex.fem.structure import Member
    from femflex.mesh import Mesh

Array = NDArray[np.float64]
Index = NDArray[np.int64]

STRAY = 0.5  # distance of a middle node from the mean of its corners, over theirs from it, that no curved cell needs
# Degree per direction that the quadrature integrates: 3 points for tensor-quadratic cells, 2 for tensor-linear ones.
DEGREE = {"hexahedron27": 4, "hexahedron": 3}
OPTIONS: Options = {
    "prestress": Option(None, "initial stress xx, yy, zz, yz, xz, xy, mesh axes", "Pa", (6,)),
    "thermal_strain": Option(None, "free strain in all directions", ""),
}


@family("solid", OPTIONS)
def solid(mesh: Mesh, member: Member, numbering: Numbering) -> Contribution:
    """Solid elements on the hexahedron27 (or hexahedron) cells of the member's group.

    section   none
    material  Material
    options   prestress       (6,) initial stress xx, yy, zz, yz, xz, xy, mesh axes [N/m^2]
              thermal_strain  free strain in all directions

    Raises ValueError without a material, with a section, or when an element is turned inside out.
    """
    options = member_options(member)
    material = member.material
    if material is None:
        raise ValueError(f"solid on group {member.group!r} has no material; give one")
    if member.section is not None:
        raise ValueError(f"solid on group {member.group!r} has a section; a solid has none, its mesh is the shape")
    cells = member_cells(mesh, member, tuple(DEGREE))
    inertia, strain, places = [], [], []
    for name, nodes in cells.items():
        if name == "hexahedron":
            _warn_of_locking(mesh.points[nodes], material, member.group)
        _check_order(name, mesh.points[nodes], member.group)
        dofs = numbering.translation(nodes.ravel()).reshape(len(nodes), -1)
        N, weight, rho, G = _at_points(name, mesh.points[nodes], member.group)
        inertia.append(SolidInertia(dofs, weight * material.density, rho, N))
        linear, quadratic = strain_maps()
        elastic = isotropic_elasticity(material)
        stress = _initial_stress(options, elastic)[None, None]
        strain.append(SolidStrain(dofs, weight, elastic[None, None], linear, quadratic, G, stress))
        places.append(StrainPlaces("solid", rho))
    return Contribution(
        tuple(inertia), tuple(strain), partial(solid_skin, mesh.points, cells, numbering), tuple(places)
    )


def _initial_stress(options: dict[str, Any], elastic: Array) -> Array:
    """Initial stress (6,): the prestress less what the thermal strain would need."""
    stress = np.zeros(6) if options["prestress"] is None else np.asarray(options["prestress"], float)
    strain = 0.0 if options["thermal_strain"] is None else float(options["thermal_strain"])
    if stress.shape != (6,) or not np.isfinite(stress).all() or not np.isfinite(strain):
        raise ValueError(
            f"prestress of a solid is {options['prestress']!r} and thermal_strain {options['thermal_strain']!r}; give "
            "six finite stresses xx, yy, zz, yz, xz, xy, and one number"
        )
    return stress - elastic[:, :3].sum(axis=1) * strain


def _at_points(name: str, corners: Array, group: str) -> tuple[Array, Array, Array, Array]:
    """Shape functions (q, k), volumes (e, q), places (e, q, 3) and gradients (e, q, 3, k) at the quadrature points."""
    points, reference_weight = get_quadrature(RefHex, DEGREE[name])
    cell = CELL_TYPES[name]
    N, dN = cell.interpolation(points.T), cell.gradients(points.T)  # (q, k), (q, k, 3)
    q, k = N.shape
    along = dN.swapaxes(1, 2).reshape(3 * q, k)
    centred = corners - corners[:, :1]  # far from the origin, coordinates round more than an element's own
    jacobian = np.matmul(along, centred).reshape(-1, q, 3, 3)  # row: reference axis, column: x, y, z
    inverse, volume = _inverse(jacobian)
    inside_out = np.flatnonzero((volume <= 0).any(axis=1))
    if len(inside_out):
        raise ValueError(
            f"solid on group {group!r}: {len(inside_out)} of {len(corners)} {name} elements are turned inside out or "
            f"folded (element {inside_out[0]} has a Jacobian determinant of {volume[inside_out[0]].min():.3g} m^3); "
            "repair the mesh"
        )
    G = np.matmul(inverse, dN.swapaxes(1, 2))
    return N, volume * reference_weight, np.matmul(N, corners), G


def _check_order(name: str, x: Array, group: str) -> None:
    """Raise ValueError when nodes (e, k, 3) do not lie where their order says: near the mean of their corners."""
    places = CELL_TYPES[name].nodes
    corners = places[:8]
    for node in range(8, len(places)):
        near = np.flatnonzero(np.all((places[node] == 0.5) | (corners == places[node]), axis=1))
        mean = x[:, near].mean(axis=1)
        reach = np.linalg.norm(x[:, near] - mean[:, None], axis=2).min(axis=1)
        stray = np.flatnonzero(np.linalg.norm(x[:, node] - mean, axis=1) > STRAY * reach)
        if len(stray):
            raise ValueError(
                f"solid on group {group!r}: node {node} of {len(stray)} of {len(x)} {name} elements (first element "
                f"{stray[0]}) lies far from the middle of its corners; the nodes must be in VTK's order"
            )


def _inverse(J: Array) -> tuple[Array, Array]:
    """Inverses (e, q, 3, 3) and determinants (e, q) of matrices, by cross products of their rows."""
    a, b, c = J[..., 0, :], J[..., 1, :], J[..., 2, :]
    columns = np.stack([np.cross(b, c), np.cross(c, a), np.cross(a, b)], axis=-1)
    determinant = np.sum(a * columns[..., 0], axis=-1)
    safe = np.where(determinant == 0, 1.0, determinant)
    return columns / safe[..., None, None], determinant


def _warn_of_locking(corners: Array, material: Material, group: str) -> None:
    """Warn of the bending stiffness of 8-node bricks of these corners (e, 8, 3).

    In pure bending of a brick of length a and height b the parasitic shear adds (1 - nu)/2 (a/b)^2 to 1.
    """
    edges = np.linalg.norm(corners[:, [1, 3, 4]] - corners[:, :1], axis=2)
    slenderness = float((edges.max(axis=1) / edges.min(axis=1)).max())
    factor = 1 + (1 - material.nu) / 2 * slenderness**2
    warnings.warn(
        f"solid on group {group!r} is made of 8-node hexahedra, up to {slenderness:.3g} times as long as thick: one "
        f"layer of them bends up to {factor:.3g} times too stiffly (1 is right); use hexahedron27 cells",
        PhysicsWarning,
        stacklevel=2,
    )
