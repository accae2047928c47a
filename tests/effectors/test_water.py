"""Water: balance of energy, buoyancy of cut cylinders, waves, linear models, wave data, and MoorDyn's line."""

from __future__ import annotations

import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest
from support.wave_files import write_capytaine, write_wamit

import femflex
from femflex import equilibrium, read_case
from femflex.case import parse_case
from femflex.dynamics.model import compile_system
from femflex.hydrodynamics import WaveData, fitted, read_wave_data
from femflex.linear.system_modes import system_modes
from femflex.pipeline.start import system_of

CASES = Path(__file__).resolve().parents[2] / "cases"
HEAD = """
[run]
duration = "1 s"
samples = 2
[environment]
gravity = 9.81
[water.sea]
depth = "20 m"
current = [{ velocity = [1, 0.3, 0] }, { depth = "20 m", velocity = [0.2, 0, 0] }]
floor_stiffness = "1e5 Pa/m"
floor_damping = "1e3 Pa s/m"
friction = 0.5
waves = [
  { kind = "jonswap", height = "2 m", period = "6 s", components = 20 },
  { kind = "regular", height = "1 m", period = "5 s", direction = [1, 1, 0] },
]
[bodies.buoy]
kind = "rigid"
mass = "1500 kg"
inertia = ["400 kg m^2", "500 kg m^2", "500 kg m^2"]
markers.m = { position = [0.1, 0.2, 0.3], orientation = { x = [1, 0.2, 0], z = [0, 0.1, 1] } }
[[joints]]
kind = "free"
child = "buoy"
"""
MOORED_ROD = """
[bodies.anchor]
kind = "rigid"
mass = "1 kg"
markers.up = { position = ["-25 m", 0, "20 m"] }
[[joints]]
kind = "weld"
child = "anchor"
child_marker = "up"
[wet_members.rod]
body = "buoy"
start = [0, 0, "-3 m"]
end = ["1 m", 0, "3 m"]
diameter = "0.8 m"
pieces = 6
Cf = 0.05
[wet_members.wet_line]
cable = "line"
diameter = "0.05 m"
Cf = 0.02
[cables.line]
body = "buoy"
parent = "anchor"
length = "30 m"
EA = "1e6 N"
damping = "100 N s/m"
mass_per_length = "8 kg/m"
masses = 8
"""
HULL = """
[wet_bodies.hull]
body = "buoy"
marker = "m"
volume = 1.4
center_of_buoyancy = [0.1, 0, 0.2]
added_mass = [[800, 10, 20, 5, 60, 7], [10, 900, 30, -50, 3, 2], [20, 30, 1000, 4, 5, 6],
              [5, -50, 4, 200, 1, 2], [60, 3, 5, 1, 220, 3], [7, 2, 6, 2, 3, 150]]
drag_areas = [1, 1.2, 1.4]
turn_drag = [10, 20, 30]
damping = [10, 20, 30, 4, 5, 6]
waterplane_area = 1.1
waterplane_moments = [0.2, 0.3, 0.05]
"""
TUBE = """
[bodies.tube]
kind = "analytic"
length = "5 m"
EA = "6e7 N"
EIy = "6e5 N m^2"
EIz = "5e5 N m^2"
GJ = "5e5 N m^2"
mass_per_length = "22 kg/m"
ry = "30 mm"
rz = "30 mm"
strain = "condensed"
functions = { y = 2, z = 2, axial = 4, torsion = 1, joints = [] }
[wet_members.tube]
body = "tube"
diameter = "0.1 m"
inner_diameter = "0.08 m"
flooded = true
Cf = 0.1
[[joints]]
kind = "weld"
parent = "buoy"
child = "tube"
"""


SHAPES = (
    TUBE.partition("[wet_members.tube]")[0]
    + """
[[joints]]
kind = "weld"
parent = "buoy"
child = "tube"
[wet_bodies.tube]
body = "tube"
marker = "tip"
data = "hull.1"
data_origin = [1, 0.1, 0.2]
volume = 0.02
center_of_buoyancy = [0.1, 0, 0.2]
waterplane_area = 1.1
waterplane_moments = [0.2, 0.3, 0.05]
drag_areas = [1, 1.2, 1.4]
shapes = [
  { dof = "8", marker = "tip" }, { dof = "7", coordinate = 3 }, { coordinate = 4, marker = "tip", component = "y" },
]
"""
)


