"""Digests of the files that a case names, as a result file keeps them.

A digest is of the contents of a file, not of its bytes: a mesh may be written again in another format version, and
included files count.
"""

from __future__ import annotations

import hashlib
import warnings
from collections.abc import Callable, Iterator, Mapping
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any

import numpy as np

from femflex.case.body import FileTable, FlexibleTable, RigidTable
from femflex.case.case import Case
from femflex.case.initial import COMPUTED
from femflex.case.matrices import MatricesTable
from femflex.case.named_files import motions_from_files
from femflex.case.shape import MeshShape
from femflex.noun.table import Table
from femflex.system.motion import Motion


def file_digests(case: Case) -> dict[str, dict[str, str]]:
    """Name and digest of the contents of every file that a case names, by the key that names it."""
    folder = case.path.parent
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # given where the files are read to be used
        digests = {(name, read): read(folder / name) for _, name, read in _files(case)}
        digests_by_key = {where: {"file": name, "digest": digests[name, read]} for where, name, read in _files(case)}
    return digests_by_key | {where: _motion_file(motion, folder) for where, motion in motions_from_files(case)}


def _files(case: Case) -> Iterator[tuple[str, str, Callable[[Path], str]]]:
    for name, body in case.bodies.items():
        if isinstance(body, FlexibleTable):
            if body.deck is not None:
                yield f"bodies.{name}.deck", body.deck, _deck_digest
            else:
                yield f"bodies.{name}.mesh", body.source, _mesh_digest
        if isinstance(body, FileTable):
            yield f"bodies.{name}.file", body.file, _body_digest
        if isinstance(body, MatricesTable):
            yield from ((f"bodies.{name}.matrices{key}", file, _bytes_digest) for key, file in body.files)
        if isinstance(body, RigidTable):
            shapes = [(k, shape.file) for k, shape in enumerate(body.shapes) if isinstance(shape, MeshShape)]
            yield from ((f"bodies.{name}.shapes[{k}].file", file, _mesh_digest) for k, file in shapes)
    if case.initial is not None and case.initial.source not in (None, *COMPUTED):
        yield "initial.from", str(case.initial.source), _last_row_digest
    for k, load in enumerate(case.loads):
        if load.table is not None:
            yield f"loads[{k}].table", load.table, _load_digest
    for heading, nouns in case.effectors.items():
        for name, noun in nouns.items():
            yield from ((f"{heading}.{name}.{key}", file, _bytes_digest) for key, file in noun.files())


def _motion_file(motion: Motion, folder: Path) -> dict[str, str]:
    assert motion.profile is not None
    return {"file": ", ".join(motion.files), "digest": content_digest(motion.profile(folder))}


def _mesh_digest(path: Path) -> str:
    from femflex.mesh import read_mesh

    return content_digest(read_mesh(path))


def _deck_digest(path: Path) -> str:
    from femflex.decks import read_deck

    deck = read_deck(path)
    return content_digest([deck.mesh, deck.members, deck.point_masses, deck.connections, deck.bushings, deck.supports])


def _load_digest(path: Path) -> str:
    from femflex.system.load_file import read_load_file

    return content_digest(read_load_file(path))


def _last_row_digest(path: Path) -> str:
    from femflex.results import open_run

    with open_run(path) as run:
        last = slice(len(run) - 1, len(run))
        return content_digest([(run.names(name), run.read(name, last)) for name in ("q", "u", "z") if name in run])


def _body_digest(path: Path) -> str:
    """Digest of the contents of a body file except the version of femflex that wrote it."""
    import h5py

    from femflex.hdf5 import open_hdf5

    with open_hdf5(path) as file:
        contents: dict[str, Any] = {}

        def add(name: str, item: Any) -> None:
            attributes = {key: value for key, value in item.attrs.items() if key != "femflex_version"}
            contents[name] = (attributes, item[()] if isinstance(item, h5py.Dataset) else None)

        add("", file)
        file.visititems(add)
        return content_digest(contents)


def _bytes_digest(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()


def content_digest(value: Any) -> str:
    """Digest of numbers, text and arrays, in containers, dataclasses and nouns; the order of keys does not count."""
    digest = hashlib.sha256()

    def add(value: Any) -> None:
        if is_dataclass(value) and not isinstance(value, type):
            add({field.name: getattr(value, field.name) for field in fields(value)})
        elif isinstance(value, Table):
            add({name: getattr(value, name) for name in type(value).model_fields})
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
