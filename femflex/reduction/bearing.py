"""How near all that a body bears comes to what buckles it: linear buckling at the worst instant of a motion.

K_sigma is linear in the load. The loads of all instants are written in a few patterns, their K_sigma confined to few
shapes picks the instant, and there the whole structure is judged. Sudden loads count once: what swings about the stress
that they bring swings faster than the shape that buckles follows.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from femflex.body.burden import FIELD, WRENCH, Buckling, Burden
from femflex.reduction.flutter import first_flutter

Array = NDArray[np.float64]

NONE = 1e-7  # of mass, size and least omega^2, twelve times EI / L^2 of a column: below it a load is rounding
ALIKE = 1e-3  # of the largest load by size: patterns below it do not pick the instant
PATTERNS, FEWER = 6, 2  # that pick it at most, and of what has more than
LARGE = 20_000  # coordinates: from there on each pattern costs a tenth of the modes
UNLIKE = 1.02  # times the part at one instant by few shapes, up to which the largest load is not looked at too


class Elastic(Protocol):
    """A structure, or a reduced body, as buckling sees it. Arrays over its n coordinates, free of supports."""

    @property
    def basis(self) -> Array:
        """Few shapes (n, m) that show which instant is the worst."""

    @property
    def swaying(self) -> tuple[Array, Array, Array]:
        """Shapes (n, m) enough to sway in, and their stiffness and mass (m, m)."""

    @property
    def size(self) -> int:
        """Number of coordinates n."""

    @property
    def scale(self) -> tuple[float, float]:
        """Mass [kg] and size [m]."""

    @property
    def slowest(self) -> float:
        """Least omega^2 of the basis [1/s^2]."""

    def knows(self, marker: str | None) -> bool:
        """Whether what acts at a marker, or all over (None), can be told."""

    def loads(self, marker: str | None) -> Array:
        """Generalised forces (n_load, 6) of unit force and torque at a marker, (n_load, 12) of unit fields."""

    def at(self, marker: str, A: Array) -> Any:
        """R^T A R (n, n), R (6, n) the translation and rotation of a marker."""

    def stress(self, load: Array) -> Any:
        """K_sigma (n, n) of the static answer to a load (n_load,)."""

    def lowest(self, K_sigma: Any, held: Any | None) -> tuple[float, Array]:
        """Lowest mu of K_sigma x = mu (K + held) x and x.(K + held) x = 1; (0, ...) where it cannot be found.

        held: `at` of markers held in their places, to be taken as stiff.
        """


@dataclass(frozen=True, eq=False)
class JudgedBearing:
    """The Bearing of what is elastic."""

    elastic: Elastic

    def nearest(self, burdens: Sequence[Burden], told: float = 0.0) -> Buckling:
        """See Bearing."""
        index = [k for k, burden in enumerate(burdens) if self.elastic.knows(burden.marker) and _acts(burden)]
        known = [burdens[k] for k in index]
        rows = self._rows(known) if known else []
        if not rows:
            return Buckling(0.0, 0, (0.0,) * len(burdens))
        found = max((self._judged(known, row, told) for row in rows), key=lambda one: one.part)
        shares = np.zeros(len(burdens))
        shares[index] = found.shares
        return Buckling(found.part, found.row, tuple(shares.tolist()), found.sways)

    def _rows(self, burdens: Sequence[Burden]) -> list[int]:
        """Instants, one of which is the worst; none where there is nothing but rounding."""
        mass, size = self.elastic.scale
        units = {FIELD: np.repeat([mass, mass * size], [3, 9]), WRENCH: np.repeat([1.0, 1.0 / size], 3)}
        values = np.hstack([burden.values for burden in burdens])
        sizes = np.concatenate([units[burden.values.shape[1]] for burden in burdens])
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
        B = self.elastic.basis
        loads = np.hstack([self.elastic.loads(burden.marker) for burden in burdens]) @ patterns.T
        small = np.stack([B.T @ (self.elastic.stress(load) @ B) for load in loads.T])
        parts = -np.linalg.eigvalsh(np.einsum("tp,pij->tij", amounts, small))[:, 0]
        worst = int(parts.argmax())
        return [worst] if parts[worst] > UNLIKE * parts[largest] else sorted({worst, largest})

    def _judged(self, burdens: Sequence[Burden], row: int, told: float) -> Buckling:
        """How near they are at an instant."""
        E = self.elastic
        parts = [E.loads(burden.marker) @ burden.values[row] for burden in burdens]
        change = E.stress(np.sum(parts, axis=0))
        turned = [self._at(burden.marker, burden.turning(row)) for burden in burdens]
        for one in turned:
            change = change if one is None else change - one
        if any(burden.follows and burden.values[row].any() for burden in burdens):
            part = 1.0 / first_flutter(*self._swaying(burdens, change))
            sizes = np.array([np.linalg.norm(b.wrench[row, :3]) if b.follows else 0.0 for b in burdens])
            return Buckling(part, row, tuple((part * sizes / max(sizes.sum(), 1e-300)).tolist()), True)
        mu, x = E.lowest(change, self._added(burdens, [np.diag(np.arange(6.0) < b.held) for b in burdens]))
        if mu >= 0.0 or -mu < told:
            return Buckling(max(-mu, 0.0), row, (0.0,) * len(burdens))
        shares = [
            -float(x @ (E.stress(load) @ x)) + (0.0 if one is None else float(x @ (one @ x)))
            for one, load in zip(turned, parts, strict=True)
        ]
        return Buckling(-mu, row, tuple(shares))

    def _swaying(self, burdens: Sequence[Burden], change: Any) -> tuple[Array, Array, Array]:
        """K, its change and M of what sways, with what hangs on it."""
        phi, K, M = self.elastic.swaying
        hung = self._added(burdens, [burden.inertia for burden in burdens])
        return K, phi.T @ (change @ phi), M if hung is None else M + phi.T @ (hung @ phi)

    def _added(self, burdens: Sequence[Burden], blocks: Sequence[Array]) -> Any | None:
        """The sum of what stands at the markers of burdens, (n, n); None for nothing."""
        total: Any | None = None
        for burden, A in zip(burdens, blocks, strict=True):
            if (one := self._at(burden.marker, A)) is not None:
                total = one if total is None else total + one
        return total

    def _at(self, marker: str | None, A: Array) -> Any | None:
        """What stands at a marker, (n, n); None for nothing."""
        return self.elastic.at(marker, A) if marker is not None and A.any() else None


def _acts(burden: Burden) -> bool:
    """Whether there is anything of a burden: what it does, or what it holds."""
    return bool(burden.values.any() or burden.held)
