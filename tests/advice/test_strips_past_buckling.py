"""Strips pressed past Euler's load with what a case leaves out chosen: their energy is bounded, and they lie by the
elastica."""

import warnings

import numpy as np
import pytest
from scipy.optimize import minimize
from scipy.special import ellipk

from femflex.body.symmetric import form, gradient
from femflex.case import read_case
from femflex.pipeline.case_bodies import build_body
from femflex.pipeline.decisions import build_system
from femflex.warning import PhysicsWarning

RUN = '\n[run]\nduration = "1 s"\noutput_step = 0.05\n'
STRIP = f"""{RUN}
[sections.strip]
kind = "stiffness"
EA = 2.8e9
EIy = 5.6e6
EIz = 1.4e4
GJ = 1.2e3
mass_per_length = 1.2
ry = 0.005
rz = 0.005

[bodies.boom]
kind = "flexible"
mesh = "boom.inp"
members = [{{ group = "BOOM", family = "beam", section = "strip", options = {{ orientation = [0, 1, 0] }} }}]
reduction = {{ method = "cantilever", clamp = "ROOT", modes = 4 }}
markers.tip = {{ group = "TIP" }}
strain = "condensed"

[[loads]]
name = "weight"
body = "boom"
marker = "tip"
force = [0, 0, -1400]
"""
HELD = '\n[[joints]]\nkind = "weld"\nchild = "boom"\n'
LENGTH, EI = 3.0, 1.4e4
EULER = np.pi**2 * EI / (4 * LENGTH**2)
NONLINEAR = 'strain = "condensed"', 'strain = "nonlinear"'


def changed(text, *changes):
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    return text


def pressed(part):
    """The load as a dead one along the strip, which requests shapes of the tip in all directions."""
    return "[0, 0, -1400]", f'[{-part * EULER}, 0, 0]\nframe = "inertial"'


def stiff_plane_ratio(ratio):
    return "5.6e6", repr(ratio * EI)


def body(write_case, text, *changes):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", PhysicsWarning)
        return build_body(read_case(write_case(changed(text, *changes))), "boom")


def scaled(strain):
    """Sizes (n,) of the coordinates at which each alone stores half a joule."""
    return 1 / np.sqrt(np.diag(strain.V1))


def lowest_quartic(strain, tries=6):
    """The least of the quartic form on the sphere of coordinates so scaled, over the largest that random ones have."""
    size, rng = scaled(strain), np.random.default_rng(3)
    starts = rng.normal(size=(tries, len(size)))
    unit = max(abs(form(strain.V3, size * d / np.linalg.norm(d), 4)) for d in starts)

    def value(x):
        length = np.linalg.norm(x)
        d = x / length
        slope = size * gradient(strain.V3, size * d, 4)
        return form(strain.V3, size * d, 4) / unit, (slope - (slope @ d) * d) / length / unit

    return min(minimize(value, start, jac=True, method="BFGS").fun for start in starts)


def settled(boom, part):
    """Displacement (3,) of the tip over the length where V - f.d is least, from a small twisted bend in both planes."""
    strain, n = boom.strain, boom.n_modes
    size, tip = scaled(strain), boom.markers["tip"].phi[:, : boom.n_modes]
    force, unit = tip[0] * -part * EULER, 1e-2 * EULER
    start = np.zeros(n)
    for row, amount in ((tip[1], 1e-2 * LENGTH), (tip[2], 1e-4 * LENGTH), (boom.markers["tip"].psi[0, :n], 0.02)):
        shape = row * size**2
        start += amount * shape / (row @ shape)
    energy = minimize(
        lambda x: (strain.energy(size * x) - force @ (size * x)) / unit,
        start / size,
        jac=lambda x: size * (strain.force(size * x) - force) / unit,
        method="BFGS",
        options={"maxiter": 5000, "gtol": 1e-9},
    )
    return tip @ (size * energy.x) / LENGTH


def elastica(part):
    """w / L of the column: (2 K / pi)^2 = part, w / L = 2 sin(angle / 2) / K."""
    m = np.interp(part, [(2 * ellipk(m) / np.pi) ** 2 for m in np.linspace(0, 0.5, 20001)], np.linspace(0, 0.5, 20001))
    return 2 * np.sqrt(m) / ellipk(m)


@pytest.mark.slow
@pytest.mark.parametrize("ratio", [1, 50, 400])
@pytest.mark.parametrize("part", [1.008, 1.0127, 1.063])
def test_strip_of_nonlinear_strain_matches_elastica(write_case, ratio, part):
    """0.162, 0.200, 0.422 of the length. Nearest to Euler's load what the shapes lack of it counts most."""
    shapes = "modes = 4", 'modes = 4, derivatives = "auto", loads = { TIP = ["x", "y", "z", "rx", "ry", "rz"] }'
    text = changed(STRIP, NONLINEAR, shapes, pressed(part), stiff_plane_ratio(ratio)) + HELD + 'child_marker = "ROOT"\n'
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", PhysicsWarning)
        boom = build_system(read_case(write_case(text))).bodies["boom"]
    tip = settled(boom, part)
    assert np.hypot(*tip[1:]) == pytest.approx(elastica(part), rel=0.1)
    assert ratio == 1 or abs(tip[2]) < 1e-3


@pytest.mark.sampled(1)
@pytest.mark.parametrize("ratio", [1, 400])
@pytest.mark.parametrize("loads", ["", ", loads = {}"])
def test_quartic_energy_of_meshed_beam_is_positive(write_case, ratio, loads):
    few = "modes = 4", f'modes = 4, derivatives = "auto"{loads}'
    assert lowest_quartic(body(write_case, STRIP, NONLINEAR, few, pressed(1.0), stiff_plane_ratio(ratio)).strain) > 0
