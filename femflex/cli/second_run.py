"""The second run of a case's [pictures], linearised or with terms left out, for the plots of the first."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from femflex.cli.progress import Bar
from femflex.cli.tables import print_folded

if TYPE_CHECKING:
    from femflex.case import Case
    from femflex.pipeline import Prepared
    from femflex.results import Run


def second_output(case: Case, output: Path) -> Path | None:
    """Path of the second run's result file; None without a second run."""
    if case.pictures is None or not (case.pictures.without or case.pictures.linearised):
        return None
    word = "linearised" if case.pictures.linearised else "without"
    return output.with_name(f"{output.stem}_{word}{output.suffix}")


def check_left_out(prepared: Prepared) -> None:
    """Raise ValueError if a term that the second run leaves out does not exist, or the craft has no linear motion."""
    if prepared.case.pictures is not None and prepared.case.pictures.linearised:
        from femflex.pipeline.linear_motion import check

        check(prepared.system)
    if prepared.case.pictures is not None and not prepared.model.omitted:
        from femflex.dynamics.terms.without import resolve_name

        for name in prepared.case.pictures.without:
            resolve_name(prepared.model, name)


@contextmanager
def second_run(case: Case, output: Path, force: bool) -> Iterator[Run | None]:
    """Yield the second run, open for reading; one that diverges is kept up to that time, with a report."""
    path = second_output(case, output)
    if path is None or case.pictures is None:
        yield None
        return
    from femflex import pipeline
    from femflex.integrate import IntegrationError
    from femflex.results import open_run
    from femflex.warning import PhysicsWarning

    linear = case.pictures.linearised
    difference = "linearised" if linear else f"without {', '.join(case.pictures.without)}"
    prepared = pipeline.prepare(case, path, force=force, without=case.pictures.without, linearised=linear)
    text = "reached the end"
    with warnings.catch_warnings(), Bar(f"again {difference}", float(prepared.times[-1])) as bar:
        warnings.simplefilter("ignore", PhysicsWarning)  # what it leaves out is left out on purpose
        try:
            pipeline.integrate(prepared, path, force=force, progress=bar)
        except IntegrationError as error:
            text = f"stopped at t = {error.t:.6g} s, where it diverges"
    print_folded(f"compared    {difference}: {path} {text}")
    with open_run(path) as run:
        yield run
