"""Cases become the bodies, joints and initial states they describe."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from scipy.linalg import eigh

from femflex.advice import warn_of
from femflex.advice.model_warnings import output_warnings
from femflex.assembly.rigid_skins import equivalent_box
from femflex.case import Case, parse_case, read_case
from femflex.dynamics import compile_system
from femflex.pipeline.case_bodies import build_body
from femflex.pipeline.decisions import build_system, decided
from femflex.reduction import save_body
from femflex.rotations import dcm_from_angles, dcm_from_quaternion
from femflex.warning import PhysicsWarning

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


def test_the_drawn_box_has_the_mass_moments_of_the_body():
    table = parse_case(HUB.replace("[3, 4, 5]", "[[3, 0.2, 0.1], [0.2, 4, -0.3], [0.1, -0.3, 5]]")).bodies["hub"]
    points, cells = equivalent_box(table)  # type: ignore[arg-type]
    a, b, c = points[1] - points[0], points[3] - points[0], points[4] - points[0]
    second = 2 / 12 * (np.outer(a, a) + np.outer(b, b) + np.outer(c, c))  # int r r^T dm of a uniform box
    np.testing.assert_allclose(
        np.trace(second) * np.eye(3) - second, [[3, 0.2, 0.1], [0.2, 4, -0.3], [0.1, -0.3, 5]], atol=1e-12
    )
    faces = points[cells["quad"]]
    normals = np.cross(faces[:, 1] - faces[:, 0], faces[:, 2] - faces[:, 1])
    assert np.all(np.einsum("fi,fi->f", normals, faces.mean(axis=1)) > 0)  # all look outwards


def test_the_drawn_box_is_the_same_of_an_inertia_about_the_origin():
    origin = HUB.replace("[3, 4, 5]", "[[29, -4, -6], [-4, 24, -12], [-6, -12, 15]]") + 'inertia_about = "origin"\n'
    boxes = [
        equivalent_box(parse_case(text + "center_of_mass = [1, 2, 3]\n").bodies["hub"])[0]  # type: ignore[arg-type]
        for text in (HUB, origin)
    ]
    np.testing.assert_allclose(boxes[1], boxes[0], atol=1e-12)


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
def test_a_marker_is_turned_by_angles_directions_or_a_matrix(given: str):
    body = build_body(parse_case(HUB + f"markers.side = {{ position = [1, 0, 0], orientation = {given} }}\n"), "hub")
    np.testing.assert_allclose(body.marker("side").orientation, [[0, -1, 0], [1, 0, 0], [0, 0, 1]], atol=1e-15)


def test_nominal_axes_lie_along_normal_vertical_and_flight_direction():
    seen = observed(parse_case(HUB + ORBIT + "[attitude]\nnominal_axes = ['y', 'z', 'x']\n"))
    C_NO, C_NB = dcm_from_quaternion(seen["orbit/attitude"]), dcm_from_quaternion(seen["bodies/hub/attitude"])
    np.testing.assert_allclose((C_NO.T @ C_NB)[:, [1, 2, 0]], np.eye(3), atol=1e-14)
    np.testing.assert_allclose(seen["attitude/angles"], 0, atol=1e-14)
    at = np.array([6378137.0 + 331e3, 0, 0])  # perigee: vertical along X, flight along Y
    np.testing.assert_allclose(C_NO[:, 1], at / np.linalg.norm(at), atol=1e-14)
    np.testing.assert_allclose(C_NO[:, 2], [0, 1, 0], atol=1e-14)


@pytest.mark.parametrize("rotation", ["euler_parameters", "xzy", "zxz"])
def test_pitch_yaw_and_roll_come_back_as_reported_angles(rotation: str):
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
def test_a_held_attitude_tells_the_torque_that_holds_it(sequence: str):
    """Euler's equation at rest in the orbital frame: T = n^2 (x0 x J x0 - 3 y0 x J y0), along the axes of the turns."""
    angles = np.array([0.4, 0.3, 0.7])
    text = HUB + ORBIT + f"[attitude]\nheld = true\nsequence = '{sequence}'\nangles = {angles.tolist()}\n"
    system = build_system(parse_case(text))
    (joint,) = system.joints
    assert len(joint.held) == joint.n_u == 3
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


