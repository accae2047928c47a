"""Linearised runs: matrix exponentials, Mathieu's equation, and nonlinear runs."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import expm
from support.random_systems import random_body
from typer.testing import CliRunner

from femflex.body import Marker, rigid_body
from femflex.case import read_case, with_values
from femflex.cli.app import app
from femflex.dynamics import compile_system
from femflex.integrate import Dop853
from femflex.pipeline import prepare
from femflex.pipeline.linear_motion import (
    LinearMotion,
    nominal_state,
)
from femflex.results import open_run
from femflex.system import (
    Environment,
    Frame,
    Load,
    Orbit,
    Profile,
    System,
    free,
    prismatic,
    revolute,
    spherical,
)

CASES = Path(__file__).parents[2] / "cases"
INERTIA = 0.2 + 2.0 * 0.25  # of the arm about its hinge


def pendulum(size: float, ride: Profile | float = 0.0) -> System:
    """A damped pendulum that begins `size` off its rest and is turned by as much of a torque; ride: of its hinge."""
    arm = rigid_body(2.0, np.diag([0.1, 0.2, 0.2]), [0.5, 0, 0], {"end": Marker.at_position([1.0, 0.0, 0.0])})
    torque = size * np.outer([3.0, 6.0, -3.0, 0.0], [0.0, 0.0, 1.0])
    return System(
        {"cart": rigid_body(1.0, np.eye(3)), "arm": arm},
        (
            prismatic("cart", axis=[1, 0, 0], name="ride", motion=(ride,)),
            revolute("arm", "cart", name="hinge", q0=[-np.pi / 2 + size], damping=np.array([0.5])),
        ),
        environment=Environment(gravity=np.array([0.0, -9.81, 0.0])),
        loads=(Load("turn", "arm", torque=torque, times=np.array([0.0, 1.0, 1.0, 2.0])),),
    )


def angle(system: System, times: np.ndarray) -> np.ndarray:
    """The angle of the pendulum from its rest, linearised."""
    model = compile_system(system)
    motion = LinearMotion().solve(model, times, model.x0)
    return model.observe(motion.times, motion.states)["q"][:, 1] + np.pi / 2


def test_pendulum_under_torque_matches_matrix_exponential():
    times = np.linspace(0, 3, 61)
    angles = angle(pendulum(0.1), times)
    y, torques = np.array([0.1, 0.0]), [(0.3, 0.3), (-0.3, 0.3), (0.0, 0.0)]
    for start, (first, slope) in enumerate(torques):
        wide = np.zeros((4, 4))
        wide[:2] = [[0.0, 1.0, 0.0, 0.0], [-9.81 / INERTIA, -0.5 / INERTIA, 1.0 / INERTIA, 0.0]]
        wide[2, 3] = 1.0
        for k in np.flatnonzero((times > start) & (times < start + 1)):
            assert angles[k] == pytest.approx((expm(wide * (times[k] - start)) @ [*y, first, slope])[0], abs=1e-8)
        y = (expm(wide) @ [*y, first, slope])[:2]


def test_moving_hinge_drives_pendulum_by_its_acceleration():
    omega, size = 2.0, 0.05
    ride = Profile(np.zeros(1), np.zeros((1, 1)), np.array([[size, omega, 0.0]]))  # size sin(omega t)
    system = replace(pendulum(0.0, ride), loads=())
    times = np.linspace(0, 4, 9)
    A = np.array([[0.0, 1.0], [-9.81 / INERTIA, -0.5 / INERTIA]])
    push = np.array([0.0, size * omega**2 / INERTIA])  # theta'' = ... - (m c / I) s'', s'' = -size omega^2 sin
    steady = np.linalg.solve(1j * omega * np.eye(2) - A, push)
    expected = [(np.imag(steady * np.exp(1j * omega * t)) - expm(A * t) @ np.imag(steady))[0] for t in times]
    assert angle(system, times) == pytest.approx(np.array(expected), abs=1e-7 * size)


def test_vertically_moving_hinge_gives_mathieus_equation():
    """I theta'' + c theta' + m e (g + s'') theta = 0; steps grow with the fifth root of the accuracy asked."""
    omega, size = 6.0, 0.1
    ride = Profile(np.zeros(1), np.zeros((1, 1)), np.array([[size, omega, 0.0]]))  # size sin(omega t)
    system = replace(pendulum(0.2, ride), loads=())
    cart = prismatic("cart", axis=[0, 1, 0], name="ride", motion=(ride,))
    model = compile_system(replace(system, joints=(cart, system.joints[1])))
    times = np.linspace(0, 3, 7)

    def rate(t, y):
        return [y[1], -(9.81 - size * omega**2 * np.sin(omega * t)) / INERTIA * y[0] - 0.5 / INERTIA * y[1]]

    expected = solve_ivp(rate, (0, 3), [0.2, 0.0], "DOP853", times, rtol=1e-12, atol=1e-14).y[0]
    counts = []
    for rtol in (1e-6, 1e-10):
        motion = LinearMotion(rtol=rtol).solve(model, times, model.x0)
        assert motion.states[:, 1] + np.pi / 2 == pytest.approx(expected, abs=300 * rtol)
        counts.append(motion.steps.accepted)
    assert counts[1] < 1.5 * 1e4 ** (1 / 5) * counts[0]


