"""VTK's readers in a separate process, which is kept for the next file and restarted if a damaged file ends it."""

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

MEMORY_PER_BYTE = 200.0  # bytes of memory allowed per byte of a compressed file
STOP_TIMEOUT = 5.0  # s to wait for the process to end

_lock = threading.Lock()
_running: list[subprocess.Popen[bytes]] = []


def read_leaves(kind: str, path: Path) -> list[dict[str, Any]]:
    """The data sets of a file, as read by `vtk_worker`; kind: vtu, vtk, exodus, xdmf or ansys.

    Raises VtkError if VTK cannot read the file or ends on it, and ValueError for unsupported elements.
    """
    memory = min(free_memory(), MARGIN + MEMORY_PER_BYTE * path.stat().st_size, 2.0**60)
    with _lock:
        process = _running_process()
        assert process.stdin is not None and process.stdout is not None
        try:
            pickle.dump((kind, str(path.resolve()), memory), process.stdin)
            process.stdin.flush()
            answer = pickle.load(process.stdout)
        except (EOFError, OSError, pickle.UnpicklingError):
            _stop_process()
            raise VtkError("the reader of VTK ended on it") from None
    if isinstance(answer, str):
        if match := re.search(r"Unsupported element type: (\w+)", answer):
            raise ValueError(f"{path.name} has elements of type {match[1]}, which VTK does not read; write it without.")
        raise VtkError(answer)
    return list(answer)


class VtkError(Exception):
    """Error of VTK's readers, with VTK's own text."""


def _running_process() -> subprocess.Popen[bytes]:
    if _running and _running[0].poll() is not None:
        _stop_process()
    if not _running:
        script = Path(__file__).with_name("vtk_worker.py")
        _running.append(
            subprocess.Popen(
                [sys.executable, "-P", str(script)],  # -P: do not import from its folder, which has numbers.py
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=subprocess.DEVNULL,
                start_new_session=True,  # keyboard interrupts reach only the main program
            )
        )
    return _running[0]


def _stop_process() -> None:
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
            process.wait(STOP_TIMEOUT)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()


atexit.register(_stop_process)
