"""Shells: CQUAD4, CQUADR, CQUAD8, CTRIA3, CTRIAR, CTRIA6 and CSHEAR with thickness, offset and material axes."""

from __future__ import annotations

import math

import numpy as np

from femflex.arrays import Array
from femflex.decks.builder import shell_normal
from femflex.decks.model import MAX_TRIANGLE_SHARE
from femflex.decks.nastran.card import Card
from femflex.decks.nastran.model import NastranModel, with_middles
from femflex.decks.nastran.shell_properties import KINDS, Kind, ShellProperties, ShellProperty
from femflex.fem.plate.frames import same_side

CELLS = {(4, False): "quad", (4, True): "quad8", (3, False): "triangle", (3, True): "triangle6"}


def read_shell_elements(model: NastranModel) -> None:
    """Add the shells of a deck to the model."""
    bulk = model.bulk
    properties = ShellProperties(bulk, model.materials)
    counts: dict[int, list[int]] = {}
    for name, kind in KINDS.items():
        for card in bulk.cards_named(name, use=False):
            if card.is_integer(1):
                counts.setdefault(card.integer(1), [0, 0])[kind.corners == 3 and not kind.middles] += 1
    facets = {
        pid for pid, (others, triangles) in counts.items() if triangles > MAX_TRIANGLE_SHARE * (others + triangles)
    }
    for name, kind in KINDS.items():
        bulk.for_each_card(lambda card, kind=kind: _shell(model, card, kind, properties, facets), name)  # type: ignore[misc]


def _shell(model: NastranModel, card: Card, kind: Kind, properties: ShellProperties, facets: set[int]) -> None:
    number, pid = card.integer(0), card.integer(1, card.integer(0))
    corners = [card.integer(2 + k) for k in range(kind.corners)]
    middles = [card.integer(2 + kind.corners + k, 0) for k in range(kind.corners)] if kind.middles else []
    if len(set(corners)) < len(corners):
        raise ValueError(f"{card} names a grid point twice; its corners must differ")
    if not model.grids.require(corners + [g for g in middles if g], card):
        return
    shell_property = properties(pid)
    if shell_property is None:
        return
    x = np.array([model.grids[g].position for g in corners])
    normal = shell_normal(x, str(card))
    thickness = _thickness(model, card, kind, shell_property)
    section, extra_mass = shell_property.section, model.nonstructural(number)
    axis = None if shell_property.isotropic else _axis(model, card, kind, x, normal)
    offset = card.real(kind.offset, 0.0) * model.bulk.units.length if kind.offset >= 0 else 0.0
    rows, cell = [model.row(g) for g in corners], CELLS[kind.corners, any(middles)]
    if any(middles):
        rows += with_middles(model, cell, corners, middles, card)
    plate = pid in facets and cell == "triangle" and not section.coupled and not offset
    key: tuple[object, ...] = ("shell", plate, pid, offset, extra_mass > 0)
    fields = {"extra_mass": extra_mass} if extra_mass and not plate else {}
    if plate:  # flat facets: one axis and one thickness for a member
        mean = None if thickness is None else float(np.mean(thickness))
        below = axis is not None and not same_side(normal)
        section = shell_property.section_for(mean)
        section = (section.turned_over() if below else section).with_added_mass(extra_mass)
        key += (mean, below, extra_mass)
        if thickness is not None and np.ptp(thickness) > 1e-6 * np.max(thickness):
            text = "each such facet has the mean of its corners' thicknesses"
            model.bulk.findings.unused(f"{card.name} T1 to T3 that differ", text, card.location)
    model.build.cell(
        cell, rows, key, f"pid_{pid}", "plate" if plate else "shell", section, None,
        {"offset": offset} if offset else {}, model.bulk.names_of(pid), number, fields, (normal, axis, thickness),
    )  # fmt: skip
    grids = corners + [g for g in middles if g]
    model.moving.update(grids)
    model.turning.update(grids)


def _thickness(model: NastranModel, card: Card, kind: Kind, shell_property: ShellProperty) -> tuple[float, ...] | None:
    """Thickness of the element at its corners [m]; None: that of its property."""
    relative = card.is_integer(kind.relative) and card.integer(kind.relative) == 1
    fields = [card.real(k, 0.0) for k in kind.thickness]
    if not shell_property.has_thickness and (relative or not all(fields)):
        raise ValueError(f"{card} has no thickness at a corner, and {shell_property.card} gives none; give one of them")
    if not any(fields):
        return None
    if shell_property.section_of_thickness is None:
        model.bulk.findings.unused(
            f"{card.name} T1 to T{kind.corners}",
            "thickness at corners of laminates is left out; that of the plies is used",
            card.location,
        )  # fmt: skip
        return None
    unit = shell_property.thickness if relative else model.bulk.units.length
    values = tuple(t * unit if t else shell_property.thickness for t in fields)
    if min(values) <= 0:
        raise ValueError(
            f"{card} has a thickness of {min(values) / model.bulk.units.length:.6g} at a corner; it must be positive"
        )
    return values


def _axis(model: NastranModel, card: Card, kind: Kind, x: Array, normal: Array) -> Array:
    """Direction of the material's axis 1 in basic components: THETA from side 1-2, or a coordinate system's x axis."""
    if kind.theta >= 0 and card.is_integer(kind.theta) and card.has(kind.theta):
        system = model.systems(card.integer(kind.theta))
        axis = system.axes_at(x.mean(axis=0))[0]
        if np.linalg.norm(np.cross(axis, normal)) < 1e-3:
            model.bulk.findings.unused(
                f"{card.name} MCID", "the x axis of the material system is normal to the element; its y axis is used",
                card.location,
            )  # fmt: skip
            axis = system.axes_at(x.mean(axis=0))[1]
        flat = axis - (axis @ normal) * normal
        return axis if system.kind == "R" else np.asarray(flat / np.linalg.norm(flat))
    angle = math.radians(card.real(kind.theta, 0.0)) if kind.theta >= 0 else 0.0
    side = x[1] - x[0]
    side = side - (side @ normal) * normal
    side = side / np.linalg.norm(side)
    return np.asarray(math.cos(angle) * side + math.sin(angle) * np.cross(normal, side))
