"""Largest deflections of elastic bodies, at rest and spinning, compared with the limits of their strain form."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING
from weakref import WeakKeyDictionary

import numpy as np

from femflex.advice.advice import Advice, WorstRow, doubt
from femflex.advice.bodies import BodyOrigins
from femflex.advice.limits import (
    BLOCK_NUMBERS,
    FAST_RATIO,
    LINEAR_ABOVE,
    MANY_POINTS,
    MAX_SPINNING_COEFFICIENT,
    MIXTURES,
    NONLINEAR_INVALID_ABOVE,
    SLOW_RATIO,
    SPINNING_COEFFICIENT,
    SPINNING_ERROR,
    TINY,
    division_remedy,
)
from femflex.advice.stiffening import attached_masses, body_rate, lowest_frequency
from femflex.arrays import Array, IntArray
from femflex.body.flexible import largest_displacements
from femflex.dynamics.joints.places import body_places
from femflex.system import LengthTable

if TYPE_CHECKING:
    from femflex.body import FlexibleBody
    from femflex.dynamics import Model

# For each body watched before: displacements of its points, its size, the largest displacement of each shape, and the
# displacements of the few points among which the largest one is sought.
CACHED_SHAPES: WeakKeyDictionary[FlexibleBody, tuple[Array, float, Array, Array]] = WeakKeyDictionary()


class DeflectionWatch:
    """Largest deflection of one body so far.

    name     of the body
    first_coordinate  its first elastic coordinate in the state
    size     diagonal of its box [m], or the largest length of a body that deploys
    remedy   what to change for a strain form that is valid beyond linear strain
    """

    def __init__(self, name: str, first: int, body: FlexibleBody, remedy: str, longest: float = 0.0) -> None:
        self.name, self.first_coordinate, self._body, self.remedy = name, first, body, remedy
        if body not in CACHED_SHAPES:
            shapes, size = _point_shapes(body)
            CACHED_SHAPES[body] = shapes, size, largest_displacements(shapes[: body.n_modes]), farthest_points(shapes)
        self._point_shapes, size, self._largest, self._candidates = CACHED_SHAPES[body]
        self.size = max(size, longest) or np.inf  # all points may coincide
        self._worst, self._delta = -1.0, np.zeros(body.n_modes)

    def shape_displacements(self, states: Array) -> Array:
        """Largest displacement (k, n) [m] of a point by each shape, for states (k, n_x); records the worst state."""
        displaced = (
            np.abs(states[:, self.first_coordinate : self.first_coordinate + self._body.n_modes]) * self._largest
        )
        row = int(displaced.max(axis=1).argmax())
        if displaced[row].max() > self._worst:
            self._worst = float(displaced[row].max())
            self._delta = states[row, self.first_coordinate : self.first_coordinate + self._body.n_modes].copy()
        return displaced

    def relative_displacements(self, states: Array) -> Array:
        """Largest displacement (k,) of a point of the body over its size, for states (k, n_x) [SI].

        Only the points that `farthest_points` chooses are evaluated: at most a few percent too low for local shapes.
        """
        displaced = np.zeros(len(states))
        for rows in np.array_split(np.arange(len(states)), 1 + len(states) * self._candidates[0].size // BLOCK_NUMBERS):
            delta = self._body.amplitudes(
                states[rows, self.first_coordinate : self.first_coordinate + self._body.n_modes]
            )
            displaced[rows] = largest_displacements(np.tensordot(delta, self._candidates, axes=1))
        return displaced / self.size

    @property
    def largest_deflection(self) -> float:
        """Largest displacement of a point over the body's size, in the recorded state of `shape_displacements`."""
        displaced = np.tensordot(self._body.amplitudes(self._delta)[None], self._point_shapes, axes=1)
        return float(largest_displacements(displaced)[0]) / self.size

    def doubt(self, verb: str, note: str = "") -> Advice | None:
        """A warning if the body was deflected beyond the limit of its strain form; note: text from before the run."""
        body = self._body
        limit, change = LINEAR_ABOVE, f"{self.remedy}, "
        if body.strain_form != "linear":
            limit, change = NONLINEAR_INVALID_ABOVE, f"{division_remedy(body)}, "
        if (reached := self.largest_deflection) <= limit:
            return None
        text = (
            f"body {self.name!r} {verb} displaced by {reached * self.size:.3g} m, {reached:.0%} of its size of "
            f"{self.size:.3g} m; {body.strain_form} strain is valid up to about {limit:.0%}. Check stiffness, "
            f"loads and units, {change}or take the result as an indication only."
        ) + (f" Before the run: {note}." if note and limit == LINEAR_ABOVE else "")
        return doubt(self.name, "bend", text, reached, limit)


