"""What a finished run must agree with: the model built again from it, the case that resumes it or starts from it."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest

import femflex
from femflex.case import CaseError, read_case
from femflex.pipeline import prepare, rebuilt
from femflex.pipeline.file_digests import file_digests
from femflex.pipeline.inputs import inputs_text
from femflex.pipeline.resumed import check_same_inputs, check_same_model, integrator_of, is_finished
from femflex.results import RunWriter, open_run
from femflex.system import Channel

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
def done(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder with the case and its run."""
    folder = tmp_path_factory.mktemp("done")
    (folder / "a.toml").write_text(CRAFT)
    femflex.run(folder / "a.toml", folder / "a.h5", without=["push"]).close()
    return folder


@pytest.fixture
def folder(done: Path, tmp_path: Path) -> Path:
    """A copy of it, its case where the file says it is."""
    for name in ("a.toml", "a.h5"):
        shutil.copy(done / name, tmp_path)
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


def test_the_model_built_again_moves_as_the_run_did(folder: Path):
    with open_run(folder / "a.h5") as run:
        model = rebuilt(run)
        assert model.omitted == run.without == ("loads/push",)
        seen = model.observe(run.time, run.states())
        assert {path for path in seen if path in run} == set(run)
        for path in run:
            np.testing.assert_allclose(seen[path], run[path], rtol=1e-12, atol=1e-12, err_msg=path)
        (folder / "a.toml").unlink()  # its text is in the file, and its folder is still there
        assert rebuilt(run).omitted == run.without
        before, after = (model.parts(run.states()[k])[1] for k in (4, 6))
        rate = model.state_rate(0.5, run.states()[5])[2:]
        assert rate == pytest.approx((after - before) / 0.2, rel=0.02)


def test_a_case_that_has_moved_is_looked_for_where_it_is_now(folder: Path):
    gone = folder / "gone" / "a.toml"
    edited(folder / "a.h5", case_path=str(gone))
    assert refused(folder / "a.h5") == (
        f"{folder / 'a.h5'} was made from {gone}, and that folder is not here; say where the case file is now "
        "(--case), for the meshes in its folder"
    )
    (folder / "a.toml").write_text(CRAFT.replace("mass = 4", "mass = 5"))  # its text is the run's
    with open_run(folder / "a.h5") as run:
        assert rebuilt(run, folder / "a.toml").system.bodies["hub"].moments.mass == 4.0


def test_a_run_without_its_case_has_no_model(folder: Path):
    edited(folder / "a.h5", case_text="")
    assert refused(folder / "a.h5") == (f"{folder / 'a.h5'} keeps no case text, so its model cannot be built again")


def test_a_run_of_other_inputs_has_no_model(folder: Path):
    edited(folder / "a.h5", case_text=CRAFT.replace("angle = 0.4", "angle = 0.5"))
    assert refused(folder / "a.h5") == (
        f"{folder / 'a.h5'} was made with other inputs: joints[1].angle was 0.4, now 0.5. Undo the change, or run the "
        "case anew"
    )


def test_a_run_with_effectors_from_python_has_no_model(folder: Path):
    edited(folder / "a.h5", effectors="pilot, jet")
    assert refused(folder / "a.h5") == (
        f"{folder / 'a.h5'} was made with effectors from Python (pilot, jet), which no case text holds, so its model "
        "cannot be built again; compile it in Python with the same ones"
    )


def test_bodies_that_vary_are_to_be_given_again(folder: Path):
    edited(folder / "a.h5", varying="arm")
    assert refused(folder / "a.h5") == (
        f"{folder / 'a.h5'} was made with bodies that vary with time: arm; now there are: none. The functions that "
        "write their properties are not kept in the file: hand the same ones over again from Python (`varying`)"
    )


@pytest.mark.parametrize(("row", "part", "agrees"), [(-1, 2e-7, True), (-1, 5e-6, False), (-2, 5e-6, True)])
def test_the_last_row_must_be_what_the_model_reports(folder: Path, row: int, part: float, agrees: bool):
    """The kinetic energy is compared to a part of 1e-6."""
    with h5py.File(folder / "a.h5", "r+") as file:
        file["monitors/kinetic"][row] *= 1 + part
    if agrees:
        with open_run(folder / "a.h5") as run:
            rebuilt(run)
    else:
        assert refused(folder / "a.h5") == (
            f"the model built again from the case text of {folder / 'a.h5'} is not the one that made it: its meshes, "
            "or femflex, have changed since. Run the case anew."
        )


