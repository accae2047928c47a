"""Files that a case refers to: the check that they exist, and that no output overwrites them."""

from __future__ import annotations

import tomllib
from collections.abc import Iterator
from pathlib import Path

from femflex.case.body import FileTable, FlexibleTable, RigidTable
from femflex.case.case import Case
from femflex.case.initial import EQUILIBRIUM
from femflex.case.matrices import MatricesTable
from femflex.case.model_inputs import motions_from_files
from femflex.case.outline import Outline, outline_of_tables
from femflex.case.shape import MeshShape
from femflex.noun.problems import Problem, quoted_names
from femflex.noun.values import value_text


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
    if outline.initial is not None and outline.initial.source not in (None, EQUILIBRIUM):
        yield "initial.from", outline.initial.source
    for key_path, load in outline.loads.items():
        if load is not None and load.table is not None:
            yield f"{key_path}.table", load.table
