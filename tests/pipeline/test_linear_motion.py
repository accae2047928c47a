"""Linearised runs: an error of second order against the nonlinear motion, at rest, along an orbit and a deployment."""

from __future__ import annotations

from dataclasses import replace
from itertools import count
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import expm
from support.random_systems import random_body
from typer.testing import CliRunner

import femflex
from femflex.body import Marker, rigid_body
from femflex.case import CaseError, read_case, with_values
from femflex.cli.app import app
from femflex.dynamics import compile_system
from femflex.integrate import Dop853
from femflex.integrate import resume as head
from femflex.integrate.pace import BLOCK_SECONDS
from femflex.pipeline import linear_motion, prepare
from femflex.pipeline.linear_motion import (
    NODES,
    RTOL,
    LinearMotion,
    Steps,
    check,
    increment,
    nominal_state,
    parabola,
    response,
)
from femflex.results import open_run
from femflex.system import (
    Controller,
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
    arm = rigid_body(2.0, np.diag([0.1, 0.2, 0.2]), [0.5, 0, 0], {"end": Marker.rigid([1.0, 0.0, 0.0])})
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
    found = LinearMotion().solve(model, times, model.x0)
    return model.observe(found.times, found.states)["q"][:, 1] + np.pi / 2


def test_a_pendulum_under_a_torque_over_time_is_its_matrix_exponential():
    times = np.linspace(0, 3, 61)
    seen = angle(pendulum(0.1), times)
    y, torques = np.array([0.1, 0.0]), [(0.3, 0.3), (-0.3, 0.3), (0.0, 0.0)]
    for start, (first, slope) in enumerate(torques):
        wide = np.zeros((4, 4))
        wide[:2] = [[0.0, 1.0, 0.0, 0.0], [-9.81 / INERTIA, -0.5 / INERTIA, 1.0 / INERTIA, 0.0]]
        wide[2, 3] = 1.0
        for k in np.flatnonzero((times > start) & (times < start + 1)):
            assert seen[k] == pytest.approx((expm(wide * (times[k] - start)) @ [*y, first, slope])[0], abs=1e-8)
        y = (expm(wide) @ [*y, first, slope])[:2]


def test_a_hinge_that_rides_drives_the_pendulum_as_its_acceleration():
    omega, size = 2.0, 0.05
    ride = Profile(np.zeros(1), np.zeros((1, 1)), np.array([[size, omega, 0.0]]))  # size sin(omega t)
    system = replace(pendulum(0.0, ride), loads=())
    times = np.linspace(0, 4, 9)
    A = np.array([[0.0, 1.0], [-9.81 / INERTIA, -0.5 / INERTIA]])
    push = np.array([0.0, size * omega**2 / INERTIA])  # theta'' = ... - (m c / I) s'', s'' = -size omega^2 sin
    steady = np.linalg.solve(1j * omega * np.eye(2) - A, push)
    wanted = [(np.imag(steady * np.exp(1j * omega * t)) - expm(A * t) @ np.imag(steady))[0] for t in times]
    assert angle(system, times) == pytest.approx(np.array(wanted), abs=1e-7 * size)


def test_a_hinge_that_rides_up_and_down_is_mathieus_equation_to_fourth_order():
    """I theta'' + c theta' + m e (g + s'') theta = 0; steps grow with the fifth root of the accuracy asked."""
    omega, size = 6.0, 0.1
    ride = Profile(np.zeros(1), np.zeros((1, 1)), np.array([[size, omega, 0.0]]))  # size sin(omega t)
    system = replace(pendulum(0.2, ride), loads=())
    cart = prismatic("cart", axis=[0, 1, 0], name="ride", motion=(ride,))
    model = compile_system(replace(system, joints=(cart, system.joints[1])))
    times = np.linspace(0, 6, 13)

    def rate(t, y):
        return [y[1], -(9.81 - size * omega**2 * np.sin(omega * t)) / INERTIA * y[0] - 0.5 / INERTIA * y[1]]

    wanted = solve_ivp(rate, (0, 6), [0.2, 0.0], "DOP853", times, rtol=1e-12, atol=1e-14).y[0]
    counts = []
    for rtol in (1e-6, 1e-10):
        found = LinearMotion(rtol=rtol).solve(model, times, model.x0)
        assert found.states[:, 1] + np.pi / 2 == pytest.approx(wanted, abs=300 * rtol)
        counts.append(found.steps.accepted)
    assert counts[1] < 1.5 * 1e4 ** (1 / 5) * counts[0]


def test_linear_and_nonlinear_runs_differ_at_third_order_of_a_symmetric_pendulum():
    times, errors = np.linspace(0, 2, 11), []
    for size in (0.2, 0.1, 0.05):
        model = compile_system(pendulum(size))
        full = Dop853(rtol=1e-11, atol=1e-13).solve(model, times, model.x0)
        errors.append(np.abs(full.states[:, 1] + np.pi / 2 - angle(pendulum(size), times)).max())
    assert np.diff(np.log2(errors)) == pytest.approx([-3.0, -3.0], abs=0.15)


def test_increments_lead_from_one_attitude_to_another():
    case = with_values(read_case(CASES / "eccentric_pitch.toml"), {"attitude.angles": ["30 deg", "-50 deg", "70 deg"]})
    model = femflex.compile_system(femflex.build_system(case))
    q = model.parts(model.x0)[0]
    other = q[0].copy() * 0 + np.concatenate([q[:-4], [1.0, 0.0, 0.0, 0.0]])
    step = increment(model, q, other)
    from femflex.dynamics.equilibria.increments import advanced

    assert advanced(model, q, step) == pytest.approx(other, abs=1e-12)
    assert np.abs(step).max() > 0.5


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
def test_along_a_deployment_the_difference_falls_with_the_cube_of_the_deflection_of_a_symmetric_beam():
    case = with_values(
        read_case(CASES / "orbiter_deployment.toml"),
        {
            "bodies.beam.length": {"kind": "smooth_step", "from": "15 m", "to": "18 m", "start": 0, "end": "20 s"},
        },
    )
    sizes = ([0, 0.04, 0.04], [0, 0.02, 0.02])
    errors = [differences(with_values(case, {"bodies.beam.initial.relative": size}), 11) for size in sizes]
    assert np.log2(errors[0] / errors[1]) == pytest.approx(3.0, abs=0.1)


def test_an_eccentric_orbit_drives_the_linear_pitch_as_the_nonlinear_one():
    case = with_values(read_case(CASES / "eccentric_pitch.toml"), {"run.orbits": 1, "run.samples": 21})
    prepared = prepare(case, linearised=True)
    found = prepared.integrator.solve(prepared.model, prepared.times, prepared.model.x0)
    pitch = prepared.model.observe(found.times, found.states)["attitude/angles"][:, 0]
    full = prepare(case)
    solved = full.integrator.solve(full.model, full.times, full.model.x0)
    wanted = full.model.observe(solved.times, solved.states)["attitude/angles"][:, 0]
    assert np.abs(pitch).max() > 0.013 and pitch == pytest.approx(wanted, abs=2e-3 * np.abs(wanted).max())


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


def test_the_verb_leaves_both_runs_and_lays_them_over_each_other(tmp_path):
    path, runner = tmp_path / "arm.toml", CliRunner()
    path.write_text(PENDULUM)
    done = runner.invoke(app, ["run", str(path), "-o", str(tmp_path / "arm.h5")])
    assert done.exit_code == 0, done.stderr
    assert "compared    linearised: " in done.stdout and (tmp_path / "arm_q.png").stat().st_size > 5000
    with open_run(tmp_path / "arm.h5") as full, open_run(tmp_path / "arm_linearised.h5") as linear:
        assert linear.linearised and not full.linearised and linear.complete
        apart = np.abs(full["q"] - linear["q"]).max()
        assert 1e-4 < apart < 0.02
    done = runner.invoke(app, ["run", str(path), "--linearised", "-o", str(tmp_path / "l.h5"), "--no-pictures"])
    assert done.exit_code == 0 and "linear equations about the equilibrium" in done.stdout
    done = runner.invoke(app, ["run", str(path), "--linearised", "--resume", "-o", str(tmp_path / "arm_linearised.h5")])
    assert done.exit_code == 2 or "complete already" in done.stdout


class KnownError(Steps):
    """Steps of y' = 0 with an error of C h^5 each, whose halves differ from the whole by 15/16 of it."""

    C = 16 * RTOL  # the estimate, a fifteenth of the difference, is the tolerance at h = 1

    def _step(self, y, t, h):
        return y + self.C * h**5


def test_steps_keep_to_their_error_and_go_on_after_short_ones():
    """At h the error is h^5 tolerances: 10, 2.5 and then 0.8 at first."""
    resume = np.zeros(head.HEAD)
    resume[head.SMALLEST] = np.inf
    steps = KnownError(SimpleNamespace(sizes=np.ones(1)), RTOL, resume, np.array([0.0, 100.0]))

    def counts():
        return [resume[k] for k in (head.ACCEPTED, head.REJECTED, head.SMALLEST, head.LARGEST)]

    y = steps.moved(np.ones(1), 0.0, 10.0)  # twelve steps of 0.8, and 0.4 that are left, are no reason for less
    assert counts() == pytest.approx([13, 2, 0.4, 0.8], rel=1e-4) and steps.h == pytest.approx(0.8, rel=1e-4)
    assert y - 1 == pytest.approx([(12 * 0.8**5 + 0.4**5) * KnownError.C / 16], rel=1e-4)
    y = steps.moved(y, 10.0, 10.1)
    assert counts() == pytest.approx([14, 2, 0.1, 0.8], rel=1e-4) and steps.h == pytest.approx(0.8, rel=1e-4)
    steps.moved(y, 10.1, 10.9)  # one step, though rounding leaves a little
    assert counts() == pytest.approx([15, 2, 0.1, 0.8], rel=1e-4) and steps.h == pytest.approx(0.8, rel=1e-4)
    steps.C = 0.0  # steps grow four times each
    steps.moved(y, 10.9, 30.0)
    assert counts() == pytest.approx([19, 2, 0.1, 12.8], rel=1e-4) and steps.h == pytest.approx(51.2, rel=1e-4)


def test_a_step_of_a_thousand_millionth_is_taken_whatever_its_error():
    resume = np.zeros(head.HEAD)
    resume[head.SMALLEST] = np.inf
    steps = KnownError(SimpleNamespace(sizes=np.ones(1)), RTOL, resume, np.array([0.0, 1.0]))
    calls = []

    def moved(y, t, h):
        calls.append(h)
        return y + (t == 5.0 and len(calls) % 3 == 1)  # at the start the whole is never what its halves are

    steps._step = moved
    assert steps.moved(np.zeros(1), 5.0, 6.0) == 0.0
    assert resume[head.REJECTED] == 15 and min(calls[::3][:16]) == pytest.approx(0.25**15, rel=1e-12)
    assert resume[head.ACCEPTED] == len(calls) / 3 - 15


@pytest.mark.parametrize(("seconds", "rows"), [(0.0, [7, 7, 1]), (0.4 * BLOCK_SECONDS, [3, 3, 2])])
def test_blocks_are_full_or_take_their_time_and_end_where_their_rows_do(monkeypatch, seconds, rows):
    """seconds: that a row takes, by a clock that is looked at after every one, and once at the start of a block."""
    clock = count()
    monkeypatch.setattr(linear_motion, "ROWS", 7)
    monkeypatch.setattr(linear_motion, "perf_counter", lambda: seconds * next(clock))
    model, times = compile_system(pendulum(0.1)), np.linspace(0.0, 1e-3, sum(rows))
    blocks = list(LinearMotion().blocks(model, times, model.x0))
    assert [len(block.times) for block in blocks] == rows
    np.testing.assert_array_equal(np.concatenate([block.times for block in blocks]), times)
    for block in blocks:
        assert block.t == block.times[-1] == block.resume[head.LAST_OUT]
        np.testing.assert_array_equal(block.resume[head.HEAD :], block.states[-1])


def test_response_and_parabola_are_the_exact_solution_under_a_load_of_second_degree():
    """x' = A x + c_0 + c_1 s + c_2 s^2 / 2, x = -(p_0 + p_1 s + p_2 s^2) + exp(A s) p_0, with p by coefficients."""
    rng = np.random.default_rng(2)
    A, h, x = rng.normal(size=(3, 3)), 0.7, rng.normal(size=3)
    c = rng.normal(size=(3, 3))
    values = [c[0] + c[1] * s + c[2] * s**2 / 2 for s in h / 2 * (1 + NODES)]
    found = parabola(values, h)
    np.testing.assert_allclose(found, c, atol=1e-13)
    E, P = response(A, h)
    p2 = -np.linalg.solve(A, c[2] / 2)
    p1 = np.linalg.solve(A, 2 * p2 - c[1])
    p0 = np.linalg.solve(A, p1 - c[0])
    wanted = expm(A * h) @ (x - p0) + p0 + p1 * h + p2 * h**2
    np.testing.assert_allclose(E @ x + P @ np.concatenate(found), wanted, atol=1e-12)


@pytest.mark.parametrize("orbital", [True, False])
@pytest.mark.parametrize(("rotation", "along"), [("euler_parameters", [1, 0, 0, 0]), ("intrinsic xzy", [0, 0, 0])])
def test_the_nominal_state_is_undeformed_and_at_rest_along_the_orbital_frame(orbital, rotation, along):
    """Places and joints stay as they start; so do attitudes of all but the root in orbit."""
    rng = np.random.default_rng(3)
    hub = rigid_body(5.0, np.eye(3), markers={"a": Marker.rigid([0.1, 0.0, 0.0])})
    bodies = {"hub": hub, "one": random_body(rng, 2)[0], "two": random_body(rng, 3)[0]}
    turned = [0.8, 0.6, 0.0, 0.0] if len(along) == 4 else [0.4, -0.3, 0.2]
    place = [] if orbital else [1.0, 2.0, 3.0]
    root = spherical if orbital else free
    system = System(
        bodies,
        (
            root("hub", rotation=rotation, q0=[*place, *turned], u0=[9.0] * (len(place) + 3)),
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
    wanted = [*place, *(along if orbital else turned), 0.7, *turned]
    np.testing.assert_allclose(np.delete(q, elastic), wanted)
    assert not np.asarray(u[len(place) + 3 :]).any() and (orbital or not u.any())
    np.testing.assert_array_equal(nominal_state(model), model.at_rest(q))


@pytest.mark.parametrize("loops", [(), ("closing",)])
@pytest.mark.parametrize("moves", [False, True])
@pytest.mark.parametrize("latches", [(), ("latch",)])
def test_loops_with_moving_joints_and_latches_have_no_linear_motion(loops, moves, latches):
    still = SimpleNamespace(latches=(), held={0: SimpleNamespace(moves=False)})
    joint = SimpleNamespace(latches=latches, held={0: SimpleNamespace(moves=False), 2: SimpleNamespace(moves=moves)})
    system = SimpleNamespace(constraints=(), controllers=(), loops=loops, joints=(still, joint))
    if not latches and not (loops and moves):
        return check(system)
    said = "a joint latches during the run" if latches else "with loops a linearised run needs prescribed joints that"
    with pytest.raises(ValueError, match=said):
        check(system)


def test_what_has_no_linear_motion_is_refused(tmp_path):
    law = Controller("law", lambda t, seen, memory: (np.zeros(1), memory), 0.1, (), {"torque": "N m"})
    model = compile_system(replace(pendulum(0.1), effectors=(law,)))
    with pytest.raises(ValueError, match="controller 'law' is sampled, and a linearised run is continuous"):
        LinearMotion().blocks(model, np.linspace(0, 1, 3), model.x0).__next__()
    about = (compile_system(pendulum(0.1)), np.linspace(0, 1, 3))
    state = next(LinearMotion().blocks(*about, about[0].x0)).resume
    for method in (LinearMotion().blocks, LinearMotion().solve):
        with pytest.raises(ValueError, match="a linearised run is not resumed"):
            method(*about, x0=about[0].x0, state=state)
    with pytest.raises(ValueError, match="a linearised motion is that of a compiled femflex system"):
        LinearMotion().solve(object(), about[1], about[0].x0)
    with pytest.raises(ValueError, match="a linearised run is not resumed"):
        prepare(CASES / "eccentric_pitch.toml", tmp_path / "x.h5", resume=True, linearised=True)
    (tmp_path / "arm.toml").write_text(
        PENDULUM.replace("linearised = true", 'linearised = true\nwithout = ["gravity"]')
    )
    with pytest.raises(CaseError, match="found without and linearised; the plots hold one second run"):
        read_case(tmp_path / "arm.toml")
