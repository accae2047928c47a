"""Properties of shells: PSHELL, PCOMP, PCOMPG and PSHEAR as plate sections."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from femflex.arrays import Array
from femflex.decks.nastran.bulk import Bulk, ByNumber
from femflex.decks.nastran.card import Card
from femflex.decks.nastran.materials import Materials
from femflex.fem.sections.laminates import PlateSection, Ply, layup


@dataclass(frozen=True)
class Kind:
    """A shell element: corners, whether it may have middle nodes, and the fields (from 0) of its values."""

    corners: int
    middles: bool
    theta: int
    offset: int
    thickness: tuple[int, ...]
    relative: int = 9  # TFLAG


KINDS = {
    "CQUAD4": Kind(4, False, 6, 7, (10, 11, 12, 13)),
    "CQUADR": Kind(4, False, 6, 7, (10, 11, 12, 13)),
    "CQUAD4K": Kind(4, False, 6, 7, (10, 11, 12, 13)),  # MYSTRAN's thin plates
    "CTRIA3K": Kind(3, False, 5, 6, (10, 11, 12)),
    "CTRIA3": Kind(3, False, 5, 6, (10, 11, 12)),
    "CTRIAR": Kind(3, False, 5, 6, (10, 11, 12)),
    "CQUAD8": Kind(4, True, 14, 15, (10, 11, 12, 13), 16),
    "CTRIA6": Kind(3, True, 8, 9, (10, 11, 12), 13),
    "CSHEAR": Kind(4, False, -1, -1, ()),
}


RELATIVE_SUBSTITUTE = 1e-12  # bending or membrane stiffness in place of a missing one, relative to a homogeneous sheet
RIGID_SHEAR = 1e4  # transverse shear stiffness of a property without MID3, relative to a homogeneous sheet


@dataclass(frozen=True, eq=False)
class ShellProperty:
    """A property of shells: its section, which is adapted to elements with their own thickness.

    section    for the thickness of the property
    isotropic  whether all its materials are isotropic
    has_thickness         whether it has a thickness; otherwise each element needs one
    section_of_thickness  function from a thickness to the section; None for laminates
    """

    card: Card
    thickness: float
    section: PlateSection
    isotropic: bool
    section_of_thickness: Callable[[float], PlateSection] | None = None
    has_thickness: bool = True

    def section_for(self, thickness: float | None) -> PlateSection:
        """The section for this thickness [m]; None: the thickness of the property."""
        make = self.section_of_thickness
        if make is None or thickness is None or math.isclose(thickness, self.thickness, rel_tol=1e-9):
            return self.section
        return make(thickness)


class ShellProperties:
    """The properties of shells of a deck by number."""

    def __init__(self, bulk: Bulk, materials: Materials) -> None:
        self._bulk, self._materials = bulk, materials
        self._properties: ByNumber[ShellProperty] = ByNumber(bulk, "property", "of shells it has")
        reads = (("PSHELL", self._pshell), ("PCOMP", self._pcomp), ("PCOMPG", self._pcompg), ("PSHEAR", self._pshear))
        for name, read in reads:
            self._properties.read_cards(name, read)

    def __call__(self, number: int) -> ShellProperty | None:
        """The property with this number; None if it has an error. Raises ValueError if there is none."""
        return self._properties(number)

    def _area_mass(self) -> float:
        return self._bulk.units.mass / self._bulk.units.length**2 * self._bulk.wtmass

    def _names(self, number: int) -> list[str]:
        return [f"pid_{number}", *self._bulk.names_of(number)]

    def _pshell(self, card: Card) -> ShellProperty:
        number, u = card.integer(0), self._bulk.units
        mids = [card.integer(k, 0) for k in (1, 3, 5, 10)]
        for k in (0, 1, 2):
            if mids[k] == -1:
                raise ValueError(f"{card} requests plane strain (MID2 = -1), which shells here do not have")
        values = {
            "thickness": card.real(2, 0.0) * u.length,
            "bending_ratio": card.real(4, 1.0),
            "shear_ratio": card.real(6, 5 / 6),
            "nonstructural_mass": card.real(7, 0.0) * self._area_mass(),
        }
        v = self._bulk.override(self._names(number), values, str(card))
        if not v["thickness"] > 0 and card.has(2):
            raise ValueError(f"{card} has thickness {v['thickness']:.6g} m; it must be positive")
        if not mids[0] and not mids[1]:
            raise ValueError(f"{card} names no material for membrane or bending")
        has_thickness = v["thickness"] > 0
        if not has_thickness:  # every element has its own
            v["thickness"] = 1e-3
        membrane, bending, shear, coupling = (self._materials(mid) if mid else None for mid in mids)
        if coupling and not (membrane and bending):
            raise ValueError(f"{card} has MID4, which couples membrane and bending, without MID1 and MID2; give both")
        base = membrane or bending
        assert base is not None
        rho = base.density

        def section(t: float) -> PlateSection:
            Qm = membrane.plane_stress() if membrane else RELATIVE_SUBSTITUTE * base.plane_stress()
            Qb = bending.plane_stress() if bending else base.plane_stress()
            D = Qb * t**3 / 12 * (v["bending_ratio"] if bending else RELATIVE_SUBSTITUTE)
            sheet_shear = 5 / 6 * t * float(np.abs(Qb[:2, :2]).max())
            S = shear.shear() * v["shear_ratio"] * t if shear and bending else RIGID_SHEAR * sheet_shear * np.eye(2)
            if not bending:
                S = RELATIVE_SUBSTITUTE * sheet_shear * np.eye(2)
            nsm = max(v["nonstructural_mass"], 0.0)
            mass = rho * t + v["nonstructural_mass"]
            rotary = rho * t**3 / 12 if bending else 0.0
            # Nastran: forces are T^2 G4 times curvatures that shorten the upper side
            B = -coupling.plane_stress() * t**2 if coupling else np.zeros((3, 3))
            return PlateSection(t, mass, rotary, _positive_definite(Qm * t), _positive_definite(D), S, B, added=nsm)

        if rho * v["thickness"] + v["nonstructural_mass"] < 0:
            raise ValueError(f"{card} has a mass per area below zero; correct the density or the nonstructural mass")
        isotropic = all(material is None or material.isotropic for material in (membrane, bending, shear, coupling))
        if not bending:
            self._bulk.findings.note(
                f"{card} has no bending material (MID2): its elements are membranes without bending"
            )
        return ShellProperty(card, v["thickness"], section(v["thickness"]), isotropic, section, has_thickness)

    def _pcomp(self, card: Card) -> ShellProperty:
        plies: list[tuple[int, float, float]] = []
        for k in range(8, len(card.fields), 4):
            if not any(card.has(i) for i in range(k, k + 4)):
                continue
            previous = plies[-1] if plies else (0, 0.0, 0.0)
            mid = card.integer(k, previous[0])
            plies.append((mid, card.real(k + 1, previous[1]), card.real(k + 2, 0.0)))
        return self._laminate(card, plies, card.word(7))

    def _pcompg(self, card: Card) -> ShellProperty:
        plies = [
            (card.integer(k + 1), card.real(k + 2), card.real(k + 3, 0.0))
            for k in range(8, len(card.fields), 8)
            if card.has(k)
        ]
        return self._laminate(card, plies, card.word(7))

    def _laminate(self, card: Card, plies: list[tuple[int, float, float]], lam: str) -> ShellProperty:
        number, length = card.integer(0), self._bulk.units.length
        if not plies:
            raise ValueError(f"{card} has no plies")
        if lam in ("SYM",):
            plies = plies + plies[::-1]
        elif lam:
            meaning = {"MEM": "membrane alone", "BEND": "bending alone", "SMEAR": "plies smeared", "SMCORE": "a core"}
            self._bulk.findings.unused(
                f"{card.name} LAM={lam}",
                f"the plies are stacked as given instead ({meaning.get(lam, 'unknown')} is meant)",
                card.location,
            )
        values = {
            "nonstructural_mass": card.real(2, 0.0) * self._area_mass(),
            **{f"thickness_{k + 1}": t * length for k, (_, t, _) in enumerate(plies)},
        }
        v = self._bulk.override(self._names(number), values, str(card))
        stack = []
        for k, (mid, _, angle) in enumerate(plies):
            t = v[f"thickness_{k + 1}"]
            if not t > 0:
                raise ValueError(f"{card} has thickness {t:.6g} m in ply {k + 1}; it must be positive")
            stack.append(Ply(self._materials(mid).lamina(), t, float(np.radians(angle))))
        section = layup(stack, coupled=True)
        if v["nonstructural_mass"]:
            section = section.with_added_mass(v["nonstructural_mass"])
        z0 = card.real(1) * length if card.has(1) else -section.thickness / 2
        shift = z0 + section.thickness / 2
        if abs(shift) > 1e-9 * section.thickness:
            section = section.shifted(shift)
        isotropic = all(self._materials(mid).isotropic for mid, _, _ in plies)
        return ShellProperty(card, section.thickness, section, isotropic)

    def _pshear(self, card: Card) -> ShellProperty:
        """A panel that carries only shear: A = diag(0, 0, G t)."""
        number = card.integer(0)
        values = {"thickness": card.real(2) * self._bulk.units.length}
        t = self._bulk.override(self._names(number), values, str(card))["thickness"]
        _, G, rho = self._materials.bar(card.integer(1))
        if not t > 0 or not G > 0:
            raise ValueError(f"{card} has thickness {t:.6g} m and G {G:.6g} Pa; both must be positive")
        if card.real(4, 0.0) or card.real(5, 0.0):
            self._bulk.findings.unused(
                "PSHEAR F1, F2", "the rods along the edges of shear panels are left out; the panels do not stretch",
                card.location,
            )  # fmt: skip
        A = np.diag([1e-6 * G * t, 1e-6 * G * t, G * t])
        nsm = card.real(3, 0.0) * self._area_mass()
        D, S = RELATIVE_SUBSTITUTE * G * t**3 / 12 * np.eye(3), RELATIVE_SUBSTITUTE * G * t * np.eye(2)
        section = PlateSection(t, rho * t + nsm, 0.0, A, D, S)
        return ShellProperty(card, t, section, False)


def _positive_definite(matrix: Array) -> Array:
    """The symmetric part of a matrix, made positive definite if a material leaves a direction without stiffness."""
    values, vectors = np.linalg.eigh((matrix + matrix.T) / 2)
    lowest = 1e-9 * values[-1]
    if values[0] > lowest:
        return np.asarray((matrix + matrix.T) / 2)
    return np.asarray(vectors @ np.diag(np.maximum(values, lowest)) @ vectors.T)
