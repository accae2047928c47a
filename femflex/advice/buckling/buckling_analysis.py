"""Linear buckling of a body under all its loads, at the worst instant of a motion.

K_sigma is linear in the load. The loads of all instants are written in a few patterns, their K_sigma confined to few
shapes picks the instant, and there the whole structure is assessed. Sudden loads count once: the
oscillation about their stress is faster than the buckling shape follows.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from femflex.advice.buckling.applied_load import FIELD, WRENCH, AppliedLoad, BucklingResult
from femflex.arrays import Array

NONE = 1e-7  # of mass, size and least omega^2, twelve times EI / L^2 of a column: below it a load is rounding
ALIKE = 1e-3  # of the largest load by size: patterns below it do not pick the instant
PATTERNS, FEWER = 6, 2  # that pick it at most, and of what has more than
LARGE = 20_000  # coordinates: from there on each pattern costs a tenth of the modes
FAR = 0.25  # of the size: what bends farther before it would buckle is another body by then
UNLIKE = 1.02  # times the part at one instant by few shapes, up to which the largest load is not looked at too


class StaticStructure(Protocol):
    """A structure, or a reduced body, as static buckling sees it. Arrays over its n coordinates, free of supports."""

    def knows(self, marker: str | None) -> bool:
        """Whether what acts at a marker, or all over (None), is known."""

    def loads(self, marker: str | None) -> Array:
        """Generalised forces (n_load, 6) of unit force and torque at a marker, (n_load, 12) of unit fields."""

    def at(self, marker: str, A: Array) -> Any:
        """R^T A R (n, n), R (6, n) the translation and rotation of a marker."""

    def stress(self, load: Array) -> Any:
        """K_sigma (n, n) [N/m, N, N m] of the static response to a load (n_load,)."""

    def lowest(self, K_sigma: Any, held: Any | None) -> tuple[float, Array]:
        """Lowest eigenvalue mu [1] of K_sigma x = mu (K + held) x and its shape x (n,), x.(K + held) x = 1; mu = 0: not
        found.

        K_sigma (n, n) [N/m, N, N m]. held: `at` of the fixed markers, which is taken as stiff.
        """


class ElasticStructure(StaticStructure, Protocol):
    """The same, with the shapes that select the worst instant."""

    def stress_in_basis(self, loads: Array) -> Array:
        """`stress` of loads (n_load, k) in the shapes of the basis (k, m, m)."""

    def moved(self, load: Array) -> float:
        """How far the static answer to a load (n_load,) moves what moves most [m]."""

    @property
    def kept(self) -> StaticStructure:
        """Itself confined to the shapes that its body keeps."""

    @property
    def basis(self) -> Array:
        """Few shapes (n, m) that show which instant is the worst."""

    @property
    def size(self) -> int:
        """Number of coordinates n."""

    @property
    def scale(self) -> tuple[float, float]:
        """Mass [kg] and size [m]."""

    @property
    def slowest(self) -> float:
        """Least omega^2 of the basis [1/s^2]."""


@dataclass(frozen=True, eq=False)
class BucklingAnalysis:
    """The BucklingModel of an elastic structure."""

    elastic: ElasticStructure

    def nearest(self, applied: Sequence[AppliedLoad], shares_from: float = 0.0) -> BucklingResult:
        """See BucklingModel."""
        index = [k for k, one in enumerate(applied) if self.elastic.knows(one.marker) and _acts(one)]
        known = [applied[k] for k in index]
        rows = self._rows(known) if known else []
        if not rows:
            return BucklingResult(0.0, 0, (0.0,) * len(applied))
        found = max((self._judged(known, row, shares_from) for row in rows), key=lambda one: one.part)
        shares = np.zeros(len(applied))
        shares[index] = found.shares
        return BucklingResult(found.part, found.row, tuple(shares.tolist()))

    def kept(self, applied: Sequence[AppliedLoad], row: int) -> float:
        """See BucklingModel."""
        E = self.elastic.kept
        known = [one for one in applied if E.knows(one.marker) and _acts(one)]
        return max(0.0, -_lowest(E, known, row)[0])

    def _rows(self, applied: Sequence[AppliedLoad]) -> list[int]:
        """Instants, one of which is the worst; none where there is nothing but rounding."""
        mass, size = self.elastic.scale
        units = {FIELD: np.repeat([mass, mass * size], [3, 9]), WRENCH: np.repeat([1.0, 1.0 / size], 3)}
        values = np.hstack([one.values for one in applied])
        sizes = np.concatenate([units[one.values.shape[1]] for one in applied])
        if np.abs(values * sizes).max() <= NONE * mass * size * self.elastic.slowest:
            return []
        if np.ptp(values * sizes, axis=0).max() <= ALIKE * np.abs(values * sizes).max():
            return [0]
        amounts, weights, patterns = np.linalg.svd(values * sizes, full_matrices=False)
        count = min(int(np.sum(weights > ALIKE * weights[0])), PATTERNS if self.elastic.size <= LARGE else FEWER)
        amounts, patterns = (amounts * weights)[:, :count], patterns[:count] / sizes
        largest = int(np.linalg.norm(amounts, axis=1).argmax())
        if count == 1:
            other = int((amounts[:, 0] * np.sign(amounts[largest, 0])).argmin())
            return [largest, other] if amounts[other, 0] * amounts[largest, 0] < 0.0 else [largest]
        loads = np.hstack([self.elastic.loads(one.marker) for one in applied]) @ patterns.T
        small = self.elastic.stress_in_basis(loads)
        parts = -np.linalg.eigvalsh(np.einsum("tp,pij->tij", amounts, small))[:, 0]
        worst = int(parts.argmax())
        return [worst] if parts[worst] > UNLIKE * parts[largest] else sorted({worst, largest})

    def _judged(self, applied: Sequence[AppliedLoad], row: int, shares_from: float) -> BucklingResult:
        """How near they are at an instant."""
        E = self.elastic
        if any(one.follows and one.values[row].any() for one in applied):  # has no static buckling load
            return BucklingResult(0.0, row, (0.0,) * len(applied))
        mu, x = _lowest(E, applied, row)
        if mu >= 0.0 or self._bent_far(applied, row, -mu):
            return BucklingResult(0.0, row, (0.0,) * len(applied))
        if -mu < shares_from:
            return BucklingResult(-mu, row, (0.0,) * len(applied))
        shares = [-float(x @ (_change(E, [one], row) @ x)) for one in applied]
        return BucklingResult(-mu, row, tuple(shares))

    def _bent_far(self, applied: Sequence[AppliedLoad], row: int, part: float) -> bool:
        """Whether the loads bend a body so far, before it buckles, that linear buckling does not apply.

        Linear buckling takes it to stay straight until then: a round boom, which never tips over, would do so when
        bent by half its length.
        """
        return self.elastic.moved(_load(self.elastic, applied, row)) > FAR * part * self.elastic.scale[1]


def _lowest(E: StaticStructure, applied: Sequence[AppliedLoad], row: int) -> tuple[float, Array]:
    """Lowest mu under the loads at an instant, and its shape."""
    held = _added(E, applied, [np.diag(np.arange(6.0) < one.held) for one in applied])
    return E.lowest(_change(E, applied, row), held)


def _change(E: StaticStructure, applied: Sequence[AppliedLoad], row: int) -> Any:
    """Geometric and load stiffness of the loads at an instant."""
    stress = E.stress(_load(E, applied, row))
    turned = _added(E, applied, [one.turning(row) for one in applied])
    return stress if turned is None else stress - turned


def _load(E: StaticStructure, applied: Sequence[AppliedLoad], row: int) -> Array:
    """Generalised forces (n_load,) of the loads at an instant."""
    return np.asarray(np.sum([E.loads(one.marker) @ one.values[row] for one in applied], axis=0))


def _added(E: StaticStructure, applied: Sequence[AppliedLoad], blocks: Sequence[Array]) -> Any | None:
    """Sum of matrices at the markers of the loads, (n, n); None for nothing."""
    total: Any | None = None
    for one, A in zip(applied, blocks, strict=True):
        if one.marker is not None and A.any():
            one = E.at(one.marker, A)
            total = one if total is None else total + one
    return total


def _acts(one: AppliedLoad) -> bool:
    """Whether a load has a force, or a support."""
    return bool(one.values.any() or one.held)
