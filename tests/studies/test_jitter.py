"""Pointing budgets against closed forms of oscillators, rotors and beams, and against histories."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.linalg import expm, solve_continuous_lyapunov
from scipy.optimize import brentq

import femflex
from femflex.case.read import parse_case
from femflex.studies.jitter import (
    base_modes,
    combined_peaks,
    full_response,
    jitter,
    jitter_plant,
    miles,
    shock_spectrum,
)

M, K, C = 2.0, 200.0, 0.8
OMEGA, ZETA = np.sqrt(K / M), C / (2.0 * np.sqrt(K * M))
F, Q = OMEGA / (2.0 * np.pi), 1.0 / (2.0 * ZETA)
OSCILLATOR = f"""
title = "an oscillator"
run = {{ duration = 1, output_step = 0.1 }}
bodies.mass = {{ kind = "rigid", mass = {M}, inertia = [1, 1, 1] }}
joints = [{{ kind = "prismatic", child = "mass", axis = [1, 0, 0], stiffness = {K}, damping = {C} }}]
"""
TABLES = {  # disturbance, output, rms
    "force": (
        'kind = "random", body = "mass", frequencies = [1e-4, 1e4], force = [[3, 0, 0], [3, 0, 0]]',
        "displacement",
        np.sqrt(3.0 / (4.0 * C * K)),
    ),
    "base": (
        'kind = "base", direction = [2, 0, 0], frequencies = [1e-4, 1e5], psd = ["0.01 g0^2/Hz", "0.01 g0^2/Hz"]',
        "acceleration",
        miles(F, Q, 0.01 * 9.80665**2) * np.sqrt(1.0 + 1.0 / Q**2),
    ),
    "lines": (
        'kind = "lines", body = "mass", frequencies = [1, 2], force = [[1, 0, 0], [5, 0, 0]]',
        "velocity",
        np.sqrt(sum((a * w / abs(K - M * w * w + 1j * C * w)) ** 2 / 2 for a, w in ((1, 2 * np.pi), (5, 4 * np.pi)))),
    ),
    "imbalance": (
        'kind = "wheel", body = "mass", speed = 8, static_imbalance = "1 g cm"',
        "displacement",
        1e-5 * 64.0 / abs(K - M * 64.0 + 8j * C) / np.sqrt(2.0),
    ),
    "harmonic": (
        'kind = "wheel", body = "mass", speed = 8, harmonics = [2.5], radial_force = ["1e-6 N/rpm^2"]',
        "displacement",
        1e-6 * (8 * 30 / np.pi) ** 2 / abs(K - M * 400.0 + 20j * C) / np.sqrt(2.0),
    ),
}


def oscillator(disturbance: str, kind: str, more: str = "") -> femflex.Case:
    jitter_table = f'jitter.outputs.m = {{ kind = "{kind}", body = "mass" }}\n{more}'
    return parse_case(f"{OSCILLATOR}disturbances.d = {{ {disturbance} }}\n{jitter_table}", Path("case.toml"))


@pytest.mark.parametrize("name", TABLES)
def test_rms_of_an_oscillator_is_the_closed_form(name):
    disturbance, kind, expected = TABLES[name]
    budget = jitter(oscillator(disturbance, kind))
    rms, unit = budget.rms_of("m:x")
    assert rms == pytest.approx(expected, rel=1e-4)
    assert unit == {"displacement": "m", "velocity": "m/s", "acceleration": "m/s^2"}[kind]
    assert budget.by_mode.sum(axis=0) == pytest.approx(budget.mean_squares, rel=1e-12)
    assert budget.cumulative()[-1] == pytest.approx(budget.mean_squares, rel=1e-12)


def test_band_limited_noise_counts_within_its_band_only():
    budget = jitter(oscillator(TABLES["force"][0].replace("[1e-4, 1e4]", "[1.2, 1.8]"), "displacement"))
    f = np.linspace(1.2, 1.8, 400_001)
    S = 3.0 / np.abs(K - M * (2 * np.pi * f) ** 2 + 2j * np.pi * f * C) ** 2
    assert budget.rms_of("m:x")[0] == pytest.approx(np.sqrt(np.trapezoid(S, f)), rel=1e-6)


@pytest.mark.parametrize("scale", [1e-12, 1.0])
def test_small_motions_keep_their_digits(scale):
    case = oscillator(f'kind = "lines", body = "mass", frequencies = [1], force = [[{scale}, 0, 0]]', "displacement")
    w = 2.0 * np.pi
    assert jitter(case).rms_of("m:x")[0] == pytest.approx(
        scale / abs(K - M * w * w + 1j * C * w) / np.sqrt(2), rel=1e-9
    )


def test_two_oscillators_in_white_noise_obey_the_equation_of_lyapunov():
    text = """
    title = "two"
    run = { duration = 1, output_step = 0.1 }
    bodies.a = { kind = "rigid", mass = 3, inertia = [1, 1, 1] }
    bodies.b = { kind = "rigid", mass = 1, inertia = [1, 1, 1] }
    joints = [
      { kind = "prismatic", child = "a", axis = [1, 0, 0], stiffness = 500, damping = 2 },
      { kind = "prismatic", child = "b", parent = "a", axis = [1, 0, 0], stiffness = 100, damping = 0.5 },
    ]
    disturbances.d = { kind = "random", body = "a", frequencies = [1e-4, 1e5], force = [[7, 0, 0], [7, 0, 0]] }
    jitter.outputs = { a = { kind = "displacement", body = "a" }, b = { kind = "velocity", body = "b" } }
    """
    budget = jitter(parse_case(text, Path("case.toml")))
    Ma, Ka, Ca = np.diag([3.0, 1.0]), np.array([[600.0, -100.0], [-100.0, 100.0]]), np.array([[2.5, -0.5], [-0.5, 0.5]])
    A = np.block([[np.zeros((2, 2)), np.eye(2)], [-np.linalg.solve(Ma, Ka), -np.linalg.solve(Ma, Ca)]])
    b = np.array([[0.0], [0.0], [1.0 / 3.0], [0.0]])
    P = solve_continuous_lyapunov(A, -b @ b.T * 7.0 / 2.0)
    assert budget.rms_of("a:x")[0] == pytest.approx(np.sqrt(P[0, 0]), rel=1e-4)
    assert budget.rms_of("b:x")[0] == pytest.approx(np.sqrt(P[3, 3]), rel=1e-4)


TRAINS = {  # joint, mass and inertia, disturbance, output, pulses
    "thruster": (
        "prismatic",
        f"mass = {M}, inertia = [1, 1, 1]",
        'kind = "pulses", force = [6, 0, 0]',
        "displacement",
        [6.0],
    ),
    "drive": (
        "revolute",
        f"mass = 1, inertia = [{M}, {M}, {M}]",
        'kind = "stepper", axis = [1, 0, 0], torque = 6',
        "rotation",
        [6.0, -6.0],
    ),
}


@pytest.mark.parametrize("name", TRAINS)
def test_pulses_match_the_periodic_motion_of_an_oscillator(name):
    joint, inertia, disturbance, output, pulses = TRAINS[name]
    period, width, n = 0.4, 0.03, 40_000
    text = OSCILLATOR.replace("prismatic", joint).replace(f"mass = {M}, inertia = [1, 1, 1]", inertia) + (
        f'disturbances.d = {{ {disturbance}, body = "mass", rate = {1 / period}, width = {width} }}\n'
        f'jitter = {{ band = [0.1, 2000], outputs.m = {{ kind = "{output}", body = "mass" }} }}'
    )
    t = np.arange(n) * period / n
    force = sum(f * ((t >= k * width) & (t < (k + 1) * width)) for k, f in enumerate(pulses))
    A = np.array([[0.0, 1.0], [-K / M, -C / M]])
    step, whole = expm(A * period / n), expm(A * period)
    g = np.linalg.solve(A, (step - np.eye(2)) @ np.array([0.0, 1.0 / M]))
    x = np.zeros((n + 1, 2))
    for _ in range(2):  # the response from rest gives the periodic state, and this the motion
        for k in range(n):
            x[k + 1] = step @ x[k] + g * force[k]
        x[0] = np.linalg.solve(np.eye(2) - whole, x[n] - whole @ x[0])
    rms = jitter(parse_case(text, Path("case.toml"))).rms_of("m:x")[0]
    assert rms == pytest.approx(np.std(x[1:, 0]), rel=1e-4)


ROTOR = """
title = "a rotor in a gimbal"
run = { duration = 1, output_step = 0.1 }
bodies.frame = { kind = "rigid", mass = 2, inertia = [0.3, 0.3, 0.4] }
disturbances.w = { kind = "wheel", body = "frame", dynamic_imbalance = "1e-6 kg m^2", speeds = [10, 600], INERTIA }
jitter.outputs.p = { kind = "pointing", body = "frame", axis = [0, 0, 1] }
WHEEL
[[joints]]
kind = "universal"
child = "frame"
axes = [[1, 0, 0], [0, 1, 0]]
stiffness = [300, 300]
damping = [0.05, 0.05]
"""


@pytest.mark.parametrize("mounted", [False, True])
def test_imbalance_over_a_range_of_speeds_meets_the_forward_whirl_alone(mounted):
    text = ROTOR.replace("INERTIA", 'wheel = "w1"' if mounted else "inertia = 0.02")
    wheel = 'wheels.w1 = { body = "frame", inertia = 0.02, inertia_in_body = "separate" }'
    text = text.replace("WHEEL", wheel if mounted else "")
    scan = jitter(parse_case(text, Path("case.toml"))).contributions["w"].scan
    speed = scan.speeds
    expected = 1e-6 * speed**2 / np.abs(300.0 - (0.3 - 0.02) * speed**2 + 0.05j * speed) / np.sqrt(2.0)
    assert np.sqrt(scan.mean_squares[:, 0]) == pytest.approx(expected, rel=1e-8)
    assert speed[scan.worst_indices[0]] == pytest.approx(np.sqrt(300.0 / 0.28), rel=1e-4)


BEAM = """
title = "a beam on a base"
run = { duration = 1, output_step = 0.1 }
joints = [{ name = "clamp", kind = "weld", child = "beam", child_marker = "root" }]
[bodies.beam]
kind = "analytic"
length = 1
mass_per_length = 1
EA = 1e7
EIy = 100
EIz = 100
GJ = 100
rotary_inertia = false
functions = { y = 6, z = 0 }
strain = "linear"
damping = { ratio = RATIO }
[jitter.outputs]
tip = { kind = "displacement", body = "beam", marker = "tip" }
acceleration = { kind = "acceleration", body = "beam", marker = "tip" }
clamp = { channel = "joints/clamp/force:y" }
[disturbances]
"""


def exact_modes(number: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Frequencies [rad/s], participations and tip amplitudes of a unit cantilever with EI = 100."""
    roots = [
        brentq(lambda b: np.cos(b) + 1.0 / np.cosh(b), (k - 0.5) * np.pi - 1.3, (k - 0.5) * np.pi + 1.3)
        for k in range(1, number + 1)
    ]
    b = np.array(roots)
    s = (np.cosh(b) + np.cos(b)) / (np.sinh(b) + np.sin(b))
    return 10.0 * b**2, 2.0 * s / b, 2.0 * (-1.0) ** (np.arange(number) + 1) * -1.0


