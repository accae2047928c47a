"""Shadow of parts of a craft on one another, against rays and closed forms."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import brentq

import femflex
from femflex import System, fem, rigid_body, simulate
from femflex.body import Marker, Skin
from femflex.case import parse_case
from femflex.effectors import Optical, SolarPressure, Sun, Surface
from femflex.mesh import rectangle
from femflex.pipeline import rebuilt
from femflex.reduction import BeamFunctions, UniformBeam, beam_body, cantilever_modes, reduce_structure
from femflex.results import open_run
from femflex.rotations import dcm_from_quaternion
from femflex.studies.linear import linear_model
from femflex.studies.torque_budget import torque_budget
from femflex.system import free, prismatic, revolute, weld, with_effectors

PRESSURE = 1361.0 / 299792458.0
CUBE = np.array([[x, y, z] for z in (-1, 1) for x, y in ((-1, -1), (1, -1), (1, 1), (-1, 1))]) / 2
FACES = np.array([[0, 3, 2, 1], [4, 5, 6, 7], [0, 1, 5, 4], [2, 3, 7, 6], [1, 2, 6, 5], [0, 4, 7, 3]])


def skin_of(*quads) -> Skin:
    return Skin(
        np.concatenate(quads), {"quad": np.arange(4 * len(quads)).reshape(-1, 4)}, np.zeros((0, 4 * len(quads), 3))
    )


def box(size, centre):
    return [(CUBE * size + centre)[face] for face in FACES]


def flat(x0, x1, y0, y1, z0, z1=None):
    """A rectangle over x, y whose height goes from z0 to z1 along x."""
    z1 = z0 if z1 is None else z1
    return np.array([[x0, y0, z0], [x1, y0, z1], [x1, y1, z1], [x0, y1, z0]], float)


def first_rows(bodies, joints, nouns, direction, duration=1e-3, period=1.0, **options):
    nouns = {"sun": Sun(kind="sun", direction=direction), "light": SolarPressure(shadow_period=period)} | nouns
    return simulate(with_effectors(System(bodies, joints, **options), nouns), duration)


def rays(quads, s, optical, n=40000):
    """Force and torque about the origin per pressure by rays from n places of every rectangle, a Kronecker lattice."""
    across, up = (np.arange(n)[:, None] + 0.5) / n, np.arange(n)[:, None] * (np.sqrt(5) - 1) / 2 % 1.0
    wrench = np.zeros(6)
    for k, q in enumerate(quads):
        a, b = q[1] - q[0], q[3] - q[0]
        area = np.cross(a, b)
        c = area @ s / np.linalg.norm(area)
        if c <= 0.0:
            continue
        x = q[0] + across * a + up * b
        lit = np.ones(len(x), bool)
        for j, other in enumerate(quads):
            u, v = other[1] - other[0], other[3] - other[0]
            n_other = np.cross(u, v)
            if j == k or abs(n_other @ s) < 1e-12:
                continue
            along = (other[0] - x) @ n_other / (n_other @ s)
            hit = x + along[:, None] * s - other[0]
            e, f = hit @ u / (u @ u), hit @ v / (v @ v)
            lit &= ~((along > 1e-9) & (e > 0) & (e < 1) & (f > 0) & (f < 1))
        normal = area / np.linalg.norm(area)
        force = -c * ((1 - optical.specular) * s + 2 * (optical.specular * c + optical.diffuse / 3) * normal)
        force = force * np.linalg.norm(area) / n
        wrench += np.concatenate([lit.sum() * force, np.cross(x[lit].sum(axis=0), force)])
    return wrench


CRAFT = [*box([2, 2, 2.0], [0, 0, 0]), *box([4, 1.5, 0.05], [3.1, 0, 0.4]), *box([4, 1.5, 0.05], [-3.1, 0, 0.4])]


@pytest.mark.parametrize("direction", [(0.6, 0, 0.8), (-0.8, 0.1, 0.5), (0.9, 0.3, 0.2), (0.3, -0.7, -0.6), (0, 0, 1)])
def test_box_with_two_wings(direction):
    s = np.array(direction) / np.linalg.norm(direction)
    optical = Optical(specular=0.3, diffuse=0.2)
    body = rigid_body(100.0, np.diag([10.0, 12.0, 14.0]), skin=skin_of(*CRAFT))
    run = first_rows({"hub": body}, [free("hub")], {"skin": Surface(body="hub", front=optical)}, s)
    found = np.concatenate([run[f"effectors/light_hub/{key}"][-1] for key in ("force", "torque")]) / PRESSURE
    np.testing.assert_allclose(found, rays(CRAFT, s, optical), atol=1e-3)


PLATE = flat(0, 1, 0, 1, 0)


@pytest.mark.parametrize(
    ("shades", "direction", "lit", "centre"),
    [  # what is lit of the unit square at z = 0, and its centre
        ([flat(0.5, 2, 0.25, 2, 1)], (0, 0, 1), 0.625, (0.35, 0.425)),
        ([flat(0.5, 2, 0.25, 2, -1)], (0, 0, 1), 1.0, (0.5, 0.5)),  # behind it
        ([flat(0, 1, -1, 2, -1, 1)], (0, 0, 1), 0.5, (0.25, 0.5)),  # through its plane: only what is in front
        ([flat(0, 1, -1, 2, -1, 1)], (0.6, 0, 0.8), 0.75, (0.40625 / 0.75, 0.5)),
        ([flat(1, 2, 0, 1, 0), flat(0, 1, 1, 2, 0)], (0.6, 0, 0.8), 1.0, (0.5, 0.5)),  # neighbours in its plane
        ([np.array([[1, 0, 0], [1, 1, 0], [1, 1, 0.3], [1, 0, 0.3]])], (0.6, 0, 0.8), 0.775, (0.3875, 0.5)),  # a wall
        ([flat(0, 0.6, 0, 1, 1), flat(0.4, 1, 0, 0.5, 2)], (0, 0, 1), 0.2, (0.8, 0.75)),  # one over the other
    ],
)
def test_lit_part_of_a_plate(shades, direction, lit, centre):
    bodies = {"plate": rigid_body(1.0, np.eye(3), skin=skin_of(PLATE))}
    bodies["shade"] = rigid_body(1.0, np.eye(3), skin=skin_of(*shades))
    nouns = {name: Surface(body=name) for name in bodies} | {
        "light": SolarPressure(bodies=["plate"], shadow_period=1.0)
    }
    run = first_rows(bodies, [weld("plate"), weld("shade")], nouns, direction)
    s = np.array(direction)
    force, torque = (run[f"effectors/light_plate/{key}"][-1] / PRESSURE for key in ("force", "torque"))
    assert run["effectors/light_shadow/lit_plate"][-1] == pytest.approx(lit, abs=1e-6)
    np.testing.assert_allclose(force, -s[2] * lit * s, atol=1e-6)
    np.testing.assert_allclose(torque, np.cross([*centre, 0.0], -s[2] * lit * s), atol=1e-6)


def test_mirrored_craft_turns_by_shadow_alone():
    """Light pushes a cube and its wings evenly. In shadow the torque is 0.05 to 0.2 P per metre of depth."""
    quads = [*box([2, 1, 2.0], [0, 0, 0]), *box([4, 1, 1e-6], [3, 0, 0]), *box([4, 1, 1e-6], [-3, 0, 0])]
    s, optical = np.array([0.6, 0.0, 0.8]), Optical(specular=0.1, diffuse=0.2)
    body, torques = rigid_body(100.0, np.diag([10.0, 12.0, 14.0]), skin=skin_of(*quads)), []
    for period in (None, 1.0):
        nouns = {"skin": Surface(body="hub", front=optical)}
        run = first_rows({"hub": body}, [free("hub")], nouns, s, period=period)
        torques.append(run["effectors/light_hub/torque"][-1] / PRESSURE)
    np.testing.assert_allclose(torques[0], 0.0, atol=1e-5)
    np.testing.assert_allclose(torques[1], rays(quads, s, optical)[3:], atol=1e-3)
    assert 0.05 < abs(torques[1][1]) < 0.2


def test_hinged_flap_rests_where_its_lit_part_is_balanced():
    """A black flap of 1 m, hinged below a roof that shades its inner half: k angle = P b (cos^2(angle) - 1/4) / 2."""
    quads = flat(0, 1, 0, 2, 0), flat(-1, 0.5, -1, 3, 2)
    bodies = {"flap": rigid_body(1.0, np.eye(3), [0.5, 1.0, 0.0], skin=skin_of(quads[0]))}
    bodies["roof"] = rigid_body(1.0, np.eye(3), skin=skin_of(quads[1]))
    nouns = {name: Surface(body=name) for name in bodies}
    nouns |= {"sun": Sun(kind="sun", direction=(0, 0, 1)), "light": SolarPressure(shadow_period=1.0)}
    k = PRESSURE * 2.0
    joints = [revolute("flap", axis=[0, 1, 0], stiffness=k), weld("roof")]
    system = with_effectors(System(bodies, joints), nouns)
    angle = brentq(lambda a: a - (np.cos(a) ** 2 - 0.25) / 2, 0.0, 1.0)
    assert femflex.equilibrium(system).q[0] == pytest.approx(angle, rel=1e-8)
    stiffness = k + PRESSURE * 2 * np.cos(angle) * np.sin(angle) * (
        1 - 0.25 / np.cos(angle) ** 2
    )  # of a share that stays
    inertia = 1.0 + 0.5**2
    assert femflex.system_modes(system).frequencies[-1] == pytest.approx(
        np.sqrt(stiffness / inertia) / (2 * np.pi), rel=1e-5
    )
    model = linear_model(system, [], ["joints/base-flap/angle"])
    assert np.abs(np.linalg.eigvals(model.A).imag).max() == pytest.approx(np.sqrt(stiffness / inertia), rel=1e-5)


LENGTH, WIDTH, TIP = 4.0, 0.5, 0.16


def strip():
    sheet = fem.build_structure(
        rectangle(LENGTH, WIDTH, 32, 2), [fem.Member("surface", "plate", 0.01, fem.Material(1e9, 0.0, 100))]
    )
    modes = cantilever_modes(sheet, ["left"], 1)
    return reduce_structure(sheet, modes, {"root": "left", "tip": "right"}, patches=["surface"])


def bent_strip():
    """A strip over a plate of the same size, at a height of one: bodies, joints, and amplitude of its tip."""
    panel = strip()
    ground = rigid_body(1.0, np.eye(3), skin=skin_of(flat(0, LENGTH, -WIDTH / 2, WIDTH / 2, 0)))
    post = {"top": Marker.at_position(np.array([0.0, 0.0, 1.0]))}
    bodies = {"ground": rigid_body(1.0, np.eye(3), skin=ground.skin, markers=post), "panel": panel}
    amplitude = np.array([TIP / panel.markers["tip"].phi[2, 0]])
    return bodies, [weld("ground"), weld("panel", "ground", parent_marker="top", child_marker="root")], amplitude


def test_bent_panel_shades_a_plate():
    """Its shadow is shifted sideways by its height over the plate, (1 + w) s_y / s_z, with w of a cantilever's mode."""
    bodies, joints, amplitude = bent_strip()
    s = np.array([0.0, 0.2, 1.0]) / np.hypot(0.2, 1.0)
    nouns = {"ground": Surface(body="ground"), "skin": Surface(body="panel", group="surface")}
    run = first_rows(bodies, joints, nouns, s, delta0={"panel": amplitude})
    k, sigma = 1.8751040687119611, 0.7340955137589128
    x = np.linspace(0, 1, 4001)
    w = np.cosh(k * x) - np.cos(k * x) - sigma * (np.sinh(k * x) - np.sin(k * x))
    mean = np.trapezoid(w, x) / w[-1] * TIP
    exact = 0.2 * (1 + mean) / WIDTH
    assert run["effectors/light_shadow/lit_ground"][-1] == pytest.approx(exact, abs=1e-3)
    assert run["effectors/light_shadow/lit_panel"][-1] == 1.0  # patches of a bent panel do not shade each other
    assert 0.2 * mean / WIDTH > 0.02