@pytest.mark.parametrize(("part", "agrees"), [(2e-10, True), (1e-8, False)])
def test_elastic_energy_counts_from_a_billionth_of_the_energies_on(folder: Path, part: float, agrees: bool):
    """The craft is rigid: its own elastic energy is zero."""
    with h5py.File(folder / "a.h5", "r+") as file:
        file["monitors/elastic"][-1] = part * file["monitors/kinetic"][()].max()
    with open_run(folder / "a.h5") as run:
        if agrees:
            rebuilt(run)
        else:
            with pytest.raises(ValueError, match="is not the one that made it"):
                rebuilt(run)


@pytest.mark.parametrize("path", ["q", "u"])
def test_coordinates_of_another_name_are_another_model(folder: Path, path: str):
    with h5py.File(folder / "a.h5", "r+") as file:
        file[path].attrs["names"] = np.array(["ride.slide", "axle.angle"], dtype=object)
    assert "is not the one that made it" in refused(folder / "a.h5")


def test_a_run_without_rows_has_nothing_to_compare(folder: Path):
    with h5py.File(folder / "a.h5", "r+") as file:
        file["progress"][0] = 0
    assert refused(folder / "a.h5") == f"{folder / 'a.h5'} holds no instants"


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
        (ORBIT, "orbits = 2", "duration = 1.5", False),  # which of them is longer cannot be told
        (ORBIT, "duration = 1.5", "orbits = 2", False),
    ],
)
def test_a_complete_run_is_finished_unless_the_case_is_longer(
    folder: Path, text: str, begun: str, now: str, finished: bool
):
    (folder / "a.toml").write_text(text.replace("duration = 1.5", begun))
    edited(folder / "a.h5", inputs=inputs_text(read_case(folder / "a.toml")))
    (folder / "a.toml").write_text(text.replace("duration = 1.5", now))
    case = read_case(folder / "a.toml")
    assert is_finished(case, folder / "a.h5") is finished
    edited(folder / "a.h5", complete=False)
    assert not is_finished(case, folder / "a.h5")


def test_a_run_is_resumed_with_what_began_it(folder: Path):
    case, path = read_case(folder / "a.toml"), folder / "a.h5"
    with open_run(path) as run:
        check_same_inputs(run, case)
        assert integrator_of(path) == run.attributes["integrator"] == "dop853"
    edited(path, complete=False)
    model = prepare(case, path, resume=True, without=["push"]).model
    check_same_model(model, path)
    with pytest.raises(ValueError) as caught:
        prepare(case, path, resume=True)
    assert str(caught.value) == (
        f"{path} was begun with loads/push switched off, not nothing; resume it likewise, or start anew"
    )
    with pytest.raises(ValueError, match=r"was begun with loads/push switched off, not gravity, loads/push; resume"):
        prepare(case, path, resume=True, without=["gravity", "push"])
    edited(path, without="")
    with pytest.raises(ValueError, match="was begun with nothing switched off, not loads/push; resume"):
        check_same_model(model, path)
    edited(path, complete=True, without="loads/push")
    with pytest.raises(ValueError) as caught:
        prepare(case, path, resume=True, without=["push"])
    assert str(caught.value) == f"{path} is complete; there is nothing to resume"


def test_a_run_without_instants_yet_is_begun_again_with_the_same_model(folder: Path):
    """It has no row to compare with; what is switched off and what varies are compared all the same."""
    case, path = read_case(folder / "a.toml"), folder / "a.h5"
    edited(path, complete=False)
    model = prepare(case, path, resume=True, without=["push"]).model
    with h5py.File(path, "r+") as file:
        file["progress"][0] = 0
    check_same_model(model, path)
    edited(path, without="gravity")
    with pytest.raises(ValueError, match="was begun with gravity switched off, not loads/push; resume"):
        check_same_model(model, path)


