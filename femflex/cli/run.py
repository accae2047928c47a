"""`femflex run`: a case to its result file, with what a reader wants to see of it on the way."""

from __future__ import annotations

from contextlib import nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from femflex.cli.progress import Bar, Patience
from femflex.cli.second_run import check_left_out, second_output, second_run
from femflex.cli.verb import complain, verb

if TYPE_CHECKING:
    from femflex.case import Case
    from femflex.pipeline import Prepared
    from femflex.results import Run
    from femflex.system import System

ENERGIES = ("kinetic", "elastic", "spring", "load")  # whose sizes the energy's change is measured by
MOVED = 4  # initial values told on screen when the start moves them


@verb("femflex run cases/orbiter_beam.toml -o run.h5")
def run(
    case: Annotated[Path, typer.Argument(help="Case file (TOML).", show_default=False)],
    output: Annotated[Path, typer.Option("-o", "--output", help="Result file (HDF5).")] = Path("run.h5"),
    resume: Annotated[bool, typer.Option("--resume", help="Go on with the unfinished run in the output file.")] = False,
    force: Annotated[bool, typer.Option("--force", help="Overwrite existing files.")] = False,
    without: Annotated[
        str,
        typer.Option(
            "--without", help="Switch off by name: gravity_gradient,gyroscopic, a load, flexibility, nonlinear_strain."
        ),
    ] = "",
    no_pictures: Annotated[
        bool, typer.Option("--no-pictures", help="Leave out the pictures the case asks for.")
    ] = False,
) -> None:
    """Simulate a case: mesh to modes to motion to HDF5, with the pictures and the \\[campbell] the case asks for.

    Exit code 2: the case cannot be run; 3: the numerics failed, 130: interrupted, with what was computed kept.
    """
    from femflex import pipeline
    from femflex.case import read_case

    with Patience("reading the case") as told:
        read = read_case(case)
        if resume and pipeline.is_finished(read, output):
            print(f"done        {output} is complete already; there is nothing to resume (--force runs it anew)")
            return
        with pipeline.wrong_names_first(read, named(without)):
            pipeline.check_output(read, output, force=force, resume=resume)
            if not no_pictures:
                check_pictures(read, output, force=force)
        told(
            "building bodies and compiling the equations of motion (the first run of an installation takes about a "
            "minute)"
        )
        prepared = pipeline.prepare(read, output, force=force, resume=resume, without=named(without))
        if not no_pictures:
            check_left_out(prepared)
        prepared.load_kernels()
    say_what_runs(prepared)
    with Bar("integrating", float(prepared.times[-1])) as bar:
        try:
            pipeline.integrate(prepared, output, force=force, resume=resume, progress=bar)
        except KeyboardInterrupt:
            raise KeyboardInterrupt(_what_is_kept(output)) from None
    from femflex.results import open_run

    with open_run(output) as done:
        say_what_came_out(done, prepared.system, output)
        missed = say_verdicts(read, done)
        if not no_pictures:
            draw_pictures(prepared, done, output, force)
    if read.campbell is not None and not (no_pictures or without):
        from femflex.cli.campbell import leave_beside

        missed += leave_beside(read, output, force)
    if missed:
        complain(
            f"warning: the run is done, but what the case expects of {', '.join(missed)} does not hold; either "
            f"something has changed, or [expect] has to"
        )


def _what_is_kept(output: Path) -> str:
    """What an interrupted run left, and how it goes on; nothing where it had no row yet."""
    from femflex.results import open_run

    if not output.exists():
        return "interrupted before the first row"
    with open_run(output) as run:
        if run.ended != "interrupted":  # the file of an earlier run, not yet overwritten
            return "interrupted before the first row"
        return f"interrupted; {output} keeps {len(run)} rows, to {run.time[-1]:.6g} s, and --resume goes on from there"


def named(text: str) -> list[str]:
    """The names in a list with commas."""
    return [name.strip() for name in text.split(",") if name.strip()]


