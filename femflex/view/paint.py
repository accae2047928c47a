"""Colours of a body by strain energy density, a strain or a stress, from its strain field."""

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
from femflex.view.units import Bar, strain_bar

UNITS = {"line": "J/m", "plate": "J/m²", "solid": "J/m³"}
EVERY = "every"  # kind of a quantity that members of all kinds have: energy density as a part of its kind's largest
MOST_VALUES = 4e7  # strains that are evaluated to find the range of a run
STRAY = 0.1  # of the points of a piece of skin
NEGATIVE = 1e-3  # of the largest; an energy density below minus this is drawn on a signed bar


def _stress_unit(name: str) -> str:
    units = {
        key: unit for names, group_units in RESULTANTS.values() for key, unit in zip(names, group_units, strict=True)
    }
    return units.get(name, "Pa")


class Paint(Protocol):
    """Source of the colour of the points of a skin."""

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
        """SI unit of the quantity."""
        if self.stress:
            return _stress_unit(self.stress)
        if self.number is None:
            return UNITS.get(self.kind, "%")
        return "1/m" if self.name.startswith("curvature") else "1"

    @property
    def name(self) -> str:
        """Name of the quantity in words."""
        return "strain energy" if self.number is None else NAMES[self.kind][self.number]

    @property
    def title(self) -> str:
        """Text above the colour bar."""
        if self.stress:
            return self.stress.replace("_", "\n", 1) + ("\nstress" if self.stress == VON_MISES else "")
        if self.kind == EVERY:
            return "strain energy,\nof the largest\nof its kind"
        first_word, _, remaining = self.name.partition(" " if self.number is None else "_")
        is_complete = first_word in ("curvature", "twist")
        return "\n".join(
            [*filter(None, (first_word, remaining)), *([] if self.number is None or is_complete else ["strain"])]
        )

    def values_at(self, field_part: StrainPart, y: Array) -> Array:
        """Values (t, p) at the points of a part, for amplitudes (t, n) [kg^1/2 m]."""
        if self.stress:
            values = quantity_by_name(field_part, self.stress, y)
            assert values is not None
            return values
        if self.number is not None:
            return field_part.strains(y)[:, :, self.number]
        return field_part.energy(y) * (100.0 / self.largest[field_part.kind] if self.largest else 1.0)

    def is_in(self, field_part: StrainPart) -> bool:
        """Whether a part of the strain field has the quantity."""
        if self.stress:
            return self.stress in quantities([field_part])
        return self.kind == EVERY or (
            field_part.kind == self.kind and (self.number is None or self.number < len(field_part.names))
        )


@dataclass(frozen=True, eq=False)
class BodyPaint:
    """Colours of one body: the strain field of each member at its points of the skin, and the numbers of these points.

    bare  (n_skin,)  points that belong to members without the quantity
    """

    quantity: Quantity
    parts: tuple[tuple[StrainPart, IntArray], ...]
    bare: BoolArray

    @classmethod
    def from_field(cls, quantity: Quantity, field: tuple[StrainPart, ...], skin: Skin) -> BodyPaint:
        """The paint of a skin; every point has the colour of the member with the nearest point."""
        owner = owners(field, skin)
        colouring = [k for k, field_part in enumerate(field) if quantity.is_in(field_part)]
        rows_of_part = {k: np.flatnonzero(owner == k) for k in colouring}
        skin_parts = tuple(
            (part_on_skin(field[k], skin.points[rows]), rows) for k, rows in rows_of_part.items() if len(rows)
        )
        return cls(quantity, skin_parts, ~np.isin(owner, colouring))

    def values(self, y: Array) -> NDArray[np.float32]:
        """The quantity at the points of the skin (n_skin,), nan where there is none; amplitudes y (n,) [kg^1/2 m]."""
        skin_values = np.full(len(self.bare), np.nan, np.float32)
        for field_part, rows in self.parts:
            skin_values[rows] = self.quantity.values_at(field_part, y[None])[0]
        return skin_values


