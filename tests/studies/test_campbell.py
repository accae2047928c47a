"""Campbell diagrams: exact frequencies at every speed, branches followed, crossings, damping, instability."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from support.mechanisms import four_bar
from support.rotating_beams import Rotating

from femflex.body import Marker, rigid_body
from femflex.reduction import BeamFunctions, UniformBeam, beam_body
from femflex.studies.campbell import campbell
from femflex.studies.campbell.crossings import crossings
from femflex.system import System, reaction_wheel, revolute, weld, without_axial_inertia


def diagram(beam: Rotating, speeds, n: int = 10, **more):
    return campbell(System({"beam": beam.body(n)}, (weld("beam"),)), speeds, **more)


@pytest.fixture(scope="module")
def blade():
    """Flap and lag of a beam on a hub whose branches cross, in units of the beam."""
    return diagram(Rotating(0.0, hub=0.1, lag=9.0), np.linspace(0, 12, 9), modes=4, orders=(1, 2, 3))


@pytest.mark.sampled(1)
@pytest.mark.parametrize("k", [pytest.param(k, marks=() if k == 5 else pytest.mark.slow) for k in range(9)])
def test_frequencies_are_exact_at_every_speed(k, blade):
    found = 2 * np.pi * np.array([branch.frequencies[k] for branch in blade.branches])
    assert found == pytest.approx(Rotating(blade.speeds[k], hub=0.1, lag=9.0).exact(found), rel=1e-5)


def test_branches_cross_without_changing_what_they_are(blade):
    assert [branch.name for branch in blade.branches] == ["flap 1", "lag 1", "flap 2", "flap 3", "lag 2"]
    assert all(set(branch.characters) == {branch.name.split()[0]} for branch in blade.branches)
    flap, lag = blade.branch("flap 1").frequencies, blade.branch("lag 1").frequencies
    assert flap[0] < lag[0] and flap[-1] > lag[-1]
    assert not any(branch.growing.any() for branch in blade.branches)


@pytest.mark.slow
def test_southwell_bounds_hold_and_the_slope_at_rest_is_that_of_the_mode_at_rest():
    speeds = np.linspace(0, 6, 7)
    flap = 2 * np.pi * diagram(Rotating(0.0, lag=12.0), speeds, modes=1).branch("flap 1").frequencies
    x, weight = np.polynomial.legendre.leggauss(60)
    x, weight = (x + 1) / 2, weight / 2
    beta = 1.8751040687119611
    ratio = (np.cosh(beta) + np.cos(beta)) / (np.sinh(beta) + np.sin(beta))
    phi = np.cosh(beta * x) - np.cos(beta * x) - ratio * (np.sinh(beta * x) - np.sin(beta * x))
    slope = beta * (np.sinh(beta * x) + np.sin(beta * x) - ratio * (np.cosh(beta * x) - np.cos(beta * x)))
    K = (weight @ (0.5 * (1 - x**2) * slope**2)) / (weight @ phi**2)  # Rayleigh's quotient of the pull: above
    assert pytest.approx(1.1934, abs=2e-4) == K
    gain = (flap[1:] ** 2 - flap[0] ** 2) / speeds[1:] ** 2
    assert np.all(gain < K) and np.all(gain > 1.0)  # a string's own factor is 1: Southwell's from below
    near = 2 * np.pi * diagram(Rotating(0.0, lag=12.0), [0.0, 0.05], modes=1).branch("flap 1").frequencies
    assert (near[1] ** 2 - near[0] ** 2) / 0.05**2 == pytest.approx(K, rel=1e-3)


@pytest.mark.slow
def test_crossings_with_multiples_of_the_spin_are_where_the_exact_frequency_is_that_multiple(blade):
    assert blade.crossings
    assert [c.speed for c in blade.crossings] == sorted(c.speed for c in blade.crossings)
    for c in blade.crossings:
        assert c.frequency == pytest.approx(c.order * c.speed / (2 * np.pi), rel=1e-12)
        exact = Rotating(c.speed, hub=0.1, lag=9.0).exact(np.array([2 * np.pi * c.frequency]))
        assert exact == pytest.approx([c.order * c.speed], rel=2e-5)


@pytest.mark.parametrize("count", [4, 9])
def test_a_crossing_at_a_sampled_speed_is_told_once_with_its_neighbours(count):
    """A branch of omega^2 = 4 + 0.25 Omega^2 meets n Omega at 2 / sqrt(n^2 - 0.25), here at speeds that were taken.

    With few speeds, between which squares are straight lines, and with more, which a spline takes.
    """
    orders = [1, 2, 4]  # whose squares multiply without rounding: the sample lies on the line to the last digit
    exact = {n: 2.0 / np.sqrt(n**2 - 0.25) for n in orders}
    for n in orders:
        others, sample = np.linspace(0.1, 3.0, count), 2 * np.pi * (n * exact[n] / (2 * np.pi)) / n
        for kept in (others, others[others > sample], others[others < sample]):  # inside, first, last
            speeds = np.sort([*kept, sample])
            frequencies = np.sqrt(4.0 + 0.25 * speeds**2) / (2 * np.pi)
            frequencies[speeds == sample] = n * exact[n] / (2 * np.pi)
            found = crossings("flap 1", speeds, frequencies, orders)
            inside = [m for m in reversed(orders) if m == n or speeds[0] < exact[m] < speeds[-1]]
            assert [one.order for one in found] == inside
            assert [one.speed for one in found] == pytest.approx([exact[m] for m in inside], rel=1e-9)
            assert [one.frequency for one in found] == pytest.approx([m * exact[m] / (2 * np.pi) for m in inside])


def test_a_branch_that_bends_between_four_speeds_is_followed_by_a_spline():
    """(2 pi f)^2 = 4 + z / 4 + z^2 / 40, z = Omega^2, meets z at the smaller root of z^2 - 30 z + 160 = 0."""
    speeds = np.sqrt(np.array([1.0, 4.0, 9.0, 14.0]))
    z = speeds**2
    (found,) = crossings("flap 1", speeds, np.sqrt(4.0 + z / 4 + z**2 / 40) / (2 * np.pi), [1])
    assert found.speed**2 == pytest.approx(15.0 - np.sqrt(65.0), rel=1e-9)


def test_a_crossing_at_the_fastest_speed_is_found_on_any_curve():
    """There a spline is off by rounding, and may have no change of sign."""
    rng = np.random.default_rng(0)
    for order in [1, 2, 4] * 20:
        omega = rng.uniform(1.0, 3.0)
        frequency = omega / (2 * np.pi)
        last = 2 * np.pi * frequency / order
        speeds = np.sort([*rng.uniform(0.05, 0.99, 8) * last, last])
        bent = omega**2 + 0.05 * (np.sin(3 * speeds**2) - np.sin(3 * last**2))
        frequencies = np.where(speeds == last, frequency, np.sqrt(bent) / (2 * np.pi))
        (found,) = crossings("flap 1", speeds, frequencies, [order])
        assert found.speed == pytest.approx(last, rel=1e-12)


@pytest.mark.slow
def test_crossings_are_as_many_as_the_exact_frequencies_say(blade):
    """Every branch rises from above n Omega at rest; where it is below at the fastest, it has crossed once."""
    fastest = blade.speeds[-1]
    for branch in blade.branches:
        exact = Rotating(fastest, hub=0.1, lag=9.0).exact(2 * np.pi * branch.frequencies[-1:])[0]
        for order in blade.orders:
            met = [c for c in blade.crossings if (c.branch, c.order) == (branch.name, order)]
            assert len(met) == (exact < order * fastest)


@pytest.mark.slow
def test_a_round_blade_whose_flap_and_lag_are_one_at_rest_is_told_apart():
    found = diagram(Rotating(0.0), np.linspace(0, 8, 5), modes=4)
    names = [branch.name for branch in found.branches]
    assert sorted(names) == ["flap 1", "flap 2", "lag 1", "lag 2"]
    for k in (1, 2):
        flap, lag = (2 * np.pi * found.branch(f"{word} {k}").frequencies for word in ("flap", "lag"))
        assert flap**2 - lag**2 == pytest.approx(found.speeds**2, rel=1e-6, abs=1e-6)


@pytest.mark.slow
def test_branches_that_veer_away_from_each_other_are_followed_through():
    """Turned by a small angle, flap and lag are coupled: they come near, exchange what they are, and never meet."""
    speeds = np.linspace(0, 12, 7)
    found = diagram(Rotating(0.0, lag=12.0, setting=0.1), speeds, modes=2)
    low, high = found.branches
    assert (low.name, high.name) == ("flap 1", "lag 1")
    assert (low.becomes, high.becomes) == ("lag", "flap")
    assert np.all(low.frequencies < high.frequencies)
    assert not found.asked.all()  # through speeds in between
    assert found.speeds[found.asked] == pytest.approx(speeds)
    for k in np.flatnonzero(~found.asked):
        here = 2 * np.pi * np.array([low.frequencies[k], high.frequencies[k]])
        assert here == pytest.approx(Rotating(found.speeds[k], lag=12.0, setting=0.1).exact(here), rel=1e-5)


MASS, ARM, RIM = 2.0, 1.2, 0.7
X = 0.49 + MASS * ARM**2  # int x^2 dm and int z^2 dm about the hinge
Z = 0.01


def sprung_rod(rim: float, arm: float, stiffness: float, damping: float = 0.0) -> System:
    """A rod hinged for flap on the rim of a hub that spins."""
    hub = rigid_body(10.0, np.eye(3), markers={"rim": Marker.rigid(np.array([rim, 0.0, 0.0]))})
    rod = rigid_body(MASS, np.diag([0.02, 0.5, 0.5]), np.array([arm, 0.0, 0.0]))
    springs = {"stiffness": np.array([stiffness]), "damping": np.array([damping])}
    hinge = revolute("rod", "hub", (0, 1, 0), parent_marker="rim", **springs)
    return System({"hub": hub, "rod": rod}, (weld("hub"), hinge))


def test_damping_and_frequency_of_a_hinged_rod_are_those_of_its_own_equation():
    stiffness, damping = 40.0, 3.0
    speeds = np.array([0.0, 2.0, 5.0])
    (branch,) = campbell(sprung_rod(RIM, ARM, stiffness, damping), speeds, modes=1).branches
    omega = np.sqrt((stiffness + speeds**2 * (MASS * RIM * ARM + X - Z)) / (X + Z))
    assert branch.name == "flap 1"
    assert np.abs(branch.eigenvalues) == pytest.approx(omega, rel=1e-8)
    assert branch.damping_ratios == pytest.approx(damping / (2 * omega * (X + Z)), rel=1e-8)


def test_a_wheel_stiffens_the_flap_of_the_rod_that_carries_it():
    """Its axis along the spin: I b'' + (k + W^2 (...) + W J_s s) b = 0, s its speed relative to the rod."""
    stiffness, J_s, s = 40.0, 0.004, 900.0
    plain = sprung_rod(RIM, ARM, stiffness)
    wheel = reaction_wheel("wheel", "rod", J_s, axis=(0, 0, 1), initial_speed=s)
    rod = without_axial_inertia(plain.bodies["rod"], wheel)
    system = replace(plain, bodies={**plain.bodies, "rod": rod}, effectors=(wheel,))
    speeds = np.array([0.0, 2.0, 5.0])
    (branch,) = campbell(system, speeds, modes=1).branches
    square = (stiffness + speeds**2 * (MASS * RIM * ARM + X - Z) + speeds * J_s * s) / (X + Z)
    assert 2 * np.pi * branch.frequencies == pytest.approx(np.sqrt(square), rel=1e-8)


def test_a_rod_that_points_inwards_stops_swinging_and_grows_from_its_critical_speed_on():
    stiffness, rim = 40.0, 3.0
    pull = MASS * rim * ARM - (X - Z)  # towards the outside: against the spring
    critical = np.sqrt(stiffness / pull)
    speeds = np.linspace(0, 2 * critical, 9)
    found = campbell(sprung_rod(rim, -ARM, stiffness, 0.0), speeds, modes=1)
    (branch,) = found.branches
    above = found.speeds > critical * (1 + 1e-6)
    below = found.speeds < critical * (1 - 1e-6)
    assert not branch.growing[below].any() and branch.growing[above].all()
    square = (stiffness - found.speeds**2 * pull) / (X + Z)
    assert (branch.eigenvalues**2).real[above | below] == pytest.approx(-square[above | below], rel=1e-6)
    assert np.all(branch.frequencies[above] == 0)
    assert all(c.speed < critical for c in found.crossings)


def test_closed_loops_are_refused():
    with pytest.raises(ValueError, match="'closure' close loops, and the shapes of a Campbell diagram are followed"):
        campbell(four_bar(), [0.0, 1.0])


def test_what_cannot_vibrate_is_refused():
    with pytest.raises(ValueError, match="the craft has no vibration"):
        campbell(System({"hub": rigid_body(1.0, np.eye(3))}, (weld("hub"),)), [0.0, 1.0])


def test_unknown_branches_and_speeds_are_told(blade):
    with pytest.raises(KeyError, match="branch 'torsion 1' is not in the diagram; it has flap 1, lag 1"):
        blade.frequency("torsion 1", 0.0)
    with pytest.raises(KeyError, match="2 rad/s is none of the diagram's speeds, from 0 to 12 rad/s"):
        blade.frequency("flap 1", 2.0)
    with pytest.raises(KeyError, match="the nearest is 3 rad/s"):
        blade.frequency("flap 1", 3.001)
    assert blade.frequency("flap 1", 3.0) == blade.branch("flap 1").frequencies[2]


@pytest.mark.slow
def test_torsion_of_a_spinning_strip_has_tension_and_propeller_moment(femflex, tmp_path):
    """d(omega^2)/d(Omega^2) of its first torsion: 1 by the propeller moment, and by the pull

    int (1 - s^2)/2 (pi/2 cos(pi s/2))^2 ds / int sin(pi s/2)^2 ds, on strips so thin that twist is St Venant's.
    """
    mesh = Path(__file__).resolve().parents[2] / "meshes" / "panel.msh"
    (tmp_path / "strip.toml").write_text(STRIP.format(mesh=mesh))
    code, said, _ = femflex("campbell", "strip.toml", "--json")
    (torsion,) = [b for b in json.loads(said)["branches"] if b["name"] == "torsion 1"]
    square = (2 * np.pi * np.array(torsion["frequency"])) ** 2
    s = (np.arange(4000) + 0.5) / 4000
    pull = np.sum((1 - s**2) / 2 * (np.pi / 2 * np.cos(np.pi * s / 2)) ** 2) / np.sum(np.sin(np.pi * s / 2) ** 2)
    assert code == 0 and (square[1] - square[0]) / 2.0**2 == pytest.approx(1 + pull, rel=0.02)  # a root 1 : 4 wide


STRIP = """
run = {{ duration = 1 }}
campbell = {{ speeds = [0, 2], modes = 4, axis = [0, 0, 1] }}
materials.al = {{ E = "70 GPa", nu = 0.33, density = 2700 }}
sections.sheet = {{ kind = "plate", thickness = "5 mm" }}
joints = [{{ kind = "weld", child = "strip", child_marker = "root" }}]

