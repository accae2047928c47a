"""Check of a result file: entries that are missing, or not of the shape and type that the layout gives them."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path

import h5py
import numpy as np

from femflex.results.layout import channels_of

TEXTS = ("title", "case_text", "femflex_version", "ended")
OPTIONAL = ("case_path", "integrator", "without", "varying", "effectors")  # texts that a file may lack
TABLES = {
    "inputs": ("values", "files", "length"),
    "advice": (),
    "watches": (),
}  # optional JSON texts and their required keys
GROUPS = ("model", "statistics", "versions")
WIDTHS = {"position": 3, "attitude": 4, "rate": 3, "velocity": 3, "deflection": 3}  # of channels of bodies and markers


def check_layout(file: h5py.File, path: Path) -> None:
    """Raise ValueError that names the first fault of a result file."""
    for problem in _problems(file):
        raise ValueError(f"{path} is damaged or was edited: {problem}. Take an unchanged copy, or run the case anew")


def _problems(file: h5py.File) -> Iterator[str]:
    yield from _attribute_problems(file)
    yield from (f"its group /{name} is missing" for name in GROUPS if not isinstance(file.get(name), h5py.Group))
    progress, time = file.get("progress"), file.get("time")
    if not _is_array(progress, "iu", (2,)):
        yield "its data set /progress is not two whole numbers"
    if not _is_array(time, "f", (None,)):
        yield "its data set /time is missing or no column of numbers"
    rows, slot = (int(k) for k in progress[()])
    if not (0 <= rows <= len(time) and slot in (-1, 0, 1)):
        yield f"/progress says {rows} rows and slot {slot}, and /time has {len(time)} rows"
    times = time[:rows]
    if not np.isfinite(times).all() or np.any(np.diff(times) <= 0):
        yield "the values of /time are not finite and rising"
    for name, data in channels_of(file).items():
        yield from (f"its channel {name} {text}" for text in _channel_problems(data, len(time), name))
    state_channels = [f"bodies/{name}/{leaf}" for name in file["model"] for leaf in ("position", "attitude")]
    for name in ("q", "u", *state_channels) if "integrator" in file.attrs else ():
        if name not in file:
            yield f"its channel {name} is missing"
    for name, group in file["model"].items():
        yield from (f"/model/{name} {text}" for text in _body_problems(group, file))
    slots = file.get("resume")
    if slot >= 0 and not (
        isinstance(slots, h5py.Group) and "alone" in slots.attrs and isinstance(slots.get(str(slot)), h5py.Group)
    ):
        yield f"the integrator's state (/resume/{slot}) is missing"


def _attribute_problems(file: h5py.File) -> Iterator[str]:
    for key in (*TEXTS, *OPTIONAL, *TABLES):
        if key not in file.attrs:
            if key in TEXTS:
                yield f"its attribute {key!r} is missing"
        elif not isinstance(file.attrs[key], str | bytes):
            yield f"its attribute {key!r} is no text"
    if not isinstance(file.attrs.get("complete"), bool | np.bool_ | np.integer):
        yield "its attribute 'complete' is missing or neither true nor false"
    for key, keys in TABLES.items():
        if text := file.attrs.get(key):
            try:
                table = json.loads(text)
            except ValueError:
                table = None
            if table is None or not all(name in table and isinstance(table[name], dict) for name in keys):
                yield f"its attribute {key!r} is not the JSON text that a run writes"


def _channel_problems(data: h5py.Dataset, rows: int, path: str) -> Iterator[str]:
    if data.dtype.kind != "f" or not data.ndim:
        yield f"holds {data.dtype} and not columns of floating-point numbers"
    elif len(data) != rows:
        yield f"has {len(data)} rows, and /time has {rows}"
    group, leaf = path.split("/")[0], path.split("/")[-1]
    width = WIDTHS.get(leaf) if group in ("bodies", "markers") else None
    if width is not None and data.shape[1:] != (width,):
        yield f"has the shape {data.shape}, and {width} columns are needed"
    for key in ("unit", "description", "frame"):
        if not isinstance(data.attrs.get(key), str):
            yield f"lacks its text {key!r}"
    names = data.attrs.get("names")
    if not isinstance(names, np.ndarray) or names.ndim != 1 or not all(isinstance(name, str) for name in names):
        yield "lacks its list of 'names'"
    elif len(names) not in (0, data.shape[-1] if data.ndim > 1 else 0):
        yield f"has {len(names)} names for {data.shape[-1]} columns"


def _body_problems(group: h5py.Group, file: h5py.File) -> Iterator[str]:
    """Problems of the stored data of a body, and of the channel of its elastic coordinates in a run."""
    if not isinstance(group, h5py.Group):
        yield "is no group"
        return
    for key in ("mass", "n_modes"):
        if not np.isscalar(group.attrs.get(key)):
            yield f"lacks its number {key!r}"
    n = int(group.attrs["n_modes"])
    points = group.get("points")
    count = len(points) if _is_array(points, "f", (None, 3)) else 0
    expected: dict[str, tuple[str, tuple[int | None, ...]]] = {"omega": ("f", (n,)), "kinds": ("O", (None,))}
    if any(name in group for name in ("points", "shapes", "cells", "growth")):
        expected |= {"points": ("f", (None, 3)), "shapes": ("f", (n, count, 3))}
        expected |= {"growth": ("f", (count, 3))} if "growth" in group else {}
        expected |= {f"cells/{name}": ("iu", (None, None)) for name in _members(group, "cells")}
        if not _members(group, "cells"):
            yield "lacks its group 'cells'"
    expected |= {f"markers/{name}": ("f", (3,)) for name in _members(group, "markers")}
    for name, (kind, shape) in expected.items():
        if not _is_array(group.get(name), kind, shape):
            yield f"lacks {name!r} of the shape {_shape_text(shape)}"
    if not isinstance(group.get("markers"), h5py.Group):
        yield "lacks its group 'markers'"
    path = f"bodies{group.name.removeprefix('/model')}/delta"
    delta = file.get(path)
    if delta is None and n and "integrator" in file.attrs:
        yield f"has {n} shapes, and the channel {path} is missing"
    elif delta is not None and delta.shape[1:] != (n,):
        yield f"has {n} shapes, and {path} has the shape {delta.shape}"


def _is_array(data: object, kinds: str, shape: tuple[int | None, ...]) -> bool:
    """Whether this is a data set of numbers of these kinds and of that shape; None: any size."""
    if not isinstance(data, h5py.Dataset) or data.dtype.kind not in kinds or data.ndim != len(shape):
        return False
    return all(size is None or size == actual for size, actual in zip(shape, data.shape, strict=True))


def _members(group: h5py.Group, name: str) -> list[str]:
    return list(group[name]) if isinstance(group.get(name), h5py.Group) else []


def _shape_text(shape: tuple[int | None, ...]) -> str:
    return " x ".join("any" if size is None else str(size) for size in shape)
