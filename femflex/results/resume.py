"""State of the integrator in the result file: two slots written in turn, so that one is always complete."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from numpy.typing import NDArray

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
