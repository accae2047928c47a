"""Commands of thrusters outside of 0 to 1 are warned of after a run."""

from __future__ import annotations

import warnings

import pytest

import femflex
from femflex import PhysicsWarning
from femflex.case import parse_case

CASE = """
title = "a thruster that a controller commands"
run = { duration = 2, output_step = 0.1 }
bodies.craft = { kind = "rigid", mass = 10, inertia = [1, 1, 1] }
sensors.gyro = { kind = "rate", body = "craft" }
controllers.law = { kind = "gain", inputs = ["gyro"], matrix = [[GAIN, 0, 0]], outputs = ["y"] }
thrusters.jet = { body = "craft", thrust = "0.1 N", command = "law.y" }
attitude = { rates = [0.5, 0, 0] }
"""


@pytest.mark.parametrize(("gain", "words"), [("6", "rose to 3 at t = 0 s, above 1"), ("-6", "never fired"), ("1", "")])
def test_command_of_a_thruster(tmp_path, gain, words):
    case = parse_case(CASE.replace("GAIN", gain), tmp_path / "case.toml")
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", PhysicsWarning)
        femflex.run(case, tmp_path / "run.h5").close()
    texts = [str(w.message) for w in caught if "thruster" in str(w.message)]
    assert len(texts) == bool(words)
    assert not words or words in texts[0]
