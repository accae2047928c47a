"""*NONSTRUCTURAL MASS: mass without stiffness, distributed over the elements of a set."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from femflex.decks.abaqus.model import AbaqusModel
from femflex.decks.builder import BuiltCell
from femflex.fem.sections.materials import Material
from femflex.mesh.cells import CELL_TYPES
from femflex.mesh.formats.abaqus_flat import InstanceKeyword
from femflex.mesh.formats.abaqus_keywords import Keyword
from femflex.mesh.quality import sizes

AREA_FAMILIES = ("shell", "plate")
LINE_FAMILIES = ("beam", "rod")
UNITS = ("TOTAL MASS", "MASS PER VOLUME", "MASS PER AREA", "MASS PER LENGTH")
DISTRIBUTIONS = ("MASS PROPORTIONAL", "VOLUME PROPORTIONAL")
EXPONENT = {"TOTAL MASS": 0, "MASS PER VOLUME": 3, "MASS PER AREA": 2, "MASS PER LENGTH": 1}
Change = tuple[float, float]  # added mass as a fraction of the structural mass, and added mass per area or length


def read_nonstructural_mass(model: AbaqusModel) -> None:
    """Add the nonstructural mass of a deck to the elements that are built.

    Mass in proportion to mass or volume scales an element's density and rotary inertia. Mass per area or length is
    added at the height of the element's mass centre. Several keywords for one element add up, each based on structural
    mass.
    """
    keywords = list(model.keywords_named("NONSTRUCTURAL MASS"))
    if not keywords:
        return
    built: dict[int, list[BuiltCell]] = {}
    for cell in model.build.built_cells():
        if cell.number is not None:
            built.setdefault(cell.number, []).append(cell)
    changes: dict[int, Change] = {}
    for entry in keywords:
        model.attempt(entry.keyword, partial(_add, model, entry, built, changes))
    model.build.change_sections({number: (round(a, 15), b) for number, (a, b) in changes.items()}, _with_more_mass)


def _add(
    model: AbaqusModel, entry: InstanceKeyword, built: dict[int, list[BuiltCell]], changes: dict[int, Change]
) -> None:
    scope, keyword = entry
    elset, units = keyword.parameter("elset"), _choice(keyword, "units", UNITS, "")
    distribution = _choice(keyword, "distribution", DISTRIBUTIONS, DISTRIBUTIONS[0])
    numbers = [number for number in model.flat.elements_of(elset, scope, keyword.location()) if number in built]
    cells = [cell for number in numbers for cell in built[number]]  # an element may consist of two cells
    if not cells:
        raise keyword.error(f": ELSET {elset!r} has no elements with mass.")
    word = keyword.data[0][0] if keyword.data else ""
    value = keyword.real(word, 0, "a mass") * model.units.mass / model.units.length ** EXPONENT[units]
    by_volume = units == "MASS PER VOLUME" or (units == "TOTAL MASS" and distribution == "VOLUME PROPORTIONAL")
    for cell in cells:
        _check(cell, model.flat.label(cell.number or 0), keyword, elset, units, by_volume)
    if units == "TOTAL MASS":
        value /= sum(
            size * (_height(cell) if by_volume else _structural_mass(cell)) for cell, size in _with_sizes(model, cells)
        )
    for number in numbers:
        own, (fraction, extra) = _structural_mass(built[number][0]), changes.get(number, (0.0, 0.0))
        if units in ("MASS PER AREA", "MASS PER LENGTH"):
            extra += value
        else:
            fraction += value * (_height(built[number][0]) / own if by_volume else 1.0)
        changes[number] = fraction, extra
        if fraction * own + extra <= -own:
            raise keyword.error(f"leaves element {model.flat.label(number)} no mass; correct it.")


def _choice(keyword: Keyword, name: str, choices: tuple[str, ...], default: str) -> str:
    word = " ".join(keyword.parameter(name).upper().split()) or default
    if word not in choices:
        raise keyword.error(f"has {name.upper()}={word or 'none'}; give {', '.join(choices)}.")
    return word


def _check(cell: BuiltCell, label: str, keyword: Keyword, elset: str, units: str, by_volume: bool) -> None:
    """Raise ValueError for a cell to which the units do not apply, or that has no structural mass."""
    wrong_family = (units == "MASS PER AREA" and cell.family not in AREA_FAMILIES) or (
        units == "MASS PER LENGTH" and cell.family not in LINE_FAMILIES
    )
    if wrong_family or (by_volume and cell.family in LINE_FAMILIES):
        description = "by volume to beams or trusses" if by_volume else f"with UNITS={units} to a {cell.family}"
        raise keyword.error(
            f"adds mass {description}, element {label} of ELSET {elset!r}; "
            f"{('give MASS PER LENGTH' if by_volume else 'give units that fit')}."
        )
    if not _structural_mass(cell) > 0:
        raise keyword.error(
            f": element {label} of ELSET {elset!r} has no mass of its own; give its material a density."
        )


def _height(cell: BuiltCell) -> float:
    """Thickness of a shell, its mean over the corners [m]; 1 for a solid."""
    if cell.family not in AREA_FAMILIES:
        return 1.0
    return float(np.mean(cell.fields["thickness"])) if "thickness" in cell.fields else float(cell.section.thickness)


def _structural_mass(cell: BuiltCell) -> float:
    """Structural mass per length [kg/m], area [kg/m^2] or volume [kg/m^3]."""
    if cell.family in AREA_FAMILIES:
        return float(cell.section.mass) * _height(cell) / float(cell.section.thickness)
    return float(cell.section.mass_per_length) if cell.family in LINE_FAMILIES else float(cell.material.density)


def _with_sizes(model: AbaqusModel, cells: list[BuiltCell]) -> list[tuple[BuiltCell, float]]:
    """Cells with their lengths [m], areas [m^2] or volumes [m^3]."""
    points = np.array(model.build.points)
    cells_and_sizes: list[tuple[BuiltCell, float]] = []
    for kind in CELL_TYPES:
        same_kind = [cell for cell in cells if cell.kind == kind]
        if same_kind:
            nodes = np.array([model.build.cells[kind][cell.row] for cell in same_kind])
            cells_and_sizes += zip(same_kind, np.abs(sizes(points, kind, nodes)), strict=True)
    return cells_and_sizes


def _with_more_mass(section: Any, material: Any, change: Change) -> tuple[Any, Any]:
    """The section and material of an element, with the mass added."""
    factor, extra = 1.0 + change[0], change[1]
    if section is None:
        density = material.density * factor
        if isinstance(material, Material):
            return None, material.model_copy(update={"density": density})
        return None, replace(material, density=density)
    if hasattr(section, "mass_per_length"):
        mass = section.mass_per_length * factor + extra
        return section.model_copy(update={"mass_per_length": mass}), material
    scaled = replace(section, mass=section.mass * factor, rotary=section.rotary * factor, added=section.added * factor)
    return replace(scaled, mass=scaled.mass + extra, added=scaled.added + extra), material
