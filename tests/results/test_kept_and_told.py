"""What a result file keeps and says beyond the common run: trees of text, states, growth, added channels, room."""

from __future__ import annotations

import errno
import os
import signal
import sys
from dataclasses import replace

import h5py
import numpy as np
import pytest
from support.known_run import CHANNELS, known_arrays, known_bodies

from femflex.body import Skin
from femflex.results import FileLock, RunWriter, add_channels, open_run, resume_point
from femflex.results import destination as destination_module
from femflex.results import lock as lock_module
from femflex.results.copying import ENDED, set_attributes
from femflex.results.interrupts import PARTS, finished_on_interrupt, has_work_to_finish, without_interrupts
from femflex.results.layout import CHUNK_ROWS, channel_of, channels_of, create_channel, reserve, row_bytes
from femflex.results.resume import flattened
from femflex.system import Channel

TIMES = np.array([0.5, 1.0, 2.5])
NAMES = ("a", "b", "c", "d", "e")


def made(path, arrays, units, names=None, attributes=None, bodies=None, **options):
    channels = {
        name: Channel(units.get(name, "m"), f"{name}!", values.shape[1:], (names or {}).get(name, ()), "inertial")
        for name, values in arrays.items()
    }
    with RunWriter(path, channels, bodies or {}, attributes or {}) as writer:
        writer.write_block(TIMES, arrays, **options)
    return open_run(path)


def test_a_tree_shows_folders_once_and_leaves_long_units_and_names_out(tmp_path):
    arrays = {
        "bodies/boom/delta": np.zeros((3, 2)),
        "bodies/boom/rate": np.zeros((3, 3)),
        "bodies/hub/rate": np.zeros((3, 3)),
        "loads/hub/force": np.zeros((3, 3)),
        "many": np.zeros((3, 5)),
        "matrix": np.zeros((3, 2, 4)),
        "plain": np.zeros(3),
    }
    units = {"matrix": "kg m^2", "many": "m, " * 9 + "m", "plain": ""}
    names = {"bodies/boom/delta": ("d1", "d2"), "many": NAMES, "matrix": ("x", "y", "z", "w")}
    with made(tmp_path / "run.h5", arrays, units, names, {"title": "T", "without": "damping, loads/push"}) as run:
        text = repr(run)
        assert run._repr_html_() == f"<pre>{text}</pre>" and run.without == ("damping", "loads/push")
        assert not run.linearised and run.ended == "not finished"
    assert text.splitlines() == [
        "run.h5: T",
        "incomplete (not finished), 3 instants, 0.5 to 2.5 s",
        "without damping, loads/push",
        "bodies",
        "  boom",
        "    delta  3 x 2 [m]  (d1, d2)",
        "    rate  3 x 3 [m]",
        "  hub",
        "    rate  3 x 3 [m]",
        "loads",
        "  hub",
        "    force  3 x 3 [m]",
        "many  3 x 5",
        "matrix  3 x 2 x 4 [kg m^2]  (x, y, z, w)",
        "plain  3",
    ]


def test_states_are_coordinates_velocities_and_the_states_of_effectors_in_this_order(tmp_path):
    rng = np.random.default_rng(1)
    arrays = {"z": rng.normal(size=(3, 1)), "u": rng.normal(size=(3, 2)), "q": rng.normal(size=(3, 4))}
    with made(tmp_path / "a.h5", arrays, {"u": "m/s, rad/s"}, attributes={"integrator": "linearised"}) as run:
        assert np.array_equal(run.states(), np.hstack([arrays["q"], arrays["u"], arrays["z"]]))
        assert np.array_equal(run.states(slice(-2, None)), np.hstack([arrays["q"], arrays["u"], arrays["z"]])[1:])
        assert run.linearised and run.duration == 2.0 and run.units("u") == ("m/s", "rad/s")
        assert run.units("z") == ("m",) and run.units("q") == ("m",) * 4
        assert channel_of(run.file["u"]) == Channel("m/s, rad/s", "u!", (2,), (), "inertial")
        assert next(iter(channels_of(run.file))) == "time" and set(channels_of(run.file)) == {"time", "q", "u", "z"}


