"""What the motion of a case depends on: the values of its model, and digests of the files that it names.

A result file keeps both, so that a run is only resumed, or its terms evaluated, with the model that made it. Values are
those that were read, in SI: comments, the order of keys and the units in the text do not count. Digests are of what a
file holds, not of its bytes: a mesh may be written again in another format version, and includes count.
"""

from __future__ import annotations

import contextlib
import hashlib
import warnings
from collections.abc import Callable, Iterator, Mapping
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import BaseModel

from femflex.case.body import FileTable, FlexibleTable, RigidTable
from femflex.case.case import Case
from femflex.case.initial import EQUILIBRIUM
from femflex.case.motion import Motion
from femflex.case.shape import MeshShape
from femflex.case.units import UnitError, to_base

BESIDE = {"title", "source", "description", "pictures", "expect", "study", "campbell"}  # no part of the model
LENGTH = {"duration", "orbits", "output_step", "samples"}  # of [run]: output times, compared on their own


def model_values(case: Case) -> dict[str, Any]:
    """The values of a case that its model and integration depend on, as JSON can hold them; None is left out."""
    kept = {key: getattr(case, key) for key in type(case).model_fields if key not in BESIDE}
    values: dict[str, Any] = _plain(kept, case.path.parent)
    values["run"] = {key: value for key, value in values["run"].items() if key not in LENGTH}
    return values


def file_digests(case: Case) -> dict[str, dict[str, str]]:
    """Name and digest of the contents of every file that a case names, by the key that names it."""
    folder = case.path.parent
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # given where the files are read to be used
        digests = {(name, read): read(folder / name) for _, name, read in _files(case)}
        found = {where: {"file": name, "digest": digests[name, read]} for where, name, read in _files(case)}
    return found | {where: _motion_file(motion, folder) for where, motion in filed_motions(case)}


def _files(case: Case) -> Iterator[tuple[str, str, Callable[[Path], str]]]:
    for name, body in case.bodies.items():
        if isinstance(body, FlexibleTable):
            yield f"bodies.{name}.mesh", body.mesh, _mesh_digest
        if isinstance(body, FileTable):
            yield f"bodies.{name}.file", body.file, _body_digest
        if isinstance(body, RigidTable):
            shapes = [(k, shape.file) for k, shape in enumerate(body.shapes) if isinstance(shape, MeshShape)]
            yield from ((f"bodies.{name}.shapes[{k}].file", file, _mesh_digest) for k, file in shapes)
    if case.initial is not None and case.initial.source not in (None, EQUILIBRIUM):
        yield "initial.from", str(case.initial.source), _last_row_digest
    for k, load in enumerate(case.loads):
        if load.table is not None:
            yield f"loads[{k}].table", load.table, _load_digest


def filed_motions(value: Any, where: str = "") -> Iterator[tuple[str, Motion]]:
    """The motions that come from a file, by their key path."""
    if isinstance(value, Motion):
        if value.files:
            yield where, value
    elif isinstance(value, BaseModel):
        for key in type(value).model_fields:
            yield from filed_motions(getattr(value, key), f"{where}.{key}" if where else key)
    elif isinstance(value, Mapping):
        for key, entry in value.items():
            yield from filed_motions(entry, f"{where}.{key}")
    elif isinstance(value, list | tuple):
        for k, entry in enumerate(value):
            yield from filed_motions(entry, f"{where}[{k}]")


def _motion_file(motion: Motion, folder: Path) -> dict[str, str]:
    assert motion.profile is not None
    return {"file": ", ".join(motion.files), "digest": content_digest(motion.profile(folder))}


def _mesh_digest(path: Path) -> str:
    from femflex.mesh import read_mesh

    return content_digest(read_mesh(path))


def _load_digest(path: Path) -> str:
    from femflex.assembly.loads import read_load_table

    return content_digest(read_load_table(path))


def _last_row_digest(path: Path) -> str:
    from femflex.results import open_run

    with open_run(path) as run:
        last = slice(len(run) - 1, len(run))
        return content_digest([(run.names(name), run.read(name, last)) for name in ("q", "u", "z") if name in run])


def _body_digest(path: Path) -> str:
    """Digest of all that a body file holds but the version that wrote it."""
    import h5py

    with h5py.File(path, "r") as file:
        found: dict[str, Any] = {}

        def add(name: str, item: Any) -> None:
            attributes = {key: value for key, value in item.attrs.items() if key != "femflex_version"}
            found[name] = (attributes, item[()] if isinstance(item, h5py.Dataset) else None)

        add("", file)
        file.visititems(add)
        return content_digest(found)


def content_digest(value: Any) -> str:
    """Digest of numbers, text and arrays, in containers and dataclasses; the order of keys does not count."""
    digest = hashlib.sha256()

    def add(value: Any) -> None:
        if is_dataclass(value) and not isinstance(value, type):
            add({field.name: getattr(value, field.name) for field in fields(value)})
        elif isinstance(value, Mapping):
            digest.update(f"mapping {len(value)}\n".encode())
            for key in sorted(value, key=str):
                add(str(key))
                add(value[key])
        elif isinstance(value, list | tuple):
            digest.update(f"list {len(value)}\n".encode())
            for entry in value:
                add(entry)
        elif isinstance(value, np.ndarray) and value.dtype.kind in "biufc":
            digest.update(f"array {value.dtype.str} {value.shape}\n".encode())
            digest.update(np.ascontiguousarray(value).tobytes())
        elif isinstance(value, np.ndarray):
            add(value.tolist())
        elif value is None or isinstance(value, str | bytes | bool | int | float | np.generic):
            digest.update(f"{type(value).__name__} {value!r}\n".encode())
        else:
            raise TypeError(f"no digest of a {type(value).__name__}")

    add(value)
    return digest.hexdigest()


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
            return {"locked": value.locked, "given": _in_si(_plain(value.given, folder))}  # files have digests
        return _plain(value.profile(folder), folder)
    if isinstance(value, BaseModel):
        named = type(value).model_fields.items()
        return _plain({field.alias or key: getattr(value, key) for key, field in named}, folder)
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
