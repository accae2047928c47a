"""Bodies, markers and initial states of cases against closed forms."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from scipy.linalg import eigh

from femflex.case import Case, parse_case, read_case
from femflex.dynamics import compile_system
from femflex.pipeline.case_bodies import build_body
from femflex.pipeline.decisions import build_system
from femflex.rotations import dcm_from_angles, dcm_from_quaternion

HUB = """
[run]
duration = 1
[bodies.hub]
kind = "rigid"
mass = 2
inertia = [3, 4, 5]
"""
ORBIT = "[orbit]\nperigee_altitude = '331 km'\n"


def observed(case: Case) -> dict[str, np.ndarray]:
    model = compile_system(build_system(case))
    return {path: value[0] for path, value in model.observe(np.zeros(1), model.x0[None]).items()}


def test_inertia_about_the_origin_is_moved_to_the_centre_of_mass():
    extra = 'center_of_mass = [1, 2, 3]\ninertia_about = "origin"\n'
    body = build_body(
        parse_case(HUB.replace("[3, 4, 5]", "[[29, -4, -6], [-4, 24, -12], [-6, -12, 15]]") + extra), "hub"
    )
    np.testing.assert_allclose(body.moments.inertia(), [[29, -4, -6], [-4, 24, -12], [-6, -12, 15]], atol=1e-12)
    about_centre = build_body(parse_case(HUB + "center_of_mass = [1, 2, 3]\n"), "hub")  # diag(3, 4, 5) there
    np.testing.assert_allclose(body.moments.second, about_centre.moments.second, atol=1e-12)
    np.testing.assert_allclose(body.moments.center_of_mass(), [1, 2, 3], rtol=1e-14)


@pytest.mark.parametrize(
    "given",
    [
        '{ sequence = "zyx", angles = ["90 deg", 0, 0] }',
        "{ x = [0, 2, 0], z = [0, 0, 1] }",
        "{ x = [0, 1, 0], y = [-1, 5, 0] }",
        "{ x = [0, 3e-6, 0], z = [0, 0, 2e-6] }",
        "[[0, -1, 0], [1, 0, 0], [0, 0, 1]]",
    ],
)
def test_marker_orientation_by_angles_directions_or_matrix(given: str):
    body = build_body(parse_case(HUB + f"markers.side = {{ position = [1, 0, 0], orientation = {given} }}\n"), "hub")
    np.testing.assert_allclose(body.marker("side").orientation, [[0, -1, 0], [1, 0, 0], [0, 0, 1]], atol=1e-15)


def test_nominal_axes_are_normal_vertical_and_flight_direction():
    seen = observed(parse_case(HUB + ORBIT + "[attitude]\nnominal_axes = ['y', 'z', 'x']\n"))
    C_NO, C_NB = dcm_from_quaternion(seen["orbit/attitude"]), dcm_from_quaternion(seen["bodies/hub/attitude"])
    np.testing.assert_allclose((C_NO.T @ C_NB)[:, [1, 2, 0]], np.eye(3), atol=1e-14)
    np.testing.assert_allclose(seen["attitude/angles"], 0, atol=1e-14)
    at = np.array([6378137.0 + 331e3, 0, 0])  # perigee: vertical along X, flight along Y
    np.testing.assert_allclose(C_NO[:, 1], at / np.linalg.norm(at), atol=1e-14)
    np.testing.assert_allclose(C_NO[:, 2], [0, 1, 0], atol=1e-14)


@pytest.mark.parametrize("rotation", ["euler_parameters", "xzy", "zxz"])
def test_reported_angles_equal_initial_pitch_yaw_roll(rotation: str):
    text = (
        f"[attitude]\npitch = '10 deg'\nyaw = '20 deg'\nroll = '-5 deg'\nrates = [0.001, 0, 0]\nrotation = "
        f"'{rotation}'\n"
    )
    seen = observed(parse_case(HUB + ORBIT + text))
    np.testing.assert_allclose(np.degrees(seen["attitude/angles"]), [10, -5, 20], atol=1e-12)  # pitch, roll, yaw
    n = np.sqrt(3.986004418e14 / (6378137.0 + 331e3) ** 3)
    C_OB = dcm_from_quaternion(seen["orbit/attitude"]).T @ dcm_from_quaternion(seen["bodies/hub/attitude"])
    np.testing.assert_allclose(seen["bodies/hub/rate"], C_OB.T @ [n, 0, 0] + [0.001, 0, 0], atol=1e-15)


@pytest.mark.parametrize("sequence", ["xzy", "extrinsic yxz", "zxz"])
def test_prescribed_attitude_needs_torque_of_eulers_equation(sequence: str):
    """Euler's equation at rest in the orbital frame: T = n^2 (x0 x J x0 - 3 y0 x J y0), along the axes of the turns."""
    angles = np.array([0.4, 0.3, 0.7])
    text = HUB + ORBIT + f"[attitude]\nheld = true\nsequence = '{sequence}'\nangles = {angles.tolist()}\n"
    system = build_system(parse_case(text))
    (joint,) = system.joints
    assert len(joint.prescribed) == joint.n_u == 3
    model = compile_system(system)
    seen = model.observe(np.zeros(1), model.x0[None])
    assert seen["attitude/angles"][0] == pytest.approx(angles, abs=1e-14)
    C_OB = dcm_from_quaternion(seen["orbit/attitude"][0]).T @ dcm_from_quaternion(seen["bodies/hub/attitude"][0])
    assert C_OB == pytest.approx(dcm_from_angles(angles, sequence), abs=1e-14)
    n2 = 3.986004418e14 / (6378137.0 + 331e3) ** 3
    J = C_OB @ system.bodies["hub"].moments.inertia() @ C_OB.T
    x0, y0, _ = np.eye(3)
    torque = n2 * (np.cross(x0, J @ x0) - 3 * np.cross(y0, J @ y0))
    turned, axes = np.eye(3), []
    order = 1 if "extrinsic" not in sequence else -1
    for axis, angle in zip(sequence[-3:][::order], angles[::order], strict=True):
        axes.append(turned[:, "xyz".index(axis)])
        turned = turned @ dcm_from_angles([angle if letter == axis else 0.0 for letter in "xyz"], "xyz")
    assert np.linalg.norm(torque) > 1e-6
    assert seen["joints/base-hub/drive"][0] == pytest.approx(np.array(axes) @ torque, rel=1e-10)


