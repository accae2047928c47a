"""The tether family: lines with axial stiffness and mass, without stiffness against bending or twist."""

from __future__ import annotations

from functools import partial
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.polynomial import Legendre
from numpy.polynomial.legendre import legvander
from skfem.quadrature import get_quadrature
from skfem.refdom import RefLine

from femflex.arrays import Array, IntArray
from femflex.fem.assembly.numbering import Numbering
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
from femflex.fem.line.chain import LINE_TYPES, ArcLength, arc_length
from femflex.fem.sections.library import Shape
from femflex.fem.tables import DenseInertia
from femflex.fem.tension.strain import TensionStrain, interpolated_skin, least_squares
from femflex.mesh.cells import CELL_TYPES

if TYPE_CHECKING:
    from femflex.fem.structure import Member
    from femflex.mesh import Mesh


OPTIONS: Options = {
    "order": Option(None, "order of the displacements, 1 to 8; 4 when left out, 2 along edges of membranes"),
    "prestress": Option(0.0, "initial tension", "N"),
    "thermal_strain": Option(0.0, "free axial strain", ""),
    "viscosity": Option(0.0, "internal damping time: tension EA times viscosity times strain rate", "s"),
    "start": Option(None, "point group where the arc length of varying sections begins"),
}
ORDERS = range(1, 9)
DEFAULT_ORDER, EDGE_ORDER = 4, 2
VARYING_DEGREE = 8  # polynomial degree added to the quadrature where properties vary along the element
STATIONS = 5  # drawn points of an element


@family("tether", OPTIONS, dimension=1)
def tether(mesh: Mesh, member: Member, numbering: Numbering) -> Contribution:
    """Inertia, strain and skin of tethers, cables and strings on a group of line cells.

    Cells line (straight) or line3 (curved through its middle node). Section: a `CableSection`, or any beam section
    with an isotropic Material, of which EA and the mass per length count. The strain is that of Green,
    eps = t.u' + u'.u'/2 with the undeformed tangent t, with all three components of u in the square, so that large
    rotations are exact (THEORY section 3). Displacements are polynomials of the same order in all components.

    Without tension a tether has no stiffness across itself. Give it `prestress` between supports, or find its tension
    by static equilibrium under weight, spin or gravity gradient (`femflex.reduction.static_equilibrium`).

    A member that lies along edges of membranes has order 2 by default, and shares all displacements with them.

    Mesh advice: order 4 gives the frequency of a mode with m elements in a half wave to about (0.7 / m)^8.
    """
    options = _checked_options(member_options(member), member)
    cells = member_cells(mesh, member, LINE_TYPES)
    order = options["order"] or (EDGE_ORDER if _on_membrane(mesh, cells, numbering) else DEFAULT_ORDER)
    arcs = _arcs(mesh, cells, member, options["start"])
    inertia, strain, places, skins = [], [], [], []
    for kind, nodes in cells.items():
        x = mesh.points[nodes]
        dofs = _dofs(numbering, nodes, kind, order)
        inertia_block, strain_block, strain_places = _blocks(x, dofs, kind, order, member, options, arcs[kind])
        inertia.append(inertia_block)
        strain.append(strain_block)
        places.append(strain_places)
        skins.append((x, dofs, kind, order))
    return Contribution(tuple(inertia), tuple(strain), partial(_skin, skins), tuple(places))


def line_shapes(kind: str, order: int, xi: Array, derivative: bool = False) -> Array:
    """Shape functions (q, m) of an element at xi (q,) in [0, 1]: those of its nodes, then those that vanish at the
    nodes.

    line: of its two ends, 4 xi (1 - xi), and from order 3 on integrated Legendre polynomials. line3: of its three
    nodes, and the same from order 3 on.
    """
    cell = CELL_TYPES[kind]
    nodal = cell.gradients(xi[:, None])[:, :, 0] if derivative else cell.interpolation(xi[:, None])
    inner = [4.0 - 8.0 * xi if derivative else 4.0 * xi * (1.0 - xi)] if kind == "line" and order >= 2 else []
    for k in range(3, order + 1):
        base = np.sqrt(2 * k - 1) * Legendre.basis(k - 1, domain=[0.0, 1.0])
        inner.append(base(xi) if derivative else base.integ(1, lbnd=0.0)(xi))
    return np.concatenate([nodal, *(shape[:, None] for shape in inner)], axis=1)


