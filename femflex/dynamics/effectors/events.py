"""Events of a model, of latches and of effectors, in one list (see femflex.integrate.events)."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from femflex.arrays import Array
from femflex.system import Effector, StateEvent, System

if TYPE_CHECKING:
    from femflex.dynamics.model import Model


STEP = 1e-6  # s, over which the rate of an event's value is taken along the motion


class Source(Protocol):
    """Events of one kind."""

    def values(self, t: float, x: Array) -> Array:
        """(n,) one number per event, positive before it and again once it has happened."""

    def rates(self, t: float, x: Array) -> Array:
        """(n,) rates of these numbers."""

    def apply(self, simultaneous: Sequence[int], t: float, x: Array) -> None:
        """Change x in place as these events do that happen at once."""


@dataclass(frozen=True, eq=False)
class AllEvents:
    """Events of several sources, one after another."""

    sources: tuple[Source, ...]

    def values(self, t: float, x: Array) -> Array:
        """(n,) of all sources."""
        return np.concatenate([source.values(t, x) for source in self.sources])

    def rates(self, t: float, x: Array) -> Array:
        """(n,) of all sources."""
        return np.concatenate([source.rates(t, x) for source in self.sources])

    def apply(self, simultaneous: Sequence[int], t: float, x: Array) -> None:
        """Let each source's events happen, the first source's first."""
        first = 0
        for source in self.sources:
            n = len(source.values(t, x))
            indices = [k - first for k in simultaneous if first <= k < first + n]
            if indices:
                source.apply(indices, t, x)
            first += n


@dataclass(frozen=True, eq=False)
class StateEvents:
    """The events of a model's effectors."""

    model: Model

    @cached_property
    def states_of_events(self) -> list[tuple[Effector, StateEvent, slice]]:
        """Return every event, and the slice of x with the states of its effector."""
        names = [name for name, _ in self.model.system.all_state_names()]
        rows = []
        for effector in effectors_with_events(self.model.system):
            first = names.index(effector.state_names()[0][0])
            rows += [(effector, event, slice(first, first + len(effector.states))) for event in effector.events]
        return rows

    def values(self, t: float, x: Array) -> Array:
        """Their values."""
        return np.array(
            [
                float(_answer(effector, event, event.value, t, x[states]))
                for effector, event, states in self.states_of_events
            ]
        )

    def rates(self, t: float, x: Array) -> Array:
        """Rates of their values along the motion, by a difference."""
        dx = self.model.state_rate(t, x)
        ahead, behind = (self.values(t + sign * STEP, x + sign * STEP * dx) for sign in (1.0, -1.0))
        return np.asarray((ahead - behind) / (2.0 * STEP))

    def apply(self, simultaneous: Sequence[int], t: float, x: Array) -> None:
        """Let them happen one after another."""
        for k in simultaneous:
            effector, event, states = self.states_of_events[k]
            new = np.asarray(_answer(effector, event, event.apply, t, x[states]), float)
            if new.shape != (len(effector.states),):
                raise ValueError(
                    f"event {event.name!r} of effector {effector.name!r} gave states of shape {new.shape}; expected "
                    f"({len(effector.states)},)"
                )
            x[states] = new


def _answer(effector: Effector, event: StateEvent, function: Callable[..., Any], t: float, z: Array) -> Any:
    """The value of a function of an event. Raises ValueError that names the effector where the function raises."""
    try:
        return function(t, z.copy())
    except Exception as error:
        raise ValueError(
            f"event {event.name!r} of effector {effector.name!r} raised {type(error).__name__} at t = {t:.9g} s: "
            f"{error}"
        ) from error


def effectors_with_events(system: System) -> list[Effector]:
    """Effectors with events."""
    return [effector for effector in system.effectors if isinstance(effector, Effector) and effector.events]
