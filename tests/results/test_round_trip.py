"""What is written comes back: arrays, units, names, bodies, texts, through our reader, plain h5py and xarray."""

from __future__ import annotations

import h5py
import numpy as np
import pytest
from support.known_run import CHANNELS, known_arrays, known_bodies, write_known_run

from femflex.results import RunWriter, open_run
from femflex.system import Channel

TIMES = 0.1 * np.arange(35)


@pytest.fixture
def written(tmp_path):
    return write_known_run(tmp_path / "run.h5")


def test_arrays_come_back_bit_for_bit(written):
    with open_run(written) as run:
        assert np.array_equal(run.time, TIMES)
        for path, value in known_arrays(TIMES).items():
            assert np.array_equal(run[path], value), path
            assert np.array_equal(run.read(path, slice(3, 20, 2)), value[3:20:2])


def test_channels_come_back_with_units_names_and_frames(written):
    with open_run(written) as run:
        assert run.channels == CHANNELS
        assert sorted(run) == sorted(CHANNELS) and "q" in run and "p" not in run
        assert run.units("q") == ("rad", "kg^1/2 m")
        assert run.units("attitude/angles") == ("rad",) * 3
        assert run.unit("monitors/energy") == "J" and run.units("monitors/energy") == ("J",)
        assert run.names("attitude/angles") == ("pitch", "yaw", "roll") and run.names("monitors/energy") == ()


def test_how_it_ended_and_with_what_it_was_made_come_back(written):
    with open_run(written) as run:
        assert run.complete and run.ended == "reached the end"
        assert run.title == "a known run" and run.case_text == "[run]\nduration = 3.4\n"
        assert run.attributes["rtol"] == 1e-9
        assert run.statistics == {"steps": 41, "h_mean": 0.08}
        assert run.versions["numpy"] == np.__version__ and {"femflex", "python", "h5py"} <= run.versions.keys()
        assert len(run) == 35 and run.duration == pytest.approx(3.4, rel=1e-15)


def test_bodies_come_back_ready_to_draw(written):
    with open_run(written) as run:
        found = run.bodies()
    hub, boom = found["hub"], found["boom"]
    assert hub.mass == 3.0 and hub.n_modes == 0 and hub.skin is None
    assert boom.mass == 2.0 and boom.kinds == ("vibration",) and np.array_equal(boom.omega, [6.5])
    assert np.array_equal(boom.markers["tip"], [0, 1, 0]) and np.array_equal(boom.markers["origin"], [0, 0, 0])
    for name in ("points", "shapes"):
        assert np.array_equal(getattr(boom.skin, name), getattr(known_bodies()["boom"].skin, name))
    assert np.array_equal(boom.skin.cells["triangle"], [[0, 1, 2]])


def test_plain_h5py_finds_the_documented_layout(written):
    with h5py.File(written, "r") as file:
        assert file.attrs["complete"] and file.attrs["format"] == "femflex run" and file.attrs["layout"] == 1
        assert file["time"].attrs["unit"] == "s"
        assert list(file["progress"]) == [35, 0]  # five blocks: slots 0, 1, 0, 1, 0
        lengths = {len(file[path]) for path in ("time", "q", "bodies/hub/position", "monitors/energy")}
        assert lengths == {35}
        assert file["q"].chunks is not None and file["q"].maxshape == (None, 2)
        assert list(file["q"].attrs["names"]) == ["joint.angle", "boom.delta1"]
        assert set(file["model/boom"]) == {"points", "cells", "shapes", "omega", "kinds", "markers"}
        assert file["resume/0/steps"][()] == 4 and file["resume/1/steps"][()] == 3


def test_xarray_dataset_has_units_names_and_survives_netcdf_names(written):
    with open_run(written) as run:
        data = run.to_xarray()
    assert data.attrs["title"] == "a known run" and data["q"].attrs["units"] == "rad, kg^1/2 m"
    angles = data["attitude.angles"]
    assert angles.dims == ("time", "pitch_yaw_roll")
    assert np.array_equal(angles.sel(pitch_yaw_roll="yaw"), known_arrays(TIMES)["attitude/angles"][:, 1])
    assert data["monitors.energy"].dims == ("time",)
    assert not [name for name in data.variables if "/" in str(name)]


def test_the_tree_lists_every_channel(written):
    with open_run(written) as run:
        text = repr(run)
        assert text.splitlines()[:2] == ["run.h5: a known run", "complete, 35 instants, 0 to 3.4 s"]
        assert "  angles  35 x 3 [rad]  (pitch, yaw, roll)" in text
        assert "    position  35 x 3 [m]  (x, y, z)" in text
    assert repr(run).endswith("(closed)")


