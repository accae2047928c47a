"""`femflex equilibrium`: where a craft is at rest under its loads, in steady spin, or in orbit."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from femflex.cli.advice_lines import print_reasons, strain_data
from femflex.cli.options import At, CaseFile, Force, Json, Verbose, read_seconds
from femflex.cli.progress import Patience
from femflex.cli.tables import print_folded, print_json, print_line, print_table
from femflex.cli.verb import verb

if TYPE_CHECKING:
    from femflex.dynamics.linear.equilibrium import Equilibrium

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
        from femflex.dynamics.linear.equilibrium import EquilibriumError
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
    if as_json:
        print_json(equilibrium_data(state) | {"bodies": strain_data(resolved)})
        return
    print(parsed_case.title or case.name)
    print_reasons(resolved, verbose)
    print_equilibrium(state, verbose)
    if output is not None:
        print(f"kept        {output}")


def print_equilibrium(state: Equilibrium, verbose: bool) -> None:
    """Print coordinates, verbose: also those that are zero, marker positions, residual and stability."""
    system = state.model.system
    names = system.coordinate_names()
    rows: list[list[Any]] = [
        [name, float(f"{value:.10g}"), unit] for (name, unit), value in zip(names, state.q, strict=True)
    ]
    values = {name: value for name, value, _ in rows}
    if not verbose:
        rows = [row for row in rows if row[1] != 0.0]
    if len(rows) > SHOWN:
        segment_names = {piece for pieces in system.segments.values() for piece in pieces}
        rows = [row for row in rows if row[0].rpartition(".delta")[0] not in segment_names][:SHOWN]
    if rows:
        print_table(["coordinate", ("value", ".10g"), "unit"], rows)
    if len(rows) < len(names):
        rest = [value for name, value in values.items() if name not in {row[0] for row in rows}]
        zero = "" if any(rest) else " that are zero"
        print(f"and {len(rest)} coordinates{zero}, which -v, --json and the result file list\n")
    heads = [(f"{quantity}{axis}, m", ".9g") for quantity in ("", "deflection ") for axis in "xyz"]
    print_table(
        ["marker", *heads],
        [
            [label, *position["position"], *position.get("deflection", (0.0, 0.0, 0.0))]
            for label, position in marker_positions(state).items()
        ],
    )
    print_line("frame", frame_text(state))
    for line in length_lines(state):
        print_folded(line)
    print_folded(f"residual    {state.residual:.2e} of the largest force, after {state.iterations} iterations")
    for name, loop in loop_forces(state).items():
        force, torque = (math.hypot(*loop[key]) for key in ("force", "torque"))
        print_folded(f"loop        {name} carries {force:.6g} N and {torque:.6g} N m")
    if state.model.constraints is not None:
        print(f"loops       closed to {state.gap:.1e} m")
    if state.left is not None:
        print(f"left        an equilibrium that is {state.left.verdict}")
    print_stability(state)
    if not state.stable:
        print("            --stable leaves it, along the motion that grows")


def print_stability(state: Equilibrium) -> None:
    """Print the verdict, the growth rate and its threshold, and the rigid-body motions that neither grow nor decay."""
    named = state.share == 1.0 and state.motions.known  # as motions, below
    print_folded(f"stability   {state.stability if named else state.verdict}")
    if len(state.eigenvalues):
        from femflex.dynamics.linear.small_motions import growth_rule

        print_folded(f"growth      largest growth rate {state.growth:.3g} 1/s; {growth_rule()}")
    if named:
        counts: dict[str, int] = {}
        for motion in state.motions.known:
            counts[motion.name] = counts.get(motion.name, 0) + 1
        names = [name + f" ({count} directions)" * (count > 1) for name, count in counts.items()]
        print_folded(f"rigid       {', '.join(names)}: neither grow nor decay")


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


def length_lines(state: Equilibrium) -> list[str]:
    """A line per deploying body on the length at which it stays."""
    from femflex.system.fixed_length import fixed_lengths

    lengths = fixed_lengths(state.model.system)
    return [f"length      of {name} stays at {length:.6g} m" for name, length in lengths.items()]


def equilibrium_data(state: Equilibrium) -> dict[str, Any]:
    """Return the equilibrium for --json."""
    from femflex.system.fixed_length import fixed_lengths

    names = [name for name, _ in state.model.system.coordinate_names()]
    return {
        "coordinates": dict(zip(names, state.q, strict=True)),
        "markers": marker_positions(state),
        "frame": state.model.system.frame.kind,
        "lengths": fixed_lengths(state.model.system),
        "residual": state.residual,
        "iterations": state.iterations,
        "loops": loop_forces(state),
        "gap": state.gap,
        "neutral": list(state.neutral),
        "stable": state.stable,
        "growth": state.growth,
        "growth_threshold": state.growth_threshold,
        "rigid": [motion.name for motion in state.motions.known] if state.share == 1.0 else [],
        "left_growth": None if state.left is None else state.left.growth,
        "eigenvalues": state.eigenvalues,
    }