def test_a_free_orbit_starts_with_the_centre_of_mass_at_rest_at_o(craft: str, write_case: Callable[..., Path]):
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
    assert q[-4:].tolist() == [0.01, -0.02, 0.0, 0.0] and u[-4:].tolist() == [0.0, 0.3, 0.4, 0.0]


def test_an_initial_displacement_is_along_the_axes_of_its_marker(craft: str, write_case: Callable[..., Path]):
    """A quarter turn about x: the marker's y is the body's z, its z the body's -y."""
    turned = 'markers.tip = { group = "TIP", orientation = [[1, 0, 0], [0, 0, -1], [0, 1, 0]] }'
    text = craft.replace('markers.tip = { group = "TIP" }', turned)
    text = text.replace('displacement = [0, "10 mm", 0]', 'displacement = [0, "3 mm", "4 mm"]')
    deflection = observed(read_case(write_case(text)))["markers/boom.tip/deflection"]
    np.testing.assert_allclose(deflection, [0, -0.004, 0.003], atol=1e-12)


def test_a_static_initial_shape_stores_the_energy_of_the_textbook(craft: str, write_case: Callable[..., Path]):
    text = craft.replace('"10 mm", 0]', '"10 mm", 0], shape = "static"').replace("modes = 4", "modes = 24")
    r, t = 0.03, 0.002
    EI = 70e9 * np.pi / 4 * (r**4 - (r - t) ** 4)
    seen = observed(read_case(write_case(text)))
    assert seen["monitors/elastic"] == pytest.approx(
        3 * EI / 3.0**3 * 0.01**2 / 2, rel=1e-9
    )  # cubic elements are exact here


def test_a_large_initial_displacement_is_warned_of_with_both_numbers(craft: str, write_case: Callable[..., Path]):
    """Where strain is left open it becomes condensed, and nothing is said."""
    text = craft.replace('"10 mm"', '"60 cm"')
    assert build_system(read_case(write_case(text))).bodies["boom"].strain_form == "condensed"
    with pytest.warns(PhysicsWarning, match=r"'tip' of body 'boom' is 0.6 m, 20% of the length 3 m \(limit 10%\)"):
        build_system(read_case(write_case(text.replace("[bodies.boom]", '[bodies.boom]\nstrain = "linear"'))))


