"""Ctrl-C ends a process whatever it is doing, and keeps what has been begun."""

from __future__ import annotations

import signal
import subprocess
import sys
from pathlib import Path

import pytest

BEGIN = """
import ctypes, sys, time
from pathlib import Path
from femflex.cli.interrupt import answer_at_once
answer_at_once()
"""
LONG_CALL = "print('ready', flush=True); ctypes.CDLL(None).sleep(20)"
DROPPED = """
part = Path(sys.argv[1]); part.write_text("half"); from femflex.results import interrupts; interrupts.PARTS.add(part)
callback = ctypes.CFUNCTYPE(None)(lambda: (print('ready', flush=True), time.sleep(20)))
callback(); print("went on")
"""
KEPT = """
from femflex.results.interrupts import finished_on_interrupt
try:
    with finished_on_interrupt("a movie"):
        print('ready', flush=True); time.sleep(20)
except KeyboardInterrupt:
    time.sleep(0.6); print("ended well"); sys.exit(130)
"""


@pytest.mark.skipif(sys.platform == "win32", reason="needs SIGINT")
@pytest.mark.parametrize(
    ("doing", "said"),
    [(LONG_CALL, ""), (DROPPED, ""), (KEPT, "ended well\n")],
    ids=["a long call", "a callback that drops exceptions", "something to keep"],
)
def test_an_interrupt_ends_the_process(tmp_path: Path, doing: str, said: str):
    command = [sys.executable, "-c", BEGIN + doing, str(tmp_path / "x.part")]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None and process.stderr is not None
        assert process.stdout.readline() == "ready\n", process.stderr.read()
        process.send_signal(signal.SIGINT)
        out, err = process.communicate(timeout=10)  # not the 20 s of the call
    assert (process.returncode, out) == (130, said)
    assert err == ("" if said else "femflex: interrupted\n")
    assert not list(tmp_path.iterdir())
