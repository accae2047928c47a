"""RunWriter: the result file of a run, written block by block and consistent at every moment."""

from __future__ import annotations

import contextlib
import errno
import os
import re
import shutil
from collections.abc import Mapping
from contextlib import ExitStack, nullcontext
from pathlib import Path
from typing import Any, Self

import h5py
import numpy as np
from numpy.typing import NDArray

from femflex.arrays import Array
from femflex.body import FlexibleBody
from femflex.results.copying import Changes, conclude, fits, flattened, skeleton, write_copy, write_slot
from femflex.results.interrupts import finished_on_interrupt
from femflex.results.layout import channel_of, channels_of, create_channel, reserve
from femflex.results.reader import open_file, open_run
from femflex.system.channel import Channel
from femflex.writing import PARTS, atomic_file, check_destination, link_target, move_into_place, remove_part

try:
    import fcntl
except ImportError:  # Windows
    fcntl = None  # type: ignore[assignment]


class FileLock:
    """The right to write a result file, until it is released; a context manager.

    Raises BlockingIOError when another writer has it, in this process or in another one.
    """

    def __init__(self, path: str | Path) -> None:
        self._handle = -1
        self.path = Path(path)
        target = Path(os.path.realpath(self.path))
        self._lock_file = target.with_name(f".{target.name}.lock")
        while fcntl is not None and not self._try_lock():
            pass

    def _try_lock(self) -> bool:
        """Take the lock; return whether it is on the file that exists now, and not on one that was just deleted."""
        handle = os.open(self._lock_file, os.O_RDWR | os.O_CREAT, 0o666)
        try:
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            os.close(handle)
            raise BlockingIOError(
                f"{self.path} is being written by another run; wait until it ends, stop it, or choose another file"
            ) from None
        except OSError:  # a file system without locks
            os.close(handle)
            return True
        self._handle = handle
        try:
            current = os.stat(self._lock_file)
        except FileNotFoundError:
            current = None
        if current is not None and os.path.samestat(current, os.fstat(handle)):
            return True
        self._close()
        return False

    def release(self) -> None:
        """Release the lock; a second call does nothing."""
        if self._handle >= 0:
            with contextlib.suppress(OSError):
                self._lock_file.unlink()  # while it is locked: a writer that waits sees that the file is gone
            self._close()

    def _close(self) -> None:
        os.close(self._handle)
        self._handle = -1

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: object) -> None:
        self.release()

    def __del__(self) -> None:
        self.release()


FIRST_BLOCKS = 4  # blocks of space at first, where the number of rows is not known; doubled when it is full
LAYOUT_BYTES = 20_000  # of a channel, in addition to its values


