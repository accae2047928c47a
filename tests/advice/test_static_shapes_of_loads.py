"""Meshed bodies of a case keep the static shapes of what acts on them, where strain is not linear."""

import warnings

import numpy as np
import pytest
from support.advised_bodies import noted_body
from support.lateral_buckling import END_LOAD, WEIGHT, critical
from test_buckling_warnings import LOAD, PRANDTL, STRIP, held

from femflex.case import read_case
from femflex.warning import PhysicsWarning

MICHELL = 1 / np.sqrt((1 - 1 / 400) * (1 - 1.2e3 / 5.6e6))  # the bend that the strip starts from
HEAVY = STRIP.replace(LOAD, "\n[environment]\ngravity = [0, 0, -9.81]\n")
CARRIED = STRIP.replace(
    LOAD,
    """
[bodies.dish]
kind = "rigid"
mass = 2.0
inertia = [0.1, 0.1, 0.1]

[[joints]]
kind = "weld"
parent = "boom"
parent_marker = "tip"
child = "dish"
""",
)


def built(write_case, text, *changes):
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    text += held(text)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", PhysicsWarning)  # of sets left without the shapes
        return noted_body(read_case(write_case(text)), "boom")


@pytest.mark.sampled(1)
@pytest.mark.parametrize("modes", [2, 4, 6])
def test_few_modes_tip_over_where_the_strip_does(write_case, modes):
    """Prandtl's load 4.0126 sqrt(EI GJ) / L^2; four modes alone are 17 % late, two never do."""
    share = {}
    for loads in ("", ", loads = {}"):
        body = built(write_case, STRIP, ("modes = 4", f"modes = {modes}{loads}"))
        share[loads] = critical(body, body.markers["tip"].phi[2], PRANDTL * MICHELL), body.n_modes
    assert share[""] == (pytest.approx(1.0, abs=8e-3), modes + 1)
    assert share[", loads = {}"][1] == modes and (modes > 4 or share[", loads = {}"][0] > 1.17)


def test_a_strip_under_its_weight_keeps_that_of_the_weight(write_case):
    """12.854 sqrt(EI GJ) / L^2 in all."""
    body = built(write_case, HEAVY)
    weight = body.moments.first[1:, 2] / body.moments.mass
    unit = WEIGHT / END_LOAD * PRANDTL * MICHELL
    assert body.n_modes == 6 and critical(body, weight, unit) == pytest.approx(1.0, abs=1.3e-2)
    assert "2 static shapes of its loads (weight) in addition to its modes (attachment = []" in body.note
    assert built(write_case, HEAVY, ("modes = 4", "modes = 4, attachment = []")).n_modes == 4


def test_the_tip_sags_as_the_beam_does(write_case):
    """P L^3 / 3 EIy to rounding of the linear answer; one of four modes bends in the stiff plane, 3 % short."""
    body = built(write_case, STRIP)
    phi = body.markers["tip"].phi[2, : body.n_modes]
    assert phi @ np.linalg.solve(body.strain.V1, phi) == pytest.approx(3**3 / (3 * 5.6e6), rel=1e-6)


def test_the_shapes_are_told_of_and_the_stretch_of_a_slender_beam_is_not_among_them(write_case):
    body = built(write_case, STRIP, ("[0, 0, -1400]", '[0, 0, -1400]\nframe = "inertial"'))
    assert "static shapes of its loads (TIP x y z) in addition to its modes (loads = {}" in body.note
    assert body.n_modes <= 6 and body.omega[: body.n_modes].max() < 8 * body.omega[:4].max()
    assert "TIP" not in body.markers


def test_a_body_that_carries_another_keeps_the_shapes_of_its_seat(write_case):
    """Frequencies with a mass at the tip converge at once: those of 20 modes, with 4 and the seat's."""
    few, none = built(write_case, CARRIED), built(write_case, CARRIED, ("modes = 4", "modes = 4, loads = {}"))
    many = built(write_case, CARRIED, ("modes = 4", "modes = 20, loads = {}"))
    first = []
    for body in (few, none, many):
        n = body.n_modes
        tip = body.markers["tip"].phi[:, :n]
        Me = body.without_slaves().moments.elastic_mass() + 20.0 * tip.T @ tip
        first.append(np.sqrt(np.sort(np.linalg.eigvals(np.linalg.solve(Me, body.strain.V1)).real)[:3]))
    assert few.n_modes <= 10
    assert first[0] == pytest.approx(first[2], rel=1e-3)
    assert np.abs(first[1] / first[2] - 1).max() > 1e-2


@pytest.mark.parametrize(
    "change",
    [
        ("modes = 4", "modes = 4, derivatives = 6"),
        ("modes = 4", "modes = 4, derivatives = 6, deflection = 0.1"),
    ],
)
def test_a_basis_that_is_chosen_stays_as_it_is(write_case, change):
    body = built(write_case, STRIP, change)
    assert body.kinds.count("attachment") == 0 and "of its loads" not in body.note


@pytest.mark.parametrize(("modes", "added"), [(2, 1), (8, 0)])
def test_a_linear_body_keeps_those_of_loads_that_its_modes_fall_short_of(write_case, modes, added):
    """The tip's sag under the load, P L^3 / 3 EIy, to 1 % in any case: modes in the load's plane miss 3 % and less."""
    body = built(write_case, STRIP, ('strain = "condensed"', 'strain = "linear"'), ("modes = 4", f"modes = {modes}"))
    assert body.kinds.count("unanswered attachment") == added  # the two modes bend the other way
    phi = body.markers["tip"].phi[2, : body.n_modes]
    assert phi @ np.linalg.solve(body.strain.V1, phi) == pytest.approx(3**3 / (3 * 5.6e6), rel=0.01)