def test_free_orbit_starts_with_centre_of_mass_at_orbit_origin(craft: str, write_case: Callable[..., Path]):
    text = craft.replace("[attitude]", "[attitude]\nyaw = 0.3") + ORBIT + "kind = 'free'\neccentricity = 0.1\n"
    seen = observed(read_case(write_case(text)))
    np.testing.assert_allclose(seen["monitors/center_of_mass"], 0, atol=1e-12)
    np.testing.assert_allclose(seen["monitors/momentum"], 0, atol=1e-10)
    assert np.linalg.norm(seen["bodies/hub/position"]) > 1e-3


@pytest.mark.slow
def test_initial_displacements_are_reached(craft: str, write_case: Callable[..., Path]):
    wanted = 'displacement = [0, "10 mm", 0]'
    for given, expected in (
        (wanted, [0, 0.01, 0]),
        ('displacement = [0, "3 mm", "-4 mm"]', [0, 0.003, -0.004]),
        ("relative = [0, 0.02, 0]", [0, 0.06, 0]),  # of 3 m
        ("relative = [0, 0.02, 0], length = 1", [0, 0.02, 0]),
        (wanted + ', shape = "static"', [0, 0.01, 0]),
        (wanted + ", modes = [3, 4]", [0, 0.01, 0]),
    ):
        seen = observed(read_case(write_case(craft.replace(wanted, given))))
        np.testing.assert_allclose(seen["markers/boom.tip/deflection"], expected, atol=1e-12)