def test_shade_that_slides_by():
    """A shutter over a plate on a slide: its share falls in steps."""
    half = rigid_body(1.0, np.eye(3), skin=skin_of(flat(-2, 0, -1, 2, 0.5)))
    bodies = {"plate": rigid_body(1.0, np.eye(3), skin=skin_of(PLATE)), "shutter": half}
    joints = [weld("plate"), prismatic("shutter", "plate", axis=(1, 0, 0), u0=[0.05])]
    nouns = {"a": Surface(body="plate"), "b": Surface(body="shutter")}
    run = first_rows(bodies, joints, nouns, (0, 0, 1), 20.0, 2.0)
    before = 2.0 * np.ceil(run.times / 2.0 - 1.0)  # the sample before each row
    share = run["effectors/light_shadow/lit_plate"]
    np.testing.assert_allclose(share[1:], 1 - 0.05 * before[1:], atol=1e-9)
    lever = run["effectors/light_plate/torque"][1:, 1] / PRESSURE
    np.testing.assert_allclose(lever, share[1:] * (1 + 0.05 * before[1:]) / 2, atol=1e-9)


CASE = """
[run]
duration = "60 s"
output_step = "0.05 s"
[surroundings.sun]
kind = "sun"
direction = [0.6, 0, 0.8]
[bodies.hub]
kind = "rigid"
mass = 100
inertia = [10, 12, 14]
shapes = [
  { kind = "box", size = [2, 2, 2] },
  { kind = "box", size = [4, 1.5, 0.05], position = [3.1, 0, 0.4] },
  { kind = "box", size = [4, 1.5, 0.05], position = [-3.1, 0, 0.4] },
]
[[joints]]
kind = "free"
child = "hub"
rates = [0.01, 0.05, 0.02]
[surfaces.hub]
body = "hub"
front = { specular = 0.3, diffuse = 0.2 }
[solar_pressure.light]
shadow_period = "2 s"
"""


