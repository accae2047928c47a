"""*NONSTRUCTURAL MASS: mass without stiffness, spread over the elements of a set."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from femflex.decks.abaqus.model import AbaqusModel
from femflex.decks.builder import Built
from femflex.mesh.abaqus_flat import Scoped
from femflex.mesh.abaqus_keywords import Keyword
from femflex.mesh.cells import CELL_TYPES
from femflex.mesh.quality import sizes

FLAT = ("shell", "plate")
LINES = ("beam", "rod")
UNITS = ("TOTAL MASS", "MASS PER VOLUME", "MASS PER AREA", "MASS PER LENGTH")
DISTRIBUTIONS = ("MASS PROPORTIONAL", "VOLUME PROPORTIONAL")
EXPONENT = {"TOTAL MASS": 0, "MASS PER VOLUME": 3, "MASS PER AREA": 2, "MASS PER LENGTH": 1}
Change = tuple[float, float]  # part of the element's own mass to be added, and mass per area or length


def read_nonstructural_mass(model: AbaqusModel) -> None:
    """Add the nonstructural mass of a deck to the elements that are built.

    Proportional to mass or volume it raises an element's density, which its rotary inertia follows; per area or length
    it is added at the height of the element's mass centre. Several of one element add up, each of its structural mass.
    """
    keywords = list(model.each("NONSTRUCTURAL MASS"))
    if not keywords:
        return
    built: dict[int, list[Built]] = {}
    for one in model.build.built():
        if one.number is not None:
            built.setdefault(one.number, []).append(one)
    changes: dict[int, Change] = {}
    for scoped in keywords:
        model.attempt(scoped.keyword, partial(_add, model, scoped, built, changes))
    model.build.remake({number: (round(a, 15), b) for number, (a, b) in changes.items()}, _heavier)


def _add(model: AbaqusModel, scoped: Scoped, built: dict[int, list[Built]], changes: dict[int, Change]) -> None:
    scope, keyword = scoped
    elset, units = keyword.parameter("elset"), _choice(keyword, "units", UNITS, "")
    distribution = _choice(keyword, "distribution", DISTRIBUTIONS, DISTRIBUTIONS[0])
    cells = [one for number in model.flat.elements_of(elset, scope, keyword.place()) for one in built.get(number, ())]
    if not cells:
        raise ValueError(f"{keyword.place()}: ELSET {elset!r} of *{keyword.name} has no elements with mass.")
    word = keyword.data[0][0] if keyword.data else ""
    value = keyword.real(word, 0, "a mass") * model.units.mass / model.units.length ** EXPONENT[units]
    by_volume = units == "MASS PER VOLUME" or (units == "TOTAL MASS" and distribution == "VOLUME PROPORTIONAL")
    for one in cells:
        label = model.flat.label(one.number or 0)
        _check(one, label, keyword, elset, units, by_volume)
    if units == "TOTAL MASS":
        value /= sum(size * (_height(one) if by_volume else _own(one)) for one, size in _sized(model, cells))
    for one in cells:
        part, more = (0.0, value) if units in ("MASS PER AREA", "MASS PER LENGTH") else (value, 0.0)
        if by_volume:
            part *= _height(one) / _own(one)
        known = changes.get(one.number or 0, (0.0, 0.0))
        first = one is built[one.number or 0][0]  # of an element in two pieces
        changes[one.number or 0] = (known[0] + part, known[1] + more) if first else known
        if changes[one.number or 0][0] * _own(one) + changes[one.number or 0][1] <= -_own(one):
            raise ValueError(
                f"{keyword.place()}: *{keyword.name} leaves element {model.flat.label(one.number or 0)} no mass; "
                "correct it."
            )


def _choice(keyword: Keyword, name: str, known: tuple[str, ...], default: str) -> str:
    word = " ".join(keyword.parameter(name).upper().split()) or default
    if word not in known:
        raise ValueError(
            f"{keyword.place()}: *{keyword.name} has {name.upper()}={word or 'none'}; give {', '.join(known)}."
        )
    return word


def _check(one: Built, label: str, keyword: Keyword, elset: str, units: str, by_volume: bool) -> None:
    """Refuse elements to which the units do not apply, or that have no mass which more could be added to."""
    wrong = (units == "MASS PER AREA" and one.family not in FLAT) or (
        units == "MASS PER LENGTH" and one.family not in LINES
    )
    if wrong or (by_volume and one.family in LINES):
        how = "by volume to beams or trusses" if by_volume else f"with UNITS={units} to a {one.family}"
        raise ValueError(
            f"{keyword.place()}: *{keyword.name} adds mass {how}, element {label} of ELSET {elset!r}; "
            f"{'give MASS PER LENGTH' if by_volume else 'give units that fit'}."
        )
    if not _own(one) > 0:
        raise ValueError(
            f"{keyword.place()}: *{keyword.name}: element {label} of ELSET {elset!r} has no mass of its own; "
            "give its material a density."
        )


def _height(one: Built) -> float:
    """Thickness of a shell, its mean over the corners [m]; 1 for a solid."""
    if one.family not in FLAT:
        return 1.0
    return float(np.mean(one.fields["thickness"])) if "thickness" in one.fields else float(one.section.thickness)


def _own(one: Built) -> float:
    """Structural mass per length [kg/m], area [kg/m^2] or volume [kg/m^3]."""
    if one.family in FLAT:
        return float(one.section.mass) * _height(one) / float(one.section.thickness)
    return float(one.section.mass_per_length) if one.family in LINES else float(one.material.density)


def _sized(model: AbaqusModel, cells: list[Built]) -> list[tuple[Built, float]]:
    """Cells with their lengths [m], areas [m^2] or volumes [m^3]."""
    points = np.array(model.build.points)
    found: list[tuple[Built, float]] = []
    for kind in CELL_TYPES:
        own = [one for one in cells if one.kind == kind]
        if own:
            nodes = np.array([model.build.cells[kind][one.row] for one in own])
            found += zip(own, np.abs(sizes(points, kind, nodes)), strict=True)
    return found


def _heavier(section: Any, material: Any, change: Change) -> tuple[Any, Any]:
    """The section and material of an element with more mass."""
    part, more = 1.0 + change[0], change[1]
    if section is None:
        return None, replace(material, density=material.density * part)
    if hasattr(section, "mass_per_length"):
        return replace(section, mass_per_length=section.mass_per_length * part + more), material
    scaled = replace(section, mass=section.mass * part, rotary=section.rotary * part, added=section.added * part)
    return replace(scaled, mass=scaled.mass + more, added=scaled.added + more), material
