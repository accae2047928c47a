"""Shell members: quadrilaterals of 4, 8 and 9 nodes and triangles of 3 and 6, warped, curved and folded."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from skfem.quadrature import get_quadrature
from skfem.refdom import RefTri

from femflex.fem.assembly.numbering import Numbering
from femflex.fem.family import Contribution, StrainPlaces, family, member_cells
from femflex.fem.option import Option, Options, member_options
from femflex.fem.plate.dof_map import member_section
from femflex.fem.plate.elastic import OPTIONS as PLATE_OPTIONS
from femflex.fem.sections.laminates import PlateSection
from femflex.fem.shell.blocks import ShellInertia, ShellStrain, strain_maps
from femflex.fem.shell.directors import directors, normals_at_nodes
from femflex.fem.shell.drilling import drilling
from femflex.fem.shell.fields import ShellGeometry, areas, gradient_rows
from femflex.fem.shell.skin import shell_skin
from femflex.fem.tables import DenseStrain, StrainBlock
from femflex.mesh.cells import CELL_TYPES
from femflex.mesh.quality import quadrature
from femflex.mesh.raised import raised
from femflex.warning import PhysicsWarning

if TYPE_CHECKING:
    from femflex.fem.structure import Member
    from femflex.mesh import Mesh

Array = NDArray[np.float64]
Index = NDArray[np.int64]

CELLS = ("triangle", "triangle6", "quad", "quad9")
FLAT_AREA = 1e-10  # of the longest side squared: area below which an element has none
WARPED = 15.0  # [deg] between the normals at two corners of a four-node element, from which a warning says so
FOLDED = 120.0  # [deg] from which such an element is refused: its nodes go across
CONSTANT_SHARE = 0.2  # of the area in three-node triangles, whose membrane strain is constant, that passes unsaid
FOLD_ANGLE = 20.0  # [deg]
OPTIONS: Options = {
    **PLATE_OPTIONS,
    "offset": Option(0.0, "height of the section's middle above the nodes, along the elements' normals", "m"),
    "fold_angle": Option(
        float(np.radians(FOLD_ANGLE)), "angle between neighbouring elements above which their edge is a fold", "rad"
    ),
}


def centred_quads(mesh: Mesh, members: Sequence[Member]) -> tuple[Mesh, tuple[str, ...]]:
    """The mesh with a node in the centre of the eight-node quadrilaterals of shell members, and what is reported."""
    own = [mesh.cell_groups.get(m.group, {}).get("quad8") for m in members if m.family == "shell"]
    rows = [part for part in own if part is not None and len(part)]
    if not rows:
        return mesh, ()
    chosen = np.unique(np.concatenate(rows))
    text = f"{len(chosen)} eight-node quadrilaterals of shells get a node in their centre (nine nodes)"
    return raised(mesh, {"quad8": chosen}), (text,)


@family("shell", OPTIONS, prepare=centred_quads)
def shell(mesh: Mesh, member: Member, numbering: Numbering) -> Contribution:
    """Shell elements of any thickness on the quadrilaterals and triangles of the member's group, also mixed.

    section   PlateSection, or a thickness [m] with a material
    material  Material, with a thickness only
    options   axis            (3,) direction in the mesh's axes of the section's x axis, laid into the surface
              prestress       (Nx, Ny, Nxy) initial membrane forces in the section's axes [N/m]
              thermal_strain  free strain, a number or (xx, yy, xy) in the section's axes
              offset          height of the section's middle above the nodes, along the elements' normals [m]
              fold_angle      angle between neighbouring elements above which their common edge is a fold [rad]

    Nodes have three translations and the rotations across their director; rotation about it too at folds, branches and
    where other members turn them. Curved edges of six-, eight- and nine-node elements are used; four-node elements may
    be warped. Eight-node elements get a node in their centre.

    Mesh: six-, eight- and nine-node elements come within 2 % of MacNeal and Harder's answers on their finest standard
    meshes; four-node elements on most (docs/howto/elements.md). Three-node triangles have constant membrane strain: a
    few among quadrilaterals do, a mesh of them is better served by the `plate` family.
    """
    options, where = member_options(member), f"shell on group {member.group!r}"
    section = _shifted(member_section(member, coupled=True), options["offset"], where)
    cells = member_cells(mesh, member, CELLS)
    for name, nodes in cells.items():
        _check_shapes(name, mesh.points[nodes], where)
    _warn_of_constant_strain(mesh.points, cells, where)
    angle = options["fold_angle"]
    if not isinstance(angle, int | float | np.floating) or not 0 < angle < np.pi / 2:
        raise ValueError(f"{where} has fold_angle {angle!r}; give an angle between 0 and pi/2 (90 deg)")
    surface = directors(mesh.points, cells, float(angle))
    elastic, stress = elastic_matrix(section), _initial_stress(section, options, where)
    axis = _direction(options["axis"], where)
    linear, quadratic = strain_maps()
    inertia, strain, places = [], [], []
    late: list[Callable[[], tuple[DenseStrain, ...]]] = []
    dofs_of = {}
    for name, nodes in cells.items():
        x, V = mesh.points[nodes], surface.V[name]
        geometry = ShellGeometry(name, x, V, axis, section.A)
        numbers = [numbering.translation(nodes.ravel()), numbering.rotation(nodes.ravel(), V.reshape(-1, 3))]
        dofs = np.concatenate([given.reshape(len(nodes), -1) for given in numbers], axis=1)
        dofs_of[name] = dofs

        def block(rule: tuple[Array, Array], geometry: ShellGeometry, dofs: Index) -> ShellStrain:
            weight = areas(geometry, rule[0])[0] * rule[1]
            return ShellStrain(dofs, weight, elastic, linear, quadratic, gradient_rows(geometry, rule[0]), stress)

        def coarse(
            elements: slice, name: str = name, geometry: ShellGeometry = geometry, dofs: Index = dofs
        ) -> DenseStrain:
            return block(_few(name), geometry.over(elements), dofs[elements])

        own = block(_full(name), geometry, dofs)
        if CELL_TYPES[name].order == 2:
            own = ShellStrain(dofs, own.weight, elastic, linear, quadratic, own.G, stress, coarse)
        strain.append(own)
        inertia.append(_inertia(geometry, section, dofs))
        cell = CELL_TYPES[name]
        at, few = (np.matmul(cell.interpolation(rule[0]), x) for rule in (_full(name), _few(name)))
        places.append(StrainPlaces("plate", at, few if cell.order == 2 else None, section.thickness / 2))
        late.append(partial(_drilling, geometry, dofs, numbering, float(section.A[2, 2])))

    def drilled() -> tuple[StrainBlock, ...]:
        return tuple(found for one in late for found in one())

    return Contribution(
        tuple(inertia),
        tuple(strain),
        partial(shell_skin, mesh.points, cells, surface, section.thickness, dofs_of),
        tuple(places),
        late=drilled,
    )


def elastic_matrix(section: PlateSection) -> Array:
    """[A B; B D] and S (1, 1, 8, 8) over membrane strains, curvatures and shears, in the section's axes."""
    C = np.zeros((1, 1, 8, 8))
    C[0, 0, :3, :3], C[0, 0, 3:6, 3:6], C[0, 0, 6:, 6:] = section.A, section.D, section.S
    C[0, 0, :3, 3:6] = C[0, 0, 3:6, :3] = section.B
    return C