def test_a_complete_run_is_returned_as_it_is(folder: Path):
    before = (folder / "a.h5").read_bytes()
    with femflex.run(folder / "a.toml", folder / "a.h5", resume=True) as run:
        assert len(run) == 16 and run.complete
    assert (folder / "a.h5").read_bytes() == before


# started from


NAMES = {"q": ("ride.slide", "hinge.angle"), "u": ("ride.slide_rate", "hinge.angle_rate"), "z": ("jet.thrust",)}


def rows(path: Path, names: dict[str, tuple[str, ...]] = NAMES, **changed: float) -> Path:
    """A run of three rows; `q1 = 5.0` changes the second row of q by 5."""
    channels = {key: Channel("m, rad" if key != "z" else "N", "", (len(own),), own) for key, own in names.items()}
    arrays = {key: 7.0 * ord(key) + np.arange(3.0 * len(own)).reshape(3, -1) for key, own in names.items()}
    channels["monitors/energy"], arrays["monitors/energy"] = Channel("J", ""), np.arange(3.0)
    for key, value in changed.items():
        arrays["monitors/energy" if key[0] == "m" else key[0]][int(key[1]), ...] += value
    path.unlink(missing_ok=True)
    with RunWriter(path, channels, {}, {"title": "", "case_text": ""}) as writer:
        writer.write_block(np.arange(3.0), arrays)
        writer.finish(True, "reached the end")
    return path


def test_of_a_run_that_a_craft_starts_from_the_last_state_counts(tmp_path: Path):
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


def test_a_craft_starts_where_the_last_row_is(tmp_path: Path):
    rows(tmp_path / "start.h5", {key: NAMES[key] for key in "qu"})
    q, u = 7.0 * ord("q") + np.array([4.0, 5.0]), 7.0 * ord("u") + np.array([4.0, 5.0])
    assert started_from(tmp_path).initial_state() == pytest.approx([*q, *u])


@pytest.mark.parametrize(
    ("names", "text"),
    [
        (
            {"q": ("ride.slide", "axle.angle", "c"), "u": NAMES["u"]},
            "it has 3 coordinates and this one 2; axle.angle is only there, hinge.angle only here",
        ),
        (
            {"q": NAMES["q"], "u": NAMES["u"][::-1]},
            "it has 2 coordinates and this one 2; the order is only there, the order only here",
        ),
        (NAMES, "it has 1 coordinates and this one 0; jet.thrust is only there, the order only here"),
    ],
)
def test_the_run_of_another_craft_is_no_start(tmp_path: Path, names: dict[str, Any], text: str):
    rows(tmp_path / "start.h5", names)
    with pytest.raises(CaseError) as caught:
        started_from(tmp_path)
    (problem,) = caught.value.problems
    assert (problem.where, problem.text) == ("initial.from", f"found 'start.h5', which is of another craft: {text}")


def test_a_file_that_holds_no_state_is_no_start(tmp_path: Path):
    rows(tmp_path / "start.h5", {key: NAMES[key] for key in "qu"})
    with h5py.File(tmp_path / "start.h5", "r+") as file:
        file["progress"][0] = 0
    with pytest.raises(CaseError) as caught:
        started_from(tmp_path)
    (problem,) = caught.value.problems
    assert (problem.where, problem.text) == ("initial.from", f"{tmp_path / 'start.h5'} holds no instants")
    (tmp_path / "start.h5").write_text("no result")
    with pytest.raises(CaseError, match=r"initial\.from: .*start\.h5 is not a result file"):
        started_from(tmp_path)


def test_each_reason_that_keeps_a_craft_from_resting_is_a_problem_of_its_own(tmp_path: Path):
    text = TURNING + (
        "[initial]\nfrom = 'equilibrium'\n[attitude]\nframe = 'inertial'\n"
        "[orbit]\nsemi_major_axis = 9e6\neccentricity = 0.1\n"
    )
    (tmp_path / "a.toml").write_text(text)
    with pytest.raises(CaseError) as caught:
        femflex.build_system(read_case(tmp_path / "a.toml"))
    found = [str(problem) for problem in caught.value.problems]
    assert len(found) == 2
    assert found[0].startswith("initial.from: the orbit's eccentricity is 0.1, and gravity and its frame's rate change")
    assert found[1].startswith("initial.from: the attitude is measured from the inertial frame, in which")
