"""`femflex jitter`: the pointing budget of a craft by source, mode, frequency and speed."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from femflex.cli.options import (
    DIAGRAM_SUFFIXES,
    PICTURE,
    CaseFile,
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
from femflex.cli.tables import print_json, print_line, print_table
from femflex.cli.verb import verb

if TYPE_CHECKING:
    from femflex.studies.jitter import Budget, FullResponse

Diagram = Literal["cumulative", "spectrum", "response", "speeds", "waterfall"]
SHOWN = 12  # modes printed; -v prints all
LEAST_SHARE = 5e-4  # of the variance of any output, from which on a mode is printed


@verb("femflex jitter cases/wheel_jitter.toml -o jitter.png")
def jitter(
    case: CaseFile,
    output: Annotated[
        list[Path] | None, typer.Option("-o", "--output", help="Picture (.png, .svg) of the diagram of --show.")
    ] = None,
    show: Annotated[
        Diagram,
        typer.Option(
            "--show",
            help="cumulative: rms up to each frequency; spectrum: of random sources; response: to each source; "
            "speeds: rms over the speed of wheels and drives; waterfall: lines over frequency and speed.",
        ),
    ] = "cumulative",
    full: Annotated[
        str | None,
        typer.Option(
            "--full", help='Frequencies, "10 Hz, 45 Hz", at which the meshes are solved beside the reduced model.'
        ),
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
        whole = None if full is None else full_response(budget.plant, np.array(read_frequencies(full)), say)
    rms = {name: budget.rms_of(name) for name in budget.names}
    verdicts = jitter_verdicts(parsed_case, rms)
    heading = parsed_case.title or case.stem
    if PICTURE in files:
        from femflex.view.jitter import plot_jitter

        plot_jitter(budget, files[PICTURE], show, theme=theme, force=force, title=heading if title is None else title)
    if as_json:
        print_json(budget_data(budget) | ({} if whole is None else {"full": full_data(whole)}))
        return
    print(heading)
    print_budget(budget, verbose)
    if whole is not None:
        print_full(whole)
    for verdict in verdicts:
        print_line("expected", verdict)
    if PICTURE in files:
        print(f"picture     {files[PICTURE]}")


def read_frequencies(text: str) -> list[float]:
    """Frequencies [Hz] from a list with commas. Raises ValueError naming the option."""
    return [read_quantity(part, "Hz", "--full") for part in split_names([text])]


def print_full(answer: FullResponse) -> None:
    """Print responses on the meshes, and the part of each that the reduced model leaves out."""
    from femflex.view.units import ARCSECOND

    plant, sizes = answer.plant, {source: answer.sizes(source)[0] for source in answer.full}
    moving = [k for k in range(len(plant.names)) if any(size[:, k].any() for size in sizes.values())]
    factors = [1.0 / ARCSECOND if plant.units[k] == "rad" else 1.0 for k in moving]
    units = ["arcsec" if plant.units[k] == "rad" else plant.units[k] for k in moving]
    heads = [(f"{plant.names[k]}, {unit}", ".4g") for k, unit in zip(moving, units, strict=True)]
    responses = [
        [source, f, *(size[k] * factor for k, factor in zip(moving, factors, strict=True))]
        for source in sizes
        for f, size in zip(answer.frequencies, sizes[source], strict=True)
    ]
    print_table(["meshes, per SI unit of", ("Hz", ".4g"), *heads], responses, keys=2)
    lacking = [
        [source, f, *(f"{row[k]:.2%}" for k in moving)]
        for source in sizes
        for f, row in zip(answer.frequencies, answer.left_out(source), strict=True)
    ]
    names = [plant.names[k] for k in moving]
    print_table(["left out by the modes", ("Hz", ".4g"), *names], lacking, keys=2)
    if answer.kept:
        print_line("as reduced", ", ".join(answer.kept))


def full_data(answer: FullResponse) -> dict[str, Any]:
    """Responses on the meshes as data, in SI: complex amplitudes per component of each source."""
    return {
        "frequencies_hz": answer.frequencies,
        "as_reduced": list(answer.kept),
        "sources": {
            source: {
                "real": answer.full[source].real,
                "imag": answer.full[source].imag,
                "left_out": answer.left_out(source),
            }
            for source in answer.full
        },
    }


def print_budget(budget: Budget, verbose: bool) -> None:
    """Print the tables of a budget: outputs, sources, modes, shocks."""
    from femflex.disturbances import BaseMotion
    from femflex.view.units import ARCSECOND, RPM

    shocks = budget.shocks()
    moving = [k for k in range(len(budget.names)) if budget.rms[k] or any(peaks[0][k] for peaks in shocks.values())]
    names = [budget.names[k] for k in moving]
    factors = [1.0 / ARCSECOND if budget.units[k] == "rad" else 1.0 for k in moving]  # angles in arc seconds
    units = ["arcsec" if budget.units[k] == "rad" else budget.units[k] for k in moving]
    heads = [(f"{name}, {unit}", ".4g") for name, unit in zip(names, units, strict=True)]

    def scaled(values: Any) -> list[float]:
        return [values[k] * factor for k, factor in zip(moving, factors, strict=True)]

    print_line("band", f"{budget.edges[0]:.4g} to {budget.edges[-1]:.4g} Hz, {len(budget.modes)} vibration modes in it")
    if len(moving) < len(budget.names):
        print_line("at rest", ", ".join(name for name in budget.names if name not in names))
    for source, (ratio, frequency) in budget.notches().items():
        print_line("notch", f"{source} by at most {10.0 * math.log10(ratio):.3g} dB, at {frequency:.4g} Hz")
    limits, rows = budget.limits(), []
    for k, name, unit, factor in zip(moving, names, units, factors, strict=True):
        rms, limit = budget.rms[k], limits[k]
        verdict = "" if limit is None else "within" if 3.0 * rms <= limit else "exceeded"
        rows.append([name, unit, rms * factor, 3.0 * rms * factor, None if limit is None else limit * factor, verdict])
    print_table(["output", "unit", ("rms", ".4g"), ("3 sigma", ".4g"), ("limit", ".4g"), ""], rows)
    if budget.contributions:
        by_source = [[source, *scaled(entry.rms)] for source, entry in budget.contributions.items()]
        print_table(["rms by source", *heads], by_source)
        swept = [(source, entry.scan) for source, entry in budget.contributions.items() if entry.scan is not None]
        if swept:
            speeds = [[source, *(scan.speeds[scan.worst_indices[k]] * RPM for k in moving)] for source, scan in swept]
            print_table(["worst speed, rpm", *[(name, ".5g") for name in names]], speeds)
        mode_heads = ["part of the mean square", ("Hz", ".4g"), ("damping ratio", ".3g"), *names]
        print_table(mode_heads, mode_rows(budget, moving, verbose))
    for source, noun in budget.plant.sources.items():
        if isinstance(noun, BaseMotion):
            print_base_modes(budget, source, verbose)
    stress = stress_rows(budget)
    if stress:
        places = [(f"{axis}, m", ".4g") for axis in "xyz"]
        print_table(["rms of stress", "members", "quantity", ("largest", ".4g"), "unit", *places], stress, keys=3)
    for source, (srss, cqc, _) in shocks.items():
        peaks = [[rule, *scaled(values)] for rule, values in (("SRSS", srss), ("CQC", cqc))]
        print_table([f"peaks of shock {source}", *heads], peaks)


def print_base_modes(budget: Budget, source: str, verbose: bool) -> None:
    """Print effective masses and accelerations of the modes under a shaken base, and of all together."""
    from femflex.disturbances import BaseVibration
    from femflex.studies.jitter import base_modes
    from femflex.system.environment import STANDARD_GRAVITY

    modes = base_modes(budget.plant, source)
    shown = [mode for mode in modes if verbose or mode.share >= LEAST_SHARE]
    rows = [[m.name, m.frequency, m.Q, m.mass, f"{m.share:.1%}", m.acceleration / STANDARD_GRAVITY] for m in shown]
    rows.append([
        "all modes", None, None, sum(mode.mass for mode in modes), f"{sum(mode.share for mode in modes):.1%}", None
    ])  # fmt: skip
    rule = "Miles' rms, g" if isinstance(budget.plant.sources[source], BaseVibration) else "peak, g"
    heads = [f"modes under {source}", ("Hz", ".4g"), ("Q", ".4g"), ("effective mass, kg", ".4g"), "", (rule, ".4g")]
    print_table(heads, rows)


def stress_rows(budget: Budget) -> list[list[Any]]:
    """Rows of the largest rms of stress: body, members, quantity, value, unit, and its place [m]."""
    from femflex.studies.jitter import stress_peaks

    return [
        [body, peak.group or peak.kind, peak.name, peak.value, peak.unit, *peak.place]
        for body in budget.plant.table.stress
        for peak in stress_peaks(budget, body)
    ]


def mode_rows(budget: Budget, outputs: Sequence[int], verbose: bool) -> list[list[Any]]:
    """Rows of the modes with their parts of the mean squares of outputs, largest first, and of what is no mode."""
    import numpy as np

    squares = budget.mean_squares[list(outputs)]
    shares = budget.by_mode[:, list(outputs)] / np.where(squares > 0.0, squares, np.inf)
    largest = np.abs(shares[:-1]).max(axis=1, initial=0.0)
    order = np.argsort(-largest, kind="stable")
    if not verbose:
        order = order[largest[order] >= LEAST_SHARE][:SHOWN]
    rows: list[list[Any]] = [
        [budget.modes[k].name, budget.modes[k].frequency, budget.modes[k].damping_ratio, *_percents(shares[k])]
        for k in order
    ]
    rest = shares.sum(axis=0) - shares[order].sum(axis=0)
    return [*rows, ["rigid motion and the rest", None, None, *_percents(rest)]]


def _percents(shares: Any) -> list[str]:
    """Shares as text, nothing for what rounds to zero."""
    return [f"{share:.1%}" if abs(share) >= LEAST_SHARE else "" for share in shares]


def budget_data(budget: Budget) -> dict[str, Any]:
    """A budget as data, in SI."""
    from femflex.disturbances import BaseMotion
    from femflex.studies.jitter import base_modes

    limits = budget.limits()
    return {
        "band_hz": [budget.edges[0], budget.edges[-1]],
        "outputs": [
            {"name": name, "unit": unit, "rms": rms, "three_sigma": 3.0 * rms, "limit": limit}
            for name, unit, rms, limit in zip(budget.names, budget.units, budget.rms, limits, strict=True)
        ],
        "sources": {
            source: {
                "rms": entry.rms,
                "mean_square_by_mode": entry.by_mode,
                "lines": [{"frequency_hz": f, "mean_square": square} for f, square in entry.at_lines],
                "worst_speed": None if entry.scan is None else entry.scan.speeds[entry.scan.worst_indices],
                "rms_over_range": None if entry.scan is None else entry.scan.mean_over_range**0.5,
            }
            for source, entry in budget.contributions.items()
        },
        "modes": [
            {"name": mode.name, "frequency_hz": mode.frequency, "damping_ratio": mode.damping_ratio}
            for mode in budget.modes
        ],
        "stress_rms": [
            dict(zip(("body", "members", "quantity", "largest", "unit", "x_m", "y_m", "z_m"), row, strict=True))
            for row in stress_rows(budget)
        ],
        "base_modes": {
            source: [vars(mode) for mode in base_modes(budget.plant, source)]
            for source, noun in budget.plant.sources.items()
            if isinstance(noun, BaseMotion)
        },
        "shocks": {
            source: {"srss": srss, "cqc": cqc, "by_mode": each} for source, (srss, cqc, each) in budget.shocks().items()
        },
    }
