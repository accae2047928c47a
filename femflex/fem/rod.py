"""The rod family: straight bars with axial stiffness and mass alone, in tension and compression."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from femflex.arrays import Array, IntArray
from femflex.fem.assembly.numbering import Numbering
from femflex.fem.family import Contribution, SkinPart, StrainPlaces, family, member_cells
from femflex.fem.sections.library import Shape
from femflex.fem.tables import DenseInertia, DenseStrain
from femflex.fem.tension.tether import axial_properties, check_axial_section, frames

if TYPE_CHECKING:
    from femflex.fem.structure import Member
    from femflex.mesh import Mesh


GAUSS = np.array([0.5 - np.sqrt(3) / 6, 0.5 + np.sqrt(3) / 6])  # positions in [0, 1] of two points of equal weight


@family("rod", {}, dimension=1)
def rod(mesh: Mesh, member: Member, numbering: Numbering) -> Contribution:
    """Inertia, strain and skin of straight rods, joined to others by ball joints: trusses.

    Cells line. Section: a `CableSection`, or any uniform beam section with an isotropic Material, of which EA and the
    mass per length count. The strain is that of Green with the straight chord, eps = t.u' + u'.u'/2; the displacement
    is linear between the ends, so that a rod neither bends nor vibrates across. No options.

    Rods carry compression and need no tension; their nodes have no rotation. A truss must be braced: mechanisms must be
    clamped.
    """
    section, where = member.section, f"rod on group {member.group!r}"
    check_axial_section(member)
    if section.varies:
        raise ValueError(f"{where} has a section that varies; rods are uniform, so give numbers")
    nodes = member_cells(mesh, member, ("line",))["line"]
    x = mesh.points[nodes]
    span = x[:, 1] - x[:, 0]
    length = np.linalg.norm(span, axis=1)
    if not (length > 0).all():
        raise ValueError(f"{where} has {int((length <= 0).sum())} line cells of no length")
    s, whole_length = np.zeros((1, 1)), np.ones((1, 1))
    EA, mass = axial_properties(member, s, whole_length)
    dofs = numbering.translation(nodes.ravel()).reshape(-1, 6)
    shapes = np.stack([1 - GAUSS, GAUSS], axis=1)  # (q, 2)
    N = np.einsum("qk,ij->qikj", shapes, np.eye(3)).reshape(1, 2, 3, 6)
    dm = length[:, None] / 2 * mass * np.ones((1, 2))
    inertia = DenseInertia(dofs, dm, np.matmul(shapes, x), N)
    tangent = span / length[:, None]
    axes = frames(tangent)
    G = np.concatenate([-axes, axes], axis=2)[:, None] / length[:, None, None, None]  # rows of u' along the axes
    elastic = np.broadcast_to(EA[..., None, None], (len(nodes), 1, 1, 1))
    strain = DenseStrain(dofs, length[:, None], elastic, np.eye(1, 3), np.eye(3)[None], G)
    fibres = section.fibres(s, 1.0) if isinstance(section, Shape) else None
    places = StrainPlaces("line", x.mean(axis=1)[:, None], fibres=fibres)
    return Contribution((inertia,), (strain,), partial(_skin, x, dofs), (places,))


def _skin(x: Array, dofs: IntArray) -> SkinPart:
    """The lines between the ends."""
    lines = np.arange(2 * len(x)).reshape(-1, 2)
    return SkinPart(x.reshape(-1, 3), {"line": lines}, np.arange(dofs.size), dofs.ravel(), np.ones(dofs.size))
