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

from femflex.advice.buckling.burden import FIELD, WRENCH, Buckling, Burden
from femflex.advice.buckling.flutter import first_flutter

Array = NDArray[np.float64]

NONE = 1e-7  # of mass, size and least omega^2, twelve times EI / L^2 of a column: below it a load is rounding
ALIKE = 1e-3  # of the largest load by size: patterns below it do not pick the instant
PATTERNS, FEWER = 6, 2  # that pick it at most, and of what has more than
LARGE = 20_000  # coordinates: from there on each pattern costs a tenth of the modes
FAR = 0.25  # of the size: what bends farther before it would buckle is another body by then
UNLIKE = 1.02  # times the part at one instant by few shapes, up to which the largest load is not looked at too


class Statics(Protocol):
    """A structure, or a reduced body, as static buckling sees it. Arrays over its n coordinates, free of supports."""

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


class Elastic(Statics, Protocol):
    """The same with what picks the worst instant, and what sways."""

    def stress_in_basis(self, load: Array) -> Array:
        """`stress` of a load (n_load,) in the shapes of the basis (m, m)."""

    def moved(self, load: Array) -> float:
        """How far the static answer to a load (n_load,) moves what moves most [m]."""

    @property
    def kept(self) -> Statics:
        """Itself confined to the shapes that its body keeps."""

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

    def kept(self, burdens: Sequence[Burden], row: int) -> float:
        """See Bearing."""
        E = self.elastic.kept
        known = [burden for burden in burdens if E.knows(burden.marker) and _acts(burden)]
        return max(0.0, -_lowest(E, known, row)[0])

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
        loads = np.hstack([self.elastic.loads(burden.marker) for burden in burdens]) @ patterns.T
        small = np.stack([self.elastic.stress_in_basis(load) for load in loads.T])
        parts = -np.linalg.eigvalsh(np.einsum("tp,pij->tij", amounts, small))[:, 0]
        worst = int(parts.argmax())
        return [worst] if parts[worst] > UNLIKE * parts[largest] else sorted({worst, largest})

    def _judged(self, burdens: Sequence[Burden], row: int, told: float) -> Buckling:
        """How near they are at an instant."""
        E = self.elastic
        if any(burden.follows and burden.values[row].any() for burden in burdens):
            part = 1.0 / first_flutter(*self._swaying(burdens, _change(E, burdens, row)))
            if self._bent_far(burdens, row, part):
                return Buckling(0.0, row, (0.0,) * len(burdens))
            sizes = np.array([np.linalg.norm(b.wrench[row, :3]) if b.follows else 0.0 for b in burdens])
            return Buckling(part, row, tuple((part * sizes / max(sizes.sum(), 1e-300)).tolist()), True)
        mu, x = _lowest(E, burdens, row)
        if mu >= 0.0 or self._bent_far(burdens, row, -mu):
            return Buckling(0.0, row, (0.0,) * len(burdens))
        if -mu < told:
            return Buckling(-mu, row, (0.0,) * len(burdens))
        shares = [-float(x @ (_change(E, [burden], row) @ x)) for burden in burdens]
        return Buckling(-mu, row, tuple(shares))

    def _bent_far(self, burdens: Sequence[Burden], row: int, part: float) -> bool:
        """Whether, up to where a body would buckle, what it bears bends it so far that this tells nothing.

        Linear buckling takes it to stay straight until then: a round boom, which never tips over, would do so when
        bent by half its length.
        """
        return self.elastic.moved(_load(self.elastic, burdens, row)) > FAR * part * self.elastic.scale[1]

    def _swaying(self, burdens: Sequence[Burden], change: Any) -> tuple[Array, Array, Array]:
        """K, its change and M of what sways, with what hangs on it."""
        phi, K, M = self.elastic.swaying
        hung = _added(self.elastic, burdens, [burden.inertia for burden in burdens])
        return K, phi.T @ (change @ phi), M if hung is None else M + phi.T @ (hung @ phi)


def _lowest(E: Statics, burdens: Sequence[Burden], row: int) -> tuple[float, Array]:
    """Lowest mu under burdens at an instant, and its shape."""
    held = _added(E, burdens, [np.diag(np.arange(6.0) < burden.held) for burden in burdens])
    return E.lowest(_change(E, burdens, row), held)


def _change(E: Statics, burdens: Sequence[Burden], row: int) -> Any:
    """What burdens add to the stiffness at an instant: by stress, and as they turn with their markers."""
    stress = E.stress(_load(E, burdens, row))
    turned = _added(E, burdens, [burden.turning(row) for burden in burdens])
    return stress if turned is None else stress - turned


def _load(E: Statics, burdens: Sequence[Burden], row: int) -> Array:
    """Generalised forces (n_load,) of burdens at an instant."""
    return np.asarray(np.sum([E.loads(burden.marker) @ burden.values[row] for burden in burdens], axis=0))


def _added(E: Statics, burdens: Sequence[Burden], blocks: Sequence[Array]) -> Any | None:
    """The sum of what stands at the markers of burdens, (n, n); None for nothing."""
    total: Any | None = None
    for burden, A in zip(burdens, blocks, strict=True):
        if burden.marker is not None and A.any():
            one = E.at(burden.marker, A)
            total = one if total is None else total + one
    return total


def _acts(burden: Burden) -> bool:
    """Whether there is anything of a burden: what it does, or what it holds."""
    return bool(burden.values.any() or burden.held)
