"""What a writer takes of the disk and leaves there, and copies made in several steps."""

from __future__ import annotations

from importlib.metadata import version
from pathlib import Path

import numpy as np
import pytest
from support.known_run import CHANNELS, known_arrays, known_bodies

from femflex.results import RunWriter, copying, layout, open_run
from femflex.results.interrupts import PARTS, has_work_to_finish, without_interrupts


@pytest.mark.parametrize("blocks", [0, 1, 4])
def test_a_run_leaves_its_own_file_alone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, blocks: int):
    """Neither the file in memory that it begins with, nor parts, nor locks; without a block not even its own."""
    monkeypatch.chdir(tmp_path)
    others = set(PARTS)
    with RunWriter("a.h5", CHANNELS, known_bodies(), {"title": "", "case_text": ""}) as writer:
        for k in range(blocks):
            times = 0.1 * np.arange(3 * k, 3 * k + 3)
            writer.write_block(times, known_arrays(times))
            assert has_work_to_finish()
        writer.finish(True, "reached the end")
    assert [path.name for path in tmp_path.iterdir()] == ["a.h5"] * (blocks > 0)
    assert not has_work_to_finish() and others == PARTS


def test_rows_copied_in_several_steps_are_all_there(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """Eight rows of three numbers a step: 29 rows in four steps, the last of them of five rows."""
    monkeypatch.setattr(copying, "COPY_BYTES", 8 * 8 * 3 + 7)
    times = 0.1 * np.arange(29)
    with RunWriter(tmp_path / "a.h5", CHANNELS, known_bodies(), {"title": "", "case_text": ""}, rows=40) as writer:
        writer.write_block(times[:20], known_arrays(times[:20]))
        writer.write_block(times[20:], known_arrays(times[20:]))
        writer.finish(True, "reached the end")  # trimmed to its rows: copied
    with open_run(tmp_path / "a.h5") as run:
        np.testing.assert_array_equal(run.time, times)
        for path, value in known_arrays(times).items():
            np.testing.assert_array_equal(run[path], value)
        assert len(run.file["q"]) == 29


@pytest.mark.parametrize("there", [0, 100])
def test_room_is_reserved_in_several_calls_to_the_last_byte(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, there: int
):
    monkeypatch.setattr(layout, "RESERVED_BYTES", 1000)
    (tmp_path / "a").write_bytes(b"x" * there)
    layout.reserve(tmp_path / "a", 2500)
    content = (tmp_path / "a").read_bytes()
    assert content == b"x" * there + b"\0" * (2500 - there)


def test_where_room_cannot_be_reserved_it_is_compared_with_what_is_free(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.delattr(layout.os, "posix_fallocate", raising=False)
    layout.reserve(tmp_path / "a", 1000)
    with pytest.raises(OSError, match="no space left on device; 1000000000000000000 bytes are needed") as caught:
        layout.reserve(tmp_path / "a", 10**18)
    assert caught.value.errno == 28


def test_the_versions_of_all_libraries_are_kept(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """One that is not installed is left out, and those after it are not."""
    monkeypatch.setattr(copying, "LIBRARIES", ("numpy", "no-such-library", "scipy", "h5py", "numba"))
    with RunWriter(tmp_path / "a.h5", CHANNELS, known_bodies(), {"title": "", "case_text": ""}) as writer:
        writer.write_block(np.zeros(1), known_arrays(np.zeros(1)))
        writer.finish(True, "reached the end")
    with open_run(tmp_path / "a.h5") as run:
        found = run.versions
    assert {*found} == {"femflex", "python", "hdf5", "numpy", "scipy", "h5py", "numba"}
    assert all(found[name] == version(name) for name in ("numpy", "scipy", "h5py", "numba"))


def test_threads_other_than_the_first_hold_no_interrupt_back():
    from threading import Thread

    done = []

    def work() -> None:
        with without_interrupts():  # signals are set in the main thread alone
            done.append(1)

    thread = Thread(target=work)
    thread.start()
    thread.join()
    assert done == [1]
