"""Cables with mass: a taut string, a falling folded chain, a slack cable that snaps taut, and what is refused."""

from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import quad

from femflex.body.rigid import rigid_body
from femflex.case import parse_case
from femflex.case.problems import CaseError
from femflex.dynamics import compile_system
from femflex.dynamics.equilibria.linearised import linearised
from femflex.integrate import Dop853
from femflex.pipeline.decisions import build_system
from femflex.system import Environment, Joint, System, free, weld, with_heavy_cable

POINT = np.zeros((3, 3))
ENDS = (("base", "origin"), ("tip", "origin"))


def string(n, damping=0.0):
    """A string of 2 m stretched between two fixed points that are 2.02 m apart."""
    bodies = {"base": rigid_body(1.0, np.eye(3)), "tip": rigid_body(1.0, np.eye(3))}
    away = Joint("tip", translations=np.eye(3)[:1], q0=np.array([2.02]), motion=(2.02,), kind="general")
    share = (np.arange(n)[:, None] + 0.5) / n
    places = share * np.array([2.02, 0, 0])
    return with_heavy_cable(
        System(bodies, (weld("base"), away)), "line", ENDS, 2.0, 500.0, 0.1, n, places, damping=damping
    )


def test_frequencies_of_a_taut_string_converge_with_the_square_of_the_masses():
    tension, density = 500.0 * 0.01, 0.1 * 2.0 / 2.02
    exact = np.pi / 2.02 * np.sqrt(tension / density) * np.array([1.0, 1.0, 2.0, 2.0])  # in both planes
    errors = []
    for n in (8, 16):
        model = compile_system(string(n))
        poles = linearised(model, 0.0, model.x0).eigenvalues()
        found = np.sort(np.abs(poles.imag[poles.imag > 1e-3]))[:4]
        errors.append(np.abs(found / exact - 1.0))
    assert errors[1].max() < 0.01
    assert np.log2(errors[0] / errors[1]) == pytest.approx(2.0, abs=0.2)


def folded(n, width=0.05, length=2.0, density=0.5):
    """A chain that hangs in a narrow U from two points at one height, one end of it free to fall."""
    half = (length - width) / 2.0
    s = (np.arange(n) + 0.5) * length / n
    x = np.clip(s - half, 0.0, width)
    z = -np.minimum(np.minimum(s, half), length - s)
    places = np.stack([x, 0 * s, z], axis=1)
    bodies = {"base": rigid_body(1.0, np.eye(3)), "tip": rigid_body(0.01 * density * length / n, POINT)}
    end = Joint("tip", "base", translations=np.eye(3), q0=np.array([width, 0.0, 0.0]), kind="general")
    system = System(bodies, (weld("base"), end), environment=Environment(np.array([0.0, 0.0, -9.81])))
    return with_heavy_cable(system, "line", ENDS, length, 2e3, density, n, places)


@pytest.mark.slow
def test_a_folded_chain_falls_faster_than_a_free_body():
    """Calkin & March, American Journal of Physics 57 (1989) 154: v^2 = g (2 y - y^2 / L) / (1 - y / L), energy kept."""
    g, length = 9.81, 2.0
    model = compile_system(folded(80))
    t = np.linspace(0.0, 0.6, 601)
    seen = model.observe(t, Dop853(rtol=1e-6, atol=1e-8).solve(model, t, model.x0).states)
    fallen = -seen["bodies/tip/position"][:, 2]
    for part in (0.5, 0.7, 0.9):
        y = part * length
        k = int(np.argmax(fallen > y))
        at = np.interp(y, fallen[k - 1 : k + 1], t[k - 1 : k + 1])
        exact = quad(lambda y: np.sqrt((1 - y / length) / (g * (2 * y - y * y / length))), 0.0, y)[0]
        assert at == pytest.approx(exact, rel=0.02)
        assert np.sqrt(2 * y / g) > 1.05 * exact
    energy = seen["monitors/energy"]
    assert np.abs(energy - energy[0]).max() < 1e-3 * abs(energy[0])
    assert min(seen["effectors/line/tension"].min(), seen["effectors/line/tension_end"].min()) == 0.0


