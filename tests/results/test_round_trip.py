"""Arrays, units, names, bodies and texts come back through our reader, plain h5py and xarray."""

from __future__ import annotations

import os
from dataclasses import replace

import h5py
import numpy as np
import pytest
from support.known_run import CHANNELS, known_arrays, known_bodies, write_known_run

from femflex.body import Skin
from femflex.results import FileLock, RunWriter, add_channels, open_run
from femflex.system import Channel
from femflex.writing import PARTS

ROWS = 0.1 * np.arange(35)


@pytest.fixture
def run_file(tmp_path):
    return write_known_run(tmp_path / "run.h5")


def test_arrays_are_read_bit_for_bit(run_file):
    with open_run(run_file) as run:
        assert np.array_equal(run.time, ROWS)
        for path, value in known_arrays(ROWS).items():
            assert np.array_equal(run[path], value), path
            assert np.array_equal(run.read(path, slice(3, 20, 2)), value[3:20:2])


def test_channels_keep_units_names_and_frames(run_file):
    with open_run(run_file) as run:
        assert run.channels == CHANNELS
        assert sorted(run) == sorted(CHANNELS) and "q" in run and "p" not in run
        assert run.units("q") == ("rad", "kg^1/2 m")
        assert run.units("attitude/angles") == ("rad",) * 3
        assert run.unit("monitors/energy") == "J" and run.units("monitors/energy") == ("J",)
        assert run.names("attitude/angles") == ("pitch", "yaw", "roll") and run.names("monitors/energy") == ()


def test_attributes_and_statistics(run_file):
    with open_run(run_file) as run:
        assert run.complete and run.ended == "reached the end"
        assert run.title == "a known run" and run.case_text == "[run]\nduration = 3.4\n"
        assert run.attributes["rtol"] == 1e-9
        assert run.statistics == {"steps": 41, "h_mean": 0.08}
        assert run.versions["numpy"] == np.__version__ and {"femflex", "python", "h5py"} <= run.versions.keys()
        assert len(run) == 35 and run.duration == pytest.approx(3.4, rel=1e-15)


def test_bodies_are_read_ready_to_draw(run_file):
    with open_run(run_file) as run:
        bodies = run.bodies()
    hub, boom = bodies["hub"], bodies["boom"]
    assert hub.mass == 3.0 and hub.n_modes == 0 and hub.skin is None
    assert boom.mass == 2.0 and boom.kinds == ("vibration",) and np.array_equal(boom.omega, [6.5])
    assert np.array_equal(boom.markers["tip"], [0, 1, 0]) and np.array_equal(boom.markers["origin"], [0, 0, 0])
    for name in ("points", "shapes"):
        assert np.array_equal(getattr(boom.skin, name), getattr(known_bodies()["boom"].skin, name))
    assert np.array_equal(boom.skin.cells["triangle"], [[0, 1, 2]])


def test_plain_h5py_reads_the_documented_layout(run_file):
    with h5py.File(run_file, "r") as file:
        assert file.attrs["complete"] and file.attrs["format"] == "femflex run" and file.attrs["layout"] == 1
        assert file["time"].attrs["unit"] == "s"
        assert list(file["progress"]) == [35, 0]  # five blocks: slots 0, 1, 0, 1, 0
        lengths = {len(file[path]) for path in ("time", "q", "bodies/hub/position", "monitors/energy")}
        assert lengths == {35}
        assert file["q"].chunks is not None and file["q"].maxshape == (None, 2)
        assert list(file["q"].attrs["names"]) == ["joint.angle", "boom.delta1"]
        assert set(file["model/boom"]) == {"points", "cells", "shapes", "omega", "kinds", "markers"}
        assert file["resume/0/steps"][()] == 4 and file["resume/1/steps"][()] == 3


