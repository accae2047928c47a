"""Campbell diagrams over spin and over a value of a case: exact frequencies, branches, crossings, damping."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from support.effector_builders import reaction_wheel, without_axial_inertia
from support.rotating_beams import Rotating
from support.small_cases import sprung_wheels

from femflex.body import Marker, rigid_body
from femflex.case.campbell import stability_table
from femflex.case.read import parse_case
from femflex.linear.equilibrium import EquilibriumError
from femflex.reduction import BeamFunctions, UniformBeam, beam_body
from femflex.studies.campbell import axis_of, campbell, case_campbell, case_steps, diagram_of, value_diagram
from femflex.studies.stability import case_stability
from femflex.studies.stability.judgement import NONE, STATIC
from femflex.system import System, revolute, weld


def diagram(beam: Rotating, speeds, n: int = 10, **more):
    return campbell(System({"beam": beam.body(n)}, (weld("beam"),)), speeds, **more)


@pytest.fixture(scope="module")
def blade():
    """Flap and lag of a beam on a hub whose branches cross, in units of the beam."""
    return diagram(Rotating(0.0, hub=0.1, lag=9.0), np.linspace(0, 12, 9), modes=4, orders=(1, 2, 3))


@pytest.mark.sampled(1)
@pytest.mark.parametrize("k", [pytest.param(k, marks=() if k == 5 else pytest.mark.slow) for k in range(9)])
def test_frequencies_are_exact_at_every_speed(k, blade):
    omega = 2 * np.pi * np.array([branch.frequencies[k] for branch in blade.branches])
    assert omega == pytest.approx(Rotating(blade.speeds[k], hub=0.1, lag=9.0).exact(omega), rel=1e-5)


@pytest.mark.slow
def test_branches_cross_without_changing_what_they_are(blade):
    assert [branch.name for branch in blade.branches] == ["flap 1", "lag 1", "flap 2", "flap 3", "lag 2"]
    assert all(set(branch.characters) == {branch.name.split()[0]} for branch in blade.branches)
    flap, lag = blade.branch("flap 1").frequencies, blade.branch("lag 1").frequencies
    assert flap[0] < lag[0] and flap[-1] > lag[-1]
    assert not any(branch.growing.any() for branch in blade.branches)


@pytest.mark.slow
def test_southwell_bounds_and_slope_at_rest():
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
    slow_flap = 2 * np.pi * diagram(Rotating(0.0, lag=12.0), [0.0, 0.05], modes=1).branch("flap 1").frequencies
    assert (slow_flap[1] ** 2 - slow_flap[0] ** 2) / 0.05**2 == pytest.approx(K, rel=1e-3)


@pytest.mark.slow
def test_crossings_with_multiples_of_the_spin(blade):
    assert blade.crossings
    assert [c.speed for c in blade.crossings] == sorted(c.speed for c in blade.crossings)
    for c in blade.crossings:
        assert c.frequency == pytest.approx(c.order * c.speed / (2 * np.pi), rel=1e-12)
        exact = Rotating(c.speed, hub=0.1, lag=9.0).exact(np.array([2 * np.pi * c.frequency]))
        assert exact == pytest.approx([c.order * c.speed], rel=2e-5)


@pytest.mark.slow
def test_number_of_crossings(blade):
    """Every branch rises from above n Omega at rest; where it is below at the fastest, it has crossed once."""
    fastest = blade.speeds[-1]
    for branch in blade.branches:
        exact = Rotating(fastest, hub=0.1, lag=9.0).exact(2 * np.pi * branch.frequencies[-1:])[0]
        for order in blade.orders:
            met = [c for c in blade.crossings if (c.branch, c.order) == (branch.name, order)]
            assert len(met) == (exact < order * fastest)


@pytest.mark.slow
def test_flap_and_lag_of_a_round_blade():
    spin_diagram = diagram(Rotating(0.0), np.linspace(0, 8, 5), modes=4)
    names = [branch.name for branch in spin_diagram.branches]
    assert sorted(names) == ["flap 1", "flap 2", "lag 1", "lag 2"]
    for k in (1, 2):
        flap, lag = (2 * np.pi * spin_diagram.branch(f"{word} {k}").frequencies for word in ("flap", "lag"))
        assert flap**2 - lag**2 == pytest.approx(spin_diagram.speeds**2, rel=1e-6, abs=1e-6)


@pytest.mark.slow
def test_veering_branches():
    """Turned by a small angle, flap and lag are coupled: they come near, exchange what they are, and never meet."""
    speeds = np.linspace(0, 12, 7)
    spin_diagram = diagram(Rotating(0.0, lag=12.0, setting=0.1), speeds, modes=2)
    low, high = spin_diagram.branches
    assert (low.name, high.name) == ("flap 1", "lag 1")
    assert (low.final_character, high.final_character) == ("lag", "flap")
    assert np.all(low.frequencies < high.frequencies)
    assert not spin_diagram.requested.all()  # through speeds in between
    assert spin_diagram.speeds[spin_diagram.requested] == pytest.approx(speeds)
    for k in np.flatnonzero(~spin_diagram.requested):
        omega = 2 * np.pi * np.array([low.frequencies[k], high.frequencies[k]])
        assert omega == pytest.approx(Rotating(spin_diagram.speeds[k], lag=12.0, setting=0.1).exact(omega), rel=1e-5)


MASS, ARM, RIM = 2.0, 1.2, 0.7
X = 0.49 + MASS * ARM**2  # int x^2 dm and int z^2 dm about the hinge
Z = 0.01


def sprung_rod(rim: float, arm: float, stiffness: float, damping: float = 0.0) -> System:
    """A rod hinged for flap on the rim of a hub that spins."""
    hub = rigid_body(10.0, np.eye(3), markers={"rim": Marker.at_position(np.array([rim, 0.0, 0.0]))})
    rod = rigid_body(MASS, np.diag([0.02, 0.5, 0.5]), np.array([arm, 0.0, 0.0]))
    springs = {"stiffness": np.array([stiffness]), "damping": np.array([damping])}
    hinge = revolute("rod", "hub", (0, 1, 0), parent_marker="rim", **springs)
    return System({"hub": hub, "rod": rod}, (weld("hub"), hinge))


def test_damping_and_frequency_of_a_hinged_rod():
    stiffness, damping = 40.0, 3.0
    speeds = np.array([0.0, 2.0, 5.0])
    (branch,) = campbell(sprung_rod(RIM, ARM, stiffness, damping), speeds, modes=1).branches
    omega = np.sqrt((stiffness + speeds**2 * (MASS * RIM * ARM + X - Z)) / (X + Z))
    assert branch.name == "flap 1"
    assert np.abs(branch.eigenvalues) == pytest.approx(omega, rel=1e-8)
    assert branch.damping_ratios == pytest.approx(damping / (2 * omega * (X + Z)), rel=1e-8)


def test_wheel_stiffens_the_flap_of_its_rod():
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


def test_inward_rod_is_unstable_above_its_critical_speed():
    stiffness, rim = 40.0, 3.0
    pull = MASS * rim * ARM - (X - Z)  # towards the outside: against the spring
    critical = np.sqrt(stiffness / pull)
    speeds = np.linspace(0, 2 * critical, 9)
    spin_diagram = campbell(sprung_rod(rim, -ARM, stiffness, 0.0), speeds, modes=1)
    (branch,) = spin_diagram.branches
    above = spin_diagram.speeds > critical * (1 + 1e-6)
    below = spin_diagram.speeds < critical * (1 - 1e-6)
    assert not branch.growing[below].any() and branch.growing[above].all()
    square = (stiffness - spin_diagram.speeds**2 * pull) / (X + Z)
    assert (branch.eigenvalues**2).real[above | below] == pytest.approx(-square[above | below], rel=1e-6)
    assert np.all(branch.frequencies[above] == 0)
    assert all(c.speed < critical for c in spin_diagram.crossings)


def test_critical_speed_is_passed_and_marked():
    """A mass on equal springs in a spinning frame: 2 -+ W. At W = 2 rad/s its stiffness is singular."""
    text = """
