"""The central attraction of members of many kilometres that deploy, against integrals of -mu R/|R|^3 along them."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from support.members import solved

from femflex.body import rigid_body
from femflex.deployment import DeployingLine, Reel, StringFunctions, deploying_line
from femflex.dynamics import compile_system
from femflex.system import Environment, Frame, Orbit, Profile, System, free, revolute, weld
from femflex.system.attraction import is_integrated

RADIUS, MASS, TIP = 6.8e6, 0.005, 500.0
nodes, weights = np.polynomial.legendre.leggauss(24)
XI, W = (nodes + 1) / 2, weights / 2


def tether(length, attraction="auto", **more):
    """A tether from a point on a circular orbit along the local vertical, turning in the plane, with a tip body."""
    made = deploying_line(DeployingLine(mass_per_length=MASS, direction=(0, 1, 0)), None, length, stock=25e3,
                          until=4000.0)  # fmt: skip
    bodies = {"craft": rigid_body(1e13, 1e15 * np.eye(3)), "tether": made.body, "sub": rigid_body(TIP, np.eye(3))}
    joints = (weld("craft"), revolute("tether", "craft", axis=(1, 0, 0)), weld("sub", "tether", parent_marker="tip"))
    return System(bodies, joints, varying={"tether": made.variation}, orbit=Orbit(RADIUS), frame=Frame("orbital"),
                  environment=Environment(attraction=attraction), **more)  # fmt: skip


def pulls(L, a):
    """Integrals over the tether at the angle a of the attraction less that at O: along it, and times the distance
    across it."""
    mu, e, across = Orbit(RADIUS).mu, np.array([np.cos(a), np.sin(a)]), np.array([-np.sin(a), np.cos(a)])
    s, dm = np.append(L * XI, L), np.append(MASS * L * W, TIP)
    R = np.array([RADIUS, 0.0]) + s[:, None] * e
    field = -mu * R / np.linalg.norm(R, axis=1)[:, None] ** 3 + np.array([mu / RADIUS**2, 0.0])
    return dm @ (field @ e), (dm * s) @ (field @ across)


def moving(t, x, acceleration):
    """Rates of length, its rate, pitch angle and its rate, in the plane of a circular orbit."""
    L, U, a, w = x
    spin = w + Orbit(RADIUS).mean_motion
    S, J = MASS * L**2 / 2 + TIP * L, MASS * L**3 / 3 + TIP * L**2
    along, across = pulls(L, a)
    A = acceleration(t, L, U, S * spin**2 + along)
    return [U, A, w, (-2 * S * U * spin + across) / J]


def solved_alone(times, start, acceleration):
    options = {"rtol": 1e-11, "atol": 1e-13, "max_step": 20.0}
    return solve_ivp(moving, (0, times[-1]), start, t_eval=times, args=(acceleration,), **options).y


@pytest.mark.slow
def test_long_tether_swings_under_exact_attraction():
    """Specified length from 10 km on at 3 m/s: the pitch angle, 1e-8 of it; the gradient alone is off by 1e-3."""
    times = np.linspace(0.0, 1500.0, 4)
    length = Profile.polynomial(1e4, 3.0)
    exact = solved_alone(times, [1e4, 3.0, 0.0, 0.0], lambda t, L, U, pull: 0.0)[2]
    found = solved(tether(length), times)[1][:, 0]
    assert np.abs(found) == pytest.approx(np.abs(exact), rel=1e-7, abs=1e-10)
    linear = solved(tether(length, "gradient"), times)[1][:, 0]
    assert abs(linear[-1]) != pytest.approx(abs(exact[-1]), rel=3e-4)


@pytest.mark.sampled(1)
@pytest.mark.parametrize("reel", [None, Reel("reel", 1e4, 3.0, tension=18.0, damping=0.5)], ids=["profile", "reel"])
def test_slack_swing_matches_integrals_along_tether(reel):
    """Accelerations of pitch and of a free length, and the potential -mu/|R| of the tether and its tip body past O."""
    if reel is None:
        model = compile_system(tether(Profile.polynomial(1e4, 3.0)))
    else:
        model = compile_system(tether(reel, effectors=(reel.effector(25e3),)))
    x = model.x0.copy()
    x[:2] = 0.3, -1e-3

    def acceleration(t, L, U, pull):
        return 0.0 if reel is None else (pull - 18.0 - 0.5 * U - MASS * U * U) / (MASS * L + TIP)

    U, A, w, pitched = moving(0.0, [1e4, 3.0, 0.3, -1e-3], acceleration)
    assert model.state_rate(0.0, x) == pytest.approx([w, pitched] + [U, A] * (reel is not None), rel=1e-9)
    seen = {key: value[0] for key, value in model.observe(np.zeros(1), x[None]).items()}
    mu, s, dm = Orbit(RADIUS).mu, np.append(1e4 * XI, 1e4), np.append(MASS * 1e4 * W, TIP)
    along = s * np.cos(0.3)
    R = np.hypot(RADIUS + along, s * np.sin(0.3))
    potential = dm @ (-mu / R + mu / RADIUS - mu / RADIUS**2 * along)
    found = seen["monitors/energy"] - seen["monitors/kinetic"]
    assert found == pytest.approx(potential, rel=1e-7)
    assert seen["monitors/gravity"] != pytest.approx(potential, rel=3e-4)  # of the gradient alone


@pytest.mark.parametrize("drum", ["root", "tip"])
def test_drum_work_equals_energy_gain_on_free_orbit(drum):
    line = DeployingLine(mass_per_length=0.05, direction=(0.2, 1, 0.1))
    made = deploying_line(line, StringFunctions(y=2, z=1), Profile.polynomial(2e4, 4.0, -0.01), stock=25e3,
                          until=100.0, drum=drum)  # fmt: skip
    orbit = Orbit(perigee_altitude=400e3, free=True)
    bodies = {"craft": rigid_body(800.0, 1e4 * np.eye(3)), "tether": made.body}
    delta = np.array([3e3, -2e3, 1e3])  # some 100 m
    system = System(bodies, (free("craft"), weld("tether", "craft")), varying={"tether": made.variation},
                    orbit=orbit, frame=Frame("orbital"), delta0={"tether": delta})  # fmt: skip
    assert is_integrated(system)
    given = {}
    for attraction in ("auto", "gradient"):
        environment = Environment(attraction=attraction)
        model = compile_system(replace(system, environment=environment))
        x = model.x0
        rate, change = model.state_rate(0.0, x), []
        for h in (2e-2, 1e-2):  # and the error of the second order taken out
            both = model.observe(np.array([-h, h]), np.stack([x - h * rate, x + h * rate]))
            change.append(np.diff(both["monitors/energy"])[0] / (2 * h))
        here = model.observe(np.zeros(1), x[None])
        given[attraction] = (here["bodies/tether/drum_power"] - here["bodies/tether/pickup_loss"])[0]
        assert (4 * change[1] - change[0]) / 3 == pytest.approx(given[attraction], rel=3e-6)
    assert given["auto"] != pytest.approx(given["gradient"], rel=1e-4)
