"""Twist, stretch, membranes, plates and elements that deploy, each against an answer from outside."""

from dataclasses import replace

import numpy as np
import pytest
from support.members import TIP, UNIT, solved, wall_beam
from support.pde import rod_from_a_wall, stretch_from_a_wall, string_between_supports

from femflex.deployment import (
    DeployingLine,
    DeployingStrip,
    ElementFunctions,
    StringFunctions,
    StripFunctions,
    deploying_line,
    deploying_strip,
)
from femflex.reduction import BeamFunctions
from femflex.system import Profile, System, weld

RAMP = Profile.smooth_step(0.5, 4.0, 1.0, 2.0)
TIMES = np.linspace(0, 5, 26)


def on_a_wall(made, delta):
    """A member fixed at its root, with initial coordinates."""
    delta = np.concatenate([delta, np.zeros(made.body.n_modes - len(delta))])
    return System({"it": made.body}, (weld("it", child_marker="root"),), varying={"it": made.variation},
                  delta0={"it": delta})  # fmt: skip


def amplitudes(made, states, row, xi):
    """Displacement in a field at xi over time."""
    return states[:, : made.shapes.n] @ made.shapes.fields(np.array([xi]), 0)[0, row]


@pytest.mark.slow
def test_twist_follows_the_travelling_shaft():
    line = DeployingLine(mass_per_length=2.0, EIy=1.0, EIz=1.0, GJ=0.3, ry=0.3, rz=0.2)
    made = deploying_line(line, BeamFunctions(torsion=6), RAMP, until=5.0, strain="linear")
    _, states, _ = solved(on_a_wall(made, [1e-2]), TIMES)
    start = made.shapes.fields(np.linspace(0, 1, 50), 0)[:, 3, 0] * 1e-2
    exact = rod_from_a_wall(
        RAMP, (lambda xi: np.interp(xi, np.linspace(0, 1, 50), start) * 0 + made.shapes.fields(xi, 0)[:, 3, 0] * 1e-2,
               np.zeros_like), TIMES, 0.3, 2.0 * (0.3**2 + 0.2**2))(1.0)  # fmt: skip
    found = amplitudes(made, states, 3, 1.0)
    assert np.abs(found - exact).max() < 1e-3 * np.abs(exact).max()


@pytest.mark.slow
def test_stretch_follows_the_travelling_rod():
    line = DeployingLine(mass_per_length=2.0, EA=3.0, EIy=1.0, EIz=1.0)
    made = deploying_line(line, BeamFunctions(axial=8), RAMP, until=5.0)
    _, states, seen = solved(on_a_wall(made, []), TIMES)
    exact = stretch_from_a_wall(RAMP, (np.zeros_like, np.zeros_like), TIMES, 3.0, 2.0)(1.0)
    found = amplitudes(made, states, 0, 1.0)
    assert np.abs(exact).max() > 0.05
    assert np.abs(found - exact).max() < 2e-3 * np.abs(exact).max()
    assert seen["markers/it.tip/position"][:, 0] == pytest.approx(RAMP(TIMES)[0] + found, abs=1e-12)


def string_error(count, family, amplitude):
    """Largest error at the middle of a membrane against the travelling string, over the initial amplitude.

    The membrane is held at its tip; one function across the width is a string.
    """
    m, T, width = 0.4, 5.0, 0.8
    strip = DeployingStrip(mass_per_length=m, width=width, tension=T)
    functions = StripFunctions(StringFunctions(z=count, tip="held", family=family))
    made = deploying_strip(strip, functions, RAMP, until=5.0)
    shape = lambda xi: amplitude * np.sin(np.pi * xi)  # noqa: E731
    xi, w = (np.polynomial.legendre.leggauss(40)[0] + 1) / 2, np.polynomial.legendre.leggauss(40)[1] / 2
    B = made.shapes.deflections(xi, np.zeros(1))[:, 0]
    delta = np.linalg.solve((B.T * w) @ B, (B.T * w) @ shape(xi))
    _, states, _ = solved(on_a_wall(made, delta), TIMES)
    exact = string_between_supports(RAMP, (shape, np.zeros_like), TIMES, T, m)(0.5)
    found = states[:, :count] @ made.shapes.deflections(np.array([0.5]), np.zeros(1))[0, 0]
    return np.abs(found - exact).max() / amplitude


