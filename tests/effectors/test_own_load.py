"""A load that this file alone defines, under a heading of its own: a force that swings at a marker."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

import femflex
from femflex.arrays import Array
from femflex.case import CaseError, parse_case
from femflex.case.schema import json_schema
from femflex.effectors import Mounted, registry
from femflex.kernels.vectors import dot, load3, load9, scale, store3, turn
from femflex.noun.values import Quantity, Vector


class Shaker(Mounted, heading="shakers"):
    """A force that keeps its direction in the body and swings as a sine."""

    force: Annotated[Vector, Quantity("N", (3,))]
    """Amplitude of the force, in the axes of the marker."""
    rate: Annotated[float, Quantity("rad/s", above=0.0)]
    """Angular frequency."""

    channels = {"level": "1"}
    accounts = ("supplied",)
    exerts = ("force",)


P, IN, OUT = Shaker.places()


@Shaker.kernel
def shaker(t: float, seen: Array, z: Array, parameters: Array, out: Array) -> None:
    level = math.sin(parameters[P.rate] * t)
    force = scale(level, turn(load9(seen, IN.attitude), load3(parameters, P.force)))
    store3(out, OUT.force, force)
    out[OUT.level], out[OUT.supplied] = level, dot(force, load3(seen, IN.velocity))


@pytest.fixture(autouse=True)
def registered():
    registry.register("shakers", Shaker)
    yield
    registry.forget("shakers")


registry.forget("shakers")

CASE = """
[run]
duration = 3
output_step = 0.02
integrator = "METHOD"
[bodies.cart]
kind = "rigid"
mass = 2
inertia = [1, 1, 1]
markers.end = { position = [0, 1, 0], orientation = { x = [0, 1, 0], y = [1, 0, 0] } }
[[joints]]
kind = "prismatic"
name = "rail"
child = "cart"
[shakers.coil]
body = "cart"
marker = "end"
force = [0, "0.003 kN", "4 N"]
rate = "30 rpm"
"""
F, W, M = 3.0, math.pi, 2.0  # along the rail: y of the marker


def test_mistakes_and_schema_are_those_of_any_table():
    for old, new, words in (
        ('"30 rpm"', '"30 Nm"', ["shakers.coil.rate", "30 Nm", "torque"]),
        ('"30 rpm"', "0", ["shakers.coil.rate", "above 0 rad/s"]),
        ('[0, "0.003 kN", "4 N"]', "[0, 1]", ["shakers.coil.force", "2 entries", "3 numbers"]),
        ('marker = "end"', 'marker = "edn"', ["shakers.coil.marker", "edn", "did you mean 'end'"]),
    ):
        with pytest.raises(CaseError) as caught:
            parse_case(CASE.replace("METHOD", "dop853").replace(old, new))
        assert [word for word in words if word not in str(caught.value)] == []
    with pytest.raises(ValueError, match="Shaker: rate: found -1 rad/s"):
        Shaker(body="cart", force=np.ones(3), rate=-1.0)
    assert json_schema()["$defs"]["Shaker"]["properties"]["rate"]["unit"] == "rad/s"


@pytest.mark.parametrize(("method", "error"), [("dop853", 1e-9), ("esdirk4", 1e-5)])
def test_cart_swings_as_the_closed_form(method: str, error: float, tmp_path: Path):
    """u = F (1 - cos w t) / (m w); the kinetic energy is the work of the force."""
    case, path = parse_case(CASE.replace("METHOD", method)), tmp_path / "part.h5"
    run = femflex.run(case, tmp_path / "run.h5")
    u = F * (1 - np.cos(W * run.time)) / (M * W)
    assert run["u"][:, 0] == pytest.approx(u, abs=error)
    assert run["effectors/coil/level"] == pytest.approx(np.sin(W * run.time), abs=1e-12)
    assert run["effectors/coil/power"] == pytest.approx(F * np.sin(W * run.time) * u, abs=10 * error)
    work = CubicSpline(run.time, run["monitors/supplied"]).antiderivative()(run.time)
    assert run["monitors/kinetic"] == pytest.approx(work, abs=1e-4)
    half = femflex.run(parse_case(CASE.replace("METHOD", method).replace("duration = 3", "duration = 1.5")), path)
    assert half.time[-1] == 1.5
    resumed = femflex.run(case, path, resume=True)
    assert resumed["u"][-1, 0] == pytest.approx(u[-1], abs=error)
    still = femflex.run(case, tmp_path / "still.h5", without=["coil"])
    assert not still["u"].any()