def say_what_runs(prepared: Prepared) -> None:
    """Print modes, orbit, attitude and the integrator with the reason it was chosen."""
    from femflex.cli.modes import alike, print_modes

    case, system = prepared.case, prepared.system
    print(case.title or case.path.name)
    if prepared.model.omitted:
        print(f"without {', '.join(prepared.model.omitted)}")
    pieces = {piece for parts in system.segments.values() for piece in parts}
    whole = {name: body for name, body in system.bodies.items() if body.n_modes and name not in pieces}
    for names, body in alike(whole):
        print()
        print_modes(names, body)
    print()
    for name, parts in system.segments.items():
        each = system.bodies[parts[0]].n_modes
        print(f"body        {name} is cut into {len(parts)} segments of {each} elastic coordinates each")
    for name, body in system.bodies.items():
        if body.note and name not in pieces:
            print(f"body        {name}: {body.note}")
    for line in (*_orbit_lines(prepared), _attitude_line(prepared)):
        print(line)
    step = f"{len(prepared.times)} rows to {prepared.times[-1]:.6g} s"
    print(f"integrator  {prepared.reason}")
    if (held := prepared.model.constraints) is not None:
        print(f"constraints {held.told(0.0, prepared.model.x0)}")
        for misfit in prepared.taken_up:
            print(f"constraints {misfit}")
        say_what_moved(prepared)
    print(f"output      {step}")


def say_what_moved(prepared: Prepared) -> None:
    """Print what was changed of the initial values to make them consistent with loops and constraints."""
    moved = prepared.moved
    told = ", ".join(map(str, moved[:MOVED]))
    if len(moved) > MOVED:
        told += f", and {len(moved) - MOVED} more (all in the file's attribute `start_moved`)"
    if moved:
        print(f"start       made consistent: {told}")


def _orbit_lines(prepared: Prepared) -> list[str]:
    from math import degrees

    orbit, table = prepared.system.orbit, prepared.case.orbit
    if orbit is None:
        g = prepared.system.environment.gravity
        told = [f"gravity     ({', '.join(f'{a:.6g}' for a in g)}) m/s^2, inertial axes"] if g.any() else []
        return ["orbit       none", *told]
    altitude = (table.perigee_radius - table.radius) / 1e3
    text = (
        f"orbit       {table.kind}, perigee {altitude:.6g} km over {table.radius / 1e3:.6g} km, e = "
        f"{orbit.eccentricity:.6g}"
    )
    motion = (
        f"            period {orbit.period:.6g} s, n = {orbit.mean_motion:.6g} rad/s, begins at anomaly "
        f"{degrees(orbit.true_anomaly):.4g} deg"
    )
    return [text, motion]


def _attitude_line(prepared: Prepared) -> str:
    from math import degrees

    case, system = prepared.case, prepared.system
    seen = prepared.model.observe(prepared.times[:1], prepared.model.x0[None])
    angles = [degrees(a) + 0.0 for a in seen["attitude/angles"][0]]  # no -0
    names = prepared.model.channels["attitude/angles"].names
    told = ", ".join(f"{name} {angle:.4g}" for name, angle in zip(names, angles, strict=True))
    how = "held" if case.attitude.held else system.joint_of(system.root).kind
    root = next((name for name, parts in system.segments.items() if system.root in parts), system.root)
    return f"attitude    {root} {how} in the {system.frame.kind} frame: {told} deg"


def say_what_came_out(run: Run, system: System, output: Path) -> None:
    """Print how the run ended and how far its monitors drifted."""
    import numpy as np

    s = run.statistics
    print(
        f"done        {output}: {s.get('accepted', 0)} steps, {s.get('rejected', 0)} rejected, "
        f"{s.get('evaluations', 0)} evaluations"
    )
    for line in latch_lines(run):
        print(line)
    for path in conserved(run, system):
        value = run[path]
        change = float(np.abs(value - value[0]).max())
        shares = [f"monitors/{kind}" for kind in ENERGIES] if path == "monitors/energy" else [path]
        size = max(float(np.abs(run[share]).max()) for share in shares if share in run)
        relative = f", {change / size:.2e} of its size" if size > 0 else ""
        print(
            f"monitor     {path.split('/')[1].replace('_', ' ')} changed by up to {change:.3e} "
            f"{run.unit(path)}{relative}"
        )
    if "monitors/constraint_position" in run:
        gap, speed = (float(run[f"monitors/constraint_{what}"].max()) for what in ("position", "velocity"))
        print(f"monitor     constraint largest gap {gap:.3e} m, largest velocity residual {speed:.3e} m/s")
    print(f"monitor     Euler parameters off unit length by up to {np.abs(run['monitors/quaternion_norm']).max():.2e}")