def test_channels_of_a_file_are_those_it_was_made_of(tmp_path):
    channels = {
        "plain": Channel("", ""),
        "rate": Channel("rad/s", "rate of the hub", (3,), ("x", "y", "z"), "body"),
        "group/pull": Channel("N", "pull", (2, 3), ("u", "v", "w"), "inertial"),
        "group/pitch": Channel("rad", "pitch", (), (), "orbital"),
    }
    arrays = {path: np.zeros((3, *channel.shape)) for path, channel in channels.items()}
    with RunWriter(tmp_path / "run.h5", channels, {}, {}) as writer:
        writer.write_block(TIMES, arrays)
    more = Channel("m", "place", (3,), ("x", "y", "z"), "marker")
    add_channels(tmp_path / "run.h5", {"more": (more, np.zeros((3, 3)))})
    with open_run(tmp_path / "run.h5") as run:
        assert run.channels == channels | {"more": more}


def test_an_unknown_path_among_many_is_answered_with_groups_or_with_what_it_is_part_of(tmp_path):
    arrays = {f"bodies/panel{k}/rate": np.zeros(3) for k in range(7)} | {
        f"loads/push{k}/power": np.zeros(3) for k in range(6)
    }
    with made(tmp_path / "run.h5", arrays, {}) as run:
        with pytest.raises(KeyError, match=r"'zzz' is not in .*run.h5; its groups are \['bodies', 'loads', 'time'\]"):
            run["zzz"]
        with pytest.raises(KeyError) as error:
            run["/push"]
        assert (
            "near it are ['loads/push0/power', 'loads/push1/power', 'loads/push2/power', 'loads/push3/power']"
            in str(error.value)
        )


def test_a_dataset_of_labels_names_every_dimension(tmp_path):
    pytest.importorskip("xarray")
    arrays = {
        "few": np.arange(6.0).reshape(3, 2),
        "a/many": np.arange(15.0).reshape(3, 5),
        "m": np.arange(24.0).reshape(3, 4, 2),
    }
    names = {"few": ("x", "y"), "a/many": NAMES, "m": ("u", "v")}
    with made(tmp_path / "run.h5", arrays, {"few": "kg"}, names, {"title": "T", "flag": True}) as run:
        data = run.to_xarray()
    assert data["few"].dims == ("time", "x_y") and data["a.many"].dims == ("time", "a.many_name")
    assert data["m"].dims == ("time", "size_4", "u_v") and np.array_equal(data["m"], arrays["m"])
    assert float(data["a.many"].sel({"a.many_name": "d"})[1]) == 8.0 and list(data["u_v"].values) == ["u", "v"]
    assert data["few"].attrs == {"units": "kg", "description": "few!", "frame": "inertial"}
    assert data["time"].attrs == {"units": "s"} and np.array_equal(data["time"], TIMES)
    assert data.attrs["flag"] == 1 and data.attrs["complete"] == 0


def test_to_xarray_without_xarray_says_how_to_get_it(tmp_path, monkeypatch):
    with made(tmp_path / "run.h5", {"x": np.zeros(3)}, {}) as run:
        monkeypatch.setitem(sys.modules, "xarray", None)
        with pytest.raises(ImportError, match=r'not installed: pip install "femflex\[xarray\]"'):
            run.to_xarray()


def test_bodies_keep_growth_and_shapes_without_frequencies(tmp_path):
    boom = known_bodies()["boom"]
    growth = np.array([[0.0, 0, 0], [1, 0, 0], [0, 2, 0]])
    skin = Skin(boom.skin.points, {"line": np.array([[0, 2]]), **boom.skin.cells}, boom.skin.shapes, growth)
    bodies = {"boom": replace(boom, skin=skin, omega=np.zeros(0), kinds=("constraint",))}
    with made(tmp_path / "run.h5", {"x": np.zeros(3)}, {}, bodies=bodies) as run:
        found = run.bodies()["boom"]
    assert np.array_equal(found.skin.growth, growth) and found.skin.cells["line"].tolist() == [[0, 2]]
    assert np.isnan(found.omega).all() and found.n_modes == 1 and found.kinds == ("constraint",)
    assert found.strain_field == ()


