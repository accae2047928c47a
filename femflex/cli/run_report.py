"""Texts that `femflex run` prints before and after the integration."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING

from femflex.cli.tables import print_folded, print_line

if TYPE_CHECKING:
    from femflex.arrays import Array, BoolArray
    from femflex.body import FlexibleBody
    from femflex.case import Case
    from femflex.measures.verdicts import Verdict
    from femflex.pipeline import Prepared
    from femflex.results import Run
    from femflex.system import System


RELEASED = -2.0  # minus the time at which it opened, in place of the time, of a latch that has opened
MOVED = 4  # initial values listed on screen when the start moves them
SWINGING = 0.1  # rad left to the singularity: nearer than this two of the angles move ten times as far as the craft


def print_run_heading(prepared: Prepared, verbose: bool) -> None:
    """Print the bodies, orbit, attitude and integrator; verbose: with tables of modes, and the reasons of choices."""
    from femflex.assembly.system import craft_notes
    from femflex.cli.modes import group_equal_bodies, print_modes
    from femflex.cli.tables import print_reasons
    from femflex.integrate.choice import KINDS

    case, system = prepared.case, prepared.system
    print(case.title or case.path.name)
    if prepared.model.omitted:
        print(f"without {', '.join(prepared.model.omitted)}")
    pieces = {piece for segment_names in system.segments.values() for piece in segment_names}
    unsegmented = {name: body for name, body in system.bodies.items() if body.n_modes and name not in pieces}
    for names, body in group_equal_bodies(unsegmented):
        if verbose:
            print()
            print_modes(names, body, verbose)
        else:
            size = f"{body.n_modes} coordinates{_frequency_range(body)}"
            print_folded(f"body        {names}: {size}, {body.strain_form} strain")
    if verbose:
        print()
    for name, segment_names in system.segments.items():
        count = system.bodies[segment_names[0]].n_modes
        size = f"{len(segment_names)} segments of {count} elastic coordinates each"
        print_folded(f"body        {name} is cut into {size}")
    if verbose:
        if "nonlinear_strain" not in prepared.model.omitted:
            print_reasons(prepared.resolved, verbose)
        for line in craft_notes(case):
            print_folded(f"craft       {line}")
    for line in (*_orbit_lines(prepared), _attitude_line(prepared)):
        print(line)
    step = f"{len(prepared.times)} rows to {prepared.times[-1]:.6g} s"
    name = prepared.integrator.name
    print_folded(f"integrator  {prepared.reason if verbose else f'{name} ({KINDS[name]})' if name in KINDS else name}")
    print_tolerances(prepared, verbose)
    if (constraints := prepared.model.constraints) is not None:
        print_folded(f"constraints {constraints.text(0.0, prepared.model.x0)}")
        for misfit in prepared.absorbed_misfits:
            print_folded(f"constraints {misfit}")
        print_moved_start(prepared)
    print(f"output      {step}")


def _frequency_range(body: FlexibleBody) -> str:
    """Describe the lowest and the highest frequency of a body's modes."""
    import numpy as np

    frequencies = body.omega[np.isfinite(body.omega)] / (2.0 * np.pi)
    return f", {frequencies.min():.4g} to {frequencies.max():.4g} Hz" if len(frequencies) else ""


def print_tolerances(prepared: Prepared, verbose: bool) -> None:
    """Print the relative tolerance; verbose: and the absolute ones of each kind of coordinate and its rate."""
    from femflex.dynamics.motion.motion_scale import KINDS, coordinate_kinds
    from femflex.integrate.driver import Adaptive

    model, method = prepared.model, prepared.integrator
    if not isinstance(method, Adaptive) or not model.n_u:
        return
    if not verbose:
        print(f"tolerance   relative {method.rtol:.1e}")
        return
    q, u, _ = model.parts(method.absolute(model, prepared.times, model.x0))
    of_q, of_u = coordinate_kinds(model)
    texts = [
        f"{name} {q[of_q == kind].min():.1e} {unit} and {u[of_u == kind].min():.1e} {unit}/s"
        for kind, (name, unit) in enumerate(zip(KINDS, ("m", "rad", "kg^1/2 m"), strict=True))
        if (of_u == kind).any()
    ]
    source = "as requested" if method.atol is not None else "by the energy of the motion"
    print_folded(f"tolerances  relative {method.rtol:.1e}; absolute, {source}: {', '.join(texts)}")


