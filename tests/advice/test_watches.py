"""Watches of a run, against the closed forms of a clamped beam under a force at its tip that grows slowly."""

from __future__ import annotations

import pytest

import femflex
from femflex.advice.advice import advice_from
from femflex.warning import PhysicsWarning

EI, LENGTH = 100.0, 2.0  # N m^2, m
CASE = f"""
title = "pushed"
[run]
duration = 40
samples = 41
[bodies.boom]
kind = "analytic"
length = {LENGTH}
mass_per_length = 0.5
EA = 1e6
EIy = {EI}
EIz = {EI}
GJ = 100
functions = {{{{ y = 3, z = 3 }}}}
damping = {{{{ ratio = 0.1 }}}}
strain = "linear"
[[joints]]
kind = "weld"
child = "boom"
[[loads]]
name = "push"
body = "boom"
marker = "tip"
times = [0, 40]
force = [[0, 0, 0], [{{x}}, 0, {{z}}]]
"""


@pytest.mark.parametrize(
    ("x", "z", "decision", "value"),
    [
        (0.0, 20.0, "bend", 20.0 * LENGTH**2 / (3 * EI)),  # tip deflection over length
        (20.0, 0.0, "stretch", None),
        (0.0, 1.0, "", None),
    ],
)
def test_watches_name_excess_in_file_and_warning(x, z, decision, value, tmp_path, recwarn):
    (tmp_path / "case.toml").write_text(CASE.format(x=x, z=z))
    with femflex.run(tmp_path / "case.toml", tmp_path / "run.h5") as run:
        watched = advice_from(run.attributes["watches"])
    texts = [str(entry.message) for entry in recwarn if isinstance(entry.message, PhysicsWarning)]
    assert [entry.decision for entry in watched] == [decision] * bool(decision)
    for entry in watched:
        assert entry.body == "boom" and entry.doubt and entry.value > entry.limit and entry.reason in texts
        assert value is None or entry.value == pytest.approx(value, rel=0.02)