def test_beam_on_a_shaken_base_has_the_motion_of_its_exact_modes():
    noise = 'd = { kind = "base", direction = [0, 1, 0], frequencies = [0.1, 300], psd = [1, 1] }'
    budget = jitter(parse_case(BEAM.replace("RATIO", "0.01") + noise, Path("case.toml")))
    w, gamma, tip = exact_modes(6)
    f = np.unique(
        np.concatenate(
            [np.linspace(0.1, 300.0, 200_001), *(k / (2 * np.pi) * (1 + np.linspace(-0.1, 0.1, 8001)) for k in w)]
        )
    )
    f = f[(f >= 0.1) & (f <= 300.0)]
    s = 2j * np.pi * f[:, None]
    H = (-gamma * tip / (s**2 + 0.02 * w * s + w**2)).sum(axis=1)
    assert budget.rms_of("tip:y")[0] == pytest.approx(np.sqrt(np.trapezoid(np.abs(H) ** 2, f)), rel=1e-3)
    force = 1.0 + (-(gamma**2) * s**2 / (s**2 + 0.02 * w * s + w**2)).sum(axis=1)  # of a mass of 1 kg
    assert budget.rms_of("clamp")[0] == pytest.approx(np.sqrt(np.trapezoid(np.abs(force) ** 2, f)), rel=1e-3)
    total = 1.0 + s[:, 0] ** 2 * H
    assert budget.rms_of("acceleration:y")[0] == pytest.approx(np.sqrt(np.trapezoid(np.abs(total) ** 2, f)), rel=1e-3)