def test_added_channels_fill_the_rows_of_the_run_and_replace_those_of_their_name(tmp_path):
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
    before = path.read_bytes()
    with pytest.raises(ValueError, match=r"channel 'y' has shape \(6,\); this run needs \(7,\)"):
        add_channels(path, {"x": (Channel("m", "x"), np.zeros(7)), "y": (Channel("m", "y"), np.zeros(6))})
    with FileLock(path) as lock:
        add_channels(path, {}, lock)
        with pytest.raises(BlockingIOError):
            add_channels(path, {})
    assert (
        len(path.read_bytes()) == len(before)
        and os.listdir(tmp_path) == ["run.h5"]
        and not any(part.parent == tmp_path for part in PARTS)
    )


def test_a_failure_while_channels_are_added_leaves_the_file_as_it_was(tmp_path, monkeypatch):
    path = tmp_path / "run.h5"
    made(path, {"x": np.zeros(3)}, {}).close()
    before = path.read_bytes()
    monkeypatch.setattr("femflex.results.adding.create_channel", lambda *_: (_ for _ in ()).throw(OSError("away")))
    with pytest.raises(OSError, match="away"):
        add_channels(path, {"y": (Channel("m", "y"), np.zeros(3))})
    assert (
        path.read_bytes() == before
        and os.listdir(tmp_path) == ["run.h5"]
        and not any(part.parent == tmp_path for part in PARTS)
    )


def test_the_room_that_is_needed_is_compared_with_the_room_that_is_free(tmp_path, monkeypatch):
    path = tmp_path / "run.h5"
    monkeypatch.setattr(destination_module.shutil, "disk_usage", lambda _: Usage)
    destination_module.check_space(path, 3_000_000)
    with pytest.raises(OSError, match=r"run.h5 cannot be written: it takes 4.5 MB, and 3 MB are free") as error:
        destination_module.check_space(path, 4_500_000)
    assert error.value.errno == errno.ENOSPC


class Usage:
    free = 3_000_000


def test_a_folder_without_the_right_to_write_is_refused(tmp_path, monkeypatch):
    monkeypatch.setattr(destination_module.os, "access", lambda path, right: right != os.W_OK)
    with pytest.raises(PermissionError, match=r"cannot be written to; choose another for run.h5"):
        destination_module.check_destination(tmp_path / "run.h5", False)


@pytest.mark.parametrize("alone", [True, False])
def test_the_state_of_the_integrator_comes_back_as_it_was_given(tmp_path, alone):
    state = np.arange(5) if alone else {"x": np.arange(3.0), "inner": {"n": 4, "flags": np.array([True, False])}}
    with made(tmp_path / "run.h5", {"x": np.zeros(3)}, {}, resume=state):
        pass
    point = resume_point(tmp_path / "run.h5")
    assert (point.rows, point.time) == (3, 2.5)
    if alone:
        assert point.state.dtype == np.arange(5).dtype and point.state.tolist() == [0, 1, 2, 3, 4]
    else:
        assert point.state["x"].tolist() == [0, 1, 2] and point.state["inner"]["n"] == 4
        assert point.state["inner"]["flags"].tolist() == [True, False]
    assert {path: value.tolist() for path, value in flattened({"a": {"b": 1, "c": [2, 3]}}).items()} == {
        "a/b": 1,
        "a/c": [2, 3],
    }
    with pytest.raises(ValueError, match=r"entry 'a/b' of the integrator's state is None; only numbers can be kept"):
        flattened({"a": {"b": None}})


@pytest.mark.parametrize(("expected", "first", "then"), [(0, 28, 56), (30, 30, 60), (8, 8, 35)])
def test_room_is_laid_out_for_what_is_expected_else_four_blocks_and_then_doubled(tmp_path, expected, first, then):
    """Blocks of seven rows."""
    path, found = tmp_path / "run.h5", []
    with RunWriter(path, {"x": Channel("m", "x")}, {}, rows=expected) as writer:
        for k in range(5):
            times = np.arange(7.0 * k, 7 * k + 7)
            writer.write_block(times, {"x": times**2})
            with h5py.File(path, "r", locking=False) as file:
                found.append(len(file["time"]))
    assert found[0] == first
    if expected == 8:
        assert found == [8, 16, 32, 32, 64]  # doubled whenever it is full
    else:
        assert found[-1] == then and sorted(set(found)) == [first, then]
    with open_run(path) as run:
        assert np.array_equal(run["x"], np.arange(35.0) ** 2) and len(run.file["time"]) == 35


