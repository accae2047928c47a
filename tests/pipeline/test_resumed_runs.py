"""Runs that end early, are resumed or start another run, compared bit for bit."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from support.effector_builders import Supply, reaction_wheel, tank, thruster

import femflex
from femflex.case import CaseError, parse_case, read_case
from femflex.integrate import Block, IntegrationError
from femflex.integrate import resume as head
from femflex.pipeline import integrate, prepare, rebuilt
from femflex.pipeline.file_digests import file_digests
from femflex.pipeline.inputs import inputs_text
from femflex.pipeline.resumed import check_same_inputs, check_same_model, integrator_of, is_finished
from femflex.results import RunWriter, open_run, resume_point
from femflex.system import Channel, Controller

CRAFT = """
[run]
duration = 1.5
samples = 16
[environment]
gravity = 2.0
[bodies.hub]
kind = "rigid"
mass = 4
inertia = [3, 4, 5]
[bodies.arm]
kind = "rigid"
mass = 1.5
center_of_mass = [0.5, 0, 0.2]
inertia = [0.2, 0.7, 0.8]
[[joints]]
kind = "prismatic"
child = "hub"
name = "ride"
axis = "x"
velocity = 0.3
[[joints]]
kind = "revolute"
parent = "hub"
child = "arm"
name = "hinge"
axis = "y"
angle = 0.4
rate = 0.7
[[loads]]
name = "push"
body = "hub"
force = [0.2, 0, 0]
"""


@pytest.fixture(scope="module")
def finished_run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder with the case and its run."""
    folder = tmp_path_factory.mktemp("finished_run")
    (folder / "a.toml").write_text(CRAFT)
    femflex.run(folder / "a.toml", folder / "a.h5", without=["push"]).close()
    return folder


@pytest.fixture
def folder(finished_run: Path, tmp_path: Path) -> Path:
    """A copy of the folder, with the new path of the case in the result file."""
    for name in ("a.toml", "a.h5"):
        shutil.copy(finished_run / name, tmp_path)
    edited(tmp_path / "a.h5", case_path=str(tmp_path / "a.toml"))
    return tmp_path


def edited(path: Path, **attributes: Any) -> Path:
    with h5py.File(path, "r+") as file:
        for key, value in attributes.items():
            file.attrs[key] = value
    return path


def refused(path: Path, **more: Any) -> str:
    with open_run(path) as run, pytest.raises(ValueError) as caught:
        rebuilt(run, **more)
    return str(caught.value)


# built again


def test_rebuilt_model_reproduces_the_run(folder: Path):
    with open_run(folder / "a.h5") as run:
        model = rebuilt(run)
        assert model.omitted == run.without == ("loads/push",)
        channels = model.observe(run.time, run.states())
        assert {path for path in channels if path in run} == set(run)
        for path in run:
            np.testing.assert_allclose(channels[path], run[path], rtol=1e-12, atol=1e-12, err_msg=path)
        (folder / "a.toml").unlink()  # its text is in the file, and its folder is still there
        assert rebuilt(run).omitted == run.without
        before, after = (model.parts(run.states()[k])[1] for k in (4, 6))
        rate = model.state_rate(0.5, run.states()[5])[2:]
        assert rate == pytest.approx((after - before) / 0.2, rel=0.02)


def test_model_is_rebuilt_from_a_moved_case(folder: Path):
    gone = folder / "gone" / "a.toml"
    edited(folder / "a.h5", case_path=str(gone))
    assert "--case" in refused(folder / "a.h5")
    (folder / "a.toml").write_text(CRAFT.replace("mass = 4", "mass = 5"))  # its text is the run's
    with open_run(folder / "a.h5") as run:
        assert rebuilt(run, folder / "a.toml").system.bodies["hub"].moments.mass == 4.0


def test_run_of_other_inputs_is_not_rebuilt(folder: Path):
    edited(folder / "a.h5", case_text=CRAFT.replace("angle = 0.4", "angle = 0.5"))
    assert "joints[1].angle" in refused(folder / "a.h5")


@pytest.mark.parametrize(("row", "part", "agrees"), [(-1, 2e-7, True), (-1, 5e-6, False), (-2, 5e-6, True)])
def test_last_row_must_agree_with_the_rebuilt_model(folder: Path, row: int, part: float, agrees: bool):
    """The kinetic energy is compared to a part of 1e-6."""
    with h5py.File(folder / "a.h5", "r+") as file:
        file["monitors/kinetic"][row] *= 1 + part
    if agrees:
        with open_run(folder / "a.h5") as run:
            rebuilt(run)
    else:
        assert "meshes" in refused(folder / "a.h5")


# resumed


TURNING = CRAFT.replace("[environment]\ngravity = 2.0\n", "").replace("prismatic", "revolute")
TURNING = TURNING.replace("velocity", "rate")
ORBIT = TURNING + "[orbit]\nperigee_altitude = 5e5\n"


