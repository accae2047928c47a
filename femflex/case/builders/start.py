"""[initial]: a craft that starts in equilibrium, or where another run ended."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from femflex.case.case import Case
from femflex.case.initial import EQUILIBRIUM
from femflex.case.problems import CaseError, Problem
from femflex.system import System, started

Array = NDArray[np.float64]


def placed(case: Case, system: System) -> System:
    """The system where its case's [initial] starts it.

    Raises CaseError when the file is of another craft or there can be no equilibrium, EquilibriumError when none is
    found.
    """
    if case.initial is None or case.initial.source is None:
        return system
    if case.initial.source != EQUILIBRIUM:
        return started(system, _last_row(case, system))
    from femflex.dynamics.equilibria.equilibrium import equilibrium

    try:
        found = equilibrium(system, at=0.0)
    except ValueError as error:
        problems = [Problem("initial.from", line) for line in str(error).splitlines()]
        raise CaseError(case.path.name, problems) from error
    return started(system, np.concatenate([found.q, system.initial_state()[len(found.q) :]]))


def _last_row(case: Case, system: System) -> Array:
    """The state (n_x,) in the last row of the file."""
    from femflex.results import open_run

    assert case.initial is not None and case.initial.source is not None
    try:
        with open_run(case.beside(case.initial.source)) as run:
            wanted = {"q": system.coordinate_names(), "u": system.velocity_names(), "z": system.state_names()}
            wanted = {path: names for path, names in wanted.items() if names or path in run}
            for path, names in wanted.items():
                _check_names(case, run.names(path), tuple(name for name, _ in names))
            if not len(run):
                raise ValueError(f"{run.path} holds no instants")
            return np.concatenate([run[path][-1] for path in wanted])
    except (ValueError, KeyError, OSError) as error:
        if isinstance(error, CaseError):
            raise
        raise CaseError(case.path.name, [Problem("initial.from", str(error.args[0]))]) from error


def _check_names(case: Case, found: tuple[str, ...], wanted: tuple[str, ...]) -> None:
    if found == wanted:
        return
    assert case.initial is not None
    missing = [name for name in wanted if name not in found] or ["the order"]
    other = [name for name in found if name not in wanted] or ["the order"]
    text = (
        f"found {case.initial.source!r}, which is of another craft: it has {len(found)} coordinates and this one "
        f"{len(wanted)}; {other[0]} is only there, {missing[0]} only here"
    )
    raise CaseError(case.path.name, [Problem("initial.from", text)])
