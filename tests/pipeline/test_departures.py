"""Departures of linearised runs: scaled coordinates, steps that are counted, references with terms left out."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.linalg import expm

from femflex.body import rigid_body
from femflex.dynamics import compile_system
from femflex.integrate import Dop853
from femflex.integrate import resume as head
from femflex.pipeline.linear_motion import LinearMotion, Reference, Steps, increment, nominal_state, tabulated
from femflex.system import (
    Environment,
    Frame,
    Latch,
    Load,
    Orbit,
    Profile,
    System,
    free,
    prismatic,
    revolute,
    spherical,
)

SIZES = np.array([1.0, 1024.0, 1.0 / 256.0])  # powers of two: rounding is the same
A0 = np.array([[0.1, 1.0, 0.0], [-2.0, -0.3, 0.4], [0.5, 0.2, -0.6]])


class Equations:
    """Linear equations in coordinates of the sizes s: y' = S A(t) S^-1 y + S b(t)."""

    def __init__(self, sizes: np.ndarray, quick: float = 6.0, constant: bool = False) -> None:
        self.sizes, self.quick, self.constant, self.asked = sizes, quick, constant, 0

    def matrix(self, t: float) -> np.ndarray:
        self.asked += 1
        turning = np.array([[0, 0, np.sin(self.quick * t)], [np.cos(2 * t), 0, 0], [0, t, 0.0]])
        return self.sizes[:, None] * (A0 + (0.0 if self.constant else 1.0) * turning) / self.sizes

    def forcing(self, t: float) -> np.ndarray:
        return self.sizes * np.array([t**2, 1.0 - t, 2.0])


def test_a_table_is_as_fine_in_coordinates_of_any_size():
    """The error of each row is held against its largest entry in usual sizes."""
    one, other = Equations(np.ones(3)), Equations(SIZES)
    plain, scaled = tabulated(one, 0.5, 2.5), tabulated(other, 0.5, 2.5)  # type: ignore[arg-type]
    assert len(plain.x) == len(scaled.x) and one.asked == other.asked == len(plain.x)
    assert 9 < len(plain.x) < 600 and (len(plain.x) - 1) & (len(plain.x) - 2) == 0
    t = np.linspace(0.5, 2.5, 301)
    exact = np.array([one.matrix(each) for each in t])
    assert np.abs(plain(t) - exact).max() < 1e-5
    np.testing.assert_allclose(scaled(t) / SIZES[:, None] * SIZES, plain(t), atol=1e-9)
    assert len(tabulated(Equations(SIZES, quick=0.5), 0.5, 2.5).x) < len(plain.x)  # type: ignore[arg-type]


@pytest.mark.parametrize("constant", [True, False])
def test_steps_are_the_same_in_coordinates_of_any_size(constant: bool):
    found = []
    for sizes in (np.ones(3), SIZES):
        about: Any = Equations(sizes, constant=constant)
        resume = np.zeros(60)
        resume[head.SMALLEST] = np.inf
        steps = Steps(about, 1e-9, resume, np.array([0.0, 2.0]))
        y = steps.moved(sizes * np.array([0.2, -0.4, 0.9]), 0.0, 2.0)
        found.append((y / sizes, *(resume[k] for k in (head.ACCEPTED, head.REJECTED, head.EVALUATIONS))))
        assert resume[head.EVALUATIONS] == 9 * (resume[head.ACCEPTED] + resume[head.REJECTED])
        assert 0 < resume[head.SMALLEST] <= resume[head.LARGEST] <= 2.0
        assert resume[head.SMALLEST] * resume[head.ACCEPTED] <= 2.0 <= resume[head.LARGEST] * resume[head.ACCEPTED]
    np.testing.assert_allclose(found[0][0], found[1][0], rtol=1e-8)
    assert abs(found[0][1] - found[1][1]) <= 1 and abs(found[0][2] - found[1][2]) <= 1
    if constant:  # forces of second degree in time: one step is exact
        assert found[0][1:] == found[1][1:] == (1, 0, 9)
        wide = np.zeros((6, 6))  # y, and (t^2, t, 1) that drive it
        wide[:3, :3], wide[0, 3], wide[1, 5], wide[1, 4], wide[2, 5] = A0, 1.0, 1.0, -1.0, 2.0
        wide[3, 4], wide[4, 5] = 2.0, 1.0
        np.testing.assert_allclose(found[0][0], (expm(2 * wide) @ [0.2, -0.4, 0.9, 0, 0, 1])[:3], rtol=1e-10)
    else:
        assert found[0][1] > 3


def pendulum(*loads: Load, ride: Profile | None = None, **more: Any) -> System:
    """An arm of 2 kg, 0.5 m to its centre of mass and 0.7 kg m^2 about its hinge, 0.1 rad off its rest."""
    arm = rigid_body(2.0, np.diag([0.1, 0.2, 0.2]), [0.5, 0, 0])
    slide = prismatic("cart", axis=[1, 0, 0], name="ride", motion=(0.0 if ride is None else ride,))
    hinge = revolute("arm", "cart", name="hinge", q0=[-np.pi / 2 + 0.1], damping=np.array([0.5]), **more)
    bodies = {"cart": rigid_body(1.0, np.eye(3)), "arm": arm}
    return System(bodies, (slide, hinge), environment=Environment(gravity=np.array([0, -9.81, 0.0])), loads=loads)


def test_what_is_left_out_of_a_model_is_left_out_of_its_tangent():
    """Without gravity the arm is slowed by its damper alone."""
    model = compile_system(pendulum()).without("gravity")
    x0 = model.x0.copy()
    x0[-1] = 0.2
    times = np.linspace(0, 3, 4)
    seen = LinearMotion().solve(model, times, x0).states[:, 1] + np.pi / 2
    assert seen == pytest.approx(0.1 + 0.2 * 0.7 / 0.5 * (1 - np.exp(-0.5 / 0.7 * times)), abs=1e-7)