@pytest.mark.parametrize(
    ("text", "begun", "now", "finished"),
    [
        (CRAFT, "duration = 1.5", "duration = 1.5", True),
        (CRAFT, "duration = 1.5", "duration = 1.4", True),
        (CRAFT, "duration = 1.5", "duration = 1.6", False),
        (ORBIT, "orbits = 2", "orbits = 2", True),
        (ORBIT, "orbits = 2", "orbits = 2.5", False),
        (ORBIT, "orbits = 2", "duration = 1.5", False),  # lengths of two kinds are not compared
        (ORBIT, "duration = 1.5", "orbits = 2", False),
    ],
)
def test_complete_run_is_finished_unless_the_case_is_longer(
    folder: Path, text: str, begun: str, now: str, finished: bool
):
    (folder / "a.toml").write_text(text.replace("duration = 1.5", begun))
    case = read_case(folder / "a.toml")
    edited(folder / "a.h5", inputs=inputs_text(case), case_text=case.text)
    (folder / "a.toml").write_text(text.replace("duration = 1.5", now))
    case = read_case(folder / "a.toml")
    assert is_finished(case, folder / "a.h5") is finished
    edited(folder / "a.h5", complete=False)
    assert not is_finished(case, folder / "a.h5")


def test_resumed_run_needs_the_same_terms(folder: Path):
    case, path = read_case(folder / "a.toml"), folder / "a.h5"
    with open_run(path) as run:
        check_same_inputs(run, case)
        assert integrator_of(path) == run.attributes["integrator"] == "dop853"
    edited(path, complete=False)
    model = prepare(case, path, resume=True, without=["push"]).model
    check_same_model(model, path)
    for without in ([], ["gravity", "push"]):
        with pytest.raises(ValueError, match="loads/push"):
            prepare(case, path, resume=True, without=without)
    edited(path, without="")
    with pytest.raises(ValueError, match="loads/push"):
        check_same_model(model, path)
    edited(path, complete=True, without="loads/push")
    with pytest.raises(ValueError, match="complete"):
        prepare(case, path, resume=True, without=["push"])


def test_complete_run_is_returned_unchanged(folder: Path):
    before = (folder / "a.h5").read_bytes()
    with femflex.run(folder / "a.toml", folder / "a.h5", resume=True) as run:
        assert len(run) == 16 and run.complete
    assert (folder / "a.h5").read_bytes() == before


# started from


NAMES = {"q": ("ride.slide", "hinge.angle"), "u": ("ride.slide_rate", "hinge.angle_rate"), "z": ("jet.thrust",)}


def rows(path: Path, names: dict[str, tuple[str, ...]] = NAMES, **changed: float) -> Path:
    """A run of three rows; `q1 = 5.0` changes the second row of q by 5."""
    channels = {
        key: Channel("m, rad" if key != "z" else "N", "", (len(columns),), columns) for key, columns in names.items()
    }
    arrays = {key: 7.0 * ord(key) + np.arange(3.0 * len(columns)).reshape(3, -1) for key, columns in names.items()}
    channels["monitors/energy"], arrays["monitors/energy"] = Channel("J", ""), np.arange(3.0)
    for key, value in changed.items():
        arrays["monitors/energy" if key[0] == "m" else key[0]][int(key[1]), ...] += value
    path.unlink(missing_ok=True)
    with RunWriter(path, channels, {}, {"title": "", "case_text": ""}) as writer:
        writer.write_block(np.arange(3.0), arrays)
        writer.finish(True, "reached the end")
    return path


def test_digest_of_an_initial_run_is_that_of_its_last_state(tmp_path: Path):
    (tmp_path / "a.toml").write_text(CRAFT + '[initial]\nfrom = "start.h5"\n')
    rows(tmp_path / "start.h5")
    case = read_case(tmp_path / "a.toml")

    def digest(*given: Any, **changed: float) -> str:
        rows(tmp_path / "start.h5", *given, **changed)
        (found,) = file_digests(case).items()
        assert found[0] == "initial.from" and found[1]["file"] == "start.h5"
        return found[1]["digest"]

    first = digest()
    assert digest(q1=5.0, u0=1.0, z1=2.0, m2=1.0) == first
    others = [digest(q2=1e-9), digest(u2=1.0), digest(z2=1.0), digest({**NAMES, "u": ("a", "b")})]
    assert len({first, *others}) == 5
    assert not file_digests(case.model_copy(update={"initial": None}))
    (tmp_path / "a.toml").write_text(CRAFT + '[initial]\nfrom = "equilibrium"\n')
    assert not file_digests(read_case(tmp_path / "a.toml"))


def started_from(folder: Path, **more: Any) -> Any:
    (folder / "b.toml").write_text(CRAFT + '[initial]\nfrom = "start.h5"\n')
    return femflex.build_system(read_case(folder / "b.toml"))


