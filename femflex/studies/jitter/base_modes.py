"""Modes of a craft on a shaken base: effective masses, and the acceleration of each by Miles' rule or of a shock."""

from __future__ import annotations

from dataclasses import dataclass
from typing import cast

import numpy as np
from scipy import linalg

from femflex.disturbances import BaseMotion, BaseVibration, Shock
from femflex.studies.jitter.plant import Plant
from femflex.studies.jitter.shock import miles


@dataclass(frozen=True)
class BaseMode:
    """A mode under an acceleration of the base along one direction.

    name, frequency [Hz], Q = 1 / (2 damping ratio)
    mass          effective mass [kg] along the direction;  share: of the mass of the craft
    acceleration  [m/s^2]: root mean square by Miles' rule with the density at the frequency, or the peak of a shock
    """

    name: str
    frequency: float
    Q: float
    mass: float
    share: float
    acceleration: float


def base_modes(plant: Plant, source: str) -> list[BaseMode]:
    """The modes of a plant under one of its sources that shakes the base, by rising frequency.

    The effective mass of a mode phi is (phi^T M r)^2 / phi^T M phi, with the motion r of the whole craft with its base.
    """
    noun, model, n = cast(BaseMotion, plant.sources[source]), plant.model, len(plant.model.mass)
    inertia = model.mass @ (model.B @ plant.inputs[source][:, 0])[n : 2 * n]  # -M r
    squares, shapes = linalg.eigh((model.stiffness + model.stiffness.T) / 2.0, model.mass)
    omega = np.sqrt(np.maximum(squares, 0.0))
    masses = (shapes.T @ inertia) ** 2
    total = sum(body.moments.mass for body in plant.system.bodies.values())
    rows = []
    for mode in plant.modes():
        k, Q = int(np.argmin(np.abs(omega - abs(mode.pole)))), 0.5 / max(mode.damping_ratio, 1e-300)
        f = float(omega[k]) / (2.0 * np.pi)
        if isinstance(noun, BaseVibration):
            acceleration = miles(f, Q, float(noun.spectrum(np.array([f]))[0, 0]))
        else:
            acceleration = float(cast(Shock, noun).peaks_at(np.array([f]))[0])
        rows.append(BaseMode(mode.name, f, Q, float(masses[k]), float(masses[k]) / total, acceleration))
    return rows