@pytest.mark.parametrize(("shape", "stiffness", "drawn_in"), [("modes", 12.3624 / 4, 0.58097), ("static", 3.0, 0.6)])
def test_a_body_drawn_far_aside_does_not_start_stretched(
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


@pytest.mark.parametrize(
    ("key", "value", "told"),
    [
        (
            "rates",
            "[360, 0, 0]",
            r'rates: 360 is read as 360 rad/s \(57.3 turns a second\).*"360 deg/s" \(6.283 rad/s\)',
        ),
        ("rates", '["360 rad/s", 0, 0]', r"attitude.rates: 360 is read as"),
        ("angles", "[0, 0, 3.5]", r'attitude.angles: 3.5 is read as 3.5 rad .*"3.5 deg" \(0.06109 rad\)'),
        ("angles", "[0, 0, 30]", r'attitude.angles: 30 is read as 30 rad \(4.77 turns\).*"30 deg" \(0.5236 rad\)'),
    ],
)
def test_numbers_that_look_like_degrees_are_warned_of_with_both_readings(key: str, value: str, told: str):
    with pytest.warns(PhysicsWarning, match=told):
        parse_case(HUB + f"[attitude]\n{key} = {value}\n")


def test_an_angle_that_says_radians_may_be_over_half_a_turn():
    assert parse_case(HUB + "[attitude]\nangles = [0, 0, '3.5 rad']\n").attitude.turns()[2] == 3.5


def test_fast_rates_with_their_unit_are_not_warned_of():
    assert parse_case(HUB + "[attitude]\nrates = ['6000 rpm', 0, 0]\n").attitude.rates == pytest.approx(
        (200 * np.pi, 0, 0)
    )


def test_springs_and_initial_values_reach_the_joint():
    text = (
        HUB
        + """
[bodies.arm]
kind = "rigid"
mass = 1
inertia = [1, 1, 1]
[[joints]]
child = "arm"
parent = "hub"
"""
    )
    cases = {
        "kind = 'revolute'\naxis = '-y'\nangle = '90 deg'\nrate = 1\nstiffness = 2\ndamping = 3\nrest = 4\n": (
            [np.pi / 2],
            [1],
            [2],
            [3],
            [4],
        ),
        "kind = 'prismatic'\nposition = '5 cm'\nvelocity = 1\nstiffness = 2\ndamping = 3\nrest = 4\n": (
            [0.05],
            [1],
            [2],
            [3],
            [4],
        ),
        "kind = 'cylindrical'\nposition = 1\nangle = 2\nvelocity = 3\nrate = 4\nslide_stiffness = 5\nstiffness = 6\n": (
            [1, 2],
            [3, 4],
            [5, 6],
            [0, 0],
            [0, 0],
        ),
        "kind = 'universal'\nangles = [1, 2]\nrates = [3, 4]\nstiffness = [5, 6]\n": (
            [1, 2],
            [3, 4],
            [5, 6],
            [0, 0],
            [0, 0],
        ),
        "kind = 'spherical'\nrotation = 'zyx'\nsequence = 'zyx'\nangles = [0.1, 0.2, 0.3]\nstiffness = 7\n": (
            [0.1, 0.2, 0.3],
            [0] * 3,
            [7] * 3,
            [0] * 3,
            [0] * 3,
        ),
        "kind = 'free'\nposition = [1, 2, 3]\nvelocity = [4, 5, 6]\nrates = [7, 8, 9]\nslide_damping = 1\ndamping "
        "= [2, 3, 4]\n": (
            [1, 2, 3, 1, 0, 0, 0],
            [4, 5, 6, 7, 8, 9],
            [0] * 6,
            [1, 1, 1, 2, 3, 4],
            [0] * 6,
        ),
        "kind = 'general'\nslides = ['x', 'z']\nturns = ['y']\nposition = [1, 2]\nrates = [3]\n"
        "slide_stiffness = [4, 5]\ndamping = [6]\nrest = [0.7]\n": (
            [1, 2, 0],
            [0, 0, 3],
            [4, 5, 0],
            [0, 0, 6],
            [0, 0, 0.7],
        ),
        "kind = 'weld'\n": ([], [], [], [], []),
    }
    for given, (q0, u0, stiffness, damping, rest) in cases.items():
        joint = build_system(parse_case(text + given)).joint_of("arm")
        for found, expected in (
            (joint.q0, q0),
            (joint.u0, u0),
            (joint.stiffness, stiffness),
            (joint.damping, damping),
            (joint.rest, rest),
        ):
            np.testing.assert_allclose(found, expected, atol=1e-15)
    axis = build_system(parse_case(text + next(iter(cases)))).joint_of("arm").rotations
    np.testing.assert_allclose(axis, [[0, -1, 0]])


def test_a_load_table_of_a_file_is_that_of_the_case(craft: str, write_case: Callable[..., Path]):
    path = write_case(craft.replace("torque = [[0, 0, 1], [0, 0, 1]]\ntimes = [0, 2]", "table = 'push.csv'"))
    path.with_name("push.csv").write_text("# a pulse\ntime [min],tz [N cm],fx\n0,100,3\n\n0.5,200,4\n")
    (load,) = build_system(read_case(path)).loads
    np.testing.assert_allclose(load.times, [0, 30])
    np.testing.assert_allclose(load.torque, [[0, 0, 1], [0, 0, 2]])
    np.testing.assert_allclose(load.force, [[3, 0, 0], [4, 0, 0]])


def test_a_saved_body_stands_in_for_its_mesh(craft: str, write_case: Callable[..., Path]):
    case = read_case(write_case())
    body = build_body(case, "boom")
    save_body(case.file_path("boom.h5"), body)
    start, end = craft.index("[bodies.boom]"), craft.index("initial = {")
    saved = craft[:start] + "[bodies.boom]\nkind = 'file'\nfile = 'boom.h5'\n" + craft[end:]
    system = build_system(read_case(write_case(saved, "saved.toml")))
    np.testing.assert_array_equal(system.bodies["boom"].moments.second, body.moments.second)
    np.testing.assert_array_equal(system.bodies["boom"].damping, body.damping)
    fewer = saved.replace("file = 'boom.h5'", "file = 'boom.h5'\nmodes = 2\ndamping = { mass = 0.1, stiffness = 0.01 }")
    found = build_body(read_case(write_case(fewer, "fewer.toml")), "boom")
    assert found.n_modes == 2
    np.testing.assert_allclose(found.damping, 0.1 * np.eye(2) + 0.01 * body.strain.V1[:2, :2], rtol=1e-9, atol=1e-9)


@pytest.mark.slow
def test_an_analytic_beam_rings_like_the_textbook():
    text = """
[run]
duration = 1
[bodies.beam]
kind = "analytic"
length = 33
mass = 129
EIy = "436 kgf m^2"
EIz = "436 kgf m^2"
EA = 1e7
GJ = 1e3
functions = { y = 4, z = 4 }
rotary_inertia = false
"""
    body = build_body(parse_case(text), "beam")
    beta = np.array([1.8751040687119611, 4.694091132974175])
    expected = beta**2 * np.sqrt(436 * 9.80665 / (129 / 33 * 33.0**4))
    np.testing.assert_allclose(body.omega[[0, 2]], expected, rtol=1e-9)
    assert build_body(parse_case(text), "beam", modes=6).n_modes == 12
    assert build_system(parse_case(text)).root == "beam"


PLATE = """
[run]
duration = 1
[materials.carbon]
kind = "orthotropic"
E1 = "140 GPa"
E2 = "10 GPa"
G12 = "5 GPa"
nu12 = 0.3
density = 1600
[materials.honeycomb]
kind = "core"
density = 50
G13 = "200 MPa"
[materials.aluminium]
E = "70 GPa"
nu = 0.33
density = 2700
[sections.sheet]
kind = "plate"
thickness = "2 mm"
extra_mass = 1.5
[sections.panel]
kind = "sandwich"
face = { material = "aluminium", thickness = "0.3 mm" }
core = { material = "honeycomb", thickness = "20 mm" }
[sections.laminate]
kind = "layup"
plies = [
  { material = "carbon", thickness = "1 mm" },
  { material = "carbon", thickness = "1 mm", angle = "90 deg" },
  { material = "carbon", thickness = "1 mm" },
]
[bodies.hub]
kind = "rigid"
mass = 1
inertia = [1, 1, 1]
"""


def test_plate_sections_have_the_mass_and_stiffness_of_the_textbook():
    from femflex.assembly.sections import build_material, build_section

    case = parse_case(PLATE)
    aluminium = build_material(case.materials["aluminium"])
    sheet, left = build_section(case.sections["sheet"], aluminium, case.materials)
    assert left is None and sheet.mass == pytest.approx(2700 * 0.002 + 1.5)
    assert sheet.D[0, 0] == pytest.approx(70e9 * 0.002**3 / 12 / (1 - 0.33**2), rel=1e-12)
    panel, _ = build_section(case.sections["panel"], None, case.materials)
    assert panel.mass == pytest.approx(2 * 2700 * 3e-4 + 50 * 0.02)
    faces = 70e9 / (1 - 0.33**2) * ((0.0206) ** 3 - 0.02**3) / 12
    assert panel.D[0, 0] == pytest.approx(faces, rel=1e-12)
    laminate, _ = build_section(case.sections["laminate"], None, case.materials)
    Q = 140e9 / (1 - 0.3**2 * 10 / 140), 10e9 / (1 - 0.3**2 * 10 / 140)
    assert laminate.D[0, 0] == pytest.approx((Q[0] * (27 - 1) + Q[1]) * 1e-9 / 12, rel=1e-12)
    with pytest.raises(ValueError, match="takes the member's material"):
        build_section(case.sections["sheet"], None, case.materials)
    with pytest.raises(ValueError, match="takes an isotropic material"):
        tube = parse_case(PLATE + "[sections.t]\nkind = 'tube'\nouter_radius = 1\nthickness = 0.1\n").sections["t"]
        build_section(tube, build_material(case.materials["carbon"]), case.materials)


def test_a_section_of_a_case_has_the_dimensions_of_its_class():
    from dataclasses import fields

    from femflex.assembly.sections import BEAM_SECTIONS

    for table, section in BEAM_SECTIONS.items():
        assert set(table.model_fields) - {"kind"} == {f.name for f in fields(section)}, table


def test_a_frame_may_spin(craft: str, write_case: Callable[..., Path]):
    text = HUB + "[attitude]\nframe = 'spinning'\nspin = [0, 0, '2 rpm']\nangles = [0, '30 deg', 0]\n"
    seen = observed(parse_case(text))
    C_NB = dcm_from_quaternion(seen["bodies/hub/attitude"])
    np.testing.assert_allclose(C_NB @ seen["bodies/hub/rate"], [0, 0, 4 * np.pi / 60], atol=1e-15)


def test_markers_may_be_put_at_the_nearest_mesh_point(craft: str, write_case: Callable[..., Path]):
    text = craft.replace('markers.tip = { group = "TIP" }', 'markers.tip = { position = ["2.9 m", 0, 0] }')
    body = build_body(read_case(write_case(text)), "boom")
    np.testing.assert_allclose(body.marker("tip").position, [3, 0, 0])


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
        ('{ method = "cantilever", clamp = { ROOT = ["x", "y", "z", "rx", "ry", "rz"] }, modes = 4 }', 4),
        ('{ method = "cantilever", clamp = "ROOT", modes = 4, attachment = ["y", "z"] }', 6),
        ('{ method = "craig_bampton", interfaces = ["ROOT"], modes = 4 }', 4),
        ('{ method = "craig_bampton", clamp = "ROOT", interfaces = ["TIP"], modes = 2, interface = "nodal" }', 10),
        ('{ method = "nodal", clamp = "ROOT" }', None),
        ('{ method = "lumped", clamp = "ROOT" }', 9),
    ],
)
def test_every_reduction_rings_at_the_frequency_of_the_textbook(
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


def test_a_free_free_boom_rings_at_the_frequency_of_the_textbook(craft: str, write_case: Callable[..., Path]):
    text = craft.replace('{ method = "cantilever", clamp = "ROOT", modes = 4 }', '{ method = "free_free", modes = 2 }')
    text = text.replace('child_marker = "ROOT"', 'child_marker = "tip"').replace(
        ', displacement = [0, "10 mm", 0]', ", displacement = [0, 0, 0]"
    )
    body = build_body(read_case(write_case(text)), "boom")
    cantilever = build_body(read_case(write_case(craft, "cantilever.toml")), "boom")
    assert body.omega[0] / cantilever.omega[0] == pytest.approx((4.730040744862704 / 1.8751040687119611) ** 2, rel=5e-3)


def test_a_mesh_taken_as_rigid_has_its_mass_and_no_modes(craft: str, write_case: Callable[..., Path]):
    start, end = craft.index("reduction ="), craft.index("[[joints]]")
    text = craft[:start] + 'reduction = { method = "rigid" }\nmarkers.ROOT = {}\n' + craft[end:]
    body = build_body(read_case(write_case(text)), "boom")
    assert body.n_modes == 0 and body.moments.mass == pytest.approx(2700 * np.pi * (0.03**2 - 0.028**2) * 3)
    np.testing.assert_allclose(body.moments.center_of_mass(), [1.5, 0, 0], atol=1e-12)


def test_doubtful_bodies_are_warned_of_with_both_numbers(craft: str, write_case: Callable[..., Path]):
    one = read_case(write_case(craft.replace("modes = 4", "modes = 1, joints = {}")))
    bodies = {"boom": build_body(one, "boom")}
    assert bodies["boom"].n_modes == 2  # the pair of a round boom is kept whole
    with pytest.warns(
        PhysicsWarning,
        match=r"the effective mass of its 2 modes is at most 61% of its mass in any direction "
        r"\(limit 75%\)",
    ):
        warn_of(decided(one).advice)
    sound = read_case(write_case())
    found = decided(sound)
    told = "step of 0.1 s resolves up to 5 Hz, and the first mode of body 'boom' has 6.496 Hz"
    with pytest.warns(PhysicsWarning, match=told):
        warn_of(output_warnings(found.system, 0.1))
    warn_of((*found.advice, *output_warnings(found.system, 0.01)))  # nothing to say: warnings are errors here
    path = write_case(craft, "long.toml")
    (path.parent / "boom.inp").write_text((path.parent / "boom.inp").read_text().replace("3.0, 0.0", "3000.0, 0.0"))
    long = read_case(path)
    told = r"the mesh spans 3000 m, over 200 m, and its mass is .* mesh_unit = 'mm', and if it is metres, .* = 'm'"
    with pytest.warns(PhysicsWarning, match=told):
        build_body(long, "boom")
    path.write_text(path.read_text().replace('mesh = "boom.inp"', 'mesh = "boom.inp"\nmesh_unit = "m"'))
    build_body(read_case(path), "boom")  # it says so itself


def test_a_failure_of_the_eigen_solver_names_the_body(write_case: Callable[..., Path], monkeypatch: pytest.MonkeyPatch):
    def fails(*_: object) -> None:
        raise RuntimeError("the 4 lowest modes did not converge")

    monkeypatch.setattr("femflex.assembly.bodies.build_modes", fails)
    with pytest.raises(RuntimeError, match=r"craft.toml: bodies.boom: the 4 lowest modes did not converge"):
        build_body(read_case(write_case()), "boom")


def test_a_held_attitude_is_reported_as_it_is_held(tmp_path):
    text = (Path(__file__).resolve().parents[2] / "cases" / "orbiter_yaw30.toml").read_text()
    case = tmp_path / "held.toml"
    held = text.split("[expect")[0].replace(
        'yaw = "30 deg"', 'held = true\nyaw = "30 deg"\npitch = "10 deg"\nroll = "-5 deg"'
    )
    case.write_text(held)
    model = compile_system(build_system(read_case(case)))
    angles = model.observe(np.zeros(1), model.x0[None])["attitude/angles"][0]
    assert np.degrees(angles) == pytest.approx([10, -5, 30], abs=1e-12)  # pitch, roll, yaw


@pytest.mark.parametrize(
    ("axes", "right"),
    [("'y', '-z', '-x'", True), ("'-y', '-z', 'x'", True), ("'x', 'z', '-y'", True), ("'y', 'z', '-x'", False)],
)
def test_nominal_axes_form_a_right_handed_set_with_any_signs(axes: str, right: bool):
    text = HUB + ORBIT + f"[attitude]\nnominal_axes = [{axes}]\n"
    if right:
        assert parse_case(text).attitude.nominal_axes is not None
    else:
        with pytest.raises(ValueError, match="must form a right-handed set"):
            parse_case(text)
