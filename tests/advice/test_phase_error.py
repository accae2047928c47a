"""A small frequency error adds up over many periods: strain is selected by the phase error at the end."""

from __future__ import annotations

import numpy as np
import pytest

import femflex
from femflex.case import parse_case
from femflex.dynamics import compile_system
from femflex.integrate import integrator

EI, LENGTH, TIP, RADIUS, SPIN = 3000.0, 20.0, 15.0, 1.0, 0.023
CASE = """
[run]
duration = {duration}
output_step = 0.5
[attitude]
rates = [0, 0, {spin}]
[bodies.hub]
kind = "rigid"
mass = 2000
inertia = [900, 900, 900]
markers.east = {{ position = [1, 0, 0] }}
markers.west = {{ position = [-1, 0, 0], orientation = {{ x = [-1, 0, 0], y = [0, -1, 0] }} }}
"""
BOOM = """
[bodies.{name}]
kind = "analytic"
length = {length}
mass_per_length = 0.01
EA = 1e7
EIy = {EI}
EIz = {EI}
GJ = 1e3
functions = {{ z = 2 }}
{strain}
initial = {{ marker = "tip", displacement = [0, 0, {bend}] }}
[bodies.{name}_mass]
kind = "rigid"
mass = {tip}
inertia = [1e-3, 1e-3, 1e-3]
[[joints]]
kind = "weld"
parent = "hub"
parent_marker = "{name}"
child = "{name}"
child_marker = "root"
[[joints]]
kind = "weld"
parent = "{name}"
parent_marker = "tip"
child = "{name}_mass"
"""
FIRST = np.sqrt(3 * EI / (TIP * LENGTH**3))  # of a boom without mass, held
GAIN = 6 / 5 * TIP * SPIN**2 * (RADIUS + LENGTH) / LENGTH / (3 * EI / LENGTH**3)  # of an axial force at its tip


def craft(tmp_path, duration=300.0, spin=SPIN, bend=0.312, strain=""):
    text = CASE.format(duration=duration, spin=spin)
    for name in ("east", "west"):
        text += BOOM.format(name=name, length=LENGTH, EI=EI, bend=bend, tip=TIP, strain=strain)
    return parse_case(text, tmp_path / "case.toml")


@pytest.mark.slow
def test_error_of_linear_strain_matches_its_phase_error(tmp_path):
    """Of two harmonic motions phi apart, 2 a sin(phi / 2); the selected form includes the axial force."""
    tips = {}
    for strain in ("", 'strain = "linear"'):
        system = femflex.build_system(craft(tmp_path, strain=strain))
        model, times = compile_system(system), np.linspace(250.0, 300.0, 201)
        states = integrator("dop853", rtol=1e-9, atol=1e-9).solve(model, np.append(0.0, times), model.x0).states
        tips[strain] = model.observe(times, states[1:])["markers/east.tip/deflection"][:, 2]
    chosen, linear = tips.values()
    phase = FIRST * 300.0 * (np.sqrt(1 + GAIN) - 1)
    assert np.abs(chosen - linear).max() == pytest.approx(2 * 0.312 * np.sin(phase / 2), rel=0.25)
