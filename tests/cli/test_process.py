"""The command line as a process of its own: start-up, interruption, resuming."""

from __future__ import annotations

import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import h5py
import numpy as np
import pytest

COMMAND = [sys.executable, "-m", "femflex"]
HEAVY = {"numpy", "scipy", "numba", "h5py", "meshio", "skfem", "pyvista", "vtkmodules", "matplotlib"}


def test_help_appears_at_once():
    """Help imports no library that takes long to import, which is what its time depends on."""
    done = subprocess.run(
        [sys.executable, "-X", "importtime", *COMMAND[1:], "--help"], capture_output=True, text=True, check=True
    )
    imported = {row.rsplit("|", 1)[-1].strip().split(".")[0] for row in done.stderr.splitlines()}
    assert "Simulate a case" in done.stdout
    assert "typer" in imported and not HEAVY & imported


def test_a_reader_that_leaves_early_is_no_error():
    with subprocess.Popen([*COMMAND, "schema"], stdout=subprocess.PIPE, stderr=subprocess.PIPE) as piped:
        assert piped.stdout is not None and piped.stderr is not None
        piped.stdout.readline()
        piped.stdout.close()
        assert piped.stderr.read() == b"" and piped.wait(30) == 0


def _interrupted_run(case: Path, output: Path) -> tuple[int, float, str]:
    """Interrupt a run once its file is there; exit code, seconds it took to stop, standard error."""
    process = subprocess.Popen(
        [*COMMAND, "run", str(case), "-o", str(output)], stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True
    )
    while not output.exists() and process.poll() is None:
        time.sleep(0.02)
    time.sleep(0.3)
    sent = time.perf_counter()
    process.send_signal(signal.SIGINT)
    _, err = process.communicate(timeout=60)
    return process.returncode, time.perf_counter() - sent, err


@pytest.mark.slow
def test_an_interrupted_run_is_kept_and_resumes_bit_for_bit(
    craft: str, write_case: Callable[..., Path], tmp_path: Path
):
    long = craft.replace('duration = "10 s"', 'duration = "40 s"').replace(
        "output_step = 0.05", "output_step = 0.005\nmax_step = 0.0005"
    )
    case = write_case(long)
    code, seconds, err = _interrupted_run(case, tmp_path / "run.h5")
    assert code == 130
    with h5py.File(tmp_path / "run.h5") as file:
        assert not file.attrs["complete"] and file.attrs["ended"] == b"interrupted"
        rows = int(file["progress"][0])
        assert err.startswith(f"femflex: interrupted; {tmp_path / 'run.h5'} keeps {rows} rows, to ")
        assert err.endswith(" s, and --resume goes on from there\n")
        assert 0 < rows < 8001 and np.isfinite(file["q"][:rows]).all()
    subprocess.run(
        [*COMMAND, "run", str(case), "-o", str(tmp_path / "run.h5"), "--resume"], check=True, capture_output=True
    )
    begin = time.perf_counter()
    subprocess.run([*COMMAND, "run", str(case), "-o", str(tmp_path / "whole.h5")], check=True, capture_output=True)
    assert seconds < 0.5 * (time.perf_counter() - begin)
    with h5py.File(tmp_path / "run.h5") as resumed, h5py.File(tmp_path / "whole.h5") as whole:
        assert resumed.attrs["complete"] and len(resumed["time"]) == 8001
        for path in ("time", "q", "u", "markers/boom.tip/position", "monitors/energy"):
            np.testing.assert_array_equal(resumed[path][()], whole[path][()])