@pytest.mark.sampled(1)
@pytest.mark.parametrize("family", ["polynomial", "characteristic"])
def test_tensioned_membrane_matches_travelling_string(family):
    assert string_error(6, family, TIP) < 1e-3


@pytest.mark.slow
def test_membrane_converges_to_travelling_string():
    """Characteristic functions: order 3. Polynomials: beyond the foreshortening, which is of second order in amplitude
    (8e-5 of TIP, 8e-7 of TIP / 10) and not in the string's linear equation."""
    coarse, fine = (string_error(count, "characteristic", TIP) for count in (3, 9))
    assert np.log(coarse / fine) / np.log(3.0) > 2.5
    assert string_error(9, "polynomial", TIP) == pytest.approx(8e-5, rel=0.1)
    assert string_error(9, "polynomial", TIP / 10.0) < 3e-6


def test_plate_without_poisson_ratio_matches_beam():
    b, D, m = 0.5, 2.0, 1.0
    plate = DeployingStrip(mass_per_length=m, width=b, bending_stiffness=D / b)
    made = deploying_strip(plate, StripFunctions(BeamFunctions(z=3)), RAMP, until=5.0)
    line = DeployingLine(mass_per_length=m, EIy=D, EIz=D)
    beam = deploying_line(line, BeamFunctions(z=3), RAMP, until=5.0)
    delta = [0.02, 0.005]
    found = solved(on_a_wall(made, delta), TIMES)[2]["markers/it.tip/position"]
    exact = solved(on_a_wall(beam, delta), TIMES)[2]["markers/it.tip/position"]
    assert found == pytest.approx(exact, abs=1e-6 * np.abs(exact[:, 2]).max())


def test_plates_twist_too_and_their_frequency_falls_as_the_length_grows():
    """First twist of a long strip with nu = 0.3: (pi / 2 L) sqrt(GJ / J_p) with GJ = 2 (1 - nu) D b, slightly above."""
    b, D, mass, nu, L = 0.2, 1.5, 3.0, 0.3, 4.0
    plate = DeployingStrip(mass_per_length=mass * b, width=b, bending_stiffness=D, poisson=nu)
    made = deploying_strip(plate, StripFunctions(BeamFunctions(z=6), 3), Profile.constant(L))
    twist = np.sqrt(2 * (1 - nu) * D * b / (mass * b**3 / 12)) * np.pi / (2 * L)
    omega = made.body.omega[: made.shapes.n]
    nearest = omega[np.argmin(np.abs(omega - twist))]
    assert nearest == pytest.approx(twist, rel=0.05)


def test_tip_body_moves_with_member_and_loads_it():
    """A payload on the tip: the drum pushes both, and the payload moves with the tip."""
    from femflex.body import rigid_body

    system = wall_beam(RAMP, functions=BeamFunctions(y=5, tip=True))
    payload = rigid_body(3.0, 0.1 * np.eye(3))
    bodies = {**system.bodies, "payload": payload}
    system = replace(system, bodies=bodies, joints=(*system.joints, weld("payload", "beam", parent_marker="tip")))
    times = np.linspace(0, 5, 11)
    _, _, seen = solved(system, times)
    assert seen["bodies/payload/position"] == pytest.approx(seen["markers/beam.tip/position"], abs=1e-12)
    L, U, A = RAMP(times)
    exact = 3.0 * A + L * A + U * U  # straight to second order in the deflection
    assert seen["bodies/beam/drum_force"] == pytest.approx(exact, abs=1e-4)
    drum = seen["bodies/beam/drum_force"] * U
    assert drum == pytest.approx(seen["bodies/beam/drum_power"], abs=1e-12)


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


def test_strip_of_elements_has_frequency_of_beam():
    strip = DeployingStrip(mass_per_length=1.0, width=0.5, bending_stiffness=2.0)
    functions = StripFunctions(ElementFunctions(z=2), 1)
    made = deploying_strip(strip, functions, Profile.constant(1.0))
    assert made.body.n_modes == 2
    assert made.body.omega[0] == pytest.approx(3.51601527, rel=1e-5)