def print_moved_start(prepared: Prepared) -> None:
    """Print the initial values that were changed to make them consistent with loops and constraints."""
    changes = prepared.corrections
    text = ", ".join(map(str, changes[:MOVED]))
    if len(changes) > MOVED:
        text += f", and {len(changes) - MOVED} more (all in the file's attribute `start_moved`)"
    if changes:
        print_folded(f"start       made consistent: {text}")


def _orbit_lines(prepared: Prepared) -> list[str]:
    from math import degrees

    from femflex.effectors.surroundings.earth import DAY

    orbit, table = prepared.system.orbit, prepared.case.orbit
    if orbit is None:
        g = prepared.system.environment.gravity
        weight = [f"gravity     ({', '.join(f'{a:.6g}' for a in g)}) m/s^2, inertial axes"] if g.any() else []
        return ["orbit       none", *weight]
    altitude = (table.perigee_radius - table.radius) / 1e3
    text = (
        f"orbit       {table.kind}, perigee {altitude:.6g} km over {table.radius / 1e3:.6g} km, e = "
        f"{orbit.eccentricity:.6g}"
    )
    motion = (
        f"            period {orbit.period:.6g} s, n = {orbit.mean_motion:.6g} rad/s, true anomaly "
        f"{degrees(orbit.true_anomaly):.4g} deg at t = 0"
    )
    node, perigee, anomaly = (degrees(r * DAY) for r in (orbit.node_rate, orbit.perigee_rate, orbit.anomaly_rate))
    drift = (
        f"            drifts by {node:.6g} deg (node), {perigee:.6g} deg (perigee) and {anomaly:.6g} deg (mean "
        "anomaly) per day"
    )
    return [text, motion, *([drift] if orbit.drifts else []), *_attraction_lines(prepared.system)]


def _attraction_lines(system: System) -> list[str]:
    """Describe how the central attraction acts on a large craft, and the error of its gradient."""
    from femflex.system.attraction import LARGE_RATIO, free_members, is_integrated, system_size

    extent, environment = system_size(system), system.environment
    if extent is None:
        return []
    lines = []
    if is_integrated(system) or extent.ratio > LARGE_RATIO:
        method = "integrated over points of mass" if is_integrated(system) else "by its gradient"
        start_text = " at the start" if free_members(system) else ""
        lines.append(
            f"attraction  {method}: the craft reaches {extent.size:.4g} m{start_text}, {extent.ratio:.2g} of the "
            f"distance from the centre (auto integrates from {LARGE_RATIO:g} on); the gradient has an error of "
            f"{extent.error:.2%} there"
        )
    if environment.zonals.size:
        text = ", ".join(f"J{n} = {J:.9g}" for n, J in enumerate(environment.zonals, 2))
        lines.append(f"oblateness  {text}, pole along the inertial Z axis")
    if environment.third_bodies:
        lines.append(f"tides       of {' and '.join(environment.third_bodies)}")
    return lines


def _attitude_line(prepared: Prepared) -> str:
    from math import degrees

    from femflex.rotations import letters_of

    case, system = prepared.case, prepared.system
    path, model = "attitude/angles", prepared.model
    angles = [degrees(a) + 0.0 for a in model.observation(prepared.times[:1], model.x0[None])[path][0]]  # no -0
    names = model.all_channels.channel(path).names
    sequence = system.libration_sequence
    pairs = sorted(zip(letters_of(sequence), names, angles, strict=True), key=lambda pair: pair[0])
    text = ", ".join(f"{name} {angle:.4g}" for _, name, angle in pairs)
    motion = "held" if case.attitude.held else system.joint_of(system.root).kind
    root = next((name for name, segment_names in system.segments.items() if system.root in segment_names), system.root)
    return f"attitude    {root} {motion} in the {system.frame.kind} frame: {text} deg"


