"""Checks across the tables of a case: names that refer to others, frames and times."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

from femflex.case.body import FlexibleTable, RigidTable
from femflex.case.diagrams import diagrams
from femflex.case.initial import EQUILIBRIUM
from femflex.case.measure import MeasureTable
from femflex.case.named_files import files
from femflex.case.named_markers import markers
from femflex.case.outline import Outline
from femflex.case.problems import Problem, near
from femflex.case.sensor import SensorTable
from femflex.case.tree import root, tree
from femflex.case.wheel import CableTable, SeparationTable


def cross_problems(outline: Outline, folder: Path) -> list[Problem]:
    """Everything wrong between the parts of a case whose files lie in that folder."""
    checks: list[Callable[[Outline], Iterator[Problem]]] = [
        frames,
        surroundings,
        sights,
        plays,
        ends,
        members,
        doubles,
        times,
        answers,
        starts,
        diagrams,
    ]
    found = list(tree(outline)) or list(root(outline))
    found += [problem for check in checks for problem in check(outline)]
    return found + list(markers(outline, folder)) + list(files(outline, folder))


def ends(outline: Outline) -> Iterator[Problem]:
    """Loops, constraints and springs lead between two bodies that exist."""
    pairs = [(where, "child", loop.child, loop.parent) for where, loop in outline.loops.items() if loop is not None]
    pairs += [(where, "body", item.body, item.parent) for where, item in outline.between.items() if item is not None]
    for where, role, body, parent in pairs:
        for key, name in ((role, body), ("parent", parent)):
            if name is not None and name not in outline.bodies:
                yield Problem(f"{where}.{key}", f"found {name!r}, which is not a body; {near(name, outline.bodies)}")
        if body == parent:
            yield Problem(where, f"found body {body!r} joined to itself; parent and {role} must differ")
    for where, item in outline.mounted.items():
        if isinstance(item, CableTable | SeparationTable):
            other, key = (item.parent, item.parent_marker), "parent_marker"
        elif isinstance(item, SensorTable) and item.other_body is not None:
            other, key = (item.other_body, item.other_marker), "other_marker"
        else:
            continue
        if other == (item.body, item.marker):
            what = f"marker {item.marker!r} of body {item.body!r}"
            yield Problem(where, f"found both ends at {what}; give another marker as marker or {key}")


def plays(outline: Outline) -> Iterator[Problem]:
    """Play belongs to loops."""
    for where, joint in outline.joints.items():
        if joint is not None and "play" in joint.model_fields_set:
            yield Problem(
                f"{where}.play",
                f"found {joint.play:g} m on a joint of the tree, whose coordinates keep it together exactly; play "
                "belongs to an entry of [[loops]]",
            )


def surroundings(outline: Outline) -> Iterator[Problem]:
    """Uniform gravity is that of the ground."""
    if outline.environment is None or outline.orbit is None or outline.orbit.kind == "none":
        return
    if any(outline.environment.gravity):
        yield Problem(
            "environment.gravity",
            f"found {list(outline.environment.gravity)} m/s^2 together with an [orbit], which has the gravity of "
            "its central body; give one of them",
        )


def frames(outline: Outline) -> Iterator[Problem]:
    """Orbital frames need an orbit, and pitch, yaw and roll the orbital frame."""
    in_orbit = outline.orbit is None or outline.orbit.kind != "none"
    if outline.attitude is not None:
        frame = outline.attitude.frame or ("orbital" if in_orbit else "inertial")
        named = [key for key in ("pitch", "yaw", "roll") if getattr(outline.attitude, key) is not None]
        if named and frame != "orbital":
            yield Problem(
                f"attitude.{named[0]}",
                f"found {' and '.join(named)} in the {frame} frame; pitch, yaw and roll are angles from the orbital "
                "frame. Give the three angles in the order of `sequence`, such as angles = ['30 deg', 0, 0]",
            )
    if in_orbit:
        return
    if outline.attitude is not None and outline.attitude.frame == "orbital":
        yield Problem("attitude.frame", "found 'orbital' without an orbit; give an [orbit], or measure from 'inertial'")
    for where, load in outline.loads.items():
        if load is not None and load.frame == "orbital":
            yield Problem(
                f"{where}.frame",
                "found 'orbital' without an orbit; give an [orbit], or use 'inertial', 'body' or 'marker'",
            )


def sights(outline: Outline) -> Iterator[Problem]:
    """Sights look from bodies that exist at a station that an orbit passes over."""
    for where, sight in outline.sights.items():
        if outline.orbit is not None and outline.orbit.kind == "none":
            yield Problem(
                where, "found a line of sight to a ground station in a case without an [orbit]; give an [orbit]"
            )
        if sight is not None and sight.body not in outline.bodies:
            yield Problem(
                f"{where}.body", f"found {sight.body!r}, which is not a body; {near(sight.body, outline.bodies)}"
            )


def members(outline: Outline) -> Iterator[Problem]:
    """Members name sections and materials that exist, and every section of material has one."""
    for name, body in outline.bodies.items():
        if not isinstance(body, FlexibleTable):
            continue
        for k, member in enumerate(body.members):
            for key, table in (("section", "sections"), ("material", "materials")):
                wanted = getattr(member, key)
                if wanted is not None and wanted not in outline.names[table]:
                    where = f"bodies.{name}.members[{member.group or k}].{key}"
                    yield Problem(
                        where, f"found {wanted!r}, which is not in [{table}]; {near(wanted, outline.names[table])}"
                    )


def doubles(outline: Outline) -> Iterator[Problem]:
    """Names of loads, of joints and loops, of constraints and springs, and of sights are given once."""
    for table in (outline.loads, {**outline.joints, **outline.loops}, outline.between, outline.sights):
        seen: dict[str, str] = {}
        for where, item in table.items():
            name = getattr(item, "name", "")
            if name and name in seen:
                yield Problem(where, f"found the name {name!r} a second time; {seen[name]} has it already")
            seen.setdefault(name, where)


def times(outline: Outline) -> Iterator[Problem]:
    """Pictures and answers ask for instants the run reaches."""
    end = _length(outline)
    if end is None:
        return
    asked: list[tuple[str, float | None]] = []
    if outline.pictures is not None:
        asked += [("pictures.times", t) for t in outline.pictures.times]
        asked += [("pictures.start", outline.pictures.start), ("pictures.end", outline.pictures.end)]
    for name, answer in (outline.expect.answers if outline.expect else {}).items():
        asked += [(f"expect.{name}.{key}", getattr(answer, key)) for key in ("at", "start", "end")]
    for where, t in asked:
        if t is not None and not 0 <= t <= end:
            yield Problem(where, f"found {t:g} s; the run lasts from 0 to {end:g} s")


def _length(outline: Outline) -> float | None:
    """Duration of the run [s], as far as it is known."""
    if outline.run is None or outline.run.duration is not None or outline.orbit is None or outline.orbit.kind == "none":
        return None if outline.run is None else outline.run.duration
    return outline.run.length(outline.orbit.period)


def answers(outline: Outline) -> Iterator[Problem]:
    """Quantities name bodies that exist and channels that will be in the result file."""
    measures: list[tuple[str, MeasureTable]] = [
        (f"expect.{name}", answer) for name, answer in (outline.expect.answers if outline.expect else {}).items()
    ]
    if outline.study is not None:
        measures.append(("study.quantity", outline.study.quantity))
        if outline.study.body is not None and outline.study.body not in outline.bodies:
            yield Problem(
                "study.body",
                f"found {outline.study.body!r}, which is not a body; {near(outline.study.body, outline.bodies)}",
            )
    for where, measure in measures:
        if measure.body is not None and measure.body not in outline.bodies:
            yield Problem(
                f"{where}.body", f"found {measure.body!r}, which is not a body; {near(measure.body, outline.bodies)}"
            )
    for k, body in enumerate(outline.pictures.modes if outline.pictures else []):
        if body not in outline.bodies:
            yield Problem(f"pictures.modes[{k}]", f"found {body!r}, which is not a body; {near(body, outline.bodies)}")
        elif isinstance(outline.bodies[body], RigidTable):
            yield Problem(f"pictures.modes[{k}]", f"found {body!r}, which is rigid and has no modes to draw")


def starts(outline: Outline) -> Iterator[Problem]:
    """A craft that starts where a result file ends needs no other start of its bodies."""
    if outline.initial is None or outline.initial.source in (None, EQUILIBRIUM):
        return
    for name, body in outline.bodies.items():
        if body is not None and body.initial is not None:
            yield Problem(
                f"bodies.{name}.initial",
                f"found an initial state of the body together with [initial] from = "
                f"{outline.initial.source!r}, which sets the whole craft; remove one of them",
            )