def latch_lines(run: Run) -> list[str]:
    """A line per latch: when it locked and what was lost."""
    out = []
    for path in sorted(name for name in run if name.startswith("latches/") and name.endswith("/time")):
        name, at = path.split("/")[1], float(run[path][-1])
        if at < 0:
            out.append(f"latch       {name} did not lock")
        else:
            loss = float(run[f"latches/{name}/loss"][-1])
            out.append(f"latch       {name} locked at t = {at:.9g} s, {loss:.6g} J lost")
    return out


def conserved(run: Run, system: System) -> list[str]:
    """The monitors that ought to be constant: none under loads that have no potential and under damping.

    Without orbit energy, and angular momentum unless a joint holds the craft; on a free orbit energy; on a specified
    circular one the Jacobi integral.
    """
    import numpy as np

    from femflex.dynamics.joints.law_report import is_damped
    from femflex.dynamics.reports.channels import conservative_loads

    led = any(profile.moves for joint in system.joints for profile in joint.held.values())
    working = any(spring.damping for spring in system.springs) or any(c.function for c in system.constraints)
    weights = conservative_loads(system)
    if len(weights) < len(system.loads) or led or working or is_damped(system):
        return []
    if set(run.without) & {"coriolis_centrifugal", "gyroscopic", "specified_motion", "gravity_gradient"}:
        return []
    if "orbit/radius" not in run:
        roots = [joint for joint in system.joints if joint.parent is None]
        parents = [tie.parent for ties in (system.loops, system.constraints, system.springs) for tie in ties]
        tied = None in parents
        adrift = len(roots) == 1 and roots[0].n_u - len(roots[0].held) == 6 and not roots[0].stiffness.any()
        adrift = adrift and not (tied or weights)
        fixed = system.frame.kind == "inertial"
        return ["monitors/energy"] * fixed + ["monitors/angular_momentum"] * adrift
    if system.orbit is not None and system.orbit.free:
        return ["monitors/energy"]
    circular = np.ptp(run["orbit/radius"]) < 1e-9 * run["orbit/radius"][0]
    return ["monitors/jacobi"] if circular else []


def say_verdicts(case: Case, run: Run) -> list[str]:
    """Names of the expectations of the case that do not hold; prints all of them. They are those of the full case."""
    if run.without:
        if case.expect.answers:
            print("expected    not judged: the expectations are those of the full case")
        return []
    from femflex.case.verdicts import judged

    verdicts = judged(case, run)
    for verdict in verdicts:
        print(f"expected    {verdict}")
    return [verdict.name for verdict in verdicts if not verdict.holds]


def draw_pictures(prepared: Prepared, run: Run, output: Path, force: bool) -> None:
    """Draw what the case asks for; where no renderer can start, say so and keep the run."""
    from femflex.cli.pictures import draw
    from femflex.view import NoRenderer

    case = prepared.case
    if case.pictures is None:
        return
    try:
        with second_run(case, output, force) if not run.without else nullcontext() as other:
            for path in draw(case.pictures, run, prepared.system.bodies, output, force=force, other=other):
                print(f"picture     {path}")
    except NoRenderer as error:
        complain(f"no pictures: {error}; the run is kept in {output}")


def check_pictures(case: Case, output: Path, force: bool) -> None:
    """Raise FileExistsError when a picture the case asks for exists already, unless force."""
    from femflex.cli.pictures import names

    if force:
        return
    wanted = [] if case.pictures is None else names(case.pictures, output)
    if (second := second_output(case, output)) is not None:
        wanted.append(second)
    if case.campbell is not None:
        from femflex.cli.campbell import beside

        wanted += beside(output)
    there = [str(path) for path in wanted if path.exists()]
    if there:
        raise FileExistsError(
            f"{', '.join(there)} exist{'s' * (len(there) == 1)}; choose another --output, --no-pictures, or force "
            f"to overwrite"
        )
