"""Names and sizes of the result file, its data sets over time with the space reserved for them, and its outline."""

from __future__ import annotations

import os
import re
import shutil
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import h5py
import numpy as np

from femflex.system.channel import Channel

if TYPE_CHECKING:
    from femflex.results.reader import Run

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


def outline(run: Run) -> str:
    """Contents of a run, one channel a line: shape, unit and names."""
    state = "complete" if run.complete else f"incomplete ({run.ended})" if run.ended else "incomplete"
    span = f"{len(run)} instants, {run.time[0]:g} to {run.time[-1]:g} s" if len(run) else "no instants"
    lines = [f"{run.path.name}: {run.title}" if run.title else run.path.name, f"{state}, {span}"]
    lines += [f"without {', '.join(run.without)}"] if run.without else []
    return "\n".join([*lines, *channel_lines(run.channels, len(run))])


def channel_lines(channels: Mapping[str, Channel], n_t: int | None = None) -> list[str]:
    """Channels by path as a tree, one a line: shape, unit and names; n_t: number of instants, where it is known.

    >>> channel_lines({"joints/hinge/angle": Channel("rad", "angle of turn")})
    ['joints', '  hinge', '    angle  n [rad]']
    """
    lines, group = [], list[str]()
    for path, channel in channels.items():
        if 0 in channel.shape:  # amplitudes of a rigid body
            continue
        *folders, leaf = path.split("/")
        shared = 0
        while shared < min(len(folders), len(group)) and folders[shared] == group[shared]:
            shared += 1
        lines += ["  " * depth + folders[depth] for depth in range(shared, len(folders))]
        group = folders
        shape = " x ".join(map(str, ("n" if n_t is None else n_t, *channel.shape)))
        names = f"  ({names_text(channel.names)})" if channel.names else ""
        unit = f" [{channel.unit}]" if channel.unit and len(channel.unit) <= 24 else ""
        lines.append(f"{'  ' * len(folders)}{leaf}  {shape}{unit}{names}")
    return lines


def names_text(names: Sequence[str]) -> str:
    """Names in one line; of three or more that are numbered in sequence, such as amplitudes of a body, only the ends.

    >>> names_text(["hinge.angle", "boom.delta1", "boom.delta2", "boom.delta3"])
    'hinge.angle, boom.delta1 to boom.delta3'
    """
    runs: list[list[str]] = []
    for name in names:
        if runs and name == re.sub(r"\d+(?=\D*$)", lambda match: str(int(match[0]) + 1), runs[-1][-1]) != runs[-1][-1]:
            runs[-1].append(name)
        else:
            runs.append([name])
    return ", ".join(f"{run[0]} to {run[-1]}" if len(run) > 2 else ", ".join(run) for run in runs)