def owners(field: tuple[StrainPart, ...], skin: Skin) -> IntArray:
    """Index (n_skin,) of the part that colours each point of a skin: that with the nearest point."""
    distance = np.array([cKDTree(part.places).query(skin.points)[0] for part in field])
    return np.asarray(np.argmin(_without_stray_parts(distance, skin), axis=0))


@dataclass(frozen=True, eq=False)
class PeakPaint:
    """The largest magnitude of a section force or stress over a run, at the points of a skin (n_skin,)."""

    peaks: NDArray[np.float32]

    @classmethod
    def from_run(cls, name: str, field: tuple[StrainPart, ...], skin: Skin, y: Array) -> PeakPaint:
        """The peaks over amplitudes y (t, n) [kg^1/2 m], interpolated from the strain points to the skin; nan where
        there are none."""
        owner = owners(field, skin)
        peaks = np.full(len(skin.points), np.nan, np.float32)
        for k, field_part in enumerate(field):
            rows = np.flatnonzero(owner == k)
            if len(rows) and name in quantities([field_part]):
                peaks[rows] = np.maximum(
                    skin_weights(field_part, skin.points[rows]) @ peaks_over_time(field_part, y, [name])[name][0], 0.0
                )
        return cls(peaks)

    def values(self, y: Array) -> NDArray[np.float32]:
        """The peaks (n_skin,), in their unit, at all times."""
        return self.peaks


def _peak_paints(run: Run, bodies: Mapping[str, RunBody], name: str) -> tuple[dict[str, Paint], Bar | None]:
    """Paints of the largest magnitudes over the run. Raises ValueError where no body has the quantity."""
    fields = {key: body.strain_field for key, body in bodies.items() if body.strain_field}
    available = quantities([field_part for field in fields.values() for field_part in field])
    if name not in available:
        names = ", ".join(f"peak:{quantity_name}" for quantity_name in available) or "none"
        raise ValueError(f"colour 'peak:{name}' is not known for {run.path.name}; peaks known are {names}.")
    paints: dict[str, Paint] = {}
    largest = 0.0
    for key, field in fields.items():
        skin = bodies[key].skin
        if skin is not None and name in quantities(field):
            paint = PeakPaint.from_run(name, field, skin, run.finite(f"bodies/{key}/delta"))
            largest, paints[key] = max(largest, float(np.nanmax(paint.peaks, initial=0.0))), paint
    title = "peak\n" + name.replace("_", "\n", 1)
    return paints, strain_bar(largest, available[name], False, title)


