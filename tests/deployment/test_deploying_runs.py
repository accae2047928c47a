"""Deploying members in case files: interrupted runs, deflections at rest, slack, and members with tip bodies."""

from pathlib import Path

import numpy as np
import pytest

from femflex import run
from femflex.case import parse_case, read_case
from femflex.pipeline import rebuilt
from femflex.pipeline.decisions import build_system
from femflex.warning import PhysicsWarning

CASE = """
title = "growing boom"
source = "numbers of no meaning"
[run]
duration = "1.2 s"
output_step = "1 ms"
{run}
[bodies.craft]
kind = "rigid"
mass = 100
inertia = [60, 60, 60]
[[joints]]
kind = "free"
child = "craft"
[bodies.boom]
kind = "deploying"
{body}
[[joints]]
kind = "weld"
child = "boom"
parent = "craft"
"""
BOOM = """
family = "beam"
length = { kind = "smooth_step", from = 1, to = 2, start = 0.1, end = 1.1 }
stock = 3
mass_per_length = 0.5
EIy = 4
EIz = 4
functions = { y = 1, z = 1 }
initial = { marker = "tip", displacement = [0, 0.01, 0.02] }
"""


def case_of(body=BOOM, run=""):
    return parse_case(CASE.format(body=body, run=run), Path("boom.toml"))


def changed(old, new):
    assert old in BOOM
    return BOOM.replace(old, new)


@pytest.mark.slow
@pytest.mark.parametrize("method", ["dop853", "esdirk4"])
@pytest.mark.filterwarnings("ignore:deploying member with linear strain")  # its push is 0.85 of the buckling load
def test_resumed_run_is_identical(tmp_path, method):
    text = CASE.format(body=BOOM, run=f'integrator = "{method}"')
    text = text.replace('output_step = "1 ms"', 'output_step = "4 ms"')
    (tmp_path / "boom.toml").write_text(text)
    case = read_case(tmp_path / "boom.toml")
    whole = run(case, tmp_path / "whole.h5")

    def stop(t):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run(case, tmp_path / "part.h5", progress=stop)
    rest = run(case, tmp_path / "part.h5", resume=True)
    assert np.array_equal(rest["q"], whole["q"])
    assert np.array_equal(rest["bodies/boom/drum_force"], whole["bodies/boom/drum_force"])
    if method == "dop853":
        model = rebuilt(whole)
        assert list(model.system.varying) == ["boom"]
    tip = whole["markers/boom.tip/position"][-1]
    assert np.linalg.norm(tip - whole["bodies/craft/position"][-1]) == pytest.approx(2.0, abs=2e-3)
    whole.close(), rest.close()


@pytest.mark.slow
@pytest.mark.sampled(1)
@pytest.mark.parametrize("rest", ["place", "material", "coordinates"])
def test_rest_at_start(rest):
    """Velocity of the tip at t = 0: (U / L) (w' of the tip) of a resting place plus transport; none of material."""
    body = changed('"smooth_step", from = 1, to = 2, start = 0.1, end = 1.1', '"polynomial", coefficients = [1, 0.1]')
    system = build_system(
        case_of(body.replace("y = 1, z = 1", "y = 6, z = 0").replace(", 0.02]", ", 0]") + f'rest = "{rest}"')
    )
    from femflex.dynamics import compile_system

    model = compile_system(system)
    speed = model.observe(np.zeros(1), model.x0[None])["markers/boom.tip/velocity"][0, 1]
    tip, slope, U = 0.01, 1.3765 * 0.01, 0.1  # w'(1) L / w(1) of the first clamped-free shape
    exact = {"place": U * slope, "material": 0.0, "coordinates": 0.0}[rest]
    assert tip > 0 and speed == pytest.approx(exact, abs=0.12 * U * slope)


PUSHED = """
title = "a wire that is pushed out"
source = "numbers of no meaning"
[run]
duration = "1 s"
output_step = "0.1 s"
[bodies.wire]
kind = "deploying"
family = "tether"
length = { kind = "polynomial", coefficients = [1.0, 0.0, -0.5] }
mass_per_length = 0.1
stock = 1.0
[[joints]]
kind = "revolute"
child = "wire"
axis = [0, 0, 1]
"""


@pytest.mark.slow
def test_wire_pushed_out_by_its_drum_goes_slack(tmp_path):
    """Pulled in by its drum it is taut; pushed out, it would carry m' L |A|."""
    with run(parse_case(PUSHED, Path("wire.toml")), tmp_path / "in.h5") as taut:
        assert taut["bodies/wire/tension"].min() > -1e-12
    text = PUSHED.replace("[1.0, 0.0, -0.5]", "[1.0, 0.0, 0.5]").replace("stock = 1.0", "stock = 2.0")
    with (
        pytest.warns(PhysicsWarning, match="'wire' went slack"),
        run(parse_case(text, Path("w.toml")), tmp_path / "out.h5") as out,
    ):
        assert out["bodies/wire/tension"][:, 0] == pytest.approx(-0.1 * out["bodies/wire/length"] * 1.0)
