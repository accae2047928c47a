"""Bars and rods: CBAR, CBEAM, CROD, CONROD, CTUBE with their orientation, offsets and pin flags."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from femflex.arrays import Array
from femflex.decks.builder import direction_key
from femflex.decks.model import LARGE_EXTENT, MASSLESS
from femflex.decks.nastran.bar_properties import BarProperty, principal
from femflex.decks.nastran.bulk import ByNumber
from femflex.decks.nastran.card import Card
from femflex.decks.nastran.model import NastranModel
from femflex.fem import Rigid
from femflex.fem.sections.library import CableSection, StiffnessSection
from femflex.fem.sections.profiles import tube
from femflex.fem.support import COMPONENTS

STIFFNESSES = {
    "EA": ("E", "A"),
    "EIz": ("E", "I1"),
    "EIy": ("E", "I2"),
    "GJ": ("G", "J"),
}  # modulus, value of a station
RELATIVE_SUBSTITUTE = 1e-9  # stiffness given to a bar in place of zero, relative to its other stiffnesses


@dataclass(frozen=True)
class Rod:
    """A property of rods: EA [N], GJ [N m^2], mass per length [kg/m]."""

    EA: float
    GJ: float
    mass: float


def read_line_elements(model: NastranModel) -> None:
    """Add the bars and rods of a deck to the model."""
    bulk = model.bulk
    for name in ("CBAR", "CBEAM"):
        bulk.for_each_card(lambda card: _bar(model, card), name)
    rods: ByNumber[Rod] = ByNumber(bulk, "property", "of rods it has")
    for name in ("PROD", "PTUBE"):
        rods.read_cards(name, lambda card: _rod_property(model, card))
    for name in ("CROD", "CTUBE"):
        bulk.for_each_card(lambda card: _rod(model, card, rods), name)
    bulk.for_each_card(lambda card: _conrod(model, card), "CONROD")


def _bar(model: NastranModel, card: Card) -> None:
    number = card.integer(0)
    default = model.bars.defaults.get(card.name)
    pid = card.integer(1, default.integer(1, number) if default is not None else number)
    ends = [card.integer(2), card.integer(3)]
    if not model.grids.require(ends, card):
        return
    bar = model.bars(pid)
    if bar is None:
        return
    extra_mass = model.nonstructural(number)
    bar = bar.with_added_mass(extra_mass)
    v, frames = bar_vector(model, card), _offset_codes(card)
    points = [model.grids[g].position for g in ends]
    offsets = [np.array(card.reals(k, 3)) * model.bulk.units.length for k in (10, 13)]
    if frames[0] not in "GB" or set(frames[1:]) - set("GOE"):
        raise ValueError(f"{card} has offset codes {frames!r}, which are not understood; use GGG or BGG")
    span = points[1] - points[0]
    for k in (0, 1):
        if not offsets[k].any():
            continue
        if frames[k + 1] == "G":
            points[k] = points[k] + offsets[k] @ model.grids.axes(ends[k])
        else:
            points[k] = points[k] + offsets[k] @ bar_frame(span, v, card)
    x = points[1] - points[0]
    length = float(np.linalg.norm(x))
    if length <= 1e-9 * max(1.0, float(np.abs(points[0]).max())) * 1e-3:
        raise ValueError(f"{card} has no length")
    frame = bar_frame(x, v, card)
    alpha, _ = principal(bar.stations[0])
    y = frame[1] if alpha == 0 else math.cos(alpha) * frame[1] + math.sin(alpha) * frame[2]
    # elements with one orientation vector form one member; with rotated axes the vector is normal to each element
    share_orientation = alpha == 0 and v is not None
    orientation = v / np.linalg.norm(v) if share_orientation and v is not None else y
    rows = [_end_point(model, ends[k], points[k], f"{card.name.lower()}_{number}-end{'AB'[k]}") for k in (0, 1)]
    pins = [tuple(c for c in card.components(k)) for k in (8, 9)]
    if alpha and any(set(p) & {2, 3} in ({2}, {3}) or set(p) & {5, 6} in ({5}, {6}) for p in pins):
        raise ValueError(f"{card} has pin flags for one plane alone and a section with I12; give principal axes")
    varies = any(s != bar.stations[0] for s in bar.stations)
    key = ("bar", pid, direction_key(orientation), number if varies or any(pins) else None, extra_mass)
    section = _bar_section(model, bar, length, alpha)
    options = {"orientation": tuple(float(c) for c in orientation), **_bar_options(model, bar, card)}
    same_pins = len({pin for pin in pins if pin}) < 2
    nodes = [row for row, pin in zip(rows, pins, strict=True) if pin]
    if same_pins or len(nodes) < 2:
        pin = next((pin for pin in pins if pin), ())
        _add_bar(model, card, pid, tuple(rows), key, section, options, pin, nodes)
    else:
        middle = model.build.point((points[0] + points[1]) / 2)
        for k, half in ((0, (rows[0], middle)), (1, (middle, rows[1]))):
            _add_bar(model, card, pid, half, (*key, k), section, options, pins[k], [rows[k]])
    model.moving.update(ends)
    model.turning.update(ends)


def bar_vector(model: NastranModel, card: Card) -> Array | None:
    """The orientation vector (3,) [m] of a CBAR or CBEAM in basic components, to a grid or from the card; None: any, in
    a deck of Gmsh. Raises ValueError if there is none."""
    if model.bulk.raw.by_gmsh and card.is_integer(4) and not card.has(5):
        return None
    default = model.bars.defaults.get(card.name)
    source = default if default is not None and not any(card.has(k) for k in (4, 5, 6)) else card
    if source.is_integer(4) and not source.has(5) and not source.has(6):
        grid = source.integer(4)
        if grid not in model.grids:
            raise ValueError(f"{card} is oriented by grid point {grid}, which no GRID card defines")
        return model.grids[grid].position - model.grids[card.integer(2)].position
    v = np.array(source.reals(4, 3))
    if not v.any():
        raise ValueError(f"{card} has no orientation vector; give X1, X2, X3 or G0")
    return np.asarray(v @ model.grids.axes(card.integer(2)) if _offset_codes(card)[0] == "G" else v)


def _offset_codes(card: Card) -> str:
    word = card.word(7)
    return word if word.isalpha() and len(word) == 3 else "GGG"


def _add_bar(
    model: NastranModel, card: Card, pid: int, rows: tuple[int, ...], key: object, section: StiffnessSection,
    options: dict[str, object], pins: tuple[int, ...], released_rows: list[int],
) -> None:  # fmt: skip
    if pins:
        name = f"{card.name.lower()}_{card.integer(0)}-pins{'-'.join(map(str, released_rows))}"
        model.build.point_groups[name] = list(released_rows)
        options = {**options, "release": tuple(COMPONENTS[c - 1] for c in pins), "release_at": name}
    model.build.cell(
        "line", rows, key, f"pid_{pid}", "beam", section, None, options, model.bulk.names_of(pid), card.integer(0)
    )


def bar_frame(x: Array, v: Array | None, card: Card) -> Array:
    """Axes x, y, z of an element along x (3,) [m] as rows (3, 3). Raises ValueError if v (3,) lies along it."""
    x = x / np.linalg.norm(x)
    if v is None:
        v = np.array([0.0, 0, 1.0]) if abs(x[2]) < 0.9 else np.array([0.0, 1.0, 0.0])
    y = v - (v @ x) * x
    if np.linalg.norm(y) <= 1e-6 * np.linalg.norm(v):
        raise ValueError(f"{card} has its orientation vector along its axis; give one across it")
    y = y / np.linalg.norm(y)
    return np.stack([x, y, np.cross(x, y)])


def _end_point(model: NastranModel, grid: int, point: Array, name: str) -> int:
    """Row of the point at an end: the grid's, or a new one rigidly attached to it."""
    grid_row = model.row(grid)
    if not np.any(point != model.grids[grid].position):
        return grid_row
    row = model.build.point(point)
    model.build.point_group(row, name)
    model.connections.append(Rigid(group=name, reference=model.group(grid)))
    return row