def test_difference_to_nonlinear_pendulum_is_of_third_order():
    times, errors = np.linspace(0, 2, 11), []
    for size in (0.2, 0.1, 0.05):
        model = compile_system(pendulum(size))
        full = Dop853(rtol=1e-11, atol=1e-13).solve(model, times, model.x0)
        errors.append(np.abs(full.states[:, 1] + np.pi / 2 - angle(pendulum(size), times)).max())
    assert np.diff(np.log2(errors)) == pytest.approx([-3.0, -3.0], abs=0.15)


def differences(case, times: int) -> float:
    """Largest difference of the tip's deflection between the linearised and the nonlinear run."""
    seen = []
    for linearised in (False, True):
        prepared = prepare(case, linearised=linearised)
        found = prepared.integrator.solve(prepared.model, prepared.times[:times], prepared.model.x0)
        seen.append(prepared.model.observe(found.times, found.states)["markers/beam.tip/deflection"])
    return float(np.abs(seen[0] - seen[1]).max())


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::femflex.warning.PhysicsWarning")
def test_difference_along_a_deployment_is_of_third_order():
    case = with_values(
        read_case(CASES / "orbiter_deployment.toml"),
        {
            "bodies.beam.length": {"kind": "smooth_step", "from": "15 m", "to": "18 m", "start": 0, "end": "20 s"},
        },
    )
    sizes = ([0, 0.04, 0.04], [0, 0.02, 0.02])
    errors = [differences(with_values(case, {"bodies.beam.initial.relative": size}), 11) for size in sizes]
    assert np.log2(errors[0] / errors[1]) == pytest.approx(3.0, abs=0.1)


def test_eccentric_orbit_drives_linear_pitch():
    case = with_values(read_case(CASES / "eccentric_pitch.toml"), {"run.orbits": 1, "run.samples": 21})
    prepared = prepare(case, linearised=True)
    motion = prepared.integrator.solve(prepared.model, prepared.times, prepared.model.x0)
    pitch = prepared.model.observe(motion.times, motion.states)["attitude/angles"][:, 0]
    full = prepare(case)
    solved = full.integrator.solve(full.model, full.times, full.model.x0)
    expected = full.model.observe(solved.times, solved.states)["attitude/angles"][:, 0]
    assert np.abs(pitch).max() > 0.013 and pitch == pytest.approx(expected, abs=2e-3 * np.abs(expected).max())


PENDULUM = """
title = "pendulum"
[run]
duration = "2 s"
samples = 21
[environment]
gravity = 9.81
[bodies.arm]
kind = "rigid"
mass = 1
center_of_mass = [0, 0, -0.5]
inertia = [1, 1, 1]
[[joints]]
kind = "revolute"
child = "arm"
name = "hinge"
axis = [0, 1, 0]
angle = "20 deg"
[pictures]
plots = ["q"]
linearised = true
[expect.start]
channel = "q"
component = "hinge.angle"
at = 0
value = "20 deg"
tolerance = 1e-9
source = "the start"
"""


def test_verb_writes_both_runs(tmp_path):
    path, runner = tmp_path / "arm.toml", CliRunner()
    path.write_text(PENDULUM)
    done = runner.invoke(app, ["run", str(path), "-o", str(tmp_path / "arm.h5")])
    assert done.exit_code == 0, done.stderr
    assert (tmp_path / "arm_q.png").stat().st_size > 5000
    with open_run(tmp_path / "arm.h5") as full, open_run(tmp_path / "arm_linearised.h5") as linear:
        assert linear.linearised and not full.linearised and linear.complete
        apart = np.abs(full["q"] - linear["q"]).max()
        assert 1e-4 < apart < 0.02
    done = runner.invoke(app, ["run", str(path), "--linearised", "-o", str(tmp_path / "l.h5"), "--no-pictures"])
    assert done.exit_code == 0