def test_run_with_nan_is_not_complete(tmp_path):
    path = tmp_path / "run.h5"
    times = np.arange(10.0)
    arrays = known_arrays(times)
    arrays["bodies/hub/position"][6, 1] = np.nan
    with RunWriter(path, CHANNELS, known_bodies()) as writer:
        writer.write_block(times, arrays)
        writer.finish(complete=True, ended="reached the end")
    with open_run(path) as run:
        assert not run.complete
        assert "bodies/hub/position" in run.ended and "6 s" in run.ended


def test_run_without_a_block_keeps_the_old_file(run_file):
    contents = run_file.read_bytes()
    with RunWriter(run_file, CHANNELS, known_bodies(), force=True) as writer:
        writer.finish(complete=False, ended="failed to start")
    assert run_file.read_bytes() == contents and len(list(run_file.parent.iterdir())) == 1


def test_first_block_replaces_the_old_file(run_file):
    times = np.arange(3.0)
    with RunWriter(run_file, CHANNELS, known_bodies(), force=True) as writer:
        with open_run(run_file) as run:
            assert len(run) == 35
        writer.write_block(times, known_arrays(times))
        with open_run(run_file) as run:
            assert len(run) == 3


def test_empty_columns_and_empty_blocks(tmp_path):
    path = tmp_path / "run.h5"
    channels = {"bodies/hub/delta": Channel("kg^1/2 m", "elastic coordinates", (0,))}
    with RunWriter(path, channels, known_bodies()) as writer:
        for times in ([], [0.0, 1.0], [], [2.0]):
            writer.write_block(np.array(times), {"bodies/hub/delta": np.zeros((len(times), 0))}, resume=np.zeros(3))
        writer.finish(complete=True)
    with open_run(path) as run:
        assert np.array_equal(run.time, [0, 1, 2]) and run["bodies/hub/delta"].shape == (3, 0)
        assert run.to_xarray()["bodies.hub.delta"].shape == (3, 0)


TIMES = np.array([0.5, 1.0, 2.5])
NAMES = ("a", "b", "c", "d", "e")


def write_run(path, arrays, units, names=None, attributes=None, bodies=None, **options):
    channels = {
        name: Channel(units.get(name, "m"), f"{name}!", values.shape[1:], (names or {}).get(name, ()), "inertial")
        for name, values in arrays.items()
    }
    with RunWriter(path, channels, bodies or {}, attributes or {}) as writer:
        writer.write_block(TIMES, arrays, **options)
    return open_run(path)


def test_added_channels_join_those_of_the_file(tmp_path):
    channels = {
        "plain": Channel("", ""),
        "rate": Channel("rad/s", "rate of the hub", (3,), ("x", "y", "z"), "body"),
        "group/pull": Channel("N", "pull", (2, 3), ("u", "v", "w"), "inertial"),
        "group/pitch": Channel("rad", "pitch", (), (), "orbital"),
    }
    arrays = {path: np.zeros((3, *channel.shape)) for path, channel in channels.items()}
    with RunWriter(tmp_path / "run.h5", channels, {}, {}) as writer:
        writer.write_block(TIMES, arrays)
    place_channel = Channel("m", "place", (3,), ("x", "y", "z"), "marker")
    add_channels(tmp_path / "run.h5", {"more": (place_channel, np.zeros((3, 3)))})
    with open_run(tmp_path / "run.h5") as run:
        assert run.channels == channels | {"more": place_channel}