def _shifted(section: PlateSection, offset: float, where: str) -> PlateSection:
    if isinstance(offset, bool) or not isinstance(offset, int | float | np.floating) or not np.isfinite(offset):
        raise ValueError(f"{where} has offset {offset!r}; give one length in metres")
    return section.shifted(float(offset)) if offset else section


def _full(name: str) -> tuple[Array, Array]:
    """Points (q, 2) and weights (q,) of the linear strains."""
    return _triangle(4 if name == "triangle6" else 2) if "triangle" in name else quadrature("quad", 2 + ("9" in name))


def _few(name: str) -> tuple[Array, Array]:
    """Those where stretch is sampled."""
    return _triangle(2) if "triangle" in name else quadrature("quad", 2)


def _triangle(degree: int) -> tuple[Array, Array]:
    points, weight = get_quadrature(RefTri, degree)
    return points.T, weight


def _inertia(geometry: ShellGeometry, section: PlateSection, dofs: Index) -> ShellInertia:
    """Mass on the surface, or two halves of it at +- the radius of gyration along the director."""
    points, weight = _triangle(4) if "triangle" in geometry.cell else quadrature("quad", 3)
    N = CELL_TYPES[geometry.cell].interpolation(points)
    radius = np.sqrt(section.rotary / section.mass) if section.mass > 0 else 0.0
    heights = section.centre + (np.array([radius, -radius]) if radius > 0 else np.zeros(1))
    middle = np.matmul(N, geometry.x)
    rho = np.concatenate([middle + z * np.matmul(N, geometry.V) for z in heights], axis=1)
    dm = areas(geometry, points)[0] * weight * section.mass / len(heights)
    return ShellInertia(dofs, np.tile(dm, (1, len(heights))), rho, N, geometry.V, heights)


