"""Nothing written is lost: kills at any moment, interrupts, stops and resumed runs, compared bit for bit."""

from __future__ import annotations

import io
import os
import signal
import subprocess
import sys
from pathlib import Path

import h5py
import numpy as np
import pytest
from support.known_run import CHANNELS, known_arrays, known_bodies

from femflex.results import RunWriter, open_run, resume_point
from femflex.results.copying import conclude
from femflex.results.interrupts import without_interrupts

PAGE = 4096

KILLER = """
import os, random, signal, sys, time
import numpy as np
sys.path.insert(0, {here!r})
from support.known_run import CHANNELS, known_arrays, known_bodies
from femflex.results import RunWriter, open_run

def write_on(path, pipe, rows):
    writer = RunWriter(path, CHANNELS, known_bodies())
    for k in range(10**6):
        times = np.arange(float(k * rows), (k + 1) * rows)
        writer.write_block(times, known_arrays(times), resume={{"next": (k + 1) * rows, "x": np.full(50, k + 0.5)}})
        os.write(pipe, b".")

random.seed({seed})
for trial in range({trials}):
    path, rows = f"{{trial:04d}}.h5", random.choice([1, 20, 1024])
    reader, pipe = os.pipe()
    child = os.fork()
    if child == 0:
        write_on(path, pipe, rows)
    os.close(pipe)
    os.read(reader, 1)
    time.sleep(random.uniform(0, 0.08))
    os.kill(child, signal.SIGKILL)
    os.waitpid(child, 0)
    acknowledged = 1
    while got := os.read(reader, 65536):
        acknowledged += len(got)
    os.close(reader)
    print(path, rows, acknowledged, flush=True)
"""


def killed_runs(folder, trials, seed):
    """Path, rows of a block, and blocks acknowledged, of runs killed at random moments."""
    script = KILLER.format(here=str(Path(__file__).parents[1]), trials=trials, seed=seed)
    done = subprocess.run([sys.executable, "-c", script], cwd=folder, capture_output=True, text=True, check=True)
    for line in done.stdout.splitlines():
        name, rows, acknowledged = line.split()
        yield folder / name, int(rows), int(acknowledged)


def check_killed(path, rows, acknowledged):
    with h5py.File(path, "r") as file:  # plain h5py, locks and all
        valid, slot = file["progress"][()]
        assert valid in (rows * acknowledged, rows * (acknowledged + 1))
        assert len({len(file[name]) for name in ("time", "q", "bodies/hub/position", "monitors/energy")}) == 1
        assert not file.attrs["complete"]
        assert file[f"resume/{slot}/next"][()] == valid
        assert np.all(file[f"resume/{slot}/x"][()] == valid / rows - 0.5)
    with open_run(path) as run:
        assert np.array_equal(run.time, np.arange(valid))
        for name, value in known_arrays(run.time).items():
            assert np.array_equal(run[name], value), name
    with RunWriter.resumed(path) as writer:
        times = np.arange(float(valid), valid + 5)
        writer.write_block(times, known_arrays(times), resume={"next": int(valid) + 5, "x": np.zeros(50)})
    with open_run(path) as run:
        assert np.array_equal(run["q"], known_arrays(np.arange(valid + 5.0))["q"])


@pytest.mark.skipif(sys.platform == "win32", reason="needs fork and SIGKILL")
@pytest.mark.parametrize(("trials", "seed"), [(5, 1), pytest.param(600, 2, marks=pytest.mark.slow)])
def test_kill_loses_at_most_the_block_being_written(tmp_path, trials, seed):
    count = 0
    for path, rows, acknowledged in killed_runs(tmp_path, trials, seed):
        check_killed(path, rows, acknowledged)
        count += 1
    assert count == trials


