"""Properties of bars and beams: PBAR, PBARL, PBEAM, PBEAML and PBCOMP; in SI, at one or more stations."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from femflex.decks.findings import BY_MATRICES
from femflex.decks.nastran.bulk import Bulk, ByNumber
from femflex.decks.nastran.card import Card
from femflex.decks.nastran.materials import Materials
from femflex.fem.sections import profiles
from femflex.fem.sections.profiles import Place, SectionProperties, principal_moments

SHAPES: dict[str, tuple[int, Callable[..., SectionProperties]]] = {  # type -> number of dimensions, and the shape
    "ROD": (1, lambda radius: profiles.ellipse(radius, radius)),
    "TUBE": (2, lambda outer, inner: profiles.tube(outer, outer - inner)),
    "TUBE2": (2, profiles.tube),
    "BAR": (2, profiles.bar),
    "BOX": (4, lambda w, h, t, sides: profiles.box(w, h, t, t, sides, sides)),
    "BOX1": (6, profiles.box),
    "I": (6, profiles.i_section),
    "I1": (4, lambda flanges, web, inner, h: profiles.i_section(
        h, flanges + web, flanges + web, web, (h - inner) / 2, (h - inner) / 2)),
    "H": (4, profiles.h_section),
    "T": (4, profiles.tee),
    "T1": (4, profiles.lying_tee),
    "T2": (4, lambda w, h, t, web: profiles.upside_down(profiles.tee(w, h, t, web))),
    "CHAN": (4, profiles.channel),
    "CHAN1": (4, lambda flanges, web, inner, h: profiles.channel(flanges + web, h, web, (h - inner) / 2)),
    "CHAN2": (4, lambda wall, bottom, h, w: profiles.turned_section(profiles.channel(h, w, bottom, wall))),
    "Z": (4, lambda flange, web, inner, h: profiles.zee(flange, web, h, (h - inner) / 2)),
    "L": (4, profiles.angle),
    "CROSS": (4, profiles.cross),
    "HAT": (4, profiles.hat),
    "HEXA": (3, profiles.hexagon),
}  # fmt: skip


@dataclass(frozen=True)
class Station:
    """Section of a bar: A [m^2], I1, I2, I12, J [m^4], nonstructural mass [kg/m] and its polar inertia [kg m]."""

    A: float
    I1: float
    I2: float
    I12: float
    J: float
    nsm: float = 0.0
    nsi: float = 0.0


@dataclass(frozen=True)
class BarProperty:
    """A property of bars.

    positions  x / L of its stations, from 0 to 1
    stations   sections at these positions
    K1, K2     shear factors; zero: no transverse shear
    E, G       [Pa]; density [kg/m^3]
    centroid   y and z of the neutral axis from the shear centre, at both ends [m]
    mass       y and z of the nonstructural mass from the shear centre [m]
    """

    number: int
    positions: tuple[float, ...]
    stations: tuple[Station, ...]
    K1: float
    K2: float
    E: float
    G: float
    density: float
    card: Card
    centroid: Place = (0.0, 0.0)
    mass: Place = (0.0, 0.0)

    def with_added_mass(self, mass: float) -> BarProperty:
        """The property with additional nonstructural mass per length [kg/m], at the position of its nonstructural
        mass."""
        if not mass:
            return self
        stations = tuple(replace(station, nsm=station.nsm + mass) for station in self.stations)
        if any(self.density * station.A + station.nsm < 0 for station in stations):
            raise ValueError(
                f"{self.card} and nonstructural mass give a mass per length below zero; correct one of them"
            )
        return replace(self, stations=stations)


class BarProperties:
    """The properties of bars of a deck by number."""

    def __init__(self, bulk: Bulk, materials: Materials) -> None:
        self._bulk, self._materials = bulk, materials
        self._properties: ByNumber[BarProperty] = ByNumber(
            bulk, "property", "of bars and beams it has", ("PBEND", "PBMSECT", "PBRSECT"),
            "PBAR, PBARL, PBEAM, PBEAML or PBCOMP",
        )  # fmt: skip
        cards = {"CBAR": [*bulk.cards_named("BAROR")], "CBEAM": [*bulk.cards_named("BEAMOR")]}
        self.defaults = {name: some[0] for name, some in cards.items() if some}
        readers = {"PBAR": self._pbar, "PBARL": self._of_shape, "PBEAM": self._pbeam, "PBEAML": self._of_shape,
                   "PBCOMP": self._pbcomp}  # fmt: skip
        for name, read in readers.items():
            self._properties.read_cards(name, lambda card, read=read: self._checked(read(card)))  # type: ignore[misc]

    def _checked(self, bar: BarProperty) -> BarProperty:
        """The property with the overrides of the case. Raises ValueError for values below zero."""
        fields = {"A": "A", "I1": "I1", "I2": "I2", "J": "J", "nonstructural_mass": "nsm"}  # of overrides, of stations
        values = {key: getattr(bar.stations[0], name) for key, name in fields.items()}
        changed = self._bulk.override([f"pid_{bar.number}", *self._bulk.names_of(bar.number)], values, str(bar.card))
        changes = {fields[key]: value for key, value in changed.items() if value != values[key]}
        bar = replace(bar, stations=tuple(replace(station, **changes) for station in bar.stations))
        if any(s.A < 0 or s.I1 < 0 or s.I2 < 0 or s.J < 0 for s in bar.stations):
            raise ValueError(f"{bar.card} has an area or a moment below zero; correct it")
        if any(bar.density * s.A + s.nsm < 0 for s in bar.stations):
            raise ValueError(
                f"{bar.card} has a mass per length below zero; correct the density or the nonstructural mass"
            )
        return bar

    def __call__(self, number: int) -> BarProperty | None:
        """The property with this number; None if it has an error, which is already reported.

        Raises ValueError if the deck has no such property.
        """
        return self._properties(number)

    def _station(self, A: float, I1: float, I2: float, I12: float, J: float, nsm: float) -> Station:
        """A station from values in the units of the deck."""
        u = self._bulk.units
        I1, I2, I12, J = (value * u.length**4 for value in (I1, I2, I12, J))
        return Station(A * u.length**2, I1, I2, I12, J, nsm * (u.mass / u.length * self._bulk.wtmass))

    def _places(self, card: Card, k: int) -> Place:
        """Fields k and k + 1 as a place in the section [m]."""
        return card.real(k, 0.0) * self._bulk.units.length, card.real(k + 1, 0.0) * self._bulk.units.length

    def _pbar(self, card: Card) -> BarProperty:
        A, I1, I2, J, nsm = card.reals(2, 5)
        station = self._station(A, I1, I2, card.real(18, 0.0), J, nsm)
        return self._bar_property(card, {0.0: station}, card.real(16, 0.0), card.real(17, 0.0))

    def _of_shape(self, card: Card) -> BarProperty:
        """PBARL, and PBEAML with further stations, whose shear centre is placed at the centroid."""
        kind, k, first = card.word(3), 8, None
        count, stations = n_dimensions(kind), dict[float, Station]()
        while first is None or (card.name == "PBEAML" and card.words_from(k)):
            position = 0.0
            if first is not None:  # SO and X/XB precede the dimensions
                position, k = card.real(k + 1, 1.0), k + 2
                if not any(card.has(i) for i in range(k - 2, k + count + 1)):
                    break
            dimensions = card.reals(k, count if first else min(count, len(card.words_from(k))))
            section = bar_shape(kind, dimensions) if first is None or any(dimensions) else first
            first = first or section
            values = (section.A, section.Iz, section.Iy, section.Iyz, section.J)
            stations[position] = self._station(*values, card.real(k + count, 0.0))
            k += count + 1
        return self._bar_property(card, stations, first.ky, first.kz)

    def _pbeam(self, card: Card) -> BarProperty:
        inertia_unit = self._bulk.units.mass * self._bulk.units.length * self._bulk.wtmass

        def values(k: int, default: list[float]) -> list[float]:
            return [card.real(k + i, value) for i, value in enumerate(default)]

        first = values(2, [0.0] * 6)
        stations, k = {0.0: self._station(*first)}, 8
        # then 8 stress points, unless the next line begins with YES or NO (16 fields per station)
        if card.word(8) not in ("YES", "NO", "YESA"):
            k = 16
        while card.word(k) in ("YES", "NO", "YESA"):
            stations[card.real(k + 1, 1.0)] = self._station(*values(k + 2, first))
            k += 16 if card.word(k) == "YES" else 8
        nsi = card.real(k + 4, 0.0) * inertia_unit
        stations = {position: replace(s, nsi=nsi) for position, s in stations.items()}
        M, N = self._places(card, k + 8), self._places(card, k + 12)
        return self._bar_property(card, stations, card.real(k, 1.0), card.real(k + 1, 1.0), N, M)

    def _pbcomp(self, card: Card) -> BarProperty:
        if symmetry := card.integer(14, 0):
            raise ValueError(
                f"{card} has SECTION {symmetry}, lumped areas, which are not read; give A, I1, I2 and J of the whole "
                f"section on a PBEAM, or {BY_MATRICES}"
            )
        stations = {0.0: self._station(card.real(2), *card.reals(3, 5))}
        N, M = self._places(card, 12), self._places(card, 10)
        return self._bar_property(card, stations, card.real(8, 1.0), card.real(9, 1.0), N, M)

    def _bar_property(
        self, card: Card, stations: dict[float, Station], K1: float, K2: float, centroid: Place = (0.0, 0.0),
        mass: Place = (0.0, 0.0),
    ) -> BarProperty:  # fmt: skip
        """The property of a card on the material of its second field; the last station reaches to the end."""
        stations = {1.0: stations[max(stations)], **stations}
        positions = tuple(sorted(stations))
        if positions[0] != 0.0 or positions[-1] != 1.0:
            raise ValueError(f"{card} has stations at {positions}; they lie between 0 and 1")
        E, G, rho = self._materials.bar(card.integer(1))
        return BarProperty(
            card.integer(0), positions, tuple(stations[x] for x in positions), K1, K2, E, G, rho, card, centroid, mass
        )


def bar_shape(kind: str, dimensions: Sequence[float]) -> SectionProperties:
    """The shape of this type of PBARL. Raises ValueError for unknown types and impossible dimensions."""
    count = n_dimensions(kind)
    if len(dimensions) < count:
        raise ValueError(f"section type {kind} has {len(dimensions)} dimensions; it needs {count}")
    shape = SHAPES[kind][1](*dimensions[:count])
    if not (shape.A > 0 and shape.Iz > 0 and shape.Iy > 0 and shape.J > 0):
        raise ValueError(
            f"section type {kind} with dimensions {[*dimensions[:count]]} has no area or no stiffness; correct them"
        )
    return shape


def n_dimensions(kind: str) -> int:
    """Number of dimensions of this type of PBARL. Raises ValueError for unknown types."""
    if kind not in SHAPES:
        raise ValueError(f"section type {kind!r} is not known; known are {', '.join(SHAPES)}")
    return SHAPES[kind][0]


def principal(station: Station) -> tuple[float, Station]:
    """Angle [rad] from the element's y axis to the section's principal axis, and the section in principal axes."""
    alpha, I1, I2 = principal_moments(station.I1, station.I2, station.I12)
    return alpha, replace(station, I1=I1, I2=I2, I12=0.0)
