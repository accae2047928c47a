"""Elastic constants and their limits."""

from __future__ import annotations

import numpy as np
import pytest

from femflex.fem.sections.materials import Material
from femflex.fem.solid.elastic import material_axes


def test_the_shear_modulus_follows_from_young_and_poisson_unless_given():
    assert Material(200e9, 0.25, 7850).G == 80e9
    assert Material(200e9, 0.25, 7850, G=5e9).G == 5e9


@pytest.mark.parametrize(
    ("values", "sentence"),
    [
        ((-1.0, 0.3, 1.0), "Young's modulus E is -1.0"),
        ((0.0, 0.3, 1.0), "must be positive and finite"),
        ((np.nan, 0.3, 1.0), "Young's modulus E is nan"),
        ((1.0, 0.5, 1.0), "nu is 0.5; an isotropic material has -1 < nu < 0.5"),
        ((1.0, -1.0, 1.0), "nu is -1.0"),
        ((1.0, np.nan, 1.0), "nu is nan"),
        ((1.0, 0.3, -2.0), "density is -2.0"),
        ((1.0, 0.3, np.inf), "density is inf"),
        ((1.0, 0.3, 1.0, -4.0), "shear modulus G is -4.0"),
        ((1.0, 0.3, 1.0, 0.0), "shear modulus G is 0.0"),
    ],
)
def test_impossible_constants_are_refused(values, sentence):
    with pytest.raises(ValueError, match=sentence):
        Material(*values)


def test_axes_from_two_directions_keep_the_second_on_its_side():
    axes = material_axes([2.0, 0, 0, 1.0, 0.5, 0], "a material")
    assert np.array_equal(axes, np.eye(3))
    given = np.random.default_rng(1).standard_normal(6)
    axes = material_axes(given, "a material")
    assert axes @ axes.T == pytest.approx(np.eye(3), abs=1e-14) and np.linalg.det(axes) == pytest.approx(1.0)
    assert axes[0] @ given[:3] > 0 and axes[1] @ given[3:] > 0
    assert axes[2] @ given[3:] == pytest.approx(0.0, abs=1e-14)
