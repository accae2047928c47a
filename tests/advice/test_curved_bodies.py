"""Curved bodies that loads snap through: strain chosen automatically, reported correctly, and run through the snap."""

from __future__ import annotations

import warnings

import numpy as np
import pytest
from support.advised_bodies import noted_body, noted_system
from support.full_solution import Full, held_at

import femflex
from femflex.assembly import build_mesh, build_structure_of
from femflex.case import read_case
from femflex.case.case import Case
from femflex.integrate import IntegrationError
from femflex.reduction.boundary.clamps import held_dofs
from femflex.warning import PhysicsWarning

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
reduction = { method = "cantilever", clamp = "FEET", modes = 2 }
damping = { ratio = 0.02 }
markers.crown = { group = "CROWN" }
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
    def read(*changes: tuple[str, str]) -> Case:
        text = ARCH
        for old, new in changes:
            assert old in text
            text = text.replace(old, new)
        (tmp_path / "arch.inp").write_text(MESH)
        (tmp_path / "arch.toml").write_text(text)
        return read_case(tmp_path / "arch.toml")

    return read


class Dense:
    """The full model with a dense tangent."""

    def __init__(self, full):
        self.force, self.tangent = full.force, lambda x: full.tangent(x).toarray()


def told(case):
    """The body, and what is warned of when it is built in its system."""
    with warnings.catch_warnings(record=True) as found:
        warnings.simplefilter("always")
        body = noted_system(case).bodies["arch"]
    return body, [str(w.message) for w in found if w.category is PhysicsWarning]


@pytest.mark.slow
def test_an_arch_that_its_load_may_snap_gets_responses_to_that_load(arch):
    body, warned = told(arch())
    assert body.strain_form == "nonlinear"
    # the lowest modes sway sideways, and a push on the crown moves neither of them
    assert body.kinds[:11] == ("vibration",) * 2 + ("unanswered attachment",) + ("response",) * 8
    assert "it is curved (rise 0.03 m), load 'push' (600 N at t" in body.note and ") is 3.9" in body.note
    assert "are static responses to z at 'CROWN', up to a deflection of 0.09 m" in body.note
    assert not warned
    same = noted_body(arch(), "arch")  # what `femflex modes` shows
    assert same.kinds == body.kinds and same.note == body.note


@pytest.mark.slow
def test_a_small_load_or_a_choice_of_ones_own_leaves_the_arch_as_it_is(arch):
    body, _ = told(arch(("-600", "-1e-3")))
    assert body.strain_form == "linear" and "response" not in body.kinds
    for strain in ("linear", "condensed"):
        body, warned = told(arch(("damping =", f'strain = "{strain}"\ndamping =')))
        assert body.strain_form == strain and "response" not in body.kinds
        assert any("load 'push' (600 N" in text and ") is 3.9" in text for text in warned)
        assert not any("along y" in text for text in warned)  # the arch stands: the force has one direction
    body, _ = told(arch(("modes = 2", 'modes = 2, derivatives = "auto"')))
    assert "response" not in body.kinds


def test_a_curved_body_with_condensed_strain_says_what_it_does_not_hold(arch):
    body, _ = told(arch(("damping =", 'strain = "condensed"\ndamping =')))
    assert "it is curved (rise 0.03 m)" in body.note and "responses = 8, deflection = '0.09 m'" in body.note


@pytest.mark.slow
def test_the_advice_that_a_curved_body_gets_can_be_followed(arch):
    """Its lowest shape leaves the crown in place, so no response stretches with it: reported, and not refused."""
    own = 'modes = 1, loads = { CROWN = ["z"] }, responses = 8, deflection = "9 cm"'
    body, _ = told(arch(("modes = 2", own), ("damping =", 'strain = "nonlinear"\ndamping =')))
    assert body.kinds.count("response") == 8
    assert "its static responses represent their own loads" in body.note and "'auto' for other loads" in body.note


def test_an_arch_that_stands_and_is_carried_off_by_its_load_is_not_told_of_spin(arch, tmp_path):
    """Newtons written for giganewtons: it is welded to what stands, so no spin and no attitude can be the cause."""
    own = 'modes = 2, attachment = ["z"]'
    case = arch(("-600", "-600e9"), ("modes = 2", own), ("damping =", 'strain = "linear"\ndamping ='))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", PhysicsWarning)
        with pytest.raises(IntegrationError, match="the motion diverges: body 'arch' is displaced by") as caught:
            femflex.run(case, tmp_path / "arch.h5", progress=None)
    said = str(caught.value)
    assert "It does not turn. Check for a load in a wrong unit, and for buckling or snap-through" in said
    assert "in a wrong unit" in said and "spin" not in said and "attitude" not in said


@pytest.mark.slow
def test_by_default_the_arch_runs_through_its_snap_to_where_all_elements_stand(arch, tmp_path):
    """At the end it swings, damped, about the snapped state of all elements under 600 N, its lower limit far below."""
    case = arch()
    table = case.bodies["arch"]
    structure = build_structure_of(case, "arch", table, build_mesh(case, "arch", table))
    full = Full(structure, held_dofs(structure, ["FEET"]))
    crown = structure.translation[[3 * (ELEMENTS // 2) + 2]].toarray()[0][full.free]
    stands = held_at(Dense(full), crown, crown, -np.linspace(0.0, 2.6 * RISE, 150)[1:])
    exact = np.interp(-600.0, stands[:60:-1], -np.linspace(0.0, 2.6 * RISE, 150)[1:][:60:-1])
    seen = femflex.run(case, tmp_path / "arch.h5", progress=None)
    fall = seen["markers/arch.crown/deflection"][-60:, 2]
    assert fall.mean() == pytest.approx(exact, rel=0.02)