@pytest.mark.parametrize("orbital", [True, False])
@pytest.mark.parametrize(("rotation", "along"), [("euler_parameters", [1, 0, 0, 0]), ("intrinsic xzy", [0, 0, 0])])
def test_nominal_state_is_undeformed_along_the_orbital_frame(orbital, rotation, along):
    """Places and joints stay as they start; so do attitudes of all but the root in orbit."""
    rng = np.random.default_rng(3)
    hub = rigid_body(5.0, np.eye(3), markers={"a": Marker.at_position([0.1, 0.0, 0.0])})
    bodies = {"hub": hub, "one": random_body(rng, 2)[0], "two": random_body(rng, 3)[0]}
    turned = [0.8, 0.6, 0.0, 0.0] if len(along) == 4 else [0.4, -0.3, 0.2]
    position = [] if orbital else [1.0, 2.0, 3.0]
    root = spherical if orbital else free
    system = System(
        bodies,
        (
            root("hub", rotation=rotation, q0=[*position, *turned], u0=[9.0] * (len(position) + 3)),
            revolute("one", "hub", parent_marker="a", q0=[0.7], u0=[0.3]),
            spherical("two", "one", rotation=rotation, parent_marker="b", q0=turned, u0=[0.1, 0.2, 0.3]),
        ),
        delta0={"one": np.array([0.1, 0.2]), "two": np.array([0.3, 0.4, 0.5])},
        **({"orbit": Orbit(7e6), "frame": Frame("orbital")} if orbital else {}),
    )
    model = compile_system(system)
    q, u, _ = model.parts(nominal_state(model))
    names = [name for name, _ in system.coordinate_names()]
    elastic = [k for k, name in enumerate(names) if "delta" in name]
    assert len(elastic) == 5 and not q[elastic].any() and model.parts(model.x0)[0][elastic].all()
    expected = [*position, *(along if orbital else turned), 0.7, *turned]
    np.testing.assert_allclose(np.delete(q, elastic), expected)
    assert not np.asarray(u[len(position) + 3 :]).any() and (orbital or not u.any())
    np.testing.assert_array_equal(nominal_state(model), model.at_rest(q))


def undisturbed_pendulum(*loads: Load, ride: Profile | None = None, **more: Any) -> System:
    """An arm of 2 kg, 0.5 m to its centre of mass and 0.7 kg m^2 about its hinge, 0.1 rad off its rest."""
    arm = rigid_body(2.0, np.diag([0.1, 0.2, 0.2]), [0.5, 0, 0])
    slide = prismatic("cart", axis=[1, 0, 0], name="ride", motion=(0.0 if ride is None else ride,))
    hinge = revolute("arm", "cart", name="hinge", q0=[-np.pi / 2 + 0.1], damping=np.array([0.5]), **more)
    bodies = {"cart": rigid_body(1.0, np.eye(3)), "arm": arm}
    return System(bodies, (slide, hinge), environment=Environment(gravity=np.array([0, -9.81, 0.0])), loads=loads)


def test_pendulum_without_gravity_is_slowed_by_its_damper():
    """Without gravity the arm is slowed by its damper alone."""
    model = compile_system(undisturbed_pendulum()).without("gravity")
    x0 = model.x0.copy()
    x0[-1] = 0.2
    times = np.linspace(0, 3, 4)
    angles = LinearMotion().solve(model, times, x0).states[:, 1] + np.pi / 2
    assert angles == pytest.approx(0.1 + 0.2 * 0.7 / 0.5 * (1 - np.exp(-0.5 / 0.7 * times)), abs=1e-7)


@pytest.mark.sampled(2)
@pytest.mark.parametrize("without", [(), ("gravity_gradient",), ("gyroscopic",)])
def test_small_motion_in_orbit_without_some_terms_matches_nonlinear_motion(without: tuple[str, ...]):
    q0 = np.array([1.0, 1e-4, -2e-4, 1.5e-4]) / np.sqrt(1 + 7.25e-8)
    hub = {"hub": rigid_body(5.0, np.diag([50.0, 80.0, 45.0]))}
    joint = spherical("hub", name="attitude", q0=q0)
    model = compile_system(System(hub, (joint,), orbit=Orbit(7e6), frame=Frame("orbital"))).without(*without)
    times = np.linspace(0, 3000, 4)
    linear = LinearMotion().solve(model, times, model.x0).states
    full = Dop853(rtol=1e-11, atol=1e-13).solve(model, times, model.x0).states
    for part in (slice(1, 4), slice(4, 7)):
        moved = np.abs(full[:, part] - full[0, part]).max()
        assert moved > 1e-7 and np.abs(linear - full)[:, part].max() < 6e-3 * moved


# coordinates
