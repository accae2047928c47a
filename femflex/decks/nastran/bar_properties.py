"""Properties of bars and beams: PBAR, PBARL, PBEAM, PBEAML and PBCOMP; in SI, at one or more stations."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from femflex.decks.findings import BY_MATRICES
from femflex.decks.nastran.bar_shapes import SHAPES, shape_of
from femflex.decks.nastran.bulk import Bulk
from femflex.decks.nastran.card import Card
from femflex.decks.nastran.materials import Materials

STATIONS = 11  # maximum number of stations of a PBEAM


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
    centroid: tuple[float, float] = (0.0, 0.0)
    mass: tuple[float, float] = (0.0, 0.0)
    names: list[str] = field(default_factory=list, compare=False)

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
        self._by_number: dict[int, BarProperty | None] = {}
        self._unsupported: dict[int, Card] = {}
        default_cards = {
            "CBAR": next(iter(bulk.cards_named("BAROR")), None),
            "CBEAM": next(iter(bulk.cards_named("BEAMOR")), None),
        }
        self.defaults = {name: card for name, card in default_cards.items() if card is not None}
        for name, read in (
            ("PBAR", self._pbar),
            ("PBARL", self._pbarl),
            ("PBEAM", self._pbeam),
            ("PBEAML", self._pbeaml),
            ("PBCOMP", self._pbcomp),
        ):
            bulk.for_each_card(lambda card, read=read: self._add(card, read), name)  # type: ignore[misc]
        for card in bulk.cards_named("PBEND", "PBMSECT", "PBRSECT", use=False):
            if card.is_integer(0):
                self._unsupported[card.integer(0)] = card

    def _add(self, card: Card, read: object) -> None:
        number = card.integer(0)
        if self._by_number.get(number) is not None:
            first = self._by_number[number].card  # type: ignore[union-attr]
            if first.fields != card.fields:
                raise ValueError(f"{card} gives property {number} again, which stands at {first.location} already")
            return
        self._by_number[number] = None  # registered, even if it has errors
        bar: BarProperty = read(card)  # type: ignore[operator]
        first_station = bar.stations[0]
        values = {
            "A": first_station.A,
            "I1": first_station.I1,
            "I2": first_station.I2,
            "J": first_station.J,
            "nonstructural_mass": first_station.nsm,
        }
        changed = self._bulk.override([f"pid_{number}", *self._bulk.names_of(number)], values, str(card))
        if changed != values:
            keys = {"A": "A", "I1": "I1", "I2": "I2", "J": "J", "nonstructural_mass": "nsm"}
            changes = {keys[k]: v for k, v in changed.items() if v != values[k]}
            bar = replace(bar, stations=tuple(replace(s, **changes) for s in bar.stations))
        if any(s.A < 0 or s.I1 < 0 or s.I2 < 0 or s.J < 0 for s in bar.stations):
            raise ValueError(f"{card} has an area or a moment below zero; correct it")
        if any(bar.density * s.A + s.nsm < 0 for s in bar.stations):
            raise ValueError(f"{card} has a mass per length below zero; correct the density or the nonstructural mass")
        self._by_number[number] = bar

    def __call__(self, number: int) -> BarProperty | None:
        """The property with this number; None if it has an error, which is already reported.

        Raises ValueError if the deck has no such property.
        """
        if number in self._unsupported and number not in self._by_number:
            raise ValueError(
                f"names {self._unsupported[number]}, which is not understood; give PBAR, PBARL, PBEAM, PBEAML or "
                "PBCOMP instead"
            )
        if number not in self._by_number:
            numbers = ", ".join(map(str, sorted(self._by_number)[:12])) or "none"
            raise ValueError(f"names property {number}, which is not in the deck; of bars and beams it has {numbers}")
        return self._by_number[number]

    def _lengths(self) -> tuple[float, float, float]:
        u = self._bulk.units
        return u.length, u.mass / u.length * self._bulk.wtmass, u.mass * u.length * self._bulk.wtmass

    def _pbar(self, card: Card) -> BarProperty:
        l, m, _ = self._lengths()
        E, G, rho = self._materials(card.integer(1)).bar()
        A, I1, I2, J = (card.real(k, 0.0) for k in (2, 3, 4, 5))
        station = Station(A * l**2, I1 * l**4, I2 * l**4, card.real(18, 0.0) * l**4, J * l**4, card.real(6, 0.0) * m)
        return BarProperty(
            card.integer(0), (0.0, 1.0), (station,) * 2, card.real(16, 0.0), card.real(17, 0.0), E, G, rho, card
        )

    def _pbarl(self, card: Card) -> BarProperty:
        l, m, _ = self._lengths()
        E, G, rho = self._materials(card.integer(1)).bar()
        kind = card.word(3)
        words = card.words_from(8)
        count = SHAPES[kind][0] if kind in SHAPES else 0
        shape = shape_of(kind, [card.real(8 + k, 0.0) for k in range(min(count, len(words)))])
        nsm = card.real(8 + count, 0.0) * m
        station = Station(shape.A * l**2, shape.I1 * l**4, shape.I2 * l**4, shape.I12 * l**4, shape.J * l**4, nsm)
        return BarProperty(card.integer(0), (0.0, 1.0), (station,) * 2, shape.K1, shape.K2, E, G, rho, card)

    def _pbeaml(self, card: Card) -> BarProperty:
        l, m, _ = self._lengths()
        E, G, rho = self._materials(card.integer(1)).bar()
        kind = card.word(3)
        count = SHAPES[kind][0] if kind in SHAPES else 0
        if not count:
            shape_of(kind, [])
        stations: dict[float, Station] = {}
        k, position, shape = 8, 0.0, None
        while k < len(card.fields):
            if stations:
                k += 1  # SO
                position = card.real(k, 1.0)
                k += 1
                if not any(card.has(i) for i in range(k - 2, k + count + 1)):
                    break
            dims = [card.real(k + i, 0.0) for i in range(count)]
            station_shape = shape_of(kind, dims) if any(dims) or shape is None else shape
            shape = shape or station_shape
            nsm = card.real(k + count, 0.0) * m
            stations[position] = Station(
                station_shape.A * l**2,
                station_shape.I1 * l**4,
                station_shape.I2 * l**4,
                station_shape.I12 * l**4,
                station_shape.J * l**4,
                nsm,
            )
            k += count + 1
            if not any(card.has(i) for i in range(k, len(card.fields))):
                break
        assert shape is not None
        origin = (0.0, 0.0)  # PBEAML places the shear centre at the centroid
        return self._bar_property(card, stations, shape.K1, shape.K2, (E, G, rho), origin, origin)

    def _pbeam(self, card: Card) -> BarProperty:
        l, m, mi = self._lengths()
        E, G, rho = self._materials(card.integer(1)).bar()

        def station(k: int, default: Station | None) -> Station:
            d = [0.0] * 5 if default is None else [
                default.A / l**2, default.I1 / l**4, default.I2 / l**4, default.I12 / l**4, default.J / l**4
            ]  # fmt: skip
            A, I1, I2, I12, J = (card.real(k + i, d[i]) for i in range(5))
            nsm = card.real(k + 5, default.nsm / m if default and m else 0.0) * m
            return Station(A * l**2, I1 * l**4, I2 * l**4, I12 * l**4, J * l**4, nsm)

        first = station(2, None)
        stations, k = {0.0: first}, 8
        # then 8 stress points, unless the next line begins with YES or NO (16 fields per station)
        if card.word(8) not in ("YES", "NO", "YESA"):
            k = 16
        while card.word(k) in ("YES", "NO", "YESA"):
            stations[card.real(k + 1, 1.0)] = station(k + 2, first)
            k += 16 if card.word(k) == "YES" else 8
        K1, K2 = card.real(k, 1.0), card.real(k + 1, 1.0)
        nsi = card.real(k + 4, 0.0) * mi
        stations = {position: replace(s, nsi=nsi) for position, s in stations.items()}
        M = (card.real(k + 8, 0.0) * l, card.real(k + 9, 0.0) * l)
        N = (card.real(k + 12, 0.0) * l, card.real(k + 13, 0.0) * l)
        return self._bar_property(card, stations, K1, K2, (E, G, rho), N, M)

    def _pbcomp(self, card: Card) -> BarProperty:
        l, m, _ = self._lengths()
        if symmetry := card.integer(14, 0):
            raise ValueError(
                f"{card} has SECTION {symmetry}, lumped areas, which are not read; give A, I1, I2 and J of the whole "
                f"section on a PBEAM, or {BY_MATRICES}"
            )
        moduli = self._materials(card.integer(1)).bar()
        N, M = ((card.real(k, 0.0) * l, card.real(k + 1, 0.0) * l) for k in (12, 10))
        A, nsm, J = card.real(2) * l**2, card.real(7, 0.0) * m, card.real(6, 0.0) * l**4
        I1, I2, I12 = (card.real(k, 0.0) * l**4 for k in (3, 4, 5))
        stations = {0.0: Station(A, I1, I2, I12, J, nsm)}
        return self._bar_property(card, stations, card.real(8, 1.0), card.real(9, 1.0), moduli, N, M)

    def _bar_property(
        self, card: Card, stations: dict[float, Station], K1: float, K2: float, moduli: tuple[float, float, float],
        centroid: tuple[float, float], mass: tuple[float, float],
    ) -> BarProperty:  # fmt: skip
        if 1.0 not in stations:
            stations = {**stations, 1.0: stations[max(stations)]}
        positions = tuple(sorted(stations))
        if positions[0] != 0.0 or positions[-1] != 1.0:
            raise ValueError(f"{card} has stations at {positions}; they lie between 0 and 1")
        E, G, rho = moduli
        return BarProperty(
            card.integer(0), positions, tuple(stations[x] for x in positions), K1, K2, E, G, rho, card, centroid, mass
        )


def principal(station: Station) -> tuple[float, Station]:
    """Angle [rad] from the element's y axis to the section's principal axis, and the section in principal axes.

    With y = c y' - s z', I12 = int y z dA vanishes in axes rotated by alpha, tan 2 alpha = 2 I12 / (I1 - I2).
    """
    if station.I12 == 0 or abs(station.I12) < 1e-9 * (station.I1 + station.I2):
        return 0.0, replace(station, I12=0.0)
    alpha = 0.5 * float(np.arctan2(2 * station.I12, station.I1 - station.I2))
    mean, half = (station.I1 + station.I2) / 2, float(np.hypot((station.I1 - station.I2) / 2, station.I12))
    return alpha, replace(station, I1=mean + half, I2=mean - half, I12=0.0)
