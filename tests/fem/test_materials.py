"""Elastic constants and their limits."""

from __future__ import annotations

import numpy as np
import pytest

from femflex.fem.sections.materials import Material


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