class DeflectionWatches:
    """Watches the deflections of all elastic bodies; verb: "was" along a run, "is" at rest; notes: by body."""

    def __init__(self, model: Model, origins: BodyOrigins, verb: str, notes: Mapping[str, str]) -> None:
        self._watches, self._verb, self._notes = deflection_watches(model, origins), verb, notes

    def watch(self, times: Array, states: Array, channels: Mapping[str, Array]) -> None:
        """Record the largest deflections over a block of states (n_t, n_x) [SI]."""
        for watch in self._watches:
            watch.shape_displacements(states)

    def doubts(self) -> Iterator[Advice]:
        """Warnings of bodies deflected beyond the limit of their strain form."""
        doubts = (watch.doubt(self._verb, self._notes.get(watch.name, "")) for watch in self._watches)
        yield from (entry for entry in doubts if entry is not None)


def deflection_watches(model: Model, origins: BodyOrigins | None = None) -> list[DeflectionWatch]:
    """One DeflectionWatch for each elastic body of a model; origins: of the bodies whose origin is known."""
    origins = origins or BodyOrigins({})
    tables = {name: varying.write for name, varying in model.system.varying.items()}
    longest = {name: table.bounds[1] for name, table in tables.items() if isinstance(table, LengthTable)}
    return [
        DeflectionWatch(p.name, p.q + p.joint.n_q, p.body, origins.remedy(p.name), longest.get(p.name, 0.0))
        for p in body_places(model.system)
        if p.body.n_modes
    ]


def farthest_points(shapes: Array) -> Array:
    """Displacements (n_shapes, k, 3) [m per amplitude] of selected points, from those of all points (n_shapes, p, 3).

    Up to MANY_POINTS points are spread over the body; the others move farthest in a shape or in a mixture of shapes.
    """
    n, p, _ = shapes.shape
    if p <= MANY_POINTS:
        return shapes
    size = np.maximum(largest_displacements(shapes), TINY)
    rng = np.random.default_rng(0)
    mixtures = np.concatenate([np.eye(n), rng.standard_normal((MIXTURES, n))]) / size
    chosen = set(map(int, rng.permutation(p)[:MANY_POINTS]))
    by_axis = np.ascontiguousarray(np.moveaxis(shapes, 2, 0))
    for amplitudes in mixtures:
        chosen.add(int(((amplitudes @ by_axis) ** 2).sum(axis=0).argmax()))
    return np.ascontiguousarray(shapes[:, sorted(chosen)])


def _point_shapes(body: FlexibleBody) -> tuple[Array, float]:
    """Displacements (n_shapes, p, 3) [m per amplitude] of the points of a body, and the body's size [m]."""
    if body.skin is not None and len(body.skin.points):
        return body.skin.shapes, float(np.linalg.norm(np.ptp(body.skin.points, axis=0))) or 1.0  # all at one point
    positions = np.stack([marker.position for marker in body.markers.values()])
    shapes = np.stack([marker.phi.T for marker in body.markers.values()], axis=1)
    return shapes, max(float(np.linalg.norm(np.ptp(positions, axis=0))), 1.0)


# Deflections of spinning bodies: the error of condensed strain, whose foreshortening is of second order.
#
# A body deflected by b of its size shortens by b^2 / 2 of it and b^4 / 8, of which condensed strain has the first. In a
# spinning body centrifugal forces act on the omitted part. For cantilevers bent in the plane of rotation by a force at
# the end, compared with all finite elements, the relative error of the tip deflection is c b^2, with c = 0.42 (rate /
# first frequency)^2 up to about twice that frequency and 0.9 above. A wire, stiffened by the spin alone, swings in the
# plane of the spin about the small lever r of its root: its mass appears b^4 L^2 / 4 farther out, and the relative
# error of its stiffness is c b^2 with c = L / 2 r.


