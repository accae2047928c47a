"""Channels added to an existing result file."""

from __future__ import annotations

import shutil
from collections.abc import Mapping
from contextlib import nullcontext
from pathlib import Path

import h5py

from femflex.arrays import Array
from femflex.results.layout import create_channel, reserve
from femflex.results.lock import FileLock
from femflex.results.reader import open_run
from femflex.system.channel import Channel
from femflex.writing import atomic_file

LAYOUT_BYTES = 20_000  # of a channel, in addition to its values


def add_channels(path: str | Path, channels: Mapping[str, tuple[Channel, Array]], lock: FileLock | None = None) -> None:
    """Add channels with their values (n_t, *shape), one row per instant of the run, or replace those of these names.

    They are written into a copy that is moved into place. lock: of the file, if the caller holds it already.
    Raises ValueError when the rows are not those of the run, BlockingIOError when a run is writing the file.
    """
    path = Path(path)
    with nullcontext() if lock is not None else FileLock(path):
        _add(path, channels)


def _add(path: Path, channels: Mapping[str, tuple[Channel, Array]]) -> None:
    with open_run(path) as run:
        count, room = len(run), len(run.file["time"])
    for name, (channel, values) in channels.items():
        if values.shape != (count, *channel.shape):
            raise ValueError(f"channel {name!r} has shape {values.shape}; this run needs {(count, *channel.shape)}")
    room_for_values = sum(8 * room * max(values[0].size, 1) for _, values in channels.values() if len(values))
    with atomic_file(path, force=True) as copy:
        shutil.copyfile(path, copy)
        reserve(copy, path.stat().st_size + room_for_values + LAYOUT_BYTES * len(channels))
        with h5py.File(copy, "r+", locking=False) as file:
            for name, (channel, values) in channels.items():
                if name in file:
                    del file[name]
                create_channel(file, name, channel, room)[:count] = values
