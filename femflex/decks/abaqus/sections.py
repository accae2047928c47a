"""Sections of an Abaqus deck and the elements that they make: shells, membranes, solids, beams and trusses."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import partial
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from femflex.arrays import Array
from femflex.decks.abaqus.axes import System
from femflex.decks.abaqus.beam_sections import beam_section, general_section, with_shear
from femflex.decks.abaqus.materials import Materials
from femflex.decks.abaqus.model import AbaqusModel
from femflex.decks.builder import Around, Builder, direction_key, shell_normal
from femflex.decks.materials import Elastic
from femflex.decks.model import LARGE_EXTENT, MASSLESS, MAX_TRIANGLE_SHARE
from femflex.fem.plate.frames import same_side
from femflex.fem.sections.laminates import PlateSection, Ply, layup
from femflex.fem.sections.library import CableSection
from femflex.fem.sections.materials import Material
from femflex.mesh.cells import CELL_TYPES
from femflex.mesh.formats.abaqus_flat import Element, InstanceKeyword
from femflex.mesh.formats.abaqus_keywords import Keyword

Systems = dict[tuple[str, str], System]
Make = Callable[[AbaqusModel, Element], None]

NO_BENDING = 1e-9  # bending stiffness of a membrane, relative to that of a homogeneous sheet
SHEARLESS_TYPES = ("B23", "B33")
ELEMENTS_PER_HALF = 4  # of a curved beam: straight elements from its middle to an end; arc length: (angle / 8)^2 / 24
STRAIGHT = 1e-3  # of the length: offset of the middle node up to which a beam is straight (lengthens it by 1e-6)
PLANE_TYPES = ("CPS", "CPE", "CAX", "CGAX", "CPEG", "AC", "DC")
SECTION_KEYWORDS = (
    "SHELL SECTION", "SHELL GENERAL SECTION", "MEMBRANE SECTION", "SOLID SECTION", "BEAM SECTION",
    "BEAM GENERAL SECTION",
)  # fmt: skip


@dataclass(frozen=True, eq=False)
class SectionInputs:
    """Data for the sections: materials, orientations, and thickness at nodes."""

    materials: Materials
    systems: Systems
    thickness: dict[int, float]

    def system(self, name: str, scope: str, keyword: Keyword) -> System | None:
        """The orientation with this name; None for "". Raises ValueError if the deck has no such orientation."""
        if not name:
            return None
        system = self.systems.get((scope.upper(), name.upper()), self.systems.get(("", name.upper())))
        if system is None:
            raise keyword.error(
                f": orientation {name!r} is not in the deck; it has "
                f"{sorted((orientation for _, orientation in self.systems)) or 'none'}."
            )
        return system


def read_elements(model: AbaqusModel, inputs: SectionInputs) -> None:
    """Assign every element that is a cell the last section that names it, and add it to the model."""
    make_of_element: dict[int, tuple[InstanceKeyword, Make | None]] = {}  # None: of a section with errors
    for entry in model.keywords_named(*SECTION_KEYWORDS):
        makes: dict[int, Make | None] = {}
        if not model.attempt(entry.keyword, partial(_section, model, inputs, entry, makes)):
            with suppress(ValueError):
                makes = {element.number: None for element in _cells_of_section(model, entry)}
        make_of_element |= {number: (entry, make) for number, make in makes.items()}
    without_section: dict[str, list[Element]] = {}
    for element in model.flat.elements.values():
        if not element.cell or element.number in model.flat_rigid:
            continue
        if element.number not in make_of_element:
            without_section.setdefault(element.kind, []).append(element)
            continue
        entry, make = make_of_element[element.number]
        if make is not None:
            model.attempt(entry.keyword, partial(make, model, element))
    for kind, elements in without_section.items():
        if kind.startswith((*PLANE_TYPES, "R3D", "SFM", "F3D", "RB", "R2D", "LINE2")):
            continue  # reported by `report_unused`
        dimension = CELL_TYPES[elements[0].cell].dimension
        word = "SOLID" if dimension == 3 or kind[0] == "T" else "BEAM" if dimension == 1 else "SHELL"
        model.findings.problem(
            f"{len(elements)} elements of type {kind}, the first is {model.flat.label(elements[0].number)}, have no "
            f"section; give one for an ELSET with them (*{'MEMBRANE' if kind[0] == 'M' else word} SECTION) "
            f"[{elements[0].location}]"
        )


def _cells_of_section(model: AbaqusModel, entry: InstanceKeyword) -> list[Element]:
    """Elements that are cells in the ELSET of a section."""
    numbers = model.flat.elements_of(entry.keyword.parameter("elset"), entry.scope, entry.keyword.location())
    return [model.flat.elements[number] for number in numbers if model.flat.elements[number].cell]


def _section(model: AbaqusModel, inputs: SectionInputs, entry: InstanceKeyword, found: dict[int, Make | None]) -> None:
    """Add, by their numbers, how to make the elements of a section."""
    keyword, elset = entry.keyword, entry.keyword.parameter("elset")
    cells, makes = _cells_of_section(model, entry), dict[int, Make]()
    if not cells:
        model.findings.note(f"{keyword.location()}: ELSET {elset!r} of *{keyword.name} has no elements that are cells")
    for dimension in {CELL_TYPES[element.cell].dimension for element in cells}:
        if dimension == 2 and any(e.kind.startswith(PLANE_TYPES) for e in cells) and keyword.name[:4] != "BEAM":
            continue  # reported by `report_unused`
        if dimension == 2 and keyword.name.startswith(("SHELL", "MEMBRANE")):
            triangles = sum(_without_repeated_corner(element).cell == "triangle" for element in cells)
            makes[2] = _shells(model, inputs, entry, elset, triangles > MAX_TRIANGLE_SHARE * len(cells))
            continue
        make = {("BEAM", 1): _beams, ("SOLID", 1): _trusses, ("SOLID", 3): _solids}.get(
            (keyword.name.split(" ")[0], dimension)
        )
        if make is None:
            raise keyword.error(
                f"is for other elements than those of ELSET {elset!r} "
                f"({', '.join(sorted({element.kind for element in cells}))}); give the section of their kind."
            )
        makes[dimension] = make(model, inputs, entry, elset)
    dimensions = {element.number: CELL_TYPES[element.cell].dimension for element in cells}
    found |= {number: makes[dimension] for number, dimension in dimensions.items() if dimension in makes}


def _solids(model: AbaqusModel, inputs: SectionInputs, entry: InstanceKeyword, elset: str) -> Make:
    scope, keyword = entry
    if "composite" in keyword.parameters:
        raise keyword.error(", COMPOSITE is not read; give a shell section, or one material.")
    material = inputs.materials(keyword.parameter("material"), keyword.location()).solid()
    system = inputs.system(keyword.parameter("orientation"), scope, keyword)

    def make(model: AbaqusModel, element: Element) -> None:
        options: dict[str, Any] = {}
        key: tuple[Any, ...] = ("solid", id(keyword), scope)
        if system is not None and not isinstance(material, Material):
            centre = np.mean([model.x(n) for n in element.nodes], axis=0)
            options["axes"] = tuple(float(c) for c in system.axes_at(centre)[:2].ravel())
            key += direction_key(options["axes"], 6)
        _add_cell(model, element, key, elset, "solid", None, material, options)

    return make


def _trusses(model: AbaqusModel, inputs: SectionInputs, entry: InstanceKeyword, elset: str) -> Make:
    scope, keyword = entry
    E, _, rho = inputs.materials(keyword.parameter("material"), keyword.location()).bar()
    area = keyword.real(keyword.data[0][0], 0, "an area") if keyword.data and keyword.data[0][0] else 1.0
    A = model.override([elset], {"area": area * model.units.length**2}, keyword.location())["area"]
    if not A > 0:
        raise keyword.error(f": the area of trusses is {A:.6g} m^2; give a positive one.")
    section = CableSection(EA=E * A, mass_per_length=max(rho * A, MASSLESS * E * A))

    def make(model: AbaqusModel, element: Element) -> None:
        chain = [element.nodes[k] for k in ((0, 1) if element.cell == "line" else (0, 2, 1))]
        for pair in pairwise(chain):
            part = element._replace(cell="line", nodes=pair)
            _add_cell(model, part, ("rod", id(keyword), scope), elset, "rod", section, None, {})

    return make


def _beams(model: AbaqusModel, inputs: SectionInputs, entry: InstanceKeyword, elset: str) -> Make:
    scope, keyword = entry
    if keyword.name == "BEAM SECTION":
        beam = beam_section(model, inputs.materials(keyword.parameter("material"), keyword.location()), keyword)
    else:
        beam = general_section(model, keyword)
    shear = _adjacent_keyword(model, entry, "TRANSVERSE SHEAR STIFFNESS")
    if shear is not None:
        beam = with_shear(model, beam, shear)
    C = model.placement(scope).C
    n1 = None if beam.n1 is None else C @ np.array(beam.n1)

    def make(model: AbaqusModel, element: Element) -> None:
        x = [model.x(n) for n in element.nodes]
        t = (x[1] - x[0]) / (np.linalg.norm(x[1] - x[0]) or 1.0)
        first = n1
        if element.extra:
            first = model.x(element.extra[0]) - x[0]
        if first is None:
            first = np.array([0.0, 0.0, -1.0])
        if np.linalg.norm(np.cross(t, first)) < 1e-6 * np.linalg.norm(first):
            if n1 is not None or element.extra:
                raise ValueError(
                    f"{element.location}: beam {model.flat.label(element.number)} has its direction n1 along its axis; "
                    "give another."
                )
            first = np.array([0.0, 1.0, 0.0])
        second = np.cross(t, first)  # n2: the section's y axis here, so that heights lie along y
        second = second / np.linalg.norm(second)
        alpha = beam.principal
        if alpha:
            third = np.cross(t, second)
            second = np.cos(alpha) * second + np.sin(alpha) * third
        options: dict[str, Any] = {
            "orientation": tuple(float(c) for c in second), "extent": LARGE_EXTENT,
            "shear": beam.shears and not element.kind.startswith(SHEARLESS_TYPES),
        }  # fmt: skip
        if any(beam.centroid):
            options["offset"] = beam.centroid
            if not options["shear"]:
                raise ValueError(f"{element.location}: a beam off its nodes needs shear; give elements B31 or B32.")
        key = ("beam", id(keyword), scope, options["shear"], direction_key(second, 6))
        cells = [(element.cell, [model.row(n) for n in element.nodes])]
        if element.cell == "line3":
            start, end, middle = cells[0][1]
            chain = _chain_of(model.build, start, middle, end)
            cells = [("line", list(pair)) for pair in pairwise(chain)] if len(chain) > 3 else cells
        _add_cell(model, element, key, elset, "beam", beam.section, None, options, cells=cells)

    return make


def _chain_of(build: Builder, start: int, middle: int, end: int) -> list[int]:
    """Rows of the points along an element: its three nodes, and new points on their parabola if it is curved."""
    a, c, b = (build.points[row] for row in (start, middle, end))
    if np.linalg.norm(c - (a + b) / 2) <= STRAIGHT * np.linalg.norm(b - a):
        return [start, middle, end]
    xi = np.linspace(-1, 1, 2 * ELEMENTS_PER_HALF + 1)
    x = np.stack([xi * (xi - 1) / 2, 1 - xi**2, xi * (xi + 1) / 2], axis=1) @ np.stack([a, c, b])
    inner = [build.point(x[k]) for k in range(1, 2 * ELEMENTS_PER_HALF) if k != ELEMENTS_PER_HALF]
    return [start, *inner[: ELEMENTS_PER_HALF - 1], middle, *inner[ELEMENTS_PER_HALF - 1 :], end]


def _shells(model: AbaqusModel, inputs: SectionInputs, entry: InstanceKeyword, elset: str, facets: bool) -> Make:
    scope, keyword = entry
    system = inputs.system(keyword.parameter("orientation"), scope, keyword)
    by_stiffness = _by_stiffness(keyword)
    given = _stiffness(model, entry) if by_stiffness else None
    plies = [] if by_stiffness else _plies(model, inputs, entry)
    height = sum(ply.thickness for ply in plies) if given is None else given.thickness
    values = {"thickness": height} | ({} if given is None else {"nonstructural_mass": given.mass})
    values = model.override([elset], values, keyword.location())
    if given is not None:
        mass = model.area_masses[elset] = values["nonstructural_mass"]
        given = replace(given, mass=mass, rotary=mass * height**2 / 12)
        if not mass > 0:
            model.bare_sections[elset] = keyword.location()
    if not values["thickness"] > 0:
        raise keyword.error(f": the thickness of ELSET {elset!r} is {values['thickness']:.6g} m; give one.")
    factor, isotropic = values["thickness"] / height, bool(plies) and all(ply.material.isotropic for ply in plies)
    membrane = keyword.name == "MEMBRANE SECTION"
    offset = _offset(keyword)
    nodal_thickness = "nodalthickness" in keyword.parameters
    added = 0.0
    if keyword.parameter("density") and not by_stiffness:  # mass in addition to that of the material
        added = keyword.real(keyword.parameter("density"), None, "a mass per area") * model.units.mass
        added /= model.units.length**2
    sections: dict[tuple[Any, ...], PlateSection] = {}

    def section_of(scale: float, angles: tuple[float, ...], below: bool = False) -> PlateSection:
        section_key = (round(scale, 12), angles, below)
        if section_key not in sections:
            layers = [Ply(p.material.lamina(), p.thickness * scale, a) for p, a in zip(plies, angles, strict=True)]
            plate_section = layup(layers, coupled=True) if given is None else given
            plate_section = (_without_bending(plate_section) if membrane else plate_section).with_added_mass(added)
            sections[section_key] = plate_section.turned_over() if below else plate_section
        return sections[section_key]

    def make(model: AbaqusModel, element: Element) -> None:
        element = _without_repeated_corner(element)
        x = np.array([model.x(n) for n in element.nodes[: CELL_TYPES[element.cell].n_corners]])
        normal = shell_normal(x, f"{element.location}: shell {model.flat.label(element.number)}")
        centre = x.mean(axis=0)
        scale, corners = factor, None
        if nodal_thickness:
            corners = _thicknesses(model, inputs, element, values["thickness"])
            scale = float(np.mean(corners)) / height
        axis = system.on_surface(centre, normal) if system is not None else _default_axis(normal)
        angles = tuple(round(ply.angle_at(centre, normal, axis), 7) for ply in plies)
        has_offset = bool(offset) and not membrane
        triangle = facets and element.cell == "triangle" and not has_offset and not membrane
        plate = triangle and not section_of(factor, angles).coupled
        by_element = plate or has_offset or by_stiffness  # then the member has a single thickness
        below = plate and not isotropic and not same_side(normal)
        section = section_of(scale if by_element else factor, angles, below)
        options: dict[str, Any] = {"offset": -offset * section.thickness} if has_offset else {}
        _add_cell(
            model, element, (plate, id(keyword), scope, id(section)), elset, "plate" if plate else "shell", section,
            None, options, around=(normal, None if isotropic else axis, None if by_element else corners),
        )  # fmt: skip

    return make


def _by_stiffness(keyword: Keyword) -> bool:
    plain = "composite" not in keyword.parameters and not keyword.parameter("material")
    return keyword.name == "SHELL GENERAL SECTION" and plain


def _stiffness(model: AbaqusModel, entry: InstanceKeyword) -> PlateSection:
    """Section of *SHELL GENERAL SECTION by its 21 stiffnesses, columns of the upper triangle; DENSITY per area.

    Without *TRANSVERSE SHEAR STIFFNESS both shear stiffnesses are (D11 + D22) / 6 + D33 / 3 of the membrane part,
    Abaqus' default.
    """
    keyword, u = entry.keyword, model.units
    c = [keyword.real(word, k, "a stiffness") for k, row in enumerate(keyword.data) for word in row if word]
    if "user" in keyword.parameters:
        raise keyword.error(", USER has its stiffness in a subroutine; give 21 stiffnesses, MATERIAL or COMPOSITE.")
    if len(c) < 21:
        raise keyword.error(f"has {len(c)} stiffnesses; give 21, or MATERIAL or COMPOSITE.")
    K = np.zeros((6, 6))
    column, row = np.tril_indices(6)  # columns of the upper triangle
    K[row, column] = K[column, row] = c[:21]
    force = u.force / u.length
    A, B, D = K[:3, :3] * force, K[:3, 3:] * u.force, K[3:, 3:] * u.moment
    S = ((A[0, 0] + A[1, 1]) / 6 + A[2, 2] / 3) * np.eye(2)
    shear_keyword = _adjacent_keyword(model, entry, "TRANSVERSE SHEAR STIFFNESS")
    if shear_keyword is not None:
        k11, k22, k12 = [*(shear_keyword.real(w, 0, "a stiffness") for w in shear_keyword.data[0] if w), 0.0, 0.0][:3]
        S = np.array([[k11, k12], [k12, k22 or k11]]) * force
    thickness = float(np.sqrt(12 * np.trace(D) / np.trace(A)))
    density = float(keyword.parameter("density") or 0.0) * u.mass / u.length**2
    return PlateSection(thickness, density, density * thickness**2 / 12, A, D, S, B)


def _adjacent_keyword(model: AbaqusModel, entry: InstanceKeyword, name: str) -> Keyword | None:
    """The keyword with this name directly after a section keyword, if any."""
    pairs = zip(model.flat.keywords, model.flat.keywords[1:], strict=False)
    return next((after.keyword for before, after in pairs if before is entry and after.keyword.name == name), None)


class _Ply(NamedTuple):
    """A ply: thickness [m], material, angle [rad], and an orientation in place of the section's."""

    thickness: float
    material: Elastic
    angle: float = 0.0
    system: System | None = None

    def angle_at(self, centre: Array, normal: Array, axis: Array) -> float:
        """Angle from the section's axis 1 at an element [rad]."""
        other = self.system
        return self.angle + (_angle(axis, other.on_surface(centre, normal), normal) if other is not None else 0.0)