def test_modes_on_a_base_have_the_effective_masses_of_a_clamped_beam():
    noise = 'd = { kind = "base", direction = [0, 1, 0], frequencies = [0.1, 300], psd = [4, 4] }'
    modes = base_modes(jitter_plant(parse_case(BEAM.replace("RATIO", "0.01") + noise, Path("case.toml"))), "d")
    assert [mode.share for mode in modes[:4]] == pytest.approx([0.613076, 0.188300, 0.064732, 0.033087], rel=1e-4)
    assert modes[0].acceleration == pytest.approx(miles(exact_modes(1)[0][0] / (2 * np.pi), 50.0, 4.0), rel=1e-5)


def test_notch_keeps_the_force_of_the_interface_at_its_limit():
    table = 'd = { kind = "base", direction = [0, 1, 0], frequencies = [0.1, 300], psd = [1, 1], NOTCH }'
    notch = 'interface = "joints/clamp/force:y", force = [4, 4]'
    text = BEAM.replace("RATIO", "0.01") + table
    budget = jitter(parse_case(text.replace("NOTCH", notch), Path("case.toml")))
    w, gamma, _ = exact_modes(6)
    s = 2j * np.pi * budget.frequencies[:, None]
    mass = np.abs(1.0 + (-(gamma**2) * s**2 / (s**2 + 0.02 * w * s + w**2)).sum(axis=1))  # apparent, of 1 kg
    expected = np.sqrt(budget.weights @ np.where(budget.frequencies <= 300.0, np.minimum(mass**2, 4.0), 0.0))
    assert budget.rms_of("clamp")[0] == pytest.approx(expected, rel=1e-3)
    ratio, frequency = budget.notches()["d"]
    assert ratio == pytest.approx(mass.max() ** 2 / 4.0, rel=1e-2) and frequency == pytest.approx(
        w[0] / (2 * np.pi), rel=1e-2
    )


