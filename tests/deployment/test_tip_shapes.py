"""Bodies on the tip of a deploying beam: its default set against the cantilever with a tip body, and what warns."""

from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import brentq

import femflex
from femflex.advice.elastic_motion import rest_modes
from femflex.warning import TruncationWarning

CASE = """
title = "tip body"
[run]
duration = "40 s"
[bodies.craft]
kind = "rigid"
mass = 10
inertia = [1, 1, 1]
[bodies.boom]
kind = "deploying"
family = "beam"
length = {length}
stock = 4
mass_per_length = 1
EIy = 1
EIz = 1
functions = {{ {functions} }}
[bodies.payload]
kind = "rigid"
mass = {mass}
inertia = [{inertia}, {inertia}, {inertia}]
[[joints]]
kind = "{joint}"
child = "craft"
[[joints]]
kind = "weld"
child = "boom"
parent = "craft"
[[joints]]
kind = "weld"
child = "payload"
parent = "boom"
parent_marker = "tip"
"""


def frequencies(mass: float, inertia: float) -> np.ndarray:
    """The first natural frequencies [Hz] of a uniform cantilever, EI = L = m' = 1, with a body at its tip."""

    def residual(b: float) -> float:
        c, s, C, S = np.cos(b), np.sin(b), np.cosh(b), np.sinh(b)
        w, dw = np.array([C - c, S - s]), b * np.array([S + s, C - c])
        ddw, dddw = b**2 * np.array([C + c, S + s]), b**3 * np.array([S - s, C + c])
        moment, force = ddw - inertia * b**4 * dw, dddw + mass * b**4 * w
        return float(moment[0] * force[1] - moment[1] * force[0])

    grid = np.linspace(0.05, 6.0, 1000)
    signs = np.sign([residual(b) for b in grid])
    return np.array([brentq(residual, *grid[k : k + 2]) for k in np.flatnonzero(np.diff(signs))]) ** 2 / (2 * np.pi)


def case_of(tmp_path: Path, mass: float = 5.0, inertia: float = 0.5, **values: object) -> femflex.Case:
    given = {"length": 1, "functions": "y = 1, z = 1", "joint": "weld"} | values
    (tmp_path / "case.toml").write_text(CASE.format(mass=mass, inertia=inertia, **given))
    return femflex.read_case(tmp_path / "case.toml")


def modes_of(case: femflex.Case) -> np.ndarray:
    """Natural frequencies [Hz] of the craft of a case."""
    return rest_modes(femflex.build_system(case)).omega / (2 * np.pi)


@pytest.mark.sampled(2)
@pytest.mark.parametrize(("mass", "inertia"), [(5.0, 0.5), (0.5, 0.02)])
@pytest.mark.parametrize(("n", "errors"), [(1, (1e-5, 2e-3)), (2, (1e-6, 2e-5))])
def test_one_function_matches_cantilever_with_tip_body(
    mass: float, inertia: float, n: int, errors: tuple[float, ...], tmp_path: Path
) -> None:
    """The static shapes of its tip are added by default: without them the second frequency is 8 to 56 % too high."""
    found = modes_of(case_of(tmp_path, mass, inertia, functions=f"y = {n}, z = {n}"))[::2]
    np.testing.assert_array_less(np.abs(found[:2] / frequencies(mass, inertia)[:2] - 1.0), errors)


SHEET = """
title = "sheet"
[run]
duration = "30 s"
[bodies.sheet]
kind = "deploying"
family = "plate"
length = {{ kind = "smooth_step", from = "2 m", to = "4 m", start = 0, end = "30 s" }}
width = "1 m"
mass_per_length = 1
bending_stiffness = 1
poisson = 0.3
functions = {{ z = {along}, across = {across} }}
[[joints]]
kind = "weld"
child = "sheet"
"""


@pytest.mark.parametrize(
    ("along", "across", "warned"), [(3, 2, True), pytest.param(4, 5, False, marks=pytest.mark.slow)]
)
def test_missing_curl_of_a_sheet_is_warned_of(
    along: int, across: int, warned: bool, tmp_path: Path, recwarn: pytest.WarningsRecorder
) -> None:
    """A sheet of two functions across twists and does not curl, so it bends with D in place of D (1 - nu^2)."""
    path = tmp_path / "case.toml"
    path.write_text(SHEET.format(along=along, across=across))
    modes_of(femflex.read_case(path))
    assert any(issubclass(one.category, TruncationWarning) for one in recwarn) == warned