def _without_stray_parts(distance: Array, skin: Skin) -> Array:
    """Distances (parts, n_skin) without those of parts that do not belong to a connected piece of the skin.

    A part that is nearest at fewer than STRAY of a piece's points belongs to another member that meets it there.
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


def paints_of(run: Run, bodies: Mapping[str, RunBody], colour: str) -> tuple[Mapping[str, Paint], Bar | None]:
    """Paints by body, and the bar over the range of the whole run; nothing for "displacement".

    colour: "energy", "energy:<kind>", "strain:<name>", "stress:<name>", or "peak:<name>" of the largest stress or
    section force over the run. "energy" of several kinds of members is in per cent of the largest of each kind.

    Raises ValueError for a name that is not known or that no body has, and for a file without strain fields.
    """
    if colour == "displacement":
        return {}, None
    if colour.startswith("peak:"):
        return _peak_paints(run, bodies, colour.removeprefix("peak:"))
    flexible = {name: body for name, body in bodies.items() if body.n_modes}
    fields = {name: body.strain_field for name, body in flexible.items() if body.strain_field}
    quantity = quantity_of_colour(
        colour, [field_part for field in fields.values() for field_part in field], str(run.path.name), ("light",)
    )
    paints = {
        name: BodyPaint.from_field(quantity, field, skin)
        for name, field in fields.items()
        if (skin := bodies[name].skin) is not None and any(quantity.is_in(field_part) for field_part in field)
    }
    if quantity.kind == EVERY and not quantity.stress:
        kinds = {field_part.kind for paint in paints.values() for field_part, _ in paint.parts}
        quantity = replace(quantity, largest={kind: _largest(run, paints, kind) for kind in kinds})
        paints = {name: replace(paint, quantity=quantity) for name, paint in paints.items()}
    low, high = _range(run, paints)
    signed = (quantity.number is not None or bool(quantity.stress)) and quantity.stress != VON_MISES
    signed = signed or low < -NEGATIVE * high
    return paints, strain_bar(max(high, -low), quantity.unit, signed, quantity.title)


def quantity_of_colour(
    colour: str, field_parts: list[StrainPart], source: str, others: tuple[str, ...] = ()
) -> Quantity:
    """The quantity that a colour names, of those that the parts have; others: further colours that exist.

    Raises ValueError with the known names, also where there are no parts.
    """
    kinds = [kind for kind in NAMES if any(field_part.kind == kind for field_part in field_parts)]
    energies = {"energy": Quantity(kinds[0] if len(kinds) == 1 else EVERY, None)} if kinds else {}
    energies |= {f"energy:{kind}": Quantity(kind, None) for kind in kinds if len(kinds) > 1}
    strains = {
        f"strain:{name}": Quantity(kind, number)
        for kind in kinds
        for number, name in enumerate(NAMES[kind])
        if any(field_part.kind == kind and number < len(field_part.names) for field_part in field_parts)
    }
    stresses = {
        f"stress:{name}": Quantity(EVERY, None, stress=name)
        for name in quantities(field_parts)
        if name not in SHEAR_FORCES
    }
    available = {**energies, **strains, **stresses}
    if colour in available:
        return available[colour]
    default_names = ["energy", *(f"strain:{name}" for names in NAMES.values() for name in names)]
    if not field_parts and (colour in default_names or colour.startswith(("energy:", "stress:"))):
        raise ValueError(
            f"colour {colour!r} needs the strain of flexible bodies, and {source} holds none: it was made by an "
            "earlier femflex, or of matrices without elements. Make it again with `femflex run` or `femflex body`, or "
            "colour by displacement."
        )
    names = ", ".join(["displacement", *others, *(available or default_names)])
    raise ValueError(f"colour {colour!r} is not known for {source}; known are {names}.")


def _largest(run: Run, paints: Mapping[str, BodyPaint], kind: str) -> float:
    """The largest energy density of members of a kind over the run; 1 where there is none."""
    paints_of_kind = (
        replace(paint, parts=tuple((field_part, rows) for field_part, rows in paint.parts if field_part.kind == kind))
        for paint in paints.values()
    )
    low, high = _range(run, dict(zip(paints, paints_of_kind, strict=True)))
    return max(high, -low) or 1.0


def _range(run: Run, paints: Mapping[str, BodyPaint]) -> tuple[float, float]:
    """Least and largest value over the run at the points of the skins, zero included."""
    low, high, rows = 0.0, 0.0, some_rows(run)
    for name, paint in paints.items():
        y = run.finite(f"bodies/{name}/delta")[rows]
        for field_part, _ in paint.parts:
            n_entries = field_part.rows.shape[0] * field_part.rows.shape[1]
            sampled = y[:: max(1, int(np.ceil(len(y) * n_entries / MOST_VALUES)))]
            for block in np.array_split(sampled, max(1, len(sampled) * n_entries // 2_000_000)):
                values = paint.quantity.values_at(field_part, block)
                low, high = min(low, float(values.min(initial=0.0))), max(high, float(values.max(initial=0.0)))
    return low, high


NEAREST = {"line": 2, "plate": 4, "solid": 6}  # number of points that colour a point of the skin
SHARPNESS = 0.02  # a smaller value gives nearer points a larger weight
FLAT = 1e-9  # relative spread of an element's points along an axis below which there is no gradient along it
BEYOND = 1.5  # distances of two points on a line, up to which the line through them is extrapolated


def part_on_skin(field_part: StrainPart, points: Array) -> StrainPart:
    """The part at points (n, 3) [m] of a skin: its gradients there, from which strain and energy follow.

    Gradients are interpolated and not strains or energies, because the latter vary as the square of the height through
    a single layer of solids. Along lines the gradients are those on the line through the two nearest points. In plates
    and solids they are those of the plane that fits the points of the element best, and their mean at a point between
    several elements.
    """
    weights = skin_weights(field_part, points)
    p = len(field_part.places)
    shape = field_part.rows.shape[1:]
    return replace(
        field_part,
        places=points,
        weight=np.zeros(len(points)),
        rows=(weights @ field_part.rows.reshape(p, -1)).reshape(-1, *shape).astype(np.float32),
        elastic=_interpolated(weights, field_part.elastic),
        stress=_interpolated(weights, field_part.stress),
        lever=_interpolated(weights, field_part.lever),
        fibres=_interpolated(weights, field_part.fibres),
        plies=_interpolated(weights, field_part.plies),
        per=1,
    )


def skin_weights(field_part: StrainPart, points: Array) -> sparse.csr_array:
    """Interpolation weights (n, p) [1] from the points of a part to points on its skin."""
    return (
        line_weights(field_part, points)
        if field_part.kind == "line" and len(field_part.places) > 1
        else element_weights(field_part, points)
    )


def line_weights(field_part: StrainPart, points: Array) -> sparse.csr_array:
    """Weights (n, p) [1] of linear interpolation from a line's points to points off the line."""
    _, nearest = cKDTree(field_part.places).query(points, k=[1, 2])
    nearest = np.asarray(nearest, np.int64)
    a, b = field_part.places[nearest[:, 0]], field_part.places[nearest[:, 1]]
    t = np.einsum("na,na->n", points - a, b - a) / np.einsum("na,na->n", b - a, b - a)
    t = np.clip(t, -BEYOND, 1.0)
    return _sparse_rows(nearest, np.stack([1.0 - t, t], axis=1), len(field_part.places))