def test_amplitudes_and_rates_of_modes_are_the_first_coordinates(craft: str, write_case: Callable[..., Path]):
    given = "amplitudes = [0.01, -0.02], rates = [0.0, 0.3, 0.4]"
    text = craft.replace('marker = "tip", displacement = [0, "10 mm", 0]', given)
    assert given in text
    model = compile_system(build_system(read_case(write_case(text))))
    q, u, _ = model.parts(model.x0)
    n = model.system.bodies["boom"].n_modes
    assert q[-n:].tolist() == [0.01, -0.02, *[0.0] * (n - 2)] and u[-n:].tolist() == [0.0, 0.3, 0.4, *[0.0] * (n - 3)]


def test_initial_displacement_is_in_marker_axes(craft: str, write_case: Callable[..., Path]):
    """A quarter turn about x: the marker's y is the body's z, its z the body's -y."""
    turned = 'markers.tip = { group = "TIP", orientation = [[1, 0, 0], [0, 0, -1], [0, 1, 0]] }'
    text = craft.replace('markers.tip = { group = "TIP" }', turned)
    text = text.replace('displacement = [0, "10 mm", 0]', 'displacement = [0, "3 mm", "4 mm"]')
    deflection = observed(read_case(write_case(text)))["markers/boom.tip/deflection"]
    np.testing.assert_allclose(deflection, [0, -0.004, 0.003], atol=1e-12)


def test_static_initial_shape_stores_energy_of_cantilever(craft: str, write_case: Callable[..., Path]):
    text = craft.replace('"10 mm", 0]', '"10 mm", 0], shape = "static"').replace("modes = 4", "modes = 24")
    r, t = 0.03, 0.002
    EI = 70e9 * np.pi / 4 * (r**4 - (r - t) ** 4)
    seen = observed(read_case(write_case(text)))
    assert seen["monitors/elastic"] == pytest.approx(
        3 * EI / 3.0**3 * 0.01**2 / 2, rel=1e-9
    )  # cubic elements are exact here


@pytest.mark.parametrize(("shape", "stiffness", "drawn_in"), [("modes", 12.3624 / 4, 0.58097), ("static", 3.0, 0.6)])
def test_large_initial_deflection_stores_bending_energy_alone(
    craft: str, write_case: Callable[..., Path], shape: str, stiffness: float, drawn_in: float
):
    """Bent by a at its end it stores stiffness EI a^2 / 2 L^3, and the end comes in by drawn_in a^2 / L.

    The first mode phi of a cantilever has int phi''^2 = 12.3624 and int phi'^2 = 4.6478 at phi(1) = 2. Strain is
    nonlinear here: vibration modes alone would store over a thousand times that energy by stretch.
    """
    a, L, r, t = 0.15, 3.0, 0.03, 0.002
    EI = 70e9 * np.pi / 4 * (r**4 - (r - t) ** 4)
    wanted = f'displacement = [0, {a}, 0], shape = "{shape}"'
    text = craft.replace('displacement = [0, "10 mm", 0]', wanted)
    text = text.replace("modes = 4 }", 'modes = 4, derivatives = "auto" }')
    text = text.replace('kind = "flexible"', 'kind = "flexible"\nstrain = "nonlinear"')
    seen = observed(read_case(write_case(text)))
    assert seen["monitors/elastic"] == pytest.approx(stiffness / 2 * EI * a**2 / L**3, rel=0.01)  # three elements
    np.testing.assert_allclose(seen["markers/boom.tip/deflection"], [-drawn_in * a**2 / L, a, 0], rtol=0.01, atol=1e-9)


def test_a_mesh_in_millimetres_is_scaled(craft: str, write_case: Callable[..., Path]):
    path = write_case(craft.replace('mesh = "boom.inp"', 'mesh = "mm.inp"\nmesh_unit = "mm"'))
    text = path.with_name("boom.inp").read_text()
    for x in (1, 2, 3):
        text = text.replace(f"{x}.0, 0.0", f"{x}000.0, 0.0")
    path.with_name("mm.inp").write_text(text)
    metres = build_body(read_case(write_case(craft, "metres.toml")), "boom")
    assert build_body(read_case(path), "boom").omega == pytest.approx(metres.omega, rel=1e-9)


