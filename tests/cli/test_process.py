"""The command line as a process of its own: start-up, interruption, broken pipe, exit codes."""

from __future__ import annotations

import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
import typer

from femflex.cli.progress import Bar, Patience
from femflex.cli.verb import verb

COMMAND = [sys.executable, "-m", "femflex"]
HEAVY = {"numpy", "scipy", "numba", "h5py", "meshio", "skfem", "pyvista", "vtkmodules", "matplotlib"}
PACKAGE = Path(__file__).parents[2]

CALLBACK = """
import ctypes, sys, time
from pathlib import Path
from femflex.cli.interrupt import answer_at_once
answer_at_once()
part = Path(sys.argv[1]); part.write_text("half"); from femflex import writing; writing.PARTS.add(part)
callback = ctypes.CFUNCTYPE(None)(lambda: (print('ready', flush=True), time.sleep(20)))
callback(); print("went on")
"""


@pytest.mark.skipif(sys.platform == "win32", reason="needs a limit of address space")
def test_limit_of_memory_below_that_of_the_libraries_ends_at_once():
    limited = ["sh", "-c", 'ulimit -v 300000; exec "$@"', "sh", *COMMAND, "check", "x.toml"]
    done = subprocess.run(limited, capture_output=True, text=True, timeout=60)
    assert done.returncode == 3 and all(word in done.stderr for word in ("ulimit -v", "307 MB", "1200 MB"))


def test_help_imports_no_heavy_library():
    done = subprocess.run(
        [sys.executable, "-X", "importtime", *COMMAND[1:], "--help"], capture_output=True, text=True, check=True
    )
    imported = {row.rsplit("|", 1)[-1].strip().split(".")[0] for row in done.stderr.splitlines()}
    assert "Simulate a case" in done.stdout and "typer" in imported and not HEAVY & imported


def test_broken_pipe_ends_verb_without_error():
    with subprocess.Popen([*COMMAND, "schema"], stdout=subprocess.PIPE, stderr=subprocess.PIPE) as piped:
        assert piped.stdout is not None and piped.stderr is not None
        piped.stdout.readline()
        piped.stdout.close()
        assert piped.stderr.read() == b"" and piped.wait(30) == 0


@pytest.mark.skipif(sys.platform == "win32", reason="needs SIGINT")
def test_interrupt_ends_process_with_130(tmp_path: Path):
    """Within a callback that drops exceptions: the unfinished file is removed."""
    command = [sys.executable, "-c", CALLBACK, str(tmp_path / "x.part")]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None and process.stderr is not None
        assert process.stdout.readline() == "ready\n", process.stderr.read()
        process.send_signal(signal.SIGINT)
        out, err = process.communicate(timeout=10)  # not the 20 s of the call
    assert (process.returncode, out) == (130, "") and err.count("\n") == 1
    assert not list(tmp_path.iterdir())


def test_missing_working_folder_is_reported(tmp_path: Path):
    gone = tmp_path / "gone"
    gone.mkdir()
    code = f"import os, shutil, sys\nos.chdir({str(gone)!r})\nshutil.rmtree({str(gone)!r})\n"
    code += f"sys.path.insert(0, {str(PACKAGE)!r})\nfrom femflex.cli import main\nmain()"
    done = subprocess.run([sys.executable, "-c", code, "check", "x.toml"], cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 2 and done.stdout == "" and done.stderr.count("\n") == 1


@pytest.mark.parametrize(
    ("error", "code"),
    [(None, 0), (TypeError("x"), 1), (RecursionError("x"), 1), (np.linalg.LinAlgError("x"), 3), (MemoryError(), 3)],
    ids=repr,
)
def test_exit_code_is_that_of_the_cause(error, code, capsys, monkeypatch):
    @verb("none")
    def command() -> None:
        if error is not None:
            raise error

    if error is None:
        assert command() is None
        return
    with pytest.raises(typer.Exit) as end:
        command()
    err = capsys.readouterr().err
    assert end.value.exit_code == code and err and "Traceback" not in err
    monkeypatch.setenv("FEMFLEX_TRACEBACK", "1")
    with pytest.raises(type(error)):
        command()


@pytest.mark.parametrize(("terminal", "shown"), [(True, True), (False, False)])
def test_progress_is_shown_on_a_terminal_alone(terminal, shown, monkeypatch, capsys):
    """The clock runs ahead by 3 s at every reading: progress appears after 2 s."""
    clock = iter(np.arange(0.0, 3e3, 3.0))
    monkeypatch.setattr(time, "perf_counter", lambda: next(clock))
    monkeypatch.setattr(sys.stderr, "isatty", lambda: terminal, raising=False)
    with Bar("integrating", 20.0) as bar:
        bar(5.0)
    assert ("integrating" in capsys.readouterr().err) == shown


def test_progress_is_not_shown_before_two_seconds(monkeypatch, capsys):
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True, raising=False)
    with Bar("integrating", 20.0) as bar, Patience("reading") as patience:
        bar(5.0)
        patience("compiling")
    assert capsys.readouterr().err == ""
