"""Loads on the tips of beams on admissible functions: few functions, and the static shapes that are added for them."""

import warnings
from pathlib import Path

import numpy as np
import pytest

from femflex import Case, System, build_system, equilibrium
from femflex.case import parse_case
from femflex.pipeline.decisions import decided
from femflex.warning import TruncationWarning

EI, GJ = 100.0, 10.0
CASE = """
title = "tip load"
[run]
duration = 5
[bodies.boom]
kind = "{kind}"
length = 1
mass_per_length = 1
EIy = 100
EIz = 100
GJ = 10
ry = 0.01
rz = 0.01
strain = "linear"
direction = [0, 0, 1]
orientation = [1, 0, 0]
functions = {{ {functions} }}
[[joints]]
kind = "weld"
child = "boom"
child_marker = "root"
[[loads]]
name = "push"
body = "boom"
marker = "tip"
{load}
"""
KINDS = {"analytic": 'analytic"\nEA = 1e6\n', "deploying": 'deploying"\nfamily = "beam"\nstock = 1\n'}


def case_of(kind: str, functions: str, load: str) -> Case:
    text = CASE.format(kind="KIND", functions=functions, load=load).replace('KIND"\n', KINDS[kind])
    return parse_case(text, Path("beam.toml"))


def system_of(kind: str, functions: str, load: str) -> System:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", TruncationWarning)  # the third frequency of one function
        return build_system(case_of(kind, functions, load))


def tip(system: System, turn: bool) -> np.ndarray:
    """Displacement [m] or rotation [rad] (3,) of the tip at equilibrium, body axes."""
    state, body = equilibrium(system), system.bodies["boom"]
    marker = body.markers["tip"]
    return (marker.psi if turn else marker.phi) @ body.amplitudes(state.q)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize(
    ("functions", "load", "turn", "expected", "added"),
    [
        ("y = 1, z = 1", "force = [0, 0.1, 0]", False, [0, 0.1 / (3 * EI), 0], 4),
        ("y = 2, z = 2", "force = [0.1, 0, 0]", False, [0.1 / (3 * EI), 0, 0], 0),
        ("y = 2, z = 2", "torque = [0.1, 0, 0]", True, [0.1 / EI, 0, 0], 4),
        ("torsion = 2", "torque = [0, 0, 0.1]", True, [0, 0, 0.1 / GJ], 1),
        ("y = 2, z = 2", "torque = [0, 0, 0.1]", True, [0, 0, 0], 0),  # no function twists: rigid by request
    ],
)
def test_few_functions_answer_loads_on_the_tip_as_the_beam_does(
    kind: str, functions: str, load: str, turn: bool, expected: list[float], added: int
) -> None:
    """The beam stands along z. Without static shapes a torque is answered to 90 % by two functions, a moment to 80."""
    system = system_of(kind, functions, load)
    own = sum(int(part.split("=")[1]) for part in functions.split(","))
    assert system.bodies["boom"].n_modes == own + added
    np.testing.assert_allclose(tip(system, turn), expected, rtol=1e-9 if added else 6e-3, atol=1e-12)


@pytest.mark.parametrize("kind", KINDS)
def test_they_can_be_left_out_and_asked_for(kind: str) -> None:
    torque = "torque = [0, 0, 0.1]"
    left_out = system_of(kind, "torsion = 2, loads = false", torque)
    assert left_out.bodies["boom"].n_modes == 2
    assert tip(left_out, turn=True)[2] / (0.1 / GJ) == pytest.approx(8 / np.pi**2 * (1 + 1 / 9), rel=1e-6)
    assert system_of(kind, "y = 2, z = 2, loads = true", torque).bodies["boom"].n_modes == 8
    note = decided(case_of(kind, "torsion = 2", torque)).notes["boom"]
    assert "1 static shape of its loads (tip) in addition to its functions (loads = false" in note
