"""`femflex check`: everything wrong with a case, without running it."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from femflex.cli.progress import Patience
from femflex.cli.verb import verb


@verb("femflex check cases/orbiter_beam.toml")
def check(case: Annotated[Path, typer.Argument(help="Case file (TOML).", show_default=False)]) -> None:
    """Report every problem of a case: keys, units, names, meshes, structure, modes. Writes nothing."""
    with Patience("building the bodies"):
        from femflex.case import read_case
        from femflex.case.builders import build_system
        from femflex.case.values import count

        system = build_system(read_case(case))
    elastic = sum(body.n_modes for body in system.bodies.values())
    mass = sum(body.moments.mass for body in system.bodies.values())
    freedoms = len(system.velocity_names())
    bodies = count(len(system.bodies), "body", "bodies")
    print(
        f"{case.name}: no problems; {bodies}, {mass:.6g} kg, {freedoms} degrees of freedom, {elastic} of them elastic"
    )
