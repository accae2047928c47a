"""Finite elements over the scaled length as shapes of deploying members."""

import numpy as np
import pytest
from support.members import TIP, UNIT, first_mode, solved, wall_beam
from support.pde import beam_from_a_wall

from femflex.deployment import (
    DeployingLine,
    DeployingStrip,
    ElementFunctions,
    StripFunctions,
    deploying_line,
    deploying_strip,
)
from femflex.reduction import BeamFunctions
from femflex.system import Profile


@pytest.mark.slow
def test_a_beam_of_elements_follows_the_differential_equation():
    """As `test_a_beam_from_a_wall_follows_its_differential_equation`, with four modes of ten elements."""
    length, times = Profile.polynomial(1.0, 0.3), np.linspace(0, 3, 16)
    exact = beam_from_a_wall(length, (first_mode, np.zeros_like), times, count=8)
    seen = solved(wall_beam(length, until=3.0, functions=ElementFunctions(y=4, elements=10)), times)[2]
    found = seen["markers/beam.tip/position"][:, 1]
    assert np.abs(found - exact(1.0)).max() < 1e-4 * TIP


@pytest.mark.parametrize("n", [2, 4, 8])
def test_frequencies_of_cubic_elements_err_with_the_fourth_power_of_their_size(n):
    """(beta h)^4 / 1440 relative: the known error of cubic Hermite beam elements."""
    made = deploying_line(UNIT, ElementFunctions(y=1, elements=n), Profile.constant(1.0))
    exact = deploying_line(UNIT, BeamFunctions(y=1), Profile.constant(1.0))
    off = made.body.omega[0] / exact.body.omega[0] - 1.0
    assert off == pytest.approx((1.87510407 / n) ** 4 / 1440, rel=0.3)


def test_elements_of_all_fields_and_of_strings_have_the_closed_frequencies():
    beam = DeployingLine(mass_per_length=2.0, EA=8.0, EIy=1.0, EIz=3.0, GJ=0.02, ry=0.1, rz=0.1)
    made = deploying_line(beam, ElementFunctions(y=1, z=1, axial=1, torsion=1), Profile.constant(1.0))
    bend, stretch = 3.51601527, np.pi / 2 * 2.0
    twist = np.pi / 2 * np.sqrt(0.02 / (2.0 * 0.02))
    wanted = sorted([bend * np.sqrt(0.5), bend * np.sqrt(1.5), stretch, twist])
    assert np.sort(made.body.omega[:4]) == pytest.approx(wanted, rel=1e-4)
    string = DeployingLine(mass_per_length=2.0, tension=8.0)
    held = deploying_line(string, ElementFunctions(y=2, string=True, held=True), Profile.constant(1.0))
    assert held.body.omega[:2] == pytest.approx([2 * np.pi, 4 * np.pi], rel=1e-3)


def test_a_strip_of_elements_has_the_frequency_of_the_beam():
    strip = DeployingStrip(mass_per_area=2.0, width=0.5, bending=2.0)
    functions = StripFunctions(ElementFunctions(z=2), 1)
    made = deploying_strip(strip, functions, Profile.constant(1.0))
    assert made.body.n_modes == 2
    assert made.body.omega[0] == pytest.approx(3.51601527, rel=1e-5)


def test_what_is_wrong_with_elements_is_said():
    with pytest.raises(ValueError, match="elements of a deploying member are 0; give a number from 1"):
        ElementFunctions(y=1, elements=0)
    with pytest.raises(ValueError, match="5 modes along y were requested; 2 elements have 4"):
        ElementFunctions(y=5, elements=2)
    with pytest.raises(ValueError, match=r"numbers of modes .* are \(0, 0, 0, 0\)"):
        ElementFunctions()
    with pytest.raises(ValueError, match="a member without transverse stiffness; give it a tension"):
        tether = DeployingLine(mass_per_length=1.0)
        deploying_line(tether, ElementFunctions(y=2, string=True), Profile.constant(1.0))
