"""Flexible bodies for other multibody programs: SID, MBDyn's modal data, Exudyn's reduced bodies."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from femflex.body import FlexibleBody
from femflex.export.multibody.exudyn import write_exudyn
from femflex.export.multibody.mbdyn import read_mbdyn, write_mbdyn
from femflex.export.multibody.sid import read_sid, write_sid

__all__ = ["WRITERS", "body_writer", "read_mbdyn", "read_sid", "write_exudyn", "write_mbdyn", "write_sid"]

BodyWriter = Callable[[FlexibleBody, str | Path, str, bool], list[str]]  # body, path, name, force -> lines
WRITERS: dict[str, BodyWriter] = {  # ends of the names of files
    ".sid_fem": write_sid,
    ".sid": write_sid,
    ".fem": write_mbdyn,
    ".exudyn.npz": write_exudyn,
}


def body_writer(path: str | Path) -> BodyWriter | None:
    """The writer of a file by the end of its name, or None for another file."""
    name = Path(path).name.lower()
    return next((writer for end, writer in WRITERS.items() if name.endswith(end)), None)
