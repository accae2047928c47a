"""Cases whose constraints contradict each other, or whose joints lock: exit codes, sentences, and what is kept."""

import numpy as np
import pytest
from typer.testing import CliRunner

from femflex.cli.app import app
from femflex.results import open_run

HEAD = """
[run]
duration = "2 s"
samples = 21
[attitude]
frame = "inertial"
[bodies.b]
kind = "rigid"
mass = 1
inertia = [1, 2, 2.5]
"""

KNIFE = """
[[joints]]
kind = "general"
name = "slide"
child = "b"
slides = ["x", "y"]
turns = ["z"]
motion.position = [{ kind = "sine", amplitude = 1, frequency = "0.2 Hz" }, HOW]
motion.angles = [{ kind = "smooth_step", from = 0, to = 1.0, start = 1, end = 2 }]
[[constraints]]
name = "blade"
kind = "knife_edge"
body = "b"
across = "y"
"""

LOCKED = """
[[joints]]
kind = "spherical"
name = "ball"
child = "b"
sequence = "zxz"
motion.angles = ["free", "locked", "free"]
"""


def invoked(tmp_path, verb, text):
    """Exit code and words of a verb on a case."""
    case = tmp_path / "case.toml"
    case.write_text(HEAD + text, encoding="utf-8")
    options = ["-o", str(tmp_path / "run.h5")] if verb == "run" else []
    result = CliRunner().invoke(app, [verb, str(case), *options])
    return result.exit_code, " ".join(result.output.split())


def test_a_contradiction_during_a_run_is_exit_3_with_everything_before_it_kept(tmp_path):
    code, said = invoked(tmp_path, "run", KNIFE.replace("HOW", '"locked"'))
    assert code == 3
    assert (
        "constraint 'blade' cannot be satisfied any further together with the prescribed motion of 'slide.slide2'"
        in said
    )
    assert "run.h5 keeps what was computed and is marked incomplete" in said
    with open_run(tmp_path / "run.h5") as run:
        assert not run.complete and len(run.time) >= 11
        assert np.max(run["monitors/constraint_velocity"]) < 2e-10


def test_a_run_says_how_well_its_constraints_were_held(tmp_path):
    code, said = invoked(tmp_path, "run", KNIFE.replace("HOW", '"free"'))
    assert code == 0 and "monitor constraint largest gap 0.000e+00 m, largest velocity residual" in said


@pytest.mark.parametrize("verb", ["run", "check"])
def test_turns_that_start_in_gimbal_lock_are_exit_2_and_leave_no_file(tmp_path, verb):
    code, said = invoked(tmp_path, verb, LOCKED)
    assert code == 2 and "joint 'ball' starts in gimbal lock" in said and "'ball.angle1', 'ball.angle3'" in said
    assert not (tmp_path / "run.h5").exists()
