"""`femflex jitter`: the pointing budget of a craft by source, mode, frequency and speed."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from femflex.cli.options import (
    DIAGRAM_SUFFIXES,
    PICTURE,
    CaseFile,
    Files,
    Force,
    Json,
    Theme,
    Title,
    Verbose,
    outputs,
    read_quantity,
    split_names,
)
from femflex.cli.progress import Patience
from femflex.cli.tables import print_line, print_table, print_title, printed
from femflex.cli.verb import verb

if TYPE_CHECKING:
    from femflex.arrays import Array
    from femflex.studies.jitter import Budget, FullResponse, Plant

Diagram = Literal["cumulative", "spectrum", "response", "speeds", "waterfall"]
SHOWN = 12  # modes printed; -v prints all
LEAST_SHARE = 5e-4  # of the variance of any output, from which on a mode is printed


@verb("femflex jitter cases/wheel_jitter.toml -o jitter.png")
def jitter(
    case: CaseFile,
    output: Files = None,
    show: Annotated[
        Diagram,
        typer.Option(
            help="cumulative: rms up to each frequency; spectrum: of random sources; response: to each source; "
            "speeds: rms over the speed of wheels and drives; waterfall: lines over frequency and speed."
        ),
    ] = "cumulative",
    full: Annotated[
        str | None,
        typer.Option(help='Frequencies, "10 Hz, 45 Hz", at which the meshes are solved beside the reduced model.'),
    ] = None,
    title: Title = None,
    theme: Theme = "light",
    force: Force = False,
    verbose: Verbose = False,
    as_json: Json = False,
) -> None:
    """Compute what wheels, drives, coolers, thrusters and a shaken base do to the line of sight.

    The case has [disturbances] and the outputs of [jitter]. Printed are the root mean square of each output and three
    times it, by source at the worst speed of each, and by mode.
    """
    files = outputs(output, {PICTURE: DIAGRAM_SUFFIXES}, force, theme)
    with Patience("building bodies and linearising the equations of motion") as say:
        import numpy as np

        from femflex.case import read_case
        from femflex.measures.verdicts import jitter_verdicts
        from femflex.studies.jitter import full_response
        from femflex.studies.jitter import jitter as jitter_of

        parsed_case = read_case(case)
        budget = jitter_of(parsed_case, progress=say)
        whole = (
            None
            if full is None
            else full_response(
                budget.plant, np.array([read_quantity(part, "Hz", "--full") for part in split_names([full])]), say
            )
        )
    rms = {name: budget.rms_of(name) for name in budget.names}
    verdicts = jitter_verdicts(parsed_case, rms)
    heading = parsed_case.title or case.stem
    if PICTURE in files:
        from femflex.view.jitter import plot_jitter

        plot_jitter(budget, files[PICTURE], show, theme=theme, force=force, title=heading if title is None else title)
    with printed(as_json):
        print_title(heading)
        print_budget(budget, verbose or as_json)
        if whole is not None:
            print_full(whole)
        for verdict in verdicts:
            print_line("expected", verdict)
        for kind, path in files.items():
            print_line(kind, path)


def heads_of_outputs(plant: Plant, moving: Sequence[int]) -> tuple[list[tuple[str, str]], Array]:
    """Heads of the columns of outputs, and the factors (n_out,) of their values: angles are in arc seconds."""
    import numpy as np

    from femflex.view.units import ARCSECOND

    units = ["arcsec" if unit == "rad" else unit for unit in plant.units]
    factors = np.array([1.0 / ARCSECOND if unit == "rad" else 1.0 for unit in plant.units])
    return [(f"{plant.names[k]}, {units[k]}", ".4g") for k in moving], factors[list(moving)]


def print_full(answer: FullResponse) -> None:
    """Print responses on the meshes, and the part of each that the reduced model leaves out."""
    sizes = {source: answer.sizes(source)[0] for source in answer.full}
    moving = [k for k in range(len(answer.plant.names)) if any(size[:, k].any() for size in sizes.values())]
    heads, factors = heads_of_outputs(answer.plant, moving)
    lacking = {source: answer.left_out(source) for source in answer.full}
    percents = [(answer.plant.names[k], ".2%") for k in moving]
    tables = [("meshes, per SI unit of", heads, sizes, factors), ("left out by the modes", percents, lacking, 1.0)]
    for title, columns, values, factor in tables:
        pairs = (
            (source, f, row) for source in values for f, row in zip(answer.frequencies, values[source], strict=True)
        )
        rows = [[source, f, *(row[moving] * factor)] for source, f, row in pairs]
        print_table([title, ("Hz", ".4g"), *columns], rows, keys=2)
    if answer.kept:
        print_line("as reduced", ", ".join(answer.kept), list(answer.kept))


def print_budget(budget: Budget, verbose: bool) -> None:
    """Print the tables of a budget: outputs, sources, modes, shocks."""
    from femflex.disturbances import BaseMotion
    from femflex.studies.jitter import stress_peaks
    from femflex.view.units import RPM

    shocks = budget.shocks()
    moving = [k for k in range(len(budget.names)) if budget.rms[k] or any(peaks[0][k] for peaks in shocks.values())]
    names = [budget.names[k] for k in moving]
    heads, factors = heads_of_outputs(budget.plant, moving)
    band = [budget.edges[0], budget.edges[-1]]
    print_line("band", f"{band[0]:.4g} to {band[1]:.4g} Hz, {len(budget.modes)} vibration modes in it", band)
    if len(moving) < len(budget.names):
        print_line("at rest", ", ".join(name for name in budget.names if name not in names))
    for source, (ratio, frequency) in budget.notches().items():
        print_line("notch", f"{source} by at most {10.0 * math.log10(ratio):.3g} dB, at {frequency:.4g} Hz")
    limits, rows = budget.limits(), []
    for k, (head, _), factor in zip(moving, heads, factors, strict=True):
        rms, limit = budget.rms[k], limits[k]
        verdict = "" if limit is None else "within" if 3.0 * rms <= limit else "exceeded"
        sizes = [rms * factor, 3.0 * rms * factor, None if limit is None else limit * factor]
        rows.append([*head.rsplit(", ", 1), *sizes, verdict])
    print_table(["output", "unit", ("rms", ".4g"), ("3 sigma", ".4g"), ("limit", ".4g"), ""], rows)
    if budget.contributions:
        by_source = [[source, *(entry.rms[moving] * factors)] for source, entry in budget.contributions.items()]
        print_table(["rms by source", *heads], by_source)
        swept = [(source, entry.scan) for source, entry in budget.contributions.items() if entry.scan is not None]
        if swept:
            speeds = [[source, *(scan.speeds[scan.worst_indices[k]] * RPM for k in moving)] for source, scan in swept]
            print_table(["worst speed, rpm", *[(name, ".5g") for name in names]], speeds)
        mode_heads = [
            "part of the mean square",
            ("Hz", ".4g"),
            ("damping ratio", ".3g"),
            *((name, ".1%") for name in names),
        ]
        print_table(mode_heads, mode_rows(budget, moving, verbose))
    for source, noun in budget.plant.sources.items():
        if isinstance(noun, BaseMotion):
            print_base_modes(budget, source, verbose)
    stress = [
        [body, peak.group or peak.kind, peak.name, peak.value, peak.unit, *peak.place]
        for body in budget.plant.table.stress
        for peak in stress_peaks(budget, body)
    ]
    if stress:
        places = [(f"{axis}, m", ".4g") for axis in "xyz"]
        print_table(["rms of stress", "members", "quantity", ("largest", ".4g"), "unit", *places], stress, keys=3)
    for source, (srss, cqc, _) in shocks.items():
        peaks = [[rule, *(values[moving] * factors)] for rule, values in (("SRSS", srss), ("CQC", cqc))]
        print_table([f"peaks of shock {source}", *heads], peaks)


def print_base_modes(budget: Budget, source: str, verbose: bool) -> None:
    """Print effective masses and accelerations of the modes under a shaken base, and of all together."""
    from femflex.disturbances import BaseVibration
    from femflex.studies.jitter import base_modes
    from femflex.system.environment import STANDARD_GRAVITY

    modes = base_modes(budget.plant, source)
    shown = [mode for mode in modes if verbose or mode.share >= LEAST_SHARE]
    rows: list[list[Any]] = [
        [m.name, m.frequency, m.Q, m.mass, m.share, m.acceleration / STANDARD_GRAVITY] for m in shown
    ]
    rows.append(["all modes", None, None, sum(mode.mass for mode in modes), sum(mode.share for mode in modes), None])
    rule = "Miles' rms, g" if isinstance(budget.plant.sources[source], BaseVibration) else "peak, g"
    numbers = [("Hz", ".4g"), ("Q", ".4g"), ("effective mass, kg", ".4g"), ("share", ".1%"), (rule, ".4g")]
    print_table([f"modes under {source}", *numbers], rows)


def mode_rows(budget: Budget, outputs: Sequence[int], verbose: bool) -> list[list[Any]]:
    """Rows of the modes with their parts of the mean squares of outputs, largest first, and of what is no mode."""
    import numpy as np

    squares = budget.mean_squares[list(outputs)]
    shares = budget.by_mode[:, list(outputs)] / np.where(squares > 0.0, squares, np.inf)
    largest = np.abs(shares[:-1]).max(axis=1, initial=0.0)
    order = np.argsort(-largest, kind="stable")
    if not verbose:
        order = order[largest[order] >= LEAST_SHARE][:SHOWN]
    rest = shares.sum(axis=0) - shares[order].sum(axis=0)
    shares, rest = (np.where(np.abs(part) >= LEAST_SHARE, part, np.nan) for part in (shares, rest))
    rows = [[budget.modes[k].name, budget.modes[k].frequency, budget.modes[k].damping_ratio, *shares[k]] for k in order]
    return [*rows, ["rigid motion and the rest", None, None, *rest]]
