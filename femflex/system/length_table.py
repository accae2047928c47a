"""Properties of a body that follow from one length and its rate: the numbers of a deploying member's block.

A LengthTable stands in the place of a function in a Variation. The numbers of the block at the length L, its rate U and
its acceleration A are sums of terms

    block = sum_j values_j s^p_j U^a_j A^b_j,       s = (L - origin) / scale of the piece in which L lies

A uniform member needs one piece, s = L / L_0 and a few powers, negative ones among them, and is exact. Where section or
density vary along the member the terms are polynomials in s on several pieces of the length.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from femflex.arrays import Array, BoolArray
from femflex.system.profile import Profile

Term = tuple[int, int, int]  # powers of s, of the rate and of the acceleration

WIDTH = 4  # numbers of a block that are written at once
HEAD = 13  # numbers before the profile, see `numbers_for`


class Sections(Protocol):
    """Sections of a deploying member at which forces are reported along a run.

    stations    (k,) their distances from the exit over the length
    resultants  name -> unit and meaning; each is reported at every station
    slackens    whether the member has no stiffness of its own against compression
    """

    stations: Array
    resultants: Mapping[str, tuple[str, str]]
    slackens: bool

    def report(
        self, length: tuple[float, float, float], motion: Any, attached: Sequence[tuple[str, Array]]
    ) -> dict[str, Array]:
        """Values (k,) by name.

        length: L, its rate and its acceleration; motion: of the body (`femflex.dynamics.observe.sections.BodyMotion`);
        attached: marker and force on what is attached to it, body components.
        """


@dataclass(frozen=True, eq=False)
class LengthTable:
    """Numbers of a body's block over a length L(t).

    length      Profile of L in time [m]; or the name of the state of an effector that is the length, such as
                "reel.length". Its next state is the rate U, and what the effector gives for the rate of U is the force
                on the length [N], positive outward: of a brake, a motor or a tension
    drum_mass   mass that the drum adds to a free length, its inertia over its radius squared [kg]
    pieces      per piece of the length: term -> numbers of the block (size,)
    origins     (n_pieces,) length at which s = 0 [m]; ascending; a piece holds from its origin on, the first one before
    scales      (n_pieces,) length over which s grows by 1 [m]
    stock       length of the whole member: L and what is still stowed [m]; None: L is not limited
    drum_radius radius on which the member is wound [m]; None: no torque is reported
    at_tip      whether the drum moves with the tip, not with the root
    bounds      (2,) lengths between which the table is made [m]
    sections    where forces inside the member are reported; None: nowhere
    points      its points of mass, for an attraction that is integrated over them; None: they are not known
    error       largest error of its numbers relative to the size of each kind, 0 where it is exact
    """

    length: Profile | str
    pieces: Sequence[Mapping[Term, Array]]
    origins: Array = field(default_factory=lambda: np.zeros(1))
    scales: Array = field(default_factory=lambda: np.ones(1))
    stock: float | None = None
    drum_radius: float | None = None
    at_tip: bool = False
    bounds: tuple[float, float] = (0.0, np.inf)
    error: float = 0.0
    drum_mass: float = 0.0
    sections: Sections | None = None
    points: MovingPoints | None = None

    @cached_property
    def terms(self) -> list[Term]:
        """Powers of every term that any piece has."""
        return sorted({term for piece in self.pieces for term in piece})

    @property
    def size(self) -> int:
        """Numbers of the block."""
        return len(next(iter(self.pieces[0].values())))

    def block_at(self, length: float, rate: float = 0.0, acceleration: float = 0.0) -> Array:
        """The block (size,) at a length, its rate and its acceleration."""
        k = max(0, int(np.searchsorted(self.origins, length, side="right")) - 1)
        s = (length - self.origins[k]) / self.scales[k]
        powers, values = self._stacked[k]
        return np.asarray(np.prod(np.array([s, rate, acceleration]) ** powers, axis=1) @ values)

    @cached_property
    def _stacked(self) -> list[tuple[Array, Array]]:
        """Powers (n_terms, 3) and numbers (n_terms, size) of each piece."""
        return [(np.array(list(piece), float), np.stack(list(piece.values()))) for piece in self.pieces]

    @cached_property
    def runs(self) -> tuple[Array, Array]:
        """Places (n_runs, 4) of numbers that stand in a row, and these numbers (n_pieces, n).

        A run is: place in the block, number of groups of WIDTH, term, 0 where it is written and 1 where it is added.
        """
        groups = self.size // WIDTH
        written = np.zeros(groups, bool)
        runs: list[tuple[int, int, int, int]] = []
        values: list[Array] = []
        for j, term in enumerate(self.terms):
            numbers = np.stack([piece.get(term, np.zeros(self.size)) for piece in self.pieces])
            numbers = numbers.reshape(len(self.pieces), groups, WIDTH)
            used = np.flatnonzero(numbers.any(axis=(0, 2)))
            for run in _consecutive_groups(used, written):
                runs.append((WIDTH * int(run[0]), len(run), j, int(written[run[0]])))
                values.append(numbers[:, run].reshape(len(self.pieces), -1))
                written[run] = True
        return np.array(runs, float), np.concatenate(values, axis=1)

    def numbers(self) -> Array:
        """All of it in one flat array, as the compiled equations read it (see femflex.dynamics.layout.written_blocks).

        Number of pieces, terms, runs and values; least and largest power of s; size of the profile; 1 where the length
        is a state, its place in z, the place of its acceleration there, the places of "pickup" and of
        the rates of strain in the block, -1 where they are not written (these five are written when the system is
        lowered), the mass of the drum; then profile, origins, scales, terms (3 each),
        runs (4 each), values piece by piece.
        """
        runs, values = self.runs
        powers = [term[0] for term in self.terms]
        profile = np.zeros(0) if isinstance(self.length, str) else self.length.numbers
        counts = [len(self.pieces), len(self.terms), len(runs), values.shape[1]]
        head = [*counts, min(powers), max(powers), len(profile), 0, 0, 0, -1, -1, self.drum_mass]
        terms = np.array(self.terms, float).ravel()
        return np.concatenate([head, profile, self.origins, self.scales, terms, runs.ravel(), values.ravel()])


def _consecutive_groups(used: NDArray[np.intp], written: BoolArray) -> list[NDArray[np.intp]]:
    """The groups that are used, cut into rows that follow each other and were all written before, or none of them."""
    if not len(used):
        return []
    cuts = np.flatnonzero((np.diff(used) > 1) | (np.diff(written[used].astype(int)) != 0)) + 1
    return list(np.split(used, cuts))


@dataclass(frozen=True, eq=False)
class MovingPoints:
    """Points that follow a length L, over the coordinates delta of the member's shapes.

    A point has the mass mass + density L at r = base + (along L) direction + (phi + phi_inverse / L) delta. The
    material there moves, per rate of the length, with drawn direction + (drift / L + drift_inverse / L^2) delta.

    direction                (3,)       of the member
    mass, density            (p,)       [kg], [kg/m]
    base                     (p, 3)     [m]
    along, drawn             (p,)       [1]
    phi, drift               (p, 3, n)  [m per coordinate]
    phi_inverse, drift_inverse (p, 3, n)  [m^2 per coordinate]
    """

    direction: Array
    mass: Array
    density: Array
    base: Array
    along: Array
    drawn: Array
    phi: Array
    phi_inverse: Array
    drift: Array
    drift_inverse: Array

    @property
    def numbers(self) -> Array:
        """Per point mass, density, base (3), along, drawn, 0: (p, 8)."""
        ends = [self.along, self.drawn, np.zeros(len(self.mass))]
        return np.column_stack([self.mass, self.density, self.base, *ends])

    @property
    def tables(self) -> Array:
        """phi, phi_inverse, drift and drift_inverse per point: (p, 4, 3, n)."""
        return np.stack([self.phi, self.phi_inverse, self.drift, self.drift_inverse], axis=1)