@pytest.mark.sampled(3)
@pytest.mark.parametrize(
    ("reduction", "n_modes"),
    [
        ('{ method = "cantilever", clamp = { ROOT = ["x", "y", "z", "rx", "ry", "rz"] }, modes = 4, joints = {} }', 4),
        ('{ method = "cantilever", clamp = "ROOT", modes = 4, attachment = ["y", "z"] }', 6),
        ('{ method = "craig_bampton", interfaces = ["ROOT"], modes = 4, joints = {} }', 4),
        ('{ method = "craig_bampton", clamp = "ROOT", interfaces = ["TIP"], modes = 2, interface = "nodal" }', 10),
        ('{ method = "nodal", clamp = "ROOT" }', None),
        ('{ method = "lumped", clamp = "ROOT" }', 9),
    ],
)
def test_every_reduction_has_closed_form_frequency(
    reduction: str, n_modes: int | None, craft: str, write_case: Callable[..., Path]
):
    text = craft.replace('{ method = "cantilever", clamp = "ROOT", modes = 4 }', reduction)
    body = build_body(read_case(write_case(text.replace('mesh = "boom.inp"', 'mesh = "boom.inp"\nrefine = 0'))), "boom")
    lowest = np.sqrt(eigh(body.strain.V1, body.moments.elastic_mass(), eigvals_only=True)[0])
    r, t, L = 0.03, 0.002, 3.0
    area, second = np.pi * (r**2 - (r - t) ** 2), np.pi / 4 * (r**4 - (r - t) ** 4)
    expected = 1.8751040687119611**2 * np.sqrt(70e9 * second / (2700 * area * L**4))
    assert lowest == pytest.approx(expected, rel=0.06 if "lumped" in reduction else 5e-4)  # three elements
    assert n_modes is None or body.n_modes == n_modes


def test_a_free_free_boom_has_closed_form_frequency(craft: str, write_case: Callable[..., Path]):
    text = craft.replace('{ method = "cantilever", clamp = "ROOT", modes = 4 }', '{ method = "free_free", modes = 2 }')
    text = text.replace('child_marker = "ROOT"', 'child_marker = "tip"').replace(
        ', displacement = [0, "10 mm", 0]', ", displacement = [0, 0, 0]"
    )
    body = build_body(read_case(write_case(text)), "boom")
    cantilever = build_body(read_case(write_case(craft, "cantilever.toml")), "boom")
    assert body.omega[0] / cantilever.omega[0] == pytest.approx((4.730040744862704 / 1.8751040687119611) ** 2, rel=5e-3)


WHEELS = """
[wheels.one]
body = "hub"
marker = "left"
axis = [1, 0, 0]
inertia = 0.2
inertia_in_body = "added"
mass = 3.0
transverse_inertia = 0.15

[wheels.two]
body = "hub"
axis = [0, 3, 4]
inertia = 0.5
inertia_in_body = "contained"

[wheels.three]
body = "hub"
axis = [0, 0, 1]
inertia = 0.1
inertia_in_body = "added"
mass = 5.0
transverse_inertia = 0.07
"""


def test_a_body_with_several_wheels_has_the_moments_of_all_of_them(craft, write_case):
    """About the hub's origin; the first wheel is at (0.5, 0, 0), the others at the origin."""
    body = build_system(read_case(write_case(craft + WHEELS))).bodies["hub"]
    assert body.moments.mass == pytest.approx(200.0 + 3.0 + 5.0)
    assert body.moments.first[0] == pytest.approx([3.0 * 0.5, 0.0, 0.0])
    a = np.array([0.0, 0.6, 0.8])
    expected = np.diag([120.0, 100.0, 140.0]) + 3.0 * 0.25 * np.diag([0.0, 1.0, 1.0])
    expected += 0.15 * np.diag([0.0, 1.0, 1.0]) - 0.5 * np.outer(a, a) + 0.07 * np.diag([1.0, 1.0, 0.0])
    assert body.moments.inertia() == pytest.approx(expected, abs=1e-10)
