"""VTK's readers in a separate process, which is kept for the next file and restarted if a damaged file ends it.

Each of them, and that of mapdl-archive, ends its process on 1 to 2 % of damaged files (bits turned over, pieces taken
out), and what they trip over cannot be checked before without parsing the file. In a process that has loaded h5py, VTK
also ends on sound XDMF files with data in HDF5: both bring their own HDF5. All other readers run in this process.
"""

from __future__ import annotations

import atexit
import pickle
import re
import subprocess
import sys
import threading
from contextlib import suppress
from pathlib import Path
from typing import Any

from femflex.extras import require
from femflex.memory import MARGIN, free_memory

MEMORY_PER_BYTE = 200.0  # bytes of memory allowed per byte of a compressed file

_lock = threading.Lock()
_running: list[subprocess.Popen[bytes]] = []


class VtkError(Exception):
    """Error of VTK's readers, with VTK's own text."""


def read_leaves(kind: str, path: Path) -> list[dict[str, Any]]:
    """The data sets of a file, as read by `vtk_worker`; kind: vtu, vtk, exodus, xdmf or ansys.

    Raises VtkError if VTK cannot read the file or ends on it, and ValueError for unsupported elements.
    """
    if kind != "ansys":
        require("view", f"{path.name} and other meshes that VTK reads")
    memory = min(free_memory(), MARGIN + MEMORY_PER_BYTE * path.stat().st_size, 2.0**60)
    with _lock:
        process = _running[0] if _running else _started_process()
        assert process.stdin is not None and process.stdout is not None
        try:
            pickle.dump((kind, str(path.resolve()), memory), process.stdin)
            process.stdin.flush()
            answer = pickle.load(process.stdout)
        except (EOFError, OSError, pickle.UnpicklingError):
            _end_process()
            raise VtkError("the reader of VTK ended on it") from None
    if isinstance(answer, str):
        if match := re.search(r"Unsupported element type: (\w+)", answer):
            raise ValueError(f"{path.name} has elements of type {match[1]}, which VTK does not read; write it without.")
        raise VtkError(answer)
    return list(answer)


def _started_process() -> subprocess.Popen[bytes]:
    # -P: do not import from its folder; a session of its own: keyboard interrupts reach only the main program
    command = [sys.executable, "-P", str(Path(__file__).with_name("vtk_worker.py"))]
    pipe, null = subprocess.PIPE, subprocess.DEVNULL
    _running.append(subprocess.Popen(command, stdin=pipe, stdout=pipe, stderr=null, start_new_session=True))
    return _running[0]


@atexit.register
def _end_process() -> None:
    """End the process, if there is one."""
    while _running:
        with suppress(OSError), _running.pop() as process:  # closes the pipes, and waits
            process.kill()