[run]
duration = "1 s"
[attitude]
frame = "spinning"
spin = [0, 0, 0.5]
[bodies.ball]
kind = "rigid"
mass = "1 kg"
inertia = [1, 1, 1]
[[joints]]
kind = "general"
child = "ball"
slides = [[1, 0, 0], [0, 1, 0]]
turns = []
slide_stiffness = [4.0, 4.0]
[campbell]
speeds = [0, 1, 2, 3, 5]
modes = 2
"""
    spin_diagram = case_campbell(parse_case(text, Path("ball.toml")))
    assert spin_diagram.critical == (2.0,)
    for speed in (0.0, 1.0, 2.0, 3.0, 5.0):
        frequencies = sorted(2 * np.pi * spin_diagram.frequency(branch.name, speed) for branch in spin_diagram.branches)
        assert frequencies == pytest.approx([abs(2 - speed), 2 + speed], abs=5e-6)


@pytest.mark.slow
def test_torsion_of_a_spinning_strip(femflex, tmp_path):
    """d(omega^2)/d(Omega^2) of its first torsion: 1 by the propeller moment, and by the pull

    int (1 - s^2)/2 (pi/2 cos(pi s/2))^2 ds / int sin(pi s/2)^2 ds, on strips so thin that twist is St Venant's.
    """
    mesh = Path(__file__).resolve().parents[2] / "meshes" / "panel.msh"
    (tmp_path / "strip.toml").write_text(STRIP.format(mesh=mesh))
    code, output, _ = femflex("campbell", "strip.toml", "--json")
    torsion = [row["frequency [Hz]"] for row in json.loads(output)["points"] if row["branch"] == "torsion 1"]
    square = (2 * np.pi * np.array(torsion)) ** 2
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


def test_names_and_frequencies_of_flap_lag_stretch_and_torsion():
    """A strip at rest: bending in both planes, stretch and twist of a clamped-free rod, pi/2 sqrt(stiffness / mass)."""
    strip = UniformBeam(1.0, EA=9e4, EIy=4.0, EIz=60.0, GJ=2.0, mass_per_length=1.0, ry=0.005, rz=0.05)
    body = beam_body(strip, BeamFunctions(y=2, z=2, axial=2, torsion=2, family="polynomial"))
    spin_diagram = campbell(System({"strip": body}, (weld("strip"),)), [0.0, 0.5], modes=8)
    assert {"flap 1", "lag 1", "stretch 1", "torsion 1"} <= {branch.name for branch in spin_diagram.branches}
    omega = {name: 2 * np.pi * spin_diagram.branch(name).frequencies[0] for name in ("flap 1", "lag 1")}
    assert omega == pytest.approx({"flap 1": 3.516 * 2.0, "lag 1": 3.516 * np.sqrt(60.0)}, rel=0.02)
    rods = {"stretch 1": np.sqrt(9e4), "torsion 1": np.sqrt(2.0 / (0.005**2 + 0.05**2))}
    for name, speed in rods.items():
        assert 2 * np.pi * spin_diagram.branch(name).frequencies[0] == pytest.approx(np.pi / 2 * speed, rel=0.02)


SPRUNG = sprung_wheels(20, "").replace('rate = "0.5 rad/s"\n', "").replace('child = "b"', 'parent = "a"\nchild = "b"')
WHEELS = SPRUNG + '[stability]\nvary."joints.0.stiffness" = { between = ["0.5 N m", "60 N m"], points = 7 }\n'


def exact(k: float) -> np.ndarray:
    """Frequencies [Hz] of 2 a'' + 3 (a + b)'' + k a = 0, 3 (a + b)'' + 20 b = 0."""
    M, K = np.array([[5.0, 3.0], [3.0, 3.0]]), np.diag([k, 20.0])
    return np.sqrt(np.sort(np.linalg.eigvals(np.linalg.solve(M, K)).real)) / (2 * np.pi)


def test_branches_over_a_stiffness():
    stiffness_diagram = value_diagram(parse_case(WHEELS), "joints.0.stiffness", [0.5, 4.0, 20.0, 60.0], "N m")
    assert [branch.name for branch in stiffness_diagram.branches] == [
        "joint 1",
        "joint 2",
    ] and not stiffness_diagram.crossings
    for k, value in enumerate(stiffness_diagram.speeds):
        assert [branch.frequencies[k] for branch in stiffness_diagram.branches] == pytest.approx(exact(value), rel=1e-7)
    assert stiffness_diagram.value == "joints.0.stiffness"


def test_crossing_branches_over_a_stiffness():
    """Two wheels on the ground that do not feel each other: one frequency stays, the other crosses it."""
    case = parse_case(WHEELS.replace('parent = "a"\n', ""))
    stiffness_diagram = value_diagram(case, "joints.0.stiffness", np.linspace(4.0, 60.0, 15).tolist(), "N m")
    first, second = stiffness_diagram.branches
    assert first.frequencies == pytest.approx(np.sqrt(stiffness_diagram.speeds / 2.0) / (2 * np.pi), rel=1e-7)
    assert second.frequencies == pytest.approx(
        np.full(len(stiffness_diagram.speeds), np.sqrt(20.0 / 3.0) / (2 * np.pi)), rel=1e-7
    )


PENDULUM = """
title = "a pendulum under a torque"
[run]
duration = "1 s"
[environment]
gravity = [0, -9, 0]
[bodies.rod]
kind = "rigid"
mass = 2
inertia = [1, 1, 1]
center_of_mass = [0.5, 0, 0]
[[joints]]
kind = "revolute"
child = "rod"
axis = "z"
angle = "-90 deg"
[[loads]]
name = "motor"
body = "rod"
torque = [0, 0, 1]
[stability]
vary."loads.0.torque.2" = { between = ["2.5 N m", "12.5 N m"], points = 5 }
"""


def test_no_equilibrium_beyond_the_fold_of_a_pendulum():
    """m g l = 9 N m: w^2 = sqrt(81 - T^2) / 1.5 (about the hinge), and nothing from T = 9 on."""
    case = parse_case(PENDULUM)
    torque_diagram = value_diagram(case, "loads.0.torque.2", [3.0, 6.0], "N m")
    omega = np.sqrt(np.sqrt(81 - np.array([9, 36])) / 1.5)
    assert 2 * np.pi * torque_diagram.branches[0].frequencies == pytest.approx(omega, rel=1e-7)
    with pytest.raises(EquilibriumError, match="9"):
        value_diagram(case, "loads.0.torque.2", [3.0, 9.5, 12.0], "N m")
    progress: list[float] = []
    locus = case_stability(case, progress.append).result
    assert locus.kinds.tolist() == [STATIC, STATIC, STATIC, NONE, NONE] and np.isnan(locus.growth[3:]).all()
    assert locus.lost == 10.0 and progress == pytest.approx([0.2, 0.4, 0.6]) and locus.critical == ()
    across = {"between": ["-15 N m", "-5 N m"], "points": 3}
    table = stability_table({"vary": {"loads.0.torque.2": across}}, "a test")
    partial_result = case_stability(case.model_copy(update={"stability": table}))
    assert partial_result.result.kinds.tolist() == [NONE, NONE, STATIC] and partial_result.result.lost is None


TWO_WHEELS = sprung_wheels(20, 'output_step = "0.25 s"')


@pytest.fixture(scope="module")
def wheels():
    return parse_case(TWO_WHEELS)


STONE = """
title = "a stone on a spring"
[run]
duration = "1 s"
[environment]
gravity = [0, 0, -9]
[bodies.stone]
kind = "rigid"
mass = 2
inertia = [1, 1, 1]
[[joints]]
kind = "prismatic"
child = "stone"
axis = [0, 0, 1]
name = "shaft"
stiffness = 8
"""


SPINNING = (
    STONE.replace("[environment]\ngravity = [0, 0, -9]\n", "")
    + """