[bodies.strip]
kind = "flexible"
mesh = "{mesh}"
members = [{{ group = "panel", family = "plate", section = "sheet", material = "al" }}]
reduction = {{ method = "cantilever", clamp = "root", modes = 4 }}
"""


def test_motions_of_every_kind_have_the_name_of_their_kind():
    """A strip at rest: bending in both planes, stretch and twist of a clamped-free rod, pi/2 sqrt(stiffness / mass)."""
    strip = UniformBeam(1.0, EA=9e4, EIy=4.0, EIz=60.0, GJ=2.0, mass_per_length=1.0, ry=0.005, rz=0.05)
    body = beam_body(strip, BeamFunctions(y=2, z=2, axial=2, torsion=2, family="polynomial"))
    found = campbell(System({"strip": body}, (weld("strip"),)), [0.0, 0.5], modes=8)
    assert {"flap 1", "lag 1", "stretch 1", "torsion 1"} <= {branch.name for branch in found.branches}
    omega = {name: 2 * np.pi * found.branch(name).frequencies[0] for name in ("flap 1", "lag 1")}
    assert omega == pytest.approx({"flap 1": 3.516 * 2.0, "lag 1": 3.516 * np.sqrt(60.0)}, rel=0.02)
    rods = {"stretch 1": np.sqrt(9e4), "torsion 1": np.sqrt(2.0 / (0.005**2 + 0.05**2))}
    for name, speed in rods.items():
        assert 2 * np.pi * found.branch(name).frequencies[0] == pytest.approx(np.pi / 2 * speed, rel=0.02)