def _plies(model: AbaqusModel, inputs: SectionInputs, entry: InstanceKeyword) -> list[_Ply]:
    """The plies of a section, bottom first."""
    scope, keyword = entry
    length = model.units.length
    if "composite" not in keyword.parameters:
        material = inputs.materials(keyword.parameter("material"), keyword.location())
        word = keyword.data[0][0] if keyword.data else ""
        return [_Ply((keyword.real(word, 0, "a thickness") if word else 1.0) * length, material)]
    plies: list[_Ply] = []
    for k, row in enumerate(keyword.data):
        words = [*row, "", "", "", ""]
        if not words[2]:
            continue
        t = keyword.real(words[0], k, "the thickness of a ply") * length
        material = inputs.materials(words[2], keyword.location(k))
        angle, other = 0.0, None
        if words[3]:
            try:
                angle = float(np.radians(float(words[3].upper().replace("D", "E"))))
            except ValueError:
                other = inputs.system(words[3], scope, keyword)
        plies.append(_Ply(t, material, angle, other))
    if not plies or any(ply.thickness <= 0 for ply in plies):
        raise keyword.error(", COMPOSITE has no plies, or one without thickness.")
    return plies + plies[::-1] if "symmetric" in keyword.parameters else plies


def _offset(keyword: Keyword) -> float:
    """Distance of the nodes' surface from the middle along the normal, in thicknesses."""
    word = keyword.parameter("offset").upper()
    try:
        return {"": 0.0, "SPOS": 0.5, "SNEG": -0.5}.get(word) or float(word or 0.0)
    except ValueError:
        raise keyword.error(f": OFFSET={word} is not read; give SPOS, SNEG or a number.") from None


