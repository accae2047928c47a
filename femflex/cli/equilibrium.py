"""`femflex equilibrium`: where a craft is at rest under its loads, in steady spin, or in orbit."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from femflex.cli.options import At, CaseFile, Force, Json, Verbose, read_seconds
from femflex.cli.progress import Patience
from femflex.cli.tables import print_folded, print_line, print_reasons, print_table, print_title, printed, record
from femflex.cli.verb import verb

if TYPE_CHECKING:
    from femflex.linear.equilibrium import Equilibrium

SHOWN = 24  # coordinates printed; all are in the file and in --json


@verb("femflex equilibrium cases/elastica.toml -o eq.h5")
def equilibrium(
    case: CaseFile,
    output: Annotated[
        Path | None, typer.Option("-o", "--output", help="Result file (HDF5) to draw, or to start a run from.")
    ] = None,
    at: At = None,
    stable: Annotated[
        bool,
        typer.Option("--stable", help="From an unstable equilibrium, follow the growing motion to a stable one."),
    ] = False,
    force: Force = False,
    verbose: Verbose = False,
    as_json: Json = False,
) -> None:
    """Find the equilibrium nearest to a case's initial state, and whether it is stable with the damping of the case.

    At rest on the ground, in a spinning frame (steady spin), or in the orbital frame of a circular orbit. A run starts
    from it with [initial] from = "eq.h5", or "equilibrium". Exit code 3: none was found; the last
    converged load step is saved in the output file.
    """
    from femflex.writing import check_destination

    time = read_seconds(at, "--at")
    if output is not None:
        check_destination(output, force)
    with Patience("building bodies and compiling the equations of motion"):
        from femflex.case import read_case
        from femflex.linear.equilibrium import EquilibriumError
        from femflex.pipeline.case_equilibrium import case_equilibrium, resolve_at_rest, write_equilibrium

        parsed_case = read_case(case)
        resolved = resolve_at_rest(parsed_case)
        try:
            state = case_equilibrium(resolved, time, stable)
        except EquilibriumError as error:
            if output is not None:
                write_equilibrium(error.last, parsed_case, output, force=force, ended=str(error), resolved=resolved)
                raise type(error)(
                    f"{error} {output} keeps the last state, and is marked incomplete.", error.last
                ) from None
            raise
    if output is not None:
        write_equilibrium(state, parsed_case, output, force=force, resolved=resolved)
    with printed(as_json):
        print_title(parsed_case.title or case.name)
        print_reasons(resolved, verbose)
        print_equilibrium(state, verbose)
        if output is not None:
            print_line("kept", output)


def print_equilibrium(state: Equilibrium, verbose: bool) -> None:
    """Print coordinates, verbose: also those that are zero, marker positions, residual and stability."""
    names = state.model.system.coordinate_names()
    rows = [[name, value, unit] for (name, unit), value in zip(names, state.q, strict=True)]
    if not record("coordinates", {name: value for name, value, _ in rows}):
        print_coordinates(rows, state, verbose)
    heads = [(f"{quantity}{axis}, m", ".9g") for quantity in ("", "deflection ") for axis in "xyz"]
    markers = [
        [label, *position["position"], *position.get("deflection", (0.0, 0.0, 0.0))]
        for label, position in marker_positions(state).items()
    ]
    print_table(["marker", *heads], markers)
    print_about(state, label="frame")
    iterations = f"{state.residual:.2e} of the largest force, after {state.iterations} iterations"
    print_line("residual", iterations, state.residual)
    for name, loop in loop_forces(state).items():
        force, torque = (math.hypot(*loop[key]) for key in ("force", "torque"))
        print_line("loop", f"{name} carries {force:.6g} N and {torque:.6g} N m", [{"name": name, **loop}])
    if state.model.constraints is not None:
        print_line("loops", f"closed to {state.gap:.1e} m", state.gap)
    if state.left is not None:
        print_line("left", f"an equilibrium that is {state.left.verdict}", state.left.growth)
    print_stability(state)
    if not state.stable:
        print_folded("            --stable leaves it, along the motion that grows")


def print_coordinates(rows: list[list[Any]], state: Equilibrium, verbose: bool) -> None:
    """Print names, values and units of coordinates, verbose: also those that are zero."""
    shown = rows if verbose else [row for row in rows if row[1] != 0.0]
    if len(shown) > SHOWN:
        segment_names = {piece for pieces in state.model.system.segments.values() for piece in pieces}
        shown = [row for row in shown if row[0].rpartition(".delta")[0] not in segment_names][:SHOWN]
    if shown:
        print_table(["coordinate", ("value", ".10g"), "unit"], shown)
    if rest := [row for row in rows if row not in shown]:
        zero = "" if any(value for _, value, _ in rest) else " that are zero"
        print_folded(f"and {len(rest)} coordinates{zero}, which -v, --json and the result file list\n")


def print_about(state: Equilibrium, left_out: Sequence[str] = (), label: str = "about") -> None:
    """Print the frame and the lengths of the equilibrium that something is about, and the loads that it leaves out."""
    from femflex.system.fixed_length import fixed_lengths

    print_line(label, frame_text(state))
    for name, length in fixed_lengths(state.model.system).items():
        print_line("length", f"of {name} stays at {length:.6g} m", [{"body": name, "length": length}])
    if left_out:
        text = f"{', '.join(left_out)}. Time-varying loads are ignored here; --at TIME freezes them"
        print_line("left out", text, list(left_out))


def print_stability(state: Equilibrium) -> None:
    """Print the verdict, the growth rate and its threshold, and the rigid-body motions that neither grow nor decay."""
    named = state.share == 1.0 and state.motions.known  # as motions, below
    print_line("stability", state.stability if named else state.verdict)
    record("stable", state.stable)
    record("eigenvalues", state.eigenvalues)
    if len(state.eigenvalues):
        from femflex.linear.small_motions import growth_rule

        print_line("growth", f"largest growth rate {state.growth:.3g} 1/s; {growth_rule()}", state.growth)
    if named:
        counts = Counter(motion.name for motion in state.motions.known)
        names = [name + f" ({count} directions)" * (count > 1) for name, count in counts.items()]
        print_line("rigid", f"{', '.join(names)}: neither grow nor decay", list(counts))


def marker_positions(state: Equilibrium) -> dict[str, dict[str, Any]]:
    """Position and deflection (3,) of every marker by its label; no rounding noise."""
    channels = state.model.observe([0.0], state.x[None])  # type: ignore[arg-type]
    size = max((abs(channels[path][0]).max() for path in channels if path.startswith("markers/")), default=0.0)
    positions: dict[str, dict[str, Any]] = {}
    for path, values in channels.items():
        head, _, key = path.rpartition("/")
        if head.startswith("markers/") and key in ("position", "deflection"):
            row = values[0]
            positions.setdefault(head.removeprefix("markers/"), {})[key] = [
                0.0 if abs(v) < 1e-13 * size else float(v) for v in row
            ]
    return positions


def loop_forces(state: Equilibrium) -> dict[str, dict[str, Any]]:
    """Force and torque (3,) that every loop carries at its child's marker, by its name."""
    if state.model.constraints is None:
        return {}
    channels = state.model.observe([0.0], state.x[None])  # type: ignore[arg-type]
    names = [loop.label for loop in state.model.system.loops]
    return {name: {key: channels[f"loops/{name}/{key}"][0] for key in ("force", "torque")} for name in names}


def frame_text(state: Equilibrium) -> str:
    """Name the frame in which the craft is at rest."""
    frame = state.model.system.frame
    if frame.kind == "spinning":
        return f"at rest in the frame that spins at [{', '.join(f'{v:.6g}' for v in frame.rate)}] rad/s"
    if frame.kind == "orbital" and state.model.system.orbit is not None:
        return f"at rest in the orbital frame, period {state.model.system.orbit.period:.6g} s"
    return "at rest in the inertial frame"