def model_of(tmp_path, text):
    write_wamit(tmp_path / "hull.1", kernel_data(np.linspace(0.2, 9.0, 24), 3))
    path = tmp_path / "case.toml"
    path.write_text(text)
    return compile_system(system_of(read_case(path)))


@pytest.mark.filterwarnings("ignore::femflex.warning.PhysicsWarning")
@pytest.mark.parametrize(("parts", "size"), [(MOORED_ROD, 0.2), (HULL, 0.3), (TUBE, 0.05), (SHAPES, 0.01)])
def test_energy_of_bodies_and_water_balances(tmp_path, parts, size):
    model = model_of(tmp_path, HEAD + parts)
    rng = np.random.default_rng(1)

    def observed(t, x):
        channels = model.observe(np.array([t]), x[None])
        of_effectors = {path: row[0] for path, row in channels.items() if path.startswith("effectors/")}
        gained = sum(value for path, value in of_effectors.items() if path.endswith("/supplied"))
        lost = sum(value for path, value in of_effectors.items() if path.endswith("/dissipation"))
        return channels["monitors/energy"][0], gained - lost, lost

    for t in rng.uniform(0.0, 10.0, 4):
        x = model.x0 + size * rng.normal(size=model.n_x)
        for k in model.renormalise:
            x[k : k + 4] /= np.linalg.norm(x[k : k + 4])
        rate, h = model.state_rate(t, x), 1e-5
        later, earlier = (observed(t + sign * h, x + sign * h * rate)[0] for sign in (1, -1))
        energy, power, lost = observed(t, x)
        assert lost >= 0.0
        rounding = 2e-16 * abs(energy) / h * 1e2
        assert (later - earlier) / (2 * h) == pytest.approx(power, rel=1e-5, abs=rounding + 1e-6 * lost)
        rows = model.terms(np.array([t]), x[None])
        assert np.sum(list(rows.values()), axis=0) == pytest.approx(0.0, abs=1e-9 * np.abs(rows["inertia"]).max())


@pytest.mark.sampled(1)
@pytest.mark.filterwarnings("ignore::femflex.warning.PhysicsWarning")
@pytest.mark.parametrize(("parts", "states"), [(MOORED_ROD, 0), (SHAPES, 4)])
@pytest.mark.parametrize("integrator", ["dop853", pytest.param("esdirk4", marks=pytest.mark.slow)])
def test_resumed_run_in_water_has_the_same_numbers(tmp_path, parts, states, integrator):
    """Also of a body by wave data, whose states of radiation are those of the run at the interruption."""
    write_wamit(tmp_path / "hull.1", kernel_data(np.linspace(0.2, 9.0, 24), 3))
    run = f'duration = "40 ms"\noutput_step = "1 ms"\nintegrator = "{integrator}"'
    case = parse_case((HEAD + parts).replace('duration = "1 s"\nsamples = 2', run), path=tmp_path / "case.toml")

    def stop(t):
        if t > 0.01:
            raise KeyboardInterrupt

    whole = femflex.run(case, tmp_path / "whole.h5")
    with pytest.raises(KeyboardInterrupt):
        femflex.run(case, tmp_path / "part.h5", progress=stop)
    rest = femflex.run(case, tmp_path / "part.h5", resume=True)
    names = [name for name in rest.names("z") if ".radiation_" in name] if states else []
    assert len(names) >= states and len(rest) == len(whole)
    for path in ("q", "u", *(["z"] if states else [])):
        assert np.array_equal(rest[path], whole[path]) and np.ptp(whole[path]) > 0.0


