"""Files that a case names: that they exist, and that none is written over."""

from __future__ import annotations

import tomllib
from collections.abc import Iterator
from pathlib import Path

from femflex.case.body import FileTable, FlexibleTable, RigidTable
from femflex.case.case import Case
from femflex.case.initial import EQUILIBRIUM
from femflex.case.matrices import MatricesTable
from femflex.case.model_inputs import filed_motions
from femflex.case.outline import Outline, outline
from femflex.case.problems import Problem, listed
from femflex.case.shape import MeshShape
from femflex.case.values import shown


def files(outline: Outline, folder: Path) -> Iterator[Problem]:
    """Files named in the case exist."""
    for where, name in _named_files(outline):
        path = folder / name
        try:
            path.stat()
        except (FileNotFoundError, NotADirectoryError):
            pass
        except (OSError, ValueError) as error:  # too long a name, a null character, a folder that may not be entered
            yield Problem(where, f"found {shown(name)}, which cannot be a file ({_reason(error)}); name a file")
            continue
        if path.is_dir():
            yield Problem(where, f"found {name!r}, which is a folder; give the name of a file in it")
        elif not path.is_file():
            near_by = sorted(p.name for p in path.parent.glob(f"*{path.suffix}")) if path.parent.is_dir() else []
            text = (
                f"{path.parent} holds {listed(near_by[:8])}"
                if near_by
                else f"{path.parent} has no {path.suffix or 'such'} files"
                if path.parent.is_dir()
                else f"there is no folder {path.parent}"
            )
            yield Problem(
                where, f"found {name!r}, which does not exist; names are relative to the case file, and {text}"
            )


def _reason(error: OSError | ValueError) -> str:
    return (error.strerror if isinstance(error, OSError) else None) or str(error)


def input_files(case: Case) -> list[Path]:
    """The case file and all files it names."""
    named = [name for _, name in _named_files(outline(tomllib.loads(case.text)))]
    named += [name for _, motion in filed_motions(case) for name in motion.files]
    return [case.path, *(case.path.parent / name for name in named)]


def check_no_input(case: Case, output: Path) -> None:
    """Raise ValueError when the file to be written is one that the case is made of."""
    for path in input_files(case):
        if path.exists() and output.exists() and path.samefile(output):
            raise ValueError(f"{output} is an input of this case and would be lost; choose another --output")


def _named_files(outline: Outline) -> Iterator[tuple[str, str]]:
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
    if outline.initial is not None and outline.initial.source not in (None, EQUILIBRIUM):
        yield "initial.from", outline.initial.source
    for where, load in outline.loads.items():
        if load is not None and load.table is not None:
            yield f"{where}.table", load.table
