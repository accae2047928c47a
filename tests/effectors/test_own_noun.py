"""An effector that this file alone defines: its table, errors, schema, constructor, channels, balance and resume."""

from __future__ import annotations

import math
import pickle
from pathlib import Path
from typing import Annotated

import numpy as np
import pytest

import femflex
from femflex.arrays import Array
from femflex.case import CaseError, parse_case
from femflex.case.schema import json_schema
from femflex.effectors import Mounted, registry
from femflex.kernels.vectors import dot, load3, scale, store3
from femflex.noun.values import Quantity
from femflex.system import System, free, with_effectors

MASS, C, V0 = 20.0, 0.8, 5.0


class Drag(Mounted, heading="drags"):
    """Resistance that grows with the square of the velocity."""

    coefficient: Annotated[float, Quantity("kg/m", least=0.0)]
    """Force per square of the velocity."""

    states = {"heat": "J"}
    channels = {"speed": "m/s"}
    accounts = ("dissipation",)
    exerts = ("force",)


P, IN, OUT = Drag.places()


@Drag.kernel
def drag(t: float, seen: Array, z: Array, parameters: Array, out: Array) -> None:
    v, c = load3(seen, IN.velocity), parameters[P.coefficient]
    speed = math.sqrt(dot(v, v))
    store3(out, OUT.force, scale(-c * speed, v))
    out[OUT.heat] = out[OUT.dissipation] = c * speed**3
    out[OUT.speed] = speed


@pytest.fixture(autouse=True)
def registered():
    registry.register("drags", Drag)
    yield
    registry.forget("drags")


registry.forget("drags")

CASE = """
title = "a body slowed by drag"
[run]
duration = 8
output_step = 0.1
integrator = "METHOD"
[bodies.hub]
kind = "rigid"
mass = 20
inertia = [3, 4, 5]
[[joints]]
kind = "free"
child = "hub"
velocity = [3, 0, 4]
[drags.fin]
body = "hub"
coefficient = "800 g/m"
"""


def case_text(method: str = "dop853", **changes: str) -> str:
    text = CASE.replace("METHOD", method)
    for old, new in changes.items():
        text = text.replace(old, new)
    return text


@pytest.mark.parametrize(("method", "error"), [("dop853", 1e-9), ("esdirk4", 1e-5)])
def test_drag_slows_a_body_as_the_closed_form(method: str, error: float, tmp_path: Path):
    """v = v0 / (1 + c v0 t / m), and the heat is the kinetic energy that is lost."""
    run = femflex.run(parse_case(case_text(method)), tmp_path / "run.h5")
    v = V0 / (1.0 + C * V0 * run.time / MASS)
    assert run["effectors/fin/speed"] == pytest.approx(v, rel=error)
    lost = 0.5 * MASS * (V0**2 - v**2)
    assert run["effectors/fin/heat"] == pytest.approx(lost, rel=error, abs=1e-9)
    assert run["monitors/kinetic"][0] - run["monitors/kinetic"] == pytest.approx(lost, rel=5 * error, abs=1e-6)
    assert run["monitors/dissipation"] == pytest.approx(C * v**3, rel=5 * error)
    assert run.unit("effectors/fin/speed") == "m/s"


def test_without_removes_it(tmp_path: Path):
    run = femflex.run(parse_case(case_text()), tmp_path / "run.h5", without=["fin"])
    assert np.ptp(run["monitors/kinetic"]) < 1e-9


def test_run_resumes_to_a_later_end(tmp_path: Path):
    whole = femflex.run(parse_case(case_text()), tmp_path / "whole.h5")
    femflex.run(parse_case(case_text(**{"duration = 8": "duration = 4"})), tmp_path / "part.h5")
    resumed = femflex.run(parse_case(case_text()), tmp_path / "part.h5", resume=True)
    assert np.allclose(resumed["effectors/fin/heat"], whole["effectors/fin/heat"], rtol=1e-10)


def test_python_constructor_gives_the_same(tmp_path: Path):
    system = System({"hub": femflex.rigid_body(MASS, np.diag([3.0, 4.0, 5.0]))}, (free("hub", u0=[3, 0, 4, 0, 0, 0]),))
    system = with_effectors(system, {"fin": Drag(body="hub", coefficient="0.8 kg/m")})
    result = femflex.simulate(system, 8.0)
    run = femflex.run(parse_case(case_text()), tmp_path / "run.h5")
    assert result["effectors/fin/speed"][-1] == pytest.approx(run["effectors/fin/speed"][-1], rel=1e-9)


def test_schema_describes_the_table():
    schema = json_schema()
    table = schema["$defs"]["Drag"]
    assert table["properties"]["coefficient"]["unit"] == "kg/m"
    assert "square" in table["properties"]["coefficient"]["description"]
    assert "drags" in schema["properties"]


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('"800 g/m"', "-1", ["drags.fin.coefficient", "-1 kg/m", "at least 0"]),
        ('"800 g/m"', '"1 N"', ["drags.fin.coefficient", "1 N", "kg/m"]),
        ("coefficient =", "coeficient =", ["drags.fin.coeficient", "not known", "did you mean 'coefficient'"]),
        ('body = "hub"\ncoefficient', 'body = "hob"\ncoefficient', ["drags.fin", "hob", "hub"]),
        ("[drags.fin]", "[drag.fin]", ["drag", "not known", "drags"]),
    ],
)
def test_mistakes_are_named(old: str, new: str, words: list[str]):
    with pytest.raises(CaseError) as caught:
        femflex.build_system(parse_case(case_text().replace(old, new)))
    for word in words:
        assert word in str(caught.value)


def test_constructor_refuses_the_same():
    with pytest.raises(ValueError, match=r"Drag: coefficient: found -1 kg/m; it must be at least 0"):
        Drag(body="hub", coefficient=-1.0)


def test_case_and_system_can_be_pickled(tmp_path: Path):
    case = pickle.loads(pickle.dumps(parse_case(case_text())))
    system = pickle.loads(pickle.dumps(femflex.build_system(case)))
    result = femflex.simulate(system, 1.0)
    assert result["effectors/fin/speed"][-1] == pytest.approx(V0 / (1.0 + C * V0 / MASS), rel=1e-9)
