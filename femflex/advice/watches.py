"""The three watches of a run: stretch that linear strain leaves out, bends beyond a strain form, and compression.

    stretch      the change of a body's first frequency by axial forces, which linear strain leaves out
    bend         the displacement of a body over its size, and the error of condensed strain in a spinning body
    compression  the axial force of a deploying member over its buckling load; of tethers and membranes, slackness

Each part records the worst instant of every body as the rows of a run pass. At the end a body has at most one line of
each watch, with both numbers and the remedy.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Protocol

from femflex.advice.advice import Advice
from femflex.advice.bodies import BodyOrigins
from femflex.advice.deflections import DeflectionWatches, SpinningDeflectionWatch
from femflex.advice.deployed_bending import AxialForceWatch, SlackWatch
from femflex.advice.stiffening import StiffeningWatch
from femflex.advice.tension import TensionWatch
from femflex.arrays import Array

if TYPE_CHECKING:
    from femflex.dynamics import Model


class Watch(Protocol):
    """One part of a watch."""

    def watch(self, times: Array, states: Array, channels: Mapping[str, Array]) -> None:
        """Record the worst values over times (n_t,) [s], states (n_t, n_x) [SI] and channels (n_t, ...)."""

    def doubts(self) -> Iterator[Advice]:
        """A physics warning for each body beyond its limit: about "stretch", "bend" or "compression"."""


class Watches:
    """The watches of a run of a model, or of one state of rest; notes: earlier ones on its bodies, by name."""

    def __init__(
        self, model: Model, origins: BodyOrigins, notes: Mapping[str, str] | None = None, at_rest: bool = False
    ) -> None:
        self._parts: tuple[Watch, ...] = (
            StiffeningWatch(model, origins, "turns at" if at_rest else "turned at up to"),
            DeflectionWatches(model, origins, "is" if at_rest else "was", notes or {}),
            SpinningDeflectionWatch(model),
            AxialForceWatch(model),
            TensionWatch(model, origins),
            SlackWatch(model),
        )

    def watch(self, times: Array, states: Array, channels: Mapping[str, Array]) -> None:
        """Record the worst values over times (n_t,) [s], states (n_t, n_x) [SI] and channels (n_t, ...)."""
        for part in self._parts:
            part.watch(times, states, channels)

    def doubts(self) -> list[Advice]:
        """The physics warnings of all watches, the worst of each watch for each body."""
        worst: dict[tuple[str, str], Advice] = {}
        for entry in (entry for part in self._parts for entry in part.doubts()):
            key = entry.decision, entry.body
            if key not in worst or _excess(entry) > _excess(worst[key]):
                worst[key] = entry
        return list(worst.values())


def _excess(entry: Advice) -> float:
    """The value of a warning over its limit."""
    return abs(entry.value or 0.0) / (entry.limit or 1.0)
