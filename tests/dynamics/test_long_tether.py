"""A tether of 20 km on a free orbit against 2000 masses on springs under -mu R/|R|^3, integrated here."""

import numpy as np
import pytest

from femflex.body import rigid_body
from femflex.dynamics import compile_system
from femflex.fem import Member, PointMass, build_structure
from femflex.fem.sections import CableSection
from femflex.integrate import Dop853
from femflex.mesh import line
from femflex.reduction import Preload, cantilever_modes, load_body, reduce_structure, save_body, static_equilibrium
from femflex.system import MU_EARTH, Environment, Frame, Orbit, System, free, weld

LENGTH, LINE, EA = 20e3, 0.01, 2e4  # m, kg/m, N
CRAFT, END = 1000.0, 50.0  # kg
CENTRE = (LINE * LENGTH**2 / 2 + END * LENGTH) / (CRAFT + LINE * LENGTH + END)  # from the craft, unstretched
ORBIT = Orbit.from_perigee(400e3, free=True)
PIN = {"start": ("x", "y", "z")}
TIME = 160.0  # s, two periods of its stretch
COUNT = 2000


@pytest.fixture(scope="module")
def tether():
    """The tether with its end mass up along y, about the equilibrium under the gradient of gravity."""
    mesh = line([[0, 0, 0], [0, LENGTH, 0]], 16)
    structure = build_structure(mesh, [Member("line", "tether", CableSection(EA, LINE))], [PointMass("end", END)])
    load = Preload.orbit(ORBIT.mean_motion, [0, 1, 0], [1, 0, 0], origin=(0, CENTRE, 0))
    found = static_equilibrium(structure, PIN, load)
    modes = cantilever_modes(found, {**PIN, "line": ("x", "z")}, 12)  # it only stretches: it stays vertical
    return reduce_structure(found, modes, {"end": "end"}, turning=())


def craft(tether, attraction, shift):
    """The craft with its tether, at rest in the orbital frame, the centre of all at O."""
    hub = rigid_body(CRAFT, np.eye(3))
    frame, environment = Frame("orbital"), Environment(attraction=attraction)
    start = np.array([0, -shift, 0, 1, 0, 0, 0])
    joints = (free("hub", q0=start), weld("tether", parent="hub", child_marker="start"))
    system = System({"hub": hub, "tether": tether}, joints, orbit=ORBIT, frame=frame, environment=environment)
    return compile_system(system)


def masses():
    """Masses from the craft to the end, their heights over it, at rest under the gradient, and that of their centre."""
    s = LENGTH * np.arange(COUNT + 1) / COUNT
    m = np.full(COUNT + 1, LINE * LENGTH / COUNT)
    m[0], m[-1] = m[0] / 2 + CRAFT, m[-1] / 2 + END
    y = s
    for _ in range(50):
        pull = 3 * ORBIT.mean_motion**2 * m * (y - CENTRE)
        T = np.cumsum(pull[::-1])[::-1][1:]  # EA (l^2 - 1) / 2 l, l = 1 + stretch
        l = 1 + T / EA
        for _ in range(5):
            l -= (EA * (l**2 - 1) / 2 * l - T) / (EA * (3 * l**2 - 1) / 2)
        y = np.concatenate([[0.0], np.cumsum(LENGTH / COUNT * l)])
    return m, y, float(m @ y / m.sum())


def own_length(times):
    """Distance (t,) from the craft to the end of COUNT masses on springs, by leapfrog in the orbit's plane."""
    m, y, shift = masses()
    n, a, rest = ORBIT.mean_motion, ORBIT.semi_major_axis, LENGTH / COUNT
    r = np.array([a + y - shift, 0.0 * y])
    v = n * np.array([0.0 * y, a + y - shift])

    def acceleration(r):
        d = r[:, 1:] - r[:, :-1]
        force = EA * ((d * d).sum(axis=0) / rest**2 - 1) / 2 / rest * d
        out = -MU_EARTH * r / (r * r).sum(axis=0) ** 1.5
        out[:, :-1] += force / m[:-1]
        out[:, 1:] -= force / m[1:]
        return out

    per = int(np.ceil((times[1] - times[0]) / (0.5 * rest / np.sqrt(EA / LINE))))
    h = (times[1] - times[0]) / per
    out, acc = [np.hypot(*(r[:, -1] - r[:, 0]))], acceleration(r)
    for _ in times[1:]:
        for _ in range(per):
            v += h / 2 * acc
            r = r + h * v
            acc = acceleration(r)
            v += h / 2 * acc
        out.append(np.hypot(*(r[:, -1] - r[:, 0])))
    return np.array(out)


@pytest.mark.slow
def test_it_stretches_as_2000_masses_on_springs_do(tether):
    """Let go at the stretch of the gradient, it swings about that of the exact attraction, by 3 cm."""
    times = np.linspace(0, TIME, 33)
    mine, shift = own_length(times), masses()[2]
    off = {}
    for attraction in ("exact", "gradient"):
        model = craft(tether, attraction, shift)
        states = Dop853(rtol=1e-10, atol=1e-10).solve(model, times, model.x0).states
        seen = model.observe(times, states)
        found = np.linalg.norm(seen["markers/tether.end/position"] - seen["bodies/hub/position"], axis=1)
        off[attraction] = np.abs((found - found[0]) - (mine - mine[0])).max()
    swing = np.ptp(mine)
    assert off["exact"] < 2e-4 * swing
    assert off["gradient"] > 0.9 * swing


def test_its_body_keeps_its_points_of_mass_in_a_file(tether, tmp_path):
    read = load_body(save_body(tmp_path / "tether.h5", tether)).mass_points
    assert np.array_equal(read.phi, tether.mass_points.phi)
    assert read.dm.sum() == pytest.approx(tether.moments.mass)
    assert np.einsum("p,pa->a", read.dm, read.rho) == pytest.approx(tether.moments.first[0])
    assert np.einsum("p,pak->ka", read.dm, read.phi) == pytest.approx(tether.moments.first[1:], abs=1e-9)
