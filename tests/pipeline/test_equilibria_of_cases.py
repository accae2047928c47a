"""Equilibria of cases: resultants of statics, loads at a time, elastica, and where a craft starts."""

from __future__ import annotations

import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support.small_craft import BOOM

import femflex
from femflex.body import rigid_body
from femflex.case import Case, parse_case, read_case
from femflex.dynamics import compile_system
from femflex.linear.equilibrium import Equilibrium, rest_equilibrium, rest_system
from femflex.mesh import Mesh, line, write_mesh
from femflex.pipeline.case_equilibrium import case_equilibrium, case_modes, resolve_at_rest, write_equilibrium
from femflex.pipeline.decisions import ResolvedCase, build_system
from femflex.pipeline.recovery_channels import recovery_channels
from femflex.results import open_run
from femflex.system import Environment, Load, Profile, System, prismatic, revolute

FORCE = np.array([5.0, -0.3, 0.7])  # N at the tip, 3 m from the root
NODAL = """
title = "a boom at rest"
[run]
duration = 3
[materials.aluminium]
E = 70e9
nu = 0.25
density = 2700
[sections.tube]
kind = "tube"
outer_radius = 0.03
thickness = 0.002
[bodies.hub]
kind = "rigid"
mass = 2
inertia = [3, 4, 5]
[bodies.boom]
kind = "flexible"
mesh = "boom.inp"
members = [{ group = "BOOM", family = "beam", section = "tube", material = "aluminium" }]
reduction = { method = "nodal", clamp = "ROOT" }
strain = "linear"
markers.tip = { group = "TIP" }
recovery.middle = { position = [1.4, 0, 0.1], quantities = ["moment_z", "axial_force"] }
recovery.all = { position = [2.2, 0, 0] }
[[joints]]
kind = "weld"
child = "hub"
[[joints]]
kind = "revolute"
parent = "hub"
child = "boom"
child_marker = "ROOT"
name = "hinge"
axis = "x"
stiffness = 40
[[loads]]
name = "tug"
body = "boom"
marker = "tip"
force = [5, -0.3, 0.7]
"""
TWIST = """
[[loads]]
name = "twist"
body = "boom"
marker = "tip"
torque = [[0, 0, 0], [4, 0, 0]]
times = [0, 2]
"""


@pytest.fixture(scope="module")
def equilibrium_file(tmp_path_factory: pytest.TempPathFactory) -> tuple[Case, ResolvedCase, Equilibrium, Path]:
    """The case, the resolved case, its equilibrium, and the result file of it."""
    folder = tmp_path_factory.mktemp("rest")
    (folder / "boom.inp").write_text(BOOM)
    (folder / "craft.toml").write_text(NODAL)
    case = read_case(folder / "craft.toml")
    resolved = resolve_at_rest(case)
    state = case_equilibrium(resolved)
    write_equilibrium(state, case, folder / "out.h5", resolved=resolved)
    return case, resolved, state, folder / "out.h5"


def test_recovered_resultants_match_statics(equilibrium_file: tuple[Case, ResolvedCase, Equilibrium, Path]):
    """N = F_x, M_y = -F_z (L - x), M_z = F_y (L - x), V_y = F_y, V_z = F_z at the points that are nearest."""
    with open_run(equilibrium_file[-1]) as run:
        recovered = {path.removeprefix("recovery/boom."): run[path] for path in run if path.startswith("recovery/")}
        assert {path for path in recovered if path.startswith("middle")} == {"middle/moment_z", "middle/axial_force"}
        assert all(value.shape == (1,) for value in recovered.values())
        channels = {path: run.channels[f"recovery/boom.{path}"] for path in recovered}
        x = {path: float(channel.description.split("(")[1].split(",")[0]) for path, channel in channels.items()}
        for path, expected in (
            ("axial_force", lambda x: FORCE[0]),
            ("moment_y", lambda x: -FORCE[2] * (3 - x)),
            ("moment_z", lambda x: FORCE[1] * (3 - x)),
            ("shear_force_y", lambda x: FORCE[1]),
            ("shear_force_z", lambda x: FORCE[2]),
        ):
            for point, at in (("middle", 1.4), ("all", 2.2)):
                name = f"{point}/{path}"
                if name in recovered:
                    assert recovered[name][0] == pytest.approx(expected(x[name]), rel=1e-3), name
                    assert x[name] == pytest.approx(at, abs=0.3), name
        units = {path: channel.unit for path, channel in channels.items()}
        assert (units["middle/moment_z"], units["all/axial_force"], units["all/fibre_stress"]) == ("N m", "N", "Pa")