[attitude]
frame = "inertial"
[campbell]
speeds = ["0 rad/s", "1 rad/s", "3 rad/s"]
axis = [3, 0, 4]
orders = [1, 2]
modes = 2
"""
)


def test_diagram_of_a_case_about_its_axis(tmp_path):
    """A stone on a shaft at an angle to the spin, cos = 0.8: omega^2 = k / m - (0.6 Omega)^2."""
    case = parse_case(SPINNING)
    assert axis_of(case) == pytest.approx([0.6, 0.0, 0.8])
    (tmp_path / "c.toml").write_text(SPINNING)
    progress_values: list[float] = []
    for case_or_path in (case, tmp_path / "c.toml", str(tmp_path / "c.toml")):
        spin_diagram = case_campbell(case_or_path, progress=progress_values.append)
        assert spin_diagram.title == "a stone on a spring" and spin_diagram.orders == (1, 2) and spin_diagram.complete
        assert spin_diagram.speeds[spin_diagram.requested] == pytest.approx([0, 1, 3])
        exact = np.sqrt(4.0 - (0.6 * spin_diagram.speeds) ** 2) / (2 * np.pi)
        assert spin_diagram.branches[0].frequencies == pytest.approx(exact, rel=1e-6)
        met = [(crossing.order, crossing.speed) for crossing in spin_diagram.crossings]
        assert met == [(n, pytest.approx(np.sqrt(4 / (n**2 + 0.36)), rel=1e-6)) for n in (2, 1)]
    assert progress_values == [0, 1, 3] * 3
    unfinished = diagram_of(case, list(case_steps(case))[:2], complete=False)
    assert not unfinished.complete and unfinished.speeds.tolist() == [0, 1]