def test_structural_damping_limits_a_resonance():
    w, _, tip = exact_modes(1)
    f = w[0] / (2 * np.pi)
    text = BEAM.replace("RATIO", "0").replace("[jitter.outputs]", "[jitter]\nloss_factor = 0.02\n[jitter.outputs]")
    text += f'd = {{ kind = "lines", body = "beam", marker = "tip", frequencies = [{f}], force = [[0, 1e-3, 0]] }}'
    expected = 1e-3 * tip[0] ** 2 / (0.02 * w[0] ** 2) / np.sqrt(2.0)
    assert jitter(parse_case(text, Path("case.toml"))).rms_of("tip:y")[0] == pytest.approx(expected, rel=2e-3)


def test_shock_spectrum_of_a_half_sine_and_the_peak_of_an_oscillator():
    t = np.arange(0.0, 0.2, 1e-5)
    pulse = np.where(t < 0.01, 100.0 * np.sin(np.pi * t / 0.01), 0.0)
    frequencies = np.linspace(20.0, 200.0, 361)
    spectrum = shock_spectrum(t, pulse, frequencies, 0.0)
    # largest of |2 (r / (1 - r^2)) cos(pi r)| after the pulse and of its own peak within, r = 2 f T
    assert spectrum.max() / 100.0 == pytest.approx(1.7686, rel=1e-3)
    assert frequencies[np.argmax(spectrum)] * 0.01 == pytest.approx(0.81, abs=0.01)
    case = oscillator(
        'kind = "shock", direction = [1, 0, 0], frequencies = [0.1, 100], peaks = ["5 g0", "5 g0"]', "acceleration"
    )
    srss, cqc, each = combined_peaks(jitter_plant(case), "d")
    assert srss[0] == pytest.approx(5 * 9.80665, rel=5e-3) and cqc[0] == pytest.approx(srss[0], rel=1e-12)
    assert each.shape == (1, 3)
    with pytest.raises(ValueError, match="evenly spaced"):
        shock_spectrum(np.array([0.0, 1.0, 3.0]), np.zeros(3), frequencies)


