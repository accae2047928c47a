"""Section and density that vary along the material: tables in the length."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import trapezoid
from support.inextensible import swing
from support.members import UNIT, hub_with_arms, solved

from femflex.deployment import (
    DeployingLine,
    ElementFunctions,
    MaterialTaper,
    deploying_line,
    deploying_tapered_line,
)
from femflex.dynamics import compile_system
from femflex.reduction import BeamFunctions
from femflex.system import Profile, System, weld

RAMP = Profile.smooth_step(0.0, 3.0, 1.0, 2.0)


def test_table_without_taper_matches_uniform_member():
    functions = BeamFunctions(y=2, z=1)
    table = deploying_tapered_line(UNIT, MaterialTaper(), functions, RAMP, until=3.0, stock=3.0)
    exact = deploying_line(UNIT, functions, RAMP, until=3.0, stock=3.0)
    assert table.variation.write.error < 1e-8
    assert len(table.variation.write.pieces) > 1
    rates = []
    for made in (table, exact):
        n = made.body.n_modes
        system = System({"b": made.body}, (weld("b", child_marker="root"),), varying={"b": made.variation})
        model = compile_system(system)
        x = np.concatenate([0.03 * np.array([1.0, 0.5, -0.3])[:n], 0.1 * np.ones(n)])
        tip = made.body.marker("tip").phi[:, :n]
        rate = model.state_rate(1.3, x)
        seen = model.observe(np.array([1.3]), x[None])
        rates.append((np.abs(tip @ x[:n]), np.abs(rate[n:]), seen["bodies/b/drum_force"][0]))
    for found, wanted in zip(*rates, strict=True):
        assert found == pytest.approx(wanted, rel=1e-5, abs=1e-6)


def test_spin_falls_as_a_tapered_arm_comes_out():
    """Heavy near the tip: I omega = H with int m'(sigma) x^2 dx by quadrature; the drum's force from momentum."""
    m, stock = 0.8, 4.0
    taper = MaterialTaper(mass=lambda s: 1.0 + 2.0 * np.exp(-s))
    made = deploying_tapered_line(DeployingLine(mass_per_length=m), taper, None, RAMP, until=3.0, stock=stock)
    system = System({"b": made.body}, (weld("b"),), varying={"b": made.variation})
    model = compile_system(system)
    for t in (0.7, 1.5, 2.2):
        L, U, A = (float(v) for v in RAMP(t))
        x, w = (np.polynomial.legendre.leggauss(40)[0] + 1) / 2, np.polynomial.legendre.leggauss(40)[1] / 2
        mass = m * L * (w @ taper.mass(L * x))
        seen = model.observe(np.array([t]), np.zeros((1, 0)))
        flux = m * float(taper.mass(np.array([L]))[0]) * U**2
        assert seen["bodies/b/drum_force"][0] == pytest.approx(mass * A + flux, rel=1e-6)
        assert seen["bodies/b/exit_flux"][0] == pytest.approx(flux, rel=1e-6)
    total = m * stock * (w @ taper.mass(stock * x))
    assert made.body.moments.mass == pytest.approx(total, rel=1e-9)


def test_free_hub_with_tapered_beam_keeps_momentum():
    line = DeployingLine(mass_per_length=0.3, EIy=2.0, EIz=2.0, root=(0.5, 0, 0), direction=(1, 0.4, 0))
    taper = MaterialTaper(mass=lambda s: 1 + 0.5 * s, bending=lambda s: 1 + s**2)
    made = deploying_tapered_line(line, taper, BeamFunctions(y=1, z=1), RAMP, until=3.0, stock=3.0)
    plain = hub_with_arms({"a": (line, BeamFunctions(y=1, z=1), RAMP, {"stock": 3.0})}, (0.1, 0.2, 0.3), 3.0)
    system = replace(plain, bodies={**plain.bodies, "a": made.body}, varying={"a": made.variation})
    _, _, seen = solved(system, np.linspace(0, 3, 7), 1e-11)
    H = seen["monitors/angular_momentum"]
    assert np.abs(H - H[0]).max() < 1e-7 * np.linalg.norm(H[0])  # of the table


def test_taper_deployed_from_tip_keeps_its_position():
    """Drum at the tip: material at x stays there. Inertia and spin of a rigid arm by quadrature, kinks in the table."""
    points, factors = (0.0, 1.2, 4.0), (1.0, 2.0, 0.5)
    taper = MaterialTaper.table(points, mass=factors)
    line = DeployingLine(mass_per_length=0.4, direction=(1, 0, 0))
    made = deploying_tapered_line(line, taper, None, RAMP, until=3.0, stock=4.0, drum="tip")
    assert made.variation.write.error < 1e-8
    plain = hub_with_arms({"a": (line, None, RAMP, {"stock": 4.0})}, (0.0, 0.0, 0.5), 3.0)
    system = replace(plain, bodies={**plain.bodies, "a": made.body}, varying={"a": made.variation})
    times = np.linspace(0, 3, 13)
    model, _, seen = solved(system, times, 1e-11)
    assert model.n_u == 6
    H = seen["monitors/angular_momentum"]
    assert np.abs(H - H[0]).max() < 1e-9 * np.linalg.norm(H[0])
    L = RAMP(times)[0]
    moments = []
    for length in L:
        x = np.linspace(0.0, length, 40001)
        mass = 0.4 * np.interp(x, points, factors)
        stowed = 0.4 * trapezoid(np.interp(y := np.linspace(length, 4.0, 40001), points, factors), y)
        total = 20.0 + trapezoid(mass, x) + stowed
        first = trapezoid(mass * x, x) + stowed * length
        moments.append(5.0 + trapezoid(mass * x**2, x) + stowed * length**2 - first**2 / total)
    rate = seen["bodies/hub/rate"][:, 2]
    assert rate * moments == pytest.approx(rate[0] * moments[0], rel=1e-7)
    assert np.ptp(rate) > 0.1 * rate[0]


def test_shapes_of_elements_of_a_wedge_have_its_frequency():
    """A cantilever wedge whose tip is sharp: omega = 5.315 sqrt(E I_0 / (m_0 L^4)) (Kirchhoff)."""
    taper = MaterialTaper(mass=lambda s: s / 2.0 + 1e-9, bending=lambda s: (s / 2.0) ** 3 + 1e-12)
    functions = ElementFunctions(y=2, elements=16)
    made = deploying_tapered_line(UNIT, taper, functions, Profile.constant(2.0), stock=2.0)
    assert made.body.n_modes == 2
    assert made.body.omega[0] * 2.0**2 == pytest.approx(5.315, rel=2e-4)


@pytest.mark.slow
def test_large_swings_of_a_tapered_beam_are_those_of_an_inextensible_one():
    """Out from 1 m to 1.8 m, bent by a tenth; of small bends alone 4e-3 of the peak off."""
    length, times = Profile.smooth_step(0.0, 8.0, 1.0, 1.8), np.linspace(0, 12, 61)
    taper = MaterialTaper(mass=lambda s: 1 + 0.5 * s, bending=lambda s: 1 + s**2)
    made = deploying_tapered_line(UNIT, taper, BeamFunctions(y=4), length, until=12.0)
    delta = np.eye(4)[0] * 0.1 / made.body.marker("tip").phi[1, 0]
    system = System({"b": made.body}, (weld("b", child_marker="root"),), varying={"b": made.variation},
                    delta0={"b": delta})  # fmt: skip
    exact = swing(lambda t: length(np.array(t)), [lambda xi: made.shapes.fields(xi, 0)[:, 1] @ delta], times, count=4,
                  taper=lambda s: (taper.mass(s), taper.bending(s)))  # fmt: skip
    found = solved(system, times)[2]["markers/b.tip/position"][:, 1:2]
    assert np.abs(found - exact).max() < 5e-4 * np.abs(exact).max()
