"""A file whose rows are known beforehand is laid out once: nothing in it is copied or moved afterwards."""

from __future__ import annotations

import io

import h5py
import numpy as np
import pytest
from support.known_run import CHANNELS, known_arrays, known_bodies

from femflex.results import RunWriter, open_run, resume_point
from femflex.results.copying import conclude
from femflex.results.layout import FILLED_BYTES, row_bytes

HOW = {"complete": True, "ended": "reached the end after a long way " + 20 * "and a word "}
COUNTS = {"accepted": 41, "evaluations": 512, "rejected": 3, "smallest": 1e-3, "largest": 0.4, "newton": 7}


def write(writer, blocks, rows=1000):
    for k in blocks:
        times = np.arange(float(rows * k), rows * (k + 1))
        writer.write_block(times, known_arrays(times), resume={"x": np.full(3, float(k)), "next": k})


def identity(path):
    found = path.stat()
    return found.st_ino, found.st_size


def test_a_run_of_known_length_stays_in_the_file_it_began_in(tmp_path):
    path = tmp_path / "run.h5"
    with RunWriter(path, CHANNELS, known_bodies(), rows=9000) as writer:
        write(writer, [0])
        begun = identity(path)
        write(writer, range(1, 9))
        writer.finish(complete=True, ended="reached the end", statistics=COUNTS)
    assert identity(path) == begun
    with open_run(path) as run:
        assert run.complete and np.array_equal(run["q"], known_arrays(np.arange(9000.0))["q"])
        assert run.statistics == COUNTS


def test_an_interrupted_run_goes_on_in_the_same_file(tmp_path):
    path = tmp_path / "run.h5"
    with pytest.raises(KeyboardInterrupt), RunWriter(path, CHANNELS, known_bodies(), rows=9000) as writer:
        write(writer, range(4))
        begun = identity(path)
        raise KeyboardInterrupt
    with open_run(path) as run:
        assert len(run) == 4000 and not run.complete and run.ended == "interrupted"
        assert np.isnan(run.file["time"][4000:]).all() and np.isnan(run.file["q"][4000:]).all()
    with RunWriter.resumed(path, rows=9000) as writer:
        with open_run(path) as run:
            assert run.ended == "" and not run.complete
        write(writer, range(4, 9))
        writer.finish(complete=True)
    assert identity(path) == begun
    with open_run(path) as run:
        assert run.complete and np.array_equal(run["q"], known_arrays(np.arange(9000.0))["q"])


def test_a_trimmed_run_takes_all_its_room_when_it_is_resumed(tmp_path):
    path = tmp_path / "run.h5"
    with RunWriter(path, CHANNELS, known_bodies(), rows=9000) as writer:
        write(writer, range(2))
        writer.finish(complete=False, ended="failed")
    with RunWriter.resumed(path, rows=9000) as writer:
        begun = identity(path)
        write(writer, range(2, 9))
        writer.finish(complete=True)
    assert identity(path) == begun and resume_point(path).state["next"] == 8


def test_room_beyond_a_quarter_gigabyte_is_reserved_but_only_its_times_are_filled(tmp_path):
    path, rows = tmp_path / "run.h5", FILLED_BYTES // row_bytes(CHANNELS) + 1
    with RunWriter(path, CHANNELS, known_bodies(), rows=rows) as writer:
        write(writer, [0])
        with h5py.File(path, "r", locking=False) as file:
            assert len(file["q"]) == rows and np.isnan(file["time"][1000:]).all()
        assert path.stat().st_blocks * 512 >= rows * row_bytes(CHANNELS)  # a full disk would have shown
        writer.finish(complete=False, ended="enough")
    assert path.stat().st_size < 2**20


def test_an_interrupt_while_the_file_is_trimmed_leaves_it_whole_and_marked(tmp_path, monkeypatch):
    path = tmp_path / "run.h5"
    with pytest.raises(KeyboardInterrupt), RunWriter(path, CHANNELS, known_bodies(), rows=9000) as writer:
        write(writer, range(2))
        monkeypatch.setattr("femflex.results.writer.write_copy", lambda *_: (_ for _ in ()).throw(KeyboardInterrupt))
        writer.finish(complete=False, ended="failed")
    assert [found.name for found in tmp_path.iterdir()] == ["run.h5"]
    with open_run(path) as run:
        assert len(run) == 2000 and not run.complete and run.ended == "interrupted"


class Recorded(io.BytesIO):
    """A file in memory that keeps every write to it: where, and what."""

    def __init__(self, image):
        super().__init__(image)
        self.writes = []

    def write(self, data):
        self.writes.append((self.tell(), bytes(data)))
        return super().write(data)


@pytest.mark.parametrize("how", [HOW, {"complete": False, "ended": "interrupted"}], ids=["finished", "interrupted"])
def test_a_kill_at_any_write_of_the_end_leaves_a_whole_file(tmp_path, how):
    path, torn = tmp_path / "run.h5", tmp_path / "torn.h5"
    writer = RunWriter(path, CHANNELS, known_bodies(), {"case_text": "[run]\n" * 100}, rows=3000)
    write(writer, range(3))
    writer.close()
    image = path.read_bytes()
    record = Recorded(image)
    with h5py.File(record, "r+") as file:
        conclude(file, how, COUNTS)
    for count in range(len(record.writes) + 1):
        mixed = bytearray(image)
        for at, data in record.writes[:count]:
            mixed[at : at + len(data)] = data
        assert len(mixed) == len(image)
        torn.write_bytes(mixed)
        with open_run(torn) as run:
            assert np.array_equal(run["q"], known_arrays(np.arange(3000.0))["q"])
            assert set(run.statistics) <= set(COUNTS) and run.ended in ("", how["ended"])
            assert not run.complete or (run.statistics == COUNTS and run.ended == how["ended"])
    with open_run(torn) as run:
        assert run.complete == how["complete"] and run.statistics == COUNTS
