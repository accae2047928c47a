"""Ctrl-C answered within half a second, whatever is being done."""

from __future__ import annotations

import os
import signal
import socket
import sys
import threading
import time
from types import FrameType
from typing import NoReturn

INTERRUPTED = 130
GRACE = 0.3  # seconds; Python's own handler waits for the end of a call into a library
_unwinding = threading.Event()  # set while the work in progress is being ended
_continuation: list[str] = []
SHOW_CURSOR = "\x1b[?25h"  # a progress bar hides it


def answer_at_once() -> None:
    """Let Ctrl-C end the process: well, where something has been begun that can be kept; else at once.

    An exception would have to find its way through libraries that may drop it (a compiler's callbacks) or not survive
    it (a renderer), and while such a library works Python does not even look for signals; so a thread waits for them
    as well.
    """
    signal.signal(signal.SIGINT, _on_interrupt)
    reader, writer = socket.socketpair()
    writer.setblocking(False)
    signal.set_wakeup_fd(writer.fileno(), warn_on_full_buffer=False)
    threading.Thread(target=_wait_for_interrupt, args=(reader, writer), daemon=True).start()


def leave() -> NoReturn:
    """End the process as interrupted, without the tenth of a second that unloading compiled code takes."""
    writing = sys.modules.get("femflex.writing")
    if writing is not None:
        for draft in list(writing.PARTS):
            writing.remove_part(draft)
    workers = sys.modules.get("femflex.worker_processes")
    if workers is not None:
        workers.end_worker_server()
    if sys.stderr.isatty():
        sys.stderr.write(SHOW_CURSOR)
    for stream in (sys.stdout, sys.stderr):
        try:
            stream.flush()
        except OSError:  # its reader has left
            pass
    os._exit(INTERRUPTED)


def _has_work_to_finish() -> bool:
    keeping = sys.modules.get("femflex.results.interrupts")
    return keeping is not None and keeping.has_work_to_finish()


def _on_interrupt(_: int, __: FrameType | None) -> None:
    if _has_work_to_finish():
        _unwinding.set()
        raise KeyboardInterrupt
    _report_and_leave()


def _wait_for_interrupt(reader: socket.socket, _writer: socket.socket) -> None:
    while reader.recv(1) != bytes([signal.SIGINT]):
        pass
    time.sleep(GRACE)
    if not _has_work_to_finish() and not _unwinding.is_set():
        _report_and_leave()


def name_continuation(command: str) -> None:
    """Set the command that goes on with the work in progress, which the message of an interrupt names; "" for none."""
    _continuation[:] = [command] if command else []


def _report_and_leave() -> NoReturn:
    print("femflex: interrupted" + "".join(f"; {command} goes on" for command in _continuation), file=sys.stderr)
    leave()
