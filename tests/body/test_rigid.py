"""Rigid bodies: what inertia a body can have."""

from __future__ import annotations

import numpy as np
import pytest

from femflex.body import rigid_body


@pytest.mark.parametrize("J", [np.eye(3), np.diag([0.0, 1.0, 1.0]), np.diag([1.0, 2.0, 3.0])])
def test_inertia_that_points_of_mass_can_have_is_kept(J):
    """A ball, a rod, a flat plate; about the origin the mass at the centre adds m (c.c 1 - c c^T)."""
    c = np.array([0.3, -0.2, 0.5])
    body = rigid_body(2.0, J, c)
    np.testing.assert_allclose(body.moments.inertia(), J + 2.0 * (c @ c * np.eye(3) - np.outer(c, c)), atol=1e-12)
    np.testing.assert_allclose(body.moments.center_of_mass(), c)


@pytest.mark.parametrize(
    ("J", "sentence"),
    [
        (np.diag([1.0, 1.0, 2.001]), r"triangle inequality: principal moments \[1.0, 1.0, 2.001"),
        (np.diag([-1.0, 3.0, 3.0]), "not positive"),
        (np.array([[1.0, 0.1, 0], [0, 1.0, 0], [0, 0, 1.0]]), "not symmetric"),
        ([1.0, 2.0], r"inertia has shape \(2,\); give three principal moments, or \(3, 3\)"),
    ],
)
def test_other_inertia_is_refused(J, sentence):
    with pytest.raises(ValueError, match=sentence):
        rigid_body(1.0, J)
    with pytest.raises(ValueError, match="a body needs a positive mass"):
        rigid_body(0.0, np.eye(3))


def test_three_principal_moments_are_an_inertia():
    found = rigid_body(100.0, [20.0, 21.0, 30.0])
    np.testing.assert_array_equal(
        found.moments.inertia(), rigid_body(100.0, np.diag([20.0, 21.0, 30.0])).moments.inertia()
    )
