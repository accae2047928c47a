"""Bodies on the tip of a deploying beam: its default set against the cantilever with a tip body, and what warns."""

import re
import warnings
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import brentq

import femflex
from femflex.dynamics.equilibria.rest_modes import rest_modes
from femflex.pipeline.decisions import decided
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
GROWING = '{ kind = "smooth_step", from = 1, to = 4, start = 0, end = 20 }'
SHRINKING = '{ kind = "smooth_step", from = 4, to = 1, start = 0, end = 20 }'


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


@pytest.mark.parametrize(("mass", "inertia"), [(5.0, 0.5), (0.5, 0.02), (50.0, 0.1)])
@pytest.mark.parametrize(("n", "errors"), [(1, (1e-5, 2e-3)), (2, (1e-6, 2e-5))])
def test_one_function_is_enough_under_a_tip_body(
    mass: float, inertia: float, n: int, errors: tuple[float, ...], tmp_path: Path
) -> None:
    """The static shapes of its tip are added by default: without them the second frequency is 8 to 56 % too high."""
    found = modes_of(case_of(tmp_path, mass, inertia, functions=f"y = {n}, z = {n}"))[::2]
    np.testing.assert_array_less(np.abs(found[:2] / frequencies(mass, inertia)[:2] - 1.0), errors)


@pytest.mark.parametrize(
    ("functions", "first"),
    [
        ("y = 1, z = 1, joints = []", "3 at"),
        ('y = 1, z = 1, family = "polynomial"', "1 at"),
        ('y = 2, z = 2, family = "elements"', "3 at"),
    ],
)
def test_sets_that_lack_them_are_warned_of(functions: str, first: str, tmp_path: Path) -> None:
    case = case_of(tmp_path, functions=functions.replace("y = 1, z = 1, joints", "y = 2, z = 2, joints"))
    with pytest.warns(TruncationWarning, match=f"change by more than 1% .*{first}.*modes of 'boom'"):
        modes_of(case)


def test_polynomials_hold_the_static_shapes_themselves(tmp_path: Path) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error", TruncationWarning)
        modes_of(case_of(tmp_path, functions='y = 2, z = 2, family = "polynomial"'))


@pytest.mark.parametrize(
    ("mass", "length", "joint", "ends"),
    [
        (1e-5, 1, "weld", []),
        (0.01, GROWING, "weld", ["tip"]),  # heavy for the metre at the start
        (0.01, SHRINKING, "weld", ["tip"]),  # for that at the end
        (1e-5, GROWING, "free", ["root"]),  # four metres are heavy for the craft
    ],
)
def test_a_member_is_judged_at_its_first_and_last_length(
    mass: float, length: object, joint: str, ends: list[str], tmp_path: Path
) -> None:
    case = case_of(tmp_path, mass, mass / 10, length=length, joint=joint, functions="y = 2, z = 2")
    found = decided(case)
    assert found.case.bodies["boom"].functions.joints == ends
    assert found.system.bodies["boom"].n_modes == 4 + 4 * len(ends)


def test_doubts_at_the_last_length_name_its_time(tmp_path: Path) -> None:
    case = case_of(tmp_path, 0.5, 0.1, length=SHRINKING, functions="y = 1, z = 1, joints = []")
    with pytest.warns(TruncationWarning, match="lengths of t = 40 s, at rest"):
        modes_of(case)


def test_joints_go_with_characteristic_functions(tmp_path: Path) -> None:
    with pytest.raises(femflex.CaseError, match=r"functions.joints with family = 'polynomial'.*leave one of them out"):
        case_of(tmp_path, functions='y = 2, z = 2, family = "polynomial", joints = ["tip"]')


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


@pytest.mark.parametrize(("along", "across", "warned"), [(3, 2, True), (6, 2, True), (6, 5, False), (3, 1, False)])
def test_functions_across_a_sheet_are_judged_too(
    along: int, across: int, warned: bool, tmp_path: Path, recwarn: pytest.WarningsRecorder
) -> None:
    """A sheet of two functions across twists and does not curl; one alone is taken as a choice.

    Without curl a long plate bends with D in place of D (1 - nu^2): at most 1 - sqrt(1 - 0.3^2) = 4.6 % too fast.
    """
    path = tmp_path / "case.toml"
    path.write_text(SHEET.format(along=along, across=across))
    modes_of(femflex.read_case(path))
    found = [one for one in recwarn if issubclass(one.category, TruncationWarning)]
    assert bool(found) == warned, [str(one.message) for one in found]
    changes = [float(part) for one in found for part in re.findall(r"\(-([\d.]+)%\)", str(one.message))]
    assert all(1.0 < change < 100 * (1 - np.sqrt(1 - 0.3**2)) for change in changes)
