"""The same rigid craft with wheels and thrusters in Basilisk: answers, and process CPU seconds at equal error."""

import time

import numpy as np
import pytest
from support.basilisk_craft import DURATION, basilisk_hinged_run, basilisk_run, femflex_model, hinged_model

from femflex.integrate import Dop853

ENDS = np.array([0.0, DURATION])
AGREED = 1e-9  # relative
STEPS = (0.125, 0.0625)  # s, of timed runs in Basilisk; powers of two: its switching times are on its grid exactly


def femflex_run(model, rtol):
    """CPU seconds, Euler parameters at the end, wheel speeds at the end."""
    begin = time.process_time()
    solution = Dop853(rtol=rtol, atol=rtol).solve(model, ENDS, model.x0)
    spent = time.process_time() - begin
    channels = model.observe(ENDS, solution.states)
    speeds = np.array([channels[f"effectors/wheel{k}/speed"][-1] for k in range(3)])
    return spent, channels["bodies/hub/attitude"][-1], speeds


def relative_difference(a, b):
    """Relative difference of (Euler parameters, speeds), the sign of the parameters aside."""
    attitude_difference = min(np.abs(a[0] - b[0]).max(), np.abs(a[0] + b[0]).max())
    return max(attitude_difference, np.abs(a[1] / b[1] - 1.0).max())


def test_attitude_and_wheel_speeds_after_600_s_are_those_of_basilisk():
    pytest.importorskip("Basilisk")
    runs = [basilisk_run(step)[1:] for step in (0.0625, 0.03125)]
    assert relative_difference(*runs) < 1e-7  # its own convergence, of order 4: the finer one is 15 times nearer
    converged = [b + (b - a) / 15.0 for a, b in zip(*runs, strict=True)]  # Richardson
    assert relative_difference(femflex_run(femflex_model(), 1e-12)[1:], converged) < AGREED


def test_attitude_and_angles_of_hinged_panels_after_600_s_are_those_of_basilisk():
    pytest.importorskip("Basilisk")
    runs = [basilisk_hinged_run(step) for step in (0.0625, 0.03125)]
    converged = [b + (b - a) / 15.0 for a, b in zip(*runs, strict=True)]
    model = hinged_model()
    solution = Dop853(rtol=1e-12, atol=1e-12).solve(model, ENDS, model.x0)
    channels = model.observe(ENDS, solution.states)
    attitude = channels["bodies/hub/attitude"][-1]
    assert min(np.abs(attitude - converged[0]).max(), np.abs(attitude + converged[0]).max()) < AGREED
    names = [name for name, _ in model.system.coordinate_names()]
    angles = channels["q"][-1, [names.index("hinge0.angle"), names.index("hinge1.angle")]]
    assert angles == pytest.approx(converged[1], abs=AGREED)  # of radians, against a start at 0.1


@pytest.mark.benchmark
@pytest.mark.parametrize("step", STEPS)
def test_femflex_is_twenty_times_faster_than_basilisk_at_equal_error(step):
    pytest.importorskip("Basilisk")
    model = femflex_model()
    exact = femflex_run(model, 1e-13)[1:]
    error = relative_difference(basilisk_run(step)[1:], exact)
    rtol = next(
        r
        for r in 10.0 ** np.arange(-6.0, -12.0, -0.25)
        if relative_difference(femflex_run(model, r)[1:], exact) < error
    )
    ratios = [basilisk_run(step)[0] / femflex_run(model, rtol)[0] for _ in range(9)]
    print(f"\nBasilisk RK4 / femflex = {np.median(ratios):.1f} at an error of {error:.1e} (rtol {rtol:g})")
    assert np.median(ratios) >= 20
