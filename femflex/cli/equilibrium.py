"""`femflex equilibrium`: where a craft is at rest under its loads, in steady spin, or in orbit."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from femflex.cli.advice_lines import print_notes, strain_data
from femflex.cli.progress import Patience
from femflex.cli.tables import print_json, print_table
from femflex.cli.times import read_seconds
from femflex.cli.verb import verb

if TYPE_CHECKING:
    from femflex.dynamics.equilibria.equilibrium import Equilibrium

SHOWN = 24  # coordinates printed; all are in the file and in --json
XYZ = ("x", "y", "z")


@verb("femflex equilibrium cases/elastica.toml -o eq.h5")
def equilibrium(
    case: Annotated[Path, typer.Argument(help="Case file (TOML).", show_default=False)],
    output: Annotated[
        Path | None, typer.Option("-o", "--output", help="Result file (HDF5) to draw, or to start a run from.")
    ] = None,
    at: Annotated[
        str | None,
        typer.Option("--at", help="Time at which loads that vary are taken: seconds, or a text such as '2 min'."),
    ] = None,
    stable: Annotated[
        bool,
        typer.Option("--stable", help="From an unstable equilibrium, follow the growing motion to a stable one."),
    ] = False,
    force: Annotated[bool, typer.Option("--force", help="Overwrite an existing file.")] = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print for programs.")] = False,
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
        from femflex.dynamics.equilibria.equilibrium import EquilibriumError
        from femflex.pipeline.balanced import balanced, decided_at_rest, keep

        read = read_case(case)
        decided = decided_at_rest(read)
        try:
            found = balanced(decided, time, stable)
        except EquilibriumError as error:
            if output is not None:
                keep(error.last, read, output, force=force, ended=str(error), decided=decided)
                raise type(error)(
                    f"{error} {output} keeps the last state, and is marked incomplete.", error.last
                ) from None
            raise
    if output is not None:
        keep(found, read, output, force=force, decided=decided)
    if as_json:
        print_json(equilibrium_data(found) | {"bodies": strain_data(decided)})
        return
    print(read.title or case.name)
    print_notes(decided.notes)
    print_equilibrium(found)
    if output is not None:
        print(f"kept        {output}")


def print_equilibrium(found: Equilibrium) -> None:
    """Print coordinates, marker positions, residual and stability."""
    system = found.model.system
    names = [(name, unit) for name, unit in system.coordinate_names()]
    rows = [[name, f"{value:.10g}", unit] for (name, unit), value in zip(names, found.q, strict=True)]
    if len(rows) > SHOWN:
        parts = {piece for pieces in system.segments.values() for piece in pieces}
        rows = [row for row in rows if row[0].rpartition(".delta")[0] not in parts][:SHOWN]
    if rows:
        print_table(["coordinate", "value", "unit"], rows)
    if len(rows) < len(names):
        shown = {row[0] for row in rows}
        elastic = all(name.rpartition(".delta")[1] for name, _ in names if name not in shown)
        what = "elastic" if elastic else "other"
        print(f"and {len(names) - len(rows)} {what} coordinates, which --json and the result file hold\n")
    print_table(
        ["marker", *(f"{a}, m" for a in XYZ), *(f"deflection {a}, m" for a in XYZ)],
        [
            [label, *(f"{v:.9g}" for v in (*place["position"], *place.get("deflection", (0.0, 0.0, 0.0))))]
            for label, place in markers(found).items()
        ],
    )
    print(f"frame       {frame_text(found)}")
    for line in length_lines(found):
        print(line)
    print(f"residual    {found.residual:.2e} of the largest force, after {found.iterations} iterations")
    for name, loop in loops(found).items():
        force, torque = (math.hypot(*loop[key]) for key in ("force", "torque"))
        print(f"loop        {name} carries {force:.6g} N and {torque:.6g} N m")
    if found.model.constraints is not None:
        print(f"loops       closed to {found.gap:.1e} m")
    if found.left is not None:
        print(f"left        an equilibrium that is {found.left.verdict}")
    print_stability(found)
    if not found.stable:
        print("            --stable leaves it, along the motion that grows")


def print_stability(found: Equilibrium) -> None:
    """Print the verdict, the growth rate and its threshold, and the motions that neither grow nor decay."""
    print(f"stability   {found.verdict}")
    if len(found.eigenvalues):
        from femflex.dynamics.equilibria.small_motions import growth_rule

        print(f"growth      largest growth rate {found.growth:.3g} 1/s; {growth_rule()}")
    if found.share == 1.0 and found.motions.known:
        counts: dict[str, int] = {}
        for motion in found.motions.known:
            counts[motion.name] = counts.get(motion.name, 0) + 1
        names = [name + f" ({count} directions)" * (count > 1) for name, count in counts.items()]
        print(f"rigid       {', '.join(names)}: neither grow nor decay")


def markers(found: Equilibrium) -> dict[str, dict[str, Any]]:
    """Position and deflection (3,) of every marker by its label; no rounding noise."""
    seen = found.model.observe([0.0], found.x[None])  # type: ignore[arg-type]
    size = max((abs(seen[path][0]).max() for path in seen if path.startswith("markers/")), default=0.0)
    out: dict[str, dict[str, Any]] = {}
    for path, values in seen.items():
        head, _, key = path.rpartition("/")
        if head.startswith("markers/") and key in ("position", "deflection"):
            row = values[0]
            out.setdefault(head.removeprefix("markers/"), {})[key] = [
                0.0 if abs(v) < 1e-13 * size else float(v) for v in row
            ]
    return out


def loops(found: Equilibrium) -> dict[str, dict[str, list[float]]]:
    """Force and torque (3,) that every loop carries at its child's marker, by its name."""
    if found.model.constraints is None:
        return {}
    seen = found.model.observe([0.0], found.x[None])  # type: ignore[arg-type]
    names = [loop.label for loop in found.model.system.loops]
    return {
        name: {key: [float(v) for v in seen[f"loops/{name}/{key}"][0]] for key in ("force", "torque")} for name in names
    }


