"""Base of surroundings: no force, inputs from the orbit, and an epoch."""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import replace
from typing import ClassVar

import numpy as np

from femflex.arrays import Array
from femflex.effectors.noun import EffectorNoun
from femflex.system.acting import ALONE, Context
from femflex.system.effector import Effector
from femflex.system.orbit import CRAFT_SIGNALS, MU_EARTH

OTHER = 1e-3  # relative difference from which a gravitational parameter is not the Earth's


class Surrounding(EffectorNoun):
    """A function of time and of the place of the craft on its orbit.

    needs_orbit  whether it depends on the place
    years        first and last year of what it is computed from; None: all
    """

    n_markers = 0
    exerts = ()
    gives_signals = True
    writes_all = True
    needs_orbit: ClassVar[bool] = True
    years: ClassVar[tuple[float, float] | None] = None

    def signals(self, name: str, context: Context, path: tuple[str, ...] = ()) -> list[str]:
        """Names of its vector: x, y, z."""
        return ["x", "y", "z"]

    def effector(self, name: str, context: Context = ALONE) -> Effector:
        """The Effector of that name. Raises ValueError where it needs an orbit or an epoch that is not there."""
        inputs = orbit_signals(context, f"the {self.label}") if self.needs_orbit or context.orbit is not None else ()
        constants = self.constants(name, context)
        return replace(super().effector(name, context), conserves=True, inputs=inputs, parameters=constants)

    def parameters(self) -> Array:
        """None but those of `constants`."""
        return np.zeros(0)

    @abstractmethod
    def constants(self, name: str, context: Context) -> Array:
        """Numbers of its function (n,). Raises ValueError."""


def orbit_signals(context: Context, what: str) -> tuple[str, ...]:
    """Place and velocity of the craft as inputs. Raises ValueError where there is no orbit."""
    if context.orbit is None:
        raise ValueError(f"{what} depends on the place of the craft, and there is no orbit; give one")
    return CRAFT_SIGNALS


def around_earth(context: Context, what: str) -> None:
    """Raise ValueError where there is an orbit, and it is not about the Earth."""
    if context.orbit is not None and abs(context.orbit.mu / MU_EARTH - 1.0) > OTHER:
        raise ValueError(
            f"{what} is that of the Earth, and the orbit has mu = {context.orbit.mu:.4g} m^3/s^2 (the Earth has "
            f"{MU_EARTH:.4g}); leave it out, or set the orbit's mu"
        )


def epoch_of(context: Context, what: str) -> float:
    """Days since J2000 at t = 0. Raises ValueError where no epoch is given."""
    if context.epoch is None:
        raise ValueError(f"{what} depends on the date; give environment.epoch, a date and time in UTC")
    return context.epoch
