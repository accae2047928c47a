"""A result file has one writer at a time, and a killed one blocks nobody."""

import errno
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from support.known_run import CHANNELS, known_bodies

from femflex.results import FileLock, RunWriter, add_channels, open_run
from femflex.results import writer as lock_module
from femflex.results.interrupts import finished_on_interrupt, has_work_to_finish, without_interrupts
from femflex.system.channel import Channel

HOLDER = """
import sys, time
import errno

from femflex.results.interrupts import finished_on_interrupt, has_work_to_finish, without_interrupts
from femflex.results import FileLock
lock = FileLock(sys.argv[1])
print("locked", flush=True)
time.sleep(600)
"""
BUSY = "is being written by another run"


@pytest.fixture
def holder(tmp_path):
    """A process that has the lock of run.h5."""
    process = subprocess.Popen(
        [sys.executable, "-c", HOLDER, str(tmp_path / "run.h5")], stdout=subprocess.PIPE, text=True
    )
    assert process.stdout is not None and process.stdout.readline() == "locked\n"
    yield process
    process.kill()
    process.wait(30)
    process.stdout.close()


def write_finished_run(path, count=3):
    """A finished run of that many rows."""
    with RunWriter(path, {"x": Channel("m", "place")}, {}) as writer:
        writer.write_block(np.arange(float(count)), {"x": np.zeros(count)}, resume=np.ones(2))
        writer.finish(True)
    return path


def test_file_of_another_writer_is_refused(tmp_path, holder):
    path = tmp_path / "run.h5"
    with pytest.raises(BlockingIOError, match=BUSY):
        RunWriter(path, CHANNELS, known_bodies())
    write_finished_run(tmp_path / "other.h5")
    os.rename(tmp_path / "other.h5", path)
    contents = path.read_bytes()
    with pytest.raises(BlockingIOError, match=BUSY):
        RunWriter(path, CHANNELS, known_bodies(), force=True)
    with pytest.raises(BlockingIOError, match=BUSY):
        RunWriter.resumed(path)
    with pytest.raises(BlockingIOError, match=BUSY):
        add_channels(path, {"y": (Channel("m", "other"), np.zeros(3))})
    (tmp_path / "linked.h5").symlink_to(path)
    with pytest.raises(BlockingIOError, match=BUSY):
        RunWriter.resumed(tmp_path / "linked.h5")
    assert path.read_bytes() == contents and len(open_run(path)) == 3  # readers need no lock


def test_lock_of_a_killed_writer_is_free(tmp_path, holder):
    path = tmp_path / "run.h5"
    holder.send_signal(signal.SIGKILL)
    holder.wait(30)
    assert (tmp_path / ".run.h5.lock").exists()
    write_finished_run(path)
    assert os.listdir(tmp_path) == ["run.h5"]  # and what it left is gone


def test_lock_ends_with_its_writer(tmp_path):
    path = write_finished_run(tmp_path / "run.h5")
    with pytest.raises(FileExistsError):
        RunWriter(path, CHANNELS, known_bodies())
    with pytest.raises(ZeroDivisionError), RunWriter.resumed(path) as writer:
        writer.write_block(np.array([7.0]), {"x": np.zeros(1)})
        with pytest.raises(BlockingIOError, match=BUSY):  # in the same process too
            RunWriter.resumed(path)
        raise ZeroDivisionError
    writer = RunWriter.resumed(path)
    del writer  # without an end
    with RunWriter.resumed(path) as writer:
        assert writer.rows == 4
    assert os.listdir(tmp_path) == ["run.h5"]


@pytest.mark.slow
def test_four_processes_take_the_lock_in_turn(tmp_path):
    """Each adds one to a number in a file, which only works when nobody else does so at the same time."""
    counted = tmp_path / "count"
    counted.write_text("0")
    script = (
        "import sys, time\nfrom pathlib import Path\nfrom femflex.results.writer import FileLock\n"
        "path = Path(sys.argv[1])\n"
        "for _ in range(50):\n"
        "    while True:\n"
        "        try:\n            lock = FileLock(path)\n            break\n"
        "        except BlockingIOError:\n            time.sleep(1e-4)\n"
        "    path.write_text(str(int(path.read_text()) + 1))\n    lock.release()\n"
    )
    processes = [subprocess.Popen([sys.executable, "-c", script, str(counted)]) for _ in range(4)]
    assert [process.wait(300) for process in processes] == [0] * 4
    assert counted.read_text() == "200"


RUN = [sys.executable, "-m", "femflex", "run"]


@pytest.mark.slow
def test_second_run_or_resume_is_refused_and_the_first_completes(write_case, craft, tmp_path):
    long_case = craft.replace('duration = "10 s"', 'duration = "400 s"').replace(
        "output_step = 0.05", "output_step = 0.05\nmax_step = 0.0001"
    )
    case, output = write_case(long_case), tmp_path / "run.h5"
    with subprocess.Popen([*RUN, str(case), "-o", str(output)], stdout=subprocess.DEVNULL) as first_process:
        while not output.exists() and first_process.poll() is None:
            time.sleep(0.02)
        for words in (["--force"], ["--resume"]):
            second_process = subprocess.run(
                [*RUN, str(case), "-o", str(output), *words], capture_output=True, text=True
            )
            assert first_process.poll() is None
            assert second_process.returncode == 2 and BUSY in second_process.stderr
        assert first_process.wait(300) == 0
    with open_run(output) as run:
        assert run.complete and len(run) == 8001
    assert not Path(f"{output}.part").exists()


def test_file_system_without_locks(tmp_path, monkeypatch):
    def refuse_lock(*_):
        raise OSError(errno.ENOLCK, "no locks here")

    monkeypatch.setattr(lock_module.fcntl, "flock", refuse_lock)
    with FileLock(tmp_path / "a.h5"), FileLock(tmp_path / "a.h5") as second:
        second.release()
        second.release()


def test_lock_file_deleted_meanwhile_is_locked_again(tmp_path, monkeypatch):
    lock_file, flock, calls = tmp_path / ".a.h5.lock", lock_module.fcntl.flock, []

    def delete_then_lock(handle, operation):
        flock(handle, operation)
        calls.append(handle)
        if len(calls) == 1:
            lock_file.unlink()  # by the one that had it
        elif len(calls) == 2:
            lock_file.unlink()
            lock_file.write_text("")  # and made anew by a third

    monkeypatch.setattr(lock_module.fcntl, "flock", delete_then_lock)
    with FileLock(tmp_path / "a.h5") as lock:
        assert len(calls) == 3 and lock_file.exists()
        monkeypatch.setattr(lock_module.fcntl, "flock", flock)
        with pytest.raises(BlockingIOError, match=r"a.h5 is being written by another run"):
            FileLock(tmp_path / "a.h5")
        lock.release()
        assert not lock_file.exists()
        FileLock(tmp_path / "a.h5").release()


@pytest.fixture
def interruptible():
    """Ctrl-C raises KeyboardInterrupt, also where the tests run in the background of a shell."""
    handler = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, handler)


def test_interrupt_waits_for_the_protected_block(interruptible):
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