def print_run_summary(run: Run, system: System, output: Path) -> None:
    """Print how the run ended and how far its monitors drifted."""
    import numpy as np

    from femflex.advice.watches import conserved_monitors

    s = run.statistics
    print(
        f"done        {output}: {s.get('accepted', 0)} steps, {s.get('rejected', 0)} rejected, "
        f"{s.get('evaluations', 0)} evaluations"
    )
    lines = [*latch_lines(run), *tank_lines(run), *limit_lines(run), *reach_lines(run, system)]
    for line in (*lines, *angle_lines(run, system.libration_sequence)):
        print(line)
    for path in conserved_monitors(system, run.without):
        print(change_line(run, path))
    if "monitors/constraint_position" in run:
        gap, speed = (float(run[f"monitors/constraint_{quantity}"].max()) for quantity in ("position", "velocity"))
        print_folded(f"monitor     constraint largest gap {gap:.3e} m, largest velocity residual {speed:.3e} m/s")
    if (norm := "monitors/quaternion_norm") in run:
        print_folded(f"monitor     largest quaternion norm error {np.abs(run[norm]).max():.2e}")


def change_line(run: Run, path: str) -> str:
    """Describe how far a monitor that ought to be constant changed, also relative to its size."""
    import numpy as np

    value = run[path]
    change = float(np.abs(value - value[0]).max())
    from femflex.advice.watches import ENERGIES

    shares = [f"monitors/{kind}" for kind in ENERGIES] if path == "monitors/energy" else [path]
    size = max(float(np.abs(run[share]).max()) for share in shares if share in run)
    zero = path != "monitors/energy" and float(np.abs(value[0]).max()) <= change  # nothing to compare with
    relative = "" if zero or not size > 0.0 else f", {change / size:.2e} of its size"
    quantity = path.split("/")[1].replace("_", " ")
    return f"monitor     {quantity} changed by up to {change:.3e} {run.unit(path)}{relative}"


def owners_of(run: Run, folder: str, channel: str) -> list[str]:
    """Names of the latches, effectors and so on that have a channel of that name."""
    head, tail = f"{folder}/", f"/{channel}"
    return sorted(path.split("/")[1] for path in run if path.startswith(head) and path.endswith(tail))


def latch_lines(run: Run) -> list[str]:
    """A line per latch: the time at which it locked and the energy lost, or the time of its release."""
    lines = []
    for name in owners_of(run, "latches", "time"):
        times = run[f"latches/{name}/time"]
        start_time, lock_time = float(times[0]), float(times[-1])
        if lock_time <= RELEASED:
            at_start = start_time <= RELEASED  # in the run that this one starts from
            release_text = "before the start" if at_start else f"at t = {RELEASED - lock_time:.9g} s"
            lines.append(f"latch       {name} was released {release_text}")
        elif lock_time < 0:
            lines.append(f"latch       {name} did not lock")
        else:
            loss = float(run[f"latches/{name}/loss"][-1])
            lines.append(f"latch       {name} locked at t = {lock_time:.9g} s, {loss:.6g} J lost")
    return lines


def tank_lines(run: Run) -> list[str]:
    """A line per tank that ran empty, and the propellant left in the others."""
    lines = []
    for name in owners_of(run, "effectors", "emptied"):
        empty_time = float(run[f"effectors/{name}/emptied"][-1])
        state = f"holds {float(run[f'effectors/{name}/mass'][-1]):.6g} kg"
        if empty_time >= 0:
            state = f"was empty at t = {empty_time:.9g} s; its thrusters gave no thrust from then on"
        lines.append(f"tank        {name} {state}")
    return lines


def limit_lines(run: Run) -> list[str]:
    """Lines on the speeds of wheels, and on wheels at a limit and slack cables: the share, first and last of the
    rows."""
    from femflex.view.units import RPM

    texts = {}
    for name in owners_of(run, "effectors", "speed"):
        rpm = run[f"effectors/{name}/speed"] * RPM
        texts[f"wheel       {name} turned at"] = f"{rpm.min():.6g} to {rpm.max():.6g} rpm"
    for name in owners_of(run, "effectors", "saturated"):
        texts[f"wheel       {name} was saturated"] = row_range_text(run, run[f"effectors/{name}/saturated"] > 0.5)
    for name in owners_of(run, "effectors", "tension"):
        if f"effectors/{name}/slack" in run:
            texts[f"cable       {name} was slack"] = row_range_text(run, run[f"effectors/{name}/slack"] > 0.0)
        elif f"effectors/{name}/distance" in run:
            texts[f"cable       {name} was slack"] = row_range_text(run, run[f"effectors/{name}/tension"] == 0.0)
    return [f"{head} {text}" for head, text in texts.items() if text]