def test_xarray_dataset_names_every_dimension(tmp_path):
    pytest.importorskip("xarray")
    arrays = {
        "few": np.arange(6.0).reshape(3, 2),
        "a/many": np.arange(15.0).reshape(3, 5),
        "m": np.arange(24.0).reshape(3, 4, 2),
    }
    names = {"few": ("x", "y"), "a/many": NAMES, "m": ("u", "v")}
    with write_run(tmp_path / "run.h5", arrays, {"few": "kg"}, names, {"title": "T", "flag": True}) as run:
        data = run.to_xarray()
    assert data["few"].dims == ("time", "x_y") and data["a.many"].dims == ("time", "a.many_name")
    assert data["m"].dims == ("time", "size_4", "u_v") and np.array_equal(data["m"], arrays["m"])
    assert float(data["a.many"].sel({"a.many_name": "d"})[1]) == 8.0 and list(data["u_v"].values) == ["u", "v"]
    assert data["few"].attrs == {"units": "kg", "description": "few!", "frame": "inertial"}
    assert data["time"].attrs == {"units": "s"} and np.array_equal(data["time"], TIMES)
    assert data.attrs["flag"] == 1 and data.attrs["complete"] == 0


def test_bodies_keep_growth_and_shapes_without_frequencies(tmp_path):
    boom = known_bodies()["boom"]
    growth = np.array([[0.0, 0, 0], [1, 0, 0], [0, 2, 0]])
    skin = Skin(boom.skin.points, {"line": np.array([[0, 2]]), **boom.skin.cells}, boom.skin.shapes, growth)
    bodies = {"boom": replace(boom, skin=skin, omega=np.zeros(0), kinds=("constraint",))}
    with write_run(tmp_path / "run.h5", {"x": np.zeros(3)}, {}, bodies=bodies) as run:
        body = run.bodies()["boom"]
    assert np.array_equal(body.skin.growth, growth) and body.skin.cells["line"].tolist() == [[0, 2]]
    assert np.isnan(body.omega).all() and body.n_modes == 1 and body.kinds == ("constraint",)
    assert body.strain_field == ()


def test_added_channels_fill_the_rows_and_replace_their_namesakes(tmp_path):
    path = tmp_path / "run.h5"
    with pytest.raises(KeyboardInterrupt), RunWriter(path, CHANNELS, known_bodies(), rows=50) as writer:
        writer.write_block(np.arange(7.0), known_arrays(np.arange(7.0)))
        raise KeyboardInterrupt
    new = np.arange(14.0).reshape(7, 2)
    add_channels(
        path,
        {
            "stress/max": (Channel("Pa", "largest", (2,), ("a", "b"), "boom"), new),
            "monitors/energy": (Channel("kJ", "other"), np.arange(7.0)),
        },
    )
    with open_run(path) as run:
        assert np.array_equal(run["stress/max"], new) and run.unit("stress/max") == "Pa"
        assert run.names("stress/max") == ("a", "b") and run.unit("monitors/energy") == "kJ"
        assert np.array_equal(run["monitors/energy"], np.arange(7.0)) and len(run) == 7
        assert len(run.file["stress/max"]) == len(run.file["time"]) == 50
        assert np.isnan(run.file["stress/max"][7:]).all() and np.array_equal(run["q"], known_arrays(run.time)["q"])
    contents = path.read_bytes()
    with pytest.raises(ValueError):
        add_channels(path, {"x": (Channel("m", "x"), np.zeros(7)), "y": (Channel("m", "y"), np.zeros(6))})
    with FileLock(path) as lock:
        add_channels(path, {}, lock)
        with pytest.raises(BlockingIOError):
            add_channels(path, {})
    assert (
        len(path.read_bytes()) == len(contents)
        and os.listdir(tmp_path) == ["run.h5"]
        and not any(part.parent == tmp_path for part in PARTS)
    )


@pytest.mark.parametrize(
    ("times", "changed", "words"),
    [
        (TIMES, {"p": TIMES}, "'p'"),
        (TIMES, {"q": np.zeros((3, 4))}, r"\(3, 2\)"),
        (TIMES[::-1], {}, "increase"),
    ],
)
def test_invalid_block_is_refused_and_not_written(tmp_path, times, changed, words):
    with RunWriter(tmp_path / "run.h5", CHANNELS, known_bodies()) as writer:
        with pytest.raises(ValueError, match=words):
            writer.write_block(times, {**known_arrays(times), **changed})
        assert not (tmp_path / "run.h5").exists()