def test_mixture_of_old_and_new_pages_reads_as_the_old_run(tmp_path):
    """A kill leaves some pages of a block on the disk and others not: whichever, the file is whole."""
    path, torn = tmp_path / "run.h5", tmp_path / "torn.h5"
    rng = np.random.default_rng(5)
    with RunWriter(path, CHANNELS, known_bodies(), rows=4000) as writer:
        images = []
        for k in range(3):
            times = np.arange(1000.0 * k, 1000 * k + 1000)
            writer.write_block(times, known_arrays(times), resume={"x": np.full(3000, float(k))})
            images.append(path.read_bytes())
        with h5py.File(path, "r", locking=False) as file:
            progress = file["progress"].id.get_offset()
        writer.finish(complete=False)
    old, new = (np.frombuffer(image + bytes(-len(image) % PAGE), np.uint8) for image in images[1:])
    assert old.size == new.size
    for _ in range(20):
        fresh = rng.random(old.size // PAGE) < rng.random()
        mixed = np.where(np.repeat(fresh, PAGE), new, old)
        mixed[progress : progress + 16] = old[progress : progress + 16]
        torn.write_bytes(mixed.tobytes()[: len(images[1])])
        with open_run(torn) as run:
            assert len(run) == 2000
            assert all(np.array_equal(run[name], value) for name, value in known_arrays(run.time).items())
        assert np.all(resume_point(torn).state["x"] == 1)


def test_stopped_run_is_resumed_after_its_last_block(tmp_path):
    path = tmp_path / "run.h5"
    first_block, second_block = np.arange(0.0, 10), np.arange(10.0, 15)
    with RunWriter(path, CHANNELS, known_bodies(), {"title": "long"}) as writer:
        writer.write_block(
            first_block, known_arrays(first_block), resume={"h": 0.1, "x": {"q": np.arange(3.0), "order": 8}}
        )
        writer.finish(complete=False, ended="interrupted")
    point = resume_point(path)
    assert (point.rows, point.time) == (10, 9.0)
    assert point.state["h"] == 0.1 and point.state["x"]["order"] == 8
    assert np.array_equal(point.state["x"]["q"], np.arange(3.0))
    with RunWriter.resumed(path) as writer:
        assert writer.rows == 10 and writer.channels == CHANNELS
        with open_run(path) as run:
            assert not run.complete and run.ended == ""
        writer.write_block(
            second_block, known_arrays(second_block), resume={"h": 0.2, "x": {"q": np.arange(3.0), "order": 7}}
        )
        writer.finish(complete=True, ended="reached the end", statistics={"steps": 3})
    with open_run(path) as run:
        assert run.complete and run.title == "long" and np.array_equal(run.time, np.arange(15.0))
        assert all(np.array_equal(run[name], value) for name, value in known_arrays(run.time).items())
        assert run.bodies()["boom"].skin is not None
    assert resume_point(path).state["x"]["order"] == 7


def test_integrator_state_may_change_its_shape(tmp_path):
    path = tmp_path / "run.h5"
    with RunWriter(path, CHANNELS, known_bodies()) as writer:
        for k in range(4):
            times = np.arange(10.0 * k, 10 * k + 10)
            state = np.random.default_rng(k).standard_normal(2 + k // 2)
            writer.write_block(times, known_arrays(times), resume=state)
            assert np.array_equal(resume_point(path).state, state)


FULL_DISK = """
import resource, signal, sys
import numpy as np
sys.path.insert(0, {here!r})
from support.known_run import CHANNELS, known_arrays, known_bodies
from femflex.results import RunWriter

resource.setrlimit(resource.RLIMIT_FSIZE, (2_000_000, resource.RLIM_INFINITY))
with RunWriter("run.h5", CHANNELS, known_bodies()) as writer:
    try:
        for k in range(10**6):
            times = np.arange(1000.0 * k, 1000 * k + 1000)
            writer.write_block(times, known_arrays(times), resume={{"x": times[:10]}})
    except OSError as error:
        print(error, writer.rows, sep="|")
        writer.finish(complete=False, ended="the disk is full")
"""


@pytest.mark.skipif(sys.platform == "win32", reason="needs a limit of file size")
def test_full_disk_keeps_the_blocks_written_before(tmp_path):
    script = FULL_DISK.format(here=str(Path(__file__).parents[1]))
    process = subprocess.run([sys.executable, "-c", script], cwd=tmp_path, capture_output=True, text=True, check=True)
    printed, rows = process.stdout.strip().split("|")
    assert "run.h5" in printed and rows in printed
    assert int(rows) >= 4000 and process.stderr == ""
    assert [path.name for path in tmp_path.iterdir()] == ["run.h5"]
    with open_run(tmp_path / "run.h5") as run:
        assert len(run) == int(rows) and not run.complete and run.ended == "the disk is full"
        assert all(np.array_equal(run[name], value) for name, value in known_arrays(run.time).items())
    assert np.array_equal(resume_point(tmp_path / "run.h5").state["x"], run_times(int(rows)))


def run_times(rows):
    return np.arange(rows - 1000.0, rows - 990)


CONCLUSION = {"complete": True, "ended": "reached the end after a long way " + 20 * "and a word "}
COUNTS = {"accepted": 41, "evaluations": 512, "rejected": 3, "smallest": 1e-3, "largest": 0.4, "newton": 7}


def write(writer, blocks, rows=1000):
    for k in blocks:
        times = np.arange(float(rows * k), rows * (k + 1))
        writer.write_block(times, known_arrays(times), resume={"x": np.full(3, float(k)), "next": k})


def file_identity(path):
    status = path.stat()
    return status.st_ino, status.st_size


def test_run_of_known_length_stays_in_its_file(tmp_path):
    path = tmp_path / "run.h5"
    with RunWriter(path, CHANNELS, known_bodies(), rows=9000) as writer:
        write(writer, [0])
        begun = file_identity(path)
        write(writer, range(1, 9))
        writer.finish(complete=True, ended="reached the end", statistics=COUNTS)
    assert file_identity(path) == begun
    with open_run(path) as run:
        assert run.complete and np.array_equal(run["q"], known_arrays(np.arange(9000.0))["q"])
        assert run.statistics == COUNTS


def test_interrupted_run_is_resumed_in_the_same_file(tmp_path):
    path = tmp_path / "run.h5"
    with pytest.raises(KeyboardInterrupt), RunWriter(path, CHANNELS, known_bodies(), rows=9000) as writer:
        write(writer, range(4))
        begun = file_identity(path)
        raise KeyboardInterrupt
    with open_run(path) as run:
        assert len(run) == 4000 and not run.complete and run.ended == "interrupted"
        assert np.isnan(run.file["time"][4000:]).all() and np.isnan(run.file["q"][4000:]).all()
    with RunWriter.resumed(path, rows=9000) as writer:
        with open_run(path) as run:
            assert run.ended == "" and not run.complete
        write(writer, range(4, 9))
        writer.finish(complete=True)
    assert file_identity(path) == begun
    with open_run(path) as run:
        assert run.complete and np.array_equal(run["q"], known_arrays(np.arange(9000.0))["q"])


class Recorded(io.BytesIO):
    """A file in memory that keeps every write to it: where, and what."""

    def __init__(self, image):
        super().__init__(image)
        self.writes = []

    def write(self, data):
        self.writes.append((self.tell(), bytes(data)))
        return super().write(data)


@pytest.mark.parametrize(
    "conclusion", [CONCLUSION, {"complete": False, "ended": "interrupted"}], ids=["finished", "interrupted"]
)
def test_kill_at_any_write_of_the_end_leaves_a_valid_file(tmp_path, conclusion):
    path, torn = tmp_path / "run.h5", tmp_path / "torn.h5"
    writer = RunWriter(path, CHANNELS, known_bodies(), {"case_text": "[run]\n" * 100}, rows=3000)
    write(writer, range(3))
    writer.close()
    image = path.read_bytes()
    record = Recorded(image)
    with h5py.File(record, "r+") as file:
        conclude(file, conclusion, COUNTS)
    for count in range(len(record.writes) + 1):
        mixed = bytearray(image)
        for offset, data in record.writes[:count]:
            mixed[offset : offset + len(data)] = data
        assert len(mixed) == len(image)
        torn.write_bytes(mixed)
        with open_run(torn) as run:
            assert np.array_equal(run["q"], known_arrays(np.arange(3000.0))["q"])
            assert set(run.statistics) <= set(COUNTS) and run.ended in ("", conclusion["ended"])
            assert not run.complete or (run.statistics == COUNTS and run.ended == conclusion["ended"])
    with open_run(torn) as run:
        assert run.complete == conclusion["complete"] and run.statistics == COUNTS


@pytest.mark.parametrize("blocks", [0, 2])
@pytest.mark.parametrize("complete", [True, False])
def test_run_without_rows_leaves_no_file(tmp_path: Path, blocks: int, complete: bool):
    none = np.zeros(0)
    with RunWriter(tmp_path / "run.h5", CHANNELS, known_bodies(), {}) as writer:
        for k in range(blocks):
            writer.write_block(none, known_arrays(none), resume={"steps": k})
        writer.finish(complete=complete, ended="at once", statistics={"steps": 0})
    assert list(tmp_path.iterdir()) == []


def test_delayed_interrupt_reaches_the_handler_of_before():
    received: list[int] = []
    before = signal.signal(signal.SIGINT, lambda number, _: received.append(number))
    try:
        with pytest.raises(KeyboardInterrupt), without_interrupts():
            os.kill(os.getpid(), signal.SIGINT)
            assert not received
    finally:
        signal.signal(signal.SIGINT, before)
    assert received == [signal.SIGINT]
