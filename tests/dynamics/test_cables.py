"""Cables of one tension: bodies that fly apart, are caught and rebound; with a length that is let out."""

from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from femflex import run
from femflex.body import rigid_body
from femflex.case import CaseError, parse_case
from femflex.cli.run_report import cable_lines
from femflex.dynamics import compile_system
from femflex.integrate import Dop853
from femflex.pipeline.decisions import build_system
from femflex.system import Profile, System, cable, free

A, B, EA = 3.0, 2.0, 40.0
REDUCED = A * B / (A + B)


def pair(length, damping=0.0, speed=0.5, turning=0.0):
    """Two bodies 1 m apart on the x axis that fly apart."""
    bodies = {"a": rigid_body(A, np.eye(3)), "b": rigid_body(B, np.eye(3))}
    joints = (
        free("a", q0=[0, 0, 0, 1, 0, 0, 0], u0=np.zeros(6)),
        free("b", q0=[1, 0, 0, 1, 0, 0, 0], u0=[speed, turning, 0, 0, 0, 0]),
    )
    line = cable("line", (("a", "origin"), ("b", "origin")), length, EA, damping)
    return compile_system(System(bodies, joints, effectors=(line,)))


def moved(model, times):
    states = Dop853(rtol=1e-11, atol=1e-12).solve(model, times, model.x0).states
    return model.observe(times, states)


def test_bodies_that_fly_apart_are_caught_and_rebound():
    """Slack until d = L, then half a period of sqrt(EA / L / m), then apart at minus their speed, slack again."""
    length, speed = 1.4, 0.5
    caught, omega = (length - 1.0) / speed, np.sqrt(EA / length / REDUCED)
    away = caught + np.pi / omega
    times = np.concatenate([np.linspace(0, caught, 4), np.linspace(caught, away, 7)[1:], [away + 0.3]])
    seen = moved(pair(length), times)
    stretch = np.where((times > caught) & (times < away), speed / omega * np.sin(omega * (times - caught)), 0.0)
    d = np.where(times < away, np.minimum(1.0 + speed * times, length) + stretch, length - speed * (times - away))
    assert seen["effectors/line/distance"] == pytest.approx(d, abs=1e-7)
    assert seen["effectors/line/tension"] == pytest.approx(EA / length * stretch, abs=1e-5)
    assert seen["effectors/line/tension"][-1] == 0.0 and seen["effectors/line/tension"].max() > 1.0
    p = seen["monitors/momentum"]
    assert np.abs(p - p[0]).max() < 1e-12


def test_a_cable_that_is_let_out_follows_its_equation_and_balances_its_energy():
    """m d'' = -N(d, d', L, L') + H^2 / (m d^3) for the distance, with the damping that never pushes."""
    length, damping, turning = Profile.smooth_step(0.0, 3.0, 1.1, 2.0), 1.5, 0.3
    times = np.linspace(0.0, 4.0, 8001)
    seen = moved(pair(length, damping, turning=turning), times)
    H = REDUCED * 1.0 * turning

    def equation(t, x):
        d, v = x
        L, U, _ = (float(value) for value in length(t))
        N = max(0.0, EA * (d - L) / L + damping * (v - U)) if d > L else 0.0
        return [v, (H**2 / (REDUCED * d**3) - N) / REDUCED]

    exact = solve_ivp(equation, (0, 4), [1.0, 0.5], t_eval=times, rtol=1e-10, atol=1e-12, max_step=1e-3).y[0]
    assert seen["effectors/line/distance"] == pytest.approx(exact, abs=1e-6)
    slack = seen["effectors/line/tension"] == 0.0
    assert slack[0] and 0.1 < slack.mean() < 0.9
    power = seen["effectors/line/supplied"] - seen["effectors/line/dissipation"]
    work = np.concatenate([[0.0], np.cumsum((power[1:] + power[:-1]) / 2 * np.diff(times))])
    stored = seen["monitors/energy"] - work
    assert np.abs(stored - stored[0]).max() < 2e-3 * np.abs(work).max()


CASE = """
title = "subsatellite on a slack line"
source = "two bodies that fly apart"
[run]
duration = "2 s"
output_step = "0.1 s"
[bodies.a]
kind = "rigid"
mass = 3
inertia = [1, 1, 1]
[bodies.b]
kind = "rigid"
mass = 2
inertia = [1, 1, 1]
[[joints]]
kind = "free"
child = "a"
[[joints]]
kind = "free"
child = "b"
position = [1, 0, 0]
velocity = [0.5, 0, 0]
[cables.line]
body = "b"
parent = "a"
length = LENGTH
EA = "40 N"
damping = 0.2
"""


def test_a_case_says_a_cable_and_the_run_reports_where_it_is_slack(tmp_path):
    profile = '{ kind = "smooth_step", from = 1.4, to = 1.6, start = 0, end = 1 }'
    (made,) = build_system(case := parse_case(CASE.replace("LENGTH", profile), Path("c.toml"))).effectors
    own = cable("line", (("a", "origin"), ("b", "origin")), Profile.smooth_step(0, 1, 1.4, 1.6), EA, 0.2)
    assert made.markers == own.markers and np.array_equal(made.parameters, own.parameters)
    with run(case, tmp_path / "c.h5") as done:
        (line,) = cable_lines(done)
        slack = (done["effectors/line/tension"] == 0.0).mean()
        assert line.startswith(f"cable       line was slack in {slack:.0%} of the rows, first at t = 0 s")


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        (CASE.replace("LENGTH", "0"), r"cables\.line: the length of cable 'line' comes to 0 m; it must stay positive"),
        (CASE.replace("LENGTH", "1").replace('"40 N"', "0"), r"cables\.line\.EA"),
        (
            CASE.replace("LENGTH", "1").replace('parent = "a"', 'parent = "c"'),
            r"cables\.line\.parent: found 'c'",
        ),
        (CASE.replace("LENGTH", '"locked"'), r"cables\.line.*locked"),
    ],
)
def test_what_is_wrong_with_a_cable_is_said(text, sentence):
    with pytest.raises(CaseError, match=sentence):
        build_system(parse_case(text, Path("c.toml")))