def _bar_section(model: NastranModel, bar: BarProperty, length: float, alpha: float) -> StiffnessSection:
    """The section of a bar along its length; zero values are replaced by very small ones."""
    stations = [principal(s)[1] for s in bar.stations]
    # as in Nastran, the value at mid-length governs a linear variation of A
    values = {name: [getattr(bar, E) * getattr(s, A) for s in stations] for name, (E, A) in STIFFNESSES.items()}
    largest = {name: max(v) for name, v in values.items()}
    for name, (modulus, zero) in STIFFNESSES.items():
        if largest[name] > 0:
            values[name] = [max(v, RELATIVE_SUBSTITUTE * largest[name]) for v in values[name]]
            continue
        model.bulk.findings.note(
            f"{bar.card} has {zero}{' or G' if modulus == 'G' else ''} = 0: a stiffness of {RELATIVE_SUBSTITUTE:.0e} "
            "times its other stiffness is used; support the motions that no other element resists"
        )
        others = [v for other, v in largest.items() if other not in (name, "EA")]
        scale = (
            largest["EIz"] / length**2
            if name == "EA"
            else max(*others, RELATIVE_SUBSTITUTE * largest["EA"] * length**2)
        )
        values[name] = [max(RELATIVE_SUBSTITUTE * scale, 1e-30)] * len(stations)
    values["mass_per_length"] = [bar.density * s.A + s.nsm for s in stations]
    least_mass = MASSLESS * max(values["EA"])
    massless = not max(values["mass_per_length"]) > 0
    if massless:
        model.bulk.findings.note(f"{bar.card} has no density and no nonstructural mass: its bars have no mass")
    values["mass_per_length"] = [max(m, least_mass) for m in values["mass_per_length"]]
    for name, moment in (("ry", "I2"), ("rz", "I1")):
        values[name] = [
            math.sqrt(max((bar.density * getattr(s, moment) + s.nsi / 2) / m, 1e-24)) if not massless else 1e-9
            for s, m in zip(stations, values["mass_per_length"], strict=True)
        ]
    if bar.K1 > 0 and bar.K2 > 0 and bar.G > 0:
        # along the principal axes of the section, by rotation of the flexibilities of K1 and K2
        c, s = math.cos(alpha) ** 2, math.sin(alpha) ** 2
        K1, K2 = (bar.K1 * bar.K2 / (p * bar.K2 + q * bar.K1) for p, q in ((c, s), (s, c)))
        for name, K in (("GAy", K1), ("GAz", K2)):
            values[name] = [max(K * bar.G * s.A, RELATIVE_SUBSTITUTE * largest["EA"]) for s in stations]
    fields: dict[str, Any] = {}
    for name, v in values.items():
        fields[name] = v[0] if all(value == v[0] for value in v) else ([x * length for x in bar.positions], v)
    return StiffnessSection(**fields)


