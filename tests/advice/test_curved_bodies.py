"""Curved bodies that loads snap through, on static responses to these loads."""

from __future__ import annotations

import numpy as np
import pytest
from support.full_solution import FullModel, load_factors_at

import femflex
from femflex.assembly import build_mesh, build_structure_of
from femflex.case import read_case
from femflex.case.case import Case
from femflex.reduction.boundary.rigid import held_dofs

SPAN, RISE, ELEMENTS = 1.0, 0.03, 16
RADIUS = (SPAN**2 / 4 + RISE**2) / (2 * RISE)
ANGLES = np.arcsin(SPAN / 2 / RADIUS) * np.linspace(-1.0, 1.0, ELEMENTS + 1)
NODES = [
    f"{k + 1}, {RADIUS * np.sin(a):.9f}, 0.0, {RADIUS * np.cos(a) + RISE - RADIUS:.9f}" for k, a in enumerate(ANGLES)
]
MESH = "\n".join(
    [
        "*NODE",
        *NODES,
        "*ELEMENT, TYPE=B31, ELSET=ARCH",
        *(f"{k}, {k}, {k + 1}" for k in range(1, ELEMENTS + 1)),
        f"*NSET, NSET=FEET\n1, {ELEMENTS + 1}",
        f"*NSET, NSET=CROWN\n{ELEMENTS // 2 + 1}\n",
    ]
)
ARCH = """
title = "shallow clamped arch pushed at its crown"
[run]
duration = "0.5 s"
samples = 501
[materials.al]
E = "70 GPa"
nu = 0.3
density = "2700 kg/m^3"
[sections.s]
kind = "rectangle"
width = "20 mm"
height = "5 mm"
[bodies.arch]
kind = "flexible"
mesh = "arch.inp"
members = [{ group = "ARCH", family = "beam", section = "s", material = "al" }]
strain = "nonlinear"
damping = { ratio = 0.02 }
markers.crown = { group = "CROWN" }
[bodies.arch.reduction]
method = "cantilever"
clamp = "FEET"
modes = 2
derivatives = "none"
responses = 8
deflection = "9 cm"
loads = { CROWN = ["z"] }
[[joints]]
kind = "weld"
child = "arch"
child_marker = "FEET"
[[loads]]
name = "push"
body = "arch"
marker = "crown"
frame = "inertial"
times = ["0 s", "0.4 s", "0.5 s"]
force = [[0, 0, 0], [0, 0, -600], [0, 0, -600]]
"""


@pytest.fixture
def arch(tmp_path):
    def read_arch(*changes: tuple[str, str]) -> Case:
        text = ARCH
        for old, new in changes:
            assert old in text
            text = text.replace(old, new)
        (tmp_path / "arch.inp").write_text(MESH)
        (tmp_path / "arch.toml").write_text(text)
        return read_case(tmp_path / "arch.toml")

    return read_arch


class Dense:
    """The full model with a dense tangent."""

    def __init__(self, full):
        self.force, self.tangent = full.force, lambda x: full.tangent(x).toarray()


@pytest.mark.slow
def test_arch_on_responses_snaps_to_equilibrium_of_full_structure(arch, tmp_path):
    """At the end it swings, damped, about the snapped state of all elements under 600 N, its lower limit far below."""
    case = arch()
    table = case.bodies["arch"]
    structure = build_structure_of(case, "arch", table, build_mesh(case, "arch", table))
    full = FullModel(structure, held_dofs(structure, ["FEET"]))
    crown = structure.translation[[3 * (ELEMENTS // 2) + 2]].toarray()[0][full.free]
    equilibrium_forces = load_factors_at(Dense(full), crown, crown, -np.linspace(0.0, 2.6 * RISE, 150)[1:])
    exact = np.interp(-600.0, equilibrium_forces[:60:-1], -np.linspace(0.0, 2.6 * RISE, 150)[1:][:60:-1])
    run = femflex.run(case, tmp_path / "arch.h5", progress=None)
    fall = run["markers/arch.crown/deflection"][-60:, 2]
    assert fall.mean() == pytest.approx(exact, rel=0.02)