@pytest.mark.parametrize(("tilt", "height"), [(0.0, 0.1), (0.02, -0.2), (0.3, 0.2), (1.2, 0.5), (1.57, 0.3)])
def test_buoyancy_of_a_cut_cylinder_is_that_of_its_submerged_volume(tmp_path, tilt, height):
    L, R = 4.0, 0.3
    text = f"""
    [run]
    duration = "1 s"
    samples = 2
    [environment]
    gravity = 10
    [water.sea]
    density = 1000
    [bodies.rod]
    kind = "rigid"
    mass = 1
    inertia = [1.0, 1.0, 1.0]
    [wet_members.rod]
    body = "rod"
    start = [{-L / 2}, 0, 0]
    end = [{L / 2}, 0, 0]
    diameter = {2 * R}
    pieces = 1
    [attitude]
    position = [0, 0, {height}]
    sequence = "xyz"
    angles = [0, {-tilt}, 0]
    """
    model = model_of(tmp_path, text)
    channels = model.observe(np.zeros(1), model.x0[None])
    s = (np.arange(1200) + 0.5) / 1200 * L - L / 2
    radius, angle = (np.arange(60) + 0.5) / 60 * R, (np.arange(90) + 0.5) / 90 * 2 * np.pi
    s, radius, angle = np.meshgrid(s, radius, angle, indexing="ij")
    across = radius * np.cos(angle)
    x, z = s * np.cos(tilt) - across * np.sin(tilt), height + s * np.sin(tilt) + across * np.cos(tilt)
    weight = np.where(z < 0.0, radius, 0.0) * (L / 1200) * (R / 60) * (2 * np.pi / 90) * 1e4
    assert channels["effectors/rod/lift"][0] == pytest.approx(weight.sum(), rel=2e-3)
    moment = -(weight * x).sum()  # of the lift about the upright axis of y through the middle
    assert channels["effectors/rod/torque"][0][1] == pytest.approx(moment, abs=3e-3 * weight.sum() * L / 2)


def test_spectrum_has_its_height_and_peak(tmp_path):
    sea = '[run]\nduration = "1 s"\nsamples = 2\n[environment]\ngravity = 9.81\n[water.sea]\ndepth = "30 m"\n'
    waves = 'waves = [{ kind = "jonswap", height = "3 m", period = "9 s", components = 100, seed = 4 }]\n'
    body = '[bodies.a]\nkind = "rigid"\nmass = 1\n[attitude]\nheld = true\n'
    model = model_of(tmp_path, sea + waves + body)
    times = np.arange(0.0, 10000.0, 0.6)
    eta = model.observe(times, np.tile(model.x0, (len(times), 1)))["effectors/sea/elevation"]
    assert 4.0 * eta.std() == pytest.approx(3.0, rel=0.02)
    spectrum = np.abs(np.fft.rfft(eta)) ** 2
    f = np.fft.rfftfreq(len(eta), 0.6)
    # mean period of a JONSWAP spectrum of gamma 3.3 by its first moment: 0.834 T_p (Carter 1982)
    assert (spectrum.sum() / (f * spectrum).sum()) == pytest.approx(0.834 * 9.0, rel=0.01)


def test_drag_of_linear_models_is_that_of_the_stated_motion_and_of_none_in_still_water(tmp_path):
    text = (CASES / "wet_tube.toml").read_text().split("[expect.wet]")[0]
    text = text.replace('current = [{ velocity = [0, "0.2 m/s", 0] }]', "")
    still = system_modes(model_of(tmp_path, text).system)
    assert still.damping_ratios[0] == pytest.approx(0.0, abs=1e-12)
    waves = '\nwaves = [{ kind = "regular", height = "2 m", period = "10 s" }]'
    omega = 2 * np.pi / 10
    rms = omega * np.exp(-(omega**2) / 9.80665 * 20.0) / np.sqrt(2.0)  # 20 m below waves of 1 m amplitude
    for keys, speed in (
        ('linear_drag = "amplitude"\namplitude = "0.3 m/s"', 8 / (3 * np.pi) * 0.3),
        ('linear_drag = "sea_state"', np.sqrt(8 / np.pi) * rms),
    ):
        moved = text.replace('diameter = "100 mm"', f'diameter = "100 mm"\n{keys}')
        damped = system_modes(model_of(tmp_path, moved.replace('surface = "20 m"', 'surface = "20 m"' + waves)).system)
        per_length = 0.5 * 1025 * 1.2 * 0.1 * speed
        ratio = per_length / (2 * 2 * np.pi * 3.17517 * (22.1953522 + 8.0503))
        assert damped.damping_ratios[0] == pytest.approx(ratio, rel=1e-2)  # drag by the mean motion of eight patches