def _default_axis(normal: Array) -> Array:
    """Abaqus' direction 1 on a surface: the projection of the global x axis, or of z if x is normal to it."""
    x = np.array([1.0, 0.0, 0.0])
    if abs(normal @ x) > np.cos(np.radians(0.1)):
        x = np.array([0.0, 0.0, 1.0])
    flat = x - (x @ normal) * normal
    return np.asarray(flat / np.linalg.norm(flat))


def _angle(axis: Array, other: Array, normal: Array) -> float:
    """Angle from one direction in a surface to another, about its normal [rad]."""
    return float(np.arctan2(normal @ np.cross(axis, other), axis @ other))


def _without_bending(section: PlateSection) -> PlateSection:
    """A section with membrane stiffness only; its bending stiffness is reduced by a factor of 1e-9."""
    plain = section.thickness**2 / 12 * section.A
    return PlateSection(section.thickness, section.mass, 0.0, section.A, NO_BENDING * plain, NO_BENDING * section.S)


def _without_repeated_corner(element: Element) -> Element:
    """The element; a quadrilateral that names a corner twice in succession becomes a triangle."""
    if element.cell != "quad" or len(set(element.nodes)) == 4:
        return element
    nodes = tuple(dict.fromkeys(element.nodes))
    return element._replace(cell="triangle", nodes=nodes) if len(nodes) == 3 else element