def _bar_options(model: NastranModel, bar: BarProperty, card: Card) -> dict[str, object]:
    """Options of the beam family: shear, and the positions of centroid, shear centre and mass centre of PBEAM."""
    has_shear = bar.K1 > 0 and bar.K2 > 0 and bar.G > 0
    if (bar.K1 > 0) != (bar.K2 > 0):
        model.bulk.findings.note(f"{bar.card} has one of K1 and K2 zero: transverse shear is left out")
    options: dict[str, object] = {"shear": has_shear, "extent": LARGE_EXTENT}
    if not all(bar.G * s.J > 0 for s in bar.stations):
        options["torsion_order"] = 1  # internal shape functions would have no stiffness
    if not all(bar.E * s.A > 0 for s in bar.stations):
        options["axial_order"] = 1
    if any(bar.centroid) or any(bar.mass):
        station = bar.stations[0]
        total = bar.density * station.A + station.nsm
        alpha, _ = principal(station)
        rotation = np.array([[math.cos(alpha), math.sin(alpha)], [-math.sin(alpha), math.cos(alpha)]])
        N, M = rotation @ bar.centroid, rotation @ bar.mass  # along the principal axes, as the section
        centre = station.nsm / total * (M - N) if total > 0 else np.zeros(2)
        options["offset"] = tuple(float(c) for c in N)
        if has_shear:
            options["shear_centre"] = tuple(float(-c) for c in N)
        elif N.any():
            raise ValueError(
                f"{bar.card} has its neutral axis off its shear centre, which needs transverse shear; give K1 and K2"
            )
        if centre.any():
            options["mass_centre"] = tuple(float(c) for c in centre)
    return options