def test_craft_starts_from_the_last_row(tmp_path: Path):
    rows(tmp_path / "start.h5", {key: NAMES[key] for key in "qu"})
    q, u = 7.0 * ord("q") + np.array([4.0, 5.0]), 7.0 * ord("u") + np.array([4.0, 5.0])
    assert started_from(tmp_path).initial_state() == pytest.approx([*q, *u])


@pytest.mark.parametrize(
    ("names", "text"),
    [
        ({"q": ("ride.slide", "axle.angle", "c"), "u": NAMES["u"]}, "axle.angle"),
        ({"q": NAMES["q"], "u": NAMES["u"][::-1]}, "order"),
        (NAMES, "jet.thrust"),
    ],
)
def test_run_of_another_craft_is_refused_as_start(tmp_path: Path, names: dict[str, Any], text: str):
    rows(tmp_path / "start.h5", names)
    with pytest.raises(CaseError) as caught:
        started_from(tmp_path)
    assert caught.value.problems[0].where == "initial.from" and text in str(caught.value)


RIDE = """
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
    prepared = replace(prepare(parse_case(RIDE), without=["push"]), integrator=Played(rows, sizes))
    reached: list[float] = []
    try:
        integrate(prepared, output, progress=reached.append)
    finally:
        reached.append(-1.0)
    return reached[:-1]


ROWS = np.column_stack([2.0 * np.arange(10), np.full(10, 2.0)])


def test_every_block_is_written_with_its_resume_state(tmp_path: Path):
    assert played(ROWS, (4, 1, 5), tmp_path / "a.h5") == [3.0, 4.0, 9.0]
    with open_run(tmp_path / "a.h5") as run:
        assert run.complete and run.ended == "reached the end" and run.title == "a ride"
        np.testing.assert_array_equal(run.states(), ROWS)
        np.testing.assert_allclose(run["bodies/hub/position"][:, 0], ROWS[:, 0])
        assert run.statistics["accepted"] == 100 and "ended" not in run.statistics
        assert run.attributes["without"] == "loads/push" and run.case_text == RIDE
    point = resume_point(tmp_path / "a.h5")
    assert (point.rows, point.time) == (10, 9.0) and point.state[head.HEAD :].tolist() == [18.0, 2.0]


@pytest.mark.parametrize("bad", [3, 4, 9])
def test_rows_after_an_overflow_are_left_out(tmp_path: Path, bad: int):
    """4 kg at 1e308 m have a moment of mass that is no number: in the midst of a block, at its start, at its end."""
    rows = ROWS.copy()
    rows[bad:, 0] = 1e308
    with pytest.raises(IntegrationError) as caught:
        played(rows, (4, 6), tmp_path / "a.h5")
    assert f"t = {bad} s" in str(caught.value) and "ride.slide" in str(caught.value)
    with open_run(tmp_path / "a.h5") as run:
        np.testing.assert_array_equal(run.states(), ROWS[:bad])
        assert not run.complete
        assert run.time.tolist() == list(range(bad))
    if bad == 4:
        assert resume_point(tmp_path / "a.h5").rows == 4
    else:  # the block with the failure has no state
        with pytest.raises(ValueError):
            resume_point(tmp_path / "a.h5")


@pytest.mark.parametrize("bad", [2, 5])
def test_diverging_row_is_the_last(tmp_path: Path, bad: int):
    """4e6 m/s: beyond a hundredth of the speed of light."""
    rows = ROWS.copy()
    rows[bad:, 1] = 4e6 + np.arange(10 - bad)
    with pytest.raises(IntegrationError) as caught:
        played(rows, (4, 6), tmp_path / "a.h5")
    assert f"t = {bad} s" in str(caught.value) and "ride.slide_rate" in str(caught.value)
    with open_run(tmp_path / "a.h5") as run:
        np.testing.assert_array_equal(run.states(), rows[: bad + 1])
        assert not run.complete


CASE = """
[run]
duration = 10
output_step = 0.1
[bodies.hub]
kind = "rigid"
mass = 10
inertia = [1, 1, 1]
"""


def law(t, sensors, memory):
    return (np.nan if t > 5.0 else 0.1), memory


@pytest.mark.parametrize("eventful", [False, True])
def test_rows_before_a_command_that_is_not_finite_remain(tmp_path, eventful):
    pilot = Controller("pilot", law, 0.5, commands={"u": "N m"})
    wheel = reaction_wheel("wheel", "hub", 0.1, torque="pilot.u")
    supply = Supply("tank", "hub")
    jet = thruster("jet", "hub", 1e-3, profile=([0.0], [1.0]), specific_impulse=200.0, supply=supply)
    more = (jet, tank("tank", 1.0, ["jet"])) if eventful else ()
    with pytest.raises(ValueError, match="pilot"):
        femflex.run(parse_case(CASE), tmp_path / "run.h5", effectors=(pilot, wheel, *more))
    with open_run(tmp_path / "run.h5") as run:
        assert not run.complete and run.time[-1] == pytest.approx(5.5)
