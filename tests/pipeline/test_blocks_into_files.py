"""Blocks of an integrator made up for it, as they come into the result file: rows, counts, and how the run ended."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from femflex.case import parse_case
from femflex.integrate import Block, IntegrationError
from femflex.integrate import resume as head
from femflex.pipeline import integrate, prepare
from femflex.results import open_run, resume_point

CRAFT = """
title = "a ride"
[run]
duration = 9
samples = 10
[bodies.hub]
kind = "rigid"
mass = 4
inertia = [3, 4, 5]
[[joints]]
kind = "prismatic"
child = "hub"
name = "ride"
axis = "x"
velocity = 2
[[loads]]
name = "push"
body = "hub"
force = [0.25, 0, 0]
"""


class Played:
    """An integrator that gives these rows of (q, u), so many in each block."""

    name = "played"

    def __init__(self, rows: np.ndarray, sizes: tuple[int, ...]) -> None:
        self.rows, self.sizes = rows, sizes

    def blocks(self, model: Any, times: np.ndarray, x0: np.ndarray, state: Any = None) -> Iterator[Block]:
        ends = np.cumsum(self.sizes)
        for start, end in zip(ends - self.sizes, ends, strict=True):
            resume = np.concatenate([np.zeros(head.HEAD), self.rows[end - 1]])
            resume[[head.T, head.N_X, head.ACCEPTED]] = times[end - 1], 2, 10 * end
            yield Block(times[start:end], self.rows[start:end], resume)


def played(rows: np.ndarray, sizes: tuple[int, ...], output: Path) -> list[float]:
    """The times that are reported while such a run is written."""
    prepared = replace(prepare(parse_case(CRAFT), without=["push"]), integrator=Played(rows, sizes))
    reached: list[float] = []
    try:
        integrate(prepared, output, progress=reached.append)
    finally:
        reached.append(-1.0)
    return reached[:-1]


ROWS = np.column_stack([2.0 * np.arange(10), np.full(10, 2.0)])


def test_every_block_is_written_with_the_state_after_it(tmp_path: Path):
    assert played(ROWS, (4, 1, 5), tmp_path / "a.h5") == [3.0, 4.0, 9.0]
    with open_run(tmp_path / "a.h5") as run:
        assert run.complete and run.ended == "reached the end" and run.title == "a ride"
        np.testing.assert_array_equal(run.states(), ROWS)
        np.testing.assert_allclose(run["bodies/hub/position"][:, 0], ROWS[:, 0])
        assert run.statistics["accepted"] == 100 and "ended" not in run.statistics
        told = {key: run.attributes[key] for key in ("integrator", "without", "varying", "effectors", "sampled")}
        assert told == {"integrator": "played", "without": "loads/push", "varying": "", "effectors": "", "sampled": ""}
        assert run.attributes["frame"] == "N inertial; attitude from the inertial frame"
        assert run.attributes["start_moved"] == run.attributes["start_taken_up"] == ""
        assert run.case_text == CRAFT
    point = resume_point(tmp_path / "a.h5")
    assert (point.rows, point.time) == (10, 9.0) and point.state[head.HEAD :].tolist() == [18.0, 2.0]


@pytest.mark.parametrize("bad", [3, 4, 9])
def test_rows_from_the_first_overflow_on_are_left_out(tmp_path: Path, bad: int):
    """4 kg at 1e308 m have a moment of mass that is no number: in the midst of a block, at its start, at its end."""
    rows = ROWS.copy()
    rows[bad:, 0] = 1e308
    with pytest.raises(IntegrationError) as caught:
        played(rows, (4, 6), tmp_path / "a.h5")
    told = str(caught.value)
    assert (
        told.startswith(f"the run stopped at t = {bad} s in ride.slide: ")
        and " is not finite. Check for a load" in told
    )
    assert told.endswith(f"{tmp_path / 'a.h5'} keeps what was computed and is marked incomplete.")
    with open_run(tmp_path / "a.h5") as run:
        np.testing.assert_array_equal(run.states(), ROWS[:bad])
        assert not run.complete and told.startswith(run.ended) and len(run.ended) > 20
        assert run.time.tolist() == list(range(bad))
    if bad == 4:
        assert resume_point(tmp_path / "a.h5").rows == 4
    else:  # the block with the failure has no state
        with pytest.raises(ValueError, match="holds no state of the integrator to go on from"):
            resume_point(tmp_path / "a.h5")


@pytest.mark.parametrize("bad", [2, 5])
def test_the_row_that_is_too_fast_is_kept_as_the_last(tmp_path: Path, bad: int):
    """4e6 m/s: beyond a hundredth of the speed of light."""
    rows = ROWS.copy()
    rows[bad:, 1] = 4e6 + np.arange(10 - bad)
    with pytest.raises(IntegrationError) as caught:
        played(rows, (4, 6), tmp_path / "a.h5")
    assert f"the run stopped at t = {bad} s in ride.slide_rate: the motion diverges: " in str(caught.value)
    assert "is 4e+06 m/s, beyond 3e+06 m/s, which no craft reaches" in str(caught.value)
    with open_run(tmp_path / "a.h5") as run:
        np.testing.assert_array_equal(run.states(), rows[: bad + 1])
        assert not run.complete


def test_a_run_that_overflows_at_once_leaves_nothing(tmp_path: Path):
    rows = ROWS.copy()
    rows[:, 0] = 1e308
    with pytest.raises(IntegrationError, match="Nothing was computed before that could be kept"):
        played(rows, (4, 6), tmp_path / "a.h5")
    assert not list(tmp_path.iterdir())