def _rod_property(model: NastranModel, card: Card) -> Rod:
    """PROD: PID, MID, A, J, C, NSM; PTUBE: PID, MID, OD, T, NSM."""
    number, u, bulk = card.integer(0), model.bulk.units, model.bulk
    E, G, rho = model.materials.bar(card.integer(1))
    if card.name == "PROD":
        A, J, nsm = card.real(2) * u.length**2, card.real(3, 0.0) * u.length**4, card.real(5, 0.0)
    else:
        outer = card.real(2) * u.length / 2
        inner = outer - card.real(3, outer / u.length) * u.length
        if inner < -1e-12 * outer or inner >= outer:
            raise ValueError(f"{card} has a wall that is thicker than half its diameter, or none")
        section = tube(outer, outer - inner)
        A, J, nsm = section.A, section.J, card.real(4, 0.0)
    values = {"A": A, "J": J, "nonstructural_mass": nsm * (u.mass / u.length * bulk.wtmass)}
    v = bulk.override([f"pid_{number}", *bulk.names_of(number)], values, str(card))
    if v["A"] < 0 or rho * v["A"] + v["nonstructural_mass"] < 0:
        raise ValueError(f"{card} has an area or a mass per length below zero; correct it")
    return Rod(E * v["A"], G * v["J"], rho * v["A"] + v["nonstructural_mass"])


def _rod(model: NastranModel, card: Card, rods: ByNumber[Rod]) -> None:
    pid = card.integer(1, card.integer(0))
    if (rod := rods(pid)) is not None:
        _add_rod(model, card, [card.integer(2), card.integer(3)], rod, pid, ("rod", pid))


def _conrod(model: NastranModel, card: Card) -> None:
    u, bulk = model.bulk.units, model.bulk
    E, G, rho = model.materials.bar(card.integer(3))
    A, J = card.real(4, 0.0) * u.length**2, card.real(5, 0.0) * u.length**4
    rod = Rod(E * A, G * J, rho * A + card.real(7, 0.0) * u.mass / u.length * bulk.wtmass)
    _add_rod(model, card, [card.integer(1), card.integer(2)], rod, 0, ("conrod", card.integer(3), A, J, rod.mass))


def _add_rod(model: NastranModel, card: Card, ends: list[int], rod: Rod, pid: int, key: object) -> None:
    if not model.grids.require(ends, card):
        return
    rod = replace(rod, mass=rod.mass + model.nonstructural(card.integer(0)))
    if rod.mass < 0:
        raise ValueError(f"{card} has a mass per length below zero; correct its nonstructural mass")
    a, b = (model.grids[g].position for g in ends)
    length = float(np.linalg.norm(b - a))
    if not length > 0:
        raise ValueError(f"{card} has no length")
    if rod.GJ > 0:
        model.twisting.append((ends[0], ends[1], rod.GJ / length, card))
    if not rod.EA > 0:
        if not rod.GJ > 0:
            raise ValueError(f"{card} has neither area nor torsion constant; give one")
        return
    section = CableSection(EA=rod.EA, mass_per_length=max(rod.mass, MASSLESS * rod.EA))
    rows = [model.row(g) for g in ends]
    model.build.cell(
        "line", rows, (key, rod.mass), f"pid_{pid}" if pid else "conrods", "rod", section, None, {},
        model.bulk.names_of(pid), card.integer(0),
    )  # fmt: skip
    model.moving.update(ends)