def test_sums_of_outputs_and_the_study_over_modes():
    more = 'jitter.outputs.sum = { parts = { "m:x" = 2, "m:y" = 1 } }\n'
    disturbance, kind, expected = TABLES["force"]
    budget = jitter(oscillator(disturbance, kind, more))
    assert budget.rms_of("sum")[0] == pytest.approx(2.0 * expected, rel=1e-4)
    with pytest.raises(ValueError, match="no output"):
        budget.rms_of("n:x")


@pytest.mark.slow
def test_history_of_a_random_force_has_the_rms_of_the_spectrum():
    """Loads drawn from the spectrum as sums of 400 lines of random phases, over one period of the sum."""
    n, df = 400, 0.01
    f = df * np.arange(1, n + 1)
    generator = np.random.default_rng(7)
    t = np.arange(0.0, 1.0 / df + 1e-9, 0.02)
    lines = np.sqrt(2.0 * 3.0 * df) * np.cos(2 * np.pi * np.outer(t, f) + generator.uniform(0, 2 * np.pi, n))
    force = np.column_stack([lines.sum(axis=1), 0 * t, 0 * t])
    case = oscillator(
        'kind = "random", body = "mass", frequencies = [0.005, 4.005], force = [[3, 0, 0], [3, 0, 0]]', "displacement"
    )
    system = femflex.build_system(case)
    twice = np.concatenate([t[:-1], t + 1.0 / df])
    load = femflex.Load("noise", "mass", times=twice, force=np.vstack([force[:-1], force]))
    run = femflex.simulate(replace(system, loads=(load,)), 2.0 / df, output_step=0.02)
    x = run["q"][len(t) :, 0]  # the second period
    assert np.sqrt(np.mean(x**2)) == pytest.approx(jitter(case).rms_of("m:x")[0], rel=0.05)


MESHED = """
title = "a beam on a hub that slides"
run = { duration = 1, output_step = 0.1 }
bodies.hub = { kind = "rigid", mass = 5, inertia = [1, 1, 1] }
materials.steel = { E = "200 GPa", nu = 0.3, density = "8000 kg/m^3" }
sections.bar = { kind = "circle", radius = "20 mm" }
disturbances.hub = { kind = "random", body = "hub", frequencies = [0.1, 60], force = [[0, 1, 0], [0, 1, 0]] }
disturbances.tip = { kind = "lines", body = "beam", marker = "tip", frequencies = [1], force = [[0, 1, 0]] }
jitter.outputs.tip = { kind = "displacement", body = "beam", marker = "tip" }
jitter.outputs.hub = { kind = "displacement", body = "hub" }
joints = [
  { kind = "prismatic", child = "hub", axis = [0, 1, 0], stiffness = 300 },
  { kind = "weld", parent = "hub", child = "beam", child_marker = "root" },
]
[bodies.beam]
kind = "flexible"
mesh = "beam10.msh"
refine = 2
markers.tip = {}
members = [{ group = "beam", family = "beam", section = "bar", material = "steel" }]
reduction = { method = "cantilever", clamp = "root", modes = 1, loads = {}, joints = {} }
damping = { ratio = 0.01 }
"""