def _drilling(geometry: ShellGeometry, dofs: Index, numbering: Numbering, shear: float) -> tuple[DenseStrain, ...]:
    k = geometry.x.shape[1]
    return drilling(geometry, dofs, numbering.turns_about_all_axes(dofs[:, 3 * k :: 3]), shear)


def _direction(given: Any, where: str) -> Array:
    axis = np.asarray(given, float)
    if axis.shape != (3,) or not np.isfinite(axis).all() or not axis.any():
        raise ValueError(f"{where} has axis {given!r}; give a direction of three numbers, not all zero")
    return axis


def _initial_stress(section: PlateSection, options: dict[str, Any], where: str) -> Array:
    """Initial stress (1, 1, 8): prestress less A times the thermal strain."""
    force, strain = np.zeros(3), np.zeros(3)
    if options["prestress"] is not None:
        force = np.asarray(options["prestress"], float)
    if options["thermal_strain"] is not None:
        given = np.asarray(options["thermal_strain"], float)
        strain = given if given.ndim else np.array([given, given, 0.0])
    for name, value in (("prestress", force), ("thermal_strain", strain)):
        if value.shape != (3,) or not np.isfinite(value).all():
            raise ValueError(f"{where} has {name} {options[name]!r}; give three finite numbers, xx, yy and xy")
    stress = np.zeros((1, 1, 8))
    stress[0, 0, :3] = force - section.A @ strain
    stress[0, 0, 3:6] = -section.B @ strain
    return stress


def _check_shapes(name: str, x: Array, where: str) -> None:
    """Refuse elements (e, k, 3) without area and warped ones; warn of warped ones; all named and located."""
    normals = normals_at_nodes(name, x)
    size = np.linalg.norm(normals, axis=2)
    longest = np.linalg.norm(x - x[:, :1], axis=2).max(axis=1)
    flat = size.min(axis=1) <= FLAT_AREA * longest**2
    if flat.any():
        raise ValueError(
            f"{where}: {int(flat.sum())} of {len(x)} {name} elements have a corner without area, the first is "
            f"{_at(np.argmax(flat), x)}; repair the mesh"
        )
    if name != "quad":
        return
    unit = normals / size[..., None]
    cosine = np.einsum("eki,eli->ekl", unit, unit).min(axis=(1, 2))
    angle = np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0)))
    worst = int(np.argmax(angle))
    if angle[worst] > FOLDED:
        raise ValueError(
            f"{where}: {int((angle > FOLDED).sum())} of {len(x)} quadrilaterals are warped by over {FOLDED:g} deg, "
            f"or their nodes go across; the worst, by {angle[worst]:.3g} deg, is {_at(worst, x)}; correct the order of "
            "nodes, or cut them into triangles"
        )
    if angle[worst] > WARPED:
        warnings.warn(
            f"{where}: {int((angle > WARPED).sum())} of {len(x)} quadrilaterals are warped by more than {WARPED:g} deg "
            f"between corner normals; the worst, by {angle[worst]:.3g} deg, is {_at(worst, x)}. Their stiffness is "
            "some per cents off; mesh finer there, or use eight-node elements",
            PhysicsWarning,
            stacklevel=5,
        )


def _at(element: int | np.intp, x: Array) -> str:
    return f"element {element} at ({', '.join(f'{c:.6g}' for c in x[element].mean(axis=0))}) m"


def _warn_of_constant_strain(points: Array, cells: dict[str, Index], where: str) -> None:
    area = {
        name: np.linalg.norm(normals_at_nodes(name, points[nodes]), axis=2).mean(axis=1).sum()
        / (2 if "triangle" in name else 1)
        for name, nodes in cells.items()
    }
    share = area.get("triangle", 0.0) / sum(area.values())
    if share > CONSTANT_SHARE:
        warnings.warn(
            f"{where}: {share:.0%} of its area is three-node triangles (limit {CONSTANT_SHARE:.0%}), whose membrane "
            "strain is constant and converges slowly. Use family = 'plate' for meshes of triangles, or six-node ones",
            PhysicsWarning,
            stacklevel=5,
        )