def element_weights(field_part: StrainPart, points: Array) -> sparse.csr_array:
    """Weights (n, p) [1] of linear interpolation from the points of elements to points on them."""
    k = min(NEAREST[field_part.kind], len(field_part.places))
    distances_and_indices = cKDTree(field_part.places).query(points, k=np.arange(1, k + 1))
    distance, nearest = np.asarray(distances_and_indices[0], float), np.asarray(distances_and_indices[1], np.int64)
    excess = distance**2 - distance[:, :1] ** 2
    weight = 1.0 / (excess + SHARPNESS * excess[:, -1:] + 1e-300)
    weight /= weight.sum(axis=1, keepdims=True)
    if field_part.per == 1:
        return _sparse_rows(nearest, weight, len(field_part.places))
    x = field_part.places.reshape(-1, field_part.per, 3)
    share = field_part.weight.reshape(-1, field_part.per)
    share = share / share.sum(axis=1, keepdims=True)
    middle = np.einsum("eq,eqa->ea", share, x)
    d = x - middle[:, None]
    slopes = np.einsum(
        "eab,eqb,eq->eqa",
        np.linalg.pinv(np.asarray(np.einsum("eq,eqa,eqb->eab", share, d, d)), FLAT, hermitian=True),
        d,
        share,
    )
    total = sparse.csr_array((len(points), len(field_part.places)))
    for j in range(k):
        e = nearest[:, j] // field_part.per
        point_weights = share[e] + np.einsum("eqa,ea->eq", slopes[e], points - middle[e])
        columns = e[:, None] * field_part.per + np.arange(field_part.per)
        total = total + _sparse_rows(columns, weight[:, j : j + 1] * point_weights, len(field_part.places))
    return total


def _sparse_rows(columns: IntArray, values: Array, width: int) -> sparse.csr_array:
    n, k = columns.shape
    rows = np.repeat(np.arange(n), k)
    return sparse.csr_array((values.ravel(), (rows, columns.ravel())), shape=(n, width))


def _interpolated(weights: sparse.csr_array, table: Array) -> Array:
    """A table of every point (p, ...), interpolated; one common row (1, ...), or an empty table, is unchanged."""
    if len(table) <= 1:
        return table
    return np.asarray((weights @ table.reshape(len(table), -1)).reshape(-1, *table.shape[1:]))