def test_full_response_is_that_of_the_whole_beam_where_one_mode_is_not():
    """Euler and Bernoulli's beam with a loss factor of twice the ratio, solved at each frequency."""
    plant = jitter_plant(parse_case(MESHED, Path("meshes/case.toml")))
    f = np.array([0.2, 3.0, 12.5, 40.0])
    with pytest.warns(femflex.PhysicsWarning, match="more modes"):
        answer = full_response(plant, f)
    w, EI, m, L = 2 * np.pi * f, 200e9 * np.pi * 0.04**4 / 64 * (1 + 0.02j), 8000.0 * np.pi * 0.02**2, 10.0
    k = (m * w**2 / EI) ** 0.25
    s, c, sh, ch = np.sin(k * L), np.cos(k * L), np.sinh(k * L), np.cosh(k * L)
    follows = (c + ch) / (1 + c * ch)  # tip over hub; also the force on the hub over that on a clamped beam's tip
    hub = 1.0 / (300.0 - 5.0 * w**2 - EI * k**3 * (s * ch + c * sh) / (1 + c * ch))
    tip = (s * ch - c * sh) / (EI * k**3 * (1 + c * ch)) + follows**2 * hub
    of_tip, of_hub = plant.names.index("tip:y"), plant.names.index("hub:y")
    assert answer.full["hub"][:, of_hub, 1] == pytest.approx(hub, rel=2e-3)
    assert answer.full["hub"][:, of_tip, 1] == pytest.approx(follows * hub, rel=2e-3)
    assert answer.full["tip"][:, of_hub, 1] == pytest.approx(follows * hub, rel=2e-3)
    assert answer.full["tip"][:, of_tip, 1] == pytest.approx(tip, rel=2e-3)
    assert np.abs(answer.left_out("tip")[-1, of_tip]) > 0.5 and np.abs(answer.left_out("hub")[0, of_hub]) < 0.01


SAMPLED = """
title = "a sampled controller"
run = { duration = 1, output_step = 0.1 }
bodies.craft = { kind = "rigid", mass = 1, inertia = [2, 1, 1] }
joints = [{ kind = "revolute", child = "craft", axis = [1, 0, 0], stiffness = 8, damping = 0.1 }]
sensors.angle = { kind = "attitude", body = "craft" }
sensors.rate = { kind = "rate", body = "craft" }
controllers.law = { kind = "pd", inputs = ["angle.x", "rate.x"], stiffness = 30, damping = 6, period = 0.25 }
controllers.share = { kind = "allocation", inputs = ["law"], effect = [[-1]], period = 0.25 }
wheels.x = { body = "craft", axis = [1, 0, 0], inertia = 0.01, inertia_in_body = "contained", command = "share.y" }
disturbances.d = { kind = "lines", body = "craft", frequencies = [1.2], torque = [[1e-3, 0, 0]] }
jitter.outputs.m = { kind = "rotation", body = "craft" }
"""


def test_sampled_controller_answers_a_line_as_in_a_run():
    """Four samples a second under 1.2 Hz: the line of the run at this frequency, over a common period of 5 s."""
    case = parse_case(SAMPLED, Path("case.toml"))
    t = np.linspace(0.0, 20.0, 4_001)
    torque = np.column_stack([1e-3 * np.cos(2 * np.pi * 1.2 * t), 0 * t, 0 * t])
    system = replace(femflex.build_system(case), loads=(femflex.Load("line", "craft", times=t, torque=torque),))
    run = femflex.simulate(system, 20.0, output_step=0.01)
    late = run["q"][-501:-1, 0]
    amplitude = 2.0 * abs(np.mean(late * np.exp(-2j * np.pi * 1.2 * 0.01 * np.arange(500))))
    rms = jitter(case).rms_of("m:x")[0]
    assert rms == pytest.approx(amplitude / np.sqrt(2.0), rel=2e-3)
    assert rms != pytest.approx(1e-3 / abs(8 - 2 * (2.4 * np.pi) ** 2) / np.sqrt(2.0), rel=0.05)  # that of an open loop
