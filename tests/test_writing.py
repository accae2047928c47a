"""Outputs: only regular files are replaced; pipes, sockets and links to nothing give an error naming them."""

from __future__ import annotations

import os
import socket
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from support.known_run import write_known_run

from femflex import rigid_body
from femflex.mesh import rectangle, write_mesh
from femflex.reduction import save_body
from femflex.results import RunWriter

WRITERS: dict[str, Callable[[Path], object]] = {
    "body": lambda path: save_body(path, rigid_body(1.0, np.eye(3)), force=True),
    "mesh": lambda path: write_mesh(path.with_suffix(".msh"), rectangle(1.0, 1.0, 2, 2)),
    "run": lambda path: RunWriter(path, {}, {}, force=True),
}


def pipe(path: Path) -> None:
    os.mkfifo(path)


def bound_socket(path: Path) -> None:
    with socket.socket(socket.AF_UNIX) as opened:
        opened.bind(str(path))


def dangling_link(path: Path) -> None:
    path.symlink_to("nothing")


@pytest.mark.parametrize("write", WRITERS.values(), ids=WRITERS)
@pytest.mark.parametrize(("make", "word"), [(pipe, "pipe"), (bound_socket, "socket"), (dangling_link, "link to")])
def test_other_than_regular_files_are_refused(make, word, write, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)  # names of sockets are short
    for name in ("out", "out.msh"):
        make(Path(name))

    def state() -> list[tuple[int, int, int]]:
        return [(s.st_mode, s.st_ino, s.st_mtime_ns) for s in (path.lstat() for path in sorted(tmp_path.iterdir()))]

    before = state()
    with pytest.raises(OSError, match=word):
        write(Path("out"))
    assert state() == before


def test_link_stays_and_the_file_behind_it_is_replaced(tmp_path):
    (tmp_path / "kept").mkdir()
    target, link = tmp_path / "kept" / "body.h5", tmp_path / "link.h5"
    link.symlink_to(target)
    for write in (WRITERS["body"], write_known_run):
        target.unlink(missing_ok=True)
        target.write_text("old")
        write(link)
        assert link.is_symlink() and target.stat().st_size > 1000 and len(list(tmp_path.rglob("*"))) == 3


def test_folder_is_named_as_such():
    with pytest.raises(IsADirectoryError, match="folder"):
        RunWriter(".", {}, {})
