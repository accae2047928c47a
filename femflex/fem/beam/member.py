"""The beam family: straight Euler-Bernoulli elements in space with axial force, torsion and bending in two planes."""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from skfem.quadrature import get_quadrature
from skfem.refdom import RefLine

from femflex.fem.assembly.numbering import Numbering
from femflex.fem.beam.shapes import NODAL, BeamOrder, field_rows
from femflex.fem.beam.skin import swept_outline
from femflex.fem.family import Contribution, StrainPlaces, family, member_cells, member_options
from femflex.fem.line.chain import LINE_TYPES, ArcLength, arc_length, element_frames, straight_elements
from femflex.fem.sections.section import Resultants
from femflex.fem.tables import DenseInertia, DenseStrain
from femflex.warning import PhysicsWarning

if TYPE_CHECKING:
    from femflex.fem.structure import Member
    from femflex.mesh import Mesh

Array = NDArray[np.float64]
Index = NDArray[np.int64]

OPTIONS: dict[str, Any] = {
    "order": 3,
    "axial_order": None,
    "orientation": None,
    "rotary_inertia": True,
    "start": None,
    "extent": None,
    "prestress": 0.0,
    "thermal_strain": 0.0,
}
ORDERS = range(3, 9)
VARYING_DEGREE = 8  # polynomial degree added to the quadrature where properties vary along the element
SLENDER = 20.0  # length over radius of gyration below which shear, left out here, shifts the first mode by over 1 %


@dataclass(frozen=True, eq=False)
class BeamElements:
    """Geometry and dofs of a member's elements.

    origin (e, 3), length (e,), frame (e, 3, 3) rows x, y, z; dofs (e, n_local); arc: arc length along the member
    """

    origin: Array
    length: Array
    frame: Array
    dofs: Index
    arc: ArcLength
    order: BeamOrder

    def rows(self, xi: Array, derivative: int = 0) -> Array:
        """Rows of u, v, w, theta in element axes on the element's (global) dofs at xi (q,): (e, q, 4, n_local)."""
        rows = field_rows(self.order, xi, self.length, derivative)
        for node in range(0, NODAL, 3):
            rows[..., node : node + 3] = np.matmul(rows[..., node : node + 3], self.frame[:, None])
        return rows

    def places(self, xi: Array, offsets: Array) -> Array:
        """Undeformed positions (e, q, k, 3) of section points offsets (e, q, k, 2) at xi (q,)."""
        axis = self.origin[:, None] + self.length[:, None, None] * xi[:, None] * self.frame[:, None, 0]
        return axis[:, :, None] + np.matmul(offsets, self.frame[:, None, 1:])

    def motion(self, xi: Array, offsets: Array, rotary: bool = True) -> Array:
        """Rows of the global displacement u + theta x offset of section points: (e, q, k, 3, n_local).

        Without rotary the section moves along x as a whole: the offsets see the twist alone.
        """
        rows = self.rows(xi)
        y, z = offsets[..., 0, None], offsets[..., 1, None]
        u, v, w, theta = (rows[:, :, None, i] for i in range(4))
        axial = np.broadcast_to(u, (*offsets.shape[:3], rows.shape[-1]))
        if rotary:
            slope = self.rows(xi, 1)
            axial = u - y * slope[:, :, None, 1] - z * slope[:, :, None, 2]
        local = np.stack([axial, v - z * theta, w + y * theta], axis=-2)
        return np.matmul(self.frame.swapaxes(1, 2)[:, None, None], local)