def test_channels_are_laid_out_in_whole_chunks(tmp_path):
    channels = {"a": Channel("m", "a", (3,)), "b": Channel("m", "b"), "c": Channel("m", "c", (40, 50))}
    assert row_bytes(channels) == 8 * (3 + 1 + 2000)
    with h5py.File(tmp_path / "x.h5", "w") as file:
        data = {name: create_channel(file, name, channel, 5000) for name, channel in channels.items()}
        few = create_channel(file, "few", channels["a"], 12)
        assert [data[name].chunks[0] for name in "abc"] == [CHUNK_ROWS, CHUNK_ROWS, 2**20 // 16000]
        assert few.chunks == (12, 3) and data["c"].chunks[1:] == (40, 50) and data["b"].maxshape == (None,)
        assert np.isnan(data["a"][...]).all() and np.isnan(data["c"].fillvalue)
    reserve(tmp_path / "room", 10_000)
    assert (tmp_path / "room").stat().st_size == 10_000


def test_a_long_end_is_cut_between_letters_and_what_is_no_number_is_refused(tmp_path):
    with h5py.File(tmp_path / "x.h5", "w") as file:
        set_attributes(file, {"ended": "", "list": np.arange(3), "flag": np.bool_(True), "text": "ä"})
        set_attributes(file, {"ended": "ä" * 600 + "!"})
        assert file.attrs["ended"].decode() == "ä" * (ENDED.itemsize // 2)
        set_attributes(file, {"ended": "x" + "ä" * 600})
        assert file.attrs["ended"].decode() == "x" + "ä" * 511
        assert file.attrs["list"].tolist() == [0, 1, 2] and file.attrs["text"] == "ä"
        with pytest.raises(ValueError, match=r"attribute 'bad' is \['a'\]; a result file keeps text, numbers and"):
            set_attributes(file, {"bad": ["a"]})


def test_a_lock_that_the_file_system_does_not_have_keeps_nobody_apart(tmp_path, monkeypatch):
    def none(*_):
        raise OSError(errno.ENOLCK, "no locks here")

    monkeypatch.setattr(lock_module.fcntl, "flock", none)
    with FileLock(tmp_path / "a.h5"), FileLock(tmp_path / "a.h5") as second:
        second.release()
        second.release()


def test_a_lock_on_a_file_that_was_deleted_meanwhile_is_taken_again(tmp_path, monkeypatch):
    place, real, calls = tmp_path / ".a.h5.lock", lock_module.fcntl.flock, []

    def meanwhile(handle, how):
        real(handle, how)
        calls.append(handle)
        if len(calls) == 1:
            place.unlink()  # by the one that had it
        elif len(calls) == 2:
            place.unlink()
            place.write_text("")  # and made anew by a third

    monkeypatch.setattr(lock_module.fcntl, "flock", meanwhile)
    with FileLock(tmp_path / "a.h5") as lock:
        assert len(calls) == 3 and place.exists()
        monkeypatch.setattr(lock_module.fcntl, "flock", real)
        with pytest.raises(BlockingIOError, match=r"a.h5 is being written by another run"):
            FileLock(tmp_path / "a.h5")
        lock.release()
        assert not place.exists()
        FileLock(tmp_path / "a.h5").release()


@pytest.fixture
def interruptible():
    """Ctrl-C raises KeyboardInterrupt, also where the tests run in the background of a shell."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


def test_an_interrupt_waits_until_what_is_inside_is_done(interruptible):
    done = []
    with pytest.raises(KeyboardInterrupt):
        with finished_on_interrupt("a movie"), finished_on_interrupt("a movie"):
            with without_interrupts():
                os.kill(os.getpid(), signal.SIGINT)
                done.append(has_work_to_finish())
            done.append("never")
    assert done == [True] and not has_work_to_finish()
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
    with without_interrupts():
        pass
