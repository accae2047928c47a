"""The water of a case: density, surface, current over depth, waves and sea floor."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise
from typing import Annotated, Literal

import numpy as np
from pydantic import model_validator
from scipy.optimize import brentq

from femflex.arrays import Array
from femflex.effectors.noun import EffectorNoun
from femflex.effectors.water.motion import water_at
from femflex.kernels.vectors import ZERO
from femflex.noun.problems import suggestion_text
from femflex.noun.table import Table, refuse
from femflex.noun.values import Axis, Count, Duration, Length, Quantity, Velocity
from femflex.system.acting import ALONE, Context
from femflex.system.effector import Effector

Positive = Annotated[float, Quantity("m", above=0.0)]
DEEP = 1e300  # m, of water without a floor
HORIZONTAL = 1e-9  # sine of the least angle of a direction of waves with the vertical


class Waves(Table):
    """Waves of one direction."""

    kind: Literal["regular", "jonswap"]
    """regular: one component. jonswap: many, by a JONSWAP spectrum, each with the same energy and a random phase."""
    height: Positive
    """Height of regular waves from trough to crest, or the significant height of a spectrum."""
    period: Duration
    """Period of regular waves, or the period of the spectrum's peak."""
    direction: Axis = (1.0, 0.0, 0.0)
    """Direction in which they run, inertial axes; only its horizontal part counts."""
    phase: Annotated[float, Quantity("rad")] = 0.0
    """Phase of regular waves: at 0 a crest is over the inertial origin at t = 0."""
    gamma: Annotated[float, Quantity(least=1.0, most=10.0)] = 3.3
    """Peak enhancement of a spectrum."""
    seed: Annotated[int, Count(0)] = 0
    """Seed of the phases of a spectrum."""
    components: Annotated[int, Count(1, 1000)] = 50
    """Number of components of a spectrum."""

    def amplitudes(self) -> tuple[Array, Array, Array]:
        """Amplitudes [m], frequencies [rad/s] and phases [rad] (n,) of its components."""
        if self.kind == "regular":
            return np.array([self.height / 2]), np.array([2 * math.pi / self.period]), np.array([self.phase])
        n = self.components
        omega = self._frequencies((np.arange(n) + 0.5) / n)
        phases = np.random.default_rng(self.seed).uniform(0.0, 2 * math.pi, n)
        return np.full(n, self.height / (4.0 * math.sqrt(n)) * math.sqrt(2.0)), omega, phases

    def _frequencies(self, shares: Array) -> Array:
        """Frequencies [rad/s] below which these shares of the spectrum's energy lie."""
        peak = 2 * math.pi / self.period
        x = np.geomspace(0.3, 20.0, 20001)  # omega over that of the peak
        width = np.where(x <= 1.0, 0.07, 0.09)
        density = x**-5.0 * np.exp(-1.25 * x**-4.0) * self.gamma ** np.exp(-((x - 1.0) ** 2) / (2.0 * width**2))
        energy = np.concatenate([[0.0], np.cumsum(np.diff(x) * (density[1:] + density[:-1]) / 2)])
        return np.asarray(peak * np.interp(shares, energy / energy[-1], x))


class CurrentAt(Table):
    """Velocity of the current at a depth."""

    depth: Annotated[float, Quantity("m", least=0.0)] = 0.0
    """Depth below the still surface."""
    velocity: Velocity
    """Velocity of the water there, inertial axes."""


