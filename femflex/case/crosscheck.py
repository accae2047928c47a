"""Checks across the tables of a case: names that refer to others, files, frames and times."""

from __future__ import annotations

import tomllib
from collections.abc import Callable, Iterator
from pathlib import Path

from femflex.case.body import BodyTable, FileTable, FlexibleTable, RigidTable
from femflex.case.case import Case
from femflex.case.diagrams import diagrams
from femflex.case.initial import EQUILIBRIUM
from femflex.case.measure import MeasureTable
from femflex.case.outline import Outline, outline
from femflex.case.problems import Problem, listed, near
from femflex.case.shape import MeshShape
from femflex.case.tree import loose_bodies, root, tree


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
            f"found {list(outline.environment.gravity)} m/s^2 beside an [orbit], whose gravity is that of the central "
            "body; give one of them",
        )


def frames(outline: Outline) -> Iterator[Problem]:
    """Orbital frames need an orbit."""
    if outline.orbit is None or outline.orbit.kind != "none":
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
                where, "found a sight, which looks at a station on the Earth, without an orbit; give an [orbit]"
            )
        if sight is not None and sight.body not in outline.bodies:
            yield Problem(
                f"{where}.body", f"found {sight.body!r}, which is not a body; {near(sight.body, outline.bodies)}"
            )


def known_markers(body: BodyTable | None) -> set[str] | None:
    """Marker names of a body as far as the case file tells; None when only its file knows."""
    if body is None or isinstance(body, FileTable):
        return None
    known = {"origin", *body.markers}
    if isinstance(body, FlexibleTable):
        known |= {*getattr(body.reduction, "clamp", {}), *getattr(body.reduction, "interfaces", [])}
    return known | set(body.own_markers())


def markers(outline: Outline, folder: Path) -> Iterator[Problem]:
    """Markers of joints, loads, sights, attitude and initial states are on their bodies."""
    places: list[tuple[str, str | None, str | None]] = []
    for where, joint in [*outline.joints.items(), *outline.loops.items()]:
        if joint is not None:
            places.append((f"{where}.child_marker", joint.child, joint.child_marker))
            if joint.parent != joint.child:
                places.append((f"{where}.parent_marker", joint.parent, joint.parent_marker))
    for where, load in outline.loads.items():
        if load is not None:
            if load.body not in outline.bodies:
                yield Problem(
                    f"{where}.body", f"found {load.body!r}, which is not a body; {near(load.body, outline.bodies)}"
                )
            places.append((f"{where}.marker", load.body, load.marker))
    places += [(f"{where}.marker", one.body, one.marker) for where, one in outline.sights.items() if one is not None]
    for where, item in outline.between.items():
        if item is not None:
            places += [
                (f"{where}.marker", item.body, item.marker),
                (f"{where}.parent_marker", item.parent, item.parent_marker),
            ]
    for name, body in outline.bodies.items():
        if body is not None and body.initial is not None:
            places.append((f"bodies.{name}.initial.marker", name, body.initial.marker))
    loose = loose_bodies(outline)
    if outline.attitude is not None and loose:
        places.append(("attitude.marker", outline.attitude.root or loose[0], outline.attitude.marker))
    for where, owner, marker in places:
        known = known_markers(outline.bodies.get(owner or ""))
        if marker is not None and known is not None and marker not in known:
            told = f"found {marker!r}, which is no marker of body {owner!r}; {near(marker, known)}"
            yield Problem(where, told + _as_group(outline.bodies.get(owner or ""), owner, marker, folder))


def _as_group(body: BodyTable | None, owner: str | None, marker: str, folder: Path) -> str:
    """The advice to declare a marker whose name is that of a group of the body's mesh."""
    if not isinstance(body, FlexibleTable) or not (folder / body.mesh).is_file():
        return ""
    from femflex.mesh import read_mesh

    try:
        groups = {*read_mesh(folder / body.mesh).groups, *body.groups}
    except (ValueError, OSError):  # told where the mesh is read
        return ""
    if marker not in groups:
        return ""
    return f". {body.mesh} has a group of that name: declare it, markers.{marker} = {{}} in [bodies.{owner}]"


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
    if outline.run is None or outline.run.duration is None:
        return
    end = outline.run.duration
    asked: list[tuple[str, float | None]] = []
    if outline.pictures is not None:
        asked += [("pictures.times", t) for t in outline.pictures.times]
        asked += [("pictures.start", outline.pictures.start), ("pictures.end", outline.pictures.end)]
    for name, answer in (outline.expect.answers if outline.expect else {}).items():
        asked += [(f"expect.{name}.{key}", getattr(answer, key)) for key in ("at", "start", "end")]
    for where, t in asked:
        if t is not None and not 0 <= t <= end:
            yield Problem(where, f"found {t:g} s; the run lasts from 0 to {end:g} s")


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
                f"found a start of the body beside [initial] from = {outline.initial.source!r}, which says how the "
                "whole craft starts; leave one of them out",
            )


def files(outline: Outline, folder: Path) -> Iterator[Problem]:
    """Files named in the case exist."""
    for where, name in _named_files(outline):
        path = folder / name
        if path.is_dir():
            yield Problem(where, f"found {name!r}, which is a folder; give the name of a file in it")
        elif not path.is_file():
            near_by = sorted(p.name for p in path.parent.glob(f"*{path.suffix}")) if path.parent.is_dir() else []
            told = (
                f"{path.parent} holds {listed(near_by[:8])}"
                if near_by
                else f"{path.parent} has no {path.suffix or 'such'} files"
                if path.parent.is_dir()
                else f"there is no folder {path.parent}"
            )
            yield Problem(
                where, f"found {name!r}, which does not exist; names are relative to the case file, and {told}"
            )


def input_files(case: Case) -> list[Path]:
    """The case file and all files it names."""
    named = _named_files(outline(tomllib.loads(case.text)))
    return [case.path, *(case.path.parent / name for _, name in named)]


def check_no_input(case: Case, output: Path) -> None:
    """Raise ValueError when the file to be written is one that the case is made of."""
    for path in input_files(case):
        if path.exists() and output.exists() and path.samefile(output):
            raise ValueError(f"{output} is an input of this case and would be lost; choose another --output")


def _named_files(outline: Outline) -> Iterator[tuple[str, str]]:
    for name, body in outline.bodies.items():
        if isinstance(body, FlexibleTable):
            yield f"bodies.{name}.mesh", body.mesh
        if isinstance(body, FileTable):
            yield f"bodies.{name}.file", body.file
        if isinstance(body, RigidTable):
            yield from (
                (f"bodies.{name}.shapes[{k}].file", s.file)
                for k, s in enumerate(body.shapes)
                if isinstance(s, MeshShape)
            )
    if outline.initial is not None and outline.initial.source not in (None, EQUILIBRIUM):
        yield "initial.from", outline.initial.source
    for where, load in outline.loads.items():
        if load is not None and load.table is not None:
            yield f"{where}.table", load.table