def test_resumed_run_is_the_unbroken_one(tmp_path):
    """Bit for bit, the lit shares in the state; and the budget is that of rays at every sample."""
    case = parse_case(CASE)
    whole = femflex.run(case, tmp_path / "whole.h5")

    def stop(t):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        femflex.run(case, tmp_path / "part.h5", progress=stop)
    with open_run(tmp_path / "part.h5") as part:
        assert 0 < len(part) < len(whole)
    rest = femflex.run(case, tmp_path / "part.h5", resume=True)
    for path in ("u", "z", "effectors/light_hub/torque", "effectors/light_shadow/lit_hub"):
        assert np.array_equal(rest[path], whole[path]), path
    assert not [path for path in whole if "memory" in path]
    rows = np.flatnonzero(np.isclose(whole.time % 2.0, 0.05))[::10]  # the first after a sample
    source = torque_budget(rebuilt(whole), whole.time, whole.states(), whole).sources[0]
    s, optical = np.array([0.6, 0, 0.8]), Optical(specular=0.3, diffuse=0.2)
    for row in rows:
        C = dcm_from_quaternion(whole["bodies/hub/attitude"][row])
        exact = PRESSURE * rays(CRAFT, C.T @ s, optical)[3:]
        np.testing.assert_allclose(source.torque[row], exact, atol=1e-2 * PRESSURE)  # in 0.05 s it turns by 0.15 deg
    assert source.largest > 0.2 * PRESSURE


