"""A whole result file: its skeleton in memory, copies with other room and attributes, and the integrator's state."""

from __future__ import annotations

import os
import platform
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any
from uuid import uuid4

import h5py
import numpy as np
from numpy.typing import NDArray

import femflex
from femflex.body import FlexibleBody
from femflex.results.layout import FILLED_BYTES, FORMAT, LAYOUT, SLACK_BYTES, TIME, create_channel, reserve, row_bytes
from femflex.results.reader import write_bodies
from femflex.system.channel import Channel

AnyArray = NDArray[Any]
ALONE = "state"  # name of a state that is one array


@dataclass(frozen=True, eq=False)
class ResumePoint:
    """Point from which a run can continue: rows written, time of the last [s], and the integrator's state."""

    rows: int
    time: float
    state: Any


def resume_point(path: str | Path) -> ResumePoint:
    """The point at which the run in that file stopped.

    Raises ValueError when the file holds no state from which to continue.
    """
    from femflex.results.reader import open_run

    with open_run(path) as run:
        rows, slot = (int(k) for k in run.file["progress"][()])
        if rows == 0 or slot < 0:
            raise ValueError(f"{path} holds no state of the integrator to go on from; start the run anew")
        state = _nested_dict(run.file[f"resume/{slot}"])
        return ResumePoint(rows, float(run.time[-1]), state[ALONE] if run.file["resume"].attrs["alone"] else state)


def flattened(state: Any, prefix: str = "") -> dict[str, AnyArray]:
    """The arrays of a state (an array, or nested dicts of arrays and numbers) by path.

    Raises ValueError for anything that is neither a number nor an array of numbers.
    """
    if isinstance(state, Mapping):
        branches = [flattened(value, f"{prefix}{key}/") for key, value in state.items()]
        return {path: value for branch in branches for path, value in branch.items()}
    value = np.asarray(state)
    path = prefix.rstrip("/") or ALONE
    if value.dtype.kind not in "biuf":
        raise ValueError(f"entry {path!r} of the integrator's state is {state!r}; only numbers can be kept")
    return {path: value}


def lay_slots(file: h5py.File, state: dict[str, AnyArray], alone: bool, used_slot: int) -> None:
    """Lay out slots for states of these shapes and types, except slot `used_slot` (-1: none)."""
    group = file.require_group("resume")
    group.attrs["alone"] = alone
    for slot in {0, 1} - {used_slot}:
        if str(slot) in group:
            del group[str(slot)]
        slot_group = group.create_group(str(slot))
        for path, value in state.items():
            slot_group.create_dataset(path, data=np.zeros_like(value))


def fits(file: h5py.File, state: dict[str, AnyArray], slot: int) -> bool:
    """Whether a state has the shapes and types that the slot was laid out for."""
    if f"resume/{slot}" not in file:
        return False
    laid_out: dict[str, tuple[Any, ...]] = {}
    file[f"resume/{slot}"].visititems(
        lambda path, item: laid_out.update({path: (item.shape, item.dtype)}) if isinstance(item, h5py.Dataset) else None
    )
    return laid_out == {path: (value.shape, value.dtype) for path, value in state.items()}


def write_slot(file: h5py.File, state: dict[str, AnyArray], slot: int) -> None:
    """Write a state that fits into the slot."""
    for path, value in state.items():
        file[f"resume/{slot}/{path}"][...] = value


def _nested_dict(group: h5py.Group) -> dict[str, Any]:
    return {name: _nested_dict(item) if isinstance(item, h5py.Group) else item[()] for name, item in group.items()}


LIBRARIES = ("numpy", "scipy", "numba", "h5py", "scikit-fem", "meshio")
COPY_BYTES = 2**23
ROOM_BYTES = 1536  # reserved for the integrator's counts
ENDED = h5py.string_dtype("utf-8", 1024)  # of fixed length, so that it is written in place


@dataclass(frozen=True, eq=False)
class Changes:
    """Differences of a copy from its source.

    capacity    rows to lay out
    attributes  of the root;  statistics  of the integrator
    slots       None, or the integrator's state to lay out room for, by path
    alone       whether that state is one array
    """

    capacity: int
    attributes: Mapping[str, Any] = field(default_factory=dict)
    statistics: Mapping[str, Any] = field(default_factory=dict)
    slots: dict[str, NDArray[Any]] | None = None
    alone: bool = False


def skeleton(channels: dict[str, Channel], bodies: dict[str, FlexibleBody], attributes: Mapping[str, Any]) -> h5py.File:
    """A file in memory with everything except rows."""
    file = h5py.File(f"skeleton-{uuid4().hex}", "w", driver="core", backing_store=False)
    basic = {"format": FORMAT, "layout": LAYOUT, "femflex_version": femflex.__version__, "title": "", "case_text": ""}
    set_attributes(file, {**basic, **attributes, "complete": False, "ended": ""})
    set_attributes(file.create_group("versions"), _versions())
    file.create_group("statistics")
    file.create_dataset("progress", data=np.array([0, -1], np.int64))
    write_bodies(file.create_group("model"), bodies)
    for path, channel in {"time": TIME, **channels}.items():
        create_channel(file, path, channel, 0)
    return file


