"""Properties of bars and beams: PBAR, PBARL, PBEAM, PBEAML, PBEAM3 and PBCOMP; in SI, at one or more stations."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from femflex.decks.nastran.bar_shapes import SHAPES, shape_of
from femflex.decks.nastran.bulk import Bulk
from femflex.decks.nastran.card import Card
from femflex.decks.nastran.lumped_areas import UNPROVEN, lumped_parts
from femflex.decks.nastran.materials import Materials

STATIONS = 11  # that a PBEAM may have


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

    at         x / L of its stations, from 0 to 1
    stations   sections there
    K1, K2     shear factors; zero: no shear
    E, G       [Pa]; density [kg/m^3]
    centroid   y and z of the neutral axis from the shear centre, at both ends [m]
    mass       y and z of the nonstructural mass from the shear centre [m]
    beam       of PBEAM: the element's axis is that of the shear centres
    """

    number: int
    at: tuple[float, ...]
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

    def loaded(self, mass: float) -> BarProperty:
        """The property with more nonstructural mass per length [kg/m] where that of its own lies."""
        if not mass:
            return self
        more = tuple(replace(one, nsm=one.nsm + mass) for one in self.stations)
        if any(self.density * one.A + one.nsm < 0 for one in more):
            raise ValueError(
                f"{self.card} and nonstructural mass give a mass per length below zero; correct one of them"
            )
        return replace(self, stations=more)


