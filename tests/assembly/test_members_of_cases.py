"""Deploying and analytic members of cases: as the ones made from Python; loads on their tips in closed form."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from femflex import Case, System, build_system, equilibrium
from femflex.assembly import build_bodies, build_part
from femflex.case import parse_case, read_case
from femflex.warning import TruncationWarning

RUN = "[run]\nduration = 4\n"


HULL = "[bodies.hub]\nkind = 'rigid'\nmass = 1\ninertia = [1, 1, 1]\n"


def test_imbalance_changes_centre_of_mass_and_product_of_inertia_only():
    text = RUN + HULL.replace(
        "mass = 1\ninertia = [1, 1, 1]", "mass = 4\ninertia = [3, 4, 5]\ncenter_of_mass = [0.1, 0.2, 0.3]"
    )
    moments = [
        build_part(parse_case(text + more), "hub").moments  # type: ignore[union-attr]
        for more in ("", "imbalance = { static = 0.8, dynamic = 0.05 }\n")
    ]
    for m in moments:
        assert m.mass == pytest.approx(4.0)
    np.testing.assert_allclose(moments[1].center_of_mass(), [0.3, 0.2, 0.3])
    c = np.array([0.1, 0.2, 0.3])
    about = []  # inertia about the balanced centre
    for m in moments:
        r = m.center_of_mass() - c
        J = m.inertia() - m.mass * (
            (m.center_of_mass() @ m.center_of_mass()) * np.eye(3) - np.outer(m.center_of_mass(), m.center_of_mass())
        )
        about.append(J + m.mass * ((r @ r) * np.eye(3) - np.outer(r, r)))
    product = np.zeros((3, 3))
    product[0, 2] = product[2, 0] = -0.05
    np.testing.assert_allclose(about[1] - about[0], product, atol=1e-12)


# bodies in segments

EI, MASS = 70e9 * np.pi / 4 * (0.03**4 - 0.028**4), 2700 * np.pi * (0.03**2 - 0.028**2)


@pytest.fixture
def cut_case(craft: str) -> Any:
    def text(reduction: str, more: str = "", options: str = "") -> str:
        found = craft.replace('group = "TIP" }', 'group = "TIP" }\nmarkers.ROOT = {}')
        found = found.replace('material = "aluminium" }', f'material = "aluminium", segments = 2{options} }}')
        found = found.split("initial = {")[0] + found[found.index("\n[[joints]]") :]
        found = found.replace('damping = { ratio = "0.5 %" }\n', more)
        return found.replace('reduction = { method = "cantilever", clamp = "ROOT", modes = 4 }\n', reduction)

    return text


def test_a_nodal_segment_bends_under_a_tip_force_in_closed_form(cut_case: Any, write_case: Any):
    text = cut_case('reduction = { method = "nodal", clamp = "ROOT" }\n')
    part: Any = build_bodies(read_case(write_case(text)))["boom"]
    body = part.bodies[-1]
    phi = body.marker("tip").phi
    soft = phi @ np.linalg.solve(body.strain.V1, phi.T)
    np.testing.assert_allclose(np.diag(soft)[1:], 1.5**3 / (3 * EI), rtol=1e-2)
    assert soft[0, 0] == pytest.approx(1.5 / (70e9 * MASS / 2700), rel=1e-6)


EI_TIP, GJ = 100.0, 10.0
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


@pytest.mark.sampled(3)
@pytest.mark.parametrize(
    ("kind", "functions", "load", "turn", "expected", "added"),
    [
        ("deploying", "y = 1, z = 1", "force = [0, 0.1, 0]", False, [0, 0.1 / (3 * EI_TIP), 0], 4),
        ("analytic", "y = 2, z = 2", "force = [0.1, 0, 0]", False, [0.1 / (3 * EI_TIP), 0, 0], 0),
        ("analytic", "y = 2, z = 2", "torque = [0.1, 0, 0]", True, [0.1 / EI_TIP, 0, 0], 4),
        ("deploying", "torsion = 2", "torque = [0, 0, 0.1]", True, [0, 0, 0.1 / GJ], 1),
        (
            "analytic",
            "y = 2, z = 2",
            "torque = [0, 0, 0.1]",
            True,
            [0, 0, 0],
            0,
        ),  # no function twists: rigid by request
    ],
)
def test_loads_on_tips_deflect_beams_in_closed_form(
    kind: str, functions: str, load: str, turn: bool, expected: list[float], added: int
) -> None:
    """The beam stands along z. Without static shapes a torque is answered to 90 % by two functions, a moment to 80."""
    system = system_of(kind, functions, load)
    own = sum(int(part.split("=")[1]) for part in functions.split(","))
    assert system.bodies["boom"].n_modes == own + added
    np.testing.assert_allclose(tip(system, turn), expected, rtol=1e-9 if added else 6e-3, atol=1e-12)
