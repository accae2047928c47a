"""Root mean squares of stress by the covariance of amplitudes, against the mean over drawn motions."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import femflex
from femflex.body.random_stress import rms_stress
from femflex.body.recovery import FIBRE_STRESS, VON_MISES, quantity_by_name

CASES = Path(__file__).resolve().parents[2] / "cases"
SAMPLES = 2000


@pytest.mark.sampled(1)
@pytest.mark.parametrize("name", ["panel_on_bracket", "boom_in_the_air", "panel_slew"])
def test_rms_of_stress_is_that_of_drawn_motions(name):
    case = femflex.read_case(CASES / f"{name}.toml")
    body = next(built for key in case.bodies if (built := femflex.build_body(case, key)).strain_field)
    generator, n = np.random.default_rng(3), body.strain_field[0].rows.shape[2]
    root = 1e-7 * generator.normal(size=(n, n))  # so small that stress is linear in them
    y = generator.normal(size=(SAMPLES, n)) @ root
    compared = set()
    for part in body.strain_field:
        points = generator.choice(len(part.places) // part.per, 3) * part.per
        for quantity, rms in rms_stress(part, root.T @ root).items():
            at_rest = quantity_by_name(part, quantity, 0.0 * y[:1])
            drawn = quantity_by_name(part, quantity, y)[:, points] - at_rest[:, points]
            expected = np.sqrt((drawn**2).mean(axis=0))
            if quantity in (FIBRE_STRESS, VON_MISES) and part.kind != "solid":
                # the largest over fibres or faces at each instant is at least that of the worst one over all instants
                assert (rms[points] < 1.06 * expected).all() and (rms[points] > 0.6 * expected).all()
            elif not quantity.startswith("ply"):
                assert rms[points] == pytest.approx(expected, rel=0.06)
            compared.add(quantity)
    assert VON_MISES in compared or FIBRE_STRESS in compared or "moment_z" in compared