class BarProperties:
    """The properties of bars of a deck by number."""

    def __init__(self, bulk: Bulk, materials: Materials) -> None:
        self._bulk, self._materials = bulk, materials
        self._known: dict[int, BarProperty | None] = {}
        self._foreign: dict[int, Card] = {}
        given = {"CBAR": next(iter(bulk.each("BAROR")), None), "CBEAM": next(iter(bulk.each("BEAMOR")), None)}
        self.defaults = {name: card for name, card in given.items() if card is not None}
        for name, read in (
            ("PBAR", self._pbar),
            ("PBARL", self._pbarl),
            ("PBEAM", self._pbeam),
            ("PBEAML", self._pbeaml),
            ("PBEAM3", self._pbeam3),
            ("PBCOMP", self._pbcomp),
        ):
            bulk.trying(lambda card, read=read: self._add(card, read), name)  # type: ignore[misc]
        for card in bulk.each("PBEND", "PBMSECT", "PBRSECT", use=False):
            if card.is_integer(0):
                self._foreign[card.integer(0)] = card

    def _add(self, card: Card, read: object) -> None:
        number = card.integer(0)
        if self._known.get(number) is not None:
            first = self._known[number].card  # type: ignore[union-attr]
            if first.fields != card.fields:
                raise ValueError(f"{card} gives property {number} again, which stands at {first.place} already")
            return
        self._known[number] = None  # known, whatever is wrong with it
        made: BarProperty = read(card)  # type: ignore[operator]
        one = made.stations[0]
        values = {"A": one.A, "I1": one.I1, "I2": one.I2, "J": one.J, "nonstructural_mass": one.nsm}
        changed = self._bulk.override([f"pid_{number}", *self._bulk.names_of(number)], values, str(card))
        if changed != values:
            keys = {"A": "A", "I1": "I1", "I2": "I2", "J": "J", "nonstructural_mass": "nsm"}
            new = {keys[k]: v for k, v in changed.items() if v != values[k]}
            made = replace(made, stations=tuple(replace(s, **new) for s in made.stations))
        if any(s.A < 0 or s.I1 < 0 or s.I2 < 0 or s.J < 0 for s in made.stations):
            raise ValueError(f"{card} has an area or a moment below zero; correct it")
        if any(made.density * s.A + s.nsm < 0 for s in made.stations):
            raise ValueError(f"{card} has a mass per length below zero; correct the density or the nonstructural mass")
        self._known[number] = made

    def __call__(self, number: int) -> BarProperty | None:
        """The property of a number; None where something is wrong with it, which is said already.

        Raises ValueError where the deck has none.
        """
        if number in self._foreign and number not in self._known:
            raise ValueError(
                f"names {self._foreign[number]}, which is not understood; give PBAR, PBARL, PBEAM, PBEAML or PBCOMP "
                "instead"
            )
        if number not in self._known:
            known = ", ".join(map(str, sorted(self._known)[:12])) or "none"
            raise ValueError(f"names property {number}, which is not in the deck; of bars and beams it has {known}")
        return self._known[number]

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
        given = card.rest(8)
        count = SHAPES[kind][0] if kind in SHAPES else 0
        shape = shape_of(kind, [card.real(8 + k, 0.0) for k in range(min(count, len(given)))])
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
        k, at, shape = 8, 0.0, None
        while k < len(card.fields):
            if stations:
                k += 1  # SO
                at = card.real(k, 1.0)
                k += 1
                if not any(card.has(i) for i in range(k - 2, k + count + 1)):
                    break
            dims = [card.real(k + i, 0.0) for i in range(count)]
            one = shape_of(kind, dims) if any(dims) or shape is None else shape
            shape = shape or one
            nsm = card.real(k + count, 0.0) * m
            stations[at] = Station(one.A * l**2, one.I1 * l**4, one.I2 * l**4, one.I12 * l**4, one.J * l**4, nsm)
            k += count + 1
            if not any(card.has(i) for i in range(k, len(card.fields))):
                break
        assert shape is not None
        none = (0.0, 0.0)  # PBEAML takes the shear centre to lie at the centroid
        return self._made(card, stations, shape.K1, shape.K2, (E, G, rho), none, none)

    def _pbeam(self, card: Card) -> BarProperty:
        l, m, mi = self._lengths()
        E, G, rho = self._materials(card.integer(1)).bar()

        def station(k: int, before: Station | None) -> Station:
            d = [0.0] * 5 if before is None else [
                before.A / l**2, before.I1 / l**4, before.I2 / l**4, before.I12 / l**4, before.J / l**4
            ]  # fmt: skip
            A, I1, I2, I12, J = (card.real(k + i, d[i]) for i in range(5))
            nsm = card.real(k + 5, before.nsm / m if before and m else 0.0) * m
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
        stations = {at: replace(s, nsi=nsi) for at, s in stations.items()}
        M = (card.real(k + 8, 0.0) * l, card.real(k + 9, 0.0) * l)
        N = (card.real(k + 12, 0.0) * l, card.real(k + 13, 0.0) * l)
        return self._made(card, stations, K1, K2, (E, G, rho), N, M)

    def _pbeam3(self, card: Card) -> BarProperty:
        l, m, _ = self._lengths()
        E, G, rho = self._materials(card.integer(1)).bar()
        if card.rest(16):
            raise ValueError(
                f"{card} varies along its elements or has shear factors; give A, Iz, Iy, Iyz, J and NSM alone"
            )
        A, I1, I2, I12, J = (card.real(k, 0.0) for k in (2, 3, 4, 5, 6))
        station = Station(A * l**2, I1 * l**4, I2 * l**4, I12 * l**4, J * l**4, card.real(7, 0.0) * m)
        return BarProperty(card.integer(0), (0.0, 1.0), (station,) * 2, 1.0, 1.0, E, G, rho, card)

    def _pbcomp(self, card: Card) -> BarProperty:
        l, m, _ = self._lengths()
        E, G, rho = self._materials(card.integer(1)).bar()
        N, M = ((card.real(k, 0.0) * l, card.real(k + 1, 0.0) * l) for k in (12, 10))
        A, nsm, J = card.real(2) * l**2, card.real(7, 0.0) * m, card.real(6, 0.0) * l**4
        K1, K2 = card.real(8, 1.0), card.real(9, 1.0)
        if (symmetry := card.integer(14, 0)) == 0:
            I1, I2, I12 = (card.real(k, 0.0) * l**4 for k in (3, 4, 5))
            stations = {0.0: Station(A, I1, I2, I12, J, nsm)}
            return self._made(card, stations, K1, K2, (E, G, rho), N, M)
        parts = lumped_parts(card, symmetry)
        if symmetry in UNPROVEN:
            self._bulk.found.note(
                f"{card} at {card.place}: SECTION {symmetry} is taken as {UNPROVEN[symmetry]}; no public source of "
                "these codes was found. Give all areas with SECTION 5 to be sure"
            )
        moduli = {mid: self._materials(mid).bar() for mid in {one.material for one in parts}}
        if not E > 0:
            raise ValueError(f"{card} names MAT1 {card.integer(1)}, which has no E; its lumped areas need one")
        areas = np.array([one.fraction * A for one in parts])
        stiff = areas * [moduli[one.material][0] / E for one in parts]
        mass = areas @ [moduli[one.material][2] for one in parts]
        y, z = (np.array([getattr(one, c) for one in parts]) * l for c in ("y", "z"))
        if any(card.has(k) for k in (3, 4, 5)):
            self._bulk.found.note(f"{card}: I1, I2 and I12 are those of its lumped areas, not of its fields 5 to 7")
        total = float(stiff.sum())
        station = Station(total, float(stiff @ y**2), float(stiff @ z**2), float(stiff @ (y * z)), J, nsm)
        return self._made(card, {0.0: station}, K1 * A / total, K2 * A / total, (E, G, float(mass) / total), N, M)

    def _made(
        self, card: Card, stations: dict[float, Station], K1: float, K2: float, moduli: tuple[float, float, float],
        centroid: tuple[float, float], mass: tuple[float, float],
    ) -> BarProperty:  # fmt: skip
        if 1.0 not in stations:
            stations = {**stations, 1.0: stations[max(stations)]}
        at = tuple(sorted(stations))
        if at[0] != 0.0 or at[-1] != 1.0:
            raise ValueError(f"{card} has stations at {at}; they lie between 0 and 1")
        E, G, rho = moduli
        return BarProperty(card.integer(0), at, tuple(stations[x] for x in at), K1, K2, E, G, rho, card, centroid, mass)


def principal(one: Station) -> tuple[float, Station]:
    """Angle [rad] from the element's y axis to the section's own, and the section about its principal axes.

    Of y = c y' - s z': I12 = int y z dA vanishes about axes turned by alpha, tan 2 alpha = 2 I12 / (I1 - I2).
    """
    if one.I12 == 0 or abs(one.I12) < 1e-9 * (one.I1 + one.I2):
        return 0.0, replace(one, I12=0.0)
    alpha = 0.5 * float(np.arctan2(2 * one.I12, one.I1 - one.I2))
    mean, half = (one.I1 + one.I2) / 2, float(np.hypot((one.I1 - one.I2) / 2, one.I12))
    return alpha, replace(one, I1=mean + half, I2=mean - half, I12=0.0)