@pytest.mark.parametrize("without", [(), ("gravity_gradient",), ("gyroscopic",)])
def test_small_motion_in_orbit_is_that_of_the_model_with_what_is_left_out_of_it(without: tuple[str, ...]):
    q0 = np.array([1.0, 1e-4, -2e-4, 1.5e-4]) / np.sqrt(1 + 7.25e-8)
    hub = {"hub": rigid_body(5.0, np.diag([50.0, 80.0, 45.0]))}
    joint = spherical("hub", name="attitude", q0=q0)
    model = compile_system(System(hub, (joint,), orbit=Orbit(7e6), frame=Frame("orbital"))).without(*without)
    times = np.linspace(0, 3000, 4)
    found = LinearMotion().solve(model, times, model.x0).states
    full = Dop853(rtol=1e-11, atol=1e-13).solve(model, times, model.x0).states
    for part in (slice(1, 4), slice(4, 7)):
        moved = np.abs(full[:, part] - full[0, part]).max()
        assert moved > 1e-7 and np.abs(found - full)[:, part].max() < 6e-3 * moved


def test_a_joint_that_latches_and_what_is_no_model_have_no_linear_motion():
    times = np.linspace(0, 1, 3)
    with pytest.raises(ValueError) as caught:
        model = compile_system(pendulum(latches=(Latch(0, at=0.3),)))
        LinearMotion().solve(model, times, model.x0)
    assert str(caught.value) == (
        "a joint latches during the run, so there is no linearised run; lock it, or leave it free"
    )
    model = compile_system(pendulum())
    with pytest.raises(ValueError, match="a linearised run is not resumed; run it anew"):
        next(LinearMotion().blocks(model, times, model.x0, state=np.zeros(9)))
    with pytest.raises(ValueError, match="a linearised motion is that of a compiled femflex system"):
        next(LinearMotion().blocks(SimpleNamespace(n_x=4), times, model.x0))  # type: ignore[arg-type]
    assert (LinearMotion().name, LinearMotion().order) == ("linearised", 4)


def test_blocks_hold_their_times_and_count_the_steps_that_led_to_them():
    model = compile_system(
        pendulum(Load("turn", "arm", torque=np.outer([0, 1.0], [0, 0, 1]), times=np.array([0.2, 0.7])))
    )
    times = np.linspace(0.0, 1.0, 3)
    (block,) = LinearMotion().blocks(model, times, model.x0)
    assert block.times.tolist() == times.tolist() and block.states.shape == (3, 4) and block.t == 1.0
    assert block.resume[head.METHOD] == 20 and block.resume[head.N_X] == 4
    assert block.resume[head.LAST_OUT] == 1.0 and np.array_equal(block.resume[head.HEAD :], block.states[-1])
    assert block.resume[head.ACCEPTED] == 4  # 0, 0.2, 0.5, 0.7, 1.0: exact in between, without a step
    assert block.resume[head.SMALLEST] == pytest.approx(0.2) and block.resume[head.LARGEST] == pytest.approx(0.3)


# coordinates


def test_increments_take_the_short_way_round():
    """Quaternions of either sign are one attitude, and angles count modulo 2 pi."""
    system = System(
        {"hub": rigid_body(1.0, np.eye(3)), "arm": rigid_body(1.0, np.eye(3))},
        (free("hub", name="float"), revolute("arm", "hub", name="hinge")),
    )
    model = compile_system(system)
    names = [name for name, _ in system.coordinate_names()]
    first = next(int(k) for k in model.renormalise)
    q = model.parts(model.x0)[0].copy()
    half = 0.3
    p = q.copy()
    p[first : first + 4] = [np.cos(half), 0.0, np.sin(half) * 0.6, np.sin(half) * 0.8]
    p[names.index("hinge.angle")] = 0.4
    found = increment(model, q, p)
    assert np.linalg.norm(found[3:6]) == pytest.approx(2 * half) and found[-1] == pytest.approx(0.4)
    assert found[3:6] == pytest.approx(2 * half * np.array([0.0, 0.6, 0.8]), abs=1e-9)
    other = p.copy()
    other[first : first + 4] *= -1
    other[names.index("hinge.angle")] += 6 * np.pi
    np.testing.assert_allclose(increment(model, q, other), found, atol=1e-9)


@pytest.mark.parametrize("frame", ["orbital", "inertial"])
def test_a_craft_in_orbit_departs_from_the_axes_of_its_orbital_frame(frame: str):
    """Other joints, and the root in other frames, stay as they start."""
    q0 = np.array([np.cos(0.2), np.sin(0.2), 0.0, 0.0])
    hinge = revolute("arm", "hub", name="hinge", q0=[0.7], u0=[2.0], stiffness=[0.1], rest=[0.7])
    system = System(
        {"hub": rigid_body(5.0, np.diag([4.0, 5.0, 2.0])), "arm": rigid_body(1.0, np.eye(3))},
        (spherical("hub", name="attitude", q0=q0), hinge),
        orbit=Orbit(7e6),
        frame=Frame(frame),
    )
    model = compile_system(system)
    q, u, _ = model.parts(nominal_state(model))
    assert q == pytest.approx([*([1.0, 0, 0, 0] if frame == "orbital" else q0), 0.7])
    assert u[3] == pytest.approx(0.0)
    about = Reference.of(compile_system(replace(system, joints=(system.joints[0], replace(hinge, q0=np.array([0.7]))))))
    assert about.constant is (frame == "orbital")