SNAP = """
[run]
duration = "8 s"
output_step = "0.05 s"
rtol = 1e-9
[bodies.craft]
kind = "rigid"
mass = "100 kg"
inertia = ["8 kg m^2", "9 kg m^2", "10 kg m^2"]
[bodies.sub]
kind = "rigid"
mass = "20 kg"
inertia = ["1 kg m^2", "1 kg m^2", "1 kg m^2"]
[[joints]]
kind = "free"
parent = "craft"
child = "sub"
position = ["8 m", 0, 0]
velocity = ["0.5 m/s", 0, 0]
[cables.line]
body = "sub"
parent = "craft"
length = "10 m"
EA = "2000 N"
mass_per_length = "0.2 kg/m"
masses = 5
"""


def test_a_slack_cable_of_a_case_lets_its_bodies_coast_until_it_is_taut():
    system = build_system(parse_case(SNAP, Path("snap.toml")))
    model = compile_system(system)
    assert sum(system.bodies[f"line_{k}"].moments.mass for k in range(1, 6)) == pytest.approx(2.0, rel=1e-14)
    t = np.linspace(0.0, 8.0, 161)
    seen = model.observe(t, Dop853(rtol=1e-9, atol=1e-10).solve(model, t, model.x0).states)
    slack = t < 3.99  # 2 m at 0.5 m/s
    assert np.all(seen["effectors/line/slack"][slack] == pytest.approx(1.0, abs=1e-12))
    x = seen["bodies/sub/position"][:, 0]
    assert x[slack] == pytest.approx(8.0 + 0.5 * t[slack], abs=1e-9)
    assert seen["effectors/line/tension"].max() > 1.0 and seen["effectors/line/tension"].min() == 0.0
    p, energy = seen["monitors/momentum"], seen["monitors/energy"]
    assert np.abs(p - p[0]).max() < 1e-11 * np.abs(p).max()
    assert np.abs(energy - energy[0]).max() < 1e-6 * energy[0]
    assert x[-1] - seen["bodies/craft/position"][-1, 0] < 10.5  # it came back


def test_cables_with_mass_that_cannot_be_are_refused():
    system = System(
        {"base": rigid_body(1.0, np.eye(3)), "tip": rigid_body(1.0, np.eye(3))}, (weld("base"), free("tip"))
    )

    def made(name="line", length=2.0, density=0.1, n=2):
        return with_heavy_cable(system, name, ENDS, length, 10.0, density, n, np.zeros((n, 3)))

    with pytest.raises(ValueError, match="mass per length of cable 'line' is -1 kg/m; it must be positive"):
        made(density=-1.0)
    with pytest.raises(ValueError, match="cable 'line' has 501 masses; give 1 to 500"):
        made(n=501)
    system = made()
    with pytest.raises(ValueError, match="adds a body 'line_1', and there is one of that name"):
        made()
    growing = 'length = { kind = "smooth_step", from = "5 m", to = "10 m", start = 0, end = "5 s" }'
    text = SNAP.replace('length = "10 m"', growing)
    with pytest.raises(CaseError, match="found a length that changes and mass_per_length; give a constant length"):
        build_system(parse_case(text, Path("snap.toml")))


def test_damping_of_a_cable_is_that_of_the_whole_whatever_the_number_of_masses():
    """Along a taut cable the dampers are c L / EA times the springs, so poles decay at c L / EA omega^2 / 2."""
    c = 0.1  # N s/m
    for n in (1, 6):
        model = compile_system(string(n, damping=c))
        poles = linearised(model, 0.0, model.x0).eigenvalues()
        along = poles[np.abs(poles.real) > 1e-6]
        assert len(along) == 2 * n
        assert -2 * along.real == pytest.approx(c * 2.0 / 500.0 * np.abs(along) ** 2, rel=1e-6)