def write_copy(source: h5py.File, part: Path, channels: dict[str, Channel], rows: int, changes: Changes) -> None:
    """Write the file `part`, on the disk when this returns: the source's valid rows, with the changes.

    The copy proceeds in short steps, so that Ctrl-C is served after each.
    """
    size = changes.capacity * row_bytes({"time": TIME, **channels})
    part.unlink(missing_ok=True)
    reserve(part, size + SLACK_BYTES * (1 + len(channels) // 64) + _fixed_bytes(source, changes))
    with h5py.File(part, "w", locking=False) as target, open(part, "rb+") as handle:
        _copy_fixed(source, target, changes)
        target.create_dataset("progress", data=np.array([rows, source["progress"][1]], np.int64))
        for path, channel in {"time": TIME, **channels}.items():
            filled = size <= FILLED_BYTES or path == "time"
            data = create_channel(target, path, channel, changes.capacity, filled)
            for _ in _copied_rows(source[path], data, rows):
                target.flush()
                os.fsync(handle.fileno())
    reserve(part, part.stat().st_size)  # rows that were not filled take no space on the disk until now
    if rows:
        with open(part, "rb+") as handle:
            os.fsync(handle.fileno())


def conclude(file: h5py.File, attributes: Mapping[str, Any], statistics: Mapping[str, Any]) -> None:
    """Write how the run ended, in place; `complete`, if among the attributes, after all else is in the file.

    Space is reserved for it, so the file is consistent at every moment and keeps its length.
    """
    set_attributes(file["statistics"], statistics)
    set_attributes(file, {key: value for key, value in attributes.items() if key != "complete"})
    file.flush()
    set_attributes(file, {key: value for key, value in attributes.items() if key == "complete"})
    file.flush()


def set_attributes(item: h5py.Group, values: Mapping[str, Any]) -> None:
    """Set attributes. Raises ValueError for values other than text, numbers and arrays of numbers."""
    for key, value in values.items():
        if key == "ended":
            _set_ended(item, value)
            continue
        if not isinstance(value, str) and np.asarray(value).dtype.kind not in "biuf":
            raise ValueError(f"attribute {key!r} is {value!r}; a result file keeps text, numbers and arrays of numbers")
        item.attrs[key] = value


def _set_ended(file: h5py.File, text: str | bytes) -> None:
    words = text.encode()[: ENDED.itemsize].decode(errors="ignore").encode() if isinstance(text, str) else text
    if "ended" in file.attrs and file.attrs.get_id("ended").dtype == ENDED:
        file.attrs.modify("ended", words)
    else:
        file.attrs.create("ended", words, dtype=ENDED)


def _copy_fixed(source: h5py.File, target: h5py.File, changes: Changes) -> None:
    for name in ("model", "statistics", "versions", "resume"):
        if name in source:
            source.copy(name, target)
    set_attributes(target, {**source.attrs, **changes.attributes})
    set_attributes(target["statistics"], changes.statistics)
    _reserve_statistics(target["statistics"])
    if changes.slots is not None:
        lay_slots(target, changes.slots, changes.alone, used_slot=int(source["progress"][1]))


def _reserve_statistics(statistics: h5py.Group) -> None:
    """Reserve space for later counts, so that writing them does not lengthen the file (`conclude`)."""
    statistics.attrs["room"] = np.zeros(ROOM_BYTES // 8)
    statistics.attrs["description"] = "as the integrator counted"  # after it, because HDF5 gives back space at the end
    del statistics.attrs["room"]


def _copied_rows(source: h5py.Dataset, target: h5py.Dataset, rows: int) -> Iterator[int]:
    step = max(1, COPY_BYTES // (8 * max(1, int(np.prod(target.shape[1:])))))
    for k in range(0, rows, step):
        target[k : min(k + step, rows)] = source[k : min(k + step, rows)]
        yield k


def _fixed_bytes(file: h5py.File, changes: Changes) -> int:
    """Bytes of the model, the slots and the texts, which are in every copy."""
    sizes = [len(value) for value in file.attrs.values() if isinstance(value, str)]
    sizes += [2 * (value.nbytes + 1024) for value in (changes.slots or {}).values()]
    for name in ("model", "resume"):
        if name in file:
            file[name].visititems(lambda _, item: sizes.append(1024 + getattr(item, "nbytes", 0)))
    return sum(sizes)


def _versions() -> dict[str, str]:
    versions = {"python": platform.python_version(), "hdf5": h5py.version.hdf5_version}
    for name in LIBRARIES:
        try:
            versions[name] = version(name)
        except PackageNotFoundError:
            continue
    return versions
