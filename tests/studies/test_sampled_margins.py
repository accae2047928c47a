"""Exact discrete models of sampled loops against closed forms of a double integrator."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from femflex.case import read_case, with_values
from femflex.pipeline.decisions import build_system
from femflex.studies.linear import margins, sampled_model
from femflex.system import System

DELAYED = Path(__file__).parents[2] / "cases" / "delayed_samples.toml"
J, P, D, T = 40.0, 6.0, 16.0, 0.5  # inertia without the wheel, gains and period of the case


def craft(delay: float, **values: object) -> System:
    """The craft of the case with another delay of its sensors."""
    at_rest = {"attitude.angles": [0, 0, 0], "sensors.star.delay": delay, "sensors.gyro.delay": delay}
    return build_system(with_values(read_case(DELAYED), {**at_rest, **values}))


def plant() -> tuple[np.ndarray, np.ndarray]:
    """Exact step of J theta'' = u with u held."""
    return np.array([[1.0, T], [0.0, 1.0]]), np.array([[T**2 / (2 * J)], [T / J]])


def largest_distance(values: np.ndarray, expected: np.ndarray) -> float:
    """Largest distance of the expected multipliers from the nearest computed ones."""
    return max(float(np.abs(values - multiplier).min()) for multiplier in expected)


def test_multipliers_of_a_sampled_double_integrator():
    A, B = plant()
    expected = np.linalg.eigvals(A - B @ [[P, D]])
    model = sampled_model(craft(0.0))
    assert largest_distance(model.multipliers(), expected) < 1e-7 and model.period == T


def test_margins_match_closed_forms():
    """gain 2 J / (D T) by Jury's test at z = -1; the others at which the multipliers of the changed loop reach 1."""
    result = margins(sampled_model(craft(0.0)), "share/y")
    assert result.gain_up == pytest.approx(2 * J / (D * T), rel=1e-3)
    A, B = plant()

    def loop(omega: float) -> complex:
        z = np.exp(1j * omega * T)
        return complex((-np.array([[P, D]]) @ np.linalg.solve(z * np.eye(2) - A, B))[0, 0])

    assert abs(loop(result.crossover)) == pytest.approx(1.0, abs=1e-4)
    assert result.phase == pytest.approx(np.angle(loop(result.crossover)) % (2 * np.pi), abs=1e-3)
    assert result.delay == pytest.approx(result.phase / result.crossover, rel=1e-9)
    least = min(abs(1 - loop(w)) for w in np.geomspace(1e-3, np.pi / T, 4000))
    assert result.modulus == pytest.approx(least, rel=1e-2)


@pytest.mark.parametrize(("period", "limit"), [(1e-3, 0.05), (0.1, 1e-6)])
def test_saturation_does_not_change_margins_of_small_motions(period, limit):
    """A step of a rate by a part of the radian in a period is beyond what a motor can do in it."""
    names = ("sensors.star", "sensors.gyro", "controllers.law", "controllers.share")
    values = {f"{name}.period": period for name in names}
    system = craft(0.0, **values, **{"wheels.z.max_torque": limit, "controllers.law.limit": limit})
    assert margins(sampled_model(system), "share/y").gain_up == pytest.approx(2 * J / (D * period), rel=1e-6)
