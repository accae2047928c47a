"""Largest deflections of elastic bodies, compared with the limit of their strain form."""

from __future__ import annotations

import warnings
from typing import TYPE_CHECKING
from weakref import WeakKeyDictionary

import numpy as np

from femflex.advice.bodies import KnownBodies
from femflex.advice.limits import BENT, SWUNG
from femflex.advice.remedies import division_remedy
from femflex.arrays import Array
from femflex.body.skin import largest_displacements
from femflex.system import LengthTable
from femflex.warning import PhysicsWarning

if TYPE_CHECKING:
    from femflex.body import FlexibleBody
    from femflex.dynamics import Model


# Of bodies watched before: displacements of their places, their size, the largest displacement of each shape, and the
# displacements of few places among which the one that moves farthest is looked for.
PLACES: WeakKeyDictionary[FlexibleBody, tuple[Array, float, Array, Array]] = WeakKeyDictionary()
MANY, MIXTURES = 800, 60  # places that are spread over a body; mixtures of its shapes, of which the farthest are added
TINY = 1e-300  # m, instead of the size of a shape that moves nothing
LARGE = 2_000_000  # numbers that the displacements of all points in some rows may take at once


class DeflectionWatch:
    """Largest deflection of one body so far.

    name     of the body
    at       its first elastic coordinate in the state
    size     diagonal of its box [m], or the largest length of one that deploys
    remedy   what to do for a strain that holds farther than linear
    """

    def __init__(self, name: str, at: int, body: FlexibleBody, remedy: str, longest: float = 0.0) -> None:
        self.name, self.at, self._body, self.remedy = name, at, body, remedy
        if body not in PLACES:
            places, size = _places(body)
            PLACES[body] = places, size, largest_displacements(places[: body.n_modes]), farthest_places(places)
        self._places, size, self._largest, self._few = PLACES[body]
        self.size = max(size, longest) or np.inf  # all places may coincide
        self._worst, self._delta = -1.0, np.zeros(body.n_modes)

    def moved(self, states: Array) -> Array:
        """Largest displacement (k, n) that each shape alone gives any place of the body, by states (k, n_x) [m]."""
        moved = np.abs(states[:, self.at : self.at + self._body.n_modes]) * self._largest
        row = int(moved.max(axis=1).argmax())
        if moved[row].max() > self._worst:
            self._worst = float(moved[row].max())
            self._delta = states[row, self.at : self.at + self._body.n_modes].copy()
        return moved

    def over(self, states: Array) -> Array:
        """Largest displacement (k,) of a point of the body over its size, by states (k, n_x) [SI].

        Of the points that `farthest_places` chooses: a few percent too low at most where shapes are local.
        """
        displaced = np.zeros(len(states))
        for rows in np.array_split(np.arange(len(states)), 1 + len(states) * self._few[0].size // LARGE):
            delta = self._body.amplitudes(states[rows, self.at : self.at + self._body.n_modes])
            displaced[rows] = largest_displacements(np.tensordot(delta, self._few, axes=1))
        return displaced / self.size

    @property
    def reached(self) -> float:
        """Largest displacement of a place of the body over its size."""
        displaced = np.tensordot(self._body.amplitudes(self._delta)[None], self._places, axes=1)
        return float(largest_displacements(displaced)[0]) / self.size

    def warn(self, verb: str, note: str = "") -> None:
        """Warn when the body was bent by more than its strain is good for, with both numbers.

        note: earlier note on the body.
        """
        body = self._body
        bound, way = BENT, f"{self.remedy}, "
        if body.strain_form != "linear":
            bound, way = SWUNG, f"{division_remedy(body)}, "
        if (reached := self.reached) > bound:
            text = f" Before the run: {note}." if note and bound == BENT else ""
            warnings.warn(
                f"body {self.name!r} {verb} displaced by {reached * self.size:.3g} m, {reached:.0%} of its size of "
                f"{self.size:.3g} m; {body.strain_form} strain is valid up to about {bound:.0%}. Check stiffness, "
                f"loads and units, {way}or take the result as an indication only.{text}",
                PhysicsWarning,
                stacklevel=3,
            )


def deflection_watches(model: Model, known: KnownBodies | None = None) -> list[DeflectionWatch]:
    """One DeflectionWatch for each elastic body of a model; known: where it is known what they were reduced from."""
    out, at, known = [], 0, known or KnownBodies({})
    for name in model.system.order:
        body = model.system.bodies[name]
        at += model.system.joint_of(name).n_q
        if body.n_modes:
            out.append(DeflectionWatch(name, at, body, known.remedy(name), _longest(model, name)))
        at += body.n_modes
    return out


def _longest(model: Model, name: str) -> float:
    """Largest length of a body that deploys [m]; 0 of others."""
    table = model.system.varying[name].write if name in model.system.varying else None
    return table.bounds[1] if isinstance(table, LengthTable) else 0.0


def farthest_places(places: Array) -> Array:
    """Displacements (n_shapes, k, 3) [m per amplitude] of the places (n_shapes, p, 3) that may move farthest.

    At most MANY of them are spread over all; further ones move farthest in a shape or in a mixture of shapes.
    """
    n, p, _ = places.shape
    if p <= MANY:
        return places
    size = np.maximum(largest_displacements(places), TINY)
    rng = np.random.default_rng(0)
    mixed = np.concatenate([np.eye(n), rng.standard_normal((MIXTURES, n))]) / size
    chosen = set(map(int, rng.permutation(p)[:MANY]))
    along = np.ascontiguousarray(np.moveaxis(places, 2, 0))  # axis by axis
    for amplitudes in mixed:
        chosen.add(int(((amplitudes @ along) ** 2).sum(axis=0).argmax()))
    return np.ascontiguousarray(places[:, sorted(chosen)])


def _places(body: FlexibleBody) -> tuple[Array, float]:
    """Displacement (n_shapes, p, 3) of the places of a body per amplitude, and its size [m]."""
    if body.skin is not None and len(body.skin.points):
        return body.skin.shapes, float(np.linalg.norm(np.ptp(body.skin.points, axis=0))) or 1.0  # all at one place
    places = np.stack([marker.position for marker in body.markers.values()])
    rows = np.stack([marker.phi.T for marker in body.markers.values()], axis=1)
    return rows, max(float(np.linalg.norm(np.ptp(places, axis=0))), 1.0)
