"""Write a starting case for a mesh: choices of members and clamps are tried until a body can be built."""

from __future__ import annotations

import warnings
from dataclasses import replace
from pathlib import Path

from femflex.assembly.bodies import built_body
from femflex.case import CaseError, parse_case
from femflex.mesh import Mesh
from femflex.starting.case_text import mesh_choices, starting_case

LARGEST = 30000  # points; no body is tried for larger meshes
FEWER = (6, 3, 1)  # modes


def starting_case_of_mesh(target: Path, mesh: Mesh, file: str, schema: str) -> tuple[str, list[str]]:
    """Text of a case and notes on it, as `starting_case`, for the first choice whose body can be built.

    Raises ValueError with the problems of the first choice if no body can be built.
    """
    try:
        choices = mesh_choices(mesh)
    except ValueError as error:
        raise ValueError(f"{file}: {error}") from None
    if len(mesh.points) > LARGEST:
        text, notes = starting_case(target.name, mesh, file, schema, choice=choices[0])
        return text, [*notes, f"members: not tried, since the mesh has {len(mesh.points)} points"]
    reason = ""
    for choice in choices:
        for n in FEWER:
            text, notes = starting_case(target.name, mesh, file, schema, choice=replace(choice, modes=n))
            try:
                with warnings.catch_warnings():
                    warnings.simplefilter("ignore")  # `check` and `run` print them for the case
                    built_body(parse_case(text, target), "flexible", draft=True)
            except CaseError as error:
                texts = [problem.text for problem in error.problems]
                reason = reason or " ".join(texts)
                if not any("modes were requested" in problem_text for problem_text in texts):
                    break
            else:
                left_out = choice.members.keys() != choices[0].members.keys()
                return text, [
                    *notes,
                    f"members: some groups are left out, because otherwise {reason}",
                ] if left_out and reason else notes
    raise ValueError(f"{file}: no body can be made of this mesh: {reason}")
