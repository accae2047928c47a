"""Files that a case refers to: checks that they exist and are not overwritten, ephemerides, and inputs of models."""

from __future__ import annotations

import contextlib
import tomllib
from collections.abc import Iterator, Mapping
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import BaseModel

from femflex.case.body import FileTable, FlexibleTable, RigidTable
from femflex.case.case import Case
from femflex.case.initial import COMPUTED
from femflex.case.matrices import MatricesTable
from femflex.case.outline import Outline, outline_of_tables
from femflex.case.shape import MeshShape
from femflex.noun.problems import Problem, quoted_names
from femflex.noun.units import UnitError, to_base
from femflex.noun.values import value_text
from femflex.system.ccsds import read_aem
from femflex.system.environment import days_since_j2000
from femflex.system.ephemeris_orbit import starting_elements
from femflex.system.motion import Motion


def file_problems(outline: Outline, folder: Path) -> Iterator[Problem]:
    """Problems of files that the case refers to and that do not exist."""
    for key_path, name in _referenced_files(outline):
        path = folder / name
        try:
            path.stat()
        except (FileNotFoundError, NotADirectoryError):
            pass
        except (OSError, ValueError) as error:  # too long a name, a null character, a folder that may not be entered
            yield Problem(key_path, f"found {value_text(name)}, which cannot be a file ({_reason(error)}); name a file")
            continue
        if path.is_dir():
            yield Problem(key_path, f"found {name!r}, which is a folder; give the name of a file in it")
        elif not path.is_file():
            candidates = sorted(p.name for p in path.parent.glob(f"*{path.suffix}")) if path.parent.is_dir() else []
            text = (
                f"{path.parent} holds {quoted_names(candidates[:8])}"
                if candidates
                else f"{path.parent} has no {path.suffix or 'such'} files"
                if path.parent.is_dir()
                else f"there is no folder {path.parent}"
            )
            yield Problem(
                key_path, f"found {name!r}, which does not exist; names are relative to the case file, and {text}"
            )


def _reason(error: OSError | ValueError) -> str:
    return (error.strerror if isinstance(error, OSError) else None) or str(error)


def input_files(case: Case) -> list[Path]:
    """The case file and all files to which it refers."""
    names = [name for _, name in _referenced_files(outline_of_tables(tomllib.loads(case.text)))]
    names += [name for _, motion in motions_from_files(case) for name in motion.files]
    nouns = (noun for named in case.effectors.values() for noun in named.values())
    names += [name for noun in nouns for _, name in noun.files()]
    return [case.path, *(case.path.parent / name for name in names)]


def check_no_input(case: Case, output: Path) -> None:
    """Raise ValueError if the file to be written is an input file of the case."""
    for path in input_files(case):
        if path.exists() and output.exists() and path.samefile(output):
            raise ValueError(f"{output} is an input of this case and would be lost; choose another --output")


def _referenced_files(outline: Outline) -> Iterator[tuple[str, str]]:
    for name, body in outline.bodies.items():
        if isinstance(body, FlexibleTable):
            yield f"bodies.{name}.{'mesh' if body.deck is None else 'deck'}", body.source
        if isinstance(body, FileTable):
            yield f"bodies.{name}.file", body.file
        if isinstance(body, MatricesTable):
            yield from ((f"bodies.{name}.matrices{key}", file) for key, file in body.files)
        if isinstance(body, RigidTable):
            yield from (
                (f"bodies.{name}.shapes[{k}].file", s.file)
                for k, s in enumerate(body.shapes)
                if isinstance(s, MeshShape)
            )
    for key_path, table in (("orbit", outline.orbit), ("attitude", outline.attitude)):
        if table is not None and table.ephemeris is not None:
            yield f"{key_path}.ephemeris", table.ephemeris
    if outline.initial is not None and outline.initial.source not in (None, *COMPUTED):
        yield "initial.from", outline.initial.source
    for key_path, load in outline.loads.items():
        if load is not None and load.table is not None:
            yield f"{key_path}.table", load.table


SIZES = ("perigee_altitude", "semi_major_axis", "eccentricity", "inclination", "node", "perigee", "true_anomaly")


class EphemerisError(Exception):
    """An ephemeris file that cannot be read."""

    def __init__(self, key: str, text: str) -> None:
        super().__init__(text)
        self.problem = Problem(key, text)


def with_ephemerides(tables: Mapping[str, Any] | None, folder: Path) -> dict[str, Any] | None:
    """The tables of a case, in which an orbit of a file has its elements and the environment its epoch.

    Raises EphemerisError for a file that cannot be read, and for elements beside it.
    """
    if tables is None:
        return None
    out = dict(tables)
    orbit, attitude = (_file_of(tables, key) for key in ("orbit", "attitude"))
    if orbit is None and attitude is None:
        return out
    environment = tables.get("environment", {})
    epoch = environment.get("epoch") if isinstance(environment, Mapping) else environment.epoch
    key = "orbit"
    try:
        days = None if epoch is None else days_since_j2000(epoch)
        if orbit is not None and isinstance(out["orbit"], Mapping):
            if given := [name for name in SIZES if name in out["orbit"]]:
                raise ValueError(f"found ephemeris together with {', '.join(given)}; give one or the other")
            mu = out["orbit"].get("mu")
            elements, days = starting_elements(folder / orbit, days, *([float(mu)] if mu is not None else []))
            out["orbit"] = {**out["orbit"], **elements}
        key = "attitude"
        if attitude is not None:
            days = float(read_aem(folder / attitude).days[0]) if days is None else days
            if isinstance(out["attitude"], Mapping):
                out["attitude"] = {**out["attitude"], "frame": out["attitude"].get("frame", "inertial")}
    except (ValueError, OSError) as error:
        raise EphemerisError(f"{key}.ephemeris", str(error)) from None
    if epoch is None and days is not None and isinstance(environment, Mapping):
        out["environment"] = {**environment, "epoch": days}
    return out


def _file_of(tables: Mapping[str, Any], key: str) -> str | None:
    table = tables.get(key)
    name = table.get("ephemeris") if isinstance(table, Mapping) else getattr(table, "ephemeris", None)
    return name if isinstance(name, str) else None


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
