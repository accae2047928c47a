"""What is said before a run of members that go slack or are compressed, word by word, from what watches noted."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

import femflex.advice.deployed_estimate as module
from femflex.advice.deployed import Lowest
from femflex.pipeline import decisions

TAPE = Lowest(value=-9.0, time=2.5, place=0.25, length=12.0, largest=40.0)
BOOM = SimpleNamespace(force=-30.0, gain=-0.6, time=7.5, length=4.5)


@pytest.fixture
def estimates(monkeypatch):
    """The doubts on a tape and a boom with these notes, and the rows that were looked at."""
    looked = []

    def doubts(lowest=TAPE, pressed=BOOM, condensed=True, n=7):
        slack, axial = SimpleNamespace(lowest={"tape": lowest}), SimpleNamespace(pressed={"boom": pressed})
        for watch in (slack, axial):
            watch.watch = lambda times, seen: looked.append((times, seen))
        monkeypatch.setattr(module, "slender_members", lambda system: ["tape", "boom"])
        monkeypatch.setattr(module, "compile_system", lambda system: SimpleNamespace(observe=lambda t, x: {"x": x}))
        monkeypatch.setattr(module, "SlackWatch", lambda model: slack)
        monkeypatch.setattr(module, "AxialForceWatch", lambda model: axial)
        system = SimpleNamespace(bodies={"boom": SimpleNamespace(condensed=condensed)})
        times = np.linspace(0.0, 9.0, n)
        return module.deployed_estimates(SimpleNamespace(system=None, times=times, states=np.c_[times, -times]), system)

    return doubts, looked


def test_a_slack_tape_and_a_boom_near_buckling_are_told_with_time_place_and_length(estimates):
    slack, pressed = estimates[0]()
    assert slack.reason == (
        "body 'tape' goes slack by the preliminary rigid-body simulation: its tension falls to -9 N at t = 2.5 s, "
        "3 m from the exit (length 12 m, largest tension 40 N). A run carries this compression. Deploy more slowly, "
        "brake earlier, add tension, or state a cable (`cables`), which can go slack"
    )
    assert pressed.reason == (
        "body 'boom' is compressed by the preliminary rigid-body simulation: 30 N along its axis at t = 7.5 s (length "
        "4.5 m), 60% of its buckling load as a cantilever of this length (limit 25%). Lower the load, deploy more "
        "slowly, or give it more bending stiffness"
    )


def test_what_is_rounding_within_its_limit_or_of_a_beam_without_condensed_strain_is_not_reported(estimates):
    doubts, looked = estimates
    assert doubts(lowest=Lowest(-0.039, 2.5, 0.25, 12.0, 40.0), condensed=False) == []
    assert doubts(lowest=Lowest(1.0, 2.5, 0.25, 12.0, 40.0), pressed=SimpleNamespace(gain=-0.24)) == []
    assert [one.body for one in doubts(lowest=Lowest(-0.041, 2.5, 0.25, 12.0, 40.0), condensed=False)] == ["tape"]
    assert all(len(times) == 7 for times, _ in looked)


def test_of_many_rows_four_hundred_are_looked_at_from_the_first_to_the_last(estimates):
    doubts, looked = estimates
    doubts(n=5001)
    for times, seen in looked:
        assert (len(times), times[0], times[-1]) == (400, 0.0, 9.0)
        np.testing.assert_array_equal(seen["x"], np.c_[times, -times])


@pytest.mark.parametrize(
    ("known", "members", "estimated", "used"),
    [(None, ["tape"], True, "own"), ("known", ["tape"], False, "known"), (None, [], False, None)],
)
def test_the_rigid_motion_is_computed_for_members_alone_and_only_where_none_is_known(
    monkeypatch, known, members, estimated, used
):
    asked = []
    monkeypatch.setattr(decisions, "slender_members", lambda system: members)
    monkeypatch.setattr(decisions, "estimate_rigid_motion", lambda *what: asked.append(what) or ("own", ""))
    monkeypatch.setattr(decisions, "deployed_estimates", lambda rigid, system: [(rigid, system)])
    assert decisions._deployed(known, "craft", 30.0) == [(used, "craft")]
    assert asked == ([("craft", 30.0)] if estimated else [])