def test_segments_and_second_integrator_and_run_without_water(tmp_path):
    text = (
        (CASES / "riser.toml").read_text().split("[expect.first]")[0].replace("../meshes", str(CASES.parent / "meshes"))
    )
    text = text.replace(', options = { prestress = "20 kN" }', ", segments = 4").replace('EIy = "5000', 'EIy = "50000')
    i, j = text.index("reduction ="), text.index("[wet_members.water]")
    text = text[:i] + 'markers.root = { group = "root" }\n' + text[j:]
    text = text.replace('current = [{ velocity = [0, "0.1 m/s", 0] }]', "")
    text = text.replace("9.80665", "0.001")
    text = text.replace("[attitude]\nheld = true", '[attitude]\nheld = true\nmarker = "root"')
    system = model_of(tmp_path, text).system
    wet, model = system_modes(system), compile_system(system)
    dry = system_modes(model.without("wet_member").system)
    assert wet.frequencies[:2] == pytest.approx(dry.frequencies[:2] / np.sqrt(2.0), rel=2e-3)  # m_a = m
    rod = (CASES / "released_rod.toml").read_text().split("[expect.rise]")[0].replace('"20 s"', '"3 s"')
    ends = []
    for method in ("dop853", "esdirk4"):
        (tmp_path / "rod.toml").write_text(
            rod.replace("output_step", f'rtol = 1e-7\nintegrator = "{method}"\noutput_step')
        )
        with femflex.run(tmp_path / "rod.toml", tmp_path / f"{method}.h5") as run:
            ends.append(np.asarray(run["bodies/rod/position"])[-1])
    assert ends[1] == pytest.approx(ends[0], abs=1e-4)


def kernel_data(omega, n=0):
    """Data of K(t), the derivative of a falling Gaussian swing, over all six motions and n shapes: its transforms."""
    t = np.linspace(0.0, 40.0, 8001)
    K = np.exp(-0.25 * t**2) * np.cos(1.1 * t)
    fall = np.exp(-0.08 * t**2)
    K = K - fall * np.trapezoid(K, t) / np.trapezoid(fall, t)  # none at zero frequency
    transform = np.array([np.trapezoid(K * np.exp(-1j * w * t), t) for w in omega])
    shape = np.array([[1, 0, 0, 0, 0.7, 0], [0, 1, 0, -0.6, 0, 0], [0, 0, 1, 0, 0, 0]], float)
    shape = np.hstack([shape, np.outer([0, 0, 1], 0.3 * np.sin(1.0 + np.arange(n)))])
    one = sum(np.outer(row, row) for row in shape)
    infinite = 3.0 * np.eye(6 + n) + one
    A = infinite + (transform.imag / omega)[:, None, None] * one
    X = (1.0 + 0.1j) * omega[:, None, None] * np.ones((1, 2, 6 + n)) * np.array([1.0, 2.0])[:, None]
    B = transform.real[:, None, None] * one
    stiffness = None if n == 0 else 100.0 * (np.eye(6 + n) + 0.1 * one)
    names = tuple(str(7 + k) for k in range(n))
    return WaveData(omega, A, B, infinite, np.radians([0.0, 90.0]), X, 1000.0, 10.0, stiffness, shapes=names)


@pytest.mark.parametrize("knows_infinite", [True, False])
def test_radiation_is_passive_and_within_two_percent(knows_infinite):
    data = kernel_data(np.linspace(0.1, 4.0, 40))
    if not knows_infinite:
        data = WaveData(**{**vars(data), "infinite": None})
    found = fitted(data)
    assert found.error < 0.02
    assert found.infinite == pytest.approx(kernel_data(data.omega).infinite, abs=0.02)
    assert np.linalg.eigvalsh(found.rate + found.rate.T).max() < 1e-12
    real = found.kernel(np.geomspace(1e-3, 1e3, 60)).real
    assert np.linalg.eigvalsh((real + real.swapaxes(1, 2)) / 2).min() > -1e-9
    t, K0 = 0.0, found.input.T @ found.input  # the kernel in time at t = 0
    assert K0[2, 2] == pytest.approx(float(kernel_of(t)), rel=0.05)


def kernel_of(t):
    s = np.linspace(0.0, 40.0, 8001)
    K, fall = np.exp(-0.25 * s**2) * np.cos(1.1 * s), np.exp(-0.08 * s**2)
    return 1.0 - np.trapezoid(K, s) / np.trapezoid(fall, s) * np.exp(-0.08 * t**2)


def test_files_of_wamit_and_capytaine_hold_the_same_data(tmp_path):
    pytest.importorskip("xarray"), pytest.importorskip("h5netcdf")
    data = kernel_data(np.linspace(0.5, 3.0, 6))
    write_wamit(tmp_path / "hull.1", data)
    write_capytaine(tmp_path / "hull.nc", data)
    for name in ("hull.1", "hull.nc"):
        found = read_wave_data(tmp_path / name, data.density, data.gravity)
        for key in ("omega", "added_mass", "damping", "infinite", "headings", "excitation"):
            assert getattr(found, key) == pytest.approx(getattr(data, key), rel=1e-9, abs=1e-9), (name, key)
        middle = found.excitation_at(1.25, np.radians(45.0))
        assert middle == pytest.approx((1.0 + 0.1j) * 1.25 * 1.5 * np.ones(6), rel=1e-9)