@family("beam")
def beam(mesh: Mesh, member: Member, numbering: Numbering) -> Contribution:
    """Inertia, strain and skin of 3-D Euler-Bernoulli beams on a group of line cells.

    Cells line, or line3, which is two straight elements joined at its middle node. Section: any of
    `femflex.fem.sections`; a shape needs an isotropic Material. Fields: bending cubic Hermite with bubbles up
    to `order`, axial and torsion of order max(2, order - 1). Strains: eps = u' + (u'^2 + v'^2 + w'^2)/2 + (I_p/2A)
    theta'^2, curvatures v'' and -w'', twist (THEORY section 3).

    Options
    order           3 ... 8, order of the bending fields (3)
    axial_order     of the axial and torsional fields, if not max(2, order - 1)
    orientation     (3,) vector near the section's y axis; see chain.element_frames for the default
    rotary_inertia  True; False leaves out the section's rotary inertia in bending (torsional inertia stays), as
                    the classical closed forms beta L do
    start           point group where the arc length s begins; see chain.arc_length for the default
    extent          length of the line the group is a part of [m], if it is one: shear is judged by that
    prestress       initial axial force, tension positive [N] (0)
    thermal_strain  free axial strain (0)

    Mesh advice: the relative error of a bending frequency is (beta h)^4 / 1440 at order 3, h the element length and
    beta = (m' omega^2 / EI)^(1/4). The default order wants beta h < 0.19 for 1e-6: 10 elements for the first mode
    of a cantilever, 25 for the second, 75 for the fifth; more than a few hundred only gather rounding. Order 6 wants
    beta h < 2.5: four elements give the first three modes of a cantilever to 1e-7, at a tenth of the dofs.
    Properties that vary are integrated with more points; a kink in a table wants a node.
    """
    options = _checked(member_options(member, OPTIONS), member)
    elements = _elements(mesh, member, numbering, options)
    order, varying = elements.order, member.section.varies
    blocks = _inertia(elements, member, 2 * order.bending + VARYING_DEGREE * varying, options["rotary_inertia"])
    degree = 4 * (max(order.bending, order.axial) - 1) + VARYING_DEGREE * varying
    strain = _strain(elements, member, degree, options)
    axis = elements.places(_stations(elements, member, degree)[0], np.zeros((*strain.weight.shape, 1, 2)))[:, :, 0]
    places = StrainPlaces("line", axis)
    return Contribution((blocks,), (strain,), partial(swept_outline, elements, member.section), (places,))


def _elements(mesh: Mesh, member: Member, numbering: Numbering, options: dict[str, Any]) -> BeamElements:
    nodes = straight_elements(member_cells(mesh, member, LINE_TYPES))
    start, end = mesh.points[nodes[:, 0]], mesh.points[nodes[:, 1]]
    length, frame = element_frames(start, end, options["orientation"], member.group)
    if member.section.varies:
        arc = arc_length(mesh, nodes, member.group, options["start"])
    else:
        arc = ArcLength(np.zeros((len(nodes), 2)), np.ones(len(nodes)))
    order = BeamOrder(options["order"], options["axial_order"])
    nodal = [numbering.translation(nodes.ravel()), numbering.rotation(nodes.ravel())]
    n_bubbles = order.n_local - NODAL
    bubbles = numbering.extra(len(nodes) * n_bubbles, np.repeat(nodes, n_bubbles, axis=0)).reshape(len(nodes), -1)
    dofs = np.concatenate([np.concatenate(nodal, axis=1).reshape(-1, NODAL), bubbles], axis=1)
    return BeamElements(start, length, frame, dofs, arc, order)


def _inertia(elements: BeamElements, member: Member, degree: int, rotary: bool) -> DenseInertia:
    """Four points per station at (+-sqrt(2) rz, 0) and (0, +-sqrt(2) ry): the section's mass and second moments."""
    xi, weight, r = _stations(elements, member, degree)
    a, b = np.sqrt(2 * r.rz2), np.sqrt(2 * r.ry2)
    o = np.zeros_like(a)
    offsets = np.stack([a, o, -a, o, o, b, o, -b], axis=-1).reshape(*a.shape, 4, 2)
    dm = np.repeat(weight * r.mass / 4, 4, axis=1)
    rho = elements.places(xi, offsets).reshape(*dm.shape, 3)
    N = elements.motion(xi, offsets, rotary).reshape(*dm.shape, 3, -1)
    _warn_if_stout(rho, np.sqrt(np.maximum(r.ry2, r.rz2)).max(), member)
    return DenseInertia(elements.dofs, dm, rho, N)


