"""From a case to its result file: case, bodies, system, compiled model, integrator and writer joined."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from femflex.pipeline.advance import Progress, integrate
from femflex.pipeline.prepared import Prepared, check_output, prepare
from femflex.pipeline.rebuilt import rebuilt
from femflex.pipeline.resumed import is_finished

if TYPE_CHECKING:
    from femflex.case import Case
    from femflex.results import Run
    from femflex.system import Controller, Effector, Variation

__all__ = [
    "Prepared",
    "Progress",
    "check_output",
    "integrate",
    "is_finished",
    "prepare",
    "rebuilt",
    "run",
]


def run(
    case: Case | str | Path,
    output: str | Path = "run.h5",
    *,
    force: bool = False,
    resume: bool = False,
    progress: Progress | None = None,
    without: Sequence[str] = (),
    effectors: Sequence[Effector | Controller] = (),
    varying: Mapping[str, Variation] | None = None,
    linearised: bool = False,
) -> Run:
    """The finished run of a case, written to an HDF5 file as it goes and open for reading.

    resume    go on with the unfinished run in `output`; the results are those of an uninterrupted run, bit for bit
              (a complete one is returned as it is)
    without   names of what is switched off, such as "gravity_gradient", a load or "flexibility"; the file says so
    effectors effectors and controllers added to those of the case; to resume such a run, give the same again
    progress  called with the time reached [s] after every block
    varying   body name -> Variation: how its properties depend on time; to resume such a run, give the same again
    linearised  solve the linear equations about the equilibrium, or along a deployment (`pipeline.linear_motion`)
    Raises CaseError for a case that cannot be run, FileExistsError for an existing output unless `force`,
    BlockingIOError when another run is writing the output, ValueError when `resume` finds other inputs, and
    IntegrationError when the integration fails; the file then keeps the computed rows and is marked incomplete.
    """
    from femflex.case import Case, read_case
    from femflex.results import FileLock, open_run

    case = case if isinstance(case, Case) else read_case(case)
    if resume and is_finished(case, Path(output)):
        return open_run(output)
    if not resume:
        check_output(case, Path(output), force, resume)
    with FileLock(output) as lock:
        prepared = prepare(
            case,
            output,
            force=force,
            resume=resume,
            without=without,
            effectors=effectors,
            varying=varying,
            linearised=linearised,
        )
        integrate(prepared, output, force=force, resume=resume, progress=progress, lock=lock)
    return open_run(output)
