"""What a run says of deploying members that go slack, and of how far free lengths reached."""

from pathlib import Path

import numpy as np
import pytest

from femflex import run
from femflex.case import parse_case
from femflex.cli.run_report import reach_lines
from femflex.pipeline.decisions import build_system
from femflex.results import open_run
from femflex.warning import PhysicsWarning

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
def test_a_wire_whose_drum_holds_it_back_too_late_goes_slack(tmp_path):
    """Pulled in by its drum it is taut; pushed out, it would carry m' L |A|."""
    with run(parse_case(PUSHED, Path("wire.toml")), tmp_path / "in.h5") as taut:
        assert taut["bodies/wire/tension"].min() > -1e-12
    text = PUSHED.replace("[1.0, 0.0, -0.5]", "[1.0, 0.0, 0.5]").replace("stock = 1.0", "stock = 2.0")
    sentence = r"body 'wire' went slack: at t = 1 s its tension is -0\.15 N, 0 m from the exit \(length 1\.5 m"
    before = (
        r"body 'wire' goes slack by the preliminary rigid-body simulation: its tension falls to -0\.15 N at t = 1 s"
    )
    with (
        pytest.warns(PhysicsWarning, match=before),
        pytest.warns(PhysicsWarning, match=sentence),
        run(parse_case(text, Path("w.toml")), tmp_path / "out.h5") as out,
    ):
        assert out["bodies/wire/tension"][:, 0] == pytest.approx(-0.1 * out["bodies/wire/length"] * 1.0)


def test_the_reach_of_a_free_length_is_said_at_the_end(tmp_path):
    text = """
title = "let out"
source = "numbers of no meaning"
[run]
duration = "250 s"
output_step = "100 s"
[orbit]
kind = "specified"
semi_major_axis = "7000 km"
[attitude]
frame = "orbital"
held = true
[environment]
attraction = "gradient"
[bodies.craft]
kind = "rigid"
mass = 1e5
inertia = [1e6, 1e6, 1e6]
[bodies.tether]
kind = "deploying"
family = "tether"
stock = "20 km"
mass_per_length = "5 kg/km"
direction = [0, 1, 0]
reel = { length = "400 m", speed = "5 m/s", damping = "0.001 N s/m", tension = "0.001 N" }
[[joints]]
kind = "weld"
child = "tether"
parent = "craft"
"""
    case = parse_case(text, Path("out.toml"))
    with run(case, tmp_path / "run.h5"):
        pass
    with open_run(tmp_path / "run.h5") as done:
        length = float(done["bodies/tether/length"].max())
        (line,) = reach_lines(done, build_system(case))
    assert length > 1050.0
    assert f"the craft reached {length:.4g} m" in line or "the craft reached" in line
    assert f"{1.5 * length / 7e6:.2%}"[:4] in line
    assert np.isfinite(length)