def _dofs(numbering: Numbering, nodes: IntArray, kind: str, order: int) -> IntArray:
    """Raw dofs (e, m, 3) of the shape functions of elements between nodes (e, 2|3)."""
    e = len(nodes)
    dofs = [numbering.translation(nodes.ravel()).reshape(e, -1, 3)]
    ends = nodes[:, :2]
    if kind == "line" and order >= 2:
        dofs.append(numbering.sides(ends)[:, None])
    if order >= 3:
        dofs.append(numbering.fading(ends, order - 2))
    return np.concatenate(dofs, axis=1)


def _blocks(
    x: Array, dofs: IntArray, kind: str, order: int, member: Member, options: dict[str, Any], arc: ArcLength
) -> tuple[DenseInertia, TensionStrain, StrainPlaces]:
    """Points of mass and of strain of elements with nodes at x (e, 2|3, 3)."""
    varying = VARYING_DEGREE * member.section.varies
    curved = 2 * (kind == "line3")

    def quadrature_along(degree: int) -> tuple[Array, Array, Array, tuple[Array, Array]]:
        points, weights = get_quadrature(RefLine, degree + curved + varying)
        xi = points[0]
        slope = line_shapes(kind, 2 if kind == "line3" else 1, xi, True) @ x
        ds = np.linalg.norm(slope, axis=2)
        return xi, weights * ds, slope / ds[..., None], axial_properties(member, arc.arc_at(xi), arc.whole[:, None])

    def positions(xi: Array) -> Array:
        return np.asarray(line_shapes(kind, 2 if kind == "line3" else 1, xi) @ x)

    m, e = dofs.shape[1], len(x)
    flat = dofs.reshape(e, 3 * m)
    xi, ds, _, (_, mass) = quadrature_along(2 * order)
    N = np.einsum("qm,ab->qamb", line_shapes(kind, order, xi), np.eye(3)).reshape(1, len(xi), 3, 3 * m)
    inertia = DenseInertia(flat, ds * mass, positions(xi), N)

    xi, ds, tangent, (EA, _) = quadrature_along(max(2, 4 * (order - 1)))
    weights = get_quadrature(RefLine, max(2, 4 * (order - 1)) + curved + varying)[1]
    slope = line_shapes(kind, order, xi, True) / (ds / weights)[..., None]  # d/ds of the shape functions (e, q, m)
    G = np.einsum("eqgb,eqm->eqgmb", frames(tangent), slope).reshape(e, len(xi), 3, 3 * m)
    stress = options["prestress"] - EA * options["thermal_strain"]
    strain = TensionStrain(
        dofs=flat,
        weight=ds,
        elastic=EA[..., None, None],
        linear_map=np.eye(1, 3),
        quadratic_map=np.eye(3)[None],
        G=G,
        stress=stress[..., None],
        group=member.group,
        family="tether",
        places=positions(xi),
        shape_functions=line_shapes(kind, order, xi),
        smoothing=least_squares(np.asarray(legvander(2 * xi - 1, order - 1), float), weights),
        viscosity=options["viscosity"],
    )
    section = member.section
    fibres = section.fibres(arc.arc_at(xi), arc.whole[:, None]) if isinstance(section, Shape) else None
    return inertia, strain, StrainPlaces("line", positions(xi), fibres=fibres)