class SpinningDeflectionWatch:
    """Watches bodies with condensed strain for deflections under spin, and warns of their estimated error."""

    def __init__(self, model: Model) -> None:
        system = model.system
        self._system = system
        self._watches = [
            watch for watch in deflection_watches(model) if system.bodies[watch.name].strain_form == "condensed"
        ]
        attached = {watch.name: attached_masses(system, watch.name) for watch in self._watches}
        self._first = {name: lowest_frequency(system.bodies[name], masses) for name, masses in attached.items()}
        self._spun = {watch.name: WorstRow() for watch in self._watches}

    def watch(self, times: Array, states: Array, channels: Mapping[str, Array]) -> None:
        """Record the largest error over a block of states (n_t, n_x) [SI] and its channels (n_t, ...)."""
        for body in self._watches:
            rate = np.linalg.norm(body_rate(channels, body.name), axis=1)
            rows = np.flatnonzero(rate > SLOW_RATIO * self._first[body.name])
            if not rows.size:
                continue
            bend = body.relative_displacements(states[rows])
            error = self._error_coefficient(body, rate[rows], rows, channels) * bend**2
            self._spun[body.name].record(error, bend=bend, rate=rate[rows])

    def _error_coefficient(
        self, body: DeflectionWatch, rate: Array, rows: IntArray, channels: Mapping[str, Array]
    ) -> Array:
        """The coefficient c (k,) at the rates (k,) [rad/s] of some rows."""
        ratio = _rate_ratio(rate, self._first[body.name])
        free = self._system.joint_of(self._system.root).kind == "free"
        axis = channels["monitors/center_of_mass"][rows] if free else 0.0
        marker = "root" if body.name in self._system.varying else self._system.joint_of(body.name).child_marker
        position = channels.get(f"markers/{body.name}.{marker}/position", channels[f"bodies/{body.name}/position"])
        lever = np.linalg.norm(position[rows] - axis, axis=1)
        limit = np.where(
            ratio < FAST_RATIO,
            MAX_SPINNING_COEFFICIENT,
            np.maximum(MAX_SPINNING_COEFFICIENT, body.size / np.maximum(2.0 * lever, 1e-300)),
        )
        return np.minimum(SPINNING_COEFFICIENT * ratio**2, limit)

    def doubts(self) -> Iterator[Advice]:
        """Warnings of bodies whose deflection has an estimated error above SPINNING_ERROR."""
        for name, worst in self._spun.items():
            if (error := worst.measure) > SPINNING_ERROR:
                bend, rate = worst.values["bend"], worst.values["rate"]
                ratio = float(_rate_ratio(np.array(rate), self._first[name]))
                times = f"{ratio:.2g} times" if ratio < FAST_RATIO else f"over {FAST_RATIO:g} times"
                text = (
                    f"body {name!r}, bent by {bend:.0%} of its size, turned at {rate:.4g} rad/s, "
                    f"{times} its first frequency. Condensed strain is of second order in bends: the bend is "
                    f"up to about {error:.1%} off (limit {SPINNING_ERROR:.0%}). {self._remedy(name)}"
                )
                yield doubt(name, "bend", text, error, SPINNING_ERROR)

    def _remedy(self, name: str) -> str:
        table = self._system.varying[name].write if name in self._system.varying else None
        if isinstance(table, LengthTable) and table.sections is not None and table.sections.slackens:
            return (
                "To avoid this error, let a universal joint turn the member about its exit, with functions.straight = "
                "false or no functions"
            )
        if table is not None:
            return "A deploying member cannot be cut into segments: take its bend as an indication, unless it is small"
        return f"To reduce the error, {division_remedy(self._system.bodies[name])}"


def _rate_ratio(rate: Array, first: float) -> Array:
    """Ratio (n,) of rates (n,) to the first frequency, both [rad/s], at most FAST_RATIO."""
    return np.asarray(rate / np.maximum(first, np.maximum(rate, 1e-300) / FAST_RATIO))