def test_tube_is_a_strip_across_the_light():
    """A boom, its outer half behind a plate, over another plate: it is lit on 1.5 m, and shades 0.1 m x 1.5 m."""
    beam = UniformBeam(3.0, 1e5, 1e3, 1e3, 1e3, 1.0, ry=0.05, rz=0.05)
    bodies = {"boom": beam_body(beam, BeamFunctions(z=1), patches=["all"])}
    bodies["roof"] = rigid_body(1.0, np.eye(3), skin=skin_of(flat(1.5, 4, -1, 1, 1)))
    bodies["floor"] = rigid_body(1.0, np.eye(3), skin=skin_of(flat(0, 1.5, -1, 1, -1)))
    nouns = {name: Surface(body=name, diameter=0.1 if name == "boom" else None) for name in bodies}
    run = first_rows(bodies, [weld("boom", child_marker="root"), weld("roof"), weld("floor")], nouns, (0, 0, 1))
    assert run["effectors/light_shadow/lit_boom"][-1] == pytest.approx(0.5, abs=1e-6)
    assert run["effectors/light_shadow/lit_floor"][-1] == pytest.approx(0.95, abs=1e-6)
    force = run["effectors/light_boom/force"][-1].reshape(-1, 3).sum(axis=0) / PRESSURE
    np.testing.assert_allclose(force, [0, 0, -0.15], atol=1e-6)
