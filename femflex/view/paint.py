"""Colours of a body other than its displacement: strain energy density, or one strain, from its strain field."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse import csgraph
from scipy.spatial import cKDTree

from femflex.arrays import Array, BoolArray, IntArray
from femflex.body import Skin
from femflex.body.recovery import RESULTANTS, SHEAR_FORCES, VON_MISES, peaks_over_time, quantities, quantity_by_name
from femflex.body.strain_field import NAMES, StrainPart
from femflex.results import Run, RunBody
from femflex.view.extent import some_rows
from femflex.view.skin_strain import carried, on_skin
from femflex.view.units import Bar, strain_bar

UNITS = {"line": "J/m", "plate": "J/m²", "solid": "J/m³"}
EVERY = "every"  # kind of a quantity that members of all kinds have: energy density as a part of its kind's largest
MOST_VALUES = 4e7  # strains that are evaluated to find the range of a run
STRAY = 0.1  # of the points of a piece of skin
NEGATIVE = 1e-3  # of the largest; an energy density below minus this is drawn on a signed bar


def _stress_unit(name: str) -> str:
    units = {key: unit for names, own in RESULTANTS.values() for key, unit in zip(names, own, strict=True)}
    return units.get(name, "Pa")


class Paint(Protocol):
    """What gives the points of a skin their colour."""

    def values(self, y: Array) -> NDArray[np.float32]:
        """Values (n_skin,) at amplitudes (n,) [kg^1/2 m], nan where there is none."""


@dataclass(frozen=True)
class Quantity:
    """One strain of members of a kind, by its number, or their energy density (number None).

    stress   name of a section force or stress (`femflex.body.recovery`) in place of a strain
    largest  where members of several kinds are coloured together, whose densities have several units: the largest of
             each kind, in per cent of which its members are coloured
    """

    kind: str
    number: int | None
    largest: Mapping[str, float] | None = None
    stress: str = ""

    @property
    def unit(self) -> str:
        """Its SI unit."""
        if self.stress:
            return _stress_unit(self.stress)
        if self.number is None:
            return UNITS.get(self.kind, "%")
        return "1/m" if self.name.startswith("curvature") else "1"

    @property
    def name(self) -> str:
        """Its name."""
        return "strain energy" if self.number is None else NAMES[self.kind][self.number]

    @property
    def title(self) -> str:
        """What stands above the bar."""
        if self.stress:
            return self.stress.replace("_", "\n", 1) + ("\nstress" if self.stress == VON_MISES else "")
        if self.kind == EVERY:
            return "strain energy,\nof the largest\nof its kind"
        first, _, rest = self.name.partition(" " if self.number is None else "_")
        known = first in ("curvature", "twist")
        return "\n".join([*filter(None, (first, rest)), *([] if self.number is None or known else ["strain"])])

    def of(self, part: StrainPart, y: Array) -> Array:
        """Its values (t, p) at the points of a part, amplitudes (t, n) [kg^1/2 m]."""
        if self.stress:
            found = quantity_by_name(part, self.stress, y)
            assert found is not None
            return found
        if self.number is not None:
            return part.strains(y)[:, :, self.number]
        return part.energy(y) * (100.0 / self.largest[part.kind] if self.largest else 1.0)

    def held(self, part: StrainPart) -> bool:
        """Whether a part has it."""
        if self.stress:
            return self.stress in quantities([part])
        return self.kind == EVERY or (part.kind == self.kind and (self.number is None or self.number < len(part.names)))


@dataclass(frozen=True, eq=False)
class BodyPaint:
    """Colours of one body: the part of each member at those points of the skin that are its own, by their numbers.

    bare  (n_skin,)  points that belong to members without the quantity
    """

    quantity: Quantity
    parts: tuple[tuple[StrainPart, IntArray], ...]
    bare: BoolArray

    @classmethod
    def of(cls, quantity: Quantity, field: tuple[StrainPart, ...], skin: Skin) -> BodyPaint:
        """The paint of a skin; every point of it takes its colour from the member with the nearest point."""
        owner = owners(field, skin)
        taken = [k for k, part in enumerate(field) if quantity.held(part)]
        own = {k: np.flatnonzero(owner == k) for k in taken}
        parts = tuple((on_skin(field[k], skin.points[rows]), rows) for k, rows in own.items() if len(rows))
        return cls(quantity, parts, ~np.isin(owner, taken))

    def values(self, y: Array) -> NDArray[np.float32]:
        """The quantity at the points of the skin (n_skin,), nan where there is none; amplitudes y (n,) [kg^1/2 m]."""
        found = np.full(len(self.bare), np.nan, np.float32)
        for part, rows in self.parts:
            found[rows] = self.quantity.of(part, y[None])[0]
        return found


def owners(field: tuple[StrainPart, ...], skin: Skin) -> IntArray:
    """Number (n_skin,), an index, of the part that each point of a skin takes its colour from: that with the nearest
    point."""
    distance = np.array([cKDTree(part.places).query(skin.points)[0] for part in field])
    return np.asarray(np.argmin(_among_own(distance, skin), axis=0))


@dataclass(frozen=True, eq=False)
class PeakPaint:
    """The largest magnitude of a section force or stress over a run, at the points of a skin (n_skin,)."""

    peaks: NDArray[np.float32]

    @classmethod
    def of(cls, name: str, field: tuple[StrainPart, ...], skin: Skin, y: Array) -> PeakPaint:
        """The peaks over amplitudes y (t, n) [kg^1/2 m], carried from the strain points to the skin; nan where there
        are none."""
        owner = owners(field, skin)
        found = np.full(len(skin.points), np.nan, np.float32)
        for k, part in enumerate(field):
            rows = np.flatnonzero(owner == k)
            if len(rows) and name in quantities([part]):
                found[rows] = np.maximum(
                    carried(part, skin.points[rows]) @ peaks_over_time(part, y, [name])[name][0], 0.0
                )
        return cls(found)

    def values(self, y: Array) -> NDArray[np.float32]:
        """The same (n_skin,), in its unit, at all times."""
        return self.peaks


def _peaks_painted(run: Run, bodies: Mapping[str, RunBody], name: str) -> tuple[dict[str, Paint], Bar | None]:
    """Paints of the largest magnitudes over the run. Raises ValueError where no body has the quantity."""
    fields = {key: body.strain_field for key, body in bodies.items() if body.strain_field}
    known = quantities([part for field in fields.values() for part in field])
    if name not in known:
        names = ", ".join(f"peak:{each}" for each in known) or "none"
        raise ValueError(f"colour 'peak:{name}' is not known for {run.path.name}; peaks known are {names}.")
    paints: dict[str, Paint] = {}
    largest = 0.0
    for key, field in fields.items():
        skin = bodies[key].skin
        if skin is not None and name in quantities(field):
            paint = PeakPaint.of(name, field, skin, run.finite(f"bodies/{key}/delta"))
            largest, paints[key] = max(largest, float(np.nanmax(paint.peaks, initial=0.0))), paint
    title = "peak\n" + name.replace("_", "\n", 1)
    return paints, strain_bar(largest, known[name], False, title)


def _among_own(distance: Array, skin: Skin) -> Array:
    """Distances (parts, n_skin) without those of parts that lie on a connected piece of the skin by chance alone.

    A part that is nearest at fewer than STRAY of a piece's points is of another member that meets it there.
    """
    n = len(skin.points)
    pairs = [np.stack([c.ravel(), np.roll(c, 1, axis=1).ravel()]) for c in skin.cells.values()]
    a, b = np.concatenate([np.zeros((2, 0), np.int64), *pairs], axis=1)
    _, piece = csgraph.connected_components(sparse.coo_array((np.ones(len(a)), (a, b)), shape=(n, n)), directed=False)
    nearest = np.argmin(distance, axis=0)
    count = np.zeros((len(distance), piece.max(initial=0) + 1))
    np.add.at(count, (nearest, piece), 1.0)
    share = count / np.maximum(count.sum(axis=0), 1.0)
    return np.where(share[:, piece] < STRAY, np.inf, distance)


def painted(run: Run, bodies: Mapping[str, RunBody], colour: str) -> tuple[Mapping[str, Paint], Bar | None]:
    """Paints by body, and the bar over the range of the whole run; nothing for "displacement".

    colour: "energy", "energy:<kind>", "strain:<name>", "stress:<name>", or "peak:<name>" of the largest stress or
    section force over the run. "energy" of several kinds of members is in per cent of the largest of each kind.

    Raises ValueError for a name that is not known or that no body has, and for a file without strain fields.
    """
    if colour == "displacement":
        return {}, None
    if colour.startswith("peak:"):
        return _peaks_painted(run, bodies, colour.removeprefix("peak:"))
    flexible = {name: body for name, body in bodies.items() if body.n_modes}
    fields = {name: body.strain_field for name, body in flexible.items() if body.strain_field}
    quantity = chosen(colour, [part for field in fields.values() for part in field], str(run.path.name))
    paints = {
        name: BodyPaint.of(quantity, field, skin)
        for name, field in fields.items()
        if (skin := bodies[name].skin) is not None and any(quantity.held(part) for part in field)
    }
    if quantity.kind == EVERY and not quantity.stress:
        kinds = {part.kind for paint in paints.values() for part, _ in paint.parts}
        quantity = replace(quantity, largest={kind: _largest(run, paints, kind) for kind in kinds})
        paints = {name: replace(paint, quantity=quantity) for name, paint in paints.items()}
    low, high = _range(run, paints)
    signed = (quantity.number is not None or bool(quantity.stress)) and quantity.stress != VON_MISES
    signed = signed or low < -NEGATIVE * high
    return paints, strain_bar(max(high, -low), quantity.unit, signed, quantity.title)


def chosen(colour: str, parts: list[StrainPart], where: str) -> Quantity:
    """The quantity a colour names, of those that the parts have.

    Raises ValueError with the known names, or where there are no parts to take it from.
    """
    kinds = [kind for kind in NAMES if any(part.kind == kind for part in parts)]
    energies = {"energy": Quantity(kinds[0] if len(kinds) == 1 else EVERY, None)} if kinds else {}
    energies |= {f"energy:{kind}": Quantity(kind, None) for kind in kinds if len(kinds) > 1}
    strains = {
        f"strain:{name}": Quantity(kind, number)
        for kind in kinds
        for number, name in enumerate(NAMES[kind])
        if any(part.kind == kind and number < len(part.names) for part in parts)
    }
    stresses = {
        f"stress:{name}": Quantity(EVERY, None, stress=name) for name in quantities(parts) if name not in SHEAR_FORCES
    }
    known = {**energies, **strains, **stresses}
    if colour in known:
        return known[colour]
    every = ["energy", *(f"strain:{name}" for names in NAMES.values() for name in names)]
    if not parts and (colour in every or colour.startswith(("energy:", "stress:"))):
        raise ValueError(
            f"colour {colour!r} needs the strain of flexible bodies, and {where} holds none: it was made by an earlier "
            "femflex, or of matrices without elements. Make it again with `femflex run` or `femflex body`, or colour "
            "by displacement."
        )
    names = ", ".join(["displacement", *(known or every)])
    raise ValueError(f"colour {colour!r} is not known for {where}; known are {names}.")


def _largest(run: Run, paints: Mapping[str, BodyPaint], kind: str) -> float:
    """The largest energy density of members of a kind over the run; 1 where there is none."""
    found = (
        replace(paint, parts=tuple((part, rows) for part, rows in paint.parts if part.kind == kind))
        for paint in paints.values()
    )
    low, high = _range(run, dict(zip(paints, found, strict=True)))
    return max(high, -low) or 1.0


def _range(run: Run, paints: Mapping[str, BodyPaint]) -> tuple[float, float]:
    """Least and largest value over the run at the points of the skins, zero included."""
    low, high, rows = 0.0, 0.0, some_rows(run)
    for name, paint in paints.items():
        y = run.finite(f"bodies/{name}/delta")[rows]
        for part, _ in paint.parts:
            each = part.rows.shape[0] * part.rows.shape[1]
            kept = y[:: max(1, int(np.ceil(len(y) * each / MOST_VALUES)))]
            for block in np.array_split(kept, max(1, len(kept) * each // 2_000_000)):
                found = paint.quantity.of(part, block)
                low, high = min(low, float(found.min(initial=0.0))), max(high, float(found.max(initial=0.0)))
    return low, high