class RunWriter:
    """Writer of a result file; `femflex.results` describes the layout, and what a killed run leaves.

    channels    path -> Channel of everything that `write_block` will receive; bodies for pictures
    attributes  of the root: title, case_text, integrator, ...: text, numbers or arrays of numbers
    lock        of the file, if the caller holds it already; it is released when the writer closes
    rows        total number of instants, when known: space for them is reserved at once, so that the file never grows;
                without it the file is copied into one of twice the size whenever it is full

    >>> with RunWriter(path, channels, bodies, {"title": "slew"}) as writer:  # doctest: +SKIP
    ...     writer.write_block(times, arrays, resume=state)
    ...     writer.finish(complete=True, ended="reached the end")

    Leaving the `with` block without `finish` keeps what was written, marked incomplete with the reason.
    """

    _file: h5py.File | None
    _data: dict[str, h5py.Dataset]

    def __init__(
        self,
        path: str | Path,
        channels: dict[str, Channel],
        bodies: dict[str, FlexibleBody],
        attributes: Mapping[str, Any] | None = None,
        *,
        rows: int = 0,
        force: bool = False,
        lock: FileLock | None = None,
    ) -> None:
        check_destination(Path(path), force)
        self._begin(Path(path), rows)
        self._lock = lock or FileLock(self.path)
        try:
            check_destination(self.path, force)  # again: another run may have ended meanwhile
            self._skeleton = skeleton(channels, bodies, attributes or {})
        except BaseException:
            self._lock.release()
            raise
        self._adopt(self._skeleton)

    def _begin(self, path: Path, rows: int) -> None:
        self.path, self._expected, self._not_finite = path, rows, ""
        self._part = link_target(path).parent / f"{link_target(path).name}.part"
        self._interrupt_context = ExitStack()

    @classmethod
    def resumed(cls, path: str | Path, rows: int = 0, lock: FileLock | None = None) -> Self:
        """A writer that appends to a run after its last block (see `resume_point` for the integrator's state).

        rows: total number of instants, with the existing ones; lock: as for a new file.
        """
        writer = cls.__new__(cls)
        writer._begin(Path(path), rows)
        writer._lock = lock or FileLock(writer.path)
        try:
            writer._skeleton = open_file(writer.path)
            writer._adopt(writer._skeleton)
            running = {"complete": False, "ended": ""}
            if rows > len(writer._data["time"]):
                writer._lay_out(Changes(rows, running))
            else:
                writer._skeleton.close()
                writer._continue_in(writer.path)
                conclude(writer._opened(), running, {})
        except BaseException:
            writer._lock.release()
            raise
        return writer

    def write_block(self, times: Array, arrays: Mapping[str, Array], resume: Any = None) -> None:
        """Append instants (k,) [s] and their arrays (k, *shape) by path, with the integrator's state after the last.

        The block is in the file when this returns; one without rows only brings a new state. The state is an array,
        or nested dicts of arrays and numbers, of the same shapes in every block (other shapes cost a copy of the
        file). Raises ValueError when times do not increase or paths or shapes are not those of the channels, OSError
        when the block cannot be written; what was written before is kept.
        """
        block = {"time": np.asarray(times, float), **{path: np.asarray(value, float) for path, value in arrays.items()}}
        self._check(block)
        state = None if resume is None else flattened(resume)
        if not self.rows + len(block["time"]):
            return
        self.make_room(len(block["time"]), resume)
        try:
            self._write(block, state)
        except (OSError, RuntimeError) as error:
            raise self._write_error(error) from error

    def finish(
        self, complete: bool, ended: str = "", statistics: Mapping[str, Any] | None = None, watches: str = ""
    ) -> None:
        """Close the file, trimmed to its valid rows, saying how the run ended; a run without a block leaves no file.

        watches: JSON text of the warnings of the run's watches
        A run with numbers that are not finite is never marked complete; `ended` then says which they are.
        """
        if self._not_finite:
            complete, ended = False, "; ".join(filter(None, [ended, self._not_finite]))
        ending = {"complete": bool(complete), "ended": ended} | ({"watches": watches} if watches else {})
        try:
            if self._file is not None and self.rows:
                self._conclude(ending, statistics or {})
        finally:
            self.close()

    def _conclude(self, ending: Mapping[str, Any], statistics: Mapping[str, Any]) -> None:
        if self.rows < len(self._data["time"]):
            try:
                return self._lay_out(Changes(self.rows, ending, statistics))
            except OSError:  # no space for the trimmed copy: write the ending in place
                pass
            except KeyboardInterrupt:
                conclude(self._opened(), {"complete": False, "ended": "interrupted"}, {})
                raise
        conclude(self._opened(), ending, statistics)

    def _close_untrimmed(self, ended: str) -> None:
        """Close the file at once, and leave the unused rows after the valid ones in it."""
        try:
            if self.rows:
                conclude(self._opened(), {"complete": False, "ended": ended}, {})
        finally:
            self.close()

    def close(self) -> None:
        """Close the file in its present state."""
        try:
            for file in (self._file, self._skeleton):
                if file is not None:
                    file.close()
            self._file, self._data = None, {}
            remove_part(self._part)
            self._interrupt_context.close()
        finally:
            self._lock.release()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: object) -> None:
        if self._file is None:
            return
        if kind is None:
            self.finish(complete=False, ended="not finished")
        elif issubclass(kind, KeyboardInterrupt):
            self._close_untrimmed("interrupted")
        else:
            self.finish(complete=False, ended=f"stopped by {kind.__name__}: {error}")

    def _opened(self) -> h5py.File:
        if self._file is None:
            raise ValueError(f"{self.path} is finished; nothing more can be written to it")
        return self._file

    def _adopt(self, file: h5py.File) -> None:
        self._file = file
        self._data = channels_of(file)
        self.channels = {path: channel_of(data) for path, data in self._data.items() if path != "time"}
        self.rows, self._slot = (int(k) for k in file["progress"][()])

    def _check(self, block: dict[str, Array]) -> None:
        self._opened()
        missing, unknown = sorted(self._data.keys() - block.keys()), sorted(block.keys() - self._data.keys())
        if missing or unknown:
            raise ValueError(f"the block lacks the channels {missing}; of what it has, {unknown} are not channels")
        count = len(block["time"])
        for path, value in block.items():
            expected = (count, *self._data[path].shape[1:])
            if value.shape != expected:
                raise ValueError(f"channel {path!r} of the block has shape {value.shape}; expected {expected}")
            finite = np.isfinite(value).all(axis=tuple(range(1, value.ndim)))
            if not finite.all() and not self._not_finite:
                self._not_finite = f"values of {path} are not finite from t = {block['time'][np.argmin(finite)]:g} s on"
        last_time = self._data["time"][self.rows - 1 : self.rows] if self.rows else np.zeros(0)
        if np.any(np.diff(np.concatenate([last_time, block["time"]])) <= 0):
            raise ValueError("the times of the block do not increase, or do not follow those in the file")

    def make_room(self, count: int, resume: Any = None) -> None:
        """Reserve space for this many further instants and this state; Ctrl-C does no harm meanwhile."""
        self._opened()
        rows, capacity = self.rows + count, len(self._data["time"])
        state, alone = None if resume is None else flattened(resume), not isinstance(resume, Mapping)
        if not rows:
            return
        slots = None if state is None or fits(self._opened(), state, self._next_slot) else state
        if rows <= capacity and slots is None:
            return
        if capacity < rows <= self._expected:
            capacity = self._expected
        elif capacity < rows:
            capacity = max(rows, 2 * capacity) if self.rows else FIRST_BLOCKS * rows
        self._lay_out(Changes(capacity, slots=slots, alone=alone))

    def _lay_out(self, changes: Changes) -> None:
        """Continue in a copy with these changes; it replaces the file unless that has no rows yet."""
        source = self._opened() if self.rows else self._skeleton
        if self._file is not source:
            self._opened().close()
        PARTS.add(self._part)
        try:
            write_copy(source, self._part, self.channels, self.rows, changes)
        except (OSError, RuntimeError) as error:
            remove_part(self._part)
            raise self._write_error(error) from error
        if self.rows:
            source.close()
        self._continue_in(self._move_part() if self.rows else self._part)

    def _move_part(self) -> Path:
        move_into_place(self._part, self.path)
        return self.path

    def _continue_in(self, path: Path) -> None:
        self._adopt(h5py.File(path, "r+", locking=False))

    @property
    def _next_slot(self) -> int:
        return 1 - self._slot if self._slot >= 0 else 0

    def _write(self, block: dict[str, Array], state: dict[str, NDArray[Any]] | None) -> None:
        file, start = self._opened(), self.rows
        end, slot = start + len(block["time"]), -1 if state is None else self._next_slot
        for path, value in block.items():
            self._data[path][start:end] = value
        if state is not None:
            write_slot(file, state, slot)
        file.flush()
        file["progress"][...] = [end, slot]  # sixteen bytes in place: the block counts from here on
        file.flush()
        self.rows, self._slot = end, slot
        previous = self._interrupt_context.pop_all()
        self._interrupt_context.enter_context(finished_on_interrupt(str(self.path)))
        previous.close()
        if start == 0 < end:
            file.close()
            self._continue_in(self._move_part())

    def _write_error(self, error: Exception) -> OSError:
        number_text = re.search(r"errno = (\d+)", str(error))  # in what HDF5 says
        code = getattr(error, "errno", None) or (int(number_text[1]) if number_text else None)
        reason = os.strerror(code) if code else "the HDF5 library could not write to it"
        kept = f"the {self.rows} instants written before are kept" if self.rows else "nothing had been written before"
        failure = OSError(f"{self.path} cannot be written ({reason}); {kept}")
        failure.errno = code or errno.EIO
        return failure


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