def frame_text(found: Equilibrium) -> str:
    """In which frame the craft is at rest."""
    frame = found.model.system.frame
    if frame.kind == "spinning":
        return f"at rest in the frame that spins at [{', '.join(f'{v:.6g}' for v in frame.rate)}] rad/s"
    if frame.kind == "orbital" and found.model.system.orbit is not None:
        return f"at rest in the orbital frame, period {found.model.system.orbit.period:.6g} s"
    return "at rest in the inertial frame"


def length_lines(found: Equilibrium) -> list[str]:
    """A line per deploying body on the length at which it stays."""
    from femflex.system.fixed_length import fixed_lengths

    lengths = fixed_lengths(found.model.system)
    return [f"length      of {name} stays at {length:.6g} m" for name, length in lengths.items()]


def equilibrium_data(found: Equilibrium) -> dict[str, Any]:
    """What --json prints."""
    from femflex.system.fixed_length import fixed_lengths

    names = [name for name, _ in found.model.system.coordinate_names()]
    return {
        "coordinates": dict(zip(names, found.q, strict=True)),
        "markers": markers(found),
        "frame": found.model.system.frame.kind,
        "lengths": fixed_lengths(found.model.system),
        "residual": found.residual,
        "iterations": found.iterations,
        "loops": loops(found),
        "gap": found.gap,
        "neutral": list(found.neutral),
        "stable": found.stable,
        "growth": found.growth,
        "growth_threshold": found.growth_threshold,
        "rigid": [motion.name for motion in found.motions.known] if found.share == 1.0 else [],
        "left_growth": None if found.left is None else found.left.growth,
        "eigenvalues": [[float(v.real), float(v.imag)] for v in found.eigenvalues],
    }