def row_range_text(run: Run, rows: BoolArray) -> str:
    """Describe the share of these rows, and the first and the last of them; empty if there are none."""
    if not rows.any():
        return ""
    times = run.time[rows]
    return f"in {rows.mean():.0%} of the rows, first at t = {times[0]:.6g} s, last at t = {times[-1]:.6g} s"


def reach_lines(run: Run, system: System) -> list[str]:
    """Describe how far a craft with free lengths reached in orbit, and the error of the gravity gradient there."""
    from femflex.system.attraction import LARGE_RATIO, free_members, is_integrated, system_size

    if is_integrated(system):
        return []
    lengths = {name: float(run[f"bodies/{name}/length"].max()) for name in free_members(system)}
    extent = system_size(system, lengths) if lengths else None
    if extent is None or extent.ratio <= LARGE_RATIO:
        return []
    return [
        f"attraction  by its gradient: the craft reached {extent.size:.4g} m, {extent.ratio:.2g} of the distance from "
        f"the centre; the gradient has an error of {extent.error:.2%} there"
    ]


def print_verdicts(case: Case, run: Run) -> list[str]:
    """Print the expectations of the case; return the names of those that do not hold.

    They are those of the case with all terms, and are not checked for another run.
    """
    if run.without:
        if case.expect.answers:
            print("expected    not checked: they are for the case with all terms")
        return []
    from femflex.measures.verdicts import run_verdicts

    return _printed_failures(run_verdicts(case, run))


def print_modes_verdicts(case: Case) -> list[str]:
    """Print the expectations of the craft's modes; return the names of those that do not hold."""
    from femflex.measures.verdicts import expects_modes, mode_verdicts
    from femflex.pipeline.case_equilibrium import case_modes

    return _printed_failures(mode_verdicts(case, case_modes(case))) if expects_modes(case) else []


def _printed_failures(verdicts: Iterable[Verdict]) -> list[str]:
    failures = []
    for verdict in verdicts:
        print_line("expected", verdict)
        failures += [] if verdict.holds else [verdict.name]
    return failures


def angle_lines(run: Run, sequence: str) -> list[str]:
    """A line if the craft turns and its angles come near their singularity, with a sequence that stays clear."""
    import numpy as np

    from femflex.rotations import dcm_from_angles, is_symmetric, singularity_distance, vector_from_dcm

    if "attitude/angles" not in run:
        return []
    angles, names = run["attitude/angles"], run.names("attitude/angles")
    distance = float(singularity_distance(angles, sequence).min(initial=np.inf))
    if distance > SWINGING:
        return []
    C = dcm_from_angles(angles, sequence)
    travel = np.abs(vector_from_dcm(C[:-1].swapaxes(1, 2) @ C[1:])).sum(axis=0) if len(C) > 1 else np.zeros(3)
    if travel.max() < SWINGING:
        return []
    best, clear = clearest_sequence(C, "xyz"[int(travel.argmax())])
    advice_text = (
        f'Set sequence = "{best}" in [attitude]; its second angle stays {np.degrees(clear):.3g} deg away from that.'
        if clear > SWINGING
        else "Every sequence comes near its singularity in this run; read the Euler parameters bodies/NAME/attitude."
    )
    return [
        f"attitude    angle {names[1]} came within {np.degrees(distance):.2f} deg of "
        f"{'0 or 180' if is_symmetric(sequence) else '90'} deg, where {names[0]} and {names[2]} are not unique (nearer "
        f"than {np.degrees(SWINGING):.1f} deg they swing). {advice_text}"
    ]


def clearest_sequence(C: Array, axis: str) -> tuple[str, float]:
    """The sequence of three axes that stays clear of its singularity in C_PQ (n_t, 3, 3), and by how much [rad].

    One that begins with this axis goes before the others that are clear.
    """
    from femflex.rotations import ANGLE_SEQUENCES, angles_from_dcm, is_symmetric, singularity_distance

    distances = {
        sequence: float(singularity_distance(angles_from_dcm(C, sequence), sequence).min())
        for sequence in ANGLE_SEQUENCES
        if not is_symmetric(sequence)
    }
    best = max(
        distances,
        key=lambda sequence: (distances[sequence] > SWINGING, sequence[0] == axis, round(distances[sequence], 6)),
    )
    return best, distances[best]