def _strain(elements: BeamElements, member: Member, degree: int, options: dict[str, Any]) -> DenseStrain:
    """Strains (eps, kappa_z, kappa_y, r theta') of gradients (u', v', w', r theta', v'', w''), r^2 = I_p / A.

    The twist is carried as r theta' with stiffness GJ / r^2, so that its share of the axial strain is a constant too.
    """
    xi, weight, r = _stations(elements, member, degree)
    first, second = elements.rows(xi, 1), elements.rows(xi, 2)
    first[:, :, 3] *= np.sqrt(r.polar2)[..., None]
    elastic = np.stack([r.EA, r.EIz, r.EIy, r.GJ / r.polar2], axis=-1)[..., None] * np.eye(4)
    linear_map = np.zeros((4, 6))
    linear_map[[0, 1, 2, 3], [0, 4, 5, 3]] = 1.0, 1.0, -1.0, 1.0
    quadratic_map = np.zeros((4, 6, 6))
    quadratic_map[0, range(4), range(4)] = 1.0
    G = np.concatenate([first, second[:, :, 1:3]], axis=2)
    stress = np.zeros((*weight.shape, 4))
    stress[:, :, 0] = options["prestress"] - r.EA * options["thermal_strain"]
    return DenseStrain(elements.dofs, weight, elastic, linear_map, quadratic_map, G, stress)


def _stations(elements: BeamElements, member: Member, degree: int) -> tuple[Array, Array, Resultants]:
    """Gauss points xi (q,), lengths they stand for (e, q) [m], and the section's resultants there (e, q)."""
    points, weights = get_quadrature(RefLine, degree)
    s = elements.arc.at(points[0])
    resultants = member.section.resultants(member.material, s, elements.arc.whole[:, None])
    return points[0], elements.length[:, None] * weights, resultants


def _checked(options: dict[str, Any], member: Member) -> dict[str, Any]:
    """The options with defaults that depend on others filled in; ValueError on values the family cannot use."""
    where = f"beam on group {member.group!r}"
    order = options["order"]
    if order not in ORDERS:
        raise ValueError(f"{where} has order {order!r}; it may be {ORDERS.start} to {ORDERS.stop - 1}")
    axial = max(2, order - 1) if options["axial_order"] is None else options["axial_order"]
    if axial not in range(1, ORDERS.stop):
        raise ValueError(f"{where} has axial_order {axial!r}; it may be 1 to {ORDERS.stop - 1}")
    if not hasattr(member.section, "resultants"):
        raise ValueError(
            f"{where} has section {member.section!r}; give one of femflex.fem.sections (tube, box, rectangle, I, ...)"
        )
    for name in ("prestress", "thermal_strain"):
        if not isinstance(options[name], int | float | np.floating) or not np.isfinite(options[name]):
            raise ValueError(f"{where} has {name} {options[name]!r}; give one finite number")
    orientation = options["orientation"]
    if orientation is not None:
        orientation = np.asarray(orientation, float)
        if orientation.shape != (3,) or not np.isfinite(orientation).all() or not orientation.any():
            raise ValueError(f"{where} has orientation {orientation.tolist()}; give three components, not all zero")
    return {**options, "order": int(order), "axial_order": int(axial), "orientation": orientation}


def _warn_if_stout(rho: Array, gyration: float, member: Member) -> None:
    extent = member.options.get("extent") or float(np.linalg.norm(np.ptp(rho.reshape(-1, 3), axis=0)))
    if extent < SLENDER * gyration:
        warnings.warn(
            f"beam group {member.group!r} extends over {extent:.4g} m with a radius of gyration of {gyration:.4g} m; "
            f"below {SLENDER:g} radii ({SLENDER * gyration:.4g} m) the shear left out here shifts frequencies by per "
            "cents",
            PhysicsWarning,
            stacklevel=6,
        )
