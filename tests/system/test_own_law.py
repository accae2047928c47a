"""A law of a joint that this file alone defines: table, errors, schema, constructor, channels, balance, resume."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.interpolate import CubicSpline

import femflex
from femflex.arrays import Array
from femflex.case import CaseError, parse_case
from femflex.case.schema import json_schema
from femflex.system import Law, System, prismatic
from femflex.system.law import ByCoordinate, forget, register

MASS, START, LIMIT, WIDTH = 2.0, 0.6, 3.0, 0.2


class Soft(Law):
    """A spring whose force stays below a limit, and a damper that grows with the square of the rate."""

    kind: Literal["soft"] = "soft"
    """Selects this law: a soft spring."""
    limit: Annotated[float, ByCoordinate("N", above=0.0)]
    """Largest force or torque of the spring."""
    width: Annotated[float, ByCoordinate("m", above=0.0)]
    """Stretch over which it is reached."""
    drag: Annotated[float, ByCoordinate("kg/m", least=0.0, rotation="kg m^2")] = 0.0
    """Resistance per square of the rate."""


P, OUT = Soft.places()


@Soft.kernel
def soft(q: float, u: float, parameters: Array, out: Array) -> None:
    limit, width, drag = parameters[P.limit], parameters[P.width], parameters[P.drag]
    share = math.tanh(q / width)
    out[OUT.force] = limit * share + drag * abs(u) * u
    out[OUT.energy] = limit * width * math.log(math.cosh(q / width))
    out[OUT.dissipation] = drag * abs(u) ** 3
    out[OUT.stiffness], out[OUT.damping] = limit / width * (1.0 - share**2), 2.0 * drag * abs(u)


@pytest.fixture(autouse=True)
def registered():
    register(Soft)
    yield
    forget("soft")


forget("soft")


def stored(q: float) -> float:
    return LIMIT * WIDTH * math.log(math.cosh(q / WIDTH))


def period() -> float:
    """4 int dq / u over a quarter, u the speed by the energy; q = START sin(a) takes the root out of the end."""

    def duration(a: float) -> float:
        return START * math.cos(a) / math.sqrt(2.0 / MASS * (stored(START) - stored(START * math.sin(a))))

    return 4.0 * float(quad(duration, 0.0, math.pi / 2 - 1e-6)[0])


CASE = f"""
[run]
duration = {period()}
samples = 401
integrator = "METHOD"
[bodies.cart]
kind = "rigid"
mass = {MASS}
inertia = [1, 1, 1]
[[joints]]
kind = "prismatic"
name = "rail"
child = "cart"
position = {START}
velocity = 0
[[joints.laws]]
kind = "soft"
limit = "{LIMIT / 1000} kN"
width = "{WIDTH * 100} cm"
drag = 0
"""


def case_text(method: str = "dop853", **changes: str) -> str:
    text = CASE.replace("METHOD", method)
    for old, new in changes.items():
        text = text.replace(old, new)
    return text


@pytest.mark.parametrize(("method", "error"), [("dop853", 1e-8), ("esdirk4", 1e-4)])
def test_cart_returns_after_the_period_of_its_energy(method: str, error: float, tmp_path: Path):
    run = femflex.run(parse_case(case_text(method)), tmp_path / "run.h5")
    q = run["q"][:, 0]
    assert q[-1] == pytest.approx(START, rel=error) and q.min() == pytest.approx(-START, rel=1e-3)
    assert run["laws/rail.soft/force"] == pytest.approx(LIMIT * np.tanh(q / WIDTH), abs=1e-12)
    assert run["monitors/spring"] == pytest.approx([stored(x) for x in q], abs=1e-12)
    assert run["monitors/energy"] == pytest.approx(stored(START), rel=error)
    assert run.unit("laws/rail.soft/force") == "N"


@pytest.mark.parametrize("method", ["dop853", "esdirk4"])
def test_energy_falls_by_the_work_of_the_damper(method: str, tmp_path: Path):
    run = femflex.run(parse_case(case_text(method, **{"drag = 0": 'drag = "500 g/m"'})), tmp_path / "run.h5")
    taken, rate = run["monitors/dissipation"], run["u"][:, 0]
    assert taken == pytest.approx(0.5 * np.abs(rate) ** 3, abs=1e-12)
    lost = CubicSpline(run.time, taken).antiderivative()(run.time)
    assert lost[-1] > 0.2 and run["monitors/energy"] == pytest.approx(stored(START) - lost, abs=1e-4)


def test_without_leaves_the_cart_alone(tmp_path: Path):
    text = case_text(**{"velocity = 0": "velocity = 0.5"})
    run = femflex.run(parse_case(text), tmp_path / "run.h5", without=["rail.soft"])
    assert run["q"][:, 0] == pytest.approx(START + 0.5 * run.time, rel=1e-12)


def test_run_resumes_to_a_later_end(tmp_path: Path):
    whole = femflex.run(parse_case(case_text()), tmp_path / "whole.h5")
    part = case_text(**{f"duration = {period()}": f"duration = {period() / 2}", "samples = 401": "samples = 201"})
    femflex.run(parse_case(part), tmp_path / "part.h5")
    resumed = femflex.run(parse_case(case_text()), tmp_path / "part.h5", resume=True)
    assert resumed["q"][-1] == pytest.approx(whole["q"][-1], abs=1e-9)


def test_python_constructor_gives_the_same(tmp_path: Path):
    law = Soft(limit="3 N", width=WIDTH)
    system = System({"cart": femflex.rigid_body(MASS, np.eye(3))}, (prismatic("cart", laws=(law,), q0=[START]),))
    result = femflex.simulate(system, period())
    assert result["q"][-1, 0] == pytest.approx(START, rel=1e-8)
    with pytest.raises(ValueError, match=r"Soft: width: found -1 m; it must be above 0 m"):
        Soft(limit=3.0, width=-1.0)


def test_schema_describes_the_table():
    laws = json_schema()["$defs"]["Prismatic"]["properties"]["laws"]["items"]["anyOf"]
    (table,) = (law for law in laws if law["title"] == "Soft")
    assert table["properties"]["limit"]["unit"] == "N or N m" and set(table["required"]) == {"kind", "limit", "width"}
    assert "square" in table["properties"]["drag"]["description"]


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('"0.003 kN"', '"1 N m"', ["joints[rail]", "limit", "1 N m", "torque"]),
        ('"0.003 kN"', "-1", ["joints[rail]", "limit", "-1 N", "above 0"]),
        ("drag =", "darg =", ["joints[rail]", "'darg'", "did you mean 'drag'"]),
        ("limit =", "# limit =", ["joints[rail]", "limit", "missing", "largest force"]),
        ('"soft"', '"sotf"', ["joints[rail]", "did you mean 'soft'"]),
    ],
)
def test_mistakes_are_named(old: str, new: str, words: list[str]):
    with pytest.raises(CaseError) as caught:
        parse_case(case_text().replace(old, new))
    for word in words:
        assert word in str(caught.value)