def frames(x: Array) -> Array:
    """Orthonormal axes (..., 3, 3) as rows, the first of them x (..., 3)."""
    least = np.eye(3)[np.abs(x).argmin(axis=-1)]
    y = np.cross(least, x)
    y /= np.linalg.norm(y, axis=-1, keepdims=True)
    return np.stack([x, y, np.cross(x, y)], axis=-2)


def check_axial_section(member: Member) -> None:
    """Raise ValueError for a section without axial stiffness and mass."""
    if not (hasattr(member.section, "axial") or hasattr(member.section, "resultants")):
        raise ValueError(
            f"{member.family} on group {member.group!r} has section {member.section!r}; give a cable section (EA and "
            "mass per length) or one of the beam sections with a material"
        )


def axial_properties(member: Member, s: Array, length: Array) -> tuple[Array, Array]:
    """EA [N] and mass per length [kg/m] of a member's section at arc lengths s (e, q)."""
    if hasattr(member.section, "axial"):
        EA, mass = member.section.axial(s, length)
    else:
        resultants = member.section.resultants(member.material, s, length)
        EA, mass = resultants.EA, resultants.mass
    return np.broadcast_to(EA, s.shape), np.broadcast_to(mass, s.shape)


def _arcs(mesh: Mesh, cells: dict[str, IntArray], member: Member, start: str | None) -> dict[str, ArcLength]:
    """Arc length at the ends of the elements by cell type, by chords; zero where nothing varies."""
    ends = [nodes[:, :2] for nodes in cells.values()]
    if not member.section.varies:
        return {kind: ArcLength(np.zeros((len(e), 2)), np.ones(len(e))) for kind, e in zip(cells, ends, strict=True)}
    arc = arc_length(mesh, np.concatenate(ends), member.group, start)
    cuts = np.cumsum([0, *(len(e) for e in ends)])
    spans = pairwise(cuts)
    return {kind: ArcLength(arc.ends[a:b], arc.whole[a:b]) for kind, (a, b) in zip(cells, spans, strict=True)}


def _on_membrane(mesh: Mesh, cells: dict[str, IntArray], numbering: Numbering) -> bool:
    """Whether any element has both ends on a membrane of the structure."""
    on = np.zeros(len(mesh.points), bool)
    for other in numbering.members:
        if other.family == "membrane" and other.group in mesh.groups:
            on[mesh.group_points(other.group)] = True
    return any(bool(on[nodes[:, :2]].all(axis=1).any()) for nodes in cells.values())


def _skin(parts: list[tuple[Array, IntArray, str, int]]) -> SkinPart:
    """Lines through STATIONS points of every element."""
    xi, first = np.linspace(0.0, 1.0, STATIONS), np.arange(STATIONS - 1)
    drawn = [
        (line_shapes(kind, 2 if kind == "line3" else 1, xi) @ x, dofs, line_shapes(kind, order, xi))
        for x, dofs, kind, order in parts
    ]
    return interpolated_skin("line", np.stack([first, first + 1], axis=1), drawn)


def _checked_options(options: dict[str, Any], member: Member) -> dict[str, Any]:
    """Return the options; ValueError for a section or values that the family cannot use."""
    where = f"tether on group {member.group!r}"
    check_axial_section(member)
    if options["order"] is not None and options["order"] not in ORDERS:
        raise ValueError(f"{where} has order {options['order']!r}; it may be {ORDERS.start} to {ORDERS.stop - 1}")
    for name in ("prestress", "thermal_strain", "viscosity"):
        if not isinstance(options[name], int | float | np.floating) or not np.isfinite(options[name]):
            raise ValueError(f"{where} has {name} {options[name]!r}; give one finite number")
    if options["prestress"] < 0:
        raise ValueError(
            f"{where} has prestress {options['prestress']:g} N; a tether carries no compression, so give a tension"
        )
    if options["viscosity"] < 0:
        raise ValueError(f"{where} has viscosity {options['viscosity']:g} s; a damping time cannot be negative")
    return options
