"""VTK's readers in a process of their own, kept for the next file: one that a damaged file ends is started again."""

from __future__ import annotations

import atexit
import pickle
import re
import subprocess
import sys
import threading
from pathlib import Path
from typing import Any

from femflex.memory import MARGIN, free_memory

MEMORY = 200.0  # bytes of memory that a byte of a compressed file may take
STOP = 5.0  # s that the process is given to end by itself

_lock = threading.Lock()
_running: list[subprocess.Popen[bytes]] = []


def read_leaves(kind: str, path: Path) -> list[dict[str, Any]]:
    """The data sets of a file, as `vtk_worker` finds them; kind: vtu, vtk, exodus, xdmf or ansys.

    Raises ValueError where VTK cannot read the file, or ends on it.
    """
    memory = min(free_memory(), MARGIN + MEMORY * path.stat().st_size, 2.0**60)
    with _lock:
        process = _started()
        assert process.stdin is not None and process.stdout is not None
        try:
            pickle.dump((kind, str(path.resolve()), memory), process.stdin)
            process.stdin.flush()
            answer = pickle.load(process.stdout)
        except (EOFError, OSError, pickle.UnpicklingError):
            _stop()
            raise VtkError("the reader of VTK ended on it") from None
    if isinstance(answer, str):
        if found := re.search(r"Unsupported element type: (\w+)", answer):
            raise ValueError(f"{path.name} has elements of type {found[1]}, which VTK does not read; write it without.")
        raise VtkError(answer)
    return list(answer)


class VtkError(Exception):
    """What VTK says of a file, in words of its own."""


def _started() -> subprocess.Popen[bytes]:
    if _running and _running[0].poll() is not None:
        _stop()
    if not _running:
        script = Path(__file__).with_name("vtk_worker.py")
        _running.append(
            subprocess.Popen(
                [sys.executable, "-P", str(script)],  # -P: its folder, which has numbers.py, is no place of modules
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=subprocess.DEVNULL,
                start_new_session=True,  # an interrupt from the keyboard is for the program
            )
        )
    return _running[0]


def _stop() -> None:
    """End the process, if there is one."""
    while _running:
        process = _running.pop()
        for pipe in (process.stdin, process.stdout):
            try:
                if pipe is not None:
                    pipe.close()
            except OSError:
                pass
        try:
            process.wait(STOP)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()


atexit.register(_stop)
