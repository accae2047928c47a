"""Motions of several pieces and sines as the compiled equations follow them: place, velocity and force of a mass."""

import numpy as np
import pytest
from numpy.polynomial import Polynomial

from femflex.body import rigid_body
from femflex.dynamics import compile_system
from femflex.system import Profile, System, prismatic

KNOTS = np.array([-0.5, 0.8, 2.0, 2.3, 4.1])
BENDS = np.array([[0.7, -0.4], [-1.1, 0.3], [2.0, 0.9], [0.2, -0.8], [-0.6, 0.5]])  # of second and third order
SINES = np.array([[0.3, 5.0, 0.4], [-0.2, 11.0, 1.9]])


def pieces():
    """Cubics that go on with place and rate from one to the next."""
    out, s, rate = [], 0.2, -1.3
    for k, (second, third) in enumerate(BENDS):
        out.append(Polynomial([s, rate, second, third]))
        if k + 1 < len(KNOTS):
            gap = KNOTS[k + 1] - KNOTS[k]
            s, rate = out[-1](gap), out[-1].deriv()(gap)
    return out


def expected(t, order):
    k = max(0, np.searchsorted(KNOTS, t, side="right") - 1)
    wave = sum(a * w**order * np.sin(w * t + phase + order * np.pi / 2) for a, w, phase in SINES)
    return pieces()[k].deriv(order)(t - KNOTS[k]) + wave if order else pieces()[k](t - KNOTS[k]) + wave


@pytest.mark.parametrize("t", [-1.0, -0.5, 0.3, 0.8, 1.9, 2.0, 2.2, 2.3, 3.0, 4.1, 5.5])
def test_a_mass_follows_every_piece_of_its_profile(t):
    profile = Profile(KNOTS, np.array([piece.coef for piece in pieces()]), SINES)
    joint = prismatic("mass", axis=(0, 0, 1), motion=(profile,), name="lead")
    model = compile_system(System({"mass": rigid_body(2.5, np.eye(3))}, (joint,)))
    seen = model.observe(np.array([t]), np.zeros((1, 2)))
    assert seen["bodies/mass/position"][0] == pytest.approx([0, 0, expected(t, 0)], abs=1e-12)
    assert seen["monitors/momentum"][0] == pytest.approx([0, 0, 2.5 * expected(t, 1)], abs=1e-11)
    assert seen["joints/lead/drive"][0] == pytest.approx([2.5 * expected(t, 2)], abs=1e-10)
    assert seen["q"][0] == pytest.approx([expected(t, 0)], abs=1e-12)
    assert seen["u"][0] == pytest.approx([expected(t, 1)], abs=1e-12)


@pytest.mark.parametrize(("t", "known"), [(-0.4, False), (-0.3, True), (2.0, True), (3.0, True), (3.1, False)])
def test_outside_the_times_in_which_a_profile_is_known_nothing_is_a_number(t, known):
    profile = Profile(KNOTS, np.array([piece.coef for piece in pieces()]), SINES, first=-0.3, last=3.0)
    joint = prismatic("mass", motion=(profile,), name="lead", axis=(0, 0, 1))
    model = compile_system(System({"mass": rigid_body(2.5, np.eye(3))}, (joint,)))
    place = model.observe(np.array([t]), np.zeros((1, 2)))["bodies/mass/position"][0, 2]
    assert np.isfinite(place) == known