MOORDYN = """--------------------- MoorDyn Input File ------------------------------------
line
---------------------- LINE TYPES -----------------------------------
TypeName Diam Mass/m EA BA/-zeta EI Cd Ca CdAx CaAx
(-) (m) (kg/m) (N) (N-s/-) (N-m^2) (-) (-) (-) (-)
main 0.09 77.7065452 384.243e6 -0.8 0 1.6 1.0 0.1 0.0
---------------------- POINTS --------------------------------
ID Type X Y Z Mass Volume CdA CA
(-) (-) (m) (m) (m) (kg) (m^3) (m^2) (-)
1 Fixed 848.67 0 -320 0 0 0 0
2 Coupled 0 0 -70 0 0 0 0
---------------------- LINES -----------------------------------
ID LineType AttachA AttachB UnstrLen NumSegs Outputs
(-) (-) (-) (-) (m) (-) (-)
1 main 1 2 902.2 30 -
---------------------- OPTIONS -----------------------------------
0.001 dtM
1e6 kb
3e5 cb
320 WtrDpth
9.80665 g
1025 rho
2.0 dtIC
60 TmaxIC
0.001 threshIC
0 writeLog
-------------------------- OUTPUTS -------------------------------
FairTen1
------------------------ need this line ------------------------
"""
ITS_FORCE = """
import moordyn
line = moordyn.Create("line.txt")
moordyn.Init(line, [0, 0, -70], [0, 0, 0])
print("force", *moordyn.Step(line, [0, 0, -70], [0, 0, 0], 0.0, 0.002))
"""
ITS_TENSION = """
import math, moordyn
line, w, dt = moordyn.Create("line.txt"), 2 * math.pi / 12.0, 0.02
moordyn.Init(line, [0, 0, -70], [0, 0, 0])
tensions = []
for k in range(1200):  # it goes on from the place and velocity at the start of a step
    t = k * dt
    place, velocity = [2.0 * (1 - math.cos(w * t)), 0, -70], [2.0 * w * math.sin(w * t), 0, 0]
    tensions.append(math.hypot(*moordyn.Step(line, place, velocity, t, dt)))
print("force", *tensions)
"""


def moordyn_says(tmp_path, program, text=MOORDYN):
    """The numbers that a program with MoorDyn prints in a process of its own."""
    if find_spec("moordyn") is None:
        pytest.skip("moordyn is not installed")
    (tmp_path / "line.txt").write_text(text)
    printed = subprocess.run([sys.executable, "-c", program], cwd=tmp_path, capture_output=True, text=True, check=True)
    return np.array(printed.stdout.rpartition("force ")[2].split(), float)


def test_mooring_line_pulls_as_that_of_moordyn(tmp_path):
    theirs = moordyn_says(tmp_path, ITS_FORCE)
    model = compile_system(system_of(read_case(CASES / "mooring_line.toml")))
    force = model.observe(np.zeros(1), model.x0[None])["effectors/line/force"][0]
    assert force[-3:] == pytest.approx(theirs, rel=2e-3, abs=1.0)


@pytest.mark.filterwarnings("ignore::femflex.warning.PhysicsWarning")
def test_surging_fairlead_pulls_a_line_as_that_of_moordyn(tmp_path):
    """x = 2 m (1 - cos(2 pi t / 12 s)) in still water: the tension of the second period is between 0.67 and 1.05 MN.

    Both put the mass at points: with 20, 30 and 60 pieces they differ by 6.4, 3.2 and 1.3 % of the amplitude at most.
    """
    theirs = moordyn_says(tmp_path, ITS_TENSION, MOORDYN.replace("-0.8", "2e6"))
    text = (CASES / "mooring_line.toml").read_text().partition("[pictures]")[0]
    for old, new in (
        ('waves = [{ kind = "regular", height = "4 m", period = "12 s" }]', ""),
        ('from = "equilibrium"', "keep = ['surge']"),
        ('duration = "2 s"', "duration = 24"), ("masses = 30", f"masses = 30\ndamping = {2e6 / 902.2}"),
        ('kind = "weld"\nchild = "fairlead"', 'name = "surge"\nkind = "prismatic"\nchild = "fairlead"\naxis = "x"\n'
         f'motion.position = {{ kind = "sine", amplitude = 2, frequency = {1 / 12}, phase = {-np.pi / 2}, mean = 2 }}'),
    ):  # fmt: skip
        assert old in text
        text = text.replace(old, new)
    with femflex.run(parse_case(text, path=CASES / "case.toml"), tmp_path / "run.h5") as run:
        t, force = np.asarray(run["time"]), np.linalg.norm(run["effectors/line/force"][:, -3:], axis=1)
    second = t > 12.0
    expected = np.interp(t[second], 0.02 * np.arange(1, 1201), theirs)
    assert force[second] == pytest.approx(expected, abs=0.04 * np.ptp(expected) / 2)
    assert np.ptp(force[second]) == pytest.approx(np.ptp(expected), rel=0.012)