class Water(EffectorNoun, heading="water"):
    """Water at rest, with a current and waves, above a sea floor. Wet members, bodies and cables feel it.

    It needs environment.gravity, which says what is up. Channel: elevation of the surface over the inertial origin.
    """

    density: Annotated[float, Quantity("kg/m^3", above=0.0)] = 1025.0
    """Density: 1025 kg/m^3 is that of sea water."""
    surface: Length = 0.0
    """Height of the still surface over the inertial origin."""
    depth: Positive | None = None
    """Depth of the floor below the still surface, under the inertial origin. Default: deep water without a floor."""
    current: tuple[CurrentAt, ...] = ()
    """Current over depth, from the surface downwards: straight lines between these depths, constant beyond them."""
    waves: tuple[Waves, ...] = ()
    """Waves of several directions and kinds, which add up."""
    floor_stiffness: Annotated[float, Quantity("Pa/m", least=0.0)] = 0.0
    """Pressure of the floor per depth to which the axis of a line sinks into it, on its length times its diameter.
    0: no floor bears it."""
    floor_damping: Annotated[float, Quantity("Pa s/m", least=0.0)] = 0.0
    """Pressure of the floor per velocity of sinking."""
    friction: Annotated[float, Quantity(least=0.0)] = 0.0
    """Coefficient of friction of the floor."""
    friction_speed: Annotated[float, Quantity("m/s", above=0.0)] = 0.01
    """Speed over which friction is smoothed: it grows with tanh(speed / friction_speed)."""
    floor_normal: Axis | None = None
    """Normal of a floor that slopes. Default: upwards."""

    label = "water"
    n_markers = 0
    exerts = ()
    channels = {"elevation": "m"}
    writes_all = True

    @model_validator(mode="after")
    def _keys_fit(self) -> Water:
        depths = [row.depth for row in self.current]
        if any(b <= a for a, b in pairwise(depths)):
            refuse(f"found current at the depths {depths} m; they must increase")
        if self.floor_stiffness > 0.0 and self.depth is None:
            refuse("found floor_stiffness without depth; say how deep the floor is")
        for k, waves in enumerate(self.waves, start=1):
            if self.depth is not None and waves.height / 2 >= self.depth:
                refuse(f"found waves {k} of {waves.height:g} m in water {self.depth:g} m deep; linear waves are low")
            for other in ("phase",) if waves.kind == "jonswap" else ("gamma", "seed", "components"):
                if other in waves.model_fields_set:
                    refuse(f"found {other} in waves {k}, which are of kind = {waves.kind!r}; leave it out")
        return self

    def parameters(self) -> Array:
        """None but those of `effector`, which depend on the gravity."""
        return np.zeros(0)

    def effector(self, name: str, context: Context = ALONE) -> Effector:
        """The Effector of that name. Raises ValueError without gravity."""
        return replace(super().effector(name, context), parameters=self.sea(context), conserves=True)

    def sea(self, context: Context) -> Array:
        """Numbers of the water (n,), as of `motion`. Raises ValueError without gravity, and for upright directions."""
        g = float(np.linalg.norm(context.gravity))
        if context.orbit is not None or not g > 0.0:
            raise ValueError("water needs uniform gravity, which says what is up; give environment.gravity, no orbit")
        up = -np.asarray(context.gravity) / g
        least = np.eye(3)[int(np.argmin(np.abs(up)))] if abs(up[0]) > 0.9 else np.eye(3)[0]
        east = least - up * (up @ least)
        east /= np.linalg.norm(east)
        north = np.cross(up, east)
        normal = up if self.floor_normal is None else np.array(self.floor_normal)
        if normal @ up <= HORIZONTAL:
            raise ValueError(f"found floor_normal {normal.tolist()}, which does not point upwards; turn it")
        depth = DEEP if self.depth is None else self.depth
        rows = [self._wave_rows(k, waves, up, east, north, g, depth) for k, waves in enumerate(self.waves, start=1)]
        waves = np.concatenate([np.zeros((0, 6)), *rows])
        current = np.array([[-row.depth, *row.velocity] for row in self.current]).reshape(-1, 4)
        floor = [self.floor_stiffness, self.floor_damping, self.friction, self.friction_speed]
        head = [self.density, g, self.surface, depth, *up, *east, *north, *normal, *floor, len(current), len(waves)]
        return np.concatenate([head, current.ravel(), waves.ravel()])

    def _wave_rows(self, k: int, waves: Waves, up: Array, east: Array, north: Array, g: float, depth: float) -> Array:
        along = np.array([east @ waves.direction, north @ waves.direction])
        if np.linalg.norm(along) <= HORIZONTAL:
            raise ValueError(f"waves {k} have the direction {list(waves.direction)}, which is upright; turn it")
        along /= np.linalg.norm(along)
        amplitudes, omega, phases = waves.amplitudes()
        numbers = np.array([wave_number(value, g, depth) for value in omega])
        return np.column_stack([amplitudes, np.outer(numbers, along), numbers, omega, phases])


def wave_number(omega: float, g: float, depth: float) -> float:
    """k > 0 [rad/m] of omega^2 = g k tanh(k depth).

    >>> round(wave_number(2 * math.pi / 10, 9.81, 20.0), 6)  # 121.2 m long
    0.051826
    """
    deep = omega**2 / g
    if deep * depth > 30.0:
        return deep
    shallow = omega / math.sqrt(g * depth)
    return float(brentq(lambda k: g * k * math.tanh(k * depth) - omega**2, 0.5 * deep, 2.0 * (deep + shallow)))


def water_of(context: Context, name: str | None) -> Water:
    """The water of a name, or the only one. Raises ValueError where it does not exist, and where several do."""
    waters = {key: noun for key, noun in context.nouns.items() if isinstance(noun, Water)}
    if name is None and len(waters) == 1:
        return next(iter(waters.values()))
    if name is None:
        text = (
            f"found {sorted(waters)}; give `water`, one of them" if waters else "there is no water; give [water.NAME]"
        )
        raise ValueError(text)
    if name not in waters:
        raise ValueError(f"found water {name!r}, which is not in [water]; {suggestion_text(name, waters)}")
    return waters[name]


@Water.kernel
def water(t: float, seen: Array, z: Array, parameters: Array, out: Array) -> None:
    """Height of the surface."""
    _, _, eta, _ = water_at(t, ZERO, ZERO, parameters)
    out[0] = eta
    for k in range(1, 5):
        out[k] = 0.0