def test_a_run_in_progress_can_be_read(tmp_path):
    path = tmp_path / "run.h5"
    with RunWriter(path, CHANNELS, known_bodies()) as writer:
        assert not path.exists()
        for k in range(3):
            times = np.arange(10.0 * k, 10 * k + 10)
            writer.write_block(times, known_arrays(times))
            with open_run(path) as run:
                assert len(run) == 10 * (k + 1) and not run.complete and run.ended == ""
                assert np.array_equal(run["q"], known_arrays(run.time)["q"])
        writer.finish(complete=True)
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize("rows", [0, 12, 30, 1000])
def test_room_laid_out_beforehand_does_not_show(tmp_path, rows):
    path = tmp_path / "run.h5"
    with RunWriter(path, CHANNELS, known_bodies(), rows=rows) as writer:
        for k in range(3):
            times = np.arange(10.0 * k, 10 * k + 10)
            writer.write_block(times, known_arrays(times))
        writer.finish(complete=True)
    with h5py.File(path) as file:
        assert file["time"].shape == (30,) and np.array_equal(file["time"], np.arange(30.0))


def test_leaving_early_keeps_what_was_written_and_says_why(tmp_path):
    path = tmp_path / "run.h5"
    times = np.arange(10.0)
    with pytest.raises(ZeroDivisionError), RunWriter(path, CHANNELS, known_bodies()) as writer:
        writer.write_block(times, known_arrays(times))
        raise ZeroDivisionError("in a load")
    with open_run(path) as run:
        assert len(run) == 10 and not run.complete and run.ended == "stopped by ZeroDivisionError: in a load"


def test_a_run_with_nan_is_never_marked_complete(tmp_path):
    path = tmp_path / "run.h5"
    times = np.arange(10.0)
    arrays = known_arrays(times)
    arrays["bodies/hub/position"][6, 1] = np.nan
    with RunWriter(path, CHANNELS, known_bodies()) as writer:
        writer.write_block(times, arrays)
        writer.finish(complete=True, ended="reached the end")
    with open_run(path) as run:
        assert not run.complete
        assert run.ended == "reached the end; values of bodies/hub/position are not finite from t = 6 s on"


def test_a_run_without_a_block_leaves_the_old_file_alone(written):
    before = written.read_bytes()
    with RunWriter(written, CHANNELS, known_bodies(), force=True) as writer:
        writer.finish(complete=False, ended="failed to start")
    assert written.read_bytes() == before and len(list(written.parent.iterdir())) == 1


def test_the_old_file_is_replaced_with_the_first_block(written):
    times = np.arange(3.0)
    with RunWriter(written, CHANNELS, known_bodies(), force=True) as writer:
        with open_run(written) as run:
            assert len(run) == 35
        writer.write_block(times, known_arrays(times))
        with open_run(written) as run:
            assert len(run) == 3


def test_rigid_bodies_have_empty_columns_and_blocks_may_be_empty(tmp_path):
    path = tmp_path / "run.h5"
    channels = {"bodies/hub/delta": Channel("kg^1/2 m", "elastic coordinates", (0,))}
    with RunWriter(path, channels, known_bodies()) as writer:
        for times in ([], [0.0, 1.0], [], [2.0]):
            writer.write_block(np.array(times), {"bodies/hub/delta": np.zeros((len(times), 0))}, resume=np.zeros(3))
        writer.finish(complete=True)
    with open_run(path) as run:
        assert np.array_equal(run.time, [0, 1, 2]) and run["bodies/hub/delta"].shape == (3, 0)
        assert run.to_xarray()["bodies.hub.delta"].shape == (3, 0)


def test_a_first_block_that_failed_can_be_brought_again(tmp_path, monkeypatch):
    path, times = tmp_path / "run.h5", np.arange(40.0)
    with RunWriter(path, CHANNELS, known_bodies()) as writer:
        write = RunWriter._write
        monkeypatch.setattr(RunWriter, "_write", lambda *_: (_ for _ in ()).throw(OSError(5, "the disk is away")))
        with pytest.raises(OSError, match=r"cannot be written \(Input/output error\); nothing had been written before"):
            writer.write_block(times[:4], known_arrays(times[:4]))
        assert not path.exists()
        monkeypatch.setattr(RunWriter, "_write", lambda *_: (_ for _ in ()).throw(OSError("no space\nin the file")))
        with pytest.raises(OSError, match=r"cannot be written \(no space\); nothing had been written before"):
            writer.write_block(times[:4], known_arrays(times[:4]))
        monkeypatch.setattr(RunWriter, "_write", write)
        writer.write_block(times, known_arrays(times))
        writer.finish(complete=True)
    with open_run(path) as run:
        assert run.complete and np.array_equal(run.time, times)


@pytest.mark.parametrize("times", [[0.5, 0.6], [0.4, 0.6], [0.6, 0.6], [0.7, 0.6]])
def test_times_that_do_not_go_on_are_refused(times, tmp_path):
    """An instant written twice is one too many, in a block or between two."""
    with RunWriter(tmp_path / "run.h5", CHANNELS, known_bodies(), {}) as writer:
        first = np.array([0.0, 0.5])
        writer.write_block(first, known_arrays(first))
        with pytest.raises(ValueError, match="the times of the block do not increase, or do not follow those in the"):
            writer.write_block(np.array(times), known_arrays(np.array(times)))
        writer.write_block(np.array([0.6]), known_arrays(np.array([0.6])))
        writer.finish(True, "", {})