CHAIN = """
[run]
duration = 20
output_step = 0.1
rtol = 1e-6
[environment]
gravity = 9.80665
[water.sea]
depth = DEPTH
floor_stiffness = 1e5
floor_damping = 1e4
friction = 0.5
[bodies.fairlead]
kind = "rigid"
mass = 1
[bodies.anchor]
kind = "rigid"
mass = 1
markers.fairlead = { position = [-SPAN, 0, DEPTH] }
[[joints]]
kind = "prismatic"
child = "fairlead"
axis = "z"
motion.position = { kind = "sine", amplitude = 2, frequency = 0.1 }
[[joints]]
kind = "weld"
child = "anchor"
child_marker = "fairlead"
[cables.line]
parent = "anchor"
body = "fairlead"
length = LENGTH
EA = 1.674e9
damping = 1.97e4
mass_per_length = 390
masses = 41
start = "hanging"
[wet_members.water]
cable = "line"
diameter = 0.252
Cd = 1.37
Cf = 0.64
"""
RESTING = [(50, 400, 410, 991.6, 826.2), (200, 700, 760, 2065.4, 1402.2), (600, 1500, 1700, 5232.6, 3244.2)]


def chain(depth, span, length):
    return CHAIN.replace("DEPTH", str(depth)).replace("SPAN", str(span)).replace("LENGTH", str(length))


@pytest.mark.parametrize(("depth", "span", "length", "fairlead", "anchor"), RESTING)
def test_chains_of_moordyn_pull_as_published(tmp_path, depth, span, length, fairlead, anchor):
    """Tensions in kN by quasi-static programs, of MoorDyn's test quasi_static_chain, which allows 10 %."""
    model = model_of(tmp_path, chain(depth, span, length))
    force = model.observe(np.zeros(1), model.x0[None])["effectors/line/force"][0] / 1e3
    assert np.linalg.norm(force[-3:]) == pytest.approx(fairlead, rel=0.015)
    assert np.linalg.norm(force[:3]) == pytest.approx(anchor, rel=0.015)


def test_chain_that_starts_straight_and_slack_comes_to_hang(tmp_path):
    """Its equilibrium is that from the start as it hangs: in part on the floor, with the tension of the catenary."""
    text = chain(*RESTING[0][:3]).replace("masses = 41", "masses = 8")
    straight, hanging = (
        equilibrium(model_of(tmp_path, text.replace("hanging", start)).system, at=0.0)
        for start in ("straight", "hanging")
    )
    assert straight.q == pytest.approx(hanging.q, abs=1e-5)
    assert straight.stable


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::femflex.warning.PhysicsWarning")
def test_heaving_fairlead_pulls_a_chain_as_that_of_orcaflex(tmp_path):
    """Heave of 2 m within 10 s: tension in kN at t = 10 s + k s, of the same test (WD0050_Chain_ZZP1_A1).

    Its tolerance is 15 % of twice the largest change from rest, 991.6 kN.
    """
    published = [1091.072, 1068.128, 990.067, 974.962, 928.686, 900.043, 925.501, 985.74, 987.182, 1043.145, 1092.095]
    with femflex.run(parse_case(chain(*RESTING[0][:3]), path=tmp_path / "c.toml"), tmp_path / "run.h5") as run:
        tension = np.linalg.norm(run["effectors/line/force"][:, -3:], axis=1) / 1e3
    change, expected = tension[100::10] - tension[0], np.array(published) - 991.6
    assert change == pytest.approx(expected, abs=0.15 * 2 * np.abs(expected).max())
    assert np.ptp(tension[100:]) == pytest.approx(193.996, rel=0.05)