def test_equilibrium_file_has_one_row_with_all_channels(
    equilibrium_file: tuple[Case, ResolvedCase, Equilibrium, Path], tmp_path: Path
):
    case, resolved, state, path = equilibrium_file
    with open_run(path) as run:
        assert run.time.tolist() == [0.0] and run.complete and run.title == "a boom at rest"
        assert run.case_text == NODAL
        attributes = run.attributes
        assert attributes["case_path"] == str(case.path) and attributes["integrator"] == "equilibrium"
        assert run.statistics == {"iterations": state.iterations, "residual": state.residual}
        np.testing.assert_array_equal(run["q"][0], state.q)
        assert set(run) == set(state.model.channels) | set(recovery_channels(case, resolved.system).channels)
        assert sorted(run.bodies()) == ["boom", "hub"]
    with pytest.raises(FileExistsError):
        write_equilibrium(state, case, path)
    shutil.copy(path, tmp_path / "out.h5")
    write_equilibrium(state, case, tmp_path / "out.h5", force=True, ended="it turned over")
    with open_run(tmp_path / "out.h5") as run:
        assert not run.complete and run.ended == "it turned over"


def test_equilibrium_under_the_loads_at_a_time(write_case: Any):
    """The hinge resists the twist alone: 2 N m / 40 N m at half the time of its rise.

    A craft that starts in equilibrium is not asked to be there at the start: with the twist there is none without a
    time.
    """
    resolved = resolve_at_rest(read_case(write_case(NODAL + TWIST + '[initial]\nfrom = "equilibrium"\n')))
    assert resolved.case.initial is None
    with pytest.raises(ValueError):
        case_equilibrium(resolved)
    modes = case_modes(resolved, 1.0)
    assert float(modes.about.q[0]) == pytest.approx(0.05, rel=2e-3) and modes.left_out == ()


WEIGHT = 1.5 * 9.81 * 0.4  # of the arm about its hinge [N m]
PUSH = Load("push", "cart", force=np.array([3.0, 0.0, 0.0]))
HOLD = Load("hold", "arm", torque=np.array([0.0, 0.0, 0.5 * WEIGHT]))
TURN = Load("turn", "arm", torque=np.outer([2.0, 4.0], [0.0, 0.0, 1.0]), times=np.array([0.0, 2.0]))


def pendulum(*loads: Load, along: tuple[int, ...] = (1, 0, 0), ride: float | Profile | None = None) -> System:
    """A pendulum on a cart that slides freely, or as `ride` says."""
    bodies = {"cart": rigid_body(2.0, np.eye(3)), "arm": rigid_body(1.5, np.eye(3), [0.4, 0.0, 0.0])}
    slide = prismatic("cart", axis=list(along), name="ride", motion=() if ride is None else (ride,))
    hinge = revolute("arm", "cart", name="hinge", q0=[-1.4])
    return System(bodies, (slide, hinge), environment=Environment(gravity=np.array([0.0, -9.81, 0.0])), loads=loads)


def test_pendulum_rests_30_degrees_off_the_vertical_under_half_its_moment():
    """The torque is half the weight's largest moment: the arm hangs 30 deg off the vertical."""
    ride = Profile.sine(0.1, 2.0, 0.4, 0.2)
    state, _ = rest_equilibrium(pendulum(TURN, HOLD, PUSH, ride=ride))
    assert state.q == pytest.approx([0.2 + 0.1 * np.sin(0.4), -np.pi / 3])
    assert [load.name for load in state.moving.loads] == ["hold", "push"]


def test_rest_at_a_time_has_the_loads_and_motions_of_that_time():
    """At 1 s the torque is 3 N m, and the cart where its motion has it."""
    ride = Profile.sine(0.1, 2.0, 0.4, 0.2)
    system = pendulum(TURN, PUSH, ride=ride)
    state, left_out = rest_equilibrium(system, at=1.0)
    assert left_out == ()
    assert state.q == pytest.approx([0.2 + 0.1 * np.sin(2.4), -np.arccos(3.0 / WEIGHT)])
    frozen = rest_system(system, 1.0, state)
    assert [load.torque[2] for load in frozen.loads] == [3.0, 0.0] and all(load.times is None for load in frozen.loads)


def test_state_at_rest_has_no_rates():
    system = pendulum(HOLD, ride=0.3)
    system = replace(system, joints=(system.joints[0], replace(system.joints[1], u0=np.array([7.0]))))
    model = compile_system(system)
    assert rest_equilibrium(system)[0].state_in(model) == pytest.approx([0.3, -np.pi / 3, 0.0, 0.0])


