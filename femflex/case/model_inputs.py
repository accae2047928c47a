"""Values of a case's model, on which its motion depends.

A result file stores them, so that a run is only resumed, or its terms evaluated, with the same model. They are the
values in SI: comments, the order of keys and the units in the text do not count.
"""

from __future__ import annotations

import contextlib
from collections.abc import Iterator, Mapping
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import BaseModel

from femflex.case.case import Case
from femflex.noun.units import UnitError, to_base
from femflex.system.motion import Motion

NOT_INPUTS = {"title", "source", "description", "pictures", "expect", "study", "campbell"}  # no part of the model
LENGTH = {"duration", "orbits", "output_step", "samples"}  # of [run]: output times, compared on their own


def model_values(case: Case) -> dict[str, Any]:
    """The values of a case on which its model and integration depend, as JSON can hold them; None is left out."""
    tables = {key: getattr(case, key) for key in type(case).model_fields if key not in NOT_INPUTS}
    values: dict[str, Any] = _plain(tables, case.path.parent)
    values["run"] = {key: value for key, value in values["run"].items() if key not in LENGTH}
    return values


def motions_from_files(value: Any, key_path: str = "") -> Iterator[tuple[str, Motion]]:
    """The motions that come from a file, by their key path."""
    if isinstance(value, Motion):
        if value.files:
            yield key_path, value
    elif isinstance(value, BaseModel):
        for key in type(value).model_fields:
            yield from motions_from_files(getattr(value, key), f"{key_path}.{key}" if key_path else key)
    elif isinstance(value, Mapping):
        for key, entry in value.items():
            yield from motions_from_files(entry, f"{key_path}.{key}")
    elif isinstance(value, list | tuple):
        for k, entry in enumerate(value):
            yield from motions_from_files(entry, f"{key_path}[{k}]")


def _in_si(value: Any) -> Any:
    """A value as JSON can hold it, its texts with units as numbers in SI; other texts, as names, stay."""
    if isinstance(value, dict):
        return {key: _in_si(entry) for key, entry in value.items()}
    if isinstance(value, list):
        return [_in_si(entry) for entry in value]
    if isinstance(value, str):
        with contextlib.suppress(UnitError):
            return to_base(value)[0]
    return value


def _plain(value: Any, folder: Path) -> Any:
    """A value of a case as JSON can hold it."""
    if isinstance(value, Motion):
        if value.files or value.profile is None:
            return {"locked": value.locked, "given": _in_si(_plain(value.table, folder))}  # files have digests
        return _plain(value.profile(folder), folder)
    if isinstance(value, BaseModel):
        table_fields = type(value).model_fields.items()
        return _plain({field.alias or key: getattr(value, key) for key, field in table_fields}, folder)
    if is_dataclass(value) and not isinstance(value, type):
        return _plain({field.name: getattr(value, field.name) for field in fields(value)}, folder)
    if isinstance(value, Mapping):
        return {str(key): _plain(entry, folder) for key, entry in value.items() if entry is not None}
    if isinstance(value, list | tuple):
        return [_plain(entry, folder) for entry in value]
    if isinstance(value, np.ndarray | np.generic):
        return _plain(value.tolist(), folder)
    if value is None or isinstance(value, str | bool | int | float):
        return value
    raise TypeError(f"a case holds a {type(value).__name__}, which a result file cannot keep")