def _add_cell(
    model: AbaqusModel, element: Element, key: object, elset: str, family: str, section: Any, material: Any,
    options: dict[str, Any], around: Around | None = None, cells: Sequence[tuple[str, list[int]]] = (),
) -> None:  # fmt: skip
    """Add an element, or the cells that take its place, to the member with this key."""
    for cell, rows in cells or [(element.cell, [model.row(n) for n in element.nodes])]:
        model.build.cell(cell, rows, key, elset, family, section, material, options, (), element.number, None, around)
    nodes = set(map(model.representative, element.nodes))
    model.moving.update(nodes)
    model.turning.update(nodes if family in ("beam", "plate", "shell") else ())


def _thicknesses(model: AbaqusModel, inputs: SectionInputs, element: Element, default: float) -> tuple[float, ...]:
    """Thickness at the corners of an element [m]; the default where *NODAL THICKNESS gives none."""
    corners = element.nodes[: CELL_TYPES[element.cell].n_corners]
    nodal = inputs.thickness
    values = tuple(nodal[n] * model.units.length if n in nodal else default for n in corners)
    if min(values) <= 0:
        raise ValueError(
            f"{element.location}: shell {model.flat.label(element.number)} has a thickness of {min(values):.6g} m at "
            "a corner; give a positive one in *NODAL THICKNESS."
        )
    return values