ROLLED = """
[run]
duration = "0.5 s"
samples = 3
[initial]
from = "equilibrium"
[attitude]
held = true
[sections.strip]
kind = "stiffness"
EA = "1.2e5 N"
EIy = "100 N m^2"
EIz = "1e4 N m^2"
GJ = "100 N m^2"
mass_per_length = "1 kg/m"
ry = "28.9 mm"
rz = "28.9 mm"
[bodies.beam]
kind = "flexible"
mesh = "strip.msh"
members = [{ group = "beam", family = "beam", section = "strip", segments = 24 }]
[bodies.beam.markers]
root = { group = "root" }
tip = { group = "tip" }
[[loads]]
name = "turn"
body = "beam"
marker = "tip"
frame = "inertial"
torque = [0, "MOMENT N m", 0]
"""


@pytest.mark.slow
@pytest.mark.parametrize("share", [0.25, 0.5, 1.0])
@pytest.mark.filterwarnings("ignore::femflex.warning.PhysicsWarning")
def test_strip_rolls_up_to_a_circle(share, tmp_path):
    """L = 12, EI = 100, M = share of 2 pi EI / L (Sze, Liu and Lo 2004): an arc of radius L / 2 pi share."""
    bare = line([[0, 0, 0], [12.0, 0, 0]], 24)
    points = {"root": bare.point_groups["start"], "tip": bare.point_groups["end"]}
    write_mesh(tmp_path / "strip.msh", Mesh(bare.points, bare.cells, {"beam": bare.cell_groups["line"]}, points))
    (tmp_path / "roll.toml").write_text(ROLLED.replace("MOMENT", str(-share * 50 * np.pi / 3)))
    with femflex.run(tmp_path / "roll.toml", tmp_path / "roll.h5") as run:
        tip = run["markers/beam.tip/position"][0]
    turn = 2 * np.pi * share
    exact = 12 / turn * np.array([np.sin(turn), 0.0, 1 - np.cos(turn)])
    np.testing.assert_allclose(tip, exact, atol=0.005 * 12)
    assert tip[2] == pytest.approx(exact[2], rel=2e-3, abs=1e-9)


CRAFT = """
[run]
duration = 10
[orbit]
kind = "free"
perigee_altitude = "500 km"
eccentricity = 0.05
inclination = "40 deg"
true_anomaly = "70 deg"
[bodies.hub]
kind = "rigid"
mass = 4
center_of_mass = [0.3, -0.1, 0.2]
inertia = [3, 4, 5]
markers.side = { position = [1, 2, 3] }
[bodies.arm]
kind = "rigid"
mass = 1.5
center_of_mass = [0.5, 0, 0.2]
inertia = [0.2, 0.7, 0.8]
[[joints]]
kind = "revolute"
parent = "hub"
parent_marker = "side"
child = "arm"
axis = "y"
angle = 0.4
rate = 0.7
[attitude]
frame = "FRAME"
angles = ["20 deg", "-30 deg", "50 deg"]
rates = [0.1, -0.2, 0.3]
"""
POSITION, VELOCITY = [5.0, 6.0, -7.0], [0.5, -0.25, 0.125]


@pytest.mark.parametrize("frame", ["orbital", "inertial"])
@pytest.mark.parametrize("keys", [(), ("position",), ("velocity",), ("position", "velocity")])
def test_centre_of_mass_starts_at_rest_at_the_origin(frame: str, keys: tuple[str, ...]):
    """Of the whole craft, in any frame; what the case says of the root body stays as it is said."""
    text = CRAFT.replace("FRAME", frame)
    text += "".join(f"{key} = {POSITION if key == 'position' else VELOCITY}\n" for key in keys)
    system = build_system(parse_case(text))
    model = compile_system(system)
    q, u, _ = model.parts(model.x0)
    assert ("position" in keys) is (q[:3].tolist() == POSITION)
    assert ("velocity" in keys) is (u[:3].tolist() == VELOCITY)
    channels = model.observe(np.zeros(1), model.x0[None])
    centre, momentum = channels["monitors/center_of_mass"][0], channels["monitors/momentum"][0]
    position_limit = 1e-9 if "position" not in keys else np.inf
    assert np.abs(centre).max() < position_limit and (position_limit < 1 or np.abs(centre).max() > 1)
    velocity_limit = 1e-9 if "velocity" not in keys else np.inf
    assert np.abs(momentum).max() < velocity_limit and (velocity_limit < 1 or np.abs(momentum).max() > 0.1)
