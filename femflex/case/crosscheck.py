"""Checks across the tables of a case: references to other entries, frames and times."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from pathlib import Path

from femflex.case.attitude import AttitudeTable
from femflex.case.body import BodyTable, FileTable, FlexibleTable, RigidTable
from femflex.case.campbell import CampbellTable
from femflex.case.initial import COMPUTED
from femflex.case.matrices import MatricesTable
from femflex.case.named_files import file_problems
from femflex.case.outline import Outline
from femflex.case.tree import bodies_without_joint, root_problems, tree_problems
from femflex.effectors.noun import MarkerPair
from femflex.effectors.sensor import Sensor
from femflex.effectors.surfaces.surface import Surface
from femflex.measures.measure import OF_CAMPBELL, MeasureTable
from femflex.noun.problems import Problem, suggestion_text, unknown_name
from femflex.system.orbit import Orbit

NEAR = 1e-9  # relative difference of two speeds that are the same


def cross_problems(outline: Outline, folder: Path) -> list[Problem]:
    """All problems between the parts of a case whose files are in that folder."""
    checks: list[Callable[[Outline], Iterator[Problem]]] = [
        frame_problems,
        gravity_problems,
        orbit_problems,
        sight_problems,
        play_problems,
        end_problems,
        member_problems,
        duplicate_name_problems,
        time_problems,
        date_problems,
        surface_problems,
        quantity_problems,
        initial_state_problems,
        diagram_problems,
    ]
    problems = list(tree_problems(outline)) or list(root_problems(outline))
    problems += [problem for check in checks for problem in check(outline)]
    return problems + list(marker_problems(outline, folder)) + list(file_problems(outline, folder))


def end_problems(outline: Outline) -> Iterator[Problem]:
    """Problems of loops, constraints and springs that do not lead between two existing bodies."""
    pairs = [
        (key_path, "child", loop.child, loop.parent) for key_path, loop in outline.loops.items() if loop is not None
    ]
    pairs += [
        (key_path, "body", item.body, item.parent) for key_path, item in outline.between.items() if item is not None
    ]
    for key_path, role, body, parent in pairs:
        for key, name in ((role, body), ("parent", parent)):
            yield from unknown_name(f"{key_path}.{key}", name, outline.bodies)
        if body == parent:
            yield Problem(key_path, f"found body {body!r} joined to itself; parent and {role} must differ")
    for key_path, item in outline.mounted.items():
        if isinstance(item, MarkerPair):
            other_end, key = (item.parent, item.parent_marker), "parent_marker"
        elif isinstance(item, Sensor) and item.other_body is not None:
            other_end, key = (item.other_body, item.other_marker), "other_marker"
        else:
            continue
        if other_end == (item.body, item.marker):
            end_text = f"marker {item.marker!r} of body {item.body!r}"
            yield Problem(key_path, f"found both ends at {end_text}; give another marker as marker or {key}")


def play_problems(outline: Outline) -> Iterator[Problem]:
    """Problems of joints of the tree that have `play`, which only loops have."""
    for key_path, joint in outline.joints.items():
        if joint is not None and "play" in joint.model_fields_set:
            yield Problem(
                f"{key_path}.play",
                f"found {joint.play:g} m on a joint of the tree, whose coordinates keep it together exactly; play "
                "belongs to an entry of [[loops]]",
            )


def orbit_problems(outline: Outline) -> Iterator[Problem]:
    """The problem of an orbit that meets the surface of its central body."""
    orbit = outline.orbit
    if orbit is not None and orbit.kind != "none" and orbit.perigee_radius < orbit.radius:
        depth = (orbit.radius - orbit.perigee_radius) / 1e3
        yield Problem(
            "orbit",
            f"found a perigee {depth:.4g} km below the surface (radius {orbit.radius:.7g} m); raise the perigee, lower "
            "the eccentricity, or give the central body's radius",
        )


def gravity_problems(outline: Outline) -> Iterator[Problem]:
    """The problem of uniform gravity together with an orbit."""
    if outline.environment is None or outline.orbit is None or outline.orbit.kind == "none":
        return
    if any(outline.environment.gravity):
        yield Problem(
            "environment.gravity",
            f"found {list(outline.environment.gravity)} m/s^2 together with an [orbit], which has the gravity of "
            "its central body; give one of them",
        )


def frame_problems(outline: Outline) -> Iterator[Problem]:
    """Problems of orbital frames without an orbit, and of pitch, yaw and roll in other frames."""
    in_orbit = outline.orbit is None or outline.orbit.kind != "none"
    if outline.attitude is not None:
        frame = outline.attitude.frame or ("orbital" if in_orbit else "inertial")
        orbital_angles = [key for key in ("pitch", "yaw", "roll") if getattr(outline.attitude, key) is not None]
        if orbital_angles and frame != "orbital":
            yield Problem(
                f"attitude.{orbital_angles[0]}",
                f"found {' and '.join(orbital_angles)} in the {frame} frame; pitch, yaw and roll are angles "
                "from the orbital frame. Give the three angles in the order of `sequence`, such as angles = "
                "['30 deg', 0, 0]",
            )
    if in_orbit:
        return
    if outline.attitude is not None and outline.attitude.frame == "orbital":
        yield Problem("attitude.frame", "found 'orbital' without an orbit; give an [orbit], or measure from 'inertial'")
    for key_path, load in outline.loads.items():
        if load is not None and load.frame == "orbital":
            yield Problem(
                f"{key_path}.frame",
                "found 'orbital' without an orbit; give an [orbit], or use 'inertial', 'body' or 'marker'",
            )


def sight_problems(outline: Outline) -> Iterator[Problem]:
    """Problems of lines of sight from bodies that do not exist, or without an orbit."""
    for key_path, sight in outline.sights.items():
        if outline.orbit is not None and outline.orbit.kind == "none":
            yield Problem(
                key_path, "found a line of sight to a ground station in a case without an [orbit]; give an [orbit]"
            )
        if sight is not None:
            yield from unknown_name(f"{key_path}.body", sight.body, outline.bodies)


def member_problems(outline: Outline) -> Iterator[Problem]:
    """Problems of members whose section or material does not exist."""
    for name, body in outline.bodies.items():
        if not isinstance(body, FlexibleTable):
            continue
        for k, member in enumerate(body.members):
            for key, table in (("section", "sections"), ("material", "materials")):
                key_path = f"bodies.{name}.members[{member.group or k}].{key}"
                yield from unknown_name(key_path, getattr(member, key), outline.names[table], f"not in [{table}]")


def duplicate_name_problems(outline: Outline) -> Iterator[Problem]:
    """Problems of names that two loads, joints or loops, constraints or springs, or sights share."""
    for table in (outline.loads, {**outline.joints, **outline.loops}, outline.between, outline.sights):
        first_paths: dict[str, str] = {}
        for key_path, item in table.items():
            name = getattr(item, "name", "")
            if name and name in first_paths:
                yield Problem(key_path, f"found the name {name!r} a second time; {first_paths[name]} has it already")
            first_paths.setdefault(name, key_path)


def time_problems(outline: Outline) -> Iterator[Problem]:
    """Problems of pictures and answers at instants that the run does not reach."""
    end = _run_length(outline)
    if end is None:
        return
    instants: list[tuple[str, float | None]] = []
    if outline.pictures is not None:
        instants += [("pictures.times", t) for t in outline.pictures.times]
        instants += [("pictures.start", outline.pictures.start), ("pictures.end", outline.pictures.end)]
    for name, answer in (outline.expect.answers if outline.expect else {}).items():
        instants += [(f"expect.{name}.{key}", getattr(answer, key)) for key in ("at", "start", "end")]
    for key_path, t in instants:
        if t is not None and not 0 <= t <= end:
            yield Problem(key_path, f"found {t:g} s; the run lasts from 0 to {end:g} s")


def date_problems(outline: Outline) -> Iterator[Problem]:
    """Problems of surroundings that are known for some years, which the run leaves."""
    end = _run_length(outline)
    if end is None or outline.environment is None or (epoch := outline.environment.epoch) is None:
        return
    last = 2000.0 + (epoch + end / 86400.0) / 365.25
    for key_path, noun in outline.surroundings.items():
        if noun is None or noun.years is None or getattr(noun, "direction", None) is not None:
            continue
        if last > noun.years[1] >= 2000.0 + epoch / 365.25:
            yield Problem(
                key_path,
                f"the run ends in the year {last:.1f}; the {noun.label} is known from {noun.years[0]:g} to "
                f"{noun.years[1]:g}, so begin earlier or end sooner",
            )


def surface_problems(outline: Outline) -> Iterator[Problem]:
    """Problems of surfaces of rigid bodies whose shapes are not given."""
    for key_path, noun in outline.mounted.items():
        if isinstance(noun, Surface):
            body = outline.bodies.get(noun.body)
            if isinstance(body, RigidTable) and not body.shapes:
                yield Problem(
                    key_path,
                    f"body {noun.body!r} is rigid and has no shapes, so its surface is not known; give it shapes",
                )


def _run_length(outline: Outline) -> float | None:
    """Duration of the run [s], as far as it is known."""
    if outline.run is None or outline.run.duration is not None or outline.orbit is None or outline.orbit.kind == "none":
        return None if outline.run is None else outline.run.duration
    return outline.run.length(outline.orbit.period)


def quantity_problems(outline: Outline) -> Iterator[Problem]:
    """Problems of quantities and pictures whose bodies do not exist."""
    measures: list[tuple[str, MeasureTable]] = [
        (f"expect.{name}", answer) for name, answer in (outline.expect.answers if outline.expect else {}).items()
    ]
    if outline.study is not None:
        measures.append(("study.quantity", outline.study.quantity))
        yield from unknown_name("study.body", outline.study.body, outline.bodies)
    for key_path, measure in measures:
        yield from unknown_name(f"{key_path}.body", measure.body, outline.bodies)
    for k, body in enumerate(outline.pictures.modes if outline.pictures else []):
        yield from unknown_name(f"pictures.modes[{k}]", body, outline.bodies)
        if isinstance(outline.bodies.get(body), RigidTable):
            yield Problem(f"pictures.modes[{k}]", f"found {body!r}, which is rigid and has no modes to draw")


def initial_state_problems(outline: Outline) -> Iterator[Problem]:
    """Problems of bodies with an initial state in a craft that starts from a result file."""
    if outline.initial is None or outline.initial.source in (None, *COMPUTED):
        return
    for name, body in outline.bodies.items():
        if body is not None and body.initial is not None:
            yield Problem(
                f"bodies.{name}.initial",
                f"found an initial state of the body together with [initial] from = "
                f"{outline.initial.source!r}, which sets the whole craft; remove one of them",
            )


def spin_problems(table: CampbellTable, attitude: AttitudeTable, orbit: Orbit) -> Iterator[Problem]:
    """Problems of a craft without a selectable spin speed or without a spin axis."""
    if orbit.kind != "none":
        yield Problem("campbell", "found an [orbit], on which no spin speed is steady; remove [orbit] or [campbell]")
    elif table.axis is None and not any(attitude.spin or ()):
        yield Problem(
            "campbell.axis",
            "found no axis to spin about; give axis = [0, 0, 1], or [attitude] frame = 'spinning' and a spin about it",
        )


def diagram_problems(outline: Outline) -> Iterator[Problem]:
    """Problems of a Campbell diagram without a spin, and of answers at speeds that it does not have."""
    table, attitude, orbit = outline.campbell, outline.attitude, outline.orbit
    if table is not None and attitude is not None and orbit is not None:
        yield from spin_problems(table, attitude, orbit)
    for name, answer in (outline.expect.answers if outline.expect else {}).items():
        if answer.of != OF_CAMPBELL or answer.speed is None:
            continue
        if table is None:
            yield Problem(f"expect.{name}.of", f"found {OF_CAMPBELL!r} in a case without a [campbell]; give one")
        elif min(abs(speed - answer.speed) for speed in table.speeds) > NEAR * table.speeds[-1]:
            text = ", ".join(f"{speed / table.speeds.scale:.6g}" for speed in table.speeds[:8])
            yield Problem(
                f"expect.{name}.speed",
                f"found {answer.speed / table.speeds.scale:.6g} {table.speeds.unit}, which is none of the diagram's "
                f"{len(table.speeds)} speeds ({text}{', ...' if len(table.speeds) > 8 else ''})",
            )


def known_markers(body: BodyTable | None) -> set[str] | None:
    """Marker names of a body as far as the case file defines them; None if only a body file does."""
    if body is None or isinstance(body, FileTable):
        return None
    names = {"origin", *body.markers}
    if isinstance(body, FlexibleTable | MatricesTable):
        names |= {*getattr(body.reduction, "clamp", {}), *getattr(body.reduction, "interfaces", [])}
    return names | set(body.built_in_markers())


def marker_problems(outline: Outline, folder: Path) -> Iterator[Problem]:
    """Problems of joints, loads, sights, attitude and initial states whose markers are not on their bodies."""
    references: list[tuple[str, str | None, str | None]] = []
    for key_path, joint in [*outline.joints.items(), *outline.loops.items()]:
        if joint is not None:
            references.append((f"{key_path}.child_marker", joint.child, joint.child_marker))
            if joint.parent != joint.child:
                references.append((f"{key_path}.parent_marker", joint.parent, joint.parent_marker))
    for key_path, load in outline.loads.items():
        if load is not None:
            yield from unknown_name(f"{key_path}.body", load.body, outline.bodies)
            references.append((f"{key_path}.marker", load.body, load.marker))
    references += [
        (f"{key_path}.marker", sight.body, sight.marker)
        for key_path, sight in outline.sights.items()
        if sight is not None
    ]
    for key_path, mounted in outline.mounted.items():
        pairs = (
            () if mounted is None else (("body", "marker"), ("other_body", "other_marker"), ("parent", "parent_marker"))
        )
        for role, marker_key in pairs:
            body_name = getattr(mounted, role, None)
            yield from unknown_name(f"{key_path}.{role}", body_name, outline.bodies)
            references.append((f"{key_path}.{marker_key}", body_name, getattr(mounted, marker_key, None)))
    for key_path, item in outline.between.items():
        if item is not None:
            references += [
                (f"{key_path}.marker", item.body, item.marker),
                (f"{key_path}.parent_marker", item.parent, item.parent_marker),
            ]
    for name, body in outline.bodies.items():
        if body is not None and body.initial is not None:
            references.append((f"bodies.{name}.initial.marker", name, body.initial.marker))
    loose = bodies_without_joint(outline)
    if outline.attitude is not None and loose:
        references.append(("attitude.marker", outline.attitude.root or loose[0], outline.attitude.marker))
    for key_path, owner, marker in references:
        names = known_markers(outline.bodies.get(owner or ""))
        if marker is not None and names is not None and marker not in names:
            text = f"found {marker!r}, which is no marker of body {owner!r}; {suggestion_text(marker, names)}"
            yield Problem(key_path, text + _group_hint(outline.bodies.get(owner or ""), owner, marker, folder))


def _group_hint(body: BodyTable | None, owner: str | None, marker: str, folder: Path) -> str:
    """The advice to declare a marker whose name is that of a group of the body's mesh."""
    if not isinstance(body, FlexibleTable) or body.mesh is None or not os.path.isfile(folder / body.mesh):
        return ""
    from femflex.mesh import read_mesh

    try:
        groups = {*read_mesh(folder / body.mesh).groups, *body.groups}
    except (ValueError, OSError):  # reported where the mesh is read
        return ""
    if marker not in groups:
        return ""
    return f". {body.mesh} has a group of that name: declare it, markers.{marker} = {{}} in [bodies.{owner}]"
