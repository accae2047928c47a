"""Shocks and shaken bases: response spectra, peaks of outputs by modes, Miles' rule, and effective masses."""

from __future__ import annotations

from dataclasses import dataclass
from typing import cast

import numpy as np
from scipy import linalg

from femflex.arrays import Array
from femflex.disturbances import BaseMotion, BaseVibration, Shock
from femflex.studies.jitter.plant import Plant


def miles(frequency: float, Q: float, density: float) -> float:
    """Root mean square of the acceleration of an oscillator on a base with white noise, sqrt(pi / 2 f Q S).

    frequency [Hz], amplification Q = 1 / (2 zeta), density one-sided, in squared units of the answer per Hz. The exact
    value is sqrt(1 + 1/Q^2) times as large (J. W. Miles, 1954).
    """
    return float(np.sqrt(np.pi / 2.0 * frequency * Q * density))


def shock_spectrum(times: Array, acceleration: Array, frequencies: Array, damping_ratio: float = 0.05) -> Array:
    """Shock response spectrum (n,): largest absolute acceleration of oscillators of frequencies (n,) [Hz] on a base.

    times (n_t,) [s] evenly spaced, acceleration (n_t,) of the base, linear between them. The oscillators are
    followed for
    a period beyond the end. By the ramp-invariant filter of D. O. Smallwood (Shock and Vibration Bulletin 51, 1981).
    Raises ValueError for times that are not evenly spaced.
    """
    from scipy.signal import lfilter

    times, acceleration = np.asarray(times, float), np.asarray(acceleration, float)
    step = float(times[1] - times[0]) if len(times) > 1 else 0.0
    if not step > 0 or np.abs(np.diff(times) - step).max() > 1e-6 * step:
        raise ValueError("the times of a shock spectrum must be evenly spaced and rise; interpolate the history first")
    out = np.empty(len(frequencies))
    for k, f in enumerate(np.asarray(frequencies, float)):
        w = 2.0 * np.pi * f
        E, K = np.exp(-damping_ratio * w * step), w * np.sqrt(1.0 - damping_ratio**2) * step
        C, S = E * np.cos(K), E * np.sin(K) / K
        b = [1.0 - S, 2.0 * (S - C), E**2 - S]
        beyond = np.zeros(int(np.ceil(1.0 / (f * step))) + 1)
        history = np.concatenate([[0.0], acceleration, beyond])
        out[k] = np.abs(lfilter(b, [1.0, -2.0 * C, E**2], history)).max()
    return out


def combined_peaks(plant: Plant, source: str) -> tuple[Array, Array, Array]:
    """Peaks (n_out,) of the outputs, in their units, under a shock of the base: SRSS, CQC, and (n_modes, n_out) of
    each mode.

    SRSS: root of the sum of squares. CQC: with the correlation of close modes (A. Der Kiureghian, Earthquake
    Engineering and Structural Dynamics 9, 1981). What the modes lack follows the base with the spectrum's last value.
    """
    noun = cast(Shock, plant.sources[source])
    modes = plant.modes()
    frequency = np.array([mode.frequency for mode in modes])
    omega = 2.0 * np.pi * frequency
    S = noun.peaks_at(frequency)
    residues = np.array([(mode.residue @ plant.inputs[source])[:, 0] for mode in modes]).reshape(len(modes), -1)
    powered = residues * (1j * omega[:, None]) ** plant.powers
    signed = 2.0 * np.abs(powered) * np.where(powered.imag < 0, -1.0, 1.0) * (S / omega)[:, None]
    rest = np.abs(_missing(plant, source, residues, omega)) * noun.peaks[-1]
    ratios = np.array([mode.damping_ratio for mode in modes])
    rho = _correlation(omega, ratios)
    srss = np.sqrt((signed**2).sum(axis=0) + rest**2)
    cqc = np.sqrt(np.maximum(np.einsum("ko,kl,lo->o", signed, rho, signed), 0.0) + rest**2)
    return srss, cqc, np.abs(signed)


def _correlation(omega: Array, ratios: Array) -> Array:
    """Correlation (n, n) of the peaks of modes."""
    r = omega[:, None] / omega[None]
    a, b = ratios[:, None], ratios[None]
    top = 8.0 * np.sqrt(a * b) * (b + r * a) * r**1.5
    bottom = (1.0 - r**2) ** 2 + 4.0 * a * b * r * (1.0 + r**2) + 4.0 * (a**2 + b**2) * r**2
    return np.asarray(np.where(bottom > 0, top / np.where(bottom > 0, bottom, 1.0), np.eye(len(omega))))


def _missing(plant: Plant, source: str, residues: Array, omega: Array) -> Array:
    """Static part (n_out,) of the outputs per acceleration of the base that the modes lack."""
    B = plant.model.B @ plant.inputs[source][:, 0]
    C = plant.weights @ plant.model.C
    base = plant.base @ cast(Shock, plant.sources[source]).unit_direction
    at_rest = np.zeros(len(plant.names))
    low = 1e-3 * omega.min() / (2.0 * np.pi) if len(omega) else 1e-3
    total = plant.response(np.array([low]), source)[0, :, 0]
    modal = sum((plant.modal_response(mode, np.array([low]), source)[0, :, 0] for mode in plant.modes()), at_rest)
    return np.where(plant.powers > 0, base + C @ B, (total - modal).real)


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
