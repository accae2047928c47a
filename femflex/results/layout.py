"""Names and sizes of the result file, and its data sets over time with the space reserved for them."""

from __future__ import annotations

import os
import shutil
from pathlib import Path

import h5py
import numpy as np

from femflex.system.channel import Channel

FORMAT = "femflex run"
LAYOUT = 1
CHUNK_ROWS = 1024  # rows of a block of output, so that a block fills whole chunks
CHUNK_BYTES = 2**20  # larger chunks miss HDF5's cache
SLACK_BYTES = 2**18  # object headers and B-trees, reserved with the data
FILLED_BYTES = 2**28  # room up to this size is filled with nan; in larger files only /time is
RESERVED_BYTES = 2**26  # taken from the disk in one call

TIME = Channel("s", "time")
_NOT_CHANNELS = ("model", "resume", "statistics", "versions", "progress")


def create_channel(file: h5py.File, path: str, channel: Channel, rows: int, filled: bool = True) -> h5py.Dataset:
    """A data set of that many rows, with its index and its space in the file allocated at once; `filled`: with nan."""
    row_bytes = 8 * max(1, int(np.prod(channel.shape)))
    chunk_rows = max(1, min(rows, CHUNK_ROWS, max(16, CHUNK_BYTES // row_bytes)))
    early = h5py.h5p.create(h5py.h5p.DATASET_CREATE)
    early.set_alloc_time(h5py.h5d.ALLOC_TIME_EARLY)
    early.set_fill_time(h5py.h5d.FILL_TIME_ALLOC if filled else h5py.h5d.FILL_TIME_NEVER)
    data = file.create_dataset(
        path,
        shape=(rows, *channel.shape),
        maxshape=(None, *(size or None for size in channel.shape)),
        chunks=(chunk_rows, *(max(1, size) for size in channel.shape)),
        dtype="f8",
        fillvalue=np.nan,
        dcpl=early,
    )
    data.attrs["unit"] = channel.unit
    data.attrs["description"] = channel.description
    data.attrs["frame"] = channel.frame
    data.attrs.create("names", np.array(channel.names, dtype=object), dtype=h5py.string_dtype())
    return data


def channel_of(data: h5py.Dataset) -> Channel:
    """The description of a data set over time, from its attributes."""
    names = tuple(str(name) for name in data.attrs["names"])
    return Channel(data.attrs["unit"], data.attrs["description"], tuple(data.shape[1:]), names, data.attrs["frame"])


def channels_of(file: h5py.Group) -> dict[str, h5py.Dataset]:
    """The data sets over time of a file by path, /time first."""
    channels = {"time": file["time"]}

    def add(path: str, item: h5py.HLObject) -> None:
        if isinstance(item, h5py.Dataset) and path.split("/")[0] not in _NOT_CHANNELS:
            channels[path] = item

    file.visititems(add)
    return channels


def row_bytes(channels: dict[str, Channel]) -> int:
    """Bytes of one instant of all channels together."""
    return sum(8 * int(np.prod(channel.shape)) for channel in channels.values())


def reserve(path: Path, size: int) -> None:
    """Allocate that many bytes for a file, so that a full disk raises OSError here and not inside the HDF5 library."""
    with open(path, "ab") as file:
        if hasattr(os, "posix_fallocate"):
            for start in range(0, size, RESERVED_BYTES):
                os.posix_fallocate(file.fileno(), start, min(RESERVED_BYTES, size - start))
        elif shutil.disk_usage(path.parent).free < size:
            raise OSError(28, f"no space left on device; {size} bytes are needed")
